//! Entries of a matrix that follow a schedule: the phase of a cycle, a posture, an activation, or time.

use super::card::plain;
use super::{Action, Card, EffectError, Form, Injection, Matrix, ParameterCard, Parameters, Scale, Setting, Side, Sign, require_known};
use crate::force_law::{ForceLaw, Motion};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

pub(super) const CYCLE: ParameterCard = plain("cycle_s", "s", 1e-3, 1e6, None);

/// Numbers of waves that a search tries, and what they are called: the score decides how fine a curve the data support.
const SIZES: [(usize, &str); 4] = [(2, "a curve of 2 waves"), (4, "a curve of 4 waves"), (8, "a curve of 8 waves"), (16, "a curve of 16 waves")];
/// With more axes the curves of all entries together are too many to be tried.
const MOST_AXES: usize = 3;
/// Most waves of each entry where all entries follow the schedule.
const TOGETHER: usize = 8;

/// A curve about zero over u from 0 to 1: cos 2πu, sin 2πu, cos 4πu … over a cycle, else cos πu, cos 2πu … from end to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Waves {
    /// How many.
    pub count: usize,
    /// Whether the end is the beginning.
    pub closed: bool,
}

impl Waves {
    /// Wave `k` at `u`.
    pub fn at(self, k: usize, u: f64) -> f64 {
        match (self.closed, k % 2) {
            (false, _) => (PI * (k + 1) as f64 * u).cos(),
            (true, 0) => (TAU * (k / 2 + 1) as f64 * u).cos(),
            (true, _) => (TAU * (k / 2 + 1) as f64 * u).sin(),
        }
    }

    /// The curve with these coefficients at `u`.
    pub fn sum(self, coefficients: &[f64], u: f64) -> f64 {
        coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0).map(|(k, c)| c * self.at(k, u)).sum()
    }
}

/// Entries of a matrix that follow the schedule about the value that the baseline gives them.
#[derive(Clone, Debug, PartialEq)]
pub struct ScheduledMatrix {
    /// Which matrix: stiffness or damping.
    pub matrix: Matrix,
    /// Places of each entry: two where the matrix is symmetric.
    pub entries: Vec<Vec<(usize, usize)>>,
    /// The curve of each entry.
    pub waves: Waves,
}

impl ScheduledMatrix {
    /// The force law with these coefficients, those of one entry side by side.
    pub fn law(&self, coefficients: &[f64]) -> Box<dyn ForceLaw> {
        Box::new(Follows { of: self.clone(), coefficients: coefficients.to_vec() })
    }

    /// The curve of an entry at `u`, its mean left out.
    pub fn curve(&self, coefficients: &[f64], entry: usize, u: f64) -> f64 {
        self.waves.sum(&coefficients[entry * self.waves.count..(entry + 1) * self.waves.count], u)
    }
}

/// f_i = κ(s) x_j, or κ(s) ẋ_j.
struct Follows {
    of: ScheduledMatrix,
    coefficients: Vec<f64>,
}

impl ForceLaw for Follows {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let of = if self.of.matrix == Matrix::Damping { motion.velocity } else { motion.position };
        for (entry, places) in self.of.entries.iter().enumerate().filter(|_| motion.schedule.is_finite()) {
            let value = self.of.curve(&self.coefficients, entry, motion.schedule);
            places.iter().filter(|_| value != 0.0).for_each(|(i, j)| force[*i] += value * of[*j]);
        }
    }
}

/// f = swing cos(2π t / cycle) x, or ẋ: what a simulation, which knows time alone, hides.
struct ByClock {
    matrix: Matrix,
    turn: f64,
    swing: f64,
    axes: Vec<usize>,
}

impl ForceLaw for ByClock {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let of = if self.matrix == Matrix::Damping { motion.velocity } else { motion.position };
        let swing = self.swing * (self.turn * motion.time_s).cos();
        self.axes.iter().for_each(|axis| force[*axis] += swing * of[*axis]);
    }
}

/// A force that a simulation hides.
pub(super) fn inject(card: &'static Card, matrix: Matrix, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    require_known(card, parameters)?;
    let turn = TAU / parameters.number(card.name, &CYCLE)?;
    let swing = parameters.number(card.name, &card.parameters[0])?;
    Ok(Injection::Force(Box::new(ByClock { matrix, turn, swing, axes: setting.sites() })))
}

/// Curves of each axis by itself, and of all entries of the symmetric matrix together.
pub(super) fn forms(matrix: Matrix, scale: &Scale) -> Vec<Form> {
    let Some(closed) = scale.closed_schedule else { return Vec::new() };
    let n = scale.axes();
    let of = |axis: Option<usize>, entries: Vec<Vec<(usize, usize)>>, (count, label): (usize, &'static str)| Form {
        label,
        side: Side::Limb,
        axis,
        knobs: vec![],
        grid: vec![vec![]],
        signs: vec![Sign::Free; count * entries.len()],
        action: Action::Scheduled(ScheduledMatrix { matrix, entries, waves: Waves { count, closed } }),
        naming: Arc::new(|_, _| Vec::new()),
        floor: (0.0, 0.0),
    };
    let each = (0..n).flat_map(|axis| SIZES.map(|size| of(Some(axis), vec![vec![(axis, axis)]], size)));
    let mirrored = |i: usize, j: usize| if i == j { vec![(i, i)] } else { vec![(i, j), (j, i)] };
    let whole: Vec<Vec<(usize, usize)>> = (0..n).flat_map(|i| (i..n).map(move |j| mirrored(i, j))).collect();
    let together = SIZES.iter().filter(|size| (2..=MOST_AXES).contains(&n) && size.0 <= TOGETHER).map(|size| of(None, whole.clone(), *size));
    each.chain(together).collect()
}
