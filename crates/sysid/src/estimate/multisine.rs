//! Periodic excitation: noise from the scatter between periods, nonlinear distortion from the scatter between
//! realisations and from the lines that were left out.

use super::check::degrees_of_freedom;
use super::fitted::Fitted;
use super::{DerivedEstimate, DirectEstimate, EstimateError};
use crate::labels::Labels;
use crate::ports::Ports;
use crate::quantile::fisher;
use crate::response::{FrequencyResponse, places};
use crate::uncertainty::NAN;
use ndarray::{Array2, Array3};
use ndof_linear::Cholesky;
use ndof_signal::{PeriodSpectra, Warning};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Lines of a commanded reference below this share of the strongest are round-off of its synthesis (−80 dB).
const COMMANDED: f64 = 1e-8;

/// Without a reference, lines of the inputs below this share of the strongest (−20 dB) count as not driven.
const DRIVEN: f64 = 1e-2;

/// What of the scatter of a response is noise and what is distortion, at each excited line; standard deviations, NaN
/// where the excitation cannot tell.
///
/// The residual is that of y − H u, so that a distortion between reference and input does not count.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distortion {
    /// Of the best linear approximation by noise, `[f][p][q]`.
    pub noise_std: Array3<f64>,
    /// Of the response to one realisation by nonlinearity, `[f][p][q]`; needs at least three trials more than inputs.
    pub nonlinear_std: Array3<f64>,
    /// The part of it that even nonlinearities make at even lines that were left out, `[f][p][q]`.
    pub even_std: Array3<f64>,
    /// The part of it that odd nonlinearities make at odd lines that were left out, `[f][p][q]`.
    pub odd_std: Array3<f64>,
    /// At the lines left out; empty where there are none.
    pub detection: Vec<Detection>,
}

/// What appears at lines that were not driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// Whether these are even multiples of the fundamental (x², offset) or odd ones (friction, x³).
    pub even: bool,
    /// How many lines.
    pub lines: usize,
    /// Mean power of each output there over its mean power at the driven lines, noise subtracted, in dB; −∞ where noise
    /// explains it all.
    pub level_db: Vec<f64>,
    /// The noise's share of the same.
    pub noise_db: Vec<f64>,
    /// Probability that noise alone gives as much power, all outputs together (F test).
    pub probability: f64,
    /// λ_h = Σ|u − H⁻¹ y|² / Σ|u|², noise subtracted: near 0 where what moves is driven by a distortion of the robot.
    /// NaN where H is not square or nothing stands out of the noise.
    pub lambda_limb: f64,
    /// λ_r = Σ|u + Z_r y|² / Σ|u|², Z_r = (I − T) R⁻¹: near 0 where the distortion is the limb's. NaN without references.
    pub lambda_robot: f64,
}

/// Everything that periodic trials give.
pub(crate) struct Multisine {
    pub(crate) direct: DirectEstimate,
    pub(crate) derived: Option<DerivedEstimate>,
    pub(crate) distortion: Distortion,
    pub(crate) warnings: Vec<Warning>,
}

/// Best linear approximation, its covariance and its distortions from trials with one period each.
///
/// Each trial is one experiment of one realisation; any number of them not below the number of inputs will do, and
/// orthogonal sets of q trials are the most efficient. G = Z Rᴴ (R Rᴴ)⁻¹ over the trials' mean lines, its residual
/// carries noise and nonlinearity, the scatter between periods noise alone.
///
/// Pintelon & Schoukens, System Identification, 2nd ed. 2012, ch. 4 (robust method).
pub(crate) fn multisine(trials: &[PeriodSpectra], ports: &Ports, labels: &Labels) -> Result<Multisine, EstimateError> {
    if trials.is_empty() {
        return Err(EstimateError::NoTrial);
    }
    let has_references = ports.references.len() >= ports.inputs.len();
    let (drivers, names, floor) = if has_references { (&ports.references, &labels.references, COMMANDED) } else { (&ports.inputs, &labels.inputs, DRIVEN) };
    let lines = driven_lines(trials, drivers, floor);
    if lines.is_empty() {
        return Err(EstimateError::NoLines { name: names.join("\", \"") });
    }
    let mut warnings = Vec::new();
    let by_inputs = fit(trials, &lines, &ports.inputs, &ports.outputs)?;
    let direct = by_inputs.fitted.direct(labels)?;
    let (derived, best) = if has_references {
        let joint = fit(trials, &lines, &ports.references, &ports.responders())?;
        let derived = joint.fitted.derived(&by_inputs.fitted, labels)?;
        (Some(derived), joint)
    } else {
        (None, by_inputs)
    };
    if !best.has_total {
        warnings.push(Warning::new(
            "one-realisation",
            format!("{} trial(s) for {} input(s): the intervals hold noise, not nonlinear distortion", trials.len(), drivers.len()),
            format!("record {} realisations of the multisine or more, with other phases, to have distortion in the intervals", drivers.len() + 3),
        ));
    }
    let response = derived.as_ref().map_or(&direct.response, |d| &d.response);
    let distortion = distortion(trials, &lines, ports, response, derived.as_ref(), &best);
    Ok(Multisine { direct, derived, distortion, warnings })
}

/// Lines at which a driver stands out of its noise and above `floor` times its strongest line.
fn driven_lines(trials: &[PeriodSpectra], drivers: &[usize], floor: f64) -> Vec<usize> {
    let bins = trials[0].frequency_hz().len();
    let (experiments, periods) = (trials.len() as f64, trials[0].periods() as f64);
    let ratio = fisher(1.0 - 0.01 / bins as f64, trials.len(), experiments * (periods - 1.0));
    let mut lines: Vec<usize> = drivers
        .iter()
        .flat_map(|&channel| {
            let power: Vec<f64> = (0..bins).map(|f| trials.iter().map(|t| t.mean(f, channel).norm_sqr()).sum()).collect();
            let strongest = power.iter().skip(1).copied().fold(0.0, f64::max);
            (1..(bins - 1).max(1)).filter(move |&f| {
                let noise: f64 = trials.iter().map(|t| t.noise_covariance(f, channel, channel).re).sum();
                power[f] > floor * strongest && power[f] > ratio * noise
            })
        })
        .collect();
    lines.sort_unstable();
    lines.dedup();
    lines
}

struct LineFit {
    fitted: Fitted,
    /// Whether the fitted noise holds the nonlinear scatter too.
    has_total: bool,
}

fn fit(trials: &[PeriodSpectra], lines: &[usize], drivers: &[usize], responders: &[usize]) -> Result<LineFit, EstimateError> {
    let (q, m, experiments) = (drivers.len(), responders.len(), trials.len());
    if experiments < q {
        degrees_of_freedom(experiments as f64, q)?;
    }
    // The scatter of two has a law without a variance: no fit could weigh by it.
    let has_total = experiments >= q + 3;
    let periods = trials.iter().map(PeriodSpectra::periods).sum::<usize>();
    let degrees_of_freedom = if has_total { (experiments - q) as f64 } else { (periods - experiments) as f64 };
    let grid = trials[0].frequency_hz();
    let duration_s = 1.0 / grid[1];
    let root = (duration_s / 2.0).sqrt();
    let shape = |rows: usize, columns: usize| Array3::from_elem((lines.len(), rows, columns), NAN);
    let (mut g, mut noise, mut gram_inverse, mut driver, mut period_noise) = (shape(m, q), shape(m, m), shape(q, q), shape(q, q), shape(m, m));
    let mut cholesky = Cholesky::new(q);
    let (mut row, mut inverse) = (vec![NAN; q], vec![NAN; q * q]);
    let mut rows: Vec<Complex64> = vec![NAN; m * q];
    for (l, &f) in lines.iter().enumerate() {
        let sum = |a: usize, b: usize| -> Complex64 { trials.iter().map(|t| t.mean(f, a) * t.mean(f, b).conj()).sum::<Complex64>() * (root * root) };
        for (i, j) in places(m, m) {
            let scatter: Complex64 = trials.iter().map(|t| t.noise_covariance(f, responders[i], responders[j])).sum();
            period_noise[[l, i, j]] = scatter * (root * root / experiments as f64);
        }
        for (i, j) in places(q, q) {
            driver[[l, i, j]] = sum(drivers[i], drivers[j]) / experiments as f64;
        }
        if !cholesky.factor(|i, j| sum(drivers[i], drivers[j])) {
            continue;
        }
        cholesky.inverse(&mut inverse);
        gram_inverse.index_axis_mut(ndarray::Axis(0), l).iter_mut().zip(&inverse).for_each(|(to, &from)| *to = from);
        for i in 0..m {
            (0..q).for_each(|j| row[j] = sum(responders[i], drivers[j]));
            cholesky.whiten(&mut row);
            rows[i * q..(i + 1) * q].copy_from_slice(&row);
            cholesky.unwhiten(&mut row);
            (0..q).for_each(|j| g[[l, i, j]] = row[j]);
        }
        for (i, j) in places(m, m) {
            noise[[l, i, j]] = if has_total {
                let explained: Complex64 = (0..q).map(|k| rows[i * q + k] * rows[j * q + k].conj()).sum();
                let rest = (sum(responders[i], responders[j]) - explained) / degrees_of_freedom;
                if i == j { Complex64::from(rest.re.max(0.0)) } else { rest }
            } else {
                period_noise[[l, i, j]]
            };
        }
    }
    let fitted =
        Fitted { frequency_hz: lines.iter().map(|&f| grid[f]).collect(), g, noise, gram_inverse, driver, degrees_of_freedom, independent_spacing_hz: grid[1] };
    Ok(LineFit { fitted, has_total })
}

fn distortion(
    trials: &[PeriodSpectra],
    lines: &[usize],
    ports: &Ports,
    response: &FrequencyResponse,
    derived: Option<&DerivedEstimate>,
    best: &LineFit,
) -> Distortion {
    let (p, q) = response.shape();
    let channels: Vec<usize> = ports.outputs.iter().chain(&ports.inputs).copied().collect();
    let duration_s = 1.0 / trials[0].frequency_hz()[1];
    let unit = duration_s / 2.0;
    let nan = || Array3::from_elem((lines.len(), p, q), f64::NAN);
    let mut found = Distortion { noise_std: nan(), nonlinear_std: nan(), even_std: nan(), odd_std: nan(), detection: Vec::new() };
    let single = trials.len() as f64 / ports.inputs.len() as f64;
    let input_inverse = |l: usize, j: usize| response.uncertainty.as_ref().map_or(f64::NAN, |u| u.input_inverse[[l, j, j]].re);
    let equation = |h: &Array2<Complex64>, f: usize| Residual::new(trials, f, &channels, h);

    for (l, &f) in lines.iter().enumerate() {
        let at = equation(&response.at(l), f);
        for (i, j) in places(p, q) {
            let inverse = input_inverse(l, j);
            found.noise_std[[l, i, j]] = (at.noise[i] * unit * inverse).sqrt();
            if best.has_total {
                let total = response.uncertainty.as_ref().map_or(f64::NAN, |u| u.noise[[l, i, i]].re);
                found.nonlinear_std[[l, i, j]] = ((total - at.noise[i] * unit).max(0.0) * inverse * single).sqrt();
            }
        }
    }
    let last = lines.last().copied().unwrap_or(0);
    for even in [true, false] {
        // Lines between the driven ones of this parity, at least up to the highest driven one.
        let silent: Vec<usize> = (lines[0]..last).filter(|f| (f % 2 == 0) == even && lines.binary_search(f).is_err()).collect();
        if silent.is_empty() {
            continue;
        }
        let residuals: Vec<Residual> = silent.iter().map(|&f| equation(&interpolate(lines, &response.value, f), f)).collect();
        let target = if even { &mut found.even_std } else { &mut found.odd_std };
        for (l, &f) in lines.iter().enumerate() {
            let after = silent.partition_point(|&s| s < f);
            let near = after.saturating_sub(2)..(after + 2).min(silent.len());
            for i in 0..p {
                let count = near.len() as f64;
                // f64::max would hide a NaN.
                let power: f64 = residuals[near.clone()].iter().map(|r| r.power[i] - r.noise[i]).sum::<f64>() / count;
                let power = if power < 0.0 { 0.0 } else { power };
                (0..q).for_each(|j| target[[l, i, j]] = (power * unit * input_inverse(l, j) * single).sqrt());
            }
        }
        found.detection.push(detection(trials, lines, &silent, even, ports, response, derived));
    }
    found
}

/// Mean power and noise power, over trials, of what `h` does not explain of each output at one line.
struct Residual {
    power: Vec<f64>,
    noise: Vec<f64>,
}

impl Residual {
    /// e = first rows of `channels` − h · (the others).
    fn new(trials: &[PeriodSpectra], f: usize, channels: &[usize], h: &Array2<Complex64>) -> Self {
        let (p, q) = h.dim();
        let n = trials.len() as f64;
        let row = |i: usize| (0..p + q).map(move |a| if a < p { Complex64::from(f64::from(u8::from(a == i))) } else { -h[[i, a - p]] });
        let power = |i: usize| {
            let error = |t: &PeriodSpectra| row(i).zip(channels).map(|(w, &c)| w * t.mean(f, c)).sum::<Complex64>().norm_sqr();
            trials.iter().map(error).sum::<f64>() / n
        };
        let noise = |i: usize| {
            let of = |t: &PeriodSpectra| {
                let mut sum = 0.0;
                for (w, &a) in row(i).zip(channels) {
                    for (v, &b) in row(i).zip(channels) {
                        if w != Complex64::default() && v != Complex64::default() {
                            sum += (w * t.noise_covariance(f, a, b) * v.conj()).re;
                        }
                    }
                }
                sum.max(0.0)
            };
            trials.iter().map(of).sum::<f64>() / n
        };
        Residual { power: (0..p).map(power).collect(), noise: (0..p).map(noise).collect() }
    }
}

/// The matrices of `lines` linearly interpolated (held at the ends) to line `f`.
fn interpolate(lines: &[usize], value: &Array3<Complex64>, f: usize) -> Array2<Complex64> {
    let after = lines.partition_point(|&l| l < f).min(lines.len() - 1);
    let before = after.saturating_sub(1);
    let (a, b) = (value.index_axis(ndarray::Axis(0), before), value.index_axis(ndarray::Axis(0), after));
    if before == after {
        return a.to_owned();
    }
    let share = ((f as f64 - lines[before] as f64) / (lines[after] - lines[before]) as f64).clamp(0.0, 1.0);
    &a * Complex64::from(1.0 - share) + &b * Complex64::from(share)
}

fn detection(
    trials: &[PeriodSpectra],
    lines: &[usize],
    silent: &[usize],
    even: bool,
    ports: &Ports,
    response: &FrequencyResponse,
    derived: Option<&DerivedEstimate>,
) -> Detection {
    let n = trials.len() as f64;
    let mean_power = |at: &[usize], c: usize| {
        let sum: f64 = at.iter().map(|&f| trials.iter().map(|t| t.mean(f, c).norm_sqr()).sum::<f64>()).sum();
        sum / n / at.len() as f64
    };
    let mean_noise = |at: &[usize], c: usize| {
        let sum: f64 = at.iter().map(|&f| trials.iter().map(|t| t.noise_covariance(f, c, c).re).sum::<f64>()).sum();
        sum / n / at.len() as f64
    };
    let (mut level_db, mut noise_db, mut ratio) = (Vec::new(), Vec::new(), 0.0);
    for &c in &ports.outputs {
        let (driven, power, noise) = (mean_power(lines, c), mean_power(silent, c), mean_noise(silent, c));
        level_db.push(10.0 * ((power - noise).max(0.0) / driven).log10());
        noise_db.push(10.0 * (noise / driven).log10());
        ratio += power / noise / ports.outputs.len() as f64;
    }
    let periods = trials.iter().map(PeriodSpectra::periods).sum::<usize>() as f64 / n;
    let freedom = 2.0 * n * silent.len() as f64;
    let probability = FisherSnedecor::new(freedom, freedom * (periods - 1.0)).map_or(f64::NAN, |f| if ratio.is_finite() { f.sf(ratio) } else { 0.0 });

    let force_first: Vec<usize> = ports.inputs.iter().chain(&ports.outputs).copied().collect();
    let unexplained = |stiffness: &Array3<Complex64>, sign: f64| {
        let (mut error, mut total) = (0.0, 0.0);
        for &f in silent {
            let at = Residual::new(trials, f, &force_first, &(interpolate(lines, stiffness, f) * Complex64::from(sign)));
            let force = Residual::new(trials, f, &force_first, &Array2::zeros((ports.inputs.len(), ports.outputs.len())));
            // Beside a line without a response nothing is known; max would make it zero.
            let rest = at.power.iter().zip(&at.noise).map(|(p, n)| p - n).sum::<f64>();
            if rest.is_finite() {
                error += rest;
                total += force.power.iter().zip(&force.noise).map(|(p, n)| p - n).sum::<f64>();
            }
        }
        if total > 0.0 { (error / total).max(0.0) } else { f64::NAN }
    };
    let significant = probability < 0.01;
    let lambda_limb = match response.inverse() {
        Ok(stiffness) if significant => unexplained(&stiffness.value, 1.0),
        _ => f64::NAN,
    };
    let robot = derived.and_then(|d| {
        let inverse = d.to_reference.r.inverse().ok()?;
        let mut value = inverse.value.clone();
        for f in 0..inverse.len() {
            let t = d.to_reference.t.at(f);
            let rest = Array2::from_diag_elem(t.nrows(), Complex64::from(1.0)) - t;
            value.index_axis_mut(ndarray::Axis(0), f).assign(&rest.dot(&inverse.at(f)));
        }
        Some(value)
    });
    let lambda_robot = robot.filter(|_| significant).map_or(f64::NAN, |z| unexplained(&z, -1.0));
    Detection { even, lines: silent.len(), level_db, noise_db, probability, lambda_limb, lambda_robot }
}
