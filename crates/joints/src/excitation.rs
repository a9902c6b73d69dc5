//! Motions of a robot that make its parameters well determined, within the limits of its joints.

mod climb;
mod fourier;
mod information;
mod limits;

pub use fourier::{FourierMotion, FourierSeries, JointMotion};
pub use limits::JointLimits;

use climb::climb;
use fourier::FourierSeries as Series;
use information::Model;
use ndof_devices::SerialChain;
use ndof_models::robot::Robot;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Random motions within the limits that the search begins from and is compared with.
pub const RANDOM_MOTIONS: usize = 50;
/// Draws in which a random motion has to be found; a robot that can carry itself anywhere needs one.
const DRAWS: usize = 50;
/// Samples a cycle of the highest harmonic in the search. Products of two harmonics, as in centrifugal torques, still have four.
const SEARCH: usize = 8;
/// Samples a cycle of the highest harmonic when torque limits are checked and errors predicted: 20 times those of the search.
const FINE: usize = 160;
/// Torque noise as a share of a joint's root mean square torque, where none is given.
const NOISE: f64 = 0.01;

/// Why no motion could be designed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExcitationError {
    /// A joint that cannot be moved, or not known how far or fast.
    #[error("joint \"{joint}\" {what}")]
    Joint {
        /// Its name.
        joint: String,
        /// What is wrong with it and what to do.
        what: String,
    },
    /// A value that makes no motion.
    #[error("`{what}={value}`: it must be {must}")]
    Value {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// A list that is not one entry a joint.
    #[error("`{what}` has {found} values; give one for all joints, or one for each of the {joints}")]
    Count {
        /// Which.
        what: &'static str,
        /// Its length.
        found: usize,
        /// Number of joints.
        joints: usize,
    },
    /// Nothing is called so.
    #[error("`interest`: no joint and no parameter is called \"{pattern}\"; there are: {known}")]
    Interest {
        /// What was asked for.
        pattern: String,
        /// What there is.
        known: String,
    },
    /// Random motions all pass a torque limit.
    #[error(
        "no motion within the torque limits was found in {DRAWS} draws: \"{joint}\" needs {share:.2} of what it may; correct the limit, or lower `margin`, `speed_limit` or the range"
    )]
    Torque {
        /// The joint that fell short most.
        joint: String,
        /// Its largest torque over what it may use, in the draw that came nearest.
        share: f64,
    },
    /// No motion tells the parameters apart.
    #[error("no motion tells the parameters apart; take more `fourier_terms`")]
    Singular,
}

/// What is searched for; the default is ten-second periods of five harmonics.
#[derive(Clone, Debug, PartialEq)]
pub struct ExcitationSearch {
    /// Length of a period (s).
    pub period_s: f64,
    /// Sines and cosines of each joint, at least 2.
    pub harmonics: usize,
    /// Share of every limit that stays free for the controller: it follows with an error.
    pub margin: f64,
    /// Root mean square torque noise of every joint (N m, N), white from sample to sample; without, 1 % of each joint's torque in random motions.
    pub torque_noise: Option<f64>,
    /// Joints, or parts of names of parameters, to be determined best; none for all parameters.
    pub interest: Vec<String>,
    /// How many of the best random motions are improved.
    pub starts: usize,
    /// Rounds over all coefficients in each.
    pub rounds: usize,
    /// Of all random numbers.
    pub seed: u64,
}

impl Default for ExcitationSearch {
    fn default() -> Self {
        ExcitationSearch { period_s: 10.0, harmonics: 5, margin: 0.1, torque_noise: None, interest: Vec::new(), starts: 4, rounds: 12, seed: 1 }
    }
}

/// A motion with what it determines.
#[derive(Clone, Debug, PartialEq)]
pub struct Excitation {
    /// The motion.
    pub motion: FourierMotion,
    /// Condition number of the regressor with columns of length one.
    pub condition: f64,
    /// That of random motions within the same limits.
    pub random_conditions: Vec<f64>,
    /// Root mean square torque noise of each joint that the errors are predicted for (N m, N).
    pub torque_noise: Vec<f64>,
    /// Base parameters of the bodies, then viscous and dry friction of each joint.
    pub parameters: Vec<PredictedParameter>,
    /// What of the limits is used, joint by joint.
    pub used: Vec<UsedLimits>,
}

/// A parameter with the error that one sample an instant of a whole period would give it.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictedParameter {
    /// Its name, a combination of inertial parameters in words.
    pub name: String,
    /// Its value in the nominal model.
    pub value: f64,
    /// Standard error times the root of the number of samples.
    pub error_of_one_sample: f64,
    /// Whether it is one of those of interest.
    pub of_interest: bool,
}

/// What a motion uses of a joint's limits; the range in rad or m, the others as largest magnitudes.
#[derive(Clone, Debug, PartialEq)]
pub struct UsedLimits {
    /// The joint.
    pub joint: String,
    /// Least and greatest angle.
    pub angle: [f64; 2],
    /// Largest rate.
    pub rate: f64,
    /// Largest acceleration.
    pub acceleration: f64,
    /// Largest torque of the nominal model, friction included.
    pub torque: f64,
}

/// Designs a periodic motion by which the base parameters and the friction of a robot are determined best from measured torques.
///
/// With the regressor W of all samples, rows divided by the torque noise, the covariance of the parameters is (WᵀW)⁻¹. The geometric mean of
/// its pivots, a power of its determinant, times the squared condition of W with columns of length one is made small; with
/// [`ExcitationSearch::interest`] it is the determinant of these parameters' block alone (D_s-optimal). The best of [`RANDOM_MOTIONS`] random
/// motions are improved coefficient by coefficient. Every motion looked at keeps range, rate and acceleration at
/// all times; torques of the nominal model are computed by inverse dynamics. Links may still touch each other or what stands around.
/// The result depends on the seed and not on the number of threads.
///
/// J. Swevers et al., IEEE Trans. Robot. Autom. 13 (1997) 730; A. C. Atkinson, A. N. Donev, R. D. Tobias, Optimum Experimental Designs,
/// with SAS (2007), ch. 10.
///
/// # Errors
/// [`ExcitationError`] for settings that make no motion, and if no motion keeps the torque limits or tells the parameters apart.
///
/// ```
/// use ndof_devices::{JointConfig, RobotConfig};
/// use ndof_joints::{ExcitationSearch, JointLimits, excite};
///
/// let text = r#"
/// schema = "ndof/robot/1"
/// name = "pendulum"
/// joints = [{ name = "elbow", axis = [0.0, 1.0, 0.0], mass_kg = 2.0, centre_m = [0.3, 0.0, 0.0], rate_limit_rad_per_s = 2.0, torque_limit_nm = 20.0 }]
/// "#;
/// let robot = RobotConfig::parse("pendulum.toml", text, None)?;
/// let (limits, without_range) = JointLimits::of(&robot, None, None)?;
/// assert_eq!(without_range, ["elbow"]);
/// let found = excite(&robot.chain()?, &limits, &ExcitationSearch::default())?;
/// assert!(found.used[0].rate <= 2.0 && found.used[0].torque <= 20.0);
/// // Inertia, two moments of gravity, viscous and dry friction.
/// assert_eq!(found.parameters.len(), 5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn excite(chain: &SerialChain, limits: &JointLimits, asked: &ExcitationSearch) -> Result<Excitation, ExcitationError> {
    check(asked)?;
    let mut model = Model::new(chain, &asked.interest)?;
    let search = Search { limits: limits.within(asked.margin), asked, joints: chain.joints().count() };
    let random = (0..RANDOM_MOTIONS as u64).into_par_iter().map(|stream| search.random(&model, stream)).collect::<Result<Vec<_>, _>>()?;
    let motions: Vec<FourierMotion> = random.iter().map(|genes| search.motion(genes)).collect();
    let noise =
        asked.torque_noise.map_or_else(|| model.mean_torques(&motions, search.samples()).into_iter().map(|t| NOISE * t).collect(), |n| vec![n; search.joints]);
    model.weigh(&noise);
    let costs: Vec<f64> = random.par_iter().map(|genes| search.cost(&model, genes)).collect();
    let mut order: Vec<usize> = (0..random.len()).collect();
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    let improved: Vec<(Vec<f64>, f64)> = order[..asked.starts.min(order.len())]
        .par_iter()
        .map(|&k| climb(random[k].clone(), costs[k], asked.rounds, |genes| search.cost(&model, genes)))
        .collect();
    let best = improved.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, cost)| cost.is_finite());
    let (genes, _) = best.ok_or(ExcitationError::Singular)?;
    let motion = search.kept(&model, &genes);
    let random_conditions = motions.iter().filter_map(|motion| model.condition(motion, search.samples())).collect();
    let fine = FINE * asked.harmonics;
    Ok(Excitation {
        condition: model.condition(&motion, search.samples()).ok_or(ExcitationError::Singular)?,
        random_conditions,
        parameters: model.predicted(&motion, fine).ok_or(ExcitationError::Singular)?,
        used: search.used(&model, &motion, fine),
        torque_noise: noise,
        motion,
    })
}

fn check(asked: &ExcitationSearch) -> Result<(), ExcitationError> {
    let wrong = [
        ("period", asked.period_s, asked.period_s > 0.0 && asked.period_s.is_finite(), "above zero"),
        ("fourier_terms", asked.harmonics as f64, (2..=100).contains(&asked.harmonics), "2 to 100"),
        ("margin", asked.margin, (0.0..1.0).contains(&asked.margin), "at least 0 and below 1"),
        ("starts", asked.starts as f64, (1..=RANDOM_MOTIONS).contains(&asked.starts), "1 to 50"),
        ("torque_noise", asked.torque_noise.unwrap_or(1.0), asked.torque_noise.is_none_or(|n| n > 0.0 && n.is_finite()), "above zero"),
    ];
    wrong.into_iter().find(|(_, _, right, _)| !right).map_or(Ok(()), |(what, value, _, must)| Err(ExcitationError::Value { what, value, must }))
}

/// Where motions are looked for. A motion is a list of numbers of about one: for each joint where it stands in what its range leaves, 0 to 1,
/// then aₖ and bₖ as shares of the rate limit.
struct Search<'a> {
    limits: JointLimits,
    asked: &'a ExcitationSearch,
    joints: usize,
}

impl Search<'_> {
    fn samples(&self) -> usize {
        SEARCH * self.asked.harmonics
    }

    /// The motion of these numbers, made smaller where it would pass range, rate or acceleration.
    fn motion(&self, genes: &[f64]) -> FourierMotion {
        let (harmonics, period_s) = (self.asked.harmonics, self.asked.period_s);
        let series = |(j, genes): (usize, &[f64])| {
            let (sines, cosines) = genes[1..].split_at(harmonics);
            let own = Series::at_rest(sines, cosines);
            let ([low, high], rate, acceleration) = own.reach(period_s);
            let [least, most] = self.limits.range[j];
            let limits = [(most - least) / (high - low), self.limits.rate[j] / rate, self.limits.acceleration[j] / acceleration];
            let factor = limits.into_iter().filter(|v| v.is_finite()).fold(self.limits.rate[j], f64::min);
            let (low, high) = (factor * low, factor * high);
            own.scaled(factor, least - low + genes[0].clamp(0.0, 1.0) * (most - least - (high - low)))
        };
        FourierMotion { period_s, joints: genes.chunks(1 + 2 * harmonics).enumerate().map(series).collect() }
    }

    /// What is made small, infinite beyond a torque limit.
    fn cost(&self, model: &Model<'_>, genes: &[f64]) -> f64 {
        let motion = self.motion(genes);
        match self.torque_share(model, &motion, self.samples()).1 <= 1.0 {
            true => model.uncertainty(&motion, self.samples()).unwrap_or(f64::INFINITY),
            false => f64::INFINITY,
        }
    }

    /// The joint whose largest torque is the largest share of its limit, and the share.
    fn torque_share(&self, model: &Model<'_>, motion: &FourierMotion, samples: usize) -> (usize, f64) {
        let peaks = model.largest_torques(motion, samples);
        let shares = peaks.iter().zip(&self.limits.torque).map(|(peak, limit)| peak / limit).enumerate();
        shares.fold((0, 0.0), |worst, share| if share.1 > worst.1 { share } else { worst })
    }

    /// A random motion that uses its rate or its range, or less where torques ask for it.
    fn random(&self, model: &Model<'_>, stream: u64) -> Result<Vec<f64>, ExcitationError> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.asked.seed);
        rng.set_stream(stream);
        let a_joint = 1 + 2 * self.asked.harmonics;
        let mut nearest = (0, f64::INFINITY);
        for _ in 0..DRAWS {
            let mut genes: Vec<f64> =
                (0..self.joints * a_joint).map(|i| if i % a_joint == 0 { rng.random_range(0.0..1.0) } else { rng.random_range(-1.0..1.0) }).collect();
            // Half as fast six times over: torques are then those of the posture.
            for _ in 0..6 {
                let worst = self.torque_share(model, &self.motion(&genes), self.samples());
                if worst.1 <= 1.0 {
                    return Ok(genes);
                }
                nearest = if worst.1 < nearest.1 { worst } else { nearest };
                genes.chunks_mut(a_joint).for_each(|joint| joint[1..].iter_mut().for_each(|v| *v *= 0.5));
            }
        }
        Err(ExcitationError::Torque { joint: model.chain.joints().names[nearest.0].clone(), share: nearest.1 })
    }

    /// The motion, a little smaller where torques between the samples of the search pass their limits.
    fn kept(&self, model: &Model<'_>, genes: &[f64]) -> FourierMotion {
        let mut motion = self.motion(genes);
        for _ in 0..100 {
            if self.torque_share(model, &motion, FINE * self.asked.harmonics).1 <= 1.0 {
                break;
            }
            for series in &mut motion.joints {
                let centre = series.centre;
                *series = series.clone().scaled(0.99, centre);
            }
        }
        motion
    }

    fn used(&self, model: &Model<'_>, motion: &FourierMotion, samples: usize) -> Vec<UsedLimits> {
        let torques = model.largest_torques(motion, samples);
        let joints = model.chain.joints().names.iter().zip(&motion.joints).zip(torques);
        let used = |((joint, series), torque): ((&String, &Series), f64)| {
            let (angle, rate, acceleration) = series.reach(motion.period_s);
            UsedLimits { joint: joint.clone(), angle, rate, acceleration, torque }
        };
        joints.map(used).collect()
    }
}
