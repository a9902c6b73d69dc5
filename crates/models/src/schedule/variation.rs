//! Whether a matrix varies over the schedule at all.

use super::ScheduleError;
use super::design::Layout;
use super::moments::{Columns, Normal, Products, Varying};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use ndarray::Array2;
use ndof_linear::symmetric_eigen;

/// Eigenvalues of the roughness below this share of the largest are that of the constant.
const FREE: f64 = 1e-10;
/// Probabilities below this are round-off of the integral, and are given as this.
pub const LEAST_PROBABILITY: f64 = 1e-9;
/// Four times the logarithm of a probability of 1e-13 that the integral leaves out.
const FURTHEST: f64 = 120.0;

/// Probability of so much variation in one row of a matrix (0 K, 1 B, 2 M) if it were constant.
///
/// The score of the restricted likelihood in the penalty's inverse weight at none: T = eᵀ D S⁻ Dᵀ e/eᵀe with e what the constant model leaves,
/// all else that may vary left free beside it. Under Gaussian errors T is a ratio of weighted sums of χ², whose law is integrated exactly; it
/// spends few degrees of freedom, as a smooth curve does.
///
/// # References
/// D. Zhang & X. Lin (2003), Hypothesis testing in semiparametric additive mixed models; J. P. Imhof (1961), Computing the distribution of
/// quadratic forms in normal variables.
pub(super) fn probability_if_constant(
    products: &Products,
    layout: &Layout,
    (output, matrix, varying): (usize, usize, Varying),
    roughness: &Array2<f64>,
) -> Result<f64, ScheduleError> {
    let count = layout.splines.count();
    let mut constant = varying;
    constant[matrix] = false;
    let kept = Columns::new(layout, constant).summed;
    let tested = (0..layout.axes).flat_map(|input| (0..count).map(move |k| vec![layout.column(matrix, input, k)]));
    let first = kept.len();
    let columns: Vec<Vec<usize>> = kept.into_iter().chain(tested).collect();
    let normal = Normal::new(products, layout, &columns, output)?;
    let width = layout.matrix_width();
    let nuisance: Vec<usize> = (0..first).chain(first + width..normal.dd.nrows()).collect();
    let part = |rows: &dyn Fn(usize) -> usize, m: usize| Mat::from_fn(m, nuisance.len(), |i, j| normal.dd[(rows(i), nuisance[j])]);
    let of_nuisance = part(&|i| nuisance[i], nuisance.len()).llt(Side::Lower).map_err(|_| ScheduleError::Undetermined)?;
    let cross = part(&|i| first + i, width);
    let beta = of_nuisance.solve(Mat::from_fn(nuisance.len(), 1, |i, _| normal.dy[(nuisance[i], 0)]));
    let score = normal.dy.submatrix(first, 0, width, 1).to_owned() - &cross * &beta;
    let own = normal.dd.submatrix(first, first, width, width).to_owned() - &cross * of_nuisance.solve(cross.transpose().to_owned());
    let all = Mat::from_fn(normal.dd.nrows(), 1, |i, _| nuisance.iter().position(|k| *k == i).map_or(0.0, |k| beta[(k, 0)]));
    let left = normal.left(&all);
    let turn = smooth_directions(roughness, layout.axes, &own)?;
    let (score, own) = (turn.transpose() * score, turn.transpose() * own * &turn);
    let power: f64 = (0..score.nrows()).map(|k| score[(k, 0)].powi(2)).sum();
    let square = Array2::from_shape_fn((own.nrows(), own.nrows()), |(i, j)| own[(i, j)]);
    let (eigenvalues, _) = symmetric_eigen(&square).ok_or(ScheduleError::Undetermined)?;
    let eigenvalues: Vec<f64> = eigenvalues.into_iter().map(|v| v.max(0.0)).collect();
    let freedom = normal.rows.saturating_sub(nuisance.len()) as f64;
    Ok(above(&eigenvalues, freedom, power / left))
}

/// Directions along which the penalty measures one, the constant left out; entries of one row of the matrix with the same say.
fn smooth_directions(roughness: &Array2<f64>, axes: usize, information: &Mat<f64>) -> Result<Mat<f64>, ScheduleError> {
    let (values, vectors) = symmetric_eigen(roughness).ok_or(ScheduleError::Undetermined)?;
    let largest = values.last().copied().unwrap_or(0.0);
    let count = roughness.nrows();
    let kept: Vec<usize> = (0..count).filter(|k| values[*k] > FREE * largest).collect();
    let mut turn = Mat::zeros(axes * count, axes * kept.len());
    for axis in 0..axes {
        let told: f64 = (0..count).map(|k| information[(axis * count + k, axis * count + k)]).sum();
        for (column, k) in kept.iter().enumerate() {
            let scale = 1.0 / (values[*k] * told.max(f64::MIN_POSITIVE)).sqrt();
            (0..count).for_each(|row| turn[(axis * count + row, axis * kept.len() + column)] = vectors[[row, *k]] * scale);
        }
    }
    Ok(turn)
}

/// P(Σ λ_i χ²_1 > ratio · (Σ χ²_1 + χ²_{freedom − m})), the first χ² the same on both sides: Imhof's integral of
/// Q = Σ (λ_i − r) χ²_1 − r χ²_{freedom − m} by the trapezoidal rule. With steps h it is exact where |Q| < 4π/h, and Chernoff's inequality
/// bounds what lies beyond: P(|Q| > q) ≤ 2 exp(0.35 Σ|w| − q/4) for weights w of one at most.
fn above(eigenvalues: &[f64], freedom: f64, ratio: f64) -> f64 {
    let largest = eigenvalues.iter().fold(0.0_f64, |s, v| s.max(*v));
    let rest = freedom - eigenvalues.len() as f64;
    if largest <= 0.0 || rest <= 0.0 || !ratio.is_finite() {
        return f64::NAN;
    }
    if ratio >= largest {
        return LEAST_PROBABILITY;
    }
    let terms: Vec<(f64, f64)> = eigenvalues.iter().map(|v| ((v - ratio) / largest, 1.0)).chain([(-ratio / largest, rest)]).collect();
    let turning: f64 = terms.iter().map(|(weight, count)| weight.abs() * count).sum();
    let step = 4.0 * std::f64::consts::PI / (FURTHEST + 1.4 * turning);
    let mut sum = 0.5 * 0.5 * terms.iter().map(|(weight, count)| weight * count).sum::<f64>();
    for k in 1..2_000_000_u32 {
        let x = f64::from(k) * step;
        let angle: f64 = 0.5 * terms.iter().map(|(weight, count)| count * (weight * x).atan()).sum::<f64>();
        let decay: f64 = 0.25 * terms.iter().map(|(weight, count)| count * (weight * x).powi(2).ln_1p()).sum::<f64>();
        let size = (-decay).exp() / x;
        sum += angle.sin() * size;
        if size * step < 1e-14 {
            break;
        }
    }
    (0.5 + sum * step / std::f64::consts::PI).clamp(LEAST_PROBABILITY, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF, FisherSnedecor};

    /// Equal weights make it the law of Fisher.
    #[test]
    fn equal_weights_give_the_law_of_fisher() {
        for (m, freedom, f) in [(5, 100.0, 1.7), (12, 400.0, 0.9), (20, 60.0, 2.5)] {
            let rest = freedom - m as f64;
            let law = FisherSnedecor::new(m as f64, rest).expect("degrees");
            // F = (Q/m)/(R/rest); the ratio is Q/(Q + R).
            let q = f * m as f64 / rest;
            let found = above(&vec![3.0; m], freedom, 3.0 * q / (1.0 + q));
            assert!((found - law.sf(f)).abs() < 1e-7, "{found} for {}", law.sf(f));
        }
    }
}
