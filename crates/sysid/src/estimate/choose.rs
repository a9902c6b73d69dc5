//! The method that fits the recordings, and why.

use super::beginning::drives_like_a_beginning;
use super::{LocalPolynomial, Pieces, SpectralMethod};
use crate::ports::Ports;
use crate::steadiness::steadiness;
use ndof_signal::{Multitaper, Periodic, Recording, Welch, detect_period};

/// A method and the sentence that says why it was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The method with its settings.
    pub method: SpectralMethod,
    /// Why, with numbers.
    pub reason: String,
}

/// Effective averages beyond the number of inputs that an estimate should have.
const ENOUGH: f64 = 10.0;
/// Periods to average for each input: the scatter of fewer has a law without a variance.
const ENOUGH_PERIODS: usize = 4;

/// Chooses a spectral method from the length, number and periodicity of the recordings.
///
/// Periodic commands: periodic averaging (no leakage, noise and distortion told apart). Otherwise local polynomials over the whole record: they take
/// an input for what it is, steady or not, and follow a response that bends within their width, where the average of a window of variance σ² is off
/// by C″σ²/2: 3 (σ/f)² of an inertia without a spring, C ∝ f⁻². Multitaper where a command is as smooth over their width as what a record begins
/// with, as a sweep is that begins with it: as an instrument it would be weak. Welch on long records, where memory and time matter, and on those that
/// are too short for a polynomial. Trials of several lengths are taken in pieces of one ([`Pieces`]), and by periods not at all.
pub fn choose_method(trials: &[&Recording], ports: &Ports) -> Choice {
    let (Some(first), drivers) = (trials.first(), ports.drivers()) else {
        return Choice { method: SpectralMethod::LocalPolynomial(LocalPolynomial::default()), reason: "there is no recording".to_owned() };
    };
    let periodic = drivers.first().and_then(|&c| first.channels().get(c)).and_then(|c| repeats(&c.samples));
    let pieces = Pieces::new(trials);
    let one_length = trials.iter().all(|trial| trial.len() == pieces.len);
    let averages = |period: usize| trials.iter().map(|trial| (trial.len() / period).saturating_sub(1)).sum::<usize>();
    if let Some(period) = periodic.filter(|p| one_length && trials.len() >= drivers.len() && averages(*p) >= ENOUGH_PERIODS * drivers.len()) {
        let (seconds, whole) = (period as f64 / first.sample_rate_hz(), first.len() / period);
        return Choice {
            method: SpectralMethod::Periodic(Periodic { period, discard: 1 }),
            reason: format!("the excitation repeats every {seconds:.3} s ({whole} periods): averaged over periods, the first one left out"),
        };
    }
    let samples = pieces.len;
    let local = LocalPolynomial::default();
    let half_width = local.default_half_width(drivers.len(), ports.responders().len());
    // Beyond this a fit at every line costs more time and memory than it resolves.
    let resolves = samples <= 1 << 19 && 2 * (2 * half_width + 1) < samples;
    let unsteady = unsteady(trials, drivers);
    let duration_s = samples as f64 / first.sample_rate_hz();
    let (count, share) = (trials.len(), 100.0 * pieces.share(trials.iter().map(|trial| trial.len()).sum()));
    let (whole, what) = if one_length {
        ("the whole record".to_owned(), format!("{count} trial(s) of {duration_s:.1} s"))
    } else {
        let whole = format!("{} pieces of {duration_s:.1} s, which hold {share:.0} % of the samples", pieces.of.len());
        (whole.clone(), format!("{count} trials of several lengths, in {whole}"))
    };
    if (resolves || unsteady.is_some())
        && let Some((channel, [low, high])) = drives_like_a_beginning(trials, &ports.references, &local, half_width)
    {
        let name = &first.channels()[channel].name;
        let reason = format!(
            "{name} drives {low:.2} to {high:.2} Hz at an end of the record, where local polynomials could not tell its response from what the record begins with: multitaper over {whole}"
        );
        return Choice { method: SpectralMethod::Multitaper(Multitaper::default()), reason };
    }
    if let Some(found) = unsteady {
        let reason = format!("{found}: local polynomials over {whole}, which need no steady input");
        return Choice { method: SpectralMethod::LocalPolynomial(LocalPolynomial::default()), reason };
    }
    if resolves {
        let resolution_hz = (2 * half_width + 1) as f64 / samples as f64 * first.sample_rate_hz();
        return Choice {
            method: SpectralMethod::LocalPolynomial(local),
            reason: format!("{what}, not periodic: local polynomials over {resolution_hz:.2} Hz, which follow a response that bends within it"),
        };
    }
    let needed = drivers.len() as f64 + ENOUGH;
    let nperseg = (samples as f64 * pieces.of.len() as f64 / (2.0 * needed)).log2().floor().clamp(3.0, 16.0);
    let nperseg = (1_usize << nperseg as u32).min(samples.max(1));
    Choice {
        method: SpectralMethod::Welch(Welch::new(nperseg)),
        reason: format!("{what}, long enough for segments of {nperseg} samples ({:.1} s)", nperseg as f64 / first.sample_rate_hz()),
    }
}

/// The period of a command that repeats three times or more and so exactly that averages over periods tell noise from distortion.
///
/// ```
/// let command: Vec<f64> = (0..1000).map(|k| ((k % 250) as f64 * 0.3).sin()).collect();
/// assert_eq!(ndof_sysid::repeats(&command), Some(250));
/// ```
pub fn repeats(command: &[f64]) -> Option<usize> {
    detect_period(command).filter(|found| found.mismatch < 1e-3 && command.len() / found.period >= 3).map(|found| found.period)
}

/// The first driver whose power comes and goes, in words.
fn unsteady(trials: &[&Recording], drivers: &[usize]) -> Option<String> {
    let channels =
        trials.iter().flat_map(|trial| drivers.iter().filter_map(|&driver| trial.channels().get(driver)).map(|channel| (trial.sample_rate_hz(), channel)));
    channels.filter_map(|(rate_hz, channel)| Some((channel, steadiness(&channel.samples, rate_hz)?))).find(|(_, found)| found.is_unsteady()).map(
        |(channel, found)| match found.sweep {
            Some(_) => format!("{} is a sweep", channel.name),
            None => format!("the power of {} comes and goes", channel.name),
        },
    )
}
