//! The local polynomial method with instruments, for short windows of a system that feeds back.

use super::direct::DirectEstimate;
use super::local_lines::{Basis, Chunk, Lines, fill};
use super::{EstimateError, LocalPolynomial, Pieces, check};
use crate::labels::Labels;
use crate::ports::Ports;
use ndof_linear::square::{adjoint, inverse, product, rectangular_product};
use ndof_signal::Recording;
use num_complex::Complex64;

/// Outputs over inputs by local polynomials, with an instrument for each input: what comes of the reference alone.
///
/// Around each line Y = Θ X + leakage + V, X the inputs times polynomials. Where V reaches the inputs through feedback, least squares is biased;
/// with instruments Z, times the same polynomials and without the same leakage, Θ = Y Zᴴ (X Zᴴ)⁻¹ is not, and
/// Cov(vec Θ) = ((X Zᴴ)⁻ᴴ Z Zᴴ (X Zᴴ)⁻¹)ᵀ ⊗ S_vv. The derived estimate divides two responses to the reference, each of which rings for as long as robot and
/// limb do; where a window is shorter than that, this one still sees what a short memory (of an impedance) does within it.
///
/// `ports.references` are the instruments, one for each input.
///
/// # Errors
/// [`EstimateError`] if there are not as many instruments as inputs, trials differ, or they have too few lines.
///
/// # References
/// R. Pintelon & J. Schoukens (2012), System Identification, 2nd ed., ch. 7; T. Söderström & P. Stoica (1983), Instrumental Variable Methods for System
/// Identification.
///
/// ```
/// use ndof_signal::{Channel, FilteredNoise, Quantity, Recording, Unit};
/// use ndof_sysid::{Labels, LocalPolynomial, Ports, ResponseKind, instrumented};
///
/// // f = 5 x + v and x = r − 0.4 v: what the limb does by itself moves it, too.
/// let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, false), samples);
/// let window = |seed: u64| -> Result<Recording, Box<dyn std::error::Error>> {
///     let drawn = FilteredNoise { axes: 2, samples: 64, sample_rate_hz: 64.0, rms: 1.0, cutoff_hz: 30.0, ..FilteredNoise::default() }.generate(seed)?;
///     let x: Vec<f64> = drawn[0].iter().zip(&drawn[1]).map(|(r, v)| r - 0.4 * v).collect();
///     let f = x.iter().zip(&drawn[1]).map(|(x, v)| 5.0 * x + v).collect();
///     let channels = vec![channel("r", Quantity::Displacement, drawn[0].clone()), channel("x", Quantity::Displacement, x), channel("f", Quantity::Effort, f)];
///     Ok(Recording::new(64.0, channels)?)
/// };
/// let windows = (1..40).map(window).collect::<Result<Vec<_>, _>>()?;
/// let ports = Ports { references: vec![0], inputs: vec![1], outputs: vec![2] };
/// let labels = Labels::numbered(&ports, ResponseKind::DynamicStiffness);
/// let trials: Vec<&Recording> = windows.iter().collect();
/// let found = instrumented(&trials, &ports, &labels, LocalPolynomial::default())?;
/// assert!((found.response.value[[10, 0, 0]].re - 5.0).abs() < 0.2, "{}", found.response.value[[10, 0, 0]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn instrumented(trials: &[&Recording], ports: &Ports, labels: &Labels, settings: LocalPolynomial) -> Result<DirectEstimate, EstimateError> {
    let first = trials.first().ok_or(EstimateError::NoTrial)?;
    ports.validate(first.channels().len())?;
    check::alike(trials)?;
    check::sizes(trials, ports, labels)?;
    let (q, m) = (ports.inputs.len(), ports.outputs.len());
    if ports.references.len() != q {
        return Err(EstimateError::TooFewReferences { references: ports.references.len(), inputs: q });
    }
    let pieces = Pieces::new(trials);
    let (rate, len, terms) = (first.sample_rate_hz(), pieces.len, settings.order + 1);
    let half_width = settings.half_width.unwrap_or_else(|| settings.default_half_width(q, m));
    let basis = Basis::new(half_width, terms, len)?;
    let degrees_of_freedom = check::degrees_of_freedom((pieces.of.len() * (basis.width - basis.width.min(terms))) as f64, terms * q)?;
    let lines: Vec<Lines> = pieces.channels(trials).map(|channels| Lines::new(rate, &channels)).collect();
    let line = |k: usize, mut out: Chunk<'_>| {
        let low = basis.low(k);
        if k == 0 || k > basis.last || solve(&lines, ports, &basis, (k, low), degrees_of_freedom, &mut out).is_none() {
            out.missing(m, q);
        }
    };
    let grid: Vec<usize> = (0..len / 2 + 1).collect();
    fill(&grid, 1, (m, q), (rate, len), &basis, degrees_of_freedom, line).0.direct(labels)
}

/// Channels times each polynomial, without leakage, row by row: channels × terms, and the lines of all trials.
fn regressors(lines: &[Lines], channels: &[usize], basis: &Basis, low: usize) -> Vec<Complex64> {
    let mut rows = Vec::with_capacity(channels.len() * basis.terms * lines.len() * basis.width);
    for &channel in channels {
        for s in 0..basis.terms {
            for trial in lines {
                let window = trial.window(channel, low, basis.width);
                let mut series: Vec<Complex64> = (0..basis.width).map(|r| window[r] * basis.at(s, r)).collect();
                basis.project_out(&mut series);
                rows.extend(series);
            }
        }
    }
    rows
}

/// A Bᴴ of rows of `equations` numbers.
fn gram(a: &[Complex64], b: &[Complex64], equations: usize) -> Vec<Complex64> {
    let product = |a: &[Complex64], b: &[Complex64]| -> Complex64 { a.iter().zip(b).map(|(a, b)| a * b.conj()).sum() };
    a.chunks_exact(equations).flat_map(|a| b.chunks_exact(equations).map(move |b| product(a, b))).collect()
}

fn solve(lines: &[Lines], ports: &Ports, basis: &Basis, (k, low): (usize, usize), degrees_of_freedom: f64, out: &mut Chunk<'_>) -> Option<()> {
    let (q, terms, equations) = (ports.inputs.len(), basis.terms, lines.len() * basis.width);
    let unknowns = q * terms;
    let x = regressors(lines, &ports.inputs, basis, low);
    let z = regressors(lines, &ports.references, basis, low);
    let y: Vec<Complex64> = ports.outputs.iter().flat_map(|output| response(lines, *output, basis, low)).collect();
    let back = inverse(&gram(&x, &z, equations), unknowns)?;
    let theta = rectangular_product(&gram(&y, &z, equations), &back, [unknowns, unknowns]);
    let told = rectangular_product(&theta, &x, [unknowns, equations]);
    let rest: Vec<Complex64> = y.iter().zip(&told).map(|(y, told)| y - told).collect();
    out.noise.iter_mut().zip(gram(&rest, &rest, equations)).for_each(|(to, power)| *to = power / degrees_of_freedom);
    // Rows that evaluate each input's polynomial at the line, and their covariance.
    let mut at = vec![Complex64::default(); q * unknowns];
    (0..q).for_each(|j| (0..terms).for_each(|s| at[j * unknowns + j * terms + s] = Complex64::from(basis.at(s, k - low))));
    out.g.copy_from_slice(&gram(&theta, &at, unknowns));
    let spread = product(&product(&adjoint(&back, unknowns), &gram(&z, &z, equations), unknowns), &back, unknowns);
    out.gram_inverse.copy_from_slice(&gram(&rectangular_product(&at, &spread, [unknowns, unknowns]), &at, unknowns));
    let averages = (lines.len() * (basis.width - terms)) as f64 / basis.width as f64;
    let lowest: Vec<Complex64> = (0..q).flat_map(|j| x[j * terms * equations..(j * terms + 1) * equations].to_vec()).collect();
    out.driver.iter_mut().zip(gram(&lowest, &lowest, equations)).for_each(|(to, power)| *to = power / averages);
    Some(())
}

/// A response without leakage.
fn response(lines: &[Lines], channel: usize, basis: &Basis, low: usize) -> Vec<Complex64> {
    lines
        .iter()
        .flat_map(|trial| {
            let mut series = trial.window(channel, low, basis.width).to_vec();
            basis.project_out(&mut series);
            series
        })
        .collect()
}
