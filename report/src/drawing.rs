//! The stage, drawn with its symbols and values (after the paper's Fig. 2).

use super::svg::{self, Anchor, Colour, Svg, n};
use std::f64::consts::PI;
use taut::friction::Friction;
use taut::machine::{AmplifierMode, EncoderPlace, Machine, Pulley};
use taut::number::{engineering, significant};

const WIDTH: f64 = 860.0;
const DRIVE: (f64, f64) = (120.0, 200.0);
const IDLER: (f64, f64) = (716.0, 200.0);
/// Pulleys are drawn larger than to scale, so that one can see them.
const RADIUS: f64 = 52.0;
const CART: (f64, f64) = (120.0, 46.0);

/// Two pulleys, three spans as springs, cart, motor, gear and encoder, with positive directions.
///
/// The cart stands where the span lengths put it (in the middle if they are not known, and never so near a
/// pulley that a spring has no room). Works in light and dark.
pub fn stage_drawing(machine: &Machine) -> String {
    let mut out = Svg::new(WIDTH, 452.0);
    let top = DRIVE.1 - RADIUS;
    let bottom = DRIVE.1 + RADIUS;
    // l₁ and l₂ divide the way between the pulleys; the springs need some room.
    let share = machine.belt.make.map_or(0.5, |make| make.spans[0] / (make.spans[0] + make.spans[1]));
    let share = if share.is_finite() { share.clamp(0.36, 0.64) } else { 0.5 };
    let cart = DRIVE.0 + share * (IDLER.0 - DRIVE.0);
    let (left, right) = (cart - CART.0 / 2.0, cart + CART.0 / 2.0);

    belt_arcs(&mut out, top, bottom);
    // The springs of the upper spans stand clear of the pulleys.
    let middles = [(DRIVE.0 + 40.0 + left) / 2.0, (IDLER.0 - 40.0 + right) / 2.0, (DRIVE.0 + IDLER.0) / 2.0];
    spring(&mut out, (DRIVE.0, top), left, middles[0]);
    spring(&mut out, (right, top), IDLER.0, middles[1]);
    spring(&mut out, (DRIVE.0, bottom), IDLER.0, middles[2]);
    for (i, y) in [top - 18.0, top - 18.0, bottom + 30.0].into_iter().enumerate() {
        span_label(&mut out, machine, i, (middles[i], y));
    }

    draw_cart(&mut out, cart, top);
    shaft(&mut out, machine);
    pulley(&mut out, DRIVE, "φ₁");
    pulley(&mut out, IDLER, "φ₃");
    motor(&mut out, machine);
    encoder(&mut out, machine, cart, top);
    if let Some(lines) = machine.scale.map(|scale| scale.lines) {
        rail(&mut out, &format!("scale, {} lines/m", engineering(lines, "", 6)), cart, top);
    }

    // Above the labels of the spans, which damping makes higher.
    let base = top - if machine.belt.damping == [0.0; 3] { 36.0 } else { 58.0 };
    let of = |pulley: &Pulley, i: u8| {
        let mut lines = vec![format!("J_{i} = {}", engineering(pulley.inertia, "kg m^2", 4))];
        let symbols = [format!("B_{i}"), format!("τ_c{i}"), format!("τ_s{i}")];
        lines.extend(friction(&pulley.friction, symbols.each_ref().map(String::as_str), ["N m s", "N m"]));
        lines
    };
    block(&mut out, DRIVE.0, base, "Drive pulley", &of(&machine.drive_pulley, 1));
    block(&mut out, IDLER.0, base, "Idler pulley", &of(&machine.idler_pulley, 2));
    let mut lines = vec![format!("M = {}", engineering(machine.cart.mass, "kg", 4))];
    lines.extend(friction(&machine.cart.friction, ["b", "F_c", "F_s"], ["N s/m", "N"]));
    block(&mut out, cart, top - 52.0, "Cart", &lines);
    out.finish("The stage: motor, drive pulley, belt with three spans, cart and idler pulley")
}

/// The friction that there is, as lines: forward, and backward where it differs.
pub(super) fn friction(
    f: &Friction,
    [viscous, coulomb, breakaway]: [&str; 3],
    [viscous_unit, unit]: [&str; 2],
) -> Vec<String> {
    let line = |symbol: &str, unit: &str, forward: f64, backward: f64| {
        (forward != 0.0 || backward != 0.0).then(|| {
            if forward == backward {
                format!("{symbol} = {}", engineering(forward, unit, 4))
            } else {
                format!("{symbol} = {} / {}", engineering(forward, unit, 4), engineering(backward, unit, 4))
            }
        })
    };
    let higher = f.forward.breakaway != f.forward.coulomb || f.backward.breakaway != f.backward.coulomb;
    [
        line(viscous, viscous_unit, f.forward.viscous, f.backward.viscous),
        line(coulomb, unit, f.forward.coulomb, f.backward.coulomb),
        higher.then(|| line(breakaway, unit, f.forward.breakaway, f.backward.breakaway)).flatten(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// A heading and lines, the last just above `base`.
fn block(out: &mut Svg, x: f64, base: f64, heading: &str, lines: &[String]) {
    let mut y = base - 17.0 * lines.len() as f64;
    out.text((x, y), 13.0, Anchor::Middle, svg::INK, " font-weight=\"600\"", heading);
    for line in lines {
        y += 17.0;
        out.symbol((x, y), 12.5, Anchor::Middle, svg::MARK, "", line);
    }
}

fn belt_arcs(out: &mut Svg, top: f64, bottom: f64) {
    let belt = Colour::Ink.paint();
    for ((x, _), sweep) in [(DRIVE, 0), (IDLER, 1)] {
        let d = format!("M{} {}A{r} {r} 0 0 {sweep} {} {}", n(x), n(top), n(x), n(bottom), r = n(RADIUS));
        out.path(&d, belt, 2.4, "");
    }
}

/// A belt span: straight ends and a zigzag around `middle`.
fn spring(out: &mut Svg, from: (f64, f64), to: f64, middle: f64) {
    let (length, turns) = (to - from.0, 9);
    let coil = (0.42 * length).clamp(60.0, 150.0).min(length);
    let start = middle - coil / 2.0;
    let step = coil / f64::from(2 * turns);
    let mut d = format!("M{} {}H{}", n(from.0), n(from.1), n(start));
    for i in 0..2 * turns {
        let y = from.1 + if i % 2 == 0 { -9.0 } else { 9.0 };
        d.push_str(&format!("L{} {}", n(start + (f64::from(i) + 0.5) * step), n(y)));
    }
    d.push_str(&format!("L{} {}H{}", n(start + coil), n(from.1), n(to)));
    out.path(&d, Colour::Blue.paint(), 1.7, "");
}

fn span_label(out: &mut Svg, machine: &Machine, i: usize, (x, y): (f64, f64)) {
    let number = ["₁", "₂", "₃"][i];
    let mut text = format!("k{number} = {}", engineering(machine.belt.stiffness[i], "N/m", 5));
    if machine.belt.damping[i] != 0.0 {
        text += &format!(", c{number} = {}", engineering(machine.belt.damping[i], "N s/m", 3));
    }
    // Damping makes it long: in two lines above, in one below.
    let (first, second) = match text.split_once(", ") {
        Some((a, b)) if i < 2 => (a.to_string(), Some(b.to_string())),
        _ => (text, None),
    };
    let lift = if second.is_some() { 16.0 } else { 0.0 };
    out.symbol((x, y - lift), 13.0, Anchor::Middle, Colour::Blue.paint(), "", &first);
    if let Some(second) = second {
        out.symbol((x, y), 13.0, Anchor::Middle, Colour::Blue.paint(), "", &second);
    }
}

fn draw_cart(out: &mut Svg, x: f64, top: f64) {
    let rail = top + CART.1 / 2.0 + 13.0;
    let (from, to) = (DRIVE.0 + RADIUS + 26.0, IDLER.0 - RADIUS - 26.0);
    let mut hatch = String::new();
    let mut at = from + 6.0;
    while at < to {
        hatch.push_str(&format!("M{} {}l-6 7", n(at), n(rail + 1.0)));
        at += 9.0;
    }
    out.path(&hatch, svg::GRID, 1.0, "");
    out.line((from, rail), (to, rail), svg::AXIS, 1.6);
    out.rect((x - CART.0 / 2.0, top - CART.1 / 2.0), CART, 5.0, svg::SOFT, svg::INK, 1.6);
    for wheel in [x - 0.3 * CART.0, x + 0.3 * CART.0] {
        out.circle((wheel, rail - 6.5), 6.5, svg::PAPER, svg::INK, 1.5);
    }
    let y = rail + 27.0;
    let arrow = Colour::Vermillion.paint();
    out.line((x, y - 6.0), (x, y + 6.0), arrow, 1.6);
    // Towards the drive pulley: there a positive stretch r φ₁ − x makes span 1 longer, and pulls.
    out.arrow((x, y), (x - 64.0, y), arrow, 1.6);
    out.symbol((x - 72.0, y + 4.5), 14.0, Anchor::End, arrow, "", "x");
    out.symbol((x, top + 5.0), 14.0, Anchor::Middle, svg::INK, "", "M");
}

fn pulley(out: &mut Svg, (x, y): (f64, f64), symbol: &str) {
    let arrow = Colour::Vermillion.paint();
    out.circle((x, y), 5.5, svg::PAPER, svg::INK, 1.6);
    let r = RADIUS - 17.0;
    let at = |degrees: f64| {
        let a = degrees * PI / 180.0;
        (x + r * a.cos(), y + r * a.sin())
    };
    let ((ax, ay), (bx, by)) = (at(-20.0), at(-147.0));
    out.path(&format!("M{} {}A{} {} 0 0 0 {} {}", n(ax), n(ay), n(r), n(r), n(bx), n(by)), arrow, 1.6, "");
    let a = -156.0 * PI / 180.0;
    out.head(at(-160.0), (a.sin(), -a.cos()), 7.6, arrow);
    out.symbol((x, y - 13.0), 14.0, Anchor::Middle, arrow, "", symbol);
}

/// The pulley's face and, in front of it, the shaft from its hub down to the motor.
fn shaft(out: &mut Svg, machine: &Machine) {
    for centre in [DRIVE, IDLER] {
        out.circle(centre, RADIUS - 4.0, svg::SOFT, svg::AXIS, 1.2);
    }
    out.line((DRIVE.0, DRIVE.1), (DRIVE.0, 372.0), svg::AXIS, 4.0);
    // The radius, on the idler.
    let (x, y) = IDLER;
    let end = (x + RADIUS * 0.64, y + RADIUS * 0.77);
    out.line(IDLER, end, svg::MARK, 1.1);
    out.line(end, (end.0 + 10.0, end.1 + 12.0), svg::MARK, 1.1);
    let text = format!("r = {}", engineering(machine.pulley_radius, "m", 5));
    out.symbol((end.0 + 8.0, end.1 + 26.0), 12.5, Anchor::Start, svg::MARK, "", &text);
}

fn motor(out: &mut Svg, machine: &Machine) {
    let m = &machine.drives[0].motor;
    let centre = (DRIVE.0, 384.0);
    if m.gear_ratio != 1.0 {
        out.rect((DRIVE.0 - 32.0, 288.0), (64.0, 34.0), 4.0, svg::SOFT, svg::INK, 1.6);
        let text = format!("n = {}", engineering(m.gear_ratio, "", 4));
        out.symbol((DRIVE.0, 309.5), 12.5, Anchor::Middle, svg::INK, "", &text);
    }
    out.circle(centre, 30.0, svg::SOFT, svg::INK, 1.6);
    out.text((centre.0, centre.1 + 6.0), 17.0, Anchor::Middle, svg::INK, " font-weight=\"600\"", "M");

    // The input from the left, through the amplifier where it does something.
    let symbol = match machine.drives[0].amplifier.mode {
        AmplifierMode::Voltage => "u",
        AmplifierMode::Current => "i",
        AmplifierMode::Position => "x*",
    };
    let ink = svg::INK;
    if machine.drives[0].amplifier.gain == 1.0 {
        out.arrow((44.0, centre.1), (centre.0 - 31.0, centre.1), ink, 1.5);
        out.symbol((36.0, centre.1 + 4.5), 14.0, Anchor::End, ink, "", symbol);
    } else {
        out.arrow((14.0, centre.1), (34.0, centre.1), ink, 1.5);
        out.fill(&format!("M34 {}L62 {}L34 {}Z", n(centre.1 - 18.0), n(centre.1), n(centre.1 + 18.0)), svg::SOFT);
        out.path(&format!("M34 {}L62 {}L34 {}Z", n(centre.1 - 18.0), n(centre.1), n(centre.1 + 18.0)), ink, 1.5, "");
        out.arrow((62.0, centre.1), (centre.0 - 31.0, centre.1), ink, 1.5);
        let gain = format!("gain {}", significant(machine.drives[0].amplifier.gain, 3));
        out.symbol((42.0, centre.1 + 38.0), 12.5, Anchor::Middle, svg::MARK, "", &gain);
    }

    let mut lines = vec![
        format!("K_t = {}", engineering(m.torque_constant, "N m/A", 4)),
        format!("K_e = {}", engineering(m.back_emf_constant, "V s/rad", 4)),
        format!("R = {}", engineering(m.resistance, "ohm", 4)),
    ];
    if m.inductance != 0.0 {
        lines.push(format!("L = {}", engineering(m.inductance, "H", 4)));
    }
    if m.rotor_inertia != 0.0 {
        lines.push(format!("J_r = {}", engineering(m.rotor_inertia, "kg m^2", 4)));
    }
    if m.gear_efficiency != 1.0 {
        lines.push(format!("η = {}", engineering(m.gear_efficiency, "", 3)));
    }
    out.text((200.0, 352.0), 13.0, Anchor::Start, ink, " font-weight=\"600\"", "Motor");
    for (i, line) in lines.iter().enumerate() {
        let at = (200.0 + 140.0 * (i / 3) as f64, 372.0 + 18.0 * (i % 3) as f64);
        out.symbol(at, 12.5, Anchor::Start, svg::MARK, "", line);
    }
}

/// A small disc with lines where the encoder sits, or lines along the rail.
fn encoder(out: &mut Svg, machine: &Machine, cart: f64, top: f64) {
    let Some(encoder) = machine.encoder else { return };
    let green = Colour::Green.paint();
    let per = if encoder.at == EncoderPlace::Cart { " lines/m" } else { " lines" };
    let text = format!("encoder, {}{per}", engineering(encoder.lines, "", 6));
    match encoder.at {
        EncoderPlace::Motor => {
            disc(out, (DRIVE.0, 430.0), 11.0);
            out.line((DRIVE.0, 414.0), (DRIVE.0, 419.0), svg::AXIS, 4.0);
            out.text((200.0, 434.5), 12.5, Anchor::Start, green, "", &text);
            out.path(&format!("M{} 430H193", n(DRIVE.0 + 15.0)), green, 1.0, " stroke-dasharray=\"1.5 3\"");
        }
        EncoderPlace::DrivePulley => {
            disc(out, (DRIVE.0, 274.0), 11.0);
            out.text((DRIVE.0 + 20.0, 278.5), 12.5, Anchor::Start, green, "", &text);
        }
        EncoderPlace::Cart => rail(out, &text, cart, top),
    }
}

/// Lines along the rail, read by a head at the cart.
fn rail(out: &mut Svg, text: &str, cart: f64, top: f64) {
    let green = Colour::Green.paint();
    let y = top + CART.1 / 2.0 + 62.0;
    let (from, to) = (DRIVE.0 + RADIUS + 26.0, IDLER.0 - RADIUS - 26.0);
    out.line((from, y), (to, y), green, 1.2);
    let mut ticks = String::new();
    let mut x = from;
    while x <= to {
        ticks.push_str(&format!("M{} {}v5", n(x), n(y)));
        x += 7.0;
    }
    out.path(&ticks, green, 0.9, "");
    let head = (cart - 44.0, top + CART.1 / 2.0);
    out.path(&format!("M{} {}V{}", n(head.0), n(head.1), n(y - 9.0)), green, 1.4, "");
    out.head((head.0, y - 1.0), (0.0, 1.0), 9.0, green);
    out.text((to, y - 7.0), 12.5, Anchor::End, green, "", text);
}

fn disc(out: &mut Svg, (x, y): (f64, f64), r: f64) {
    let green = Colour::Green.paint();
    out.circle((x, y), r, svg::PAPER, green, 1.5);
    let spokes: String = (0..12)
        .map(|i| {
            let (s, c) = (f64::from(i) * PI / 6.0).sin_cos();
            format!("M{} {}L{} {}", n(x + 0.55 * r * c), n(y + 0.55 * r * s), n(x + r * c), n(y + r * s))
        })
        .collect();
    out.path(&spokes, green, 1.2, "");
}
