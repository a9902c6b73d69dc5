//! Which spectral method, with which settings, and why.

use super::result::Method;
use super::settings::{Estimate, MethodName};
use crate::error::AnalysisError;
use crate::result::word;
use crate::trials::Trials;
use ndof_signal::{CrossSpectra, Multitaper, Periodic, Welch, detect_period, effective_averages};
use ndof_sysid::{Estimates, FrequencyResponse, LocalPolynomial, LocalRational, Ports, SpectralMethod, choose_method};

/// Whether something is asked that only spectra of segments have.
pub(super) fn about_welch(settings: &Estimate) -> bool {
    let default = Estimate::default();
    let Estimate { nperseg, noverlap, nfft, .. } = settings;
    [nperseg, noverlap, nfft].iter().any(|asked| asked.is_some())
        || settings.window != default.window
        || settings.detrend != default.detrend
        || settings.estimator != default.estimator
}

/// The method with its settings, and why it was taken. Where a setting is given that one method alone has, that method is meant.
pub(super) fn choose(trials: &Trials, settings: &Estimate) -> Result<(SpectralMethod, String), AnalysisError> {
    let asked = "as asked for".to_owned();
    let recordings = trials.recordings();
    if settings.robust && !matches!(settings.method, MethodName::Auto | MethodName::Welch) {
        return Err(AnalysisError::NoSegments { method: word(&settings.method) });
    }
    Ok(match settings.method {
        MethodName::Auto if about_welch(settings) || settings.robust => welch_of_length(trials, settings),
        MethodName::Auto if settings.time_bandwidth.is_some() || settings.tapers.is_some() || settings.adaptive => (multitaper(settings), asked),
        MethodName::Auto => {
            let choice = choose_method(&recordings, &trials.roles.ports);
            match choice.method {
                SpectralMethod::Welch(_) => welch_of_length(trials, settings),
                SpectralMethod::LocalPolynomial(_) => (local_polynomial(settings), choice.reason),
                other => (other, choice.reason),
            }
        }
        MethodName::Welch => welch_of_length(trials, settings),
        MethodName::Multitaper => (multitaper(settings), asked),
        MethodName::LocalPolynomial => (local_polynomial(settings), asked),
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
            let period = given.or_else(found).ok_or_else(|| AnalysisError::NoPeriod { channel: trials.names(&[driver]).concat() })?;
            (SpectralMethod::Periodic(Periodic { period, discard: 1 }), asked)
        }
    })
}

fn multitaper(settings: &Estimate) -> SpectralMethod {
    let time_bandwidth = settings.time_bandwidth.unwrap_or_else(|| Multitaper::default().time_bandwidth);
    let Estimate { tapers, adaptive, nfft, detrend, .. } = *settings;
    SpectralMethod::Multitaper(Multitaper { time_bandwidth, tapers, nfft, adaptive, detrend })
}

fn local_polynomial(settings: &Estimate) -> SpectralMethod {
    let order = settings.order.unwrap_or_else(|| LocalPolynomial::default().order);
    SpectralMethod::LocalPolynomial(LocalPolynomial { order, half_width: settings.half_width, leave_one_out: settings.leave_one_out })
}

/// Segments as long as leave enough of them to average: resolution is bought with what is left of the random error.
fn welch_of_length(trials: &Trials, settings: &Estimate) -> (SpectralMethod, String) {
    let lengths: Vec<usize> = trials.trials.iter().map(|trial| trial.recording.len()).collect();
    let (welch, why) = welch_of(&lengths, &trials.roles.ports, settings);
    (SpectralMethod::Welch(welch), why)
}

/// The same by the lengths of the trials.
pub(super) fn welch_of(lengths: &[usize], ports: &Ports, settings: &Estimate) -> (Welch, String) {
    let enough = (16 + 2 * ports.inputs.len().max(ports.references.len())) as f64;
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
    (settings.segments_of(nperseg), why)
}

/// The method and its settings as the result holds them.
pub(super) fn record(estimates: &Estimates, settings: &Estimate, response: &FrequencyResponse, why: String) -> Method {
    let mut method = Method {
        name: estimates.method.name().to_owned(),
        why,
        estimator: settings.estimator,
        segments: estimates.spectra.as_ref().map_or(0, CrossSpectra::segments),
        effective_averages: estimates.effective_averages,
        independent_spacing_hz: response.uncertainty.as_ref().map_or(f64::NAN, |u| u.independent_spacing_hz),
        band_hz: settings.band_hz,
        ..Method::default()
    };
    match &estimates.method {
        SpectralMethod::Welch(welch) => {
            (method.nperseg, method.noverlap, method.nfft) = (Some(welch.nperseg), Some(welch.noverlap), Some(welch.nfft));
            (method.window, method.window_symmetric, method.detrend) = (Some(welch.window.to_string()), Some(welch.window_symmetric), Some(welch.detrend));
        }
        SpectralMethod::Multitaper(multitaper) => {
            (method.tapers, method.adaptive, method.detrend) = (multitaper.tapers, Some(multitaper.adaptive), Some(multitaper.detrend));
            (method.time_bandwidth, method.nfft) = (Some(multitaper.time_bandwidth), multitaper.nfft);
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
