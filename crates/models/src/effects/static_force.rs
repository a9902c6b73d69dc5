//! Forces that depend on where an axis is and on nothing else.

use crate::force_law::{ForceLaw, Motion};

/// A static force of one axis.
pub(super) struct Static<F: Fn(f64) -> f64 + Send + Sync> {
    pub axis: usize,
    pub force: F,
}

impl<F: Fn(f64) -> f64 + Send + Sync> ForceLaw for Static<F> {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        force[self.axis] += (self.force)(motion.position[self.axis]);
    }
}
