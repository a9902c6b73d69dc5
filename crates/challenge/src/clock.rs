//! The clock of controller and integrator.

/// Ticks of the controller in a second, and the usual sample rate of the recordings.
pub const FS: f64 = 500.0;
/// Steps of the integrator in a tick.
pub const SUB: usize = 8;
/// Steps of the integrator in a second.
pub const FINE_HZ: f64 = FS * SUB as f64;
