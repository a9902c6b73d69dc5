//! A figure on the page: legend, panels that reflow on a narrow screen, and the numbers behind them.

use super::data_table::data_tables;
use crate::plot::{Cell, Figure, draw_panel, escape, legend_entries, swatch};

pub(super) fn figure_html(figure: &Figure, id: &str) -> String {
    let cell_width = figure.cell_width();
    let left = figure.panel_left();
    let cells: String = figure.cells.iter().map(|cell| cell_html(figure, cell, (cell_width, left))).collect();
    let square = figure.cells.iter().flat_map(|cell| &cell.panels).any(|panel| panel.is_equal());
    let narrow = figure.table.as_ref().is_some_and(|table| table.columns.len() <= 4 && table.rows.len() <= 6);
    let own = figure.table.as_ref().map(crate::Table::to_html);
    let (beside, numbers) = match own {
        Some(table) if square && figure.cells.len() == 1 && figure.columns == 1 && narrow => (format!("<div class=\"beside\">{table}</div>\n"), String::new()),
        Some(table) => (String::new(), table),
        None => (String::new(), data_tables(figure).iter().map(crate::Table::to_html).collect()),
    };
    let numbers =
        if numbers.is_empty() { numbers } else { format!("<details><summary>Numbers behind “{}”</summary>\n{numbers}</details>\n", escape(&figure.title)) };
    let caption = if figure.caption.is_empty() { String::new() } else { format!("<p>{}</p>", escape(&figure.caption)) };
    format!(
        "<figure id=\"{id}\" style=\"--columns:{columns};--cell:{cell_width}px\" class=\"{class}\">\n<figcaption><h3>{title}</h3>{caption}</figcaption>\n\
         <div class=\"bar\"><div class=\"legend\">{legend}</div>\
         <div class=\"tools js-only\" role=\"group\" aria-label=\"Zoom\"><button type=\"button\" data-zoom=\"in\" aria-label=\"Zoom in\">+</button>\
         <button type=\"button\" data-zoom=\"out\" aria-label=\"Zoom out\">−</button><button type=\"button\" data-zoom=\"reset\" disabled>Reset</button></div></div>\n\
         <div class=\"cells\">\n{cells}{beside}</div>\n<p class=\"live\" aria-live=\"polite\"></p>\n{numbers}</figure>\n",
        columns = figure.columns.max(1),
        class = match (beside.is_empty(), figure.columns) {
            (false, _) => "few two",
            (true, columns) if columns > 3 => "many",
            _ => "few",
        },
        title = escape(&figure.title),
        legend = legend_html(figure),
    )
}

fn legend_html(figure: &Figure) -> String {
    legend_entries(figure.panels())
        .iter()
        .map(|entry| {
            let label = escape(&entry.label);
            format!(
                "<button type=\"button\" aria-pressed=\"true\" data-label=\"{label}\"><svg width=\"24\" height=\"12\" aria-hidden=\"true\">{}</svg>{label}</button>",
                swatch(entry, 0.0, 6.0)
            )
        })
        .collect()
}

fn cell_html(figure: &Figure, cell: &Cell, (width, left): (f64, f64)) -> String {
    let title = if cell.title.is_empty() { String::new() } else { format!("<h4>{}</h4>", escape(&cell.title)) };
    let mut panels = String::new();
    for (k, panel) in cell.panels.iter().enumerate() {
        let frame = draw_panel(panel, width, left, k + 1 == cell.panels.len());
        let words = [figure.title.as_str(), &cell.title, &panel.y.caption()].into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(", ");
        let name = format!("{words} over {}", panel.x.caption());
        panels += &format!(
            "<svg class=\"panel\" viewBox=\"0 0 {w} {h}\" role=\"img\" aria-label=\"{name}\" tabindex=\"0\" data-panel=\"{meta}\">{body}</svg>\n",
            w = frame.width,
            h = frame.height,
            name = escape(&name),
            meta = escape(&frame.meta),
            body = frame.body,
        );
    }
    format!("<div class=\"cell\">{title}{panels}</div>\n")
}
