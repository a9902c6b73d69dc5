//! The words in which a law is written.

pub(super) use crate::blocks::parameter::{force, length, stribeck};
pub(super) use crate::blocks::{Block, BlockParameter};
pub(super) use crate::time::jet::Real;
pub(super) use crate::time::{Equation, Local};
pub(super) use num_complex::Complex64;
pub(super) use std::f64::consts::TAU;
