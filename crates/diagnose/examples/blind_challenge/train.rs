//! The coefficients of the probability, from stored rows.
//!
//! Logistic regression of "the name is right" on what the search saw, each coefficient bound to the sign that physics demands,
//! with a ridge towards values that were set by hand (an outside effect hardly ever gets a name to learn from); found by Newton steps
//! along one coordinate after the other.

use crate::row::Row;
use ndof_diagnose::SIGNS;

/// Where the ridge pulls to, the constant first.
const PRIOR: [f64; SIGNS.len() + 1] = [1.0, 0.25, -0.8, 0.35, -3.0, -1.0, 1.0, 0.2];

/// Case: features with a leading one, whether the name was right, and what its probability may be at most.
type Case = (Vec<f64>, bool, f64);

fn logistic(w: &[f64], f: &[f64]) -> f64 {
    1.0 / (1.0 + (-w.iter().zip(f).map(|(w, f)| w * f).sum::<f64>()).exp())
}

fn fit(cases: &[Case]) -> Vec<f64> {
    let mut w = PRIOR.to_vec();
    for _ in 0..400 {
        for j in 0..w.len() {
            let (mut slope, mut curve) = (PRIOR[j] - w[j], 1.0);
            for (f, right, _) in cases {
                let p = logistic(&w, f);
                slope += f[j] * (f64::from(u8::from(*right)) - p);
                curve += f[j] * f[j] * p * (1.0 - p);
            }
            let step = (slope / curve).clamp(-1.0, 1.0);
            w[j] += step;
            if j > 0 && SIGNS[j - 1] * w[j] < 0.0 {
                w[j] = 0.0;
            }
        }
    }
    w
}

/// The probability that is stated: the gate has the last word.
fn said_of(w: &[f64], case: &Case) -> f64 {
    logistic(w, &case.0).min(case.2)
}

/// Expected calibration error in five bins of equal count.
fn calibration_error(mut said: Vec<(f64, bool)>) -> f64 {
    said.sort_by(|a, b| a.0.total_cmp(&b.0));
    (0..5)
        .map(|b| {
            let part = &said[b * said.len() / 5..(b + 1) * said.len() / 5];
            let stated: f64 = part.iter().map(|p| p.0).sum();
            let right = part.iter().filter(|p| p.1).count() as f64;
            (stated - right).abs() / said.len().max(1) as f64
        })
        .sum()
}

/// Prints coefficients, and the calibration error where a fifth of the cases or a whole kind is left out of the fit.
pub fn print(rows: &[Row]) {
    let all: Vec<(&str, Case)> = rows
        .iter()
        .flat_map(|r| r.named.iter().filter(|n| !n.features.is_empty()).map(move |n| (r, n)))
        .map(|(r, n)| (r.kind.as_str(), (std::iter::once(1.0).chain(n.features.iter().copied()).collect(), r.is_right(n), n.at_most)))
        .collect();
    let cases: Vec<Case> = all.iter().map(|c| c.1.clone()).collect();
    println!("{} names, {} of them right", cases.len(), cases.iter().filter(|c| c.1).count());
    println!("const COEFFICIENTS: [f64; FEATURES + 1] = {:.3?};", fit(&cases));
    let mut said = Vec::new();
    for fold in 0..5 {
        let rest: Vec<Case> = cases.iter().enumerate().filter(|(k, _)| k % 5 != fold).map(|(_, c)| c.clone()).collect();
        let w = fit(&rest);
        said.extend(cases.iter().enumerate().filter(|(k, _)| k % 5 == fold).map(|(_, c)| (said_of(&w, c), c.1)));
    }
    println!("calibration error on folds left out: {:.3}", calibration_error(said));
    for kind in ["single", "other", "pair", "outside"] {
        let rest: Vec<Case> = all.iter().filter(|c| c.0 != kind).map(|c| c.1.clone()).collect();
        let left: Vec<&Case> = all.iter().filter(|c| c.0 == kind).map(|c| &c.1).collect();
        let w = fit(&rest);
        println!("  {kind} left out: {:.3} on {} names", calibration_error(left.iter().map(|c| (said_of(&w, c), c.1)).collect()), left.len());
    }
}
