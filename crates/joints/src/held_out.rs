//! How well models predict torques that no fit saw.

use crate::blocks::block_products;
use crate::model::{Model, residual};
use crate::noise::Whitener;
use crate::table::{Series, View, later};
use ndof_signal::rms;
use ndof_sysid::two_sided_t;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A mean over blocks of time with its standard error, times their number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sum {
    pub value: f64,
    pub error: f64,
    pub blocks: usize,
}

impl Sum {
    pub fn of(blocks: &[f64]) -> Self {
        let n = blocks.len() as f64;
        let mean = blocks.iter().sum::<f64>() / n;
        let variance = blocks.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        Sum { value: n * mean, error: (n * variance).sqrt(), blocks: blocks.len() }
    }

    fn freedom(&self) -> f64 {
        (self.blocks as f64 - 1.0).max(1.0)
    }

    /// Its 95 % interval, by the scatter of the blocks.
    pub fn ci95(&self) -> [f64; 2] {
        let half = two_sided_t(0.95, self.freedom()) * self.error;
        [self.value - half, self.value + half]
    }

    /// Probability that it is above zero; none where it is not a number, as where a loss is beyond all bounds.
    pub fn positive(&self) -> f64 {
        if self.error == 0.0 {
            return if self.value > 0.0 { 1.0 } else { 0.0 };
        }
        probability(self.value / self.error, self.freedom())
    }
}

/// Student's distribution of what is so many standard errors above zero; none where that is not a number.
fn probability(t: f64, freedom: f64) -> f64 {
    if t.is_nan() { 0.0 } else { StudentsT::new(0.0, 1.0, freedom).map_or(0.5, |law| law.cdf(t)) }
}

/// Half the squares of the white residual of each block of time: what its log-likelihood is short of.
pub(crate) fn losses(view: &View<'_>, rest: &Series) -> Vec<f64> {
    let white = rest.whitened(&view.noise);
    block_products(&[&white], &white).into_iter().map(|b| 0.5 * b[0]).collect()
}

/// Log-likelihood of the held-out part that `with` has beyond `without`.
pub(crate) fn gain(view: &View<'_>, without: &Model, with: &Model) -> Sum {
    let (a, b) = (losses(view, &residual(view, without)), losses(view, &residual(view, with)));
    Sum::of(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// Probability that `with` predicts the held-out part better than `without`.
///
/// With r the white residual without and d what is taken from it, the log-likelihood gained is Σ (r·d − d·d/2) over blocks of time. Its error is that of
/// Σ r·d: by the scatter of r·d about its share g of d·d, no less than by noise of unit variance. The scatter of the gains themselves is as large as
/// their sum where a cause acts in one block alone.
pub(crate) fn sure(view: &View<'_>, without: &Model, with: &Model) -> f64 {
    better(&view.noise, [without, with].map(|model| residual(view, model)))
}

/// The same of the plain error, each joint's over what `with` leaves of it: noise that is taken for slow would let a cause be wrong about all that is slow.
pub(crate) fn falls(view: &View<'_>, without: &Model, with: &Model) -> f64 {
    let rests = [without, with].map(|model| residual(view, model));
    let plain: Vec<Whitener> = (0..view.noise.len()).map(|j| Whitener::plain(rms(&rests[1].of_joint(j)))).collect();
    better(&plain, rests)
}

fn better(noise: &[Whitener], rests: [Series; 2]) -> f64 {
    let [r, e] = rests.map(|rest| rest.whitened(noise));
    let mut taken = r.clone();
    taken.add(-1.0, &e);
    let blocks: Vec<[f64; 2]> = block_products(&[&r, &taken], &taken).into_iter().map(|b| [b[0], b[1]]).collect();
    let [score, size] = blocks.iter().fold([0.0, 0.0], |[s, q], [score, size]| [s + score, q + size]);
    let scatter: f64 = blocks.iter().map(|[s, q]| (s - score / size * q).powi(2)).sum();
    let freedom = (blocks.len() as f64 - 1.0).max(1.0);
    probability((score - 0.5 * size) / (scatter * blocks.len() as f64 / freedom).max(size).sqrt(), freedom)
}

/// rms of what a model misses of a joint's held-out torque as it was logged, over the deviation of that.
pub(crate) fn missed(view: &View<'_>, model: &Model, joint: usize) -> f64 {
    let mut all = Vec::new();
    for piece in &view.pieces {
        let (Some(first), Some(last)) = (piece.places.first(), piece.places.last()) else { continue };
        let (run, motion) = (predicted(view, model, piece.trial), &view.motions[piece.trial]);
        all.extend((*first..=*last).filter(|k| motion.moves[joint][*k]).map(|k| motion.torque[joint][k] - run[joint][k]));
    }
    rms(&all) / view.scene.joints[joint].torque
}

/// Torques of a model at every sample of a trial, `[joint][sample]`, as they would be logged.
pub(crate) fn predicted(view: &View<'_>, model: &Model, trial: usize) -> Vec<Vec<f64>> {
    let motion = &view.motions[trial];
    let mut torque = view.scene.nominal(motion);
    let logged = model.logged.columns(view.scene);
    // Channels were brought to what they should be; the columns of their forms are what is left of that.
    let of_forms = model.forms.iter().zip(&model.factors).flat_map(|(form, factors)| factors.iter().zip(&form.columns));
    for (factor, column) in logged.iter().map(|(factor, column)| (factor, column)).chain(of_forms) {
        for (joint, felt) in view.along(column, trial).iter() {
            torque[*joint].iter_mut().zip(felt).for_each(|(t, f)| *t += factor * f);
        }
    }
    for (j, torque) in torque.iter_mut().enumerate() {
        let late = model.logged.late_s[j] * view.scene.rate_hz;
        if late != 0.0 {
            *torque = later(torque, -late);
        }
        let gain = model.logged.gain_of(j);
        torque.iter_mut().for_each(|t| *t *= gain);
    }
    torque
}

#[cfg(test)]
mod tests {
    use super::Sum;

    #[test]
    fn what_is_no_number_predicts_nothing() {
        for blocks in [vec![f64::NAN, 1.0, 2.0], vec![f64::INFINITY, 1.0, f64::NEG_INFINITY], vec![f64::INFINITY; 4]] {
            assert_eq!(Sum::of(&blocks).positive(), 0.0, "{blocks:?}");
        }
        assert!(Sum::of(&[1.0, 1.1, 0.9, 1.0]).positive() > 0.99);
    }
}
