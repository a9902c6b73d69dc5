//! A question with its strength set: a case, its recordings, and what is true of it.

use super::families::Kind;
use super::paper::{Aim, Question};
use crate::strength::{Strength, against, floor};
use crate::{Case, Hidden, Made, Setting, TrueModel, make_with_truth};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How strong what is hidden turned out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Half or more of what a linear model leaves.
    Clear,
    /// 20 to 50 %.
    Middle,
    /// 5 to 20 %.
    Weak,
    /// Less, or below the tolerance.
    Faint,
}

/// A question as it is asked.
pub struct Posed {
    /// What was asked for.
    pub question: Question,
    /// The case that it became.
    pub case: Case,
    /// How it is recorded.
    pub setting: Setting,
    /// The recordings.
    pub made: Made,
    /// What the true model would predict.
    pub true_model: Option<TrueModel>,
    /// Strength of all that is hidden.
    pub strength: Strength,
}

/// A discrepancy counts from the tolerance on, 1 % of each signal; a quarter more, since two that measure it differ by as much.
const MATERIAL: f64 = 0.0125;

impl Posed {
    /// How strong what is hidden is.
    pub fn class(&self) -> Class {
        let Strength { share, size, output, tolerated } = self.strength;
        match share {
            _ if tolerated || size < 0.01 || output < MATERIAL => Class::Faint,
            s if s >= 0.5 => Class::Clear,
            s if s >= 0.2 => Class::Middle,
            s if s >= 0.05 => Class::Weak,
            _ => Class::Faint,
        }
    }
}

/// Sets the strength of a question by trials of one recording, and makes it. A question whose class is not the one that it aims at is drawn
/// again, then on the commonest plant of its family; then it is asked as it is.
pub fn pose(question: &Question) -> Posed {
    let wanted = if question.aim == Aim::Weak { Class::Weak } else { Class::Clear };
    let mut posed = attempt(question, question.seed);
    for again in 1..4 {
        if !set_by_aim(question) || posed.class() == wanted {
            break;
        }
        let mut other = question.clone();
        if again > 1 {
            other.plant = question.families[0].on.plants()[0].0;
            other.setting.rate_hz = question.setting.rate_hz.max(200.0);
        }
        posed = attempt(&other, question.seed.wrapping_add(again));
    }
    posed
}

/// Whether the strength is set by a share of the residual; what has to be seen against given parameters has a strength of its own.
fn set_by_aim(question: &Question) -> bool {
    !question.families.is_empty()
}

fn attempt(question: &Question, seed: u64) -> Posed {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let hide = |severities: &[f64]| question.hidden.iter().zip(severities).map(|(name, s)| Hidden { name, severity: *s }).collect();
    let mut setting = question.setting.clone();
    let mut case = Case {
        plant: question.plant,
        hidden: vec![],
        other: false,
        background: question.kind == "background",
        trials: question.trials,
        duration_s: question.duration_s,
        seed,
        command: (1.0, 1.0),
    };
    let mut severities = vec![rng.random_range(0.5..1.0); question.hidden.len()];
    if set_by_aim(question) {
        let outside = question.families[0].kind == Kind::Outside;
        for (name, severity) in question.hidden.iter().zip(&mut severities) {
            let odds = match (question.kind, question.aim) {
                (_, Aim::Weak) => share_odds(rng.random_range(0.08..0.17)),
                ("pair", _) => f64::exp(rng.random_range(f64::ln(1.5)..f64::ln(40.0))),
                _ => f64::exp(rng.random_range(f64::ln(1.5)..f64::ln(100.0))),
            };
            let alone = Case { hidden: vec![Hidden { name, severity: 0.3 }], trials: 1, ..case.clone() };
            let least = if outside { 0.03 } else { 1.1 * MATERIAL };
            *severity = calibrated(alone, &mut setting, odds, least, question.aim);
        }
    }
    case.hidden = hide(&severities);
    let (made, true_model) = make_with_truth(&case, &setting);
    let hides = !case.hidden.is_empty() || case.background;
    let strength = if hides { against(&case, &setting, &floor(&case, &setting)) } else { Strength::default() };
    Posed { question: question.clone(), case, setting, made, true_model, strength }
}

fn share_odds(share: f64) -> f64 {
    share / (1.0 - share)
}

/// Severity at which one effect has these odds of power against all else that a linear model leaves, and at least that size in the
/// output. For a weak effect the limb's own force is made as large as that takes.
fn calibrated(mut case: Case, setting: &mut Setting, odds: f64, least: f64, aim: Aim) -> f64 {
    let mut below = floor(&case, setting);
    let least_severity = least_severity(&case);
    for last in [false, false, false, true] {
        let (mut found, mut by_odds) = (Strength::default(), 1.0);
        for _ in 0..6 {
            found = against(&case, setting, &below);
            by_odds = (odds / share_odds(found.share.clamp(1e-6, 1.0 - 1e-6))).sqrt();
            let by_size = least / found.output.max(1e-6);
            let factor = if aim == Aim::Weak { by_odds } else { by_odds.max(by_size) };
            let wanted = (case.hidden[0].severity * factor.clamp(0.15, 5.0)).clamp(least_severity, MOST);
            if (0.85..1.18).contains(&(wanted / case.hidden[0].severity)) {
                break;
            }
            case.hidden[0].severity = wanted;
        }
        let too_strong = if case.hidden[0].severity <= least_severity { 1.0 / by_odds } else { 0.0 };
        let more = (1.15 * least / found.output.max(1e-6)).max(0.0115 / found.size.max(1e-6)).max(too_strong);
        if aim != Aim::Weak || more < 1.1 || last {
            break;
        }
        setting.own = (setting.own * more.min(4.0)).min(LOUDEST);
        below = floor(&case, setting);
    }
    case.hidden[0].severity
}

/// Severity below which instruments tolerate a latency, a lag or an angle.
fn least_severity(case: &Case) -> f64 {
    let slower = 12.0 / case.plant.band_hz();
    match case.hidden[0].name.split('/').next() {
        Some("measurement-delay") => 0.075 * slower,
        Some("channel-filter") => 0.07 * slower,
        Some("sensor-misalignment") => 0.14,
        _ => 1e-3,
    }
}

/// How much louder than usual a limb may be, for an effect to be weak in its recording.
const LOUDEST: f64 = 10.0;

/// Severity beyond which no effect goes: springs would become negative.
const MOST: f64 = 1.0;
