//! The command line: parsing, meaning and doing, one file a subcommand.

mod command;
mod error;
mod flags;
mod interrupt;
mod options;
mod output;
mod progress;
mod source;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use error::CliError;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// System identification of mechanical systems with any number of degrees of freedom.
#[derive(Debug, Parser)]
#[command(
    name = "ndof",
    version,
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
    Design(Box<command::design::Arguments>),
    Study(command::study::Arguments),
    Estimate(Box<command::estimate::Arguments>),
    Fit(Box<command::fit::Arguments>),
    Diagnose(Box<command::diagnose::Arguments>),
    Live(command::live::Arguments),
    Compare(command::compare::Arguments),
    Cohort(Box<command::cohort::Arguments>),
    Simulate(command::simulate::Arguments),
    Convert(command::convert::Arguments),
    List(command::list::Arguments),
    #[cfg(not(target_family = "wasm"))]
    Schema(command::schema::Arguments),
    #[cfg(not(target_family = "wasm"))]
    Completions(command::completions::Arguments),
}

/// The definition of the command line; a negative number is a value, so that what is wrong with it can be said.
fn definition() -> clap::Command {
    Cli::command().mut_subcommands(|command| {
        let unused = options::unused(command.get_name());
        command.mut_args(|argument| {
            let argument = if argument.get_long().is_some_and(|name| unused.contains(&name)) { argument.hide(true) } else { argument };
            if argument.is_positional() || !argument.get_action().takes_values() { argument } else { argument.allow_negative_numbers(true) }
        })
    })
}

/// Runs the program with these arguments (the first is its name) and returns its exit code; `studies` are the built-in
/// ones, name and text of the file.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>, studies: &[(&str, &str)]) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    // The definition of all subcommands would take most of the time.
    if let [_, only] = arguments.as_slice()
        && (only == "--version" || only == "-V")
    {
        return match writeln!(std::io::stdout(), "ndof {}", env!("CARGO_PKG_VERSION")) {
            Ok(()) => ExitCode::SUCCESS,
            Err(source) => CliError::from(source).exit_code(),
        };
    }
    let definition = definition();
    flags::know(&definition);
    let parsed = definition.clone().try_get_matches_from(arguments).and_then(|matches| Ok((Cli::from_arg_matches(&matches)?, matches)));
    let (cli, matches) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            // Help and version go to standard output with code 0, everything else to standard error with code 2.
            let code = if error.use_stderr() { 2 } else { 0 };
            return match error.print() {
                Ok(()) => ExitCode::from(code),
                Err(source) => CliError::from(source).exit_code(),
            };
        }
    };
    let success = |()| ExitCode::SUCCESS;
    let done = options::refuse_unused(&matches).and_then(|()| interrupt::listen()).and_then(|()| match cli.command {
        Command::Check(arguments) => command::check::run(&arguments),
        Command::Design(arguments) => command::design::run(&arguments, studies).map(success),
        Command::Live(arguments) => command::live::run(&arguments),
        Command::Compare(arguments) => command::compare::run(&arguments).map(success),
        Command::Cohort(arguments) => command::cohort::run(&arguments).map(success),
        #[cfg(not(target_family = "wasm"))]
        Command::Completions(arguments) => command::completions::run(&arguments, definition).map(success),
        Command::Study(arguments) => command::study::run(&arguments, studies).map(success),
        Command::Diagnose(arguments) => command::diagnose::run(&arguments),
        Command::Fit(arguments) => command::fit::run(&arguments).map(success),
        Command::Simulate(arguments) => command::simulate::run(&arguments, studies).map(success),
        Command::List(arguments) => command::list::run(&arguments).map(success),
        Command::Estimate(arguments) => command::estimate::run(&arguments).map(success),
        Command::Convert(arguments) => command::convert::run(&arguments).map(success),
        #[cfg(not(target_family = "wasm"))]
        Command::Schema(arguments) => command::schema::run(&arguments).map(success),
    });
    match done {
        Ok(code) => code,
        Err(error) => {
            if !matches!(error, CliError::BrokenPipe) {
                eprintln!("error: {}", flags::as_flags(&error.to_string()));
            }
            error.exit_code()
        }
    }
}

#[cfg(test)]
mod tests {
    /// Names that two options share, defaults that do not parse and the like, which a release build does not look for.
    #[test]
    fn the_definition_of_the_command_line_is_consistent() {
        super::definition().debug_assert();
    }
}
