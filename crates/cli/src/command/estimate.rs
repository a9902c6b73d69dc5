//! `ndof estimate`.

use crate::error::CliError;
use crate::options::{CycleOptions, Reading, Shared};
use crate::output::{self, columns, headed, short};
use clap::Args;
use ndof_analysis::estimate::result::{EstimateResult, Response};
use ndof_analysis::result::word;
use ndof_analysis::{Estimate, Estimated, Streamed, log_spaced};
use ndof_io::{Piece, Pieces};
use std::path::PathBuf;

/// Estimate the frequency response of outputs to inputs, with coherences and confidence.
///
/// Several files are repeated trials of one experiment and are averaged. With a commanded perturbation (channels
/// cmd_…) the derived estimate, free of the bias that feedback makes, stands beside the direct one.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  ndof estimate trial-1.csv trial-2.csv --nperseg 2048 --nfft 8192 --band 0.25-10 --json estimate.json --report estimate.html"
)]
pub struct Arguments {
    /// Recordings; `-` is CSV on standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten, next_help_heading = "Estimate")]
    estimate: Estimate,
    #[command(flatten, next_help_heading = "Estimate")]
    cycles: CycleOptions,
    /// Read CSV or Parquet of any length piece by piece, in little memory; with Welch's method only
    #[arg(long, help_heading = "Estimate")]
    stream: bool,
    /// Write the response with its standard errors and coherences for other programs: CSV, NPZ, Universal File 58 or Touchstone by the suffix
    #[arg(long, value_name = "OUT", help_heading = "Output")]
    out: Option<PathBuf>,
    #[command(flatten)]
    shared: Shared,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    if let Some(out) = &arguments.out
        && let Some((other, _)) = [("--json", &shared.json), ("--report", &shared.report)].into_iter().find(|(_, path)| path.as_ref() == Some(out))
    {
        return Err(CliError::Usage(format!("{other} and --out both name {}; one would overwrite the other", out.display())));
    }
    let mut settings = shared.estimate(&arguments.estimate);
    (settings.cycle_s, settings.cycle_by) = (arguments.cycles.cycle, arguments.cycles.cycle_by.clone());
    arguments.files.iter().for_each(|file| ndof_io::keep(file));
    if arguments.stream {
        return finish(arguments, &streamed(arguments, settings)?);
    }
    let of_whole = shared.verbose || shared.pictured() || arguments.cycles.given();
    if !of_whole
        && let Some(file) = arguments.reading.in_file(&arguments.files)
        && let Some(estimated) = ndof_analysis::estimate_apart(&file.name, &file, &arguments.reading.roles(), &settings)
    {
        return finish(arguments, &estimated);
    }
    let trials = arguments.reading.trials_with(&arguments.files, &settings.channels())?;
    settings.event_s = arguments.cycles.times(&trials)?;
    output::understood(shared, &trials);
    let estimated = ndof_analysis::estimate(&trials, &settings)?;
    if shared.pictured() {
        output::report(shared, &ndof_report::estimate_report(&estimated, "Frequency response", &output::command_line())?)?;
    }
    finish(arguments, &estimated)
}

fn finish(arguments: &Arguments, estimated: &Estimated) -> Result<(), CliError> {
    let shared = &arguments.shared;
    if let Some(out) = &arguments.out {
        let notes = ndof_io::write_response(out, &estimated.response_table())?;
        output::warnings(shared, &notes);
    }
    output::told(shared, &estimated.result, &estimated.result.head.warnings, &summary(&estimated.result))
}

/// The estimate of files that are read piece by piece.
fn streamed(arguments: &Arguments, settings: Estimate) -> Result<Estimated, CliError> {
    let (reading, shared) = (&arguments.reading, &arguments.shared);
    let whole = [
        ("--robust", settings.robust),
        ("--sliding", settings.sliding_s.is_some()),
        ("--cycle, --cycle-by and --event", arguments.cycles.given()),
        ("--report", shared.report.is_some()),
        ("--plots", shared.plots.is_some()),
        ("--resample", reading.resample.is_some()),
        ("--align", !reading.align.is_empty()),
        ("--tare", reading.tare.is_some()),
        ("--handle-mass", reading.handle_mass.is_some()),
        ("--start, --stop and --exclude", reading.start.is_some() || reading.stop.is_some() || !reading.exclude.is_empty()),
    ];
    if let Some((option, _)) = whole.iter().find(|(_, asked)| *asked) {
        return Err(CliError::Usage(format!("{option} needs whole recordings, and --stream reads them piece by piece; leave one of the two out")));
    }
    let mut streamed = Streamed::new(reading.roles(), settings)?;
    for path in &arguments.files {
        let name = path.display().to_string();
        let mut pieces = Pieces::open(path, reading.channels.reading())?;
        let mut next = pieces.next();
        while let Some(piece) = next {
            let Piece { mut recording, follows, notes } = piece?;
            reading.channels.apply(&mut recording, &name)?;
            let (pushed, read) = rayon::join(|| streamed.push(&name, recording, follows, notes), || pieces.next());
            pushed?;
            next = read;
        }
    }
    Ok(streamed.finish()?)
}

/// The response at some frequencies, evenly spaced on a logarithmic axis.
fn summary(result: &EstimateResult) -> String {
    const ROWS: usize = 8;
    let m = &result.method;
    let (name, response, coherence) = match &result.derived {
        Some(derived) => ("derived", &derived.response, &derived.coherence_iv),
        None => ("direct", &result.direct.response, &result.direct.coherence),
    };
    let mut settings = vec![m.name.clone()];
    for (name, value) in [
        ("nperseg", m.nperseg),
        ("noverlap", m.noverlap),
        ("nfft", m.nfft),
        ("order", m.order),
        ("denominator", m.denominator),
        ("half width", m.half_width),
        ("period", m.period),
    ] {
        settings.extend(value.map(|value| format!("{name} {value}")));
    }
    settings.extend(m.time_bandwidth.map(|nw| format!("NW {nw}")));
    settings.extend(m.window.clone());
    let mut text = format!(
        "{} ({name}) of {} output(s) to {} input(s), {} trial(s) at {} Hz\n{}; {:.2} effective averages\n{}\n\n",
        word(&result.response),
        result.outputs.len(),
        result.inputs.len(),
        result.trials,
        result.sample_rate_hz,
        settings.join(", "),
        m.effective_averages,
        m.why,
    );
    let usable: Vec<usize> = (0..result.frequency_hz.len()).filter(|&f| result.frequency_hz[f] > 0.0 && response.re[[0, 0, f]].is_finite()).collect();
    let (gain, phase) = (response.gain(), response.phase_rad());
    for (i, output) in result.outputs.iter().enumerate() {
        for (j, input) in result.inputs.iter().enumerate() {
            let rows = log_spaced(&usable, &result.frequency_hz, ROWS).into_iter().map(|f| {
                let degrees = phase[[i, j, f]].to_degrees();
                vec![
                    short(result.frequency_hz[f]),
                    short(gain[[i, j, f]]),
                    short(half_width(response, [i, j, f])),
                    if degrees.is_finite() { format!("{degrees:.1}") } else { "–".to_owned() },
                    fraction(coherence.partial[[i, j, f]]),
                    // Where the response was inverted, rows are no longer the measured outputs.
                    fraction(coherence.multiple.get((i, f)).copied().unwrap_or(f64::NAN)),
                ]
            });
            text += &format!("{output} ← {input}\n{}\n", headed(&["Hz", "gain", "±95 %", "phase °", "partial γ²", "multiple γ²"], rows));
        }
    }
    text + &repetition(result)
}

/// Segments left out, trials beside each other, the course in time, lines that were not driven.
fn repetition(result: &EstimateResult) -> String {
    let mut text = String::new();
    if let Some(robust) = &result.robust {
        text += &format!("{} of {} segments left out\n", robust.rejected.len(), robust.segments);
        for r in &robust.rejected {
            text += &format!(
                "  trial {}, {:.2} to {:.2} s: residual {} robust σ, leverage {}\n",
                r.trial,
                r.start_s,
                r.end_s,
                short(r.residual),
                short(r.leverage)
            );
        }
    }
    if let Some(spread) = &result.trial_spread {
        text += &format!("spread between trials over spread within: {} (1 ± {} by chance)\n", fraction(spread.ratio), fraction(spread.ratio_std_error));
    }
    for d in result.distortion.iter().flat_map(|d| &d.detection) {
        let which = if d.even { "even" } else { "odd" };
        let levels: Vec<String> = d.level_db.iter().map(|level| level.map_or_else(|| "noise only".to_owned(), |db| format!("{db:.1} dB"))).collect();
        text += &format!("{} {which} lines not driven: {} of the driven ones, p = {}", d.lines, levels.join(", "), short(d.probability));
        if d.lambda_limb.is_some() || d.lambda_robot.is_some() {
            text += &format!("; λ_h = {}, λ_r = {}", fraction(d.lambda_limb), fraction(d.lambda_robot));
        }
        text.push('\n');
    }
    if let Some(course) = &result.course {
        let at = log_spaced(&course.known(), &course.frequency_hz, 4);
        let unit = if course.cycle_s.is_some() { "s of the cycle" } else { "s" };
        let header = std::iter::once(unit.to_owned()).chain(at.iter().map(|&f| format!("{} Hz", short(course.frequency_hz[f])))).collect();
        let cycles = course.cycles.map_or_else(String::new, |cycles| format!(" about each phase of {cycles} cycles"));
        text += &format!(
            "\n{} gain of {} ← {} in windows of {} s{cycles} ({})\n",
            course.estimate, result.outputs[0], result.inputs[0], course.window_s, course.method
        );
        let mut rows = vec![header];
        for (time_s, response) in course.time_s.iter().zip(&course.response) {
            let gain = response.gain();
            let cell = |f: usize| format!("{} ± {}", short(gain[[0, 0, f]]), short(half_width(response, [0, 0, f])));
            rows.push(std::iter::once(short(*time_s)).chain(at.iter().map(|&f| cell(f))).collect());
        }
        text += &columns(&rows);
    }
    text
}

/// Half of the gain's 95 % interval.
fn half_width(response: &Response, [i, j, f]: [usize; 3]) -> f64 {
    (response.gain_ci95[[i, j, f, 1]] - response.gain_ci95[[i, j, f, 0]]) / 2.0
}

/// A number between 0 and 1, or about 1.
pub fn fraction(value: impl Into<Option<f64>>) -> String {
    value.into().filter(|value| value.is_finite()).map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"))
}
