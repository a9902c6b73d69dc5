//! A model at its best: shapes, channels and gears moved to where the likelihood is greatest, and intervals.

use crate::blocks::block_products;
use crate::bodies::turning;
use crate::causes::Form;
use crate::column::Column;
use crate::gears;
use crate::held_out::losses;
use crate::logged::Logged;
use crate::model::{Model, open, residual, solved};
use crate::search::{Rule, Solved};
use crate::table::{Series, View};
use ndof_models::golden;
use ndof_sysid::two_sided_t;
use std::sync::Arc;

/// Shapes and channels moved from where they are to where the likelihood is greatest, one after the other, and intervals of all.
pub(crate) fn refined(view: &View<'_>, searched: &[Form], log: &Logged) -> Model {
    let (mut forms, mut logged) = (searched.to_vec(), log.clone());
    // Twice: what one shape takes from another is of second order by then.
    for _ in 0..2 {
        settle_channels(view, &forms, &mut logged);
        gears::settle(view, &mut forms, &logged);
        settle_shapes(view, &mut forms, &logged);
    }
    settle_channels(view, &forms, &mut logged);
    gears::settle(view, &mut forms, &logged);
    let mut model = Model::fit(view, &forms, &logged);
    if model.factors.iter().flatten().any(|factor| !factor.is_finite()) {
        // A link that swings on its gear fell over on the way: what was searched is left as it was.
        model = Model::fit(view, searched, log);
    }
    intervals(view, &mut model);
    model
}

/// The covariance of factors and shapes: of white noise, or from the scatter of blocks of time where that is larger.
fn intervals(view: &View<'_>, model: &mut Model) {
    let mut series = Vec::new();
    let mut places = Vec::new();
    for (form, factors) in model.forms.iter().zip(&model.factors) {
        let first = series.len();
        series.extend(view.white(&form.columns));
        let mut beside = Vec::new();
        for (k, column) in form.columns.iter().enumerate() {
            if let Column::Tilt { axis, .. } = column {
                let there = Column::Weight(turning(view.scene.chain.gravity(), &model.logged.tilt)[*axis]);
                series[first + k] = view.white(&[there]).swap_remove(0);
                continue;
            }
            let mut changes = gears::changes(view, &model.forms, column).into_iter().map(|x| Arc::new(x.whitened(&view.noise)));
            if let Some(own) = changes.next() {
                series[first + k] = own;
                beside.extend(changes);
            }
        }
        for (k, shape) in form.shape.iter().enumerate() {
            series.push(Arc::new(slope(view, form, factors, k, shape.bounds).whitened(&view.noise)));
        }
        places.push((first..series.len()).collect::<Vec<_>>());
        // What is fitted beside them and not told takes its part as well.
        series.extend(beside);
    }
    let rest = residual(view, model).whitened(&view.noise);
    let (_, found) = solved(&series, &rest);
    model.places = places.iter().map(|own| own.iter().map(|c| found.kept.iter().position(|k| k == c)).collect()).collect();
    model.covariance = sandwich(&found, &series, &rest);
    let factors = found.factors();
    let beyond = |place: &Vec<Option<usize>>| place.first().copied().flatten().map_or(0.0, |at| factors[at].abs() / model.covariance[at][at].sqrt());
    model.beyond = model.places.iter().map(beyond).collect();
}

/// The change of a form's torque with one of its shapes.
fn slope(view: &View<'_>, form: &Form, factors: &[f64], shape: usize, bounds: [f64; 2]) -> Series {
    // A thousandth of the width: the columns have kinks, and a smaller step would see single samples.
    let step = 1e-3 * (bounds[1] - bounds[0]);
    let at = |by: f64| {
        let mut values: Vec<f64> = form.shape.iter().map(|s| s.value).collect();
        values[shape] += by;
        let series = view.compute(&(form.reshape)(form, &values));
        let mut sum = series[0].clone();
        sum.add(factors[0] - 1.0, &series[0]);
        series.iter().zip(factors).skip(1).for_each(|(s, f)| sum.add(*f, s));
        sum
    };
    let (up, mut change) = (at(step), at(-step));
    let down = change.clone();
    change.add(-2.0, &down);
    change.add(1.0, &up);
    let half = change.clone();
    change.add(0.5 / step - 1.0, &half);
    change
}

/// A⁻¹ S A⁻¹ with the scores S of blocks of time, each variance no less than that of white noise.
///
/// Fitted columns take from the scores of few blocks what they can: with p of them on the same joints the variance is short by (b − p) / b, and its law has
/// b − p degrees of freedom (A. C. Cameron and D. L. Miller, A practitioner's guide to cluster-robust inference, J. Hum. Resour. 50(2) (2015) 317).
fn sandwich(found: &Solved, series: &[Arc<Series>], rest: &Series) -> Vec<Vec<f64>> {
    let white = found.covariance();
    let own: Vec<&Series> = found.kept.iter().map(|k| series[*k].as_ref()).collect();
    let n = own.len();
    let scores = block_products(&own, rest);
    let b = scores.len() as f64;
    if b < 4.0 {
        return white;
    }
    let influence: Vec<Vec<f64>> = scores.iter().map(|s| (0..n).map(|i| (0..n).map(|j| white[i][j] * s[j]).sum()).collect()).collect();
    let robust = |i: usize| {
        let beside = own.iter().filter(|other| other.shares_a_joint_with(own[i])).count() as f64;
        let freedom = (b - beside).max(2.0);
        let wider = two_sided_t(0.95, freedom) / two_sided_t(0.95, b - 1.0);
        influence.iter().map(|x| x[i] * x[i]).sum::<f64>() * b / freedom * wider * wider
    };
    let scale: Vec<f64> = (0..n).map(|i| (robust(i) / white[i][i]).max(1.0).sqrt()).collect();
    (0..n).map(|i| (0..n).map(|j| white[i][j] * scale[i] * scale[j]).collect()).collect()
}

/// Share of itself by which a channel's correction may still move: intervals are far wider.
const SETTLED: f64 = 1e-5;
/// What a step may lose of the log-likelihood: half of it is a standard error, and a line that is left beside a channel fits as much better at times.
const LOST: f64 = 0.5;

/// The fit with a log that is so corrected, and what its log-likelihood is short of.
struct Corrected {
    logged: Logged,
    model: Model,
    short: f64,
}

impl Corrected {
    fn new(view: &View<'_>, forms: &[Form], logged: Logged) -> Self {
        let model = Model::fit(view, &as_they_stand(view, forms, &logged), &logged);
        let short = short(view, &model);
        Corrected { logged, model, short }
    }

    /// Columns of channels, where each of these is, and how far what its column still says would take it.
    fn steps<'f>(&self, forms: &'f [Form]) -> Vec<(&'f Column, f64, f64)> {
        let columns = forms.iter().zip(&self.model.factors).flat_map(|(form, factors)| form.columns.iter().zip(factors));
        columns
            .filter_map(|(column, factor)| Some((column, self.logged.of(column)?, self.logged.beyond(column, *factor)?)))
            .map(|(c, from, next)| (c, from, next - from))
            .collect()
    }
}

/// What the log-likelihood of a model is short of.
fn short(view: &View<'_>, model: &Model) -> f64 {
    losses(view, &residual(view, model)).iter().sum()
}

/// Delays and gains of the logged torques, zeros of the angles and tilt: what their columns still say is added until nothing is left, or as much of it as
/// does not fit worse.
fn settle_channels(view: &View<'_>, forms: &[Form], logged: &mut Logged) {
    if !forms.iter().flat_map(|f| &f.columns).any(|column| logged.of(column).is_some()) {
        return;
    }
    let mut at = Corrected::new(view, forms, logged.clone());
    let mut before: Vec<Option<(f64, f64)>> = Vec::new();
    for _ in 0..4 {
        let steps = at.steps(forms);
        before.resize(steps.len(), None);
        let mut whole = Vec::new();
        for ((column, from, step), before) in steps.into_iter().zip(&mut before) {
            if step.abs() > SETTLED * (from + step).abs() {
                // By the secant of the last two steps: what is left shrinks by a share of itself, which they show.
                let shrinks = before.map_or(0.0, |(at, step_there)| 1.0 + (step - step_there) / (from - at));
                whole.push((column, from, if shrinks.abs() < 0.9 { step / (1.0 - shrinks) } else { step }));
                *before = Some((from, step));
            }
        }
        if whole.is_empty() {
            break;
        }
        let after = |part: f64| {
            let mut logged = at.logged.clone();
            whole.iter().for_each(|(column, from, step)| logged.set(column, from + part * step));
            Some(Corrected::new(view, forms, logged)).filter(|next| next.short <= at.short + LOST)
        };
        let Some(next) = gears::PARTS.into_iter().find_map(after) else { break };
        at = next;
    }
    *logged = at.logged;
}

/// Forms with the lines of a tilt as they are where it is, once it is anywhere: those that lead there are other ones.
fn as_they_stand(view: &View<'_>, forms: &[Form], logged: &Logged) -> Vec<Form> {
    let mut out = forms.to_vec();
    if logged.tilt != [0.0; 3] {
        let lines = turning(view.scene.chain.gravity(), &logged.tilt);
        for column in out.iter_mut().flat_map(|form| &mut form.columns) {
            if let Column::Tilt { axis, .. } = column {
                *column = Column::Weight(lines[*axis]);
            }
        }
    }
    out
}

/// In place of what a search asks for, the likeliest forms of the same places that have several shapes, moved to their best: a grid of these is too coarse
/// to be compared with others.
pub(crate) fn shaped(view: &View<'_>, rule: &Rule<'_>, chosen: &[usize], logged: &Logged) -> Vec<Form> {
    let several = |form: &Form| form.shape.len() > 1;
    let likeliest = |(at, k): (usize, &usize)| {
        let others: Vec<usize> = chosen.iter().copied().enumerate().filter(|(i, _)| *i != at).map(|(_, f)| f).collect();
        let solved = rule.solve(&others);
        let same = (0..rule.forms.len()).filter(|f| several(&rule.forms[*f]) && rule.forms[*f].same_place(&rule.forms[*k]));
        let gained = |f: usize| (f, solved.gain(rule.table, &rule.table.columns[f]).0);
        let best = same.map(gained).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(*k, |(f, _)| f);
        rule.forms[best].clone()
    };
    let mut forms: Vec<Form> = chosen.iter().enumerate().map(likeliest).collect();
    if forms.iter().any(several) {
        // Twice, as where all are refined.
        (0..2).for_each(|_| settle_shapes(view, &mut forms, logged));
    }
    forms.into_iter().filter(several).collect()
}

/// Golden section for each shape.
fn settle_shapes(view: &View<'_>, forms: &mut [Form], logged: &Logged) {
    for k in 0..forms.len() {
        for s in 0..forms[k].shape.len() {
            let others: Vec<Form> = forms.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, f)| f.clone()).collect();
            let (others, missing) = open(view, &others, logged);
            let series = view.white(&others);
            let (table, beside) = solved(&series, &missing);
            let form = forms[k].clone();
            let gained = |value: f64| {
                let mut values: Vec<f64> = form.shape.iter().map(|s| s.value).collect();
                values[s] = value;
                let own: Vec<Series> = view.compute(&(form.reshape)(&form, &values)).iter().map(|x| x.whitened(&view.noise)).collect();
                let more: Vec<usize> = (series.len()..series.len() + own.len()).collect();
                beside.with(&table.beside(&series, &own, &missing), &more).gained
            };
            let (start, [low, high]) = (form.shape[s].value, form.shape[s].bounds);
            let near = 0.2 * (high - low);
            let bracket = ((start - near).max(low), (start + near).min(high));
            // The bracket after the last is a thousandth of the width; bounds of no width end after 40 evaluations.
            forms[k].shape[s].value = golden(bracket, (start, -gained(start)), 1.618e-3 * (high - low), 40, |value| -gained(value));
            let values: Vec<f64> = forms[k].shape.iter().map(|s| s.value).collect();
            forms[k].columns = (form.reshape)(&form, &values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::{CAUSES, Told};
    use crate::shared_tests::of_a_pendulum;

    /// Held near its widest reach a pendulum's weight hardly changes with its angle: what a lighter one lacks would be an angle that is far off, by a line
    /// that ends long before.
    #[test]
    fn a_step_that_fits_worse_is_not_taken() {
        let angle: Vec<f64> = (0..2000).map(|k| 0.05 + 0.02 * (0.03 * f64::from(k)).sin()).collect();
        let torque = angle.iter().enumerate().map(|(k, q)| -5.3 * q.cos() + 1e-3 * (1.7 * k as f64).sin()).collect();
        of_a_pendulum(angle, torque, |_, view| {
            let cause = CAUSES.iter().find(|c| c.card.name == "angle-offset").expect("it is in the registry");
            let forms = [Form::new(cause, Some(0), vec![Column::Zero { joint: 0, at: 0.0 }], vec![Told::new("offset_rad", "rad", 0)])];
            let plain = Logged::as_it_is(1);
            let [before, after] = [Model::fit(&view, &forms, &plain), refined(&view, &forms, &plain)].map(|model| short(&view, &model));
            assert!(after <= before + LOST, "{before} {after}");
        });
    }
}
