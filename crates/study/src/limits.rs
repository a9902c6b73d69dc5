//! How large a job may be: what would fill the memory or take for ever is refused before anything is made.

/// Samples of all trials of one simulation or design, what is simulated before the recordings begin included.
const MOST_SAMPLES: f64 = 3e7;
/// Entries of the matrices between the axes of a design over all its samples.
const MOST_BETWEEN_AXES: f64 = 1e9;
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

#[cfg(test)]
mod tests {
    use super::*;

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
    }
}
