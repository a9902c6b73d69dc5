//! Logs that may not mean what they say: a torque with its sign turned round, an angle in degrees.

use crate::logged::Logged;
use crate::mistaken::on_a_slope;
use crate::scene::Scene;
use crate::table::View;
use ndof_devices::Robot;

/// Correlation below which a torque goes against what the bodies of the file need: turned round, two thirds of the error's power are gone, (1 + ρ)/(1 − ρ) being left
/// of torques of one size.
const AGAINST: f64 = -0.5;
/// Times the way that the file allows beyond which an angle is hardly in radians: more than no excess, and less than the 57 of a degree.
const TOO_FAR: f64 = 10.0;

/// In words, for each joint whose channels are suspect.
pub(crate) fn suspicions(scene: &Scene<'_>, view: &View<'_>, logged: &Logged) -> Vec<String> {
    let together = together(scene, view, &logged.tilt);
    let names = &scene.chain.joints().names;
    let mut out = Vec::new();
    for (j, (name, allowed)) in names.iter().zip(scene.chain.ranges()).enumerate() {
        let [low, high] = scene.joints[j].range;
        let (way, most) = (high - low, allowed[1] - allowed[0]);
        if most.is_finite() && way > TOO_FAR * most {
            out.push(format!(
                "the angle of {name} goes from {low:.1} to {high:.1} where the file allows {:.2} to {:.2}: in {}; no number of this answer is to be used before",
                allowed[0],
                allowed[1],
                if scene.chain.slides(j) { format!("mm? Name its units, as in angle_{name} [mm] and torque_{name} [N]") } else { format!("degrees? Name its unit, as in angle_{name} [deg]") }
            ));
        }
        // One that is found to be turned round is taken so.
        let together = together[j];
        if together < AGAINST && logged.gain_of(j) > 0.0 {
            out.push(format!(
                "the torque of {name} goes against what the file's bodies need (correlation {together:.2}): its sign, or the joint's axis in the file, may be turned round; no number of a link is to be used before that is settled"
            ));
        }
    }
    out
}

/// For each joint, whether its torque goes against what the file's bodies need.
pub(crate) fn against(scene: &Scene<'_>, view: &View<'_>) -> Vec<bool> {
    together(scene, view, &[0.0; 3]).into_iter().map(|together| together < AGAINST).collect()
}

/// Whether a gain, above one or below it in all joints, makes most of what each of them misses: one gain of all torques is asked for.
pub(crate) fn one_gain(scene: &Scene<'_>, view: &View<'_>) -> bool {
    let mut sums = vec![[0.0; 3]; scene.joints.len()];
    for motion in view.motions {
        for ((sums, torque), needed) in sums.iter_mut().zip(&motion.torque).zip(scene.nominal(motion)) {
            for (t, n) in torque.iter().zip(needed) {
                let missed = t - n;
                [missed * missed, missed * n, n * n].iter().zip(sums.iter_mut()).for_each(|(x, sum)| *sum += x);
            }
        }
    }
    let most = |[missed, both, needed]: &[f64; 3]| both * both > 0.5 * missed * needed;
    // A joint that is not driven says nothing of it.
    let sums: Vec<[f64; 3]> = sums.into_iter().zip(&scene.joints).filter(|(_, joint)| joint.constant.is_none()).map(|(sum, _)| sum).collect();
    !sums.is_empty() && sums.iter().all(most) && (sums.iter().all(|sum| sum[1] > 0.0) || sums.iter().all(|sum| sum[1] < 0.0))
}

/// The correlation of each joint's torque with what the file's bodies need on a base that is tilted.
fn together(scene: &Scene<'_>, view: &View<'_>, tilt: &[f64; 3]) -> Vec<f64> {
    let nominal: Vec<Vec<Vec<f64>>> = view.motions.iter().map(|motion| on_a_slope(scene, motion, tilt)).collect();
    let of = |j: usize| {
        let pairs = view.motions.iter().zip(&nominal).flat_map(|(motion, nominal)| motion.torque[j].iter().copied().zip(nominal[j].iter().copied()));
        correlation(pairs.collect())
    };
    (0..scene.joints.len()).map(of).collect()
}

fn correlation(pairs: Vec<(f64, f64)>) -> f64 {
    let n = pairs.len() as f64;
    let (mean_a, mean_b) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let sum = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(a, b)| f(a - mean_a, b - mean_b)).sum::<f64>();
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}
