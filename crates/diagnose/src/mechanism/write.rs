//! What the search among a robot's parameters found, in the words of a diagnosis.

use super::balance::{Balance, rms};
use super::run::Held;
use super::search::Found;
use super::simulated::MechanismParameter;
use crate::answer::tail;
use crate::baseline::Status;
use crate::judge::{self, Errors, Floor};
use crate::options::Options;
use crate::result::{Cause, CauseParameter, Confusable, Considered, Diagnosis, Gain, Minor, ModelParameter, Score, Shift, Site, Verdict};
use crate::samples::Meaning;
use crate::search::ENOUGH;
use ndof_models::effects::Value;

/// Net gains closer than this do not tell two parameters apart.
const CONFUSABLE: f64 = 3.0;
/// Half of the systematic error of a parameter's interval: friction is seen through a differentiated, low-passed motion.
const FLOOR: f64 = 0.01;
/// Share of the force's rms that the robot may leave and still count as explained.
const REST: f64 = 0.25;
/// Of an explained share's bootstrap.
const RESAMPLES: usize = 400;

/// The robot's side of a diagnosis.
#[derive(Clone, Debug)]
pub struct RobotSide {
    /// Parameters that are wrong, the one that matters most first.
    pub causes: Vec<Cause>,
    /// Parameters that were tried and not named.
    pub considered: Vec<Considered>,
    /// Parameters that are wrong by too little to matter.
    pub minor: Vec<Minor>,
    /// Parameters that the recording cannot tell apart.
    pub confusable: Vec<Confusable>,
    /// The simulation's own numbers.
    pub nominal: Vec<ModelParameter>,
    /// The same with the wrong ones corrected and the free ones fitted.
    pub corrected: Vec<ModelParameter>,
    /// What changed.
    pub shift: Vec<Shift>,
    /// Free run of the robot under command less measured force, held out: as given, and corrected.
    pub held_out: [Score; 2],
    /// Share of the force's rms that the corrected robot leaves, by axis.
    pub rest: Vec<f64>,
    /// Remarks with their numbers.
    pub notes: Vec<String>,
}

/// The two numbers of a cause: which parameter, and what it is.
fn corrected(parameter: &MechanismParameter, value: f64, deviation: f64) -> Vec<CauseParameter> {
    let half = 1.96 * deviation;
    vec![
        CauseParameter { name: "name".to_owned(), unit: String::new(), value: Value::Text(parameter.name.clone()), ci95: None },
        CauseParameter { name: "value".to_owned(), unit: parameter.unit.clone(), value: Value::Number(value), ci95: Some([value - half, value + half]) },
    ]
}

/// What the corrected robot leaves, in words.
fn notes(meaning: &Meaning, rest: &[f64]) -> Vec<String> {
    let axes = meaning.axes.iter().zip(rest).map(|(a, r)| format!("{:.1} % at {a}", 100.0 * r)).collect::<Vec<_>>().join(", ");
    let mut notes = vec![format!("robot's side: of the force between command and transducer the corrected robot leaves {axes} (rms)")];
    if rest.iter().any(|r| *r > REST) {
        notes.push("robot's side: no parameter of the simulated robot explains what it leaves".to_owned());
    }
    notes
}

/// What speaks for the `k`-th of the wrong parameters.
fn evidence(parameters: &[MechanismParameter], found: &Found, k: usize) -> Vec<String> {
    let (p, step) = (found.wrong[k], &found.steps[k]);
    let first = format!(
        "{} = {:.4} {} and not {:.4}: it raises the log-likelihood by {:.0} after paying for the parameter, and removes {:.1} % of the force's rms",
        parameters[p].name,
        found.end.values[p],
        parameters[p].unit,
        parameters[p].value,
        found.worth[k],
        100.0 * found.size[k]
    );
    let net = step.first().map_or(0.0, |t| t.net);
    let next = step.get(1).map(|t| format!("the next other parameter, {}, gains {:.0}, this one {net:.0}", parameters[t.parameter].name, t.net));
    std::iter::once(first).chain(next).collect()
}

/// The parameters that may be wrong, with these values.
fn listed(parameters: &[MechanismParameter], values: &[f64], error: impl Fn(usize) -> Option<f64>) -> Vec<ModelParameter> {
    let open = parameters.iter().enumerate().filter(|(_, p)| p.status != Status::Fixed);
    open.map(|(k, p)| ModelParameter { name: p.name.clone(), unit: p.unit.clone(), value: values[k], std_error: error(k), flag: None }).collect()
}

/// The parameters that are not what the simulation takes them to be.
fn shifts(parameters: &[MechanismParameter], values: &[f64]) -> Vec<Shift> {
    let moved = parameters.iter().zip(values).filter(|(p, after)| **after != p.value);
    moved.map(|(p, after)| Shift { name: p.name.clone(), unit: p.unit.clone(), before: p.value, after: *after }).collect()
}

pub(super) fn write(balance: &Balance<'_>, found: &Found, held: &Held<'_>, meaning: &Meaning, options: &Options) -> RobotSide {
    let parameters = balance.mechanism.parameters();
    let rest: Vec<f64> = found.end.residual.iter().zip(&balance.given_rms).map(|(e, f)| rms(e) / f.max(f64::MIN_POSITIVE)).collect();
    let effect = |p: usize| if parameters[p].geometry { "geometry-error" } else { "parameter-error" };
    let site = || Site { side: "robot".to_owned(), axis: String::new() };
    let deviation = |p: usize| -> Option<f64> {
        let at = found.fitted.iter().position(|q| *q == p)?;
        Some(found.end.covariance[at][at].sqrt().hypot(FLOOR * found.end.values[p]))
    };
    let before = held.errors(&found.start.values);
    let best = found.all.as_ref().map(|all| held.errors(&all.values)).filter(|best| best.mean().is_some());
    let floor = best.as_ref().map_or(Floor { best: &before, share: 0.0 }, |best| Floor { best, share: 1.0 });
    let mut order: Vec<usize> = (0..found.wrong.len()).collect();
    order.sort_by(|&a, &b| found.worth[b].total_cmp(&found.worth[a]));
    let mut values = found.start.values.clone();
    let mut last: Errors = before.clone();
    let (mut causes, mut minor, mut confusable) = (Vec::new(), Vec::new(), Vec::new());
    for k in order {
        let p = found.wrong[k];
        if found.size[k] <= options.tolerance {
            let why = format!("{}: it removes {:.2} % of the force's rms: below the tolerance", parameters[p].name, 100.0 * found.size[k]);
            minor.push(Minor { effect: effect(p).to_owned(), site: site(), removed: found.size[k], why });
            continue;
        }
        values[p] = found.end.values[p];
        let after = held.errors(&values);
        let step = &found.steps[k];
        let net = step.first().map_or(0.0, |t| t.net);
        let near: Vec<usize> = step.iter().skip(1).filter(|t| t.net > ENOUGH && net - t.net < CONFUSABLE).map(|t| t.parameter).collect();
        if !near.is_empty() {
            let effects = std::iter::once(p).chain(near).map(|p| format!("{} {}", effect(p), parameters[p].name)).collect();
            let next_experiment = "the same perturbation at a second posture: lengths and inertias act differently there".to_owned();
            confusable.push(Confusable { effects, next_experiment, predicted: vec![] });
        }
        let rivals: f64 = step.iter().map(|t| (t.net - net).exp()).sum::<f64>() + (-net).exp();
        // A ratio of likelihoods, which no challenge has calibrated.
        let probability = (1.0 / rivals).clamp(0.001, 0.97).min(if rest.iter().any(|r| *r > REST) { 0.5 } else { 1.0 });
        let (explained_fraction, explained_fraction_ci95) = judge::explained([&before, &last, &after], floor, 1.0, held.duration_s, RESAMPLES, options.seed);
        causes.push(Cause {
            effect: effect(p).to_owned(),
            site: site(),
            parameters: corrected(&parameters[p], found.end.values[p], deviation(p).unwrap_or(0.0)),
            probability,
            p_value: tail(2.0 * (found.worth[k] + balance.layout.price(1)), 1, step.len()),
            gain: Gain { explained_fraction, explained_fraction_ci95, ..Gain::of_runs([&last.score, &after.score], 2.0 * found.worth[k]) },
            evidence: evidence(parameters, found, k),
            over_schedule: Vec::new(),
            features: None,
            at_most: 1.0,
            lead: None,
        });
        last = after;
    }
    // Free parameters were fitted beside the wrong ones, and again beside the corrected ones.
    for k in (0..parameters.len()).filter(|k| parameters[*k].status == Status::Free && !found.wrong.contains(k)) {
        values[k] = found.end.values[k];
    }
    let at_last = held.errors(&values);
    let considered = found.steps.first().into_iter().flatten().filter(|t| !found.wrong.contains(&t.parameter)).map(|t| Considered {
        effect: effect(t.parameter).to_owned(),
        site: site(),
        explained_fraction: t.share.max(0.0),
        p_value: tail(2.0 * (t.net + balance.layout.price(1)), 1, found.steps[0].len()),
        why_not: format!("{}: it gains {:.1} after paying for the parameter; with the named ones it is not needed", parameters[t.parameter].name, t.net),
    });
    RobotSide {
        considered: considered.collect(),
        minor,
        confusable,
        nominal: listed(parameters, &found.start.values, |_| None),
        corrected: listed(parameters, &values, deviation),
        shift: shifts(parameters, &values),
        held_out: [before.score, at_last.score],
        notes: notes(meaning, &rest),
        rest,
        causes,
    }
}

impl Diagnosis {
    /// The diagnosis of the plant beyond the transducer with the robot's side beside it; what raises the likelihood most comes first.
    pub fn with_robot(mut self, robot: RobotSide) -> Diagnosis {
        let found = !robot.causes.is_empty();
        let unexplained = robot.rest.iter().any(|r| *r > REST);
        self.causes.extend(robot.causes);
        self.causes.sort_by(|a, b| b.gain.delta_bic.total_cmp(&a.gain.delta_bic));
        self.considered.extend(robot.considered);
        self.minor.extend(robot.minor);
        self.confusable.extend(robot.confusable);
        self.baseline.parameters.extend(robot.nominal);
        self.extended.parameters.extend(robot.corrected);
        self.extended.parameter_shift.extend(robot.shift);
        self.discrepancy.notes.extend(robot.notes);
        self.verdict = match (self.verdict, found, unexplained) {
            (Verdict::Adequate, false, true) => Verdict::Unexplained,
            (Verdict::Adequate, true, false) => Verdict::Explained,
            (Verdict::Adequate | Verdict::Explained, _, true) => Verdict::PartlyExplained,
            (Verdict::Unexplained, true, _) => Verdict::PartlyExplained,
            (other, ..) => other,
        };
        self
    }
}
