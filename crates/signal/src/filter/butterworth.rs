//! Butterworth design: analogue prototype, band transformation with prewarped corners, bilinear transform, pairing.

use super::{FilterError, Section, SosFilter};
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_2, PI};

/// What a filter lets through; corners are the −3 dB points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Passband {
    /// All below the corner, in Hz.
    Low(f64),
    /// All above the corner, in Hz.
    High(f64),
    /// All between two corners, in Hz; the filter has twice the order.
    Band(f64, f64),
}

impl SosFilter {
    /// Butterworth filter by the bilinear transform with prewarped corners:
    ///
    /// |H(f)|² = 1 / (1 + (tan(πf/fs) / tan(πf_c/fs))^{2·order}) for a low-pass.
    ///
    /// Equal to `scipy.signal.butter(order, corner, btype, fs=sample_rate_hz, output="sos")`, sections in the same
    /// order: the poles nearest to the unit circle come last, the whole gain stands in the first section.
    ///
    /// # Errors
    /// [`FilterError`] for order 0, or a corner that does not lie between 0 and Nyquist.
    pub fn butterworth(order: usize, passband: Passband, sample_rate_hz: f64) -> Result<Self, FilterError> {
        if order == 0 {
            return Err(FilterError::Order);
        }
        let warp = |corner_hz: f64| {
            if corner_hz > 0.0 && corner_hz < sample_rate_hz / 2.0 && sample_rate_hz.is_finite() {
                Ok((PI * corner_hz / sample_rate_hz).tan())
            } else {
                Err(FilterError::Corner { corner_hz, sample_rate_hz })
            }
        };
        let prototype: Vec<Complex64> = (0..order).map(|m| Complex64::cis(FRAC_PI_2 * (1.0 + (2 * m + 1) as f64 / order as f64))).map(on_axis).collect();
        // Frequencies are in units in which the bilinear transform is z = (1 + s) / (1 − s).
        let (poles, zeros_at_rest, gain) = match passband {
            Passband::Low(corner_hz) => {
                let corner = warp(corner_hz)?;
                (prototype.iter().map(|p| p * corner).collect::<Vec<_>>(), 0, corner.powi(order as i32))
            }
            Passband::High(corner_hz) => {
                let corner = warp(corner_hz)?;
                (prototype.iter().map(|p| on_axis(corner / p)).collect(), order, 1.0)
            }
            Passband::Band(low_hz, high_hz) => {
                let (low, high) = (warp(low_hz)?, warp(high_hz)?);
                if low >= high {
                    return Err(FilterError::EmptyBand { low_hz, high_hz });
                }
                let width = high - low;
                let split = |sign: f64| {
                    prototype.iter().map(move |p| {
                        let half = p * (width / 2.0);
                        half + (half * half - low * high).sqrt() * sign
                    })
                };
                (split(1.0).chain(split(-1.0)).collect(), order, width.powi(order as i32))
            }
        };
        let one = Complex64::new(1.0, 0.0);
        let gain = gain / poles.iter().map(|p| one - p).product::<Complex64>().re;
        let zeros = (0..poles.len()).map(|i| if i < zeros_at_rest { 1.0 } else { -1.0 }).collect();
        Ok(SosFilter { sections: pair(poles.iter().map(|p| (one + p) / (one - p)).collect(), zeros, gain) })
    }
}

/// Takes the round-off off the imaginary part of a pole that is real.
fn on_axis(p: Complex64) -> Complex64 {
    if p.im.abs() < 1e-12 * p.norm() { Complex64::new(p.re, 0.0) } else { p }
}

/// Sections from poles and (real) zeros: the pole nearest to the unit circle takes its partner and the two nearest
/// zeros, and so on; an odd order is filled up with a pole and a zero at 0, which makes a first-order section.
fn pair(mut poles: Vec<Complex64>, mut zeros: Vec<f64>, gain: f64) -> Vec<Section> {
    if !poles.len().is_multiple_of(2) {
        poles.push(Complex64::default());
        zeros.push(0.0);
    }
    let mut left: Vec<Complex64> = poles.into_iter().filter(|p| p.im >= 0.0).collect();
    let mut sections = Vec::new();
    while let Some(first) = take_least(&mut left, |p| (1.0 - p.norm()).abs()) {
        let second = if first.im == 0.0 {
            take_least(&mut left, |p| if p.im == 0.0 { (1.0 - p.norm()).abs() } else { f64::INFINITY }).unwrap_or_default()
        } else {
            first.conj()
        };
        let near = |z: &f64| (first - z).norm();
        let (z1, z2) = (take_least(&mut zeros, near).unwrap_or_default(), take_least(&mut zeros, near).unwrap_or_default());
        sections.push(Section { b: [1.0, -(z1 + z2), z1 * z2], a: [-(first + second).re, (first * second).re] });
    }
    sections.reverse();
    if let Some(section) = sections.first_mut() {
        section.b.iter_mut().for_each(|b| *b *= gain);
    }
    sections
}

fn take_least<T: Copy>(items: &mut Vec<T>, key: impl Fn(&T) -> f64) -> Option<T> {
    let i = (0..items.len()).reduce(|best, i| if key(&items[i]) < key(&items[best]) { i } else { best })?;
    Some(items.remove(i))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// InMotion2's velocity filter: first order, 20 Hz at 500 Hz (coefficients published with four decimals).
    #[test]
    fn the_velocity_filter_of_the_robot() {
        let filter = SosFilter::butterworth(1, Passband::Low(20.0), 500.0).expect("valid");
        let [section] = filter.sections() else { panic!("one section") };
        assert!((section.b[0] - 0.1122).abs() < 5e-5 && (section.b[1] - section.b[0]).abs() < 1e-15, "{section:?}");
        assert!((section.a[0] + 0.7757).abs() < 5e-5 && section.a[1] == 0.0 && section.b[2] == 0.0, "{section:?}");
    }

    #[test]
    fn the_gain_is_the_formula_of_the_bilinear_butterworth() {
        let fs = 500.0;
        for order in 1..=10 {
            let low = SosFilter::butterworth(order, Passband::Low(15.0), fs).expect("valid");
            let high = SosFilter::butterworth(order, Passband::High(15.0), fs).expect("valid");
            let band = SosFilter::butterworth(order, Passband::Band(15.0, 40.0), fs).expect("valid");
            // So wide that the real pole of an odd order becomes two.
            let wide = SosFilter::butterworth(order, Passband::Band(2.0, 150.0), fs).expect("valid");
            for f in [1.0, 10.0, 15.0, 25.0, 40.0, 100.0] {
                let warp = |f: f64| (PI * f / fs).tan();
                let power = |x: f64| 1.0 / (1.0 + x.powi(2 * order as i32));
                let x = warp(f) / warp(15.0);
                let distance = |low_hz, high_hz| (warp(f).powi(2) - warp(low_hz) * warp(high_hz)) / (warp(f) * (warp(high_hz) - warp(low_hz)));
                let (near, far) = (power(distance(15.0, 40.0)), power(distance(2.0, 150.0)));
                for (filter, expected) in [(&low, power(x)), (&high, power(1.0 / x)), (&band, near), (&wide, far)] {
                    let found = filter.response(f, fs).norm_sqr();
                    assert!((found / expected - 1.0).abs() < 1e-9, "order {order} at {f} Hz: {found} against {expected}");
                }
            }
        }
    }

    #[test]
    fn impossible_corners_are_refused() {
        let design = |band| SosFilter::butterworth(4, band, 100.0).unwrap_err();
        for corner in [0.0, -1.0, 50.0, f64::NAN] {
            assert!(matches!(design(Passband::Low(corner)), FilterError::Corner { .. }));
        }
        assert!(matches!(design(Passband::Band(20.0, 10.0)), FilterError::EmptyBand { .. }));
        assert_eq!(SosFilter::butterworth(0, Passband::Low(1.0), 100.0).unwrap_err(), FilterError::Order);
    }
}
