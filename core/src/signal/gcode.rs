//! Lists of moves in the manner of G-code: `G0 X10`, `G1 X50 F3000`, `G4 P200`.
//!
//! Of G-code it takes what an axis of its own can do: G0 (as fast as allowed), G1 (with a feed), G4 (a wait, P in ms or
//! S in s), G20 and G21 (inches, millimetres), G90 and G91 (absolute, relative). X is in millimetres and F in mm/min
//! unless G20 says inches. Comments stand after `;` or in brackets. Every block stops exactly (G61): a corner at speed
//! is no motion of a single axis.

use super::profile::{Leg, Limits};
use crate::error::{Error, Result};

/// The legs of a list of moves from `start` (m); `limits` are those of the machine, F lowers the speed.
///
/// ```
/// use taut::signal::gcode::legs;
/// use taut::signal::profile::{Leg, Limits};
/// let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
/// let list = legs("G1 X50 F3000 ; out at 50 mm/s\nG4 P200\nG0 X0", 0.0, &limits)?;
/// assert_eq!(list[0], Leg::To(0.05, Limits { speed: 0.05, ..limits }));
/// assert_eq!(list[1..], [Leg::Wait(0.2), Leg::To(0.0, limits)]);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn legs(text: &str, start: f64, limits: &Limits) -> Result<Vec<Leg>> {
    let mut state = State { unit: 1e-3, relative: false, rapid: true, feed: None, position: start };
    let mut legs = Vec::new();
    for (number, line) in text.lines().enumerate() {
        block(line, &mut state, limits, &mut legs)
            .map_err(|error| Error { what: format!("line {} of the moves: {}", number + 1, error.what), ..error })?;
    }
    if legs.is_empty() {
        return Err(Error::new("the list of moves is empty").next("write for example G1 X50 F3000"));
    }
    Ok(legs)
}

struct State {
    /// Metres per unit of length.
    unit: f64,
    relative: bool,
    rapid: bool,
    /// m/s.
    feed: Option<f64>,
    position: f64,
}

const KNOWN: &str = "G0, G1, G4, G20, G21, G90 and G91, with X, F, P and S";

fn block(line: &str, state: &mut State, limits: &Limits, legs: &mut Vec<Leg>) -> Result<()> {
    let (mut x, mut wait) = (None, None);
    let mut dwell = false;
    for (letter, value) in words(line)? {
        match (letter, value) {
            ('G', 0.0) => state.rapid = true,
            ('G', 1.0) => state.rapid = false,
            ('G', 4.0) => dwell = true,
            ('G', 20.0) => state.unit = 25.4e-3,
            ('G', 21.0) => state.unit = 1e-3,
            ('G', 90.0) => state.relative = false,
            ('G', 91.0) => state.relative = true,
            ('X', value) => x = Some(value),
            ('F', value) if value > 0.0 => state.feed = Some(value * state.unit / 60.0),
            ('F', value) => {
                return Err(Error::new(format!("a feed of {value}")).allowed("above zero, in mm/min"));
            }
            ('P', value) if value >= 0.0 => wait = Some(value * 1e-3),
            ('S', value) if value >= 0.0 => wait = Some(value),
            ('N', _) => {}
            (letter, value) => {
                return Err(Error::new(format!("`{letter}{value}` is not known")).allowed(KNOWN));
            }
        }
    }
    if dwell {
        let Some(wait) = wait else {
            return Err(Error::new("G4 does not say how long").next("write G4 P200 for 200 ms, or G4 S0.2"));
        };
        legs.push(Leg::Wait(wait));
    } else if wait.is_some() {
        return Err(Error::new("P and S belong to G4").allowed(KNOWN));
    }
    if let Some(x) = x {
        let target = if state.relative { state.position + x * state.unit } else { x * state.unit };
        let speed = match (state.rapid, state.feed) {
            (true, _) => limits.speed,
            (false, Some(feed)) => feed.min(limits.speed),
            (false, None) => {
                return Err(Error::new("G1 before any feed").next("add F, in mm/min, such as G1 X50 F3000"));
            }
        };
        legs.push(Leg::To(target, Limits { speed, ..*limits }));
        state.position = target;
    }
    Ok(())
}

/// The words of a line without its comments.
fn words(line: &str) -> Result<Vec<(char, f64)>> {
    let mut plain = String::new();
    let mut inside = false;
    for c in line.chars() {
        match c {
            ';' if !inside => break,
            '(' => inside = true,
            ')' => inside = false,
            c if !inside && !c.is_whitespace() => plain.push(c.to_ascii_uppercase()),
            _ => {}
        }
    }
    let mut words = Vec::new();
    let mut rest = plain.as_str();
    while let Some(letter) = rest.chars().next() {
        let after = &rest[letter.len_utf8()..];
        let end = after.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | '+'))).unwrap_or(after.len());
        let value = after[..end].parse::<f64>().ok().filter(|value| value.is_finite());
        let Some(value) = value.filter(|_| letter.is_ascii_alphabetic()) else {
            return Err(Error::new(format!("`{letter}{}` is no word of G-code", &after[..end])).allowed(KNOWN));
        };
        words.push((letter, value));
        rest = &after[end..];
    }
    Ok(words)
}
