//! Vectors and rotations of space, in plain arrays.

/// A vector of three components.
pub(crate) type Vector = [f64; 3];
/// A 3 × 3 matrix in rows.
pub(crate) type Matrix = [[f64; 3]; 3];

pub(crate) const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

pub(crate) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn scale(a: Vector, s: f64) -> Vector {
    [s * a[0], s * a[1], s * a[2]]
}

pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn turn(m: &Matrix, v: Vector) -> Vector {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

pub(crate) fn transpose(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// R A Rᵀ: a tensor seen from the outer frame.
pub(crate) fn carried(r: &Matrix, a: &Matrix) -> Matrix {
    product(&product(r, a), &transpose(r))
}

/// Rotation by `angle` about the unit vector `axis` (Rodrigues' formula).
pub(crate) fn about(axis: Vector, angle: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    let [x, y, z] = axis;
    let v = 1.0 - c;
    [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
        [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
        [z * x * v - y * s, z * y * v + x * s, c + z * z * v],
    ]
}

/// Rotation of roll, pitch and yaw about the fixed axes x, y, z in this order, as URDF has it.
pub(crate) fn roll_pitch_yaw([roll, pitch, yaw]: Vector) -> Matrix {
    product(&about([0.0, 0.0, 1.0], yaw), &product(&about([0.0, 1.0, 0.0], pitch), &about([1.0, 0.0, 0.0], roll)))
}

/// m (|r|² 1 − r rᵀ), what moving a mass by r adds to its inertia (Steiner).
pub(crate) fn steiner(mass: f64, r: Vector) -> Matrix {
    let square = dot(r, r);
    std::array::from_fn(|i| std::array::from_fn(|j| mass * (if i == j { square } else { 0.0 } - r[i] * r[j])))
}

pub(crate) fn plus(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| add(a[i], b[i]))
}
