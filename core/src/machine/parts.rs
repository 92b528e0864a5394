//! A machine as a mechanism: bodies, springs and drives by its geometry, their columns and readings, and the state
//! without strain.

use super::{
    BeltMake, BeltModel, BodyAt, DriveAt, EncoderPlace, GRAVITY, Geometry, Machine, Part, Slide, SlideAt, SpanAt,
    Spans, Travel,
};
use crate::error::{Error, Result};
use crate::friction::{Friction, Law};
use crate::mechanism::{
    self, BODIES, BODIES_AND_DRIVES, Body, Drive, Follows, Heading, Label, Mechanism, Over, Ride, Roles, SPRINGS,
    Shown, Spring, SpringLaw, State,
};
use nalgebra::{DMatrix, DVector};

/// The yaw of a bridge, as a body and as what its bearings hold.
const YAW: Label = Label { key: "yaw", name: "yaw of the bridge" };
const BEARINGS: Label = Label { key: "bearings", name: "bearings of the bridge" };

impl Machine {
    /// Its geometry.
    pub fn geometry(&self) -> &'static Geometry {
        self.kind.geometry()
    }

    /// Its bodies, springs and drives.
    pub fn mechanism(&self) -> Mechanism {
        let geometry = self.geometry();
        let (mut bodies, mut springs, mut drives) = (self.bodies(), self.spans(), Vec::new());
        springs.extend(self.bearings());
        for (at, unit) in geometry.drives.iter().zip(&self.drives) {
            let mut shaft = at.pulley;
            if let Some(play) = unit.motor.gear_play {
                shaft = bodies.len();
                let half = 0.5 * play.backlash;
                springs.push(Spring {
                    label: at.gear,
                    arms: vec![(at.pulley, -1.0), (shaft, 1.0)],
                    stiffness: play.stiffness,
                    damping: play.damping,
                    // Without play the flanks never part.
                    law: if half == 0.0 { SpringLaw::TwoSided } else { SpringLaw::Gap { low: -half, high: half } },
                    follows: None,
                });
                bodies.push(Body {
                    label: at.rotor,
                    kind: mechanism::MotionKind::Rotary { radius: self.pulley_radius },
                    // n² J_r: seen from behind the gear
                    inertia: unit.motor.gear_ratio * unit.motor.gear_ratio * unit.motor.rotor_inertia,
                    friction: Friction::default(),
                    force: 0.0,
                    along: None,
                    leader: (shaft, 1.0),
                    is_rotor: true,
                });
            }
            if unit.motor.stepper.is_some() {
                springs.push(Spring {
                    label: at.label,
                    arms: vec![(shaft, 1.0)],
                    stiffness: 0.0,
                    damping: 0.0,
                    law: SpringLaw::Angle { at: 0.0 },
                    follows: None,
                });
            }
            let &DriveAt { label, voltage, current, pulley, .. } = at;
            let (motor, amplifier) = (unit.motor, unit.amplifier);
            drives.push(Drive { label, voltage, current, pulley, shaft, motor, amplifier });
        }
        let slides = || geometry.slides.iter().zip(self.slides());
        springs.extend(slides().flat_map(|(at, slide)| lines(at, slide)));
        springs.extend(slides().map(|(at, slide)| way(at, slide)));
        let mut mechanism = Mechanism::new(bodies, springs, drives);
        let loads = geometry.slides.iter().map(|slide| slide.body).collect();
        mechanism.ride = self.ride();
        mechanism.roles = Roles { loads, spans: (0..geometry.spans.len()).collect() };
        mechanism.readings = self.readings(&mechanism);
        mechanism.columns = self.columns(&mechanism);
        mechanism
    }

    /// Bodies other than rotors.
    fn bodies(&self) -> Vec<Body> {
        let bodies = self.geometry().bodies;
        let number = |part: Part| bodies.iter().position(|body| body.part == part);
        let body = |(index, &BodyAt { label, part, .. }): (usize, &BodyAt)| {
            let leader = match (self.belt.model, part) {
                (BeltModel::TwoMass, Part::IdlerPulley) => number(Part::DrivePulley).map(|drive| (drive, 1.0)),
                // x = r φ
                (BeltModel::Rigid, Part::DrivePulley | Part::IdlerPulley) => {
                    number(Part::Cart).map(|cart| (cart, 1.0 / self.pulley_radius))
                }
                _ => None,
            };
            let turns = mechanism::MotionKind::Rotary { radius: self.pulley_radius };
            let slides = mechanism::MotionKind::Linear;
            let bridge = self.bridge.as_ref().unwrap_or(&self.cart);
            let (kind, inertia, friction, slide) = match part {
                Part::DrivePulley => (turns, self.drive_pulley.inertia, self.drive_pulley.friction, None),
                Part::IdlerPulley => (turns, self.idler_pulley.inertia, self.idler_pulley.friction, None),
                Part::Bridge => (slides, bridge.mass + self.cart.mass, bridge.friction, Some(bridge)),
                Part::Cart => (slides, self.cart.mass, self.cart.friction, Some(&self.cart)),
            };
            Body {
                label,
                kind,
                inertia,
                friction,
                force: slide.map_or(0.0, |slide| slide.constant_force_with(inertia)),
                along: slide.and_then(|slide| slide.along.clone()),
                leader: leader.unwrap_or((index, 1.0)),
                is_rotor: false,
            }
        };
        let yaw = self.yaw.iter().map(|yaw| Body {
            label: YAW,
            kind: mechanism::MotionKind::Rotary { radius: yaw.arm() },
            inertia: yaw.inertia,
            friction: Friction::default(),
            force: 0.0,
            along: None,
            leader: (bodies.len(), 1.0),
            is_rotor: false,
        });
        bodies.iter().enumerate().map(body).chain(yaw).collect()
    }

    /// The body that is the yaw of the bridge, if it yaws: behind those of the geometry.
    pub fn yaw_body(&self) -> Option<usize> {
        self.yaw.map(|_| self.geometry().bodies.len())
    }

    /// The spring of a bridge's bearings, if it yaws: behind the spans. Its length is ψ.
    pub fn yaw_spring(&self) -> Option<usize> {
        self.yaw.map(|_| self.geometry().spans.len())
    }

    fn bearings(&self) -> Option<Spring> {
        let (yaw, body) = self.yaw.zip(self.yaw_body())?;
        Some(Spring {
            label: BEARINGS,
            arms: vec![(body, 1.0)],
            stiffness: yaw.stiffness(),
            damping: yaw.damping(),
            law: SpringLaw::TwoSided,
            follows: None,
        })
    }

    /// Contribution of the cart on a bridge that yaws.
    fn ride(&self) -> Option<Ride> {
        let (slides, yaw, bridge) = (self.geometry().slides, self.yaw_body()?, self.bridge.as_ref()?);
        let gravity = GRAVITY * bridge.inclination.sin();
        Some(Ride { bridge: slides.first()?.body, cart: self.geometry().cart(), yaw, gravity })
    }

    /// Lever arms of a span's elongation, or of its length from end to end, and that of the yaw.
    fn with_yaw(&self, arms: impl Iterator<Item = (usize, f64)>, at: &SpanAt) -> Vec<(usize, f64)> {
        let yaw = self.yaw.zip(self.yaw_body()).map(|(yaw, body)| (body, at.on_yaw * yaw.arm()));
        arms.chain(yaw.filter(|(_, arm)| *arm != 0.0)).collect()
    }

    fn spans(&self) -> Vec<Spring> {
        let [mut k, mut c] = [self.belt.stiffness, self.belt.damping];
        if self.belt.model == BeltModel::TwoMass {
            // Spans 2 and 3 in series, the idler pulley between them without inertia or friction of its own:
            // 1/k₂₃ = 1/k₂ + 1/k₃ and, for slow motion, c₂₃ = (c₂ k₃² + c₃ k₂²)/(k₂ + k₃)²
            let sum = k[1] + k[2];
            c[1] = (c[1] * k[2] * k[2] + c[2] * k[1] * k[1]) / (sum * sum);
            k[1] = k[1] * k[2] / sum;
        }
        let law = self.belt.pretension.map_or(SpringLaw::TwoSided, |pretension| SpringLaw::Tension { pretension });
        let span = |(index, at): (usize, &SpanAt)| {
            let there = self.span_alike(index) == Some(index);
            Spring {
                label: at.label,
                arms: self.with_yaw(at.arms.iter().map(|&(body, arm)| (body, arm.factor(self.pulley_radius))), at),
                stiffness: if there { k[index] } else { 0.0 },
                damping: if there { c[index] } else { 0.0 },
                law: if there { law.clone() } else { SpringLaw::None },
                follows: self.follows(index, at),
            }
        };
        self.geometry().spans.iter().enumerate().map(span).collect()
    }

    /// The span that carries the force of span `index`, if any: itself, but span 2 for span 3 of a two-mass model.
    pub fn span_alike(&self, index: usize) -> Option<usize> {
        match (self.belt.model, index) {
            (BeltModel::Rigid, _) => None,
            (BeltModel::TwoMass, 2) => Some(1),
            _ => Some(index),
        }
    }

    /// Dependence of a span's length on the sliding parts. Spans 2 and 3 in series are one span of their total length;
    /// their damping keeps its value at x = 0.
    fn follows(&self, index: usize, at: &SpanAt) -> Option<Follows> {
        let mut make = self.belt.following()?;
        match self.belt.model {
            BeltModel::Elastic => {}
            BeltModel::TwoMass => make.spans[1] += make.spans[2],
            BeltModel::Rigid => return None,
        }
        let arms = self.with_yaw(at.follows.iter().copied(), at);
        let follows = Follows { rigidity: make.rigidity(), length: make.spans[index], arms };
        (!at.follows.is_empty()).then_some(follows)
    }

    /// For one drive, in the order of [`crate::solve::reading`]. For several: speeds of the slides, currents, span
    /// forces, the elongations that determine the drives' position errors and all other elongations, and the speeds of
    /// the motors (independent rotors, or their pulleys).
    fn readings(&self, mechanism: &Mechanism) -> Vec<Shown> {
        let geometry = self.geometry();
        let spans = 0..geometry.spans.len();
        let forces = spans.clone().map(|span| Shown::Force(self.span_alike(span).unwrap_or(span), 1.0));
        let loads = geometry.slides.iter().map(|slide| Shown::Speed(slide.body, 1.0));
        let currents = (0..mechanism.drives.len()).map(Shown::Current);
        let shafts = mechanism.drives.iter().map(|drive| Shown::Speed(drive.shaft, 1.0));
        // A stepper has two phase voltages, so its command is read instead.
        let supply = |drive: &Drive| if drive.motor.stepper.is_some() { Shown::Input(0) } else { Shown::Voltage(0) };
        match &mechanism.drives[..] {
            [drive] => loads
                .chain([Shown::Speed(drive.pulley, self.pulley_radius)])
                .chain(spans.map(Shown::Stretch))
                .chain(forces)
                .chain(currents)
                .chain(shafts)
                .chain([supply(drive), Shown::Position(geometry.cart(), 1.0)])
                .collect(),
            _ => {
                let stretches = geometry.telling_spans().chain(self.yaw_spring()).map(Shown::Stretch);
                loads.chain(currents).chain(forces).chain(stretches).chain(shafts).collect()
            }
        }
    }

    /// Readings for the observer of a move; with several drives, positions of the slides replace their speeds, since
    /// the capacity does not suffice for both.
    pub fn readings_of_move(&self, mechanism: &Mechanism) -> Vec<Shown> {
        let mut readings = mechanism.readings.clone();
        if self.drives.len() > 1 {
            for (reading, slide) in readings.iter_mut().zip(self.geometry().slides) {
                *reading = Shown::Position(slide.body, 1.0);
            }
        }
        readings
    }

    fn columns(&self, mechanism: &Mechanism) -> Vec<Heading> {
        let geometry = self.geometry();
        let (bodies, spans) = (geometry.bodies, geometry.spans);
        let drives = || geometry.drives.iter().zip(&mechanism.drives).enumerate();
        let units = |body: usize| mechanism.bodies[body].kind.units();
        let mut columns = Vec::new();
        let mut add = |name: String, unit, shown, lean| columns.push(Heading { name: name.into(), unit, shown, lean });
        add("time".into(), "s", Shown::Time, true);
        for (drive, (at, _)) in drives().filter(|(_, (_, part))| part.motor.stepper.is_none()) {
            add(at.voltage.key.into(), "V", Shown::Voltage(drive), true);
        }
        for (body, BodyAt { label, .. }) in bodies.iter().enumerate() {
            let way = if mechanism.bodies[body].kind == mechanism::MotionKind::Linear { "position" } else { "angle" };
            let [of_way, of_speed, _] = units(body);
            add(format!("{}_{way}", label.key), of_way, Shown::Position(body, 1.0), true);
            add(format!("{}_speed", label.key), of_speed, Shown::Speed(body, 1.0), true);
        }
        if let Some(yaw) = self.yaw_body() {
            let [of_way, of_speed, _] = units(yaw);
            add(format!("{}_angle", YAW.key), of_way, Shown::Position(yaw, 1.0), true);
            add(format!("{}_speed", YAW.key), of_speed, Shown::Speed(yaw, 1.0), true);
        }
        for (drive, (at, _)) in drives() {
            add(at.current_column.into(), "A", Shown::Current(drive), true);
        }
        for (drive, (at, _)) in drives().filter(|(_, (_, part))| part.motor.stepper.is_some()) {
            add(format!("{}second_phase_current", at.prefix), "A", Shown::SecondPhase(drive), true);
        }
        let alike = |span: usize| self.span_alike(span).unwrap_or(span);
        for (span, at) in spans.iter().enumerate() {
            add(format!("{}_force", at.column), "N", Shown::Force(alike(span), 1.0), true);
        }
        for (body, BodyAt { label, .. }) in bodies.iter().enumerate() {
            add(format!("{}_friction", label.key), units(body)[2], Shown::Friction(body), false);
        }
        for (body, BodyAt { label, .. }) in bodies.iter().enumerate() {
            add(format!("{}_state", label.key), "", Shown::Motion(body), true);
        }
        for (drive, (at, part)) in drives().filter(|(_, (_, part))| part.shows_input()) {
            add(format!("{}input", at.prefix), part.amplifier.mode.unit(), Shown::Input(drive), true);
        }
        for (_, (at, part)) in drives().filter(|(_, (_, part))| part.has_rotor()) {
            let gear = mechanism.springs.iter().position(|spring| spring.label == at.gear).unwrap_or_default();
            add(format!("{}_angle", at.rotor.key), "rad", Shown::Position(part.shaft, 1.0), false);
            add(format!("{}_speed", at.rotor.key), "rad/s", Shown::Speed(part.shaft, 1.0), false);
            add(format!("{}_torque", at.gear.key), "N m", Shown::Force(gear, 1.0), false);
            add(format!("{}_state", at.gear.key), "", Shown::Contact(gear), false);
        }
        if self.belt.pretension.is_some() {
            for (span, at) in spans.iter().enumerate() {
                add(format!("{}_slack", at.column), "", Shown::Contact(alike(span)), false);
            }
        }
        let stops = geometry.slides.iter().zip(self.slides());
        for (at, _) in stops.filter(|(_, slide)| slide.travel.is_some_and(|travel| travel.stop.is_some())) {
            let stop = mechanism.springs.iter().position(|spring| spring.label == at.stop).unwrap_or_default();
            add(format!("{}_force", at.stop.key), "N", Shown::Force(stop, -1.0), false);
        }
        for (index, spring) in mechanism.springs.iter().enumerate() {
            if let SpringLaw::Line { .. } = spring.law {
                add(spring.label.key.into(), "N", Shown::Force(index, -1.0), false);
            }
        }
        let mut counted = |name: String, body: usize, counts| add(name, "", Shown::Counts(body, counts), false);
        for (at, part) in geometry.drives.iter().zip(&mechanism.drives) {
            let Some(encoder) = self.encoder else { continue };
            let body = match encoder.at {
                EncoderPlace::Motor => part.shaft,
                EncoderPlace::DrivePulley => part.pulley,
                EncoderPlace::Cart => geometry.cart(),
            };
            let counts = encoder.counts_per_unit(part.motor.gear_ratio);
            counted(format!("{}encoder_count", at.prefix), body, counts);
        }
        if let Some(scale) = self.scale {
            counted("scale_count".into(), geometry.cart(), scale.counts_per_unit(1.0));
        }
        for (body, BodyAt { label, .. }) in bodies.iter().enumerate() {
            if matches!(mechanism.bodies[body].friction.law, Law::LuGre { .. }) {
                add(format!("{}_bristle", label.key), units(body)[0], Shown::Bristle(body), false);
            }
        }
        columns
    }

    /// The state at rest with the cart of an axis at `x`, m, and the belt without strain.
    pub fn at_rest(&self, x: f64) -> State {
        self.without_strain(&[x], &[])
    }

    /// The state without strain for these positions of the slides, m, and speeds, m/s (zero if missing); rotors are in
    /// the middle of their play.
    pub fn without_strain(&self, positions: &[f64], speeds: &[f64]) -> State {
        State { position: self.ways(positions), speed: self.ways(speeds), ..State::default() }
    }

    /// Displacements of all bodies for these of the slides.
    fn ways(&self, slides: &[f64]) -> [f64; BODIES] {
        let geometry = self.geometry();
        let mut ways = [0.0; BODIES];
        for (way, body) in ways.iter_mut().zip(geometry.bodies) {
            let along: f64 = body.by_slides.iter().zip(slides).map(|(weight, along)| weight * along).sum();
            *way = match body.part {
                Part::DrivePulley | Part::IdlerPulley => along / self.pulley_radius,
                Part::Bridge | Part::Cart => along,
            };
        }
        let rotors = geometry.drives.iter().zip(&self.drives).filter(|(_, unit)| unit.motor.gear_play.is_some());
        for (rotor, (drive, _)) in rotors.enumerate() {
            ways[geometry.bodies.len() + rotor] = ways[drive.pulley];
        }
        ways
    }

    /// Names of the slides, and their travel if limited.
    pub fn travels(&self) -> impl Iterator<Item = (Label, Option<Travel>)> {
        let geometry = self.geometry();
        geometry.slides.iter().zip(self.slides()).map(|(at, slide)| (geometry.label(at.body), slide.travel))
    }

    /// Weights of the slides' positions in r φ of each drive's pulley without strain.
    pub fn belt_shares(&self) -> Vec<&'static [f64]> {
        let geometry = self.geometry();
        geometry.drives.iter().map(|drive| geometry.bodies[drive.pulley].by_slides).collect()
    }

    /// Position of each drive's part of the belt by the slides minus r φ of its pulley as a sum over elongations
    /// d = A q: springs and their weights w.
    ///
    /// ```text
    /// Σ s x − r φ = Σ w d
    /// ```
    pub fn elongations_of_drives(&self, mechanism: &Mechanism) -> Vec<Vec<(usize, f64)>> {
        let geometry = self.geometry();
        let springs: Vec<usize> = geometry.telling_spans().chain(self.yaw_spring()).collect();
        let form = |terms: &[(usize, f64)]| {
            let mut form = DVector::zeros(mechanism.bodies.len());
            terms.iter().for_each(|&(body, arm)| form[mechanism.leader(body)] += arm * mechanism.ratio(body));
            form
        };
        let arms: Vec<DVector<f64>> = springs.iter().map(|&spring| form(&mechanism.springs[spring].arms)).collect();
        let arms = DMatrix::from_columns(&arms).svd(true, true);
        let of_drive = |(drive, shares): (&DriveAt, &[f64])| {
            let slides = geometry.slides.iter().zip(shares).map(|(slide, share)| (slide.body, *share));
            let terms: Vec<(usize, f64)> = slides.chain([(drive.pulley, -self.pulley_radius)]).collect();
            let weights = arms.solve(&form(&terms), 1e-9 * arms.singular_values.max()).unwrap_or_default();
            // Of spans they are simple fractions, here without their rounding.
            let simple =
                |w: f64| if (64.0 * w - (64.0 * w).round()).abs() < 1e-9 { (64.0 * w).round() / 64.0 } else { w };
            springs.iter().copied().zip(weights.iter().map(|w| simple(*w))).collect()
        };
        geometry.drives.iter().zip(self.belt_shares()).map(of_drive).collect()
    }

    /// Positions of the slides by the drives, m, from the angles of all bodies.
    pub fn by_drives(&self, angles: &[f64; BODIES]) -> Vec<f64> {
        let geometry = self.geometry();
        let of_slide = |slide: &SlideAt| {
            let drives = geometry.drives.iter().zip(slide.by_drives);
            self.pulley_radius * drives.map(|(drive, weight)| weight * angles[drive.pulley]).sum::<f64>()
        };
        geometry.slides.iter().map(of_slide).collect()
    }

    /// Lengths of the spans for these positions of the slides, m, if they follow them.
    pub fn span_lengths(&self, slides: &[f64]) -> Option<Spans> {
        let BeltMake { spans, .. } = self.belt.following()?;
        let geometry = self.geometry();
        let place = |body: usize| {
            let number = geometry.slides.iter().position(|slide| slide.body == body);
            number.and_then(|number| slides.get(number)).copied().unwrap_or_default()
        };
        let length = |(length, span): (f64, &SpanAt)| {
            span.follows.iter().fold(length, |length, &(body, arm)| length + arm * place(body))
        };
        Some(spans.into_iter().zip(geometry.spans).map(length).collect())
    }

    /// The machine with fixed span lengths, those for these positions of the slides, m; unchanged if its spans do not
    /// follow the slides.
    pub fn with_spans_held(&self, slides: &[f64]) -> Self {
        let mut held = self.clone();
        if let (Some(lengths), Some(make)) = (self.span_lengths(slides), &mut held.belt.make) {
            make.spans = lengths;
            held.belt.stiffness = make.stiffness();
            held.belt.follows_cart = false;
        }
        held
    }

    /// True if a gear has play, and flanks without damping, which rattle.
    pub fn rattles(&self) -> bool {
        let mut plays = self.drives.iter().filter_map(|unit| unit.motor.gear_play);
        plays.any(|play| play.backlash > 0.0 && play.damping == 0.0)
    }

    /// Rejects compliant gears if their bodies and springs exceed the capacity of the solvers.
    pub fn check_gears(&self) -> Result<()> {
        let geometry = self.geometry();
        let gears = self.drives.iter().filter(|unit| unit.motor.gear_play.is_some()).count();
        let [bodies, springs] = [geometry.bodies.len() + gears, geometry.spans.len() + geometry.slides.len() + gears];
        let has_room = bodies + self.drives.len() <= BODIES_AND_DRIVES && bodies <= BODIES && springs <= SPRINGS;
        match (has_room && self.yaw.is_none()) || gears == 0 {
            true => Ok(()),
            false if has_room => Err(Error::new("a gantry whose bridge yaws cannot have compliant gears yet")
                .allowed("gears without gear_stiffness and backlash: there is no room for rotors beside its bodies")
                .next("leave gear_stiffness, gear_damping and backlash out, or [bridge.yaw]")),
            false => Err(Error::new(format!("a {} gantry cannot have compliant gears yet", geometry.word))
                .allowed("gears without gear_stiffness and backlash: there is no room for rotors beside its bodies")
                .next("leave gear_stiffness, gear_damping and backlash out")),
        }
    }

    /// Rejects keys and parts that a gantry does not support.
    pub fn check_gantry(&self) -> Result<()> {
        let geometry = self.geometry();
        let spans = geometry.spans.len();
        if self.belt.stiffness.len() != spans || self.belt.damping.len() != spans {
            return Err(Error::new(format!("the belt of this gantry has {spans} spans"))
                .allowed(format!("{spans} values of stiffness and of damping")));
        }
        let Some(bridge) = self.bridge.as_ref().filter(|_| self.drives.len() == geometry.drives.len()) else {
            return Err(Error::new(format!("this gantry has {} drives and a bridge", geometry.drives.len())));
        };
        self.check_gears()?;
        let positive = |what: &str, value: f64| match (1e-15..=1e15).contains(&value) {
            true => Ok(()),
            false => Err(Error::new(format!("{what} cannot be {value:e}")).allowed("above zero: from 1e-15 to 1e15")),
        };
        positive("the pulleys' radius", self.pulley_radius)?;
        positive("an inertia", self.drive_pulley.inertia)?;
        positive("the bridge's mass", bridge.mass)?;
        positive("the cart's mass", self.cart.mass)?;
        self.belt.stiffness.iter().try_for_each(|&k| positive("the stiffness of a span", k))?;
        if let Some(yaw) = self.yaw {
            positive("the inertia of the bridge's yaw", yaw.inertia)?;
            positive("the distance of the belts", yaw.belt_spacing)?;
            positive("the distance of the bearings", yaw.bearing_spacing)?;
            positive("the stiffness of a bearing", yaw.bearing_stiffness)?;
        }
        for motor in self.drives.iter().map(|unit| &unit.motor) {
            positive("a resistance", motor.resistance)?;
            positive("a gear ratio", motor.gear_ratio)?;
            if motor.gear_play.is_some() {
                positive("a rotor's inertia", motor.rotor_inertia)?;
            }
        }
        for (at, slide) in geometry.slides.iter().zip(self.slides()) {
            let name = geometry.label(at.body).name;
            if slide.travel.is_some_and(|travel| travel.min >= travel.max) {
                let what = format!("the travel of the {name} ends before it begins");
                return Err(Error::new(what).allowed("max above min"));
            }
            if slide.along.is_some() || slide.forces.along.is_some() {
                return Err(Error::new(format!(
                    "friction and forces of the {name} cannot change along its travel yet"
                )));
            }
        }
        if self.belt.model != BeltModel::Elastic || self.scale.is_some() {
            return Err(Error::new("a gantry has an elastic belt, and no scale"));
        }
        for friction in [self.drive_pulley.friction, bridge.friction, self.cart.friction] {
            if matches!(friction.law, Law::LuGre { .. }) {
                let least = friction.forward.coulomb.min(friction.backward.coulomb);
                positive("Coulomb friction under bristles", least)?;
            }
        }
        if self.belt.following().is_some() {
            let (Some(across), Some(along)) = (bridge.travel, self.cart.travel) else {
                return Err(Error::new("spans that follow bridge and cart need the travel of both"));
            };
            for (x, y) in [across.min, across.max].into_iter().flat_map(|x| [(x, along.min), (x, along.max)]) {
                let lengths = self.span_lengths(&[x, y]);
                for (length, label) in lengths.into_iter().flatten().zip(geometry.span_labels()) {
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
}

/// Piecewise linear forces on a slide.
fn lines(at: &SlideAt, slide: &Slide) -> impl Iterator<Item = Spring> {
    let body = at.body;
    let lines =
        [(at.force_along, Over::Length, &slide.forces.along), (at.force_by_speed, Over::Rate, &slide.forces.by_speed)];
    lines.into_iter().filter_map(move |(label, over, line): (Label, _, _)| {
        // A spring pulls it back.
        let law = SpringLaw::Line { over, line: line.as_ref()?.scaled(-1.0) };
        Some(Spring { label, arms: vec![(body, 1.0)], stiffness: 0.0, damping: 0.0, law, follows: None })
    })
}

/// Travel of a slide with its end stops.
fn way(at: &SlideAt, slide: &Slide) -> Spring {
    let stop = slide.travel.and_then(|travel| travel.stop);
    let (stiffness, damping) = stop.map_or((0.0, 0.0), |stop| (stop.stiffness, stop.damping));
    let law = match slide.travel {
        None => SpringLaw::None,
        Some(travel) if stop.is_some() => SpringLaw::Gap { low: travel.min, high: travel.max },
        Some(travel) => SpringLaw::Bounds { low: travel.min, high: travel.max },
    };
    Spring { label: at.stop, arms: vec![(at.body, 1.0)], stiffness, damping, law, follows: None }
}
