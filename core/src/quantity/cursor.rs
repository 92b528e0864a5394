//! Cursor over the characters of a quantity.

use crate::error::{Error, Result};

/// Longest text that is parsed.
const LONGEST: usize = 200;

/// Cursor over the characters of a quantity.
pub(super) struct Cursor<'a> {
    pub text: &'a str,
    pub chars: Vec<char>,
    pub at: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(text: &'a str) -> Result<Self> {
        if text.len() > LONGEST {
            return Err(Error::new("this text is too long for a number with a unit").allowed("such as \"19.4 mm\""));
        }
        let text = text.trim();
        Ok(Self { text, chars: text.chars().collect(), at: 0 })
    }

    pub fn peek(&self) -> Option<char> {
        self.chars.get(self.at).copied()
    }

    pub fn next_is(&self, wanted: impl Fn(char) -> bool) -> bool {
        self.peek().is_some_and(wanted)
    }

    pub fn ahead(&self, n: usize) -> Option<char> {
        self.chars.get(self.at + n).copied()
    }

    pub fn skip_space(&mut self) {
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

    pub fn between(&self, begin: usize, end: usize) -> String {
        self.chars.get(begin..end).unwrap_or_default().iter().collect()
    }

    pub fn end(&mut self) -> Result<()> {
        self.skip_space();
        match self.peek() {
            None => Ok(()),
            Some(_) => Err(self.error(format!("cannot be read from `{}` on", self.from(self.at)))),
        }
    }

    pub fn error(&self, what: impl std::fmt::Display) -> Error {
        Error::new(format!("\"{}\" {what}", self.text))
    }

    pub fn signed_digits(&mut self, digits: &mut String) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_of_200_bytes_is_read_and_a_longer_one_is_not() {
        assert_eq!(Cursor::new(&format!("{:>200}", "3 mm")).unwrap().chars, ['3', ' ', 'm', 'm']);
        assert!(Cursor::new(&format!("{:>201}", "3 mm")).is_err());
    }
}
