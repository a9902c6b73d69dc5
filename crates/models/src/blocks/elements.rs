//! The blocks.

use super::parameter::{STIFF, damping, force};
use super::{Block, BlockParameter, Vanishing};
use num_complex::Complex64;
use std::f64::consts::{SQRT_2, TAU};

/// A channel that is late: e^(−sτ).
#[derive(Clone, Copy, Debug)]
pub struct Delay;

impl Block for Delay {
    fn name(&self) -> &'static str {
        "delay"
    }
    fn parameters(&self, _rotational: bool) -> Vec<BlockParameter> {
        vec![BlockParameter::new("delay_s", "s", (-0.2, 0.2), &[0.0])]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        let h = (-s * theta[0]).exp();
        slopes[0] = -s * h;
        h
    }
    fn vanishes(&self) -> Vanishing {
        Vanishing::Inside
    }
}

/// A first-order low-pass on a channel (RC, first-order Butterworth): 1/(1 + s/ω_c).
#[derive(Clone, Copy, Debug)]
pub struct FirstOrderFilter;

impl FirstOrderFilter {
    /// What undoes it, at p = s/ω_c.
    pub(crate) fn denominator(p: Complex64) -> Complex64 {
        1.0 + p
    }
}

impl Block for FirstOrderFilter {
    fn name(&self) -> &'static str {
        "first-order-filter"
    }
    fn parameters(&self, _rotational: bool) -> Vec<BlockParameter> {
        vec![BlockParameter::new("cutoff_hz", "Hz", (0.5, 1e4), &[20.0, 60.0])]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        let p = s / (TAU * theta[0]);
        let h = Self::denominator(p).inv();
        slopes[0] = h * h * p / theta[0];
        h
    }
    fn vanishes(&self) -> Vanishing {
        Vanishing::AtBound
    }
}

/// A second-order Butterworth low-pass on a channel: ω²/(s² + √2 ω s + ω²).
#[derive(Clone, Copy, Debug)]
pub struct SecondOrderFilter;

impl SecondOrderFilter {
    /// What undoes it, at p = s/ω.
    pub(crate) fn denominator(p: Complex64) -> Complex64 {
        1.0 + SQRT_2 * p + p * p
    }
}

impl Block for SecondOrderFilter {
    fn name(&self) -> &'static str {
        "second-order-filter"
    }
    fn parameters(&self, _rotational: bool) -> Vec<BlockParameter> {
        vec![BlockParameter::new("cutoff_hz", "Hz", (0.5, 1e4), &[20.0, 60.0])]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        let p = s / (TAU * theta[0]);
        let h = Self::denominator(p).inv();
        slopes[0] = h * h * (SQRT_2 * p + 2.0 * p * p) / theta[0];
        h
    }
    fn vanishes(&self) -> Vanishing {
        Vanishing::AtBound
    }
}

/// Delayed feedback of position and velocity through critically damped muscle: (k + b s) e^(−sτ) (ω/(s + ω))².
#[derive(Clone, Copy, Debug)]
pub struct Reflex;

impl Block for Reflex {
    fn name(&self) -> &'static str {
        "reflex"
    }
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![
            force(rotational, "reflex_stiffness", 1, (0.0, STIFF), &[30.0]),
            damping(rotational, "reflex_damping", (0.0, STIFF), &[3.0]),
            BlockParameter::new("reflex_delay_s", "s", (0.005, 0.12), &[0.025, 0.05]),
            BlockParameter::new("reflex_cutoff_hz", "Hz", (0.95, 6.4), &[2.5, 4.0]),
        ]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        let w = TAU * theta[3];
        let muscle = (w / (s + w)) * (w / (s + w));
        let late = (-s * theta[2]).exp();
        let gain = theta[0] + theta[1] * s;
        let h = gain * late * muscle;
        slopes[0] = late * muscle;
        slopes[1] = s * late * muscle;
        slopes[2] = -s * h;
        slopes[3] = gain * late * 2.0 * w * s / ((s + w) * (s + w) * (s + w)) * TAU;
        h
    }
}

/// Compliance of a trough, of tissue or of a transducer in series: 1/(k + b s).
#[derive(Clone, Copy, Debug)]
pub struct SeriesCompliance;

impl Block for SeriesCompliance {
    fn name(&self) -> &'static str {
        "series-compliance"
    }
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "series_stiffness", 1, (1e-3, 1e8), &[2e4, 3e5]), damping(rotational, "series_damping", (0.0, STIFF), &[50.0])]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        let h = (theta[0] + theta[1] * s).inv();
        slopes[0] = -h * h;
        slopes[1] = -s * h * h;
        h
    }
}

/// A mass m on a spring and damper, carried by the axis: a flexible mode, m s² P/(s² + P) with P = 2 ζ ω s + ω².
#[derive(Clone, Copy, Debug)]
pub struct FlexibleMode;

impl Block for FlexibleMode {
    fn name(&self) -> &'static str {
        "flexible-mode"
    }
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        let unit = if rotational { "N m s^2/rad" } else { "N s^2/m" };
        vec![
            BlockParameter::new("carried_mass", unit, (0.0, 1e6), &[0.3]),
            BlockParameter::new("frequency_hz", "Hz", (0.05, 1e3), &[4.0, 8.0, 16.0]),
            BlockParameter::new("damping_ratio", "1", (0.0, 2.0), &[0.05]),
        ]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        let omega = TAU * theta[1];
        let spring = 2.0 * theta[2] * omega * s + omega * omega;
        let open = (s * s + spring).inv();
        slopes[0] = s * s * spring * open;
        let by_spring = theta[0] * (s * s * open) * (s * s * open);
        slopes[1] = by_spring * TAU * (2.0 * theta[2] * s + 2.0 * omega);
        slopes[2] = by_spring * 2.0 * omega * s;
        theta[0] * slopes[0]
    }
}

/// Relaxation: the Maxwell arm of a standard linear solid, k τ s/(1 + τ s), beside the baseline's spring.
#[derive(Clone, Copy, Debug)]
pub struct StandardLinearSolid;

impl Block for StandardLinearSolid {
    fn name(&self) -> &'static str {
        "standard-linear-solid"
    }
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "modulus", 1, (0.0, STIFF), &[50.0]), BlockParameter::new("time_s", "s", (1e-3, 30.0), &[0.03, 0.3])]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        let open = (1.0 + theta[1] * s).inv();
        slopes[0] = theta[1] * s * open;
        slopes[1] = theta[0] * s * open * open;
        theta[0] * theta[1] * s * open
    }
}

/// Fractional damping c s^α, between a spring (α = 0) and a damper (α = 1).
#[derive(Clone, Copy, Debug)]
pub struct Fractional;

impl Block for Fractional {
    fn name(&self) -> &'static str {
        "fractional"
    }
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        let unit = if rotational { "N m s^order/rad" } else { "N s^order/m" };
        vec![BlockParameter::new("coefficient", unit, (0.0, STIFF), &[30.0]), BlockParameter::new("order", "1", (0.02, 0.98), &[0.2, 0.5])]
    }
    fn evaluate(&self, theta: &[f64], s: Complex64, slopes: &mut [Complex64]) -> Complex64 {
        if s.norm() == 0.0 {
            slopes.fill(Complex64::default());
            return Complex64::default();
        }
        let log = s.ln();
        let power = (log * theta[1]).exp();
        slopes[0] = power;
        slopes[1] = theta[0] * power * log;
        theta[0] * power
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::difference;

    const ALL: [&dyn Block; 8] = [&Delay, &FirstOrderFilter, &SecondOrderFilter, &Reflex, &SeriesCompliance, &FlexibleMode, &StandardLinearSolid, &Fractional];

    #[test]
    fn slopes_are_differences_and_negative_frequencies_conjugates() {
        for block in ALL {
            let theta: Vec<f64> =
                block.parameters(false).iter().map(|p| p.starts[p.starts.len() - 1] + 0.01 * f64::from(u8::from(p.name == "delay_s"))).collect();
            let n = theta.len();
            for hz in [0.3, 2.0, 11.0] {
                let s = Complex64::new(0.0, TAU * hz);
                let mut slopes = vec![Complex64::default(); n];
                let h = block.evaluate(&theta, s, &mut slopes);
                assert!((block.response(&theta, -s) - h.conj()).norm() < 1e-12 * h.norm());
                for k in 0..n {
                    let difference = difference(&theta, k, 1e-5 * theta[k], |theta| vec![block.response(theta, s)]);
                    assert!((difference[0] - slopes[k]).norm() < 1e-8 * (h.norm() / theta[k] + slopes[k].norm()), "{} {k} {hz}", block.name());
                }
            }
        }
    }

    #[test]
    fn blocks_at_rest_and_at_their_corner_are_what_their_names_say() {
        let at = |block: &dyn Block, theta: &[f64], hz: f64| block.response(theta, Complex64::new(0.0, TAU * hz));
        assert!((at(&FirstOrderFilter, &[20.0], 20.0).norm() - 0.5f64.sqrt()).abs() < 1e-14);
        assert!((at(&SecondOrderFilter, &[20.0], 20.0).norm() - 0.5f64.sqrt()).abs() < 1e-14);
        assert!((at(&Delay, &[0.01], 5.0).arg() + TAU * 0.05).abs() < 1e-14);
        assert!((at(&Reflex, &[60.0, 6.0, 0.03, 3.0], 0.0) - 60.0).norm() < 1e-12);
        // Far above its rate, a standard linear solid is its modulus; far below nothing.
        assert!((at(&StandardLinearSolid, &[50.0, 1.0], 1e6) - 50.0).norm() < 1e-4 && at(&StandardLinearSolid, &[50.0, 1.0], 0.0).norm() < 1e-15);
        assert!((at(&Fractional, &[3.0, 0.25], 2.0).arg() - 0.25 * TAU / 4.0).abs() < 1e-14);
        assert!((at(&SeriesCompliance, &[2e4, 50.0], 0.0).re - 5e-5).abs() < 1e-18);
    }
}
