//! Identities that hold for any cross-spectra, to round-off.

use ndarray::{Array2, Array3, Axis, Slice};
use ndof_signal::{Channel, CrossSpectra, Kernel, Quantity, Recording, Unit};
use ndof_sysid::{Direct, FrequencyResponse, Labels, LocalPolynomial, Ports, ResponseKind, SpectralMethod, derived, direct, estimate, ordered_coherence};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Identities: a few hundred operations on numbers of order one.
const ROUND_OFF: f64 = 1e-12;

/// Inputs removed one after the other from the spectra of all channels at one frequency.
///
/// S_ab·r! = S_ab·(r−1)! − S_ar·(r−1)! S_rb·(r−1)! / S_rr·(r−1)!, where r! stands for the linear effects of the first r
/// inputs. What the order gives to an input (its own part and what it shares with those after it) is not what it has
/// alone: that is the `partial` coherence of an estimate, the same in every order.
///
/// Bendat & Piersol, Random Data, 4th ed. 2010, section 7.3.
#[derive(Clone, Debug, PartialEq)]
struct Conditioned {
    /// γ²_{r y_i·(r−1)!} of the r-th input in order with output i given the inputs before it, `[p][q]`.
    partial_coherence: Array2<f64>,
    /// L_ri = S_{ir·(r−1)!} / S_{rr·(r−1)!} from the r-th conditioned input to each input (0..q) and output (q..q+p), `[q][q+p]`.
    l_systems: Array2<Complex64>,
    /// What all inputs leave unexplained of the outputs, S_yy·q!, `[p][p]`.
    residual: Array2<Complex64>,
}

/// Conditions `outputs` on `inputs`, one by one in the order given, at frequency index `f`.
///
/// `None` where an input is silent or a combination of those before it.
///
/// The product 1 − γ²_multiple = Π_r (1 − γ²_{r y·(r−1)!}) holds in any order.
fn conditioned(spectra: &CrossSpectra, f: usize, inputs: &[usize], outputs: &[usize]) -> Option<Conditioned> {
    let (q, p) = (inputs.len(), outputs.len());
    let channels: Vec<usize> = inputs.iter().chain(outputs).copied().collect();
    let mut s = spectra.block(f, &channels, &channels);
    let mut partial_coherence = Array2::zeros((p, q));
    let mut l_systems = Array2::zeros((q, q + p));
    for r in 0..q {
        let pivot = s[[r, r]].re;
        // Fourteen digits gone: what is left of this input is round-off.
        if pivot.is_nan() || pivot <= 1e-14 * spectra.power(f, channels[r]) {
            return None;
        }
        for i in 0..p {
            partial_coherence[[i, r]] = s[[q + i, r]].norm_sqr() / (pivot * s[[q + i, q + i]].re);
        }
        for b in 0..q + p {
            l_systems[[r, b]] = s[[b, r]] / pivot;
        }
        let (column, row) = (s.column(r).to_owned(), s.row(r).to_owned());
        for a in 0..q + p {
            for b in 0..q + p {
                s[[a, b]] -= column[a] * row[b] / pivot;
            }
        }
    }
    let residual = Array2::from_shape_fn((p, p), |(i, k)| s[[q + i, q + k]]);
    Some(Conditioned { partial_coherence, l_systems, residual })
}

impl Conditioned {
    /// The response by back substitution, H_j = L_jy − Σ_{i>j} L_ji H_i, `[p][q]` in the order of conditioning.
    fn response(&self) -> Array2<Complex64> {
        let (q, p) = (self.l_systems.nrows(), self.l_systems.ncols() - self.l_systems.nrows());
        let mut h = Array2::zeros((p, q));
        for j in (0..q).rev() {
            for i in 0..p {
                let later: Complex64 = (j + 1..q).map(|k| self.l_systems[[j, k]] * h[[i, k]]).sum();
                h[[i, j]] = self.l_systems[[j, q + i]] - later;
            }
        }
        h
    }

    /// Multiple coherence of each output, 1 − Π_r (1 − γ²_{r y·(r−1)!}).
    fn multiple_coherence(&self) -> Vec<f64> {
        self.partial_coherence.outer_iter().map(|row| 1.0 - row.iter().map(|g| 1.0 - g).product::<f64>()).collect()
    }
}

/// Spectra of `channels` channels that are random mixtures of each other, over `averages` draws, at `bins` frequencies.
fn random_spectra(channels: usize, bins: usize, averages: usize, seed: u64) -> CrossSpectra {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
    let mut lower = vec![Complex64::default(); channels * (channels + 1) / 2 * bins];
    for f in 0..bins {
        let mix = Array2::from_shape_fn((channels, channels), |_| draw());
        let z = mix.dot(&Array2::from_shape_fn((channels, averages), |_| draw()));
        for a in 0..channels {
            for b in 0..=a {
                let sum: Complex64 = (0..averages).map(|k| z[[a, k]] * z[[b, k]].conj()).sum();
                lower[(a * (a + 1) / 2 + b) * bins + f] = sum / averages as f64;
            }
        }
    }
    CrossSpectra::from_parts(channels, 100.0, (0..bins).map(|f| f as f64).collect(), lower, averages as f64, averages, 1.0, Kernel::default())
}

/// References, inputs, outputs in this order.
fn ports(r: usize, q: usize, p: usize) -> Ports {
    Ports { references: (0..r).collect(), inputs: (r..r + q).collect(), outputs: (r + q..r + q + p).collect() }
}

fn labels(ports: &Ports) -> Labels {
    Labels::numbered(ports, ResponseKind::Transfer)
}

#[test]
fn the_derived_estimate_is_r_over_t_and_the_instrumental_variable_estimate() {
    for n in 1..=6 {
        let (spectra, ports) = (random_spectra(3 * n, 8, 6 * n, 3), ports(n, n, n));
        let estimate = derived(&spectra, &ports, &labels(&ports)).expect("enough averages");
        let t = estimate.to_reference.t.inverse().expect("square");
        for f in 1..8 {
            let quotient = estimate.to_reference.r.at(f).dot(&t.at(f));
            let s_ur = spectra.block(f, &ports.inputs, &ports.references);
            let from_instrument = estimate.response.at(f).dot(&s_ur);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let c = estimate.response.value[[f, i, j]];
                let condition = t.at(f).iter().map(|v| v.norm_sqr()).sum::<f64>() * estimate.to_reference.t.at(f).iter().map(|v| v.norm_sqr()).sum::<f64>();
                assert!(
                    (quotient[[i, j]] - c).norm() < 1e-15 * condition.max(100.0) * c.norm().max(1.0),
                    "n = {n}, f = {f}: {} {c} {condition}",
                    quotient[[i, j]]
                );
                let s_yr = spectra.at(f, ports.outputs[i], ports.references[j]);
                assert!((from_instrument[[i, j]] - s_yr).norm() < 1e-13 * condition.max(10.0), "n = {n}, f = {f}");
            }
        }
    }
}

/// [1, −H] Σ [1, −H]ᴴ, what the references leave of outputs beyond what H makes of inputs.
fn left_over(response: &FrequencyResponse, f: usize) -> Array2<Complex64> {
    let sigma = response.uncertainty.as_ref().and_then(|u| u.unexplained.as_ref()).expect("what references leave").index_axis(Axis(0), f).to_owned();
    let (h, p) = (response.at(f), response.outputs.len());
    let a = Array2::from_shape_fn((p, sigma.nrows()), |(i, j)| if j >= p { -h[[i, j - p]] } else { Complex64::from(f64::from(u8::from(i == j))) });
    a.dot(&sigma).dot(&a.t().mapv(|v| v.conj()))
}

fn alike(a: &Array2<Complex64>, b: &Array2<Complex64>) -> bool {
    let size = a.iter().map(|v| v.norm()).fold(0.0, f64::max);
    a.iter().zip(b).all(|(a, b)| (a - b).norm() < 1e-11 * size)
}

/// By spectra and by local polynomials, the noise of the derived estimate is what [1, −C] leaves of Σ, less what the error of C took in; and it goes with the
/// response to other inputs and to derivatives.
#[test]
fn what_references_leave_gives_the_noise_of_any_response() {
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let channels = (0..6).map(|c| Channel::new(format!("c{c}"), Unit::si(Quantity::Effort, false), (0..400).map(|_| rng.random_range(-1.0..1.0)).collect()));
    let recording = Recording::new(100.0, channels.collect()).expect("a recording");
    let ports = ports(2, 2, 2);
    let method = SpectralMethod::LocalPolynomial(LocalPolynomial::default());
    let local = estimate(&[&recording], &ports, &labels(&ports), &method, Direct::H1).expect("an estimate").derived.expect("references");
    let spectra = derived(&random_spectra(6, 8, 30, 3), &ports, &labels(&ports)).expect("enough averages");
    for response in [local.response, spectra.response] {
        let w = Array3::from_shape_fn((response.len(), 2, 2), |(f, i, j)| Complex64::new(if i == j { 2.0 } else { 0.3 }, 0.1 * (f % 5) as f64));
        let real = ndarray::arr2(&[[1.0, 0.4], [-0.2, 3.0]]);
        let (parts, sums) = (response.to_parts(&w), response.to_sums(&real));
        let mut moved = response.clone();
        moved.differentiate(&[-1, -2], &[1, 0]);
        for f in 1..response.len() - 1 {
            let (u, own) = (response.uncertainty.as_ref().expect("errors"), left_over(&response, f));
            let sigma = u.unexplained.as_ref().expect("what references leave");
            let taken: Complex64 = (0..4).map(|e| u.input_inverse[[f, e / 2, e % 2]] * sigma[[f, 2 + e % 2, 2 + e / 2]]).sum();
            assert!(alike(&u.noise.index_axis(Axis(0), f).mapv(|v| v * (1.0 + taken.re)), &own), "{f}");
            assert!(alike(&left_over(&parts, f), &own) && alike(&left_over(&sums, f), &own), "{f}");
            let s = Complex64::new(0.0, std::f64::consts::TAU * response.frequency_hz[f]);
            let scaled = Array2::from_shape_fn((2, 2), |(i, j)| own[[i, j]] * [s.inv(), s.powi(-2)][i] * [s.inv(), s.powi(-2)][j].conj());
            assert!(alike(&left_over(&moved, f), &scaled), "{f}");
            assert!((moved.value[[f, 1, 0]] - response.value[[f, 1, 0]] / s.powi(3)).norm() < 1e-12 * moved.value[[f, 1, 0]].norm(), "{f}");
        }
        assert!(response.inverse().expect("square").uncertainty.expect("errors").unexplained.is_none());
    }
}

#[test]
fn inputs_that_are_their_own_references_make_derived_and_direct_the_same() {
    let full = random_spectra(6, 5, 30, 4);
    // Channels 0..3 as inputs and once more as references.
    let map = [0, 1, 2, 0, 1, 2, 3, 4, 5];
    let mut lower = Vec::new();
    for a in 0..9 {
        for b in 0..=a {
            lower.extend((0..5).map(|f| full.at(f, map[a], map[b])));
        }
    }
    let spectra = CrossSpectra::from_parts(9, 100.0, full.frequency_hz().to_vec(), lower, 30.0, 30, 1.0, Kernel::default());
    let ports = ports(3, 3, 3);
    let direct = direct(&spectra, &ports, &labels(&ports), Direct::H1).expect("estimate");
    let derived = derived(&spectra, &ports, &labels(&ports)).expect("estimate");
    for f in 1..5 {
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            assert!((direct.response.value[[f, i, j]] - derived.response.value[[f, i, j]]).norm() < 1e-11);
            assert!((direct.response.variance(f, i, j) / derived.response.variance(f, i, j) - 1.0).abs() < 1e-9);
            for coherence in [&derived.coherence_paper, &derived.coherence_iv] {
                assert!((direct.coherence.partial[[f, i, j]] - coherence.partial[[f, i, j]]).abs() < 1e-10);
                assert!((direct.coherence.ordinary[[f, i, j]] - coherence.ordinary[[f, i, j]]).abs() < 1e-10);
                assert!((direct.coherence.multiple[[f, i]] - coherence.multiple[[f, i]]).abs() < 1e-10);
            }
        }
    }
}

#[test]
fn hv_of_one_input_is_the_geometric_mean_of_h1_and_h2() {
    let (spectra, ports) = (random_spectra(2, 20, 9, 5), ports(0, 1, 1));
    let [h1, h2, hv] = [Direct::H1, Direct::H2, Direct::Hv].map(|m| direct(&spectra, &ports, &labels(&ports), m).expect("estimate"));
    for f in 1..20 {
        let (a, b, c) = (h1.response.value[[f, 0, 0]], h2.response.value[[f, 0, 0]], hv.response.value[[f, 0, 0]]);
        assert!((c.norm() / (a.norm() * b.norm()).sqrt() - 1.0).abs() < ROUND_OFF);
        assert!((c.arg() - a.arg()).abs() < ROUND_OFF);
        // |H1/H2| is the coherence (Bendat & Piersol 2010, section 6.1).
        assert!((a.norm() / b.norm() - h1.coherence.ordinary[[f, 0, 0]]).abs() < ROUND_OFF);
    }
}

#[test]
fn all_three_estimators_find_a_response_without_noise() {
    let (q, p, bins) = (3, 3, 4);
    let inputs = random_spectra(q, bins, 12, 6);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let h = Array2::from_shape_fn((p, q), |_| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)));
    let mut lower = Vec::new();
    let all: Vec<usize> = (0..q).collect();
    let full: Vec<Array2<Complex64>> = (0..bins)
        .map(|f| {
            let s = inputs.block(f, &all, &all);
            let mix = Array2::from_shape_fn((q + p, q), |(i, j)| if i < q { Complex64::from(f64::from(u8::from(i == j))) } else { h[[i - q, j]] });
            mix.dot(&s).dot(&mix.t().mapv(|v: Complex64| v.conj()))
        })
        .collect();
    for a in 0..q + p {
        for b in 0..=a {
            lower.extend(full.iter().map(|s| s[[a, b]]));
        }
    }
    let spectra = CrossSpectra::from_parts(q + p, 100.0, inputs.frequency_hz().to_vec(), lower, 12.0, 12, 1.0, Kernel::default());
    let ports = ports(0, q, p);
    for method in [Direct::H1, Direct::H2, Direct::Hv] {
        let estimate = direct(&spectra, &ports, &labels(&ports), method).expect("estimate");
        for f in 1..bins {
            for (i, j) in (0..p).flat_map(|i| (0..q).map(move |j| (i, j))) {
                // Hv finds a null vector: half the digits of the smallest eigenvalue's gap.
                assert!((estimate.response.value[[f, i, j]] - h[[i, j]]).norm() < 1e-10, "{method:?}");
                assert!((estimate.coherence.multiple[[f, i]] - 1.0).abs() < ROUND_OFF);
            }
        }
    }
}

#[test]
fn recursion_cholesky_and_schur_complement_agree() {
    for (q, p) in [(1, 1), (2, 2), (2, 3), (4, 3), (6, 6)] {
        let (spectra, ports) = (random_spectra(q + p, 6, 4 * (p + q), 8), ports(0, q, p));
        let estimate = direct(&spectra, &ports, &labels(&ports), Direct::H1).expect("estimate");
        let freedom = 4.0 * (p + q) as f64 - q as f64;
        let covariance = estimate.response.uncertainty.as_ref().expect("covariance");
        let noise = &covariance.noise;
        let in_order = ordered_coherence(&estimate.response, &covariance.input_inverse, &estimate.coherence.multiple);
        for f in 1..6 {
            let ordered = conditioned(&spectra, f, &ports.inputs, &ports.outputs).expect("independent inputs");
            let (h, multiple) = (ordered.response(), ordered.multiple_coherence());
            let condition = estimate.input_condition_number[f];
            let schur = &spectra.block(f, &ports.outputs, &ports.outputs) - &h.dot(&spectra.block(f, &ports.inputs, &ports.outputs));
            for i in 0..p {
                let power = spectra.power(f, ports.outputs[i]);
                assert!((multiple[i] - estimate.coherence.multiple[[f, i]]).abs() < ROUND_OFF * condition);
                for k in 0..p {
                    assert!((ordered.residual[[i, k]] - noise[[f, i, k]] * freedom).norm() < ROUND_OFF * power.max(1.0));
                    assert!((ordered.residual[[i, k]] - schur[[i, k]]).norm() < ROUND_OFF * power.max(1.0) * condition);
                }
                for j in 0..q {
                    assert!((in_order[[f, i, j]] - ordered.partial_coherence[[i, j]]).abs() < ROUND_OFF * condition);
                    assert!((h[[i, j]] - estimate.response.value[[f, i, j]]).norm() < ROUND_OFF * condition);
                    // Given all others means conditioned last.
                    let mut order = ports.inputs.clone();
                    order.swap(j, q - 1);
                    let last = conditioned(&spectra, f, &order, &ports.outputs).expect("independent inputs");
                    assert!((last.partial_coherence[[i, q - 1]] - estimate.coherence.partial[[f, i, j]]).abs() < ROUND_OFF * condition);
                    // Multiple coherence is never below the ordinary one, nor below the share that partial coherence adds.
                    assert!(estimate.coherence.multiple[[f, i]] + ROUND_OFF >= estimate.coherence.ordinary[[f, i, j]]);
                    assert!(estimate.coherence.multiple[[f, i]] + ROUND_OFF >= estimate.coherence.partial[[f, i, j]]);
                }
            }
        }
    }
}

#[test]
fn order_and_units_of_channels_change_the_result_as_they_must_and_no_coherence() {
    let (q, p, bins) = (3, 2, 9);
    let (n, full) = (2 * q + p, random_spectra(2 * q + p, bins, 40, 11));
    let ports = ports(q, q, p);
    let unit = [3.0, 1e-3, 1e4, 1e-6, 50.0, 7.0, 1e3, 1e-2];
    let mut lower = Vec::new();
    for a in 0..n {
        for b in 0..=a {
            lower.extend((0..bins).map(|f| full.at(f, a, b) * unit[a] * unit[b]));
        }
    }
    let scaled = CrossSpectra::from_parts(n, 100.0, full.frequency_hz().to_vec(), lower, 40.0, 40, 1.0, Kernel::default());
    let turned = Ports { references: vec![2, 0, 1], inputs: vec![5, 3, 4], outputs: vec![7, 6] };
    let [d1, d2] = [(&full, &ports), (&scaled, &turned)].map(|(s, p)| direct(s, p, &labels(p), Direct::H1).expect("estimate"));
    let [c1, c2] = [(&full, &ports), (&scaled, &turned)].map(|(s, p)| derived(s, p, &labels(p)).expect("estimate"));
    for f in 1..bins {
        let tolerance = 1e-13 * d1.input_condition_number[f] * 1e3;
        for (i, j) in (0..p).flat_map(|i| (0..q).map(move |j| (i, j))) {
            let (ti, tj) = (turned.outputs[i] - 2 * q, turned.inputs[j] - q);
            let factor = unit[turned.outputs[i]] / unit[turned.inputs[j]];
            for (one, other) in [(&d1.response, &d2.response), (&c1.response, &c2.response)] {
                assert!((one.value[[f, ti, tj]] * factor / other.value[[f, i, j]] - 1.0).norm() < tolerance);
                assert!((one.variance(f, ti, tj) * factor * factor / other.variance(f, i, j) - 1.0).abs() < tolerance);
            }
            for (one, other) in [(&d1.coherence, &d2.coherence), (&c1.coherence_paper, &c2.coherence_paper), (&c1.coherence_iv, &c2.coherence_iv)] {
                assert!((one.ordinary[[f, ti, tj]] - other.ordinary[[f, i, j]]).abs() < tolerance);
                assert!((one.partial[[f, ti, tj]] - other.partial[[f, i, j]]).abs() < tolerance);
                assert!((one.multiple[[f, ti]] - other.multiple[[f, i]]).abs() < tolerance);
            }
        }
        // A dozen power iterations: a few per cent.
        assert!((c1.instrument_strength[f] / c2.instrument_strength[f] - 1.0).abs() < 0.05);
    }
}

/// Σ, what the references leave of inputs and outputs, by conditioning; with A = [−C, 1] the noise is A Σ Aᴴ / (ν + tr((S^c)⁻¹ Σ_uu)).
#[test]
fn noise_of_a_derived_estimate_is_that_of_its_equation() {
    let (ports, freedom) = (ports(4, 3, 2), 36.0);
    let spectra = random_spectra(9, 3, 40, 12);
    let found = derived(&spectra, &ports, &labels(&ports)).expect("regular");
    let (inputs, outputs) = (Slice::from(..3), Slice::from(3..));
    let part = |of: &Array2<Complex64>, rows: Slice, columns: Slice| of.slice_axis(Axis(0), rows).slice_axis(Axis(1), columns).to_owned();
    for f in 1..3 {
        let channels: Vec<usize> = (4..9).collect();
        let left = conditioned(&spectra, f, &ports.references, &channels).expect("regular").residual;
        let caused = spectra.block(f, &channels, &channels) - &left;
        let inverse = ndof_linear::inverse(&part(&caused, inputs, inputs)).expect("regular");
        let c = part(&caused, outputs, inputs).dot(&inverse);
        // Channels stand in the order inputs, outputs.
        let a = ndarray::concatenate![Axis(1), c.mapv(|v| -v), Array2::eye(2)];
        let taken_in = inverse.dot(&part(&left, inputs, inputs)).diag().sum().re;
        let noise = a.dot(&left).dot(&a.t().mapv(|v| v.conj())) / Complex64::from(freedom + taken_in);
        let [r, t] = [outputs, inputs].map(|own| part(&left, own, own) / Complex64::from(freedom));
        for (response, want) in [(&found.response, noise), (&found.to_reference.r, r), (&found.to_reference.t, t)] {
            let found = response.uncertainty.as_ref().expect("with its errors").noise.index_axis(Axis(0), f).to_owned();
            assert!((&found - &want).iter().all(|error| error.norm() < 1e3 * ROUND_OFF * want.diag().sum().re), "{found} {want}");
        }
    }
}

#[test]
fn instruments_are_as_strong_as_for_the_input_that_they_reach_least() {
    // Each reference of unit power makes a part of one source: with ν = 40 − n, strength ν/n · caused/rest of the weakest, whether sources are inputs
    // or what inputs are mixed of: eigenvalues of N⁻¹ S^c are those of (M N Mᴴ)⁻¹ M S^c Mᴴ.
    let mixed = |j: usize, k: usize| Complex64::new(0.5, 0.3 * (1.0 + k as f64) - 0.2 * j as f64);
    for (n, mix) in (1..=5).flat_map(|n| [(n, 0.0), (n, 1.0)]) {
        let of_source = |j: usize, k: usize| if j == k { Complex64::ONE } else { mixed(j, k) * mix };
        let ports = ports(n, n, 1);
        let (channels, bins, own) = (2 * n + 1, 3, [9.0_f64, 4.0, 16.0, 7.0, 5.0]);
        let mut lower = vec![Complex64::default(); channels * (channels + 1) / 2 * bins];
        let mut set = |a: usize, b: usize, value: Complex64| lower[(a * (a + 1) / 2 + b) * bins..][..bins].fill(value);
        for j in 0..n {
            set(j, j, Complex64::ONE);
            (0..n).for_each(|k| set(n + j, k, of_source(j, k) * own[k].sqrt()));
            (0..=j).for_each(|i| set(n + j, n + i, (0..n).map(|k| of_source(j, k) * of_source(i, k).conj() * (own[k] + 1.0)).sum()));
        }
        set(2 * n, 2 * n, Complex64::ONE);
        let spectra = CrossSpectra::from_parts(channels, 100.0, vec![0.0, 1.0, 2.0], lower, 40.0, 40, 1.0, Kernel::default());
        let found = derived(&spectra, &ports, &labels(&ports)).expect("regular");
        let weakest = own[..n].iter().copied().fold(f64::INFINITY, f64::min);
        let expected = (40 - n) as f64 / n as f64 * weakest;
        // A dozen multiplications leave (4/5)²⁴ of the next eigenvalue's share, never above the truth by more than round-off.
        let strength = found.instrument_strength[1];
        assert!((-1e-9..0.02).contains(&(strength / expected - 1.0)), "{n} {mix}: {strength}, exact {expected}");
    }
}

#[test]
fn an_instrument_is_weak_for_a_mixture_that_no_row_of_ones_over_numbers_sees() {
    // Each of three references moves its input by one, the rest of which is 1 + 3 x xᴴ with x = (1, −2, 0)/√5, orthogonal to (1, 1/2, 1/3).
    let (ports, bins) = (ports(3, 3, 1), 2);
    let (mut lower, x) = (vec![Complex64::default(); 28 * bins], [0.2_f64.sqrt(), -0.8_f64.sqrt(), 0.0]);
    let mut set = |a: usize, b: usize, value: f64| lower[(a * (a + 1) / 2 + b) * bins..][..bins].fill(value.into());
    for j in 0..3 {
        set(j, j, 1.0);
        set(3 + j, j, 1.0);
        (0..=j).for_each(|i| set(3 + j, 3 + i, 3.0 * x[i] * x[j] + if i == j { 2.0 } else { 0.0 }));
    }
    set(6, 6, 1.0);
    let spectra = CrossSpectra::from_parts(7, 100.0, vec![0.0, 1.0], lower, 40.0, 40, 1.0, Kernel::default());
    let found = derived(&spectra, &ports, &labels(&ports)).expect("regular");
    assert!((found.instrument_strength[1] / (37.0 / 3.0 / 4.0) - 1.0).abs() < 1e-9, "{}", found.instrument_strength[1]);
}

#[test]
fn coherence_between_inputs_is_symmetric_and_one_with_itself() {
    for q in 1..=4 {
        let (spectra, ports) = (random_spectra(q + 1, 11, 5 * q, 9), ports(0, q, 1));
        let found = direct(&spectra, &ports, &labels(&ports), Direct::H1).expect("enough averages").input_coherence;
        for (f, i, j) in (1..11).flat_map(|f| (0..q).flat_map(move |i| (0..q).map(move |j| (f, i, j)))) {
            let expected = spectra.at(f, i, j).norm_sqr() / (spectra.power(f, i) * spectra.power(f, j));
            assert!((found[[f, i, j]] - expected).abs() < ROUND_OFF, "{q} inputs, {f}: {i} {j}");
        }
    }
}

#[test]
fn without_noise_no_coherence_is_above_one_and_no_power_below_zero() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let mut draw =
        |rows: usize, columns: usize| Array2::from_shape_fn((rows, columns), |_| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)));
    for n in 1..=3 {
        let (mix, h) = (draw(n, n), draw(n, n));
        let spectra = crate::draws::spectra(60, |_| {
            let r = draw(n, 12);
            let u = mix.dot(&r);
            crate::draws::stack(&[&r, &u, &h.dot(&u)])
        });
        let ports = ports(n, n, n);
        let (direct, derived) =
            (direct(&spectra, &ports, &labels(&ports), Direct::H1).expect("regular"), derived(&spectra, &ports, &labels(&ports)).expect("regular"));
        let [of_r, of_t] = [&derived.to_reference.r, &derived.to_reference.t];
        for (f, i) in (1..60).flat_map(|f| (0..n).map(move |i| (f, i))) {
            for response in [&direct.response, &derived.response, of_r, of_t] {
                assert!(response.uncertainty.as_ref().expect("noise").noise[[f, i, i]].re >= 0.0, "{n}: {f}");
            }
            let coherences = [&direct.coherence.multiple, &derived.coherence_paper.multiple, &derived.coherence_iv.multiple];
            let shares = [&derived.to_reference.output_coherence, &derived.to_reference.input_coherence];
            assert!(coherences.into_iter().chain(shares).all(|c| (1.0 - ROUND_OFF..=1.0).contains(&c[[f, i]])), "{n}: {f}");
        }
    }
}
