//! Latency between channels.

use super::vocabulary::*;
use std::collections::VecDeque;

const DELAY: ParameterCard = plain("delay_s", "s", -10.0, 10.0, None);
const CHANNEL: ParameterCard = plain("channel", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "measurement-delay",
    what: "latency of some channels against the others; only the difference can be seen",
    sides: &[Side::Sensor],
    parameters: &[DELAY, CHANNEL],
    signature: "a phase that falls in proportion to frequency while the gain stays",
    look_alikes: &["channel-filter", "extra-resonance", "viscoelastic"],
    next_experiment: "a perturbation with more power from 15 to 30 Hz, or the same one on a known spring: a delay keeps its straight phase",
    equation: "measured(t) = true(t - delay)",
    source: "Oppenheim & Schafer 1989, Discrete-time signal processing",
    trace: Trace::Forms,
};

/// Latency of channels.
pub struct MeasurementDelay;

/// A delay of any length; fractions of a sample by linear interpolation.
pub(super) struct DelayLine {
    line: VecDeque<f64>,
    fraction: f64,
}

impl DelayLine {
    pub(super) fn new(samples: f64) -> Self {
        let whole = samples.floor();
        DelayLine { line: vec![0.0; whole as usize + 1].into(), fraction: samples - whole }
    }
}

impl Stage for DelayLine {
    fn step(&mut self, sample: f64) -> f64 {
        self.line.push_back(sample);
        let older = self.line.pop_front().unwrap_or(sample);
        let newer = self.line.front().copied().unwrap_or(sample);
        newer + self.fraction * (older - newer)
    }
}

impl Effect for MeasurementDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let delay = parameters.number(CARD.name, &DELAY)?;
        if delay < 0.0 {
            return Err(EffectError::OutOfBounds { effect: CARD.name, parameter: DELAY.name, value: delay, lo: 0.0, hi: DELAY.bounds.1 });
        }
        Ok(Injection::Stage(Box::new(DelayLine::new(delay * setting.sample_rate_hz))))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let unit = scale.time_s;
        let (effort, motion) = (Scale::joined(&scale.effort_names), Scale::joined(&scale.motion_names));
        let starts = [-17.0, -12.0, -8.5, -6.0, -4.2, -3.0, -2.0, -1.0, -0.3, 0.3, 1.0, 2.0, 3.0, 4.2, 6.0, 8.5, 12.0, 17.0, 24.0];
        let form = Form::new("delay", None, Action::Effort(Arc::new(|s, k| (s * k[0]).exp())))
            .knobs(vec![Knob::linear(-0.03 * unit, 0.03 * unit)], &[&starts.map(|ms| ms * 1e-3 * unit)])
            .naming(move |k, _| {
                let late = if k[0] >= 0.0 { &effort } else { &motion };
                vec![("delay_s", Value::Number(k[0].abs())), ("channel", Value::Text(late.clone()))]
            });
        vec![Form { side: Side::Sensor, ..form.floor(0.0, 1.0e-4) }]
    }
}
