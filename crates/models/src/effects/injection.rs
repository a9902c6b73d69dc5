//! How a simulation hides an effect.

use super::card::Card;
use super::parameters::EffectError;
use crate::force_law::{ForceLaw, Stage};

/// What a simulation knows when it hides an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Number of axes.
    pub axes: usize,
    /// The axis that the effect acts on; `None` for all.
    pub axis: Option<usize>,
    /// Inertia of the plant.
    pub mass: Vec<Vec<f64>>,
    /// Stiffness of the plant.
    pub stiffness: Vec<Vec<f64>>,
    /// Length of the recording.
    pub duration_s: f64,
    /// Sample rate of the channel that a stage sits in.
    pub sample_rate_hz: f64,
    /// Seed of anything random.
    pub seed: u64,
}

impl Setting {
    /// The axes that the effect acts on.
    pub fn sites(&self) -> Vec<usize> {
        self.axis.map_or_else(|| (0..self.axes).collect(), |axis| vec![axis])
    }

    /// The axis, for an effect that acts on one.
    pub(super) fn one_axis(&self, effect: &Card) -> Result<usize, EffectError> {
        self.axis.ok_or(EffectError::Setting { effect: effect.name, what: "an axis" })
    }

    /// The entry `axis`, `axis` of a matrix, 0 where it is not given.
    pub(crate) fn diagonal(matrix: &[Vec<f64>], axis: usize) -> f64 {
        matrix.get(axis).and_then(|row| row.get(axis)).copied().unwrap_or(0.0)
    }
}

/// What a simulation has to do to hide an effect.
pub enum Injection {
    /// Add a resisting force to the plant.
    Force(Box<dyn ForceLaw>),
    /// Put a stage into one channel (named by the parameter `channel`, else every channel of the effect's side).
    Stage(Box<dyn Stage>),
    /// Add this inertia to every axis of the effect.
    Mass(f64),
    /// Mix the measured effort channels by this matrix.
    Mixing(Vec<Vec<f64>>),
    /// Set the plant's parameter of this name to this value.
    Parameter {
        /// Its name.
        name: String,
        /// Its true value.
        value: f64,
    },
}
