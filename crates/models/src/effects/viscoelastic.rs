//! Relaxation.

use super::on_axis::OnAxis;
use super::vocabulary::*;
use crate::blocks::{Block, Fractional};
use crate::time::laws::FractionalSum;
use num_complex::Complex64;

const MODULUS: ParameterCard = mechanical("modulus_n_per_m", ("N/m", "N m/rad"), 0.0, 1e12, Some(0.0));
const TIME: ParameterCard = plain("time_s", "s", 1e-9, 1e6, Some(0.1));
const COEFFICIENT: ParameterCard = mechanical("coefficient", ("N s^a/m", "N m s^a/rad"), 0.0, 1e12, Some(0.0));
const ORDER: ParameterCard = plain("order", "", 0.02, 0.98, Some(0.2));
const CARD: Card = Card {
    name: "viscoelastic",
    what: "relaxation that no viscous damper gives: a standard linear solid, or a fractional derivative",
    sides: &[Side::Limb],
    parameters: &[MODULUS, TIME, COEFFICIENT, ORDER],
    signature: "stiffness that rises with frequency over decades, loss that rises less than with frequency",
    look_alikes: &["hysteresis", "reflex-delay", "measurement-delay"],
    next_experiment: "the same perturbation at a third of the amplitude: relaxation is linear and stays the same, hysteresis changes",
    equation: "f = k s τ / (1 + s τ) x, or f = c s^order x",
    source: "Fung 1993, Biomechanics, ch. 2; Oustaloup et al. 2000 for the fractional derivative's approximation",
    trace: Trace::Forms,
};

/// Relaxation of one axis.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

/// Maxwell elements side by side, and a power of s beside them.
struct Relaxing {
    elements: Vec<OnAxis<laws::Relaxation, 2>>,
    power: Option<Power>,
}

/// c s^order of one axis, as the sum of [`laws::FractionalDamping`] in a unit of time T: c T^-order (s T)^order.
struct Power {
    axis: usize,
    theta: [f64; 2],
    time_s: f64,
    scale: f64,
    sum: FractionalSum,
}

impl Power {
    fn new(axis: usize, theta: [f64; 2], time_s: f64) -> Self {
        Power { axis, theta, time_s, scale: theta[0] * time_s.powf(-theta[1]), sum: laws::FractionalDamping::sum(theta[1]) }
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        let at = (motion.position[self.axis], self.time_s * motion.velocity[self.axis]);
        force[self.axis] += self.scale * self.sum.force(at, states, rates);
        rates.iter_mut().for_each(|rate| *rate /= self.time_s);
    }
}

impl ForceLaw for Relaxing {
    fn states(&self) -> usize {
        self.elements.len() + self.power.as_ref().map_or(0, |_| FractionalSum::STATES)
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        let ((own, of_power), (own_rates, power_rates)) = (states.split_at(self.elements.len()), rates.split_at_mut(self.elements.len()));
        let places = own.chunks_exact(1).zip(own_rates.chunks_exact_mut(1));
        self.elements.iter().zip(places).for_each(|(element, (state, rate))| element.evaluate(motion, state, force, rate));
        if let Some(power) = &self.power {
            power.evaluate(motion, of_power, force, power_rates);
        }
    }

    fn fastest_rate(&self, motion: &Motion<'_>) -> f64 {
        let of_power = self.power.as_ref().map_or(0.0, |power| FractionalSum::FASTEST_RATE / power.time_s);
        self.elements.iter().map(|element| element.fastest_rate(motion)).fold(of_power, f64::max)
    }

    fn response(&self, s: Complex64) -> Option<Complex64> {
        let power = self.power.as_ref().map_or(Complex64::ZERO, |power| Fractional.response(&power.theta, s));
        let sum: Option<Complex64> = self.elements.iter().map(|element| element.response(s)).sum();
        sum.map(|sum| sum + power)
    }
}

fn maxwell<const N: usize>(axis: usize, elements: [[f64; 2]; N]) -> Relaxing {
    Relaxing { elements: elements.map(|theta| on_axis(axis, laws::Relaxation, theta)).to_vec(), power: None }
}

fn fractional(axis: usize, theta: [f64; 2], time_s: f64) -> Relaxing {
    Relaxing { elements: vec![], power: Some(Power::new(axis, theta, time_s)) }
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let axis = setting.one_axis(&CARD)?;
    let mut law = maxwell(axis, [[parameters.number(CARD.name, &MODULUS)?, parameters.number(CARD.name, &TIME)?]]);
    let coefficient = parameters.number(CARD.name, &COEFFICIENT)?;
    if coefficient > 0.0 {
        let order = parameters.number(CARD.name, &ORDER)?;
        law.power = Some(Power::new(axis, [coefficient, order], 1.0));
    }
    Ok(Injection::Force(Box::new(law)))
}

fn forms(scale: &Scale) -> Vec<Form> {
    let unit = scale.time_s;
    let times = [0.03, 0.08, 0.2, 0.5].map(|t| t * unit);
    let knob = Knob { telling: true, ..Knob::log(0.02 * unit, 1.5 * unit) };
    (0..scale.axes())
        .flat_map(|axis| {
            let solid = Form::new("standard linear solid", Some(axis), Action::force(move |k, c| maxwell(axis, [[c[0], k[0]]])))
                .knobs(vec![knob], &[&times])
                .coefficients(vec![Sign::Positive])
                .numbers(|k, c| [("modulus_n_per_m", c[0]), ("time_s", k[0])]);
            let both = Action::force(move |k, c| maxwell(axis, [[c[0], k[0]], [c[1], 7.0 * k[0]]]));
            let two = Form::new("two relaxation times", Some(axis), both)
                .knobs(vec![knob], &[&times[..3]])
                .coefficients(vec![Sign::Positive, Sign::Positive])
                .numbers(|k, c| {
                    let time = (c[0] * k[0] + c[1] * 7.0 * k[0]) / (c[0] + c[1]).max(f64::MIN_POSITIVE);
                    [("modulus_n_per_m", c[0] + c[1]), ("time_s", time)]
                })
                .floor(0.1);
            let fraction = Form::new("fractional", Some(axis), Action::force(move |k, c| fractional(axis, [c[0], k[0]], unit)))
                .knobs(vec![Knob::linear(0.05, 0.85)], &[&[0.15, 0.35, 0.6]])
                .coefficients(vec![Sign::Positive])
                .numbers(|k, c| [("coefficient", c[0]), ("order", k[0])])
                .floor(0.02);
            [solid, two, fraction]
        })
        .collect()
}
