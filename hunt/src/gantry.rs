//! H-frame, CoreXY and dual belt for the independent solver: their rows of lever arms, written from the paper.
//!
//! H-frame: ½ k_l (r φ₁ + x + y)² + ½ k_r (−r φ₂ + x − y)² + ½ k_b (−r φ₁ + r φ₂ − 2 x)² (Sollmann, Jouaneh and
//! Lavender 2010, eq. (13)). CoreXY: belt A is let out by φ_A on one side of its motor and taken in on the other, where
//! the cart goes by x + y; belt B by x − y. The belts on the sides of a dual belt go by x alone,
//! that along its bridge by y.

use crate::double::Double;
use crate::machine::{
    BODIES, CURRENT, Follows, Friction, Model, ROTOR, SPEED, STATES, Span, Taken, WAY, drive, ends, friction, is_strain,
};
use taut::case::Experiment;
use taut::machine::{Machine, MachineKind};

/// Elongation of a span by r φ₁, r φ₂, x, y, and the change of its length with x, y.
type Row = ([f64; BODIES], [f64; 2]);

/// Left, right, back.
const H_FRAME: [Row; 3] = [
    ([1.0, 0.0, 1.0, 1.0, 0.0], [1.0, 1.0]),
    ([0.0, -1.0, 1.0, -1.0, 0.0], [1.0, -1.0]),
    ([-1.0, 1.0, -2.0, 0.0, 0.0], [-2.0, 0.0]),
];

/// A out, A back, B out, B back.
const CORE_XY: [Row; 4] = [
    ([1.0, 0.0, -1.0, -1.0, 0.0], [-1.0, -1.0]),
    ([-1.0, 0.0, 1.0, 1.0, 0.0], [1.0, 1.0]),
    ([0.0, 1.0, -1.0, 1.0, 0.0], [-1.0, 1.0]),
    ([0.0, -1.0, 1.0, -1.0, 0.0], [1.0, -1.0]),
];

/// Left out, left back, right out, right back, cart out, cart back; the third pulley is the cart's.
const DUAL_BELT: [Row; 6] = [
    ([1.0, 0.0, 0.0, -1.0, 0.0], [-1.0, 0.0]),
    ([-1.0, 0.0, 0.0, 1.0, 0.0], [1.0, 0.0]),
    ([0.0, 1.0, 0.0, -1.0, 0.0], [-1.0, 0.0]),
    ([0.0, -1.0, 0.0, 1.0, 0.0], [1.0, 0.0]),
    ([0.0, 0.0, 1.0, 0.0, -1.0], [0.0, -1.0]),
    ([0.0, 0.0, -1.0, 0.0, 1.0], [0.0, 1.0]),
];

/// The spans, and the changes of r φ of each pulley with x and with y where no span is strained.
fn frame(kind: MachineKind) -> (&'static [Row], &'static [[f64; 2]]) {
    match kind {
        // r φ₁ = −x − y, r φ₂ = x − y
        MachineKind::HFrame => (&H_FRAME, &[[-1.0, -1.0], [1.0, -1.0]]),
        // r φ_A = x + y, r φ_B = x − y
        MachineKind::CoreXy => (&CORE_XY, &[[1.0, 1.0], [1.0, -1.0]]),
        // r φ₁ = r φ₂ = x, r φ₃ = y
        MachineKind::DualBelt => (&DUAL_BELT, &[[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        MachineKind::Axis => panic!("an axis has one drive"),
    }
}

/// The gantry at the start of `experiment`; every number passes `taken` once.
pub fn machine(gantry: &Machine, experiment: &Experiment, taken: Taken) -> Model {
    let r = taken(gantry.pulley_radius);
    let initial = &experiment.initial;
    let (rows, pulleys) = frame(gantry.kind);
    // Bridge and cart are the bodies behind the pulleys.
    let (bridge_body, cart_body) = (pulleys.len(), pulleys.len() + 1);
    let [x, y] = [bridge_body, cart_body].map(|body| Double::from(initial.position[body]));
    let mut origin = [Double::ZERO; BODIES];
    for (origin, [of_x, of_y]) in origin.iter_mut().zip(pulleys) {
        *origin = x * *of_x + y * *of_y;
    }
    (origin[bridge_body], origin[cart_body]) = (x, y);
    let follows = gantry
        .belt
        .following()
        .map(|make| (taken(make.rigidity()), make.spans.iter().map(|&length| taken(length)).collect::<Vec<_>>()));
    let mut spans = Vec::new();
    for (j, &(arms, [a, b])) in rows.iter().enumerate() {
        let follows = follows.as_ref().map(|(rigidity, lengths)| Follows {
            rigidity: *rigidity,
            length: lengths[j] + x * a + y * b,
            of: std::array::from_fn(|body| match body {
                body if body == bridge_body => a,
                body if body == cart_body => b,
                _ => 0.0,
            }),
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
    for body in 0..pulleys.len() {
        let strain = Double::from(gantry.pulley_radius) * initial.position[body] - origin[body];
        match is_strain(strain, origin[body].abs() + x.abs() + y.abs()) {
            true => z[WAY[body]] = strain * taken(1.0),
            false => beyond[body] = strain,
        }
        z[SPEED[body]] = taken(initial.speed[body]) * r;
        z[CURRENT[body]] = taken(initial.current[body]);
        (z[ROTOR[body][0]], z[ROTOR[body][1]]) = (z[WAY[body]], z[SPEED[body]]);
    }
    for body in [bridge_body, cart_body] {
        z[SPEED[body]] = taken(initial.speed[body]);
    }
    // What the pulleys have in common, and then bridge and cart.
    let bridge = taken(gantry.first_slide().mass) + cart;
    let (mut mass, mut frictions, mut lever) = ([pulley; BODIES], [own; BODIES], [r; BODIES]);
    // The cart rides along with the bridge.
    (mass[bridge_body], mass[cart_body]) = (bridge, cart);
    (frictions[bridge_body], frictions[cart_body]) = (of_bridge, of_cart);
    (lever[bridge_body], lever[cart_body]) = (Double::ONE, Double::ONE);
    let mut travels = [None; BODIES];
    (travels[bridge_body], travels[cart_body]) = (end_x, end_y);
    // Changes of all positions with x, and with y.
    let with = |number: usize, own: usize| {
        let mut all = [0.0; BODIES];
        all.iter_mut().zip(pulleys).for_each(|(all, of)| *all = of[number]);
        all[own] = 1.0;
        all
    };
    Model {
        bodies: pulleys.len() + 2,
        leader: std::array::from_fn(|body| body),
        mass,
        friction: frictions,
        along: None,
        spans,
        pretension: gantry.belt.pretension.map(&mut *taken),
        force: Double::ZERO,
        lines: [None, None],
        ends: travels,
        drives: (0..pulleys.len())
            .map(|i| drive(i, &gantry.drives[i].motor, &gantry.drives[i].amplifier, taken, r))
            .collect(),
        start: z,
        beyond,
        origin,
        lever,
        place: vec![(bridge_body, with(0, bridge_body)), (cart_body, with(1, cart_body))],
        delayed: 0.0,
    }
}
