//! The two open findings of Palazzolo et al. (2007) in a planar arm held by a robot, at realistic noise, and four known traps.
//!
//! Coherence below 1 Hz is lowered by the limb's own force, by hysteresis or by friction; the phase rolls off above 5 Hz by a filter or
//! latency of the force channel, or by compliance in series, and a reflex does not roll it off.

use ndof_challenge::{Case, Hidden, Made, Plant, make};
use ndof_diagnose::{Diagnosis, Options, Verdict, diagnose};
use ndof_models::effects::Value;

fn made(plant: Plant, hidden: &[(&'static str, f64)], seed: u64) -> Made {
    let hidden = hidden.iter().map(|&(name, severity)| Hidden { name, severity }).collect();
    make(&Case { plant, hidden, other: false, background: false, trials: 2, duration_s: 40.0, seed, command: (1.0, 1.0) })
}

fn answer(made: &Made) -> Diagnosis {
    diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis")
}

/// Names, with those that cannot be told apart in one.
fn names(d: &Diagnosis) -> Vec<String> {
    d.causes.iter().map(|c| d.confusable.iter().find(|k| k.effects.contains(&c.effect)).map_or_else(|| c.effect.clone(), |k| k.effects.join(" or "))).collect()
}

fn asked(hidden: &[(&'static str, f64)], wanted: &[&str], seed: u64) {
    let made = made(Plant::Planar, hidden, seed);
    let d = answer(&made);
    let found = names(&d);
    for want in wanted {
        assert!(found.iter().any(|f| f.contains(want)), "{hidden:?} -> {found:?} {:?} {:?}", d.minor, d.considered.first());
    }
    for cause in d.causes.iter().filter(|c| !c.site.axis.is_empty() && c.site.side == "limb" && c.effect != "limb-noise") {
        assert_eq!(cause.site.axis, made.axis_name, "{hidden:?} -> {found:?}");
    }
    assert!(found.iter().filter(|f| *f != "limb-noise").count() <= wanted.iter().filter(|w| **w != "limb-noise").count(), "{hidden:?} -> {found:?}");
}

#[test]
fn what_lowers_the_coherence_below_one_hertz_is_named() {
    asked(&[("limb-noise", 0.9)], &["limb-noise"], 3);
    asked(&[("hysteresis", 0.4)], &["hysteresis"], 4);
    asked(&[("coulomb-friction", 0.3)], &["coulomb-friction"], 5);
}

#[test]
fn what_rolls_the_phase_off_above_five_hertz_is_named() {
    asked(&[("channel-filter", 0.5)], &["channel-filter"], 6);
    asked(&[("measurement-delay", 0.5)], &["measurement-delay"], 7);
    asked(&[("series-compliance", 0.8)], &["extra-resonance"], 8);
}

/// Forces of the limb's own that a transducer does not read: what they are at a time, by trial and input.
fn own_force(made: &mut Made, of: impl Fn(usize, usize, f64) -> f64) {
    let inputs = made.ports.inputs.clone();
    for (trial, recording) in made.recordings.iter_mut().enumerate() {
        let step_s = 1.0 / recording.sample_rate_hz();
        for (axis, &input) in inputs.iter().enumerate() {
            let name = recording.channels()[input].name.clone();
            let mut t = 0.0;
            let less = |force| {
                t += step_s;
                force - of(trial, axis, t)
            };
            recording.map_channel(&name, less).expect("it is there");
        }
    }
}

/// A tremor goes along both axes; the weaker one is there as well.
#[test]
fn a_tremor_is_told_along_every_axis_that_has_it() {
    let mut made = made(Plant::Planar, &[], 12);
    own_force(&mut made, |_, axis, t| [1.0, 0.6][axis] * (std::f64::consts::TAU * 6.0 * t).sin());
    let d = answer(&made);
    let mut axes: Vec<(&str, f64)> = Vec::new();
    for cause in d.causes.iter().filter(|c| c.effect == "periodic-disturbance") {
        let amplitude = cause.parameters.iter().find(|p| p.name == "amplitude_n").and_then(|p| p.ci95).expect("an interval");
        axes.push((&cause.site.axis, 0.5 * (amplitude[0] + amplitude[1])));
    }
    axes.sort_by(|a, b| a.0.cmp(b.0));
    assert!(axes.len() == 2 && (axes[0].1 - 1.0).abs() < 0.1 && (axes[1].1 - 0.6).abs() < 0.06, "{axes:?}");
}

/// A limb does not move by itself as much in one trial as in the next: what remains at best is that of the trial that is compared.
#[test]
fn the_noise_floor_is_that_of_the_part_that_no_fit_saw() {
    let mut made = made(Plant::Planar, &[("coulomb-friction", 0.4)], 5);
    // Twelve lines below 2 Hz, which no multiple of another is: in the trial that is held out alone.
    let own = |axis: usize, t: f64| (0..12).map(|k| (std::f64::consts::TAU * (0.3 + 0.137 * k as f64) * t + 2.3 * (k + 5 * axis) as f64).sin()).sum::<f64>();
    own_force(&mut made, |trial, axis, t| if trial == 1 { 0.15 * own(axis, t) } else { 0.0 });
    let d = answer(&made);
    assert_eq!(names(&d).first().map(String::as_str), Some("coulomb-friction"), "{:?}", d.causes);
    for (floor, reached) in d.noise_floor.nrmse.iter().zip(&d.extended.held_out.nrmse) {
        let (floor, reached) = (floor.expect("a floor"), reached.expect("an error"));
        assert!(floor > 0.8 * reached && floor <= reached, "{floor} {reached}");
    }
}

#[test]
fn a_reflex_is_named_and_is_no_delay_of_a_channel() {
    let made = made(Plant::Planar, &[("reflex-delay", 0.6)], 9);
    let d = answer(&made);
    assert_eq!(names(&d).first().map(String::as_str), Some("reflex-delay"), "{:?}", d.causes);
    assert!(d.causes.iter().all(|c| c.effect != "measurement-delay" && c.effect != "channel-filter"), "{:?}", names(&d));
}

#[test]
fn one_of_each_finding_are_both_named() {
    asked(&[("hysteresis", 0.4), ("channel-filter", 0.5)], &["hysteresis", "channel-filter"], 10);
    asked(&[("coulomb-friction", 0.4), ("measurement-delay", 0.5)], &["coulomb-friction", "measurement-delay"], 11);
    asked(&[("limb-noise", 0.9), ("measurement-delay", 0.6)], &["limb-noise", "measurement-delay"], 12);
}

#[test]
fn a_compliant_joint_is_not_called_a_delay() {
    let d = answer(&made(Plant::Force, &[("series-compliance", 0.8)], 13));
    assert_eq!(d.causes.first().map(|c| c.effect.as_str()), Some("extra-resonance"), "{:?}", d.causes);
    assert!(d.causes.iter().all(|c| c.effect != "measurement-delay"), "{:?}", d.causes);
}

#[test]
fn friction_is_not_swallowed_by_damping() {
    let made = made(Plant::Force, &[("coulomb-friction", 0.5)], 14);
    let d = answer(&made);
    assert_eq!(d.causes.first().map(|c| c.effect.as_str()), Some("coulomb-friction"));
    let shift = d.extended.parameter_shift.iter().find(|s| s.name == "B").expect("damping had been biased");
    let truth = made.damping[0][0];
    assert!(shift.before > 1.1 * truth && (shift.after / truth - 1.0).abs() < 0.05, "{} -> {} of {truth}", shift.before, shift.after);
}

#[test]
fn the_bias_of_the_loop_is_not_called_stiffness() {
    let made = made(Plant::Planar, &[("limb-noise", 0.9)], 15);
    let d = answer(&made);
    assert!(d.causes.iter().all(|c| c.effect == "limb-noise"), "{:?}", d.causes);
    for (i, row) in ["x", "y"].iter().enumerate() {
        let k = d.baseline.parameters.iter().find(|p| p.name == format!("K_{row}_{row}")).expect("a stiffness");
        let error = k.value - made.stiffness[i][i];
        assert!(error.abs() < 4.0 * k.std_error.expect("fitted"), "{} {} {:?}", k.value, made.stiffness[i][i], k.std_error);
    }
}

#[test]
fn a_reflex_in_one_direction_is_told_from_a_linear_one() {
    for (hidden, one) in [("reflex-one", true), ("reflex-delay", false)] {
        let d = answer(&made(Plant::Motion, &[(hidden, 0.5)], 16));
        let cause = d.causes.first().filter(|c| c.effect == "reflex-delay").expect("a reflex");
        let flag = cause.parameters.iter().find(|p| p.name == "one_directional").map(|p| p.value.clone());
        assert_eq!(flag, Some(Value::Flag(one)), "{hidden}");
    }
}

/// A short recording of one axis, with the perturbation's band at a multiple of its own.
fn short(hidden: (&'static str, f64), reach: f64, seed: u64) -> Made {
    let hidden = vec![Hidden { name: hidden.0, severity: hidden.1 }];
    make(&Case { plant: Plant::Force, hidden, other: false, background: false, trials: 1, duration_s: 30.0, seed, command: (1.0, reach) })
}

#[test]
fn what_cannot_be_told_apart_comes_with_the_experiment_that_decides_and_it_does() {
    for (hidden, seed) in [(("measurement-delay", 0.3), 1), (("measurement-delay", 0.3), 2), (("channel-filter", 0.1), 1), (("channel-filter", 0.1), 2)] {
        let other = if hidden.0 == "channel-filter" { "measurement-delay" } else { "channel-filter" };
        let planned = Options { plan: true, ..Options::default() };
        let first = short(hidden, 1.0, seed);
        let d = diagnose(&first.recordings, &first.ports, &planned, None, &mut |_| {}).expect("a diagnosis");
        let pair = d.confusable.first().expect("a delay of 3.6 ms or a filter at 120 Hz are alike up to 12 Hz");
        assert!(pair.effects.iter().any(|e| e == "measurement-delay") && pair.effects.iter().any(|e| e == "channel-filter"), "{pair:?}");
        let best = pair.predicted.first().expect("experiments were simulated");
        println!("{hidden:?}: {:?}", pair.predicted);
        assert!(best.experiment.contains("with its power from 0 to 4"), "{pair:?}");
        // A filter so far beyond the band is fitted as one of second order, which stays a delay up to 45 Hz: no experiment is promised then.
        assert!(hidden.0 == "channel-filter" || (best.decides && best.separation > 6.0 && pair.next_experiment.starts_with(&best.experiment)), "{pair:?}");
        // The same perturbation again decides nothing, and the plan says so.
        assert!(pair.predicted.iter().filter(|p| p.experiment.starts_with("the same")).all(|p| !p.decides), "{pair:?}");
        // The experiment itself, by the generator: power up to four times the frequency.
        let second = short(hidden, 4.0, seed);
        let wide = Options { band_hz: Some((0.0, 44.0)), ..Options::default() };
        let second = diagnose(&second.recordings, &second.ports, &wide, None, &mut |_| {}).expect("a diagnosis");
        assert_eq!(second.causes.first().map(|c| c.effect.as_str()), Some(hidden.0), "{:?}", second.causes);
        assert!(second.confusable.iter().all(|k| !k.effects.iter().any(|e| e == other)), "{:?}", second.confusable);
    }
}

#[test]
fn a_compliance_in_series_is_told_from_a_delay_and_a_friction_from_a_hysteresis_without_a_further_experiment() {
    for (hidden, name, other) in [
        (("series-compliance", 0.1), "extra-resonance", "measurement-delay"),
        (("series-compliance", 0.2), "extra-resonance", "measurement-delay"),
        (("coulomb-friction", 0.08), "coulomb-friction", "hysteresis"),
        (("hysteresis", 0.08), "hysteresis", "coulomb-friction"),
    ] {
        for seed in [1, 2] {
            let made = short(hidden, 1.0, seed);
            let d = answer(&made);
            assert_eq!(d.causes.first().map(|c| c.effect.as_str()), Some(name), "{hidden:?} {:?}", d.causes);
            let beside = |effect: &str| d.confusable.iter().any(|k| k.effects.iter().any(|e| e == effect));
            assert!(!beside(other) && d.causes.iter().all(|c| c.effect != other), "{hidden:?}: {:?}", names(&d));
        }
    }
}

#[test]
fn a_delay_a_filter_or_a_mode_that_is_taken_away_leaves_no_other_name_for_sure() {
    for (plant, hidden, seed) in [
        (Plant::Force, "measurement-delay", 20),
        (Plant::Motion, "measurement-delay", 21),
        (Plant::Planar, "measurement-delay", 23),
        (Plant::Force, "channel-filter", 20),
        (Plant::Planar, "channel-filter", 23),
        (Plant::Force, "extra-resonance", 20),
        (Plant::Motion, "extra-resonance", 21),
    ] {
        let made = made(plant, &[(hidden, 0.5)], seed);
        let options = Options { without: vec![hidden.to_owned()], ..Options::default() };
        let d = diagnose(&made.recordings, &made.ports, &options, None, &mut |_| {}).expect("a diagnosis");
        assert_ne!(d.verdict, Verdict::Explained, "without {hidden}: {:?}", names(&d));
        let sure =
            |effect: &str, probability: f64| effect != "limb-noise" && probability > 0.9 && d.confusable.iter().all(|k| !k.effects.iter().any(|e| e == effect));
        assert!(d.causes.iter().all(|c| !sure(&c.effect, c.probability)), "without {hidden}: {:?}", d.causes);
    }
}

#[test]
fn a_spring_a_reflex_or_friction_that_is_taken_away_leaves_no_other_name_for_sure() {
    for (plant, hidden, seed) in [
        (Plant::Force, "cubic-stiffness", 20),
        (Plant::Motion, "cubic-stiffness", 21),
        (Plant::Force, "reflex-delay", 20),
        (Plant::Force, "coulomb-friction", 20),
        (Plant::Force, "hysteresis", 21),
    ] {
        let made = made(plant, &[(hidden, 0.5)], seed);
        assert_eq!(answer(&made).causes.first().map(|c| c.effect.clone()).as_deref(), Some(hidden));
        let options = Options { without: vec![hidden.to_owned()], ..Options::default() };
        let d = diagnose(&made.recordings, &made.ports, &options, None, &mut |_| {}).expect("a diagnosis");
        assert!(matches!(d.verdict, Verdict::Unexplained | Verdict::PartlyExplained), "without {hidden}: {:?} {:?}", d.verdict, d.causes);
        assert!(
            d.causes.iter().all(|c| c.probability <= 0.9),
            "without {hidden}: {:?}",
            d.causes.iter().map(|c| (&c.effect, c.probability)).collect::<Vec<_>>()
        );
    }
}

#[test]
fn an_effect_that_is_switched_off_is_not_named() {
    for (k, hidden) in ["coulomb-friction", "hysteresis"].into_iter().enumerate() {
        let off = answer(&made(Plant::Force, &[(hidden, 0.0)], 20 + k as u64));
        assert!(off.causes.is_empty() && off.verdict == Verdict::Adequate, "{hidden} at nothing: {:?}", off.causes);
    }
}
