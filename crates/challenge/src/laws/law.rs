//! A law, and the limb that it acts in.

/// States that a law may have.
pub const STATES: usize = 12;

/// One law acting on one axis.
#[derive(Clone, Default)]
pub struct Law {
    pub kind: &'static str,
    /// Its functional form; empty is the registry's.
    pub form: &'static str,
    pub p: [f64; 6],
    /// The axis that a product takes its other factor from.
    pub from: usize,
    /// Times at which it is switched, in turn on and off, over all trials one after the other.
    pub schedule: Vec<f64>,
}

impl Law {
    /// One of the registry's form with these numbers first.
    pub fn new(kind: &'static str, numbers: &[f64]) -> Self {
        let mut law = Law { kind, ..Law::default() };
        law.p[..numbers.len()].copy_from_slice(numbers);
        law
    }
}

/// What a law sees of the limb at an instant.
#[derive(Clone, Copy)]
pub struct Now<'a> {
    /// Time since the trial's beginning.
    pub t: f64,
    pub x: f64,
    pub v: f64,
    /// Displacement and velocity a reflex's delay ago.
    pub back: (f64, f64),
    /// Displacement of all axes.
    pub all: &'a [f64],
}

/// The limb with everything that is hidden in it.
#[derive(Clone)]
pub struct World {
    pub n: usize,
    pub axis: usize,
    pub m_inv: Vec<Vec<f64>>,
    pub b: Vec<Vec<f64>>,
    pub k: Vec<Vec<f64>>,
    pub laws: Vec<Law>,
    pub delay_steps: usize,
    pub duration: f64,
    /// A typical displacement and velocity of the axis.
    pub x_size: f64,
    pub v_size: f64,
    /// Number of the trial.
    pub trial: usize,
}
