//! Where results go: JSON to a file or standard output, tables to people.

use crate::error::CliError;
use crate::flags::as_flags;
use crate::options::Shared;
use ndof_analysis::Trials;
use ndof_analysis::result::{self, Warning};
use ndof_report::Report;
use serde::Serialize;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes the result where `--json` says.
pub fn json(shared: &Shared, result: &impl Serialize) -> Result<(), CliError> {
    let Some(path) = &shared.json else { return Ok(()) };
    write_json(path, result)
}

/// Writes a result as JSON to `path`, or to standard output for `-`.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), CliError> {
    if path.as_os_str() == "-" {
        let mut stdout = BufWriter::new(std::io::stdout().lock());
        result::write_json(value, &mut stdout)?;
        stdout.flush()?;
    } else {
        ndof_io::write_atomic_with(path, |to| result::write_json(value, to))?;
    }
    Ok(())
}

/// Writes page and pictures where `--report` and `--plots` say.
pub fn report(shared: &Shared, report: &Report) -> Result<(), CliError> {
    let report = &with_flags(report.clone());
    if let Some(path) = &shared.report {
        ndof_io::write_atomic(path, report.to_html().as_bytes())?;
    }
    match &shared.plots {
        Some(folder) => write_plots(folder, report),
        None => Ok(()),
    }
}

/// The page with the arguments that its warnings name as flags.
pub fn with_flags(mut report: Report) -> Report {
    for warning in &mut report.warnings {
        (warning.message, warning.action) = (as_flags(&warning.message), as_flags(&warning.action));
    }
    report
}

/// Writes every picture of a report as SVG and CSV into `folder`.
pub fn write_plots(folder: &Path, report: &Report) -> Result<(), CliError> {
    create_folder(folder)?;
    for file in report.plot_files() {
        ndof_io::write_atomic(&folder.join(&file.name), file.contents.as_bytes())?;
    }
    Ok(())
}

/// Creates a folder and those above it.
pub fn create_folder(folder: &Path) -> Result<(), CliError> {
    if folder.as_os_str().is_empty() {
        return Ok(());
    }
    std::fs::create_dir_all(folder).map_err(|source| CliError::Machine { what: format!("creating the folder {}", folder.display()), source })
}

/// The command as it was typed, for the report.
pub fn command_line() -> String {
    let rest: Vec<String> = std::env::args().skip(1).map(|word| if word.contains(' ') { format!("\"{word}\"") } else { word }).collect();
    format!("ndof {}", rest.join(" "))
}

/// Prints `text` for people, unless JSON goes there or nothing should be said.
pub fn table(shared: &Shared, text: &str) -> Result<(), CliError> {
    if shared.quiet || shared.json_on_stdout() { Ok(()) } else { print(text.as_bytes()) }
}

/// Prints `text` on standard output.
pub fn print(text: &[u8]) -> Result<(), CliError> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text)?;
    Ok(stdout.flush()?)
}

/// What every analysis ends with: its result as JSON, its warnings, and `text` for people.
pub fn told(shared: &Shared, result: &impl Serialize, warned: &[Warning], text: &str) -> Result<(), CliError> {
    json(shared, result)?;
    warnings(shared, warned);
    table(shared, text)
}

/// Says on standard error what was read and how it was understood, for those who asked for more.
pub fn understood(shared: &Shared, trials: &Trials) {
    if !shared.verbose {
        return;
    }
    for trial in trials.trials.iter() {
        eprintln!("read {}: {}", trial.file, trial.recording);
    }
    let ports = &trials.roles.ports;
    for (role, channels) in [("references", &ports.references), ("inputs", &ports.inputs), ("outputs", &ports.outputs)] {
        eprintln!("{role}: {}", if channels.is_empty() { "none".to_owned() } else { trials.names(channels).join(", ") });
    }
}

/// Prints warnings on standard error.
pub fn warnings(shared: &Shared, warnings: &[Warning]) {
    if !shared.quiet {
        for warning in warnings {
            eprintln!("warning[{}]: {}", warning.code, as_flags(&format!("{}; {}", warning.message, warning.action)));
        }
    }
}

/// Lines of columns, each as wide as its widest cell; the first column to the left, the others to the right.
pub fn columns(rows: &[Vec<String>]) -> String {
    let widths: Vec<usize> = (0..rows.iter().map(Vec::len).max().unwrap_or(0))
        .map(|c| rows.iter().filter_map(|row| row.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (c, (cell, &width)) in row.iter().zip(&widths).enumerate() {
            let pad = " ".repeat(width.saturating_sub(cell.chars().count()));
            line += &if c == 0 { format!("{cell}{pad}") } else { format!("  {pad}{cell}") };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// The same under a head.
pub fn headed(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let head = head.iter().map(|cell| (*cell).to_owned()).collect();
    columns(&std::iter::once(head).chain(rows).collect::<Vec<_>>())
}

/// A number with four significant digits, a dash where there is none.
pub fn short(value: impl Into<Option<f64>>) -> String {
    match value.into().filter(|value| value.is_finite()) {
        None => "–".to_owned(),
        Some(0.0) => "0".to_owned(),
        Some(value) if (1e-3..1e5).contains(&value.abs()) => {
            let digits = (3 - value.abs().log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        Some(value) => format!("{value:.3e}"),
    }
}

/// "282.9 … 292.4".
pub fn interval(ends: Option<[f64; 2]>) -> String {
    ends.map_or_else(|| "–".to_owned(), |[low, high]| format!("{} … {}", short(low), short(high)))
}

/// A probability; one that is too small to be written is said to be below the least number.
pub fn p_value(value: impl Into<Option<f64>>) -> String {
    let value = value.into();
    if value == Some(0.0) { "< 1e-300".to_owned() } else { short(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people_have_four_digits() {
        assert_eq!(
            [short(Some(1.23456)), short(Some(-0.0123456)), short(Some(1234.56)), short(Some(1.5e-7)), short(None)],
            ["1.235", "-0.01235", "1235", "1.500e-7", "–"]
        );
    }
}
