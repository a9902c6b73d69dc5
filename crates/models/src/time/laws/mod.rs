//! Force laws that extend a mechanism, one file each.

mod asymmetric_stiffness;
mod backlash;
mod bouc_wen;
mod coulomb;
mod cubic_stiffness;
mod dead_zone;
mod end_stop;
mod flexible_mode;
mod fractional;
mod latency;
mod lugre;
mod maxwell_slip;
mod reflex;
mod saturation;
mod short_range_stiffness;
mod soft_hold;
mod standard_linear_solid;
mod stiffness_drift;
mod stribeck;
mod vocabulary;

pub use asymmetric_stiffness::AsymmetricStiffness;
pub use backlash::Backlash;
pub use bouc_wen::BoucWen;
pub use coulomb::Coulomb;
pub use cubic_stiffness::CubicStiffness;
pub use dead_zone::DeadZone;
pub use end_stop::EndStop;
pub use flexible_mode::FlexibleMode;
pub use fractional::FractionalDamping;
pub(crate) use fractional::FractionalSum;
pub use latency::Latency;
pub use lugre::LuGre;
pub use maxwell_slip::MaxwellSlip;
pub use reflex::{LinearReflex, NO_MUSCLE_HZ, OneDirectionalReflex};
pub use saturation::Saturation;
pub use short_range_stiffness::ShortRangeStiffness;
pub use soft_hold::SoftHold;
pub use standard_linear_solid::Relaxation;
pub use stiffness_drift::StiffnessDrift;
pub use stribeck::Stribeck;

use super::Law;
use std::sync::Arc;

/// All force laws, each as it is by default.
pub fn all() -> Vec<Arc<dyn Law>> {
    vec![
        Arc::new(Relaxation),
        Arc::new(FractionalDamping),
        Arc::new(FlexibleMode),
        Arc::new(SoftHold),
        Arc::new(LinearReflex),
        Arc::new(OneDirectionalReflex { positive: true }),
        Arc::new(Latency),
        Arc::new(Coulomb { turn_velocity: 1e-3 }),
        Arc::new(Stribeck { turn_velocity: 1e-3 }),
        Arc::new(LuGre),
        Arc::new(BoucWen),
        Arc::new(MaxwellSlip),
        Arc::new(ShortRangeStiffness),
        Arc::new(CubicStiffness),
        Arc::new(AsymmetricStiffness),
        Arc::new(DeadZone),
        Arc::new(Backlash),
        Arc::new(EndStop { positive: true }),
        Arc::new(Saturation),
        Arc::new(StiffnessDrift),
    ]
}

/// The law of that name.
///
/// ```
/// assert!(ndof_models::time::laws::find("bouc-wen").is_some());
/// ```
pub fn find(name: &str) -> Option<Arc<dyn Law>> {
    all().into_iter().find(|law| law.name() == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::{Equation, LAW_VARIABLES, LOCAL_VARIABLES, Local};
    use num_complex::Complex64;

    fn at(x: [f64; 6]) -> Local<f64> {
        Local { time_s: 0.7, position: x[0], velocity: x[1], delayed_position: x[2], delayed_velocity: x[3], force: x[4], delayed_force: x[5] }
    }

    #[test]
    fn every_law_has_a_name_of_its_own_and_says_what_it_is() {
        let all = all();
        for (k, law) in all.iter().enumerate() {
            assert!(all[..k].iter().all(|other| other.name() != law.name()));
            assert!(law.equation().len() > 5 && law.source().len() > 10 && !law.parameters(true).is_empty());
            assert!(law.delay().is_none_or(|d| law.parameters(false)[d].unit == "s"));
            assert!(law.name() == "fractional" || LOCAL_VARIABLES + law.states() + law.parameters(false).len() <= LAW_VARIABLES, "{}", law.name());
        }
    }

    /// An integrator takes its step from this bound: no eigenvalue of ∂g/∂z is larger, and the largest no smaller than half of it.
    #[test]
    fn hidden_states_move_as_fast_as_their_law_says() {
        fn largest_and_bound<E: Equation>(law: &E) -> [f64; 2] {
            let theta: Vec<f64> = Equation::parameters(law, false).iter().map(|p| p.starts[p.starts.len() - 1]).collect();
            let (nz, columns) = (E::STATES, LOCAL_VARIABLES + E::STATES + theta.len());
            let (local, mut rates, mut slopes) = (at([0.0123, 0.21, 0.004, 0.13, 5.3, 4.0]), vec![0.0; nz], vec![0.0; (1 + nz) * columns]);
            law.linearise(&theta, &local, &vec![2e-3; nz], &mut rates, &mut slopes);
            let slope = |r: usize, c: usize| slopes[(1 + r) * columns + LOCAL_VARIABLES + c];
            let (half, determinant) =
                if nz == 1 { (0.5 * slope(0, 0), 0.0) } else { (0.5 * (slope(0, 0) + slope(1, 1)), slope(0, 0) * slope(1, 1) - slope(0, 1) * slope(1, 0)) };
            let root = Complex64::from(half * half - determinant).sqrt();
            [(half + root).norm().max((half - root).norm()), law.fastest_rate(&theta, &local)]
        }
        let reflex = OneDirectionalReflex { positive: true };
        let all = [largest_and_bound(&Relaxation), largest_and_bound(&FlexibleMode), largest_and_bound(&LinearReflex), largest_and_bound(&reflex)];
        for [largest, bound] in all.into_iter().chain([largest_and_bound(&BoucWen), largest_and_bound(&LuGre), largest_and_bound(&SoftHold)]) {
            assert!(largest > 0.0 && ((1.0 - 1e-12) * largest..=(2.0 + 1e-12) * largest).contains(&bound), "{largest} {bound}");
        }
    }
}
