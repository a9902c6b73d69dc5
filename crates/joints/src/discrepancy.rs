//! Where the file's error lies, and what is to be known of the log.

use crate::answer::Answer;
use crate::lost::Lost;
use crate::model::{Model, residual};
use crate::passing::Passing;
use crate::unmoved;
use ndof_diagnose::{BandShare, Discrepancy, TimeShare};
use ndof_models::robot::Robot;
use ndof_signal::forward_transform;

/// Stretches of time, and bands, in which the file's error is shown.
const SLICES: usize = 8;

impl Answer<'_> {
    /// Where the file's error lies.
    pub fn discrepancy(&self, empty: &Model) -> Discrepancy {
        let rest = residual(self.held, empty);
        let (mut by_band, mut by_time) = (Vec::new(), Vec::new());
        for (j, name) in self.ports.inputs.iter().map(|i| self.trials[0].channels()[*i].name.clone()).enumerate() {
            let Some((piece, x)) = rest.0.iter().enumerate().filter_map(|(p, joints)| Some((p, joints[j].as_ref()?))).max_by_key(|(_, x)| x.len()) else {
                continue;
            };
            let total: f64 = x.iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE);
            let places = &self.held.pieces[piece].places;
            let start = places.first().copied().unwrap_or(0) as f64 / self.scene.rate_hz;
            for s in 0..SLICES {
                let range = s * x.len() / SLICES..(s + 1) * x.len() / SLICES;
                let time = |k: usize| places[k.min(places.len() - 1)] as f64 / self.scene.rate_hz - start;
                let share = x[range.clone()].iter().map(|x| x * x).sum::<f64>() / total;
                by_time.push(TimeShare { time_s: [time(range.start), time(range.end)], output: name.clone(), share });
            }
            by_band.extend(bands(x, self.held.band.kept_hz(), self.held.band.pass_hz).into_iter().map(|(band_hz, share)| BandShare {
                band_hz,
                output: name.clone(),
                share,
            }));
        }
        let mut notes = vec![format!(
            "the motion rises above the noise of the encoders up to {:.2} Hz; torques are compared up to {:.2} Hz",
            self.scene.fastest_hz, self.fitted.band.pass_hz
        )];
        notes.extend(self.lost.map(Lost::words));
        notes.extend(self.suspicions.iter().cloned());
        let [torques, angles] =
            [&self.ports.inputs, &self.ports.outputs].map(|own| own.iter().map(|c| self.trials[0].channels()[*c].name.as_str()).collect::<Vec<_>>());
        notes.extend(self.taken.words(self.scene.chain, &torques, &angles));
        notes.extend(self.mistaken.map(|mistaken| mistaken.words(&self.names(), &torques, &angles)));
        notes.extend(self.passed_stops());
        notes.extend(self.names().iter().zip(self.unmoved).filter(|(_, unmoved)| **unmoved).map(|(name, _)| unmoved::words(name)));
        notes.extend(self.passing.iter().enumerate().filter_map(|(j, passing)| Some(self.of_passing(j, passing.as_ref()?))));
        notes.extend((0..self.joints()).filter_map(|j| self.what_remains(j)));
        let none = f64::NAN;
        Discrepancy { by_band, by_time, linear_share: none, nonlinear_share: none, time_varying_share: none, noise_share: none, another_plant: None, notes }
    }

    /// In words, what acts at a joint for a while.
    fn of_passing(&self, j: usize, passing: &Passing) -> String {
        let trial = &self.trials[passing.trial];
        let [from, to] = passing.samples.map(|k| trial.start_s() + k as f64 / self.scene.rate_hz);
        let of_trial = if self.trials.len() > 1 { format!(" of trial {}", passing.trial + 1) } else { String::new() };
        format!(
            "at {} a torque of {:.3} {} more is left from {from:.1} to {to:.1} s{of_trial} than at all other times: did someone lean on the robot, or did it touch something? Leave that stretch out with --exclude {from:.1}-{to:.1}",
            self.scene.chain.joints().names[j],
            passing.mean,
            self.unit_at(j, "N m")
        )
    }
}

/// Shares of a series' power in bands that double.
fn bands(x: &[f64], rate_hz: f64, most_hz: f64) -> Vec<([f64; 2], f64)> {
    let forward = forward_transform(x.len());
    let mut lines = forward.make_output_vec();
    if forward.process(&mut x.to_vec(), &mut lines).is_err() {
        return vec![];
    }
    let edges: Vec<f64> = std::iter::once(0.0).chain((0..5).map(|k| most_hz / f64::from(1 << (4 - k)))).collect();
    let total: f64 = lines.iter().map(|l| l.norm_sqr()).sum::<f64>().max(f64::MIN_POSITIVE);
    let within = |low: f64, high: f64| {
        let hz = |k: usize| k as f64 * rate_hz / x.len() as f64;
        lines.iter().enumerate().filter(|(k, _)| hz(*k) >= low && hz(*k) < high).map(|(_, l)| l.norm_sqr()).sum::<f64>() / total
    };
    edges.windows(2).map(|e| ([e[0], e[1]], within(e[0], e[1]))).collect()
}
