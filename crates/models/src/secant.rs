//! What the steps of a search tell of the curvature that residuals add to a sum of squares.

use faer::Mat;

/// An estimate of Σ r ∂²r/∂x² from the gradients at both ends of each step, and whether steps should trust it.
///
/// Where residuals stay large at the minimum, JᵀJ alone is too steep or too flat, and every step closes the same share of the way; the secants of those
/// steps hold what is missing. Which of the two models the next step takes is told by which of them foresaw the last one better.
///
/// # References
/// J. E. Dennis, D. M. Gay & R. E. Welsch (1981), An adaptive nonlinear least-squares algorithm, ACM TOMS 7, 348-368. The secant condition here is that
/// of whole gradients, S h = Δg − JᵀJ h, which needs no Jacobian of the step before (M. Al-Baali & R. Fletcher 1985).
#[derive(Clone, Debug)]
pub(crate) struct Secant {
    curvature: Mat<f64>,
    last: Option<(Vec<f64>, Mat<f64>)>,
    trusted: bool,
}

impl Secant {
    pub fn new() -> Self {
        Secant { curvature: Mat::new(), last: None, trusted: false }
    }

    /// Learns from the step that has led to `x`, where the gradient and JᵀJ are these; the curvature to go on with, if that is to be trusted.
    pub fn arrive(&mut self, x: &[f64], gradient: &Mat<f64>, information: &Mat<f64>) -> Option<&Mat<f64>> {
        let n = x.len();
        let Some((from, before)) = self.last.replace((x.to_vec(), gradient.clone())) else {
            self.curvature = Mat::zeros(n, n);
            return None;
        };
        let h = Mat::from_fn(n, 1, |i, _| x[i] - from[i]);
        let y = gradient - &before;
        let dot = |a: &Mat<f64>, b: &Mat<f64>| (a.transpose() * b)[(0, 0)];
        let wanted = &y - information * &h;
        let had = dot(&h, &(&self.curvature * &h));
        // Residuals shrink on the way, and what was learned of larger ones with them.
        let shrunk = if had == 0.0 { 1.0 } else { (dot(&h, &wanted) / had).abs().min(1.0) };
        self.curvature *= faer::Scale(shrunk);
        let missing = wanted - &self.curvature * &h;
        let (along, over) = (dot(&y, &h), dot(&missing, &h));
        if along > 0.0 {
            let pair = &missing * y.transpose();
            self.curvature += faer::Scale(1.0 / along) * (&pair + pair.transpose()) - faer::Scale(over / (along * along)) * &y * y.transpose();
        }
        self.trusted &= self.curvature.norm_l2().is_finite();
        self.trusted.then_some(&self.curvature)
    }

    /// Compares what JᵀJ alone foresaw of a step's decrease, and what the curvature would have, with what was achieved. Of a problem that knows its
    /// curvature nothing was learned, and nothing is judged.
    pub fn judge(&mut self, h: &[f64], plain: f64, achieved: f64) {
        if self.last.is_none() {
            return;
        }
        let h = Mat::from_fn(h.len(), 1, |i, _| h[i]);
        let curved = plain - 0.5 * (h.transpose() * &self.curvature * &h)[(0, 0)];
        self.trusted = (achieved - curved).abs() < (achieved - plain).abs();
    }

    /// No longer trusts what a step has disproved.
    pub fn doubt(&mut self) -> bool {
        std::mem::replace(&mut self.trusted, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a quadratic cost with JᵀJ one half of the curvature, as many steps as parameters tell the other half along them.
    #[test]
    fn steps_tell_what_is_missing() {
        let whole = Mat::from_fn(3, 3, |i, j| if i == j { 4.0 + i as f64 } else { 1.0 });
        let information = faer::Scale(0.5) * &whole;
        let mut secant = Secant::new();
        let at = |x: &[f64; 3]| &whole * Mat::from_fn(3, 1, |i, _| x[i]);
        let steps = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, -1.0], [0.5, 1.2, -1.0]];
        for (k, x) in steps.iter().enumerate() {
            secant.trusted = true;
            let found = secant.arrive(x, &at(x), &information).cloned();
            let Some(found) = found.filter(|_| k > 0) else { continue };
            let h = Mat::from_fn(3, 1, |i, _| x[i] - steps[k - 1][i]);
            assert!(((&information + found) * &h - &whole * &h).norm_max() < 1e-12);
            secant.judge(&[0.1, 0.2, -0.3], 1.0, 1.0);
            assert!(!secant.doubt(), "what JᵀJ foresees exactly needs nothing else");
        }
    }
}
