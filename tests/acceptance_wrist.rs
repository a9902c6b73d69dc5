//! What the wrist study must show: three torques in, three angles out, every coherence, and M, B, K at the anatomical axes, the hand's
//! weight taken off, in intervals that hold the truth as often as they say.

use ndof::studies::STUDIES;
use ndof::study::file::StudyFile;
use ndof::study::run_study;

const SEEDS: u64 = 5;

#[test]
fn the_intervals_of_the_wrist_hold_over_seeds_and_its_weight_is_no_stiffness_of_the_joint() {
    let (name, text) = STUDIES.iter().find(|(name, _)| *name == "wrist").expect("built in");
    let study = StudyFile::parse(text, name).expect("understood");
    let (mut inside, mut all) = (0, 0);
    for seed in 1..=SEEDS {
        let outcome = run_study(&study, None, Some(seed), &|_, _, _| ()).expect("runs");
        let estimate = &outcome.estimated.result;
        assert_eq!((estimate.inputs.len(), estimate.outputs.len(), estimate.references.len()), (3, 3, 3));
        let coherence = &estimate.derived.as_ref().expect("references").coherence_iv;
        assert_eq!((&coherence.partial.shape()[..2], coherence.multiple.nrows()), (&[3, 3][..], 3));
        assert_eq!(&estimate.input_coherence.shape()[..2], &[3, 3]);
        // Noise-free hand, precise sensors: all motion is explained, on average over the band.
        for multiple in coherence.multiple.outer_iter() {
            let explained: Vec<f64> = multiple.iter().copied().filter(|c| c.is_finite()).collect();
            assert!(explained.iter().sum::<f64>() / explained.len() as f64 > 0.9, "{explained:?}");
        }
        let joint = outcome.fitted.result.joint.as_ref().expect("kinematics");
        assert_eq!(joint.axes, ["pronation", "flexion", "abduction"]);
        let truth = &outcome.simulated.as_ref().expect("simulated").truth;
        for parameter in &joint.parameters {
            let ([low, high], simulated) = (parameter.ci95.expect("an interval"), truth.parameter(&parameter.name).expect("simulated"));
            inside += usize::from((low..=high).contains(&simulated));
            all += 1;
        }
        // The weight of hand and handle, 0.26 N m/rad between pronation and flexion, is in the estimate and not in the joint.
        let found = |name: &str| joint.parameters.iter().chain(&outcome.fitted.result.parameters).find(|p| p.name == name).and_then(|p| p.value).expect(name);
        let weight = found("K_ps_fe") - found("K_pronation_flexion");
        assert!((weight - 0.45 * 9.81 * 0.06).abs() < 1e-9, "{weight}");
        assert!((found("K_pronation_flexion") - 0.018).abs() < 0.01);
    }
    let share = inside as f64 / all as f64;
    println!("{inside} of {all} intervals of the joint's M, B and K hold the truth");
    assert_eq!(all, 18 * SEEDS as usize);
    // Four binomial standard deviations.
    assert!((share - 0.95).abs() < 4.0 * (0.95 * 0.05 / all as f64).sqrt(), "{share}");
}
