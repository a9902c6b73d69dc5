//! A low-pass filter on some channels and not on others.

use super::vocabulary::*;
use crate::blocks::{FirstOrderFilter, SecondOrderFilter};
use ndof_signal::{Passband, SosFilter, SosStream};
use std::f64::consts::{SQRT_2, TAU};

const CUTOFF: ParameterCard = plain("cutoff_hz", "Hz", 1e-9, 1e7, None);
const ORDER: ParameterCard = plain("order", "", 1.0, 8.0, Some(1.0));
const CARD: Card = Card {
    name: "channel-filter",
    what: "an anti-alias or smoothing filter on some channels and not on others",
    sides: &[Side::Sensor],
    parameters: &[CUTOFF, ORDER, CHANNEL],
    signature: "a phase roll-off at high coherence, with a little gain lost",
    look_alikes: &["measurement-delay", "extra-resonance", "viscoelastic"],
    next_experiment: "a perturbation with more power from 15 to 30 Hz, or the same one on a known spring: a filter loses gain, a delay does not",
    equation: "measured = true / (1 + s / ω)^order (Butterworth from order 2)",
    source: "Oppenheim & Schafer 1989, Discrete-time signal processing",
    trace: Trace::Forms,
};

/// Log-likelihood that the gain which a filter takes has to be worth: below it the filter is a delay for all that the recording says.
const GAIN_SEEN: f64 = 3.0;

/// A low-pass of channels.
pub(super) const EFFECT: Effect = Effect { forms, stands_for, latency: Some(LATENCY), ..Effect::new(&CARD, injection) };

/// A Butterworth low-pass at rest; a corner beyond what the samples hold is the highest that they do.
pub(super) fn low_pass(effect: &'static str, cutoff_hz: f64, order: usize, sample_rate_hz: f64) -> Result<SosStream, EffectError> {
    let passband = Passband::Low(cutoff_hz.min(0.49 * sample_rate_hz));
    let refused = |_| EffectError::Setting { effect, what: "a sample rate above zero" };
    SosFilter::butterworth(order, passband, sample_rate_hz).map(|filter| filter.stream()).map_err(refused)
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let order = parameters.number(CARD.name, &ORDER)?.round() as usize;
    let mut filter = low_pass(CARD.name, parameters.number(CARD.name, &CUTOFF)?, order, setting.sample_rate_hz)?;
    Ok(Injection::Stage(Box::new(move |sample: f64| filter.step(sample))))
}

/// All efforts against all motions; where there are several axes, each channel against all others, too.
fn forms(scale: &Scale) -> Vec<Form> {
    let unit = scale.time_s;
    let of = |axis: Option<usize>, on_effort: bool, order: usize| {
        // A pole's delay grows with the order: the same range of delay for each. From the fourth order a filter is a delay.
        let spread = if order == 1 { 1.0 } else { SQRT_2 };
        let names = if on_effort { &scale.effort_names } else { &scale.motion_names };
        let channel = axis.map_or_else(|| names.join(", "), |axis| names.get(axis).cloned().unwrap_or_default());
        let undo = if order == 1 { FirstOrderFilter::denominator } else { SecondOrderFilter::denominator };
        let operator: Operator = Arc::new(move |s, k| undo(s * k[0]));
        let action = if on_effort { Action::Effort(operator) } else { Action::Motion(operator) };
        // A single channel's are a factor of three apart; the best of them is refined.
        let starts: &[f64] = if axis.is_none() { &[0.3, 0.8, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0] } else { &[0.5, 1.4, 4.0, 11.0] };
        let starts: Vec<f64> = starts.iter().map(|ms| 1e-3 * ms / spread * unit).collect();
        let form = Form::new(if order == 1 { "first order" } else { "second order" }, axis, action)
            .knobs(vec![Knob::log(5e-5 * unit, 0.05 / spread * unit)], &[&starts])
            .naming(move |k, _| {
                let (cutoff, order) = (Value::Number(1.0 / (TAU * k[0])), Value::Number(order as f64));
                vec![("cutoff_hz", cutoff), ("order", order), ("channel", Value::Text(channel.clone()))]
            });
        form.at(Side::Sensor)
    };
    let axes = std::iter::once(None).chain((0..scale.axes()).map(Some).filter(|_| scale.axes() > 1));
    axes.flat_map(|axis| [(true, 1), (true, 2), (false, 1), (false, 2)].map(|(on_effort, order)| of(axis, on_effort, order))).collect()
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    if (evidence.gain_worth)().is_some_and(|worth| worth <= GAIN_SEEN) { &["measurement-delay"] } else { &[] }
}

/// 1/ω of the first order, √2/ω of a Butterworth's second: either way round.
const LATENCY: Latency =
    Latency { parameter: CUTOFF.name, grows_by: None, beyond_s: 0.0, turned: |cutoff_hz, order| if order == 2.0 { SQRT_2 } else { 1.0 } / (TAU * cutoff_hz) };
