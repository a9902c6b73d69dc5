//! `ndof list`.

use crate::error::CliError;
use crate::output::{self, columns};
use clap::{Args, ValueEnum};
use ndof_devices::{DEVICES, LIMBS};
use ndof_joints::CAUSES;
use ndof_models::blocks::{BLOCKS, BlockCard, BlockParameter};
use ndof_models::effects::EFFECTS;
use ndof_models::time::{Law, laws};
use ndof_report::capitalised;
use std::fmt::Write as _;

/// Print what there is, with unit, equation and reference.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof list effects")]
pub struct Arguments {
    /// What to list
    #[arg(value_enum)]
    what: Registry,
    /// For a terminal, or as a page of a book
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Registry {
    /// Causes that data may hide
    Effects,
    /// Causes that the log of a robot's joints may hide
    Joints,
    /// Robots and limbs
    Devices,
    /// Force laws of a fit in time
    Laws,
    /// Parametric models
    Models,
    /// Spectral methods
    Methods,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    Text,
    Markdown,
}

/// One member of a registry, ready to be printed.
#[derive(Default)]
struct Entry {
    name: &'static str,
    what: String,
    equation: &'static str,
    /// Of the parameters' table.
    header: &'static [&'static str],
    rows: Vec<Vec<String>>,
    /// What else is known: a word and its text.
    remarks: Vec<(&'static str, String)>,
    source: &'static str,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let entries = match arguments.what {
        Registry::Effects => effects(),
        Registry::Joints => joints(),
        Registry::Devices => devices(),
        Registry::Laws => laws::all().iter().map(|law| law_entry(law.as_ref())).collect(),
        Registry::Models => models(),
        Registry::Methods => methods(),
    };
    let text: String = match arguments.format {
        Format::Text => entries.iter().map(as_text).collect(),
        Format::Markdown => entries.iter().map(as_markdown).collect::<Vec<_>>().join("\n"),
    };
    output::print(text.as_bytes())
}

fn models() -> Vec<Entry> {
    let baseline = Entry {
        name: ndof_analysis::MODEL,
        what: "one matrix entry a parameter; weighted least squares or the paper's cost".to_owned(),
        equation: "M s^2 + B s + K = F/d",
        ..Entry::default()
    };
    let block = |card: &BlockCard| Entry {
        name: card.name(),
        what: format!("{}; `--model {}+{}`", card.what, ndof_analysis::MODEL, card.name()),
        equation: card.equation,
        header: BOUNDED,
        rows: bounded((card.block)().parameters(false)),
        source: card.source,
        ..Entry::default()
    };
    std::iter::once(baseline).chain(BLOCKS.iter().map(block)).collect()
}

fn law_entry(law: &dyn Law) -> Entry {
    Entry {
        name: law.name(),
        what: format!("`--law {0}`, or `--law {0}:x` on one axis", law.name()),
        equation: law.equation(),
        header: BOUNDED,
        rows: bounded(law.parameters(false)),
        source: law.source(),
        ..Entry::default()
    }
}

const BOUNDED: &[&str] = &["parameter", "unit", "from", "to"];

fn bounded(parameters: Vec<BlockParameter>) -> Vec<Vec<String>> {
    parameters.into_iter().map(|p| vec![p.name, p.unit, p.lower.to_string(), p.upper.to_string()]).collect()
}

fn as_text(entry: &Entry) -> String {
    let mut text = format!("{}\n    {}\n", entry.name, entry.what.replace('`', ""));
    if !entry.equation.is_empty() {
        let _ = writeln!(text, "    {}", entry.equation);
    }
    let rows: Vec<Vec<String>> =
        entry.rows.iter().map(|row| row.iter().enumerate().map(|(k, cell)| if k == 0 { format!("    {cell}") } else { cell.clone() }).collect()).collect();
    text += &columns(&rows);
    if !entry.source.is_empty() {
        let _ = writeln!(text, "    {}", entry.source);
    }
    text + "\n"
}

fn as_markdown(entry: &Entry) -> String {
    let mut text = format!("## {}\n\n{}.\n", entry.name, capitalised(entry.what.trim_end_matches('.')));
    if !entry.equation.is_empty() {
        let _ = write!(text, "\n```text\n{}\n```\n", entry.equation);
    }
    if !entry.rows.is_empty() {
        let line = |cells: &[String]| format!("| {} |\n", cells.iter().map(|cell| cell.replace('|', "\\|")).collect::<Vec<_>>().join(" | "));
        let header: Vec<String> = entry.header.iter().map(|&word| word.to_owned()).collect();
        let _ = write!(text, "\n{}|{}\n", line(&header), "---|".repeat(header.len()));
        text.extend(entry.rows.iter().map(|row| line(row)));
    }
    for (word, remark) in &entry.remarks {
        let _ = write!(text, "\n**{word}:** {remark}.\n");
    }
    if !entry.source.is_empty() {
        let _ = write!(text, "\n*Source:* {}.\n", entry.source.trim_end_matches('.'));
    }
    text
}

const METHODS: &[(&str, &str, &str, &str)] = &[
    ("auto", "periodic where the excitation repeats, local-polynomial for usual records, welch for long ones and where its settings are given", "", ""),
    (
        "welch",
        "averages over windowed, overlapping segments; nperseg, noverlap, nfft, window, detrend as in scipy.signal.csd",
        "S_ab = c / (K fs sum w^2) sum_k A_k B_k*",
        "P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70",
    ),
    (
        "multitaper",
        "averages over orthogonal tapers of the whole record; time-bandwidth, tapers, adaptive",
        "S_ab = 1/K sum_k A_k B_k*, A_k = sum_n v_k(n) a(n) exp(-j w n)",
        "D. J. Thomson, Proc. IEEE 70 (1982) 1055",
    ),
    (
        "local-polynomial",
        "response and leakage as polynomials around each line of the whole record; order, half-width, leave-one-out",
        "Y(k+r) = [G + sum_s g_s r^s] U(k+r) + sum_s t_s r^s + V(k+r)",
        "R. Pintelon and J. Schoukens, System Identification, 2nd ed. 2012, ch. 7",
    ),
    (
        "local-rational",
        "the same with a denominator common to all outputs and inputs, for resonances a few lines wide; order, denominator, half-width",
        "Y(k+r) = [N(r) U(k+r) + T(r)] / D(r) + V(k+r), D(r) = 1 + sum_s d_s r^s",
        "T. McKelvey and G. Guerin, IFAC SYSID 2012",
    ),
    (
        "periodic",
        "averages over the periods of a periodic excitation, noise and nonlinear distortion told apart; period",
        "Z = 1/P sum_p Z_p",
        "R. Pintelon and J. Schoukens, System Identification, 2nd ed. 2012, ch. 4",
    ),
];

fn methods() -> Vec<Entry> {
    METHODS.iter().map(|&(name, what, equation, source)| Entry { name, what: what.to_owned(), equation, source, ..Entry::default() }).collect()
}

fn effects() -> Vec<Entry> {
    EFFECTS
        .iter()
        .map(|effect| {
            let card = effect.card;
            let unit = |p: &ndof_models::effects::ParameterCard| match p.unit == p.rotational_unit {
                true => p.unit.to_owned(),
                false => format!("{} or {}", p.unit, p.rotational_unit),
            };
            let sides: Vec<&str> = card.sides.iter().map(|side| side.word()).collect();
            let own = [("Sits in", sides.join(", ")), ("Signature", card.signature.to_owned())];
            Entry {
                name: card.name,
                what: card.what.to_owned(),
                equation: card.equation,
                header: &["parameter", "unit", "where none is given"],
                rows: card
                    .parameters
                    .iter()
                    .map(|p| vec![p.name.to_owned(), unit(p), p.default.map_or_else(String::new, |d| format!("default {d}"))])
                    .collect(),
                remarks: own.into_iter().chain(apart(card.look_alikes, card.next_experiment)).collect(),
                source: card.source,
            }
        })
        .collect()
}

/// What an effect may be taken for, and what tells them apart.
fn apart(look_alikes: &[&str], next_experiment: &str) -> impl Iterator<Item = (&'static str, String)> {
    let look_alikes = (!look_alikes.is_empty()).then(|| ("Look-alikes", look_alikes.join(", ")));
    look_alikes.into_iter().chain([("What tells them apart", next_experiment.trim_end_matches('.').to_owned())])
}

fn joints() -> Vec<Entry> {
    let entry = |cause: &&ndof_joints::JointCause| {
        let card = &cause.card;
        let remarks = [("Sits in", card.side.to_owned())].into_iter().chain(apart(card.look_alikes, card.next_experiment)).collect();
        Entry { name: card.name, what: card.what.to_owned(), equation: card.equation, remarks, ..Entry::default() }
    };
    CAUSES.iter().map(entry).collect()
}

fn devices() -> Vec<Entry> {
    let number = |value: f64| if value.is_nan() { "–".to_owned() } else { value.to_string() };
    DEVICES
        .iter()
        .map(|d| (d.name, d.description, d.parameters, d.source))
        .chain(LIMBS.iter().map(|l| (l.name, l.description, l.parameters, l.source)))
        .map(|(name, what, parameters, source)| Entry {
            name,
            what: what.to_owned(),
            header: &["parameter", "default", "unit", "what it is"],
            rows: parameters.iter().map(|p| vec![p.name.to_owned(), number(p.default), p.unit.to_owned(), p.description.to_owned()]).collect(),
            source,
            ..Entry::default()
        })
        .collect()
}
