//! Every model from data that another integrator made: how often its intervals hold the truth.
//!
//! The oracle integrates each law from its equation, written here once more and apart from the models, by Heun's rule with
//! sixteen steps a sample.

use ndof_models::Axis;
use ndof_models::time::{Disturbance, FreeRunFit, Law, Mechanism, Noise, TimeTrial, laws};
use ndof_signal::{FilteredNoise, Passband, SosFilter};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Sample rate and usual length of a record.
pub const RATE_HZ: f64 = 200.0;
pub const SECONDS: f64 = 15.0;
const FINER: usize = 16;
/// Mass (kg), damping (N s/m) and stiffness (N/m) of the limb.
const BASE: [f64; 3] = [2.0, 14.0, 300.0];
/// White noise of the position channel (m).
const NOISE_M: f64 = 1e-4;
/// Slow noise below 2 Hz: wander of the position channel (m), or force that the limb makes by itself (N).
const WANDER_M: f64 = 1.5e-4;
const LIMB_NOISE_N: f64 = 0.05;

/// Where the slow noise enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slow {
    /// The measured position: what a fit of the simulation's error takes noise for.
    Position,
    /// The force; through a nonlinear limb it is no longer stationary where it is measured.
    Force,
}
/// What the fit takes the noise for: functions that reach far enough for a hum below 2 Hz on a white floor at 200 Hz.
pub const NOISE: Noise = Noise::Laguerre { order: 16, memory: 5 };

/// What the oracle's law sees at one instant: time, x, v, the acceleration up to then, x and v one delay ago, force, force one
/// delay ago.
pub struct Now {
    t: f64,
    x: f64,
    v: f64,
    a: f64,
    late_x: f64,
    late_v: f64,
    force: f64,
    late_force: f64,
}

/// The oracle's law: its resisting force, and its states moved on by one small step.
type Oracle = fn(&[f64], &Now, &mut [f64], f64) -> f64;

/// A model to recover.
pub struct Case {
    /// The fitted law.
    pub law: Arc<dyn Law>,
    /// True parameters of the law.
    pub truth: Vec<f64>,
    /// Names of thresholds, whose intervals are profiled.
    pub thresholds: &'static [&'static str],
    oracle: Oracle,
    states: usize,
    delay: Option<usize>,
}

fn case(law: impl Law + 'static, truth: &[f64], thresholds: &'static [&'static str], states: usize, oracle: Oracle) -> Case {
    let delay = law.delay();
    Case { law: Arc::new(law), truth: truth.to_vec(), thresholds, oracle, states, delay }
}

impl Now {
    /// Velocity in the middle of the step.
    fn middle(&self, h: f64) -> f64 {
        self.v + 0.5 * h * self.a
    }
}

fn reflex(omega: f64, drive: impl Fn(f64, f64) -> f64, n: &Now, z: &mut [f64], h: f64) -> f64 {
    // Two first-order lags in a row, each stepped exactly for what drives it in the middle of the step.
    let (f, keep, before) = (z[0], (-omega * h).exp(), z[1]);
    let drive = drive(n.late_x, n.late_v);
    z[1] = drive + (z[1] - drive) * keep;
    let middle = 0.5 * (before + z[1]);
    z[0] = middle + (z[0] - middle) * keep;
    f
}

/// A spring's end z behind a damper of time τ, stepped exactly for a position that moves evenly.
fn follow(z: f64, n: &Now, time: f64, h: f64) -> f64 {
    let lag = n.middle(h) * time;
    n.x + n.middle(h) * h - lag + (z - n.x + lag) * (-h / time).exp()
}

/// All models with a force law.
pub fn cases() -> Vec<Case> {
    vec![
        case(laws::Relaxation, &[150.0, 0.08], &[], 1, |p, n, z, h| {
            let f = p[0] * (n.x - z[0]);
            z[0] = follow(z[0], n, p[1], h);
            f
        }),
        case(laws::FractionalDamping, &[40.0, 0.4], &[], 34, |p, n, z, h| {
            // Times 1.6 apart from 10⁻⁴·⁵ s on: twice as dense and wider than the model's.
            let (order, ratio) = (p[1], 1.6f64);
            let weight = |time: f64| p[0] * (order * std::f64::consts::PI).sin() / std::f64::consts::PI * ratio.ln() * time.powf(-order);
            let mut f = 0.0;
            for (k, z) in z.iter_mut().enumerate() {
                let time = 3e-5 * ratio.powi(k as i32);
                f += weight(time) * (n.x - *z);
                *z = follow(*z, n, time, h);
            }
            // All longer times are a spring, all shorter ones a damper.
            let shorter = 3e-5 / ratio;
            f + weight(3e-5 * ratio.powi(34)) / (1.0 - ratio.powf(-order)) * n.x + weight(shorter) * shorter / (1.0 - ratio.powf(order - 1.0)) * n.v
        }),
        case(laws::FlexibleMode, &[0.5, 6.0, 0.08], &[], 2, |p, n, z, h| {
            let w = TAU * p[1];
            let rate = |x: f64, v: f64, z: &[f64]| w * w * (x - z[0]) + 2.0 * p[2] * w * (v - z[1]);
            let a = rate(n.x, n.v, z);
            let half = [z[0] + 0.5 * h * z[1], z[1] + 0.5 * h * a];
            z[0] += h * half[1];
            z[1] += h * rate(n.x + 0.5 * h * n.v, n.middle(h), &half);
            p[0] * a
        }),
        case(laws::LinearReflex, &[80.0, 6.0, 0.045, 3.0], &[], 2, |p, n, z, h| reflex(TAU * p[3], |x, v| p[0] * x + p[1] * v, n, z, h)),
        case(laws::OneDirectionalReflex { positive: true }, &[20.0, 0.045, 3.0], &[], 2, |p, n, z, h| reflex(TAU * p[2], |_, v| p[0] * v.max(0.0), n, z, h)),
        case(laws::Latency, &[0.0063], &[], 0, |_, n, _, _| n.force - n.late_force),
        case(laws::Coulomb { turn_velocity: 5e-3 }, &[0.8], &[], 0, |p, n, _, _| p[0] * (n.v / 5e-3).tanh()),
        case(laws::Stribeck { turn_velocity: 5e-3 }, &[0.6, 0.8, 0.04], &[], 0, |p, n, _, _| {
            (p[0] + p[1] * (-(n.v / p[2]).powi(2)).exp()) * (n.v / 5e-3).tanh()
        }),
        case(laws::LuGre, &[1500.0, 0.6, 0.5, 0.04], &["coulomb_n", "excess_n", "stribeck_m_per_s"], 1, |p, n, z, h| {
            let (f, v) = (p[0] * z[0], n.middle(h));
            let level = p[1] + p[2] * (-(v / p[3]).powi(2)).exp();
            // ż is linear in z while v is held.
            let rate = p[0] * v.abs() / level;
            z[0] = if rate * h > 1e-9 { v / rate + (z[0] - v / rate) * (-rate * h).exp() } else { z[0] + h * v };
            f
        }),
        case(laws::BoucWen, &[300.0, 2e-3, 0.6], &[], 1, |p, n, z, h| {
            let f = p[0] * z[0];
            let v = n.middle(h);
            let rate = |z: f64| v - (v.abs() * z + p[2] * v * z.abs()) / (2.0 * p[1]);
            z[0] += h * rate(z[0] + 0.5 * h * rate(z[0]));
            f
        }),
        case(laws::MaxwellSlip, &[300.0, 3e-3], &["yield_m"], 3, |p, n, z, _| {
            let mut f = 0.0;
            for (z, share) in z.iter_mut().zip([0.4, 1.0, 1.6]) {
                let yields = share * p[1];
                f += p[0] / 3.0 * (n.x - *z).clamp(-yields, yields);
                *z = z.clamp(n.x - yields, n.x + yields);
            }
            f
        }),
        case(laws::ShortRangeStiffness, &[300.0, 2e-3], &["range_m"], 1, |p, n, z, _| {
            z[0] = z[0].clamp(n.x - p[1], n.x + p[1]);
            p[0] * (n.x - z[0])
        }),
        case(laws::CubicStiffness, &[4e5], &[], 0, |p, n, _, _| p[0] * n.x.powi(3)),
        case(laws::AsymmetricStiffness, &[4e3], &[], 0, |p, n, _, _| p[0] * n.x * n.x),
        case(laws::DeadZone, &[300.0, 4e-3], &["half_gap_m"], 0, |p, n, _, _| p[0] * ((n.x - p[1]).max(0.0) + (n.x + p[1]).min(0.0))),
        case(laws::Backlash, &[300.0, 2e-3], &["half_gap_m"], 1, |p, n, z, _| {
            z[0] = z[0].clamp(n.x - p[1], n.x + p[1]);
            p[0] * z[0]
        }),
        case(laws::EndStop { positive: true }, &[800.0, 8e-3], &["position_m"], 0, |p, n, _, _| p[0] * (n.x - p[1]).max(0.0)),
        case(laws::Saturation, &[5.0], &["level_n"], 0, |p, n, _, _| n.force - n.force.clamp(-p[0], p[0])),
        case(laws::StiffnessDrift, &[8.0], &[], 0, |p, n, _, _| p[0] * n.t * n.x),
    ]
}

/// Force and measured position of one record.
pub fn record(case: &Case, seed: u64, slow: Slow) -> (Vec<f64>, Vec<f64>) {
    record_of(case, seed, slow, SECONDS)
}

fn record_of(case: &Case, seed: u64, slow: Slow, seconds: f64) -> (Vec<f64>, Vec<f64>) {
    let samples = (seconds * RATE_HZ) as usize;
    let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let noise = FilteredNoise { rms: 4.0, samples, sample_rate_hz: RATE_HZ, cutoff_hz: 8.0, ..FilteredNoise::default() };
    let force = noise.generate(seed).expect("valid").remove(0);
    let low = SosFilter::butterworth(2, Passband::Low(2.0), RATE_HZ).expect("valid");
    let raw: Vec<f64> = (0..samples + 400).map(|_| normal()).collect();
    let own = low.filter(&raw)[400..].to_vec();
    let rms = (own.iter().map(|v| v * v).sum::<f64>() / samples as f64).sqrt();
    let h = 1.0 / (RATE_HZ * FINER as f64);
    let between = |c: &[f64], t: f64| {
        let at = (t * RATE_HZ).max(0.0);
        let k = (at as usize).min(samples - 2);
        c[k] + (c[k + 1] - c[k]) * (at - k as f64)
    };
    let steps = samples * FINER;
    let (mut past_x, mut past_v) = (Vec::with_capacity(steps), Vec::with_capacity(steps));
    let mut z = vec![0.0; case.states];
    let (mut x, mut v, mut before) = (0.0f64, 0.0f64, 0.0f64);
    let delay = case.delay.map_or(0.0, |d| case.truth[d]);
    let mut motion = Vec::with_capacity(samples);
    for step in 0..steps {
        if step % FINER == 0 {
            let wander = if slow == Slow::Position { WANDER_M / rms * own[step / FINER] } else { 0.0 };
            motion.push(x + wander + NOISE_M * normal());
        }
        let t = step as f64 * h;
        past_x.push(x);
        past_v.push(v);
        let ago = |c: &[f64]| {
            // In the middle of the step that begins then.
            let at = (t - delay) / h + 0.5;
            if at < 0.0 { 0.0 } else { c[at as usize] + (c[(at as usize + 1).min(step)] - c[at as usize]) * at.fract() }
        };
        let now = Now { t, x, v, a: before, late_x: ago(&past_x), late_v: ago(&past_v), force: between(&force, t), late_force: between(&force, t - delay) };
        // Heun for the limb, the law's own rule for the law.
        let mut law_at = z.clone();
        let f = (case.oracle)(&case.truth, &now, &mut law_at, h);
        let limb = if slow == Slow::Force { LIMB_NOISE_N / rms } else { 0.0 };
        let push = |t: f64| between(&force, t) + limb * between(&own, t);
        let a = (push(t) - BASE[1] * v - BASE[2] * x - f) / BASE[0];
        let (ahead_x, ahead_v) = (x + h * v, v + h * a);
        let next = Now { t: t + h, x: ahead_x, v: ahead_v, a, force: between(&force, t + h), late_force: between(&force, t + h - delay), ..now };
        let f = (case.oracle)(&case.truth, &next, &mut law_at.clone(), h);
        let b = (push(t + h) - BASE[1] * ahead_v - BASE[2] * ahead_x - f) / BASE[0];
        x += 0.5 * h * (v + ahead_v);
        v += 0.5 * h * (a + b);
        before = b;
        z = law_at;
    }
    (force, motion)
}

/// What one fit says of each parameter: in its interval, relative error, and whether it is called identifiable.
pub struct Answer {
    /// Whether the truth lies in the 95 % interval.
    pub covered: Vec<bool>,
    /// (estimate − truth)/|truth|.
    pub error: Vec<f64>,
    /// Whether the fit calls it determined.
    pub identifiable: Vec<bool>,
    /// Whether the interval is a profile.
    pub profiled: Vec<bool>,
}

/// True parameters with the baseline's.
pub fn truth(case: &Case) -> Vec<f64> {
    BASE.iter().chain(&case.truth).copied().collect()
}

/// Fits one record of that length and asks of every parameter's profile no more than whether it holds the truth.
pub fn test(case: &Case, seed: u64, slow: Slow, seconds: f64) -> Result<Answer, Box<dyn std::error::Error>> {
    let (force, motion) = record_of(case, seed, slow, seconds);
    let trial = [TimeTrial { force: vec![&force], motion: vec![&motion], ..TimeTrial::default() }];
    let (mechanism, settings, start) = setting(case, slow);
    let found = settings.fit(&mechanism, &trial, &start)?;
    let truth = truth(case);
    Ok(Answer {
        covered: (0..truth.len()).map(|k| settings.holds(&mechanism, &trial, &found, k, &truth)).collect::<Result<_, _>>()?,
        error: found.theta.iter().zip(&truth).map(|(a, b)| (a - b) / b.abs()).collect(),
        identifiable: found.parameters.iter().map(|p| p.identifiable).collect(),
        profiled: vec![true; truth.len()],
    })
}

/// The mechanism, how it is fitted, and a start that knows only orders of magnitude.
fn setting(case: &Case, slow: Slow) -> (Mechanism, FreeRunFit, Vec<f64>) {
    let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(case.law.clone(), 0);
    let disturbance = if slow == Slow::Force { Disturbance::Force } else { Disturbance::Output };
    let settings = FreeRunFit { noise: NOISE, disturbance, substeps: 2, ..FreeRunFit::new(RATE_HZ) };
    let start = truth(case).iter().enumerate().map(|(k, t)| t * if k % 2 == 0 { 1.25 } else { 0.8 }).collect();
    (mechanism, settings, start)
}

/// Fits one record of that length from a start that knows only orders of magnitude.
pub fn fit(case: &Case, seed: u64, slow: Slow, seconds: f64) -> Result<Answer, Box<dyn std::error::Error>> {
    let (force, motion) = record_of(case, seed, slow, seconds);
    let trial = [TimeTrial { force: vec![&force], motion: vec![&motion], ..TimeTrial::default() }];
    let (mechanism, settings, start) = setting(case, slow);
    let truth = truth(case);
    let mut found = settings.profiled(&mechanism, &trial, settings.fit(&mechanism, &trial, &start)?)?;
    for k in 0..truth.len() {
        if case.thresholds.contains(&found.parameters[k].name.as_str()) && !found.profiled[k] {
            found.parameters[k].ci95 = settings.profile(&mechanism, &trial, &found, k)?;
            found.profiled[k] = true;
        }
    }
    Ok(Answer {
        covered: found.parameters.iter().zip(&truth).map(|(p, t)| (p.ci95[0]..=p.ci95[1]).contains(t)).collect(),
        error: found.theta.iter().zip(&truth).map(|(a, b)| (a - b) / b.abs()).collect(),
        identifiable: found.parameters.iter().map(|p| p.identifiable).collect(),
        profiled: found.profiled,
    })
}

/// Whether the smaller BIC of a limb with a delay and one with a flexible mode names what made a record.
pub fn names_the_truth(truth_name: &str, seed: u64) -> Result<bool, Box<dyn std::error::Error>> {
    let cases = cases();
    let case = cases.iter().find(|c| c.law.name() == truth_name).ok_or("no such law")?;
    let (force, motion) = record(case, seed, Slow::Position);
    let trial = [TimeTrial { force: vec![&force], motion: vec![&motion], ..TimeTrial::default() }];
    let settings = FreeRunFit { noise: NOISE, substeps: 2, ..FreeRunFit::new(RATE_HZ) };
    let bic = |name: &str| -> Result<f64, Box<dyn std::error::Error>> {
        let mechanism = Mechanism::new(vec![Axis::linear("x")]).with_law(laws::find(name).ok_or("no such law")?, 0);
        Ok(settings.fit_from(&mechanism, &trial, &mechanism.starts(&BASE))?.bic)
    };
    Ok((bic("latency")? < bic("flexible-mode")?) == (truth_name == "latency"))
}
