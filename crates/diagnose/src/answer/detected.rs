//! Causes that no search finds: tones, bursts, steps in a channel, and the plant's own force.

use super::cause::tail;
use super::gains::Gains;
use super::material::Answer;
use crate::detectors::{Burst, Frozen, Tone};
use crate::floor;
use crate::judge::Errors;
use crate::result::{Cause, CauseParameter, Gain};
use ndof_models::effects::{EFFECTS, Effect, Trace, Value};

/// A parameter's name, value and 95 % interval.
type Named = (&'static str, Value, Option<[f64; 2]>);

/// Degrees of freedom of a burst's window: 0.4 s of a band to 12 Hz.
const BURST_FREEDOM: f64 = 9.0;
/// Share of the slow motion that the plant's own force has to make.
const OWN_SHARE: f64 = 0.1;
/// What makes far more than there is, is no noise: a drift, say.
const MOST_OWN: f64 = 1.2;

impl Answer<'_> {
    /// A cause that a detector found, with what it gains.
    fn quiet(
        &self,
        effect: &'static Effect,
        axis: Option<usize>,
        parameters: Vec<Named>,
        (probability, p_value): (f64, f64),
        gain: Gain,
        evidence: String,
    ) -> Cause {
        let rotational = self.subject.scale.rotational;
        let named = |(name, value, ci95): Named| CauseParameter {
            name: if rotational { ndof_models::effects::rotational_name(name) } else { name.to_owned() },
            unit: effect.card.parameters.iter().find(|p| p.name == name).map_or("", |p| if rotational { p.rotational_unit } else { p.unit }).to_owned(),
            value,
            ci95,
        };
        Cause {
            effect: effect.name().to_owned(),
            site: self.site(effect.card.sides[0], axis),
            parameters: parameters.into_iter().map(named).collect(),
            probability,
            p_value,
            gain,
            evidence: vec![evidence],
            over_schedule: Vec::new(),
            features: None,
            at_most: 1.0,
            lead: None,
        }
    }

    /// Tones, which are predicted with an amplitude and a phase of each trial's own.
    pub(super) fn tones(&self, before: &Errors, after: &Errors, gains: &Gains<'_>, limit: f64) -> Vec<Cause> {
        let (layout, tones) = (&self.subject.layout, &self.findings.tones);
        let Some(effect) = traced(Trace::Tone) else { return Vec::new() };
        let around = |value: f64, sigma: f64| Some([value - 1.96 * sigma, value + 1.96 * sigma]);
        let cause = |(number, tone): (usize, &Tone)| {
            // The Cramér-Rao bounds of a sine in white noise under this window; the grid and the tone's wandering make a line's width each.
            let duration_s = layout.samples as f64 / layout.rate_hz;
            let place = (1.0 / (std::f64::consts::PI * duration_s * tone.height.sqrt())).hypot(1.0 / (duration_s * 6f64.sqrt()));
            let chance = (0.5 * layout.samples as f64 * (-tone.height).exp()).min(1.0);
            // Of several tones each takes its part alone.
            let without = before.without_tone(tone.frequency_hz);
            let alone = without.as_ref().unwrap_or(after);
            let gain = gains.of_tone(number, [before, alone]);
            let parameters = vec![
                ("frequency_hz", Value::Number(tone.frequency_hz), around(tone.frequency_hz, place)),
                ("amplitude_n", Value::Number(tone.amplitude), around(tone.amplitude, tone.amplitude / (3.0 * tone.height).sqrt())),
            ];
            let evidence = format!(
                "a line {:.0} times above its surroundings at {:.3} Hz, {:.1} % of the residual force's power; it was masked before anything else was tried",
                tone.height,
                tone.frequency_hz,
                100.0 * tone.share
            );
            self.quiet(effect, Some(tone.axis), parameters, (0.97f64.min(limit), chance), gain, evidence)
        };
        tones.iter().enumerate().filter(|(number, _)| gains.has_tone(*number)).map(cause).collect()
    }

    /// Bursts and steps of a channel, which no model predicts.
    pub(super) fn detected(&self, causes: &mut Vec<Cause>, before: &Errors, limit: f64) {
        let layout = &self.subject.layout;
        let unchanged = || unpredicted(before);
        let of_its_sensor = |burst: &&Burst| {
            let within = |stop: &Frozen| stop.trial == burst.trial && stop.from_s < burst.to_s && burst.from_s < stop.to_s;
            self.findings.frozen.iter().any(within)
        };
        for burst in self.findings.bursts.iter().filter(|burst| !of_its_sensor(burst)) {
            if let Some(effect) = traced(Trace::Burst) {
                causes.push(self.quiet(
                    effect,
                    Some(burst.axis),
                    vec![("time_s", Value::Number(burst.from_s), Some([burst.from_s, burst.to_s])), ("impulse_n_s", Value::Number(burst.impulse), None)],
                    ((1.0 - 4.0 / burst.peak).clamp(0.5, 0.97).min(limit), tail(BURST_FREEDOM * burst.peak, BURST_FREEDOM as usize, layout.samples)),
                    unchanged(),
                    format!(
                        "{:.0} % of the whitened residual lies between {:.2} and {:.2} s of trial {}; that stretch was left out of everything else",
                        100.0 * burst.share,
                        burst.from_s,
                        burst.to_s,
                        burst.trial + 1
                    ),
                ));
            }
        }
        for levels in &self.findings.levels {
            if let Some(effect) = traced(Trace::Levels) {
                let names = if levels.effort { &self.meaning.effort_names } else { &self.meaning.motion_names };
                let channel = names[levels.axis].clone();
                let evidence =
                    format!("every value of {channel} is a multiple of {:.3e}: rounding makes {:.1} % of its rms", levels.step, 100.0 * levels.share);
                let step = vec![("step", Value::Number(levels.step), None), ("channel", Value::Text(channel), None)];
                causes.push(self.quiet(effect, None, step, (0.98f64.min(limit), f64::NAN), unchanged(), evidence));
            }
        }
    }

    /// The force that the plant makes by itself, where it moves the plant visibly.
    pub(super) fn own_force(&self, causes: &mut Vec<Cause>, before: &Errors) {
        let Some(effect) = traced(Trace::Noise) else { return };
        if self.meaning.motion_imposed {
            return;
        }
        for axis in 0..self.subject.layout.axes {
            let (share, tilt, rms) = floor::own_motion(self.subject, &self.found.stand, &self.gate.power, axis);
            if (OWN_SHARE..MOST_OWN).contains(&share) && tilt > 5.0 {
                let rms = vec![("rms_n", Value::Number(rms), None)];
                let evidence = format!(
                    "{:.0} % of the motion's power from 0.25 to 1.5 Hz (of a band to 12 Hz) comes from a force that the perturbation did not cause; below the band's middle it is {tilt:.0} times stronger than above",
                    100.0 * share
                );
                causes.push(self.quiet(effect, Some(axis), rms, ((0.5 + share).min(0.95), f64::NAN), unpredicted(before), evidence));
            }
        }
    }
}

/// Nothing is predicted by it.
fn unpredicted(before: &Errors) -> Gain {
    Gain::of_runs([&before.score; 2], f64::NAN)
}

fn traced(trace: Trace) -> Option<&'static Effect> {
    EFFECTS.iter().copied().find(|e| e.card.trace == trace)
}
