//! Rows that a log without times has lost: where all joints go on at once by whole samples more than their steps before and after allow.

use ndof_signal::{Channel, Recording, RecordingError, interpolated, robust_spread};
use ndof_sysid::Ports;
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, Normal};

/// Rows that are missing after a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gap {
    trial: usize,
    after: usize,
    rows: usize,
}

/// What a log has lost.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lost {
    gaps: Vec<Gap>,
    /// Whether as many steps are too short as are too long: the rows are there, and were not read at even times.
    uneven: bool,
    /// When the first is, as the log counts its time (s).
    first_s: f64,
}

/// One step of all joints.
struct Step {
    trial: usize,
    after: usize,
    /// Samples that it is longer than the longer of its neighbours, or shorter than the shorter one below nought, by least squares over all joints.
    more: f64,
    /// The same over its standard error.
    sure: f64,
    /// Of each joint whose own step is beyond its noise, how many samples longer.
    each: Vec<f64>,
    /// Rows that it holds beyond its own, by the mean of the speeds before and after; a speed that changes evenly over it makes no error.
    rows: f64,
    /// The same of each joint that tells by itself.
    rows_of_each: Vec<f64>,
}

/// Half a sample: what is nearer to a step of one row than to one of two.
const HALF: f64 = 0.5;

impl Lost {
    /// What is lost beyond chance; `chance` is how often it may be said of a log that has all its rows.
    pub fn of(trials: &[Recording], ports: &Ports, chance: f64) -> Option<Self> {
        let all = |reach| -> Vec<Step> { trials.iter().enumerate().flat_map(|(trial, log)| steps(trial, log, ports, reach)).collect() };
        let steps = all(1);
        let count = steps.len().max(1) as f64;
        let beyond = Normal::standard().inverse_cdf(1.0 - chance / count);
        let long = |beyond: f64| steps.iter().filter(move |s| s.sure > beyond && s.more >= HALF && !s.each.is_empty() && s.each.iter().all(|own| *own >= HALF));
        let clear = long(beyond).count();
        let first = long(beyond).next()?;
        let short = steps.iter().filter(|s| s.sure < -beyond && s.more <= -HALF).count() as u64;
        let even_odds = Binomial::new(0.5, clear as u64 + short).ok()?.cdf(short);
        // Where so many are lost, what is less clear by itself is likely as well: the odds of a step are those of all. Neighbours may have lost some, too, which makes them longer
        // and never shorter.
        let odds = (2.0 * (count / clear as f64).ln()).max(0.0).sqrt();
        let agreed = |s: &&Step| s.rows_of_each.iter().all(|own| (own - s.rows.round()).abs() < HALF);
        let further = all(2);
        let told = further.iter().filter(|s| s.sure > odds.min(beyond) && s.more >= HALF).filter(agreed);
        let gaps = told.map(|s| Gap { trial: s.trial, after: s.after, rows: s.rows.round() as usize }).filter(|gap| gap.rows > 0).collect();
        let log = &trials[first.trial];
        Some(Lost { gaps, uneven: short > 0 && even_odds >= chance, first_s: log.start_s() + first.after as f64 / log.sample_rate_hz() })
    }

    /// The logs with the rows in their places, each channel by the curve through the samples beside them; as they are where no row is missing.
    ///
    /// # Errors
    /// None of channels that were of one length.
    pub fn filled(&self, trials: &[Recording]) -> Result<Vec<Recording>, RecordingError> {
        let of = |(trial, log): (usize, &Recording)| {
            let own: Vec<Gap> = self.gaps.iter().filter(|gap| gap.trial == trial && !self.uneven).copied().collect();
            let channels = log.channels().iter().map(|c| Channel::new(c.name.clone(), c.unit.clone(), with_rows(&c.samples, &own))).collect();
            Ok(Recording::new(log.sample_rate_hz(), channels)?.starting_at(log.start_s()).with_metadata(log.metadata().clone()))
        };
        trials.iter().enumerate().map(of).collect()
    }

    /// In words, with what to do.
    pub fn words(&self) -> String {
        let rows: usize = self.gaps.iter().map(|gap| gap.rows).sum();
        let until = "until then no name is surer than 0.6, and nothing is written";
        let first = self.first_s;
        if self.uneven {
            return format!(
                "the angles go on by steps that are too long and too short for their speeds, the first at {first:.3} s: the rows were not read at even times. Give their times as a column (time [s]), with --resample; {until}"
            );
        }
        let taken = match rows {
            0 => "rows are missing".to_owned(),
            1 => "a row is missing and is put in by interpolation here".to_owned(),
            _ => format!("about {rows} rows are missing and are put in by interpolation here"),
        };
        format!(
            "the angles of all joints go on by more than their steps before and after allow, the first time at {first:.3} s: {taken}, and times count with them. Give the times of the rows as a column (time [s]), with --resample, or leave such places out with --exclude FROM-TO; {until}"
        )
    }
}

/// Steps of one log beside the shortest of so many before and as many after.
fn steps(trial: usize, log: &Recording, ports: &Ports, reach: usize) -> Vec<Step> {
    let angles: Vec<(&[f64], f64)> =
        ports.outputs.iter().filter_map(|c| log.channels().get(*c)).map(|c| (c.samples.as_slice(), variance(&c.samples))).collect();
    let of = |after: usize| {
        let (mut size, mut score, mut own, mut mean_size, mut mean_score) = (0.0, 0.0, Vec::new(), 0.0, 0.0);
        for (angle, variance) in &angles {
            let step = |k: usize| angle[k + 1] - angle[k];
            let way = step(after - 1).signum();
            let shortest = |from: usize| (from..from + reach).map(|k| way * step(k)).fold(f64::INFINITY, f64::min);
            let [before, next] = [after - reach, after + 1].map(shortest);
            // One that rests or turns round there tells nothing.
            if before <= 0.0 || next <= 0.0 || *variance == 0.0 {
                continue;
            }
            let (least, most) = (before.min(next), before.max(next));
            let forward = way * step(after);
            let more = forward - forward.clamp(least, most);
            size += most * most / variance;
            score += more * most / variance;
            let mean = 0.5 * (before + next);
            mean_size += mean * mean / variance;
            mean_score += mean * forward / variance;
            own.push((most / variance.sqrt(), more / most, forward / mean - 1.0));
        }
        let sure = score / size.max(f64::MIN_POSITIVE).sqrt();
        // A joint tells by itself where one step is beyond the noise of three.
        let (each, rows_of_each) = own.iter().filter(|(step, ..)| *step > TELLS).map(|(_, more, rows)| (*more, *rows)).unzip();
        let of = |score: f64, size: f64| if size > 0.0 { score / size } else { 0.0 };
        Step { trial, after, more: of(score, size), sure, each, rows: of(mean_score, mean_size) - 1.0, rows_of_each }
    };
    (reach..log.len().saturating_sub(1 + reach)).map(of).collect()
}

/// Standard errors of a step from which a joint tells by itself: odds of 1000 by the normal law.
const TELLS: f64 = 3.3;

/// Variance of a step less its neighbour: that of second differences, whatever the few that are larger, and no less than that of an encoder's steps.
fn variance(angle: &[f64]) -> f64 {
    let (_, middle) = robust_spread(&angle.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect::<Vec<_>>());
    let step = angle.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    // Rounding is of a twelfth of a squared step; of a second difference six of it.
    let rounding = if step.is_finite() { step * step / 2.0 } else { 0.0 };
    middle.powi(2).max(rounding)
}

/// A series with rows put in.
fn with_rows(x: &[f64], gaps: &[Gap]) -> Vec<f64> {
    let (mut gaps, mut next) = (gaps.iter().peekable(), 0);
    let row = |k: usize| {
        let row = next;
        next += 1 + gaps.next_if(|gap| gap.after == k).map_or(0, |gap| gap.rows);
        row as f64
    };
    let rows: Vec<f64> = (0..x.len()).map(row).collect();
    interpolated(&rows, x, (0..next).map(|row| row as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Quantity, Unit};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const RATE_HZ: f64 = 200.0;

    /// Two joints that swing, with steps of an encoder of 16 bits, at these times.
    fn log(times: &[f64]) -> Recording {
        let step = std::f64::consts::TAU / 65536.0;
        let channel = |name: &str, f: &dyn Fn(f64) -> f64| {
            Channel::new(name, Unit::si(Quantity::Displacement, true), times.iter().map(|t| (f(*t) / step).round() * step).collect())
        };
        let channels = vec![channel("angle_a", &|t| (1.3 * t).sin() + 0.2 * (5.1 * t).cos()), channel("angle_b", &|t| 0.8 * (2.1 * t + 1.0).sin())];
        Recording::new(RATE_HZ, channels).expect("channels of one length")
    }

    fn lost(times: &[f64]) -> Option<Lost> {
        Lost::of(&[log(times)], &Ports { references: vec![], inputs: vec![], outputs: vec![0, 1] }, 0.01)
    }

    #[test]
    fn rows_that_are_lost_are_put_back_and_a_whole_log_has_none() {
        let times: Vec<f64> = (0..8000).map(|k| f64::from(k) / RATE_HZ).collect();
        assert_eq!(lost(&times), None);
        for (seed, share) in (0..6).zip([0.003, 0.01, 0.03].into_iter().cycle()) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let kept: Vec<f64> = times.iter().copied().filter(|_| rng.random::<f64>() > share).collect();
            let found = lost(&kept).expect("some are lost");
            let filled = &found.filled(&[log(&kept)]).expect("a log")[0];
            let (gone, back) = (times.len() - kept.len(), filled.len() - kept.len());
            // Where both joints turn round nothing tells.
            assert!(!found.uneven && back <= gone && 5 * back > 4 * gone, "{seed}: {back} of {gone}");
        }
        // Ten in a row, over which speeds change.
        let ten: Vec<f64> = times.iter().copied().filter(|t| !(10.0..10.05).contains(t)).collect();
        let found = lost(&ten).expect("ten are lost");
        assert_eq!(found.gaps.iter().map(|gap| (gap.after, gap.rows)).collect::<Vec<_>>(), [(1999, 10)]);
        // One is enough to be told.
        let one: Vec<f64> = times.iter().copied().filter(|t| *t != 20.0).collect();
        assert_eq!(lost(&one).map(|lost| (lost.gaps.len(), lost.words().contains("19.995 s"))), Some((1, true)));
    }

    #[test]
    fn uneven_times_are_no_lost_rows() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let times: Vec<f64> = (0..8000).map(|k| (f64::from(k) + 0.6 * (rng.random::<f64>() - 0.5)) / RATE_HZ).collect();
        let found = lost(&times).expect("not even");
        assert!(found.uneven && found.words().contains("even times"), "{found:?}");
        assert_eq!(found.filled(&[log(&times)]).expect("a log")[0].len(), times.len());
    }
}
