//! Lists of moves in the manner of G-code: `G0 X10`, `G1 X50 F3000`, `G4 P200`; of a machine with two coordinates
//! `G1 X50 Y20 F3000`.
//!
//! Of G-code it takes what an axis of its own can do: G0 (as fast as allowed), G1 (with a feed), G4 (a wait, P in ms or
//! S in s), G20 and G21 (inches, millimetres), G90 and G91 (absolute, relative); of a machine in a plane also G2
//! (clockwise arc) and G3 (counterclockwise), with the centre from the start by I and J, or with a radius R, below zero
//! for the longer of both arcs. X, Y, I, J and R are in millimetres and F in mm/min unless G20 says inches; F is the
//! speed along the path. Comments stand after `;` or in brackets. Every block stops exactly (G61): no corner is passed
//! at speed.
//!
//! The list of a machine in a plane may be that of a printer: its words E and Z, its M and T codes, and G28, G92 of
//! other letters move neither coordinate and are passed over. So are `%`, numbers and checksums of lines (`N12 …*71`),
//! the power S of a laser, and codes of controllers that say what is so here anyway: G17 (the plane of X and Y), G40,
//! G49 and G80 (no compensation, no canned cycle), G54 (the first origin), G61, G64 and G91.1 (I and J from the start).
//! M2 and M30 end the list.

use super::arc::Arc;
use super::profile::{Leg, Limits};
use crate::error::{Error, Result};
use std::ops::ControlFlow;

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
    let mut state = State { unit: 1e-3, relative: false, motion: Motion::Rapid, feed: None, position: start.to_vec() };
    let mut legs = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let flow = block(line, &mut state, limits, &mut legs)
            .map_err(|error| Error { what: format!("line {} of the moves: {}", number + 1, error.what), ..error })?;
        if flow.is_break() {
            break;
        }
    }
    if legs.is_empty() {
        return Err(Error::new("the list of moves is empty").next("write for example G1 X50 F3000"));
    }
    Ok(legs)
}

/// Codes that change nothing here.
const IDLE: [f64; 8] = [17.0, 40.0, 49.0, 54.0, 61.0, 64.0, 80.0, 91.1];

/// Codes that end a list.
const ENDS: [f64; 2] = [2.0, 30.0];

/// An arc whose end lies in this direction from its beginning, rad, is a whole circle: its end has been rounded.
const WHOLE: f64 = 1e-6;

/// The letters of the coordinates.
const COORDINATES: [char; 2] = ['X', 'Y'];

struct State {
    /// Metres per unit of length.
    unit: f64,
    relative: bool,
    motion: Motion,
    /// m/s.
    feed: Option<f64>,
    /// Of each coordinate, m.
    position: Vec<f64>,
}

/// Motion of a block, and of the blocks behind it that name none.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    /// G0
    Rapid,
    /// G1
    Straight,
    /// G2 (clockwise) and G3
    Arc { clockwise: bool },
}

const KNOWN: &str = "G0, G1, G4, G20, G21, G90 and G91, with X, F, P and S";
const KNOWN_IN_PLANE: &str = "G0, G1, G2, G3, G4, G20, G21, G90 and G91, with X, Y, I, J, R, F, P and S";

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

/// Adds the legs of a line; a break at the end of the list.
fn block(line: &str, state: &mut State, limits: &Limits, legs: &mut Vec<Leg<Vec<f64>>>) -> Result<ControlFlow<()>> {
    let in_plane = state.position.len() > 1;
    let words = words(line, state.known())?;
    if words.iter().any(|(letter, value)| *letter == 'M' && ENDS.contains(value)) {
        return Ok(ControlFlow::Break(()));
    }
    if state.passes_over(&words) {
        return Ok(ControlFlow::Continue(()));
    }
    let mut twice = words.iter().enumerate().filter(|(_, (letter, _))| *letter != 'G');
    if let Some((_, (letter, _))) = twice.find(|(k, (letter, _))| words[..*k].iter().any(|(other, _)| other == letter))
    {
        return Err(Error::new(format!("`{letter}` stands twice in one line")).next("write a line for each move"));
    }
    let (mut to, mut wait, mut pause) = (vec![None; state.position.len()], None, None);
    let (mut off, mut radius) = ([None; 2], None);
    let mut dwell = false;
    for (letter, value) in words {
        let coordinate = COORDINATES.iter().take(to.len()).position(|known| *known == letter);
        match (letter, value) {
            ('G', 0.0) => state.motion = Motion::Rapid,
            ('G', 1.0) => state.motion = Motion::Straight,
            ('G', 2.0 | 3.0) if in_plane => state.motion = Motion::Arc { clockwise: value == 2.0 },
            ('I', value) if in_plane => off[0] = Some(value * state.unit),
            ('J', value) if in_plane => off[1] = Some(value * state.unit),
            ('R', value) if in_plane => radius = Some(value * state.unit),
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
            ('S', value) if value >= 0.0 => pause = Some(value),
            ('N', _) => {}
            ('G', code) if IDLE.contains(&code) => {}
            ('G', 28.0 | 92.0) if in_plane => {
                return Err(Error::new(format!("`G{value}` with X or Y homes the axes or moves their zero"))
                    .next("leave it out, and write all positions from one zero"));
            }
            ('E' | 'Z', _) if in_plane => {}
            (letter, value) => match coordinate {
                Some(k) => to[k] = Some(value),
                None => return Err(Error::new(format!("`{letter}{value}` is not known")).allowed(state.known())),
            },
        }
    }
    if dwell {
        let Some(wait) = wait.or(pause) else {
            return Err(Error::new("G4 does not say how long").next("write G4 P200 for 200 ms, or G4 S0.2"));
        };
        legs.push(Leg::Wait(wait));
    } else if wait.is_some() || (pause.is_some() && !in_plane) {
        return Err(Error::new("P and S belong to G4").allowed(state.known()));
    }
    let has_center = off.iter().any(Option::is_some);
    let is_arc = matches!(state.motion, Motion::Arc { .. });
    if !is_arc && (has_center || radius.is_some()) {
        return Err(Error::new("I, J and R belong to G2 and G3").allowed(state.known()));
    }
    if to.iter().all(Option::is_none) && !has_center {
        return Ok(ControlFlow::Continue(()));
    }
    let place = |(to, now): (&Option<f64>, &f64)| match (to, state.relative) {
        (None, _) => *now,
        (Some(way), true) => now + way * state.unit,
        (Some(place), false) => place * state.unit,
    };
    let target: Vec<f64> = to.iter().zip(&state.position).map(place).collect();
    let speed = match (state.motion, state.feed) {
        (Motion::Rapid, _) => limits.speed,
        (_, Some(feed)) => feed.min(limits.speed),
        (_, None) => {
            return Err(Error::new("G1, G2 or G3 before any feed").next("add F, in mm/min, such as G1 X50 F3000"));
        }
    };
    let limits = Limits { speed, ..*limits };
    legs.push(match (state.motion, &state.position[..], &target[..]) {
        (Motion::Arc { clockwise }, &[x, y], &[to_x, to_y]) => {
            let (from, to) = ([x, y], [to_x, to_y]);
            let center = match (radius, has_center) {
                (None, true) => [x + off[0].unwrap_or(0.0), y + off[1].unwrap_or(0.0)],
                (Some(radius), false) => center(from, to, radius, clockwise)?,
                _ => return Err(Error::new("an arc needs its centre by I and J, or its radius by R, and not both")),
            };
            let off = |point: [f64; 2]| [point[0] - center[0], point[1] - center[1]];
            let ([ax, ay], [bx, by]) = (off(from), off(to));
            let is_whole = has_center && (ax * by - ay * bx).atan2(ax * bx + ay * by).abs() < WHOLE;
            Leg::Around(Arc { to: if is_whole { from } else { to }, center, clockwise }, limits)
        }
        _ => Leg::To(target.clone(), limits),
    });
    state.position = target;
    Ok(ControlFlow::Continue(()))
}

/// The centre of an arc between two points, by its radius: of the shorter arc, and of the longer one for a radius below
/// zero.
fn center(from: [f64; 2], to: [f64; 2], radius: f64, clockwise: bool) -> Result<[f64; 2]> {
    let chord = [to[0] - from[0], to[1] - from[1]];
    let half = 0.5 * chord[0].hypot(chord[1]);
    if half == 0.0 {
        return Err(Error::new("an arc by R ends where it begins").next("give the centre of a whole circle by I and J"));
    }
    // A half circle, whose R has lost its last digits.
    let square = radius * radius - half * half;
    if square < -2e-3 * half * half {
        return Err(Error::new(format!("a radius of {:.6} mm does not reach", 1e3 * radius.abs()))
            .allowed(format!("from {:.6} mm on", 1e3 * half)));
    }
    let off = square.max(0.0).sqrt();
    // The centre of the shorter counterclockwise arc is to the left of the chord.
    let side = if clockwise == (radius > 0.0) { -off } else { off };
    let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
    Ok([middle[0] - side * chord[1] / (2.0 * half), middle[1] + side * chord[0] / (2.0 * half)])
}

/// The words of a line without its comments.
fn words(line: &str, known: &str) -> Result<Vec<(char, f64)>> {
    let mut plain = String::new();
    let mut inside = false;
    for c in line.chars() {
        match c {
            ';' | '%' | '*' if !inside => break,
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
            let what = match letter.is_ascii_alphabetic() && after[..end].is_empty() {
                true => format!("`{letter}` has no number"),
                false => format!("`{letter}{}` is no word of G-code", &after[..end]),
            };
            return Err(Error::new(what).allowed(known));
        };
        words.push((letter, value));
        rest = &after[end..];
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { speed: 0.5, acceleration: 5.0, jerk: None, snap: None };

    fn arcs(text: &str) -> Vec<Arc> {
        let of = |leg: &Leg<Vec<f64>>| match leg {
            Leg::Around(arc, limits) => {
                assert_eq!(limits.speed, 0.05);
                Some(*arc)
            }
            _ => None,
        };
        legs(text, &[0.01, 0.0], &LIMITS).unwrap().iter().filter_map(of).collect()
    }

    fn near(a: Arc, b: Arc) -> bool {
        let all = a.to.iter().zip(&b.to).chain(a.center.iter().zip(&b.center));
        a.clockwise == b.clockwise && all.into_iter().all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn arcs_by_centre_and_by_radius() {
        let quarter = Arc { to: [0.0, 0.01], center: [0.0, 0.0], clockwise: false };
        assert!(near(arcs("G3 X0 Y10 I-10 F3000")[0], quarter));
        assert!(near(arcs("G3 X0 Y10 R10 F3000")[0], quarter));
        assert!(near(arcs("G91\nG3 X-10 Y10 I-10 J0 F3000")[0], quarter));
        // The short way clockwise has its centre on the other side; the long way counterclockwise too.
        let other = [0.01, 0.01];
        assert!(near(arcs("G2 X0 Y10 R10 F3000")[0], Arc { center: other, clockwise: true, ..quarter }));
        assert!(near(arcs("G3 X0 Y10 R-10 F3000")[0], Arc { center: other, ..quarter }));
        assert!(near(arcs("G2 X0 Y10 R-10 F3000")[0], Arc { clockwise: true, ..quarter }));
        // A whole circle, then a second arc without a code.
        let two = arcs("G2 I-10 F3000\nX-10 Y0 R10");
        assert!(near(two[0], Arc { to: [0.01, 0.0], center: [0.0, 0.0], clockwise: true }));
        assert!(near(two[1], Arc { to: [-0.01, 0.0], center: [0.0, 0.0], clockwise: true }));
    }

    #[test]
    fn codes_that_change_nothing_are_passed_over() {
        let text = "%\nG17 G40 G49 G80 G54\nN10 G90 G21*71\nG64 G91.1\nG1 X20 Y0 S800 F3000\nG4 S0.1\nM2\nG1 X0";
        let list = legs(text, &[0.0, 0.0], &LIMITS).unwrap();
        assert_eq!(list, [Leg::To(vec![0.02, 0.0], Limits { speed: 0.05, ..LIMITS }), Leg::Wait(0.1)]);
        let what = |text: &str| legs(text, &[0.01, 0.0], &LIMITS).unwrap_err().what;
        assert!(what("G1 X10 X20 F3000").contains("`X` stands twice"));
        assert!(what("G28 X").contains("`X` has no number"));
        assert!(legs("G1 X20 S800 F3000", &[0.0], &LIMITS).is_err());
    }

    /// The end of a whole circle is rounded along the radius or across it.
    #[test]
    fn a_whole_circle_stays_one() {
        for text in ["G2 X10.005 Y0 I-10 F3000", "G2 X10 Y0.000009 I-10 F3000", "G3 X9.999 Y-0.000009 I-10 F3000"] {
            let [arc] = arcs(text)[..] else { panic!("{text}") };
            assert_eq!(arc.to, [0.01, 0.0], "{text}");
        }
        assert_ne!(arcs("G2 X10 Y0.1 I-10 F3000")[0].to, [0.01, 0.0]);
    }

    #[test]
    fn wrong_arcs_are_refused() {
        let what = |text: &str| legs(text, &[0.01, 0.0], &LIMITS).unwrap_err().what;
        assert!(what("G2 X0 Y10 F3000").contains("its centre by I and J, or its radius by R"));
        assert!(what("G2 X0 Y10 I1 R10 F3000").contains("and not both"));
        assert!(what("G2 X0 Y10 R2 F3000").contains("2.000000 mm does not reach"));
        assert!(what("G2 R10 F3000\nG2 X10 Y0 R10").contains("ends where it begins"));
        assert!(what("G1 X0 I10 F3000").contains("belong to G2 and G3"));
        assert!(what("G2 X0 Y10 R10").contains("before any feed"));
        assert!(what("G92 X0").contains("homes the axes or moves their zero"));
        assert!(legs("G92 E0\nG28\nG1 X20 F3000", &[0.01, 0.0], &LIMITS).is_ok());
        let axis = legs("G2 X10 I5 F3000", &[0.0], &LIMITS).unwrap_err();
        assert!(axis.what.contains("`G2` is not known"), "{}", axis.what);
    }
}
