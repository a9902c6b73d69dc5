//! The clock of a stream: set to that of the recording computer, and smoothed where it ticks regularly.

use crate::join::Times;
use crate::time::simplest;

/// Offsets that are off the line by more than this, in seconds, count less: an answer that was late on the network. It is the
/// threshold of the reference reader (pyxdf 1.17).
const LATE_S: f64 = 1e-4;

/// Steps of reweighting; each brings the line nearer by a factor.
const STEPS: usize = 200;

/// A clock that jumps by more than this was set anew.
const RESET_S: f64 = 1.0;

/// A step longer than this, and than so many samples, begins a stretch of its own.
const BREAK_S: f64 = 1.0;
const BREAK_SAMPLES: f64 = 500.0;

/// How far a stream's clock lies behind that of the recording computer, over time.
#[derive(Clone, Debug, Default)]
pub(super) struct Offsets {
    pub at_s: Vec<f64>,
    pub offset_s: Vec<f64>,
}

impl Offsets {
    /// The times on the clock of the recording computer; [`None`] if the stream's clock was set anew in between.
    pub fn apply(&self, mut stamps_s: Vec<f64>) -> Option<Vec<f64>> {
        let jumps = |values: &[f64]| values.windows(2).any(|pair| (pair[1] - pair[0]).abs() > RESET_S);
        if self.at_s.windows(2).any(|pair| pair[1] < pair[0]) || jumps(&self.offset_s) {
            return None;
        }
        if let Some((offset, slope)) = line(&self.at_s, &self.offset_s) {
            stamps_s.iter_mut().for_each(|t| *t += offset + slope * *t);
        }
        Some(stamps_s)
    }
}

/// Offset and slope of a line through points, by Huber's loss; the mean where they do not tell a slope.
fn line(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let mut weights = vec![1.0; x.len()];
    let mut found = weighted_line(x, y, &weights)?;
    for _ in 0..STEPS {
        weights.iter_mut().zip(x.iter().zip(y)).for_each(|(w, (x, y))| *w = (LATE_S / (y - found.0 - found.1 * x).abs()).min(1.0));
        let next = weighted_line(x, y, &weights)?;
        let moved = (next.0 - found.0).abs() + (next.1 - found.1).abs() * x[0].abs();
        found = next;
        if moved < 1e-12 {
            break;
        }
    }
    Some(found)
}

fn weighted_line(x: &[f64], y: &[f64], w: &[f64]) -> Option<(f64, f64)> {
    let sum: f64 = w.iter().sum();
    if sum <= 0.0 {
        return None;
    }
    let mean = |v: &[f64]| v.iter().zip(w).map(|(v, w)| v * w).sum::<f64>() / sum;
    let (mx, my) = (mean(x), mean(y));
    let (mut sxx, mut sxy) = (0.0, 0.0);
    for ((x, y), w) in x.iter().zip(y).zip(w) {
        sxx += w * (x - mx) * (x - mx);
        sxy += w * (x - mx) * (y - my);
    }
    let slope = if sxx > 0.0 { sxy / sxx } else { 0.0 };
    let line = (my - slope * mx, slope);
    (line.0.is_finite() && line.1.is_finite()).then_some(line)
}

/// The times of a stream of the nominal rate `rate_hz`: within each stretch without a break they lie on a line over the number of the
/// sample, since jitter is that of the computer and not of the device. [`None`] where they do not increase.
pub(super) fn smooth(stamps_s: &[f64], rate_hz: f64) -> Option<Times> {
    if stamps_s.iter().any(|t| !t.is_finite()) {
        return None;
    }
    let limit_s = BREAK_S.max(BREAK_SAMPLES / rate_hz);
    let breaks =
        (1..stamps_s.len()).filter(|&k| !(0.0..=limit_s).contains(&(stamps_s[k] - stamps_s[k - 1])) && (stamps_s[k] - stamps_s[k - 1]).abs() > limit_s);
    let bounds: Vec<usize> = std::iter::once(0).chain(breaks).chain([stamps_s.len()]).collect();
    let mut smoothed = Vec::with_capacity(stamps_s.len());
    for pair in bounds.windows(2) {
        let stretch = &stamps_s[pair[0]..pair[1]];
        let counts: Vec<f64> = (0..stretch.len()).map(|k| k as f64).collect();
        let first = stretch.first().copied().unwrap_or_default();
        let elapsed: Vec<f64> = stretch.iter().map(|t| t - first).collect();
        let (offset, step) = weighted_line(&counts, &elapsed, &vec![1.0; stretch.len()])?;
        if stretch.len() > 1 && step <= 0.0 {
            return None;
        }
        if bounds.len() == 2 && stretch.len() > 2 {
            return Some(Times::Regular { start_s: first + offset, rate_hz: simplest(1.0 / step, uncertainty(&elapsed, offset, step, first)) });
        }
        smoothed.extend(counts.iter().map(|k| first + offset + step * k));
    }
    smoothed.windows(2).all(|pair| pair[1] > pair[0]).then_some(Times::Stamps(smoothed))
}

/// Three standard errors of the step, relative, and the rounding of the stamps, which count from `first`.
fn uncertainty(elapsed: &[f64], offset: f64, step: f64, first: f64) -> f64 {
    let n = elapsed.len() as f64;
    let residual: f64 = elapsed.iter().enumerate().map(|(k, t)| (t - offset - step * k as f64).powi(2)).sum();
    let spread = n * (n * n - 1.0) / 12.0;
    3.0 * (residual / (n - 2.0).max(1.0) / spread).sqrt() / step + f64::EPSILON * (n.sqrt() + first.abs() / (n * step))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_answer_moves_the_line_little() {
        let at_s: Vec<f64> = (0..20).map(|k| 100.0 + 5.0 * f64::from(k)).collect();
        let mut offset_s: Vec<f64> = at_s.iter().map(|t| -40.0 + 2e-5 * t).collect();
        let exact = Offsets { at_s: at_s.clone(), offset_s: offset_s.clone() }.apply(vec![150.0]).unwrap();
        assert!((exact[0] - (150.0 - 40.0 + 3e-3)).abs() < 1e-12, "{exact:?}");
        offset_s[7] += 0.05;
        let late = Offsets { at_s, offset_s }.apply(vec![150.0]).unwrap();
        // Huber's loss lets one point of twenty pull with at most its threshold over the other nineteen.
        assert!((late[0] - exact[0]).abs() < LATE_S / 19.0 * 2.0, "{late:?}");
    }

    #[test]
    fn jitter_is_smoothed_and_breaks_are_kept() {
        let stamps: Vec<f64> = (0..1000).map(|k| 7.0 + 0.002 * f64::from(k) + 1e-4 * f64::from(k * 7919 % 13 - 6)).collect();
        let Some(Times::Regular { start_s, rate_hz }) = smooth(&stamps, 500.0) else { panic!("regular") };
        // The jitter's standard deviation of 0.4 ms over a thousand stamps leaves 1e-6 of the rate.
        assert!((rate_hz / 500.0 - 1.0).abs() < 2e-5 && (start_s - 7.0).abs() < 1e-4, "{rate_hz} {start_s}");
        let broken: Vec<f64> = (0..1000).map(|k| 0.002 * f64::from(k) + if k < 400 { 0.0 } else { 5.0 }).collect();
        let Some(Times::Stamps(times)) = smooth(&broken, 500.0) else { panic!("stamps") };
        assert!((times[399] - 0.798).abs() < 1e-9 && (times[400] - 5.8).abs() < 1e-9);
        assert_eq!(smooth(&[1.0, 0.5, 0.2], 10.0), None);
    }
}
