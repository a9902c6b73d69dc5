//! Forces that change with the time since a recording began.

use super::card::{ParameterCard, plain};
use super::form::{Action, Form, Knob, Scale, Sign};
use super::parameters::Value;
use crate::force_law::{ForceLaw, Motion};
use num_complex::Complex64;

/// How fast what drifts comes to rest.
pub(super) const SETTLING_RATE: ParameterCard = plain("settling_per_s", "1/s", 0.0, 1e6, Some(0.0));

/// (e^{-λ m} - e^{-λ t}) / λ: from a slope of one at t = 0 to rest at the rate λ (1/s), and through nothing at m; t - m at λ = 0.
pub(super) fn course(settling_per_s: f64, middle_s: f64, time_s: f64) -> f64 {
    if settling_per_s == 0.0 {
        time_s - middle_s
    } else {
        -(-settling_per_s * middle_s).exp() * (-settling_per_s * (time_s - middle_s)).exp_m1() / settling_per_s
    }
}

/// The mean of [`course`] over a part around `analysed_s` that begins with the recording.
pub(super) fn mean_course(settling_per_s: f64, middle_s: f64, analysed_s: f64) -> f64 {
    let reach = settling_per_s * analysed_s;
    let spread = if reach == 0.0 { 0.0 } else { (reach.sinh() / reach - 1.0) * (-reach).exp() / settling_per_s };
    course(settling_per_s, middle_s, analysed_s) - spread
}

/// f = course(t) (stiffness x + force), axis by axis.
pub(super) struct Drift {
    pub middle_s: f64,
    pub settling_per_s: f64,
    pub stiffness: Vec<Vec<f64>>,
    pub force: Vec<f64>,
}

impl ForceLaw for Drift {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let time = course(self.settling_per_s, self.middle_s, motion.time_s);
        for (i, f) in force.iter_mut().enumerate() {
            let spring: f64 = self.stiffness.get(i).map_or(0.0, |row| row.iter().zip(motion.position).map(|(k, x)| k * x).sum());
            *f += time * (spring + self.force.get(i).copied().unwrap_or(0.0));
        }
    }
}

/// A matrix with one entry.
pub(super) fn single(n: usize, i: usize, value: f64) -> Vec<Vec<f64>> {
    (0..n).map(|r| (0..n).map(|c| if r == i && c == i { value } else { 0.0 }).collect()).collect()
}

/// Rates of settling that a search starts from, over the duration: still on its way at the end, just at rest there, and at rest for most of it.
const SETTLING: [f64; 3] = [2.0, 6.0, 20.0];
/// Slower than the least it is a line, faster than the most an initial state, for all that the recording says.
const SLOWEST_AND_FASTEST: [f64; 2] = [0.5, 60.0];

/// With the rate of settling as a knob, over this duration.
pub(super) fn settles(form: Form, duration_s: f64) -> Form {
    let [slowest, fastest] = SLOWEST_AND_FASTEST.map(|rate| rate / duration_s);
    form.knobs(vec![Knob::log(slowest, fastest)], &[&SETTLING.map(|rate| rate / duration_s)])
}

/// Forms of a force of one axis that grows with time, straight and settling; it follows time whatever the motion does. `names` tells the parameters
/// from the force's first slope and the rate at which it settles.
pub(super) fn wander(axis: usize, scale: &Scale, names: impl Fn(f64, Option<f64>) -> Vec<(&'static str, Value)> + Clone + Send + Sync + 'static) -> [Form; 2] {
    let (n, middle_s) = (scale.axes(), scale.duration_s / 2.0);
    let law = move |settling_per_s: f64, slope: f64| Drift {
        middle_s,
        settling_per_s,
        stiffness: vec![],
        force: (0..n).map(|i| if i == axis { slope } else { 0.0 }).collect(),
    };
    let straight = Action::tangent(move |_, c| law(0.0, c[0]), |_, _| Complex64::ZERO);
    let settling = Action::tangent(move |k, c| law(k[0], c[0]), |_, _| Complex64::ZERO);
    let of_line = names.clone();
    [
        Form::new("straight", Some(axis), straight).naming(move |_, c| of_line(c[0], None)),
        settles(Form::new("settling", Some(axis), settling), scale.duration_s).naming(move |k, c| names(c[0], Some(k[0]))),
    ]
    .map(|form| form.coefficients(vec![Sign::Free]))
}
