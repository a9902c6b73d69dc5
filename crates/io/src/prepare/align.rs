//! Two recordings of one trial by two acquisition clocks, joined by a channel that both have.

use super::{PrepareError, lag};
use crate::recording::Note;
use crate::resample::Curve;
use ndof_signal::{Channel, Recording};

/// Two recordings on the clock of the first.
#[derive(Clone, Debug, PartialEq)]
pub struct Aligned {
    /// The channels of the first, then those of the second but the shared one, where both were running.
    pub recording: Recording,
    /// The second's clock when the first's shows 0, in s.
    pub offset_s: f64,
    /// By how much the second's clock runs fast, relative: 1e-6 is a ppm.
    pub drift: f64,
    /// The correlation of the shared channel after alignment.
    pub correlation: f64,
}

impl Aligned {
    /// How `second` was joined to `first` by `channel`, for whoever reads the result.
    pub fn note(&self, first: &str, second: &str, channel: &str) -> Note {
        let [offset_s, ppm, correlation] = [self.offset_s, 1e6 * self.drift, self.correlation];
        Note::new(
            "clocks-aligned",
            format!(
                "{second} joined to {first} by \"{channel}\": it began {offset_s:.6} s apart and its clock runs {ppm:.1} ppm fast; correlation {correlation:.4}"
            ),
            "choose another channel with `align_by` if that cannot be",
        )
    }
}

/// A shared channel that correlates less than this after alignment is not the same signal.
const MIN_CORRELATION: f64 = 0.8;

/// Gauss-Newton steps; from a lag that is right to a sample they converge in three or four.
const STEPS: usize = 12;

/// Joins `second` to `first`: offset and drift between their clocks follow from `shared`, the names of one signal in
/// the first and in the second (its unit and gain may differ).
///
/// The clock of the second is τ(t) = `offset_s` + (1 + `drift`) t. Both are found by least squares of
/// x(t) − g y(τ(t)) − c over the overlap, starting from the lag at which the two correlate most; the second's channels
/// are then interpolated (cubic) at τ of each sample of the first.
///
/// # Errors
/// [`PrepareError::NoOverlap`] if the signals do not match anywhere, [`PrepareError::Recording`] for an unknown channel,
/// missing samples or a name that both have.
pub fn align(first: &Recording, second: &Recording, shared: (&str, &str)) -> Result<Aligned, PrepareError> {
    first.require_finite([shared.0])?;
    second.require_finite([shared.1])?;
    let (x, y) = (&first.channel(shared.0)?.samples, &second.channel(shared.1)?.samples);
    let rate_hz = first.sample_rate_hz();
    let curve = Curve::new(second.sample_rate_hz(), y);
    // Everything below counts time from the first sample of each.
    let on_first: Vec<f64> = (0..).map(|k| k as f64 / rate_hz).take_while(|&t| t <= curve.end_s()).map(|t| curve.at(t)).collect();
    let start = lag::clock(x, &on_first).ok_or(PrepareError::NoOverlap { correlation: 0.0, needed: MIN_CORRELATION })?;
    let (mut offset_s, mut drift) = (start.offset / rate_hz, start.drift);
    for _ in 0..STEPS {
        let Some((d_offset, d_drift)) = step(x, rate_hz, &curve, offset_s, drift) else { break };
        offset_s += d_offset;
        drift += d_drift;
        if d_offset.abs() * rate_hz < 1e-9 {
            break;
        }
    }
    let tau = |k: usize| offset_s + (1.0 + drift) * k as f64 / rate_hz;
    let inside = |k: &usize| (0.0..=curve.end_s()).contains(&tau(*k));
    let from = (0..x.len()).find(inside).unwrap_or(x.len());
    let to = (from..x.len()).take_while(inside).last().map_or(from, |k| k + 1);
    let moved: Vec<f64> = (from..to).map(|k| curve.at(tau(k))).collect();
    let correlation = lag::correlation(&x[from..to], &moved);
    if correlation.is_nan() || correlation < MIN_CORRELATION {
        return Err(PrepareError::NoOverlap { correlation, needed: MIN_CORRELATION });
    }
    let common = first.slice(from..to)?;
    let mut channels = common.channels().to_vec();
    for channel in second.channels().iter().filter(|c| c.name != shared.1) {
        let curve = Curve::new(second.sample_rate_hz(), &channel.samples);
        channels.push(Channel::new(channel.name.clone(), channel.unit.clone(), (from..to).map(|k| curve.at(tau(k))).collect()));
    }
    let offset_s = offset_s + second.start_s() - (1.0 + drift) * first.start_s();
    Ok(Aligned { recording: common.with_channels(channels)?, offset_s, drift, correlation })
}

/// One Gauss-Newton step of x(t) = g y(τ) + c in offset and drift, with g and c fitted along.
fn step(x: &[f64], rate_hz: f64, y: &Curve<'_>, offset_s: f64, drift: f64) -> Option<(f64, f64)> {
    let h = 0.5 / rate_hz;
    let span_s = x.len() as f64 / rate_hz;
    // Columns: y, 1, dy/dτ, dy/dτ · t / span, and the right-hand side x.
    let mut normal = [[0.0; 5]; 4];
    for (k, &x) in x.iter().enumerate() {
        let t = k as f64 / rate_hz;
        let tau = offset_s + (1.0 + drift) * t;
        if tau < h || tau + h > y.end_s() {
            continue;
        }
        let slope = (y.at(tau + h) - y.at(tau - h)) / (2.0 * h);
        let row = [y.at(tau), 1.0, slope, slope * t / span_s, x];
        for (i, normal) in normal.iter_mut().enumerate() {
            normal.iter_mut().zip(row).for_each(|(n, r)| *n += row[i] * r);
        }
    }
    let [gain, _, by_offset, by_drift] = solve(normal)?;
    let (d_offset, d_drift) = (by_offset / gain, by_drift / gain / span_s);
    // A step of more than a few samples means that the start was not near.
    (d_offset.abs() * rate_hz < 10.0 && d_drift.abs() < lag::MAX_DRIFT).then_some((d_offset, d_drift))
}

/// Solves four linear equations by elimination with row pivots; [`None`] if they are singular.
fn solve(mut a: [[f64; 5]; 4]) -> Option<[f64; 4]> {
    for i in 0..4 {
        let pivot = (i..4).max_by(|&p, &q| a[p][i].abs().total_cmp(&a[q][i].abs()))?;
        a.swap(i, pivot);
        if a[i][i].abs() <= f64::MIN_POSITIVE {
            return None;
        }
        let upper = a[i];
        for row in &mut a[i + 1..] {
            let factor = row[i] / upper[i];
            row.iter_mut().zip(upper).for_each(|(r, u)| *r -= factor * u);
        }
    }
    let mut out = [0.0; 4];
    for i in (0..4).rev() {
        let known: f64 = (i + 1..4).map(|k| a[i][k] * out[k]).sum();
        out[i] = (a[i][4] - known) / a[i][i];
    }
    out.iter().all(|v| v.is_finite()).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Quantity, Unit};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A sum of 60 sines of random phase up to 15 Hz: known at every time.
    fn signal(seed: u64) -> impl Fn(f64) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let parts: Vec<(f64, f64)> = (0..60).map(|_| (rng.random_range(0.3..15.0), rng.random_range(0.0..std::f64::consts::TAU))).collect();
        move |t| parts.iter().map(|(f, p)| (std::f64::consts::TAU * f * t + p).sin()).sum()
    }

    type Signal = Box<dyn Fn(f64) -> f64>;

    fn recording(rate_hz: f64, n: usize, start_s: f64, channels: Vec<(&str, Signal)>) -> Recording {
        let channels = channels
            .into_iter()
            .map(|(name, f)| Channel::new(name, Unit::si(Quantity::Effort, false), (0..n).map(|k| f(start_s + k as f64 / rate_hz)).collect()))
            .collect();
        Recording::new(rate_hz, channels).unwrap().starting_at(start_s)
    }

    #[test]
    fn offset_and_drift_of_a_second_clock_at_another_rate_are_found() {
        for (offset, drift) in [(0.0, 0.0), (7.3217, 5e-5), (-4.056, -1e-4)] {
            // At time t of the first clock, the second's shows offset + (1 + drift) t.
            let back = move |tau: f64| (tau - offset) / (1.0 + drift);
            let (sync, emg) = (signal(1), signal(2));
            let (sync_2, emg_2) = (signal(1), signal(2));
            let first = recording(500.0, 20_000, 2.0, vec![("force_x", Box::new(sync))]);
            let second = recording(
                1000.0,
                35_000,
                3.5,
                vec![("sync", Box::new(move |tau| -1.0 + 0.2 * sync_2(back(tau)))), ("emg_1", Box::new(move |tau| emg_2(back(tau))))],
            );
            let aligned = align(&first, &second, ("force_x", "sync")).unwrap();
            // Interpolation of 15 Hz at 1 kHz errs by less than 1e-4 of the amplitude, which moves the clock by less than 1 µs.
            assert!((aligned.offset_s - offset).abs() < 2e-6, "{} {offset}", aligned.offset_s);
            assert!((aligned.drift - drift).abs() < 1e-7, "{} {drift}", aligned.drift);
            assert_eq!(aligned.recording.names(), ["force_x", "emg_1"]);
            let samples = &aligned.recording.channel("emg_1").unwrap().samples;
            assert!(samples.len() > 10_000);
            for (k, found) in samples.iter().enumerate() {
                let t = aligned.recording.start_s() + k as f64 / 500.0;
                // 60 sines, half a thousandth each at the most.
                assert!((found - emg(t)).abs() < 0.03, "{t}: {found} {}", emg(t));
            }
        }
    }

    #[test]
    fn signals_that_have_nothing_in_common_are_refused() {
        let first = recording(200.0, 4000, 0.0, vec![("a", Box::new(signal(3)))]);
        let second = recording(200.0, 4000, 0.0, vec![("a", Box::new(signal(4)))]);
        let error = align(&first, &second, ("a", "a")).unwrap_err();
        assert!(matches!(error, PrepareError::NoOverlap { .. }), "{error}");
        assert!(align(&first, &second, ("a", "b")).is_err());
    }
}
