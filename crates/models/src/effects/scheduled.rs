//! Entries of a matrix that follow a schedule: the phase of a cycle, a posture, an activation, or time.

use super::vocabulary::*;
use super::waves::{ScheduledMatrix, Waves};
use std::f64::consts::TAU;

pub(super) const CYCLE: ParameterCard = plain("cycle_s", "s", 1e-3, 1e6, None);

/// Numbers of waves that a search tries, and what they are called: the score decides how fine a curve the data support.
const SIZES: [(usize, &str); 4] = [(2, "a curve of 2 waves"), (4, "a curve of 4 waves"), (8, "a curve of 8 waves"), (16, "a curve of 16 waves")];
/// With more axes the curves of all entries together are too many to be tried.
const MOST_AXES: usize = 3;
/// Most waves of each entry where all entries follow the schedule.
const TOGETHER: usize = 8;

/// What a simulation, which knows time alone, hides: f = swing cos(2π t / cycle) x, or ẋ.
pub(super) fn inject(card: &'static Card, matrix: Matrix, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let turn = TAU / parameters.number(card.name, &CYCLE)?;
    let swing = parameters.number(card.name, &card.parameters[0])?;
    let axes = setting.sites();
    Ok(Injection::Force(Box::new(move |motion: &Motion<'_>, force: &mut [f64]| {
        let of = if matrix == Matrix::Damping { motion.velocity } else { motion.position };
        let swing = swing * (turn * motion.time_s).cos();
        axes.iter().for_each(|axis| force[*axis] += swing * of[*axis]);
    })))
}

/// Curves of each axis by itself, and of all entries of the symmetric matrix together.
pub(super) fn forms(matrix: Matrix, scale: &Scale) -> Vec<Form> {
    let Some(closed) = scale.closed_schedule else { return Vec::new() };
    let n = scale.axes();
    let of = |axis: Option<usize>, entries: Vec<Vec<(usize, usize)>>, (count, label): (usize, &'static str)| {
        let signs = vec![Sign::Free; count * entries.len()];
        Form::new(label, axis, Action::Scheduled(ScheduledMatrix { matrix, entries, waves: Waves { count, closed } })).coefficients(signs).floor(0.0)
    };
    let each = (0..n).flat_map(|axis| SIZES.map(|size| of(Some(axis), vec![vec![(axis, axis)]], size)));
    let mirrored = |i: usize, j: usize| if i == j { vec![(i, i)] } else { vec![(i, j), (j, i)] };
    let whole: Vec<Vec<(usize, usize)>> = (0..n).flat_map(|i| (i..n).map(move |j| mirrored(i, j))).collect();
    let together = SIZES.iter().filter(|size| (2..=MOST_AXES).contains(&n) && size.0 <= TOGETHER).map(|size| of(None, whole.clone(), *size));
    each.chain(together).collect()
}
