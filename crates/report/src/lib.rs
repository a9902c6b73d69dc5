//! Self-contained reports: SVG plots, tables and one HTML page.
