//! Minimisation over one or a few bounded knobs.

use ndof_models::effects::Knob;
use ndof_models::golden;

fn to_unit(knob: &Knob, value: f64) -> f64 {
    if knob.log { (value / knob.lo).ln() / (knob.hi / knob.lo).ln() } else { (value - knob.lo) / (knob.hi - knob.lo) }
}

/// Share of a knob's range within which a value rests at its end.
const END: f64 = 0.01;

/// Whether a knob rests at a lower end that tells of something else.
pub(crate) fn tells(knobs: &[Knob], values: &[f64]) -> bool {
    knobs.iter().zip(values).any(|(knob, &value)| knob.telling && to_unit(knob, value) < END)
}

/// The inner side of the end of a knob's range that its value rests at, if it does.
pub(crate) fn inside_of(knob: &Knob, value: f64) -> Option<f64> {
    let at = to_unit(knob, value);
    if at < END { Some(from_unit(knob, 2.0 * END)) } else { (at > 1.0 - END).then(|| from_unit(knob, 1.0 - 2.0 * END)) }
}

fn from_unit(knob: &Knob, unit: f64) -> f64 {
    let u = unit.clamp(0.0, 1.0);
    if knob.log { knob.lo * (knob.hi / knob.lo).powf(u) } else { knob.lo + u * (knob.hi - knob.lo) }
}

/// The best knobs found from `start`: golden section between the grid's neighbours for one knob, Nelder-Mead for more.
pub(crate) fn minimise(knobs: &[Knob], grid: &[Vec<f64>], start: &[f64], value: f64, evaluations: usize, cost: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let at = |u: &[f64]| -> Vec<f64> { knobs.iter().zip(u).map(|(k, &u)| from_unit(k, u)).collect() };
    let u0: Vec<f64> = knobs.iter().zip(start).map(|(k, &v)| to_unit(k, v).clamp(0.0, 1.0)).collect();
    let best = if knobs.len() == 1 {
        let marks: Vec<f64> = grid.iter().map(|g| to_unit(&knobs[0], g[0])).collect();
        let below = marks.iter().copied().filter(|&m| m < u0[0] - 1e-9).fold(0.0, f64::max);
        let above = marks.iter().copied().filter(|&m| m > u0[0] + 1e-9).fold(1.0, f64::min);
        vec![golden((below, above), (u0[0], value), 2e-3, evaluations.min(14), |u| cost(&at(&[u])))]
    } else {
        nelder_mead(&u0, value, evaluations.max(10 + 14 * knobs.len()), |u| cost(&at(u)))
    };
    at(&best)
}

fn nelder_mead(start: &[f64], value: f64, evaluations: usize, cost: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let n = start.len();
    let inside = |u: Vec<f64>| -> Vec<f64> { u.into_iter().map(|v| v.clamp(0.0, 1.0)).collect() };
    let mut simplex = vec![(start.to_vec(), value)];
    let mut count = 0;
    for i in 0..n {
        let mut u = start.to_vec();
        u[i] += if u[i] < 0.85 { 0.12 } else { -0.12 };
        let f = cost(&u);
        count += 1;
        simplex.push((u, f));
    }
    while count < evaluations {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let spread = simplex[n].1 - simplex[0].1;
        let size = (0..n).map(|i| simplex.iter().map(|p| (p.0[i] - simplex[0].0[i]).abs()).fold(0.0, f64::max)).fold(0.0, f64::max);
        if spread.abs() < 0.05 || size < 1e-4 {
            break;
        }
        let centre: Vec<f64> = (0..n).map(|i| simplex[..n].iter().map(|p| p.0[i]).sum::<f64>() / n as f64).collect();
        let towards = |t: f64| inside((0..n).map(|i| centre[i] + t * (simplex[n].0[i] - centre[i])).collect());
        let mirrored = towards(-1.0);
        let f = cost(&mirrored);
        count += 1;
        if f < simplex[0].1 {
            let far = towards(-2.0);
            let ff = cost(&far);
            count += 1;
            simplex[n] = if ff < f { (far, ff) } else { (mirrored, f) };
        } else if f < simplex[n - 1].1 {
            simplex[n] = (mirrored, f);
        } else {
            let near = if f < simplex[n].1 { towards(-0.5) } else { towards(0.5) };
            let fnear = cost(&near);
            count += 1;
            if fnear < simplex[n].1.min(f) {
                simplex[n] = (near, fnear);
            } else {
                let lead = simplex[0].0.clone();
                for point in &mut simplex[1..] {
                    let u: Vec<f64> = (0..n).map(|i| 0.5 * (lead[i] + point.0[i])).collect();
                    let f = cost(&u);
                    count += 1;
                    *point = (u, f);
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
    simplex.swap_remove(0).0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_rests_at_an_end_within_a_hundredth_of_the_range() {
        let (linear, log) = (Knob::linear(-1.0, 1.0), Knob::log(1e-3, 1.0));
        assert_eq!([-0.97, 0.0, 0.97].map(|value| inside_of(&linear, value)), [None; 3]);
        assert!(inside_of(&linear, -1.0).is_some_and(|inside| inside > -0.99) && inside_of(&linear, 1.0).is_some_and(|inside| inside < 0.99));
        assert!(inside_of(&log, 1.02e-3).is_some() && inside_of(&log, 1.2e-3).is_none() && inside_of(&log, 0.99).is_some());
    }

    #[test]
    fn a_parabola_in_one_log_knob_and_a_bowl_in_two() {
        let log = Knob { lo: 1e-3, hi: 1.0, log: true, telling: false };
        let cost = |k: &[f64]| (k[0] / 0.02).ln().powi(2);
        let best = minimise(&[log], &[vec![0.01], vec![0.05]], &[0.01], cost(&[0.01]), 14, cost);
        assert!((best[0] / 0.02 - 1.0).abs() < 0.02, "{best:?}");
        let flat = Knob { lo: -1.0, hi: 1.0, log: false, telling: false };
        let bowl = |k: &[f64]| 1e3 * ((k[0] - 0.3).powi(2) + 2.0 * (k[1] + 0.2).powi(2));
        let best = minimise(&[flat, flat], &[], &[0.0, 0.0], bowl(&[0.0, 0.0]), 60, bowl);
        assert!((best[0] - 0.3).abs() < 0.02 && (best[1] + 0.2).abs() < 0.02, "{best:?}");
    }
}
