//! Time stepping: the stiff linear part exactly, the rest by an exponential Runge-Kutta method of order 4.

use crate::coupled::Coupled;
use ndarray::{Array2, Axis};
use ndof_linear::{doubled, phi_functions};
use ndof_signal::vectorized;
use pulp::{Simd, WithSimd};

/// Weights of one step length, for ẏ = L y + N(t, y) (Cox and Matthews, J. Comput. Phys. 176 (2002) 430, eqs. 26-29, written in increments).
/// Those of changes of N have columns for its own rows only.
struct Weights {
    step: f64,
    half: Columns,
    half_change: Columns,
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

    /// y += A x; `y` is padded. Where the lengths of both are known to the compiler, so is the loop.
    #[inline(always)]
    fn add_to(&self, x: &[f64], y: &mut [f64]) {
        debug_assert_eq!((self.rows * LANES, self.rows * x.len()), (y.len(), self.data.len()));
        match y.len() / LANES {
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
    #[inline(always)]
    fn add_rows<const ROWS: usize>(&self, x: &[f64], y: &mut [f64]) {
        let mut sums = [[0.0; LANES]; ROWS];
        let (columns, _) = self.data.as_chunks::<ROWS>();
        for (column, &x) in columns[..x.len()].iter().zip(x) {
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
    // The rows of L in which the system is not linear, and which they are: positions follow from rates exactly.
    linear: Columns,
    curved: Vec<usize>,
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

/// Padded; `first`, `middle`, `change` and `sum` hold the curved rows only.
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
    integral: Vec<f64>,
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
        let curved: Vec<usize> = (n..read).chain(read + m..dimension).collect();
        // From half of the finest step upwards, each length from its half.
        let mut half = phi_functions(&(&linear * (interval_s / 2f64.powi(finest as i32 + 1))));
        let mut levels = Vec::with_capacity(finest + 1);
        for k in (0..=finest).rev() {
            let whole = doubled(&half);
            levels.push(Weights::new(&half[1], &whole, interval_s / 2f64.powi(k as i32), [&means, &curved]));
            half = whole;
        }
        levels.reverse();
        let (zeros, short) = (|| vec![0.0; padded], || vec![0.0; curved.len().next_multiple_of(LANES)]);
        let buffers = Buffers {
            f: zeros(),
            stage: zeros(),
            rates: zeros(),
            first: short(),
            middle: short(),
            change: short(),
            next: zeros(),
            base: zeros(),
            sum: short(),
            integral: vec![0.0; (n + m).next_multiple_of(LANES)],
            moved: zeros(),
            deflection: vec![0.0; m],
            remainder: std::array::from_fn(|_| vec![0.0; m]),
        };
        Stepper {
            levels,
            linear: Columns::new(&linear.select(Axis(0), &curved)),
            curved,
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
        vectorized(Interval { stepper: self, system, time_s, y, means });
    }

    #[inline(always)]
    fn steps(&mut self, system: &mut Coupled<'_>, time_s: f64, y: &mut [f64], means: &mut Means, size: Size) {
        let Size { n, m, d } = size;
        means.clear();
        if self.started {
            system.inputs_changed(time_s, &y[..d], &mut self.buffers.f[..d]);
        } else {
            system.derivative(time_s, &y[..d], &mut self.buffers.f[..d]);
            remainder(system, &self.jacobian, y, size, &mut self.buffers.remainder[0]);
            self.started = true;
        }
        system.remember(time_s, &self.buffers.f[..d], true);
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
            let error = self.attempt(system, at, y, size);
            if error > 1.0 && self.level + 1 < self.levels.len() {
                self.level += 1;
                continue;
            }
            self.accept(system, at + self.levels[self.level].step, y, means, size);
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
    #[inline(always)]
    fn attempt(&mut self, system: &mut Coupled<'_>, time: f64, y: &[f64], size: Size) -> f64 {
        let Size { n, m, d } = size;
        let w = &self.levels[self.level];
        let (linear, curved) = (&self.linear, &self.curved[..]);
        let h = w.step;
        let padded = d.next_multiple_of(LANES);
        let count = d - n - m;
        let short = count.next_multiple_of(LANES);
        let Buffers { f, stage, rates, first, middle, change, next, base, sum, moved, remainder: remainders, .. } = &mut self.buffers;
        let (y, f) = (&y[..padded], &f[..padded]);
        let [stage, rates, next, base, moved] = [stage, rates, next, base, moved].map(|b| &mut b[..padded]);
        let [first, middle, last, sum] = [first, middle, change, sum].map(|b| &mut b[..short]);
        // a = y + Q f
        base.copy_from_slice(y);
        w.half.add_to(&f[..d], base);
        system.derivative_of(time + 0.5 * h, &base[..d], &mut rates[..d], n, m);
        remainder(system, &self.jacobian, base, size, &mut remainders[1]);
        changed(linear, curved, [rates, f], [&base[..d], &y[..d]], &mut moved[..d], first);
        // b = a + Q (N_a − N_n)
        stage.copy_from_slice(base);
        w.half_change.add_to(&first[..count], stage);
        // c = a + Q (L a + 2 N_b − N_n) = a + Q (f_a − D_a + 2 D_b)
        w.half.add_to(&rates[..d], base);
        system.derivative_of(time + 0.5 * h, &stage[..d], &mut rates[..d], n, m);
        for (i, r) in remainders[1][..m].iter_mut().enumerate() {
            *r = 0.5 * (*r + remainder_of(system, &self.jacobian, stage, n, i));
        }
        changed(linear, curved, [rates, f], [&stage[..d], &y[..d]], &mut moved[..d], middle);
        for i in 0..short {
            sum[i] = 2.0 * middle[i] - first[i];
            middle[i] += first[i];
        }
        w.half_change.add_to(&sum[..count], base);
        system.derivative_of(time + h, &base[..d], &mut rates[..d], n, m);
        changed(linear, curved, [rates, f], [&base[..d], &y[..d]], &mut moved[..d], last);
        next.copy_from_slice(y);
        w.whole.add_to(&f[..d], next);
        w.middle.add_to(&middle[..count], next);
        w.last.add_to(&last[..count], next);
        system.derivative_of(time + h, &next[..d], &mut rates[..d], n, m);
        remainder(system, &self.jacobian, next, size, &mut remainders[2]);
        let Some(tolerance) = &self.tolerance else { return 0.0 };
        // Replacing the last stage by the new point gives a solution of order 3: their difference is the error.
        changed(linear, curved, [rates, f], [&next[..d], &y[..d]], &mut moved[..d], first);
        let off = |range: std::ops::Range<usize>| range.fold(0.0, |worst: f64, k| worst.max((first[k] - last[k]).abs()));
        (off(0..n) / tolerance.joint).max(off(n..n + m) / tolerance.deflection) * h / 6.0
    }

    /// Makes the attempted step the state and adds its share to the means.
    #[inline(always)]
    fn accept(&mut self, system: &mut Coupled<'_>, time: f64, y: &mut [f64], means: &mut Means, Size { n, m, d }: Size) {
        let w = &self.levels[self.level];
        let b = &mut self.buffers;
        let integral = &mut b.integral[..(n + m).next_multiple_of(LANES)];
        integral.fill(0.0);
        w.integral.add_to(&b.f[..d], integral);
        w.integral_middle.add_to(&b.middle[..d - n - m], integral);
        w.integral_last.add_to(&b.change[..d - n - m], integral);
        for j in 0..n {
            means.joints[j] += w.step * y[j] + integral[j];
        }
        for i in 0..m {
            means.force[i] += w.step * y[2 * n + i] + integral[n + i];
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

/// Joints, axes and states of a system: constants to the compiler where they are written as such.
#[derive(Clone, Copy)]
struct Size {
    n: usize,
    m: usize,
    d: usize,
}

/// [`Stepper::interval`] as a type, so that it is compiled for the vector unit at hand.
struct Interval<'a, 'b> {
    stepper: &'a mut Stepper,
    system: &'a mut Coupled<'b>,
    time_s: f64,
    y: &'a mut [f64],
    means: &'a mut Means,
}

impl WithSimd for Interval<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Interval { stepper, system, time_s, y, means } = self;
        let (n, m, d) = (system.joints(), system.axes(), system.dimension());
        match (n, m, d) {
            (2, 2, 8) => stepper.steps(system, time_s, y, means, Size { n: 2, m: 2, d: 8 }),
            _ => stepper.steps(system, time_s, y, means, Size { n, m, d }),
        }
    }
}

/// Error of one step in a rate that, step after step, keeps force and motion of a planar arm within the relative error
/// asked for: found by comparing with fine steps (tests/suite/accuracy.rs).
const JOINT_RATE_SCALE: f64 = 3e-3;
const DEFLECTION_RATE_SCALE: f64 = 3e-2;

/// The nonlinear part's change since the step began, in the rows that have one: D = f(stage) − f(y) − L (stage − y).
/// `moved` is room for y − stage.
#[inline(always)]
fn changed(linear: &Columns, curved: &[usize], [rates, start_rates]: [&[f64]; 2], [stage, start]: [&[f64]; 2], moved: &mut [f64], out: &mut [f64]) {
    for (out, &row) in out.iter_mut().zip(curved) {
        *out = rates[row] - start_rates[row];
    }
    for ((moved, stage), start) in moved.iter_mut().zip(stage).zip(start) {
        *moved = start - stage;
    }
    linear.add_to(moved, out);
}

/// What the endpoint's position has beyond J₀ δq.
#[inline(always)]
fn remainder(system: &Coupled<'_>, jacobian: &[f64], y: &[f64], Size { n, m, .. }: Size, out: &mut [f64]) {
    for (i, out) in out[..m].iter_mut().enumerate() {
        *out = remainder_of(system, jacobian, y, n, i);
    }
}

#[inline(always)]
fn remainder_of(system: &Coupled<'_>, jacobian: &[f64], y: &[f64], n: usize, axis: usize) -> f64 {
    let linear: f64 = jacobian[axis * n..(axis + 1) * n].iter().zip(&y[..n]).map(|(j, q)| j * q).sum();
    system.endpoint()[axis] - system.rest_endpoint[axis] - linear
}

impl Weights {
    /// From φ₁ of half a step and φ₀ … φ₄ of a whole one; `means` are the states whose integrals are wanted,
    /// changes act on the rows `curved`.
    fn new(half: &Array2<f64>, [_, first, second, third, fourth]: &[Array2<f64>; 5], step: f64, [means, curved]: [&[usize]; 2]) -> Self {
        let of_change = |a: &Array2<f64>| a.select(Axis(1), curved);
        let rows = |a: &Array2<f64>| a.select(Axis(0), means) * (step * step);
        Weights {
            step,
            half: Columns::new(&(half * (0.5 * step))),
            half_change: Columns::new(&of_change(&(half * (0.5 * step)))),
            whole: Columns::new(&(first * step)),
            middle: Columns::new(&of_change(&((second * 2.0 - third * 4.0) * step))),
            last: Columns::new(&of_change(&((third * 4.0 - second) * step))),
            integral_middle: Columns::new(&of_change(&rows(&(third * 2.0 - fourth * 4.0)))),
            integral_last: Columns::new(&of_change(&rows(&(fourth * 4.0 - third)))),
            integral: Columns::new(&rows(second)),
        }
    }
}
