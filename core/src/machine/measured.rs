//! Measurable quantities of a machine, and positions from the slide coordinates of a geometry.

use super::{EncoderPlace, Geometry, Machine, MachineKind, Part};

/// Measurable quantities; the recorder of an axis supports those up to [`Quantity::CartSpeed`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Current of the armature, A.
    MotorCurrent,
    /// Voltage at the motor, V.
    MotorVoltage,
    /// φ₁, rad.
    DriveAngle,
    /// φ₁′, rad/s.
    DriveSpeed,
    /// x of an axis, y on a gantry's bridge, m.
    CartPosition,
    /// Its derivative, m/s.
    CartSpeed,
    /// φ₃, rad.
    IdlerAngle,
    /// φ₃′, rad/s.
    IdlerSpeed,
    /// φ_r, rad: the rotor's, divided by the gear ratio.
    RotorAngle,
    /// φ_r′, rad/s.
    RotorSpeed,
    /// Acceleration of the cart along its travel, m/s².
    CartAcceleration,
    /// Current of the left motor (A of CoreXY), A.
    LeftCurrent,
    /// Current of the right motor (B), A.
    RightCurrent,
    /// Voltage at the left motor, V.
    LeftVoltage,
    /// Voltage at the right motor, V.
    RightVoltage,
    /// φ₁ of a gantry: the left drive pulley, rad.
    LeftAngle,
    /// Its speed, rad/s.
    LeftSpeed,
    /// φ₂ of a gantry: the right drive pulley, rad.
    RightAngle,
    /// Its speed, rad/s.
    RightSpeed,
    /// x of a gantry's bridge, m.
    BridgePosition,
    /// Its speed, m/s.
    BridgeSpeed,
    /// The left motor's rotor, divided by the gear ratio, rad.
    LeftRotorAngle,
    /// Its speed, rad/s.
    LeftRotorSpeed,
    /// The right motor's rotor, divided by the gear ratio, rad.
    RightRotorAngle,
    /// Its speed, rad/s.
    RightRotorSpeed,
    /// Acceleration of the bridge along x, m/s², also measured by an accelerometer at the cart.
    BridgeAcceleration,
    /// Current of the motor of a cart that has one of its own, A.
    CartCurrent,
    /// Voltage at that motor, V.
    CartVoltage,
    /// φ₃ of a dual belt: the cart's drive pulley, rad.
    CartPulleyAngle,
    /// Its speed, rad/s.
    CartPulleySpeed,
}

use Quantity::*;

/// Quantities of an axis, in the order of a log.
const OF_AXIS: [Quantity; 11] = [
    MotorCurrent,
    MotorVoltage,
    DriveAngle,
    DriveSpeed,
    CartPosition,
    CartSpeed,
    IdlerAngle,
    IdlerSpeed,
    RotorAngle,
    RotorSpeed,
    CartAcceleration,
];

/// Quantities of a gantry.
const OF_GANTRY: [Quantity; 18] = [
    LeftCurrent,
    RightCurrent,
    LeftVoltage,
    RightVoltage,
    LeftAngle,
    LeftSpeed,
    RightAngle,
    RightSpeed,
    BridgePosition,
    BridgeSpeed,
    CartPosition,
    CartSpeed,
    LeftRotorAngle,
    LeftRotorSpeed,
    RightRotorAngle,
    RightRotorSpeed,
    BridgeAcceleration,
    CartAcceleration,
];

/// Quantities of a gantry with a motor for the cart and stiff gears.
const OF_DUAL_BELT: [Quantity; 18] = [
    LeftCurrent,
    RightCurrent,
    CartCurrent,
    LeftVoltage,
    RightVoltage,
    CartVoltage,
    LeftAngle,
    LeftSpeed,
    RightAngle,
    RightSpeed,
    CartPulleyAngle,
    CartPulleySpeed,
    BridgePosition,
    BridgeSpeed,
    CartPosition,
    CartSpeed,
    BridgeAcceleration,
    CartAcceleration,
];

impl Quantity {
    /// Quantities of a kind of machine, in the order of a log.
    pub const fn for_kind(kind: MachineKind) -> &'static [Quantity] {
        match kind {
            MachineKind::Axis => &OF_AXIS,
            MachineKind::HFrame | MachineKind::CoreXy => &OF_GANTRY,
            MachineKind::DualBelt => &OF_DUAL_BELT,
        }
    }

    /// Quantities of all kinds of machines, each once.
    pub fn all() -> impl Iterator<Item = Quantity> {
        let gantries = OF_GANTRY.into_iter().filter(|quantity| !OF_AXIS.contains(quantity));
        let known = |quantity: &Quantity| OF_AXIS.contains(quantity) || OF_GANTRY.contains(quantity);
        OF_AXIS.into_iter().chain(gantries).chain(OF_DUAL_BELT.into_iter().filter(move |quantity| !known(quantity)))
    }

    /// Its name, in case files and as a column.
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        self.row().1
    }

    /// Name and unit.
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            MotorCurrent => ("motor_current", "A"),
            MotorVoltage => ("motor_voltage", "V"),
            DriveAngle => ("drive_angle", "rad"),
            DriveSpeed => ("drive_speed", "rad/s"),
            CartPosition => ("cart_position", "m"),
            CartSpeed => ("cart_speed", "m/s"),
            IdlerAngle => ("idler_angle", "rad"),
            IdlerSpeed => ("idler_speed", "rad/s"),
            RotorAngle => ("rotor_angle", "rad"),
            RotorSpeed => ("rotor_speed", "rad/s"),
            CartAcceleration => ("cart_acceleration", "m/s^2"),
            LeftCurrent => ("left_current", "A"),
            RightCurrent => ("right_current", "A"),
            LeftVoltage => ("left_voltage", "V"),
            RightVoltage => ("right_voltage", "V"),
            LeftAngle => ("left_angle", "rad"),
            LeftSpeed => ("left_speed", "rad/s"),
            RightAngle => ("right_angle", "rad"),
            RightSpeed => ("right_speed", "rad/s"),
            BridgePosition => ("bridge_position", "m"),
            BridgeSpeed => ("bridge_speed", "m/s"),
            LeftRotorAngle => ("left_rotor_angle", "rad"),
            LeftRotorSpeed => ("left_rotor_speed", "rad/s"),
            RightRotorAngle => ("right_rotor_angle", "rad"),
            RightRotorSpeed => ("right_rotor_speed", "rad/s"),
            BridgeAcceleration => ("bridge_acceleration", "m/s^2"),
            CartCurrent => ("cart_current", "A"),
            CartVoltage => ("cart_voltage", "V"),
            CartPulleyAngle => ("cart_pulley_angle", "rad"),
            CartPulleySpeed => ("cart_pulley_speed", "rad/s"),
        }
    }

    /// True for a position or an angle, whose origin is arbitrary.
    pub fn is_position(self) -> bool {
        matches!(self.unit(), "m" | "rad")
    }

    /// True if it is a speed.
    pub fn is_speed(self) -> bool {
        matches!(self.unit(), "m/s" | "rad/s")
    }

    /// True if it is linear (m and derivatives), not angular.
    pub fn is_linear(self) -> bool {
        matches!(self.unit(), "m" | "m/s" | "m/s^2")
    }

    /// True for a quantity of a rotor behind a gear.
    pub fn is_of_rotor(self) -> bool {
        self.name().contains("rotor_")
    }

    /// True if it is an acceleration.
    pub fn is_acceleration(self) -> bool {
        self.unit() == "m/s^2"
    }

    /// The speed for a position, for bodies that have columns of both.
    pub fn speed(self) -> Option<Quantity> {
        match self {
            DriveAngle => Some(DriveSpeed),
            CartPosition => Some(CartSpeed),
            LeftAngle => Some(LeftSpeed),
            RightAngle => Some(RightSpeed),
            BridgePosition => Some(BridgeSpeed),
            CartPulleyAngle => Some(CartPulleySpeed),
            _ => None,
        }
    }

    /// Name of the body or rotor that it measures: `cart` for `cart_position`; none if it is not a motion.
    pub fn body(self) -> Option<&'static str> {
        let is_motion = self.is_linear() || self.is_position() || self.is_speed();
        self.name().rsplit_once('_').map(|(body, _)| body).filter(|_| is_motion)
    }
}

impl Geometry {
    /// Change of a position or angle per metre of each slide without strain, for the pulley radius `r`; empty for other
    /// quantities.
    pub fn by_slides(&self, quantity: Quantity, r: f64) -> Vec<f64> {
        let Some(name) = quantity.body().filter(|_| quantity.is_position()) else { return Vec::new() };
        let rotor = self.drives.iter().find(|drive| drive.rotor.key == name).map(|drive| drive.pulley);
        let of_label = || self.bodies.iter().position(|body| body.label.key == name);
        let Some(body) = rotor.or_else(of_label).map(|body| &self.bodies[body]) else { return Vec::new() };
        let arm = if matches!(body.part, Part::DrivePulley | Part::IdlerPulley) { r } else { 1.0 };
        body.by_slides.iter().map(|weight| weight / arm).collect()
    }
}

impl Machine {
    /// Quantities that its logs can contain.
    pub fn quantities(&self) -> &'static [Quantity] {
        Quantity::for_kind(self.kind)
    }

    /// Quantities counted by its encoder: one for each drive, or the cart's; before a gear also the rotor's.
    pub fn counted(&self) -> impl Iterator<Item = Quantity> {
        let geometry = self.geometry();
        let at = self.encoder.map(|encoder| encoder.at);
        let is_counted = move |quantity: &Quantity| {
            let Some(body) = quantity.body().filter(|_| quantity.is_position()) else { return false };
            let pulley = geometry.drives.iter().any(|drive| geometry.label(drive.pulley).key == body);
            match at {
                Some(EncoderPlace::Motor) => pulley || quantity.is_of_rotor(),
                Some(EncoderPlace::DrivePulley) => pulley,
                Some(EncoderPlace::Cart) => geometry.label(geometry.cart()).key == body,
                None => false,
            }
        };
        self.quantities().iter().copied().filter(is_counted)
    }

    /// True if it has one coordinate, so that it can be modelled as a single mass.
    pub fn has_one_coordinate(&self) -> bool {
        self.geometry().slides.len() == 1
    }

    /// True if its motor torque follows from the input, so that a force balance of a single mass exists: one
    /// coordinate, and no stepper.
    pub fn has_torque_balance(&self) -> bool {
        self.has_one_coordinate() && self.stepper().is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_quantities_are_unique_and_those_of_the_bodies() {
        let all: Vec<Quantity> = Quantity::all().collect();
        for (k, quantity) in all.iter().enumerate() {
            assert!(all[..k].iter().all(|other| other.name() != quantity.name()), "{}", quantity.name());
        }
        for kind in MachineKind::ALL {
            let geometry = kind.geometry();
            for quantity in Quantity::for_kind(kind).iter().filter(|quantity| quantity.is_position()) {
                assert_eq!(geometry.by_slides(*quantity, 0.02).len(), geometry.slides.len(), "{}", quantity.name());
            }
        }
    }

    #[test]
    fn positions_go_with_the_slides_as_equations_of_the_geometry_have_it() {
        // r φ₁ = −x − y, r φ₂ = x − y
        let weights = |quantity| MachineKind::HFrame.geometry().by_slides(quantity, 0.5);
        assert_eq!(weights(LeftAngle), [-2.0, -2.0]);
        assert_eq!(weights(RightRotorAngle), [2.0, -2.0]);
        assert_eq!(weights(BridgePosition), [1.0, 0.0]);
        assert_eq!(weights(CartPosition), [0.0, 1.0]);
        assert!(weights(CartSpeed).is_empty() && weights(LeftCurrent).is_empty());
    }
}
