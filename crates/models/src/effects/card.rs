//! What an effect says about itself.

use serde::{Deserialize, Serialize};

/// Where in the experiment an effect sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Between reference and effort.
    Robot,
    /// Between measured effort and measured motion, whatever that plant is.
    Limb,
    /// In a channel of the recording.
    Sensor,
    /// Between command and applied force.
    Actuator,
    /// A force from outside.
    Environment,
}

impl Side {
    /// The word that results use.
    pub fn word(self) -> &'static str {
        match self {
            Side::Robot => "robot",
            Side::Limb => "limb",
            Side::Sensor => "sensor",
            Side::Actuator => "actuator",
            Side::Environment => "environment",
        }
    }
}

/// How a diagnosis looks for an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trace {
    /// By the [forms](crate::effects::Effect::forms) that it offers to a search.
    Forms,
    /// As a line in the spectrum of what the model leaves.
    Tone,
    /// As a short burst in what the model leaves.
    Burst,
    /// As a grid of levels in a channel.
    Levels,
    /// As the spectrum of what the model leaves: a noise, never a rival of the other causes.
    Noise,
    /// Not from endpoint signals; only through a plant that has the parameter (a kinematic model).
    Plant,
}

/// A parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterCard {
    /// Its name for a translation, e.g. `stiffness_n_per_m`.
    pub name: &'static str,
    /// Its SI unit for a translation.
    pub unit: &'static str,
    /// Its SI unit for a rotation.
    pub rotational_unit: &'static str,
    /// The range that makes sense physically, in SI units.
    pub bounds: (f64, f64),
    /// The value where none is given; `None` means that it must be given.
    pub default: Option<f64>,
}

/// A parameter whose unit is the same for translation and rotation.
pub(crate) const fn plain(name: &'static str, unit: &'static str, lo: f64, hi: f64, default: Option<f64>) -> ParameterCard {
    ParameterCard { name, unit, rotational_unit: unit, bounds: (lo, hi), default }
}

/// A parameter with a unit of its own for rotation.
pub(crate) const fn mechanical(name: &'static str, units: (&'static str, &'static str), lo: f64, hi: f64, default: Option<f64>) -> ParameterCard {
    ParameterCard { name, unit: units.0, rotational_unit: units.1, bounds: (lo, hi), default }
}

/// The channel that a stage sits in.
pub(crate) const CHANNEL: ParameterCard = plain("channel", "", 0.0, 0.0, None);

/// What an effect is, in words that help and reports print.
#[derive(Clone, Copy, Debug)]
pub struct Card {
    /// Its name in files and results.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub what: &'static str,
    /// Where it can sit.
    pub sides: &'static [Side],
    /// Its parameters.
    pub parameters: &'static [ParameterCard],
    /// What it does to a recording.
    pub signature: &'static str,
    /// Effects that look like it.
    pub look_alikes: &'static [&'static str],
    /// The experiment that tells it from its look-alikes.
    pub next_experiment: &'static str,
    /// Its equation.
    pub equation: &'static str,
    /// Where the equation comes from.
    pub source: &'static str,
    /// How a diagnosis looks for it.
    pub trace: Trace,
}

/// The rotational twin of a parameter's name: `stiffness_n_per_m` becomes `stiffness_nm_per_rad`.
///
/// ```
/// assert_eq!(ndof_models::effects::rotational_name("k3_n_per_m3"), "k3_nm_per_rad3");
/// assert_eq!(ndof_models::effects::rotational_name("delay_s"), "delay_s");
/// ```
pub fn rotational_name(name: &str) -> String {
    let twin = |word| match word {
        "n" => "nm",
        "m" => "rad",
        "m2" => "rad2",
        "m3" => "rad3",
        other => other,
    };
    name.split('_').map(twin).collect::<Vec<&str>>().join("_")
}
