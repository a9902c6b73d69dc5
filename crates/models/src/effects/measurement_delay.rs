//! Latency between channels.

use super::vocabulary::*;
use crate::blocks::{Block, Delay};
use std::collections::VecDeque;

const DELAY: ParameterCard = plain("delay_s", "s", -10.0, 10.0, None);
const DRIFT: ParameterCard = plain("drift_s_per_s", "s/s", 0.0, 0.01, Some(0.0));
const CARD: Card = Card {
    name: "measurement-delay",
    what: "latency of some channels against the others, one that grows where each has a clock of its own; only the difference can be seen",
    sides: &[Side::Sensor],
    parameters: &[DELAY, DRIFT, CHANNEL],
    signature: "a phase that falls in proportion to frequency while the gain stays",
    look_alikes: &["channel-filter", "extra-resonance", "viscoelastic"],
    next_experiment: "a perturbation with more power from 15 to 30 Hz, or the same one on a known spring: a delay keeps its straight phase",
    equation: "measured(t) = true(t - delay - drift t)",
    source: "Oppenheim & Schafer 1989, Discrete-time signal processing",
    trace: Trace::Forms,
};

/// Delays (ms) of one channel that a search starts from: nearer to each other than a quarter of a period at the band's end.
const ONE_CHANNEL: [f64; 6] = [0.5, 2.0, 5.0, 10.0, 16.0, 24.0];

/// The most that a search looks for (s): later than that a limb's own reflexes are, the fastest of which take 30 ms. Beside a limb it is the same whatever the band,
/// for an instrument is as late as it is.
const MOST_S: f64 = 0.03;
/// Steps beyond the starts that follow the band: a third of what a search may be off, a quarter of a period at the band's end.
const STEP: f64 = 7.0e-3;

/// The longest delay that is looked for in such a recording.
pub(super) fn most_s(scale: &Scale) -> f64 {
    MOST_S * scale.time_s.max(scale.human_time_s())
}

/// Starts of a search (ms, for a band to 12 Hz) in seconds for the recording's band, and more up to [`most_s`] on each side that has any: the wider the
/// band, the nearer to its delay a search must begin.
pub(super) fn delays_s(scale: &Scale, ms: &[f64]) -> Vec<f64> {
    let mut starts: Vec<f64> = ms.iter().map(|ms| ms * 1e-3 * scale.time_s).collect();
    for side in [-1.0, 1.0] {
        let last = starts.iter().map(|start| side * start).fold(0.0, f64::max);
        let further = (1..).map(|k| last + f64::from(k) * STEP * scale.time_s).take_while(|start| *start < most_s(scale));
        if last > 0.0 {
            starts.extend(further.map(|start| side * start).collect::<Vec<_>>());
        }
    }
    starts
}

/// Half of what instruments may be late by (s): no delay is known to less.
const CLOCK_S: f64 = 1.0e-4;

/// Latency of channels.
pub(super) const EFFECT: Effect = Effect { forms, latency: Some(LATENCY), ..Effect::new(&CARD, injection) };

/// A delay of so many samples that grows by `drift` of each that comes; fractions of one by linear interpolation, nought before the first.
pub(super) fn delay_line(samples: f64, drift: f64) -> impl Stage {
    let (mut past, mut come) = (VecDeque::new(), 0.0);
    move |sample: f64| {
        past.push_back(sample);
        let late: f64 = samples + drift * come;
        come += 1.0;
        let (whole, fraction) = (late.floor() as usize, late.fract());
        while past.len() > whole + 2 {
            past.pop_front();
        }
        let ago = |steps: usize| past.len().checked_sub(steps + 1).map_or(0.0, |k| past[k]);
        ago(whole) + fraction * (ago(whole + 1) - ago(whole))
    }
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let delay = parameters.number(CARD.name, &DELAY)?;
    if delay < 0.0 {
        return Err(EffectError::OutOfBounds { effect: CARD.name, parameter: DELAY.name, value: delay, lo: 0.0, hi: DELAY.bounds.1 });
    }
    let drift = parameters.number(CARD.name, &DRIFT)?;
    Ok(Injection::Stage(Box::new(delay_line(delay * setting.sample_rate_hz, drift))))
}

/// All efforts against all motions; where there are several axes, each channel against all others, too.
fn forms(scale: &Scale) -> Vec<Form> {
    let unit = scale.time_s;
    let advance: Operator = Arc::new(|s, k| Delay.response(&[-k[0]], s));
    let longest = most_s(scale);
    let of = |axis: Option<usize>, action: Action, (lo, starts): (f64, &[f64]), [late, early]: [String; 2]| {
        let starts = delays_s(scale, starts);
        let form = Form::new("delay", axis, action).knobs(vec![Knob::linear(lo, longest)], &[&starts]).naming(move |k, _| {
            let channel = if k[0] >= 0.0 { &late } else { &early };
            vec![("delay_s", Value::Number(k[0].abs())), ("channel", Value::Text(channel.clone()))]
        });
        form.floor(0.0).absolute(DELAY.name, CLOCK_S).at(Side::Sensor)
    };
    let (effort, motion) = (&scale.effort_names, &scale.motion_names);
    let both_ways = [-17.0, -12.0, -8.5, -6.0, -4.2, -3.0, -2.0, -1.0, -0.3, 0.3, 1.0, 2.0, 3.0, 4.2, 6.0, 8.5, 12.0, 17.0, 24.0];
    let mut forms = vec![of(None, Action::Effort(advance.clone()), (-longest, &both_ways), [effort.join(", "), motion.join(", ")])];
    // Of clocks that were set together: as much at the record's end as a delay may be, from starts that are nearer to each other there than a quarter of
    // a period at the band's end (9 ms of 21).
    let most = MOST_S * unit / scale.duration_s;
    let growing = [-0.6, -0.3, -0.12, -0.04, 0.04, 0.12, 0.3, 0.6].map(|share| share * most);
    let (names, duration_s) = ([effort.join(", "), motion.join(", ")], scale.duration_s);
    let growing = Form::new("growing delay", None, Action::Lag)
        .knobs(vec![Knob::linear(-longest, longest), Knob::linear(-most, most)], &[&[0.0], &growing])
        .naming(move |k, _| {
            // Of that channel which is late by most of it.
            let most = if k[0].abs() > k[1].abs() * duration_s { k[0] } else { k[1] };
            let (late, sign) = if most < 0.0 { (1, -1.0) } else { (0, 1.0) };
            vec![("delay_s", Value::Number(sign * k[0])), ("drift_s_per_s", Value::Number(sign * k[1])), ("channel", Value::Text(names[late].clone()))]
        });
    forms.push(growing.floor(0.0).absolute(DELAY.name, CLOCK_S).absolute(DRIFT.name, CLOCK_S / scale.duration_s).at(Side::Sensor));
    if scale.axes() > 1 {
        for (axis, (effort, motion)) in effort.iter().zip(motion).enumerate() {
            let channels = [(Action::Effort(advance.clone()), effort), (Action::Motion(advance.clone()), motion)];
            forms.extend(channels.map(|(action, name)| of(Some(axis), action, (0.0, &ONE_CHANNEL), [name.clone(), name.clone()])));
        }
    }
    forms
}

const LATENCY: Latency = Latency { parameter: DELAY.name, grows_by: Some(DRIFT.name), beyond_s: f64::NEG_INFINITY, turned: |delay_s, _| delay_s };
