//! A search without derivatives over many numbers of about one.

/// First step along each number.
const STEP: f64 = 0.3;

/// The least of `cost` that `rounds` over all numbers find from `x`, and where.
///
/// Each number has a step of its own, longer after a success and shorter after none in both directions; after a round the whole is
/// carried on along what the round has gained.
///
/// R. Hooke and T. A. Jeeves, "Direct search" solution of numerical and statistical problems, J. ACM 8 (1961) 212.
pub(super) fn climb(mut x: Vec<f64>, mut value: f64, rounds: usize, cost: impl Fn(&[f64]) -> f64) -> (Vec<f64>, f64) {
    let mut steps = vec![STEP; x.len()];
    for _ in 0..rounds {
        let before = x.clone();
        for i in 0..x.len() {
            let here = x[i];
            let better = [steps[i], -steps[i]].into_iter().find(|step| {
                x[i] = here + step;
                let found = cost(&x);
                let gained = found < value;
                value = if gained { found } else { value };
                gained
            });
            match better {
                // The next round begins in the direction that served.
                Some(step) => steps[i] = 1.5 * step,
                None => (x[i], steps[i]) = (here, 0.5 * steps[i]),
            }
        }
        let further: Vec<f64> = x.iter().zip(&before).map(|(x, before)| 2.0 * x - before).collect();
        let found = cost(&further);
        if found < value {
            (x, value) = (further, found);
        }
    }
    (x, value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bottom_of_a_slanted_bowl_is_found() {
        let bowl = |x: &[f64]| (x[0] - 0.7).powi(2) + 3.0 * (x[1] + x[0] - 0.2).powi(2) + (x[2] + 2.0).abs();
        let (x, value) = climb(vec![0.0; 3], bowl(&[0.0; 3]), 60, bowl);
        assert!(value < 1e-4 && (x[0] - 0.7).abs() < 0.02 && (x[2] + 2.0).abs() < 1e-3, "{x:?} {value}");
    }
}
