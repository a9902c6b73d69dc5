//! What an MJCF says once for many elements: its compiler's settings and its classes of defaults.

use super::body::Pose;
use super::xml::Element;
use crate::vector3::{IDENTITY, Matrix, Vector, about, cross, dot, product, scale, sub, transpose};

/// Where masses of bodies come from.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum FromGeoms {
    Never,
    /// From shapes where a body has no `<inertial>`.
    Missing,
    Always,
}

/// `<compiler>`.
pub(super) struct Compiler {
    /// The unit of angles (rad).
    pub(super) angle_rad: f64,
    pub(super) from_geoms: FromGeoms,
    auto_limits: bool,
    /// Axes of Euler angles; capital ones stand still.
    sequence: Vec<char>,
}

const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];
/// Settings that change masses behind the file's back, and the values with which they do not.
const MASS_CHANGING: [(&str, &[&str]); 6] = [
    ("settotalmass", &["-1"]),
    ("boundmass", &["0"]),
    ("boundinertia", &["0"]),
    ("balanceinertia", &["false"]),
    ("inertiagrouprange", &["0 5"]),
    ("coordinate", &["local"]),
];

impl Compiler {
    pub(super) fn of(root: &Element) -> Result<Self, String> {
        let mut settings = Compiler { angle_rad: 1f64.to_radians(), from_geoms: FromGeoms::Missing, auto_limits: true, sequence: vec!['x', 'y', 'z'] };
        for element in root.children("compiler") {
            let unknown = |name: &str| format!("{}: {name}=\"{}\" is not read", element.called(), element.attribute(name).unwrap_or_default());
            for (name, harmless) in MASS_CHANGING {
                if element.attribute(name).is_some_and(|v| !harmless.contains(&v.trim())) {
                    return Err(unknown(name));
                }
            }
            match element.attribute("angle") {
                None => {}
                Some("degree") => settings.angle_rad = 1f64.to_radians(),
                Some("radian") => settings.angle_rad = 1.0,
                Some(_) => return Err(unknown("angle")),
            }
            match element.attribute("inertiafromgeom") {
                None => {}
                Some("auto") => settings.from_geoms = FromGeoms::Missing,
                Some("true") => settings.from_geoms = FromGeoms::Always,
                Some("false") => settings.from_geoms = FromGeoms::Never,
                Some(_) => return Err(unknown("inertiafromgeom")),
            }
            if let Some(auto) = element.attribute("autolimits") {
                settings.auto_limits = auto == "true";
            }
            if let Some(sequence) = element.attribute("eulerseq") {
                settings.sequence = sequence.chars().collect();
                if settings.sequence.len() != 3 || settings.sequence.iter().any(|c| !"xyzXYZ".contains(*c)) {
                    return Err(unknown("eulerseq"));
                }
            }
        }
        Ok(settings)
    }

    /// Whether the range in `element` holds, by the attribute `name` that says so.
    pub(super) fn limited(&self, element: &Element, name: &str, range: [f64; 2]) -> Result<bool, String> {
        match element.attribute(name) {
            None | Some("auto") => Ok(self.auto_limits && range[0] < range[1]),
            Some("true") => Ok(true),
            Some("false") => Ok(false),
            Some(other) => Err(format!("{}: {name}=\"{other}\" is neither true, false nor auto", element.called())),
        }
    }

    /// Where an element stands in its body.
    pub(super) fn pose(&self, element: &Element) -> Result<Pose, String> {
        Ok(Pose { rotation: self.rotation(element)?, place: element.numbers("pos", Some([0.0; 3]))? })
    }

    fn rotation(&self, element: &Element) -> Result<Matrix, String> {
        let mut given = ORIENTATIONS.iter().filter(|n| element.attribute(n).is_some());
        let (Some(name), other) = (given.next(), given.next()) else { return Ok(IDENTITY) };
        if let Some(other) = other {
            return Err(format!("{} is turned by both {name} and {other}", element.called()));
        }
        let unit = |v: Vector| {
            let length = dot(v, v).sqrt();
            if length > 0.0 { Ok(scale(v, 1.0 / length)) } else { Err(format!("{}: {name} has no direction", element.called())) }
        };
        match *name {
            "quat" => {
                let [w, x, y, z] = element.numbers("quat", None)?;
                let sine = dot([x, y, z], [x, y, z]).sqrt();
                if sine == 0.0 && w == 0.0 {
                    return Err(format!("{}: quat has no direction", element.called()));
                }
                Ok(if sine == 0.0 { IDENTITY } else { about(scale([x, y, z], 1.0 / sine), 2.0 * sine.atan2(w)) })
            }
            "axisangle" => {
                let [x, y, z, angle] = element.numbers("axisangle", None)?;
                Ok(about(unit([x, y, z])?, angle * self.angle_rad))
            }
            "xyaxes" => {
                let [a, b, c, d, e, f] = element.numbers("xyaxes", None)?;
                let x = unit([a, b, c])?;
                let y = unit(sub([d, e, f], scale(x, dot(x, [d, e, f]))))?;
                Ok(transpose(&[x, y, cross(x, y)]))
            }
            "zaxis" => Ok(along(unit(element.numbers("zaxis", None)?)?)),
            _ => {
                let angles: Vector = element.numbers("euler", None)?;
                Ok(self.sequence.iter().zip(angles).fold(IDENTITY, |r, (axis, angle)| {
                    let k = "xyz".find(axis.to_ascii_lowercase()).unwrap_or_default();
                    let one = about(std::array::from_fn(|i| f64::from(u8::from(i == k))), angle * self.angle_rad);
                    if axis.is_ascii_lowercase() { product(&r, &one) } else { product(&one, &r) }
                }))
            }
        }
    }
}

/// The smallest rotation that takes z to a unit vector.
pub(super) fn along(axis: Vector) -> Matrix {
    let turning = cross([0.0, 0.0, 1.0], axis);
    let sine = dot(turning, turning).sqrt();
    let turning = if sine < 1e-10 { [1.0, 0.0, 0.0] } else { scale(turning, 1.0 / sine) };
    about(turning, sine.atan2(axis[2]))
}

/// The `<default>` elements of each class, its own before those around it; the outermost have no name here.
pub(super) struct Classes<'a>(Vec<(Option<&'a str>, Vec<&'a Element>)>);

impl<'a> Classes<'a> {
    pub(super) fn of(root: &'a Element) -> Result<Self, String> {
        let outermost: Vec<&Element> = root.children("default").collect();
        let mut classes = Classes(vec![(None, outermost.clone()), (Some("main"), outermost.clone())]);
        for top in &outermost {
            if let Some(name) = top.attribute("class") {
                classes.0.push((Some(name), outermost.clone()));
            }
            classes.nest(top, &outermost)?;
        }
        Ok(classes)
    }

    fn nest(&mut self, parent: &'a Element, around: &[&'a Element]) -> Result<(), String> {
        for child in parent.children("default") {
            let chain: Vec<&Element> = std::iter::once(child).chain(around.iter().copied()).collect();
            self.0.push((Some(child.required("class")?), chain.clone()));
            self.nest(child, &chain)?;
        }
        Ok(())
    }

    /// The element with what its class says of elements called one of `kinds`; `class` is that of the bodies around it.
    pub(super) fn fill(&self, element: &Element, kinds: &[&str], class: Option<&str>) -> Result<Element, String> {
        let class = element.attribute("class").or(class);
        let chain = self.0.iter().find(|(name, _)| *name == class).map(|(_, chain)| chain);
        let chain = chain.ok_or_else(|| format!("{} is of class \"{}\", which is not described", element.called(), class.unwrap_or_default()))?;
        let mut filled = Element { children: Vec::new(), ..element.clone() };
        for said in chain.iter().flat_map(|d| &d.children).filter(|c| kinds.contains(&c.name.as_str())) {
            for attribute in &said.attributes {
                if filled.attribute(&attribute.name).is_none() && attribute.name != "class" {
                    filled.attributes.push(attribute.clone());
                }
            }
        }
        Ok(filled)
    }
}
