//! Mechanical models, the effects that extend them, and their fitting.
//!
//! [`InertiaDampingStiffness`] is the baseline; [`WeightedFit`] fits it, or any [`ParametricModel`], to a
//! [`FrequencyResponse`](ndof_sysid::FrequencyResponse) with the covariance that the estimator gave.

mod axis;
pub mod blocks;
pub mod effects;
mod fit;
mod force_law;
mod inertia_damping_stiffness;
mod kinematics;
mod levenberg_marquardt;
mod parametric;
pub mod physical;
mod projection;
mod small;
pub mod state_space;
pub mod time;

pub use axis::Axis;
pub use fit::{
    Agreement, CovarianceKind, ErrorsInVariables, Fit, FitError, LikelihoodRatio, LoopModel, LoopModelError, PaperFit, Parameter, PeriodSpectra, Smoothing,
    Transducer, WeightedFit, agreement, likelihood_ratio, linear_start,
};
pub use force_law::{ForceLaw, Motion, Stage};
pub use inertia_damping_stiffness::{InertiaDampingStiffness, InertiaDampingStiffnessModel, Symmetry};
pub use kinematics::{Arm, Kinematics, KinematicsError};
pub use levenberg_marquardt::{LeastSquares, LevenbergMarquardt, MinimiseError, Minimum, StopReason};
pub use parametric::{ParameterInfo, ParametricModel, parametric_response};
pub use projection::{KinematicsSd, LARGEST_JACOBIAN_CONDITION, Projected, Projection, ProjectionError};
