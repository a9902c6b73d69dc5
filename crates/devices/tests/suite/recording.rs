//! What a simulated recording holds: channels, randomness, sensors, hidden laws.

use crate::common::{patient_arm, sines, two_link_arm};
use ndarray::{Array2, array};
use ndof_devices::{Averaging, DeviceError, EndpointLinearConfig, Experiment, Extras, LimbConfig, LimbNoise, PerAxis, linearise, simulate_trial};
use ndof_models::robot::RobotError;
use ndof_models::{ForceLaw, Motion, Stage};
use num_complex::Complex64;

/// k x at once, c x later: a law with a delay, of any size.
struct Spring {
    stiffness: f64,
    delayed: f64,
    delay_s: f64,
}

impl ForceLaw for Spring {
    fn states(&self) -> usize {
        1
    }

    fn delay_s(&self) -> f64 {
        self.delay_s
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        for ((force, now), then) in force.iter_mut().zip(motion.position).zip(motion.delayed_position) {
            *force += self.stiffness * now + self.delayed * then;
        }
        rates[0] = -10.0 * states[0];
    }
}

fn noisy() -> Experiment {
    let mut experiment = patient_arm();
    experiment.duration_s = 1.0;
    experiment.sensors = Default::default();
    let LimbConfig::EndpointLinear(limb) = &mut experiment.limb else { unreachable!() };
    limb.noise = Some(LimbNoise { rms_n: PerAxis::All(0.5), cutoff_hz: 2.0 });
    experiment
}

#[test]
fn channels_units_and_length_are_those_of_the_contract() {
    let mut experiment = noisy();
    experiment.discard_s = 0.5;
    let commands = sines(&experiment, 4.0);
    let recording = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
    assert_eq!(recording.names(), ["cmd_x", "cmd_y", "force_x", "force_y", "pos_x", "pos_y"]);
    let units: Vec<&str> = recording.channels().iter().map(|c| c.unit.symbol()).collect();
    assert_eq!(units, ["N", "N", "N", "N", "m", "m"]);
    assert_eq!((recording.len(), recording.sample_rate_hz()), (500, 500.0));
    assert_eq!(recording.channels()[0].samples, commands[0][250..]);
}

#[test]
fn a_seed_and_a_trial_make_one_recording_and_another_trial_another() {
    let experiment = noisy();
    let commands = sines(&experiment, 4.0);
    let run = |trial| simulate_trial(&experiment, &commands, &Extras::default(), trial).expect("runs");
    assert_eq!(run(3), run(3));
    assert_ne!(run(3).channels()[2], run(4).channels()[2]);
}

#[test]
fn force_comes_in_the_transducer_s_steps_and_motion_in_the_encoders() {
    let recording = simulate_trial(&noisy(), &sines(&noisy(), 4.0), &Extras::default(), 0).expect("runs");
    let force = &recording.channel("force_x").expect("exists").samples;
    assert!(force.iter().all(|f| (f / 0.025 - (f / 0.025).round()).abs() < 1e-9));
    // One encoder step moves the hand by 39 µm (shoulder) and 49 µm (elbow) at most: means differ by no less than the geometry allows.
    let mut ideal = noisy();
    ideal.sensors.encoder_bits = Some(0);
    let smooth = simulate_trial(&ideal, &sines(&ideal, 4.0), &Extras::default(), 0).expect("runs");
    let (a, b) = (&recording.channel("pos_x").expect("exists").samples, &smooth.channel("pos_x").expect("exists").samples);
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let rms = (difference.iter().map(|d| d * d).sum::<f64>() / difference.len() as f64).sqrt();
    // Two uniform errors of Δ/√12 through lever arms of 0.25 to 0.4 m, and what the coarser hold does in return: 5 to 40 µm.
    assert!((5e-6..4e-5).contains(&rms), "{rms}");
}

#[test]
fn laws_of_no_severity_change_nothing() {
    let experiment = noisy();
    let commands = sines(&experiment, 4.0);
    let plain = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
    let nothing = || Spring { stiffness: 0.0, delayed: 0.0, delay_s: 0.05 };
    let extras = Extras { limb: vec![Box::new(nothing())], robot: vec![Box::new(nothing())], ..Extras::default() };
    let with = simulate_trial(&experiment, &commands, &extras, 0).expect("runs");
    assert_eq!(plain, with);
}

#[test]
fn a_law_on_the_limb_is_the_limb_s_stiffness_and_one_on_the_robot_the_hold_s() {
    let mut experiment = patient_arm();
    experiment.duration_s = 2.0;
    let commands = sines(&experiment, 4.0);
    let run = |experiment: &Experiment, extras: &Extras| simulate_trial(experiment, &commands, extras, 0).expect("runs");
    let spring = |stiffness| -> Vec<Box<dyn ForceLaw>> { vec![Box::new(Spring { stiffness, delayed: 0.0, delay_s: 0.0 })] };
    let close = |a: &ndof_signal::Recording, b: &ndof_signal::Recording| {
        let error = crate::common::relative_error(a, b);
        assert!(error < 3e-6, "{error:.2e}");
    };
    let mut stiffer = experiment.clone();
    let LimbConfig::EndpointLinear(limb) = &mut stiffer.limb else { unreachable!() };
    limb.K = vec![vec![400.0, -60.0], vec![-60.0, 620.0]];
    close(&run(&experiment, &Extras { limb: spring(100.0), ..Extras::default() }), &run(&stiffer, &Extras::default()));
    // A spring on the robot's endpoint that undoes one on the limb leaves the robot's motion as it is.
    let both = Extras { limb: spring(-100.0), robot: spring(100.0), ..Extras::default() };
    let (plain, moved) = (run(&experiment, &Extras::default()), run(&experiment, &both));
    let (a, b) = (&plain.channel("pos_x").expect("exists").samples, &moved.channel("pos_x").expect("exists").samples);
    // Their places differ by the transducer's deflection, F/k = 4 µm·100 N/m/100 N.
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 5e-6));
}

#[test]
fn a_delayed_law_acts_late_by_its_delay() {
    let mut experiment = patient_arm();
    experiment.discard_s = 6.0;
    experiment.device.parameters.extend(["coulomb_1_nm", "coulomb_2_nm"].map(|n| (n.to_owned(), 0.0)));
    let (f, delay_s, k) = (3.0, 0.0437, 60.0);
    let commands: Vec<Vec<f64>> =
        (0..2).map(|a| (0..5000).map(|i| if a == 0 { 1e-3 * (std::f64::consts::TAU * f * f64::from(i) / 500.0).sin() } else { 0.0 }).collect()).collect();
    let extras = Extras { limb: vec![Box::new(Spring { stiffness: 0.0, delayed: k, delay_s })], ..Extras::default() };
    let recording = simulate_trial(&experiment, &commands, &extras, 0).expect("runs");
    let line = |name: &str| -> Complex64 {
        let samples = &recording.channel(name).expect("exists").samples;
        samples.iter().enumerate().map(|(i, v)| v * Complex64::new(0.0, -std::f64::consts::TAU * f * i as f64 / 500.0).exp()).sum()
    };
    let model = linearise(&experiment).expect("builds");
    // F = D d with D = C⁻¹ + k e^{−sτ}: check the equation on the line, transducer included.
    let s = Complex64::new(0.0, std::f64::consts::TAU * f);
    let (force, motion) = (array![line("force_x"), line("force_y")], array![line("pos_x"), line("pos_y")]);
    let transducer = (model.transducer.damping * s + model.transducer.stiffness).inv();
    let limb = &motion - &force.mapv(|f| f * transducer);
    let complex = |a: &Array2<f64>| a.mapv(|v| Complex64::new(v, 0.0));
    let stiffness = complex(&model.limb.inertia) * s * s + complex(&model.limb.damping) * s + complex(&model.limb.stiffness);
    let late = (-s * delay_s).exp() * k;
    for i in 0..2 {
        let expected = stiffness.row(i).dot(&limb) + late * limb[i];
        // The transient that is left after 6 s, and the integrator's 1e-6.
        assert!((force[i] - expected).norm() < 1e-4 * force[0].norm(), "{} for {expected}", force[i]);
    }
}

#[test]
fn stages_act_on_the_channel_they_name_and_nowhere_else() {
    let experiment = noisy();
    let commands = sines(&experiment, 4.0);
    let plain = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
    // One sample late, to stand for any stage.
    let late = |name: &str| -> (String, ndof_devices::StageMaker) {
        let stage = || {
            let mut last = 0.0;
            Box::new(move |sample: f64| std::mem::replace(&mut last, sample)) as Box<dyn Stage>
        };
        (name.to_owned(), Box::new(stage))
    };
    let staged = simulate_trial(&experiment, &commands, &Extras { sensors: vec![late("force_y")], ..Extras::default() }, 0).expect("runs");
    for (a, b) in plain.channels().iter().zip(staged.channels()) {
        if a.name == "force_y" {
            assert_eq!(a.samples[..499], b.samples[1..]);
        } else {
            assert_eq!(a, b);
        }
    }
    let error = simulate_trial(&experiment, &commands, &Extras { sensors: vec![late("force_z")], ..Extras::default() }, 0).unwrap_err();
    assert!(matches!(&error, DeviceError::NoChannel { name, .. } if name == "force_z"), "{error}");
    // An actuator's stage delays the whole applied force, so the motion changes.
    let acted = simulate_trial(&experiment, &commands, &Extras { actuators: vec![late("x")], ..Extras::default() }, 0).expect("runs");
    assert_eq!(acted.channels()[0], plain.channels()[0]);
    assert_ne!(acted.channel("pos_x").expect("exists"), plain.channel("pos_x").expect("exists"));
}

#[test]
fn a_mean_force_is_measured_and_the_hand_stays_at_its_posture() {
    let mut experiment = two_link_arm();
    experiment.duration_s = 1.0;
    let silence = sines(&experiment, 0.0);
    let recording = simulate_trial(&experiment, &silence, &Extras::default(), 0).expect("runs");
    for (name, expected) in [("force_x", -3.0), ("force_y", -5.0), ("pos_x", 0.0), ("pos_y", 0.0)] {
        let samples = &recording.channel(name).expect("exists").samples;
        // k·e is a difference of nothing: round-off of 1e6 N/m × 1e-16 m × steps.
        assert!(samples.iter().all(|v| (v - expected).abs() < 1e-8), "{name}: {}", samples[499]);
    }
}

#[test]
fn what_does_not_fit_is_refused_with_its_numbers() {
    let experiment = patient_arm();
    let error = simulate_trial(&experiment, &[vec![0.0; 3]], &Extras::default(), 0).unwrap_err();
    assert!(matches!(error, DeviceError::Excitation { found_axes: 1, found_samples: 3, axes: 2, samples: 2000 }), "{error}");
    let mut far = experiment.clone();
    far.posture.hand_m = Some(vec![0.0, 0.9]);
    assert!(matches!(far.build().err(), Some(DeviceError::Robot(RobotError::Reach { .. }))));
    let mut unknown = experiment.clone();
    unknown.device.parameters.insert("link_3_m".to_owned(), 1.0);
    assert!(unknown.build().err().expect("refused").to_string().contains("link_1_m"));
    let mut soft = experiment.clone();
    soft.device.parameters.insert("transducer_stiffness_n_per_m".to_owned(), 1e5);
    assert!(soft.build().is_err());
    let mut unstable = experiment;
    let LimbConfig::EndpointLinear(limb) = &mut unstable.limb else { unreachable!() };
    limb.K = vec![vec![-1e7, 0.0], vec![0.0, -1e7]];
    unstable.duration_s = 4.0;
    let error = simulate_trial(&unstable, &sines(&unstable, 4.0), &Extras::default(), 2).unwrap_err();
    assert!(matches!(error, DeviceError::Diverged { trial: 2, .. }), "{error}");
}

/// Damping of a light, lightly damped limb from the ratio of force to motion on the lines of a periodic excitation.
fn damping_from_lines(averaging: Averaging) -> f64 {
    let (mass, damping, stiffness) = (0.429, 0.344, 690.7);
    let mut experiment = patient_arm();
    let diagonal = |v: f64| vec![vec![v, 0.0], vec![0.0, v]];
    experiment.limb =
        LimbConfig::EndpointLinear(EndpointLinearConfig { M: diagonal(mass), B: diagonal(damping), K: diagonal(stiffness), ..EndpointLinearConfig::default() });
    experiment.sensors.averaging = averaging;
    experiment.device.parameters.extend(["coulomb_1_nm", "coulomb_2_nm"].map(|n| (n.to_owned(), 0.0)));
    experiment.discard_s = 30.0;
    experiment.duration_s = 10.0;
    let (discarded, recorded) = experiment.samples();
    let lines: Vec<usize> = (1..100).collect();
    let commands: Vec<Vec<f64>> = (0..2)
        .map(|a| {
            let tone = |k: usize, l: usize| (std::f64::consts::TAU * (l * k) as f64 / recorded as f64 + (l * l * (a + 1)) as f64 * 0.37).sin();
            (0..discarded + recorded).map(|k| lines.iter().map(|&l| 1e-2 * tone(k, l)).sum()).collect()
        })
        .collect();
    let recording = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
    let (force, motion) = (&recording.channel("force_x").expect("exists").samples, &recording.channel("pos_x").expect("exists").samples);
    // Least squares of F = (−ω²M + jωB + K) d over the lines, for B: its regressor jωd is orthogonal to the others'.
    let (mut numerator, mut denominator) = (0.0, 0.0);
    for &l in &lines {
        let turn = |k: usize| Complex64::new(0.0, -std::f64::consts::TAU * (l * k) as f64 / recorded as f64).exp();
        let line = |samples: &[f64]| samples.iter().enumerate().map(|(k, v)| v * turn(k)).sum::<Complex64>();
        let (f, v) = (line(force), line(motion) * Complex64::new(0.0, std::f64::consts::TAU * l as f64 / 10.0));
        numerator += (v.conj() * f).re;
        denominator += v.norm_sqr();
    }
    numerator / denominator / damping
}

#[test]
fn instant_sampling_is_the_trap_that_interval_means_avoid() {
    let (interval, instant) = (damping_from_lines(Averaging::Interval), damping_from_lines(Averaging::Instant));
    println!("B interval {interval}, instant {instant}");
    assert!((interval - 1.0).abs() < 0.01, "{interval}");
    assert!((instant - 1.32).abs() < 0.1, "{instant}");
}

#[test]
fn a_transducer_shows_no_more_than_its_range_and_mixes_its_axes_as_told() {
    let mut experiment = patient_arm();
    let commands = sines(&experiment, 4.0);
    let mut run = |change: &dyn Fn(&mut ndof_devices::Sensors)| {
        experiment.sensors = patient_arm().sensors;
        change(&mut experiment.sensors);
        let recording = simulate_trial(&experiment, &commands, &Extras::default(), 0).expect("runs");
        ["force_x", "force_y"].map(|name| recording.channel(name).expect("exists").samples.clone())
    };
    let [x, y] = run(&|_| ());
    let [short, _] = run(&|sensors| sensors.force_range = Some(2.0));
    assert!(x.iter().any(|f| f.abs() > 2.5) && short.iter().zip(&x).all(|(s, f)| *s == f.clamp(-2.0, 2.0)));
    let [_, mixed] = run(&|sensors| sensors.force_matrix = Some(vec![vec![1.0, 0.0], vec![0.02, 1.0]]));
    assert!(mixed.iter().zip(x.iter().zip(&y)).all(|(m, (x, y))| (m - (0.02 * x + y)).abs() < 1e-12));
}

#[test]
fn coarse_converters_add_a_force_of_their_step_and_stiff_holds_are_refused() {
    let mut experiment = patient_arm();
    let commands = sines(&experiment, 4.0);
    let force = |experiment: &ndof_devices::Experiment| {
        let recording = simulate_trial(experiment, &commands, &Extras::default(), 0).expect("runs");
        recording.channel("force_x").expect("exists").samples.clone()
    };
    let smooth = force(&experiment);
    experiment.controller.torque_quantum = 0.029;
    let coarse = force(&experiment);
    let rms = (smooth.iter().zip(&coarse).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / smooth.len() as f64).sqrt();
    // 0.029 N m over lever arms of half a metre is 0.06 N a step, its error 0.06/√12 before the arm filters it.
    assert!(rms > 1e-3 && rms < 0.06, "{rms}");
    experiment.controller.kp = Some(ndof_devices::PerAxis::All(3000.0));
    assert!(experiment.build().err().expect("refused").to_string().contains("2000 N/m"));
    experiment.device = ndof_devices::DeviceConfig::named("inmotion2");
    assert!(experiment.build().is_ok());
}
