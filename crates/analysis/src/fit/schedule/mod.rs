//! Inertia, damping and stiffness that change over a schedule, from the trials that a response was estimated from.

pub mod result;

use super::axis as axis_of_channel;
use super::project::projection;
use super::settings::Fit;
use super::sides::Sides;
use crate::error::AnalysisError;
use crate::estimate::instrument::{MEAN_KNOTS, WIDEST};
use crate::file::KinematicsFile;
use crate::result::{Warning, number};
use crate::schedule::{Refused, Schedule};
use crate::trials::Trials;
use ndarray::Array2;
use ndof_models::schedule::{Scheduled, ScheduledEntry, ScheduledFit, Splines, Stretch, Term};
use ndof_models::{Axis, InertiaDampingStiffnessModel, ParameterInfo, ParametricModel, Symmetry};
use result::{HeldOutShare, MeanChannel, ScheduleEntry, ScheduleResult, VariationTest};

/// Splines of an entry where the settings do not say: of a movement's cycle they part what lies a twenty-fourth of it apart, finer than
/// muscles change their force in a step.
const KNOTS: usize = 24;
/// A command that foretells less of a motion than this is a weak instrument.
const WEAK: f64 = 0.1;

/// The scheduled fit, with what the reader should know; nothing where no schedule is asked for.
pub(super) fn scheduled(trials: &Trials, settings: &Fit, excited_hz: f64) -> Result<Option<(ScheduleResult, Vec<Warning>)>, AnalysisError> {
    let refused = |what: Refused| AnalysisError::Schedule { what };
    let Some(word) = settings.schedule.as_deref() else {
        return match settings.schedule_needed() {
            Some(option) => Err(refused(format!("`{option}` is of a `schedule`; give that too"))),
            None => Ok(None),
        };
    };
    let sides = Sides::of(trials, "a `schedule`").map_err(refused)?;
    let schedule = Schedule::new(trials, word, settings.cycles()).map_err(refused)?;
    let rate_hz = trials.sample_rate_hz();
    let high_hz = settings.band_hz.map_or_else(|| excited_hz.min(WIDEST * rate_hz), |band| band[1]);
    let varying = settings.varying.clone().unwrap_or_else(|| vec![Term::Stiffness, Term::Damping]);
    let knots = settings.knots.unwrap_or(KNOTS);
    if knots < Splines::FEWEST {
        return Err(refused(format!("`knots` is {knots}, and curves have {} at least", Splines::FEWEST)));
    }
    let fit = ScheduledFit {
        rate_hz,
        high_hz,
        knots,
        mean_knots: schedule.cycle_s.map_or(knots, |cycle_s| ((MEAN_KNOTS * high_hz * cycle_s).ceil() as usize).max(knots)),
        closed: schedule.cycle_s.is_some(),
        stiffness: varying.contains(&Term::Stiffness),
        damping: varying.contains(&Term::Damping),
        inertia: varying.contains(&Term::Inertia),
    };
    let motions: Vec<Vec<Vec<f64>>> = trials.trials.iter().map(|trial| sides.motion(trial, settings)).collect();
    let stretches: Vec<Stretch<'_>> = trials
        .trials
        .iter()
        .zip(schedule.values.iter().zip(&schedule.blocks))
        .zip(&motions)
        .map(|((trial, (values, blocks)), moved)| {
            let of = |indices: &[usize]| indices.iter().map(|i| trial.recording.channels()[*i].samples.as_slice()).collect();
            Stretch {
                effort: of(&sides.efforts),
                motion: moved.iter().map(Vec::as_slice).collect(),
                command: of(&sides.commands),
                schedule: values.clone(),
                block: blocks.clone(),
            }
        })
        .collect();
    let found = fit.run(&stretches)?;
    let warnings = warnings(&sides, &found);
    let joint = settings.kinematics.as_ref().map(|file| at_the_joints(file, &found, schedule.cycle_s)).transpose()?.unwrap_or_default();
    Ok(Some((ScheduleResult { joint, ..written(trials, &sides, (&schedule, word), high_hz, found) }, warnings)))
}

fn warnings(sides: &Sides, found: &Scheduled) -> Vec<Warning> {
    let mut out = Vec::new();
    if !sides.imposed && sides.commands.is_empty() {
        out.push(Warning::new(
            "schedule-without-command",
            "no commanded force: over the schedule the motion counts as imposed; where a robot pushes, the limb's own force biases the matrices",
            "record the commanded force and name it with `reference`, or name the motion as `input` where it is imposed",
        ));
    }
    if found.foretold.iter().flatten().any(|share| *share < WEAK) {
        out.push(Warning::new(
            "weak-instrument-schedule",
            "the commanded force foretells less than a tenth of a motion: the matrices over the schedule lean towards the biased ones",
            "perturb more strongly, or record more cycles",
        ));
    }
    if found.folds == 0 {
        out.push(Warning::new("nothing-held-out", "one cycle only: nothing can be held out, and no variance accounted for is given", "record more cycles"));
    }
    out
}

/// One entry by its name and unit, which stand matrix by matrix in `named`, inertia first.
fn named_entry(entry: &ScheduledEntry, named: &[ParameterInfo], n: usize) -> ScheduleEntry {
    let matrix = 2 - Term::ALL.iter().position(|term| *term == entry.term).unwrap_or(0);
    let ParameterInfo { name, unit, .. } = &named[(matrix * n + entry.row) * n + entry.column];
    let end = |width: f64| entry.value.iter().zip(&entry.std_error).map(|(v, e)| v + width * e).collect::<Vec<f64>>();
    ScheduleEntry {
        name: name.clone(),
        unit: unit.clone(),
        varies: entry.varies,
        value: entry.value.clone(),
        std_error: entry.std_error.clone(),
        ci95: [end(-entry.pointwise), end(entry.pointwise)],
        band95: [end(-entry.simultaneous), end(entry.simultaneous)],
        degrees_of_freedom: entry.degrees_of_freedom,
        truth: None,
    }
}

/// The matrices at the joints in the posture of the mean movement at each place; nothing of mechanisms that the endpoint's place does not set.
///
/// From δx = J δφ with a Jacobian that changes: M_q = Jᵀ M J, B_q = Jᵀ (B J + 2 M J̇), K_q = Jᵀ (K J + B J̇ + M J̈) + Γ, Γ of the mean force.
fn at_the_joints(file: &KinematicsFile, found: &Scheduled, cycle_s: Option<f64>) -> Result<Vec<ScheduleEntry>, AnalysisError> {
    if file.kind == "wrist" || file.shoulder_m.is_none() {
        return Ok(Vec::new());
    }
    let of = |curves: &[Vec<f64>], k: usize| curves.iter().map(|curve| curve[k]).collect::<Vec<f64>>();
    let placed = |k: usize| {
        let file = KinematicsFile { posture_rad: None, hand_m: Some(of(&found.mean.motion, k)), ..file.clone() };
        projection(&of(&found.mean.effort, k), &file)
    };
    let places = (0..found.at.len()).map(placed).collect::<Result<Vec<_>, _>>()?;
    let jacobians: Vec<Array2<f64>> = places.iter().map(|place| place.kinematics.jacobian()).collect();
    let [rate, bend] = rates(&jacobians, cycle_s);
    let twice: Vec<Array2<f64>> = rate.iter().map(|rate| rate * 2.0).collect();
    let axes = places.first().map_or_else(Vec::new, |place| place.kinematics.joints());
    let n = axes.len();
    let named = InertiaDampingStiffnessModel::new(axes, Symmetry::Free).parameters();
    let all = Term::ALL.into_iter().flat_map(|term| (0..n * n).map(move |e| (term, (e / n, e % n))));
    let entry = |(term, (i, j)): (Term, (usize, usize))| {
        let parts: &[(Term, &[Array2<f64>])] = match term {
            Term::Stiffness => &[(Term::Stiffness, &jacobians), (Term::Damping, &rate), (Term::Inertia, &bend)],
            Term::Damping => &[(Term::Damping, &jacobians), (Term::Inertia, &twice)],
            Term::Inertia => &[(Term::Inertia, &jacobians)],
        };
        let mut entry = found.transformed((i, j), &jacobians, parts);
        if term == Term::Stiffness {
            let bent = places.iter().map(|place| place.kinematics.geometric_stiffness(&place.mean_force_n)[[i, j]]);
            entry.value.iter_mut().zip(bent).for_each(|(value, bent)| *value += bent);
        }
        named_entry(&entry, &named, n)
    };
    Ok(all.map(entry).collect())
}

/// First and second derivative in time of what goes over a cycle, by central differences; nought where there is no cycle.
///
/// ```
/// # use ndof_analysis::fit::schedule::rates;
/// let circle: Vec<_> = (0..=100).map(|k| ndarray::array![[(0.0628318530717959 * f64::from(k)).sin()]]).collect();
/// let [rate, bend] = rates(&circle, Some(2.0));
/// assert!((rate[0][[0, 0]] - 3.14159).abs() < 0.01 && (bend[25][[0, 0]] + 9.8696).abs() < 0.01);
/// ```
pub fn rates(values: &[Array2<f64>], cycle_s: Option<f64>) -> [Vec<Array2<f64>>; 2] {
    // The last place is the first again.
    let count = values.len().saturating_sub(1).max(1);
    let per_s = cycle_s.map_or(0.0, |cycle_s| count as f64 / cycle_s);
    let beside = |k: usize| (&values[(k + count - 1) % count], &values[k], &values[(k + 1) % count]);
    let first = |k: usize| (beside(k).2 - beside(k).0) * (0.5 * per_s);
    let second = |k: usize| (beside(k).2 + beside(k).0 - beside(k).1 * 2.0) * (per_s * per_s);
    [(0..values.len()).map(first).collect(), (0..values.len()).map(second).collect()]
}

/// The result in the field's words.
fn written(trials: &Trials, sides: &Sides, (schedule, word): (&Schedule, &str), high_hz: f64, found: Scheduled) -> ScheduleResult {
    let axes: Vec<Axis> = trials.channels(&sides.motions).iter().map(|channel| axis_of_channel(&channel.name, &channel.unit)).collect();
    let named = InertiaDampingStiffnessModel::new(axes.clone(), Symmetry::Free).parameters();
    let percent = |share: &f64| number(100.0 * share);
    let shares = found.vaf_constant.iter().zip(&found.vaf_varying).zip(trials.names(&sides.efforts));
    let means = |indices: &[usize], curves: &[Vec<f64>]| -> Vec<MeanChannel> {
        let named = trials.names(indices).into_iter().zip(trials.units(indices));
        named.zip(curves).map(|((channel, unit), value)| MeanChannel { channel, unit, value: value.clone() }).collect()
    };
    ScheduleResult {
        schedule: word.to_owned(),
        unit: schedule.unit.clone(),
        at: found.at.iter().map(|u| schedule.ends[0] + u * (schedule.ends[1] - schedule.ends[0])).collect(),
        cycle_s: schedule.cycle_s,
        blocks: schedule.count,
        high_hz,
        samples: found.rows,
        noise_order: found.noise_order.clone(),
        command_share: found.foretold.as_ref().map(|shares| shares.iter().map(|share| number(*share)).collect()),
        entries: found.entries.iter().map(|entry| named_entry(entry, &named, axes.len())).collect(),
        joint: Vec::new(),
        tests: Term::ALL.iter().zip(found.probability_if_constant).map(|(matrix, p)| VariationTest { matrix: *matrix, p_value: number(p) }).collect(),
        held_out: shares
            .map(|((constant, varying), channel)| HeldOutShare { channel, constant_vaf: percent(constant), varying_vaf: percent(varying) })
            .collect(),
        mean_movement: [means(&sides.motions, &found.mean.motion), means(&sides.efforts, &found.mean.effort)].concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::{RoleNames, Trim};
    use crate::{Estimate, PHASE, Trial};
    use ndof_signal::{Channel, FilteredNoise, Quantity, Recording, Unit};

    /// A handle of 1 kg and 10 N s/m that is moved, on a spring that goes from 100 to 300 N/m within each second; 40 s at 200 Hz.
    fn spring() -> Trials {
        let rate_hz = 200.0;
        let noise = FilteredNoise { axes: 2, samples: 8000, sample_rate_hz: rate_hz, rms: 0.01, cutoff_hz: 8.0, ..FilteredNoise::default() };
        let drawn = noise.generate(4).expect("noise");
        let (x, errors) = (&drawn[0], &drawn[1]);
        let slope = |k: usize, order: usize| match (k, order) {
            (0 | 7999, _) => 0.0,
            (_, 1) => 0.5 * rate_hz * (x[k + 1] - x[k - 1]),
            _ => rate_hz * rate_hz * (x[k + 1] - 2.0 * x[k] + x[k - 1]),
        };
        let phase = |k: usize| (k as f64 / rate_hz).fract();
        let stiffness = |k: usize| 200.0 - 100.0 * (std::f64::consts::TAU * phase(k)).cos();
        let force: Vec<f64> = (0..8000).map(|k| slope(k, 2) + 10.0 * slope(k, 1) + stiffness(k) * x[k] + 5.0 * errors[k]).collect();
        let channels = vec![
            Channel::new("force_x", Unit::si(Quantity::Effort, false), force),
            Channel::new("pos_x", Unit::si(Quantity::Displacement, false), x.clone()),
            Channel::new("lift", Unit::si(Quantity::Effort, false), (0..8000).map(phase).collect::<Vec<f64>>()),
        ];
        let recording = Recording::new(rate_hz, channels).expect("channels");
        let names = RoleNames { inputs: Some(vec!["pos_x".to_owned()]), kept: vec!["lift".to_owned()], ..RoleNames::default() };
        Trials::new(vec![Trial::of("spring.csv", recording)], &names, &Trim::default()).expect("trials")
    }

    fn over(schedule: &str) -> Fit {
        Fit { schedule: Some(schedule.to_owned()), band_hz: Some([0.5, 8.0]), ..Fit::default() }
    }

    #[test]
    fn a_spring_over_its_phase_is_found_by_clock_and_by_channel() {
        let trials = spring();
        let estimated = crate::estimate(&trials, &Estimate::welch(512)).expect("an estimate");
        assert!(estimated.fit(0.5..8.0).expect("a fit").result.schedule.is_none());
        for settings in [Fit { cycle_s: Some(1.0), ..over(PHASE) }, Fit { cycle_by: Some("lift".to_owned()), ..over(PHASE) }] {
            let (found, warnings) = scheduled(&trials, &settings, 8.0).expect("a fit").expect("a schedule");
            let named = |name: &str| found.entries.iter().find(|e| e.name == name).expect("an entry");
            let (k, m) = (named("K"), named("M"));
            assert_eq!((k.unit.as_str(), m.varies, k.value.len(), found.at[100]), ("N/m", false, 101, 1.0));
            // The sums of central differences at 8 Hz are 0.5 % short of derivatives; ten newtons a metre are that and the errors.
            assert!((k.value[0] - 100.0).abs() < 10.0 && (k.value[50] - 300.0).abs() < 10.0 && (m.value[0] - 1.0).abs() < 0.02, "{k:?}");
            assert!(k.band95[0][7] <= k.ci95[0][7] && k.ci95[0][7] < k.value[7]);
            assert!(found.tests[0].matrix == Term::Stiffness && found.tests[0].p_value.is_some_and(|p| p < 1e-6));
            assert!(found.held_out[0].varying_vaf > found.held_out[0].constant_vaf && found.command_share.is_none() && warnings.is_empty());
        }
    }

    #[test]
    fn settings_that_do_not_belong_together_are_refused() {
        let trials = spring();
        let said = |settings: &Fit| scheduled(&trials, settings, 8.0).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(said(&Fit { knots: Some(8), ..Fit::default() }).contains("`knots` is of a `schedule`"));
        assert!(said(&over("elbow")).contains("no channel \"elbow\""));
        assert!(said(&Fit { band_hz: Some([0.5, 60.0]), cycle_s: Some(1.0), ..over(PHASE) }).contains("leaves no room"));
        assert!(matches!(scheduled(&trials, &Fit::default(), 8.0), Ok(None)));
    }
}
