//! What the local methods share: the lines of a record's transform, polynomials over a window of them, and the results line by line.

use super::EstimateError;
use super::fitted::Fitted;
use crate::lanes::{LANES, Lanes};
use crate::uncertainty::NAN;
use ndarray::Array3;
use ndof_signal::{forward_transform, spectrum_by};
use num_complex::Complex64;
use pulp::Simd;
use rayon::prelude::*;

/// The transforms of one piece of a trial, one a channel, 0 to Nyquist, scaled so that |Z|² is a one-sided density.
pub(crate) struct Lines(Vec<Vec<Complex64>>);

impl Lines {
    /// Transforms of channels of one length, each without its mean.
    pub(crate) fn new(sample_rate_hz: f64, channels: &[&[f64]]) -> Self {
        let len = channels.first().map_or(0, |samples| samples.len());
        let fft = forward_transform(len);
        let scale = (2.0 / (sample_rate_hz * len as f64)).sqrt();
        let transform = |samples: &&[f64]| {
            let mean = samples.iter().sum::<f64>() / len as f64;
            spectrum_by(fft.as_ref(), &mut samples.iter().map(|v| (v - mean) * scale).collect::<Vec<f64>>())
        };
        Lines(channels.par_iter().map(transform).collect())
    }

    /// `width` lines of a channel from line `low` on.
    pub(super) fn window(&self, channel: usize, low: usize, width: usize) -> &[Complex64] {
        &self.0[channel][low..low + width]
    }

    /// Windows of a channel side by side, one a lane, each from its own line on; as wide as `to`.
    #[inline(always)]
    pub(super) fn windows(&self, channel: usize, low: &[usize; LANES], to: &mut [Lanes]) {
        let lines = &self.0[channel];
        if low.windows(2).all(|pair| pair[1] == pair[0] + 1) {
            to.iter_mut().enumerate().for_each(|(r, to)| *to = Lanes::load(&lines[low[0] + r..low[0] + r + LANES]));
            return;
        }
        for (l, &low) in low.iter().enumerate() {
            for (to, line) in to.iter_mut().zip(&lines[low..]) {
                (to.re[l], to.im[l]) = (line.re, line.im);
            }
        }
    }
}

/// Lines that one task treats, so that workspaces are made once for many.
pub(super) const TASK: usize = 256;

/// Windows of 2n+1 of a record's lines, and orthonormal polynomials on them (Gram), row by row: `value[s * width + r]`.
pub(super) struct Basis {
    pub(super) terms: usize,
    pub(super) width: usize,
    /// The last line that is one of the windows'.
    pub(super) last: usize,
    value: Vec<f64>,
}

impl Basis {
    /// For a record of so many samples.
    pub(super) fn new(half_width: usize, terms: usize, samples: usize) -> Result<Self, EstimateError> {
        // Nyquist's line of an even length is real, and none of these.
        let (width, last) = (half_width.saturating_mul(2).saturating_add(1), samples.saturating_sub(1) / 2);
        if last < width {
            return Err(EstimateError::TooFewLines { lines: last, needed: width });
        }
        let mut value: Vec<f64> = Vec::with_capacity(terms * width);
        for s in 0..terms {
            let mut row: Vec<f64> = (0..width).map(|r| ((r as f64 - half_width as f64) / half_width as f64).powi(s as i32)).collect();
            // Twice, so that what round-off leaves of the first pass is gone.
            for _ in 0..2 {
                for known in value.chunks_exact(width) {
                    let dot: f64 = known.iter().zip(&row).map(|(a, b)| a * b).sum();
                    row.iter_mut().zip(known).for_each(|(a, b)| *a -= dot * b);
                }
            }
            let norm = row.iter().map(|a| a * a).sum::<f64>().sqrt();
            value.extend(row.iter().map(|a| a / norm));
        }
        Ok(Basis { terms, width, last, value })
    }

    pub(super) fn at(&self, s: usize, r: usize) -> f64 {
        self.value[s * self.width + r]
    }

    /// The first line of the window of line `k`: around it, and at the ends of what there is, lines 1 to the last, beside it.
    pub(super) fn low(&self, k: usize) -> usize {
        k.saturating_sub(self.width / 2).clamp(1, self.last + 1 - self.width)
    }

    /// Lines that bring as much as one independent value. The response at a line is the mean of its neighbours' with weights
    /// h_r = Σ_s φ_s(0) φ_s(r), Σ h = 1: its variance is Σ h² = h₀ of a line's, that of a mean over a band 1/N of it.
    pub(super) fn independent_lines(&self) -> f64 {
        let centre = self.width / 2;
        1.0 / (0..self.terms).map(|s| self.at(s, centre).powi(2)).sum::<f64>()
    }

    /// Takes the polynomial out of a series of `width` numbers.
    pub(super) fn project_out(&self, series: &mut [Complex64]) {
        for known in self.value.chunks_exact(self.width) {
            let dot: Complex64 = known.iter().zip(series.iter()).map(|(a, b)| b * a).sum();
            series.iter_mut().zip(known).for_each(|(x, a)| *x -= dot * a);
        }
    }

    /// The same in every lane.
    #[inline(always)]
    pub(super) fn project_out_lanes<S: Simd>(&self, simd: S, series: &mut [Lanes]) {
        for known in self.value.chunks(3 * self.width) {
            let row = |s: usize| &known[s * self.width..][..self.width];
            match known.len() / self.width {
                3 => project_out(simd, [row(0), row(1), row(2)], series),
                2 => project_out(simd, [row(0), row(1)], series),
                _ => project_out(simd, [row(0)], series),
            }
        }
    }
}

/// Takes N orthonormal rows out of a series, all of them at once.
#[inline(always)]
fn project_out<S: Simd, const N: usize>(simd: S, rows: [&[f64]; N], series: &mut [Lanes]) {
    for part in 0..LANES / S::F64_LANES {
        let mut dots = [[simd.splat_f64s(0.0); 2]; N];
        for (r, x) in series.iter().enumerate() {
            let [re, im] = [&x.re, &x.im].map(|x| S::as_simd_f64s(x).0[part]);
            for (dot, row) in dots.iter_mut().zip(rows) {
                let a = simd.splat_f64s(row[r]);
                *dot = [simd.mul_add_e_f64s(a, re, dot[0]), simd.mul_add_e_f64s(a, im, dot[1])];
            }
        }
        for (r, x) in series.iter_mut().enumerate() {
            for (x, k) in [(&mut x.re, 0), (&mut x.im, 1)] {
                let x = &mut S::as_mut_simd_f64s(x).0[part];
                for (dot, row) in dots.iter().zip(rows) {
                    *x = simd.negate_mul_add_e_f64s(simd.splat_f64s(row[r]), dot[k], *x);
                }
            }
        }
    }
}

/// Where the results of some lines go, one after the other.
pub(super) struct Chunk<'a> {
    pub(super) g: &'a mut [Complex64],
    pub(super) noise: &'a mut [Complex64],
    pub(super) gram_inverse: &'a mut [Complex64],
    pub(super) driver: &'a mut [Complex64],
    pub(super) left_out: &'a mut [f64],
}

impl Chunk<'_> {
    /// A line without a fit.
    pub(super) fn missing(&mut self, m: usize, q: usize) {
        next(&mut self.g, m * q).fill(NAN);
        next(&mut self.noise, m * m).fill(NAN);
        next(&mut self.gram_inverse, q * q).fill(NAN);
        next(&mut self.driver, q * q).fill(NAN);
        next(&mut self.left_out, 1).fill(f64::NAN);
    }
}

/// So many lines of a record of `len` samples in Hz.
pub(super) fn at_hz(lines: f64, (rate_hz, len): (f64, usize)) -> f64 {
    lines * rate_hz / len as f64
}

/// What `solve` finds of the response of `m` responders to `q` drivers at these lines, `task` of them at a time from the one that it is
/// given; and how well each was told without itself.
pub(super) fn fill(
    lines: &[usize],
    task: usize,
    (m, q): (usize, usize),
    rate_and_len: (f64, usize),
    basis: &Basis,
    degrees_of_freedom: f64,
    solve: impl Fn(usize, Chunk<'_>) + Sync,
) -> (Fitted, Vec<f64>) {
    let bins = lines.len();
    let room = |(rows, columns): (usize, usize)| {
        let shape = (bins, rows, columns);
        // First touched by all threads; the length is that of the shape.
        Array3::from_shape_vec(shape, rayon::iter::repeat_n(Complex64::ZERO, bins * rows * columns).collect()).unwrap_or_else(|_| Array3::zeros(shape))
    };
    let [mut g, mut noise, mut gram_inverse, mut driver] = [(m, q), (m, m), (q, q), (q, q)].map(room);
    let mut left_out = vec![0.0; bins];
    fn parts(all: &mut Array3<Complex64>, lines: usize) -> rayon::slice::ChunksMut<'_, Complex64> {
        let (_, rows, columns) = all.dim();
        all.as_slice_mut().unwrap_or_default().par_chunks_mut(lines * rows * columns)
    }
    let parts = (parts(&mut g, task), parts(&mut noise, task), parts(&mut gram_inverse, task), parts(&mut driver, task), left_out.par_chunks_mut(task));
    parts
        .into_par_iter()
        .enumerate()
        .for_each(|(k, (g, noise, gram_inverse, driver, left_out))| solve(k * task, Chunk { g, noise, gram_inverse, driver, left_out }));
    let frequency_hz = lines.iter().map(|&k| at_hz(k as f64, rate_and_len)).collect();
    let independent_spacing_hz = at_hz(basis.independent_lines(), rate_and_len);
    (Fitted { frequency_hz, g, noise, gram_inverse, driver, degrees_of_freedom, independent_spacing_hz }, left_out)
}

/// The next `count` numbers of a result, which are then no longer among the rest.
pub(super) fn next<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    rest.split_off_mut(..count).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parseval: densities over the lines of an odd length, none of them Nyquist's, hold the variance; an offset of a billion, of which samples keep
    /// all bits, adds nothing.
    #[test]
    fn lines_hold_the_variance_and_no_offset() {
        let (rate_hz, len) = (50.0, 151);
        let samples = |offset: f64| (0..len).map(|n| offset + ((1.3 * (n * n) as f64).sin() * 1024.0).round() / 1024.0).collect::<Vec<f64>>();
        let [plain, moved] = [0.0, 2.0_f64.powi(30)].map(|offset| Lines::new(rate_hz, &[&samples(offset)]));
        let mean = samples(0.0).iter().sum::<f64>() / len as f64;
        let variance = samples(0.0).iter().map(|v| (v - mean).powi(2)).sum::<f64>() / len as f64;
        let lines = plain.window(0, 1, len / 2);
        let held = lines.iter().map(|z| z.norm_sqr()).sum::<f64>() * rate_hz / len as f64;
        assert!((held / variance - 1.0).abs() < 1e-12, "{held} and {variance}");
        assert!(lines.iter().zip(moved.window(0, 1, len / 2)).all(|(a, b)| (a - b).norm() < 1e-12));
    }

    #[test]
    fn what_is_left_in_every_lane_is_what_is_left_of_a_series() {
        for terms in 1..=5 {
            let basis = Basis::new(6, terms, 1000).expect("lines enough");
            let number = |r: usize, l: usize| Complex64::new((1.3 * r as f64 + l as f64).sin(), (0.7 * (r * l) as f64).cos());
            let mut lanes: Vec<Lanes> = (0..basis.width).map(|r| Lanes::load(&(0..LANES).map(|l| number(r, l)).collect::<Vec<_>>())).collect();
            basis.project_out_lanes(pulp::Scalar, &mut lanes);
            for l in 0..LANES {
                let mut series: Vec<Complex64> = (0..basis.width).map(|r| number(r, l)).collect();
                basis.project_out(&mut series);
                let near = |(a, b): (&Lanes, &Complex64)| (Complex64::new(a.re[l], a.im[l]) - b).norm() < 1e-14;
                assert!(lanes.iter().zip(&series).all(near), "{terms} terms, lane {l}");
            }
        }
    }

    /// The weight of the middle in a least-squares parabola over 2n+1 points, h₀ = 3 (3n² + 3n − 1) / ((2n+1)(4n² + 4n − 3)) (Savitzky & Golay 1964);
    /// that of a mean is 1/(2n+1).
    #[test]
    fn the_middle_weighs_what_smoothing_by_a_parabola_gives_it() {
        for n in 2..40 {
            let (k, width) = (n as f64, 2.0 * n as f64 + 1.0);
            let middle = 3.0 * (3.0 * k * k + 3.0 * k - 1.0) / (width * (4.0 * k * k + 4.0 * k - 3.0));
            for (terms, lines) in [(1, width), (3, 1.0 / middle)] {
                let found = Basis::new(n, terms, 1000).expect("lines enough").independent_lines();
                assert!((found / lines - 1.0).abs() < 1e-12, "n = {n}, {terms} terms: {found} and {lines}");
            }
        }
    }
}
