//! Several actuators along one axis: their efforts add up, with gains that a fit finds.

use ndof_analysis::{AnalysisError, Estimate, Fit, FitCost, Fitted, Trial};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const RATE_HZ: f64 = 100.0;
/// Steps of the integrator between samples: 0.5 ms, whose error is 1e-5 of a motion of 8 Hz at most.
const STEPS: usize = 20;

/// M ẍ + B ẋ + K x = W u for one or two axes, with what a controller holds along the first.
struct Limb<const N: usize> {
    inertia_inverse: [[f64; N]; N],
    damping: [[f64; N]; N],
    stiffness: [[f64; N]; N],
    gains: Vec<[f64; N]>,
    held: f64,
}

fn times<const N: usize>(a: &[[f64; N]; N], x: &[f64; N]) -> [f64; N] {
    a.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum())
}

impl<const N: usize> Limb<N> {
    /// Forces of each input, the first of which a controller corrects, and positions at the instants at which they begin.
    fn moved(&self, commands: &[Vec<f64>]) -> (Vec<Vec<f64>>, [Vec<f64>; N]) {
        let h = 1.0 / (RATE_HZ * STEPS as f64);
        let (mut x, mut v) = ([0.0; N], [0.0; N]);
        let mut forces = commands.to_vec();
        let mut positions: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
        for k in 0..commands[0].len() {
            forces[0][k] -= self.held * x[0];
            let effort: [f64; N] = std::array::from_fn(|axis| self.gains.iter().zip(&forces).map(|(gain, force)| gain[axis] * force[k]).sum());
            positions.iter_mut().zip(x).for_each(|(out, x)| out.push(x));
            let slope = |x: &[f64; N], v: &[f64; N]| {
                let (b, k) = (times(&self.damping, v), times(&self.stiffness, x));
                times(&self.inertia_inverse, &std::array::from_fn(|i| effort[i] - b[i] - k[i]))
            };
            for _ in 0..STEPS {
                let half = |at: &[f64; N], by: &[f64; N], step: f64| -> [f64; N] { std::array::from_fn(|i| at[i] + step * by[i]) };
                let (xm, vm) = (half(&x, &v, h / 2.0), half(&v, &slope(&x, &v), h / 2.0));
                (x, v) = (half(&x, &vm, h), half(&v, &slope(&xm, &vm), h));
            }
        }
        (forces, positions)
    }
}

/// Normal numbers of 5 N, each input by itself, and what sensors of positions add: a hundredth of their size.
fn record<const N: usize>(limb: &Limb<N>, names: [&str; N], inputs: &[&str], seed: u64, commanded: bool) -> Trial {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |scale: f64| -> Vec<f64> { (0..6000).map(|_| StandardNormal.sample(&mut rng)).map(|v: f64| scale * v).collect() };
    let commands: Vec<Vec<f64>> = inputs.iter().map(|_| normal(5.0)).collect();
    let (forces, positions) = limb.moved(&commands);
    let mut channels = Trial::new(RATE_HZ);
    for ((name, force), command) in inputs.iter().zip(forces).zip(commands) {
        channels = channels.effort(name, force);
        if commanded {
            channels = channels.command(name, command);
        }
    }
    let mut trial: Option<Trial> = None;
    for (name, position) in names.iter().zip(positions) {
        let size = (position.iter().map(|x| x * x).sum::<f64>() / position.len() as f64).sqrt();
        let seen: Vec<f64> = position.iter().zip(normal(0.01 * size)).map(|(x, e)| x + e).collect();
        trial = Some(
            match trial {
                None => channels.clone().displacement(name, seen),
                Some(trial) => trial.displacement(name, seen),
            }
            .expect("channels of one length"),
        );
    }
    trial.expect("an axis")
}

fn fitted(trial: &Trial, settings: &Fit) -> Result<Fitted, AnalysisError> {
    settings.run(&Estimate::default().run([trial]).expect("an estimate"))
}

/// 2.5 Hz and 4.9 Hz, damping ratios of a fifth.
fn single(held: f64) -> Limb<1> {
    Limb { inertia_inverse: [[0.5]], damping: [[12.0]], stiffness: [[500.0]], gains: vec![[1.0], [0.7]], held }
}

/// Counts of intervals that hold the truth, at least; of 40 with 95 % each, four binomial standard deviations below.
const RECORDS: u64 = 40;
const AT_LEAST: usize = 32;

fn held(truth: &[f64], fits: impl Iterator<Item = Fitted>) {
    let mut counts = vec![0; truth.len()];
    for fitted in fits {
        let parameters = &fitted.result.parameters;
        assert_eq!(parameters.len(), truth.len(), "{parameters:?}");
        for (k, (p, truth)) in parameters.iter().zip(truth).enumerate() {
            let [low, high] = p.ci95.expect("an interval");
            counts[k] += usize::from((low..=high).contains(truth));
            // Wide intervals would hold anything.
            assert!(high - low < 0.3 * truth.abs().max(1.0), "{p:?}");
        }
    }
    assert!(counts.iter().all(|count| *count >= AT_LEAST), "{counts:?} of {RECORDS}");
}

#[test]
fn two_actuators_of_one_axis_have_gains_of_their_own() {
    let record = |seed| record(&single(0.0), ["x"], &["x", "motor"], seed, false);
    held(&[2.0, 12.0, 500.0, 0.7], (0..RECORDS).map(|seed| fitted(&record(seed), &Fit::default()).expect("a fit")));
    let fitted = fitted(&record(1), &Fit::default()).expect("a fit");
    let result = &fitted.result;
    assert_eq!(result.parameters[3].name, "gain_force_motor");
    assert_eq!((result.parameters[3].unit.as_str(), result.parameters[3].site.side.as_str()), ("1", "actuator"));
    assert_eq!(result.reference_inputs, ["force_x"]);
    assert!(result.other_cost.is_none() && result.vaf.dim() == (1, 1) && result.r2.is_some());
    assert!(result.remarks().iter().any(|remark| remark.contains("force_x with gain 1, force_motor")), "{:?}", result.remarks());
}

#[test]
fn a_loop_around_one_of_them_does_not_bias_the_derived_estimate() {
    let record = |seed| record(&single(300.0), ["x"], &["x", "motor"], seed, true);
    held(&[2.0, 12.0, 500.0, 0.7], (0..RECORDS).map(|seed| fitted(&record(seed), &Fit::default()).expect("a fit")));
    assert_eq!(fitted(&record(1), &Fit::default()).expect("a fit").result.estimate, "derived");
}

#[test]
fn a_third_actuator_pushes_along_both_axes() {
    let plane = Limb {
        // The inverse of [[2, 0.4], [0.4, 1.5]].
        inertia_inverse: [[1.5 / 2.84, -0.4 / 2.84], [-0.4 / 2.84, 2.0 / 2.84]],
        damping: [[12.0, -1.0], [-1.0, 9.0]],
        stiffness: [[500.0, -80.0], [-80.0, 350.0]],
        gains: vec![[0.6, -0.3], [1.0, 0.0], [0.0, 1.0]],
        held: 0.0,
    };
    let record = |seed| record(&plane, ["x", "y"], &["motor", "x", "y"], seed, false);
    let truth = [2.0, 0.4, 1.5, 12.0, -1.0, 9.0, 500.0, -80.0, 350.0, 0.6, -0.3];
    held(&truth, (0..RECORDS).map(|seed| fitted(&record(seed), &Fit::default()).expect("a fit")));
}

#[test]
fn what_has_no_sum_is_refused_in_words() {
    let trial = record(&single(0.0), ["x"], &["x", "motor"], 1, false);
    let paper = fitted(&trial, &Fit { cost: FitCost::Paper, ..Fit::default() });
    assert!(matches!(paper, Err(AnalysisError::PaperSums)));
}
