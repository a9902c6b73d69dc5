//! From chosen hypotheses to a model that runs, and to named parameters with intervals.

use crate::free_run::Runner;
use crate::hypotheses::{Ground, Hypothesis, Tried};
use crate::layout::Track;
use crate::optimise::inside_of;
use crate::plant::Role;
use crate::result::CauseParameter;
use crate::search::{Chosen, Stand, but};
use crate::state::State;
use crate::subject::Subject;
use crate::whittle::INDEPENDENCE;
use ndof_models::ForceLaw;
use ndof_models::effects::{Action, Knob, Matrix, Sign, Value, rotational_name};
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
        chosen.iter().enumerate().filter_map(|(q, c)| self.hypotheses[c.hypothesis].form.action.law(&c.knobs, self.coefficients(stand, q))).collect()
    }

    /// The forces that every model has.
    fn known(&self) -> impl Iterator<Item = Box<dyn ForceLaw>> {
        self.structure.known.iter().map(|law| Box::new(law.clone()) as Box<dyn ForceLaw>)
    }

    /// The forces of a stand beyond its matrices along one trial: `[axis][time]`.
    pub fn beyond(&self, chosen: &[Chosen], stand: &Stand, trial: usize) -> Vec<Vec<f64>> {
        let laws = self.laws(chosen, stand);
        let forces = laws.iter().map(|law| stand.state.forces_of(law.as_ref(), trial));
        let mut out = vec![vec![0.0; self.layout.samples]; self.layout.axes];
        for force in forces.chain(self.curved(chosen, stand).map(|plant| plant.beyond(&stand.state, trial))) {
            out.iter_mut().flatten().zip(force.iter().flatten()).for_each(|(sum, f)| *sum += f);
        }
        out
    }

    /// The matrix of a stand, entries that causes change included.
    pub fn matrix(&self, chosen: &[Chosen], stand: &Stand, matrix: Matrix) -> Vec<Vec<f64>> {
        let mut out = stand.base.matrix(&stand.fit.theta, matrix, self.layout.axes);
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

    /// The fitted numbers that make an entry of [`Self::matrix`], each with its weight: the baseline's own, and what causes change of it.
    pub fn parts_of(&self, chosen: &[Chosen], stand: &Stand, (matrix, i, j): (Matrix, usize, usize)) -> Vec<(usize, f64)> {
        let changes = chosen.iter().enumerate().flat_map(|(q, c)| {
            let weight = match &self.hypotheses[c.hypothesis].form.action {
                Action::Entries { matrix: which, entries } if *which == matrix => entries.iter().filter(|e| (e.0, e.1) == (i, j)).map(|e| e.2).sum(),
                _ => 0.0,
            };
            (weight != 0.0).then(|| (stand.base.columns.len() + stand.spans[q].0, weight))
        });
        stand.base.entry(matrix, i, j).map(|column| (column, 1.0)).into_iter().chain(changes).collect()
    }

    /// Whether every axis has a stiffness that brings it back, so that a free run does not drift away; of a measured velocity, whether damping does, and a
    /// stiffness below zero is too weak to carry it off within a trial.
    pub fn restores(&self, chosen: &[Chosen], stand: &Stand, order: usize) -> bool {
        let [k, b, m] = [Matrix::Stiffness, Matrix::Damping, Matrix::Mass].map(|matrix| self.matrix(chosen, stand, matrix));
        let slowest = std::f64::consts::TAU * SLOWEST / self.layout.time_s;
        let stays = |k: f64, b: f64, m: f64| k > slowest.powi(2) * m || order == 1 && b > slowest * m && k * self.scale.duration_s > -b;
        (0..self.layout.axes).all(|i| stays(k[i][i], b[i][i], m[i][i].abs()))
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
            laws: self.known().chain(self.laws(chosen, stand)).collect(),
            curved: self.curved(chosen, stand),
            movement: None,
        };
        runner.movement = self.layout.movement.as_ref().map(|movement| {
            let left: Vec<Vec<Vec<f64>>> = (0..self.layout.trials).map(|trial| missing(&runner, &stand.state, trial)).collect();
            let mean = |axis: usize| movement.coefficients(&left.iter().map(|trial| trial[axis].as_slice()).collect::<Vec<_>>());
            (movement.splines(), (0..n).map(mean).collect())
        });
        runner
    }

    /// The named parameters of a chosen hypothesis with their 95 % intervals.
    ///
    /// By instruments from the joint covariance; else coefficients from that of the fit and knobs from the curvature of the profile likelihood.
    /// All carry the form's systematic floor.
    pub fn named(&self, chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<CauseParameter> {
        let c = &chosen[position];
        let h = &self.hypotheses[c.hypothesis];
        let values = (h.form.naming)(&c.knobs, self.coefficients(stand, position));
        let numbers = |knobs: &[f64], coefficients: &[f64]| -> Vec<f64> {
            (h.form.naming)(knobs, coefficients).into_iter().map(|(_, v)| if let Value::Number(x) = v { x } else { 0.0 }).collect()
        };
        let joint = stand.fit.joint.is_some();
        let mut variance = self.variances(chosen, stand, position, joint, &numbers);
        if !joint {
            for knob in self.profiles(chosen, stand, position) {
                let [a, b] = [&knob.up, &knob.down].map(|(knobs, coefficients)| numbers(knobs, coefficients));
                variance.iter_mut().zip(a.iter().zip(&b)).for_each(|(v, (a, b))| *v += ((a - b) / (2.0 * knob.step)).powi(2) * knob.variance);
            }
        }
        let (at_an_end, keep_sign) = (self.at_an_end(chosen, stand, position), self.of_one_sign(chosen, stand, position));
        values
            .into_iter()
            .zip(variance.into_iter().zip(at_an_end.into_iter().zip(keep_sign)))
            .map(|((name, value), (variance, (at_an_end, keeps_sign)))| {
                let card = h.effect.card.parameters.iter().find(|p| p.name == name);
                let unit = card.map_or("", |p| if self.scale.rotational { p.rotational_unit } else { p.unit });
                let ci95 = match value {
                    Value::Number(x) if variance > 0.0 && variance.is_finite() && !at_an_end => {
                        let half = 1.96 * variance.sqrt().hypot(h.form.systematic(name, x));
                        let bounds = card.map_or((f64::NEG_INFINITY, f64::INFINITY), |p| p.bounds);
                        Some(interval(x, half, if keeps_sign { of_one_sign(x, bounds) } else { bounds }))
                    }
                    _ => None,
                };
                let name = if self.scale.rotational { rotational_name(name) } else { name.to_owned() };
                CauseParameter { name, unit: unit.to_owned(), value, ci95 }
            })
            .collect()
    }

    /// Which parameters follow a knob that rests at an end of the range that is searched: such a value is a bound, and no estimate.
    pub fn at_an_end(&self, chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<bool> {
        let form = &self.hypotheses[chosen[position].hypothesis].form;
        let (knobs, coefficients) = (&chosen[position].knobs, self.coefficients(stand, position));
        let inside: Vec<f64> = form.knobs.iter().zip(knobs).map(|(knob, value)| inside_of(knob, *value).unwrap_or(*value)).collect();
        (form.naming)(knobs, coefficients).iter().zip((form.naming)(&inside, coefficients)).map(|(own, inside)| *own != inside).collect()
    }

    /// Which parameters vanish with a coefficient that may have one sign alone, and so have one sign themselves.
    fn of_one_sign(&self, chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<bool> {
        let form = &self.hypotheses[chosen[position].hypothesis].form;
        let (knobs, coefficients) = (&chosen[position].knobs, self.coefficients(stand, position));
        let without = |q: usize| {
            let mut fewer = coefficients.to_vec();
            fewer[q] = 0.0;
            (form.naming)(knobs, &fewer)
        };
        let signed: Vec<_> = form.signs.iter().enumerate().filter(|(_, sign)| **sign != Sign::Free).map(|(q, _)| without(q)).collect();
        let own = (form.naming)(knobs, coefficients);
        (0..own.len()).map(|k| signed.iter().any(|fewer| fewer[k] != own[k] && fewer[k].1 == Value::Number(0.0))).collect()
    }

    /// Whether a coefficient has, beyond doubt (two standard errors), the sign that its form forbids: what else was chosen when the search found it kept it from that.
    pub fn has_a_forbidden_sign(&self, chosen: &[Chosen], stand: &Stand, position: usize) -> bool {
        let signs = &self.hypotheses[chosen[position].hypothesis].form.signs;
        let (covariance, first) = (stand.fit.covariance(), stand.base.columns.len() + stand.spans[position].0);
        self.coefficients(stand, position).iter().zip(signs).enumerate().any(|(k, (value, sign))| {
            let doubt = 2.0 * covariance.at(first + k, first + k).sqrt();
            match sign {
                Sign::Positive => value + doubt < 0.0,
                Sign::Negative => value - doubt > 0.0,
                Sign::Free => false,
            }
        })
    }

    /// The numbers of a chosen hypothesis with their standard errors while its knobs stay: whether what they are the size of is there at all.
    pub fn beside_knobs(&self, chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<(&'static str, f64, f64)> {
        let naming = &self.hypotheses[chosen[position].hypothesis].form.naming;
        let told = |knobs: &[f64], coefficients: &[f64]| -> Vec<(&'static str, f64)> {
            naming(knobs, coefficients).into_iter().filter_map(|(name, v)| if let Value::Number(x) = v { Some((name, x)) } else { None }).collect()
        };
        let numbers = |knobs: &[f64], coefficients: &[f64]| told(knobs, coefficients).into_iter().map(|(_, x)| x).collect::<Vec<_>>();
        let variances = self.variances(chosen, stand, position, false, &numbers);
        let values = told(&chosen[position].knobs, self.coefficients(stand, position));
        values.into_iter().zip(variances).map(|((name, value), variance)| (name, value, variance.sqrt())).collect()
    }

    /// Variances from the covariance of the coefficients, and of the knobs where it is known.
    fn variances(&self, chosen: &[Chosen], stand: &Stand, position: usize, joint: bool, numbers: &Numbers<'_>) -> Vec<f64> {
        let (knobs, coefficients) = (&chosen[position].knobs, self.coefficients(stand, position));
        let covariance = stand.fit.covariance();
        let first = stand.base.columns.len() + stand.spans[position].0;
        let before = stand.fit.theta.len() + chosen[..position].iter().map(|c| c.knobs.len()).sum::<usize>();
        let places: Vec<usize> = (first..first + coefficients.len()).chain(before..before + if joint { knobs.len() } else { 0 }).collect();
        let slope = |q: usize| -> Vec<f64> {
            let step = 1e-4 * covariance.at(places[q], places[q]).sqrt();
            let moved = |sign: f64| {
                let (mut knobs, mut coefficients) = (knobs.clone(), coefficients.to_vec());
                let value = if q < coefficients.len() { &mut coefficients[q] } else { &mut knobs[q - coefficients.len()] };
                *value += sign * step;
                numbers(&knobs, &coefficients)
            };
            moved(1.0).iter().zip(moved(-1.0)).map(|(up, down)| (up - down) / (2.0 * step)).collect()
        };
        let slopes: Vec<Vec<f64>> = (0..places.len()).map(slope).collect();
        let with = |value: usize, p: usize, a: &[f64]| -> f64 { slopes.iter().zip(&places).map(|(b, q)| a[value] * b[value] * covariance.at(p, *q)).sum() };
        let variance = |value: usize| -> f64 { slopes.iter().zip(&places).map(|(a, p)| with(value, *p, a)).sum() };
        (0..numbers(knobs, coefficients).len()).map(variance).collect()
    }

    /// The profile likelihood of each knob of a chosen hypothesis.
    pub fn profiles(&self, chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<Profile> {
        let c = &chosen[position];
        let h = relaxed(&self.hypotheses[c.hypothesis]);
        let others = but(chosen, position);
        let Some(rest) = (if c.knobs.is_empty() { None } else { self.stand(&others, &stand.fit.power, 1) }) else { return Vec::new() };
        let ground = Ground { power: &stand.fit.power, ..self.ground(&rest) };
        let Some(middle) = ground.evaluate(&h, &c.knobs, 1) else { return Vec::new() };
        let one = |(k, knob): (usize, &Knob)| -> Option<Profile> {
            let step = if knob.log { 0.03 * c.knobs[k] } else { 0.01 * (knob.hi - knob.lo) };
            let moved = |sign: f64| -> Option<(Vec<f64>, Tried)> {
                let mut knobs = c.knobs.clone();
                knobs[k] += sign * step;
                ground.evaluate(&h, &knobs, 1).map(|t| (knobs, t))
            };
            let (up, down) = (moved(1.0)?, moved(-1.0)?);
            let curvature = (2.0 * middle.fit.log_likelihood - up.1.fit.log_likelihood - down.1.fit.log_likelihood) / (step * step);
            let variance = if curvature > 0.0 { 1.0 / (curvature * INDEPENDENCE) } else { 4.0 * step * step };
            Some(Profile { up: (up.0, up.1.coefficients), down: (down.0, down.1.coefficients), step, variance })
        };
        self.hypotheses[c.hypothesis].form.knobs.iter().enumerate().filter_map(one).collect()
    }
}

/// A knob of a chosen hypothesis on either side of its best value.
pub(crate) struct Profile {
    /// Knobs and the coefficients that are best there.
    pub up: (Vec<f64>, Vec<f64>),
    pub down: (Vec<f64>, Vec<f64>),
    /// How far the knob was moved.
    pub step: f64,
    /// The knob's variance, by the curvature of the likelihood.
    pub variance: f64,
}

/// Bounds that keep the sign of a number.
fn of_one_sign(x: f64, (lo, hi): (f64, f64)) -> (f64, f64) {
    if x > 0.0 { (lo.max(0.0), hi) } else { (lo, hi.min(0.0)) }
}

/// An interval of half this width, which ends where what the number may be ends. One of a number that has to be above zero, and would reach its bound, goes by
/// the ratio to it.
fn interval(x: f64, half: f64, (lo, hi): (f64, f64)) -> [f64; 2] {
    let [low, high] = if lo > 0.0 && x - half < lo { [-half, half].map(|half| x * (half / x).exp()) } else { [x - half, x + half] };
    // The search may have gone further than bounds that make sense.
    [low.max(lo.min(x)), high.min(hi.max(x))]
}

/// The numbers that knobs and coefficients are told as.
type Numbers<'a> = dyn Fn(&[f64], &[f64]) -> Vec<f64> + 'a;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{known, linear};
    use crate::{LinearFit, Options};
    use ndarray::Array2;
    use ndof_challenge::Plant;
    use ndof_models::{Axis, InertiaDampingStiffness};

    #[test]
    fn an_interval_ends_where_its_parameter_does() {
        assert_eq!(interval(2.0, 0.5, (0.0, 10.0)), [1.5, 2.5]);
        assert_eq!(interval(0.2, 0.5, (0.0, 10.0)), [0.0, 0.7]);
        assert_eq!(interval(9.8, 0.5, (0.0, 10.0)), [9.3, 10.0]);
        let by_ratio = interval(14.0, 17.0, (1e-6, 1e6));
        assert!((by_ratio[0] * by_ratio[1] / 196.0 - 1.0).abs() < 1e-12 && ((by_ratio[1] / 14.0).ln() * 14.0 / 17.0 - 1.0).abs() < 1e-12, "{by_ratio:?}");
        assert_eq!([of_one_sign(3.0, (-9.0, 9.0)), of_one_sign(-3.0, (-9.0, 9.0))], [(0.0, 9.0), (-9.0, 0.0)]);
    }

    /// The stiffness and the damping of a reflex cannot be below zero, its delay and its muscle's frequency are of no coefficient.
    #[test]
    fn what_vanishes_with_a_coefficient_of_one_sign_has_one() {
        let made = linear(Plant::Planar, (2, 20.0), 61);
        let (samples, meaning) = known(&made, &made.recordings);
        let subject = Subject::new(&samples, &meaning, &Options::default(), None, true).expect("a subject");
        let reflex = subject.hypotheses.iter().position(|h| h.form.label == "both directions").expect("a form");
        let chosen = [Chosen { hypothesis: reflex, knobs: vec![0.04, 3.0] }];
        let stand = subject.stand(&chosen, &subject.start, 4).expect("a fit");
        let signed = subject.of_one_sign(&chosen, &stand, 0);
        let told = subject.named(&chosen, &stand, 0);
        // A coefficient that is at nought itself changes nothing.
        let expected: Vec<bool> = told.iter().map(|p| p.name.contains("_n_") && p.value != Value::Number(0.0)).collect();
        assert_eq!(signed, expected, "{told:?}");
        assert!(signed.contains(&true));
        assert!(told.iter().zip(&signed).filter(|(_, one)| **one).all(|(p, _)| p.ci95.is_none_or(|[low, _]| low >= 0.0)), "{told:?}");
    }

    /// A relaxation time at the end of its range is a bound, and its modulus, which is another number, has an interval.
    #[test]
    fn what_rests_at_an_end_of_its_range_has_no_interval() {
        let made = linear(Plant::Planar, (2, 20.0), 61);
        let (samples, meaning) = known(&made, &made.recordings);
        let subject = Subject::new(&samples, &meaning, &Options::default(), None, true).expect("a subject");
        let relaxing = subject.hypotheses.iter().position(|h| h.form.label == "standard linear solid").expect("a form");
        let knob = subject.hypotheses[relaxing].form.knobs[0];
        let told = |value: f64| {
            let chosen = [Chosen { hypothesis: relaxing, knobs: vec![value] }];
            let stand = subject.stand(&chosen, &subject.start, 4).expect("a fit");
            subject.named(&chosen, &stand, 0).into_iter().map(|p| (p.name, p.ci95.is_some())).collect::<Vec<_>>()
        };
        let of = |time: bool| [("modulus_n_per_m".to_owned(), true), ("time_s".to_owned(), time)];
        assert_eq!(told(knob.lo), of(false));
        assert_eq!(told((knob.lo * knob.hi).sqrt()), of(true));
    }

    /// What turns is added to one entry and taken from its mirror image: both have its error, beside that of the symmetric part, which they share.
    #[test]
    fn an_entry_is_made_of_the_baselines_own_and_of_what_causes_change() {
        let made = linear(Plant::Planar, (2, 20.0), 61);
        let (samples, meaning) = known(&made, &made.recordings);
        let of = |rows: &[Vec<f64>]| Array2::from_shape_fn((2, 2), |(i, j)| 0.5 * (rows[i][j] + rows[j][i]));
        let axes = vec![Axis::linear("x"), Axis::linear("y")];
        let matrices = InertiaDampingStiffness { axes, inertia: of(&made.mass), damping: of(&made.damping), stiffness: of(&made.stiffness) };
        let fit = LinearFit { std_errors: matrices.clone(), matrices, of_sign: 1e-3, hold: None, ticks: None };
        let subject = Subject::new(&samples, &meaning, &Options { linear: Some(fit), ..Options::default() }, None, true).expect("a subject");
        let turning = subject.hypotheses.iter().position(|h| h.form.label == "turning stiffness").expect("of symmetric matrices");
        let chosen = [Chosen { hypothesis: turning, knobs: vec![] }];
        let stand = subject.stand(&chosen, &subject.start, 4).expect("a fit");
        let own = stand.base.entry(Matrix::Stiffness, 0, 1).expect("a stiffness");
        assert_eq!(stand.base.entry(Matrix::Stiffness, 1, 0), Some(own));
        let turns = stand.base.columns.len() + stand.spans[0].0;
        let parts = |i, j| subject.parts_of(&chosen, &stand, (Matrix::Stiffness, i, j));
        assert_eq!((parts(0, 1), parts(1, 0), parts(0, 0).len()), (vec![(own, 1.0), (turns, 1.0)], vec![(own, 1.0), (turns, -1.0)], 1));
        let matrix = subject.matrix(&chosen, &stand, Matrix::Stiffness);
        let made_of = |i: usize, j: usize| parts(i, j).iter().map(|(k, weight)| weight * stand.fit.theta[*k]).sum::<f64>();
        assert!((0..4).all(|k| (matrix[k / 2][k % 2] - made_of(k / 2, k % 2)).abs() < 1e-9 * matrix[0][0]));
    }
}
