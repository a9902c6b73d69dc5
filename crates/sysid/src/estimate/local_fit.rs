//! A local fit at every line of a record.

use super::EstimateError;
use super::fitted::{Fitted, freedom};
use super::local_lines::{Basis, Chunk, Lines};
use super::local_polynomial::{Local, LocalPolynomial};
use super::local_rational::{LocalRational, Rational};
use ndarray::Array3;
use num_complex::Complex64;
use rayon::prelude::*;

const NAN: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// Lines that one task treats, so that workspaces are made once for many.
const CHUNK: usize = 256;

/// The fit with the settings' half width, or the best of four by prediction of left-out lines.
pub(crate) fn fit_as_set(
    trials: &[Lines],
    rate_and_len: (f64, usize),
    drivers: &[usize],
    responders: &[usize],
    settings: LocalPolynomial,
) -> Result<LocalFit, EstimateError> {
    let default = settings.default_half_width(drivers.len(), responders.len());
    let fit = |half_width: usize| fit(trials, rate_and_len, drivers, responders, (settings.order, 0, half_width));
    if !settings.leave_one_out || settings.half_width.is_some() {
        return fit(settings.half_width.unwrap_or(default));
    }
    let mut best = fit(default)?;
    for half_width in [3 * default / 2, 2 * default, 3 * default] {
        match fit(half_width) {
            Ok(other) if other.prediction_error() < best.prediction_error() => best = other,
            Ok(_) => {}
            Err(EstimateError::TooFewLines { .. }) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(best)
}

/// The fit of the local rational method.
pub(crate) fn fit_rational(
    trials: &[Lines],
    rate_and_len: (f64, usize),
    drivers: &[usize],
    responders: &[usize],
    settings: LocalRational,
) -> Result<Fitted, EstimateError> {
    let half_width = settings.half_width.unwrap_or_else(|| settings.default_half_width(drivers.len(), responders.len()));
    fit(trials, rate_and_len, drivers, responders, (settings.order, settings.denominator, half_width)).map(|f| f.fitted)
}

/// A fit, and how well each line is predicted from its neighbours alone.
pub(crate) struct LocalFit {
    pub(crate) fitted: Fitted,
    /// Σ_i |e_i|²/(1 − h)² / S_ii over responders and trials, e the residual at the line and h its leverage, `[f]`.
    pub(crate) left_out: Vec<f64>,
}

impl LocalFit {
    /// Mean relative error of left-out lines where the drivers drive (−30 dB of the strongest line).
    fn prediction_error(&self) -> f64 {
        let (bins, q, _) = self.fitted.driver.dim();
        let power = |f: usize| (0..q).map(|j| self.fitted.driver[[f, j, j]].re).sum::<f64>();
        let strongest = (0..bins).map(power).filter(|p| p.is_finite()).fold(0.0, f64::max);
        let driven = (0..bins).filter(|&f| power(f) > 1e-3 * strongest && self.left_out[f].is_finite());
        let (count, sum) = driven.fold((0.0, 0.0), |(n, sum), f| (n + 1.0, sum + self.left_out[f]));
        sum / count
    }
}

/// Fits `responders` on `drivers` at every line of trials of `len` samples, with a denominator if its degree is not zero.
fn fit(
    trials: &[Lines],
    (sample_rate_hz, len): (f64, usize),
    drivers: &[usize],
    responders: &[usize],
    (order, denominator, half_width): (usize, usize, usize),
) -> Result<LocalFit, EstimateError> {
    let (q, m, s, width) = (drivers.len(), responders.len(), order + 1, 2 * half_width + 1);
    let degrees_of_freedom = freedom(trials.len() * (width - width.min(s)), s * q + denominator.div_ceil(m))?;
    // Nyquist's line of an even length is real, and none of these.
    let last = (len - 1) / 2;
    let bins = last + 1;
    if last < width {
        return Err(EstimateError::TooFewLines { lines: last, needed: width });
    }
    let basis = Basis::new(half_width, s);
    let solve = |first: usize| {
        let mut local = Local::new(trials, drivers, responders, &basis);
        let polynomial = (trials.len() * (width - s) - s * q) as f64;
        let mut rational = (denominator > 0).then(|| Rational::new(trials, drivers, responders, &basis, denominator, polynomial));
        let mut out = Chunk::default();
        for k in first..bins.min(first + CHUNK) {
            if k == 0 {
                out.missing(m, q);
                continue;
            }
            let low = k.saturating_sub(half_width).clamp(1, last + 1 - width);
            match &mut rational {
                Some(rational) => rational.solve(k, low, &mut out),
                None => local.solve(k, low, degrees_of_freedom, &mut out),
            }
        }
        out
    };
    let chunks: Vec<Chunk> = (0..bins).step_by(CHUNK).collect::<Vec<_>>().into_par_iter().map(solve).collect();
    let join = |part: fn(&Chunk) -> &Vec<Complex64>, rows: usize, columns: usize| {
        let mut all = chunks.iter().flat_map(|c| part(c).iter().copied());
        Array3::from_shape_simple_fn((bins, rows, columns), || all.next().unwrap_or(NAN))
    };
    Ok(LocalFit {
        fitted: Fitted {
            frequency_hz: (0..bins).map(|k| k as f64 * sample_rate_hz / len as f64).collect(),
            g: join(|c| &c.g, m, q),
            noise: join(|c| &c.noise, m, m),
            gram_inverse: join(|c| &c.gram_inverse, q, q),
            driver: join(|c| &c.driver, q, q),
            degrees_of_freedom,
            independent_spacing_hz: basis.independent_lines() * sample_rate_hz / len as f64,
        },
        left_out: chunks.iter().flat_map(|c| c.left_out.iter().copied()).collect(),
    })
}
