//! Effects drawn from a seed, for a study whose reader shall guess.

use crate::file::HiddenEffect;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// `count` different effects with strengths that an arm on a robot may have; the same seed draws the same ones.
///
/// Limb effects sit on one of `axes`, sensor effects on all effort channels.
pub fn draw_hidden(count: usize, seed: u64, axes: &[String]) -> Vec<HiddenEffect> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(6);
    let mut open: Vec<usize> = (0..6).collect();
    let mut drawn = Vec::new();
    while drawn.len() < count.min(6) {
        let which = open.swap_remove(rng.random_range(0..open.len()));
        let axis = axes.get(rng.random_range(0..axes.len().max(1))).cloned();
        let mut between = |lo: f64, hi: f64| rng.random_range(lo..hi);
        let (name, parameters): (&str, Vec<(&str, f64)>) = match which {
            0 => ("coulomb-friction", vec![("level_n", between(0.4, 1.0))]),
            1 => ("hysteresis", vec![("stiffness_n_per_m", between(150.0, 350.0)), ("yield_m", between(0.002, 0.004))]),
            2 => ("cubic-stiffness", vec![("k3_n_per_m3", between(1.5e6, 4e6))]),
            3 => (
                "reflex-delay",
                vec![
                    ("delay_s", between(0.03, 0.06)),
                    ("stiffness_n_per_m", between(80.0, 200.0)),
                    ("damping_n_s_per_m", between(3.0, 8.0)),
                    ("cutoff_hz", between(2.0, 4.0)),
                ],
            ),
            4 => ("measurement-delay", vec![("delay_s", between(0.004, 0.01))]),
            _ => ("stiffness-drift", vec![("fraction_per_s", between(0.005, 0.012))]),
        };
        let sensor = which == 4;
        drawn.push(HiddenEffect {
            name: name.to_owned(),
            side: if sensor { "sensor" } else { "limb" }.to_owned(),
            axis: axis.filter(|_| !sensor),
            parameters: parameters.into_iter().map(|(name, value)| (name.to_owned(), toml::Value::Float(value))).collect(),
        });
    }
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_seed_draws_different_effects_always_the_same_ones_and_in_the_end_all() {
        let axes = ["x".to_owned(), "y".to_owned()];
        let mut seen = BTreeSet::new();
        for seed in 0..50 {
            let drawn = draw_hidden(3, seed, &axes);
            let again = draw_hidden(3, seed, &axes);
            let names: BTreeSet<&str> = drawn.iter().map(|hidden| hidden.name.as_str()).collect();
            assert_eq!(names.len(), 3);
            for (a, b) in drawn.iter().zip(&again) {
                assert_eq!((&a.name, &a.axis, &a.parameters), (&b.name, &b.axis, &b.parameters));
                assert_eq!(a.axis.is_none(), a.side == "sensor");
                let card = ndof_models::effects::find(&a.name).expect("in the registry").card;
                assert!(a.parameters.keys().all(|name| card.parameters.iter().any(|p| p.name == name)), "{:?}", a.parameters);
            }
            seen.extend(drawn.into_iter().map(|hidden| hidden.name));
        }
        assert_eq!(seen.len(), 6);
        assert_eq!(draw_hidden(9, 1, &axes).len(), 6);
    }
}
