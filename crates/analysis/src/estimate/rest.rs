//! Rest at the ends of trials, which adds noise and nothing else.

use crate::check::evenness;
use crate::error::AnalysisError;
use crate::result::Warning;
use crate::trials::{Trial, Trials};
use ndof_sysid::Steadiness;
use std::borrow::Cow;

/// The trials without the rest that all of them begin or end with; the trials themselves where there is none.
///
/// What all have in common, so that trials of one length remain so. A rest in between stays: two stretches say less of what lies between
/// frequencies than one that holds both.
pub(super) fn without_rest(trials: &Trials) -> Result<Cow<'_, Trials>, AnalysisError> {
    let [mut head, mut tail] = [usize::MAX; 2];
    for trial in &*trials.trials {
        let [first, last] = ends(trial.recording.len(), &evenness(&trial.recording, &trials.roles));
        (head, tail) = (head.min(first), tail.min(last));
    }
    if head == 0 && tail == 0 || trials.trials.is_empty() {
        return Ok(Cow::Borrowed(trials));
    }
    let cut = |trial: &Trial| trial.slice(head..trial.recording.len() - tail);
    let mut left = Trials { trials: trials.trials.iter().map(cut).collect::<Result<_, _>>()?, ..trials.clone() };
    let rate_hz = trials.sample_rate_hz();
    left.warnings.push(Warning::new(
        "rest-left-out",
        format!("nothing drives the first {:.3} s and the last {:.3} s: they are left out", head as f64 / rate_hz, tail as f64 / rate_hz),
        "nothing; `start`, `stop` or `method` keep what you want",
    ));
    Ok(Cow::Owned(left))
}

/// Samples at the beginning and at the end of so many that no driver drives; one that cannot be judged never rests.
pub(super) fn ends<'a>(samples: usize, evenness: impl IntoIterator<Item = &'a Steadiness>) -> [usize; 2] {
    let ends = evenness.into_iter().map(|seen| {
        let first = seen.rest.first().filter(|rest| rest.start == 0 && rest.end < samples).map_or(0, |rest| rest.end);
        let last = seen.rest.last().filter(|rest| rest.end == samples && rest.start > 0).map_or(0, |rest| samples - rest.start);
        [first, last]
    });
    ends.reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1])]).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Estimate, MethodName};
    use rand::{RngExt, SeedableRng};

    /// Two axes that begin and end with rests of their own, and what follows them at once.
    fn trial(seed: u64, quiet: [std::ops::Range<usize>; 2]) -> Trial {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> Vec<f64> { (0..8000).map(|_| rng.sample(rand_distr::StandardNormal)).collect() };
        let [x, y] = quiet.map(|driven| normal().iter().enumerate().map(|(k, v)| if driven.contains(&k) { *v } else { 0.01 * v }).collect::<Vec<f64>>());
        let follow = |force: &[f64], noise: Vec<f64>| force.iter().zip(noise).map(|(f, e)| 0.001 * (f + 0.1 * e)).collect::<Vec<f64>>();
        let (px, py) = (follow(&x, normal()), follow(&y, normal()));
        Trial::new(100.0).effort("x", x).effort("y", y).displacement("x", px).and_then(|trial| trial.displacement("y", py)).expect("a trial")
    }

    #[test]
    fn what_no_axis_drives_is_left_out_and_said() {
        let one = Trials::of(&[trial(1, [2000..8000, 1000..7000])]).expect("roles");
        let left = without_rest(&one).expect("a recording");
        assert_eq!((left.trials[0].recording.len(), left.trials[0].recording.start_s()), (7000, 10.0));
        // Of two trials, what both have: of the second the first and last 500 samples, of the first the first 1000.
        let two = Trials::of(&[trial(1, [2000..8000, 1000..7000]), trial(2, [500..7500, 500..7500])]).expect("roles");
        let left: Vec<usize> = without_rest(&two).expect("recordings").trials.iter().map(|trial| trial.recording.len()).collect();
        assert_eq!(left, [7500, 7500]);
        let none = Trials::of(&[trial(1, [2000..8000, 0..7000])]).expect("roles");
        assert!(matches!(without_rest(&none).expect("the same"), Cow::Borrowed(_)));
        let codes = |settings: &Estimate| {
            let estimated = crate::estimate::estimate(&one, settings).expect("an estimate");
            estimated.result.head.warnings.iter().map(|warning| warning.code.clone()).collect::<Vec<String>>()
        };
        assert!(codes(&Estimate::default()).contains(&"rest-left-out".to_owned()));
        let asked = codes(&Estimate { method: MethodName::Welch, ..Estimate::default() });
        assert!(!asked.contains(&"rest-left-out".to_owned()) && asked.contains(&"rest".to_owned()), "{asked:?}");
    }
}
