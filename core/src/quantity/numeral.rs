//! Numbers as typed, rounded only once at the end.

use super::cursor::Cursor;
use super::units::Factor;
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// A number as typed: sign, digits · 10^exponent / divisor, with nothing rounded yet.
pub(super) struct Number {
    negative: bool,
    digits: String,
    exponent: i64,
    divisor: u128,
}

impl Number {
    pub const ONE: Self = Self { negative: false, digits: String::new(), exponent: 0, divisor: 1 };

    /// Its value times `factor`, rounded once if the factor is decimal.
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
                // Long division: as many digits as fit, and a last one for a non-zero remainder.
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

impl Cursor<'_> {
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

    /// Digits with a point and an exponent, as (digits, power of ten); none without digits.
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

    /// Errors for text after a number that is neither a unit nor an operator.
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
}
