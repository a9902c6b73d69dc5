//! A baseline with blocks.

use super::{Block, BlockParameter};
use crate::{Axis, ParameterInfo, ParametricModel};
use ndof_linear::square;
use num_complex::Complex64;

/// Where a block acts. Axes are indices into those of the baseline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// Beside the baseline: D_ii + h on each of the axes.
    Parallel(Vec<usize>),
    /// Between baseline and sensor: C_ii + h on each of the axes.
    Series(Vec<usize>),
    /// In the effort channels: F_i is seen through h.
    EffortChannel(Vec<usize>),
    /// In the motion channels: d_i is seen through h.
    MotionChannel(Vec<usize>),
}

impl Place {
    fn axes(&self) -> &[usize] {
        match self {
            Place::Parallel(a) | Place::Series(a) | Place::EffortChannel(a) | Place::MotionChannel(a) => a,
        }
    }
}

/// A block at its place.
pub struct Placed {
    /// What.
    pub block: Box<dyn Block>,
    /// Where.
    pub place: Place,
}

/// A baseline and blocks, applied in order: D → D + h, (D⁻¹ + h)⁻¹, h D or D h⁻¹.
///
/// ```
/// use ndof_models::blocks::{Composite, Delay, Place, Placed};
/// use ndof_models::{Axis, InertiaDampingStiffnessModel, ParametricModel, Symmetry};
/// let baseline = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
/// let model = Composite::new(Box::new(baseline), vec![Placed { block: Box::new(Delay), place: Place::EffortChannel(vec![0]) }]);
/// let names: Vec<String> = model.parameters().into_iter().map(|p| p.name).collect();
/// assert_eq!(names, ["M", "B", "K", "delay_s"]);
/// ```
pub struct Composite {
    baseline: Box<dyn ParametricModel>,
    placed: Vec<Placed>,
    name: String,
    parameters: Vec<ParameterInfo>,
    starts: Vec<Vec<f64>>,
}

impl Composite {
    /// Puts the blocks together. Names that occur twice get the axes' names behind them.
    ///
    /// # Panics
    /// If a place names an axis that the baseline lacks.
    pub fn new(baseline: Box<dyn ParametricModel>, placed: Vec<Placed>) -> Self {
        let mut parameters = baseline.parameters();
        let mut name = baseline.name().to_owned();
        let mut starts = vec![Vec::new()];
        let axes = baseline.axes();
        for Placed { block, place } in &placed {
            let own: Vec<&Axis> = place.axes().iter().map(|&k| &axes[k]).collect();
            let site = own.iter().map(|a| a.name.as_str()).collect::<Vec<_>>().join(",");
            name = format!("{name}+{}", block.name());
            for BlockParameter { name, unit, lower, upper, starts: values } in block.parameters(own.iter().all(|a| a.rotational)) {
                let taken = parameters.iter().any(|p| p.name == name);
                let name = if taken { format!("{name}_{}", site.replace(',', "_")) } else { name };
                parameters.push(ParameterInfo { name, unit, site: site.clone(), lower, upper });
                starts = starts.iter().flat_map(|s: &Vec<f64>| values.iter().map(move |v| s.iter().copied().chain([*v]).collect())).collect();
            }
        }
        Composite { baseline, placed, name, parameters, starts }
    }

    /// Start vectors: those of the baseline with every combination of the blocks' own.
    pub fn starts(&self, baseline: &[f64]) -> Vec<Vec<f64>> {
        self.starts.iter().map(|s| baseline.iter().chain(s).copied().collect()).collect()
    }
}

impl ParametricModel for Composite {
    fn name(&self) -> &str {
        &self.name
    }

    fn axes(&self) -> &[Axis] {
        self.baseline.axes()
    }

    fn parameters(&self) -> Vec<ParameterInfo> {
        self.parameters.clone()
    }

    fn base(&self) -> Option<&dyn ParametricModel> {
        Some(&*self.baseline)
    }

    fn stiffness(&self, theta: &[f64], s: Complex64, value: &mut [Complex64], mut derivative: Option<&mut [Complex64]>) {
        let n = self.axes().len();
        let size = n * n;
        let base = theta.len() - self.starts.first().map_or(0, Vec::len);
        self.baseline.stiffness(&theta[..base], s, value, derivative.as_deref_mut().map(|d| &mut d[..base * size]));
        let mut at = base;
        for Placed { block, place } in &self.placed {
            let count = block.parameters(false).len();
            let mut slopes = vec![Complex64::default(); count];
            let h = block.evaluate(&theta[at..at + count], s, &mut slopes);
            let (done, own) = match derivative.as_deref_mut() {
                Some(d) => {
                    let (done, rest) = d.split_at_mut(at * size);
                    let own = &mut rest[..count * size];
                    own.fill(Complex64::default());
                    (done, own)
                }
                None => (&mut [][..], &mut [][..]),
            };
            apply(place, n, h, &slopes, value, done, own);
            at += count;
        }
    }
}

/// Applies one block to D, to the derivatives that D already has and to those that the block adds.
fn apply(place: &Place, n: usize, h: Complex64, slopes: &[Complex64], value: &mut [Complex64], done: &mut [Complex64], own: &mut [Complex64]) {
    let size = n * n;
    match place {
        Place::Parallel(axes) => {
            for &i in axes {
                value[i * n + i] += h;
                own.chunks_exact_mut(size).zip(slopes).for_each(|(d, slope)| d[i * n + i] += slope);
            }
        }
        Place::EffortChannel(axes) | Place::MotionChannel(axes) => {
            let rows = matches!(place, Place::EffortChannel(_));
            // Rows times h, or columns times 1/h with slope −h′/h².
            let (factor, turn) = if rows { (h, Complex64::new(1.0, 0.0)) } else { (h.inv(), -(h * h).inv()) };
            for e in (0..size).filter(|e| axes.contains(&if rows { e / n } else { e % n })) {
                own.chunks_exact_mut(size).zip(slopes).for_each(|(d, slope)| d[e] = value[e] * slope * turn);
                done.chunks_exact_mut(size).for_each(|d| d[e] *= factor);
                value[e] *= factor;
            }
        }
        Place::Series(axes) => {
            // D′ = (D⁻¹ + E)⁻¹ = (I + D E)⁻¹ D; dD′ = A dD Aᵣ − D′ dE D′ with A = (I + D E)⁻¹, Aᵣ = (I + E D)⁻¹.
            let added = |left: bool| {
                let mut out = square::identity(n);
                for e in 0..size {
                    if axes.contains(&if left { e % n } else { e / n }) {
                        out[e] += value[e] * h;
                    }
                }
                square::inverse(&out, n)
            };
            let (Some(left), Some(right)) = (added(true), added(false)) else {
                value.fill(Complex64::new(f64::NAN, 0.0));
                return;
            };
            let softer = square::product(&left, value, n);
            for d in done.chunks_exact_mut(size) {
                let turned = square::product(&square::product(&left, d, n), &right, n);
                d.copy_from_slice(&turned);
            }
            for (d, slope) in own.chunks_exact_mut(size).zip(slopes) {
                for e in 0..size {
                    d[e] = -slope * axes.iter().map(|&k| softer[(e / n) * n + k] * softer[k * n + e % n]).sum::<Complex64>();
                }
            }
            value.copy_from_slice(&softer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::{Delay, FirstOrderFilter, Reflex, SeriesCompliance};
    use crate::shared_tests::assert_slopes;
    use crate::{InertiaDampingStiffnessModel, Symmetry};

    fn composite() -> Composite {
        let axes = vec![Axis::linear("x"), Axis::linear("y")];
        let put = |block: Box<dyn Block>, place: Place| Placed { block, place };
        Composite::new(
            Box::new(InertiaDampingStiffnessModel::new(axes, Symmetry::Free)),
            vec![
                put(Box::new(Reflex), Place::Parallel(vec![0, 1])),
                put(Box::new(SeriesCompliance), Place::Series(vec![1])),
                put(Box::new(Delay), Place::EffortChannel(vec![0])),
                put(Box::new(FirstOrderFilter), Place::MotionChannel(vec![0, 1])),
                put(Box::new(Delay), Place::MotionChannel(vec![1])),
            ],
        )
    }

    const BASE: [f64; 12] = [2.1, -0.5, -0.6, 1.9, 11.0, -2.0, -1.0, 15.0, 300.0, -60.0, -50.0, 520.0];

    #[test]
    fn derivatives_of_stacked_blocks_agree_with_differences() {
        let model = composite();
        let mut theta = model.starts(&BASE)[0].clone();
        theta[18] = 0.004;
        theta[20] = -0.002;
        assert_slopes(&model, &theta, Complex64::new(0.0, 25.0));
    }

    #[test]
    fn names_stay_apart_and_every_start_is_a_full_vector() {
        let model = composite();
        let names: Vec<String> = model.parameters().into_iter().map(|p| p.name).collect();
        assert_eq!(names[18..], ["delay_s", "cutoff_hz", "delay_s_y"]);
        assert_eq!(model.starts(&BASE).len(), 2 * 2 * 2 * 2);
        assert!(model.starts(&BASE).iter().all(|s| s.len() == names.len()));
    }

    #[test]
    fn a_series_compliance_adds_to_compliance() {
        let axes = vec![Axis::linear("x"), Axis::linear("y")];
        let model = Composite::new(
            Box::new(InertiaDampingStiffnessModel::new(axes, Symmetry::Free)),
            vec![Placed { block: Box::new(SeriesCompliance), place: Place::Series(vec![1]) }],
        );
        let theta: Vec<f64> = BASE.iter().copied().chain([2e4, 50.0]).collect();
        let s = Complex64::new(0.0, 30.0);
        let (mut plain, mut soft) = (vec![Complex64::default(); 4], vec![Complex64::default(); 4]);
        model.baseline.stiffness(&BASE, s, &mut plain, None);
        model.stiffness(&theta, s, &mut soft, None);
        let difference = square::inverse(&soft, 2).expect("regular")[3] - square::inverse(&plain, 2).expect("regular")[3];
        assert!((difference - (2e4 + 50.0 * s).inv()).norm() < 1e-15);
    }
}
