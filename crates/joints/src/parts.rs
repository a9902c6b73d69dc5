//! Which parts of the logs are fitted, and which no fit sees.

use crate::band::Band;
use crate::motion::Motion;
use ndof_diagnose::{DiagnoseError, HeldOut, Stretch};
use std::ops::Range;

/// Samples of the logs, by trial.
pub(crate) type Part = Vec<(usize, Range<usize>)>;

/// What is fitted and what is held out, in samples and in words.
pub(crate) struct Parts {
    pub fitted: Part,
    pub held: Part,
    pub words: [String; 2],
}

/// Share of what a joint's movement would have in a part if it were spread evenly, below which the part says too little of it: as far from none as from all.
const ENOUGH: f64 = 0.5;

impl Parts {
    /// As asked; where that is open and a joint moves in one part alone, as where one moves after the other, the ends of as few stretches of each log as it takes are held out.
    ///
    /// Of a simulator the same end is held out as that which is run again to see what was gained.
    ///
    /// # Errors
    /// [`DiagnoseError::HeldOut`] if one of the two is too short.
    pub fn of(held_out: &HeldOut, motions: &[Motion], band: &Band) -> Result<Self, DiagnoseError> {
        let shortest = motions.iter().map(length).min().unwrap_or(0);
        let stretches = held_out.divide(motions.len(), shortest, band.rate_hz)?;
        let [fitted, held] = stretches.each_ref().map(|stretch| samples(stretch, motions));
        let asked = Parts { fitted, held, words: stretches.map(|stretch| stretch.words(band.rate_hz)) };
        if *held_out != HeldOut::Auto || motions.iter().any(|motion| !motion.beyond.is_empty()) || asked.evenness(motions) >= ENOUGH {
            return Ok(asked);
        }
        // A part that is shorter than what the band is asked over is that of its neighbours.
        let most = (HeldOut::SHARE * shortest as f64 / band.width() as f64) as usize;
        let mut best = asked;
        for count in 1..=most {
            let parts = Parts::ends(count, motions, band.rate_hz);
            if parts.evenness(motions) > best.evenness(motions) {
                best = parts;
            }
            if best.evenness(motions) >= ENOUGH {
                break;
            }
        }
        Ok(best)
    }

    /// So many equal stretches of each log, of which the ends are held out.
    fn ends(count: usize, motions: &[Motion], rate_hz: f64) -> Self {
        let of = |from: f64, to: f64| -> Part {
            let stretch = |(t, motion): (usize, &Motion)| {
                let at = move |share: f64| (share * length(motion) as f64 / count as f64).round() as usize;
                (0..count).map(move |k| (t, at(k as f64 + from)..at(k as f64 + to))).collect::<Vec<_>>()
            };
            motions.iter().enumerate().flat_map(stretch).collect()
        };
        let (fitted, held) = (of(0.0, 1.0 - HeldOut::SHARE), of(1.0 - HeldOut::SHARE, 1.0));
        let words = [&fitted, &held].map(|part| words(part, motions.len(), rate_hz));
        Parts { fitted, held, words }
    }

    /// Of all joints and both parts, the least share of a joint's movement over that which it would have if it were spread evenly.
    fn evenness(&self, motions: &[Motion]) -> f64 {
        let moving = |part: &Part, j: usize| {
            part.iter().map(|(t, range)| motions[*t].moves[j][range.clone()].iter().filter(|moves| **moves).count()).sum::<usize>() as f64
        };
        let of = |j: usize| {
            let [fitted, held] = [&self.fitted, &self.held].map(|part| moving(part, j));
            if fitted + held > 0.0 { (fitted / (1.0 - HeldOut::SHARE)).min(held / HeldOut::SHARE) / (fitted + held) } else { 1.0 }
        };
        (0..motions.first().map_or(0, |motion| motion.moves.len())).map(of).fold(1.0, f64::min)
    }
}

fn length(motion: &Motion) -> usize {
    motion.q.first().map_or(0, Vec::len)
}

/// Samples of the log that belong to a stretch, trial by trial.
fn samples(stretch: &Stretch, motions: &[Motion]) -> Part {
    match stretch {
        Stretch::Trials(trials) => trials.iter().map(|t| (*t, 0..length(&motions[*t]))).collect(),
        Stretch::Samples(range) => (0..motions.len()).map(|t| (t, range.clone())).collect(),
    }
}

/// "0.00 to 4.20, 6.00 to 10.20 s", of several trials each with its number.
fn words(part: &Part, trials: usize, rate_hz: f64) -> String {
    let times = |t: usize| -> Vec<String> {
        let own = part.iter().filter(|(trial, _)| *trial == t);
        own.map(|(_, range)| format!("{:.2} to {:.2}", range.start as f64 / rate_hz, range.end as f64 / rate_hz)).collect()
    };
    let of = |t: usize| if trials > 1 { format!("trial {}: {} s", t + 1, times(t).join(", ")) } else { format!("{} s", times(t).join(", ")) };
    (0..trials).map(of).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joints of which each moves for its part of a log of so many samples, one after the other.
    fn one_after_the_other(joints: usize, samples: usize) -> Motion {
        let moves = (0..joints).map(|j| (0..samples).map(|k| k * joints / samples == j).collect()).collect();
        Motion { q: vec![vec![0.0; samples]; joints], moves, ..Motion::default() }
    }

    #[test]
    fn of_joints_that_move_one_after_the_other_each_is_fitted_and_held_out() {
        let band = Band::new([0.8, 20.0], 200.0);
        let parts = Parts::of(&HeldOut::Auto, &[one_after_the_other(4, 16_000)], &band).expect("parts");
        assert_eq!(parts.words[1], "14.00 to 20.00, 34.00 to 40.00, 54.00 to 60.00, 74.00 to 80.00 s");
        assert_eq!(parts.fitted.iter().chain(&parts.held).map(|(_, range)| range.len()).sum::<usize>(), 16_000);
        // A file a joint is the same.
        let files: Vec<Motion> = (0..3).map(|f| Motion { moves: (0..3).map(|j| vec![j == f; 4000]).collect(), ..one_after_the_other(3, 4000) }).collect();
        let parts = Parts::of(&HeldOut::Auto, &files, &band).expect("parts");
        assert_eq!(parts.words[1], "trial 1: 14.00 to 20.00 s; trial 2: 14.00 to 20.00 s; trial 3: 14.00 to 20.00 s");
    }

    #[test]
    fn what_is_asked_for_and_what_is_even_stay_as_they_are() {
        let band = Band::new([0.8, 20.0], 200.0);
        let asked = Parts::of(&HeldOut::Time(2.0, 20.0), &[one_after_the_other(2, 16_000)], &band).expect("parts");
        assert_eq!(asked.words, ["20.00 to 80.00 s", "2.00 to 20.00 s"]);
        let even = Motion { moves: vec![vec![true; 16_000]; 2], ..one_after_the_other(2, 16_000) };
        assert_eq!(Parts::of(&HeldOut::Auto, &[even], &band).expect("parts").words[1], "56.00 to 80.00 s");
    }
}
