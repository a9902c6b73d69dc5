//! How a log is taken whose torques are not those that its robot needs: in another unit, before a gear, or without weight.

use crate::mistaken::{LEFT, driven, errors, needed_with};
use crate::motion::Motion;
use crate::scene::Scene;
use ndof_devices::SerialChain;
use ndof_signal::Recording;
use ndof_sysid::Ports;

/// Units of a torque beside N m, by how many times as large numbers are in them.
const UNITS: [(f64, &str); 2] = [(1e3, "N mm"), (1e-3, "kN m")];

/// What has to be known of a log's torques before they are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Taken {
    /// How many times as large as the file's robot needs all of them are.
    times: f64,
    /// The unit that makes it so much.
    unit: Option<&'static str>,
    /// Whether they leave out what carries the robot's weight.
    weightless: bool,
}

impl Taken {
    /// A log that says what it is said to say.
    const AS_IT_IS: Taken = Taken { times: 1.0, unit: None, weightless: false };

    /// How a log has to be taken. A simulator's log has the same channels, and is not asked.
    ///
    /// All torques have another unit where they are nearer to the next one than to the file's N m. They are without weight where the file's robot misses a third or less of what
    /// it misses with it, and a third or less of them.
    pub fn of(scene: &Scene<'_>, motions: &[Motion]) -> Self {
        let joints = driven(scene);
        if joints.is_empty() || motions.iter().any(|motion| !motion.beyond.is_empty()) {
            return Taken::AS_IT_IS;
        }
        let whole: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| scene.nominal(motion)).collect();
        let light: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| needed_with(scene, motion, scene.chain.gravity().map(|g| -g))).collect();
        let read = |needed: &[Vec<Vec<f64>>]| {
            let times = times(&joints, motions, needed);
            let scaled: Vec<Motion> = motions.iter().map(|motion| divided(motion, times)).collect();
            (times, errors(&joints, &scaled, needed).iter().sum::<f64>())
        };
        let ((times, left), (times_light, left_light)) = (read(&whole), read(&light));
        let weightless = left_light < LEFT * left && left_light < LEFT * joints.len() as f64;
        let times = if weightless { times_light } else { times };
        // As close as a robot whose file is that much off.
        let far = 1.0 - LEFT.sqrt();
        let is_about = |unit: f64| (far..1.0 / far).contains(&(times.abs() / unit));
        match UNITS.into_iter().find(|(unit, _)| is_about(*unit)) {
            Some((size, unit)) => Taken { times: size.copysign(times), unit: Some(unit), weightless },
            None => Taken { times, unit: None, weightless },
        }
    }

    /// Whether the log says what it is said to say.
    pub fn is_as_it_is(&self) -> bool {
        *self == Taken::AS_IT_IS
    }

    /// The robot whose torques are logged.
    pub fn chain(&self, chain: &SerialChain) -> SerialChain {
        if self.weightless { chain.clone().with_gravity([0.0; 3]) } else { chain.clone() }
    }

    /// The log in the file's unit.
    pub fn trials(&self, trials: &[Recording], ports: &Ports) -> Result<Vec<Recording>, ndof_signal::RecordingError> {
        let mut out = trials.to_vec();
        for recording in &mut out {
            for channel in ports.inputs.iter().map(|i| recording.channels()[*i].name.clone()).collect::<Vec<_>>() {
                recording.map_channel(&channel, |torque| torque / self.times)?;
            }
        }
        Ok(out)
    }

    /// In words, with what to do; `channels` are those of the torques.
    pub fn words(&self, channels: &[&str]) -> Vec<String> {
        let mut out = Vec::new();
        let times = about(self.times.abs());
        match self.unit {
            Some(unit) => {
                let named: Vec<String> = channels.iter().map(|name| format!("{name}={name} [{unit}]")).collect();
                out.push(format!(
                    "all joints' torques are about {times} times what the file's robot needs: in {unit}? They are taken so here. Say it with --channels \"{}\"; until then no name is surer than 0.6, and nothing is written",
                    named.join(",")
                ));
            }
            None if self.times.abs() != 1.0 => out.push(format!(
                "all joints' torques are about {times} times what the file's robot needs: of motors before their gears, or currents? They are taken as so many times too large here. Make them the joints' in a file for --channels, by a [transform] from {} whose matrix has each joint's own factor, about {}, on its diagonal; until then no name is surer than 0.6, and nothing is written",
                channels.join(", "),
                about(1.0 / self.times.abs())
            )),
            None => {}
        }
        if self.times < 0.0 {
            out.push(format!(
                "all joints' torques go against what the file's robot needs: they are taken turned round here; say it with --negate {}",
                channels.join(",")
            ));
        }
        if self.weightless {
            out.push(
                "the torques are as if they left out what carries the robot's weight, as a controller reports that compensates gravity: they are taken so here, against the file's robot without weight. Log the whole torque, or take gravity out of the file (gravity_m_per_s2 = [0.0, 0.0, 0.0] in TOML, gravity=\"0 0 0\" of <option> in MJCF); until then no name is surer than 0.6, and nothing is written"
                    .to_owned(),
            );
        }
        out
    }
}

/// "1000", "0.0102".
fn about(times: f64) -> String {
    let digits = (2.0 - (1.001 * times).log10().floor()).max(0.0) as usize;
    format!("{times:.digits$}")
}

/// The median of how many times what is needed the joints' torques are, by least squares; one where that is nearer to what the file says than to the next unit.
fn times(joints: &[usize], motions: &[Motion], needed: &[Vec<Vec<f64>>]) -> f64 {
    let of = |&j: &usize| {
        let both = || motions.iter().zip(needed).flat_map(move |(motion, needed)| motion.torque[j].iter().zip(&needed[j]));
        let count = both().count().max(1) as f64;
        let [logged, file] = both().fold([0.0; 2], |[a, b], (t, n)| [a + t / count, b + n / count]);
        let [product, square] = both().fold([0.0; 2], |[a, b], (t, n)| [a + (t - logged) * (n - file), b + (n - file).powi(2)]);
        product / square
    };
    let mut all: Vec<f64> = joints.iter().map(of).filter(|x| x.is_finite() && *x != 0.0).collect();
    all.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let against = all.iter().filter(|x| **x < 0.0).count();
    let middle = all.get(all.len() / 2).map_or(1.0, |x| x.abs());
    let turned = if 2 * against > all.len() { -1.0 } else { 1.0 };
    if middle.ln().abs() > 0.5 * UNITS[0].0.ln() { turned * middle } else { 1.0 }
}

/// A motion whose torques are so many times less.
fn divided(motion: &Motion, times: f64) -> Motion {
    let mut out = motion.clone();
    out.torque.iter_mut().flatten().for_each(|torque| *torque /= times);
    out
}
