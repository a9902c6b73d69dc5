//! What the sizes of a signal's samples say, whatever their order.

use crate::spread::robust_deviation;
use crate::stationarity::StationarityError;
use crate::totals::total;
use std::borrow::Cow;
use std::sync::OnceLock;

/// Values that differ which are enough to find their least distance: as many as a converter of 16 bits has.
const DISTINCT: usize = 1 << 16;
/// Values by which most signals show already that they have no coarse steps.
const FEW: usize = 1 << 9;
const SAME: fn(f64) -> f64 = |x| x;
/// Samples that are rather counted once more than sorted.
const MANY: usize = 1 << 17;
/// Bins that samples are counted into, at most: their counts stay in the nearest cache.
const BINS: usize = 1 << 12;

/// A run of at least so many equal samples at the end of a channel's range is a limit that was reached.
const CLIPPED_RUN: usize = 4;
/// Share of the samples in such runs above which a channel is clipped.
const CLIPPED_SHARE: f64 = 1e-3;

/// The finite samples of a signal, and what is known of their sizes. Every method takes a few passes. Sorted are only the values of
/// the step, 131 072 at a time, and for quantiles and outliers the samples of the bins that hold them: few, unless one sample lies so far off that all
/// others share a bin.
///
/// ```
/// use ndof_signal::Amplitudes;
/// let quantised: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.7).sin()).map(|x| (8.0 * x).round() / 8.0).collect();
/// let amplitudes = Amplitudes::of(&quantised);
/// assert_eq!((amplitudes.step(), amplitudes.range), (0.125, [-1.0, 1.0]));
/// assert!(amplitudes.quantiles(&[0.5])[0].abs() < 0.1);
/// ```
#[derive(Clone, Debug)]
pub struct Amplitudes<'a> {
    /// The samples that are numbers, in their order.
    pub samples: Cow<'a, [f64]>,
    /// Their mean; NaN where there is none.
    pub mean: f64,
    /// Their standard deviation, about the mean and over their number.
    pub std: f64,
    /// The least and the greatest; +∞ and −∞ where there is none.
    pub range: [f64; 2],
    step: OnceLock<f64>,
}

impl<'a> Amplitudes<'a> {
    /// Looks at the samples that are numbers.
    pub fn of(signal: &'a [f64]) -> Self {
        // The sum of zeros is no number if one of them is of no number.
        let all = total(signal, |x| [0.0 * x])[0] == 0.0;
        let samples: Cow<[f64]> = if all { Cow::Borrowed(signal) } else { signal.iter().copied().filter(|x| x.is_finite()).collect() };
        let count = samples.len() as f64;
        let mean = total(&samples, |x| [x])[0] / count;
        let std = (total(&samples, |x| [(x - mean).powi(2)])[0] / count).sqrt();
        let range = range_of(&samples);
        Amplitudes { samples, mean, std, range, step: OnceLock::new() }
    }

    /// The least distance between values; what is a billionth of their range or less is round-off. Once 65 536 differ, no more are looked at.
    /// Infinite where no two differ.
    pub fn step(&self) -> f64 {
        *self.step.get_or_init(|| self.least_distance(0.0, 2 * DISTINCT))
    }

    /// The same if it is above some distance. Few samples show that it is not: no more values can differ by more than their range holds such distances.
    pub fn step_above(&self, distance: f64) -> Option<f64> {
        let step = self.least_distance(distance, FEW);
        (step > distance).then_some(step)
    }

    /// No more is looked at once `enough` is reached, which is asked for the first time of `most` values that may differ.
    fn least_distance(&self, enough: f64, mut most: usize) -> f64 {
        let mut values = Vec::new();
        let round_off = 1e-9 * (self.range[1] - self.range[0]);
        let least = |values: &mut Vec<f64>| {
            *values = sorted(values, self.range);
            values.dedup();
            values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > round_off).fold(f64::INFINITY, f64::min)
        };
        // What came last under the same place: most samples of a sensor with few steps end here.
        let bits = (usize::BITS - self.samples.len().min(most).leading_zeros()).clamp(1, 16);
        let mut lately = vec![f64::NAN; 1 << bits];
        for &x in &*self.samples {
            let place = &mut lately[(x.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - bits)) as usize];
            if *place != x {
                *place = x;
                values.push(x);
                if values.len() == most {
                    let step = least(&mut values);
                    if step <= enough || values.len() >= DISTINCT {
                        return step;
                    }
                    most = if 2 * values.len() > most { (2 * most).min(2 * DISTINCT) } else { most };
                }
            }
        }
        least(&mut values)
    }

    /// Quantiles at some shares in 0 … 1, less the mean and over the standard deviation, linear between samples; NaN without samples.
    pub fn quantiles(&self, shares: &[f64]) -> Vec<f64> {
        let Some(last) = self.samples.len().checked_sub(1) else { return vec![f64::NAN; shares.len()] };
        let places = shares.iter().map(|share| share.clamp(0.0, 1.0) * last as f64);
        let pairs: Vec<usize> = places.clone().flat_map(|place| [place as usize, (place as usize + 1).min(last)]).collect();
        let found = in_order(&self.samples, self.range, &pairs, |x| x);
        let between = |(place, pair): (f64, &[f64])| {
            let [low, high] = [pair[0] - self.mean, pair[1] - self.mean];
            (low + place.fract() * (high - low)) / self.std
        };
        places.zip(found.chunks_exact(2)).map(between).collect()
    }

    /// How many samples lie further from the median than so many robust standard deviations. `None` where half of all are the same, or there is none.
    pub fn outliers(&self, deviations: f64) -> Option<usize> {
        if self.samples.is_empty() {
            return None;
        }
        let (middle, far) = (self.samples.len() / 2, 9 * self.samples.len() / 10);
        if self.none_beyond(deviations, [middle, far]) {
            return Some(0);
        }
        let median = in_order(&self.samples, self.range, &[middle], |x| x)[0];
        let distance = |x: f64| (x - median).abs();
        let furthest = distance(self.range[0]).max(distance(self.range[1]));
        let distances = in_order(&self.samples, [0.0, furthest], &[middle, far], distance);
        let far = deviations * robust_deviation(distances[0], distances[1]);
        (distances[0] > 0.0).then(|| self.samples.iter().filter(|x| distance(**x) > far).count())
    }

    /// Whether surely none lies so far from the median, by counts alone: `places` are those of the median and of the distances that tell the deviation.
    fn none_beyond(&self, deviations: f64, places: [usize; 2]) -> bool {
        let Bins { counts, .. } = Bins::of(&self.samples, self.range, SAME);
        let median = bin_of(&counts, places[0]);
        let mut away = vec![0; counts.len()];
        counts.iter().enumerate().for_each(|(bin, count)| away[bin.abs_diff(median)] += count);
        // Within a bin the median and a sample lie anywhere, and round-off moves the ends of bins.
        let [middle, far] = places.map(|place| bin_of(&away, place).saturating_sub(2) as f64);
        let furthest = (median.max(counts.len() - median) + 2) as f64;
        middle > 0.0 && deviations * robust_deviation(middle, far) > furthest
    }

    /// Samples in runs of `run` equal ones or more at either end of the range that were reached from farther away than `from` within two samples: a limit
    /// stops what is on its way, and what turns or rests there comes slowly.
    pub fn held_at_ends(&self, run: usize, from: f64) -> usize {
        let [low, high] = self.range;
        let (mut held, mut length, mut abrupt) = (0, 0, true);
        let mut last = [f64::NAN; 2];
        for &x in &*self.samples {
            if x != last[1] {
                held += if abrupt && length >= run { length } else { 0 };
                let way = (x - last[0]).abs();
                (length, abrupt) = (0, way > from || way.is_nan());
            }
            length += usize::from(x == low || x == high);
            last = [last[1], x];
        }
        held + if abrupt && length >= run { length } else { 0 }
    }

    /// Share of the samples that stand still at the ends of the range, where they arrived as fast as they usually go; steps of the converter are no way to
    /// arrive, nor are levels limits of what stands still between them, too. Zero below a thousandth: a limit is reached more often.
    pub fn clipped(&self) -> f64 {
        let [low, high] = self.range;
        let share = |held: f64| held / self.samples.len() as f64;
        if share(total(&self.samples, |x| [f64::from(u8::from(x == low || x == high))])[0]) <= CLIPPED_SHARE || self.is_of_levels() {
            return 0.0;
        }
        let share = |from: f64| share(self.held_at_ends(CLIPPED_RUN, from) as f64);
        let usual = self.usual_step();
        let share = if share(usual) > CLIPPED_SHARE { share(usual.max(2.0 * self.step())) } else { 0.0 };
        if share > CLIPPED_SHARE { share } else { 0.0 }
    }

    /// Whether what lies between the ends of the range stands still as a rule, or nothing does: a staircase, a sequence of two levels.
    fn is_of_levels(&self) -> bool {
        let [low, high] = self.range;
        let between = self.samples.windows(2).filter(|pair| pair[1] != low && pair[1] != high);
        let (all, still) = between.fold((0, 0), |(all, still), pair| (all + 1, still + usize::from(pair[0] == pair[1])));
        2 * still >= all
    }

    /// Root mean square of the steps from sample to sample.
    pub fn usual_step(&self) -> f64 {
        let steps = self.samples.len().saturating_sub(1).max(1) as f64;
        (self.samples.windows(2).map(|x| (x[1] - x[0]).powi(2)).sum::<f64>() / steps).sqrt()
    }

    /// Mean squares about the mean over `intervals` stretches of equal length (a remainder at the end is left out).
    ///
    /// # Errors
    /// [`StationarityError::Intervals`] if there are fewer samples than intervals, or no interval.
    pub fn mean_squares(&self, intervals: usize) -> Result<Vec<f64>, StationarityError> {
        self.over(intervals, |x| (x - self.mean).powi(2))
    }

    /// Means of `intervals` stretches of equal length (a remainder at the end is left out).
    ///
    /// # Errors
    /// As [`Self::mean_squares`].
    pub fn means(&self, intervals: usize) -> Result<Vec<f64>, StationarityError> {
        self.over(intervals, |x| x)
    }

    fn over(&self, intervals: usize, of: impl Fn(f64) -> f64) -> Result<Vec<f64>, StationarityError> {
        let length = self.samples.len().checked_div(intervals).unwrap_or(0);
        if length == 0 {
            return Err(StationarityError::Intervals { samples: self.samples.len(), intervals });
        }
        let mean = |stretch: &[f64]| total(stretch, |x| [of(x)])[0] / length as f64;
        Ok(self.samples.chunks_exact(length).take(intervals).map(mean).collect())
    }
}

/// The least and the greatest of the samples; +∞ and −∞ where there is none.
fn range_of(samples: &[f64]) -> [f64; 2] {
    let wider = |[low, high]: [f64; 2], x: f64| [if x < low { x } else { low }, if x > high { x } else { high }];
    let (eights, rest) = samples.as_chunks::<8>();
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let mut ranges = [none; 8];
    for eight in eights {
        ranges.iter_mut().zip(eight).for_each(|(range, x)| *range = wider(*range, *x));
    }
    ranges.iter().flatten().chain(rest).fold(none, |range, x| wider(range, *x))
}

/// How many samples lie in each of many equal parts of a range.
struct Bins {
    low: f64,
    scale: f64,
    counts: Vec<usize>,
}

impl Bins {
    fn of(samples: &[f64], [low, high]: [f64; 2], value: impl Fn(f64) -> f64) -> Self {
        let bins = samples.len().clamp(1, BINS);
        let mut own = Bins { low, scale: bins as f64 / (high - low), counts: vec![0; bins] };
        for x in samples {
            let place = own.place(value(*x));
            own.counts[place] += 1;
        }
        own
    }

    /// No number, where all are the same or their range is beyond numbers, is the first bin.
    fn place(&self, x: f64) -> usize {
        (((x - self.low) * self.scale) as usize).min(self.counts.len() - 1)
    }

    /// The first place of each bin, once all are in order.
    fn starts(&self) -> Vec<usize> {
        self.counts.iter().scan(0, |below, count| Some(std::mem::replace(below, *below + count))).collect()
    }
}

/// The samples in order: each goes to its bin, and few are left to be sorted there.
fn sorted(samples: &[f64], range: [f64; 2]) -> Vec<f64> {
    let bins = Bins::of(samples, range, SAME);
    let (mut next, mut out) = (bins.starts(), vec![0.0; samples.len()]);
    for x in samples {
        let next = &mut next[bins.place(*x)];
        out[*next] = *x;
        *next += 1;
    }
    let mut from = 0;
    for until in next {
        out[from..until].sort_unstable_by(f64::total_cmp);
        from = until;
    }
    out
}

/// The bin that holds the value at this place in the order.
fn bin_of(counts: &[usize], place: usize) -> usize {
    let mut above = 0;
    let until = counts.iter().position(|count| {
        above += count;
        above > place
    });
    until.unwrap_or(0)
}

/// The values that stand at some places once all are in order. They are counted into bins over their range, and only the bins that hold a
/// place are put in order.
fn in_order(samples: &[f64], range: [f64; 2], places: &[usize], value: impl Fn(f64) -> f64) -> Vec<f64> {
    let bins = Bins::of(samples, range, &value);
    let (bin, counts) = (|x: f64| bins.place(x), &bins.counts);
    let starts = bins.starts();
    let of_place = |place: usize| starts.partition_point(|start| *start <= place) - 1;
    let mut wanted = vec![false; counts.len()];
    places.iter().for_each(|place| wanted[of_place(*place)] = true);
    let mut kept: Vec<f64> = samples.iter().map(|x| value(*x)).filter(|x| wanted[bin(*x)]).collect();
    let left_out = |place: usize| (0..of_place(place)).filter(|bin| !wanted[*bin]).map(|bin| counts[bin]).sum::<usize>();
    let among: Vec<usize> = places.iter().map(|place| place - left_out(*place)).collect();
    // A sample that lies far off leaves too many in too few bins: without it the rest has a range of its own.
    if (MANY..samples.len()).contains(&kept.len()) {
        return in_order(&kept, range_of(&kept), &among, SAME);
    }
    kept.sort_unstable_by(f64::total_cmp);
    among.iter().map(|place| kept[*place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn places_are_those_of_sorted_samples() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let noise: Vec<f64> = (0..5001).map(|_| rng.sample(rand_distr::StandardNormal)).collect();
        let coarse = noise.iter().map(|x| (x * 4.0).round() / 4.0).collect();
        let far = noise.iter().enumerate().map(|(k, x)| if k == 7 { 1e300 } else { *x }).collect();
        let wide = vec![-1.7e308, 1.7e308, 0.0, 5.0, -3.0];
        for samples in [noise.clone(), coarse, far, wide, vec![2.0; 9], vec![1.0], vec![-0.0, 0.0, 1.0]] {
            let mut expected = samples.clone();
            expected.sort_by(f64::total_cmp);
            let places: Vec<usize> = (0..samples.len()).step_by(1 + samples.len() / 97).collect();
            let found = in_order(&samples, Amplitudes::of(&samples).range, &places, |x| x);
            assert!(places.iter().zip(&found).all(|(place, x)| expected[*place] == *x), "{found:?}");
            assert_eq!(sorted(&samples, Amplitudes::of(&samples).range), expected);
        }
    }

    #[test]
    fn a_step_is_found_among_few_values_and_among_many() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut quantised = |step: f64, count: usize| -> Vec<f64> { (0..count).map(|_| (1e3 * rng.random_range(-1.0..1.0_f64)).round() * step).collect() };
        let (coarse, many) = (quantised(0.5, 5000), quantised(0.5, 300_000));
        assert!((Amplitudes::of(&many).step() - 0.5).abs() < 1e-12);
        let fine: Vec<f64> = (0..200_000).map(|_| (rng.random_range(-1.0..1.0_f64) * f64::from(1 << 22)).round()).collect();
        // 65 536 of 8 million values: some neighbours are among them with a probability of one less e^-512.
        assert_eq!(Amplitudes::of(&fine).step(), 1.0);
        assert_eq!(Amplitudes::of(&[3.0; 10]).step(), f64::INFINITY);
        for samples in [Amplitudes::of(&coarse), Amplitudes::of(&many), Amplitudes::of(&fine), Amplitudes::of(&[3.0; 10])] {
            for distance in [0.1, 0.49, 0.51, 0.9, 1.1] {
                assert_eq!(samples.step_above(distance), Some(samples.step()).filter(|step| *step > distance));
            }
        }
    }

    #[test]
    fn outliers_are_counted_unless_most_samples_are_one() {
        let mut samples: Vec<f64> = (0..1001).map(|k| f64::from(k % 11) - 5.0).collect();
        samples[17] = 400.0;
        assert_eq!(Amplitudes::of(&samples).outliers(15.0), Some(1));
        samples[..600].fill(0.0);
        assert_eq!(Amplitudes::of(&samples).outliers(15.0), None);
        // More than half lie within a hundredth of one of two levels, none of them an outlier; a knock beside them is one.
        let mut levels: Vec<f64> = (0..1001).map(|k| f64::from(k % 11) * 1e-3 + if k % 5 < 3 { 4.0 } else { -4.0 }).collect();
        assert_eq!(Amplitudes::of(&levels).outliers(15.0), Some(0));
        levels[17] = 400.0;
        assert_eq!(Amplitudes::of(&levels).outliers(15.0), Some(1));
    }

    #[test]
    fn what_counts_exclude_is_not_there() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let noise: Vec<f64> = (0..20_000).map(|_| rng.sample(rand_distr::StandardNormal)).collect();
        let knocked = noise.iter().enumerate().map(|(k, x)| if k == 9 { 16.0 } else { *x }).collect();
        let few = (0..9).map(|k| f64::from(k % 4)).collect();
        for (samples, excluded) in [(noise, true), (knocked, false), (few, true), (vec![1.0; 50], false)] {
            let amplitudes = Amplitudes::of(&samples);
            let places = [samples.len() / 2, 9 * samples.len() / 10];
            assert_eq!(amplitudes.none_beyond(15.0, places), excluded);
            // Wherever counts say so, none is there.
            let median = sorted(&samples, amplitudes.range)[places[0]];
            let mut distances: Vec<f64> = samples.iter().map(|x| (x - median).abs()).collect();
            distances.sort_by(f64::total_cmp);
            let deviation = robust_deviation(distances[places[0]], distances[places[1]]);
            for deviations in (10..200).map(|k| f64::from(k) / 10.0).filter(|k| amplitudes.none_beyond(*k, places)) {
                assert!(distances[samples.len() - 1] < deviations * deviation, "{deviations}");
            }
        }
    }

    #[test]
    fn runs_at_the_ends_of_the_range_are_counted() {
        let held = [0.0, 2.0, 2.0, 2.0, 1.0, -1.0, -1.0, 2.0, 2.0, -1.0, -1.0, -1.0];
        for (run, from, count) in [(3, 0.0, 6), (2, 0.0, 10), (4, 0.0, 0), (3, 2.5, 6), (3, 3.0, 3), (2, 3.5, 3)] {
            assert_eq!(Amplitudes::of(&held).held_at_ends(run, from), count, "{run} {from}");
        }
        assert_eq!(Amplitudes::of(&[0.0, 3.0, -1.0]).usual_step(), 12.5_f64.sqrt());
        let swing = |reach: f64| (0..4000).map(|k| (3.0 * (f64::from(k) * 0.05).sin()).clamp(-reach, reach)).collect::<Vec<f64>>();
        // Beyond two thirds of its amplitude a sine is for 2/π arccos(2/3) of the time.
        assert!((Amplitudes::of(&swing(2.0)).clipped() - 0.535).abs() < 0.01 && Amplitudes::of(&swing(3.0)).clipped() == 0.0);
    }

    #[test]
    fn mean_squares_are_about_the_mean() {
        assert_eq!(Amplitudes::of(&[1.0, 3.0, 5.0, -1.0, 2.0]).mean_squares(2), Ok(vec![1.0, 9.0]));
        for (signal, samples, intervals) in [(&[f64::NAN] as &[f64], 0, 2), (&[1.0; 3], 3, 4), (&[1.0; 3], 3, 0)] {
            assert_eq!(Amplitudes::of(signal).mean_squares(intervals), Err(StationarityError::Intervals { samples, intervals }));
        }
    }

    #[test]
    fn nothing_has_no_sizes() {
        let none = Amplitudes::of(&[f64::NAN, f64::INFINITY]);
        assert!(none.samples.is_empty() && none.mean.is_nan() && none.quantiles(&[0.5])[0].is_nan() && none.outliers(3.0).is_none());
        assert_eq!((none.step(), none.held_at_ends(1, 0.0)), (f64::INFINITY, 0));
    }
}
