//! Mechanical models, the effects that extend them, and their fitting.
//!
//! [`InertiaDampingStiffness`] is the baseline; [`WeightedFit`] fits it, or any [`ParametricModel`], to a
//! [`FrequencyResponse`](ndof_sysid::FrequencyResponse) with the covariance that the estimator gave.
//!
//! # One description, two faces
//!
//! A [`time::Mechanism`] is axes, inertia, damping, stiffness and any list of laws, with named parameters. It is seen in time by
//! [`time::simulate()`] and [`time::FreeRunFit`], and in frequency by [`time::Mechanism::dynamic_stiffness`]; a linear law's
//! [`Law::response`](time::Law::response) is the [`blocks`] element of the same name, whose parameters it shares, so that a
//! [`blocks::Composite`] fits to a response what a mechanism fits to a record. Nonlinear laws have a face in time only; an
//! [`effects::Effect`] gives their random-input tangent in frequency. The law itself it takes from [`time::laws`] by
//! [`effects::on_axis`], so that a search, a simulation and a fit mean the same. What acts on a channel rather than on the limb
//! (delay, filter, gain) is a [`Stage`] in time and a block at a channel's [`Place`](blocks::Place) in frequency.
//!
//! ```
//! use ndof_models::Axis;
//! use ndof_models::time::{Mechanism, laws::Relaxation, simulate};
//! use num_complex::Complex64;
//! let arm = Mechanism::new(vec![Axis::linear("x")]).with(Relaxation, 0);
//! let theta = [2.0, 14.0, 300.0, 150.0, 0.08];
//! // A force of 1 N that stays: both say 1/K in the end.
//! let moved = &simulate(&arm, &theta, &[0.0, 0.0], &[&[1.0; 2000]], 200.0, 1)[0];
//! let stiffness = arm.dynamic_stiffness(&theta, Complex64::new(0.0, 0.0)).ok_or("nonlinear")?;
//! assert!((moved[1999] * stiffness[[0, 0]].re - 1.0).abs() < 1e-9);
//! # Ok::<(), &str>(())
//! ```

mod axis;
pub mod blocks;
mod driven;
pub mod effects;
mod fit;
mod force_law;
mod gains;
mod golden;
mod hold;
mod inertia_damping_stiffness;
mod kinematics;
mod levenberg_marquardt;
mod parametric;
pub mod physical;
mod projection;
pub mod robot;
pub mod schedule;
mod secant;
#[cfg(test)]
mod shared_tests;
mod status;
mod ticks;
pub mod time;

pub use axis::Axis;
pub use driven::Driven;
pub use fit::{
    Agreement, CovarianceKind, Fit, FitError, LikelihoodRatio, LoopModel, LoopModelError, NullLaw, PaperFit, Parameter, SeriesCompliance, Smoothing,
    Transducer, WeightedFit, Width, agreement, gains_start, likelihood_ratio, linear_start,
};
pub use force_law::{ForceLaw, Motion, Stage};
pub use gains::Gains;
pub use golden::golden;
pub use hold::{Held, Hold, Sampling};
pub use inertia_damping_stiffness::{InertiaDampingStiffness, InertiaDampingStiffnessModel, Symmetry};
pub use kinematics::{Arm, Kinematics, KinematicsError, planar_angles, planar_jacobian, planar_links};
pub use levenberg_marquardt::{LeastSquares, LevenbergMarquardt, MinimiseError, Minimum, Slopes, StopReason};
pub use parametric::{ParameterInfo, ParametricModel, parametric_response};
pub use projection::{KinematicsSd, LARGEST_JACOBIAN_CONDITION, Projected, Projection, ProjectionError};
pub use status::Status;
pub use ticks::Ticks;
