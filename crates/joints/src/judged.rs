//! Which causes hold: a search, a fit, and what of it predicts what was held out.

use crate::causes::Form;
use crate::column::Column;
use crate::gears;
use crate::held_out::{falls, gain, missed, sure};
use crate::left_noise::Floor;
use crate::logged::Logged;
use crate::model::{Model, put_back, residual};
use crate::options::Options;
use crate::refined;
use crate::rivals::{TOLD_APART, better, rivals};
use crate::search::{Rule, hypotheses};
use crate::sizes::Sizes;
use crate::table::{Table, View};
use ndof_signal::rms;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// Probability with which a cause has to predict what was held out: a gain whose 95 % interval has nothing in it is none. What was fitted has been asked before.
const SURE: f64 = 0.975;
/// Probability with which the plain error has to fall as well: more likely than not, as slow noise hides from it what the likelihood sees.
const FALLS: f64 = 0.5;
/// At most so many causes a joint: beyond it is a robot that this file is not of.
const CAUSES_A_JOINT: usize = 6;

/// Standard errors within which a gain may be none: odds of 1000 by the normal law.
const WIDE: f64 = 3.3;

/// Whether what is judged logged motions and torques of its own.
pub(crate) fn of_a_simulator(view: &View<'_>) -> bool {
    view.motions.iter().any(|motion| !motion.beyond.is_empty())
}

fn form_of_gain(form: &Form) -> bool {
    matches!(form.columns[..], [Column::Torque(_) | Column::Torques])
}

/// What a search starts from.
pub(crate) struct Searched {
    pub table: Table,
    /// What no column explains of each joint's torque in the band.
    pub floor: Vec<Floor>,
    /// Samples of each joint less the factors of all columns: what its noise is known by.
    pub left: Vec<f64>,
    sizes: Sizes,
    hypotheses: usize,
}

impl Searched {
    pub fn new(view: &View<'_>, forms: &[Form], floor: Vec<Floor>, left: Vec<f64>) -> Self {
        let (columns, places) = Table::distinct(forms);
        let missing = view.missing(&Logged::as_it_is(view.scene.joints.len())).whitened(&view.noise);
        Searched { table: Table::new(places, &view.white(&columns), &missing), floor, left, sizes: Sizes::new(view, forms), hypotheses: hypotheses(forms) }
    }

    pub fn rule<'a>(&'a self, forms: &'a [Form], options: &'a Options) -> Rule<'a> {
        Rule { table: &self.table, forms, left: &self.left, sizes: &self.sizes, hypotheses: self.hypotheses, options }
    }
}

/// A cause that is significant and not named, and why.
#[derive(Clone)]
pub(crate) struct Aside {
    pub form: Form,
    pub removed: f64,
    pub why: String,
}

/// A model and what each of its forms is worth on the held-out part.
pub(crate) struct Judged {
    pub model: Model,
    worth: Vec<Worth>,
    /// Forms that are not to be named, and why.
    failing: Vec<(usize, String)>,
}

/// What a form is worth on the held-out part.
struct Worth {
    /// Log-likelihood that it gains.
    gain: f64,
    /// Probability that it gains at all.
    sure: f64,
    /// Probability that the plain error falls.
    falls: f64,
    /// By how much of the joint's torque its error rises as it was logged, above the band as well: where a joint hardly moves, a cause makes torque of the noise of its encoder.
    rises: f64,
    /// Its share of the joint's torque.
    matters: f64,
}

impl Judged {
    fn new(fitted: &View<'_>, held: &View<'_>, model: Model, options: &Options) -> Self {
        let worth: Vec<Worth> = (0..model.forms.len()).into_par_iter().map(|k| worth(fitted, held, &model, k)).collect();
        let simulated = of_a_simulator(fitted);
        let failing = worth.iter().enumerate().filter_map(|(k, worth)| Some((k, reason(&model, k, worth, options, simulated)?))).collect();
        Judged { model, worth, failing }
    }
}

fn worth(fitted: &View<'_>, held: &View<'_>, model: &Model, k: usize) -> Worth {
    let less = model.without(fitted, k);
    let (sure, falls) = (sure(held, &less, model), falls(held, &less, model));
    // A whole run along the log is dear, and what fails before is not asked for it.
    let own = model.forms[k].joint.filter(|_| model.forms[k].cause.card.side == "joint" && sure >= SURE && falls >= FALLS);
    let rises = own.map_or(0.0, |j| missed(held, model, j) - missed(held, &less, j));
    Worth { gain: gain(held, &less, model).value, sure, falls, rises, matters: share(held, model, k) }
}

/// Why a form is not to be named.
fn reason(model: &Model, k: usize, worth: &Worth, options: &Options, simulated: bool) -> Option<String> {
    // Of what the file has, less than none by no more than chance is none.
    let too_little = model.forms[k].least(&model.factors[k]).is_some() && model.beyond[k] > WIDE;
    if too_little || !model.forms[k].allows(&model.factors[k]) {
        return Some("it would need a parameter below zero".to_owned());
    }
    // A rotor beside it would be enough.
    if model.gives(k).is_some_and(|errors| errors < Normal::standard().inverse_cdf(1.0 - options.false_alarms)) {
        return Some("that the gear gives at all is not beyond chance".to_owned());
    }
    // Beside a simulator's own forces, which keep their size, a gain of none and bodies without end would be one more way to fit.
    if simulated
        && form_of_gain(&model.forms[k])
        && model.told(k).first().is_some_and(|(_, _, gain, error, _)| error.is_none_or(|error| gain.abs() < WIDE * error))
    {
        return Some("that its log is of the robot's torque at all is not beyond chance".to_owned());
    }
    if worth.sure < SURE {
        return Some("what was held out is not predicted better with it beyond chance".to_owned());
    }
    if worth.falls < FALLS || worth.rises > options.tolerance {
        return Some("the error of what was held out does not fall with it".to_owned());
    }
    (worth.matters < options.tolerance)
        .then(|| format!("its torque is {:.2} % of the joint's, below the tolerance of {:.2} %", 100.0 * worth.matters, 100.0 * options.tolerance))
}

/// A model all of whose causes hold, by their numbers among the forms, and what was set aside for it.
pub(crate) struct HeldUp {
    pub judged: Judged,
    chosen: Vec<usize>,
    pub minor: Vec<Aside>,
}

/// A model at its best for what is fitted, ready to be run along what is held out.
fn refined([fitted, held]: [&View<'_>; 2], forms: &[Form], logged: &Logged) -> Model {
    let mut model = refined::refined(fitted, forms, logged);
    gears::begin(fitted, held, &mut model);
    model
}

/// At most so many causes of a robot.
pub(crate) fn most_causes(view: &View<'_>) -> usize {
    CAUSES_A_JOINT * view.scene.joints.len() + 2
}

/// Searches, fits and judges until each cause predicts something of what was held out and matters: the one that is worth least is set aside, and
/// the search goes on without it. It begins with what was chosen and set aside before.
pub(crate) fn held_up(
    [fitted, held]: [&View<'_>; 2],
    rule: &Rule<'_>,
    options: &Options,
    (mut chosen, mut minor): (Vec<usize>, Vec<Aside>),
    progress: &mut dyn FnMut(&str),
) -> HeldUp {
    let most = most_causes(fitted);
    let plain = Logged::as_it_is(fitted.noise.len());
    let refined = |chosen: &[usize]| refined([fitted, held], &chosen.iter().map(|k| rule.forms[*k].clone()).collect::<Vec<_>>(), &plain);
    loop {
        let aside: Vec<&Form> = minor.iter().map(|m| &m.form).collect();
        rule.search(&mut chosen, &aside, most);
        progress("fitting what was found");
        let judged = Judged::new(fitted, held, refined(&chosen), options);
        let mut failing = judged.failing.clone();
        if failing.is_empty() {
            return HeldUp { judged, chosen, minor };
        }
        failing.sort_by(|(a, _), (b, _)| judged.worth[*a].gain.total_cmp(&judged.worth[*b].gain));
        // One of each place: what one joint lacks hardly changes with what another has.
        let mut gone: Vec<usize> = Vec::new();
        for (k, why) in failing {
            let form = &judged.model.forms[k];
            if !gone.iter().any(|g| judged.model.forms[*g].joint == form.joint) {
                minor.push(Aside { form: form.clone(), removed: judged.worth[k].matters, why });
                gone.push(k);
            }
        }
        chosen = chosen.iter().enumerate().filter(|(k, _)| !gone.contains(k)).map(|(_, f)| *f).collect();
    }
}

/// [`held_up`], those that were set aside asked once more, and what another cause beats put out for it: beside a wrong cause a right one may look superfluous.
pub(crate) fn judged(views: [&View<'_>; 2], rule: &Rule<'_>, options: &Options, progress: &mut dyn FnMut(&str)) -> (Model, Vec<Aside>) {
    let mut found = held_up(views, rule, options, (vec![], vec![]), progress);
    let mut put_out = Vec::new();
    loop {
        progress("asking again what was set aside");
        ask_again(views, rule, options, &mut found);
        let Some(next) = exchanged(views, rule, options, &found, &mut put_out, progress) else { break };
        found = next;
    }
    let Judged { mut model, worth, .. } = found.judged;
    model.order(&worth.iter().map(|w| w.gain).collect::<Vec<_>>());
    (model, found.minor)
}

/// Takes in what was set aside and holds beside what was found.
fn ask_again([fitted, held]: [&View<'_>; 2], rule: &Rule<'_>, options: &Options, found: &mut HeldUp) {
    while found.chosen.len() < most_causes(fitted) {
        let solved = rule.solve(&found.chosen);
        let mut again: Vec<(usize, usize, f64)> = found
            .minor
            .iter()
            .enumerate()
            .filter_map(|(m, aside)| rule.best(&solved, |k| rule.forms[k].same_place(&aside.form)).map(|(k, worth)| (m, k, worth)))
            .collect();
        again.sort_by(|a, b| b.2.total_cmp(&a.2));
        let (last, model) = (found.chosen.len(), &found.judged.model);
        let better = again.into_iter().find_map(|(m, k, _)| {
            let forms: Vec<Form> = model.forms.iter().chain([&rule.forms[k]]).cloned().collect();
            // What does not even look likely before it is moved to its best is not worth that; of a gear that says nothing.
            let near = Model::fit(fitted, &forms, &model.logged);
            if rule.forms[k].gear().is_none() && worth(fitted, held, &near, last).sure < 0.5 {
                return None;
            }
            let model = refined([fitted, held], &forms, &model.logged);
            if reason(&model, last, &worth(fitted, held, &model, last), options, of_a_simulator(fitted)).is_some() {
                return None;
            }
            let judged = Judged::new(fitted, held, model, options);
            judged.failing.is_empty().then_some((m, k, judged))
        });
        let Some((m, k, judged)) = better else { break };
        found.minor.remove(m);
        found.chosen.push(k);
        found.judged = judged;
    }
}

/// What holds with another cause in place of one that it beats, if that is likelier in all; each is put out once.
fn exchanged(
    views: [&View<'_>; 2],
    rule: &Rule<'_>,
    options: &Options,
    found: &HeldUp,
    put_out: &mut Vec<Form>,
    progress: &mut dyn FnMut(&str),
) -> Option<HeldUp> {
    let model = &found.judged.model;
    for (k, own) in model.forms.iter().enumerate() {
        if put_out.iter().any(|form| form.same_place(own)) {
            continue;
        }
        let Some((other, _)) = rivals(views, rule, model, k).into_iter().find(|(_, better)| *better < 1.0 - TOLD_APART) else { continue };
        put_out.push(own.clone());
        let (mut chosen, mut minor) = (found.chosen.clone(), found.minor.clone());
        chosen[k] = other;
        minor.retain(|aside| !aside.form.same_place(&rule.forms[other]));
        minor.push(Aside { form: own.clone(), removed: found.judged.worth[k].matters, why: "another cause in its place predicts better".to_owned() });
        let next = held_up(views, rule, options, (chosen, minor), progress);
        if better(views, rule, &next.judged.model, model).value > 0.0 {
            return Some(next);
        }
    }
    None
}

/// rms of a form's torque over the deviation of the joint's, where it is largest.
pub(crate) fn share(view: &View<'_>, model: &Model, k: usize) -> f64 {
    let (mut forms, mut factors) = (model.forms.clone(), model.factors.clone());
    let logged = put_back(&model.logged, &forms.remove(k));
    factors.remove(k);
    let without = Model { forms, factors, logged, covariance: vec![], places: vec![], beyond: vec![] };
    let mut change = residual(view, &without);
    change.add(-1.0, &residual(view, model));
    (0..view.scene.joints.len()).map(|j| rms(&change.of_joint(j)) / view.scene.joints[j].torque.max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::CAUSES;
    use crate::noise::Whitener;
    use crate::shared_tests::of_a_pendulum;

    /// A rotor beside a gear may be all that there is: one of a hundred gears that give nothing is 2.33 standard errors beyond it.
    #[test]
    fn a_gear_that_gives_no_more_than_chance_is_not_named_whatever_its_rotor_gains() {
        let at = |f: fn(f64) -> f64| (0..1000).map(|k| f(0.013 * f64::from(k))).collect();
        of_a_pendulum(at(f64::sin), at(f64::cos), |scene, _| {
            for cause in CAUSES.iter().filter(|c| ["backlash", "joint-flexibility"].contains(&c.card.name)) {
                let form = (cause.forms)(scene).into_iter().find(|form| form.columns.len() == 2).expect("one with a rotor");
                let extent = form.columns[0].factor().expect("it is made with one");
                let judged = |errors: f64| {
                    let covariance = vec![vec![(extent / errors).powi(2), 0.0], vec![0.0, 1e-6]];
                    let (forms, factors, places) = (vec![form.clone()], vec![vec![extent, 0.1]], vec![vec![Some(0), Some(1)]]);
                    let model = Model { forms, factors, covariance, places, logged: Logged::as_it_is(1), beyond: vec![0.0] };
                    reason(&model, 0, &Worth { gain: 100.0, sure: 1.0, falls: 1.0, rises: 0.0, matters: 1.0 }, &Options::default(), false)
                };
                assert!(judged(2.3).is_some_and(|why| why.contains("beyond chance")) && judged(2.4).is_none(), "{}", cause.card.name);
            }
        });
    }

    /// On long logs there is something of every kind that is beyond chance.
    #[test]
    fn what_is_below_the_tolerance_is_not_looked_for() {
        let angle: Vec<f64> = (0..2000).map(|k| (0.03 * f64::from(k)).sin()).collect();
        // The body weighs up to 5.9 N m, and 5 mN m are a thousandth of it and beyond this noise.
        let torque = angle.iter().enumerate().map(|(k, q)| -0.18 * 9.0 * q - 5.886 * q.cos() + 5e-3 + 1e-4 * (1.7 * k as f64).sin()).collect();
        of_a_pendulum(angle, torque, |scene, view| {
            let view = view.in_noise(vec![Whitener::plain(1e-3)]);
            let forms: Vec<Form> = CAUSES.iter().filter(|c| c.card.name == "torque-offset").flat_map(|c| (c.forms)(scene)).collect();
            let searched = Searched::new(&view, &forms, vec![Floor { deviation: 1e-3, samples: 2000.0 }], vec![2000.0]);
            let chosen = |tolerance: f64| {
                let (mut chosen, options) = (Vec::new(), Options { tolerance, ..Options::default() });
                searched.rule(&forms, &options).search(&mut chosen, &[], 8);
                chosen.len()
            };
            assert_eq!([0.01, 1e-4].map(chosen), [0, 1]);
        });
    }
}
