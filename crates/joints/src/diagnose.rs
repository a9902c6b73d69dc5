//! From joint logs to a verdict.

use crate::answer::Answer;
use crate::band::Band;
use crate::causes::{CAUSES, Form};
use crate::column::Column;
use crate::error::JointsError;
use crate::gears;
use crate::generic;
use crate::held_out::{gain, sure};
use crate::left_noise::{noise_beside, noise_of};
use crate::model::{Logged, Model, residual};
use crate::motion::{Motion, moves};
use crate::scene::scene;
use crate::search::{Rule, hypotheses};
use crate::table::{Table, View};
use ndof_devices::SerialChain;
use ndof_diagnose::{Diagnosis, HeldOut, Pictures, Stretch};
use ndof_signal::Recording;
use ndof_sysid::Ports;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;

/// Settings of a judgement of joint logs.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What is held out.
    pub held_out: HeldOut,
    /// Torque that does not matter, as a share of each joint's standard deviation.
    pub tolerance: f64,
    /// Probability with which anything may be named where nothing is missing.
    pub false_alarms: f64,
    /// Causes that the search leaves out.
    pub without: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Options { held_out: HeldOut::Auto, tolerance: 0.01, false_alarms: 0.01, without: Vec::new() }
    }
}

/// Samples that it takes to fit: twice the ten inertial parameters of a link, the most that one cause has.
const FEWEST_TO_FIT: usize = 20;
/// Samples that it takes to judge by: their scatter has then seven degrees of freedom.
const FEWEST_TO_JUDGE: usize = 8;
/// Probability with which a cause has to predict what was held out. What was fitted has been asked before, at the
/// rate of false alarms: by chance both say yes once in a thousand times.
const SURE: f64 = 0.9;
/// At most so many causes a joint: beyond it is a robot that this file is not of.
const CAUSES_A_JOINT: usize = 6;

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
    let (scene, mut motions) = scene(chain, trials, simulated, ports)?;
    let band = Band::new([scene.fastest_hz, scene.lowest_hz()], scene.rate_hz);
    // As long as a period of the band's edge: a turn is over sooner.
    let longest = (scene.rate_hz / band.pass_hz).ceil() as usize;
    for motion in &mut motions {
        motion.moves = motion.sharp.iter().zip(&scene.joints).map(|(v, joint)| moves(v, joint.speed, longest)).collect();
    }
    let shortest = trials.iter().map(Recording::len).min().unwrap_or(0);
    let stretches = options.held_out.divide(trials.len(), shortest, scene.rate_hz)?;
    let whole = Mutex::default();
    let [fitted, held] = stretches.each_ref().map(|s| View::new(&scene, &motions, &band, &whole, &ranges(s, &motions)));
    let count = |view: &View<'_>| view.pieces.iter().map(|p| p.places.len()).sum::<usize>();
    if count(&fitted) < FEWEST_TO_FIT || count(&held) < FEWEST_TO_JUDGE {
        return Err(JointsError::TooShort { kept: count(&fitted), held_out: count(&held), pass_hz: band.pass_hz, needed: [FEWEST_TO_FIT, FEWEST_TO_JUDGE] });
    }
    progress("searching");
    let asked = CAUSES.iter().filter(|c| !options.without.iter().any(|w| w == c.card.name));
    // A joint that stands still has no speed for a law to be relative to, and a number that is none finds no column again.
    let mut forms: Vec<Form> = asked.flat_map(|c| (c.forms)(&scene)).filter(|form| form.columns.iter().all(Column::has_numbers)).collect();
    let (noise, floor, left) = noise_of(&fitted, &forms);
    let [fitted, held] = [fitted, held].map(|view| view.in_noise(noise.clone()));
    // Gears of other compliances than the search has look like other causes: those that it asks for settle first.
    let mut first = Searched::new(&fitted, &forms, floor.clone(), left.clone());
    let mut chosen = Vec::new();
    first.rule(&forms, options).search(&mut chosen, &[], most_causes(&fitted));
    let asked: Vec<Form> = chosen.iter().map(|k| forms[*k].clone()).collect();
    if gears::by_themselves(&fitted, &mut forms, &asked, &Logged::as_it_is(scene.joints.len())) {
        first = Searched::new(&fitted, &forms, floor.clone(), left);
    }
    let HeldUp { judged: Judged { model, .. }, minor, .. } = held_up(&fitted, &held, &first.rule(&forms, options), options, progress);
    // What all columns leave together is no good estimate of coloured noise where they are many: what was found leaves more samples to know it by.
    let (noise, left) = noise_beside(&fitted, &model);
    let [fitted, held] = [fitted, held].map(|view| view.in_noise(noise.clone()));
    let asked: Vec<Form> = model.forms.iter().chain(minor.iter().map(|aside| &aside.form)).cloned().collect();
    gears::by_themselves(&fitted, &mut forms, &asked, &model.logged);
    let searched = Searched::new(&fitted, &forms, floor, left);
    let rule = searched.rule(&forms, options);
    let (model, minor) = judged(&fitted, &held, &rule, options, progress);
    let left = generic::left(&fitted, &held, &model);
    let answer = Answer { scene: &scene, trials, ports, fitted: &fitted, held: &held, forms: &forms, searched: &searched, model: &model, left: &left, options };
    Ok(answer.write(&stretches, minor))
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

/// Samples of the log that belong to a stretch, trial by trial.
fn ranges(stretch: &Stretch, motions: &[Motion]) -> Vec<(usize, Range<usize>)> {
    match stretch {
        Stretch::Trials(trials) => trials.iter().map(|t| (*t, 0..motions[*t].q[0].len())).collect(),
        Stretch::Samples(range) => (0..motions.len()).map(|t| (t, range.clone())).collect(),
    }
}

/// What a search starts from.
pub(crate) struct Searched {
    pub table: Table,
    /// Deviation of each joint's torque in the band that no column explains.
    pub floor: Vec<f64>,
    /// Samples of each joint less the factors of all columns: what its noise is known by.
    pub left: Vec<f64>,
    hypotheses: usize,
}

impl Searched {
    fn new(view: &View<'_>, forms: &[Form], floor: Vec<f64>, left: Vec<f64>) -> Self {
        let (columns, places) = Table::distinct(forms);
        let missing = view.missing(&Logged::as_it_is(view.scene.joints.len())).whitened(&view.noise);
        Searched { table: Table::new(places, &view.white(&columns), &missing), floor, left, hypotheses: hypotheses(forms) }
    }

    pub fn rule<'a>(&'a self, forms: &'a [Form], options: &Options) -> Rule<'a> {
        Rule { table: &self.table, forms, left: &self.left, hypotheses: self.hypotheses, false_alarms: options.false_alarms }
    }
}

/// A cause that is significant and not named, and why.
pub(crate) struct Aside {
    pub form: Form,
    pub removed: f64,
    pub why: String,
}

/// A model and what each of its forms is worth on the held-out part.
struct Judged {
    model: Model,
    worth: Vec<Worth>,
    /// Forms that are not to be named, and why.
    failing: Vec<(usize, String)>,
}

/// What a form is worth on the held-out part.
struct Worth {
    /// Log-likelihood that it gains.
    gain: f64,
    /// Probability that it gains at all.
    sure: f64,
    /// Its share of the joint's torque.
    matters: f64,
}

impl Judged {
    fn new(fitted: &View<'_>, held: &View<'_>, model: Model, options: &Options) -> Self {
        let worth: Vec<Worth> = (0..model.forms.len()).into_par_iter().map(|k| worth(fitted, held, &model, k)).collect();
        let failing = worth.iter().enumerate().filter_map(|(k, worth)| Some((k, reason(&model, k, worth, options)?))).collect();
        Judged { model, worth, failing }
    }
}

fn worth(fitted: &View<'_>, held: &View<'_>, model: &Model, k: usize) -> Worth {
    let less = without(fitted, model, k);
    Worth { gain: gain(held, &less, model).value, sure: sure(held, &less, model), matters: share(held, model, k) }
}

/// Why a form is not to be named.
fn reason(model: &Model, k: usize, worth: &Worth, options: &Options) -> Option<String> {
    if !model.forms[k].allows(&model.factors[k]) {
        return Some("it would need a parameter below zero".to_owned());
    }
    if worth.sure < SURE {
        return Some("what was held out is not predicted better with it beyond chance".to_owned());
    }
    (worth.matters < options.tolerance)
        .then(|| format!("its torque is {:.2} % of the joint's, below the tolerance of {:.2} %", 100.0 * worth.matters, 100.0 * options.tolerance))
}

/// A model all of whose causes hold, by their numbers among the forms, and what was set aside for it.
struct HeldUp {
    judged: Judged,
    chosen: Vec<usize>,
    minor: Vec<Aside>,
}

/// A model at its best for what is fitted, ready to be run along what is held out.
fn refined([fitted, held]: [&View<'_>; 2], forms: &[Form], logged: &Logged) -> Model {
    let mut model = Model::refined(fitted, forms, logged);
    gears::begin(fitted, held, &mut model);
    model
}

/// At most so many causes of a robot.
fn most_causes(view: &View<'_>) -> usize {
    CAUSES_A_JOINT * view.scene.joints.len() + 2
}

/// Searches, fits and judges until each cause predicts something of what was held out and matters: the one that is worth least is set aside, and
/// the search goes on without it.
fn held_up(fitted: &View<'_>, held: &View<'_>, rule: &Rule<'_>, options: &Options, progress: &mut dyn FnMut(&str)) -> HeldUp {
    let mut minor: Vec<Aside> = Vec::new();
    let mut chosen = Vec::new();
    let most = most_causes(fitted);
    let plain = Logged::as_it_is(fitted.noise.len());
    let refined = |chosen: &[usize]| refined([fitted, held], &chosen.iter().map(|k| rule.forms[*k].clone()).collect::<Vec<_>>(), &plain);
    loop {
        let aside: Vec<&Form> = minor.iter().map(|m| &m.form).collect();
        rule.search(&mut chosen, &aside, most);
        progress("fitting what was found");
        let judged = Judged::new(fitted, held, refined(&chosen), options);
        let mut failing = judged.failing.clone();
        if failing.is_empty() {
            return HeldUp { judged, chosen, minor };
        }
        failing.sort_by(|(a, _), (b, _)| judged.worth[*a].gain.total_cmp(&judged.worth[*b].gain));
        // One of each place: what one joint lacks hardly changes with what another has.
        let mut gone: Vec<usize> = Vec::new();
        for (k, why) in failing {
            let form = &judged.model.forms[k];
            if !gone.iter().any(|g| judged.model.forms[*g].joint == form.joint) {
                minor.push(Aside { form: form.clone(), removed: judged.worth[k].matters, why });
                gone.push(k);
            }
        }
        chosen = chosen.iter().enumerate().filter(|(k, _)| !gone.contains(k)).map(|(_, f)| *f).collect();
    }
}

/// [`held_up`], and those that were set aside asked once more: beside a wrong cause a right one may look superfluous.
fn judged(fitted: &View<'_>, held: &View<'_>, rule: &Rule<'_>, options: &Options, progress: &mut dyn FnMut(&str)) -> (Model, Vec<Aside>) {
    let HeldUp { mut judged, mut chosen, mut minor } = held_up(fitted, held, rule, options, progress);
    progress("asking again what was set aside");
    while chosen.len() < most_causes(fitted) {
        let solved = rule.solve(&chosen);
        let mut again: Vec<(usize, usize, f64)> = minor
            .iter()
            .enumerate()
            .filter_map(|(m, aside)| rule.best(&solved, |k| rule.forms[k].same_place(&aside.form)).map(|(k, worth)| (m, k, worth)))
            .collect();
        again.sort_by(|a, b| b.2.total_cmp(&a.2));
        let better = again.into_iter().find_map(|(m, k, _)| {
            let last = chosen.len();
            let forms: Vec<Form> = judged.model.forms.iter().chain([&rule.forms[k]]).cloned().collect();
            // What does not even look likely before it is moved to its best is not worth that; of a gear that says nothing.
            let near = Model::fit(fitted, &forms, &judged.model.logged);
            if rule.forms[k].gear().is_none() && worth(fitted, held, &near, last).sure < 0.5 {
                return None;
            }
            let more: Vec<usize> = chosen.iter().copied().chain([k]).collect();
            let model = refined([fitted, held], &forms, &judged.model.logged);
            if reason(&model, last, &worth(fitted, held, &model, last), options).is_some() {
                return None;
            }
            let judged = Judged::new(fitted, held, model, options);
            judged.failing.is_empty().then_some((m, more, judged))
        });
        let Some((m, more, found)) = better else { break };
        minor.remove(m);
        (chosen, judged) = (more, found);
    }
    let mut model = judged.model;
    model.order(&judged.worth.iter().map(|w| w.gain).collect::<Vec<_>>());
    (model, minor)
}

/// The logged torques without what a form takes off them.
fn put_back(logged: &Logged, form: &Form) -> Logged {
    let mut logged = logged.clone();
    match (form.cause.card.name, form.joint) {
        ("torque-delay", Some(j)) => logged.late_s[j] = 0.0,
        ("torque-scale", Some(j)) => logged.gain[j] = 1.0,
        ("base-tilt", _) => logged.tilt = [0.0; 3],
        _ => {}
    }
    logged
}

/// The model without one of its forms, all else fitted anew.
pub(crate) fn without(view: &View<'_>, model: &Model, k: usize) -> Model {
    let mut forms = model.forms.clone();
    let gone = forms.remove(k);
    Model::fit(view, &forms, &put_back(&model.logged, &gone))
}

/// rms of a form's torque over the deviation of the joint's, where it is largest.
pub(crate) fn share(view: &View<'_>, model: &Model, k: usize) -> f64 {
    let (mut forms, mut factors) = (model.forms.clone(), model.factors.clone());
    let logged = put_back(&model.logged, &forms.remove(k));
    factors.remove(k);
    let without = Model { forms, factors, logged, covariance: vec![], places: vec![] };
    let mut change = residual(view, &without);
    change.add(-1.0, &residual(view, model));
    (0..view.scene.joints.len())
        .map(|j| {
            let own: Vec<f64> = change.0.iter().filter_map(|p| p[j].as_deref()).flatten().copied().collect();
            (own.iter().map(|x| x * x).sum::<f64>() / own.len().max(1) as f64).sqrt() / view.scene.joints[j].torque.max(f64::MIN_POSITIVE)
        })
        .fold(0.0, f64::max)
}
