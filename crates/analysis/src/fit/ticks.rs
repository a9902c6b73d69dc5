//! What is before the force at a limb, where a command closes a loop from tick to tick, and responses to efforts that are read at its ticks.

use super::evidence::Evidence;
use ndarray::{Array2, Array3, Axis};
use ndof_models::{Held, Hold, InertiaDampingStiffness, InertiaDampingStiffnessModel, ParametricModel, Sampling, Smoothing, Ticks, WeightedFit, linear_start};
use ndof_sysid::FrequencyResponse;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// A matrix of each frequency, `[f]`; not a number where there is none.
fn each(frequency_hz: &[f64], n: usize, of: impl Fn(Complex64) -> Option<Array2<Complex64>>) -> Array3<Complex64> {
    let mut out = Array3::from_elem((frequency_hz.len(), n, n), Complex64::new(f64::NAN, f64::NAN));
    for (mut at, hz) in out.outer_iter_mut().zip(frequency_hz) {
        of(Complex64::new(0.0, TAU * hz)).into_iter().for_each(|found| at.assign(&found));
    }
    out
}

/// Efforts as they are read of efforts as they act, `[f]`.
pub(super) fn read(ticks: &Ticks, sampling: Sampling, frequency_hz: &[f64]) -> Array3<Complex64> {
    each(frequency_hz, ticks.limb.axes.len(), |s| ndof_linear::inverse(&ticks.acting(sampling, s)?))
}

/// A response to what acts, as one to efforts as they are read.
pub(super) fn seen(ticks: &Ticks, sampling: Sampling, response: &mut Array3<Complex64>, frequency_hz: &[f64]) {
    let acting = each(frequency_hz, ticks.limb.axes.len(), |s| ticks.acting(sampling, s));
    for (mut seen, acting) in response.outer_iter_mut().zip(acting.outer_iter()) {
        let whole = seen.dot(&acting);
        seen.assign(&whole);
    }
}

/// What a command moves that a loop holds from tick to tick.
pub(super) struct Tick<'a> {
    model: &'a InertiaDampingStiffnessModel,
    sample_rate_hz: f64,
    whole: InertiaDampingStiffness,
}

impl<'a> Tick<'a> {
    /// From the responses to the command; `None` where none is held that could be told.
    pub fn of(model: &'a InertiaDampingStiffnessModel, evidence: &Evidence<'a>, (settings, theta): (&WeightedFit, &[f64])) -> Option<Self> {
        let (derived, (sample_rate_hz, derivatives)) = (evidence.derived?, evidence.sampled?);
        let (channels, ports) = (evidence.channels, &evidence.channels.roles.ports);
        if channels.units(&ports.references) != channels.units(&ports.inputs) || ports.inputs.len() != ports.outputs.len() {
            return None;
        }
        // R = C T of displacement.
        let (r, t) = (&derived.to_reference.r, &derived.to_reference.t);
        let mut moved = FrequencyResponse { uncertainty: r.uncertainty.clone(), ..evidence.response.clone().into_owned() };
        for f in 0..moved.len() {
            let response = moved.at(f).dot(&t.at(f));
            moved.value.index_axis_mut(Axis(0), f).assign(&response);
            if let Some(u) = &mut moved.uncertainty {
                let s = Complex64::new(0.0, TAU * moved.frequency_hz[f]);
                u.noise.index_axis_mut(Axis(0), f).mapv_inplace(|v| v / s.norm_sqr().powi(derivatives));
            }
        }
        // What is read late is no transducer's give, and the window sees no loop here.
        let settings = WeightedFit { smoothing: Smoothing::Open, transducer: None, ..settings.clone() };
        let start = linear_start(model, &moved.band(settings.band_hz[0], settings.band_hz[1]));
        let starts: Vec<Vec<f64>> = start.into_iter().chain([theta[..model.parameters().len()].to_vec()]).collect();
        let sampling = Sampling { hold: Hold::Zero, sample_rate_hz, derivatives };
        let whole = settings.fit_from(&Held { model: model.clone(), sampling }, &moved.independent(), &starts).ok()?;
        Some(Tick { model, sample_rate_hz, whole: model.matrices(&whole.theta) })
    }

    /// With the parameters of a limb; `None` where its inertia is not a part of all that moves. Before the force is what all that is moved has more than the
    /// limb, and where all that the motors do is held, the inertia of that.
    pub fn at(&self, theta: &[f64], motors: bool) -> Option<Ticks> {
        let limb = self.model.matrices(&theta[..self.model.parameters().len()]);
        let less = |all: &Array2<f64>, own: &Array2<f64>| all - own;
        let mut before = InertiaDampingStiffness {
            axes: limb.axes.clone(),
            inertia: less(&self.whole.inertia, &limb.inertia),
            damping: less(&self.whole.damping, &limb.damping),
            stiffness: less(&self.whole.stiffness, &limb.stiffness),
        };
        if motors {
            // What answers speed half a sample late is an inertia of −B T/2.
            before.inertia.scaled_add(0.5 / self.sample_rate_hz, &before.damping);
            [&mut before.damping, &mut before.stiffness].into_iter().for_each(|none| none.fill(0.0));
        }
        let is_part = [&limb, &before].into_iter().all(|part| part.inertia.diag().iter().all(|m| *m > 0.0));
        is_part.then_some(Ticks { limb, before })
    }
}
