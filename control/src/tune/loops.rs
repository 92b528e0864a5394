//! The loops of a controller at one frequency, each broken at another place.
//!
//! With the command u and what is measured, the position y, a scale x beside it and the current i, a controller is
//! D u = −(N_y y + N_x x + N_i i) and the axis y = G_y u, x = G_x u, i = G_i u. With P_k = N_k G_k,
//!
//! ```text
//! Δ = D + Σ P_k
//! broken at the command:       L = Σ P_k/D,              S = D/Δ
//! broken at a measurement k:   L = P_k/(Δ − P_k),        S = (Δ − P_k)/Δ
//! ```
//!
//! All have the same closed loop, Δ = 0, and margins of their own. With a single measurement both are the same loop.

use super::plant::{Answer, Plant};
use crate::control::feedback::{Feedback, Turn};
use nalgebra::Complex;

/// Where a loop is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Break {
    /// Where the command enters the axis.
    Command,
    /// At the measured position: of the encoder.
    Position,
    /// At the scale beside the encoder.
    Scale,
    /// At the measured current.
    Current,
}

impl Break {
    /// In a word, as in `tune.json`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Position => "encoder",
            Self::Scale => "scale",
            Self::Current => "current",
        }
    }
}

/// The places at which the loop of a controller differs: the command and every measurement that it uses; the command
/// alone where it uses one.
pub fn breaks(feedback: &Feedback) -> &'static [Break] {
    match (feedback.uses_scale(), feedback.uses_current()) {
        (false, false) => &[Break::Command],
        (true, false) => &[Break::Command, Break::Position, Break::Scale],
        (false, true) => &[Break::Command, Break::Position, Break::Current],
        (true, true) => &[Break::Command, Break::Position, Break::Scale, Break::Current],
    }
}

/// The loops at one frequency.
#[derive(Debug, Clone, Copy)]
pub struct Open {
    /// D.
    own: Complex<f64>,
    /// P_y, P_x, P_i.
    parts: [Complex<f64>; 3],
    /// Δ: 1 + L, times what has stable poles.
    pub(super) difference: Complex<f64>,
    /// True if the position loop is closed at a scale.
    has_scale: bool,
    /// The cart's position per position that follows the reference, and per step beside the command.
    cart: Complex<f64>,
    pub(super) pushed: Complex<f64>,
}

impl Open {
    pub(super) fn of(answer: &Answer, feedback: &Feedback, turn: &Turn) -> Self {
        let terms = feedback.at_turn(turn);
        let own = terms.own;
        let parts = [
            terms.position * answer.position, //
            terms.scale * answer.cart,
            terms.current * answer.current,
        ];
        // Δ = D + P_y + P_x + P_i
        let difference = own + parts[0] + parts[1] + parts[2];
        // x = G_x D/Δ v for a step v beside the command
        let pushed = answer.cart * own / difference;
        let has_scale = feedback.uses_scale();
        // What follows the reference is the cart itself where it is measured.
        let follows = if has_scale { answer.cart } else { answer.position };
        Self { own, parts, difference, has_scale, cart: answer.cart / follows, pushed }
    }

    /// The two parts of Δ: what is closed inside the loop broken there, and the loop itself; L is the second over the
    /// first.
    fn parted(&self, at: Break) -> (Complex<f64>, Complex<f64>) {
        let [y, x, i] = self.parts;
        match at {
            Break::Command => (self.own, y + x + i),
            Break::Position => (self.own + x + i, y),
            Break::Scale => (self.own + y + i, x),
            Break::Current => (self.own + y + x, i),
        }
    }

    /// The break of the loop that follows the reference: the scale, or the measured position without one.
    pub(super) fn outer(&self) -> Break {
        if self.has_scale { Break::Scale } else { Break::Position }
    }

    /// L broken there.
    pub fn broken_at(&self, at: Break) -> Complex<f64> {
        let (inner, outer) = self.parted(at);
        outer / inner
    }

    /// |S| of the loop broken there.
    pub fn sensitivity(&self, at: Break) -> f64 {
        (self.parted(at).0 / self.difference).norm()
    }

    /// |T| of the loop broken there.
    pub fn complementary(&self, at: Break) -> f64 {
        (self.parted(at).1 / self.difference).norm()
    }

    /// |S|² and |T|², of the worst of these breaks each.
    pub(super) fn squares(&self, breaks: &[Break]) -> [f64; 2] {
        let least = self.difference.norm_sqr().recip();
        let mut most = [0.0_f64; 2];
        for &at in breaks {
            let (inner, outer) = self.parted(at);
            most = [most[0].max(inner.norm_sqr() * least), most[1].max(outer.norm_sqr() * least)];
        }
        most
    }

    /// |S| of the loop that follows the reference.
    pub(super) fn following(&self) -> f64 {
        self.sensitivity(self.outer())
    }

    /// T x/y: from the reference to the cart, without feed-forward.
    pub fn reference_to_cart(&self) -> Complex<f64> {
        self.parted(self.outer()).1 / self.difference * self.cart
    }
}

/// The loops at all frequencies of the axis.
pub fn loops(plant: &Plant, feedback: &Feedback) -> Vec<Open> {
    plant.seen().map(|(_, answer, turn)| Open::of(answer, feedback, turn)).collect()
}
