//! One hypothesis tried on the balance of forces.

use crate::curved::Curved;
use crate::linear::inner;
use crate::optimise;
use crate::plant::Base;
use crate::state::{Cause, Column, Entry, State, Transform};
use crate::whittle::{Fit, Likelihood, Power};
use ndof_models::effects::{Action, CurvedArm, EFFECTS, Effect, Form, Scale};
use num_complex::Complex64;
use std::sync::{Arc, OnceLock};

/// A form of an effect at a site.
pub(crate) struct Hypothesis {
    pub effect: &'static Effect,
    pub form: Form,
}

impl Hypothesis {
    /// Every form that the registry and the `own` effects offer at this scale, except of the effects in `without`.
    pub fn all(scale: &Scale, own: &[&'static Effect], without: &[String]) -> Vec<Hypothesis> {
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
        !matches!(self.form.action, Action::Force { .. } | Action::Scheduled(_) | Action::Reflex(_) | Action::Curved(_) | Action::Entries { .. })
    }

    /// Whether a tolerance of the instruments hides what it removes; there is none for the clock and filter of a single channel.
    pub fn shares_a_tolerance(&self) -> bool {
        self.corrects() && !(self.form.axis.is_some() && matches!(self.form.action, Action::Effort(_) | Action::Mode { .. } | Action::Motion(_)))
    }

    /// The arm along whose curve it lets the matrices of the baseline act.
    pub fn arm(&self) -> Option<&CurvedArm> {
        match &self.form.action {
            Action::Curved(arm) => Some(arm),
            _ => None,
        }
    }

    /// Whether likelihood has valleys over its knobs, as with two of them: it is looked for from every point of its grid. A curve beside them is too dear.
    pub fn bends(&self) -> bool {
        self.form.knobs.len() > 1 && !matches!(self.form.action, Action::Reflex(_))
    }

    /// Whether it is a form of the same effect at the same place.
    pub fn shares_a_site(&self, other: &Hypothesis) -> bool {
        (self.effect.name(), self.form.side, self.form.axis) == (other.effect.name(), other.form.side, other.form.axis)
    }

    /// The transform with these knobs.
    pub fn transform(&self, knobs: &[f64]) -> Transform {
        Transform { action: self.form.action.clone(), axis: self.form.axis, knobs: knobs.to_vec() }
    }

    /// One column for each coefficient.
    pub fn columns(&self, state: &State, knobs: &[f64]) -> Vec<Column> {
        match &self.form.action {
            Action::Entries { matrix, entries } => vec![state.entries_column(*matrix, entries)],
            Action::Curved(arm) => vec![Curved::new(state, arm).coupling_column()],
            action => {
                let mut columns: Vec<Column> = (0..self.form.signs.len()).filter_map(|j| self.law_column(action, state, knobs, j)).collect();
                if let Action::Reflex(_) = action {
                    like_the_mean(&mut columns);
                }
                columns
            }
        }
    }

    /// The column of coefficient `j` of a law along the motion.
    fn law_column(&self, action: &Action, state: &State, knobs: &[f64], j: usize) -> Option<Column> {
        let unit: Vec<f64> = (0..self.form.signs.len()).map(|k| if k == j { 1.0 } else { 0.0 }).collect();
        let law = action.law(knobs, &unit)?;
        let over = |tangent: &dyn Fn(Complex64) -> Complex64| -> Arc<Vec<Complex64>> { Arc::new(state.layout.sj.iter().map(|&s| tangent(s)).collect()) };
        let response = match (action, self.form.axis) {
            (Action::Force { tangent: Some(tangent), .. }, _) => Some(over(&|s| tangent(s, knobs))),
            (Action::Reflex(of), _) if j == 0 => Some(over(&|s| of.tangent(s, knobs))),
            (Action::Force { .. }, Some(axis)) if law.response(Complex64::ONE).is_some() => {
                return Some(state.operator_column(axis, |s| law.response(s).unwrap_or_default()));
            }
            _ => None,
        };
        let linear: Option<Vec<Entry>> = response.zip(self.form.axis).map(|(response, axis)| vec![(axis, axis, response)]);
        Some(state.force_column(&state.forces(law.as_ref()), linear, self.form.axis))
    }

    /// Whether another one's first columns are all of its own.
    fn begins(&self, other: &Hypothesis) -> bool {
        match (&self.form.action, &other.form.action) {
            (Action::Scheduled(a), Action::Scheduled(b)) => a.matrix == b.matrix && a.entries.len() == 1 && a.entries == b.entries,
            (Action::Reflex(a), Action::Reflex(b)) => a.axis == b.axis && a.direction == b.direction,
            _ => false,
        }
    }

    /// Whether it holds a curve of an entry that another one has a curve of, finer or coarser.
    pub fn repeats(&self, other: &Hypothesis) -> bool {
        match (&self.form.action, &other.form.action) {
            (Action::Scheduled(a), Action::Scheduled(b)) => a.matrix == b.matrix && a.entries.iter().any(|entry| b.entries.contains(entry)),
            (Action::Reflex(a), Action::Reflex(b)) => a.axis == b.axis,
            _ => false,
        }
    }
}

/// Gives the waves of a reflex' gain the linear action of its mean, as much as they have of it: what two columns share has to be the same in both, or
/// their difference would be noise that costs nothing.
fn like_the_mean(columns: &mut [Column]) {
    let Some((mean, waves)) = columns.split_first_mut() else { return };
    let Some((_, own)) = mean.parts.first() else { return };
    for wave in waves {
        let share = wave.parts.first().map_or(0.0, |(_, part)| inner(part, own) / inner(own, own));
        wave.action = mean.action.iter().map(|(i, j, h)| (*i, *j, Arc::new(h.iter().map(|h| h * share).collect()))).collect();
    }
}

/// Columns on the points of every hypothesis' grid, for channels that nothing has corrected; filled where first needed.
pub(crate) struct Cache {
    columns: Vec<Vec<OnceLock<Vec<Column>>>>,
    /// For each hypothesis the one whose first columns are its own: curves of fewer waves are part of those of more.
    holder: Vec<usize>,
}

impl Cache {
    pub fn new(hypotheses: &[Hypothesis]) -> Self {
        let largest = |h: &Hypothesis| (0..hypotheses.len()).filter(|&k| h.begins(&hypotheses[k])).max_by_key(|&k| hypotheses[k].form.signs.len());
        Cache {
            columns: hypotheses.iter().map(|h| h.form.grid.iter().map(|_| OnceLock::new()).collect()).collect(),
            holder: hypotheses.iter().enumerate().map(|(own, h)| largest(h).unwrap_or(own)).collect(),
        }
    }
}

/// What all hypotheses of a step are added to.
pub(crate) struct Ground<'a> {
    pub state: &'a State,
    pub cause: &'a Cause,
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
            let base = self.base.under(self.state, &state, self.cause);
            let columns: Vec<&Column> = base.columns.iter().chain(self.terms).collect();
            let fit = Likelihood::new(&state, self.cause, &base.held).fit(&columns, self.power, rounds, true)?;
            return hypothesis.form.admits(knobs, &[]).then(|| Tried { knobs: knobs.to_vec(), coefficients: vec![], fit });
        }
        let extra = hypothesis.columns(self.state, knobs);
        match hypothesis.arm() {
            Some(arm) => Ground { base: &Base::new(self.state, self.cause, &self.base.structure, Some(arm)), ..*self }.add(hypothesis, knobs, &extra, rounds),
            None => self.add(hypothesis, knobs, &extra, rounds),
        }
    }

    /// The fit with the columns of a hypothesis beside all others.
    fn add(&self, hypothesis: &Hypothesis, knobs: &[f64], extra: &[Column], rounds: usize) -> Option<Tried> {
        let columns: Vec<&Column> = self.base.columns.iter().chain(self.terms).chain(extra).collect();
        let fit = Likelihood::new(self.state, self.cause, &self.base.held).fit(&columns, self.power, rounds, true)?;
        let coefficients = fit.theta[columns.len() - extra.len()..].to_vec();
        hypothesis.form.admits(knobs, &coefficients).then(|| Tried { knobs: knobs.to_vec(), coefficients, fit })
    }

    /// The best point of the grid of hypothesis `number`.
    pub fn screen(&self, hypotheses: &[Hypothesis], number: usize, cache: &Cache) -> Option<Tried> {
        let (hypothesis, holder) = (&hypotheses[number], cache.holder[number]);
        let stored = self.state.transforms.is_empty() && !hypothesis.corrects() && hypothesis.arm().is_none();
        let points = hypothesis.form.grid.iter().zip(&cache.columns[holder]);
        points
            .filter_map(|(knobs, place)| {
                if stored {
                    let columns = place.get_or_init(|| hypotheses[holder].columns(self.state, knobs));
                    return self.add(hypothesis, knobs, &columns[..columns.len().min(hypothesis.form.signs.len())], 1);
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
