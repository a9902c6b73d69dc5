//! Inertial parameters of a body that masses can make, among those that no torque tells apart.

use crate::bodies::unit;
use ndarray::Array2;
use ndof_devices::{SerialChain, TERMS_OF_A_LINK};
use ndof_linear::{cholesky_in_place, cholesky_solve};
use ndof_models::robot::Robot;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Terms = [f64; TERMS_OF_A_LINK];

/// Random states: three equations or more for each parameter even where a body moves one joint only.
const STATES: usize = 3 * TERMS_OF_A_LINK;
/// Torque that a completed body may change, as a share of what it needs: far above round-off, far below any log's noise.
const UNSEEN: f64 = 1e-9;
/// Share of a number's torques that the others do not make, below which it is none of its own; as in the search.
const OWN: f64 = 1e-7;
/// Weight of the torques beside the distance from the file, both of size one: parameters that torques see by a thousandth settle in a step of the
/// multipliers, which make them exact; round-off of those that torques do not see stays far below one.
const WEIGHT: f64 = 1e6;
/// Steps of the multipliers.
const ROUNDS: usize = 40;
/// Steps of Newton's method on a self-concordant function of ten numbers.
const STEPS: usize = 60;

/// The body that moves as `found` does and that masses can make: `found` itself if it is one, else the one nearest to the file's `own`; `None` if
/// there is none.
///
/// A body exists where its pseudo-inertia P = [Σ, h; hᵀ, m], Σ = ½ tr(I) 1 − I, is positive definite. The nearest has the least
/// tr(P_own⁻¹ P) − log det P of all with Y π = Y π_found (T. Lee and F. C. Park, A geometric algorithm for robust multibody inertial parameter
/// identification, IEEE Robot. Autom. Lett. 3 (2018) 2455).
pub(crate) fn body(chain: &SerialChain, link: usize, own: &Terms, found: &Terms) -> Option<Terms> {
    if is_body(found) { Some(*found) } else { nearest(chain, link, own, found) }
}

/// Whether masses make it.
pub(crate) fn is_body(terms: &Terms) -> bool {
    factor(&pseudo_inertia(terms)).is_some()
}

/// Which of these numbers of a body no torque tells by themselves, in some motion with all others of them.
pub(crate) fn open(chain: &SerialChain, link: usize, own: &Terms, terms: &[usize]) -> [bool; TERMS_OF_A_LINK] {
    let seen = seen(chain, link, &units(own).unwrap_or([1.0; TERMS_OF_A_LINK]));
    let is_open = |k: usize| {
        let (mut left, mut others) = (seen.clone(), terms.iter().copied().filter(|other| *other != k).collect::<Vec<usize>>());
        while let Some(at) = (0..others.len()).max_by(|a, b| left[[others[*a], others[*a]]].total_cmp(&left[[others[*b], others[*b]]])) {
            let pivot = others.swap_remove(at);
            // Numbers of size one: beside what is left of others it is round-off.
            if left[[pivot, pivot]] <= UNSEEN {
                break;
            }
            let row: Vec<f64> = (0..TERMS_OF_A_LINK).map(|i| left[[pivot, i]]).collect();
            for i in 0..TERMS_OF_A_LINK {
                (0..TERMS_OF_A_LINK).for_each(|j| left[[i, j]] -= row[i] * row[j] / row[pivot]);
            }
        }
        terms.contains(&k) && left[[k, k]] <= UNSEEN.max(OWN * seen[[k, k]])
    };
    std::array::from_fn(is_open)
}

/// Which numbers of a body any torque feels at all.
pub(crate) fn felt(chain: &SerialChain, link: usize, own: &Terms) -> [bool; TERMS_OF_A_LINK] {
    let seen = seen(chain, link, &units(own).unwrap_or([1.0; TERMS_OF_A_LINK]));
    std::array::from_fn(|k| seen[[k, k]] > UNSEEN)
}

/// Sizes of a body's numbers: masses over the file's, lengths over its radius of gyration; `None` where it has none.
fn units(own: &Terms) -> Option<Terms> {
    let length = ((own[4] + own[6] + own[9]) / (2.0 * own[0])).sqrt();
    let unit: Terms = std::array::from_fn(|k| own[0] * length.powi([0, 1, 2][usize::from(k > 0) + usize::from(k > 3)]));
    (length.is_finite() && length > 0.0).then_some(unit)
}

/// The body nearest to the file's `own` of all that move as `found` does.
pub(crate) fn nearest(chain: &SerialChain, link: usize, own: &Terms, found: &Terms) -> Option<Terms> {
    let unit = units(own)?;
    let [own, goal] = [own, found].map(|x| -> Terms { std::array::from_fn(|k| x[k] / unit[k]) });
    let seen = seen(chain, link, &unit);
    let nearest = Nearest { start: inverse(&pseudo_inertia(&own))?, seen: &seen, goal };
    let (mut at, mut pull) = (own, [0.0; TERMS_OF_A_LINK]);
    for _ in 0..ROUNDS {
        at = nearest.newton(at, &pull)?;
        let off = nearest.off(&at);
        if off.iter().all(|x| x.abs() < UNSEEN) {
            return Some(std::array::from_fn(|k| at[k] * unit[k]));
        }
        pull.iter_mut().zip(off).for_each(|(p, o)| *p += o);
    }
    None
}

/// YᵀY of one body over random states, its largest entry one: what torques see of a change of its parameters.
fn seen(chain: &SerialChain, link: usize, unit: &Terms) -> Array2<f64> {
    let joints = chain.joints().count();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut out = Array2::<f64>::zeros((TERMS_OF_A_LINK, TERMS_OF_A_LINK));
    for _ in 0..STATES {
        let mut state = |size: f64| (0..joints).map(|_| size * (2.0 * random.random::<f64>() - 1.0)).collect::<Vec<f64>>();
        let (q, v, a) = (state(std::f64::consts::PI), state(3.0), state(10.0));
        let y = chain.regressor(&q, &v, &a);
        for row in y.rows() {
            let own: Terms = std::array::from_fn(|k| unit[k] * row[TERMS_OF_A_LINK * link + k]);
            for (i, x) in own.iter().enumerate() {
                own.iter().enumerate().for_each(|(j, y)| out[[i, j]] += x * y);
            }
        }
    }
    let largest = out.diag().iter().fold(f64::MIN_POSITIVE, |s, x| s.max(*x));
    out / largest
}

/// tr(P_own⁻¹ P) − log det P, and torques that stay.
struct Nearest<'a> {
    /// P_own⁻¹.
    start: [f64; 16],
    seen: &'a Array2<f64>,
    goal: Terms,
}

impl Nearest<'_> {
    /// What torques see of the distance from the goal.
    fn off(&self, at: &Terms) -> Terms {
        std::array::from_fn(|i| (0..TERMS_OF_A_LINK).map(|j| self.seen[[i, j]] * (at[j] - self.goal[j])).sum())
    }

    /// `None` where no masses make the body.
    fn value(&self, at: &Terms, pull: &Terms) -> Option<f64> {
        let p = pseudo_inertia(at);
        let lower = factor(&p)?;
        let spread: f64 = self.start.iter().zip(&p).map(|(a, b)| a * b).sum();
        let logarithm: f64 = (0..4).map(|k| 2.0 * lower[5 * k].ln()).sum();
        let away: f64 = self.off(at).iter().zip(at).zip(self.goal).zip(pull).map(|(((off, at), goal), pull)| (0.5 * off + pull) * (at - goal)).sum();
        Some(spread - logarithm + WEIGHT * away)
    }

    fn newton(&self, mut at: Terms, pull: &Terms) -> Option<Terms> {
        let parts: [[f64; 16]; TERMS_OF_A_LINK] = std::array::from_fn(|k| pseudo_inertia(&unit(k)));
        let mut value = self.value(&at, pull)?;
        for _ in 0..STEPS {
            let inverse = inverse(&pseudo_inertia(&at))?;
            let turned = parts.map(|part| product(&inverse, &part));
            let off = self.off(&at);
            let mut step: Vec<f64> = (0..TERMS_OF_A_LINK)
                .map(|k| {
                    let along: f64 = (0..16).map(|i| (inverse[i] - self.start[i]) * parts[k][i]).sum();
                    along - WEIGHT * (off[k] + pull[k])
                })
                .collect();
            let slope = step.clone();
            let mut curvature: Vec<f64> = (0..TERMS_OF_A_LINK * TERMS_OF_A_LINK)
                .map(|at| {
                    let (k, l) = (at / TERMS_OF_A_LINK, at % TERMS_OF_A_LINK);
                    let own: f64 = (0..16).map(|i| turned[k][i] * turned[l][4 * (i % 4) + i / 4]).sum();
                    own + WEIGHT * self.seen[[k, l]]
                })
                .collect();
            if !cholesky_in_place(&mut curvature, TERMS_OF_A_LINK) {
                return None;
            }
            cholesky_solve(&curvature, TERMS_OF_A_LINK, &mut step);
            let gain: f64 = slope.iter().zip(&step).map(|(a, b)| a * b).sum();
            let tried = |share: f64| -> Terms { std::array::from_fn(|k| at[k] + share * step[k]) };
            let better = (0..50).map(|halved| tried(0.5_f64.powi(halved))).find_map(|t| Some((t, self.value(&t, pull).filter(|v| *v < value)?)));
            let Some((next, less)) = better.filter(|_| gain > 1e-20) else { break };
            (at, value) = (next, less);
        }
        Some(at)
    }
}

/// [Σ, h; hᵀ, m] in rows.
fn pseudo_inertia(&[m, hx, hy, hz, xx, xy, yy, xz, yz, zz]: &Terms) -> [f64; 16] {
    let half = 0.5 * (xx + yy + zz);
    [half - xx, -xy, -xz, hx, -xy, half - yy, -yz, hy, -xz, -yz, half - zz, hz, hx, hy, hz, m]
}

/// Its lower Cholesky factor, if it is positive definite.
fn factor(p: &[f64; 16]) -> Option<[f64; 16]> {
    let mut lower = *p;
    cholesky_in_place(&mut lower, 4).then_some(lower)
}

fn inverse(p: &[f64; 16]) -> Option<[f64; 16]> {
    let lower = factor(p)?;
    let mut out = [0.0; 16];
    for k in 0..4 {
        out[5 * k] = 1.0;
        cholesky_solve(&lower, 4, &mut out[4 * k..4 * k + 4]);
    }
    Some(out)
}

fn product(a: &[f64; 16], b: &[f64; 16]) -> [f64; 16] {
    std::array::from_fn(|at| (0..4).map(|k| a[at / 4 * 4 + k] * b[4 * k + at % 4]).sum())
}

#[cfg(test)]
mod tests {
    use super::{Terms, body, factor, pseudo_inertia, seen};
    use ndof_devices::{RobotConfig, SerialChain, TERMS_OF_A_LINK};

    /// An arm in a plane, whose torques see of its last body the mass, two moments and one inertia.
    fn arm() -> (SerialChain, Terms) {
        let joint = "[[joints]]\naxis = [0.0, 1.0, 0.0]\norigin_m = [0.3, 0.0, 0.0]\nmass_kg = 2.0\ncentre_m = [0.1, 0.0, 0.01]\ninertia_kg_m2 = [0.002, 0.01, 0.01, 0.0, 0.0, 0.0]\n";
        let text = format!("schema = \"ndof/robot/1\"\nname = \"arm\"\n{joint}name = \"a\"\n{joint}name = \"b\"\n");
        let chain = RobotConfig::parse("arm.toml", &text, None).and_then(|r| r.chain()).expect("builds");
        let own = std::array::from_fn(|k| chain.inertial_parameters()[TERMS_OF_A_LINK + k]);
        (chain, own)
    }

    #[test]
    fn a_body_that_no_masses_make_becomes_one_that_no_torque_tells_from_it() {
        let (chain, own) = arm();
        assert_eq!(body(&chain, 1, &own, &own), Some(own));
        let mut found = own;
        // More about y than about x and z together.
        found[6] += 0.02;
        assert!(factor(&pseudo_inertia(&found)).is_none());
        let after = body(&chain, 1, &own, &found).expect("there is one");
        assert!(factor(&pseudo_inertia(&after)).is_some(), "{after:?}");
        let seen = seen(&chain, 1, &[1.0; TERMS_OF_A_LINK]);
        let change: Terms = std::array::from_fn(|k| after[k] - found[k]);
        let felt: f64 = (0..100).map(|at| change[at / 10] * seen[[at / 10, at % 10]] * change[at % 10]).sum();
        // A share of what the change that was found is seen by.
        assert!(felt.abs().sqrt() < 1e-6 * 0.02 * seen[[6, 6]].sqrt(), "{felt}, {change:?}");
    }

    #[test]
    fn what_no_body_moves_like_is_none() {
        let (chain, own) = arm();
        let mut found = own;
        // Less than nothing about the only axis.
        found[6] = -0.01;
        assert_eq!(body(&chain, 1, &own, &found), None);
    }
}
