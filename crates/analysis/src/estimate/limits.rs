//! How large a job may be: what would fill the memory or take for ever is refused before anything is made.

use ndof_sysid::SpectralMethod;

/// Cross-spectra that an estimate holds: frequencies times pairs of channels.
const MOST_CROSS_SPECTRA: f64 = 5e7;
/// Samples of all tapers.
const MOST_TAPERS: f64 = 6e7;

/// Whether an estimate by `method` of records of `samples` samples and so many channels is refused, and why.
pub(super) fn estimate(method: &SpectralMethod, samples: usize, channels: usize) -> Result<(), String> {
    let nfft = match method {
        SpectralMethod::Welch(welch) if welch.nperseg < 2 => {
            return Err(format!("segments of {} samples see no frequency; take more with `nperseg`", welch.nperseg));
        }
        SpectralMethod::Welch(welch) => welch.nfft.max(welch.nperseg.min(samples)),
        SpectralMethod::Multitaper(multitaper) => {
            let tapers = multitaper.tapers.map_or(2.0 * multitaper.time_bandwidth - 1.0, |tapers| tapers as f64);
            if tapers * samples as f64 > MOST_TAPERS {
                return Err(format!(
                    "{tapers:.0} tapers of {samples} samples; at most {MOST_TAPERS:.0e} samples of tapers are made: ask for fewer `tapers` or a smaller `time_bandwidth`, or take `method=welch`"
                ));
            }
            multitaper.nfft.unwrap_or(samples)
        }
        _ => samples,
    };
    let spectra = (nfft / 2 + 1) as f64 * (channels * (channels + 1) / 2) as f64;
    if spectra > MOST_CROSS_SPECTRA {
        return Err(format!(
            "a transform of {nfft} samples has {spectra:.3e} cross-spectra of {channels} channels; at most {MOST_CROSS_SPECTRA:.0e} are held: take `method=welch` with a smaller `nfft`, or fewer channels"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Multitaper, Welch};

    #[test]
    fn what_people_ask_passes_and_what_no_machine_holds_does_not() {
        let welch = |nfft| SpectralMethod::Welch(Welch { nfft, ..Welch::new(2048) });
        assert_eq!(estimate(&welch(8192), 25_000, 36), Ok(()));
        assert!(estimate(&welch(1_000_000_000), 25_000, 6).is_err());
        assert!(estimate(&SpectralMethod::Welch(Welch::new(1)), 25_000, 6).is_err_and(|why| why.contains("no frequency")));
        let tapers = |time_bandwidth| SpectralMethod::Multitaper(Multitaper { time_bandwidth, ..Multitaper::default() });
        assert_eq!(estimate(&tapers(8.0), 3_600_000, 3), Ok(()));
        assert!(estimate(&tapers(12_400.0), 25_000, 3).is_err());
    }
}
