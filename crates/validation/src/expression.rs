//! Expressions of columns and constants.

use std::collections::BTreeMap;

use exmex::prelude::*;

use crate::columns::Columns;

fn parse(text: &str) -> Result<exmex::FlatEx<f64>, String> {
    exmex::parse::<f64>(text).map_err(|e| format!("'{text}': {e}"))
}

/// Checks the syntax of an expression.
pub(crate) fn check(text: &str) -> Result<(), String> {
    parse(text).map(|_| ())
}

/// Evaluates an expression for every row that all its columns have; its names are columns or
/// constants.
pub(crate) fn evaluate(
    text: &str,
    columns: &Columns,
    constants: &BTreeMap<String, f64>,
) -> Result<Vec<f64>, String> {
    /// Values of one name.
    enum Values<'a> {
        Column(&'a [f64]),
        Constant(f64),
    }
    let parsed = parse(text)?;
    let values = |name: &String| match (columns.get(name), constants.get(name)) {
        (Some(column), _) => Ok(Values::Column(column)),
        (None, Some(constant)) => Ok(Values::Constant(*constant)),
        (None, None) => Err(format!(
            "'{text}': there is no column or constant \"{name}\"; columns: {}",
            columns.names.join(", ")
        )),
    };
    let names: Vec<Values> = parsed.var_names().iter().map(values).collect::<Result<_, _>>()?;
    // The columns of a grain that has left the box are shorter.
    let lengths = names.iter().filter_map(|values| match values {
        Values::Column(column) => Some(column.len()),
        Values::Constant(_) => None,
    });
    let rows = lengths.min().unwrap_or(columns.rows());
    let mut row = vec![0.0; names.len()];
    let at = |i: usize| {
        for (slot, values) in row.iter_mut().zip(&names) {
            *slot = match values {
                Values::Column(column) => column[i],
                Values::Constant(constant) => *constant,
            };
        }
        parsed.eval(&row).map_err(|e| format!("'{text}': {e}"))
    };
    (0..rows).map(at).collect()
}

/// Evaluates an expression of constants only.
pub(crate) fn constant(text: &str, constants: &BTreeMap<String, f64>) -> Result<f64, String> {
    let one_row = Columns { names: vec![String::new()], values: vec![vec![0.0]] };
    evaluate(text, &one_row, constants).map(|values| values[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_those_of_the_shortest_column() {
        let columns = Columns {
            names: ["a", "b"].map(str::to_owned).to_vec(),
            values: vec![vec![5.0, 6.0, 7.0], vec![1.0, 2.0]],
        };
        let constants = BTreeMap::from([("c".to_owned(), 10.0)]);
        let of = |text: &str| evaluate(text, &columns, &constants).unwrap();
        assert_eq!(of("a-b"), [4.0, 4.0]);
        assert_eq!(of("c*b"), [10.0, 20.0]);
        assert_eq!(of("a"), [5.0, 6.0, 7.0]);
        assert_eq!(of("c"), [10.0; 3]);
    }
}
