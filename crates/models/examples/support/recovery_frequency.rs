//! Linear models from responses that were estimated from six records each: the motion is the force through the model's equation, written
//! here once more, applied to the spectrum of the whole record.

#[path = "driven.rs"]
mod driven;

use super::recovery::Answer;
use driven::driven;
use ndof_models::blocks::{
    Block, Composite, Delay, FirstOrderFilter, FlexibleMode, Fractional, Place, Placed, Reflex, SecondOrderFilter, SeriesCompliance, StandardLinearSolid,
};
use ndof_models::{Axis, InertiaDampingStiffnessModel, ParametricModel, Smoothing, Symmetry, WeightedFit};
use ndof_signal::{CrossSpectra, FilteredNoise, Passband, SosFilter, Welch};
use ndof_sysid::{Direct, FrequencyResponse, Labels, Ports, ResponseKind};
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 100.0;
/// 41 s, and as many trials as the intervals' width is taken from.
const SAMPLES: usize = 1 << 12;
const TRIALS: u64 = 6;
const SEGMENT: usize = 1024;
const NOISE_M: f64 = 2e-4;
/// What is fitted.
pub const BAND_HZ: [f64; 2] = [0.3, 12.0];

/// Compliance at s, 2 × 2 by rows or 1 × 1, of the parameters.
type Oracle = fn(&[f64], Complex64) -> Vec<Complex64>;

/// What extends the limb, and where.
type Extension = fn() -> (Box<dyn Block>, Place);

/// A model to recover.
pub struct Case {
    /// What the table calls it.
    pub name: String,
    truth: Vec<f64>,
    axes: usize,
    symmetry: Symmetry,
    block: Option<Extension>,
    oracle: Oracle,
}

impl Case {
    fn model(&self) -> Composite {
        let axes = ["x", "y"].iter().take(self.axes).map(|a| Axis::linear(a)).collect();
        let placed = self.block.iter().map(|b| b()).map(|(block, place)| Placed { block, place }).collect();
        Composite::new(Box::new(InertiaDampingStiffnessModel::new(axes, self.symmetry)), placed)
    }

    /// Names of the parameters.
    pub fn names(&self) -> Vec<String> {
        self.model().parameters().into_iter().map(|p| p.name).collect()
    }
}

fn limb(p: &[f64], s: Complex64) -> Complex64 {
    p[0] * s * s + p[1] * s + p[2]
}

fn one(name: &str, own: &[f64], block: Extension, oracle: Oracle) -> Case {
    let truth = [2.0, 14.0, 300.0].iter().chain(own).copied().collect();
    Case { name: format!("{name}, in frequency"), truth, axes: 1, symmetry: Symmetry::Symmetric, block: Some(block), oracle }
}

fn inverse(d: [Complex64; 4]) -> Vec<Complex64> {
    let determinant = d[0] * d[3] - d[1] * d[2];
    [d[3], -d[1], -d[2], d[0]].iter().map(|v| v / determinant).collect()
}

/// All cases.
pub fn cases() -> Vec<Case> {
    let planar = |name: &str, symmetry: Symmetry, truth: &[f64], oracle: Oracle| Case {
        name: format!("inertia-damping-stiffness, 2 × 2 {name}"),
        truth: truth.to_vec(),
        axes: 2,
        symmetry,
        block: None,
        oracle,
    };
    let triangle: Oracle = |p, s| {
        let entry = |k: usize| p[k] * s * s + p[3 + k] * s + p[6 + k];
        inverse([entry(0), entry(1), entry(1), entry(2)])
    };
    let symmetric = [2.1, -0.55, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0];
    vec![
        planar("symmetric", Symmetry::Symmetric, &symmetric, triangle),
        planar("positive semi-definite", Symmetry::PositiveSemidefinite, &symmetric, triangle),
        planar("free", Symmetry::Free, &[2.1, -0.55, -0.5, 1.9, 11.0, -2.0, -3.0, 15.0, 300.0, -60.0, -20.0, 520.0], |p, s| {
            inverse([0, 1, 2, 3].map(|k| p[k] * s * s + p[4 + k] * s + p[8 + k]))
        }),
        one("delay", &[0.0063], || (Box::new(Delay), Place::EffortChannel(vec![0])), |p, s| vec![(s * p[3]).exp() / limb(p, s)]),
        one("first-order filter", &[25.0], || (Box::new(FirstOrderFilter), Place::EffortChannel(vec![0])), |p, s| vec![(1.0 + s / (TAU * p[3])) / limb(p, s)]),
        one(
            "second-order filter",
            &[25.0],
            || (Box::new(SecondOrderFilter), Place::EffortChannel(vec![0])),
            |p, s| {
                let r = s / (TAU * p[3]);
                vec![(1.0 + 2f64.sqrt() * r + r * r) / limb(p, s)]
            },
        ),
        one(
            "series compliance",
            &[6000.0, 20.0],
            || (Box::new(SeriesCompliance), Place::Series(vec![0])),
            |p, s| vec![1.0 / limb(p, s) + 1.0 / (p[3] + p[4] * s)],
        ),
        one(
            "flexible mode",
            &[0.5, 6.0, 0.08],
            || (Box::new(FlexibleMode), Place::Parallel(vec![0])),
            |p, s| {
                let (m, w) = (p[3], TAU * p[4]);
                let (c, k) = (2.0 * p[5] * w * m, w * w * m);
                // The carried mass moves by (c s + k)/(m s² + c s + k) of the axis.
                vec![1.0 / (limb(p, s) + m * s * s * (c * s + k) / (m * s * s + c * s + k))]
            },
        ),
        one(
            "standard linear solid",
            &[150.0, 0.08],
            || (Box::new(StandardLinearSolid), Place::Parallel(vec![0])),
            |p, s| vec![1.0 / (limb(p, s) + p[3] - p[3] / (1.0 + p[4] * s))],
        ),
        one(
            "fractional",
            &[40.0, 0.4],
            || (Box::new(Fractional), Place::Parallel(vec![0])),
            |p, s| vec![1.0 / (limb(p, s) + p[3] * Complex64::from_polar(s.norm().powf(p[4]), p[4] * s.im.signum() * TAU / 4.0))],
        ),
        one(
            "linear reflex",
            &[120.0, 8.0, 0.05, 4.0],
            || (Box::new(Reflex), Place::Parallel(vec![0])),
            |p, s| {
                let lag = 1.0 + s / (TAU * p[6]);
                vec![1.0 / (limb(p, s) + (p[3] + p[4] * s) * (-p[5] * s).exp() / (lag * lag))]
            },
        ),
    ]
}

/// Force and noisy motion of one record, force channels first.
fn record(case: &Case, seed: u64) -> Option<Vec<Vec<f64>>> {
    let n = case.axes;
    let noise = FilteredNoise { axes: n, rms: 4.0, samples: SAMPLES, sample_rate_hz: RATE_HZ, cutoff_hz: 15.0, ..FilteredNoise::default() };
    let force = noise.generate(seed).ok()?;
    let s = |f: usize| Complex64::new(0.0, TAU * f as f64 * RATE_HZ / SAMPLES as f64);
    let motion = driven(&force, |f| (case.oracle)(&case.truth, s(f)))?;
    let mut rng = ChaCha8Rng::seed_from_u64(4000 + seed);
    let low = SosFilter::butterworth(2, Passband::Low(2.0), RATE_HZ).ok()?;
    let mut out = force;
    for motion in motion {
        let mut white = |samples: usize| -> Vec<f64> { (0..samples).map(|_| StandardNormal.sample(&mut rng)).collect() };
        let slow = low.filter(&white(SAMPLES + 200));
        let fast = white(SAMPLES);
        out.push((0..SAMPLES).map(|k| motion[k] + NOISE_M * fast[k] + 5.0 * NOISE_M * slow[k + 200]).collect());
    }
    Some(out)
}

/// Compliance from six records together, and from all but each.
pub fn responses(case: &Case, seed: u64) -> Result<(FrequencyResponse, Vec<FrequencyResponse>), Box<dyn std::error::Error>> {
    let n = case.axes;
    let each: Vec<CrossSpectra> = (0..TRIALS)
        .map(|trial| -> Result<CrossSpectra, Box<dyn std::error::Error>> {
            let channels = record(case, TRIALS * seed + trial).ok_or("no record")?;
            Ok(Welch::new(SEGMENT).spectra(RATE_HZ, &channels.iter().map(Vec::as_slice).collect::<Vec<_>>())?)
        })
        .collect::<Result<_, _>>()?;
    let ports = Ports { references: vec![], inputs: (0..n).collect(), outputs: (n..2 * n).collect() };
    let names = |role: &str| ["x", "y"].iter().take(n).map(|a| format!("{role}_{a}")).collect();
    let labels = Labels { references: vec![], inputs: names("force"), outputs: names("pos"), kind: ResponseKind::Compliance };
    let respond = |spectra: &[CrossSpectra]| -> Result<FrequencyResponse, Box<dyn std::error::Error>> {
        Ok(ndof_sysid::direct(&CrossSpectra::pool(spectra)?, &ports, &labels, Direct::H1)?.response)
    };
    let without = (0..each.len()).map(|t| respond(&[&each[..t], &each[t + 1..]].concat())).collect::<Result<Vec<_>, _>>()?;
    Ok((respond(&each)?, without))
}

/// Fits that estimate, intervals by the jackknife over trials, as `ndof fit` does.
pub fn fit(case: &Case, seed: u64) -> Result<Answer, Box<dyn std::error::Error>> {
    let (pooled, without) = responses(case, seed)?;
    let settings = WeightedFit { band_hz: BAND_HZ, smoothing: Smoothing::Open, ..WeightedFit::default() };
    let start: Vec<f64> = case.truth.iter().enumerate().map(|(k, t)| t * if k % 2 == 0 { 1.2 } else { 0.85 }).collect();
    let found = settings.fit_trials(&case.model(), &pooled, &without, &start)?;
    Ok(Answer {
        covered: found.parameters.iter().zip(&case.truth).map(|(p, t)| (p.ci95[0]..=p.ci95[1]).contains(t)).collect(),
        error: found.theta.iter().zip(&case.truth).map(|(a, b)| (a - b) / b.abs()).collect(),
        identifiable: found.parameters.iter().map(|p| p.identifiable).collect(),
        profiled: vec![false; case.truth.len()],
    })
}
