//! How an effect shows itself in a measured motion: what a search tries.

use super::card::Side;
use super::curved_arm::CurvedArm;
use super::matrix::Matrix;
use super::parameters::Value;
use super::reflex::ScheduledReflex;
use super::waves::ScheduledMatrix;
use crate::force_law::ForceLaw;
use num_complex::Complex64;
use std::sync::Arc;

/// A transfer function of s = j 2 π f and the knobs.
pub type Operator = Arc<dyn Fn(Complex64, &[f64]) -> Complex64 + Send + Sync>;
/// A force law from knobs and coefficients; it is linear in the coefficients.
pub type LawMaker = Arc<dyn Fn(&[f64], &[f64]) -> Box<dyn ForceLaw> + Send + Sync>;
/// A matrix from knobs.
pub type MatrixMaker = Arc<dyn Fn(&[f64]) -> Vec<Vec<f64>> + Send + Sync>;
/// Named parameters from knobs and coefficients.
pub type Naming = Arc<dyn Fn(&[f64], &[f64]) -> Vec<(&'static str, Value)> + Send + Sync>;

/// A sentence from knobs, coefficients and the inertia, damping and stiffness that the axis has in the same model; whether the axis turns.
pub type Remark = fn(&[f64], &[f64], [f64; 3], bool) -> String;

/// A nonlinear parameter of a form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knob {
    /// Smallest value.
    pub lo: f64,
    /// Largest value.
    pub hi: f64,
    /// Whether steps are taken on a logarithmic scale.
    pub log: bool,
    /// Whether a best value at the lower end means that something else is at work.
    pub telling: bool,
}

impl Knob {
    /// Steps of equal size between these values.
    pub fn linear(lo: f64, hi: f64) -> Self {
        Knob { lo, hi, log: false, telling: false }
    }

    /// Steps of equal ratio between these values, both above zero.
    pub fn log(lo: f64, hi: f64) -> Self {
        Knob { lo, hi, log: true, telling: false }
    }
}

/// What a linear coefficient may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Zero or more.
    Positive,
    /// Zero or less.
    Negative,
    /// Anything.
    Free,
}

/// What an effect does to the balance of forces or to the channels.
#[derive(Clone)]
pub enum Action {
    /// Resisting forces computed from the motion, each with a coefficient that is found by least squares.
    Force {
        /// The law; the regressor of coefficient j is the law with the j-th unit vector.
        law: LawMaker,
        /// The best linear approximation of a law that is computed along the motion, where it is known in closed form.
        tangent: Option<Operator>,
    },
    /// Entries of a matrix that follow the schedule, as many coefficients each as there are waves.
    Scheduled(ScheduledMatrix),
    /// A reflex whose gain follows the schedule: its mean, then as many coefficients as there are waves.
    Reflex(ScheduledReflex),
    /// M, B and K of the baseline act along the curve of an arm; one coefficient for the inertia that follows the elbow.
    Curved(CurvedArm),
    /// Entries of the linear model that the baseline holds fixed; one coefficient for all entries.
    Entries {
        /// Which matrix.
        matrix: Matrix,
        /// Row, column and weight of each.
        entries: Vec<(usize, usize, f64)>,
    },
    /// The effort channels, or that of the axis, pass a filter: corrected effort = operator × measured effort.
    Effort(Operator),
    /// The effort of the axis passes a resonance that rings on from before the record: corrected effort = operator × measured effort.
    Mode {
        /// The operator.
        passes: Operator,
        /// Its pole above the real axis, from the knobs.
        pole: fn(&[f64]) -> Complex64,
    },
    /// The effort channels fall behind as time goes on: corrected effort at t = measured effort at t + a + b t, of the knobs a (s) and b.
    Lag,
    /// The motion channels, or that of the axis, pass a filter: corrected motion = operator × measured motion.
    Motion(Operator),
    /// Compliance in series: corrected motion = measured motion - operator × effort.
    Series(Operator),
    /// Effort channels are mixed: corrected effort = matrix × measured effort.
    Mix(MatrixMaker),
    /// The applied effort is the measured one, clipped at ± the knob.
    Clip,
}

impl Action {
    /// A force by its law from knobs and coefficients; one that has a [response](ForceLaw::response) is taken from there.
    pub fn force<L: ForceLaw + 'static>(law: impl Fn(&[f64], &[f64]) -> L + Send + Sync + 'static) -> Self {
        Action::Force { law: Arc::new(move |knobs, coefficients| Box::new(law(knobs, coefficients))), tangent: None }
    }

    /// A force whose best linear approximation is known.
    pub fn tangent<L: ForceLaw + 'static>(
        law: impl Fn(&[f64], &[f64]) -> L + Send + Sync + 'static,
        tangent: impl Fn(Complex64, &[f64]) -> Complex64 + Send + Sync + 'static,
    ) -> Self {
        Action::Force { law: Arc::new(move |knobs, coefficients| Box::new(law(knobs, coefficients))), tangent: Some(Arc::new(tangent)) }
    }

    /// The force law with these knobs and coefficients; none of what is no force along the motion.
    pub fn law(&self, knobs: &[f64], coefficients: &[f64]) -> Option<Box<dyn ForceLaw>> {
        match self {
            Action::Force { law, .. } => Some(law(knobs, coefficients)),
            Action::Scheduled(of) => Some(of.law(coefficients)),
            Action::Reflex(of) => Some(of.law(knobs, coefficients)),
            _ => None,
        }
    }
}

/// One functional form of an effect at one site, ready to be tried.
#[derive(Clone)]
pub struct Form {
    /// Its short name among the forms of the effect, e.g. `Bouc-Wen`.
    pub label: &'static str,
    /// The side of its site.
    pub side: Side,
    /// The axis; `None` for all axes together.
    pub axis: Option<usize>,
    /// Nonlinear parameters.
    pub knobs: Vec<Knob>,
    /// Starting points for the knobs.
    pub grid: Vec<Vec<f64>>,
    /// Signs of the linear coefficients.
    pub signs: Vec<Sign>,
    /// What it does.
    pub action: Action,
    /// The contract's parameters from knobs and coefficients.
    pub naming: Naming,
    /// How far parameters' systematic errors go, beyond their statistical ones, as a share of each.
    pub floor: f64,
    /// Parameters that have an error of this size (SI) as well.
    pub absolute: Vec<(&'static str, f64)>,
    /// What its numbers say beside those of the model that it is in.
    pub remark: Option<Remark>,
}

impl Form {
    /// A form of the limb without knobs and coefficients, whose parameters are known to a hundredth.
    pub fn new(label: &'static str, axis: Option<usize>, action: Action) -> Self {
        Form {
            label,
            side: Side::Limb,
            axis,
            knobs: Vec::new(),
            grid: vec![Vec::new()],
            signs: Vec::new(),
            action,
            naming: Arc::new(|_, _| Vec::new()),
            floor: 0.01,
            absolute: Vec::new(),
            remark: None,
        }
    }

    /// On this side.
    pub fn at(self, side: Side) -> Self {
        Form { side, ..self }
    }

    /// With knobs, started at all combinations of these values of each.
    pub fn knobs(self, knobs: Vec<Knob>, starts: &[&[f64]]) -> Self {
        Form { knobs, grid: grid(starts), ..self }
    }

    /// With coefficients of these signs.
    pub fn coefficients(self, signs: Vec<Sign>) -> Self {
        Form { signs, ..self }
    }

    /// With parameters by name, from knobs and coefficients.
    pub fn naming(self, naming: impl Fn(&[f64], &[f64]) -> Vec<(&'static str, Value)> + Send + Sync + 'static) -> Self {
        Form { naming: Arc::new(naming), ..self }
    }

    /// With parameters that are all numbers.
    pub fn numbers<const N: usize>(self, numbers: impl Fn(&[f64], &[f64]) -> [(&'static str, f64); N] + Send + Sync + 'static) -> Self {
        self.naming(move |knobs, coefficients| numbers(knobs, coefficients).map(|(name, value)| (name, Value::Number(value))).to_vec())
    }

    /// With systematic errors of this share of each parameter.
    pub fn floor(self, floor: f64) -> Self {
        Form { floor, ..self }
    }

    /// With a systematic error of a parameter (SI) beside its share.
    pub fn absolute(mut self, parameter: &'static str, error: f64) -> Self {
        self.absolute.push((parameter, error));
        self
    }

    /// With what its numbers say beside those of the model that it is in.
    pub fn remark(self, remark: Remark) -> Self {
        Form { remark: Some(remark), ..self }
    }

    /// The systematic error of a parameter of this value (SI).
    pub fn systematic(&self, parameter: &str, value: f64) -> f64 {
        self.absolute.iter().filter(|(name, _)| *name == parameter).fold(self.floor * value, |sum, (_, error)| sum.hypot(*error))
    }

    /// The number of parameters that a search pays for.
    pub fn cost(&self) -> usize {
        self.knobs.len() + self.signs.len()
    }

    /// Whether knobs and coefficients lie where the form makes sense.
    pub fn admits(&self, knobs: &[f64], coefficients: &[f64]) -> bool {
        self.knobs.iter().zip(knobs).all(|(k, &v)| (k.lo..=k.hi).contains(&v))
            && self.signs.iter().zip(coefficients).all(|(sign, &c)| match sign {
                Sign::Positive => c >= 0.0,
                Sign::Negative => c <= 0.0,
                Sign::Free => true,
            })
    }
}

/// All combinations of the values of each knob.
fn grid(axes: &[&[f64]]) -> Vec<Vec<f64>> {
    axes.iter()
        .fold(vec![Vec::new()], |points, values| points.iter().flat_map(|p| values.iter().map(move |&v| p.iter().copied().chain([v]).collect())).collect())
}

/// The sizes of things in a recording, from which grids and bounds follow.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Standard deviation of each axis' displacement.
    pub position: Vec<f64>,
    /// How far from its mean each axis goes, but for seven of a hundred samples: 1.8 standard deviations, of Gaussian ones.
    pub far: Vec<f64>,
    /// Mean of each axis' displacement, which laws are centred on.
    pub centre: Vec<f64>,
    /// Standard deviation of each velocity.
    pub velocity: Vec<f64>,
    /// Standard deviation of each effort.
    pub effort: Vec<f64>,
    /// The unit of time: 1 where the analysed band ends at 12 Hz, longer for slower recordings.
    pub time_s: f64,
    /// Length of a trial.
    pub duration_s: f64,
    /// Middle of the part that is analysed.
    pub middle_s: f64,
    /// Fitted (or given) inertia.
    pub mass: Vec<Vec<f64>>,
    /// Fitted (or given) stiffness.
    pub stiffness: Vec<Vec<f64>>,
    /// Whether the plant has a restoring force.
    pub spring: bool,
    /// How many times what was measured of the motion is integrated to the displacement.
    pub integrals: usize,
    /// Whether the axes are rotations.
    pub rotational: bool,
    /// Whether the motion is imposed and the effort answers.
    pub motion_imposed: bool,
    /// Whether the effort is a command and not a measurement.
    pub effort_is_command: bool,
    /// Names of the effort channels.
    pub effort_names: Vec<String>,
    /// Names of the motion channels.
    pub motion_names: Vec<String>,
    /// Entries of the baseline that are given and may be wrong, with their values.
    pub nominal: Vec<(Matrix, usize, usize, f64)>,
    /// Entries of the baseline that are held at a given value, right or wrong.
    pub held: Vec<(Matrix, usize, usize, f64)>,
    /// Whether the damping and stiffness that the baseline fits are symmetric.
    pub symmetric: bool,
    /// Whether the schedule's end is its beginning, as of the phase of a cycle; none where there is no schedule.
    pub closed_schedule: Option<bool>,
    /// The arm whose hand moves, at the mean of the motion; none where it is not known.
    pub arm: Option<CurvedArm>,
}

impl Scale {
    /// The number of axes.
    pub fn axes(&self) -> usize {
        self.position.len()
    }

    /// The unit of time for what nerves and muscles do: seconds, unless the recording is far from human time.
    pub fn human_time_s(&self) -> f64 {
        if (0.2..=5.0).contains(&self.time_s) { 1.0 } else { self.time_s }
    }

    /// Whether the baseline takes an entry for known, right or wrong.
    pub(super) fn is_given(&self, matrix: Matrix, row: usize, column: usize) -> bool {
        self.nominal.iter().chain(&self.held).any(|e| (e.0, e.1, e.2) == (matrix, row, column))
    }
}
