//! Two motors and belts that move a cart in a plane: the H-frame, and CoreXY, as mechanisms.
//!
//! Coordinates are φ₁, φ₂ of the drive pulleys (left and right; A and B of CoreXY), x of the bridge and y of the cart
//! on it. Idlers have neither inertia nor friction, and the bridge does not yaw. Rows of A, one a span:
//!
//! ```text
//!  H-frame   φ₁   φ₂    x    y        CoreXY    φ_A  φ_B   x    y
//!  left    (  r         1    1 )      A out   (  r       −1   −1 )
//!  right   (      −r    1   −1 )      A back  ( −r        1    1 )
//!  back    ( −r    r   −2      )      B out   (       r  −1    1 )
//!                                     B back  (      −r   1   −1 )
//! ```
//!
//! T = ½ J₁ φ̇₁² + ½ J₂ φ̇₂² + ½ (m_bridge + m_cart) ẋ² + ½ m_cart ẏ²: the cart rides along with the bridge.
//! Sollmann, Jouaneh and Lavender, IEEE/ASME Transactions on Mechatronics 15(2), 2010, eq. (12)-(20), for the H-frame.

use super::{BeltSheet, Encoder, EncoderPlace, Pulley, Travel};
use crate::error::{Error, Result};
use crate::friction::{Friction, Law};
use crate::mechanism::{
    Amplifier, Body, Drive, Follows, Heading, Kind, Label, Mechanism, Motor, Roles, Shown, Spring, SpringLaw,
};

/// Number of the left drive pulley (A) among the bodies.
pub const LEFT: usize = 0;
/// Number of the right drive pulley (B).
pub const RIGHT: usize = 1;
/// Number of the bridge.
pub const BRIDGE: usize = 2;
/// Number of the cart.
pub const CART: usize = 3;
/// Number of bodies with friction of their own.
pub const BODIES: usize = 4;

/// Names of the bodies, by their numbers.
pub const LABELS: [Label; BODIES] = [
    Label { key: "left", name: "left pulley" },
    Label { key: "right", name: "right pulley" },
    Label { key: "bridge", name: "bridge" },
    Label { key: "cart", name: "cart" },
];

/// How the belts run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Routing {
    /// One belt round both drive pulleys.
    HFrame,
    /// Two belts, one for each drive pulley.
    CoreXy,
}

impl Routing {
    /// As in the case file.
    pub fn word(self) -> &'static str {
        match self {
            Routing::HFrame => "h-frame",
            Routing::CoreXy => "core-xy",
        }
    }

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Routing::HFrame => "H-frame",
            Routing::CoreXy => "CoreXY",
        }
    }

    /// Names of its spans: in keys, and for people.
    pub fn spans(self) -> &'static [Label] {
        const H_FRAME: [Label; 3] = [
            Label { key: "left_span", name: "left span" },
            Label { key: "right_span", name: "right span" },
            Label { key: "back_span", name: "back span" },
        ];
        const CORE_XY: [Label; 4] = [
            Label { key: "a_out_span", name: "A out span" },
            Label { key: "a_back_span", name: "A back span" },
            Label { key: "b_out_span", name: "B out span" },
            Label { key: "b_back_span", name: "B back span" },
        ];
        match self {
            Routing::HFrame => &H_FRAME,
            Routing::CoreXy => &CORE_XY,
        }
    }

    /// The place of bridge and cart by the drives minus the true one, each as a sum of stretches of spans, (span,
    /// weight): r (φ₂ − φ₁)/2 − x = −(s_left + s_right)/2 and −r (φ₁ + φ₂)/2 − y = (s_right − s_left)/2 of the H-frame,
    /// r (φ_A ± φ_B)/2 − (x or y) = (s_A out ± s_B out)/2 of CoreXY.
    pub fn drive_error(self) -> [[(usize, f64); 2]; 2] {
        match self {
            Routing::HFrame => [[(0, -0.5), (1, -0.5)], [(0, -0.5), (1, 0.5)]],
            Routing::CoreXy => [[(0, 0.5), (2, 0.5)], [(0, 0.5), (2, -0.5)]],
        }
    }

    /// The stretch of each span as a sum of those two that tell the drives' errors, (span, weight): the spans of one
    /// belt add up to nothing.
    pub fn stretches(self) -> &'static [&'static [(usize, f64)]] {
        match self {
            Routing::HFrame => &[&[(0, 1.0)], &[(1, 1.0)], &[(0, -1.0), (1, -1.0)]],
            Routing::CoreXy => &[&[(0, 1.0)], &[(0, -1.0)], &[(2, 1.0)], &[(2, -1.0)]],
        }
    }

    /// Rows of A for pulleys of radius `r`, and how the spans' lengths change with x and y.
    fn rows(self, r: f64) -> Vec<([f64; BODIES], [f64; 2])> {
        match self {
            Routing::HFrame => vec![
                ([r, 0.0, 1.0, 1.0], [1.0, 1.0]),
                ([0.0, -r, 1.0, -1.0], [1.0, -1.0]),
                ([-r, r, -2.0, 0.0], [-2.0, 0.0]),
            ],
            Routing::CoreXy => vec![
                ([r, 0.0, -1.0, -1.0], [-1.0, -1.0]),
                ([-r, 0.0, 1.0, 1.0], [1.0, 1.0]),
                ([0.0, r, -1.0, 1.0], [-1.0, 1.0]),
                ([0.0, -r, 1.0, -1.0], [1.0, -1.0]),
            ],
        }
    }
}

/// Something that slides: the bridge, or the cart on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Slide {
    /// Mass, kg; of the bridge without the cart.
    pub mass: f64,
    /// Friction force, N over m/s.
    pub friction: Friction,
    /// How far it may go, if that is bounded.
    pub travel: Option<Travel>,
}

/// The spans of a gantry's belts.
#[derive(Debug, Clone, PartialEq)]
pub struct Belts {
    /// Stiffness of each span with bridge and cart at zero, N/m.
    pub stiffness: Vec<f64>,
    /// Damping of each span, N s/m.
    pub damping: Vec<f64>,
    /// Tension of every span at rest, N; none for spans that can push.
    pub pretension: Option<f64>,
    /// The make that the stiffness is computed from, where it is not given.
    pub make: Option<Make>,
    /// E A, N, and the lengths of the spans with bridge and cart at zero, m, where the spans follow them.
    pub follows: Option<(f64, Vec<f64>)>,
    /// The data sheet of the belt.
    pub sheet: BeltSheet,
}

/// Spans by material and lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Make {
    /// Modulus of elasticity E, Pa.
    pub modulus: f64,
    /// Cross-section A that carries the load, m².
    pub section: f64,
    /// Length of each span with bridge and cart at zero, m.
    pub spans: Vec<f64>,
}

impl Make {
    /// k = A E / l of each span, N/m.                                                     (11)
    pub fn stiffness(&self) -> Vec<f64> {
        let rigidity = self.rigidity();
        self.spans.iter().map(|length| rigidity / length).collect()
    }

    /// E A, N.
    pub fn rigidity(&self) -> f64 {
        self.modulus * self.section
    }
}

impl Belts {
    /// Takes up what was changed of the make.
    pub fn follow_make(&mut self) {
        if let Some(make) = &self.make {
            self.stiffness = make.stiffness();
            self.follows = self.follows.take().map(|_| (make.rigidity(), make.spans.clone()));
        }
    }
}

/// A gantry with two drives and a belt, or two.
#[derive(Debug, Clone, PartialEq)]
pub struct Gantry {
    /// How the belts run.
    pub routing: Routing,
    /// Motors of the left and right drive.
    pub motors: [Motor; 2],
    /// The amplifiers that feed them.
    pub amplifiers: [Amplifier; 2],
    /// Pitch radius r of both drive pulleys, m.
    pub pulley_radius: f64,
    /// Each of the drive pulleys.
    pub drive_pulley: Pulley,
    /// The bridge; its position is x.
    pub bridge: Slide,
    /// The cart on it; its position is y.
    pub cart: Slide,
    /// The belts.
    pub belts: Belts,
    /// How each drive's motion is measured, if it is.
    pub encoder: Option<Encoder>,
}

impl Gantry {
    /// The angles of the pulleys with the belt without strain, rad: r φ₁ = −x − y and r φ₂ = x − y of the H-frame, r
    /// φ_A = x + y and r φ_B = x − y of CoreXY.
    pub fn angles(&self, x: f64, y: f64) -> [f64; 2] {
        let r = self.pulley_radius;
        match self.routing {
            Routing::HFrame => [-(x + y) / r, (x - y) / r],
            Routing::CoreXy => [(x + y) / r, (x - y) / r],
        }
    }

    /// Where the angles of the drive pulleys say that bridge and cart are: the other direction of [`Gantry::angles`],
    /// m.
    pub fn place(&self, [first, second]: [f64; 2]) -> [f64; 2] {
        let half = 0.5 * self.pulley_radius;
        match self.routing {
            Routing::HFrame => [half * (second - first), -half * (first + second)],
            Routing::CoreXy => [half * (first + second), half * (first - second)],
        }
    }

    /// Lengths of the spans with the bridge at `x` and the cart at `y`, m, where they follow these.
    pub fn lengths(&self, x: f64, y: f64) -> Option<Vec<f64>> {
        let (_, lengths) = self.belts.follows.as_ref()?;
        let rows = self.routing.rows(self.pulley_radius);
        Some(lengths.iter().zip(rows).map(|(length, (_, [of_x, of_y]))| length + of_x * x + of_y * y).collect())
    }

    /// Refuses what is no machine.
    pub fn check(&self) -> Result<()> {
        let spans = self.routing.spans().len();
        if self.belts.stiffness.len() != spans || self.belts.damping.len() != spans {
            return Err(Error::new(format!("the belt of this gantry has {spans} spans"))
                .allowed(format!("{spans} values of stiffness and of damping")));
        }
        let positive = |what: &str, value: f64| match (1e-15..=1e15).contains(&value) {
            true => Ok(()),
            false => Err(Error::new(format!("{what} cannot be {value:e}")).allowed("above zero: from 1e-15 to 1e15")),
        };
        positive("the pulleys' radius", self.pulley_radius)?;
        positive("an inertia", self.drive_pulley.inertia)?;
        positive("the bridge's mass", self.bridge.mass)?;
        positive("the cart's mass", self.cart.mass)?;
        self.belts.stiffness.iter().try_for_each(|&k| positive("the stiffness of a span", k))?;
        for motor in &self.motors {
            positive("a resistance", motor.resistance)?;
            positive("a gear ratio", motor.gear_ratio)?;
            if motor.gear_play.is_some() {
                positive("a rotor's inertia", motor.rotor_inertia)?;
            }
        }
        for (name, slide) in [("bridge", &self.bridge), ("cart", &self.cart)] {
            if slide.travel.is_some_and(|travel| travel.min >= travel.max) {
                let what = format!("the travel of the {name} ends before it begins");
                return Err(Error::new(what).allowed("max above min"));
            }
        }
        for friction in [self.drive_pulley.friction, self.bridge.friction, self.cart.friction] {
            if matches!(friction.law, Law::LuGre { .. }) {
                let least = friction.forward.coulomb.min(friction.backward.coulomb);
                positive("Coulomb friction under bristles", least)?;
            }
        }
        if self.belts.follows.is_some() {
            let (Some(across), Some(along)) = (self.bridge.travel, self.cart.travel) else {
                return Err(Error::new("spans that follow bridge and cart need the travel of both"));
            };
            for (x, y) in [across.min, across.max].into_iter().flat_map(|x| [(x, along.min), (x, along.max)]) {
                for (length, label) in self.lengths(x, y).into_iter().flatten().zip(self.routing.spans()) {
                    if length <= 0.0 {
                        return Err(Error::new(format!(
                            "with the bridge at {x} m and the cart at {y} m the {} has no length left",
                            label.name
                        ))
                        .allowed("a travel that leaves something of every span")
                        .next("make the travel shorter, or the spans longer"));
                    }
                }
            }
        }
        Ok(())
    }

    /// Its bodies, springs and drives.
    pub fn mechanism(&self) -> Mechanism {
        let turns = Kind::Rotary { radius: self.pulley_radius };
        let body = |index: usize, kind, inertia, friction: Friction| Body {
            label: LABELS[index],
            kind,
            inertia,
            friction,
            force: 0.0,
            along: None,
            leader: (index, 1.0),
            is_rotor: false,
        };
        let pulley = self.drive_pulley;
        let mut bodies = vec![
            body(LEFT, turns, pulley.inertia, pulley.friction),
            body(RIGHT, turns, pulley.inertia, pulley.friction),
            body(BRIDGE, Kind::Linear, self.bridge.mass + self.cart.mass, self.bridge.friction),
            body(CART, Kind::Linear, self.cart.mass, self.cart.friction),
        ];
        let mut springs = self.spans();
        let mut drives = Vec::new();
        for (pulley, (motor, amplifier)) in self.motors.into_iter().zip(self.amplifiers).enumerate() {
            let mut shaft = pulley;
            if let Some(play) = motor.gear_play {
                shaft = bodies.len();
                let half = 0.5 * play.backlash;
                springs.push(Spring {
                    label: GEARS[pulley],
                    arms: vec![(pulley, -1.0), (shaft, 1.0)],
                    stiffness: play.stiffness,
                    damping: play.damping,
                    law: if half == 0.0 { SpringLaw::TwoSided } else { SpringLaw::Gap { low: -half, high: half } },
                    follows: None,
                });
                bodies.push(Body {
                    label: ROTORS[pulley],
                    kind: turns,
                    inertia: motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia,
                    friction: Friction::default(),
                    force: 0.0,
                    along: None,
                    leader: (shaft, 1.0),
                    is_rotor: true,
                });
            }
            let [label, voltage, current] = DRIVES[pulley];
            drives.push(Drive { label, voltage, current, pulley, shaft, motor, amplifier });
        }
        for (body, slide) in [(BRIDGE, &self.bridge), (CART, &self.cart)] {
            springs.push(way(body, slide.travel));
        }
        let mut mechanism = Mechanism::new(bodies, springs, drives);
        mechanism.roles = Roles { loads: vec![BRIDGE, CART], spans: (0..self.routing.spans().len()).collect() };
        mechanism.readings = self.readings(&mechanism);
        mechanism.columns = self.columns(&mechanism);
        mechanism
    }

    fn spans(&self) -> Vec<Spring> {
        let law = self.belts.pretension.map_or(SpringLaw::TwoSided, |pretension| SpringLaw::Tension { pretension });
        let rows = self.routing.rows(self.pulley_radius);
        let span = |(index, (row, [of_x, of_y])): (usize, ([f64; BODIES], [f64; 2]))| Spring {
            label: self.routing.spans()[index],
            arms: row.into_iter().enumerate().filter(|(_, arm)| *arm != 0.0).collect(),
            stiffness: self.belts.stiffness[index],
            damping: self.belts.damping[index],
            law: law.clone(),
            follows: self.belts.follows.as_ref().map(|(rigidity, lengths)| Follows {
                rigidity: *rigidity,
                length: lengths[index],
                arms: vec![(BRIDGE, of_x), (CART, of_y)],
            }),
        };
        rows.into_iter().enumerate().map(span).collect()
    }

    /// Speeds of bridge and cart, currents of both drives, forces of the spans, the stretches that tell what the drives
    /// do not see and from which those of all spans follow, and the speeds of the motors: of rotors that turn by
    /// themselves, or of their pulleys.
    fn readings(&self, mechanism: &Mechanism) -> Vec<Shown> {
        let mut readings =
            vec![Shown::Speed(BRIDGE, 1.0), Shown::Speed(CART, 1.0), Shown::Current(0), Shown::Current(1)];
        readings.extend((0..self.routing.spans().len()).map(|span| Shown::Force(span, 1.0)));
        readings.extend(self.routing.drive_error()[0].map(|(span, _)| Shown::Stretch(span)));
        readings.extend(mechanism.drives.iter().map(|drive| Shown::Speed(drive.shaft, 1.0)));
        readings
    }

    fn columns(&self, mechanism: &Mechanism) -> Vec<Heading> {
        let mut columns = Vec::new();
        let mut add = |name: String, unit, shown, lean| columns.push(Heading { name: name.into(), unit, shown, lean });
        let sides = ["left", "right"];
        add("time".into(), "s", Shown::Time, true);
        for (drive, side) in sides.into_iter().enumerate() {
            add(format!("{side}_voltage"), "V", Shown::Voltage(drive), true);
        }
        for (body, label) in LABELS.into_iter().enumerate() {
            let way = if body < BRIDGE { "angle" } else { "position" };
            let [of_way, of_speed, _] = mechanism.bodies[body].kind.units();
            add(format!("{}_{way}", label.key), of_way, Shown::Position(body, 1.0), true);
            add(format!("{}_speed", label.key), of_speed, Shown::Speed(body, 1.0), true);
        }
        for (drive, side) in sides.into_iter().enumerate() {
            add(format!("{side}_current"), "A", Shown::Current(drive), true);
        }
        for (span, label) in self.routing.spans().iter().enumerate() {
            add(format!("{}_force", label.key), "N", Shown::Force(span, 1.0), true);
        }
        for (body, label) in LABELS.into_iter().enumerate() {
            add(
                format!("{}_friction", label.key),
                mechanism.bodies[body].kind.units()[2],
                Shown::Friction(body),
                false,
            );
        }
        for (body, label) in LABELS.into_iter().enumerate() {
            add(format!("{}_state", label.key), "", Shown::Motion(body), true);
        }
        for (drive, side) in sides.into_iter().enumerate() {
            if mechanism.drives[drive].shows_input() {
                add(format!("{side}_input"), self.amplifiers[drive].mode.unit(), Shown::Input(drive), true);
            }
        }
        for (drive, side) in sides.into_iter().enumerate() {
            let part = &mechanism.drives[drive];
            let gear = mechanism.springs.iter().position(|spring| spring.label == GEARS[drive]);
            if let Some(gear) = gear {
                add(format!("{side}_rotor_angle"), "rad", Shown::Position(part.shaft, 1.0), false);
                add(format!("{side}_rotor_speed"), "rad/s", Shown::Speed(part.shaft, 1.0), false);
                add(format!("{side}_gear_torque"), "N m", Shown::Force(gear, 1.0), false);
                add(format!("{side}_gear_state"), "", Shown::Contact(gear), false);
            }
        }
        if self.belts.pretension.is_some() {
            for (span, label) in self.routing.spans().iter().enumerate() {
                add(format!("{}_slack", label.key), "", Shown::Contact(span), false);
            }
        }
        for (index, spring) in mechanism.springs.iter().enumerate() {
            if spring.arms.len() == 1 && matches!(spring.law, SpringLaw::Gap { .. }) {
                add(format!("{}_force", spring.label.key), "N", Shown::Force(index, -1.0), false);
            }
        }
        if let Some(encoder) = self.encoder {
            for (drive, side) in sides.into_iter().enumerate() {
                let part = &mechanism.drives[drive];
                let body = if encoder.at == EncoderPlace::Motor { part.shaft } else { part.pulley };
                let counts = encoder.counts_per_unit(part.motor.gear_ratio);
                add(format!("{side}_encoder_count"), "", Shown::Counts(body, counts), false);
            }
        }
        for (body, label) in LABELS.into_iter().enumerate() {
            if matches!(mechanism.bodies[body].friction.law, Law::LuGre { .. }) {
                add(
                    format!("{}_bristle", label.key),
                    mechanism.bodies[body].kind.units()[0],
                    Shown::Bristle(body),
                    false,
                );
            }
        }
        columns
    }
}

const GEARS: [Label; 2] =
    [Label { key: "left_gear", name: "left gear" }, Label { key: "right_gear", name: "right gear" }];
const ROTORS: [Label; 2] =
    [Label { key: "left_rotor", name: "left rotor" }, Label { key: "right_rotor", name: "right rotor" }];
/// The drives, and their limits of voltage and current.
const DRIVES: [[Label; 3]; 2] = [
    [
        Label { key: "left_drive", name: "left drive" },
        Label { key: "left_voltage", name: "left voltage limit" },
        Label { key: "left_current", name: "left current limit" },
    ],
    [
        Label { key: "right_drive", name: "right drive" },
        Label { key: "right_voltage", name: "right voltage limit" },
        Label { key: "right_current", name: "right current limit" },
    ],
];

/// Where bridge or cart is, and what stands at the ends of its travel.
fn way(body: usize, travel: Option<Travel>) -> Spring {
    let label = match body {
        BRIDGE => Label { key: "bridge_stop", name: "bridge's end stop" },
        _ => Label { key: "cart_stop", name: "cart's end stop" },
    };
    let stop = travel.and_then(|travel| travel.stop);
    let (stiffness, damping) = stop.map_or((0.0, 0.0), |stop| (stop.stiffness, stop.damping));
    let law = match travel {
        None => SpringLaw::None,
        Some(travel) if stop.is_some() => SpringLaw::Gap { low: travel.min, high: travel.max },
        Some(travel) => SpringLaw::Bounds { low: travel.min, high: travel.max },
    };
    Spring { label, arms: vec![(body, 1.0)], stiffness, damping, law, follows: None }
}
