//! A local fit at every line of a record.

use super::fitted::Fitted;
use super::local_lines::{Basis, Chunk, Lines, TASK, at_hz, fill};
use super::local_polynomial::{Local, LocalPolynomial};
use super::local_rational::{LocalRational, Rational};
use super::{EstimateError, check};
use crate::spread::apart;

/// The lines of a record at which a fit is made.
#[derive(Clone, Copy)]
pub(crate) enum At {
    All,
    /// Those up to a frequency, and as many as a window has.
    UpTo(f64),
    /// Independent ones of a band.
    Apart([f64; 2]),
}

/// The fit with the settings' half width, or the best of four by prediction of left-out lines, for which all lines are needed.
pub(crate) fn fit_as_set(
    trials: &[Lines],
    rate_and_len: (f64, usize),
    drivers: &[usize],
    responders: &[usize],
    (settings, at): (LocalPolynomial, At),
) -> Result<LocalFit, EstimateError> {
    let default = settings.default_half_width(drivers.len(), responders.len());
    let judged = settings.leave_one_out && settings.half_width.is_none();
    let at = if judged { At::All } else { at };
    let fit = |half_width: usize| fit(trials, rate_and_len, (drivers, responders), (settings.order, 0, half_width), (at, judged));
    if !judged {
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
    (settings, at): (LocalRational, At),
) -> Result<Fitted, EstimateError> {
    let half_width = settings.half_width.unwrap_or_else(|| settings.default_half_width(drivers.len(), responders.len()));
    fit(trials, rate_and_len, (drivers, responders), (settings.order, settings.denominator, half_width), (at, false)).map(|f| f.fitted)
}

/// A fit, and how well each line is predicted from its neighbours alone.
pub(crate) struct LocalFit {
    pub(crate) fitted: Fitted,
    /// Σ_i |e_i|²/(1 − h)² / S_ii over responders and trials, e the residual at the line and h its leverage, `[f]`; of use only where lines are
    /// judged by it.
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

/// Fits `responders` on `drivers` at lines of trials of `len` samples, with a denominator if its degree is not zero.
fn fit(
    trials: &[Lines],
    rate_and_len: (f64, usize),
    (drivers, responders): (&[usize], &[usize]),
    (order, denominator, half_width): (usize, usize, usize),
    (at, judged): (At, bool),
) -> Result<LocalFit, EstimateError> {
    let (q, m, s) = (drivers.len(), responders.len(), order + 1);
    let basis = Basis::new(half_width, s, rate_and_len.1)?;
    let width = basis.width;
    let all = 0..=basis.last;
    let hz = |k: usize| at_hz(k as f64, rate_and_len);
    let lines: Vec<usize> = match at {
        At::All => all.collect(),
        At::UpTo(highest_hz) => all.take_while(|&k| k < width || hz(k) <= highest_hz).collect(),
        At::Apart(band_hz) => apart(all.map(hz), band_hz, at_hz(basis.independent_lines(), rate_and_len)),
    };
    let degrees_of_freedom = check::degrees_of_freedom((trials.len() * (width - width.min(s))) as f64, s * q + denominator.div_ceil(m))?;
    let solve = |first: usize, mut out: Chunk<'_>| {
        let mut lines = &lines[first..lines.len().min(first + TASK)];
        if lines[0] == 0 {
            out.missing(m, q);
            lines = &lines[1..];
        }
        if denominator == 0 {
            return Local::new(trials, (drivers, responders), &basis, degrees_of_freedom, judged).solve(lines, &mut out);
        }
        let polynomial = (trials.len() * (width - s) - s * q) as f64;
        let mut rational = Rational::new(trials, drivers, responders, &basis, denominator, polynomial);
        lines.iter().for_each(|&k| rational.solve(k, basis.low(k), &mut out));
    };
    let (fitted, left_out) = fill(&lines, TASK, (m, q), rate_and_len, &basis, degrees_of_freedom, solve);
    Ok(LocalFit { fitted, left_out })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_linear::Cholesky;
    use num_complex::Complex64;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const ORDER: usize = 2;
    const HALF_WIDTH: usize = 9;

    /// Least squares of the equation as it is written, powers of r and leakage among the unknowns, over the window's lines but one; coefficients (per
    /// responder), (X Xᴴ)⁻¹ and the sums of squares that are left.
    fn written(trials: &[Lines], k: usize, low: usize, without: Option<(usize, usize)>) -> (Vec<Vec<Complex64>>, Vec<Complex64>, Vec<f64>) {
        let (terms, width) = (ORDER + 1, 2 * HALF_WIDTH + 1);
        let unknowns = terms * (2 + trials.len());
        let mut rows: Vec<(Vec<Complex64>, [Complex64; 2])> = Vec::new();
        for (t, trial) in trials.iter().enumerate() {
            for line in (low..low + width).filter(|line| without != Some((t, *line))) {
                let at = |channel: usize| trial.window(channel, line, 1)[0];
                let power = |s: usize| ((line as f64 - k as f64) / HALF_WIDTH as f64).powi(s as i32);
                let mut row = vec![Complex64::default(); unknowns];
                for s in 0..terms {
                    (0..2).for_each(|j| row[j * terms + s] = at(j) * power(s));
                    row[(2 + t) * terms + s] = Complex64::from(power(s));
                }
                rows.push((row, [at(2), at(3)]));
            }
        }
        let mut gram = Cholesky::new(unknowns);
        assert!(gram.factor(|i, j| rows.iter().map(|(x, _)| x[i] * x[j].conj()).sum()));
        let mut inverse = vec![Complex64::default(); unknowns * unknowns];
        gram.inverse(&mut inverse);
        let coefficients: Vec<Vec<Complex64>> = (0..2)
            .map(|i| {
                let mut b: Vec<Complex64> = (0..unknowns).map(|a| rows.iter().map(|(x, y)| y[i] * x[a].conj()).sum()).collect();
                gram.whiten(&mut b);
                gram.unwhiten(&mut b);
                b
            })
            .collect();
        let told = |theta: &[Complex64], x: &[Complex64]| theta.iter().zip(x).map(|(a, b)| a * b).sum::<Complex64>();
        let left = (0..2).map(|i| rows.iter().map(|(x, y)| (y[i] - told(&coefficients[i], x)).norm_sqr()).sum()).collect();
        (coefficients, inverse, left)
    }

    /// Two trials of four channels, the last two of which answer the first.
    fn answered() -> Vec<Lines> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut one = || {
            let mut channels: Vec<Vec<f64>> = (0..4).map(|_| (0..151).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
            for n in 1..151 {
                channels[2][n] += 0.7 * channels[2][n - 1] + channels[0][n] - 0.3 * channels[1][n - 1];
                channels[3][n] += 0.5 * channels[3][n - 1] + channels[1][n];
            }
            Lines::new(10.0, &channels.iter().map(Vec::as_slice).collect::<Vec<_>>())
        };
        vec![one(), one()]
    }

    /// What the leakage polynomial leaves of a channel in a window.
    fn without_leakage(trial: &Lines, channel: usize, low: usize) -> Vec<Complex64> {
        let mut series = trial.window(channel, low, 2 * HALF_WIDTH + 1).to_vec();
        Basis::new(HALF_WIDTH, ORDER + 1, 151).expect("lines enough").project_out(&mut series);
        series
    }

    /// A driver twice has no response, no noise and no density; a responder that is a driver has no noise, which no round-off makes negative.
    #[test]
    fn what_depends_on_itself_is_told_apart() {
        let trials = answered();
        let twice = fit(&trials, (10.0, 151), (&[0, 0], &[2, 3]), (ORDER, 0, HALF_WIDTH), (At::All, false)).expect("enough lines").fitted;
        assert!([&twice.g, &twice.noise, &twice.gram_inverse, &twice.driver].iter().all(|all| all.iter().all(|v| v.is_nan())));
        let itself = fit(&trials, (10.0, 151), (&[0, 1], &[1, 0]), (ORDER, 0, HALF_WIDTH), (At::All, false)).expect("enough lines").fitted;
        for (k, noise) in itself.noise.outer_iter().enumerate().skip(1) {
            assert!((0..2).all(|i| (0.0..1e-12).contains(&noise[[i, i]].re)), "line {k}: {noise}");
        }
    }

    /// Every line, those whose window ends with the record and those of a last incomplete batch too, against the equation as it is written, and the
    /// left-out error against fits that leave the line out.
    #[test]
    fn each_line_is_solved_as_the_equation_says() {
        let trials = answered();
        let found = fit(&trials, (10.0, 151), (&[0, 1], &[2, 3]), (ORDER, 0, HALF_WIDTH), (At::All, true)).expect("a fit");
        let (terms, width, last) = (ORDER + 1, 2 * HALF_WIDTH + 1, 75);
        assert_eq!(found.fitted.g.dim(), (last + 1, 2, 2));
        assert!(found.fitted.g[[0, 0, 0]].is_nan() && found.fitted.driver[[0, 1, 1]].is_nan() && found.left_out[0].is_nan());
        for k in 1..=last {
            let low = (k.max(HALF_WIDTH + 1) - HALF_WIDTH).min(last + 1 - width);
            let (coefficients, inverse, left) = written(&trials, k, low, None);
            let unknowns = coefficients[0].len();
            let near = |a: Complex64, b: Complex64, of: f64| assert!((a - b).norm() < 1e-9 * of, "line {k}: {a} and {b}");
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                near(found.fitted.g[[k, i, j]], coefficients[i][j * terms], 1.0);
                let spread = |i: usize, j: usize| inverse[i * terms * unknowns + j * terms];
                near(found.fitted.gram_inverse[[k, i, j]], spread(i, j), spread(i, i).norm());
                // Drivers' density without leakage, which takes R + 1 lines of each trial's window.
                let dot =
                    |trial: &Lines| without_leakage(trial, i, low).iter().zip(without_leakage(trial, j, low)).map(|(a, b)| a * b.conj()).sum::<Complex64>();
                near(found.fitted.driver[[k, i, j]], trials.iter().map(dot).sum::<Complex64>() / (2 * (width - terms)) as f64, 1.0);
            }
            let mut left_out = 0.0;
            for i in 0..2 {
                near(found.fitted.noise[[k, i, i]], Complex64::from(left[i] / found.fitted.degrees_of_freedom), left[i]);
                let own = |t: usize, line: usize| trials[t].window(2 + i, line, 1)[0];
                // What the leakage polynomial leaves of the responder: of its power the errors are told as a share.
                let power: f64 = trials.iter().flat_map(|trial| without_leakage(trial, 2 + i, low)).map(|v| v.norm_sqr()).sum();
                for t in 0..2 {
                    let (theta, _, _) = written(&trials, k, low, Some((t, k)));
                    let told = theta[i][0] * trials[t].window(0, k, 1)[0] + theta[i][terms] * trials[t].window(1, k, 1)[0] + theta[i][(2 + t) * terms];
                    left_out += (own(t, k) - told).norm_sqr() * (2 * width) as f64 / power;
                }
            }
            near(Complex64::from(found.left_out[k]), Complex64::from(left_out), left_out);
        }
    }
}
