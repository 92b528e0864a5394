//! Inputs as chains of pieces: a straight line and sines each.

use crate::double::{Double, PI};
use crate::machine::Taken;
use crate::root::Polynomial;
use crate::terms::ORDER;
use taut::signal::Signal;

/// A stretch of time.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    /// Where it begins; it holds until the next one does.
    pub start: Double,
    /// u = value + slope (t − start) + Σ waves
    pub value: Double,
    /// Per second.
    pub slope: Double,
    /// Sines on top.
    pub waves: Vec<Wave>,
}

/// a sin(ω t + φ), t from the start of the piece.
#[derive(Debug, Clone, Copy)]
pub struct Wave {
    amplitude: Double,
    omega: Double,
    phase: Double,
}

impl Piece {
    /// A straight line.
    pub fn line(start: Double, value: Double, slope: Double) -> Self {
        Self { start, value, slope, waves: Vec::new() }
    }

    /// The same input from a later moment on.
    fn from(&self, start: Double) -> Self {
        let later = start - self.start;
        let waves = self.waves.iter().map(|wave| Wave { phase: wave.phase + wave.omega * later, ..*wave });
        Self { start, value: self.value + self.slope * later, slope: self.slope, waves: waves.collect() }
    }

    /// A time over which a Taylor series of the input serves: two radians of its fastest wave.
    pub fn reach(&self) -> f64 {
        2.0 / self.waves.iter().map(|wave| wave.omega.high.abs()).fold(0.0, f64::max)
    }

    /// Taylor coefficients of u(t + s h) in powers of s.
    pub fn series(&self, t: Double, h: Double) -> Polynomial {
        let mut u = [Double::ZERO; ORDER + 1];
        let now = self.from(t);
        u[0] = now.value;
        u[1] = now.slope * h;
        for wave in &now.waves {
            // a ωᵏ hᵏ/k! · (sin, cos, −sin, −cos)
            let (sine, cosine) = wave.phase.sin_cos();
            let turns = [sine, cosine, -sine, -cosine];
            let mut power = wave.amplitude;
            for (k, u) in u.iter_mut().enumerate() {
                *u += power * turns[k % 4];
                power = power * wave.omega * h / Double::from((k + 1) as f64);
            }
        }
        u
    }
}

/// The pieces of a signal up to `until`; `Err` for kinds that the hunt does not draw.
pub fn chain(signal: &Signal, until: f64, taken: Taken) -> Result<Vec<Piece>, String> {
    let mut chain = pieces(signal, until, taken)?;
    if chain.first().is_none_or(|first| first.start > Double::ZERO) {
        chain.insert(0, Piece::default());
    }
    chain.retain(|piece| piece.start.high < until);
    Ok(chain)
}

/// The value of a chain at a time; at an edge the one after it.
pub fn value(chain: &[Piece], time: f64) -> Double {
    let time = Double::from(time);
    let piece = chain.iter().rev().find(|piece| piece.start <= time);
    piece.map_or(Double::ZERO, |piece| piece.series(time, Double::ONE)[0])
}

fn pieces(signal: &Signal, until: f64, taken: Taken) -> Result<Vec<Piece>, String> {
    let zero = Double::ZERO;
    let line = Piece::line;
    Ok(match signal {
        &Signal::Step { value, at } => vec![line(taken(at), taken(value), zero)],
        &Signal::Pulse { value, duration, at } => {
            let at = taken(at);
            vec![line(at, taken(value), zero), line(at + taken(duration), zero, zero)]
        }
        &Signal::Ramp { value, over, at } => {
            let (value, over, at) = (taken(value), taken(over), taken(at));
            vec![line(at, zero, value / over), line(at + over, value, zero)]
        }
        &Signal::Triangle { amplitude, frequency } => triangle(taken(amplitude), taken(frequency), until),
        &Signal::Square { amplitude, frequency, duty } => {
            square(taken(amplitude), taken(frequency), taken(duty), until)
        }
        &Signal::Sine { amplitude, frequency, phase, offset } => {
            let wave = Wave { amplitude: taken(amplitude), omega: PI * 2.0 * taken(frequency), phase: taken(phase) };
            vec![Piece { value: taken(offset), waves: vec![wave], ..Piece::default() }]
        }
        Signal::Table { points } => {
            let points: Vec<_> = points.iter().map(|&[t, u]| (taken(t), taken(u))).collect();
            let mut chain: Vec<_> = points
                .windows(2)
                .map(|pair| line(pair[0].0, pair[0].1, (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)))
                .collect();
            chain.extend(points.last().map(|&(t, u)| line(t, u, zero)));
            chain
        }
        Signal::Sum(parts) => {
            let parts = parts.iter().map(|part| chain(part, until, taken));
            sum(&parts.collect::<Result<Vec<_>, _>>()?)
        }
        Signal::Sequence(slots) => {
            let (mut start, mut chains) = (zero, Vec::new());
            for slot in slots.slots() {
                let end = if slot.lasts.is_finite() { start + taken(slot.lasts) } else { Double::from(f64::INFINITY) };
                let own = chain(&slot.signal, f64::min(slot.lasts, until), taken)?;
                let shifted = own.into_iter().map(|piece| Piece { start: piece.start + start, ..piece });
                chains.extend(shifted.filter(|piece| piece.start < end));
                if end.high >= until {
                    break;
                }
                start = end;
            }
            chains
        }
        other => return Err(format!("the independent solver has no {other:?}")),
    })
}

/// From zero, rising first.
fn triangle(amplitude: Double, frequency: Double, until: f64) -> Vec<Piece> {
    let slope = amplitude * 4.0 * frequency;
    let mut chain = vec![Piece::line(Double::ZERO, Double::ZERO, slope)];
    for k in 0.. {
        // Peaks at (2k + 1)/(4f)
        let start = Double::from(2.0 * f64::from(k) + 1.0) / (frequency * 4.0);
        if start.high >= until {
            break;
        }
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        chain.push(Piece::line(start, amplitude * sign, slope * -sign));
    }
    chain
}

/// High for the share `duty` of each period.
fn square(amplitude: Double, frequency: Double, duty: Double, until: f64) -> Vec<Piece> {
    let mut chain = Vec::new();
    for k in 0.. {
        let k = Double::from(f64::from(k));
        let (up, down) = (k / frequency, (k + duty) / frequency);
        if up.high >= until {
            break;
        }
        chain.push(Piece::line(up, amplitude, Double::ZERO));
        chain.push(Piece::line(down, -amplitude, Double::ZERO));
    }
    chain
}

/// All of these added.
fn sum(chains: &[Vec<Piece>]) -> Vec<Piece> {
    let mut starts: Vec<Double> = chains.iter().flatten().map(|piece| piece.start).collect();
    starts.sort_by(|a, b| a.partial_cmp(b).expect("times are numbers"));
    starts.dedup();
    let at = |start: Double| {
        let mut sum = Piece { start, ..Piece::default() };
        for chain in chains {
            let Some(piece) = chain.iter().rev().find(|piece| piece.start <= start) else { continue };
            let piece = piece.from(start);
            sum.value += piece.value;
            sum.slope += piece.slope;
            sum.waves.extend(piece.waves);
        }
        sum
    };
    starts.into_iter().map(at).collect()
}
