//! The page as HTML.

use super::figure::figure_html;
use super::{Block, Report, Section};
use crate::plot::{escape, page_variables};
use crate::table::Table;

const PAGE_CSS: &str = include_str!("../../assets/page.css");
const PLOT_CSS: &str = include_str!("../../assets/plot.css");
const SCRIPT: &str = include_str!("../../assets/page.js");
/// Nothing may be fetched: not by this page and not by a name smuggled into it.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'";

impl Report {
    /// The page: one HTML file with all styles, pictures and a small script inside; it works offline and, less the
    /// read-out and zoom, without the script. The same report gives the same bytes.
    pub fn to_html(&self) -> String {
        let body = [self.header(), self.warnings_html(), self.sections_html(), self.settings_html(), self.footer()].concat();
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
             <meta name=\"generator\" content=\"ndof {version}\">\n<link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n<style>\n{style}</style>\n</head>\n\
             <body>\n<a class=\"skip\" href=\"#content\">To the results</a>\n<div class=\"page\">\n{contents}<main id=\"content\">\n{body}</main>\n</div>\n\
             <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            version = escape(&self.version),
            title = escape(&self.title),
            style = styles(),
            contents = self.contents(),
        )
    }

    fn header(&self) -> String {
        let facts: String = self.facts.iter().map(|(name, value)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value))).collect();
        let facts = if facts.is_empty() { facts } else { format!("<dl class=\"facts\">{facts}</dl>\n") };
        let lead = paragraph("lead", &self.lead);
        format!("<header>\n<h1>{}</h1>\n{lead}{facts}</header>\n", escape(&self.title))
    }

    /// Title and anchor of everything in the table of contents.
    fn entries(&self) -> Vec<(String, String)> {
        let warnings = (!self.warnings.is_empty()).then(|| ("Warnings".to_string(), "warnings".to_string()));
        let sections = self.sections.iter().enumerate().map(|(k, section)| (section.title.clone(), format!("section-{}", k + 1)));
        let settings = self.has_settings().then(|| ("Settings".to_string(), "settings".to_string()));
        warnings.into_iter().chain(sections).chain(settings).collect()
    }

    fn contents(&self) -> String {
        let items: String = self.entries().iter().map(|(title, anchor)| format!("<li><a href=\"#{anchor}\">{}</a></li>", escape(title))).collect();
        format!("<nav aria-label=\"Contents\">\n<ol>{items}</ol>\n</nav>\n")
    }

    fn warnings_html(&self) -> String {
        if self.warnings.is_empty() {
            return String::new();
        }
        let items: String = self
            .warnings
            .iter()
            .map(|warning| {
                let action = if warning.action.is_empty() { String::new() } else { format!("<p class=\"action\">{}</p>", escape(&warning.action)) };
                format!("<li><p><code>{}</code> {}</p>{action}</li>\n", escape(&warning.code), escape(&warning.message))
            })
            .collect();
        format!("<section id=\"warnings\" class=\"warnings\">\n<h2>Warnings</h2>\n<ul>\n{items}</ul>\n</section>\n")
    }

    fn sections_html(&self) -> String {
        let mut names = self.figure_names().into_iter();
        self.sections.iter().enumerate().map(|(k, section)| section_html(k + 1, section, &mut names)).collect()
    }

    fn has_settings(&self) -> bool {
        !(self.settings.is_empty() && self.command.is_empty())
    }

    fn settings_html(&self) -> String {
        if !self.has_settings() {
            return String::new();
        }
        let command = if self.command.is_empty() {
            String::new()
        } else {
            format!("<p>This page was made by</p>\n<pre class=\"command\"><code>{}</code></pre>\n", escape(&self.command))
        };
        let table = if self.settings.is_empty() {
            String::new()
        } else {
            let rows = self.settings.iter().map(|(name, value)| vec![name.clone(), value.clone()]).collect();
            Table { rows, ..Table::new("All settings", ["Setting", "Value"], [""; 0]) }.to_html()
        };
        format!("<section id=\"settings\">\n<h2>Settings</h2>\n{command}{table}</section>\n")
    }

    fn footer(&self) -> String {
        format!("<footer>\n<p>Made by ndof {}. The page is complete: it asks no server for anything.</p>\n</footer>\n", escape(&self.version))
    }
}

fn styles() -> String {
    let page = [":root{", &page_variables(false), "}\n@media screen and (prefers-color-scheme:dark){:root{", &page_variables(true), "}}\n"].concat();
    let classes = ["ink", "blue", "vermillion", "green", "orange", "purple", "sky", "grey"].map(|name| format!(".c-{name}{{color:var(--{name})}}")).concat();
    [page.as_str(), PLOT_CSS, &classes, "\n", PAGE_CSS].concat()
}

fn paragraph(class: &str, text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("<p class=\"{class}\">{}</p>\n", escape(text)) }
}

fn section_html(number: usize, section: &Section, names: &mut impl Iterator<Item = String>) -> String {
    let blocks: String = section.blocks.iter().map(|block| block_html(block, names)).collect();
    let lead = paragraph("lead", &section.lead);
    format!("<section id=\"section-{number}\">\n<h2>{}</h2>\n{lead}{blocks}</section>\n", escape(&section.title))
}

fn block_html(block: &Block, names: &mut impl Iterator<Item = String>) -> String {
    match block {
        Block::Text(text) => paragraph("text", text),
        Block::Note(text) => paragraph("note", text),
        Block::List(sentences) => {
            let items: String = sentences.iter().map(|sentence| format!("<li>{}</li>", escape(sentence))).collect();
            format!("<ul class=\"sentences\">{items}</ul>\n")
        }
        Block::Figure(figure) => figure_html(figure, &format!("figure-{}", names.next().unwrap_or_default())),
        Block::Table(table) => table.to_html(),
    }
}
