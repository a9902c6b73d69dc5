//! The page as a whole: well formed, deterministic, small enough, and safe against what recordings are called.

use ndarray::{Array2, Array3};
use ndof_report::figures::*;
use ndof_report::plot::{Axis, Color, Figure, Panel, Series};
use ndof_report::{Report, Section, Table, Warning};

const HOSTILE: &str = "x\"><script>alert(1)</script></title><!-- ' & \u{0} ]]> {{ 7*7 }}";

fn report(name: &str) -> Report {
    let frequency: Vec<f64> = (1..60).map(|k| 0.2 * f64::from(k)).collect();
    let panel = Panel::new(Axis::log(name, name), Axis::log(name, name))
        .with(Series::band(name, frequency.clone(), vec![0.5; 59], vec![2.0; 59], Color::Blue))
        .with(Series::line(name, frequency, vec![1.0; 59], Color::Blue))
        .rule(1.5, name);
    let named =
        Panel::new(Axis::linear(name, name), Axis::names(vec![name.into(), "b".into()])).with(Series::points(name, vec![1.0, 2.0], vec![1.5, 0.5], Color::Ink));
    let figure = Figure::new(name, name).caption(name).columns(2).cell(name, vec![panel.clone(), panel]).panel(name, named);
    Report {
        title: name.into(),
        lead: name.into(),
        facts: vec![(name.into(), name.into())],
        command: name.into(),
        version: name.into(),
        warnings: vec![Warning { code: name.into(), message: name.into(), action: name.into() }],
        sections: vec![
            Section::new(name, name).text(name).note(name).list(vec![name.into()]).figure(figure.clone()),
            Section::new(name, name).figure(figure).table(Table::new(name, [name], [name]).row([name, name])),
        ],
        settings: vec![(name.into(), name.into())],
    }
}

/// Names of the elements in order, "/name" for ends; contents of style and script are skipped. Panics on what is not HTML.
fn elements(html: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = html;
    while let Some(at) = rest.find('<') {
        assert!(!rest[..at].contains('>'), "a stray > before {}", &rest[at..rest.len().min(at + 60)]);
        rest = &rest[at + 1..];
        let end = rest.find('>').expect("every tag ends");
        let tag = &rest[..end];
        assert!(!tag.contains('<'), "a < within the tag {tag}");
        assert!(tag.matches('"').count().is_multiple_of(2), "quotes of {tag}");
        let name = tag.split([' ', '\n']).next().unwrap_or_default().to_string();
        rest = &rest[end + 1..];
        if name == "style" || name == "script" {
            rest = &rest[rest.find(&format!("</{name}>")).expect("style and script end")..];
        }
        if !name.starts_with('!') && !tag.ends_with('/') {
            names.push(name);
        }
    }
    names
}

fn assert_balanced(html: &str) {
    let mut open: Vec<String> = Vec::new();
    for name in elements(html) {
        match name.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop().as_deref(), Some(name), "</{name}> closes what is open"),
            None if ["meta", "link", "br"].contains(&name.as_str()) => {}
            None => open.push(name),
        }
    }
    assert_eq!(open, Vec::<String>::new());
}

#[test]
fn the_page_is_well_formed_whatever_things_are_called() {
    for name in ["pos_x", HOSTILE, "", "ångström 力"] {
        let html = report(name).to_html();
        assert_balanced(&html);
        for file in report(name).plot_files().iter().filter(|file| file.name.ends_with(".svg")) {
            assert_balanced(&file.contents);
        }
    }
}

#[test]
fn a_hostile_name_adds_no_element() {
    // As long as the hostile one, so that both leave the same room for ticks.
    let plain = "a".repeat(HOSTILE.chars().count());
    let (plain, hostile) = (elements(&report(&plain).to_html()), elements(&report(HOSTILE).to_html()));
    let differs = plain.iter().zip(&hostile).position(|(a, b)| a != b);
    assert_eq!((plain.len(), None), (hostile.len(), differs));
    assert!(!report(HOSTILE).to_html().contains("<script>alert"));
}

#[test]
fn nothing_is_fetched() {
    let html = report("x").to_html();
    let outside = html.replace("http://www.w3.org/2000/svg", "");
    for word in ["http://", "https://", "src=", "@import", "url(", "fetch(", "XMLHttpRequest", "WebSocket", "sendBeacon"] {
        assert!(!outside.contains(word), "{word}");
    }
    assert!(html.contains("default-src 'none'"));
}

#[test]
fn the_same_report_gives_the_same_bytes_and_files_of_different_names() {
    assert_eq!(report("x").to_html(), report("x").to_html());
    let files = report("x").plot_files();
    let names: Vec<_> = files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["x.svg", "x.csv", "x-2.svg", "x-2.csv"]);
}

#[test]
fn numbers_that_do_not_exist_never_reach_the_page() {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, 1e308, -1e308, 1e-308, 5e-324, 1.0];
    let axes = [Axis::linear("a", ""), Axis::log("a", ""), Axis::degrees("a"), Axis::linear("a", "").range(f64::NAN, 1.0), Axis::log("a", "").range(0.0, 1.0)];
    let mut figure = Figure::new("odd", "odd").columns(5);
    for x_axis in &axes {
        for y_axis in &axes {
            let x = || odd.iter().flat_map(|_| odd).collect::<Vec<_>>();
            let y = || odd.iter().flat_map(|value| [*value; 10]).collect::<Vec<_>>();
            for data in [(x(), y()), (vec![1.0; 4], odd[..4].to_vec()), (vec![], vec![]), (vec![1.0], vec![1.0])] {
                for equal in [false, true] {
                    let mut panel = Panel::new(x_axis.clone(), y_axis.clone())
                        .with(Series::line("l", data.0.clone(), data.1.clone(), Color::Blue))
                        .with(Series::points("p", data.0.clone(), data.1.clone(), Color::Blue))
                        .with(Series::steps("s", data.0.clone(), data.1.clone(), Color::Blue))
                        .with(Series::area("a", data.0.clone(), data.1.clone(), Color::Blue))
                        .with(Series::band("b", data.0.clone(), data.1.clone(), data.1.iter().map(|y| 2.0 * y).collect(), Color::Blue))
                        .rule(f64::NAN, "r");
                    panel.equal_aspect = equal;
                    figure = figure.panel("", panel);
                }
            }
        }
    }
    let svg = figure.to_svg();
    let html = Report { sections: vec![Section::new("s", "").figure(figure)], ..Report::default() }.to_html();
    let body = &html[html.find("<body>").expect("a body") + 6..html.rfind("<script>").expect("a script")];
    for text in [svg.as_str(), body] {
        assert_balanced(text);
        for word in ["NaN", "inf", "null"] {
            let at = text.find(word);
            assert_eq!(at.map(|at| &text[at.saturating_sub(80)..at + 20]), None);
        }
    }
}

/// The arm study: 2 × 2 at all 4097 frequencies, two estimates and two models, six channels of 25 000 samples.
#[test]
fn a_six_trial_study_stays_below_three_megabytes() {
    let mut state = 1u64;
    let mut noise = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let frequency_hz: Vec<f64> = (0..4097).map(|k| f64::from(k) * 500.0 / 8192.0).collect();
    let shape = (2, 2, frequency_hz.len());
    let axes = vec!["x".to_string(), "y".to_string()];
    let mut curve = |label: &str, style| {
        let gain = Array3::from_shape_fn(shape, |(_, _, k)| 1e-3 / (1.0 + frequency_hz[k].powi(2)) * (0.5 + noise()));
        let phase = Array3::from_shape_fn(shape, |_| 6.0 * noise() - 3.0);
        Curve {
            label: label.into(),
            gain_ci95: Some((&gain * 0.8, &gain * 1.2)),
            phase_ci95_rad: Some((&phase - 0.2, &phase + 0.2)),
            gain,
            phase_rad: phase,
            style,
        }
    };
    let curves = vec![
        curve("direct", CurveStyle::SECOND),
        curve("derived", CurveStyle::MEASURED),
        curve("fitted", CurveStyle::FITTED),
        curve("simulated", CurveStyle::TRUE),
    ];
    let data = ResponseCurves {
        quantity: "Compliance".into(),
        unit: "m/N".into(),
        frequency_hz: frequency_hz.clone(),
        inputs: axes.clone(),
        outputs: axes.clone(),
        curves,
    };
    let mut unit = || Array3::from_shape_fn(shape, |_| noise());
    let (ordinary, partial, multiple) = (unit(), unit(), Array2::from_elem((2, frequency_hz.len()), 0.9));
    let coherences = Coherences {
        frequency_hz: &frequency_hz,
        inputs: &axes,
        outputs: &axes,
        ordinary: &ordinary,
        partial: &partial,
        multiple: &multiple,
        significance_95: Some(0.3),
    };
    let trace = |name: &str, noise: &mut dyn FnMut() -> f64| Trace {
        label: name.into(),
        unit: "N".into(),
        measured: (0..25_000).map(|_| noise()).collect(),
        simulated: vec![("simulated".into(), (0..25_000).map(|_| noise()).collect())],
    };
    let list = ["cmd_x", "cmd_y", "force_x", "force_y", "pos_x", "pos_y"].map(|name| trace(name, &mut noise)).to_vec();
    let signals = Traces { sample_rate_hz: 500.0, start_s: 0.0, traces: list, detail_s: Some((20.0, 23.0)) };
    let section = Section::new("Study", "")
        .figure(bode("bode", &data).unwrap())
        .figure(nyquist("nyquist", &data).unwrap())
        .figure(coherence("coherence", "Coherence", coherences).unwrap())
        .figure(coherence("coherence-derived", "Coherence", coherences).unwrap())
        .figure(traces("traces", "Traces", &signals).unwrap());
    let html = Report { sections: vec![section], ..Report::default() }.to_html();
    assert!(html.len() < 3_000_000, "{} bytes of pure noise, which no decimation can make smooth", html.len());
}
