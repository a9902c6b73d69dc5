//! What a simulation gets wrong, and why.
//!
//! [`diagnose`] takes the recordings of one experiment and says what a linear simulation of it misses, names the cause from the
//! registry of [effects](ndof_models::effects), extends the model with it, and measures the gain on data that no fit saw.
//!
//! How: the balance of forces M ẍ + B ẋ + K x + f = F is written in the frequency domain over blocks of time, every effect is a
//! further regressor computed from the measured motion (nothing is integrated that could diverge), and a Whittle likelihood with a
//! noise spectrum of its own for each hypothesis decides. A free run of the extended model over held-out data confirms.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod along;
mod answer;
mod asked;
mod at_joints;
mod band;
mod baseline;
mod curve;
mod curved;
mod detectors;
mod diagnose;
mod error;
mod extended;
mod floor;
mod free_run;
mod generic;
mod hypotheses;
mod in_time;
mod initial;
mod instruments;
mod judge;
mod layout;
mod linear;
mod linear_fit;
mod mechanism;
mod movement;
mod operators;
mod optimise;
mod options;
mod pictures;
mod plan;
mod plant;
mod probability;
mod remains;
mod result;
mod robot;
mod samples;
mod search;
mod shared_tests;
mod split;
mod state;
mod stretch;
mod subject;
mod tolerances;
mod unseen;
mod whittle;

pub use along::force_along;
pub use baseline::{Baseline, Part, Status};
pub use diagnose::{diagnose, diagnose_with_pictures};
pub use error::DiagnoseError;
pub use linear_fit::LinearFit;
pub use mechanism::{Endpoint, Mechanism, MechanismParameter, RobotSide, diagnose_robot};
pub use movement::Schedule;
pub use options::{HeldOut, KnownArm, Options};
pub use pictures::Pictures;
pub use probability::Features;
pub use result::{
    AnotherPlant, BandShare, Cause, CauseParameter, Confusable, Considered, Curve, Diagnosis, Discrepancy, Extended, Gain, Minor, Model, ModelParameter,
    NoiseFloor, ParameterFlag, Prospect, Score, Shift, Site, Split, TimeShare, UNSURE, Verdict,
};
pub use stretch::Stretch;
