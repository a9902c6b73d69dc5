//! Recordings with something hidden in them, made by an integrator, a controller and sensors of their own.
//!
//! Nothing here comes from the crates under test: laws, integrator (explicit midpoint at 4 kHz), discrete controller with
//! filtered velocity, interval-averaging sensors, noise and quantisation are written again. With `other` the effects take functional forms
//! that the registry does not have.

pub mod draw;
mod hide;
mod laws;
mod motion;
mod plants;
mod sensors;
pub mod strength;

pub use plants::Plant;

use hide::Hiding;
use laws::World;
use motion::{Robot, held, imposed};
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use plants::Spec;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sensors::{average, band_noise, late, measured, smoothed};
use std::f64::consts::TAU;

/// Sample rate of the recordings.
pub const FS: f64 = 500.0;
/// Steps of the integrator in a sample.
pub const SUB: usize = 8;

/// Something hidden.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// Its name: an effect of the registry, a variety of one, or `x-…` for what no registry has.
    pub name: &'static str,
    /// 1 is strong.
    pub severity: f64,
}

/// What to make.
#[derive(Clone, Debug)]
pub struct Case {
    /// The experiment.
    pub plant: Plant,
    /// What is hidden in it.
    pub hidden: Vec<Hidden>,
    /// Functional forms that the registry does not have.
    pub other: bool,
    /// Small imperfections in every channel.
    pub background: bool,
    /// Number of recordings.
    pub trials: usize,
    /// Length of each.
    pub duration_s: f64,
    /// Of everything that is drawn.
    pub seed: u64,
    /// The commanded perturbation as a multiple of the plant's own: its size, and the end of its band.
    pub command: (f64, f64),
}

/// What was made.
pub struct Made {
    /// The trials.
    pub recordings: Vec<Recording>,
    /// Their roles.
    pub ports: Ports,
    /// Axis index of the hidden effects.
    pub axis: usize,
    /// Its name.
    pub axis_name: &'static str,
    /// True parameters, by hidden effect: (name, value).
    pub truth: Vec<Vec<(&'static str, f64)>>,
    /// The true inertia of the plant by rows, its
    pub mass: Vec<Vec<f64>>,
    /// damping,
    pub damping: Vec<Vec<f64>>,
    /// and stiffness.
    pub stiffness: Vec<Vec<f64>>,
}

/// Makes a case. Plant, effects and noise are drawn from streams of their own, so that a case without its effect differs in nothing else.
pub fn make(case: &Case) -> Made {
    let stream = |number: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(case.seed);
        rng.set_stream(number);
        rng
    };
    let (mut plants, mut effects, mut rng) = (stream(1), stream(2), stream(3));
    let n = case.plant.axes();
    let axis = plants.random_range(0..n);
    let spec = Spec::draw(case.plant, &mut plants);
    let friction = if n > 1 { plants.random_range(0.02..0.12) } else { 0.0 };
    let mut hiding = Hiding::new(case, &spec, axis, friction);
    for hidden in &case.hidden {
        hiding.add(hidden, &mut effects);
    }
    if case.background {
        hiding.small_imperfections(&mut effects);
    }
    let step = 1.0 / (FS * SUB as f64);
    let world = World {
        n,
        axis,
        m_inv: spec.total_inverse(axis, hiding.added_mass),
        b: spec.b.clone(),
        k: spec.k.clone(),
        laws: hiding.laws.clone(),
        other: case.other,
        delay_steps: (hiding.reflex_delay / step).round() as usize,
        duration: case.duration_s,
        x_size: spec.x[axis],
    };
    let recordings = (0..case.trials).map(|trial| record(case, &spec, &world, &hiding, trial, &mut rng)).collect();
    let stride = if case.plant == Plant::Motion { 2 } else { 3 };
    let at = |o: usize| -> Vec<usize> { (0..n).map(|i| i * stride + o).collect() };
    let ports = if case.plant == Plant::Motion {
        Ports { references: vec![], inputs: at(1), outputs: at(0) }
    } else {
        Ports { references: at(2), inputs: at(0), outputs: at(1) }
    };
    let axis_name = case.plant.names()[axis];
    Made { recordings, ports, axis, axis_name, truth: hiding.truth, mass: spec.m, damping: spec.b, stiffness: spec.k }
}

/// Forces that the limb makes by itself, on the grid of samples.
fn own_forces(case: &Case, spec: &Spec, hiding: &Hiding, samples: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut own: Vec<Vec<f64>> =
        (0..case.plant.axes()).map(|i| band_noise(rng, samples + 1, 2.0, if i == hiding.axis { hiding.own } else { spec.own[i] }, FS, 2)).collect();
    let mut phase: f64 = rng.random_range(0.0..6.0);
    let wander = if case.other { 0.03 } else { 0.01 };
    for k in 0..=samples {
        let e: f64 = rng.sample(StandardNormal);
        if hiding.tremor.0 == 0.0 {
            continue;
        }
        phase += TAU * hiding.tremor.1 / FS + wander * e;
        let swell = if case.other { 1.0 + 0.5 * (TAU * 0.07 * k as f64 / FS).sin() } else { 1.0 };
        for (i, w) in own.iter_mut().enumerate() {
            w[k] += hiding.tremor.0 * swell * phase.sin() * if i == hiding.axis { 1.0 } else { 0.3 * spec.f[i] / spec.f[hiding.axis] };
        }
    }
    own
}

fn record(case: &Case, spec: &Spec, world: &World, hiding: &Hiding, trial: usize, rng: &mut ChaCha8Rng) -> Recording {
    let n = world.n;
    let samples = (case.duration_s * FS) as usize;
    let own = own_forces(case, spec, hiding, samples, rng);
    let mut world = world.clone();
    // A knock happens once.
    world.laws.retain(|law| law.kind != "knock" || trial == 0);
    let (force, motion, command) = if case.plant == Plant::Motion {
        let (f, x) = imposed(rng, &world, &own[0], samples, spec.x[0], spec.m[0][0] + hiding.added_mass);
        (f, x, vec![])
    } else {
        let (cutoff, order) = match case.plant {
            Plant::Mass => (2.0, 4),
            Plant::Force => (12.0, 8),
            _ => (15.0, 8),
        };
        let command: Vec<Vec<f64>> = (0..n).map(|i| band_noise(rng, samples, case.command.1 * cutoff, case.command.0 * spec.command[i], FS, order)).collect();
        let robot = Robot {
            inertia: &spec.robot,
            kp: &spec.kp,
            kd: &spec.kd,
            friction: &hiding.robot_friction,
            smoothing: 0.004 * hiding.speed,
            position: case.plant == Plant::Mass,
            limit: None,
        };
        let (f, x) = held(&world, &command, &own, &robot);
        (f, x, command)
    };
    let mut f: Vec<Vec<f64>> = force
        .iter()
        .map(|f| {
            let once = |f: &[f64]| hiding.force_cutoff.map_or_else(|| f.to_vec(), |c| smoothed(f, if case.other { 1.55 * c } else { c }));
            let f = if case.other { once(&once(f)) } else { once(f) };
            average(&late(&f, hiding.force_delay))
        })
        .collect();
    let mut d: Vec<Vec<f64>> = motion.iter().map(|x| average(x)).collect();
    if let Some(k) = hiding.series {
        for (d, f) in d.iter_mut().zip(&force) {
            d.iter_mut().zip(average(f)).for_each(|(d, f)| *d += f / k);
        }
    }
    if hiding.angle != 0.0 && n >= 2 {
        let (s, c) = hiding.angle.sin_cos();
        let (first, rest) = f.split_at_mut(1);
        for (a, b) in first[0].iter_mut().zip(&mut rest[0]) {
            (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
        }
    }
    let rotational = case.plant.rotational();
    let unit = |q| Unit::si(q, rotational);
    let (effort_word, motion_word) = if rotational { ("torque", "angle") } else { ("force", "pos") };
    let names = case.plant.names();
    let mut channels = Vec::new();
    for i in 0..n {
        let step = hiding.x_step.filter(|_| i == hiding.axis).unwrap_or(spec.x_step[i]);
        let f = measured(rng, &f[i][..samples], spec.f_noise[i], spec.f_step[i]);
        let d = measured(rng, &d[i][..samples], spec.x_step[i] / 4.0, step);
        channels.push(Channel::new(format!("{effort_word}_{}", names[i]), unit(Quantity::Effort), f));
        channels.push(Channel::new(format!("{motion_word}_{}", names[i]), unit(Quantity::Displacement), d));
        if let Some(samples) = command.get(i) {
            let quantity = if case.plant == Plant::Mass { Quantity::Displacement } else { Quantity::Effort };
            channels.push(Channel::new(format!("cmd_{}", names[i]), unit(quantity), samples.clone()));
        }
    }
    Recording::new(FS, channels).expect("channels of one length")
}
