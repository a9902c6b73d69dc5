//! What the sensors do to force and joint angles.

use crate::error::DeviceError;
use ndarray::Array2;
use ndof_models::Axis;
use serde::{Deserialize, Serialize};

/// What a sample stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Averaging {
    /// The mean of force and motion over the interval in which the command was held.
    #[default]
    Interval,
    /// The value just before the new command: the sampling trap, which biases the damping of a light limb.
    Instant,
}

/// Settings of the sensors; what is left out is the device's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensors {
    /// White noise of each force channel (N rms, N m rms).
    pub force_noise_rms: Option<f64>,
    /// Resolution of the force channels (N, N m); 0 for none.
    pub force_quantum: Option<f64>,
    /// Largest force that the transducer shows on an axis (N, N m); beyond, its channels stand still at the limit.
    pub force_range: Option<f64>,
    /// What the force channels show of the true forces, S F: cross-talk or a wrong calibration. One row and one column an axis, or 6 × 6 over
    /// F_x, F_y, F_z, M_x, M_y, M_z of a transducer of which the device's axes (x, y, z, or in their order) are some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_matrix: Option<Vec<Vec<f64>>>,
    /// A constant load on the transducer that moves nothing (N, N m), F_x … M_z: the weight of an arm. It shows through a 6 × 6 matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<[f64; 6]>,
    /// Bits of the encoders over a turn; 0 for ideal ones.
    pub encoder_bits: Option<u32>,
    /// What a sample stands for.
    pub averaging: Averaging,
}

/// Shares of the true forces in the channels, axes × axes, and what a load adds to each.
pub(crate) type ForceMap = (Array2<f64>, Vec<f64>);

impl Sensors {
    /// Encoder steps a turn: the device's own count unless bits are given, infinite for ideal encoders.
    pub fn encoder_counts(&self, own: f64) -> f64 {
        match self.encoder_bits {
            None => own,
            Some(0) => f64::INFINITY,
            Some(bits) => 2f64.powi(bits.min(64) as i32),
        }
    }

    /// What the force channels make of the true forces: S_a F + S_a· load, as the matrix and the constant; `None` where they show them as they are.
    ///
    /// # Errors
    /// [`DeviceError`] if the matrix is neither axes × axes nor 6 × 6, or holds what is no number.
    pub(crate) fn force_map(&self, axes: &[Axis]) -> Result<Option<ForceMap>, DeviceError> {
        let Some(rows) = &self.force_matrix else {
            return match self.load {
                Some(_) => Err(DeviceError::Missing("sensors.load shows only through a 6 × 6 sensors.force_matrix; give one".to_owned())),
                None => Ok(None),
            };
        };
        let (n, m) = (rows.len(), axes.len());
        if rows.iter().any(|row| row.len() != n) || (n != m && n != 6) {
            return Err(DeviceError::size("sensors.force_matrix", format!("{n} rows"), format!("{m} × {m} or 6 × 6 numbers")));
        }
        if let Some(v) = rows.iter().flatten().chain(self.load.iter().flatten()).find(|v| !v.is_finite()) {
            return Err(DeviceError::value("sensors.force_matrix or sensors.load", *v, "finite"));
        }
        // Where each axis stands among the transducer's six.
        let place = |k: usize| match axes[k].name.as_str() {
            _ if n == m => k,
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ if axes[k].rotational => 3 + k.min(2),
            _ => k.min(5),
        };
        let map = Array2::from_shape_fn((m, m), |(i, j)| rows[place(i)][place(j)]);
        let constant = (0..m).map(|i| self.load.map_or(0.0, |load| if n == 6 { load.iter().zip(&rows[place(i)]).map(|(l, s)| l * s).sum() } else { 0.0 }));
        Ok(Some((map, constant.collect())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_six_axis_matrix_shows_cross_talk_between_the_axes_and_the_weight_of_the_arm() {
        let mut matrix: Vec<Vec<f64>> = (0..6).map(|i| (0..6).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        (matrix[1][0], matrix[0][2]) = (0.02, 0.01);
        let sensors = Sensors { force_matrix: Some(matrix), load: Some([0.0, 0.0, -20.0, 0.0, 0.0, 0.0]), ..Sensors::default() };
        let (map, constant) = sensors.force_map(&[Axis::linear("x"), Axis::linear("y")]).expect("valid").expect("a matrix");
        assert_eq!(map, ndarray::arr2(&[[1.0, 0.0], [0.02, 1.0]]));
        assert_eq!(constant, [-0.2, 0.0]);
        let wrong = Sensors { force_matrix: Some(vec![vec![1.0; 3]; 3]), ..Sensors::default() };
        assert!(wrong.force_map(&[Axis::linear("x"), Axis::linear("y")]).unwrap_err().to_string().contains("6 × 6"));
    }
}
