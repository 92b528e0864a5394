//! Geometry of a gantry with a belt on either side of its bridge, and one along it for the cart: three motors.
//!
//! Coordinates are φ₁, φ₂ of the drive pulleys on the left and on the right, φ₃ of the cart's, x of the bridge and y of
//! the cart on it. The left and right motor are fixed in front; each belt runs from its motor to an idler at the far
//! end and back, and the bridge is clamped to the strand that comes back. The cart's motor is mounted on the left end
//! of the bridge and moves with it, so only motion of the cart strains its belt, and `bridge.mass` contains it. Idlers
//! have neither inertia nor friction. Rows of A, one a span, with x − a ψ on the left and x + a ψ on the right for a
//! bridge that yaws:
//!
//! ```text
//!              φ₁   φ₂   φ₃   x    y
//!  left out  (  r             −1      )
//!  left back ( −r              1      )
//!  right out (       r        −1      )
//!  right back(      −r         1      )
//!  cart out  (            r        −1 )
//!  cart back (           −r         1 )
//! ```
//!
//! T = ½ J₁ φ̇₁² + ½ J₂ φ̇₂² + ½ J₃ φ̇₃² + ½ (m_bridge + m_cart) ẋ² + ½ m_cart ẏ². A pulley turns about a vertical
//! axis, so the energy of φ̇₃ does not depend on ẋ.
//!
//! With belts without strain r φ₁ = r φ₂ = x and r φ₃ = y. Two drives move the bridge; its position by the drives is
//! their mean, r (φ₁ + φ₂)/2 − x = (s_left out + s_right out)/2, and r φ₃ − y = s_cart out. Of five degrees of freedom,
//! two are rigid and three elastic; in one of these both pulleys oscillate in opposite directions while the bridge is
//! at rest.

use super::gantry::{LEFT, LEFT_DRIVE, RIGHT, RIGHT_DRIVE, bridge, cart};
use super::geometry::Lever::{One, Radius};
use super::geometry::{BodyAt, DriveAt, Geometry, Part, SpanAt, drive};
use crate::mechanism::Label;

/// Number of the cart's drive pulley among the bodies.
const CART_PULLEY: usize = 2;
const BRIDGE: usize = 3;
const CART: usize = 4;

const CART_DRIVE: DriveAt = drive!("cart", CART_PULLEY);

/// A span of the belt on this side, between its drive pulley and the slide. `sign` is 1 if forward motion of the pulley
/// stretches it; `out` is the number of the outgoing span.
macro_rules! span {
    ($side:literal, $way:literal, ($pulley:expr, $slide:expr), sign = $sign:literal, yaw = $yaw:literal, out = $out:literal) => {
        SpanAt {
            label: Label { key: concat!($side, "_", $way, "_span"), name: concat!($side, " ", $way, " span") },
            column: concat!($side, "_", $way, "_span"),
            arms: &[($pulley, Radius($sign)), ($slide, One(-$sign))],
            on_yaw: $yaw,
            follows: &[($slide, -$sign)],
            by_others: &[($out, $sign)],
        }
    };
}

pub(super) static DUAL_BELT: Geometry = Geometry {
    word: "dual-belt",
    name: "Dual belt",
    belts: "a belt on either side of the bridge and one along it",
    drives: &[LEFT_DRIVE, RIGHT_DRIVE, CART_DRIVE],
    bodies: &[
        BodyAt { label: Label { key: "left", name: "left pulley" }, part: Part::DrivePulley, by_slides: &[1.0, 0.0] },
        BodyAt { label: Label { key: "right", name: "right pulley" }, part: Part::DrivePulley, by_slides: &[1.0, 0.0] },
        BodyAt {
            label: Label { key: "cart_pulley", name: "cart pulley" },
            part: Part::DrivePulley,
            by_slides: &[0.0, 1.0],
        },
        BodyAt { label: Label { key: "bridge", name: "bridge" }, part: Part::Bridge, by_slides: &[1.0, 0.0] },
        BodyAt { label: Label { key: "cart", name: "cart" }, part: Part::Cart, by_slides: &[0.0, 1.0] },
    ],
    spans: &[
        span!("left", "out", (LEFT, BRIDGE), sign = 1.0, yaw = 1.0, out = 0),
        span!("left", "back", (LEFT, BRIDGE), sign = -1.0, yaw = -1.0, out = 0),
        span!("right", "out", (RIGHT, BRIDGE), sign = 1.0, yaw = -1.0, out = 2),
        span!("right", "back", (RIGHT, BRIDGE), sign = -1.0, yaw = 1.0, out = 2),
        span!("cart", "out", (CART_PULLEY, CART), sign = 1.0, yaw = 0.0, out = 4),
        span!("cart", "back", (CART_PULLEY, CART), sign = -1.0, yaw = 0.0, out = 4),
    ],
    slides: &[bridge(BRIDGE, &[0.5, 0.5, 0.0], &[(0, 0.5), (2, 0.5)]), cart(CART, &[0.0, 0.0, 1.0], &[(4, 1.0)])],
};
