//! The paper's axis as a mechanism: drive pulley, cart and idler pulley on three spans.
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

use super::{BeltModel, EncoderPlace, Machine};
use crate::friction::Law;
use crate::mechanism::{
    Body, Drive, Follows, Heading, Kind, Label, Mechanism, Over, Roles, Shown, Spring, SpringLaw, State,
};

/// Number of the drive pulley among the bodies.
pub const DRIVE: usize = 0;
/// Number of the cart.
pub const CART: usize = 1;
/// Number of the idler pulley.
pub const IDLER: usize = 2;
/// Number of the rotor, where the gear is compliant.
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

/// Keys of a span's slack and its number.
const SPAN_LABELS: [Label; SPANS] = [
    Label { key: "span_1", name: "span 1" },
    Label { key: "span_2", name: "span 2" },
    Label { key: "span_3", name: "span 3" },
];

/// Keys of the columns of forces that are lines, and what they are.
const LINE_LABELS: [Label; 2] = [
    Label { key: "force_along", name: "force along the travel" },
    Label { key: "force_by_speed", name: "force by speed" },
];

impl Machine {
    /// Its bodies, springs and drive.
    pub fn mechanism(&self) -> Mechanism {
        let mut springs = self.spans();
        springs.extend(self.gear());
        springs.extend(self.lines());
        springs.push(self.way());
        let shaft = if self.motor.gear_play.is_some() { ROTOR } else { DRIVE };
        let drive = Drive {
            label: Label { key: "motor", name: "motor" },
            voltage: Label { key: "voltage", name: "voltage limit" },
            current: Label { key: "current", name: "current limit" },
            pulley: DRIVE,
            shaft,
            motor: self.motor,
            amplifier: self.amplifier,
        };
        let mut mechanism = Mechanism::new(self.bodies(), springs, vec![drive]);
        mechanism.roles = Roles { loads: vec![CART], spans: (0..SPANS).collect() };
        mechanism.readings = self.readings(&mechanism);
        mechanism.columns = self.columns(&mechanism);
        mechanism
    }

    fn bodies(&self) -> Vec<Body> {
        let r = self.pulley_radius;
        let turns = Kind::Rotary { radius: r };
        let leader = |body: usize| match (self.belt.model, body) {
            (BeltModel::TwoMass, IDLER) => (DRIVE, 1.0),
            // x = r φ
            (BeltModel::Rigid, DRIVE | IDLER) => (CART, 1.0 / r),
            _ => (body, 1.0),
        };
        let body = |index: usize, kind, inertia, friction| Body {
            label: LABELS[index],
            kind,
            inertia,
            friction,
            force: 0.0,
            along: None,
            leader: leader(index),
            is_rotor: false,
        };
        let mut bodies = vec![
            body(DRIVE, turns, self.drive_pulley.inertia, self.drive_pulley.friction),
            Body {
                force: self.cart.constant_force(),
                along: self.cart.along.clone(),
                ..body(CART, Kind::Linear, self.cart.mass, self.cart.friction)
            },
            body(IDLER, turns, self.idler_pulley.inertia, self.idler_pulley.friction),
        ];
        if self.motor.gear_play.is_some() {
            bodies.push(Body {
                label: Label { key: "rotor", name: "rotor" },
                kind: turns,
                // n² J_r: seen from behind the gear
                inertia: self.motor.gear_ratio * self.motor.gear_ratio * self.motor.rotor_inertia,
                friction: Default::default(),
                force: 0.0,
                along: None,
                leader: (ROTOR, 1.0),
                is_rotor: true,
            });
        }
        bodies
    }

    fn spans(&self) -> Vec<Spring> {
        let r = self.pulley_radius;
        let arms = [[(DRIVE, r), (CART, -1.0)], [(CART, 1.0), (IDLER, -r)], [(IDLER, r), (DRIVE, -r)]];
        let [mut k, mut c] = [self.belt.stiffness, self.belt.damping];
        if self.belt.model == BeltModel::TwoMass {
            // Spans 2 and 3 in series, the idler pulley between them without inertia or friction of its own:
            // 1/k₂₃ = 1/k₂ + 1/k₃ and, for slow motion, c₂₃ = (c₂ k₃² + c₃ k₂²)/(k₂ + k₃)²
            let sum = k[1] + k[2];
            c[1] = (c[1] * k[2] * k[2] + c[2] * k[1] * k[1]) / (sum * sum);
            k[1] = k[1] * k[2] / sum;
        }
        let law = self.belt.pretension.map_or(SpringLaw::TwoSided, |pretension| SpringLaw::Tension { pretension });
        let span = |index: usize| {
            let there = self.span_alike(index) == Some(index);
            Spring {
                label: SPAN_LABELS[index],
                arms: arms[index].to_vec(),
                stiffness: if there { k[index] } else { 0.0 },
                damping: if there { c[index] } else { 0.0 },
                law: if there { law.clone() } else { SpringLaw::None },
                follows: self.follows(index),
            }
        };
        (0..SPANS).map(span).collect()
    }

    /// The span that span `index` does alike, if any: itself, but span 3 of a two-mass model carries what span 2 does.
    pub fn span_alike(&self, index: usize) -> Option<usize> {
        match (self.belt.model, index) {
            (BeltModel::Rigid, _) => None,
            (BeltModel::TwoMass, 2) => Some(1),
            _ => Some(index),
        }
    }

    /// How a span's length follows the cart: l₁ − x, l₂ + x; the drive pulley is at the positive end. Spans 2 and 3 in
    /// series are one of their lengths together; their damping stays as it is at x = 0.
    fn follows(&self, index: usize) -> Option<Follows> {
        let mut make = self.belt.make.filter(|_| self.belt.follows_cart)?;
        match self.belt.model {
            BeltModel::Elastic => {}
            BeltModel::TwoMass => make.spans[1] += make.spans[2],
            BeltModel::Rigid => return None,
        }
        let arm = [-1.0, 1.0, 0.0][index];
        let follows =
            Follows { rigidity: make.section * make.modulus, length: make.spans[index], arms: vec![(CART, arm)] };
        (arm != 0.0).then_some(follows)
    }

    /// A compliant gear.
    fn gear(&self) -> Option<Spring> {
        let play = self.motor.gear_play?;
        let half = 0.5 * play.backlash;
        Some(Spring {
            label: Label { key: "gear", name: "gear" },
            arms: vec![(DRIVE, -1.0), (ROTOR, 1.0)],
            stiffness: play.stiffness,
            damping: play.damping,
            // Without play the flanks never part.
            law: if half == 0.0 { SpringLaw::TwoSided } else { SpringLaw::Gap { low: -half, high: half } },
            follows: None,
        })
    }

    /// Forces on the cart that are lines.
    fn lines(&self) -> impl Iterator<Item = Spring> {
        let forces = &self.cart.forces;
        let [along, by_speed] = LINE_LABELS;
        let lines = [(along, Over::Length, &forces.along), (by_speed, Over::Rate, &forces.by_speed)];
        lines.into_iter().filter_map(|(label, over, line)| {
            // A spring pulls the cart back.
            let line = line.as_ref()?.scaled(-1.0);
            let law = SpringLaw::Line { over, line };
            Some(Spring { label, arms: vec![(CART, 1.0)], stiffness: 0.0, damping: 0.0, law, follows: None })
        })
    }

    /// Where the cart is, and what stands at the ends of its travel.
    fn way(&self) -> Spring {
        let stop = self.travel.and_then(|travel| travel.stop);
        let (stiffness, damping) = stop.map_or((0.0, 0.0), |stop| (stop.stiffness, stop.damping));
        let law = match self.travel {
            None => SpringLaw::None,
            Some(travel) if stop.is_some() => SpringLaw::Gap { low: travel.min, high: travel.max },
            Some(travel) => SpringLaw::Bounds { low: travel.min, high: travel.max },
        };
        let label = Label { key: "stop", name: "end stop" };
        Spring { label, arms: vec![(CART, 1.0)], stiffness, damping, law, follows: None }
    }

    /// In the order of [`crate::solve::reading`].
    fn readings(&self, mechanism: &Mechanism) -> Vec<Shown> {
        let shaft = mechanism.drives[0].shaft;
        let mut readings = vec![Shown::Speed(CART, 1.0), Shown::Speed(DRIVE, self.pulley_radius)];
        readings.extend((0..SPANS).map(Shown::Stretch));
        readings.extend((0..SPANS).map(|span| Shown::Force(self.span_alike(span).unwrap_or(span), 1.0)));
        readings.extend([Shown::Current(0), Shown::Speed(shaft, 1.0), Shown::Voltage(0), Shown::Position(CART, 1.0)]);
        readings
    }

    fn columns(&self, mechanism: &Mechanism) -> Vec<Heading> {
        let mut columns = Vec::new();
        let mut add =
            |name: &'static str, unit, shown, lean| columns.push(Heading { name: name.into(), unit, shown, lean });
        add("time", "s", Shown::Time, true);
        add("voltage", "V", Shown::Voltage(0), true);
        const WAYS: [[&str; 2]; BODIES] =
            [["drive_angle", "drive_speed"], ["cart_position", "cart_speed"], ["idler_angle", "idler_speed"]];
        for (body, [way, speed]) in WAYS.into_iter().enumerate() {
            let [of_way, of_speed, _] = mechanism.bodies[body].kind.units();
            add(way, of_way, Shown::Position(body, 1.0), true);
            add(speed, of_speed, Shown::Speed(body, 1.0), true);
        }
        add("motor_current", "A", Shown::Current(0), true);
        for (span, name) in ["span1_force", "span2_force", "span3_force"].into_iter().enumerate() {
            add(name, "N", Shown::Force(self.span_alike(span).unwrap_or(span), 1.0), true);
        }
        for (body, name) in ["drive_friction", "cart_friction", "idler_friction"].into_iter().enumerate() {
            add(name, mechanism.bodies[body].kind.units()[2], Shown::Friction(body), false);
        }
        for (body, name) in ["drive_state", "cart_state", "idler_state"].into_iter().enumerate() {
            add(name, "", Shown::Motion(body), true);
        }
        if mechanism.drives[0].shows_input() {
            add("input", self.amplifier.mode.unit(), Shown::Input(0), true);
        }
        let (gear, way) = (SPANS, mechanism.springs.len() - 1);
        if self.motor.gear_play.is_some() {
            add("rotor_angle", "rad", Shown::Position(ROTOR, 1.0), false);
            add("rotor_speed", "rad/s", Shown::Speed(ROTOR, 1.0), false);
            add("gear_torque", "N m", Shown::Force(gear, 1.0), false);
            add("gear_state", "", Shown::Contact(gear), false);
        }
        if self.belt.pretension.is_some() {
            for (span, name) in ["span1_slack", "span2_slack", "span3_slack"].into_iter().enumerate() {
                add(name, "", Shown::Contact(self.span_alike(span).unwrap_or(span)), false);
            }
        }
        if self.travel.is_some_and(|travel| travel.stop.is_some()) {
            add("stop_force", "N", Shown::Force(way, -1.0), false);
        }
        for (index, spring) in mechanism.springs.iter().enumerate() {
            if let SpringLaw::Line { .. } = spring.law {
                add(spring.label.key, "N", Shown::Force(index, -1.0), false);
            }
        }
        if let Some(encoder) = self.encoder {
            let body = match encoder.at {
                EncoderPlace::Motor => mechanism.drives[0].shaft,
                EncoderPlace::DrivePulley => DRIVE,
                EncoderPlace::Cart => CART,
            };
            let counts = encoder.counts_per_unit(self.motor.gear_ratio);
            add("encoder_count", "", Shown::Counts(body, counts), false);
        }
        if let Some(scale) = self.scale {
            add("scale_count", "", Shown::Counts(CART, scale.counts_per_unit(self.motor.gear_ratio)), false);
        }
        for (body, name) in ["drive_bristle", "cart_bristle", "idler_bristle"].into_iter().enumerate() {
            if matches!(mechanism.bodies[body].friction.law, Law::LuGre { .. }) {
                add(name, mechanism.bodies[body].kind.units()[0], Shown::Bristle(body), false);
            }
        }
        columns
    }

    /// The state at rest with the cart at `x`, m, and the belt without strain.
    pub fn at_rest(&self, x: f64) -> State {
        let angle = x / self.pulley_radius;
        let mut state = State::default();
        state.position[..4].copy_from_slice(&[angle, x, angle, angle]);
        state
    }
}
