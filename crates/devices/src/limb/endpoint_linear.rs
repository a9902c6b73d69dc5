//! A limb that is linear at the endpoint: M ẍ + B ẋ + K x + F₀ = F.

use super::{Impedance, Limb};
use crate::device::LimbEntry;
use crate::error::DeviceError;
use crate::noise::LimbNoise;
use crate::parameters::parameter;
use ndarray::Array2;
use ndof_linear::{inverse, is_positive_definite};
use serde::{Deserialize, Serialize};

/// The registry's entry.
pub(crate) static ENTRY: LimbEntry = LimbEntry {
    name: "endpoint-linear",
    description: "M, B, K at the endpoint, for any device",
    parameters: &[
        parameter("M", "kg", f64::NAN, "inertia matrix"),
        parameter("B", "N s/m", f64::NAN, "damping matrix"),
        parameter("K", "N/m", f64::NAN, "stiffness matrix"),
        parameter("mean_force_n", "N", 0.0, "force on the limb that holds it at the posture, one number an axis"),
        parameter("handle_mass_kg", "kg", 0.0, "mass fastened to the hand beyond the transducer"),
        parameter("noise", "", f64::NAN, "force made by the limb itself: rms_n, cutoff_hz"),
    ],
    source: "",
};

/// Matrices of a linear limb, rows in the order of the device's axes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the field's own letters, as the files write them")]
pub struct EndpointLinearConfig {
    /// Inertia (kg, kg m²), symmetric positive definite.
    pub M: Vec<Vec<f64>>,
    /// Damping (N s/m, N m s/rad).
    pub B: Vec<Vec<f64>>,
    /// Stiffness (N/m, N m/rad), the geometric part of the mean force included.
    pub K: Vec<Vec<f64>>,
    /// Force on the limb that holds it at the posture; zero where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_force_n: Option<Vec<f64>>,
    /// Mass fastened to the hand beyond the transducer, added to every diagonal entry of M (kg).
    #[serde(default)]
    pub handle_mass_kg: f64,
    /// Force that the limb makes by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<LimbNoise>,
}

/// The limb built from [`EndpointLinearConfig`].
#[derive(Clone, Debug)]
pub struct EndpointLinear {
    impedance: Impedance,
    mean_force: Vec<f64>,
    // Row-major M⁻¹, M⁻¹B and M⁻¹K: an acceleration is three products.
    mobility: Vec<f64>,
    damping: Vec<f64>,
    stiffness: Vec<f64>,
}

/// Reads a square matrix of `n` rows.
pub(super) fn square(name: &str, rows: &[Vec<f64>], n: usize) -> Result<Array2<f64>, DeviceError> {
    if rows.len() != n || rows.iter().any(|r| r.len() != n) {
        let lengths: Vec<String> = rows.iter().map(|r| r.len().to_string()).collect();
        return Err(DeviceError::size(format!("limb.{name}"), format!("rows of {} numbers", lengths.join(", ")), format!("{n} × {n}")));
    }
    let matrix = Array2::from_shape_fn((n, n), |(i, j)| rows[i][j]);
    match matrix.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(DeviceError::value(format!("an entry of limb.{name}"), *v, "finite")),
        None => Ok(matrix),
    }
}

/// The mean force on `n` axes, zero where it is not given.
pub(super) fn mean_force(values: Option<&[f64]>, n: usize) -> Result<Vec<f64>, DeviceError> {
    let Some(values) = values else { return Ok(vec![0.0; n]) };
    if values.len() != n {
        return Err(DeviceError::size("limb.mean_force_n", values.len(), n));
    }
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(DeviceError::value("an entry of limb.mean_force_n", *v, "finite")),
        None => Ok(values.to_vec()),
    }
}

impl EndpointLinear {
    /// The limb for a device with `axes` axes.
    ///
    /// # Errors
    /// [`DeviceError`] if a size does not fit or M is no inertia.
    pub fn new(config: &EndpointLinearConfig, axes: usize) -> Result<Self, DeviceError> {
        DeviceError::not_negative("limb.handle_mass_kg", config.handle_mass_kg)?;
        let impedance = Impedance {
            inertia: square("M", &config.M, axes)? + Array2::<f64>::eye(axes) * config.handle_mass_kg,
            damping: square("B", &config.B, axes)?,
            stiffness: square("K", &config.K, axes)?,
        };
        EndpointLinear::from_matrices(impedance, mean_force(config.mean_force_n.as_deref(), axes)?)
    }

    /// The limb with these matrices, all of one size, and mean force.
    ///
    /// # Errors
    /// [`DeviceError::Inertia`] if M is not symmetric positive definite.
    pub fn from_matrices(impedance: Impedance, mean_force: Vec<f64>) -> Result<Self, DeviceError> {
        let no_inertia = || DeviceError::Inertia("limb.M".to_owned());
        if !is_positive_definite(&impedance.inertia) {
            return Err(no_inertia());
        }
        let mobility = inverse(&impedance.inertia).ok_or_else(no_inertia)?;
        let flat = |a: Array2<f64>| a.iter().copied().collect::<Vec<_>>();
        let (damping, stiffness) = (flat(mobility.dot(&impedance.damping)), flat(mobility.dot(&impedance.stiffness)));
        Ok(EndpointLinear { mobility: flat(mobility), damping, stiffness, impedance, mean_force })
    }
}

impl EndpointLinear {
    /// For `n` axes, a constant to the compiler where it is written as such.
    #[inline(always)]
    fn accelerate(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64], n: usize) {
        let (x, v, force, mean, out) = (&x[..n], &v[..n], &force[..n], &self.mean_force[..n], &mut out[..n]);
        let (mobility, damping, stiffness) = (&self.mobility[..n * n], &self.damping[..n * n], &self.stiffness[..n * n]);
        for i in 0..n {
            let mut sum = 0.0;
            for j in 0..n {
                let k = i * n + j;
                sum += mobility[k] * (force[j] - mean[j]) - damping[k] * v[j] - stiffness[k] * x[j];
            }
            out[i] = sum;
        }
    }
}

impl Limb for EndpointLinear {
    fn mean_force(&self) -> &[f64] {
        &self.mean_force
    }

    fn acceleration(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64]) {
        match x.len() {
            2 => self.accelerate(x, v, force, out, 2),
            n => self.accelerate(x, v, force, out, n),
        }
    }

    fn linearised(&self) -> Impedance {
        self.impedance.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_linear::square::multiply;

    #[test]
    fn at_rest_under_its_mean_force_a_limb_stays() {
        let config = EndpointLinearConfig {
            M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
            B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
            K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
            mean_force_n: Some(vec![3.0, -1.0]),
            ..Default::default()
        };
        let limb = EndpointLinear::new(&config, 2).expect("valid");
        let mut a = [1.0; 2];
        limb.acceleration(&[0.0; 2], &[0.0; 2], &[3.0, -1.0], &mut a);
        assert_eq!(a, [0.0; 2]);
        // M ẍ = −K x − B v, so M times the acceleration gives the forces back.
        limb.acceleration(&[0.01, 0.0], &[0.0, 0.1], &[3.0, -1.0], &mut a);
        let mut force = [0.0; 2];
        multiply(&[2.1, -0.55, -0.55, 1.9], &a, &mut force);
        assert!((force[0] - (-3.0 + 0.2)).abs() < 1e-13 && (force[1] - (0.6 - 1.5)).abs() < 1e-13, "{force:?}");
    }

    #[test]
    fn what_is_no_inertia_is_refused() {
        let eye = vec![vec![1.0, 0.0], vec![0.0, 1.0]];
        let config = EndpointLinearConfig { M: vec![vec![1.0, 2.0], vec![2.0, 1.0]], B: eye.clone(), K: eye.clone(), ..Default::default() };
        assert!(matches!(EndpointLinear::new(&config, 2), Err(DeviceError::Inertia(_))));
        let config = EndpointLinearConfig { M: eye.clone(), B: eye.clone(), K: vec![vec![1.0]], ..Default::default() };
        assert!(EndpointLinear::new(&config, 2).unwrap_err().to_string().contains("limb.K"));
    }
}
