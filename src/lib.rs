//! System identification of mechanical systems with any number of degrees of freedom.
pub use ndof_signal as signal;
