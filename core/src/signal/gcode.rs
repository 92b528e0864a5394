//! Lists of moves in the manner of G-code: `G0 X10`, `G1 X50 F3000`, `G4 P200`; of a machine with two coordinates
//! `G1 X50 Y20 F3000`.
//!
//! Of G-code it takes what an axis of its own can do: G0 (as fast as allowed), G1 (with a feed), G4 (a wait, P in ms or
//! S in s), G20 and G21 (inches, millimetres), G90 and G91 (absolute, relative). X and Y are in millimetres and F in
//! mm/min unless G20 says inches; F is the speed along the path. Comments stand after `;` or in brackets. Every block
//! stops exactly (G61): no corner is passed at speed.
//!
//! The list of a machine in a plane may be that of a printer: its words E and Z, its M and T codes, and G28, G92 of other
//! letters move neither coordinate and are passed over.

use super::profile::{Leg, Limits};
use crate::error::{Error, Result};

/// The legs of a list of moves from `start` (m); `limits` are those of the machine, F lowers the speed.
///
/// ```
/// use taut::signal::gcode::legs;
/// use taut::signal::profile::{Leg, Limits};
/// let limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };
/// let list = legs("G1 X50 F3000 ; out at 50 mm/s\nG4 P200\nG0 X0", &[0.0], &limits)?;
/// assert_eq!(list[0], Leg::To(vec![0.05], Limits { speed: 0.05, ..limits }));
/// assert_eq!(list[1..], [Leg::Wait(0.2), Leg::To(vec![0.0], limits)]);
///
/// let plane = legs("G0 X10\nG1 Y20 F3000", &[0.0, 0.0], &limits)?;
/// assert_eq!(plane[1], Leg::To(vec![0.01, 0.02], Limits { speed: 0.05, ..limits }));
/// # Ok::<(), taut::Error>(())
/// ```
pub fn legs(text: &str, start: &[f64], limits: &Limits) -> Result<Vec<Leg<Vec<f64>>>> {
    let mut state = State { unit: 1e-3, relative: false, rapid: true, feed: None, position: start.to_vec() };
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

/// The letters of the coordinates.
const COORDINATES: [char; 2] = ['X', 'Y'];

struct State {
    /// Metres per unit of length.
    unit: f64,
    relative: bool,
    rapid: bool,
    /// m/s.
    feed: Option<f64>,
    /// Of each coordinate, m.
    position: Vec<f64>,
}

const KNOWN: &str = "G0, G1, G4, G20, G21, G90 and G91, with X, F, P and S";
const KNOWN_IN_PLANE: &str = "G0, G1, G4, G20, G21, G90 and G91, with X, Y, F, P and S";

impl State {
    fn known(&self) -> &'static str {
        if self.position.len() > 1 { KNOWN_IN_PLANE } else { KNOWN }
    }

    /// True if a block of a printer's list moves nothing that slides: a code of its heaters, fans or extruder.
    fn passes_over(&self, words: &[(char, f64)]) -> bool {
        let other = |&(letter, value): &(char, f64)| match letter {
            'M' | 'T' => true,
            'G' => value == 92.0 || value == 28.0,
            _ => false,
        };
        let places = words.iter().any(|(letter, _)| COORDINATES.contains(letter));
        self.position.len() > 1 && words.iter().any(other) && !places
    }
}

fn block(line: &str, state: &mut State, limits: &Limits, legs: &mut Vec<Leg<Vec<f64>>>) -> Result<()> {
    let in_plane = state.position.len() > 1;
    let words = words(line, state.known())?;
    if state.passes_over(&words) {
        return Ok(());
    }
    let (mut to, mut wait) = (vec![None; state.position.len()], None);
    let mut dwell = false;
    for (letter, value) in words {
        let coordinate = COORDINATES.iter().take(to.len()).position(|known| *known == letter);
        match (letter, value) {
            ('G', 0.0) => state.rapid = true,
            ('G', 1.0) => state.rapid = false,
            ('G', 4.0) => dwell = true,
            ('G', 20.0) => state.unit = 25.4e-3,
            ('G', 21.0) => state.unit = 1e-3,
            ('G', 90.0) => state.relative = false,
            ('G', 91.0) => state.relative = true,
            ('F', value) if value > 0.0 => state.feed = Some(value * state.unit / 60.0),
            ('F', value) => {
                return Err(Error::new(format!("a feed of {value}")).allowed("above zero, in mm/min"));
            }
            ('P', value) if value >= 0.0 => wait = Some(value * 1e-3),
            ('S', value) if value >= 0.0 => wait = Some(value),
            ('N', _) => {}
            ('E' | 'Z', _) if in_plane => {}
            (letter, value) => match coordinate {
                Some(k) => to[k] = Some(value),
                None => return Err(Error::new(format!("`{letter}{value}` is not known")).allowed(state.known())),
            },
        }
    }
    if dwell {
        let Some(wait) = wait else {
            return Err(Error::new("G4 does not say how long").next("write G4 P200 for 200 ms, or G4 S0.2"));
        };
        legs.push(Leg::Wait(wait));
    } else if wait.is_some() {
        return Err(Error::new("P and S belong to G4").allowed(state.known()));
    }
    if to.iter().any(Option::is_some) {
        let place = |(to, now): (&Option<f64>, &f64)| match (to, state.relative) {
            (None, _) => *now,
            (Some(way), true) => now + way * state.unit,
            (Some(place), false) => place * state.unit,
        };
        let target: Vec<f64> = to.iter().zip(&state.position).map(place).collect();
        let speed = match (state.rapid, state.feed) {
            (true, _) => limits.speed,
            (false, Some(feed)) => feed.min(limits.speed),
            (false, None) => {
                return Err(Error::new("G1 before any feed").next("add F, in mm/min, such as G1 X50 F3000"));
            }
        };
        state.position.clone_from(&target);
        legs.push(Leg::To(target, Limits { speed, ..*limits }));
    }
    Ok(())
}

/// The words of a line without its comments.
fn words(line: &str, known: &str) -> Result<Vec<(char, f64)>> {
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
            return Err(Error::new(format!("`{letter}{}` is no word of G-code", &after[..end])).allowed(known));
        };
        words.push((letter, value));
        rest = &after[end..];
    }
    Ok(words)
}
