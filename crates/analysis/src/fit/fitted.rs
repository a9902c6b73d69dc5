//! A fit as values to go on with.

use super::result::{ComparedParameter, FitResult, Parameter};
use super::ticks;
use crate::estimate::Estimated;
use crate::response::MeasuredResponse;
use ndarray::{Array2, Array3};
use ndof_models::blocks::{self, BlockCard, Composite};
use ndof_models::{Held, InertiaDampingStiffness, InertiaDampingStiffnessModel, Sampling, Ticks, WeightedFit};
use ndof_sysid::{FrequencyResponse, ResponseError, ResponseKind};
use num_complex::Complex64;

/// A fit as values to go on with, and as the result to be written.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Inertia, damping and stiffness with their covariance, whatever else was fitted with them.
    pub fit: ndof_models::Fit,
    /// The baseline whose parameters they are.
    pub model: InertiaDampingStiffnessModel,
    /// The matrices.
    pub matrices: InertiaDampingStiffness,
    /// How the estimate's window and the transducer entered the comparison.
    pub comparison: WeightedFit,
    /// How the channels were sampled.
    pub sampling: Sampling,
    /// The loop at whose ticks channels are read, where there is one.
    pub ticks: Option<Ticks>,
    /// The mean of each effort, which a projection may take off; empty where it is unknown.
    pub mean_effort: Vec<f64>,
    /// The blocks that were fitted with the baseline, by their names in the registry.
    pub extensions: Vec<&'static str>,
    /// Parameters of baseline and blocks.
    pub theta: Vec<f64>,
    /// With more inputs than motions, what the inputs make of the effort along each axis: F = W u.
    pub gains: Option<Array2<f64>>,
    /// Efforts that are counted against the motions of their axes, beyond doubt; only where others are not.
    pub opposed: Vec<String>,
    /// The result.
    pub result: FitResult,
}

/// How far beyond the fitted band the model is drawn.
const DRAWN_BEYOND: f64 = 2.0;

impl Fitted {
    /// The parameters, those at the joints last, each beside its truth where that is known.
    pub fn table(&self, truth: impl Fn(&str) -> Option<f64>) -> Vec<ComparedParameter> {
        let compared = |p: &Parameter| ComparedParameter { truth: truth(&p.name), ..ComparedParameter::unknown(p) };
        self.result.all_parameters().map(compared).collect()
    }

    /// The baseline with its blocks, whose parameters [`Fitted::theta`] are, as the channels were sampled.
    pub fn whole(&self) -> Held<Composite> {
        let cards: Vec<&BlockCard> = self.extensions.iter().filter_map(|name| blocks::find(name)).collect();
        Held { model: Composite::of_cards(&self.model, &cards), sampling: self.sampling }
    }

    /// The model as the estimate that it was fitted to would show it, to twice the fitted band's upper end; NaN beyond. It is of
    /// the kind that is reported.
    ///
    /// # Errors
    /// [`ResponseError`] if a response of that kind does not exist.
    pub fn seen(&self, estimated: &Estimated) -> Result<FrequencyResponse, ResponseError> {
        self.seen_as(estimated.measured(), estimated.best().kind)
    }

    /// The same on the grid of a response that was measured elsewhere.
    ///
    /// # Errors
    /// As [`Fitted::seen`].
    pub fn seen_in(&self, measured: &MeasuredResponse) -> Result<FrequencyResponse, ResponseError> {
        self.seen_as(&measured.response, measured.kind)
    }

    fn seen_as(&self, like: &FrequencyResponse, kind: ResponseKind) -> Result<FrequencyResponse, ResponseError> {
        let kernel = like.uncertainty.as_ref().map(|u| u.kernel.clone()).unwrap_or_default();
        let drawn = like.frequency_hz.partition_point(|hz| *hz <= DRAWN_BEYOND * self.fit.band_hz[1]);
        let mut near = self.comparison.seen(&self.whole(), &self.theta, like.kind, &like.frequency_hz[..drawn], &kernel);
        if let Some(ticks) = &self.ticks {
            ticks::seen(ticks, self.sampling, &mut near, &like.frequency_hz[..drawn]);
        }
        let nowhere = Complex64::new(f64::NAN, f64::NAN);
        let at = |f: usize, i: usize, j: usize| match &self.gains {
            Some(w) => (0..w.nrows()).map(|axis| near[[f, i, axis]] * w[[axis, j]]).sum(),
            None => near[[f, i, j]],
        };
        let value = Array3::from_shape_fn(like.value.dim(), |(f, i, j)| if f < drawn { at(f, i, j) } else { nowhere });
        let seen = FrequencyResponse { value, uncertainty: None, ..like.clone() };
        seen.to_kind(kind)
    }
}
