//! A row of a sweep: positions at the end of a run whose machine is not that of the case.

use crate::answer::{Answer, End, LEAST, is_piecewise_linear};
use crate::double::Double;
use crate::machine::BODIES;
use crate::subject::{Fed, Subject};
use taut::case::Case;
use taut::sweep::Sweep;

/// The run of the sweep that is taken.
const RUN: u64 = 1;

/// The sweep that every case is given.
const SWEEP: &str = r#"
[sweep]
runs = 3
design = "random"
[sweep.vary]
"cart.mass" = "5 %"
"motor.torque_constant" = "3 %"
"drive_pulley.inertia" = "4 %"
"#;

/// Runs it.
pub fn run(subject: &Subject) -> Result<Answer, String> {
    let told = |error: taut::Error| format!("the sweep is refused: {error}");
    let text = format!("{}{SWEEP}", subject.opened().text);
    let opened = Case::from_text_with("swept.toml", &text, &[]).map_err(told)?;
    let sweep = Sweep::new(&opened).map_err(told)?;
    let table = sweep.rows(RUN, 1, &|| false).ok_or("the sweep stops")?;
    let column = |ending: &str| {
        let found = table.columns.iter().find(|column| column.name.ends_with(ending));
        found.and_then(|column| column.values.first().copied()).ok_or(format!("the sweep has no {ending}"))
    };
    let mut swept = subject.clone();
    let (Subject::Axis(case) | Subject::Loop(case) | Subject::Gantry(case)) = &mut swept;
    case.machine = sweep.machine(RUN);
    let machine = swept.machine(&mut Double::from);
    let status = column(".status")?;
    let nothing = Double::from(f64::NAN);
    let mut row = [nothing; BODIES];
    match &swept {
        Subject::Gantry(_) => {
            let (bridge, cart) = (machine.bodies - 2, machine.bodies - 1);
            row[bridge] = Double::from(column("final_bridge_position")?) - machine.origin[bridge];
            row[cart] = Double::from(column("final_cart_position")?) - machine.origin[cart];
        }
        // x = y − error
        Subject::Loop(case) => {
            let y = case.moves[0].profile().at(case.moves[0].until).position;
            row[1] = Double::from(y) - Double::from(column("final_cart_error")?) - machine.origin[1];
        }
        Subject::Axis(_) => {
            row[0] = Double::from(column("final_drive_travel")?) - machine.origin[0];
            row[1] = Double::from(column("final_cart_position")?) - machine.origin[1];
        }
    }
    let [until, _] = swept.times();
    // The numbers of docs/sweep.md.
    let end = match status {
        0.0 => End::Complete,
        1.0 => End::Left(f64::NAN),
        other => End::Other(format!("status {other}")),
    };
    let farthest = machine.origin.iter().map(|origin| origin.high.abs()).fold(0.0, f64::max);
    let allowed = if is_piecewise_linear(&swept) { LEAST * (1.0 + farthest) } else { 1e-8 };
    let fed = match subject {
        Subject::Loop(case) => Fed::ByModel(Box::new(case.machine.clone())),
        Subject::Axis(_) | Subject::Gantry(_) => Fed::AsGiven,
    };
    let rows = if end == End::Complete { vec![row] } else { Vec::new() };
    Ok(Answer {
        subject: Some(swept),
        fed,
        times: vec![until],
        rows,
        events: None,
        end,
        allowed,
        is_stated: false,
        ties: 0,
    })
}
