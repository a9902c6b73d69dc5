//! Families of what may be hidden: an effect in a functional form. Families, not only seeds, are held back for the final run.

use crate::Plant;
use crate::hide::parts;

/// What a family is to a registry of effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An effect of the registry in the registry's form.
    Registry,
    /// An effect of the registry in another functional form.
    Other,
    /// Something that no registry has.
    Outside,
}

/// An effect in a functional form.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    /// The generator's name of it: effect, and form after a `/`.
    pub name: &'static str,
    /// What it is to the registry.
    pub kind: Kind,
    /// Whether only the final run sees it.
    pub held_back: bool,
    /// Names that are right (registry), or that by their own definition are not wrong (outside); empty is the effect's own.
    pub names: &'static [&'static str],
    /// Plants that it shows on.
    pub on: On,
    /// Of what is outside the registry: the kind of law.
    pub group: &'static str,
}

/// Plants that a family shows on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum On {
    /// Those with a spring.
    Sprung,
    /// Those, and a mass without one.
    All,
    /// Those with a spring that are moved by a force.
    Pushed,
    /// Those of two and three axes.
    Several,
}

impl On {
    /// Plants with their weights in a draw.
    pub fn plants(self) -> &'static [(Plant, f64)] {
        match self {
            On::Sprung => &[(Plant::Force, 0.36), (Plant::Planar, 0.3), (Plant::Motion, 0.22), (Plant::Wrist, 0.12)],
            On::All => &[(Plant::Force, 0.26), (Plant::Planar, 0.26), (Plant::Motion, 0.18), (Plant::Wrist, 0.1), (Plant::Mass, 0.2)],
            On::Pushed => &[(Plant::Force, 0.6), (Plant::Planar, 0.3), (Plant::Wrist, 0.1)],
            On::Several => &[(Plant::Planar, 0.7), (Plant::Wrist, 0.3)],
        }
    }
}

const fn registry(name: &'static str, on: On) -> Family {
    Family { name, kind: Kind::Registry, held_back: false, names: &[], on, group: "" }
}

const fn named(family: Family, names: &'static [&'static str]) -> Family {
    Family { names, ..family }
}

const fn other(name: &'static str, held_back: bool, on: On) -> Family {
    Family { name, kind: Kind::Other, held_back, names: &[], on, group: "" }
}

const fn outside(group: &'static str, name: &'static str, held_back: bool, names: &'static [&'static str], on: On) -> Family {
    Family { name, kind: Kind::Outside, held_back, names, on, group }
}

/// A zero that wanders and a place that creeps are one law where there is a spring.
const CREEP: &[&str] = &["posture-drift", "sensor-offset-drift"];

/// Effects of the registry in its own forms: the final run has them with other seeds.
pub const REGISTRY: &[Family] = &[
    registry("coulomb-friction", On::All),
    registry("coulomb-friction/stribeck-square", On::Sprung),
    registry("hysteresis", On::All),
    registry("cubic-stiffness", On::Sprung),
    registry("asymmetric-stiffness", On::Sprung),
    registry("dead-zone", On::Sprung),
    registry("end-stop", On::Sprung),
    registry("end-stop/negative", On::Sprung),
    registry("reflex-delay", On::Sprung),
    registry("reflex-one", On::Sprung),
    registry("extra-resonance", On::All),
    registry("viscoelastic", On::Sprung),
    registry("viscoelastic/fractional", On::Sprung),
    registry("stiffness-drift", On::Sprung),
    named(registry("posture-drift", On::Sprung), CREEP),
    registry("measurement-delay", On::All),
    registry("measurement-delay/motion", On::Sprung),
    registry("channel-filter", On::Sprung),
    registry("channel-filter/second", On::Sprung),
    registry("periodic-disturbance", On::All),
    named(registry("series-compliance", On::Pushed), &["extra-resonance"]),
    registry("transient-disturbance", On::All),
    registry("quantisation", On::Pushed),
    registry("sensor-misalignment", On::Several),
    named(registry("sensor-offset-drift", On::Sprung), CREEP),
];

/// The same effects in other forms.
pub const OTHER: &[Family] = &[
    other("coulomb-friction/stribeck", false, On::All),
    other("coulomb-friction/load", true, On::Sprung),
    other("coulomb-friction/lugre", true, On::Sprung),
    other("hysteresis/three-slips", false, On::All),
    other("hysteresis/dahl-square", false, On::All),
    other("hysteresis/ten-slips", true, On::Sprung),
    other("hysteresis/unequal-loop", true, On::Sprung),
    other("hysteresis/curved-plays", true, On::Sprung),
    other("cubic-stiffness/power-2.3", false, On::Sprung),
    other("cubic-stiffness/sinh", true, On::Sprung),
    other("cubic-stiffness/quintic", true, On::Sprung),
    other("asymmetric-stiffness/power-1.5", false, On::Sprung),
    other("asymmetric-stiffness/toe", true, On::Sprung),
    // A wall at rest is a spring of two slopes.
    named(other("asymmetric-stiffness/kink", true, On::Sprung), &["asymmetric-stiffness", "end-stop"]),
    other("dead-zone/soft", false, On::Sprung),
    other("dead-zone/off-centre", true, On::Sprung),
    other("dead-zone/ramped", true, On::Sprung),
    other("end-stop/soft", false, On::Sprung),
    other("end-stop/hertz", true, On::Sprung),
    other("end-stop/damped", true, On::Sprung),
    other("reflex-delay/underdamped", false, On::Sprung),
    other("reflex-delay/first-order", true, On::Sprung),
    other("reflex-delay/saturating", true, On::Sprung),
    other("reflex-one/threshold", false, On::Sprung),
    other("reflex-one/square", true, On::Sprung),
    other("reflex-one/saturating", true, On::Sprung),
    other("extra-resonance/hardening", false, On::Sprung),
    other("extra-resonance/two-modes", true, On::Sprung),
    other("extra-resonance/dry", true, On::Sprung),
    other("viscoelastic/three-times", false, On::Sprung),
    other("viscoelastic/stretched", true, On::Sprung),
    other("viscoelastic/quasi-linear", true, On::Sprung),
    other("stiffness-drift/settling", false, On::Sprung),
    other("stiffness-drift/sigmoid", true, On::Sprung),
    named(other("posture-drift/settling", false, On::Sprung), CREEP),
    named(other("posture-drift/sigmoid", true, On::Sprung), CREEP),
    other("measurement-delay/swaying", true, On::Sprung),
    other("channel-filter/twice", false, On::Sprung),
    other("channel-filter/ringing", true, On::Sprung),
    other("channel-filter/moving-average", true, On::Sprung),
    other("periodic-disturbance/swelling", false, On::Sprung),
    other("periodic-disturbance/sliding", true, On::Sprung),
    other("periodic-disturbance/triangular", true, On::Sprung),
    other("transient-disturbance/kick", false, On::Sprung),
    other("transient-disturbance/to-and-fro", true, On::Sprung),
    other("quantisation/uneven", true, On::Pushed),
    other("sensor-misalignment/one-way", true, On::Several),
];

/// What no registry has. A name beside one says that this effect's own definition covers it, so that it is no wrong name.
pub const OUTSIDE: &[Family] = &[
    outside("memory", "x-thixotropy", false, &[], On::Pushed),
    outside("memory", "x-mullins", false, &[], On::Pushed),
    outside("memory", "x-fatigue", true, &["stiffness-drift"], On::Pushed),
    outside("memory", "x-thermal-damping", true, &[], On::Pushed),
    outside("switch", "x-latch", false, &[], On::Pushed),
    outside("switch", "x-random-contact", false, &[], On::Sprung),
    outside("switch", "x-relay-stiffness", true, &[], On::Sprung),
    outside("switch", "x-grip", true, &[], On::Sprung),
    outside("event", "x-startle", false, &["transient-disturbance"], On::Sprung),
    outside("event", "x-catch", true, &["transient-disturbance"], On::Sprung),
    outside("event", "x-bond", true, &[], On::Sprung),
    outside("dynamics", "x-rossler", false, &["limb-noise", "periodic-disturbance"], On::Sprung),
    outside("dynamics", "x-limit-cycle", true, &["limb-noise", "periodic-disturbance"], On::Sprung),
    outside("dynamics", "x-double-well", true, &["extra-resonance"], On::Sprung),
    outside("dynamics", "x-state-delay", true, &["reflex-delay"], On::Sprung),
    outside("channel", "x-held-samples", false, &[], On::Pushed),
    outside("channel", "x-clock-wander", false, &[], On::Sprung),
    outside("channel", "x-slew", true, &[], On::Pushed),
    outside("channel", "x-amplitude-delay", true, &["measurement-delay"], On::Pushed),
    outside("ground", "x-rough", false, &[], On::Sprung),
    outside("ground", "x-squeeze-film", false, &[], On::Sprung),
    outside("ground", "x-position-inertia", true, &[], On::Sprung),
    outside("parameter", "x-periodic-stiffness", false, &[], On::Sprung),
    outside("parameter", "x-telegraph-damping", true, &[], On::Sprung),
];

/// Two at once; the last word says whether the final run alone has them.
pub const PAIRS: &[(&str, &str, bool)] = &[
    ("coulomb-friction", "measurement-delay", false),
    ("hysteresis", "channel-filter", false),
    ("cubic-stiffness", "coulomb-friction", false),
    ("reflex-delay", "measurement-delay", false),
    ("stiffness-drift", "hysteresis", false),
    ("extra-resonance", "dead-zone", false),
    ("viscoelastic", "cubic-stiffness", false),
    ("hysteresis", "coulomb-friction", false),
    ("reflex-one", "cubic-stiffness", false),
    ("periodic-disturbance", "coulomb-friction", false),
    ("dead-zone", "coulomb-friction", true),
    ("end-stop", "viscoelastic", true),
    ("asymmetric-stiffness", "measurement-delay", true),
    ("stiffness-drift", "coulomb-friction", true),
    ("reflex-one", "hysteresis", true),
    ("extra-resonance", "measurement-delay", true),
    ("cubic-stiffness", "channel-filter", true),
    ("hysteresis", "periodic-disturbance", true),
    ("asymmetric-stiffness", "stiffness-drift", true),
    ("reflex-delay", "end-stop", true),
];

/// What can be named only against a simulation whose parameters are given.
pub const AGAINST: &[&str] = &["added-mass", "parameter-error", "sensor-scale", "cross-coupling"];

impl Family {
    /// The registry's name of the effect, whatever its form.
    pub fn effect(&self) -> &'static str {
        match parts(self.name).0 {
            "reflex-one" => "reflex-delay",
            "series-compliance" => "extra-resonance",
            effect => effect,
        }
    }

    /// Names that are right; of what is outside the registry, those that are not wrong.
    pub fn names(&self) -> Vec<&'static str> {
        if self.names.is_empty() && self.kind != Kind::Outside { vec![self.effect()] } else { self.names.to_vec() }
    }

    /// Sides at which the effect may be said to sit.
    pub fn sides(&self) -> &'static [&'static str] {
        match self.effect() {
            "measurement-delay" | "channel-filter" | "quantisation" | "sensor-misalignment" | "sensor-scale" => &["sensor"],
            "posture-drift" | "sensor-offset-drift" | "extra-resonance" => &["limb", "sensor"],
            "periodic-disturbance" | "transient-disturbance" => &["limb", "environment"],
            "end-stop" => &["limb", "environment"],
            _ => &["limb"],
        }
    }
}

/// A family of the registry by its name.
pub fn of_registry(name: &str) -> Option<&'static Family> {
    REGISTRY.iter().find(|family| family.name == name)
}
