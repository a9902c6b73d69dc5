//! Slepian tapers: of all sequences of N samples, those with the most energy within ±W.

use crate::periodic::autocorrelation;
use std::f64::consts::{PI, TAU};

/// Discrete prolate spheroidal sequences with their concentrations.
#[derive(Clone, Debug, PartialEq)]
pub struct SlepianTapers {
    /// The tapers, most concentrated first, each of unit energy.
    pub tapers: Vec<Vec<f64>>,
    /// Share of each taper's energy within ±W.
    pub concentration: Vec<f64>,
}

/// Why there are no such tapers.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum SlepianError {
    /// The time-bandwidth product is out of range.
    #[error("time-bandwidth product {time_bandwidth} with {samples} samples; it must lie above 0 and below {} (usual: 2.5 to 4)", *samples as f64 / 2.0)]
    TimeBandwidth { time_bandwidth: f64, samples: usize },
    /// More tapers than samples, or none.
    #[error("{tapers} tapers of {samples} samples; ask for 1 to {samples} (usual: 2 NW − 1)")]
    Count { tapers: usize, samples: usize },
}

/// The first `count` Slepian tapers of `samples` samples for the time-bandwidth product NW = `time_bandwidth`.
///
/// Equal to `scipy.signal.windows.dpss(samples, time_bandwidth, count, return_ratios=True)`. They are the
/// eigenvectors of a tridiagonal matrix that commutes with the concentration problem (Slepian 1978, *Bell Syst.
/// Tech. J.* 57:1371); time and memory grow linearly with the number of samples.
///
/// # Errors
/// [`SlepianError`] if NW does not lie between 0 and N/2 or the number of tapers between 1 and N.
///
/// ```
/// let slepian = ndof_signal::slepian_tapers(1000, 4.0, 7)?;
/// let dot: f64 = slepian.tapers[0].iter().zip(&slepian.tapers[2]).map(|(a, b)| a * b).sum();
/// assert!(dot.abs() < 1e-12 && slepian.concentration[0] > 1.0 - 1e-9);
/// # Ok::<(), ndof_signal::SlepianError>(())
/// ```
pub fn slepian_tapers(samples: usize, time_bandwidth: f64, count: usize) -> Result<SlepianTapers, SlepianError> {
    if !(time_bandwidth > 0.0 && time_bandwidth < samples as f64 / 2.0) {
        return Err(SlepianError::TimeBandwidth { time_bandwidth, samples });
    }
    if count == 0 || count > samples {
        return Err(SlepianError::Count { tapers: count, samples });
    }
    let path = WeightedPath::new(samples, time_bandwidth);
    let tapers: Vec<Vec<f64>> = (0..count).map(|k| oriented(path.eigenvector(k), k)).collect();
    let concentration = tapers.iter().map(|taper| concentration(taper, time_bandwidth / samples as f64)).collect();
    Ok(SlepianTapers { tapers, concentration })
}

/// Slepian's tridiagonal matrix as (constant) − (Laplacian of a weighted path + potential).
///
/// Its entries are of size N²/4, its leading eigenvalues only about 2πNW apart: as it stands, round-off would cost
/// the tapers of a long record half of their digits. But its rows nearly sum to zero. With m = (N−1)/2 − n,
///
/// e_n = n(N−n)/2 (links n−1, n),  p_n = 2 m² sin²(πW),  T = (N²−1)/4 − (L_e + diag p),
///
/// and pivots of L_e + diag p − σ can be written without the large terms (`Factor`), so all digits are kept.
struct WeightedPath {
    link: Vec<f64>,
    potential: Vec<f64>,
}

/// The twisted factorisation of L_e + diag p − σ: pivots from the top and from the bottom, and what is left where
/// the two meet (Dhillon & Parlett 2004, *Linear Algebra Appl.* 387:1).
struct Factor {
    down: Vec<f64>,
    up: Vec<f64>,
    meeting: Vec<f64>,
}

impl WeightedPath {
    fn new(samples: usize, time_bandwidth: f64) -> Self {
        let n = samples as f64;
        let curvature = 2.0 * (PI * time_bandwidth / n).sin().powi(2);
        WeightedPath {
            link: (0..=samples).map(|k| k as f64 * (n - k as f64) / 2.0).collect(),
            potential: (0..samples).map(|k| curvature * ((n - 1.0) / 2.0 - k as f64).powi(2)).collect(),
        }
    }

    /// Number of eigenvalues below `shift`: the negative pivots (Sylvester).
    fn count_below(&self, shift: f64) -> usize {
        let mut carried = 0.0;
        let mut negative = 0;
        for (potential, link) in self.potential.iter().zip(&self.link[1..]) {
            let rest = potential - shift + carried;
            let pivot = not_zero(link + rest, *link);
            negative += usize::from(pivot < 0.0);
            carried = link * rest / pivot;
        }
        negative
    }

    fn factor(&self, shift: f64) -> Factor {
        let n = self.potential.len();
        let (mut down, mut up, mut meeting) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut carried = 0.0;
        for k in 0..n {
            let rest = self.potential[k] - shift + carried;
            meeting[k] = rest;
            down[k] = not_zero(self.link[k + 1] + rest, self.link[k + 1]);
            carried = self.link[k + 1] * rest / down[k];
        }
        carried = 0.0;
        for k in (0..n).rev() {
            meeting[k] += carried;
            let rest = self.potential[k] - shift + carried;
            up[k] = not_zero(self.link[k] + rest, self.link[k]);
            carried = self.link[k] * rest / up[k];
        }
        Factor { down, up, meeting }
    }

    /// The vector of unit length that solves all equations but one, and the Rayleigh correction of the shift.
    fn improve(&self, shift: f64) -> (Vec<f64>, f64) {
        let Factor { down, up, meeting } = self.factor(shift);
        let n = meeting.len();
        let twist = (0..n).fold(0, |best, k| if meeting[k].abs() < meeting[best].abs() { k } else { best });
        let mut v = vec![0.0; n];
        v[twist] = 1.0;
        for k in (0..twist).rev() {
            v[k] = self.link[k + 1] * v[k + 1] / down[k];
        }
        for k in twist + 1..n {
            v[k] = self.link[k] * v[k - 1] / up[k];
        }
        let energy: f64 = v.iter().map(|x| x * x).sum();
        let scale = energy.sqrt().recip();
        v.iter_mut().for_each(|x| *x *= scale);
        (v, meeting[twist] / energy)
    }

    /// The eigenvector of the k-th smallest eigenvalue: bisection until it stands alone, then Rayleigh steps that
    /// are not let out of its bracket.
    fn eigenvector(&self, k: usize) -> Vec<f64> {
        // No eigenvalue is below zero.
        let (mut low, mut high) = (0.0, 1.0);
        let (mut below_low, mut below_high) = (0, self.count_below(high));
        while below_high <= k {
            (low, below_low) = (high, below_high);
            high *= 2.0;
            below_high = self.count_below(high);
        }
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let below = self.count_below(middle);
            if below <= k {
                (low, below_low) = (middle, below);
            } else {
                (high, below_high) = (middle, below);
            }
            if (below_low, below_high) == (k, k + 1) {
                break;
            }
        }
        /// A shift right to this share is right to round-off one step later, which squares the error over the distance of the neighbours.
        const CLOSE: f64 = 1e-9;
        let mut shift = 0.5 * (low + high);
        let mut steps = 0;
        let mut close = false;
        loop {
            let (v, correction) = self.improve(shift);
            let middle = 0.5 * (low + high);
            // The last condition: a bracket without a number inside cannot be halved.
            if close || middle <= low || middle >= high {
                return v;
            }
            let next = shift + correction;
            steps += 1;
            // Rayleigh steps converge in three or four; where they leave the bracket or linger, it is halved.
            if next >= low && next <= high && steps % 8 != 0 {
                close = correction.abs() <= CLOSE * shift;
                shift = next;
                continue;
            }
            if self.count_below(middle) <= k {
                low = middle;
            } else {
                high = middle;
            }
            shift = 0.5 * (low + high);
        }
    }
}

fn not_zero(pivot: f64, link: f64) -> f64 {
    if pivot == 0.0 { f64::EPSILON * link.max(f64::MIN_POSITIVE) } else { pivot }
}

/// Sign and symmetry by convention (Percival & Walden 1993, p. 379): even tapers have a positive mean, odd ones
/// begin with a positive lobe.
fn oriented(mut v: Vec<f64>, k: usize) -> Vec<f64> {
    let n = v.len();
    let parity = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
    let largest = v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let first_lobe = v.iter().find(|x| x.abs() > 1e-3 * largest).copied().unwrap_or_default();
    let sign = if k.is_multiple_of(2) { v.iter().sum::<f64>() } else { first_lobe }.signum();
    for i in 0..n.div_ceil(2) {
        let half = 0.5 * sign * (v[i] + parity * v[n - 1 - i]);
        v[i] = half;
        v[n - 1 - i] = parity * half;
    }
    v
}

/// λ = 2W r(0) + 2 Σ_lag r(lag) sin(2πW lag)/(π lag), r the autocorrelation of the taper.
fn concentration(taper: &[f64], half_bandwidth: f64) -> f64 {
    let series = autocorrelation(taper, taper.len());
    let lags: f64 = (1..series.len()).map(|lag| series[lag] * (TAU * half_bandwidth * lag as f64).sin() / (PI * lag as f64)).sum();
    (2.0 * half_bandwidth * series[0] + 2.0 * lags).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of inner products of N terms: a small multiple of the machine epsilon times √N.
    const ORTHONORMAL: f64 = 1e-12;

    #[test]
    fn tapers_of_a_long_record_are_orthonormal_and_concentrated() {
        let SlepianTapers { tapers, concentration } = slepian_tapers(25_000, 4.0, 7).expect("valid");
        for i in 0..7 {
            for j in 0..=i {
                let dot: f64 = tapers[i].iter().zip(&tapers[j]).map(|(a, b)| a * b).sum();
                assert!((dot - f64::from(u8::from(i == j))).abs() < ORTHONORMAL, "{i}, {j}: {dot}");
            }
        }
        // Even ones have a positive mean, odd ones begin with a positive lobe: up to where they first fall.
        for (k, taper) in tapers.iter().enumerate() {
            let lobe = taper.windows(2).position(|pair| pair[1].abs() < pair[0].abs()).expect("a lobe");
            assert!(if k % 2 == 0 { taper.iter().sum::<f64>() } else { taper[lobe] } > 1e-3, "{k}");
        }
        // The concentrations depend on NW alone for long tapers: those of N = 2000 agree to O(1/N²).
        let short = slepian_tapers(2000, 4.0, 7).expect("valid").concentration;
        for (k, (a, b)) in concentration.iter().zip(&short).enumerate() {
            assert!((a - b).abs() < 1e-5, "{k}: {a} against {b}");
        }
    }

    #[test]
    fn every_taper_of_a_short_record_satisfies_its_equation() {
        let (n, w) = (12, 0.2);
        let tapers = slepian_tapers(n, w * n as f64, n).expect("valid").tapers;
        for v in &tapers {
            let apply = |i: usize| -> f64 {
                (0..n).map(|j| if i == j { 2.0 * w } else { (TAU * w * (i as f64 - j as f64)).sin() / (PI * (i as f64 - j as f64)) } * v[j]).sum()
            };
            let eigenvalue: f64 = (0..n).map(|i| v[i] * apply(i)).sum();
            for (i, x) in v.iter().enumerate() {
                assert!((apply(i) - eigenvalue * x).abs() < ORTHONORMAL, "{i}");
            }
        }
    }

    #[test]
    fn impossible_tapers_are_refused() {
        assert!(matches!(slepian_tapers(10, 5.0, 3), Err(SlepianError::TimeBandwidth { .. })));
        assert!(matches!(slepian_tapers(10, 0.0, 3), Err(SlepianError::TimeBandwidth { .. })));
        assert!(matches!(slepian_tapers(10, f64::NAN, 3), Err(SlepianError::TimeBandwidth { .. })));
        assert!(matches!(slepian_tapers(10, 2.0, 0), Err(SlepianError::Count { .. })));
        assert!(matches!(slepian_tapers(10, 2.0, 11), Err(SlepianError::Count { .. })));
        assert_eq!(slepian_tapers(1, 0.3, 1).expect("one sample").tapers, [[1.0]]);
    }

    #[test]
    fn tapers_of_every_bandwidth_are_the_eigenvectors_of_the_tridiagonal_matrix_in_order() {
        for n in [2, 3, 4, 5, 12, 41] {
            for share in [1e-6, 1e-3, 0.05, 0.25, 0.4, 0.499] {
                let tapers = slepian_tapers(n, share * n as f64, n).expect("valid").tapers;
                let at = |v: &[f64], i: isize| if i < 0 { 0.0 } else { v.get(i as usize).copied().unwrap_or(0.0) };
                let apply = |v: &[f64], i: usize| {
                    let (k, size) = (i as f64, n as f64);
                    let (below, above) = (k * (size - k) / 2.0, (k + 1.0) * (size - k - 1.0) / 2.0);
                    ((size - 1.0) / 2.0 - k).powi(2) * (TAU * share).cos() * v[i] + below * at(v, i as isize - 1) + above * at(v, i as isize + 1)
                };
                let mut before = f64::INFINITY;
                for (k, v) in tapers.iter().enumerate() {
                    let eigenvalue: f64 = (0..n).map(|i| v[i] * apply(v, i)).sum();
                    let worst = (0..n).map(|i| (apply(v, i) - eigenvalue * v[i]).abs()).fold(0.0, f64::max);
                    assert!(worst < 2.0 * f64::EPSILON * (n * n) as f64 && eigenvalue < before, "taper {k} of {n}, W = {share}: {worst:e}, {eigenvalue}");
                    before = eigenvalue;
                }
            }
        }
    }

    #[test]
    fn a_pivot_of_zero_does_not_end_the_count() {
        // 2 −1 0; −1 2 −1; 0 −1 2 has the eigenvalues 2 and 2 ± √2, and its first pivot is zero at 2.
        let path = WeightedPath { link: vec![0.0, 1.0, 1.0, 0.0], potential: vec![1.0, 0.0, 1.0] };
        assert_eq!([0.5, 0.6, 2.0, 2.1, 3.4, 3.5].map(|shift| path.count_below(shift)), [0, 1, 1, 2, 2, 3]);
        let (v, correction) = path.improve(2.0);
        assert!((v[0] + v[2]).abs() < 1e-12 && v[1].abs() < 1e-12 && correction.abs() < 1e-12, "{v:?} {correction}");
        // 2 −1 0; −1 2.3 −1; 0 −1 3 less 2 takes (−1, 0, 1) to (0, 0, 1).
        let (v, correction) = WeightedPath { link: path.link, potential: vec![1.0, 0.3, 2.0] }.improve(2.0);
        assert!((v[2] - 0.5_f64.sqrt()).abs() < 1e-12 && (v[0] + v[2]).abs() < 1e-12 && (correction - 0.5).abs() < 1e-12, "{v:?} {correction}");
    }
}
