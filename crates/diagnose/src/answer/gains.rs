//! What each cause gains on the part that no fit saw, beside those that gain more.

use super::groups::{Ends, Group, nothing};
use super::material::Answer;
use crate::judge::Errors;
use crate::result::Gain;
use crate::search::ENOUGH;
use crate::unseen::Rest;

/// A group beside those before it.
pub(super) struct Step {
    pub group: Group,
    /// What the model with it leaves of the free run, and of the balance of forces.
    errors: Option<Errors>,
    rest: Option<Rest>,
}

impl Answer<'_> {
    /// The groups, each time the one that gains most beside those before it; one that may gain nothing there, and does not help
    /// the free run, joins the small ones.
    pub(super) fn steps(&self, named: Vec<Group>, mut small: Vec<(Group, String)>, ends: &Ends, quiet: &Errors) -> (Vec<Step>, Vec<(Group, String)>) {
        let mut open = named;
        let mut steps: Vec<Step> = Vec::new();
        while !open.is_empty() {
            let kept: Vec<usize> = steps.iter().flat_map(|step| step.group.members.iter().copied()).collect();
            let tried = open.iter().map(|group| self.rest(kept.iter().chain(&group.members).copied().collect()));
            let size = |rest: &Option<Rest>| rest.as_ref().map_or(f64::NEG_INFINITY, |rest| rest.log_likelihood);
            let most = tried.enumerate().reduce(|best, other| if size(&other.1) > size(&best.1) { other } else { best });
            let Some((k, rest)) = most else { break };
            let group = open.remove(k);
            let errors = self.errors_of(&kept.iter().chain(&group.members).copied().collect::<Vec<_>>());
            steps.push(Step { group, errors, rest });
        }
        let run = |errors: Option<&Errors>| errors.and_then(Errors::mean).unwrap_or(f64::INFINITY);
        // The first has to be better than the baseline, and than matrices fitted anew: what these gain is not its own.
        let linear = self.errors_of(&[]);
        let before = |k: usize| match k {
            0 => vec![(ends.baseline.as_ref(), Some(quiet)), (ends.linear.as_ref(), linear.as_ref())],
            _ => vec![(steps[k - 1].rest.as_ref(), steps[k - 1].errors.as_ref())],
        };
        let idle_beside = |k: usize, (rest, errors): (Option<&Rest>, Option<&Errors>)| {
            let helps = run(steps[k].errors.as_ref()) < run(errors);
            nothing(ends.best.as_ref()?.gain(rest?, steps[k].rest.as_ref()?)).filter(|_| !helps)
        };
        let idle = |k: usize| before(k).into_iter().find_map(|other| idle_beside(k, other));
        match (0..steps.len()).rev().find_map(|k| Some((k, idle(k)?))) {
            None => (steps, small),
            Some((k, why)) => {
                small.push((steps.remove(k).group, why));
                self.steps(steps.into_iter().map(|step| step.group).collect(), small, ends, quiet)
            }
        }
    }
}

/// The gains of all steps.
pub(super) struct Gains<'a> {
    steps: &'a [Step],
    baseline: Option<&'a Rest>,
    /// The model that foretells the unseen part best: all that was found, or what is named of it. No step gains more than there is to gain.
    best: Option<&'a Rest>,
    /// What a model without physics gains beyond the best one, and what tones take beyond their surroundings.
    more: f64,
    tones: Vec<Option<f64>>,
}

impl<'a> Gains<'a> {
    pub fn new(answer: &Answer<'_>, steps: &'a [Step], ends: &'a Ends) -> Self {
        let (unseen, gate, found) = (answer.unseen, answer.gate, answer.found);
        let beyond = if gate.sure() { gate.beyond * unseen.share() } else { 0.0 };
        let tones: Vec<Option<f64>> = answer.findings.tones.iter().map(|tone| unseen.tone(tone, &found.chosen, &found.stand)).collect();
        let more = beyond + tones.iter().flatten().filter(|gain| **gain > ENOUGH).sum::<f64>();
        let all = ends.best.iter().chain(steps.iter().filter_map(|step| step.rest.as_ref()));
        let best = all.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood));
        Gains { steps, baseline: ends.baseline.as_ref(), best, more, tones }
    }

    /// The gain of a step, with the errors of free runs before and after.
    pub fn of(&self, step: usize, errors: [&Errors; 2]) -> Gain {
        let mut gain = Gain::of_runs(errors.map(|e| &e.score), 2.0 * self.steps[step].group.worth);
        let before = if step == 0 { self.baseline } else { self.steps[step - 1].rest.as_ref() };
        if let (Some(baseline), Some(before), Some(after), Some(best)) = (self.baseline, before, &self.steps[step].rest, self.best) {
            let (log_likelihood, interval) = best.gain(before, after);
            (gain.log_likelihood, gain.log_likelihood_ci95) = (Some(log_likelihood), Some(interval));
            (gain.explained_fraction, gain.explained_fraction_ci95) = best.fraction([baseline, before, after], self.more);
        }
        gain
    }

    /// Whether a tone is there beside what was found after it: what the linear model alone missed at a resonance may have looked like one.
    pub fn has_tone(&self, tone: usize) -> bool {
        self.tones[tone].is_none_or(|gain| gain > ENOUGH)
    }

    /// The gain of a tone.
    pub fn of_tone(&self, tone: usize, errors: [&Errors; 2]) -> Gain {
        let log_likelihood = self.tones[tone];
        let whole = self.baseline.zip(self.best).map(|(baseline, best)| best.log_likelihood - baseline.log_likelihood + self.more);
        let share = log_likelihood.zip(whole).filter(|(tone, whole)| *tone > 0.0 && whole > tone).map(|(tone, whole)| tone / whole);
        Gain { log_likelihood, explained_fraction: share, ..Gain::of_runs(errors.map(|e| &e.score), f64::NAN) }
    }
}
