//! Effects of a severity, in the numbers of an experiment.

mod channels;
mod hiding;
mod mechanics;
mod outside;

pub use hiding::{Hiding, Truth};

use super::laws::Law;
use super::plants::{Plant, Spec};
use super::stages::Stage;
use crate::case::{Case, Hidden, Setting};
use hiding::Sizes;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// An effect's name without its form, and the form.
pub fn parts(name: &'static str) -> (&'static str, &'static str) {
    name.split_once('/').unwrap_or((name, ""))
}

impl Hiding {
    pub fn new(case: &Case, setting: &Setting, spec: &Spec, axis: usize, friction: f64) -> Self {
        let k = if case.plant == Plant::Mass { 300.0 } else { spec.k[axis][axis] };
        let sizes = Sizes {
            k,
            m: spec.m[axis][axis],
            b: spec.b[axis][axis],
            x: spec.x[axis],
            f: spec.f[axis],
            speed: spec.x[axis] * 12.0,
            duration: case.duration_s,
            total: case.duration_s * case.trials as f64,
        };
        Hiding {
            axis,
            own: if setting.quiet { 0.0 } else { spec.own[axis] * setting.own },
            robot_friction: spec.f.iter().map(|f| friction * f).collect(),
            sizes,
            ..Hiding::default()
        }
    }

    /// A typical velocity.
    pub fn speed(&self) -> f64 {
        self.sizes.speed
    }

    /// Hides one effect; `other` takes the first functional form that the registry does not have.
    pub fn add(&mut self, hidden: &Hidden, other: bool, rng: &mut ChaCha8Rng) {
        let (name, form) = parts(hidden.name);
        let mut own = Truth::new();
        let law = mechanics::law(&self.sizes, name, form, hidden.severity, rng, &mut own).or_else(|| outside::law(&self.sizes, name, hidden.severity, rng));
        let form = if other && form.is_empty() { first_form(name, law.as_ref()) } else { form };
        match law {
            Some(mut law) => {
                // A wall on the other side is still the registry's.
                law.form = if form == "negative" { "" } else { form };
                if name.starts_with("reflex") {
                    self.reflex_delay = own[0].1;
                }
                self.laws.push(law);
            }
            None => self.add_to_channels(name, form, hidden.severity, &mut own, rng),
        }
        self.truth.push(own);
    }

    /// What every real experiment has a little of: a van der Pol damping, a cubic spring, a late channel.
    pub fn small_imperfections(&mut self, rng: &mut ChaCha8Rng) {
        let Sizes { k, b, x, .. } = self.sizes;
        let mut small = |kind: &'static str, value: f64| self.laws.push(Law::new(kind, &[value]));
        small("van-der-pol", rng.random_range(0.0..0.012) * b / (x * x));
        small("cubic", rng.random_range(-0.5..1.0) * 0.01 * k / (3.0 * x * x));
        self.efforts.push(Stage::Delay(rng.random_range(0.0..2e-4)));
    }
}

/// The form that stands for "another one" where none is said.
fn first_form(name: &str, law: Option<&Law>) -> &'static str {
    match name {
        "coulomb-friction" => "stribeck",
        "hysteresis" if law.is_some_and(|law| law.p[2] > 0.5) => "dahl-square",
        "hysteresis" => "three-slips",
        "cubic-stiffness" => "power-2.3",
        "asymmetric-stiffness" => "power-1.5",
        "dead-zone" | "end-stop" => "soft",
        "reflex-delay" => "underdamped",
        "reflex-one" => "threshold",
        "extra-resonance" => "hardening",
        "viscoelastic" => "three-times",
        "stiffness-drift" | "posture-drift" => "settling",
        "channel-filter" => "twice",
        "periodic-disturbance" => "swelling",
        _ => "",
    }
}
