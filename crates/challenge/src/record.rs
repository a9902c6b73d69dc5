//! From what moves to a recording: sensors, steps, rates.

use super::hide::Hiding;
use super::laws::World;
use super::motion::{Played, Robot, held, sines, torque};
use super::plants::{Plant, Spec};
use super::sensors::{average, band_noise, measured, uneven};
use crate::case::{Case, Made, Setting};
use crate::clock::{FINE_HZ, FS};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

/// A case with everything drawn that it has in common with its twin without effects.
pub struct Scene<'a> {
    pub case: &'a Case,
    pub setting: &'a Setting,
    pub spec: Spec,
    pub hiding: Hiding,
    /// The limb with the robot's inertia.
    pub world: World,
    /// The limb by itself.
    pub limb: World,
}

impl<'a> Scene<'a> {
    /// Draws plant and effects.
    pub fn new(case: &'a Case, setting: &'a Setting) -> Self {
        let (mut plants, mut effects) = (stream(case, 1), stream(case, 2));
        let n = case.plant.axes();
        let axis = plants.random_range(0..n);
        let spec = Spec::draw(case.plant, &mut plants);
        let friction = if n > 1 { plants.random_range(0.02..0.12) } else { 0.0 };
        let mut hiding = Hiding::new(case, setting, &spec, axis, friction);
        for hidden in &case.hidden {
            hiding.add(hidden, case.other, &mut effects);
        }
        if case.background {
            hiding.small_imperfections(&mut effects);
        }
        let limb = World {
            n,
            axis,
            m_inv: spec.limb_inverse(hiding.added_mass),
            b: spec.b.clone(),
            k: spec.k.clone(),
            laws: hiding.laws.clone(),
            delay_steps: (hiding.reflex_delay * FINE_HZ).round() as usize,
            duration: case.duration_s,
            x_size: spec.x[axis],
            v_size: hiding.speed(),
            trial: 0,
        };
        let world = World { m_inv: spec.total_inverse(hiding.added_mass), ..limb.clone() };
        Scene { case, setting, spec, hiding, world, limb }
    }

    /// Makes the recordings, and what happened on the fine grid.
    pub fn play(&self) -> (Made, Vec<Played>) {
        let (case, spec) = (self.case, &self.spec);
        let n = case.plant.axes();
        let mut rng = stream(case, 3);
        let (recordings, played) = (0..case.trials).map(|trial| self.trial(trial, &mut rng)).unzip();
        let stride = if case.plant == Plant::Motion { 2 } else { 3 };
        let at = |o: usize| -> Vec<usize> { (0..n).map(|i| i * stride + o).collect() };
        let ports = if case.plant == Plant::Motion {
            Ports { references: vec![], inputs: at(1), outputs: at(0) }
        } else {
            Ports { references: at(2), inputs: at(0), outputs: at(1) }
        };
        let (axis, axis_name) = (self.hiding.axis, case.plant.names()[self.hiding.axis]);
        let truth = self.hiding.truth.clone();
        (Made { recordings, ports, axis, axis_name, truth, mass: spec.m.clone(), damping: spec.b.clone(), stiffness: spec.k.clone() }, played)
    }

    /// The limb in one of its trials, with the robot's inertia or without.
    pub fn in_trial(&self, world: &World, trial: usize) -> World {
        let mut world = World { trial, ..world.clone() };
        // A knock happens once.
        world.laws.retain(|law| law.kind != "knock" || trial == 0);
        world
    }

    fn trial(&self, trial: usize, rng: &mut ChaCha8Rng) -> (Recording, Played) {
        let (case, spec, hiding) = (self.case, &self.spec, &self.hiding);
        let ticks = (case.duration_s * FS) as usize;
        let own = self.own_forces(ticks, rng);
        let world = self.in_trial(&self.world, trial);
        let (played, command) = if case.plant == Plant::Motion {
            let path = sines(rng, ticks, spec.x[0]);
            let force = torque(&world, &path, &own[0], spec.m[0][0] + hiding.added_mass);
            (Played { force: vec![force], motion: vec![path.x], marks: vec![] }, vec![])
        } else {
            let command = self.command(ticks, rng);
            let robot = Robot {
                inertia: &spec.robot,
                kp: &spec.kp,
                kd: &spec.kd,
                friction: &hiding.robot_friction,
                smoothing: 0.004 * hiding.speed(),
                position: case.plant == Plant::Mass,
                limit: None,
            };
            (held(&world, &command, &own, &robot), command)
        };
        (self.recording(trial, &played, &command, rng), played)
    }

    /// Forces that the limb makes by itself, on the controller's ticks.
    fn own_forces(&self, ticks: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let (spec, hiding, tremor) = (&self.spec, &self.hiding, &self.hiding.tremor);
        let others = if self.setting.quiet { 0.0 } else { self.setting.own };
        let size = |i: usize| if i == hiding.axis { hiding.own } else { spec.own[i] * others };
        let mut own: Vec<Vec<f64>> = (0..self.world.n).map(|i| band_noise(rng, ticks + 1, 2.0, size(i), 2)).collect();
        let mut phase: f64 = rng.random_range(0.0..6.0);
        let swelling = tremor.form == "swelling";
        let wander = if swelling { 0.03 } else { 0.01 };
        for k in 0..=ticks {
            let e: f64 = rng.sample(StandardNormal);
            if tremor.amplitude == 0.0 {
                continue;
            }
            let slide = if tremor.form == "sliding" { 1.0 + 0.16 * (k as f64 / ticks as f64 - 0.5) } else { 1.0 };
            phase += TAU * tremor.frequency * slide / FS + wander * e;
            let swell = if swelling { 1.0 + 0.5 * (TAU * 0.07 * k as f64 / FS).sin() } else { 1.0 };
            let wave = if tremor.form == "triangular" { phase.sin().asin() * 0.87 } else { phase.sin() };
            for (i, w) in own.iter_mut().enumerate() {
                w[k] += tremor.amplitude * swell * wave * if i == hiding.axis { 1.0 } else { 0.3 * spec.f[i] / spec.f[hiding.axis] };
            }
        }
        own
    }

    /// What the robot is told, by axis and tick.
    fn command(&self, ticks: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let case = self.case;
        let (cutoff, order) = match case.plant {
            Plant::Mass => (2.0, 4),
            Plant::Force => (12.0, 8),
            _ => (15.0, 8),
        };
        let size = |i: usize| case.command.0 * self.spec.command[i];
        let mut command: Vec<Vec<f64>> = (0..self.world.n).map(|i| band_noise(rng, ticks, case.command.1 * cutoff, size(i), order)).collect();
        if self.setting.bursts {
            for (i, command) in command.iter_mut().enumerate() {
                let swell = |k: usize| 0.75 * (0.8 * ((TAU * k as f64 / FS / 4.3 + i as f64).sin() + (TAU * k as f64 / FS / 7.1).sin())).exp();
                command.iter_mut().enumerate().for_each(|(k, c)| *c *= swell(k));
            }
        }
        command
    }

    /// Steps of the integrator in a sample.
    pub fn sub(&self) -> usize {
        (FINE_HZ / self.setting.rate_hz).round() as usize
    }

    /// The motion of an axis in a trial as its channel would have it without noise and steps.
    pub fn seen(&self, trial: usize, axis: usize, motion: &[f64], force: &[f64]) -> Vec<f64> {
        let rng = &mut stream(self.case, FAULTS + 2 * trial as u64);
        let mut x = motion.to_vec();
        if let Some(k) = self.hiding.series {
            x.iter_mut().zip(force).for_each(|(x, f)| *x += f / k);
        }
        if axis == self.hiding.axis {
            x = self.hiding.motion.iter().fold(x, |x, stage| stage.apply(&x, rng));
        }
        let differences = match self.setting.measured {
            Quantity::Velocity => 1,
            Quantity::Acceleration => 2,
            _ => 0,
        };
        for _ in 0..differences {
            let at = |k: usize| x[k.min(x.len() - 1)];
            x = (0..x.len()).map(|k| (at(k + 1) - at(k)) * FINE_HZ).collect();
        }
        average(&x, self.sub())
    }

    /// Efforts of all axes in a trial as their channels would have them without noise and steps.
    pub fn felt(&self, trial: usize, force: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let rng = &mut stream(self.case, FAULTS + 2 * trial as u64 + 1);
        let hiding = &self.hiding;
        let mut f: Vec<Vec<f64>> = force
            .iter()
            .enumerate()
            .map(|(i, f)| {
                let all = hiding.efforts.iter().chain(hiding.effort.iter().filter(|_| i == hiding.axis));
                average(&all.fold(f.clone(), |f, stage| stage.apply(&f, rng)), self.sub())
            })
            .collect();
        if hiding.angle != 0.0 && f.len() >= 2 {
            let (s, c) = hiding.angle.sin_cos();
            let (first, rest) = f.split_at_mut(1);
            for (a, b) in first[0].iter_mut().zip(&mut rest[0]) {
                (*a, *b) = if hiding.one_way { (*a, s * *a + *b) } else { (c * *a - s * *b, s * *a + c * *b) };
            }
        }
        f
    }

    /// Noise and step of the motion channel.
    fn motion_noise(&self, axis: usize, x: &[f64]) -> (f64, f64) {
        let spec = &self.spec;
        let rms = ndof_signal::rms(x);
        match self.setting.measured {
            Quantity::Velocity => (0.003 * rms, 0.002 * rms),
            Quantity::Acceleration => (0.006 * rms, 0.004 * rms),
            _ => (spec.x_step[axis] / 4.0, self.hiding.x_step.filter(|_| axis == self.hiding.axis).unwrap_or(spec.x_step[axis])),
        }
    }

    fn recording(&self, trial: usize, played: &Played, command: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Recording {
        let (case, spec) = (self.case, &self.spec);
        let rotational = case.plant.rotational();
        let unit = |q| Unit::si(q, rotational);
        let motion_word = match self.setting.measured {
            Quantity::Velocity => "vel",
            Quantity::Acceleration => "acc",
            _ if rotational => "angle",
            _ => "pos",
        };
        let effort_word = if rotational { "torque" } else { "force" };
        let names = case.plant.names();
        let f = self.felt(trial, &played.force);
        let mut channels = Vec::new();
        for i in 0..self.world.n {
            let d = self.seen(trial, i, &played.motion[i], &played.force[i]);
            let (noise, step) = self.motion_noise(i, &d);
            let (f, mut d) = if self.setting.quiet {
                (f[i].clone(), self.hiding.x_step.filter(|_| i == self.hiding.axis).map_or(d.clone(), |step| measured(rng, &d, 0.0, step)))
            } else {
                (measured(rng, &f[i], spec.f_noise[i], spec.f_step[i]), measured(rng, &d, noise, step))
            };
            if self.hiding.uneven_steps && i == self.hiding.axis {
                d = uneven(&d, step);
            }
            channels.push(Channel::new(format!("{effort_word}_{}", names[i]), unit(Quantity::Effort), f));
            channels.push(Channel::new(format!("{motion_word}_{}", names[i]), unit(self.setting.measured), d));
            if let Some(command) = command.get(i) {
                let quantity = if case.plant == Plant::Mass { Quantity::Displacement } else { Quantity::Effort };
                channels.push(Channel::new(format!("cmd_{}", names[i]), unit(quantity), self.per_sample(command)));
            }
        }
        Recording::new(self.setting.rate_hz, channels).expect("channels of one length")
    }

    /// What is held for a tick, as means over samples.
    fn per_sample(&self, ticks: &[f64]) -> Vec<f64> {
        if self.setting.rate_hz == FS {
            return ticks.to_vec();
        }
        let fine: Vec<f64> = ticks.iter().flat_map(|c| [*c; crate::clock::SUB]).collect();
        average(&fine, self.sub())
    }
}

/// First of the streams of what fails at random in channels.
const FAULTS: u64 = 100;

/// Random numbers of a case: plant, effects and noise have streams of their own.
pub fn stream(case: &Case, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(case.seed);
    rng.set_stream(number);
    rng
}
