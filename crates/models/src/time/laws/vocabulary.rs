//! The words in which a law is written.

pub(super) use crate::blocks::parameter::{force, length, stribeck};
pub(super) use crate::blocks::{Block, BlockParameter};
pub(super) use crate::time::jet::Real;
pub(super) use crate::time::{Equation, Local};
pub(super) use num_complex::Complex64;
pub(super) use std::f64::consts::TAU;

/// z₁ follows a drive through ω² / (s² + 2 ζ ω s + ω²), of ω and ζ.
pub(super) fn second_order<R: Real>(drive: R, [omega, damping_ratio]: [R; 2], states: &[R], rates: &mut [R]) {
    rates[0] = states[1];
    rates[1] = omega * (omega * (drive - states[0]) - damping_ratio * states[1].times(2.0));
}
