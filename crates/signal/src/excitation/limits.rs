//! What an excitation asks of the robot, and of the person: peak, slew, band, motion to be expected.

use super::ExcitationError;
use crate::periodic::amplitudes;
use crate::spread::rms;
use crate::transform::{forward_transform, inverse_transform, signal_by, spectrum_by};
use ndarray::Array2;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Size of one signal, in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignalSize {
    /// Root mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub peak: f64,
    /// Largest change from sample to sample, per second.
    pub slew_per_s: f64,
}

impl SignalSize {
    /// Measures a signal.
    ///
    /// ```
    /// let size = ndof_signal::SignalSize::of(&[0.0, 1.0, -1.0, 0.0], 100.0);
    /// assert_eq!((size.peak, size.slew_per_s), (1.0, 200.0));
    /// ```
    pub fn of(signal: &[f64], sample_rate_hz: f64) -> Self {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |m: f64, v| m.max(v.abs()));
        SignalSize {
            rms: rms(signal),
            peak: largest(&mut signal.iter().copied()),
            slew_per_s: largest(&mut signal.windows(2).map(|pair| pair[1] - pair[0])) * sample_rate_hz,
        }
    }
}

/// What a signal may ask of the robot; infinite where there is no limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Largest magnitude, in the unit of the signal.
    pub peak: f64,
    /// Largest change per second.
    pub slew_per_s: f64,
}

impl Limits {
    /// The factor, at most 1, by which `signal` must be scaled to keep the limits.
    ///
    /// ```
    /// use ndof_signal::Limits;
    /// let robot = Limits { peak: 45.0, slew_per_s: f64::INFINITY };
    /// assert_eq!(robot.scale(&[10.0, -90.0], 500.0), 0.5);
    /// assert_eq!(robot.scale(&[10.0, -9.0], 500.0), 1.0);
    /// ```
    pub fn scale(&self, signal: &[f64], sample_rate_hz: f64) -> f64 {
        let size = SignalSize::of(signal, sample_rate_hz);
        let share = |limit: f64, found: f64| if found > limit { limit / found } else { 1.0 };
        share(self.peak, size.peak).min(share(self.slew_per_s, size.slew_per_s))
    }
}

/// The share of a signal's power (its mean left out) within `band_hz`.
///
/// ```
/// let tone: Vec<f64> = (0..1000).map(|k| (std::f64::consts::TAU * 0.05 * k as f64).sin()).collect();
/// assert!(ndof_signal::power_share(&tone, 100.0, (4.0, 6.0)) > 1.0 - 1e-12);
/// ```
pub fn power_share(signal: &[f64], sample_rate_hz: f64, band_hz: (f64, f64)) -> f64 {
    let n = signal.len();
    if n < 2 {
        return 0.0;
    }
    let lines = amplitudes(&forward_transform(n), signal);
    let (mut within, mut total) = (0.0, 0.0);
    for (k, line) in lines.iter().enumerate().skip(1) {
        let power = line.norm_sqr() * if 2 * k == n { 2.0 } else { 1.0 };
        total += power;
        if (band_hz.0..=band_hz.1).contains(&(k as f64 * sample_rate_hz / n as f64)) {
            within += power;
        }
    }
    if total > 0.0 { within / total } else { 0.0 }
}

/// Signals through a linear response, Y(f) = G(f) U(f), in the Fourier domain of the record lengthened by
/// `padding_s` of silence, which receives what rings on; without padding the record is taken as periodic.
///
/// `response` gives G at a frequency in Hz, as outputs × inputs; where an entry is not finite (a free mass at 0 Hz)
/// it counts as 0.
///
/// # Errors
/// [`ExcitationError`] if the signals differ in length or the response in shape.
///
/// ```
/// use ndarray::array;
/// use ndof_signal::apply_response;
/// let twice = apply_response(&[vec![1.0, 2.0, 3.0]], 10.0, 0.0, |_| array![[2.0.into()]])?;
/// assert!((twice[0][2] - 6.0).abs() < 1e-12);
/// # Ok::<(), ndof_signal::ExcitationError>(())
/// ```
pub fn apply_response(
    signals: &[Vec<f64>],
    sample_rate_hz: f64,
    padding_s: f64,
    response: impl Fn(f64) -> Array2<Complex64>,
) -> Result<Vec<Vec<f64>>, ExcitationError> {
    let len = signals.first().map_or(0, Vec::len);
    if let Some((axis, signal)) = signals.iter().enumerate().find(|(_, s)| s.len() != len) {
        return Err(ExcitationError::Length { axis, expected: len, found: signal.len() });
    }
    if len == 0 {
        return Ok(signals.to_vec());
    }
    let padded = len + (padding_s.max(0.0) * sample_rate_hz).ceil() as usize;
    let (forward, inverse) = (forward_transform(padded), inverse_transform(padded));
    let inputs: Vec<Vec<Complex64>> = signals
        .iter()
        .map(|signal| {
            let mut lengthened = signal.clone();
            lengthened.resize(padded, 0.0);
            spectrum_by(forward.as_ref(), &mut lengthened)
        })
        .collect();
    let mut outputs: Vec<Vec<Complex64>> = Vec::new();
    for f in 0..padded / 2 + 1 {
        let g = response(f as f64 * sample_rate_hz / padded as f64);
        if outputs.is_empty() {
            outputs = vec![vec![Complex64::default(); padded / 2 + 1]; g.nrows()];
        }
        if g.dim() != (outputs.len(), inputs.len()) {
            return Err(ExcitationError::Shape { expected: (outputs.len(), inputs.len()), found: g.dim() });
        }
        for ((i, j), gain) in g.indexed_iter().filter(|(_, gain)| gain.is_finite()) {
            outputs[i][f] += gain * inputs[j][f];
        }
    }
    Ok(outputs
        .into_iter()
        .map(|mut spectrum| {
            let mut signal = signal_by(inverse.as_ref(), &mut spectrum);
            signal.truncate(len);
            signal.iter_mut().for_each(|s| *s /= padded as f64);
            signal
        })
        .collect())
}

/// Motion to be expected of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExpectedMotion {
    /// Root mean square of the displacement.
    pub displacement_rms: f64,
    /// Its largest magnitude.
    pub displacement_peak: f64,
    /// The largest magnitude of the velocity, per second.
    pub velocity_peak: f64,
}

/// The motion that `forces` would cause through a compliance (displacement per force), before anyone is shaken.
///
/// # Errors
/// As [`apply_response`].
///
/// ```
/// use ndarray::array;
/// use ndof_signal::{FilteredNoise, expected_motion};
/// let force = FilteredNoise { rms: 4.0, samples: 5000, ..FilteredNoise::default() }.generate(1)?;
/// let soft = expected_motion(&force, 500.0, |_| array![[(1.0 / 300.0).into()]])?;
/// assert!((soft[0].displacement_rms - 4.0 / 300.0).abs() < 1e-9);
/// # Ok::<(), ndof_signal::ExcitationError>(())
/// ```
pub fn expected_motion(
    forces: &[Vec<f64>],
    sample_rate_hz: f64,
    compliance: impl Fn(f64) -> Array2<Complex64>,
) -> Result<Vec<ExpectedMotion>, ExcitationError> {
    let padding_s = forces.first().map_or(0.0, |f| f.len() as f64 / sample_rate_hz);
    let displacement = apply_response(forces, sample_rate_hz, padding_s, &compliance)?;
    let velocity = apply_response(forces, sample_rate_hz, padding_s, |f| compliance(f).mapv(|c| c * Complex64::new(0.0, TAU * f)))?;
    let of = |(d, v): (&Vec<f64>, &Vec<f64>)| {
        let size = SignalSize::of(d, sample_rate_hz);
        ExpectedMotion { displacement_rms: size.rms, displacement_peak: size.peak, velocity_peak: SignalSize::of(v, sample_rate_hz).peak }
    };
    Ok(displacement.iter().zip(&velocity).map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn the_share_of_power_is_that_of_the_lines_in_the_band() {
        // Lines 5, 20 and, alternating, Nyquist's: powers 2²/2, 1/2 and 1.
        let wave = |k: f64| 3.0 + 2.0 * (TAU * 0.05 * k).sin() + (TAU * 0.2 * k).cos() + (std::f64::consts::PI * k).cos();
        let signal: Vec<f64> = (0..100).map(|k| wave(f64::from(k))).collect();
        for (band_hz, share) in [((4.0, 6.0), 2.0 / 3.5), ((15.0, 50.0), 1.5 / 3.5), ((5.0, 20.0), 2.5 / 3.5), ((0.0, 50.0), 1.0), ((21.0, 49.0), 0.0)] {
            assert!((power_share(&signal, 100.0, band_hz) - share).abs() < 1e-12, "{band_hz:?}");
        }
        assert_eq!([&[][..], &[1.0], &[1.0, -1.0]].map(|few| power_share(few, 100.0, (0.0, 50.0))), [0.0, 0.0, 1.0]);
        assert!(power_share(&[1.0; 8], 100.0, (0.0, 50.0)) == 0.0);
    }

    #[test]
    fn silence_after_the_record_receives_what_rings_on() {
        // Two samples late, of 4 at 2 Hz: as a period the last two come first, with 1 s of silence they are gone.
        let late = |f: f64| array![[Complex64::cis(-TAU * f)]];
        let through = |padding_s: f64| apply_response(&[vec![1.0, 2.0, 3.0, 4.0]], 2.0, padding_s, late).expect("one length");
        let near = |found: &[f64], expected: [f64; 4]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(&through(0.0)[0], [3.0, 4.0, 1.0, 2.0]) && near(&through(1.0)[0], [0.0, 0.0, 1.0, 2.0]), "{:?}", through(1.0));
    }

    #[test]
    fn a_resonance_moves_as_the_steady_state_says() {
        // 2 kg, 10 N s/m, 300 N/m; 3 N at 1.5 Hz for 40 s: the transient decays with exp(−2.5 t) and adds to the first
        // swings, so the rms is compared within the 0.4 s/40 s that it takes.
        let compliance = |f: f64| {
            let s = Complex64::new(0.0, TAU * f);
            array![[(2.0 * s * s + 10.0 * s + 300.0).inv()]]
        };
        let force: Vec<f64> = (0..20_000).map(|k| 3.0 * (TAU * 1.5 * f64::from(k) / 500.0).sin()).collect();
        let motion = expected_motion(&[force], 500.0, compliance).expect("shapes fit")[0];
        let expected = 3.0 * compliance(1.5)[(0, 0)].norm();
        assert!((motion.displacement_rms * 2.0_f64.sqrt() / expected - 1.0).abs() < 0.01, "{motion:?}");
        assert!(motion.displacement_peak >= 0.999 * expected && motion.velocity_peak >= 0.999 * expected * TAU * 1.5);
    }

    #[test]
    fn shapes_are_checked() {
        let wide = |_: f64| Array2::zeros((1, 2));
        assert!(matches!(apply_response(&[vec![0.0; 4]], 1.0, 0.0, wide), Err(ExcitationError::Shape { .. })));
        assert!(matches!(apply_response(&[vec![0.0; 4], vec![0.0; 3]], 1.0, 0.0, wide), Err(ExcitationError::Length { .. })));
    }

    #[test]
    fn a_free_mass_may_be_pushed() {
        let mass = |f: f64| array![[Complex64::from(-1.0 / (TAU * f).powi(2))]];
        let motion = expected_motion(&[vec![1.0, -1.0, 1.0, -1.0]], 10.0, mass).expect("fits");
        assert!(motion[0].displacement_peak.is_finite() && motion[0].displacement_peak > 0.0);
    }

    #[test]
    fn a_signal_is_scaled_to_the_limit_that_it_exceeds_most() {
        let signal = [10.0, 40.0, -20.0];
        let size = SignalSize::of(&signal, 100.0);
        assert_eq!((size.rms, size.peak, size.slew_per_s), (700.0_f64.sqrt(), 40.0, 6000.0));
        let none = f64::INFINITY;
        let limits = [(20.0, none), (none, 1500.0), (20.0, 1500.0), (10.0, 3000.0), (40.0, 6000.0), (none, none)];
        assert_eq!(limits.map(|(peak, slew_per_s)| Limits { peak, slew_per_s }.scale(&signal, 100.0)), [0.5, 0.25, 0.25, 0.25, 1.0, 1.0]);
    }

    #[test]
    fn the_motion_of_a_spring_is_that_of_its_force() {
        // exp(−t²/2σ²) has the steepest slope e^(−½)/σ, and its square the integral σ √π.
        let (fs, sigma_s) = (500.0, 0.1);
        let force: Vec<f64> = (0..1000).map(|k| (-((f64::from(k) / fs - 1.0) / sigma_s).powi(2) / 2.0).exp()).collect();
        let motion = expected_motion(&[force], fs, |_| array![[Complex64::from(1.0 / 300.0)]]).expect("fits")[0];
        let rms = (sigma_s * std::f64::consts::PI.sqrt() / 2.0).sqrt();
        assert!((300.0 * motion.displacement_rms - rms).abs() < 1e-9 && (300.0 * motion.displacement_peak - 1.0).abs() < 1e-9, "{motion:?}");
        assert!((300.0 * motion.velocity_peak - (-0.5_f64).exp() / sigma_s).abs() < 1e-9, "{motion:?}");
    }

    #[test]
    fn what_comes_after_the_record_does_not_come_before_it() {
        // Half a second late, of one second.
        let motion = expected_motion(&[vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 2.0, 1.0]], 10.0, |f| array![[Complex64::cis(-TAU * f * 0.5)]]);
        assert!(motion.expect("fits")[0].displacement_peak < 1e-12);
    }

    #[test]
    fn a_delay_by_half_a_sample_passes_what_nyquists_line_can_be() {
        // x cos(πn) delayed by half a sample is x cos(π(n − ½)) = 0.
        let out = apply_response(&[vec![1.0, -1.0, 1.0, -1.0]], 2.0, 0.0, |f| array![[Complex64::cis(-TAU * f * 0.25)]]).expect("fits");
        assert!(out[0].iter().all(|x| x.abs() < 1e-12), "{out:?}");
    }
}
