//! One trial: controller at its ticks, mechanics in between, sensors at the end.

use crate::controller::Hold;
use crate::coupled::Coupled;
use crate::error::DeviceError;
use crate::experiment::Experiment;
use crate::integrate::{Accuracy, Means, Stepper};
use crate::noise::low_pass_noise;
use crate::posture_hold::PostureHold;
use crate::safety::Watch;
use crate::sensors::Averaging;
use ndof_linear::square::{add_transposed, multiply};
use ndof_models::robot::{EndpointKinematics, Robot, quantise};
use ndof_models::{ForceLaw, Stage};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Makes a stage in its initial state, once a trial.
pub type StageMaker = Box<dyn Fn() -> Box<dyn Stage> + Send + Sync>;

/// What acts in a simulation over and above the experiment: hidden effects, given as mechanics and stages.
pub struct Extras {
    /// Force laws on the limb, felt on the endpoint's axes.
    pub limb: Vec<Box<dyn ForceLaw>>,
    /// Force laws on the robot's endpoint, between command and transducer.
    pub robot: Vec<Box<dyn ForceLaw>>,
    /// Stages by recorded channel (`force_x`, `pos_y`, …), in order, after noise and quantisation.
    pub sensors: Vec<(String, StageMaker)>,
    /// Stages by axis between commanded and applied force.
    pub actuators: Vec<(String, StageMaker)>,
    /// Force noise of the limb in place of the experiment's, for some axes: axis, rms, cut-off (Hz).
    pub limb_noise: Vec<(String, f64, f64)>,
    /// Accuracy of the integration.
    pub accuracy: Accuracy,
}

impl Default for Extras {
    fn default() -> Self {
        Extras { limb: Vec::new(), robot: Vec::new(), sensors: Vec::new(), actuators: Vec::new(), limb_noise: Vec::new(), accuracy: Accuracy::Relative(1e-6) }
    }
}

/// Random streams of a trial; each draws from its own so that switching one off leaves the others.
const STREAMS_PER_TRIAL: u64 = 64;

fn stream(seed: u64, trial: usize, which: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(trial as u64 * STREAMS_PER_TRIAL + which as u64);
    rng
}

/// Refuses commands of another number of axes or samples.
fn require_shape(commanded: &[Vec<f64>], axes: usize, samples: usize) -> Result<(), DeviceError> {
    let other = commanded.iter().map(Vec::len).find(|l| *l != samples);
    if commanded.len() == axes && other.is_none() {
        return Ok(());
    }
    Err(DeviceError::Excitation { found_axes: commanded.len(), found_samples: other.unwrap_or(samples), axes, samples })
}

/// What turns a command at the endpoint into torques of the motors.
struct Motors<'a> {
    robot: &'a dyn Robot,
    /// Holds what a command does not move.
    idle: Option<PostureHold>,
    /// Share of gravity that is taken off.
    compensation: f64,
    quantum: f64,
    still: Vec<f64>,
    gravity: Vec<f64>,
}

impl<'a> Motors<'a> {
    fn new(robot: &'a dyn Robot, idle: Option<PostureHold>, quantum: f64, joints: usize) -> Result<Self, DeviceError> {
        DeviceError::not_negative("controller.torque_quantum", quantum)?;
        let zeros = || vec![0.0; joints];
        Ok(Motors { robot, idle, compensation: robot.gravity_compensation(), quantum, still: zeros(), gravity: zeros() })
    }

    fn torque(&mut self, command: &[f64], jacobian: &[f64], angles: &[f64], torque: &mut [f64]) {
        torque.fill(0.0);
        add_transposed(jacobian, command, 1.0, torque);
        if let Some(idle) = &mut self.idle {
            idle.add(self.robot, angles, jacobian, torque);
        }
        if self.compensation > 0.0 {
            self.robot.bias(angles, &self.still, &mut self.gravity);
            torque.iter_mut().zip(&self.gravity).for_each(|(torque, gravity)| *torque += self.compensation * gravity);
        }
        torque.iter_mut().for_each(|torque| *torque = quantise(*torque, self.quantum));
        self.robot.limit_torque(torque);
    }
}

/// Simulates trial `trial` under `commanded` forces (axis × sample, the discarded stretch first) and returns the recording.
///
/// Channels, for each axis in order: `cmd_*`, then `force_*` (or `torque_*`), then `pos_*` (or `angle_*`). Row k is the mean
/// over the interval in which command k was held; with instant sampling the value just before that command.
///
/// # Errors
/// [`DeviceError`] if parts do not fit, or the motion diverges.
pub fn simulate_trial(experiment: &Experiment, commanded: &[Vec<f64>], extras: &Extras, trial: usize) -> Result<Recording, DeviceError> {
    let bench = experiment.build()?;
    let (robot, limb) = (bench.device.robot.as_ref(), bench.limb.as_ref());
    let (n, m) = (bench.rest.len(), robot.axes().len());
    let (discarded, recorded) = experiment.samples();
    let total = discarded + recorded;
    require_shape(commanded, m, total)?;
    let (fs, defaults) = (experiment.sample_rate_hz, bench.device.defaults);
    let axes: Vec<&str> = robot.axes().iter().map(|a| a.name.as_str()).collect();
    let noise = limb_noise(experiment, extras, trial, total, &axes)?;
    let mut actuators = stages(&extras.actuators, &axes)?;

    let laws = [extras.robot.as_slice(), extras.limb.as_slice()];
    let shortest = Stepper::shortest_step_s(1.0 / fs, extras.accuracy);
    let mut system = Coupled::new(robot, limb, bench.device.transducer, laws, bench.rest.clone(), shortest);
    let mut stepper = Stepper::new(&system, 1.0 / fs, extras.accuracy);
    let mut y = stepper.state(&system.equilibrium());
    let mut means = Means::new(m, n);

    let counts = experiment.sensors.encoder_counts(robot.joints().encoder_counts);
    let mut measured = EndpointKinematics::new(m, n);
    let (mut angles, mut place) = (vec![0.0; n], vec![0.0; n]);
    let still = vec![0.0; n];
    let mut read = |y: &[f64], angles: &mut [f64]| {
        place.iter_mut().zip(&bench.rest).zip(y).for_each(|((p, r), y)| *p = r + y);
        robot.encode(&place, counts, angles);
    };
    read(&y, &mut angles);
    robot.kinematics(&angles, &still, &mut measured);
    let bias = if experiment.controller.hold && experiment.controller.compensate_mean_force { limb.mean_force().to_vec() } else { vec![0.0; m] };
    let force_limit = experiment.controller.force_limit.unwrap_or(defaults.force_limit);
    let mut hold = Hold::new(bench.hold.clone(), &system.rest_endpoint, &measured.endpoint, bias, force_limit);

    let idle = PostureHold::new(robot, &bench.rest, bench.hold.velocity_cutoff_hz, fs);
    let mut motors = Motors::new(robot, idle, experiment.controller.torque_quantum, n)?;
    let watch = Watch { limits: experiment.controller.safety, range: robot.range(), trial };

    let [mut force, mut position] = [0; 2].map(|_| vec![Vec::with_capacity(recorded); m]);
    let mut correction = vec![0.0; n];
    let (mut shift, mut moved) = (vec![0.0; m], vec![0.0; m]);
    for k in 0..total {
        let time_s = (k as f64 - discarded as f64) / fs;
        read(&y, &mut angles);
        robot.kinematics(&angles, &still, &mut measured);
        let path = |i: usize| experiment.controller.movement.as_ref().map_or(0.0, |path| path.share(path.phase(time_s)) * path.to[i]);
        let command = hold.step(&measured.endpoint, path, |i| commanded[i][k]);
        for (axis, stage) in &mut actuators {
            command[*axis] = stage.step(command[*axis]);
        }
        motors.torque(command, &measured.jacobian, &angles, &mut system.torque);
        for (w, noise) in system.limb_force.iter_mut().zip(&noise) {
            *w = noise.as_ref().map_or(0.0, |n| n[k]);
        }
        let instant = experiment.sensors.averaging == Averaging::Instant;
        if instant && k >= discarded {
            for i in 0..m {
                let (e, rate) = (y[2 * n + i], y[2 * n + m + i]);
                force[i].push(system.transducer.stiffness * e + system.transducer.damping * rate);
                position[i].push(measured.endpoint[i]);
            }
        }
        stepper.interval(&mut system, time_s, &mut y, &mut means);
        if !y.iter().all(|v| v.is_finite()) {
            return Err(DeviceError::Diverged { trial, time_s });
        }
        moved.iter_mut().zip(&means.endpoint).zip(&system.rest_endpoint).for_each(|((moved, now), rest)| *moved = now - rest);
        watch.check(time_s, &means.force, system.endpoint_velocity(), &moved, &means.joints)?;
        if !instant && k >= discarded {
            // The encoders' steps, carried from the mean angles to the mean position.
            robot.encode(&means.joints, counts, &mut correction);
            correction.iter_mut().zip(&means.joints).for_each(|(c, q)| *c -= q);
            multiply(&measured.jacobian, &correction, &mut shift);
            for i in 0..m {
                force[i].push(means.force[i]);
                position[i].push(means.endpoint[i] + shift[i]);
            }
        }
    }
    record(experiment, commanded, extras, trial, &bench, [force, position])
}

/// Adds the sensors' noise, steps and stages, and names the channels.
fn record(
    experiment: &Experiment,
    commanded: &[Vec<f64>],
    extras: &Extras,
    trial: usize,
    bench: &crate::experiment::Bench,
    [mut force, position]: [Vec<Vec<f64>>; 2],
) -> Result<Recording, DeviceError> {
    let axes = bench.device.robot.axes();
    let rms = experiment.sensors.force_noise_rms.unwrap_or(bench.device.defaults.force_noise_rms);
    let quantum = experiment.sensors.force_quantum.unwrap_or(bench.device.defaults.force_quantum);
    let range = experiment.sensors.force_range.unwrap_or(bench.device.defaults.force_range);
    if range.is_nan() || range <= 0.0 {
        return Err(DeviceError::value("sensors.force_range", range, "positive"));
    }
    for (what, value) in [("sensors.force_noise_rms", rms), ("sensors.force_quantum", quantum)] {
        DeviceError::not_negative(what, value)?;
    }
    if let Some((map, constant)) = experiment.sensors.force_map(axes)? {
        let samples = force.first().map_or(0, Vec::len);
        for k in 0..samples {
            let shown: Vec<f64> =
                map.rows().into_iter().zip(&constant).map(|(row, c)| c + row.iter().zip(&force).map(|(s, f)| s * f[k]).sum::<f64>()).collect();
            force.iter_mut().zip(shown).for_each(|(f, shown)| f[k] = shown);
        }
    }
    for (i, samples) in force.iter_mut().enumerate() {
        let mut rng = stream(experiment.seed, trial, axes.len() + i);
        for sample in samples {
            let noise: f64 = rng.sample(StandardNormal);
            *sample = quantise((*sample + rms * noise).clamp(-range, range), quantum);
        }
    }
    let (discarded, _) = experiment.samples();
    let (mut commands, mut forces, mut positions) = (Vec::new(), Vec::new(), Vec::new());
    for (((axis, command), force), position) in axes.iter().zip(commanded).zip(force).zip(position) {
        let turning = axis.rotational;
        let (effort, motion) = (Unit::si(Quantity::Effort, turning), Unit::si(Quantity::Displacement, turning));
        let [f, p] = if turning { ["torque", "angle"] } else { ["force", "pos"] };
        commands.push(Channel::new(format!("cmd_{}", axis.name), effort.clone(), command[discarded..].to_vec()));
        forces.push(Channel::new(format!("{f}_{}", axis.name), effort, force));
        positions.push(Channel::new(format!("{p}_{}", axis.name), motion, position));
    }
    let mut channels: Vec<Channel> = commands.into_iter().chain(forces).chain(positions).collect();
    let sensors = stages(&extras.sensors, &channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>())?;
    for (index, mut stage) in sensors {
        channels[index].samples.iter_mut().for_each(|s| *s = stage.step(*s));
    }
    Ok(Recording::new(experiment.sample_rate_hz, channels)?)
}

/// A stage with the index of what it acts on.
type Placed = (usize, Box<dyn Stage>);

/// Fresh stages with the index of their channel among `names`.
fn stages(makers: &[(String, StageMaker)], names: &[&str]) -> Result<Vec<Placed>, DeviceError> {
    makers.iter().map(|(name, make)| Ok((channel(names, name)?, make()))).collect()
}

fn channel(names: &[&str], name: &str) -> Result<usize, DeviceError> {
    names.iter().position(|n| *n == name).ok_or_else(|| DeviceError::NoChannel { name: name.to_owned(), available: names.join(", ") })
}

/// The limb's own force, one signal an axis, `None` where it makes none.
fn limb_noise(experiment: &Experiment, extras: &Extras, trial: usize, count: usize, axes: &[&str]) -> Result<Vec<Option<Vec<f64>>>, DeviceError> {
    let mut levels = vec![None; axes.len()];
    if let Some(noise) = experiment.limb.noise() {
        let rms = noise.rms_n.values(axes.len()).ok_or_else(|| DeviceError::size("limb.noise.rms_n", "another number of axes", axes.len()))?;
        levels = rms.into_iter().map(|rms| Some((rms, noise.cutoff_hz))).collect();
    }
    for (name, rms, cutoff) in &extras.limb_noise {
        levels[channel(axes, name)?] = Some((*rms, *cutoff));
    }
    levels
        .into_iter()
        .enumerate()
        .map(|(i, level)| match level {
            Some((rms, cutoff)) => {
                DeviceError::not_negative("limb.noise.rms_n", rms)?;
                if !(cutoff > 0.0 && cutoff < experiment.sample_rate_hz / 2.0) {
                    return Err(DeviceError::value("limb.noise.cutoff_hz", cutoff, "between 0 and half of the sample rate"));
                }
                let mut rng = stream(experiment.seed, trial, i);
                Ok((rms > 0.0).then(|| low_pass_noise(&mut rng, rms, cutoff, experiment.sample_rate_hz, count)))
            }
            None => Ok(None),
        })
        .collect()
}
