//! A force sensor that is turned.

use super::vocabulary::*;

const ANGLE: ParameterCard = plain("angle_rad", "rad", -3.2, 3.2, Some(0.0));
const CROSSTALK: ParameterCard = plain("crosstalk", "", -0.9, 0.9, Some(0.0));
const MATRIX: ParameterCard = plain("matrix", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "sensor-misalignment",
    what: "a rotated or cross-talking force sensor",
    sides: &[Side::Sensor],
    parameters: &[ANGLE, CROSSTALK, CHANNEL, MATRIX],
    signature: "inertia, damping and stiffness asymmetric by the same angle, or as one mixture of the forces makes them",
    look_alikes: &["sensor-scale", "cross-coupling", "parameter-error"],
    next_experiment: "pull the handle along one axis with a cord: the other axis' force shows the angle",
    equation: "measured force = R(angle) force; with crosstalk c of another axis: f_i + c f_j in the channel, in both without one",
    source: "rotation of axes; tan φ = (M_yx - M_xy) / (M_xx + M_yy)",
    trace: Trace::Forms,
};

/// Rotation or crosstalk of the effort channels.
pub struct SensorMisalignment;

fn identity(n: usize) -> Vec<Vec<f64>> {
    (0..n).map(|r| (0..n).map(|c| if r == c { 1.0 } else { 0.0 }).collect()).collect()
}

fn rotation(n: usize, (i, j): (usize, usize), angle: f64) -> Vec<Vec<f64>> {
    let mut matrix = identity(n);
    let (sin, cos) = angle.sin_cos();
    (matrix[i][i], matrix[i][j], matrix[j][i], matrix[j][j]) = (cos, -sin, sin, cos);
    matrix
}

/// The channels of some axes read so much of the other one's force.
fn crosstalk(n: usize, (i, j): (usize, usize), readers: &[usize], share: f64) -> Vec<Vec<f64>> {
    let mut matrix = identity(n);
    readers.iter().for_each(|&r| matrix[r][if r == i { j } else { i }] = share);
    matrix
}

/// The inverse of a mixture of two channels.
fn unmixed(mut matrix: Vec<Vec<f64>>, (i, j): (usize, usize)) -> Vec<Vec<f64>> {
    let (a, b) = (matrix[i][j], matrix[j][i]);
    let size = 1.0 - a * b;
    (matrix[i][i], matrix[i][j], matrix[j][i], matrix[j][j]) = (1.0 / size, -a / size, -b / size, 1.0 / size);
    matrix
}

impl Effect for SensorMisalignment {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn injection(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        if let Some(matrix) = parameters.matrix("matrix") {
            return Ok(Injection::Mixing(matrix.to_vec()));
        }
        if setting.axes < 2 {
            return Err(EffectError::Setting { effect: CARD.name, what: "at least two axes" });
        }
        if parameters.text(CHANNEL.name).is_some() {
            let expected = "left out: answers alone have it, and a `matrix` says which channel reads which";
            return Err(EffectError::Kind { effect: CARD.name, parameter: CHANNEL.name, expected });
        }
        let share = parameters.number(CARD.name, &CROSSTALK)?;
        if share != 0.0 {
            return Ok(Injection::Mixing(crosstalk(setting.axes, (0, 1), &[0, 1], share)));
        }
        Ok(Injection::Mixing(rotation(setting.axes, (0, 1), parameters.number(CARD.name, &ANGLE)?)))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let n = scale.axes();
        // Rotations are of space: two or three axes of one kind.
        let pairs: &[(usize, usize)] = match n {
            2 => &[(0, 1)],
            3 => &[(0, 1), (0, 2), (1, 2)],
            _ => &[],
        };
        let of_pair = |&pair: &(usize, usize)| {
            let rotated = Form::new("rotation", None, Action::Mix(Arc::new(move |k| rotation(n, pair, -k[0]))))
                .at(Side::Sensor)
                .knobs(vec![Knob::linear(-0.6, 0.6)], &[&[-0.15, -0.03, 0.03, 0.15]])
                .naming(move |k, _| vec![if n == 2 { ("angle_rad", Value::Number(k[0])) } else { ("matrix", Value::Matrix(rotation(n, pair, k[0]))) }])
                .floor(0.005)
                .absolute(ANGLE.name, 1e-3);
            let mixed = |label: &'static str, axis: Option<usize>, readers: Vec<usize>| {
                let channel = axis.and_then(|axis| scale.effort_names.get(axis).cloned());
                let told = move |k: &[f64], _: &[f64]| {
                    let share = [("crosstalk", Value::Number(k[0]))];
                    share.into_iter().chain(channel.clone().map(|name| ("channel", Value::Text(name)))).collect()
                };
                Form::new(label, None, Action::Mix(Arc::new(move |k| unmixed(crosstalk(n, pair, &readers, k[0]), pair))))
                    .at(Side::Sensor)
                    .knobs(vec![Knob::linear(-0.6, 0.6)], &[&[-0.15, -0.03, 0.03, 0.15]])
                    .naming(told)
                    .floor(0.005)
                    .in_open_loop()
            };
            let (i, j) = pair;
            // Matrices that need not be symmetric absorb it.
            let both = || {
                [
                    mixed("crosstalk in one channel", Some(i), vec![i]),
                    mixed("crosstalk in one channel", Some(j), vec![j]),
                    mixed("crosstalk in both channels", None, vec![i, j]),
                ]
            };
            std::iter::once(rotated).chain(scale.symmetric.then(both).into_iter().flatten())
        };
        pairs.iter().flat_map(of_pair).collect()
    }
}
