//! The paper's sentences and numbers about what the stage is made of (sections 2.2 and 2.3).

use super::claims::{Claim, ClaimSource::Statement, MINOR, NOT_APPRECIABLE, Rule};
use super::findings::Findings;
use super::words::{percent, share, si};

/// All of them, in the paper's order.
pub fn statements(f: &Findings) -> Vec<Claim> {
    let b = &f.belt;
    let mut all = vec![
        Claim::new("pitch-diameter", Statement, "section 2.2", "60 grooves of 2.03 mm: \"a pitch diameter of 38.8 mm\"")
            .decide("pitch diameter from 60 grooves of 2.03 mm", 2.0 * b.radius, "m", near(38.8e-3, 0.05e-3))
            .further("the tables' radius, doubled", 2.0 * f.sets.table1.machine.pulley_radius, "m", near(38.8e-3, 0.05e-3)),
        Claim::new("composite-modulus", Statement, "section 2.3.1, Table 1", "2/3 neoprene and 1/3 fibreglass: E = 16.67e9 N/m²")
            .decide("2/3 · 6e6 + 1/3 · 50e9", b.composite, "Pa", near(16.67e9, 0.005e9)),
        Claim::new("toothed-section", Statement, "section 2.3.1, eq. (12)–(13)",
            "\"a good assumption is that the cross-section can be chosen to be that of the belt section \
             region without teeth\"")
            .decide(
                "eq. (12) with teeth of neoprene on half the length, over eq. (13), minus one",
                b.neoprene_teeth,
                "1",
                Rule::AtMost(NOT_APPRECIABLE),
            )
            .further(
                "eq. (12) with teeth of the belt's own composite and A_t = 10 A_nt on half the length, over \
                 eq. (13) with the whole span, minus one",
                super::belt::series_over_plain(10.0, 0.5) - 1.0,
                "1",
                Rule::AtMost(MINOR),
            )
            .found(format!("teeth of neoprene add {}", share(b.neoprene_teeth)))
            .remark(format!(
                "The stated reason, A_t much larger than A_nt, does not carry it: with A_t = 10 A_nt on \
                 half the length, \
                 eq. (12) is {} times eq. (13) with the whole span as l. Teeth of neoprene add {} and the section without \
                 teeth is right for that reason. Half the length is our choice.",
                taut::number::significant(super::belt::series_over_plain(10.0, 0.5), 3),
                share(b.neoprene_teeth)
            )),
    ];
    const IDS: [&str; 4] = ["stiffness-table1-k1", "stiffness-table1-k3", "stiffness-table2-k1", "stiffness-table2-k3"];
    const TEXTS: [&str; 4] = [
        "k_1 = k_2 = 2.6552e5 N/m from A, E and l = 0.349 m",
        "k_3 = 11.777e4 N/m from A, E and l = 0.787 m",
        "k_1 = k_2 = 1.3276e5 N/m from A, E and l = 0.349 m",
        "k_3 = 5.8885e4 N/m from A, E and l = 0.787 m",
    ];
    const SOURCES: [&str; 4] =
        ["Table 1, eq. (11)–(13)", "Table 1, eq. (11)–(13)", "Table 2, eq. (11)–(13)", "Table 2, eq. (11)–(13)"];
    for (i, s) in b.stiffness.iter().enumerate() {
        all.push(
            Claim::new(IDS[i], Statement, SOURCES[i], TEXTS[i])
                .decide(
                    "A E/l with the printed E and l; the tolerance is what rounding l to 1 mm allows",
                    s.lengths,
                    "N/m",
                    near(s.printed, s.printed * s.length_rounding),
                )
                .further("the same, to the printed digits", s.lengths, "N/m", near(s.printed, s.half_digit))
                .found(format!("{}, {}", si(s.lengths, "N/m", 5), percent(s.lengths / s.printed - 1.0)))
                .remark(format!(
                    "With the lengths {} and the modulus before rounding it is {}, the printed digits.",
                    if i % 2 == 0 { "13.75 in = 0.34925 m" } else { "31 in = 0.7874 m" },
                    si(s.unrounded, "N/m", 6)
                )),
        );
    }
    all.push(
        Claim::new("belt-mass", Statement, "section 2.3.2", "\"the mass of the belt is assumed to be negligible\"")
            .decide("mass of the belt over all that moves", b.mass_share, "1", Rule::AtMost(MINOR))
            .found(format!("{} of what moves", share(b.mass_share)))
            .remark(format!(
                "The printed section and an endless belt over the printed centre distance weigh {} without \
                 the teeth, with \
                 {} and {} kg/m³ for neoprene and glass; the densities are ours.",
                si(1e3 * b.mass, "g", 3),
                super::belt::DENSITY[1],
                super::belt::DENSITY[2]
            )),
    );
    all.push(
        Claim::new(
            "pulley-inertia",
            Statement,
            "section 2.3.2, Table 1",
            "J = 7e-5 kg m², from a CAD model of the aluminium pulley",
        )
        .decide(
            "length of a solid aluminium cylinder of the pitch diameter with that inertia, over the \
                 belt's width",
            b.cylinder_length / super::belt::WIDTH,
            "",
            Rule::AtMost(3.0),
        )
        .found(format!("a solid cylinder would be {} long", si(1e3 * b.cylinder_length, "mm", 3)))
        .remark(format!(
            "A solid cylinder of 38.8 mm would have to be {} long (2700 kg/m³, our number); one as wide \
                 as the belt has {}. \
                 The printed J must hold more than such a pulley. The limit of three belt widths is ours.",
            si(b.cylinder_length, "m", 3),
            si(b.belt_wide_inertia, "kg m²", 2)
        )),
    );
    all
}

fn near(expected: f64, tolerance: f64) -> Rule {
    Rule::Near { expected, tolerance }
}
