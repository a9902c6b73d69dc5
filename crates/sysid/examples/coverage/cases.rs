//! The cases: a limb of known response, noise of known coherence, one judged entry at one frequency.

use ndarray::Array2;
use ndof_signal::{Channel, Multitaper, Periodic, Quantity, Recording, RecordingError, Unit, Welch};
use ndof_sysid::{Direct, FrequencyResponse, Labels, LocalPolynomial, LocalRational, Ports, ResponseKind, SpectralMethod, estimate};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

const RATE_HZ: f64 = 100.0;
/// On the grid of every method.
const JUDGED_HZ: f64 = 3.906_25;
const PERIOD: usize = 256;
/// Simulated before each recording begins.
const SETTLING: usize = 200;
/// Share of the force that nobody commanded, open loop with a reference.
const UNCOMMANDED: f64 = 0.5;

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    H1,
    H2,
    Derived,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Loop {
    Open,
    /// By a proportional-derivative controller that couples the axes.
    Held,
}

pub struct Case {
    pub size: usize,
    pub name: &'static str,
    pub estimator: Estimator,
    pub held: Loop,
    /// True partial coherence of the judged entry: of the commanded part of the force with the motion.
    pub coherence: f64,
    method: SpectralMethod,
    records: usize,
    samples: usize,
}

pub struct Outcome {
    /// % of gain intervals that hold the truth.
    pub gain: f64,
    pub phase: f64,
    /// |mean error| over gain, in %.
    pub bias: f64,
    pub freedom: f64,
    /// Of a held limb.
    pub direct: Option<DirectOutcome>,
}

/// What the direct estimate's gain intervals hold: the limit that theory gives it, and the limb.
pub struct DirectOutcome {
    pub limit: f64,
    pub limb: f64,
    pub bias: f64,
}

pub fn all() -> Vec<Case> {
    let mut cases = Vec::new();
    let welch = |count: usize| (SpectralMethod::Welch(Welch::new(PERIOD)), 1, PERIOD / 2 * (count + 1));
    let multitaper = |nw: f64, records: usize| (SpectralMethod::Multitaper(Multitaper { time_bandwidth: nw, ..Multitaper::default() }), records, 1024);
    let periodic =
        |experiments: usize, periods: usize| (SpectralMethod::Periodic(Periodic { period: PERIOD, discard: 1 }), experiments, PERIOD * (periods + 1));
    let polynomial = |records: usize| (SpectralMethod::LocalPolynomial(LocalPolynomial::default()), records, 512);
    let rational = || (SpectralMethod::LocalRational(LocalRational::default()), 1, 512);
    let mut add = |size: usize, name: &'static str, setup: (SpectralMethod, usize, usize), ways: &[(Estimator, Loop)], coherences: &[f64]| {
        for &(estimator, held) in ways {
            for &coherence in coherences {
                let (method, records, samples) = setup.clone();
                cases.push(Case { size, name, estimator, held, coherence, method, records, samples });
            }
        }
    };
    let both = [(Estimator::H1, Loop::Open), (Estimator::Derived, Loop::Held)];
    let reference = [(Estimator::Derived, Loop::Open)];
    let input_noise = [(Estimator::H2, Loop::Open)];
    let every = [0.5, 0.7, 0.9, 0.99];
    add(2, "welch", welch(25), &both, &every);
    add(2, "welch, few", welch(5), &both, &every);
    add(2, "multitaper", multitaper(4.0, 3), &both, &every);
    add(2, "multitaper, few", multitaper(3.0, 1), &both, &every);
    add(2, "periodic", periodic(12, 2), &both, &every);
    add(2, "periodic, few", periodic(5, 2), &both, &every);
    add(2, "local polynomial", polynomial(1), &both, &every);
    add(2, "local rational", rational(), &both, &[0.5, 0.9]);
    for (name, setup) in [("welch", welch(25)), ("multitaper", multitaper(4.0, 3)), ("periodic", periodic(12, 2)), ("local polynomial", polynomial(1))] {
        add(2, name, setup, &reference, &[0.5, 0.9]);
    }
    add(2, "welch", welch(25), &input_noise, &every);
    add(2, "welch, few", welch(5), &input_noise, &every);
    add(1, "welch", welch(25), &input_noise, &[0.5, 0.9]);
    add(1, "welch, few", welch(5), &both, &[0.5, 0.9]);
    add(1, "local rational", rational(), &both, &[0.5, 0.99]);
    add(3, "welch", welch(25), &both, &[0.5, 0.9]);
    add(6, "welch", welch(25), &both, &[0.5, 0.9]);
    add(6, "multitaper", multitaper(4.0, 3), &both, &[0.5, 0.9]);
    cases
}

/// Axes that are second-order filters of their own, moved by mixtures of all forces:
/// y_i(k) = a₁ y_i(k−1) + a₂ y_i(k−2) + Σ_j b_ij u_j(k).
struct Limb {
    poles: Vec<(f64, f64)>,
    b: Array2<f64>,
}

impl Limb {
    fn new(size: usize) -> Self {
        let poles: Vec<(f64, f64)> = (0..size)
            .map(|i| {
                let decay = (-TAU * (6.0 + i as f64) / RATE_HZ).exp();
                (2.0 * decay, -decay * decay)
            })
            .collect();
        let b = Array2::from_shape_fn((size, size), |(i, j)| {
            let (a1, a2) = poles[i];
            (1.0 - a1 - a2) * if i == j { 1.0 } else { 0.4 / (1.0 + i.abs_diff(j) as f64) }
        });
        Limb { poles, b }
    }

    fn at(&self, frequency_hz: f64) -> Array2<Complex64> {
        let z = Complex64::from_polar(1.0, -TAU * frequency_hz / RATE_HZ);
        Array2::from_shape_fn(self.b.dim(), |(i, j)| self.b[[i, j]] / (1.0 - self.poles[i].0 * z - self.poles[i].1 * z * z))
    }
}

/// Stiffness and damping of the hold between two axes; the force reacts to the motion one sample later.
const STIFFNESS: f64 = 0.6;
const DAMPING: f64 = 1.5;

fn coupling(i: usize, j: usize, size: usize) -> f64 {
    if i == j { 1.0 } else { 0.3 / size as f64 }
}

fn hold(size: usize, frequency_hz: f64) -> Array2<Complex64> {
    let z = Complex64::from_polar(1.0, -TAU * frequency_hz / RATE_HZ);
    Array2::from_shape_fn((size, size), |(i, j)| z * (STIFFNESS + DAMPING * (1.0 - z)) * coupling(i, j, size))
}

fn hermitian(a: &Array2<Complex64>) -> Array2<Complex64> {
    a.t().mapv(|v| v.conj())
}

fn inverse(a: &Array2<Complex64>) -> Option<Array2<Complex64>> {
    let names = vec![String::new(); a.nrows()];
    let whole = FrequencyResponse {
        frequency_hz: vec![JUDGED_HZ],
        inputs: names.clone(),
        outputs: names,
        kind: ResponseKind::Transfer,
        value: a.clone().insert_axis(ndarray::Axis(0)),
        uncertainty: None,
    };
    whole.inverse().ok().map(|inverse| inverse.at(0))
}

/// What is known of a case at the judged frequency.
struct Truth {
    limb: Complex64,
    /// Standard deviation of the noise: of the limb's own force, or (H2) of the force sensor.
    noise: f64,
    /// Limit of the direct estimate.
    direct: Complex64,
}

impl Case {
    fn truth(&self) -> Option<Truth> {
        let (n, c) = (self.size, Limb::new(self.size).at(JUDGED_HZ));
        let identity = Array2::from_diag_elem(n, Complex64::from(1.0));
        let z = if self.held == Loop::Held { hold(n, JUDGED_HZ) } else { Array2::zeros((n, n)) };
        let s = inverse(&(&identity + &z.dot(&c)))?;
        let commanded = inverse(&s.dot(&hermitian(&s)))?[[0, 0]].re;
        let own = c.dot(&hermitian(&c))[[0, 0]].re;
        // γ² = |C|²/[S⁻¹] over itself plus noise, for the unit power of the command.
        let noise = c[[0, 0]].norm_sqr() / commanded * (1.0 - self.coherence) / self.coherence / own;
        let back = s.dot(&z).dot(&c);
        // The mean over the periods keeps what is commanded and averages what is not.
        let periods = if matches!(self.method, SpectralMethod::Periodic(_)) { self.samples / PERIOD - 1 } else { 1 };
        let w = Complex64::from(noise / periods as f64);
        let s_uu = s.dot(&hermitian(&s)) + back.dot(&hermitian(&back)) * w;
        let s_yu = c.dot(&s).dot(&hermitian(&s)) - (&c - &c.dot(&back)).dot(&hermitian(&back)) * w;
        Some(Truth { limb: c[[0, 0]], noise: noise.sqrt(), direct: s_yu.dot(&inverse(&s_uu)?)[[0, 0]] })
    }

    fn record(&self, rng: &mut ChaCha8Rng, noise: f64) -> Result<Recording, RecordingError> {
        let (n, limb) = (self.size, Limb::new(self.size));
        let mut draw = || -> f64 { rng.sample(StandardNormal) };
        let periodic = matches!(self.method, SpectralMethod::Periodic(_));
        let repeated: Vec<Vec<f64>> = if periodic { (0..n).map(|_| (0..PERIOD).map(|_| draw()).collect()).collect() } else { Vec::new() };
        let uncommanded = if self.estimator == Estimator::Derived && self.held == Loop::Open { UNCOMMANDED } else { 0.0 };
        let sensor = self.estimator == Estimator::H2;
        let mut state = vec![[0.0; 2]; n];
        let mut columns = vec![Vec::new(); 3 * n];
        for k in 0..SETTLING + self.samples {
            let command: Vec<f64> = (0..n).map(|i| if periodic { repeated[i][k % PERIOD] } else { draw() }).collect();
            let force: Vec<f64> = (0..n)
                .map(|i| {
                    let pull = |j: usize| coupling(i, j, n) * (STIFFNESS * state[j][0] + DAMPING * (state[j][0] - state[j][1]));
                    let held: f64 = if self.held == Loop::Held { (0..n).map(pull).sum() } else { 0.0 };
                    command[i] - held + if uncommanded > 0.0 { uncommanded * draw() } else { 0.0 }
                })
                .collect();
            let disturbance: Vec<f64> = (0..n).map(|_| noise * draw()).collect();
            let own = if sensor { 0.0 } else { 1.0 };
            let next: Vec<f64> = (0..n)
                .map(|i| {
                    let (a1, a2) = limb.poles[i];
                    a1 * state[i][0] + a2 * state[i][1] + (0..n).map(|j| limb.b[[i, j]] * (force[j] + own * disturbance[j])).sum::<f64>()
                })
                .collect();
            for i in 0..n {
                state[i] = [next[i], state[i][0]];
                if k >= SETTLING {
                    columns[i].push(command[i]);
                    columns[n + i].push(force[i] + (1.0 - own) * disturbance[i]);
                    columns[2 * n + i].push(next[i]);
                }
            }
        }
        let channel = |(c, samples): (usize, Vec<f64>)| {
            let quantity = if c >= 2 * n { Quantity::Displacement } else { Quantity::Effort };
            Channel::new(format!("{}_{}", ["cmd", "force", "pos"][c / n], c % n), Unit::si(quantity, false), samples)
        };
        Recording::new(RATE_HZ, columns.into_iter().enumerate().map(channel).collect())
    }

    /// Simulates and estimates `count` times; every `row` has random numbers of its own. Nothing is counted of an experiment
    /// that cannot be estimated.
    pub fn run(&self, row: u64, count: u64) -> Outcome {
        let nothing = Outcome { gain: f64::NAN, phase: f64::NAN, bias: f64::NAN, freedom: f64::NAN, direct: None };
        let Some(truth) = self.truth() else { return nothing };
        let n = self.size;
        let range = |from: usize| (from..from + n).collect::<Vec<usize>>();
        let references = if self.estimator == Estimator::Derived { range(0) } else { Vec::new() };
        let ports = Ports { references, inputs: range(n), outputs: range(2 * n) };
        let kind = if self.estimator == Estimator::H2 { Direct::H2 } else { Direct::H1 };
        let judged: Vec<[Judged; 2]> = (0..count)
            .into_par_iter()
            .filter_map(|k| {
                let mut rng = ChaCha8Rng::seed_from_u64(1);
                rng.set_stream(row * count + k);
                let records: Result<Vec<Recording>, RecordingError> = (0..self.records).map(|_| self.record(&mut rng, truth.noise)).collect();
                let records = records.ok()?;
                let trials: Vec<&Recording> = records.iter().collect();
                let found = estimate(&trials, &ports, &Labels::of(&records[0], &ports), &self.method, kind).ok()?;
                let direct = judge(&found.direct.response, truth.direct)?;
                match found.derived {
                    Some(derived) => Some([judge(&derived.response, truth.limb)?, direct]),
                    None => Some([judge(&found.direct.response, truth.limb)?, direct]),
                }
            })
            .collect();
        let all = judged.len() as f64;
        let percent = |of: &dyn Fn(&[Judged; 2]) -> bool| 100.0 * judged.iter().filter(|j| of(j)).count() as f64 / all;
        let bias = |which: usize| 100.0 * (judged.iter().map(|j| j[which].value).sum::<Complex64>() / all - truth.limb).norm() / truth.limb.norm();
        Outcome {
            gain: percent(&|j| j[0].gain),
            phase: percent(&|j| j[0].phase),
            bias: bias(0),
            freedom: judged.first().map_or(f64::NAN, |j| j[0].freedom),
            direct: (self.held == Loop::Held).then(|| DirectOutcome {
                limit: percent(&|j| j[1].gain),
                limb: percent(&|j| (j[1].interval[0]..=j[1].interval[1]).contains(&truth.limb.norm())),
                bias: bias(1),
            }),
        }
    }
}

struct Judged {
    value: Complex64,
    gain: bool,
    phase: bool,
    interval: [f64; 2],
    freedom: f64,
}

fn judge(response: &FrequencyResponse, truth: Complex64) -> Option<Judged> {
    let f = response.frequency_hz.iter().position(|f| (f - JUDGED_HZ).abs() < 1e-9)?;
    let entry = response.gain_phase(0, 0, 0.95)[f];
    let value = response.value[[f, 0, 0]];
    Some(Judged {
        value,
        gain: (entry.gain_interval[0]..=entry.gain_interval[1]).contains(&truth.norm()),
        phase: entry.phase_interval_rad.is_none_or(|[low, high]| ((truth.arg() - (low + high) / 2.0 + PI).rem_euclid(TAU) - PI).abs() <= (high - low) / 2.0),
        interval: entry.gain_interval,
        freedom: response.uncertainty.as_ref()?.degrees_of_freedom,
    })
}
