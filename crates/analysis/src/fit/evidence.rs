//! What a model is fitted to: the response of recordings, or one that was measured elsewhere.

use crate::error::AnalysisError;
use crate::estimate::{Estimate, Estimated, Excited, excited_band, without_each};
use crate::fit::settings::VafWeight;
use crate::fit::ticks;
use crate::response::MeasuredResponse;
use crate::result::Warning;
use crate::trials::Trials;
use ndarray::Array3;
use ndof_models::{CovarianceKind, LoopModel, Sampling, Smoothing, Ticks};
use ndof_sysid::{DerivedEstimate, FrequencyResponse, ResponseKind};
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
    pub derived: Option<&'a DerivedEstimate>,
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
        let Excited { band_hz, because } =
            estimated.excited.unwrap_or_else(|| excited_band(trials, &estimates.direct, estimates.spectra.as_ref(), &estimates.method));
        let efforts = if trials.roles.natural_kind().is_effort_over_motion() { &ports.outputs } else { &ports.inputs };
        Ok(Evidence {
            channels: trials,
            response: Cow::Borrowed(estimated.measured()),
            without: without_each(estimated, asked_hz.unwrap_or(band_hz)[1])?,
            coherence: estimates.derived.as_ref().map_or(&estimates.direct.coherence.partial, |derived| &derived.coherence_paper.partial).clone(),
            band_hz,
            band_because: Some(because),
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

    /// The responses to efforts as they act.
    pub fn on(&self, ticks: &Ticks, sampling: Sampling) -> Self {
        let read = ticks::read(ticks, sampling, &self.response.frequency_hz);
        let of = |response: &FrequencyResponse| response.to_parts(&read);
        Evidence { response: Cow::Owned(of(&self.response)), without: self.without.iter().map(of).collect(), ..self.clone() }
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

    /// What is to be said of references that hardly reach the inputs at a frequency that was fitted.
    pub fn weakness(&self, band_hz: [f64; 2]) -> Option<Warning> {
        self.derived?.weakness(band_hz)
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
