//! Geometries of two motors and belts that move a cart in a plane: the H-frame, and CoreXY.
//!
//! Coordinates are φ₁, φ₂ of the drive pulleys (left and right; A and B of CoreXY), x of the bridge and y of the cart
//! on it. Idlers have neither inertia nor friction. Rows of A, one a span:
//!
//! ```text
//!  H-frame   φ₁   φ₂    x    y        CoreXY    φ_A  φ_B   x    y
//!  left    (  r         1    1 )      A out   (  r       −1   −1 )
//!  right   (      −r    1   −1 )      A back  ( −r        1    1 )
//!  back    ( −r    r   −2      )      B out   (       r  −1    1 )
//!                                     B back  (      −r   1   −1 )
//! ```
//!
//! A bridge that yaws by ψ has its left end at x − a ψ and its right one at x + a ψ, a being half the distance of the
//! belts. A strand that pulls the cart to the left runs along the bridge to an idler at its left end, so that left has
//! x − a ψ, right x + a ψ, back both; A out and B back, which pull to the right, have x + a ψ, A back and B out x − a
//! ψ.
//!
//! T = ½ J₁ φ̇₁² + ½ J₂ φ̇₂² + ½ (m_bridge + m_cart) ẋ² + ½ m_cart ẏ²: the cart rides along with the bridge.
//! Sollmann, Jouaneh and Lavender, IEEE/ASME Transactions on Mechatronics 15(2), 2010, eq. (12)-(20), for the H-frame.
//!
//! Without strain, r φ₁ = −x − y and r φ₂ = x − y for the H-frame, r φ_A = x + y and r φ_B = x − y for CoreXY.
//! Positions by the drives have the errors r (φ₂ − φ₁)/2 − x = −(s_left + s_right)/2 and −r (φ₁ + φ₂)/2 − y = (s_right
//! − s_left)/2 of the H-frame, r (φ_A ± φ_B)/2 − (x or y) = (s_A out ± s_B out)/2 of CoreXY.

use super::geometry::Lever::{One, Radius};
use super::geometry::{BodyAt, DriveAt, Geometry, Part, SlideAt, SpanAt, drive};
use crate::mechanism::Label;

/// Number of the left drive pulley (A) among the bodies.
pub(crate) const LEFT: usize = 0;
/// Number of the right drive pulley (B).
pub const RIGHT: usize = 1;
/// Number of the bridge.
pub(crate) const BRIDGE: usize = 2;
/// Number of the cart.
pub const CART: usize = 3;
/// Number of bodies with friction of their own.
pub const BODIES: usize = 4;

/// The drives on the left and on the right.
pub(super) const LEFT_DRIVE: DriveAt = drive!("left", LEFT);
pub(super) const RIGHT_DRIVE: DriveAt = drive!("right", RIGHT);

const DRIVES: [DriveAt; 2] = [LEFT_DRIVE, RIGHT_DRIVE];

/// Bodies, with the positions of the pulleys by x and y.
const fn bodies(left: &'static [f64; 2]) -> [BodyAt; BODIES] {
    [
        BodyAt { label: Label { key: "left", name: "left pulley" }, part: Part::DrivePulley, by_slides: left },
        BodyAt {
            label: Label { key: "right", name: "right pulley" },
            part: Part::DrivePulley,
            by_slides: &[1.0, -1.0],
        },
        BodyAt { label: Label { key: "bridge", name: "bridge" }, part: Part::Bridge, by_slides: &[1.0, 0.0] },
        BodyAt { label: Label { key: "cart", name: "cart" }, part: Part::Cart, by_slides: &[0.0, 1.0] },
    ]
}

/// The sliding parts, with their positions by the drives and the errors of these.
const fn slides(by_drives: [&'static [f64]; 2], errors: [&'static [(usize, f64)]; 2]) -> [SlideAt; 2] {
    [bridge(BRIDGE, by_drives[0], errors[0]), cart(CART, by_drives[1], errors[1])]
}

/// The bridge, which is this body.
pub(super) const fn bridge(body: usize, by_drives: &'static [f64], error: &'static [(usize, f64)]) -> SlideAt {
    SlideAt {
        body,
        stop: Label { key: "bridge_stop", name: "bridge's end stop" },
        force_along: Label { key: "bridge_force_along", name: "force along the bridge's travel" },
        force_by_speed: Label { key: "bridge_force_by_speed", name: "force by the bridge's speed" },
        by_drives,
        error,
    }
}

/// The cart on the bridge, which is this body.
pub(super) const fn cart(body: usize, by_drives: &'static [f64], error: &'static [(usize, f64)]) -> SlideAt {
    SlideAt {
        body,
        stop: Label { key: "cart_stop", name: "cart's end stop" },
        force_along: Label { key: "cart_force_along", name: "force along the cart's travel" },
        force_by_speed: Label { key: "cart_force_by_speed", name: "force by the cart's speed" },
        by_drives,
        error,
    }
}

pub(super) static H_FRAME: Geometry = Geometry {
    word: "h-frame",
    name: "H-frame",
    belts: "one belt round both drives",
    drives: &DRIVES,
    bodies: &const { bodies(&[-1.0, -1.0]) },
    spans: &[
        SpanAt {
            label: Label { key: "left_span", name: "left span" },
            column: "left_span",
            arms: &[(LEFT, Radius(1.0)), (BRIDGE, One(1.0)), (CART, One(1.0))],
            on_yaw: -1.0,
            follows: &[(BRIDGE, 1.0), (CART, 1.0)],
            by_others: &[(0, 1.0)],
        },
        SpanAt {
            label: Label { key: "right_span", name: "right span" },
            column: "right_span",
            arms: &[(RIGHT, Radius(-1.0)), (BRIDGE, One(1.0)), (CART, One(-1.0))],
            on_yaw: 1.0,
            follows: &[(BRIDGE, 1.0), (CART, -1.0)],
            by_others: &[(1, 1.0)],
        },
        SpanAt {
            label: Label { key: "back_span", name: "back span" },
            column: "back_span",
            arms: &[(LEFT, Radius(-1.0)), (RIGHT, Radius(1.0)), (BRIDGE, One(-2.0))],
            on_yaw: 0.0,
            follows: &[(BRIDGE, -2.0)],
            by_others: &[(0, -1.0), (1, -1.0)],
        },
    ],
    slides: &const { slides([&[-0.5, 0.5], &[-0.5, -0.5]], [&[(0, -0.5), (1, -0.5)], &[(0, -0.5), (1, 0.5)]]) },
};

pub(super) static CORE_XY: Geometry = Geometry {
    word: "core-xy",
    name: "CoreXY",
    belts: "a belt for each drive",
    drives: &DRIVES,
    bodies: &const { bodies(&[1.0, 1.0]) },
    spans: &[
        SpanAt {
            label: Label { key: "a_out_span", name: "A out span" },
            column: "a_out_span",
            arms: &[(LEFT, Radius(1.0)), (BRIDGE, One(-1.0)), (CART, One(-1.0))],
            on_yaw: -1.0,
            follows: &[(BRIDGE, -1.0), (CART, -1.0)],
            by_others: &[(0, 1.0)],
        },
        SpanAt {
            label: Label { key: "a_back_span", name: "A back span" },
            column: "a_back_span",
            arms: &[(LEFT, Radius(-1.0)), (BRIDGE, One(1.0)), (CART, One(1.0))],
            on_yaw: -1.0,
            follows: &[(BRIDGE, 1.0), (CART, 1.0)],
            by_others: &[(0, -1.0)],
        },
        SpanAt {
            label: Label { key: "b_out_span", name: "B out span" },
            column: "b_out_span",
            arms: &[(RIGHT, Radius(1.0)), (BRIDGE, One(-1.0)), (CART, One(1.0))],
            on_yaw: 1.0,
            follows: &[(BRIDGE, -1.0), (CART, 1.0)],
            by_others: &[(2, 1.0)],
        },
        SpanAt {
            label: Label { key: "b_back_span", name: "B back span" },
            column: "b_back_span",
            arms: &[(RIGHT, Radius(-1.0)), (BRIDGE, One(1.0)), (CART, One(-1.0))],
            on_yaw: 1.0,
            follows: &[(BRIDGE, 1.0), (CART, -1.0)],
            by_others: &[(2, -1.0)],
        },
    ],
    slides: &const { slides([&[0.5, 0.5], &[0.5, -0.5]], [&[(0, 0.5), (2, 0.5)], &[(0, 0.5), (2, -0.5)]]) },
};
