//! The machine: motor, amplifier, pulleys, belt, cart, encoder, recorder. Everything in SI units.

pub mod axis;
mod dual_belt;
pub mod gantry;
mod geometry;
mod kind;
mod measured;
mod parts;
pub mod rigid;
mod sheet;
mod spans;
mod swing;

use crate::friction::Friction;
pub use crate::mechanism::{Amplifier, AmplifierMode, GearPlay, Motor, Stepper};
pub use crate::polyline::Polyline;
pub use geometry::{BodyAt, DriveAt, Geometry, Lever, Part, SlideAt, SpanAt};
pub use kind::MachineKind;
pub use measured::Quantity;
pub use sheet::{BELTS, BeltSheet, BeltType, Rating, SimpleDrive, Width};
pub use spans::Spans;
use std::f64::consts::PI;
pub use swing::slowest_swing;

/// A belt-driven machine: an axis (paper, Fig. 1 and 2), or a gantry with several drives.
///
/// [`MachineKind`] has its geometry; how many drives, spans and slides there are follows from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// The geometry.
    pub kind: MachineKind,
    /// Drives, in the order of the geometry.
    pub drives: Vec<DriveUnit>,
    /// Pitch radius r of all pulleys, m.
    pub pulley_radius: f64,
    /// The pulley at each motor; that of an axis has the angle φ₁.
    pub drive_pulley: Pulley,
    /// The pulley at the far end of an axis; its angle is φ₃. Idlers of gantries have neither inertia nor friction.
    pub idler_pulley: Pulley,
    /// The bridge of a gantry; its position is x.
    pub bridge: Option<Slide>,
    /// Yaw of the bridge on its bearings; none for a bridge that only slides.
    pub yaw: Option<Yaw>,
    /// The cart; its position is x on an axis (the paper's x₂′), y on a gantry's bridge.
    pub cart: Slide,
    /// The belt, or belts.
    pub belt: Belt,
    /// Encoder of each drive, if any; on an axis it can be at the cart.
    pub encoder: Option<Encoder>,
    /// A second encoder at the cart, beside one at motor or drive pulley.
    pub scale: Option<Encoder>,
}

/// A motor and the amplifier that feeds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveUnit {
    /// The DC motor and its gear.
    pub motor: Motor,
    /// The amplifier between the input and the motor.
    pub amplifier: Amplifier,
}

impl Machine {
    /// An axis with equal pulleys at both ends, without encoders; `pulley_radius` in m.
    ///
    /// ```
    /// use taut_core::friction::Friction;
    /// use taut_core::machine::{Amplifier, AmplifierMode, Belt, DriveUnit, Machine, Motor, Pulley, Slide};
    /// use taut_core::plan::Experiment;
    /// use taut_core::signal::Signal;
    /// use taut_core::solve::{Solver, simulate};
    ///
    /// let motor = Motor { rotor_inertia: 4.6e-6, ..Motor::brushed(0.043, 1.1) };
    /// let drive = DriveUnit { motor, amplifier: Amplifier::ideal(AmplifierMode::Voltage, 1.0) };
    /// let pulley = Pulley { inertia: 6.3e-5, friction: Friction::symmetric(0.0, 0.015) };
    /// let cart = Slide::new(0.4, Friction::with_breakaway(19.0, 0.2, 0.3));
    /// let belt = Belt::given([2e5, 2e5, 1e5], [20.0, 20.0, 20.0]);
    /// let axis = Machine::axis(drive, 0.0194, pulley, cart, belt);
    ///
    /// let pulse = Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }; // V, s, s
    /// let experiment = Experiment::new("5 V pulse", vec![pulse], 1.0, 1e-3);
    /// let run = simulate(&axis, &experiment, Solver::Exact)?;
    /// let cart = *run.trajectory.get("cart_position").unwrap().last().unwrap();
    /// assert!(cart > 0.02 && cart < 0.1, "{cart} m");
    /// # Ok::<(), taut_core::Error>(())
    /// ```
    pub fn axis(drive: DriveUnit, pulley_radius: f64, pulley: Pulley, cart: Slide, belt: Belt) -> Self {
        Self {
            kind: MachineKind::Axis,
            drives: vec![drive],
            pulley_radius,
            drive_pulley: pulley,
            idler_pulley: pulley,
            bridge: None,
            yaw: None,
            cart,
            belt,
            encoder: None,
            scale: None,
        }
    }

    /// The stepper of an axis or a gantry driven by steppers.
    pub fn stepper(&self) -> Option<&Stepper> {
        self.drives.iter().find_map(|unit| unit.motor.stepper.as_ref())
    }

    /// This machine with drivers that interpolate between microsteps, whose edges take most of the time of a run.
    pub fn interpolating(&self) -> Self {
        let mut other = self.clone();
        for unit in &mut other.drives {
            unit.motor.stepper.iter_mut().for_each(|stepper| stepper.interpolate = true);
        }
        other
    }

    /// Drives that turn when the slide of this number moves alone, each with its direction.
    pub fn movers(&self, number: usize) -> impl Iterator<Item = (usize, f64)> {
        let shares = self.belt_shares().into_iter().enumerate();
        shares.map(move |(drive, shares)| (drive, shares[number])).filter(|(_, share)| *share != 0.0)
    }

    /// The mass that moves with the slide of this number, kg: its own, and that of what it carries.
    pub fn sliding_mass(&self, number: usize) -> f64 {
        self.slides().skip(number).map(|slide| slide.mass).sum()
    }

    /// The constant force on the slide of this number with what it carries, N.
    pub fn constant_force(&self, number: usize) -> f64 {
        self.slide(number).map_or(0.0, |slide| slide.constant_force_with(self.sliding_mass(number)))
    }

    /// Force on the slide of this number that does not depend on its speed, N, at `position` (m).
    pub fn force_at(&self, number: usize, position: f64) -> f64 {
        let along = self.slide(number).and_then(|slide| slide.forces.along.as_ref());
        self.constant_force(number) + along.map_or(0.0, |line| line.value(position))
    }

    /// Breakaway force at the belt, N, of the slide of this number at `position` (m) with everything that turns with
    /// it; the sign of `side` is the direction.
    pub fn breakaway(&self, number: usize, side: f64, position: f64) -> f64 {
        let Some(slide) = self.slide(number) else { return 0.0 };
        let forward = |sign: f64| side * sign > 0.0;
        let drives = self.movers(number).map(|(_, sign)| self.drive_pulley.friction.side(forward(sign)).breakaway);
        let pulleys = drives.sum::<f64>() + self.idler_pulley.friction.side(forward(1.0)).breakaway;
        let along = slide.along.as_ref().map_or(1.0, |along| along.value(position));
        let by_speed = slide.forces.by_speed.as_ref().map_or(0.0, |line| line.value(0.0));
        let own = along * slide.friction.side(forward(1.0)).breakaway;
        own + pulleys / self.pulley_radius - side * (self.force_at(number, position) + by_speed)
    }

    /// The sliding parts, in the order of the geometry: the bridge, if any, then the cart.
    pub fn slides(&self) -> impl Iterator<Item = &Slide> {
        self.bridge.iter().chain(std::iter::once(&self.cart))
    }

    /// The part that carries the rest: the bridge, or the cart if there is no bridge.
    pub fn first_slide(&self) -> &Slide {
        self.bridge.as_ref().unwrap_or(&self.cart)
    }

    /// The slide with this number.
    pub fn slide(&self, index: usize) -> Option<&Slide> {
        self.slides().nth(index)
    }

    /// Mutable access to a slide.
    pub(crate) fn slide_mut(&mut self, index: usize) -> Option<&mut Slide> {
        self.bridge.iter_mut().chain(std::iter::once(&mut self.cart)).nth(index)
    }

    /// True if its equations are linear except for changes of mode, as the exact solver requires.
    pub fn is_piecewise_linear(&self) -> bool {
        let pulleys = [self.drive_pulley.friction, self.idler_pulley.friction];
        let mut laws = pulleys.iter().chain(self.slides().map(|slide| &slide.friction));
        // A rigid belt has no stiffness that could follow.
        let follows = self.belt.follows_cart && self.belt.model != BeltModel::Rigid;
        laws.all(Friction::is_piecewise_linear)
            && self.slides().all(|slide| slide.along.is_none())
            && !follows
            && self.stepper().is_none()
            && self.yaw.is_none()
    }

    /// True if its parameters change along the travel, apart from the ends.
    pub fn changes_along_travel(&self) -> bool {
        self.slides().any(|slide| slide.along.is_some() || slide.forces.along.is_some()) || self.belt.follows_cart
    }

    /// The first of its parts that the paper's equations lack, in words.
    pub(crate) fn beyond_the_paper(&self) -> Option<&'static str> {
        let DriveUnit { motor, amplifier } = &self.drives[0];
        let parts = [
            (self.kind != MachineKind::Axis, "a second drive"),
            (motor.stepper.is_some(), "a stepper"),
            (amplifier.voltage_limit.is_some(), "a voltage limit"),
            (amplifier.current_limit.is_some(), "a current limit"),
            (amplifier.bandwidth.is_some(), "a current loop of finite bandwidth"),
            (motor.gear_play.is_some(), "a compliant gear"),
            (self.belt.pretension.is_some(), "spans that go slack"),
            (self.belt.model != BeltModel::Elastic, "a reduced model of the belt"),
            (self.cart.constant_force() != 0.0, "a constant force on the cart"),
            (self.cart.forces != SlideForces::default(), "a force on the cart that changes"),
            (self.cart.travel.is_some(), "the ends of the travel"),
        ];
        parts.into_iter().find(|(there, _)| *there).map(|(_, words)| words)
    }
}

/// A pulley that turns with friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulley {
    /// Moment of inertia J, kg m².
    pub inertia: f64,
    /// Friction torque, N m over rad/s.
    pub friction: Friction,
}

/// A sliding part: the cart, or the bridge that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct Slide {
    /// Mass M with its load, kg; of a bridge without its cart.
    pub mass: f64,
    /// Friction force, N over m/s.
    pub friction: Friction,
    /// Factor on dry friction along the travel, if it varies.
    pub along: Option<Polyline>,
    /// Forces on it that change along the travel or with its speed, if any.
    pub forces: SlideForces,
    /// Constant force F_L, N, positive towards larger x, as of a hanging mass or a constant-force spring.
    pub load: f64,
    /// Inclination of its travel, rad: positive if it climbs towards larger x.
    pub inclination: f64,
    /// Travel, if it is limited.
    pub travel: Option<Travel>,
}

/// Yaw of a bridge on its bearings (racking).
///
/// Two bearings, one behind the other along the travel, hold the bridge across it. With four, on two rails, take twice
/// the stiffness and damping of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yaw {
    /// Moment of inertia I of the bridge without the cart about a vertical axis through its middle, kg m².
    pub inertia: f64,
    /// Distance 2 a of the belts on either side, m.
    pub belt_spacing: f64,
    /// Distance s of the bearings along the travel, m.
    pub bearing_spacing: f64,
    /// Stiffness k_b of each bearing across the travel, N/m.
    pub bearing_stiffness: f64,
    /// Damping c_b of each, N s/m.
    pub bearing_damping: f64,
}

impl Yaw {
    /// a, m.
    pub fn arm(&self) -> f64 {
        0.5 * self.belt_spacing
    }

    /// Yaw stiffness, N m/rad: two bearings at s/2 from the middle, 2 k_b (s/2)².
    pub fn stiffness(&self) -> f64 {
        0.5 * self.bearing_stiffness * self.bearing_spacing * self.bearing_spacing
    }

    /// Yaw damping, N m s/rad: c_b s²/2.
    pub fn damping(&self) -> f64 {
        0.5 * self.bearing_damping * self.bearing_spacing * self.bearing_spacing
    }
}

/// Forces that do not depend on the direction of motion, N over m and over m/s, positive towards larger x: of a cable
/// chain, magnets, a tilted rail or a fan, or residuals of a model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SlideForces {
    /// Over the position.
    pub along: Option<Polyline>,
    /// Over the speed.
    pub by_speed: Option<Polyline>,
}

/// Standard acceleration of gravity, m/s² (CGPM 1901).
pub const GRAVITY: f64 = 9.80665;

impl Slide {
    /// A horizontal sliding part without end stops and external forces.
    pub fn new(mass: f64, friction: Friction) -> Self {
        let forces = SlideForces::default();
        Self { mass, friction, along: None, forces, load: 0.0, inclination: 0.0, travel: None }
    }

    /// The constant force on it, N, without a load that it carries.
    pub fn constant_force(&self) -> f64 {
        self.constant_force_with(self.mass)
    }

    /// The constant force on it, N, for a total `mass`, kg: F_L − M g sin θ.
    pub(crate) fn constant_force_with(&self, mass: f64) -> f64 {
        self.load - mass * GRAVITY * self.inclination.sin()
    }
}

/// The spans of the belt, or of all belts, in the order of the geometry. For an axis: 1 drive pulley to cart, 2 cart to
/// idler pulley, 3 idler pulley back to drive pulley.
#[derive(Debug, Clone, PartialEq)]
pub struct Belt {
    /// Span stiffness k₁, k₂, k₃, N/m, at the origin; infinite in a rigid model without stiffness.
    pub stiffness: Spans,
    /// Span damping c₁, c₂, c₃, N s/m.
    pub damping: Spans,
    /// Modulus, section and lengths from which the stiffness was computed, if it was not given directly.
    pub make: Option<BeltMake>,
    /// Tension T₀ of every span at rest, N. A span without tension goes slack; none for spans that can also push.
    pub pretension: Option<f64>,
    /// True if the lengths of spans, and so their stiffness, follow the sliding parts; needs `make`.
    pub follows_cart: bool,
    /// Belt model: the number of inertias that move independently.
    pub model: BeltModel,
    /// Its data sheet.
    pub sheet: BeltSheet,
}

impl Belt {
    /// Spans of given stiffness (N/m) and damping (N s/m), without other data.
    pub fn given(stiffness: impl Into<Spans>, damping: impl Into<Spans>) -> Self {
        let (stiffness, damping) = (stiffness.into(), damping.into());
        let (model, sheet) = (BeltModel::Elastic, BeltSheet::default());
        Self { stiffness, damping, make: None, pretension: None, follows_cart: false, model, sheet }
    }

    /// Updates the stiffness after a change of `make`.
    pub(crate) fn follow_make(&mut self) {
        if let Some(make) = &self.make {
            self.stiffness = make.stiffness();
        }
    }

    /// `make`, if the spans follow the sliding parts.
    pub fn following(&self) -> Option<BeltMake> {
        self.make.filter(|_| self.follows_cart)
    }
}

/// Belt model: the bodies that move independently.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BeltModel {
    /// All three inertias: the paper's model.
    #[default]
    Elastic,
    /// Both pulleys as one inertia, and the cart on spans 1 and, in series, 2 and 3 (as Hace et al. 2005).
    TwoMass,
    /// Everything as one inertia: a belt that does not stretch (as Li & Rehani 1996).
    Rigid,
}

impl BeltModel {
    /// Its name in the case file.
    pub fn word(self) -> &'static str {
        match self {
            BeltModel::Elastic => "elastic",
            BeltModel::TwoMass => "two-mass",
            BeltModel::Rigid => "rigid",
        }
    }
}

/// Limits of a position, with or without end stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Travel {
    /// Least position x, m.
    pub min: f64,
    /// Greatest position x, m.
    pub max: f64,
    /// The end stop there; without, a run ends when the cart leaves its travel.
    pub stop: Option<EndStop>,
}

impl Travel {
    /// A travel without end stops.
    pub fn new(min: f64, max: f64) -> Self {
        Self { min, max, stop: None }
    }
}

/// An elastic end stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndStop {
    /// Stiffness k_s, N/m.
    pub stiffness: f64,
    /// Damping c_s, N s/m.
    pub damping: f64,
}

/// Modulus, section and lengths of a belt, which give its stiffness by eq. (11).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeltMake {
    /// Modulus E, Pa.
    pub modulus: f64,
    /// Cross-section A that carries the load, m².
    pub section: f64,
    /// Span lengths l₁, l₂, l₃, m, at the origin.
    pub spans: Spans,
}

impl BeltMake {
    /// Stiffness of each span.
    pub fn stiffness(&self) -> Spans {
        let &BeltMake { modulus: e, section: a, spans } = self;
        // k = A E / l                                                              (11)
        spans.map(|l| a * e / l)
    }

    /// E A, N.
    pub fn rigidity(&self) -> f64 {
        self.modulus * self.section
    }

    /// Stiffness of spans 1 and 2 of an axis with the cart at `x`, m: the drive pulley is at the positive end.
    pub fn stiffness_at(&self, x: f64) -> [f64; 2] {
        let &BeltMake { modulus: e, section: a, spans } = self;
        let [l1, l2, _] = spans.three();
        // k₁ = A E / (l₁ − x), k₂ = A E / (l₂ + x)                                (11)
        [a * e / (l1 - x), a * e / (l2 + x)]
    }
}

/// Modulus of a composite whose parts, given as (share of the section, modulus in Pa), act as springs in parallel
/// (2.3.1).
pub fn composite_modulus(parts: &[(f64, f64)]) -> f64 {
    parts.iter().map(|&(share, modulus)| share * modulus).sum()
}

/// Uniform section as stiff as a toothed belt: toothed and plain segments in series.
///
/// `toothed_share` is the fraction of the length with the section `toothed`; sections in m².
pub fn toothed_section(plain: f64, toothed: f64, toothed_share: f64) -> f64 {
    // 1/k_eff = 1/k_t + 1/k_nt, with k = A E / l of each share of the length        (12)
    1.0 / (toothed_share / toothed + (1.0 - toothed_share) / plain)
}

/// Moment of inertia, kg m², of a hollow cylinder about its axis; lengths in m, density in kg/m³.
pub fn cylinder_inertia(outer_diameter: f64, bore_diameter: f64, width: f64, density: f64) -> f64 {
    // J = π ρ w (d_o⁴ − d_i⁴) / 32
    PI * density * width * (outer_diameter.powi(4) - bore_diameter.powi(4)) / 32.0
}

/// Pitch radius, m, of a pulley with this number of teeth (grooves) at a pitch in m.
pub fn pitch_radius(teeth: f64, pitch: f64) -> f64 {
    // 2 π r = z p
    teeth * pitch / (2.0 * PI)
}

/// An incremental encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoder {
    /// Place of the encoder.
    pub at: EncoderPlace,
    /// Lines per turn (per metre at the cart); in quadrature four counts each.
    pub lines: f64,
}

/// Shaft or slide that an encoder measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncoderPlace {
    /// The motor's own shaft, before the gear.
    Motor,
    /// The drive pulley, after the gear.
    DrivePulley,
    /// The cart, on a linear scale.
    Cart,
}

impl Encoder {
    /// Counts per radian of the drive pulley, or at the cart per metre; in quadrature every line gives four.
    pub fn counts_per_unit(&self, gear_ratio: f64) -> f64 {
        match self.at {
            EncoderPlace::Motor => 4.0 * self.lines * gear_ratio / (2.0 * PI),
            EncoderPlace::DrivePulley => 4.0 * self.lines / (2.0 * PI),
            EncoderPlace::Cart => 4.0 * self.lines,
        }
    }
}

/// Recorder: sample times, converters and noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Interval between samples, s; by default that of the experiment.
    pub every: Option<f64>,
    /// Age of a sample when it is recorded, s.
    pub delay: f64,
    /// Standard deviation of the instant of a sample, s.
    pub jitter: f64,
    /// Seed of noise and jitter.
    pub seed: u64,
    /// The quantities that are recorded beside the encoder's counts.
    pub channels: Vec<Channel>,
}

impl Default for Measurement {
    /// An ideal recorder of the encoder alone.
    fn default() -> Self {
        Self { every: None, delay: 0.0, jitter: 0.0, seed: 1, channels: Vec::new() }
    }
}

/// A recorded quantity and its analogue-to-digital converter, all in the quantity's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// The quantity that is recorded.
    pub quantity: Quantity,
    /// Step of the converter; none if it does not round.
    pub step: Option<f64>,
    /// Standard deviation of the noise before the converter.
    pub noise: f64,
    /// Largest absolute value of the converter; none if it does not clip.
    pub range: Option<f64>,
}
