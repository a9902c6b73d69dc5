//! What a robot's own simulation gets wrong, joint by joint.
//!
//! A robot is a chain of rigid bodies from its file ([`ndof_devices::RobotConfig`]). Its log holds the angle and the torque of each joint
//! during large movements; nothing is linearised. The torque that the file's bodies and frictions need for the measured motion,
//!
//! τ_file = H(q) q̈ + h(q, q̇) + F_c sign q̇ + b q̇,
//!
//! is compared with the logged one in the band in which the encoders rise above their noise. Each of the [`CAUSES`] says what torque it adds
//! along that motion, for one joint or for all; whole models are searched by generalised least squares with the noise of each joint as an
//! autoregression, and judged on the part of the log that no fit saw.
//!
//! J. Swevers, W. Verdonck and J. De Schutter, Dynamic model identification for industrial robots, IEEE Control Syst. Mag. 27(5) (2007) 58.

mod again;
mod answer;
mod band;
mod blocks;
mod bodies;
mod causes;
mod column;
mod corrections;
mod deflection;
mod diagnose;
mod discrepancy;
mod dynamics;
mod error;
mod excitation;
mod explained;
mod gears;
mod generic;
mod held_out;
mod judged;
mod left_noise;
mod logged;
mod lost;
mod mistaken;
mod model;
mod motion;
mod noise;
mod options;
mod parts;
mod passing;
mod physical;
mod pictures;
mod refined;
mod remains;
mod rivals;
mod scene;
mod search;
mod shared_tests;
mod simulated;
mod sizes;
mod stops;
mod suspicions;
mod swing;
#[cfg(test)]
#[path = "../tests/swinging/mod.rs"]
mod swinging;
mod table;
mod taken;
mod tilts;
mod told;
mod unmoved;
mod verdict;
mod zeros;

pub use causes::{CAUSES, Card, JointCause};
pub use corrections::{Corrections, corrections};
pub use diagnose::{alike, diagnose};
pub use error::JointsError;
pub use excitation::{
    Excitation, ExcitationError, ExcitationSearch, FourierMotion, FourierSeries, JointLimits, JointMotion, PredictedParameter, RANDOM_MOTIONS, UsedLimits,
    excite,
};
pub use options::Options;
