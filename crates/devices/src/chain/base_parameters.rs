//! The combinations of inertial parameters that motion and torque determine.

use super::regressor::TERMS_OF_A_LINK;
use super::serial::SerialChain;
use ndarray::Array2;
use ndof_linear::independent_columns;
use ndof_models::robot::Robot;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Share of a column beyond those before it that counts as its own: far above round-off, far below what any geometry makes.
const OWN: f64 = 1e-8;
/// Random states a parameter.
const STATES: usize = 3;

/// One determined combination of inertial parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseParameter {
    /// The combination in words: `inertia_zz_1_kg_m2 + 0.16 mass_2_kg`.
    pub name: String,
    /// Its column of the regressor: that of the first parameter in it.
    pub column: usize,
    /// All parameters in it, by their index in [`SerialChain::inertial_parameters`], and their factors; the first factor is 1.
    pub parts: Vec<(usize, f64)>,
}

impl BaseParameter {
    /// Its value for inertial parameters π.
    pub fn value(&self, inertial: &[f64]) -> f64 {
        self.parts.iter().map(|(k, factor)| factor * inertial[*k]).sum()
    }
}

/// The base parameters of a chain: the smallest set of combinations β of its inertial parameters π with Y π = Y_β β at every state, Y_β
/// being the columns of the regressor that [`BaseParameter::column`] names.
///
/// A parameter is kept where its column at random states is no combination of the columns before it; a column that is one adds its parameter
/// to theirs. What moves no joint and carries no weight is in none.
///
/// M. Gautier, Numerical calculation of the base inertial parameters of robots, J. Robot. Syst. 8 (1991) 485.
pub fn base_parameters(chain: &SerialChain) -> Vec<BaseParameter> {
    let n = chain.joints().count();
    let columns = (TERMS_OF_A_LINK + 1) * n;
    let states = STATES * (TERMS_OF_A_LINK + 1);
    let mut stacked = Array2::zeros((states * n, columns));
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut draw = |size: f64| (0..n).map(|_| size * rng.random_range(-1.0..1.0)).collect::<Vec<f64>>();
    for k in 0..states {
        let regressor = chain.regressor(&draw(std::f64::consts::PI), &draw(3.0), &draw(10.0));
        regressor.indexed_iter().for_each(|((j, c), v)| stacked[[k * n + j, c]] = *v);
    }
    let (kept, shares) = independent_columns(&stacked, OWN);
    let names = names(chain);
    kept.iter()
        .enumerate()
        .map(|(row, &column)| {
            let others = (0..columns).filter(|c| *c != column).map(|c| (c, shares[[row, c]])).filter(|(_, share)| share.abs() > OWN);
            let parts: Vec<(usize, f64)> = std::iter::once((column, 1.0)).chain(others).collect();
            let word = |&(k, factor): &(usize, f64)| match factor {
                1.0 => names[k].clone(),
                factor => format!("{} {}", rounded(factor), names[k]),
            };
            BaseParameter { name: parts.iter().map(word).collect::<Vec<_>>().join(" + "), column, parts }
        })
        .collect()
}

/// Six digits, without the round-off of a decomposition.
fn rounded(factor: f64) -> f64 {
    format!("{factor:.5e}").parse().unwrap_or(factor)
}

/// What the inertial parameters are called.
fn names(chain: &SerialChain) -> Vec<String> {
    let joints = &chain.joints().names;
    let of_body = ["mass_J_kg", "moment_x_J_kg_m", "moment_y_J_kg_m", "moment_z_J_kg_m"].into_iter().map(str::to_owned);
    let patterns: Vec<String> = of_body.chain(["xx", "xy", "yy", "xz", "yz", "zz"].map(|e| format!("inertia_{e}_J_kg_m2"))).collect();
    let bodies = joints.iter().flat_map(|name| patterns.iter().map(move |p| p.replace("_J_", &format!("_{name}_"))));
    bodies.chain(chain.joints().names.iter().map(|name| format!("rotor_{name}_kg_m2"))).collect()
}
