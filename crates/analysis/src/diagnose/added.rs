//! What a simulator would have to be given beside its own forces to run as the extended model does.

use super::settings::Diagnose;
use crate::error::AnalysisError;
use crate::trials::Trials;
use ndof_diagnose::Stretch;

/// Efforts of the named causes along every whole trial: a simulator that feels them beside its commands runs as the extended model does.
///
/// They follow from the extended model's own run, from a trial's first motion and its effort alone; for a robot's joints, whose motion is commanded,
/// from the measured motion. Sensors, filters and delays add no effort.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedEffort {
    /// The effort's channels, axis by axis.
    pub channels: Vec<String>,
    /// N or N m, `[trial][axis][time]`, as long as the trials.
    pub efforts: Vec<Vec<Vec<f64>>>,
    /// What no fit saw.
    pub held_out: Stretch,
}

impl AddedEffort {
    /// At the rate of the trials, in straight lines between samples.
    pub(super) fn new(
        trials: &Trials,
        settings: &Diagnose,
        channels: Vec<String>,
        at_hz: f64,
        efforts: Vec<Vec<Vec<f64>>>,
    ) -> Result<Option<Self>, AnalysisError> {
        if efforts.len() != trials.trials.len() {
            return Ok(None);
        }
        let rate_hz = trials.sample_rate_hz();
        let lengths = || trials.trials.iter().map(|trial| trial.recording.len());
        let [_, held_out] = settings.apart(trials).divide(efforts.len(), lengths().min().unwrap_or(0), rate_hz)?;
        let finer = |series: Vec<f64>, length: usize| -> Vec<f64> { (0..length).map(|k| between(&series, k as f64 * at_hz / rate_hz)).collect() };
        let efforts = efforts.into_iter().zip(lengths()).map(|(trial, length)| trial.into_iter().map(|series| finer(series, length)).collect()).collect();
        Ok(Some(AddedEffort { channels, efforts, held_out }))
    }
}

/// A series at a place between its samples; beyond the last it stays.
fn between(series: &[f64], place: f64) -> f64 {
    let at = |k: usize| series[k.min(series.len() - 1)];
    let k = place.floor() as usize;
    at(k) + place.fract() * (at(k + 1) - at(k))
}

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn straight_lines_go_through_the_samples_and_the_last_one_stays() {
        let series = [0.0, 2.0, 1.0];
        assert_eq!([0.0, 0.25, 1.0, 1.5, 2.0, 9.0].map(|place| between(&series, place)), [0.0, 0.5, 2.0, 1.5, 1.0, 1.0]);
    }
}
