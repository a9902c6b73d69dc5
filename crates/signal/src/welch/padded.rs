//! The transform of a segment with zeros behind it, without computing with the zeros.

use crate::transform::{Fft, RealToComplex, complex_transform, forward_transform};
use crate::vectorized;
use num_complex::Complex64;
use pulp::{Simd, WithSimd};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Transform of `length` = P m real samples of which only the first m may be other than zero.
///
/// X(Pk + r) = Σ_{n<m} x(n) e^(−2πi rn/length) e^(−2πi kn/m): P transforms of m samples in place of one that is P times as
/// long. What is real makes half of them needless, X(length − j) = X(j)*: r = 0 is a real transform, 0 < r < P/2 a complex one, whose mirror
/// image r > P/2 is, and r = P/2 a complex one of half the length, of
///
/// z(n) = (x(n) − i x(n + m/2)) e^(−iπn/m), n < m/2: Z(l) = X(2Pl + P/2), the odd k being mirror images.
///
/// The results stand part after part, r = 0, 1, …; sums of products do not mind, and are put in
/// order at their end ([`append`](Self::append), [`add`](Self::add)).
pub(super) struct PaddedTransform {
    real: Arc<dyn RealToComplex<f64>>,
    whole: Option<Arc<dyn Fft<f64>>>,
    half: Option<Arc<dyn Fft<f64>>>,
    /// e^(−2πi rn/length) for each part but the first, one after the other.
    turns: Vec<Complex64>,
    /// Where the value of each bin stands; empty if P = 1, where all are in order.
    order: Vec<Place>,
}

/// What a transform needs besides its results.
#[derive(Clone)]
pub(super) struct Buffers {
    /// The m samples; lost by a transform.
    pub(super) input: Vec<f64>,
    turned: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

/// Shorter transforms cost more to call than they save.
const SHORTEST: usize = 128;

impl PaddedTransform {
    /// For segments of `samples`, padded to `length`.
    pub(super) fn new(samples: usize, length: usize) -> Self {
        let most = length / samples.max(SHORTEST);
        Self::of_parts(length, (1..=most).rev().find(|parts| divides(length, *parts)).unwrap_or(1))
    }

    fn of_parts(length: usize, parts: usize) -> Self {
        let m = length / parts;
        let whole_parts = (parts - 1) / 2;
        let has_half = parts.is_multiple_of(2);
        let turned = |r: usize| (0..m).map(move |n| Complex64::cis(-TAU * (r * n % length) as f64 / length as f64));
        let half_turns = turned(parts / 2).take(if has_half { m / 2 } else { 0 });
        PaddedTransform {
            real: forward_transform(m),
            whole: (whole_parts > 0).then(|| complex_transform(m)),
            half: has_half.then(|| complex_transform(m / 2)),
            turns: (1..=whole_parts).flat_map(turned).chain(half_turns).collect(),
            order: if parts == 1 { Vec::new() } else { (0..=length / 2).map(|bin| Place::new(bin, parts, m)).collect() },
        }
    }

    pub(super) fn buffers(&self) -> Buffers {
        let scratch = [&self.whole, &self.half].into_iter().flatten().map(|fft| fft.get_outofplace_scratch_len()).max().unwrap_or(0);
        Buffers {
            input: self.real.make_input_vec(),
            turned: vec![Complex64::default(); if self.turns.is_empty() { 0 } else { self.real.len() }],
            scratch: vec![Complex64::default(); scratch.max(self.real.get_scratch_len())],
        }
    }

    /// Transforms `buffers.input` into the length / 2 + 1 values of `row`, part after part.
    pub(super) fn process(&self, buffers: &mut Buffers, row: &mut [Complex64]) {
        let Buffers { input, turned, scratch } = buffers;
        let m = input.len();
        let (first, mut rest) = row.split_at_mut(m / 2 + 1);
        let mut turns = &self.turns[..];
        if let Some(whole) = &self.whole {
            while turns.len() >= m {
                let (part, after) = std::mem::take(&mut rest).split_at_mut(m);
                vectorized(Turned { samples: input, turns: &turns[..m], out: turned });
                whole.process_outofplace_with_scratch(turned, part, scratch);
                (rest, turns) = (after, &turns[m..]);
            }
        }
        if let Some(half) = &self.half {
            let (early, late) = input.split_at(m / 2);
            let halves = early.iter().zip(late).zip(turns).map(|((x, y), turn)| Complex64::new(*x, -*y) * turn);
            turned.iter_mut().zip(halves).for_each(|(t, z)| *t = z);
            half.process_outofplace_with_scratch(&mut turned[..m / 2], rest, scratch);
        }
        // Lengths are those of the plan, so the transform cannot refuse.
        let done = self.real.process_with_scratch(input, first, scratch);
        debug_assert!(done.is_ok());
    }

    /// Puts a row of sums of products x y*, times `scale`, in the order of their frequencies behind `all`.
    pub(super) fn append(&self, row: &[Complex64], scale: f64, all: &mut Vec<Complex64>) {
        if self.order.is_empty() {
            all.extend(row.iter().map(|value| value * scale));
        } else {
            all.extend(self.order.iter().map(|place| place.of(row) * scale));
        }
    }

    /// Adds it to `sums`, which are in that order, and multiplies the whole.
    pub(super) fn add(&self, row: &[Complex64], scale: f64, sums: &mut [Complex64]) {
        if self.order.is_empty() {
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum = (*sum + value) * scale);
        } else {
            sums.iter_mut().zip(&self.order).for_each(|(sum, place)| *sum = (*sum + place.of(row)) * scale);
        }
    }
}

/// Whether `length` has so many equal parts, and an even number of them a half: of an odd number of samples there is none.
fn divides(length: usize, parts: usize) -> bool {
    length.is_multiple_of(parts) && (parts % 2 == 1 || (length / parts).is_multiple_of(2))
}

/// Where a bin's value stands in a row, and whether as its mirror image.
struct Place {
    at: u32,
    mirrored: bool,
}

impl Place {
    /// Of `parts` transforms of `m` samples.
    fn new(bin: usize, parts: usize, m: usize) -> Self {
        let (k, r) = (bin / parts, bin % parts);
        let mirrored = 2 * r > parts || (2 * r == parts && k % 2 == 1);
        let (k, r) = if mirrored { (m - 1 - k, parts - r) } else { (k, r) };
        let at = match r {
            0 => k,
            r => m / 2 + 1 + (r - 1) * m + if 2 * r == parts { k / 2 } else { k },
        };
        Place { at: at as u32, mirrored }
    }

    fn of(&self, row: &[Complex64]) -> Complex64 {
        let value = row[self.at as usize];
        if self.mirrored { value.conj() } else { value }
    }
}

/// Samples, each turned by an angle; a type, so that it is compiled for the vector unit at hand.
struct Turned<'a> {
    samples: &'a [f64],
    turns: &'a [Complex64],
    out: &'a mut [Complex64],
}

impl WithSimd for Turned<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.out.iter_mut().zip(self.samples).zip(self.turns).for_each(|((o, x), turn)| *o = turn * x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the long transform of the same samples: every length to 64 in all its parts.
    #[test]
    fn parts_are_the_transform_of_the_padded_segment() {
        for length in 1..=64 {
            for parts in (1..=length).filter(|parts| divides(length, *parts)) {
                let m = length / parts;
                let x: Vec<f64> = (0..length).map(|n| if n < m { 1.0 + (n as f64 * 1.7).sin() } else { 0.0 }).collect();
                let long = forward_transform(length);
                let mut expected = long.make_output_vec();
                long.process(&mut x.clone(), &mut expected).expect("lengths of the plan");
                let transform = PaddedTransform::of_parts(length, parts);
                let mut buffers = transform.buffers();
                buffers.input.copy_from_slice(&x[..m]);
                let mut row = vec![Complex64::new(f64::NAN, f64::NAN); length / 2 + 1];
                transform.process(&mut buffers, &mut row);
                let mut found = Vec::new();
                transform.append(&row, 1.0, &mut found);
                let mut quarter = Vec::new();
                transform.append(&row, 0.25, &mut quarter);
                assert!(quarter.iter().zip(&found).all(|(part, whole)| 4.0 * part == *whole));
                let mut mean = found.clone();
                transform.add(&row, 0.5, &mut mean);
                for (bin, expected) in expected.iter().enumerate() {
                    // Round-off of at most `length` terms up to 2.
                    let bound = 4.0 * length as f64 * f64::EPSILON;
                    assert!((found[bin] - expected).norm() < bound, "bin {bin} of {length} in {parts}: {} and {expected}", found[bin]);
                    assert!((mean[bin] - expected).norm() < bound, "bin {bin} of {length} in {parts}, half of twice");
                }
            }
        }
    }

    #[test]
    fn a_segment_is_never_longer_than_a_part() {
        let part = |samples, length| PaddedTransform::new(samples, length).buffers().input.len();
        assert_eq!([part(2048, 8192), part(2049, 8192), part(8192, 8192), part(1000, 3000), part(1001, 3003)], [2048, 4096, 8192, 1000, 1001]);
        // Two odd parts have no half; a prime has no parts; parts get no shorter than is worth it.
        assert_eq!([part(1001, 2002), part(100, 8191), part(3, 8192)], [2002, 8191, 128]);
    }

    #[test]
    fn the_papers_setting_is_four_short_transforms() {
        let transform = PaddedTransform::new(2048, 8192);
        assert_eq!((transform.real.len(), transform.turns.len(), transform.order.len()), (2048, 2048 + 1024, 4097));
        assert_eq!(PaddedTransform::new(8192, 8192).order.len(), 0);
    }
}
