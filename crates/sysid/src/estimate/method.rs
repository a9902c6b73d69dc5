//! One call for every spectral method: trials in, estimates out.

use super::fitted::Fitted;
use super::local_fit::{At, fit_as_set, fit_rational};
use super::local_lines::Lines;
use super::local_polynomial::LocalPolynomial;
use super::local_rational::LocalRational;
use super::multisine::{Distortion, Multisine, multisine};
use super::pieces::Pieces;
use super::{DerivedEstimate, Direct, DirectEstimate, EstimateError, derived, direct};
use crate::labels::Labels;
use crate::ports::Ports;
use crate::response::FrequencyResponse;
use ndof_signal::{CrossSpectra, Multitaper, PeriodSpectra, Periodic, Recording, Warning, Welch};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// How spectra are made from recordings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SpectralMethod {
    /// Averages over windowed, overlapping segments.
    Welch(Welch),
    /// Averages over orthogonal tapers of the whole record.
    Multitaper(Multitaper),
    /// Response and leakage as polynomials around each line of the whole record.
    LocalPolynomial(LocalPolynomial),
    /// The same with a common denominator, for resonances a few lines wide.
    LocalRational(LocalRational),
    /// Averages over the periods of a periodic excitation; the grid is that of the excited lines.
    Periodic(Periodic),
}

impl SpectralMethod {
    /// The word that asks for it on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            SpectralMethod::Welch(_) => "welch",
            SpectralMethod::Multitaper(_) => "multitaper",
            SpectralMethod::LocalPolynomial(_) => "local-polynomial",
            SpectralMethod::LocalRational(_) => "local-rational",
            SpectralMethod::Periodic(_) => "periodic",
        }
    }
}

/// Everything that one estimation gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimates {
    /// Outputs over measured inputs.
    pub direct: DirectEstimate,
    /// Outputs over inputs by way of the references, where there are at least as many as inputs.
    pub derived: Option<DerivedEstimate>,
    /// Cross-spectra of all channels of the recordings, pooled over trials, for methods that have them.
    pub spectra: Option<CrossSpectra>,
    /// Noise against nonlinearity, for periodic excitation.
    pub distortion: Option<Distortion>,
    /// How it was done.
    pub method: SpectralMethod,
    /// Effective averages over all trials.
    pub effective_averages: f64,
    /// What to know before using it.
    pub warnings: Vec<Warning>,
}

/// Estimates the response of the outputs to the inputs from repeated trials of one experiment.
///
/// Spectra are pooled over trials before any inversion. References add the derived estimate.
///
/// # Errors
/// [`EstimateError`] if there is no trial, a trial cannot be transformed, trials differ, or the estimate does not exist.
///
/// ```
/// use ndof_signal::{Channel, Quantity, Recording, Unit, Welch};
/// use ndof_sysid::{Direct, Labels, Ports, SpectralMethod, estimate};
/// let force: Vec<f64> = (0..4000_u32).map(|k| f64::from(k.wrapping_mul(2_654_435_761) >> 16) - 32768.0).collect();
/// let angle = force.iter().map(|f| 0.5 * f).collect();
/// let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
/// let trial = Recording::new(100.0, vec![channel("torque", Quantity::Effort, force), channel("angle", Quantity::Displacement, angle)])?;
/// let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
/// let found = estimate(&[&trial], &ports, &Labels::of(&trial, &ports), &SpectralMethod::Welch(Welch::new(256)), Direct::H1)?;
/// assert!((found.direct.response.value[[10, 0, 0]].re - 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn estimate(trials: &[&Recording], ports: &Ports, labels: &Labels, method: &SpectralMethod, estimator: Direct) -> Result<Estimates, EstimateError> {
    estimated(trials, ports, labels, (method, estimator), None)
}

/// The same where nothing of the derived estimate is of use beyond the frequency that `highest_hz` tells by the direct one: local methods leave its lines
/// beyond out, and the grid of the derived estimate ends there.
///
/// # Errors
/// As [`estimate`].
pub fn estimate_up_to(
    trials: &[&Recording],
    ports: &Ports,
    labels: &Labels,
    how: (&SpectralMethod, Direct),
    highest_hz: Highest<'_>,
) -> Result<Estimates, EstimateError> {
    estimated(trials, ports, labels, how, Some(highest_hz))
}

/// What tells a frequency by the direct estimate.
type Highest<'a> = &'a dyn Fn(&DirectEstimate) -> f64;

fn estimated(
    trials: &[&Recording],
    ports: &Ports,
    labels: &Labels,
    (method, estimator): (&SpectralMethod, Direct),
    highest_hz: Option<Highest<'_>>,
) -> Result<Estimates, EstimateError> {
    let all = checked(trials, ports, labels, method, estimator)?;
    match method {
        SpectralMethod::Welch(settings) => {
            let of = |(k, recording): (usize, &&Recording)| {
                settings.spectra(recording.sample_rate_hz(), &recording.columns(&all)).map_err(|source| EstimateError::Welch { trial: k + 1, source })
            };
            estimate_from_spectra(pooled(trials.iter().enumerate().map(of))?, ports, labels, method, estimator)
        }
        SpectralMethod::Multitaper(settings) => {
            let pieces = Pieces::new(trials);
            let of = |((k, _), channels): (&(usize, Range<usize>), Vec<&[f64]>)| {
                settings.spectra(trials[*k].sample_rate_hz(), &channels).map_err(|source| EstimateError::Multitaper { trial: k + 1, source })
            };
            estimate_from_spectra(pooled(pieces.of.iter().zip(pieces.channels(trials)).map(of))?, ports, labels, method, estimator)
        }
        SpectralMethod::LocalPolynomial(settings) => local(trials, ports, labels, (method, highest_hz), polynomial(settings)),
        SpectralMethod::LocalRational(settings) => local(trials, ports, labels, (method, highest_hz), rational(settings)),
        SpectralMethod::Periodic(settings) => {
            let periods: Result<Vec<PeriodSpectra>, EstimateError> = trials
                .iter()
                .enumerate()
                .map(|(k, recording)| {
                    settings.spectra(recording.sample_rate_hz(), &recording.columns(&all)).map_err(|source| EstimateError::Periodic { trial: k + 1, source })
                })
                .collect();
            let Multisine { direct, derived, distortion, warnings: mut own } = multisine(&periods?, ports, labels)?;
            own.extend(warnings(&direct, derived.as_ref(), ports));
            let effective_averages = direct.effective_averages;
            Ok(Estimates { effective_averages, direct, derived, spectra: None, distortion: Some(distortion), method: method.clone(), warnings: own })
        }
    }
}

/// The response to build on, that of [`estimate`] by way of the references where there are enough of them, else the direct one; what a method makes only
/// to judge it by is left out. Of a band that is given `apart_hz`, local methods look only at independent lines, which are those that
/// [`spread`](crate::spread()) counts.
///
/// # Errors
/// As [`estimate`].
pub fn response(
    trials: &[&Recording],
    ports: &Ports,
    labels: &Labels,
    (method, estimator): (&SpectralMethod, Direct),
    apart_hz: Option<[f64; 2]>,
) -> Result<FrequencyResponse, EstimateError> {
    checked(trials, ports, labels, method, estimator)?;
    match method {
        SpectralMethod::LocalPolynomial(settings) => local_response(trials, ports, labels, apart_hz, polynomial(settings)),
        SpectralMethod::LocalRational(settings) => local_response(trials, ports, labels, apart_hz, rational(settings)),
        _ => estimate(trials, ports, labels, method, estimator).map(|found| found.derived.map_or(found.direct.response, |derived| derived.response)),
    }
}

/// All channels, of trials that are alike and have those that are asked for.
fn checked(trials: &[&Recording], ports: &Ports, labels: &Labels, method: &SpectralMethod, estimator: Direct) -> Result<Vec<usize>, EstimateError> {
    let channels = trials.first().ok_or(EstimateError::NoTrial)?.channels().len();
    ports.validate(channels)?;
    if estimator != Direct::H1 && !matches!(method, SpectralMethod::Welch(_) | SpectralMethod::Multitaper(_)) {
        return Err(EstimateError::NoSpectra { estimator, method: method.name() });
    }
    super::check::alike(trials)?;
    super::check::sizes(trials, ports, labels)?;
    Ok((0..channels).collect())
}

/// The same from spectra that are there already: a stream's, or those without the wrecked segments
/// ([`robust_spectra`](super::robust_spectra)). `method` is only noted.
///
/// # Errors
/// [`EstimateError`] if the estimate does not exist.
pub fn estimate_from_spectra(
    spectra: CrossSpectra,
    ports: &Ports,
    labels: &Labels,
    method: &SpectralMethod,
    estimator: Direct,
) -> Result<Estimates, EstimateError> {
    super::check::ports(&spectra, ports, labels)?;
    super::check::powers(&spectra, ports, labels)?;
    let direct = direct(&spectra, ports, labels, estimator)?;
    let derived = if ports.references.len() >= ports.inputs.len() { Some(derived(&spectra, ports, labels)?) } else { None };
    let warnings = warnings(&direct, derived.as_ref(), ports);
    let effective_averages = spectra.effective_averages();
    Ok(Estimates { effective_averages, direct, derived, spectra: Some(spectra), distortion: None, method: method.clone(), warnings })
}

/// A fit of responders on drivers at lines of pieces of one rate and length.
trait LocalFit: Fn(&[Lines], (f64, usize), &[usize], &[usize], At) -> Result<Fitted, EstimateError> {}

impl<F: Fn(&[Lines], (f64, usize), &[usize], &[usize], At) -> Result<Fitted, EstimateError>> LocalFit for F {}

fn polynomial(settings: &LocalPolynomial) -> impl LocalFit {
    |lines: &[Lines], of: (f64, usize), drivers: &[usize], responders: &[usize], at: At| {
        fit_as_set(lines, of, drivers, responders, (*settings, at)).map(|f| f.fitted)
    }
}

fn rational(settings: &LocalRational) -> impl LocalFit {
    |lines: &[Lines], of: (f64, usize), drivers: &[usize], responders: &[usize], at: At| fit_rational(lines, of, drivers, responders, (*settings, at))
}

/// The lines of all channels of each piece of the trials, and rate and length of what they are of.
fn lines(trials: &[&Recording]) -> Result<(Vec<Lines>, (f64, usize)), EstimateError> {
    let first = trials.first().ok_or(EstimateError::NoTrial)?;
    let rate = first.sample_rate_hz();
    for (k, recording) in trials.iter().enumerate() {
        for (channel, samples) in recording.channels().iter().enumerate() {
            if let Some(sample) = samples.samples.iter().position(|v| !v.is_finite()) {
                return Err(EstimateError::NotFinite { trial: k + 1, channel, sample });
            }
        }
    }
    let pieces = Pieces::new(trials);
    Ok((pieces.channels(trials).map(|channels| Lines::new(rate, &channels)).collect(), (rate, pieces.len)))
}

/// The fit of outputs and inputs on the references.
fn by_references(lines: &[Lines], of: (f64, usize), ports: &Ports, at: impl FnOnce() -> At, fit: &impl LocalFit) -> Option<Result<Fitted, EstimateError>> {
    (ports.references.len() >= ports.inputs.len()).then(|| fit(lines, of, &ports.references, &ports.responders(), at()))
}

fn local(
    trials: &[&Recording],
    ports: &Ports,
    labels: &Labels,
    (method, highest_hz): (&SpectralMethod, Option<Highest<'_>>),
    fit: impl LocalFit,
) -> Result<Estimates, EstimateError> {
    let (lines, of) = lines(trials)?;
    let fitted = fit(&lines, of, &ports.inputs, &ports.outputs, At::All)?;
    let direct = fitted.direct(labels)?;
    let at = || highest_hz.map_or(At::All, |highest_hz| At::UpTo(highest_hz(&direct)));
    let derived = by_references(&lines, of, ports, at, &fit).map(|joint| joint?.derived(&fitted, labels)).transpose()?;
    let warnings = warnings(&direct, derived.as_ref(), ports);
    Ok(Estimates { effective_averages: direct.effective_averages, direct, derived, spectra: None, distortion: None, method: method.clone(), warnings })
}

fn local_response(
    trials: &[&Recording],
    ports: &Ports,
    labels: &Labels,
    apart_hz: Option<[f64; 2]>,
    fit: impl LocalFit,
) -> Result<FrequencyResponse, EstimateError> {
    let (lines, of) = lines(trials)?;
    let at = apart_hz.map_or(At::All, At::Apart);
    match by_references(&lines, of, ports, || at, &fit) {
        Some(joint) => joint?.derived_alone(labels),
        None => Ok(fit(&lines, of, &ports.inputs, &ports.outputs, at)?.direct(labels)?.response),
    }
}

fn pooled(spectra: impl Iterator<Item = Result<CrossSpectra, EstimateError>>) -> Result<CrossSpectra, EstimateError> {
    let mut spectra = spectra.collect::<Result<Vec<_>, _>>()?;
    match spectra.len() {
        1 => Ok(spectra.remove(0)),
        _ => Ok(CrossSpectra::pool(&spectra)?),
    }
}

fn warnings(direct: &DirectEstimate, derived: Option<&DerivedEstimate>, ports: &Ports) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if !direct.singular_bins.is_empty() {
        warnings.push(Warning::new(
            "singular-inputs",
            format!("inputs depend on each other, or are silent, at {}; there is no estimate there", frequencies(&direct.response, &direct.singular_bins)),
            "excite those frequencies with independent signals, or leave them out with --band",
        ));
    }
    if ports.references.is_empty() {
        let when = if direct.response.kind.is_effort_over_motion() {
            "unless the motion is imposed whatever the effort"
        } else {
            "if a controller feeds the motion back to the force"
        };
        warnings.push(Warning::new(
            "no-reference",
            format!("no reference channel: {when}, the direct estimate is biased towards what drives it"),
            "record the commanded perturbation and name it with --reference",
        ));
    } else if derived.is_none() {
        warnings.push(Warning::new(
            "too-few-references",
            format!("{} reference(s) for {} inputs: there is no derived estimate", ports.references.len(), ports.inputs.len()),
            "name as many commanded channels as inputs with --reference",
        ));
    }
    let response = derived.map_or(&direct.response, |d| &d.response);
    let strongest = crate::resolution::unresolved(response, 0.1, 0.0, f64::INFINITY)
        .into_iter()
        .reduce(|a, b| if b.relative_bias.abs() > a.relative_bias.abs() { b } else { a });
    if let Some(worst) = strongest {
        warnings.push(Warning::new(
            "resolution",
            format!(
                "the window is too wide for {} over {} at {:.2} Hz: its gain is off by about {:.0} %",
                response.outputs[worst.output],
                response.inputs[worst.input],
                worst.frequency_hz,
                100.0 * worst.relative_bias
            ),
            "take longer segments (--nperseg), --method multitaper or local-polynomial, or a longer recording",
        ));
    }
    warnings.extend(derived.and_then(|derived| derived.weakness([0.0, f64::INFINITY])));
    warnings
}

impl DerivedEstimate {
    /// A warning `weak-instrument`, where the references hardly reach the inputs at a frequency of a band.
    pub fn weakness(&self, [low_hz, high_hz]: [f64; 2]) -> Option<Warning> {
        let weak = |f: &usize| self.weak_instrument[*f] && (low_hz..=high_hz).contains(&self.response.frequency_hz[*f]);
        let weak: Vec<usize> = (0..self.weak_instrument.len()).filter(weak).collect();
        (!weak.is_empty()).then(|| {
            Warning::new(
                "weak-instrument",
                format!("the references hardly reach the inputs at {}; the derived estimate is uncertain and biased there", frequencies(&self.response, &weak)),
                "perturb more strongly there, add trials, or leave those frequencies out with --band",
            )
        })
    }
}

/// Which frequencies of a response these are, in words.
fn frequencies(response: &FrequencyResponse, bins: &[usize]) -> String {
    let hz = |f: usize| response.frequency_hz[f];
    match bins {
        [one] => format!("{:.3} Hz", hz(*one)),
        [first, .., last] => format!("{} frequencies between {:.3} and {:.3} Hz", bins.len(), hz(*first), hz(*last)),
        [] => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Quantity, Unit};
    use rand::{RngExt, SeedableRng};

    #[test]
    fn a_response_alone_is_that_of_the_whole_estimate() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let r: Vec<f64> = (0..1500).map(|_| rng.random_range(-1.0..1.0)).collect();
        let u: Vec<f64> = r.iter().map(|r| 0.8 * r + 0.1 * rng.random_range(-1.0..1.0)).collect();
        let y: Vec<f64> = u.iter().map(|u| 0.5 * u + 0.1 * rng.random_range(-1.0..1.0)).collect();
        let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
        let channels = vec![channel("cmd", Quantity::Effort, r), channel("torque", Quantity::Effort, u), channel("angle", Quantity::Displacement, y)];
        let trial = Recording::new(100.0, channels).expect("channels alike");
        let methods = [
            SpectralMethod::Welch(Welch::new(128)),
            SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
            // A mean of seven lines: the next independent line is the seventh, and no rounding makes it the eighth.
            SpectralMethod::LocalPolynomial(LocalPolynomial { order: 0, half_width: Some(3), ..LocalPolynomial::default() }),
            SpectralMethod::LocalPolynomial(LocalPolynomial { leave_one_out: true, ..LocalPolynomial::default() }),
            SpectralMethod::LocalRational(LocalRational::default()),
        ];
        for (method, references) in methods.iter().flat_map(|method| [(method, vec![0]), (method, vec![])]) {
            let ports = Ports { references, inputs: vec![1], outputs: vec![2] };
            let labels = Labels::of(&trial, &ports);
            let whole = estimate(&[&trial], &ports, &labels, method, Direct::H1).expect("an estimate");
            let whole = whole.derived.map_or(whole.direct.response, |derived| derived.response);
            let respond = |apart_hz| response(&[&trial], &ports, &labels, (method, Direct::H1), apart_hz).expect("a response");
            let alone = respond(None);
            let same = |a: &ndarray::Array3<num_complex::Complex64>, b: &ndarray::Array3<num_complex::Complex64>| {
                a.dim() == b.dim() && a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
            };
            let [own, other] = [&alone, &whole].map(|response| response.uncertainty.as_ref().expect("with its errors"));
            assert!(same(&alone.value, &whole.value) && alone.value[[20, 0, 0]].is_finite(), "{}", method.name());
            assert!(same(&own.noise, &other.noise) && same(&own.input_inverse, &other.input_inverse), "{}", method.name());
            assert_eq!((&alone.frequency_hz, &alone.inputs, &alone.outputs), (&whole.frequency_hz, &whole.inputs, &whole.outputs));
            // Of independent lines alone the spread between trials is the same, to the last bit.
            let [all, apart] = [alone, respond(Some([2.0, 30.0]))].map(|one| {
                let other = FrequencyResponse { value: one.value.mapv(|v| v * v), ..one.clone() };
                crate::spread(&[one, other], 2.0, 30.0).map(|spread| (spread.ratio, spread.ratio_std_error, spread.between.dim().0))
            });
            let (all, apart) = (all.expect("two of a kind"), apart.expect("two of a kind"));
            assert!((all.0, all.1) == (apart.0, apart.1) && all.0.is_finite(), "{}: {all:?} {apart:?}", method.name());
            // A width that all lines choose is chosen by all lines.
            let chosen = matches!(method, SpectralMethod::LocalPolynomial(LocalPolynomial { leave_one_out: true, .. }));
            assert_eq!(method.name().starts_with("local") && !chosen, apart.2 < all.2);
        }
    }
}
