//! The questions of each set.

use super::families::{AGAINST, Family, Kind, OTHER, OUTSIDE, On, PAIRS, REGISTRY, of_registry};
use crate::{Plant, Setting};
use ndof_signal::Quantity;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Which questions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// Some thirty, to see that all is in order.
    Quick,
    /// What a judge may be developed with.
    Tuning,
    /// The same families again, with seeds of its own and three times as many questions: whether a change to the judge is one for the better.
    Practice,
    /// Families that are held back, and new seeds of the registry's own forms.
    Final,
}

/// How strong a question's effect shall be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// It makes most of what a linear model leaves.
    Clear,
    /// It makes 5 to 20 % of that.
    Weak,
}

/// A question before its strength is set.
#[derive(Clone, Debug)]
pub struct Question {
    /// Its name: the set's word and a number.
    pub id: String,
    /// `single`, `other`, `pair`, `outside`, `null`, `background`, `against`, `robot` or `noise`.
    pub kind: &'static str,
    /// What is hidden, by the generator's names.
    pub hidden: Vec<&'static str>,
    /// The families of it, where it is of families.
    pub families: Vec<&'static Family>,
    /// How strong.
    pub aim: Aim,
    /// The experiment.
    pub plant: Plant,
    /// How it is recorded.
    pub setting: Setting,
    /// Number of trials.
    pub trials: usize,
    /// Length of each.
    pub duration_s: f64,
    /// Of everything that is drawn.
    pub seed: u64,
}

impl Set {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Set::Quick => "quick",
            Set::Tuning => "tuning",
            Set::Practice => "practice",
            Set::Final => "final",
        }
    }

    fn seed(self) -> u64 {
        match self {
            Set::Quick => 1013,
            Set::Tuning => 2101,
            Set::Practice => 36_007,
            Set::Final => 75_431,
        }
    }
}

/// All questions of a set.
pub fn paper(set: Set) -> Vec<Question> {
    let mut writer = Writer { set, rng: ChaCha8Rng::seed_from_u64(set.seed()), out: vec![] };
    let (single, weak, other, outside, pairs, nulls, several, background, against) = match set {
        Set::Quick => (0, 0, 0, 0, 0, 4, 0, 1, 0),
        Set::Tuning => (2, 1, 2, 3, 40, 48, 12, 20, 12),
        Set::Practice => (3, 5, 6, 4, 40, 240, 60, 30, 12),
        Set::Final => (2, 2, 2, 3, 50, 500, 30, 30, 12),
    };
    if set == Set::Quick {
        writer.quick();
    }
    for family in REGISTRY {
        writer.family(family, "single", single, weak);
    }
    for family in OTHER.iter().filter(|f| f.held_back == (set == Set::Final)) {
        writer.family(family, "other", other - other / 2, other / 2);
    }
    for family in OUTSIDE.iter().filter(|f| f.held_back == (set == Set::Final)) {
        writer.family(family, "outside", outside, 0);
    }
    let kinds: Vec<_> = PAIRS.iter().filter(|pair| pair.2 == (set == Set::Final)).collect();
    (0..pairs).for_each(|k| writer.pair(kinds[k % kinds.len()]));
    (0..nulls).for_each(|_| writer.nothing("null", &[(Plant::Force, 0.4), (Plant::Motion, 0.35), (Plant::Mass, 0.25)], 1));
    (0..several).for_each(|_| writer.nothing("null", On::Several.plants(), 3));
    (0..background).for_each(|_| writer.nothing("background", On::All.plants(), 3));
    (0..against).for_each(|k| writer.against(AGAINST[k % AGAINST.len()]));
    if set != Set::Quick {
        (0..6).for_each(|_| writer.plain("robot", "robot-friction", On::Several.plants()));
        (0..4).for_each(|_| writer.plain("noise", "limb-noise", On::Pushed.plants()));
        ["hysteresis", "coulomb-friction"].iter().for_each(|name| writer.six(name));
        // Of those whose intervals are asked about by themselves, and have few parameters.
        let more = if set == Set::Final { 5 } else { 2 };
        for family in ["hysteresis", "coulomb-friction", "measurement-delay"].into_iter().filter_map(of_registry) {
            writer.family(family, "single", more, more);
        }
    }
    writer.out
}

struct Writer {
    set: Set,
    rng: ChaCha8Rng,
    out: Vec<Question>,
}

impl Writer {
    fn drawn<T: Copy>(&mut self, list: &[(T, f64)]) -> T {
        let all: f64 = list.iter().map(|item| item.1).sum();
        let mut left = all * self.rng.random_range(0.0..1.0);
        for (item, weight) in list {
            left -= weight;
            if left < 0.0 {
                return *item;
            }
        }
        list[list.len() - 1].0
    }

    fn rate(&mut self, plant: Plant) -> f64 {
        match plant {
            Plant::Mass => self.drawn(&[(50.0, 1.0), (100.0, 2.0), (250.0, 2.0), (500.0, 2.0)]),
            Plant::Motion => self.drawn(&[(200.0, 2.0), (250.0, 2.0), (500.0, 3.0), (1000.0, 1.0)]),
            Plant::Six => 200.0,
            _ => self.drawn(&[(100.0, 1.0), (125.0, 2.0), (200.0, 2.0), (250.0, 2.0), (500.0, 4.0), (1000.0, 1.0)]),
        }
    }

    fn ask(&mut self, kind: &'static str, hidden: &[&'static str], families: Vec<&'static Family>, aim: Aim, plant: Plant, trials: usize) {
        let rate_hz = self.rate(plant);
        let long = rate_hz < 800.0;
        let seed = self.rng.random();
        let id = format!("{}-{:04}", self.set.word(), self.out.len());
        let bursts = families.iter().any(|f| matches!(f.name, "x-thixotropy" | "x-mullins" | "x-thermal-damping" | "x-latch" | "x-amplitude-delay"));
        let bursts = bursts || (plant != Plant::Motion && self.rng.random_range(0.0..1.0) < 0.15);
        let measured = self.measured(hidden, plant);
        // Of those that hide nothing most are so quiet that not even the limb's own force is there to be named.
        let own = if kind == "null" { self.drawn(&[(0.2, 1.0), (0.4, 2.0), (1.0, 1.0)]) } else { 1.0 };
        let setting = Setting { rate_hz, measured, own, bursts, quiet: false };
        let (trials, duration_s) = if long { (trials, self.drawn(&[(40.0, 1.0), (50.0, 2.0)])) } else { (1, 40.0) };
        self.out.push(Question { id, kind, hidden: hidden.to_vec(), families, aim, plant, setting, trials, duration_s, seed });
    }

    /// Velocity or acceleration in place of the displacement, where what is hidden shows in them as well.
    fn measured(&mut self, hidden: &[&'static str], plant: Plant) -> Quantity {
        let place = ["gap", "dead", "stop", "drift", "quant", "held", "stiffness"];
        let share: f64 = self.rng.random_range(0.0..1.0);
        let possible = matches!(plant, Plant::Force | Plant::Planar) && !hidden.iter().any(|name| place.iter().any(|part| name.contains(part)));
        match share {
            s if possible && s < 0.08 => Quantity::Velocity,
            s if possible && s < 0.12 => Quantity::Acceleration,
            _ => Quantity::Displacement,
        }
    }

    fn trials(&mut self) -> usize {
        self.drawn(&[(3, 0.55), (1, 0.45)])
    }

    fn family(&mut self, family: &'static Family, kind: &'static str, clear: usize, weak: usize) {
        for k in 0..clear + weak {
            let plant = self.drawn(family.on.plants());
            let trials = self.trials();
            // Steps are noise: there is no share of a residual that they would be weak by.
            self.ask(kind, &[family.name], vec![family], if k < clear || family.effect() == "quantisation" { Aim::Clear } else { Aim::Weak }, plant, trials);
        }
    }

    fn pair(&mut self, (first, second, _): &(&'static str, &'static str, bool)) {
        let plant = self.drawn(On::Sprung.plants());
        let trials = self.trials();
        let families = [*first, *second].iter().filter_map(|name| of_registry(name)).collect();
        self.ask("pair", &[*first, *second], families, Aim::Clear, plant, trials);
    }

    fn nothing(&mut self, kind: &'static str, plants: &[(Plant, f64)], most: usize) {
        let plant = self.drawn(plants);
        let trials = self.trials().min(most);
        self.ask(kind, &[], vec![], Aim::Clear, plant, trials);
    }

    fn against(&mut self, name: &'static str) {
        let plant = self.drawn(if name == "cross-coupling" { On::Several.plants() } else { On::Pushed.plants() });
        self.plain("against", name, &[(plant, 1.0)]);
        if let Some(last) = self.out.last_mut() {
            last.setting.measured = Quantity::Displacement;
        }
    }

    fn plain(&mut self, kind: &'static str, name: &'static str, plants: &[(Plant, f64)]) {
        let plant = self.drawn(plants);
        let trials = self.trials();
        self.ask(kind, &[name], vec![], Aim::Clear, plant, trials);
    }

    fn six(&mut self, name: &str) {
        if let Some(family) = of_registry(name) {
            self.ask("single", &[family.name], vec![family], Aim::Clear, Plant::Six, 1);
        }
    }

    /// One of each kind, on the cheapest plants.
    fn quick(&mut self) {
        for name in ["coulomb-friction", "hysteresis", "cubic-stiffness", "reflex-one", "viscoelastic", "measurement-delay"] {
            if let Some(family) = of_registry(name) {
                self.ask("single", &[family.name], vec![family], Aim::Clear, Plant::Force, 1);
            }
        }
        for (list, kind) in [(OTHER, "other"), (OUTSIDE, "outside")] {
            for family in list.iter().filter(|f| !f.held_back && f.kind != Kind::Registry).step_by(4) {
                self.ask(kind, &[family.name], vec![family], Aim::Clear, Plant::Force, 1);
            }
        }
        self.pair(&PAIRS[0]);
    }
}
