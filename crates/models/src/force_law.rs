//! A force law with hidden states, and a stage of the signal chain: how simulation and diagnosis see one element.

use num_complex::Complex64;

/// The motion that a force law feels at one instant, axis by axis, in SI units.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// Time since the recording's first sample.
    pub time_s: f64,
    /// Displacement from the posture that is held (m, rad).
    pub position: &'a [f64],
    /// Its rate.
    pub velocity: &'a [f64],
    /// Displacement [`ForceLaw::delay_s`] ago; equal to `position` for laws without a delay.
    pub delayed_position: &'a [f64],
    /// Velocity [`ForceLaw::delay_s`] ago.
    pub delayed_velocity: &'a [f64],
    /// What the impedance may follow, from 0 to 1: the phase of a cycle, say. NaN where there is none.
    pub schedule: f64,
}

impl<'a> Motion<'a> {
    /// A motion that no law looks back at, without a schedule.
    pub fn now(time_s: f64, position: &'a [f64], velocity: &'a [f64]) -> Self {
        Motion { time_s, position, velocity, delayed_position: position, delayed_velocity: velocity, schedule: f64::NAN }
    }
}

/// A force with which a mechanical element resists motion, over and above M ẍ + B ẋ + K x:
///
/// M ẍ + B ẋ + K x + f(t, x, ẋ, z) = F,   ż = g(t, x, ẋ, z)
///
/// Positive `f` opposes a positive applied force `F`. Whoever integrates brings `z`, zero at the start. A closure of motion and force is a law
/// without hidden states.
pub trait ForceLaw: Send + Sync {
    /// Number of hidden states z.
    fn states(&self) -> usize {
        0
    }

    /// How far back the law looks, for [`Motion::delayed_position`].
    fn delay_s(&self) -> f64 {
        0.0
    }

    /// An upper bound of |∂g/∂z| at this motion (1/s), from which an integrator takes its step; 0 without fast hidden states.
    fn fastest_rate(&self, _motion: &Motion<'_>) -> f64 {
        0.0
    }

    /// Whether it jumps with the motion: samples of it then stand for more than what a band holds.
    fn jumps(&self) -> bool {
        false
    }

    /// Adds the resisting force of each axis to `force` and writes the rates ż to `rates`.
    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]);

    /// f/x of a linear law of one axis in frequency.
    fn response(&self, _s: Complex64) -> Option<Complex64> {
        None
    }
}

impl<L: ForceLaw + ?Sized> ForceLaw for std::sync::Arc<L> {
    fn states(&self) -> usize {
        (**self).states()
    }

    fn delay_s(&self) -> f64 {
        (**self).delay_s()
    }

    fn fastest_rate(&self, motion: &Motion<'_>) -> f64 {
        (**self).fastest_rate(motion)
    }

    fn jumps(&self) -> bool {
        (**self).jumps()
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        (**self).evaluate(motion, states, force, rates);
    }

    fn response(&self, s: Complex64) -> Option<Complex64> {
        (**self).response(s)
    }
}

impl<F: Fn(&Motion<'_>, &mut [f64]) + Send + Sync> ForceLaw for F {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        self(motion, force);
    }
}

/// A stage of the signal chain (delay, filter, quantiser, saturation), ticked once a sample; a closure is one.
pub trait Stage: Send {
    /// Turns this sample of the stage's channel into what leaves the stage.
    fn step(&mut self, sample: f64) -> f64;
}

impl<F: FnMut(f64) -> f64 + Send> Stage for F {
    fn step(&mut self, sample: f64) -> f64 {
        self(sample)
    }
}
