//! Output-error fits over whole trials or windows of them.

use super::error::FreeRunError;
use super::innovations::{Disturbance, LimbNoise, filters, most_likely};
use super::noise::{Colour, coefficients};
use super::search::{FINE, ROUGH, begin, solve};
use super::shooting::{OutputFilter, Shooting, Window};
use super::small_sample::small_sample;
use super::trial::Prepared;
use super::{Causality, Mechanism, Noise, TimeTrial};
use crate::fit::{Information, t_quantile};
use crate::{Minimum, Parameter, StopReason};
use faer::Mat;
use ndarray::Array2;
use ndof_signal::{Passband, SosFilter, deviation, rms};
use serde::{Deserialize, Serialize};

/// Settings of a free-run fit: minimises Σ (y − ŷ(θ, x₀))² / σ² where ŷ runs free from what was imposed over windows with
/// fitted initial states, σ the rms residual of each axis.
///
/// A mechanism without a spring drifts away in long runs; windows of some seconds keep it in reach (multiple shooting).
///
/// ```
/// use ndof_models::time::{FreeRunFit, Noise};
/// let settings = FreeRunFit { window_s: Some(2.0), noise: Noise::Autoregressive(4), ..FreeRunFit::new(500.0) };
/// assert_eq!(settings.substeps, 1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeRunFit {
    /// Sample rate.
    pub sample_rate_hz: f64,
    /// Length of a window; a whole trial if `None`.
    pub window_s: Option<f64>,
    /// What is imposed and what answers.
    pub causality: Causality,
    /// What the residuals are taken for.
    pub noise: Noise,
    /// Where it enters.
    #[serde(default)]
    pub disturbance: Disturbance,
    /// Beginning of each window that is not compared (s).
    pub settle_s: f64,
    /// Runge-Kutta steps a sample, where a law asks for them.
    pub substeps: usize,
    /// Cut-off of a zero-phase low-pass on what is compared, which then is thinned out to five samples a cycle of it.
    pub output_low_pass_hz: Option<f64>,
    /// Cut-off of a zero-phase low-pass on an imposed motion before it is differentiated.
    pub motion_low_pass_hz: Option<f64>,
}

/// A mechanism fitted in time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeRun {
    /// Parameters in the mechanism's order.
    pub theta: Vec<f64>,
    /// The same with intervals.
    pub parameters: Vec<Parameter>,
    /// Their covariance.
    pub covariance: Array2<f64>,
    /// How well it runs on the data that were fitted.
    pub score: Score,
    /// −2 log likelihood + k ln N, up to a constant of the data; the smaller, the better.
    pub bic: f64,
    /// −2 log likelihood of the same.
    pub deviance: f64,
    /// Condition number of the information matrix.
    pub condition: f64,
    /// Why the minimiser stopped.
    pub reason: StopReason,
    /// Initial positions and velocities of each window.
    pub initial: Vec<f64>,
    /// Whose interval is a profile of the likelihood ([`FreeRunFit::profiled`]), Wald's not being borne out.
    #[serde(default)]
    pub profiled: Vec<bool>,
    /// The limb's own force and the sensor's noise, where [`Disturbance::Force`] was asked for.
    pub limb_noise: Option<LimbNoise>,
    pub(super) sigma: Vec<f64>,
    pub(super) coloured: Vec<Colour>,
    /// Half width of each parameter's 95 % interval in the standard errors that the noise model would give if it were known.
    pub(super) profile_quantiles: Vec<f64>,
}

/// How near a run stays to what was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// rms(y − ŷ)/std(y) of each axis.
    pub nrmse: Vec<f64>,
    /// 100 (1 − var(y − ŷ)/var(y)) of each axis.
    pub vaf_percent: Vec<f64>,
}

/// Passes of noise model and mechanism by turns; each takes in nine tenths and more of what the last one left.
const COLOUR_PASSES: usize = 2;
/// The same for a force of the limb.
const DISTURBANCE_PASSES: usize = 2;
/// Samples that a low-passed comparison keeps of each cycle of its cut-off.
const KEPT_PER_CYCLE: f64 = 5.0;
/// Order of that low-pass, forwards and backwards.
const OUTPUT_ORDER: usize = 4;

impl FreeRunFit {
    /// Longest stretch whose residuals count as one in intervals by [`Noise::Blocks`] (s).
    pub const BLOCK_S: f64 = 2.0;

    /// Whole trials, force in and motion out, nothing known about the noise.
    pub fn new(sample_rate_hz: f64) -> Self {
        FreeRunFit {
            sample_rate_hz,
            window_s: None,
            causality: Causality::ForceIn,
            noise: Noise::Blocks,
            disturbance: Disturbance::Output,
            settle_s: 0.0,
            substeps: 1,
            output_low_pass_hz: None,
            motion_low_pass_hz: None,
        }
    }

    /// Fits the mechanism's parameters and every window's initial state.
    ///
    /// # Errors
    /// [`FreeRunError`] if the trials do not fit the mechanism, or the model is not finite at the start.
    pub fn fit(&self, mechanism: &Mechanism, trials: &[TimeTrial<'_>], start: &[f64]) -> Result<FreeRun, FreeRunError> {
        let expected = mechanism.parameters().len();
        if start.len() != expected {
            return Err(FreeRunError::StartLength { found: start.len(), expected });
        }
        let mut problem = self.problem(mechanism, trials, None)?;
        let mut rough = begin(&problem, start)?;
        problem.reweight(&rough.x);
        let mut limb_noise = None;
        if self.disturbance == Disturbance::Force {
            for _ in 0..DISTURBANCE_PASSES {
                limb_noise = Some(problem.disturb(&rough.x, limb_noise));
                rough = solve(&problem, &rough.x, ROUGH)?;
            }
            problem.reweight(&rough.x);
        }
        if let Some((order, pole)) = self.noise.whitener() {
            problem.colour(&rough.x, order, pole, None);
            for _ in 0..COLOUR_PASSES {
                rough = solve(&problem, &rough.x, ROUGH)?;
                let spread = Information::new(&rough.jacobian).inverse() * faer::Scale(problem.variance(&rough));
                problem.colour(&rough.x, order, pole, Some(&spread));
            }
        }
        let minimum = solve(&problem, &rough.x, FINE)?;
        Ok(FreeRun { limb_noise, ..self.describe(mechanism, &problem, minimum) })
    }

    /// The best of fits from several starts, compared after a rough minimisation; ties go to the earlier one.
    ///
    /// # Errors
    /// That of the last start if every one fails.
    pub fn fit_from(&self, mechanism: &Mechanism, trials: &[TimeTrial<'_>], starts: &[Vec<f64>]) -> Result<FreeRun, FreeRunError> {
        if let [start] = starts {
            return self.fit(mechanism, trials, start);
        }
        let problem = self.problem(mechanism, trials, None)?;
        let expected = problem.parameters();
        let mut best: Result<Minimum, FreeRunError> = Err(FreeRunError::StartLength { found: 0, expected });
        for start in starts {
            if start.len() != expected {
                return Err(FreeRunError::StartLength { found: start.len(), expected });
            }
            match (solve(&problem, &problem.beginning(start), ROUGH), &best) {
                (Ok(found), Ok(kept)) if found.cost >= kept.cost => {}
                (Err(_), Ok(_)) => {}
                (other, _) => best = other,
            }
        }
        self.fit(mechanism, trials, &best?.x[..expected])
    }

    /// How well fitted parameters run on trials that were not fitted: only initial states are.
    ///
    /// # Errors
    /// As [`FreeRunFit::fit`].
    pub fn validate(&self, mechanism: &Mechanism, theta: &[f64], trials: &[TimeTrial<'_>]) -> Result<Score, FreeRunError> {
        let problem = self.problem(mechanism, trials, Some(theta.to_vec()))?;
        let start = problem.beginning(&[]);
        let x = if start.is_empty() { start } else { solve(&problem, &start, FINE)?.x };
        Ok(problem.score(&x))
    }

    pub(super) fn problem<'a>(&self, mechanism: &'a Mechanism, trials: &[TimeTrial<'_>], fixed: Option<Vec<f64>>) -> Result<Shooting<'a>, FreeRunError> {
        let (n, rate) = (mechanism.axes.len(), self.sample_rate_hz);
        let mut windows = Vec::new();
        let mut prepared = Vec::new();
        for (index, trial) in trials.iter().enumerate() {
            let own = Prepared::new(trial, index + 1, n, self.causality, rate, self.motion_low_pass_hz)?;
            let samples = own.samples();
            let length = self.window_s.map_or(samples, |s| ((s * rate) as usize).clamp(2, samples.max(2)));
            let mut at = 0;
            while at + length <= samples && length >= 2 {
                // What is left behind the last whole window belongs to it.
                let end = if at + 2 * length > samples { samples } else { at + length };
                windows.push(Window { trial: index, range: at..end });
                at = end;
            }
            prepared.push(own);
        }
        if windows.is_empty() {
            return Err(FreeRunError::Empty);
        }
        if self.disturbance == Disturbance::Force && (self.output_low_pass_hz.is_some() || self.causality == Causality::MotionIn) {
            return Err(FreeRunError::Disturbance);
        }
        let filter = match self.output_low_pass_hz {
            Some(hz) => Some(OutputFilter {
                filter: SosFilter::butterworth(OUTPUT_ORDER, Passband::Low(hz), rate)?,
                keep_every: ((rate / (KEPT_PER_CYCLE * hz)) as usize).max(1),
            }),
            None => None,
        };
        let mut problem = Shooting {
            mechanism,
            causality: self.causality,
            trials: prepared,
            windows,
            sigma: vec![1.0; n],
            fixed,
            step_s: 1.0 / rate,
            substeps: self.substeps.max(1),
            settle: (self.settle_s * rate) as usize,
            filter,
            coloured: vec![Colour::default(); n],
            innovations: Vec::new(),
        };
        problem.sigma = (0..n).map(|i| problem.spread(i).max(f64::MIN_POSITIVE)).collect();
        Ok(problem)
    }

    fn describe(&self, mechanism: &Mechanism, problem: &Shooting<'_>, minimum: Minimum) -> FreeRun {
        let expected = problem.parameters();
        let (rows, columns, n) = (minimum.residuals.len() as f64, minimum.x.len() as f64, problem.axes() as f64);
        let theta = minimum.x[..expected].to_vec();
        let information = Information::new(&minimum.jacobian);
        let mut profile_quantiles = Vec::new();
        let mut quantiles = Vec::new();
        let mut all;
        if self.noise.whitener().is_some() {
            let variance = problem.variance(&minimum);
            all = information.covariance(variance);
            let small = small_sample(problem, &minimum.x, &(information.inverse() * faer::Scale(variance)), variance);
            let grows: Vec<bool> = (0..expected).map(|k| all[[k, k]].is_finite() && small.excess[(k, k)] > 0.0).collect();
            for k in 0..expected {
                let known = all[[k, k]];
                for j in (0..expected).filter(|&j| grows[k] && grows[j]) {
                    all[[k, j]] += small.excess[(k, j)];
                }
                quantiles.push(t_quantile(small.degrees[k].min((rows - columns).max(1.0))));
                profile_quantiles.push(quantiles[k] * if known.is_finite() && known > 0.0 { (all[[k, k]] / known).sqrt() } else { 1.0 });
            }
        } else {
            let (meat, blocks) = problem.meat(&minimum, Self::BLOCK_S);
            // Few blocks scatter less than many would.
            let blocks = blocks.max(2) as f64;
            all = information.sandwich(&meat, blocks / (blocks - 1.0));
            quantiles.resize(expected, t_quantile(blocks - 1.0));
            profile_quantiles.clone_from(&quantiles);
        }
        let covariance = Array2::from_shape_fn((expected, expected), |(r, c)| all[[r, c]]);
        let parameters = Parameter::describe(&mechanism.parameters(), &theta, &covariance, |k| quantiles[k], &mechanism.scales(&theta));
        // σ² of each axis at its most likely: N/n ln(σ²) each.
        let deviance: f64 = (0..problem.axes())
            .map(|i| {
                let own = minimum.residuals.iter().skip(i).step_by(problem.axes());
                let variance = own.map(|r| r * r).sum::<f64>() * n / rows * problem.sigma[i].powi(2);
                rows / n * variance.ln()
            })
            .sum();
        FreeRun {
            parameters,
            covariance,
            score: problem.score(&minimum.x),
            bic: deviance + columns * rows.ln(),
            deviance,
            condition: information.condition,
            reason: minimum.reason,
            initial: minimum.x[expected..].to_vec(),
            profiled: vec![false; expected],
            limb_noise: None,
            sigma: problem.sigma.clone(),
            coloured: problem.coloured.clone(),
            profile_quantiles,
            theta,
        }
    }
}

impl Shooting<'_> {
    /// Divides each axis by its rms residual.
    fn reweight(&mut self, x: &[f64]) {
        let errors = self.errors(x, true);
        for i in 0..self.axes() {
            let own = self.series(&errors, i).concat();
            self.sigma[i] *= rms(&own).max(1e-12);
        }
    }

    /// Takes the errors of `x` for what a force of the limb and white noise of the sensor make of its run, the search for their
    /// sizes beginning at `last`.
    pub(super) fn disturb(&mut self, x: &[f64], last: Option<LimbNoise>) -> LimbNoise {
        let windows = self.deviations(x);
        let start = last.unwrap_or_else(|| {
            let n = self.axes();
            let runner = self.runner(x);
            // The frequency at which mass and damping or stiffness are alike.
            let turn =
                |i: usize| (runner.stiffness[i * n + i].abs() / runner.mass[i * n + i]).sqrt().max(runner.damping[i * n + i].abs() / runner.mass[i * n + i]);
            LimbNoise {
                force: (0..n).map(|i| self.sigma[i] * runner.mass[i * n + i] * turn(i).powi(2)).collect(),
                corner_hz: (0..n).map(|i| turn(i) / std::f64::consts::TAU).collect(),
                sensor: self.sigma.iter().map(|s| 0.5 * s).collect(),
            }
        });
        let noise = most_likely(&windows, start, self.step_s);
        self.innovations = filters(&windows, &noise, self.step_s);
        noise
    }

    /// Weights errors as a fit with that noise of the limb did.
    pub(super) fn disturbed_as(&mut self, x: &[f64], noise: &LimbNoise) {
        self.innovations = filters(&self.deviations(x), noise, self.step_s);
    }

    /// Takes what the residuals of `x` have in common with their past for the colour of the noise, `spread` being the covariance
    /// of the unknowns.
    fn colour(&mut self, x: &[f64], order: usize, pole: f64, spread: Option<&Mat<f64>>) {
        self.coloured = (0..self.axes()).map(|i| Colour { pole, coefficients: coefficients(&self.moments(x, i, order, pole, spread)) }).collect();
        self.reweight(x);
    }

    /// Variance of whitened residuals: that of a minimum by its degrees of freedom, the noise model's taken off.
    pub(super) fn variance(&self, minimum: &Minimum) -> f64 {
        let noise: usize = self.coloured.iter().map(|c| c.coefficients.len()).sum();
        2.0 * minimum.cost / (minimum.residuals.len() as f64 - (minimum.x.len() + noise) as f64).max(1.0)
    }

    /// Standard deviation of a measured output as it is compared.
    fn spread(&self, axis: usize) -> f64 {
        let compared: Vec<f64> = self
            .windows
            .iter()
            .flat_map(|w| {
                let own = &self.trials[w.trial].output(axis)[w.range.clone()];
                let from = self.settle.min(own.len());
                match &self.filter {
                    Some(f) => f.filter.filter_zero_phase(own).unwrap_or_else(|_| own.to_vec())[from..].to_vec(),
                    None => own[from..].to_vec(),
                }
            })
            .collect();
        deviation(&compared)
    }

    /// What runs leave of the outputs, whatever the noise is taken for.
    fn score(&self, x: &[f64]) -> Score {
        let errors = self.errors(x, false);
        let (nrmse, vaf_percent) = (0..self.axes())
            .map(|i| {
                let own: Vec<f64> = self.series(&errors, i).concat().iter().map(|r| r * self.sigma[i]).collect();
                let spread = self.spread(i);
                (rms(&own) / spread, 100.0 * (1.0 - (deviation(&own) / spread).powi(2)))
            })
            .unzip();
        Score { nrmse, vaf_percent }
    }
}
