//! The mechanism that a fit in time simulates.

use super::Law;
use crate::{Axis, InertiaDampingStiffnessModel, ParameterInfo, ParametricModel, Symmetry};
use ndarray::Array2;
use num_complex::Complex64;
use std::sync::Arc;

/// A force law on one axis of a mechanism.
#[derive(Clone)]
pub struct PlacedLaw {
    /// What.
    pub law: Arc<dyn Law>,
    /// Where: an index into the mechanism's axes.
    pub axis: usize,
}

/// M ẍ + B ẋ + K x + F₀ + F₁ t + Σ f(t, x, ẋ, z) = F for N axes.
///
/// Parameters in this order, matrices symmetric and by their upper triangle row by row: M, B, K where `spring`, the
/// offset F₀ of each axis where `offset`, the trend F₁ of each axis where `trend`, then each law's own.
///
/// ```
/// use ndof_models::{Axis, time::{Mechanism, laws::BoucWen}};
/// let arm = Mechanism::new(vec![Axis::linear("x")]).with(BoucWen, 0);
/// let names: Vec<String> = arm.parameters().into_iter().map(|p| p.name).collect();
/// assert_eq!(names, ["M", "B", "K", "loop_n_per_m", "yield_m", "shape"]);
/// ```
#[derive(Clone)]
pub struct Mechanism {
    /// The axes.
    pub axes: Vec<Axis>,
    /// Whether a spring holds it; a free mass has none.
    pub spring: bool,
    /// Whether a constant force acts on each axis.
    pub offset: bool,
    /// Whether a force that grows with time acts on each axis.
    pub trend: bool,
    /// What else acts.
    pub laws: Vec<PlacedLaw>,
}

impl Mechanism {
    /// Inertia, damping and stiffness alone.
    pub fn new(axes: Vec<Axis>) -> Self {
        Mechanism { axes, spring: true, offset: false, trend: false, laws: Vec::new() }
    }

    /// The same with a constant force.
    pub fn with_offset(self) -> Self {
        Mechanism { offset: true, ..self }
    }

    /// The same with one more law on `axis`.
    ///
    /// # Panics
    /// If there is no such axis.
    pub fn with(self, law: impl Law + 'static, axis: usize) -> Self {
        self.with_law(Arc::new(law), axis)
    }

    /// The same with one more law from the registry on `axis`.
    ///
    /// # Panics
    /// If there is no such axis.
    pub fn with_law(mut self, law: Arc<dyn Law>, axis: usize) -> Self {
        assert!(axis < self.axes.len(), "axis {axis} of {}", self.axes.len());
        self.laws.push(PlacedLaw { law, axis });
        self
    }

    /// Inertia, damping and stiffness alone, as a model in frequency.
    fn matrices_alone(&self) -> InertiaDampingStiffnessModel {
        InertiaDampingStiffnessModel::new(self.axes.clone(), Symmetry::Symmetric)
    }

    /// Entries of one matrix.
    pub(crate) fn entries(&self) -> Vec<(usize, usize)> {
        self.matrices_alone().entries().to_vec()
    }

    /// Number of matrices: M, B and perhaps K.
    pub(crate) fn matrices(&self) -> usize {
        if self.spring { 3 } else { 2 }
    }

    /// How many parameters stand before those of the laws.
    pub fn baseline_parameters(&self) -> usize {
        let n = self.axes.len();
        self.matrices() * n * (n + 1) / 2 + n * (usize::from(self.offset) + usize::from(self.trend))
    }

    /// What the parameters are.
    pub fn parameters(&self) -> Vec<ParameterInfo> {
        let (single, entries) = (self.axes.len() == 1, self.entries());
        let mut out = self.matrices_alone().parameters();
        out.truncate(self.matrices() * entries.len());
        // A mass of nothing would fly off.
        out.iter_mut().zip(entries).filter(|(_, (i, j))| i == j).for_each(|(mass, _)| mass.lower = 1e-9);
        for (stem, rate, used) in [("offset", "", self.offset), ("trend", "/s", self.trend)] {
            for axis in self.axes.iter().filter(|_| used) {
                let (suffix, unit) = if axis.rotational { ("nm", "N m") } else { ("n", "N") };
                let stem = if rate.is_empty() { format!("{stem}_{suffix}") } else { format!("{stem}_{suffix}_per_s") };
                let name = if single { stem } else { format!("{stem}_{}", axis.name) };
                let unit = format!("{unit}{rate}");
                out.push(ParameterInfo { name, unit, site: axis.name.clone(), lower: f64::NEG_INFINITY, upper: f64::INFINITY });
            }
        }
        for PlacedLaw { law, axis } in &self.laws {
            let axis = &self.axes[*axis];
            for p in law.parameters(axis.rotational) {
                let taken = !single || out.iter().any(|o: &ParameterInfo| o.name == p.name);
                let name = if taken { format!("{}_{}", p.name, axis.name) } else { p.name };
                out.push(ParameterInfo { name, unit: p.unit, site: axis.name.clone(), lower: p.lower, upper: p.upper });
            }
        }
        out
    }

    /// Start vectors: those of the baseline with every combination of the laws' own.
    pub fn starts(&self, baseline: &[f64]) -> Vec<Vec<f64>> {
        let own = self.laws.iter().flat_map(|l| l.law.parameters(self.axes[l.axis].rotational));
        own.fold(vec![baseline.to_vec()], |starts, p| {
            starts.iter().flat_map(|s| p.starts.iter().map(move |v| s.iter().copied().chain([*v]).collect())).collect()
        })
    }

    /// The same mechanism seen in frequency: D(s) = M s² + B s + K + Σ f/x, N × N. `None` where a law has no response, being
    /// nonlinear or one of the force alone.
    ///
    /// # Panics
    /// If `theta` does not have the mechanism's length.
    pub fn dynamic_stiffness(&self, theta: &[f64], s: Complex64) -> Option<Array2<Complex64>> {
        assert_eq!(theta.len(), self.parameters().len(), "parameters of the mechanism");
        let (n, per) = (self.axes.len(), self.entries().len());
        let mut of_matrices = theta[..self.matrices() * per].to_vec();
        of_matrices.resize(3 * per, 0.0);
        let mut rows = vec![Complex64::default(); n * n];
        self.matrices_alone().stiffness(&of_matrices, s, &mut rows, None);
        let mut out = Array2::from_shape_fn((n, n), |(i, j)| rows[i * n + j]);
        let mut at = self.baseline_parameters();
        for PlacedLaw { law, axis } in &self.laws {
            let count = law.parameters(false).len();
            out[[*axis, *axis]] += law.response(&theta[at..at + count], s)?;
            at += count;
        }
        Some(out)
    }

    /// How large each parameter would have to be to matter: for entries of a matrix, the size of its diagonal.
    pub(crate) fn scales(&self, theta: &[f64]) -> Vec<f64> {
        let (of_matrices, rest) = theta.split_at(self.matrices() * self.entries().len());
        self.matrices_alone().scales(of_matrices).into_iter().chain(rest.iter().map(|value| value.abs())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::laws;

    #[test]
    fn parameters_have_names_units_and_bounds_of_their_places() {
        let two = Mechanism { trend: true, ..Mechanism::new(vec![Axis::linear("x"), Axis::rotational("q")]) }.with_offset().with(laws::CubicStiffness, 1);
        let parameters = two.parameters();
        let names: Vec<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
        let matrices = ["M_x_x", "M_x_q", "M_q_q", "B_x_x", "B_x_q", "B_q_q", "K_x_x", "K_x_q", "K_q_q"];
        assert_eq!(names[..9], matrices);
        assert_eq!(names[9..13], ["offset_n_x", "offset_nm_q", "trend_n_per_s_x", "trend_nm_per_s_q"]);
        assert!(names.len() == 14 && names[13].ends_with("_q") && two.baseline_parameters() == 13);
        assert_eq!((parameters[1].site.as_str(), parameters[2].site.as_str(), parameters[12].unit.as_str()), ("x,q", "q", "N m/s"));
        // Only a mass itself has to be there.
        let held: Vec<usize> = (0..14).filter(|&k| parameters[k].lower == 1e-9).collect();
        assert_eq!(held, [0, 2]);
        assert!((1..13).filter(|k| *k != 2).all(|k| parameters[k].lower == f64::NEG_INFINITY));
        assert_eq!(Mechanism { spring: false, ..two.clone() }.baseline_parameters(), 10);
        // One axis says no more than it must: only what is there twice is told apart.
        let one = Mechanism::new(vec![Axis::linear("x")]).with(laws::CubicStiffness, 0).with(laws::CubicStiffness, 0);
        let names: Vec<String> = one.parameters().into_iter().map(|p| p.name).collect();
        assert_eq!(names[..3], ["M", "B", "K"]);
        assert_eq!(names[4], format!("{}_x", names[3]));
    }

    #[test]
    fn an_entry_matters_beside_its_diagonal_and_anything_else_beside_itself() {
        let mechanism = Mechanism::new(vec![Axis::linear("x"), Axis::linear("y")]).with_offset().with(laws::CubicStiffness, 0);
        let theta = [4.0, -0.5, 9.0, 16.0, 1.0, 25.0, 100.0, 7.0, 400.0, -3.0, 2.0, 5e4];
        assert_eq!(mechanism.scales(&theta), [4.0, 6.0, 9.0, 16.0, 20.0, 25.0, 100.0, 200.0, 400.0, 3.0, 2.0, 5e4]);
    }
}
