//! One hypothesis tried on the balance of forces.

use crate::optimise;
use crate::plant::{Base, Structure};
use crate::state::{Cause, Column, Entry, State, Transform};
use crate::whittle::{Fit, Likelihood, Power};
use ndof_models::effects::{Action, EFFECTS, Effect, Form, Scale};
use num_complex::Complex64;
use std::sync::{Arc, OnceLock};

/// A form of an effect at a site.
pub(crate) struct Hypothesis {
    pub effect: &'static dyn Effect,
    pub form: Form,
}

impl Hypothesis {
    /// Every form that the registry and the `own` effects offer at this scale, except of the effects in `without`.
    pub fn all(scale: &Scale, own: &[&'static dyn Effect], without: &[String]) -> Vec<Hypothesis> {
        EFFECTS
            .iter()
            .chain(own)
            .copied()
            .filter(|effect| !without.iter().any(|w| w == effect.name()))
            .flat_map(|effect| effect.forms(scale).into_iter().map(move |form| Hypothesis { effect, form }))
            .collect()
    }

    /// Whether it corrects channels (and does not add a force).
    pub fn corrects(&self) -> bool {
        !matches!(self.form.action, Action::Force { .. } | Action::Scheduled(_) | Action::Entries { .. })
    }

    /// The transform with these knobs.
    pub fn transform(&self, knobs: &[f64]) -> Transform {
        Transform { action: self.form.action.clone(), axis: self.form.axis, knobs: knobs.to_vec() }
    }

    /// One column for each coefficient.
    pub fn columns(&self, state: &State, knobs: &[f64]) -> Vec<Column> {
        match &self.form.action {
            Action::Entries { matrix, entries } => vec![state.entries_column(*matrix, entries)],
            Action::Force { exact, .. } if !exact.is_empty() => {
                let axis = self.form.axis.unwrap_or(0);
                exact.iter().map(|operator| state.operator_column(axis, |s| operator(s, knobs))).collect()
            }
            Action::Force { law, tangent, .. } => (0..self.form.signs.len())
                .map(|j| {
                    let unit: Vec<f64> = (0..self.form.signs.len()).map(|k| if k == j { 1.0 } else { 0.0 }).collect();
                    let forces = state.forces(law(knobs, &unit).as_ref());
                    let linear: Option<Vec<Entry>> = tangent.as_ref().zip(self.form.axis).map(|(t, axis)| {
                        let h: Vec<Complex64> = state.layout.sj.iter().map(|&s| t(s, knobs)).collect();
                        vec![(axis, axis, Arc::new(h))]
                    });
                    state.force_column(&forces, linear, self.form.axis)
                })
                .collect(),
            Action::Scheduled(of) => (0..self.form.signs.len())
                .map(|j| {
                    let unit: Vec<f64> = (0..self.form.signs.len()).map(|k| if k == j { 1.0 } else { 0.0 }).collect();
                    state.force_column(&state.forces(of.law(&unit).as_ref()), None, self.form.axis)
                })
                .collect(),
            _ => Vec::new(),
        }
    }

    /// Whether it holds a curve of an entry that another one has a curve of, finer or coarser.
    pub fn repeats(&self, other: &Hypothesis) -> bool {
        match (&self.form.action, &other.form.action) {
            (Action::Scheduled(a), Action::Scheduled(b)) => a.matrix == b.matrix && a.entries.iter().any(|entry| b.entries.contains(entry)),
            _ => false,
        }
    }
}

/// Columns on the points of every hypothesis' grid, for channels that nothing has corrected; filled where first needed.
pub(crate) struct Cache(Vec<Vec<OnceLock<Vec<Column>>>>);

impl Cache {
    pub fn new(hypotheses: &[Hypothesis]) -> Self {
        Cache(hypotheses.iter().map(|h| h.form.grid.iter().map(|_| OnceLock::new()).collect()).collect())
    }
}

/// What all hypotheses of a step are added to.
pub(crate) struct Ground<'a> {
    pub state: &'a State,
    pub cause: &'a Cause,
    pub structure: &'a Structure,
    pub base: &'a Base,
    /// Columns of the causes that were named before.
    pub terms: &'a [Column],
    /// Power of what the model so far leaves.
    pub power: &'a Power,
}

/// A hypothesis with its best knobs.
#[derive(Clone)]
pub(crate) struct Tried {
    pub knobs: Vec<f64>,
    pub coefficients: Vec<f64>,
    pub fit: Fit,
}

impl Ground<'_> {
    /// The fit without any hypothesis.
    pub fn fit(&self, rounds: usize) -> Option<Fit> {
        let columns: Vec<&Column> = self.base.columns.iter().chain(self.terms).collect();
        Likelihood::new(self.state, self.cause, &self.base.held).fit(&columns, self.power, rounds, true)
    }

    /// The fit of a hypothesis at given knobs; `None` where it cannot be computed or makes no sense.
    pub fn evaluate(&self, hypothesis: &Hypothesis, knobs: &[f64], rounds: usize) -> Option<Tried> {
        if hypothesis.corrects() {
            let state = self.state.with(&hypothesis.transform(knobs));
            let base = Base::new(&state, self.cause, self.structure);
            let columns: Vec<&Column> = base.columns.iter().chain(self.terms).collect();
            let fit = Likelihood::new(&state, self.cause, &base.held).fit(&columns, self.power, rounds, true)?;
            return hypothesis.form.admits(knobs, &[]).then(|| Tried { knobs: knobs.to_vec(), coefficients: vec![], fit });
        }
        self.add(hypothesis, knobs, &hypothesis.columns(self.state, knobs), rounds)
    }

    /// The fit with the columns of a hypothesis beside all others.
    fn add(&self, hypothesis: &Hypothesis, knobs: &[f64], extra: &[Column], rounds: usize) -> Option<Tried> {
        let columns: Vec<&Column> = self.base.columns.iter().chain(self.terms).chain(extra).collect();
        let fit = Likelihood::new(self.state, self.cause, &self.base.held).fit(&columns, self.power, rounds, true)?;
        let coefficients = fit.theta[columns.len() - extra.len()..].to_vec();
        hypothesis.form.admits(knobs, &coefficients).then(|| Tried { knobs: knobs.to_vec(), coefficients, fit })
    }

    /// The best point of the grid of hypothesis `number`.
    pub fn screen(&self, hypothesis: &Hypothesis, number: usize, cache: &Cache) -> Option<Tried> {
        let stored = self.state.transforms.is_empty() && !hypothesis.corrects();
        let points = hypothesis.form.grid.iter().zip(&cache.0[number]);
        points
            .filter_map(|(knobs, place)| {
                if stored {
                    return self.add(hypothesis, knobs, place.get_or_init(|| hypothesis.columns(self.state, knobs)), 1);
                }
                self.evaluate(hypothesis, knobs, 1)
            })
            .reduce(|best, next| if next.fit.log_likelihood > best.fit.log_likelihood { next } else { best })
    }

    /// The knobs refined from a start, then S brought to rest.
    pub fn refine(&self, hypothesis: &Hypothesis, start: &Tried, evaluations: usize) -> Option<Tried> {
        let knobs = &hypothesis.form.knobs;
        let best = if knobs.is_empty() {
            start.knobs.clone()
        } else {
            let cost = |point: &[f64]| self.evaluate(hypothesis, point, 1).map_or(f64::INFINITY, |t| -t.fit.log_likelihood);
            optimise::minimise(knobs, &hypothesis.form.grid, &start.knobs, -start.fit.log_likelihood, evaluations, cost)
        };
        let settled = self.evaluate(hypothesis, &best, 3)?;
        if settled.fit.log_likelihood >= start.fit.log_likelihood - 5.0 { Some(settled) } else { Some(start.clone()) }
    }
}
