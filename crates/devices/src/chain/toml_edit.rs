//! Corrections of a robot in TOML, line by line.

use super::config::RobotConfig;
use super::correction::{Corrected, Correction, by_joint, corrected, missing};
use super::edits::{Edits, one_line};
use std::ops::Range;

/// Changes lines of `key = value`, and refuses a file whose layout they do not reach.
pub(super) fn into_toml(
    text: &str,
    mut config: RobotConfig,
    corrections: &[Correction],
    edits: &mut Edits<'_>,
    left_out: &mut Vec<String>,
) -> Result<(), String> {
    let (top, blocks) = tables(text);
    for (name, own) in by_joint(corrections) {
        let names = || config.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", ");
        let at = config.joints.iter().position(|j| j.name == name).ok_or_else(|| format!("no joint \"{name}\"; there are: {}", names()))?;
        let joint = corrected(&config.joints[at], &own)?;
        let block = blocks.get(at).ok_or_else(|| format!("joint \"{name}\" is not described under a line [[joints]]; write it there"))?;
        let mut lines: Vec<(&str, String, Vec<&str>)> = Vec::new();
        for correction in own {
            let (key, value) = match correction.what {
                Corrected::Viscous => ("viscous_nm_s_per_rad", format!("{:?}", joint.viscous_nm_s_per_rad)),
                Corrected::Coulomb => ("coulomb_nm", format!("{:?}", joint.coulomb_nm)),
                Corrected::FrictionAhead => ("friction_ahead_s", format!("{:?}", joint.friction_ahead_s)),
                Corrected::Rotor => ("rotor_inertia_kg_m2", format!("{:?}", joint.rotor_inertia_kg_m2)),
                Corrected::Stiffness => ("stiffness_nm_per_rad", format!("{:?}", joint.stiffness_nm_per_rad)),
                Corrected::SpringRest => ("spring_rest_rad", format!("{:?}", joint.spring_rest_rad)),
                Corrected::Mass => ("mass_kg", format!("{:?}", joint.mass_kg)),
                Corrected::Centre(_) => ("centre_m", format!("{:?}", joint.centre_m)),
                Corrected::Inertia(_) => ("inertia_kg_m2", format!("{:?}", joint.inertia_kg_m2)),
                Corrected::Range(_) => ("range_rad", format!("{:?}", joint.range_rad.unwrap_or_default())),
                Corrected::TorqueDelay | Corrected::Gravity(_) => {
                    left_out.push(missing(correction, "a robot in TOML"));
                    continue;
                }
            };
            match lines.iter_mut().find(|(k, ..)| *k == key) {
                Some((_, _, why)) => why.push(&correction.why),
                None => lines.push((key, value, vec![&correction.why])),
            }
        }
        lines.iter().for_each(|(key, value, why)| line(text, block, key, value, why, edits));
        config.joints[at] = joint;
    }
    let mut why = Vec::new();
    for correction in corrections {
        if let Corrected::Gravity(k) = correction.what {
            config.gravity_m_per_s2[k] = correction.value;
            why.push(correction.why.as_str());
        }
    }
    if !why.is_empty() {
        line(text, &top, "gravity_m_per_s2", &format!("{:?}", config.gravity_m_per_s2), &why, edits);
    }
    match toml::from_str::<RobotConfig>(&edits.applied()) {
        Ok(written) if written == config => Ok(()),
        _ => Err("its layout is not one number or list a line, so that corrections cannot be written into it".to_owned()),
    }
}

/// What stands before all tables, and what under each `[[joints]]`.
fn tables(text: &str) -> (Range<usize>, Vec<Range<usize>>) {
    let headers = |from: usize| {
        let starts = std::iter::once(from).chain(text[from..].match_indices('\n').map(move |(k, _)| from + k + 1));
        starts.filter(|k| text[*k..].trim_start_matches([' ', '\t']).starts_with('['))
    };
    let next = |from: usize| headers(from).next().unwrap_or(text.len());
    let below = |header: usize| header + text[header..].find('\n').map_or(text.len() - header, |k| k + 1);
    let joints = headers(0).filter(|k| text[*k..].trim_start().starts_with("[[joints]]")).map(below).map(|begin| begin..next(begin));
    (0..next(0), joints.collect())
}

/// Gives `key` a value in its line, or in a new one at the end of the last line with something in it.
fn line(text: &str, block: &Range<usize>, key: &str, value: &str, why: &[&str], edits: &mut Edits<'_>) {
    let comments: String = why.iter().map(|w| format!("# {}\n", one_line(w))).collect();
    let mut at = block.start;
    for line in text[block.clone()].split_inclusive('\n') {
        let body = line.trim_end();
        if body.split_once('=').is_some_and(|(k, _)| k.trim() == key) {
            let begin = at + body.find('=').unwrap_or_default() + 1;
            let end = body.find('#').map_or(at + body.len(), |k| at + body[..k].trim_end().len());
            edits.replace(at..at, comments);
            edits.replace(begin..end, format!(" {value}"));
            return;
        }
        at += line.len();
    }
    let end = block.start + text[block.clone()].trim_end().len();
    edits.replace(end..end, format!("\n{comments}{key} = {value}"));
}
