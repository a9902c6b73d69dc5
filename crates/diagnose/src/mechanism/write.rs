//! What the search among a robot's parameters found, in the words of a diagnosis.

use super::balance::{Balance, rms};
use super::run::Held;
use super::search::Found;
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
            confusable.push(Confusable {
                effects,
                next_experiment: "the same perturbation at a second posture: lengths and inertias act differently there".to_owned(),
                predicted: vec![],
            });
        }
        let rivals: f64 = step.iter().map(|t| (t.net - net).exp()).sum::<f64>() + (-net).exp();
        // A ratio of likelihoods, which no challenge has calibrated.
        let probability = (1.0 / rivals).clamp(0.001, 0.97).min(if rest.iter().any(|r| *r > REST) { 0.5 } else { 1.0 });
        let (explained_fraction, explained_fraction_ci95) =
            judge::explained([&before, &last, &after], floor, 1.0, held.duration_s, options.resamples, options.seed);
        let half = 1.96 * deviation(p).unwrap_or(0.0);
        let mut evidence = vec![format!(
            "{} = {:.4} {} and not {:.4}: it raises the log-likelihood by {:.0} after paying for the parameter, and removes {:.1} % of the force's rms",
            parameters[p].name,
            found.end.values[p],
            parameters[p].unit,
            parameters[p].value,
            found.worth[k],
            100.0 * found.size[k]
        )];
        if let Some(next) = step.get(1) {
            evidence.push(format!("the next other parameter, {}, gains {:.0}, this one {net:.0}", parameters[next.parameter].name, next.net));
        }
        causes.push(Cause {
            effect: effect(p).to_owned(),
            site: site(),
            parameters: vec![
                CauseParameter { name: "name".to_owned(), unit: String::new(), value: Value::Text(parameters[p].name.clone()), ci95: None },
                CauseParameter {
                    name: "value".to_owned(),
                    unit: parameters[p].unit.clone(),
                    value: Value::Number(found.end.values[p]),
                    ci95: Some([found.end.values[p] - half, found.end.values[p] + half]),
                },
            ],
            probability,
            p_value: tail(2.0 * (found.worth[k] + balance.price()), 1, step.len()),
            gain: Gain {
                nrmse_before: last.score.nrmse.clone(),
                nrmse_after: after.score.nrmse.clone(),
                vaf_before: last.score.vaf_percent.clone(),
                vaf_after: after.score.vaf_percent.clone(),
                log_likelihood: None,
                log_likelihood_ci95: None,
                explained_fraction,
                explained_fraction_ci95,
                delta_bic: 2.0 * found.worth[k],
            },
            evidence,
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
    let corrected = held.errors(&values);
    let considered = found.steps.first().into_iter().flatten().filter(|t| !found.wrong.contains(&t.parameter)).map(|t| Considered {
        effect: effect(t.parameter).to_owned(),
        site: site(),
        explained_fraction: t.share.max(0.0),
        p_value: tail(2.0 * (t.net + balance.price()), 1, found.steps[0].len()),
        why_not: format!("{}: it gains {:.1} after paying for the parameter; with the named ones it is not needed", parameters[t.parameter].name, t.net),
    });
    let list = |values: &[f64], fitted: bool| -> Vec<ModelParameter> {
        parameters
            .iter()
            .enumerate()
            .filter(|(_, p)| p.status != Status::Fixed)
            .map(|(k, p)| ModelParameter {
                name: p.name.clone(),
                unit: p.unit.clone(),
                value: values[k],
                std_error: if fitted { deviation(k) } else { None },
                flag: None,
            })
            .collect()
    };
    let axes = || meaning.axes.iter().zip(&rest).map(|(a, r)| format!("{:.1} % at {a}", 100.0 * r)).collect::<Vec<_>>().join(", ");
    let mut notes = vec![format!("robot's side: of the force between command and transducer the corrected robot leaves {} (rms)", axes())];
    if rest.iter().any(|r| *r > REST) {
        notes.push("robot's side: no parameter of the simulated robot explains what it leaves".to_owned());
    }
    let shift = (0..parameters.len())
        .filter(|&k| values[k] != parameters[k].value)
        .map(|k| Shift { name: parameters[k].name.clone(), unit: parameters[k].unit.clone(), before: parameters[k].value, after: values[k] })
        .collect();
    RobotSide {
        considered: considered.collect(),
        minor,
        confusable,
        nominal: list(&found.start.values, false),
        corrected: list(&values, true),
        shift,
        held_out: [before.score, corrected.score],
        rest,
        notes,
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
