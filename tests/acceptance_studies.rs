//! What the validation with springs must reach (Palazzolo et al. 2007, figures 6 to 8), on three of its nine configurations: oblique,
//! isotropic, unequal. The numbers of all nine are in book/src/validation/spring_array.md.

use ndof::studies::STUDIES;
use ndof::study::cases::result::{Case, Setting};
use ndof::study::file::StudyFile;
use ndof::study::{run_cases, study_result};

/// The paper's two settings.
const SETTINGS: [(&str, usize); 2] = [("fine", 5), ("smooth", 45)];
const LEAST_R2: f64 = 0.999;
/// Of stiffness along either axis of the ellipse.
const STIFFNESS_WITHIN: f64 = 0.01;
const DIRECTION_WITHIN_DEG: f64 = 1.0;
/// Independent implementation, derived estimate without the window's smoothing: 1.5 % of B with five segments, 9.8 % with 45. These are
/// single seeds that scatter by a factor of two; the fit sees the model through the window and has to keep the better of both.
const DAMPING_WITHIN: f64 = 2.0 * 0.015;

fn check(case: &Case, setting: &Setting) {
    let place = format!("{} {}", case.name, setting.name);
    let round = ["sa4", "sa5"].contains(&case.name.as_str());
    let ellipse = setting.ellipse.as_ref().expect("two axes");
    for half in [&ellipse.major, &ellipse.minor] {
        let (truth, found) = (half.truth.expect("simulated"), half.value.expect("found"));
        assert!((found / truth - 1.0).abs() < STIFFNESS_WITHIN, "{place}: {found} for {truth} N/m");
    }
    match &ellipse.orientation_deg {
        Some(turn) => assert!((turn.value.expect("found") - turn.truth.expect("simulated")).abs() < DIRECTION_WITHIN_DEG, "{place}: {turn:?}"),
        // A circle has no direction: its axis ratio must be compatible with 1.
        None => assert!(round && ellipse.axis_ratio.ci95.expect("an interval")[0] == 1.0, "{place}: {:?}", ellipse.axis_ratio),
    }
    assert!(setting.relative_error.expect("simulated").B.expect("found") < DAMPING_WITHIN, "{place}: {:?}", setting.relative_error);
    for band in setting.agreement.iter().filter(|a| a.estimate == "derived") {
        let r2 = band.r2.expect("a number");
        assert!(r2 >= LEAST_R2, "{place} {:?} Hz: R² {r2}", band.band_hz);
        for i in 0..2 {
            for j in 0..2 {
                // VAF of an element that is zero does not exist, and nothing else than zero is without one.
                assert_eq!(band.vaf[i][j].is_none(), round && i != j, "{place}: {:?}", band.vaf);
                let (coherence, error) = (band.partial_coherence[i][j].expect("a number"), band.relative_error[i][j].expect("a number"));
                if round && i != j {
                    // Ill-conditioned: no coherence beyond what chance gives, and an error as large as the element.
                    assert!(coherence < 0.1 && error > 0.5, "{place} ({i}, {j}): {coherence} {error}");
                } else {
                    assert!(coherence > 0.6 && error < 0.1, "{place} ({i}, {j}): {coherence} {error}");
                }
            }
        }
    }
}

#[test]
fn the_spring_array_is_found_as_the_paper_found_it() {
    let (name, text) = STUDIES.iter().find(|(name, _)| *name == "spring-array").expect("built in");
    let mut study = StudyFile::parse(text, name).expect("understood");
    let names: Vec<&str> = study.cases.iter().map(|case| case.name.as_str()).collect();
    assert_eq!(names, ["sa1", "sa2", "sa3", "sa4", "sa5", "sa6", "sa7", "sa8", "sa9"]);
    assert_eq!(study.report.bands_hz, [[0.25, 5.0], [0.25, 10.0]]);
    study.cases.retain(|case| ["sa1", "sa4", "sa8"].contains(&case.name.as_str()));
    study.also.retain(|section| section.name.as_deref() == Some("smooth"));
    let outcomes = run_cases(&study, None, None, &|_, _, _| ()).expect("runs");
    let result = study_result(&study, &outcomes).expect("a result");
    assert_eq!(result.cases.len(), 3);
    for case in &result.cases {
        assert_eq!(case.trials, 6);
        let settings: Vec<(&str, usize)> = case.settings.iter().map(|s| (s.name.as_str(), s.segments_per_trial.unwrap_or(0))).collect();
        assert_eq!(settings, SETTINGS);
        case.settings.iter().for_each(|setting| check(case, setting));
    }
}

#[test]
fn masses_of_a_fifth_of_a_kilogram_are_told_apart_from_recordings() {
    let (name, text) = STUDIES.iter().find(|(name, _)| *name == "masses").expect("built in");
    let study = StudyFile::parse(text, name).expect("understood");
    let outcomes = run_cases(&study, None, None, &|_, _, _| ()).expect("runs");
    let result = study_result(&study, &outcomes).expect("a result");
    assert_eq!(result.steps.len(), 12);
    let mut inside = 0;
    for step in &result.steps {
        let (truth, [low, high]) = (step.change.truth.expect("simulated"), step.change.ci95.expect("an interval"));
        assert!((truth - 0.2).abs() < 1e-12);
        // Told apart: no step could be none, nor two of them.
        assert!(low > 0.1 && high < 0.3, "{step:?}");
        inside += usize::from((low..=high).contains(&truth));
    }
    // Twelve intervals of 95 %: two misses or fewer in 98 % of all seeds, four in 99.98 %.
    assert!(inside >= 8, "{inside} of 12");
}

#[test]
fn tone_drifts_without_the_hold_stays_with_it_and_gain_couples_the_forces() {
    let (name, text) = STUDIES.iter().find(|(name, _)| *name == "drift").expect("built in");
    let study = StudyFile::parse(text, name).expect("understood");
    let outcomes = run_cases(&study, None, None, &|_, _, _| ()).expect("runs");
    let result = study_result(&study, &outcomes).expect("a result");
    let case = |name: &str| result.cases.iter().find(|case| case.name == name).expect("a case");
    let cm = |name: &str| 100.0 * case(name).distance.expect("known");
    // The paper's least, mean and largest drift; what dry friction and six trials of 50 s leave open is 0.5 cm.
    for (name, drift) in [("free, 2.6 N", 4.4), ("free, 4.7 N", 7.8), ("free, 7.4 N", 12.3)] {
        assert!((cm(name) - drift).abs() < 0.5, "{name}: {} cm", cm(name));
    }
    for name in ["held, 2.6 N", "kp 100", "held, 7.4 N"] {
        assert!(cm(name) < 0.3, "{name}: {} cm", cm(name));
    }
    let low = |name: &str| case(name).settings[0].low_band;
    let gains = ["kp 50", "kp 100", "kp 200", "kp 400"].map(low);
    for pair in gains.windows(2) {
        assert!(pair[1].input_coherence_mean > pair[0].input_coherence_mean, "{gains:?}");
        assert!(pair[1].direct_error > pair[0].direct_error, "{gains:?}");
    }
    // Pre-compensation cures the coherence: what is left, of dry friction and of the arm's own force, is an order less.
    for (name, held) in [("kp 100, compensated", &gains[1]), ("kp 400, compensated", &gains[3])] {
        assert!(low(name).input_coherence_mean.expect("known") < 0.1 * held.input_coherence_mean.expect("known"), "{name}: {:?}", low(name));
    }
    // The derived estimate cures what feedback does to the direct one.
    assert!(gains.iter().all(|low| low.derived_error.expect("known") < 0.7 * low.direct_error.expect("known")), "{gains:?}");
}
