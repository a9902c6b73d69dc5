//! The excited band: where the recording says anything about the plant.

use ndof_linear::square;
use ndof_signal::{forward_transform, spectrum_by};
use num_complex::Complex64;

/// Share of the effort's explained power that lies within the band.
const POWER_SHARE: f64 = 0.995;
/// The band ends at the latest at this multiple of the frequency below which the displacement has its power.
const PLACE_MULTIPLE: usize = 6;
/// The share of the displacement's power that counts there where the motion is imposed, and no plant rounds it off.
const PLACE_SHARE: f64 = 0.95;
/// The share of the velocity's power.
const SPEED_SHARE: f64 = 0.99;

/// Spectra of one channel after the other, by segment.
type Spectra = Vec<Vec<Vec<Complex64>>>;

/// Spectra of segments that overlap by half, under Hann's window and without their means: `[segment][channel][line]`.
fn spectra(channels: &[Vec<&[f64]>], samples: usize, segment: usize) -> Spectra {
    let window: Vec<f64> = (0..segment).map(|k| (std::f64::consts::PI * (k as f64 + 0.5) / segment as f64).sin().powi(2)).collect();
    let forward = forward_transform(segment);
    let of = |x: &&[f64], start: usize| {
        let part = &x[start..start + segment];
        let mean = part.iter().sum::<f64>() / segment as f64;
        let mut buffer: Vec<f64> = part.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
        spectrum_by(forward.as_ref(), &mut buffer)
    };
    let starts = || (0..).step_by((segment / 2).max(1)).take_while(|start| start + segment <= samples);
    channels.iter().flat_map(|trial| starts().map(|start| trial.iter().map(|x| of(x, start)).collect())).collect()
}

/// Power of a channel at a line that goes with the causes, and all of it.
fn explained(what: &Spectra, by: &Spectra, channel: usize, k: usize) -> (f64, f64) {
    let n = by[0].len();
    let mut gram = vec![Complex64::ZERO; n * n];
    let mut cross = vec![Complex64::ZERO; n];
    let mut power = 0.0;
    for (w, b) in what.iter().zip(by) {
        let y = w[channel][k];
        power += y.norm_sqr();
        for i in 0..n {
            cross[i] += y * b[i][k].conj();
            for j in 0..n {
                gram[i * n + j] += b[i][k] * b[j][k].conj();
            }
        }
    }
    let Some(inverse) = square::inverse(&gram, n) else { return (0.0, power) };
    let sum: Complex64 = (0..n * n).map(|q| cross[q / n] * inverse[q] * cross[q % n].conj()).sum();
    (sum.re.clamp(0.0, power), power)
}

/// The last line up to which three quarters of the lines are coherent.
fn coherent_edge(coherent: &[bool]) -> usize {
    let (mut count, mut edge) = (0usize, 0);
    for (k, &together) in coherent.iter().enumerate().skip(1) {
        count += usize::from(together);
        if together && 4 * count >= 3 * k {
            edge = k;
        }
    }
    edge
}

/// The band in which `effort` and `motion` move together, from segments of a length that resolves a hundredth of the rate.
///
/// Per effort channel the squared multiple coherence with `cause` (the references, or whichever of the two is imposed) is smoothed;
/// the band ends where it is no longer significant or where the share of the explained power of the effort or of the velocity is reached (`order` derivatives are in the motion already; it may be `imposed`).
pub(crate) fn excited(effort: &[Vec<&[f64]>], cause: &[Vec<&[f64]>], motion: &[Vec<&[f64]>], (order, imposed): (usize, bool), rate_hz: f64) -> (f64, f64) {
    let samples = effort.iter().map(|t| t[0].len()).min().unwrap_or(0);
    let trials = effort.len();
    let segments_wanted = (24 / trials.max(1)).max(8);
    let segment = (2 * samples / (segments_wanted + 1)).clamp(64.min(samples), 1 << 15) / 2 * 2;
    let lines = segment / 2 + 1;
    let [f, c, d] = [effort, cause, motion].map(|channels| spectra(channels, samples, segment));
    let (nf, nc) = (effort[0].len(), cause[0].len());
    let segments = f.len();
    if segments < nc + 2 {
        return (0.0, rate_hz / 6.0);
    }
    // A bias-corrected coherence above this is no chance (about 1 in 1000 after smoothing).
    let independent = 0.55 * segments as f64;
    let chance = nc as f64 / independent + 3.0 / independent.sqrt() / 2.0;
    let mut coherent = vec![false; lines];
    let mut power = vec![0.0; lines];
    let mut speed = vec![0.0; lines];
    let mut place = vec![0.0; lines];
    for channel in 0..nf {
        let pairs: Vec<[(f64, f64); 2]> = (0..lines).map(|k| [explained(&f, &c, channel, k), explained(&d, &c, channel.min(motion[0].len() - 1), k)]).collect();
        let total: f64 = pairs.iter().map(|p| p[0].1).sum::<f64>().max(f64::MIN_POSITIVE);
        // Only what goes with the effort counts as speed; the rest is the noise of a differentiated sensor.
        let shared = |k: usize, p: &[(f64, f64); 2]| p[1].0 * p[0].0 / p[0].1.max(f64::MIN_POSITIVE) * (k as f64).powi(2 - 2 * order as i32);
        let moved: f64 = pairs.iter().enumerate().skip(1).map(|(k, p)| shared(k, p)).sum::<f64>().max(f64::MIN_POSITIVE);
        for k in 0..lines {
            let near = &pairs[k.saturating_sub(2)..(k + 3).min(lines)];
            let mean = |q: usize| near.iter().map(|p| p[q].0 / p[q].1.max(f64::MIN_POSITIVE)).sum::<f64>() / near.len() as f64;
            coherent[k] |= mean(0).min(mean(1)) > chance.min(0.9);
            power[k] += if k == 0 { 0.0 } else { pairs[k][0].0 / total };
            place[k] += if k == 0 { 0.0 } else { shared(k, &pairs[k]) / (k * k) as f64 };
            speed[k] += if k == 0 { 0.0 } else { shared(k, &pairs[k]) / moved };
        }
    }
    let df = rate_hz / segment as f64;
    let reach = |power: &[f64], share: f64| {
        let all: f64 = power.iter().sum();
        let mut sum = 0.0;
        power.iter().position(|p| {
            sum += p;
            sum >= share * all
        })
    };
    let top = reach(&power, POWER_SHARE).unwrap_or(lines - 1).min(reach(&speed, SPEED_SHARE).unwrap_or(lines - 1));
    // Beyond a multiple of where the displacement lives, inertia alone is seen, and blocks would be too short for the rest.
    let share = if imposed { PLACE_SHARE } else { SPEED_SHARE };
    let top = if order == 0 { top.min(PLACE_MULTIPLE * reach(&place, share).unwrap_or(lines - 1).max(2)) } else { top };
    let edge = coherent_edge(&coherent);
    let last = if edge >= 4 { edge.min(top + top / 10 + 1) } else { top };
    let hi = (last as f64 * df).clamp(4.0 * df, rate_hz / 2.5);
    // Integration lets the lowest frequencies drift.
    (0.02 * order.saturating_sub(1) as f64 * hi, hi)
}
