//! Which causes the data ask for: whole models, step by step, by the products of their columns.

use crate::causes::Form;
use crate::options::Options;
use crate::sizes::Sizes;
use crate::table::Table;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::sync::OnceLock;

/// Share of a column that others do not have already, below which it is no column of its own.
const OWN: f64 = 1e-7;

/// Share of a criterion that round-off makes.
const ROUNDED: f64 = 1e-9;

/// A model's factors: least squares over the columns of its forms.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solved {
    /// Columns that are its own, in the order in which they were taken.
    pub kept: Vec<usize>,
    /// Their triangle L of L Lᵀ, column by column from the diagonal on: whole columns are added up at once.
    triangle: Vec<Vec<f64>>,
    /// L⁻¹ of the right side.
    z: Vec<f64>,
    /// Log-likelihood that it gains, twice.
    pub gained: f64,
}

/// A column that is its own beside a model: its row of the triangle, and that of the right side.
struct More {
    column: usize,
    row: Vec<f64>,
    z: f64,
}

impl Solved {
    /// Takes columns in, those that are combinations of others aside.
    pub fn with(&self, table: &Table, columns: &[usize]) -> Solved {
        let mut out = self.clone();
        out.take(table, columns);
        out
    }

    fn take(&mut self, table: &Table, columns: &[usize]) {
        for More { column, row, z } in self.more(table, columns, |c| self.row(table, c)) {
            self.push(column, &row, z);
        }
    }

    /// Takes one in, by its row of the triangle and that of the right side.
    fn push(&mut self, column: usize, row: &[f64], z: f64) {
        self.triangle.push(Vec::new());
        self.triangle.iter_mut().zip(row).for_each(|(column, l)| column.push(*l));
        self.kept.push(column);
        self.z.push(z);
        self.gained += z * z;
    }

    /// Of all columns those that explain most, one after the other, as long as they `may`.
    pub fn greedy(table: &Table, mut may: impl FnMut(usize) -> bool) -> Solved {
        let n = table.right.len();
        let mut out = Solved::default();
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); n];
        let mut left: Vec<f64> = (0..n).map(|c| table.gram[[c, c]]).collect();
        let mut right: Vec<f64> = table.right.to_vec();
        let mut open: Vec<usize> = (0..n).collect();
        loop {
            open.retain(|c| left[*c] > OWN * table.gram[[*c, *c]]);
            let explains = |c: &usize| right[*c] * right[*c] / left[*c];
            let Some(at) = (0..open.len()).reduce(|best, k| if explains(&open[k]) > explains(&open[best]) { k } else { best }) else { break };
            let c = open.swap_remove(at);
            if !may(c) {
                continue;
            }
            let (mut row, pivot) = (std::mem::take(&mut rows[c]), left[c].sqrt());
            let z = right[c] / pivot;
            for &other in &open {
                let known: f64 = row.iter().zip(&rows[other]).map(|(a, b)| a * b).sum();
                let l = (table.gram[[c, other]] - known) / pivot;
                rows[other].push(l);
                left[other] -= l * l;
                right[other] -= l * z;
            }
            row.push(pivot);
            out.push(c, &row, z);
        }
        out
    }

    /// L⁻¹ of a right side that is nought before its `first` entry.
    fn forward(&self, first: usize, right: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut x = vec![0.0; self.kept.len()];
        for k in first..x.len() {
            let below = &self.triangle[k];
            let own = (right(k) - x[k]) / below[0];
            x[k] = own;
            x[k + 1..].iter_mut().zip(&below[1..]).for_each(|(sum, l)| *sum += l * own);
        }
        x
    }

    /// A column's row of the triangle beside those that are kept.
    fn row(&self, table: &Table, c: usize) -> Vec<f64> {
        self.forward(0, |k| table.gram[[c, self.kept[k]]])
    }

    /// The columns that are their own, by their rows beside those that are kept.
    fn more(&self, table: &Table, columns: &[usize], row: impl Fn(usize) -> Vec<f64>) -> Vec<More> {
        let mut more: Vec<More> = Vec::with_capacity(columns.len());
        for &c in columns {
            if self.kept.contains(&c) || more.iter().any(|m| m.column == c) {
                continue;
            }
            let mut row = row(c);
            for other in &more {
                let known: f64 = row.iter().zip(&other.row).map(|(a, b)| a * b).sum();
                row.push((table.gram[[c, other.column]] - known) / other.row[row.len()]);
            }
            let own = table.gram[[c, c]];
            let left = own - row.iter().map(|x: &f64| x * x).sum::<f64>();
            if !(left > OWN * own && own > 0.0) {
                continue;
            }
            let pivot = left.sqrt();
            let answered = self.z.iter().chain(more.iter().map(|m| &m.z));
            let z = (table.right[c] - row.iter().zip(answered).map(|(a, b)| a * b).sum::<f64>()) / pivot;
            row.push(pivot);
            more.push(More { column: c, row, z });
        }
        more
    }

    /// What the columns `columns` would gain beside it, twice the log-likelihood, and how many of them are their own.
    pub fn gain(&self, table: &Table, columns: &[usize]) -> (f64, usize) {
        let more = self.more(table, columns, |c| self.row(table, c));
        (more.iter().map(|m| m.z * m.z).sum(), more.len())
    }

    /// Factors of the kept columns.
    pub fn factors(&self) -> Vec<f64> {
        let mut x = self.z.clone();
        for (i, below) in self.triangle.iter().enumerate().rev() {
            let (own, known) = x.split_at_mut(i + 1);
            known.iter().zip(&below[1..]).rev().for_each(|(x, l)| own[i] -= l * x);
            own[i] /= below[0];
        }
        x
    }

    /// (XᵀX)⁻¹ of the kept columns.
    pub fn covariance(&self) -> Vec<Vec<f64>> {
        // Of L⁻¹.
        let columns: Vec<Vec<f64>> = (0..self.kept.len()).map(|c| self.forward(c, |k| if k == c { 1.0 } else { 0.0 })).collect();
        columns.iter().map(|a| columns.iter().map(|b| a.iter().zip(b).map(|(a, b)| a * b).sum()).collect()).collect()
    }

    /// The factors of one form's columns; nought for those that are combinations of others.
    pub fn of(&self, columns: &[usize]) -> Vec<f64> {
        let all = self.factors();
        columns.iter().map(|c| self.kept.iter().position(|k| k == c).map_or(0.0, |k| all[k])).collect()
    }
}

/// Columns beside a model, of which several forms have the same.
struct Beside<'a> {
    solved: &'a Solved,
    table: &'a Table,
    rows: Vec<OnceLock<Vec<f64>>>,
}

impl<'a> Beside<'a> {
    fn new(solved: &'a Solved, table: &'a Table) -> Self {
        Beside { solved, table, rows: table.right.iter().map(|_| OnceLock::new()).collect() }
    }

    /// Those that are their own.
    fn more(&self, columns: &[usize]) -> Vec<More> {
        self.solved.more(self.table, columns, |c| self.rows[c].get_or_init(|| self.solved.row(self.table, c)).clone())
    }

    /// The factors of a form's columns, of which these are `more`; nought for those that are combinations of others.
    fn factors(&self, columns: &[usize], more: &[More]) -> Vec<f64> {
        if columns.iter().any(|c| self.solved.kept.contains(c)) {
            return self.solved.with(self.table, columns).of(columns);
        }
        // Those that were taken last depend on each other alone.
        let mut last = Solved::default();
        more.iter().for_each(|m| last.push(m.column, &m.row[self.solved.kept.len()..], m.z));
        last.of(columns)
    }
}

/// Places and causes that are tried: one hypothesis each, whatever its forms.
pub(crate) fn hypotheses(forms: &[Form]) -> usize {
    forms.iter().enumerate().filter(|(k, f)| !forms[..*k].iter().any(|g| g.same_place(f))).count()
}

/// What decides, beside the data.
pub(crate) struct Rule<'a> {
    pub table: &'a Table,
    pub forms: &'a [Form],
    /// How many hypotheses are tried.
    pub hypotheses: usize,
    /// Samples of each joint that no factor of the noise's model took.
    pub left: &'a [f64],
    pub sizes: &'a Sizes,
    pub options: &'a Options,
}

impl Rule<'_> {
    pub fn solve(&self, chosen: &[usize]) -> Solved {
        let mut solved = Solved::default();
        chosen.iter().for_each(|f| solved.take(self.table, &self.table.columns[*f]));
        solved
    }

    /// The probability that a form gains so much by chance, as the best of all hypotheses that are tried: by Fisher's law, as the noise is known from
    /// the samples that no factor took.
    pub fn p_value(&self, form: &Form, gained: f64, freedoms: usize) -> f64 {
        let freedoms = (freedoms + form.beside()).max(1) as f64;
        let left = form.joint.map_or(self.left.iter().copied().fold(f64::INFINITY, f64::min), |j| self.left[j]);
        // Beyond this ratio the tail is zero to the last bit, and the law's own quotients overflow.
        let ratio = (gained.max(0.0) / freedoms).min(1e100);
        let tail = FisherSnedecor::new(freedoms, left.max(1.0)).map_or(1.0, |d| d.sf(ratio));
        (tail * self.hypotheses as f64).min(1.0)
    }

    /// Schwarz's criterion of a form's gain; what is fitted beside the factors counts as one each.
    fn worth(&self, form: &Form, gained: f64, freedoms: usize) -> f64 {
        gained - (freedoms + form.beside()) as f64 * (self.table.samples as f64).ln()
    }

    /// The form that is worth most beside `solved`, with its worth, among those that `may`, are worth their parameters, beyond chance and not below the tolerance.
    pub fn best(&self, solved: &Solved, may: impl Fn(usize) -> bool + Sync) -> Option<(usize, f64)> {
        let beside = Beside::new(solved, self.table);
        let worth = |k: usize| -> Option<(usize, f64)> {
            let (form, columns) = (&self.forms[k], &self.table.columns[k]);
            let more = beside.more(columns);
            let (mut gained, freedoms): (f64, usize) = (more.iter().map(|m| m.z * m.z).sum(), more.len());
            let factors = beside.factors(columns, &more);
            let least = form.least(&factors);
            // At a bound it gains so much less as it is away from where it would go.
            if let (Some(least), [own]) = (least, &more[..]) {
                gained -= (own.row.last().unwrap_or(&0.0) * (factors[0] - least)).powi(2);
            }
            let worth = self.worth(form, gained, freedoms);
            let named = freedoms > 0
                && worth > 0.0
                && self.sizes.share(k, &factors) >= self.options.tolerance
                && self.p_value(form, gained, freedoms) <= self.options.false_alarms;
            (named && (least.is_some() || form.allows(&factors))).then_some((k, worth))
        };
        let all: Vec<(usize, f64)> = (0..self.forms.len()).into_par_iter().filter(|k| may(*k)).filter_map(worth).collect();
        // The first of equals, however many processors there are and however their columns were rounded.
        all.into_iter().reduce(|best, other| if other.1 > best.1 + ROUNDED * best.1.abs() { other } else { best })
    }

    /// Forward steps, each followed by exchanges and removals, until nothing more is worth its parameters or beyond chance. What is set aside is not
    /// tried again.
    pub fn search(&self, chosen: &mut Vec<usize>, aside: &[&Form], most: usize) {
        self.exchange(chosen, aside);
        // Exchanges may take back what a step brought: a model that was there before ends the search.
        let mut seen: Vec<Vec<usize>> = Vec::new();
        while chosen.len() < most {
            let mut model = chosen.clone();
            model.sort_unstable();
            if seen.contains(&model) {
                break;
            }
            seen.push(model);
            let Some((k, _)) = self.best(&self.solve(chosen), |k| self.free(k, chosen, aside)) else { break };
            chosen.push(k);
            self.exchange(chosen, aside);
        }
    }

    /// Whether a form's cause and place are not taken.
    fn free(&self, k: usize, chosen: &[usize], aside: &[&Form]) -> bool {
        let form = &self.forms[k];
        !chosen.iter().any(|c| self.forms[*c].same_place(form)) && !aside.iter().any(|a| a.same_place(form))
    }

    /// Puts in place of each chosen form the one that is worth most there, or none; until nothing changes.
    fn exchange(&self, chosen: &mut Vec<usize>, aside: &[&Form]) {
        // Each exchange raises the criterion, so that it ends; the bound is for round-off.
        for _ in 0..10 * chosen.len() {
            let mut changed = false;
            let mut at = 0;
            while at < chosen.len() {
                let others: Vec<usize> = chosen.iter().copied().enumerate().filter(|(i, _)| *i != at).map(|(_, f)| f).collect();
                let solved = self.solve(&others);
                let (own, freedoms) = solved.gain(self.table, &self.table.columns[chosen[at]]);
                let own = self.worth(&self.forms[chosen[at]], own, freedoms);
                match self.best(&solved, |k| self.free(k, &others, aside)) {
                    Some((k, worth)) => {
                        if k != chosen[at] && worth > own + ROUNDED * own.abs() {
                            chosen[at] = k;
                            changed = true;
                        }
                        at += 1;
                    }
                    None => {
                        chosen.remove(at);
                        changed = true;
                    }
                }
            }
            if !changed {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Beside, Solved};
    use crate::table::{Series, Table};
    use std::sync::Arc;

    #[test]
    fn those_that_explain_most_are_taken_first_and_all_of_them_are_least_squares() {
        // Of one joint: y = 2 a − 0.1 b, and c = a + b is no column of its own beside both.
        let (a, b): (Vec<f64>, Vec<f64>) = (0..50).map(|k| (f64::from(k).sin(), (2.3 * f64::from(k)).cos())).unzip();
        let sum = |p: f64, q: f64| a.iter().zip(&b).map(|(a, b)| p * a + q * b).collect::<Vec<f64>>();
        let of = |x: Vec<f64>| Series(vec![vec![Some(x)]]);
        let columns: Vec<Arc<Series>> = [sum(0.0, 1.0), sum(1.0, 0.0), sum(1.0, 1.0)].into_iter().map(|x| Arc::new(of(x))).collect();
        let table = Table::new(vec![], &columns, &of(sum(2.0, -0.1)));
        let all = Solved::greedy(&table, |_| true);
        assert_eq!(all.kept, [1, 0]);
        let factors = all.factors();
        assert!((factors[0] - 2.0).abs() < 1e-12 && (factors[1] + 0.1).abs() < 1e-12, "{factors:?}");
        let other = Solved::default().with(&table, &[1, 0, 2]);
        assert!((all.gained - other.gained).abs() < 1e-9 * all.gained);
        assert_eq!(Solved::greedy(&table, |c| c != 1).kept, [2, 0]);
    }

    #[test]
    fn columns_beside_a_model_have_the_factors_that_they_have_in_it() {
        let of = |f: &dyn Fn(f64) -> f64| Series(vec![vec![Some((0..50).map(|k| f(f64::from(k))).collect())]]);
        let columns =
            [of(&|k| k.sin()), of(&|k| (2.3 * k).cos()), of(&|k| k.sin() + (2.3 * k).cos()), of(&|k| k.cos()), of(&|k| (0.7 * k).sin())].map(Arc::new);
        let table = Table::new(vec![], &columns, &of(&|k| 2.0 * (k + 0.3).sin() - (0.7 * k + 0.1).sin()));
        let model = Solved::default().with(&table, &[0, 1]);
        let beside = Beside::new(&model, &table);
        for columns in [vec![3], vec![3, 4], vec![4, 2, 3], vec![3, 3], vec![1, 4], vec![2]] {
            let more = beside.more(&columns);
            let whole = model.with(&table, &columns);
            assert_eq!(beside.factors(&columns, &more), whole.of(&columns), "{columns:?}");
            assert_eq!(model.gained + more.iter().map(|m| m.z * m.z).sum::<f64>(), whole.gained, "{columns:?}");
        }
    }
}
