//! Names whose form has gone where another cause would make the same response: they are said, but not for sure.

use super::{Answer, UNSURE};
use crate::hypotheses::{Ground, Hypothesis};
use crate::result::{Cause, Confusable};
use crate::search::{Chosen, Judged};
use ndof_models::effects::{Action, Operator, Value, find};
use std::sync::Arc;

/// A loop that yields within this share of the displacement's standard deviation is as good as dry friction.
const NARROW: f64 = 0.12;
/// Shapes of a spring's force: any two of them on one axis make what a third is.
const SPRINGS: [&str; 4] = ["cubic-stiffness", "asymmetric-stiffness", "dead-zone", "end-stop"];
/// A gap of this many standard deviations of the displacement to either side is a spring that hardens.
const WIDE: f64 = 0.9;
/// A mode damped more than this does not swing: a reflex or a relaxation answers alike.
const DEAD: f64 = 0.25;
/// Forms that fit badly ask for helpers: of so many names at once the small ones are not sure.
const MANY: usize = 3;
/// Those of many that explain less than this share of the explainable error
const HELPER: f64 = 0.5;
/// are believed by no more than this.
const CROWD: f64 = 0.85;

/// A delay beyond this (s) is none of a reflex, and a muscle that follows beyond this (Hz) is none: a mode or a filter answers so.
const LATE_S: f64 = 0.1;
const FAST_HZ: f64 = 15.0;
/// Log-likelihood that the gain which a filter takes has to be worth.
const GAIN_SEEN: f64 = 3.0;

fn number(cause: &Cause, name: &str) -> Option<f64> {
    cause.parameters.iter().find(|p| p.name.starts_with(name)).and_then(|p| if let Value::Number(x) = p.value { Some(x) } else { None })
}

impl Answer<'_> {
    /// The causes that each cause may stand for beside itself.
    fn stands_for(&self, cause: &Cause, causes: &[Cause]) -> Vec<&'static str> {
        let beside = |effect: &str| causes.iter().any(|c| c.effect == effect && c.site == cause.site);
        match cause.effect.as_str() {
            "hysteresis" if !beside("coulomb-friction") => {
                let axis = self.meaning.axes.iter().position(|a| *a == cause.site.axis).unwrap_or(0);
                let narrow = number(cause, "yield").is_some_and(|width| width < NARROW * self.subject.scale.position[axis]);
                if narrow { vec!["coulomb-friction"] } else { vec![] }
            }
            "extra-resonance" if number(cause, "damping_ratio").is_some_and(|z| z > DEAD) => vec!["reflex-delay", "viscoelastic"],
            spring if SPRINGS.contains(&spring) && SPRINGS.iter().any(|s| *s != spring && beside(s)) => {
                SPRINGS.iter().copied().filter(|s| *s != spring).collect()
            }
            "cubic-stiffness" if self.mostly_even(&cause.site.axis) => vec!["asymmetric-stiffness"],
            "dead-zone" => {
                let axis = self.meaning.axes.iter().position(|a| *a == cause.site.axis).unwrap_or(0);
                let wide = number(cause, "half_gap").is_some_and(|gap| gap > WIDE * self.subject.scale.position[axis]);
                if wide { vec!["cubic-stiffness"] } else { vec![] }
            }
            "reflex-delay" => {
                let unit = self.subject.scale.human_time_s();
                let late = number(cause, "delay").is_some_and(|delay| delay > LATE_S * unit);
                let fast = number(cause, "cutoff").is_some_and(|cutoff| cutoff * unit > FAST_HZ);
                if late || fast { vec!["extra-resonance", "channel-filter"] } else { vec![] }
            }
            "channel-filter" if !self.loses_gain() => vec!["measurement-delay"],
            _ => vec![],
        }
    }

    /// Whether the cubic of an axis lies so far off its centre that its square does more than its cube, both without their straight-line part.
    fn mostly_even(&self, axis: &str) -> bool {
        let (subject, found) = (self.subject, self.found);
        found.chosen.iter().enumerate().any(|(q, c)| {
            let h = &subject.hypotheses[c.hypothesis];
            let Some(i) = h.form.axis.filter(|i| self.meaning.axes[*i] == axis && h.effect.name() == "cubic-stiffness") else { return false };
            let sigma = subject.scale.position[i];
            // Over a Gaussian x: the rms of x² is √2 σ² about its mean, that of x³ is √6 σ³ about its straight line.
            matches!(subject.coefficients(&found.stand, q), &[cube, square] if square.abs() * 2f64.sqrt() > cube.abs() * 6f64.sqrt() * sigma)
        })
    }

    /// The place of a cause among the chosen hypotheses, and the best form of another effect on its axis in the step that chose it.
    fn rival(&self, cause: &Cause, other: &str) -> Option<(usize, &Judged)> {
        let (hypotheses, found) = (&self.subject.hypotheses, self.found);
        let axis = self.meaning.axes.iter().position(|a| *a == cause.site.axis);
        let q = found.chosen.iter().position(|c| {
            let h = &hypotheses[c.hypothesis];
            h.effect.name() == cause.effect && h.form.axis == axis
        })?;
        let alike = |j: &&Judged| {
            let h = &hypotheses[j.hypothesis];
            h.effect.name() == other && (h.form.axis == axis || h.form.axis.is_none() || axis.is_none())
        };
        found.steps[found.step_of[q]].judged.iter().find(alike).map(|j| (q, j))
    }

    /// Whether the gain that a filter takes is seen: without it, by the phase alone, the recording is explained worse.
    ///
    /// H(s) of the filter competes with H / |H|, each at its best corner. Where that does as well, the filter is a delay for all that
    /// the recording says.
    fn loses_gain(&self) -> bool {
        let (subject, found) = (self.subject, self.found);
        let filter = found.chosen.iter().position(|c| subject.hypotheses[c.hypothesis].effect.name() == "channel-filter");
        let Some(q) = filter else { return true };
        let h = &subject.hypotheses[found.chosen[q].hypothesis];
        let mut form = h.form.clone();
        let unit = |operator: &Operator| -> Operator {
            let operator = operator.clone();
            Arc::new(move |s, knobs| {
                let value = operator(s, knobs);
                value / value.norm()
            })
        };
        form.action = match &form.action {
            Action::Effort(operator) => Action::Effort(unit(operator)),
            Action::Motion(operator) => Action::Motion(unit(operator)),
            _ => return true,
        };
        let phase = Hypothesis { effect: h.effect, form };
        let others: Vec<Chosen> = found.chosen.iter().enumerate().filter(|(k, _)| *k != q).map(|(_, c)| c.clone()).collect();
        let power = &found.stand.fit.power;
        let Some(rest) = subject.stand(&others, power, 1) else { return true };
        let ground = Ground { state: &rest.state, cause: &subject.cause, structure: &subject.structure, base: &rest.base, terms: &rest.terms, power };
        let best = |h: &Hypothesis| -> Option<f64> {
            let start = ground.evaluate(h, &found.chosen[q].knobs, 1)?;
            ground.refine(h, &start, 28).or(Some(start)).map(|t| t.fit.log_likelihood)
        };
        match (best(h), best(&phase)) {
            (Some(whole), Some(phase)) => whole - phase > GAIN_SEEN,
            _ => true,
        }
    }

    /// Limits what is believed of such names; whether there are any.
    pub(super) fn stand_ins(&self, causes: &mut [Cause], confusable: &mut Vec<Confusable>) -> bool {
        let limit = |cause: &mut Cause, most: f64| {
            cause.at_most = cause.at_most.min(most);
            cause.probability = cause.probability.min(most);
        };
        let others: Vec<Vec<&'static str>> = causes.iter().map(|c| self.stands_for(c, causes)).collect();
        let mut any = false;
        for (cause, others) in causes.iter_mut().zip(others).filter(|(_, others)| !others.is_empty()) {
            limit(cause, UNSURE);
            any = true;
            let effects: Vec<String> = std::iter::once(cause.effect.as_str()).chain(others.iter().copied()).map(str::to_owned).collect();
            let same = |k: &Confusable| effects.iter().all(|e| k.effects.contains(e));
            if !confusable.iter().any(same) {
                let card = find(&cause.effect).map_or("", |e| e.card().next_experiment);
                confusable.push(self.decided(effects, card, self.rival(cause, others[0])));
            }
        }
        if causes.len() >= MANY {
            let helper = |c: &&mut Cause| c.gain.explained_fraction.is_none_or(|share| share < HELPER);
            causes.iter_mut().filter(helper).for_each(|cause| limit(cause, CROWD));
        }
        any
    }
}
