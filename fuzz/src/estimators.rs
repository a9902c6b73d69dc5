//! Estimators and fits with arbitrary numbers, from the smallest to the largest and what is none.

use ndof_models::{Axis, InertiaDampingStiffnessModel, Symmetry, WeightedFit, linear_start};
use ndof_signal::{Channel, Detrend, Multitaper, Passband, Periodic, Quantity, Recording, SosFilter, Unit, Welch, Window, detect_period, normality, reverse_arrangements};
use ndof_sysid::{Direct, Estimates, Labels, LocalPolynomial, LocalRational, Ports, ResponseKind, SpectralMethod, estimate};

/// Samples that one execution takes at most, so that none is slow.
const MOST: usize = 512;

/// The first bytes choose channels, method and settings; the rest are numbers, raw or scaled bytes.
pub fn estimators(data: &[u8]) {
    let Some((choice, rest)) = data.split_first_chunk::<6>() else { return };
    let inputs = 1 + usize::from(choice[0] % 2);
    let outputs = 1 + usize::from(choice[0] / 2 % 2);
    let references = if choice[0] & 4 != 0 { inputs } else { 0 };
    let channels = inputs + outputs + references;
    let values: Vec<f64> = if choice[0] & 8 != 0 {
        rest.chunks_exact(8).take(MOST).filter_map(|bytes| bytes.try_into().ok()).map(f64::from_le_bytes).collect()
    } else {
        let scale = 10f64.powi(i32::from(choice[1] as i8) * 2);
        rest.iter().take(MOST).map(|b| (f64::from(*b) - 127.0) * scale).collect()
    };
    let samples = values.len() / channels;
    if samples < 2 {
        return;
    }
    let column = |c: usize| values[c * samples..(c + 1) * samples].to_vec();
    let effort = Unit::si(Quantity::Effort, false);
    let motion = Unit::si(Quantity::Displacement, false);
    let name = |c: usize| match c {
        c if c < references => (format!("cmd_{c}"), effort.clone()),
        c if c < references + inputs => (format!("force_{}", c - references), effort.clone()),
        c => (format!("pos_{}", c - references - inputs), motion.clone()),
    };
    let all = (0..channels).map(|c| Channel::new(name(c).0, name(c).1, column(c))).collect();
    let Ok(recording) = Recording::new(100.0, all) else { return };
    one_channel(&recording);
    let ports = Ports {
        references: (0..references).collect(),
        inputs: (references..references + inputs).collect(),
        outputs: (references + inputs..channels).collect(),
    };
    let labels = Labels::of(&recording, &ports);
    let method = method(choice, samples);
    let how = [Direct::H1, Direct::H2, Direct::Hv][usize::from(choice[4] % 3)];
    let halves = (samples > 16 && choice[5] & 1 != 0)
        .then(|| Some((recording.slice(0..samples / 2).ok()?, recording.slice(samples / 2..samples / 2 * 2).ok()?)))
        .flatten();
    let found = match &halves {
        Some((a, b)) => estimate(&[a, b], &ports, &labels, &method, how),
        None => estimate(&[&recording], &ports, &labels, &method, how),
    };
    let Ok(found) = found else { return };
    bounded(&found);
    if inputs == outputs {
        fit(&found, inputs);
    }
}

fn method(choice: &[u8; 6], samples: usize) -> SpectralMethod {
    let length = 1 + usize::from(choice[3]) % samples;
    let detrend = [Detrend::None, Detrend::Constant, Detrend::Linear][usize::from(choice[4] / 3 % 3)];
    match choice[2] % 5 {
        0 => {
            let window = [Window::Hann, Window::Rectangular, Window::Tukey(0.3), Window::FlatTop][usize::from(choice[4] / 9 % 4)];
            SpectralMethod::Welch(Welch { noverlap: length / 2, window, detrend, ..Welch::new(length) })
        }
        1 => SpectralMethod::Multitaper(Multitaper { time_bandwidth: 1.0 + f64::from(choice[3] % 8), adaptive: choice[4] & 128 != 0, ..Multitaper::default() }),
        2 => SpectralMethod::LocalPolynomial(LocalPolynomial::default()),
        3 => SpectralMethod::LocalRational(LocalRational::default()),
        _ => SpectralMethod::Periodic(Periodic { period: length, discard: 0 }),
    }
}

/// What looks at one channel alone.
fn one_channel(recording: &Recording) {
    for channel in recording.channels() {
        let _ = detect_period(&channel.samples);
        let _ = reverse_arrangements(&channel.samples);
        let _ = normality(&channel.samples);
        if let Ok(filter) = SosFilter::butterworth(4, Passband::Low(10.0), recording.sample_rate_hz()) {
            let _ = filter.filter_zero_phase(&channel.samples);
        }
    }
}

/// Coherences lie between 0 and 1 where they exist.
fn bounded(found: &Estimates) {
    const SLACK: f64 = 1e-9;
    let coherence = &found.direct.coherence;
    let all = coherence.ordinary.iter().chain(&coherence.partial).chain(&coherence.multiple);
    for value in all.chain(&found.direct.input_coherence) {
        assert!(value.is_nan() || (-SLACK..=1.0 + SLACK).contains(value), "coherence {value}");
    }
}

fn fit(found: &Estimates, axes: usize) {
    let mut response = found.derived.as_ref().map_or(&found.direct.response, |d| &d.response).clone();
    response.kind = ResponseKind::Compliance;
    let model = InertiaDampingStiffnessModel::new((0..axes).map(|k| Axis::linear(&k.to_string())).collect(), Symmetry::Symmetric);
    let Ok(start) = linear_start(&model, &response) else { return };
    let settings = WeightedFit { band_hz: [0.5, 40.0], ..WeightedFit::default() };
    if let Ok(fit) = settings.fit(&model, &response, &start) {
        assert_eq!(fit.parameters.len(), start.len());
    }
    let _ = response.to_kind(ResponseKind::Impedance);
}
