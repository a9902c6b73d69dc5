//! Effects: what a recording may hide and a simulation may lack.
//!
//! An [`Effect`] is described once, by a card and a few functions. A simulation hides it through its
//! [`Injection`]; a diagnosis looks for it through its [`Form`]s. Each integrates in a way of its own. [`EFFECTS`] is the registry; a
//! new effect is one file and one line here.

mod card;
mod curved_arm;
mod drift;
mod effect;
mod evidence;
mod form;
mod injection;
mod latency;
mod matrix;
mod on_axis;
mod outside_force;
mod parameters;
mod reflex;
mod scheduled;
mod static_force;
mod vocabulary;
mod waves;

mod actuation_delay;
mod actuator_saturation;
mod added_mass;
mod arm_geometry;
mod asymmetric_stiffness;
mod channel_filter;
mod coulomb_friction;
mod cross_coupling;
mod cubic_stiffness;
mod dead_zone;
mod end_stop;
mod extra_resonance;
mod geometry_error;
mod gravity;
mod hysteresis;
mod limb_noise;
mod measurement_delay;
mod parameter_error;
mod periodic_disturbance;
mod posture_drift;
mod posture_stiffness;
mod quantisation;
mod reflex_delay;
mod sensor_misalignment;
mod sensor_offset_drift;
mod sensor_scale;
mod stiffness_drift;
mod transient_disturbance;
mod varying_damping;
mod varying_reflex;
mod varying_stiffness;
mod viscoelastic;

pub use card::{Card, ParameterCard, Side, Trace, rotational_name};
pub use curved_arm::{Carried, CurvedArm, Displaced};
pub use effect::Effect;
pub use evidence::Evidence;
pub use form::{Action, Form, Knob, LawMaker, MatrixMaker, Naming, Operator, Remark, Scale, Sign};
pub use injection::{Injection, Setting};
pub use latency::Latency;
pub use matrix::Matrix;
pub use on_axis::{OnAxis, on_axis};
pub use parameters::{EffectError, Parameters, Value};
pub use reflex::ScheduledReflex;
pub use waves::{ScheduledMatrix, Waves};

/// All effects, in the order of the contract's table.
pub static EFFECTS: &[&Effect] = &[
    &parameter_error::EFFECT,
    &added_mass::EFFECT,
    &coulomb_friction::EFFECT,
    &hysteresis::EFFECT,
    &cubic_stiffness::EFFECT,
    &asymmetric_stiffness::EFFECT,
    &dead_zone::EFFECT,
    &end_stop::EFFECT,
    &viscoelastic::EFFECT,
    &extra_resonance::EFFECT,
    &reflex_delay::EFFECT,
    &measurement_delay::EFFECT,
    &channel_filter::EFFECT,
    &actuation_delay::EFFECT,
    &actuator_saturation::EFFECT,
    &sensor_misalignment::EFFECT,
    &sensor_scale::EFFECT,
    &sensor_offset_drift::EFFECT,
    &quantisation::EFFECT,
    &periodic_disturbance::EFFECT,
    &limb_noise::EFFECT,
    &transient_disturbance::EFFECT,
    &stiffness_drift::EFFECT,
    &posture_drift::EFFECT,
    &varying_stiffness::EFFECT,
    &varying_damping::EFFECT,
    &varying_reflex::EFFECT,
    &arm_geometry::EFFECT,
    &posture_stiffness::EFFECT,
    &gravity::EFFECT,
    &geometry_error::EFFECT,
    &cross_coupling::EFFECT,
];

/// The effect of that name.
///
/// ```
/// assert!(ndof_models::effects::find("hysteresis").is_some());
/// ```
pub fn find(name: &str) -> Option<&'static Effect> {
    EFFECTS.iter().copied().find(|effect| effect.name() == name)
}
