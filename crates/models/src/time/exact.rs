//! Exact steps of the linear mechanism under a force that is linear between samples.

use super::Mechanism;
use faer::Mat;

/// y⁺ = Φ y + Γ₀ u + Γ₁ u⁺ for y = (x, ẋ), and the derivatives of Φ, Γ₀, Γ₁ in each entry of M, B and K.
pub(super) struct Stepper {
    n: usize,
    step_s: f64,
    /// 2n × 4n: [Φ Γ₀ Γ₁].
    step: Vec<f64>,
    /// One such matrix a matrix parameter, transposed to (4n) × (parameters, padded) per row of y⁺ for long inner loops.
    slopes: Vec<f64>,
    matrix_parameters: usize,
    padded: usize,
    /// Whether each parameter of a force from outside is a trend (else an offset), axis after axis.
    outside: Vec<bool>,
    derivatives: bool,
}

/// Columns that one pass of the inner loop sums in registers.
const LANES: usize = 4;

/// e^A by scaling and squaring of its Taylor series; no numbers where A has an infinite one.
fn exponential(a: &Mat<f64>) -> Mat<f64> {
    let size = a.nrows();
    let norm = (0..size).map(|i| (0..size).map(|j| a[(i, j)].abs()).sum::<f64>()).fold(0.0, f64::max);
    if norm.is_infinite() {
        return Mat::full(size, size, f64::NAN);
    }
    let halvings = (norm.log2().ceil() as i32 + 3).max(0);
    let small = Mat::from_fn(size, size, |i, j| a[(i, j)] * 0.5f64.powi(halvings));
    let (mut sum, mut term) = (Mat::<f64>::identity(size, size), Mat::<f64>::identity(size, size));
    for k in 1..16 {
        let next = &term * &small;
        term = Mat::from_fn(size, size, |i, j| next[(i, j)] / f64::from(k));
        sum = &sum + &term;
    }
    for _ in 0..halvings {
        sum = &sum * &sum;
    }
    sum
}

impl Stepper {
    /// Of M⁻¹, B and K.
    pub(super) fn new([inverse, damping, stiffness]: [&[f64]; 3], mechanism: &Mechanism, entries: &[(usize, usize)], step_s: f64, derivatives: bool) -> Self {
        let n = mechanism.axes.len();
        let (size, per) = (4 * n, entries.len());
        // d/dt (x, ẋ, u, u̇ h) with M⁻¹K, M⁻¹B and M⁻¹ in the second row; exact over one step.
        let product = |a: &[f64], b: &[f64]| -> Vec<f64> { (0..n * n).map(|e| (0..n).map(|k| a[(e / n) * n + k] * b[k * n + e % n]).sum()).collect() };
        let generator = |k: &[f64], b: &[f64], inverse: &[f64], inner: bool| {
            let mut a = Mat::zeros(size, size);
            for i in 0..n {
                if inner {
                    a[(i, n + i)] = step_s;
                    a[(2 * n + i, 3 * n + i)] = 1.0;
                }
                for j in 0..n {
                    a[(n + i, j)] = -k[i * n + j] * step_s;
                    a[(n + i, n + j)] = -b[i * n + j] * step_s;
                    a[(n + i, 2 * n + j)] = inverse[i * n + j] * step_s;
                }
            }
            a
        };
        let (mk, mb) = (product(inverse, stiffness), product(inverse, damping));
        let own = generator(&mk, &mb, inverse, true);
        // u⁺ = u + u̇ h: Γ₁ is the column of u̇ h and Γ₀ that of u less it.
        let arrange = |e: &Mat<f64>, row: usize| -> Vec<f64> {
            (0..size)
                .map(|c| match c / n {
                    0 | 1 => e[(row, c)],
                    2 => e[(row, c)] - e[(row, n + c)],
                    _ => e[(row, c)],
                })
                .collect()
        };
        let whole = exponential(&own);
        let step = (0..2 * n).flat_map(|r| arrange(&whole, r)).collect();
        let matrix_parameters = mechanism.matrices() * per;
        let padded = matrix_parameters.div_ceil(LANES) * LANES;
        let mut slopes = Vec::new();
        if derivatives {
            let parts: Vec<Mat<f64>> = (0..matrix_parameters)
                .map(|p| {
                    let mut unit = vec![0.0; n * n];
                    let (i, j) = entries[p % per];
                    unit[i * n + j] = 1.0;
                    unit[j * n + i] = 1.0;
                    let zero = vec![0.0; n * n];
                    let turned = product(inverse, &unit);
                    let part = match p / per {
                        // d(M⁻¹ X) = −M⁻¹ dM M⁻¹ X
                        0 => {
                            let minus: Vec<f64> = turned.iter().map(|v| -v).collect();
                            generator(&product(&minus, &mk), &product(&minus, &mb), &product(&minus, inverse), false)
                        }
                        1 => generator(&zero, &turned, &zero, false),
                        _ => generator(&turned, &zero, &zero, false),
                    };
                    // The upper right block of the exponential of [[A, dA], [0, A]] is the derivative of e^A.
                    let pair = Mat::from_fn(2 * size, 2 * size, |r, c| match (r / size, c / size) {
                        (0, 0) => own[(r, c)],
                        (1, 1) => own[(r - size, c - size)],
                        (0, 1) => part[(r, c - size)],
                        _ => 0.0,
                    });
                    let both = exponential(&pair);
                    Mat::from_fn(2 * n, size, |r, c| both[(r, size + c)])
                })
                .collect();
            for r in 0..2 * n {
                let rows: Vec<Vec<f64>> = parts.iter().map(|part| arrange(part, r)).collect();
                for c in 0..size {
                    slopes.extend(rows.iter().map(|row| row[c]));
                    slopes.resize(slopes.len().next_multiple_of(padded), 0.0);
                }
            }
        }
        let outside = [(mechanism.offset, false), (mechanism.trend, true)].into_iter().filter(|o| o.0).flat_map(|o| std::iter::repeat_n(o.1, n)).collect();
        Stepper { n, step_s, step, slopes, matrix_parameters, padded, outside, derivatives }
    }

    /// As the run of a mechanism with laws.
    pub(super) fn run(&self, initial: &[f64], force: &[&[f64]], (offset, trend): (&[f64], &[f64]), mut sink: impl FnMut(&[f64])) {
        let n = self.n;
        let (size, parameters) = (4 * n, self.matrix_parameters + self.outside.len());
        let columns = if self.derivatives { parameters + 2 * n } else { 0 };
        let stride = columns.div_ceil(LANES) * LANES;
        let mut state = initial.to_vec();
        let mut sensitivity = vec![0.0; 2 * n * stride];
        if self.derivatives {
            (0..2 * n).for_each(|i| sensitivity[i * stride + parameters + i] = 1.0);
        }
        let (mut next, mut next_sensitivity) = (state.clone(), sensitivity.clone());
        let (mut known, mut output) = (vec![0.0; size], vec![0.0; n * (1 + columns)]);
        let samples = force.first().map_or(0, |f| f.len());
        for sample in 0..samples {
            for (i, row) in output.chunks_exact_mut(1 + columns).enumerate() {
                row[0] = state[i];
                row[1..].copy_from_slice(&sensitivity[i * stride..i * stride + columns]);
            }
            sink(&output);
            if sample + 1 == samples {
                break;
            }
            known[..2 * n].copy_from_slice(&state);
            for i in 0..n {
                for (k, at) in [(2, sample), (3, sample + 1)] {
                    known[k * n + i] = force[i][at] - offset[i] - trend[i] * at as f64 * self.step_s;
                }
            }
            for r in 0..2 * n {
                let step = &self.step[r * size..(r + 1) * size];
                next[r] = step.iter().zip(&known).map(|(a, b)| a * b).sum();
                if !self.derivatives {
                    continue;
                }
                let row = &mut next_sensitivity[r * stride..(r + 1) * stride];
                let slopes = &self.slopes[r * size * self.padded..(r + 1) * size * self.padded];
                for (chunk, out) in row.chunks_exact_mut(LANES).enumerate() {
                    let mut sum = [0.0; LANES];
                    for (factor, past) in step[..2 * n].iter().zip(sensitivity.chunks_exact(stride)) {
                        let past = &past[chunk * LANES..(chunk + 1) * LANES];
                        sum.iter_mut().zip(past).for_each(|(s, v)| *s += factor * v);
                    }
                    if chunk * LANES < self.padded {
                        for (factor, slope) in known.iter().zip(slopes.chunks_exact(self.padded)) {
                            let slope = &slope[chunk * LANES..(chunk + 1) * LANES];
                            sum.iter_mut().zip(slope).for_each(|(s, v)| *s += factor * v);
                        }
                    }
                    out.copy_from_slice(&sum);
                }
                let (start, end) = (sample as f64 * self.step_s, (sample + 1) as f64 * self.step_s);
                for (k, is_trend) in self.outside.iter().enumerate() {
                    let i = k % n;
                    let (a, b) = if *is_trend { (start, end) } else { (1.0, 1.0) };
                    row[self.matrix_parameters + k] -= step[2 * n + i] * a + step[3 * n + i] * b;
                }
            }
            std::mem::swap(&mut state, &mut next);
            std::mem::swap(&mut sensitivity, &mut next_sensitivity);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_of_a_turn_is_a_turn_and_that_of_an_infinite_number_is_none() {
        let turn = |angle: f64| exponential(&Mat::from_fn(2, 2, |i, j| angle * (j as f64 - i as f64)));
        // Squared 13 times: the error of one halving, doubled as often.
        let bound = 8192.0 * 4.0 * f64::EPSILON;
        assert!((turn(1000.0)[(0, 0)] - 1000f64.cos()).abs() < bound && (turn(1000.0)[(0, 1)] - 1000f64.sin()).abs() < bound);
        assert!([f64::INFINITY, f64::NEG_INFINITY].iter().all(|a| turn(*a)[(0, 1)].is_nan()));
    }
}
