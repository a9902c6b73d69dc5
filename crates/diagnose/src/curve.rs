//! What a stiffness, a damping or the gain of a reflex that follows a schedule is at each place of it.

use crate::extended::Profile;
use crate::movement::Schedule;
use crate::result::{CauseParameter, Curve};
use crate::search::{Chosen, Stand};
use crate::subject::Subject;
use crate::whittle::variance_of;
use ndof_models::effects::{Action, Matrix, Value, Waves};

/// Curves are given at each hundredth of the schedule, as those of `fit` are.
const PLACES: usize = 100;
/// What calibration leaves of any value, as a share of it.
pub(crate) const CALIBRATION: f64 = 0.005;

/// A curve over the schedule as a fit has it.
struct Fitted<'a> {
    name: String,
    unit: &'static str,
    /// What no coefficient of the curve's own is part of.
    constant: f64,
    waves: Waves,
    /// The first coefficient of the hypothesis among those of the fit.
    own: usize,
    /// The coefficients of the waves, among those of the hypothesis.
    from: usize,
    /// The coefficient of the fit that the mean is, where there is one.
    mean: Option<usize>,
    coefficients: &'a [f64],
}

impl Subject {
    /// What of a chosen hypothesis follows the schedule, the baseline's value included; nothing where it follows none.
    pub fn curves(&self, schedule: &Schedule, axes: &[String], chosen: &[Chosen], stand: &Stand, position: usize) -> Vec<Curve> {
        let own = stand.base.columns.len() + stand.spans[position].0;
        let coefficients = self.coefficients(stand, position);
        let fitted: Vec<Fitted<'_>> = match &self.hypotheses[chosen[position].hypothesis].form.action {
            Action::Scheduled(of) => {
                let constant = self.matrix(chosen, stand, of.matrix);
                let letter = if of.matrix == Matrix::Stiffness { "K" } else { "B" };
                let one = |(entry, places): (usize, &Vec<(usize, usize)>)| {
                    let (i, j) = places[0];
                    Fitted {
                        name: if axes.len() > 1 { format!("{letter}_{}_{}", axes[i], axes[j]) } else { letter.to_owned() },
                        unit: self.unit(of.matrix),
                        constant: constant[i][j],
                        waves: of.waves,
                        own,
                        from: entry * of.waves.count,
                        mean: stand.base.entry(of.matrix, i, j),
                        coefficients,
                    }
                };
                of.entries.iter().enumerate().map(one).collect()
            }
            Action::Reflex(of) => vec![Fitted {
                name: if axes.len() > 1 { format!("gain_{}", axes[of.axis]) } else { "gain".to_owned() },
                unit: self.unit(Matrix::Damping),
                constant: coefficients[0],
                waves: of.waves,
                own,
                from: 1,
                mean: Some(own),
                coefficients,
            }],
            _ => return Vec::new(),
        };
        let knobs = self.profiles(chosen, stand, position);
        fitted.iter().map(|of| of.over(schedule, stand, &knobs)).collect()
    }

    /// That of the matrix's entries.
    pub fn unit(&self, matrix: Matrix) -> &'static str {
        match (matrix, self.scale.rotational) {
            (Matrix::Mass, false) => "N s^2/m",
            (Matrix::Mass, true) => "N m s^2/rad",
            (Matrix::Damping, false) => "N s/m",
            (Matrix::Damping, true) => "N m s/rad",
            (Matrix::Stiffness, false) => "N/m",
            (Matrix::Stiffness, true) => "N m/rad",
        }
    }
}

impl Fitted<'_> {
    fn over(&self, schedule: &Schedule, stand: &Stand, knobs: &[Profile]) -> Curve {
        let at = |k: usize| k as f64 / PLACES as f64;
        let own = &self.coefficients[self.from..self.from + self.waves.count];
        let value: Vec<f64> = (0..=PLACES).map(|k| self.waves.sum(own, at(k)) + self.constant).collect();
        let error: Vec<f64> = (0..=PLACES).map(|k| self.error(at(k), stand, knobs)).collect();
        let end = |side: f64| value.iter().zip(&error).map(|(v, e)| v + side * 1.96 * e.hypot(CALIBRATION * v)).collect();
        Curve {
            name: self.name.clone(),
            unit: self.unit.to_owned(),
            over: schedule.words.clone(),
            over_unit: schedule.unit.clone(),
            at: (0..=PLACES).map(|k| schedule.ends[0] + at(k) * (schedule.ends[1] - schedule.ends[0])).collect(),
            ci95: [end(-1.0), end(1.0)],
            value,
        }
    }

    /// The standard error of the whole at `u`: of its coefficients, and of the knobs that they were found with.
    fn error(&self, u: f64, stand: &Stand, knobs: &[Profile]) -> f64 {
        let covariance = stand.fit.covariance();
        let mut slope: Vec<(usize, f64)> = (0..self.waves.count).map(|k| (self.own + self.from + k, self.waves.at(k, u))).collect();
        slope.extend(self.mean.map(|k| (k, 1.0)));
        let change =
            |up: &[f64], down: &[f64]| slope.iter().filter(|(k, _)| *k >= self.own).map(|(k, x)| x * (up[k - self.own] - down[k - self.own])).sum::<f64>();
        let moved = |knob: &Profile| (change(&knob.up.1, &knob.down.1) / (2.0 * knob.step)).powi(2) * knob.variance;
        (variance_of(&covariance, &slope) + knobs.iter().map(moved).sum::<f64>()).sqrt()
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
        let of = match self.name.as_bytes() {
            [b'K', ..] => "stiffness",
            [b'B', ..] => "damping",
            _ => "the gain of a reflex",
        };
        format!("{of} varies with {}", self.over)
    }
}
