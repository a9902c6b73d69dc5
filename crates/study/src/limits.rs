//! How large a job may be: what would fill the memory or take for ever is refused before anything is made.

use ndof_sysid::SpectralMethod;

/// Samples of all trials of one simulation or design, what is simulated before the recordings begin included.
const MOST_SAMPLES: f64 = 3e7;
/// Entries of the matrices between the axes of a design over all its samples.
const MOST_BETWEEN_AXES: f64 = 1e9;
/// Cross-spectra that an estimate holds: frequencies times pairs of channels.
const MOST_CROSS_SPECTRA: f64 = 5e7;
/// Samples of all tapers.
const MOST_TAPERS: f64 = 6e7;

/// Whether a simulation or a design of this size is refused, and why.
pub(crate) fn simulation(trials: usize, seconds: f64, sample_rate_hz: f64, axes: usize) -> Result<(), String> {
    let samples = seconds * sample_rate_hz * trials as f64;
    let (least, most) = (MOST_SAMPLES, MOST_BETWEEN_AXES);
    if samples.is_finite() && samples <= least && samples * (axes as f64).powi(2) <= most {
        return Ok(());
    }
    Err(format!(
        "{trials} trial(s) of {seconds} s at {sample_rate_hz} Hz on {axes} axis(es) make {samples:.3e} samples an axis; at most {least:.0e} are made at once, and {most:.0e} entries between axes: shorten the trials, make fewer, or lower the rate"
    ))
}

/// Whether an estimate by `method` of records of `samples` samples and so many channels is refused, and why.
pub(crate) fn estimate(method: &SpectralMethod, samples: usize, channels: usize) -> Result<(), String> {
    let nfft = match method {
        SpectralMethod::Welch(welch) => welch.nfft.max(welch.nperseg.min(samples)),
        SpectralMethod::Multitaper(multitaper) => {
            let tapers = multitaper.tapers.map_or(2.0 * multitaper.time_bandwidth - 1.0, |tapers| tapers as f64);
            if tapers * samples as f64 > MOST_TAPERS {
                return Err(format!(
                    "{tapers:.0} tapers of {samples} samples; at most {MOST_TAPERS:.0e} samples of tapers are made: ask for fewer --tapers or a smaller --time-bandwidth, or take --method welch"
                ));
            }
            multitaper.nfft.unwrap_or(samples)
        }
        _ => samples,
    };
    let spectra = (nfft / 2 + 1) as f64 * (channels * (channels + 1) / 2) as f64;
    if spectra > MOST_CROSS_SPECTRA {
        return Err(format!(
            "a transform of {nfft} samples has {spectra:.3e} cross-spectra of {channels} channels; at most {MOST_CROSS_SPECTRA:.0e} are held: take --method welch with a smaller --nfft, or fewer channels"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Multitaper, Welch};

    #[test]
    fn what_people_do_passes_and_what_no_machine_holds_does_not() {
        // A night of one axis, an hour of twelve, six trials of six.
        for (trials, seconds, rate, axes) in [(1, 28_800.0, 1000.0, 1), (1, 3600.0, 1000.0, 12), (6, 50.0, 500.0, 6)] {
            assert_eq!(simulation(trials, seconds, rate, axes), Ok(()));
        }
        for (trials, seconds, rate, axes) in
            [(1, 1e9, 500.0, 2), (1_000_000_000, 50.0, 500.0, 2), (1, 50.0, 1e12, 2), (6, 50.0, 500.0, 2000), (1, f64::INFINITY, 1.0, 1)]
        {
            assert!(simulation(trials, seconds, rate, axes).is_err());
        }
        let welch = |nfft| SpectralMethod::Welch(Welch { nfft, ..Welch::new(2048) });
        assert_eq!(estimate(&welch(8192), 25_000, 36), Ok(()));
        assert!(estimate(&welch(1_000_000_000), 25_000, 6).is_err());
        let tapers = |time_bandwidth| SpectralMethod::Multitaper(Multitaper { time_bandwidth, ..Multitaper::default() });
        assert_eq!(estimate(&tapers(8.0), 3_600_000, 3), Ok(()));
        assert!(estimate(&tapers(12_400.0), 25_000, 3).is_err());
    }
}
