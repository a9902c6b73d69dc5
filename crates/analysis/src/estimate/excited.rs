//! The band that a measurement says something of.

use crate::trials::Trials;
use ndof_signal::{CrossSpectra, Multitaper};
use ndof_sysid::{DirectEstimate, Pieces, SpectralMethod};
use rayon::prelude::*;
use std::ops::Range;

/// The band to fit where none is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Excited {
    pub band_hz: [f64; 2],
    /// What ends it above.
    pub because: &'static str,
}

/// The highest frequency at which the inputs explain half of every output; infinite where there is none.
pub(super) fn explained_to_hz(direct: &DirectEstimate) -> f64 {
    let explains = |f: &usize| direct.coherence.multiple.row(*f).iter().all(|coherence| *coherence >= 0.5);
    (0..direct.response.len()).rev().find(explains).map_or(f64::INFINITY, |f| direct.response.frequency_hz[f])
}

/// What is left out beyond a band's upper end: a fiftieth of a channel's power.
const BEYOND: f64 = 0.02;

/// From the first frequency that the window resolves to that below which all but a fiftieth of each input's power lies, and of the power of the
/// velocity that the inputs explain of each motion, and where half of every output is explained.
///
/// Of the velocity, because there stiffness, damping and inertia each rule a part: beyond its power there is inertia alone, and what a model
/// lacks (an effort held between samples, a sensor's mount, a mode of the frame) outweighs what it has.
///
/// By the direct estimate that `method` has made, and its spectra if it has made some.
pub(crate) fn excited_band(trials: &Trials, direct: &DirectEstimate, spectra: Option<&CrossSpectra>, method: &SpectralMethod) -> Excited {
    let ports = &trials.roles.ports;
    let hz = &direct.response.frequency_hz;
    let spacing = direct.response.uncertainty.as_ref().map_or(0.0, |u| u.independent_spacing_hz);
    let last = explained_to_hz(direct);
    let most = |power: &dyn Fn(usize) -> f64| {
        let total: f64 = (1..hz.len()).map(power).filter(|p| p.is_finite()).sum();
        let mut beyond = 0.0;
        let found = (1..hz.len()).rev().find(|&f| {
            beyond += Some(power(f)).filter(|p| p.is_finite()).unwrap_or(0.0);
            beyond > BEYOND * total
        });
        found.map(|f| hz[f])
    };
    let power = |channel: &usize| match spectra {
        Some(spectra) => Some((0..hz.len()).map(|f| spectra.power(f, *channel)).collect()),
        None => whole_power(trials, method, *channel),
    };
    let channels: Vec<usize> = ports.inputs.iter().chain(&ports.outputs).copied().collect();
    let powers: Option<Vec<Vec<f64>>> = channels.par_iter().map(power).collect();
    let (driven, moved) = powers.map_or((f64::INFINITY, f64::INFINITY), |powers| {
        let (inputs, outputs) = powers.split_at(ports.inputs.len());
        let driven = inputs.iter().filter_map(|power| most(&|f| power[f]));
        let moved = outputs.iter().zip(&trials.roles.output_motion).enumerate().filter_map(|(row, (power, order))| {
            let turn = 2 * (1 - (*order)?);
            most(&|f| power[f] * direct.coherence.multiple[[f, row]] * hz[f].powi(turn))
        });
        (driven.fold(0.0, f64::max), moved.fold(f64::NAN, f64::max))
    });
    let ends = [
        (last, "above it the inputs explain less than half of an output"),
        (driven, "above it the inputs have a fiftieth of their power"),
        (moved, "above it lies a fiftieth of the explained power of the motion's velocity"),
    ];
    let (high, because) = ends.into_iter().filter(|(hz, _)| hz.is_finite()).reduce(|a, b| if b.0 < a.0 { b } else { a }).unwrap_or(ends[0]);
    Excited { band_hz: [spacing.max(hz.get(1).copied().unwrap_or(0.0)), high], because }
}

/// The power of a channel at the lines of the whole records, for estimates at those lines that make no spectra.
fn whole_power(trials: &Trials, method: &SpectralMethod, channel: usize) -> Option<Vec<f64>> {
    let local = matches!(method, SpectralMethod::LocalPolynomial(_) | SpectralMethod::LocalRational(_));
    let recordings = trials.recordings();
    let of = |(trial, range): (usize, Range<usize>)| {
        let samples = &recordings[trial].channels()[channel].samples[range];
        Multitaper::default().spectra(trials.sample_rate_hz(), &[samples]).ok()
    };
    let pieces = local.then(|| Pieces::new(&recordings))?;
    let pooled = CrossSpectra::pool(&pieces.of.into_iter().map(of).collect::<Option<Vec<_>>>()?).ok()?;
    Some((0..pooled.frequency_hz().len()).map(|f| pooled.power(f, 0)).collect())
}
