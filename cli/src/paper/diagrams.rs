//! Figures 18 and 19: block diagrams whose coefficients are read from the equations that run.

use taut::machine::Machine;
use taut::machine::axis::{CART, DRIVE, IDLER};
use taut::mechanism::{Form, Mechanism, Mode, State};
use taut::number::engineering;
use taut_report::diagram::Sign;
use taut_report::{BodyEquation, FrictionTerm, Inertia, MotorEquation, Term, axis_diagram, body_diagram};

/// Figure 18: the drive pulley, eq. (16).
pub fn drive_pulley(machine: &Machine) -> String {
    body_diagram(&body(machine, &machine.mechanism(), DRIVE))
}

/// Figure 19: the whole.
pub fn whole(machine: &Machine) -> String {
    let mechanism = machine.mechanism();
    let [drive, cart, idler] = [DRIVE, CART, IDLER].map(|b| body(machine, &mechanism, b));
    let load = mechanism.load(DRIVE, true, &Mode::new([]));
    let motor = MotorEquation {
        input: "V_in".into(),
        torque: "τ_M".into(),
        lines: vec![
            "τ_M = (K_t/R) (V_in − K_e φ̇₁)".into(),
            format!("K_t/R = {}", engineering(load.input[0], "N m/V", 4)),
            format!("K_t K_e/R = {}", engineering(-load.speed[0], "N m s", 4)),
        ],
        feedback: "φ̇₁".into(),
    };
    axis_diagram(&motor, [&drive, &cart, &idler])
}

/// The inputs of every sum: symbols of ways and speeds, in the order of the bodies.
const WAYS: [&str; 3] = ["x₁ = φ₁", "x₃ = x", "x₅ = φ₃"];
const SPEEDS: [&str; 3] = ["x₂ = φ̇₁", "x₄ = ẋ", "x₆ = φ̇₃"];

/// Eq. (16), (17) or (18), with symbols beside the coefficients of the form that the solver uses.
fn body(machine: &Machine, mechanism: &Mechanism, body: usize) -> BodyEquation {
    let form: Form = mechanism.load(body, true, &Mode::new([]));
    let State { position, speed, .. } = form.on_state(mechanism);
    // What the coefficients of φ₁, x, φ₃ and φ̇₁ are called.
    let (gains, unit, torque) = match body {
        DRIVE => (["r² (k₁ + k₃)", "r k₁", "r² k₃", "K_t K_e/R"], ["N m/rad", "N", "N m/rad", "N m s"], true),
        CART => (["r k₁", "k₁ + k₂", "r k₂", ""], ["N/rad", "N/m", "N/rad", ""], false),
        _ => (["r² k₃", "r k₂", "r² (k₂ + k₃)", ""], ["N m/rad", "N", "N m/rad", ""], true),
    };
    let inputs = WAYS.iter().zip(position).chain(SPEEDS.iter().zip(speed));
    let mut terms: Vec<Term> = inputs
        .enumerate()
        .map(|(i, (symbol, value))| {
            term(symbol, gains.get(i).copied().unwrap_or(""), value, unit.get(i).copied().unwrap_or(""))
        })
        .collect();
    terms.push(term("V_in", "K_t/R", form.input[0], "N m/V"));
    terms.retain(|t| t.value != 0.0);
    let law = mechanism.friction(body).forward;
    let (index, symbols, inertia) = match body {
        DRIVE => ("1", ["φ̈₁", "φ̇₁", "φ₁"], ("J₁", machine.drive_pulley.inertia)),
        CART => ("", ["ẍ", "ẋ", "x"], ("M", machine.cart.mass)),
        _ => ("2", ["φ̈₃", "φ̇₃", "φ₃"], ("J₂", machine.idler_pulley.inertia)),
    };
    let parameters = if torque {
        vec![
            format!("B_{index} = {}", engineering(law.viscous, "N m s", 4)),
            format!("τ_c{index} = {}", engineering(law.coulomb, "N m", 4)),
        ]
    } else {
        vec![
            format!("b = {}", engineering(law.viscous, "N s/m", 6)),
            format!("F_c = {}", engineering(law.coulomb, "N", 4)),
        ]
    };
    let mut name = mechanism.bodies[body].label.name.to_string();
    name[..1].make_ascii_uppercase();
    BodyEquation {
        name,
        acceleration: symbols[0].into(),
        speed: symbols[1].into(),
        position: symbols[2].into(),
        inertia: Inertia {
            symbol: inertia.0.into(),
            value: inertia.1,
            unit: if torque { "kg m^2" } else { "kg" }.into(),
        },
        terms,
        friction: FrictionTerm { symbol: if torque { format!("τ_f{index}") } else { "F_f".into() }, parameters },
    }
}

fn term(input: &str, gain: &str, value: f64, unit: &str) -> Term {
    Term {
        input: input.into(),
        gain: gain.into(),
        value: value.abs(),
        unit: unit.into(),
        sign: if value < 0.0 { Sign::Minus } else { Sign::Plus },
    }
}
