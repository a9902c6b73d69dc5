//! The blocks by name, each with the place where it usually acts.

use super::{
    Block, Composite, Delay, FirstOrderFilter, FlexibleMode, Fractional, Place, Placed, Reflex, SecondOrderFilter, SeriesCompliance, StandardLinearSolid,
};
use crate::InertiaDampingStiffnessModel;

/// A block as `ndof list models` shows it and `ndof fit --model` asks for it.
pub struct BlockCard {
    /// The block.
    pub block: fn() -> Box<dyn Block>,
    /// Where it acts, on the axes given.
    pub place: fn(Vec<usize>) -> Place,
    /// One sentence.
    pub what: &'static str,
    /// What becomes of the baseline D(s).
    pub equation: &'static str,
    /// Who described it.
    pub source: &'static str,
}

/// All blocks.
pub const BLOCKS: &[BlockCard] = &[
    BlockCard {
        block: || Box::new(Delay),
        place: Place::EffortChannel,
        what: "the force channels are late by the same time, to a fraction of a sample",
        equation: "e^(-s delay) D(s)",
        source: "Pintelon & Schoukens 2012, System identification, ch. 9",
    },
    BlockCard {
        block: || Box::new(FirstOrderFilter),
        place: Place::EffortChannel,
        what: "the force channels went through a first-order low-pass that the motion did not see",
        equation: "D(s) / (1 + s/w), w = 2 pi cutoff",
        source: "Hogan et al.'s rehabilitation robots filter force by an RC element; Butterworth 1930",
    },
    BlockCard {
        block: || Box::new(SecondOrderFilter),
        place: Place::EffortChannel,
        what: "the same with a second-order Butterworth low-pass",
        equation: "D(s) w^2 / (s^2 + sqrt(2) w s + w^2), w = 2 pi cutoff",
        source: "Butterworth 1930, On the theory of filter amplifiers",
    },
    BlockCard {
        block: || Box::new(SeriesCompliance),
        place: Place::Series,
        what: "something between sensor and limb gives: a transducer, a trough, tissue",
        equation: "[D(s)^-1 + 1/(k + b s)]^-1",
        source: "Palazzolo et al. 2007, Stochastic estimation of arm mechanical impedance during robotic stroke rehabilitation",
    },
    BlockCard {
        block: || Box::new(FlexibleMode),
        place: Place::Parallel,
        what: "a mass on a spring and damper that each axis carries: a resonance that the baseline lacks",
        equation: "D(s) + m s^2 P / (s^2 + P), P = 2 zeta w s + w^2, w = 2 pi frequency",
        source: "Den Hartog 1934, Mechanical vibrations, ch. 3",
    },
    BlockCard {
        block: || Box::new(StandardLinearSolid),
        place: Place::Parallel,
        what: "relaxation: a Maxwell element beside the spring",
        equation: "D(s) + modulus time s / (1 + time s)",
        source: "Fung 1993, Biomechanics, ch. 2",
    },
    BlockCard {
        block: || Box::new(Fractional),
        place: Place::Parallel,
        what: "fractional damping, between a spring and a damper",
        equation: "D(s) + coefficient s^order",
        source: "Oustaloup et al. 2000, Frequency-band complex noninteger differentiator",
    },
    BlockCard {
        block: || Box::new(Reflex),
        place: Place::Parallel,
        what: "delayed feedback of position and velocity through critically damped muscle, the same on every axis",
        equation: "D(s) + (stiffness + damping s) e^(-s delay) (w / (s + w))^2, w = 2 pi cutoff",
        source: "Kearney, Stein & Parameswaran 1997, Identification of intrinsic and reflex contributions to human ankle stiffness dynamics",
    },
];

/// The card of that name.
pub fn find(name: &str) -> Option<&'static BlockCard> {
    BLOCKS.iter().find(|card| card.name() == name)
}

impl BlockCard {
    /// The block's name.
    pub fn name(&self) -> &'static str {
        (self.block)().name()
    }

    /// Whether it belongs to the sensors rather than to the limb.
    pub fn is_sensor(&self) -> bool {
        matches!((self.place)(Vec::new()), Place::EffortChannel(_) | Place::MotionChannel(_))
    }
}

impl Composite {
    /// A baseline with blocks of the registry, each on all axes.
    ///
    /// ```
    /// use ndof_models::blocks::{Composite, find};
    /// use ndof_models::{Axis, InertiaDampingStiffnessModel, ParametricModel, Symmetry};
    /// let baseline = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric);
    /// let model = Composite::of_cards(&baseline, &[find("reflex").unwrap(), find("delay").unwrap()]);
    /// assert_eq!(model.name(), "inertia-damping-stiffness+reflex+delay");
    /// ```
    pub fn of_cards(baseline: &InertiaDampingStiffnessModel, cards: &[&BlockCard]) -> Self {
        let axes: Vec<usize> = (0..crate::ParametricModel::axes(baseline).len()).collect();
        let placed = cards.iter().map(|card| Placed { block: (card.block)(), place: (card.place)(axes.clone()) }).collect();
        Composite::new(Box::new(baseline.clone()), placed)
    }
}
