//! `ndof completions`.

use crate::error::CliError;
use clap::Args;
use clap_complete::Shell;
use ndof_analysis::{did_you_mean, nearest};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Print completions for a shell, the man pages, or the reference of the command line.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof completions bash > ndof.bash")]
pub struct Arguments {
    /// bash, elvish, fish, powershell or zsh; `man` for man pages, `markdown` for a page of a book
    shell: String,
    /// With `man`: write one page a command into DIR
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn run(arguments: &Arguments, mut program: clap::Command) -> Result<(), CliError> {
    let mut text = Vec::new();
    match (arguments.shell.as_str(), &arguments.out) {
        ("man", Some(folder)) => {
            crate::output::create_folder(folder)?;
            program.build();
            for command in std::iter::once(&program).chain(program.get_subcommands().filter(|command| command.get_name() != "help")) {
                let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
                let mut page = Vec::new();
                clap_mangen::Man::new(command.clone()).render(&mut page)?;
                ndof_io::write_atomic(&folder.join(format!("{name}.1")), &page)?;
            }
        }
        ("man", None) => clap_mangen::Man::new(program).render(&mut text)?,
        (other, Some(_)) => return Err(CliError::Usage(format!("--out goes with `man` only; write `ndof completions {other} > FILE`"))),
        ("markdown", None) => text = markdown(program).into_bytes(),
        (name, None) => {
            let shell: Shell = name.parse().map_err(|_| {
                let known = ["bash", "elvish", "fish", "powershell", "zsh", "man", "markdown"];
                let suggestion = did_you_mean(nearest(name, known).as_deref());
                CliError::Usage(format!("no shell \"{name}\"{suggestion}; there are {}", known.join(", ")))
            })?;
            clap_complete::generate(shell, &mut program, "ndof", &mut text);
        }
    }
    crate::output::print(&text)
}

/// One section a command: what it does, its example, its arguments and options; options that many share stand once.
fn markdown(mut program: clap::Command) -> String {
    program.build();
    let commands: Vec<&clap::Command> = program.get_subcommands().filter(|command| command.get_name() != "help").collect();
    let shared = ["Recordings", "Estimate", "Limb", "Output"];
    let mut text = String::new();
    for command in &commands {
        let _ = write!(text, "## {}\n\n{}\n", command.get_name(), words(command.get_long_about().or(command.get_about())));
        if let Some(example) = command.get_after_help() {
            let example = example.to_string();
            let lines: Vec<&str> = example.lines().skip(1).map(str::trim).collect();
            let _ = write!(text, "\n```sh\n{}\n```\n", lines.join("\n"));
        }
        let own: Vec<&clap::Arg> = visible(command).filter(|argument| argument.get_help_heading().is_none_or(|heading| !shared.contains(&heading))).collect();
        text += &table(&own);
        let groups: Vec<String> = shared
            .iter()
            .filter(|heading| under(command, heading).next().is_some())
            .map(|heading| {
                let own: Vec<&str> = under(command, heading).filter_map(clap::Arg::get_long).collect();
                let mut others: Vec<&str> = Vec::new();
                for name in commands.iter().flat_map(|command| under(command, heading)).filter_map(clap::Arg::get_long) {
                    if !own.contains(&name) && !others.contains(&name) {
                        others.push(name);
                    }
                }
                let but = if others.is_empty() { String::new() } else { format!(" (but `--{}`)", others.join("`, `--")) };
                format!("[{heading}](#options-{}){but}", heading.to_lowercase())
            })
            .collect();
        if !groups.is_empty() {
            let _ = write!(text, "\nAnd the options of {}.\n", groups.join(", "));
        }
        text.push('\n');
    }
    for heading in shared {
        let mut options: Vec<&clap::Arg> = Vec::new();
        for argument in commands.iter().flat_map(|command| under(command, heading)) {
            if !options.iter().any(|known| known.get_id() == argument.get_id()) {
                options.push(argument);
            }
        }
        let _ = writeln!(text, "## Options: {heading}\n{}", table(&options));
    }
    text.trim_end().to_owned() + "\n"
}

fn under<'c>(command: &'c clap::Command, heading: &'c str) -> impl Iterator<Item = &'c clap::Arg> {
    visible(command).filter(move |argument| argument.get_help_heading() == Some(heading))
}

fn visible(command: &clap::Command) -> impl Iterator<Item = &clap::Arg> {
    command.get_arguments().filter(|argument| !argument.is_hide_set() && argument.get_id() != "help")
}

/// Paragraphs without the line breaks of a terminal.
fn words(text: Option<&clap::builder::StyledStr>) -> String {
    text.map(ToString::to_string).unwrap_or_default()
}

fn table(arguments: &[&clap::Arg]) -> String {
    if arguments.is_empty() {
        return String::new();
    }
    let mut text = "\n| option | what it does |\n|---|---|\n".to_owned();
    for argument in arguments {
        let values = argument.get_value_names().map(|names| names.iter().map(|name| name.to_string()).collect::<Vec<_>>().join(" ")).unwrap_or_default();
        let takes = argument.get_num_args().is_some_and(|range| range.takes_values());
        let may = argument.get_num_args().is_some_and(|range| range.min_values() == 0) && argument.is_require_equals_set();
        let name = match argument.get_long() {
            Some(long) if takes && may => format!("--{long}[={values}]"),
            Some(long) if takes => format!("--{long} {values}"),
            Some(long) => format!("--{long}"),
            None => values,
        };
        let mut help = words(argument.get_help()).replace('\n', " ");
        let possible: Vec<String> = argument.get_possible_values().iter().map(|value| format!("`{}`", value.get_name())).collect();
        if takes && !possible.is_empty() {
            let _ = write!(help, ": {}", possible.join(", "));
        }
        let defaults: Vec<String> = argument.get_default_values().iter().map(|value| format!("`{}`", value.to_string_lossy())).collect();
        if takes && !defaults.is_empty() {
            let _ = write!(help, " (default {})", defaults.join(", "));
        }
        let _ = writeln!(text, "| `{}` | {} |", name.replace('|', "\\|"), help.replace('|', "\\|"));
    }
    text
}
