//! Experiments and robots as text.

use crate::common::{patient_arm, relative_error, sines};
use crate::dynamics::reference_file;
use ndof_devices::{
    Accuracy, Corrected, Correction, DeviceConfig, DeviceError, EndpointLinearConfig, Extras, LimbConfig, RobotConfig, linearise, simulate_trial,
    write_back_chain,
};

const TWO_LINK: &str = r#"
schema = "ndof/robot/1"
name = "two-link"
axes = ["x", "y"]
[[joints]]
name = "shoulder"
mass_kg = 1.93
centre_m = [0.165, 0.0, 0.0]
inertia_kg_m2 = [0.001, 0.0141, 0.0141, 0.0, 0.0, 0.0]
viscous_nm_s_per_rad = 0.02
coulomb_nm = 0.1
torque_limit_nm = 80.0
home_rad = 0.5
range_rad = [-6.0, 6.0]
[[joints]]
name = "elbow"
origin_m = [0.33, 0.0, 0.0]
mass_kg = 1.52
centre_m = [0.19, 0.0, 0.0]
inertia_kg_m2 = [0.001, 0.0188, 0.0188, 0.0, 0.0, 0.0]
torque_limit_nm = 40.0
home_rad = 1.2
range_rad = [-3.0, 3.0]
[end_effector]
translation_m = [0.34, 0.0, 0.0]
"#;

fn written(name: &str, text: &str) -> String {
    let path = std::env::temp_dir().join(format!("ndof-devices-{}-{name}", std::process::id()));
    std::fs::write(&path, text).expect("writable");
    path.to_string_lossy().into_owned()
}

#[test]
fn one_robot_in_toml_and_in_urdf_moves_alike() {
    let mut experiment = patient_arm();
    experiment.duration_s = 1.0;
    let file = written("two-link.toml", TWO_LINK);
    experiment.device = DeviceConfig::from_file(&file);
    let commands = sines(&experiment, 4.0);
    let from_toml = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
    experiment.device = DeviceConfig {
        axes: Some(vec!["x".to_owned(), "y".to_owned()]),
        tip: Some("tip".to_owned()),
        home_rad: Some(vec![0.5, 1.2]),
        ..DeviceConfig::from_file(&reference_file("two_link.urdf"))
    };
    let from_urdf = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
    assert!(relative_error(&from_toml, &from_urdf) < 1e-12);
    std::fs::remove_file(file).expect("removable");
}

#[test]
fn a_six_joint_arm_holds_a_limb_at_its_tip() {
    let mut experiment = patient_arm();
    experiment.duration_s = 1.0;
    experiment.device = DeviceConfig {
        axes: Some(["x", "y", "z"].map(str::to_owned).to_vec()),
        home_rad: Some(vec![0.1, 0.4, 0.9, 0.2, 0.5, -0.3]),
        ..DeviceConfig::from_file(&reference_file("six_joint.urdf"))
    };
    let diagonal = |v: f64| (0..3).map(|i| (0..3).map(|j| if i == j { v } else { 0.0 }).collect()).collect();
    experiment.limb =
        LimbConfig::EndpointLinear(EndpointLinearConfig { M: diagonal(2.0), B: diagonal(15.0), K: diagonal(400.0), ..EndpointLinearConfig::default() });
    let mut commands = sines(&experiment, 4.0);
    commands.push(commands[0].iter().rev().copied().collect());
    let run = |accuracy| simulate_trial(&experiment, &commands, &Extras { accuracy, ..Extras::default() }, 0).expect("runs");
    let recording = run(Accuracy::Relative(1e-6));
    assert_eq!(recording.names(), ["cmd_x", "cmd_y", "cmd_z", "force_x", "force_y", "force_z", "pos_x", "pos_y", "pos_z"]);
    let error = relative_error(&recording, &run(Accuracy::Fixed(6)));
    assert!(error < 2e-6, "{error:.1e}");
    // Gravity is carried by the controller: without a perturbation the arm stands still.
    let silence = vec![vec![0.0; commands[0].len()]; 3];
    let still = simulate_trial(&experiment, &silence, &Extras::default(), 0).expect("runs");
    let (first, last) = (still.channels()[8].samples[0], still.channels()[8].samples[499]);
    assert!((first - last).abs() < 1e-5, "{first} to {last}");
    assert_eq!(linearise(&experiment).expect("regular").robot_inertia.nrows(), 3);
}

#[test]
fn a_robot_that_cannot_be_is_refused_with_its_place() {
    let build = |name: &str, text: &str, axes: Option<Vec<String>>| {
        let file = written(name, text);
        let error = DeviceConfig { axes, ..DeviceConfig::from_file(&file) }.build().err().expect("refused").to_string();
        std::fs::remove_file(file).expect("removable");
        error
    };
    assert!(build("a.toml", &TWO_LINK.replace("mass_kg = 1.52", "mass_kg = -1.0"), None).contains("joint \"elbow\""));
    assert!(build("b.toml", &TWO_LINK.replace("mass_kg = 1.52", "masse_kg = 1.0"), None).contains("masse_kg"));
    assert!(build("c.toml", &TWO_LINK.replace("ndof/robot/1", "ndof/robot/9"), None).contains("ndof/robot/9"));
    let error = build("d.toml", &TWO_LINK.replace("home_rad = 1.2", "home_rad = 0.0"), None);
    assert!(error.contains("singular"), "{error}");
    assert!(build("e.toml", TWO_LINK, Some(vec!["w".to_owned()])).contains("x, y, z"));
    assert!(build("f.toml", &TWO_LINK.replace("[0.001, 0.0188, 0.0188, 0.0, 0.0, 0.0]", "[1.0, 0.1, 0.1, 0.0, 0.0, 0.0]"), None).contains("elbow"));
    let urdf = std::fs::read_to_string(reference_file("two_link.urdf")).expect("there");
    for (from, to, place) in [
        ("<child link=\"fore\"/>", "<child link=\"forearm\"/>", "forearm"),
        ("value=\"1.52\"", "value=\"heavy\"", "heavy"),
        ("type=\"fixed\"", "type=\"floating\"", "floating"),
        ("xyz=\"0.33 0 0\"", "xyz=\"0.33 0\"", "not three numbers"),
        ("</robot>", "", "never closed"),
        ("<parent link=\"base\"/>", "<parent link=\"tip\"/>", "circle"),
        ("value=\"1.52\"", "value=\"${mass}\"", "run xacro first"),
        ("</robot>", "<xacro:arm/></robot>", "<xacro:arm> is of xacro"),
    ] {
        let error = build("g.urdf", &urdf.replace(from, to), None);
        assert!(error.contains(place), "{error}");
    }
    let left_over = urdf.replace("</robot>", "<xacro:property name=\"pi\" value=\"3.14\"/></robot>");
    assert_eq!(RobotConfig::parse("h.urdf", &left_over, None), RobotConfig::parse("h.urdf", &urdf, None));
    assert!(build("i.toml", &TWO_LINK.replacen("mass_kg", "friction_ahead_s = -1.0\nmass_kg", 1), None).contains("friction_ahead_s of joint"));
    assert!(build("j.toml", &TWO_LINK.replace("name = \"elbow\"", "name = \"shoulder\""), None).contains("two called \"shoulder\""));
    let error = DeviceConfig::from_file("/no/such/robot.toml").build().err().expect("refused");
    assert!(matches!(error, DeviceError::File { .. }), "{error}");
    assert!(DeviceConfig::default().build().is_err());
    assert!(DeviceConfig::named("mit-manu").build().err().expect("refused").to_string().contains("mit-manus"));
}

/// A gripper behind the hand: fingers that move against each other, one by a motor and one that mimics it.
#[test]
fn joints_off_the_way_to_the_tip_are_held_as_part_of_the_body_they_hang_on() {
    let body = |name: &str| {
        format!(
            "<link name=\"{name}\"><inertial><mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
        )
    };
    let joint = |kind: &str, name: &str, [parent, child]: [&str; 2], more: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"0 1 0\"/><origin xyz=\"0.1 0 0\"/>{more}</joint>"
        )
    };
    let arm = |fingers: [&str; 2], more: &str| {
        let links = ["hand", "left", "right"].map(body).concat();
        let right = joint(fingers[1], "slide_right", ["hand", "right"], more);
        let joints = joint("continuous", "a", ["base", "hand"], "") + &joint(fingers[0], "slide_left", ["hand", "left"], "") + &right;
        format!("<robot name=\"r\"><link name=\"base\"/>{links}{joints}</robot>")
    };
    let read = |text: &str, tip| RobotConfig::parse("r.urdf", text, tip).expect("reads");
    let mimic = "<mimic joint=\"slide_left\"/>";
    let (fixed, gripper) = (arm(["fixed", "fixed"], ""), arm(["prismatic", "prismatic"], mimic));
    let held = read(&gripper, Some("hand"));
    assert_eq!(held.joints, read(&fixed, Some("hand")).joints);
    assert!(held.notes.len() == 1 && held.notes[0].contains("slide_left, slide_right") && held.notes[0].contains("held still"), "{:?}", held.notes);
    // Without a motor of its own, what mimics ends no chain.
    let alone = read(&arm(["fixed", "prismatic"], "<mimic joint=\"a\"/>"), None);
    assert_eq!((alone.joints.len(), alone.joints[0].mass_kg), (1, 3.0));
    let through = RobotConfig::parse("r.urdf", &gripper, Some("right")).expect_err("it mimics").to_string();
    assert!(through.contains("\"slide_right\" mimics another") && through.contains("`tip`"), "{through}");
    // Of 3 kg that move the hand is one: 3.5 kg are half a kilogram more in it.
    let heavier = Correction { joint: "a".to_owned(), what: Corrected::Mass, value: 3.5, why: "weighed".to_owned() };
    let written = write_back_chain("r.urdf", &gripper, &["a".to_owned()], &[heavier]).expect("writes");
    assert!((read(&written.text, Some("hand")).joints[0].mass_kg - 3.5).abs() < 1e-12, "{}", written.patch);
}

#[test]
fn a_link_without_an_inertial_is_told_with_its_line() {
    let text = std::fs::read_to_string(reference_file("two_link.urdf")).expect("there");
    let (from, to) = (text.rfind("<inertial>").expect("one"), text.rfind("</inertial>").expect("one") + "</inertial>".len());
    let found = RobotConfig::parse("r.urdf", &(text[..from].to_owned() + &text[to..]), None).expect("reads");
    assert!(found.notes.iter().any(|note| note.starts_with("line ") && note.contains("link \"fore\" weighs nothing")), "{:?}", found.notes);
}
