//! Bodies of uniform density in the shapes of MJCF.

use super::body::{Body, Pose};
use super::mjcf_settings::{Compiler, along};
use super::xml::Element;
use crate::vector3::{Vector, add, dot, scale, sub};
use std::f64::consts::PI;

/// What a `<geom>`, its defaults filled in, weighs in a body that stands at `pose`: by its mass, else its density.
pub(super) fn body(geom: &Element, compiler: &Compiler, pose: &Pose) -> Result<Body, String> {
    let kind = geom.attribute("type").unwrap_or("sphere");
    let given = geom.attribute("mass").is_some().then(|| geom.number("mass", 0.0)).transpose()?;
    let density = geom.number("density", 1000.0)?;
    if given.unwrap_or(density) == 0.0 || matches!(kind, "plane" | "hfield") {
        return Ok(Body::default());
    }
    if geom.attribute("shellinertia").is_some_and(|v| v != "false") {
        return Err(format!("{} has shellinertia, which is not read; give its body an <inertial>", geom.called()));
    }
    let mut size = if geom.attribute("size").is_some() { geom.list("size")? } else { Vec::new() };
    let mut here = compiler.pose(geom);
    if geom.attribute("fromto").is_some() {
        let [a, b, c, d, e, f] = geom.numbers("fromto", None)?;
        let (way, radius) = (sub([a, b, c], [d, e, f]), size.first().copied().unwrap_or(0.0));
        let length = dot(way, way).sqrt();
        if length == 0.0 {
            return Err(format!("{}: fromto has no direction", geom.called()));
        }
        here = Ok(Pose { rotation: along(scale(way, 1.0 / length)), place: scale(add([a, b, c], [d, e, f]), 0.5) });
        size = if matches!(kind, "box" | "ellipsoid") { vec![radius, radius, 0.5 * length] } else { vec![radius, 0.5 * length] };
    }
    let count = match kind {
        "sphere" => 1,
        "capsule" | "cylinder" => 2,
        "box" | "ellipsoid" => 3,
        other => return Err(format!("{} is of type \"{other}\", whose inertia is not read; give its body an <inertial>, or it mass=\"0\"", geom.called())),
    };
    if size.len() < count || size[..count].iter().any(|v| *v <= 0.0) {
        return Err(format!("{}: a {kind} has {count} positive numbers as its size", geom.called()));
    }
    let (volume, per_mass) = uniform(kind, &size);
    let mass = given.unwrap_or(density * volume);
    if mass < 0.0 {
        return Err(format!("{} has a mass below zero", geom.called()));
    }
    let [x, y, z] = scale(per_mass, mass);
    Ok(Body::new(mass, &pose.then(&here?), &[[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]))
}

/// Volume, and principal moments of a unit mass, of half-lengths and radii in `size`.
fn uniform(kind: &str, size: &[f64]) -> (f64, Vector) {
    let square = |k: usize| size[k] * size[k];
    match kind {
        "sphere" => (4.0 / 3.0 * PI * size[0].powi(3), [0.4 * square(0); 3]),
        "box" => (8.0 * size[0] * size[1] * size[2], [(1, 2), (0, 2), (0, 1)].map(|(i, j)| (square(i) + square(j)) / 3.0)),
        "ellipsoid" => (4.0 / 3.0 * PI * size[0] * size[1] * size[2], [(1, 2), (0, 2), (0, 1)].map(|(i, j)| (square(i) + square(j)) / 5.0)),
        _ => {
            let (radius, length) = (size[0], 2.0 * size[1]);
            let (middle, ends) = (PI * square(0) * length, if kind == "capsule" { 4.0 / 3.0 * PI * radius.powi(3) } else { 0.0 });
            let (tube, balls) = (middle / (middle + ends), ends / (middle + ends));
            // Half balls, whose centres are 3/8 of the radius beyond the ends of the tube.
            let across = tube * (3.0 * square(0) + length * length) / 12.0 + balls * (0.4 * square(0) + length * (3.0 * radius + 2.0 * length) / 8.0);
            (middle + ends, [across, across, tube * 0.5 * square(0) + balls * 0.4 * square(0)])
        }
    }
}
