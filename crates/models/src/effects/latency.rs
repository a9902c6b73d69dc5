//! How late channels are by an effect.

/// The parameter of an effect by which channels are late against each other.
///
/// What efforts do between their samples makes half a sample of it, and so does the order in which a controller's tick reads and writes: what of a latency is no more than that
/// may be no cause at all.
#[derive(Clone, Copy, Debug)]
pub struct Latency {
    /// Its name.
    pub parameter: &'static str,
    /// The name of a parameter that makes it grow with time: one that does is no order of a tick.
    pub grows_by: Option<&'static str>,
    /// What any is more than (s).
    pub beyond_s: f64,
    /// Seconds of a value of it at low frequencies, with the effect's order (1 without one); of seconds, the value.
    pub turned: fn(f64, f64) -> f64,
}
