//! What a motion says about a robot's parameters.

use super::{ExcitationError, FourierMotion, JointMotion, PredictedParameter};
use ndarray::Array2;
use ndof_devices::{BaseParameter, SerialChain, TERMS_OF_A_LINK, base_parameters};
use ndof_linear::{cholesky_in_place, cholesky_solve, symmetric_eigen};
use ndof_models::robot::{Joints, Robot};

/// The regressor of a robot's base parameters, then viscous and dry friction of each joint.
pub(super) struct Model<'a> {
    pub(super) chain: &'a SerialChain,
    base: Vec<BaseParameter>,
    names: Vec<String>,
    /// All parameters, those of interest last.
    order: Vec<usize>,
    /// How many of them are of interest.
    interest: usize,
    /// Dry friction of 1, for its column.
    dry: Joints,
    /// One over the torque noise of each joint.
    weights: Vec<f64>,
}

impl<'a> Model<'a> {
    pub(super) fn new(chain: &'a SerialChain, interest: &[String]) -> Result<Self, ExcitationError> {
        let (base, joints) = (base_parameters(chain), chain.joints());
        let friction = ["viscous", "coulomb"].into_iter().flat_map(|what| joints.names.iter().map(move |joint| format!("{what}_{joint}")));
        let names: Vec<String> = base.iter().map(|parameter| parameter.name.clone()).chain(friction).collect();
        // A base parameter is the joint's whose parameter is the first in it.
        let n = joints.count();
        let of_column = |column: usize| if column < TERMS_OF_A_LINK * n { column / TERMS_OF_A_LINK } else { column - TERMS_OF_A_LINK * n };
        let owners: Vec<usize> = base.iter().map(|parameter| of_column(parameter.column)).chain((0..2 * n).map(|k| k % n)).collect();
        let of_interest = of_interest(&names, &owners, &joints.names, interest)?;
        let (mut order, mut last): (Vec<usize>, Vec<usize>) = (0..names.len()).partition(|k| !of_interest[*k]);
        let interest = last.len();
        order.append(&mut last);
        let dry = Joints { coulomb: vec![1.0; n], viscous: vec![0.0; n], ..joints.clone() };
        Ok(Model { chain, base, names, order, interest, dry, weights: vec![1.0; n] })
    }

    /// Sets the torque noise of each joint.
    pub(super) fn weigh(&mut self, noise: &[f64]) {
        self.weights = noise.iter().map(|n| 1.0 / n).collect();
    }

    /// Torques of the nominal model, friction included.
    pub(super) fn torques(&self, at: &JointMotion, out: &mut [f64]) {
        self.chain.inverse_dynamics(&at.angles, &at.rates, &at.accelerations, out);
        let joints = self.chain.joints();
        out.iter_mut().enumerate().for_each(|(j, torque)| *torque += joints.friction(j, at.rates[j]));
    }

    /// The largest torque of each joint over a period.
    pub(super) fn largest_torques(&self, motion: &FourierMotion, samples: usize) -> Vec<f64> {
        self.over(motion, samples, |peak, torque| peak.max(torque.abs()))
    }

    /// The root mean square torque of each joint over all motions.
    pub(super) fn mean_torques(&self, motions: &[FourierMotion], samples: usize) -> Vec<f64> {
        let sums: Vec<Vec<f64>> = motions.iter().map(|motion| self.over(motion, samples, |sum, torque| sum + torque * torque)).collect();
        let count = (samples * motions.len()) as f64;
        (0..self.weights.len()).map(|j| (sums.iter().map(|sum| sum[j]).sum::<f64>() / count).sqrt()).collect()
    }

    fn over(&self, motion: &FourierMotion, samples: usize, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let mut torque = vec![0.0; self.weights.len()];
        let mut out = torque.clone();
        for m in 0..samples {
            self.torques(&motion.at(motion.period_s * m as f64 / samples as f64), &mut torque);
            out.iter_mut().zip(&torque).for_each(|(out, torque)| *out = f(*out, *torque));
        }
        out
    }

    /// WᵀW of one mean sample, its lower triangle, parameters in `order`; rows of W are divided by the torque noise.
    fn information(&self, motion: &FourierMotion, samples: usize) -> Vec<f64> {
        let (p, n) = (self.order.len(), self.weights.len());
        let (mut sum, mut filled) = (vec![0.0; p * p], Vec::with_capacity(p));
        for m in 0..samples {
            let at = motion.at(motion.period_s * m as f64 / samples as f64);
            let regressor = self.chain.regressor(&at.angles, &at.rates, &at.accelerations);
            for j in 0..n {
                // A joint feels the bodies after it and its own friction: half of a row is zero.
                filled.clear();
                for (place, &k) in self.order.iter().enumerate() {
                    let value = match k.checked_sub(self.base.len()) {
                        None => regressor[[j, self.base[k].column]],
                        Some(k) if k == j => at.rates[j],
                        Some(k) if k == n + j => self.dry.friction(j, at.rates[j]),
                        Some(_) => 0.0,
                    };
                    if value != 0.0 {
                        filled.push((place, value * self.weights[j]));
                    }
                }
                for (r, &(row, a)) in filled.iter().enumerate() {
                    let out = &mut sum[row * p..=row * p + row];
                    filled[..=r].iter().for_each(|&(column, b)| out[column] += a * b);
                }
            }
        }
        sum.iter_mut().for_each(|v| *v /= samples as f64);
        sum
    }

    /// What the search makes small: the mean logarithm of the variances, and of the squared condition where all parameters are asked for;
    /// `None` if the motion does not tell the parameters apart.
    ///
    /// With L of WᵀW = L Lᵀ and the parameters of interest last, the determinant of their covariance is Π Lₖₖ⁻² over them.
    pub(super) fn uncertainty(&self, motion: &FourierMotion, samples: usize) -> Option<f64> {
        let (information, p) = (self.information(motion, samples), self.order.len());
        let mut factor = information.clone();
        if !cholesky_in_place(&mut factor, p) {
            return None;
        }
        let mean = -2.0 * (p - self.interest..p).map(|k| factor[k * p + k].ln()).sum::<f64>() / self.interest as f64;
        let condition = if self.interest == p { condition(&information, p)? } else { 1.0 };
        Some(mean + 2.0 * condition.ln())
    }

    /// Largest over smallest singular value of W with columns of length one; `None` if a column is zero.
    pub(super) fn condition(&self, motion: &FourierMotion, samples: usize) -> Option<f64> {
        condition(&self.information(motion, samples), self.order.len())
    }

    /// The parameters with what a motion leaves uncertain of them.
    pub(super) fn predicted(&self, motion: &FourierMotion, samples: usize) -> Option<Vec<PredictedParameter>> {
        let (mut factor, p) = (self.information(motion, samples), self.order.len());
        if !cholesky_in_place(&mut factor, p) {
            return None;
        }
        let (joints, inertial) = (self.chain.joints(), self.chain.inertial_parameters());
        let values: Vec<f64> = self.base.iter().map(|b| b.value(&inertial)).chain(joints.viscous.iter().chain(&joints.coulomb).copied()).collect();
        let first = p - self.interest;
        let mut found: Vec<(usize, PredictedParameter)> = self
            .order
            .iter()
            .enumerate()
            .map(|(place, &k)| {
                let mut column = vec![0.0; p];
                column[place] = 1.0;
                cholesky_solve(&factor, p, &mut column);
                let (name, error_of_one_sample) = (self.names[k].clone(), column[place].sqrt());
                (k, PredictedParameter { name, value: values[k], error_of_one_sample, of_interest: place >= first })
            })
            .collect();
        found.sort_by_key(|(k, _)| *k);
        Some(found.into_iter().map(|(_, parameter)| parameter).collect())
    }
}

/// Largest over smallest singular value of W from the lower triangle of WᵀW, after columns of W are divided by their lengths.
fn condition(information: &[f64], p: usize) -> Option<f64> {
    let lengths: Vec<f64> = (0..p).map(|k| information[k * p + k].sqrt()).collect();
    let scaled = Array2::from_shape_fn((p, p), |(r, c)| information[r.max(c) * p + r.min(c)] / (lengths[r] * lengths[c]));
    let (values, _) = scaled.iter().all(|v| v.is_finite()).then(|| symmetric_eigen(&scaled))??;
    Some((values[p - 1] / values[0].max(f64::EPSILON)).sqrt())
}

/// Which parameters the patterns ask for: a joint's own by its name, others by a part of their names; without patterns all.
///
/// `owners` is the joint of each parameter.
fn of_interest(names: &[String], owners: &[usize], joints: &[String], patterns: &[String]) -> Result<Vec<bool>, ExcitationError> {
    let mut found = vec![patterns.is_empty(); names.len()];
    for pattern in patterns {
        let joint = joints.iter().position(|joint| joint == pattern);
        let asked = |k: &usize| joint.map_or_else(|| !pattern.is_empty() && names[*k].contains(pattern.as_str()), |joint| owners[*k] == joint);
        let places: Vec<usize> = (0..names.len()).filter(asked).collect();
        if places.is_empty() {
            return Err(ExcitationError::Interest { pattern: pattern.clone(), known: joints.iter().chain(names).cloned().collect::<Vec<_>>().join(", ") });
        }
        places.into_iter().for_each(|k| found[k] = true);
    }
    Ok(found)
}
