//! A wrong gain or unit of a channel.

use super::vocabulary::*;

const FACTOR: ParameterCard = plain("factor", "", -1e6, 1e6, None);
const RELATIVE: ParameterCard = plain("relative_to", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "sensor-scale",
    what: "a wrong gain or unit of a channel",
    sides: &[Side::Sensor],
    parameters: &[FACTOR, CHANNEL, RELATIVE],
    signature: "inertia, damping and stiffness wrong by one factor; with several axes, asymmetric by it",
    look_alikes: &["parameter-error", "added-mass"],
    next_experiment: "a known weight on the sensor, a known distance for the encoder",
    equation: "measured = factor × true",
    source: "calibration of a linear sensor",
    trace: Trace::Forms,
};

/// Gains that a search starts from: units that were mistaken for each other, and calibrations.
const STARTS: [f64; 8] = [0.2, 0.6, 0.9, 0.97, 1.03, 1.1, 1.6, 4.45];

/// A factor on channels.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
    if parameters.text(RELATIVE.name).is_some() {
        return Err(EffectError::Kind {
            effect: CARD.name,
            parameter: RELATIVE.name,
            expected: "left out: answers alone have it, and a gain is hidden in one channel",
        });
    }
    let factor = parameters.number(CARD.name, &FACTOR)?;
    Ok(Injection::Stage(Box::new(move |sample: f64| factor * sample)))
}

/// Against a baseline whose inertia is given on the axis. Fitted matrices absorb a gain of all channels; symmetric ones tell that of each beside the
/// first.
fn forms(scale: &Scale) -> Vec<Form> {
    let n = scale.axes();
    let given = |axis: &usize| scale.is_given(Matrix::Mass, *axis, *axis);
    let relative = scale.symmetric && !(0..n).any(|axis| given(&axis));
    let channel = |axis: usize| Value::Text(scale.effort_names.get(axis).cloned().unwrap_or_default());
    (0..n)
        .filter(|axis| given(axis) || relative && *axis > 0)
        .map(|axis| {
            let told: Vec<_> = [("channel", channel(axis))].into_iter().chain(relative.then(|| ("relative_to", channel(0)))).collect();
            let entry = move |r: usize, c: usize, gain: f64| if r != c { 0.0 } else { 1.0 / if r == axis { gain } else { 1.0 } };
            let mix = move |k: &[f64]| (0..n).map(|r| (0..n).map(|c| entry(r, c, k[0])).collect()).collect();
            Form::new("gain of an effort channel", Some(axis), Action::Mix(Arc::new(mix)))
                .knobs(vec![Knob::log(0.1, 10.0)], &[&STARTS])
                .naming(move |k, _| [("factor", Value::Number(k[0]))].into_iter().chain(told.clone()).collect())
                .floor(0.005)
                .at(Side::Sensor)
        })
        .collect()
}
