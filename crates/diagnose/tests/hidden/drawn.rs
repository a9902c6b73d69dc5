//! Cases drawn at random, as many as a test has time for.

use ndof_challenge::strength::strength;
use ndof_challenge::{Case, Hidden, Made, Plant, Setting, make, make_with};
use ndof_diagnose::{Diagnosis, Options, diagnose};
use ndof_signal::Quantity;

/// Names above 0.9 with no other beside them, the limb's own force left out.
fn sure(d: &Diagnosis) -> Vec<&str> {
    let alone = |effect: &String| d.confusable.iter().all(|k| !k.effects.contains(effect));
    d.causes.iter().filter(|c| c.effect != "limb-noise" && c.probability > 0.9 && alone(&c.effect)).map(|c| c.effect.as_str()).collect()
}

/// Plant, what is hidden and how strong, whether in a form that the registry does not have, trials and seed: once drawn, four of each plant.
type Drawn = (Plant, Option<(&'static str, f64)>, bool, usize, u64);
const DRAWN: [Drawn; 16] = [
    (Plant::Force, None, false, 3, 13136235368667205324),
    (Plant::Force, Some(("dead-zone", 0.05070774117346547)), true, 3, 9570893167455510777),
    (Plant::Force, Some(("x-quadratic-damping", 0.2616554632737801)), false, 1, 16535826761834385621),
    (Plant::Force, Some(("dead-zone", 0.16812689993407148)), false, 3, 5948595845634617132),
    (Plant::Motion, None, false, 1, 12850364187787699933),
    (Plant::Motion, Some(("asymmetric-stiffness", 0.2973480223065097)), true, 1, 6940108586299388061),
    (Plant::Motion, Some(("x-quadratic-damping", 0.7384386209499214)), false, 3, 851230285051144754),
    (Plant::Motion, Some(("reflex-delay", 0.7686826917511219)), false, 3, 7131805792925467349),
    (Plant::Mass, None, false, 3, 15334895464456256465),
    (Plant::Mass, Some(("hysteresis", 0.34519340002098725)), true, 3, 5182670396708338501),
    (Plant::Mass, Some(("x-van-der-pol", 0.41212644970724527)), false, 3, 16347829456659363505),
    (Plant::Mass, Some(("coulomb-friction", 0.14789259014209827)), false, 3, 6024447732447504945),
    (Plant::Planar, None, false, 3, 8837778460780161771),
    (Plant::Planar, Some(("asymmetric-stiffness", 0.5474538039303849)), true, 1, 9692283667679912522),
    (Plant::Planar, Some(("channel-filter", 0.07066708633666507)), false, 3, 14025410748268862554),
    (Plant::Planar, Some(("extra-resonance", 0.16501427815566838)), false, 3, 448095192688274881),
];

#[test]
fn drawn_cases_are_answered_and_no_wrong_name_is_said_for_sure() {
    let (mut clear, mut right) = (0, 0);
    for (plant, truth, other, trials, seed) in DRAWN {
        let hidden = truth.iter().map(|&(name, severity)| Hidden { name, severity }).collect();
        let case = Case { plant, hidden, other, background: false, trials, duration_s: 50.0, seed, command: (1.0, 1.0) };
        let made = make(&case);
        let d = answer(&made);
        let said = sure(&d);
        assert!(said.iter().all(|name| truth.is_some_and(|truth| truth.0 == *name)), "{} {seed}: {truth:?} -> {said:?}", plant.word());
        let Some((truth, _)) = truth.filter(|(name, _)| !name.starts_with("x-")) else { continue };
        if strength(&case, &made).share >= 0.5 && strength(&case, &made).size >= 0.01 {
            clear += 1;
            let first = d.causes.iter().find(|c| c.effect != "limb-noise");
            let beside = d.confusable.iter().any(|k| k.effects.iter().any(|e| e == truth));
            right += usize::from(first.is_some_and(|c| c.effect == truth || beside));
        }
    }
    // At the 97 % that are asked of clear ones two of eight are missed in two of a hundred such draws.
    assert!(clear >= 4 && right + 1 >= clear, "{right} of {clear} clear ones");
}

/// One trial of 50 s, recorded in some way.
fn one_trial(plant: Plant, hidden: &[(&'static str, f64)], setting: &Setting, seed: u64) -> Made {
    let hidden = hidden.iter().map(|&(name, severity)| Hidden { name, severity }).collect();
    make_with(&Case { plant, hidden, other: false, background: false, trials: 1, duration_s: 50.0, seed, command: (1.0, 1.0) }, setting)
}

fn answer(made: &Made) -> Diagnosis {
    diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis")
}

/// A force that follows time answers no motion. The generic model had one that did, and gained a thousand of log-likelihood from the determinant.
#[test]
fn a_posture_that_creeps_in_a_single_trial_is_named() {
    for seed in [3, 4, 5] {
        let d = answer(&one_trial(Plant::Planar, &[("posture-drift", 0.6)], &Setting::default(), seed));
        assert_eq!(d.causes.first().map(|c| c.effect.as_str()), Some("posture-drift"), "{seed}: {:?} {:?}", d.verdict, d.minor);
        assert!(d.causes[0].probability > 0.5, "{:?}", d.causes[0]);
    }
}

/// An integral by trapezoids is short where the band ends, and constants of integration are lines of time: neither is an effect.
#[test]
fn nothing_is_named_where_a_velocity_or_an_acceleration_was_measured_and_nothing_hidden() {
    for (measured, rate_hz) in [(Quantity::Velocity, 200.0), (Quantity::Velocity, 500.0), (Quantity::Acceleration, 500.0)] {
        for (plant, seed) in [(Plant::Force, 1), (Plant::Force, 2), (Plant::Planar, 3), (Plant::Planar, 4)] {
            let d = answer(&one_trial(plant, &[], &Setting { rate_hz, measured, own: 0.3, ..Setting::default() }, seed));
            let said: Vec<&str> = d.causes.iter().map(|c| c.effect.as_str()).filter(|name| *name != "limb-noise").collect();
            assert!(said.is_empty(), "{measured:?} at {rate_hz} Hz, {}, {seed}: {said:?}", plant.word());
        }
    }
}

/// Two forms that make up for a third are small beside each other, and one of them alone is not.
#[test]
fn a_spring_of_another_shape_is_not_lost_between_two_forms() {
    for seed in [6, 7, 8] {
        let d = answer(&one_trial(Plant::Force, &[("cubic-stiffness/power-2.3", 0.15)], &Setting { own: 0.2, ..Setting::default() }, seed));
        let shapes = ["cubic-stiffness", "asymmetric-stiffness", "dead-zone", "end-stop"];
        assert!(d.causes.iter().any(|c| shapes.contains(&c.effect.as_str())), "{seed}: {:?} {:?}", d.verdict, d.minor);
    }
}
