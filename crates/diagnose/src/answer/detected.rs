//! Causes that no search finds: tones, bursts, steps in a channel, and the plant's own force.

use super::Answer;
use super::cause::tail;
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
    /// Causes that detectors found.
    pub(super) fn detected(&self, causes: &mut Vec<Cause>, before: &Errors, limit: f64) {
        let quiet = |effect: &'static dyn Effect, axis: Option<usize>, parameters: Vec<Named>, (probability, p_value): (f64, f64), evidence: String| Cause {
            effect: effect.name().to_owned(),
            site: self.site(effect.card().sides[0], axis),
            parameters: parameters
                .into_iter()
                .map(|(name, value, ci95)| {
                    let card = effect.card().parameters.iter().find(|p| p.name == name);
                    let rotational = self.subject.scale.rotational;
                    CauseParameter {
                        name: if rotational { ndof_models::effects::rotational_name(name) } else { name.to_owned() },
                        unit: card.map_or("", |p| if rotational { p.rotational_unit } else { p.unit }).to_owned(),
                        value,
                        ci95,
                    }
                })
                .collect(),
            probability: probability.min(limit),
            p_value,
            gain: Gain {
                nrmse_before: before.score.nrmse.clone(),
                nrmse_after: before.score.nrmse.clone(),
                vaf_before: before.score.vaf_percent.clone(),
                vaf_after: before.score.vaf_percent.clone(),
                explained_fraction: None,
                explained_fraction_ci95: None,
                delta_bic: 0.0,
            },
            evidence: vec![evidence],
            features: None,
            at_most: limit,
        };
        let layout = &self.subject.layout;
        let around = |value: f64, sigma: f64| Some([value - 1.96 * sigma, value + 1.96 * sigma]);
        for tone in &self.findings.tones {
            if let Some(effect) = traced(Trace::Tone) {
                // The Cramér-Rao bounds of a sine in white noise under this window; the grid and the tone's wandering make a line's width each.
                let duration_s = layout.samples as f64 / layout.rate_hz;
                let place = (1.0 / (std::f64::consts::PI * duration_s * tone.height.sqrt())).hypot(1.0 / (duration_s * 6f64.sqrt()));
                let chance = (0.5 * layout.samples as f64 * (-tone.height).exp()).min(1.0);
                causes.push(quiet(
                    effect,
                    Some(tone.axis),
                    vec![
                        ("frequency_hz", Value::Number(tone.frequency_hz), around(tone.frequency_hz, place)),
                        ("amplitude_n", Value::Number(tone.amplitude), around(tone.amplitude, tone.amplitude / (3.0 * tone.height).sqrt())),
                    ],
                    (0.97, chance),
                    format!("a line {:.0} times above its surroundings at {:.3} Hz, {:.1} % of the residual force's power; it was masked before anything else was tried", tone.height, tone.frequency_hz, 100.0 * tone.share),
                ));
            }
        }
        for burst in &self.findings.bursts {
            if let Some(effect) = traced(Trace::Burst) {
                causes.push(quiet(
                    effect,
                    Some(burst.axis),
                    vec![("time_s", Value::Number(burst.from_s), Some([burst.from_s, burst.to_s])), ("impulse_n_s", Value::Number(burst.impulse), None)],
                    ((1.0 - 4.0 / burst.peak).clamp(0.5, 0.97), tail(BURST_FREEDOM * burst.peak, BURST_FREEDOM as usize, layout.samples)),
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
                let step = vec![
                    // Every gap is a multiple of it within this.
                    ("step", Value::Number(levels.step), Some([0.98 * levels.step, 1.02 * levels.step])),
                    ("channel", Value::Text(channel), None),
                ];
                causes.push(quiet(effect, None, step, (0.98, 0.0), evidence));
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
                causes.push(Cause {
                    effect: effect.name().to_owned(),
                    site: self.site(effect.card().sides[0], Some(axis)),
                    parameters: vec![CauseParameter {
                        name: if self.subject.scale.rotational { "rms_nm".to_owned() } else { "rms_n".to_owned() },
                        unit: if self.subject.scale.rotational { "N m".to_owned() } else { "N".to_owned() },
                        value: Value::Number(rms),
                        ci95: Some([0.9 * rms, 1.1 * rms]),
                    }],
                    probability: (0.5 + share).min(0.95),
                    p_value: 0.0,
                    gain: Gain {
                        nrmse_before: before.score.nrmse.clone(),
                        nrmse_after: before.score.nrmse.clone(),
                        vaf_before: before.score.vaf_percent.clone(),
                        vaf_after: before.score.vaf_percent.clone(),
                        explained_fraction: None,
                        explained_fraction_ci95: None,
                        delta_bic: 0.0,
                    },
                    features: None,
                    at_most: 1.0,
                    evidence: vec![format!("{:.0} % of the motion's power from 0.25 to 1.5 Hz (of a band to 12 Hz) comes from a force that the perturbation did not cause; below the band's middle it is {tilt:.0} times stronger than above", 100.0 * share)],
                });
            }
        }
    }
}

fn traced(trace: Trace) -> Option<&'static dyn Effect> {
    EFFECTS.iter().copied().find(|e| e.card().trace == trace)
}
