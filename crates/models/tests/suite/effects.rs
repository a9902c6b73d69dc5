//! The registry of effects against its contract, and its force laws against an oracle.
//!
//! `reference/effects.json` holds the force of each law for one motion, computed by `reference/effects.py` from the equations alone.

use ndof_models::effects::{Action, CurvedArm, EFFECTS, Effect, Evidence, Injection, Parameters, Scale, Setting, Sign, Trace, Value, find, rotational_name};
use ndof_models::time::laws::NO_MUSCLE_HZ;
use ndof_models::{ForceLaw, Motion};
use std::f64::consts::TAU;

const NAMES: [&str; 32] = [
    "parameter-error",
    "added-mass",
    "coulomb-friction",
    "hysteresis",
    "cubic-stiffness",
    "asymmetric-stiffness",
    "dead-zone",
    "end-stop",
    "viscoelastic",
    "extra-resonance",
    "reflex-delay",
    "measurement-delay",
    "channel-filter",
    "actuation-delay",
    "actuator-saturation",
    "sensor-misalignment",
    "sensor-scale",
    "sensor-offset-drift",
    "quantisation",
    "periodic-disturbance",
    "limb-noise",
    "transient-disturbance",
    "stiffness-drift",
    "posture-drift",
    "varying-stiffness",
    "varying-damping",
    "varying-reflex",
    "arm-geometry",
    "posture-stiffness",
    "gravity",
    "geometry-error",
    "cross-coupling",
];

fn setting() -> Setting {
    Setting { axes: 1, axis: Some(0), mass: vec![vec![2.0]], stiffness: vec![vec![400.0]], duration_s: 3.0, sample_rate_hz: 1000.0, seed: 1 }
}

fn planar() -> Scale {
    Scale {
        position: vec![0.008, 0.006],
        far: vec![0.0144, 0.0108],
        centre: vec![0.001, -0.002],
        velocity: vec![0.09, 0.08],
        effort: vec![4.0, 3.0],
        time_s: 1.0,
        duration_s: 50.0,
        middle_s: 25.0,
        mass: vec![vec![2.0, 0.1], vec![0.1, 1.5]],
        stiffness: vec![vec![400.0, -30.0], vec![-30.0, 300.0]],
        spring: true,
        integrals: 0,
        rotational: false,
        motion_imposed: false,
        effort_is_command: true,
        effort_names: vec!["force_x".to_owned(), "force_y".to_owned()],
        motion_names: vec!["pos_x".to_owned(), "pos_y".to_owned()],
        nominal: vec![],
        held: vec![],
        symmetric: false,
        closed_schedule: Some(true),
        arm: Some(CurvedArm { link_lengths_m: [0.33, 0.34], posture_rad: [0.785, 1.571], mean_force_n: [5.0, -6.0] }),
    }
}

/// The planar arm about its origin.
fn scale() -> Scale {
    Scale { centre: vec![0.0, 0.0], ..planar() }
}

fn position(t: f64) -> f64 {
    0.01 * (TAU * 1.3 * t).sin() + 0.004 * (TAU * 3.1 * t + 0.5).sin()
}

fn velocity(t: f64) -> f64 {
    0.01 * TAU * 1.3 * (TAU * 1.3 * t).cos() + 0.004 * TAU * 3.1 * (TAU * 3.1 * t + 0.5).cos()
}

/// The force at `t` after integrating the hidden states from rest at 0 by Heun's rule.
fn force(law: &dyn ForceLaw, until: &[f64]) -> Vec<f64> {
    let h = 2e-5;
    let at = |t: f64, z: &[f64]| {
        let (x, v, xd, vd) = ([position(t)], [velocity(t)], [position(t - law.delay_s())], [velocity(t - law.delay_s())]);
        let motion = Motion { delayed_position: &xd, delayed_velocity: &vd, ..Motion::now(t, &x, &v) };
        let (mut f, mut rates) = ([0.0], vec![0.0; z.len()]);
        law.evaluate(&motion, z, &mut f, &mut rates);
        (f[0], rates)
    };
    let mut z = vec![0.0; law.states()];
    let mut k = 0usize;
    until
        .iter()
        .map(|&t| {
            while ((k + 1) as f64) * h <= t + 1e-12 {
                let now = k as f64 * h;
                let a = at(now, &z).1;
                let ahead: Vec<f64> = z.iter().zip(&a).map(|(z, a)| z + h * a).collect();
                let b = at(now + h, &ahead).1;
                z.iter_mut().zip(a.iter().zip(&b)).for_each(|(z, (a, b))| *z += 0.5 * h * (a + b));
                k += 1;
            }
            at(t, &z).0
        })
        .collect()
}

#[test]
fn the_registry_has_every_name_of_the_contract_once_and_in_order() {
    let names: Vec<&str> = EFFECTS.iter().map(|e| e.name()).collect();
    assert_eq!(names, NAMES);
}

#[test]
fn every_card_is_complete_and_its_look_alikes_exist() {
    for effect in EFFECTS {
        let card = effect.card;
        for text in [card.what, card.signature, card.next_experiment, card.equation, card.source] {
            assert!(text.len() > 5, "{}", card.name);
        }
        assert!(!card.sides.is_empty() && !card.parameters.is_empty(), "{}", card.name);
        assert!(card.look_alikes.iter().all(|l| find(l).is_some() && *l != card.name), "{}", card.name);
    }
}

#[test]
fn what_an_effect_stands_for_exists_and_a_plain_finding_stands_for_nothing_else() {
    let scale = scale();
    let told = |effect: &Effect, size: f64, beside: &[&str], gain: f64| {
        let parameters: Vec<(&str, f64)> = effect.card.parameters.iter().map(|p| (p.name, size)).collect();
        let coefficients: [&[f64]; 1] = [&[1.0, size / scale.position[0]]];
        let gain_worth = || Some(gain);
        effect.stands_for(&Evidence { parameters: &parameters, coefficients: &coefficients, axis: Some(0), scale: &scale, beside, gain_worth: &gain_worth })
    };
    let mut some = 0;
    for effect in EFFECTS {
        let others: Vec<&str> = NAMES.into_iter().filter(|name| *name != effect.name()).collect();
        for size in [1e-9, 1e9] {
            for beside in [&[][..], &others] {
                let names = told(effect, size, beside, 0.0);
                assert!(names.iter().all(|name| find(name).is_some() && *name != effect.name()), "{}: {names:?}", effect.name());
                some += usize::from(!names.is_empty());
            }
        }
    }
    assert!(some >= 8, "{some}");
    // A loop as wide as the motion, a narrow gap, a mode that swings, a reflex of 50 ms and 3 Hz, a filter whose gain is seen.
    for (name, size) in
        [("hysteresis", 0.008), ("dead-zone", 0.004), ("extra-resonance", 0.05), ("reflex-delay", 0.05), ("channel-filter", 10.0), ("cubic-stiffness", 0.0)]
    {
        assert_eq!(told(find(name).expect("it is there"), size, &[], 100.0), [""; 0], "{name}");
    }
}

#[test]
fn force_laws_agree_with_the_oracle() {
    let doc: serde_json::Value = serde_json::from_str(include_str!("../reference/effects.json")).expect("JSON");
    let times: Vec<f64> = doc["time_s"].as_array().expect("times").iter().filter_map(serde_json::Value::as_f64).collect();
    for case in doc["cases"].as_array().expect("cases") {
        let name = case["effect"].as_str().expect("a name");
        let parameters: Parameters = serde_json::from_value(case["parameters"].clone()).expect("numbers");
        let injection = find(name).expect("an effect").inject(&parameters, &setting()).expect("valid");
        let Injection::Force(law) = injection else { panic!("{name} is no force") };
        let want: Vec<f64> = case["force"].as_array().expect("forces").iter().filter_map(serde_json::Value::as_f64).collect();
        let size = want.iter().fold(0.0f64, |m, f| m.max(f.abs()));
        for ((t, got), want) in times.iter().zip(force(law.as_ref(), &times)).zip(&want) {
            // Heun's rule at 20 µs against an adaptive integrator of tenth digits; the kinks of hysteresis cost the most.
            assert!((got - want).abs() < 2e-5 * size, "{name} at {t}: {got}, the oracle has {want}");
        }
    }
}

/// Forces and responses add up.
#[test]
fn what_relaxes_beside_a_power_is_the_sum_of_both() {
    let law = |modulus: f64, coefficient: f64| {
        let parameters = Parameters::new([("modulus_n_per_m", modulus), ("coefficient", coefficient), ("order", 0.3)]);
        let Ok(Injection::Force(law)) = find("viscoelastic").expect("an effect").inject(&parameters, &setting()) else { panic!("no force") };
        law
    };
    let [both, solid, power] = [law(250.0, 20.0), law(250.0, 0.0), law(0.0, 20.0)];
    let times = [0.02, 0.1, 0.13];
    let [all, one, other] = [&both, &solid, &power].map(|law| force(law.as_ref(), &times));
    for k in 0..times.len() {
        assert!((all[k] - one[k] - other[k]).abs() < 1e-12 * (one[k].abs() + other[k].abs()) && one[k] != 0.0 && other[k] != 0.0);
    }
    // Rates are those of the shortest time, 2⁻⁹ s of the power and 0.1 s of the solid.
    assert_eq!([&both, &solid].map(|law| law.fastest_rate(&Motion::now(0.0, &[0.0], &[0.0]))), [512.0, 10.0]);
    let [all, one, other] = [both, solid, power].map(|law| law.response(num_complex::Complex64::I).expect("a linear law"));
    assert!((all - one - other).norm() < 1e-12 * all.norm() && one.norm() > 0.0 && other.norm() > 0.0);
}

#[test]
fn a_form_pushes_the_way_its_force_law_does() {
    // Sign of each first coefficient's regressor against the law that a simulation hides, by the work along one motion.
    for effect in EFFECTS.iter().filter(|e| e.card.trace == Trace::Forms) {
        for form in effect.forms(&scale()) {
            let knobs = &form.grid[0];
            let unit: Vec<f64> = (0..form.signs.len()).map(|k| if k == 0 { 1.0 } else { 0.0 }).collect();
            let Some((made, zero)) = form.action.law(knobs, &unit).zip(form.action.law(knobs, &vec![0.0; form.signs.len()])) else { continue };
            assert!(made.states() < 64 && made.delay_s() >= 0.0);
            let z = vec![0.1; zero.states()];
            let (x, v) = ([0.004, -0.002], [0.05, 0.03]);
            let motion = Motion { schedule: 0.3, ..Motion::now(1.0, &x, &v) };
            let (mut f, mut rates) = ([0.0; 2], vec![0.0; z.len()]);
            zero.evaluate(&motion, &vec![0.0; z.len()], &mut f, &mut rates);
            assert_eq!(f, [0.0; 2], "{} {}: severity zero must change nothing", effect.name(), form.label);
        }
    }
}

#[test]
fn responses_agree_with_their_laws_on_a_sine() {
    // After the transient the law's answer to a sine is its response; fractional elements to their stated 0.4 %, times the sum's ends.
    let mut some = 0;
    for (effect, time_s) in EFFECTS.iter().flat_map(|effect| [(effect, 1.0), (effect, 0.25)]) {
        for form in effect.forms(&Scale { time_s, ..scale() }) {
            let Action::Force { law, .. } = &form.action else { continue };
            if form.axis != Some(0) || form.label == "carried mass" {
                continue;
            }
            for j in 0..form.signs.len() {
                let knobs = &form.grid[0];
                let unit: Vec<f64> = (0..form.signs.len()).map(|k| if k == j { 1.0 } else { 0.0 }).collect();
                let law = law(knobs, &unit);
                let (f, h) = (1.5, 1e-4);
                let w = TAU * f;
                let Some(want) = law.response(num_complex::Complex64::new(0.0, w)) else { continue };
                some += 1;
                let mut z = vec![0.0; law.states()];
                let (mut sin, mut cos) = (0.0, 0.0);
                let steps = (40.0 / f / h) as usize;
                let last = (1.0 / f / h).round() as usize;
                for k in 0..steps {
                    let t = k as f64 * h;
                    let place = |t: f64| [(w * t).sin(), 0.0];
                    let speed = |t: f64| [w * (w * t).cos(), 0.0];
                    let d = law.delay_s();
                    let rates = |t: f64, z: &[f64]| {
                        let (x, v, xd, vd) = (place(t), speed(t), place(t - d), speed(t - d));
                        let (mut force, mut rates) = ([0.0; 2], vec![0.0; z.len()]);
                        law.evaluate(&Motion { delayed_position: &xd, delayed_velocity: &vd, ..Motion::now(t, &x, &v) }, z, &mut force, &mut rates);
                        (force[0], rates)
                    };
                    let (now, a) = rates(t, &z);
                    if k + last >= steps {
                        sin += now * (w * t).sin() * 2.0 / last as f64;
                        cos += now * (w * t).cos() * 2.0 / last as f64;
                    }
                    let ahead: Vec<f64> = z.iter().zip(&a).map(|(z, a)| z + h * a).collect();
                    let b = rates(t + h, &ahead).1;
                    z.iter_mut().zip(a.iter().zip(&b)).for_each(|(z, (a, b))| *z += 0.5 * h * (a + b));
                }
                let error = ((sin - want.re).powi(2) + (cos - want.im).powi(2)).sqrt() / want.norm();
                let bound = if form.label == "fractional" { 0.05 } else { 2e-3 };
                assert!(error < bound, "{} {} term {j}: {sin} + {cos} i against {want}", effect.name(), form.label);
            }
        }
    }
    assert_eq!(
        some,
        2 * 12,
        "a solid, two times, a fraction, reflexes with three gains with a muscle and without, a soft hold with two, each in two units of time"
    );
}

/// Of a Gaussian velocity half passes a rectifier (Bussgang): ½ s e^(−sτ) (ω/(s + ω))². A late channel is e^(−sτ), and one that is early undoes it.
#[test]
fn tangents_and_delays_are_what_their_equations_say() {
    let (s, mut some) = (num_complex::Complex64::new(0.0, TAU * 1.7), [0; 3]);
    for form in find("reflex-delay").expect("an effect").forms(&scale()) {
        let Action::Force { tangent: Some(tangent), .. } = &form.action else { continue };
        // Without a muscle there is the delay alone.
        let cutoff_hz = if form.knobs.len() == 1 { NO_MUSCLE_HZ } else { 2.0 };
        let (omega, share) = (TAU * cutoff_hz, if form.label.contains("only") { 0.5 } else { 1.0 });
        let want = share * s * (-s * 0.04).exp() * (omega / (s + omega)).powi(2);
        assert!((tangent(s, &[0.04, 2.0]) - want).norm() < 1e-14 * want.norm(), "{}", form.label);
        some[0] += usize::from(share < 1.0);
    }
    for (k, (name, sign)) in [("actuation-delay", -1.0), ("measurement-delay", 1.0)].into_iter().enumerate() {
        // One that grows is no operator.
        for form in find(name).expect("an effect").forms(&scale()).into_iter().filter(|form| !matches!(form.action, Action::Lag)) {
            let (Action::Effort(operator) | Action::Motion(operator)) = &form.action else { panic!("{name} is of a channel") };
            assert!((operator(s, &[0.003]) - (sign * s * 0.003).exp()).norm() < 1e-14, "{name} {}", form.label);
            some[1 + k] += 1;
        }
    }
    assert!(some.iter().all(|count| *count > 0), "{some:?}");
}

#[test]
fn the_gain_of_a_reflex_is_that_of_the_place_where_the_stretch_arrives() {
    for (closed, at_a_tenth) in [(true, 5.0 + 2.0 * (TAU * 0.1).cos() - (TAU * 0.1).sin()), (false, 5.0 + 2.0 * (TAU * 0.05).cos() - (TAU * 0.1).cos())] {
        let forms = find("varying-reflex").expect("an effect").forms(&Scale { closed_schedule: Some(closed), ..scale() });
        assert_eq!(forms.len(), 18, "two axes, three directions, three sizes");
        for (form, drive) in forms.iter().filter(|form| form.signs.len() == 3 && form.axis == Some(1)).zip([-0.03, 0.0, -0.03]) {
            let law = form.action.law(&[0.04, 2.0], &[5.0, 2.0, -1.0]).expect("a law");
            for (schedule, gain) in [(0.1, at_a_tenth), (f64::NAN, 5.0)] {
                let motion =
                    Motion { time_s: 1.0, position: &[0.0; 2], velocity: &[9.0; 2], delayed_position: &[9.0; 2], delayed_velocity: &[9.0, -0.03], schedule };
                let (mut force, mut rates) = ([0.0; 2], [0.0; 2]);
                law.evaluate(&motion, &[0.7, 0.0], &mut force, &mut rates);
                let want = (TAU * 2.0).powi(2) * (gain * drive - 0.7);
                assert!(
                    law.response(num_complex::Complex64::I).is_none() && law.fastest_rate(&motion) == TAU * 4.0,
                    "not linear, and two roots at the cut-off"
                );
                assert!(force == [0.0, 0.7] && law.delay_s() == 0.04 && (rates[1] - want).abs() < 1e-12 * want.abs(), "{}: {rates:?} {want}", form.label);
            }
        }
    }
    assert!(find("varying-reflex").expect("an effect").forms(&Scale { closed_schedule: None, ..scale() }).is_empty());
}

/// F_c tanh(v/v_t): what has no level at rest of its own has no excess there either.
#[test]
fn friction_of_one_level_is_that_level_at_every_velocity() {
    let parameters = Parameters::new([("level_n", 2.0), ("smoothing_m_per_s", 1e-3)]);
    let Ok(Injection::Force(law)) = find("coulomb-friction").expect("an effect").inject(&parameters, &setting()) else { panic!("no force") };
    for v in [-0.2, -1e-3, 5e-4, 3e-3, 1.0] {
        let mut force = [0.0];
        law.evaluate(&Motion::now(0.0, &[0.0], &[v]), &[], &mut force, &mut []);
        assert!((force[0] - 2.0 * (v / 1e-3).tanh()).abs() < 1e-14, "{v}: {}", force[0]);
    }
}

#[test]
fn a_left_arm_is_the_mirror_image_of_a_right_one() {
    let arm = |side: f64| CurvedArm { link_lengths_m: [0.33, 0.34], posture_rad: [side * 0.785, side * 1.571], mean_force_n: [5.0, -6.0 * side] };
    let [right, left] = [1.0, -1.0].map(|side| arm(side).displaced([0.02, 0.03 * side]).expect("in reach"));
    for k in 0..2 {
        let mirrored = if k == 1 { -1.0 } else { 1.0 };
        assert!((right.angles[k] + left.angles[k]).abs() < 1e-14 && right.angles[k].abs() > 1e-3);
        assert!((right.stretch[k] - mirrored * left.stretch[k]).abs() < 1e-14 && (right.held[k] - mirrored * left.held[k]).abs() < 1e-12);
    }
}

#[test]
fn unknown_and_impossible_parameters_are_refused() {
    let friction = find("coulomb-friction").expect("an effect");
    assert!(friction.inject(&Parameters::new([("level", 1.0)]), &setting()).is_err());
    assert!(friction.inject(&Parameters::new([("level_n", -1.0)]), &setting()).is_err());
    assert!(friction.inject(&Parameters::new([("level_n", 1.0), ("levle_n", 2.0)]), &setting()).is_err(), "one that is right beside one that is not known");
    assert!(friction.inject(&Parameters::default(), &setting()).is_err());
    assert!(friction.inject(&Parameters::new([("level_nm", 1.0)]), &setting()).is_ok(), "the rotational twin of a name");
    assert_eq!(rotational_name("damping_n_s_per_m"), "damping_nm_s_per_rad");
    let mut beside = Parameters::new([("factor", 1.1)]);
    let scale = find("sensor-scale").expect("an effect");
    assert!(scale.inject(&beside, &setting()).is_ok());
    beside.0.insert("relative_to".to_owned(), Value::Text("force_x".to_owned()));
    assert!(scale.inject(&beside, &setting()).is_err(), "what an answer alone has");
    let mode = |more: &[(&'static str, f64)]| {
        let pairs = [("frequency_hz", 5.0), ("mass_share", 0.2)].into_iter().chain(more.iter().copied());
        find("extra-resonance").expect("an effect").inject(&Parameters::new(pairs), &setting()).is_ok()
    };
    assert!(mode(&[]) && !mode(&[("gain_beyond", 0.4)]), "what an answer alone has");
}

#[test]
fn stages_do_what_their_equations_say() {
    let stage = |name: &str, pairs: &[(&str, f64)]| {
        let parameters = Parameters::new(pairs.iter().copied());
        let Injection::Stage(stage) = find(name).expect("an effect").inject(&parameters, &setting()).expect("valid") else { panic!("{name} is no stage") };
        stage
    };
    let mut late = stage("measurement-delay", &[("delay_s", 0.0025)]);
    let out: Vec<f64> = (0..6).map(|k| late.step(f64::from(k))).collect();
    assert!((out[5] - 2.5).abs() < 1e-12, "{out:?}");
    // A ramp's own clock: k less what it is late by, 2 samples and a hundredth of those that came.
    let mut growing = stage("measurement-delay", &[("delay_s", 0.002), ("drift_s_per_s", 0.01)]);
    for k in 0..400 {
        let want = (0.99 * f64::from(k) - 2.0).max(0.0);
        assert!((growing.step(f64::from(k)) - want).abs() < 1e-12 * want.max(1.0), "{k}");
    }
    let mut none = stage("measurement-delay", &[("delay_s", 0.0)]);
    assert_eq!((none.step(1.5), none.step(-2.0)), (1.5, -2.0));
    let mut steps = stage("quantisation", &[("step", 0.5)]);
    assert_eq!((steps.step(0.7), steps.step(-0.8)), (0.5, -1.0));
    let mut clip = stage("actuator-saturation", &[("level_n", 2.0)]);
    assert_eq!((clip.step(5.0), clip.step(-3.0), clip.step(1.0)), (2.0, -2.0, 1.0));
    let mut filter = stage("channel-filter", &[("cutoff_hz", 20.0), ("order", 2.0)]);
    let out: Vec<f64> = (0..2000).map(|k| filter.step((TAU * 20.0 * f64::from(k) / 1000.0).sin())).collect();
    let top = out[1000..].iter().fold(0.0f64, |m, v| m.max(v.abs()));
    assert!((top - 0.5f64.sqrt()).abs() < 0.01, "half the power at the cut-off: {top}");
}

#[test]
fn channel_filters_of_every_order_are_butterworth_with_their_cut_off_kept() {
    let (cutoff, rate) = (20.0, 1000.0);
    let warped = |hz: f64| (std::f64::consts::PI * hz / rate).tan();
    for order in 1..=8 {
        for hz in [5.0, 20.0, 40.0] {
            let parameters = Parameters::new([("cutoff_hz", cutoff), ("order", f64::from(order))]);
            let Ok(Injection::Stage(mut stage)) = find("channel-filter").expect("an effect").inject(&parameters, &setting()) else { panic!("no stage") };
            let (mut sin, mut cos) = (0.0, 0.0);
            // Ten cut-offs of settling, then whole periods.
            for k in 0..2000 {
                let phase = TAU * hz * f64::from(k) / rate;
                let out = stage.step(phase.sin());
                if k >= 1000 {
                    sin += out * phase.sin() / 500.0;
                    cos += out * phase.cos() / 500.0;
                }
            }
            let want = (1.0 + (warped(hz) / warped(cutoff)).powi(2 * order)).sqrt().recip();
            assert!((sin.hypot(cos) - want).abs() < 1e-6, "order {order} at {hz} Hz: {} {want}", sin.hypot(cos));
        }
    }
    // A corner that the samples do not hold is the highest that they do.
    let first = |cutoff: f64| match find("channel-filter").expect("an effect").inject(&Parameters::new([("cutoff_hz", cutoff), ("order", 2.0)]), &setting()) {
        Ok(Injection::Stage(mut stage)) => stage.step(1.0),
        _ => panic!("no stage"),
    };
    assert_eq!(first(0.49 * rate), first(1e6));
}

#[test]
fn a_zero_drifts_through_nothing_in_the_middle_and_a_gain_multiplies() {
    let stage = |name: &str, pairs: &[(&str, f64)]| {
        let Ok(Injection::Stage(stage)) = find(name).expect("an effect").inject(&Parameters::new(pairs.iter().copied()), &setting()) else { panic!("{name}") };
        stage
    };
    let mut drift = stage("sensor-offset-drift", &[("rate_per_s", 0.4)]);
    for k in 1..=3000 {
        let want = 7.0 + 0.4 * (f64::from(k) / 1000.0 - 1.5);
        assert!((drift.step(7.0) - want).abs() < 1e-9, "sample {k}");
    }
    // What settles starts with its rate, is nothing in the middle, and loses the same share of its slope each sample.
    let mut settling = stage("sensor-offset-drift", &[("rate_per_s", 0.4), ("settling_per_s", 2.0)]);
    let course: Vec<f64> = (0..3000).map(|_| settling.step(7.0) - 7.0).collect();
    let slopes: Vec<f64> = course.windows(2).map(|w| (w[1] - w[0]) * 1000.0).collect();
    assert!(course[1499].abs() < 1e-9 && (slopes[0] - 0.4).abs() < 0.4 * 4e-3, "{} {}", course[1499], slopes[0]);
    assert!(slopes.windows(2).all(|w| (w[1] / w[0] - (-2e-3f64).exp()).abs() < 1e-6));
    assert_eq!(stage("sensor-scale", &[("factor", -1.25)]).step(3.0), -3.75);
    let mut late = stage("actuation-delay", &[("delay_s", 0.0025)]);
    let out: Vec<f64> = (0..6).map(|k| late.step(f64::from(k))).collect();
    assert!((out[5] - 2.5).abs() < 1e-12, "{out:?}");
}

#[test]
fn noise_of_the_limb_has_the_rms_that_was_asked_for_and_each_axis_its_own() {
    let inject = |seed: u64| {
        let setting = Setting { axes: 2, axis: None, duration_s: 40.0, seed, ..setting() };
        let Ok(Injection::Force(law)) = find("limb-noise").expect("an effect").inject(&Parameters::new([("rms_n", 0.7), ("cutoff_hz", 2.0)]), &setting) else {
            panic!("no force")
        };
        law
    };
    let read = |law: &dyn ForceLaw, time_s: f64| {
        let (still, mut force) = ([0.0; 2], [0.0; 2]);
        law.evaluate(&Motion::now(time_s, &still, &still), &[], &mut force, &mut []);
        force
    };
    let law = inject(1);
    // Read on the samples of its own grid, 50 to a cycle of the cut-off.
    let run: Vec<[f64; 2]> = (0..4000).map(|k| read(law.as_ref(), f64::from(k) / 100.0)).collect();
    let mean = |of: &dyn Fn(usize) -> f64| (0..run.len()).map(of).sum::<f64>() / run.len() as f64;
    for axis in [0, 1] {
        assert!((mean(&|k| run[k][axis].powi(2)).sqrt() - 0.7).abs() < 1e-3);
        // Below the cut-off nearly all: ẋ of 2 π f with f² over 0 to 2 Hz on average, what the skirt has more.
        let speed = mean(&|k| if k > 0 { (100.0 * (run[k][axis] - run[k - 1][axis])).powi(2) } else { 0.0 }).sqrt() / 0.7;
        assert!((0.5 * TAU * 2.0..TAU * 2.0).contains(&speed), "{speed}");
    }
    // 160 independent values: 4 / √160.
    assert!(mean(&|k| run[k][0] * run[k][1]).abs() < 0.32 * 0.49);
    let between = read(law.as_ref(), 1.0 + 0.3 / 100.0);
    assert!((between[1] - (0.7 * run[100][1] + 0.3 * run[101][1])).abs() < 1e-9);
    // From the first sample on, over seeds; no seed like another.
    let first: Vec<f64> = (0..60).map(|seed| read(inject(seed).as_ref(), 0.0)[0]).collect();
    let square = first.iter().map(|f| f * f).sum::<f64>() / 60.0 / 0.49;
    // The mean of sixty squares of a normal: √(2/60), four of them.
    assert!((square - 1.0).abs() < 0.73, "{square}");
}

#[test]
fn springs_that_slip_hold_at_both_ends_and_let_go_inwards() {
    let forms = find("hysteresis").expect("an effect").forms(&scale());
    let slip = forms.iter().find(|form| form.label == "Maxwell-slip").expect("a form");
    let Action::Force { law, .. } = &slip.action else { panic!("no force") };
    let law = law(&[0.001], &[300.0]);
    let rates = |states: [f64; 3], v: f64| {
        let (x, v, mut force, mut rates) = ([0.0; 2], [v, 0.0], [0.0; 2], [0.0; 3]);
        law.evaluate(&Motion::now(0.0, &x, &v), &states, &mut force, &mut rates);
        rates
    };
    for sign in [1.0, -1.0] {
        let pulled = [0.4e-3, 1e-3, 1.6e-3].map(|y| sign * 1.001 * y);
        assert_eq!(rates(pulled, sign * 0.1), [0.0; 3]);
        assert_eq!(rates(pulled, -sign * 0.1), [-sign * 0.1; 3]);
        assert_eq!(rates(pulled.map(|z| 0.9 * z), sign * 0.1), [sign * 0.1; 3]);
    }
}

#[test]
fn what_an_arm_adds_grows_with_the_square_and_needs_a_plane() {
    let setting = Setting { axes: 2, axis: None, mass: vec![], stiffness: vec![vec![300.0, -60.0], vec![-60.0, 520.0]], ..setting() };
    let slope = Parameters::new([("coupling_with_elbow_nm_per_rad2", 40.0)]);
    for (name, parameters) in [("arm-geometry", Parameters::default()), ("posture-stiffness", slope)] {
        let effect = find(name).expect("an effect");
        let Ok(Injection::Force(law)) = effect.inject(&parameters, &setting) else { panic!("{name} is no force") };
        let force = |x: [f64; 2]| {
            let mut force = [0.0; 2];
            law.evaluate(&Motion::now(0.0, &x, &[0.0; 2]), &[], &mut force, &mut []);
            force
        };
        let (near, far) = (force([1e-4, 2e-4]), force([2e-4, 4e-4]));
        let size = far[0].hypot(far[1]);
        // The next order is 4e-4 m of 0.3 m away.
        assert!(size > 0.0 && (far[0] - 4.0 * near[0]).hypot(far[1] - 4.0 * near[1]) < 5e-3 * size, "{name}: {near:?} {far:?}");
        assert!(effect.inject(&parameters, &Setting { axes: 1, ..setting.clone() }).is_err(), "{name} along a line");
        assert!(effect.forms(&Scale { arm: None, ..scale() }).is_empty() && !effect.forms(&scale()).is_empty(), "{name}");
    }
    let inertia = Parameters::new([("coupling_kg_m2", 0.2)]);
    assert!(find("arm-geometry").expect("an effect").inject(&inertia, &setting).is_err(), "what a linear limb cannot have");
}

/// Within a gap that all of the movement lies in, no spring is felt: any stiffness would do beyond it.
#[test]
fn a_gap_is_sought_where_the_movement_goes() {
    let steps = Scale { far: vec![0.009, 0.0066], ..scale() };
    let forms = find("dead-zone").expect("an effect").forms(&steps);
    assert_eq!(forms.len(), 4);
    for form in forms {
        let far = steps.far[form.axis.expect("one axis")];
        assert_eq!(form.knobs[0].hi, far);
        assert!(form.grid.iter().all(|start| start[0] <= far), "{:?}", form.grid);
    }
}

#[test]
fn forms_that_need_a_given_baseline_stay_away_without_one() {
    for name in ["added-mass", "parameter-error", "cross-coupling", "sensor-scale"] {
        assert!(find(name).expect("an effect").forms(&scale()).is_empty(), "{name}");
    }
    // Of two axes with symmetric matrices, one stiffness and one damping that turn.
    assert_eq!(find("cross-coupling").expect("an effect").forms(&Scale { symmetric: true, ..planar() }).len(), 2);
    let signs: Vec<Sign> = find("coulomb-friction").expect("an effect").forms(&scale())[0].signs.clone();
    assert_eq!(signs, [Sign::Positive]);
}
