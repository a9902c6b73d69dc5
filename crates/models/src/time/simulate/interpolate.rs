//! Values and slopes between samples.

/// Value between two samples and slope per sample; the first or last value beyond the ends.
pub(super) fn between(samples: &[f64], when: f64) -> (f64, f64) {
    let last = samples.len() - 1;
    if when <= 0.0 {
        return (samples[0], 0.0);
    }
    let at = when as usize;
    if at >= last {
        return (samples[last], 0.0);
    }
    let slope = samples[at + 1] - samples[at];
    (samples[at] + slope * (when - at as f64), slope)
}

/// Sample before a time, and the weights of value and rate there and at the next sample, for the value and its rate (1/s).
pub(super) fn cubic(when: f64, samples: usize, step_s: f64) -> (usize, [f64; 4], [f64; 4]) {
    let sample = (when as usize).min(samples - 2);
    let u = when - sample as f64;
    let (u2, u3) = (u * u, u * u * u);
    let basis = [1.0 - 3.0 * u2 + 2.0 * u3, (u - 2.0 * u2 + u3) * step_s, 3.0 * u2 - 2.0 * u3, (u3 - u2) * step_s];
    let slopes = [6.0 * (u2 - u) / step_s, 1.0 - 4.0 * u + 3.0 * u2, 6.0 * (u - u2) / step_s, 3.0 * u2 - 2.0 * u];
    (sample, basis, slopes)
}

/// Value and rate (1/s) at a time (in samples) of a signal with known rate; constant before the beginning.
pub(super) fn hermite(at: impl Fn(usize) -> (f64, f64), samples: usize, when: f64, step_s: f64) -> (f64, f64) {
    if when <= 0.0 || samples < 2 {
        return (at(0).0, 0.0);
    }
    let (sample, basis, slopes) = cubic(when.min((samples - 1) as f64), samples, step_s);
    let ((a, da), (b, db)) = (at(sample), at(sample + 1));
    let dot = |w: [f64; 4]| w[0] * a + w[1] * da + w[2] * b + w[3] * db;
    (dot(basis), dot(slopes))
}
