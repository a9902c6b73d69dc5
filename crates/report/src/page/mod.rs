//! The report: sections of figures, tables and notes, on one page that needs nothing else.

mod data_table;
mod figure;
mod html;

use ndof_analysis::result::Head;
use ndof_signal::Warning;

use crate::plot::Figure;
use crate::table::Table;

/// A part of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A paragraph set apart.
    Note(String),
    /// A list of sentences, e.g. the evidence for a cause.
    List(Vec<String>),
    /// A picture.
    Figure(Figure),
    /// A table.
    Table(Table),
}

/// A section: a title, a sentence that says the result, and what shows it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// As in the table of contents.
    pub title: String,
    /// The result in one sentence.
    pub lead: String,
    /// In order.
    pub blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    pub fn new(title: impl Into<String>, lead: impl Into<String>) -> Self {
        Self { title: title.into(), lead: lead.into(), blocks: Vec::new() }
    }

    /// With a paragraph more.
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Text(text.into()));
        self
    }

    /// With a note more.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Note(text.into()));
        self
    }

    /// With a list of sentences more.
    pub fn list(mut self, sentences: Vec<String>) -> Self {
        self.blocks.push(Block::List(sentences));
        self
    }

    /// With a picture more.
    pub fn figure(mut self, figure: Figure) -> Self {
        self.blocks.push(Block::Figure(figure));
        self
    }

    /// With a table more.
    pub fn table(mut self, table: Table) -> Self {
        self.blocks.push(Block::Table(table));
        self
    }
}

/// A picture or its numbers, ready to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlotFile {
    /// File name, e.g. "bode-compliance.svg": letters, digits, hyphens, one dot; no two are alike.
    pub name: String,
    /// UTF-8.
    pub contents: String,
}

/// A report. [`Report::to_html`] gives the page, [`Report::plot_files`] the pictures as files.
///
/// ```
/// use ndof_report::{Report, Section};
///
/// let report = Report {
///     title: "Arm study".into(),
///     lead: "The hand is held by a spring of 303 ± 5 N/m.".into(),
///     sections: vec![Section::new("Impedance", "Fitted from 0.5 to 10 Hz.").text("All intervals hold the truth.")],
///     ..Report::default()
/// };
/// assert!(report.to_html().contains("<h2>Impedance</h2>"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Title of the page.
    pub title: String,
    /// The result in one sentence that a clinician understands.
    pub lead: String,
    /// Facts of the measurement, name and value, e.g. ("Recording", "2 in, 2 out, 50.0 s at 500 Hz").
    pub facts: Vec<(String, String)>,
    /// The command line that made it.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Warnings, each with its action.
    pub warnings: Vec<Warning>,
    /// In order.
    pub sections: Vec<Section>,
    /// All settings, name and value.
    pub settings: Vec<(String, String)>,
}

impl Report {
    /// A page without sections: what every result knows of itself.
    pub fn of(head: &Head, title: &str, command: &str) -> Self {
        let (version, warnings) = (head.ndof_version.clone(), head.warnings.clone());
        Report { title: title.to_owned(), command: command.to_owned(), version, warnings, ..Report::default() }
    }

    /// Every figure, in the order of the page.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.sections.iter().flat_map(|section| &section.blocks).filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        })
    }

    /// Their names, numbered where two are alike.
    fn figure_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for Figure { name, .. } in self.figures() {
            let numbered = (2..).map(|count| format!("{name}-{count}"));
            names.extend(std::iter::once(name.clone()).chain(numbered).find(|name| !names.contains(name)));
        }
        names
    }

    /// Each figure as SVG and as CSV, named after it; figures of one name are numbered.
    pub fn plot_files(&self) -> Vec<PlotFile> {
        let both = |(figure, name): (&Figure, String)| {
            [("svg", figure.to_svg()), ("csv", figure.to_csv())].map(|(suffix, contents)| PlotFile { name: format!("{name}.{suffix}"), contents })
        };
        self.figures().zip(self.figure_names()).flat_map(both).collect()
    }
}
