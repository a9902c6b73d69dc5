//! A force sensor that is turned.

use super::vocabulary::*;

const ANGLE: ParameterCard = plain("angle_rad", "rad", -3.2, 3.2, Some(0.0));
const MATRIX: ParameterCard = plain("matrix", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "sensor-misalignment",
    what: "a rotated force sensor",
    sides: &[Side::Sensor],
    parameters: &[ANGLE, MATRIX],
    signature: "inertia, damping and stiffness asymmetric by the same angle",
    look_alikes: &["cross-coupling", "parameter-error"],
    next_experiment: "pull the handle along one axis with a cord: the other axis' force shows the angle",
    equation: "measured force = R(angle) force; simulated, any `matrix` of the forces",
    source: "rotation of axes; tan φ = (M_yx - M_xy) / (M_xx + M_yy)",
    trace: Trace::Forms,
};

/// Rotation of the effort channels.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn rotation(n: usize, (i, j): (usize, usize), angle: f64) -> Vec<Vec<f64>> {
    let mut matrix: Vec<Vec<f64>> = (0..n).map(|r| (0..n).map(|c| if r == c { 1.0 } else { 0.0 }).collect()).collect();
    let (sin, cos) = angle.sin_cos();
    (matrix[i][i], matrix[i][j], matrix[j][i], matrix[j][j]) = (cos, -sin, sin, cos);
    matrix
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    if let Some(matrix) = parameters.matrix("matrix") {
        return Ok(Injection::Mixing(matrix.to_vec()));
    }
    if setting.axes < 2 {
        return Err(EffectError::Setting { effect: CARD.name, what: "at least two axes" });
    }
    Ok(Injection::Mixing(rotation(setting.axes, (0, 1), parameters.number(CARD.name, &ANGLE)?)))
}

fn forms(scale: &Scale) -> Vec<Form> {
    let n = scale.axes();
    // Rotations are of space: two or three axes of one kind.
    let pairs: &[(usize, usize)] = match n {
        2 => &[(0, 1)],
        3 => &[(0, 1), (0, 2), (1, 2)],
        _ => &[],
    };
    pairs
        .iter()
        .map(|&pair| {
            Form::new("rotation", None, Action::Mix(Arc::new(move |k| rotation(n, pair, -k[0]))))
                .at(Side::Sensor)
                .knobs(vec![Knob::linear(-0.6, 0.6)], &[&[-0.15, -0.03, 0.03, 0.15]])
                .naming(move |k, _| vec![if n == 2 { ("angle_rad", Value::Number(k[0])) } else { ("matrix", Value::Matrix(rotation(n, pair, k[0]))) }])
                .floor(0.005)
                .absolute(ANGLE.name, 1e-3)
        })
        .collect()
}
