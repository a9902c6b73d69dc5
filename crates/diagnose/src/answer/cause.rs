//! A group as a named cause: probability, rivals, parameters, gain, evidence.

use super::groups::Group;
use super::material::Answer;
use crate::plan;
use crate::probability::Features;
use crate::result::{Cause, Confusable, Curve, Gain, UNSURE};
use crate::search::{ENOUGH, Judged};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Two predictions further apart than this many times the output: one of them errs by more than the output, which is worse than none.
const FAR: f64 = 2.0;
/// Penalised gains closer than this do not tell two effects apart.
const CONFUSABLE: f64 = 3.0;

impl Cause {
    /// A name is given where it is more likely right than wrong.
    pub const LIKELY: f64 = 0.5;

    /// Whether its name is more likely right than wrong.
    pub fn is_likely(&self) -> bool {
        self.probability >= Cause::LIKELY
    }

    /// Whether its name is in doubt by itself, and not for its rivals.
    pub fn is_in_doubt(&self) -> bool {
        self.probability <= UNSURE
    }
}

impl Answer<'_> {
    /// The largest penalised gain in the step that found a group: of its own effect's forms, or of all others.
    fn best(&self, group: &Group, own: bool) -> f64 {
        let (subject, found) = (self.subject, self.found);
        let name = |hypothesis: usize| subject.hypotheses[hypothesis].effect.name();
        let its = name(found.chosen[group.members[0]].hypothesis);
        let judged = &found.steps[found.step_of[group.members[0]]].judged;
        judged.iter().filter(|j| (name(j.hypothesis) == its) == own).map(|j| j.net).fold(f64::NEG_INFINITY, f64::max)
    }

    /// What speaks for the name of a group.
    pub(super) fn features(&self, group: &Group) -> Features {
        let (found, gate) = (self.found, self.gate);
        let lead = group.members[0];
        let judged = found.steps[found.step_of[lead]].judged.iter().find(|j| j.hypothesis == found.chosen[lead].hypothesis);
        let share = judged.map_or(0.0, |j| j.share);
        Features::new(self.best(group, true), self.best(group, false), gate.beyond, gate.named, gate.removed, share, group.size)
    }

    pub(super) fn cause(&self, group: &Group, on_unseen: Gain, limit: f64, confusable: &mut Vec<Confusable>) -> Cause {
        let (subject, found) = (self.subject, self.found);
        let lead = group.members[0];
        let h = self.hypothesis(lead);
        let step = &found.steps[found.step_of[lead]];
        let own = self.best(group, true);
        let judged = step.judged.iter().find(|j| j.hypothesis == found.chosen[lead].hypothesis);
        let (gain, share) = judged.map_or((group.worth, 0.0), |j| (j.gain, j.share));
        let p_value = tail(2.0 * gain, h.form.cost(), step.judged.len());
        let mut near: Vec<&'static str> = Vec::new();
        // A correction that its tolerance hides may be worth less than enough, and so may its rivals.
        let enough = if own > ENOUGH { ENOUGH } else { 0.0 };
        for j in step.judged.iter().filter(|j| own - j.net < CONFUSABLE.max(0.01 * own.min(300.0)) && j.net > enough) {
            let other = subject.hypotheses[j.hypothesis].effect.name();
            if other != h.effect.name() && !near.contains(&other) {
                near.push(other);
            }
        }
        let card = h.effect.card;
        let twins = h.effect.twins;
        near.extend(twins.iter().filter(|twin| !near.contains(twin)).copied().collect::<Vec<_>>());
        if !near.is_empty() {
            let effects = std::iter::once(card.name).chain(near.iter().copied()).map(str::to_owned).collect();
            let rival = step.judged.iter().find(|j| subject.hypotheses[j.hypothesis].effect.name() == near[0]);
            confusable.push(self.decided(effects, card.next_experiment, rival.map(|j| (lead, j))));
        }
        let features = self.features(group);
        let schedule = self.options.schedule.as_ref();
        let over_schedule = schedule.map_or_else(Vec::new, |schedule| subject.curves(schedule, &self.meaning.axes, &found.chosen, &found.stand, lead));
        let what = over_schedule.first().map_or_else(|| card.what.to_owned(), Curve::what);
        let mut evidence = vec![
            format!(
                "{what} ({}): it raised the log-likelihood by {gain:.0} with {} parameters when it was found; in the whole model it is worth {:.0} after paying for them",
                h.form.label,
                h.form.cost(),
                group.worth
            ),
            format!(
                "it removes {}{:.2} % of the effort's rms; {}",
                if share > 0.0 { format!("{:.1} % of the whitened residual, ", 100.0 * share) } else { String::new() },
                100.0 * group.size,
                match group.change {
                    Some(change) if change > FAR =>
                        "it changes the held-out prediction by more than twice the output: with it or without it the run is worse than no prediction".to_owned(),
                    Some(change) => format!("it changes the held-out prediction by {:.2} % of the output", 100.0 * change),
                    None => "how far it changes the held-out prediction is not known: with it or without it that part could not be fitted or run by itself"
                        .to_owned(),
                }
            ),
        ];
        evidence.extend(twins.iter().map(|twin| format!("{twin} would be the same force: nothing in effort and motion tells the two apart")));
        if let Some(j) = step.judged.iter().find(|j| subject.hypotheses[j.hypothesis].effect.name() != h.effect.name()) {
            evidence.push(format!(
                "the next other effect, {}, gains {:.0} after paying for its parameters",
                subject.hypotheses[j.hypothesis].effect.name(),
                j.net
            ));
        }
        if let (Some(gain), Some([low, high])) = (on_unseen.log_likelihood, on_unseen.log_likelihood_ci95) {
            let rests = if low > 0.0 { "" } else { ", which may be nothing: the name rests on the free run, which is better with it" };
            evidence.push(format!("on the part that no fit saw it gains {gain:.0} ({low:.0} … {high:.0}) of log-likelihood{rests}"));
        }
        if !on_unseen.helps_free_run() {
            evidence.push(
                "the free run over that part is no better with it: what the limb does by itself, or what is still missing, makes more of its error".to_owned(),
            );
        }
        Cause {
            effect: card.name.to_owned(),
            site: self.site(h.form.side, h.form.axis),
            parameters: subject.named(&found.chosen, &found.stand, lead),
            probability: features.probability().min(limit),
            p_value,
            gain: on_unseen,
            evidence,
            over_schedule,
            features: Some(features),
            at_most: limit,
            lead: Some(lead),
        }
    }
}

impl Answer<'_> {
    /// Effects that cannot be told apart, with the experiment that decides: the one of the card, or, where a plan was asked for, the best of those
    /// that were simulated with the cause at a place of the search and with its rival.
    pub(super) fn decided(&self, effects: Vec<String>, card: &str, rival: Option<(usize, &Judged)>) -> Confusable {
        let predicted = match rival.filter(|_| self.options.plan) {
            Some((position, j)) => plan::prospects(self.subject, self.meaning, self.options, self.found, position, j),
            None => Vec::new(),
        };
        let next_experiment = match predicted.first().filter(|p| p.decides) {
            Some(best) => format!("{}; simulated, the right one then leads by {:.0} of log-likelihood", best.experiment, best.separation),
            None => card.to_owned(),
        };
        Confusable { effects, next_experiment, predicted }
    }
}

/// Upper tail of χ² with `k` degrees of freedom, times the number of hypotheses (Holm's factor of the smallest).
pub(crate) fn tail(statistic: f64, k: usize, tried: usize) -> f64 {
    ChiSquared::new(k.max(1) as f64).map_or(1.0, |law| (law.sf(statistic.max(0.0)) * tried as f64).min(1.0))
}
