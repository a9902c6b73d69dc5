//! What every device of the registry has to show, the figures that the paper prints, and any number of axes.

use crate::common::{patient_arm, relative_error};
use ndarray::Array2;
use ndof_devices::{Accuracy, DEVICES, DeviceConfig, EndpointLinearConfig, Experiment, Extras, LIMBS, LimbConfig, linearise, simulate_trial};
use ndof_models::robot::{EndpointForce, EndpointKinematics, Meaning, Robot};

fn diagonal(values: &[f64]) -> Vec<Vec<f64>> {
    (0..values.len()).map(|i| (0..values.len()).map(|j| if i == j { values[i] } else { 0.0 }).collect()).collect()
}

/// H and J of a robot at joint coordinates `q`.
fn rigid_body(robot: &dyn Robot, q: &[f64]) -> (Array2<f64>, Array2<f64>) {
    let (n, m) = (q.len(), robot.axes().len());
    let (mut mass, mut kinematics) = (vec![0.0; n * n], EndpointKinematics::new(m, n));
    robot.mass_matrix(q, &mut mass);
    robot.kinematics(q, &vec![0.0; n], &mut kinematics);
    (Array2::from_shape_vec((n, n), mass).expect("square"), Array2::from_shape_vec((m, n), kinematics.jacobian).expect("axes × joints"))
}

#[test]
fn every_device_says_what_it_is_and_moves_a_limb() {
    for entry in DEVICES {
        assert!(!entry.description.is_empty() && !entry.source.is_empty(), "{}", entry.name);
        assert_eq!(DEVICES.iter().filter(|d| d.name == entry.name).count(), 1, "{}", entry.name);
        for p in entry.parameters {
            assert!(p.default.is_finite() && !p.description.is_empty(), "{}.{}", entry.name, p.name);
            assert_eq!(entry.parameters.iter().filter(|q| q.name == p.name).count(), 1, "{}.{}", entry.name, p.name);
            // A parameter that nothing reads could be any number: NaN-like nonsense has to be noticed somewhere.
            let mut config = DeviceConfig::named(entry.name);
            config.parameters.insert(p.name.to_owned(), f64::NAN);
            assert!(config.build().is_err(), "{}.{} = NaN passes", entry.name, p.name);
        }
        let mut experiment = patient_arm();
        experiment.device = DeviceConfig::named(entry.name);
        experiment.duration_s = 0.2;
        let axes = experiment.device.build().expect("builds").robot.axes().to_vec();
        let (m, b, k, f) = if axes[0].rotational { (0.005, 0.03, 1.0, 0.1) } else { (2.0, 12.0, 300.0, 4.0) };
        let all = |v: f64| diagonal(&vec![v; axes.len()]);
        experiment.limb = LimbConfig::EndpointLinear(EndpointLinearConfig { M: all(m), B: all(b), K: all(k), ..EndpointLinearConfig::default() });
        let commands = vec![vec![f; 100]; axes.len()];
        let recording = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect(entry.name);
        assert_eq!(recording.channels().len(), 3 * axes.len());
        let reference = simulate_trial(&experiment, &commands, &Extras { accuracy: Accuracy::Fixed(7), ..Extras::default() }, 0).expect(entry.name);
        let error = relative_error(&recording, &reference);
        // 0.2 s hold few samples of a step response that rises from rest: ten times the accuracy of a long record.
        assert!(error < 1e-5, "{}: {error:.1e}", entry.name);
        let model = linearise(&experiment).expect(entry.name);
        for i in 0..axes.len() {
            assert!(model.robot_inertia[[i, i]] > 0.0);
        }
    }
    assert!(LIMBS.iter().all(|l| !l.description.is_empty() && !l.parameters.is_empty()));
}

/// Robots of the registry and chains from files, with a state of theirs.
fn robots() -> Vec<(Box<dyn Robot>, Vec<f64>)> {
    let mut chain = DeviceConfig::from_file(&crate::dynamics::reference_file("three_link.urdf"));
    chain.axes = Some(["x", "y", "z"].map(str::to_owned).to_vec());
    chain.home_rad = Some(vec![0.3, 0.1, 0.8]);
    let joints = DeviceConfig::from_file(&crate::dynamics::reference_file("six_joint.urdf"));
    let registry = DEVICES.iter().map(|entry| DeviceConfig::named(entry.name));
    let built = registry.chain([chain, joints]).map(|config| config.build().expect("builds").robot);
    built
        .map(|robot| (robot.home().expect("a home").iter().enumerate().map(|(k, q)| q + 0.1 * (k as f64 - 0.7)).collect(), robot))
        .map(|(q, r)| (r, q))
        .collect()
}

#[test]
fn every_robot_is_made_anew_from_its_parameters_and_each_of_them_shows() {
    for (robot, q) in robots() {
        let n = q.len();
        assert_eq!(robot.joints().names.len(), n);
        let (rates, accelerations): (Vec<f64>, Vec<f64>) = (0..n).map(|k| (0.9 - 0.4 * k as f64, 2.0 - k as f64)).unzip();
        let seen = |robot: &dyn Robot| {
            let (mut torque, mut place) = (vec![0.0; n], EndpointKinematics::new(robot.axes().len(), n));
            robot.inverse_dynamics(&q, &rates, &accelerations, &mut torque);
            robot.kinematics(&q, &rates, &mut place);
            (0..n).for_each(|j| torque[j] += robot.joints().friction(j, 0.01 * rates[j]));
            [torque, place.endpoint, vec![robot.gravity_compensation()]].concat()
        };
        let (parameters, own) = (robot.parameters(), seen(robot.as_ref()));
        let values: Vec<f64> = parameters.iter().map(|p| p.value).collect();
        assert_eq!(seen(robot.with_parameters(&values).expect("itself").as_ref()), own);
        for (k, parameter) in parameters.iter().enumerate() {
            assert_eq!(parameters.iter().filter(|p| p.name == parameter.name).count(), 1, "{}", parameter.name);
            let mut moved = values.clone();
            moved[k] += 1e-3 * moved[k].abs().max(0.01);
            let other = seen(robot.with_parameters(&moved).expect(&parameter.name).as_ref());
            // Of a chain, what stands on the base's axis or is carried by it has no say: the mass of a first link, its height.
            let silent = parameter.meaning == Meaning::Inertia || parameter.meaning == Meaning::Geometry;
            assert!(other != own || (silent && parameters.len() > 12), "{}", parameter.name);
        }
        assert!(robot.with_parameters(&values[1..]).is_err());
    }
}

#[test]
fn what_a_motion_needs_is_mass_times_acceleration_and_bias_at_the_joints_and_at_the_endpoint() {
    for (robot, q) in robots() {
        let (n, m) = (q.len(), robot.axes().len());
        let (rates, torque): (Vec<f64>, Vec<f64>) = (0..n).map(|k| (0.5 - 0.3 * k as f64, 0.2 + 0.1 * k as f64)).unzip();
        let (mut place, mut work, mut accelerations) = (EndpointKinematics::new(m, n), vec![0.0; n * n], vec![0.0; n]);
        robot.kinematics(&q, &rates, &mut place);
        robot.acceleration(&q, &rates, &place, &torque, &mut work, &mut accelerations);
        let mut back = vec![0.0; n];
        robot.inverse_dynamics(&q, &rates, &accelerations, &mut back);
        let size = accelerations.iter().fold(1.0_f64, |s, a| s.max(a.abs()));
        assert!(back.iter().zip(&torque).all(|(b, t)| (b - t).abs() < 1e-12 * size), "{back:?} for {torque:?}");
        let jacobian = place.jacobian.clone();
        let along = |j: &[f64], x: &[f64]| -> Vec<f64> { j.chunks_exact(n).map(|row| row.iter().zip(x).map(|(j, x)| j * x).sum()).collect() };
        let velocity = along(&jacobian, &rates);
        let acceleration: Vec<f64> = along(&jacobian, &accelerations).iter().zip(&place.jacobian_rate).map(|(a, d)| a + d).collect();
        let mut carried = vec![0.0; n];
        robot.bias(&q, &vec![0.0; n], &mut carried);
        let share = robot.gravity_compensation();
        let expected: Vec<f64> = (0..n).map(|j| torque[j] + robot.joints().friction(j, rates[j]) - share * carried[j]).collect();
        let position = place.endpoint.clone();
        let mut at_endpoint = EndpointForce::new(robot).expect("as many joints as axes");
        let mut force = vec![0.0; n];
        assert!(at_endpoint.needed(&position, &velocity, &acceleration, &mut force));
        for j in 0..n {
            let felt: f64 = (0..m).map(|i| jacobian[i * n + j] * force[i]).sum();
            // The inverse kinematics find the joints to 1e-13 of a metre, which the Jacobian's inverse and the accelerations enlarge.
            assert!((felt - expected[j]).abs() < 1e-9 * size, "{felt} for {}", expected[j]);
        }
        assert!(!at_endpoint.needed(&vec![1e3; n], &velocity, &acceleration, &mut force) || position == q, "out of reach");
    }
}

/// Palazzolo et al. 2007: endpoint inertia 1 ± 0.33 kg and friction 0.84 ± 0.28 N, both with an anisotropy of at most about 2:1.
#[test]
fn the_planar_robot_has_the_published_endpoint_figures_near_its_centre() {
    let device = DeviceConfig::named("mit-manus").build().expect("builds");
    let (mut inertias, mut frictions) = (Vec::new(), Vec::new());
    for (x, y) in (-2..=2).flat_map(|i| (-2..=2).map(move |j| (0.025 * f64::from(i), 0.025 * f64::from(j)))).filter(|(x, y)| x.hypot(*y) <= 0.05 + 1e-12) {
        let q = device.robot.inverse_kinematics(&[x, y]).expect("reach");
        let (h, j) = rigid_body(device.robot.as_ref(), &q);
        let determinant = j[[0, 0]] * j[[1, 1]] - j[[0, 1]] * j[[1, 0]];
        let back = Array2::from_shape_vec((2, 2), vec![j[[1, 1]], -j[[0, 1]], -j[[1, 0]], j[[0, 0]]]).expect("2 × 2") / determinant;
        let endpoint = back.t().dot(&h).dot(&back);
        let (mean, half) = ((endpoint[[0, 0]] + endpoint[[1, 1]]) / 2.0, ((endpoint[[0, 0]] - endpoint[[1, 1]]) / 2.0).hypot(endpoint[[0, 1]]));
        assert!((mean + half) / (mean - half) < 2.1, "anisotropy at ({x}, {y})");
        inertias.extend([mean - half, mean + half]);
        // Power lost to dry friction at a hand speed of 1 m/s in each direction is the friction force there.
        let joints = device.robot.joints();
        for k in 0..36 {
            let angle = f64::from(k) * std::f64::consts::PI / 36.0;
            let rates = back.dot(&ndarray::array![angle.cos(), angle.sin()]);
            frictions.push((0..2).map(|i| joints.coulomb[i] * rates[i].abs()).sum::<f64>());
        }
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    // The paper's ± is a spread over the directions: 0.33 kg about a mean of 1 kg.
    let centre = mean(&inertias);
    let spread = (inertias.iter().map(|m| (m - centre).powi(2)).sum::<f64>() / inertias.len() as f64).sqrt();
    assert!((centre - 1.0).abs() < 0.05 && spread < 0.33, "{centre} ± {spread}");
    let (least, most) = frictions.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), f| (a.min(*f), b.max(*f)));
    assert!((mean(&frictions) - 0.84).abs() < 0.05 && least > 0.56 && most < 1.12 && most / least < 2.1, "{least} {} {most}", mean(&frictions));
}

/// A row of sliding masses, one an axis: M, B, K of each axis on its own, so each axis is a known oscillator.
fn sliders(axes: usize) -> (Experiment, std::path::PathBuf) {
    let mut text =
        "schema = \"ndof/robot/1\"\nname = \"sliders\"\ngravity_m_per_s2 = [0.0, 0.0, 0.0]\n[transducer]\nstiffness = 1e6\ndamping = 800.0\n".to_owned();
    for k in 0..axes {
        // The last carries the mass; a rotor at each joint makes the inertias differ.
        let mass = if k + 1 == axes { 0.5 } else { 0.0 };
        text += &format!(
            "[[joints]]\nname = \"a{k}\"\nkind = \"prismatic\"\naxis = [{}.0, {}.0, {}.0]\n",
            u8::from(k % 3 == 0),
            u8::from(k % 3 == 1),
            u8::from(k % 3 == 2)
        );
        text += &format!("mass_kg = {mass}\nrotor_inertia_kg_m2 = {}\nviscous_nm_s_per_rad = 0.5\n", 1.0 + 0.1 * k as f64);
    }
    let path = std::env::temp_dir().join(format!("ndof-devices-{}-{axes}-sliders.toml", std::process::id()));
    std::fs::write(&path, text).expect("writable");
    let mut experiment = patient_arm();
    experiment.device = DeviceConfig::from_file(&path.to_string_lossy());
    experiment.duration_s = 0.4;
    experiment.discard_s = 0.0;
    let (m, k): (Vec<f64>, Vec<f64>) = (0..axes).map(|a| (1.0 + 0.2 * a as f64, 200.0 + 30.0 * a as f64)).unzip();
    experiment.limb = LimbConfig::EndpointLinear(EndpointLinearConfig {
        M: diagonal(&m),
        B: diagonal(&vec![10.0; axes]),
        K: diagonal(&k),
        ..EndpointLinearConfig::default()
    });
    (experiment, path)
}

#[test]
fn one_axis_and_twelve_are_the_same_to_the_simulator() {
    for axes in [1, 12] {
        let (experiment, path) = sliders(axes);
        let commands: Vec<Vec<f64>> = (0..axes).map(|a| (0..200).map(|k| (0.05 * (k * (a + 1)) as f64).sin()).collect()).collect();
        let recording = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
        assert_eq!(recording.channels().len(), 3 * axes);
        assert_eq!(recording.channels()[axes].name, "force_a0");
        // A linear system: the sampled steps are exact whatever their length, to round-off of the stiff coupling.
        let fine = simulate_trial(&experiment, &commands, &Extras { accuracy: Accuracy::Fixed(5), ..Extras::default() }, 0).expect("runs");
        let error = relative_error(&recording, &fine);
        assert!(error < 1e-9, "{axes} axes: {error:.1e}");
        std::fs::remove_file(path).expect("removable");
    }
}
