//! A command that a loop holds from tick to tick, in efforts that are read at those ticks.

use super::evidence::Evidence;
use ndarray::{Array2, Array3, Axis};
use ndof_models::{Hold, InertiaDampingStiffness, InertiaDampingStiffnessModel, ParametricModel, Smoothing, WeightedFit, linear_start};
use ndof_sysid::{DerivedEstimate, FrequencyResponse};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// What jumps with the command at a tick: an effort's share of it, Γ = M (M + M_r)⁻¹ of the inertia M behind the effort and M_r before it.
#[derive(Clone, Debug)]
pub struct Ticks {
    /// When channels are read.
    pub hold: Hold,
    /// Γ, efforts by references.
    pub jump: Array2<f64>,
    /// M_r, where all that the motors do is held: the command and what answers the motion. `None` where the command alone is.
    pub motors: Option<Array2<f64>>,
    /// Efforts as they act of efforts as they were read, `[f]`.
    pub acting: Array3<Complex64>,
    /// Motion that comes of each unit of effort that was read by what of the jumps folds, `[f]`.
    pub folded: Array3<Complex64>,
}

impl Ticks {
    /// Efforts as they act of efforts as they were read, where each unit of effort comes with some command and some motion.
    ///
    /// F̃ = F + Γ κ u, u the command; or, where all that the motors do is held, ρ u = F̃ + M_r s² x, so that
    /// (1 − Γ κ/ρ) F̃ = F + Γ (κ/ρ) M_r s² x. With Γ u beside them. `None` where that has no solution.
    pub(super) fn act(&self, (s, step_s): (Complex64, f64), [command, effort, motion]: [&Array2<Complex64>; 3]) -> Option<[Array2<Complex64>; 2]> {
        let of = |factor: Complex64| self.jump.mapv(|share| share * factor);
        let kappa = self.hold.jump(s, step_s);
        let Some(before) = &self.motors else {
            let jumps = of(Complex64::ONE).dot(command);
            return Some([effort + &jumps * kappa, jumps]);
        };
        let rho = Hold::Zero.response(s, step_s) / Hold::Linear.response(s, step_s);
        let moved = before.mapv(|m| m * s * s).dot(motion);
        let missing = of(kappa / rho);
        let acting = ndof_linear::inverse(&(Array2::eye(missing.nrows()) - &missing))?.dot(&(effort + missing.dot(&moved)));
        let jumps = of(rho.inv()).dot(&(&acting + moved));
        Some([acting, jumps])
    }

    /// Efforts as they were read of efforts as they act, `[f]`.
    pub(super) fn read(&self) -> Array3<Complex64> {
        let mut read = self.acting.clone();
        for (mut read, acting) in read.outer_iter_mut().zip(self.acting.outer_iter()) {
            read.assign(&ndof_linear::inverse(&acting.to_owned()).unwrap_or_else(|| unknown(acting.nrows())));
        }
        read
    }

    /// A response to efforts as they were read, as one to what acts.
    pub(super) fn of(&self, response: &FrequencyResponse, read: &Array3<Complex64>) -> FrequencyResponse {
        let mut response = response.clone();
        response.value.outer_iter_mut().zip(self.folded.outer_iter()).for_each(|(mut value, folded)| value -= &folded);
        response.to_parts(read)
    }

    /// A response to what acts, as one to efforts as they are read.
    pub(super) fn seen(&self, response: &mut Array3<Complex64>) {
        for ((mut seen, acting), folded) in response.outer_iter_mut().zip(self.acting.outer_iter()).zip(self.folded.outer_iter()) {
            let whole = seen.dot(&acting) + folded;
            seen.assign(&whole);
        }
    }
}

/// What is known of a loop around the limb, where a command of the unit of the efforts closes one.
pub(super) struct Tick<'a> {
    derived: &'a DerivedEstimate,
    model: &'a InertiaDampingStiffnessModel,
    rate_hz: f64,
    /// What the command moves.
    whole: InertiaDampingStiffness,
}

impl<'a> Tick<'a> {
    /// From the responses to the command; `None` where none is held that could be told.
    pub fn of(model: &'a InertiaDampingStiffnessModel, evidence: &Evidence<'a>, (settings, theta): (&WeightedFit, &[f64])) -> Option<Self> {
        let (derived, (rate_hz, derivatives)) = (evidence.derived?, evidence.sampled?);
        let (channels, ports) = (evidence.channels, &evidence.channels.roles.ports);
        if channels.units(&ports.references) != channels.units(&ports.inputs) || ports.inputs.len() != ports.outputs.len() {
            return None;
        }
        // R = C T of displacement, without the half sample that what is held is late.
        let (r, t) = (&derived.to_reference.r, &derived.to_reference.t);
        let mut moved = FrequencyResponse { uncertainty: r.uncertainty.clone(), ..evidence.response.clone().into_owned() };
        for f in 0..moved.len() {
            let s = Complex64::new(0.0, TAU * moved.frequency_hz[f]);
            let response = moved.at(f).dot(&t.at(f)) / Hold::Zero.response(s, 1.0 / rate_hz);
            moved.value.index_axis_mut(Axis(0), f).assign(&response);
            if let Some(u) = &mut moved.uncertainty {
                u.noise.index_axis_mut(Axis(0), f).mapv_inplace(|v| v / s.norm_sqr().powi(derivatives));
            }
        }
        // What is read late is no transducer's give, and the window sees no loop here.
        let settings = WeightedFit { smoothing: Smoothing::Open, transducer: None, ..settings.clone() };
        let start = linear_start(model, &moved.band(settings.band_hz[0], settings.band_hz[1]));
        let starts: Vec<Vec<f64>> = start.into_iter().chain([theta[..model.parameters().len()].to_vec()]).collect();
        let whole = model.matrices(&settings.fit_from(model, &moved.independent(), &starts).ok()?.theta);
        Some(Tick { derived, model, rate_hz, whole })
    }

    /// With the inertia of parameters; `None` where that is not a part of all that moves.
    pub fn at(&self, theta: &[f64], evidence: &Evidence<'_>, hold: Hold, motors: bool) -> Option<Ticks> {
        let own = self.model.matrices(&theta[..self.model.parameters().len()]);
        let step_s = 1.0 / self.rate_hz;
        // What answers speed half a sample late is an inertia of −B T/2.
        let all = if motors { &self.whole.inertia + (&self.whole.damping - &own.damping) * (0.5 * step_s) } else { self.whole.inertia.clone() };
        let before = &all - &own.inertia;
        if [&own.inertia, &before].into_iter().any(|part| part.diag().iter().any(|m| *m <= 0.0)) {
            return None;
        }
        let jump = own.inertia.dot(&ndof_linear::inverse(&all)?);
        let (n, response) = (jump.nrows(), &evidence.response);
        let lightness = ndof_linear::inverse(&own.inertia)?.mapv(Complex64::from);
        let (derivatives, unknown) = (evidence.sampled?.1, || unknown(n));
        let (acting, folded) = (Array3::zeros((response.len(), n, n)), Array3::zeros((response.len(), n, n)));
        let mut ticks = Ticks { hold, jump, motors: motors.then_some(before), acting, folded };
        for (f, hz) in response.frequency_hz.iter().enumerate() {
            let s = Complex64::new(0.0, TAU * hz);
            let command = ndof_linear::inverse(&self.derived.to_reference.t.at(f)).unwrap_or_else(unknown);
            let found = ticks.act((s, step_s), [&command, &Array2::eye(n), &response.at(f)]);
            let [acting, jumps] = found.unwrap_or_else(|| [unknown(), unknown()]);
            ticks.folded.index_axis_mut(Axis(0), f).assign(&(lightness.dot(&jumps) * Hold::folded(s, step_s, derivatives)));
            ticks.acting.index_axis_mut(Axis(0), f).assign(&acting);
        }
        Some(ticks)
    }
}

/// What has no value.
fn unknown(n: usize) -> Array2<Complex64> {
    Array2::from_elem((n, n), Complex64::new(f64::NAN, f64::NAN))
}
