//! Effects of a severity, in the numbers of an experiment.

use super::laws::Law;
use super::plants::{Plant, Spec};
use super::{Case, Hidden};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Everything that is hidden in one recording.
pub struct Hiding {
    pub axis: usize,
    pub laws: Vec<Law>,
    pub truth: Vec<Vec<(&'static str, f64)>>,
    pub force_delay: f64,
    pub force_cutoff: Option<f64>,
    /// Stiffness in series with the sensor.
    pub series: Option<f64>,
    pub angle: f64,
    /// Amplitude and frequency.
    pub tremor: (f64, f64),
    pub reflex_delay: f64,
    pub added_mass: f64,
    /// rms of the limb's own force on the axis.
    pub own: f64,
    pub robot_friction: Vec<f64>,
    pub x_step: Option<f64>,
    /// A typical velocity.
    pub speed: f64,
    k: f64,
    m: f64,
    b: f64,
    x: f64,
    f: f64,
    duration: f64,
}

impl Hiding {
    pub fn new(case: &Case, spec: &Spec, axis: usize, friction: f64) -> Self {
        let k = if case.plant == Plant::Mass { 300.0 } else { spec.k[axis][axis] };
        Hiding {
            axis,
            laws: vec![],
            truth: vec![],
            force_delay: 0.0,
            force_cutoff: None,
            series: None,
            angle: 0.0,
            tremor: (0.0, 0.0),
            reflex_delay: 0.0,
            added_mass: 0.0,
            own: spec.own[axis],
            robot_friction: spec.f.iter().map(|f| friction * f).collect(),
            x_step: None,
            speed: spec.x[axis] * 12.0,
            k,
            m: spec.m[axis][axis],
            b: spec.b[axis][axis],
            x: spec.x[axis],
            f: spec.f[axis],
            duration: case.duration_s,
        }
    }

    /// Hides one effect.
    pub fn add(&mut self, hidden: &Hidden, rng: &mut ChaCha8Rng) {
        let s = hidden.severity;
        let (k, m, b, x, f, speed) = (self.k, self.m, self.b, self.x, self.f, self.speed);
        let law = |kind: &'static str, p: &[f64]| {
            let mut all = [0.0; 6];
            all[..p.len()].copy_from_slice(p);
            Some(Law { kind, p: all, from: 0 })
        };
        let mut own: Vec<(&'static str, f64)> = Vec::new();
        let new = match hidden.name {
            "coulomb-friction" => {
                own.push(("level", s * 0.5 * f));
                law("friction", &[s * 0.5 * f, 0.004 * speed, 0.15 * speed])
            }
            "hysteresis" => {
                let width = rng.random_range(0.3..0.8) * x;
                own.extend([("stiffness", s * 1.2 * k), ("yield", width)]);
                law("hysteresis", &[s * 1.2 * k, width, rng.random_range(0.0..1.0)])
            }
            "cubic-stiffness" => {
                let sign = if rng.random_range(0.0..1.0) < 0.6 || s > 0.06 { 1.0 } else { -1.0 };
                own.push(("k3", sign * s * 0.8 * k / (3.0 * x * x)));
                law("cubic", &[own[0].1])
            }
            "asymmetric-stiffness" => {
                own.push(("k2", s * 0.15 * k / x));
                law("square", &[own[0].1])
            }
            "dead-zone" => {
                own.push(("half_gap", s * 0.9 * x));
                law("gap", &[own[0].1])
            }
            "end-stop" => {
                own.extend([("stiffness", s * 3.0 * k), ("position", rng.random_range(0.8..1.4) * x)]);
                law("stop", &[own[0].1, own[1].1])
            }
            "reflex-delay" => {
                self.reflex_delay = rng.random_range(0.03..0.06);
                own.push(("delay", self.reflex_delay));
                law("reflex", &[s * 0.5 * k, s * 0.5 * b, 0.0, rng.random_range(2.0..4.0)])
            }
            "reflex-one" => {
                self.reflex_delay = rng.random_range(0.03..0.06);
                own.push(("delay", self.reflex_delay));
                law("reflex-one", &[0.0, s * 3.0 * b, 0.0, rng.random_range(2.5..5.0), 0.15 * speed])
            }
            "extra-resonance" => {
                own.push(("frequency", rng.random_range(4.0..8.0)));
                law("resonance", &[s * 0.4 * m, own[0].1, rng.random_range(0.03..0.1)])
            }
            "viscoelastic" => {
                own.push(("modulus", s * k));
                law("relaxation", &[s * k, rng.random_range(0.08..0.3)])
            }
            "stiffness-drift" => {
                own.push(("fraction_per_s", s * 0.8 / self.duration));
                law("stiffness-drift", &[own[0].1])
            }
            "posture-drift" => {
                own.push(("rate", s * 4.0 * x / self.duration));
                law("posture-drift", &[own[0].1])
            }
            "transient-disturbance" => {
                let at = rng.random_range(0.1..0.6) * self.duration;
                own.push(("time", at));
                law("knock", &[s * 6.0 * f, at, 0.3])
            }
            "x-quadratic-damping" => law("quadratic-damping", &[s * 2.5 * b / speed]),
            "x-van-der-pol" => law("van-der-pol", &[s * 3.0 * b / (x * x)]),
            "x-periodic-stiffness" => law("periodic-stiffness", &[s * 0.6 * k, rng.random_range(0.4..1.2)]),
            "x-cogging" => law("cogging", &[s * 0.5 * f, rng.random_range(0.8..1.5) * x]),
            channel => {
                self.add_to_channels(channel, s, &mut own, rng);
                None
            }
        };
        self.laws.extend(new);
        self.truth.push(own);
    }

    fn add_to_channels(&mut self, name: &str, s: f64, own: &mut Vec<(&'static str, f64)>, rng: &mut ChaCha8Rng) {
        match name {
            "measurement-delay" => {
                self.force_delay += s * 0.012;
                own.push(("delay", s * 0.012));
            }
            "channel-filter" => {
                self.force_cutoff = Some(12.0 / s);
                own.push(("cutoff", 12.0 / s));
            }
            "series-compliance" => self.series = Some(self.k * 20.0 / s),
            "sensor-misalignment" => {
                self.angle = (15.0 * s).to_radians() * if rng.random_range(0.0..1.0) < 0.5 { 1.0 } else { -1.0 };
                own.push(("angle", self.angle));
            }
            "periodic-disturbance" => {
                self.tremor = (s * 0.6 * self.f, rng.random_range(4.0..10.0));
                own.push(("frequency", self.tremor.1));
            }
            "quantisation" => {
                self.x_step = Some(0.25 * s * self.x);
                own.push(("step", 0.25 * s * self.x));
            }
            "limb-noise" => self.own = s * 0.3 * self.f,
            "robot-friction" => self.robot_friction[self.axis] = s * 0.5 * self.f,
            "added-mass" => {
                self.added_mass = s * 0.3 * self.m;
                own.push(("mass", self.added_mass));
            }
            other => panic!("the generator does not know {other}"),
        }
    }

    /// What every real experiment has a little of: a van der Pol damping, a cubic spring, a late channel.
    pub fn small_imperfections(&mut self, rng: &mut ChaCha8Rng) {
        let (k, b, x) = (self.k, self.b, self.x);
        let mut small = |kind: &'static str, value: f64| self.laws.push(Law { kind, p: [value, 0.0, 0.0, 0.0, 0.0, 0.0], from: 0 });
        small("van-der-pol", rng.random_range(0.0..0.012) * b / (x * x));
        small("cubic", rng.random_range(-0.5..1.0) * 0.01 * k / (3.0 * x * x));
        self.force_delay += rng.random_range(0.0..2e-4);
    }
}
