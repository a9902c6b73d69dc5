//! What the programs that measure have in common: signals, the arm experiment, clocks.

#![allow(dead_code, reason = "each program takes the part that it needs")]

use ndof::devices::{Accuracy, DeviceConfig, EndpointLinearConfig, Experiment, Extras, LimbConfig, Sensors, simulate_trial};
use ndof::signal::{FilteredNoise, Recording, Welch};
use ndof::sysid::{Labels, Ports, ResponseKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use realfft::RealFftPlanner;
use std::hint::black_box;
use std::time::Instant;

/// White noise, one vector a channel.
pub fn channels(count: usize, samples: usize) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    (0..count).map(|_| (0..samples).map(|_| rng.random_range(-1.0..1.0)).collect()).collect()
}

/// References, inputs and outputs in this order, as many of each; no references if `held` is false.
pub fn ports(axes: usize, held: bool) -> (Ports, Labels) {
    let first = if held { axes } else { 0 };
    let ports = Ports { references: (0..first).collect(), inputs: (first..first + axes).collect(), outputs: (first + axes..first + 2 * axes).collect() };
    let labels = Labels::numbered(&ports, ResponseKind::Compliance);
    (ports, labels)
}

/// Every segment of every channel copied into the transform's buffer and transformed, and nothing else: the limit.
pub fn bare_transforms(welch: &Welch, channels: &[&[f64]]) {
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(welch.nfft);
    let (mut input, mut output, mut scratch) = (fft.make_input_vec(), fft.make_output_vec(), fft.make_scratch_vec());
    for channel in channels {
        for segment in channel.windows(welch.nperseg).step_by(welch.nperseg - welch.noverlap) {
            input[..welch.nperseg].copy_from_slice(segment);
            input[welch.nperseg..].fill(0.0);
            fft.process_with_scratch(&mut input, &mut output, &mut scratch).expect("lengths of the plan");
            black_box(&output);
        }
    }
}

/// The patient-like arm, held by MIT-MANUS (five bars, dry friction, stiff transducer, sampled control).
pub fn arm(duration_s: f64) -> Experiment {
    let limb = EndpointLinearConfig {
        M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
        B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
        K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
        ..EndpointLinearConfig::default()
    };
    // Without steps in what is measured, so that an error of the integration is one.
    let sensors = Sensors { force_noise_rms: Some(0.0), force_quantum: Some(0.0), encoder_bits: Some(0), ..Sensors::default() };
    Experiment { duration_s, discard_s: 0.0, sensors, ..Experiment::new(DeviceConfig::named("mit-manus"), LimbConfig::EndpointLinear(limb)) }
}

/// Filtered noise of 4 N.
pub fn perturbation(experiment: &Experiment) -> Vec<Vec<f64>> {
    let (discarded, recorded) = experiment.samples();
    FilteredNoise { axes: 2, samples: discarded + recorded, rms: 4.0, ..FilteredNoise::default() }.generate(1).expect("valid settings")
}

/// One trial of it.
pub fn simulate(experiment: &Experiment, command: &[Vec<f64>], accuracy: Accuracy) -> Recording {
    simulate_trial(experiment, command, &Extras { accuracy, ..Extras::default() }, 0).expect("a simulation")
}

/// Shorter runs than this are timed by the clock on the wall, the best of many: they fit between two interruptions.
const SHORT_S: f64 = 0.03;

/// Processor time of this thread, where the system tells it.
fn thread_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse::<f64>().ok().map(|ns| ns * 1e-9)
}

/// Of a short work, runs behind each other, so that it finds caches and heap as it left them.
const AT_ONCE: usize = 4;

/// Seconds of each of several works, run in turn so that a disturbance hits all of them; the best of `runs`.
pub fn race(runs: usize, works: &mut [&mut dyn FnMut()]) -> Vec<f64> {
    let mut best = vec![f64::INFINITY; works.len()];
    for _ in 0..runs {
        for (work, best) in works.iter_mut().zip(&mut best) {
            for _ in 0..AT_ONCE {
                let (clock, before) = (Instant::now(), thread_seconds());
                work();
                let (wall, spent) = (clock.elapsed().as_secs_f64(), thread_seconds().zip(before).map(|(after, before)| after - before));
                *best = best.min(if wall > SHORT_S { spent.unwrap_or(wall) } else { wall });
                if wall > SHORT_S {
                    break;
                }
            }
        }
    }
    best
}

/// Seconds on the wall: for works of several threads.
pub fn wall(runs: usize, work: &mut dyn FnMut()) -> f64 {
    (0..runs).fold(f64::INFINITY, |best, _| {
        let clock = Instant::now();
        work();
        best.min(clock.elapsed().as_secs_f64())
    })
}
