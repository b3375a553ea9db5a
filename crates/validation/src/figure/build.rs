//! Validation of the figures in `validation.toml`.

use std::collections::BTreeMap;
use std::path::Path;

use grainwake_plot::style;
use grainwake_run::case::{Located, Problem, Source, did_you_mean};

use super::raw::{AxisSpec, SliceSpec};
use super::raw::{
    Colour, Coordinates, LineKind, RawFigure, RawHistory, RawReferenceCurve, RawResults, Scale,
    Symbol,
};
use super::spec::{Content, Data, FigureSpec, ResultPoint, SeriesSpec};
use crate::check::{Check, Reference, SuiteRun};
use crate::columns::Columns;
use crate::measurement::Sampling;
use crate::{expression, problem};

/// File, runs and constants that the figures refer to.
struct Context<'a> {
    source: &'a Source,
    runs: &'a [SuiteRun],
    folder: &'a Path,
    constants: &'a BTreeMap<String, f64>,
}

/// Builds the figures of a suite.
///
/// # Errors
/// The first problem, with its location.
pub fn build(
    source: &Source,
    raw: Vec<RawFigure>,
    runs: &[SuiteRun],
    folder: &Path,
    constants: &BTreeMap<String, f64>,
) -> Result<Vec<FigureSpec>, Problem> {
    let context = Context { source, runs, folder, constants };
    let mut out: Vec<FigureSpec> = Vec::new();
    for figure in raw {
        let name = &figure.name;
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.value.is_empty() || !name.value.chars().all(allowed) {
            let message = format!("\"{}\" is not a file name", name.value);
            let help = "use letters, digits, - and _, without extension";
            return Err(context.at(name, message, help, "here"));
        }
        if out.iter().any(|other| other.name == name.value) {
            let message = format!("there are two figures called \"{}\"", name.value);
            return Err(context.at(name, message, "give each figure a name of its own", "again"));
        }
        out.push(context.figure(figure)?);
    }
    Ok(out)
}

impl Context<'_> {
    fn at<T>(
        &self,
        value: &Located<T>,
        message: impl Into<String>,
        help: impl Into<String>,
        label: &str,
    ) -> Problem {
        problem::at(self.source, value, message, help, label)
    }

    fn figure(&self, raw: RawFigure) -> Result<FigureSpec, Problem> {
        let curves = raw.reference.len() + raw.history.len() + raw.results.len();
        let mut sources: Vec<String> = Vec::new();
        for source in raw.reference.iter().filter_map(|r| r.source.as_ref()) {
            if !sources.contains(source) {
                sources.push(source.clone());
            }
        }
        let content = match (raw.field, raw.x, raw.y) {
            (Some(field), None, None) if curves == 0 && !raw.picture.is_empty() => {
                for picture in &raw.picture {
                    self.check_picture(picture)?;
                }
                Content::Pictures { style: field, pictures: raw.picture }
            }
            (None, Some(across), Some(up)) if curves > 0 && raw.picture.is_empty() => {
                self.check_axis(&across)?;
                self.check_axis(&up)?;
                Content::Plot {
                    across,
                    up,
                    series: self.series(raw.reference, raw.history, raw.results)?,
                }
            }
            _ => {
                let name = &raw.name.value;
                let message = format!("figure \"{name}\" is neither curves nor pictures");
                let help = "curves have `x`, `y` and any of `reference`, `history`, `results`; \
                            pictures have `field` and `picture`";
                return Err(self.at(&raw.name, message, help, "this figure"));
            }
        };
        Ok(FigureSpec {
            name: raw.name.value,
            title: raw.title,
            caption: raw.caption,
            sources,
            content,
        })
    }

    fn check_axis(&self, axis: &AxisSpec) -> Result<(), Problem> {
        for end in [&axis.from, &axis.to].into_iter().flatten() {
            if !end.value.is_finite() || (axis.scale == Scale::Log && end.value <= 0.0) {
                let message = format!("an axis cannot end at {}", end.value);
                let help = "a logarithmic axis has positive ends";
                return Err(self.at(end, message, help, "this end"));
            }
        }
        Ok(())
    }

    /// Orders references, histories and results; default colours and symbols follow this order.
    fn series(
        &self,
        references: Vec<RawReferenceCurve>,
        histories: Vec<RawHistory>,
        results: Vec<RawResults>,
    ) -> Result<Vec<SeriesSpec>, Problem> {
        let mut out: Vec<SeriesSpec> = Vec::new();
        let mut push =
            |label, colour: Option<Colour>, sign: Option<Symbol>, line: Option<LineKind>, data| {
                let number = out.len();
                out.push(SeriesSpec {
                    label,
                    colour: colour.map_or(style::series_colour(number), Colour::hex),
                    sign: sign.map_or(number, |sign| sign as usize),
                    line: line.map(LineKind::dash),
                    data,
                });
            };
        for raw in references {
            let data = self.reference(&raw)?;
            push(raw.label, raw.colour, raw.sign, raw.line, data);
        }
        for raw in histories {
            let (label, colour) = (raw.label.clone(), raw.colour);
            let line = raw.line.unwrap_or(LineKind::Full);
            push(label, colour, None, Some(line), self.history(raw)?);
        }
        for raw in results {
            let data = self.results(&raw)?;
            push(raw.label, raw.colour, raw.sign, raw.line, data);
        }
        Ok(out)
    }

    fn reference(&self, raw: &RawReferenceCurve) -> Result<Data, Problem> {
        let file = self.folder.join(&raw.data);
        for text in [&raw.x, &raw.y] {
            self.check_syntax(text)?;
            // A missing file leaves the series out; a wrong column is an error.
            if let Ok(columns) = Columns::read_reference(&file) {
                expression::evaluate(text, &columns, self.constants)
                    .map_err(|what| self.wrong_expression(text, what))?;
            }
        }
        Ok(Data::Reference {
            file,
            x: raw.x.value.clone(),
            y: raw.y.value.clone(),
            constants: self.constants.clone(),
        })
    }

    fn history(&self, raw: RawHistory) -> Result<Data, Problem> {
        let run = self.run(&raw.run)?;
        for text in [Some(&raw.of), raw.against.as_ref()].into_iter().flatten() {
            self.check_syntax(text)?;
        }
        Ok(Data::History {
            run: run.name.clone(),
            constants: run.constants.clone(),
            derivative: raw.derivative,
            sampling: Sampling {
                of: raw.of.value,
                grain: raw.grain,
                table: raw.table,
                against: raw.against.map(|text| text.value),
                from: raw.from,
                to: raw.to,
                ..Sampling::default()
            },
        })
    }

    fn results(&self, raw: &RawResults) -> Result<Data, Problem> {
        let count = raw.runs.len();
        if let Coordinates::List(list) = &raw.x.value
            && list.len() != count
        {
            let message = format!("{} values for {count} runs", list.len());
            let help = "give one number for each run, or an expression of their constants";
            return Err(self.at(&raw.x, message, help, "as many as `runs`"));
        }
        let points = raw.runs.iter().enumerate().map(|(i, name)| self.point(raw, i, name));
        Ok(Data::Results {
            points: points.collect::<Result<_, _>>()?,
            error: raw.error.value,
            slope: raw.slope,
        })
    }

    /// Builds the point of the `i`-th run of a series.
    fn point(
        &self,
        raw: &RawResults,
        i: usize,
        name: &Located<String>,
    ) -> Result<ResultPoint, Problem> {
        let run = self.run(name)?;
        let wanted = |check: &&Check| check.quantity == raw.quantity.value;
        let check = run.checks.iter().find(wanted).ok_or_else(|| {
            let known: Vec<&str> = run.checks.iter().map(|c| c.quantity.as_str()).collect();
            let message = format!("run \"{}\" measures no \"{}\"", run.name, raw.quantity.value);
            let help = format!("it measures: {}", known.join(", "));
            self.at(&raw.quantity, message, help, "not measured")
        })?;
        let x = match &raw.x.value {
            Coordinates::List(list) => list[i],
            Coordinates::Expression(text) => {
                expression::constant(text, &run.constants).map_err(|what| {
                    let names: Vec<&str> = run.constants.keys().map(String::as_str).collect();
                    let help = format!("constants of this run: {}", names.join(", "));
                    self.at(&raw.x, format!("run \"{}\": {what}", run.name), help, "here")
                })?
            }
        };
        let reference = raw.reference.or(match check.reference {
            Some(Reference::Number(number)) => Some(number),
            _ => None,
        });
        if raw.error.value && reference.is_none_or(|r| r == 0.0) {
            let quantity = &check.quantity;
            let message =
                format!("\"{quantity}\" of run \"{}\" has no nonzero reference", run.name);
            let help = "a relative error needs `reference = ...`, other than 0, in this series";
            return Err(self.at(&raw.error, message, help, "relative error"));
        }
        Ok(ResultPoint { run: run.name.clone(), x, check: check.clone(), reference })
    }

    fn check_picture(&self, picture: &SliceSpec) -> Result<(), Problem> {
        self.run(&picture.run)?;
        let window = picture.window();
        if window.width() > 0.0 && window.height() > 0.0 {
            return Ok(());
        }
        let help = "`from` is the lower left corner, `to` the upper right one";
        let problem = Problem::new("the window is empty").help(help);
        let span = picture.to.as_ref().and_then(|to| to.span.as_ref());
        Err(self.source.locate(problem, span, "not above `from`"))
    }

    fn run(&self, name: &Located<String>) -> Result<&SuiteRun, Problem> {
        let found = self.runs.iter().find(|run| run.name == name.value);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.runs.iter().map(|run| run.name.as_str()).collect();
            let hint = did_you_mean(name, names.iter().copied());
            let message = format!("there is no run \"{}\"", name.value);
            let help = format!("{hint}Known runs: {}", names.join(", "));
            self.at(name, message, help, "not a run of this suite")
        })
    }

    fn check_syntax(&self, text: &Located<String>) -> Result<(), Problem> {
        expression::check(text).map_err(|what| self.wrong_expression(text, what))
    }

    fn wrong_expression(&self, text: &Located<String>, what: String) -> Problem {
        let help = "write an expression of columns and constants, such as \"sqrt(vx^2+vy^2)\"";
        self.at(text, what, help, "this expression")
    }
}
