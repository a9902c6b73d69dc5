//! Motions of a robot's joints, to be commanded, that tell its parameters.

use super::excitation::{ExcitationResult, ExcitedJoint, ExcitedParameter};
use super::settings::{Design, RobotMotion};
use crate::error::{StudyError, meaning};
use crate::limits;
use ndof_analysis::AnalysisError;
use ndof_analysis::file::read_text;
use ndof_analysis::result::{Head, Warning, given, number};
use ndof_devices::{JointKind, Robot, RobotConfig, SerialChain};
use ndof_joints::{Excitation, ExcitationSearch, JointLimits, excite};
use ndof_signal::{Channel, Quantity, Recording, Unit};

/// A motion with the result that describes it.
#[derive(Clone, Debug)]
pub struct ExcitedRobot {
    /// Channels `angle_…`, `vel_…`, `acc_…` and `torque_…` of each joint, from rest to rest.
    pub recording: Recording,
    /// What it keeps and tells.
    pub result: ExcitationResult,
}

impl RobotMotion {
    /// These settings with the times and the seed of `design`.
    ///
    /// # Errors
    /// [`StudyError`] that names a setting of `design` which is about perturbations at a hand, and would do nothing here.
    pub fn with(&self, design: &Design) -> Result<Self, StudyError> {
        let Design { duration_s, period_s, sample_rate_hz, seed, .. } = *design;
        let rest = Design { duration_s: None, period_s: None, sample_rate_hz: None, seed: None, ..design.clone() };
        match given(&rest).first() {
            Some(key) => {
                Err(meaning("the design", format!("`{key}` is about perturbations at the hand, not about motions of a `robot`; leave out one of them")))
            }
            None => Ok(RobotMotion { duration_s, period_s, sample_rate_hz, seed, ..self.clone() }),
        }
    }

    /// Designs the motion, as [`excite`] does.
    ///
    /// # Errors
    /// [`StudyError`] if the file cannot be read, or settings or limits make no motion.
    pub fn run(&self) -> Result<ExcitedRobot, StudyError> {
        let wrong = |what: String| meaning("the design", what);
        let robot = self.read()?;
        let (period_s, rate_hz) = (self.period_s.unwrap_or(10.0), self.sample_rate_hz.unwrap_or(500.0));
        let duration_s = self.duration_s.unwrap_or(5.0 * period_s);
        limits::simulation(1, duration_s, rate_hz, 4 * robot.joints.len()).map_err(wrong)?;
        if !(rate_hz > 0.0 && period_s > 0.0 && duration_s > 0.0) {
            return Err(wrong(format!("`duration={duration_s}`, `period={period_s}`, `sample_rate={rate_hz}`: give positive numbers")));
        }
        let periods = (duration_s / period_s).round().max(1.0);
        if (periods * period_s - duration_s).abs() > 1e-9 * duration_s {
            let whole = periods * period_s;
            return Err(wrong(format!(
                "`duration={duration_s}` is no whole number of periods of {period_s} s, so that it would not end at rest; take `duration={whole}`"
            )));
        }
        let own = |list: &[f64]| (!list.is_empty()).then(|| list.to_vec());
        let (rates, accelerations) = (own(&self.speed_limit), own(&self.acceleration_limit));
        let (limits, unlimited) = JointLimits::of(&robot, rates.as_deref(), accelerations.as_deref())?;
        let chain = robot.chain().map_err(|error| wrong(error.to_string()))?;
        let usual = ExcitationSearch::default();
        let search = ExcitationSearch {
            period_s,
            harmonics: self.fourier_terms.unwrap_or(usual.harmonics),
            margin: self.margin.unwrap_or(usual.margin),
            torque_noise: self.torque_noise,
            interest: self.interest.clone(),
            starts: self.starts.unwrap_or(usual.starts),
            seed: self.seed.unwrap_or(usual.seed),
            ..usual
        };
        let found = excite(&chain, &limits, &search)?;
        let samples = (duration_s * rate_hz).round();
        let result = ExcitationResult {
            head: Head::new(ExcitationResult::SCHEMA, "design", warnings(&unlimited, &robot.notes)),
            settings: self.clone(),
            robot: robot.name.clone(),
            sample_rate_hz: rate_hz,
            duration_s,
            period_s,
            condition: found.condition,
            condition_random_mean: number(found.random_conditions.iter().sum::<f64>() / found.random_conditions.len() as f64),
            condition_random_best: number(found.random_conditions.iter().copied().fold(f64::INFINITY, f64::min)),
            joints: joints(&robot, &limits, &found),
            parameters: found.parameters.iter().map(|p| ExcitedParameter::of(p, samples)).collect(),
        };
        Ok(ExcitedRobot { recording: recording(&robot, &chain, &found, samples as usize, rate_hz)?, result })
    }

    fn read(&self) -> Result<RobotConfig, StudyError> {
        let path = self.robot.as_ref().ok_or_else(|| meaning("the design", "give the robot's file with `robot`"))?;
        let (file, text) = read_text(path)?;
        RobotConfig::parse(&file, &text, self.tip.as_deref()).map_err(|error| meaning("the design", error.to_string()))
    }
}

fn warnings(unlimited: &[String], notes: &[String]) -> Vec<Warning> {
    let mut warnings = vec![Warning::new(
        "collisions",
        "nothing is known here of what the links may touch".to_owned(),
        "look at the motion in a simulation first, and play it slowly before it is played at speed",
    )];
    warnings.extend(notes.iter().map(|note| Warning::new("robot-file", note.clone(), "look whether it is so, or choose the end of the chain with `tip`")));
    if !unlimited.is_empty() {
        warnings.push(Warning::new(
            "no-range",
            format!("the file gives no range for {}: -π to π is assumed", unlimited.join(", ")),
            "write the range into the file if cables or the arm itself allow less",
        ));
    }
    warnings
}

fn joints(robot: &RobotConfig, limits: &JointLimits, found: &Excitation) -> Vec<ExcitedJoint> {
    let start = found.motion.at(0.0);
    let joint = |(j, used): (usize, &ndof_joints::UsedLimits)| ExcitedJoint {
        name: used.joint.clone(),
        unit: Unit::si(Quantity::Displacement, robot.joints[j].kind == JointKind::Revolute).symbol().to_owned(),
        start: start.angles[j],
        range: limits.range[j],
        range_used: used.angle,
        speed_limit: limits.rate[j],
        speed: used.rate,
        acceleration_limit: number(limits.acceleration[j]),
        acceleration: used.acceleration,
        torque_limit: number(limits.torque[j]),
        torque: used.torque,
        torque_noise: found.torque_noise[j],
    };
    found.used.iter().enumerate().map(joint).collect()
}

/// The motion with the torques of the nominal model, its last sample at rest.
fn recording(robot: &RobotConfig, chain: &SerialChain, found: &Excitation, samples: usize, rate_hz: f64) -> Result<Recording, StudyError> {
    let n = robot.joints.len();
    let (mut signals, mut torque) = (vec![Vec::with_capacity(samples + 1); 4 * n], vec![0.0; n]);
    for k in 0..=samples {
        let at = found.motion.at(k as f64 / rate_hz);
        chain.inverse_dynamics(&at.angles, &at.rates, &at.accelerations, &mut torque);
        for j in 0..n {
            let whole = torque[j] + chain.joints().friction(j, at.rates[j]);
            [at.angles[j], at.rates[j], at.accelerations[j], whole].into_iter().enumerate().for_each(|(q, value)| signals[q * n + j].push(value));
        }
    }
    let kinds = [
        ("angle", "pos", Quantity::Displacement),
        ("vel", "vel", Quantity::Velocity),
        ("acc", "acc", Quantity::Acceleration),
        ("torque", "force", Quantity::Effort),
    ];
    let channels = signals.into_iter().enumerate().map(|(k, signal)| {
        let ((turning, sliding, quantity), joint) = (kinds[k / n], &robot.joints[k % n]);
        let turns = joint.kind == JointKind::Revolute;
        Channel::new(format!("{}_{}", if turns { turning } else { sliding }, joint.name), Unit::si(quantity, turns), signal)
    });
    Recording::new(rate_hz, channels.collect()).map_err(|source| AnalysisError::Recording { file: "the design".to_owned(), source }.into())
}
