//! Short windows of a limb that is held: instruments against least squares.

use crate::draws::seeded;
use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::{Direct, DirectEstimate, Labels, LocalPolynomial, Ports, ResponseKind, SpectralMethod, estimate, instrumented};
use rand::RngExt;
use rand_distr::StandardNormal;

/// Two axes, f = Z x + v with Z = [8, 2; 1, 5], and x = T r − 0.05 v: the limb's own force v moves what holds it. Thirty windows of 40 samples; by
/// instruments r, and by least squares.
fn estimates(seed: u64) -> [DirectEstimate; 2] {
    let mut rng = seeded(seed);
    let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, false), samples);
    let windows: Vec<Recording> = (0..30)
        .map(|_| {
            let mut draw = || -> Vec<f64> { (0..40).map(|_| rng.sample(StandardNormal)).collect() };
            let [rx, ry, vx, vy] = [draw(), draw(), draw(), draw()];
            let x: Vec<f64> = (0..40).map(|k| rx[k] + 0.3 * ry[k] - 0.05 * vx[k]).collect();
            let y: Vec<f64> = (0..40).map(|k| ry[k] - 0.2 * rx[k] - 0.05 * vy[k]).collect();
            let fx = (0..40).map(|k| 8.0 * x[k] + 2.0 * y[k] + 4.0 * vx[k]).collect();
            let fy = (0..40).map(|k| x[k] + 5.0 * y[k] + 4.0 * vy[k]).collect();
            let channels = [("rx", rx), ("ry", ry), ("x", x), ("y", y)].map(|(name, samples)| channel(name, Quantity::Displacement, samples));
            let efforts = [("fx", fx), ("fy", fy)].map(|(name, samples)| channel(name, Quantity::Effort, samples));
            Recording::new(40.0, channels.into_iter().chain(efforts).collect()).expect("channels of one length")
        })
        .collect();
    let trials: Vec<&Recording> = windows.iter().collect();
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let labels = Labels::numbered(&ports, ResponseKind::DynamicStiffness);
    let local = LocalPolynomial { order: 3, ..LocalPolynomial::default() };
    let by_least_squares = estimate(&trials, &ports, &labels, &SpectralMethod::LocalPolynomial(local), Direct::H1).expect("an estimate").direct;
    [instrumented(&trials, &ports, &labels, local).expect("an estimate"), by_least_squares]
}

/// Intervals of the instruments hold each entry at their rate; least squares is biased by −0.05 · 4/(1 + 0.05²) of it and holds less.
#[test]
fn instruments_hold_the_truth_where_least_squares_does_not() {
    let (seeds, line) = (300, 9);
    let truth = [[8.0, 2.0], [1.0, 5.0]];
    let mut held = [[[0_u32; 2]; 2]; 2];
    let mut means = [0.0; 2];
    for seed in 0..seeds {
        for (which, found) in estimates(seed).iter().enumerate() {
            means[which] += found.response.value[[line, 0, 0]].re / seeds as f64;
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let interval = found.response.gain_phase(i, j, 0.95)[line].gain_interval;
                held[which][i][j] += u32::from((interval[0]..=interval[1]).contains(&truth[i][j]));
            }
        }
    }
    println!("held {held:?} of {seeds}; means {means:?}");
    // Binomial: 4 standard deviations about 95 %; the gain's interval of one entry is as narrow as that of a real number.
    let spread = 4.0 * (0.95_f64 * 0.05 / seeds as f64).sqrt();
    assert!(held[0].iter().flatten().all(|count| (f64::from(*count) / seeds as f64 - 0.95).abs() < spread), "{held:?}");
    assert!((means[0] - 8.0).abs() < 0.02 && means[1] < 7.9, "{means:?}");
}
