//! The linear model that a diagnosis begins from: what `fit` finds in the part that is not held out.

use super::settings::Diagnose;
use crate::error::AnalysisError;
use crate::estimate::{Estimate, estimate};
use crate::fit::{Fit, fit, turned_round};
use crate::trials::{Trial, Trials};
use ndof_diagnose::{LinearFit, Options, Schedule, Stretch};
use ndof_models::{Hold, InertiaDampingStiffness};
use ndof_signal::Channel;

/// What `fit` finds.
pub(super) struct Found {
    pub linear: LinearFit,
    pub band_hz: [f64; 2],
    /// Efforts that are counted against the motions of their axes, and not in what was found.
    pub opposed: Vec<String>,
    /// Whether its hold is that of the whole recording, which its part did not show.
    pub hold_of_whole: bool,
}

/// Inertia, damping and stiffness by the defaults of `estimate` and `fit`, and the band of that; of the deviation from the mean movement where there
/// are cycles.
pub(super) fn linear_fit(trials: &Trials, settings: &Diagnose, Options { held_out, schedule, .. }: &Options) -> Result<Found, AnalysisError> {
    let shortest = trials.trials.iter().map(|trial| trial.recording.len()).min().unwrap_or(0);
    let [fitted, _] = held_out.divide(trials.trials.len(), shortest, trials.sample_rate_hz())?;
    let schedule = schedule.as_ref().map(|schedule| schedule.part(&fitted));
    let mut part = Trials { trials: stretch(trials, fitted)?.into(), ..trials.clone() };
    let mut band_hz = settings.band_hz;
    if let Some(schedule) = &schedule {
        // The band of `fit --schedule` is that of the whole motion, the mean movement included.
        band_hz = Some(band_hz.map_or_else(|| Ok(fit(&estimate(&part, &Estimate::default())?, &Fit::default())?.result.band_hz), Ok::<_, AnalysisError>)?);
        part.trials = about_movement(part.trials.to_vec(), schedule)?.into();
    }
    let of = |part: &Trials, hold: Option<Hold>| fit(&estimate(part, &Estimate::default())?, &Fit { band_hz, hold, ..Fit::default() });
    let mut fitted = of(&part, settings.hold)?;
    let opposed = std::mem::take(&mut fitted.opposed);
    if !opposed.is_empty() {
        part = turned_round(&part, &opposed)?;
        fitted = of(&part, settings.hold)?;
    }
    // How a recording was sampled is the same all along it: where a part does not show it, the whole may.
    let mut hold_of_whole = false;
    if settings.hold.is_none() && schedule.is_none() && fitted.sampling.hold == Hold::BandLimited {
        let whole = turned_round(trials, &opposed).and_then(|trials| of(&trials, None)).map_or(Hold::BandLimited, |whole| whole.sampling.hold);
        if whole != Hold::BandLimited {
            fitted = of(&part, Some(whole))?;
            hold_of_whole = true;
        }
    }
    let errors: Vec<f64> = fitted.fit.parameters.iter().map(|parameter| parameter.std_error).collect();
    let std_errors: InertiaDampingStiffness = fitted.model.matrices(&errors);
    let of_sign = (fitted.fit.chi2_reduced.max(1.0) / fitted.fit.covariance_scale.max(1.0)).sqrt().min(1.0);
    let hold = settings.hold.or(Some(fitted.sampling.hold).filter(|hold| *hold != Hold::BandLimited));
    let linear = LinearFit { of_sign, matrices: fitted.matrices, std_errors, hold, ticks: fitted.ticks };
    Ok(Found { linear, band_hz: fitted.result.band_hz, opposed, hold_of_whole })
}

/// Takes the mean movement out of every channel, where there are cycles.
fn about_movement(trials: Vec<Trial>, schedule: &Schedule) -> Result<Vec<Trial>, AnalysisError> {
    let mut channels: Vec<Vec<Channel>> = trials.iter().map(|trial| trial.recording.channels().to_vec()).collect();
    for k in 0..channels.first().map_or(0, Vec::len) {
        let series: Vec<&[f64]> = channels.iter().map(|own| own[k].samples.as_slice()).collect();
        let Some(deviations) = schedule.deviations(&series) else { return Ok(trials) };
        channels.iter_mut().zip(deviations).for_each(|(own, samples)| own[k].samples = samples);
    }
    trials.iter().zip(channels).map(|(trial, own)| trial.with_channels(own)).collect()
}

fn stretch(trials: &Trials, part: Stretch) -> Result<Vec<Trial>, AnalysisError> {
    match part {
        Stretch::Trials(chosen) => Ok(chosen.into_iter().map(|k| trials.trials[k].clone()).collect()),
        Stretch::Samples(range) => trials.trials.iter().map(|trial| trial.slice(range.clone())).collect(),
    }
}
