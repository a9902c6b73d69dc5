//! Cubic splines over the scheduling variable.

use ndarray::Array2;
use std::f64::consts::TAU;

/// Uniform cubic B-splines over u from 0 to 1, closed where u is the phase of a cycle. At each u they add up to one.
///
/// # References
/// C. de Boor (1978), A practical guide to splines; P. H. C. Eilers & B. D. Marx (1996), Flexible smoothing with B-splines and penalties.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Splines {
    count: usize,
    closed: bool,
}

/// Pieces of a cubic B-spline that lie over one cell.
pub(super) const PIECES: usize = 4;
/// Three points of Gauss and Legendre integrate polynomials up to degree five exactly: places in a cell, and weights.
const GAUSS: [(f64, f64); 3] = [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

impl Splines {
    /// The fewest: each is then another piece in every cell.
    pub const FEWEST: usize = PIECES;

    /// So many splines, four at least.
    pub fn new(count: usize, closed: bool) -> Self {
        Splines { count: count.max(Self::FEWEST), closed }
    }

    /// How many there are.
    pub fn count(self) -> usize {
        self.count
    }

    /// Whether the end is the beginning.
    pub fn closed(self) -> bool {
        self.closed
    }

    fn cells(self) -> usize {
        if self.closed { self.count } else { self.count + 1 - PIECES }
    }

    /// The splines that are not nought at `u`, and their values there.
    pub fn at(self, u: f64) -> [(usize, f64); PIECES] {
        let (cell, f) = self.cell(u);
        let g = 1.0 - f;
        let values = [g * g * g, (3.0 * f - 6.0) * f * f + 4.0, ((3.0 - 3.0 * f) * f + 3.0) * f + 1.0, f * f * f];
        std::array::from_fn(|k| ((cell + k) % self.count, values[k] / 6.0))
    }

    /// The curve of these coefficients at `u`.
    pub fn value(self, coefficients: &[f64], u: f64) -> f64 {
        self.at(u).into_iter().map(|(k, value)| value * coefficients[k]).sum()
    }

    /// The cell in which `u` lies, and where in it.
    fn cell(self, u: f64) -> (usize, f64) {
        let cells = self.cells();
        let t = if self.closed { u.rem_euclid(1.0) } else { u.clamp(0.0, 1.0) } * cells as f64;
        let cell = (t as usize).min(cells - 1);
        (cell, t - cell as f64)
    }

    /// All splines at `u`.
    pub fn row(self, u: f64) -> Vec<f64> {
        let mut row = vec![0.0; self.count];
        self.at(u).into_iter().for_each(|(k, value)| row[k] += value);
        row
    }

    /// S of ∫ (κ″² + (2π)² κ′²) du = cᵀ S c for κ = Σ c_k φ_k, scaled to a mean diagonal of one. The slope counts so that nothing but a
    /// constant is free, and as much as the curvature for what goes up and down once from 0 to 1.
    pub fn roughness(self) -> Array2<f64> {
        let mut s = Array2::<f64>::zeros((self.count, self.count));
        let cells = self.cells() as f64;
        for cell in 0..self.cells() {
            for (f, weight) in GAUSS {
                let g = 1.0 - f;
                let slope = [-g * g, (3.0 * f - 4.0) * f, (2.0 - 3.0 * f) * f + 1.0, f * f].map(|d| 0.5 * d * cells);
                let curvature = [g, 3.0 * f - 2.0, 1.0 - 3.0 * f, f].map(|d| d * cells * cells);
                for i in 0..PIECES {
                    for j in 0..PIECES {
                        let entry = curvature[i] * curvature[j] + TAU * TAU * slope[i] * slope[j];
                        s[[(cell + i) % self.count, (cell + j) % self.count]] += weight / cells * entry;
                    }
                }
            }
        }
        let mean = s.diag().sum() / self.count as f64;
        s / mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_add_up_to_one_and_a_closed_one_meets_itself() {
        for splines in [Splines::new(7, true), Splines::new(7, false), Splines::new(4, true), Splines::new(4, false)] {
            for k in 0..=50 {
                let sum: f64 = splines.row(f64::from(k) / 50.0).iter().sum();
                assert!((sum - 1.0).abs() < 1e-14, "{splines:?}");
            }
        }
        let closed = Splines::new(9, true);
        assert!(closed.row(0.0).iter().zip(closed.row(1.0 - 1e-12)).all(|(a, b)| (a - b).abs() < 1e-10));
    }

    /// Against the integral by small differences of the curve itself.
    #[test]
    fn the_roughness_is_the_integral_of_curvature_and_slope() {
        for closed in [true, false] {
            let splines = Splines::new(8, closed);
            let c: Vec<f64> = (0..8).map(|k| f64::from(k * k % 5) - 1.5).collect();
            let (steps, h) = (4000, 1e-4);
            let integral = |c: &[f64]| -> f64 {
                let curve = |u: f64| splines.row(u).iter().zip(c).map(|(a, b)| a * b).sum::<f64>();
                let integrand = |k: i32| {
                    let u = h + (1.0 - 2.0 * h) * (f64::from(k) + 0.5) / f64::from(steps);
                    let (low, mid, high) = (curve(u - h), curve(u), curve(u + h));
                    ((low - 2.0 * mid + high) / (h * h)).powi(2) + TAU * TAU * ((high - low) / (2.0 * h)).powi(2)
                };
                (0..steps).map(integrand).sum::<f64>() / f64::from(steps)
            };
            let s = splines.roughness();
            let form = |c: &[f64]| (0..8).map(|i| (0..8).map(|j| c[i] * s[[i, j]] * c[j]).sum::<f64>()).sum::<f64>();
            // The scale is the mean diagonal: that of one spline inside, which a difference quotient gives too.
            let one: Vec<f64> = (0..8).map(|k| f64::from(u8::from(k == 2))).collect();
            let ratio = form(&c) / integral(&c);
            assert!(ratio > 0.0 && form(&one) > 0.0 && form(&[1.0; 8]).abs() < 1e-12);
            let other: Vec<f64> = c.iter().rev().map(|v| v * v).collect();
            assert!((form(&other) / integral(&other) / ratio - 1.0).abs() < 2e-3, "closed {closed}: one scale for every curve");
        }
    }
}
