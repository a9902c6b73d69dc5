//! Experiments and robots as text.

use crate::common::{patient_arm, relative_error, sines};
use crate::dynamics::reference_file;
use ndof_devices::{Accuracy, DeviceConfig, DeviceError, EndpointLinearConfig, Extras, LimbConfig, linearise, simulate_trial};

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
    ] {
        let error = build("g.urdf", &urdf.replace(from, to), None);
        assert!(error.contains(place), "{error}");
    }
    let error = DeviceConfig::from_file("/no/such/robot.toml").build().err().expect("refused");
    assert!(matches!(error, DeviceError::File { .. }), "{error}");
    assert!(DeviceConfig::default().build().is_err());
    assert!(DeviceConfig::named("mit-manu").build().err().expect("refused").to_string().contains("mit-manus"));
}
