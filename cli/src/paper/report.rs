//! The report: what holds and what does not, then the paper from its first figure to its last.

use super::claims::{Claim, ClaimSource, Verdict};
use super::findings::Findings;
use super::misprints::MISPRINTS;
use super::plots::Plot;
use super::studies::From;
use super::words::{found, mm, percent, rule, share, si, symbols, um, value};
use super::{diagrams, tables};
use maud::{Markup, html};
use taut::number::significant;
use taut_report::{Callout, Cell, Page, Table, machine_drawing};

/// Puts it together. `plots` are looked up by their files' names.
pub fn page(f: &Findings, claims: &[Claim], plots: &[Plot]) -> Page {
    let mut page = Page::new("A belt-driven stage, recomputed").subtitle(html! {
        "Every table, figure and claim of K. Sollmann and M. Jouaneh, “Dynamic modelling of a single-axis \
         belt-drive \
         system”, " i { "International Journal of Modelling, Identification and Control" } ", 2011."
    });
    let report = &mut Report { page: &mut page, f, claims, plots };
    report.summary();
    for (heading, content) in sections() {
        report.page.begin_fold(heading);
        content(report);
        report.page.end_fold();
    }
    page.footer(html! { "Computed by taut " (env!("CARGO_PKG_VERSION")) ", command " code { "taut paper" } ". This file needs no network." });
    page
}

/// The heading of a section, and what writes it.
type Section<'a> = (&'static str, fn(&mut Report<'a>));

/// The sections behind the summary, which are folded: the summary alone is read in ten minutes.
fn sections<'a>() -> [Section<'a>; 10] {
    [
        ("The stage and its parameters", Report::parameters),
        ("Belt, pulleys and modes", Report::belt),
        ("First response: Table 1", Report::first_response),
        ("One parameter at a time", Report::one_at_a_time),
        ("A linear set against two voltages", Report::matching),
        ("Friction with a threshold", Report::friction_models),
        ("Table 3 against the exact solution", Report::table3),
        ("Misprints and inconsistencies", Report::misprints),
        ("Every number and its rule", Report::all_claims),
        ("How it was computed", Report::method),
    ]
}

struct Report<'a> {
    page: &'a mut Page,
    f: &'a Findings,
    claims: &'a [Claim],
    plots: &'a [Plot],
}

impl Report<'_> {
    fn claim(&mut self, id: &str) {
        if let Some(claim) = self.claims.iter().find(|c| c.id == id) {
            self.page.markup(callout(claim));
        }
    }

    fn figure(&mut self, file: &str) {
        if let Some(plot) = self.plots.iter().find(|p| p.file == file) {
            self.page.figure(&plot.figure);
        }
    }

    fn figures(&mut self, numbers: std::ops::RangeInclusive<u8>) {
        numbers.for_each(|n| self.figure(&format!("figure-{n:02}")));
    }

    fn summary(&mut self) {
        let f = self.f;
        let of = |verdict: Verdict, kinds: &[ClaimSource]| {
            self.claims.iter().filter(|c| kinds.contains(&c.kind) && c.verdict() == verdict).count()
        };
        let own = [ClaimSource::Statement, ClaimSource::Print];
        let all: usize = Verdict::ALL.into_iter().map(|v| of(v, &own)).sum();
        let count = |v| of(v, &own);
        let linear = |change, factor| f.runs.one(From::Table1, change, factor, 5.0);
        use super::model::Change::{AllInertia, Friction, PulleyInertia, Stiffness};
        let (confirmed, remark) = (count(Verdict::Confirmed), count(Verdict::WithRemark));
        let (not, open) = (count(Verdict::NotConfirmed), count(Verdict::CannotBeChecked));
        let inertia = f.runs.one(From::Table4, PulleyInertia, 2.0, 5.0).final_position;
        let creep = f.table3.runs.iter().map(|r| r.creep.abs()).fold(0.0, f64::max);
        let pole = f.linear.printed_pole[0];
        let misses = (f.matched.final_position, f.matched.scaled_to_5);
        let page = &mut *self.page;
        page.section("Summary");
        page.prose(html! {
            "The paper models a cart on a timing belt as three inertias and three springs, first with \
             viscous friction, then with \
             Coulomb friction. Its equations are solved here exactly, and its statements are held against the result. Of "
            (all) " statements and printed items, " b { (confirmed) " are confirmed" } ", " (remark) " with a remark, " (not)
            " not, and " (open) " cannot be checked: mostly those that rest on the measured curves, which \
             are not available as data. With the results of a close reading and the independent numbers there are "
            (self.claims.len()) " claims, which " a href="#every-number" { "a section below" } " lists with every number."
        });
        page.markup(html! { dl {
            dt { "Friction first" }
            dd { "Twice the friction changes the final position by " (percent(linear(Friction, 2.0).final_position)) ", half of it by "
                 (percent(linear(Friction, 0.5).final_position)) ". Twice the stiffness changes the position by at most "
                 (share(linear(Stiffness, 2.0).path)) ". Twice the inertia changes the time constant by "
                 (percent(linear(PulleyInertia, 2.0).time_constant_change)) " (J) or " (percent(linear(AllInertia, 2.0).time_constant_change))
                 " (J and M), and the final position by " (share(linear(AllInertia, 2.0).final_position)) "." }
            dt { "Two voltages" }
            dd { "As the paper says, no linear set serves both: one that meets Table 4 at 5 V is \
             " (percent(misses.1)) " off at 10 V. But Table 2, \
                 called matched for 5 V, lies " (percent(misses.0[0])) " from Table 4 at 5 V and " (percent(misses.0[1])) " at 10 V." }
            dt { "Coulomb friction" }
            dd { "With it, inertia does move the final position: by " (percent(inertia)) " for twice J at 5 V." }
            dt { "Equation (7)" }
            dd { "As printed it is unstable, with a pole at " (super::words::signed(pole, 3)) " 1/s: the sign of b is a misprint." }
            dt { "Table 3" }
            dd { "As printed it lets the axis creep by up to " (um(creep, 3)) " in half a second after it \
             should have stopped. The exact solution then moves by "
                 @if f.table3.exact_creep == 0.0 { "not one bit." } @else { (um(f.table3.exact_creep, 2)) "." } }
            dt { "Position data" }
            dd { "They determine friction by its totals, " (si(f.identifiability.total_viscous, "N m s", 4)) " and "
                 (si(f.identifiability.total_coulomb, "N m", 4)) ". Sharing them otherwise among pulleys \
                  and cart moves the motor by at most "
                 (um(f.identifiability.sharing.iter().flat_map(|s| s.difference).fold(0.0, f64::max), 2)) "." }
        } });
        let mut table = Table::new("").column("The paper", "").column("Here", "");
        for claim in self.claims.iter().filter(|c| own.contains(&c.kind)) {
            table.row([
                Cell::Markup(html! { (symbols(claim.statement)) br; small { (claim.source) } }),
                Cell::Markup(html! { (badge(claim.verdict())) br; (symbols(&found(claim))) }),
            ]);
        }
        page.table(&table);
    }

    fn parameters(&mut self) {
        let f = self.f;
        let page = &mut *self.page;
        page.drawing(
            &machine_drawing(&f.sets.table1.machine),
            html! { b { "Figures 1 and 2. " } "The stage as it is modelled, with the values of Table 1. \
            Rotation and position count positive in the sense of the arrows." },
        );
        page.prose(
            "The three sets run as printed. Table 4 gives friction alone; everything else is Table 2's. \
             Table 2 is Table 1 with \
             other stiffness, friction and inertia:",
        );
        let ratio = |pick: fn(&taut::machine::Machine) -> f64| {
            taut::number::engineering(pick(&f.sets.table2.machine) / pick(&f.sets.table1.machine), "", 4)
        };
        page.definitions([
            (
                "Stiffness k₁, k₃",
                format!("{} and {} of Table 1", ratio(|s| s.belt.stiffness[0]), ratio(|s| s.belt.stiffness[2])),
            ),
            (
                "Viscous friction B, b",
                format!(
                    "{} and {} of it",
                    ratio(|s| s.drive_pulley.friction.forward.viscous),
                    ratio(|s| s.cart.friction.forward.viscous)
                ),
            ),
            (
                "Inertia J, mass M",
                format!("{} and {} of it", ratio(|s| s.drive_pulley.inertia), ratio(|s| s.cart.mass)),
            ),
        ]);
        page.table(&tables::parameters(f));
        page.markup(html! { p.note { (symbols(
        "Grey: taken over from Table 2. \"R\" is printed for the radius and for the resistance; \"B\" \
         for the pulleys in Tables 1 and 2 and for the cart in Table 4; K_e is printed in V/(rad s).")) } });
    }

    fn belt(&mut self) {
        let f = self.f;
        self.page.prose(format!(
            "Two thirds of neoprene and one third of fibreglass in parallel give a modulus of {}; the paper \
             prints 16.67 GPa. \
             Equation (11) then gives the stiffness. The printed lengths are rounded: with the same lengths in inches, and the \
             modulus before rounding, all printed digits come out.",
            si(f.belt.composite, "Pa", 6)
        ));
        self.page.table(&tables::stiffness(f));
        for id in ["composite-modulus", "stiffness-table1-k1", "pitch-diameter"] {
            self.claim(id);
        }
        self.page.subsection("Teeth");
        self.page.prose(
            "Equation (12) puts toothed and plain segments in series; eq. (13) keeps the plain section. Their \
             difference depends on the length that is meant.",
        );
        self.figure("figure-03");
        self.page.table(&tables::toothed());
        self.claim("toothed-section");
        self.page.subsection("Inertia and mass");
        self.page.prose(format!("The printed section is {} thick at the printed width.", si(f.belt.thickness, "m", 3)));
        self.claim("belt-mass");
        self.claim("pulley-inertia");
        self.page.subsection("Modes");
        self.page.prose(format!(
            "Three inertias and three springs move together with a slow decay, and oscillate in two modes with similar \
             frequencies: {} and {} Hz for Table 2. With l₁ = l₂ the modes are nearly equal; away from the middle \
             their frequencies separate.",
            significant(f.linear.modes[1].first().map_or(f64::NAN, |m| m.frequency), 4),
            significant(f.linear.modes[1].get(1).map_or(f64::NAN, |m| m.frequency), 4)
        ));
        self.page.table(&tables::modes(f));
        self.figure("modes-along-the-travel");
    }

    fn first_response(&mut self) {
        self.page.prose(
            "The input is a pulse of 0.25 s, of 5 V or 10 V. Position and velocity are the motor's, \
             expressed in metres by the \
             pulley's radius. The figures show the first half second, the files of data the whole.",
        );
        self.figures(4..=5);
        self.claim("figure-4-falls-short");
    }

    fn one_at_a_time(&mut self) {
        self.page.prose(
            "Stiffness, inertia and friction are doubled and halved, one after the other. The paper does it \
             from Table 1; the second \
             table does the same from Table 4. “Inertia” may mean J alone or J and M: both are given. All columns are changes against the \
             unchanged set: of the final position; of the position at any time, in per cent of the final one; of the highest speed; \
             of the time until the mean velocity of the three inertias has reached 1 − 1/e of that in the last 50 ms of the pulse; \
             of the largest difference between motor and cart velocity.",
        );
        self.page.table(&tables::study(self.f, From::Table1));
        self.page.table(&tables::study(self.f, From::Table4));
        self.claim("friction-biggest");
        self.claim("inertia-stiffness-minor");
        self.page.subsection("Stiffness");
        self.figures(6..=9);
        self.claim("stiffness-position");
        self.claim("stiffness-oscillation");
        self.page.subsection("Inertia");
        self.figures(10..=11);
        for id in ["inertia-slower", "inertia-final", "inertia-coasting"] {
            self.claim(id);
        }
        self.page.subsection("Friction");
        self.figures(12..=13);
    }

    fn matching(&mut self) {
        let m = &self.f.matched;
        self.page.prose(format!(
            "A linear stage goes exactly twice as far for twice the voltage; here {} times. With the \
             friction of Table 4 it goes {} times as far. \
             No linear set can therefore agree with Table 4 at both voltages.",
            significant(m.ratio.0, 5),
            significant(m.ratio.1, 4)
        ));
        self.figures(14..=15);
        self.page.table(&tables::matched(self.f));
        self.page.table(&tables::readings(self.f));
        self.claim("linear-misses-10-V");
        self.claim("table2-fits-5-V");
        self.page.prose(format!(
            "There are two readings. Either the measured 5 V response was that of Table 2, and Table 4 misses it by \
             {}. Or it was that of Table 4, and Table 2 was matched at 10 V, where the two differ by {}. \
             The measured curves would decide.",
            percent(1.0 / (1.0 + m.final_position[0]) - 1.0),
            percent(m.final_position[1])
        ));
    }

    fn friction_models(&mut self) {
        let f = self.f;
        self.figures(16..=17);
        self.figure("friction-laws");
        self.claim("stribeck-minor");
        self.claim("viscous-at-rest");
        self.page.subsection("The equations that run");
        self.page.prose("The gains are read from the solver's own equations, with the values of Table 4.");
        self.page.drawing(
            &diagrams::drive_pulley(&f.sets.table4.machine),
            html! { b { "Figure 18. " } "Equation (16), the drive pulley." },
        );
        self.page.drawing(
            &diagrams::whole(&f.sets.table4.machine),
            html! { b { "Figure 19. " } "The whole: motor, drive pulley, cart and idler pulley, equations \
            (4) and (16)–(18)." },
        );
        self.page.subsection("Both voltages with Table 4");
        self.figures(20..=21);
        self.claim("table4-fits-both");
    }

    fn table3(&mut self) {
        let f = self.f;
        self.page.prose(format!(
            "Table 3 sets friction equal to the computed torque while the speed is within ±0.01 and the \
             torque within the Coulomb value. \
             The acceleration is then zero and the speed stays what it is. The exact solution comes to rest at {} and {}. Creep is the \
             motion of r φ₁ between 0.5 s and 1 s; turns are the changes of its direction after 0.35 s.",
            mm(f.runs.table4[0].final_position()),
            mm(f.runs.table4[1].final_position())
        ));
        self.page.table(&tables::table3(f));
        self.figure("table-3");
        self.claim("table3-holds");
        self.claim("p6-table3-limit");
    }

    fn misprints(&mut self) {
        for m in &MISPRINTS {
            self.page.subsection(&format!("{}. {}", m.number, m.title));
            self.page.prose(m.text);
            let ids: Vec<&str> = self.claims.iter().map(|c| c.id).filter(|id| id.starts_with(m.prefix)).collect();
            ids.into_iter().for_each(|id| self.claim(id));
            if m.number == "P7" {
                self.page.table(&tables::sharing(self.f));
                self.page.prose(format!(
                    "The last two columns are what remains when the totals are adjusted, by at most {}, so \
                     that both final positions agree.",
                    share(
                        self.f
                            .identifiability
                            .sharing
                            .iter()
                            .flat_map(|s| s.adjustment)
                            .fold(0.0, |a: f64, b| a.max(b.abs()))
                    )
                ));
            }
        }
    }

    fn all_claims(&mut self) {
        self.page.prose(html! {
            "The verdict follows from the numbers by the rules beside them: a claim is confirmed if all \
             hold, confirmed with a remark if only \
             those marked “further” fail, and not confirmed otherwise. The same is in " code { "claims.json" } "."
        });
        self.page.markup(html! { span id="every-number" {} });
        let mut table = Table::new("").column("Claim and number", "").column("Value", "").column("Rule", "");
        for claim in self.claims {
            for (i, check) in claim.checks.iter().enumerate() {
                let holds = check.rule.holds(check.value);
                let kind = match (holds, check.decides) {
                    (true, _) => Callout::Holds,
                    (false, true) => Callout::Fails,
                    (false, false) => Callout::Partly,
                };
                let what = if check.decides { check.what.clone() } else { format!("further: {}", check.what) };
                table.row([
                    Cell::Markup(html! { @if i == 0 { b { code { (claim.id) } } br; } (symbols(&what)) }),
                    Cell::Number(value(check)),
                    Cell::Markup(html! { (kind.badge(if holds { "holds" } else { "fails" })) " " (rule(check)) }),
                ]);
            }
        }
        self.page.table(&table);
    }

    fn method(&mut self) {
        let f = self.f;
        let golden = self.claims.iter().filter(|c| c.kind == ClaimSource::Reference);
        let (right, all) =
            golden.fold((0, 0), |(right, all), c| (right + usize::from(c.verdict() == Verdict::Confirmed), all + 1));
        self.page.prose(format!(
            "Friction makes the equations linear piece by piece: each body slides forward, slides backward \
             or is stuck. Within a piece the motion is \
             a matrix exponential, and the pieces end where a speed reaches zero or a load reaches breakaway. There is no step size. {right} of {all} numbers \
             of independent solutions are met to their printed digits, among them the final position of Table 1 by the matrix exponential of \
             equations (1)–(4), {}, and by the closed form r K_t/R · V T/B_tot, {}.",
            mm(f.linear.by_exponential),
            mm(f.linear.closed_form)
        ));
        self.page.prose(
            "Words were given numbers before the runs: “by far” is five times, “minor” and “marginal” less \
             than a tenth, “not appreciable” \
             less than a hundredth, “the same” less than a thousandth.",
        );
        self.page.prose(html! {
            "Beside this file: each figure as SVG and PNG in " code { "figures" } ", its curves as CSV in " code { "data" } ", and the claims in "
            code { "claims.json" } "."
        });
        for (title, case) in
            [("table1.toml", &f.sets.table1), ("table2.toml", &f.sets.table2), ("table4.toml", &f.sets.table4)]
        {
            self.page.embed(title, &case.text);
        }
    }
}

fn kind_of(verdict: Verdict) -> (Callout, &'static str) {
    match verdict {
        Verdict::Confirmed => (Callout::Holds, "holds"),
        Verdict::WithRemark => (Callout::Partly, "partly"),
        Verdict::NotConfirmed => (Callout::Fails, "fails"),
        Verdict::CannotBeChecked => (Callout::Note, "note-kind"),
    }
}

fn badge(verdict: Verdict) -> Markup {
    kind_of(verdict).0.badge(verdict.word())
}

/// A claim with its numbers, in the page's form of a callout.
fn callout(claim: &Claim) -> Markup {
    let verdict = claim.verdict();
    html! {
        div class={ "callout " (kind_of(verdict).1) } id=(claim.id) {
            p.head { (badge(verdict)) (symbols(claim.statement)) }
            p.note { (claim.source) }
            @for check in &claim.checks {
                p { b { (value(check)) } " " (symbols(&check.what)) span.note { " – " (rule(check)) } }
            }
            @if !claim.remark.is_empty() { p { (symbols(&claim.remark)) } }
        }
    }
}
