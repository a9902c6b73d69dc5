//! Other causes in place of one that is named.

use crate::causes::Form;
use crate::gears;
use crate::held_out::{Sum, losses};
use crate::model::{Model, residual};
use crate::search::{Rule, Solved};
use crate::table::View;

/// Others that are compared with a cause, the best first.
const MOST: usize = 3;
/// Two models are told apart where one is better with this probability.
pub(crate) const TOLD_APART: f64 = 0.95;

/// Their forms, and the probability that the one is better.
pub(crate) fn rivals(views: [&View<'_>; 2], rule: &Rule<'_>, model: &Model, k: usize) -> Vec<(usize, f64)> {
    let own = &model.forms[k];
    let less = model.without(views[0], k);
    let solved = searched_as(rule, &less);
    let mut by: Vec<(usize, f64)> = rule
        .forms
        .iter()
        .enumerate()
        .filter(|(_, f)| !model.forms.iter().any(|m| m.same_place(f)))
        .filter(|(_, f)| related(own, f))
        // A gear that has neither settled nor follows its load is no rival yet: what it changes is of another compliance.
        .filter(|(_, f)| f.gear().is_none_or(|gear| gear.extent == 0.0 || !gear.is_searched()))
        .map(|(f, _)| {
            let (gained, freedoms) = solved.gain(rule.table, &rule.table.columns[f]);
            (f, gained - freedoms as f64 * (rule.table.samples as f64).ln())
        })
        .collect();
    by.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut places: Vec<usize> = Vec::new();
    // A spring that rests turns away, a friction that pushes, or a gear that gives the other way rivals nothing; of one that settled the data chose the compliance.
    let columns = |f: usize| &rule.table.columns[f];
    let possible =
        |f: usize| rule.forms[f].gear().is_some_and(|gear| gear.extent > 0.0) || rule.forms[f].allows(&solved.with(rule.table, columns(f)).of(columns(f)));
    for (f, worth) in by {
        if worth > 0.0 && possible(f) && places.len() < MOST && !places.iter().any(|p| rule.forms[*p].same_place(&rule.forms[f])) {
            places.push(f);
        }
    }
    let in_place = |f: usize| {
        let forms: Vec<Form> = less.forms.iter().chain([&rule.forms[f]]).cloned().collect();
        let mut rival = Model::fit(views[0], &forms, &less.logged);
        gears::begin(views[0], views[1], &mut rival);
        (f, likelier(&better(views, rule, model, &rival)))
    };
    places.into_iter().map(in_place).collect()
}

/// How much likelier a model is than another, by blocks of time of all that there is, less what the columns that are its own would gain by chance.
pub(crate) fn better(views: [&View<'_>; 2], rule: &Rule<'_>, one: &Model, other: &Model) -> Sum {
    let short = |model: &Model| views.iter().flat_map(|view| losses(view, &residual(view, model))).collect::<Vec<_>>();
    let columns = |model: &Model| searched_as(rule, model).kept.len() as f64;
    let penalty = 0.5 * (columns(other) - columns(one)) * (rule.table.samples as f64).ln();
    let sum = Sum::of(&short(other).iter().zip(&short(one)).map(|(a, b)| a - b).collect::<Vec<_>>());
    Sum { value: sum.value + penalty, ..sum }
}

/// The probability of either of two models that are the same.
pub(crate) const EITHER: f64 = 0.5;
/// Log-likelihood that round-off makes, and no odds.
const ROUND_OFF: f64 = 1e-6;

/// The probability that the one is better: no further from a half than the odds are, of which blocks that all agree on next to nothing know nothing.
fn likelier(sum: &Sum) -> f64 {
    let (blocks, odds) = (sum.positive(), 1.0 / (1.0 + (-sum.value).exp()));
    match sum.value {
        x if x.abs() < ROUND_OFF => EITHER,
        x if x > 0.0 => blocks.min(odds),
        _ => blocks.max(odds),
    }
}

/// Whether two forms act on a joint in common.
fn related(a: &Form, b: &Form) -> bool {
    a.joint == b.joint || a.joint.is_none() || b.joint.is_none() || [a, b].iter().any(|f| f.cause.card.side == "link")
}

/// The model of the forms that fitted ones came from; of gears the nearest.
fn searched_as(rule: &Rule<'_>, model: &Model) -> Solved {
    let of = |fitted: &Form| {
        let away = |form: &Form| form.gear().zip(fitted.gear()).map_or(0.0, |(a, b)| (a.extent / b.extent).ln().abs());
        let alike = |form: &Form| form.same_place(fitted) && form.columns.len() == fitted.columns.len();
        (0..rule.forms.len()).filter(|f| alike(&rule.forms[*f])).min_by(|a, b| away(&rule.forms[*a]).total_cmp(&away(&rule.forms[*b])))
    };
    rule.solve(&model.forms.iter().filter_map(of).collect::<Vec<_>>())
}
