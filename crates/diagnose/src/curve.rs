//! What a stiffness or damping that follows a schedule is at each place of it.

use crate::movement::Schedule;
use crate::plant::Role;
use crate::result::{CauseParameter, Curve};
use crate::search::{Chosen, Stand};
use crate::subject::Subject;
use ndof_models::effects::{Action, Matrix, Scheduled, Value};

/// Curves are given at each hundredth of the schedule, as those of `fit` are.
const PLACES: usize = 100;
/// What calibration leaves of any entry.
const FLOOR: f64 = 0.005;

impl Subject {
    /// The entries of a chosen hypothesis over the schedule, the baseline's value included; nothing where it follows none.
    pub fn curves(&self, schedule: &Schedule, axes: &[String], chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<Curve> {
        let Action::Scheduled(of) = &self.hypotheses[chosen[position].hypothesis].form.action else { return Vec::new() };
        let letter = if of.matrix == Matrix::Stiffness { "K" } else { "B" };
        let unit = match (of.matrix == Matrix::Stiffness, self.scale.rotational) {
            (true, false) => "N/m",
            (true, true) => "N m/rad",
            (false, false) => "N s/m",
            (false, true) => "N m s/rad",
        };
        let constant = self.matrix(chosen, stand, of.matrix);
        let one = |(entry, places): (usize, &Vec<(usize, usize)>)| {
            let (i, j) = places[0];
            let (value, error): (Vec<f64>, Vec<f64>) = (0..=PLACES).map(|k| self.at(of, stand, position, entry, k as f64 / PLACES as f64)).unzip();
            let value: Vec<f64> = value.iter().map(|v| v + constant[i][j]).collect();
            let end = |side: f64| value.iter().zip(&error).map(|(v, e)| v + side * 1.96 * e.hypot(FLOOR * v)).collect();
            Curve {
                name: if axes.len() > 1 { format!("{letter}_{}_{}", axes[i], axes[j]) } else { letter.to_owned() },
                unit: unit.to_owned(),
                over: schedule.words.clone(),
                over_unit: schedule.unit.clone(),
                at: (0..=PLACES).map(|k| schedule.ends[0] + k as f64 / PLACES as f64 * (schedule.ends[1] - schedule.ends[0])).collect(),
                ci95: [end(-1.0), end(1.0)],
                value,
            }
        };
        of.entries.iter().enumerate().map(one).collect()
    }

    /// The change of an entry at `u` of the schedule, and the standard error of the whole entry there.
    fn at(&self, of: &Scheduled, stand: &Stand, position: usize, entry: usize, u: f64) -> (f64, f64) {
        let covariance = stand.fit.covariance();
        let (i, j) = of.entries[entry][0];
        let same = |role: &Role| *role == Role::Entry(of.matrix, i, j) || *role == Role::Entry(of.matrix, j, i);
        let own = stand.base.columns.len() + stand.spans[position].0 + entry * of.waves.count;
        let mut slope: Vec<(usize, f64)> = (0..of.waves.count).map(|k| (own + k, of.waves.at(k, u))).collect();
        slope.extend(stand.base.roles.iter().position(same).map(|k| (k, 1.0)));
        let variance: f64 = slope.iter().map(|(a, x)| slope.iter().map(|(b, y)| x * y * covariance.at(*a, *b)).sum::<f64>()).sum();
        (of.curve(self.coefficients(stand, position), entry, u), variance.max(0.0).sqrt())
    }
}

impl Curve {
    fn extreme(&self, greatest: bool) -> usize {
        let places = (0..self.value.len()).filter(|k| self.value[*k].is_finite());
        let chosen = |a: &usize, b: &usize| self.value[*a].total_cmp(&self.value[*b]);
        (if greatest { places.max_by(chosen) } else { places.min_by(chosen) }).unwrap_or(0)
    }

    /// The least and the greatest value with their intervals.
    pub(crate) fn ends(&self) -> [CauseParameter; 2] {
        [(false, "least"), (true, "greatest")].map(|(greatest, word)| {
            let k = self.extreme(greatest);
            let ci95 = Some([self.ci95[0][k], self.ci95[1][k]]);
            CauseParameter { name: format!("{}_{word}", self.name), unit: self.unit.clone(), value: Value::Number(self.value[k]), ci95 }
        })
    }

    /// "over the phase of the cycle, K is least at 0.12 and greatest at 0.72".
    pub(crate) fn sentence(&self) -> String {
        let [low, high] = [false, true].map(|greatest| self.at[self.extreme(greatest)]);
        let unit = if self.over_unit.is_empty() { String::new() } else { format!(" {}", self.over_unit) };
        format!("over {}, {} is least at {low:.2}{unit} and greatest at {high:.2}{unit}", self.over, self.name)
    }

    /// "stiffness varies with the phase of the cycle".
    pub(crate) fn what(&self) -> String {
        format!("{} varies with {}", if self.name.starts_with('K') { "stiffness" } else { "damping" }, self.over)
    }
}
