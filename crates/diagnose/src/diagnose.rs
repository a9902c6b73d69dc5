//! The diagnosis from recordings to verdict.

use crate::answer::{Answer, Models};
use crate::asked::{Asked, Searched};
use crate::baseline::Baseline;
use crate::detectors;
use crate::judge::Court;
use crate::options::Options;
use crate::pictures::Pictures;
use crate::result::Diagnosis;
use crate::samples::{Meaning, Samples};

use crate::split::divide;
use crate::unseen::Unseen;
use crate::{DiagnoseError, generic};
use ndof_signal::Recording;
use ndof_sysid::Ports;

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
    let frozen = detectors::frozen(&estimation);
    let mut linear = options.linear.clone().filter(|_| baseline.is_none());
    if let Some(fit) = &linear {
        [&mut estimation, &mut held].into_iter().for_each(|part| part.hold(fit.hold.unwrap_or_default(), fit.ticks.as_ref(), &meaning));
    }
    progress("preparing");
    let asked = Asked { meaning: &meaning, samples: &samples, options, baseline };
    let Searched { subject, mut findings, found, turned } = asked.searched(&mut estimation, linear.as_ref(), progress)?;
    if turned {
        held.turn(meaning.reference_is_effort);
        linear = linear.map(|fit| -fit);
    }
    (findings.clipped, findings.frozen) = (clipped, frozen);
    let still = !meaning.motion_imposed && linear.take_if(|fit| !fit.moves()).is_some();
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
        held: &held,
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
