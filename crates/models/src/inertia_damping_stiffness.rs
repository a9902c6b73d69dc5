//! The baseline of everything: M ẍ + B ẋ + K x = F for N axes.

use crate::parametric::response_of;
use crate::{Axis, ParameterInfo, ParametricModel};
use ndarray::{Array1, Array2};
use ndof_linear::symmetric_eigen;
use ndof_sysid::{FrequencyResponse, ResponseKind};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Inertia, damping and stiffness of N axes: D(s) = M s² + B s + K.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InertiaDampingStiffness {
    /// The axes, in the order of rows and columns.
    pub axes: Vec<Axis>,
    /// M (N s²/m, N m s²/rad).
    pub inertia: Array2<f64>,
    /// B (N s/m, N m s/rad).
    pub damping: Array2<f64>,
    /// K (N/m, N m/rad).
    pub stiffness: Array2<f64>,
}

impl InertiaDampingStiffness {
    /// D(s) = M s² + B s + K.
    pub fn dynamic_stiffness(&self, s: Complex64) -> Array2<Complex64> {
        let mut d = self.stiffness.mapv(Complex64::from);
        d.zip_mut_with(&self.damping, |d, b| *d += s * *b);
        d.zip_mut_with(&self.inertia, |d, m| *d += s * s * *m);
        d
    }

    /// The response of the given kind on a grid; NaN where it does not exist (an impedance at 0 Hz).
    /// [`ResponseKind::Transfer`] gives compliance.
    ///
    /// ```
    /// use ndof_models::{Axis, InertiaDampingStiffness};
    /// use ndof_sysid::ResponseKind;
    /// use ndarray::arr2;
    /// let wheel = InertiaDampingStiffness {
    ///     axes: vec![Axis::rotational("wheel")],
    ///     inertia: arr2(&[[0.5]]),
    ///     damping: arr2(&[[2.0]]),
    ///     stiffness: arr2(&[[8.0]]),
    /// };
    /// let d = wheel.response(&[0.0, 1.0], ResponseKind::DynamicStiffness);
    /// assert_eq!(d.value[[0, 0, 0]].re, 8.0);
    /// ```
    pub fn response(&self, frequency_hz: &[f64], kind: ResponseKind) -> FrequencyResponse {
        response_of(&self.axes, frequency_hz, kind, |s| self.dynamic_stiffness(s).into_iter().collect())
    }
}

/// What is known of the matrices before a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Symmetry {
    /// M, B and K equal their transposes: a passive mechanical system.
    #[default]
    Symmetric,
    /// Every entry is free; the antisymmetric part tells of active forces or a turned sensor.
    Free,
    /// Symmetric without negative eigenvalues.
    PositiveSemidefinite,
}

/// [`InertiaDampingStiffness`] as a model with free parameters, matrix after matrix M, B, K; row by row, upper
/// triangle only unless [`Symmetry::Free`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InertiaDampingStiffnessModel {
    axes: Vec<Axis>,
    symmetry: Symmetry,
    entries: Vec<(usize, usize)>,
}

impl InertiaDampingStiffnessModel {
    /// A model of the given axes.
    pub fn new(axes: Vec<Axis>, symmetry: Symmetry) -> Self {
        let n = axes.len();
        let entries = (0..n).flat_map(|i| (if symmetry == Symmetry::Free { 0 } else { i }..n).map(move |j| (i, j))).collect();
        InertiaDampingStiffnessModel { axes, symmetry, entries }
    }

    /// What is assumed of the matrices.
    pub fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// Row and column of each parameter of one matrix.
    pub fn entries(&self) -> &[(usize, usize)] {
        &self.entries
    }

    /// The matrices of a parameter vector.
    pub fn matrices(&self, theta: &[f64]) -> InertiaDampingStiffness {
        let [inertia, damping, stiffness] = [0, 1, 2].map(|k| self.matrix(&theta[k * self.entries.len()..]));
        InertiaDampingStiffness { axes: self.axes.clone(), inertia, damping, stiffness }
    }

    /// One matrix from its entries; the same arrangement serves standard errors.
    pub fn matrix(&self, entries: &[f64]) -> Array2<f64> {
        let n = self.axes.len();
        let mut out = Array2::zeros((n, n));
        for (&(i, j), &v) in self.entries.iter().zip(entries) {
            out[[i, j]] = v;
            if self.symmetry != Symmetry::Free {
                out[[j, i]] = v;
            }
        }
        out
    }

    /// The parameter vector of matrices; symmetric parts where the model is symmetric.
    pub fn theta(&self, matrices: &InertiaDampingStiffness) -> Vec<f64> {
        let free = self.symmetry == Symmetry::Free;
        [&matrices.inertia, &matrices.damping, &matrices.stiffness]
            .into_iter()
            .flat_map(|m| self.entries.iter().map(move |&(i, j)| if free { m[[i, j]] } else { 0.5 * (m[[i, j]] + m[[j, i]]) }))
            .collect()
    }
}

/// Eigenvalues below this share of the largest are raised to it before a Cholesky factor is taken: at zero the factor
/// has no slope and a search would not leave.
const LEAST_EIGENVALUE: f64 = 1e-3;

impl InertiaDampingStiffnessModel {
    /// Where entry (i ≤ j) stands in the upper triangle, row by row. Factors are kept as their transposes, so that
    /// column `i` of L is row `i` of the triangle.
    fn at(&self, i: usize, j: usize) -> usize {
        i * self.axes.len() - i * (i + 1) / 2 + j
    }

    /// Cholesky factor of one matrix, made positive definite first.
    fn factor(&self, entries: &[f64]) -> Vec<f64> {
        let n = self.axes.len();
        let mut a = self.matrix(entries);
        if let Some((values, vectors)) = symmetric_eigen(&a) {
            let largest = values.iter().fold(f64::MIN_POSITIVE, |largest, v| largest.max(v.abs()));
            let raised: Array1<f64> = values.iter().map(|v| v.max(LEAST_EIGENVALUE * largest)).collect();
            a = vectors.dot(&Array2::from_diag(&raised)).dot(&vectors.t());
        }
        let mut out = vec![0.0; entries.len()];
        for j in 0..n {
            for i in 0..=j {
                let rest = a[[i, j]] - (0..i).map(|k| out[self.at(k, i)] * out[self.at(k, j)]).sum::<f64>();
                out[self.at(i, j)] = if i == j { rest.max(0.0).sqrt() } else { rest / out[self.at(i, i)] };
            }
        }
        out
    }
}

impl ParametricModel for InertiaDampingStiffnessModel {
    fn name(&self) -> &str {
        "inertia-damping-stiffness"
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn parameters(&self) -> Vec<ParameterInfo> {
        let single = self.axes.len() == 1;
        let mut out = Vec::with_capacity(3 * self.entries.len());
        for (matrix, rate) in [("M", 2), ("B", 1), ("K", 0)] {
            for &(i, j) in &self.entries {
                let (row, column) = (&self.axes[i], &self.axes[j]);
                out.push(ParameterInfo {
                    name: if single { matrix.to_owned() } else { format!("{matrix}_{}_{}", row.name, column.name) },
                    unit: row.unit_per(column, rate),
                    site: if i == j { row.name.clone() } else { format!("{},{}", row.name, column.name) },
                    lower: f64::NEG_INFINITY,
                    upper: f64::INFINITY,
                });
            }
        }
        out
    }

    fn scales(&self, theta: &[f64]) -> Vec<f64> {
        let of_matrix = |entries: &[f64]| {
            let matrix = self.matrix(entries);
            self.entries.iter().map(move |&(i, j)| (matrix[[i, i]] * matrix[[j, j]]).abs().sqrt())
        };
        theta.chunks_exact(self.entries.len()).flat_map(of_matrix).collect()
    }

    /// Entries of the Cholesky factors L of M = L Lᵀ, B and K for [`Symmetry::PositiveSemidefinite`].
    fn internal(&self, theta: &[f64]) -> Vec<f64> {
        if self.symmetry != Symmetry::PositiveSemidefinite {
            return theta.to_vec();
        }
        theta.chunks_exact(self.entries.len()).flat_map(|entries| self.factor(entries)).collect()
    }

    fn natural(&self, internal: &[f64]) -> Vec<f64> {
        if self.symmetry != Symmetry::PositiveSemidefinite {
            return internal.to_vec();
        }
        let dot = |l: &[f64], i: usize, j: usize| -> f64 { (0..=i.min(j)).map(|k| l[self.at(k, i)] * l[self.at(k, j)]).sum() };
        internal.chunks_exact(self.entries.len()).flat_map(|l| self.entries.iter().map(move |&(i, j)| dot(l, i, j))).collect()
    }

    fn natural_jacobian(&self, internal: &[f64]) -> Option<Array2<f64>> {
        if self.symmetry != Symmetry::PositiveSemidefinite {
            return None;
        }
        let per = self.entries.len();
        let mut out = Array2::zeros((internal.len(), internal.len()));
        for (block, l) in internal.chunks_exact(per).enumerate() {
            for (r, &(i, j)) in self.entries.iter().enumerate() {
                for k in 0..=i.min(j) {
                    out[[block * per + r, block * per + self.at(k, i)]] += l[self.at(k, j)];
                    out[[block * per + r, block * per + self.at(k, j)]] += l[self.at(k, i)];
                }
            }
        }
        Some(out)
    }

    fn stiffness(&self, theta: &[f64], s: Complex64, value: &mut [Complex64], derivative: Option<&mut [Complex64]>) {
        let (n, per) = (self.axes.len(), self.entries.len());
        let powers = [s * s, s, Complex64::new(1.0, 0.0)];
        let mirror = self.symmetry != Symmetry::Free;
        value.fill(Complex64::default());
        for (k, power) in powers.iter().enumerate() {
            for (&(i, j), &v) in self.entries.iter().zip(&theta[k * per..]) {
                value[i * n + j] += power * v;
                if mirror && i != j {
                    value[j * n + i] += power * v;
                }
            }
        }
        if let Some(out) = derivative {
            out.fill(Complex64::default());
            for (k, block) in out.chunks_exact_mut(n * n).enumerate() {
                let (i, j) = self.entries[k % per];
                block[i * n + j] = powers[k / per];
                if mirror {
                    block[j * n + i] = powers[k / per];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{arm, difference};

    #[test]
    fn parameters_carry_their_entry_and_unit() {
        let names: Vec<(String, String)> =
            InertiaDampingStiffnessModel::new(arm().axes, Symmetry::Symmetric).parameters().into_iter().map(|p| (p.name, p.unit)).collect();
        assert_eq!(names.len(), 9);
        assert_eq!(names[1], ("M_x_y".to_owned(), "N s^2/m".to_owned()));
        assert_eq!(names[8], ("K_y_y".to_owned(), "N/m".to_owned()));
        let single = InertiaDampingStiffnessModel::new(vec![Axis::rotational("ankle")], Symmetry::Free).parameters();
        assert_eq!((single[2].name.as_str(), single[2].unit.as_str()), ("K", "N m/rad"));
    }

    #[test]
    fn vector_and_matrices_are_two_forms_of_one_thing() {
        for symmetry in [Symmetry::Symmetric, Symmetry::Free] {
            let model = InertiaDampingStiffnessModel::new(arm().axes, symmetry);
            assert_eq!(model.matrices(&model.theta(&arm())), arm());
        }
    }

    #[test]
    fn derivatives_are_those_of_a_function_linear_in_its_parameters() {
        let mut turned = arm();
        turned.stiffness[[0, 1]] = 35.0;
        for symmetry in [Symmetry::Symmetric, Symmetry::Free] {
            let model = InertiaDampingStiffnessModel::new(arm().axes, symmetry);
            let (theta, s) = (model.theta(&turned), Complex64::new(0.3, 9.0));
            let (mut value, mut derivative) = (vec![Complex64::default(); 4], vec![Complex64::default(); 4 * theta.len()]);
            model.stiffness(&theta, s, &mut value, Some(&mut derivative));
            let direct = model.matrices(&theta).dynamic_stiffness(s);
            for (e, d) in direct.iter().enumerate() {
                assert!((value[e] - d).norm() < 1e-12 * d.norm());
                let sum: Complex64 = theta.iter().enumerate().map(|(k, t)| derivative[4 * k + e] * t).sum();
                assert!((sum - d).norm() < 1e-12 * d.norm());
            }
        }
    }

    #[test]
    fn cholesky_factors_give_the_matrices_back_and_their_slopes() {
        let model = InertiaDampingStiffnessModel::new(arm().axes, Symmetry::PositiveSemidefinite);
        let theta = model.theta(&arm());
        let x = model.internal(&theta);
        assert!(model.natural(&x).iter().zip(&theta).all(|(a, b)| (a - b).abs() < 1e-12 * 520.0));
        let slopes = model.natural_jacobian(&x).expect("factors");
        for c in 0..9 {
            let differences = difference(&x, c, 1e-4, |x| model.natural(x));
            assert!((0..9).all(|r| (slopes[[r, c]] - differences[r]).abs() < 1e-8));
        }
        let mut impossible = arm();
        impossible.stiffness[[0, 0]] = -50.0;
        let nearest = model.matrices(&model.natural(&model.internal(&model.theta(&impossible))));
        assert!(nearest.stiffness[[0, 0]] > 0.0 && nearest.stiffness[[0, 0]] * nearest.stiffness[[1, 1]] > nearest.stiffness[[0, 1]].powi(2));
    }

    #[test]
    fn compliance_is_the_inverse_and_impedance_has_no_value_at_rest() {
        let f = [0.0, 2.0];
        let product = arm().response(&f, ResponseKind::Compliance).at(1).dot(&arm().response(&f, ResponseKind::DynamicStiffness).at(1));
        assert!((product[[0, 0]] - 1.0).norm() < 1e-14 && product[[0, 1]].norm() < 1e-14);
        assert!(arm().response(&f, ResponseKind::Impedance).value[[0, 0, 0]].is_nan());
    }
}
