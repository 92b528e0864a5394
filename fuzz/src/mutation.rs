//! Inputs spoiled: by lines, words and numbers where they are text, by bytes and lengths where they are not.

use crate::{Seed, Spoiling, Target, corpus};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;
use std::ops::Range;

/// Longest input, bytes.
const LONGEST: usize = 1 << 18;

/// Words of case files.
pub const TOML: &[&str] = &[
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ".",
    ",",
    "\"",
    "\n",
    "#",
    "true",
    "nan",
    "inf",
    "1979-05-27",
    "[[experiment]]",
    "[motor]",
    "[cart]",
    "[belt]",
    "[travel]",
    "[sweep]",
    "[controller]",
    "stribeck",
    "lugre",
    "smooth",
    "static",
    "coulomb",
    "viscous",
    "follows_cart",
    "pretension",
    "model = \"rigid\"",
    "model = \"two-mass\"",
    "mode = \"current\"",
    "backlash = 0.01",
    "inductance = 1e-3",
    "voltage_limit = 0.1",
    "current_limit = 1e-6",
    "stiffness",
    "mass",
    "inertia",
    "radius",
    "until",
    "every",
    "chirp",
    "prbs",
    "sine",
    "sequence",
    "sum",
    "µ",
    "😀",
    "\\",
    "mm",
    "rpm",
    "1/0",
];

/// Words of quantities.
pub const UNITS: &[&str] = &[
    "m", "mm", "kg", "N", "s", "rad", "deg", "rev", "Hz", "rpm", "V", "A", "ohm", "Ω", "µm", "um", "·", "*", "/", "^",
    "²", "⁻¹", "(", ")", "%", "e", "E9", "-", "+", ".", ",", " ", "\u{a0}", "1/2", "lbf", "in", "kgf", "Pa", "GPa",
    "J", "W", "^-2", "^99", "((((((((",
];

/// Words of logs.
pub const CSV: &[&str] = &[
    ",", ";", "\t", " ", "\"", "\r\n", "\n", "\r", "#", "%", "//", "nan", "NaN", "inf", "NA", "", "t", "u", "x", "run",
    "time_s", "psd_x", "accel_x", "freq", "time", "1,5", "1.5.2", "12:30:01", "\u{feff}", "\0", "µ", "mV", "s", "-",
    "1e", "0x10",
];

/// Words of lists of moves.
pub const GCODE: &[&str] = &[
    "G0", "G1", "G4", "G20", "G21", "G90", "G91", "X", "F", "P", "S", "N", ";", "(", ")", "\n", "-", ".", "e5", "G2",
    "*", "µ",
];

/// Numbers that have a story.
const EXTREMES: [&str; 24] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "1e308",
    "-1e308",
    "1.8e308",
    "1e400",
    "5e-324",
    "1e-300",
    "2.2250738585072011e-308",
    "1e-9",
    "1e9",
    "1e15",
    "9007199254740993",
    "18446744073709551616",
    "4294967296",
    "2147483648",
    "-9223372036854775808",
    "0.1",
    "1e-17",
    "3.5000000000000004",
    "65536",
    "nan",
];

/// Values of bytes and counts that have a story.
const COUNTS: [u64; 14] =
    [0, 1, 2, 7, 8, 9, 127, 128, 255, 65_535, 0x7fff_ffff, 0xffff_ffff, 0x7fff_ffff_ffff_ffff, u64::MAX];

/// A number from 0 to below `n`; 0 for none.
pub fn below(random: &mut Pcg64, n: usize) -> usize {
    if n == 0 { 0 } else { (random.next_u64() % n as u64) as usize }
}

fn one<'a, T>(random: &mut Pcg64, all: &'a [T]) -> &'a T {
    &all[below(random, all.len())]
}

/// An input made of one of these by one to eight changes, mostly of one that its reader takes.
pub fn mutated(target: &Target, seeds: &[Seed], random: &mut Pcg64) -> Vec<u8> {
    let good: Vec<&Seed> = seeds.iter().filter(|seed| seed.good).collect();
    let mut bytes = match good.is_empty() || below(random, 3) == 0 {
        true => one(random, seeds).bytes.clone(),
        false => one(random, &good).bytes.clone(),
    };
    let changes = 1 + random.next_u64().leading_zeros().min(7);
    for _ in 0..changes {
        let other = &one(random, seeds).bytes;
        match target.kind {
            // A change of bytes now and then, so that no text is beyond reach.
            Spoiling::Text if below(random, 12) > 0 => change_text(&mut bytes, other, target.words, random),
            Spoiling::Text | Spoiling::Binary | Spoiling::Matlab => change_bytes(&mut bytes, other, random),
        }
        bytes.truncate(LONGEST);
    }
    if target.kind == Spoiling::Matlab && below(random, 3) == 0 { corpus::pack(&bytes) } else { bytes }
}

fn change_bytes(bytes: &mut Vec<u8>, other: &[u8], random: &mut Pcg64) {
    let at = below(random, bytes.len());
    let stretch = stretch(bytes.len(), 64, random);
    match below(random, 9) {
        0 if !bytes.is_empty() => bytes[at] ^= 1 << below(random, 8),
        1 if !bytes.is_empty() => bytes[at] = random.next_u64() as u8,
        // A count, of either order of bytes and several lengths, mostly where counts stand.
        2 | 3 => {
            let count = one(random, &COUNTS).wrapping_add(below(random, 3) as u64);
            let width = *one(random, &[1, 2, 4, 8]);
            let at = if below(random, 4) > 0 { at / width * width } else { at };
            let mut value = count.to_le_bytes()[..width].to_vec();
            if below(random, 4) == 0 {
                value.reverse();
            }
            let end = (at + width).min(bytes.len());
            bytes.splice(at..end, value);
        }
        4 => drop(bytes.drain(stretch)),
        5 => {
            let copy = bytes[stretch].to_vec();
            bytes.splice(at..at, copy);
        }
        6 => {
            let from = self::stretch(other.len(), 256, random);
            let end = (at + from.len()).min(bytes.len());
            bytes.splice(at..end, other[from].iter().copied());
        }
        7 => bytes.truncate(at),
        _ => bytes[stretch].fill(0),
    }
}

fn change_text(bytes: &mut Vec<u8>, other: &[u8], words: &[&str], random: &mut Pcg64) {
    let at = below(random, bytes.len() + 1);
    match below(random, 16) {
        0..=3 => {
            let numbers = numbers(bytes);
            if !numbers.is_empty() {
                let place = one(random, &numbers).clone();
                bytes.splice(place, one(random, &EXTREMES).bytes());
            }
        }
        // Another power of ten, or another sign.
        4..=6 => {
            let numbers = numbers(bytes);
            if !numbers.is_empty() {
                let place = one(random, &numbers).clone();
                let text = String::from_utf8_lossy(&bytes[place.clone()]).into_owned();
                if let Ok(value) = text.parse::<f64>() {
                    let power = 10_f64.powi(below(random, 25) as i32 - 12);
                    let scaled = if below(random, 5) == 0 { -value } else { value * power };
                    bytes.splice(place, scaled.to_string().into_bytes());
                }
            }
        }
        7 => drop(bytes.drain(one_line(bytes, random))),
        8 => {
            let line = bytes[one_line(bytes, random)].to_vec();
            let place = one_line(bytes, random).start;
            bytes.splice(place..place, line);
        }
        // Two lines change places.
        9 => {
            let (a, b) = (one_line(bytes, random), one_line(bytes, random));
            let (a, b) = if a.start <= b.start { (a, b) } else { (b, a) };
            if a.end <= b.start {
                let first = bytes[a.clone()].to_vec();
                let second: Vec<u8> = bytes.splice(b, first).collect();
                bytes.splice(a, second);
            }
        }
        10 | 11 => {
            let line = other[one_line(other, random)].to_vec();
            let place = one_line(bytes, random).start;
            bytes.splice(place..place, line);
        }
        12 if !words.is_empty() => drop(bytes.splice(at..at, one(random, words).bytes())),
        // A word takes the place of another.
        13 if !words.is_empty() => {
            let all = runs(bytes, |b| b.is_ascii_alphabetic() || b == b'_');
            if !all.is_empty() {
                let place = one(random, &all).clone();
                let own = one(random, &all).clone();
                let word =
                    if below(random, 2) == 0 { bytes[own].to_vec() } else { one(random, words).as_bytes().to_vec() };
                bytes.splice(place, word);
            }
        }
        // A stretch many times over.
        14 if below(random, 4) == 0 => {
            let times = 1 << below(random, 11);
            let copy = bytes[stretch(bytes.len(), 32, random)].repeat(times);
            bytes.splice(at..at, copy);
        }
        _ => drop(bytes.drain(stretch(bytes.len(), 16, random))),
    }
}

/// A stretch within `length` bytes, of at most `most`.
fn stretch(length: usize, most: usize, random: &mut Pcg64) -> Range<usize> {
    let start = below(random, length + 1);
    start..(start + below(random, most + 1)).min(length)
}

/// A line with its end, or all of them where there is one.
fn one_line(bytes: &[u8], random: &mut Pcg64) -> Range<usize> {
    let at = below(random, bytes.len() + 1);
    let start = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
    let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |k| at + k + 1);
    start..end
}

/// Places that look like numbers.
fn numbers(bytes: &[u8]) -> Vec<Range<usize>> {
    let mut found = runs(bytes, |b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'e' | b'+'));
    found.retain(|place| bytes[place.clone()].iter().any(u8::is_ascii_digit));
    found
}

fn runs(bytes: &[u8], belongs: impl Fn(u8) -> bool) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for (k, byte) in bytes.iter().enumerate().filter(|(_, byte)| belongs(**byte)) {
        let _ = byte;
        match found.last_mut() {
            Some(last) if last.end == k => last.end = k + 1,
            _ => found.push(k..k + 1),
        }
    }
    found
}
