//! H-frame and CoreXY as the independent solver wants them: their rows of lever arms, written from the paper.
//!
//! H-frame: ½ k_l (r φ₁ + x + y)² + ½ k_r (−r φ₂ + x − y)² + ½ k_b (−r φ₁ + r φ₂ − 2 x)² (Sollmann, Jouaneh and
//! Lavender 2010, eq. (13)). CoreXY: belt A is let out by φ_A on one side of its motor and taken in on the other, where
//! the cart goes by x + y; belt B by x − y.

use crate::double::Double;
use crate::machine::{
    BODIES, CURRENT, Follows, Friction, Model, ROTOR, SPEED, STATES, Span, Taken, WAY, drive, ends, friction, is_strain,
};
use taut::case::Experiment;
use taut::machine::{Kind, Machine};

/// Elongation of a span by r φ₁, r φ₂, x, y, and the change of its length with x, y.
type Row = ([f64; BODIES], [f64; 2]);

/// Left, right, back.
const H_FRAME: [Row; 3] =
    [([1.0, 0.0, 1.0, 1.0], [1.0, 1.0]), ([0.0, -1.0, 1.0, -1.0], [1.0, -1.0]), ([-1.0, 1.0, -2.0, 0.0], [-2.0, 0.0])];

/// A out, A back, B out, B back.
const CORE_XY: [Row; 4] = [
    ([1.0, 0.0, -1.0, -1.0], [-1.0, -1.0]),
    ([-1.0, 0.0, 1.0, 1.0], [1.0, 1.0]),
    ([0.0, 1.0, -1.0, 1.0], [-1.0, 1.0]),
    ([0.0, -1.0, 1.0, -1.0], [1.0, -1.0]),
];

/// Changes of r φ₁ and r φ₂ with x and with y where no span is strained.
fn pulleys(kind: Kind) -> [[f64; 2]; 2] {
    match kind {
        // r φ₁ = −x − y, r φ₂ = x − y
        Kind::HFrame => [[-1.0, 1.0], [-1.0, -1.0]],
        // r φ_A = x + y, r φ_B = x − y
        Kind::CoreXy => [[1.0, 1.0], [1.0, -1.0]],
        Kind::Axis => panic!("an axis has one drive"),
    }
}

/// The gantry at the start of `experiment`; every number passes `taken` once.
pub fn machine(gantry: &Machine, experiment: &Experiment, taken: Taken) -> Model {
    let r = taken(gantry.pulley_radius);
    let initial = &experiment.initial;
    let [x, y] = [2, 3].map(|body| Double::from(initial.position[body]));
    let [of_x, of_y] = pulleys(gantry.kind);
    let origin = [x * of_x[0] + y * of_y[0], x * of_x[1] + y * of_y[1], x, y];
    let rows: &[Row] = match gantry.kind {
        Kind::HFrame => &H_FRAME,
        Kind::CoreXy => &CORE_XY,
        Kind::Axis => panic!("an axis has one drive"),
    };
    let follows = gantry
        .belt
        .following()
        .map(|make| (taken(make.rigidity()), make.spans.iter().map(|&length| taken(length)).collect::<Vec<_>>()));
    let mut spans = Vec::new();
    for (j, &(arms, [a, b])) in rows.iter().enumerate() {
        let follows = follows.as_ref().map(|(rigidity, lengths)| Follows {
            rigidity: *rigidity,
            length: lengths[j] + x * a + y * b,
            of: [0.0, 0.0, a, b],
        });
        let (stiffness, damping) = (taken(gantry.belt.stiffness[j]), taken(gantry.belt.damping[j]));
        spans.push(Span { arms, stiffness, damping, follows });
    }
    let cart = taken(gantry.cart.mass);
    let pulley = taken(gantry.drive_pulley.inertia) / (r * r);
    let own: Friction = friction(&gantry.drive_pulley.friction, taken, r);
    let slides = [gantry.first_slide(), &gantry.cart];
    let [of_bridge, of_cart] = slides.map(|slide| friction(&slide.friction, taken, Double::ONE));
    let [end_x, end_y] = [0, 1].map(|i| slides[i].travel.map(|travel| ends(travel, taken, if i == 0 { x } else { y })));
    let mut z = [Double::ZERO; STATES];
    let mut beyond = [Double::ZERO; BODIES];
    for body in 0..2 {
        let strain = Double::from(gantry.pulley_radius) * initial.position[body] - origin[body];
        match is_strain(strain, origin[body].abs() + x.abs() + y.abs()) {
            true => z[WAY[body]] = strain * taken(1.0),
            false => beyond[body] = strain,
        }
        z[SPEED[body]] = taken(initial.speed[body]) * r;
        z[SPEED[2 + body]] = taken(initial.speed[2 + body]);
        z[CURRENT[body]] = taken(initial.current[body]);
        (z[ROTOR[body][0]], z[ROTOR[body][1]]) = (z[WAY[body]], z[SPEED[body]]);
    }
    Model {
        bodies: 4,
        leader: [0, 1, 2, 3],
        // The cart rides along with the bridge.
        mass: [pulley, pulley, taken(gantry.first_slide().mass) + cart, cart],
        friction: [own, own, of_bridge, of_cart],
        along: None,
        spans,
        pretension: gantry.belt.pretension.map(&mut *taken),
        force: Double::ZERO,
        lines: [None, None],
        ends: [None, None, end_x, end_y],
        drives: (0..2).map(|i| drive(i, &gantry.drives[i].motor, &gantry.drives[i].amplifier, taken, r)).collect(),
        start: z,
        beyond,
        origin,
        lever: [r, r, Double::ONE, Double::ONE],
        place: vec![(2, [of_x[0], of_x[1], 1.0, 0.0]), (3, [of_y[0], of_y[1], 0.0, 1.0])],
        delayed: 0.0,
    }
}
