//! Geometry of a gantry with a belt on either side of its bridge, and one along it for the cart: three motors.
//!
//! Coordinates are φ₁, φ₂ of the drive pulleys on the left and on the right, φ₃ of the cart's, x of the bridge and y of
//! the cart on it. The left and right motor are fixed in front; each belt runs from its motor to an idler at the far end
//! and back, and the bridge is clamped to the strand that comes back. The cart's motor is mounted on the left end of the
//! bridge and moves with it, so that its belt is strained by motion of the cart alone, and `bridge.mass` contains it.
//! Idlers have neither inertia nor friction, and the bridge does not yaw. Rows of A, one a span:
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
//! T = ½ J₁ φ̇₁² + ½ J₂ φ̇₂² + ½ J₃ φ̇₃² + ½ (m_bridge + m_cart) ẋ² + ½ m_cart ẏ². A pulley turns about a vertical axis, so
//! that what φ̇₃ stores does not depend on ẋ.
//!
//! With belts without strain r φ₁ = r φ₂ = x and r φ₃ = y. Two drives move the bridge: by the drives it is at the mean of
//! both, r (φ₁ + φ₂)/2 − x = (s_left out + s_right out)/2, and r φ₃ − y = s_cart out. Of five degrees of freedom two are
//! rigid and three elastic, in one of which both pulleys swing against each other while the bridge stands still.

use super::gantry::{LEFT, LEFT_DRIVE, RIGHT, RIGHT_DRIVE, bridge, cart};
use super::geometry::Lever::{One, Radius};
use super::geometry::{BodyAt, DriveAt, Geometry, Lever, Part, SpanAt};
use crate::mechanism::Label;

/// Number of the cart's drive pulley among the bodies.
const CART_PULLEY: usize = 2;
const BRIDGE: usize = 3;
const CART: usize = 4;

const CART_DRIVE: DriveAt = DriveAt {
    label: Label { key: "cart_drive", name: "cart drive" },
    voltage: Label { key: "cart_voltage", name: "cart voltage limit" },
    current: Label { key: "cart_current", name: "cart current limit" },
    current_column: "cart_current",
    pulley: CART_PULLEY,
    gear: Label { key: "cart_gear", name: "cart gear" },
    rotor: Label { key: "cart_rotor", name: "cart rotor" },
    key: "cart_drive.",
    prefix: "cart_",
    input: "cart_input",
};

/// A span: its arms, how its own length follows what slides, and its stretch by those of the spans that run out.
const fn span(
    key: &'static str,
    name: &'static str,
    arms: &'static [(usize, Lever)],
    follows: &'static [(usize, f64)],
    by_others: &'static [(usize, f64)],
) -> SpanAt {
    SpanAt { label: Label { key, name }, column: key, arms, follows, by_others }
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
        span(
            "left_out_span",
            "left out span",
            &[(LEFT, Radius(1.0)), (BRIDGE, One(-1.0))],
            &[(BRIDGE, -1.0)],
            &[(0, 1.0)],
        ),
        span(
            "left_back_span",
            "left back span",
            &[(LEFT, Radius(-1.0)), (BRIDGE, One(1.0))],
            &[(BRIDGE, 1.0)],
            &[(0, -1.0)],
        ),
        span(
            "right_out_span",
            "right out span",
            &[(RIGHT, Radius(1.0)), (BRIDGE, One(-1.0))],
            &[(BRIDGE, -1.0)],
            &[(2, 1.0)],
        ),
        span(
            "right_back_span",
            "right back span",
            &[(RIGHT, Radius(-1.0)), (BRIDGE, One(1.0))],
            &[(BRIDGE, 1.0)],
            &[(2, -1.0)],
        ),
        span(
            "cart_out_span",
            "cart out span",
            &[(CART_PULLEY, Radius(1.0)), (CART, One(-1.0))],
            &[(CART, -1.0)],
            &[(4, 1.0)],
        ),
        span(
            "cart_back_span",
            "cart back span",
            &[(CART_PULLEY, Radius(-1.0)), (CART, One(1.0))],
            &[(CART, 1.0)],
            &[(4, -1.0)],
        ),
    ],
    slides: &[bridge(BRIDGE, &[0.5, 0.5, 0.0], &[(0, 0.5), (2, 0.5)]), cart(CART, &[0.0, 0.0, 1.0], &[(4, 1.0)])],
};
