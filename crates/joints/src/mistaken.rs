//! Channels that are not what they are called: two that changed places, a joint whose axis is turned round.

use crate::bodies::turned;
use crate::column::Column;
use crate::dynamics::inverse_dynamics;
use crate::motion::Motion;
use crate::scene::Scene;
use ndof_signal::deviation;

/// What may have happened to the channels of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mistaken {
    /// The torques of two joints changed places.
    Torques([usize; 2]),
    /// The angles of two joints did.
    Angles([usize; 2]),
    /// Both did: the joints are called by each other's names.
    Joints([usize; 2]),
    /// The angle of a joint counts the other way.
    Angle(usize),
    /// Angle and torque do.
    Joint(usize),
}

/// Share of the error that is left, at most, of channels that are put right: as of a torque that is turned round, two thirds are gone.
pub(crate) const LEFT: f64 = 1.0 / 3.0;

impl Mistaken {
    /// In words, with what to do; `torques` and `angles` are the channels of the joints.
    pub fn words(self, joints: &[String], torques: &[&str], angles: &[&str]) -> String {
        let swapped = |channels: &[&str], [a, b]: [usize; 2]| format!("{0}={1},{1}={0}", channels[a], channels[b]);
        let changed = |what: &str, [a, b]: [usize; 2]| format!("the {what} channels of {} and {} are as if they had changed places", joints[a], joints[b]);
        let (what, remedy) = match self {
            Mistaken::Torques(pair) => (changed("torque", pair), format!("--channels {}", swapped(torques, pair))),
            Mistaken::Angles(pair) => (changed("angle", pair), format!("--channels {}", swapped(angles, pair))),
            Mistaken::Joints(pair) => (
                format!("{} and {} are as if each were called by the other's name", joints[pair[0]], joints[pair[1]]),
                format!("--channels {},{}", swapped(torques, pair), swapped(angles, pair)),
            ),
            Mistaken::Angle(j) => (format!("the angle of {} is as if it counted the other way", joints[j]), format!("--negate {}", angles[j])),
            Mistaken::Joint(j) => (
                format!("the angle and the torque of {} are as if the joint's axis were turned round", joints[j]),
                format!("--negate {},{}, or turn its axis in the file", angles[j], torques[j]),
            ),
        };
        format!(
            "{what}: so read, two thirds or more of what the file's robot misses are gone; try it with {remedy}; no number of this answer is to be used before that is settled"
        )
    }

    /// The logs as they would be if this had not happened.
    fn undone(self, motion: &Motion) -> Motion {
        let mut out = motion.clone();
        let back = |series: &mut Vec<f64>| series.iter_mut().for_each(|x| *x = -*x);
        if let Mistaken::Torques([a, b]) | Mistaken::Joints([a, b]) = self {
            out.torque.swap(a, b);
        }
        if let Mistaken::Angles([a, b]) | Mistaken::Joints([a, b]) = self {
            out.of_joints().into_iter().for_each(|series| series.swap(a, b));
        }
        if let Mistaken::Angle(j) | Mistaken::Joint(j) = self {
            out.of_joints().into_iter().for_each(|series| back(&mut series[j]));
        }
        if let Mistaken::Joint(j) = self { turned_round(&out, j) } else { out }
    }

    /// Whether the file's torques change with it, and not the places of the logged ones alone.
    fn moves(self) -> bool {
        !matches!(self, Mistaken::Torques(_))
    }
}

/// A motion whose torque at a joint counts the other way.
fn turned_round(motion: &Motion, joint: usize) -> Motion {
    let mut out = motion.clone();
    out.torque[joint].iter_mut().for_each(|torque| *torque = -*torque);
    out
}

/// What puts two thirds or more of the file's error right, where it misses more than the last third of a torque: a simulator's log has the same channels, and none is asked
/// then. A joint that is not driven has a torque that is no other's. Where a base that is tilted so far leaves less, it is that.
pub(crate) fn mistaken(scene: &Scene<'_>, motions: &[Motion], tilt: &[f64; 3]) -> Option<Mistaken> {
    let driven = driven(scene);
    if motions.iter().any(|motion| !motion.beyond.is_empty()) {
        return None;
    }
    let nominal: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| scene.nominal(motion)).collect();
    let before = errors(&driven, motions, &nominal);
    if before.iter().all(|missed| *missed < LEFT) {
        return None;
    }
    // Metres are nobody's radians.
    let alike = |[a, b]: &[usize; 2]| scene.chain.slides(*a) == scene.chain.slides(*b);
    let pairs = driven.iter().flat_map(|&a| driven.iter().filter(move |b| **b > a).map(move |&b| [a, b])).filter(alike);
    let one = driven.iter().flat_map(|&j| [Mistaken::Angle(j), Mistaken::Joint(j)]);
    let all = pairs.flat_map(|pair| [Mistaken::Torques(pair), Mistaken::Angles(pair), Mistaken::Joints(pair)]).chain(one);
    let after = |way: Mistaken| {
        let undone: Vec<Motion> = motions.iter().map(|motion| way.undone(motion)).collect();
        if !way.moves() {
            return errors(&driven, &undone, &nominal);
        }
        let moved = |mut motion: Motion| {
            motion.rigid = inverse_dynamics(scene.chain, &motion);
            let needed = scene.nominal(&motion);
            (motion, needed)
        };
        let (undone, needed): (Vec<Motion>, Vec<_>) = undone.into_iter().map(moved).unzip();
        errors(&driven, &undone, &needed)
    };
    let sum = |errors: &[f64]| errors.iter().sum::<f64>();
    let right = |way: Mistaken| {
        let after = after(way);
        // What exchanged torques leave as it is misses what it misses for another reason.
        let changed: Vec<usize> = (0..after.len()).filter(|j| after[*j] != before[*j]).collect();
        let [old, new] = [&before, &after].map(|errors| changed.iter().map(|j| errors[*j]).sum::<f64>());
        let puts_right = changed.iter().any(|j| before[*j] >= LEFT) && new < LEFT * old;
        puts_right.then(|| (way, sum(&after)))
    };
    let (found, left) = all.filter_map(right).min_by(|a, b| a.1.total_cmp(&b.1))?;
    // A torque alone that counts the other way is a gain below zero, which is found as one.
    let turned = |j: &usize| {
        let turned: Vec<Motion> = motions.iter().map(|motion| turned_round(motion, *j)).collect();
        sum(&errors(&driven, &turned, &nominal))
    };
    if driven.iter().map(turned).any(|turned| turned <= left) {
        return None;
    }
    let on_a_slope: Vec<Vec<Vec<f64>>> = motions.iter().map(|motion| on_a_slope(scene, motion, tilt)).collect();
    (left < sum(&errors(&driven, motions, &on_a_slope))).then_some(found)
}

/// What the file's robot needs on a base that is tilted.
pub(crate) fn on_a_slope(scene: &Scene<'_>, motion: &Motion, tilt: &[f64; 3]) -> Vec<Vec<f64>> {
    needed_with(scene, motion, turned(scene.chain.gravity(), tilt))
}

/// What the file's robot needs in a gravity that is so much more than the file's.
pub(crate) fn needed_with(scene: &Scene<'_>, motion: &Motion, more: [f64; 3]) -> Vec<Vec<f64>> {
    let mut out = scene.nominal(motion);
    for (joint, weight) in Column::Weight(more).along(motion, scene) {
        out[joint].iter_mut().zip(weight).for_each(|(torque, weight)| *torque += weight);
    }
    out
}

/// Joints whose torque is logged.
pub(crate) fn driven(scene: &Scene<'_>) -> Vec<usize> {
    (0..scene.joints.len()).filter(|j| scene.joints[*j].constant.is_none()).collect()
}

/// For each of these joints the mean square of what the file misses over the variance of the larger of both torques, so that none counts more than by its noise.
pub(crate) fn errors(joints: &[usize], motions: &[Motion], needed: &[Vec<Vec<f64>>]) -> Vec<f64> {
    let of = |&j: &usize| {
        let both = || motions.iter().zip(needed).flat_map(move |(motion, needed)| motion.torque[j].iter().zip(&needed[j]));
        let missed = both().map(|(t, n)| (t - n).powi(2)).sum::<f64>() / both().count().max(1) as f64;
        let [logged, file]: [Vec<f64>; 2] = [both().map(|(t, _)| *t).collect(), both().map(|(_, n)| *n).collect()];
        let spread = deviation(&logged).max(deviation(&file)).powi(2);
        if spread > 0.0 { missed / spread } else { 0.0 }
    };
    joints.iter().map(of).collect()
}
