//! The report's tables: parameters, stiffness, modes, the study of one parameter at a time, Table 3.

use super::belt::{MODULUS_1, MODULUS_2, SECTION};
use super::findings::Findings;
use super::model::VOLTS;
use super::studies::{Effect, From};
use super::words::{signed, symbols};
use taut::machine::Machine;
use taut::number::{engineering, significant};
use taut::solve::Method;
use taut_report::{Cell, Table};

/// Tables 1, 2 and 4: the printed symbol, ours, and what runs.
pub fn parameters(f: &Findings) -> Table {
    type Pick = fn(&Machine) -> f64;
    let rows: [(&str, &str, &str, &str, Pick); 16] = [
        ("R", "r", "drive_pulley.radius", "m", |s| s.pulley_radius),
        ("k_1", "k_1", "belt.stiffness", "N/m", |s| s.belt.stiffness[0]),
        ("k_2", "k_2", "belt.stiffness", "N/m", |s| s.belt.stiffness[1]),
        ("k_3", "k_3", "belt.stiffness", "N/m", |s| s.belt.stiffness[2]),
        ("B, B1", "B_1", "drive_pulley.friction.viscous", "N m s", |s| s.drive_pulley.friction.forward.viscous),
        ("B, B2", "B_2", "idler_pulley.friction.viscous", "N m s", |s| s.idler_pulley.friction.forward.viscous),
        ("b, B", "b", "cart.friction.viscous", "N s/m", |s| s.cart.friction.forward.viscous),
        ("τ_c1", "τ_c1", "drive_pulley.friction.coulomb", "N m", |s| s.drive_pulley.friction.forward.coulomb),
        ("τ_c2", "τ_c2", "idler_pulley.friction.coulomb", "N m", |s| s.idler_pulley.friction.forward.coulomb),
        ("F_c", "F_c", "cart.friction.coulomb", "N", |s| s.cart.friction.forward.coulomb),
        ("J", "J_1", "drive_pulley.inertia", "kg m^2", |s| s.drive_pulley.inertia),
        ("J", "J_2", "idler_pulley.inertia", "kg m^2", |s| s.idler_pulley.inertia),
        ("M", "M", "cart.mass", "kg", |s| s.cart.mass),
        ("K_t", "K_t", "motor.torque_constant", "N m/A", |s| s.drives[0].motor.torque_constant),
        ("K_e", "K_e", "motor.back_emf_constant", "V s/rad", |s| s.drives[0].motor.back_emf_constant),
        ("R", "R", "motor.resistance", "ohm", |s| s.drives[0].motor.resistance),
    ];
    let mut table = Table::new("Tables 1, 2 and 4 as they run")
        .column("Printed, here", "")
        .column("In the case file", "")
        .column("Unit", "")
        .column("Table 1", "")
        .column("Table 2", "")
        .column("Table 4", "");
    let unit = |unit: &str| Cell::Text(taut::number::pretty_unit(unit).replace(' ', "\u{a0}"));
    for (symbol, si, values) in [("A", "m^2", [SECTION; 2]), ("E", "N/m^2", [MODULUS_1, MODULUS_2])] {
        table.row([
            symbol.into(),
            maud::html! { small { "with the stiffness, below" } }.into(),
            unit(si),
            number(values[0]),
            number(values[1]),
            taken_over(values[1]),
        ]);
    }
    for (printed, ours, key, si, pick) in rows {
        let [t1, t2, t4] = [&f.sets.table1, &f.sets.table2, &f.sets.table4].map(|case| pick(&case.machine));
        table.row([
            symbols(&if printed == ours { printed.to_string() } else { format!("{printed} → {ours}") }).into(),
            maud::html! { small { code { (key) } } }.into(),
            unit(si),
            number(t1),
            number(t2),
            if key.contains("friction") { number(t4) } else { taken_over(t4) },
        ]);
    }
    table
}

/// As many digits as the number has, up to six.
fn number(value: f64) -> Cell {
    Cell::Number(digits(value))
}

/// A number in grey, aligned to the right.
fn taken_over(value: f64) -> Cell {
    Cell::Markup(maud::html! { div.num { small { (digits(value)) } } })
}

fn digits(value: f64) -> String {
    if value == 0.0 { "–".into() } else { engineering(value, "", 6) }
}

/// Eq. (11)-(13) beside the printed stiffness.
pub fn stiffness(f: &Findings) -> Table {
    let mut table = Table::new("Stiffness by eq. (11), N/m, and in brackets its difference from the printed one, %")
        .column("", "")
        .column("printed", "")
        .column("0.349, 0.787 m", "")
        .column("0.34925, 0.7874 m", "")
        .column("and E unrounded", "");
    for s in &f.belt.stiffness {
        let beside = |k: f64| Cell::Number(format!("{k:.0} ({})", signed(100.0 * (k / s.printed - 1.0), 2)));
        table.row([
            format!("{}, {}", s.table, s.symbol).replace(' ', "\u{a0}").into(),
            Cell::fixed(s.printed, 0),
            beside(s.lengths),
            beside(s.inches),
            beside(s.unrounded),
        ]);
    }
    table
}

/// Eq. (12) over (13) for some shapes of tooth.
pub fn toothed() -> Table {
    let mut table = Table::new("Eq. (12) over eq. (13), l the whole span, for toothed sections of so many plain ones")
        .column("Toothed part of the length", "");
    for ratio in [1.5, 2.0, 5.0, 10.0] {
        table = table.column(ratio.to_string(), "");
    }
    for share in [0.3, 0.4, 0.5, 0.6] {
        let mut row = vec![Cell::fixed(share, 1)];
        row.extend([1.5, 2.0, 5.0, 10.0].map(|ratio| Cell::fixed(super::belt::series_over_plain(ratio, share), 3)));
        table.row(row);
    }
    table
}

/// Elastic modes of the three sets.
pub fn modes(f: &Findings) -> Table {
    let mut table = Table::new("Modes of the linear equations (1)–(4)")
        .column("Set", "")
        .column("First mode", "Hz")
        .column("Damping", "")
        .column("Second mode", "Hz")
        .column("Damping", "")
        .column("Slow pole", "1/s")
        .column("with a rigid belt", "1/s");
    let names = ["Table 1", "Table 2", "Table 4, without Coulomb friction"];
    for ((name, modes), slow) in names.into_iter().zip(&f.linear.modes).zip(f.linear.slow) {
        let mut row = vec![Cell::from(name)];
        for mode in modes {
            row.extend([Cell::fixed(mode.frequency, 2), Cell::fixed(mode.damping, 4)]);
        }
        row.extend([Cell::fixed(slow.0, 3), Cell::fixed(slow.1, 3)]);
        table.row(row);
    }
    table
}

/// One parameter at a time, at 5 V.
pub fn study(f: &Findings, from: From) -> Table {
    let name = match from {
        From::Table1 => "From Table 1, linear, 5 V and 10 V alike",
        From::Table4 => "From Table 4, with Coulomb friction, 5 V",
    };
    let mut table = Table::new(name)
        .column("Changed", "")
        .column("by", "")
        .column("Final", "%")
        .column("Path, up to", "%")
        .column("Peak speed", "%")
        .column("Time constant", "%")
        .column("Oscillation", "%");
    table = match from {
        From::Table1 => table.column("Time constant", "ms"),
        From::Table4 => table.column("Final, 10\u{a0}V", "%"),
    };
    for e in f.runs.effects.iter().filter(|e| e.from == from && e.volts == VOLTS[0]) {
        let mut row = effect_row(e);
        row.push(match from {
            From::Table1 => Cell::fixed(1e3 * e.time_constant, 2),
            From::Table4 => change(f.runs.one(from, e.change, e.factor, VOLTS[1]).final_position),
        });
        table.row(row);
    }
    table
}

/// A relative change in per cent: three digits down to a thousandth of a per cent.
fn change(value: f64) -> Cell {
    let p = 100.0 * value;
    Cell::Number(match p.abs() {
        small if small < 5e-5 => "0.0000".into(),
        small if small < 0.1 => format!("{}{}", if p > 0.0 { "+" } else { "" }, taut::number::fixed(p, 4)),
        large if large < 10.0 => format!("{}{}", if p > 0.0 { "+" } else { "" }, taut::number::fixed(p, 2)),
        _ => format!("{}{}", if p > 0.0 { "+" } else { "" }, taut::number::fixed(p, 1)),
    })
}

fn effect_row(e: &Effect) -> Vec<Cell> {
    vec![
        e.change.name().into(),
        Cell::Number(format!("× {}", e.factor)),
        change(e.final_position),
        Cell::Number(significant(100.0 * e.path, 3)),
        change(e.peak),
        change(e.time_constant_change),
        change(e.oscillation),
    ]
}

/// Linear against non-linear, at both voltages.
pub fn matched(f: &Findings) -> Table {
    let mut table = Table::new("Final position r φ₁ and velocity at 0.24 s")
        .column("Set", "")
        .column("5 V", "mm")
        .column("10 V", "mm")
        .column("10 V / 5 V", "")
        .column("5 V", "mm/s")
        .column("10 V", "mm/s")
        .column("10 V / 5 V", "");
    for (name, runs) in [("Table 1", &f.runs.table1), ("Table 2", &f.runs.table2), ("Table 4", &f.runs.table4)] {
        let [p5, p10] = [0, 1].map(|i| runs[i].final_position());
        let [v5, v10] = [0, 1].map(|i| runs[i].speed[runs[i].row(0.24)]);
        table.row([
            name.into(),
            Cell::fixed(1e3 * p5, 4),
            Cell::fixed(1e3 * p10, 4),
            Cell::fixed(p10 / p5, 4),
            Cell::fixed(1e3 * v5, 3),
            Cell::fixed(1e3 * v10, 3),
            Cell::fixed(v10 / v5, 4),
        ]);
    }
    table
}

/// Both ways of reading Table 2.
pub fn readings(f: &Findings) -> Table {
    let m = &f.matched;
    let mut table = Table::new("Linear sets against Table 4, final position")
        .column("Linear set", "")
        .column("at 5 V", "%")
        .column("at 10 V", "%");
    let row = |name: &str, five: f64, ten: f64| [name.into(), change(five), change(ten)];
    table.row(row("Table 2 as printed", m.final_position[0], m.final_position[1]));
    table.row(row("any set scaled to meet Table 4 at 5 V", 0.0, m.scaled_to_5));
    table.row(row("any set scaled to meet Table 4 at 10 V", m.scaled_to_10, 0.0));
    table
}

/// Table 3, by formula and step.
pub fn table3(f: &Findings) -> Table {
    let mut table = Table::new("Table 3 with a fixed step, against the exact solution")
        .column("Formula", "")
        .column("Step", "s")
        .column("Final, 5 V", "mm")
        .column("Creep", "µm")
        .column("Turns", "")
        .column("Final, 10 V", "mm")
        .column("Creep", "µm")
        .column("Turns", "");
    for run in f.table3.runs.iter().filter(|r| r.volts == VOLTS[0]) {
        let other = f.table3.runs.iter().find(|o| o.volts == VOLTS[1] && o.step == run.step && o.method == run.method);
        let Some(other) = other else { continue };
        table.row([
            match run.method {
                Method::RungeKutta4 => "Runge–Kutta\u{a0}4",
                Method::DormandPrince5 => "Dormand–Prince\u{a0}5",
            }
            .into(),
            Cell::Number(engineering(run.step, "", 1)),
            Cell::fixed(1e3 * run.final_position, 4),
            Cell::Number(signed(1e6 * run.creep, 3)),
            Cell::Number(run.turns.to_string()),
            Cell::fixed(1e3 * other.final_position, 4),
            Cell::Number(signed(1e6 * other.creep, 3)),
            Cell::Number(other.turns.to_string()),
        ]);
    }
    let late = f.table3.time.iter().position(|t| *t >= 0.35).unwrap_or(0);
    let turns = |values: &[f64]| {
        let steps: Vec<f64> = values[late..].windows(2).map(|x| x[1] - x[0]).collect();
        Cell::Number(steps.windows(2).filter(|v| v[0] * v[1] < 0.0).count().to_string())
    };
    let last = |values: &[f64]| values[values.len() - 1];
    let creep = |values: &[f64]| last(values) - values[values.len() / 2];
    let cell =
        |values: &[f64]| Cell::Number(if creep(values) == 0.0 { "0".into() } else { signed(1e6 * creep(values), 3) });
    let [five, ten] = &f.table3.exact;
    table.row([
        "exact".into(),
        Cell::Number("none".into()),
        Cell::fixed(1e3 * last(five), 4),
        cell(five),
        turns(five),
        Cell::fixed(1e3 * last(ten), 4),
        cell(ten),
        turns(ten),
    ]);
    table
}

/// Friction shared otherwise.
pub fn sharing(f: &Findings) -> Table {
    let i = &f.identifiability;
    let mut table = Table::new("Friction shared otherwise, with the same totals: largest difference in r φ₁")
        .column("Instead of Table 4", "")
        .column("5 V", "µm")
        .column("10 V", "µm")
        .column("Encoder counts", "")
        .column("Adjusted: 5 V", "µm")
        .column("10 V", "µm");
    for s in &i.sharing {
        let counts = s.difference.map(|d| significant(d / i.count, 2));
        table.row([
            s.name.into(),
            Cell::fixed(1e6 * s.difference[0], 1),
            Cell::fixed(1e6 * s.difference[1], 1),
            Cell::Number(format!("{}, {}", counts[0], counts[1])),
            Cell::fixed(1e6 * s.adjusted[0], 1),
            Cell::fixed(1e6 * s.adjusted[1], 1),
        ]);
    }
    table
}
