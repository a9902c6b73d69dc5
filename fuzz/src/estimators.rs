//! Estimators with arbitrary numbers: one method an execution, on so few samples that an execution takes a fraction of a millisecond.

use crate::numbers::Given;
use ndof_signal::{
    Amplitudes, Channel, CrossSpectra, Detrend, Multitaper, Passband, Periodic, Quantity, Recording, SosFilter, Unit, Welch, Window, detect_period, normality,
    reverse_arrangements, slepian_tapers,
};
use ndof_sysid::{
    Coherence, Direct, Estimates, Labels, LocalPolynomial, LocalRational, Ports, SpectralMethod, StoppingRule, choose_method, estimate, estimate_from_spectra,
    ordered_coherence, robust_spectra, sliding, spread, unresolved,
};

/// Bytes that choose channels, method and settings.
const CHOICES: usize = 8;
/// Samples that one execution takes at most.
const MOST: usize = 192;
const RATE_HZ: f64 = 100.0;
/// Rounding that a coherence may be off by.
const SLACK: f64 = 1e-9;

/// One signal's tests and filters, or the estimate of a response by one method, and one use of that.
pub fn estimators(data: &[u8]) {
    let Some(given) = Given::of(data, CHOICES, MOST) else { return };
    match given.choose(0, 8) {
        0 => one_channel(&given),
        1 => crate::response::algebra(&given),
        _ => several_channels(&given),
    }
}

/// What looks at one channel alone.
fn one_channel(given: &Given) {
    let signal = &given.values;
    match given.choose(1, 6) {
        0 => {
            if let Some(found) = detect_period(signal) {
                assert!(0 < found.period && found.period <= signal.len(), "{found:?} of {} samples", signal.len());
            }
        }
        1 => {
            if let Ok(test) = reverse_arrangements(signal) {
                assert!((0.0..=1.0).contains(&test.p_value), "{test:?}");
            }
        }
        2 => {
            if let Ok(test) = normality(signal) {
                assert!(test.p_value.is_nan() || (0.0..=1.0).contains(&test.p_value), "{test:?}");
            }
        }
        3 => {
            let _ = Amplitudes::of(signal).mean_squares(given.choose(2, 256));
        }
        4 => {
            if let Ok(slepian) = slepian_tapers(given.choose(2, 64), given.value(0), given.choose(3, 16)) {
                assert!(slepian.tapers.iter().flatten().chain(&slepian.concentration).all(|v| v.is_finite()), "{slepian:?}");
            }
        }
        _ => {
            let corners = (given.value(0), given.value(1));
            let band = given.one_of(2, &[Passband::Low(corners.0), Passband::High(corners.0), Passband::Band(corners.0, corners.1), Passband::Low(10.0)]);
            if let Ok(filter) = SosFilter::butterworth(given.choose(3, 12), band, RATE_HZ) {
                let _ = filter.filter_zero_phase(signal);
                let mut piecewise = filter.stream();
                let again: Vec<f64> = signal.iter().map(|x| piecewise.step(*x)).collect();
                assert!(filter.filter(signal).iter().zip(&again).all(|(a, b)| same(*a, *b)), "a stream filters otherwise");
            }
        }
    }
}

/// A recording of up to seven channels, its ports, and an estimate by one method.
fn several_channels(given: &Given) {
    let (inputs, outputs) = (1 + given.choose(1, 3), 1 + usize::from(given.bit(1, 6)));
    let references = if given.bit(1, 7) { inputs } else { 0 };
    let effort = Unit::si(Quantity::Effort, false);
    let motion = Unit::si(Quantity::Displacement, false);
    let name = |c: usize| match c {
        c if c < references => (format!("cmd_{c}"), effort.clone()),
        c if c < references + inputs => (format!("force_{}", c - references), effort.clone()),
        c => (format!("pos_{}", c - references - inputs), motion.clone()),
    };
    let columns = given.columns(references + inputs + outputs).into_iter().enumerate();
    let Ok(recording) = Recording::new(RATE_HZ, columns.map(|(c, samples)| Channel::new(name(c).0, name(c).1, samples)).collect()) else { return };
    let ports = Ports {
        references: (0..references).collect(),
        inputs: (references..references + inputs).collect(),
        outputs: (references + inputs..references + inputs + outputs).collect(),
    };
    let labels = Labels::of(&recording, &ports);
    let half = recording.len() / 2;
    let halves = (half > 4 && given.bit(5, 0)).then(|| Some((recording.slice(0..half).ok()?, recording.slice(half..2 * half).ok()?))).flatten();
    let trials = halves.as_ref().map_or_else(|| vec![&recording], |(a, b)| vec![a, b]);
    let how = given.one_of(4, &[Direct::H1, Direct::H2, Direct::Hv]);
    let found = match given.choose(2, 9) {
        kind @ 0..=4 => estimate(&trials, &ports, &labels, &method(given, kind, trials[0].len()), how).ok(),
        5 => {
            let welch = welch(given, trials[0].len());
            robust_spectra(&trials, &ports, &welch).ok().and_then(|(spectra, rejected)| {
                assert!(rejected.iter().all(|r| (1..=trials.len()).contains(&r.trial) && r.start_s < r.end_s), "{rejected:?}");
                estimate_from_spectra(spectra, &ports, &labels, &SpectralMethod::Welch(welch), how).ok()
            })
        }
        6 => {
            let method = method(given, given.choose(4, 5), trials[0].len());
            sliding(&trials, &ports, &labels, (&method, how), given.value(0) / RATE_HZ, 0.1).ok().and_then(|mut all| all.pop()).map(|(_, found)| found)
        }
        7 => {
            let choice = choose_method(&trials, &ports);
            estimate(&trials, &ports, &labels, &choice.method, Direct::H1).ok()
        }
        _ => {
            in_pieces(given, &recording);
            None
        }
    };
    let Some(found) = found else { return };
    bounded(&found);
    used(given, &found);
}

fn welch(given: &Given, samples: usize) -> Welch {
    let length = 1 + given.choose(3, 256) % samples.max(1);
    let window = given.one_of(6, &[Window::Hann, Window::Rectangular, Window::Tukey(0.3), Window::FlatTop]);
    let noverlap = [length / 2, 0, length.saturating_sub(1), length][given.choose(5, 16) / 4];
    let detrend = given.one_of(4, &[Detrend::Constant, Detrend::None, Detrend::Linear]);
    Welch { noverlap, window, detrend, window_symmetric: given.bit(6, 4), nfft: length + usize::from(given.bit(6, 5)) * length, ..Welch::new(length) }
}

fn method(given: &Given, kind: usize, samples: usize) -> SpectralMethod {
    let setting = given.choose(3, 256);
    let half_width = (setting & 1 != 0).then_some(setting / 2 % 16);
    match kind {
        0 => SpectralMethod::Welch(welch(given, samples)),
        1 => SpectralMethod::Multitaper(Multitaper {
            time_bandwidth: 1.0 + (setting % 8) as f64 / 2.0,
            adaptive: given.bit(6, 6),
            tapers: (setting & 16 != 0).then_some(setting / 32),
            ..Multitaper::default()
        }),
        2 => SpectralMethod::LocalPolynomial(LocalPolynomial { order: setting / 32 % 4, half_width, leave_one_out: given.bit(6, 6) }),
        3 => SpectralMethod::LocalRational(LocalRational { order: setting / 32 % 3, half_width, ..LocalRational::default() }),
        _ => SpectralMethod::Periodic(Periodic { period: setting % samples.max(1), discard: given.choose(6, 4) }),
    }
}

/// Welch's spectra as a stream and from parts: the same to the last digit.
fn in_pieces(given: &Given, recording: &Recording) {
    let welch = welch(given, recording.len());
    let all: Vec<usize> = (0..recording.channels().len()).collect();
    let columns = recording.columns(&all);
    let Ok(whole) = welch.spectra(RATE_HZ, &columns) else { return };
    let mut stream = welch.stream(RATE_HZ, columns.len()).expect("settings that the whole took");
    let step = 1 + given.choose(5, 32);
    for from in (0..recording.len()).step_by(step) {
        let piece: Vec<&[f64]> = columns.iter().map(|c| &c[from..(from + step).min(c.len())]).collect();
        stream.push(&piece).expect("samples that the whole took");
    }
    equal(&whole, &stream.spectra().expect("as many segments"));
    let part = |block: usize| {
        let samples = welch.block_samples(block..block + 1, recording.len());
        let own: Vec<&[f64]> = columns.iter().map(|c| &c[samples.clone()]).collect();
        welch.partial(block..block + 1, recording.len(), &own).expect("a block")
    };
    let merged = (1..welch.blocks(recording.len())).fold(part(0), |sum, block| sum.merge(part(block)).expect("the next block"));
    equal(&whole, &merged.spectra(RATE_HZ).expect("all blocks"));
}

fn equal(one: &CrossSpectra, other: &CrossSpectra) {
    for (a, b) in (0..one.channels()).flat_map(|a| (0..=a).map(move |b| (a, b))) {
        let pairs = one.pair(a, b).iter().zip(other.pair(a, b));
        assert!(pairs.into_iter().all(|(x, y)| same(x.re, y.re) && same(x.im, y.im)), "S[{a}][{b}] in pieces is another");
    }
}

fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

/// Coherences lie between 0 and 1 where they exist.
fn bounded(found: &Estimates) {
    let within = |value: &f64| value.is_nan() || (-SLACK..=1.0 + SLACK).contains(value);
    let check = |which: &str, coherence: &Coherence| {
        let all = coherence.ordinary.iter().chain(&coherence.partial).chain(&coherence.multiple);
        all.for_each(|value| assert!(within(value), "{which} coherence {value}"));
    };
    check("direct", &found.direct.coherence);
    found.direct.input_coherence.iter().for_each(|value| assert!(within(value), "input coherence {value}"));
    if let Some(derived) = &found.derived {
        let to = &derived.to_reference;
        to.output_coherence.iter().chain(&to.input_coherence).for_each(|value| assert!(within(value), "reference coherence {value}"));
    }
}

/// One thing that is done with an estimate.
fn used(given: &Given, found: &Estimates) {
    let response = found.derived.as_ref().map_or(&found.direct.response, |d| &d.response);
    match given.choose(7, 32) / 2 % 6 {
        0 => crate::response::intervals(response),
        1 => crate::response::kinds(response),
        2 | 3 => {
            let uncertainty = response.uncertainty.as_ref().expect("an estimate has one");
            let ordered = ordered_coherence(response, &uncertainty.input_inverse, &found.direct.coherence.multiple);
            assert_eq!(ordered.dim(), response.value.dim());
        }
        4 => {
            let rule = StoppingRule { relative_half_width: 0.1, level: 0.95, low_hz: 0.0, high_hz: 50.0, share: 1.0, diagonal_only: given.bit(6, 7) };
            if let Some(progress) = rule.judge(response) {
                assert!((0.0..=1.0).contains(&progress.share), "{progress:?}");
            }
            let _ = unresolved(response, 0.1, 0.0, f64::INFINITY);
        }
        _ => {
            let _ = spread(&[response.clone(), found.direct.response.clone()], 0.0, RATE_HZ);
        }
    }
}
