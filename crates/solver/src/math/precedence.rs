//! Precedence of signs and powers in formulas. `exmex`, which evaluates the formulas, reads -x^2 as
//! (-x)^2 and 2^3^2 as (2^3)^2. This module adds brackets for the usual meaning, -(x^2) and
//! 2^(3^2), and writes numbers without an exponent, because `exmex` does not read 1e-3.

use std::iter::Peekable;
use std::str::Chars;

/// Returns the formula with brackets around signs and powers; none if it cannot be read.
pub fn with_brackets(formula: &str) -> Option<String> {
    let mut reader = Reader { rest: formula.chars().peekable() };
    let out = reader.sum()?;
    reader.next_symbol().is_none().then_some(out)
}

struct Reader<'a> {
    rest: Peekable<Chars<'a>>,
}

impl Reader<'_> {
    /// Next character that is not a blank; it stays to be read.
    fn next_symbol(&mut self) -> Option<char> {
        while self.rest.next_if(|c| c.is_whitespace()).is_some() {}
        self.rest.peek().copied()
    }

    /// Takes the next symbol if it is `wanted`.
    fn take(&mut self, wanted: char) -> Option<char> {
        self.next_symbol().filter(|c| *c == wanted)?;
        self.rest.next()
    }

    /// Takes characters as long as they are `wanted`.
    fn take_while(&mut self, wanted: impl Fn(char) -> bool) -> String {
        std::iter::from_fn(|| self.rest.next_if(|c| wanted(*c))).collect()
    }

    /// Operands joined by + - * /.
    fn sum(&mut self) -> Option<String> {
        let mut out = self.signed()?;
        while let Some(operator) = self.next_symbol().filter(|c| "+-*/".contains(*c)) {
            self.rest.next();
            out.push(operator);
            out += &self.signed()?;
        }
        Some(out)
    }

    /// Power with any number of signs before it.
    fn signed(&mut self) -> Option<String> {
        let mut negative = false;
        while let Some(sign) = self.take('-').or_else(|| self.take('+')) {
            negative ^= sign == '-';
        }
        let power = self.power()?;
        Some(if negative { format!("(-({power}))") } else { power })
    }

    /// Operand with an exponent, if it has one.
    fn power(&mut self) -> Option<String> {
        let base = self.primary()?;
        match self.take('^') {
            Some(_) => Some(format!("({base}^{})", self.signed()?)),
            None => Some(base),
        }
    }

    /// Number, name, call of a function, or formula in brackets.
    fn primary(&mut self) -> Option<String> {
        let first = self.next_symbol()?;
        if first.is_ascii_digit() || first == '.' {
            return self.number();
        }
        let mut out = self.take_while(|c| c.is_alphanumeric() || c == '_');
        if self.take('(').is_some() {
            out.push('(');
            out += &self.sum()?;
            while self.take(',').is_some() {
                out = format!("{out},{}", self.sum()?);
            }
            self.take(')')?;
            out.push(')');
        }
        (!out.is_empty()).then_some(out)
    }

    /// Number without its exponent: 1.5e-3 is 0.0015.
    fn number(&mut self) -> Option<String> {
        let mut text = self.take_while(|c| c.is_ascii_digit() || c == '.');
        if self.rest.next_if(|c| matches!(c, 'e' | 'E')).is_some() {
            text.push('e');
            text.extend(self.rest.next_if(|c| matches!(c, '+' | '-')));
            text += &self.take_while(|c| c.is_ascii_digit());
        }
        let value: f64 = text.parse().ok()?;
        value.is_finite().then(|| value.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::with_brackets;

    #[test]
    fn signs_bind_weaker_than_powers_and_powers_group_to_the_right() {
        for (formula, expected) in [
            ("-t^2", "(-((t^2)))"),
            ("2 * -t^2", "2*(-((t^2)))"),
            ("1/-x^2", "1/(-((x^2)))"),
            ("2^3^2", "(2^(3^2))"),
            ("2^-3", "(2^(-(3)))"),
            ("--t", "t"),
            ("exp(-((z - 0.004)/1e-3)^2)", "exp((-((((z-0.004)/0.001)^2))))"),
            ("atan2(y, -x)", "atan2(y,(-(x)))"),
            ("1.5e3*t - 2E-2", "1500*t-0.02"),
            ("E*t", "E*t"),
            ("2*PI*x/0.01", "2*PI*x/0.01"),
        ] {
            assert_eq!(with_brackets(formula).as_deref(), Some(expected), "{formula}");
        }
        for wrong in ["", "2x", "sin x", "(t", "t)", "t^", "1e", "1e999", "t % 2", "a b"] {
            assert_eq!(with_brackets(wrong), None, "{wrong}");
        }
    }
}
