//! Time stepping: the stiff linear part exactly, the rest by an exponential Runge-Kutta method of order 4.

use crate::coupled::Coupled;
use crate::exponential::phi_functions;
use ndarray::Array2;

/// Weights of one step length, for ẏ = L y + N(t, y) (Cox and Matthews, J. Comput. Phys. 176 (2002) 430, eqs. 26-29, written in increments).
struct Weights {
    step: f64,
    half: Columns,
    whole: Columns,
    middle: Columns,
    last: Columns,
    integral: Columns,
    integral_middle: Columns,
    integral_last: Columns,
}

/// A matrix in columns padded to a multiple of four rows, so that a product is a run of four-wide multiply-adds.
struct Columns {
    rows: usize,
    data: Vec<[f64; LANES]>,
}

const LANES: usize = 4;

impl Columns {
    fn new(a: &Array2<f64>) -> Self {
        let rows = a.nrows().div_ceil(LANES);
        let entry = |i: usize, j: usize| if i < a.nrows() { a[[i, j]] } else { 0.0 };
        let data = (0..a.ncols()).flat_map(|j| (0..rows).map(move |k| (j, k))).map(|(j, k)| std::array::from_fn(|l| entry(LANES * k + l, j))).collect();
        Columns { rows, data }
    }

    /// y += A x; `y` is padded.
    fn add_to(&self, x: &[f64], y: &mut [f64]) {
        match self.rows {
            1 => self.add_rows::<1>(x, y),
            2 => self.add_rows::<2>(x, y),
            3 => self.add_rows::<3>(x, y),
            4 => self.add_rows::<4>(x, y),
            _ => {
                for (column, &x) in self.data.chunks_exact(self.rows).zip(x) {
                    for (a, y) in column.iter().zip(y.chunks_exact_mut(LANES)) {
                        for l in 0..LANES {
                            y[l] += a[l] * x;
                        }
                    }
                }
            }
        }
    }

    /// The same with the sums in registers.
    fn add_rows<const ROWS: usize>(&self, x: &[f64], y: &mut [f64]) {
        let mut sums = [[0.0; LANES]; ROWS];
        let (columns, _) = self.data.as_chunks::<ROWS>();
        for (column, &x) in columns.iter().zip(x) {
            for (sum, a) in sums.iter_mut().zip(column) {
                for l in 0..LANES {
                    sum[l] += a[l] * x;
                }
            }
        }
        for (y, sum) in y.chunks_exact_mut(LANES).zip(&sums) {
            for l in 0..LANES {
                y[l] += sum[l];
            }
        }
    }
}

/// How far the halving of a sample interval may go: 2⁻⁷ of it, 16 µs at 500 Hz.
const FINEST: usize = 7;

/// Integrates a coupled system from sample to sample.
pub(crate) struct Stepper {
    levels: Vec<Weights>,
    linear: Columns,
    level: usize,
    coarsest: usize,
    tolerance: Option<Tolerance>,
    jacobian: Vec<f64>,
    interval: f64,
    // Whether the system's last evaluation was of the state that the next interval begins with.
    started: bool,
    buffers: Buffers,
}

/// Largest error of a step in the rates of joints and deflection.
struct Tolerance {
    joint: f64,
    deflection: f64,
}

struct Buffers {
    f: Vec<f64>,
    stage: Vec<f64>,
    rates: Vec<f64>,
    first: Vec<f64>,
    middle: Vec<f64>,
    change: Vec<f64>,
    next: Vec<f64>,
    base: Vec<f64>,
    sum: Vec<f64>,
    moved: Vec<f64>,
    deflection: Vec<f64>,
    remainder: [Vec<f64>; 3],
}

/// Means over a sample interval.
#[derive(Clone, Debug)]
pub(crate) struct Means {
    /// Force on the limb.
    pub(crate) force: Vec<f64>,
    /// Endpoint coordinates.
    pub(crate) endpoint: Vec<f64>,
    /// Joint coordinates.
    pub(crate) joints: Vec<f64>,
}

impl Means {
    pub(crate) fn new(axes: usize, joints: usize) -> Self {
        Means { force: vec![0.0; axes], endpoint: vec![0.0; axes], joints: vec![0.0; joints] }
    }

    fn clear(&mut self) {
        for part in [&mut self.force, &mut self.endpoint, &mut self.joints] {
            part.fill(0.0);
        }
    }
}

/// Accuracy of the integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Accuracy {
    /// Steps are halved and doubled so that force and motion keep about this error relative to their size (rms over the record,
    /// about the mean), for arms, lightly damped springs and free motions alike. Laws that jump are met to the order of a finest step, 16 µs.
    Relative(f64),
    /// 2ᵏ equal steps a sample.
    Fixed(u32),
}

impl Stepper {
    pub(crate) fn new(system: &Coupled<'_>, interval_s: f64, accuracy: Accuracy) -> Self {
        let linear = system.linear_part();
        let (dimension, m) = (system.dimension(), system.axes());
        let padded = dimension.next_multiple_of(LANES);
        let needed = system.shortest_delay_s();
        let coarsest = (1..FINEST).find(|k| interval_s / 2f64.powi(*k as i32) <= needed).unwrap_or(FINEST);
        let (level, finest, tolerance) = match accuracy {
            Accuracy::Fixed(level) => {
                let level = coarsest.max(level as usize);
                (level, level, None)
            }
            Accuracy::Relative(relative) => {
                let (joint, deflection) = (relative * JOINT_RATE_SCALE, relative * DEFLECTION_RATE_SCALE);
                (coarsest, FINEST, Some(Tolerance { joint, deflection }))
            }
        };
        let (n, read) = (system.joints(), 2 * system.joints());
        let means: Vec<usize> = (0..n).chain(read..read + m).collect();
        let levels = (0..=finest).map(|k| Weights::new(&linear, interval_s / 2f64.powi(k as i32), &means)).collect();
        let zeros = || vec![0.0; padded];
        let buffers = Buffers {
            f: zeros(),
            stage: zeros(),
            rates: zeros(),
            first: zeros(),
            middle: zeros(),
            change: zeros(),
            next: zeros(),
            base: zeros(),
            sum: zeros(),
            moved: zeros(),
            deflection: vec![0.0; m],
            remainder: std::array::from_fn(|_| vec![0.0; m]),
        };
        Stepper {
            levels,
            linear: Columns::new(&linear),
            level,
            coarsest,
            tolerance,
            jacobian: system.jacobian().to_vec(),
            interval: interval_s,
            started: false,
            buffers,
        }
    }

    /// The shortest step that will ever be taken over intervals of this length.
    pub(crate) fn shortest_step_s(interval_s: f64, accuracy: Accuracy) -> f64 {
        let finest = if let Accuracy::Fixed(level) = accuracy { FINEST.max(level as usize) } else { FINEST };
        interval_s / 2f64.powi(finest as i32)
    }

    /// Room for a state of `system`, padded as the stepper needs it.
    pub(crate) fn state(&self, start: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.buffers.f.len()];
        y[..start.len()].copy_from_slice(start);
        y
    }

    /// Takes the state `y` over the sample interval that begins at `time_s` and writes the means of force and motion.
    pub(crate) fn interval(&mut self, system: &mut Coupled<'_>, time_s: f64, y: &mut [f64], means: &mut Means) {
        let (n, m, dimension) = (system.joints(), system.axes(), system.dimension());
        means.clear();
        if self.started {
            system.inputs_changed(time_s, &y[..dimension], &mut self.buffers.f[..dimension]);
        } else {
            system.derivative(time_s, &y[..dimension], &mut self.buffers.f[..dimension]);
            remainder(system, &self.jacobian, y, &mut self.buffers.remainder[0]);
            self.started = true;
        }
        system.remember(time_s, &self.buffers.f[..dimension], true);
        self.buffers.deflection.copy_from_slice(&y[2 * n..2 * n + m]);
        // Position in the interval, in units of its finest subdivision.
        let (mut done, finest) = (0usize, 1usize << (self.levels.len() - 1));
        while done < finest {
            let mut span = finest >> self.level;
            while done % span != 0 {
                self.level += 1;
                span /= 2;
            }
            let at = time_s + self.interval * done as f64 / finest as f64;
            let error = self.attempt(system, at, y);
            if error > 1.0 && self.level + 1 < self.levels.len() {
                self.level += 1;
                continue;
            }
            self.accept(system, at + self.levels[self.level].step, y, means);
            done += span;
            if self.tolerance.is_some() && error < 1.0 / 40.0 && self.level > self.coarsest {
                self.level -= 1;
            }
        }
        let transducer = system.transducer;
        for i in 0..m {
            means.force[i] =
                transducer.stiffness * means.force[i] / self.interval + transducer.damping * (y[2 * n + i] - self.buffers.deflection[i]) / self.interval;
        }
        for j in 0..n {
            means.joints[j] /= self.interval;
        }
        for i in 0..m {
            let row = &self.jacobian[i * n..(i + 1) * n];
            means.endpoint[i] = means.endpoint[i] / self.interval + system.rest_endpoint[i] + row.iter().zip(&means.joints).map(|(j, q)| j * q).sum::<f64>();
        }
        for (mean, rest) in means.joints.iter_mut().zip(&system.rest) {
            *mean += rest;
        }
    }

    /// One step from `y` into `buffers.next`, with its error over the tolerance.
    fn attempt(&mut self, system: &mut Coupled<'_>, time: f64, y: &[f64]) -> f64 {
        let (n, m, d) = (system.joints(), system.axes(), system.dimension());
        let w = &self.levels[self.level];
        let b = &mut self.buffers;
        let h = w.step;
        // a = y + Q f
        b.base.copy_from_slice(y);
        w.half.add_to(&b.f[..d], &mut b.base);
        system.derivative(time + 0.5 * h, &b.base[..d], &mut b.rates[..d]);
        remainder(system, &self.jacobian, &b.base, &mut b.remainder[1]);
        change(&self.linear, [&b.rates, &b.f], [&b.base, y], &mut b.moved, &mut b.first);
        // c = a + Q (L a + 2 N_b − N_n) = a + Q (f_a − D_a + 2 D_b)
        for i in 0..b.sum.len() {
            b.sum[i] = b.rates[i] - b.first[i];
        }
        // b = a + Q (N_a − N_n)
        b.stage.copy_from_slice(&b.base);
        w.half.add_to(&b.first[..d], &mut b.stage);
        system.derivative(time + 0.5 * h, &b.stage[..d], &mut b.rates[..d]);
        for (i, r) in b.remainder[1].iter_mut().enumerate() {
            *r = 0.5 * (*r + remainder_of(system, &self.jacobian, &b.stage, i));
        }
        change(&self.linear, [&b.rates, &b.f], [&b.stage, y], &mut b.moved, &mut b.middle);
        for i in 0..b.sum.len() {
            b.sum[i] += 2.0 * b.middle[i];
            b.middle[i] += b.first[i];
        }
        b.stage.copy_from_slice(&b.base);
        w.half.add_to(&b.sum[..d], &mut b.stage);
        system.derivative(time + h, &b.stage[..d], &mut b.rates[..d]);
        change(&self.linear, [&b.rates, &b.f], [&b.stage, y], &mut b.moved, &mut b.change);
        b.next.copy_from_slice(y);
        w.whole.add_to(&b.f[..d], &mut b.next);
        w.middle.add_to(&b.middle[..d], &mut b.next);
        w.last.add_to(&b.change[..d], &mut b.next);
        system.derivative(time + h, &b.next[..d], &mut b.rates[..d]);
        remainder(system, &self.jacobian, &b.next, &mut b.remainder[2]);
        let Some(tolerance) = &self.tolerance else { return 0.0 };
        // Replacing the last stage by the new point gives a solution of order 3: their difference is the error.
        change(&self.linear, [&b.rates, &b.f], [&b.next, y], &mut b.moved, &mut b.first);
        let mut error: f64 = 0.0;
        for j in n..2 * n {
            error = error.max((b.first[j] - b.change[j]).abs() / tolerance.joint);
        }
        for i in 2 * n + m..2 * (n + m) {
            error = error.max((b.first[i] - b.change[i]).abs() / tolerance.deflection);
        }
        error * h / 6.0
    }

    /// Makes the attempted step the state and adds its share to the means.
    fn accept(&mut self, system: &mut Coupled<'_>, time: f64, y: &mut [f64], means: &mut Means) {
        let (n, m, d) = (system.joints(), system.axes(), system.dimension());
        let w = &self.levels[self.level];
        let b = &mut self.buffers;
        b.sum.fill(0.0);
        w.integral.add_to(&b.f[..d], &mut b.sum);
        w.integral_middle.add_to(&b.middle[..d], &mut b.sum);
        w.integral_last.add_to(&b.change[..d], &mut b.sum);
        for j in 0..n {
            means.joints[j] += w.step * y[j] + b.sum[j];
        }
        for i in 0..m {
            means.force[i] += w.step * y[2 * n + i] + b.sum[n + i];
            let [start, middle, end] = &b.remainder;
            means.endpoint[i] += w.step / 6.0 * (start[i] + 4.0 * middle[i] + end[i]);
        }
        let [start, _, end] = &mut b.remainder;
        std::mem::swap(start, end);
        y.copy_from_slice(&b.next);
        std::mem::swap(&mut b.f, &mut b.rates);
        system.remember(time, &b.f[..d], false);
    }
}

/// Error of one step in a rate that, step after step, keeps force and motion of a planar arm within the relative error
/// asked for: found by comparing with fine steps (tests/suite/accuracy.rs).
const JOINT_RATE_SCALE: f64 = 3e-3;
const DEFLECTION_RATE_SCALE: f64 = 3e-2;

/// The nonlinear part's change since the step began: D = f(stage) − f(y) − L (stage − y). `moved` is room for y − stage.
fn change(linear: &Columns, [rates, start_rates]: [&[f64]; 2], [stage, start]: [&[f64]; 2], moved: &mut [f64], out: &mut [f64]) {
    for i in 0..out.len() {
        out[i] = rates[i] - start_rates[i];
        moved[i] = start[i] - stage[i];
    }
    linear.add_to(moved, out);
}

/// What the endpoint's position has beyond J₀ δq.
fn remainder(system: &Coupled<'_>, jacobian: &[f64], y: &[f64], out: &mut [f64]) {
    for (i, out) in out.iter_mut().enumerate() {
        *out = remainder_of(system, jacobian, y, i);
    }
}

fn remainder_of(system: &Coupled<'_>, jacobian: &[f64], y: &[f64], axis: usize) -> f64 {
    let n = system.joints();
    let linear: f64 = jacobian[axis * n..(axis + 1) * n].iter().zip(y).map(|(j, q)| j * q).sum();
    system.endpoint()[axis] - system.rest_endpoint[axis] - linear
}

impl Weights {
    fn new(linear: &Array2<f64>, step: f64, means: &[usize]) -> Self {
        let [_, half, ..] = phi_functions(&(linear * (0.5 * step)));
        let [_, first, second, third, fourth] = phi_functions(&(linear * step));
        let rows = |a: Array2<f64>| Columns::new(&(a.select(ndarray::Axis(0), means) * (step * step)));
        Weights {
            step,
            half: Columns::new(&(half * (0.5 * step))),
            whole: Columns::new(&(first * step)),
            middle: Columns::new(&((&second * 2.0 - &third * 4.0) * step)),
            last: Columns::new(&((&third * 4.0 - &second) * step)),
            integral_middle: rows(&third * 2.0 - &fourth * 4.0),
            integral_last: rows(&fourth * 4.0 - &third),
            integral: rows(second),
        }
    }
}
