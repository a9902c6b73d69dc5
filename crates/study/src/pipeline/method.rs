//! Which spectral method, with which settings, and why.

use super::EstimateSettings;
use crate::error::StudyError;
use crate::result::estimate as schema;
use crate::trials::Trials;
use ndof_signal::{CrossSpectra, Multitaper, Periodic, Welch, Window, detect_period, effective_averages};
use ndof_sysid::{Estimates, FrequencyResponse, LocalPolynomial, LocalRational, SpectralMethod, choose_method};
use serde::{Deserialize, Serialize};

/// The words that `--method` takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// Chosen from the records, with the reason in the result.
    #[default]
    Auto,
    /// Averages over windowed, overlapping segments.
    Welch,
    /// Averages over orthogonal tapers of the whole record.
    Multitaper,
    /// Response and leakage as polynomials around each line of the whole record.
    LocalPolynomial,
    /// The same with a common denominator around each line.
    LocalRational,
    /// Averages over the periods of a periodic excitation.
    Periodic,
}

impl MethodName {
    /// The words, in the order of the variants.
    pub const WORDS: [&'static str; 6] = ["auto", "welch", "multitaper", "local-polynomial", "local-rational", "periodic"];
}

/// The method with its settings, and why it was taken. Where a setting of Welch's method is given, Welch's method is meant.
pub(super) fn choose(trials: &Trials, settings: &EstimateSettings) -> Result<(SpectralMethod, String), StudyError> {
    let asked = "as asked for".to_owned();
    let recordings = trials.recordings();
    let about_welch = settings.nperseg.is_some() || settings.noverlap.is_some() || settings.nfft.is_some() || settings.window != Window::default();
    if settings.robust && !matches!(settings.method, MethodName::Auto | MethodName::Welch) {
        return Err(StudyError::NoSegments { method: word(&settings.method) });
    }
    let one_length = recordings.windows(2).all(|pair| pair[0].len() == pair[1].len());
    Ok(match settings.method {
        MethodName::Auto if about_welch || settings.robust || !one_length => welch_of_length(trials, settings),
        MethodName::Auto => {
            let choice = choose_method(&recordings, &trials.roles.ports);
            match choice.method {
                SpectralMethod::Welch(_) => welch_of_length(trials, settings),
                SpectralMethod::Multitaper(multitaper) => (SpectralMethod::Multitaper(Multitaper { detrend: settings.detrend, ..multitaper }), choice.reason),
                other => (other, choice.reason),
            }
        }
        MethodName::Welch => welch_of_length(trials, settings),
        MethodName::Multitaper => {
            let time_bandwidth = settings.time_bandwidth.unwrap_or_else(|| Multitaper::default().time_bandwidth);
            let EstimateSettings { tapers, adaptive, nfft, detrend, .. } = settings.clone();
            (SpectralMethod::Multitaper(Multitaper { time_bandwidth, tapers, nfft, adaptive, detrend }), asked)
        }
        MethodName::LocalPolynomial => {
            let order = settings.order.unwrap_or_else(|| LocalPolynomial::default().order);
            let local = LocalPolynomial { order, half_width: settings.half_width, leave_one_out: settings.leave_one_out };
            (SpectralMethod::LocalPolynomial(local), asked)
        }
        MethodName::LocalRational => {
            let default = LocalRational::default();
            let (order, denominator) = (settings.order.unwrap_or(default.order), settings.denominator.unwrap_or(default.denominator));
            (SpectralMethod::LocalRational(LocalRational { order, denominator, half_width: settings.half_width }), asked)
        }
        MethodName::Periodic => {
            let ports = &trials.roles.ports;
            let driver = ports.references.first().or(ports.inputs.first()).copied().unwrap_or(0);
            let found = || trials.channels(&[driver]).first().and_then(|channel| detect_period(&channel.samples)).map(|found| found.period);
            let given = settings.period_s.map(|period_s| (period_s * trials.sample_rate_hz()).round() as usize);
            let period = given.or_else(found).ok_or_else(|| StudyError::NoPeriod { channel: trials.names(&[driver]).concat() })?;
            (SpectralMethod::Periodic(Periodic { period, discard: 1 }), asked)
        }
    })
}

/// Segments as long as leave enough of them to average: resolution is bought with what is left of the random error.
fn welch_of_length(trials: &Trials, settings: &EstimateSettings) -> (SpectralMethod, String) {
    let (inputs, references) = (trials.roles.ports.inputs.len(), trials.roles.ports.references.len());
    let enough = (16 + 2 * inputs.max(references)) as f64;
    let lengths: Vec<usize> = trials.trials.iter().map(|trial| trial.recording.len()).collect();
    let averages = |nperseg: usize| -> f64 {
        let window = settings.window.samples(nperseg, settings.window_symmetric);
        let hop = nperseg - nperseg / 2;
        let count = |len: usize| if len < nperseg { 0 } else { (len - nperseg) / hop + 1 };
        lengths.iter().map(|&len| effective_averages(&window, hop, count(len))).filter(|n| n.is_finite()).sum()
    };
    let longest = lengths.iter().copied().max().unwrap_or(0);
    let chosen = || (3..=longest.max(8).ilog2()).rev().map(|k| 1_usize << k).find(|&nperseg| averages(nperseg) >= enough).unwrap_or(8);
    let nperseg = settings.nperseg.unwrap_or_else(chosen);
    let why = match settings.nperseg {
        Some(_) => "segments as asked for".to_owned(),
        None => format!("the longest segments (a power of two) that leave at least {enough:.0} effective averages"),
    };
    (SpectralMethod::Welch(welch(settings, nperseg)), why)
}

/// Welch's method with segments of `nperseg` samples.
pub(super) fn welch(settings: &EstimateSettings, nperseg: usize) -> Welch {
    Welch {
        nperseg,
        noverlap: settings.noverlap.unwrap_or(nperseg / 2),
        nfft: settings.nfft.unwrap_or(nperseg),
        window: settings.window,
        window_symmetric: settings.window_symmetric,
        detrend: settings.detrend,
    }
}

/// The method and its settings as the result holds them.
pub(super) fn record(estimates: &Estimates, settings: &EstimateSettings, response: &FrequencyResponse, why: String) -> schema::Method {
    let mut method = schema::Method {
        name: estimates.method.name().to_owned(),
        why,
        estimator: word(&settings.estimator),
        nperseg: None,
        noverlap: None,
        nfft: None,
        window: None,
        window_symmetric: None,
        detrend: None,
        time_bandwidth: None,
        tapers: None,
        adaptive: None,
        order: None,
        denominator: None,
        half_width: None,
        period: None,
        segments: estimates.spectra.as_ref().map_or(0, CrossSpectra::segments),
        effective_averages: estimates.effective_averages,
        independent_spacing_hz: response.uncertainty.as_ref().map_or(f64::NAN, |u| u.independent_spacing_hz),
        band_hz: settings.band_hz.map(|(low, high)| [low, high]),
    };
    match &estimates.method {
        SpectralMethod::Welch(welch) => {
            (method.nperseg, method.noverlap, method.nfft) = (Some(welch.nperseg), Some(welch.noverlap), Some(welch.nfft));
            (method.window, method.window_symmetric) = (Some(welch.window.to_string()), Some(welch.window_symmetric));
            method.detrend = Some(word(&welch.detrend));
        }
        SpectralMethod::Multitaper(multitaper) => {
            (method.tapers, method.adaptive) = (multitaper.tapers, Some(multitaper.adaptive));
            (method.time_bandwidth, method.nfft, method.detrend) = (Some(multitaper.time_bandwidth), multitaper.nfft, Some(word(&multitaper.detrend)));
        }
        SpectralMethod::LocalPolynomial(local) => (method.order, method.half_width) = (Some(local.order), local.half_width),
        SpectralMethod::LocalRational(local) => {
            (method.order, method.denominator, method.half_width) = (Some(local.order), Some(local.denominator), local.half_width);
        }
        SpectralMethod::Periodic(periodic) => method.period = Some(periodic.period),
        _ => {}
    }
    method
}

/// The word that serde writes for a value of an enum without fields.
pub(crate) fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}
