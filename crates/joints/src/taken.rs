//! How a log is taken whose numbers are not those of its robot: angles or torques in another unit, torques before a gear, or without weight.

use crate::dynamics::inverse_dynamics;
use crate::mistaken::{LEFT, driven, errors, needed_with};
use crate::motion::Motion;
use crate::scene::Scene;
use ndof_devices::SerialChain;
use ndof_signal::{Recording, Unit};
use ndof_sysid::Ports;

/// Units of a torque beside N m, by how many times as large numbers are in them.
const UNITS: [(f64, &str); 2] = [(1e3, "N mm"), (1e-3, "kN m")];

/// A joint's unit beside rad or m, where it turns and where it slides.
const ANGLES: [&str; 2] = ["deg", "mm"];

/// What has to be known of a log before it is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Taken {
    /// Whether joints that turn, and those that slide, are logged in [`ANGLES`].
    angles: [bool; 2],
    /// How many times as large as the file's robot needs all of them are.
    times: f64,
    /// The unit that makes it so much.
    unit: Option<&'static str>,
    /// Whether they leave out what carries the robot's weight.
    weightless: bool,
}

impl Taken {
    /// A log that says what it is said to say.
    const AS_IT_IS: Taken = Taken { angles: [false; 2], times: 1.0, unit: None, weightless: false };

    /// How a log has to be taken. A simulator's log has the same channels, and is not asked.
    ///
    /// Other units of angles are asked where the file's robot misses more than a third of a torque. They are taken if they leave a third or less of that and of the torques. Of
    /// readings that leave about as little, one with fewer changes is taken, and another unit of the angles before a factor of the torques, which can be any.
    pub fn of(scene: &Scene<'_>, motions: &[Motion]) -> Self {
        let joints = driven(scene);
        if joints.is_empty() || motions.iter().any(|motion| !motion.beyond.is_empty()) {
            return Taken::AS_IT_IS;
        }
        let nominal: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| scene.nominal(motion)).collect();
        let as_it_is = errors(&joints, motions, &nominal);
        let plain = Taken::with(scene, motions, &joints, [false; 2]);
        if as_it_is.iter().all(|missed| *missed < LEFT) {
            return plain.0;
        }
        let there = [false, true].map(|slides| (0..scene.joints.len()).any(|j| scene.chain.slides(j) == slides));
        let others = [[true, false], [false, true], [true, true]].into_iter().filter(|angles| angles.iter().zip(there).all(|(asked, there)| !asked || there));
        let read = others.map(|angles| {
            let motions: Vec<Motion> = motions.iter().map(|motion| in_units(scene, motion, angles)).collect();
            Taken::with(scene, &motions, &joints, angles)
        });
        let before: f64 = as_it_is.iter().sum();
        let likely: Vec<(Taken, f64)> = read.filter(|(_, left)| *left < LEFT * before && *left < LEFT * joints.len() as f64).chain([plain]).collect();
        let least = likely.iter().map(|(_, left)| *left).fold(f64::INFINITY, f64::min);
        let about_as_little = likely.into_iter().filter(|(_, left)| LEFT * left <= least);
        about_as_little.map(|(taken, _)| taken).min_by_key(Taken::changes).unwrap_or(plain.0)
    }

    /// How much is not as it is said to be: how many things, and whether torques are among them.
    fn changes(&self) -> (usize, bool) {
        let torques = self.times != 1.0;
        (self.angles.iter().chain([&torques, &self.weightless]).filter(|changed| **changed).count(), torques)
    }

    /// How the torques of a log with angles in such units have to be taken, and what is missed then.
    ///
    /// All torques have another unit where they are nearer to the next one than to the file's N m. They are without weight where the file's robot misses a third or less of what
    /// it misses with it and with another zero of each torque, and a third or less of them.
    fn with(scene: &Scene<'_>, motions: &[Motion], joints: &[usize], angles: [bool; 2]) -> (Self, f64) {
        let whole: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| scene.nominal(motion)).collect();
        let light: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| needed_with(scene, motion, scene.chain.gravity().map(|g| -g))).collect();
        let read = |needed: &[Vec<Vec<f64>>]| {
            let times = times(joints, motions, needed);
            let scaled: Vec<Motion> = motions.iter().map(|motion| divided(motion, times)).collect();
            (times, errors(joints, &scaled, needed).iter().sum::<f64>(), scaled)
        };
        let ((times, left, scaled), (times_light, left_light, _)) = (read(&whole), read(&light));
        // What a zero of each torque would take as well is no sign of it.
        let left_level = errors(joints, &levelled(scaled, &whole), &whole).iter().sum::<f64>();
        let weightless = left_light < LEFT * left.min(left_level) && left_light < LEFT * joints.len() as f64;
        let (times, left) = if weightless { (times_light, left_light) } else { (times, left) };
        // As close as a robot whose file is that much off.
        let far = 1.0 - LEFT.sqrt();
        let is_about = |unit: f64| (far..1.0 / far).contains(&(times.abs() / unit));
        let taken = match UNITS.into_iter().find(|(unit, _)| is_about(*unit)) {
            Some((size, unit)) => Taken { angles, times: size.copysign(times), unit: Some(unit), weightless },
            None => Taken { angles, times, unit: None, weightless },
        };
        (taken, left)
    }

    /// Whether the log says what it is said to say.
    pub fn is_as_it_is(&self) -> bool {
        *self == Taken::AS_IT_IS
    }

    /// The robot whose torques are logged.
    pub fn chain(&self, chain: &SerialChain) -> SerialChain {
        if self.weightless { chain.clone().with_gravity([0.0; 3]) } else { chain.clone() }
    }

    /// The log in the units of the file, a robot with such a chain.
    pub fn trials(&self, chain: &SerialChain, trials: &[Recording], ports: &Ports) -> Result<Vec<Recording>, ndof_signal::RecordingError> {
        let mut out = trials.to_vec();
        for recording in &mut out {
            let name = |c: &usize| recording.channels()[*c].name.clone();
            let torques = ports.inputs.iter().map(|c| (name(c), 1.0 / self.times));
            let angles = ports.outputs.iter().enumerate().map(|(j, c)| (name(c), size(chain, self.angles, j)));
            for (channel, size) in torques.chain(angles).collect::<Vec<_>>() {
                recording.map_channel(&channel, |x| size * x)?;
            }
        }
        Ok(out)
    }

    /// In words, with what to do; `torques` and `angles` are the channels of the chain's joints.
    pub fn words(&self, chain: &SerialChain, torques: &[&str], angles: &[&str]) -> Vec<String> {
        let mut out = Vec::new();
        let named =
            |channels: &mut dyn Iterator<Item = (&&str, &str)>| channels.map(|(name, unit)| format!("{name}={name} [{unit}]")).collect::<Vec<_>>().join(",");
        for (slides, unit) in ANGLES.into_iter().enumerate().filter(|(slides, _)| self.angles[*slides]) {
            let own: Vec<usize> = (0..angles.len()).filter(|j| usize::from(chain.slides(*j)) == slides).collect();
            // A torque whose header names no unit is of N m, and that of a slide is none.
            let forces = own.iter().filter(|_| slides == 1).map(|j| (&torques[*j], "N"));
            out.push(format!(
                "the log's torques are those of its robot if {} in {unit}, and far from them else: they are taken so here. Say it with --channels \"{}\"; until then no name is surer than 0.6, and nothing is written",
                ["the joints' angles are", "what slides is"][slides],
                named(&mut own.iter().map(|j| (&angles[*j], unit)).chain(forces))
            ));
        }
        let times = about(self.times.abs());
        match self.unit {
            Some(unit) => {
                out.push(format!(
                    "all joints' torques are about {times} times what the file's robot needs: in {unit}? They are taken so here. Say it with --channels \"{}\"; until then no name is surer than 0.6, and nothing is written",
                    named(&mut torques.iter().map(|name| (name, unit)))
                ));
            }
            None if self.times.abs() != 1.0 => out.push(format!(
                "all joints' torques are about {times} times what the file's robot needs: of motors before their gears, or currents? They are taken as so many times too large here. Make them the joints' in a file for --channels, by a [transform] from {} whose matrix has each joint's own factor, about {}, on its diagonal; until then no name is surer than 0.6, and nothing is written",
                torques.join(", "),
                about(1.0 / self.times.abs())
            )),
            None => {}
        }
        if self.times < 0.0 {
            out.push(format!(
                "all joints' torques go against what the file's robot needs: they are taken turned round here; say it with --negate {}",
                torques.join(",")
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

/// What a joint's number in such units is in those of the file.
fn size(chain: &SerialChain, angles: [bool; 2], joint: usize) -> f64 {
    let slides = usize::from(chain.slides(joint));
    if angles[slides] { Unit::parse(ANGLES[slides]).map_or(1.0, |(_, size)| size) } else { 1.0 }
}

/// A motion that was logged in such units, in those of the file.
fn in_units(scene: &Scene<'_>, motion: &Motion, angles: [bool; 2]) -> Motion {
    let mut out = motion.clone();
    for j in 0..scene.joints.len() {
        let size = size(scene.chain, angles, j);
        out.of_joints().into_iter().flat_map(|series| &mut series[j]).for_each(|x| *x *= size);
    }
    out.rigid = inverse_dynamics(scene.chain, &out);
    out
}

/// Motions whose torques are, on the whole, those that are needed.
fn levelled(mut motions: Vec<Motion>, needed: &[Vec<Vec<f64>>]) -> Vec<Motion> {
    for j in 0..needed.first().map_or(0, Vec::len) {
        let missed: Vec<f64> = motions.iter().zip(needed).flat_map(|(motion, needed)| motion.torque[j].iter().zip(&needed[j]).map(|(t, n)| t - n)).collect();
        let mean = missed.iter().sum::<f64>() / missed.len().max(1) as f64;
        motions.iter_mut().flat_map(|motion| &mut motion.torque[j]).for_each(|torque| *torque -= mean);
    }
    motions
}

/// A motion whose torques are so many times less.
fn divided(motion: &Motion, times: f64) -> Motion {
    let mut out = motion.clone();
    out.torque.iter_mut().flatten().for_each(|torque| *torque /= times);
    out
}
