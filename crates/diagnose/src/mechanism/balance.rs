//! What a simulated robot lacks, as a force on its endpoint, block by block.

use super::simulated::Mechanism;
use crate::along::interleave;
use crate::layout::Layout;
use crate::linear::Symmetric;
use crate::samples::Samples;
use crate::whittle::{INDEPENDENCE, Power, gaussian, smoothed};
use num_complex::Complex64;

/// Step of a numerical derivative, as a share of the parameter.
const STEP: f64 = 1e-4;
/// Samples of the recording on either side of a tick whose mean is recorded: the hold acts from the tick on, the record is the mean after it.
const HALF: f64 = 0.5;

/// Endpoint motion and force of all trials at the working rate.
pub(super) struct Balance<'a> {
    pub mechanism: &'a dyn Mechanism,
    pub layout: Layout,
    /// `[trial]`, axis beside axis: displacement, velocity, acceleration.
    motion: Vec<[Vec<f64>; 3]>,
    /// Command less hold less measured force, `[axis]`, blocks one after the other.
    given: Vec<Vec<Complex64>>,
    /// The same in time, `[trial][axis][time]`, for what is told about sizes.
    pub given_rms: Vec<f64>,
}

/// Parameters fitted.
#[derive(Clone)]
pub(super) struct Fitted {
    /// All values, the nominal ones included.
    pub values: Vec<f64>,
    pub log_likelihood: f64,
    pub residual: Vec<Vec<Complex64>>,
    pub power: Power,
    /// Covariance of the fitted ones, in the order in which they were asked for.
    pub covariance: Vec<Vec<f64>>,
}

/// The controller's force from displacement as the record shows it: means over the intervals that follow the ticks.
pub(super) fn hold_on_means(mechanism: &dyn Mechanism, axis: usize, s: Complex64, sample_s: f64) -> Complex64 {
    mechanism.hold(axis, s) * (-s * (HALF * sample_s)).exp()
}

impl<'a> Balance<'a> {
    pub fn new(samples: &Samples, band_hz: (f64, f64), mechanism: &'a dyn Mechanism) -> Self {
        let (trials, axes) = (samples.effort.len(), samples.effort[0].len());
        let layout = Layout::new(trials, axes, samples.len(), samples.rate_hz, band_hz);
        let sample_s = 1.0 / samples.rate_hz;
        let mut motion = Vec::new();
        let mut given: Vec<Vec<Vec<f64>>> = Vec::new();
        for trial in 0..trials {
            let tracks: Vec<_> = samples.motion[trial].iter().map(|x| layout.track(x)).collect();
            let smooth = Some(layout.smooth.as_slice());
            let series = |order: i32, extra: Option<&[f64]>| tracks.iter().map(|t| layout.filtered(t, |s| s.powi(order), extra)).collect::<Vec<_>>();
            let beside = |order: i32, extra: Option<&[f64]>| interleave(&series(order, extra));
            motion.push([beside(0, None), beside(1, smooth), beside(2, smooth)]);
            given.push(
                (0..axes)
                    .map(|i| {
                        let command = layout.filtered(&layout.track(&samples.reference[trial][i]), |_| Complex64::ONE, smooth);
                        let force = layout.filtered(&layout.track(&samples.effort[trial][i]), |_| Complex64::ONE, smooth);
                        let hold = layout.filtered(&tracks[i], |s| hold_on_means(mechanism, i, s, sample_s), smooth);
                        command.iter().zip(&force).zip(&hold).map(|((c, f), h)| c - f - h).collect()
                    })
                    .collect(),
            );
        }
        let spectra = (0..axes).map(|i| layout.spectra(given.iter().map(|t: &Vec<Vec<f64>>| t[i].as_slice()))).collect::<Vec<_>>();
        let given_rms = spectra.iter().map(|x| rms(x)).collect();
        Balance { mechanism, layout, motion, given: spectra, given_rms }
    }

    /// What the motion needs beyond what is given, `[axis]`, blocks one after the other; `None` where there is no such robot.
    fn residual(&self, values: &[f64]) -> Option<Vec<Vec<Complex64>>> {
        let axes = self.layout.axes;
        let mut robot = self.mechanism.with(values)?;
        let mut needed = vec![vec![Vec::with_capacity(self.layout.samples); self.layout.trials]; axes];
        let mut force = vec![0.0; axes];
        for (trial, [x, v, a]) in self.motion.iter().enumerate() {
            for k in 0..self.layout.samples {
                let at = k * axes..(k + 1) * axes;
                if !robot.needed(&x[at.clone()], &v[at.clone()], &a[at], &mut force) {
                    return None;
                }
                needed.iter_mut().zip(&force).for_each(|(n, f)| n[trial].push(*f));
            }
        }
        let out: Vec<Vec<Complex64>> = needed
            .iter()
            .zip(&self.given)
            .map(|(trials, given)| {
                let mut e = self.layout.spectra(trials.iter().map(Vec::as_slice));
                e.iter_mut().zip(given).for_each(|(e, g)| *e -= g);
                self.without_offsets(&mut e);
                e
            })
            .collect();
        out.iter().flatten().all(|e| e.is_finite()).then_some(out)
    }

    /// Takes a constant off each trial: the lowest lines of a block hold nothing else that the robot's parameters make.
    fn without_offsets(&self, e: &mut [Complex64]) {
        let (lines, blocks) = (self.layout.lines(), self.layout.starts.len());
        let mut one = Vec::new();
        self.layout.blocks_of(0, &vec![1.0; self.layout.samples], &mut one);
        let norm: f64 = one.iter().map(Complex64::norm_sqr).sum();
        if norm <= 0.0 {
            return;
        }
        for trial in e.chunks_mut(lines * blocks) {
            let c = trial.iter().zip(&one).map(|(e, o)| e.re * o.re + e.im * o.im).sum::<f64>() / norm;
            trial.iter_mut().zip(&one).for_each(|(e, o)| *e -= o * c);
        }
    }

    /// Mean power over all blocks and five lines to either side.
    fn power(&self, residual: &[Vec<Complex64>]) -> Power {
        smoothed(residual, &self.blocks(), 5, &self.layout.keep)
    }

    fn log_likelihood(&self, residual: &[Vec<Complex64>], power: &Power) -> f64 {
        INDEPENDENCE * gaussian(residual, power, &self.blocks(), &self.layout.keep)
    }

    fn blocks(&self) -> Vec<usize> {
        (0..self.layout.blocks()).collect()
    }

    /// The likeliest values of the parameters `moved`, all others as in `start`, by `rounds` - 1 steps of Gauss and Newton.
    pub fn fit(&self, start: &[f64], moved: &[usize], rounds: usize) -> Option<Fitted> {
        let mut values = start.to_vec();
        let mut residual = self.residual(&values)?;
        let mut power = self.power(&residual);
        let mut covariance = vec![vec![0.0; moved.len()]; moved.len()];
        let mut level = self.log_likelihood(&residual, &power);
        for round in 0..if moved.is_empty() { 0 } else { rounds } {
            let slopes: Vec<Vec<Vec<Complex64>>> = moved
                .iter()
                .map(|&p| {
                    let step = STEP * values[p].abs().max(self.mechanism.parameters()[p].value.abs()).max(1e-3);
                    let mut there = values.clone();
                    there[p] += step;
                    let ahead = self.residual(&there)?;
                    Some(ahead.iter().zip(&residual).map(|(a, e)| a.iter().zip(e).map(|(a, e)| (a - e) / step).collect()).collect())
                })
                .collect::<Option<_>>()?;
            let inner = |a: &[Vec<Complex64>], b: &[Vec<Complex64>]| -> f64 {
                a.iter()
                    .zip(b)
                    .zip(&power)
                    .map(|((a, b), s)| a.iter().zip(b).enumerate().map(|(k, (x, y))| (x.re * y.re + x.im * y.im) / s[k % s.len()]).sum::<f64>())
                    .sum()
            };
            let gram = Symmetric::of(moved.len(), |a, b| inner(&slopes[a], &slopes[b]));
            let rhs: Vec<f64> = slopes.iter().map(|s| -inner(s, &residual)).collect();
            let factor = gram.factor()?;
            let inverse = factor.inverse();
            for (a, row) in covariance.iter_mut().enumerate() {
                row.iter_mut().enumerate().for_each(|(b, c)| *c = inverse.at(a, b) * 0.5 / INDEPENDENCE);
            }
            if round + 1 == rounds {
                break;
            }
            let step = factor.solve(&rhs);
            // Shorter steps where the whole one leads to no robot or to a worse one.
            let mut share = 1.0;
            let taken = loop {
                let there: Vec<f64> = {
                    let mut there = values.clone();
                    moved.iter().zip(&step).for_each(|(&p, s)| there[p] += share * s);
                    there
                };
                if let Some(e) = self.residual(&there) {
                    let s = self.power(&e);
                    let next = self.log_likelihood(&e, &s);
                    if next > level {
                        break Some((there, e, s, next));
                    }
                }
                share *= 0.5;
                if share < 0.05 {
                    break None;
                }
            };
            let Some(next) = taken else { continue };
            (values, residual, power, level) = next;
        }
        Some(Fitted { values, log_likelihood: level, residual, power, covariance })
    }
}

/// Root of the mean power of spectra.
pub(super) fn rms(spectrum: &[Complex64]) -> f64 {
    (spectrum.iter().map(Complex64::norm_sqr).sum::<f64>() / spectrum.len().max(1) as f64).sqrt()
}
