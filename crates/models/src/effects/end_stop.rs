//! A wall within the range of motion.

use super::static_force::other_shapes;
use super::vocabulary::*;

const POSITION: ParameterCard = mechanical("position_m", ("m", "rad"), -1e6, 1e6, None);
const STIFFNESS: ParameterCard = mechanical("stiffness_n_per_m", ("N/m", "N m/rad"), 0.0, 1e12, None);
const DAMPING: ParameterCard = mechanical("damping_n_s_per_m2", ("N s/m^2", "N m s/rad^2"), 0.0, 1e12, Some(0.0));
const CARD: Card = Card {
    name: "end-stop",
    what: "a wall inside the range of motion",
    sides: &[Side::Limb, Side::Environment],
    parameters: &[POSITION, STIFFNESS, DAMPING],
    signature: "a force that is there only beyond one position, the displacement's distribution is cut on that side",
    look_alikes: &["asymmetric-stiffness", "cubic-stiffness"],
    next_experiment: "the same perturbation at half the amplitude, away from the wall: it disappears",
    equation: "f = d (k + c ḋ) beyond p > 0, -d (k + c ḋ) beyond p < 0, with the depth d = |x - p|",
    source: "Nayfeh & Mook 1979, Nonlinear oscillations; Hunt & Crossley 1975 for the soft contact",
    trace: Trace::Forms,
};

/// A wall on one side of one axis.
pub(super) const EFFECT: Effect = Effect { forms, stands_for, ..Effect::new(&CARD, injection) };

/// A wall at `position` on one `side`: its force is depth^exponent (stiffness + damping × the depth's rate), by Hunt and Crossley.
fn wall(axis: usize, position: f64, side: f64, exponent: f64, [stiffness, damping]: [f64; 2]) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| {
        let depth = (side * (motion.position[axis] - position)).max(0.0);
        let rate = side * motion.velocity[axis];
        force[axis] += side * depth.powf(exponent) * (stiffness + damping * rate);
    }
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let [position, stiffness, damping] = [&POSITION, &STIFFNESS, &DAMPING].map(|card| parameters.number(CARD.name, card));
    let axis = setting.one_axis(&CARD)?;
    let position = position?;
    Ok(Injection::Force(Box::new(wall(axis, position, position.signum(), 1.0, [stiffness?, damping?]))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    let of = |axis: usize, side: f64, (label, exponent, coefficients): (&'static str, f64, usize)| {
        let (spread, centre) = (scale.position[axis], scale.centre[axis]);
        let damping = |c: &[f64]| c.get(1).copied();
        let law = move |k: &[f64], c: &[f64]| wall(axis, side * k[0], side, exponent, [c[0], damping(c).unwrap_or(0.0)]);
        Form::new(label, Some(axis), Action::force(law))
            .knobs(vec![Knob::linear(0.5 * spread, 2.6 * spread)], &[&[0.6, 1.0, 1.4, 1.8].map(|q| q * spread)])
            .coefficients(vec![Sign::Positive; coefficients])
            .naming(move |k, c| {
                let place = ("position_m", Value::Number(side * k[0] + centre));
                let stiffness = ("stiffness_n_per_m", Value::Number(c[0] * spread.powf(exponent - 1.0)));
                [place, stiffness].into_iter().chain(damping(c).map(|c| ("damping_n_s_per_m2", Value::Number(c)))).collect()
            })
            .floor(0.02)
    };
    let shapes = [("wall", 1.0, 1), ("soft wall", 1.5, 1), ("damped wall", 1.0, 2)];
    (0..scale.axes()).flat_map(|axis| [1.0, -1.0].into_iter().flat_map(move |side| shapes.map(|shape| of(axis, side, shape)))).collect()
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    other_shapes(CARD.name, evidence)
}
