//! C3D, the format of motion capture: points in space and analog channels, frame by frame.
//!
//! A point `LABEL` becomes the channels `LABEL_x`, `LABEL_y`, `LABEL_z`; one that was not seen is a missing sample. Analog channels go
//! by their labels; where they are faster than the points, these are interpolated onto their clock. Parameters are facts as
//! `GROUP.NAME`, events as `event/LABEL`. After "The C3D File Format", C3D.org, user guide of 2021.

mod events;
mod parameters;

use crate::error::IoError;
use crate::join::{Stream, Times, join};
use crate::limits::{Budget, MAX_CHANNELS};
use crate::table::{Column, Rounding, Table};
pub(crate) use parameters::Parameters;
use parameters::{BLOCK, Processor};

/// The format's name in messages.
const C3D: &str = "C3D";

/// Numbers of a point: three coordinates, and how well it was seen.
const OF_POINT: usize = 4;

/// Lists of points that are no positions, with the parameter of their unit.
const OTHER_POINTS: [(&str, &str); 5] =
    [("ANGLES", "ANGLE_UNITS"), ("FORCES", "FORCE_UNITS"), ("MOMENTS", "MOMENT_UNITS"), ("POWERS", "POWER_UNITS"), ("SCALARS", "SCALAR_UNITS")];

/// Reads a C3D file.
pub(crate) fn read(bytes: &[u8], file: &str) -> Result<Table, IoError> {
    let mut budget = Budget::of(bytes.len());
    let (mut table, parameters) = read_with_parameters(bytes, file, &mut budget)?;
    table.metadata.extend(parameters.facts());
    Ok(table)
}

/// The parameters alone.
pub(crate) fn parameters(bytes: &[u8], file: &str) -> Result<Parameters, IoError> {
    open(bytes, file).map(|(_, parameters)| parameters)
}

fn open(bytes: &[u8], file: &str) -> Result<(Processor, Parameters), IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: C3D, what };
    let start = usize::from(bytes.first().copied().unwrap_or(0)).saturating_sub(1) * BLOCK;
    let processor = bytes.get(start + 3).and_then(|&byte| Processor::of(byte)).filter(|_| bytes.len() >= BLOCK && start >= BLOCK);
    let processor = processor.ok_or_else(|| damaged("its header of 512 bytes or its parameters are not there".to_owned()))?;
    Ok((processor, Parameters::read(bytes, start, processor).map_err(damaged)?))
}

/// Where the numbers of a file stand and what they mean.
struct Layout {
    processor: Processor,
    points: usize,
    channels: usize,
    /// Analog samples a frame.
    per_frame: usize,
    frames: usize,
    first_frame: f64,
    rate_hz: f64,
    /// Metres or the like for each step of a whole number; numbers with a point are written as they are.
    scale: f64,
    floats: bool,
    data: usize,
}

/// The table of a file without its facts but the events, and the parameters; its numbers are taken from `budget`.
pub(crate) fn read_with_parameters(bytes: &[u8], file: &str, budget: &mut Budget) -> Result<(Table, Parameters), IoError> {
    let damaged = |what: String| IoError::Damaged { file: file.to_owned(), format: C3D, what };
    let (processor, parameters) = open(bytes, file)?;
    let layout = layout(bytes, processor, &parameters).map_err(damaged)?;
    let values = layout.points * (OF_POINT - 1) + layout.channels;
    if values > MAX_CHANNELS {
        return Err(IoError::too_large(file, "channels", values, MAX_CHANNELS, "export the points and channels that are needed"));
    }
    if values == 0 || layout.frames == 0 {
        return Err(IoError::unsuitable(
            file,
            "it has neither points nor analog channels over time",
            "a recording needs at least one; this file may hold parameters only",
        ));
    }
    let samples = layout.frames as u64 * (3 * layout.points + layout.channels * layout.per_frame) as u64;
    budget.claim(file, 8 * samples)?;
    let (points, channels) = numbers(&bytes[layout.data..], &layout, &parameters);
    let facts = events::facts(bytes, processor, &parameters);
    let start_s = (layout.first_frame - 1.0).max(0.0) / layout.rate_hz;
    let mut table = if layout.per_frame > 1 && !points.is_empty() {
        let stream = |name: &str, rate_hz, columns| Stream { name: name.to_owned(), times: Times::Regular { start_s, rate_hz }, columns };
        join(file, vec![stream("points", layout.rate_hz, points), stream("analog", layout.rate_hz * layout.per_frame as f64, channels)], budget)?
    } else {
        let mut table = Table { columns: points.into_iter().chain(channels).collect(), ..Table::default() };
        table.set_clock(layout.rate_hz * layout.per_frame as f64, start_s);
        table
    };
    table.rename_repeated();
    table.metadata.extend(facts);
    Ok((table, parameters))
}

fn layout(bytes: &[u8], processor: Processor, parameters: &Parameters) -> Result<Layout, String> {
    let mut header = processor.cursor(&bytes[2..BLOCK]);
    let mut word = || header.u16().map_or(0, usize::from);
    let (points, measures, first, last, _gap) = (word(), word(), word(), word(), word());
    let scale = f64::from(processor.f32(&mut header).unwrap_or(0.0));
    let (data_block, per_frame) = (header.u16().map_or(0, usize::from), header.u16().map_or(0, usize::from));
    let header_rate = f64::from(processor.f32(&mut header).unwrap_or(0.0));
    let rate_hz = parameters.number("POINT", "RATE").filter(|rate| *rate > 0.0).unwrap_or(header_rate);
    if !(rate_hz.is_finite() && rate_hz > 0.0) {
        return Err(format!("its rate is {rate_hz} Hz"));
    }
    let channels = if measures == 0 { 0 } else { measures.checked_div(per_frame).filter(|n| n * per_frame == measures).unwrap_or(0) };
    if measures > 0 && channels == 0 {
        return Err(format!("{measures} analog numbers in a frame are no multiple of {per_frame}"));
    }
    let scale = parameters.number("POINT", "SCALE").filter(|s| *s != 0.0).unwrap_or(scale);
    let floats = scale < 0.0;
    let (first_frame, frames) = frames(parameters, first, last);
    let data = data_block.checked_sub(1).map(|b| b * BLOCK).filter(|at| *at <= bytes.len()).ok_or("its numbers lie outside of the file")?;
    let frame_bytes = (points * OF_POINT + measures) * if floats { 4 } else { 2 };
    let there = (bytes.len() - data).checked_div(frame_bytes).unwrap_or(0);
    if frame_bytes > 0 && there < frames {
        return Err(format!("it has {frames} frames by its header, and {there} of {frame_bytes} bytes are there"));
    }
    Ok(Layout { processor, points, channels, per_frame: per_frame.max(1), frames, first_frame, rate_hz, scale: scale.abs(), floats, data })
}

/// The first frame and how many there are. The header counts to 65 535, so longer files say it elsewhere.
fn frames(parameters: &Parameters, first: usize, last: usize) -> (f64, usize) {
    // Two words of 16 bits, of which a number was made with a sign each.
    let long = |name: &str| match parameters.numbers("TRIAL", name)[..] {
        [low, high, ..] => Some(low.rem_euclid(65_536.0) + 65_536.0 * high.rem_euclid(65_536.0)),
        _ => None,
    };
    let (first, last) = match (long("ACTUAL_START_FIELD"), long("ACTUAL_END_FIELD"), parameters.number("POINT", "LONG_FRAMES")) {
        (Some(first), Some(last), _) => (first, last),
        (_, _, Some(last)) if last >= first as f64 => (first as f64, last),
        _ => (first as f64, last as f64),
    };
    (first, (last - first + 1.0).clamp(0.0, u32::MAX.into()) as usize)
}

/// The columns of points, and those of analog channels.
fn numbers(data: &[u8], layout: &Layout, parameters: &Parameters) -> (Vec<Column>, Vec<Column>) {
    let unsigned = parameters.texts("ANALOG", "FORMAT").first().is_some_and(|f| f.eq_ignore_ascii_case("unsigned"));
    let rounding = if layout.floats { Rounding::SINGLE } else { Rounding::default() };
    let mut points = point_columns(layout, parameters, rounding);
    let mut analog = analog_columns(layout, parameters, unsigned, rounding);
    let mut cursor = layout.processor.cursor(data);
    for _ in 0..layout.frames {
        for k in 0..layout.points {
            let mut next = || if layout.floats { layout.processor.f32(&mut cursor).map(f64::from) } else { cursor.i16().map(f64::from) }.unwrap_or(f64::NAN);
            let (place, seen) = ([next(), next(), next()], next());
            let scale = if layout.floats { 1.0 } else { layout.scale };
            for (column, value) in points[3 * k..3 * k + 3].iter_mut().zip(place) {
                // A residual below zero says that no camera saw the point.
                column.samples.push(if seen < 0.0 { f64::NAN } else { scale * value });
            }
        }
        for _ in 0..layout.per_frame {
            for (column, (offset, factor)) in &mut analog {
                let raw = match (layout.floats, unsigned) {
                    (true, _) => layout.processor.f32(&mut cursor).map(f64::from),
                    (false, true) => cursor.u16().map(f64::from),
                    (false, false) => cursor.i16().map(f64::from),
                };
                column.samples.push((raw.unwrap_or(f64::NAN) - *offset) * *factor);
            }
        }
    }
    (points, analog.into_iter().map(|(column, _)| column).collect())
}

fn point_columns(layout: &Layout, parameters: &Parameters, rounding: Rounding) -> Vec<Column> {
    let labels = parameters.texts("POINT", "LABELS");
    let unit = parameters.texts("POINT", "UNITS").into_iter().find(|unit| !unit.is_empty());
    let others = OTHER_POINTS.map(|(list, unit)| (parameters.texts("POINT", list), parameters.texts("POINT", unit).into_iter().next()));
    let kinarm =
        parameters.texts("MANUFACTURER", "SOFTWARE").iter().chain(&parameters.texts("MANUFACTURER", "COMPANY")).any(|t| t.to_uppercase().contains("BKIN"));
    // KINARM's two points are its hands, and its own scripts call the channels so.
    let (ends, hands) = if kinarm { (["X", "Y", "Z"], ["Right_Hand", "Left_Hand"]) } else { (["_x", "_y", "_z"], [""; 2]) };
    let label = |k: usize| match (hands.get(k).filter(|hand| !hand.is_empty()), labels.get(k)) {
        (Some(hand), _) => (*hand).to_owned(),
        (None, Some(label)) if !label.is_empty() => label.clone(),
        _ => format!("point_{}", k + 1),
    };
    let unit_of = |label: &String| others.iter().find(|(list, _)| list.contains(label)).map_or_else(|| unit.clone(), |(_, unit)| unit.clone());
    let column = |(k, end): (usize, &str)| Column {
        name: format!("{}{end}", label(k)),
        unit: labels.get(k).map_or_else(|| unit.clone(), unit_of),
        samples: Vec::with_capacity(layout.frames),
        rounding,
    };
    (0..layout.points).flat_map(|k| ends.map(|end| (k, end))).map(column).collect()
}

/// Each analog channel with its zero and its scale: value = (raw − zero) · scale.
fn analog_columns(layout: &Layout, parameters: &Parameters, unsigned: bool, rounding: Rounding) -> Vec<(Column, (f64, f64))> {
    let (labels, units) = (parameters.texts("ANALOG", "LABELS"), parameters.texts("ANALOG", "UNITS"));
    let (scales, offsets) = (parameters.numbers("ANALOG", "SCALE"), parameters.numbers("ANALOG", "OFFSET"));
    let general = parameters.number("ANALOG", "GEN_SCALE").unwrap_or(1.0);
    let column = |k: usize| {
        let name = labels.get(k).filter(|label| !label.is_empty()).cloned().unwrap_or_else(|| format!("analog_{}", k + 1));
        let offset = offsets.get(k).map_or(0.0, |&offset| if unsigned { offset.rem_euclid(65_536.0) } else { offset });
        let unit = units.get(k).filter(|unit| !unit.is_empty()).cloned();
        let samples = Vec::with_capacity(layout.frames * layout.per_frame);
        (Column { name, unit, samples, rounding }, (offset, scales.get(k).copied().unwrap_or(1.0) * general))
    };
    (0..layout.channels).map(column).collect()
}
