//! Do intervals hold when nothing is asked for, neither method nor band nor hold, over recordings as laboratories have them?
//!
//! `cargo run --release --example default_bands [RECORDS]` (default 100) simulates so many records of each kind, fits each with the defaults, and counts
//! how often the 95 % intervals of M, B and K hold the truth. Kinds are inputs without power in part of the band (with tapers, too),
//! sensors with steps, inputs that are held between samples, and limbs with a friction, a flexibility or a reflex that the model lacks. The latter two
//! are so strong that the median of reduced chi² is 2, 5 or 20 (friction scatters, which counts as noise, and leaves χ² alone). M and B of a model that
//! is wrong have no truth, K has: the force that holds a displacement.

use ndof::analysis::MethodName;
use ndof::signal::{forward_transform, inverse_transform};
use ndof::{Estimate, Fit, Trial};
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::error::Error;
use std::f64::consts::TAU;

/// kg, N s/m, N/m: 2 Hz, a damping ratio of a quarter.
const TRUTH: [f64; 3] = [2.0, 12.566, 315.83];
const OWN_HZ: f64 = 2.0;
const SAMPLES: usize = 6000;
/// The rate where inputs are filtered: what is empty of half of it matters to a limb of 2 Hz.
const FILTERED_HZ: f64 = 25.0;
/// Share of the motion's size that is noise.
const NOISE: f64 = 0.02;

type Failure = Box<dyn Error>;

fn normal(rng: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
    (0..count).map(|_| StandardNormal.sample(rng)).collect()
}

fn size(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
}

/// With noise of a share of its size, then in steps of a share of it.
fn sensed(x: &[f64], noise: f64, steps: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let (scale, step) = (size(x) * noise, size(x) * steps);
    let round = |x: f64| if step > 0.0 { (x / step).round() * step } else { x };
    x.iter().zip(normal(rng, x.len())).map(|(x, e)| round(x + scale * e)).collect()
}

/// A force of 5 N with power in a share of the frequencies from 0 Hz on, and the motion that is exact at each of them: the middle of a record twice as
/// long, of which neither end is in sight.
fn band_limited(driven: f64, rng: &mut ChaCha8Rng) -> Result<(Vec<f64>, Vec<f64>), Failure> {
    let [m, b, k] = TRUTH;
    let count = 2 * SAMPLES;
    let forward = forward_transform(count);
    let mut force = forward.make_output_vec();
    forward.process(&mut normal(rng, count), &mut force)?;
    let hz = |line: usize| line as f64 * FILTERED_HZ / count as f64;
    // Butterworth's fourth order behind the driven share.
    let filter = |hz: f64| 1.0 / (1.0 + (hz / (driven * FILTERED_HZ / 2.0)).powi(8)).sqrt();
    force.iter_mut().enumerate().for_each(|(line, f)| *f *= if line == 0 || line == SAMPLES { 0.0 } else { filter(hz(line)) });
    let compliance = |hz: f64| 1.0 / Complex64::new(k - m * (TAU * hz).powi(2), b * TAU * hz);
    let mut motion: Vec<Complex64> = force.iter().enumerate().map(|(line, f)| f * compliance(hz(line))).collect();
    let back = |spectrum: &mut Vec<Complex64>| -> Result<Vec<f64>, Failure> {
        let inverse = inverse_transform(count);
        let mut out = inverse.make_output_vec();
        (spectrum[0].im, spectrum[SAMPLES].im) = (0.0, 0.0);
        inverse.process(spectrum, &mut out)?;
        Ok(out[SAMPLES / 2..SAMPLES / 2 + SAMPLES].iter().map(|x| 5.0 * x / count as f64).collect())
    };
    Ok((back(&mut force)?, back(&mut motion)?))
}

/// What a limb has beside inertia, damping and stiffness.
#[derive(Clone, Copy)]
enum Lacking {
    Nothing,
    /// Dry friction, N, that reverses within `REVERSAL`.
    Friction(f64),
    /// A mass, kg, that a spring and a light damper carry.
    Flexibility(f64),
    /// A force, N s/m, against the velocity of `REFLEX_S` before.
    Reflex(f64),
}

/// m/s: some hundredth of what the limb moves at.
const REVERSAL: f64 = 1e-3;
const REFLEX_S: f64 = 0.04;
/// The carried mass swings at 3 Hz with a damping ratio of a tenth.
const CARRIED_HZ: f64 = 3.0;
const CARRIED_RATIO: f64 = 0.1;

/// The motion at the instants at which held forces begin, by midpoint steps of 1 ms at most.
fn held(forces: &[f64], step_s: f64, lacking: Lacking) -> Vec<f64> {
    let [m, b, k] = TRUTH;
    let steps = (step_s / 1e-3).ceil() as usize;
    let h = step_s / steps as f64;
    let delay = (REFLEX_S / h).round() as usize;
    // Limb and carried mass: x, v, y, w.
    let mut state = [0.0; 4];
    let mut velocities = Vec::with_capacity(forces.len() * steps);
    let mut out = Vec::with_capacity(forces.len());
    for force in forces {
        out.push(state[0]);
        for _ in 0..steps {
            velocities.push(state[1]);
            let before = velocities.len().checked_sub(delay + 1).map_or(0.0, |at| velocities[at]);
            let slope = |[x, v, y, w]: [f64; 4]| {
                let own = TAU * CARRIED_HZ;
                let carried = own * own * (x - y) + 2.0 * CARRIED_RATIO * own * (v - w);
                let extra = match lacking {
                    Lacking::Nothing => 0.0,
                    Lacking::Friction(level) => level * (v / REVERSAL).tanh(),
                    Lacking::Flexibility(mass) => mass * carried,
                    Lacking::Reflex(gain) => gain * before,
                };
                [v, (force - b * v - k * x - extra) / m, w, carried]
            };
            let ahead = |by: f64, slope: [f64; 4]| [0, 1, 2, 3].map(|i| state[i] + by * slope[i]);
            state = ahead(h, slope(ahead(h / 2.0, slope(state))));
        }
    }
    out
}

/// Which of M, B and K the default's intervals hold, half of each interval's width over the truth, and reduced χ².
struct Found {
    holds: [bool; 3],
    width: [f64; 3],
    chi2: f64,
}

fn found(rate_hz: f64, force: Vec<f64>, motion: Vec<f64>, method: MethodName) -> Result<Found, Failure> {
    let trial = Trial::new(rate_hz).effort("x", force).displacement("x", motion)?;
    let fit = Fit::default().run(&Estimate { method, ..Estimate::default() }.run([&trial])?)?.result;
    let ends: Vec<[f64; 2]> = fit.parameters.iter().filter_map(|p| p.ci95).collect();
    let of = |k: usize| ends.get(k).copied().unwrap_or([f64::NAN; 2]);
    Ok(Found {
        holds: [0, 1, 2].map(|k| (of(k)[0]..=of(k)[1]).contains(&TRUTH[k])),
        width: [0, 1, 2].map(|k| (of(k)[1] - of(k)[0]) / 2.0 / TRUTH[k]),
        chi2: fit.chi2_reduced.unwrap_or(f64::NAN),
    })
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}

/// One line of the table.
fn row(name: &str, records: u64, record: impl Fn(&mut ChaCha8Rng) -> Result<Found, Failure>) -> Result<(), Failure> {
    let all: Vec<Found> = (0..records).map(|seed| record(&mut ChaCha8Rng::seed_from_u64(seed))).collect::<Result<_, _>>()?;
    let share = [0, 1, 2].map(|k| 100.0 * all.iter().filter(|found| found.holds[k]).count() as f64 / records as f64);
    let width = [0, 1, 2].map(|k| 100.0 * median(all.iter().map(|found| found.width[k]).collect()));
    let chi2 = median(all.iter().map(|found| found.chi2).collect());
    println!("{name:42} {:5.1} {:5.1} {:5.1}   ±{:5.2} ±{:5.2} ±{:5.2}   {chi2:5.2}", share[0], share[1], share[2], width[0], width[1], width[2]);
    Ok(())
}

fn main() -> Result<(), Failure> {
    let records = std::env::args().nth(1).map_or(Ok(100), |text| text.parse())?;
    println!("{records} records a row; % of 95 % intervals that hold M, B, K; half widths in %; reduced chi²\n");
    for empty in [0.1, 0.3, 0.6] {
        for (method, called) in [(MethodName::Auto, ""), (MethodName::Multitaper, ", tapers")] {
            row(&format!("{:.0} % of the band empty{called}", 100.0 * empty), records, |rng| {
                let (force, motion) = band_limited(1.0 - empty, rng)?;
                let seen = sensed(&motion, NOISE, 0.0, rng);
                found(FILTERED_HZ, force, seen, method)
            })?;
        }
    }
    for steps in [0.05, 0.3] {
        row(&format!("a sensor with steps of {steps} of its motion"), records, |rng| {
            let (force, motion) = band_limited(0.7, rng)?;
            let seen = sensed(&motion, 0.0, steps, rng);
            found(FILTERED_HZ, force, seen, MethodName::Auto)
        })?;
    }
    for samples_a_period in [5.0, 20.0, 100.0] {
        row(&format!("held input, {samples_a_period} samples a period"), records, |rng| {
            let rate_hz = samples_a_period * OWN_HZ;
            let force: Vec<f64> = normal(rng, SAMPLES).iter().map(|f| 5.0 * f).collect();
            let motion = held(&force, 1.0 / rate_hz, Lacking::Nothing);
            let seen = sensed(&motion, NOISE, 0.0, rng);
            found(rate_hz, force, seen, MethodName::Auto)
        })?;
    }
    for level in [0.5, 1.0, 2.0] {
        row(&format!("dry friction of {level} N"), records, |rng| misfitted(Lacking::Friction(level), rng))?;
    }
    for chi2 in [2.0, 5.0, 20.0] {
        let mass = size_with(chi2, 0.3, Lacking::Flexibility)?;
        row(&format!("a flexibility of {mass:.3} kg"), records, |rng| misfitted(Lacking::Flexibility(mass), rng))?;
    }
    for chi2 in [2.0, 5.0, 20.0] {
        let gain = size_with(chi2, 10.0, Lacking::Reflex)?;
        row(&format!("a reflex of {gain:.2} N s/m"), records, |rng| misfitted(Lacking::Reflex(gain), rng))?;
    }
    Ok(())
}

/// A limb that a model of inertia, damping and stiffness lacks something of, seen at 50 samples a period.
fn misfitted(lacking: Lacking, rng: &mut ChaCha8Rng) -> Result<Found, Failure> {
    let rate_hz = 50.0 * OWN_HZ;
    let force: Vec<f64> = normal(rng, SAMPLES).iter().map(|f| 5.0 * f).collect();
    let seen = sensed(&held(&force, 1.0 / rate_hz, lacking), NOISE, 0.0, rng);
    found(rate_hz, force, seen, MethodName::Auto)
}

/// The size of what is lacking at which the median of reduced chi² is this, by halving, with seeds that no row uses.
fn size_with(chi2: f64, most: f64, lacking: fn(f64) -> Lacking) -> Result<f64, Failure> {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..8 {
        let size = (low + high) / 2.0;
        let all: Vec<f64> =
            (0..9).map(|seed| Ok(misfitted(lacking(size), &mut ChaCha8Rng::seed_from_u64(1 << 32 | seed))?.chi2)).collect::<Result<_, Failure>>()?;
        if median(all) < chi2 { low = size } else { high = size }
    }
    Ok((low + high) / 2.0)
}
