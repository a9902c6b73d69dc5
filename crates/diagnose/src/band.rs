//! The excited band: where the recording says anything about the plant.

use ndof_linear::square;
use ndof_signal::forward_transform;
use num_complex::Complex64;

/// Share of the effort's explained power that lies within the band.
const POWER_SHARE: f64 = 0.995;
/// The band ends at the latest at this multiple of the frequency below which the displacement has its power.
const PLACE_MULTIPLE: usize = 6;
/// The share of the displacement's power that counts there where the motion is imposed, and no plant rounds it off.
const PLACE_SHARE: f64 = 0.95;
/// The share of the velocity's power.
const SPEED_SHARE: f64 = 0.99;

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
    let window: Vec<f64> = (0..segment).map(|k| (std::f64::consts::PI * (k as f64 + 0.5) / segment as f64).sin().powi(2)).collect();
    let forward = forward_transform(segment);
    let spectra = |channels: &[Vec<&[f64]>]| -> Vec<Vec<Vec<Complex64>>> {
        // [segment][channel][line]
        let mut out = Vec::new();
        for trial in channels {
            let mut start = 0;
            while start + segment <= samples {
                out.push(
                    trial
                        .iter()
                        .map(|x| {
                            let part = &x[start..start + segment];
                            let mean = part.iter().sum::<f64>() / segment as f64;
                            let mut buffer: Vec<f64> = part.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
                            let mut spectrum = forward.make_output_vec();
                            if forward.process(&mut buffer, &mut spectrum).is_err() {
                                spectrum.fill(Complex64::ZERO);
                            }
                            spectrum
                        })
                        .collect(),
                );
                start += segment / 2;
            }
        }
        out
    };
    let (f, c, d) = (spectra(effort), spectra(cause), spectra(motion));
    let (nf, nc) = (effort[0].len(), cause[0].len());
    let segments = f.len();
    if segments < nc + 2 {
        return (0.0, rate_hz / 6.0);
    }
    // Explained power of each channel of `what` by `by`, per line.
    let explained = |what: &[Vec<Vec<Complex64>>], channel: usize, k: usize| -> (f64, f64) {
        let mut gram = vec![Complex64::ZERO; nc * nc];
        let mut cross = vec![Complex64::ZERO; nc];
        let mut power = 0.0;
        for (w, b) in what.iter().zip(&c) {
            let y = w[channel][k];
            power += y.norm_sqr();
            for i in 0..nc {
                cross[i] += y * b[i][k].conj();
                for j in 0..nc {
                    gram[i * nc + j] += b[i][k] * b[j][k].conj();
                }
            }
        }
        let Some(inv) = square::inverse(&gram, nc) else { return (0.0, power) };
        let mut sum = Complex64::ZERO;
        for i in 0..nc {
            for j in 0..nc {
                sum += cross[i] * inv[i * nc + j] * cross[j].conj();
            }
        }
        (sum.re.clamp(0.0, power), power)
    };
    // A bias-corrected coherence above this is no chance (about 1 in 1000 after smoothing).
    let independent = 0.55 * segments as f64;
    let chance = nc as f64 / independent + 3.0 / independent.sqrt() / 2.0;
    let mut coherent = vec![false; lines];
    let mut power = vec![0.0; lines];
    let mut speed = vec![0.0; lines];
    let mut place = vec![0.0; lines];
    for channel in 0..nf {
        let pairs: Vec<[(f64, f64); 2]> = (0..lines).map(|k| [explained(&f, channel, k), explained(&d, channel.min(motion[0].len() - 1), k)]).collect();
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
    // The last line up to which three quarters of the lines are coherent.
    let mut count = 0usize;
    let mut edge = 0;
    for (k, &together) in coherent.iter().enumerate().skip(1) {
        count += usize::from(together);
        if together && 4 * count >= 3 * k {
            edge = k;
        }
    }
    let last = if edge >= 4 { edge.min(top + top / 10 + 1) } else { top };
    let hi = (last as f64 * df).clamp(4.0 * df, rate_hz / 2.5);
    // Integration lets the lowest frequencies drift.
    (0.02 * order.saturating_sub(1) as f64 * hi, hi)
}
