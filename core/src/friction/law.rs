//! Friction between rest and fast sliding: Stribeck curves, a smooth substitute, bristles.

use super::Friction;
use std::f64::consts::{E, SQRT_2};

/// Transition of friction from the breakaway F_b to Coulomb friction F_c with increasing speed; b v is added.
///
/// Speeds are in m/s for a cart and rad/s for a pulley. The sources disagree on what they call "static force":
/// Armstrong-Hélouvry, Canudas de Wit and Simscape mean F_b, the level at rest; the paper's F_s in eq. (14) is the
/// height above F_c, F_b − F_c.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Law {
    /// At once: F_f = b v ± F_c, eq. (15).
    #[default]
    Coulomb,
    /// Along a curve, eq. (14): F_f = b v ± (F_c + (F_b − F_c) e^{−(v/v_s)²}) or e^{−|v|/v_s}. Sticks at zero speed.
    Stribeck {
        /// Stribeck velocity v_s.
        velocity: f64,
        /// Gaussian or exponential.
        shape: Shape,
    },
    /// Simscape's continuous "Translational Friction":
    /// F_f = √(2e) (F_b − F_c) e^{−(v/v_St)²} v/v_St + F_c tanh(v/v_Coul) + b v, v_St = √2 v_b, v_Coul = v_b/10.
    ///
    /// It never sticks: a body under load creeps. Its greatest resistance, close to F_b, is at v_b.
    Smooth {
        /// Breakaway velocity v_b.
        breakaway_velocity: f64,
    },
    /// Bristles that bend before they slip (Canudas de Wit, Olsson, Åström and Lischinsky 1995):
    /// ż = v − σ₀ |v| z / g(v), F_f = σ₀ z + σ₁ ż + b v, g(v) = F_c + (F_b − F_c) e^{−(v/v_s)²}.
    ///
    /// It never sticks either; at rest the bristles hold like springs of stiffness σ₀.
    LuGre {
        /// σ₀: N/m for a cart, N m/rad for a pulley.
        stiffness: f64,
        /// σ₁: N s/m for a cart, N m s/rad for a pulley.
        damping: f64,
        /// Stribeck velocity v_s.
        velocity: f64,
    },
}

impl Law {
    /// True if a body never sticks: it creeps, or hangs on its bristles.
    pub fn never_sticks(self) -> bool {
        match self {
            Law::Coulomb | Law::Stribeck { .. } => false,
            Law::Smooth { .. } | Law::LuGre { .. } => true,
        }
    }

    /// Characteristic speed of a friction curve; none for Coulomb friction.
    pub fn velocity(self) -> Option<f64> {
        match self {
            Law::Coulomb => None,
            Law::Stribeck { velocity, .. } | Law::LuGre { velocity, .. } => Some(velocity),
            Law::Smooth { breakaway_velocity } => Some(breakaway_velocity),
        }
    }
}

/// The shape of a Stribeck curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Shape {
    /// e^{−(v/v_s)²}: the paper's eq. (14), and Armstrong-Hélouvry's with the exponent δ = 2.
    #[default]
    Gaussian,
    /// e^{−|v|/v_s}: Tustin's, Armstrong-Hélouvry's with δ = 1.
    Exponential,
}

/// Stribeck velocity v_s for the paper's F_τ (s²/m² or s²/rad²): e^{−F_τ v²} = e^{−(v/v_s)²}.
pub fn velocity_of_decay(decay: f64) -> f64 {
    // v_s = 1/√F_τ                                                             (14)
    1.0 / decay.sqrt()
}

/// The paper's F_τ for a Stribeck velocity v_s.
pub(crate) fn decay_of_velocity(velocity: f64) -> f64 {
    1.0 / (velocity * velocity)
}

impl Shape {
    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        match self {
            Shape::Gaussian => "gaussian",
            Shape::Exponential => "exponential",
        }
    }

    /// Remaining fraction of F_b − F_c at q = v/v_s, with q positive in the direction of motion.
    ///
    /// A trial step may end beyond zero speed, q < 0, before its event is found. There the exponential is continued, so
    /// that the step is smooth, and beyond q = −1 its tangent, so that it does not overflow.
    #[inline(always)]
    pub(crate) fn share(self, q: f64) -> f64 {
        match self {
            Shape::Gaussian => exp(-q * q),
            Shape::Exponential => {
                let along = exp(-q);
                if q < -1.0 { -E * q } else { along }
            }
        }
    }
}

/// e^x to a unit in the last place, by the same operations on every processor, and on several numbers side by side:
/// e^x = 2ᵏ e^r with |r| ≤ ½ ln 2, and e^r by its series to the 13th power.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    /// ln 2 in two parts, the first of them short enough for k times it to be exact.
    const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    /// 1.5 · 2⁵²: adding it rounds a number to an integer in its last bits.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    const REST: [f64; 12] = {
        let (mut table, mut factorial, mut k) = ([0.0; 12], 1.0, 2);
        while k < 14 {
            factorial *= k as f64;
            table[k - 2] = 1.0 / factorial;
            k += 1;
        }
        table
    };
    // Beyond these limits the result is 0 or overflows. NaN stays NaN.
    let x = if x < -708.0 { -708.0 } else { x };
    let x = if x > 709.0 { 709.0 } else { x };
    let shifted = x * std::f64::consts::LOG2_E + WHOLE;
    let k = shifted - WHOLE;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let mut sum = REST[11];
    let mut power = 11;
    while power > 0 {
        power -= 1;
        sum = sum * r + REST[power];
    }
    // 1 + (r + r² (…))
    let near = 1.0 + (r + r * r * sum);
    near * f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52))
}

impl Friction {
    /// Friction while sliding steadily at `velocity`; at zero, the limit from above. Not for a body at rest.
    ///
    /// ```
    /// use taut::friction::{Friction, Law, Shape};
    /// let law = Law::Stribeck { velocity: 0.01, shape: Shape::Gaussian };
    /// let friction = Friction::with_breakaway(19.0, 0.2, 0.3).following(law);
    /// assert_eq!(friction.sliding(0.0), 0.3);
    /// assert!((friction.sliding(-0.5) + 19.0 * 0.5 + 0.2).abs() < 1e-12);
    /// ```
    pub fn sliding(&self, velocity: f64) -> f64 {
        let forward = velocity >= 0.0;
        let side = self.side(forward);
        let sign = if forward { 1.0 } else { -1.0 };
        side.viscous * velocity + self.dry(forward, sign * velocity) * sign
    }

    /// Dry friction, without the viscous part, at the speed `v` ≥ 0 in the given direction.
    #[inline(always)]
    pub fn dry(&self, forward: bool, v: f64) -> f64 {
        self.dry_at(forward, [v])[0]
    }

    /// Dry friction at several speeds.
    #[inline(always)]
    pub(crate) fn dry_at<const N: usize>(&self, forward: bool, v: [f64; N]) -> [f64; N] {
        let side = self.side(forward);
        let (coulomb, above) = (side.coulomb, side.breakaway - side.coulomb);
        // Written in place, so that the compiler can vectorise it.
        let mut dry = [coulomb; N];
        match self.law {
            Law::Coulomb => {}
            // F_c + F_s e^{−F_τ v²}                                              (14)
            Law::Stribeck { velocity, shape: Shape::Gaussian } | Law::LuGre { velocity, .. } => {
                // For bristles: their force in steady sliding, g(v).
                dry.iter_mut().zip(v).for_each(|(dry, v)| *dry += above * Shape::Gaussian.share(v / velocity));
            }
            Law::Stribeck { velocity, shape: Shape::Exponential } => {
                dry.iter_mut().zip(v).for_each(|(dry, v)| *dry += above * Shape::Exponential.share(v / velocity));
            }
            Law::Smooth { breakaway_velocity } => {
                for (dry, v) in dry.iter_mut().zip(v) {
                    let (q, c) = (v / (SQRT_2 * breakaway_velocity), v / (breakaway_velocity / 10.0));
                    *dry = (2.0 * E).sqrt() * above * exp(-q * q) * q + coulomb * c.tanh();
                }
            }
        }
        dry
    }

    /// Derivative of [`Friction::sliding`] with respect to velocity; negative values cause stick-slip.
    pub fn slope(&self, velocity: f64) -> f64 {
        let side = self.side(velocity >= 0.0);
        let above = side.breakaway - side.coulomb;
        let v = velocity.abs();
        side.viscous
            + match self.law {
                Law::Coulomb => 0.0,
                Law::Stribeck { velocity, shape: Shape::Exponential } => -above / velocity * (-v / velocity).exp(),
                Law::Stribeck { velocity, .. } | Law::LuGre { velocity, .. } => {
                    let q = v / velocity;
                    -2.0 * q / velocity * above * (-q * q).exp()
                }
                Law::Smooth { breakaway_velocity } => {
                    let (v_st, v_coul) = (SQRT_2 * breakaway_velocity, breakaway_velocity / 10.0);
                    let q = v / v_st;
                    (2.0 * E).sqrt() * above * (-q * q).exp() * (1.0 - 2.0 * q * q) / v_st
                        + side.coulomb / v_coul / (v / v_coul).cosh().powi(2)
                }
            }
    }

    /// Breakaway of a body at rest in this direction; zero for laws that never stick.
    pub fn breakaway(&self, forward: bool) -> f64 {
        match self.law {
            Law::Coulomb | Law::Stribeck { .. } => self.side(forward).breakaway,
            Law::Smooth { .. } | Law::LuGre { .. } => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAWS: [Law; 5] = [
        Law::Coulomb,
        Law::Stribeck { velocity: 0.02, shape: Shape::Gaussian },
        Law::Stribeck { velocity: 0.02, shape: Shape::Exponential },
        Law::Smooth { breakaway_velocity: 0.01 },
        Law::LuGre { stiffness: 1e5, damping: 300.0, velocity: 0.02 },
    ];

    #[test]
    fn the_exponential_is_right_to_a_unit_in_the_last_place() {
        let mut worst: f64 = 0.0;
        for k in -7_000..7_000 {
            let x = f64::from(k) * 0.1003;
            let want = libm::exp(x);
            worst = worst.max((exp(x) - want).abs() / want);
        }
        assert!(worst < 3e-16, "{worst:e}");
        assert_eq!((exp(0.0), exp(-1e5) < 1e-300, exp(f64::NAN).is_nan()), (1.0, true, true));
    }

    #[test]
    fn slopes_are_those_of_the_curves() {
        for law in LAWS {
            let friction = Friction::with_breakaway(19.0, 0.2, 0.3).following(law);
            for v in [-0.3, -0.012, 0.0007, 0.01, 0.031] {
                let h = 1e-7;
                let slope = (friction.sliding(v + h) - friction.sliding(v - h)) / (2.0 * h);
                assert!((slope - friction.slope(v)).abs() < 1e-4 * slope.abs().max(1.0), "{law:?} at {v}");
            }
        }
    }

    #[test]
    fn all_end_at_coulomb_friction() {
        for law in LAWS {
            let friction = Friction::with_breakaway(0.0, 0.2, 0.3).following(law);
            assert!((friction.sliding(0.5) - 0.2).abs() < 1e-8, "{law:?}");
            assert!((friction.sliding(-0.5) + 0.2).abs() < 1e-8, "{law:?}");
        }
    }

    /// Simscape's words: the breakaway force is reached at the breakaway velocity.
    #[test]
    fn the_smooth_law_peaks_at_its_breakaway_velocity() {
        let friction = Friction::with_breakaway(0.0, 0.2, 0.3).following(Law::Smooth { breakaway_velocity: 0.01 });
        assert!((friction.sliding(0.01) - 0.3).abs() < 1e-8);
        assert!(friction.slope(0.01).abs() < 1e-4);
        assert_eq!(friction.sliding(0.0), 0.0);
    }

    #[test]
    fn decay_and_velocity_are_two_words_for_one_thing() {
        assert!((velocity_of_decay(1e4) - 0.01).abs() < 1e-17);
        assert!((decay_of_velocity(velocity_of_decay(123.0)) - 123.0).abs() < 1e-10);
    }
}
