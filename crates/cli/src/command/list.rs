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

const METHODS: &[(&str, &str, &str, &str)] = &[
    ("auto", "periodic where the excitation repeats, multitaper for usual records, welch for long ones", "", ""),
    (
        "welch",
        "averages over windowed, overlapping segments; nperseg, noverlap, nfft, window, detrend as in scipy.signal.csd",
        "S_ab = c / (K fs sum w^2) sum_k A_k B_k*",
        "P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70",
    ),
    (
        "multitaper",
        "averages over orthogonal tapers of the whole record; time-bandwidth",
        "S_ab = 1/K sum_k A_k B_k*, A_k = sum_n v_k(n) a(n) exp(-j w n)",
        "D. J. Thomson, Proc. IEEE 70 (1982) 1055",
    ),
    (
        "local-polynomial",
        "response and leakage as polynomials around each line of the whole record; order",
        "Y(k+r) = [G + sum_s g_s r^s] U(k+r) + sum_s t_s r^s + V(k+r)",
        "R. Pintelon and J. Schoukens, System Identification, 2nd ed. 2012, ch. 7",
    ),
    (
        "periodic",
        "averages over the periods of a periodic excitation, noise and nonlinear distortion told apart; period",
        "Z = 1/P sum_p Z_p",
        "R. Pintelon and J. Schoukens, System Identification, 2nd ed. 2012, ch. 4",
    ),
];

fn methods() -> String {
    METHODS
        .iter()
        .map(|(name, what, equation, source)| {
            [*name, what, equation, source].into_iter().filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n    ") + "\n\n"
        })
        .collect()
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
