//! Motions of joints as finite Fourier series.

use std::f64::consts::TAU;

/// Angles (rad, m), rates and accelerations of all joints at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointMotion {
    /// q.
    pub angles: Vec<f64>,
    /// q̇.
    pub rates: Vec<f64>,
    /// q̈.
    pub accelerations: Vec<f64>,
}

/// A periodic motion of joints that begins and ends at rest:
/// q(t) = q₀ + Σₖ aₖ/(kω) sin kωt − bₖ/(kω) cos kωt for each joint, ω = 2π/T, with Σ aₖ = 0 and Σ k bₖ = 0, so that rates and accelerations
/// are zero at t = 0, T, 2T ….
///
/// J. Swevers, C. Ganseman, D. B. Tükel, J. De Schutter, H. Van Brussel, Optimal robot excitation and identification, IEEE Trans. Robot.
/// Autom. 13 (1997) 730.
#[derive(Clone, Debug, PartialEq)]
pub struct FourierMotion {
    /// T (s).
    pub period_s: f64,
    /// One a joint.
    pub joints: Vec<FourierSeries>,
}

/// The series of one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct FourierSeries {
    /// q₀ (rad, m).
    pub centre: f64,
    /// aₖ (rad/s, m/s), k = 1, 2 ….
    pub sines: Vec<f64>,
    /// bₖ (rad/s, m/s).
    pub cosines: Vec<f64>,
}

impl FourierSeries {
    /// The series about zero with the coefficients that are nearest to these and start at rest.
    pub(super) fn at_rest(sines: &[f64], cosines: &[f64]) -> Self {
        let n = sines.len() as f64;
        let mean = sines.iter().sum::<f64>() / n;
        let (moment, squares) = (1..).zip(cosines).fold((0.0, 0.0), |(m, s), (k, b)| (m + f64::from(k) * b, s + f64::from(k).powi(2)));
        FourierSeries {
            centre: 0.0,
            sines: sines.iter().map(|a| a - mean).collect(),
            cosines: (1..).zip(cosines).map(|(k, b)| b - f64::from(k) * moment / squares).collect(),
        }
    }

    /// The same motion about another centre, `factor` as large.
    pub(super) fn scaled(self, factor: f64, centre: f64) -> Self {
        let times = |list: Vec<f64>| list.into_iter().map(|v| factor * v).collect();
        FourierSeries { centre, sines: times(self.sines), cosines: times(self.cosines) }
    }

    /// Angle, rate and acceleration at share `phase` of a period of `period_s`.
    pub(super) fn at(&self, phase: f64, period_s: f64) -> [f64; 3] {
        let omega = TAU / period_s;
        let mut out = [self.centre, 0.0, 0.0];
        for (k, (a, b)) in (1..).zip(self.sines.iter().zip(&self.cosines)) {
            let (sine, cosine) = (f64::from(k) * TAU * phase).sin_cos();
            let speed = f64::from(k) * omega;
            out[0] += (a * sine - b * cosine) / speed;
            out[1] += a * cosine + b * sine;
            out[2] += speed * (b * cosine - a * sine);
        }
        out
    }

    /// Least and greatest angle, largest rate and largest acceleration of all times.
    ///
    /// Between 32 samples a cycle of its highest harmonic a trigonometric polynomial exceeds its largest sample by at most 1/cos(π/32)
    /// (H. Ehlich and K. Zeller, Math. Z. 86 (1964) 41), which is what is added here: no time passes these bounds.
    pub(super) fn reach(&self, period_s: f64) -> ([f64; 2], f64, f64) {
        const A_CYCLE: usize = 32;
        let samples = A_CYCLE * self.sines.len();
        let between = 1.0 / (std::f64::consts::PI / A_CYCLE as f64).cos();
        let ([mut low, mut high], mut rate, mut acceleration) = ([f64::INFINITY, f64::NEG_INFINITY], 0.0_f64, 0.0_f64);
        for m in 0..samples {
            let [q, v, a] = self.at(m as f64 / samples as f64, period_s);
            (low, high, rate, acceleration) = (low.min(q), high.max(q), rate.max(v.abs()), acceleration.max(a.abs()));
        }
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * between);
        ([middle - half, middle + half], rate * between, acceleration * between)
    }
}

impl FourierMotion {
    /// All joints at time `time_s`.
    pub fn at(&self, time_s: f64) -> JointMotion {
        let phase = (time_s / self.period_s).rem_euclid(1.0);
        let mut motion = JointMotion::default();
        for [q, v, a] in self.joints.iter().map(|series| series.at(phase, self.period_s)) {
            motion.angles.push(q);
            motion.rates.push(v);
            motion.accelerations.push(a);
        }
        motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series() -> FourierSeries {
        FourierSeries::at_rest(&[0.7, -0.2, 0.4, 0.1], &[0.3, 0.9, -0.5, 0.2]).scaled(1.3, 0.4)
    }

    #[test]
    fn rates_and_accelerations_are_derivatives() {
        let (motion, h) = (FourierMotion { period_s: 3.0, joints: vec![series()] }, 1e-4);
        for time in [0.0, 0.31, 1.7, 2.9] {
            let [before, here, after] = [time - h, time, time + h].map(|t| motion.at(t));
            // Central differences are off by h²/6 of the third derivative, which is below (4 ω)³ times the amplitude here.
            let slope = |f: fn(&JointMotion) -> f64| (f(&after) - f(&before)) / (2.0 * h);
            assert!((slope(|m| m.angles[0]) - here.rates[0]).abs() < 1e-5, "{time}");
            assert!((slope(|m| m.rates[0]) - here.accelerations[0]).abs() < 1e-5, "{time}");
        }
    }

    #[test]
    fn it_is_periodic_and_begins_at_rest() {
        let motion = FourierMotion { period_s: 3.0, joints: vec![series()] };
        let start = motion.at(0.0);
        assert!(start.rates[0].abs() < 1e-14 && start.accelerations[0].abs() < 1e-13, "{start:?}");
        for time in [0.0, 0.7, 2.2] {
            let (once, later) = (motion.at(time), motion.at(time + 12.0));
            assert!((once.angles[0] - later.angles[0]).abs() < 1e-13 && (once.accelerations[0] - later.accelerations[0]).abs() < 1e-12, "{time}");
        }
    }

    #[test]
    fn no_time_passes_the_reach() {
        let series = series();
        let ([low, high], rate, acceleration) = series.reach(3.0);
        let mut most: f64 = 0.0;
        for m in 0..20_000 {
            let [q, v, a] = series.at(f64::from(m) / 20_000.0, 3.0);
            assert!(low <= q && q <= high && v.abs() <= rate && a.abs() <= acceleration, "{m}");
            most = most.max(v.abs());
        }
        assert!(most > 0.99 * rate, "and it is close: {most} of {rate}");
    }
}
