//! The parts of an answer that describe: models, shifts, what was considered, where the discrepancy is.

use super::cause::tail;
use super::groups::Group;
use super::material::Answer;
use crate::curve::CALIBRATION;
use crate::hypotheses::Hypothesis;
use crate::judge::Errors;
use crate::result::{AnotherPlant, BandShare, Considered, Discrepancy, Minor, ModelParameter, ParameterFlag, Shift, TimeShare};
use crate::search::{Chosen, ENOUGH, Stand};
use crate::whittle::variance_of;
use ndof_models::effects::Matrix;
use ndof_models::physical::is_of_no_body;

impl Answer<'_> {
    /// Those of the baseline.
    pub(super) fn own_parameters(&self) -> Vec<ModelParameter> {
        let Some(fit) = self.linear else { return self.parameters(&[], self.baseline, &[]) };
        self.entries(&|matrix, i, j| {
            let (value, error) = fit.entry(matrix, i, j);
            Some((value, Some(error)))
        })
    }

    /// Those of a model that was fitted with these hypotheses.
    pub(super) fn parameters(&self, chosen: &[Chosen], stand: &Stand, others: &[(Vec<Chosen>, Stand)]) -> Vec<ModelParameter> {
        let subject = self.subject;
        let covariance = stand.fit.covariance();
        let values = [Matrix::Mass, Matrix::Damping, Matrix::Stiffness].map(|matrix| (matrix, subject.matrix(chosen, stand, matrix)));
        self.entries(&|matrix, i, j| {
            if matrix == Matrix::Stiffness && !subject.structure.spring && stand.base.structure.given.iter().all(|e| e.0 != matrix) {
                return None;
            }
            let value = values.iter().find(|(of, _)| *of == matrix).map_or(f64::NAN, |(_, rows)| rows[i][j]);
            let parts = subject.parts_of(chosen, stand, (matrix, i, j));
            // Another model that the data like as well is as far off as an error of 1.96 may be.
            let apart = others.iter().map(|(chosen, stand)| (subject.matrix(chosen, stand, matrix)[i][j] - value).abs() / 1.96).fold(0.0, f64::max);
            Some((value, (!parts.is_empty()).then(|| variance_of(&covariance, &parts).sqrt().hypot(CALIBRATION * value).hypot(apart))))
        })
    }

    /// The entries of M, B and K that there are, with their standard errors.
    fn entries(&self, entry: &dyn Fn(Matrix, usize, usize) -> Option<(f64, Option<f64>)>) -> Vec<ModelParameter> {
        let n = self.subject.layout.axes;
        let axes = &self.meaning.axes;
        let mut out = Vec::new();
        for (letter, matrix) in [("M", Matrix::Mass), ("B", Matrix::Damping), ("K", Matrix::Stiffness)] {
            let entries: Vec<_> = (0..n * n).map(|e| entry(matrix, e / n, e % n)).collect();
            for (e, found) in entries.iter().enumerate() {
                let Some((value, std_error)) = *found else { continue };
                let [i, j] = [e / n, e % n];
                let name = if n == 1 { letter.to_owned() } else { format!("{letter}_{}_{}", axes[i], axes[j]) };
                let flag = flag(matrix, &entries, n, [i, j]);
                out.push(ModelParameter { name, unit: self.subject.unit(matrix).to_owned(), value, std_error, flag });
            }
        }
        out
    }

    pub(super) fn shift(&self, chosen: &[Chosen], stand: &Stand, others: &[(Vec<Chosen>, Stand)]) -> Vec<Shift> {
        if chosen.is_empty() {
            return Vec::new();
        }
        let before = self.own_parameters();
        let after = self.parameters(chosen, stand, others);
        before
            .into_iter()
            .zip(after)
            .filter(|(b, a)| (b.value - a.value).abs() > 2.0 * b.std_error.unwrap_or(0.0).hypot(a.std_error.unwrap_or(0.0)) && b.value != a.value)
            .map(|(b, a)| Shift { name: b.name, unit: b.unit, before: b.value, after: a.value })
            .collect()
    }

    pub(super) fn considered(&self) -> Vec<Considered> {
        let subject = self.subject;
        let Some(step) = self.found.steps.first() else { return Vec::new() };
        let mut seen: Vec<&Hypothesis> = (0..self.found.chosen.len()).map(|place| self.hypothesis(place)).collect();
        let mut out = Vec::new();
        let lead = step.judged.first().map_or(0.0, |j| j.net);
        for j in &step.judged {
            let h = &subject.hypotheses[j.hypothesis];
            if seen.iter().any(|other| other.shares_a_site(h)) {
                continue;
            }
            seen.push(h);
            let why_not = if j.net <= 0.0 {
                format!("it gains {:.1}, less than its {} parameters cost", j.gain, h.form.cost())
            } else if j.net <= ENOUGH {
                format!("it gains {:.1} after paying for its parameters; {ENOUGH} are needed", j.net)
            } else {
                format!("it gains {:.0}, the first cause {lead:.0}; with that one named it is no longer needed", j.net)
            };
            out.push(Considered {
                effect: h.effect.name().to_owned(),
                site: self.site(h.form.side, h.form.axis),
                explained_fraction: j.share.max(0.0),
                p_value: tail(2.0 * j.gain, h.form.cost(), step.judged.len()),
                why_not,
            });
        }
        out
    }

    pub(super) fn minor(&self, group: &Group, why: &str) -> Minor {
        let h = self.hypothesis(group.members[0]);
        let removed = group.size.max(group.helps);
        Minor { effect: h.effect.name().to_owned(), site: self.site(h.form.side, h.form.axis), removed, why: why.to_owned() }
    }

    /// What the final model gives the instruments, and is more than chance.
    pub(super) fn of_instruments(&self) -> impl Iterator<Item = Minor> {
        let (subject, found) = (self.subject, self.found);
        found.stand.absorbed().into_iter().filter(|absorbed| absorbed.seen).filter_map(|absorbed| {
            let judged = &found.steps.last()?.judged;
            let h = judged.iter().map(|j| &subject.hypotheses[j.hypothesis]).find(|h| absorbed.is_of(h))?;
            Some(Minor {
                effect: h.effect.name().to_owned(),
                site: self.site(h.form.side, None),
                removed: absorbed.size(&found.stand),
                why: absorbed.sentence(subject.scale.rotational),
            })
        })
    }

    pub(super) fn discrepancy(&self, before: &Errors, another_plant: Option<AnotherPlant>, notes: Vec<String>) -> Discrepancy {
        let layout = &self.subject.layout;
        let lines = layout.lines();
        let unit = 1.0 / layout.time_s;
        let last = layout.frequency_hz[lines - 1];
        let edges = [0.0, unit, 3.5 * unit, 7.0 * unit, last + 1e-9];
        let mut by_band = Vec::new();
        for (i, e) in self.baseline.fit.residual.iter().enumerate() {
            let total: f64 = e.iter().map(|v| v.norm_sqr()).sum();
            for w in edges.windows(2) {
                let part: f64 = e.iter().enumerate().filter(|(k, _)| (w[0]..w[1]).contains(&layout.frequency_hz[k % lines])).map(|(_, v)| v.norm_sqr()).sum();
                by_band.push(BandShare { band_hz: [w[0], w[1].min(last)], output: self.output(i), share: part / total.max(f64::MIN_POSITIVE) });
            }
        }
        let mut by_time = Vec::new();
        for (i, errors) in before.signed.iter().enumerate() {
            let power = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>();
            let total = power(errors);
            let parts = 10usize.min(errors.len());
            for p in 0..parts {
                let (a, b) = (p * errors.len() / parts, (p + 1) * errors.len() / parts);
                let share = power(&errors[a..b]) / total.max(f64::MIN_POSITIVE);
                let time_s = [a as f64 / layout.rate_hz, b as f64 / layout.rate_hz];
                by_time.push(TimeShare { time_s, output: self.output(i), share: if share.is_finite() { share } else { 0.0 } });
            }
        }
        let s = self.shares;
        Discrepancy {
            by_band,
            by_time,
            linear_share: s.linear,
            nonlinear_share: s.nonlinear,
            time_varying_share: s.varying,
            noise_share: s.noise,
            another_plant,
            notes,
        }
    }

    fn output(&self, i: usize) -> String {
        if self.meaning.motion_imposed { self.meaning.effort_names[i].clone() } else { self.meaning.motion_names[i].clone() }
    }
}

/// What is wrong with an inertia or a stiffness: rows of values and standard errors, none where there is no such parameter.
fn flag(matrix: Matrix, entries: &[Option<(f64, Option<f64>)>], axes: usize, [i, j]: [usize; 2]) -> Option<ParameterFlag> {
    let of = |i: usize, j: usize| entries[i * axes + j].map(|(value, error)| (value, 2.0 * error.unwrap_or(0.0)));
    let most = |i: usize| of(i, i).map_or(f64::INFINITY, |(value, half)| value + half);
    if i == j {
        return (matrix != Matrix::Damping && most(i) < 0.0).then_some(ParameterFlag::BelowZero);
    }
    let ((a, half_a), (b, half_b)) = (of(i, j)?, of(j, i)?);
    let (between, half) = (0.5 * (a + b), 0.5 * (half_a + half_b));
    (matrix == Matrix::Mass && is_of_no_body([between - half, between + half], [most(i), most(j)])).then_some(ParameterFlag::OfNoBody)
}
