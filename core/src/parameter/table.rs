//! The rows: every number that a case file can hold.

use super::field::{
    Of, always, amplifier, breakaway, is_amplifier, is_brushed, make, motor, of_drive, of_friction, of_law, of_simple,
    of_slide, part, points, set_coulomb, set_radius, set_rated_current, set_simple, set_stribeck_decay,
    set_stribeck_force, set_stribeck_velocity, simple, slide_point, stepper, stiffness, stribeck_decay, stribeck_force,
    stribeck_velocity,
};
use super::{Arm, Fallback, Field, INPUT, InStructure, Off, Parameter, Range, Sum, Tuned};
use crate::design::Structure;
use crate::friction::Law;
use crate::machine::Slide;

const fn row(
    key: &'static str,
    symbol: &'static str,
    unit: &'static str,
    default: Fallback,
    range: Range,
    example: &'static str,
    sentence: &'static str,
) -> Parameter {
    let (field, off) = (Field::Elsewhere, Off::No);
    Parameter { key, symbol, unit, default, range, sentence, example, field, off, follows: &[], part: None, gain: None }
}

impl Parameter {
    /// A number without a table of its own.
    pub const fn unwritten(unit: &'static str, range: Range, example: &'static str) -> Self {
        row("", "", unit, Fallback::Required, range, example, "")
    }

    /// Sets its location in machines.
    const fn at(self, field: Field) -> Self {
        Self { field, ..self }
    }

    /// Sets its location in a structure.
    const fn held(self, gain: InStructure) -> Self {
        Self { gain: Some(gain), ..self }
    }

    /// Lets it vary with all others of that name.
    const fn off(self, with: &'static str) -> Self {
        Self { off: Off::With(with), ..self }
    }

    /// Lets it vary separately, and only if everything is varied.
    const fn alone(self) -> Self {
        Self { off: Off::Alone, ..self }
    }

    /// Makes it follow the first of these with an equal value.
    const fn follows(self, keys: &'static [&'static str]) -> Self {
        Self { follows: keys, ..self }
    }

    /// Makes it part of that sum, with that arm.
    const fn part(self, sum: Sum, arm: Arm) -> Self {
        Self { part: Some((sum, arm)), ..self }
    }
}

/// The same rows outside of sums, which exist for axes only.
const fn alone<const N: usize>(mut rows: [Parameter; N]) -> [Parameter; N] {
    let mut i = 0;
    while i < N {
        rows[i] = Parameter { part: None, ..rows[i] };
        i += 1;
    }
    rows
}

use Arm::{Gear, One, Radius};
use Fallback::{Required, Value, Words};

const ANY: Range = Range::ANY;
const POSITIVE: Range = Range::POSITIVE;
const NOT_NEGATIVE: Range = Range::NOT_NEGATIVE;
/// Times in a run.
const TIME: Range = Range::new(0.0, 1e9);
const DURATION: Range = Range::new(1e-12, 1e9);
const FREQUENCY: Range = Range::new(1e-9, 1e9);
/// Integers of TOML, 0 to 2⁶³ − 1: read by their digits, since a double does not represent all of them.
const SEED: Range = Range { below: true, ..Range::whole(0.0, i64::MAX as f64) };
const RESERVE: Range = Range::new(0.0, 0.9);
const UP_TO_ONE: Range = Range { above: true, ..Range::new(0.0, 1.0) };

/// A number of a structure, which may be absent.
trait Held {
    fn held(&self) -> Option<f64>;
    fn hold(&mut self, value: f64);
}

impl Held for f64 {
    fn held(&self) -> Option<f64> {
        Some(*self)
    }

    fn hold(&mut self, value: f64) {
        *self = value;
    }
}

impl Held for Option<f64> {
    fn held(&self) -> Option<f64> {
        *self
    }

    fn hold(&mut self, value: f64) {
        *self = Some(value);
    }
}

/// Location of a number in a structure, or in an optional part of it; none for other structures.
macro_rules! gain {
    ($structure:ident.$field:ident, $tuned:expr) => {
        InStructure {
            get: |structure| if let Structure::$structure(own) = structure { own.$field.held() } else { None },
            set: |structure, value| {
                if let Structure::$structure(own) = structure {
                    own.$field.hold(value);
                }
            },
            tuned: $tuned,
        }
    };
    ($structure:ident.$part:ident?.$field:ident, $tuned:expr) => {
        InStructure {
            get: |structure| {
                let Structure::$structure(own) = structure else { return None };
                own.$part.as_ref().and_then(|part| part.$field.held())
            },
            set: |structure, value| {
                if let Structure::$structure(own) = structure {
                    own.$part.iter_mut().for_each(|part| part.$field.hold(value));
                }
            },
            tuned: $tuned,
        }
    };
}

/// Friction of one body: the rows with that body's key, symbols, units and examples.
macro_rules! friction {
    ($key:literal, $body:ident, $whose:literal, $arm:expr, $arm_of_slope:expr, $viscous:literal, $coulomb:literal, $static:literal, $slope:literal, $load:literal,
     $slope_example:literal, $load_example:literal, $static_example:literal,
     $velocity:literal, $velocity_example:literal, $decay:literal, $decay_example:literal,
     $stiffness:literal, $stiffness_example:literal) => {
        [
            row(
                concat!($key, ".friction.viscous"),
                $viscous,
                $slope,
                Value(0.0),
                NOT_NEGATIVE,
                $slope_example,
                "Viscous friction: resistance per speed.",
            )
            .at(of_friction!($body, |f| Some(f.forward.viscous), |f, value| f.forward.viscous = value))
            .off(concat!($whose, " viscous friction"))
            .part(Sum::Viscous, $arm_of_slope),
            row(
                concat!($key, ".friction.coulomb"),
                $coulomb,
                $load,
                Value(0.0),
                NOT_NEGATIVE,
                $load_example,
                "Coulomb friction: friction that does not depend on speed.",
            )
            .at(of_friction!($body, |f| Some(f.forward.coulomb), |f, value| set_coulomb(f, true, value)))
            .off(concat!($whose, " dry friction"))
            .part(Sum::Coulomb, $arm),
            row(
                concat!($key, ".friction.static"),
                $static,
                $load,
                Words("as `coulomb`, on each side"),
                NOT_NEGATIVE,
                $static_example,
                "Breakaway: largest friction at rest; at least `coulomb`.",
            )
            .at(of_friction!($body, |f| breakaway(f, true), |f, value| f.forward.breakaway = value))
            .off(concat!($whose, " dry friction"))
            .follows(&[concat!($key, ".friction.coulomb")]),
            row(
                concat!($key, ".friction.viscous_backward"),
                $viscous,
                $slope,
                Words("as `viscous`"),
                NOT_NEGATIVE,
                $slope_example,
                "Viscous friction in the negative direction.",
            )
            .at(of_friction!($body, |f| Some(f.backward.viscous), |f, value| f.backward.viscous = value))
            .off(concat!($whose, " viscous friction"))
            .follows(&[concat!($key, ".friction.viscous")])
            .part(Sum::Viscous, $arm_of_slope),
            row(
                concat!($key, ".friction.coulomb_backward"),
                $coulomb,
                $load,
                Words("as `coulomb`"),
                NOT_NEGATIVE,
                $load_example,
                "Coulomb friction in the negative direction.",
            )
            .at(of_friction!($body, |f| Some(f.backward.coulomb), |f, value| set_coulomb(f, false, value)))
            .off(concat!($whose, " dry friction"))
            .follows(&[concat!($key, ".friction.coulomb")])
            .part(Sum::Coulomb, $arm),
            row(
                concat!($key, ".friction.static_backward"),
                $static,
                $load,
                Words("as `static`; without it as `coulomb_backward`"),
                NOT_NEGATIVE,
                $static_example,
                "Breakaway in the negative direction; at least `coulomb_backward`.",
            )
            .at(of_friction!($body, |f| breakaway(f, false), |f, value| f.backward.breakaway = value))
            .off(concat!($whose, " dry friction"))
            .follows(&[concat!($key, ".friction.static"), concat!($key, ".friction.coulomb_backward")]),
            row(
                concat!($key, ".friction.stribeck.force"),
                "F_s",
                $load,
                Required,
                NOT_NEGATIVE,
                $load_example,
                "By how much the breakaway exceeds `coulomb`, on each side, eq. (14); instead of `static`.",
            )
            .at(of_friction!($body, |f| stribeck_force(f), |f, value| set_stribeck_force(f, value)))
            .off(concat!($whose, " dry friction")),
            row(
                concat!($key, ".friction.stribeck.decay"),
                "F_τ",
                $decay,
                Words("from `velocity`"),
                POSITIVE,
                $decay_example,
                "Decay of that excess with speed: e^(−F_τ v²), eq. (14); 1 / velocity².",
            )
            .at(of_friction!($body, |f| stribeck_decay(f), |f, value| set_stribeck_decay(f, value))
                .form(concat!($key, ".friction.stribeck.velocity"))),
            row(
                concat!($key, ".friction.stribeck.velocity"),
                "v_s",
                $velocity,
                Words("from `decay`"),
                POSITIVE,
                $velocity_example,
                "Speed at which 1/e of that is left. With `shape = \"exponential\"` it goes as e^(−v/v_s), else as e^(−(v/v_s)²).",
            )
            .at(of_friction!($body, |f| stribeck_velocity(f), |f, value| set_stribeck_velocity(f, value)))
            .off(concat!($whose, " Stribeck velocity")),
            row(
                concat!($key, ".friction.smooth.breakaway_velocity"),
                "v_b",
                $velocity,
                Required,
                POSITIVE,
                $velocity_example,
                "Speed at which a smooth law peaks, near `static`; it never sticks (Simscape's law).",
            )
            .at(of_law!($body, Smooth, breakaway_velocity))
            .off(concat!($whose, " breakaway velocity")),
            row(
                concat!($key, ".friction.lugre.stiffness"),
                "σ₀",
                $stiffness,
                Required,
                POSITIVE,
                $stiffness_example,
                "Stiffness of the bristles, which replace sticking.",
            )
            .at(of_law!($body, LuGre, stiffness))
            .off(concat!($whose, " bristles' stiffness")),
            row(
                concat!($key, ".friction.lugre.damping"),
                "σ₁",
                $slope,
                Required,
                NOT_NEGATIVE,
                $slope_example,
                "Damping of the bristles.",
            )
            .at(of_law!($body, LuGre, damping))
            .off(concat!($whose, " bristles' damping")),
            row(
                concat!($key, ".friction.lugre.velocity"),
                "v_s",
                $velocity,
                Required,
                POSITIVE,
                $velocity_example,
                "Stribeck velocity of the transition from `static` to `coulomb`.",
            )
            .at(of_law!($body, LuGre, velocity))
            .off(concat!($whose, " Stribeck velocity")),
        ]
    };
}

/// Inertia of one pulley: given, or from its geometry.
macro_rules! pulley {
    ($body:ident, $inertia:literal, $place:expr) => {
        [
            row(
                concat!(stringify!($body), ".inertia"),
                $inertia,
                "kg m^2",
                Required,
                POSITIVE,
                "6.3e-5 kg m^2",
                "Moment of inertia about its axis; or a table with the four rows below.",
            )
            .at($place)
            .off("pulleys' inertia")
            .part(Sum::Inertia, One),
            row(
                concat!(stringify!($body), ".inertia.outer_diameter"),
                "d_o",
                "m",
                Required,
                POSITIVE,
                "38.3 mm",
                "Outer diameter of the hollow cylinder that represents the pulley.",
            )
            .at(Field::PartOf(concat!(stringify!($body), ".inertia"))),
            row(
                concat!(stringify!($body), ".inertia.bore_diameter"),
                "d_i",
                "m",
                Value(0.0),
                NOT_NEGATIVE,
                "6.35 mm",
                "Diameter of its bore; smaller than the outer one.",
            )
            .at(Field::PartOf(concat!(stringify!($body), ".inertia"))),
            row(concat!(stringify!($body), ".inertia.width"), "w", "m", Required, POSITIVE, "12.7 mm", "Its width.")
                .at(Field::PartOf(concat!(stringify!($body), ".inertia"))),
            row(
                concat!(stringify!($body), ".inertia.density"),
                "ρ",
                "kg/m^3",
                Required,
                POSITIVE,
                "2.7 g/cm^3",
                "Density of its material.",
            )
            .at(Field::PartOf(concat!(stringify!($body), ".inertia"))),
        ]
    };
}

/// A recorded quantity: the three rows of its analogue-to-digital converter.
macro_rules! channel {
    ($quantity:literal, $unit:literal, $step:literal, $noise:literal, $range:literal) => {
        [
            row(
                concat!("measurement.", $quantity, ".step"),
                "",
                $unit,
                Words("not rounded"),
                POSITIVE,
                $step,
                "Step of the converter; the nearest one is recorded.",
            ),
            row(
                concat!("measurement.", $quantity, ".noise"),
                "",
                $unit,
                Value(0.0),
                NOT_NEGATIVE,
                $noise,
                "Standard deviation of Gaussian noise, added before the converter.",
            ),
            row(
                concat!("measurement.", $quantity, ".range"),
                "",
                $unit,
                Words("not clipped"),
                POSITIVE,
                $range,
                "Largest magnitude that the converter outputs; at least `step`.",
            ),
        ]
    };
}

#[rustfmt::skip]
const MOTOR: &[Parameter] = &[
    row("motor.torque_constant", "K_t", "N m/A", Required, NOT_NEGATIVE, "23 mN m/A", "Torque per ampere, at the motor's own shaft.")
        .at(motor!(torque_constant)).off("motor constants"),
    row("motor.back_emf_constant", "K_e", "V s/rad", Required, NOT_NEGATIVE, "23 mV s/rad", "Voltage per speed, at the motor's own shaft.")
        .at(motor!(back_emf_constant)).off("motor constants"),
    row("motor.resistance", "R", "ohm", Required, POSITIVE, "0.71 ohm", "Resistance of the armature.")
        .at(motor!(resistance)).off("resistance"),
    row("motor.inductance", "L", "H", Value(0.0), NOT_NEGATIVE, "0.66 mH", "Inductance of the armature; with 0 the current follows the voltage at once.")
        .at(motor!(inductance)).off("inductance"),
    row("motor.rotor_inertia", "J_r", "kg m^2", Value(0.0), NOT_NEGATIVE, "4.2e-6 kg m^2", "Inertia of the rotor, at the motor's own shaft.")
        .at(motor!(rotor_inertia)).off("rotor inertia").part(Sum::Inertia, Gear(2)),
    row("motor.gear_ratio", "n", "", Value(1.0), Range::new(1e-6, 1e6), "5.9", "Motor turns per turn of the drive pulley.")
        .at(motor!(gear_ratio)),
    row("motor.gear_efficiency", "η", "", Value(1.0), UP_TO_ONE, "0.73", "Share of the power that the gear transmits, whichever side drives.")
        .at(of_drive!(motor, |m| is_brushed(m).then_some(m.gear_efficiency), |m, value| m.gear_efficiency = value)),
    row("motor.backlash", "2α", "rad", Value(0.0), Range { below: true, ..Range::new(0.0, 6.3) }, "0.5 deg", "Backlash of the gear: angle by which the drive pulley can turn while the rotor stands still. Needs `gear_stiffness`.")
        .at(motor!(play backlash)).off("gear's backlash"),
    row("motor.gear_stiffness", "k_g", "N m/rad", Words("stiff"), POSITIVE, "300 N m/rad", "Stiffness of the gear between rotor and drive pulley, at the pulley; makes the rotor an inertia of its own.")
        .at(motor!(play stiffness)).off("gear's stiffness"),
    row("motor.gear_damping", "c_g", "N m s/rad", Value(0.0), NOT_NEGATIVE, "0.01 N m s", "Damping of the gear where its flanks touch, at the pulley.")
        .at(motor!(play damping)).off("gear's damping"),
    row("motor.speed_constant", "K_v", "rad/s/V", Words("not used with both constants"), POSITIVE, "190 rpm/V", "Speed per volt without load: K_t = K_e = 1/K_v, unless these are given."),
    row("motor.rated.voltage", "V_n", "V", Required, POSITIVE, "24 V", "Rated voltage; K_t, K_e and `resistance` follow from the rating unless they are given."),
    row("motor.rated.speed", "ω_n", "rad/s", Required, POSITIVE, "3000 rpm", "Speed under the rated load."),
    row("motor.rated.torque", "M_n", "N m", Required, POSITIVE, "0.32 N m", "Rated torque, at the motor's own shaft."),
    row("motor.rated.current", "I_n", "A", Required, POSITIVE, "5.5 A", "Current at that torque."),
    row("motor.rated.no_load_current", "I_0", "A", Value(0.0), NOT_NEGATIVE, "0.4 A", "Current without load, which overcomes the motor's own friction."),
];

#[rustfmt::skip]
const DRIVE: &[Parameter] = &[
    row("drive.force_per_input", "k_F", "N/V", Required, POSITIVE, "0.65 N/V", "Force at the belt per unit of input; if inputs are counts, a count counts as a volt.")
        .at(of_simple!(force)).off("motor constants"),
    row("drive.drag", "d", "N s/m", Value(0.0), NOT_NEGATIVE, "12 N s/m", "Braking force of the drive per speed: back-EMF and friction of the motor.")
        .at(of_simple!(drag)).off("drag"),
];

#[rustfmt::skip]
const AMPLIFIER: &[Parameter] = &[
    row("amplifier.gain", "", "", Value(1.0), ANY, "1", "Output, V or A, per unit of input; negative if the wires are swapped.")
        .at(of_drive!(amplifier, |a| is_amplifier(a).then_some(a.gain), |a, value| a.gain = if is_amplifier(a) { value } else { a.gain })),
    row("amplifier.voltage_limit", "V_max", "V", Words("none"), POSITIVE, "24 V", "Largest voltage at the motor's terminals, in either direction.")
        .at(amplifier!(voltage_limit)),
    row("amplifier.current_limit", "I_max", "A", Words("none"), POSITIVE, "12 A", "Largest current, either way.")
        .at(amplifier!(current_limit)),
    row("amplifier.bandwidth", "f_b", "Hz", Words("none: the current follows at once"), FREQUENCY, "1 kHz", "Bandwidth of the current loop, first order; only in current mode.")
        .at(amplifier!(bandwidth)).off("current loop's bandwidth"),
];

#[rustfmt::skip]
const STEPPER: &[Parameter] = &[
    row("stepper.steps_per_turn", "", "", Required, Range::whole(4.0, 1e4), "200", "Full steps per turn, a multiple of four: 4 N for N rotor teeth.")
        .at(stepper!(steps_per_turn)),
    row("stepper.holding_torque", "T_h", "N m", Required, POSITIVE, "0.45 N m", "Holding torque with both phases at rated current; K_m = T_h/(√2 I).")
        .at(of_drive!(motor, |m| m.holding_torque(), |m, value| m.set_holding_torque(value))).off("holding torque"),
    row("stepper.rated_current", "I", "A", Required, POSITIVE, "2 A", "Rated current of each phase, with both phases on.")
        .at(of_drive!(motor, |m| m.stepper.map(|stepper| stepper.rated_current), |m, value| set_rated_current(m, value))).alone(),
    row("stepper.resistance", "R", "ohm", Required, POSITIVE, "1.4 ohm", "Resistance of a phase, with its wires.")
        .at(stepper!(motor resistance)).off("resistance"),
    row("stepper.inductance", "L", "H", Required, POSITIVE, "3 mH", "Inductance of a phase.")
        .at(stepper!(motor inductance)).off("inductance"),
    row("stepper.supply", "V", "V", Required, POSITIVE, "24 V", "Voltage of the driver's supply: largest voltage of a phase, in either direction.")
        .at(of_drive!(amplifier, |a| a.voltage_limit.filter(|_| !is_amplifier(a)), |a, value| if !is_amplifier(a) { a.voltage_limit = Some(value) })).alone(),
    row("stepper.microsteps", "", "", Value(1.0), Range::whole(1.0, 1024.0), "16", "Microsteps per full step.")
        .at(stepper!(microsteps)),
    row("stepper.detent_torque", "T_d", "N m", Value(0.0), NOT_NEGATIVE, "15 mN m", "Amplitude of the torque without current, four periods per tooth pitch; below a quarter of the holding torque.")
        .at(stepper!(detent_torque)).off("detent torque"),
    row("stepper.rotor_inertia", "J_r", "kg m^2", Value(0.0), NOT_NEGATIVE, "5.4e-6 kg m^2", "Inertia of the rotor.")
        .at(stepper!(motor rotor_inertia)).off("rotor inertia"),
];

#[rustfmt::skip]
const RADIUS: &[Parameter] = &[
    row("drive_pulley.radius", "r", "m", Words("from `teeth` and `pitch`"), POSITIVE, "19.4 mm", "Pitch radius, the same for both pulleys.")
        .at(Field::number(|s, _| Some(s.pulley_radius), |s, _, value| set_radius(s, value))).alone(),
    row("drive_pulley.teeth", "z", "", Words("not used with `radius`"), Range::whole(1.0, 1e6), "60", "Number of teeth or grooves; instead of `radius`, with `pitch`.")
        .at(Field::PartOf("drive_pulley.radius")),
    row("drive_pulley.pitch", "p", "m", Words("not used with `radius`"), POSITIVE, "2.03 mm", "Distance from tooth to tooth along the belt.")
        .at(Field::PartOf("drive_pulley.radius")),
];

#[rustfmt::skip]
const CART: &[Parameter] = &[
    row("cart.mass", "M", "kg", Required, POSITIVE, "0.362 kg", "Mass of the cart with its load.")
        .at(always!(Axis, |s| s.cart.mass)).off("mass").part(Sum::Inertia, Radius(2)),
    row("cart.load", "F_L", "N", Value(0.0), ANY, "-3 N", "Constant force on the cart, positive towards larger x.")
        .at(always!(Axis, |s| s.cart.load)).off("load"),
    row("cart.inclination", "θ", "rad", Value(0.0), Range::new(-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2), "10 deg", "Inclination of the axis, positive if the cart climbs towards larger x; adds −M g sin θ to the load.")
        .at(always!(Axis, |s| s.cart.inclination)),
];

#[rustfmt::skip]
const BELT: &[Parameter] = &[
    row("belt.stiffness", "k₁ k₂ k₃", "N/m", Words("from `modulus`, `section` and `spans`"), POSITIVE, "132.76 kN/m",
        "Stiffness of each span: drive pulley to cart, cart to idler pulley, idler pulley to drive pulley. Three \
         values in a list.")
        .at(Field::new(Of::Span, |s, span| stiffness(&s.belt, span), |s, span, value| s.belt.stiffness[span] = value))
        .off("belt's stiffness").part(Sum::Stiffness, One),
    row("belt.modulus", "E", "Pa", Words("not used with `stiffness`"), POSITIVE, "8.335 GPa",
        "Modulus of elasticity, eq. (11); or a list of parts, each `{ share, modulus }`, for a composite.")
        .at(make!(Machine, |belt| !belt.sheet.is_specific, |make, _| make.modulus)).off("belt's stiffness"),
    row("belt.modulus.share", "", "", Required, UP_TO_ONE, "1/3", "Share of the section that is of this material; all shares add up to 1.")
        .at(Field::PartOf("belt.modulus")),
    row("belt.modulus.modulus", "E", "Pa", Required, POSITIVE, "50 GPa", "Modulus of this material.")
        .at(Field::PartOf("belt.modulus")),
    row("belt.section", "A", "m^2", Words("not used with `stiffness`"), POSITIVE, "5.5626 mm^2",
        "Cross-section that carries the load; or `{ plain, toothed, toothed_share }` for a toothed belt, eq. (12).")
        .at(make!(Machine, |belt| !belt.sheet.is_specific, |make, _| make.section)),
    row("belt.section.plain", "A_nt", "m^2", Required, POSITIVE, "5.5626 mm^2", "Cross-section between the teeth.")
        .at(Field::PartOf("belt.section")),
    row("belt.section.toothed", "A_t", "m^2", Required, POSITIVE, "10.4 mm^2", "Cross-section at a tooth.")
        .at(Field::PartOf("belt.section")),
    row("belt.section.toothed_share", "", "", Required, Range::new(0.0, 1.0), "0.5", "Share of the belt's length that has the cross-section `toothed`.")
        .at(Field::PartOf("belt.section")),
    row("belt.specific_stiffness", "E A", "N", Words("of the `type`; not used with `stiffness`"), POSITIVE, "140 kN",
        "Force per unit strain, C_spez of catalogues, instead of modulus and section; in N/m, N/mm it is that per width, and `width` goes with it.")
        .at(make!(Machine, |belt| belt.sheet.is_specific, |make, _| make.modulus)).off("belt's stiffness"),
    row("belt.width", "b", "m", Words("needed with `type`, or a stiffness per width"), POSITIVE, "10 mm", "Width of the belt."),
    row("belt.mass_per_length", "", "kg/m", Words("of the `type`, or unknown"), POSITIVE, "0.03 kg/m", "Mass per length; not in the equations, but `taut show` reports its share."),
    row("belt.allowed_tension", "F_zul", "N", Words("of the `type`, or unknown"), POSITIVE, "560 N", "Allowed tension of the belt; `taut show` reports the safety."),
    row("belt.spans", "l₁ l₂ l₃", "m", Words("not used with `stiffness`"), POSITIVE, "0.34925 m", "Length of each span. Three values in a list.")
        .at(make!(Span, |_belt| true, |make, span| make.spans[span])),
    row("belt.damping", "c₁ c₂ c₃", "N s/m", Value(0.0), NOT_NEGATIVE, "0 N s/m", "Damping of each span, parallel to its stiffness. Three values in a list.")
        .at(Field::new(Of::Span, |s, span| s.belt.damping.get(span).copied(), |s, span, value| s.belt.damping[span] = value))
        .off("belt's damping"),
    row("belt.damping_ratio", "ζ", "", Words("not used with `damping`"), Range { below: true, ..Range::new(0.0, 1.0) }, "0.02",
        "Damping ratio of the slowest elastic mode at x = 0; every span is damped in proportion to its stiffness, c = 2 ζ k / ω₀.")
        .at(Field::PartOf("belt.damping")),
    row("belt.loss_factor", "η", "", Words("not used with `damping`"), Range { below: true, ..Range::new(0.0, 2.0) }, "0.04",
        "Loss factor of the belt at that mode: η = 2 ζ.")
        .at(Field::PartOf("belt.damping")),
    row("belt.pretension", "T₀", "N", Words("none: spans can push"), POSITIVE, "50 N", "Tension of every span at rest; a span without tension is slack and carries no force.")
        .at(Field::number(|s, _| s.belt.pretension, |s, _, value| s.belt.pretension = s.belt.pretension.map(|_| value))).off("belt's pretension"),
];

#[rustfmt::skip]
const TRAVEL: &[Parameter] = &[
    row("travel.min", "x_min", "m", Required, ANY, "-0.2 m", "Least position of the cart.")
        .at(part!(Axis, |s| s.cart.travel, &mut s.cart.travel => min)),
    row("travel.max", "x_max", "m", Required, ANY, "0.3 m", "Greatest position of the cart; above `min`.")
        .at(part!(Axis, |s| s.cart.travel, &mut s.cart.travel => max)),
    row("travel.stop_stiffness", "k_s", "N/m", Words("no stops: a run ends there"), POSITIVE, "20 kN/m", "Stiffness of the end stops.")
        .at(part!(Axis, |s| s.cart.travel.and_then(|travel| travel.stop), s.cart.travel.as_mut().and_then(|travel| travel.stop.as_mut()) => stiffness)),
    row("travel.stop_damping", "c_s", "N s/m", Value(0.0), NOT_NEGATIVE, "50 N s/m", "Their damping.")
        .at(part!(Axis, |s| s.cart.travel.and_then(|travel| travel.stop), s.cart.travel.as_mut().and_then(|travel| travel.stop.as_mut()) => damping)),
];

#[rustfmt::skip]
const ALONG: &[Parameter] = &[
    row("cart.friction.along.position", "x", "m", Required, ANY, "0.1 m", "First number of each point of `along`: position along the travel, increasing.")
        .at(points!(0, |s| s.cart.along)),
    row("cart.friction.along.factor", "", "", Required, NOT_NEGATIVE, "1.5", "Second number: factor on Coulomb friction, breakaway and `stribeck.force` there; linear between points.")
        .at(points!(1, |s| s.cart.along)),
];

#[rustfmt::skip]
const FORCES: &[Parameter] = &[
    row("cart.force_along.position", "x", "m", Required, ANY, "0.1 m", "First number of each point of `force_along`: position along the travel, increasing.")
        .at(points!(0, |s| s.cart.forces.along)),
    row("cart.force_along.force", "F_x", "N", Required, ANY, "1.5 N", "Second number: force on the cart there in either direction of motion, positive towards larger x; linear between points.")
        .at(points!(1, |s| s.cart.forces.along)),
    row("cart.force_by_speed.speed", "v", "m/s", Required, ANY, "0.1 m/s", "First number of each point of `force_by_speed`: speed of the cart, increasing.")
        .at(points!(0, |s| s.cart.forces.by_speed)),
    row("cart.force_by_speed.force", "F_v", "N", Required, ANY, "-1.5 N", "Second number: force on the cart at that speed, positive towards larger x; linear between points.")
        .at(points!(1, |s| s.cart.forces.by_speed)),
];

#[rustfmt::skip]
const ENCODER: &[Parameter] = &[
    row("encoder.lines", "", "", Words("from `counts`"), POSITIVE, "512", "Lines per turn, or at the cart per metre; in quadrature each gives four counts.")
        .at(part!(Machine, |s| s.encoder, &mut s.encoder => lines)),
    row("encoder.counts", "", "", Words("from `lines`"), POSITIVE, "2048", "Counts per turn, or at the cart per metre, every edge counted; instead of `lines`.")
        .at(Field::PartOf("encoder.lines")),
];

#[rustfmt::skip]
const SCALE: &[Parameter] = &[
    row("scale.lines", "", "", Words("from `counts`"), POSITIVE, "50000", "Lines per metre of a scale at the cart, beside an encoder at motor or drive pulley; in quadrature each gives four counts.")
        .at(part!(Axis, |s| s.scale, &mut s.scale => lines)),
    row("scale.counts", "", "", Words("from `lines`"), POSITIVE, "200000", "Counts per metre, every edge counted; instead of `lines`.")
        .at(Field::PartOf("scale.lines")),
];

#[rustfmt::skip]
const MEASUREMENT: &[Parameter] = &[
    row("measurement.every", "", "s", Words("the experiment's `every`"), DURATION, "1 ms", "Interval between samples."),
    row("measurement.delay", "", "s", Value(0.0), TIME, "2 ms", "Delay of the recorded value: the row of time t shows the value at t minus this."),
    row("measurement.jitter", "", "s", Value(0.0), TIME, "20 us", "Standard deviation of a sample's instant; at most a quarter of the interval."),
    row("measurement.seed", "", "", Value(1.0), SEED, "1", "Seed of noise and jitter; the same seed gives the same ones."),
];

#[rustfmt::skip]
const EXPERIMENT: &[Parameter] = &[
    row("experiment.until", "", "s", Required, DURATION, "1 s", "End of the run."),
    row("experiment.every", "", "s", Required, DURATION, "1 ms", "Interval between the rows of the result, the last of which is at the end; it affects neither accuracy nor figures."),
];

#[rustfmt::skip]
const FIT: &[Parameter] = &[
    row("fit.starts", "", "", Value(1.0), Range::whole(1.0, 1000.0), "8", "Number of points from which the search starts: the values of the file, and others within the bounds."),
    row("fit.seed", "", "", Value(1.0), SEED, "1", "Which other points."),
    row("fit.until", "", "s", Words("all of each log"), DURATION, "8 s", "Time in each log from which on it is compared, but not fitted."),
    row("fit.windows", "", "s", Words("each log is one"), DURATION, "1 s", "Length of the windows into which logs are cut, each but the first of a log with a start of its own."),
];

#[rustfmt::skip]
const LOG: &[Parameter] = &[
    row("experiment.log.time.every", "", "s", Required, DURATION, "20 ms", "Interval between rows, for a file without a column of times."),
    row("experiment.log.from", "", "s", Words("the first row"), ANY, "0.1 s", "Where the log begins, on its own clock; this is time zero."),
    row("experiment.log.steps_per_turn", "", "", Value(200.0), Range::whole(1.0, 1e6), "400", "Full steps of the motor in a turn of its shaft, for a `preset` whose file counts in them."),
    row("experiment.log.to", "", "s", Words("the last row"), ANY, "2 s", "Where it ends."),
];

#[rustfmt::skip]
const INITIAL: &[Parameter] = &[
    row("experiment.initial.drive_angle", "φ₁", "rad", Value(0.0), ANY, "0 rad", "Angle of the drive pulley at time zero."),
    row("experiment.initial.drive_speed", "φ₁′", "rad/s", Value(0.0), ANY, "0 rad/s", "Its speed."),
    row("experiment.initial.cart_position", "x", "m", Value(0.0), ANY, "0 mm", "Position of the cart at time zero."),
    row("experiment.initial.cart_speed", "x′", "m/s", Value(0.0), ANY, "0 m/s", "Its speed."),
    row("experiment.initial.idler_angle", "φ₃", "rad", Value(0.0), ANY, "0 rad", "Angle of the idler pulley at time zero."),
    row("experiment.initial.idler_speed", "φ₃′", "rad/s", Value(0.0), ANY, "0 rad/s", "Its speed."),
    row("experiment.initial.motor_current", "i", "A", Value(0.0), ANY, "0 A", "Armature current at time zero; only if it does not follow at once: with an inductance, or in current mode with a bandwidth."),
];

#[rustfmt::skip]
const BRIDGE: &[Parameter] = &[
    row("bridge.mass", "m", "kg", Required, POSITIVE, "0.838 kg", "Mass of the bridge without the cart; of the cart with its load.")
        .at(of_slide!(|s| Some(s.mass), |s, value| s.mass = value)).off("mass"),
    row("bridge.load", "F_L", "N", Value(0.0), ANY, "-3 N", "Constant force on it, positive towards larger x, or y of the cart.")
        .at(of_slide!(|s| Some(s.load), |s, value| s.load = value)).off("load"),
    row("bridge.force_by_speed.speed", "v", "m/s", Required, ANY, "0.1 m/s", "First number of each point of `force_by_speed`: its speed, increasing.")
        .at(points!(slide 0, |s| s.forces.by_speed)),
    row("bridge.force_by_speed.force", "F_v", "N", Required, ANY, "-1.5 N", "Second number: force on it at that speed, positive towards larger x or y; linear between points.")
        .at(points!(slide 1, |s| s.forces.by_speed)),
    row("bridge.travel.min", "", "m", Required, ANY, "-0.2 m", "Least position.")
        .at(of_slide!(travel min)),
    row("bridge.travel.max", "", "m", Required, ANY, "0.2 m", "Greatest position; above `min`.")
        .at(of_slide!(travel max)),
    row("bridge.travel.stop_stiffness", "k_s", "N/m", Words("no stops: a run ends there"), POSITIVE, "20 kN/m", "Stiffness of the end stops.")
        .at(of_slide!(stop stiffness)),
    row("bridge.travel.stop_damping", "c_s", "N s/m", Value(0.0), NOT_NEGATIVE, "50 N s/m", "Their damping.")
        .at(of_slide!(stop damping)),
];

#[rustfmt::skip]
const BRIDGE_YAW: &[Parameter] = &[
    row("bridge.yaw.inertia", "I", "kg m^2", Required, POSITIVE, "0.02 kg m^2", "Moment of inertia of the bridge without the cart, about a vertical axis through its middle.")
        .at(part!(Gantry, |s| s.yaw, &mut s.yaw => inertia)),
    row("bridge.yaw.belt_spacing", "2 a", "m", Required, POSITIVE, "0.5 m", "Distance of the belts on either side of the bridge.")
        .at(part!(Gantry, |s| s.yaw, &mut s.yaw => belt_spacing)),
    row("bridge.yaw.bearing_spacing", "s", "m", Required, POSITIVE, "60 mm", "Distance of the bridge's two bearings along its travel.")
        .at(part!(Gantry, |s| s.yaw, &mut s.yaw => bearing_spacing)),
    row("bridge.yaw.bearing_stiffness", "k_b", "N/m", Required, POSITIVE, "20 kN/mm", "Stiffness of each bearing across the travel; of four bearings on two rails twice as much.")
        .at(part!(Gantry, |s| s.yaw, &mut s.yaw => bearing_stiffness)).off("bearing"),
    row("bridge.yaw.bearing_damping", "c_b", "N s/m", Value(0.0), NOT_NEGATIVE, "100 N s/m", "Damping of each bearing.")
        .at(part!(Gantry, |s| s.yaw, &mut s.yaw => bearing_damping)),
];

#[rustfmt::skip]
const GANTRY_INITIAL: &[Parameter] = &[
    row("gantry.initial.bridge_position", "x", "m", Value(0.0), ANY, "0 mm", "Position of the bridge at time zero."),
    row("gantry.initial.bridge_speed", "x′", "m/s", Value(0.0), ANY, "0 m/s", "Its speed."),
    row("gantry.initial.cart_position", "y", "m", Value(0.0), ANY, "0 mm", "Position of the cart on the bridge."),
    row("gantry.initial.cart_speed", "y′", "m/s", Value(0.0), ANY, "0 m/s", "Its speed."),
    row("gantry.initial.left_angle", "φ₁", "rad", Words("without strain of the belt"), ANY, "0 rad", "Angle of the left drive pulley (A)."),
    row("gantry.initial.left_speed", "φ₁′", "rad/s", Words("without strain of the belt"), ANY, "0 rad/s", "Its speed."),
    row("gantry.initial.left_current", "i₁", "A", Value(0.0), ANY, "0 A", "Current of the left motor; only where it does not follow at once."),
    row("gantry.initial.right_angle", "φ₂", "rad", Words("without strain of the belt"), ANY, "0 rad", "Angle of the right drive pulley (B)."),
    row("gantry.initial.right_speed", "φ₂′", "rad/s", Words("without strain of the belt"), ANY, "0 rad/s", "Its speed."),
    row("gantry.initial.right_current", "i₂", "A", Value(0.0), ANY, "0 A", "Current of the right motor; only where it does not follow at once."),
    row("gantry.initial.cart_pulley_angle", "φ₃", "rad", Words("without strain of the belt"), ANY, "0 rad", "Angle of the cart's drive pulley, of a dual belt alone."),
    row("gantry.initial.cart_pulley_speed", "φ₃′", "rad/s", Words("without strain of the belt"), ANY, "0 rad/s", "Its speed."),
    row("gantry.initial.cart_current", "i₃", "A", Value(0.0), ANY, "0 A", "Current of the cart's motor; only where it does not follow at once."),
];

#[rustfmt::skip]
const INPUTS: &[Parameter] = &[
    row("input.step", "", INPUT, Required, ANY, "5 V", "Height of the step."),
    row("input.step.at", "", "s", Value(0.0), TIME, "0 s", "When it comes."),
    row("input.pulse", "", INPUT, Required, ANY, "5 V", "Height of the pulse."),
    row("input.pulse.for", "", "s", Required, DURATION, "0.25 s", "How long it lasts."),
    row("input.pulse.at", "", "s", Value(0.0), TIME, "0 s", "When it begins."),
    row("input.ramp", "", INPUT, Required, ANY, "1.2 V", "Value that the ramp reaches from zero, and then holds."),
    row("input.ramp.over", "", "s", Required, DURATION, "1 s", "How long it takes."),
    row("input.ramp.at", "", "s", Value(0.0), TIME, "0 s", "When it begins."),
    row("input.triangle", "", INPUT, Required, ANY, "3 V", "Peak of the triangle wave, which begins at zero and rises first."),
    row("input.triangle.frequency", "", "Hz", Required, FREQUENCY, "2 Hz", "Periods per second."),
    row("input.square", "", INPUT, Required, ANY, "3 V", "Height of the square wave, which begins high and goes to the negative of it."),
    row("input.square.frequency", "", "Hz", Required, FREQUENCY, "2 Hz", "Periods per second."),
    row("input.square.duty", "", "", Value(0.5), Range { above: true, below: true, ..Range::new(0.0, 1.0) }, "0.5", "Share of the period that is high."),
    row("input.sine", "", INPUT, Required, ANY, "3 V", "Peak of the sine, without its offset."),
    row("input.sine.frequency", "", "Hz", Required, FREQUENCY, "2 Hz", "Periods per second."),
    row("input.sine.phase", "", "rad", Value(0.0), Range::new(-1e6, 1e6), "90 deg", "Phase at time zero."),
    row("input.sine.offset", "", INPUT, Value(0.0), ANY, "0 V", "Added to the sine."),
    row("input.chirp", "", INPUT, Required, ANY, "2 V", "Peak of a sine whose frequency changes linearly; zero afterwards."),
    row("input.chirp.from", "", "Hz", Required, Range::new(0.0, 1e9), "1 Hz", "Frequency at the beginning."),
    row("input.chirp.to", "", "Hz", Required, Range::new(0.0, 1e9), "300 Hz", "Frequency at the end."),
    row("input.chirp.over", "", "s", Required, DURATION, "10 s", "How long it takes."),
    row("input.multisine", "", INPUT, Required, ANY, "0.2 V", "Peak of each sine of the sum."),
    row("input.multisine.frequencies", "", "Hz", Words("from `from`, `to` and `tones`"), FREQUENCY, "1 Hz", "Frequencies in a list, at most 1000."),
    row("input.multisine.from", "", "Hz", Words("not used with `frequencies`"), FREQUENCY, "1 Hz", "Lowest frequency."),
    row("input.multisine.to", "", "Hz", Words("not used with `frequencies`"), FREQUENCY, "50 Hz", "Highest frequency."),
    row("input.multisine.tones", "", "", Words("not used with `frequencies`"), Range::whole(2.0, 1000.0), "50", "Number of sines, equally spaced in frequency."),
    row("input.prbs", "", INPUT, Required, ANY, "3 V", "Height of a pseudo-random binary sequence, which jumps between plus and minus this."),
    row("input.prbs.bit", "", "s", Required, DURATION, "20 ms", "Shortest time between jumps."),
    row("input.prbs.seed", "", "", Value(1.0), SEED, "1", "Seed of the sequence; the same seed gives the same one."),
    row("input.point.time", "", "s", Required, TIME, "0.1 s", "First number of each point of a `table`, increasing."),
    row("input.point.value", "", INPUT, Required, ANY, "5 V", "Second number of each point; linear between points, the last one held."),
    row("input.element.lasts", "", "s", Words("as long as a `pulse`, `ramp`, `chirp`, `table` or `file` takes"), DURATION, "1 s", "Duration of an element of a `sequence`."),
];

#[rustfmt::skip]
const CONTROLLER: &[Parameter] = &[
    row("controller.every", "T", "s", Required, DURATION, "1 ms", "Sample time."),
    row("controller.delay", "", "s", Value(0.0), TIME, "0.5 ms", "Time from a sample to the command that follows from it; up to 1000 sample times."),
    row("controller.limit", "", INPUT, Words("none"), POSITIVE, "24 V", "Largest command, either way."),
    row("controller.pid.proportional", "K_p", "V/m or A/m", Required, ANY, "2 V/mm", "Command per error of position.").held(gain!(Pid.proportional, Tuned::Gain)),
    row("controller.pid.integral", "K_i", "V/(m s) or A/(m s)", Value(0.0), ANY, "30 V/(mm s)", "Command per integral of the error.").held(gain!(Pid.integral, Tuned::Gain)),
    row("controller.pid.derivative", "K_d", "V s/m or A s/m", Value(0.0), ANY, "25 V s/m", "Command per rate of the error.").held(gain!(Pid.derivative, Tuned::Gain)),
    row("controller.pid.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the derivative's filter, of first order.").held(gain!(Pid.filter, Tuned::Corner("controller.pid.derivative"))),
    row("controller.pid.reference_speed", "c", "", Value(1.0), Range::new(0.0, 10.0), "0", "Weight of the reference's speed in the derivative: 1 differentiates the error, 0 the measurement alone.").held(gain!(Pid.reference_speed, Tuned::No)),
    row("controller.pid.tracking", "", "s", Value(0.05), DURATION, "50 ms", "Time in which the integral follows a command that is limited (anti-windup).").held(gain!(Pid.tracking, Tuned::No)),
    row("controller.cascade.position", "K_v", "rad/s", Required, NOT_NEGATIVE, "60 rad/s", "Commanded speed per error of position.").held(gain!(Cascade.position, Tuned::Gain)),
    row("controller.cascade.speed", "", "V s/m or A s/m", Required, ANY, "30 V s/m", "Command per error of speed; with a current loop the current.").held(gain!(Cascade.speed, Tuned::Gain)),
    row("controller.cascade.speed_integral", "", "V/m or A/m", Value(0.0), ANY, "1 V/mm", "Command per integral of that; with a current loop the current.").held(gain!(Cascade.speed_integral, Tuned::Gain)),
    row("controller.cascade.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the filter of the measured speed, of first order.").held(gain!(Cascade.filter, Tuned::Corner("controller.cascade.speed"))),
    row("controller.cascade.reference_speed", "c", "", Value(1.0), Range::new(0.0, 10.0), "0", "Weight of the reference's speed in the commanded speed; 0 if the drive does not feed it forward.").held(gain!(Cascade.reference_speed, Tuned::No)),
    row("controller.cascade.tracking", "", "s", Value(0.02), DURATION, "20 ms", "Time in which the integrals follow a limited command or current.").held(gain!(Cascade.tracking, Tuned::No)),
    row("controller.cascade.current.proportional", "", "V/A", Required, ANY, "0.3 V/A", "Voltage per error of current.").held(gain!(Cascade.current?.proportional, Tuned::Gain)),
    row("controller.cascade.current.integral", "", "V/(A s)", Value(0.0), ANY, "200 V/(A s)", "Voltage per integral of that.").held(gain!(Cascade.current?.integral, Tuned::Gain)),
    row("controller.cascade.current.limit", "", "A", Words("none"), POSITIVE, "10 A", "Largest current asked for.").held(gain!(Cascade.current?.limit, Tuned::No)),
    row("controller.state_feedback.position", "", "m", Required, POSITIVE, "0.1 mm", "Error of the cart's position that weighs as much as `command`.").held(gain!(StateFeedback.position, Tuned::Gain)),
    row("controller.state_feedback.speed", "", "m/s", Words("no weight"), POSITIVE, "0.1 m/s", "The same of its speed.").held(gain!(StateFeedback.speed, Tuned::Gain)),
    row("controller.state_feedback.integral", "", "m s", Words("no integral"), POSITIVE, "5e-6 m s", "Integral of the measured error that weighs as much: makes it LQI.").held(gain!(StateFeedback.integral, Tuned::Gain)),
    row("controller.state_feedback.command", "", INPUT, Required, POSITIVE, "5 V", "Command that weighs as much as each of these.").held(gain!(StateFeedback.command, Tuned::No)),
    row("controller.state_feedback.disturbance", "", INPUT, Required, POSITIVE, "1 V", "Standard deviation of an unknown command, and of a force on the cart as large, that the Kalman filter expects at each sample.").held(gain!(StateFeedback.disturbance, Tuned::Gain)),
    row("controller.state_feedback.noise", "", "m", Value(0.0), NOT_NEGATIVE, "5 um", "Standard deviation of a measured position; at least 0.3 counts are taken.").held(gain!(StateFeedback.noise, Tuned::No)),
    row("controller.sliding_mode.bandwidth", "λ", "rad/s", Required, POSITIVE, "60 rad/s", "Decay rate of the error on the sliding surface ė + λ e = 0.").held(gain!(SlidingMode.bandwidth, Tuned::No)),
    row("controller.sliding_mode.reaching", "K", "m/s^2", Required, POSITIVE, "4 m/s^2", "Acceleration that drives to the surface.").held(gain!(SlidingMode.reaching, Tuned::No)),
    row("controller.sliding_mode.boundary", "Φ", "m/s", Required, POSITIVE, "0.05 m/s", "Boundary layer: distance from the surface within which `reaching` acts in proportion.").held(gain!(SlidingMode.boundary, Tuned::No)),
    row("controller.sliding_mode.integral", "", "s^-2", Value(0.0), NOT_NEGATIVE, "900 s^-2", "Weight of the error's integral in the surface.").held(gain!(SlidingMode.integral, Tuned::No)),
    row("controller.sliding_mode.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the filter of the measured speed, of first order.").held(gain!(SlidingMode.filter, Tuned::No)),
    row("controller.fuzzy.error", "", "m", Required, POSITIVE, "2 mm", "Error at the outermost sets.").held(gain!(Fuzzy.error, Tuned::No)),
    row("controller.fuzzy.rate", "", "m/s", Required, POSITIVE, "0.1 m/s", "Its rate at the outermost sets.").held(gain!(Fuzzy.rate, Tuned::No)),
    row("controller.fuzzy.command", "", INPUT, Words("none with `slope`"), POSITIVE, "5 V", "Command of a rule of 1: makes it PD."),
    row("controller.fuzzy.slope", "", "V/s or A/s", Words("none with `command`"), POSITIVE, "100 V/s", "Change of the command of a rule of 1: makes it PI."),
    row("controller.fuzzy.rule", "", "", Required, Range::new(-1.0, 1.0), "0.5", "Each value in `rules`."),
    row("controller.fuzzy.filter", "", "Hz", Value(200.0), FREQUENCY, "200 Hz", "Corner of the filter of the rate, of first order.").held(gain!(Fuzzy.filter, Tuned::No)),
    row("controller.feed_forward.inertia", "", "", Value(1.0), Range::new(0.0, 2.0), "1", "Share of the inertial force that is fed forward."),
    row("controller.feed_forward.friction", "", "", Value(1.0), Range::new(0.0, 2.0), "0.8", "Share of the friction that is fed forward."),
    row("controller.feed_forward.lead", "", "s", Words("the delay and half a sample"), TIME, "1 ms", "Time ahead of the sample at which the reference is evaluated."),
    row("controller.disturbance_observer.bandwidth", "", "Hz", Required, FREQUENCY, "10 Hz", "Frequency of its three poles."),
    row("controller.filters.notch", "", "Hz", Words("one of these two"), FREQUENCY, "180 Hz", "Frequency that a notch removes from the command."),
    row("controller.filters.low_pass", "", "Hz", Words("one of these two"), FREQUENCY, "300 Hz", "Corner frequency of a low-pass of second order."),
    row("controller.filters.damping", "ζ_p", "", Value(0.7), Range { above: true, ..Range::new(0.0, 10.0) }, "0.7", "Damping of the filter's poles; a larger value widens a notch."),
    row("controller.filters.depth", "ζ_z", "", Value(0.05), Range::new(0.0, 10.0), "0.05", "Damping of a notch's zeros: its gain there is depth over damping."),
    row("controller.shaper.time", "", "s", Required, TIME, "2.8 ms", "First number of each impulse of `shaper`, increasing."),
    row("controller.shaper.amplitude", "", "", Required, Range::new(-10.0, 10.0), "0.5", "Second number; their sum is 1."),
];

#[rustfmt::skip]
const TUNE: &[Parameter] = &[
    row("tune.bandwidth", "", "Hz", Words("one that suits the axis"), FREQUENCY, "8 Hz", "Bandwidth for which the gains are placed, and from which a search begins."),
    row("tune.damping", "ζ", "", Value(0.8), Range { above: true, ..Range::new(0.0, 10.0) }, "0.8", "Damping ratio for which they are placed."),
    row("tune.sensitivity", "M_s", "", Value(1.8), Range { above: true, ..Range::new(1.0, 100.0) }, "1.6", "Largest allowed magnitude of the sensitivity 1/(1 + L); 1.6 is cautious, 2 is bold."),
    row("tune.complementary", "M_t", "", Value(1.8), Range { above: true, ..Range::new(1.0, 100.0) }, "1.5", "Largest allowed magnitude of the complementary sensitivity L/(1 + L)."),
    row("tune.spread", "", "", Words("uncertainty of a fit, or 0.2"), Range { below: true, ..Range::new(0.0, 1.0) }, "20 %", "Relative uncertainty of each parameter of the axis."),
    row("tune.load", "", "kg", Value(0.0), Range::new(0.0, 1e6), "0.5 kg", "Each value of `load`: a mass that is added to the cart."),
    row("tune.places", "", "", Value(7.0), Range::whole(1.0, 1000.0), "7", "Number of positions along the travel that are evaluated."),
];

#[rustfmt::skip]
const SWEEP: &[Parameter] = &[
    row("sweep.runs", "N", "", Words("required where machines are drawn"), Range::whole(1.0, 1e12), "100000", "Number of machines; `grid` and `one-at-a-time` determine it."),
    row("sweep.seed", "", "", Value(1.0), SEED, "1", "Seed of the draws; the same seed gives the same ones."),
    row("sweep.interval", "", "s", Words("the experiment's `every`"), DURATION, "1 ms", "Interval between the rows of `--trajectories`; figures do not depend on it."),
];

#[rustfmt::skip]
const MOVE: &[Parameter] = &[
    row("move.from", "", "m", Value(0.0), ANY, "0 mm", "Position of the cart at time zero; for a gantry a list: bridge, cart."),
    row("move.to", "", "m", Words("`points` or `gcode` instead"), ANY, "50 mm", "Target of the cart; for a gantry a list: bridge, cart."),
    row("move.speed", "", "m/s", Words("`plan` instead"), POSITIVE, "0.4 m/s", "Largest speed, along the path of a gantry."),
    row("move.acceleration", "", "m/s^2", Words("`plan` instead"), POSITIVE, "5 m/s^2", "Largest acceleration."),
    row("move.jerk", "", "m/s^3", Words("none: a trapezoid"), POSITIVE, "200 m/s^3", "Largest jerk."),
    row("move.snap", "", "m/s^4", Words("none: third order"), POSITIVE, "20000 m/s^4", "Largest snap; only with `jerk`."),
    row("move.plan.speed", "", "m/s", Words("what the machine allows"), POSITIVE, "0.5 m/s", "Largest speed of a move that is planned."),
    row("move.plan.acceleration", "", "m/s^2", Words("what the machine allows"), POSITIVE, "20 m/s^2", "Largest acceleration."),
    row("move.plan.jerk", "", "m/s^3", Words("what the jerk time requires"), POSITIVE, "500 m/s^3", "Largest jerk."),
    row("move.plan.reserve", "", "", Value(0.1), RESERVE, "20 %", "Share of voltage and current, or of the pull-out torque of a stepper, that is reserved."),
    row("move.until", "", "s", Required, DURATION, "1 s", "End of the run."),
    row("move.every", "", "s", Words("the controller's `every`"), DURATION, "1 ms", "Interval between the rows of the result, the last of which is at the end; it affects neither accuracy nor figures."),
    row("move.window", "", "m", Value(1e-4), POSITIVE, "50 um", "Distance from its target within which the cart counts as settled."),
    row("move.points.to", "", "m", Required, ANY, "50 mm", "Each point of a list, or its `to`."),
    row("move.points.center", "", "m", Words("a straight leg"), ANY, "20 mm", "Centre of an arc to the point, for a gantry a list: bridge, cart; counterclockwise unless `clockwise = true`."),
    row("move.points.speed", "", "m/s", Words("the move's"), POSITIVE, "0.1 m/s", "Largest speed towards this point."),
    row("move.points.wait", "", "s", Value(0.0), TIME, "0.2 s", "How long it stands there."),
];

/// Titles of the sections, in the order of the case file, with the key prefix of their rows.
pub(super) const SECTIONS: &[(&str, &[&[Parameter]])] = &[
    ("motor", &[MOTOR]),
    ("stepper", &[STEPPER]),
    ("amplifier", &[AMPLIFIER]),
    (
        "drive_pulley",
        &[
            RADIUS,
            &pulley!(drive_pulley, "J₁", always!(Machine, |s| s.drive_pulley.inertia)),
            &friction!(
                "drive_pulley",
                drive_pulley,
                "pulleys'",
                One,
                One,
                "B₁",
                "τ_c1",
                "τ_b1",
                "N m s/rad",
                "N m",
                "0.0016 N m s",
                "0.0150 N m",
                "0.02 N m",
                "rad/s",
                "0.5 rad/s",
                "s^2/rad^2",
                "4 s^2/rad^2",
                "N m/rad",
                "40 N m/rad"
            ),
        ],
    ),
    ("drive", &[DRIVE]),
    (
        "idler_pulley",
        &[
            &pulley!(idler_pulley, "J₂", always!(Axis, |s| s.idler_pulley.inertia)),
            &friction!(
                "idler_pulley",
                idler_pulley,
                "pulleys'",
                One,
                One,
                "B₂",
                "τ_c2",
                "τ_b2",
                "N m s/rad",
                "N m",
                "0.0016 N m s",
                "0.0150 N m",
                "0.02 N m",
                "rad/s",
                "0.5 rad/s",
                "s^2/rad^2",
                "4 s^2/rad^2",
                "N m/rad",
                "40 N m/rad"
            ),
        ],
    ),
    (
        "cart",
        &[
            CART,
            &friction!(
                "cart",
                cart,
                "cart's",
                Radius(1),
                Radius(2),
                "b",
                "F_c",
                "F_b",
                "N s/m",
                "N",
                "19.0424 N s/m",
                "0.2 N",
                "0.3 N",
                "m/s",
                "0.01 m/s",
                "s^2/m^2",
                "1e4 s^2/m^2",
                "N/m",
                "100 kN/m"
            ),
            ALONG,
            FORCES,
        ],
    ),
    (
        "bridge",
        &[
            BRIDGE,
            &alone(friction!(
                "bridge",
                bridge,
                "bridge's",
                Radius(1),
                Radius(2),
                "b",
                "F_c",
                "F_b",
                "N s/m",
                "N",
                "15 N s/m",
                "1 N",
                "1.5 N",
                "m/s",
                "0.01 m/s",
                "s^2/m^2",
                "1e4 s^2/m^2",
                "N/m",
                "100 kN/m"
            )),
        ],
    ),
    ("bridge.yaw", &[BRIDGE_YAW]),
    ("belt", &[BELT]),
    ("travel", &[TRAVEL]),
    ("encoder", &[ENCODER]),
    ("scale", &[SCALE]),
    (
        "measurement",
        &[
            MEASUREMENT,
            &channel!("motor_current", "A", "10 mA", "5 mA", "10 A"),
            &channel!("motor_voltage", "V", "10 mV", "5 mV", "24 V"),
            &channel!("drive_angle", "rad", "0.1 deg", "0.05 deg", "180 deg"),
            &channel!("drive_speed", "rad/s", "0.1 rad/s", "0.05 rad/s", "100 rad/s"),
            &channel!("cart_position", "m", "5 um", "2 um", "0.5 m"),
            &channel!("cart_speed", "m/s", "1 mm/s", "0.5 mm/s", "2 m/s"),
        ],
    ),
    ("experiment", &[EXPERIMENT]),
    ("experiment.initial", &[INITIAL]),
    ("gantry.initial", &[GANTRY_INITIAL]),
    ("experiment.log", &[LOG]),
    ("input", &[INPUTS]),
    ("controller", &[CONTROLLER]),
    ("move", &[MOVE]),
    ("tune", &[TUNE]),
    ("fit", &[FIT]),
    ("sweep", &[SWEEP]),
];
