//! A measurement in progress: what is known so far, and whether it is enough.

mod kept;
pub mod result;

use crate::check::power_band_of;
use crate::error::AnalysisError;
use crate::estimate::{Estimate, Estimated, MethodName, Summed, estimate, segment};
use crate::fit::{Fit, unknown_parameters};
#[cfg(feature = "clap")]
use crate::options::positive;
use crate::result::{Head, Warning, number};
use crate::trials::{RoleNames, Roles, Trial, Trials, add_each};
use kept::{Keep, Kept};
use ndof_signal::{CrossSpectra, Recording, RecordingError};
use ndof_sysid::{ResponseKind, StoppingRule};
use result::LiveResult;
use std::borrow::Cow;

/// Samples of a segment of which a line between those that the window takes from 0 Hz and half of the rate is left.
const LEAST_SEGMENT: usize = 16;
/// Effective averages beyond the inputs that a first look needs: with half overlap those of two segments more than inputs.
const LEAST_FREEDOM: f64 = 1.5;
/// Level of the intervals.
const LEVEL: f64 = 0.95;
/// Lowest frequency that is judged where no band is given, in units of one over a segment: below it the window sees 0 Hz.
const LOWEST_BINS: f64 = 2.0;

/// When enough has been measured.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct Enough {
    /// Wanted half width of the 95 % interval, as a share of the magnitude
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = positive))]
    pub within: f64,
    /// Share of the frequencies that must have it
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE", default_value_t = 0.9, value_parser = positive))]
    pub share: f64,
    /// Cross terms count too; those that are zero never reach a relative interval
    #[cfg_attr(feature = "clap", arg(long))]
    pub all_entries: bool,
}

impl Default for Enough {
    fn default() -> Self {
        Enough { within: 0.1, share: 0.9, all_entries: false }
    }
}

/// A measurement in progress. What came is kept as sums of spectra, so that memory does not grow with time and a look costs the same early
/// and late; of the samples themselves only the first few segments stay, for what names, units and the check of the signals need. Only
/// segments that are left out as wrecked (`robust`) are found in the whole record, and what only the last seconds say in these.
#[derive(Clone, Default)]
pub struct Live {
    file: String,
    names: RoleNames,
    settings: Estimate,
    enough: Enough,
    last_s: Option<f64>,
    warnings: Vec<Warning>,
    /// Stretches without a gap so far.
    stretches: usize,
    /// Samples in them, and those that were left out because a channel that is used holds no number there.
    samples: usize,
    missing: usize,
    /// Sums of all that came; of nothing where only the last seconds count.
    summed: Option<Summed>,
    kept: Kept,
}

/// Segments of the first stretch that are kept as samples.
const KEPT_SEGMENTS: usize = 8;

impl Live {
    /// Nothing measured yet; `file` names the source in errors, and the method is Welch's whatever `settings` say.
    pub fn new(file: &str, names: RoleNames, settings: Estimate, enough: Enough) -> Self {
        Live { file: file.to_owned(), names, settings, enough, ..Live::default() }
    }

    /// The same, of which only the last `last_s` seconds (or all, of `None`) count at each look: what changes slowly is followed.
    ///
    /// Memory holds the samples of these seconds, and a look transforms them anew.
    pub fn of_last(self, last_s: Option<f64>) -> Self {
        Live { last_s, ..self }
    }

    /// Takes the next samples; `follows` says that there is no gap before them.
    ///
    /// # Errors
    /// [`AnalysisError`] if the roles cannot be found, or the channels are not those of before.
    pub fn push(&mut self, piece: &Recording, follows: bool, notes: impl IntoIterator<Item = Warning>) -> Result<(), AnalysisError> {
        add_each(&mut self.warnings, notes);
        let used = Roles::find(piece, &self.file, &self.names)?.used();
        let whole = |k: usize| used.iter().all(|&i| piece.channels()[i].samples[k].is_finite());
        let (mut at, mut joined) = (0, follows);
        while at < piece.len() {
            let end = (at..piece.len()).find(|&k| !whole(k)).unwrap_or(piece.len());
            if end > at {
                let part = piece.slice(at..end).map_err(|source| self.failed(source))?;
                self.add(part, &used, joined)?;
            }
            joined = end == piece.len();
            self.missing += usize::from(end < piece.len());
            at = end + 1;
        }
        Ok(())
    }

    fn add(&mut self, part: Recording, used: &[usize], follows: bool) -> Result<(), AnalysisError> {
        let nperseg = self.segment(part.sample_rate_hz())?;
        let summed = match &mut self.summed {
            Some(summed) => summed,
            none => none.insert(Summed::new(&self.settings, nperseg, (part.sample_rate_hz(), used.len()), &self.file)?),
        };
        let follows = follows && self.stretches > 0;
        if !follows {
            self.stretches += 1;
            // A stretch shorter than a segment says nothing; one more of those that do is added to their sum.
            if summed.end(&self.file).is_ok() {
                summed.join_ended();
            }
        }
        if self.last_s.is_none() {
            summed.push(&part.columns(used), &self.file)?;
        }
        self.samples += part.len();
        let keep = match self.last_s {
            Some(last_s) => Keep::Last((last_s * part.sample_rate_hz()).round().max(1.0) as usize),
            None if self.settings.robust => Keep::All,
            None => Keep::First(KEPT_SEGMENTS * nperseg),
        };
        self.kept.push(part, follows, keep, nperseg).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: RecordingError) -> AnalysisError {
        AnalysisError::Recording { file: self.file.clone(), source }
    }

    fn segment(&self, rate_hz: f64) -> Result<usize, AnalysisError> {
        match segment(&self.settings, rate_hz) {
            nperseg if nperseg < LEAST_SEGMENT => Err(AnalysisError::ShortSegment { nperseg, least: LEAST_SEGMENT }),
            nperseg => Ok(nperseg),
        }
    }

    /// Seconds measured so far.
    pub fn duration_s(&self) -> f64 {
        self.kept.stretches.first().map_or(0.0, |kept| self.samples as f64 / kept.sample_rate_hz())
    }

    /// The sums of what counts: of everything, or of the last seconds.
    fn counted<'a>(&self, summed: &'a Summed, used: &[usize], nperseg: usize) -> Result<Cow<'a, Summed>, AnalysisError> {
        if self.last_s.is_none() {
            return Ok(Cow::Borrowed(summed));
        }
        let mut last = summed.clone();
        for stretch in self.kept.long(nperseg) {
            last.push(&stretch.columns(used), &self.file)?;
            last.end(&self.file)?;
        }
        Ok(Cow::Owned(last))
    }

    /// No look yet; or never one, where the last seconds are too few even without a gap.
    fn too_few(&self, rate_hz: f64, nperseg: usize) -> Result<Option<LiveResult>, AnalysisError> {
        match self.last_s {
            Some(last_s) if self.kept.stretches.len() == 1 && self.kept.samples() < self.samples => {
                Err(AnalysisError::ShortLast { last_s, segment_s: nperseg as f64 / rate_hz })
            }
            _ => Ok(None),
        }
    }

    /// What is known so far; nothing while there are too few samples for an estimate.
    ///
    /// # Errors
    /// [`AnalysisError`] if the estimate does not exist, nothing lies in the band, or the last seconds are too few for ever.
    pub fn state(&self) -> Result<Option<LiveResult>, AnalysisError> {
        let (Some(summed), Some(first)) = (&self.summed, self.kept.stretches.first()) else { return Ok(None) };
        let rate_hz = first.sample_rate_hz();
        let nperseg = self.segment(rate_hz)?;
        let roles = Roles::find(first, &self.file, &self.names)?;
        let summed = self.counted(summed, &roles.used(), nperseg)?;
        let Some(spectra) = summed.spectra(&self.file)? else { return self.too_few(rate_hz, nperseg) };
        let (stretches, ports) = (spectra.trials(), roles.ports);
        // With next to no averages beyond the inputs coherence is one whatever the data.
        if spectra.effective_averages() - (ports.inputs.len().max(ports.references.len()) as f64) < LEAST_FREEDOM {
            return self.too_few(rate_hz, nperseg);
        }
        let robust = self.settings.robust;
        let long = self.kept.long(nperseg).map(|recording| Trial::of(self.file.clone(), recording.clone())).collect();
        let trials = Trials::of_stream(long, &self.names)?;
        let band_hz = self.band(&trials, &spectra, nperseg);
        let kind = self.settings.response.unwrap_or_else(|| impedance(&trials));
        let settings = Estimate {
            method: MethodName::Welch,
            nperseg: Some(nperseg),
            response: Some(kind),
            band_hz: Some(band_hz),
            spectra: false,
            ..self.settings.clone()
        };
        let estimated = if robust { estimate(&trials, &settings)? } else { summed.estimate(spectra, &trials, &settings)? };
        let rule = StoppingRule {
            relative_half_width: self.enough.within,
            level: LEVEL,
            low_hz: band_hz[0],
            high_hz: band_hz[1],
            share: self.enough.share,
            diagonal_only: !self.enough.all_entries && estimated.best().shape().0 == estimated.best().shape().1,
        };
        let progress = rule.judge(estimated.best());
        // As `fit` of what counts; a model that cannot be fitted yet leaves its numbers open.
        let fit = Fit { band_hz: self.settings.band_hz, ..Fit::default() };
        let (parameters, fitted_hz) = match fit.run(&estimated) {
            Ok(fitted) => (fitted.result.parameters, Some(fitted.result.band_hz)),
            Err(_) => (unknown_parameters(&trials), None),
        };
        let duration_s = self.duration_s();
        let used_s = self.last_s.map_or(duration_s, |_| self.kept.samples() as f64 / rate_hz);
        let found = &estimated.result;
        let (name, response, partial) = match &found.derived {
            Some(derived) => ("derived", &derived.response, &derived.coherence_iv.partial),
            None => ("direct", &found.direct.response, &found.direct.coherence.partial),
        };
        Ok(Some(LiveResult {
            head: Head::new(LiveResult::SCHEMA, "live", self.all_warnings(&estimated)),
            sample_rate_hz: trials.sample_rate_hz(),
            duration_s,
            used_s,
            stretches,
            enough: progress.is_some_and(|p| p.reached),
            share: progress.map_or(0.0, |p| p.share),
            needed_s: progress.and_then(|p| number(p.times_present_length * used_s)).filter(|needed_s| self.last_s.is_none_or(|last_s| *needed_s <= last_s)),
            wanted_half_width: self.enough.within,
            band_hz,
            effective_averages: found.method.effective_averages,
            estimate: name.to_owned(),
            response: kind,
            inputs: found.inputs.clone(),
            outputs: found.outputs.clone(),
            frequency_hz: found.frequency_hz.clone(),
            gain: response.gain().into(),
            gain_ci95: response.gain_ci95.clone(),
            partial_coherence: partial.clone(),
            parameters,
            fitted_hz,
        }))
    }

    /// The band asked for, else the one that holds 98 % of the power of what drives.
    fn band(&self, trials: &Trials, spectra: &CrossSpectra, nperseg: usize) -> [f64; 2] {
        let rate_hz = trials.sample_rate_hz();
        let lowest_hz = LOWEST_BINS * rate_hz / nperseg as f64;
        self.settings.band_hz.unwrap_or_else(|| {
            let tops = trials.roles.ports.drivers().iter().filter_map(|&channel| power_band_of(spectra, channel)).map(|[_, high]| high);
            [lowest_hz, tops.fold(f64::INFINITY, f64::min).clamp(2.0 * lowest_hz, rate_hz / 2.0)]
        })
    }

    fn all_warnings(&self, estimated: &Estimated) -> Vec<Warning> {
        let mut warnings = self.warnings.clone();
        warnings.extend(estimated.result.head.warnings.iter().filter(|w| !self.warnings.contains(w)).cloned());
        if self.stretches > 1 {
            let message = format!("the samples came in {} stretches with gaps between them ({} samples without a number)", self.stretches, self.missing);
            warnings.push(Warning::new("sample-timing", message, "look for lost samples; only stretches longer than a segment are used"));
        }
        warnings
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(samples: usize) -> Recording {
        let force = crate::check::tests::uniform(samples, 7);
        let motion: Vec<f64> = force.iter().enumerate().map(|(k, f)| f / 300.0 + 1e-3 * ((k * k % 101) as f64 / 101.0 - 0.5)).collect();
        Trial::new(100.0).effort("x", force).displacement("x", motion).expect("valid").recording
    }

    /// The motion's noise is 15 % of it (γ² = 0.98), so the gain's half width is 6 % after 10 s (13 averages) and 1.4 % after 200 s.
    fn live() -> Live {
        let kind = Some(ResponseKind::DynamicStiffness);
        let settings = Estimate { nperseg: Some(128), band_hz: Some([2.0, 20.0]), response: kind, ..Estimate::default() };
        Live::new("live", RoleNames::default(), settings, Enough { within: 0.03, ..Enough::default() })
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
            live.state().expect("an estimate")
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
        assert_eq!(live.kept.stretches.iter().map(Recording::len).collect::<Vec<_>>(), [KEPT_SEGMENTS * 128]);
        let state = live.state().expect("an estimate").expect("a state");
        let settings = Estimate { method: MethodName::Welch, ..live.settings.clone() };
        let whole = settings.run([&Trial::of("live", all)]).expect("an estimate").result;
        assert_eq!((state.gain, state.gain_ci95), (whole.direct.response.gain().into(), whole.direct.response.gain_ci95));
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
        assert!(live.state().expect("an estimate").is_some());
    }

    #[test]
    fn a_fit_that_fails_leaves_its_numbers_open_and_the_look_stands() {
        let mut live = live();
        // A band with fewer lines than parameters: 0.78 Hz apart.
        live.settings.band_hz = Some([2.0, 2.5]);
        live.push(&recording(2000), false, []).expect("roles");
        let state = live.state().expect("a look").expect("a state");
        let numbers: Vec<_> = state.parameters.iter().map(|p| (p.name.as_str(), p.value, p.ci95)).collect();
        assert_eq!(numbers, [("M", None, None), ("B", None, None), ("K", None, None)]);
        assert!(state.fitted_hz.is_none() && state.gain.iter().any(|gain| gain.is_finite()));
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
        let state = live.state().expect("an estimate").expect("a state");
        assert_eq!((state.stretches, state.duration_s), (3, 59.89));
        assert_eq!(state.head.warnings.last().map(|w| w.code.as_str()), Some("sample-timing"));
    }
}
