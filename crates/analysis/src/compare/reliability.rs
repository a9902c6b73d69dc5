//! Repeated sessions of several subjects: how reliable a parameter is, and what changed.

use super::QUANTILE;
use super::result::{Change, Reliability};
use crate::result::{finite, number};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Probability in each tail that a 95 % interval leaves out.
const TAIL: f64 = 0.025;

/// Reliability of one parameter from `values[subject][session]`, all finite; nothing with fewer than two of either.
///
/// Two-way random effects, absolute agreement, single measurement, ICC(2,1): Shrout and Fleiss, Psychol. Bull. 86 (1979) 420;
/// its interval: McGraw and Wong, Psychol. Methods 1 (1996) 30;
/// neither for two subjects, nor where it comes out beyond ±1. SEM² = (MS_sessions − MS_error)/n + MS_error, the first term
/// not below zero; the minimal detectable change is 1.96 √2 SEM.
pub(super) fn reliability(name: &str, unit: &str, values: &[Vec<f64>]) -> Option<Reliability> {
    let (subjects, sessions) = (values.len(), values.first()?.len());
    if subjects < 2 || sessions < 2 || values.iter().any(|row| row.len() != sessions || row.iter().any(|value| !value.is_finite())) {
        return None;
    }
    let (n, k) = (subjects as f64, sessions as f64);
    let of_subject: Vec<f64> = values.iter().map(|row| row.iter().sum::<f64>() / k).collect();
    let of_session: Vec<f64> = (0..sessions).map(|j| values.iter().map(|row| row[j]).sum::<f64>() / n).collect();
    let grand = of_subject.iter().sum::<f64>() / n;
    let between = k * of_subject.iter().map(|mean| (mean - grand).powi(2)).sum::<f64>() / (n - 1.0);
    let session = n * of_session.iter().map(|mean| (mean - grand).powi(2)).sum::<f64>() / (k - 1.0);
    let rest = |i: usize, j: usize| values[i][j] - of_subject[i] - of_session[j] + grand;
    let error = (0..subjects).flat_map(|i| (0..sessions).map(move |j| (i, j))).map(|(i, j)| rest(i, j).powi(2)).sum::<f64>() / ((n - 1.0) * (k - 1.0));
    let icc = (between - error) / (between + (k - 1.0) * error + k * (session - error) / n);
    // Two subjects leave one degree of freedom between them; and where there is hardly any variance the ratio is of two errors.
    let judged = subjects > 2 && icc.abs() <= 1.0;
    let sem = (((session - error) / n).max(0.0) + error).sqrt();
    Some(Reliability {
        name: name.to_owned(),
        unit: unit.to_owned(),
        subjects,
        sessions,
        mean: number(grand),
        icc: number(icc).filter(|_| judged),
        icc_ci95: icc_interval(icc, [between, session, error], n, k).filter(|_| judged),
        standard_error_of_measurement: number(sem),
        minimal_detectable_change: number(QUANTILE * std::f64::consts::SQRT_2 * sem),
        changes: (1..sessions).map(|j| change(values, j)).collect(),
    })
}

fn icc_interval(icc: f64, [between, session, error]: [f64; 3], n: f64, k: f64) -> Option<[f64; 2]> {
    let a = k * icc / (n * (1.0 - icc));
    let b = 1.0 + k * icc * (n - 1.0) / (n * (1.0 - icc));
    let freedom = (a * session + b * error).powi(2) / ((a * session).powi(2) / (k - 1.0) + (b * error).powi(2) / ((n - 1.0) * (k - 1.0)));
    let lower = FisherSnedecor::new(n - 1.0, freedom).ok()?.inverse_cdf(1.0 - TAIL);
    let upper = FisherSnedecor::new(freedom, n - 1.0).ok()?.inverse_cdf(1.0 - TAIL);
    let common = k * session + (k * n - k - n) * error;
    let ends = finite([n * (between - lower * error) / (lower * common + n * between), n * (upper * between - error) / (common + n * upper * between)])?;
    Some(ends.map(|end| end.clamp(-1.0, 1.0)))
}

/// The mean change from the first session to session `j`, by the paired t-test.
fn change(values: &[Vec<f64>], j: usize) -> Change {
    let n = values.len() as f64;
    let differences: Vec<f64> = values.iter().map(|row| row[j] - row[0]).collect();
    let mean = differences.iter().sum::<f64>() / n;
    let std_error = (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
    let student = StudentsT::new(0.0, 1.0, n - 1.0).ok();
    let width = student.as_ref().map(|student| student.inverse_cdf(1.0 - TAIL) * std_error);
    let p_value = student.map(|student| 2.0 * student.sf((mean / std_error).abs())).and_then(number);
    Change { session: j + 1, mean: number(mean), std_error: number(std_error), ci95: width.and_then(|w| finite([mean - w, mean + w])), p_value }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shrout and Fleiss 1979, table 2: six targets, four judges.
    const JUDGES: [[f64; 4]; 6] =
        [[9.0, 2.0, 5.0, 8.0], [6.0, 1.0, 3.0, 2.0], [8.0, 4.0, 6.0, 8.0], [7.0, 1.0, 2.0, 6.0], [10.0, 5.0, 6.0, 9.0], [6.0, 2.0, 4.0, 7.0]];

    #[test]
    fn the_judges_of_shrout_and_fleiss_agree_by_0_29() {
        let values: Vec<Vec<f64>> = JUDGES.iter().map(|row| row.to_vec()).collect();
        let found = reliability("K", "N/m", &values).expect("enough");
        // Printed there with two digits; the interval by R's psych 2.x, ICC(2,1): 0.019 to 0.761.
        assert!((found.icc.expect("a number") - 0.29).abs() < 0.005, "{found:?}");
        let [low, high] = found.icc_ci95.expect("an interval");
        assert!((low - 0.019).abs() < 0.001 && (high - 0.761).abs() < 0.001, "{low} {high}");
        // MS_judges = 32.49, MS_error = 1.02 (their table 3): SEM² = (32.49 − 1.02)/6 + 1.02.
        assert!((found.standard_error_of_measurement.expect("a number").powi(2) - 6.265).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn a_change_is_judged_by_the_paired_differences() {
        let found = reliability("K", "", &[vec![10.0, 11.0], vec![20.0, 22.0], vec![30.0, 33.0]]).expect("enough");
        // Differences 1, 2, 3: mean 2, standard error 1/√3, t = 3.4641 with two degrees of freedom: p = 0.0742.
        let change = &found.changes[0];
        assert_eq!(change.mean, Some(2.0));
        assert!((change.p_value.expect("a number") - 0.0742).abs() < 5e-5, "{change:?}");
        assert_eq!(reliability("K", "", &[vec![1.0, 2.0]]), None);
    }
}
