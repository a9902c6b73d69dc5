//! A wrong gain or unit of a channel.

use super::vocabulary::*;

const FACTOR: ParameterCard = plain("factor", "", -1e6, 1e6, None);
const CARD: Card = Card {
    name: "sensor-scale",
    what: "a wrong gain or unit of a channel",
    sides: &[Side::Sensor],
    parameters: &[FACTOR, CHANNEL],
    signature: "inertia, damping and stiffness wrong by one factor",
    look_alikes: &["parameter-error", "added-mass"],
    next_experiment: "a known weight on the sensor, a known distance for the encoder",
    equation: "measured = factor × true",
    source: "calibration of a linear sensor",
    trace: Trace::Forms,
};

/// A factor on channels.
pub struct SensorScale;

impl Effect for SensorScale {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn injection(&self, parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
        let factor = parameters.number(CARD.name, &FACTOR)?;
        Ok(Injection::Stage(Box::new(move |sample: f64| factor * sample)))
    }

    /// Only against a baseline whose inertia is given on the axis: a fitted one absorbs it.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let n = scale.axes();
        (0..n)
            .filter(|&i| scale.is_given(Matrix::Mass, i, i))
            .map(|axis| {
                let channel = scale.effort_names.get(axis).cloned().unwrap_or_default();
                let entry = move |r: usize, c: usize, gain: f64| if r != c { 0.0 } else { 1.0 / if r == axis { gain } else { 1.0 } };
                let mix = move |k: &[f64]| (0..n).map(|r| (0..n).map(|c| entry(r, c, k[0])).collect()).collect();
                Form::new("gain of an effort channel", Some(axis), Action::Mix(Arc::new(mix)))
                    .knobs(vec![Knob::log(0.1, 10.0)], &[&[0.2, 0.6, 0.9, 1.1, 1.6, 4.45]])
                    .naming(move |k, _| vec![("factor", Value::Number(k[0])), ("channel", Value::Text(channel.clone()))])
                    .floor(0.005, 0.0)
                    .at(Side::Sensor)
            })
            .collect()
    }
}
