//! A response that changes: with time, or over the cycles of a movement.

use super::instrument;
use super::measured::{in_file, labels};
use super::method::{about_welch, choose};
use super::repeat::{in_kind, reported};
use super::result as schema;
use super::settings::{Estimate, MethodName};
use crate::error::AnalysisError;
use crate::result::number;
use crate::schedule::{PHASE, Schedule};
use crate::trials::{Trial, Trials};
use ndarray::Array2;
use ndof_signal::{Channel, Recording};
use ndof_sysid::{Estimates, FrequencyResponse, LocalPolynomial, ResponseKind, SpectralMethod};
use rayon::prelude::*;

/// Windows that a course has at most.
const MOST_WINDOWS: f64 = 10_000.0;
/// Where nothing else is asked for, a window is this share of a cycle.
const OF_CYCLE: f64 = 0.25;
/// Degree of the polynomials in windows of a few dozen samples: over the seven lines that these need, what the ends leave turns by up to a quarter of a
/// turn, which cubics follow within a hundredth and parabolas within a tenth.
const CUBIC: usize = 3;

/// The course without its responses, and what each window says: its middle is since the beginning of the trials or of the cycle.
type Windows = (schema::Course, Vec<(f64, Window)>);

/// What one window says.
struct Window {
    /// Of the kind that is reported; nothing where there is none.
    response: Option<FrequencyResponse>,
    /// Multiple coherence, `[frequency][output]`.
    coherence: Array2<f64>,
    averages: f64,
}

impl Window {
    fn of(estimates: Estimates, trials: &Trials, kind: ResponseKind) -> Self {
        let coherence = estimates.derived.as_ref().map_or(&estimates.direct.coherence, |derived| &derived.coherence_iv).multiple.clone();
        let averages = estimates.effective_averages;
        Window { coherence, averages, response: reported(estimates, trials, kind) }
    }
}

/// Estimates in windows along time or along the cycle; nothing unless one of them is asked for. The inputs explain the outputs up to `explained` Hz.
pub(super) fn course(trials: &Trials, settings: &Estimate, kind: ResponseKind, explained: f64) -> Result<Option<schema::Course>, AnalysisError> {
    let (mut course, windows) = match (settings.cycles().given(), settings.sliding_s) {
        (Some(_), _) => over_cycle(trials, settings, (kind, explained))?,
        (None, Some(window_s)) => over_time(trials, settings, (kind, window_s))?,
        (None, None) if settings.sliding_step_s.is_some() => {
            return Err(AnalysisError::Schedule { what: "`sliding_step` is of `sliding` windows or of a `cycle`; give one of them too".to_owned() });
        }
        (None, None) => return Ok(None),
    };
    for (middle_s, Window { response, coherence, averages }) in windows {
        let Some(response) = response else { continue };
        let keep = settings.reported_of(&response, trials)?;
        course.time_s.push(middle_s);
        course.effective_averages.push(number(averages));
        course.multiple_coherence.push(schema::by_output(&coherence, &keep));
        let response = response.select(&keep);
        course.response.push(schema::Response::from(&response));
        course.frequency_hz = response.frequency_hz;
    }
    Ok(Some(course))
}

/// A course without responses; its estimate goes through the references, or not.
fn empty(window_s: f64, step_s: f64, method: &SpectralMethod, derived: bool) -> schema::Course {
    let estimate = if derived { "derived" } else { "direct" }.to_owned();
    schema::Course { window_s, step_s, estimate, method: method.name().to_owned(), ..schema::Course::default() }
}

/// Length and step of the windows; `whole_s` is what they slide along.
fn sizes(settings: &Estimate, window_s: f64, whole_s: f64) -> Result<f64, AnalysisError> {
    let step_s = settings.sliding_step_s.unwrap_or(window_s / 2.0);
    if !(window_s > 0.0 && step_s > 0.0 && window_s.is_finite() && step_s.is_finite()) {
        return Err(AnalysisError::Sliding { window_s, step_s });
    }
    if (whole_s - window_s) / step_s > MOST_WINDOWS {
        let what = format!("windows that slide by {step_s} s over {whole_s} s are more than {MOST_WINDOWS}; give a longer `sliding_step`");
        return Err(AnalysisError::TooLarge { what });
    }
    Ok(step_s)
}

/// Windows that slide along all trials at once, by the method that suits their length.
fn over_time(trials: &Trials, settings: &Estimate, (kind, window_s): (ResponseKind, f64)) -> Result<Windows, AnalysisError> {
    let longest_s = trials.trials.iter().map(|trial| trial.recording.duration_s()).fold(0.0, f64::max);
    if window_s > longest_s {
        return Err(AnalysisError::LongWindow { window_s, longest_s });
    }
    let step_s = sizes(settings, window_s, longest_s)?;
    let samples = (window_s * trials.sample_rate_hz()).round().max(1.0) as usize;
    let cut = |trial: &Trial| trial.slice(0..samples.min(trial.recording.len()));
    let first = Trials { trials: trials.trials.iter().map(cut).collect::<Result<_, _>>()?, ..trials.clone() };
    let (method, _) = choose(&first, settings)?;
    let found = ndof_sysid::sliding(&trials.recordings(), &trials.roles.ports, &labels(trials), (&method, settings.estimator), window_s, step_s)
        .map_err(|error| in_file(error, trials))?;
    let course = empty(window_s, step_s, &method, found.iter().all(|(_, estimates)| estimates.derived.is_some()));
    let found = found.into_iter().map(|(middle_s, estimates)| (middle_s, Window::of(estimates, trials, kind))).collect();
    Ok((course, found))
}

/// Windows about the same phase of all cycles, which are the averages there: one of each cycle, about the mean of all.
///
/// # References
/// J. B. MacNeil, R. E. Kearney & I. W. Hunter (1992), Identification of time-varying biological systems from ensemble data; R. Pintelon,
/// J. Schoukens, G. Vandersteen & K. Barbé (2010), Estimation of nonparametric noise and FRF models for multivariable systems.
fn over_cycle(trials: &Trials, settings: &Estimate, (kind, explained): (ResponseKind, f64)) -> Result<Windows, AnalysisError> {
    let refused = |what: String| AnalysisError::Schedule { what };
    let schedule = Schedule::new(trials, PHASE, settings.cycles()).map_err(refused)?;
    let cycle_s = schedule.cycle_s.unwrap_or(f64::NAN);
    let window_s = settings.sliding_s.unwrap_or(OF_CYCLE * cycle_s);
    let step_s = sizes(settings, window_s, cycle_s)?;
    let samples = (window_s * trials.sample_rate_hz()).round().max(1.0) as usize;
    if window_s > cycle_s {
        return Err(refused(format!("a window of {window_s} s is longer than a cycle of {cycle_s} s; give a shorter `sliding`")));
    }
    let count = (cycle_s / step_s).round().max(1.0) as usize;
    // Windows are so short that tapers and ends are most of them; local polynomials take the ends out, of a response that is short itself: of an
    // impedance, from motion to effort.
    let own = settings.method == MethodName::Auto && !about_welch(settings);
    let forward = if own { instrument::from_motion(trials, &schedule, (settings, explained))? } else { trials.clone() };
    let local = LocalPolynomial { order: settings.order.unwrap_or(CUBIC), half_width: settings.half_width, leave_one_out: false };
    let first = || -> Result<Trials, AnalysisError> { Ok(Trials { trials: about(trials, &schedule, 0.0, samples)?.into(), ..trials.clone() }) };
    let method = if own { SpectralMethod::LocalPolynomial(local) } else { choose(&first()?, settings)?.0 };
    let (ports, labels) = (&forward.roles.ports, labels(&forward));
    let told = own && ports.inputs != trials.roles.ports.inputs && !ports.references.is_empty();
    let one = |k: usize| {
        let place = k as f64 / count as f64;
        let windows = about(&forward, &schedule, place, samples)?;
        let recordings: Vec<&Recording> = windows.iter().map(|trial| &trial.recording).collect();
        let found = if told {
            ndof_sysid::instrumented(&recordings, ports, &labels, local).map(|direct| Window {
                response: in_kind(direct.response, &forward, kind),
                coherence: direct.coherence.multiple,
                averages: direct.effective_averages,
            })
        } else {
            ndof_sysid::estimate(&recordings, ports, &labels, &method, settings.estimator).map(|estimates| Window::of(estimates, &forward, kind))
        };
        found.map(|found| (place * cycle_s, found)).map_err(|error| in_file(error, trials))
    };
    let found: Vec<Result<_, AnalysisError>> = (0..count).into_par_iter().map(one).collect();
    let course = empty(window_s, cycle_s / count as f64, &method, ports.references.len() >= ports.inputs.len());
    Ok((schema::Course { cycle_s: Some(cycle_s), cycles: Some(schedule.count), ..course }, found.into_iter().collect::<Result<_, _>>()?))
}

/// What deviates from the mean of all windows about one phase. Of N windows these are N − 1 contrasts of Helmert, orthogonal to the mean and to each
/// other: the mean movement is gone, and spectra of the contrasts are averages of N − 1, and not of N.
fn about(trials: &Trials, schedule: &Schedule, place: f64, samples: usize) -> Result<Vec<Trial>, AnalysisError> {
    let mut contrasts = Vec::new();
    let mut sums: Vec<Vec<f64>> = Vec::new();
    for (trial, middles) in trials.trials.iter().zip(schedule.crossings(place)) {
        let Some(windows) = windows(&trial.recording, &middles, samples) else { continue };
        for window in windows {
            let n = contrasts.len() as f64 + 1.0;
            let channels = trial.recording.channels().iter();
            if sums.is_empty() {
                sums = channels.map(|channel| channel.samples[window.clone()].to_vec()).collect();
                continue;
            }
            let contrast = channels.zip(&mut sums).map(|(channel, sum)| {
                let contrast = |(sum, x): (&mut f64, &f64)| {
                    let left = (*sum - n * x) / (n * (n + 1.0)).sqrt();
                    *sum += x;
                    left
                };
                Channel { samples: sum.iter_mut().zip(&channel.samples[window.clone()]).map(contrast).collect(), ..channel.clone() }
            });
            contrasts.push(trial.with_channels(contrast.collect())?);
        }
    }
    if contrasts.is_empty() {
        return Err(AnalysisError::Schedule { what: "no two cycles have a window about the same phase; record more, or give a shorter `sliding`".to_owned() });
    }
    Ok(contrasts)
}

/// Stretches of so many samples about these samples that the recording has in full.
fn windows(recording: &Recording, middles: &[usize], samples: usize) -> Option<Vec<std::ops::Range<usize>>> {
    let start = |middle: &usize| middle.checked_sub(samples / 2).filter(|start| start + samples <= recording.len());
    let found: Vec<_> = middles.iter().filter_map(start).map(|start| start..start + samples).collect();
    (!found.is_empty()).then_some(found)
}
