//! Fits in the time domain: the model runs free from what was imposed and has to stay with what was measured.
//!
//! A [`Mechanism`] is inertia, damping and stiffness with any number of [`laws`]; [`FreeRunFit`] fits it. Either the force
//! is given and the motion comes out, or the other way round ([`Causality`]).

mod deviations;
mod error;
mod exact;
mod fit;
mod innovations;
mod jet;
mod law;
pub mod laws;
mod mechanism;
pub(crate) mod noise;
mod profile;
mod search;
mod shooting;
mod simulate;
mod small_sample;
mod trial;

pub use error::FreeRunError;
pub use fit::{FreeRun, FreeRunFit, Score};
pub use innovations::{Disturbance, LimbNoise};
pub use jet::Real;
pub use law::{Equation, LAW_VARIABLES, LOCAL_VARIABLES, Law, Local};
pub use mechanism::{Mechanism, PlacedLaw};
pub use noise::Noise;
pub use simulate::simulate;
pub use trial::{Causality, TimeTrial};
