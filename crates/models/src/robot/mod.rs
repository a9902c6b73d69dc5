//! A robot, as the simulator and the diagnosis alike take it.
//!
//! H(q; θ) q̈ + h(q, q̇; θ) + τ_f(q̇; θ) = τ − Jᵀ F
//!
//! with joint coordinates q, motor torques τ, the force F that the robot applies to what it holds, and named parameters θ. One trait says
//! it all: [`Robot`] computes H, h, the kinematics and what a motion needs ([`Robot::inverse_dynamics`]), tells its parameters, and makes
//! itself anew with others. [`EndpointForce`] sees the same at the endpoint.

mod endpoint_force;
mod error;
mod joints;
mod parameter;
mod rigid_body;

pub use endpoint_force::EndpointForce;
pub use error::RobotError;
pub use joints::{Joints, quantise};
pub use parameter::{Meaning, RobotParameter};
pub use rigid_body::{EndpointKinematics, Robot};
