//! Corrections written back into files: they load again, here and in other engines, and leave the rest alone.

use crate::dynamics::{AGAINST_ANOTHER_ENGINE, compare, parsed, read, reference_file};
use ndof_devices::Corrected::{Centre, Coulomb, FrictionAhead, Gravity, Inertia, Mass, Range, Rotor, SpringRest, Stiffness, TorqueDelay, Viscous};
use ndof_devices::{Corrected, Correction, JointConfig, RobotConfig, Written, write_back};

fn correct(joint: &str, what: Corrected, value: f64) -> Correction {
    Correction { joint: joint.to_owned(), what, value, why: format!("{what:?} of {joint} -- ten trials") }
}

/// The joints that the corrections ask for, of those of a file.
fn target(mut robot: RobotConfig, corrections: &[Correction]) -> RobotConfig {
    for c in corrections {
        if let Gravity(k) = c.what {
            robot.gravity_m_per_s2[k] = c.value;
            continue;
        }
        let joint = robot.joints.iter_mut().find(|j| j.name == c.joint).expect("there");
        match c.what {
            Viscous => joint.viscous_nm_s_per_rad = c.value,
            Coulomb => joint.coulomb_nm = c.value,
            Rotor => joint.rotor_inertia_kg_m2 = c.value / joint.gear_ratio.powi(2),
            Stiffness => joint.stiffness_nm_per_rad = c.value,
            SpringRest => joint.spring_rest_rad = c.value,
            FrictionAhead => joint.friction_ahead_s = c.value,
            Mass => joint.mass_kg = c.value,
            Centre(k) => joint.centre_m[k] = c.value,
            Inertia(k) => joint.inertia_kg_m2[k] = c.value,
            Range(k) => joint.range_rad.get_or_insert([0.0; 2])[k] = c.value,
            TorqueDelay | Gravity(_) => {}
        }
    }
    robot
}

fn numbers(joint: &JointConfig) -> Vec<f64> {
    let own = [joint.mass_kg, joint.viscous_nm_s_per_rad, joint.coulomb_nm, joint.rotor_inertia_kg_m2, joint.stiffness_nm_per_rad];
    let own = own.into_iter().chain([joint.spring_rest_rad, joint.friction_ahead_s]);
    own.chain(joint.centre_m).chain(joint.inertia_kg_m2).chain(joint.origin_m).chain(joint.range_rad.unwrap_or_default()).collect()
}

/// The file with corrections, after it was read again.
fn checked(name: &str, corrections: &[Correction]) -> Written {
    let text = std::fs::read_to_string(reference_file(name)).expect(name);
    let written = write_back(name, &text, corrections).expect("writes");
    let (found, wanted) = (parsed(name, &written.text), target(read(name), corrections));
    for (found, wanted) in found.joints.iter().zip(&wanted.joints) {
        let same = numbers(found).iter().zip(numbers(wanted)).all(|(f, w)| (f - w).abs() < 1e-12 * (1.0 + w.abs()));
        assert!(same && found.name == wanted.name, "{found:?} for {wanted:?}");
    }
    assert_eq!(patched(&text, &written.patch), written.text, "{}", written.patch);
    assert!(corrections.iter().all(|c| written.patch.contains(&format!("{}\n", c.why))));
    written
}

/// What `patch` makes of a text.
fn patched(text: &str, patch: &str) -> String {
    let (old, mut at, mut out) = (text.split_inclusive('\n').collect::<Vec<_>>(), 0, String::new());
    let body = patch.split_once("\n+++ ").and_then(|(_, rest)| rest.split_once('\n')).map_or("", |(_, hunks)| hunks);
    // The mark of a last line without an end takes the end of the line before it.
    let body = body.replace("\n\\ No newline at end of file\n", "\0");
    for line in body.split_inclusive(['\n', '\0']).map(|l| l.trim_end_matches('\0')) {
        if let Some(place) = line.strip_prefix("@@ -") {
            let first: usize = place.split(',').next().and_then(|v| v.parse().ok()).expect("a line");
            out.extend(old[at..first - 1].iter().copied());
            at = first - 1;
        } else if let Some(new) = line.strip_prefix('+') {
            out.push_str(new);
        } else {
            assert_eq!(old[at], &line[1..]);
            out.push_str(if line.starts_with('-') { "" } else { old[at] });
            at += 1;
        }
    }
    out.extend(old[at..].iter().copied());
    out
}

/// Of the body of `bend`: the link and a handle that is fixed to it.
fn of_the_chain() -> Vec<Correction> {
    vec![
        correct("bend", Mass, 1.3),
        correct("bend", Centre(2), 0.02),
        correct("bend", Inertia(0), 0.0035),
        correct("lift", Mass, 1.25),
        correct("lift", Inertia(4), 0.0012),
        correct("turn", Viscous, 0.4),
        correct("turn", Coulomb, 1.1),
        correct("turn", Range(1), 2.5),
    ]
}

fn of_the_arm() -> Vec<Correction> {
    vec![
        correct("turn", Viscous, 0.35),
        correct("turn", Mass, 3.4),
        correct("shoulder", Rotor, 0.27),
        correct("shoulder", Coulomb, 0.08),
        correct("shoulder", TorqueDelay, 0.0125),
        correct("elbow", Centre(0), 0.12),
        correct("elbow", Range(0), -1.0),
        correct("elbow", Range(1), 1.5),
        correct("pronation", Mass, 0.55),
        correct("robot", Gravity(2), -9.81),
    ]
}

fn of_the_gantry() -> Vec<Correction> {
    vec![
        correct("tilt", Stiffness, 1.8),
        correct("tilt", Inertia(3), 0.005),
        correct("swing", Mass, 2.25),
        correct("swing", Inertia(5), 0.002),
        correct("along", Rotor, 1.7),
        correct("along", Range(0), -1.5),
        correct("robot", Gravity(0), 0.2),
    ]
}

/// The files that the script beside them hands to Pinocchio and MuJoCo are what is written today, and move as these say.
/// NDOF_WRITE_REFERENCES=1 writes them anew, then the script, then this test again.
#[test]
fn written_files_move_in_other_engines_as_corrected() {
    for (name, corrections) in [("three_link.urdf", of_the_chain()), ("mjcf_arm.xml", of_the_arm()), ("mjcf_gantry.xml", of_the_gantry())] {
        let (written, file) = (checked(name, &corrections), format!("corrected_{name}"));
        assert!(written.left_out.is_empty(), "{:?}", written.left_out);
        if std::env::var_os("NDOF_WRITE_REFERENCES").is_some() {
            std::fs::write(reference_file(&file), &written.text).expect("writable");
            continue;
        }
        assert_eq!(std::fs::read_to_string(reference_file(&file)).expect("run with NDOF_WRITE_REFERENCES=1"), written.text, "{file}");
        let mut robot = target(read(name), &corrections);
        robot.axes = ["x", "y", "z"].map(str::to_owned).to_vec();
        let stem = file.split('.').next().unwrap_or_default();
        compare(&robot.chain().expect("builds"), &format!("chain_{stem}.csv"), [0.0; 3], &[0, 1, 2], AGAINST_ANOTHER_ENGINE);
    }
}

/// A spring with its rest, in the file's degrees where it turns, and dry friction as soft as it was found.
#[test]
fn springs_and_soft_friction_are_written_into_an_mjcf() {
    checked("mjcf_gantry.xml", &[correct("tilt", Stiffness, 1.8), correct("tilt", SpringRest, -0.2)]);
    let arm = checked("mjcf_arm.xml", &[correct("shoulder", Stiffness, 2.0), correct("shoulder", SpringRest, 0.5), correct("shoulder", FrictionAhead, 0.004)]);
    assert!(arm.text.contains(&format!("springref=\"{:?}\"", 0.5 / 1f64.to_radians())), "{}", arm.patch);
}

#[test]
fn what_a_format_has_no_word_for_is_told() {
    let corrections = [correct("bend", Rotor, 0.1), correct("bend", TorqueDelay, 0.01), correct("turn", Stiffness, 2.0), correct("robot", Gravity(1), 0.1)];
    let text = std::fs::read_to_string(reference_file("three_link.urdf")).expect("there");
    let written = write_back("three_link.urdf", &text, &corrections).expect("writes");
    assert_eq!(written.left_out.len(), 4);
    assert!(written.left_out[0].contains("rotor inertia of joint \"bend\""), "{:?}", written.left_out);
    assert_eq!(written.text, text);
    let text = std::fs::read_to_string(reference_file("mjcf_arm.xml")).expect("there");
    let written = write_back("mjcf_arm.xml", &text, &[correct("pronation", TorqueDelay, 0.01)]).expect("writes");
    assert!(written.left_out[0].contains("no actuator drives joint \"pronation\""), "{:?}", written.left_out);
}

#[test]
fn what_no_robot_has_is_refused_by_name() {
    for (name, correction, words) in [
        ("three_link.urdf", correct("bend", Mass, 0.2), "without what is fixed to it, \"arm\""),
        ("three_link.urdf", correct("lift", Mass, -1.0), "mass of joint \"lift\" would be -1"),
        ("three_link.urdf", correct("lift", Inertia(3), 0.1), "inertia xy of joint \"lift\""),
        ("three_link.urdf", correct("lift", Inertia(6), 0.1), "no such component"),
        ("three_link.urdf", correct("elbow", Mass, 1.0), "no moving joint \"elbow\"; there are: turn, lift, bend"),
        ("three_link.urdf", correct("turn", Range(0), 9.0), "lower end of the range of joint \"turn\""),
        ("three_link.urdf", correct("turn", Viscous, f64::NAN), "viscous friction"),
        ("mjcf_gantry.xml", correct("yaw", Mass, 1.0), "another joint, \"tilt\""),
        ("mjcf_arm.xml", correct("shoulder", Rotor, 0.1), "below the 0.25 of its actuators"),
        ("mjcf_arm.xml", correct("elbow", Range(0), -1.0), "needs two ends"),
    ] {
        let text = std::fs::read_to_string(reference_file(name)).expect(name);
        let error = write_back(name, &text, &[correction]).expect_err(words).to_string();
        assert!(error.starts_with(name) && error.contains(words), "{error}");
    }
}

const LINES: &str = "schema = \"ndof/robot/1\"\nname = \"arm\" # mine\n[[joints]] # first\nname = \"shoulder\"\nmass_kg = 1.0 # weighed\ncentre_m = [0.1, 0, 0]\ninertia_kg_m2 = [0.1, 0.1, 0.1, 0, 0, 0]\ngear_ratio = 10\n\n[end_effector]\ntranslation_m = [0.3, 0, 0]";

#[test]
fn a_robot_in_toml_keeps_its_lines() {
    let corrections = [
        correct("shoulder", Mass, 1.2),
        correct("shoulder", Centre(0), 0.12),
        correct("shoulder", Centre(1), 0.01),
        correct("shoulder", Rotor, 0.5),
        correct("shoulder", Coulomb, 0.3),
        correct("shoulder", TorqueDelay, 0.01),
        correct("robot", Gravity(0), 0.1),
    ];
    let written = write_back("arm.toml", LINES, &corrections).expect("writes");
    assert_eq!(RobotConfig::parse("arm.toml", &written.text, None), Ok(target(RobotConfig::parse("arm.toml", LINES, None).expect("reads"), &corrections)));
    assert!(written.text.contains("ten trials\nmass_kg = 1.2 # weighed\n") && written.text.contains("\ngear_ratio = 10\n# "), "{}", written.text);
    assert_eq!(patched(LINES, &written.patch), written.text);
    assert_eq!(written.left_out.len(), 1);
    let spread = LINES.replace("[0.1, 0, 0]\ni", "[\n0.1, 0, 0]\ni");
    assert!(write_back("arm.toml", &spread, &corrections).expect_err("refused").to_string().contains("layout"));
}

/// Missing elements are made: dynamics, an inertia of the link, those that a tag without an end has no room for.
#[test]
fn missing_elements_are_made() {
    let text = "<robot name='r'>\r\n <link name='b'/>\r\n <link name='l'/><link name='h'><inertial/></link>\r\n <joint name='j' type='continuous'>\r\n  <parent link='b'/><child link='l'/>\r\n </joint>\r\n <joint name='k' type='continuous'><parent link='l'/><child link='h'/></joint>\r\n</robot>";
    let corrections: Vec<Correction> =
        ["j", "k"].iter().flat_map(|j| [Mass, Inertia(0), Inertia(1), Inertia(2), Viscous, Coulomb].map(|what| correct(j, what, 0.5))).collect();
    let written = write_back("r.urdf", text, &corrections).expect("writes");
    let found = RobotConfig::parse("r.urdf", &written.text, None).expect(&written.text);
    // Nothing is without mass then.
    let wanted = RobotConfig { notes: vec![], ..target(RobotConfig::parse("r.urdf", text, None).expect("reads"), &corrections) };
    assert_eq!(found, wanted, "{}", written.text);
    assert_eq!(patched(text, &written.patch), written.text);
    assert!(!written.text.contains("-- ten"), "a comment holds no two hyphens");
}

#[test]
fn damaged_files_are_not_written_over_and_never_panic() {
    for (name, corrections) in [("three_link.urdf", of_the_chain()), ("mjcf_arm.xml", of_the_arm())] {
        let text = std::fs::read_to_string(reference_file(name)).expect(name);
        for at in (0..text.len()).step_by(7).filter(|at| text.is_char_boundary(*at)) {
            assert!(write_back(name, &text[..at], &corrections).is_err());
            let _ = write_back(name, &format!("{}\"{}", &text[..at], &text[at..]), &corrections);
            let _ = write_back(name, &format!("{}>{}", &text[..at], &text[at + 1..]), &corrections);
        }
    }
}
