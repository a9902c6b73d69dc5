//! The file's robot with causes: its factors, shapes and channels fitted together.

use crate::causes::Form;
use crate::column::Column;
use crate::gears;
use crate::search::Solved;
use crate::table::{Series, Table, View};
use ndof_sysid::two_sided_t;
use std::sync::Arc;

/// What is taken off the logged torques before they are compared.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Logged {
    /// How late each torque is logged (s).
    pub late_s: Vec<f64>,
    /// How many times too large it is.
    pub gain: Vec<f64>,
    /// How the base is turned: axis times angle (rad).
    pub tilt: [f64; 3],
}

impl Logged {
    pub fn as_it_is(joints: usize) -> Self {
        Logged { late_s: vec![0.0; joints], gain: vec![1.0; joints], tilt: [0.0; 3] }
    }
}

/// Forms with their fitted factors.
#[derive(Clone)]
pub(crate) struct Model {
    pub forms: Vec<Form>,
    pub logged: Logged,
    pub factors: Vec<Vec<f64>>,
    /// Of factors and shapes together, form after form: factors first, then shapes.
    pub covariance: Vec<Vec<f64>>,
    /// Where each form's factors and shapes stand in it; `None` for what the data leave open.
    pub places: Vec<Vec<Option<usize>>>,
}

/// Blocks of time from which intervals are drawn.
pub(crate) const BLOCKS: usize = 24;

/// What remains of the missing torque beside a model, not whitened.
pub(crate) fn residual(view: &View<'_>, model: &Model) -> Series {
    let mut rest = view.missing(&model.logged);
    for (form, factors) in model.forms.iter().zip(&model.factors) {
        for (series, factor) in view.series(&form.columns).iter().zip(factors) {
            rest.add(-factor, series);
        }
    }
    rest
}

/// The columns of forms whose factors are open, and what the others leave of the missing torque, whitened.
pub(crate) fn open(view: &View<'_>, forms: &[Form], logged: &Logged) -> (Vec<Column>, Series) {
    let mut missing = view.missing(logged).whitened(&view.noise);
    let (made, open): (Vec<Column>, Vec<Column>) = forms.iter().flat_map(|f| f.columns.iter().cloned()).partition(|c| c.factor().is_some());
    for (column, series) in made.iter().zip(view.white(&made)) {
        missing.add(-column.factor().unwrap_or(0.0), &series);
    }
    (open, missing)
}

/// Least squares of whitened series.
pub(crate) fn solved(series: &[Arc<Series>], missing: &Series) -> (Table, Solved) {
    let all: Vec<usize> = (0..series.len()).collect();
    let table = Table::new(vec![all.clone()], series, missing);
    let solved = Solved::default().with(&table, &all);
    (table, solved)
}

impl Model {
    /// The factors of these forms, with shapes and channels as they are.
    pub fn fit(view: &View<'_>, forms: &[Form], logged: &Logged) -> Model {
        let (columns, missing) = open(view, forms, logged);
        let (_, found) = solved(&view.white(&columns), &missing);
        let mut at = 0..columns.len();
        let factor = |c: &Column| c.factor().or_else(|| Some(found.of(&[at.next()?])[0])).unwrap_or(0.0);
        let mut factor = factor;
        let factors = forms.iter().map(|form| form.columns.iter().map(&mut factor).collect()).collect();
        Model { forms: forms.to_vec(), logged: logged.clone(), factors, covariance: vec![], places: vec![] }
    }

    /// Shapes and channels moved from where they are to where the likelihood is greatest, one after the other, and intervals of all.
    pub fn refined(view: &View<'_>, forms: &[Form], logged: &Logged) -> Model {
        let (mut forms, mut logged) = (forms.to_vec(), logged.clone());
        // Twice: what one shape takes from another is of second order by then.
        for _ in 0..2 {
            settle_channels(view, &forms, &mut logged);
            gears::settle(view, &mut forms, &logged);
            settle_shapes(view, &mut forms, &logged);
        }
        settle_channels(view, &forms, &mut logged);
        gears::settle(view, &mut forms, &logged);
        let mut model = Model::fit(view, &forms, &logged);
        model.intervals(view);
        model
    }

    /// The covariance of factors and shapes: of white noise, or from the scatter of blocks of time where that is larger.
    fn intervals(&mut self, view: &View<'_>) {
        let mut series = Vec::new();
        let mut places = Vec::new();
        for (form, factors) in self.forms.iter().zip(&self.factors) {
            let first = series.len();
            series.extend(view.white(&form.columns));
            let mut beside = Vec::new();
            for (k, column) in form.columns.iter().enumerate() {
                let mut changes = gears::changes(view, &self.forms, column).into_iter().map(|x| Arc::new(x.whitened(&view.noise)));
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
        let rest = residual(view, self).whitened(&view.noise);
        let (_, found) = solved(&series, &rest);
        self.places = places.iter().map(|own| own.iter().map(|c| found.kept.iter().position(|k| k == c)).collect()).collect();
        self.covariance = sandwich(&found, &series, &rest);
    }

    /// Forms in the order of these gains, the largest first.
    pub fn order(&mut self, gains: &[f64]) {
        let mut by: Vec<usize> = (0..gains.len()).collect();
        by.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
        self.forms = by.iter().map(|k| self.forms[*k].clone()).collect();
        self.factors = by.iter().map(|k| self.factors[*k].clone()).collect();
        self.places = by.iter().map(|k| self.places[*k].clone()).collect();
    }

    /// Value and standard error of each parameter of a form: of its factors, then of its shapes. A standard error is absent where the data leave
    /// the parameter open.
    pub fn told(&self, k: usize) -> Vec<(String, &'static str, f64, Option<f64>, bool)> {
        let (form, factors) = (&self.forms[k], &self.factors[k]);
        let places = &self.places[k];
        let mut out = Vec::new();
        for told in form.told.iter().filter(|t| !t.hidden) {
            let sum = match (form.cause.card.name, form.joint) {
                ("torque-delay", Some(j)) => self.logged.late_s[j],
                ("torque-scale", Some(j)) => self.logged.gain[j],
                ("base-tilt", _) => {
                    let Column::Tilt(axis) = form.columns[told.parts[0].0] else { continue };
                    axis.iter().zip(&self.logged.tilt).map(|(a, t)| a * t).sum()
                }
                _ => told.sum(factors),
            };
            let open = told.parts.iter().all(|(c, _)| places[*c].is_none());
            let variance: f64 = told
                .parts
                .iter()
                .flat_map(|(a, wa)| told.parts.iter().map(move |(b, wb)| (a, wa, b, wb)))
                .filter_map(|(a, wa, b, wb)| Some(wa * wb * self.covariance[places[*a]?][places[*b]?]))
                .sum();
            if !open {
                out.push((told.name.clone(), told.unit, sum, Some(variance.max(0.0).sqrt()), told.inverse));
            }
        }
        for (s, shape) in form.shape.iter().enumerate() {
            let error = places[form.columns.len() + s].map(|p| self.covariance[p][p].max(0.0).sqrt());
            out.push((shape.name.to_owned(), shape.unit, shape.value, error, false));
        }
        out
    }
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

/// Products of series with another, block of time by block of time, all joints together.
pub(crate) fn block_products(series: &[&Series], with: &Series) -> Vec<Vec<f64>> {
    let samples: usize = with.0.iter().map(|p| p.iter().flatten().map(Vec::len).max().unwrap_or(0)).sum();
    let length = samples.div_ceil(BLOCKS).max(1);
    let mut blocks = Vec::new();
    for (p, joints) in with.0.iter().enumerate() {
        let n = joints.iter().flatten().map(Vec::len).max().unwrap_or(0);
        let count = (n as f64 / length as f64).round().max(1.0) as usize;
        for b in 0..count {
            let own = |x: &Series, j: usize| -> f64 {
                let (Some(x), Some(y)) = (&x.0[p][j], &joints[j]) else { return 0.0 };
                let range = b * x.len() / count..(b + 1) * x.len() / count;
                x[range.clone()].iter().zip(&y[range]).map(|(a, b)| a * b).sum()
            };
            blocks.push(series.iter().map(|s| (0..joints.len()).map(|j| own(s, j)).sum()).collect());
        }
    }
    blocks
}

/// Share of itself by which a channel's correction may still move: intervals are far wider.
const SETTLED: f64 = 1e-5;

/// Delays and gains of the logged torques and tilt: what their columns still say is added until nothing is left.
fn settle_channels(view: &View<'_>, forms: &[Form], logged: &mut Logged) {
    let bent = |c: &Column| matches!(c, Column::Falling(_) | Column::Torque(_) | Column::Tilt(_));
    if !forms.iter().flat_map(|f| &f.columns).any(bent) {
        return;
    }
    let mut steps: Vec<Option<(f64, f64)>> = Vec::new();
    for _ in 0..4 {
        let model = Model::fit(view, forms, logged);
        let (mut moved, mut channel) = (false, 0);
        let mut go = |from: &mut f64, next: &dyn Fn(f64) -> f64| {
            let step = next(*from) - *from;
            // By the secant of the last two steps: what is left shrinks by a share of itself, which they show.
            let before = steps.get(channel).copied().flatten();
            let shrinks = before.map_or(0.0, |(at, step_there)| 1.0 + (step - step_there) / (*from - at));
            let whole = if shrinks.abs() < 0.9 { step / (1.0 - shrinks) } else { step };
            if channel == steps.len() {
                steps.push(None);
            }
            if step.abs() > SETTLED * (*from + step).abs() {
                steps[channel] = Some((*from, step));
                *from += whole;
                moved = true;
            }
            channel += 1;
        };
        for (form, factors) in forms.iter().zip(&model.factors) {
            for (column, factor) in form.columns.iter().zip(factors) {
                match column {
                    Column::Falling(j) => go(&mut logged.late_s[*j], &|late| late + factor),
                    Column::Torque(j) => go(&mut logged.gain[*j], &|gain| gain * (1.0 + factor)),
                    Column::Tilt(axis) => logged.tilt.iter_mut().zip(axis).for_each(|(t, a)| go(t, &|t| t + factor * *a)),
                    _ => {}
                }
            }
        }
        if !moved {
            break;
        }
    }
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
            let value = golden(form.shape[s].value, form.shape[s].bounds, gained);
            forms[k].shape[s].value = value;
            let values: Vec<f64> = forms[k].shape.iter().map(|s| s.value).collect();
            forms[k].columns = (form.reshape)(&form, &values);
        }
    }
}

/// The place of the maximum between the neighbours of a start, to a thousandth of the bounds' width.
fn golden(start: f64, bounds: [f64; 2], mut of: impl FnMut(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_8;
    let width = bounds[1] - bounds[0];
    let (mut a, mut b) = ((start - 0.2 * width).max(bounds[0]), (start + 0.2 * width).min(bounds[1]));
    let (mut x, mut y) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut fx, mut fy) = (of(x), of(y));
    let (mut best, mut most) = (start, of(start));
    while b - a > 1e-3 * width {
        for (at, f) in [(x, fx), (y, fy)] {
            if f > most {
                (best, most) = (at, f);
            }
        }
        if fx > fy {
            (b, y, fy) = (y, x, fx);
            x = b - RATIO * (b - a);
            fx = of(x);
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + RATIO * (b - a);
            fy = of(y);
        }
    }
    best
}
