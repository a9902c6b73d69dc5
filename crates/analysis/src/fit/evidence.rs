//! What a model is fitted to: the response of recordings, or one that was measured elsewhere.

use crate::error::AnalysisError;
use crate::estimate::{Estimate, Estimated, without_each};
use crate::fit::settings::VafWeight;
use crate::response::MeasuredResponse;
use crate::result::Warning;
use crate::trials::Trials;
use ndarray::Array3;
use ndof_models::{CovarianceKind, LoopModel, Smoothing};
use ndof_signal::{CrossSpectra, Multitaper, Recording};
use ndof_sysid::{DerivedEstimate, FrequencyResponse, Ports, ResponseKind, SpectralMethod};
use rayon::prelude::*;
use std::borrow::Cow;

/// A response with what a fit needs to know of how it came about.
#[derive(Clone)]
pub(super) struct Evidence<'a> {
    /// What its channels are.
    pub channels: &'a Trials,
    /// The response, brought to displacement.
    pub response: Cow<'a, FrequencyResponse>,
    /// The same up to the band's end from all trials but one, each in turn; empty where there are none.
    pub without: Vec<FrequencyResponse>,
    /// The partial coherence, γ².
    pub coherence: Array3<f64>,
    /// The band to fit where none is asked for.
    pub band_hz: [f64; 2],
    /// What ends it above.
    pub band_because: Option<&'static str>,
    /// What closes a loop around the limb.
    derived: Option<&'a DerivedEstimate>,
    /// Whether a window smoothed it.
    smoothed: bool,
    /// Rate of its efforts and derivatives of its motions, where what efforts do between samples can be told.
    pub sampled: Option<(f64, i32)>,
    /// Where the width of the intervals comes from.
    pub covariance: CovarianceKind,
    /// The mean of each effort, which a projection may take off; empty where it is unknown.
    pub mean_effort: Vec<f64>,
    /// What the result calls it.
    pub name: &'static str,
    /// How it was asked for.
    pub asked: Estimate,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
}

impl<'a> Evidence<'a> {
    /// The derived estimate of recordings where there is one, else the direct one, for a fit of the band that is asked for.
    pub fn of_recordings(estimated: &'a Estimated, asked_hz: Option<[f64; 2]>) -> Result<Self, AnalysisError> {
        let (trials, estimates) = (&estimated.trials, &estimated.estimates);
        let ports = &trials.roles.ports;
        let (band_hz, band_because) = excited_band(estimated, ports);
        let efforts = if trials.roles.natural_kind().is_effort_over_motion() { &ports.outputs } else { &ports.inputs };
        Ok(Evidence {
            channels: trials,
            response: Cow::Borrowed(estimated.measured()),
            without: without_each(estimated, asked_hz.unwrap_or(band_hz)[1])?,
            coherence: estimates.derived.as_ref().map_or(&estimates.direct.coherence.partial, |derived| &derived.coherence_paper.partial).clone(),
            band_hz,
            band_because: Some(band_because),
            derived: estimates.derived.as_ref(),
            smoothed: true,
            sampled: sampled(trials),
            covariance: CovarianceKind::default(),
            mean_effort: efforts.iter().map(|&index| trials.mean(index)).collect(),
            name: if estimates.derived.is_some() { "derived" } else { "direct" },
            asked: estimated.result.settings.clone(),
            warnings: estimated.result.head.warnings.clone(),
        })
    }

    /// A response that was measured elsewhere.
    pub fn of_response(measured: &'a MeasuredResponse) -> Self {
        let hz = &measured.response.frequency_hz;
        Evidence {
            channels: &measured.channels,
            response: Cow::Borrowed(&measured.response),
            without: Vec::new(),
            coherence: measured.coherence.clone(),
            band_hz: [hz.iter().copied().find(|hz| *hz > 0.0).unwrap_or(0.0), hz.last().copied().unwrap_or(0.0)],
            band_because: None,
            derived: None,
            smoothed: false,
            sampled: None,
            covariance: if measured.errors_known { CovarianceKind::Model } else { CovarianceKind::Sandwich },
            mean_effort: Vec::new(),
            name: "file",
            asked: Estimate::default(),
            warnings: measured.warnings.clone(),
        }
    }

    /// Whether the response says how large its errors are.
    pub fn errors_known(&self) -> bool {
        self.covariance == CovarianceKind::Model
    }

    /// How the window smooths what it sees: through the loop where a commanded force closes it, else as an open system.
    pub fn smoothing(&self, band_hz: [f64; 2]) -> Smoothing {
        match self.derived {
            _ if !self.smoothed => Smoothing::None,
            Some(derived) => LoopModel::estimate(&derived.to_reference.t, &derived.to_reference.r, band_hz).map_or(Smoothing::Open, Smoothing::Derived),
            None => Smoothing::Open,
        }
    }

    /// The partial coherence that weighs VAF, R² and the paper's cost.
    pub fn weight(&self, weight: VafWeight) -> Array3<f64> {
        match weight {
            VafWeight::GammaSquared => self.coherence.clone(),
            VafWeight::Gamma => self.coherence.mapv(f64::sqrt),
        }
    }

    /// Whether the references hardly reach the inputs at a frequency that was fitted.
    pub fn weak_in_band(&self, [low_hz, high_hz]: [f64; 2]) -> bool {
        self.derived.is_some_and(|derived| {
            let weak = derived.response.frequency_hz.iter().zip(&derived.weak_instrument);
            weak.into_iter().any(|(hz, weak)| *weak && (low_hz..=high_hz).contains(hz))
        })
    }
}

/// Rate and derivatives of trials whose efforts move displacements or velocities. What is imposed as motion is not held, and an acceleration
/// jumps with the effort.
fn sampled(trials: &Trials) -> Option<(f64, i32)> {
    let motion: Vec<i32> = trials.roles.output_motion.iter().flatten().copied().collect();
    let first = *motion.first()?;
    let alike = trials.roles.natural_kind() != ResponseKind::Transfer && !trials.roles.natural_kind().is_effort_over_motion();
    (alike && (0..=1).contains(&first) && motion.iter().all(|order| *order == first)).then(|| (trials.sample_rate_hz(), first))
}

/// What is left out beyond a band's upper end: a fiftieth of a channel's power.
const BEYOND: f64 = 0.02;

/// From the first frequency that the window resolves to that below which all but a fiftieth of each input's power lies, and of the power of the
/// velocity that the inputs explain of each motion, and where half of every output is explained.
///
/// Of the velocity, because there stiffness, damping and inertia each rule a part: beyond its power there is inertia alone, and what a model
/// lacks (an effort held between samples, a sensor's mount, a mode of the frame) outweighs what it has.
fn excited_band(estimated: &Estimated, ports: &Ports) -> ([f64; 2], &'static str) {
    let direct = &estimated.estimates.direct;
    let hz = &direct.response.frequency_hz;
    let spacing = direct.response.uncertainty.as_ref().map_or(0.0, |u| u.independent_spacing_hz);
    let last = estimated.explained_to_hz();
    let most = |power: &dyn Fn(usize) -> f64| {
        let total: f64 = (1..hz.len()).map(power).filter(|p| p.is_finite()).sum();
        let mut beyond = 0.0;
        let found = (1..hz.len()).rev().find(|&f| {
            beyond += Some(power(f)).filter(|p| p.is_finite()).unwrap_or(0.0);
            beyond > BEYOND * total
        });
        found.map(|f| hz[f])
    };
    let power = |channel: &usize| match &estimated.estimates.spectra {
        Some(spectra) => Some((0..hz.len()).map(|f| spectra.power(f, *channel)).collect()),
        None => whole_power(estimated, *channel),
    };
    let channels: Vec<usize> = ports.inputs.iter().chain(&ports.outputs).copied().collect();
    let powers: Option<Vec<Vec<f64>>> = channels.par_iter().map(power).collect();
    let (driven, moved) = powers.map_or((f64::INFINITY, f64::INFINITY), |powers| {
        let (inputs, outputs) = powers.split_at(ports.inputs.len());
        let driven = inputs.iter().filter_map(|power| most(&|f| power[f]));
        let moved = outputs.iter().zip(&estimated.trials.roles.output_motion).enumerate().filter_map(|(row, (power, order))| {
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
    ([spacing.max(hz.get(1).copied().unwrap_or(0.0)), high], because)
}

/// The power of a channel at the lines of the whole records, for estimates at those lines that make no spectra.
fn whole_power(estimated: &Estimated, channel: usize) -> Option<Vec<f64>> {
    let local = matches!(estimated.estimates.method, SpectralMethod::LocalPolynomial(_) | SpectralMethod::LocalRational(_));
    let recordings = estimated.trials.recordings();
    let length = recordings.iter().map(|recording| recording.len()).min().filter(|_| local)?;
    let of = |recording: &Recording| {
        let samples = &recording.channels()[channel].samples[..length];
        Multitaper::default().spectra(recording.sample_rate_hz(), &[samples]).ok()
    };
    let pooled = CrossSpectra::pool(&recordings.into_iter().map(of).collect::<Option<Vec<_>>>()?).ok()?;
    Some((0..pooled.frequency_hz().len()).map(|f| pooled.power(f, 0)).collect())
}
