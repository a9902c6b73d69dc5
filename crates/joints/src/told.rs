//! The numbers of a cause as they are told, with their intervals.

use crate::answer::Answer;
use crate::causes::link_parameters::{NAMES, unit_of};
use crate::column::Column;
use crate::held_out::Sum;
use crate::physical;
use ndof_devices::TERMS_OF_A_LINK;
use ndof_diagnose::CauseParameter;
use ndof_models::effects::Value;

/// Name, unit, value, standard error and whether it is the inverse that is told.
type Number = (String, &'static str, f64, Option<f64>, bool);

impl Answer<'_> {
    pub fn parameters(&self, k: usize) -> Vec<CauseParameter> {
        let half = Sum { value: 0.0, error: 1.0, blocks: crate::blocks::BLOCKS }.ci95()[1];
        let told = self.told(k);
        told.into_iter()
            .map(|(name, unit, value, error, inverse)| {
                let mut ci = error.map(|e| [value - half * e, value + half * e]);
                // There is no less than none of what the file has.
                if value >= 0.0 && self.model.forms[k].told.iter().any(|told| told.name == name && told.amount && told.within[0] == 0.0 && told.file > 0.0) {
                    ci = ci.map(|[low, high]| [low.max(0.0), high]);
                }
                let (value, ci95) =
                    if inverse { (1.0 / value, ci.filter(|[low, _]| *low > 0.0).map(|[low, high]| [1.0 / high, 1.0 / low])) } else { (value, ci) };
                CauseParameter {
                    name,
                    unit: self.unit(&self.model.forms[k], unit).to_owned(),
                    value: Value::Number(value),
                    ci95: ci95.filter(|ci| ci.iter().all(|x| x.is_finite())),
                }
            })
            .collect()
    }

    /// What a model says of a form; of a link of which torques tell combinations alone, the body nearest to the file's that moves as was found, and no error of what
    /// is open.
    pub fn told(&self, k: usize) -> Vec<Number> {
        let told = self.model.told(k);
        let Some((link, open)) = self.open_terms(k) else { return told };
        let before = self.own_body(link);
        let Some(after) = self.body(k).and_then(|found| physical::nearest(self.scene.chain, link, &before, &found)) else {
            return told
                .into_iter()
                .map(|(name, unit, value, error, inverse)| (name.clone(), unit, value, error.filter(|_| !is_open(&name, &open)), inverse))
                .collect();
        };
        let term = |i: usize| {
            let name = format!("change_of_{}", NAMES[i]);
            let known = told.iter().find(|(own, ..)| *own == name).cloned().filter(|_| !open[i]);
            known.unwrap_or_else(|| (name, unit_of(i), after[i] - before[i], None, false))
        };
        let felt = physical::felt(self.scene.chain, link, &before);
        (0..TERMS_OF_A_LINK).filter(|i| felt[*i]).map(term).collect()
    }

    /// The inertial parameters of a link as the file has them.
    fn own_body(&self, link: usize) -> [f64; TERMS_OF_A_LINK] {
        let all = self.scene.chain.inertial_parameters();
        std::array::from_fn(|i| all[TERMS_OF_A_LINK * link + i])
    }

    /// The inertial parameters of the link that a form corrects.
    fn body(&self, k: usize) -> Option<[f64; TERMS_OF_A_LINK]> {
        let (form, factors) = (&self.model.forms[k], &self.model.factors[k]);
        let link = form.joint.filter(|_| form.cause.card.name == "link-parameters")?;
        let mut body = self.own_body(link);
        for (column, factor) in form.columns.iter().zip(factors) {
            let Column::Body { parts, .. } = column else { return None };
            body.iter_mut().zip(parts).for_each(|(body, part)| *body += factor * part);
        }
        Some(body)
    }

    /// Whether masses make the body that a form corrects, whatever its torques leave open; so does a link that the file says nothing of.
    pub fn is_possible(&self, k: usize) -> bool {
        let (Some(found), Some(link)) = (self.body(k), self.model.forms[k].joint) else { return true };
        let before = self.own_body(link);
        !physical::is_body(&before) || physical::body(self.scene.chain, link, &before, &found).is_some()
    }

    /// The link of a form that has several of its numbers, and which of all ten torques do not tell by themselves, if it is one that the form has.
    fn open_terms(&self, k: usize) -> Option<(usize, [bool; TERMS_OF_A_LINK])> {
        let form = &self.model.forms[k];
        let link = form.joint.filter(|_| form.cause.card.name == "link-parameters" && form.columns.len() > 1)?;
        let terms: Vec<usize> = (0..TERMS_OF_A_LINK).filter(|i| form.told.iter().any(|told| told.name == format!("change_of_{}", NAMES[*i]))).collect();
        let before = self.own_body(link);
        // What no torque feels is not told at all.
        let felt = physical::felt(self.scene.chain, link, &before);
        let of_form = physical::open(self.scene.chain, link, &before, &terms);
        let told_open = |of: [bool; TERMS_OF_A_LINK]| -> [bool; TERMS_OF_A_LINK] { std::array::from_fn(|i| of[i] && felt[i]) };
        let all: Vec<usize> = (0..TERMS_OF_A_LINK).collect();
        told_open(of_form).contains(&true).then(|| (link, told_open(physical::open(self.scene.chain, link, &before, &all))))
    }

    /// In words, what torques leave open of a link.
    pub fn open(&self, k: usize) -> Option<String> {
        let (_, open) = self.open_terms(k)?;
        let names: Vec<&str> = NAMES.iter().zip(open).filter(|(_, open)| *open).map(|(name, _)| *name).collect();
        Some(format!(
            "torques tell no more than combinations of {}: these are as near to the file as what was found allows, and have no interval",
            names.join(", ")
        ))
    }
}

fn is_open(name: &str, open: &[bool; TERMS_OF_A_LINK]) -> bool {
    NAMES.iter().zip(open).any(|(own, open)| *open && name == format!("change_of_{own}"))
}
