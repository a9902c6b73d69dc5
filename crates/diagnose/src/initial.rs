//! How a free run begins: the state that fits its first samples best.

use crate::along::Clock;
use crate::free_run::{Run, Runner};
use crate::linear::{Symmetric, dot};
use crate::state::State;
use ndarray::Array2;
use ndof_linear::eigenvalues;
use ndof_signal::rms;
use num_complex::Complex64;
use std::borrow::Cow;

impl Runner {
    /// A run over a range of a trial, from the initial states that fit its first samples best; by the effort and the measured velocity of the trial.
    pub fn fitted_run(
        &self,
        inverse_mass: &[Vec<f64>],
        (effort, v): (&[Vec<f64>], &[Vec<f64>]),
        state: &State,
        trial: usize,
        range: std::ops::Range<usize>,
        fitted: usize,
    ) -> Run {
        let clock = Clock::of(&state.layout, trial);
        let hidden: Vec<f64> = self.laws.iter().flat_map(|law| state.hidden(law.as_ref(), trial, range.start)).collect();
        let rings: Vec<Ring> = state.modes().map(|(axis, pole)| Ring { axis, pole, rate_hz: clock.rate_hz, from: range.start }).collect();
        let initial = self.initial(inverse_mass, (effort, &rings), range.start..range.start + fitted, clock, (&state.x[trial], v), &hidden);
        let (place, ringing) = initial.split_at(2 * v.len());
        let (x0, v0) = place.split_at(v.len());
        self.run(inverse_mass, &rung(effort, &rings, ringing, range.clone()), range, clock, (x0, v0, &hidden))
    }

    /// Samples of a trial in which its initial state is felt: three times the time in which the slowest mode of inertia, damping and stiffness, or of what
    /// efforts pass, dies away, at least until the filters of the channels have settled. Where these alone do not come to rest, the laws are counted in.
    pub fn felt(&self, inverse_mass: &[Vec<f64>], state: &State) -> usize {
        let layout = &state.layout;
        let n = layout.axes;
        let slowest = |rates: &Array2<f64>| {
            let own = eigenvalues(rates).unwrap_or_default();
            own.into_iter().chain(state.modes().map(|(_, pole)| pole)).map(|pole| -pole.re).fold(f64::INFINITY, f64::min)
        };
        // Rates of change of displacements, then of velocities.
        let without_laws = Array2::from_shape_fn((2 * n, 2 * n), |(i, j)| match (i.checked_sub(n), j.checked_sub(n)) {
            (None, _) => f64::from(u8::from(j == i + n)),
            (Some(i), None) => -(0..n).map(|k| inverse_mass[i][k] * self.stiffness[k][j]).sum::<f64>(),
            (Some(i), Some(j)) => -(0..n).map(|k| inverse_mass[i][k] * self.damping[k][j]).sum::<f64>(),
        });
        let rate = Some(slowest(&without_laws)).filter(|rate| *rate > 0.0).unwrap_or_else(|| slowest(&self.slopes_at_rest(inverse_mass, Clock::of(layout, 0))));
        let samples = if rate > 0.0 { (3.0 / rate * layout.rate_hz).ceil() as usize } else { layout.samples };
        samples.max(layout.settled()).max(8).min(layout.samples)
    }

    /// Initial displacements and velocities, and the sizes of what rings, that fit the first samples best, by two Gauss-Newton steps.
    fn initial(
        &self,
        inverse_mass: &[Vec<f64>],
        (effort, rings): (&[Vec<f64>], &[Ring]),
        range: std::ops::Range<usize>,
        clock: Clock<'_>,
        (x, v): (&[Vec<f64>], &[Vec<f64>]),
        hidden: &[f64],
    ) -> Vec<f64> {
        let n = x.len();
        let mut guess: Vec<f64> = x.iter().chain(v).map(|s| s[range.start]).chain(vec![0.0; 2 * rings.len()]).collect();
        let run = |g: &[f64]| {
            let effort = rung(effort, rings, &g[2 * n..], range.clone());
            self.run(inverse_mass, &effort, range.clone(), clock, (&g[..n], &g[n..2 * n], hidden)).x
        };
        let target: Vec<f64> = range.clone().flat_map(|k| x.iter().map(move |s| s[k])).collect();
        let rest_of = |base: &[f64]| -> Vec<f64> { target.iter().zip(base).map(|(t, b)| t - b).collect() };
        let mut base = run(&guess);
        let mut rest = rest_of(&base);
        for _ in 0..2 {
            let felt = rings.iter().flat_map(|ring| [&effort[ring.axis]; 2]);
            let size: Vec<f64> = x.iter().chain(v).chain(felt).map(|s| 1e-3 * rms(&s[range.clone()]).max(1e-12)).collect();
            let slopes: Vec<Vec<f64>> = (0..guess.len())
                .map(|q| {
                    let mut g = guess.clone();
                    g[q] += size[q];
                    run(&g).iter().zip(&base).map(|(a, b)| (a - b) / size[q]).collect()
                })
                .collect();
            let gram = Symmetric::of(guess.len(), |a, b| dot(&slopes[a], &slopes[b]));
            let rhs: Vec<f64> = slopes.iter().map(|s| dot(s, &rest)).collect();
            let Some(step) = gram.factor().map(|f| f.solve(&rhs)).filter(|s| s.iter().all(|v| v.is_finite())) else { break };
            let next: Vec<f64> = guess.iter().zip(&step).map(|(g, s)| g + s).collect();
            let moved = run(&next);
            let left = rest_of(&moved);
            // Friction that sticks has no slope to follow: a step that does not help is not taken.
            if dot(&left, &left).total_cmp(&dot(&rest, &rest)).is_ge() {
                break;
            }
            (guess, base, rest) = (next, moved, left);
        }
        guess
    }
}

/// A mode of the effort that rings on from before a sample.
struct Ring {
    axis: usize,
    pole: Complex64,
    rate_hz: f64,
    from: usize,
}

/// Efforts with what rings in them over a range: each ring by the sizes of its cosine and sine at the beginning.
fn rung<'a>(effort: &'a [Vec<f64>], rings: &[Ring], sizes: &[f64], range: std::ops::Range<usize>) -> Cow<'a, [Vec<f64>]> {
    let mut out = Cow::Borrowed(effort);
    for (ring, size) in rings.iter().zip(sizes.chunks(2)) {
        for k in range.clone() {
            let turned = (ring.pole * ((k - ring.from) as f64 / ring.rate_hz)).exp();
            out.to_mut()[ring.axis][k] += size[0] * turned.re + size[1] * turned.im;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use crate::free_run::inverse;
    use crate::shared_tests::{baseline, known, linear};
    use ndof_challenge::Plant;
    use ndof_models::ForceLaw;
    use ndof_models::effects::on_axis;
    use ndof_models::time::laws::Relaxation;

    /// A body of 2 kg with 1 N s/m: its motion dies away as exp(-t / 4 s).
    #[test]
    fn a_beginning_is_felt_for_three_times_as_long_as_the_slowest_mode_takes_to_die_away() {
        let made = linear(Plant::Planar, (2, 20.0), 61);
        let (samples, meaning) = known(&made, &made.recordings);
        let (subject, stand) = baseline(&samples, &meaning);
        let mut runner = subject.runner(&[], &stand);
        let both = |value: f64| vec![vec![value, 0.0], vec![0.0, value]];
        (runner.mass, runner.damping, runner.stiffness) = (both(2.0), both(1.0), both(300.0));
        let felt = runner.felt(&inverse(&runner.mass).expect("a mass"), &stand.state);
        assert!((felt as f64 - 12.0 * subject.layout.rate_hz).abs() <= 1.0, "{felt}");
        // Without a damper they never rest, but a relaxation of 1000 N/m in 10 ms damps as 10 N s/m do.
        runner.damping = both(0.0);
        assert_eq!(runner.felt(&inverse(&runner.mass).expect("a mass"), &stand.state), subject.layout.samples);
        runner.laws = (0..2).map(|axis| Box::new(on_axis(axis, Relaxation, [1000.0, 0.01])) as Box<dyn ForceLaw>).collect();
        let damped = runner.felt(&inverse(&runner.mass).expect("a mass"), &stand.state);
        assert!(damped < subject.layout.samples / 2, "{damped}");
    }
}
