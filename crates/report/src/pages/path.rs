//! The hand's mean path with its stiffness along it.

use crate::Figure;
use crate::figures::{self, EllipsePath, FigureError, PathEllipse, PathStretch};
use ndof_analysis::fit::schedule::result::{MeanChannel, ScheduleEntry, ScheduleResult};
use ndof_analysis::{TIME, Trials};

/// Ellipses on a path.
const ELLIPSES: usize = 10;
/// A mean over so many cycles of a hand at rest spreads by this many of its standard errors: three to each side.
const AT_REST: f64 = 6.0;

/// Stiffness ellipses along the mean path of a hand in a plane.
///
/// Nothing where there are not just two translations, where the schedule is time (what changes over minutes is no path), where the mean does
/// not move beyond what the deviations of `trials` leave of it, or where no symmetric stiffness exists.
pub(super) fn path_figure(found: &ScheduleResult, trials: &Trials) -> Result<Option<Figure>, FigureError> {
    let Some((motions, entries)) = plane(found) else { return Ok(None) };
    let path: Vec<[f64; 2]> = motions[0].value.iter().zip(&motions[1].value).map(|(x, y)| [*x, *y]).collect();
    let (ends, extent) = furthest(&path);
    if found.schedule == TIME || !moves(extent, &motions, found.blocks, trials) {
        return Ok(None);
    }
    let stretches = stretches(path.len(), ends, found.cycle_s.is_some());
    let each = ELLIPSES / stretches.len();
    let mut left_out = 0;
    let mut draw = |places: &Vec<usize>| {
        let chosen = spaced(&path, places, each);
        let ellipses: Vec<PathEllipse> = chosen.iter().filter_map(|k| ellipse(found, &entries, &path, *k)).collect();
        left_out += chosen.len() - ellipses.len();
        let title = match (places.first(), places.last()) {
            (Some(first), Some(last)) => format!("{} {} to {}", found.label(), place(found, *first), place(found, *last)),
            _ => String::new(),
        };
        let of = |axis: usize| places.iter().map(|k| path[*k][axis]).collect();
        PathStretch { title, x: of(0), y: of(1), ellipses }
    };
    let stretches: Vec<PathStretch> = stretches.iter().map(&mut draw).collect();
    if stretches.iter().all(|stretch| stretch.ellipses.len() < 2) {
        return Ok(None);
    }
    let axes = [0, 1].map(|k| (motions[k].channel.clone(), motions[k].unit.clone()));
    let data = EllipsePath { axes, unit: entries[0].unit.clone(), place: found.label(), stretches };
    let figure = figures::ellipse_path("ellipses-along-the-path", "Stiffness ellipses along the mean path", &data)?;
    Ok(Some(figure.caption(caption(found, left_out))))
}

fn caption(found: &ScheduleResult, left_out: usize) -> String {
    let unit = if found.unit.is_empty() { String::new() } else { format!(" [{}]", found.unit) };
    let mut text = format!(
        "The restoring force to a displacement of unit length in every direction, at places evenly spaced along the path; numbers: {}{unit}. \
         The symmetric part of K; intervals are those of the curves above.",
        found.label().to_lowercase()
    );
    if left_out > 0 {
        text += &format!(" At {left_out} more places the antisymmetric part is larger than the least stiffness, and there is no ellipse.");
    }
    text
}

/// The two displacements and the stiffness, row by row, of a hand in a plane.
fn plane(found: &ScheduleResult) -> Option<([&MeanChannel; 2], [&ScheduleEntry; 4])> {
    let stiffness: Vec<&ScheduleEntry> = found.entries.iter().filter(|entry| entry.name.starts_with('K')).collect();
    let stiffness: [&ScheduleEntry; 4] = stiffness.try_into().ok()?;
    // The motions stand first.
    let motions = [found.mean_movement.first()?, found.mean_movement.get(1)?];
    (stiffness.iter().all(|entry| entry.unit == "N/m") && motions.iter().all(|mean| mean.unit == "m")).then_some((motions, stiffness))
}

/// The two places that are furthest apart, and how far.
fn furthest(path: &[[f64; 2]]) -> ([usize; 2], f64) {
    let pairs = (0..path.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
    let apart = |[i, j]: [usize; 2]| (path[j][0] - path[i][0]).hypot(path[j][1] - path[i][1]);
    pairs.map(|pair| (pair, apart(pair))).filter(|(_, far)| far.is_finite()).fold(([0, 0], 0.0), |best, next| if next.1 > best.1 { next } else { best })
}

/// Whether a path of this extent is more than what deviations leave of a mean over so many cycles.
fn moves(extent: f64, motions: &[&MeanChannel; 2], cycles: usize, trials: &Trials) -> bool {
    let variance = |values: &mut dyn Iterator<Item = f64>| {
        let (count, sum, squares) = values.filter(|v| v.is_finite()).fold((0.0, 0.0, 0.0), |(n, s, q), v| (n + 1.0, s + v, q + v * v));
        squares / count - (sum / count).powi(2)
    };
    let deviation = |mean: &MeanChannel| {
        let recordings = trials.recordings();
        let all = variance(&mut recordings.iter().filter_map(|r| r.channel(&mean.channel).ok()).flat_map(|channel| channel.samples.iter().copied()));
        (all - variance(&mut mean.value.iter().copied())).max(0.0)
    };
    let deviations: f64 = motions.iter().map(|mean| deviation(mean)).sum();
    extent > AT_REST * (deviations / cycles as f64).sqrt()
}

/// The places of a path: all in one, or there and back where it is a cycle, from one of the two ends to the other.
fn stretches(count: usize, [first, last]: [usize; 2], cycle: bool) -> Vec<Vec<usize>> {
    if !cycle {
        return vec![(0..count).collect()];
    }
    // The last place of a cycle is its first again.
    let around = count.saturating_sub(1).max(1);
    let length = last - first;
    vec![(first..=last).collect(), (last..=last + around - length).map(|k| if k < count { k } else { k - around }).collect()]
}

/// Of some places the `wanted` that divide the way along them most evenly, ends included, each once.
fn spaced(path: &[[f64; 2]], places: &[usize], wanted: usize) -> Vec<usize> {
    let step = |pair: &[usize]| (path[pair[1]][0] - path[pair[0]][0]).hypot(path[pair[1]][1] - path[pair[0]][1]);
    let along: Vec<f64> = std::iter::once(0.0)
        .chain(places.windows(2).scan(0.0, |sum, pair| {
            *sum += step(pair);
            Some(*sum)
        }))
        .collect();
    let whole = along.last().copied().unwrap_or(0.0);
    let nearest = |target: f64| along.iter().enumerate().min_by(|a, b| (a.1 - target).abs().total_cmp(&(b.1 - target).abs())).map(|(k, _)| places[k]);
    let mut chosen: Vec<usize> = (0..wanted).filter_map(|k| nearest(whole * k as f64 / (wanted - 1) as f64)).collect();
    chosen.dedup();
    chosen
}

/// The symmetric part at a place. Nothing where the antisymmetric part, whose force is at right angles to every displacement, is larger than the
/// force that restores the softest one: then no ellipse says where the force points.
fn ellipse(found: &ScheduleResult, entries: &[&ScheduleEntry; 4], path: &[[f64; 2]], k: usize) -> Option<PathEllipse> {
    let [xx, xy, yx, yy] = entries.map(|entry| entry.value[k]);
    let (shear, turn) = (0.5 * (xy + yx), 0.5 * (xy - yx));
    let softest = 0.5 * (xx + yy) - (0.5 * (xx - yy)).hypot(shear);
    let symmetric = |[xx, xy, yx, yy]: [f64; 4]| [[xx, 0.5 * (xy + yx)], [0.5 * (xy + yx), yy]];
    let truth: Option<Vec<f64>> = entries.iter().map(|entry| entry.truth.as_ref().map(|truth| truth[k])).collect();
    let truth = truth.and_then(|truth| <[f64; 4]>::try_from(truth).ok()).map(symmetric);
    (softest > turn.abs()).then(|| PathEllipse { label: place(found, k), centre: path[k], matrix: symmetric([xx, xy, yx, yy]), truth })
}

/// A place of the schedule as people read it: to a hundredth of its range, as the curves are given.
fn place(found: &ScheduleResult, k: usize) -> String {
    let range = found.at.last().copied().unwrap_or(1.0) - found.at.first().copied().unwrap_or(0.0);
    let decimals = (2.0 - range.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{:.decimals$}", found.at[k]).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_analysis::Trial;

    const PLACES: usize = 101;

    fn phase(k: usize) -> f64 {
        k as f64 / (PLACES - 1) as f64
    }

    /// To and fro along x by 2 cm, with K = [[300, xy], [yx, 400]] in `units` of stiffness and of motion.
    fn moving([xy, yx]: [f64; 2], units: [&str; 2]) -> ScheduleResult {
        let entry = |name: &str, value: f64| ScheduleEntry {
            name: name.to_owned(),
            unit: units[0].to_owned(),
            varies: true,
            value: vec![value; PLACES],
            std_error: vec![1.0; PLACES],
            ci95: [vec![value; PLACES], vec![value; PLACES]],
            band95: [vec![value; PLACES], vec![value; PLACES]],
            degrees_of_freedom: 1.0,
            truth: None,
        };
        let mean = |channel: &str, size: f64| MeanChannel {
            channel: channel.to_owned(),
            unit: units[1].to_owned(),
            value: (0..PLACES).map(|k| -size * (std::f64::consts::TAU * phase(k)).cos()).collect(),
        };
        ScheduleResult {
            schedule: "phase".to_owned(),
            at: (0..PLACES).map(phase).collect(),
            cycle_s: Some(1.0),
            blocks: 25,
            high_hz: 10.0,
            samples: 1000,
            entries: [("K_x_x", 300.0), ("K_x_y", xy), ("K_y_x", yx), ("K_y_y", 400.0)].map(|(name, value)| entry(name, value)).to_vec(),
            mean_movement: vec![mean("pos_x", 0.02), mean("pos_y", 0.0)],
            ..ScheduleResult::default()
        }
    }

    /// A hand that moves along x by 2 cm and is shaken by `size` (m), in 25 cycles of 1 s.
    fn trials(size: f64) -> Trials {
        let angle = |k: usize, turns: f64| (std::f64::consts::TAU * turns * k as f64 / 100.0).sin();
        let along: Vec<f64> = (0..2500).map(|k| -0.02 * (std::f64::consts::TAU * k as f64 / 100.0).cos() + size * angle(k, 3.24)).collect();
        let across = (0..2500).map(|k| size * angle(k, 2.84)).collect::<Vec<_>>();
        let force = |turns: f64| (0..2500).map(|k| angle(k, turns)).collect::<Vec<_>>();
        let trial = Trial::new(100.0).effort("x", force(3.24)).effort("y", force(2.84)).displacement("x", along);
        Trials::of([&trial.and_then(|trial| trial.displacement("y", across)).expect("channels")]).expect("trials")
    }

    fn drawn(found: &ScheduleResult, trials: &Trials) -> Option<Figure> {
        path_figure(found, trials).expect("drawn")
    }

    #[test]
    fn a_hand_in_a_plane_has_ten_ellipses_of_the_symmetric_part() {
        let mut found = moving([-90.0, -30.0], ["N/m", "m"]);
        found.entries.iter_mut().for_each(|entry| entry.truth = Some(entry.value.iter().map(|k| 2.0 * k).collect()));
        let figure = drawn(&found, &trials(0.01)).expect("a figure");
        assert_eq!((figure.name.as_str(), figure.cells.len()), ("ellipses-along-the-path", 2));
        let rows = &figure.table.as_ref().expect("a table").rows;
        // 350 ± √(50² + 60²), the larger one at 90° + ½ atan(60 / 50) from x.
        assert!(rows.len() == 10 && rows.iter().all(|row| row[3..] == ["428", "272", "−64.9", "856", "544", "−64.9"]), "{rows:?}");
        assert_eq!([&rows[0][0], &rows[4][0], &rows[5][0], &rows[9][0]], ["0.00", "0.50", "0.50", "1.00"]);
        assert!(figure.to_csv().contains("simulated") && figure.caption.contains("symmetric part") && !figure.caption.contains("antisymmetric"));
    }

    #[test]
    fn turning_axes_time_and_a_hand_at_rest_have_none() {
        let hand = trials(0.01);
        assert!(drawn(&moving([-60.0; 2], ["N m/rad", "rad"]), &hand).is_none());
        assert!(drawn(&ScheduleResult { schedule: TIME.to_owned(), cycle_s: None, ..moving([-60.0; 2], ["N/m", "m"]) }, &hand).is_none());
        let mut one = moving([-60.0; 2], ["N/m", "m"]);
        one.entries.truncate(1);
        assert!(drawn(&one, &hand).is_none());
        // Shaken by 10 mm along both axes: a mean over 25 cycles is known to 2 mm, and moves by 1.
        let mut still = moving([-60.0; 2], ["N/m", "m"]);
        still.mean_movement[0].value.iter_mut().for_each(|x| *x *= 0.025);
        assert!(drawn(&still, &hand).is_none());
    }

    #[test]
    fn where_the_force_turns_more_than_it_restores_there_is_no_ellipse() {
        // The softest direction has 293 N/m.
        assert!(drawn(&moving([300.0, -260.0], ["N/m", "m"]), &trials(0.01)).is_some());
        assert!(drawn(&moving([320.0, -280.0], ["N/m", "m"]), &trials(0.01)).is_none());
        let mut half = moving([0.0; 2], ["N/m", "m"]);
        half.entries[1].value[..50].fill(700.0);
        half.entries[2].value[..50].fill(-700.0);
        let figure = drawn(&half, &trials(0.01)).expect("the other half");
        assert!(figure.caption.contains("At 4 more places the antisymmetric part"), "{}", figure.caption);
        assert_eq!(figure.table.expect("a table").rows.len(), 6);
    }

    #[test]
    fn a_cycle_is_cut_where_it_turns_and_its_ends_are_one_place() {
        // To and fro along x in twelve steps, its ends at the third and the ninth place.
        let path: Vec<[f64; 2]> = (0..=12).map(|k| [-(std::f64::consts::TAU * (f64::from(k) - 3.0) / 12.0).cos(), 0.0]).collect();
        let (ends, extent) = furthest(&path);
        assert!(ends == [3, 9] && (extent - 2.0).abs() < 1e-12, "{ends:?} {extent}");
        let both = stretches(path.len(), ends, true);
        assert_eq!(both, [vec![3, 4, 5, 6, 7, 8, 9], vec![9, 10, 11, 12, 1, 2, 3]]);
        assert_eq!(stretches(path.len(), ends, false), [(0..13).collect::<Vec<_>>()]);
        // Half of the way at half of the time; cos 30° = 0.87 is nearer to 0.5 of a whole of 2 than nothing.
        assert_eq!(spaced(&path, &both[0], 3), [3, 6, 9]);
        assert_eq!(spaced(&path, &both[1], 3), [9, 12, 3]);
    }
}
