//! What the numbers of a message are called, and their units where the type says them.

use super::message::Numbers;

/// The prefix and unit of each list of a joint state.
const JOINTS: [(&str, &str, &str); 3] = [("position_", "angle", "rad"), ("velocity_", "vel", "rad/s"), ("effort_", "torque", "N m")];

/// Units by the end of a type's name and a part of the path, by the comments of the definitions of ROS.
const UNITS: [(&str, &str, &str); 11] = [
    ("Pose", "position.", "m"),
    ("Point", "", "m"),
    ("Odometry", "position.", "m"),
    ("Odometry", "linear.", "m/s"),
    ("Odometry", "angular.", "rad/s"),
    ("Twist", "linear.", "m/s"),
    ("Twist", "angular.", "rad/s"),
    ("Accel", "linear.", "m/s^2"),
    ("Accel", "angular.", "rad/s^2"),
    ("Imu", "angular_velocity.", "rad/s"),
    ("Imu", "linear_acceleration.", "m/s^2"),
];

/// The name and unit of each number of a message of type `schema`.
pub(super) fn channel_names(schema: &str, first: &Numbers) -> Vec<(String, Option<&'static str>)> {
    let kind = schema.rsplit('/').next().unwrap_or(schema);
    let kind = kind.strip_suffix("Stamped").unwrap_or(kind);
    first.paths.iter().map(|path| named(kind, path, &first.names)).collect()
}

fn named(kind: &str, path: &str, names: &[String]) -> (String, Option<&'static str>) {
    if kind == "JointState" {
        for (list, prefix, unit) in JOINTS {
            if let Some(name) = path.strip_prefix(list).and_then(|k| k.parse::<usize>().ok()).and_then(|k| names.get(k)) {
                return (format!("{prefix}_{name}"), Some(unit));
            }
        }
    }
    if kind == "Wrench" {
        for (part, unit) in [("force", "N"), ("torque", "N m")] {
            if let Some((_, axis)) = path.rsplit_once('.').filter(|(before, _)| before.ends_with(part)) {
                return (format!("{part}_{axis}"), Some(unit));
            }
        }
    }
    let unit = UNITS.iter().find(|(of, part, _)| kind == *of && path.contains(part) && !path.contains("covariance")).map(|(.., unit)| *unit);
    (path.to_owned(), unit)
}
