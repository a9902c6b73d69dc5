//! Which next experiment would tell two causes apart: both are simulated under each candidate, and diagnosed with only these two to choose from.

use crate::Options;
use crate::hypotheses::Cache;
use crate::layout::Layout;
use crate::operators::filter;
use crate::result::Prospect;
use crate::samples::{Meaning, Samples};
use crate::search::{Chosen, Found, Judged, Stand, but};
use crate::state::State;
use crate::subject::Subject;
use ndof_models::effects::EFFECTS;
use ndof_signal::curve_through;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Penalised log-likelihood by which the right one of two has to lead.
const DECIDED: f64 = 6.0;

/// Steps of the simulation in a sample.
const FINER: usize = 8;

/// What is changed of the experiment.
#[derive(Clone, Copy)]
enum Change {
    /// The same perturbation that many times as strong.
    Strength(f64),
    /// The same perturbation, three times as often.
    Longer,
    /// Noise of the same rms up to this multiple of the analysed band.
    Band(f64),
}

impl Change {
    const ALL: [Change; 6] = [Change::Strength(0.5), Change::Strength(2.0), Change::Longer, Change::Band(1.0 / 12.0), Change::Band(2.0), Change::Band(4.0)];

    fn words(self, hi_hz: f64, imposed: bool) -> String {
        let what = if imposed { "motion" } else { "force" };
        match self {
            Change::Strength(factor) => format!("the same perturbation with {factor} times the {what}"),
            Change::Longer => "the same perturbation three times as long".to_owned(),
            Change::Band(factor) => {
                format!("a perturbation of the same {what} (rms) with its power from 0 to {0:.2} Hz, analysed with --band 0-{0:.2}", factor * hi_hz)
            }
        }
    }
}

/// A model that may be the true one.
struct Rival<'a> {
    chosen: Vec<Chosen>,
    stand: std::borrow::Cow<'a, Stand>,
    name: &'static str,
}

/// How well each candidate would tell cause `position` of the search from a rival of its step, the best first.
pub(crate) fn prospects(subject: &Subject, meaning: &Meaning, options: &Options, found: &Found, position: usize, rival: &Judged) -> Vec<Prospect> {
    let name = |h: usize| subject.hypotheses[h].effect.name();
    let mut other = found.chosen.clone();
    other[position] = Chosen { hypothesis: rival.hypothesis, knobs: rival.tried.knobs.clone() };
    let Some(stand) = subject.stand(&other, &found.stand.fit.power, 3) else { return Vec::new() };
    let rivals = [
        Rival { chosen: found.chosen.clone(), stand: std::borrow::Cow::Borrowed(&found.stand), name: name(found.chosen[position].hypothesis) },
        Rival { chosen: other, stand: std::borrow::Cow::Owned(stand), name: name(rival.hypothesis) },
    ];
    let kept: Vec<&str> = rivals.iter().flat_map(|r| r.chosen.iter().map(|c| name(c.hypothesis))).collect();
    let without = EFFECTS.iter().map(|e| e.name()).filter(|e| !kept.contains(e)).map(str::to_owned).collect();
    let narrow = Options { without, band_hz: None, ..options.clone() };
    let hi_hz = subject.layout.frequency_hz[subject.layout.lines() - 1];
    let mut out: Vec<Prospect> = Change::ALL
        .into_iter()
        .filter_map(|change| {
            let lead = |truth: usize| -> Option<f64> {
                let samples = simulated(subject, meaning, &rivals[truth], change, options.seed)?;
                let band_hz = match change {
                    Change::Band(factor) => Some((0.0, factor * hi_hz)),
                    Change::Strength(_) | Change::Longer => None,
                };
                leads(subject, meaning, &Options { band_hz, ..narrow.clone() }, &samples, &rivals, truth, position)
            };
            let separation = lead(0)?.min(lead(1)?);
            Some(Prospect { experiment: change.words(hi_hz, meaning.motion_imposed), separation, decides: separation > DECIDED })
        })
        .collect();
    out.sort_by(|a, b| b.separation.total_cmp(&a.separation));
    out
}

/// By how much the truth leads its rival on simulated data.
fn leads(subject: &Subject, meaning: &Meaning, options: &Options, samples: &Samples, rivals: &[Rival<'_>; 2], truth: usize, position: usize) -> Option<f64> {
    let there = Subject::new(samples, meaning, options, None, true).ok()?;
    // The causes that both have in common stay in the model.
    let again = |c: Chosen| {
        let old = &subject.hypotheses[c.hypothesis];
        let hypothesis = there.hypotheses.iter().position(|h| h.shares_a_site(old) && h.form.label == old.form.label)?;
        Some(Chosen { hypothesis, ..c })
    };
    let taken: Vec<Chosen> = but(&rivals[0].chosen, position).into_iter().filter_map(again).collect();
    let stand = there.stand(&taken, &there.start, 4)?;
    let step = there.step(&stand, &taken, &Cache::new(&there.hypotheses));
    let best =
        |name: &str| step.judged.iter().filter(|j| there.hypotheses[j.hypothesis].effect.name() == name).map(|j| j.net).fold(f64::NEG_INFINITY, f64::max);
    let (own, other) = (best(rivals[truth].name), best(rivals[1 - truth].name));
    // A rival that cannot be fitted at all leads by nothing.
    own.is_finite().then(|| own - other.max(0.0))
}

/// What an experiment would record if a rival were true: its noise is what the rival leaves of the recording.
fn simulated(subject: &Subject, meaning: &Meaning, rival: &Rival<'_>, change: Change, seed: u64) -> Option<Samples> {
    let (layout, state) = (&subject.layout, &rival.stand.state);
    let (n, rate_hz, samples) = (layout.axes, layout.rate_hz, layout.samples);
    let hi_hz = layout.frequency_hz[layout.lines() - 1];
    let runner = subject.runner(&rival.chosen, &rival.stand);
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x9e37_79b9);
    let mut white = |shape: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let x: Vec<f64> = (0..samples).map(|_| (0..12).map(|_| random.random_range(-0.5..0.5)).sum()).collect();
        filter(&x, rate_hz, |s: Complex64| shape(s.im / TAU).into())
    };
    let power = &rival.stand.fit.power;
    let noise_shape = |axis: usize| {
        move |f: f64| {
            let place = (f - layout.frequency_hz[0]) / (hi_hz - layout.frequency_hz[0]) * (layout.lines() - 1) as f64;
            // Beyond the band it is the noise of a displacement, which inertia turns into a force.
            let beyond = (f / hi_hz).max(1.0).powi(2);
            beyond * power[axis][(place.max(0.0) as usize).min(layout.lines() - 1)].sqrt()
        }
    };
    let trials = layout.trials * if matches!(change, Change::Longer) { 3 } else { 1 };
    let mut out = Samples {
        rate_hz,
        effort: vec![],
        motion: vec![],
        measured: vec![],
        reference: vec![vec![]; trials],
        schedule: vec![],
        start_s: vec![0.0; trials],
        duration_s: samples as f64 / rate_hz,
    };
    for trial in 0..trials {
        let source = trial % layout.trials;
        let noise: Vec<Vec<f64>> = (0..n).map(|i| white(&noise_shape(i))).collect();
        let given: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let recorded =
                    if meaning.motion_imposed { state.x[source][i].clone() } else { layout.filtered(&state.effort[source][i], |_| Complex64::ONE, None) };
                let mean = recorded.iter().sum::<f64>() / samples as f64;
                let rms = |x: &[f64], m: f64| (x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / samples as f64).sqrt();
                match change {
                    Change::Longer => recorded,
                    Change::Strength(factor) => recorded.iter().map(|v| mean + factor * (v - mean)).collect(),
                    Change::Band(factor) => {
                        let x = white(&|f| (-(f / (factor * hi_hz)).powi(8)).exp());
                        let scale = rms(&recorded, mean) / rms(&x, 0.0).max(f64::MIN_POSITIVE);
                        x.iter().map(|v| mean + scale * v).collect()
                    }
                }
            })
            .collect();
        let (effort, motion) = if meaning.motion_imposed {
            let own = Arc::new(Layout::new(1, n, samples, rate_hz, (0.0, hi_hz)));
            let tracks = vec![given.iter().map(|x| own.track(x)).collect::<Vec<_>>()];
            let moved = State::new(&own, &tracks, &tracks, &vec![0.0; n], &[]);
            let needed = runner.needed(&moved, 0);
            let forced: Vec<Vec<f64>> = needed.iter().zip(&noise).map(|(f, w)| f.iter().zip(w).map(|(f, w)| f + w).collect()).collect();
            (state.uncorrect_effort(forced), given)
        } else {
            let forced: Vec<Vec<f64>> = given.iter().zip(&noise).map(|(f, w)| f.iter().zip(w).map(|(f, w)| f - w).collect()).collect();
            // Straight lines between samples would smooth the force, which is what the channels are suspected of.
            let fine: Vec<Vec<f64>> = forced.iter().map(|f| curve_through(f, (0..f.len() * FINER).map(|k| k as f64 / FINER as f64))).collect();
            let run = runner.drive(&fine, rate_hz * FINER as f64)?;
            let motion = run.iter().map(|x| x.iter().step_by(FINER).copied().collect()).collect();
            let motion = state.uncorrect_motion(motion, 0, &given);
            (state.uncorrect_effort(given), motion)
        };
        out.effort.push(effort);
        out.measured.push(motion.clone());
        out.motion.push(motion);
    }
    out.motion.iter().chain(&out.effort).flatten().flatten().all(|v| v.is_finite()).then_some(out)
}
