//! Every picture of this crate on one page, drawn from a made-up arm: `cargo run -p ndof-report --example gallery OUT.html`.
//!
//! The browser test opens this page. The arm is two coupled springs with masses; the "measurement" is its response
//! times a seeded error whose size grows where the coherence falls, so that bands and lines look as they do in a study.

use std::f64::consts::{PI, TAU};

use ndarray::{Array2, Array3, Axis};
use ndof_analysis::{ComparedParameter, Leftover};
use ndof_report::figures::*;
use ndof_report::plot::{Color, Dash, Scale};
use ndof_report::{Report, Section, Warning, parameter_table};
use num_complex::Complex64;

const INERTIA: [[f64; 2]; 2] = [[2.1, -0.55], [-0.55, 1.9]];
const DAMPING: [[f64; 2]; 2] = [[11.0, -2.0], [-2.0, 15.0]];
const STIFFNESS: [[f64; 2]; 2] = [[300.0, -60.0], [-60.0, 520.0]];
const RATE_HZ: f64 = 500.0;

fn main() -> std::io::Result<()> {
    let target = std::env::args().nth(1).unwrap_or_else(|| "gallery.html".to_string());
    match gallery() {
        Ok(report) => {
            std::fs::write(&target, report.to_html())?;
            match std::env::args().nth(2) {
                Some(folder) => report.plot_files().iter().try_for_each(|file| std::fs::write(format!("{folder}/{}", file.name), &file.contents)),
                None => Ok(()),
            }
        }
        Err(error) => Err(std::io::Error::other(error)),
    }
}

/// Numbers that look random and are the same everywhere.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// C(f) = (M s² + B s + K)⁻¹ with every matrix times `factor`.
fn compliance(frequency_hz: &[f64], factor: f64) -> Array3<Complex64> {
    let mut response = Array3::zeros((2, 2, frequency_hz.len()));
    for (k, f) in frequency_hz.iter().enumerate() {
        let s = Complex64::new(0.0, TAU * f);
        let z = |p: usize, q: usize| factor * (INERTIA[p][q] * s * s + DAMPING[p][q] * s + STIFFNESS[p][q]);
        let determinant = z(0, 0) * z(1, 1) - z(0, 1) * z(1, 0);
        response[[0, 0, k]] = z(1, 1) / determinant;
        response[[1, 1, k]] = z(0, 0) / determinant;
        response[[0, 1, k]] = -z(0, 1) / determinant;
        response[[1, 0, k]] = -z(1, 0) / determinant;
    }
    response
}

/// The response as if measured: each bin off by a relative error, 95 % intervals of 1.96 times its size.
fn measured(label: &str, response: &Array3<Complex64>, relative: &Array3<f64>, noise: &mut Noise, style: CurveStyle) -> Curve {
    let seen = Array3::from_shape_fn(response.dim(), |at| response[at] * (1.0 + relative[at] * Complex64::new(noise.normal(), noise.normal())));
    let mut curve = Curve::from_response(label, &seen, style);
    let reach = relative.mapv(|error| 1.96 * error);
    curve.gain_ci95 = Some((&curve.gain * &reach.mapv(|r| (1.0 - r).max(0.0)), &curve.gain * &reach.mapv(|r| 1.0 + r)));
    let angle = reach.mapv(|r| if r < 1.0 { r.asin() } else { f64::NAN });
    curve.phase_ci95_rad = Some((&curve.phase_rad - &angle, &curve.phase_rad + &angle));
    curve
}

fn gallery() -> Result<Report, FigureError> {
    let mut noise = Noise(7);
    let frequency_hz: Vec<f64> = (4..320).map(|k| RATE_HZ / 8192.0 * f64::from(k)).collect();
    let axes: Vec<String> = ["x", "y"].map(String::from).to_vec();
    let truth = compliance(&frequency_hz, 1.0);
    let fitted = compliance(&frequency_hz, 1.01);
    let coherence_of = |p: usize, q: usize, f: f64| {
        let base = 1.0 - 0.55 * (-f / 0.6).exp() - 0.35 * (f / 20.0).powi(3);
        if p == q { base } else { 0.82 * base }
    };
    let partial = Array3::from_shape_fn(truth.dim(), |(p, q, k)| (coherence_of(p, q, frequency_hz[k]) * (1.0 - 0.06 * noise.uniform())).clamp(0.0, 1.0));
    let relative = partial.mapv(|c| ((1.0 - c) / (2.0 * c * 28.7)).sqrt());
    let curves = ResponseCurves {
        quantity: "Compliance".into(),
        unit: "m/N".into(),
        frequency_hz: frequency_hz.clone(),
        inputs: axes.clone(),
        outputs: axes.clone(),
        curves: vec![
            measured("direct", &(&truth * Complex64::new(0.93, 0.06)), &relative, &mut noise, CurveStyle::SECOND),
            measured("derived", &truth, &relative, &mut noise, CurveStyle::MEASURED),
            Curve::from_response("fitted", &fitted, CurveStyle::FITTED),
            Curve::from_response("simulated", &truth, CurveStyle::TRUE),
        ],
    };
    let ordinary = partial.mapv(|c| 0.8 * c);
    let multiple = partial.map_axis(Axis(1), |row| row.iter().fold(0.0f64, |best, value| best.max(*value)) * 0.99 + 0.01);
    let coherences = Coherences {
        frequency_hz: &frequency_hz,
        inputs: &axes,
        outputs: &axes,
        ordinary: &ordinary,
        partial: &partial,
        multiple: &multiple,
        significance_95: Some(0.19),
    };
    let between = Array3::from_shape_fn((2, 2, frequency_hz.len()), |_| 0.12 * noise.uniform().powi(2));
    let mut fit = Ellipse::new("fitted", STIFFNESS.map(|row| row.map(|value| 1.01 * value)), Color::Vermillion, Dash::Solid);
    fit.samples = (0..200).map(|_| STIFFNESS.map(|row| row.map(|value| value * 1.01 + 9.0 * noise.normal()))).collect();
    let simulated = Ellipse::new("simulated", STIFFNESS, Color::Ink, Dash::Dotted);
    let density = |level: f64, corner: f64| frequency_hz.iter().map(|f| level / (1.0 + (f / corner).powi(8))).collect::<Vec<_>>();
    let powers = [("force_x", "N²/Hz", 4.0), ("force_y", "N²/Hz", 3.0), ("pos_x", "m²/Hz", 2e-5), ("pos_y", "m²/Hz", 1e-5)];
    let powers =
        powers.map(|(label, unit, level)| Spectrum { label: label.into(), unit: unit.into(), density: density(level, if level > 1.0 { 15.0 } else { 2.5 }) });

    Ok(Report {
        title: "Arm study: MIT-MANUS with a patient-like arm".into(),
        lead: "The hand is held by a spring of 303 ± 5 N/m along x and 525 ± 8 N/m along y; six trials of 50 s explain 97 % of its motion.".into(),
        facts: [("Recording", "2 in, 2 out, 6 × 50.0 s at 500 Hz"), ("Method", "Welch, 4.79 effective averages a trial"), ("Band", "0.25 – 19.5 Hz"), ("R²", "0.9993")]
            .map(|(name, value)| (name.into(), value.into()))
            .to_vec(),
        command: "ndof study arm --seed 1 --out ndof-out/arm".into(),
        version: env!("CARGO_PKG_VERSION").into(),
        warnings: vec![Warning {
            code: "low-coherence".into(),
            message: "Below 0.5 Hz the partial coherence of y ← x is under the 95 % significance of 0.19; the limb moves there by itself.".into(),
            action: "Longer trials, or a stronger perturbation below 0.5 Hz, would narrow the intervals.".into(),
        }],
        sections: vec![
            Section::new("Impedance", "Inertia, damping and stiffness at the hand, fitted from 0.25 to 10 Hz; all intervals hold what was simulated.")
                .table(parameter_table("Parameters of the fit", &parameters()))
                .figure(ellipse("stiffness-ellipse", "Stiffness at the hand", ["x", "y"], "N/m", &[fit, simulated])?),
            Section::new("Frequency response", "Compliance measured two ways and the fitted model over it: the derived estimate follows the model, the direct one is biased by the closed loop.")
                .figure(bode("bode-compliance", &curves)?)
                .figure(nyquist("nyquist-compliance", &curves)?),
            Section::new("Coherence", "Above 1 Hz the inputs explain more than 90 % of the motion.")
                .figure(coherence("coherence", "Coherence of the direct estimate", coherences)?)
                .figure(input_coherence("input-coherence", &frequency_hz, &axes, &between, Some(0.19))?.unwrap_or_else(|| ndof_report::Figure::new("none", ""))),
            Section::new("Signals", "The first of six trials; the simulation starts from the fitted model.")
                .note("The last 15 s were held out: the model had not seen them.")
                .figure(traces("traces", "First trial", &signals(&mut noise))?)
                .figure(spectra("spectra", "Power by frequency", &frequency_hz, &powers, Some((0.5, 10.0)))?),
            diagnosis()?,
            sessions(&mut noise)?,
            Section::new("What remains", "The residual is white above 2 Hz.").figure(residual("residual", "Residual", (RATE_HZ, 0.0), &leftovers(&mut noise, &frequency_hz))?),
        ],
        settings: [("method", "welch"), ("nperseg", "8192"), ("noverlap", "4096"), ("nfft", "8192"), ("window", "hann"), ("detrend", "constant"), ("band_hz", "0.25 – 10")]
            .map(|(name, value)| (name.into(), value.into()))
            .to_vec(),
    })
}

/// A hysteresis that the baseline lacked, as a diagnosis would show it.
fn diagnosis() -> Result<Section, FigureError> {
    let parts = [("linear", 0.11), ("nonlinear", 0.62), ("time-varying", 0.05), ("noise", 0.22)].map(|(label, share)| (label.to_string(), share));
    let outputs = [("pos_x", 0.31, 0.11, 0.09), ("pos_y", 0.12, 0.10, 0.09)];
    let outputs = outputs.map(|(output, before, after, floor)| HeldOut { output: output.into(), before, after, floor });
    let causes = [
        ("hysteresis, limb, x", 0.83, 1e-9, ""),
        ("coulomb-friction, limb, x", 0.61, 1e-6, "explains less than hysteresis"),
        ("limb-noise, x", 0.02, 0.4, "chance"),
    ];
    let causes = causes.map(|(cause, share, p_value, why_not)| Considered {
        cause: cause.into(),
        explained: Estimate { value: share, ci95: (share - 0.06, share + 0.05) },
        p_value,
        named: why_not.is_empty(),
        why_not: why_not.into(),
    });
    let over = ("Frequency".to_string(), "Hz".to_string());
    let bands = Stretches {
        over,
        scale: Scale::Log,
        edges: vec![0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0],
        quantity: ("Error".into(), "% of the output".into()),
        lines: vec![("pos_x".into(), vec![42.0, 38.0, 21.0, 12.0, 10.0, 9.0]), ("pos_y".into(), vec![12.0, 11.0, 10.0, 11.0, 9.0, 9.0])],
    };
    let estimate = |value: f64, half: f64| Estimate { value, ci95: (value - half, value + half) };
    let shift = Forest {
        quantity: "Relative to the extended model".into(),
        unit: "%".into(),
        scale: Scale::Linear,
        rows: ["M_x_x", "B_x_x", "K_x_x"].map(String::from).to_vec(),
        groups: vec![
            ForestGroup {
                label: "baseline".into(),
                color: Color::Vermillion,
                estimates: vec![estimate(101.0, 2.0), estimate(138.0, 5.0), estimate(94.0, 2.0)],
            },
            ForestGroup { label: "extended".into(), color: Color::Blue, estimates: vec![estimate(100.0, 1.8), estimate(100.0, 4.0), estimate(100.0, 1.9)] },
        ],
        reference: Some((100.0, "extended model".into())),
    };
    Ok(Section::new("Diagnosis", "Below 1 Hz the arm holds back along x: a hysteresis of 0.9 ± 0.1 N explains 83 % of what the linear model missed.")
        .list(vec!["The missing force runs in a loop over position, not in a step over velocity: friction explains 61 %.".into()])
        .figure(shares("shares", "What kind of error it is", &parts)?)
        .figure(discrepancy("by-band", "Where it lives", &bands)?)
        .figure(considered("causes", "The named cause beside its look-alikes", &causes)?)
        .figure(before_after("gain", "What is gained", &outputs)?)
        .figure(forest("shift", "What the missing cause had biased", &shift)?))
}

/// Twenty subjects.
fn sessions(noise: &mut Noise) -> Result<Section, FigureError> {
    let first: Vec<f64> = (0..20).map(|k| 220.0 + 12.0 * f64::from(k) + 20.0 * noise.normal()).collect();
    let estimate = |value: f64, half: f64| Estimate { value, ci95: (value - half, value + half) };
    let cohort = Forest {
        quantity: "Stiffness along y".into(),
        unit: "N/m".into(),
        scale: Scale::Linear,
        rows: (1..=20).map(|k| format!("subject {k:02}")).collect(),
        groups: vec![ForestGroup { label: "first session".into(), color: Color::Blue, estimates: first.iter().map(|value| estimate(*value, 11.0)).collect() }],
        reference: None,
    };
    Ok(Section::new("Subjects and sessions", "Stiffness along y.").figure(forest("cohort", "Twenty subjects", &cohort)?))
}

fn parameters() -> Vec<ComparedParameter> {
    let mut list = Vec::new();
    for (symbol, unit, matrix, half) in [("M", "kg", INERTIA, 0.031), ("B", "N s/m", DAMPING, 0.42), ("K", "N/m", STIFFNESS, 5.2)] {
        for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let value = matrix[p][q] + half * 0.6 * (1.0 + p as f64 * 1.7 + q as f64 * 2.3).sin();
            let axis = ["x", "y"];
            list.push(ComparedParameter {
                name: format!("{symbol}_{}_{}", axis[p], axis[q]),
                unit: unit.into(),
                truth: Some(matrix[p][q]),
                value: Some(value),
                ci95: Some([value - half, value + half]),
                identifiable: true,
            });
        }
    }
    list
}

/// A smooth random signal: first-order lag of white noise.
fn coloured(noise: &mut Noise, count: usize, corner_hz: f64, scale: f64) -> Vec<f64> {
    let keep = (-TAU * corner_hz / RATE_HZ).exp();
    let mut state = 0.0;
    (0..count)
        .map(|_| {
            state = keep * state + (1.0 - keep * keep).sqrt() * noise.normal();
            scale * state
        })
        .collect()
}

fn signals(noise: &mut Noise) -> Traces {
    let count = 25_000;
    let mut list = Vec::new();
    for (axis, stiffness) in [("x", 300.0), ("y", 520.0)] {
        let force = coloured(noise, count, 10.0, 4.0);
        let (mut position, mut velocity) = (0.0, 0.0);
        let simulated: Vec<f64> = force
            .iter()
            .map(|force| {
                velocity += (force - 12.0 * velocity - stiffness * position) / 2.0 / RATE_HZ;
                position += velocity / RATE_HZ;
                position
            })
            .collect();
        let wander = coloured(noise, count, 0.3, 1.2e-3);
        let measured = simulated.iter().zip(&wander).enumerate().map(|(k, (a, b))| if (9000..9600).contains(&k) { f64::NAN } else { a + b }).collect();
        list.push(Trace { label: format!("force_{axis}"), unit: "N".into(), measured: force, simulated: Vec::new() });
        list.push(Trace { label: format!("pos_{axis}"), unit: "m".into(), measured, simulated: vec![("simulated".into(), simulated)] });
    }
    Traces { sample_rate_hz: RATE_HZ, start_s: 0.0, traces: list, detail_s: Some((20.0, 22.0)) }
}

fn leftovers(noise: &mut Noise, frequency_hz: &[f64]) -> Vec<Residual> {
    let one = |axis: &str, noise: &mut Noise| Residual {
        output: format!("pos_{axis}"),
        unit: "m".into(),
        left: Leftover {
            samples: coloured(noise, 25_000, 0.4, 8e-4),
            frequency_hz: frequency_hz.to_vec(),
            density: frequency_hz.iter().map(|f| 1e-7 / (1.0 + (f / 0.4).powi(2)) * (1.0 + 0.5 * noise.uniform())).collect(),
            output_density: frequency_hz.iter().map(|f| 2e-5 / (1.0 + (f / 2.5).powi(4)) * (1.0 + 0.5 * noise.uniform())).collect(),
            autocorrelation: Array2::from_shape_fn((1, 500), |(_, k)| (-(k as f64) / 200.0).exp() * (PI * k as f64 / 400.0).cos()).into_raw_vec_and_offset().0,
            lag_rate_hz: RATE_HZ,
            white_95: 0.06,
            vaf_percent: 96.0,
        },
    };
    vec![one("x", noise), one("y", noise)]
}
