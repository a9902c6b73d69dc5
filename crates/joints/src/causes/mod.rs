//! What a robot's simulation may lack, one file each: a card in words, and the forms in which a search tries it.

mod angle_offset;
mod backlash;
mod base_tilt;
mod cable_force;
mod coulomb_friction;
mod end_stop;
mod gear_hysteresis;
mod joint_flexibility;
pub(crate) mod link_parameters;
mod load_friction;
mod motor_inertia;
pub(crate) mod payload;
mod spring_rest;
mod torque_delay;
mod torque_offset;
mod torque_scale;
mod viscous_friction;

use crate::column::Column;
use crate::deflection::{Gear, Lets};
use crate::scene::Scene;
use std::f64::consts::TAU;

/// A cause in words.
#[derive(Debug, PartialEq)]
pub struct Card {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// The torque that it needs, as an equation.
    pub equation: &'static str,
    /// On which side it acts: `joint`, `link`, `sensor` or `environment`.
    pub side: &'static str,
    /// Causes that show in nearly the same way.
    pub look_alikes: &'static [&'static str],
    /// The movement that tells them apart.
    pub next_experiment: &'static str,
}

/// A cause that a search tries.
pub struct JointCause {
    /// Its words.
    pub card: Card,
    pub(crate) forms: fn(&Scene<'_>) -> Vec<Form>,
}

/// All causes that are searched, joint by joint.
pub static CAUSES: &[&JointCause] = &[
    &viscous_friction::CAUSE,
    &coulomb_friction::CAUSE,
    &load_friction::CAUSE,
    &gear_hysteresis::CAUSE,
    &motor_inertia::CAUSE,
    &joint_flexibility::CAUSE,
    &backlash::CAUSE,
    &end_stop::CAUSE,
    &cable_force::CAUSE,
    &spring_rest::CAUSE,
    &angle_offset::CAUSE,
    &torque_offset::CAUSE,
    &torque_scale::CAUSE,
    &torque_delay::CAUSE,
    &link_parameters::CAUSE,
    &payload::CAUSE,
    &base_tilt::CAUSE,
];

/// One way in which a cause may act: torques with a factor each.
#[derive(Clone)]
pub(crate) struct Form {
    pub cause: &'static JointCause,
    pub joint: Option<usize>,
    pub columns: Vec<Column>,
    /// The parameters, as combinations of the factors.
    pub told: Vec<Told>,
    /// Parameters that the columns hold.
    pub shape: Vec<Shape>,
    /// The columns at other values of these.
    pub reshape: fn(&Form, &[f64]) -> Vec<Column>,
}

/// How many times the factor that a column is made with the data may ask for: beyond it is the neighbour that a search has.
const NEAR: f64 = 3.0;

/// A parameter that the columns hold.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    pub name: &'static str,
    pub unit: &'static str,
    pub value: f64,
    pub bounds: [f64; 2],
}

/// A parameter that follows from the factors.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Told {
    pub name: String,
    pub unit: &'static str,
    /// What the file says, to which the found is added.
    pub file: f64,
    /// Factors and their weights.
    pub parts: Vec<(usize, f64)>,
    /// The sum that it is over, where it is a ratio: its constant, factors and weights.
    pub over: Option<(f64, Vec<(usize, f64)>)>,
    /// Whether it is the inverse of this sum.
    pub inverse: bool,
    /// It lies between these.
    pub within: [f64; 2],
    /// Whether it follows from others and is not told.
    pub hidden: bool,
    /// Whether it is an amount, of which nothing has less than none.
    pub amount: bool,
}

impl Told {
    pub fn new(name: impl Into<String>, unit: &'static str, factor: usize) -> Self {
        Told {
            name: name.into(),
            unit,
            file: 0.0,
            parts: vec![(factor, 1.0)],
            over: None,
            inverse: false,
            within: [f64::NEG_INFINITY, f64::INFINITY],
            hidden: false,
            amount: false,
        }
    }

    pub fn positive(self) -> Self {
        Told { amount: true, ..self.within([0.0, f64::INFINITY]) }
    }

    pub fn within(self, within: [f64; 2]) -> Self {
        Told { within, ..self }
    }

    /// At its least only where the file has more: what the file does not have either is none.
    fn lies_within(&self, sum: f64) -> bool {
        (self.within[0] < sum || self.within[0] == sum && self.file > sum) && sum < self.within[1]
    }

    pub fn on_top_of(self, file: f64) -> Self {
        Told { file, ..self }
    }

    /// The sum of what the file says and what was found, before it is inverted.
    pub fn sum(&self, factors: &[f64]) -> f64 {
        let sum = |file: f64, parts: &[(usize, f64)]| file + parts.iter().map(|(k, w)| w * factors[*k]).sum::<f64>();
        sum(self.file, &self.parts) / self.over.as_ref().map_or(1.0, |(file, parts)| sum(*file, parts))
    }

    /// How that changes with each factor.
    pub fn slopes(&self, factors: &[f64]) -> Vec<(usize, f64)> {
        let Some((file, parts)) = &self.over else { return self.parts.clone() };
        let (over, ratio) = (file + parts.iter().map(|(k, w)| w * factors[*k]).sum::<f64>(), self.sum(factors));
        self.parts.iter().map(|(k, w)| (*k, w / over)).chain(parts.iter().map(|(k, w)| (*k, -ratio * w / over))).collect()
    }
}

impl Form {
    pub fn new(cause: &'static JointCause, joint: Option<usize>, columns: Vec<Column>, told: Vec<Told>) -> Self {
        Form { cause, joint, columns, told, shape: Vec::new(), reshape: |form, _| form.columns.clone() }
    }

    /// With parameters that the columns hold.
    pub fn shaped(self, shape: Vec<Shape>, reshape: fn(&Form, &[f64]) -> Vec<Column>) -> Self {
        let values: Vec<f64> = shape.iter().map(|s| s.value).collect();
        let mut form = Form { shape, reshape, ..self };
        form.columns = reshape(&form, &values);
        form
    }

    /// Forms of its kind with a parameter that the columns hold, at so many values within bounds, each the same multiple of the one before.
    pub fn over(
        self,
        (name, unit): (&'static str, &'static str),
        bounds: [f64; 2],
        count: usize,
        reshape: fn(&Form, &[f64]) -> Vec<Column>,
    ) -> impl Iterator<Item = Form> {
        let shape = move |value: f64| vec![Shape { name, unit, value, bounds }];
        geometric(bounds[0], bounds[1], count).into_iter().map(move |value| self.clone().shaped(shape(value), reshape))
    }

    /// The gear that gives in it.
    pub fn gear(&self) -> Option<&Gear> {
        if let Some(Column::Gear(gear)) = self.columns.first() { Some(gear) } else { None }
    }

    /// How many numbers are fitted beside its factors.
    pub fn beside(&self) -> usize {
        self.shape.len() + self.columns.iter().map(Column::beside).sum::<usize>()
    }

    /// Whether factors are those of something that exists.
    pub fn allows(&self, factors: &[f64]) -> bool {
        let near = |(column, factor): (&Column, &f64)| column.factor().is_none_or(|own| (1.0 / NEAR..NEAR).contains(&(factor / own)));
        self.told.iter().all(|t| t.lies_within(t.sum(factors))) && self.columns.iter().zip(factors).all(near)
    }

    /// The factor at which the robot has none of what the file has, where one factor is all that there is and asks for less than none.
    pub fn least(&self, factors: &[f64]) -> Option<f64> {
        let ([_], [Told { file, parts, over: None, inverse: false, within: [least, _], .. }]) = (&self.columns[..], &self.told[..]) else { return None };
        (parts[..] == [(0, 1.0)] && file > least && file + factors[0] <= *least && self.columns[0].factor().is_none()).then_some(least - file)
    }

    /// A gain may be below zero where a torque goes against what the file's bodies need, joint by joint; that of all torques where all do.
    pub fn turned_round(&mut self, against: &[bool]) {
        let turned = match self.columns[..] {
            [Column::Torque(joint)] => against[joint],
            [Column::Torques] => against.iter().all(|against| *against),
            _ => false,
        };
        if turned {
            self.told.iter_mut().for_each(|told| told.within[0] = f64::NEG_INFINITY);
        }
    }

    /// Without the bounds of what exists: a simulator may have more of it than the robot, which is so much less.
    pub fn either_way(&mut self) {
        if self.gear().is_none() {
            let amounts = self.told.iter_mut().filter(|told| told.amount && !told.hidden && !told.inverse);
            amounts.for_each(|told| told.within[0] = f64::NEG_INFINITY);
        }
    }

    /// "coulomb-friction at elbow".
    pub fn words(&self, joints: &[String]) -> String {
        self.joint.map_or_else(|| self.cause.card.name.to_owned(), |j| format!("{} at {}", self.cause.card.name, joints[j]))
    }

    /// Whether two forms are of one cause at one place.
    pub fn same_place(&self, other: &Form) -> bool {
        std::ptr::eq(self.cause, other.cause) && self.joint == other.joint
    }
}

/// How many times as fast as its joint moves a link swings on its gear, or falls through its play, where it is searched. A slower one would resonate with the
/// movement itself; at eight times it follows its load but for 1/8². Extents of neighbours are 2.6 or 4 times each other's.
const FASTER: [f64; 4] = [2.0, 3.2, 5.0, 8.0];

/// A gear in forms of several extents, each that of a rate in radians per second, and one that is a line; alone and with a rotor before it, without which a link's mass
/// would stand in for the rotor's.
fn gears(scene: &Scene<'_>, j: usize, cause: &'static JointCause, lets: Lets, extent: impl Fn(f64) -> f64, told: &Told) -> Vec<Form> {
    let rotor = Told::new("rotor_kg_m2", "kg m^2", 1).on_top_of(scene.joints[j].rotor).positive();
    let extents = FASTER.map(|times| extent(TAU * scene.joints[j].pace_hz * times));
    // The line is all of them where nothing is behind the joint, or nothing moves it.
    let extents = extents.into_iter().filter(|x| x.is_finite() && *x > 0.0).chain([0.0]);
    extents
        .map(|extent| Column::Gear(Gear::new(scene, j, lets, extent)))
        .flat_map(|gear| {
            let alone = Form::new(cause, Some(j), vec![gear.clone()], vec![told.clone()]);
            [alone, Form::new(cause, Some(j), vec![gear, Column::Acceleration(j)], vec![told.clone(), rotor.clone()])]
        })
        .collect()
}

/// `of` of each joint.
fn each_joint(scene: &Scene<'_>, of: impl Fn(usize) -> Vec<Form>) -> Vec<Form> {
    (0..scene.joints.len()).flat_map(of).collect()
}

/// So many values from one to another, each the same multiple of the one before.
fn geometric(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| from * (to / from).powf(k as f64 / (count - 1) as f64)).collect()
}
