//! What is looked for before the registry: levels in a channel, tones and bursts in what the baseline leaves.

use crate::layout::Layout;
use crate::operators::passed;
use crate::plant::Role;
use crate::samples::Samples;
use crate::search::Stand;
use crate::state::order_of;
use ndof_models::effects::Matrix;
use ndof_signal::{Amplitudes, forward_transform, smooth_length, spectrum_by};
use num_complex::Complex64;

/// What was seen before any hypothesis was tried.
#[derive(Default)]
pub(crate) struct Findings {
    pub levels: Vec<Levels>,
    pub clipped: Vec<Clipped>,
    pub frozen: Vec<Frozen>,
    pub tones: Vec<Tone>,
    pub bursts: Vec<Burst>,
}

/// A force that stands still at the limits of its channel: of its sensor, or of what drives it.
#[derive(Clone, Debug)]
pub(crate) struct Clipped {
    pub axis: usize,
    /// Share of its samples there.
    pub share: f64,
    /// 1 at its upper limit, -1 at its lower one, else 0: `[trial][time]`.
    sides: Vec<Vec<f64>>,
}

/// A motion that stands still in the recording while it goes on: its sensor stopped.
#[derive(Clone, Debug)]
pub(crate) struct Frozen {
    pub trial: usize,
    pub axis: usize,
    /// Since the part began.
    pub from_s: f64,
    pub to_s: f64,
}

/// A channel that moves in steps.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    pub effort: bool,
    pub axis: usize,
    pub step: f64,
    /// step / √12 over the channel's rms.
    pub share: f64,
}

/// How far a tone reaches to each side, for a band to 12 Hz.
pub(crate) const TONE_REACH: f64 = 0.3;

/// A line in the residual.
#[derive(Clone, Debug)]
pub(crate) struct Tone {
    pub axis: usize,
    pub frequency_hz: f64,
    pub amplitude: f64,
    /// Peak over the local median.
    pub height: f64,
    /// Share of the residual's power.
    pub share: f64,
}

/// A burst in the residual.
#[derive(Clone, Debug)]
pub(crate) struct Burst {
    pub trial: usize,
    pub axis: usize,
    pub from_s: f64,
    pub to_s: f64,
    pub impulse: f64,
    /// Share of the whitened residual's power within it.
    pub share: f64,
    /// Power of its strongest window over the upper quartile's.
    pub peak: f64,
    /// Root of its energy over the energy of the effort of all trials.
    pub size: f64,
}

/// The step of a channel all of whose values are multiples of it.
fn step_of(values: impl Iterator<Item = f64> + Clone) -> Option<(f64, f64)> {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let rms = (values.clone().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let mut gaps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > 1e-6 * rms).collect();
    if gaps.is_empty() || gaps.len() > (0.5 * n) as usize {
        return None;
    }
    let mut by_size = gaps.clone();
    by_size.sort_by(f64::total_cmp);
    let step = by_size[by_size.len() / 8];
    gaps.retain(|g| (g / step - (g / step).round()).abs() > 0.02);
    (gaps.is_empty() && step > 0.0).then_some((step, step / 12f64.sqrt() / rms.max(f64::MIN_POSITIVE)))
}

/// Channels whose steps are coarse: step / √12 above `share` of the rms.
pub(crate) fn levels(samples: &Samples, share: f64) -> Vec<Levels> {
    let mut out = Vec::new();
    for (effort, all) in [(true, &samples.effort), (false, &samples.measured)] {
        for axis in 0..all[0].len() {
            if let Some((step, found)) = step_of(all.iter().flat_map(|t| t[axis].iter().copied()))
                && found > share
            {
                out.push(Levels { effort, axis, step, share: found });
            }
        }
    }
    out
}

/// Standard errors that one mean in a thousand is away by chance.
const BY_CHANCE: f64 = 3.29;

/// Forces that stand still at the limits of their channels.
pub(crate) fn clipped(samples: &Samples) -> Vec<Clipped> {
    let of = |axis: usize| {
        let trials: Vec<Amplitudes<'_>> = samples.effort.iter().map(|t| Amplitudes::of(&t[axis])).collect();
        let share = trials.iter().map(Amplitudes::clipped).fold(0.0, f64::max);
        let side = |x: f64, [low, high]: [f64; 2]| f64::from(u8::from(x == high)) - f64::from(u8::from(x == low));
        let sides = |own: &Amplitudes<'_>| own.samples.iter().map(|x| side(*x, own.range)).collect();
        (share > 0.0).then(|| Clipped { axis, share, sides: trials.iter().map(sides).collect() })
    };
    (0..samples.effort[0].len()).filter_map(of).collect()
}

/// Stretches in which sensors of motion stopped.
pub(crate) fn frozen(samples: &Samples) -> Vec<Frozen> {
    let second = |sample: usize| sample as f64 / samples.rate_hz;
    let of = |trial: usize, axis: usize| {
        let stretches = ndof_signal::frozen(&samples.measured[trial][axis]);
        stretches.into_iter().map(move |of| Frozen { trial, axis, from_s: second(of.start), to_s: second(of.end) })
    };
    (0..samples.measured.len()).flat_map(|trial| (0..samples.measured[trial].len()).flat_map(move |axis| of(trial, axis))).collect()
}

impl Clipped {
    /// Whether more acts at the limits than the channel shows: what a model leaves, `[trial][axis][time]`, takes their side, second by second, beyond chance. Where a motor gives no
    /// more and its sensor shows that, it does not.
    pub fn hides(&self, layout: &Layout, e: &[Vec<Vec<f64>>]) -> bool {
        let inside = layout.starts[0]..layout.starts[layout.starts.len() - 1] + layout.block;
        let per = ((layout.time_s * layout.rate_hz) as usize).max(1);
        let sided = |trial: &Vec<Vec<f64>>, sides: &Vec<f64>| -> Vec<f64> {
            let both: Vec<f64> = trial[self.axis].iter().zip(sides.iter().step_by(layout.factor)).map(|(e, side)| e * side).collect();
            both[inside.start.min(both.len())..inside.end.min(both.len())].chunks(per).map(|second| second.iter().sum()).collect()
        };
        let sums: Vec<f64> = e.iter().zip(&self.sides).flat_map(|(trial, sides)| sided(trial, sides)).collect();
        let count = sums.len() as f64;
        let mean = sums.iter().sum::<f64>() / count;
        let variance = sums.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        mean.abs() > BY_CHANCE * (variance / count).sqrt()
    }
}

/// A model's residual force in time about the mean movement: `[trial][axis][time]`; `beyond` is what it has beyond its matrices, trial by trial.
pub(crate) fn residual(stand: &Stand, beyond: &[Vec<Vec<f64>>]) -> Vec<Vec<Vec<f64>>> {
    let state = &stand.state;
    let layout = &state.layout;
    let n = layout.axes;
    let mut left: Vec<Vec<Vec<f64>>> = (0..layout.trials)
        .map(|trial| {
            let kinematics: Vec<Vec<Vec<f64>>> =
                (0..3).map(|p| state.motion[trial].iter().map(|t| layout.filtered(t, |s| s.powi(p), None)).collect()).collect();
            let mut e: Vec<Vec<f64>> = state.effort[trial].iter().map(|t| layout.filtered(t, |_| Complex64::ONE, None)).collect();
            let take = |e: &mut Vec<Vec<f64>>, m: Matrix, i: usize, j: usize, value: f64| {
                e[i].iter_mut().zip(&kinematics[order_of(m)][j]).for_each(|(e, x)| *e -= value * x);
            };
            for &(m, i, j, value) in &stand.base.structure.given {
                take(&mut e, m, i, j, value);
            }
            for ((role, column), &value) in stand.base.roles.iter().zip(&stand.base.columns).zip(&stand.fit.theta) {
                if let Role::Entry(m, ..) = role {
                    for (i, j, _) in &column.action {
                        take(&mut e, *m, *i, *j, value);
                    }
                }
            }
            let known = stand.base.structure.known.iter().map(|law| state.forces_of(law.as_ref(), trial));
            for force in known.chain(beyond.get(trial).cloned()) {
                e.iter_mut().flatten().zip(force.iter().flatten()).for_each(|(e, f)| *e -= f);
            }
            for series in e.iter_mut().take(n) {
                let mean = series.iter().sum::<f64>() / series.len() as f64;
                series.iter_mut().for_each(|v| *v -= mean);
            }
            e
        })
        .collect();
    for axis in 0..n {
        let about = layout.movement.as_ref().map(|movement| movement.deviation(&left.iter().map(|trial| trial[axis].as_slice()).collect::<Vec<_>>()));
        left.iter_mut().zip(about.into_iter().flatten()).for_each(|(trial, deviation)| trial[axis] = deviation);
    }
    left
}

/// The highest line in the residual along axes without a `known` one, if it is a tone and not a resonance. Where what drives the plant repeats, `repeated` its frequency and the
/// uncertainty of that, a line at one of its harmonics is what a plant makes of it, and none.
pub(crate) fn tone(stand: &Stand, e: &[Vec<Vec<f64>>], repeated: Option<(f64, f64)>, known: &[Tone]) -> Option<Tone> {
    let layout = &stand.state.layout;
    let n = layout.samples;
    let padded = smooth_length(n);
    let forward = forward_transform(padded);
    let window: Vec<f64> = (0..n).map(|k| (std::f64::consts::PI * (k as f64 + 0.5) / n as f64).sin().powi(2)).collect();
    let df = layout.rate_hz / padded as f64;
    let unit = 1.0 / layout.time_s;
    let top = (0.36 * layout.rate_hz / df) as usize;
    let first = (1.5 * unit / df) as usize;
    let (near, far) = (((0.3 * unit / df) as usize).max(3), ((0.9 * unit / df) as usize).max(12));
    let smooth = ((0.12 * unit / df).round() as usize).max(2);
    let mut best: Option<Tone> = None;
    for axis in (0..layout.axes).filter(|axis| known.iter().all(|tone| tone.axis != *axis)) {
        let mut power = vec![0.0; padded / 2 + 1];
        for trial in e {
            let mut buffer: Vec<f64> = trial[axis].iter().zip(&window).map(|(x, w)| x * w).collect();
            buffer.resize(padded, 0.0);
            power.iter_mut().zip(&spectrum_by(forward.as_ref(), &mut buffer)).for_each(|(p, x)| *p += x.norm_sqr() / e.len() as f64);
        }
        for k in first.max(far)..top.min(power.len() - far - 1) {
            let harmonic = |(own_hz, error_hz): (f64, f64)| {
                let order = (k as f64 * df / own_hz).round().max(1.0);
                (k as f64 * df - order * own_hz).abs() <= 2.0 * layout.rate_hz / n as f64 + order * error_hz
            };
            if power[k] < power[k - 1] || power[k] < power[k + 1] || repeated.is_some_and(harmonic) {
                continue;
            }
            let mut around: Vec<f64> = power[k - far..k - near].iter().chain(&power[k + near..k + far]).copied().collect();
            around.sort_by(f64::total_cmp);
            let median = around[around.len() / 2] / std::f64::consts::LN_2;
            let height = power[k] / median.max(f64::MIN_POSITIVE);
            // A resonance is smooth over a quarter of a hertz, a tone is not.
            let mean = power[k - smooth..=k + smooth].iter().sum::<f64>() / (2 * smooth + 1) as f64;
            let broad = around.iter().sum::<f64>() / around.len() as f64;
            if height > 30.0 && (power[k] / mean > 6.0 || mean / broad > 8.0) && best.as_ref().is_none_or(|b| height > b.height) {
                let line: f64 = power[k - near.min(k)..=k + near].iter().sum::<f64>();
                let gain = window.iter().map(|w| w * w).sum::<f64>();
                // Power of a sine of amplitude A in the windowed transform: A² N Σ w² / 4.
                let amplitude = (4.0 * line / (padded as f64 * gain)).sqrt();
                // Of what lies in the band, or below the line.
                let last = ((layout.frequency_hz[layout.lines() - 1] / df) as usize).max(k + near).min(power.len() - 1);
                let share = (line / power[..=last].iter().sum::<f64>().max(f64::MIN_POSITIVE)).min(1.0);
                best = Some(Tone { axis, frequency_hz: k as f64 * df, amplitude, height, share });
            }
        }
    }
    best
}

/// One axis' residual divided by the root of its own power, within the band.
fn whiten(stand: &Stand, e: &[Vec<Vec<f64>>], axis: usize) -> Vec<Vec<f64>> {
    let layout = &stand.state.layout;
    let power = &stand.fit.power[axis];
    let last = layout.lines() - 1;
    let (lo, hi) = (layout.frequency_hz[0], layout.frequency_hz[last]);
    // What derivatives leave at the ends of a trial would ring.
    let inside = layout.starts[0] as f64..(layout.starts[layout.starts.len() - 1] + layout.block) as f64;
    let reach = (0.5 * layout.time_s * layout.rate_hz).max(1.0);
    let fade = |k: usize| {
        let outside = (inside.start - k as f64).max(k as f64 - inside.end).max(0.0);
        if outside < reach { 0.5 + 0.5 * (std::f64::consts::PI * outside / reach).cos() } else { 0.0 }
    };
    e.iter()
        .map(|trial| {
            // It ends at nought, and nothing is beside it: of a mirrored record the straight line would go through two samples of its middle.
            let mut faded: Vec<f64> = trial[axis].iter().enumerate().map(|(k, v)| v * fade(k)).collect();
            faded.resize(smooth_length(faded.len() + 2 * reach as usize), 0.0);
            let mut white = passed(faded, layout.rate_hz, |s| {
                let f = s.im / std::f64::consts::TAU;
                if f > hi || f <= 0.1 / layout.time_s {
                    return Complex64::ZERO;
                }
                let place = ((f - lo) / (hi - lo) * last as f64).clamp(0.0, last as f64);
                (1.0 / power[place.round() as usize].sqrt()).into()
            });
            white.truncate(trial[axis].len());
            white
        })
        .collect()
}

/// Power of a window over the upper quartile's that a burst has.
const HOT: f64 = 8.0;
/// The same for its strongest window.
const PEAK: f64 = 20.0;
/// With fewer windows none stands out.
const FEWEST_WINDOWS: usize = 24;
/// A burst is no longer than this many half windows.
const MOST_HOT: usize = 10;

/// The strongest bursts in the whitened residual, one of a trial at most, if they are short and stand out by far.
pub(crate) fn bursts(stand: &Stand, e: &[Vec<Vec<f64>>]) -> Vec<Burst> {
    let layout = &stand.state.layout;
    let length = ((0.4 * layout.time_s * layout.rate_hz) as usize).max(4);
    // Derivatives are less sure at the ends of a trial.
    let inside = layout.starts[0] + 2 * length..(layout.starts[layout.starts.len() - 1] + layout.block).saturating_sub(4 * length);
    let mut best: (f64, Vec<Burst>) = (0.0, Vec::new());
    for axis in 0..layout.axes {
        let white = whiten(stand, e, axis);
        let windows: Vec<(usize, usize, f64)> = white
            .iter()
            .enumerate()
            .flat_map(|(trial, w)| inside.clone().step_by(length / 2).map(move |k| (trial, k, w[k..k + length].iter().map(|x| x * x).sum::<f64>())))
            .collect();
        if windows.len() < FEWEST_WINDOWS {
            continue;
        }
        let mut sorted: Vec<f64> = windows.iter().map(|w| w.2).collect();
        sorted.sort_by(f64::total_cmp);
        let (typical, highest, total) = (sorted[sorted.len() * 3 / 4], sorted[sorted.len() - 1], sorted.iter().sum::<f64>());
        let hot: Vec<&(usize, usize, f64)> = windows.iter().filter(|w| w.2 > HOT * typical).collect();
        let of_trials: Vec<&[&(usize, usize, f64)]> = hot.chunk_by(|a, b| a.0 == b.0).collect();
        // One stretch of a trial: an effect of the motion comes back with the motion.
        let short = |hot: &&[&(usize, usize, f64)]| hot.len() <= MOST_HOT && hot.windows(2).all(|w| w[1].1 - w[0].1 <= length);
        if highest <= best.0 || highest < PEAK * typical || !of_trials.iter().all(short) {
            continue;
        }
        let energy = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>();
        let effort: f64 = stand.state.effort.iter().map(|trial| energy(&layout.filtered(&trial[axis], |_| Complex64::ONE, None))).sum();
        let burst = |hot: &&[&(usize, usize, f64)]| {
            let (first, last) = (hot.first()?, hot.last()?);
            let peak = hot.iter().map(|w| w.2).fold(0.0, f64::max);
            let stretch = &e[first.0][axis][first.1..last.1 + length];
            (peak >= PEAK * typical).then(|| Burst {
                trial: first.0,
                axis,
                from_s: first.1 as f64 / layout.rate_hz,
                to_s: (last.1 + length) as f64 / layout.rate_hz,
                impulse: -stretch.iter().sum::<f64>() / layout.rate_hz,
                share: hot.iter().map(|w| w.2).sum::<f64>() / total,
                peak: peak / typical,
                size: (energy(stretch) / effort.max(f64::MIN_POSITIVE)).sqrt(),
            })
        };
        best = (highest, of_trials.iter().filter_map(burst).collect());
    }
    best.1
}

/// Slow change of stiffness or damping: power of (whitened residual × motion) from two lines to 0.7 Hz against 1 to 2.5 Hz, as a z-score.
pub(crate) fn variation(stand: &Stand, e: &[Vec<Vec<f64>>]) -> f64 {
    let layout = &stand.state.layout;
    let n = layout.axes;
    let unit = 1.0 / layout.time_s;
    let edge = layout.starts[0];
    let inner = layout.starts.len() * layout.block;
    let padded = smooth_length(inner);
    let forward = forward_transform(padded);
    let df = layout.rate_hz / padded as f64;
    let band = |lo: f64, hi: f64| (lo * unit / df).ceil() as usize..((hi * unit / df) as usize).max((lo * unit / df).ceil() as usize + 1).min(padded / 2);
    // From where the taper resolves a change: two lines of the whole length.
    let (low, high) = (band(2.0 * layout.rate_hz / inner as f64 / unit, 0.7), band(1.0, 2.5));
    let mut worst = 0.0f64;
    for i in 0..n {
        let white = whiten(stand, e, i);
        for j in 0..n {
            for velocity in [false, true] {
                let mut power = vec![0.0; padded / 2 + 1];
                for (trial, white) in white.iter().enumerate() {
                    let motion = if velocity { &stand.state.law_v[trial] } else { &stand.state.law_x[trial] };
                    let product: Vec<f64> = (edge..edge + inner).map(|k| white[k] * motion[k * n + j]).collect();
                    let mean = product.iter().sum::<f64>() / inner as f64;
                    let mut buffer: Vec<f64> =
                        product.iter().enumerate().map(|(k, p)| (p - mean) * (std::f64::consts::PI * (k as f64 + 0.5) / inner as f64).sin().powi(2)).collect();
                    buffer.resize(padded, 0.0);
                    power.iter_mut().zip(&spectrum_by(forward.as_ref(), &mut buffer)).for_each(|(p, x)| *p += x.norm_sqr());
                }
                let mean = |r: &std::ops::Range<usize>| power[r.clone()].iter().sum::<f64>() / r.len().max(1) as f64;
                let count = (low.len() * e.len()) as f64;
                worst = worst.max((mean(&low) / mean(&high).max(f64::MIN_POSITIVE) - 1.0) * (count / 2.0).sqrt());
            }
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// At half the rate of the record: what a model leaves is of every second of its samples.
    #[test]
    fn a_force_that_is_cut_off_is_looked_for_where_it_is() {
        let layout = Layout::new(1, 1, 8000, 200.0, (0.0, 5.0));
        assert_eq!(layout.factor, 2);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let sides: Vec<f64> = (0..8000).map(|_| f64::from(random.random_range(-1..=1_i32))).collect();
        let mut left = |more: f64| vec![vec![(0..4000).map(|k| more * sides[2 * k] + random.random::<f64>() - 0.5).collect::<Vec<f64>>()]];
        let clipped = |sides: &[f64]| Clipped { axis: 0, share: 0.3, sides: vec![sides.to_vec()] };
        let [hidden, none] = [left(0.1), left(0.0)];
        assert!(clipped(&sides).hides(&layout, &hidden) && !clipped(&sides).hides(&layout, &none));
    }
}
