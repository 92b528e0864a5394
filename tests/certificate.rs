//! Certificates of robustness beside drawn machines and dense grids.

use crate::breaks::{Draw, STRUCTURES};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use taut::case::{Case, Tuning};
use taut::control::feedback::Feedback;
use taut::design::Design;
use taut::tune::{Certificate, Corner, Family, Margins};

/// Limits of the random loops relative to the peaks of their nominal machines.
const ABOVE: f64 = 1.15;

/// Random machines within each certified box.
const INSIDE: usize = 60;

fn family(case: &Case, spread: f64) -> (Family, Design) {
    let tuning = Tuning { spread: Some(spread), ..Tuning::default() };
    (Family::new(case, &tuning).unwrap(), case.controller.clone().unwrap())
}

fn certificate(family: &Family, design: &Design, limits: [f64; 2]) -> Certificate {
    Certificate::new(family, design, limits, &|| false).unwrap()
}

fn margins(family: &Family, design: &Design, corner: &Corner) -> Margins {
    let feedback = Feedback::new(design, &family.machine).unwrap();
    Margins::new(&family.plant(corner, design, &feedback.corners()).unwrap(), &feedback)
}

/// A machine of the family's box times `factor`; each unknown at an end with a probability of one half.
fn inside(family: &Family, factor: f64, draw: &mut Draw) -> Corner {
    let mut corner = family.nominal();
    for off in &mut corner.off {
        *off = factor * if draw.share() < 0.5 { 2.0 * draw.share() - 1.0 } else { (2.0 * draw.share() - 1.0).signum() };
    }
    // The two motor constants, and both pulleys, vary together.
    let led: Vec<usize> = leaders(family);
    let offs: Vec<f64> = led.iter().map(|&leader| corner.off[leader]).collect();
    corner.off = offs;
    if let [first, .., last] = family.places[..] {
        corner.place = first + draw.share() * (last - first);
    }
    corner
}

/// For each unknown the first that it varies with, found by the family's own ends.
fn leaders(family: &Family) -> Vec<usize> {
    let mut led: Vec<usize> = (0..family.unknowns.len()).collect();
    for end in family.ends() {
        let moved: Vec<usize> = (0..end.off.len()).filter(|&k| end.off[k] != 0.0).collect();
        moved.iter().for_each(|&k| led[k] = moved[0]);
    }
    led
}

/// Random loops of every structure without a current loop: no machine within a certified box exceeds a limit, and the
/// machine that is named as a violation does.
#[test]
fn certified_boxes_hold_no_violation() {
    let (mut certified, mut violated, mut whole, mut factors) = (0, 0, 0, Vec::new());
    for (number, structure) in STRUCTURES.iter().enumerate().filter(|(_, (name, _))| !name.contains("current")) {
        let mut draw = Draw(Pcg64::seed_from_u64(100 + number as u64));
        let mut done = false;
        while !done {
            let case = draw.case(*structure);
            let (family, design) = family(&case, if number % 2 == 0 { 0.02 } else { 0.1 });
            let nominal = margins(&family, &design, &family.nominal());
            if !nominal.stable || nominal.sensitivity > 6.0 {
                continue;
            }
            done = true;
            let limits = [ABOVE * nominal.sensitivity, ABOVE * nominal.complementary.max(1.0)];
            let found = certificate(&family, &design, limits);
            assert_eq!(found.factor == 0.0, found.reason.is_some(), "{structure:?}: {found:?}");
            if let Some(violation) = &found.violation {
                violated += 1;
                let worst = margins(&family, &design, &violation.corner);
                assert!(worst.excess(limits[0], limits[1]) > 1.0, "{structure:?}: {worst:?}");
                assert!(found.factor < violation.factor, "{structure:?}: {found:?}");
                let most = violation.corner.off.iter().fold(0.0_f64, |most, off| most.max(off.abs()));
                assert!(most <= violation.factor * (1.0 + 1e-12));
                factors.push((found.factor / violation.factor, structure.0));
            }
            if found.factor == 0.0 {
                continue;
            }
            certified += 1;
            whole += usize::from(found.factor == 1.0);
            for _ in 0..INSIDE {
                let corner = inside(&family, found.factor, &mut draw);
                let own = margins(&family, &design, &corner);
                let limits = found.bounds.unwrap_or(limits);
                assert!(own.excess(limits[0], limits[1]) <= 1.0 + 1e-9, "{structure:?}: {found:?}, {own:?}");
            }
        }
    }
    println!("{certified} certified, {whole} of them wholly; {violated} violated; parts {factors:?}");
    assert!(certified >= 6 && violated >= 1, "{certified} {violated}");
}

/// The template with a PID controller.
fn template(text: &str) -> Case {
    let controller = "[controller]\nevery = \"1 ms\"\ndelay = \"0.5 ms\"\nlimit = \"24 V\"\n";
    let case = Case::from_text("axis.toml", taut::case::TEMPLATE).unwrap();
    let text = format!("{}\n{controller}{text}\n", case.text);
    Case::from_text("axis.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

const PID: &str = "pid = { proportional = 700, integral = 2000, derivative = 10, filter = 200 }";

/// With one parameter, the largest factor is that of a dense grid.
#[test]
fn one_parameter_is_certified_up_to_the_first_violation() {
    let text = template(PID).text.replace("[belt]", "[belt]\ndamping = [30, 30, 30]");
    let case = Case::from_text("axis.toml", &text).unwrap();
    let mut compared = 0;
    for unknown in 0..family(&case, 0.5).0.unknowns.len() {
        let (mut family, design) = family(&case, 0.5);
        if leaders(&family)[unknown] != unknown || family.unknowns.iter().any(|other| other.name.contains(" = ")) {
            continue;
        }
        // The others keep their values.
        for (number, other) in family.unknowns.iter_mut().enumerate() {
            if leaders_of(&case)[number] != unknown {
                (other.low, other.high) = (1.0, 1.0);
            }
        }
        family.places = vec![family.nominal().place];
        family.machines.clear();
        let nominal = margins(&family, &design, &family.nominal());
        assert!(nominal.stable);
        let limits = [1.02 * nominal.sensitivity, 1.02 * nominal.complementary.max(1.0)];
        let at = |off: f64| {
            let mut corner = family.nominal();
            corner.off.iter_mut().for_each(|own| *own = off);
            margins(&family, &design, &corner).excess(limits[0], limits[1]) > 1.0
        };
        let steps = 500;
        let step = |k: i32| f64::from(k) / f64::from(steps);
        let first = (1..=steps).find(|&k| at(step(k)) || at(-step(k))).map(step);
        // The search for a violation begins at the ends of the box.
        if first.is_some() && !at(1.0) && !at(-1.0) {
            continue;
        }
        let found = certificate(&family, &design, limits);
        match (first, &found.violation) {
            (Some(first), Some(violation)) => {
                compared += 1;
                assert!(found.factor <= first && first - step(1) <= violation.factor, "{first}: {found:?}");
                assert!(found.factor >= 0.9 * (first - step(1)), "{first}: {found:?}");
            }
            (None, None) => assert!(found.factor >= 0.9, "{found:?}"),
            _ => panic!("{first:?}: {found:?}"),
        }
    }
    assert!(compared >= 1, "{compared}");
}

fn leaders_of(case: &Case) -> Vec<usize> {
    leaders(&family(case, 0.5).0)
}

#[test]
fn a_loop_that_is_not_stable_has_no_certificate() {
    let case = template("pid = { proportional = 60000, integral = 2000, derivative = 1, filter = 200 }");
    let (family, design) = family(&case, 0.2);
    let found = certificate(&family, &design, [1.8, 1.8]);
    assert_eq!((found.factor, found.bounds), (0.0, None));
    assert_eq!(found.reason.as_deref(), Some("the loop is not stable for the machine of the file"));
    assert!(!found.violation.unwrap().margins.stable);
}

#[test]
fn without_a_spread_the_bound_is_that_of_the_machine_itself() {
    let case = template(PID);
    let (mut family, design) = family(&case, 0.0);
    family.places = vec![family.nominal().place];
    let nominal = margins(&family, &design, &family.nominal());
    let limits = [1.5 * nominal.sensitivity, 1.5 * nominal.complementary.max(1.0)];
    let found = certificate(&family, &design, limits);
    assert_eq!((found.factor, &found.violation), (1.0, &None));
    let [sensitivity, complementary] = found.bounds.unwrap();
    // An eighth of the distance to the limit is the resolution of the bounds.
    for (bound, exact, limit) in
        [(sensitivity, nominal.sensitivity, limits[0]), (complementary, nominal.complementary, limits[1])]
    {
        assert!(bound >= exact && bound <= exact + (limit - exact) / 8.0 + 1e-9, "{found:?} {nominal:?}");
    }
}

#[test]
fn what_is_not_covered_is_named() {
    let gantry = Case::read("stages/core-xy/square.toml").unwrap();
    let (several, design) = family(&gantry, 0.1);
    let found = certificate(&several, &design, [1.8, 1.8]);
    assert_eq!(found.reason.as_deref(), Some("several drives are not covered"));
    let mut draw = Draw(Pcg64::seed_from_u64(3));
    let current = STRUCTURES.iter().find(|(name, _)| *name == "cascade current").unwrap();
    let (own, design) = loop {
        let (own, design) = family(&draw.case(*current), 0.0);
        let nominal = margins(&own, &design, &own.nominal());
        if nominal.stable && nominal.excess(50.0, 50.0) < 1.0 {
            break (own, design);
        }
    };
    let found = certificate(&own, &design, [50.0, 50.0]);
    assert_eq!(found.reason.as_deref(), Some("a controller that uses the measured current is not covered"));
}
