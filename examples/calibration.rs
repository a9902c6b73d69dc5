//! Do 95 % intervals hold the truth in 95 % of all cases, and do tests at 5 % cry wolf in 5 %?
//!
//! `cargo run --release --example calibration [EXPERIMENTS]` (default 400) simulates that many experiments, from white forces through an
//! arm known in closed form to noisy recordings, treats each as the program does, and counts. It fails if a share is further from its
//! level than four standard deviations of the binomial distribution.
//!
//! Where a segment's ends leak more than there is noise, Welch's residual is leakage. It counts as noise, but that of neighbouring
//! frequencies cancels in a fit, so that intervals are wider than they need be and tests cry less often; those rows are held on one side.

use ndarray::{Array2, arr2};
use ndof::models::blocks::{Composite, find};
use ndof::models::physical::symmetry_test;
use ndof::models::time::{FreeRunFit, Mechanism, TimeTrial, simulate};
use ndof::models::{Axis, InertiaDampingStiffness, InertiaDampingStiffnessModel, Symmetry, WeightedFit, likelihood_ratio, linear_start};
use ndof::signal::{Welch, forward_transform, inverse_transform, mean_squares, normality, reverse_arrangements};
use ndof::sysid::{Direct, DirectEstimate, Labels, Ports, ResponseKind, direct};
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::error::Error;

const RATE_HZ: f64 = 200.0;
const SAMPLES: usize = 16_384;
const SEGMENT: usize = 1024;
const BAND_HZ: [f64; 2] = [0.5, 8.0];
/// Rms noise of the displacement over what the force's rms of 1 N moves the axis at rest: coherences of 0.8 at 1 Hz and 0.02 at 8 Hz …
const NOISE: f64 = 0.5;
/// … and of 0.998 and 0.6, where at low frequency the ends of the segments weigh more than the noise.
const LITTLE_NOISE: f64 = 0.05;

type Failure = Box<dyn Error + Send + Sync>;

/// What was counted under one name: in how many of how many cases.
struct Row {
    name: String,
    expected: f64,
    counted: usize,
    cases: usize,
}

fn limb(axes: usize) -> InertiaDampingStiffness {
    let one = |v: f64| Array2::from_elem((1, 1), v);
    match axes {
        1 => InertiaDampingStiffness { axes: vec![Axis::linear("x")], inertia: one(2.0), damping: one(25.0), stiffness: one(300.0) },
        _ => InertiaDampingStiffness {
            axes: vec![Axis::linear("x"), Axis::linear("y")],
            inertia: arr2(&[[2.1, -0.55], [-0.55, 1.9]]),
            damping: arr2(&[[26.0, -4.0], [-4.0, 30.0]]),
            stiffness: arr2(&[[300.0, -60.0], [-60.0, 420.0]]),
        },
    }
}

fn normal(rng: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
    (0..count).map(|_| StandardNormal.sample(rng)).collect()
}

/// Forces and noisy displacements of one experiment. The response is that of the continuous limb at every frequency, exactly: force and
/// motion are periodic over the whole recording, of which segments see nothing.
fn experiment(limb: &InertiaDampingStiffness, noise: f64, rng: &mut ChaCha8Rng) -> [Vec<Vec<f64>>; 2] {
    let axes = limb.axes.len();
    let (forward, inverse) = (forward_transform(SAMPLES), inverse_transform(SAMPLES));
    let forces: Vec<Vec<f64>> = (0..axes).map(|_| normal(rng, SAMPLES)).collect();
    let spectra: Vec<Vec<Complex64>> = forces
        .iter()
        .map(|force| {
            let (mut samples, mut spectrum) = (force.clone(), forward.make_output_vec());
            let _ = forward.process(&mut samples, &mut spectrum);
            spectrum
        })
        .collect();
    let grid: Vec<f64> = (0..=SAMPLES / 2).map(|f| f as f64 * RATE_HZ / SAMPLES as f64).collect();
    let response = limb.response(&grid, ResponseKind::Compliance);
    let motions = (0..axes)
        .map(|i| {
            let mut sum: Vec<Complex64> = (0..grid.len()).map(|f| (0..axes).map(|j| response.value[[f, i, j]] * spectra[j][f]).sum()).collect();
            // What is real in a transform of real samples.
            (sum[0].im, sum[SAMPLES / 2].im) = (0.0, 0.0);
            let mut motion = inverse.make_output_vec();
            let _ = inverse.process(&mut sum, &mut motion);
            let rms = noise / limb.stiffness[[i, i]];
            motion.iter().zip(normal(rng, SAMPLES)).map(|(x, e)| x / SAMPLES as f64 + rms * e).collect()
        })
        .collect();
    [forces, motions]
}

fn estimate(forces: &[Vec<f64>], motions: &[Vec<f64>]) -> Result<DirectEstimate, Failure> {
    let axes = forces.len();
    let channels: Vec<&[f64]> = forces.iter().chain(motions).map(|c| &c[..]).collect();
    let spectra = Welch::new(SEGMENT).spectra(RATE_HZ, &channels)?;
    let ports = Ports { references: vec![], inputs: (0..axes).collect(), outputs: (axes..2 * axes).collect() };
    Ok(direct(&spectra, &ports, &Labels::numbered(&ports, ResponseKind::Compliance), Direct::H1)?)
}

/// Names with whether each of its 95 % intervals holds the truth, or whether each of its tests at 5 % cries.
type Counts = Vec<(String, f64, bool)>;

/// What the rows are called that are held on one side.
const LEAKAGE: &str = "; leakage above noise";

fn fits(limb: &InertiaDampingStiffness, estimate: &DirectEstimate, which: &str, count: &mut dyn FnMut(&str, f64, bool)) -> Result<(), Failure> {
    let settings = WeightedFit { band_hz: BAND_HZ, ..WeightedFit::default() };
    let fit = |symmetry| -> Result<_, Failure> {
        let model = InertiaDampingStiffnessModel::new(limb.axes.clone(), symmetry);
        let start = linear_start(&model, &estimate.response.band(BAND_HZ[0], BAND_HZ[1]))?;
        let fit = settings.fit(&model, &estimate.response, &start)?;
        Ok((model, fit))
    };
    for (k, parameter) in fit(Symmetry::Symmetric)?.1.parameters.iter().enumerate() {
        let truth = [&limb.inertia, &limb.damping, &limb.stiffness][k / 3][[[0, 0], [0, 1], [1, 1]][k % 3]];
        let [low, high] = parameter.ci95;
        count(&format!("{}, fitted{which}", parameter.name), 0.95, (low..=high).contains(&truth));
    }
    let (model, free) = fit(Symmetry::Free)?;
    for test in symmetry_test(&model, &free) {
        count(&format!("{} called not symmetric{which}", test.matrix), 0.05, test.p_value < 0.05);
    }
    Ok(())
}

fn two_axes(seed: u64) -> Result<Counts, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let limb = limb(2);
    let [forces, motions] = experiment(&limb, NOISE, &mut rng);
    let estimate = estimate(&forces, &motions)?;
    let mut counts = Counts::new();
    let mut count = |name: &str, level: f64, yes: bool| counts.push((name.to_owned(), level, yes));

    // One frequency an experiment, so that what is counted is independent.
    let inside: Vec<usize> = (0..estimate.response.len()).filter(|&f| (BAND_HZ[0]..=BAND_HZ[1]).contains(&estimate.response.frequency_hz[f])).collect();
    let f = inside[seed as usize % inside.len()];
    let truth = limb.response(&[estimate.response.frequency_hz[f]], ResponseKind::Compliance);
    for (i, j) in [(0, 0), (1, 0)] {
        let (found, truth) = (&estimate.response.gain_phase(i, j, 0.95)[f], truth.value[[0, i, j]]);
        let name = if i == j { "own" } else { "cross" };
        count(&format!("gain of a response, {name}"), 0.95, (found.gain_interval[0]..=found.gain_interval[1]).contains(&truth.norm()));
        let turned = (truth / estimate.response.value[[f, i, j]]).arg() + found.phase_rad;
        count(&format!("phase of a response, {name}"), 0.95, found.phase_interval_rad.is_none_or(|[low, high]| (low..=high).contains(&turned)));
    }

    fits(&limb, &estimate, "", &mut count)?;
    let [little_forces, little_motions] = experiment(&limb, LITTLE_NOISE, &mut rng);
    fits(&limb, &self::estimate(&little_forces, &little_motions)?, LEAKAGE, &mut count)?;

    // Outputs that know nothing of the inputs.
    let alone = self::estimate(&forces, &[normal(&mut rng, SAMPLES), normal(&mut rng, SAMPLES)])?;
    count("ordinary coherence of nothing", 0.05, alone.coherence.ordinary[[f, 0, 0]] > alone.significance_95.ordinary);
    count("partial coherence of nothing", 0.05, alone.coherence.partial[[f, 0, 0]] > alone.significance_95.partial);
    count("multiple coherence of nothing", 0.05, alone.coherence.multiple[[f, 0]] > alone.significance_95.multiple);
    count("trend in a stationary force", 0.05, reverse_arrangements(&mean_squares(&forces[0], 20)?)?.p_value < 0.05);
    count("force called not Gaussian", 0.05, normality(&forces[0])?.p_value < 0.05);
    count("displacement called not Gaussian", 0.05, normality(&motions[0])?.p_value < 0.05);
    Ok(counts)
}

fn one_axis(seed: u64) -> Result<Counts, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(1);
    let limb = limb(1);
    let [forces, motions] = experiment(&limb, NOISE, &mut rng);
    let estimate = estimate(&forces, &motions)?;
    let mut counts = Counts::new();

    let settings = WeightedFit { band_hz: BAND_HZ, ..WeightedFit::default() };
    let model = InertiaDampingStiffnessModel::new(limb.axes.clone(), Symmetry::Symmetric);
    let start = linear_start(&model, &estimate.response.band(BAND_HZ[0], BAND_HZ[1]))?;
    let plain = settings.fit(&model, &estimate.response, &start)?;
    let late = Composite::of_cards(&model, &[find("delay").ok_or("a delay")?]);
    let ratio = likelihood_ratio(&plain, &settings.fit_from(&late, &estimate.response, &late.starts(&start))?);
    counts.push(("a delay that is not there".to_owned(), 0.05, ratio.p_value < 0.05));

    // Twenty seconds in free run, with the force between samples as a fit in time takes it.
    let mechanism = Mechanism::new(limb.axes.clone());
    let truth = [limb.inertia[[0, 0]], limb.damping[[0, 0]], limb.stiffness[[0, 0]]];
    let force = &forces[0][..4000];
    let noise = normal(&mut rng, force.len()).into_iter().map(|e| NOISE / truth[2] * e);
    let motion: Vec<f64> = simulate(&mechanism, &truth, &[0.0, 0.0], &[force], RATE_HZ, 1)[0].iter().zip(noise).map(|(x, e)| x + e).collect();
    let trial = TimeTrial { force: vec![force], motion: vec![&motion], velocity: vec![] };
    let run = FreeRunFit::new(RATE_HZ).fit(&mechanism, &[trial], &truth.map(|v| 0.8 * v))?;
    for (parameter, truth) in run.parameters.iter().zip(truth) {
        let [low, high] = parameter.ci95;
        counts.push((format!("{}, free run", parameter.name), 0.95, (low..=high).contains(&truth)));
    }
    Ok(counts)
}

fn rows(experiments: u64, one: fn(u64) -> Result<Counts, Failure>) -> Result<Vec<Row>, Failure> {
    let all: Vec<Counts> = (0..experiments).into_par_iter().map(one).collect::<Result<_, _>>()?;
    let mut rows: Vec<Row> = Vec::new();
    for (name, expected, yes) in all.into_iter().flatten() {
        let at = rows.iter().position(|row| row.name == name).unwrap_or_else(|| {
            rows.push(Row { name, expected, counted: 0, cases: 0 });
            rows.len() - 1
        });
        rows[at].cases += 1;
        rows[at].counted += usize::from(yes);
    }
    Ok(rows)
}

fn main() -> Result<(), Failure> {
    let experiments: u64 = std::env::args().nth(1).map_or(Ok(400), |count| count.parse())?;
    let mut table = rows(experiments, two_axes)?;
    table.extend(rows(experiments, one_axis)?);
    table.sort_by(|a, b| b.expected.total_cmp(&a.expected));
    println!("{experiments} experiments with two axes and as many with one, {:.0} s each", SAMPLES as f64 / RATE_HZ);
    println!("{:<40} {:>6} {:>8}   four standard deviations", "in how many of them", "asked", "found");
    let mut wrong = 0;
    for row in &table {
        let (share, cases) = (row.counted as f64 / row.cases as f64, row.cases as f64);
        let width = 4.0 * (row.expected * (1.0 - row.expected) / cases).sqrt();
        let [mut low, mut high] = [row.expected - width, row.expected + width];
        if row.name.ends_with(LEAKAGE) {
            [low, high] = if row.expected > 0.5 { [low, 1.0] } else { [0.0, high] };
        }
        let inside = (low..=high).contains(&share);
        wrong += usize::from(!inside);
        let [asked, share, low, high] = [row.expected, share, low.max(0.0), high.min(1.0)].map(|x| 100.0 * x);
        println!("{:<40} {asked:>4.0} % {share:>6.1} %   {low:.1} to {high:.1} %{}", row.name, if inside { "" } else { "  OUTSIDE" });
    }
    if wrong > 0 { Err(format!("{wrong} of {} shares lie outside", table.len()).into()) } else { Ok(()) }
}
