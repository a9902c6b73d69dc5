//! What Welch's method prepares once for its settings.

use super::Welch;
use super::sum::Sum;
use super::windowed::WindowedTransform;
use crate::cache::Cache;
use crate::cross_spectra::Kernel;
use crate::segments::Detrend;
use crate::window::Window;
use num_complex::Complex64;
use std::convert::Infallible;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

/// Window, transform and what follows from them.
pub(super) struct Plan {
    pub(super) transform: WindowedTransform,
    /// Σ w².
    pub(super) power: f64,
    /// Σ w⁴ / (Σ w²)².
    pub(super) spacing: f64,
    /// |W|² at multiples of a sixteenth of a bin, from 0.
    half_kernel: Vec<f64>,
    /// Buffers of earlier calls, drained: fresh memory costs as much as a short analysis.
    spare: Mutex<Vec<Sum>>,
}

#[derive(PartialEq)]
struct Key {
    nperseg: usize,
    nfft: usize,
    window: Window,
    symmetric: bool,
    detrend: Detrend,
}

static PLANS: Cache<Key, Plan> = Cache::new();

impl Plan {
    pub(super) fn of(settings: &Welch) -> Arc<Self> {
        let &Welch { nperseg, nfft, window, window_symmetric: symmetric, detrend, .. } = settings;
        let Ok(plan) = PLANS.get_or_try_make(Key { nperseg, nfft, window, symmetric, detrend }, || Ok::<_, Infallible>(Plan::new(settings)));
        plan
    }

    fn new(settings: &Welch) -> Self {
        let window = settings.window.samples(settings.nperseg, settings.window_symmetric);
        let power: f64 = window.iter().map(|w| w * w).sum();
        Plan {
            power,
            spacing: window.iter().map(|w| w.powi(4)).sum::<f64>() / (power * power),
            half_kernel: half_kernel(&window),
            transform: WindowedTransform::new(window, settings.detrend, settings.nfft),
            spare: Mutex::new(Vec::new()),
        }
    }

    /// What makes one-sided densities of sums over `segments`.
    pub(super) fn scale(&self, sample_rate_hz: f64, segments: usize) -> f64 {
        2.0 / (segments as f64 * sample_rate_hz * self.power)
    }

    /// Sums of nothing yet for `count` workers.
    pub(super) fn take_sums(&self, channels: usize, count: usize) -> Vec<Sum> {
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        spare.retain(|sum| sum.channels() == channels);
        let left = spare.len().saturating_sub(count);
        let mut sums = spare.split_off(left);
        drop(spare);
        sums.resize_with(count, || Sum::new(&self.transform, channels));
        sums
    }

    /// Takes drained sums back for the next call, as many as there are threads and none of unusual size.
    pub(super) fn give_back(&self, sums: Vec<Sum>) {
        const MOST_BYTES: usize = 32 << 20;
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        spare.extend(sums.into_iter().filter(|sum| sum.bytes() <= MOST_BYTES));
        spare.truncate(rayon::current_num_threads());
    }

    pub(super) fn kernel(&self, sample_rate_hz: f64) -> Kernel {
        let step_hz = sample_rate_hz / (self.transform.window.len() * FINENESS) as f64;
        Kernel::of_half(&self.half_kernel, step_hz)
    }
}

/// Kernel nodes in a bin.
const FINENESS: usize = 16;

/// |W(ν)|² on a grid of a sixteenth of a bin, out to eight bins (for Hann, all but 1e-7 of the power).
fn half_kernel(window: &[f64]) -> Vec<f64> {
    const REACH_BINS: usize = 8;
    /// Samples over which the turning factor is multiplied up, before it is taken afresh.
    const STRETCH: usize = 256;
    /// Nodes side by side: one product would wait for the one before.
    const SIDE_BY_SIDE: usize = 8;
    let n = window.len();
    let nodes = 1 + (REACH_BINS * FINENESS).min(n * FINENESS / 2);
    let of = |first: usize| -> [f64; SIDE_BY_SIDE] {
        let turns: [f64; SIDE_BY_SIDE] = std::array::from_fn(|k| TAU * (first + k) as f64 / (n * FINENESS) as f64);
        let steps = turns.map(|turn| Complex64::cis(-turn));
        let mut totals = [Complex64::default(); SIDE_BY_SIDE];
        for (i, stretch) in window.chunks(STRETCH).enumerate() {
            let mut factors = turns.map(|turn| Complex64::cis(-turn * (i * STRETCH) as f64));
            let mut sums = [Complex64::default(); SIDE_BY_SIDE];
            for w in stretch {
                for ((sum, factor), step) in sums.iter_mut().zip(&mut factors).zip(&steps) {
                    *sum += *factor * w;
                    *factor *= step;
                }
            }
            totals.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
        }
        totals.map(|total| total.norm_sqr())
    };
    (0..nodes).step_by(SIDE_BY_SIDE).flat_map(of).take(nodes).collect()
}
