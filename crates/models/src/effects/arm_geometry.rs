//! The curved geometry of an arm of two links.

use super::curved_arm::CurvedArm;
use super::vocabulary::*;

pub(super) const UPPER_ARM: ParameterCard = plain("upper_arm_m", "m", 1e-3, 1e3, Some(0.33));
pub(super) const FOREARM: ParameterCard = plain("forearm_m", "m", 1e-3, 1e3, Some(0.34));
pub(super) const SHOULDER: ParameterCard = plain("shoulder_rad", "rad", -7.0, 7.0, Some(std::f64::consts::FRAC_PI_4));
pub(super) const ELBOW: ParameterCard = plain("elbow_rad", "rad", -3.1, 3.1, Some(std::f64::consts::FRAC_PI_2));
const COUPLING: ParameterCard = plain("coupling_kg_m2", "kg m^2", 0.0, 1e6, Some(0.0));
const CARD: Card = Card {
    name: "arm-geometry",
    what: "the arm's curved geometry: inertia, damping and stiffness that are constant at the joints turn and change at the hand with the posture",
    sides: &[Side::Limb],
    parameters: &[COUPLING, UPPER_ARM, FOREARM, SHOULDER, ELBOW],
    signature: "a force that grows with the square of the amplitude, of all axes at once; at the joints the same limb is linear but for its inertia",
    look_alikes: &["asymmetric-stiffness", "posture-stiffness", "cubic-stiffness"],
    next_experiment: "the same perturbation in a second posture: geometry follows from the first, with the same joints",
    equation: "F = J⁻ᵀ (M(q) q̈ + h(q, q̇) + B q̇ + K (q − q₀) + J₀ᵀ F₀), M(q) = M(q₀) + coupling (cos q₂ − cos q₂₀) [2 1; 1 0]; hidden: the springs alone",
    source: "Hogan 1985, The mechanics of multi-joint posture and movement control",
    trace: Trace::Forms,
};

/// Curved geometry of an arm; looked for where the arm's kinematics are given.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

/// f = Pᵀ K w₀ − K x: springs of the joints beside what they are at the posture.
fn springs(arm: CurvedArm, stiffness: [[f64; 2]; 2]) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| {
        let x = [motion.position[0], motion.position[1]];
        let product = |of: [f64; 2]| stiffness.map(|row| row[0] * of[0] + row[1] * of[1]);
        let turned = arm.displaced(x).map_or([f64::NAN; 2], |arm| arm.carried(product(arm.stretch)));
        let straight = product(x);
        force.iter_mut().zip(turned).zip(straight).for_each(|((force, turned), straight)| *force += turned - straight);
    }
}

/// The arm that a simulation is told of.
pub(super) fn given_arm(effect: &'static str, parameters: &Parameters, setting: &Setting) -> Result<CurvedArm, EffectError> {
    let number = |card| parameters.number(effect, card);
    if setting.axes != 2 {
        return Err(EffectError::Setting { effect, what: "a limb of two axes in a plane" });
    }
    let (link_lengths_m, posture_rad) = ([number(&UPPER_ARM)?, number(&FOREARM)?], [number(&SHOULDER)?, number(&ELBOW)?]);
    Ok(CurvedArm { link_lengths_m, posture_rad, mean_force_n: [0.0; 2] })
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    if parameters.number(CARD.name, &COUPLING)? > 0.0 {
        let what = "an inertia that follows the posture for its coupling: simulate the limb planar-two-link, or leave the coupling out";
        return Err(EffectError::Setting { effect: CARD.name, what });
    }
    let arm = given_arm(CARD.name, parameters, setting)?;
    match setting.stiffness.as_slice() {
        [first, second] => Ok(Injection::Force(Box::new(springs(arm, [[first[0], first[1]], [second[0], second[1]]])))),
        _ => Err(EffectError::Setting { effect: CARD.name, what: "the stiffness of two axes" }),
    }
}

fn forms(scale: &Scale) -> Vec<Form> {
    let Some(arm) = &scale.arm else { return Vec::new() };
    let form = Form::new("two links", None, Action::Curved(arm.clone())).coefficients(vec![Sign::Positive]);
    vec![form.numbers(|_, c| [(COUPLING.name, c[0])]).floor(0.005)]
}
