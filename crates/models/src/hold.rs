//! What an effort does between its samples, and a model as sampled channels show it.

use crate::{Axis, ParameterInfo, ParametricModel};
use ndof_linear::square;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What an effort does between its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// Nothing above half the sample rate: what a sensor behind an anti-alias filter gives.
    #[default]
    BandLimited,
    /// Each value stays until the next: what a computer commands. Motion that is read at the same instants is half a sample late.
    Zero,
    /// From value to value by a straight line. A held effort whose motion is the mean over the same interval looks the same.
    Linear,
    /// Jumps with a command that a loop holds from tick to tick, and channels are read just after it is written: [`Ticks`](crate::Ticks).
    ReadAfter,
    /// The same, read just before the next command is written.
    ReadBefore,
}

impl Hold {
    /// All of them, the plainest first.
    pub const ALL: [Hold; 5] = [Hold::BandLimited, Hold::Zero, Hold::Linear, Hold::ReadAfter, Hold::ReadBefore];

    /// s^p Z(s) of the response Z of the hold, p its order: the same at s and wherever it folds to. Z(s) = (1 − e^(−sT))/(sT) for
    /// [`Hold::Zero`], Z² e^(sT) for [`Hold::Linear`], 1 for what [`Ticks`](crate::Ticks) has made of an effort.
    fn numerator(self, s: Complex64, step_s: f64) -> Complex64 {
        let x = s * step_s;
        let zero = || (Complex64::new(1.0, 0.0) - (-x).exp()) / step_s;
        match self {
            Hold::BandLimited | Hold::ReadAfter | Hold::ReadBefore => Complex64::ONE,
            Hold::Zero => zero(),
            Hold::Linear => zero().powi(2) * x.exp(),
        }
    }

    /// Z(s) itself: what of a frequency's samples acts at that frequency.
    pub fn response(self, s: Complex64, step_s: f64) -> Complex64 {
        if s == Complex64::ZERO { Complex64::ONE } else { self.numerator(s, step_s) / s.powi(self.order()) }
    }

    /// By which power of s it falls.
    fn order(self) -> i32 {
        match self {
            Hold::BandLimited | Hold::ReadAfter | Hold::ReadBefore => 0,
            Hold::Zero => 1,
            Hold::Linear => 2,
        }
    }
}

/// How channels were sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// What efforts do between their samples.
    pub hold: Hold,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// 0 where motion is measured as displacement, 1 as velocity; the response is that of displacement in both cases.
    pub derivatives: i32,
}

impl Sampling {
    /// What has no samples, or none that tell.
    pub const CONTINUOUS: Sampling = Sampling { hold: Hold::BandLimited, sample_rate_hz: f64::INFINITY, derivatives: 0 };
}

/// A model as channels of a sample rate show it whose efforts are held between samples.
///
/// The sampled response is the sum over all that folds onto a frequency,
///
/// C_T(s) = Σ_k Z(s_k) (s_k/s)^d C(s_k),  s_k = s + 2πjk/T
///
/// with the response Z of the hold, of displacement (d = 0) or of a velocity that was divided by s afterwards (d = 1). It is summed to
/// |k| = 2; beyond that C falls as 1/s², as every mass does, and the rest is one of Hurwitz' zeta functions, by its integral.
///
/// # References
/// K. J. Åström & B. Wittenmark (1997), Computer-Controlled Systems, ch. 2 and 7. R. Pintelon & J. Schoukens (2012), ch. 13.
///
/// ```
/// use ndof_models::{Axis, Held, Hold, InertiaDampingStiffnessModel, ParametricModel, Sampling, Symmetry};
/// use num_complex::Complex64;
///
/// let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric);
/// let held = Held { model, sampling: Sampling { hold: Hold::Zero, sample_rate_hz: 100.0, derivatives: 0 } };
/// let mut d = [Complex64::default()];
/// held.stiffness(&[0.0, 0.0, 300.0], Complex64::new(0.0, 6.0), &mut d, None);
/// assert!((d[0].re - 300.0).abs() < 30.0 && d[0].im > 0.0); // a spring seems to lead, by the effort's delay of half a sample
/// ```
#[derive(Clone, Debug)]
pub struct Held<M> {
    /// The model in continuous time.
    pub model: M,
    /// How its channels were sampled.
    pub sampling: Sampling,
}

/// Foldings that are summed one by one, to each side; the others lie where C is that of a mass.
const FOLDS: i32 = 2;

impl Sampling {
    /// s_k and its weight Z(s_k) (s_k/s)^d, for what falls as s^(−falls) beyond them: the outermost ones stand for all that lies there.
    pub(crate) fn folds(&self, s: Complex64, falls: i32) -> [(Complex64, Complex64); 2 * FOLDS as usize + 1] {
        let Sampling { hold, sample_rate_hz, derivatives } = *self;
        let turn = TAU * sample_rate_hz;
        let numerator = hold.numerator(s, 1.0 / sample_rate_hz);
        std::array::from_fn(|index| {
            let k = index as i32 - FOLDS;
            let folded = s + Complex64::new(0.0, turn * f64::from(k));
            // At 0 Hz the hold is 1 and what folds there is 0, and so is the numerator: there it says nothing.
            let at_rest = s.norm() <= 1e-9 * turn;
            let mut weight = if at_rest { Complex64::from(f64::from(u8::from(k == 0))) } else { numerator / folded.powi(hold.order()) };
            if k != 0 && !at_rest {
                weight *= (folded / s).powi(derivatives);
            }
            if k.abs() == FOLDS {
                // Σ_{i>0} (s_k / s_(k+i))^p of the same side, p the power by which all of it falls.
                let (from, power) = (folded.im.abs() / turn, falls + hold.order() - derivatives);
                weight *= 1.0 + from.powi(power) / (f64::from(power - 1) * (from + 0.5).powi(power - 1));
            }
            (folded, weight)
        })
    }
}

impl<M: ParametricModel> ParametricModel for Held<M> {
    fn name(&self) -> &str {
        self.model.name()
    }

    fn axes(&self) -> &[Axis] {
        self.model.axes()
    }

    fn parameters(&self) -> Vec<ParameterInfo> {
        self.model.parameters()
    }

    fn base(&self) -> Option<&dyn ParametricModel> {
        Some(&self.model)
    }

    /// D_T = C_T⁻¹ and ∂D_T = −D_T ∂C_T D_T; not a number where C does not exist.
    fn stiffness(&self, theta: &[f64], s: Complex64, value: &mut [Complex64], derivative: Option<&mut [Complex64]>) {
        if self.sampling.hold.order() == 0 {
            return self.model.stiffness(theta, s, value, derivative);
        }
        let n = self.axes().len();
        let mut compliance = vec![Complex64::default(); n * n];
        let mut slopes = vec![Complex64::default(); derivative.as_ref().map_or(0, |d| d.len())];
        self.compliance(theta, s, &mut compliance, derivative.is_some().then_some(&mut slopes));
        if square::invert_into(&mut compliance, value, n).is_none() {
            let nan = Complex64::new(f64::NAN, f64::NAN);
            value.fill(nan);
            derivative.into_iter().for_each(|d| d.fill(nan));
            return;
        }
        if let Some(derivative) = derivative {
            derivative.fill(Complex64::default());
            for (out, slope) in derivative.chunks_exact_mut(n * n).zip(slopes.chunks_exact(n * n)) {
                square::add_sandwich(Complex64::from(-1.0), [value, slope, value], n, out);
            }
        }
    }

    /// C_T and ∂C_T = −Σ Z C ∂D C; not a number where C does not exist.
    fn compliance(&self, theta: &[f64], s: Complex64, value: &mut [Complex64], mut derivative: Option<&mut [Complex64]>) -> bool {
        if self.sampling.hold.order() == 0 {
            return self.model.compliance(theta, s, value, derivative);
        }
        let n = self.axes().len();
        let mut stiffness = vec![Complex64::default(); n * n];
        let mut compliance = stiffness.clone();
        let mut slopes = vec![Complex64::default(); derivative.as_ref().map_or(0, |d| d.len())];
        let mut exists = true;
        value.fill(Complex64::default());
        derivative.iter_mut().for_each(|d| d.fill(Complex64::default()));
        for (folded, weight) in self.sampling.folds(s, 2) {
            self.model.stiffness(theta, folded, &mut stiffness, derivative.is_some().then_some(&mut slopes));
            exists &= square::invert_into(&mut stiffness, &mut compliance, n).is_some();
            value.iter_mut().zip(&compliance).for_each(|(sum, c)| *sum += weight * c);
            if let Some(derivative) = derivative.as_deref_mut() {
                for (out, d) in derivative.chunks_exact_mut(n * n).zip(slopes.chunks_exact(n * n)) {
                    square::add_sandwich(-weight, [&compliance, d, &compliance], n, out);
                }
            }
        }
        if !exists {
            let nan = Complex64::new(f64::NAN, f64::NAN);
            value.fill(nan);
            derivative.into_iter().for_each(|d| d.fill(nan));
        }
        true
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::shared_tests::assert_slopes;
    use crate::{InertiaDampingStiffnessModel, Symmetry};

    /// The sampled response of an effort that is held, by the exact step of the state x' = v, v' = (F − B v − K x)/M: displacement, speed.
    pub(crate) fn state(m: f64, b: f64, k: f64, step_s: f64, hz: f64) -> [Complex64; 2] {
        // Powers of the state's matrix with its input, [A B; 0 0], summed to e^(that T).
        let a = [[0.0, 1.0, 0.0], [-k / m, -b / m, 1.0 / m], [0.0; 3]].map(|row| row.map(|v| v * step_s));
        let product = |p: [[f64; 3]; 3]| [0, 1, 2].map(|i: usize| [0, 1, 2].map(|j: usize| (0..3).map(|l| p[i][l] * a[l][j]).sum::<f64>()));
        let mut term = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut e = term;
        for power in 1..60 {
            term = product(term).map(|row| row.map(|v| v / f64::from(power)));
            e.iter_mut().flatten().zip(term.iter().flatten()).for_each(|(e, t)| *e += t);
        }
        let z = Complex64::new(0.0, TAU * hz * step_s).exp();
        // (z I − Φ)⁻¹ Γ.
        let determinant = (z - e[0][0]) * (z - e[1][1]) - e[0][1] * e[1][0];
        [((z - e[1][1]) * e[0][2] + e[0][1] * e[1][2]) / determinant, ((z - e[0][0]) * e[1][2] + e[1][0] * e[0][2]) / determinant]
    }

    fn exact(m: f64, b: f64, k: f64, step_s: f64, hz: f64) -> Complex64 {
        state(m, b, k, step_s, hz)[0]
    }

    fn model() -> InertiaDampingStiffnessModel {
        InertiaDampingStiffnessModel::new(vec![Axis::linear("x")], Symmetry::Symmetric)
    }

    #[test]
    fn a_held_effort_moves_a_mass_as_the_exact_step_does() {
        let (m, b, k) = (2.0f64, 12.0, 300.0);
        let own_hz = (k / m).sqrt() / TAU;
        for samples_a_period in [3.0, 5.0, 20.0, 50.0] {
            let rate = samples_a_period * own_hz;
            let held = Held { model: model(), sampling: Sampling { hold: Hold::Zero, sample_rate_hz: rate, derivatives: 0 } };
            for share in [0.01, 0.1, 0.25, 0.45] {
                let mut d = [Complex64::default()];
                held.stiffness(&[m, b, k], Complex64::new(0.0, TAU * share * rate), &mut d, None);
                let want = exact(m, b, k, 1.0 / rate, share * rate);
                // What the tail leaves: C is 1/s² but for terms of B/(M s) beyond four foldings.
                assert!((d[0].inv() / want - 1.0).norm() < 2e-3, "{samples_a_period} {share}: {} {want}", d[0].inv());
            }
        }
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let axes = vec![Axis::linear("x"), Axis::linear("y")];
        for hold in Hold::ALL {
            let sampling = Sampling { hold, sample_rate_hz: 40.0, derivatives: 0 };
            let held = Held { model: InertiaDampingStiffnessModel::new(axes.clone(), Symmetry::Symmetric), sampling };
            assert_slopes(&held, &[2.1, -0.5, 1.9, 11.0, -2.0, 15.0, 300.0, -60.0, 520.0], Complex64::new(0.0, TAU * 7.0));
        }
    }

    #[test]
    fn a_straight_line_is_not_late_and_a_step_half_a_sample() {
        let (rate, s) = (100.0, Complex64::new(0.0, TAU * 2.0));
        for (hold, late) in Hold::ALL.map(|hold| (hold, if hold == Hold::Zero { 0.5 } else { 0.0 })) {
            let response = hold.numerator(s, 1.0 / rate) / s.powi(hold.order());
            assert!((response.arg() + late * s.im / rate).abs() < 1e-12 && (response.norm() - 1.0).abs() < 2e-3, "{hold:?}");
        }
    }
}
