//! A measurement in progress: what is known so far, and whether it is enough.

use super::check::power_band_of;
use super::method::word;
use super::summed::Summed;
use super::{EstimateSettings, Estimated, FitSettings, MethodName, estimate, fit};
use crate::error::StudyError;
use crate::result::estimate::{Response, Spectrum};
use crate::result::fit::Parameter;
use crate::result::live::{LiveResult, SCHEMA};
use crate::result::{VERSION, Warning, number};
use crate::roles::{RoleNames, Roles};
use crate::trials::{Trial, Trials};
use crate::trim::Trim;
use ndof_signal::{Channel, CrossSpectra, Recording};
use ndof_sysid::{ResponseKind, StoppingRule};

/// Length of a segment where none is given: about that of the paper, 4.096 s.
const SEGMENT_S: f64 = 4.0;
/// Samples of a segment of which a line between those that the window takes from 0 Hz and half of the rate is left.
const LEAST_SEGMENT: usize = 16;
/// Effective averages beyond the inputs that a first look needs: with half overlap those of two segments more than inputs.
const LEAST_FREEDOM: f64 = 1.5;
/// Level of the intervals.
const LEVEL: f64 = 0.95;
/// Lowest frequency that is judged where no band is given, in units of one over a segment: below it the window sees 0 Hz.
const LOWEST_BINS: f64 = 2.0;

/// What is enough, and how it is estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveSettings {
    /// How to estimate; the method is Welch's.
    pub estimate: EstimateSettings,
    /// Wanted half width of the 95 % interval, as a share of the gain.
    pub half_width: f64,
    /// Share of the frequencies of each entry that must have it.
    pub share: f64,
    /// Whether the cross terms count too; those that are zero never reach a relative interval.
    pub all_entries: bool,
}

impl Default for LiveSettings {
    fn default() -> Self {
        LiveSettings { estimate: EstimateSettings::default(), half_width: 0.1, share: 0.9, all_entries: false }
    }
}

/// A measurement in progress. What came is kept as sums of spectra, so that memory does not grow with time and a look costs the same early
/// and late; of the samples themselves only the first few segments stay, for what names, units and the check of the signals need. Only
/// segments that are left out as wrecked (`robust`) are found in the whole record.
#[derive(Clone)]
pub struct Live {
    file: String,
    names: RoleNames,
    settings: LiveSettings,
    warnings: Vec<Warning>,
    /// Stretches without a gap so far.
    stretches: usize,
    /// Samples in them, and those that were left out because a channel that is used holds no number there.
    samples: usize,
    missing: usize,
    summed: Option<Summed>,
    /// What is kept of the samples: all stretches if `robust`, else the beginning of the first that is as long as a segment.
    kept: Vec<Recording>,
    /// Whether the stretch that grows is the last of them.
    keeping: bool,
}

/// Segments of the first stretch that are kept as samples.
const KEPT_SEGMENTS: usize = 8;

impl Live {
    /// Nothing measured yet; `file` names the source in errors.
    pub fn new(file: &str, names: RoleNames, settings: LiveSettings) -> Self {
        Live {
            file: file.to_owned(),
            names,
            settings,
            warnings: Vec::new(),
            stretches: 0,
            samples: 0,
            missing: 0,
            summed: None,
            kept: Vec::new(),
            keeping: false,
        }
    }

    /// Takes the next samples; `follows` says that there is no gap before them.
    ///
    /// # Errors
    /// [`StudyError`] if the roles cannot be found, or the channels are not those of before.
    pub fn push(&mut self, piece: &Recording, follows: bool, notes: impl IntoIterator<Item = Warning>) -> Result<(), StudyError> {
        for note in notes {
            if !self.warnings.contains(&note) {
                self.warnings.push(note);
            }
        }
        let ports = Roles::find(piece, &self.file, &self.names)?.ports;
        let used: Vec<usize> = ports.references.iter().chain(&ports.inputs).chain(&ports.outputs).copied().collect();
        let whole = |k: usize| used.iter().all(|&i| piece.channels()[i].samples[k].is_finite());
        let (mut at, mut joined) = (0, follows);
        while at < piece.len() {
            let end = (at..piece.len()).find(|&k| !whole(k)).unwrap_or(piece.len());
            if end > at {
                let part = piece.slice(at..end).map_err(|source| StudyError::Recording { file: self.file.clone(), source })?;
                self.add(part, &used, joined)?;
            }
            joined = end == piece.len();
            self.missing += usize::from(end < piece.len());
            at = end + 1;
        }
        Ok(())
    }

    fn add(&mut self, part: Recording, used: &[usize], follows: bool) -> Result<(), StudyError> {
        let nperseg = self.segment(part.sample_rate_hz())?;
        let summed = match &mut self.summed {
            Some(summed) => summed,
            none => none.insert(Summed::new(&self.settings.estimate, nperseg, (part.sample_rate_hz(), used.len()), &self.file)?),
        };
        let follows = follows && self.stretches > 0;
        if !follows {
            self.stretches += 1;
            // A stretch shorter than a segment says nothing; one more of those that do is added to their sum.
            if summed.end(&self.file).is_ok() {
                summed.join_ended();
            }
        }
        summed.push(&part.columns(used), &self.file)?;
        self.samples += part.len();
        self.keep(part, nperseg, follows)
    }

    fn keep(&mut self, part: Recording, nperseg: usize, follows: bool) -> Result<(), StudyError> {
        let robust = self.settings.estimate.robust;
        if !follows {
            self.kept.retain(|stretch| stretch.len() >= nperseg);
            self.keeping = robust || self.kept.is_empty();
            self.kept.extend(self.keeping.then_some(part));
            return Ok(());
        }
        let Some(kept) = self.kept.last_mut().filter(|_| self.keeping) else { return Ok(()) };
        let room = if robust { usize::MAX } else { (KEPT_SEGMENTS * nperseg).saturating_sub(kept.len()) };
        let more = part.len().min(room);
        if more > 0 {
            let join = |(a, b): (&Channel, &Channel)| Channel { samples: [&a.samples[..], &b.samples[..more]].concat(), ..a.clone() };
            let joined = Recording::new(kept.sample_rate_hz(), kept.channels().iter().zip(part.channels()).map(join).collect());
            let joined = joined.map_err(|source| StudyError::Recording { file: self.file.clone(), source })?;
            *kept = joined.starting_at(kept.start_s()).with_metadata(kept.metadata().clone());
        }
        Ok(())
    }

    fn segment(&self, rate_hz: f64) -> Result<usize, StudyError> {
        match segment(&self.settings.estimate, rate_hz) {
            nperseg if nperseg < LEAST_SEGMENT => Err(StudyError::ShortSegment { nperseg, least: LEAST_SEGMENT }),
            nperseg => Ok(nperseg),
        }
    }

    /// Seconds measured so far.
    pub fn duration_s(&self) -> f64 {
        self.kept.first().map_or(0.0, |kept| self.samples as f64 / kept.sample_rate_hz())
    }

    /// What is known so far; nothing while there are too few samples for an estimate.
    ///
    /// # Errors
    /// [`StudyError`] if the estimate does not exist, or nothing lies in the band.
    pub fn state(&self, command: &str) -> Result<Option<LiveResult>, StudyError> {
        let (Some(summed), Some(first)) = (&self.summed, self.kept.first()) else { return Ok(None) };
        let nperseg = self.segment(first.sample_rate_hz())?;
        let Some(spectra) = summed.spectra(&self.file)? else { return Ok(None) };
        let stretches = spectra.trials();
        let ports = Roles::find(first, &self.file, &self.names)?.ports;
        // With next to no averages beyond the inputs coherence is one whatever the data.
        if spectra.effective_averages() - (ports.inputs.len().max(ports.references.len()) as f64) < LEAST_FREEDOM {
            return Ok(None);
        }
        let robust = self.settings.estimate.robust;
        let long = self.kept.iter().filter(|stretch| stretch.len() >= nperseg).cloned();
        let long = long.map(|recording| Trial { file: self.file.clone(), recording, warnings: Vec::new() }).collect();
        let trials = Trials::new(long, &self.names, &Trim::default())?;
        let band_hz = self.band(&trials, &spectra, nperseg);
        let kind = self.settings.estimate.response.unwrap_or_else(|| impedance(&trials));
        let settings = EstimateSettings {
            method: MethodName::Welch,
            nperseg: Some(nperseg),
            response: Some(kind),
            band_hz: Some(band_hz),
            spectra: false,
            ..self.settings.estimate.clone()
        };
        let estimated = if robust { estimate(&trials, &settings, command)? } else { summed.estimate(spectra, &trials, &settings, command)? };
        let rule = StoppingRule {
            relative_half_width: self.settings.half_width,
            level: LEVEL,
            low_hz: band_hz.0,
            high_hz: band_hz.1,
            share: self.settings.share,
            diagonal_only: !self.settings.all_entries && estimated.best().shape().0 == estimated.best().shape().1,
        };
        let progress = rule.judge(estimated.best());
        let parameters = self.parameters(&trials, &estimated, band_hz, command);
        let duration_s = self.duration_s();
        let found = &estimated.result;
        let (name, response, partial) = match &found.derived {
            Some(derived) => ("derived", &derived.response, &derived.coherence_iv.partial),
            None => ("direct", &found.direct.response, &found.direct.coherence.partial),
        };
        Ok(Some(LiveResult {
            schema: SCHEMA.to_owned(),
            ndof_version: VERSION.to_owned(),
            command: command.to_owned(),
            warnings: self.all_warnings(&estimated),
            sample_rate_hz: trials.sample_rate_hz(),
            duration_s,
            stretches,
            enough: progress.is_some_and(|p| p.reached),
            share: progress.map_or(0.0, |p| p.share),
            needed_s: progress.and_then(|p| number(p.times_present_length * duration_s)),
            wanted_half_width: self.settings.half_width,
            band_hz: [band_hz.0, band_hz.1],
            effective_averages: found.method.effective_averages,
            estimate: name.to_owned(),
            response: word(&kind),
            inputs: found.inputs.clone(),
            outputs: found.outputs.clone(),
            frequency_hz: found.frequency_hz.clone(),
            gain: gain(response),
            gain_ci95: response.gain_ci95.clone(),
            partial_coherence: partial.clone(),
            parameters,
        }))
    }

    /// The band asked for, else the one that holds 98 % of the power of what drives.
    fn band(&self, trials: &Trials, spectra: &CrossSpectra, nperseg: usize) -> (f64, f64) {
        let rate_hz = trials.sample_rate_hz();
        let lowest_hz = LOWEST_BINS * rate_hz / nperseg as f64;
        self.settings.estimate.band_hz.unwrap_or_else(|| {
            let ports = &trials.roles.ports;
            let drivers = if ports.references.is_empty() { &ports.inputs } else { &ports.references };
            let tops = drivers.iter().filter_map(|&channel| power_band_of(spectra, channel)).map(|[_, high]| high);
            (lowest_hz, tops.fold(f64::INFINITY, f64::min).clamp(2.0 * lowest_hz, rate_hz / 2.0))
        })
    }

    /// The model's parameters; a model that cannot be fitted yet says nothing.
    fn parameters(&self, trials: &Trials, estimated: &Estimated, (low_hz, high_hz): (f64, f64), command: &str) -> Vec<Parameter> {
        let settings = FitSettings { band_hz: Some([low_hz, high_hz]), estimator: self.settings.estimate.estimator, ..FitSettings::default() };
        fit(trials, estimated, &settings, command).map(|fitted| fitted.result.parameters).unwrap_or_default()
    }

    fn all_warnings(&self, estimated: &Estimated) -> Vec<Warning> {
        let mut warnings = self.warnings.clone();
        warnings.extend(estimated.result.warnings.iter().filter(|w| !self.warnings.contains(w)).cloned());
        if self.stretches > 1 {
            let message = format!("the samples came in {} stretches with gaps between them ({} samples without a number)", self.stretches, self.missing);
            warnings.push(Warning::new("sample-timing", message, "look for lost samples; only stretches longer than a segment are used"));
        }
        warnings
    }
}

/// Samples in a segment where nobody knows yet how long the measurement will be.
pub(super) fn segment(settings: &EstimateSettings, rate_hz: f64) -> usize {
    settings.nperseg.unwrap_or_else(|| (SEGMENT_S * rate_hz).log2().round().exp2().max(8.0) as usize)
}

/// What a person wants to see: impedance, where the response has an inverse.
fn impedance(trials: &Trials) -> ResponseKind {
    let ports = &trials.roles.ports;
    match trials.roles.natural_kind() {
        ResponseKind::Transfer => ResponseKind::Transfer,
        kind if ports.inputs.len() != ports.outputs.len() => kind,
        _ => ResponseKind::Impedance,
    }
}

fn gain(response: &Response) -> Spectrum {
    let row = |re: &[Option<f64>], im: &[Option<f64>]| re.iter().zip(im).map(|(re, im)| re.zip(*im).map(|(re, im)| re.hypot(im))).collect();
    response.re.iter().zip(&response.im).map(|(re, im)| re.iter().zip(im).map(|(re, im)| row(re, im)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::Unit;

    fn recording(samples: usize) -> Recording {
        let mut state = 7_u64;
        let force: Vec<f64> = (0..samples)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
            })
            .collect();
        let motion: Vec<f64> = force.iter().enumerate().map(|(k, f)| f / 300.0 + 1e-3 * ((k * k % 101) as f64 / 101.0 - 0.5)).collect();
        let channel = |name: &str, unit: &str, samples| Channel::new(name, Unit::parse(unit).expect("a unit").0, samples);
        Recording::new(100.0, vec![channel("force_x", "N", force), channel("pos_x", "m", motion)]).expect("valid")
    }

    /// The motion's noise is 15 % of it (γ² = 0.98), so the gain's half width is 6 % after 10 s (13 averages) and 1.4 % after 200 s.
    fn live() -> Live {
        let estimate =
            EstimateSettings { nperseg: Some(128), band_hz: Some((2.0, 20.0)), response: Some(ResponseKind::DynamicStiffness), ..Default::default() };
        Live::new("live", RoleNames::default(), LiveSettings { estimate, half_width: 0.03, ..Default::default() })
    }

    #[test]
    fn more_measured_is_closer_to_enough_and_pieces_are_the_whole() {
        let all = recording(20_000);
        let state = |pieces: &[usize]| {
            let mut live = live();
            let mut at = 0;
            for (k, len) in pieces.iter().enumerate() {
                live.push(&all.slice(at..at + len).expect("there"), k > 0, []).expect("roles");
                at += len;
            }
            live.state("live").expect("an estimate")
        };
        assert_eq!(state(&[100]), None);
        let (early, late) = (state(&[1000]).expect("a state"), state(&[20_000]).expect("a state"));
        assert!(!early.enough && early.needed_s > Some(10.0), "{early:?}");
        assert!(late.enough && late.needed_s == Some(200.0) && late.share > early.share, "{late:?}");
        assert_eq!(state(&[700, 1, 299, 19_000]), Some(late));
    }

    #[test]
    fn what_is_known_is_what_the_whole_record_gives_and_few_samples_are_kept() {
        let all = recording(20_000);
        let mut live = live();
        (0..200).for_each(|k| live.push(&all.slice(100 * k..100 * (k + 1)).expect("there"), k > 0, []).expect("roles"));
        assert_eq!(live.kept.iter().map(Recording::len).collect::<Vec<_>>(), [KEPT_SEGMENTS * 128]);
        let state = live.state("live").expect("an estimate").expect("a state");
        let trial = Trial { file: "live".to_owned(), recording: all, warnings: Vec::new() };
        let trials = Trials::new(vec![trial], &RoleNames::default(), &Trim::default()).expect("roles");
        let settings = EstimateSettings { method: MethodName::Welch, ..live.settings.estimate.clone() };
        let whole = estimate(&trials, &settings, "live").expect("an estimate").result;
        assert_eq!((state.gain, state.gain_ci95), (gain(&whole.direct.response), whole.direct.response.gain_ci95));
        assert_eq!((state.frequency_hz, state.partial_coherence), (whole.frequency_hz, whole.direct.coherence.partial));
    }

    #[test]
    fn a_measurement_may_begin_at_rest() {
        // Longer than what is kept of the samples.
        let resting = KEPT_SEGMENTS * 128 + 100;
        let mut all = recording(4000);
        for name in ["force_x", "pos_x"] {
            let mut k = 0;
            all.map_channel(name, |s| {
                k += 1;
                if k <= resting { 0.0 } else { s }
            })
            .expect("there");
        }
        let mut live = live();
        (0..40).for_each(|k| live.push(&all.slice(100 * k..100 * (k + 1)).expect("there"), k > 0, []).expect("roles"));
        assert!(live.state("live").expect("an estimate").is_some());
    }

    #[test]
    fn a_gap_and_a_missing_sample_begin_a_new_stretch() {
        let all = recording(6000);
        let mut live = live();
        live.push(&all.slice(0..3000).expect("there"), false, []).expect("roles");
        let mut holey = all.slice(3010..6000).expect("there");
        let mut k = 0;
        holey
            .map_channel("pos_x", |s| {
                k += 1;
                if k == 1000 { f64::NAN } else { s }
            })
            .expect("there");
        live.push(&holey, false, []).expect("roles");
        let state = live.state("live").expect("an estimate").expect("a state");
        assert_eq!((state.stretches, state.duration_s), (3, 59.89));
        assert_eq!(state.warnings.last().map(|w| w.code.as_str()), Some("sample-timing"));
    }
}
