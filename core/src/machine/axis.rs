//! The geometry of the paper's axis: drive pulley, cart and idler pulley on three spans.
//!
//! Eq. (1)-(3) and (16)-(18) are rows of A, M and the forces:
//!
//! ```text
//!             φ₁   x   φ₃  φ_r
//!  span 1  (  r   −1             )     r φ₁ − x
//!  span 2  (       1   −r        )     x − r φ₃
//!  span 3  ( −r         r        )     r φ₃ − r φ₁
//!  gear    ( −1              1   )     φ_r − φ₁, where it is compliant
//!  travel  (       1             )     x
//! ```

use super::geometry::Lever::{One, Radius};
use super::geometry::{BodyAt, DriveAt, Geometry, Part, SlideAt, SpanAt};
use crate::mechanism::Label;

/// Number of the drive pulley among the bodies.
pub const DRIVE: usize = 0;
/// Number of the cart.
pub const CART: usize = 1;
/// Number of the idler pulley.
pub const IDLER: usize = 2;
/// Number of the rotor, if the gear is compliant.
pub const ROTOR: usize = 3;
/// Number of bodies with friction of their own.
pub const BODIES: usize = 3;
/// Number of spans.
pub const SPANS: usize = 3;

/// Names of the bodies, by their numbers.
pub const LABELS: [Label; BODIES] = [
    Label { key: "drive", name: "drive pulley" },
    Label { key: "cart", name: "cart" },
    Label { key: "idler", name: "idler pulley" },
];

/// The drive pulley is at the positive end: span 1 is l₁ − x long, span 2 l₂ + x.
pub(super) static AXIS: Geometry = Geometry {
    word: "axis",
    name: "axis",
    belts: "one belt",
    drives: &[DriveAt {
        label: Label { key: "motor", name: "motor" },
        voltage: Label { key: "voltage", name: "voltage limit" },
        current: Label { key: "current", name: "current limit" },
        current_column: "motor_current",
        pulley: DRIVE,
        gear: Label { key: "gear", name: "gear" },
        rotor: Label { key: "rotor", name: "rotor" },
        key: "",
        prefix: "",
        input: "input",
    }],
    bodies: &[
        BodyAt { label: LABELS[DRIVE], part: Part::DrivePulley, by_slides: &[1.0] },
        BodyAt { label: LABELS[CART], part: Part::Cart, by_slides: &[1.0] },
        BodyAt { label: LABELS[IDLER], part: Part::IdlerPulley, by_slides: &[1.0] },
    ],
    spans: &[
        SpanAt {
            label: Label { key: "span_1", name: "span 1" },
            column: "span1",
            arms: &[(DRIVE, Radius(1.0)), (CART, One(-1.0))],
            on_yaw: 0.0,
            follows: &[(CART, -1.0)],
            by_others: &[(0, 1.0)],
        },
        SpanAt {
            label: Label { key: "span_2", name: "span 2" },
            column: "span2",
            arms: &[(CART, One(1.0)), (IDLER, Radius(-1.0))],
            on_yaw: 0.0,
            follows: &[(CART, 1.0)],
            by_others: &[(1, 1.0)],
        },
        SpanAt {
            label: Label { key: "span_3", name: "span 3" },
            column: "span3",
            arms: &[(IDLER, Radius(1.0)), (DRIVE, Radius(-1.0))],
            on_yaw: 0.0,
            follows: &[],
            by_others: &[(0, -1.0), (1, -1.0)],
        },
    ],
    slides: &[SlideAt {
        body: CART,
        stop: Label { key: "stop", name: "end stop" },
        force_along: Label { key: "force_along", name: "force along the travel" },
        force_by_speed: Label { key: "force_by_speed", name: "force by speed" },
        by_drives: &[1.0],
        error: &[(0, 1.0)],
    }],
};
