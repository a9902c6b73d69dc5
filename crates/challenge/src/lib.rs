//! Recordings with something hidden in them, made by an integrator, a controller and sensors of their own.
//!
//! Nothing here comes from the crates under test: laws, integrator (explicit midpoint at 4 kHz), discrete controller with
//! filtered velocity, interval-averaging sensors, noise and quantisation are written again. With `other` the effects take functional forms
//! that the registry does not have.

mod balance;
mod case;
mod clock;
pub mod exam;

mod hide;
mod laws;
mod motion;
mod plants;
mod record;
mod sensors;
mod stages;
pub mod strength;
mod true_model;

pub use case::{Case, Hidden, Made, Setting};
pub use clock::{FINE_HZ, FS, SUB};
pub use plants::Plant;
pub use true_model::TrueModel;

/// Makes a case. Plant, effects and noise are drawn from streams of their own, so that a case without its effect differs in nothing else.
pub fn make(case: &Case) -> Made {
    make_with(case, &Setting::default())
}

/// Makes a case that is recorded otherwise than usual.
pub fn make_with(case: &Case, setting: &Setting) -> Made {
    record::Scene::new(case, setting).play().0
}

/// Makes a case, and what the true model would predict of its held-out part.
pub fn make_with_truth(case: &Case, setting: &Setting) -> (Made, Option<TrueModel>) {
    let scene = record::Scene::new(case, setting);
    let (made, played) = scene.play();
    let truth = true_model::judged(&scene, &made, &played);
    (made, truth)
}
