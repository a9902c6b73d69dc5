//! From a search to an answer: causes with their gains, what is minor, what is confusable, the verdict.

mod cause;
mod describe;
mod detected;
mod drawn;
mod elsewhere;
mod gains;
mod groups;
mod left;
mod material;
mod stand_in;
mod within_a_tick;

pub(crate) use cause::tail;
pub(crate) use material::{Answer, Models};

use crate::floor;
use crate::free_run::WINDOW_S;
use crate::judge::Errors;
use crate::pictures::Pictures;
use crate::result::{
    Cause, CauseParameter, Confusable, Curve, Diagnosis, Extended, Model, ModelParameter, NoiseFloor, ParameterFlag, Score, Split, UNSURE, Verdict,
};
use crate::search::{Chosen, Stand};
use crate::state;
use gains::{Gains, Step};
use groups::{Ends, Group};
use left::Left;
use ndof_models::effects::Matrix;

/// What the intervals of matrices from the balance of forces do not know.
const BEHIND_A_HOLD: &str =
    "behind a robot's hold the limb's own force shifts these matrices by more than their intervals may say: take their values from `ndof fit --kinematics`";

/// Share of the explainable error below which a cause cannot be sure while a large error stays.
const LITTLE: f64 = 0.25;

impl Answer<'_> {
    pub fn write(&self, mut split: Split) -> (Diagnosis, Pictures) {
        let (subject, found) = (self.subject, self.found);
        if self.court.windowed {
            split.windows_s = Some(WINDOW_S * subject.layout.time_s.max(1.0));
        }
        let windows_hz = split.windows_s.map_or(0.0, |w| 1.0 / w);
        // Where something is missing, the force that is left is no noise; what a model without physics leaves of the part that it was fitted to is.
        let unseen = if self.gate.sure() { None } else { self.unseen.floor(&found.chosen, &found.stand, self.order(), windows_hz) };
        let fitted = || (floor::floor(subject, &found.stand, &self.gate.power, self.order(), windows_hz), floor::slowest_hz(&subject.layout));
        let (mut noise_floor, slowest_hz) = unseen.map(|floor| (floor, self.unseen.slowest_hz())).unwrap_or_else(fitted);
        let before = self.court.errors(subject, &[], self.baseline);
        let quiet = self.without_tones(before.clone());
        let final_errors = self.errors(&found.chosen, &found.stand);
        noise_floor.add_what_is_slow(&final_errors.slower_than(slowest_hz));
        // What a model has reached is no less than what remains at best.
        noise_floor.below(&before.score);
        noise_floor.below(&final_errors.score);
        let level = noise_floor.variance();
        let ends = self.ends();
        let (named, small, nameless) = self.sorted_out(&ends);
        let (steps, small) = self.steps(named, small, &ends, &quiet);
        let unmodelled = self.by_itself((&[], self.baseline), windows_hz);
        let left = Left::of(self, &before, &final_errors, &noise_floor, nameless, &unmodelled);
        let limit = left.limit;
        let mut confusable = Vec::new();
        let gains = Gains::new(self, &steps, &ends);
        let mut causes = self.tones(&before, &quiet, &gains, limit);
        let (named, mut weak) = self.named(&steps, &gains, quiet.clone(), [level, limit, left.excess], &mut confusable);
        causes.extend(named);
        let mut kept: Vec<usize> = steps.iter().flat_map(|step| step.group.members.iter().copied()).collect();
        kept.sort_unstable();
        // What explains most comes first; what was detected and explains nothing that can be predicted, last.
        causes.sort_by(|a, b| b.gain.explained_fraction.unwrap_or(f64::NEG_INFINITY).total_cmp(&a.gain.explained_fraction.unwrap_or(f64::NEG_INFINITY)));
        weak |= self.stand_ins(&mut causes, &mut confusable);
        // Where no name is likelier right than wrong, nothing is explained.
        weak |= !causes.is_empty() && causes.iter().all(|cause| cause.probability <= Cause::LIKELY);
        let model = if kept.is_empty() { None } else { self.model(&kept) };
        let (all, extended) = model.as_ref().map_or((&[][..], self.baseline), |model| (&model.chosen, &model.stand));
        let others = subject.as_likely(all, extended, self.order());
        weak |= self.tell_parameters(&mut causes, &kept, all, extended, &others);
        let with_all = model.as_ref().map_or(&quiet, |model| &model.errors);
        let extended_score = with_all.score.clone();
        self.complete(&mut causes, (all, extended), &before, &left);
        let (own, with_causes) = (self.own_parameters(), if all.is_empty() { self.own_parameters() } else { self.parameters(all, extended, &others) });
        // Causes that do not make the free run better are not all there is, and no more are those beside a mass below zero.
        let flagged = |parameters: &[ModelParameter]| parameters.iter().any(|p| p.flag.is_some());
        let active = is_active(&with_causes) && !is_active(&own);
        weak |= !all.is_empty() && (extended_score.is_worse_than(&before.score) || flagged(&with_causes) || active);
        if flagged(&with_causes) && flagged(&own) {
            // Beside matrices of no body a name proves nothing.
            causes.iter_mut().for_each(|cause| cause.believe_at_most(UNSURE));
        } else if flagged(&with_causes) || active {
            self.doubt_what_turns_signs(&mut causes, &steps, &kept);
        }
        let by_itself = if model.is_none() { unmodelled } else { self.by_itself((all, extended), windows_hz) };
        let lost = with_all.is_lost(&by_itself, self.court.block());
        let elsewhere = self.elsewhere((all, extended), with_all);
        let verdict = left.verdict(!causes.is_empty(), weak, lost, elsewhere.is_some());
        noise_floor.below(&extended_score);
        elsewhere.iter().for_each(|elsewhere| noise_floor.beside_another_plant(&elsewhere.floor));
        causes.iter().for_each(|cause| noise_floor.below(&Score { nrmse: cause.gain.nrmse_after.clone(), ..Score::default() }));
        if verdict == Verdict::Adequate {
            noise_floor = NoiseFloor::of_the_rest(&extended_score);
        }
        let mut notes = left.notes(self, &before, noise_floor.variance(), !causes.is_empty(), elsewhere.as_ref());
        notes.extend(of_no_body("baseline", &own));
        notes.extend(of_no_body("extended model", &with_causes));
        let sample_rate_hz = subject.layout.rate_hz * subject.layout.factor as f64;
        let open = self.linear.is_some_and(|fit| fit.hold.is_none()) && !self.meaning.motion_imposed;
        for cause in &mut causes {
            let latency = cause.lead.and_then(|lead| self.hypothesis(lead).effect.latency);
            let efforts = open.then_some(&self.meaning.effort_names[..]);
            latency.into_iter().for_each(|latency| within_a_tick::told(cause, &latency, efforts, 0.5 / sample_rate_hz));
        }
        let pictures = self.pictures(all, extended);
        let diagnosis = Diagnosis {
            split,
            baseline: Model { model: "inertia-damping-stiffness".to_owned(), parameters: own, held_out: before.score.clone() },
            discrepancy: self.discrepancy(&before, elsewhere.map(|elsewhere| elsewhere.told), notes),
            noise_floor,
            verdict,
            extended: Extended {
                model: extended_name(&causes),
                parameters: with_causes,
                held_out: extended_score,
                residual_white: left.white(),
                parameter_shift: self.shift(all, extended, &others),
            },
            causes,
            considered: self.considered(),
            minor: small.iter().map(|(group, why)| self.minor(group, why)).chain(self.of_instruments()).collect(),
            confusable,
        };
        (diagnosis, pictures)
    }

    /// Adds what a curved arm tells of its joints, what was detected, and the limb's own force.
    fn complete(&self, causes: &mut Vec<Cause>, (all, extended): (&[Chosen], &Stand), before: &Errors, left: &Left) {
        for cause in causes.iter_mut().filter(|cause| self.is_geometry(cause)) {
            cause.parameters.extend(self.subject.joints(all, extended));
            if matches!(self.subject.cause, state::Cause::Loop(_)) {
                cause.evidence.push(BEHIND_A_HOLD.to_owned());
            }
        }
        self.detected(causes, before, left.limit);
        if left.may_be_its_own() {
            self.own_force(causes, before);
        }
    }

    /// The cause of each step, and whether one of them helps the free run little while a large error stays: that cannot be sure.
    fn named(&self, steps: &[Step], gains: &Gains, mut last: Errors, [level, limit, excess]: [f64; 3], confusable: &mut Vec<Confusable>) -> (Vec<Cause>, bool) {
        let mut weak = false;
        let mut members = Vec::new();
        // What stays once all of them are there: of several causes none takes most of the error by itself.
        let all: Vec<usize> = steps.iter().flat_map(|step| step.group.members.iter().copied()).collect();
        let stays = self.errors_of(&all).and_then(|errors| errors.mean()).map_or(0.0, |all| (all - level).max(0.0));
        let of_step = |(k, step): (usize, &Step)| {
            members.extend(&step.group.members);
            let after = self.errors_of(&members).unwrap_or_else(|| last.clone());
            let mut cause = self.cause(&step.group, gains.of(k, [&last, &after]), limit, confusable);
            // Nor can one that the part that no fit saw speaks against, whatever the free run says.
            let against = cause.gain.log_likelihood_ci95.is_some_and(|[_, high]| high < 0.0);
            let little = last.mean().zip(after.mean()).is_some_and(|(last, after)| last - after < LITTLE * (last - after + stays));
            if against || little && excess > 5.0 * self.options.tolerance {
                cause.believe_at_most(UNSURE);
                weak = true;
            }
            last = after;
            cause
        };
        let causes = steps.iter().enumerate().map(of_step).collect();
        (causes, weak)
    }

    /// A mass, a damping or a stiffness below zero is what a wrong law is paid with: a cause without which none is cannot be sure, and where there is no such
    /// cause, which of them it is does not show, and none can.
    fn doubt_what_turns_signs(&self, causes: &mut [Cause], steps: &[Step], kept: &[usize]) {
        let turns = |cause: &Cause| {
            let step = steps.iter().find(|step| cause.lead.is_some_and(|lead| step.group.members.contains(&lead)))?;
            let others: Vec<usize> = kept.iter().filter(|q| !step.group.members.contains(q)).copied().collect();
            let without = self.model(&others).map(|model| self.parameters(&model.chosen, &model.stand, &[]));
            Some(without.is_some_and(|without| without.iter().all(|p| p.flag.is_none()) && !is_active(&without)))
        };
        let turn: Vec<Option<bool>> = causes.iter().map(turns).collect();
        let none_alone = !turn.contains(&Some(true));
        causes.iter_mut().zip(turn).filter(|(_, turns)| turns.is_some_and(|turns| turns || none_alone)).for_each(|(cause, _)| cause.believe_at_most(UNSURE));
    }

    /// The causes as they are in the final model; their intervals hold those of other knobs and forms that the data like as well. Whether one of them is doubted:
    /// a law with a sign that it cannot have stands for another.
    fn tell_parameters(&self, causes: &mut [Cause], kept: &[usize], all: &[Chosen], extended: &Stand, others: &[(Vec<Chosen>, Stand)]) -> bool {
        let (subject, mut doubted) = (self.subject, false);
        for (position, cause) in causes.iter_mut().filter_map(|cause| Some((kept.binary_search(&cause.lead?).ok()?, cause))) {
            cause.parameters = subject.named(all, extended, position);
            let mut forms: Vec<&str> = Vec::new();
            for (chosen, stand) in others {
                let label = subject.hypotheses[chosen[position].hypothesis].form.label;
                if chosen[position].hypothesis != all[position].hypothesis && !forms.contains(&label) {
                    forms.push(label);
                }
                let mut named = subject.named(chosen, stand, position);
                if subject.hypotheses[all[position].hypothesis].effect.latency.is_some_and(|latency| latency.grows_by.is_some()) {
                    in_the_same_channel(&mut named, &cause.parameters);
                }
                for other in named {
                    cause.parameters.iter_mut().filter(|own| own.name == other.name).for_each(|own| own.widen(&other));
                }
            }
            let own = &all[position];
            let form = &subject.hypotheses[own.hypothesis].form;
            if let Some((remark, axis)) = form.remark.zip(form.axis) {
                let of = [Matrix::Mass, Matrix::Damping, Matrix::Stiffness].map(|matrix| subject.matrix(all, extended, matrix)[axis][axis]);
                cause.evidence.push(remark(&own.knobs, subject.coefficients(extended, position), of, subject.scale.rotational));
            }
            let at_an_end = subject.at_an_end(all, extended, position);
            let bounds: Vec<&str> = cause.parameters.iter().zip(at_an_end).filter(|(_, at)| *at).map(|(parameter, _)| parameter.name.as_str()).collect();
            if !bounds.is_empty() {
                cause.evidence.push(format!("{}: at an end of the range that was searched, so that it is a bound and has no interval", bounds.join(", ")));
            }
            if !forms.is_empty() {
                cause.evidence.push(format!("as likely in another form ({}): its intervals hold the values of both", forms.join(", ")));
            }
            if subject.has_a_forbidden_sign(all, extended, position) {
                cause.believe_at_most(UNSURE);
                cause.evidence.push("one of its numbers has a sign that the law cannot have: it stands for something else".to_owned());
                doubted = true;
            }
            if let Some(schedule) = &self.options.schedule {
                cause.over_schedule = subject.curves(schedule, &self.meaning.axes, all, extended, position);
                cause.parameters.extend(cause.over_schedule.iter().flat_map(Curve::ends));
                cause.evidence.splice(1..1, cause.over_schedule.iter().map(Curve::sentence));
            }
        }
        doubted
    }

    /// Groups that are to be named, those that are not with the reason, and whether one of these matters and is not what its name says.
    fn sorted_out(&self, ends: &Ends) -> (Vec<Group>, Vec<(Group, String)>, bool) {
        let (mut small, mut absent): (Vec<(Group, String)>, Vec<Vec<usize>>) = (Vec::new(), Vec::new());
        let mut left: Vec<usize> = (0..self.found.chosen.len()).collect();
        // One at a time, the least worth first: two that stand in for each other are small beside each other, and one of them alone is not.
        let mut named = loop {
            let mut groups = self.groups(&left);
            let top = (groups.first().map_or(0.0, |g| g.worth), groups.iter().map(|g| g.size).fold(0.0, f64::max));
            let small_one = (0..groups.len()).rev().find_map(|k| Some((k, self.immaterial(&groups[k], top)?, false)));
            let absent_one = || (0..groups.len()).rev().find_map(|k| Some((k, self.absent(&groups[k])?, true)));
            let Some((k, why, is_absent)) = small_one.or_else(absent_one) else { break groups };
            let group = groups.remove(k);
            left.retain(|q| !group.members.contains(q));
            if is_absent {
                absent.push(group.members.clone());
            }
            small.push((group, why));
        };
        // What helps to predict data that no fit saw in no way is not named.
        let mut contradicted = false;
        while let Some((idle, why)) = self.idle(&named, ends) {
            let group = named.remove(idle);
            contradicted |= self.is_something(&group, &named, ends);
            small.push((group, why));
        }
        // What it was found by may be there no more beside what is named.
        let matters = |members: &Vec<usize>| {
            let beside: Vec<usize> = named.iter().flat_map(|g| &g.members).chain(members).copied().collect();
            self.groups(&beside).iter().any(|g| g.members == *members && g.worth > 0.0 && self.immaterial(g, (0.0, 0.0)).is_none())
        };
        let nameless = contradicted || absent.iter().any(matters);
        (named, small, nameless)
    }
}

/// A delay as that of the channel in which another is told: an effort that is late is a motion that is early.
fn in_the_same_channel(delay: &mut [CauseParameter], told: &[CauseParameter]) {
    let channel = |parameters: &[CauseParameter]| parameters.iter().find(|p| p.name == "channel").map(|p| p.value.clone());
    if channel(delay) != channel(told) {
        delay.iter_mut().for_each(CauseParameter::negate);
    }
}

/// Whether the damping of an axis is below zero by more than two standard errors: what only a force that answers late, or a wrong law, makes.
fn is_active(parameters: &[ModelParameter]) -> bool {
    let of_one_axis = |axes: &str| axes.split_at_checked(axes.len() / 2).is_some_and(|(a, b)| a == b);
    let is_damping = |p: &ModelParameter| p.name.strip_prefix('B').is_some_and(of_one_axis);
    parameters.iter().any(|p| is_damping(p) && p.std_error.is_some_and(|error| p.value + 2.0 * error < 0.0))
}

/// What to think of inertias and stiffnesses that no body has.
fn of_no_body(model: &str, parameters: &[ModelParameter]) -> Vec<String> {
    let note = |(flag, what): (ParameterFlag, &str)| {
        let names: Vec<&str> = parameters.iter().filter(|p| p.flag == Some(flag)).map(|p| p.name.as_str()).collect();
        let verb = if names.len() == 1 { "is" } else { "are" };
        (!names.is_empty()).then(|| format!("{} of the {model} {verb} {what}", names.join(", ")))
    };
    let kinds = [
        (ParameterFlag::BelowZero, "below zero beyond doubt: a sign, the band or the model is wrong there"),
        (ParameterFlag::OfNoBody, "larger beyond doubt than any body with these inertias along its axes has: two channels may stand in each other's place"),
    ];
    kinds.into_iter().filter_map(note).collect()
}

fn extended_name(causes: &[Cause]) -> String {
    std::iter::once("inertia-damping-stiffness".to_owned()).chain(causes.iter().map(|c| c.effect.clone())).collect::<Vec<_>>().join(" + ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_models::effects::Value;

    #[test]
    fn a_damping_of_one_axis_beyond_its_error_below_zero_is_active() {
        let parameter = |name: &str, value, std_error| ModelParameter { name: name.to_owned(), unit: String::new(), value, std_error, flag: None };
        for (name, value, std_error, active) in [
            ("B", -3.0, Some(1.0), true),
            ("B_x_x", -3.0, Some(1.0), true),
            ("B_x_x", -3.0, Some(2.0), false),
            ("B_x_y", -3.0, Some(1.0), false),
            ("K", -3.0, Some(1.0), false),
            ("B", -3.0, None, false),
        ] {
            assert_eq!(is_active(&[parameter(name, value, std_error)]), active, "{name} {value}");
        }
    }

    /// An effort that is 25 ms early is a motion that is as late: its interval holds that, and not both signs.
    #[test]
    fn a_delay_of_either_channel_has_an_interval_of_one_sign() {
        let parameter = |name: &str, value, ci95| CauseParameter { name: name.to_owned(), unit: String::new(), value, ci95 };
        let delay = |seconds: f64, of: &str| {
            [parameter("delay_s", Value::Number(seconds), Some([seconds - 4e-4, seconds + 3e-4])), parameter("channel", Value::Text(of.to_owned()), None)]
        };
        let told = delay(-0.025, "force_x");
        for (mut other, expected) in [(delay(0.0251, "pos_x"), [-0.0254, -0.0247]), (delay(-0.0251, "force_x"), [-0.0255, -0.0247])] {
            in_the_same_channel(&mut other, &told);
            let mut own = told[0].clone();
            own.widen(&other[0]);
            let found = own.ci95.expect("an interval");
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        }
    }
}
