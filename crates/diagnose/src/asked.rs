//! From samples to what a search finds: which way the effort counts, whether there is a spring, and what is looked for before.

use crate::DiagnoseError;
use crate::baseline::Baseline;
use crate::detectors::{self, Findings, TONE_REACH};
use crate::linear_fit::LinearFit;
use crate::options::Options;
use crate::samples::{Meaning, Samples};
use crate::search::{ENOUGH, Found, Stand};
use crate::state::Cause;
use crate::subject::Subject;
use ndof_models::effects::{EFFECTS, Trace};
use ndof_signal::detect_period;
use std::sync::Arc;

/// At most so many causes are named.
const MOST_CAUSES: usize = 4;

/// What is asked, of all that was recorded.
pub(crate) struct Asked<'a> {
    pub meaning: &'a Meaning,
    pub samples: &'a Samples,
    pub options: &'a Options,
    pub baseline: Option<&'a Baseline>,
}

/// What was found in the part that is fitted.
pub(crate) struct Searched {
    pub subject: Subject,
    pub findings: Findings,
    pub found: Found,
    /// Whether the effort counts the other way than it was recorded.
    pub turned: bool,
}

impl Asked<'_> {
    /// The search of a part; its effort is turned round where it counts the other way.
    pub fn searched(&self, part: &mut Samples, linear: Option<&LinearFit>, progress: &mut dyn FnMut(&str)) -> Result<Searched, DiagnoseError> {
        let found = self.found(part, linear, true, progress)?;
        if found.subject.recorded.is_none() || !found.found.chosen.is_empty() {
            return Ok(found);
        }
        // Beside a spring that a model which runs away did not ask for nothing was found.
        if found.turned {
            part.turn(self.meaning.reference_is_effort);
        }
        self.found(part, linear, false, progress)
    }

    fn found(&self, part: &mut Samples, linear: Option<&LinearFit>, spring: bool, progress: &mut dyn FnMut(&str)) -> Result<Searched, DiagnoseError> {
        let mut search = |mut subject: Subject| -> Result<Searched, DiagnoseError> {
            let findings = self.before_registry(&mut subject)?;
            let found = subject.search(MOST_CAUSES, progress).ok_or(DiagnoseError::BaselineFailed)?;
            Ok(Searched { subject, findings, found, turned: false })
        };
        // Some records count the effort the other way; with the wrong sign every bound of the registry points the wrong way.
        let subject = self.subject(part, spring)?;
        if self.baseline.is_some() || subject.polarity >= 0.0 || linear.is_some_and(|fit| !fit.reversed()) {
            return search(subject);
        }
        part.turn(self.meaning.reference_is_effort);
        let turned = Searched { turned: true, ..search(self.subject(part, spring)?)? };
        if !turned.subject.is_negative(&turned.found.chosen, &turned.found.stand) {
            return Ok(turned);
        }
        // A cause may have made the linear model's matrices negative, such as a delay of a plant with little damping: the effort counts as it was recorded, unless
        // it is likelier the other way.
        part.turn(self.meaning.reference_is_effort);
        let recorded = search(self.subject(part, spring)?)?;
        if recorded.subject.net(&recorded.found) > turned.subject.net(&turned.found) - ENOUGH {
            return Ok(recorded);
        }
        part.turn(self.meaning.reference_is_effort);
        Ok(turned)
    }

    fn subject(&self, part: &Samples, spring: bool) -> Result<Subject, DiagnoseError> {
        Subject::new(part, self.meaning, self.options, self.baseline, spring)
    }

    /// Levels, tones and bursts, in this order; tones and bursts are masked before anything else is tried.
    fn before_registry(&self, subject: &mut Subject) -> Result<Findings, DiagnoseError> {
        let Asked { samples, options, .. } = *self;
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

fn stand(subject: &Subject) -> Result<Stand, DiagnoseError> {
    subject.stand(&[], &subject.start, 3).ok_or(DiagnoseError::BaselineFailed)
}
