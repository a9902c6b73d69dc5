//! The running sum of all cross-products, and the buffers of the segments in work.

use super::padded::Buffers;
use super::windowed::WindowedTransform;
use num_complex::Complex64;
use pulp::bytemuck::cast;
use pulp::{Arch, Simd, WithSimd};

/// Segments that are transformed before their products are formed: the sum, larger than the caches when channels are
/// many, is read and written once for all of them. A divisor of the block, so that no batch crosses its border.
const BATCH: usize = 8;

/// Bins whose products are formed for all pairs before the next: with [`BATCH`] segments they stay in a cache.
const TILE: usize = 64;

/// Vectors of a row that are worked on together: as many as the registers hold the sums of with [`GROUP`] pairs.
const UNROLL: usize = 2;

/// Pairs with the same first channel that are worked on together.
const GROUP: usize = 2;

/// Rows are filled up to a multiple of this number of bins, so that they are [`UNROLL`] whole vectors of any unit.
const LANES: usize = 8;

/// Σ over segments of the lower triangle, in index order.
#[derive(Clone)]
pub(super) struct Sum {
    channels: usize,
    bins: usize,
    padded: usize,
    /// `[pair][padded bin]`; of an earlier sum while `fresh`.
    lower: Vec<Complex64>,
    /// Nothing is in `lower` yet. To overwrite it costs less than to clear it and add.
    fresh: bool,
    /// Spectra of the segments not yet in the sum, `[segment][channel][padded bin]`.
    waiting: Vec<Complex64>,
    filled: usize,
    /// No transform so far lacked a number at 0 Hz.
    finite: bool,
    buffers: Buffers,
}

fn pairs(channels: usize) -> usize {
    channels * (channels + 1) / 2
}

impl Sum {
    pub(super) fn new(transform: &WindowedTransform, channels: usize) -> Self {
        let padded = transform.bins.next_multiple_of(LANES);
        Sum {
            channels,
            bins: transform.bins,
            padded,
            lower: vec![Complex64::default(); pairs(channels) * padded],
            fresh: true,
            waiting: vec![Complex64::default(); BATCH * channels * padded],
            filled: 0,
            finite: true,
            buffers: transform.padded.buffers(),
        }
    }

    /// Number of channels.
    pub(super) fn channels(&self) -> usize {
        self.channels
    }

    /// Memory of the largest buffers.
    pub(super) fn bytes(&self) -> usize {
        (self.lower.len() + self.waiting.len()) * size_of::<Complex64>()
    }

    /// Takes the next segment of every channel.
    pub(super) fn add<'a>(&mut self, transform: &WindowedTransform, segment: impl Iterator<Item = &'a [f64]>) {
        let at = self.filled * self.channels;
        for (row, samples) in self.waiting.chunks_exact_mut(self.padded).skip(at).zip(segment) {
            transform.spectrum(samples, &mut self.buffers, row);
            // A sum of all samples: any that is no finite number shows in it.
            self.finite &= row[0].re.is_finite();
        }
        self.filled += 1;
        if self.filled == BATCH {
            self.flush();
        }
    }

    /// Whether all samples since the last call were finite; `false` may also be a sum that was too large.
    pub(super) fn take_finite(&mut self) -> bool {
        std::mem::replace(&mut self.finite, true)
    }

    /// Adds the products of the waiting segments to the sum.
    pub(super) fn flush(&mut self) {
        let Sum { channels, padded, lower, fresh, waiting, filled, .. } = self;
        if *filled == 0 && *fresh {
            lower.fill(Complex64::default());
        }
        let spectra = &waiting[..*filled * *channels * *padded];
        Arch::new().dispatch(AddProducts { channels: *channels, padded: *padded, fresh: *fresh, spectra, lower });
        (*filled, *fresh) = (0, false);
    }

    /// Adds the lower triangle so far, pair by pair, to `total` (empty at first), multiplies all by `scale` (1 until the last), and starts
    /// again from zero.
    pub(super) fn drain_into(&mut self, transform: &WindowedTransform, scale: f64, total: &mut Vec<Complex64>) {
        self.flush();
        let rows = self.lower.chunks_exact(self.padded).map(|row| &row[..self.bins]);
        if total.is_empty() {
            total.reserve_exact(pairs(self.channels) * self.bins);
            rows.for_each(|row| transform.padded.append(row, scale, total));
        } else {
            total.chunks_exact_mut(self.bins).zip(rows).for_each(|(total, row)| transform.padded.add(row, scale, total));
        }
        self.fresh = true;
    }
}

/// The products of all pairs; a type and not a closure, so that it is compiled for the vector unit at hand.
struct AddProducts<'a> {
    channels: usize,
    padded: usize,
    /// `lower` is overwritten.
    fresh: bool,
    spectra: &'a [Complex64],
    lower: &'a mut [Complex64],
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // Without a vector unit a complex number is two of the real ones, and nothing is gained by reading it as such.
        if size_of::<S::c64s>() != size_of::<S::f64s>() {
            return self.one_by_one();
        }
        // Rows are whole numbers of these, so nothing is left over.
        let (spectra, _) = S::as_simd_c64s(self.spectra).0.as_chunks::<UNROLL>();
        let (lower, _) = S::as_mut_simd_c64s(self.lower).0.as_chunks_mut::<UNROLL>();
        // A product of lengths would be beyond 32 bits for the spectra of a long recording.
        let row = spectra.len() / (self.spectra.len() / self.padded).max(1);
        let tile = TILE * row / self.padded;
        let step = self.channels * row;
        for start in (0..row).step_by(tile.max(1)) {
            let mut pair = 0;
            for a in 0..self.channels {
                for b in (0..a + 1).step_by(GROUP) {
                    for at in start..row.min(start + tile) {
                        let (lower, x, y) = (&mut lower[pair * row + at..], a * row + at, b * row + at);
                        match a - b {
                            0 => add_products::<S, 1>(simd, lower, self.fresh, spectra, (x, y), row, step),
                            _ => add_products::<S, GROUP>(simd, lower, self.fresh, spectra, (x, y), row, step),
                        }
                    }
                    pair += (a + 1 - b).min(GROUP);
                }
            }
        }
    }
}

impl AddProducts<'_> {
    /// The same sums on a machine without vectors.
    fn one_by_one(self) {
        if self.fresh {
            self.lower.fill(Complex64::default());
        }
        for segment in self.spectra.chunks_exact(self.channels * self.padded) {
            let mut lower = self.lower.chunks_exact_mut(self.padded);
            for a in 0..self.channels {
                let xs = &segment[a * self.padded..][..self.padded];
                for (b, sum) in (0..a + 1).zip(&mut lower) {
                    let ys = &segment[b * self.padded..][..self.padded];
                    sum.iter_mut().zip(xs).zip(ys).for_each(|((sum, x), y)| *sum += x * y.conj());
                }
            }
        }
    }
}

/// The products of the vectors at `x` with `N` others, `row` apart from `y` on, over all segments, `step` apart; added
/// to `lower` at 0, `row`, 2 `row`, …, or in its place where that is `fresh`.
///
/// x y* = (XᵣYᵣ + XᵢYᵢ) + j(XᵢYᵣ − XᵣYᵢ): the four products are summed apart, two by two as they stand in memory
/// (`straight`: XᵣYᵣ, XᵢYᵢ; `crossed`: XᵢYᵣ, XᵣYᵢ), and brought together at the end.
#[inline(always)]
fn add_products<S: Simd, const N: usize>(
    simd: S,
    lower: &mut [[S::c64s; UNROLL]],
    fresh: bool,
    spectra: &[[S::c64s; UNROLL]],
    (x, y): (usize, usize),
    row: usize,
    step: usize,
) {
    let zero = simd.splat_f64s(0.0);
    let (mut straight, mut crossed) = ([[zero; UNROLL]; N], [[zero; UNROLL]; N]);
    for segment in spectra.chunks_exact(step) {
        let (xs, ys): (_, [_; N]) = (&segment[x], std::array::from_fn(|n| &segment[y + n * row]));
        for u in 0..UNROLL {
            let (x, swapped): (S::f64s, S::f64s) = (cast(xs[u]), cast(simd.swap_re_im_c64s(xs[u])));
            for n in 0..N {
                straight[n][u] = simd.mul_add_e_f64s(x, cast(ys[n][u]), straight[n][u]);
                crossed[n][u] = simd.mul_add_e_f64s(swapped, cast(ys[n][u]), crossed[n][u]);
            }
        }
    }
    let j = simd.splat_c64s(Complex64::new(0.0, 1.0));
    let one = simd.splat_c64s(Complex64::new(1.0, 0.0));
    for n in 0..N {
        for (u, lower) in lower[n * row].iter_mut().enumerate() {
            let (s, c): (S::c64s, S::c64s) = (cast(straight[n][u]), cast(crossed[n][u]));
            // Real parts: s + swapped s. Imaginary parts: c − swapped c. The selection is a product with 1 or 0.
            let real: S::f64s = simd.add_f64s(cast(s), cast(simd.swap_re_im_c64s(s)));
            let imaginary: S::f64s = simd.sub_f64s(cast(simd.swap_re_im_c64s(c)), cast(c));
            let before = if fresh { zero } else { cast(*lower) };
            let sum: S::f64s = simd.mul_add_e_f64s(real, cast(one), before);
            *lower = cast(simd.mul_add_e_f64s(imaginary, cast(j), sum));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn a_machine_without_vectors_sums_the_same_products() {
        let (channels, padded, segments) = (5, 2 * LANES, 7);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let spectra: Vec<Complex64> =
            (0..segments * channels * padded).map(|_| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))).collect();
        // What is left of an earlier sum must not show.
        let mut sums = [vec![Complex64::ONE; pairs(channels) * padded], vec![Complex64::I; pairs(channels) * padded]];
        let [vectors, scalars] = &mut sums;
        for fresh in [true, false] {
            Arch::new().dispatch(AddProducts { channels, padded, fresh, spectra: &spectra, lower: vectors });
            pulp::Scalar.vectorize(AddProducts { channels, padded, fresh, spectra: &spectra, lower: scalars });
        }
        // Identity: round-off of `segments` sums of products below 2, twice.
        let bound = 2.0 * 2.0 * segments as f64 * 4.0 * f64::EPSILON;
        assert!(vectors.iter().zip(scalars.iter()).all(|(v, s)| (v - s).norm() < bound));
        assert!(vectors.iter().any(|v| v.norm() > 0.1));
    }

    #[test]
    fn a_sum_starts_again_from_zero() {
        let transform = WindowedTransform::new(crate::Window::Hann.samples(16, false), crate::Detrend::Constant, 16);
        let (mut sum, mut total, mut nothing) = (Sum::new(&transform, 1), Vec::new(), Vec::new());
        sum.add(&transform, [&[1.0, 2.0, 0.0, -1.0, 3.0, 2.0, 1.0, 0.5, 1.0, 2.0, 0.0, -1.0, 3.0, 2.0, 1.0, 0.5][..]].into_iter());
        sum.drain_into(&transform, 1.0, &mut total);
        sum.drain_into(&transform, 1.0, &mut nothing);
        assert!(total.iter().any(|x| x.re > 0.0) && nothing.iter().all(|x| *x == Complex64::default()));
    }
}
