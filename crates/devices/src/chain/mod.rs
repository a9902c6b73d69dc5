//! Serial chains of rigid bodies: any robot without closed loops.

mod base_parameters;
mod body;
mod config;
mod correction;
mod dynamics;
mod edits;
mod link;
mod mjcf;
mod mjcf_settings;
mod parameters;
mod regressor;
mod robot_file;
mod serial;
mod shape;
mod toml_edit;
mod urdf;
mod write;
mod xml;
mod xml_edit;

pub use base_parameters::{BaseParameter, base_parameters};
pub use config::{EndEffectorConfig, HoldConfig, JointConfig, JointKind, RobotConfig, TransducerConfig};
pub use correction::{Corrected, Correction};
pub(crate) use link::Link;
pub use link::MAX_JOINTS;
pub use regressor::TERMS_OF_A_LINK;
pub(crate) use robot_file::{FileChoices, read_robot};
pub use serial::SerialChain;
pub(crate) use serial::Space;
pub use write::{Written, write_back, write_back_chain};
