//! Names whose form has gone where another cause would make the same response: they are said, but not for sure.

use super::material::Answer;
use crate::hypotheses::{Ground, Hypothesis};
use crate::result::{Cause, Confusable, UNSURE};
use crate::search::{Judged, but};
use ndof_models::effects::{Action, Evidence, Operator, Value};
use std::sync::Arc;

/// Forms that fit badly ask for helpers: of so many names at once the small ones are not sure.
const MANY: usize = 3;
/// Those of many that explain less than this share of the explainable error
const HELPER: f64 = 0.5;
/// are believed by no more than this.
const CROWD: f64 = 0.85;

impl Answer<'_> {
    /// Limits what is believed of such names; whether there are any.
    pub(super) fn stand_ins(&self, causes: &mut [Cause], confusable: &mut Vec<Confusable>) -> bool {
        let others: Vec<Option<(usize, &[&str])>> = causes.iter().map(|c| self.stands_for(c, causes)).collect();
        let mut any = false;
        for (cause, (place, others)) in causes.iter_mut().zip(others).filter_map(|(cause, others)| Some((cause, others?))) {
            cause.believe_at_most(UNSURE);
            any = true;
            let effects: Vec<String> = std::iter::once(cause.effect.as_str()).chain(others.iter().copied()).map(str::to_owned).collect();
            let same = |k: &Confusable| effects.iter().all(|e| k.effects.contains(e));
            if !confusable.iter().any(same) {
                let card = self.hypothesis(place).effect.card;
                confusable.push(self.decided(effects, card.next_experiment, self.rival(place, others[0]).map(|j| (place, j))));
            }
        }
        if causes.len() >= MANY {
            let helper = |c: &&mut Cause| c.gain.explained_fraction.is_none_or(|share| share < HELPER);
            causes.iter_mut().filter(helper).for_each(|cause| cause.believe_at_most(CROWD));
        }
        any
    }

    /// The place of a cause among the chosen, and what it may stand for beside itself, as its effect judges it; none where that is nothing.
    fn stands_for(&self, cause: &Cause, causes: &[Cause]) -> Option<(usize, &'static [&'static str])> {
        let axis = self.meaning.axes.iter().position(|a| *a == cause.site.axis);
        let of_it = |q: &usize| {
            let h = self.hypothesis(*q);
            h.effect.name() == cause.effect && h.form.axis == axis
        };
        let places: Vec<usize> = (0..self.found.chosen.len()).filter(of_it).collect();
        let place = *places.first()?;
        let number = |value: &Value| if let Value::Number(x) = value { Some(*x) } else { None };
        let parameters: Vec<(&str, f64)> = cause.parameters.iter().filter_map(|p| Some((p.name.as_str(), number(&p.value)?))).collect();
        let coefficients: Vec<&[f64]> = places.iter().map(|q| self.subject.coefficients(&self.found.stand, *q)).collect();
        let beside: Vec<&str> = causes.iter().filter(|c| c.site == cause.site && c.effect != cause.effect).map(|c| c.effect.as_str()).collect();
        let others = self.hypothesis(place).effect.stands_for(&Evidence {
            parameters: &parameters,
            coefficients: &coefficients,
            axis,
            scale: &self.subject.scale,
            beside: &beside,
            gain_worth: &|| self.gain_worth(place),
        });
        (!others.is_empty()).then_some((place, others))
    }

    /// The best form of another effect on the axis of a cause in the step that chose it.
    fn rival(&self, place: usize, other: &str) -> Option<&Judged> {
        let axis = self.hypothesis(place).form.axis;
        let alike = |j: &&Judged| {
            let h = &self.subject.hypotheses[j.hypothesis];
            h.effect.name() == other && (h.form.axis == axis || h.form.axis.is_none() || axis.is_none())
        };
        self.found.steps[self.found.step_of[place]].judged.iter().find(alike)
    }

    /// Log-likelihood that the gain of a cause's operator H is worth: that of H less that of H / |H|, each at its best knobs.
    fn gain_worth(&self, place: usize) -> Option<f64> {
        let (subject, found) = (self.subject, self.found);
        let h = self.hypothesis(place);
        let unit = |operator: &Operator| -> Operator {
            let operator = operator.clone();
            Arc::new(move |s, knobs| {
                let value = operator(s, knobs);
                value / value.norm()
            })
        };
        let action = match &h.form.action {
            Action::Effort(operator) => Action::Effort(unit(operator)),
            Action::Motion(operator) => Action::Motion(unit(operator)),
            _ => return None,
        };
        let mut form = h.form.clone();
        form.action = action;
        let phase = Hypothesis { effect: h.effect, form };
        let others = but(&found.chosen, place);
        let power = &found.stand.fit.power;
        let rest = subject.stand(&others, power, 1)?;
        let ground = Ground { power, ..subject.ground(&rest) };
        let best = |h: &Hypothesis| -> Option<f64> {
            let start = ground.evaluate(h, &found.chosen[place].knobs, 1)?;
            ground.refine(h, &start, 28).or(Some(start)).map(|t| t.fit.log_likelihood)
        };
        Some(best(h)? - best(&phase)?)
    }
}
