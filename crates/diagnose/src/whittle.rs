//! The likelihood of a balance of forces in the frequency domain, and its maximum.
//!
//! e = A F - D(θ) (T d) - Σ c G per equation and bin; with S the smoothed power of e over the blocks,
//!
//! LL = 0.9 Σ [ -ln S - |e|²/S + 2 ln |det(D (T + C Z) + A Z)| ] - Σ θ² p / 2
//!
//! (Whittle 1953). The determinant takes away the bias that a loop around the plant causes. S is the one that the residual
//! itself gives (a profile likelihood): it is estimated and used in turns.

use crate::linear::{Factor, Symmetric, dot};
use crate::state::{Cause, Column, State, Through};
use ndof_linear::square;
use num_complex::Complex64;

/// What the taper leaves of the independence of neighbouring bins.
pub(crate) const INDEPENDENCE: f64 = 0.9;

/// Power of the residual, `[equation][bin]`.
pub(crate) type Power = Vec<Vec<f64>>;

/// A maximum of the likelihood.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub theta: Vec<f64>,
    /// `[equation]`, blocks one after the other.
    pub residual: Vec<Vec<Complex64>>,
    pub power: Power,
    pub log_likelihood: f64,
    factor: Factor,
    /// Covariance of θ, and of the knobs after it, where the parameters come from instruments or from a free run.
    pub joint: Option<Symmetric>,
}

impl Fit {
    /// Covariance of θ at a fixed S.
    pub fn covariance(&self) -> Symmetric {
        if let Some(covariance) = &self.joint {
            return covariance.clone();
        }
        let mut covariance = self.factor.inverse();
        covariance.a.iter_mut().for_each(|v| *v *= 0.5 / INDEPENDENCE);
        covariance
    }
}

/// The variance of a sum of fitted numbers with these weights.
pub(crate) fn variance_of(covariance: &Symmetric, parts: &[(usize, f64)]) -> f64 {
    parts.iter().map(|(a, x)| parts.iter().map(|(b, y)| x * y * covariance.at(*a, *b)).sum::<f64>()).sum::<f64>().max(0.0)
}

/// The part of a problem that all hypotheses of a step share.
pub(crate) struct Likelihood<'a> {
    pub state: &'a State,
    pub cause: &'a Cause,
    /// Forces taken off the effort before anything is fitted, with their linear action.
    pub held: &'a [(Column, f64)],
    /// Blocks that count; all where it is `None`.
    pub blocks: Option<&'a [usize]>,
}

impl<'a> Likelihood<'a> {
    pub fn new(state: &'a State, cause: &'a Cause, held: &'a [(Column, f64)]) -> Self {
        Likelihood { state, cause, held, blocks: None }
    }

    fn block_list(&self) -> Vec<usize> {
        self.blocks.map_or_else(|| (0..self.state.layout.blocks()).collect(), <[usize]>::to_vec)
    }

    /// The effort less what is held.
    pub fn target(&self) -> Vec<Vec<Complex64>> {
        let mut y: Vec<Vec<Complex64>> = self.state.effort_spectra.iter().map(|v| v.to_vec()).collect();
        for (column, value) in self.held {
            for (i, part) in &column.parts {
                y[*i].iter_mut().zip(part.iter()).for_each(|(y, p)| *y -= p * value);
            }
        }
        y
    }

    /// What a model with these coefficients leaves of it.
    fn residual(&self, columns: &[&Column], theta: &[f64]) -> Vec<Vec<Complex64>> {
        let mut residual = self.target();
        for (column, value) in columns.iter().zip(theta) {
            for (i, part) in &column.parts {
                residual[*i].iter_mut().zip(part.iter()).for_each(|(e, p)| *e -= p * value);
            }
        }
        residual
    }

    /// Smoothed mean power over the blocks in use.
    pub fn power(&self, residual: &[Vec<Complex64>]) -> Power {
        let blocks = self.block_list();
        // Enough neighbours for 40 averages.
        let half = (40usize.div_ceil(blocks.len().max(1)) / 2).clamp(5, 20);
        smoothed(residual, &blocks, half, &self.state.layout.keep)
    }

    /// Weighted real and imaginary parts, one after the other.
    fn weighted(&self, spectrum: &[Complex64], root: &[f64], blocks: &[usize]) -> Vec<f64> {
        let lines = root.len();
        let mut values = Vec::with_capacity(2 * lines * blocks.len());
        for b in blocks {
            for (x, w) in spectrum[b * lines..(b + 1) * lines].iter().zip(root) {
                values.push(x.re * w);
                values.push(x.im * w);
            }
        }
        values
    }

    /// ln |det G| at each line, and the derivative of their sum by each coefficient.
    fn determinant(&self, columns: &[&Column], theta: &[f64], with_slope: bool) -> Option<(Vec<f64>, Vec<f64>)> {
        let layout = &self.state.layout;
        let n = layout.axes;
        let mut slope = vec![0.0; columns.len()];
        let mut logs = vec![0.0; layout.lines()];
        let imposed = matches!(self.cause, Cause::Motion | Cause::Unclear);
        let impedance = self.cause.impedance();
        let chain = &self.state.chain;
        let mut g = vec![Complex64::ZERO; n * n];
        let (mut through, mut dynamics, mut inv, mut back) = (g.clone(), g.clone(), g.clone(), g.clone());
        for k in (0..layout.lines()).filter(|k| layout.keep[*k]) {
            // Motion imposed: the effort's density, A + D C. Effort imposed or in a loop: the motion's, A Z + D (T + C Z).
            let z = impedance.map(|z| z[k].as_slice());
            g.fill(Complex64::ZERO);
            match (imposed, z) {
                (true, _) => g.copy_from_slice(&chain.effort[k]),
                (false, Some(z)) => square::add_product(&chain.effort[k], z, n, &mut g),
                (false, None) => {}
            }
            let direct = if imposed { &chain.series[k] } else { &chain.motion[k] };
            through.iter_mut().enumerate().for_each(|(q, t)| *t = if q / n == q % n { direct[q % n] } else { Complex64::ZERO });
            if let Some(z) = z {
                through.iter_mut().zip(z).enumerate().for_each(|(q, (t, z))| *t += chain.series[k][q / n] * z);
            }
            dynamics.fill(Complex64::ZERO);
            let held = self.held.iter().map(|(column, value)| (column, *value));
            for (column, value) in columns.iter().copied().zip(theta.iter().copied()).chain(held) {
                for (i, j, h) in &column.action {
                    match column.through {
                        Through::Motion => dynamics[i * n + j] += h[k] * value,
                        Through::Effort => g[i * n + j] += h[k] * value,
                    }
                }
            }
            square::add_product(&dynamics, &through, n, &mut g);
            logs[k] = square::invert_into(&mut g, &mut inv, n)?;
            if with_slope {
                back.fill(Complex64::ZERO);
                square::add_product(&through, &inv, n, &mut back);
                for (column, slope) in columns.iter().zip(&mut slope) {
                    let m = match column.through {
                        Through::Motion => &back,
                        Through::Effort => &inv,
                    };
                    for (i, j, h) in &column.action {
                        let (h, m) = (h[k], m[j * n + i]);
                        *slope += h.re * m.re - h.im * m.im;
                    }
                }
            }
        }
        logs.iter().all(|log| log.is_finite()).then_some((logs, slope))
    }

    /// The maximum over the coefficients of `columns`, S updated `rounds` times from `start`.
    ///
    /// Without `bias_free` the determinant is left out (ordinary least squares).
    pub fn fit(&self, columns: &[&Column], start: &Power, rounds: usize, bias_free: bool) -> Option<Fit> {
        let blocks = self.block_list();
        let n = columns.len();
        let y = self.target();
        let mut power = start.clone();
        // Where the motion is imposed and nothing lies in series, the determinant does not change with the coefficients.
        let rigid = || self.state.chain.series.iter().flatten().all(|c| *c == Complex64::ZERO);
        let shifts = bias_free && !(matches!(self.cause, Cause::Motion | Cause::Unclear) && rigid());
        let mut theta: Option<Vec<f64>> = None;
        let mut residual = y.clone();
        let mut last = None;
        for _ in 0..rounds.max(1) {
            let mut gram = Symmetric::zeros(n);
            let mut rhs = vec![0.0; n];
            for (i, (y, s)) in y.iter().zip(&power).enumerate() {
                let root: Vec<f64> = s.iter().map(|s| 1.0 / s.sqrt()).collect();
                let here: Vec<(usize, Vec<f64>)> = columns
                    .iter()
                    .enumerate()
                    .flat_map(|(c, column)| column.parts.iter().filter(|p| p.0 == i).map(move |p| (c, p)))
                    .map(|(c, part)| (c, self.weighted(&part.1, &root, &blocks)))
                    .collect();
                let target = self.weighted(y, &root, &blocks);
                for (p, (c, u)) in here.iter().enumerate() {
                    rhs[*c] += dot(u, &target);
                    for (d, w) in &here[..=p] {
                        let value = dot(u, w);
                        gram.add(*c, *d, if c == d && !std::ptr::eq(u, w) { 2.0 * value } else { value });
                    }
                }
            }
            for (c, column) in columns.iter().enumerate() {
                gram.a[c * n + c] += column.precision / 2.0;
            }
            let factor = gram.factor()?;
            let mut now = theta.filter(|_| shifts).unwrap_or_else(|| factor.solve(&rhs));
            for _ in 0..if shifts { 3 } else { 0 } {
                let (_, slope) = self.determinant(columns, &now, true)?;
                let shifted: Vec<f64> = rhs.iter().zip(&slope).map(|(r, b)| r + b * blocks.len() as f64).collect();
                now = factor.solve(&shifted);
            }
            residual = self.residual(columns, &now);
            power = self.power(&residual);
            theta = Some(now);
            last = Some(factor);
        }
        let theta = theta?;
        let log_det = if bias_free { self.log_determinant(columns, &theta)? } else { 0.0 };
        let mut sum = self.gaussian(&residual, &power) + 2.0 * log_det * blocks.len() as f64;
        sum -= columns.iter().zip(&theta).map(|(c, t)| 0.5 * c.precision * t * t).sum::<f64>();
        let factor = last?;
        let log_likelihood = INDEPENDENCE * sum;
        (log_likelihood.is_finite() && theta.iter().all(|t| t.is_finite())).then_some(Fit { theta, residual, power, log_likelihood, factor, joint: None })
    }

    /// Σ (−ln S − |e|²/S).
    pub fn gaussian(&self, residual: &[Vec<Complex64>], power: &Power) -> f64 {
        gaussian(residual, power, &self.block_list(), &self.state.layout.keep)
    }

    /// Σ ln |det G| over the lines that count.
    pub fn log_determinant(&self, columns: &[&Column], theta: &[f64]) -> Option<f64> {
        Some(self.determinant(columns, theta, false)?.0.iter().sum())
    }

    /// Minus log-likelihood of other blocks under a fit, with the offsets of `free` columns re-estimated there.
    pub fn score(&self, columns: &[&Column], fit: &Fit, free: &[usize], blocks: &[usize]) -> Option<f64> {
        let rest = self.whitened(columns, &fit.residual, &fit.power, free, blocks)?;
        let logs: f64 = fit.power.iter().map(|s| log_sum(s, &self.state.layout.keep)).sum();
        let log_det = self.log_determinant(columns, &fit.theta)?;
        let score = INDEPENDENCE * (rest.iter().map(|w| dot(w, w)).sum::<f64>() + (logs - 2.0 * log_det) * blocks.len() as f64);
        score.is_finite().then_some(score)
    }

    /// What a model with these coefficients leaves, over √S and with the offsets of `free` columns re-estimated: real and imaginary parts of all lines
    /// of all blocks, by equation. And its ln |det G| at each line.
    pub fn left(&self, columns: &[&Column], theta: &[f64], power: &Power, free: &[usize]) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
        let rest = self.whitened(columns, &self.residual(columns, theta), power, free, &self.block_list())?;
        let finite = rest.iter().flatten().all(|v| v.is_finite());
        finite.then_some((rest, self.determinant(columns, theta, false)?.0))
    }

    fn whitened(&self, columns: &[&Column], residual: &[Vec<Complex64>], power: &Power, free: &[usize], blocks: &[usize]) -> Option<Vec<Vec<f64>>> {
        let of = |(i, e): (usize, &Vec<Complex64>)| {
            let root: Vec<f64> = power[i].iter().map(|s| 1.0 / s.sqrt()).collect();
            let parts: Vec<Vec<f64>> = free
                .iter()
                .flat_map(|&c| columns[c].parts.iter().filter(|p| p.0 == i))
                .map(|p| self.weighted(&p.1, &root, blocks))
                .filter(|w| w.iter().any(|v| *v != 0.0))
                .collect();
            let mut rest = self.weighted(e, &root, blocks);
            if !parts.is_empty() {
                let rhs: Vec<f64> = parts.iter().map(|p| dot(p, &rest)).collect();
                let gram = Symmetric::of(parts.len(), |a, b| dot(&parts[a], &parts[b]));
                for (part, value) in parts.iter().zip(gram.factor()?.solve(&rhs)) {
                    rest.iter_mut().zip(part).for_each(|(r, p)| *r -= value * p);
                }
            }
            Some(rest)
        };
        residual.iter().enumerate().map(of).collect()
    }
}

/// Mean power over these blocks and over the lines that count within `half` of each, two among the lowest eight.
pub(crate) fn smoothed(residual: &[Vec<Complex64>], blocks: &[usize], half: usize, keep: &[bool]) -> Power {
    let lines = keep.len();
    let of = |e: &Vec<Complex64>| {
        let mean: Vec<f64> = (0..lines).map(|k| blocks.iter().map(|b| e[b * lines + k].norm_sqr()).sum::<f64>() / blocks.len() as f64).collect();
        let near = |k: usize| {
            let reach = if k < 8 { 2 } else { half };
            let range = k.saturating_sub(reach)..(k + reach + 1).min(lines);
            let kept = range.clone().filter(|q| keep[*q]).count().max(1) as f64;
            (mean[range].iter().sum::<f64>() / kept).max(1e-300)
        };
        (0..lines).map(near).collect()
    };
    residual.iter().map(of).collect()
}

/// Σ (−ln S − |e|²/S) over these blocks.
pub(crate) fn gaussian(residual: &[Vec<Complex64>], power: &Power, blocks: &[usize], keep: &[bool]) -> f64 {
    let lines = keep.len();
    let mut sum = 0.0;
    for (e, s) in residual.iter().zip(power) {
        for b in blocks {
            sum -= e[b * lines..(b + 1) * lines].iter().zip(s).map(|(e, s)| e.norm_sqr() / s).sum::<f64>();
        }
        sum -= blocks.len() as f64 * log_sum(s, keep);
    }
    sum
}

fn log_sum(power: &[f64], keep: &[bool]) -> f64 {
    power.iter().zip(keep).filter(|(_, keep)| **keep).map(|(s, _)| s.ln()).sum()
}

/// Mean of |e|² / S.
pub(crate) fn whitened_power(residual: &[Vec<Complex64>], power: &Power) -> f64 {
    let mut sum = 0.0;
    for (e, s) in residual.iter().zip(power) {
        sum += e.chunks(s.len()).map(|block| block.iter().zip(s).map(|(e, s)| e.norm_sqr() / s).sum::<f64>()).sum::<f64>() / e.len().max(1) as f64;
    }
    sum / residual.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Layout;
    use crate::state::Transform;
    use ndof_models::effects::{Action, Matrix};
    use std::sync::Arc;

    /// Of masses that a force pushes G = D T: each axis adds the logarithm of its own correction, and of no other's.
    #[test]
    fn the_correction_of_one_axis_adds_its_own_logarithm_to_the_determinant() {
        let layout = Arc::new(Layout::new(1, 2, 4000, 100.0, (0.5, 12.0)));
        let tracks = vec![(0..2).map(|axis| layout.track(&(0..4000).map(|k| f64::from((k * (7 + axis) % 101) as u8)).collect::<Vec<_>>())).collect::<Vec<_>>()];
        let operator = |s: Complex64, k: &[f64]| 1.0 + s * k[0];
        let log_det = |transforms: &[Transform]| {
            let state = State::new(&layout, &tracks, &tracks, &[0.0, 0.0], transforms);
            let mass = state.entries_column(Matrix::Mass, &[(0, 0, 1.0), (1, 1, 1.0)]);
            Likelihood::new(&state, &Cause::Effort, &[]).log_determinant(&[&mass], &[2.0]).expect("no line is singular")
        };
        let late = |axis: Option<usize>| Transform { action: Action::Motion(Arc::new(operator)), axis, knobs: vec![0.02] };
        let expected: f64 = layout.sj.iter().zip(&layout.keep).filter(|(_, keep)| **keep).map(|(s, _)| operator(*s, &[0.02]).norm().ln()).sum();
        let plain = log_det(&[]);
        for (transforms, times) in [(vec![late(Some(0))], 1.0), (vec![late(Some(1))], 1.0), (vec![late(None)], 2.0), (vec![late(Some(0)), late(Some(1))], 2.0)]
        {
            let added = log_det(&transforms) - plain;
            assert!((added - times * expected).abs() < 1e-9 * expected, "{added} of {times} times {expected}");
        }
    }
}
