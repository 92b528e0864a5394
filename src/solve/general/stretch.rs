//! Stretches of the inputs without an edge: what can be integrated in one go.

use crate::mechanism::DRIVES;
use crate::signal::{Piece, Signal};
use crate::solve::inputs::Pieces;

/// Pieces of the inputs in one stretch, at most.
const MOST_PIECES: usize = 64;

/// Pieces that join so smoothly that a formula of order eight does not notice the seams.
#[derive(Debug, Clone)]
pub(super) struct Stretch {
    /// Where it begins, s.
    pub(super) begin: f64,
    /// Where it ends, s.
    pub(super) end: f64,
    /// The pieces, and where each begins, counted from the beginning of the stretch.
    parts: Vec<(f64, Pieces)>,
    /// The highest power of time in any of them.
    degree: usize,
}

impl Stretch {
    /// The stretch that begins at `begin`, up to `end` at most.
    pub(super) fn new(signals: &[Signal], begin: f64, end: f64) -> Self {
        let first = Pieces::of(signals, begin);
        let mut parts = vec![(0.0, first)];
        let (mut stop, mut last) = (first.end, first);
        while stop < end && parts.len() < MOST_PIECES {
            let next = Pieces::of(signals, stop);
            if !last.pieces().zip(next.pieces()).all(|(last, next)| joins_smoothly(&last, &next)) {
                break;
            }
            parts.push((stop - begin, next));
            (stop, last) = (next.end, next);
        }
        let degree = parts.iter().map(|(_, pieces)| pieces.degree()).max().unwrap_or(0);
        Self { begin, end: stop.min(end), parts, degree }
    }

    /// One piece, up to `end` at most.
    pub(super) fn of(pieces: Pieces, end: f64) -> Self {
        let degree = pieces.degree();
        Self { begin: pieces.start, end: pieces.end.min(end), parts: vec![(0.0, pieces)], degree }
    }

    /// The first piece.
    pub(super) fn first(&self) -> Pieces {
        self.parts[0].1
    }

    pub(super) fn pieces(&self) -> usize {
        self.parts.len()
    }

    pub(super) fn length(&self) -> f64 {
        self.end - self.begin
    }

    /// The inputs at `tau` after the beginning.
    #[inline]
    pub(super) fn input(&self, tau: f64) -> [f64; DRIVES] {
        let index = match self.parts.len() {
            1 => 0,
            _ => self.parts.partition_point(|(begin, _)| *begin <= tau).max(1) - 1,
        };
        let (begin, pieces) = &self.parts[index];
        pieces.values(tau - begin, self.degree)
    }

    /// Longest step over which the input is told by eight of its values.
    pub(super) fn longest_step(&self) -> f64 {
        match self.parts.len() {
            1 => self.length(),
            _ => 2.0 * self.parts.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max),
        }
    }

    /// Whether no input jumps from the stretch before to this one.
    pub(super) fn continues(&self, before: &Stretch) -> bool {
        let goes_on = |(was, is): (f64, f64)| (is - was).abs() <= 1e-9 * was.abs().max(is.abs());
        before.input(before.length()).into_iter().zip(self.input(0.0)).all(goes_on)
    }
}

/// Whether value, slope and curvature of the input go on from one piece to the next.
fn joins_smoothly(last: &Piece, next: &Piece) -> bool {
    let length = last.end - last.start;
    let (mut at_end, mut size) = ([0.0; 3], 0.0);
    for (k, &c) in last.coefficients.iter().enumerate() {
        let n = k as f64;
        // Derivatives, each times length to its order, so that they compare.
        let term = c * length.powi(k as i32);
        at_end[0] += term;
        at_end[1] += n * term;
        at_end[2] += n * (n - 1.0) * term;
        size += n.max(1.0) * n.max(1.0) * term.abs();
    }
    let [c0, c1, c2] = [0, 1, 2].map(|k| next.coefficients[k] * length.powi(k as i32));
    let near = |a: f64, b: f64, part: f64| (a - b).abs() <= part * size;
    near(at_end[0], c0, 1e-11) && near(at_end[1], c1, 1e-9) && near(at_end[2], 2.0 * c2, 1e-7)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_has_no_edges_and_a_triangle_has() {
        let sine = Signal::Sine { amplitude: 2.0, frequency: 10.0, phase: 0.3, offset: 1.0 };
        let stretch = Stretch::new(std::slice::from_ref(&sine), 0.0, 1.0);
        assert_eq!(stretch.pieces(), MOST_PIECES);
        for k in 0..100 {
            let t = stretch.length() * k as f64 / 99.0;
            assert!((stretch.input(t)[0] - sine.value(t)).abs() < 1e-12, "{t}");
        }
        let triangle = Signal::Triangle { amplitude: 2.0, frequency: 10.0 };
        assert_eq!(Stretch::new(&[triangle], 0.0, 1.0).pieces(), 1);
        let pulse = Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 };
        let first = Stretch::new(std::slice::from_ref(&pulse), 0.0, 1.0);
        assert_eq!((first.pieces(), first.end), (1, 0.25));
        assert!(!Stretch::new(&[pulse], 0.25, 1.0).continues(&first));
    }
}
