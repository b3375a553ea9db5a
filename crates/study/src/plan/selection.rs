//! Which runs of a study are meant: `--only`.

use grainwake_solver::case::{Problem, nearest};

use crate::plan::Run;

/// A choice of runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Selection {
    /// All of them.
    #[default]
    All,
    /// Those whose names match one of these.
    Patterns(Vec<glob::Pattern>),
    /// Every `of`-th, from number `part` on; both count from 1.
    Share {
        /// Which share.
        part: usize,
        /// Of how many.
        of: usize,
    },
}

impl Selection {
    /// Reads "g04-*,sphere" or "3/65".
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Selection, Problem> {
        let wrong = |what: String| {
            Problem::new(format!("--only {text}: {what}")).help(
                "write names with * and ?, separated by commas (--only 'g04-*,sphere'), or a share i/N (--only 3/65)",
            )
        };
        if let Some((part, of)) = text.split_once('/') {
            let number = |t: &str| t.trim().parse::<usize>().ok();
            return match (number(part), number(of)) {
                (Some(part), Some(of)) if (1..=of).contains(&part) => {
                    Ok(Selection::Share { part, of })
                }
                (Some(_), Some(_)) => Err(wrong("in a share i/N, i goes from 1 to N".into())),
                _ => Err(wrong("not a share of two whole numbers".into())),
            };
        }
        let patterns: Result<Vec<_>, _> = text
            .split(',')
            .map(str::trim)
            .filter(|part| !part.is_empty())
            .map(glob::Pattern::new)
            .collect();
        match patterns {
            Ok(patterns) if patterns.is_empty() => Err(wrong("nothing is named".into())),
            Ok(patterns) => Ok(Selection::Patterns(patterns)),
            Err(error) => Err(wrong(error.to_string())),
        }
    }

    /// Indices of the chosen runs.
    ///
    /// # Errors
    /// If a pattern matches none; a share may be empty.
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
                let hint = nearest(pattern.as_str(), names)
                    .map_or(String::new(), |n| format!("did you mean \"{n}\"? "));
                return Err(
                    Problem::new(format!("--only: no run is called \"{pattern}\""))
                        .help(format!("{hint}--list shows all of them")),
                );
            }
        }
        Ok(all
            .filter(|i| patterns.iter().any(|p| p.matches(&runs[*i].name)))
            .collect())
    }
}
