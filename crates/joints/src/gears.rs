//! How much gears give and how their links swing: by Gauss-Newton steps, as what they change is no line of either.

use crate::bodies::Bodies;
use crate::causes::Form;
use crate::column::Column;
use crate::deflection::{Gear, Lets, heavier};
use crate::logged::Logged;
use crate::model::{Model, open, residual, solved};
use crate::search::Solved;
use crate::table::{Series, Slopes, Table, View};
use ndof_devices::TERMS_OF_A_LINK;
use ndof_signal::rms;
use rayon::prelude::*;
use std::sync::Arc;

/// Most steps: each leaves little of what the one before it left.
const STEPS: usize = 10;
/// Parts of a step that are tried where the whole fits worse.
pub(crate) const PARTS: [f64; 4] = [1.0, 0.5, 0.25, 0.1];
/// Settled is what would raise twice the log-likelihood by less: the square of a hundredth of a standard error.
const SETTLED: f64 = 1e-4;
/// Share of a parameter's scale over which torques are differenced.
const DIFFERENCE: f64 = 1e-3;

/// Share of a joint's torque below which what it feels is nothing but rounded.
const ROUNDED: f64 = 1e-9;

/// Moves extent and damping of each gear, how its link begins, and what hangs on it, to where the likelihood is greatest, all factors beside it fitted anew.
pub(crate) fn settle(view: &View<'_>, forms: &mut [Form], logged: &Logged) {
    for k in 0..forms.len() {
        let Some(searched) = forms[k].gear().cloned() else { continue };
        let mut place = Place::new(view, forms, k, logged);
        let mut gear = searched.clone();
        if gear.extent == 0.0 {
            gear = Gear::new(view.scene, gear.joint, gear.lets, place.by_a_line());
        }
        if gear.extent > 0.0 && view.scene.joints[gear.joint].inertia > 0.0 {
            // Beside other causes it has settled before, not far from here.
            let before = view.kept().settled.iter().find(|(from, _)| *from == searched).map(|(_, to)| to.clone());
            let from: Vec<Gear> = std::iter::once(gear).chain(before).collect();
            let Some(gear) = place.settled(&from) else { continue };
            place.put(&gear);
            let mut kept = view.kept();
            kept.settled.retain(|(from, _)| *from != searched);
            kept.settled.push((searched, gear));
        }
    }
}

/// Adds to what is searched the gears that are `asked` for, as they settle: where a link swings, others look more like it than its own gear of another
/// extent. Whether there are any.
pub(crate) fn by_themselves(view: &View<'_>, searched: &mut Vec<Form>, asked: &[Form], logged: &Logged) -> bool {
    let mut places: Vec<(usize, Lets)> = asked.iter().filter_map(Form::gear).map(|gear| (gear.joint, gear.lets)).collect();
    places.sort_by_key(|(joint, lets)| (*joint, *lets == Lets::Play));
    places.dedup();
    for place in &places {
        let settled = by_itself(view, searched, asked, logged, *place);
        searched.extend(settled);
    }
    !places.is_empty()
}

/// The gear of a joint beside what is asked for elsewhere and what any joint may have: an offset, dry and viscous friction.
fn by_itself(view: &View<'_>, searched: &[Form], asked: &[Form], logged: &Logged, (joint, lets): (usize, Lets)) -> Vec<Form> {
    let usual = [Column::Constant(joint), Column::Velocity(joint), Column::Sign(joint)];
    let own: Vec<(&Form, &Gear)> =
        searched.iter().filter_map(|form| Some((form, form.gear().filter(|gear| (gear.joint, gear.lets) == (joint, lets))?))).collect();
    let Some((first, _)) = own.first() else { return vec![] };
    let hangs = |form: &&Form| form.joint != Some(joint) || form.columns.iter().all(|c| matches!(c, Column::Body { .. }));
    let mut beside: Vec<Form> = asked.iter().filter(hangs).cloned().collect();
    let k = beside.len();
    beside.push(Form { columns: std::iter::once(first.columns[0].clone()).chain(usual).collect(), ..(*first).clone() });
    let mut logged = logged.clone();
    (logged.late_s[joint], logged.gain[joint]) = (0.0, 1.0);
    let mut place = Place::new(view, &mut beside, k, &logged);
    let mut from: Vec<Gear> = own.iter().map(|(_, gear)| (*gear).clone()).filter(|gear| gear.extent > 0.0).collect();
    from.dedup();
    let Some(settled) = place.settled(&from).map(Column::Gear) else { return vec![] };
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
            let Some(mut gear) = model.forms[k].gear().filter(|gear| gear.swings()).cloned() else { continue };
            let all = starts(held, &gear);
            let slopes: Vec<Arc<Series>> = unseen.iter().flat_map(|t| &all[2 * t..2 * t + 2]).map(|x| Arc::new(x.whitened(&held.noise))).collect();
            let (_, found) = solved(&slopes, &residual(held, model).whitened(&held.noise));
            let steps = found.of(&(0..slopes.len()).collect::<Vec<_>>());
            unseen.iter().zip(steps.chunks_exact(2)).for_each(|(t, step)| (0..2).for_each(|i| gear.starts[*t][i] += step[i]));
            model.forms[k].columns[0] = Column::Gear(gear);
        }
    }
}

/// One of the forms whose gear is looked for, and the columns of the bodies that hang on it: what they lack swings, too.
struct Place<'a, 'v> {
    view: &'a View<'v>,
    forms: &'a mut [Form],
    k: usize,
    logged: &'a Logged,
    hanging: Vec<Column>,
}

/// A gear, and the factors of what hangs on it.
#[derive(Clone)]
struct At {
    gear: Gear,
    factors: Vec<f64>,
}

impl<'a, 'v> Place<'a, 'v> {
    fn new(view: &'a View<'v>, forms: &'a mut [Form], k: usize, logged: &'a Logged) -> Self {
        let hanging = forms[k].gear().map(|gear| hanging(view, forms, gear)).unwrap_or_default();
        Place { view, forms, k, logged, hanging }
    }

    fn put(&mut self, gear: &Gear) {
        self.forms[self.k].columns[0] = Column::Gear(gear.clone());
    }

    /// The extent by the line at none of it.
    fn by_a_line(&self) -> f64 {
        let (columns, missing) = open(self.view, self.forms, self.logged);
        let before = self.forms[..self.k].iter().flat_map(|f| &f.columns).filter(|c| c.factor().is_none()).count();
        solved(&self.view.white(&columns), &missing).1.of(&[before])[0]
    }

    /// A gear that carries the bodies as they are found beside it; `None` where there are no such bodies.
    fn laden(&mut self, gear: &Gear) -> Option<At> {
        self.put(gear);
        let (columns, missing) = open(self.view, self.forms, self.logged);
        let (_, found) = solved(&self.view.white(&columns), &missing);
        let factors: Vec<f64> = columns.iter().enumerate().filter(|(_, c)| self.hanging.contains(c)).map(|(k, _)| found.of(&[k])[0]).collect();
        Some(At { gear: Gear { bodies: self.bodies(&factors)?, ..gear.clone() }, factors })
    }

    /// The file's bodies with so much more of what hangs on the gear; `None` where there are no such bodies.
    fn bodies(&self, factors: &[f64]) -> Option<Arc<Bodies>> {
        self.view.scene.bodies.with(&more(self.view, &self.hanging, factors)).map(Arc::new)
    }

    /// What is open beside the gear and what hangs on it, and what these leave of the missing torque.
    fn beside(&mut self, at: &At) -> (Vec<Arc<Series>>, Series) {
        self.put(&at.gear);
        let (columns, mut missing) = open(self.view, self.forms, self.logged);
        for (series, factor) in self.view.white(&self.hanging).iter().zip(&at.factors) {
            missing.add(-factor, series);
        }
        let open: Vec<Column> = columns.into_iter().filter(|c| !self.hanging.contains(c)).collect();
        (self.view.white(&open), missing)
    }

    /// Twice what the log-likelihood is short of there.
    fn loss(&mut self, at: &At) -> f64 {
        let (open, missing) = self.beside(at);
        let (table, found) = solved(&open, &missing);
        table.total - found.gained
    }

    /// Where the likelihood is greatest from the best of these: with the file's bodies, as if what else hangs on the gear did not swing, and from there as it does.
    fn settled(&mut self, from: &[Gear]) -> Option<Gear> {
        let (hanging, file) = (std::mem::take(&mut self.hanging), &self.view.scene.bodies);
        let start = from.iter().map(|gear| At { gear: Gear { bodies: file.clone(), ..gear.clone() }, factors: vec![] });
        let (loss, nearest) = start.map(|at| (self.loss(&at), at)).filter(|(loss, _)| loss.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let still = self.climbed(nearest, loss);
        self.hanging = hanging;
        if self.hanging.is_empty() {
            return Some(still.gear);
        }
        let laden = self.laden(&still.gear).map(|at| (self.loss(&at), at));
        // Where there are no such bodies, or the link falls over with them, they stay behind.
        Some(laden.filter(|(loss, _)| loss.is_finite()).map_or(still, |(loss, at)| self.climbed(at, loss)).gear)
    }

    /// Where the likelihood is greatest from there, where it is so much short of.
    fn climbed(&mut self, mut at: At, mut least: f64) -> At {
        let mut fresh = false;
        for _ in 0..STEPS {
            let (steps, promised) = self.steps(&at, fresh);
            if promised < SETTLED {
                break;
            }
            let better = PARTS.into_iter().find_map(|part| {
                let next = self.after(&at, &steps, part)?;
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

    /// Part of a step further; `None` where there is no such step or it leads to no bodies.
    fn after(&self, at: &At, steps: &[f64], part: f64) -> Option<At> {
        if !steps.iter().all(|step| step.is_finite()) {
            return None;
        }
        let (own, hanging) = steps.split_at(steps.len() - at.factors.len());
        let factors: Vec<f64> = at.factors.iter().zip(hanging).map(|(factor, step)| factor + part * step).collect();
        let mut gear = at.gear.clone();
        if !factors.is_empty() {
            gear.bodies = self.bodies(&factors)?;
        }
        gear.extent = (gear.extent + part * own[0]).clamp(0.5 * at.gear.extent, 2.0 * at.gear.extent);
        if gear.swings() {
            gear.damping = (gear.damping + part * own[DAMPING]).max(0.0);
            gear.starts.iter_mut().flatten().zip(&own[DAMPING + 1..]).for_each(|(start, step)| *start += part * step);
        }
        Some(At { gear, factors })
    }

    /// Gauss-Newton steps of a gear's numbers and of what hangs on it, and what they promise: twice the log-likelihood that is gained.
    fn steps(&mut self, at: &At, fresh: bool) -> (Vec<f64>, f64) {
        let (beside, missing) = self.beside(at);
        let slopes = slopes(self.view, &at.gear, &self.hanging, fresh);
        let slopes: Vec<Arc<Series>> = slopes.iter().map(|x| Arc::new(x.whitened(&self.view.noise))).collect();
        let own: Vec<usize> = (beside.len()..beside.len() + slopes.len()).collect();
        let all: Vec<Arc<Series>> = beside.iter().chain(&slopes).cloned().collect();
        let table = Table::new(vec![], &all, &missing);
        let others = Solved::default().with(&table, &(0..beside.len()).collect::<Vec<_>>());
        let step = |moved: &[usize]| (others.with(&table, moved).of(&own), others.gain(&table, moved).0);
        let (steps, promised) = step(&own);
        if !at.gear.swings() || at.gear.damping > 0.0 || steps[DAMPING] > 0.0 {
            return (steps, promised);
        }
        step(&[&own[..DAMPING], &own[DAMPING + 1..]].concat())
    }
}

/// Columns of the bodies on a gear of which its joint feels something; those in a play lie on its side whatever they are.
fn hanging(view: &View<'_>, forms: &[Form], gear: &Gear) -> Vec<Column> {
    let (joint, least) = (gear.joint, ROUNDED * view.scene.joints[gear.joint].torque);
    let behind = |c: &&Column| matches!(c, Column::Body { link, .. } if *link >= joint) && felt(view, c, joint) > least;
    if gear.lets == Lets::Play {
        return vec![];
    }
    forms.iter().flat_map(|form| &form.columns).filter(behind).cloned().collect()
}

/// Inertial parameters of so much of these columns.
fn more(view: &View<'_>, columns: &[Column], factors: &[f64]) -> Vec<f64> {
    let mut more = vec![0.0; TERMS_OF_A_LINK * view.scene.joints.len()];
    for (column, factor) in columns.iter().zip(factors) {
        if let Column::Body { link, parts } = column {
            more[TERMS_OF_A_LINK * link..].iter_mut().zip(parts).for_each(|(more, part)| *more += factor * part);
        }
    }
    more
}

/// rms of what a joint feels of a column.
fn felt(view: &View<'_>, column: &Column, joint: usize) -> f64 {
    rms(&view.series(std::slice::from_ref(column))[0].of_joint(joint))
}

/// The place of the damping among the slopes.
const DAMPING: usize = 1;

/// How far from where they were made slopes serve, as a share of a gear's numbers: a step by them leaves as much of what it goes.
const SERVE: f64 = 0.05;

/// The changes of all torques with extent, damping, and deflection and rate with which each trial begins, and with factors of what hangs on the gear; made
/// there if they are to be `fresh`.
fn slopes(view: &View<'_>, gear: &Gear, hanging: &[Column], fresh: bool) -> Arc<Vec<Series>> {
    let scale = damping_scale(view, gear);
    let near = |at: &Gear| (at.extent - gear.extent).abs() < SERVE * gear.extent && (at.damping - gear.damping).abs() < SERVE * scale;
    let serves = |(at, beside, _): &&Slopes| beside == hanging && (at == gear || (!fresh && (at.joint, at.lets) == (gear.joint, gear.lets) && near(at)));
    let before = view.kept().slopes.iter().find(serves).map(|(.., slopes)| slopes.clone());
    before.unwrap_or_else(|| {
        let given = || slope(view, gear, gear.extent, |gear, by| gear.extent += by);
        let swung = || if gear.swings() { swung(view, gear, scale) } else { vec![] };
        let (given, (swung, hung)) = rayon::join(given, || rayon::join(swung, || hung(view, gear, hanging)));
        let found = Arc::new(std::iter::once(given).chain(swung).chain(hung).collect::<Vec<_>>());
        let mut kept = view.kept();
        kept.slopes.retain(|(at, beside, _)| (at.joint, at.lets) != (gear.joint, gear.lets) || beside != hanging);
        kept.slopes.push((gear.clone(), hanging.to_vec(), found.clone()));
        found
    })
}

/// Radians per second with which a link swings on its gear.
fn swings(view: &View<'_>, gear: &Gear) -> f64 {
    (view.scene.joints[gear.joint].inertia * gear.extent).sqrt().recip()
}

fn damping_scale(view: &View<'_>, gear: &Gear) -> f64 {
    2.0 * view.scene.joints[gear.joint].inertia * swings(view, gear)
}

/// The changes of all torques with a gear's damping and with how its link begins.
fn swung(view: &View<'_>, gear: &Gear, scale: f64) -> Vec<Series> {
    let (damped, starts) = rayon::join(|| slope(view, gear, scale, |gear, by| gear.damping += by), || starts(view, gear));
    std::iter::once(damped).chain(starts).collect()
}

/// Trials begin each by itself: all are moved at once, and taken apart.
fn starts(view: &View<'_>, gear: &Gear) -> Vec<Series> {
    let size = view.scene.joints[gear.joint].torque * gear.extent;
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
    let mut out = view.compute(&[Column::Gear(moved.clone())]).swap_remove(0);
    let here = view.series(&[Column::Gear(gear.clone())]);
    let unit = out.clone();
    out.add(moved.extent / step - 1.0, &unit);
    here.iter().for_each(|here| out.add(-gear.extent / step, here));
    out
}

/// The change of all torques with the factor of each column that hangs on a gear.
fn hung(view: &View<'_>, gear: &Gear, hanging: &[Column]) -> Vec<Series> {
    let body = |column: &Column| if let Column::Body { link, parts } = column { Some((*link, *parts)) } else { None };
    let bodies: Vec<_> = hanging.iter().filter_map(body).collect();
    if bodies.is_empty() {
        return vec![];
    }
    view.together(bodies.len(), |motion| {
        let joints = |felt: Vec<Vec<f64>>| felt.into_iter().enumerate().collect();
        heavier(motion, view.scene, gear, &bodies).into_iter().map(joints).collect()
    })
}

/// The changes of all torques with a column's factor where a gear makes them others than the column itself, and with what is fitted beside it and not told.
pub(crate) fn changes(view: &View<'_>, forms: &[Form], column: &Column) -> Vec<Series> {
    if let Column::Gear(gear) = column {
        // One that did not settle is a line.
        if gear.extent <= 0.0 {
            return vec![];
        }
        return slopes(view, gear, &hanging(view, forms, gear), false)[..1 + column.beside()].to_vec();
    }
    let of = |gear: &Gear| {
        let hanging = hanging(view, forms, gear);
        let place = hanging.iter().position(|c| c == column)?;
        let slopes = slopes(view, gear, &hanging, false);
        Some(slopes[slopes.len() - hanging.len() + place].clone())
    };
    let own = view.series(std::slice::from_ref(column));
    let sum = forms.iter().filter_map(Form::gear).filter(|gear| gear.extent > 0.0).filter_map(of).reduce(|mut sum, other| {
        sum.add(1.0, &other);
        own.iter().for_each(|own| sum.add(-1.0, own));
        sum
    });
    sum.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::CAUSES;
    use crate::shared_tests::of_a_pendulum;

    #[test]
    fn bodies_that_were_found_once_do_not_stay_on_a_gear_beside_which_there_are_none() {
        let at = |f: fn(f64) -> f64| (0..3000).map(|k| f(0.03 * f64::from(k))).collect();
        of_a_pendulum(at(f64::sin), at(f64::cos), |scene, view| {
            let cause = CAUSES.iter().find(|c| c.card.name == "joint-flexibility").expect("a cause");
            let mut forms = vec![(cause.forms)(scene).swap_remove(0)];
            let searched = forms[0].gear().cloned().expect("a gear");
            let heavier = scene.bodies.with(&[1.0, 0.3, 0.0, 0.0, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0]).map(Arc::new).expect("bodies");
            let before = Gear { bodies: heavier, extent: 0.7 * searched.extent, ..searched };
            let settled = Place::new(&view, &mut forms, 0, &Logged::as_it_is(1)).settled(&[before]).expect("it swings");
            assert!(settled.bodies == scene.bodies);
        });
    }
}
