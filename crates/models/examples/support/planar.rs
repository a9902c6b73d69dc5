//! Three trials of 50 s of a planar limb at 500 Hz with thirteen parameters: M, B, K, offset and trend of the force.

use ndof_models::Axis;
use ndof_models::time::{FreeRun, FreeRunFit, Mechanism, TimeTrial, simulate};
use ndof_signal::FilteredNoise;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Sample rate.
pub const RATE_HZ: f64 = 500.0;
/// M, B, K by their upper triangles, offsets (N) and trends (N/s) of x and y.
pub const TRUTH: [f64; 13] = [2.1, -0.55, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0, 0.4, -0.3, 0.01, 0.02];
/// Where the fit begins.
pub const START: [f64; 13] = [1.0, 0.0, 1.0, 8.0, 0.0, 8.0, 200.0, 0.0, 200.0, 0.0, 0.0, 0.0, 0.0];
/// White noise of the position channels, a resolver's (m).
pub const NOISE_M: f64 = 5e-5;

/// The limb.
pub fn limb() -> Mechanism {
    Mechanism { offset: true, trend: true, ..Mechanism::new(vec![Axis::linear("x"), Axis::linear("y")]) }
}

/// Force x, y and position x, y of three trials.
pub fn trials() -> Vec<[Vec<f64>; 4]> {
    (0..3)
        .map(|seed| {
            let mut force = FilteredNoise { axes: 2, rms: 4.0, ..FilteredNoise::default() }.generate(seed).expect("valid").into_iter();
            let force = [force.next().expect("x"), force.next().expect("y")];
            let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
            let mut motion = simulate(&limb(), &TRUTH, &[0.0; 4], &[&force[0], &force[1]], RATE_HZ, 1);
            motion.iter_mut().flatten().for_each(|x| *x += NOISE_M * Distribution::<f64>::sample(&StandardNormal, &mut rng));
            let y = motion.pop().expect("y");
            let [fx, fy] = force;
            [fx, fy, motion.pop().expect("x"), y]
        })
        .collect()
}

/// The fit.
pub fn fit(trials: &[[Vec<f64>; 4]]) -> FreeRun {
    let trials: Vec<TimeTrial<'_>> =
        trials.iter().map(|t| TimeTrial { force: vec![&t[0], &t[1]], motion: vec![&t[2], &t[3]], ..TimeTrial::default() }).collect();
    FreeRunFit::new(RATE_HZ).fit(&limb(), &trials, &START).expect("a fit")
}
