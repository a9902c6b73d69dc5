//! Forces from outside, which follow time whatever the motion does; as resisting forces they count negative.

use crate::force_law::{ForceLaw, Motion};

/// One force of time on some axes.
pub(super) fn timed(axes: Vec<usize>, of: impl Fn(f64) -> f64 + Send + Sync) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| {
        let own = of(motion.time_s);
        axes.iter().for_each(|axis| force[*axis] -= own);
    }
}

/// Samples of a force at a fixed rate, interpolated in between: of some axes, each with its own.
pub(super) fn played(rate_hz: f64, tracks: Vec<(usize, Vec<f64>)>) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| {
        let place = (motion.time_s * rate_hz).max(0.0);
        let (k, fraction) = (place.floor() as usize, place.fract());
        for (axis, samples) in &tracks {
            if let (Some(a), Some(b)) = (samples.get(k % samples.len()), samples.get((k + 1) % samples.len())) {
                force[*axis] -= a + fraction * (b - a);
            }
        }
    }
}
