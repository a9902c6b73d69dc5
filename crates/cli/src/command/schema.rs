//! `ndof schema`.

use crate::error::CliError;
use clap::{Args, ValueEnum};
use ndof_analysis::check::result::CheckResult;
use ndof_analysis::compare::result::CompareResult;
use ndof_analysis::diagnose::result::DiagnosisResult;
use ndof_analysis::estimate::result::EstimateResult;
use ndof_analysis::fit::result::FitResult;
use ndof_analysis::live::result::LiveResult;
use ndof_analysis::{did_you_mean, nearest};
use ndof_study::Truth;
use ndof_study::cases::result::StudyResult;
use ndof_study::design::excitation::ExcitationResult;
use ndof_study::design::result::DesignResult;
use ndof_study::sensitivity::result::SensitivityResult;
use schemars::JsonSchema;
use serde_json::Value;
use std::fmt::Write as _;
use std::io::Write;

/// Print the JSON Schema of a result.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  ndof schema estimate > estimate.schema.json")]
pub struct Arguments {
    /// Which result.
    name: String,
    /// For a validator, or as a page of a book
    #[arg(long, value_enum, default_value = "json")]
    format: Format,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    Json,
    Markdown,
}

type Schema = fn() -> Value;

/// The JSON Schemas by the short names that `ndof schema` takes.
const SCHEMAS: &[(&str, Schema)] = &[
    ("estimate", schema::<EstimateResult>),
    ("fit", schema::<FitResult>),
    ("diagnosis", schema::<DiagnosisResult>),
    ("check", schema::<CheckResult>),
    ("compare", schema::<CompareResult>),
    ("live", schema::<LiveResult>),
    ("study-result", schema::<StudyResult>),
    ("design", schema::<DesignResult>),
    ("excitation", schema::<ExcitationResult>),
    ("sensitivity", schema::<SensitivityResult>),
    ("truth", schema::<Truth>),
];

fn schema<T: JsonSchema>() -> Value {
    schemars::schema_for!(T).to_value()
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    // A command's name is as good as that of what it writes.
    let short = match arguments.name.trim_start_matches("ndof/").trim_end_matches("/1") {
        "diagnose" => "diagnosis",
        "study" => "study-result",
        "simulate" => "truth",
        "cohort" => "fit",
        other => other,
    };
    let (_, schema) = SCHEMAS.iter().find(|(name, _)| *name == short).ok_or_else(|| {
        let known: Vec<&str> = SCHEMAS.iter().map(|(name, _)| *name).collect();
        let suggestion = did_you_mean(nearest(short, known.iter().copied()).as_deref());
        CliError::Usage(format!("no schema \"{}\"{suggestion}; there are: {}", arguments.name, known.join(", ")))
    })?;
    let schema = schema();
    let text = match arguments.format {
        Format::Json => serde_json::to_string_pretty(&schema).map_err(|error| CliError::Usage(error.to_string()))?,
        Format::Markdown => markdown(short, &schema),
    };
    Ok(writeln!(std::io::stdout(), "{}", text.trim_end())?)
}

/// A table for the result and one for each type inside it.
fn markdown(name: &str, schema: &Value) -> String {
    let mut text = format!("## {name}\n{}", table(schema));
    for (inner, definition) in schema["$defs"].as_object().into_iter().flatten() {
        let _ = write!(text, "\n### {inner} in {name}\n{}", table(definition));
    }
    text
}

/// The fields of a record, or the values of what is one of several.
fn table(object: &Value) -> String {
    let words = |value: &Value| value["description"].as_str().map(plain).unwrap_or_default();
    let cell = |value: &Value| words(value).replace('|', "\\|");
    let (head, rows): (_, Vec<String>) = match (object["properties"].as_object().filter(|p| !p.is_empty()), choices(object)) {
        (Some(properties), _) => {
            ("| field | holds | |\n|---|---|---|", properties.iter().map(|(name, p)| format!("| `{name}` | {} | {} |", kind(p), cell(p))).collect())
        }
        (None, Some(choices)) => {
            let value = |choice: &Value| choice["const"].as_str().map_or_else(|| kind(choice), |word| format!("`{word}`"));
            ("| value | |\n|---|---|", choices.iter().map(|choice| format!("| {} | {} |", value(choice), cell(choice))).collect())
        }
        (None, None) => return format!("\n{} It is a {}.\n", words(object), kind(object)),
    };
    let description = words(object);
    let above = if description.is_empty() { description } else { format!("\n{description}\n") };
    format!("{above}\n{head}\n{}\n", rows.join("\n"))
}

fn choices(value: &Value) -> Option<&Vec<Value>> {
    value["anyOf"].as_array().or_else(|| value["oneOf"].as_array())
}

/// On one line, and without the brackets of a link.
fn plain(words: &str) -> String {
    words.split_whitespace().collect::<Vec<_>>().join(" ").replace("[`", "`").replace("`]", "`")
}

/// What a property holds, in words: `number`, `list of list of number or null`, the name of another table.
fn kind(property: &Value) -> String {
    if let Some(reference) = property["$ref"].as_str() {
        return reference.rsplit('/').next().unwrap_or(reference).to_owned();
    }
    if let Some(choices) = choices(property) {
        return choices.iter().map(kind).collect::<Vec<_>>().join(" or ");
    }
    let word = |word: &str| match word {
        "array" => match property.get("items").map(kind) {
            Some(inner) if !inner.is_empty() => format!("list of {inner}"),
            _ => "list".to_owned(),
        },
        "object" => match property.get("additionalProperties").filter(|inner| inner.is_object()).map(kind) {
            Some(inner) if !inner.is_empty() => format!("table of {inner}"),
            _ => "table".to_owned(),
        },
        other => other.to_owned(),
    };
    match &property["type"] {
        Value::String(one) => word(one),
        Value::Array(several) => several.iter().filter_map(Value::as_str).map(word).collect::<Vec<_>>().join(" or "),
        _ => String::new(),
    }
}
