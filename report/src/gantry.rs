//! A gantry in plan view, drawn with its symbols and values: motors below, the bridge across, x upward and y to the
//! right.

use super::drawing::friction;
use super::svg::{self, Anchor, Colour, Paint, Svg, n};
use std::f64::consts::PI;
use taut::machine::{AmplifierMode, EncoderPlace, Machine, MachineKind, Slide};
use taut::mechanism::{Amplifier, Motor};
use taut::number::engineering;

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 664.0;
/// Centres of the drive pulleys; drawn larger than to scale.
const MOTORS: [(f64, f64); 2] = [(250.0, 560.0), (610.0, 560.0)];
/// Distance of the belt from a pulley's centre.
const RADIUS: f64 = 30.0;
/// Lanes of the belt along the rails: outer and inner one, on the left and on the right.
const OUTER: [f64; 2] = [220.0, 640.0];
const INNER: [f64; 2] = [280.0, 580.0];
/// Lanes of the belt along the bridge.
const UPPER: f64 = 315.0;
const LOWER: f64 = 345.0;
const RAILS: [f64; 2] = [192.0, 668.0];
const FAR: f64 = 62.0;
/// Of an idler at a corner.
const IDLER: f64 = 12.0;
/// Edges of the bridge, and the centre of a motor on it.
const BRIDGE: [f64; 2] = [284.0, 376.0];
const CART_MOTOR: (f64, f64) = (318.0, 330.0);
const CART: ((f64, f64), (f64, f64)) = ((382.0, 288.0), (96.0, 84.0));

/// Belts, drive pulleys, idlers, bridge and cart as they run, with positive directions. Works in light and dark.
pub fn gantry_drawing(gantry: &Machine) -> String {
    let mut out = Svg::new(WIDTH, HEIGHT);
    rails(&mut out);
    bridge(&mut out);
    match gantry.kind {
        MachineKind::HFrame => h_frame(&mut out, gantry),
        MachineKind::Axis | MachineKind::CoreXy => core_xy(&mut out, gantry),
        MachineKind::DualBelt => dual_belt(&mut out, gantry),
    }
    directions(&mut out);
    for side in 0..gantry.drives.len() {
        drive(&mut out, gantry, side);
    }
    let pulley = gantry.drive_pulley;
    let mut lines = vec![
        format!("r = {}", engineering(gantry.pulley_radius, "m", 5)),
        format!("J = {}", engineering(pulley.inertia, "kg m^2", 4)),
    ];
    lines.extend(friction(&pulley.friction, ["B", "τ_c", "τ_s"], ["N m s", "N m"]));
    block(&mut out, (430.0, 508.0), Anchor::Middle, "Drive pulleys", &lines);
    block(&mut out, (16.0, 276.0), Anchor::Start, "Bridge", &slide(gantry.first_slide(), "m_b", "x"));
    let cart = match gantry.kind {
        MachineKind::HFrame => (496.0, 184.0),
        MachineKind::Axis | MachineKind::CoreXy => (430.0, 184.0),
        MachineKind::DualBelt => (430.0, 156.0),
    };
    block(&mut out, cart, Anchor::Middle, "Cart", &slide(&gantry.cart, "m_c", "y"));
    let (name, count) = (gantry.kind.name(), if gantry.drives.len() == 2 { "two" } else { "three" });
    out.finish(&format!("The gantry in plan view, {name}: {count} drive pulleys, belt, bridge and cart"))
}

/// The numbers of bridge or cart.
fn slide(slide: &Slide, mass: &str, way: &str) -> Vec<String> {
    let mut lines = vec![format!("{mass} = {}", engineering(slide.mass, "kg", 4))];
    lines.extend(friction(&slide.friction, ["b", "F_c", "F_s"], ["N s/m", "N"]));
    if let Some(travel) = slide.travel {
        let [min, max] = [travel.min, travel.max].map(|end| engineering(end, "m", 4));
        lines.push(format!("{way} = {min} … {max}"));
    }
    lines
}

/// A heading and lines below it.
fn block(out: &mut Svg, (x, y): (f64, f64), anchor: Anchor, heading: &str, lines: &[String]) {
    out.text((x, y), 13.0, anchor, svg::INK, " font-weight=\"600\"", heading);
    for (k, line) in lines.iter().enumerate() {
        out.symbol((x, y + 17.0 * (k + 1) as f64), 12.5, anchor, svg::MARK, "", line);
    }
}

fn rails(out: &mut Svg) {
    for x in RAILS {
        out.line((x, FAR - 22.0), (x, MOTORS[0].1 + 40.0), svg::AXIS, 2.0);
    }
}

fn bridge(out: &mut Svg) {
    let [left, right] = RAILS;
    out.rect((left - 12.0, BRIDGE[0]), (right - left + 24.0, BRIDGE[1] - BRIDGE[0]), 5.0, svg::SOFT, svg::AXIS, 1.4);
    for x in RAILS {
        for y in [298.0, 362.0] {
            out.circle((x, y), 5.0, svg::PAPER, svg::AXIS, 1.4);
        }
    }
    out.rect(CART.0, CART.1, 5.0, svg::PAPER, svg::INK, 1.6);
}

/// One belt: from the cart over the bridge's idlers to a motor on either side, and from there round the far end and
/// across the bridge.
fn h_frame(out: &mut Svg, gantry: &Machine) {
    let belt = Colour::Blue.paint();
    let far = FAR + RADIUS;
    let [left, right] = [CART.0.0, CART.0.0 + CART.1.0];
    // The back span passes the cart without holding it.
    out.path(&format!("M{} {UPPER}H{}", n(INNER[0] + IDLER), n(INNER[1] - IDLER)), belt, 1.7, "");
    for side in 0..2 {
        let (inner, outer, inward) = (INNER[side], OUTER[side], if side == 0 { 1.0 } else { -1.0 });
        let fixed = if side == 0 { left } else { right };
        wrap(out, side, belt);
        lower_corner(out, side, fixed, belt);
        vertical(out, inner, LOWER + IDLER, MOTORS[side].1, true, belt);
        // Up, round the idler at the far end, and down to the bridge.
        out.line((outer, MOTORS[side].1), (outer, far), belt, 1.7);
        let sweep = if side == 0 { 1 } else { 0 };
        out.path(&format!("M{} {far}A{RADIUS} {RADIUS} 0 0 {sweep} {} {far}", n(outer), n(inner)), belt, 1.7, "");
        idler(out, (MOTORS[side].0, far), RADIUS - 4.0);
        vertical(out, inner, far, UPPER - IDLER, side == 0, belt);
        corner(out, (inner, UPPER - IDLER), (inner + inward * IDLER, UPPER), 1 - sweep, belt);
        idler(out, (inner + inward * IDLER, UPPER - IDLER), IDLER - 3.0);
    }
    label(out, gantry, 0, (INNER[0] + 20.0, 448.0), Anchor::Start, belt);
    label(out, gantry, 1, (INNER[1] - 20.0, 448.0), Anchor::End, belt);
    label(out, gantry, 2, (INNER[0] + 20.0, 218.0), Anchor::Start, belt);
    for x in [left, right] {
        out.circle((x, LOWER), 3.2, svg::INK, svg::INK, 1.0);
    }
}

/// Two belts: each from the cart straight back to its motor, and out from there round the far end to the cart's other
/// side.
fn core_xy(out: &mut Svg, gantry: &Machine) {
    let [left, right] = [CART.0.0, CART.0.0 + CART.1.0];
    let paints = [Colour::Blue.paint(), Colour::Purple.paint()];
    for side in 0..2 {
        let belt = paints[side];
        let (inner, outer, other) = (INNER[side], OUTER[side], INNER[1 - side]);
        let (inward, sweep) = if side == 0 { (1.0, 1) } else { (-1.0, 0) };
        let top = if side == 0 { FAR } else { FAR + 40.0 };
        wrap(out, side, belt);
        lower_corner(out, side, if side == 0 { left } else { right }, belt);
        vertical(out, inner, LOWER + IDLER, MOTORS[side].1, true, belt);
        // Out: up, across the far end, down to the bridge's other side, and to the cart.
        out.line((outer, MOTORS[side].1), (outer, top + IDLER), belt, 1.7);
        corner(out, (outer, top + IDLER), (outer + inward * IDLER, top), sweep, belt);
        idler(out, (outer + inward * IDLER, top + IDLER), IDLER - 3.0);
        let (from, to) = (outer + inward * IDLER, other - inward * IDLER);
        zigzag(out, (from, top), (to, top), belt);
        corner(out, (to, top), (other, top + IDLER), sweep, belt);
        idler(out, (to, top + IDLER), IDLER - 3.0);
        out.line((other, top + IDLER), (other, UPPER - IDLER), belt, 1.7);
        corner(out, (other, UPPER - IDLER), (other - inward * IDLER, UPPER), sweep, belt);
        idler(out, (other - inward * IDLER, UPPER - IDLER), IDLER - 3.0);
        let end = if side == 0 { right } else { left };
        out.line((other - inward * IDLER, UPPER), (end, UPPER), belt, 1.7);
    }
    label(out, gantry, 0, (430.0, FAR - 18.0), Anchor::Middle, paints[0]);
    label(out, gantry, 1, (INNER[0] + 20.0, 448.0), Anchor::Start, paints[0]);
    label(out, gantry, 2, (430.0, FAR + 65.0), Anchor::Middle, paints[1]);
    label(out, gantry, 3, (INNER[1] - 20.0, 448.0), Anchor::End, paints[1]);
    for (x, y) in [(left, LOWER), (right, LOWER), (left, UPPER), (right, UPPER)] {
        out.circle((x, y), 3.2, svg::INK, svg::INK, 1.0);
    }
}

/// Three belts: on either side one from its motor round the far end to the bridge and back to the motor, and one along
/// the bridge from the cart's motor on its left end.
fn dual_belt(out: &mut Svg, gantry: &Machine) {
    let paints = [Colour::Blue, Colour::Purple, Colour::Green].map(Colour::paint);
    let far = FAR + RADIUS;
    for side in 0..2 {
        let (inner, outer, belt) = (INNER[side], OUTER[side], paints[side]);
        wrap(out, side, belt);
        out.line((outer, MOTORS[side].1), (outer, far), belt, 1.7);
        let sweep = if side == 0 { 1 } else { 0 };
        out.path(&format!("M{} {far}A{RADIUS} {RADIUS} 0 0 {sweep} {} {far}", n(outer), n(inner)), belt, 1.7, "");
        idler(out, (MOTORS[side].0, far), RADIUS - 4.0);
        vertical(out, inner, far, BRIDGE[0], true, belt);
        vertical(out, inner, BRIDGE[1], MOTORS[side].1, true, belt);
        BRIDGE.iter().for_each(|&y| out.circle((inner, y), 3.2, svg::INK, svg::INK, 1.0));
    }
    let belt = paints[2];
    let ([left, right], (from, y)) = ([CART.0.0, CART.0.0 + CART.1.0], CART_MOTOR);
    let (to, r) = (2.0 * (CART.0.0 + 0.5 * CART.1.0) - from, y - UPPER);
    out.line((from, UPPER), (to, UPPER), belt, 1.7);
    out.path(&format!("M{} {UPPER}A{r} {r} 0 0 1 {} {LOWER}", n(to), n(to)), belt, 1.7, "");
    out.line((to, LOWER), (right, LOWER), belt, 1.7);
    out.path(&format!("M{} {UPPER}A{r} {r} 0 0 0 {} {LOWER}", n(from), n(from)), belt, 1.7, "");
    out.line((from, LOWER), (left, LOWER), belt, 1.7);
    idler(out, (to, y), r - 3.0);
    label(out, gantry, 0, (INNER[0] + 20.0, 92.0), Anchor::Start, paints[0]);
    label(out, gantry, 1, (INNER[0] + 20.0, 448.0), Anchor::Start, paints[0]);
    label(out, gantry, 2, (INNER[1] - 20.0, 92.0), Anchor::End, paints[1]);
    label(out, gantry, 3, (INNER[1] - 20.0, 448.0), Anchor::End, paints[1]);
    label(out, gantry, 4, (430.0, BRIDGE[0] - 10.0), Anchor::Middle, belt);
    label(out, gantry, 5, (430.0, BRIDGE[1] + 48.0), Anchor::Middle, belt);
    for x in [left, right] {
        out.circle((x, LOWER), 3.2, svg::INK, svg::INK, 1.0);
    }
}

/// The belt round a drive pulley, from lane to lane.
fn wrap(out: &mut Svg, side: usize, belt: &Paint) {
    let (x, y) = MOTORS[side];
    let (from, to) = (n(x - RADIUS), n(x + RADIUS));
    out.path(&format!("M{from} {}A{RADIUS} {RADIUS} 0 0 0 {to} {}", n(y), n(y)), belt, 1.7, "");
}

/// From the lane of a motor onto the bridge and to the cart.
fn lower_corner(out: &mut Svg, side: usize, cart: f64, belt: &Paint) {
    let (inward, sweep) = if side == 0 { (1.0, 1) } else { (-1.0, 0) };
    let inner = INNER[side];
    corner(out, (inner, LOWER + IDLER), (inner + inward * IDLER, LOWER), sweep, belt);
    idler(out, (inner + inward * IDLER, LOWER + IDLER), IDLER - 3.0);
    out.line((inner + inward * IDLER, LOWER), (cart, LOWER), belt, 1.7);
}

fn corner(out: &mut Svg, from: (f64, f64), to: (f64, f64), sweep: u8, belt: &Paint) {
    let d = format!("M{} {}A{IDLER} {IDLER} 0 0 {sweep} {} {}", n(from.0), n(from.1), n(to.0), n(to.1));
    out.path(&d, belt, 1.7, "");
}

fn idler(out: &mut Svg, centre: (f64, f64), radius: f64) {
    out.circle(centre, radius, svg::PAPER, svg::AXIS, 1.2);
    out.circle(centre, 1.8, svg::AXIS, svg::AXIS, 1.0);
}

/// A lane along a rail, as a spring or straight.
fn vertical(out: &mut Svg, x: f64, from: f64, to: f64, is_spring: bool, belt: &Paint) {
    match is_spring {
        true => zigzag(out, (x, from), (x, to), belt),
        false => out.line((x, from), (x, to), belt, 1.7),
    }
}

/// A belt span: straight ends and a zigzag in the middle.
fn zigzag(out: &mut Svg, (x, y): (f64, f64), (to_x, to_y): (f64, f64), belt: &Paint) {
    const TURNS: u32 = 7;
    let (dx, dy) = (to_x - x, to_y - y);
    let length = dx.hypot(dy);
    let (ux, uy) = (dx / length, dy / length);
    let coil = (0.5 * length).min(100.0);
    let start = 0.5 * (length - coil);
    let at = |along: f64, off: f64| (x + along * ux - off * uy, y + along * uy + off * ux);
    let mut points = vec![(x, y), at(start, 0.0)];
    for i in 0..2 * TURNS {
        let off = if i % 2 == 0 { -8.0 } else { 8.0 };
        points.push(at(start + (f64::from(i) + 0.5) * coil / f64::from(2 * TURNS), off));
    }
    points.extend([at(start + coil, 0.0), (to_x, to_y)]);
    let d: String = points
        .iter()
        .enumerate()
        .map(|(i, (x, y))| format!("{}{} {}", if i == 0 { "M" } else { "L" }, n(*x), n(*y)))
        .collect();
    out.path(&d, belt, 1.7, "");
}

/// The name of a span, and its stiffness and damping.
fn label(out: &mut Svg, gantry: &Machine, span: usize, (x, y): (f64, f64), anchor: Anchor, paint: &Paint) {
    let belts = &gantry.belt;
    let name = gantry.geometry().spans[span].label.name;
    let mut values = vec![format!("k = {}", engineering(belts.stiffness[span], "N/m", 5))];
    if belts.damping[span] != 0.0 {
        values.push(format!("c = {}", engineering(belts.damping[span], "N s/m", 3)));
    }
    // Along a lane in a line, beside one below each other.
    let lines = match anchor {
        Anchor::Middle => vec![format!("{name}: {}", values.join(", "))],
        _ => [vec![name.to_string()], values].concat(),
    };
    for (k, line) in lines.iter().enumerate() {
        out.symbol((x, y + 17.0 * k as f64), 13.0, anchor, paint, "", line);
    }
}

/// Which way bridge and cart count as positive.
fn directions(out: &mut Svg) {
    let arrow = Colour::Vermillion.paint();
    let x = RAILS[1] + 34.0;
    out.line((x - 6.0, 330.0), (x + 6.0, 330.0), arrow, 1.6);
    out.arrow((x, 330.0), (x, 266.0), arrow, 1.6);
    out.symbol((x, 256.0), 14.0, Anchor::Middle, arrow, "", "x");
    let y = 396.0;
    out.line((430.0, y - 6.0), (430.0, y + 6.0), arrow, 1.6);
    out.arrow((430.0, y), (494.0, y), arrow, 1.6);
    out.symbol((502.0, y + 4.5), 14.0, Anchor::Start, arrow, "", "y");
}

/// Pulley, the way it turns, its motor's values and what feeds it.
fn drive(out: &mut Svg, gantry: &Machine, side: usize) {
    let is_at_cart = side == MOTORS.len();
    let (x, y) = MOTORS.get(side).copied().unwrap_or(CART_MOTOR);
    let (motor, amplifier) = (&gantry.drives[side].motor, &gantry.drives[side].amplifier);
    let radius = if is_at_cart { y - UPPER - 2.0 } else { RADIUS - 4.0 };
    out.circle((x, y), radius, svg::SOFT, svg::AXIS, 1.2);
    out.circle((x, y), 3.5, svg::PAPER, svg::INK, 1.4);
    let (symbol, clockwise) = match (gantry.kind, side) {
        (MachineKind::HFrame, 0) => ("φ₁", true),
        (MachineKind::HFrame, _) => ("φ₂", true),
        (MachineKind::Axis | MachineKind::CoreXy, 0) => ("φ_A", false),
        (MachineKind::Axis | MachineKind::CoreXy, _) => ("φ_B", true),
        (MachineKind::DualBelt, 0) => ("φ₁", false),
        (MachineKind::DualBelt, 1) => ("φ₂", true),
        (MachineKind::DualBelt, _) => ("φ₃", false),
    };
    turn(out, (x, y), clockwise, if is_at_cart { 9.0 } else { 15.0 });
    let above = if is_at_cart { -20.0 } else { -40.0 };
    out.symbol((x, y + above), 14.0, Anchor::Middle, Colour::Vermillion.paint(), "", symbol);

    let fed = match amplifier.mode {
        AmplifierMode::Voltage => "u",
        AmplifierMode::Current => "i",
        AmplifierMode::Position => "x*",
    };
    let (end, name) = (if is_at_cart { radius } else { RADIUS } + 3.0, gantry.geometry().drives[side].side());
    let tail = y + end + if is_at_cart { 24.0 } else { 33.0 };
    out.arrow((x, tail), (x, y + end), svg::INK, 1.5);
    out.symbol((x + 8.0, tail - 2.0), 13.0, Anchor::Start, svg::INK, "", &format!("{fed}_{name}"));

    let (heading, at) = match side {
        0 => ("Left motor", 16.0),
        1 => ("Right motor", 700.0),
        _ => ("Cart motor", 700.0),
    };
    let heading =
        if gantry.kind == MachineKind::CoreXy { format!("{heading} ({})", ["A", "B"][side]) } else { heading.into() };
    let mut lines = motor_lines(motor, amplifier);
    if let Some(encoder) = gantry.encoder {
        let at = if encoder.at == EncoderPlace::Motor { "motor" } else { "pulley" };
        lines.push(format!("encoder at the {at},"));
        lines.push(format!("{} lines", engineering(encoder.lines, "", 6)));
    }
    let top = if is_at_cart { 60.0 } else { (y + 40.0 - 17.0 * lines.len() as f64).min(470.0) };
    block(out, (at, top), Anchor::Start, &heading, &lines);
}

fn motor_lines(motor: &Motor, amplifier: &Amplifier) -> Vec<String> {
    let mut lines = vec![
        format!("K_t = {}", engineering(motor.torque_constant, "N m/A", 4)),
        format!("K_e = {}", engineering(motor.back_emf_constant, "V s/rad", 4)),
        format!("R = {}", engineering(motor.resistance, "ohm", 4)),
    ];
    let mut add = |holds: bool, symbol: &str, value: f64, unit: &str| {
        if holds {
            lines.push(format!("{symbol} = {}", engineering(value, unit, 4)));
        }
    };
    add(motor.inductance != 0.0, "L", motor.inductance, "H");
    add(motor.rotor_inertia != 0.0, "J_r", motor.rotor_inertia, "kg m^2");
    add(motor.gear_ratio != 1.0, "n", motor.gear_ratio, "");
    add(motor.gear_efficiency != 1.0, "η", motor.gear_efficiency, "");
    if let Some(play) = motor.gear_play {
        add(true, "2α", play.backlash, "rad");
        add(true, "k_g", play.stiffness, "N m/rad");
    }
    add(amplifier.gain != 1.0, "gain", amplifier.gain, "");
    add(amplifier.voltage_limit.is_some(), "V_max", amplifier.voltage_limit.unwrap_or(0.0), "V");
    add(amplifier.current_limit.is_some(), "I_max", amplifier.current_limit.unwrap_or(0.0), "A");
    lines
}

/// An arrow round the hub of a pulley.
fn turn(out: &mut Svg, (x, y): (f64, f64), clockwise: bool, r: f64) {
    let arrow = Colour::Vermillion.paint();
    let way = if clockwise { 1.0 } else { -1.0 };
    // From one side over the top to the other, and the way along the circle there.
    let at = |degrees: f64| {
        let (sin, cos) = (degrees * PI / 180.0).sin_cos();
        ((x - way * r * cos, y - r * sin), (way * sin, -cos))
    };
    let ((from, _), (to, _)) = (at(10.0), at(138.0));
    let sweep = u8::from(clockwise);
    out.path(&format!("M{} {}A{r} {r} 0 0 {sweep} {} {}", n(from.0), n(from.1), n(to.0), n(to.1)), arrow, 1.6, "");
    out.head(at(158.0).0, at(150.0).1, 7.6, arrow);
}
