//! The parameters of a final model in time: the free run that makes what was measured most likely.
//!
//! y − ŷ(θ) is the free run's error over the fitted part, on the blocks and lines of the search. D₀, the inertia, damping and stiffness that the balance
//! of forces found, and T, from the measured channel to the displacement, carry it to the forces that would have caused it, e = D₀ T (y − ŷ), so that
//! the noise of each force stays on its axis. With S the smoothed power of e, D the model's dynamics, and G what the search's determinant is of,
//!
//! LL = 0.9 Σ [−ln S − |e|²/S + 2 ln |det D₀| + 2 ln |det G| − 2 ln |det D|]
//!
//! is a density of the same samples as that of the balance of forces, and is equal to it for a linear model, but for what the balance grants instruments
//! within their tolerance: that is told from the balance, and would bring its bias along. Laws of the balance follow the measured
//! motion, with the noise of its sensor; those of a free run follow its own, without what the limb does by itself. Which noise is the larger the
//! likelihood says, and its parameters are taken.

use crate::linear::Symmetric;
use crate::plant::{Dynamics, Role};
use crate::search::{Assembly, Chosen, Stand};
use crate::state::{Cause, Column, State};
use crate::subject::Subject;
use crate::whittle::{INDEPENDENCE, Likelihood, Power};
use ndof_linear::square;
use num_complex::Complex64;
use rayon::prelude::*;

/// Steps of Gauss and Newton at most.
const STEPS: usize = 12;
/// A step shorter than this share of each standard error is the last.
const STILL: f64 = 0.05;
/// Step of a coefficient's derivative, in standard errors, and of a knob's, as a share of it or of its range.
const MOVED: (f64, f64) = (0.1, 1e-3);
/// What the run does not feel stays within so many steps of a derivative.
const FAR: f64 = 1e3;
/// Halvings of a step that does not help.
const HALVINGS: usize = 6;

/// A parameter: a coefficient, or a knob of a chosen hypothesis.
#[derive(Clone, Copy)]
enum Place {
    Coefficient(usize),
    Knob(usize, usize),
}

/// The values of all coefficients and knobs.
#[derive(Clone)]
struct Point {
    theta: Vec<f64>,
    chosen: Vec<Chosen>,
}

impl Point {
    fn value(&mut self, place: Place) -> &mut f64 {
        match place {
            Place::Coefficient(k) => &mut self.theta[k],
            Place::Knob(q, k) => &mut self.chosen[q].knobs[k],
        }
    }

    /// Moved by so much in some places.
    fn moved(&self, by: impl Iterator<Item = (Place, f64)>) -> Point {
        let mut point = self.clone();
        by.for_each(|(place, step)| *point.value(place) += step);
        point
    }
}

/// A point with its likelihood.
struct Run {
    point: Point,
    /// Spectra of the error as a force, `[axis]`.
    error: Vec<Vec<Complex64>>,
    power: Power,
    log_likelihood: f64,
}

/// A model whose free runs are compared with the fitted part.
struct InTime<'a> {
    subject: &'a Subject,
    stand: &'a Stand,
    /// The channels as they were measured.
    raw: State,
    /// How many times the displacement is differentiated to what was measured.
    order: usize,
    /// D₀: inertia, damping and stiffness.
    dynamics: Dynamics,
    /// 2 Σ ln |det D₀|.
    determinant: f64,
}

impl Subject {
    /// A model with the parameters of its most likely free run, if that is more likely than the balance of forces with its own; `order` derivatives of
    /// the displacement were measured. `None` where the motion is imposed, where it has parameters that follow a schedule, or where it does not run.
    pub fn in_time(&self, chosen: &[Chosen], stand: &Stand, order: usize) -> Option<(Vec<Chosen>, Stand)> {
        if !self.runs() {
            return None;
        }
        let model = InTime::new(self, stand, order)?;
        let (run, covariance) = model.most_likely(Point { theta: stand.fit.theta.clone(), chosen: chosen.to_vec() })?;
        let balance = self.of_balance(stand);
        (run.log_likelihood > balance?).then(|| self.with(stand, run.point, run.log_likelihood, covariance))
    }

    /// Log-likelihood of the free runs of a model with the parameters of a stand; `None` where [`Self::in_time`] has none.
    pub fn likelihood_in_time(&self, chosen: &[Chosen], stand: &Stand, order: usize) -> Option<f64> {
        if !self.runs() {
            return None;
        }
        let run = InTime::new(self, stand, order)?.run(Point { theta: stand.fit.theta.clone(), chosen: chosen.to_vec() })?;
        Some(run.log_likelihood)
    }

    /// Whether a free run from the effort alone says anything: the effort makes the motion, and no parameter follows a schedule.
    fn runs(&self) -> bool {
        !matches!(self.cause, Cause::Motion | Cause::Unclear) && self.layout.schedule.is_empty()
    }

    /// Log-likelihood of the balance of forces on the measured channels with the parameters of a stand.
    fn of_balance(&self, stand: &Stand) -> Option<f64> {
        let columns: Vec<&Column> = stand.columns().collect();
        let likelihood = Likelihood::new(&stand.state, &self.cause, &stand.base.held);
        let power = likelihood.power(&stand.fit.residual);
        let log_det: f64 = likelihood.log_determinant(&columns, &stand.fit.theta)?;
        Some(INDEPENDENCE * (likelihood.gaussian(&stand.fit.residual, &power) + 2.0 * log_det * self.layout.blocks() as f64))
    }

    /// A stand with other parameters.
    fn with(&self, stand: &Stand, point: Point, log_likelihood: f64, covariance: Symmetric) -> (Vec<Chosen>, Stand) {
        let model = self.assemble(&stand.base.structure, &point.chosen, self.own());
        let mut fit = stand.fit.clone();
        (fit.theta, fit.joint) = (point.theta, Some(covariance));
        (point.chosen, Stand { state: model.state, base: model.base, terms: model.terms, spans: model.spans, fit, run: Some(log_likelihood) })
    }
}

impl<'a> InTime<'a> {
    /// `None` where the balance's dynamics are singular at a line.
    fn new(subject: &'a Subject, stand: &'a Stand, order: usize) -> Option<Self> {
        let (layout, n) = (&subject.layout, subject.layout.axes);
        let dynamics = stand.base.dynamics(&stand.fit.theta, n);
        let raw = State::new(layout, &subject.effort, &subject.motion, &subject.centre, &[]);
        let mut model = InTime { subject, stand, raw, order, dynamics, determinant: 0.0 };
        let (mut d, mut inverse) = (vec![Complex64::ZERO; n * n], vec![Complex64::ZERO; n * n]);
        for (s, _) in layout.sj.iter().zip(&layout.keep).filter(|(_, keep)| **keep) {
            d.iter_mut().enumerate().for_each(|(k, d)| *d = model.dynamics.entry(k / n, k % n, *s));
            model.determinant += 2.0 * layout.blocks() as f64 * square::invert_into(&mut d, &mut inverse, n)?;
        }
        Some(model)
    }

    /// The forces D₀ T e that would have caused the errors of a run, `[axis][time]`.
    fn forces(&self, error: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let layout = &self.subject.layout;
        let tracks: Vec<_> = error.iter().map(|e| layout.track_of(e)).collect();
        let force = |i: usize| {
            let mut force = vec![0.0; layout.samples];
            for (j, track) in tracks.iter().enumerate() {
                // What was integrated has no mean.
                let operator = |s: Complex64| if self.order > 0 && s.norm() == 0.0 { s } else { self.dynamics.entry(i, j, s) / s.powi(self.order as i32) };
                force.iter_mut().zip(layout.filtered(track, operator, None)).for_each(|(sum, f)| *sum += f);
            }
            force
        };
        (0..layout.axes).map(force).collect()
    }

    /// The maximum of the likelihood from a start, and the covariance of all coefficients and knobs there.
    fn most_likely(&self, start: Point) -> Option<(Run, Symmetric)> {
        let places = self.places(&start);
        let steps: Vec<f64> = places.iter().map(|place| self.step(&start, *place)).collect();
        let damping: Vec<f64> = steps.iter().map(|step| 0.5 * (FAR * step).powi(-2)).collect();
        let mut now = self.run(start)?;
        let mut covariance = None;
        for _ in 0..STEPS {
            let slopes: Vec<Vec<Complex64>> = places.par_iter().zip(&steps).map(|(place, step)| self.slope(&now, *place, *step)).collect::<Option<_>>()?;
            let pull = self.pull(&now.point, &places, &steps)?;
            let (step, spread) = self.subject.step_and_covariance(&slopes, &slopes, &now.error.concat(), (&damping, &pull), &now.power)?;
            let still = step.iter().enumerate().all(|(k, d)| d.abs() <= STILL * spread.at(k, k).sqrt());
            covariance = Some(self.whole(&now.point, &places, &spread));
            if still {
                break;
            }
            let shortened = (0..HALVINGS as i32).map(|halvings| now.point.moved(places.iter().copied().zip(step.iter().map(|d| d * 0.5_f64.powi(halvings)))));
            let mut better = shortened.filter_map(|point| self.run(point)).filter(|run| run.log_likelihood > now.log_likelihood);
            let Some(next) = better.next() else { break };
            now = next;
        }
        Some((now, covariance?))
    }

    /// Entries of matrices, coefficients and knobs; a constant is taken off each run, so that it does not feel an offset.
    fn places(&self, point: &Point) -> Vec<Place> {
        let base = &self.stand.base;
        let entries = base.roles.iter().enumerate().filter(|(_, role)| matches!(role, Role::Entry(..))).map(|(k, _)| k);
        let coefficients = entries.chain(base.columns.len()..point.theta.len()).map(Place::Coefficient);
        coefficients.chain(point.chosen.iter().enumerate().flat_map(|(q, c)| (0..c.knobs.len()).map(move |k| Place::Knob(q, k)))).collect()
    }

    fn step(&self, point: &Point, place: Place) -> f64 {
        match place {
            Place::Coefficient(k) => MOVED.0 * self.stand.fit.covariance().at(k, k).sqrt(),
            Place::Knob(q, k) => {
                let knob = &self.subject.hypotheses[point.chosen[q].hypothesis].form.knobs[k];
                MOVED.1 * if knob.log { point.chosen[q].knobs[k] } else { knob.hi - knob.lo }
            }
        }
    }

    /// −∂e.
    fn slope(&self, at: &Run, place: Place, step: f64) -> Option<Vec<Complex64>> {
        let [up, down] = [step, -step].map(|step| self.error(&at.point.moved(std::iter::once((place, step)))));
        Some(down?.concat().iter().zip(up?.concat()).map(|(d, u)| (d - u) / (2.0 * step)).collect())
    }

    /// Half the derivatives of what determinants add to the likelihood, as those of −|e|²/S are twice what the equations have.
    fn pull(&self, at: &Point, places: &[Place], steps: &[f64]) -> Option<Vec<f64>> {
        let own = self.assembly(at);
        let side = |place: Place, step: f64| {
            let point = at.moved(std::iter::once((place, step)));
            match (place, &own) {
                (Place::Coefficient(_), Some(own)) => self.of_loop(own, &point.theta),
                _ => self.determinants(&point),
            }
        };
        places.iter().zip(steps).map(|(place, step)| Some((side(*place, *step)? - side(*place, -step)?) / (4.0 * step))).collect()
    }

    /// The run of a point; `None` where that is out of bounds, or does not stay finite.
    fn run(&self, point: Point) -> Option<Run> {
        let (subject, stand) = (self.subject, self.stand);
        let admitted = point.chosen.iter().zip(&stand.spans).all(|(c, (first, count))| {
            let from = stand.base.columns.len() + first;
            subject.hypotheses[c.hypothesis].form.admits(&c.knobs, &point.theta[from..from + count])
        });
        let error = if admitted { self.error(&point)? } else { return None };
        let likelihood = Likelihood::new(&stand.state, &subject.cause, &stand.base.held);
        let power = likelihood.power(&error);
        let log_likelihood = INDEPENDENCE * (likelihood.gaussian(&error, &power) + self.determinants(&point)?);
        log_likelihood.is_finite().then_some(Run { point, error, power, log_likelihood })
    }

    /// 2 Σ ln |det D₀| + 2 Σ ln |det G| − 2 Σ ln |det D|.
    fn determinants(&self, point: &Point) -> Option<f64> {
        let of_loop = self.assembly(point).map_or(Some(0.0), |model| self.of_loop(&model, &point.theta))?;
        Some(of_loop + self.determinant)
    }

    /// The columns of a point where a robot closes the loop; elsewhere G is D.
    fn assembly(&self, point: &Point) -> Option<Assembly> {
        let closed = matches!(self.subject.cause, Cause::Loop(_));
        closed.then(|| self.subject.assemble(&self.stand.base.structure, &point.chosen, self.subject.own()))
    }

    fn of_loop(&self, model: &Assembly, theta: &[f64]) -> Option<f64> {
        let columns: Vec<&Column> = model.columns().collect();
        let of = |cause: &Cause| Likelihood::new(&model.state, cause, &model.base.held).log_determinant(&columns, theta);
        Some(2.0 * self.subject.layout.blocks() as f64 * (of(&self.subject.cause)? - of(&Cause::Effort)?))
    }

    /// Spectra of what the free run misses, as forces, `[axis]`; what its initial state is fitted to does not count.
    fn error(&self, point: &Point) -> Option<Vec<Vec<Complex64>>> {
        let (subject, layout) = (self.subject, &self.subject.layout);
        let mut stand = self.stand.clone();
        stand.fit.theta.clone_from(&point.theta);
        let corrections: Vec<_> = point.chosen.iter().filter(|c| subject.hypotheses[c.hypothesis].corrects()).collect();
        if !corrections.is_empty() {
            let transforms: Vec<_> = corrections.into_iter().map(|c| subject.hypotheses[c.hypothesis].transform(&c.knobs)).collect();
            stand.state = State::new(layout, &subject.effort, &subject.motion, &subject.centre, &transforms);
        }
        let runner = subject.runner(&point.chosen, &stand);
        let settled = layout.settled();
        let mut errors: Vec<Vec<Vec<f64>>> = vec![Vec::new(); layout.axes];
        for trial in 0..layout.trials {
            let run = runner.predict(&self.raw, &stand.state, trial, self.order, false, false)?;
            let missed: Vec<Vec<f64>> = run.measured.iter().zip(&run.predicted).map(|(m, p)| m.iter().zip(p).map(|(m, p)| m - p).collect()).collect();
            for (errors, mut force) in errors.iter_mut().zip(self.forces(&missed)) {
                force[..settled].fill(0.0);
                errors.push(force);
            }
        }
        let mut spectra: Vec<_> = errors.iter().map(|trials| layout.spectra(trials.iter().map(Vec::as_slice))).collect();
        // The first block of each trial lacks the power of what does not count.
        let (first, scale) = (layout.starts.len() * layout.lines(), layout.behind(settled).sqrt().recip());
        spectra.iter_mut().flat_map(|s| s.chunks_mut(first)).flat_map(|trial| &mut trial[..layout.lines()]).for_each(|e| *e *= scale);
        spectra.iter().flatten().all(|e| e.is_finite()).then_some(spectra)
    }

    /// The covariance of all coefficients and then knobs: what no run was asked about keeps the variance that it had.
    fn whole(&self, point: &Point, places: &[Place], spread: &Symmetric) -> Symmetric {
        let (before, count) = (self.stand.fit.covariance(), point.theta.len());
        let knobs = |until: usize| point.chosen[..until].iter().map(|c| c.knobs.len()).sum::<usize>();
        let index = |place: &Place| match *place {
            Place::Coefficient(k) => k,
            Place::Knob(q, k) => count + knobs(q) + k,
        };
        let mut all = Symmetric::zeros(count + knobs(point.chosen.len()));
        let asked: Vec<usize> = places.iter().map(index).collect();
        (0..count).filter(|k| !asked.contains(k)).for_each(|k| all.add(k, k, before.at(k, k)));
        for (a, i) in asked.iter().enumerate() {
            asked[..=a].iter().enumerate().for_each(|(b, j)| all.add(*i, *j, spread.at(a, b)));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{baseline, known, linear};
    use ndof_challenge::Plant;

    fn fitted(plant: Plant) -> (Subject, Stand, usize) {
        let made = linear(plant, (2, 40.0), 61);
        let (samples, meaning) = known(&made, &made.recordings);
        let (subject, stand) = baseline(&samples, &meaning);
        (subject, stand, meaning.order)
    }

    /// Without a nonlinear law e is the balance's residual, but for what instruments may do within their tolerance.
    #[test]
    fn both_likelihoods_of_a_linear_model_are_one() {
        for plant in [Plant::Force, Plant::Planar] {
            let (subject, stand, order) = fitted(plant);
            let model = InTime::new(&subject, &stand, order).expect("dynamics");
            let run = model.run(Point { theta: stand.fit.theta.clone(), chosen: vec![] }).expect("a run");
            let balance = subject.of_balance(&stand).expect("a likelihood");
            let lines = (subject.layout.size() * subject.layout.axes) as f64;
            assert!((run.log_likelihood - balance).abs() < 0.1 * lines, "{plant:?}: {} and {balance} of {lines} lines", run.log_likelihood);
        }
    }

    /// Twice what the equations of Gauss and Newton have on their right is the slope of the likelihood, the loop's determinants in it.
    #[test]
    fn the_equations_are_the_slope_of_the_likelihood() {
        let (subject, stand, order) = fitted(Plant::Planar);
        let model = InTime::new(&subject, &stand, order).expect("dynamics");
        let start = Point { theta: stand.fit.theta.clone(), chosen: vec![] };
        let places = model.places(&start);
        let steps: Vec<f64> = places.iter().map(|place| 10.0 * model.step(&start, *place)).collect();
        let run = model.run(start).expect("a run");
        let pull = model.pull(&run.point, &places, &steps).expect("derivatives");
        let size = subject.layout.size();
        for ((place, step), pull) in places.iter().zip(&steps).zip(&pull) {
            let slope = model.slope(&run, *place, *step).expect("a slope");
            let fit: f64 =
                (0..slope.len()).map(|q| (slope[q].conj() * run.error[q / size][q % size]).re / run.power[q / size][q % subject.layout.lines()]).sum();
            let [up, down] = [*step, -*step].map(|step| model.run(run.point.moved(std::iter::once((*place, step)))).expect("a run").log_likelihood);
            let (found, told) = ((up - down) / (2.0 * step), 2.0 * INDEPENDENCE * (fit + pull));
            // The smoothing of S is in the one and not in the other; a step is a standard error.
            assert!((found - told).abs() < 0.05 * found.abs() + 0.2 / step, "{found} and {told}");
        }
    }
}
