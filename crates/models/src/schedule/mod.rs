//! Mechanical impedance that changes: over a movement's cycle, with posture, with activation, over time.
//!
//! With s the scheduling variable (the phase of a cycle, time, any measured channel),
//!
//! f(t) = f₀(s) + M(s) ẍ(t) + B(s) ẋ(t) + K(s) x(t) + e(t),
//!
//! each entry of the matrices that vary a curve of cubic [`Splines`] with a penalty on its roughness, whose weight is that of the largest
//! restricted likelihood; e is coloured, an autoregression by generalised least squares. f₀ is the mean movement's effort, with splines of its
//! own and without a penalty, so that stiffness speaks of the deviation from the mean movement.
//!
//! # When which regression is right
//!
//! Where the **motion is imposed**, e is the limb's own noise and has nothing to do with x: least squares is right. Where a robot **pushes with a
//! commanded force**, the limb's noise moves the limb: x and e belong together, and least squares is biased, at worst to minus the robot's own
//! impedance. Then the motion as the *command* foretells it is the instrument (two-stage least squares): the command knows nothing of the
//! limb's noise. [`Stretch::command`] says which it is.
//!
//! # Derivatives
//!
//! Velocity and acceleration are those of the band-limited displacement, and effort and *products* of motion and splines then pass one more
//! kernel, alike on both sides: it does not commute with a stiffness that changes, so it comes last. What noise the derivatives have above
//! the band goes with it. Rows are taken twice a period of the band's upper end.
//!
//! # References
//! J. Lataire & R. Pintelon (2009), Estimating a nonparametric colored-noise model for linear slowly time-varying systems; D. Ludvig &
//! E. J. Perreault (2012), System identification of physiological systems using short data segments; D. L. Guarin & R. E. Kearney (2018),
//! Unbiased estimation of human joint intrinsic mechanical properties during movement.

mod band;
mod design;
mod error;
mod fit;
mod held_out;
mod instrument;
mod kernel;
mod mean;
mod moments;
mod noise;
mod penalised;
mod record;
mod result;
mod spline;
mod variation;

pub use error::ScheduleError;
pub use fit::ScheduledFit;
pub use instrument::Foretold;
pub use mean::MeanOver;
pub use record::Stretch;
pub use result::{MeanMovement, Scheduled, ScheduledEntry, Term};
pub use spline::Splines;
pub use variation::LEAST_PROBABILITY;
