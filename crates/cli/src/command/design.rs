//! `ndof design`.

use super::simulate::write_recordings;
use crate::error::CliError;
use crate::options::{Shared, pair};
use crate::output::{self, columns, short};
use clap::Args;
use ndof_signal::{Channel, Quantity, Recording, SignalSize, Unit, ramp};
use ndof_study::command;
use ndof_study::file::Excitation;
use std::path::PathBuf;
use std::process::ExitCode;

/// Design the perturbation to command on a robot, as files with one channel cmd_… an axis.
///
/// Filtered noise is drawn from several seeds, and the one whose axes look least coherent is taken. Multisines of several
/// axes are orthogonal from trial to trial, so make as many trials as axes, or a multiple.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof design --kind filtered-noise --axes x,y --rms 4 --candidates 300 --trials 6 --out cmd.csv")]
pub struct Arguments {
    /// What it is made of
    #[arg(long, default_value = "filtered-noise", value_parser = clap::builder::PossibleValuesParser::new(Excitation::KINDS))]
    kind: String,
    /// Names of the axes
    #[arg(long, value_delimiter = ',', default_value = "x,y")]
    axes: Vec<String>,
    /// Torques in N m in place of forces in N
    #[arg(long)]
    rotational: bool,
    /// Files to make, each with a perturbation of its own
    #[arg(long, value_name = "N", default_value_t = 1)]
    trials: usize,
    /// Length of each
    #[arg(long, value_name = "S", default_value_t = 50.0)]
    duration: f64,
    /// Samples a second
    #[arg(long, value_name = "HZ", default_value_t = 500.0)]
    sample_rate: f64,
    /// Root mean square of each axis
    #[arg(long, default_value_t = 4.0)]
    rms: f64,
    /// Largest magnitude; what is larger is scaled down as a whole
    #[arg(long)]
    peak: Option<f64>,
    /// Corner of the noise's low-pass; reach of a binary sequence
    #[arg(long, value_name = "HZ", default_value_t = 15.0)]
    cutoff: f64,
    /// Order of the noise's low-pass
    #[arg(long, default_value_t = 8)]
    order: usize,
    /// Seeds tried for each trial of noise
    #[arg(long, value_name = "N", default_value_t = 100)]
    candidates: usize,
    /// Length of a period of multisine or binary sequence
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    period: f64,
    /// Lines of a multisine, ends of a sweep
    #[arg(long, value_name = "LO-HI", value_parser = pair, default_value = "0.3-12")]
    lines: (f64, f64),
    /// Time over which it fades in and out; periodic ones begin at full size
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    fade: f64,
    /// The file to write; several trials are NAME-1.EXT, NAME-2.EXT …
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    shared: Shared,
}

/// Refuses what would write a file of nothing.
fn possible(arguments: &Arguments) -> Result<(), CliError> {
    let nameless = arguments.axes.iter().any(|axis| axis.trim().is_empty());
    let wrong = [
        (arguments.trials == 0, "--trials 0: no file would be written; ask for at least 1".to_owned()),
        (arguments.candidates == 0, "--candidates 0: no seed would be tried; ask for at least 1".to_owned()),
        (nameless, "--axes: an axis has no name; write for example --axes x,y".to_owned()),
        (arguments.peak.is_some_and(|peak| peak <= 0.0), "--peak: the largest magnitude must be above zero".to_owned()),
        (
            !(0.0..=arguments.duration / 2.0).contains(&arguments.fade),
            format!("--fade {}: it must lie between 0 and half of the duration, {} s", arguments.fade, arguments.duration / 2.0),
        ),
    ];
    wrong.into_iter().find(|(wrong, _)| *wrong).map_or(Ok(()), |(_, message)| Err(CliError::Usage(message)))
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let shared = &arguments.shared;
    shared.apply_threads()?;
    let samples = (arguments.duration * arguments.sample_rate).round();
    if !(samples.is_finite() && samples >= 1.0) {
        return Err(CliError::Usage(format!(
            "--duration {} at --sample-rate {}: nothing to write; give positive numbers",
            arguments.duration, arguments.sample_rate
        )));
    }
    possible(arguments)?;
    let excitation = Excitation {
        kind: arguments.kind.clone(),
        rms: arguments.rms,
        cutoff_hz: arguments.cutoff,
        order: arguments.order,
        candidates: arguments.candidates,
        period_s: arguments.period,
        band_hz: [arguments.lines.0, arguments.lines.1],
        peak: arguments.peak,
    };
    let mut recordings = Vec::with_capacity(arguments.trials);
    let mut rows = vec![["", "seed", "rms", "peak", "crest", "coherence between axes"].map(str::to_owned).to_vec()];
    for trial in 0..arguments.trials {
        let mut designed = command(&excitation, arguments.axes.len(), samples as usize, arguments.sample_rate, shared.seed.unwrap_or(1), trial)?;
        designed.signals.iter_mut().for_each(|signal| ramp(signal, arguments.sample_rate, arguments.fade, arguments.fade));
        for (axis, signal) in arguments.axes.iter().zip(&designed.signals) {
            let size = SignalSize::of(signal, arguments.sample_rate);
            rows.push(vec![
                format!("trial {}, {axis}", trial + 1),
                designed.seed.to_string(),
                short(Some(size.rms)),
                short(Some(size.peak)),
                short(Some(size.peak / size.rms)),
                short(designed.coherence),
            ]);
        }
        let unit = Unit::si(Quantity::Effort, arguments.rotational);
        let channels = arguments.axes.iter().zip(designed.signals).map(|(axis, signal)| Channel::new(format!("cmd_{axis}"), unit.clone(), signal)).collect();
        recordings.push(Recording::new(arguments.sample_rate, channels).map_err(|error| CliError::Usage(error.to_string()))?);
    }
    let files = write_recordings(&arguments.out, &recordings)?;
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    output::table(shared, &format!("{}\n{}\n", columns(&rows), files.join("\n")))?;
    Ok(ExitCode::SUCCESS)
}
