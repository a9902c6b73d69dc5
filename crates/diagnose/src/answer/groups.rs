//! What was found, by effect and site, and whether it matters.

use super::Answer;
use crate::generic;
use crate::search::Chosen;

/// A cause whose gain is below this share of the first one's is minor, if
const MINOR: f64 = 0.05;
/// its size is below this share of the largest.
const SMALL: f64 = 0.2;
/// Log-likelihood that blocks which no fit saw have to gain.
const HELD_OUT: f64 = 3.0;
/// Beyond this share of the tolerance a prediction has to change where what is corrected is only a channel.
const CHANGE: f64 = 0.3;

/// Chosen hypotheses of one effect at one site.
pub(super) struct Group {
    pub members: Vec<usize>,
    /// Net log-likelihood lost without it.
    pub worth: f64,
    /// Root of the power that it removes, as a share of the effort's rms.
    pub size: f64,
    /// rms by which it changes the held-out prediction, as a share of the output's standard deviation.
    pub change: f64,
    /// Log-likelihood that it gains on blocks that were left out of the fit; `None` where there are too few.
    pub held_out: Option<f64>,
}

impl Answer<'_> {
    /// Chosen hypotheses of one effect, side and axis together, strongest first.
    pub(super) fn groups(&self) -> Vec<Group> {
        let (subject, found) = (self.subject, self.found);
        let key = |q: usize| {
            let h = &subject.hypotheses[found.chosen[q].hypothesis];
            (h.effect.name(), h.form.side, h.form.axis)
        };
        let mut groups: Vec<Group> = Vec::new();
        for q in 0..found.chosen.len() {
            match groups.iter_mut().find(|g| key(g.members[0]) == key(q)) {
                Some(group) => group.members.push(q),
                None => groups.push(Group { members: vec![q], worth: found.worth[q], size: 0.0, change: 0.0, held_out: None }),
            }
        }
        let power = &found.stand.fit.power;
        let strict = if groups.is_empty() { None } else { subject.strict(&found.chosen, power, 2) };
        let predicted = strict.as_ref().map(|stand| self.court.errors(subject, &found.chosen, stand));
        // Tolerances would take the place of what corrects a channel.
        let score = strict.as_ref().and_then(|stand| generic::held_out(subject, stand, &[]));
        for group in &mut groups {
            let rest = self.without(&group.members);
            if let Some(without) = subject.stand(&rest, power, 4) {
                let price: f64 = group.members.iter().map(|q| subject.price(subject.hypotheses[found.chosen[*q].hypothesis].form.cost())).sum();
                group.worth = found.stand.fit.log_likelihood - without.fit.log_likelihood - price;
            }
            if let (Some(without), Some(with)) = (subject.strict(&rest, power, 2), &strict) {
                group.size = generic::size(&without, &without.fit.residual, &with.fit.residual);
                group.change = predicted.as_ref().map_or(0.0, |p| self.court.errors(subject, &rest, &without).distance(p));
                if let (Some(with), Some(without)) = (&score, generic::held_out(subject, &without, &[])) {
                    group.held_out = Some(without.iter().zip(with).map(|(b, a)| b - a).sum());
                }
            }
        }
        groups.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        groups
    }

    /// Everything chosen but these.
    fn without(&self, members: &[usize]) -> Vec<Chosen> {
        (0..self.found.chosen.len()).filter(|q| !members.contains(q)).map(|q| self.found.chosen[q].clone()).collect()
    }

    /// Why a group is significant and not named, beside the first one's worth and the largest size; `None` where it is to be named.
    pub(super) fn immaterial(&self, group: &Group, top: (f64, f64)) -> Option<String> {
        let tolerance = self.options.tolerance;
        let corrects = group.members.iter().all(|q| self.subject.hypotheses[self.found.chosen[*q].hypothesis].corrects());
        if group.size <= tolerance {
            return Some(format!(
                "it removes {:.2} % of the effort's rms and changes the prediction by {:.2} % of the output: below the tolerance",
                100.0 * group.size,
                100.0 * group.change
            ));
        }
        if corrects && group.change <= CHANGE * tolerance {
            return Some(format!("it changes the prediction by {:.2} % of the output: below the tolerance", 100.0 * group.change));
        }
        let (worth, size) = top;
        if group.worth < MINOR * worth && group.size < SMALL * size {
            return Some(format!("its gain of {:.0} is below {:.0} % of the first cause's, and it is a fifth of its size or less", group.worth, 100.0 * MINOR));
        }
        group.held_out.filter(|g| *g < HELD_OUT).map(|g| format!("on stretches that the fit did not see it gains {g:.1} of log-likelihood"))
    }

    /// The weakest of the groups without which the others predict the held-out part better.
    pub(super) fn idle(&self, named: &[Group]) -> Option<usize> {
        let power = &self.found.stand.fit.power;
        let error = |without: Option<usize>| -> Option<f64> {
            let mut kept: Vec<usize> = named.iter().enumerate().filter(|(k, _)| Some(*k) != without).flat_map(|(_, g)| g.members.iter().copied()).collect();
            kept.sort_unstable();
            let chosen: Vec<Chosen> = kept.iter().map(|q| self.found.chosen[*q].clone()).collect();
            let stand = self.subject.stand(&chosen, power, 3)?;
            self.errors(&chosen, &stand).variance()
        };
        let with = if named.is_empty() { 0.0 } else { error(None).unwrap_or(f64::INFINITY) };
        // A prediction that is worse than none at all judges nothing.
        (0..named.len()).rev().find(|k| error(Some(*k)).is_some_and(|without| without < (0.97 * with).min(1.0)))
    }
}
