//! The file's robot with causes: its factors, shapes and channels fitted together.

use crate::causes::Form;
use crate::column::Column;
use crate::logged::Logged;
use crate::search::Solved;
use crate::table::{Series, Table, View};
use std::sync::Arc;

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
    /// By how many standard errors each form's first factor would go beyond where it stands, where a bound holds it.
    pub beyond: Vec<f64>,
}

/// What remains of the missing torque beside a model, not whitened.
pub(crate) fn residual(view: &View<'_>, model: &Model) -> Series {
    let mut rest = view.missing(&model.logged).as_ref().clone();
    for (form, factors) in model.forms.iter().zip(&model.factors) {
        for (series, factor) in view.series(&form.columns).iter().zip(factors) {
            rest.add(-factor, series);
        }
    }
    // In the torque's units as they were logged, in which its noise is: a gain taken off would else buy likelihood by making all smaller.
    for piece in &mut rest.0 {
        let scaled = piece.iter_mut().enumerate().map(|(j, rest)| (rest, model.logged.gain_of(j))).filter(|(_, gain)| *gain != 1.0);
        scaled.for_each(|(rest, gain)| rest.iter_mut().flatten().for_each(|x| *x *= gain));
    }
    rest
}

/// The log without what a form takes off it.
pub(crate) fn put_back(logged: &Logged, form: &Form) -> Logged {
    let mut logged = logged.clone();
    form.columns.iter().for_each(|column| logged.put_back(column));
    logged
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

/// Factors of forms, some of which have theirs.
fn factors(view: &View<'_>, forms: &[Form], logged: &Logged, least: &[Option<f64>]) -> Vec<Vec<f64>> {
    let free: Vec<Form> = forms.iter().zip(least).filter(|(_, least)| least.is_none()).map(|(form, _)| form.clone()).collect();
    let (columns, mut missing) = open(view, &free, logged);
    for (form, least) in forms.iter().zip(least) {
        least.iter().for_each(|least| missing.add(-least, &view.white(&form.columns)[0]));
    }
    let (_, found) = solved(&view.white(&columns), &missing);
    let mut at = 0..columns.len();
    let mut factor = |c: &Column| c.factor().or_else(|| Some(found.of(&[at.next()?])[0])).unwrap_or(0.0);
    let of = |(form, least): (&Form, &Option<f64>)| least.map_or_else(|| form.columns.iter().map(&mut factor).collect(), |least| vec![least]);
    forms.iter().zip(least).map(of).collect()
}

impl Model {
    /// The file as it is, of so many joints.
    pub fn file(joints: usize) -> Model {
        Model { forms: vec![], logged: Logged::as_it_is(joints), factors: vec![], covariance: vec![], places: vec![], beyond: vec![] }
    }

    /// The factors of these forms, with shapes and channels as they are; one that would leave less than none of what the file has leaves none.
    pub fn fit(view: &View<'_>, forms: &[Form], logged: &Logged) -> Model {
        let mut least: Vec<Option<f64>> = vec![None; forms.len()];
        loop {
            let factors = factors(view, forms, logged, &least);
            let crossed = (0..forms.len()).find_map(|k| if least[k].is_none() { Some((k, forms[k].least(&factors[k])?)) } else { None });
            let Some((k, bound)) = crossed else {
                return Model { forms: forms.to_vec(), logged: logged.clone(), factors, covariance: vec![], places: vec![], beyond: vec![] };
            };
            least[k] = Some(bound);
        }
    }

    /// The same without one of its forms, all else fitted anew.
    pub fn without(&self, view: &View<'_>, k: usize) -> Model {
        let mut forms = self.forms.clone();
        let gone = forms.remove(k);
        Model::fit(view, &forms, &put_back(&self.logged, &gone))
    }

    /// Forms in the order of these gains, the largest first.
    pub fn order(&mut self, gains: &[f64]) {
        let mut by: Vec<usize> = (0..gains.len()).collect();
        by.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
        self.forms = by.iter().map(|k| self.forms[*k].clone()).collect();
        self.factors = by.iter().map(|k| self.factors[*k].clone()).collect();
        self.places = by.iter().map(|k| self.places[*k].clone()).collect();
        self.beyond = by.iter().map(|k| self.beyond[*k]).collect();
    }

    /// How many standard errors a form's gear gives more than nothing; `None` where it has none, or the data leave it open.
    pub fn gives(&self, k: usize) -> Option<f64> {
        self.forms[k].gear()?;
        let place = self.places[k][0]?;
        Some(self.factors[k][0] / self.covariance[place][place].sqrt())
    }

    /// Value and standard error of each parameter of a form: of its factors, then of its shapes. A standard error is absent where the data leave
    /// the parameter open.
    pub fn told(&self, k: usize) -> Vec<(String, &'static str, f64, Option<f64>, bool)> {
        let (form, factors) = (&self.forms[k], &self.factors[k]);
        let places = &self.places[k];
        let mut out = Vec::new();
        for told in form.told.iter().filter(|t| !t.hidden) {
            let corrected = told.parts.first().and_then(|(column, _)| self.logged.of(&form.columns[*column]));
            let sum = corrected.unwrap_or_else(|| told.sum(factors));
            let slopes = told.slopes(factors);
            let open = slopes.iter().all(|(c, _)| places[*c].is_none());
            let variance: f64 = slopes
                .iter()
                .flat_map(|(a, wa)| slopes.iter().map(move |(b, wb)| (a, wa, b, wb)))
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
