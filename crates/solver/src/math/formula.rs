//! Vectors given by formulas, such as an initial velocity in x, y, z or a motion in t.

use std::sync::Arc;

use exmex::prelude::*;
use glam::DVec3;

use super::precedence::with_brackets;

/// Three formulas in the same variables.
#[derive(Clone, Debug)]
pub struct Formula {
    text: [String; 3],
    /// Boxed: an expression takes tens of kilobytes.
    components: Arc<[Component]>,
}

/// One parsed formula.
#[derive(Debug)]
struct Component {
    expression: Box<exmex::FlatEx<f64>>,
    /// Indices of the variables that the expression uses, in its own order.
    takes: Vec<usize>,
}

impl Formula {
    /// Parses three formulas in `variables` and the constants PI, E, TAU.
    ///
    /// # Errors
    /// Names the component and the error.
    pub fn parse(text: [String; 3], variables: &[&str]) -> Result<Formula, String> {
        let component = |axis: usize| -> Result<Component, String> {
            let formula = &text[axis];
            let wrong = |what: String| {
                let names = variables.join(", ");
                format!(
                    "the {} component \"{formula}\": {what}; a formula may use {names}, PI, + - * / ^ and functions such as sin, cos, exp, sqrt, tanh",
                    ["x", "y", "z"][axis]
                )
            };
            let bracketed =
                with_brackets(formula).ok_or_else(|| wrong("it cannot be read".into()))?;
            let expression =
                exmex::parse::<f64>(&bracketed).map_err(|error| wrong(error.msg().to_string()))?;
            let index = |name: &String| {
                let found = variables.iter().position(|known| known == name);
                found.ok_or_else(|| wrong(format!("unknown name \"{name}\"")))
            };
            let takes = expression.var_names().iter().map(index).collect::<Result<_, String>>()?;
            Ok(Component { expression: Box::new(expression), takes })
        };
        let components = (0..3).map(component).collect::<Result<_, String>>()?;
        Ok(Formula { text, components })
    }

    /// Text of the formulas.
    pub fn text(&self) -> &[String; 3] {
        &self.text
    }

    /// Value of one component at `values` of the variables; NaN where undefined.
    pub fn component(&self, axis: usize, values: &[f64]) -> f64 {
        let Component { expression, takes } = &self.components[axis];
        let mut taken = [0.0; 4];
        for (slot, &which) in taken.iter_mut().zip(takes) {
            *slot = values[which];
        }
        expression.eval(&taken[..takes.len()]).unwrap_or(f64::NAN)
    }

    /// Vector at `values` of the variables.
    pub fn at(&self, values: &[f64]) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.component(axis, values)))
    }
}

impl PartialEq for Formula {
    fn eq(&self, other: &Formula) -> bool {
        self.text == other.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: [&str; 3], variables: &[&str]) -> Result<Formula, String> {
        Formula::parse(text.map(str::to_owned), variables)
    }

    #[test]
    fn components_take_their_own_variables() {
        let formula = parse(["z - 2*x", "sin(PI*y)", "0.5"], &["x", "y", "z"]).unwrap();
        let v = formula.at(&[1.0, 0.5, 10.0]);
        assert!((v - DVec3::new(8.0, 1.0, 0.5)).length() < 1e-15, "{v}");
    }

    #[test]
    fn a_sign_binds_weaker_than_a_power() {
        let formula = parse(["-t^2", "exp(-t^2)", "2^3^2 - 1.5e2*t"], &["t"]).unwrap();
        let v = formula.at(&[0.5]);
        assert!((v - DVec3::new(-0.25, (-0.25_f64).exp(), 512.0 - 75.0)).length() < 1e-12, "{v}");
        assert!(parse(["t % 2", "0", "0"], &["t"]).unwrap_err().contains("cannot be read"));
    }

    #[test]
    fn mistakes_name_the_component_and_what_is_known() {
        let error = parse(["0", "0", "sin(w*t)"], &["t"]).unwrap_err();
        assert!(
            error.contains("z component") && error.contains("\"w\"") && error.contains("use t,"),
            "{error}"
        );
        let error = parse(["2*(t", "0", "0"], &["t"]).unwrap_err();
        assert!(error.contains("x component"), "{error}");
    }
}
