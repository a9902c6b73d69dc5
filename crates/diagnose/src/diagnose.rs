//! The diagnosis from recordings to verdict.

use crate::answer::{Answer, Models};
use crate::baseline::Baseline;
use crate::detectors::{self, Findings, TONE_REACH};
use crate::judge::Court;
use crate::linear_fit::LinearFit;
use crate::options::Options;
use crate::pictures::Pictures;
use crate::result::Diagnosis;
use crate::samples::{Meaning, Samples};
use crate::search::Stand;
use crate::split::divide;
use crate::state::Cause;
use crate::subject::Subject;
use crate::unseen::Unseen;
use crate::{DiagnoseError, generic};
use ndof_models::effects::{EFFECTS, Trace};
use ndof_signal::{Recording, detect_period};
use ndof_sysid::Ports;
use std::sync::Arc;

/// Finds what a linear simulation (or `baseline`) gets wrong in these trials of one experiment, and why.
///
/// `progress` is told in words what is being done.
///
/// # Errors
/// [`DiagnoseError`] if the channels do not make a balance of forces, or the recording is too short or empty.
///
/// ```
/// use ndof_diagnose::{Options, diagnose};
/// use ndof_signal::{Channel, FilteredNoise, Quantity, Recording, Unit};
/// use ndof_sysid::Ports;
///
/// // A mass of 2 kg on spring and damper with 1 N of dry friction, pushed by noise of 4 N rms; 40 s.
/// let force = FilteredNoise { axes: 1, samples: 20_000, rms: 4.0, ..FilteredNoise::default() }.generate(1)?.remove(0);
/// let (mut x, mut v) = (0.0_f64, 0.0_f64);
/// let mut step = |f: f64| {
///     v += (f - 12.0 * v - 300.0 * x - (v / 0.005).tanh()) / 2.0 * 1e-4;
///     x += v * 1e-4;
///     x
/// };
/// let motion: Vec<f64> = force.iter().map(|f| (0..20).map(|_| step(*f)).sum::<f64>() / 20.0).collect(); // the mean over the interval
///
/// let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, false), samples);
/// let trial = Recording::new(500.0, vec![channel("force_x", Quantity::Effort, force), channel("pos_x", Quantity::Displacement, motion)])?;
/// let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
/// let found = diagnose(&[trial], &ports, &Options::default(), None, &mut |_| {})?;
/// assert_eq!(found.causes[0].effect, "coulomb-friction");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn diagnose(
    trials: &[Recording],
    ports: &Ports,
    options: &Options,
    baseline: Option<&Baseline>,
    progress: &mut dyn FnMut(&str),
) -> Result<Diagnosis, DiagnoseError> {
    diagnose_with_pictures(trials, ports, options, baseline, progress).map(|(diagnosis, _)| diagnosis)
}

/// The same with the samples that its pictures are drawn from.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_with_pictures(
    trials: &[Recording],
    ports: &Ports,
    options: &Options,
    baseline: Option<&Baseline>,
    progress: &mut dyn FnMut(&str),
) -> Result<(Diagnosis, Pictures), DiagnoseError> {
    let first = trials.first().ok_or(DiagnoseError::NoTrial)?;
    ports.validate(first.channels().len())?;
    let meaning = Meaning::new(first, ports)?;
    if let Some(baseline) = baseline
        && let Some(matrix) = baseline.misshapen(meaning.axes.len())
    {
        return Err(DiagnoseError::Baseline { matrix, axes: meaning.axes.len() });
    }
    let mut samples = Samples::new(trials, ports, &meaning)?;
    if let Some(schedule) = &options.schedule {
        samples.schedule.clone_from(&schedule.values);
    }
    let (mut estimation, mut held, split) = divide(&samples, &options.held_out)?;
    let clipped = if meaning.effort_is_command { vec![] } else { detectors::clipped(&estimation) };
    let mut linear = options.linear.clone().filter(|_| baseline.is_none());
    if let Some(fit) = &linear {
        [&mut estimation, &mut held].into_iter().for_each(|part| part.hold(fit.hold.unwrap_or_default(), fit.ticks.as_ref(), &meaning));
    }
    progress("preparing");
    let mut subject = Subject::new(&estimation, &meaning, options, baseline)?;
    // Some records count the effort the other way; with the wrong sign every bound of the registry points the wrong way.
    let turned = baseline.is_none() && subject.polarity < 0.0 && linear.as_ref().is_none_or(LinearFit::reversed);
    if turned {
        linear = linear.map(|fit| -fit);
        estimation.turn(meaning.reference_is_effort);
        held.turn(meaning.reference_is_effort);
        subject = Subject::new(&estimation, &meaning, options, baseline)?;
    }
    let still = !meaning.motion_imposed && linear.take_if(|fit| !fit.moves()).is_some();
    let mut findings = before_registry(&mut subject, &samples, options)?;
    findings.clipped = clipped;
    let found = subject.search(options.most_causes, progress).ok_or(DiagnoseError::BaselineFailed)?;
    progress("judging what remains");
    let free = subject.stand(&[], &subject.start, 4).ok_or(DiagnoseError::BaselineFailed)?;
    let features = generic::features(&subject, &found.stand);
    let gate = generic::gate(&subject, &free, &found, &features);
    let shares = generic::shares(&subject, &free, &features);
    let baseline_stand = linear.as_ref().and_then(|fit| subject.stand_at(fit)).unwrap_or(free);
    let restoring = subject.restores(&[], &baseline_stand, meaning.order) && subject.restores(&found.chosen, &found.stand, meaning.order);
    let court = Court::new(&held, &meaning, &subject, restoring);
    let whole = (options.added && !turned).then(|| Court::new(&samples, &meaning, &subject, restoring));
    let unseen = Unseen::new(&held, &subject, &found.stand.fit.power, &findings.tones);
    progress("free runs of the held-out part");
    let answer = Answer {
        subject: &subject,
        meaning: &meaning,
        options,
        court: &court,
        whole: whole.as_ref(),
        unseen: &unseen,
        baseline: &baseline_stand,
        linear: linear.as_ref(),
        found: &found,
        gate: &gate,
        features: &features,
        shares,
        findings: &findings,
        turned,
        still,
        models: Models::default(),
    };
    Ok(answer.write(split))
}

/// Share of the residual force's power from which a tone matters.
const TONE_SHARE: f64 = 0.03;

/// Frequency with which what drives the plant repeats, with its uncertainty: half a sample of the period.
fn repetition(samples: &Samples, motion_imposed: bool) -> Option<(f64, f64)> {
    let reference = samples.reference.first().is_some_and(|trial| !trial.is_empty());
    let driving = if reference {
        &samples.reference
    } else if motion_imposed {
        &samples.motion
    } else {
        &samples.effort
    };
    let found = driving.first()?.iter().find_map(|x| detect_period(x))?;
    let hz = samples.rate_hz / found.period as f64;
    Some((hz, 0.5 * hz / found.period as f64))
}

/// Levels, tones and bursts, in this order; tones and bursts are masked before anything else is tried.
fn before_registry(subject: &mut Subject, samples: &Samples, options: &Options) -> Result<Findings, DiagnoseError> {
    let tried = |trace: Trace| EFFECTS.iter().any(|e| e.card.trace == trace && !options.without.iter().any(|w| w == e.name()));
    let levels = if tried(Trace::Levels) { detectors::levels(samples, options.tolerance) } else { vec![] };
    let mut findings = Findings { levels, ..Findings::default() };
    let repeated = repetition(samples, matches!(subject.cause, Cause::Motion));
    // One line an axis: what trembles may tremble along all of them.
    for _ in 0..if tried(Trace::Tone) { subject.layout.axes } else { 0 } {
        let stand = stand(subject)?;
        let Some(tone) = detectors::tone(&stand, &detectors::residual(&stand, &[]), repeated, &findings.tones) else { break };
        if tone.share < TONE_SHARE || tone.amplitude < options.tolerance * subject.scale.effort[tone.axis] {
            break;
        }
        let reach = TONE_REACH / subject.layout.time_s;
        let layout = Arc::make_mut(&mut subject.layout);
        for (keep, f) in layout.keep.iter_mut().zip(&layout.frequency_hz) {
            *keep &= (f - tone.frequency_hz).abs() >= reach;
        }
        findings.tones.push(tone);
    }
    let stand = stand(subject)?;
    let bursts = if tried(Trace::Burst) { detectors::bursts(&stand, &detectors::residual(&stand, &[])) } else { vec![] };
    findings.bursts = bursts.into_iter().filter(|b| b.size > options.tolerance).collect();
    if !findings.bursts.is_empty() {
        let layout = Arc::make_mut(&mut subject.layout);
        layout.weights = vec![vec![1.0; layout.samples]; layout.trials];
        let margin = 0.5 * layout.time_s;
        for burst in &findings.bursts {
            for (k, w) in layout.weights[burst.trial].iter_mut().enumerate() {
                let t = k as f64 / layout.rate_hz;
                let outside = (burst.from_s - t).max(t - burst.to_s).max(0.0);
                *w = if outside >= margin { 1.0 } else { 0.5 - 0.5 * (std::f64::consts::PI * outside / margin).cos() };
            }
        }
    }
    if !findings.tones.is_empty() || !findings.bursts.is_empty() {
        subject.restart()?;
    }
    Ok(findings)
}

fn stand(subject: &Subject) -> Result<Stand, DiagnoseError> {
    subject.stand(&[], &subject.start, 3).ok_or(DiagnoseError::BaselineFailed)
}
