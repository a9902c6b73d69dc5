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
        let tolerances: Vec<usize> =
            (0..self.base.roles.len()).filter(|&k| matches!(self.base.roles[k], Role::Latency | Role::Angle | Role::Compliance)).collect();
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
            Action::Effort(_) | Action::Motion(_) | Action::Lag => self.role == Role::Latency,
            Action::Series(_) => self.role == Role::Compliance,
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
    pub fn sentence(&self, rotational: bool) -> String {
        let (factor, unit, what) = match self.role {
            Role::Compliance => (1e6, if rotational { " µrad/(N m)" } else { " µm/N" }, "what lies between the sensors of effort and motion gives way"),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Options;
    use crate::plant::Dynamics;
    use crate::shared_tests::{baseline, known, linear};
    use crate::state::{Cause, Column};
    use crate::subject::Subject;
    use crate::whittle::Likelihood;
    use ndof_challenge::Plant;
    use ndof_linear::square;
    use ndof_models::effects::Matrix;
    use ndof_signal::Recording;
    use num_complex::Complex64;

    /// A transducer gives way under what it measures: it is told with its compliance, and the inertia is what it is without.
    #[test]
    fn a_transducer_that_gives_way_is_no_inertia() {
        for plant in [Plant::Force, Plant::Planar] {
            let made = linear(plant, (2, 40.0), 62);
            let behind = |compliance: f64, recording: &Recording| {
                let mut channels = recording.channels().to_vec();
                for (effort, motion) in made.ports.inputs.iter().zip(&made.ports.outputs) {
                    let force = channels[*effort].samples.clone();
                    channels[*motion].samples.iter_mut().zip(force).for_each(|(x, f)| *x += compliance * f);
                }
                Recording::new(recording.sample_rate_hz(), channels).expect("a recording")
            };
            let subject = |compliance: f64| {
                let recordings: Vec<Recording> = made.recordings.iter().map(|recording| behind(compliance, recording)).collect();
                let (samples, meaning) = known(&made, &recordings);
                Subject::new(&samples, &meaning, &Options::default(), None, true).expect("a subject")
            };
            let fitted = |subject: &Subject| subject.stand(&[], &subject.start, 4).expect("a fit");
            let told = |stand: &Stand| stand.absorbed().into_iter().find(|a| a.role == Role::Compliance).map(|a| (a.value, a.error, a.seen)).expect("told");
            // How far the inertia is from the truth, in standard errors.
            let off = |stand: &Stand| {
                let place = stand.base.roles.iter().position(|role| *role == Role::Entry(Matrix::Mass, 0, 0)).expect("an inertia");
                (stand.fit.theta[place] - made.mass[0][0]).abs() / stand.fit.covariance().at(place, place).sqrt()
            };
            let mut soft = subject(1e-6);
            let (stiff, stand) = (told(&fitted(&subject(0.0))), fitted(&soft));
            let (value, error, seen) = told(&stand);
            assert!(seen && (value - stiff.0 - 1e-6).abs() < error, "{plant:?}: {value} beside {} ± {error}", stiff.0);
            soft.structure.about = None;
            let without = fitted(&soft);
            assert!(off(&stand) < 3.0 && off(&without) > 8.0, "{plant:?}: {} and {}", off(&stand), off(&without));
        }
    }

    /// What a compliance c does to the density of a noisy effort: (I + c P) Z closes the loop in place of Z, and an effort that answers is (I + c P) of it.
    #[test]
    fn the_determinant_counts_what_a_compliance_does_to_the_effort() {
        for plant in [Plant::Planar, Plant::Motion] {
            let made = linear(plant, (1, 30.0), 63);
            let (samples, mut meaning) = known(&made, &made.recordings);
            let (subject, Stand { state, base, fit, .. }) = baseline(&samples, &meaning);
            let theta: Vec<f64> = base
                .roles
                .iter()
                .zip(&fit.theta)
                .map(|(role, value)| match role {
                    Role::Latency | Role::Angle => 0.0,
                    Role::Compliance => 3e-6,
                    _ => *value,
                })
                .collect();
            let (n, about) = (subject.layout.axes, subject.structure.about.as_ref().expect("dynamics"));
            let want: f64 = subject
                .layout
                .sj
                .iter()
                .enumerate()
                .map(|(k, s)| {
                    let entries = |of: &Dynamics| -> Vec<Complex64> { (0..n * n).map(|q| of.entry(q / n, q % n, *s)).collect() };
                    let mut gives: Vec<Complex64> = entries(about).iter().map(|p| p * 3e-6).collect();
                    (0..n).for_each(|i| gives[i * n + i] += 1.0);
                    let mut g = match &subject.cause {
                        Cause::Loop(z) => square::product(&gives, &z[k], n),
                        _ => gives,
                    };
                    if plant == Plant::Planar {
                        g.iter_mut().zip(entries(&base.dynamics(&theta, n))).for_each(|(g, d)| *g += d);
                    }
                    let mut inverse = vec![Complex64::ZERO; n * n];
                    square::invert_into(&mut g, &mut inverse, n).expect("regular")
                })
                .sum();
            let columns: Vec<&Column> = base.columns.iter().collect();
            let got = Likelihood::new(&state, &subject.cause, &base.held).log_determinant(&columns, &theta).expect("regular");
            assert!((got - want).abs() < 1e-9 * want.abs(), "{plant:?}: {got} and {want}");
            // A commanded effort has no transducer.
            meaning.effort_is_command = true;
            assert!(!baseline(&samples, &meaning).1.base.roles.contains(&Role::Compliance));
        }
    }
}
