//! Validation of the figures in `validation.toml`.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use grainwake_plot::{plan, style};
use grainwake_report::figure::field::{Quantity, Style};
use grainwake_solver::case::{Loc, Problem, Source, nearest};

use super::raw::{
    Colour, Coordinates, FieldQuantity, Line, Mark, RawAxis, RawFigure, RawHistory, RawPicture,
    RawReference, RawResults, Scale,
};
use super::{AxisSpec, Content, Data, Figure, Picture, Point, Series};
use crate::check::{Check, Reference, Run};
use crate::columns::Columns;
use crate::expression;
use crate::measurement::Sampling;

/// File, runs and constants that the figures refer to.
struct Context<'a> {
    source: &'a Source,
    runs: &'a [Run],
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
    runs: &[Run],
    folder: &Path,
    constants: &BTreeMap<String, f64>,
) -> Result<Vec<Figure>, Problem> {
    let context = Context {
        source,
        runs,
        folder,
        constants,
    };
    let mut out: Vec<Figure> = Vec::new();
    for figure in raw {
        let name = figure.name.value.clone();
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || !name.chars().all(plain) {
            let problem = Problem::new(format!("\"{name}\" is not a file name"))
                .help("use letters, digits, - and _, without extension");
            return Err(context.at(problem, figure.name.span.as_ref(), "here"));
        }
        if out.iter().any(|other| other.name == name) {
            let problem = Problem::new(format!("there are two figures called \"{name}\""))
                .help("give each figure a name of its own");
            return Err(context.at(problem, figure.name.span.as_ref(), "again"));
        }
        out.push(context.figure(figure)?);
    }
    Ok(out)
}

impl Context<'_> {
    fn at(&self, problem: Problem, span: Option<&Range<usize>>, label: &str) -> Problem {
        self.source.locate(problem, span, label)
    }

    fn figure(&self, raw: RawFigure) -> Result<Figure, Problem> {
        let curves = raw.reference.len() + raw.history.len() + raw.results.len();
        let sources = raw.reference.iter().filter_map(|r| r.source.clone());
        let sources = sources.collect();
        let wrong = |what: &str, help: &str| {
            let problem = Problem::new(format!("figure \"{}\" {what}", raw.name.value)).help(help);
            self.at(problem, raw.name.span.as_ref(), "this figure")
        };
        let content = match (raw.field, raw.x, raw.y) {
            (Some(field), None, None) if curves == 0 && !raw.picture.is_empty() => {
                let pictures = raw.picture.into_iter().map(|p| self.picture(p));
                Content::Pictures {
                    quantity: match field.quantity {
                        FieldQuantity::Speed => Quantity::Speed,
                        FieldQuantity::Vorticity => Quantity::Vorticity,
                        FieldQuantity::SolidFraction => Quantity::SolidFraction,
                    },
                    style: Style {
                        label: field.label,
                        limit: field.limit,
                        length: field.length,
                        arrows: field.arrows,
                    },
                    pictures: pictures.collect::<Result<_, _>>()?,
                }
            }
            (None, Some(x), Some(y)) if curves > 0 && raw.picture.is_empty() => Content::Plot {
                across: self.axis(x)?,
                up: self.axis(y)?,
                series: self.series(raw.reference, raw.history, raw.results)?,
            },
            _ => {
                return Err(wrong(
                    "is neither curves nor pictures",
                    "curves have `x`, `y` and any of `reference`, `history`, `results`; pictures have `field` and `picture`",
                ));
            }
        };
        Ok(Figure {
            name: raw.name.value,
            title: raw.title,
            caption: raw.caption,
            sources,
            content,
        })
    }

    fn axis(&self, raw: RawAxis) -> Result<AxisSpec, Problem> {
        let log = raw.scale == Scale::Log;
        for end in [&raw.from, &raw.to].into_iter().flatten() {
            if !end.value.is_finite() || (log && end.value <= 0.0) {
                let problem = Problem::new(format!("an axis cannot end at {}", end.value))
                    .help("a logarithmic axis has positive ends");
                return Err(self.at(problem, end.span.as_ref(), "this end"));
            }
        }
        Ok(AxisSpec {
            label: raw.label,
            log,
            ends: [raw.from.map(|v| v.value), raw.to.map(|v| v.value)],
            ticks: raw.ticks,
        })
    }

    /// Orders references, histories and results; default colours and symbols follow this order.
    fn series(
        &self,
        references: Vec<RawReference>,
        histories: Vec<RawHistory>,
        results: Vec<RawResults>,
    ) -> Result<Vec<Series>, Problem> {
        let mut out: Vec<Series> = Vec::new();
        let mut push =
            |label, colour: Option<Colour>, sign: Option<Mark>, line: Option<Line>, data| {
                let number = out.len();
                out.push(Series {
                    label,
                    colour: colour.map_or(style::grain_colour(number), Colour::hex),
                    sign: sign.map_or(number, |sign| sign as usize),
                    line: line.map(Line::dash),
                    data,
                });
            };
        for raw in references {
            let data = self.reference(&raw)?;
            push(raw.label, raw.colour, raw.sign, raw.line, data);
        }
        for raw in histories {
            let (label, colour) = (raw.label.clone(), raw.colour);
            let line = raw.line.unwrap_or(Line::Full);
            push(label, colour, None, Some(line), self.history(raw)?);
        }
        for raw in results {
            let data = self.results(&raw)?;
            push(raw.label, raw.colour, raw.sign, raw.line, data);
        }
        Ok(out)
    }

    fn reference(&self, raw: &RawReference) -> Result<Data, Problem> {
        let file = self.folder.join(&raw.data);
        for text in [&raw.x, &raw.y] {
            self.parse(text)?;
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
            self.parse(text)?;
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
        if let Coordinates::List(places) = &raw.x.value
            && places.len() != raw.runs.len()
        {
            let found = format!("{} numbers for {} runs", places.len(), raw.runs.len());
            let problem = Problem::new(found)
                .help("give one number for each run, or an expression of their constants");
            return Err(self.at(problem, raw.x.span.as_ref(), "as many as `runs`"));
        }
        let mut points = Vec::new();
        for (i, name) in raw.runs.iter().enumerate() {
            let run = self.run(name)?;
            let wanted = |check: &&Check| check.quantity == raw.quantity.value;
            let Some(check) = run.checks.iter().find(wanted) else {
                let known: Vec<&str> = run.checks.iter().map(|c| c.quantity.as_str()).collect();
                let problem = Problem::new(format!(
                    "run \"{}\" measures no \"{}\"",
                    run.name, raw.quantity.value
                ))
                .help(format!("it measures: {}", known.join(", ")));
                return Err(self.at(problem, raw.quantity.span.as_ref(), "not measured"));
            };
            let x = match &raw.x.value {
                Coordinates::List(places) => places[i],
                Coordinates::Expression(text) => expression::constant(text, &run.constants)
                    .map_err(|what| {
                        let names: Vec<&str> = run.constants.keys().map(String::as_str).collect();
                        let problem = Problem::new(format!("run \"{}\": {what}", run.name))
                            .help(format!("constants of this run: {}", names.join(", ")));
                        self.at(problem, raw.x.span.as_ref(), "here")
                    })?,
            };
            let reference = raw.reference.or(match check.reference {
                Some(Reference::Number(number)) => Some(number),
                _ => None,
            });
            if raw.error.value && reference.is_none_or(|r| r == 0.0) {
                let problem = Problem::new(format!(
                    "\"{}\" of run \"{}\" has no reference to be relative to",
                    check.quantity, run.name
                ))
                .help("add `reference = ...` other than 0 to this series");
                return Err(self.at(problem, raw.error.span.as_ref(), "without a reference"));
            }
            points.push(Point {
                run: run.name.clone(),
                x,
                check: check.clone(),
                reference,
            });
        }
        Ok(Data::Results {
            points,
            error: raw.error.value,
            slope: raw.slope,
        })
    }

    fn picture(&self, raw: RawPicture) -> Result<Picture, Problem> {
        let run = self.run(&raw.run)?.name.clone();
        let window = match (&raw.from, &raw.to) {
            (None, None) => None,
            (low, high) => {
                let low = low.as_ref().map_or([f64::NEG_INFINITY; 2], |v| v.value);
                let high_at = high.as_ref().map_or([f64::INFINITY; 2], |v| v.value);
                if !(low[0] < high_at[0] && low[1] < high_at[1]) {
                    let problem = Problem::new("the part that is shown is empty")
                        .help("`from` is the lower left corner, `to` the upper right one");
                    let span = high.as_ref().and_then(|v| v.span.as_ref());
                    return Err(self.at(problem, span, "not above `from`"));
                }
                Some(plan::Window {
                    low: low.into(),
                    high: high_at.into(),
                })
            }
        };
        Ok(Picture {
            run,
            plane: raw.plane,
            title: raw.title,
            window,
        })
    }

    fn run(&self, name: &Loc<String>) -> Result<&Run, Problem> {
        let found = self.runs.iter().find(|run| run.name == name.value);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.runs.iter().map(|run| run.name.as_str()).collect();
            let hint = nearest(name, names.iter().copied())
                .map_or(String::new(), |n| format!("did you mean \"{n}\"? "));
            let problem = Problem::new(format!("there is no run \"{}\"", name.value))
                .help(format!("{hint}There are: {}", names.join(", ")));
            self.at(problem, name.span.as_ref(), "not a run of this suite")
        })
    }

    fn parse(&self, text: &Loc<String>) -> Result<(), Problem> {
        expression::check(text).map_err(|what| self.wrong_expression(text, what))
    }

    fn wrong_expression(&self, text: &Loc<String>, what: String) -> Problem {
        let problem = Problem::new(what)
            .help("write an expression of columns and constants, such as \"sqrt(vx^2+vy^2)\"");
        self.at(problem, text.span.as_ref(), "this expression")
    }
}
