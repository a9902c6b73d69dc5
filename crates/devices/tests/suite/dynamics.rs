//! Rigid-body dynamics against Pinocchio and MuJoCo: the files and their script are in tests/reference_devices.

use ndof_devices::{DeviceConfig, RobotConfig, SerialChain, TERMS_OF_A_LINK, base_parameters};
use ndof_models::robot::{EndpointKinematics, Robot};
use std::path::PathBuf;

/// Another implementation's double precision, through matrices of condition up to 1e3.
pub const AGAINST_ANOTHER_ENGINE: f64 = 1e-10;

pub fn reference_file(name: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "..", "tests", "reference_devices", name].iter().collect();
    path.to_string_lossy().into_owned()
}

/// Column names and rows of a reference file.
pub fn table(name: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(reference_file(name)).expect(name);
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let header = lines.next().expect("a header").split(',').map(str::to_owned).collect();
    let rows = lines.map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect()).collect();
    (header, rows)
}

/// Largest difference over the largest entry of the reference.
fn relative(found: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(found.len(), reference.len());
    let scale = reference.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
    found.iter().zip(reference).fold(0.0_f64, |worst, (f, r)| worst.max((f - r).abs())) / scale.max(1e-300)
}

fn urdf(name: &str, axes: &[&str], home: &[f64]) -> Box<dyn Robot> {
    let mut config = DeviceConfig::from_file(&reference_file(name));
    config.axes = Some(axes.iter().map(|a| (*a).to_owned()).collect());
    config.home_rad = Some(home.to_vec());
    config.build().expect("builds").robot
}

/// Compares a robot with every state of a reference file; `shift` is the base's place, `components` the tip's rows that are axes.
pub fn compare(robot: &dyn Robot, file: &str, shift: [f64; 3], components: &[usize], drift_tolerance: f64) {
    let n = robot.joints().count();
    let (header, rows) = table(file);
    assert!(rows.len() >= 20);
    let (mut mass, mut bias, mut kinematics) = (vec![0.0; n * n], vec![0.0; n], EndpointKinematics::new(robot.axes().len(), n));
    let (mut acceleration, mut work) = (vec![0.0; n], vec![0.0; n * n]);
    for row in &rows {
        let (q, rest) = row.split_at(n);
        let (rates, rest) = rest.split_at(n);
        let (reference_mass, rest) = rest.split_at(n * n);
        let (reference_bias, tip) = rest.split_at(n);
        robot.mass_matrix(q, &mut mass);
        assert!(relative(&mass, reference_mass) < AGAINST_ANOTHER_ENGINE, "{file}: mass matrix {mass:?} for {reference_mass:?}");
        robot.bias(q, rates, &mut bias);
        assert!(relative(&bias, reference_bias) < AGAINST_ANOTHER_ENGINE, "{file}: bias {bias:?} for {reference_bias:?}");
        robot.kinematics(q, rates, &mut kinematics);
        // Forward dynamics of a unit torque: H q̈ + h = τ.
        let torque = vec![1.0; n];
        robot.acceleration(q, rates, &kinematics, &torque, &mut work, &mut acceleration);
        let back: Vec<f64> = (0..n).map(|i| bias[i] + (0..n).map(|j| mass[i * n + j] * acceleration[j]).sum::<f64>()).collect();
        let size = bias.iter().fold(1.0_f64, |s, b| s.max(b.abs()));
        assert!(back.iter().all(|t| (t - 1.0).abs() < 1e-10 * size), "{file}: {back:?}");
        if header.len() == 2 * n + n * n + n {
            continue;
        }
        for (axis, &c) in components.iter().enumerate() {
            let place = kinematics.endpoint[axis] - shift[c];
            assert!((place - tip[c]).abs() < AGAINST_ANOTHER_ENGINE, "{file}: {place} for {}", tip[c]);
            let reference = &tip[3 + c * n..3 + (c + 1) * n];
            let found = &kinematics.jacobian[axis * n..(axis + 1) * n];
            assert!(found.iter().zip(reference).all(|(f, r)| (f - r).abs() < AGAINST_ANOTHER_ENGINE), "{file}: {found:?} for {reference:?}");
            let drift = tip[3 + 3 * n + c];
            assert!(
                (kinematics.jacobian_rate[axis] - drift).abs() < drift_tolerance * (1.0 + drift.abs()),
                "{file}: {} for {drift}",
                kinematics.jacobian_rate[axis]
            );
        }
    }
}

#[test]
fn chains_from_urdf_agree_with_pinocchio() {
    compare(urdf("two_link.urdf", &["x", "y"], &[0.5, 1.0]).as_ref(), "chain_two_link.csv", [0.0; 3], &[0, 1], AGAINST_ANOTHER_ENGINE);
    compare(urdf("three_link.urdf", &["x", "y", "z"], &[0.3, 0.1, 0.8]).as_ref(), "chain_three_link.csv", [0.0; 3], &[0, 1, 2], AGAINST_ANOTHER_ENGINE);
    let home = [0.1, 0.4, 0.9, 0.2, 0.5, -0.3];
    compare(urdf("six_joint.urdf", &["x", "y", "z"], &home).as_ref(), "chain_six_joint.csv", [0.0; 3], &[0, 1, 2], AGAINST_ANOTHER_ENGINE);
}

/// Shapes, classes, angles of all kinds, offsets, several joints in a body.
#[test]
fn chains_from_mjcf_agree_with_mujoco() {
    for name in ["mjcf_arm", "mjcf_gantry"] {
        let chain = at_the_tip(&format!("{name}.xml"));
        compare(&chain, &format!("chain_{name}.csv"), [0.0; 3], &[0, 1, 2], AGAINST_ANOTHER_ENGINE);
    }
}

/// The chain of a file, its tip in x, y, z as axes.
fn at_the_tip(name: &str) -> SerialChain {
    let mut config = read(name);
    config.axes = ["x", "y", "z"].map(str::to_owned).to_vec();
    config.chain().expect("builds")
}

#[test]
fn the_wrist_agrees_with_pinocchio() {
    compare(DeviceConfig::named("wrist").build().expect("builds").robot.as_ref(), "wrist.csv", [0.0; 3], &[], AGAINST_ANOTHER_ENGINE);
}

#[test]
fn the_five_bar_agrees_with_mujoco() {
    let robot = DeviceConfig::named("mit-manus").build().expect("builds").robot;
    // MuJoCo gives no J̇ q̇; the script differentiates J with a step of 1e-4: h⁴ and ε/h bound it to 1e-9.
    compare(robot.as_ref(), "five_bar.csv", [0.0, -0.65, 0.0], &[0, 1], 1e-9);
}

pub fn read(name: &str) -> RobotConfig {
    parsed(name, &std::fs::read_to_string(reference_file(name)).expect(name))
}

/// The robot in a text; a plate beside the way to the tip is an end of the arm, too.
pub fn parsed(name: &str, text: &str) -> RobotConfig {
    RobotConfig::parse(name, text, name.ends_with("mjcf_arm.xml").then_some("tip")).expect("reads")
}

fn chain(name: &str) -> SerialChain {
    read(name).chain().expect("builds")
}

#[test]
fn torques_are_linear_in_the_inertial_parameters_and_the_regressor_is_pinocchio_s() {
    for name in ["three_link", "six_joint"] {
        let (chain, (_, rows)) = (chain(&format!("{name}.urdf")), table(&format!("regressor_{name}.csv")));
        let (n, inertial) = (chain.joints().count(), chain.inertial_parameters());
        let bodies = TERMS_OF_A_LINK * n;
        for row in &rows {
            let (q, rest) = row.split_at(n);
            let (rates, rest) = rest.split_at(n);
            let (accelerations, rest) = rest.split_at(n);
            let (torque, reference) = rest.split_at(n);
            let regressor = chain.regressor(q, rates, accelerations);
            let found: Vec<f64> = regressor.outer_iter().flat_map(|row| row.iter().take(bodies).copied().collect::<Vec<_>>()).collect();
            assert!(relative(&found, reference) < AGAINST_ANOTHER_ENGINE, "{name}: {found:?}");
            let mut own = vec![0.0; n];
            chain.inverse_dynamics(q, rates, accelerations, &mut own);
            assert!(relative(&own, torque) < AGAINST_ANOTHER_ENGINE, "{name}: {own:?} for {torque:?}");
            let linear: Vec<f64> = regressor.outer_iter().map(|row| row.iter().zip(&inertial).map(|(y, p)| y * p).sum()).collect();
            assert!(relative(&linear, torque) < AGAINST_ANOTHER_ENGINE, "{name}: {linear:?} for {torque:?}");
            // Other parameters, some of which no body has.
            let others: Vec<f64> = inertial.iter().enumerate().map(|(k, p)| p + 0.3 * (k as f64).sin()).collect();
            let linear: Vec<f64> = regressor.outer_iter().map(|row| row.iter().zip(&others).map(|(y, p)| y * p).sum()).collect();
            let other = chain.clone().with_inertial_parameters(&others).expect("each has a mass");
            other.inverse_dynamics(q, rates, accelerations, &mut own);
            assert!(relative(&own, &linear) < AGAINST_ANOTHER_ENGINE, "{name}: {own:?} for {linear:?}");
        }
    }
}

#[test]
fn a_body_with_a_moment_and_no_mass_is_none() {
    let chain = chain("three_link.urdf");
    let mut inertial = chain.inertial_parameters();
    inertial[0] = 0.0;
    assert!(inertial[1..4].iter().any(|moment| *moment != 0.0) && chain.with_inertial_parameters(&inertial).is_none());
}

#[test]
fn base_parameters_say_all_that_the_torques_do_and_are_as_many_as_the_rank() {
    for name in ["three_link", "six_joint"] {
        let chain = chain(&format!("{name}.urdf"));
        let (n, inertial) = (chain.joints().count(), chain.inertial_parameters());
        let text = std::fs::read_to_string(reference_file(&format!("regressor_{name}.csv"))).expect(name);
        let rank: usize = text.lines().next().and_then(|l| l.rsplit(": ").next()).and_then(|r| r.parse().ok()).expect("the count");
        let base = base_parameters(&chain);
        assert_eq!(base.iter().filter(|b| b.column < TERMS_OF_A_LINK * n).count(), rank, "{base:#?}");
        for row in &table(&format!("regressor_{name}.csv")).1 {
            let regressor = chain.regressor(&row[..n], &row[n..2 * n], &row[2 * n..3 * n]);
            let told: Vec<f64> = regressor.outer_iter().map(|y| base.iter().map(|b| y[b.column] * b.value(&inertial)).sum()).collect();
            assert!(relative(&told, &row[3 * n..4 * n]) < AGAINST_ANOTHER_ENGINE, "{name}: {told:?}");
        }
    }
}

/// Two links of a plane: the textbook's regrouping MX₁ + l m₂, ZZ₁ + l² m₂, with the rotors.
#[test]
fn the_base_parameters_of_a_planar_arm_are_those_of_the_textbook() {
    let joint = |name: &str, at: f64| {
        format!("[[joints]]\nname = \"{name}\"\norigin_m = [{at}, 0, 0]\nmass_kg = 1\ncentre_m = [0.1, 0, 0]\ninertia_kg_m2 = [0.1, 0.1, 0.1, 0, 0, 0]\n")
    };
    let text = format!("schema = \"ndof/robot/1\"\nname = \"arm\"\ngravity_m_per_s2 = [0, -9.81, 0]\n{}{}", joint("shoulder", 0.0), joint("elbow", 0.4));
    let chain = RobotConfig::parse("arm.toml", &text, None).expect("reads").chain().expect("builds");
    let names: Vec<String> = base_parameters(&chain).into_iter().map(|b| b.name).collect();
    assert_eq!(
        names,
        [
            "moment_x_shoulder_kg_m + 0.4 mass_elbow_kg",
            "moment_y_shoulder_kg_m",
            "inertia_zz_shoulder_kg_m2 + 0.16 mass_elbow_kg + rotor_shoulder_kg_m2",
            "moment_x_elbow_kg_m",
            "moment_y_elbow_kg_m",
            "inertia_zz_elbow_kg_m2",
            "rotor_elbow_kg_m2"
        ]
    );
}

/// Every reference file belongs to a test above.
#[test]
fn no_reference_file_is_left_over() {
    let used = [
        "chain_two_link.csv",
        "chain_three_link.csv",
        "chain_six_joint.csv",
        "wrist.csv",
        "five_bar.csv",
        "regressor_three_link.csv",
        "regressor_six_joint.csv",
        "chain_mjcf_arm.csv",
        "chain_mjcf_gantry.csv",
        "chain_corrected_three_link.csv",
        "chain_corrected_mjcf_arm.csv",
        "chain_corrected_mjcf_gantry.csv",
        "motion_five_bar.csv",
        "motion_wrist.csv",
        "motion_three_link.csv",
    ];
    let mut found: Vec<String> =
        std::fs::read_dir(reference_file("")).expect("the folder").map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    found.retain(|name| name.ends_with(".csv"));
    found.sort();
    let mut used: Vec<String> = used.iter().map(|n| (*n).to_owned()).collect();
    used.sort();
    assert_eq!(found, used);
}
