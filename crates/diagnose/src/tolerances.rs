//! What instruments do within their tolerance, which every model has, and whether it is more than instruments do.
//!
//! A tolerance is a coefficient θ with the prior N(0, σ²). Where the instruments keep to it, its estimate has the variance σ² - v, v that of θ given the
//! data. An estimate that is improbable by that law is beyond the tolerance: a cause, however well the prior hides it.

use crate::generic;
use crate::hypotheses::Hypothesis;
use crate::plant::Role;
use crate::search::{Judged, Stand};
use crate::subject::Subject;
use ndof_models::effects::Action;
use statrs::distribution::{ContinuousCDF, Normal};

/// Chance that instruments within their tolerances are said to be beyond one of them: what an answer as a whole is allowed.
const FALSE_ALARM: f64 = 0.01;

/// What a model gives the instruments.
pub(crate) struct Absorbed {
    /// Its column in the base.
    column: usize,
    role: Role,
    value: f64,
    error: f64,
    /// Whether it is more than chance.
    pub seen: bool,
    /// Whether it is more than instruments do.
    pub beyond: bool,
}

impl Stand {
    /// What this model gives the instruments, tolerance by tolerance.
    pub fn absorbed(&self) -> Vec<Absorbed> {
        let tolerances: Vec<usize> = (0..self.base.roles.len()).filter(|&k| matches!(self.base.roles[k], Role::Latency | Role::Angle)).collect();
        let improbable = Normal::standard().inverse_cdf(1.0 - 0.5 * FALSE_ALARM / tolerances.len().max(1) as f64);
        let covariance = self.fit.covariance();
        let of = |column: usize| {
            let (value, prior, own) = (self.fit.theta[column], 1.0 / self.base.columns[column].precision, covariance.at(column, column));
            let seen = value.abs() > improbable * own.sqrt();
            let beyond = seen && value.abs() > improbable * (prior - own).max(0.0).sqrt();
            Absorbed { column, role: self.base.roles[column], value, error: own.sqrt(), seen, beyond }
        };
        tolerances.into_iter().map(of).collect()
    }
}

impl Absorbed {
    /// Whether a hypothesis does what this tolerance does.
    pub fn is_of(&self, hypothesis: &Hypothesis) -> bool {
        match hypothesis.form.action {
            Action::Effort(_) | Action::Motion(_) | Action::Series(_) => self.role == Role::Latency,
            // A gain of one channel is no angle.
            Action::Mix(_) => self.role == Role::Angle && hypothesis.form.axis.is_none(),
            _ => false,
        }
    }

    /// Root of the power that it removes, as a share of the effort's rms.
    pub fn size(&self, of: &Stand) -> f64 {
        let mut before = of.fit.residual.clone();
        for (i, part) in &of.base.columns[self.column].parts {
            before[*i].iter_mut().zip(part.iter()).for_each(|(e, p)| *e += p * self.value);
        }
        generic::size(of, &before, &of.fit.residual)
    }

    /// What it is, and why it is no cause.
    pub fn sentence(&self) -> String {
        let (factor, unit, what) = match self.role {
            Role::Angle => (180.0 / std::f64::consts::PI, "°", "an angle between the effort's channels and their axes"),
            _ if self.value < 0.0 => (1e3, " ms", "motion later than effort"),
            _ => (1e3, " ms", "effort later than motion"),
        };
        let (value, reach) = (factor * self.value.abs(), factor * 1.96 * self.error);
        let verdict = if self.beyond { "more than instruments do, beside the causes that were found" } else { "no more than instruments may do" };
        format!("{what}, {value:.2}{unit} ({:.2} … {:.2}): {verdict}", value - reach, value + reach)
    }
}

impl Subject {
    /// The best correction of a channel, where what the model gives the instruments is more than instruments do.
    pub fn beyond_tolerance(&self, stand: &Stand, judged: &[Judged]) -> Option<Judged> {
        let absorbed = stand.absorbed();
        judged.iter().find(|j| absorbed.iter().any(|a| a.beyond && a.is_of(&self.hypotheses[j.hypothesis]))).cloned()
    }
}
