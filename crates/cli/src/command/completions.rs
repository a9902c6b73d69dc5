//! `ndof completions`.

use crate::error::CliError;
use clap::Args;
use clap_complete::Shell;
use std::io::Write;
use std::process::ExitCode;

/// Print completions for a shell, or the man page.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof completions bash > ~/.local/share/bash-completion/completions/ndof")]
pub struct Arguments {
    /// bash, elvish, fish, powershell or zsh; `man` for the man page
    shell: String,
}

pub fn run(arguments: &Arguments, mut program: clap::Command) -> Result<ExitCode, CliError> {
    let mut text = Vec::new();
    if arguments.shell == "man" {
        clap_mangen::Man::new(program).render(&mut text)?;
    } else {
        let shell: Shell = arguments
            .shell
            .parse()
            .map_err(|_| CliError::Usage(format!("no shell \"{}\"; there are bash, elvish, fish, powershell, zsh, and man", arguments.shell)))?;
        clap_complete::generate(shell, &mut program, "ndof", &mut text);
    }
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(&text)?;
    stdout.flush()?;
    Ok(ExitCode::SUCCESS)
}
