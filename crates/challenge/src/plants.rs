//! The experiments: limbs, the robots that hold them, and their instruments.

use super::laws::invert;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// The experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plant {
    /// Two axes held by a robot.
    Planar,
    /// One axis, force imposed, nothing in the way.
    Force,
    /// A free mass under position control.
    Mass,
    /// One angle imposed, torque measured.
    Motion,
    /// Three angles held by a robot.
    Wrist,
    /// Six joints held by an exoskeleton.
    Six,
}

impl Plant {
    /// All of them.
    pub const ALL: [Plant; 6] = [Plant::Force, Plant::Planar, Plant::Motion, Plant::Mass, Plant::Wrist, Plant::Six];

    /// Its name in tables and on the command line, the names of its axes, and whether these are angles.
    fn facts(self) -> (&'static str, &'static [&'static str], bool) {
        match self {
            Plant::Planar => ("planar", &["x", "y"], false),
            Plant::Force => ("force", &["x"], false),
            Plant::Mass => ("mass", &["x"], false),
            Plant::Motion => ("motion", &["x"], true),
            Plant::Wrist => ("wrist", &["flexion", "deviation", "pronation"], true),
            Plant::Six => ("six", &["j1", "j2", "j3", "j4", "j5", "j6"], true),
        }
    }

    /// The number of axes.
    pub fn axes(self) -> usize {
        self.names().len()
    }

    /// Its name in tables and on the command line.
    pub fn word(self) -> &'static str {
        self.facts().0
    }

    /// The names of its axes.
    pub fn names(self) -> &'static [&'static str] {
        self.facts().1
    }

    /// Whether its axes are angles.
    pub fn rotational(self) -> bool {
        self.facts().2
    }

    /// The last frequency that is excited.
    pub fn band_hz(self) -> f64 {
        if self == Plant::Mass { 3.0 } else { 12.0 }
    }
}

/// Numbers of one experiment, SI.
pub struct Spec {
    pub m: Vec<Vec<f64>>,
    pub b: Vec<Vec<f64>>,
    pub k: Vec<Vec<f64>>,
    /// Inertia of the robot, and its controller.
    pub robot: Vec<Vec<f64>>,
    pub kp: Vec<f64>,
    pub kd: Vec<f64>,
    /// rms of displacement, of effort and of the command, by axis.
    pub x: Vec<f64>,
    pub f: Vec<f64>,
    pub command: Vec<f64>,
    /// Noise and step of the effort channels, step of the motion channels.
    pub f_noise: Vec<f64>,
    pub f_step: Vec<f64>,
    pub x_step: Vec<f64>,
    /// rms of the limb's own force.
    pub own: Vec<f64>,
}

fn times(m: &[Vec<f64>], f: f64) -> Vec<Vec<f64>> {
    m.iter().map(|r| r.iter().map(|v| v * f).collect()).collect()
}

fn dense(m: &[&[f64]]) -> Vec<Vec<f64>> {
    m.iter().map(|r| r.to_vec()).collect()
}

/// R(φ) m R(φ)ᵀ of a 2 × 2 matrix.
fn turned(m: &[Vec<f64>], phi: f64) -> Vec<Vec<f64>> {
    let (s, c) = phi.sin_cos();
    let r = [[c, -s], [s, c]];
    let at = |i: usize, j: usize| (0..2).flat_map(|p| (0..2).map(move |q| (p, q))).map(|(p, q)| r[i][p] * m[p][q] * r[j][q]).sum::<f64>();
    (0..2).map(|i| (0..2).map(|j| at(i, j)).collect()).collect()
}

/// Inertia, damping and stiffness of the limb before they are drawn, and the inertia of the robot.
fn matrices(plant: Plant, rng: &mut ChaCha8Rng) -> [Vec<Vec<f64>>; 4] {
    let zero = vec![vec![0.0; plant.axes()]; plant.axes()];
    match plant {
        Plant::Planar => {
            let phi = rng.random_range(-0.6..0.6);
            [
                turned(&dense(&[&[2.1, -0.55], &[-0.55, 1.9]]), phi),
                turned(&dense(&[&[11.0, -2.0], &[-2.0, 15.0]]), phi),
                turned(&dense(&[&[300.0, -60.0], &[-60.0, 520.0]]), phi),
                dense(&[&[0.932, -0.305], &[-0.305, 1.05]]),
            ]
        }
        Plant::Wrist => [
            dense(&[&[0.004, 0.0003, 0.0], &[0.0003, 0.0035, 0.0002], &[0.0, 0.0002, 0.003]]),
            dense(&[&[0.03, 0.002, 0.0], &[0.002, 0.03, 0.001], &[0.0, 0.001, 0.02]]),
            dense(&[&[1.5, 0.1, 0.05], &[0.1, 1.2, 0.0], &[0.05, 0.0, 0.9]]),
            dense(&[&[0.004, 0.0, 0.0], &[0.0, 0.004, 0.0], &[0.0, 0.0, 0.003]]),
        ],
        Plant::Six => {
            let inertia = [0.25, 0.22, 0.12, 0.06, 0.02, 0.01];
            let coupled = |scale: f64, share: f64| -> Vec<Vec<f64>> {
                (0..6)
                    .map(|i: usize| {
                        let near = |j: usize| if i.abs_diff(j) == 1 { share } else { 0.0 };
                        (0..6).map(|j| scale * f64::sqrt(inertia[i] * inertia[j]) * if i == j { 1.0 } else { near(j) }).collect()
                    })
                    .collect()
            };
            [coupled(1.0, 0.15), coupled(10.0, 0.05), coupled(158.0, 0.1), coupled(0.5, 0.0)]
        }
        Plant::Force => [dense(&[&[2.0]]), dense(&[&[12.0]]), dense(&[&[400.0]]), zero.clone()],
        Plant::Mass => [dense(&[&[2.0]]), dense(&[&[4.0]]), zero.clone(), zero.clone()],
        Plant::Motion => [dense(&[&[0.015]]), dense(&[&[1.0]]), dense(&[&[60.0]]), zero.clone()],
    }
}

impl Spec {
    /// An experiment with inertia, damping and stiffness, posture and noise drawn at random.
    pub fn draw(plant: Plant, rng: &mut ChaCha8Rng) -> Spec {
        let mut around = || {
            let e: f64 = rng.sample(StandardNormal);
            (0.1 * e).exp()
        };
        let (jm, jb, jk) = (around(), around(), around());
        let n = plant.axes();
        let [m, b, k, robot] = matrices(plant, rng);
        let (m, b, k) = (times(&m, jm), times(&b, jb), times(&k, jk));
        let loud = rng.random_range(0.0..1.0);
        let own = match plant {
            Plant::Planar if loud < 0.5 => rng.random_range(0.01..0.15),
            Plant::Planar => rng.random_range(0.15..0.5),
            _ => rng.random_range(0.02..0.06) / 4.0,
        };
        let (kp, kd, x, f, command, [f_noise, f_step, x_step], own) = match plant {
            Plant::Planar => (100.0, 5.0, 4.5e-3, 2.7, 4.0, [0.03, 0.025, 5e-5], own),
            Plant::Wrist => (1.0, 0.01, 0.04, 0.09, 0.13, [8e-4, 6e-4, 1e-4], 0.09 * own),
            Plant::Force => (0.0, 0.0, 8e-3, 4.0, 4.0, [0.03, 0.025, 5e-5], 4.0 * own),
            Plant::Mass => (300.0, 20.0, 2e-2, 5.0, 2e-2, [0.03, 0.025, 2e-5], 5.0 * own),
            Plant::Motion => (0.0, 0.0, 0.02, 1.5, 0.0, [0.015, 0.005, 2e-5], 1.5 * own),
            // Gains as shares of stiffness and damping, efforts of what bends a joint by 0.04.
            Plant::Six => (0.3, 0.3, 0.03, 1.0, 1.6, [0.01, 0.008, 1e-4], own),
        };
        let by = |share: f64, of: &dyn Fn(usize) -> f64| (0..n).map(|i| share * if plant == Plant::Six { of(i) } else { 1.0 }).collect::<Vec<f64>>();
        let effort = |share: f64| by(share, &|i| 0.04 * k[i][i]);
        Spec {
            kp: by(kp, &|i| k[i][i]),
            kd: by(kd, &|i| b[i][i]),
            x: vec![x; n],
            f: effort(f),
            command: effort(command),
            f_noise: effort(f_noise),
            f_step: effort(f_step),
            x_step: vec![x_step; n],
            own: effort(own),
            m,
            b,
            k,
            robot,
        }
    }

    /// Inverse of the limb's inertia, with mass added to every axis.
    pub fn limb_inverse(&self, added: f64) -> Vec<Vec<f64>> {
        let mut limb = self.m.clone();
        limb.iter_mut().enumerate().for_each(|(i, row)| row[i] += added);
        invert(&limb)
    }

    /// Inverse of limb and robot together, with mass added to every axis.
    pub fn total_inverse(&self, added: f64) -> Vec<Vec<f64>> {
        let mut total: Vec<Vec<f64>> = self.m.iter().zip(&self.robot).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect();
        total.iter_mut().enumerate().for_each(|(i, row)| row[i] += added);
        invert(&total)
    }
}
