//! The parameters of a final model by instruments: what the reference foretells of every channel, which no noise of limb or sensor reaches.
//!
//! Σ Re Wᴴ S⁻¹ e(θ) = 0 over blocks and frequencies, e the balance of forces along the measured channels and W = -∂e/∂θ along the foretold ones.
//! With A = Σ Re Wᴴ S⁻¹ (-∂e/∂θ) the covariance is A⁻¹ (Σ Re Wᴴ S⁻¹ W) A⁻ᵀ/2. A likelihood has to know where noise enters, at the limb or at
//! one of the sensors; this does not.
//!
//! Söderström & Stoica 2002, Instrumental variable methods for system identification.

use crate::layout::Track;
use crate::linear::Symmetric;
use crate::plant::Structure;
use crate::search::{Assembly, Channels, Chosen, Stand};
use crate::state::{Cause, Column, Tracks};
use crate::subject::Subject;
use crate::whittle::{INDEPENDENCE, Likelihood, Power};
use ndof_linear::square;
use num_complex::Complex64;
use rayon::prelude::*;

/// Averages for each reference in what it foretells: of the noise one part in so many stays in the instruments.
const AVERAGES: usize = 20;
/// Steps of Gauss and Newton.
const STEPS: usize = 20;
/// A step shorter than this share of each standard error is the last.
const STILL: f64 = 0.02;
/// Step of a knob's derivative, as a share of it or of its range.
const MOVED: f64 = 1e-3;

/// Spectra of all equations, one after the other.
type Spectra = Vec<Complex64>;

impl Subject {
    /// A model with its parameters found by instruments; `None` without a reference, or where the equations have no solution within the bounds.
    pub fn by_instruments(&self, chosen: &[Chosen], stand: &Stand) -> Option<(Vec<Chosen>, Stand)> {
        let (effort, motion) = (self.foretold(&self.effort)?, self.foretold(&self.motion)?);
        let along = Channels { effort: &effort, motion: &motion, ..self.own() };
        let structure = &self.structure;
        let mut chosen = chosen.to_vec();
        let mut theta = stand.fit.theta.clone();
        let power = &stand.fit.power;
        for _ in 0..STEPS {
            let model_along = |channels: Channels<'_>| {
                let model = self.assemble(structure, &chosen, channels);
                let slopes = self.slopes(structure, &chosen, &theta, &model, channels);
                (model, slopes)
            };
            let ((measured, slopes), (_, instruments)) = rayon::join(|| model_along(self.own()), || model_along(along));
            let residual = self.residual(&measured, &theta);
            let precision: Vec<f64> = measured.columns().map(|c| 0.5 * c.precision).collect();
            let pull: Vec<f64> = precision.iter().zip(&theta).map(|(p, t)| -p * t).collect();
            let (step, covariance) = self.step_and_covariance(&instruments, &slopes, &residual, (&precision, &pull), power)?;
            let still = step.iter().enumerate().all(|(k, d)| d.abs() <= STILL * covariance.at(k, k).sqrt());
            if still {
                let mut fit = stand.fit.clone();
                fit.residual = residual.chunks(self.layout.size()).map(<[Complex64]>::to_vec).collect();
                (fit.theta, fit.joint) = (theta, Some(covariance));
                let Assembly { state, base, terms, spans } = measured;
                let found = Stand { state, base, terms, spans, fit, run: None };
                let admitted = chosen.iter().enumerate().all(|(q, c)| self.hypotheses[c.hypothesis].form.admits(&c.knobs, self.coefficients(&found, q)));
                return admitted.then_some((chosen, found));
            }
            let (coefficients, knobs) = step.split_at(theta.len());
            theta.iter_mut().zip(coefficients).for_each(|(t, d)| *t += d);
            self.move_knobs(&mut chosen, knobs);
        }
        None
    }

    /// Knobs after a step, at most doubled or halved and within their bounds.
    fn move_knobs(&self, chosen: &mut [Chosen], step: &[f64]) {
        let mut step = step.iter();
        for c in chosen {
            for (value, knob) in c.knobs.iter_mut().zip(&self.hypotheses[c.hypothesis].form.knobs) {
                let moved = *value + step.next().copied().unwrap_or(0.0);
                let (least, most) = if knob.log { (0.5 * *value, 2.0 * *value) } else { (knob.lo, knob.hi) };
                *value = moved.clamp(least.max(knob.lo), most.min(knob.hi));
            }
        }
    }

    /// The balance of forces that is left.
    fn residual(&self, model: &Assembly, theta: &[f64]) -> Spectra {
        let mut left: Spectra = Likelihood::new(&model.state, &self.cause, &model.base.held).target().concat();
        model.columns().zip(theta).for_each(|(column, value)| self.add(column, -value, &mut left));
        left
    }

    fn add(&self, column: &Column, factor: f64, to: &mut [Complex64]) {
        let size = self.layout.size();
        for (i, part) in &column.parts {
            to[i * size..(i + 1) * size].iter_mut().zip(part.iter()).for_each(|(t, p)| *t += p * factor);
        }
    }

    /// -∂e by each coefficient and each knob.
    fn slopes(&self, structure: &Structure, chosen: &[Chosen], theta: &[f64], at: &Assembly, channels: Channels<'_>) -> Vec<Spectra> {
        let nought = || vec![Complex64::ZERO; self.layout.axes * self.layout.size()];
        let mut out: Vec<Spectra> = at
            .columns()
            .map(|column| {
                let mut own = nought();
                self.add(column, 1.0, &mut own);
                own
            })
            .collect();
        let places: Vec<(usize, usize)> = chosen.iter().enumerate().flat_map(|(q, c)| (0..c.knobs.len()).map(move |k| (q, k))).collect();
        let by_knob = |&(q, k): &(usize, usize)| -> Spectra {
            let h = &self.hypotheses[chosen[q].hypothesis];
            let knob = &h.form.knobs[k];
            let step = MOVED * if knob.log { chosen[q].knobs[k] } else { knob.hi - knob.lo };
            let side = |sign: f64| -> Spectra {
                let mut moved = chosen.to_vec();
                moved[q].knobs[k] += sign * step;
                if h.corrects() {
                    return self.residual(&self.assemble(structure, &moved, channels), theta);
                }
                let (first, count) = at.spans[q];
                let own = &theta[at.base.columns.len() + first..][..count];
                let mut left = nought();
                h.columns(&at.state, &moved[q].knobs).iter().zip(own).for_each(|(column, value)| self.add(column, -value, &mut left));
                left
            };
            let (up, down) = (side(1.0), side(-1.0));
            down.iter().zip(&up).map(|(d, u)| (d - u) / (2.0 * step)).collect()
        };
        out.par_extend(places.par_iter().map(by_knob));
        out
    }

    /// The step of Gauss and Newton, and the covariance of what it ends at; `precision` is that of priors, and `pull` what they and determinants add to
    /// the equations.
    pub fn step_and_covariance(
        &self,
        instruments: &[Spectra],
        slopes: &[Spectra],
        residual: &[Complex64],
        (precision, pull): (&[f64], &[f64]),
        power: &Power,
    ) -> Option<(Vec<f64>, Symmetric)> {
        let n = slopes.len();
        let weight: Vec<f64> = power.iter().flat_map(|s| (0..self.layout.blocks()).flat_map(move |_| s.iter().map(|s| 1.0 / s))).collect();
        let inner = |a: &[Complex64], b: &[Complex64]| a.iter().zip(b).zip(&weight).map(|((a, b), w)| (a.re * b.re + a.im * b.im) * w).sum::<f64>();
        let prior = |a: usize, b: usize| if a == b { precision.get(a).copied().unwrap_or(0.0) } else { 0.0 };
        let normal: Vec<f64> = (0..n * n).map(|k| inner(&instruments[k / n], &slopes[k % n]) + prior(k / n, k % n)).collect();
        let own: Vec<f64> = (0..n * n).map(|k| inner(&instruments[k / n], &instruments[k % n]) + prior(k / n, k % n)).collect();
        let right: Vec<f64> = (0..n).map(|a| inner(&instruments[a], residual) + pull.get(a).copied().unwrap_or(0.0)).collect();
        // Parameters of all sizes side by side: each in the unit in which its instrument has power one.
        let unit: Vec<f64> = (0..n).map(|a| own[a * n + a].sqrt().recip()).collect();
        let scaled = |m: &[f64]| -> Vec<f64> { (0..n * n).map(|k| m[k] * unit[k / n] * unit[k % n]).collect() };
        let inverse = square::inverse(&scaled(&normal), n)?;
        // What each line of each block adds to the equations, as large as it was there: the spectrum of a slow drift is steeper than its smooth estimate.
        let points = residual.len() as f64;
        let scores: Vec<Vec<f64>> =
            instruments.iter().map(|w| w.iter().zip(residual).zip(&weight).map(|((w, e), s)| (w.re * e.re + w.im * e.im) * s).collect()).collect();
        let scatter: Vec<f64> =
            (0..n * n).map(|k| crate::linear::dot(&scores[k / n], &scores[k % n]) * points / (points - n as f64) + 0.5 * prior(k / n, k % n)).collect();
        let spread = square::sandwich(&inverse, &scaled(&scatter), &square::adjoint(&inverse, n), n);
        let step = (0..n).map(|a| unit[a] * (0..n).map(|b| inverse[a * n + b] * unit[b] * right[b]).sum::<f64>()).collect();
        let covariance = Symmetric::of(n, |a, b| 1.0 / INDEPENDENCE * unit[a] * unit[b] * spread[a * n + b]);
        covariance.a.iter().all(|v| v.is_finite()).then_some((step, covariance))
    }

    /// What the reference foretells of channels within the band, by responses that are means over neighbouring frequencies, about the mean of the channel.
    fn foretold(&self, channels: &Tracks) -> Option<Tracks> {
        let layout = &self.layout;
        if !layout.schedule.is_empty() {
            return None;
        }
        // What an imposed motion leaves unexplained is the effort's noise: the motion is its own instrument, and foretells the effort.
        let by = if matches!(self.cause, Cause::Motion) { &self.motion } else { &self.reference };
        if std::ptr::eq(channels, by) {
            return Some(channels.clone());
        }
        let references = by.first().filter(|r| !r.is_empty())?.len();
        let spectra = |tracks: &Tracks, channel: usize| -> Spectra {
            let about_mean = |trial: &Vec<Track>| {
                let mut x = layout.filtered(&trial[channel], |_| Complex64::ONE, None);
                let mean = x.iter().sum::<f64>() / x.len() as f64;
                x.iter_mut().for_each(|v| *v -= mean);
                x
            };
            let trials: Vec<Vec<f64>> = tracks.iter().map(about_mean).collect();
            layout.spectra(trials.iter().map(Vec::as_slice))
        };
        let r: Vec<Spectra> = (0..references).map(|c| spectra(by, c)).collect();
        let (lines, blocks) = (layout.lines(), layout.blocks());
        let reach = (AVERAGES * references).div_ceil(blocks) / 2;
        let around = |k: usize| k.saturating_sub(reach)..(k + reach + 1).min(lines);
        let product = |a: &[Complex64], b: &[Complex64], k: usize| -> Complex64 {
            (0..blocks).flat_map(|block| around(k).map(move |q| block * lines + q)).map(|q| a[q] * b[q].conj()).sum()
        };
        let inverses: Vec<Option<Vec<Complex64>>> = (0..lines)
            .map(|k| square::inverse(&(0..references * references).map(|q| product(&r[q / references], &r[q % references], k)).collect::<Vec<_>>(), references))
            .collect();
        let axes = channels.first()?.len();
        let mut out = channels.clone();
        for axis in 0..axes {
            let x = spectra(channels, axis);
            let responses: Vec<Vec<Complex64>> = (0..lines)
                .map(|k| {
                    let along: Vec<Complex64> = r.iter().map(|r| product(&x, r, k)).collect();
                    let row =
                        |inverse: &Vec<Complex64>| (0..references).map(|c| (0..references).map(|d| along[d] * inverse[d * references + c]).sum()).collect();
                    inverses[k].as_ref().map_or_else(|| vec![Complex64::ZERO; references], row)
                })
                .collect();
            for (trial, references) in out.iter_mut().zip(by) {
                let measured = layout.filtered(&trial[axis], |_| Complex64::ONE, None);
                let foretold = |s: &Complex64, k: usize| -> Complex64 {
                    let place = (s.im / std::f64::consts::TAU - layout.frequency_hz[0]) / (layout.rate_hz / layout.block as f64);
                    let (below, share) = (place.max(0.0).floor() as usize, place.max(0.0).fract());
                    if k == 0 || place < -0.5 || below >= lines {
                        return Complex64::ZERO;
                    }
                    let response = |c: usize| responses[below][c] + (responses[(below + 1).min(lines - 1)][c] - responses[below][c]) * share;
                    references.iter().enumerate().map(|(c, r)| response(c) * r.spectrum[k]).sum()
                };
                let spectrum = layout.s.iter().enumerate().map(|(k, s)| foretold(s, k)).collect();
                trial[axis] = Track { spectrum, start: measured.iter().sum::<f64>() / measured.len() as f64, slope_per_s: 0.0 };
            }
        }
        Some(out)
    }
}

impl Assembly {
    /// Those of the baseline and then those of the causes.
    pub fn columns(&self) -> impl Iterator<Item = &Column> {
        self.base.columns.iter().chain(&self.terms)
    }
}
