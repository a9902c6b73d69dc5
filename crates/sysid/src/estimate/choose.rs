//! The method that fits the recordings, and why.

use super::{LocalPolynomial, SpectralMethod};
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

/// Chooses a spectral method from the length, number and periodicity of the recordings.
///
/// Periodic commands: periodic averaging (no leakage, noise and distortion told apart). Sweeps, steps and bursts: local polynomials over the
/// whole record, which take the input for what it is and no average over it. Otherwise multitaper with
/// NW = 4 where the trials together give enough averages or cannot be cut into enough segments, since it resolves the
/// most for its averages; Welch on long records, where memory and time matter.
pub fn choose_method(trials: &[&Recording], ports: &Ports) -> Choice {
    let (Some(first), drivers) = (trials.first(), if ports.references.is_empty() { &ports.inputs } else { &ports.references }) else {
        return Choice { method: SpectralMethod::Multitaper(Multitaper::default()), reason: "there is no recording".to_owned() };
    };
    let periodic = drivers.first().and_then(|&c| first.channels().get(c)).and_then(|c| repeats(&c.samples));
    if let Some(period) = periodic.filter(|_| trials.len() >= drivers.len()) {
        let (seconds, whole) = (period as f64 / first.sample_rate_hz(), first.len() / period);
        return Choice {
            method: SpectralMethod::Periodic(Periodic { period, discard: 1 }),
            reason: format!("the excitation repeats every {seconds:.3} s ({whole} periods): averaged over periods, the first one left out"),
        };
    }
    if let Some(what) = unsteady(trials, drivers) {
        let reason = format!("{what}: local polynomials over the whole record, which need no steady input");
        return Choice { method: SpectralMethod::LocalPolynomial(LocalPolynomial::default()), reason };
    }
    let shortest = trials.iter().map(|r| r.len()).min().unwrap_or(0);
    let duration_s = shortest as f64 / first.sample_rate_hz();
    let count = trials.len();
    let needed = drivers.len() as f64 + ENOUGH;
    // Thomson's tapers at NW = 4 give 7 averages a trial.
    let time_bandwidth = if 7.0 * count as f64 >= needed { 4.0 } else { ((needed / count as f64 + 1.0) / 2.0).ceil() };
    let resolution_hz = 2.0 * time_bandwidth / duration_s;
    // Beyond this the tapers of a trial cost more time and memory than they resolve.
    if shortest <= 1 << 19 && (time_bandwidth * 4.0) < shortest as f64 {
        let averages = (2.0 * time_bandwidth - 1.0) * count as f64;
        return Choice {
            method: SpectralMethod::Multitaper(Multitaper { time_bandwidth, ..Multitaper::default() }),
            reason: format!(
                "{count} trial(s) of {duration_s:.1} s, not periodic: {averages:.0} averages at a resolution of {resolution_hz:.2} Hz with NW = {time_bandwidth}"
            ),
        };
    }
    let nperseg = (shortest as f64 * count as f64 / (2.0 * needed)).log2().floor().clamp(3.0, 16.0);
    let nperseg = (1_usize << nperseg as u32).min(shortest.max(1));
    Choice {
        method: SpectralMethod::Welch(Welch::new(nperseg)),
        reason: format!(
            "{count} trial(s) of {duration_s:.1} s, long enough for segments of {nperseg} samples ({:.1} s)",
            nperseg as f64 / first.sample_rate_hz()
        ),
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
