//! The equations that run, drawn: one body (after Fig. 18) and the whole axis (after Fig. 19).

use super::diagram::{BlockKind, Diagram, Port, Sign};
use taut::number::engineering;

/// One equation of motion with its numbers, as the solver uses them.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyEquation {
    /// The body: `Drive pulley`.
    pub name: String,
    /// Symbol of its acceleration: `φ̈₁`.
    pub acceleration: String,
    /// Symbol of its speed: `φ̇₁`.
    pub speed: String,
    /// Symbol of its position: `φ₁`.
    pub position: String,
    /// The divisor of the sum.
    pub inertia: Inertia,
    /// The terms of the sum; those with a gain of zero are not drawn.
    pub terms: Vec<Term>,
    /// The friction that is subtracted.
    pub friction: FrictionTerm,
}

/// Mass or moment of inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct Inertia {
    /// `J₁` or `M`.
    pub symbol: String,
    /// In `unit`.
    pub value: f64,
    /// `kg m^2` or `kg`.
    pub unit: String,
}

/// One input times its gain.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Symbol of the input: `x₃ = x`.
    pub input: String,
    /// Symbol of the gain: `r k₁`; empty for a plain sum of the input.
    pub gain: String,
    /// The gain's value, with its own sign.
    pub value: f64,
    /// The gain's unit.
    pub unit: String,
    /// The sign with which the sum takes it.
    pub sign: Sign,
}

/// The friction function and its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionTerm {
    /// Symbol: `τ_f1`.
    pub symbol: String,
    /// The parameters as they are to be read: `B₁ = 1.6 mN m s`, `τ_c1 = 15 mN m`.
    pub parameters: Vec<String>,
}

/// The motor as the whole diagram shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorEquation {
    /// Symbol of the input: `u`.
    pub input: String,
    /// Symbol of the torque: `τ_M`.
    pub torque: String,
    /// Lines in its block: `τ_M = (K_t/R) (u − K_e φ̇₁)`, `K_t/R = 32.39 mN m/V`.
    pub lines: Vec<String>,
    /// Symbol of the speed that comes back; empty where the amplifier imposes the current.
    pub feedback: String,
}

/// One body: inputs, gains, sum, friction, inertia, two integrators.
pub fn body_diagram(body: &BodyEquation) -> String {
    let terms: Vec<&Term> = body.terms.iter().filter(|t| t.value != 0.0).collect();
    let middle = (terms.len().max(1) - 1) as f64 / 2.0;
    let mut d = Diagram::new(66.0);
    let sum = d.block(BlockKind::Sum(terms.iter().map(|t| t.sign).collect()), 2, middle, "", "");
    for (i, term) in terms.iter().enumerate() {
        let row = i as f64;
        let input = d.block(BlockKind::Input, 0, row, &term.input, "");
        let along = if terms.len() > 1 { 2.0 * i as f64 / (terms.len() - 1) as f64 - 1.0 } else { 0.0 };
        if term.gain.is_empty() {
            d.connect((input, Port::Right(0.0)), (sum, Port::Left(along)), "");
        } else {
            let value = engineering(term.value, &term.unit, 4);
            let gain = d.block(BlockKind::Gain, 1, row, &term.gain, &value);
            d.wire(input, gain);
            d.connect((gain, Port::Right(0.0)), (sum, Port::Left(along)), "");
        }
    }
    // The friction function stands above the line from the sum to the difference.
    let lift = middle - 1.75;
    let friction = d.block(BlockKind::Function, 3, lift, &body.friction.symbol, &body.friction.parameters.join("\n"));
    let minus = d.block(BlockKind::Minus, 4, middle, "", "");
    let inertia = &body.inertia;
    let inverse = d.block(
        BlockKind::Gain,
        5,
        middle,
        &format!("1/{}", inertia.symbol),
        &format!("{} = {}", inertia.symbol, engineering(inertia.value, &inertia.unit, 4)),
    );
    let speed = d.block(BlockKind::Integrator, 6, middle, "", "");
    let position = d.block(BlockKind::Integrator, 7, middle, "", "");
    let out = d.block(BlockKind::Output, 8, middle, &body.position, "");
    let out_speed = d.block(BlockKind::Output, 8, middle + 1.0, &body.speed, "");
    d.gap(2, 40.0);
    d.gap(5, 62.0);
    d.gap(6, 76.0);
    d.wire(sum, minus);
    d.connect((sum, Port::Tap(16.0)), (friction, Port::Left(0.0)), "");
    d.connect((friction, Port::Right(0.0)), (minus, Port::Top(0.0)), "");
    d.wire(minus, inverse);
    d.connect((inverse, Port::Right(0.0)), (speed, Port::Left(0.0)), &body.acceleration);
    d.connect((speed, Port::Right(0.0)), (position, Port::Left(0.0)), &body.speed);
    d.wire(position, out);
    d.connect_along(lift - 0.8, (speed, Port::Tap(14.0)), (friction, Port::Top(0.0)), &body.speed);
    d.connect((speed, Port::Tap(14.0)), (out_speed, Port::Left(0.0)), "");
    d.svg(&format!("Block diagram of the equation of motion: {}", body.name))
}

/// The whole: the motor and three bodies, drive pulley, cart and idler pulley, with the signals between them.
pub fn axis_diagram(motor: &MotorEquation, bodies: [&BodyEquation; 3]) -> String {
    let mut d = Diagram::new(120.0);
    let input = d.block(BlockKind::Input, 0, 0.0, &motor.input, "");
    let drive_motor = d.block(BlockKind::System(motor.lines.clone()), 1, 0.0, "Motor", "");
    let [drive, cart, idler] = [0, 1, 2].map(|i| {
        let body = bodies[i];
        let inertia = &body.inertia;
        let mut lines = vec![format!("{} = {}", inertia.symbol, engineering(inertia.value, &inertia.unit, 4))];
        lines.extend(body.friction.parameters.iter().cloned());
        d.block(BlockKind::System(lines), 2 + i, 0.0, &body.name, "")
    });
    d.gap(0, 40.0);
    d.gap(1, 62.0);
    d.gap(2, 74.0);
    d.gap(3, 74.0);
    d.wire(input, drive_motor);
    d.connect((drive_motor, Port::Right(0.0)), (drive, Port::Left(0.0)), &motor.torque);
    if !motor.feedback.is_empty() {
        d.connect_along(-0.72, (drive, Port::Top(0.0)), (drive_motor, Port::Top(0.0)), &motor.feedback);
    }
    // A neighbour feels the other's position, and its speed where the belt is damped.
    let couples = |body: &BodyEquation, of: &BodyEquation| {
        body.terms.iter().any(|t| t.value != 0.0 && t.input.contains(&of.speed) && t.input != motor.torque)
    };
    let signal = |to: usize, from: usize| {
        let (to, from) = (bodies[to], bodies[from]);
        if couples(to, from) { format!("{}, {}", from.position, from.speed) } else { from.position.clone() }
    };
    for (a, b, i, j) in [(drive, cart, 0, 1), (cart, idler, 1, 2)] {
        d.connect((a, Port::Right(-0.35)), (b, Port::Left(-0.35)), &signal(j, i));
        d.connect((b, Port::Left(0.35)), (a, Port::Right(0.35)), &signal(i, j));
    }
    // The third span joins the pulleys past the cart.
    d.connect_along(0.66, (idler, Port::Bottom(-0.3)), (drive, Port::Bottom(0.3)), &signal(0, 2));
    d.connect_along(0.9, (drive, Port::Bottom(-0.3)), (idler, Port::Bottom(0.3)), &signal(2, 0));
    d.svg("Block diagram of the whole axis")
}
