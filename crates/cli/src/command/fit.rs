//! `ndof fit`.

use crate::error::CliError;
use crate::options::{Analysis, Limb, Reading, Shared, not_negative, positive, words};
use crate::output::{self, columns, p_value, short};
use clap::Args;
use ndof_models::{NullLaw, Transducer};
use ndof_study::result::FitResult;
use ndof_study::result::fit::ComparedModel;
use ndof_study::{ComparedParameter, FitCost, FitSettings, VafWeight, compare};
use std::path::PathBuf;
use std::process::ExitCode;

/// Fit inertia, damping and stiffness to the frequency response, with intervals.
///
/// Several files are repeated trials of one experiment and are pooled. The derived estimate is fitted where there is a
/// commanded perturbation, else the direct one. --band sets the frequencies that are fitted.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof fit trial-1.csv trial-2.csv --band 0.5-8 --kinematics arm.toml --json fit.json")]
pub struct Arguments {
    /// Recordings; `-` is CSV on standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Parametric model: inertia-damping-stiffness, and behind a `+` what extends it (`ndof list models`)
    #[arg(long, default_value = ndof_study::MODEL)]
    model: String,
    /// Widen intervals by what calibration leaves: 0.5 % of M, 1 % of B and K, 0.1 ms of delays, in quadrature
    #[arg(long)]
    systematic: bool,
    /// Compare with every single extension by likelihood ratio, AIC and BIC
    #[arg(long)]
    compare: bool,
    /// What is minimised: squared errors weighted by their covariance, or the paper's dB and degrees
    #[arg(long, default_value = "weighted", value_parser = words::<FitCost>(&["weighted", "paper"]))]
    cost: FitCost,
    /// How coherence weighs VAF, R² and the paper's cost: γ² as it is computed, or its root γ
    #[arg(long, default_value = "gamma-squared", value_parser = words::<VafWeight>(&["gamma-squared", "gamma"]))]
    vaf_weight: VafWeight,
    /// Stiffness of the force transducer's mount (N/m; N m/rad), whose give is then not taken for inertia
    #[arg(long, value_name = "K", value_parser = positive)]
    transducer_stiffness: Option<f64>,
    /// Damping of the same mount (N s/m; N m s/rad)
    #[arg(long, value_name = "B", default_value_t = 0.0, requires = "transducer_stiffness", value_parser = not_negative)]
    transducer_damping: f64,
    #[command(flatten)]
    limb: Limb,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    analysis: Analysis,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let kinematics = arguments.limb.read()?;
    let trials = arguments.reading.trials(&arguments.files)?;
    output::understood(shared, &trials);
    let settings = arguments.analysis.settings(shared);
    let estimated = ndof_study::estimate(&trials, &settings, "fit")?;
    let fit_settings = FitSettings {
        model: Some(arguments.model.clone()),
        band_hz: shared.band.map(|(low, high)| [low, high]),
        cost: arguments.cost,
        estimator: settings.estimator,
        kinematics,
        transducer: arguments.transducer_stiffness.map(|stiffness| Transducer { stiffness, damping: arguments.transducer_damping }),
        vaf_weight: arguments.vaf_weight,
        compare: arguments.compare,
        systematic: arguments.systematic,
        ..FitSettings::default()
    };
    let fitted = ndof_study::fit(&trials, &estimated, &fit_settings, "fit")?;
    if shared.report.is_some() || shared.plots.is_some() {
        output::report(shared, &ndof_study::fit_report(&trials, &estimated, &fitted, "Mechanical impedance", &output::command_line())?)?;
    }
    output::json(shared, &fitted.result)?;
    output::warnings(shared, &fitted.result.warnings);
    output::table(shared, &summary(&fitted.result, &compare(&fitted, None)))?;
    Ok(ExitCode::SUCCESS)
}

fn summary(result: &FitResult, parameters: &[ComparedParameter]) -> String {
    format!(
        "{} fitted to the {} estimate, {:.3} to {:.3} Hz; reduced chi² {}, R² {}, VAF {} %\n\n{}",
        result.model,
        result.estimate,
        result.band_hz[0],
        result.band_hz[1],
        short(result.chi2_reduced),
        short(result.r2),
        result.vaf.iter().map(|row| row.iter().map(|v| short(*v)).collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join("; "),
        parameter_table(parameters),
    ) + &comparison(&result.comparison)
}

/// Models side by side; nothing where there is nothing to compare with.
fn comparison(models: &[ComparedModel]) -> String {
    if models.is_empty() {
        return String::new();
    }
    let mut rows = vec![["model", "parameters", "chi²", "AIC", "BIC", "likelihood ratio", "p"].map(str::to_owned).to_vec()];
    for m in models {
        let ratio = m.likelihood_ratio.as_ref();
        rows.push(vec![
            m.model.clone(),
            m.parameters.to_string(),
            short(m.chi2),
            short(m.aic),
            short(m.bic),
            m.failed
                .clone()
                .or_else(|| ratio.map(|r| format!("{} on {} against {}", short(r.statistic), r.degrees_of_freedom, r.against)))
                .unwrap_or_else(|| "–".to_owned()),
            // Where no law is known, p is a guide.
            ratio.map_or_else(|| "–".to_owned(), |r| p_value(r.p_value) + if r.law == NullLaw::Unknown.name() { " (a guide)" } else { "" }),
        ]);
    }
    format!("\n{}", columns(&rows))
}

/// Parameters with intervals, and with the truth where it is known.
pub fn parameter_table(parameters: &[ComparedParameter]) -> String {
    let truth = parameters.iter().any(|p| p.truth.is_some());
    let mut rows = vec![vec!["".to_owned(), "unit".to_owned()]];
    if truth {
        rows[0].push("simulated".to_owned());
    }
    rows[0].extend(["estimate", "95 % interval", ""].map(str::to_owned));
    for p in parameters {
        let mut row = vec![p.name.clone(), p.unit.clone()];
        if truth {
            row.push(short(p.truth));
        }
        row.push(short(p.value));
        row.push(p.ci95.map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", short(Some(low)), short(Some(high)))));
        row.push(remark(p).to_owned());
        rows.push(row);
    }
    columns(&rows)
}

fn remark(p: &ComparedParameter) -> &'static str {
    match (p.identifiable, p.truth, p.ci95) {
        (false, _, _) => "not identifiable",
        (true, Some(truth), Some([low, high])) if !(low..=high).contains(&truth) => "outside",
        _ => "",
    }
}
