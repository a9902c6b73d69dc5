//! What may be wrong with a log itself.

use crate::bodies::turned;
use crate::column::Column;
use crate::scene::Scene;

/// What is taken off a log before it is compared.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Logged {
    /// How late each torque is logged (s).
    pub late_s: Vec<f64>,
    /// How many times too large it is, and all of them are beside that.
    pub gain: Vec<f64>,
    pub common: f64,
    /// How far the zero of each angle is off (rad).
    pub zero: Vec<f64>,
    /// How the base is turned: axis times angle (rad).
    pub tilt: [f64; 3],
}

impl Logged {
    pub fn as_it_is(joints: usize) -> Self {
        Logged { late_s: vec![0.0; joints], gain: vec![1.0; joints], common: 1.0, zero: vec![0.0; joints], tilt: [0.0; 3] }
    }

    /// How many times too large the torque of a joint is in all.
    pub fn gain_of(&self, joint: usize) -> f64 {
        self.gain[joint] * self.common
    }

    /// The correction whose line a column is, along which it is fitted; none of what is wrong with the robot.
    pub fn of(&self, column: &Column) -> Option<f64> {
        self.clone().at(column).map(|correction| *correction)
    }

    /// Sets the correction whose line a column is.
    pub fn set(&mut self, column: &Column, value: f64) {
        if let Some(correction) = self.at(column) {
            *correction = value;
        }
    }

    /// Takes the correction whose line a column is back.
    pub fn put_back(&mut self, column: &Column) {
        let none = Logged::as_it_is(self.gain.len()).of(column);
        none.into_iter().for_each(|none| self.set(column, none));
    }

    fn at(&mut self, column: &Column) -> Option<&mut f64> {
        match column {
            Column::Falling(j) => Some(&mut self.late_s[*j]),
            Column::Torque(j) => Some(&mut self.gain[*j]),
            Column::Torques => Some(&mut self.common),
            Column::Zero { joint, .. } => Some(&mut self.zero[*joint]),
            Column::Tilt { axis, .. } => Some(&mut self.tilt[*axis]),
            _ => None,
        }
    }

    /// What it is once so much of a column is found beside it: a torque is that much of itself larger, all else is added.
    pub fn beyond(&self, column: &Column, factor: f64) -> Option<f64> {
        self.of(column).map(|now| if matches!(column, Column::Torque(_) | Column::Torques) { now * (1.0 + factor) } else { now + factor })
    }

    /// What bodies need more along a motion whose base and angles are corrected, as columns with their factors.
    pub fn columns(&self, scene: &Scene<'_>) -> Vec<(f64, Column)> {
        let weights = turned(scene.chain.gravity(), &self.tilt).into_iter().enumerate().filter(|(_, g)| *g != 0.0);
        let weights = weights.map(|(k, g)| (g, Column::upright(k)));
        let zeros = self.zero.iter().any(|zero| *zero != 0.0).then(|| (1.0, Column::Zeros(self.zero.clone())));
        weights.chain(zeros).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_the_line_of_its_own_correction() {
        let mut logged = Logged::as_it_is(2);
        for (column, found, then) in [
            (Column::Falling(0), 0.002, 0.003),
            (Column::Torque(1), 0.1, 1.21),
            (Column::Torques, 0.1, 1.21),
            (Column::Zero { joint: 1, at: 0.0 }, 0.05, 0.06),
            (Column::Tilt { axis: 2, at: [0.0; 3] }, -0.02, -0.01),
        ] {
            let untouched = logged.clone();
            logged.set(&column, logged.beyond(&column, found).expect("a correction"));
            // A tenth more of a torque that is a tenth too large, and a hundredth or a thousandth more of all else.
            let more = if then == 1.21 { 0.1 } else { then - found };
            assert!((logged.beyond(&column, more).expect("a correction") - then).abs() < 1e-12, "{column:?}");
            logged.put_back(&column);
            assert_eq!(logged, untouched, "{column:?}");
        }
        assert_eq!((logged.of(&Column::Velocity(0)), logged.beyond(&Column::Constant(1), 1.0)), (None, None));
    }
}
