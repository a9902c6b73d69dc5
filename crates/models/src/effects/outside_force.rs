//! Forces from outside, which follow time whatever the motion does; as resisting forces they count negative.

use crate::force_law::{ForceLaw, Motion};

/// One force of time on some axes.
pub(super) struct Timed<F: Fn(f64) -> f64 + Send + Sync> {
    pub axes: Vec<usize>,
    pub force: F,
}

impl<F: Fn(f64) -> f64 + Send + Sync> ForceLaw for Timed<F> {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let own = (self.force)(motion.time_s);
        self.axes.iter().for_each(|axis| force[*axis] -= own);
    }
}

/// Samples of a force on some axes at a fixed rate, interpolated in between.
pub(super) struct Played {
    pub rate_hz: f64,
    /// Axis and its samples.
    pub tracks: Vec<(usize, Vec<f64>)>,
}

impl ForceLaw for Played {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let place = (motion.time_s * self.rate_hz).max(0.0);
        let (k, fraction) = (place.floor() as usize, place.fract());
        for (axis, samples) in &self.tracks {
            if let (Some(a), Some(b)) = (samples.get(k % samples.len()), samples.get((k + 1) % samples.len())) {
                force[*axis] -= a + fraction * (b - a);
            }
        }
    }
}
