//! Relaxation.

use super::vocabulary::*;
use num_complex::Complex64;
use std::f64::consts::PI;

const MODULUS: ParameterCard = mechanical("modulus_n_per_m", ("N/m", "N m/rad"), 0.0, 1e12, Some(0.0));
const TIME: ParameterCard = plain("time_s", "s", 1e-9, 1e6, Some(0.1));
const COEFFICIENT: ParameterCard = mechanical("coefficient", ("N s^a/m", "N m s^a/rad"), 0.0, 1e12, Some(0.0));
const ORDER: ParameterCard = plain("order", "", 0.0, 1.0, Some(0.2));
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
pub struct Viscoelastic;

/// Parallel Maxwell elements: a spring and a damper in series each.
pub(super) struct Maxwell {
    pub axis: usize,
    /// Stiffness and relaxation time of each.
    pub elements: Vec<(f64, f64)>,
}

impl ForceLaw for Maxwell {
    fn states(&self) -> usize {
        self.elements.len()
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        for (k, (&(stiffness, time), &damper)) in self.elements.iter().zip(states).enumerate() {
            let stretch = motion.position[self.axis] - damper;
            force[self.axis] += stiffness * stretch;
            rates[k] = stretch / time;
        }
    }

    fn fastest_rate(&self, _motion: &Motion<'_>) -> f64 {
        self.elements.iter().map(|e| 1.0 / e.1).fold(0.0, f64::max)
    }
}

/// The fractional derivative s^order as Maxwell elements with times spaced by a factor of 2, from 5e-4 to 1e3 units of time.
///
/// s^a = (sin a π / π) ∫ s τ / (1 + s τ) τ^(-a-1) dτ; the sum over a logarithmic grid is within 0.4 % for a step of 2.
pub(super) fn fractional(axis: usize, coefficient: f64, order: f64, time_s: f64) -> Maxwell {
    let step = std::f64::consts::LN_2;
    let weight = |time: f64| coefficient * (order * PI).sin() / PI * step * time.powf(-order);
    let mut elements: Vec<(f64, f64)> = (-11..=10).map(|k| time_s * 2f64.powi(k)).map(|time| (weight(time), time)).collect();
    // All longer times together: a geometric series of springs that do not relax any more.
    elements.push((weight(time_s * 2f64.powi(11)) / (1.0 - 2f64.powf(-order)), f64::INFINITY));
    Maxwell { axis, elements }
}

fn relax(s: Complex64, time: f64) -> Complex64 {
    s * time / (1.0 + s * time)
}

impl Effect for Viscoelastic {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let axis = setting.one_axis(&CARD)?;
        let mut law = Maxwell { axis, elements: vec![(parameters.number(CARD.name, &MODULUS)?, parameters.number(CARD.name, &TIME)?)] };
        let coefficient = parameters.number(CARD.name, &COEFFICIENT)?;
        if coefficient > 0.0 {
            law.elements.extend(fractional(axis, coefficient, parameters.number(CARD.name, &ORDER)?, 1.0).elements);
        }
        Ok(Injection::Force(Box::new(law)))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let unit = scale.time_s;
        let times = [0.03, 0.08, 0.2, 0.5].map(|t| t * unit);
        let knob = Knob { telling: true, ..Knob::log(0.02 * unit, 1.5 * unit) };
        (0..scale.axes())
            .flat_map(|axis| {
                let maxwell = move |elements: Vec<(f64, f64)>| Maxwell { axis, elements };
                let fast: Operator = Arc::new(|s, k| relax(s, k[0]));
                let one = Action::linear(move |k, c| maxwell(vec![(c[0], k[0])]), vec![fast.clone()]);
                let solid = Form::new("standard linear solid", Some(axis), one)
                    .knobs(vec![knob], &[&times])
                    .coefficients(vec![Sign::Positive])
                    .numbers(|k, c| [("modulus_n_per_m", c[0]), ("time_s", k[0])]);
                let both = vec![fast, Arc::new(|s: Complex64, k: &[f64]| relax(s, 7.0 * k[0]))];
                let two = Form::new("two relaxation times", Some(axis), Action::linear(move |k, c| maxwell(vec![(c[0], k[0]), (c[1], 7.0 * k[0])]), both))
                    .knobs(vec![knob], &[&times[..3]])
                    .coefficients(vec![Sign::Positive, Sign::Positive])
                    .numbers(|k, c| {
                        let time = (c[0] * k[0] + c[1] * 7.0 * k[0]) / (c[0] + c[1]).max(f64::MIN_POSITIVE);
                        [("modulus_n_per_m", c[0] + c[1]), ("time_s", time)]
                    })
                    .floor(0.1, 0.0);
                let power: Operator = Arc::new(|s, k| if s.norm() > 0.0 { (s.ln() * k[0]).exp() } else { Complex64::ZERO });
                let fraction = Form::new("fractional", Some(axis), Action::linear(move |k, c| fractional(axis, c[0], k[0], unit), vec![power]))
                    .knobs(vec![Knob::linear(0.05, 0.85)], &[&[0.15, 0.35, 0.6]])
                    .coefficients(vec![Sign::Positive])
                    .numbers(|k, c| [("coefficient", c[0]), ("order", k[0])])
                    .floor(0.02, 0.0);
                [solid, two, fraction]
            })
            .collect()
    }
}
