//! Which causes the data ask for: whole models, step by step, by the products of their columns.

use crate::causes::Form;
use crate::table::Table;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Share of a column that others do not have already, below which it is no column of its own.
const OWN: f64 = 1e-7;

/// A model's factors: least squares over the columns of its forms.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solved {
    /// Columns that are its own, in the order in which they were taken.
    pub kept: Vec<usize>,
    /// Their triangle L of L Lᵀ, row by row.
    lower: Vec<Vec<f64>>,
    /// L⁻¹ of the right side.
    z: Vec<f64>,
    /// Log-likelihood that it gains, twice.
    pub gained: f64,
}

impl Solved {
    /// Takes columns in, those that are combinations of others aside.
    pub fn with(&self, table: &Table, columns: &[usize]) -> Solved {
        let mut out = self.clone();
        for &c in columns {
            let mut row = Vec::with_capacity(out.kept.len() + 1);
            for (k, &other) in out.kept.iter().enumerate() {
                let sum: f64 = (0..k).map(|i| row[i] * out.lower[k][i]).sum();
                row.push((table.gram[[c, other]] - sum) / out.lower[k][k]);
            }
            let own = table.gram[[c, c]];
            let left = own - row.iter().map(|x: &f64| x * x).sum::<f64>();
            if !(left > OWN * own && own > 0.0) || out.kept.contains(&c) {
                continue;
            }
            let pivot = left.sqrt();
            let z = (table.right[c] - row.iter().zip(&out.z).map(|(a, b)| a * b).sum::<f64>()) / pivot;
            row.push(pivot);
            out.kept.push(c);
            out.lower.push(row);
            out.z.push(z);
            out.gained += z * z;
        }
        out
    }

    /// What the columns `columns` would gain beside it, twice the log-likelihood, and how many of them are their own.
    pub fn gain(&self, table: &Table, columns: &[usize]) -> (f64, usize) {
        let more = self.with(table, columns);
        (more.gained - self.gained, more.kept.len() - self.kept.len())
    }

    /// Factors of the kept columns.
    pub fn factors(&self) -> Vec<f64> {
        let mut x = self.z.clone();
        for k in (0..x.len()).rev() {
            x[k] /= self.lower[k][k];
            for i in 0..k {
                x[i] -= self.lower[k][i] * x[k];
            }
        }
        x
    }

    /// (XᵀX)⁻¹ of the kept columns.
    pub fn covariance(&self) -> Vec<Vec<f64>> {
        let n = self.kept.len();
        // Columns of L⁻¹.
        let mut inverse = vec![vec![0.0; n]; n];
        for c in 0..n {
            for r in c..n {
                let unit = if r == c { 1.0 } else { 0.0 };
                let sum: f64 = (c..r).map(|k| self.lower[r][k] * inverse[k][c]).sum();
                inverse[r][c] = (unit - sum) / self.lower[r][r];
            }
        }
        (0..n).map(|i| (0..n).map(|j| (i.max(j)..n).map(|k| inverse[k][i] * inverse[k][j]).sum()).collect()).collect()
    }

    /// The factors of one form's columns; nought for those that are combinations of others.
    pub fn of(&self, columns: &[usize]) -> Vec<f64> {
        let all = self.factors();
        columns.iter().map(|c| self.kept.iter().position(|k| k == c).map_or(0.0, |k| all[k])).collect()
    }
}

/// What decides, beside the data.
pub(crate) struct Rule<'a> {
    pub table: &'a Table,
    pub forms: &'a [Form],
    /// Probability with which anything may be named where nothing is missing.
    pub false_alarms: f64,
}

impl Rule<'_> {
    pub fn solve(&self, chosen: &[usize]) -> Solved {
        chosen.iter().fold(Solved::default(), |solved, f| solved.with(self.table, &self.table.columns[*f]))
    }

    /// Places and causes that are tried: one hypothesis each, whatever its forms.
    pub fn hypotheses(&self) -> usize {
        self.forms.iter().enumerate().filter(|(k, f)| !self.forms[..*k].iter().any(|g| g.same_place(f))).count()
    }

    /// The probability that so much is gained by chance, by the best of all hypotheses that are tried.
    pub fn p_value(&self, gained: f64, freedoms: usize) -> f64 {
        let tail = ChiSquared::new(freedoms.max(1) as f64).map_or(1.0, |d| d.sf(gained.max(0.0)));
        (tail * self.hypotheses() as f64).min(1.0)
    }

    /// Schwarz's criterion of a form's gain; each shape parameter counts as a factor.
    fn worth(&self, form: &Form, gained: f64, freedoms: usize) -> f64 {
        gained - (freedoms + form.shape.len()) as f64 * (self.table.samples as f64).ln()
    }

    /// The form that is worth most beside `solved`, among those that `may`.
    fn best(&self, solved: &Solved, may: impl Fn(usize) -> bool) -> Option<(usize, f64, f64, usize)> {
        let mut best: Option<(usize, f64, f64, usize)> = None;
        for (k, form) in self.forms.iter().enumerate() {
            if !may(k) {
                continue;
            }
            let (gained, freedoms) = solved.gain(self.table, &self.table.columns[k]);
            let worth = self.worth(form, gained, freedoms);
            if freedoms > 0 && best.is_none_or(|(_, most, ..)| worth > most) {
                let factors = solved.with(self.table, &self.table.columns[k]).of(&self.table.columns[k]);
                if form.allows(&factors) {
                    best = Some((k, worth, gained, freedoms));
                }
            }
        }
        best
    }

    /// Forward steps, each followed by exchanges and removals, until nothing more is worth its parameters or beyond chance. What is set aside is not
    /// tried again.
    pub fn search(&self, chosen: &mut Vec<usize>, aside: &[&Form], most: usize) {
        self.exchange(chosen, aside);
        while chosen.len() < most {
            let solved = self.solve(chosen);
            let Some((k, worth, gained, freedoms)) = self.best(&solved, |k| self.free(k, chosen, aside)) else { break };
            if worth <= 0.0 || self.p_value(gained, freedoms + self.forms[k].shape.len()) > self.false_alarms {
                break;
            }
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
                    Some((k, worth, gained, freedoms)) if worth > 0.0 && self.p_value(gained, freedoms + self.forms[k].shape.len()) <= self.false_alarms => {
                        if k != chosen[at] && worth > own + 1e-9 * own.abs() {
                            chosen[at] = k;
                            changed = true;
                        }
                        at += 1;
                    }
                    _ => {
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
