//! Pseudo-random binary sequences of maximum length.

use super::{ExcitationError, positive};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Exponents of a primitive polynomial over GF(2) for each order from 2 on, the order itself first
/// (e.g. x⁸ + x⁶ + x⁵ + x⁴ + 1); the tests run every one through its whole period.
const TAPS: [&[u32]; 19] = [
    &[2, 1],
    &[3, 2],
    &[4, 3],
    &[5, 3],
    &[6, 5],
    &[7, 6],
    &[8, 6, 5, 4],
    &[9, 5],
    &[10, 7],
    &[11, 9],
    &[12, 6, 4, 1],
    &[13, 4, 3, 1],
    &[14, 5, 3, 1],
    &[15, 14],
    &[16, 15, 13, 4],
    &[17, 14],
    &[18, 11],
    &[19, 6, 2, 1],
    &[20, 17],
];

/// A pseudo-random binary sequence: ± amplitude, with the autocorrelation 1 at 0 and −1/N elsewhere, N = 2^order − 1.
///
/// Several axes are the same sequence at starts N/q apart, so that over delays of less than N·hold/q samples they
/// correlate by no more than 1/N.
///
/// ```
/// use ndof_signal::Prbs;
/// let x = &Prbs { order: 5, amplitude: 2.0, ..Prbs::default() }.generate(1)?[0];
/// assert_eq!(x.len(), 31);
/// assert!((x.iter().sum::<f64>().abs() - 2.0).abs() < 1e-12);
/// # Ok::<(), ndof_signal::ExcitationError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Prbs {
    /// Number of signals.
    pub axes: usize,
    /// Length of the shift register, 2 to 20.
    pub order: usize,
    /// Samples that each bit is held; power reaches to about 0.44 × sample rate / hold.
    pub hold: usize,
    /// The signal is + or − this.
    pub amplitude: f64,
}

impl Default for Prbs {
    /// One axis, order 10, every bit held for one sample, ± 1.
    fn default() -> Self {
        Prbs { axes: 1, order: 10, hold: 1, amplitude: 1.0 }
    }
}

impl Prbs {
    /// Bits in a period; for orders that have a polynomial.
    fn bits(&self) -> usize {
        (1 << self.order) - 1
    }

    /// One period of every axis; the seed sets where the sequence begins.
    ///
    /// # Errors
    /// [`ExcitationError`] for an order outside of 2 to 20, or another setting that makes no sense.
    pub fn generate(&self, seed: u64) -> Result<Vec<Vec<f64>>, ExcitationError> {
        positive("amplitude", self.amplitude)?;
        positive("number of axes", self.axes as f64)?;
        positive("samples that a bit is held", self.hold as f64)?;
        let taps = self.order.checked_sub(2).and_then(|i| TAPS.get(i)).ok_or(ExcitationError::PrbsOrder(self.order))?;
        let start = ChaCha8Rng::seed_from_u64(seed).random_range(1..=self.bits() as u32);
        let bits: Vec<bool> = sequence(taps, start).take(self.bits()).collect();
        let level = |k: usize| if bits[k % bits.len()] { self.amplitude } else { -self.amplitude };
        Ok((0..self.axes).map(|axis| (0..bits.len() * self.hold).map(|n| level(n / self.hold + axis * bits.len() / self.axes)).collect()).collect())
    }
}

/// The output of a Fibonacci shift register.
fn sequence(taps: &'static [u32], start: u32) -> impl Iterator<Item = bool> {
    let order = taps[0];
    let mut register = start;
    std::iter::from_fn(move || {
        let next = taps.iter().fold(0, |bit, tap| bit ^ (register >> (order - tap))) & 1;
        let out = register & 1 == 1;
        register = (register >> 1) | (next << (order - 1));
        Some(out)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_order_runs_through_all_of_its_states() {
        for order in 2..=20_usize {
            let n = (1 << order) - 1;
            let bits: Vec<bool> = sequence(TAPS[order - 2], 1).take(n + order).collect();
            let mut seen = vec![false; n + 1];
            for window in bits.windows(order).take(n) {
                let state = window.iter().fold(0, |s, &b| (s << 1) | usize::from(b));
                assert!(!seen[state], "order {order} repeats a state");
                seen[state] = true;
            }
            assert!(!seen[0], "order {order} reaches the state of zeros");
        }
    }

    #[test]
    fn the_autocorrelation_has_two_values() {
        for order in [2, 5, 8, 9] {
            let x = &Prbs { order, ..Prbs::default() }.generate(7).expect("valid")[0];
            let n = x.len();
            for lag in 1..n {
                let r: f64 = (0..n).map(|k| x[k] * x[(k + lag) % n]).sum();
                assert_eq!(r, -1.0, "order {order}, lag {lag}");
            }
        }
    }

    #[test]
    fn axes_do_not_correlate_at_short_delays_and_bits_are_held() {
        let signals = Prbs { axes: 3, order: 8, hold: 2, ..Prbs::default() }.generate(7).expect("valid");
        assert_eq!(signals[0].len(), 510);
        assert!(signals[0].chunks(2).all(|pair| pair[0] == pair[1]));
        for delay in 0..160 {
            let r: f64 = (0..510).map(|k| signals[0][k] * signals[1][(k + delay) % 510]).sum();
            assert!(r.abs() <= 2.0, "{delay}: {r}");
        }
    }

    #[test]
    fn orders_without_a_polynomial_are_refused() {
        for order in [0, 1, 21, 64] {
            assert_eq!(Prbs { order, ..Prbs::default() }.generate(1).unwrap_err(), ExcitationError::PrbsOrder(order));
        }
    }
}
