//! Effects: what a recording may hide and a simulation may lack.
//!
//! An [`Effect`] is described once. A simulation hides it through its [`Injection`]; a diagnosis looks for it through its
//! [`Form`]s. Each integrates in a way of its own. [`EFFECTS`] is the registry; a new effect is one file and one line here.

mod card;
mod curved_arm;
mod drift;
mod effect;
mod evidence;
mod form;
mod injection;
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
pub use matrix::Matrix;
pub use on_axis::{OnAxis, on_axis};
pub use parameters::{EffectError, Parameters, Value};
pub use reflex::ScheduledReflex;
pub use waves::{ScheduledMatrix, Waves};

/// All effects, in the order of the contract's table.
pub static EFFECTS: &[&dyn Effect] = &[
    &parameter_error::ParameterError,
    &added_mass::AddedMass,
    &coulomb_friction::CoulombFriction,
    &hysteresis::Hysteresis,
    &cubic_stiffness::CubicStiffness,
    &asymmetric_stiffness::AsymmetricStiffness,
    &dead_zone::DeadZone,
    &end_stop::EndStop,
    &viscoelastic::Viscoelastic,
    &extra_resonance::ExtraResonance,
    &reflex_delay::ReflexDelay,
    &measurement_delay::MeasurementDelay,
    &channel_filter::ChannelFilter,
    &actuation_delay::ActuationDelay,
    &actuator_saturation::ActuatorSaturation,
    &sensor_misalignment::SensorMisalignment,
    &sensor_scale::SensorScale,
    &sensor_offset_drift::SensorOffsetDrift,
    &quantisation::Quantisation,
    &periodic_disturbance::PeriodicDisturbance,
    &limb_noise::LimbNoise,
    &transient_disturbance::TransientDisturbance,
    &stiffness_drift::StiffnessDrift,
    &posture_drift::PostureDrift,
    &varying_stiffness::VaryingStiffness,
    &varying_damping::VaryingDamping,
    &varying_reflex::VaryingReflex,
    &arm_geometry::ArmGeometry,
    &posture_stiffness::PostureStiffness,
    &gravity::Gravity,
    &geometry_error::GeometryError,
    &cross_coupling::CrossCoupling,
];

/// The effect of that name.
///
/// ```
/// assert!(ndof_models::effects::find("hysteresis").is_some());
/// ```
pub fn find(name: &str) -> Option<&'static dyn Effect> {
    EFFECTS.iter().copied().find(|effect| effect.name() == name)
}
