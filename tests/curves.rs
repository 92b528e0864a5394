//! Friction curves, bristles, friction along the travel and spans that follow the cart, against an independent authority
//! (`authorities/curves.py`), which solved each case by two methods; its raw output is kept.

use serde_json::Value;
use taut::case::Case;
use taut::solve::{Ending, Solver, simulate};

#[test]
fn the_general_solver_as_the_authority_has_it() {
    let file: Value = serde_json::from_str(include_str!("authorities/curves.json")).unwrap();
    let mut faults = Vec::new();
    for case in file["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let mut read = Case::from_text(name, case["case"].as_str().unwrap()).unwrap_or_else(|error| panic!("{error}"));
        // The authority does not end a run where the travel ends, and passes it by 3 mm in one case.
        if let Some(travel) = &mut read.stage.travel {
            (travel.min, travel.max) = (-0.349, 0.349);
        }
        let solver = Solver::General { tolerance: 1e-11 };
        let solution = simulate(&read.stage, &read.experiments[0], solver).unwrap();
        if solution.outcome.ending != Ending::Complete {
            faults.push(format!("{name}: {:?}", solution.outcome.ending));
            continue;
        }
        let doubt = |key: &str| {
            let of = |kind: &str| case[kind][key].as_f64().unwrap_or(0.0);
            4.0 * of("rounding_differs_by").max(of("methods_differ_by"))
        };
        let rows = case["rows"].as_array().unwrap();
        for (j, column) in case["columns"].as_array().unwrap().iter().enumerate() {
            let column = column.as_str().unwrap();
            let Some(got) = solution.trajectory.get(column) else { panic!("{name}: no column {column}") };
            let (key, least) = match column {
                "time" => ("", 1e-12),
                c if c.ends_with("angle") => ("angle_rad", 1e-9),
                "cart_position" => ("position_m", 1e-9),
                "cart_speed" => ("speed_m_s", 1e-7),
                c if c.ends_with("speed") => ("speed_rad_s", 1e-5),
                _ => ("current_A", 1e-6),
            };
            let tolerance = doubt(key).max(least);
            let worst = got.iter().zip(rows).map(|(a, row)| (a - row[j].as_f64().unwrap()).abs()).fold(0.0, f64::max);
            println!("{name}: {column} differs by {worst:.1e}");
            if got.len() != rows.len() || worst > tolerance {
                faults.push(format!("{name}: {column} differs by {worst:e}"));
            }
        }
        let got = &solution.outcome.events;
        let want = case["events"].as_array().unwrap();
        let same = got.len() == want.len()
            && got.iter().zip(want).all(|(a, b)| {
                let time = (a.time - b[0].as_f64().unwrap()).abs() <= doubt("event_s").max(1e-8);
                let modes = (i64::from(a.from.code()), i64::from(a.to.code()))
                    == (b[2].as_i64().unwrap(), b[3].as_i64().unwrap());
                time && modes && b[1] == a.body.key()
            });
        if !same {
            faults.push(format!("{name}: events {got:?} against {want:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
