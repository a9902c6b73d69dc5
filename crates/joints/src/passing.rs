//! Torque that acts for a while and follows from no motion: someone leans on the robot, a cable catches.

use crate::blocks::BLOCKS;
use crate::model::{Model, residual};
use crate::options::Options;
use crate::table::{Series, View};
use ndof_signal::robust_spread;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A torque that acts for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Passing {
    pub trial: usize,
    /// Samples of the log, from and to.
    pub samples: [usize; 2],
    /// Its mean there (N m).
    pub mean: f64,
}

/// The mean of what is left of a joint's torque in a block of time.
struct Block {
    trial: usize,
    samples: [usize; 2],
    count: f64,
    mean: f64,
}

/// Degrees of freedom of a deviation that is known by distances from the median, for each value (P. J. Rousseeuw and C. Croux, Alternatives to the median absolute deviation, J. Am. Stat. Assoc. 88 (1993) 1273).
const FREEDOM: f64 = 0.37;

/// Of each joint the torque that a model leaves for a while and for no longer, if there is one that matters.
///
/// Means of noise over blocks of one length are normal; how they scatter is known by most blocks, whatever the few have.
pub(crate) fn passing(views: [&View<'_>; 2], model: &Model, options: &Options) -> Vec<Option<Passing>> {
    let rests = views.map(|view| residual(view, model));
    let kept: usize = views[0].pieces.iter().map(|piece| piece.places.len()).sum();
    let length = kept.div_ceil(BLOCKS).max(1);
    let joints = views[0].scene.joints.len();
    let of = |j: usize| {
        let mut all: Vec<Block> = views.iter().zip(&rests).flat_map(|(view, rest)| blocks(view, rest, j, length)).collect();
        all.sort_by_key(|block| (block.trial, block.samples));
        largest(&all, options.false_alarms / joints as f64, options.tolerance * views[0].scene.joints[j].torque)
    };
    (0..joints).map(of).collect()
}

/// The mean of what is left of a joint's torque while it moves, block by block; those in which it rests for the most part say nothing.
fn blocks(view: &View<'_>, rest: &Series, j: usize, length: usize) -> Vec<Block> {
    let mut out = Vec::new();
    for (piece, rest) in view.pieces.iter().zip(&rest.0) {
        let Some(rest) = &rest[j] else { continue };
        let moves = &view.motions[piece.trial].moves[j];
        for (places, rest) in piece.places.chunks_exact(length).zip(rest.chunks_exact(length)) {
            let count = places.iter().filter(|place| moves[**place]).count();
            let mean = rest.iter().sum::<f64>() / count.max(1) as f64;
            if 2 * count > length {
                out.push(Block { trial: piece.trial, samples: [places[0], places[length - 1]], count: count as f64, mean });
            }
        }
    }
    out
}

/// The largest stretch of blocks beyond chance, and beyond a size if it is taken over all of them.
fn largest(blocks: &[Block], chance: f64, size: f64) -> Option<Passing> {
    let (middle, scatter) = robust_spread(&blocks.iter().map(|block| block.mean).collect::<Vec<_>>());
    let law = StudentsT::new(0.0, 1.0, FREEDOM * blocks.len() as f64).ok()?;
    let beyond = |block: &Block| scatter > 0.0 && 2.0 * law.sf((block.mean - middle).abs() / scatter) * (blocks.len() as f64) < chance;
    let all: f64 = blocks.iter().map(|block| block.count).sum();
    let energy = |run: &[Block]| run.iter().map(|block| block.count * (block.mean - middle).powi(2)).sum::<f64>();
    let runs = blocks.chunk_by(|a, b| a.trial == b.trial && beyond(a) == beyond(b)).filter(|run| beyond(&run[0]));
    let run = runs.max_by(|a, b| energy(a).total_cmp(&energy(b)))?;
    let count: f64 = run.iter().map(|block| block.count).sum();
    let mean = run.iter().map(|block| block.count * (block.mean - middle)).sum::<f64>() / count;
    let found = Passing { trial: run[0].trial, samples: [run[0].samples[0], run.last()?.samples[1]], mean };
    (energy(run) / all > size * size).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Blocks of eight samples of white noise, to some of which something is added.
    fn of(seed: u64, more: impl Fn(usize) -> f64) -> Vec<Block> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut noise = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let mut mean = |k: usize| (0..8).map(|_| noise() + more(k)).sum::<f64>() / 8.0;
        (0..34).map(|k| Block { trial: 0, samples: [8 * k, 8 * k + 7], count: 8.0, mean: mean(k) }).collect()
    }

    #[test]
    fn a_push_is_found_with_its_time_and_noise_is_none() {
        let push = largest(&of(1, |k| if (12..15).contains(&k) { -20.0 } else { 0.0 }), 0.01, 0.1).expect("a push");
        assert_eq!(push.samples, [96, 119]);
        assert!((push.mean + 20.0).abs() < 1.0, "{}", push.mean);
        let (seeds, chance) = (2000, 0.05);
        let alarms = (0..seeds).filter(|seed| largest(&of(*seed, |_| 0.0), chance, 0.0).is_some()).count() as f64;
        // Three standard errors of so many above what is asked.
        let most = seeds as f64 * chance;
        assert!(alarms < most + 3.0 * most.sqrt(), "{alarms}");
    }
}
