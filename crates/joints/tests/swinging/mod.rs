//! Links on gears by Runge-Kutta steps of a hundredth of a sample: a second description, for tests inside the crate and outside.

/// Angle and rate at so many samples of what obeys q̈ = `acceleration`(t, [q, q̇]) from a time and a state on.
pub fn swinging(rate_hz: f64, samples: usize, from_s: f64, state: [f64; 2], acceleration: impl Fn(f64, [f64; 2]) -> f64) -> Vec<[f64; 2]> {
    const STEPS: usize = 100;
    let step = 1.0 / rate_hz / STEPS as f64;
    let moves = |t: f64, x: [f64; 2]| [x[1], acceleration(t, x)];
    let after = |x: [f64; 2], d: [f64; 2], h: f64| [x[0] + h * d[0], x[1] + h * d[1]];
    let (mut x, mut out) = (state, Vec::with_capacity(samples));
    for k in 0..samples * STEPS {
        let t = from_s + k as f64 * step;
        if k % STEPS == 0 {
            out.push(x);
        }
        let a = moves(t, x);
        let b = moves(t + 0.5 * step, after(x, a, 0.5 * step));
        let c = moves(t + 0.5 * step, after(x, b, 0.5 * step));
        let d = moves(t + step, after(x, c, step));
        x = after(x, std::array::from_fn(|i| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0), step);
    }
    out
}
