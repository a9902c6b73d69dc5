//! A force channel that is ahead.

use super::vocabulary::*;

/// The force arrives τ later than it was recorded: f = F(t) − F(t − τ). Sub-sample; force in, motion out.
/// Not a force of the motion: what it does to F, e^(−sτ), is a [`Delay`](crate::blocks::Delay) of the channel.
#[derive(Clone, Copy, Debug)]
pub struct Latency;

impl Equation for Latency {
    const NAME: &'static str = "latency";
    const EQUATION: &'static str = "f = F(t) - F(t - delay)";
    const SOURCE: &'static str = "Björklund & Ljung 2003, A review of time-delay estimation techniques";
    const DELAY: Option<usize> = Some(0);

    fn parameters(&self, _rotational: bool) -> Vec<BlockParameter> {
        vec![BlockParameter::new("delay_s", "s", (0.0, 0.2), &[0.003])]
    }

    fn force<R: Real>(&self, _theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        at.force - at.delayed_force
    }
}
