//! Minima agree with `scipy.optimize.least_squares` (tests/reference/levenberg_marquardt.py).

use faer::Mat;
use ndof_models::{LeastSquares, LevenbergMarquardt, MinimiseError, StopReason};

/// Another implementation: 1e-10 relative in cost; parameters go as the root of it where the minimum is flat.
const COST: f64 = 1e-10;
const PARAMETERS: f64 = 1e-6;

struct Problem(&'static str);

impl LeastSquares for Problem {
    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        match self.0 {
            "rosenbrock" => vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]],
            "powell" => vec![x[0] + 10.0 * x[1], 5f64.sqrt() * (x[2] - x[3]), (x[1] - 2.0 * x[2]).powi(2), 10f64.sqrt() * (x[0] - x[3]).powi(2)],
            _ => (0..12)
                .map(|k| {
                    let t = f64::from(k) / 4.0;
                    let y = 2e4 * (-1.3 * t).exp() + 500.0 * (-0.2 * t).exp() + 30.0 * (7.0 * t).sin();
                    x[0] * (-x[1] * t).exp() + x[2] * (-x[3] * t).exp() - y
                })
                .collect(),
        }
    }

    fn jacobian(&self, x: &[f64]) -> Mat<f64> {
        match self.0 {
            "rosenbrock" => Mat::from_fn(2, 2, |i, j| [[-20.0 * x[0], 10.0], [-1.0, 0.0]][i][j]),
            "powell" => {
                let (b, c, d) = (2.0 * (x[1] - 2.0 * x[2]), 2.0 * 10f64.sqrt() * (x[0] - x[3]), 5f64.sqrt());
                Mat::from_fn(4, 4, |i, j| [[1.0, 10.0, 0.0, 0.0], [0.0, 0.0, d, -d], [0.0, b, -2.0 * b, 0.0], [c, 0.0, 0.0, -c]][i][j])
            }
            _ => Mat::from_fn(12, 4, |k, j| {
                let t = k as f64 / 4.0;
                let (a, b) = ((-x[1] * t).exp(), (-x[3] * t).exp());
                [a, -t * x[0] * a, b, -t * x[2] * b][j]
            }),
        }
    }
}

#[test]
fn minima_within_bounds_are_those_of_scipy() {
    let reference: serde_json::Value = serde_json::from_str(include_str!("../reference/levenberg_marquardt.json")).expect("json");
    let numbers = |case: &serde_json::Value, key: &str, none: f64| -> Vec<f64> {
        case[key].as_array().expect("array").iter().map(|v| v.as_f64().unwrap_or(none)).collect()
    };
    let cases = reference["cases"].as_array().expect("cases");
    for (case, learning) in cases.iter().flat_map(|case| [(case, false), (case, true)]) {
        let name = case["problem"].as_str().expect("name");
        let bounds = numbers(case, "lower", f64::NEG_INFINITY).into_iter().zip(numbers(case, "upper", f64::INFINITY)).collect();
        let problem = Problem(if name == "rosenbrock" {
            "rosenbrock"
        } else if name == "powell" {
            "powell"
        } else {
            "decay"
        });
        let plain = LevenbergMarquardt::new(bounds);
        let search = if learning { plain.learning_curvature() } else { plain };
        let minimum = search.minimise(&problem, &numbers(case, "start", 0.0)).expect("runs");
        let (x, cost) = (numbers(case, "x", 0.0), case["cost"].as_f64().expect("cost"));
        assert!(minimum.reason.converged(), "{case}: {:?} after {}", minimum.reason, minimum.iterations);
        assert!((minimum.cost - cost).abs() <= COST * cost + 1e-20, "{case}: {} at {:?}", minimum.cost, minimum.x);
        let flat = if cost < 1e-12 { 1e-3 } else { PARAMETERS };
        for (a, b) in minimum.x.iter().zip(&x) {
            assert!((a - b).abs() <= flat * (b.abs() + 1e-3), "{case}: {:?}", minimum.x);
        }
    }
}

/// Dennis & Schnabel (1983), ex. 10.2.4: the minimum is at 0, where JᵀJ = 2 and Σ r r'' = -2 λ, so that steps of JᵀJ alone leave λ of the way.
#[test]
fn residuals_that_stay_large_are_learned_from_the_steps() {
    struct Large(f64);
    impl LeastSquares for Large {
        fn residuals(&self, x: &[f64]) -> Vec<f64> {
            vec![x[0] + 1.0, self.0 * x[0] * x[0] + x[0] - 1.0]
        }
        fn jacobian(&self, x: &[f64]) -> Mat<f64> {
            Mat::from_fn(2, 1, |i, _| if i == 0 { 1.0 } else { 2.0 * self.0 * x[0] + 1.0 })
        }
    }
    let free = || LevenbergMarquardt::new(vec![(f64::NEG_INFINITY, f64::INFINITY)]);
    for share in [0.5f64, 0.6, -0.6] {
        let [plain, learning] = [free(), free().learning_curvature()].map(|search| search.minimise(&Large(share), &[-0.3]).expect("runs"));
        assert!(plain.x[0].abs() < 1e-4 && learning.x[0].abs() < 1e-6 && (learning.cost - 1.0).abs() < 1e-12, "{share}: {} {}", plain.x[0], learning.x[0]);
        assert!(2 * learning.iterations < plain.iterations, "{share}: {} steps, {} before", learning.iterations, plain.iterations);
    }
}

#[test]
fn the_unit_of_a_parameter_changes_nothing() {
    struct Scaled(f64);
    impl LeastSquares for Scaled {
        fn residuals(&self, x: &[f64]) -> Vec<f64> {
            Problem("decay").residuals(&[x[0] * self.0, x[1], x[2] / self.0, x[3]])
        }
        fn jacobian(&self, x: &[f64]) -> Mat<f64> {
            let j = Problem("decay").jacobian(&[x[0] * self.0, x[1], x[2] / self.0, x[3]]);
            Mat::from_fn(12, 4, |i, k| j[(i, k)] * [self.0, 1.0, 1.0 / self.0, 1.0][k])
        }
    }
    let run = |unit: f64| {
        LevenbergMarquardt::new(vec![(f64::NEG_INFINITY, f64::INFINITY); 4]).minimise(&Scaled(unit), &[1e4 / unit, 3.0, 100.0 * unit, 0.05]).expect("runs")
    };
    let (one, milli) = (run(1.0), run(1e-3));
    assert!((one.cost / milli.cost - 1.0).abs() < 1e-12);
    assert_eq!(one.iterations, milli.iterations);
}

#[test]
fn contradictions_are_refused_and_a_limit_is_named() {
    let free = || vec![(f64::NEG_INFINITY, f64::INFINITY); 2];
    let run = |lm: LevenbergMarquardt, start: &[f64]| lm.minimise(&Problem("rosenbrock"), start);
    assert!(matches!(run(LevenbergMarquardt::new(free()), &[0.0]), Err(MinimiseError::BoundsLength { parameters: 1, bounds: 2 })));
    assert!(matches!(run(LevenbergMarquardt::new(vec![(0.0, 0.0), (0.0, 1.0)]), &[0.0; 2]), Err(MinimiseError::EmptyBounds { parameter: 0, .. })));
    assert!(matches!(run(LevenbergMarquardt::new(free()), &[f64::NAN, 0.0]), Err(MinimiseError::StartNotFinite { residual: 0 })));
    let mut short = LevenbergMarquardt::new(free());
    short.max_iterations = 2;
    let minimum = run(short, &[-1.2, 1.0]).expect("runs");
    assert_eq!((minimum.reason, minimum.iterations), (StopReason::IterationLimit, 2));
}
