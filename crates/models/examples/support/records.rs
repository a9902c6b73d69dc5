//! Measured records of others, where they are at hand: `../shared/data` beside the repository.

use ndof_models::Axis;
use ndof_models::time::{Causality, FreeRun, FreeRunError, FreeRunFit, Mechanism, Score, TimeTrial, laws};

/// Columns of a CSV file; `None` where it is not at hand.
pub fn columns(file: &str) -> Option<Vec<Vec<f64>>> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(file);
    let text = std::fs::read_to_string(path).ok()?;
    let rows: Vec<Vec<f64>> =
        text.lines().filter(|l| !l.starts_with('#')).skip(1).map(|l| l.split(',').filter_map(|v| v.trim().parse().ok()).collect()).collect();
    let width = rows.first()?.len();
    Some((0..width).map(|c| rows.iter().filter(|r| r.len() == width).map(|r| r[c]).collect()).collect())
}

/// Share of a record that is fitted; the rest is held out.
const FITTED: f64 = 0.7;

/// A model of a record: its name, the fit, and how it runs on held-out data.
pub struct Row {
    /// What it is.
    pub name: &'static str,
    /// The fit.
    pub fit: FreeRun,
    /// Free run on held-out data, initial states fitted.
    pub held_out: Score,
}

fn row(
    name: &'static str,
    settings: &FreeRunFit,
    mechanism: &Mechanism,
    fitted: &TimeTrial<'_>,
    held_out: &TimeTrial<'_>,
    starts: &[Vec<f64>],
) -> Result<Row, FreeRunError> {
    let fit = settings.fit_from(mechanism, std::slice::from_ref(fitted), starts)?;
    let held_out = settings.validate(mechanism, &fit.theta, std::slice::from_ref(held_out))?;
    Ok(Row { name, fit, held_out })
}

/// The EMPS carriage: as published, motion in and force out over the whole record, and held out, free-running from the force.
pub fn emps() -> Option<Result<(FreeRun, Vec<Row>), FreeRunError>> {
    let c = columns("emps/DATA_EMPS.csv")?;
    let (force, position) = (&c[2][..], &c[3][..]);
    Some(carriage(force, position))
}

fn carriage(force: &[f64], position: &[f64]) -> Result<(FreeRun, Vec<Row>), FreeRunError> {
    let smooth = Mechanism { spring: false, offset: true, ..Mechanism::new(vec![Axis::linear("carriage")]) };
    let dry = smooth.clone().with(laws::Coulomb { turn_velocity: 1e-4 }, 0);
    let settings = FreeRunFit {
        causality: Causality::MotionIn,
        motion_low_pass_hz: Some(100.0),
        output_low_pass_hz: Some(40.0),
        settle_s: 0.1,
        ..FreeRunFit::new(1000.0)
    };
    let whole = TimeTrial { force: vec![force], motion: vec![position], ..TimeTrial::default() };
    let published = settings.fit(&dry, &[whole], &[80.0, 100.0, 0.0, 5.0])?;
    let cut = (force.len() as f64 * FITTED) as usize;
    let part = |range: std::ops::Range<usize>| TimeTrial { force: vec![&force[range.clone()]], motion: vec![&position[range]], ..TimeTrial::default() };
    let (fitted, held_out) = (part(0..cut), part(cut..force.len()));
    let steep = FreeRunFit { window_s: Some(2.0), substeps: 2, ..FreeRunFit::new(1000.0) };
    let mut rows = Vec::new();
    for (name, mechanism, start) in [("mass, damper, offset", &smooth, vec![80.0, 100.0, 0.0]), ("and dry friction", &dry, vec![80.0, 100.0, 0.0, 5.0])] {
        let fit = settings.fit(mechanism, std::slice::from_ref(&fitted), &start)?;
        let run = match mechanism.laws.first() {
            // A free run turns around within 1 mm/s; the regression knows the sign exactly.
            Some(_) => smooth.clone().with(laws::Coulomb { turn_velocity: 1e-3 }, 0),
            None => smooth.clone(),
        };
        let held_out = steep.validate(&run, &fit.theta, std::slice::from_ref(&held_out))?;
        rows.push(Row { name, fit, held_out });
    }
    Ok((published, rows))
}

/// The ankle: angle in, torque out (the transducer reads the reaction), intrinsic alone and with each kind of reflex.
pub fn ankle() -> Option<Result<Vec<Row>, FreeRunError>> {
    let c = columns("ankle/z_pf.csv")?;
    let torque: Vec<f64> = c[1].iter().map(|t| -t).collect();
    Some(reflexes(&c[0], &torque))
}

fn reflexes(angle: &[f64], torque: &[f64]) -> Result<Vec<Row>, FreeRunError> {
    let cut = (angle.len() as f64 * FITTED) as usize;
    let part = |range: std::ops::Range<usize>| TimeTrial { force: vec![&torque[range.clone()]], motion: vec![&angle[range]], ..TimeTrial::default() };
    let (fitted, held_out) = (part(0..cut), part(cut..angle.len()));
    let settings =
        FreeRunFit { causality: Causality::MotionIn, motion_low_pass_hz: Some(50.0), output_low_pass_hz: Some(50.0), settle_s: 1.0, ..FreeRunFit::new(1000.0) };
    let intrinsic = Mechanism::new(vec![Axis::rotational("ankle")]).with_offset();
    let base = [0.015, 0.8, 80.0, 0.0];
    let with = |reflex: &[f64]| {
        vec![base.iter().copied().chain(reflex.iter().copied()).collect::<Vec<f64>>(), base.iter().copied().chain(reflex.iter().map(|v| v * 1.2)).collect()]
    };
    let mut rows = vec![row("inertia, damping, stiffness", &settings, &intrinsic, &fitted, &held_out, &[base.to_vec()])?];
    for (name, mechanism, starts) in [
        ("and a linear reflex", intrinsic.clone().with(laws::LinearReflex, 0), with(&[1.0, 3.0, 0.04, 3.0])),
        ("and a reflex to positive velocity", intrinsic.clone().with(laws::OneDirectionalReflex { positive: true }, 0), with(&[5.0, 0.04, 3.0])),
        ("and a reflex to negative velocity", intrinsic.clone().with(laws::OneDirectionalReflex { positive: false }, 0), with(&[5.0, 0.04, 3.0])),
    ] {
        rows.push(row(name, &settings, &mechanism, &fitted, &held_out, &starts)?);
    }
    Ok(rows)
}

/// The damper: held-out VAF (percent) of the best static curve of velocity of any shape, and models with states.
pub fn damper() -> Option<Result<(f64, Vec<Row>), FreeRunError>> {
    let read = |file: &str| -> Option<(Vec<f64>, Vec<f64>)> {
        let mut c = columns(file)?.into_iter();
        // Centimetres a second; the load cell reads the reaction.
        Some((c.next()?.iter().map(|v| 0.01 * v).collect(), c.next()?.iter().map(|f| -f).collect()))
    };
    let (a, b) = (read("mr_damper/magneto_est.csv")?, read("mr_damper/magneto_val.csv")?);
    Some(loops(&a, &b))
}

fn loops(a: &(Vec<f64>, Vec<f64>), b: &(Vec<f64>, Vec<f64>)) -> Result<(f64, Vec<Row>), FreeRunError> {
    fn given(r: &(Vec<f64>, Vec<f64>)) -> TimeTrial<'_> {
        TimeTrial { force: vec![&r.1], motion: Vec::new(), velocity: vec![&r.0] }
    }
    let settings = FreeRunFit { causality: Causality::MotionIn, settle_s: 0.5, substeps: 4, ..FreeRunFit::new(200.0) };
    let plain = Mechanism::new(vec![Axis::linear("piston")]).with_offset();
    let base = [1.0, 100.0, 0.0, 0.0];
    let rows = [
        ("linear", plain.clone(), vec![base.to_vec()]),
        ("and Coulomb friction", plain.clone().with(laws::Coulomb { turn_velocity: 0.01 }, 0), vec![[base.to_vec(), vec![50.0]].concat()]),
        (
            "and Bouc-Wen",
            plain.with(laws::BoucWen, 0),
            [1e4, 5e4].iter().flat_map(|k| [5e-4, 2e-3].iter().map(move |y| [base.to_vec(), vec![*k, *y, 0.3]].concat())).collect(),
        ),
    ]
    .into_iter()
    .map(|(name, mechanism, starts)| row(name, &settings, &mechanism, &given(a), &given(b), &starts))
    .collect::<Result<Vec<_>, _>>()?;
    Ok((best_static(a, b), rows))
}

/// The mean force of each of forty classes of velocity, linear between them: no curve of velocity does better but by what
/// it takes from noise.
fn best_static(a: &(Vec<f64>, Vec<f64>), b: &(Vec<f64>, Vec<f64>)) -> f64 {
    let mut order: Vec<usize> = (0..a.0.len()).collect();
    order.sort_by(|&i, &j| a.0[i].total_cmp(&a.0[j]));
    let class = a.0.len().div_ceil(40);
    let mean = |c: &[usize], v: &[f64]| c.iter().map(|&k| v[k]).sum::<f64>() / c.len() as f64;
    let knots: Vec<(f64, f64)> = order.chunks(class).map(|c| (mean(c, &a.0), mean(c, &a.1))).collect();
    let curve = |v: f64| {
        let k = knots.partition_point(|x| x.0 < v).clamp(1, knots.len() - 1);
        let ((x0, y0), (x1, y1)) = (knots[k - 1], knots[k]);
        y0 + (y1 - y0) * ((v - x0) / (x1 - x0)).clamp(0.0, 1.0)
    };
    let error: Vec<f64> = b.0.iter().zip(&b.1).map(|(v, f)| f - curve(*v)).collect();
    let variance = |v: &[f64]| {
        let m = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|x| (x - m).powi(2)).sum::<f64>() / v.len() as f64
    };
    100.0 * (1.0 - variance(&error) / variance(&b.1))
}
