//! The command line: parsing, meaning and doing, one file a subcommand.

mod command;
mod error;
mod options;
mod output;
mod progress;

use clap::{CommandFactory, Parser, Subcommand};
use error::CliError;
use std::ffi::OsString;
use std::process::ExitCode;

/// System identification of mechanical systems with any number of degrees of freedom.
#[derive(Debug, Parser)]
#[command(
    name = "ndof",
    version,
    about,
    max_term_width = 100,
    after_help = "Examples:\n  ndof study arm                                    the whole job on a simulated arm\n  ndof estimate trial*.csv --report out.html        frequency response of your recordings\n  ndof fit trial*.csv --kinematics arm.toml         inertia, damping and stiffness, also at the joints"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// The subcommands, in the order of a day's work.
#[derive(Debug, Subcommand)]
enum Command {
    Check(command::check::Arguments),
    Design(command::design::Arguments),
    Study(command::study::Arguments),
    Estimate(command::estimate::Arguments),
    Fit(command::fit::Arguments),
    Diagnose(command::diagnose::Arguments),
    Compare(command::compare::Arguments),
    Cohort(command::cohort::Arguments),
    Simulate(command::simulate::Arguments),
    Convert(command::convert::Arguments),
    List(command::list::Arguments),
    Schema(command::schema::Arguments),
    Completions(command::completions::Arguments),
}

/// Runs the program with these arguments (the first is its name) and returns its exit code; `studies` are the built-in
/// ones, name and text of the file.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>, studies: &[(&str, &str)]) -> ExitCode {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version go to standard output with code 0, everything else to standard error with code 2.
            let code = if error.use_stderr() { 2 } else { 0 };
            return match error.print() {
                Ok(()) => ExitCode::from(code),
                Err(source) => CliError::from(source).exit_code(),
            };
        }
    };
    let done = match cli.command {
        Command::Check(arguments) => command::check::run(&arguments),
        Command::Design(arguments) => command::design::run(&arguments, studies),
        Command::Compare(arguments) => command::compare::run(&arguments),
        Command::Cohort(arguments) => command::cohort::run(&arguments),
        Command::Completions(arguments) => command::completions::run(&arguments, Cli::command()),
        Command::Study(arguments) => command::study::run(&arguments, studies),
        Command::Diagnose(arguments) => command::diagnose::run(&arguments),
        Command::Fit(arguments) => command::fit::run(&arguments),
        Command::Simulate(arguments) => command::simulate::run(&arguments, studies),
        Command::List(arguments) => command::list::run(&arguments),
        Command::Estimate(arguments) => command::estimate::run(&arguments),
        Command::Convert(arguments) => command::convert::run(&arguments),
        Command::Schema(arguments) => command::schema::run(&arguments),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            if !matches!(error, CliError::BrokenPipe) {
                eprintln!("error: {error}");
            }
            error.exit_code()
        }
    }
}
