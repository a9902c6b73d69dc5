//! `ndof list`.

use crate::error::CliError;
use crate::output::columns;
use clap::{Args, ValueEnum};
use ndof_devices::{DEVICES, LIMBS};
use ndof_models::effects::EFFECTS;
use std::io::Write;
use std::process::ExitCode;

/// Print what there is, with unit, equation and reference.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof list effects")]
pub struct Arguments {
    /// Of what
    #[arg(value_enum)]
    what: Registry,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Registry {
    /// Causes that data may hide
    Effects,
    /// Robots and limbs
    Devices,
    /// Parametric models
    Models,
    /// Spectral methods
    Methods,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, CliError> {
    let text = match arguments.what {
        Registry::Effects => effects(),
        Registry::Devices => devices(),
        Registry::Models => {
            format!("{}\n    M s^2 + B s + K = F/d, one matrix entry a parameter; weighted least squares or the paper's cost\n", ndof_study::MODEL)
        }
        Registry::Methods => methods(),
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(ExitCode::SUCCESS)
}

fn methods() -> String {
    "welch\n    averages over windowed, overlapping segments; nperseg, noverlap, nfft, window, detrend as in scipy.signal.csd\n    P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70\n".to_owned()
}

fn effects() -> String {
    let mut text = String::new();
    for effect in EFFECTS {
        let card = effect.card();
        text += &format!("{}\n    {}\n    {}\n", card.name, card.what, card.equation);
        let rows: Vec<Vec<String>> = card
            .parameters
            .iter()
            .map(|p| vec![format!("    {}", p.name), p.unit.to_owned(), p.default.map_or_else(String::new, |d| format!("default {d}"))])
            .collect();
        text += &columns(&rows);
        text += &format!("    {}\n\n", card.source);
    }
    text
}

fn devices() -> String {
    let number = |value: f64| if value.is_nan() { "–".to_owned() } else { value.to_string() };
    let mut text = String::new();
    for (name, description, parameters, source) in
        DEVICES.iter().map(|d| (d.name, d.description, d.parameters, d.source)).chain(LIMBS.iter().map(|l| (l.name, l.description, l.parameters, l.source)))
    {
        text += &format!("{name}\n    {description}\n");
        text += &columns(
            &parameters.iter().map(|p| vec![format!("    {}", p.name), number(p.default), p.unit.to_owned(), p.description.to_owned()]).collect::<Vec<_>>(),
        );
        text += &if source.is_empty() { "\n".to_owned() } else { format!("    {source}\n\n") };
    }
    text
}
