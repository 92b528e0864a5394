//! The grammar: a number, then a unit expression.

use super::Dimension;
use super::units::{self, Factor};
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Longest text that is tried.
const LONGEST: usize = 200;

/// Largest power of a unit.
const LARGEST_POWER: i8 = 9;

/// Deepest nesting of brackets in a unit.
const DEEPEST: usize = 8;

/// A number as typed: sign, digits · 10^exponent / divisor, with nothing rounded yet.
pub(super) struct Number {
    negative: bool,
    digits: String,
    exponent: i64,
    divisor: u128,
}

impl Number {
    pub const ONE: Self = Self { negative: false, digits: String::new(), exponent: 0, divisor: 1 };

    /// Its value times `factor`, rounded once where the factor is decimal.
    pub fn in_si(&self, factor: Factor, text: &str) -> Result<f64> {
        let digits = if self.digits.is_empty() { "1" } else { &self.digits };
        let mut factor = factor;
        match factor.denominator.checked_mul(self.divisor) {
            Some(denominator) => factor.denominator = denominator,
            None => factor.rest /= self.divisor as f64,
        }
        let whole = digits.parse::<u128>().ok();
        let product = whole.and_then(|d| d.checked_mul(factor.numerator));
        let decimal = |digits: &str, exponent: i32| {
            let exponent = self.exponent.saturating_add(exponent.into());
            format!("{digits}e{exponent}").parse::<f64>().unwrap_or(f64::NAN)
        };
        let value = match product {
            Some(0) => 0.0,
            Some(numerator) => {
                let mut f = Factor { numerator, ..factor }.reduced();
                // Long division: as many digits as fit, and a last one that says whether anything is left.
                while f.denominator > 1
                    && let Some(longer) = f.numerator.checked_mul(10)
                {
                    f.numerator = longer;
                    f.exponent = f.exponent.saturating_sub(1);
                }
                let (quotient, rest) = (f.numerator / f.denominator, f.numerator % f.denominator);
                match rest {
                    0 => decimal(&quotient.to_string(), f.exponent) * f.rest,
                    _ => decimal(&format!("{quotient}1"), f.exponent.saturating_sub(1)) * f.rest,
                }
            }
            None => {
                decimal(digits, factor.exponent) * factor.numerator as f64 / factor.denominator as f64 * factor.rest
            }
        };
        let value = value * PI.powi(factor.pi);
        if !value.is_finite() {
            return Err(Error::new(format!("{text:?} is too large for a computer's number")));
        }
        if value == 0.0 && digits.bytes().any(|b| b != b'0') {
            return Err(
                Error::new(format!("{text:?} is too small for a computer's number")).next("write 0 if that is meant")
            );
        }
        Ok(if self.negative { -value } else { value })
    }
}

/// A unit expression multiplied out.
pub(super) struct Product {
    pub factor: Factor,
    pub dimension: Dimension,
    pub hertz: i8,
}

/// Walks through the characters of a quantity.
pub(super) struct Cursor<'a> {
    text: &'a str,
    chars: Vec<char>,
    at: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(text: &'a str) -> Result<Self> {
        if text.len() > LONGEST {
            return Err(Error::new("this text is too long for a number with a unit").allowed("such as \"19.4 mm\""));
        }
        let text = text.trim();
        Ok(Self { text, chars: text.chars().collect(), at: 0 })
    }

    fn peek(&self) -> Option<char> {
        self.chars.get(self.at).copied()
    }

    fn next_is(&self, wanted: impl Fn(char) -> bool) -> bool {
        self.peek().is_some_and(wanted)
    }

    fn ahead(&self, n: usize) -> Option<char> {
        self.chars.get(self.at + n).copied()
    }

    fn skip_space(&mut self) {
        while self.next_is(char::is_whitespace) {
            self.at += 1;
        }
    }

    pub fn position(&self) -> usize {
        self.at
    }

    pub fn from(&self, begin: usize) -> String {
        self.chars.get(begin..).unwrap_or_default().iter().collect()
    }

    fn between(&self, begin: usize, end: usize) -> String {
        self.chars.get(begin..end).unwrap_or_default().iter().collect()
    }

    pub fn end(&mut self) -> Result<()> {
        self.skip_space();
        match self.peek() {
            None => Ok(()),
            Some(_) => Err(self.error(format!("cannot be read from `{}` on", self.from(self.at)))),
        }
    }

    fn error(&self, what: impl std::fmt::Display) -> Error {
        Error::new(format!("\"{}\" {what}", self.text))
    }

    // ── The number ──────────────────────────────────────────────────────────────────────────────────────────────────

    pub fn number(&mut self) -> Result<Number> {
        if self.chars.is_empty() {
            return Err(Error::new("an empty text is no number").next(super::SUCH_AS));
        }
        let negative = match self.peek() {
            Some('-' | '−') => true,
            Some('+') => false,
            _ => {
                self.at = 0;
                return self.unsigned(false);
            }
        };
        self.at += 1;
        self.skip_space();
        self.unsigned(negative)
    }

    fn unsigned(&mut self, negative: bool) -> Result<Number> {
        let begin = self.at;
        let Some((digits, mut exponent)) = self.decimal()? else {
            let word: String = self.from(self.at).chars().take_while(|c| c.is_alphabetic()).collect();
            return Err(match word.to_lowercase().as_str() {
                "nan" | "inf" | "infinity" => self.error("is not a finite number"),
                _ => self.error("does not begin with a number").next(super::SUCH_AS),
            });
        };
        let mut number = Number { negative, digits, exponent: 0, divisor: 1 };

        // 10^-6 as a number of its own, and ×10^-6 after one.
        if self.between(begin, self.at) == "10" && self.power_sign_follows() {
            let power = self.power()?.unwrap_or(1);
            number.digits = "1".into();
            exponent = power.into();
        } else if let Some(power) = self.times_ten()? {
            exponent = exponent.saturating_add(power);
        }
        number.exponent = exponent;

        // A fraction: 2/3.
        let before = self.at;
        self.skip_space();
        if self.peek() == Some('/') {
            self.at += 1;
            self.skip_space();
            if self.next_is(|c| c.is_ascii_digit() || c == '.')
                && let Some((below, below_exponent)) = self.decimal()?
            {
                number.divisor = below.parse().map_err(|_| self.error("has too many digits below the line"))?;
                if number.divisor == 0 {
                    return Err(self.error("divides by zero"));
                }
                number.exponent = number.exponent.saturating_sub(below_exponent);
            } else {
                self.at = before;
            }
        } else {
            self.at = before;
        }
        self.check_what_follows()?;
        Ok(number)
    }

    /// Digits with a point and an exponent, as (digits, power of ten); nothing if there is no digit.
    fn decimal(&mut self) -> Result<Option<(String, i64)>> {
        let mut digits = String::new();
        let mut exponent = 0_i64;
        let mut seen_digit = false;
        let mut seen_point = false;
        while let Some(c) = self.peek() {
            match c {
                '0'..='9' => {
                    seen_digit = true;
                    if !(digits.is_empty() && c == '0') {
                        digits.push(c);
                    }
                    exponent -= i64::from(seen_point);
                }
                '_' if seen_digit && self.ahead(1).is_some_and(|c| c.is_ascii_digit()) => {}
                '.' if !seen_point && (seen_digit || self.ahead(1).is_some_and(|c| c.is_ascii_digit())) => {
                    seen_point = true;
                }
                _ => break,
            }
            self.at += 1;
        }
        if !seen_digit {
            return Ok(None);
        }
        if digits.is_empty() {
            digits.push('0');
        }
        let sign = usize::from(matches!(self.ahead(1), Some('+' | '-' | '−')));
        if self.next_is(|c| c == 'e' || c == 'E') && self.ahead(1 + sign).is_some_and(|c| c.is_ascii_digit()) {
            let negative = matches!(self.ahead(1), Some('-' | '−'));
            self.at += 1 + sign;
            let mut power = 0_i64;
            while let Some(digit) = self.peek().and_then(|c| c.to_digit(10)) {
                power = power.saturating_mul(10).saturating_add(digit.into());
                self.at += 1;
            }
            exponent = exponent.saturating_add(if negative { -power } else { power });
        }
        Ok(Some((digits, exponent)))
    }

    /// `×10^n` after a number.
    fn times_ten(&mut self) -> Result<Option<i64>> {
        let before = self.at;
        self.skip_space();
        if self.next_is(|c| matches!(c, '×' | 'x' | 'X' | '*' | '·' | '⋅')) {
            self.at += 1;
            self.skip_space();
            if self.peek() == Some('1') && self.ahead(1) == Some('0') {
                self.at += 2;
                if self.power_sign_follows() {
                    return Ok(self.power()?.map(i64::from));
                }
            }
        }
        self.at = before;
        Ok(None)
    }

    /// Errors for what looks like a number but goes on strangely.
    fn check_what_follows(&mut self) -> Result<()> {
        let digit_at = |cursor: &Self, n: usize| cursor.ahead(n).is_some_and(|c| c.is_ascii_digit());
        match self.peek() {
            Some(',') if digit_at(self, 1) => {
                let typed: String = self.chars.iter().collect();
                let commas = typed.matches(',').count();
                Err(self.error("has a comma in its number").next(match commas == 1 && !typed.contains('.') {
                    true => format!("the decimal sign is a point: \"{}\"", typed.replace(',', ".")),
                    false => format!("write it without commas: \"{}\"", typed.replace(',', "")),
                }))
            }
            Some('.') => Err(self.error("has a second point in its number")),
            _ => {
                let before = self.at;
                self.skip_space();
                let spaced =
                    self.at > before && digit_at(self, 0) && !(digit_at(self, 0) && self.ahead(1) == Some('/'));
                self.at = before;
                match spaced {
                    true => Err(self.error("has a space inside its number").next("write the digits together")),
                    false => Ok(()),
                }
            }
        }
    }

    // ── The unit ────────────────────────────────────────────────────────────────────────────────────────────────────

    /// Factors up to the end or a closing bracket.
    pub fn product(&mut self, depth: usize, in_brackets: bool) -> Result<Product> {
        if depth > DEEPEST {
            return Err(self.error("has too many brackets"));
        }
        let start = self.at;
        let mut product = Product { factor: Factor::ONE, dimension: Dimension::NONE, hertz: 0 };
        let mut slash: Option<(usize, usize)> = None; // where the last `/` stands, and where its factor ends
        let mut any = false;
        loop {
            self.skip_space();
            let mark = self.at;
            let mut divide = false;
            match self.peek() {
                None => break,
                Some(')') if in_brackets => break,
                Some('/') => {
                    divide = true;
                    self.at += 1;
                }
                Some('*' | '·' | '⋅' | '×' | '•' | '.' | '-' | '‑' | '−') if any => self.at += 1,
                Some(')') => return Err(self.error("has a `)` without its `(`")),
                Some(_) => {}
            }
            if !divide && let Some((slash, end)) = slash {
                let (above, below) = (self.between(start, slash), self.between(slash + 1, end));
                let rest = self.between(self.at, self.chars.len());
                let (above, below, rest) = (above.trim(), below.trim(), rest.trim().trim_end_matches(')'));
                let above = if above.is_empty() { "1" } else { above };
                return Err(self
                    .error("can be read in two ways")
                    .next(format!("write {above}/({below} {rest}) or {above} {rest}/{below}")));
            }
            self.skip_space();
            if self.peek().is_none() {
                return Err(self.error(format!("ends with a `{}`", self.between(mark, mark + 1))));
            }
            let factor = self.factor(depth)?;
            if divide {
                slash = Some((mark, self.at));
            }
            any = true;
            let n = if divide { -1 } else { 1 };
            self.multiply(&mut product, &factor, n)?;
        }
        Ok(product)
    }

    fn multiply(&self, product: &mut Product, factor: &Product, n: i8) -> Result<()> {
        let dimension = product.dimension.times(factor.dimension, n);
        let hertz = factor.hertz.checked_mul(n).and_then(|h| product.hertz.checked_add(h));
        let (Some(dimension), Some(hertz)) = (dimension, hertz) else {
            return Err(self.error("has a unit of absurdly high power"));
        };
        *product = Product { factor: product.factor.times(factor.factor, n), dimension, hertz };
        Ok(())
    }

    /// One unit or bracket with its power.
    fn factor(&mut self, depth: usize) -> Result<Product> {
        let base = match self.peek() {
            Some('(') => {
                self.at += 1;
                let inner = self.product(depth + 1, true)?;
                if self.peek() != Some(')') {
                    return Err(self.error("has a `(` without its `)`"));
                }
                self.at += 1;
                inner
            }
            Some('1') if !self.ahead(1).is_some_and(|c| c.is_ascii_digit() || c == '.') => {
                self.at += 1;
                Product { factor: Factor::ONE, dimension: Dimension::NONE, hertz: 0 }
            }
            _ => self.named()?,
        };
        let Some(power) = self.power()? else { return Ok(base) };
        let mut product = Product { factor: Factor::ONE, dimension: Dimension::NONE, hertz: 0 };
        self.multiply(&mut product, &base, power)?;
        Ok(product)
    }

    fn named(&mut self) -> Result<Product> {
        let begin = self.at;
        let symbol = |c: char| matches!(c, '°' | '%' | '"' | '″');
        if self.next_is(symbol) {
            self.at += 1;
        } else {
            while self.next_is(|c| (c.is_alphabetic() && !is_superscript(c)) || c == 'µ') {
                self.at += 1;
            }
            // m° is a prefix and a symbol.
            if self.at > begin && self.next_is(|c| c == '°') {
                self.at += 1;
            }
        }
        let name = self.between(begin, self.at);
        if name.is_empty() {
            let rest = self.from(self.at);
            let next = match self.peek() {
                Some('1') if rest.starts_with("1000") => {
                    "numbers stand before the unit; a thousand is the prefix k: V/1000rpm is V/krpm"
                }
                Some(c) if c.is_ascii_digit() => "numbers stand before the unit; powers are written m^2",
                _ => "units are letters with powers, such as N m s/rad or kg m^2",
            };
            return Err(self.error(format!("has `{rest}` where a unit should be")).next(next));
        }
        match units::find(&name) {
            Some((unit, power)) => {
                let mut factor = unit.factor;
                factor.exponent += power;
                let hertz = i8::from(unit.names.contains(&"Hz"));
                Ok(Product { factor, dimension: unit.dimension, hertz })
            }
            None => {
                let error = self.error(format!("has an unknown unit `{name}`"));
                Err(match units::suggest(&name) {
                    Some(near) => error.next(format!("did you mean {near}?")),
                    None => error.next("units are such as mm, kg, N s/m, kg m^2, ohm, GPa, rpm, in, lbf"),
                })
            }
        }
    }

    fn power_sign_follows(&self) -> bool {
        match self.peek() {
            Some('^') => true,
            Some('*') => self.ahead(1) == Some('*'),
            Some(c) => is_superscript(c),
            None => false,
        }
    }

    /// `^2`, `**2`, `^(-2)`, `²`, `⁻²`, or digits that follow at once.
    fn power(&mut self) -> Result<Option<i8>> {
        let before = self.at;
        self.skip_space();
        if !(self.peek() == Some('^') || self.peek() == Some('*') && self.ahead(1) == Some('*')) {
            self.at = before;
        }
        let mut digits = String::new();
        match self.peek() {
            Some(c) if is_superscript(c) => {
                while let Some(plain) = self.peek().and_then(superscript) {
                    digits.push(plain);
                    self.at += 1;
                }
            }
            Some('^' | '*') if self.power_sign_follows() => {
                self.at += if self.peek() == Some('*') { 2 } else { 1 };
                self.skip_space();
                let bracket = self.peek() == Some('(');
                self.at += usize::from(bracket);
                self.signed_digits(&mut digits);
                if bracket {
                    if self.peek() != Some(')') {
                        return Err(self.error("has a power that is not a whole number"));
                    }
                    self.at += 1;
                }
                if digits.is_empty() || self.next_is(|c| c == '.') && self.ahead(1).is_some_and(|c| c.is_ascii_digit())
                {
                    return Err(self.error("has a power that is not a whole number"));
                }
            }
            Some(c)
                if c.is_ascii_digit()
                    || (matches!(c, '-' | '−') && self.ahead(1).is_some_and(|c| c.is_ascii_digit())) =>
            {
                self.signed_digits(&mut digits);
            }
            _ => return Ok(None),
        }
        // Powers of units stay small; powers of ten may go as far as numbers do.
        let power = digits.parse::<i16>().ok();
        match power.and_then(|p| i8::try_from(p).ok()) {
            Some(power) if power.abs() <= LARGEST_POWER || self.is_power_of_ten(before) => Ok(Some(power)),
            _ => Err(self.error(format!("has a power `{digits}` that cannot be meant"))),
        }
    }

    fn is_power_of_ten(&self, at: usize) -> bool {
        at >= 2 && self.between(at - 2, at) == "10"
    }

    fn signed_digits(&mut self, digits: &mut String) {
        match self.peek() {
            Some('-' | '−') => {
                digits.push('-');
                self.at += 1;
            }
            Some('+') => self.at += 1,
            _ => {}
        }
        while let Some(c) = self.peek().filter(char::is_ascii_digit) {
            digits.push(c);
            self.at += 1;
        }
    }
}

fn is_superscript(c: char) -> bool {
    superscript(c).is_some()
}

/// The plain character of a superscript one.
fn superscript(c: char) -> Option<char> {
    const RAISED: [char; 12] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹', '⁻', '⁺'];
    const PLAIN: [char; 12] = ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', '-', '+'];
    RAISED.iter().position(|&r| r == c).map(|i| PLAIN[i])
}
