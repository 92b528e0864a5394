//! Statements of a tuning about its gains: hunting, what varies, why it is worse, what to do next.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;
use std::path::Path;
use taut::case::{Case, Cost, TEMPLATE, Template, Tuning, gantry_template};
use taut::control::feedback::Feedback;
use taut::control::{Loop, Standard, close};
use taut::friction::Motion;
use taut::linear::Operation;
use taut::machine::MachineKind;
use taut::machine::axis::CART;
use taut::signal::profile::{Leg, Limits, Profile};
use taut::solve::{Event, Solver};
use taut::tune::{Family, Judgement, Margins, Plant, SPREAD, evaluate, hunting, look, tune};

fn case(name: &str) -> Case {
    Case::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/loops").join(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// An axis whose integral needs a minute and more from one breakaway to the other was said to rest: it slips by ±450
/// µm.
#[test]
fn an_axis_that_slips_after_a_minute_hunts() {
    let case = case("hunts-slowly.toml");
    let hunt = hunting(&case.machine, case.controller.as_ref().unwrap()).unwrap().expect("it hunts");
    println!("{hunt:?}");
    assert!(hunt.amplitude > 2e-4 && hunt.amplitude < 2e-3, "{hunt:?}");
    assert!(hunt.slips_every > 1.0 && hunt.slips_every < 200.0, "{hunt:?}");
    assert!(hunt.needs.contains(&"integral action") && hunt.needs.contains(&"dry friction"), "{hunt:?}");
    // Without the integral nothing moves it.
    let still = case.text.replace("integral = \"3000 V/(m s)\", ", "");
    let still = Case::from_text("still.toml", &still).unwrap();
    assert_eq!(hunting(&still.machine, still.controller.as_ref().unwrap()).unwrap(), None);
}

/// Times at which the cart breaks away at rest, s after the end of a move to `target` (m), in a run of this length (s):
/// from the events of the run. A burst of slips less than 50 ms apart is one.
fn slips(case: &Case, target: f64, watched: f64) -> Vec<f64> {
    let limits = Limits { speed: 20e-3, acceleration: 0.5, jerk: None, snap: None };
    let profile = Profile::new(0.0, &[Leg::To(target, limits)]).unwrap();
    let (design, from) = (case.controller.as_ref().unwrap(), profile.end());
    let mut controller = Standard::new(design, &case.machine).unwrap();
    let (timing, solver) = (Loop::new(design), Solver::for_machine(&case.machine));
    let run = close(&case.machine, &mut [&mut controller], &timing, &[profile], from + watched, 1e-4, solver).unwrap();
    let breakaway = |event: &&Event| event.body() == Some(CART) && event.from.code() == Motion::Stuck.code();
    let mut times: Vec<f64> = run.outcome.events.iter().filter(breakaway).map(|event| event.time - from).collect();
    times.retain(|time| *time > 0.0);
    times.dedup_by(|next, last| *next - *last < 50e-3);
    times
}

/// Sticky axes with an integral, drawn, every third without a breakaway above Coulomb friction: one that slips again
/// and again in long runs from three starts is not said to rest, one that slips in none is not said to slip, and where
/// the runs agree, so does the time between slips. `TAUT_CASES` sets how many.
#[test]
fn hunting_is_that_of_long_runs() {
    let file = case("hunts-slowly.toml").text;
    let cases = std::env::var("TAUT_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(3);
    let mut random = Pcg64::new(28, 12);
    let mut draw = |low: f64, high: f64| low * (high / low).powf(random.next_u64() as f64 / 2f64.powi(64));
    let (mut hunted, mut rested) = (0, 0);
    for k in 0..cases {
        let [above, integral, lines] = [draw(4.02, 8.0), draw(2e3, 4e4), draw(300.0, 4e3).round()];
        let breakaway = if k % 3 == 2 { 4.0 } else { above };
        let text = file
            .replace("static = \"6.5 N\"", &format!("static = {breakaway:?}"))
            .replace("3000 V/(m s)", &format!("{integral:?} V/(m s)"))
            .replace("lines = 1000", &format!("lines = {lines:?}"));
        let case = Case::from_text("drawn.toml", &text).unwrap();
        let hunt = hunting(&case.machine, case.controller.as_ref().unwrap()).unwrap();
        let watched = 60.0;
        let runs = [4.2e-3, 5.03e-3, 7.77e-3].map(|target| slips(&case, target, watched));
        let late = runs.each_ref().map(|run| run.iter().filter(|time| **time > 0.2 * watched).count());
        println!("{k}: breakaway {breakaway:.3} N, {integral:.0} V/(m s), {lines} lines: {late:?}, {hunt:?}");
        match late {
            [0, 0, 0] => {
                let slips = hunt.as_ref().is_some_and(|hunt| hunt.slips_every < 0.2 * watched);
                assert!(!slips, "{k}: {hunt:?}");
                rested += 1;
            }
            _ if late.iter().all(|slips| *slips > 4) => {
                let hunt = hunt.unwrap_or_else(|| panic!("{k}: rests, and slips {late:?} times"));
                let every = hunt.slips_every.min(0.5 * hunt.period);
                let [few, many] = [late.iter().min(), late.iter().max()].map(|count| *count.unwrap() as f64);
                if many < 1.1 * few && !hunt.irregular {
                    let seen = 0.8 * watched / many;
                    assert!((every / seen - 1.0).abs() < 0.15, "{k}: {every} s, {seen} s in long runs");
                }
                hunted += 1;
            }
            _ => (),
        }
    }
    println!("{hunted} hunt, {rested} rest, of {cases}");
}

/// Gains were worse on seven axes, "forced by" nothing; the limit that those of the file break was not named.
#[test]
fn what_is_worse_has_its_reason() {
    let case = case("no-active-limit.toml");
    for (sensitivity, effort) in [(1.8, 0.1), (1.5, 0.1), (1.3, 0.1)] {
        let tuned = tune(&case, &Tuning { sensitivity, effort, ..case.tune.clone().unwrap() }, &|| false).unwrap();
        println!("{:?} {:?}", tuned.judgement, tuned.forced);
        assert_eq!(tuned.judgement == Judgement::Worse, tuned.forced.is_some());
    }
}

/// After a fit of two parameters all others were taken for exact: Ms 1.77 was promised where the spread gives 2.11.
#[test]
fn what_was_never_fitted_keeps_its_spread() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/sollmann-jouaneh/controllers");
    let plain = Case::read(folder.join("pid-elastic.toml")).unwrap();
    let mass = plain.machine.cart.mass;
    let text =
        format!("{}\n[uncertainty]\n\"cart.mass\" = {{ low = {}, high = {} }}\n", plain.text, 0.99 * mass, 1.01 * mass);
    let fitted = Case::from_text(folder.join("fitted.toml"), &text).unwrap();
    let [all, some] = [&plain, &fitted].map(|case| Family::new(case, &Tuning::default()).unwrap());
    assert_eq!(some.unknowns.len(), all.unknowns.len(), "{:?}", some.unknowns);
    for unknown in &some.unknowns {
        let share = (unknown.high - unknown.low) / (unknown.high + unknown.low);
        let expected = if unknown.name == "cart.mass" { 0.01 } else { SPREAD };
        assert!((share - expected).abs() < 1e-9 && unknown.is_fitted == (expected == 0.01), "{unknown:?}");
    }
    let stiffness = some.machines.iter().map(|corner| some.stage_at(corner).belt.stiffness[0]);
    let (low, high) = stiffness.fold((f64::INFINITY, 0.0_f64), |(low, high), k| (low.min(k), high.max(k)));
    assert!(high / low > 1.3, "{low} {high}");
    // So the promise is nearly that of the spread.
    let worst = [&plain, &fitted].map(|case| evaluate(case, &Tuning::default()).unwrap().before.unstable.0);
    assert!(worst[1] > 0 && worst[0] > 0, "{worst:?}");
}

/// The suggested gains led to "worse" on the stage that `taut init` writes, and were refused where currents are
/// commanded: now they are in the unit of the case, and their loop has margins.
#[test]
fn suggested_gains_run() {
    for mode in ["voltage", "current"] {
        let base = TEMPLATE.replace("mode = \"voltage\"", &format!("mode = \"{mode}\""));
        let base = if mode == "current" { base.replace("5 V\"", "5 A\"") } else { base };
        let missing = Case::from_text("axis.toml", &format!("{base}\n[controller]\nevery = \"1 ms\"\n")).unwrap_err();
        let told = missing.to_string();
        let hint = told.split("add for example ").nth(1).unwrap_or_else(|| panic!("{told}")).trim();
        let unit = if mode == "current" { "A/mm" } else { "V/mm" };
        assert!(hint.starts_with("pid = { proportional") && hint.contains(unit), "{told}");
        let text = format!("{base}\n[controller]\nevery = \"1 ms\"\n{hint}\n");
        let case = Case::from_text("axis.toml", &text).unwrap_or_else(|error| panic!("{error}\n{hint}"));
        let tuning = Tuning { cost: Some(Cost::Disturbance), ..Tuning::default() };
        let judged = evaluate(&case, &tuning).unwrap();
        let nominal = judged.before.nominal;
        assert!(nominal.stable && nominal.sensitivity <= 1.5 && nominal.complementary <= 1.5, "{hint}: {nominal:?}");
    }
}

/// The suggestion is of rules, not of a search: its loop has margins on other axes and at other sample times too.
#[test]
fn suggested_gains_have_margins_on_drawn_axes() {
    let mut random = Pcg64::new(11, 7);
    let mut factor = |most: f64| most.powf(2.0 * taut::chance::uniform(&mut random) - 1.0);
    for k in 0..40 {
        let template = Case::from_text("axis.toml", TEMPLATE).unwrap().machine;
        let stiffness = template.belt.stiffness.map(|stiffness| stiffness * factor(4.0));
        let (mass, every) = (template.cart.mass * factor(6.0), 1e-3 * factor(3.0));
        let mode = if k % 2 == 0 { "voltage" } else { "current" };
        let unit = if k % 2 == 0 { "V" } else { "A" };
        let base = TEMPLATE
            .replace("mode = \"voltage\"", &format!("mode = \"{mode}\""))
            .replace("5 V\"", &format!("5 {unit}\""));
        let sets = [
            format!("cart.mass={mass}"),
            format!("belt.stiffness=[{}, {}, {}]", stiffness[0], stiffness[1], stiffness[2]),
            format!("motor.resistance={}", template.drives[0].motor.resistance * factor(3.0)),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let head = format!("{base}\n[controller]\nevery = {every}\n");
        let told = Case::from_text_with("axis.toml", &head, &sets).unwrap_err().to_string();
        let hint = told.split("add for example ").nth(1).unwrap_or_else(|| panic!("{told}")).trim();
        let case = Case::from_text_with("axis.toml", &format!("{head}{hint}\n"), &sets).unwrap();
        let design = case.controller.as_ref().unwrap();
        let plant = Plant::new(&case.machine, Operation::default(), design, &[]).unwrap();
        let margins = Margins::new(&plant, &Feedback::new(design, &case.machine).unwrap());
        assert!(margins.excess(1.7, 1.7) <= 1.0, "{hint}, every {every}: {margins:?}\n{sets:?}");
    }
}

/// The text with the suggested controller in place of its own; its moves are left out, or kept.
fn suggested(text: &str, keeps_moves: bool) -> Case {
    let [controller, moves] = ["[controller]", "[[move]]"].map(|table| text.find(table).unwrap_or(text.len()));
    let base = &text[..controller];
    let hint = Case::from_text("machine.toml", base).unwrap().suggested_controller().replacen(" and ", "\n", 1);
    let moves = if keeps_moves { &text[moves..] } else { "" };
    Case::from_text("machine.toml", &format!("{base}\n[controller]\n{hint}\n\n{moves}")).unwrap()
}

/// A cart that stuck at its start during a reversal was within its window at the end, and cost no more than one that
/// settles last.
#[test]
fn a_reversal_that_is_not_made_costs_its_largest_error() {
    let case = suggested(Template::Stage.text(), true);
    let motion = &case.moves[1];
    let seen = look(&case.machine, &case.machine, case.controller.as_ref().unwrap(), motion).unwrap();
    assert!(seen.settling.is_none() && (seen.error - 20e-3).abs() < 1e-3, "{seen:?}");
    let whole = (motion.until - motion.end()) * (1.0 + (seen.error / motion.window).ln_1p());
    assert!((seen.settles / whole - 1.0).abs() < 1e-9, "{seen:?}: {whole}");
}

/// On the `stage` template the suggested gains ended "unchanged" with errors of 66 mm: with them the cart stuck at its
/// start during a slow reversal, was where it should be at the end, and slipped once an hour, so that gains with a
/// fraction of the error were taken to settle later (standard moves) and to hunt more (the template's moves). On the
/// axis, of which one move settled, a swing within its window was more than a slip every quarter of an hour.
#[test]
fn suggested_gains_lead_to_better_ones() {
    let stage = Template::Stage.text();
    for (name, text, keeps_moves) in [("stage", stage, false), ("stage", stage, true), ("axis", TEMPLATE, false)] {
        let case = suggested(text, keeps_moves);
        let tuned = tune(&case, &Tuning { spread: Some(0.0), effort: 0.1, ..Tuning::default() }, &|| false).unwrap();
        assert!(name == "axis" || tuned.before.moves.iter().all(|one| one.at_worst.settled == 0), "{name}");
        assert!(tuned.judgement == Judgement::Better && tuned.holds, "{name}: {:?}", tuned.after.worst);
        for (was, is) in tuned.before.moves.iter().zip(&tuned.after.moves) {
            assert!(is.at_worst.error.0 < 0.2 * was.at_worst.error.0, "{name}, {}: {was:?} {is:?}", is.name);
            println!("{name}, {}: {:?} after {:?}", is.name, is.at_worst, was.at_worst);
        }
        println!("{:?} after {:?}", tuned.after.hunt, tuned.before.hunt);
    }
}

/// The two motors of a bridge with their pulleys held swing against each other on the belts: that was taken for the
/// slowest swing, and gains of a thousandth and less of those of other gantries were suggested.
#[test]
fn suggested_gains_of_two_motors_on_a_bridge_move_it() {
    for kind in [MachineKind::HFrame, MachineKind::CoreXy, MachineKind::DualBelt] {
        let case = suggested(&gantry_template(kind), false);
        let design = case.controller.as_ref().unwrap();
        let feedback = Feedback::new(design, &case.machine).unwrap();
        let plant = Plant::new(&case.machine, Operation::default(), design, &feedback.corners()).unwrap();
        let margins = Margins::new(&plant, &feedback);
        // rad/s: above 0.3 Hz
        assert!(margins.stable && margins.sensitivity <= 1.5, "{kind:?}: {design:?}: {margins:?}");
        assert!(margins.crossover > 2.0, "{kind:?}: {design:?}: {margins:?}");
    }
}
