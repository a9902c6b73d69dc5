//! Joint stiffness that follows the joint angles.

use super::arm_geometry::{ELBOW, FOREARM, SHOULDER, UPPER_ARM, given_arm};
use super::curved_arm::CurvedArm;
use super::vocabulary::*;

const fn slope(name: &'static str) -> ParameterCard {
    plain(name, "N m/rad^2", -1e9, 1e9, Some(0.0))
}

/// Shoulder, both joints, elbow: with the angle of the shoulder, then of the elbow.
const SLOPES: [ParameterCard; 6] = [
    slope("shoulder_with_shoulder_nm_per_rad2"),
    slope("coupling_with_shoulder_nm_per_rad2"),
    slope("elbow_with_shoulder_nm_per_rad2"),
    slope("shoulder_with_elbow_nm_per_rad2"),
    slope("coupling_with_elbow_nm_per_rad2"),
    slope("elbow_with_elbow_nm_per_rad2"),
];
const CARD: Card = Card {
    name: "posture-stiffness",
    what: "joint stiffness that varies with the posture",
    sides: &[Side::Limb],
    parameters: &[SLOPES[0], SLOPES[1], SLOPES[2], SLOPES[3], SLOPES[4], SLOPES[5], UPPER_ARM, FOREARM, SHOULDER, ELBOW],
    signature: "a force that grows with the square of the amplitude and is still there when the arm's own geometry is taken into account",
    look_alikes: &["arm-geometry", "asymmetric-stiffness", "varying-stiffness"],
    next_experiment: "small perturbations in several postures: the joint stiffness of each says how it varies, without any geometry between",
    equation: "τ = Σ_k (q_k − q₀_k) S_k (q − q₀), S_k symmetric, f = J⁻ᵀ τ",
    source: "Mussa-Ivaldi, Hogan & Bizzi 1985, Neural, mechanical, and geometric factors subserving arm posture in humans",
    trace: Trace::Forms,
};

/// Stiffness over joint angles; looked for where the arm's kinematics are given.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

/// f = J⁻ᵀ Σ_k u_k S_k u.
fn turning(arm: CurvedArm, slopes: [f64; 6]) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| {
        let hand = arm.displaced([motion.position[0], motion.position[1]]).map_or([f64::NAN; 2], |arm| {
            let u = arm.angles;
            let [a, b, d] = [0, 1, 2].map(|k| slopes[k] * u[0] + slopes[k + 3] * u[1]);
            arm.at_the_hand([a * u[0] + b * u[1], b * u[0] + d * u[1]])
        });
        force.iter_mut().zip(hand).for_each(|(force, own)| *force += own);
    }
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let arm = given_arm(CARD.name, parameters, setting)?;
    let mut slopes = [0.0; 6];
    for (value, card) in slopes.iter_mut().zip(&SLOPES) {
        *value = parameters.number(CARD.name, card)?;
    }
    Ok(Injection::Force(Box::new(turning(arm, slopes))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    let Some(arm) = scale.arm.as_ref().filter(|_| scale.spring) else { return Vec::new() };
    let of = |label: &'static str, places: std::ops::Range<usize>| {
        let (arm, from) = (arm.clone(), places.start);
        let names = SLOPES[places.clone()].iter().map(|card| card.name).collect::<Vec<_>>();
        let law = move |_: &[f64], c: &[f64]| {
            let mut slopes = [0.0; 6];
            slopes[from..from + c.len()].copy_from_slice(c);
            turning(arm.clone(), slopes)
        };
        Form::new(label, None, Action::force(law))
            .coefficients(vec![Sign::Free; places.len()])
            .naming(move |_, c| names.iter().copied().zip(c.iter().map(|c| Value::Number(*c))).collect())
            .floor(0.005)
    };
    vec![of("with the shoulder's angle", 0..3), of("with the elbow's angle", 3..6), of("with both angles", 0..6)]
}
