//! The handle: what moves with the limb but lies beyond the transducer.

use super::PrepareError;
use crate::recording::Note;
use ndof_signal::{MotionNoise, Passband, Quantity, RESOLVED, Recording, SosFilter, Unit, effort_noise};

/// Samples that the one-sided differences at the ends need.
const STENCIL: usize = 6;

/// Order of the low-pass, which acts twice: at seven tenths of its corner it takes 0.3 %.
const ORDER: usize = 8;

/// Takes the force that accelerates the handle off `effort`: F − m a, with a the second difference of `displacement`. Beside it a note up to which
/// frequency that goes, where it is not the whole band.
///
/// A transducer between robot and handle reads the force on limb *and* handle. `mass` is in kg, or in kg m² for a
/// torque and an angle. The difference is of fourth order: at 1/20 of the sample rate it lacks 10⁻⁴ of a. Noise of the position grows in it with
/// the square of the frequency: beyond where it would overtake the noise of the effort ([`MotionNoise::overtakes_hz`]) the effort would be little but
/// that noise, and agree with the motion for it. There nothing is taken off.
///
/// # Errors
/// [`PrepareError::Units`] unless force goes with position or torque with angle, [`PrepareError::TooShort`],
/// [`PrepareError::NotFinite`] for the mass, [`PrepareError::Recording`] for an unknown channel.
pub fn without_handle(recording: &Recording, effort: &str, displacement: &str, mass: f64) -> Result<(Recording, Option<Note>), PrepareError> {
    if !mass.is_finite() {
        return Err(PrepareError::NotFinite { what: "the handle's mass".to_owned(), value: mass });
    }
    let (force, motion) = (recording.channel(effort)?, recording.channel(displacement)?);
    let rotational = force.unit.is_rotational();
    if force.unit != Unit::si(Quantity::Effort, rotational) || motion.unit != Unit::si(Quantity::Displacement, rotational) {
        return Err(PrepareError::Units {
            channel: effort.to_owned(),
            found: force.unit.symbol().to_owned(),
            other: displacement.to_owned(),
            expected: motion.unit.symbol().to_owned(),
            remedy: "a force goes with a position, a torque with an angle",
        });
    }
    let rate_hz = recording.sample_rate_hz();
    let noise = MotionNoise::of(&[&motion.samples], rate_hz);
    let corner_hz = noise
        .map(|noise| noise.overtakes_hz(mass, effort_noise(&[&force.samples], rate_hz).unwrap_or(0.0), rate_hz))
        .filter(|hz| *hz < RESOLVED * rate_hz / 2.0);
    let mut acceleration = second_difference(&motion.samples, rate_hz)?;
    if let Some(filter) = corner_hz.and_then(|hz| SosFilter::butterworth(ORDER, Passband::Low(hz), rate_hz).ok()) {
        // A filter continues a signal from its last sample, noise and all: from nothing, the ends lack what lies within a period of the corner.
        let n = acceleration.len();
        [0, 1, n - 2, n - 1].into_iter().for_each(|k| acceleration[k] = 0.0);
        acceleration = filter.filter_zero_phase(&acceleration).unwrap_or(acceleration);
    }
    let mut accelerations = acceleration.iter();
    let mut clean = recording.clone();
    clean.map_channel(effort, |f| f - mass * accelerations.next().copied().unwrap_or(0.0))?;
    let note = corner_hz.map(|hz| {
        let message = format!(
            "{effort}: the force on the handle's mass is taken off up to {hz:.1} Hz, where the noise of {displacement} would overtake that of {effort}"
        );
        Note::new("handle-mass", message, "end a band below it; beyond it the handle counts as part of the limb")
    });
    Ok((clean, note))
}

/// The second derivative at each sample, of fourth order everywhere (Fornberg 1988, Generation of finite difference
/// formulas on arbitrarily spaced grids, tables 1 and 3).
fn second_difference(x: &[f64], rate_hz: f64) -> Result<Vec<f64>, PrepareError> {
    let n = x.len();
    if n < STENCIL {
        return Err(PrepareError::TooShort { len: n, needed: STENCIL });
    }
    const CENTRE: [f64; 5] = [-1.0, 16.0, -30.0, 16.0, -1.0];
    const FIRST: [f64; STENCIL] = [45.0, -154.0, 214.0, -156.0, 61.0, -10.0];
    const SECOND: [f64; STENCIL] = [10.0, -15.0, -4.0, 14.0, -6.0, 1.0];
    let scale = rate_hz * rate_hz / 12.0;
    let dot = |weights: &[f64], at: &mut dyn Iterator<Item = &f64>| scale * weights.iter().zip(at).map(|(w, x)| w * x).sum::<f64>();
    Ok((0..n)
        .map(|k| match (k, n - 1 - k) {
            (0, _) => dot(&FIRST, &mut x.iter()),
            (1, _) => dot(&SECOND, &mut x.iter()),
            (_, 0) => dot(&FIRST, &mut x.iter().rev()),
            (_, 1) => dot(&SECOND, &mut x.iter().rev()),
            _ => dot(&CENTRE, &mut x[k - 2..].iter()),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::Channel;

    /// Round-off: an epsilon × 540, the sum of the weights, × rate²/12 with a rate of 8 is 6e-13.
    const IDENTITY: f64 = 1e-12;

    #[test]
    fn the_second_difference_is_exact_for_polynomials_of_degree_five() {
        for degree in 0..=5 {
            let x: Vec<f64> = (0..9).map(|k| (k as f64 / 8.0).powi(degree)).collect();
            let d = second_difference(&x, 8.0).unwrap();
            for (k, found) in d.iter().enumerate() {
                let u = k as f64 / 8.0;
                let truth = if degree < 2 { 0.0 } else { f64::from(degree * (degree - 1)) * u.powi(degree - 2) };
                assert!((found - truth).abs() < IDENTITY, "degree {degree}, {k}: {found} {truth}");
            }
        }
    }

    #[test]
    fn a_bare_handle_feels_no_force() {
        let (rate, f, m) = (500.0, 10.0, 1.3);
        let w = std::f64::consts::TAU * f;
        let x: Vec<f64> = (0..1000).map(|k| 0.01 * (w * k as f64 / rate).sin()).collect();
        let force = x.iter().map(|x| -m * w * w * x).collect();
        let channels =
            vec![Channel::new("force_x", Unit::si(Quantity::Effort, false), force), Channel::new("pos_x", Unit::si(Quantity::Displacement, false), x)];
        let clean = without_handle(&Recording::new(rate, channels).unwrap(), "force_x", "pos_x", m).unwrap().0;
        // The leading error of the central difference is (w T)^4 / 90 of a. What leaks of a sine looks like noise; its filter is felt at the ends.
        let (peak, step) = (m * w * w * 0.01, w / rate);
        let samples = &clean.channel("force_x").unwrap().samples[200..800];
        assert!(samples.iter().all(|f| f.abs() <= 1.5 / 90.0 * peak * step.powi(4)), "{samples:?}");
    }

    /// Steps of a position of 10 µm are an acceleration of metres per second squared at 500 Hz.
    #[test]
    fn noise_of_the_position_does_not_become_the_force() {
        let (rate, m, step) = (500.0, 0.8, 1e-5);
        let wave = |k: usize| 0.01 * (0.7 * k as f64 / rate * std::f64::consts::TAU).sin() + 0.003 * (2.9 * k as f64 / rate * std::f64::consts::TAU).sin();
        let x: Vec<f64> = (0..20_000).map(|k| (wave(k) / step).round() * step).collect();
        let hiss = |k: usize| 0.02 * ((k * k % 1009) as f64 / 1009.0 - 0.5);
        let acceleration = |k: usize| rate * rate * (wave(k + 1) - 2.0 * wave(k) + wave(k.wrapping_sub(1)));
        let force = (0..x.len()).map(|k| if k == 0 { 0.0 } else { m * acceleration(k) + hiss(k) }).collect();
        let channels =
            vec![Channel::new("force_x", Unit::si(Quantity::Effort, false), force), Channel::new("pos_x", Unit::si(Quantity::Displacement, false), x)];
        let (clean, note) = without_handle(&Recording::new(rate, channels).unwrap(), "force_x", "pos_x", m).unwrap();
        let left = &clean.channel("force_x").unwrap().samples[100..19_900];
        let rms = ndof_signal::rms(left);
        let told_hz: Option<f64> = note.as_ref().and_then(|note| note.message.split(" up to ").nth(1)?.split(' ').next()?.parse().ok());
        // The transducer's own noise of 0.0058 N, and as much again at most.
        assert!(rms < 0.0058 * 2.0_f64.sqrt() * 1.1 && told_hz.is_some_and(|hz| hz > 5.8), "{rms} {note:?}");
    }

    #[test]
    fn a_force_does_not_go_with_an_angle() {
        let channels = vec![
            Channel::new("force_x", Unit::si(Quantity::Effort, false), vec![0.0; 9]),
            Channel::new("angle_x", Unit::si(Quantity::Displacement, true), vec![0.0; 9]),
        ];
        let recording = Recording::new(1.0, channels).unwrap();
        assert!(matches!(without_handle(&recording, "force_x", "angle_x", 1.0), Err(PrepareError::Units { .. })));
        assert!(without_handle(&recording, "force_x", "angle_x", f64::NAN).is_err());
    }
}
