//! Which arm it is and where its joints are: from a file, from a few numbers, or both.

use crate::error::CliError;
use clap::Args;
use ndof_study::file::{self, KinematicsFile, MeanForce};
use std::path::PathBuf;

/// Which arm it is and where its joints are.
#[derive(Clone, Debug, Args)]
pub struct Limb {
    /// The arm: a fit is projected to its joints, a diagnosis weighs its curved geometry
    #[arg(long, value_name = "FILE.toml", help_heading = "Limb")]
    pub kinematics: Option<PathBuf>,
    /// Which arm: the right one bends with a positive elbow angle, the left with a negative one [default: right]
    #[arg(long, value_parser = ["right", "left"], help_heading = "Limb")]
    pub arm: Option<String>,
    /// Upper arm and forearm (to the hand), in metres
    #[arg(long, value_name = "A,B", value_parser = two, allow_hyphen_values = true, help_heading = "Limb")]
    pub link_lengths: Option<[f64; 2]>,
    /// Where the shoulder is, in metres in the robot's axes
    #[arg(long, value_name = "X,Y", value_parser = two, allow_hyphen_values = true, requires = "hand", help_heading = "Limb")]
    pub shoulder: Option<[f64; 2]>,
    /// Where the hand is, in metres in the robot's axes
    #[arg(long, value_name = "X,Y", value_parser = two, allow_hyphen_values = true, requires = "shoulder", help_heading = "Limb")]
    pub hand: Option<[f64; 2]>,
    /// Angles of shoulder and elbow in radians, in place of their positions
    #[arg(long, value_name = "A,B", value_parser = two, allow_hyphen_values = true, conflicts_with = "shoulder", help_heading = "Limb")]
    pub posture: Option<[f64; 2]>,
    /// Mean force on the hand in newtons, or `measured` for the mean of the inputs
    #[arg(long, value_name = "X,Y", value_parser = force, allow_hyphen_values = true, help_heading = "Limb")]
    pub mean_force: Option<MeanForce>,
}

fn two(text: &str) -> Result<[f64; 2], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok().filter(|value: &f64| value.is_finite())).collect();
    numbers.and_then(|numbers| <[f64; 2]>::try_from(numbers).ok()).ok_or_else(|| "write two numbers with a comma between them, such as 0.33,0.34".to_owned())
}

fn force(text: &str) -> Result<MeanForce, String> {
    match text {
        "measured" => Ok(MeanForce::Word(text.to_owned())),
        _ => two(text).map(|force| MeanForce::Known(force.to_vec())).map_err(|error| format!("{error}, or `measured`")),
    }
}

impl Limb {
    /// The arm, if one is described; what is said on the command line takes the place of what the file says.
    pub fn read(&self) -> Result<Option<KinematicsFile>, CliError> {
        let asked = [
            ("--arm", self.arm.is_some()),
            ("--link-lengths", self.link_lengths.is_some()),
            ("--shoulder, --hand", self.shoulder.is_some()),
            ("--posture", self.posture.is_some()),
        ];
        let given: Vec<&str> = asked.iter().filter(|(_, asked)| *asked).map(|(option, _)| *option).collect();
        let mut arm = match &self.kinematics {
            Some(path) => {
                ndof_io::keep(path);
                let file = file::read::<KinematicsFile>(path)?;
                KinematicsFile { origin: path.display().to_string(), ..file }
            }
            None if !given.is_empty() => KinematicsFile { kind: "planar-two-link".to_owned(), origin: given.join(", "), ..Default::default() },
            None if self.mean_force.is_some() => {
                return Err(CliError::Usage(
                    "--mean-force says nothing without an arm; add --kinematics, or --link-lengths with --shoulder and --hand".to_owned(),
                ));
            }
            None => return Ok(None),
        };
        let list = |pair: [f64; 2]| pair.to_vec();
        arm.arm = self.arm.clone().or(arm.arm);
        arm.link_lengths_m = self.link_lengths.map(list).or(arm.link_lengths_m);
        arm.mean_force_n = self.mean_force.clone().or(arm.mean_force_n);
        if self.posture.is_some() {
            (arm.posture_rad, arm.shoulder_m, arm.hand_m) = (self.posture.map(list), None, None);
        }
        if self.shoulder.is_some() {
            (arm.posture_rad, arm.shoulder_m, arm.hand_m) = (None, self.shoulder.map(list), self.hand.map(list));
        }
        Ok(Some(arm))
    }
}
