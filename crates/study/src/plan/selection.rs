//! Selection of runs: `--only`.

use grainwake_run::case::{Problem, did_you_mean};

use super::Run;

/// Selection of runs of a study.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Selection {
    /// All runs.
    #[default]
    All,
    /// Runs whose names match any of the patterns.
    Patterns(Vec<glob::Pattern>),
    /// Every `of`-th run, starting with number `part`; both count from 1.
    Share {
        /// Number of the first run.
        part: usize,
        /// Number of shares.
        of: usize,
    },
}

impl Selection {
    /// Reads "g04-*,sphere" or "3/65".
    ///
    /// # Errors
    /// If the text is neither a list of patterns nor a valid share.
    pub fn parse(text: &str) -> Result<Selection, Problem> {
        let wrong = |what: String| {
            Problem::new(format!("--only {text}: {what}")).help(
                "write names with * and ?, separated by commas (--only 'g04-*,sphere'), or a \
                 share i/N (--only 3/65)",
            )
        };
        if let Some((part, of)) = text.split_once('/') {
            let number = |t: &str| t.trim().parse::<usize>().ok();
            return match (number(part), number(of)) {
                (Some(part), Some(of)) if (1..=of).contains(&part) => {
                    Ok(Selection::Share { part, of })
                }
                (Some(_), Some(_)) => {
                    Err(wrong("in a share i/N, i must be between 1 and N".into()))
                }
                _ => Err(wrong("a share consists of two whole numbers".into())),
            };
        }
        let names = text.split(',').map(str::trim).filter(|part| !part.is_empty());
        match names.map(glob::Pattern::new).collect::<Result<Vec<_>, _>>() {
            Ok(patterns) if patterns.is_empty() => Err(wrong("no name is given".into())),
            Ok(patterns) => Ok(Selection::Patterns(patterns)),
            Err(error) => Err(wrong(error.to_string())),
        }
    }

    /// Returns the indices of the selected runs.
    ///
    /// # Errors
    /// If a pattern matches no run; a share may be empty.
    pub fn choose(&self, runs: &[Run]) -> Result<Vec<usize>, Problem> {
        let all = 0..runs.len();
        let patterns = match self {
            Selection::All => return Ok(all.collect()),
            Selection::Share { part, of } => {
                return Ok(all.filter(|i| i % of == part - 1).collect());
            }
            Selection::Patterns(patterns) => patterns,
        };
        for pattern in patterns {
            if !runs.iter().any(|run| pattern.matches(&run.name)) {
                let names = runs.iter().map(|run| run.name.as_str());
                let hint = did_you_mean(pattern.as_str(), names);
                let problem = Problem::new(format!("--only: no run is called \"{pattern}\""));
                return Err(problem.help(format!("{hint}--list shows all names")));
            }
        }
        let matches = |i: &usize| patterns.iter().any(|p| p.matches(&runs[*i].name));
        Ok(all.filter(matches).collect())
    }
}
