//! The TOML files that people write: unknown keys are errors, and an error names file, line and remedy.

mod baseline;
mod channels;
mod kinematics;
mod parse;
mod robot;

pub use baseline::{BaselineFile, BaselineParameter, Status, Value};
pub use channels::{ChannelSource, ChannelTable, ChannelsFile, Transform, Transforms};
pub use kinematics::{KinematicsFile, KinematicsSd, MeanForce};
pub use parse::{check_schema, parse, read, read_text};
pub use robot::robot;
