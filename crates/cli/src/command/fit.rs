//! `ndof fit`.

use crate::error::CliError;
use crate::options::{CycleOptions, Limb, Reading, Recordings, Shared};
use crate::output::{self, columns, headed, interval, p_value, short};
use clap::Args;
use ndof_analysis::fit::in_time::InTime;
use ndof_analysis::fit::result::{ComparedModel, FitResult};
use ndof_analysis::fit::schedule::result::ScheduleResult;
use ndof_analysis::result::word;
use ndof_analysis::{ComparedParameter, Estimate, Fit, Fitted};
use ndof_models::NullLaw;
use ndof_models::schedule::LEAST_PROBABILITY;
use ndof_study::file::StudyDocument;
use std::path::PathBuf;

/// Fit inertia, damping and stiffness to the frequency response, with intervals.
///
/// Several files are repeated trials of one experiment and are pooled. The derived estimate is fitted where there is a
/// commanded perturbation, else the direct one. --band sets the frequencies that are fitted. In place of recordings FILE may be a
/// frequency response: CSV, NPZ, Universal File 58 or Touchstone.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof fit trial-1.csv trial-2.csv --band 0.5-8 --kinematics arm.toml --json fit.json")]
pub struct Arguments {
    /// Recordings, or one frequency response; `-` is CSV on standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    fit: Fit,
    #[command(flatten)]
    cycles: CycleOptions,
    #[command(flatten)]
    limb: Limb,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten, next_help_heading = "Estimate")]
    estimate: Estimate,
    /// Write recordings and settings as a study: `ndof study OUT.toml` gives the same numbers
    #[arg(long, value_name = "OUT.toml", help_heading = "Output")]
    study: Option<PathBuf>,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let kinematics = arguments.limb.read()?;
    if let Some(measured) = arguments.reading.response(&arguments.files)? {
        if arguments.estimate != Estimate::default() {
            let what = format!("{} is a frequency response, and options of the estimate have no use for it; leave them out", measured.file);
            return Err(CliError::Usage(what));
        }
        if arguments.study.is_some() {
            return Err(CliError::Usage(format!("{} is a frequency response, and --study is about recordings; leave it out", measured.file)));
        }
        let fitted = measured.fit(&Fit { band_hz: shared.band, kinematics, ..arguments.fit.clone() })?;
        if shared.pictured() {
            output::report(shared, &ndof_report::response_fit_report(&measured, &fitted, "Mechanical impedance", &output::command_line())?)?;
        }
        return finish(shared, &fitted);
    }
    let trials = arguments.reading.trials_with(&arguments.files, &[arguments.fit.channels(), arguments.cycles.channels()].concat())?;
    output::understood(shared, &trials);
    let CycleOptions { cycle: cycle_s, cycle_by, .. } = arguments.cycles.clone();
    let event_s = arguments.cycles.times(&trials)?;
    let mut estimate = shared.estimate(&arguments.estimate);
    let mut fit = Fit { band_hz: shared.band, kinematics, ..arguments.fit.clone() };
    // Windows follow the cycle where windows are asked for, and matrices where a schedule is.
    if estimate.sliding_s.is_some() {
        (estimate.cycle_s, estimate.cycle_by, estimate.event_s) = (cycle_s, cycle_by.clone(), event_s.clone());
    }
    if estimate.sliding_s.is_none() || fit.schedule.is_some() {
        (fit.cycle_s, fit.cycle_by, fit.event_s) = (cycle_s, cycle_by, event_s);
    }
    let reported = shared.pictured();
    let estimated = if reported { ndof_analysis::estimate(&trials, &estimate)? } else { ndof_analysis::estimate_to_fit(&trials, &estimate, &fit)? };
    let fitted = fit.run(&estimated)?;
    if let Some(path) = &arguments.study {
        let experiment = Recordings { files: arguments.files.clone(), reading: arguments.reading.clone() };
        Recordings::write(StudyDocument { experiment, estimate, fit, ..StudyDocument::default() }, path)?;
    }
    if reported {
        output::report(shared, &ndof_report::fit_report(&estimated, &fitted, "Mechanical impedance", &output::command_line())?)?;
    }
    finish(shared, &fitted)
}

fn finish(shared: &Shared, fitted: &Fitted) -> Result<(), CliError> {
    output::told(shared, &fitted.result, &fitted.result.head.warnings, &summary(&fitted.result, &fitted.table(|_| None)))
}

fn summary(result: &FitResult, parameters: &[ComparedParameter]) -> String {
    format!(
        "{} fitted to the {}, {:.3} to {:.3} Hz; reduced chi² {}, R² {}, VAF {} %\n{}\n{}",
        result.model,
        if result.estimate == "file" { "response of the file".to_owned() } else { format!("{} estimate", result.estimate) },
        result.band_hz[0],
        result.band_hz[1],
        short(result.chi2_reduced),
        short(result.r2),
        result.vaf.outer_iter().map(|row| row.iter().map(|v| short(*v)).collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join("; "),
        result.remarks().iter().map(|remark| format!("{remark}\n")).collect::<String>(),
        parameter_table(parameters),
    ) + &comparison(&result.comparison)
        + &result.schedule.as_ref().map_or_else(String::new, over_schedule)
        + &result.in_time.as_ref().map_or_else(String::new, in_time)
}

/// Matrices and force laws of the fit in time, and how near their free run stays.
fn in_time(found: &InTime) -> String {
    let parameters: Vec<ComparedParameter> = found.parameters.iter().map(ComparedParameter::unknown).collect();
    let held = &found.held_out;
    let each = found.nrmse.iter().zip(held.nrmse.iter().zip(&held.nrmse_without_laws));
    let errors = found.outputs.iter().zip(each).map(|(output, (fitted, (with, without)))| vec![output.clone(), short(*fitted), short(*with), short(*without)]);
    format!(
        "\nin time, with {}, from {}\n{}\nerror of the free run over the output's standard deviation; held out: {}\n{}",
        found.laws.join(", "),
        found.imposed.join(", "),
        parameter_table(&parameters),
        held.what,
        headed(&["", "fitted", "held out", "held out, without the laws"], errors),
    )
}

/// Matrices that follow a schedule: what each entry is where, whether it varies, and what that explains.
pub fn over_schedule(found: &ScheduleResult) -> String {
    /// Places of the table, of a hundred.
    const EVERY: usize = 20;
    let places: Vec<usize> = (0..found.at.len()).step_by(EVERY).collect();
    let unit = if found.unit.is_empty() { String::new() } else { format!(" {}", found.unit) };
    let mut rows = vec![vec!["".to_owned(), "unit".to_owned()]];
    rows[0].extend(places.iter().map(|k| format!("at {}{unit}", short(found.at[*k]))));
    for entry in found.entries.iter().chain(&found.joint) {
        let value = |k: &usize| format!("{} ± {}", short(entry.value[*k]), short(0.5 * (entry.ci95[1][*k] - entry.ci95[0][*k])));
        let mut row = vec![entry.name.clone(), entry.unit.clone()];
        row.extend(if entry.varies { places.iter().map(value).collect() } else { vec![value(&0), "throughout".to_owned()] });
        rows.push(row);
        if let Some(truth) = &entry.truth {
            let simulated = |k: &usize| short(Some(truth[*k]));
            let holds = entry.holds().map_or_else(String::new, |share| format!("; {:.0} % held", 100.0 * share));
            rows.push(["", &format!("simulated{holds}")].map(str::to_owned).into_iter().chain(places.iter().map(simulated)).collect());
        }
    }
    let cycle = found.cycle_s.map_or_else(|| format!("{} pieces", found.blocks), |s| format!("{} cycles of {} s", found.blocks, short(s)));
    let how = if found.command_share.is_some() { "the commanded force as instrument" } else { "the motion as imposed" };
    let least = |p: f64| if p <= LEAST_PROBABILITY { format!("p < {LEAST_PROBABILITY:e}") } else { format!("p {}", short(p)) };
    let tests: Vec<String> =
        found.tests.iter().map(|test| format!("{} {}", word(&test.matrix), test.p_value.map_or_else(|| "p –".to_owned(), least))).collect();
    let held: Vec<String> = found
        .held_out
        .iter()
        .map(|h| format!("{}: {} % by constant matrices, {} % by varying ones\n", h.channel, short(h.constant_vaf), short(h.varying_vaf)))
        .collect();
    format!(
        "\nover {} (0 to {} Hz, {cycle}, {how})\n{}if constant: {}\nvariance accounted for of the deviation from the mean movement, held out:\n{}",
        found.label().to_lowercase(),
        short(found.high_hz),
        columns(&rows),
        tests.join(", "),
        held.concat()
    )
}

/// Models side by side; nothing where there is nothing to compare with.
fn comparison(models: &[ComparedModel]) -> String {
    if models.is_empty() {
        return String::new();
    }
    let rows = models.iter().map(|m| {
        let ratio = m.likelihood_ratio.as_ref();
        vec![
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
        ]
    });
    format!("\n{}", headed(&["model", "parameters", "chi²", "AIC", "BIC", "likelihood ratio", "p"], rows))
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
        row.push(interval(p.ci95));
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
