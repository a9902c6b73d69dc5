//! What spectral estimates take for granted: signals whose power does not drift, Gaussian amplitudes, trials alike.

use super::result::ChannelAssumptions;
use crate::result::{Number, number};
use crate::trials::{RoleNames, Roles, Trial};
use ndof_signal::{Amplitudes, normality, reverse_arrangements};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// Intervals whose mean squares are compared (Bendat & Piersol: 16 to 25).
pub(super) const INTERVALS: usize = 20;

/// Shares at which the amplitudes' quantiles are told.
const SHARES: [f64; 9] = [0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99];

/// The assumptions for every channel with a role that all trials have.
pub(super) fn assumptions(trials: &[Trial], sizes: &[Vec<Amplitudes>], names: &RoleNames) -> Vec<ChannelAssumptions> {
    let Some(first) = trials.first() else { return Vec::new() };
    let Ok(roles) = Roles::find(&first.recording, &first.file, names) else { return Vec::new() };
    roles.used().into_par_iter().filter_map(|index| channel(trials, sizes, &first.recording.channels()[index].name)).collect()
}

fn channel<'a>(trials: &[Trial], sizes: &'a [Vec<Amplitudes<'a>>], name: &str) -> Option<ChannelAssumptions> {
    let of_trial = |(trial, sizes): (&Trial, &'a Vec<Amplitudes<'a>>)| sizes.get(trial.recording.channels().iter().position(|c| c.name == name)?);
    let amplitudes: Vec<&Amplitudes> = trials.iter().zip(sizes).map(of_trial).collect::<Option<_>>()?;
    if amplitudes.iter().any(|a| a.samples.len() < INTERVALS) {
        return None;
    }
    let courses: Vec<Vec<f64>> = amplitudes.iter().filter_map(|a| a.mean_squares(INTERVALS).ok()).collect();
    let shapes: Vec<_> = amplitudes.iter().map(|a| normality(&a.samples).ok()).collect();
    let of = |value: &dyn Fn(&ndof_signal::Normality) -> f64| -> Vec<Number> { shapes.iter().map(|s| s.as_ref().and_then(|s| number(value(s)))).collect() };
    Some(ChannelAssumptions {
        name: name.to_owned(),
        drift_p_value: amplitudes.iter().map(|a| p_value(&a.means(INTERVALS).ok()?)).collect(),
        trend_p_value: courses.iter().map(|course| p_value(course)).collect(),
        skewness: of(&|s| s.skewness),
        excess_kurtosis: of(&|s| s.excess_kurtosis),
        normal_p_value: of(&|s| s.p_value),
        gaussian_quantiles: SHARES.iter().map(|share| Normal::standard().inverse_cdf(*share)).collect(),
        quantiles: amplitudes.iter().map(|a| a.quantiles(&SHARES).into_iter().map(number).collect()).collect(),
        squared_correlation: table(&amplitudes.iter().map(|a| &*a.samples).collect::<Vec<_>>()),
        squared_correlation_of_mean_squares: table(&courses.iter().map(Vec::as_slice).collect::<Vec<_>>()),
        mean_squares: courses,
    })
}

/// Probability of so much of a trend by chance.
fn p_value(course: &[f64]) -> Number {
    reverse_arrangements(course).ok().and_then(|test| number(test.p_value))
}

/// R² of each pair, over the length that both have.
fn table(signals: &[&[f64]]) -> Vec<Vec<Number>> {
    let mut out = vec![vec![None; signals.len()]; signals.len()];
    for a in 0..signals.len() {
        for b in 0..=a {
            // What varies has 1 with itself.
            let own = || signals[a].iter().any(|x| *x != signals[a][0]).then_some(1.0);
            out[a][b] = if a == b { own() } else { squared_correlation(signals[a], signals[b]) };
            out[b][a] = out[a][b];
        }
    }
    out
}

fn squared_correlation(a: &[f64], b: &[f64]) -> Number {
    let n = a.len().min(b.len());
    let mean = |x: &[f64]| x[..n].iter().sum::<f64>() / n as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |x: &[f64], mx: f64, y: &[f64], my: f64| x[..n].iter().zip(&y[..n]).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>();
    number(sum(a, ma, b, mb).powi(2) / (sum(a, ma, a, ma) * sum(b, mb, b, mb)))
}

#[cfg(test)]
mod tests {
    use super::super::quality::amplitudes;
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn gaussian(seed: u64, n: usize) -> Vec<f64> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| rng.sample(rand_distr::StandardNormal)).collect()
    }

    #[test]
    fn repeated_trials_correlate_others_do_not_and_a_square_is_not_gaussian() {
        let force = gaussian(1, 20_000);
        let trial = |force: &[f64], noise: u64| {
            let motion: Vec<f64> = force.iter().zip(gaussian(noise, force.len())).map(|(f, e)| f * f + 0.1 * e).collect();
            Trial::new(100.0).effort("x", force.to_vec()).displacement("x", motion).expect("valid")
        };
        let trials = [trial(&force, 2), trial(&force, 3), trial(&gaussian(4, 20_000), 5)];
        let sizes: Vec<Vec<Amplitudes>> = trials.iter().map(|trial| amplitudes(&trial.recording)).collect();
        let found = assumptions(&trials, &sizes, &RoleNames::default());
        let [input, output] = found.as_slice() else { panic!("two channels") };
        assert!((input.squared_correlation[0][1].expect("defined") - 1.0).abs() < 1e-12);
        // Two independent Gaussian signals: R² is 1/N on average, 25/N with a probability below 1e-6.
        assert!(input.squared_correlation[0][2].expect("defined") < 25.0 / 20_000.0);
        assert!(output.squared_correlation[0][1].expect("defined") > 0.9);
        assert!(input.normal_p_value[0].expect("defined") > 0.001 && output.normal_p_value[0].expect("defined") < 1e-6);
        assert!((output.skewness[0].expect("defined") - 8.0_f64.sqrt()).abs() < 0.5, "χ² with one degree of freedom");
        // Standard error of the 99 % quantile: √(p(1−p)/N)/φ(z) = 0.026.
        assert!((input.quantiles[0][8].expect("defined") - 2.326).abs() < 4.0 * 0.026);
        assert_eq!(input.mean_squares[0].len(), 20);
    }
}
