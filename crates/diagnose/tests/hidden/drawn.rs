//! Cases drawn from a seed, as many as a test has time for.

use ndof_challenge::draw::{draw, kind_of, registry_name};
use ndof_challenge::strength::strength;
use ndof_challenge::{Plant, make};
use ndof_diagnose::{Diagnosis, Options, diagnose};

/// Names above 0.9 with no other beside them, the limb's own force left out.
fn sure(d: &Diagnosis) -> Vec<&str> {
    let alone = |effect: &String| d.confusable.iter().all(|k| !k.effects.contains(effect));
    d.causes.iter().filter(|c| c.effect != "limb-noise" && c.probability > 0.9 && alone(&c.effect)).map(|c| c.effect.as_str()).collect()
}

#[test]
fn drawn_cases_are_answered_and_no_wrong_name_is_said_for_sure() {
    let (mut clear, mut right) = (0, 0);
    for (plant, numbers) in
        [(Plant::Force, [0, 17, 31, 36]), (Plant::Motion, [1, 18, 32, 37]), (Plant::Mass, [2, 19, 28, 38]), (Plant::Planar, [3, 20, 34, 40])]
    {
        assert!(Plant::ALL.contains(&plant));
        for number in numbers {
            let kind = kind_of(number);
            let case = draw(23, number, kind, Some(plant));
            let made = make(&case);
            let d = diagnose(&made.recordings, &made.ports, &Options::default(), None, &mut |_| {}).expect("a diagnosis");
            let truth: Vec<&str> = case.hidden.iter().map(|h| registry_name(h.name)).collect();
            let said = sure(&d);
            assert!(said.iter().all(|name| truth.contains(name)), "{number} {kind} {}: {truth:?} -> {said:?}", plant.word());
            if case.hidden.len() == 1 && kind != "outside" && strength(&case, &made).share >= 0.5 && strength(&case, &made).size >= 0.01 {
                clear += 1;
                let first = d.causes.iter().find(|c| c.effect != "limb-noise");
                let beside = |name: &str| d.confusable.iter().any(|k| k.effects.iter().any(|e| e == name));
                right += usize::from(first.is_some_and(|c| c.effect == truth[0] || beside(truth[0])));
            }
        }
    }
    // At the 97 % that are asked of clear ones two of eight are missed in two of a hundred such draws.
    assert!(clear >= 4 && right + 1 >= clear, "{right} of {clear} clear ones");
}
