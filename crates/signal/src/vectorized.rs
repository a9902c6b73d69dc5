//! Loops for the vector unit of the machine that runs them.

use pulp::WithSimd;

/// Runs loops that the compiler makes vectors of by itself, compiled for the vector unit at hand.
///
/// A program for browsers has the vectors that all of them have throughout, so there each loop stands once.
///
/// ```
/// struct Sum<'a>(&'a [f64]);
/// impl pulp::WithSimd for Sum<'_> {
///     type Output = f64;
///     #[inline(always)]
///     fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
///         self.0.iter().sum()
///     }
/// }
/// assert_eq!(ndof_signal::vectorized(Sum(&[1.0, 2.0])), 3.0);
/// ```
#[inline]
pub fn vectorized<W: WithSimd>(work: W) -> W::Output {
    if cfg!(target_family = "wasm") { work.with_simd(pulp::Scalar) } else { pulp::Arch::new().dispatch(work) }
}
