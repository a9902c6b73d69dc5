//! Rate-independent hysteresis.

use super::vocabulary::*;

const STIFFNESS: ParameterCard = mechanical("stiffness_n_per_m", ("N/m", "N m/rad"), 0.0, 1e9, None);
const YIELD: ParameterCard = mechanical("yield_m", ("m", "rad"), 1e-12, 1e6, None);
const SHAPE: ParameterCard = plain("shape", "", -2.0, 2.0, Some(1.0));
const CARD: Card = Card {
    name: "hysteresis",
    what: "a loop between force and displacement that does not depend on the rate (Bouc-Wen, Maxwell-slip)",
    sides: &[Side::Limb, Side::Robot],
    parameters: &[STIFFNESS, YIELD, SHAPE],
    signature: "apparent stiffness rises as the amplitude falls, damping is over-estimated, coherence is low below 1 Hz",
    look_alikes: &["coulomb-friction", "dead-zone", "reflex-delay", "viscoelastic", "limb-noise"],
    next_experiment: "the same perturbation at a third of the amplitude: hysteresis makes the arm stiffer, noise and friction do not",
    equation: "f = k z, dz = dx - (|dx| z + shape dx |z|) / (2 yield)",
    source: "Wen 1976, Method for random vibration of hysteretic systems; Iwan 1966 for the parallel elements",
    trace: Trace::Forms,
};

/// A loop that yields within this share of the displacement's standard deviation is as good as dry friction.
const NARROW: f64 = 0.12;

/// Hysteresis of one axis.
pub(super) const EFFECT: Effect = Effect { forms, stands_for, ..Effect::new(&CARD, injection) };

/// Parallel springs that slip, with yields spread around one.
struct Slip {
    axis: usize,
    stiffness: f64,
    yields: [f64; 3],
}

impl ForceLaw for Slip {
    fn states(&self) -> usize {
        3
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        let v = motion.velocity[self.axis];
        for (k, (&z, &y)) in states.iter().zip(&self.yields).enumerate() {
            force[self.axis] += self.stiffness * z.clamp(-y, y) / 3.0;
            rates[k] = if (z >= y && v > 0.0) || (z <= -y && v < 0.0) { 0.0 } else { v };
        }
    }

    fn fastest_rate(&self, motion: &Motion<'_>) -> f64 {
        motion.velocity[self.axis].abs() / self.yields[0]
    }
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let number = |card| parameters.number(CARD.name, card);
    let theta = [number(&STIFFNESS)?, number(&YIELD)?, number(&SHAPE)?];
    Ok(Injection::Force(Box::new(on_axis(setting.one_axis(&CARD)?, laws::BoucWen, theta))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    (0..scale.axes())
        .flat_map(|axis| {
            let x = scale.position[axis];
            let loop_of = move |k: &[f64], c: &[f64], shape: f64| on_axis(axis, laws::BoucWen, [c[0], k[0], shape]);
            let symmetric = Form::new("Bouc-Wen", Some(axis), Action::force(move |k, c| loop_of(k, c, 1.0)))
                .knobs(vec![Knob::log(0.02 * x, 0.9 * x)], &[&[0.04, 0.08, 0.15, 0.28, 0.45, 0.7].map(|q| q * x)])
                .numbers(|k, c| [("stiffness_n_per_m", c[0]), ("yield_m", k[0]), ("shape", 1.0)]);
            let shaped = Form::new("Bouc-Wen, any shape", Some(axis), Action::force(move |k, c| loop_of(k, c, k[1])))
                .knobs(vec![Knob::log(0.025 * x, 3.0 * x), Knob::linear(-1.5, 0.9)], &[&[0.15 * x, 0.4 * x, x], &[-1.1, -0.3]])
                .numbers(|k, c| [("stiffness_n_per_m", c[0]), ("yield_m", k[0]), ("shape", k[1])]);
            let slipping = Action::force(move |k, c| Slip { axis, stiffness: c[0], yields: [0.4 * k[0], k[0], 1.6 * k[0]] });
            let slip = Form::new("Maxwell-slip", Some(axis), slipping)
                .knobs(vec![Knob::log(0.03 * x, 0.9 * x)], &[&[0.06, 0.15, 0.3, 0.6].map(|q| q * x)])
                .numbers(|k, c| [("stiffness_n_per_m", c[0]), ("yield_m", k[0])]);
            [symmetric, shaped, slip].map(|form| form.coefficients(vec![Sign::Positive]))
        })
        .collect()
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    let narrow = evidence.number(&YIELD).is_some_and(|width| width < NARROW * evidence.position());
    if narrow && !evidence.beside.contains(&"coulomb-friction") { &["coulomb-friction"] } else { &[] }
}
