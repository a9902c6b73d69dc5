//! A low-pass filter on some channels and not on others.

use super::vocabulary::*;
use num_complex::Complex64;
use std::f64::consts::{PI, SQRT_2, TAU};

const CUTOFF: ParameterCard = plain("cutoff_hz", "Hz", 1e-9, 1e7, None);
const ORDER: ParameterCard = plain("order", "", 1.0, 8.0, Some(1.0));
const CHANNEL: ParameterCard = plain("channel", "", 0.0, 0.0, None);
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
pub struct ChannelFilter;

/// A section of second (or first) order, by the bilinear transform with the cut-off kept.
struct Section {
    b: [f64; 3],
    a: [f64; 2],
    x: [f64; 2],
    y: [f64; 2],
}

impl Section {
    fn step(&mut self, x: f64) -> f64 {
        let y = self.b[0] * x + self.b[1] * self.x[0] + self.b[2] * self.x[1] - self.a[0] * self.y[0] - self.a[1] * self.y[1];
        self.x = [x, self.x[0]];
        self.y = [y, self.y[0]];
        y
    }
}

/// A Butterworth low-pass.
pub(super) struct LowPass(Vec<Section>);

impl LowPass {
    pub(super) fn butterworth(cutoff_hz: f64, order: usize, sample_rate_hz: f64) -> Self {
        let w = (PI * (cutoff_hz / sample_rate_hz).min(0.49)).tan();
        let rest = [0.0; 2];
        let mut sections: Vec<Section> = (0..order / 2)
            .map(|k| {
                let damping = 2.0 * (PI * (2 * k + 1) as f64 / (2 * order) as f64).sin();
                let norm = 1.0 + damping * w + w * w;
                let gain = w * w / norm;
                Section { b: [gain, 2.0 * gain, gain], a: [2.0 * (w * w - 1.0) / norm, (1.0 - damping * w + w * w) / norm], x: rest, y: rest }
            })
            .collect();
        if order % 2 == 1 {
            let gain = w / (1.0 + w);
            sections.push(Section { b: [gain, gain, 0.0], a: [(w - 1.0) / (1.0 + w), 0.0], x: rest, y: rest });
        }
        LowPass(sections)
    }
}

impl Stage for LowPass {
    fn step(&mut self, sample: f64) -> f64 {
        self.0.iter_mut().fold(sample, |x, section| section.step(x))
    }
}

/// What undoes the filter of that order at s: its denominator.
fn undo(s: Complex64, time: f64, order: usize) -> Complex64 {
    let p = s * time;
    if order == 1 { 1.0 + p } else { 1.0 + SQRT_2 * p + p * p }
}

impl Effect for ChannelFilter {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let order = parameters.number(CARD.name, &ORDER)?.round() as usize;
        Ok(Injection::Stage(Box::new(LowPass::butterworth(parameters.number(CARD.name, &CUTOFF)?, order, setting.sample_rate_hz))))
    }

    /// All efforts against all motions; where there are several axes, each channel against all others, too.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let unit = scale.time_s;
        let of = |axis: Option<usize>, on_effort: bool, order: usize| {
            // A pole's delay grows with the order: the same range of delay for each. From the fourth order a filter is a delay.
            let spread = if order == 1 { 1.0 } else { SQRT_2 };
            let names = if on_effort { &scale.effort_names } else { &scale.motion_names };
            let channel = axis.map_or_else(|| names.join(", "), |axis| names.get(axis).cloned().unwrap_or_default());
            let operator: Operator = Arc::new(move |s, k| undo(s, k[0], order));
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
            Form { side: Side::Sensor, ..form }
        };
        let axes = std::iter::once(None).chain((0..scale.axes()).map(Some).filter(|_| scale.axes() > 1));
        axes.flat_map(|axis| [(true, 1), (true, 2), (false, 1), (false, 2)].map(|(on_effort, order)| of(axis, on_effort, order))).collect()
    }

    fn stands_for(&self, evidence: &Evidence<'_>) -> &'static [&'static str] {
        if (evidence.gain_worth)().is_some_and(|worth| worth <= GAIN_SEEN) { &["measurement-delay"] } else { &[] }
    }
}
