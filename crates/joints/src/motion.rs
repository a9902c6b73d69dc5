//! Joint motion and its derivatives from encoders, as far as they rise above their noise.

/// Joint angles and what follows from them, `[joint][sample]`, at the rate of the log.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    /// Number of its trial.
    pub trial: usize,
    /// Angle (rad, m).
    pub q: Vec<Vec<f64>>,
    /// Its rate.
    pub v: Vec<Vec<f64>>,
    /// Its acceleration.
    pub a: Vec<Vec<f64>>,
    /// Its rate up to higher frequencies, where only the sign counts.
    pub sharp: Vec<Vec<f64>>,
    /// Torque as it was logged (N m, N).
    pub torque: Vec<Vec<f64>>,
    /// Torque that the file's bodies need for it, without friction.
    pub rigid: Vec<Vec<f64>>,
    /// Torque that a simulator logged beyond the file's, along its own motion; empty where the file is the simulation.
    pub beyond: Vec<Vec<f64>>,
    /// Where it moves: at rest dry friction holds a joint at any torque, and nothing is compared.
    pub moves: Vec<Vec<bool>>,
}

impl Motion {
    /// Angle, rate, acceleration and sharp rate of all joints.
    pub fn of_joints(&mut self) -> [&mut Vec<Vec<f64>>; 4] {
        [&mut self.q, &mut self.v, &mut self.a, &mut self.sharp]
    }
}

/// Share of a joint's rms speed below which it is as good as at rest, three times what its sign is smoothed over.
const AT_REST: f64 = 0.03;

/// Where a joint of that rms speed moves: all but what is slow for longer than `longest` samples.
pub(crate) fn moves(v: &[f64], speed: f64, longest: usize) -> Vec<bool> {
    let mut out = vec![true; v.len()];
    let mut from = 0;
    for to in 0..=v.len() {
        if to == v.len() || v[to].abs() >= AT_REST * speed {
            if to - from > longest {
                out[from..to].fill(false);
            }
            from = to + 1;
        }
    }
    out
}
