//! Periodic excitation: springs that are not linear, told from each other and from noise, by levels that are known.

use crate::draws::seeded;
use crate::time_domain::{Resonance, noise, one_input, recording, run};
use ndarray::Array3;
use ndof_signal::{Periodic, Recording};
use ndof_sysid::{Detection, Ports, SpectralMethod, unresolved};
use num_complex::Complex64;
use rand::RngExt;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 100.0;
const PERIOD: usize = 1000;
const PERIODS: usize = 4;
const TRIALS: u64 = 8;

/// One period of a random-phase multisine at `lines`, unit amplitude each.
pub fn multisine(period: usize, lines: &[usize], seed: u64) -> Vec<f64> {
    let mut rng = seeded(seed);
    let phases: Vec<f64> = lines.iter().map(|_| rng.random_range(0.0..TAU)).collect();
    let value = |k: usize| lines.iter().zip(&phases).map(|(&l, p)| (TAU * (l * k % period) as f64 / period as f64 + p).cos()).sum();
    (0..period).map(value).collect()
}

/// Odd lines, every fourth of them left out.
fn odd_lines() -> Vec<usize> {
    (1..101).step_by(2).filter(|l| l % 8 != 5).collect()
}

/// Amplitude of a line over the last period.
fn amplitude(signal: &[f64], line: usize) -> f64 {
    let last = &signal[signal.len() - PERIOD..];
    let sum: Complex64 = last.iter().enumerate().map(|(k, x)| x * Complex64::from_polar(1.0, -TAU * (line * k % PERIOD) as f64 / PERIOD as f64)).sum();
    sum.norm() * 2.0 / PERIOD as f64
}

fn rms(values: &Array3<f64>) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// The scatter of two degrees of freedom has a law without a variance: with two trials more than inputs the intervals hold the noise of periods, as with fewer.
#[test]
fn two_trials_more_than_inputs_are_too_few_to_weigh_by_their_scatter() {
    let (lines, system) = (odd_lines(), Resonance::new(3.0, 0.5, RATE_HZ));
    for (trials, freedom) in [(1, 3.0), (2, 6.0), (3, 9.0), (4, 3.0)] {
        let records: Vec<Recording> = (0..trials)
            .map(|t| {
                let one = multisine(PERIOD, &lines, 80 + t);
                let force: Vec<f64> = (0..PERIOD * (PERIODS + 1)).map(|k| one[k % PERIOD]).collect();
                let (mut y1, mut y2) = (0.0, 0.0);
                let mut next = |f: &f64| {
                    let y = system.next(y1, y2, *f);
                    (y2, y1) = (y1, y);
                    y
                };
                let motion: Vec<f64> = force.iter().map(&mut next).zip(noise(t + 5, PERIOD * (PERIODS + 1))).map(|(y, e)| y + 0.1 * e).collect();
                recording(RATE_HZ, vec![("force", force), ("pos", motion)])
            })
            .collect();
        let found = run(&records, &one_input(), SpectralMethod::Periodic(Periodic { period: PERIOD, discard: 1 }));
        assert_eq!(found.direct.response.uncertainty.expect("a covariance").degrees_of_freedom, freedom, "{trials}");
        assert_eq!(found.warnings.iter().any(|w| w.code == "one-realisation"), trials < 4, "{trials}");
    }
}

#[test]
fn a_multisine_separates_a_cubic_from_an_asymmetric_spring_and_both_from_noise_at_their_known_levels() {
    let (lines, system) = (odd_lines(), Resonance::new(3.0, 0.5, RATE_HZ));
    let silent = |even: bool| (lines[0]..*lines.last().expect("lines")).filter(|l| (l % 2 == 0) == even && !lines.contains(l)).collect::<Vec<usize>>();
    for (cubic, square, sigma) in [(0.0, 0.0, 0.3), (1e-3, 0.0, 0.02), (0.0, 1e-2, 0.02)] {
        let spring = |x: f64| -cubic * x.powi(3) - square * x * x;
        let mut known = [0.0, 0.0];
        let records: Vec<Recording> = (0..TRIALS)
            .map(|t| {
                let one = multisine(PERIOD, &lines, 50 + t);
                let force: Vec<f64> = (0..PERIOD * (PERIODS + 1)).map(|k| one[k % PERIOD]).collect();
                let (mut y1, mut y2) = (0.0, 0.0);
                let motion: Vec<f64> = force
                    .iter()
                    .map(|f| {
                        let y = system.next(y1, y2, f + spring(y1));
                        (y2, y1) = (y1, y);
                        y
                    })
                    .collect();
                // To first order the spring's extra force along the linear motion moves the limb like any other force.
                let linear = system.respond(&force);
                let extra: Vec<f64> = std::iter::once(0.0).chain(linear.iter().map(|x| spring(*x))).take(force.len()).collect();
                let moved = system.respond(&extra);
                for (power, even) in known.iter_mut().zip([true, false]) {
                    let at = silent(even);
                    *power += at.iter().map(|&l| amplitude(&moved, l).powi(2)).sum::<f64>() / at.len() as f64 / TRIALS as f64;
                }
                let measured = motion.iter().zip(noise(70 + t, motion.len())).map(|(x, e)| x + sigma * e).collect();
                recording(RATE_HZ, vec![("force", force), ("pos", measured)])
            })
            .collect();
        let found = run(&records, &one_input(), SpectralMethod::Periodic(Periodic { period: PERIOD, discard: 1 }));
        let response = &found.direct.response;
        assert_eq!(response.len(), lines.len());
        assert!(unresolved(response, 0.0, 0.0, f64::INFINITY).is_empty(), "periods have no window, and their lines need not be even");
        let distortion = found.distortion.expect("periodic");
        let (noise_std, nonlinear, even, odd) =
            (rms(&distortion.noise_std), rms(&distortion.nonlinear_std), rms(&distortion.even_std), rms(&distortion.odd_std));
        let [known_even, known_odd] = known.map(f64::sqrt);
        println!(
            "cubic {cubic}, square {square}: noise {noise_std:.2e}, nonlinear {nonlinear:.2e}, even {even:.2e} (known {known_even:.2e}), odd {odd:.2e} ({known_odd:.2e})"
        );
        // White noise σ on a line of unit amplitude: 4σ²/N over periods and trials.
        let known_noise = (4.0 * sigma * sigma / (PERIOD * PERIODS) as f64 / TRIALS as f64).sqrt();
        assert!((noise_std / known_noise - 1.0).abs() < 0.2, "noise {noise_std}, known {known_noise}");
        let detection = |is_even: bool| distortion.detection.iter().find(|d| d.even == is_even).expect("lines were left out");
        if cubic > 0.0 {
            assert!((odd / known_odd - 1.0).abs() < 0.2, "odd {odd}, known {known_odd}");
            assert!(odd > 10.0 * even && (odd / nonlinear - 1.0).abs() < 0.2, "odd {odd}, even {even}, nonlinear {nonlinear}");
            assert!(detection(false).probability < 1e-6 && detection(true).probability > 1e-3);
        } else if square > 0.0 {
            assert!((even / known_even - 1.0).abs() < 0.2, "even {even}, known {known_even}");
            // x² seen twice is odd again, far below.
            assert!(even > 5.0 * odd && nonlinear < 0.2 * even, "odd {odd}, even {even}, nonlinear {nonlinear}");
            assert!(detection(true).probability < 1e-6);
        } else {
            assert!(detection(true).probability > 1e-3 && detection(false).probability > 1e-3);
            let covered = (0..response.len())
                .filter(|&f| {
                    let entry = response.gain_phase(0, 0, 0.95)[f];
                    (entry.gain_interval[0]..=entry.gain_interval[1]).contains(&system.at(response.frequency_hz[f]).norm())
                })
                .count() as f64
                / response.len() as f64;
            assert!((covered - 0.95).abs() < 4.0 * (0.05 * 0.95 / response.len() as f64).sqrt(), "{covered}");
        }
    }
}

/// A limb held by a robot, each with a cubic spring of its own.
fn held(limb_cubic: f64, robot_cubic: f64) -> Vec<Detection> {
    let (lines, limb) = (odd_lines(), Resonance::new(3.0, 0.5, RATE_HZ));
    let records: Vec<Recording> = (0..4)
        .map(|t| {
            let one = multisine(PERIOD, &lines, 150 + t);
            let command: Vec<f64> = (0..PERIOD * (PERIODS + 1)).map(|k| one[k % PERIOD]).collect();
            let (mut y1, mut y2) = (0.0, 0.0);
            let (mut force, mut motion) = (Vec::new(), Vec::new());
            for c in &command {
                let u = c - 0.6 * y1 - 0.8 * (y1 - y2) - robot_cubic * y1.powi(3);
                let y = limb.next(y1, y2, u - limb_cubic * y1.powi(3));
                (y2, y1) = (y1, y);
                force.push(u);
                motion.push(y);
            }
            let noisy = |x: Vec<f64>, seed: u64| x.iter().zip(noise(seed, x.len())).map(|(x, e)| x + 1e-3 * e).collect();
            recording(RATE_HZ, vec![("cmd", command), ("force", noisy(force, 170 + 2 * t)), ("pos", noisy(motion, 171 + 2 * t))])
        })
        .collect();
    let ports = Ports { references: vec![0], inputs: vec![1], outputs: vec![2] };
    run(&records, &ports, SpectralMethod::Periodic(Periodic { period: PERIOD, discard: 1 })).distortion.expect("periodic").detection
}

#[test]
fn lines_that_were_not_driven_tell_a_distortion_of_the_robot_from_one_of_the_limb() {
    for (limb, robot) in [(1e-3, 0.0), (0.0, 1e-3)] {
        let found = held(limb, robot);
        let odd = found.iter().find(|d| !d.even).expect("odd lines were left out");
        println!("limb {limb}, robot {robot}: λ_h {:.4}, λ_r {:.4}, p {:.1e}", odd.lambda_limb, odd.lambda_robot, odd.probability);
        // What is unexplained by the right side is the interpolation of its response between driven lines.
        let (right, wrong) = if limb > 0.0 { (odd.lambda_robot, odd.lambda_limb) } else { (odd.lambda_limb, odd.lambda_robot) };
        assert!(right < 0.05 && wrong > 10.0 * right && wrong > 0.2, "right {right}, wrong {wrong}");
    }
}
