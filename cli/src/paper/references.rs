//! Numbers of independent solutions, to hold this run against.

use super::claims::{Claim, ClaimSource, Rule};
use super::findings::Findings;
use super::model::Response;

/// Numbers of independent high-precision solutions.
pub fn references(f: &Findings) -> Vec<Claim> {
    let number = |id, statement, value: f64, unit, expected: f64, tolerance: f64| {
        Claim::new(id, ClaimSource::Reference, "independent solution", statement).decide(
            "this run",
            value,
            unit,
            near(expected, tolerance),
        )
    };
    let at = |values: &[f64], r: &Response| values[r.row(0.24)];
    let runs = &f.runs;
    let [five, ten] = &runs.table4;
    let events = |r: &Response| r.stops_and_starts();
    let l = &f.linear;
    vec![
        number(
            "golden-table4-5V-motor",
            "Table 4, 5 V: r φ₁ at rest",
            five.final_position(),
            "m",
            0.053744890394,
            1e-12,
        ),
        number(
            "golden-table4-10V-motor",
            "Table 4, 10 V: r φ₁ at rest",
            ten.final_position(),
            "m",
            0.123487374321,
            1e-12,
        ),
        number(
            "golden-table4-5V-cart",
            "Table 4, 5 V: cart at rest",
            five.final_cart_position(),
            "m",
            0.053746653033,
            1e-12,
        ),
        number(
            "golden-table4-10V-cart",
            "Table 4, 10 V: cart at rest",
            ten.final_cart_position(),
            "m",
            0.123487225459,
            1e-12,
        ),
        number(
            "golden-table4-5V-motor-speed",
            "Table 4, 5 V: r φ₁′ at 0.24 s",
            at(&five.speed, five),
            "m/s",
            0.22327328936,
            1e-11,
        ),
        number(
            "golden-table4-10V-motor-speed",
            "Table 4, 10 V: r φ₁′ at 0.24 s",
            at(&ten.speed, ten),
            "m/s",
            0.50568922842,
            1e-11,
        ),
        number(
            "golden-table4-5V-cart-speed",
            "Table 4, 5 V: cart velocity at 0.24 s",
            at(&five.cart_speed, five),
            "m/s",
            0.22352925510,
            1e-11,
        ),
        number(
            "golden-table4-10V-cart-speed",
            "Table 4, 10 V: cart velocity at 0.24 s",
            at(&ten.cart_speed, ten),
            "m/s",
            0.50620371363,
            1e-11,
        ),
        number("golden-table4-5V-stops", "Table 4, 5 V: times that a body stops", events(five).0 as f64, "", 6.0, 0.0),
        number(
            "golden-table4-5V-starts",
            "Table 4, 5 V: times that a body starts",
            events(five).1 as f64,
            "",
            6.0,
            0.0,
        ),
        number("golden-table4-10V-stops", "Table 4, 10 V: times that a body stops", events(ten).0 as f64, "", 4.0, 0.0),
        number(
            "golden-table4-10V-starts",
            "Table 4, 10 V: times that a body starts",
            events(ten).1 as f64,
            "",
            4.0,
            0.0,
        ),
        number(
            "golden-table1-5V",
            "Table 1, 5 V: r φ₁ at 1 s",
            runs.table1[0].final_position(),
            "m",
            0.032136240137,
            1e-12,
        ),
        number(
            "golden-table1-10V",
            "Table 1, 10 V: r φ₁ at 1 s",
            runs.table1[1].final_position(),
            "m",
            0.064272480273,
            1e-12,
        ),
        number(
            "golden-table2-5V",
            "Table 2, 5 V: r φ₁ at 1 s",
            runs.table2[0].final_position(),
            "m",
            0.062371416174,
            1e-12,
        ),
        number(
            "golden-table2-10V",
            "Table 2, 10 V: r φ₁ at 1 s",
            runs.table2[1].final_position(),
            "m",
            0.124742832348,
            1e-12,
        ),
        number(
            "golden-closed-form",
            "Table 1, 5 V: r K_t/R · V T/B_tot",
            runs.table1[0].final_position(),
            "m",
            l.closed_form,
            1e-12,
        ),
        number(
            "golden-matrix-exponential",
            "Table 1, 5 V: eq. (1)–(4) as a matrix, by its exponential",
            runs.table1[0].final_position(),
            "m",
            l.by_exponential,
            1e-12,
        ),
    ]
}

fn near(expected: f64, tolerance: f64) -> Rule {
    Rule::Near { expected, tolerance }
}
