//! Efforts that are counted against the motion along their axis.

use super::pairs::{FEWEST, coherence, telling};
use super::result::Finding;
use crate::trials::roles::{Roles, axis_of};
use ndof_signal::{Channel, CrossSpectra};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Standard errors below zero at which a sign is no chance: once in 1000, one-sided, for each of two numbers.
const BEYOND: f64 = 3.1;

/// Share of the velocity's power up to which lines are looked at: beyond, there is inertia alone, and a sample's delay turns it round.
const MOVING: f64 = 0.9;

/// Inertia and damping of each axis by itself, the least squares of D = F/x ≈ K − M ω² + i B ω where the two are coherent; where both are below zero, the
/// effort seems to be counted against the motion. Of an axis that another drives, or of a limb that works by itself, only a fit of all axes tells.
pub(super) fn against(spectra: &CrossSpectra, channels: &[Channel], roles: &Roles, trial: usize) -> Vec<Finding> {
    let ports = &roles.ports;
    let all: Vec<(usize, Option<i32>)> =
        ports.inputs.iter().chain(&ports.outputs).copied().zip(roles.input_motion.iter().chain(&roles.output_motion).copied()).collect();
    let efforts = all.iter().filter(|(_, order)| order.is_none());
    let pairs = efforts.flat_map(|(effort, _)| all.iter().filter_map(move |(motion, order)| Some((*effort, *motion, (*order)?))));
    let own = pairs.filter(|(effort, motion, _)| axis_of(&channels[*effort].name) == axis_of(&channels[*motion].name));
    own.filter(|pair| pushes(spectra, *pair))
        .map(|(effort, motion, _)| {
            let (effort, motion) = (&channels[effort].name, &channels[motion].name);
            let message = format!("by {effort} and {motion} alone inertia and damping are below zero: the effort seems to be counted against the motion, or the limb moves the robot");
            let action = "turn one of them with `negate=CHANNEL` if that is how it was recorded; `ndof fit` tells by all axes together";
            Finding::new("force-sign", "remark", trial, Some(effort), message, action)
        })
        .collect()
}

/// Whether inertia and damping of the effort over the motion, differentiated so often, are both below zero beyond chance.
fn pushes(spectra: &CrossSpectra, (effort, motion, order): (usize, usize, i32)) -> bool {
    let hz = spectra.frequency_hz();
    let power = |f: usize| spectra.power(f, motion) * hz[f].powi(2 * (1 - order));
    let total: f64 = (1..hz.len()).map(power).sum();
    let mut below = 0.0;
    let slower = |f: &usize| {
        below += power(*f);
        below <= MOVING * total
    };
    let last = (1..hz.len()).take_while(slower).last().unwrap_or(0);
    let bins: Vec<usize> = telling(spectra, effort, motion).into_iter().filter(|f| *f <= last).collect();
    if bins.len() < FEWEST {
        return false;
    }
    let points: Vec<(f64, Complex64, f64)> = bins
        .into_iter()
        .map(|f| {
            let omega = TAU * hz[f];
            let stiffness = spectra.at(f, effort, motion) / spectra.power(f, motion) * Complex64::new(0.0, omega).powi(order);
            let coherence = coherence(spectra, f, effort, motion);
            (omega, stiffness, coherence / (stiffness.norm_sqr() * (1.0 - coherence).max(f64::EPSILON)))
        })
        .collect();
    let sum = |of: &dyn Fn(f64, Complex64) -> f64| points.iter().map(|(omega, d, weight)| weight * of(*omega, *d)).sum::<f64>();
    let (total, mean_square, mean) = (sum(&|_, _| 1.0), sum(&|w, _| w * w) / sum(&|_, _| 1.0), sum(&|_, d| d.re) / sum(&|_, _| 1.0));
    let (spread, power) = (sum(&|w, _| (w * w - mean_square).powi(2)), mean_square * total);
    let inertia = -sum(&|w, d| (w * w - mean_square) * (d.re - mean)) / spread;
    let damping = sum(&|w, d| w * d.im) / power;
    let left = sum(&|w, d| (d.re - mean + inertia * (w * w - mean_square)).powi(2) + (d.im - damping * w).powi(2));
    // Two numbers a line, less M, B and K.
    let variance = left / (2 * points.len() - 3) as f64;
    inertia < -BEYOND * (variance / spread).sqrt() && damping < -BEYOND * (variance / power).sqrt()
}
