//! Which part of the recordings is fitted, and which is held out.

use crate::DiagnoseError;
use crate::options::HeldOut;
use crate::result::Split;
use crate::samples::Samples;
use crate::stretch::Stretch;

/// Samples of which a stretch has to have as many to be fitted or judged.
pub(crate) const FEWEST: usize = 200;

impl HeldOut {
    /// Share of one recording's time that is held out where nothing is asked for: so that what is fitted, which tells the parameters, is some twice as long.
    pub const SHARE: f64 = 0.3;

    /// What is fitted and what is held out of so many trials of so many samples.
    ///
    /// # Errors
    /// [`DiagnoseError::HeldOut`] if one of the two is too short, [`DiagnoseError::HeldOutBeyond`] if the recording does not have it.
    pub fn divide(&self, trials: usize, samples: usize, sample_rate_hz: f64) -> Result<[Stretch; 2], DiagnoseError> {
        let refuse = |estimation, samples, held_out| DiagnoseError::HeldOut { estimation, samples, held_out };
        let by_trial = |held: Vec<usize>| {
            let rest: Vec<usize> = (0..trials).filter(|t| !held.contains(t)).collect();
            if rest.is_empty() || held.is_empty() || held.iter().any(|t| *t >= trials) {
                return Err(refuse(rest.len(), samples, held.len()));
            }
            Ok([Stretch::Trials(rest), Stretch::Trials(held)])
        };
        let by_time = |from: usize, to: usize| {
            // The longer stretch beside the held-out one is fitted.
            let (a, b) = if from >= samples - to.min(samples) { (0, from) } else { (to, samples) };
            if b < a + FEWEST || to < from + FEWEST || to > samples {
                return Err(refuse(trials, b.saturating_sub(a), trials));
            }
            Ok([Stretch::Samples(a..b), Stretch::Samples(from..to)])
        };
        match self {
            HeldOut::Auto if trials > 1 => by_trial((trials - trials.div_ceil(3)..trials).collect()),
            HeldOut::Auto => by_time(((1.0 - HeldOut::SHARE) * samples as f64).round() as usize, samples),
            HeldOut::Trials(held) => by_trial(held.clone()),
            HeldOut::Time(from_s, to_s) if from_s >= to_s || *from_s < 0.0 || from_s * sample_rate_hz >= samples as f64 => {
                Err(DiagnoseError::HeldOutBeyond { from_s: *from_s, to_s: *to_s, duration_s: samples as f64 / sample_rate_hz })
            }
            HeldOut::Time(from, to) => by_time((from * sample_rate_hz).round() as usize, ((to * sample_rate_hz).round() as usize).min(samples)),
        }
    }
}

/// Estimation and held-out samples, and the words for them.
pub(crate) fn divide(samples: &Samples, held_out: &HeldOut) -> Result<(Samples, Samples, Split), DiagnoseError> {
    let [fitted, held] = held_out.divide(samples.effort.len(), samples.len(), samples.rate_hz)?;
    let split = Split { estimation: fitted.words(samples.rate_hz), held_out: held.words(samples.rate_hz), windows_s: None };
    Ok((fitted.of(samples), held.of(samples), split))
}

/// A stretch of what is held out.
pub(crate) struct Portion {
    pub samples: Samples,
    /// Where it begins and ends, as shares of all that is held out, trial after trial.
    pub place: [f64; 2],
    pub words: String,
}

/// The trials of what is held out, if there are several, and the halves and quarters of each that are long enough to tell something by themselves.
pub(crate) fn portions(held: &Samples) -> Vec<Portion> {
    let (trials, samples) = (held.effort.len(), held.len());
    let portion = |trial: usize, of: usize, k: usize| {
        let [from, to] = [k, k + 1].map(|edge| edge * samples / of);
        let [begin, end] = [from, to].map(|sample| held.start_s[trial] + sample as f64 / held.rate_hz);
        let which = if trials > 1 { format!("trial {} of the held-out ones", trial + 1) } else { "the held-out part".to_owned() };
        let words = if of > 1 { format!("{which} from {begin:.2} to {end:.2} s") } else { which };
        let place = [k, k + 1].map(|edge| (trial as f64 + edge as f64 / of as f64) / trials as f64);
        Portion { samples: held.pick(&[trial]).cut(from, to), place, words }
    };
    let scales = [1, 2, 4].into_iter().filter(|of| trials * of > 1 && samples / of >= FEWEST);
    scales.flat_map(|of| (0..trials).flat_map(move |trial| (0..of).map(move |k| (trial, of, k)))).map(|(trial, of, k)| portion(trial, of, k)).collect()
}

impl Stretch {
    fn of(&self, samples: &Samples) -> Samples {
        match self {
            Stretch::Trials(trials) => samples.pick(trials),
            Stretch::Samples(range) => samples.cut(range.start, range.end),
        }
    }

    /// "trials 1, 2" or "0.00 to 4.20 s", at samples of this rate.
    pub fn words(&self, rate_hz: f64) -> String {
        match self {
            Stretch::Trials(trials) => format!("trials {}", trials.iter().map(|t| (t + 1).to_string()).collect::<Vec<_>>().join(", ")),
            Stretch::Samples(range) => format!("{:.2} to {:.2} s", range.start as f64 / rate_hz, range.end as f64 / rate_hz),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_that_the_recording_does_not_have_is_no_part_of_it() {
        for beyond in [HeldOut::Time(100.0, 200.0), HeldOut::Time(20.0, 10.0), HeldOut::Time(-1.0, 10.0)] {
            assert!(matches!(beyond.divide(1, 4000, 100.0), Err(DiagnoseError::HeldOutBeyond { duration_s: 40.0, .. })), "{beyond:?}");
        }
        let [fitted, held] = HeldOut::Time(30.0, 50.0).divide(1, 4000, 100.0).expect("what there is of it");
        assert_eq!([fitted.words(100.0), held.words(100.0)], ["0.00 to 30.00 s", "30.00 to 40.00 s"]);
    }
}
