//! What the limb did a while ago, for force laws with a delay.

/// One accepted instant: time, then position, velocity and acceleration of each axis on either side of it.
#[derive(Clone, Debug, Default)]
struct Node {
    time: f64,
    position: Vec<f64>,
    velocity: Vec<f64>,
    // Forces jump with the command, so the acceleration has a value before and one after the instant.
    before: Vec<f64>,
    after: Vec<f64>,
}

/// A ring of past instants, interpolated by Hermite polynomials: quintic for position, cubic for velocity.
#[derive(Clone, Debug)]
pub(crate) struct History {
    nodes: Vec<Node>,
    newest: usize,
}

impl History {
    /// Room for `capacity` instants of `axes` axes, all at rest since ever.
    pub(crate) fn new(axes: usize, capacity: usize) -> Self {
        let rest = Node { time: f64::NEG_INFINITY, position: vec![0.0; axes], velocity: vec![0.0; axes], before: vec![0.0; axes], after: vec![0.0; axes] };
        History { nodes: vec![rest; capacity.max(2)], newest: 0 }
    }

    /// Appends an instant with the acceleration that led to it.
    pub(crate) fn push(&mut self, time: f64, position: &[f64], velocity: &[f64], acceleration: &[f64]) {
        self.newest = (self.newest + 1) % self.nodes.len();
        let node = &mut self.nodes[self.newest];
        node.time = time;
        node.position.copy_from_slice(position);
        node.velocity.copy_from_slice(velocity);
        node.before.copy_from_slice(acceleration);
        node.after.copy_from_slice(acceleration);
    }

    /// Sets the acceleration that follows the newest instant.
    pub(crate) fn restart(&mut self, acceleration: &[f64]) {
        self.nodes[self.newest].after.copy_from_slice(acceleration);
    }

    /// Writes position and velocity at `time`, which lies between the oldest instant kept and the newest.
    pub(crate) fn at(&self, time: f64, position: &mut [f64], velocity: &mut [f64]) {
        let n = self.nodes.len();
        let mut right = self.newest;
        for _ in 0..n - 2 {
            let left = (right + n - 1) % n;
            if self.nodes[left].time <= time {
                break;
            }
            right = left;
        }
        let (a, b) = (&self.nodes[(right + n - 1) % n], &self.nodes[right]);
        let h = b.time - a.time;
        if !(h > 0.0 && h.is_finite()) || time >= b.time {
            position.copy_from_slice(&b.position);
            velocity.copy_from_slice(&b.velocity);
            return;
        }
        let s = ((time - a.time) / h).max(0.0);
        let (s2, s3) = (s * s, s * s * s);
        let late = s3 * (10.0 - 15.0 * s + 6.0 * s2);
        let (v0, v1) = (s - 6.0 * s3 + 8.0 * s2 * s2 - 3.0 * s2 * s3, -4.0 * s3 + 7.0 * s2 * s2 - 3.0 * s2 * s3);
        let (a0, a1) = (0.5 * (s2 - 3.0 * s3 + 3.0 * s2 * s2 - s2 * s3), 0.5 * (s3 - 2.0 * s2 * s2 + s2 * s3));
        let (p, r0, r1) = (s2 * (3.0 - 2.0 * s), s - 2.0 * s2 + s3, s3 - s2);
        for i in 0..position.len() {
            position[i] = a.position[i]
                + late * (b.position[i] - a.position[i])
                + h * (v0 * a.velocity[i] + v1 * b.velocity[i])
                + h * h * (a0 * a.after[i] + a1 * b.before[i]);
            velocity[i] = a.velocity[i] + p * (b.velocity[i] - a.velocity[i]) + h * (r0 * a.after[i] + r1 * b.before[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_degree_five_is_given_back_exactly() {
        let f = |t: f64| 1.0 + t - 2.0 * t.powi(3) + 0.5 * t.powi(5);
        let f1 = |t: f64| 1.0 - 6.0 * t.powi(2) + 2.5 * t.powi(4);
        let f2 = |t: f64| -12.0 * t + 10.0 * t.powi(3);
        let mut history = History::new(1, 8);
        for k in 0..6 {
            let t = 0.3 * f64::from(k);
            history.push(t, &[f(t)], &[f1(t)], &[f2(t)]);
        }
        let (mut x, mut v) = ([0.0], [0.0]);
        for t in [0.05, 0.3, 0.77, 1.3] {
            history.at(t, &mut x, &mut v);
            assert!((x[0] - f(t)).abs() < 1e-13, "at {t}: {} for {}", x[0], f(t));
            // Cubic Hermite: h⁴ v⁗/384, with |v⁗| = 60 here.
            assert!((v[0] - f1(t)).abs() < 0.3_f64.powi(4) * 60.0 / 384.0 + 1e-13, "at {t}: {} for {}", v[0], f1(t));
        }
    }

    #[test]
    fn before_the_start_all_is_at_rest() {
        let mut history = History::new(1, 4);
        history.push(0.0, &[0.0], &[0.0], &[0.0]);
        history.push(0.1, &[1.0], &[0.0], &[0.0]);
        let (mut x, mut v) = ([5.0], [5.0]);
        history.at(-1.0, &mut x, &mut v);
        assert_eq!((x, v), ([0.0], [0.0]));
    }
}
