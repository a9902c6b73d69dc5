//! What the true model would predict of the held-out part: the error below which no diagnosis can come.

use super::motion::{Imposed, Mark, Played, along, driven, torque};
use super::plants::Plant;
use super::record::Scene;
use crate::case::Made;
use crate::clock::{FINE_HZ, FS, SUB};
use ndof_signal::{forward_transform, spectrum_by};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// The true model's held-out error, by output.
pub struct TrueModel {
    /// rms(y - ŷ) / std(y), with one constant that is fitted, too; the first 2 s (or 5 %) are not scored.
    pub nrmse: Vec<f64>,
    /// The part of it that the limb's own force makes.
    pub own: Vec<f64>,
    /// From what and over which stretches it was predicted.
    pub how: &'static str,
}

/// Length of the windows of a plant without a spring.
const WINDOW_S: usize = 2;

/// Errors of one output: sums over what is scored.
#[derive(Clone, Default)]
struct Sums {
    count: f64,
    error: f64,
    own: f64,
    y: f64,
    yy: f64,
}

impl Sums {
    fn add(&mut self, y: f64, error: f64, own: f64) {
        self.count += 1.0;
        self.error += error * error;
        self.own += own * own;
        self.y += y;
        self.yy += y * y;
    }

    fn over_std(&self, squares: f64) -> f64 {
        let mean = self.y / self.count;
        (squares / self.count / (self.yy / self.count - mean * mean).max(f64::MIN_POSITIVE)).sqrt()
    }
}

/// The true model judged on the last third of the trials, or the last 30 % of the only one. Predicts from what was measured: with the effort
/// given, from that effort with its sensor's noise and without the limb's own force; with the motion given, from the measured one within the
/// band of the perturbation. None where what is hidden cannot be predicted.
pub fn judged(scene: &Scene, made: &Made, played: &[Played]) -> Option<TrueModel> {
    if scene.hiding.tremor.amplitude > 0.0 || scene.world.laws.iter().any(|law| law.kind == "x-rossler") {
        return None;
    }
    let n = scene.world.n;
    let trials = scene.case.trials;
    let mut sums = vec![Sums::default(); n];
    let held_out = if trials == 1 { 0..1 } else { trials - trials.div_ceil(3)..trials };
    for trial in held_out {
        let samples = made.recordings[trial].len();
        let from = if trials == 1 { (0.7 * samples as f64) as usize } else { 0 };
        match scene.case.plant {
            Plant::Motion => imposed(scene, made, played, trial, from, &mut sums),
            Plant::Mass => windows(scene, made, played, trial, from, &mut sums),
            _ => run(scene, made, played, trial, from, &mut sums),
        }
    }
    let how = match scene.case.plant {
        Plant::Motion => "from the measured motion within the band of the perturbation",
        Plant::Mass => "from the measured effort in windows of 2 s with fitted initial states",
        _ => "from the measured effort in one run a trial",
    };
    Some(TrueModel { nrmse: sums.iter().map(|s| s.over_std(s.error)).collect(), own: sums.iter().map(|s| s.over_std(s.own)).collect(), how })
}

/// The first of the held-out samples that is scored.
fn first_scored(scene: &Scene, samples: usize, from: usize) -> usize {
    from + (2.0 * scene.setting.rate_hz).min(0.05 * (samples - from) as f64).round() as usize
}

/// Adds a held-out stretch of one output, an offset taken off.
fn score(sums: &mut Sums, (y, told, without_noise): (&[f64], &[f64], &[f64]), scored: usize) {
    let mean = |of: &dyn Fn(usize) -> f64| (scored..told.len()).map(of).sum::<f64>() / (told.len() - scored).max(1) as f64;
    let [offset, own_offset] = [mean(&|k| y[k] - told[k]), mean(&|k| without_noise[k] - told[k])];
    (scored..told.len()).for_each(|k| sums.add(y[k], y[k] - told[k] - offset, without_noise[k] - told[k] - own_offset));
}

/// The true force on the fine grid with the noise of its sensor, which is held for a sample.
fn noisy_force(scene: &Scene, made: &Made, played: &Played, trial: usize) -> Vec<Vec<f64>> {
    let felt = scene.felt(trial, &played.force);
    let channels = made.recordings[trial].channels();
    let sub = scene.sub();
    let mut force = played.force.clone();
    for ((force, felt), channel) in force.iter_mut().zip(&felt).zip(&made.ports.inputs) {
        let read = &channels[*channel].samples;
        force.iter_mut().enumerate().for_each(|(k, f)| *f += read[(k / sub).min(read.len() - 1)] - felt[(k / sub).min(felt.len() - 1)]);
    }
    force
}

/// One free run of a limb with a spring.
fn run(scene: &Scene, made: &Made, played: &[Played], trial: usize, from: usize, sums: &mut [Sums]) {
    let played = &played[trial];
    let limb = scene.in_trial(&scene.limb, trial);
    let force = noisy_force(scene, made, played, trial);
    let rest = Mark { step: 0, x: vec![0.0; limb.n], v: vec![0.0; limb.n], s: limb.at_rest() };
    let motion = driven(&limb, &force, &rest, force[0].len());
    for (i, sums) in sums.iter_mut().enumerate() {
        let told = scene.seen(trial, i, &motion[i], &played.force[i]);
        let happened = scene.seen(trial, i, &played.motion[i], &played.force[i]);
        let y = &made.recordings[trial].channels()[made.ports.outputs[i]].samples;
        score(sums, (y, &told, &happened), first_scored(scene, y.len(), from));
    }
}

/// Free runs of a mass without a spring, in windows whose initial displacement and velocity are fitted (its motion is one axis).
fn windows(scene: &Scene, made: &Made, played: &[Played], trial: usize, from: usize, sums: &mut [Sums]) {
    let played = &played[trial];
    let limb = scene.in_trial(&scene.limb, trial);
    let force = noisy_force(scene, made, played, trial);
    let (sub, steps) = (scene.sub(), WINDOW_S * (FINE_HZ as usize));
    let y = &made.recordings[trial].channels()[made.ports.outputs[0]].samples;
    let (x_size, v_size) = (1e-3 * limb.x_size, 1e-3 * limb.v_size);
    for mark in played.marks.iter().step_by(WINDOW_S).filter(|m| m.step >= from * sub && m.step + steps <= force[0].len()) {
        let told = |dx: f64, dv: f64| -> Vec<f64> {
            let mark = Mark { x: vec![mark.x[0] + dx], v: vec![mark.v[0] + dv], ..mark.clone() };
            let motion = driven(&limb, &force, &mark, steps);
            scene.seen(trial, 0, &motion[0], &played.force[0][mark.step..mark.step + steps])
        };
        let base = told(0.0, 0.0);
        let (by_x, by_v) = (told(x_size, 0.0), told(0.0, v_size));
        let at = mark.step / sub;
        let rest = |k: usize| y[at + k] - base[k];
        let columns = |k: usize| [by_x[k] - base[k], by_v[k] - base[k]];
        let (mut a, mut r) = ([[0.0; 2]; 2], [0.0; 2]);
        for k in 0..base.len() {
            let c = columns(k);
            (0..2).for_each(|p| {
                r[p] += c[p] * rest(k);
                (0..2).for_each(|q| a[p][q] += c[p] * c[q]);
            });
        }
        let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
        let gain = [(r[0] * a[1][1] - r[1] * a[0][1]) / determinant, (a[0][0] * r[1] - a[1][0] * r[0]) / determinant];
        let happened = scene.seen(trial, 0, &played.motion[0][mark.step..mark.step + steps], &played.force[0][mark.step..mark.step + steps]);
        for k in 0..base.len() {
            let [x, v] = columns(k);
            let fitted = base[k] + gain[0] * x + gain[1] * v;
            sums[0].add(y[at + k], y[at + k] - fitted, happened[k] - fitted);
        }
    }
}

/// The torque that the measured motion needs.
fn imposed(scene: &Scene, made: &Made, played: &[Played], trial: usize, from: usize, sums: &mut [Sums]) {
    let channels = made.recordings[trial].channels();
    let (read, y) = (&channels[made.ports.inputs[0]].samples, &channels[made.ports.outputs[0]].samples);
    let limb = scene.in_trial(&scene.limb, trial);
    let ticks = (scene.case.duration_s * FS) as usize;
    let path = within_band(read, scene.setting.rate_hz, scene.case.plant.band_hz(), ticks * SUB);
    let own = vec![0.0; ticks + 1];
    let mass = scene.spec.m[0][0] + scene.hiding.added_mass;
    let told = scene.felt(trial, &[torque(&limb, &path, &own, mass)]);
    let happened = scene.felt(trial, &played[trial].force);
    score(&mut sums[0], (y, &told[0], &happened[0]), first_scored(scene, y.len(), from));
}

/// A measured motion on the fine grid, up to the end of the band: each sample is the mean over its interval.
fn within_band(read: &[f64], rate_hz: f64, band_hz: f64, fine: usize) -> Imposed {
    let duration = read.len() as f64 / rate_hz;
    let spectrum = spectrum_by(forward_transform(read.len()).as_ref(), &mut read.to_vec());
    let lines: Vec<Complex64> = (1..=(band_hz * duration) as usize)
        .map(|k| {
            let f = k as f64 / duration;
            let half = PI * f / rate_hz;
            spectrum[k] / read.len() as f64 * half / half.sin() * Complex64::from_polar(1.0, -TAU * f * 0.5 / rate_hz)
        })
        .collect();
    along(&lines, fine, duration)
}
