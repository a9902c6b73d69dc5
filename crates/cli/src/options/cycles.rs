//! Where cycles begin: by the clock, by a channel, or at times in a file.

use crate::error::CliError;
use clap::Args;
use ndof_analysis::options::positive;
use ndof_analysis::{Events, Trials};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One of three ways.
#[derive(Clone, Debug, Args)]
pub struct CycleOptions {
    /// Duration of a cycle in seconds; the first begins at time zero of each recording
    #[arg(long, value_name = "S", value_parser = positive, conflicts_with_all = ["cycle_by", "event"])]
    pub cycle: Option<f64>,
    /// Channel that tells where cycles begin: by its rising edges, or as a phase that wraps there
    #[arg(long, value_name = "CHANNEL", conflicts_with = "event")]
    pub cycle_by: Option<String>,
    /// Times in seconds at which cycles begin, one a line, with the number of the trial in a second column where they differ
    #[arg(long, value_name = "FILE")]
    event: Option<PathBuf>,
}

impl CycleOptions {
    /// Whether one of them is.
    pub fn given(&self) -> bool {
        self.cycle.is_some() || self.cycle_by.is_some() || self.event.is_some()
    }

    /// The channel, which is kept though it has no role.
    pub fn channels(&self) -> Vec<String> {
        self.cycle_by.iter().cloned().collect()
    }

    /// What the file of times holds for these trials.
    pub fn times(&self, trials: &Trials) -> Result<Option<Events>, CliError> {
        let Some(path) = &self.event else { return Ok(None) };
        ndof_io::keep(path);
        let text = std::fs::read_to_string(path).map_err(|source| CliError::Machine { what: format!("reading {}", path.display()), source })?;
        events(&text, trials.trials.len()).map(Some).map_err(|what| CliError::Usage(format!("{}: {what}", path.display())))
    }
}

/// Seconds, one a line, and the number of the trial behind them where there are several; columns named `time` and `trial` may stand in any order,
/// and lines that begin with # are remarks.
fn events(text: &str, trials: usize) -> Result<Events, String> {
    let lines = text.lines().enumerate().map(|(k, line)| (k + 1, line.trim())).filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let mut columns = [0, 1];
    let mut of_trial: BTreeMap<Option<usize>, Vec<f64>> = BTreeMap::new();
    for (k, (number, line)) in lines.enumerate() {
        let cells: Vec<&str> = line.split([',', ';', '\t', ' ']).map(str::trim).filter(|cell| !cell.is_empty()).collect();
        let cell = |column: usize| cells.get(column).copied();
        if k == 0 && cell(0).is_some_and(|cell| cell.parse::<f64>().is_err()) {
            let trial = cells.iter().position(|name| name.eq_ignore_ascii_case("trial"));
            columns = trial.map_or([0, usize::MAX], |trial| [usize::from(trial == 0), trial]);
            continue;
        }
        let time = cell(columns[0]).and_then(|cell| cell.parse::<f64>().ok()).filter(|time| time.is_finite());
        let time =
            time.ok_or_else(|| format!("line {number}: \"{line}\" holds no time; write seconds, and behind a comma the trial where there are several"))?;
        let trial = cell(columns[1]).map(|cell| cell.parse::<usize>().ok().filter(|trial| (1..=trials).contains(trial)));
        if trial == Some(None) {
            return Err(format!("line {number}: \"{line}\" is of no trial; they count from 1 to {trials}"));
        }
        of_trial.entry(trial.flatten()).or_default().push(time);
    }
    match (of_trial.remove(&None), of_trial.is_empty()) {
        (Some(times), true) => Ok(Events::Every(times)),
        (None, false) => Ok(Events::Each((1..=trials).map(|trial| of_trial.remove(&Some(trial)).unwrap_or_default()).collect())),
        (None, true) => Err("no time in it; write seconds, one a line".to_owned()),
        (Some(_), false) => Err("some lines name a trial and some do not; name it in all or in none".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_of_every_trial_or_of_the_one_that_is_named() {
        assert_eq!(events("# heel strikes\n0.5\n1.7 \n", 2), Ok(Events::Every(vec![0.5, 1.7])));
        assert_eq!(events("time_s\n0.5\n", 1), Ok(Events::Every(vec![0.5])));
        let each = Ok(Events::Each(vec![vec![0.5, 1.7], vec![], vec![0.4]]));
        assert_eq!(events("0.5,1\n1.7,1\n0.4,3\n", 3), each);
        assert_eq!(events("trial;time\n1;0.5\n1;1.7\n3;0.4\n", 3), each);
    }

    #[test]
    fn what_is_no_list_of_times_is_refused_with_its_line() {
        for (text, said) in [("", "no time"), ("time\n0.5\nx\n", "line 3"), ("0.5,4\n", "from 1 to 3"), ("0.5,1\n0.7\n", "all or in none")] {
            assert!(events(text, 3).expect_err("refused").contains(said), "{text}");
        }
    }
}
