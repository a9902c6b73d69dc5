//! Stiffness that follows a schedule.

use super::scheduled::{CYCLE, forms, inject};
use super::vocabulary::*;

const SWING: ParameterCard = mechanical("swing_n_per_m", ("N/m", "N m/rad"), -1e9, 1e9, None);
const CARD: Card = Card {
    name: "varying-stiffness",
    what: "stiffness that varies with a schedule: the phase of a cycle, a posture, an activation, or time",
    sides: &[Side::Limb],
    parameters: &[SWING, CYCLE],
    signature: "in cycles whose mean movement is taken out, the slope of force against displacement comes back with the phase",
    look_alikes: &["cubic-stiffness", "asymmetric-stiffness", "reflex-delay", "stiffness-drift"],
    next_experiment: "more cycles, and the same perturbation at rest in several postures: what follows the phase alone is gone there",
    equation: "f = κ(s) x, κ = Σ c_k φ_k(s); hidden: κ = swing cos(2π t / cycle)",
    source: "Ludvig & Perreault 2012, System identification of physiological systems using short data segments",
    trace: Trace::Forms,
};

/// Stiffness over a schedule.
pub(super) const EFFECT: Effect = Effect {
    forms: |scale| if scale.spring { forms(Matrix::Stiffness, scale) } else { Vec::new() },
    ..Effect::new(&CARD, |parameters, setting| inject(&CARD, Matrix::Stiffness, parameters, setting))
};
