//! From a Jacobian to the covariance of parameters, and to what the data leave undetermined.

use faer::{Mat, Side};
use ndarray::Array2;

/// Relative eigenvalue of the scaled information below which a direction counts as undetermined.
const UNDETERMINED: f64 = 1e-14;
/// Share of an undetermined direction that makes a parameter undetermined.
const TAKES_PART: f64 = 1e-3;

/// JᵀJ, each parameter scaled by the norm of its column.
pub(crate) struct Information {
    scale: Vec<f64>,
    /// Inverse over the determined directions.
    inverse: Mat<f64>,
    undetermined: Vec<bool>,
    /// Condition number of the scaled Jacobian.
    pub(crate) condition: f64,
}

impl Information {
    pub(crate) fn new(jacobian: &Mat<f64>) -> Self {
        let k = jacobian.ncols();
        let scale: Vec<f64> = (0..k).map(|j| jacobian.col(j).norm_l2()).map(|v| if v > 0.0 && v.is_finite() { v } else { 0.0 }).collect();
        let unit = Mat::from_fn(jacobian.nrows(), k, |i, j| if scale[j] > 0.0 { jacobian[(i, j)] / scale[j] } else { 0.0 });
        let mut undetermined: Vec<bool> = scale.iter().map(|s| *s == 0.0).collect();
        let mut inverse = Mat::zeros(k, k);
        let mut condition = f64::INFINITY;
        if let Ok(eigen) = (unit.transpose() * &unit).self_adjoint_eigen(Side::Lower) {
            let (vectors, values) = (eigen.U(), eigen.S());
            let largest = (0..k).map(|i| values[i]).fold(0.0, f64::max);
            let smallest = (0..k).map(|i| values[i]).fold(f64::INFINITY, f64::min);
            condition = if smallest > 0.0 { (largest / smallest).sqrt() } else { f64::INFINITY };
            for i in 0..k {
                if values[i] > UNDETERMINED * largest {
                    for r in 0..k {
                        for c in 0..k {
                            inverse[(r, c)] += vectors[(r, i)] * vectors[(c, i)] / values[i];
                        }
                    }
                } else {
                    (0..k).filter(|&r| vectors[(r, i)].abs() > TAKES_PART).for_each(|r| undetermined[r] = true);
                }
            }
        } else {
            undetermined.fill(true);
        }
        Information { scale, inverse, undetermined, condition }
    }

    /// (JᵀJ)⁻¹ over the determined directions.
    pub(crate) fn inverse(&self) -> Mat<f64> {
        let inverse_scale = |k: usize| if self.scale[k] > 0.0 { 1.0 / self.scale[k] } else { 0.0 };
        Mat::from_fn(self.scale.len(), self.scale.len(), |r, c| self.inverse[(r, c)] * inverse_scale(r) * inverse_scale(c))
    }

    /// factor · (JᵀJ)⁻¹.
    pub(crate) fn covariance(&self, factor: f64) -> Array2<f64> {
        self.unscale(&self.inverse, factor)
    }

    /// factor · (JᵀJ)⁻¹ meat (JᵀJ)⁻¹.
    pub(crate) fn sandwich(&self, meat: &Mat<f64>, factor: f64) -> Array2<f64> {
        let k = self.scale.len();
        let scaled = Mat::from_fn(k, k, |r, c| if self.scale[r] > 0.0 && self.scale[c] > 0.0 { meat[(r, c)] / (self.scale[r] * self.scale[c]) } else { 0.0 });
        self.unscale(&(&self.inverse * scaled * &self.inverse), factor)
    }

    fn unscale(&self, a: &Mat<f64>, factor: f64) -> Array2<f64> {
        Array2::from_shape_fn((self.scale.len(), self.scale.len()), |(r, c)| {
            if self.undetermined[r] || self.undetermined[c] {
                if r == c { f64::INFINITY } else { 0.0 }
            } else {
                factor * a[(r, c)] / (self.scale[r] * self.scale[c])
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_that_is_known_does_not_determine_its_parts() {
        let j = Mat::from_fn(3, 3, |i, k| [[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 5.0]][i][k]);
        let information = Information::new(&j);
        let covariance = information.covariance(1.0);
        assert!(covariance[[0, 0]].is_infinite() && covariance[[1, 1]].is_infinite());
        assert!((covariance[[2, 2]] - 1.0 / 25.0).abs() < 1e-15);
        assert!(information.condition > 1e7);
    }

    #[test]
    fn a_sandwich_with_the_information_itself_is_the_covariance() {
        let j = Mat::from_fn(3, 2, |i, k| [[1.0, 200.0], [2.0, -50.0], [0.5, 90.0]][i][k]);
        let information = Information::new(&j);
        let (plain, sandwich) = (information.covariance(2.0), information.sandwich(&(j.transpose() * &j), 2.0));
        assert!(plain.iter().zip(&sandwich).all(|(a, b)| (a - b).abs() < 1e-12 * plain[[0, 0]]));
    }
}
