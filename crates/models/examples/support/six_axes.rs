//! A limb of six axes, each moved by all forces, in three trials of 50 s: its estimated compliance, and the fit of its 63 parameters in frequency.

#[path = "driven.rs"]
mod driven;

use driven::driven;
use ndarray::Array2;
use ndof_models::{Axis, Fit, FitError, InertiaDampingStiffness, InertiaDampingStiffnessModel, Smoothing, Symmetry, WeightedFit, linear_start};
use ndof_signal::{CrossSpectra, FilteredNoise, Welch};
use ndof_sysid::{Direct, FrequencyResponse, Labels, Ports, ResponseKind};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const AXES: usize = 6;
const RATE_HZ: f64 = 200.0;
const SAMPLES: usize = 10_000;
const TRIALS: u64 = 3;
const NOISE_M: f64 = 2e-4;
const NAMES: [&str; AXES] = ["a", "b", "c", "d", "e", "f"];

/// The limb: diagonals that differ, an eighth of them beside.
pub fn limb() -> InertiaDampingStiffness {
    let matrix = |size: f64| {
        Array2::from_shape_fn((AXES, AXES), |(i, j)| size * if i == j { 1.0 + 0.1 * i as f64 } else { if (i + j) % 2 == 0 { 0.12 } else { -0.12 } })
    };
    InertiaDampingStiffness { axes: NAMES.iter().map(|n| Axis::linear(n)).collect(), inertia: matrix(2.0), damping: matrix(14.0), stiffness: matrix(300.0) }
}

/// Forces and noisy positions of one trial, the limb's compliance applied to the spectrum of the whole record.
fn record(limb: &InertiaDampingStiffness, seed: u64) -> Option<Vec<Vec<f64>>> {
    let noise = FilteredNoise { axes: AXES, rms: 4.0, samples: SAMPLES, sample_rate_hz: RATE_HZ, cutoff_hz: 15.0, ..FilteredNoise::default() };
    let force = noise.generate(seed).ok()?;
    let grid: Vec<f64> = (0..SAMPLES / 2 + 1).map(|f| f as f64 * RATE_HZ / SAMPLES as f64).collect();
    let compliance = limb.response(&grid, ResponseKind::Compliance);
    let motion = driven(&force, |f| compliance.value.index_axis(ndarray::Axis(0), f).iter().copied().collect())?;
    let mut rng = ChaCha8Rng::seed_from_u64(7000 + seed);
    let mut out = force;
    out.extend(motion.iter().map(|x| x.iter().map(|x| x + NOISE_M * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng)).collect()));
    Some(out)
}

/// The compliance of all trials, and of all but each.
pub fn responses() -> Option<(FrequencyResponse, Vec<FrequencyResponse>)> {
    let limb = limb();
    let each: Vec<CrossSpectra> = (0..TRIALS)
        .map(|trial| Welch::new(1024).spectra(RATE_HZ, &record(&limb, trial)?.iter().map(Vec::as_slice).collect::<Vec<_>>()).ok())
        .collect::<Option<_>>()?;
    let ports = Ports { references: vec![], inputs: (0..AXES).collect(), outputs: (AXES..2 * AXES).collect() };
    let names = |role: &str| NAMES.iter().map(|a| format!("{role}_{a}")).collect();
    let labels = Labels { references: vec![], inputs: names("force"), outputs: names("pos"), kind: ResponseKind::Compliance };
    let respond = |spectra: &[CrossSpectra]| Some(ndof_sysid::direct(&CrossSpectra::pool(spectra).ok()?, &ports, &labels, Direct::H1).ok()?.response);
    let without = (0..each.len()).map(|t| respond(&[&each[..t], &each[t + 1..]].concat())).collect::<Option<_>>()?;
    Some((respond(&each)?, without))
}

/// The fit from the linear start, intervals by leaving out each trial.
pub fn fit((response, without): &(FrequencyResponse, Vec<FrequencyResponse>)) -> Result<Fit, FitError> {
    let model = InertiaDampingStiffnessModel::new(limb().axes, Symmetry::Symmetric);
    let settings = WeightedFit { band_hz: [0.3, 8.0], smoothing: Smoothing::Open, ..WeightedFit::default() };
    let start = linear_start(&model, &response.band(0.3, 8.0))?;
    settings.fit_trials(&model, response, without, &start)
}
