//! Options of every analysis: where results go, how loud, how many threads.

use crate::error::CliError;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args};
use ndof_analysis::Estimate;
use ndof_analysis::options::{count, pair, whole};
use std::path::PathBuf;

/// Options of every analysis.
#[derive(Clone, Debug, Args)]
pub struct Shared {
    /// Write the result as JSON to OUT; `-` is standard output
    #[arg(long, value_name = "OUT", help_heading = "Output")]
    pub json: Option<PathBuf>,
    /// Write one self-contained HTML page to OUT
    #[arg(long, value_name = "OUT", help_heading = "Output")]
    pub report: Option<PathBuf>,
    /// Write each picture as SVG, with its numbers as CSV, into DIR
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub plots: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(long, short, conflicts_with = "verbose", help_heading = "Output")]
    pub quiet: bool,
    /// Say what was read, and the role of each channel
    #[arg(long, short, help_heading = "Output")]
    pub verbose: bool,
    /// Seed of all random numbers; the same seed gives the same bytes [default: 1, or the experiment's own]
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    pub seed: Option<u64>,
    /// Number of threads; results do not depend on it [default: all processors]
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Frequencies to report, in Hz
    #[arg(long, value_name = "LO-HI", value_parser = pair, allow_hyphen_values = true)]
    pub band: Option<[f64; 2]>,
}

/// A number of threads that a machine can start.
fn threads(text: &str) -> Result<usize, String> {
    const MOST: usize = 1024;
    count(text).and_then(|threads| if threads <= MOST { Ok(threads) } else { Err(format!("write a whole number of at most {MOST}")) })
}

/// Options that a command has in common with others and does not use, by their long names; its help does not show them.
pub fn unused(command: &str) -> &'static [&'static str] {
    match command {
        "check" => &["report", "plots", "band"],
        "simulate" => &["json", "report", "plots", "band"],
        "convert" => &["input", "output", "reference"],
        "live" => &["report", "plots", "sliding", "sliding-step"],
        "study" => &["band"],
        "fit" => &["sliding", "sliding-step"],
        "cohort" => &["json", "report", "plots", "sliding", "sliding-step", "compare", "schedule", "varying", "knots"],
        _ => &[],
    }
}

/// Refuses what the command has no use for: an option that is given and does nothing would mislead.
pub fn refuse_unused(matches: &ArgMatches) -> Result<(), CliError> {
    let Some((command, given)) = matches.subcommand() else { return Ok(()) };
    let asked = |name: &&&str| {
        let id = name.replace('-', "_");
        [id.clone(), id + "_s"].iter().any(|id| given.try_contains_id(id).is_ok() && given.value_source(id) == Some(ValueSource::CommandLine))
    };
    match unused(command).iter().find(asked) {
        Some(name) => Err(CliError::Usage(format!("`ndof {command}` has no use for --{name}; leave it out (`ndof {command} --help` lists what there is)"))),
        None => Ok(()),
    }
}

impl Shared {
    /// What is asked of an estimate, with the band.
    pub fn estimate(&self, asked: &Estimate) -> Estimate {
        Estimate { band_hz: self.band, ..asked.clone() }
    }

    /// Refuses results that would lie in one place, and a page on standard output.
    pub fn targets(&self) -> Result<(), CliError> {
        let targets = [("--json", &self.json), ("--report", &self.report), ("--plots", &self.plots)];
        for (k, (name, target)) in targets.iter().enumerate() {
            let Some(path) = target else { continue };
            if *name != "--json" && path.as_os_str() == "-" {
                return Err(CliError::Usage(format!("{name} -: only --json goes to standard output; name a file")));
            }
            if let Some((other, _)) = targets[..k].iter().find(|(_, other)| other.as_ref() == Some(path)) {
                return Err(CliError::Usage(format!("{other} and {name} both name {}; one would overwrite the other", path.display())));
            }
        }
        match &self.plots {
            Some(path) if path.is_file() => Err(CliError::Usage(format!("--plots {}: this is a file; name a folder", path.display()))),
            _ => Ok(()),
        }
    }

    /// Whether a page or its pictures are asked for.
    pub fn pictured(&self) -> bool {
        self.report.is_some() || self.plots.is_some()
    }

    /// Whether JSON takes the place of the table on standard output.
    pub fn json_on_stdout(&self) -> bool {
        self.json.as_ref().is_some_and(|path| path.as_os_str() == "-")
    }

    /// Sets the number of threads.
    pub fn apply_threads(&self) -> Result<(), CliError> {
        self.targets()?;
        match self.threads {
            None => Ok(()),
            Some(threads) => rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build_global()
                .map_err(|error| CliError::Usage(format!("--threads {threads}: {error}; ask for fewer"))),
        }
    }
}
