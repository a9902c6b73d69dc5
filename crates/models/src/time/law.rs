//! A force law as a fit sees it: parameters, an equation, and its exact slopes.

use super::jet::{Jet, Real};
use crate::blocks::BlockParameter;
use num_complex::Complex64;

/// What a force law feels at one instant, on its axis.
#[derive(Clone, Copy, Debug)]
pub struct Local<R> {
    /// Time since the window began.
    pub time_s: f64,
    /// Displacement (m, rad).
    pub position: R,
    /// Its rate.
    pub velocity: R,
    /// Displacement one [`Law::delay`] ago.
    pub delayed_position: R,
    /// Velocity one delay ago.
    pub delayed_velocity: R,
    /// Force that is applied to the axis.
    pub force: R,
    /// The same one delay ago.
    pub delayed_force: R,
}

/// How many of a law's variables are those of [`Local`].
pub const LOCAL_VARIABLES: usize = 6;
/// Local variables, states and parameters of one law together.
pub const LAW_VARIABLES: usize = 12;

/// A force law written once, for numbers with and without derivatives; [`Law`] follows from it.
///
/// M ẍ + B ẋ + K x + f(t, x, ẋ, z; θ) = F,  ż = g(t, x, ẋ, z; θ)
pub trait Equation: Send + Sync {
    /// What `ndof list models` calls it.
    const NAME: &'static str;
    /// f and g, as text.
    const EQUATION: &'static str;
    /// Where they come from.
    const SOURCE: &'static str;
    /// Number of hidden states z.
    const STATES: usize = 0;
    /// Which parameter is a delay, if one is.
    const DELAY: Option<usize> = None;
    /// Whether f jumps with the motion: samples of it then stand for more than what a band holds.
    const JUMPS: bool = false;

    /// Parameters; names and units of a rotation where `rotational`.
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter>;

    /// f, and ż into `rates`.
    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R;

    /// States that jump: what z becomes at the end of a step (slip, play).
    fn settle<R: Real>(&self, _theta: &[R], _position: R, _states: &mut [R]) {}

    /// An upper bound of |∂g/∂z| at this motion (1/s), from which an integrator takes its step; 0 without fast hidden states.
    fn fastest_rate(&self, _theta: &[f64], _at: &Local<f64>) -> f64 {
        0.0
    }

    /// f/x of a linear law in frequency.
    fn response(&self, _theta: &[f64], _s: Complex64) -> Option<Complex64> {
        None
    }
}

/// A force law that a mechanism can carry. Implement [`Equation`]; this follows.
pub trait Law: Send + Sync {
    /// Its name.
    fn name(&self) -> &'static str;
    /// Its equation, as text.
    fn equation(&self) -> &'static str;
    /// Where that comes from.
    fn source(&self) -> &'static str;
    /// Its parameters.
    fn parameters(&self, rotational: bool) -> Vec<BlockParameter>;
    /// Number of hidden states.
    fn states(&self) -> usize;
    /// Which parameter is a delay, if one is.
    fn delay(&self) -> Option<usize>;
    /// f, and ż into `rates`.
    fn evaluate(&self, theta: &[f64], at: &Local<f64>, states: &[f64], rates: &mut [f64]) -> f64;
    /// The same with slopes: row 0 those of f, row 1 + k those of ż_k; columns in the order of [`Local`]'s six numbers,
    /// states, parameters.
    fn linearise(&self, theta: &[f64], at: &Local<f64>, states: &[f64], rates: &mut [f64], slopes: &mut [f64]) -> f64;
    /// What the states become at the end of a step, and, where asked, ∂z/∂(x, z, θ) row by row.
    fn settle(&self, theta: &[f64], position: f64, states: &mut [f64], slopes: Option<&mut [f64]>);
    /// Whether [`Law::settle`] changes anything.
    fn settles(&self) -> bool;
    /// f/x of a linear law in frequency.
    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64>;
}

type Variable = Jet<LAW_VARIABLES>;

/// States and parameters of a law together.
const OWN: usize = LAW_VARIABLES - LOCAL_VARIABLES;

/// States and then parameters as variables, numbered from `first` on.
fn array(states: &[f64], theta: &[f64], first: usize) -> [Variable; OWN] {
    let mut out = [Variable::of(0.0); OWN];
    for (k, (variable, value)) in out.iter_mut().zip(states.iter().chain(theta)).enumerate() {
        *variable = Variable::variable(*value, first + k);
    }
    out
}

impl<E: Equation> Law for E {
    fn name(&self) -> &'static str {
        E::NAME
    }

    fn equation(&self) -> &'static str {
        E::EQUATION
    }

    fn source(&self) -> &'static str {
        E::SOURCE
    }

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        Equation::parameters(self, rotational)
    }

    fn states(&self) -> usize {
        E::STATES
    }

    fn delay(&self) -> Option<usize> {
        E::DELAY
    }

    fn evaluate(&self, theta: &[f64], at: &Local<f64>, states: &[f64], rates: &mut [f64]) -> f64 {
        self.force(theta, at, states, rates)
    }

    fn linearise(&self, theta: &[f64], at: &Local<f64>, states: &[f64], rates: &mut [f64], slopes: &mut [f64]) -> f64 {
        let variable = |value: f64, index: usize| Variable::variable(value, index);
        let local = Local {
            time_s: at.time_s,
            position: variable(at.position, 0),
            velocity: variable(at.velocity, 1),
            delayed_position: variable(at.delayed_position, 2),
            delayed_velocity: variable(at.delayed_velocity, 3),
            force: variable(at.force, 4),
            delayed_force: variable(at.delayed_force, 5),
        };
        let own = array(states, theta, LOCAL_VARIABLES);
        let (z, p) = own.split_at(states.len());
        let mut out = [Variable::of(0.0); OWN];
        let f = self.force(&p[..theta.len()], &local, z, &mut out[..states.len()]);
        let columns = LOCAL_VARIABLES + states.len() + theta.len();
        slopes[..columns].copy_from_slice(&f.slope[..columns]);
        for (k, rate) in out[..states.len()].iter().enumerate() {
            rates[k] = rate.value();
            slopes[(1 + k) * columns..(2 + k) * columns].copy_from_slice(&rate.slope[..columns]);
        }
        f.value()
    }

    fn settle(&self, theta: &[f64], position: f64, states: &mut [f64], slopes: Option<&mut [f64]>) {
        let Some(slopes) = slopes else { return Equation::settle(self, theta, position, states) };
        let mut own = array(states, theta, 1);
        let (z, p) = own.split_at_mut(states.len());
        Equation::settle(self, &p[..theta.len()], Variable::variable(position, 0), z);
        let columns = 1 + states.len() + theta.len();
        for (k, state) in states.iter_mut().enumerate() {
            *state = z[k].value();
            slopes[k * columns..(k + 1) * columns].copy_from_slice(&z[k].slope[..columns]);
        }
    }

    fn settles(&self) -> bool {
        let mut states = [0.5; LAW_VARIABLES];
        let theta: Vec<f64> = Equation::parameters(self, false).iter().map(|p| p.starts[0]).collect();
        Equation::settle(self, &theta, 1e9, &mut states[..E::STATES]);
        states != [0.5; LAW_VARIABLES]
    }

    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64> {
        Equation::response(self, theta, s)
    }
}
