//! An effect of one's own: damping that grows with the square of the speed, hidden in an arm and found again.
//!
//! cargo run --release --example add_an_effect

use ndof::devices::{DeviceConfig, Experiment, Extras, LimbConfig, simulate_trial};
use ndof::diagnose::{Diagnosis, Options, diagnose};
use ndof::models::effects::{Action, Card, Effect, EffectError, Form, Injection, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value};
use ndof::models::{ForceLaw, Motion};
use ndof::signal::{FilteredNoise, Recording};
use ndof::sysid::Ports;
use std::collections::BTreeMap;
use std::error::Error;

const COEFFICIENT: ParameterCard =
    ParameterCard { name: "coefficient", unit: "N s^2/m^2", rotational_unit: "N m s^2/rad^2", bounds: (0.0, 1e9), default: None };

const CARD: Card = Card {
    name: "quadratic-damping",
    what: "drag that grows with the square of the speed, as in a fluid",
    sides: &[Side::Limb],
    parameters: &[COEFFICIENT],
    signature: "apparent damping rises with the amplitude",
    look_alikes: &["coulomb-friction"],
    next_experiment: "the same perturbation at half the amplitude: drag halves the apparent extra damping, friction doubles it",
    equation: "f = c v |v|",
    source: "Batchelor 1967, An introduction to fluid dynamics",
    trace: Trace::Forms,
};

// ANCHOR: law
/// The force law: what the simulation integrates and the diagnosis computes along the measured motion.
struct Drag {
    axis: usize,
    coefficient: f64,
}

impl ForceLaw for Drag {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let v = motion.velocity[self.axis];
        force[self.axis] += self.coefficient * v * v.abs();
    }
}
// ANCHOR_END: law

// ANCHOR: effect
static QUADRATIC_DAMPING: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

/// How a simulation hides it.
fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let axis = setting.axis.ok_or(EffectError::Setting { effect: CARD.name, what: "an axis" })?;
    Ok(Injection::Force(Box::new(Drag { axis, coefficient: parameters.number(CARD.name, &COEFFICIENT)? })))
}

/// What a search tries: one regressor an axis, whose coefficient is positive.
fn forms(scale: &Scale) -> Vec<Form> {
    (0..scale.axes())
        .map(|axis| {
            Form::new("v |v|", Some(axis), Action::force(move |_, c| Drag { axis, coefficient: c[0] }))
                .coefficients(vec![Sign::Positive])
                .numbers(|_, c| [("coefficient", c[0])])
        })
        .collect()
}
// ANCHOR_END: effect

fn main() -> Result<(), Box<dyn Error>> {
    let trials = simulate(120.0)?;
    let ports = Ports { references: vec![0, 1], inputs: vec![2, 3], outputs: vec![4, 5] };
    let ask = |options: &Options| diagnose(&trials, &ports, options, None, &mut |_| {});
    tell("with the registry alone", &ask(&Options::default())?);
    tell("with the effect added", &ask(&Options { own: vec![&QUADRATIC_DAMPING], ..Options::default() })?);
    Ok(())
}

fn tell(heading: &str, d: &Diagnosis) {
    println!("{heading}: {:?}", d.verdict);
    for cause in &d.causes {
        println!("  {} at {}, probability {:.2}", cause.effect, cause.site.axis, cause.probability);
        cause.parameters.iter().for_each(|p| println!("    {} = {:.4?} {:.4?} {}", p.name, p.value, p.ci95, p.unit));
    }
}

/// Three trials of an arm held by MIT-MANUS, with drag on its y axis.
fn simulate(coefficient: f64) -> Result<Vec<Recording>, Box<dyn Error>> {
    let limb = LimbConfig::EndpointLinear(ndof::devices::EndpointLinearConfig {
        M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
        B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
        K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
        ..Default::default()
    });
    let experiment = Experiment { trials: 3, ..Experiment::new(DeviceConfig::named("mit-manus"), limb) };
    let (discarded, recorded) = experiment.samples();
    let noise = FilteredNoise { axes: 2, samples: discarded + recorded, rms: 4.0, ..FilteredNoise::default() };
    let setting = Setting { axes: 2, axis: Some(1), mass: vec![], stiffness: vec![], duration_s: 50.0, sample_rate_hz: 500.0, seed: 1 };
    (0..experiment.trials)
        .map(|trial| {
            let parameters = Parameters(BTreeMap::from([("coefficient".to_owned(), Value::Number(coefficient))]));
            let Injection::Force(law) = QUADRATIC_DAMPING.inject(&parameters, &setting)? else { return Err("a force".into()) };
            let extras = Extras { limb: vec![law], ..Extras::default() };
            Ok(simulate_trial(&experiment, &noise.generate(1 + trial as u64)?, &extras, trial)?)
        })
        .collect()
}
