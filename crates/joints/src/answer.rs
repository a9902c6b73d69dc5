//! The answer in the words of every diagnosis.

use crate::again::Again;
use crate::causes::Form;
use crate::explained::explained;
use crate::generic::Left;
use crate::held_out::{Sum, gain, losses, predicted};
use crate::judged::{Aside, Searched, of_a_simulator, share};
use crate::lost::Lost;
use crate::mistaken::Mistaken;
use crate::model::{Model, residual};
use crate::motion::Motion;
use crate::options::Options;
use crate::passing::Passing;
use crate::rivals::{EITHER, TOLD_APART, rivals};
use crate::scene::Scene;
use crate::search::Solved;
use crate::table::View;
use crate::taken::Taken;
use crate::verdict::removed;
use ndof_devices::TERMS_OF_A_LINK;
use ndof_diagnose::{Cause, Confusable, Considered, Diagnosis, Extended, Gain, Minor, Model as Told, ModelParameter, Score, Shift, Site, Split, UNSURE};
use ndof_models::robot::Robot;
use ndof_signal::{Recording, deviation, rms};
use ndof_sysid::Ports;

/// What to do where nothing of the log tells.
const THE_SAME: &str = "along this movement both are the same torque, to the last digit: whichever is corrected, the file needs what was measured; only a movement of other joints, or taking the robot apart, can tell";

/// All that an answer is written from.
pub(crate) struct Answer<'a> {
    pub scene: &'a Scene<'a>,
    pub trials: &'a [Recording],
    pub ports: &'a Ports,
    pub fitted: &'a View<'a>,
    pub held: &'a View<'a>,
    pub forms: &'a [Form],
    pub searched: &'a Searched,
    pub model: &'a Model,
    pub left: &'a Left,
    pub again: &'a [Again],
    /// Channels that are not what they are called.
    pub mistaken: Option<Mistaken>,
    /// Channels that may not mean what they say, in words.
    pub suspicions: &'a [String],
    /// How the log is taken.
    pub taken: &'a Taken,
    /// Rows that it has lost.
    pub lost: Option<&'a Lost>,
    /// Joints that hardly move.
    pub unmoved: &'a [bool],
    /// What acts at each joint for a while.
    pub passing: &'a [Option<Passing>],
    pub options: &'a Options,
}

impl Answer<'_> {
    pub fn write(&self, [estimation, held_out]: [String; 2], mut minor: Vec<Aside>) -> Diagnosis {
        let mut unseen = false;
        for aside in minor.iter_mut().filter(|aside| self.is_unseen(&aside.form)) {
            unseen = true;
            aside.why = "it acts in what was fitted, and not in what was held out: hold out another stretch, or record longer".to_owned();
        }
        let empty = Model::file(self.joints());
        let [before, after] = [&empty, self.model].map(|model| self.score(model));
        let floor = self.floor(&after);
        let total = gain(self.held, &empty, self.model).value;
        let removed = removed(&before, &after, &floor);
        let gains = explained(self.fitted, self.held, self.model);
        let (mut causes, mut confusable) = (Vec::new(), Vec::new());
        for (k, gained) in gains.iter().enumerate() {
            let rivals = rivals([self.fitted, self.held], &self.searched.rule(self.forms, self.options), self.model, k);
            let unsure: Vec<&(usize, f64)> = rivals.iter().filter(|(_, p)| *p < TOLD_APART).collect();
            if !unsure.is_empty() {
                let words = unsure.iter().map(|(f, _)| self.forms[*f].words(&self.names()));
                let effects = std::iter::once(self.model.forms[k].words(&self.names())).chain(words).collect();
                let card = &self.model.forms[k].cause.card;
                let next = if unsure.iter().any(|(_, p)| *p == EITHER) { THE_SAME } else { card.next_experiment };
                confusable.push(Confusable { effects, next_experiment: next.to_owned(), predicted: vec![] });
            }
            let probability = rivals.iter().map(|(_, p)| *p).fold(1.0, f64::min);
            let share = (total > 0.0).then(|| (gained.value * removed / total).clamp(0.0, 1.0));
            causes.push(self.cause(k, probability, gained, share, &after));
        }
        // Of channels that are none that can be, or may not mean what they say, or a body that is none, a name proves nothing.
        let doubtful = self.mistaken.is_some() || !self.taken.is_as_it_is() || self.lost.is_some() || !self.suspicions.is_empty();
        let doubted = causes.iter_mut().enumerate().filter(|(k, _)| doubtful || !self.is_possible(*k));
        doubted.for_each(|(_, cause)| cause.believe_at_most(UNSURE));
        causes.sort_by(|a, b| b.gain.explained_fraction.unwrap_or(0.0).total_cmp(&a.gain.explained_fraction.unwrap_or(0.0)));
        let split = Split { estimation, held_out, windows_s: None };
        Diagnosis {
            split,
            verdict: self.verdict(unseen),
            baseline: Told { model: "the file's rigid bodies and frictions".to_owned(), parameters: self.file(), held_out: before },
            noise_floor: floor,
            discrepancy: self.discrepancy(&empty),
            extended: self.extended(after),
            considered: self.considered(&minor),
            minor: minor
                .into_iter()
                .map(|m| Minor { effect: m.form.cause.card.name.to_owned(), site: self.site(&m.form), removed: m.removed, why: m.why })
                .collect(),
            causes,
            confusable,
        }
    }

    pub fn joints(&self) -> usize {
        self.scene.joints.len()
    }

    pub fn names(&self) -> Vec<String> {
        self.scene.chain.joints().names.clone()
    }

    fn site(&self, form: &Form) -> Site {
        Site { side: form.cause.card.side.to_owned(), axis: form.joint.map(|j| self.names().swap_remove(j)).unwrap_or_default() }
    }

    /// How well a model predicts the logged torques, every sample of what was held out.
    pub fn score(&self, model: &Model) -> Score {
        let parts: Vec<(usize, std::ops::Range<usize>)> =
            self.held.pieces.iter().filter_map(|p| Some((p.trial, *p.places.first()?..*p.places.last()? + 1))).collect();
        let runs: Vec<Vec<Vec<f64>>> = parts.iter().map(|(trial, _)| predicted(self.held, model, *trial)).collect();
        let of = |j: usize| {
            let (mut error, mut logged) = (Vec::new(), Vec::new());
            for ((trial, range), run) in parts.iter().zip(&runs) {
                let Motion { torque, moves, .. } = &self.held.motions[*trial];
                for k in range.clone().filter(|k| moves[j][*k]) {
                    error.push(torque[j][k] - run[j][k]);
                    logged.push(torque[j][k]);
                }
            }
            let spread = deviation(&logged);
            let finite = |x: f64| x.is_finite().then_some(x);
            (finite(rms(&error) / spread), finite(100.0 * (1.0 - (deviation(&error) / spread).powi(2))))
        };
        let (nrmse, vaf_percent) = (0..self.joints()).map(of).unzip();
        Score { nrmse, vaf_percent }
    }

    fn cause(&self, k: usize, probability: f64, gains: &Sum, explained_fraction: Option<f64>, after: &Score) -> Cause {
        let form = &self.model.forms[k];
        let less = self.model.without(self.fitted, k);
        let (before, found) = (self.score(&less), gain(self.held, &less, self.model));
        let (gained, freedoms) = (self.fitted_gain(&less, self.model), form.columns.len() + form.beside());
        let rule = self.searched.rule(self.forms, self.options);
        Cause {
            effect: form.cause.card.name.to_owned(),
            site: self.site(form),
            parameters: self.parameters(k),
            probability,
            p_value: rule.p_value(form, gained, form.columns.len()),
            gain: Gain {
                log_likelihood: Some(gains.value).filter(|x| x.is_finite()),
                log_likelihood_ci95: Some(gains.ci95()).filter(|ci| ci.iter().all(|x| x.is_finite())),
                explained_fraction,
                ..Gain::of_runs([&before, after], gained - freedoms as f64 * (self.searched.table.samples as f64).ln())
            },
            evidence: self.evidence(k, &found),
            over_schedule: vec![],
            features: None,
            at_most: 1.0,
            lead: None,
        }
    }

    /// Twice the log-likelihood of what was fitted that a model gains over another.
    pub fn fitted_gain(&self, less: &Model, with: &Model) -> f64 {
        let sum = |model: &Model| 2.0 * losses(self.fitted, &residual(self.fitted, model)).iter().sum::<f64>();
        sum(less) - sum(with)
    }

    /// A unit as it is where a joint slides, for what is not of a body.
    pub fn unit<'u>(&self, form: &Form, unit: &'u str) -> &'u str {
        match form.joint {
            Some(j) if form.cause.card.side != "link" => self.unit_at(j, unit),
            _ => unit,
        }
    }

    pub fn unit_at<'u>(&self, joint: usize, unit: &'u str) -> &'u str {
        match unit {
            _ if !self.scene.chain.slides(joint) => unit,
            "N m" => "N",
            "N m/rad" => "N/m",
            "N m s/rad" => "N s/m",
            "rad" => "m",
            "rad/s" => "m/s",
            "kg m^2" => "kg",
            other => other,
        }
    }

    fn evidence(&self, k: usize, found: &Sum) -> Vec<String> {
        let form = &self.model.forms[k];
        let [low, high] = found.ci95();
        let less = form.told.iter().filter(|told| told.amount && !told.hidden && !told.inverse && told.sum(&self.model.factors[k]) < told.file);
        let less: Vec<&str> = less.map(|told| told.name.as_str()).filter(|_| of_a_simulator(self.fitted)).collect();
        let more = (!less.is_empty()).then(|| format!("the simulation has more of it than the robot: {}", less.join(", ")));
        let sentences = [
            format!("{}: {}", form.cause.card.what, form.cause.card.equation),
            format!("its torque is {:.1} % of the joint's where it is largest", 100.0 * share(self.held, self.model, k)),
            format!("the part that no fit saw gains {:.0} ({low:.0} … {high:.0}) of log-likelihood with it", found.value),
        ];
        sentences.into_iter().chain(more).chain(self.open(k)).chain(self.of_the_file(form)).collect()
    }

    /// Frictions, rotors and masses as the file has them.
    fn file(&self) -> Vec<ModelParameter> {
        let (joints, inertial) = (self.scene.chain.joints(), self.scene.chain.inertial_parameters());
        let springs: Vec<f64> = self.scene.chain.springs().iter().map(|[stiffness, _]| *stiffness).collect();
        let one = |name: String, unit: &str, value: f64| ModelParameter { name, unit: unit.to_owned(), value, std_error: None, flag: None };
        (0..self.joints())
            .flat_map(|j| {
                let (name, unit) = (&joints.names[j], |unit| self.unit_at(j, unit));
                [
                    one(format!("coulomb_{name}_nm"), unit("N m"), joints.coulomb[j]),
                    one(format!("viscous_{name}_nm_s_per_rad"), unit("N m s/rad"), joints.viscous[j]),
                    one(format!("rotor_{name}_kg_m2"), unit("kg m^2"), inertial[TERMS_OF_A_LINK * self.joints() + j]),
                    one(format!("mass_{name}_kg"), "kg", inertial[TERMS_OF_A_LINK * j]),
                ]
                .into_iter()
                .chain((springs[j] > 0.0).then(|| one(format!("spring_{name}_nm_per_rad"), unit("N m/rad"), springs[j])))
            })
            .collect()
    }

    fn extended(&self, held_out: Score) -> Extended {
        let mut parameters = self.file();
        let mut parameter_shift = Vec::new();
        for (k, form) in self.model.forms.iter().enumerate() {
            let Some(j) = form.joint else { continue };
            let name = &self.scene.chain.joints().names[j];
            let told = self.told(k);
            let (parameter, found) = match form.cause.card.name {
                "coulomb-friction" => (format!("coulomb_{name}_nm"), told.first()),
                "viscous-friction" => (format!("viscous_{name}_nm_s_per_rad"), told.first()),
                "motor-inertia" => (format!("rotor_{name}_kg_m2"), told.first()),
                "cable-force" => (format!("spring_{name}_nm_per_rad"), told.iter().find(|(name, ..)| name == "spring_nm_per_rad")),
                "link-parameters" => (format!("mass_{name}_kg"), told.iter().find(|(name, ..)| name == "change_of_mass_kg")),
                _ => continue,
            };
            let (Some((called, unit, value, error, _)), Some(own)) = (found, parameters.iter_mut().find(|p| p.name == parameter)) else { continue };
            let after = if form.cause.card.name == "link-parameters" { own.value + value } else { *value };
            // A simulator that is judged has its own, beside which it was found.
            let beside = form.told.iter().find(|told| told.name == *called).filter(|_| form.cause.card.name != "link-parameters");
            let before = beside.map_or(own.value, |told| told.file);
            parameter_shift.push(Shift { name: parameter, unit: self.unit(form, unit).to_owned(), before, after });
            (own.value, own.std_error) = (after, *error);
        }
        let residual_white = self.left.gains.iter().all(|g| g.ci95()[0] <= 0.0);
        let names: Vec<&str> = self.model.forms.iter().map(|f| f.cause.card.name).collect();
        let model = if names.is_empty() { "the file's rigid bodies and frictions".to_owned() } else { format!("the same with {}", names.join(", ")) };
        Extended { model, parameters, held_out, residual_white, parameter_shift }
    }

    /// Hypotheses of the first step that were not named, by what each would explain alone.
    fn considered(&self, minor: &[Aside]) -> Vec<Considered> {
        let table = &self.searched.table;
        let rule = self.searched.rule(self.forms, self.options);
        let mut best: Vec<(usize, f64, usize)> = Vec::new();
        let none = Solved::default();
        for (f, columns) in table.columns.iter().enumerate() {
            let (gained, freedoms) = none.gain(table, columns);
            let named = self.model.forms.iter().any(|m| m.same_place(&self.forms[f]));
            match best.iter_mut().find(|(g, ..)| self.forms[*g].same_place(&self.forms[f])) {
                Some(own) if own.1 < gained => *own = (f, gained, freedoms),
                Some(_) => {}
                None if !named => best.push((f, gained, freedoms)),
                None => {}
            }
        }
        best.sort_by(|a, b| b.1.total_cmp(&a.1));
        best.into_iter()
            .map(|(f, gained, freedoms)| {
                let p_value = rule.p_value(&self.forms[f], gained, freedoms);
                let aside = minor.iter().find(|m| m.form.same_place(&self.forms[f]));
                let why_not = match aside {
                    _ if p_value > self.options.false_alarms => "no more than chance",
                    Some(aside) => &aside.why,
                    None => "the named causes explain what it would, but for less than the tolerance or chance",
                };
                let explained_fraction = gained / table.total;
                Considered {
                    effect: self.forms[f].cause.card.name.to_owned(),
                    site: self.site(&self.forms[f]),
                    explained_fraction,
                    p_value,
                    why_not: why_not.to_owned(),
                }
            })
            .collect()
    }
}
