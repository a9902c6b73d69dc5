//! Does a signal's power come evenly in time? What sweeps, steps and stretches of rest do to averages over segments.

use ndof_signal::{Window, forward_transform, reverse_arrangements, spectrum_by};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::ops::Range;

/// Stretches that a signal is cut into: Bendat & Piersol's 16 to 25 intervals.
const STRETCHES: usize = 16;
/// Bands at most, each with as much power as the others, as far as lines go …
const BANDS: usize = 8;
/// … of which each has so many, or its power is that of one line.
const FEWEST_LINES: usize = 6;
/// Correlation of |X|² between a line of a Hann window and those one and two beyond: (2/3)² and (1/6)².
const NEIGHBOURS: [f64; 3] = [1.0, 4.0 / 9.0, 1.0 / 36.0];
/// Share of steady signals that are called unsteady.
const FALSE_ALARM: f64 = 1e-3;
/// Share of the stretches that count below which an average has lost more of its segments than it keeps.
const HALF: f64 = 0.5;
/// A stretch with less than this share of a band's mean power adds nothing to it, nor does a band with less of all: a fiftieth, as at the ends of a
/// band that is fitted.
pub(crate) const NOTHING: f64 = 0.02;

/// How evenly a signal's power comes in time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Steadiness {
    /// Bands of about equal power (Hz).
    pub bands_hz: Vec<[f64; 2]>,
    /// Probability of stretches that differ so much in power, if the signal were steady and Gaussian.
    pub p_value: f64,
    /// Share of the stretches that count: (Σ P)²/(S Σ P²) over stretches, mean over bands; 1 where all have the same power.
    pub share: f64,
    /// Whether the bands have their power one after the other: from low to high (true) or from high to low.
    pub sweep: Option<bool>,
    /// Runs of samples in which no band has power.
    pub rest: Vec<Range<usize>>,
}

impl Steadiness {
    /// Whether its stretches differ beyond chance, one steady signal of a thousand excepted.
    pub fn differs(&self) -> bool {
        self.p_value < FALSE_ALARM
    }

    /// Whether averages over segments say more of themselves than they hold: power comes and goes beyond chance, and half of the segments or
    /// more count for nothing.
    pub fn is_unsteady(&self) -> bool {
        self.differs() && self.share < HALF
    }

    /// Whether its power moves through the bands: a sine whose frequency rises or falls.
    pub fn is_sweep(&self) -> bool {
        self.is_unsteady() && self.sweep.is_some()
    }
}

/// Looks at the power of 16 stretches in some bands; `None` where a signal is too short to tell, or holds what is no number.
///
/// The power P_bs of a band in a stretch is χ² with ν_b = 2 (Σ P)²/Σ P_f P_g ρ²_fg degrees of freedom, ρ being what the window correlates,
/// for any Gaussian signal that is steady. Bartlett's statistic of equal variances
///
/// T_b = ν_b (S ln mean P_b − Σ_s ln P_bs) / (1 + (S + 1)/(3 S ν_b))
///
/// then is χ² with S − 1 degrees of freedom, and their sum over bands with so many times as many. Signals of constant size (binary sequences,
/// multisines) scatter less. A sweep is known by the order of the bands' mean times (reverse arrangements).
///
/// M. S. Bartlett (1937), Properties of sufficiency and statistical tests, Proc. R. Soc. A 160. J. S. Bendat & A. G. Piersol (2010), Random
/// Data, ch. 10.
///
/// ```
/// let chirp: Vec<f64> = (0..8000).map(|k| f64::from(k) / 100.0).map(|t| (0.6 * t * t).sin()).collect();
/// let found = ndof_sysid::steadiness(&chirp, 100.0).expect("long enough");
/// assert!(found.is_unsteady() && found.sweep == Some(true) && found.rest.is_empty());
/// ```
pub fn steadiness(signal: &[f64], sample_rate_hz: f64) -> Option<Steadiness> {
    let length = signal.len() / STRETCHES;
    let lines = length.checked_div(2)?.checked_sub(2).filter(|lines| *lines >= 2 * FEWEST_LINES)?;
    if !signal.iter().all(|x| x.is_finite()) {
        return None;
    }
    // The first two lines hold what the window makes of a mean.
    let periodograms = periodograms(signal, length, 2..2 + lines);
    let mean: Vec<f64> = (0..lines).map(|f| periodograms.iter().map(|p| p[f]).sum::<f64>() / STRETCHES as f64).collect();
    let total: f64 = mean.iter().sum();
    if total <= 0.0 {
        return None;
    }
    let mut bands = bands(&mean);
    // What is next to no power is no input: a sensor's noise, say.
    bands.retain(|band| mean[band.clone()].iter().sum::<f64>() >= NOTHING * total);
    let powers: Vec<Vec<f64>> = bands.iter().map(|band| periodograms.iter().map(|p| p[band.clone()].iter().sum()).collect()).collect();
    let (mut statistic, mut share) = (0.0, 0.0);
    for (band, powers) in bands.iter().zip(&powers) {
        statistic += bartlett(powers, freedom(&mean[band.clone()]));
        let (sum, squares) = powers.iter().fold((0.0, 0.0), |(sum, squares), p| (sum + p, squares + p * p));
        share += sum * sum / (STRETCHES as f64 * squares) / bands.len() as f64;
    }
    let law = ChiSquared::new(((STRETCHES - 1) * bands.len()) as f64).ok()?;
    let hz = |line: usize| (line + 2) as f64 * sample_rate_hz / length as f64;
    Some(Steadiness {
        bands_hz: bands.iter().map(|band| [hz(band.start), hz(band.end - 1)]).collect(),
        p_value: if statistic.is_finite() { law.sf(statistic) } else { 0.0 },
        share,
        sweep: order(&powers),
        rest: rest(&powers, length, signal.len()),
    })
}

/// |X(f)|² of each stretch less its mean, behind a Hann window.
fn periodograms(signal: &[f64], length: usize, lines: Range<usize>) -> Vec<Vec<f64>> {
    let (window, transform) = (Window::Hann.samples(length, false), forward_transform(length));
    let of = |stretch: &[f64]| {
        let mean = stretch.iter().sum::<f64>() / length as f64;
        let mut faded: Vec<f64> = stretch.iter().zip(&window).map(|(x, w)| w * (x - mean)).collect();
        spectrum_by(transform.as_ref(), &mut faded)[lines.clone()].iter().map(|v| v.norm_sqr()).collect()
    };
    signal.chunks_exact(length).take(STRETCHES).map(of).collect()
}

/// Bands of equal power, of [`FEWEST_LINES`] lines at least; what a band takes beyond its share, those above it lack.
fn bands(mean: &[f64]) -> Vec<Range<usize>> {
    let mut rest: f64 = mean.iter().sum();
    let mut out: Vec<Range<usize>> = Vec::new();
    let mut start = 0;
    while out.len() + 1 < BANDS && mean.len() - start >= 2 * FEWEST_LINES {
        let share = rest / (BANDS - out.len()) as f64;
        let mut sum = 0.0;
        let mut end = start;
        while end < mean.len() && (sum < share || end - start < FEWEST_LINES) {
            sum += mean[end];
            end += 1;
        }
        if mean.len() - end < FEWEST_LINES {
            break;
        }
        out.push(start..end);
        (start, rest) = (end, rest - sum);
    }
    // What no band has taken is one of its own, unless it is short of that.
    match out.last_mut() {
        Some(last) if mean.len() - start < FEWEST_LINES => last.end = mean.len(),
        _ => out.push(start..mean.len()),
    }
    out
}

/// Real degrees of freedom of the sum of neighbouring |X|², from their mean powers over stretches; that these are means themselves makes a
/// product larger by 1 + ρ²/S.
fn freedom(mean: &[f64]) -> f64 {
    let term = |f: usize, lag: usize| {
        let twice = if lag == 0 { 1.0 } else { 2.0 };
        twice * NEIGHBOURS[lag] * mean[f] * mean[f + lag] / (1.0 + NEIGHBOURS[lag] / STRETCHES as f64)
    };
    let spread: f64 = (0..NEIGHBOURS.len()).flat_map(|lag| (0..mean.len().saturating_sub(lag)).map(move |f| term(f, lag))).sum();
    2.0 * mean.iter().sum::<f64>().powi(2) / spread
}

fn bartlett(powers: &[f64], freedom: f64) -> f64 {
    let count = powers.len() as f64;
    let mean = powers.iter().sum::<f64>() / count;
    let logarithms: f64 = powers.iter().map(|p| (p / mean).ln()).sum();
    -freedom * logarithms / (1.0 + (count + 1.0) / (3.0 * count * freedom))
}

/// Whether the bands' mean times are in the order of the bands, upwards or downwards, beyond chance.
fn order(powers: &[Vec<f64>]) -> Option<bool> {
    let time = |band: &Vec<f64>| band.iter().enumerate().map(|(s, p)| s as f64 * p).sum::<f64>() / band.iter().sum::<f64>();
    let times: Vec<f64> = powers.iter().map(time).collect();
    let test = reverse_arrangements(&times).ok()?;
    (test.p_value < FALSE_ALARM).then_some((test.count as f64) < test.expected)
}

/// Runs of stretches without power in any band; what is left over at the end goes with the last of them.
fn rest(powers: &[Vec<f64>], length: usize, samples: usize) -> Vec<Range<usize>> {
    let means: Vec<f64> = powers.iter().map(|band| band.iter().sum::<f64>() / band.len() as f64).collect();
    let quiet = |s: usize| powers.iter().zip(&means).all(|(band, mean)| band[s] < NOTHING * mean);
    let mut out: Vec<Range<usize>> = Vec::new();
    for s in (0..STRETCHES).filter(|&s| quiet(s)) {
        let end = if s + 1 == STRETCHES { samples } else { (s + 1) * length };
        match out.last_mut() {
            Some(last) if last.end == s * length => last.end = end,
            _ => out.push(s * length..end),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::FilteredNoise;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 200.0;

    fn white(rng: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
        (0..count).map(|_| rng.sample(StandardNormal)).collect()
    }

    /// White, low-passed, with a peak that is narrow, binary, filtered noise, and the sum of many sines: whatever is steady.
    fn steady(seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let white = white(&mut rng, 8200);
        let recursive = |a: f64, b: f64| {
            let mut last = [0.0; 2];
            let step = |x: &f64| {
                last = [x + a * last[0] + b * last[1], last[0]];
                last[0]
            };
            white.iter().map(step).skip(200).collect::<Vec<f64>>()
        };
        match seed % 6 {
            0 => white[200..].to_vec(),
            1 => recursive(0.95, 0.0),
            2 => recursive(2.0 * 0.98 * (TAU * 5.0 / RATE_HZ).cos(), -0.98 * 0.98),
            3 => white[200..].chunks(5).flat_map(|chunk| std::iter::repeat_n(chunk[0].signum(), chunk.len())).collect(),
            4 => FilteredNoise { axes: 1, samples: 8000, rms: 1.0, ..FilteredNoise::default() }.generate(seed).expect("noise").remove(0),
            _ => {
                let sines: Vec<[f64; 2]> = (0..40).map(|_| [rng.random_range(0.5..20.0), rng.random_range(0.0..TAU)]).collect();
                (0..8000).map(|k| sines.iter().map(|[hz, phase]| (TAU * hz * k as f64 / RATE_HZ + phase).sin()).sum()).collect()
            }
        }
    }

    fn found(signal: &[f64]) -> Steadiness {
        steadiness(signal, RATE_HZ).expect("long enough")
    }

    #[test]
    fn steady_signals_are_called_so_and_the_law_is_their_own() {
        let all: Vec<Steadiness> = (0..500).map(|seed| found(&steady(seed))).collect();
        assert!(all.iter().all(|one| !one.is_unsteady() && one.rest.is_empty()));
        // One of a thousand, and four binomial standard deviations of 500.
        let alarms = all.iter().filter(|one| one.differs()).count();
        assert!(alarms <= 4, "{alarms}");
        // Gaussian ones at 5 %: 12.6 of 251, within four standard deviations of 3.5.
        let gaussian = || all.iter().enumerate().filter(|(seed, _)| seed % 6 < 3);
        let rejected = gaussian().filter(|(_, one)| one.p_value < 0.05).count();
        assert!((1..=26).contains(&rejected), "{rejected}");
    }

    #[test]
    fn sweeps_of_any_course_are_sweeps() {
        let chirp = |rate: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let mut phase = 0.0;
            let step = |k: usize| {
                phase += TAU * rate(k as f64 / 12_000.0) / RATE_HZ;
                phase.sin()
            };
            (0..12_000).map(step).collect()
        };
        assert_eq!(found(&chirp(&|u| 0.2 + 20.0 * u)).sweep, Some(true));
        assert_eq!(found(&chirp(&|u| 20.0 - 19.0 * u)).sweep, Some(false));
        let exponential = found(&chirp(&|u| 0.2 * 100f64.powf(u)));
        assert!(exponential.is_sweep() && exponential.sweep == Some(true), "{exponential:?}");
    }

    #[test]
    fn steps_and_bursts_are_unsteady_but_no_sweep() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let noise = white(&mut rng, 12_000);
        let steps: Vec<f64> = (0..12_000).map(|k| if (2000..7000).contains(&k) { 1.0 } else { 0.0 } + 1e-3 * noise[k]).collect();
        let bursts: Vec<f64> = noise.iter().enumerate().map(|(k, x)| if k % 4000 < 900 { *x } else { 0.05 * x }).collect();
        for signal in [steps, bursts] {
            let found = found(&signal);
            assert!(found.is_unsteady() && !found.is_sweep(), "{found:?}");
        }
    }

    #[test]
    fn rest_is_found_where_it_is() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let noise = white(&mut rng, 16_000);
        let signal: Vec<f64> = noise.iter().enumerate().map(|(k, x)| if k < 2500 || (7900..10_100).contains(&k) { 0.01 * x } else { *x }).collect();
        // Whole stretches of a thousand samples.
        assert_eq!(found(&signal).rest, [0..2000, 8000..10_000]);
        let still: Vec<f64> = noise.iter().enumerate().map(|(k, x)| if k >= 12_900 { 0.0 } else { *x }).collect();
        assert_eq!(found(&still).rest, vec![13_000..16_000]);
        assert_eq!(found(&still).p_value, 0.0);
    }

    #[test]
    fn what_is_too_short_or_no_number_is_not_judged() {
        assert!(steadiness(&[1.0; 200], 1.0).is_none() && steadiness(&[0.0; 2000], 1.0).is_none() && steadiness(&[], 1.0).is_none());
        let mut holey = steady(0);
        holey[17] = f64::NAN;
        assert!(steadiness(&holey, RATE_HZ).is_none());
    }
}
