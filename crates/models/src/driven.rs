//! Models whose axes are driven by more inputs than one each.

use crate::{Axis, Gains, ParameterInfo, ParametricModel};
use ndof_linear::square;
use num_complex::Complex64;

/// A model whose axes are driven by more inputs than one each: C(s) W. The gains follow behind its own parameters.
#[derive(Clone)]
pub struct Driven<'a> {
    /// The axes.
    pub model: &'a dyn ParametricModel,
    /// What drives them.
    pub gains: Gains,
    /// Units of the inputs.
    pub units: Vec<String>,
}

impl Driven<'_> {
    /// `gain_motor` for a single axis, `gain_x_motor` for several.
    fn gain(&self, axis: &Axis, [effort, input]: [usize; 2]) -> ParameterInfo {
        let name = &self.gains.inputs[input];
        let (of, per) = (&self.units[effort], &self.units[input]);
        ParameterInfo {
            name: if self.gains.axes == 1 { format!("gain_{name}") } else { format!("gain_{}_{name}", axis.name) },
            unit: if of == per { "1".to_owned() } else { format!("{of}/{per}") },
            site: axis.name.clone(),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
        }
    }
}

impl ParametricModel for Driven<'_> {
    fn name(&self) -> &str {
        self.model.name()
    }

    fn axes(&self) -> &[Axis] {
        self.model.axes()
    }

    fn parameters(&self) -> Vec<ParameterInfo> {
        let axes = self.axes();
        let gains = self.gains.places().map(|(axis, input)| self.gain(&axes[axis], [self.gains.reference[axis], input]));
        self.model.parameters().into_iter().chain(gains).collect()
    }

    fn base(&self) -> Option<&dyn ParametricModel> {
        Some(self.model)
    }

    /// A gain matters when it is as large as what else its input does.
    fn scales(&self, theta: &[f64]) -> Vec<f64> {
        let (own, gains) = theta.split_at(self.model.parameters().len());
        let most = |column: &[f64]| column.iter().fold(0.0, |most: f64, gain| gain.abs().max(most));
        let of_gains = gains.chunks(self.gains.axes).flat_map(|column| std::iter::repeat_n(most(column), column.len()));
        self.model.scales(own).into_iter().chain(of_gains).collect()
    }

    fn stiffness(&self, theta: &[f64], s: Complex64, value: &mut [Complex64], derivative: Option<&mut [Complex64]>) {
        let base = self.model.parameters().len();
        let own = derivative.map(|all| {
            let (own, gains) = all.split_at_mut(base * value.len());
            gains.fill(Complex64::default());
            own
        });
        self.model.stiffness(&theta[..base], s, value, own);
    }

    fn gains(&self) -> Option<&Gains> {
        Some(&self.gains)
    }
}

impl Gains {
    /// C W and its derivatives by all parameters, of C (axes × axes) and its own, block after block; those by the gains take the columns of C.
    pub(crate) fn drive(&self, theta: &[f64], compliance: &[Complex64], slopes: &[Complex64]) -> (Vec<Complex64>, Vec<Complex64>) {
        let (n, q) = (self.axes, self.inputs.len());
        let base = theta.len() - self.count();
        let w: Vec<Complex64> = self.matrix(&theta[base..]).iter().map(|gain| Complex64::from(*gain)).collect();
        let driven = |c: &[Complex64]| square::rectangular_product(c, &w, [n, q]);
        let value = compliance.chunks_exact(n * n).flat_map(driven).collect();
        let per_bin = theta.len() * n * n;
        let of_bin = |(c, slopes): (&[Complex64], &[Complex64])| {
            let mut out: Vec<Complex64> = slopes.chunks_exact(n * n).take(base).flat_map(driven).collect();
            for (axis, input) in self.places() {
                let at = out.len();
                out.resize(at + n * q, Complex64::default());
                (0..n).for_each(|i| out[at + i * q + input] = c[i * n + axis]);
            }
            out
        };
        (value, compliance.chunks_exact(n * n).zip(slopes.chunks_exact(per_bin)).flat_map(of_bin).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::difference;
    use crate::{InertiaDampingStiffnessModel, Symmetry};

    fn plane() -> InertiaDampingStiffnessModel {
        InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric)
    }

    fn driven(model: &InertiaDampingStiffnessModel) -> Driven<'_> {
        let inputs: Vec<String> = ["force_m", "force_x", "force_y", "valve"].map(str::to_owned).to_vec();
        Driven { model, gains: Gains::new(2, inputs, vec![1, 2]), units: ["N", "N", "N", "V"].map(str::to_owned).to_vec() }
    }

    const THETA: [f64; 13] = [2.0, -0.4, 1.5, 12.0, 1.0, 9.0, 300.0, -50.0, 420.0, 0.7, -0.2, 3.0, 1.5];

    #[test]
    fn names_and_units_are_those_of_axis_and_input() {
        let model = plane();
        let driven = driven(&model);
        let of: Vec<(String, String)> = driven.parameters().into_iter().skip(9).map(|p| (p.name, p.unit)).collect();
        let want = [("gain_x_force_m", "1"), ("gain_y_force_m", "1"), ("gain_x_valve", "N/V"), ("gain_y_valve", "N/V")];
        assert_eq!(of, want.map(|(name, unit)| (name.to_owned(), unit.to_owned())));
        // The small gain matters as the large one of the same input does.
        assert_eq!(driven.scales(&THETA)[10..], [0.7, 3.0, 3.0]);
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let model = plane();
        let driven = driven(&model);
        let s = Complex64::new(0.0, 14.0);
        let compliance = |theta: &[f64], slopes: bool| {
            let (mut d, mut by) = (vec![Complex64::default(); 4], vec![Complex64::default(); 4 * 13]);
            driven.stiffness(theta, s, &mut d, slopes.then_some(&mut by));
            let c = square::inverse(&d, 2).expect("regular");
            let by: Vec<Complex64> = by.chunks_exact(4).flat_map(|d| square::sandwich(&c, d, &c, 2)).map(|v| -v).collect();
            driven.gains.drive(theta, &c, &by)
        };
        let (value, slopes) = compliance(&THETA, true);
        assert_eq!((value.len(), slopes.len()), (8, 8 * 13));
        for k in 0..13 {
            let size = value.iter().map(|v| v.norm()).fold(0.0, f64::max) / THETA[k].abs();
            for (e, slope) in difference(&THETA, k, 1e-5 * THETA[k].abs(), |theta| compliance(theta, false).0).into_iter().enumerate() {
                assert!((slopes[8 * k + e] - slope).norm() < 1e-8 * size, "{k} {e}");
            }
        }
    }
}
