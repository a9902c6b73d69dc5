//! An estimate of a long recording that stays in its file: its channels one after the other for what they tell, its pieces for spectra.

use super::estimated::Estimated;
use super::measured::labels;
use super::method::{about_welch, welch_of};
use super::settings::{Estimate, MethodName};
use super::{limits, repeat, rest};
use crate::check::{Alone, by_segments, quality_apart};
use crate::result::Warning;
use crate::trials::{RoleNames, Trial, Trials};
use ndof_signal::{Channel, CrossSpectra, Recording, Welch};
use ndof_sysid::{SpectralMethod, estimate_from_spectra};
use rayon::prelude::*;

/// Channels that are in memory at once.
const AT_ONCE: usize = 2;

/// A recording that is too long to be in memory; `None` is all that it says of what cannot be read.
pub trait ApartRecording: Sync {
    /// Samples of each channel.
    fn samples(&self) -> usize;

    /// The channel of this name, whole, on the clock of the recording.
    fn channel(&self, name: &str) -> Option<Recording>;

    /// The recording in order, each piece with what was done to read it.
    fn pieces(&self) -> impl Iterator<Item = Option<(Recording, Vec<Warning>)>> + Send;
}

/// The estimate of [`estimate`](super::estimate()) of one recording, called `file`, to the last bit and with the same warnings, in the memory of two channels
/// and of the spectra.
///
/// `None` where that takes the whole recording: for another method than Welch's, `robust`, sliding windows and cycles, a rest at an end that is left out, motion
/// that is read more slowly than it is written, and for every recording that is refused, so that the other way says why.
pub fn estimate_apart(file: &str, source: &impl ApartRecording, names: &RoleNames, settings: &Estimate) -> Option<Estimated> {
    let welch = settings.method == MethodName::Welch || settings.method == MethodName::Auto && about_welch(settings);
    let course = settings.sliding_s.or(settings.sliding_step_s).is_some() || settings.cycles().given().is_some();
    if !welch || settings.robust || course {
        return None;
    }
    let (recording, notes) = source.pieces().next()??;
    let first = Trial { file: file.to_owned(), recording, warnings: notes.clone() };
    let mut trials = Trials::of_piece(first, names).ok()?;
    let recording = trials.trials.first()?.recording.clone();
    let (samples, ports) = (source.samples(), &trials.roles.ports);
    let (welch, why) = welch_of(&[samples], ports, settings);
    let method = SpectralMethod::Welch(welch.clone());
    limits::estimate(&method, samples, trials.roles.used().len()).ok()?;
    // First, since the memory of channels is hardly given back.
    let [spectra, of_all] = spectra(source, &recording, &notes, [&welch, &by_segments(samples)?])?;
    let alone = alone(source, &trials, &recording)?;
    if settings.method == MethodName::Auto && rest::ends(samples, alone.iter().filter_map(|channel| channel.evenness.as_ref())) != [0, 0] {
        return None;
    }
    let told = quality_apart(&recording, &alone, &of_all, &trials.roles);
    drop(of_all);
    trials.warnings.extend(told);
    let estimates = estimate_from_spectra(spectra, &trials.roles.ports, &labels(&trials), &method, settings.estimator).ok()?;
    let mut estimated = Estimated::new(&trials, settings, estimates, why, true).ok()?;
    let result = &mut estimated.result;
    result.head.warnings.extend(repeat::warnings(result, &estimated.estimates));
    Some(estimated)
}

/// What each channel tells by itself.
fn alone(source: &impl ApartRecording, trials: &Trials, first: &Recording) -> Option<Vec<Alone>> {
    let clock = |recording: &Recording| (recording.sample_rate_hz(), recording.start_s());
    let of = |index: usize, channel: &Channel| {
        let read = source.channel(&channel.name).filter(|read| clock(read) == clock(first) && read.len() == source.samples())?;
        let own = read.into_channels().into_iter().find(|own| own.name == channel.name)?;
        Alone::usable(&Channel { unit: channel.unit.clone(), ..own }, &trials.roles, (index, first.sample_rate_hz()))
    };
    let places: Vec<(usize, &Channel)> = first.channels().iter().enumerate().collect();
    let together = |some: &[(usize, &Channel)]| some.par_iter().map(|(index, channel)| of(*index, channel)).collect::<Option<Vec<Alone>>>();
    Some(places.chunks(AT_ONCE).map(together).collect::<Option<Vec<_>>>()?.into_iter().flatten().collect())
}

/// Spectra by two settings at once, of the channels of the first piece; `notes` are those that every piece may have.
fn spectra(source: &impl ApartRecording, first: &Recording, notes: &[Warning], settings: [&Welch; 2]) -> Option<[CrossSpectra; 2]> {
    let (names, rate_hz) = (first.names(), first.sample_rate_hz());
    let [one, two] = settings.map(|welch| welch.stream(rate_hz, names.len()).ok());
    let (mut one, mut two) = (one?, two?);
    let mut pieces = source.pieces();
    let mut next = pieces.next();
    while let Some(piece) = next {
        let (piece, told) = piece?;
        if piece.sample_rate_hz() != rate_hz || told.iter().any(|note| !notes.contains(note)) {
            return None;
        }
        let columns = names.iter().map(|name| Some(piece.channel(name).ok()?.samples.as_slice())).collect::<Option<Vec<&[f64]>>>()?;
        let ((first, second), read) = rayon::join(|| rayon::join(|| one.push(&columns), || two.push(&columns)), || pieces.next());
        first.and(second).ok()?;
        next = read;
    }
    Some([one.finish().ok()?, two.finish().ok()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::Trim;
    use rand::{RngExt, SeedableRng};

    struct Kept(Recording);

    impl ApartRecording for Kept {
        fn samples(&self) -> usize {
            self.0.len()
        }

        fn channel(&self, name: &str) -> Option<Recording> {
            self.0.with_channels(vec![self.0.channel(name).ok()?.clone()]).ok()
        }

        fn pieces(&self) -> impl Iterator<Item = Option<(Recording, Vec<Warning>)>> + Send {
            (0..self.0.len()).step_by(7001).map(|from| Some((self.0.slice(from..(from + 7001).min(self.0.len())).ok()?, Vec::new())))
        }
    }

    /// Two axes: forces that `of` turns into others, sample by sample, and motions that follow them, the second with a drift.
    fn recording(of: impl Fn(usize, f64) -> f64) -> Recording {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || -> Vec<f64> { (0..40_000).map(|_| rng.sample(rand_distr::StandardNormal)).collect() };
        let forces = [(); 2].map(|()| normal().into_iter().enumerate().map(|(k, f)| of(k, f)).collect::<Vec<f64>>());
        let mut follow =
            |force: &[f64], drift: f64| force.iter().zip(normal()).enumerate().map(|(k, (f, e))| 1e-3 * (f + 0.1 * e) + drift * k as f64).collect();
        let motions: [Vec<f64>; 2] = [follow(&forces[0], 0.0), follow(&forces[1], 1e-7)];
        let [x, y] = forces;
        let trial = Trial::new(100.0).effort("x", x).effort("y", y).displacement("x", motions[0].clone());
        trial.and_then(|trial| trial.displacement("y", motions[1].clone())).expect("a trial").recording
    }

    fn welch() -> Estimate {
        Estimate { nperseg: Some(512), ..Estimate::default() }
    }

    fn apart(recording: &Recording, settings: &Estimate) -> Option<Estimated> {
        estimate_apart("trial", &Kept(recording.clone()), &RoleNames::default(), settings)
    }

    #[test]
    fn channels_one_by_one_say_what_the_whole_says() {
        let recording = recording(|_, f| f);
        let trials = Trials::new(vec![Trial::of("trial", recording.clone())], &RoleNames::default(), &Trim::default()).expect("roles");
        for settings in [welch(), Estimate { method: MethodName::Welch, ..Estimate::default() }] {
            let whole = crate::estimate::estimate(&trials, &settings).expect("an estimate").result;
            assert!(whole.head.warnings.iter().any(|warning| warning.code == "drift"), "{:?}", whole.head.warnings);
            assert_eq!(apart(&recording, &settings).expect("an estimate").result, whole);
        }
    }

    #[test]
    fn what_needs_the_whole_is_left_to_it() {
        let steady = recording(|_, f| f);
        for settings in [
            Estimate::default(),
            Estimate { robust: true, ..welch() },
            Estimate { sliding_s: Some(20.0), ..welch() },
            Estimate { cycle_s: Some(2.0), ..welch() },
            Estimate { nperseg: Some(50_000), ..welch() },
        ] {
            assert!(apart(&steady, &settings).is_none(), "{settings:?}");
        }
        // A rest at the end is left out, unless the method is given.
        let rests = recording(|k, f| if k < 30_000 { f } else { 0.01 * f });
        assert!(apart(&rests, &welch()).is_none() && apart(&rests, &Estimate { method: MethodName::Welch, ..welch() }).is_some());
        let changed = |name: &str, of: &dyn Fn(usize, &[f64]) -> f64| {
            let channels = steady.channels().iter().cloned().map(|mut channel| {
                if channel.name == name {
                    channel.samples = (0..steady.len()).map(|k| of(k, &channel.samples)).collect();
                }
                channel
            });
            steady.with_channels(channels.collect()).expect("channels alike")
        };
        for refused in [
            changed("pos_y", &|k, x| if k == 20_000 { f64::NAN } else { x[k] }),
            changed("pos_y", &|_, _| 1.0),
            // Read anew every fifth row.
            changed("pos_y", &|k, _| (k / 5 * 5) as f64 * 1e-5 + ((k / 5) as f64 * 0.05).sin()),
        ] {
            assert!(apart(&refused, &welch()).is_none());
        }
    }
}
