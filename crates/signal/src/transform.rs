//! Plans of Fourier transforms of any length.
//!
//! Their library is generic, and whoever makes a plan compiles all of it: only these three functions do.

use num_complex::Complex64;
pub use realfft::{ComplexToReal, RealToComplex};
pub(crate) use rustfft::Fft;
use std::cell::RefCell;
use std::sync::Arc;

/// Plans that each thread keeps for each direction: the lengths of a trial, of its mirrored samples, of a block and of one more.
const KEPT: usize = 4;
/// The longest that is kept, whose factors fill some MB: longer records are transformed a few times and not thousands of times.
const LONGEST: usize = 1 << 18;

/// Plans with their lengths, the one that was asked for last in front.
type Plans<T> = RefCell<Vec<(usize, Arc<T>)>>;

/// The plan of a length that a thread made lately, or else a new one; a plan costs as much as some transforms by it.
fn kept<T: ?Sized>(plans: &Plans<T>, samples: usize, plan: impl FnOnce() -> Arc<T>) -> Arc<T> {
    if samples > LONGEST {
        return plan();
    }
    let mut plans = plans.borrow_mut();
    let place = plans.iter().position(|(length, _)| *length == samples);
    let lately = place.map_or_else(|| (samples, plan()), |place| plans.remove(place));
    plans.truncate(KEPT - 1);
    plans.insert(0, lately.clone());
    lately.1
}

/// The transform X_k = Σ_n x_n e^(−2πjkn/N), k = 0 … N/2, of N = `samples` real numbers.
///
/// Its `process` overwrites the samples and allocates its scratch anew; `process_with_scratch` does not allocate.
///
/// ```
/// use ndof_signal::forward_transform;
///
/// let plan = forward_transform(4);
/// let mut lines = plan.make_output_vec();
/// plan.process(&mut [1.0, 0.0, -1.0, 0.0], &mut lines)?;
/// assert_eq!(lines.iter().map(|x| x.re).collect::<Vec<_>>(), [0.0, 2.0, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[inline(never)]
pub fn forward_transform(samples: usize) -> Arc<dyn RealToComplex<f64>> {
    thread_local!(static PLANS: Plans<dyn RealToComplex<f64>> = const { RefCell::new(vec![]) });
    PLANS.with(|plans| kept(plans, samples, || realfft::RealFftPlanner::new().plan_fft_forward(samples)))
}

/// The way back, x_n = Σ_k X_k e^(2πjkn/N) over all N lines, of which k = 0 … N/2 are given. It is not divided by N = `samples`: the forward
/// transform and this one make N times the samples.
#[inline(never)]
pub fn inverse_transform(samples: usize) -> Arc<dyn ComplexToReal<f64>> {
    thread_local!(static PLANS: Plans<dyn ComplexToReal<f64>> = const { RefCell::new(vec![]) });
    PLANS.with(|plans| kept(plans, samples, || realfft::RealFftPlanner::new().plan_fft_inverse(samples)))
}

/// The lines that a plan makes of samples, which it overwrites.
pub fn spectrum_by(plan: &dyn RealToComplex<f64>, samples: &mut [f64]) -> Vec<Complex64> {
    let mut spectrum = plan.make_output_vec();
    // Lengths are those of the plan, so the transform cannot refuse.
    let done = plan.process(samples, &mut spectrum);
    debug_assert!(done.is_ok());
    spectrum
}

/// The samples that a plan makes of lines, which it overwrites. Those of a real signal are real at 0 Hz and at half the rate: what they hold there of
/// an imaginary part is left out.
pub fn signal_by(plan: &dyn ComplexToReal<f64>, lines: &mut [Complex64]) -> Vec<f64> {
    lines[0].im = 0.0;
    if plan.len().is_multiple_of(2) {
        lines[plan.len() / 2].im = 0.0;
    }
    let mut samples = plan.make_output_vec();
    // Lengths are those of the plan, so the transform cannot refuse.
    let done = plan.process(lines, &mut samples);
    debug_assert!(done.is_ok());
    samples
}

/// The transform of `samples` complex numbers.
#[inline(never)]
pub(crate) fn complex_transform(samples: usize) -> Arc<dyn Fft<f64>> {
    rustfft::FftPlanner::new().plan_fft_forward(samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_few_plans_are_kept_and_long_ones_are_not() {
        let first = forward_transform(30);
        (31..30 + KEPT).for_each(|samples| drop(forward_transform(samples)));
        assert!(Arc::ptr_eq(&first, &forward_transform(30)));
        (31..=30 + KEPT).for_each(|samples| drop(forward_transform(samples)));
        assert!(!Arc::ptr_eq(&first, &forward_transform(30)) && forward_transform(30).len() == 30);
        let long = inverse_transform(LONGEST + 2);
        assert!(!Arc::ptr_eq(&long, &inverse_transform(LONGEST + 2)));
    }
}
