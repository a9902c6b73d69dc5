//! The words in which a law is written.

pub(super) use crate::blocks::{Block, BlockParameter};
pub(super) use crate::time::jet::Real;
pub(super) use crate::time::{Equation, Local};
pub(super) use num_complex::Complex64;
pub(super) use std::f64::consts::TAU;

/// `stem_n`, `stem_n_per_m3` and the like with their units; `per` is the power of the motion.
pub(super) fn mechanical(rotational: bool, stem: &str, per: u8) -> (String, String) {
    let (effort, motion) = if rotational { ("nm", "rad") } else { ("n", "m") };
    let (effort_unit, motion_unit) = if rotational { ("N m", "rad") } else { ("N", "m") };
    match per {
        0 => (format!("{stem}_{effort}"), effort_unit.to_owned()),
        1 => (format!("{stem}_{effort}_per_{motion}"), format!("{effort_unit}/{motion_unit}")),
        _ => (format!("{stem}_{effort}_per_{motion}{per}"), format!("{effort_unit}/{motion_unit}^{per}")),
    }
}

/// `stem_m` or `stem_rad`.
pub(super) fn length(rotational: bool, stem: &str) -> (String, String) {
    let unit = if rotational { "rad" } else { "m" };
    (format!("{stem}_{unit}"), unit.to_owned())
}

/// `stem_m_per_s` or `stem_rad_per_s`.
pub(super) fn speed(rotational: bool, stem: &str) -> (String, String) {
    let unit = if rotational { "rad" } else { "m" };
    (format!("{stem}_{unit}_per_s"), format!("{unit}/s"))
}
