//! Commands that local polynomials take for what a record begins with.

use super::local_lines::Basis;
use super::{LocalPolynomial, Pieces};
use crate::steadiness::NOTHING;
use ndof_signal::{Recording, forward_transform, spectrum_by};
use num_complex::Complex64;

/// Windows that are judged together: of white commands less than one in a thousand is then taken for a beginning (a test counts).
const TOGETHER: usize = 4;
/// Share of a stretch's power below which polynomials leave less than they take.
const HALF: f64 = 0.5;

/// The first command, and the band that it drives (Hz), of whose power half or more is smooth over windows of these polynomials.
///
/// What begins or ends with the record, within the inverse of a window's width, has a transform as smooth as the leakage: with t₀ + Σ t_s rˢ taken out of
/// U(k+r), little is left to divide by.
pub(super) fn drives_like_a_beginning(trials: &[&Recording], commands: &[usize], local: &LocalPolynomial, half_width: usize) -> Option<(usize, [f64; 2])> {
    let width = 2 * half_width + 1;
    let pieces = Pieces::new(trials);
    let basis = Basis::new(half_width, local.order + 1, pieces.len).ok()?;
    let hz = |line: usize| line as f64 * trials[0].sample_rate_hz() / pieces.len as f64;
    commands.iter().find_map(|&channel| {
        let mut stretches = vec![Stretch::default(); basis.last / (TOGETHER * width)];
        for channels in pieces.channels(trials) {
            let spectrum = spectrum_by(forward_transform(pieces.len).as_ref(), &mut channels.get(channel)?.to_vec());
            stretches.iter_mut().zip(spectrum[1..].chunks_exact(TOGETHER * width)).for_each(|(stretch, lines)| stretch.add(lines, &basis));
        }
        // Where power is there is so much of it; what leaks beyond the band is smooth, and drives nothing.
        let sum = |of: &dyn Fn(f64) -> f64| stretches.iter().map(|stretch| of(stretch.power)).sum::<f64>();
        let typical = sum(&|power| power * power) / sum(&|power| power);
        let at = stretches.iter().position(|stretch| stretch.power >= NOTHING * typical && stretch.left < HALF * stretch.power)?;
        Some((channel, [at, at + 1].map(|stretch| hz(1 + stretch * TOGETHER * width))))
    })
}

/// The power of some lines, in windows, and what polynomials leave of it.
#[derive(Clone, Default)]
struct Stretch {
    power: f64,
    left: f64,
}

impl Stretch {
    /// At the edge of a window polynomials take most of a lone line, in its middle next to nothing: windows overlap.
    fn add(&mut self, lines: &[Complex64], basis: &Basis) {
        let power = |series: &[Complex64]| series.iter().map(Complex64::norm_sqr).sum::<f64>();
        let mut left = vec![Complex64::default(); basis.width];
        for window in lines.windows(basis.width).step_by(basis.width.div_ceil(4)) {
            left.clone_from_slice(window);
            basis.project_out(&mut left);
            self.power += power(window);
            self.left += power(&left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Quantity, Unit};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 200.0;

    fn taken(command: Vec<f64>) -> Option<[f64; 2]> {
        let recording = Recording::new(RATE_HZ, vec![Channel::new("command", Unit::si(Quantity::Effort, false), command)]).expect("a channel");
        let local = LocalPolynomial::default();
        drives_like_a_beginning(&[&recording], &[0], &local, local.default_half_width(1, 2)).map(|(_, band_hz)| band_hz)
    }

    fn made(seconds: f64, of: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..(seconds * RATE_HZ) as usize).map(|k| of(k as f64 / RATE_HZ)).collect()
    }

    #[test]
    fn hardly_any_steady_command_is_one() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut white = |count: usize| -> Vec<f64> { (0..count).map(|_| StandardNormal.sample(&mut rng)).collect() };
        // Of 1000 with a probability below a thousandth each; five have one of less than a hundredth together (Poisson).
        let count = (0..1000).filter(|_| taken(white(6000)).is_some()).count();
        assert!(count < 5, "{count}");
        // What leaks beyond a band is smooth, and no command: means over ten samples, twice.
        let means = |x: Vec<f64>| x.windows(10).map(|w| w.iter().sum::<f64>()).collect::<Vec<f64>>();
        let count = (0..200).filter(|_| taken(means(means(white(6000)))).is_some()).count();
        assert!(count < 3, "{count}");
        assert_eq!(taken(made(60.0, |t| (1..60).map(|k| (TAU * 0.2 * f64::from(k) * t + f64::from(k * k)).sin()).sum())), None);
    }

    #[test]
    fn a_sweep_is_one_where_a_record_begins_or_ends_with_it() {
        let sweep = |t: f64| (TAU * (0.3 * t + 11.7 * t * t / 60.0)).sin();
        let up = taken(made(30.0, sweep)).expect("it begins with its lowest frequencies");
        assert!(up[0] < 1.0, "{up:?}");
        let down = taken(made(30.0, |t| sweep(30.0 - t))).expect("it ends with them");
        assert!(down[0] < 1.0, "{down:?}");
        // In the middle of a record nothing of it is smooth.
        assert_eq!(taken(made(90.0, |t| if (30.0..60.0).contains(&t) { sweep(t - 30.0) } else { 0.0 })), None);
        assert_eq!(taken(vec![]), None);
        assert_eq!(taken(vec![0.0; 6000]), None);
    }
}
