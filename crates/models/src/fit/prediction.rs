//! What an estimate would be on average if the model were right: the model seen through the window.

use super::LoopModel;
use crate::ParametricModel;
use ndof_linear::square;
use ndof_signal::Kernel;
use ndof_sysid::ResponseKind;
use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ops::Range;

/// How the finite window of a spectral estimate enters the comparison with a model.
///
/// A spectrum at *f* is on average the true one seen through the kernel |W(ν)|². Where that is forgotten, the window's
/// resolution is taken for damping.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Smoothing {
    /// Compare with the model itself.
    None,
    /// The input is flat within the window: smooth(H).
    #[default]
    Open,
    /// C = R T⁻¹ from a reference that is flat within the window: smooth(R) smooth(T)⁻¹.
    Derived(LoopModel),
    /// Direct estimate within a loop that such a reference drives: smooth(R Tᴴ) smooth(T Tᴴ)⁻¹.
    Direct(LoopModel),
}

/// A known compliance in series with every axis, 1/(k + b s): what is measured is C + (k + b s)⁻¹.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transducer {
    /// k (N/m, N m/rad).
    pub stiffness: f64,
    /// b (N s/m, N m s/rad).
    pub damping: f64,
}

/// Weights of a kernel below this share of its largest are left out.
const NEGLIGIBLE: f64 = 1e-7;

/// A model on the grid of an estimate, with derivatives.
pub(crate) struct Prediction<'a> {
    model: &'a dyn ParametricModel,
    smoothing: &'a Smoothing,
    transducer: Option<Transducer>,
    inverted: bool,
    /// s of each node, and of each bin the power of s that the kind asks for.
    nodes: Vec<Complex64>,
    loop_stiffness: Vec<Vec<Complex64>>,
    bins: Vec<Bin>,
}

struct Bin {
    factor: Complex64,
    parts: Vec<(usize, f64)>,
}

/// Numerator and denominator of an estimate at one node, each with its derivatives; no denominator is the identity.
struct Pair {
    numerator: Vec<Complex64>,
    denominator: Option<Vec<Complex64>>,
}

impl<'a> Prediction<'a> {
    /// Prepares the nodes. `kind` is not [`ResponseKind::Transfer`].
    pub(crate) fn new(
        model: &'a dyn ParametricModel,
        kind: ResponseKind,
        frequency_hz: &[f64],
        kernel: &Kernel,
        smoothing: &'a Smoothing,
        transducer: Option<Transducer>,
    ) -> Self {
        let between_bins = frequency_hz.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
        let mut offsets = coarser(quadrature(kernel), between_bins);
        if *smoothing == Smoothing::None || offsets.is_empty() {
            offsets = vec![(0.0, 1.0)];
        }
        // Seen at one point, R T⁻¹ and R Tᴴ (T Tᴴ)⁻¹ are C whatever closes the loop.
        let smoothing = if matches!(offsets[..], [(0.0, _)]) { &Smoothing::None } else { smoothing };
        let total: f64 = offsets.iter().map(|o| o.1).sum();
        // Nodes closer than this are one; without a kernel only the bins themselves say what is close.
        let between_nodes = offsets.windows(2).map(|w| w[1].0 - w[0].0).fold(f64::INFINITY, f64::min);
        let resolution = between_nodes.min(between_bins).min(1.0) * 1e-4;
        let mut index = BTreeMap::new();
        let mut nodes = Vec::new();
        let bins = frequency_hz
            .iter()
            .map(|&f| Bin {
                factor: match kind {
                    ResponseKind::Impedance => Complex64::new(0.0, TAU * f).inv(),
                    ResponseKind::Admittance => Complex64::new(0.0, TAU * f),
                    _ => Complex64::new(1.0, 0.0),
                },
                parts: offsets
                    .iter()
                    .map(|&(offset, weight)| {
                        let hz = f + offset;
                        let node = *index.entry((hz / resolution).round() as i64).or_insert_with(|| {
                            nodes.push(Complex64::new(0.0, TAU * hz));
                            nodes.len() - 1
                        });
                        (node, weight / total)
                    })
                    .collect(),
            })
            .collect();
        let loop_stiffness = match smoothing {
            Smoothing::Derived(own) | Smoothing::Direct(own) => nodes.iter().map(|&s| own.at(s)).collect(),
            _ => Vec::new(),
        };
        Prediction { model, smoothing, transducer, inverted: kind.is_effort_over_motion(), nodes, loop_stiffness, bins }
    }

    /// Elements of one matrix, N².
    pub(crate) fn elements(&self) -> usize {
        self.model.axes().len().pow(2)
    }

    /// The expected estimate, bin after bin (N × N each), and on request its derivatives, bin after bin and parameter
    /// after parameter; NaN where the model does not exist.
    pub(crate) fn evaluate(&self, theta: &[f64], derivatives: bool) -> (Vec<Complex64>, Vec<Complex64>) {
        let parts = self.by_bins(theta, derivatives, |_, value, slopes| (value, slopes));
        let (values, slopes): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        (values.concat(), slopes.concat())
    }

    /// What `take` makes of the same for a few bins at a time, in their order: derivatives of all of them would not stay in the cache.
    pub(crate) fn by_bins<T: Send>(&self, theta: &[f64], derivatives: bool, take: impl Fn(Range<usize>, Vec<Complex64>, Vec<Complex64>) -> T + Sync) -> Vec<T> {
        let (size, k) = (self.elements(), if derivatives { theta.len() } else { 0 });
        // A node that belongs to one bin need not be kept.
        let shared = self.bins.iter().any(|bin| bin.parts.len() > 1);
        let pairs: Vec<Pair> = (0..if shared { self.nodes.len() } else { 0 }).into_par_iter().map(|node| self.node(theta, node, k)).collect();
        let of_bins = |bins: Range<usize>| {
            let (mut values, mut slopes) = (Vec::with_capacity(size * bins.len()), Vec::with_capacity(size * k * bins.len()));
            for bin in &self.bins[bins.clone()] {
                let seen = match bin.parts[..] {
                    [(node, _)] if !shared => self.node(theta, node, k),
                    _ => smooth(&pairs, &bin.parts),
                };
                self.expect(seen, bin.factor, &mut values, &mut slopes);
            }
            take(bins, values, slopes)
        };
        let all = self.bins.len();
        (0..all.div_ceil(TOGETHER)).into_par_iter().map(|part| of_bins(part * TOGETHER..((part + 1) * TOGETHER).min(all))).collect()
    }

    /// Adds numerator over denominator, and the derivatives of that.
    fn expect(&self, seen: Pair, factor: Complex64, values: &mut Vec<Complex64>, slopes: &mut Vec<Complex64>) {
        let (n, size) = (self.model.axes().len(), self.elements());
        let Some(denominator) = seen.denominator else {
            values.extend(seen.numerator[..size].iter().map(|v| v * factor));
            slopes.extend(seen.numerator[size..].iter().map(|v| v * factor));
            return;
        };
        let (numerator, more) = (&seen.numerator, seen.numerator.len() - size);
        let Some(inverse) = square::inverse(&denominator[..size], n) else {
            let nan = Complex64::new(f64::NAN, 0.0);
            values.extend(std::iter::repeat_n(nan, size));
            slopes.extend(std::iter::repeat_n(nan, more));
            return;
        };
        let ratio = square::product(&numerator[..size], &inverse, n);
        // d(N U⁻¹) = (dN − N U⁻¹ dU) U⁻¹
        let back: Vec<Complex64> = ratio.iter().map(|v| -v).collect();
        let scaled: Vec<Complex64> = inverse.iter().map(|v| v * factor).collect();
        let (mut rest, first) = (vec![Complex64::default(); size], slopes.len());
        slopes.resize(first + more, Complex64::default());
        let changes = numerator[size..].chunks_exact(size).zip(denominator[size..].chunks_exact(size));
        for (out, (own, below)) in slopes[first..].chunks_exact_mut(size).zip(changes) {
            rest.copy_from_slice(own);
            square::add_product(&back, below, n, &mut rest);
            square::add_product(&rest, &scaled, n, out);
        }
        values.extend(ratio.iter().map(|v| v * factor));
    }

    fn node(&self, theta: &[f64], node: usize, k: usize) -> Pair {
        let s = self.nodes[node];
        let n = self.model.axes().len();
        let size = n * n;
        let nan = || vec![Complex64::new(f64::NAN, 0.0); size * (1 + k)];
        let mut all = vec![Complex64::default(); size * (1 + k)];
        let (stiffness, slope) = all.split_at_mut(size);
        let open = matches!(self.smoothing, Smoothing::None | Smoothing::Open);
        if self.inverted && open && self.transducer.is_none() {
            self.model.stiffness(theta, s, stiffness, (k > 0).then_some(slope));
            return Pair { numerator: all, denominator: None };
        }
        // Compliance, block by block: C = D⁻¹ + Z_f⁻¹ and dC = −D⁻¹ dD D⁻¹.
        let known = self.model.compliance(theta, s, stiffness, (k > 0).then_some(&mut *slope));
        if !known {
            self.model.stiffness(theta, s, stiffness, (k > 0).then_some(&mut *slope));
        }
        let Some(mut compliance) = (if known { Some(stiffness.to_vec()) } else { square::inverse(stiffness, n) }) else {
            return Pair { numerator: nan(), denominator: (!open).then(nan) };
        };
        let inverse = compliance.clone();
        if let Some(t) = self.transducer {
            (0..n).for_each(|i| compliance[i * n + i] += (t.stiffness + t.damping * s).inv());
        }
        if open && known {
            compliance.extend_from_slice(slope);
        } else if open {
            for d in slope.chunks_exact(size) {
                compliance.extend(square::sandwich(&inverse, d, &inverse, n).iter().map(|v| -v));
            }
        }
        if open {
            return Pair { numerator: if self.inverted { inverse_blocks(&compliance, n).unwrap_or_else(nan) } else { compliance }, denominator: None };
        }
        // T = (I + Z C)⁻¹, R = C T, so dT = −T Z dC T and dR = (I − C T Z) dC T; with dC = −D⁻¹ dD D⁻¹ both are products about dD, which is mostly nought.
        let loop_stiffness = &self.loop_stiffness[node];
        let mut opened = square::product(loop_stiffness, &compliance, n);
        opened.iter_mut().zip(square::identity::<Complex64>(n)).for_each(|(o, i)| *o += i);
        let Some(effort) = square::inverse(&opened, n) else {
            return Pair { numerator: nan(), denominator: Some(nan()) };
        };
        let about = if known { square::identity::<Complex64>(n).iter().map(|v| -v).collect() } else { inverse };
        let fed_back = square::product(&square::product(&effort, loop_stiffness, n), &about, n);
        let left: Vec<Complex64> = square::product(&compliance, &fed_back, n).iter().zip(&about).map(|(a, b)| a - b).collect();
        let right = if known { effort.clone() } else { square::product(&about, &effort, n) };
        let (mut motion, mut effort_blocks) = (square::product(&compliance, &effort, n), effort);
        for d in slope.chunks_exact(size) {
            if known {
                let driven = square::product(d, &right, n);
                motion.extend(square::product(&left, &driven, n));
                effort_blocks.extend(square::product(&fed_back, &driven, n));
            } else {
                motion.extend(square::sandwich(&left, d, &right, n));
                effort_blocks.extend(square::sandwich(&fed_back, d, &right, n));
            }
        }
        let (numerator, denominator) = if self.inverted { (effort_blocks, motion) } else { (motion, effort_blocks) };
        match self.smoothing {
            Smoothing::Direct(_) => {
                Pair { numerator: cross_blocks(&numerator, &denominator, n), denominator: Some(cross_blocks(&denominator, &denominator, n)) }
            }
            _ => Pair { numerator, denominator: Some(denominator) },
        }
    }
}

/// Bins whose derivatives are taken together.
const TOGETHER: usize = 8;

/// Numbers that are summed together.
const NEAR: usize = 512;

/// Weighted sums of nodes.
fn smooth(pairs: &[Pair], parts: &[(usize, f64)]) -> Pair {
    let sum = |part: &dyn Fn(&Pair) -> Option<&[Complex64]>| {
        let mut sum = vec![Complex64::default(); parts.first().and_then(|(node, _)| part(&pairs[*node])).map(<[_]>::len)?];
        // A piece of the sum at a time, which stays in the nearest cache.
        for (piece, sum) in sum.chunks_mut(NEAR).enumerate() {
            for &(node, weight) in parts {
                sum.iter_mut().zip(&part(&pairs[node]).unwrap_or(&[])[piece * NEAR..]).for_each(|(s, v)| *s += v * weight);
            }
        }
        Some(sum)
    };
    Pair { numerator: sum(&|pair| Some(&pair.numerator)).unwrap_or_default(), denominator: sum(&|pair| pair.denominator.as_deref()) }
}

/// The nodes of a kernel that matter.
///
/// |W|² is the transform of something no longer than two windows, so a coarse grid integrates it exactly; how coarse,
/// its moments tell. A grid is thinned to half of what keeps them, so that it is exact for any response that has died
/// away after three windows.
fn quadrature(kernel: &Kernel) -> Vec<(f64, f64)> {
    let nodes = kernel.offset_hz.len();
    let thinned = |stride: usize| -> Vec<(f64, f64)> {
        let first = (nodes / 2) % stride;
        (first..nodes).step_by(stride).map(|k| (kernel.offset_hz[k], kernel.weight[k])).collect()
    };
    let moments = |part: &[(f64, f64)]| {
        let sum: f64 = part.iter().map(|p| p.1).sum();
        (sum, part.iter().map(|p| p.1 * p.0 * p.0).sum::<f64>() / sum)
    };
    let (total, width) = moments(&thinned(1));
    let steps: Vec<f64> = kernel.offset_hz.windows(2).map(|w| w[1] - w[0]).collect();
    let uniform = steps.iter().all(|s| (s / steps[0] - 1.0).abs() < 1e-6);
    let keeps = |stride: usize| {
        let (sum, spread) = moments(&thinned(stride));
        uniform && (sum * stride as f64 / total - 1.0).abs() < 1e-4 && (spread / width - 1.0).abs() < 1e-2
    };
    let stride = [8, 4, 2].into_iter().find(|s| keeps(2 * s)).unwrap_or(1);
    let part = thinned(stride);
    let largest = part.iter().map(|p| p.1).fold(0.0, f64::max);
    part.into_iter().filter(|p| p.1 > NEGLIGIBLE * largest).collect()
}

/// Nodes that a kernel needs across: of a response that is smooth within it, sixteen tell all.
const ACROSS: f64 = 16.0;
/// Points of the polynomials that stand for the response between them.
const POINTS: isize = 6;

/// The nodes of a finer kernel moved to a grid of about [`ACROSS`], on which the nodes of bins `between_bins` apart fall together: the weights
/// that integrate the polynomial through the six points about each node of the kernel (product integration; Davis & Rabinowitz 1984).
fn coarser(fine: Vec<(f64, f64)>, between_bins: f64) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (fine.first(), fine.last()) else { return fine };
    let wide = (last.0 - first.0) / ACROSS;
    if wide <= 0.0 {
        return fine;
    }
    let step = if between_bins.is_finite() { between_bins / (between_bins / wide).ceil() } else { wide };
    // What is not at least halved is left alone.
    if fine.len() as f64 * step < 2.0 * (last.0 - first.0) {
        return fine;
    }
    let mut moved: BTreeMap<isize, f64> = BTreeMap::new();
    for (offset, weight) in fine {
        let at = offset / step;
        let lowest = at.floor() as isize - (POINTS / 2 - 1);
        for k in lowest..lowest + POINTS {
            let basis: f64 = (lowest..lowest + POINTS).filter(|j| *j != k).map(|j| (at - j as f64) / (k - j) as f64).product();
            *moved.entry(k).or_default() += weight * basis;
        }
    }
    moved.into_iter().map(|(k, weight)| (k as f64 * step, weight)).collect()
}

/// A⁻¹ and its derivatives −A⁻¹ dA A⁻¹, block by block.
fn inverse_blocks(blocks: &[Complex64], n: usize) -> Option<Vec<Complex64>> {
    let inverse = square::inverse(&blocks[..n * n], n)?;
    let mut out = inverse.clone();
    for d in blocks[n * n..].chunks_exact(n * n) {
        out.extend(square::product(&square::product(&inverse, d, n), &inverse, n).iter().map(|v| -v));
    }
    Some(out)
}

/// A Bᴴ and its derivatives dA Bᴴ + A dBᴴ, block by block.
fn cross_blocks(a: &[Complex64], b: &[Complex64], n: usize) -> Vec<Complex64> {
    let size = n * n;
    let adjoint = square::adjoint(&b[..size], n);
    let mut out = square::product(&a[..size], &adjoint, n);
    for (da, db) in a[size..].chunks_exact(size).zip(b[size..].chunks_exact(size)) {
        let second = square::product(&a[..size], &square::adjoint(db, n), n);
        out.extend(square::product(da, &adjoint, n).iter().zip(second).map(|(x, y)| x + y));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{arm, difference};
    use crate::{Held, Hold, InertiaDampingStiffness, InertiaDampingStiffnessModel, Sampling, Symmetry};

    fn matrices(scale: f64) -> InertiaDampingStiffness {
        let InertiaDampingStiffness { axes, inertia, damping, stiffness } = arm();
        InertiaDampingStiffness { axes, inertia: inertia * scale, damping: damping * scale, stiffness: stiffness * scale }
    }

    fn kernel() -> Kernel {
        Kernel { offset_hz: vec![-0.2, -0.1, 0.0, 0.1, 0.2], weight: vec![0.1, 0.2, 0.4, 0.2, 0.1] }
    }

    #[test]
    fn derivatives_agree_with_differences_for_every_kind_and_smoothing() {
        let model = InertiaDampingStiffnessModel::new(matrices(1.0).axes, Symmetry::Free);
        let theta = model.theta(&matrices(1.0));
        derivatives_agree(&model, &theta);
        derivatives_agree(&Held { model, sampling: Sampling { hold: Hold::Linear, sample_rate_hz: 20.0, derivatives: 0 } }, &theta);
    }

    fn derivatives_agree(model: &dyn ParametricModel, theta: &[f64]) {
        let robot = LoopModel { impedance: matrices(0.4) };
        for smoothing in [Smoothing::None, Smoothing::Open, Smoothing::Derived(robot.clone()), Smoothing::Direct(robot)] {
            for kind in [ResponseKind::Compliance, ResponseKind::DynamicStiffness, ResponseKind::Impedance, ResponseKind::Admittance] {
                for transducer in [None, Some(Transducer { stiffness: 2e4, damping: 30.0 })] {
                    let prediction = Prediction::new(model, kind, &[0.7, 2.1], &kernel(), &smoothing, transducer);
                    let (value, slopes) = prediction.evaluate(theta, true);
                    for (k, t) in theta.iter().enumerate() {
                        let differences = difference(theta, k, 1e-5 * t.abs(), |theta| prediction.evaluate(theta, false).0);
                        for (e, difference) in differences.into_iter().enumerate() {
                            let exact = slopes[(e / 4) * 4 * theta.len() + 4 * k + e % 4];
                            let size = value.iter().map(|v| v.norm()).fold(0.0, f64::max) / t.abs();
                            assert!((exact - difference).norm() < 1e-8 * size, "{smoothing:?} {kind:?} {k} {e}: {exact} {difference}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_thinned_kernel_smooths_as_the_whole_one_does() {
        let noise: Vec<f64> = (0..4096).map(|k| f64::from((k * 7919 + k * k * 31) % 1009)).collect();
        let spectra = ndof_signal::Welch::new(1024).spectra(500.0, &[&noise]).expect("long enough");
        let part = quadrature(spectra.kernel());
        assert!(part.len() * 4 <= spectra.kernel().weight.len(), "{}", part.len());
        // A resonance of 2.7 Hz and ζ = 0.25 seen through 2 s.
        let h = |hz: f64| {
            let s = Complex64::new(0.0, TAU * hz);
            (s * s + 8.5 * s + 290.0).inv()
        };
        let smooth = |nodes: &[(f64, f64)]| nodes.iter().map(|(o, w)| h(2.7 + o) * *w).sum::<Complex64>() / nodes.iter().map(|n| n.1).sum::<f64>();
        let all: Vec<(f64, f64)> = spectra.kernel().offset_hz.iter().copied().zip(spectra.kernel().weight.iter().copied()).collect();
        assert!((smooth(&part) / smooth(&all) - 1.0).norm() < 1e-5, "{}", smooth(&part) / smooth(&all));
    }

    #[test]
    fn a_kernel_of_many_nodes_smooths_as_well_on_sixteen() {
        // As wide and as fine as that of seven tapers of a minute; responses that ring for up to 10 s.
        let fine: Vec<(f64, f64)> = (-30..=30).map(|k| (0.0035 * f64::from(k), 1.0 / 61.0)).collect();
        let coarse = coarser(fine.clone(), 0.046);
        assert!(coarse.len() < 26, "{}", coarse.len());
        for (own_hz, decay_s) in [(0.3, 0.5), (2.0, 2.0), (5.0, 10.0)] {
            let h = |hz: f64| {
                let (s, w) = (Complex64::new(0.0, TAU * hz), TAU * own_hz);
                (s * s + s * (2.0 / decay_s) + w * w).inv()
            };
            let smooth = |nodes: &[(f64, f64)]| nodes.iter().map(|(o, w)| h(own_hz + o) * *w).sum::<Complex64>();
            assert!((smooth(&coarse) / smooth(&fine) - 1.0).norm() < 1e-3, "{own_hz} {decay_s}: {} {}", smooth(&coarse), smooth(&fine));
        }
        // What is as coarse already stays.
        let few = fine[..20].to_vec();
        assert_eq!(coarser(few.clone(), 0.0035), few);
    }

    #[test]
    fn without_smoothing_and_transducer_the_prediction_is_the_model() {
        let model = InertiaDampingStiffnessModel::new(matrices(1.0).axes, Symmetry::Symmetric);
        for kind in [ResponseKind::Compliance, ResponseKind::DynamicStiffness, ResponseKind::Impedance, ResponseKind::Admittance] {
            let expected = matrices(1.0).response(&[1.3], kind);
            let (value, _) = Prediction::new(&model, kind, &[1.3], &kernel(), &Smoothing::None, None).evaluate(&model.theta(&matrices(1.0)), false);
            assert!(value.iter().zip(&expected.value).all(|(a, b)| (a - b).norm() < 1e-13 * b.norm()));
        }
    }

    #[test]
    fn a_window_without_width_leaves_derived_and_direct_estimates_alone() {
        let model = InertiaDampingStiffnessModel::new(matrices(1.0).axes, Symmetry::Symmetric);
        let narrow = Kernel { offset_hz: vec![0.0], weight: vec![1.0] };
        let expected = matrices(1.0).response(&[1.3], ResponseKind::Compliance);
        for smoothing in [Smoothing::Derived(LoopModel { impedance: matrices(0.4) }), Smoothing::Direct(LoopModel { impedance: matrices(0.4) })] {
            let (value, _) = Prediction::new(&model, ResponseKind::Compliance, &[1.3], &narrow, &smoothing, None).evaluate(&model.theta(&matrices(1.0)), false);
            assert!(value.iter().zip(&expected.value).all(|(a, b)| (a - b).norm() < 1e-12 * b.norm()));
        }
    }
}
