//! A gentle beginning and end.

/// Fades a signal in and out linearly over `in_s` and `out_s` seconds.
///
/// Sample k stands for the interval from k/fs to (k+1)/fs, so it is scaled by the ramp's mean over that interval,
/// (k + ½) / (in_s · fs), and likewise at the end. Where the two ramps overlap both act.
///
/// ```
/// let mut signal = [1.0; 8];
/// ndof_signal::ramp(&mut signal, 1.0, 4.0, 2.0);
/// assert_eq!(signal, [0.125, 0.375, 0.625, 0.875, 1.0, 1.0, 0.75, 0.25]);
/// ```
pub fn ramp(signal: &mut [f64], sample_rate_hz: f64, in_s: f64, out_s: f64) {
    let fade = |k: usize, length_s: f64| {
        let samples = length_s * sample_rate_hz;
        if samples > 0.0 { ((k as f64 + 0.5) / samples).min(1.0) } else { 1.0 }
    };
    let last = signal.len().saturating_sub(1);
    signal.iter_mut().enumerate().for_each(|(k, s)| *s *= fade(k, in_s) * fade(last - k, out_s));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sample_is_scaled_by_the_mean_of_the_ramp_over_its_interval() {
        let mut signal = [1.0; 8];
        ramp(&mut signal, 2.0, 2.0, 1.0);
        assert_eq!(signal, [0.125, 0.375, 0.625, 0.875, 1.0, 1.0, 0.75, 0.25]);
        ramp(&mut signal, 2.0, 0.0, 0.0);
        assert_eq!(signal[0], 0.125);
        ramp(&mut [], 2.0, 1.0, 1.0);
    }
}
