//! How much gears give and how their links swing: by Gauss-Newton steps, as what they change is no line of either.

use crate::causes::Form;
use crate::column::Column;
use crate::deflection::Gear;
use crate::model::{Logged, Model, open, residual, solved};
use crate::search::Solved;
use crate::table::{Series, Table, View};
use rayon::prelude::*;
use std::sync::{Arc, MutexGuard, PoisonError};

/// Most steps: each leaves little of what the one before it left.
const STEPS: usize = 10;
/// Settled is what would raise twice the log-likelihood by less: the square of a hundredth of a standard error.
const SETTLED: f64 = 1e-4;
/// Share of a parameter's scale over which torques are differenced.
const DIFFERENCE: f64 = 1e-3;

/// What is known of gears from settling them before.
#[derive(Default)]
pub(crate) struct Gears {
    /// Those that a search began with, and where they settled last.
    settled: Vec<(Gear, Gear)>,
    /// Where the slopes of each joint's gear were made last, and what they are.
    slopes: Vec<(Gear, Arc<Vec<Series>>)>,
}

fn known<'a>(view: &'a View<'_>) -> MutexGuard<'a, Gears> {
    view.gears.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Moves compliance and damping of each gear, and how its link begins, to where the likelihood is greatest, all factors beside it fitted anew.
pub(crate) fn settle(view: &View<'_>, forms: &mut [Form], logged: &Logged) {
    for k in 0..forms.len() {
        let Some(searched) = forms[k].gear().cloned() else { continue };
        let mut place = Place { view, forms, k, logged };
        let mut gear = searched.clone();
        if gear.compliance == 0.0 {
            gear = Gear::new(view.scene, gear.joint, place.by_a_line());
        }
        if gear.compliance > 0.0 && view.scene.joints[gear.joint].inertia > 0.0 {
            // Beside other causes it has settled before, not far from here.
            let before = known(view).settled.iter().find(|(from, _)| *from == searched).map(|(_, to)| to.clone());
            gear = before.filter(|before| place.loss(before) < place.loss(&gear)).unwrap_or(gear);
            gear = place.settled(gear);
            place.put(&gear);
            let mut known = known(view);
            known.settled.retain(|(from, _)| *from != searched);
            known.settled.push((searched, gear));
        }
    }
}

/// Adds to what is searched the gears that are `asked` for, as they settle: where a link swings, others look more like it than its own gear with another
/// compliance. Whether there are any.
pub(crate) fn by_themselves(view: &View<'_>, searched: &mut Vec<Form>, asked: &[Form], logged: &Logged) -> bool {
    let joints: Vec<usize> = (0..view.scene.joints.len()).filter(|j| asked.iter().any(|form| form.gear().is_some_and(|gear| gear.joint == *j))).collect();
    for joint in &joints {
        let settled = by_itself(view, searched, asked, logged, *joint);
        searched.extend(settled);
    }
    !joints.is_empty()
}

/// The gear of a joint beside what is asked for elsewhere and what any joint may have: an offset, dry and viscous friction.
fn by_itself(view: &View<'_>, searched: &[Form], asked: &[Form], logged: &Logged, joint: usize) -> Vec<Form> {
    let usual = [Column::Constant(joint), Column::Velocity(joint), Column::Sign(joint)];
    let own: Vec<(&Form, &Gear)> = searched.iter().filter_map(|form| Some((form, form.gear().filter(|gear| gear.joint == joint)?))).collect();
    let Some((first, _)) = own.first() else { return vec![] };
    let mut beside: Vec<Form> = asked.iter().filter(|form| form.joint != Some(joint)).cloned().collect();
    let k = beside.len();
    beside.push(Form { columns: std::iter::once(first.columns[0].clone()).chain(usual).collect(), ..(*first).clone() });
    let mut logged = logged.clone();
    (logged.late_s[joint], logged.gain[joint]) = (0.0, 1.0);
    let mut place = Place { view, forms: &mut beside, k, logged: &logged };
    let nearest = own.iter().filter(|(_, gear)| gear.compliance > 0.0).map(|(_, gear)| (place.loss(gear), *gear)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, nearest)) = nearest else { return vec![] };
    let settled = Column::Give(place.settled(nearest.clone()));
    let columns = |form: &Form| -> Vec<Column> { std::iter::once(settled.clone()).chain(form.columns[1..].iter().cloned()).collect() };
    let mut out: Vec<Form> = Vec::new();
    for (form, columns) in own.into_iter().map(|(form, _)| (form, columns(form))) {
        if !searched.iter().chain(&out).any(|other| other.columns == columns) {
            out.push(Form { columns, ..form.clone() });
        }
    }
    out
}

/// How the links behind a model's gears begin in trials of which nothing was fitted: two numbers of each that no other trial can tell.
pub(crate) fn begin(fitted: &View<'_>, held: &View<'_>, model: &mut Model) {
    let of = |view: &View<'_>, trial: usize| view.pieces.iter().any(|piece| piece.trial == trial);
    let unseen: Vec<usize> = (0..held.motions.len()).filter(|t| of(held, *t) && !of(fitted, *t)).collect();
    if unseen.is_empty() {
        return;
    }
    // Where a link swings far it is no line of how it begins.
    for _ in 0..3 {
        for k in 0..model.forms.len() {
            let Some(mut gear) = model.forms[k].gear().filter(|gear| gear.compliance > 0.0).cloned() else { continue };
            let all = starts(held, &gear);
            let slopes: Vec<Arc<Series>> = unseen.iter().flat_map(|t| &all[2 * t..2 * t + 2]).map(|x| Arc::new(x.whitened(&held.noise))).collect();
            let (_, found) = solved(&slopes, &residual(held, model).whitened(&held.noise));
            let steps = found.of(&(0..slopes.len()).collect::<Vec<_>>());
            unseen.iter().zip(steps.chunks_exact(2)).for_each(|(t, step)| (0..2).for_each(|i| gear.starts[*t][i] += step[i]));
            model.forms[k].columns[0] = Column::Give(gear);
        }
    }
}

/// One of the forms whose gear is looked for.
struct Place<'a, 'v> {
    view: &'a View<'v>,
    forms: &'a mut [Form],
    k: usize,
    logged: &'a Logged,
}

impl Place<'_, '_> {
    fn put(&mut self, gear: &Gear) {
        self.forms[self.k].columns[0] = Column::Give(gear.clone());
    }

    /// The compliance where the bodies follow their load, which is a line.
    fn by_a_line(&self) -> f64 {
        let (columns, missing) = open(self.view, self.forms, self.logged);
        let before = self.forms[..self.k].iter().flat_map(|f| &f.columns).filter(|c| c.factor().is_none()).count();
        solved(&self.view.white(&columns), &missing).1.of(&[before])[0]
    }

    /// Twice what the log-likelihood is short of with this gear.
    fn loss(&mut self, gear: &Gear) -> f64 {
        self.put(gear);
        let (columns, missing) = open(self.view, self.forms, self.logged);
        let (table, found) = solved(&self.view.white(&columns), &missing);
        table.total - found.gained
    }

    /// Where the likelihood is greatest from there.
    fn settled(&mut self, mut at: Gear) -> Gear {
        let mut least = self.loss(&at);
        let mut fresh = false;
        for _ in 0..STEPS {
            let (steps, promised) = self.steps(&at, fresh);
            if promised < SETTLED {
                break;
            }
            let better = [1.0, 0.5, 0.25, 0.1].into_iter().find_map(|part| {
                let mut next = at.clone();
                next.compliance = (next.compliance + part * steps[0]).clamp(0.5 * at.compliance, 2.0 * at.compliance);
                next.damping = (next.damping + part * steps[DAMPING]).max(0.0);
                next.starts.iter_mut().flatten().zip(&steps[DAMPING + 1..]).for_each(|(start, step)| *start += part * step);
                let loss = self.loss(&next);
                (loss < least).then_some((next, loss))
            });
            match better {
                Some((next, loss)) => (at, least, fresh) = (next, loss, false),
                // Slopes from elsewhere may promise what those of here do not.
                None if !fresh => fresh = true,
                None => break,
            }
        }
        at
    }

    /// Gauss-Newton steps of a gear's numbers, and what they promise: twice the log-likelihood that is gained.
    fn steps(&mut self, gear: &Gear, fresh: bool) -> (Vec<f64>, f64) {
        self.put(gear);
        let (columns, missing) = open(self.view, self.forms, self.logged);
        let beside = self.view.white(&columns);
        let slopes: Vec<Arc<Series>> = slopes(self.view, gear, fresh).iter().map(|x| Arc::new(x.whitened(&self.view.noise))).collect();
        let own: Vec<usize> = (beside.len()..beside.len() + slopes.len()).collect();
        let all: Vec<Arc<Series>> = beside.iter().chain(&slopes).cloned().collect();
        let table = Table::new(vec![], &all, &missing);
        let others = Solved::default().with(&table, &(0..beside.len()).collect::<Vec<_>>());
        let step = |moved: &[usize]| (others.with(&table, moved).of(&own), others.gain(&table, moved).0);
        let (steps, promised) = step(&own);
        if gear.damping > 0.0 || steps[DAMPING] > 0.0 {
            return (steps, promised);
        }
        step(&[&own[..DAMPING], &own[DAMPING + 1..]].concat())
    }
}

/// The place of the damping among the slopes.
const DAMPING: usize = 1;

/// How far from where they were made slopes serve, as a share of a gear's numbers: a step by them leaves as much of what it goes.
const SERVE: f64 = 0.05;

/// The changes of all torques with compliance, damping, and deflection and rate with which each trial begins; made there if they are to be `fresh`.
fn slopes(view: &View<'_>, gear: &Gear, fresh: bool) -> Arc<Vec<Series>> {
    let scale = damping_scale(view, gear);
    let near = |at: &Gear| (at.compliance - gear.compliance).abs() < SERVE * gear.compliance && (at.damping - gear.damping).abs() < SERVE * scale;
    let before = known(view).slopes.iter().find(|(at, _)| at == gear || (!fresh && at.joint == gear.joint && near(at))).map(|(_, slopes)| slopes.clone());
    before.unwrap_or_else(|| {
        let given = || slope(view, gear, gear.compliance, |gear, by| gear.compliance += by);
        let damped = || slope(view, gear, scale, |gear, by| gear.damping += by);
        let ((given, damped), starts) = rayon::join(|| rayon::join(given, damped), || starts(view, gear));
        let found = Arc::new([given, damped].into_iter().chain(starts).collect::<Vec<_>>());
        let mut known = known(view);
        known.slopes.retain(|(at, _)| at.joint != gear.joint);
        known.slopes.push((gear.clone(), found.clone()));
        found
    })
}

/// Radians per second with which a link swings on its gear.
fn swings(view: &View<'_>, gear: &Gear) -> f64 {
    (view.scene.joints[gear.joint].inertia * gear.compliance).sqrt().recip()
}

fn damping_scale(view: &View<'_>, gear: &Gear) -> f64 {
    2.0 * view.scene.joints[gear.joint].inertia * swings(view, gear)
}

/// Trials begin each by itself: all are moved at once, and taken apart.
fn starts(view: &View<'_>, gear: &Gear) -> Vec<Series> {
    let size = view.scene.joints[gear.joint].torque * gear.compliance;
    let all = [size, size * swings(view, gear)];
    let all: Vec<Series> =
        (0..2).into_par_iter().map(|k| slope(view, gear, all[k], |gear, by| gear.starts.iter_mut().for_each(|start| start[k] += by))).collect();
    let of = |(trial, series): (usize, &Series)| {
        let mut own = series.clone();
        let others = own.0.iter_mut().zip(&view.pieces).filter(|(_, piece)| piece.trial != trial);
        others.for_each(|(joints, _)| joints.iter_mut().flatten().for_each(|x| x.fill(0.0)));
        own
    };
    (0..gear.starts.len()).flat_map(|trial| all.iter().map(move |series| (trial, series))).map(of).collect()
}

/// The change of all torques with what `moves` a gear, whose scale is `size`.
fn slope(view: &View<'_>, gear: &Gear, size: f64, moves: impl Fn(&mut Gear, f64)) -> Series {
    let step = DIFFERENCE * size;
    let mut moved = gear.clone();
    moves(&mut moved, step);
    let mut out = view.compute(&[Column::Give(moved.clone())]).swap_remove(0);
    let here = view.series(&[Column::Give(gear.clone())]);
    let unit = out.clone();
    out.add(moved.compliance / step - 1.0, &unit);
    here.iter().for_each(|here| out.add(-gear.compliance / step, here));
    out
}

/// The change of all torques with the compliance of a column's gear, and with what is fitted beside it and not told.
pub(crate) fn changes(view: &View<'_>, column: &Column) -> Vec<Series> {
    if let Column::Give(gear) = column { slopes(view, gear, false).to_vec() } else { vec![] }
}
