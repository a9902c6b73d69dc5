//! The exponential of a matrix, and the functions φ_k from which exponential integrators take their weights.

use ndarray::Array2;

/// Halvings that bring the largest row sum of `z` to `size` or below.
fn halvings(z: &Array2<f64>, size: f64) -> i32 {
    let norm = z.outer_iter().map(|row| row.iter().map(|v| v.abs()).sum::<f64>()).fold(0.0, f64::max);
    if norm > size { (norm / size).log2().ceil() as i32 } else { 0 }
}

/// φ₀ … φ₄ of z: φ₀ = eᶻ, φ_{k+1}(z) = (φ_k(z) − 1/k!)/z.
///
/// Taylor series of z/2ˢ, then s doublings by φ_k(2z) = 2⁻ᵏ [φ₀ φ_k + Σ_{j=1}^{k} φ_j/(k−j)!]. N. J. Higham, Functions of
/// Matrices (2008), ch. 10; the recurrence is eq. (2.7) of Skaflestad and Wright, Appl. Numer. Math. 59 (2009).
pub fn phi_functions(z: &Array2<f64>) -> [Array2<f64>; 5] {
    let n = z.nrows();
    let doublings = halvings(z, 0.25);
    let z = z / 2f64.powi(doublings);
    let eye = Array2::<f64>::eye(n);
    // φ₄ by its series; the terms of ‖z‖ ≤ 1/4 fall below 1e-18 after 12. The others follow without cancellation: φ_k = z φ_{k+1} + 1/k!.
    let mut fourth = eye.clone() / 24.0;
    let mut term = fourth.clone();
    for k in 5..17 {
        term = term.dot(&z) / f64::from(k);
        fourth += &term;
    }
    let third = z.dot(&fourth) + &eye / 6.0;
    let second = z.dot(&third) + &eye / 2.0;
    let first = z.dot(&second) + &eye;
    let zeroth = z.dot(&first) + &eye;
    (0..doublings).fold([zeroth, first, second, third, fourth], |phi, _| doubled(&phi))
}

/// φ₀ … φ₄ of 2z from those of z.
pub fn doubled([p0, p1, p2, p3, p4]: &[Array2<f64>; 5]) -> [Array2<f64>; 5] {
    [
        p0.dot(p0),
        (p0.dot(p1) + p1) / 2.0,
        (p0.dot(p2) + p1 + p2) / 4.0,
        (p0.dot(p3) + p1 / 2.0 + p2 + p3) / 8.0,
        (p0.dot(p4) + p1 / 6.0 + p2 / 2.0 + p3 + p4) / 16.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn the_functions_of_a_rotation_are_sine_and_cosine() {
        let w = 7.3;
        let [p0, p1, ..] = phi_functions(&array![[0.0, w], [-w, 0.0]]);
        assert!((p0[[0, 0]] - w.cos()).abs() < 1e-14 && (p0[[0, 1]] - w.sin()).abs() < 1e-14);
        // ∫₀¹ of the rotation.
        assert!((p1[[0, 0]] - w.sin() / w).abs() < 1e-14 && (p1[[0, 1]] - (1.0 - w.cos()) / w).abs() < 1e-14);
    }

    #[test]
    fn the_recurrence_holds_for_a_decaying_matrix() {
        let z = array![[-3.0, 1.0, 0.0], [-4.0, -0.5, 2.0], [0.1, 0.0, -6.0]];
        let phi = phi_functions(&z);
        let mut factorial = 1.0;
        for k in 0..4 {
            if k > 0 {
                factorial *= k as f64;
            }
            let right = z.dot(&phi[k + 1]) + Array2::<f64>::eye(3) / factorial;
            for (a, b) in phi[k].iter().zip(&right) {
                assert!((a - b).abs() < 1e-14, "phi_{k}: {a} and {b}");
            }
        }
    }
}
