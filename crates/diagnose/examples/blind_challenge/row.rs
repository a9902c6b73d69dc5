//! One case of the challenge and what was said of it.

use ndof_challenge::draw::registry_name;
use ndof_challenge::strength::Strength;
use ndof_challenge::{Case, Made};
use ndof_diagnose::{Cause, Diagnosis, Features, Verdict};
use ndof_models::effects::Value;
use serde::{Deserialize, Serialize};

/// A cause as named.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Named {
    pub effect: String,
    pub axis: String,
    pub probability: f64,
    pub features: Vec<f64>,
    /// What the probability may be at most.
    pub at_most: f64,
    pub confusable: Vec<String>,
}

/// A true parameter and the interval given for it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Interval {
    pub parameter: String,
    pub truth: f64,
    pub value: f64,
    pub ci95: Option<[f64; 2]>,
}

/// A case.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    pub seed: u64,
    pub number: u64,
    pub kind: String,
    pub plant: String,
    pub trials: usize,
    pub hidden: Vec<(String, f64)>,
    pub axis: String,
    /// Share of the residual that the effect makes, and the root of its power over the effort's.
    pub share: f64,
    pub size: f64,
    pub named: Vec<Named>,
    pub minor: Vec<String>,
    pub verdict: Verdict,
    pub intervals: Vec<Interval>,
    pub error: Option<String>,
    pub seconds: f64,
}

/// How strong the only hidden effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    Clear,
    Middle,
    Weak,
    /// Below 5 % of the residual, or below the tolerance.
    Faint,
}

impl Named {
    /// The probability that the coefficients of this program give.
    fn weigh(&mut self) {
        if let Ok(features) = self.features.as_slice().try_into() {
            self.probability = Features(features).probability().min(self.at_most);
        }
    }
}

impl Row {
    /// The row with probabilities by the coefficients of this program, whichever one wrote it.
    pub fn weighed(mut self) -> Self {
        self.named.iter_mut().for_each(Named::weigh);
        self
    }

    pub fn new(seed: u64, number: u64, kind: &str, case: &Case, made: &Made, size: Strength, seconds: f64) -> Self {
        Row {
            seed,
            number,
            kind: kind.to_owned(),
            plant: case.plant.word().to_owned(),
            trials: case.trials,
            hidden: case.hidden.iter().map(|h| (h.name.to_owned(), h.severity)).collect(),
            axis: made.axis_name.to_owned(),
            share: size.share,
            size: size.size,
            named: vec![],
            minor: vec![],
            verdict: Verdict::Adequate,
            intervals: vec![],
            error: None,
            seconds,
        }
    }

    /// The row with what was said.
    pub fn told(mut self, made: &Made, d: &Diagnosis) -> Self {
        // A limb's own force is always there; it is no rival of what was hidden.
        let causes: Vec<&Cause> = d.causes.iter().filter(|c| c.effect != "limb-noise").collect();
        self.named = causes
            .iter()
            .map(|c| Named {
                effect: c.effect.clone(),
                axis: c.site.axis.clone(),
                probability: c.probability,
                features: c.features.map(|f| f.0.to_vec()).unwrap_or_default(),
                at_most: c.at_most,
                confusable: d.confusable.iter().filter(|k| k.effects.contains(&c.effect)).flat_map(|k| k.effects.clone()).filter(|e| *e != c.effect).collect(),
            })
            .collect();
        self.minor = d.minor.iter().map(|m| m.effect.clone()).collect();
        self.verdict = d.verdict;
        if self.hidden.len() == 1
            && let Some(cause) = causes.first().filter(|c| self.truth().contains(&c.effect.as_str()))
        {
            for &(name, truth) in &made.truth[0] {
                let found = cause.parameters.iter().find(|p| p.name.starts_with(name));
                if let Some((Value::Number(value), ci95)) = found.map(|p| (p.value.clone(), p.ci95)) {
                    self.intervals.push(Interval { parameter: name.to_owned(), truth, value, ci95 });
                }
            }
        }
        self
    }

    /// Registry names of what is hidden.
    pub fn truth(&self) -> Vec<&str> {
        self.hidden.iter().map(|h| registry_name(&h.0)).collect()
    }

    pub fn class(&self) -> Class {
        match self.share {
            _ if self.size < 0.01 || self.share < 0.05 => Class::Faint,
            s if s >= 0.5 => Class::Clear,
            s if s >= 0.2 => Class::Middle,
            _ => Class::Weak,
        }
    }

    /// Whether a name is one of what is hidden, by itself or as one of two that cannot be told apart.
    pub fn is_right(&self, named: &Named) -> bool {
        let truth = self.truth();
        truth.contains(&named.effect.as_str()) || named.confusable.iter().any(|c| truth.contains(&c.as_str()))
    }

    /// Whether the answer is what the challenge asks of its kind.
    pub fn right(&self) -> bool {
        match self.kind.as_str() {
            "null" | "background" => self.named.is_empty(),
            "outside" => !self.confident_wrong(),
            "pair" => self.truth().iter().all(|t| self.named.iter().any(|n| n.effect == *t || n.confusable.iter().any(|c| c == t))),
            _ => self.named.first().is_some_and(|n| self.is_right(n)),
        }
    }

    /// Whether exactly what is hidden is named, and nothing more.
    pub fn exact(&self) -> bool {
        self.right() && self.named.len() == self.hidden.len()
    }

    /// Whether a wrong name is said with a probability above 0.9, and no other beside it.
    pub fn confident_wrong(&self) -> bool {
        self.named.iter().any(|n| !self.is_right(n) && n.probability > 0.9 && n.confusable.is_empty())
    }

    /// The answer for the confusion matrix.
    pub fn answer(&self) -> &str {
        match (self.named.first(), self.verdict) {
            (Some(n), _) => &n.effect,
            (None, Verdict::Adequate) => "nothing",
            (None, _) => "unexplained",
        }
    }
}
