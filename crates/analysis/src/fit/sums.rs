//! More inputs than motions: efforts that add up along each axis, with gains that are fitted with the axes.

use super::evidence::Evidence;
use crate::error::AnalysisError;
use crate::trials::axis_of;
use ndarray::{Array1, Array2, Array3};
use ndof_models::{Driven, Fit, Gains, ParametricModel, Smoothing, WeightedFit, gains_start};
use ndof_sysid::FrequencyResponse;
use std::borrow::Cow;

/// The gains by which the inputs of a response add up.
pub(super) struct Sums<'a> {
    whole: &'a Evidence<'a>,
    gains: Gains,
    units: Vec<String>,
    found: Vec<f64>,
}

impl<'a> Sums<'a> {
    /// The gains of a response that has more inputs than motions, from the frequencies of a band: those with which one response to the sums
    /// explains that to each input best. `None` where each motion has an input of its own.
    pub fn of(whole: &'a Evidence<'a>, band_hz: [f64; 2]) -> Result<Option<Self>, AnalysisError> {
        let response = &*whole.response;
        let (outputs, inputs) = response.shape();
        if inputs <= outputs {
            return Ok(None);
        }
        if response.kind.is_effort_over_motion() {
            return Err(AnalysisError::SumsOfMotion { inputs: response.inputs.join(", "), outputs: response.outputs.join(", ") });
        }
        let gains = Gains::new(outputs, response.inputs.clone(), references(response));
        let found = gains_start(&gains, &response.band(band_hz[0], band_hz[1]));
        let units = whole.channels.units(&whole.channels.roles.ports.inputs);
        Ok(Some(Sums { whole, gains, units, found }))
    }

    /// What was found, of the sums of efforts: as many inputs as motions.
    pub fn evidence(&self, found: &[f64]) -> Evidence<'a> {
        let w = self.gains.matrix(found);
        let response = self.whole.response.to_sums(&w);
        let freedom = response.uncertainty.as_ref().map_or(f64::NAN, |u| u.degrees_of_freedom);
        // γ² = |H|²/(|H|² + S_ee (S_uu⁻¹)_jj), S_ee = ν noise.
        let coherence = Array3::from_shape_fn(response.value.dim(), |(f, i, j)| {
            let size = response.value[[f, i, j]].norm_sqr();
            size / (size + freedom * response.variance(f, i, j))
        });
        let mean = &self.whole.mean_effort;
        let mean_effort = if mean.is_empty() { Vec::new() } else { w.dot(&Array1::from(mean.clone())).to_vec() };
        let mut out = self.whole.clone();
        (out.response, out.coherence, out.mean_effort, out.without) = (Cow::Owned(response), coherence, mean_effort, Vec::new());
        out
    }

    /// The same with the gains that the search began with.
    pub fn first(&self) -> Evidence<'a> {
        self.evidence(&self.found)
    }

    /// Axes and gains together, from the response to each input and those without each trial.
    pub fn fit(&self, settings: &WeightedFit, model: &dyn ParametricModel, start: &[f64]) -> Result<Fit, AnalysisError> {
        let driven = Driven { model, gains: self.gains.clone(), units: self.units.clone() };
        // A loop that closes around sums of efforts is not told from these responses.
        let settings = WeightedFit { smoothing: if settings.smoothing == Smoothing::None { Smoothing::None } else { Smoothing::Open }, ..settings.clone() };
        let fit = settings.fit_trials(&driven, &self.whole.response, &self.whole.without, &[start, &self.found].concat())?;
        Ok(if self.whole.errors_known() { settings.allowing_for_misfit(&driven, &self.whole.response, fit)? } else { fit })
    }

    /// W of a fit to all.
    pub fn matrix(&self, fit: &Fit) -> Array2<f64> {
        self.gains.matrix(self.gains_of(fit))
    }

    /// Its gains, which stand behind the model's own parameters.
    pub fn gains_of<'b>(&self, fit: &'b Fit) -> &'b [f64] {
        &fit.theta[fit.theta.len() - self.gains.count()..]
    }

    /// The inputs whose gain is 1, axis after axis.
    pub fn references(&self) -> Vec<String> {
        self.gains.reference().iter().map(|&input| self.whole.response.inputs[input].clone()).collect()
    }
}

/// Of each output the input that carries its axis' name, else the first that is left.
fn references(response: &FrequencyResponse) -> Vec<usize> {
    let own = |output: &String| response.inputs.iter().position(|input| axis_of(input) == axis_of(output));
    let mut taken: Vec<Option<usize>> = response.outputs.iter().map(own).collect();
    for k in 0..taken.len() {
        if taken[k].is_none_or(|input| taken[..k].contains(&Some(input))) {
            taken[k] = (0..response.inputs.len()).find(|input| !taken.contains(&Some(*input)));
        }
    }
    taken.into_iter().flatten().collect()
}
