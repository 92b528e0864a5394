//! Figures 18 and 19: block diagrams whose coefficients are read from the equations that run.

use taut::friction::Motion;
use taut::number::engineering;
use taut::plant::{Body, Form, Mode, Plant, place};
use taut::report::diagram::Sign;
use taut::report::{BodyEquation, FrictionTerm, Inertia, MotorEquation, Term, axis_diagram, body_diagram};
use taut::stage::Stage;

/// Figure 18: the drive pulley, eq. (16).
pub fn drive_pulley(stage: &Stage) -> String {
    body_diagram(&body(&Plant::new(stage), Body::DrivePulley))
}

/// Figure 19: the whole.
pub fn whole(stage: &Stage) -> String {
    let plant = Plant::new(stage);
    let [drive, cart, idler] = Body::ALL.map(|b| body(&plant, b));
    let load = plant.load(Body::DrivePulley, true, &Mode::of([Motion::Free; 3]));
    let motor = MotorEquation {
        input: "V_in".into(),
        torque: "τ_M".into(),
        lines: vec![
            "τ_M = (K_t/R) (V_in − K_e φ̇₁)".into(),
            format!("K_t/R = {}", engineering(load.input, "N m/V", 4)),
            format!("K_t K_e/R = {}", engineering(-load.speed[0], "N m s", 4)),
        ],
        feedback: "φ̇₁".into(),
    };
    axis_diagram(&motor, [&drive, &cart, &idler])
}

/// The inputs of every sum: symbol, its place in the state.
const INPUTS: [(&str, usize); 6] = [
    ("x₁ = φ₁", place::DRIVE_ANGLE),
    ("x₃ = x", place::CART_POSITION),
    ("x₅ = φ₃", place::IDLER_ANGLE),
    ("x₂ = φ̇₁", place::DRIVE_SPEED),
    ("x₄ = ẋ", place::CART_SPEED),
    ("x₆ = φ̇₃", place::IDLER_SPEED),
];

/// Eq. (16), (17) or (18), with symbols beside the coefficients of the form that the solver uses.
fn body(plant: &Plant, body: Body) -> BodyEquation {
    let stage = plant.stage();
    let form: Form = plant.load(body, true, &Mode::of([Motion::Free; 3]));
    let row = form.on_state(stage.pulley_radius);
    // What the coefficients of φ₁, x, φ₃ and φ̇₁ are called.
    let (gains, unit, torque) = match body {
        Body::DrivePulley => {
            (["r² (k₁ + k₃)", "r k₁", "r² k₃", "K_t K_e/R"], ["N m/rad", "N", "N m/rad", "N m s"], true)
        }
        Body::Cart => (["r k₁", "k₁ + k₂", "r k₂", ""], ["N/rad", "N/m", "N/rad", ""], false),
        Body::IdlerPulley => (["r² k₃", "r k₂", "r² (k₂ + k₃)", ""], ["N m/rad", "N", "N m/rad", ""], true),
    };
    let mut terms: Vec<Term> = INPUTS
        .iter()
        .enumerate()
        .map(|(i, (symbol, place))| {
            term(symbol, gains.get(i).copied().unwrap_or(""), row[*place], unit.get(i).copied().unwrap_or(""))
        })
        .collect();
    terms.push(term("V_in", "K_t/R", form.input, "N m/V"));
    terms.retain(|t| t.value != 0.0);
    let law = plant.friction(body).forward;
    let (index, symbols, inertia) = match body {
        Body::DrivePulley => ("1", ["φ̈₁", "φ̇₁", "φ₁"], ("J₁", stage.drive_pulley.inertia)),
        Body::Cart => ("", ["ẍ", "ẋ", "x"], ("M", stage.cart.mass)),
        Body::IdlerPulley => ("2", ["φ̈₃", "φ̇₃", "φ₃"], ("J₂", stage.idler_pulley.inertia)),
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
    let mut name = body.name().to_string();
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
