//! Robots in MJCF: what is read beside the dynamics, and what is refused, with its place.

use crate::dynamics::{read, reference_file};
use ndof_devices::{JointKind, RobotConfig};

fn refusal(text: &str, tip: Option<&str>) -> String {
    RobotConfig::parse("r.xml", text, tip).err().unwrap_or_else(|| panic!("read: {text}")).to_string()
}

#[test]
fn friction_motors_ranges_and_springs_are_read() {
    let arm = read("mjcf_arm.xml");
    let of = |f: fn(&ndof_devices::JointConfig) -> f64| arm.joints.iter().map(f).collect::<Vec<_>>();
    assert_eq!(arm.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(), ["turn", "shoulder", "elbow", "pronation"]);
    assert_eq!(of(|j| j.viscous_nm_s_per_rad), [0.3, 0.1, 0.15, 0.1]);
    assert_eq!(of(|j| j.coulomb_nm), [0.05, 0.05, 0.05, 0.01]);
    // Through a gear of 50 a rotor weighs 2500 times.
    assert_eq!(of(|j| j.rotor_inertia_kg_m2), [0.02, 0.004 + 0.0001 * 2500.0, 0.004, 0.004]);
    assert_eq!(arm.joints.iter().map(|j| j.torque_limit_nm).collect::<Vec<_>>(), [Some(60.0), Some(60.0), None, None]);
    let range = arm.joints[1].range_rad.expect("limited");
    assert!((range[0] + 100f64.to_radians()).abs() < 1e-15 && (range[1] - 120f64.to_radians()).abs() < 1e-15 && arm.joints[2].range_rad.is_none());
    assert_eq!((arm.gravity_m_per_s2, arm.name.as_str()), ([0.5, -0.3, -9.7], "arm"));
    let gantry = read("mjcf_gantry.xml");
    assert_eq!(gantry.joints.iter().filter(|j| j.kind == JointKind::Prismatic && j.mass_kg == 0.0).count(), 2);
    assert_eq!((gantry.joints[3].stiffness_nm_per_rad, gantry.joints[3].spring_rest_rad), (1.5, 0.3));
    let error = gantry.build().err().expect("no spring is simulated").to_string();
    assert!(error.contains("stiffness of joint \"tilt\""), "{error}");
}

/// A camera and a flange on the last body, an eye on the one before, and a table beside the robot: its joints are one chain, and a limb needs to be told where.
#[test]
fn ends_that_stand_still_on_one_body_leave_its_joints_as_they_are() {
    let mjcf = |more: &str| {
        format!(
            "<mujoco><worldbody><body name=\"table\"/><body name=\"upper\"><joint name=\"a\"/><geom size=\"0.1\"/><body name=\"eye\"/><body name=\"lower\" pos=\"0.3 0 0\">\
             <joint name=\"b\"/><geom size=\"0.1\"/>{more}</body></body></worldbody></mujoco>"
        )
    };
    let link = |name: &str| {
        format!(
            "<link name=\"{name}\"><inertial><mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
        )
    };
    let joint = |kind: &str, name: &str, of: [&str; 2]| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{}\"/><child link=\"{}\"/><axis xyz=\"0 1 0\"/><origin xyz=\"0.3 0 0\"/></joint>",
            of[0], of[1]
        )
    };
    let urdf = |more: &str| {
        let links = ["upper", "lower"].map(link).concat() + "<link name=\"base\"/><link name=\"table\"/><link name=\"eye\"/>";
        let joints = [
            joint("fixed", "stand", ["base", "table"]),
            joint("fixed", "look", ["upper", "eye"]),
            joint("continuous", "a", ["base", "upper"]),
            joint("continuous", "b", ["upper", "lower"]),
        ]
        .concat();
        format!("<robot name=\"arm\">{links}{joints}{more}</robot>")
    };
    let fixed = |name: &str| format!("<link name=\"{name}\"/>{}", joint("fixed", &format!("to_{name}"), ["lower", name]));
    let cases = [
        (mjcf(""), mjcf("<body name=\"camera\" pos=\"0 0 1\"/><body name=\"flange\" pos=\"1 0 0\"/>")),
        (urdf(""), urdf(&(fixed("camera") + &fixed("flange")))),
    ];
    for (plain, marked) in cases {
        let read = |text: &str, tip| RobotConfig::parse("r.xml", text, tip).expect("reads");
        let (plain, marked) = (read(&plain, None), [read(&marked, None), read(&marked, Some("flange"))]);
        assert_eq!((&plain.joints, &plain.joints), (&marked[0].joints, &marked[1].joints));
        assert!(plain.ends.is_empty() && marked[0].ends == ["camera", "flange"] && marked[1].ends.is_empty());
        // At its joints it is a device; at its tip only once that is told.
        let at_the_tip = |config: &RobotConfig| RobotConfig { axes: vec!["x".to_owned()], ..config.clone() }.build();
        let asks = |config: &RobotConfig| at_the_tip(config).err().map(|error| error.to_string()).filter(|error| error.contains("say with `tip`"));
        assert!(marked[0].build().is_ok() && asks(&marked[1]).is_none());
        assert!(asks(&marked[0]).is_some_and(|error| error.contains("camera, flange")));
    }
}

/// A cylinder of many slices, and the solid that rotation makes, by sums: formulas of shapes against their integrals.
#[test]
fn a_capsule_weighs_what_its_slices_do() {
    let text = |shape: &str| format!("<mujoco><worldbody><body><joint axis=\"1 0 0\"/>{shape}</body></worldbody></mujoco>");
    let whole = RobotConfig::parse("r.xml", &text("<geom type=\"capsule\" size=\"0.1 0.3\" density=\"500\"/>"), None).expect("reads").joints.remove(0);
    let (radius, half, steps) = (0.1_f64, 0.3_f64, 4000);
    let width = 2.0 * (half + radius) / f64::from(steps);
    let (mut mass, mut across) = (0.0, 0.0);
    for k in 0..steps {
        let z = -half - radius + (f64::from(k) + 0.5) * width;
        let square = radius * radius - (z.abs() - half).max(0.0).powi(2);
        let slice = 500.0 * std::f64::consts::PI * square * width;
        mass += slice;
        across += slice * (0.25 * square + z * z);
    }
    // The midpoint rule errs by its step squared.
    assert!((whole.mass_kg / mass - 1.0).abs() < 1e-5 && (whole.inertia_kg_m2[0] / across - 1.0).abs() < 1e-5, "{whole:?}");
}

#[test]
fn what_would_change_the_motion_is_refused_with_its_line() {
    let body = |inside: &str| format!("<mujoco>\n<worldbody>\n<body name=\"b\"><joint name=\"j\"/>\n{inside}\n<geom size=\"1\"/></body></worldbody></mujoco>");
    for (inside, names) in [
        ("<freejoint/>", "line 3: <body> \"b\" floats freely"),
        ("<joint name=\"k\" type=\"ball\"/>", "line 4: <joint> \"k\" is of type \"ball\""),
        ("<include file=\"x.xml\"/>", "line 4: <include>"),
        ("<composite/>", "line 4: <composite>"),
        ("<frame pos=\"1 0 0\"/>", "line 4: <frame>"),
        ("<geom name=\"m\" type=\"mesh\" mesh=\"x\"/>", "line 4: <geom> \"m\" is of type \"mesh\""),
        ("<geom type=\"box\" size=\"1 1\"/>", "a box has 3 positive numbers"),
        ("<geom class=\"none\"/>", "class \"none\""),
        ("<body name=\"c\" gravcomp=\"1\"/>", "line 4: <body> \"c\" has gravcomp"),
        ("<body name=\"c\" quat=\"1 0 0 0\" euler=\"1 0 0\"/>", "both quat and euler"),
        ("<body name=\"c\"><joint name=\"k\"/></body><body name=\"d\"><joint name=\"l\"/></body>", "\"c\" and \"d\" are both ends"),
        ("<joint name=\"k\" damping=\"1 2\"/>", "line 4: <joint> \"k\" has a damping"),
        ("<joint name=\"k\" springdamper=\"1 2\"/>", "springdamper"),
        ("<joint name=\"k\" axis=\"1 0\"/>", "not three numbers"),
        ("<joint name=\"k\" frictionloss=\"1\" solreffriction=\"-1000 0\"/>", "solreffriction without damping"),
    ] {
        let error = refusal(&body(inside), None);
        assert!(error.starts_with("r.xml: ") && error.contains(names), "{inside}: {error}");
    }
    for (section, names) in [
        ("<equality><weld name=\"w\" body1=\"b\"/></equality>", "line 5: <weld> \"w\""),
        ("<equality><joint name=\"e\" joint1=\"j\"/></equality>", "line 5: <joint> \"e\""),
        ("<tendon><fixed name=\"t\"><joint joint=\"j\" coef=\"1\"/></fixed></tendon>", "<fixed> \"t\""),
        ("<tendon><spatial name=\"t\"/></tendon>", "<spatial> \"t\""),
        ("<actuator><muscle name=\"m\" joint=\"j\"/></actuator>", "<muscle> \"m\""),
        ("<actuator><motor name=\"m\" site=\"s\"/></actuator>", "drives no joint"),
        ("<actuator><motor name=\"m\" joint=\"x\"/></actuator>", "joint \"x\", which is not described"),
        ("<option density=\"1.2\"/>", "density of the air"),
        ("<option><flag gravity=\"disable\"/></option>", "disables gravity"),
        ("<compiler settotalmass=\"3\"/>", "settotalmass"),
        ("<compiler eulerseq=\"xyw\"/>", "eulerseq"),
        ("<unknown/>", "line 5: <unknown>"),
    ] {
        let error = refusal(&body("").replace("</mujoco>", &format!("{section}</mujoco>")), None);
        assert!(error.contains(names), "{section}: {error}");
    }
    let branches = body("<body name=\"c\"/><body name=\"d\"/>");
    assert!(refusal(&branches, Some("z")).contains("no body \"z\"; there are: b, c, d"));
}

/// As in many a file: two fingers that an equality and a tendon couple, a cube on the table, a tie that is switched off.
#[test]
fn what_does_not_touch_the_chain_is_held_or_left_out_with_a_note() {
    let file = |hand: &str, more: &str| {
        format!(
            "<mujoco><worldbody>{more}<body name=\"upper\"><joint name=\"a\" axis=\"0 1 0\"/><geom size=\"0.1\"/><body name=\"hand\" pos=\"0.3 0 0\">\
             <joint name=\"b\" axis=\"0 1 0\"/><geom size=\"0.1\"/>{hand}</body></body></worldbody>"
        )
    };
    let finger = |name: &str, joint: bool| {
        let joint = if joint { format!("<joint name=\"{name}\" type=\"slide\"/>") } else { String::new() };
        format!("<body name=\"{name}\" pos=\"0.1 0 0\">{joint}<geom size=\"0.02\"/></body>")
    };
    let gripper = |joint: bool| finger("left", joint) + &finger("right", joint);
    let cube = "<body name=\"cube\"><freejoint/><geom size=\"0.03\"/><body name=\"lid\"><joint name=\"hinge\"/><geom size=\"0.01\"/></body></body>";
    let coupled = "<equality><joint joint1=\"left\" joint2=\"right\"/><connect body1=\"left\" body2=\"right\" anchor=\"0 0 0\"/>\
        <weld body1=\"hand\" body2=\"cube\" active=\"false\"/></equality>\
        <tendon><fixed name=\"grip\"><joint joint=\"left\" coef=\"1\"/><joint joint=\"right\" coef=\"1\"/></fixed></tendon>\
        <actuator><general tendon=\"grip\"/><motor joint=\"hinge\"/></actuator></mujoco>";
    let read = |text: String| RobotConfig::parse("r.xml", &text, Some("hand")).expect("reads");
    let (still, found) = (read(file(&gripper(false), "") + "</mujoco>"), read(file(&gripper(true), cube) + coupled));
    assert_eq!(still.joints, found.joints);
    assert!(found.notes[0].contains("left, right") && found.notes[1].contains("\"cube\" floats") && still.notes.is_empty(), "{:?}", found.notes);
    let welded = file(&gripper(true), cube) + &coupled.replace(" active=\"false\"", "");
    assert!(refusal(&welded, Some("hand")).contains("<weld>"));
    assert!(refusal("<mujoco><worldbody><body name=\"dog\"><freejoint/><geom size=\"1\"/></body></worldbody></mujoco>", None).contains("\"dog\" floats"));
}

/// Every beginning of a file, and every file with a byte changed, is read or refused.
#[test]
fn damaged_files_are_answered_in_words() {
    for name in ["mjcf_arm.xml", "mjcf_gantry.xml", "three_link.urdf"] {
        let text = std::fs::read_to_string(reference_file(name)).expect(name);
        for at in (0..text.len()).step_by(3).filter(|at| text.is_char_boundary(*at)) {
            for damaged in [text[..at].to_owned(), format!("{}9{}", &text[..at], &text[at + 1..]), format!("{}\"{}", &text[..at], &text[at..])] {
                let _ = RobotConfig::parse(name, &damaged, None).and_then(|robot| robot.chain());
            }
        }
    }
}
