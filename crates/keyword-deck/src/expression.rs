//! Arithmetic as in *PARAMETER_EXPRESSION and `<…>`: Fortran's rules, so whole numbers divide to whole numbers.

use crate::parameter::Value;

/// Parentheses, signs and functions inside each other. No deck comes near; a hostile one must not end the process.
const DEPTH_MAX: usize = 64;

/// Evaluates an expression; `look_up` knows the parameters (upper-case names, without `&`).
///
/// # Errors
/// What is wrong, in words.
pub(crate) fn evaluate(text: &str, look_up: &dyn Fn(&str) -> Option<Value>) -> Result<Value, String> {
    let mut parser = Parser { rest: text.as_bytes(), look_up, depth: 0 };
    let value = parser.sum()?;
    parser.blanks();
    match parser.rest {
        [] => Ok(value),
        [next, ..] => Err(format!("'{}' is not expected there", char::from(*next))),
    }
}

struct Parser<'a> {
    rest: &'a [u8],
    look_up: &'a dyn Fn(&str) -> Option<Value>,
    depth: usize,
}

impl Parser<'_> {
    fn blanks(&mut self) {
        self.rest = self.rest.trim_ascii_start();
    }

    fn take(&mut self, word: &[u8]) -> bool {
        self.blanks();
        let Some(rest) = self.rest.strip_prefix(word) else { return false };
        self.rest = rest;
        true
    }

    fn sum(&mut self) -> Result<Value, String> {
        let mut left = self.product()?;
        loop {
            if self.take(b"+") {
                left = arithmetic(left, self.product()?, i64::checked_add, |a, b| a + b)?;
            } else if self.take(b"-") {
                left = arithmetic(left, self.product()?, i64::checked_sub, |a, b| a - b)?;
            } else {
                return Ok(left);
            }
        }
    }

    fn product(&mut self) -> Result<Value, String> {
        let mut left = self.power()?;
        loop {
            self.blanks();
            if self.rest.starts_with(b"**") {
                return Ok(left);
            }
            if self.take(b"*") {
                left = arithmetic(left, self.power()?, i64::checked_mul, |a, b| a * b)?;
            } else if self.take(b"/") {
                left = arithmetic(left, self.power()?, i64::checked_div, |a, b| a / b)?;
            } else {
                return Ok(left);
            }
        }
    }

    /// A sign binds looser than a power: −2**2 = −4.
    fn power(&mut self) -> Result<Value, String> {
        self.deeper()?;
        let value = if self.take(b"-") {
            arithmetic(Value::Integer(0), self.power()?, i64::checked_sub, |a, b| a - b)?
        } else if self.take(b"+") {
            self.power()?
        } else {
            let base = self.factor()?;
            if self.take(b"**") || self.take(b"^") { raise(base, self.power()?)? } else { base }
        };
        self.depth -= 1;
        Ok(value)
    }

    fn deeper(&mut self) -> Result<(), String> {
        self.depth += 1;
        if self.depth > DEPTH_MAX { Err(format!("more than {DEPTH_MAX} levels deep")) } else { Ok(()) }
    }

    fn factor(&mut self) -> Result<Value, String> {
        if self.take(b"(") {
            let value = self.sum()?;
            return if self.take(b")") { Ok(value) } else { Err("a ')' is missing".into()) };
        }
        self.take(b"&");
        let letters = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
        match self.rest {
            [first, ..] if first.is_ascii_alphabetic() || *first == b'_' => {
                let length = self.rest.iter().take_while(|byte| letters(byte)).count();
                let (name, rest) = self.rest.split_at(length);
                self.rest = rest;
                let name = String::from_utf8_lossy(name).to_ascii_uppercase();
                if self.take(b"(") { self.call(&name) } else { self.named(&name) }
            }
            [first, ..] if first.is_ascii_digit() || *first == b'.' => self.number(),
            [] => Err("it ends too early".into()),
            [next, ..] => Err(format!("'{}' is not expected there", char::from(*next))),
        }
    }

    fn named(&self, name: &str) -> Result<Value, String> {
        match (self.look_up)(name) {
            Some(Value::Text(_)) => Err(format!("'{name}' is a text, not a number")),
            Some(value) => Ok(value),
            None if name == "PI" => Ok(Value::Real(std::f64::consts::PI)),
            None => Err(format!("the parameter '{name}' has no definition before this line")),
        }
    }

    fn number(&mut self) -> Result<Value, String> {
        let digits = |bytes: &[u8]| bytes.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let mut length = digits(self.rest);
        let mut whole = true;
        if self.rest.get(length) == Some(&b'.') {
            whole = false;
            length += 1;
            length += digits(&self.rest[length..]);
        }
        if matches!(self.rest.get(length), Some(b'e' | b'E' | b'd' | b'D')) {
            let sign = usize::from(matches!(self.rest.get(length + 1), Some(b'+' | b'-')));
            let exponent = digits(self.rest.get(length + 1 + sign..).unwrap_or_default());
            if exponent > 0 {
                whole = false;
                length += 1 + sign + exponent;
            }
        }
        let (text, rest) = self.rest.split_at(length);
        self.rest = rest;
        let value = if whole {
            crate::number::integer(text).map(Value::Integer)
        } else {
            crate::number::real(text).map(Value::Real)
        };
        value.ok_or_else(|| format!("'{}' is not a number", String::from_utf8_lossy(text)))
    }

    fn call(&mut self, name: &str) -> Result<Value, String> {
        let mut arguments = Vec::new();
        if !self.take(b")") {
            loop {
                arguments.push(self.sum()?);
                if self.take(b")") {
                    break;
                }
                if !self.take(b",") {
                    return Err(format!("a ')' is missing after {name}("));
                }
            }
        }
        function(name, &arguments)
    }
}

fn real(value: &Value) -> f64 {
    match value {
        Value::Integer(value) => *value as f64,
        Value::Real(value) => *value,
        Value::Text(_) => f64::NAN, // never reached: `named` refuses texts
    }
}

fn finite(value: f64) -> Result<Value, String> {
    if value.is_finite() { Ok(Value::Real(value)) } else { Err("the result is not a number".into()) }
}

fn arithmetic(
    a: Value,
    b: Value,
    whole: fn(i64, i64) -> Option<i64>,
    broken: fn(f64, f64) -> f64,
) -> Result<Value, String> {
    match (&a, &b) {
        (Value::Integer(a), Value::Integer(b)) => {
            whole(*a, *b).map(Value::Integer).ok_or_else(|| "a division by zero or an overflow".into())
        }
        _ => finite(broken(real(&a), real(&b))),
    }
}

fn raise(base: Value, exponent: Value) -> Result<Value, String> {
    match (&base, &exponent) {
        (Value::Integer(base), Value::Integer(exponent)) if *exponent >= 0 => u32::try_from(*exponent)
            .ok()
            .and_then(|exponent| base.checked_pow(exponent))
            .map(Value::Integer)
            .ok_or_else(|| "an overflow".into()),
        _ => finite(real(&base).powf(real(&exponent))),
    }
}

fn function(name: &str, arguments: &[Value]) -> Result<Value, String> {
    let numbers: Vec<f64> = arguments.iter().map(real).collect();
    let round = |value: f64| {
        if value.abs() < 9e15 { Ok(Value::Integer(value as i64)) } else { Err("an overflow".to_owned()) }
    };
    let extreme =
        |largest: bool| {
            let better = |a: f64, b: f64| if largest { a > b } else { a < b };
            arguments.iter().fold(arguments[0].clone(), |best, next| {
                if better(real(next), real(&best)) { next.clone() } else { best }
            })
        };
    match (name, &numbers[..]) {
        ("ABS", [_]) => match arguments[0] {
            Value::Integer(value) => value.checked_abs().map(Value::Integer).ok_or_else(|| "an overflow".into()),
            _ => finite(numbers[0].abs()),
        },
        ("SQRT", [x]) => finite(x.sqrt()),
        ("EXP", [x]) => finite(x.exp()),
        ("LOG" | "LN", [x]) => finite(x.ln()),
        ("LOG10", [x]) => finite(x.log10()),
        ("SIN", [x]) => finite(x.sin()),
        ("COS", [x]) => finite(x.cos()),
        ("TAN", [x]) => finite(x.tan()),
        ("ASIN", [x]) => finite(x.asin()),
        ("ACOS", [x]) => finite(x.acos()),
        ("ATAN", [x]) => finite(x.atan()),
        ("ATAN2", [y, x]) => finite(y.atan2(*x)),
        ("SINH", [x]) => finite(x.sinh()),
        ("COSH", [x]) => finite(x.cosh()),
        ("TANH", [x]) => finite(x.tanh()),
        ("INT", [x]) => round(x.trunc()),
        ("NINT", [x]) => round(x.round()),
        ("AINT", [x]) => finite(x.trunc()),
        ("ANINT", [x]) => finite(x.round()),
        ("FLOOR", [x]) => round(x.floor()),
        ("CEIL" | "CEILING", [x]) => round(x.ceil()),
        ("FLOAT" | "REAL" | "DBLE", [x]) => finite(*x),
        ("MOD", [a, b]) => match (&arguments[0], &arguments[1]) {
            (Value::Integer(a), Value::Integer(b)) => {
                a.checked_rem(*b).map(Value::Integer).ok_or_else(|| "a division by zero".into())
            }
            _ => finite(a % b),
        },
        ("SIGN", [a, b]) => finite(if *b < 0.0 { -a.abs() } else { a.abs() }),
        ("MIN", [_, ..]) => Ok(extreme(false)),
        ("MAX", [_, ..]) => Ok(extreme(true)),
        ("PI", []) => Ok(Value::Real(std::f64::consts::PI)),
        _ => Err(format!("{name} with {} arguments is not known", numbers.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<Value, String> {
        evaluate(text, &|name| (name == "T").then_some(Value::Real(2.5)))
    }

    #[test]
    fn arithmetic_by_fortrans_rules() {
        for (text, expected) in [
            ("1+2*3", Value::Integer(7)),
            ("7/2", Value::Integer(3)),
            ("7/2.", Value::Real(3.5)),
            ("-2**2", Value::Integer(-4)),
            ("2**3**2", Value::Integer(512)),
            ("2**-1", Value::Real(0.5)),
            ("(1+2)*&t", Value::Real(7.5)),
            ("t - 1.5e0", Value::Real(1.0)),
            ("max(1, 3, 2)+min(4,5)", Value::Integer(7)),
            ("sqrt(16)*abs(-2)", Value::Real(8.0)),
            ("mod(7,3)", Value::Integer(1)),
            ("nint(2.6)", Value::Integer(3)),
            ("cos(0)", Value::Real(1.0)),
            ("2--3", Value::Integer(5)),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn what_cannot_be_evaluated_says_why() {
        let deep = "(".repeat(100_000);
        for text in ["", "1+", "1/0", "u+1", "(1", "1)", "foo(1)", "sqrt(-1)", "9**99", "1e400", &deep, "1.2.3", "sin"]
        {
            assert!(value(text).is_err(), "{text}");
        }
        assert_eq!(value("u").unwrap_err(), "the parameter 'U' has no definition before this line");
    }
}
