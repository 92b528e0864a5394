//! Unit expressions: products, quotients and powers of units.

use super::Dimension;
use super::cursor::Cursor;
use super::units::{self, Factor};
use crate::error::Result;

/// Largest power of a unit.
const LARGEST_POWER: i8 = 9;

/// Deepest nesting of brackets in a unit.
const DEEPEST: usize = 8;

/// A unit expression multiplied out.
pub(super) struct Product {
    pub factor: Factor,
    pub dimension: Dimension,
    pub hertz: i8,
}

impl Cursor<'_> {
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

    pub fn power_sign_follows(&self) -> bool {
        match self.peek() {
            Some('^') => true,
            Some('*') => self.ahead(1) == Some('*'),
            Some(c) => is_superscript(c),
            None => false,
        }
    }

    /// `^2`, `**2`, `^(-2)`, `²`, `⁻²`, or digits that follow at once.
    pub fn power(&mut self) -> Result<Option<i8>> {
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
