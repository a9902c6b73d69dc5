//! From joint logs to a verdict.

use crate::again::again;
use crate::answer::Answer;
use crate::band::Band;
use crate::causes::{CAUSES, Form};
use crate::column::Column;
use crate::error::JointsError;
use crate::gears;
use crate::generic;
use crate::judged::{HeldUp, Judged, Searched, held_up, judged, most_causes, of_a_simulator};
use crate::left_noise::{noise_beside, noise_of};
use crate::logged::Logged;
use crate::lost::Lost;
use crate::mistaken::mistaken;
use crate::motion::{Motion, moves};
use crate::options::Options;
use crate::parts::Parts;
use crate::passing::passing;
use crate::pictures;
use crate::refined::shaped;
use crate::scene::{Scene, scene};
use crate::simulated::beside_the_file;
use crate::suspicions::{against, one_gain, suspicions};
use crate::table::View;
use crate::taken::Taken;
use crate::tilts;
use crate::unmoved::{needs_motion, unmoved};
use crate::zeros;
use ndof_devices::SerialChain;
use ndof_diagnose::{Diagnosis, Pictures};
use ndof_signal::Recording;
use ndof_sysid::Ports;
use std::sync::Mutex;

/// Samples that it takes to fit: twice the ten inertial parameters of a link, the most that one cause has.
const FEWEST_TO_FIT: usize = 20;
/// Samples that it takes to judge by: their scatter has then seven degrees of freedom.
const FEWEST_TO_JUDGE: usize = 8;
/// Says what the file of a robot gets wrong in these logs, and why; `ports` has the torques as inputs and the angles as outputs, in the order of
/// the chain's joints. `progress` is told in words what is being done.
///
/// Where a simulator logged the same commands, `simulated` are its logs, with the same channels: what is judged is then the simulator, and the file
/// says only how its torque changes where the measured motion differs from its own. Else it is empty, and the file is the simulation.
///
/// # Errors
/// [`JointsError`] if channels and joints do not match, nothing moves, the log is too short, or a simulator's log is not as long as the measured one.
///
/// ```
/// use ndof_devices::RobotConfig;
/// use ndof_joints::{Options, diagnose};
/// use ndof_signal::{Channel, Quantity, Recording, Unit};
/// use ndof_sysid::Ports;
///
/// let file = r#"
/// schema = "ndof/robot/1"
/// name = "pendulum"
/// joints = [{ name = "elbow", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.3, 0.0, 0.0] }]
/// "#;
/// let chain = RobotConfig::parse("pendulum.toml", file, None)?.chain()?;
///
/// // 60 s of the real one, which has a viscous friction of 0.4 N m s/rad too; the log has steps of 0.1 mrad and 0.02 N m.
/// let (mut angle, mut torque) = (Vec::new(), Vec::new());
/// for k in 0..6000 {
///     let t = f64::from(k) / 100.0;
///     let [mut q, mut v, mut a] = [0.0; 3];
///     for (size, w) in [(0.8, 1.3), (0.5, 2.9), (0.2, 5.3)] {
///         q += size * (w * t).sin();
///         v += size * w * (w * t).cos();
///         a -= size * w * w * (w * t).sin();
///     }
///     angle.push((q / 1e-4).round() * 1e-4);
///     torque.push(((0.18 * a - 2.0 * 9.81 * 0.3 * q.cos() + 0.4 * v) / 0.02).round() * 0.02);
/// }
///
/// let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
/// let log = Recording::new(100.0, vec![channel("torque_elbow", Quantity::Effort, torque), channel("angle_elbow", Quantity::Displacement, angle)])?;
/// let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
/// let (found, _) = diagnose(&chain, &[log], &[], &ports, &Options::default(), &mut |_| {})?;
/// assert_eq!(found.causes.len(), 1);
/// assert_eq!(found.causes[0].effect, "viscous-friction");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn diagnose(
    chain: &SerialChain,
    trials: &[Recording],
    simulated: &[Recording],
    ports: &Ports,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<(Diagnosis, Pictures), JointsError> {
    check(trials, ports)?;
    alike(trials, simulated)?;
    progress("smoothing the motion");
    // A simulator's log has row by row the times of the measured one.
    let lost = if simulated.is_empty() { Lost::of(trials, ports, options.false_alarms) } else { None };
    let filled = lost.as_ref().map(|lost| lost.filled(trials)).transpose()?;
    let trials = filled.as_deref().unwrap_or(trials);
    let (seen, motions) = scene(chain, trials, simulated, ports)?;
    let taken = Taken::of(&seen, &motions);
    if taken.is_as_it_is() {
        return judge(&seen, motions, trials, ports, (&taken, lost.as_ref()), options, progress);
    }
    let (chain, trials) = (taken.chain(chain), taken.trials(chain, trials, ports)?);
    let (seen, motions) = scene(&chain, &trials, &[], ports)?;
    judge(&seen, motions, &trials, ports, (&taken, lost.as_ref()), options, progress)
}

/// The same of logs that are taken as they are.
fn judge(
    scene: &Scene<'_>,
    mut motions: Vec<Motion>,
    trials: &[Recording],
    ports: &Ports,
    (taken, lost): (&Taken, Option<&Lost>),
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<(Diagnosis, Pictures), JointsError> {
    let band = Band::new([scene.fastest_hz, scene.lowest_hz()], scene.rate_hz);
    // As long as a period of the band's edge: a turn is over sooner.
    let longest = (scene.rate_hz / band.pass_hz).ceil() as usize;
    for motion in &mut motions {
        motion.moves = motion.sharp.iter().zip(&scene.joints).map(|(v, joint)| moves(v, joint.speed, longest)).collect();
    }
    let parts = Parts::of(&options.held_out, &motions, &band)?;
    let whole = Mutex::default();
    let [fitted, held] = [&parts.fitted, &parts.held].map(|part| View::new(scene, &motions, &band, &whole, part));
    let count = |view: &View<'_>| view.pieces.iter().map(|p| p.places.len()).sum::<usize>();
    if count(&fitted) < FEWEST_TO_FIT || count(&held) < FEWEST_TO_JUDGE {
        return Err(JointsError::TooShort { kept: count(&fitted), held_out: count(&held), pass_hz: band.pass_hz, needed: [FEWEST_TO_FIT, FEWEST_TO_JUDGE] });
    }
    progress("searching");
    let asked = CAUSES.iter().filter(|c| !options.without.iter().any(|w| w == c.card.name));
    // A joint that stands still has no speed for a law to be relative to, and a number that is none finds no column again.
    let mut forms: Vec<Form> = asked.flat_map(|c| (c.forms)(scene)).filter(|form| form.columns.iter().all(Column::has_numbers)).collect();
    let unmoved = unmoved(&fitted, trials, ports);
    forms.retain(|form| !needs_motion(form, &unmoved));
    let one_gain = one_gain(scene, &fitted);
    forms.retain(|form| (one_gain || form.columns[..] != [Column::Torques]) && scene.may_be_wrong(form));
    let against = against(scene, &fitted);
    forms.iter_mut().for_each(|form| form.turned_round(&against));
    if of_a_simulator(&fitted) {
        forms.iter_mut().for_each(Form::either_way);
        beside_the_file(&fitted, &mut forms, options.tolerance);
    }
    let tilted = tilts::by_itself(&fitted, &forms, options.tolerance);
    let tilt = tilted.as_ref().map_or([0.0; 3], tilts::tilt_of);
    forms.extend(tilted);
    let (noise, floor, left) = noise_of(&fitted, &forms);
    let [fitted, held] = [fitted, held].map(|view| view.in_noise(noise.clone()));
    forms.extend(zeros::by_themselves(&fitted, &forms));
    // Gears of other compliances than the search has look like other causes: those that it asks for settle first.
    let mut first = Searched::new(&fitted, &forms, floor.clone(), left.clone());
    let mut chosen = Vec::new();
    first.rule(&forms, options).search(&mut chosen, &[], most_causes(&fitted));
    let asked: Vec<Form> = chosen.iter().map(|k| forms[*k].clone()).collect();
    let plain = Logged::as_it_is(scene.joints.len());
    let settled = shaped(&fitted, &first.rule(&forms, options), &chosen, &plain);
    if gears::by_themselves(&fitted, &mut forms, &asked, &plain) || !settled.is_empty() {
        forms.extend(settled);
        first = Searched::new(&fitted, &forms, floor.clone(), left);
    }
    let HeldUp { judged: Judged { model, .. }, minor, .. } = held_up([&fitted, &held], &first.rule(&forms, options), options, (vec![], vec![]), progress);
    // What all columns leave together is no good estimate of coloured noise where they are many: what was found leaves more samples to know it by.
    let (noise, left) = noise_beside(&fitted, &model);
    let [fitted, held] = [fitted, held].map(|view| view.in_noise(noise.clone()));
    let asked: Vec<Form> = model.forms.iter().chain(minor.iter().map(|aside| &aside.form)).cloned().collect();
    gears::by_themselves(&fitted, &mut forms, &asked, &model.logged);
    forms.extend(model.forms.iter().filter(|form| form.shape.len() > 1).cloned());
    let searched = Searched::new(&fitted, &forms, floor, left);
    let rule = searched.rule(&forms, options);
    let (model, minor) = judged([&fitted, &held], &rule, options, progress);
    let (left, again) = (generic::left(&fitted, &held, &model), again([&fitted, &held], &model));
    let passing = passing([&fitted, &held], &model, options);
    let answer = Answer {
        scene,
        trials,
        ports,
        fitted: &fitted,
        held: &held,
        forms: &forms,
        searched: &searched,
        model: &model,
        left: &left,
        again: &again,
        mistaken: mistaken(scene, &motions, &tilt),
        suspicions: &suspicions(scene, &fitted, &model.logged),
        taken,
        lost,
        unmoved: &unmoved,
        passing: &passing,
        options,
    };
    Ok((answer.write(parts.words, minor), pictures::draw(&answer)))
}

fn check(trials: &[Recording], ports: &Ports) -> Result<(), JointsError> {
    let first = trials.first().ok_or(JointsError::NoTrial)?;
    let expected = first.sample_rate_hz();
    for (k, trial) in trials.iter().enumerate() {
        if trial.sample_rate_hz() != expected {
            return Err(JointsError::Rates { trial: k + 1, expected, found: trial.sample_rate_hz() });
        }
        ports.validate(trial.channels().len()).map_err(ndof_diagnose::DiagnoseError::from)?;
        trial.require_finite(ports.inputs.iter().chain(&ports.outputs).map(|c| trial.channels()[*c].name.as_str()))?;
    }
    Ok(())
}

/// Refuses a simulator's logs that are not the measured ones sample by sample; none are right as well.
///
/// # Errors
/// [`JointsError::SimulatedCount`], [`JointsError::SimulatedForm`], or a sample that is no number.
pub fn alike(trials: &[Recording], simulated: &[Recording]) -> Result<(), JointsError> {
    if simulated.is_empty() {
        return Ok(());
    }
    if simulated.len() != trials.len() {
        return Err(JointsError::SimulatedCount { measured: trials.len(), simulated: simulated.len() });
    }
    for (k, (trial, own)) in trials.iter().zip(simulated).enumerate() {
        let form = |r: &Recording| (r.len(), r.sample_rate_hz());
        if form(trial) != form(own) {
            return Err(JointsError::SimulatedForm { trial: k + 1, measured: form(trial), simulated: form(own) });
        }
        own.require_finite(own.channels().iter().map(|c| c.name.as_str()))?;
    }
    Ok(())
}
