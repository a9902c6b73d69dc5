//! From chosen hypotheses to a model that runs, and to named parameters with intervals.

use crate::free_run::Runner;
use crate::hypotheses::{Ground, Hypothesis, Tried};
use crate::layout::Track;
use crate::plant::Role;
use crate::result::CauseParameter;
use crate::search::{Chosen, Stand};
use crate::state::State;
use crate::subject::Subject;
use crate::whittle::INDEPENDENCE;
use ndof_models::ForceLaw;
use ndof_models::effects::{Action, Matrix, Sign, Value, rotational_name};
use num_complex::Complex64;

/// A natural frequency below this, for a band to 12 Hz, is no restoring force.
const SLOWEST: f64 = 0.1;

impl Subject {
    /// The coefficients of a chosen hypothesis in a stand.
    pub fn coefficients<'a>(&self, stand: &'a Stand, position: usize) -> &'a [f64] {
        let (first, count) = stand.spans[position];
        let from = stand.base.columns.len() + first;
        &stand.fit.theta[from..from + count]
    }

    /// The force laws of a stand.
    pub fn laws(&self, chosen: &[Chosen], stand: &Stand) -> Vec<Box<dyn ForceLaw>> {
        chosen
            .iter()
            .enumerate()
            .filter_map(|(q, c)| match &self.hypotheses[c.hypothesis].form.action {
                Action::Force { law, .. } => Some(law(&c.knobs, self.coefficients(stand, q))),
                Action::Scheduled(of) => Some(of.law(self.coefficients(stand, q))),
                _ => None,
            })
            .collect()
    }

    /// The matrix of a stand, entries that causes change included.
    pub fn matrix(&self, chosen: &[Chosen], stand: &Stand, matrix: Matrix) -> Vec<Vec<f64>> {
        let mut out = stand.base.matrix(&self.structure, &stand.fit.theta, matrix, self.layout.axes);
        for (q, c) in chosen.iter().enumerate() {
            if let Action::Entries { matrix: which, entries } = &self.hypotheses[c.hypothesis].form.action
                && *which == matrix
            {
                let value = self.coefficients(stand, q)[0];
                entries.iter().for_each(|&(i, j, w)| out[i][j] += w * value);
            }
        }
        out
    }

    /// Whether every axis has a stiffness that brings it back, so that a free run does not drift away.
    pub fn restores(&self, chosen: &[Chosen], stand: &Stand) -> bool {
        let (k, m) = (self.matrix(chosen, stand, Matrix::Stiffness), self.matrix(chosen, stand, Matrix::Mass));
        let slowest = (std::f64::consts::TAU * SLOWEST / self.layout.time_s).powi(2);
        (0..self.layout.axes).all(|i| k[i][i] > slowest * m[i][i].abs())
    }

    /// A stand that runs by itself.
    pub fn runner(&self, chosen: &[Chosen], stand: &Stand) -> Runner {
        let n = self.layout.axes;
        let mut offset = vec![0.0; n];
        for (role, value) in stand.base.roles.iter().zip(&stand.fit.theta) {
            if let Role::Offset(axis, _) = role {
                offset[*axis] += value / self.layout.trials as f64;
            }
        }
        let mut runner = Runner {
            mass: self.matrix(chosen, stand, Matrix::Mass),
            damping: self.matrix(chosen, stand, Matrix::Damping),
            stiffness: self.matrix(chosen, stand, Matrix::Stiffness),
            offset,
            laws: self.laws(chosen, stand),
            movement: None,
        };
        runner.movement = self.layout.movement.as_ref().map(|movement| {
            let left: Vec<Vec<Vec<f64>>> = (0..self.layout.trials).map(|trial| missing(&runner, &stand.state, trial)).collect();
            let mean = |axis: usize| movement.mean(&left.iter().map(|trial| trial[axis].as_slice()).collect::<Vec<_>>());
            (movement.splines, (0..n).map(mean).collect())
        });
        runner
    }

    /// The named parameters of a chosen hypothesis with their 95 % intervals.
    ///
    /// Coefficients: the covariance of the fit. Knobs: the curvature of the profile likelihood. Both carry the form's systematic floor.
    pub fn named(&self, chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<CauseParameter> {
        let c = &chosen[position];
        let h = &self.hypotheses[c.hypothesis];
        let coefficients = self.coefficients(stand, position).to_vec();
        let values = (h.form.naming)(&c.knobs, &coefficients);
        let mut variance = vec![0.0; values.len()];
        let numbers = |knobs: &[f64], coefficients: &[f64]| -> Vec<f64> {
            (h.form.naming)(knobs, coefficients).into_iter().map(|(_, v)| if let Value::Number(x) = v { x } else { 0.0 }).collect()
        };
        let at = numbers(&c.knobs, &coefficients);
        let (first, count) = stand.spans[position];
        let from = stand.base.columns.len() + first;
        let covariances = stand.fit.covariance();
        for a in 0..count {
            for b in 0..count {
                let covariance = covariances.at(from + a, from + b);
                let slope = |q: usize| -> Vec<f64> {
                    let step = 1e-4 * coefficients[q].abs().max(covariances.at(from + q, from + q).sqrt());
                    let mut moved = coefficients.clone();
                    moved[q] += step;
                    numbers(&c.knobs, &moved).iter().zip(&at).map(|(m, a)| (m - a) / step).collect()
                };
                let (sa, sb) = (slope(a), slope(b));
                variance.iter_mut().zip(sa.iter().zip(&sb)).for_each(|(v, (x, y))| *v += x * y * covariance);
            }
        }
        let others: Vec<Chosen> = chosen.iter().enumerate().filter(|(k, _)| *k != position).map(|(_, c)| c.clone()).collect();
        if let Some(rest) = self.stand(&others, &stand.fit.power, 1) {
            let ground =
                Ground { state: &rest.state, cause: &self.cause, structure: &self.structure, base: &rest.base, terms: &rest.terms, power: &stand.fit.power };
            for (k, knob) in h.form.knobs.iter().enumerate() {
                let step = if knob.log { 0.03 * c.knobs[k] } else { 0.01 * (knob.hi - knob.lo) };
                let moved = |sign: f64| -> Option<(Vec<f64>, Tried)> {
                    let mut knobs = c.knobs.clone();
                    knobs[k] += sign * step;
                    let free = relaxed(h);
                    ground.evaluate(&free, &knobs, 1).map(|t| (knobs, t))
                };
                let middle = ground.evaluate(&relaxed(h), &c.knobs, 1);
                if let (Some(up), Some(down), Some(middle)) = (moved(1.0), moved(-1.0), middle) {
                    let curvature = (2.0 * middle.fit.log_likelihood - up.1.fit.log_likelihood - down.1.fit.log_likelihood) / (step * step);
                    let sigma2 = if curvature > 0.0 { 1.0 / (curvature * INDEPENDENCE) } else { 4.0 * step * step };
                    let (a, b) = (numbers(&up.0, &up.1.coefficients), numbers(&down.0, &down.1.coefficients));
                    variance.iter_mut().zip(a.iter().zip(&b)).for_each(|(v, (a, b))| *v += ((a - b) / (2.0 * step)).powi(2) * sigma2);
                }
            }
        }
        values
            .into_iter()
            .zip(variance)
            .map(|((name, value), variance)| {
                let card = h.effect.card().parameters.iter().find(|p| p.name == name);
                let unit = card.map_or("", |p| if self.scale.rotational { p.rotational_unit } else { p.unit });
                let ci95 = match value {
                    Value::Number(x) if variance > 0.0 && variance.is_finite() => {
                        let floor = (h.form.floor.0 * x).hypot(h.form.floor.1);
                        let half = 1.96 * variance.sqrt().hypot(floor);
                        Some([x - half, x + half])
                    }
                    _ => None,
                };
                let name = if self.scale.rotational { rotational_name(name) } else { name.to_owned() };
                CauseParameter { name, unit: unit.to_owned(), value, ci95 }
            })
            .collect()
    }
}

/// What a model without a mean force leaves of the efforts of a trial.
fn missing(runner: &Runner, state: &State, trial: usize) -> Vec<Vec<f64>> {
    let needed = runner.needed(state, trial);
    let left = |(track, needed): (&Track, Vec<f64>)| {
        let effort = state.layout.filtered(track, |_| Complex64::ONE, None);
        effort.iter().zip(needed).map(|(f, needed)| f - needed).collect()
    };
    state.effort[trial].iter().zip(needed).map(left).collect()
}

/// The hypothesis without bounds, for derivatives at an edge.
fn relaxed(h: &Hypothesis) -> Hypothesis {
    let mut form = h.form.clone();
    form.knobs.iter_mut().for_each(|k| (k.lo, k.hi) = (f64::NEG_INFINITY, f64::INFINITY));
    form.signs.iter_mut().for_each(|s| *s = Sign::Free);
    Hypothesis { effect: h.effect, form }
}
