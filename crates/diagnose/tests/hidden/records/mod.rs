//! Measured recordings of others, read where they are at hand: `../shared/data` beside the repository.

use ndof_signal::{Channel, Quantity, Recording, Unit};
use ndof_sysid::Ports;
use std::path::PathBuf;

/// A record and its roles.
pub type Record = Option<(Vec<Recording>, Ports)>;

/// A record's name and what reads it.
pub type Reader = (&'static str, fn() -> Record);

/// All records by name.
pub const ALL: [Reader; 6] =
    [("emps", emps), ("ankle-pf", ankle_pf), ("ankle-df2", ankle_df2), ("mr-damper", mr_damper), ("robot-arm", robot_arm), ("cd-player", cd_player)];

/// Header and columns.
type Table = (Vec<String>, Vec<Vec<f64>>);

fn table(file: &str) -> Option<Table> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(file);
    let path = if path.exists() { path } else { std::env::var_os("NDOF_RECORDS").map(PathBuf::from)?.join(file) };
    let text = std::fs::read_to_string(path).ok()?;
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let header: Vec<String> = lines.next()?.split(',').map(|h| h.split('[').next().unwrap_or(h).trim().to_owned()).collect();
    let mut columns = vec![Vec::new(); header.len()];
    for line in lines {
        for (column, value) in columns.iter_mut().zip(line.split(',')) {
            column.push(value.trim().parse().ok()?);
        }
    }
    Some((header, columns))
}

fn recording(rate: f64, channels: Vec<(&str, Quantity, bool, Vec<f64>)>) -> Recording {
    let channels = channels.into_iter().map(|(name, quantity, rotational, samples)| Channel::new(name, Unit::si(quantity, rotational), samples)).collect();
    Recording::new(rate, channels).expect("columns of one length")
}

fn column(table: &Table, name: &str) -> Option<Vec<f64>> {
    table.0.iter().position(|h| h.contains(name)).map(|i| table.1[i].clone())
}

fn emps() -> Record {
    let t = table("emps/DATA_EMPS.csv")?;
    let r = recording(
        1000.0,
        vec![
            ("cmd_position", Quantity::Displacement, false, column(&t, "cmd_position")?),
            ("force_motor", Quantity::Effort, false, column(&t, "force_motor")?),
            ("pos_carriage", Quantity::Displacement, false, column(&t, "pos_carriage")?),
        ],
    );
    Some((vec![r], Ports { references: vec![0], inputs: vec![1], outputs: vec![2] }))
}

fn ankle(file: &str) -> Record {
    let t = table(file)?;
    let r = recording(
        1000.0,
        vec![("angle_ankle", Quantity::Displacement, true, t.1.first()?.clone()), ("torque_ankle", Quantity::Effort, true, t.1.get(1)?.clone())],
    );
    Some((vec![r], Ports { references: vec![], inputs: vec![0], outputs: vec![1] }))
}

fn ankle_pf() -> Record {
    ankle("ankle/z_pf.csv")
}

fn ankle_df2() -> Record {
    ankle("ankle/z_df2.csv")
}

fn mr_damper() -> Record {
    let mut trials = Vec::new();
    for file in ["mr_damper/magneto_est.csv", "mr_damper/magneto_val.csv"] {
        let t = table(file)?;
        trials.push(recording(
            200.0,
            vec![("vel_piston", Quantity::Velocity, false, column(&t, "vel")?), ("force_damper", Quantity::Effort, false, column(&t, "force")?)],
        ));
    }
    Some((trials, Ports { references: vec![], inputs: vec![0], outputs: vec![1] }))
}

fn robot_arm() -> Record {
    let t = table("robot_arm/robot_arm.csv")?;
    let r = recording(1.0, vec![("torque_arm", Quantity::Effort, true, column(&t, "torque")?), ("acc_arm", Quantity::Acceleration, true, column(&t, "acc")?)]);
    Some((vec![r], Ports { references: vec![], inputs: vec![0], outputs: vec![1] }))
}

fn cd_player() -> Record {
    let t = table("cd_player_arm/cd_player_arm.csv")?;
    let names = ["force_1", "force_2", "pos_1", "pos_2"];
    let channels = names
        .iter()
        .zip(&t.1[t.1.len() - 4..])
        .map(|(name, samples)| (*name, if name.starts_with("force") { Quantity::Effort } else { Quantity::Displacement }, false, samples.clone()))
        .collect();
    Some((vec![recording(1.0, channels)], Ports { references: vec![], inputs: vec![0, 1], outputs: vec![2, 3] }))
}
