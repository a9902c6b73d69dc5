//! What says how far to trust derived estimates, while it is made.

use super::instrument::WEAK_INSTRUMENT;
use crate::filling::{Filling, scatter_real};
use crate::lanes::{Lanes, Reals, dot_conj, lower, map};

/// Coherences are ordinary, partial, multiple.
pub(super) struct Judged {
    pub(super) paper: [Filling<f64>; 3],
    pub(super) iv: [Filling<f64>; 3],
    pub(super) output_coherence: Filling<f64>,
    pub(super) input_coherence: Filling<f64>,
    pub(super) instrument_strength: Vec<f64>,
    pub(super) weak_instrument: Vec<bool>,
}

impl Judged {
    /// Nothing yet, of so many frequencies, outputs and inputs.
    pub(super) fn new(bins: usize, p: usize, q: usize) -> Self {
        let real = |rows: usize, columns: usize| Filling::new(bins, rows, columns, f64::NAN);
        Judged {
            paper: [real(p, q), real(p, q), real(1, p)],
            iv: [real(p, q), real(p, q), real(1, p)],
            output_coherence: real(1, p),
            input_coherence: real(1, q),
            instrument_strength: Vec::with_capacity(bins),
            weak_instrument: Vec::with_capacity(bins),
        }
    }

    fn arrays(&mut self) -> impl Iterator<Item = &mut Filling<f64>> {
        self.paper.iter_mut().chain(&mut self.iv).chain([&mut self.output_coherence, &mut self.input_coherence])
    }

    /// Coherences of the next `count` frequencies: the paper's, and those of the equation that was solved.
    #[inline(always)]
    pub(super) fn coherences(&mut self, count: usize) -> [[&mut [f64]; 3]; 2] {
        [&mut self.paper, &mut self.iv].map(|all| all.each_mut().map(|array| array.batch(count)))
    }

    /// The instrument's strength at the next frequency.
    pub(super) fn trust(&mut self, strength: f64) {
        self.instrument_strength.push(strength);
        self.weak_instrument.push(strength < WEAK_INSTRUMENT);
    }

    /// The first frequencies, which have no estimate by nature.
    pub(super) fn skip(&mut self, count: usize) {
        for array in self.arrays() {
            array.batch(count);
        }
        self.instrument_strength.resize(count, f64::NAN);
        self.weak_instrument.resize(count, false);
    }

    /// What is found of frequencies that follow.
    pub(super) fn append(&mut self, other: Judged) {
        let Judged { paper, iv, output_coherence, input_coherence, instrument_strength, weak_instrument } = other;
        let others = paper.into_iter().chain(iv).chain([output_coherence, input_coherence]);
        self.arrays().zip(others).for_each(|(own, other)| own.append(other));
        self.instrument_strength.extend(instrument_strength);
        self.weak_instrument.extend(weak_instrument);
    }

    /// Frequency `f`, if it is judged, has no estimate; what the references do to its channels stays.
    pub(super) fn erase(&mut self, f: usize) {
        if let Some(weak) = self.weak_instrument.get_mut(f) {
            (*weak, self.instrument_strength[f]) = (false, f64::NAN);
            self.paper.iter_mut().chain(&mut self.iv).for_each(|array| array.erase(f));
        }
    }
}

/// Ordinary, partial and multiple coherence of output `i` of `p` as a response, response · input spectrum, the diagonals
/// of that spectrum and of its inverse, and the noise imply them.
#[inline(always)]
pub(super) fn implied(
    (i, p): (usize, usize),
    (response, cross): (&[Lanes], &[Lanes]),
    spectrum: impl Fn(usize) -> Reals,
    inverse: &[Lanes],
    noise: &Reals,
    [ordinary, partial, multiple]: [&mut [f64]; 3],
) {
    let q = response.len();
    let explained = dot_conj(cross, response).re;
    let total = map(&explained, noise, |a, b| a + b);
    scatter_real(multiple, p, i, &map(&explained, &total, |a, b| a / b));
    for j in 0..q {
        let scale = map(&spectrum(j), &total, |a, b| a * b);
        scatter_real(ordinary, p * q, i * q + j, &map(&cross[j].norm_sqr(), &scale, |a, b| a / b));
        let spread = map(noise, &inverse[lower(j, j)].re, |a, b| a * b);
        scatter_real(partial, p * q, i * q + j, &map(&response[j].norm_sqr(), &spread, |a, b| a / (a + b)));
    }
}
