//! Serial chains of rigid bodies: any robot without closed loops.

mod base_parameters;
mod config;
mod dynamics;
mod link;
mod parameters;
mod regressor;
mod robot_file;
mod serial;
mod urdf;
mod xml;

pub use base_parameters::{BaseParameter, base_parameters};
pub use config::{EndEffectorConfig, HoldConfig, JointConfig, JointKind, RobotConfig, TransducerConfig};
pub(crate) use link::Link;
pub use link::MAX_JOINTS;
pub use regressor::TERMS_OF_A_LINK;
pub(crate) use robot_file::{FileChoices, read_robot};
pub use serial::SerialChain;
pub(crate) use serial::Space;
