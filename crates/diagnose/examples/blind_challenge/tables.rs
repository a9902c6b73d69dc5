//! Rates, confusion and calibration of many rows.

use crate::row::{Class, Row};
use ndof_report::figures::{ConfidenceBin, confusion, reliability};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};
use std::collections::BTreeMap;

/// What is asked of a share.
#[derive(Clone, Copy)]
pub enum Asked {
    Nothing,
    AtMost(f64),
    AtLeast(f64),
    Between(f64, f64),
}

impl Asked {
    fn allows(self, share: f64) -> bool {
        match self {
            Asked::Nothing => true,
            Asked::AtMost(most) => share <= most,
            Asked::AtLeast(least) => share >= least,
            Asked::Between(least, most) => (least..=most).contains(&share),
        }
    }

    fn words(self) -> String {
        match self {
            Asked::Nothing => String::new(),
            Asked::AtMost(most) => format!("<= {:.0} %", 100.0 * most),
            Asked::AtLeast(least) => format!(">= {:.0} %", 100.0 * least),
            Asked::Between(least, most) => format!("{:.0} to {:.0} %", 100.0 * least, 100.0 * most),
        }
    }
}

/// k of n and the 95 % interval of Clopper and Pearson.
#[derive(Clone, Debug, Serialize)]
pub struct Rate {
    pub what: String,
    pub asked: String,
    pub k: usize,
    pub n: usize,
    pub ci95: [f64; 2],
    /// `proven` where the whole interval is what is asked, `reached` where the share is, `missed` where neither is; empty where nothing is asked.
    pub status: &'static str,
}

impl Rate {
    fn new(what: &str, asked: Asked, k: usize, n: usize) -> Self {
        let ci95 = if n == 0 { [0.0, 1.0] } else { clopper_pearson(k, n) };
        let status = match asked {
            Asked::Nothing => "",
            _ if n == 0 => "no case",
            _ if ci95.iter().all(|end| asked.allows(*end)) => "proven",
            _ if asked.allows(k as f64 / n as f64) => "reached",
            _ => "missed",
        };
        Rate { what: what.to_owned(), asked: asked.words(), k, n, ci95, status }
    }
}

fn clopper_pearson(k: usize, n: usize) -> [f64; 2] {
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |law| law.inverse_cdf(p));
    let low = if k == 0 { 0.0 } else { quantile(k as f64, (n - k + 1) as f64, 0.025) };
    let high = if k == n { 1.0 } else { quantile((k + 1) as f64, (n - k) as f64, 0.975) };
    [low, high]
}

fn rate<'a>(what: &str, asked: Asked, rows: impl Iterator<Item = &'a Row>, hit: impl Fn(&Row) -> bool) -> Rate {
    let (mut k, mut n) = (0, 0);
    for row in rows {
        n += 1;
        k += usize::from(hit(row));
    }
    Rate::new(what, asked, k, n)
}

/// The numbers that are asked of a diagnosis.
pub fn rates(rows: &[Row]) -> Vec<Rate> {
    use Asked::{AtLeast, AtMost, Between, Nothing};
    let of = |kind: &'static str| rows.iter().filter(move |r| r.kind == kind && r.error.is_none());
    let class = |kind: &'static str, class: Class| of(kind).filter(move |r| r.class() == class);
    let mut out = vec![
        rate("nothing hidden: a cause named", AtMost(0.01), of("null"), |r| !r.named.is_empty()),
        rate("nothing hidden: called unexplained", Nothing, of("null"), |r| r.answer() == "unexplained"),
        rate("small imperfections only: a cause named", AtMost(0.05), of("background").filter(|r| r.size <= 0.01), |r| !r.named.is_empty()),
    ];
    for (kind, words, asked) in
        [("single", "single", [AtLeast(0.97), Nothing, AtLeast(0.9), Nothing]), ("other", "other form", [AtLeast(0.95), Nothing, AtLeast(0.85), Nothing])]
    {
        for (c, name, asked) in [
            (Class::Clear, "clear", asked[0]),
            (Class::Middle, "20 to 50 % of the residual", asked[1]),
            (Class::Weak, "weak", asked[2]),
            (Class::Faint, "below 5 % or below tolerance", asked[3]),
        ] {
            out.push(rate(&format!("{words}, {name}: right first"), asked, class(kind, c), Row::right));
        }
    }
    let placed =
        |r: &&Row| matches!(r.kind.as_str(), "single" | "other") && r.right() && r.named.first().is_some_and(|n| !n.axis.is_empty()) && r.plant != "force";
    out.push(rate(
        "axis right, of those right with an axis",
        AtLeast(0.98),
        rows.iter().filter(placed).filter(|r| ["planar", "wrist", "six"].contains(&r.plant.as_str())),
        |r| r.named.first().is_some_and(|n| n.axis == r.axis),
    ));
    out.push(rate("pairs: both named", AtLeast(0.9), of("pair"), Row::right));
    out.push(rate("pairs: exactly the two", AtLeast(0.75), of("pair"), Row::exact));
    out.push(rate("outside the registry: a confident wrong name", AtMost(0.05), of("outside"), Row::confident_wrong));
    out.push(rate("single, clear: exactly the one", Nothing, class("single", Class::Clear), Row::exact));
    let (mut k, mut n) = (0, 0);
    for interval in rows.iter().filter(|r| r.kind == "single" && r.right() && r.class() != Class::Faint).flat_map(|r| &r.intervals) {
        if let Some([low, high]) = interval.ci95 {
            n += 1;
            k += usize::from((low..=high).contains(&interval.truth));
        }
    }
    out.push(Rate::new("true parameter inside its 95 % interval", Between(0.9, 0.98), k, n));
    out
}

/// By effect and parameter: true value inside its interval, intervals given, values, and their median relative error.
pub fn coverage(rows: &[Row]) -> Vec<(String, usize, usize, usize, f64)> {
    let mut by: BTreeMap<String, (usize, usize, Vec<f64>)> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.kind == "single" && r.right() && r.class() != Class::Faint) {
        for i in &row.intervals {
            let entry = by.entry(format!("{} {}", row.hidden[0].0, i.parameter)).or_default();
            entry.0 += usize::from(i.ci95.is_some_and(|[low, high]| (low..=high).contains(&i.truth)));
            entry.1 += usize::from(i.ci95.is_some());
            entry.2.push((i.value / i.truth - 1.0).abs());
        }
    }
    by.into_iter()
        .map(|(name, (inside, given, mut errors))| {
            errors.sort_by(f64::total_cmp);
            (name, inside, given, errors.len(), errors[errors.len() / 2])
        })
        .collect()
}

/// Five bins of equal count, and the expected calibration error.
pub fn calibration(rows: &[Row]) -> (Vec<ConfidenceBin>, f64) {
    let mut said: Vec<(f64, bool)> = rows.iter().flat_map(|r| r.named.iter().map(|n| (n.probability, r.is_right(n)))).collect();
    said.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut bins = Vec::new();
    let mut error = 0.0;
    for b in 0..5 {
        let part = &said[b * said.len() / 5..(b + 1) * said.len() / 5];
        if part.is_empty() {
            continue;
        }
        let n = part.len() as f64;
        let right = part.iter().filter(|p| p.1).count();
        let stated = part.iter().map(|p| p.0).sum::<f64>() / n;
        error += (stated - right as f64 / n).abs() * n / said.len() as f64;
        bins.push(ConfidenceBin { stated, count: part.len(), right });
    }
    (bins, error)
}

/// Counts by what was hidden (single effects, other forms, outside, nothing) and what was named first.
pub fn counts(rows: &[Row]) -> (Vec<String>, Vec<String>, Vec<Vec<usize>>) {
    let mut cells: BTreeMap<(String, String), usize> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.hidden.len() <= 1 && r.error.is_none() && (r.hidden.is_empty() || r.kind == "outside" || r.class() != Class::Faint)) {
        let hidden = row.truth().first().map_or("nothing", |t| *t).to_owned();
        *cells.entry((hidden, row.answer().to_owned())).or_default() += 1;
    }
    let mut truths: Vec<String> = cells.keys().map(|k| k.0.clone()).collect();
    truths.dedup();
    let mut answers = truths.clone();
    for key in cells.keys() {
        if !answers.contains(&key.1) {
            answers.push(key.1.clone());
        }
    }
    let table = truths.iter().map(|t| answers.iter().map(|a| cells.get(&(t.clone(), a.clone())).copied().unwrap_or(0)).collect()).collect();
    (truths, answers, table)
}

/// Everything as text.
pub fn text(rows: &[Row]) -> String {
    let mut out = String::new();
    let mut line = |words: String| {
        out.push_str(words.trim_end());
        out.push('\n');
    };
    let kinds = ["null", "background", "single", "other", "pair", "outside"].map(|kind| format!("{kind} {}", rows.iter().filter(|r| r.kind == kind).count()));
    let seeds: std::collections::BTreeSet<String> = rows.iter().map(|r| r.seed.to_string()).collect();
    line(format!("seed {}, {} cases: {}", seeds.into_iter().collect::<Vec<_>>().join(", "), rows.len(), kinds.join(", ")));
    line(format!("{:56} {:>10} {:>11} {:>7}  95 % interval", "", "asked", "measured", ""));
    for r in rates(rows) {
        let share = 100.0 * r.k as f64 / r.n.max(1) as f64;
        let interval = format!("{:.1} to {:.1} %", 100.0 * r.ci95[0], 100.0 * r.ci95[1]);
        line(format!("{:56} {:>10} {:>5} of {:<4} {share:5.1} %  {interval:16} {}", r.what, r.asked, r.k, r.n, r.status));
    }
    let (bins, error) = calibration(rows);
    line(format!("expected calibration error {error:.3} (asked: <= 0.05), 5 bins of equal count: mean stated, share right, n"));
    for b in bins {
        line(format!("  {:.3} {:.3} {}", b.stated, b.right as f64 / b.count as f64, b.count));
    }
    line("\nhidden -> named first".to_owned());
    let (truths, answers, table) = counts(rows);
    for (truth, row) in truths.iter().zip(&table) {
        let cells: Vec<String> = answers.iter().zip(row).filter(|c| *c.1 > 0).map(|(a, c)| format!("{a} {c}")).collect();
        line(format!("{truth:24} {}", cells.join(", ")));
    }
    line("\nparameter: inside its interval, intervals, values, median relative error".to_owned());
    for (name, inside, given, n, error) in coverage(rows) {
        line(format!("{name:40} {inside:4} {given:4} {n:4} {error:.3}"));
    }
    let mut plants: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    for row in rows {
        let entry = plants.entry(row.plant.as_str()).or_default();
        entry.0 += 1;
        entry.1 += row.seconds;
    }
    line("\nplant, cases, mean seconds of a diagnosis".to_owned());
    for (plant, (n, seconds)) in plants {
        line(format!("{plant:10} {n:5} {:.2}", seconds / n as f64));
    }
    for row in rows.iter().filter(|r| r.error.is_some()) {
        line(format!("failed: {} {} {}: {}", row.seed, row.number, row.plant, row.error.as_deref().unwrap_or_default()));
    }
    out
}

/// Writes `blind.txt`, `blind.json`, `confusion.svg` and `reliability.svg`.
pub fn store(rows: &[Row], folder: &std::path::Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    let (truths, answers, table) = counts(rows);
    let (bins, error) = calibration(rows);
    let result = serde_json::json!({
        "cases": rows.len(),
        "rates": rates(rows),
        "confusion": { "hidden": truths, "named": answers, "counts": table },
        "calibration": { "expected_error": error, "bins": bins.iter().map(|b| [b.stated, b.right as f64 / b.count as f64, b.count as f64]).collect::<Vec<_>>() },
        "coverage": coverage(rows),
    });
    std::fs::write(folder.join("blind.txt"), text(rows))?;
    std::fs::write(folder.join("blind.json"), serde_json::to_string_pretty(&result)?)?;
    std::fs::write(folder.join("confusion.svg"), confusion("confusion", "What was hidden and what was named", &truths, &answers, &table)?.to_svg())?;
    std::fs::write(folder.join("reliability.svg"), reliability("reliability", "Stated probability and share right", &bins)?.to_svg())?;
    Ok(())
}
