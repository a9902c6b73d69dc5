//! What was found, by effect and site, and whether it matters.

use super::material::Answer;
use crate::generic;
use crate::result::Cause;
use crate::search::Chosen;
use crate::unseen::Rest;

/// A cause whose gain is below this share of the first one's is minor, if
const MINOR: f64 = 0.05;
/// its size is below this share of the largest.
const SMALL: f64 = 0.2;
/// Share of a free run's error (its power) below which another one is clearly better.
const CLEARLY: f64 = 0.97;
/// Beyond this share of the tolerance a prediction has to change where what is corrected is only a channel.
const CHANGE: f64 = 0.3;

/// Chosen hypotheses of one effect at one site.
pub(super) struct Group {
    pub members: Vec<usize>,
    /// Net log-likelihood lost without it.
    pub worth: f64,
    /// Root of the power that it removes, as a share of the effort's rms.
    pub size: f64,
    /// Root of the power that it removes, beyond chance, of the held-out prediction's error, as a share of the output's standard deviation.
    pub helps: f64,
    /// rms by which it changes the held-out prediction, as a share of the output's standard deviation; nothing where a prediction is not finite.
    pub change: Option<f64>,
}

impl Answer<'_> {
    /// Chosen hypotheses of one effect, side and axis together, strongest first: `of` them, as they are beside each other alone.
    pub(super) fn groups(&self, of: &[usize]) -> Vec<Group> {
        let (subject, found) = (self.subject, self.found);
        let mut groups: Vec<Group> = Vec::new();
        for q in of.iter().copied() {
            match groups.iter_mut().find(|g| self.hypothesis(g.members[0]).shares_a_site(self.hypothesis(q))) {
                Some(group) => group.members.push(q),
                None => groups.push(Group { members: vec![q], worth: found.worth[q], size: 0.0, helps: 0.0, change: None }),
            }
        }
        let power = &found.stand.fit.power;
        let all = self.without(of, &[]);
        let refitted = if all.len() < found.chosen.len() { subject.stand(&all, power, 4) } else { None };
        let stand = if all.len() < found.chosen.len() { refitted.as_ref() } else { Some(&found.stand) };
        let strict = if groups.is_empty() { None } else { subject.strict(&all, power, 2) };
        let predicted = strict.as_ref().map(|stand| self.court.errors(subject, &all, stand));
        for group in &mut groups {
            let rest = self.without(of, &group.members);
            if let (Some(without), Some(with)) = (subject.stand(&rest, power, 4), stand) {
                let price: f64 = group.members.iter().map(|q| subject.price(self.hypothesis(*q).form.cost())).sum();
                group.worth = with.fit.log_likelihood - without.fit.log_likelihood - price;
            }
            if let (Some(without), Some(with)) = (subject.strict(&rest, power, 2), &strict) {
                group.size = generic::size(&without, &without.fit.residual, &with.fit.residual);
                let before = self.court.errors(subject, &rest, &without);
                group.change = predicted.as_ref().and_then(|after| before.distance(after));
                group.helps = predicted.as_ref().map_or(0.0, |after| before.removed_by(after, self.court.block()));
            }
        }
        groups.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        groups
    }

    /// Those of the chosen but for these.
    fn without(&self, of: &[usize], members: &[usize]) -> Vec<Chosen> {
        self.chosen(of.iter().filter(|q| !members.contains(q)))
    }

    /// Why a group is significant and not named, beside the first one's worth and the largest size; `None` where it is to be named.
    pub(super) fn immaterial(&self, group: &Group, top: (f64, f64)) -> Option<String> {
        let tolerance = self.options.tolerance;
        let corrects = group.members.iter().all(|q| self.hypothesis(*q).corrects());
        if group.size.max(group.helps) <= tolerance {
            return Some(format!(
                "it removes {:.2} % of the effort's rms and, beyond chance, {:.2} % of the output's from the error of the prediction: below the tolerance",
                100.0 * group.size,
                100.0 * group.helps
            ));
        }
        if let Some(change) = group.change.filter(|change| corrects && *change <= CHANGE * tolerance) {
            return Some(format!("it changes the prediction by {:.2} % of the output: below the tolerance", 100.0 * change));
        }
        let probability = self.features(group).probability();
        if probability < Cause::LIKELY {
            return Some(format!("its name is right with a probability of {probability:.2} only"));
        }
        let (worth, size) = top;
        if group.worth < MINOR * worth && group.size < SMALL * size {
            return Some(format!("its gain of {:.0} is below {:.0} % of the first cause's, and it is a fifth of its size or less", group.worth, 100.0 * MINOR));
        }
        None
    }

    /// Why a group is not what it is called: a parameter without which there is no such thing, as a wall's stiffness, may be zero or less.
    pub(super) fn absent(&self, group: &Group) -> Option<String> {
        let (subject, found) = (self.subject, self.found);
        let needed = |q: usize, name: &str| {
            let card = self.hypothesis(q).effect.card;
            card.parameters.iter().any(|p| p.name == name && p.bounds.0 == 0.0 && p.default.is_none())
        };
        let absent = |q: &usize| {
            let numbers = subject.beside_knobs(&found.chosen, &found.stand, *q);
            numbers.into_iter().find(|(name, value, error)| needed(*q, name) && *value <= 1.96 * error.max(0.0)).map(|(name, ..)| name)
        };
        group.members.iter().find_map(absent).map(|name| format!("something is there, but its {name} cannot be told from zero"))
    }

    /// The weakest of the groups without which the others predict the part that no fit saw better, or may be worth as much there and predict it as well;
    /// with that in words.
    pub(super) fn idle(&self, named: &[Group], ends: &Ends) -> Option<(usize, String)> {
        let members = |without: Option<usize>| -> Vec<usize> {
            named.iter().enumerate().filter(|(k, _)| Some(*k) != without).flat_map(|(_, g)| g.members.iter().copied()).collect()
        };
        let run = |without: Option<usize>| self.errors_of_balance(&members(without)).and_then(|errors| errors.variance()).unwrap_or(f64::INFINITY);
        let (run_with, with) = (if named.is_empty() { 0.0 } else { run(None) }, self.rest(members(None)));
        (0..named.len()).rev().find_map(|k| {
            let run_without = run(Some(k));
            // A prediction that is worse than none at all judges nothing.
            if run_without < (CLEARLY * run_with).min(1.0) {
                return Some((k, "without it the free run over the held-out part is better".to_owned()));
            }
            let gain = ends.best.as_ref()?.gain(&self.rest(members(Some(k)))?, with.as_ref()?);
            nothing(gain).filter(|_| run_with > CLEARLY * run_without).map(|why| (k, why))
        })
    }

    /// Whether a group that is not named beside others is there all the same: it matters, and the part that no fit saw is likelier with it beyond chance.
    pub(super) fn is_something(&self, group: &Group, beside: &[Group], ends: &Ends) -> bool {
        let others: Vec<usize> = beside.iter().flat_map(|group| group.members.iter().copied()).collect();
        let with: Vec<usize> = others.iter().chain(&group.members).copied().collect();
        let gain = || Some(nothing(ends.best.as_ref()?.gain(&self.rest(others.clone())?, &self.rest(with)?)).is_none());
        group.size > self.options.tolerance && gain().unwrap_or(false)
    }

    /// What the model of some of the chosen hypotheses, fitted anew, leaves of the part that no fit saw.
    pub(super) fn rest(&self, mut members: Vec<usize>) -> Option<Rest> {
        members.sort_unstable();
        let chosen = self.chosen(&members);
        self.unseen.rest(&chosen, &self.refitted(&chosen)?)
    }

    /// That of the baseline, of the linear model fitted anew, and that of all that was found.
    pub(super) fn ends(&self) -> Ends {
        let linear = self.rest(Vec::new());
        Ends {
            baseline: if self.corrects() { linear.clone() } else { self.unseen.rest(&[], self.baseline) },
            linear,
            best: self.rest((0..self.found.chosen.len()).collect()),
        }
    }
}

/// What the first and the best model leave of the part that no fit saw.
pub(super) struct Ends {
    pub baseline: Option<Rest>,
    /// A cause has to gain beside this one: what new matrices gain is not its own.
    pub linear: Option<Rest>,
    pub best: Option<Rest>,
}

/// A gain on the part that no fit saw, in words, if it may be none.
pub(super) fn nothing((gain, [low, high]): (f64, [f64; 2])) -> Option<String> {
    (low <= 0.0).then(|| format!("on the part that no fit saw it gains {gain:.1} ({low:.1} … {high:.1}) of log-likelihood: it may be nothing"))
}
