//! The mean of a series over a schedule.

use super::ScheduleError;
use super::spline::{PIECES, Splines};
use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};

/// What roughness counts beside the samples: a millionth, so that nothing but a gap between places is bridged by it.
const RIDGE: f64 = 1e-6;

/// The splines that are not nought at a sample, and their values there.
type Here = Option<[(usize, f64); PIECES]>;

/// The mean over a schedule of any series along it: the splines that lie closest to its samples. What comes back with the schedule is
/// taken out of a force balance by taking its mean out of each force, be the laws as nonlinear as they may.
///
/// # References
/// D. Ludvig & E. J. Perreault (2012), System identification of physiological systems using short data segments: the mean of an ensemble.
#[derive(Clone, Debug)]
pub struct MeanOver {
    splines: Splines,
    /// The splines at each sample, `[trial][time]`, which every series needs anew; none at those that do not count.
    here: Vec<Vec<Here>>,
    factor: Llt<f64>,
}

impl MeanOver {
    /// That of samples at these places from 0 to 1, `[trial][time]`; those at NaN do not count.
    ///
    /// # Errors
    /// [`ScheduleError::Undetermined`] without any sample that counts.
    ///
    /// ```
    /// use ndof_models::schedule::{MeanOver, Splines};
    ///
    /// let phase: Vec<f64> = (0..4000).map(|k| f64::from(k) / 1000.0 % 1.0).collect();
    /// let turn = |u: f64| (std::f64::consts::TAU * u).sin();
    /// // A movement that comes back, and a perturbation that does not.
    /// let x: Vec<f64> = phase.iter().enumerate().map(|(k, u)| turn(*u) + 0.1 * (0.0371 * k as f64).sin()).collect();
    /// let over = MeanOver::new(vec![phase], Splines::new(24, true))?;
    /// let mean = over.coefficients(&[&x]);
    /// assert!((over.splines().value(&mean, 0.25) - 1.0).abs() < 0.1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(places: Vec<Vec<f64>>, splines: Splines) -> Result<Self, ScheduleError> {
        let here: Vec<Vec<_>> = places.into_iter().map(|trial| trial.into_iter().map(|place| place.is_finite().then(|| splines.at(place))).collect()).collect();
        let mut gram = Mat::<f64>::zeros(splines.count(), splines.count());
        let mut samples = 0;
        for at in here.iter().flatten().flatten() {
            at.iter().for_each(|(i, v)| at.iter().for_each(|(j, w)| gram[(*i, *j)] += v * w));
            samples += 1;
        }
        let (roughness, weight) = (splines.roughness(), RIDGE * f64::from(samples) / splines.count() as f64);
        let whole = Mat::from_fn(splines.count(), splines.count(), |i, j| gram[(i, j)] + weight * roughness[[i, j]]);
        let factor = whole.llt(Side::Lower).map_err(|_| ScheduleError::Undetermined)?;
        Ok(MeanOver { splines, here, factor })
    }

    /// The splines of the mean.
    pub fn splines(&self) -> Splines {
        self.splines
    }

    /// Coefficients of the mean of a series, `[trial][time]`.
    pub fn coefficients(&self, series: &[&[f64]]) -> Vec<f64> {
        let mut right = Mat::<f64>::zeros(self.splines.count(), 1);
        for (value, at) in series.iter().zip(&self.here).flat_map(|(s, h)| s.iter().zip(h)) {
            at.iter().flatten().for_each(|(k, weight)| right[(*k, 0)] += weight * value);
        }
        let solution = self.factor.solve(&right);
        (0..self.splines.count()).map(|k| solution[(k, 0)]).collect()
    }

    /// A series less its mean; nothing at samples that do not count.
    pub fn deviation(&self, series: &[&[f64]]) -> Vec<Vec<f64>> {
        let mean = self.coefficients(series);
        let one = |(value, at): (&f64, &Here)| at.map_or(0.0, |at| value - at.into_iter().map(|(k, weight)| weight * mean[k]).sum::<f64>());
        series.iter().zip(&self.here).map(|(s, h)| s.iter().zip(h).map(one).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn what_comes_back_is_taken_out_and_nothing_else() {
        let phase: Vec<f64> = (0..5000).map(|k| (f64::from(k) / 500.0).fract()).collect();
        let other = |k: usize| (0.0317 * k as f64).sin();
        let series: Vec<f64> = phase.iter().enumerate().map(|(k, u)| 3.0 + (TAU * u).sin() + 0.2 * (4.0 * TAU * u).cos() + other(k)).collect();
        let counted: Vec<f64> = phase.iter().enumerate().map(|(k, u)| if (500..4500).contains(&k) { *u } else { f64::NAN }).collect();
        let over = MeanOver::new(vec![counted], Splines::new(100, true)).expect("a mean");
        let left = &over.deviation(&[&series])[0];
        assert!(left[..500].iter().chain(&left[4500..]).all(|v| *v == 0.0));
        // The mean of the other over eight cycles remains: an eighth of its power if the cycles were independent, and they are not quite.
        let rest: f64 = (500..4500).map(|k| (left[k] - other(k)).powi(2)).sum::<f64>() / (500..4500).map(|k| other(k).powi(2)).sum::<f64>();
        assert!(rest < 2.0 / 8.0, "{rest}");
        // A product with what follows the phase alone keeps nothing but the deviation of the other factor.
        let periodic: Vec<f64> = phase.iter().map(|u| 1.0 + (2.0 * TAU * u).sin()).collect();
        assert!(over.deviation(&[&periodic])[0].iter().all(|v| v.abs() < 1e-4));
    }

    #[test]
    fn a_gap_is_bridged_and_no_sample_is_an_error() {
        let places: Vec<f64> = (0..600).map(|k| f64::from(k) / 1000.0).collect();
        let over = MeanOver::new(vec![places.clone()], Splines::new(200, true)).expect("a mean");
        let mean = over.coefficients(&[&places.iter().map(|u| 2.0 + (TAU * u).sin()).collect::<Vec<_>>()]);
        let bridge: Vec<f64> = (600..1000).map(|k| over.splines().value(&mean, f64::from(k) / 1000.0)).collect();
        assert!(bridge.iter().all(|v| (0.0..4.0).contains(v)), "{bridge:?}");
        assert!(matches!(MeanOver::new(vec![vec![f64::NAN; 9]], Splines::new(8, true)), Err(ScheduleError::Undetermined)));
    }
}
