//! Misprints of the paper, and the results of a close reading (P1 to P10).

use super::claims::{Claim, ClaimSource, Rule};
use super::findings::Findings;
use super::model::Change;
use super::studies::{From, largest};
use super::words::{percent, share, si, um};
use std::f64::consts::PI;
use taut::number::significant;

/// The findings of a close reading, P1 to P10.
pub fn readings(f: &Findings) -> Vec<Claim> {
    let (l, t, i, m) = (&f.linear, &f.table3, &f.identifiability, &f.matched);
    // 30.3 V at 800 rpm behind a gear of 5.9 : 1
    let motor_speed = 800.0 * 5.9 * 2.0 * PI / 60.0;
    let back_emf = 30.3 / motor_speed;
    let printed = f.sets.table1.machine.drives[0].motor.back_emf_constant;
    let belt = &f.belt.stiffness;
    let worst = |pick: fn(&super::belt::Stiffness) -> f64| {
        belt.iter().map(|s| (pick(s) - s.printed).abs() / s.half_digit).fold(0.0, f64::max)
    };
    let creeps: Vec<f64> = t.runs.iter().map(|r| r.creep).collect();
    let (low, high) = creeps.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
    let finest =
        t.runs.iter().filter(|r| r.step < 5e-6).map(|r| (r.creep / t.band_edge - 1.0).abs()).fold(0.0, f64::max);
    let first: Vec<f64> = l.travel.iter().map(|(_, frequencies)| frequencies[0]).collect();
    let (lowest, highest) =
        (first.iter().copied().fold(f64::INFINITY, f64::min), first.iter().copied().fold(0.0, f64::max));
    let shared = i.sharing.iter().flat_map(|s| s.difference).fold(0.0, f64::max);
    let shared_share = i
        .sharing
        .iter()
        .flat_map(|s| [0, 1].map(|k| s.difference[k] / f.runs.table4[k].final_position()))
        .fold(0.0, f64::max);
    let inertia: [Change; 2] = [Change::PulleyInertia, Change::AllInertia];
    let final_position = |from| largest(f.runs.effects(from, &inertia), |e| e.final_position);
    let cart = f.runs.table1[0].final_cart_position();
    vec![
        print("p1-sign-of-b", "eq. (7)", "A(4,4) = +b/M")
            .decide(
                "largest real part among the poles of (7) as printed, Table 1",
                l.printed_pole[0],
                "1/s",
                Rule::AtMost(1e-6),
            )
            .found(format!("a pole at {} 1/s", super::words::signed(l.printed_pole[0], 3)))
            .remark(format!(
                "Equations (2) and (17) need −b/M; with it the largest real part is {} 1/s, which is the \
                 free translation's zero but for rounding. As printed, a 5 V pulse drives the motor to {} m \
                 within 1 s.",
                significant(l.corrected_pole[0], 1),
                significant(l.printed_end, 3)
            )),
        print("p2-r-and-r-squared", "eq. (6)–(7)", "x_3 = x_2'")
            .decide(
                "x₃ at the end of the 5 V run with (7), its sign corrected",
                l.corrected_x3,
                "m",
                near(cart, 1e-3 * cart),
            )
            .found(format!("x_3 ends at {}, the cart at {}", si(l.corrected_x3, "m", 4), si(cart, "m", 4)))
            .remark(format!(
                "Row 2 of (7) has k_1 r²/J_1 where k_1 r/J_1 is needed, row 4 has k_1/M where k_1 r/M is \
                 needed. The matrix is right for x_3 = x_2'/r: its x_1 ends within {} of the equations \
                 (1)–(4), its x_3 is {} times the cart's position: {} lengths of the stage (863 mm).",
                si((l.corrected_end - l.by_exponential).abs(), "m", 1),
                significant(l.corrected_x3 / cart, 4),
                significant(l.corrected_x3 / super::belt::RAIL, 3)
            )),
        print("p3-back-emf", "section 2.2, Table 1", "30.3 V, 800 rpm, 5.9:1; K_e = 0.023 V s/rad")
            .decide(
                "back-EMF constant at the motor's shaft from the rating",
                back_emf,
                "V s/rad",
                near(printed, 0.5e-3),
            )
            .found(format!("the rating implies {}", si(back_emf, "V s/rad", 3)))
            .remark(format!(
                "With 0.023 V s/rad, 800 rpm behind the gear need {}, not 30.3 V. Equation (4) has no gear; \
                 with 5.9 : 1 in it, Table 4 would end {} (5 V) and {} (10 V) further.",
                si(printed * motor_speed, "V", 3),
                percent(i.geared[0] / f.runs.table4[0].final_position() - 1.0),
                percent(i.geared[1] / f.runs.table4[1].final_position() - 1.0)
            )),
        print("p4-lengths", "section 2.3.1, Tables 1–2", "l_1 = l_2 = 0.349 m, l_3 = 0.787 m")
            .decide(
                "largest distance of the computed from the printed stiffness, in half units of its last \
                 digit",
                worst(|s| s.lengths),
                "",
                Rule::AtMost(1.0),
            )
            .found(format!("off by up to {} half units of the last digit", significant(worst(|s| s.lengths), 3)))
            .remark(format!(
                "With 0.34925 m and 0.7874 m the largest distance is {}; with these and the modulus before \
                 rounding it is {}.",
                significant(worst(|s| s.inches), 3),
                significant(worst(|s| s.unrounded), 2)
            )),
        print("p5-notation", "Tables 1, 2, 4, figures 18–19", "R, B, F_r and the references to equations")
            .found("notation only")
            .remark(
                "A matter of notation only: no number depends on it. R is a radius and a resistance, B a \
                 pulley's coefficient and the cart's, F_r and F_τ are one, figure 18 is described as (16) \
                 and captioned (17), and (2) is cited where (4) is meant.",
            ),
        reading(
            "p6-table3-creeps",
            "Table 3",
            "Table 3 freezes a speed inside its band instead of ending it: the axis creeps after its stop",
        )
        .decide("largest creep between 0.5 s and 1 s", low.abs().max(high.abs()), "m", Rule::AtLeast(i.count))
        .decide("motion of the exact solution after its last stop", t.exact_creep, "m", Rule::AtMost(0.0))
        .remark(format!(
            "Over all formulas, steps and both voltages the creep lies between {} and \
                 {}.",
            um(low, 3),
            um(high, 3)
        )),
        reading("p6-table3-limit", "Table 3", "with a step of 1 µs the creep is that of the band's edge, 0.01 rad/s")
            .decide(
                "distance of the creep at a step of 1 µs from 0.01 rad/s · r · 0.5 s, \
                 relative",
                finest,
                "1",
                Rule::AtMost(0.01),
            )
            .found(format!("{} from it at a step of 1 µs", share(finest)))
            .remark(format!(
                "That is {} in half a second: a finer step does not bring the axis to rest. Larger steps \
                 show no order.",
                um(t.band_edge, 3)
            )),
        reading("p6-sign-of-zero", "Table 3", "sign(0) = 0 drops Coulomb friction at the start")
            .decide(
                "first acceleration of the drive pulley at 5 V with Table 3, over that with \
                 friction",
                t.start.0 / t.start.1,
                "",
                Rule::AtLeast(1.001),
            )
            .remark(format!(
                "{} against {} rad/s². It acts only while the speed is exactly zero: in the first \
                 evaluation of the first step.",
                significant(t.start.0, 4),
                significant(t.start.1, 4)
            )),
        reading(
            "p7-scaling",
            "Tables 1, 2, 4",
            "E, J, M, B, b, τ_c, F_c and K_t/R times one factor leave every response unchanged",
        )
        .decide(
            format!("largest difference in r φ₁ with everything times {}", i.factor),
            i.scaled,
            "m",
            Rule::AtMost(1e-12),
        ),
        reading(
            "p7-sharing",
            "Table 4",
            "friction shared otherwise among pulleys and cart, with the same totals, looks the same to the \
             encoder",
        )
        .decide("largest difference in r φ₁, over the final position", shared_share, "1", Rule::AtMost(1e-3))
        .further("largest difference in r φ₁", shared, "m", Rule::AtMost(i.count))
        .found(format!("up to {} or {}", um(shared, 3), share(shared_share)))
        .remark(format!(
            "The largest difference is {}, {} counts of an encoder before the gear: the belt's stretch reveals \
             slightly where friction acts. Totals: {} and {}.",
            um(shared, 3),
            significant(shared / i.count, 2),
            si(i.total_viscous, "N m s", 4),
            si(i.total_coulomb, "N m", 4)
        )),
        reading("p8-first-mode", "Table 2", "first elastic mode at 194.8 Hz").decide(
            "frequency with l_1 = l_2",
            mode(f, 0),
            "Hz",
            near(194.8, 0.05),
        ),
        reading("p8-second-mode", "Table 2", "second elastic mode at 196.6 Hz").decide(
            "frequency with l_1 = l_2",
            mode(f, 1),
            "Hz",
            near(196.6, 0.05),
        ),
        reading("p8-damping", "Tables 2 and 4", "damping ratios of 0.013 to 0.019")
            .decide(
                "least damping ratio, viscous friction of Table 4",
                f.linear.modes[2].first().map_or(f64::NAN, |m| m.damping),
                "",
                near(0.013, 0.5e-3),
            )
            .decide(
                "greatest damping ratio, Table 2",
                f.linear.modes[1].get(1).map_or(f64::NAN, |m| m.damping),
                "",
                near(0.019, 0.5e-3),
            )
            .found(format!(
                "{} to {}",
                significant(f.linear.modes[2].first().map_or(f64::NAN, |m| m.damping), 3),
                significant(f.linear.modes[1].get(1).map_or(f64::NAN, |m| m.damping), 3)
            ))
            .remark(format!(
                "Table 2 itself has {} and {}; the lower end belongs to the viscous friction of Table 4.",
                significant(f.linear.modes[1].first().map_or(f64::NAN, |m| m.damping), 3),
                significant(f.linear.modes[1].get(1).map_or(f64::NAN, |m| m.damping), 3)
            )),
        reading("p8-travel", "Table 2", "over the travel the first mode moves between 161 and 195 Hz")
            .decide("lowest frequency, cart 50 mm from a pulley", lowest, "Hz", near(161.0, 0.5))
            .decide("highest frequency, cart in the middle", highest, "Hz", near(195.0, 0.5))
            .found(format!("{} to {} Hz", significant(lowest, 4), significant(highest, 4)))
            .remark("The paper keeps k_1 = k_2; how near the cart comes to the pulleys is our choice."),
        reading(
            "p9-superposition",
            "figures 14, 15, 20, 21",
            "10 V moves a linear stage 2 times as far as 5 V, Table 4 2.298 times",
        )
        .decide("Table 2", m.ratio.0, "", near(2.0, 1e-9))
        .decide("Table 4", m.ratio.1, "", near(2.298, 0.5e-3))
        .found(format!("{} and {}", significant(m.ratio.0, 4), significant(m.ratio.1, 4))),
        reading("p9-table2-at-5-V", "Table 2", "Table 2 ends 16 % beyond Table 4 at 5 V").decide(
            "final position, relative",
            m.final_position[0],
            "1",
            near(0.16, 0.005),
        ),
        reading("p9-table2-at-10-V", "Table 2", "Table 2 ends 1.0 % beyond Table 4 at 10 V").decide(
            "final position, relative",
            m.final_position[1],
            "1",
            near(0.010, 0.0005),
        ),
        reading("p9-scaled", "figures 14, 15", "a linear set that meets Table 4 at 5 V misses it by -13 % at 10 V")
            .decide("final position, relative", m.scaled_to_5, "1", near(-0.13, 0.005))
            .remark(format!("Conversely, a set that meets 10 V is {} off at 5 V.", percent(m.scaled_to_10))),
        reading("p10-inertia", "figure 10", "the final position is independent of inertia for viscous friction only")
            .decide("largest change, Table 1", final_position(From::Table1), "1", Rule::AtMost(1e-5))
            .decide(
                "J ×2, Table 4 at 5 V",
                f.runs.one(From::Table4, Change::PulleyInertia, 2.0, 5.0).final_position,
                "1",
                near(-0.019, 0.0005),
            )
            .decide(
                "J and M ×2, Table 4 at 5 V",
                f.runs.one(From::Table4, Change::AllInertia, 2.0, 5.0).final_position,
                "1",
                near(-0.040, 0.0005),
            )
            .found(format!(
                "Table 1: {}; Table 4: up to {}",
                share(final_position(From::Table1)),
                share(final_position(From::Table4))
            )),
        reading("p10-friction", "figure 12", "friction ×2 and ×0.5 changes the final position by -49 % and +94 %")
            .decide(
                "×2, Table 1",
                f.runs.one(From::Table1, Change::Friction, 2.0, 5.0).final_position,
                "1",
                near(-0.49, 0.005),
            )
            .decide(
                "×0.5, Table 1",
                f.runs.one(From::Table1, Change::Friction, 0.5, 5.0).final_position,
                "1",
                near(0.94, 0.005),
            )
            .found(format!(
                "{} and {}",
                percent(f.runs.one(From::Table1, Change::Friction, 2.0, 5.0).final_position),
                percent(f.runs.one(From::Table1, Change::Friction, 0.5, 5.0).final_position)
            ))
            .remark(format!(
                "Both belong to Table 1. From Table 4 it is {} and {} at 5 V.",
                percent(f.runs.one(From::Table4, Change::Friction, 2.0, 5.0).final_position),
                percent(f.runs.one(From::Table4, Change::Friction, 0.5, 5.0).final_position)
            )),
        reading(
            "p10-stiffness",
            "figures 6–7",
            "stiffness changes the final position by less than 0.001 % (linear), by 0.03 % (Coulomb)",
        )
        .decide(
            "largest change, Table 1",
            largest(f.runs.effects(From::Table1, &[Change::Stiffness]), |e| e.final_position),
            "1",
            Rule::AtMost(1e-5),
        )
        .decide(
            "largest change, Table 4",
            largest(f.runs.effects(From::Table4, &[Change::Stiffness]), |e| e.final_position),
            "1",
            near(3e-4, 0.5e-4),
        )
        .found(format!(
            "Table 1: {}; Table 4: up to {}",
            share(largest(f.runs.effects(From::Table1, &[Change::Stiffness]), |e| e.final_position)),
            share(largest(f.runs.effects(From::Table4, &[Change::Stiffness]), |e| e.final_position))
        ))
        .remark(format!(
            "Table 1: {}.",
            share(largest(f.runs.effects(From::Table1, &[Change::Stiffness]), |e| e.final_position))
        )),
    ]
}

fn mode(f: &Findings, index: usize) -> f64 {
    f.linear.modes[1].get(index).map_or(f64::NAN, |m| m.frequency)
}

fn print(id: &'static str, source: &'static str, statement: &'static str) -> Claim {
    Claim::new(id, ClaimSource::Print, source, statement)
}

fn reading(id: &'static str, source: &'static str, statement: &'static str) -> Claim {
    Claim::new(id, ClaimSource::Reading, source, statement)
}

fn near(expected: f64, tolerance: f64) -> Rule {
    Rule::Near { expected, tolerance }
}
