//! What a diagnosis says against a robot's file, as corrections of it.

use crate::JointsError;
use crate::Options;
use crate::bodies::turned;
use crate::causes::{link_parameters, payload};
use crate::physical;
use crate::scene::scene;
use ndof_devices::{Corrected, Correction, DeviceError, SerialChain, TERMS_OF_A_LINK, Written, write_back_chain};
use ndof_diagnose::{Cause, CauseParameter, Diagnosis};
use ndof_models::effects::Value;
use ndof_models::robot::Robot;
use ndof_signal::Recording;
use ndof_sysid::Ports;
use std::f64::consts::TAU;

/// Round-off of sums: a number of the file that changes by less stays.
const SAME: f64 = 1e-12;

/// What data correct in a robot's file, and what of a diagnosis no file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corrections {
    /// Numbers of the file, with the cause and its interval as the reason.
    pub list: Vec<Correction>,
    /// A sentence for each named cause, or part of one, that a robot's file has no word for.
    pub left_out: Vec<String>,
    /// The joints of the chain, in their order; where there are none all of the file's are.
    pub joints: Vec<String>,
}

/// The corrections that the named causes of a diagnosis ask for; `trials`, `ports` and `options` are those that it was made from.
///
/// Friction, rotor and gravity become what was found, in place of what the file has. Changes of a link and a payload are added to the ten inertial
/// parameters of their body, from which its mass, its centre and the inertia about that follow; if no masses make that body, it becomes the one nearest to
/// the file's that moves as it would. Friction that is no straight line over speed becomes
/// the one that is nearest to it, by least squares over the speeds of the trials. A stop becomes the end of the range that the file has, or of one of a whole turn. What is of the log (offset, gain and lateness of a torque) or needs a word that files lack
/// is told in [`Corrections::left_out`].
///
/// # Errors
/// [`JointsError`] if trials and chain do not match.
pub fn corrections(chain: &SerialChain, trials: &[Recording], ports: &Ports, diagnosis: &Diagnosis, options: &Options) -> Result<Corrections, JointsError> {
    let out = Corrections { joints: chain.joints().names.clone(), ..Corrections::default() };
    let mut found = Found { chain: chain.clone(), out, bodies: vec![Body::default(); chain.joints().count()], diagnosis, tolerance: options.tolerance };
    for (joint, name) in chain.joints().names.iter().enumerate() {
        let of = |effect: &str| diagnosis.causes.iter().find(|c| may_be_written(c) && c.effect == effect && c.site.axis == *name);
        let frictions = [of("coulomb-friction"), of("viscous-friction")].map(|cause| cause.filter(|cause| !found.is_open(cause, joint)));
        found.friction(joint, frictions, trials, ports)?;
        if let Some(cause) = of("end-stop") {
            found.stop(joint, cause, trials, ports.outputs[joint]);
        }
    }
    // Gravity first: what torques tell of a body depends on it.
    let (likely, unlikely): (Vec<&Cause>, Vec<&Cause>) = diagnosis.causes.iter().partition(|c| may_be_written(c));
    for cause in unlikely {
        found.leave_out(cause, "its name is not likely enough to be written");
    }
    let (tilts, others): (Vec<&Cause>, Vec<&Cause>) = likely.into_iter().partition(|c| c.effect == "base-tilt");
    tilts.into_iter().chain(others).for_each(|cause| found.add(cause));
    found.write_bodies();
    Ok(found.out)
}

impl Corrections {
    /// The text of a robot's `file` with these corrections. One that the file cannot take, such as an inertia that no masses make, is left out and told.
    ///
    /// # Errors
    /// [`DeviceError`] if the text is no robot's.
    pub fn write(&self, file: &str, text: &str) -> Result<Written, DeviceError> {
        write_back_chain(file, text, &self.joints, &[])?;
        let mut left_out = self.left_out.clone();
        let (mut taken, mut rest) = (Vec::new(), self.list.as_slice());
        while let Some(first) = rest.first() {
            let alike = rest.iter().take_while(|c| c.joint == first.joint && together(c.what) == together(first.what)).count();
            let group = if together(first.what).is_some() { &rest[..alike] } else { &rest[..1] };
            match write_back_chain(file, text, &self.joints, group) {
                Ok(_) => taken.extend_from_slice(group),
                Err(error) => left_out.push(format!("{}; not written: {error}", first.why)),
            }
            rest = &rest[group.len()..];
        }
        let mut written = write_back_chain(file, text, &self.joints, &taken)?;
        left_out.append(&mut written.left_out);
        Ok(Written { left_out, ..written })
    }
}

/// Numbers that make sense only with each other.
fn together(what: Corrected) -> Option<&'static str> {
    match what {
        Corrected::Mass | Corrected::Centre(_) | Corrected::Inertia(_) => Some("body"),
        Corrected::Gravity(_) => Some("gravity"),
        Corrected::Range(_) => Some("range"),
        _ => None,
    }
}

/// What the inertial parameters of a body become more, and why.
#[derive(Clone, Default)]
struct Body {
    more: [f64; TERMS_OF_A_LINK],
    why: Vec<String>,
}

/// Corrections as they are gathered.
struct Found<'a> {
    chain: SerialChain,
    out: Corrections,
    bodies: Vec<Body>,
    diagnosis: &'a Diagnosis,
    tolerance: f64,
}

impl Found<'_> {
    fn correct(&mut self, joint: &str, what: Corrected, value: f64, why: &str) {
        self.out.list.push(Correction { joint: joint.to_owned(), what, value, why: why.to_owned() });
    }

    fn leave_out(&mut self, cause: &Cause, why: &str) {
        self.out.left_out.push(format!("{}: {why}", words(cause)));
    }

    /// Whether a cause of one number says nothing against the file's: its interval goes from none to beyond it, or it is a simulator that has another, from which
    /// the file's number is as far as what was found, but for the tolerance.
    fn is_open(&self, cause: &Cause, joint: usize) -> bool {
        let joints = self.chain.joints();
        let (kind, name, file) = match cause.effect.as_str() {
            "motor-inertia" => ("rotor", "rotor_kg_m2", self.chain.inertial_parameters()[TERMS_OF_A_LINK * joints.count() + joint]),
            "coulomb-friction" => ("coulomb", "level_nm", joints.coulomb[joint]),
            "viscous-friction" => ("viscous", "viscous_nm_s_per_rad", joints.viscous[joint]),
            _ => return false,
        };
        let shift = self.diagnosis.extended.parameter_shift.iter().find(|shift| shift.name.starts_with(&format!("{kind}_{}_", cause.site.axis)));
        let is_the_files = shift.is_some_and(|shift| (shift.after - file).abs() < self.tolerance * (shift.after - shift.before).abs());
        says_nothing(cause, name, file) || is_the_files
    }

    /// What is not friction that a file can say.
    fn add(&mut self, cause: &Cause) {
        let joint = self.chain.joints().names.iter().position(|name| *name == cause.site.axis);
        match (cause.effect.as_str(), joint) {
            (_, Some(joint)) if self.is_open(cause, joint) => self.leave_out(cause, "it says nothing against the number in the file"),
            ("coulomb-friction" | "viscous-friction" | "end-stop", Some(_)) => {}
            ("motor-inertia", Some(_)) => {
                if let Some(value) = number(cause, "rotor_kg_m2") {
                    self.correct(&cause.site.axis, Corrected::Rotor, value, &words(cause));
                }
            }
            // The file's spring is not there.
            ("cable-force", Some(_)) if may_be_zero(cause, "spring_nm_per_rad") => self.correct(&cause.site.axis, Corrected::Stiffness, 0.0, &words(cause)),
            ("cable-force", Some(_)) if number(cause, "spring_nm_per_rad").is_some_and(|stiffness| stiffness > 0.0) => {
                for (what, name) in [(Corrected::Stiffness, "spring_nm_per_rad"), (Corrected::SpringRest, "rest_rad")] {
                    if let Some(value) = number(cause, name) {
                        self.correct(&cause.site.axis, what, value, &words(cause));
                    }
                }
            }
            ("spring-rest", _) => self.leave_out(cause, "the zero of the torque's sensor would be the same torque, and no log tells which of the two is off"),
            ("link-parameters", Some(joint)) => self.link(joint, cause),
            ("payload", _) if says_nothing(cause, "mass_kg", 0.0) => self.leave_out(cause, "its interval has zero in it"),
            ("payload", _) => self.payload(cause),
            ("base-tilt", _) => self.tilt(cause),
            ("torque-delay", Some(_)) => self.delay(cause),
            ("joint-flexibility", _) => self.leave_out(cause, "the stiffness that a file gives a joint is of a spring beside it, not of a gear that gives"),
            _ if cause.site.side == "sensor" => self.leave_out(cause, "it is of the log, not of the robot"),
            _ => self.leave_out(cause, "robots' files have no word for it"),
        }
    }

    /// Dry and viscous friction of a joint, where one of them is named.
    fn friction(&mut self, joint: usize, causes: [Option<&Cause>; 2], trials: &[Recording], ports: &Ports) -> Result<(), JointsError> {
        let joints = self.chain.joints();
        let curve = Curve::of((joints.coulomb[joint], joints.viscous[joint]), causes);
        let name = joints.names[joint].clone();
        let (none, own) = (joints.coulomb[joint] == 0.0, self.chain.soft_friction()[joint][0]);
        // Where the file has dry friction, how it turns was not asked; where it has none, its format's own turn is not what was found.
        if let Some(cause) = causes[0].filter(|cause| none && !may_be_zero(cause, "ahead_s")) {
            let ahead = number(cause, "ahead_s").unwrap_or(0.0);
            if ahead != own {
                self.correct(&name, Corrected::FrictionAhead, ahead, &words(cause));
            }
        }
        if !curve.is_curved() {
            for (cause, what, key) in [(causes[0], Corrected::Coulomb, "level_nm"), (causes[1], Corrected::Viscous, "viscous_nm_s_per_rad")] {
                if let Some((cause, value)) = cause.and_then(|c| Some((c, number(c, key)?))) {
                    self.correct(&name, what, value, &words(cause));
                    // That of a soft constraint follows from its level.
                    let soft = number(cause, "ahead_s").is_some() || !none && own > 0.0;
                    if number(cause, "turning_speed_rad_per_s").is_some() && !soft {
                        self.out
                            .left_out
                            .push(format!("{}: the speed over which its sign turns has no word in robots' files; its level is written", words(cause)));
                    }
                }
            }
            return Ok(());
        }
        let (_, motions) = scene(&self.chain, trials, &[], ports)?;
        let [dry, viscous] = curve.nearest(motions.iter().flat_map(|m| m.v[joint].iter().copied()));
        let why = causes.into_iter().flatten().map(words).collect::<Vec<_>>().join("; ");
        let nearest = format!("{why}; the nearest to it of dry and viscous friction, over the speeds of the log");
        self.correct(&name, Corrected::Coulomb, dry, &nearest);
        self.correct(&name, Corrected::Viscous, viscous, &nearest);
        self.out
            .left_out
            .push(format!("{why}: friction that bends over speed has no word in robots' files; dry and viscous friction nearest to it are written"));
        Ok(())
    }

    /// The end of the file's range on the side of the movement on which the stop is; of a joint that turns without one, a range of a turn that ends there.
    fn stop(&mut self, joint: usize, cause: &Cause, trials: &[Recording], angle: usize) {
        let Some(stop) = number(cause, "stop_rad") else { return };
        let angles = || trials.iter().flat_map(|trial| trial.channels()[angle].samples.iter().copied());
        let [lowest, highest] = [angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max)];
        let side = usize::from(stop > 0.5 * (lowest + highest));
        if !self.chain.ranges()[joint][1 - side].is_finite() {
            // What stops a joint that turns one way stops it the other way, at the latest where it comes round to it.
            let other = if side == 1 { stop - TAU } else { stop + TAU };
            if self.chain.slides(joint) || side == 1 && lowest < other || side == 0 && highest > other {
                return self.leave_out(cause, "the file gives this joint no range, and one needs two ends, of which the other was not found; not written");
            }
            let why = format!("{}; this end was not found, and is where the joint would come to the same stop from the other side", words(cause));
            self.correct(&cause.site.axis, Corrected::Range(1 - side), other, &why);
        }
        self.correct(&cause.site.axis, Corrected::Range(side), stop, &words(cause));
        self.out.left_out.push(format!("{}: its stiffness has no word in robots' files; where it is is written", words(cause)));
    }

    fn link(&mut self, joint: usize, cause: &Cause) {
        let own = self.chain.inertial_parameters();
        let body = &mut self.bodies[joint];
        if let Some(scale) = number(cause, "mass_scale") {
            body.more.iter_mut().zip(&own[TERMS_OF_A_LINK * joint..]).for_each(|(more, own)| *more += (scale - 1.0) * own);
        }
        for (more, name) in body.more.iter_mut().zip(link_parameters::NAMES) {
            *more += number(cause, &format!("change_of_{name}")).unwrap_or(0.0);
        }
        body.why.push(words(cause));
    }

    fn payload(&mut self, cause: &Cause) {
        let (Some(mass), tip) = (number(cause, "mass_kg"), self.chain.tip()) else { return };
        let moments = ["x", "y", "z"].map(|axis| number(cause, &format!("moment_{axis}_kg_m")));
        let Some(body) = self.bodies.last_mut() else { return };
        if moments == [None; 3] {
            body.more.iter_mut().zip(payload::point(tip)).for_each(|(more, part)| *more += mass * part);
        } else {
            body.more[0] += mass;
            body.more[1..4].iter_mut().zip(moments).for_each(|(more, moment)| *more += moment.unwrap_or(0.0));
        }
        body.why.push(words(cause));
    }

    /// Gravity, seen from the base as it stands.
    fn tilt(&mut self, cause: &Cause) {
        let tilt = ["x", "y", "z"].map(|axis| number(cause, &format!("tilt_{axis}_rad")).unwrap_or(0.0));
        let gravity = self.chain.gravity();
        let change = turned(gravity, &tilt);
        for k in 0..3 {
            if change[k] != 0.0 {
                self.correct("", Corrected::Gravity(k), gravity[k] + change[k], &words(cause));
            }
        }
        self.chain = self.chain.clone().with_gravity(std::array::from_fn(|k| gravity[k] + change[k]));
    }

    /// A torque that comes after its command is logged too early where the log has the command; one that is logged late is a matter of the log.
    fn delay(&mut self, cause: &Cause) {
        match number(cause, "delay_s") {
            Some(delay) if delay < 0.0 => {
                let why = format!("{}; of the motor where the log has the torque that was commanded", words(cause));
                self.correct(&cause.site.axis, Corrected::TorqueDelay, -delay, &why);
            }
            _ => self.leave_out(cause, "it is of the log, not of the robot"),
        }
    }

    /// Mass, centre and inertia of each body that changes.
    fn write_bodies(&mut self) {
        let (names, own) = (self.chain.joints().names.clone(), self.chain.inertial_parameters());
        for (joint, body) in std::mem::take(&mut self.bodies).into_iter().enumerate().filter(|(_, b)| !b.why.is_empty()) {
            let before: [f64; TERMS_OF_A_LINK] = std::array::from_fn(|k| own[TERMS_OF_A_LINK * joint + k]);
            let found: [f64; TERMS_OF_A_LINK] = std::array::from_fn(|k| before[k] + body.more[k]);
            // If no masses make it, writing it back says so.
            let after = physical::body(&self.chain, joint, &before, &found).unwrap_or(found);
            let open = if after == found { "" } else { "; what no torque tells of this body is as near to the file as masses allow" };
            let why = format!("{}{open}", body.why.join("; "));
            let (old, new) = (central(&before), central(&after));
            let kinds = std::iter::once(Corrected::Mass).chain((0..3).map(Corrected::Centre)).chain((0..6).map(Corrected::Inertia));
            for ((what, old), new) in kinds.zip(old).zip(new) {
                if (new - old).abs() > SAME * (new.abs() + old.abs()) {
                    self.correct(&names[joint], what, new, &why);
                }
            }
        }
    }
}

/// Mass, centre and xx, yy, zz, xy, xz, yz of the inertia about it, of the ten inertial parameters of a body about its joint.
fn central(&[m, hx, hy, hz, xx, xy, yy, xz, yz, zz]: &[f64; TERMS_OF_A_LINK]) -> [f64; TERMS_OF_A_LINK] {
    let [x, y, z] = if m > 0.0 { [hx / m, hy / m, hz / m] } else { [0.0; 3] };
    [m, x, y, z, xx - m * (y * y + z * z), yy - m * (x * x + z * z), zz - m * (x * x + y * y), xy + m * x * y, xz + m * x * z, yz + m * y * z]
}

/// Friction of a joint over speed: F_c sign v + (F_s − F_c) exp(−(v/v_s)²) sign v + b v + (b₀ − b) v₀ asinh(v/v₀).
struct Curve {
    dry: f64,
    excess: Option<[f64; 2]>,
    viscous: f64,
    thinning: Option<[f64; 2]>,
}

impl Curve {
    /// Of the file's dry and viscous friction and the causes of both.
    fn of((dry, viscous): (f64, f64), [coulomb, slick]: [Option<&Cause>; 2]) -> Self {
        let told = |cause: Option<&Cause>, name: &str| cause.and_then(|c| number(c, name));
        let level = told(coulomb, "level_nm").unwrap_or(dry);
        // An excess that the data do not tell from none is none.
        let told_apart = |p: &CauseParameter| p.name == "stribeck_level_nm" && p.ci95.is_some_and(|[low, _]| low > level);
        let at_rest = coulomb.filter(|c| c.parameters.iter().any(told_apart));
        let excess = told(at_rest, "stribeck_level_nm").zip(told(at_rest, "stribeck_velocity_rad_per_s")).map(|(most, speed)| [most - level, speed]);
        let slope = told(slick, "viscous_nm_s_per_rad").unwrap_or(viscous);
        match told(slick, "thinning_speed_rad_per_s") {
            Some(speed) => Curve { dry: level, excess, viscous, thinning: Some([slope - viscous, speed]) },
            None => Curve { dry: level, excess, viscous: slope, thinning: None },
        }
    }

    fn is_curved(&self) -> bool {
        self.excess.is_some() || self.thinning.is_some()
    }

    /// The torque at a speed above zero.
    fn torque(&self, speed: f64) -> f64 {
        let excess = self.excess.map_or(0.0, |[most, scale]| most * (-(speed / scale).powi(2)).exp());
        let thinning = self.thinning.map_or(0.0, |[slope, scale]| slope * scale * (speed / scale).asinh());
        self.dry + excess + self.viscous * speed + thinning
    }

    /// Dry and viscous friction, neither below zero, that are nearest to it at these speeds.
    fn nearest(&self, speeds: impl Iterator<Item = f64>) -> [f64; 2] {
        let [mut n, mut v, mut vv, mut t, mut tv] = [0.0; 5];
        for speed in speeds.map(f64::abs) {
            let torque = self.torque(speed);
            (n, v, vv, t, tv) = (n + 1.0, v + speed, vv + speed * speed, t + torque, tv + torque * speed);
        }
        let determinant = n * vv - v * v;
        let both = [(t * vv - tv * v) / determinant, (tv * n - t * v) / determinant];
        match both {
            [dry, _] if dry < 0.0 => [0.0, tv / vv],
            [_, viscous] if viscous < 0.0 => [t / n, 0.0],
            _ => both,
        }
    }
}

/// Whether a cause is likely, and not so only as far as channels or bodies that cannot be are.
fn may_be_written(cause: &Cause) -> bool {
    cause.is_likely() && cause.at_most >= 1.0
}

/// Whether a parameter's interval goes from none to beyond what the file has: it says neither that there is some nor that the file is wrong.
fn says_nothing(cause: &Cause, name: &str, file: f64) -> bool {
    may_be_zero(cause, name) && cause.parameters.iter().any(|p| p.name == name && p.ci95.is_some_and(|[_, high]| file <= high))
}

/// Whether a parameter's interval has nothing in it.
fn may_be_zero(cause: &Cause, name: &str) -> bool {
    cause.parameters.iter().any(|p| p.name == name && p.ci95.is_some_and(|[low, high]| low <= 0.0 && 0.0 <= high))
}

fn number(cause: &Cause, name: &str) -> Option<f64> {
    cause.parameters.iter().find(|p| p.name == name).and_then(|p| if let Value::Number(value) = p.value { Some(value) } else { None })
}

/// "coulomb-friction at elbow, level_nm = 1.31 (95 % 1.28 … 1.34) N m, probability 0.98".
fn words(cause: &Cause) -> String {
    let place = if cause.site.axis.is_empty() { String::new() } else { format!(" at {}", cause.site.axis) };
    let told = |p: &CauseParameter| {
        let Value::Number(value) = p.value else { return None };
        let interval = p.ci95.map(|[low, high]| format!(" (95 % {} … {})", short(low), short(high))).unwrap_or_default();
        Some(format!("{} = {}{interval} {}", p.name, short(value), p.unit).trim_end().to_owned())
    };
    let first = std::iter::once(format!("{}{place}", cause.effect));
    let last = (!cause.probability.is_nan()).then(|| format!("probability {:.2}", cause.probability));
    first.chain(cause.parameters.iter().filter_map(told)).chain(last).collect::<Vec<_>>().join(", ")
}

/// Four digits.
fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0.0 } else { (3.0 - value.abs().log10().floor()).clamp(0.0, 12.0) };
    format!("{value:.*}", digits as usize)
}
