//! Co-simulation is as exact as the solver, whatever the steps are.

use crate::unit::{OK, Random, Three, Unit, machine};
use std::ffi::c_void;
use taut::case::Case;
use taut::signal::Signal;
use taut::solve::{self, Course, Detail, Flow, Solver};
use taut::trajectory::Trajectory;
use taut_fmu::{fmi2, fmi3};

/// Positions may differ by so much, m: the issue of exactness is rounding alone.
const SAME: f64 = 1e-12;

/// The pulse of the paper's Table 4: 10 V until 0.25 s, and where the cart is at each millisecond.
fn expected() -> Vec<[f64; 2]> {
    let case = Case::read(machine("sollmann-jouaneh/table4.toml")).unwrap();
    let solution = solve::simulate(&case.machine, &case.experiments[1], Solver::Exact).unwrap();
    let column = |name| solution.trajectory.get(name).unwrap();
    column("time").iter().zip(column("cart_position")).map(|(time, x)| [*time, *x]).collect()
}

/// Ends of steps from 0 to 1 s, 0.25 s and every `whole` ms among them, others in between.
fn ends(random: &mut Random) -> Vec<f64> {
    let mut ends: Vec<f64> = (0..random.below(40)).map(|_| 1e-9 + random.share() * 0.999).collect();
    ends.extend((1..=20).map(|k| f64::from(k * 50) * 1e-3));
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    ends
}

/// Goes along these ends, now and then some of them back; the largest difference at whole milliseconds.
fn worst(instance: &Three, ends: &[f64], random: &mut Random, expected: &[[f64; 2]]) -> f64 {
    let (mut time, mut worst, mut k): (f64, f64, usize) = (0.0, 0.0, 0);
    let mut kept: Option<(*mut c_void, f64, usize)> = None;
    assert_eq!(instance.set("command", 10.0), OK);
    while k < ends.len() {
        match random.below(8) {
            0 if kept.is_none() => kept = Some((instance.keep(), time, k)),
            1 => {
                if let Some((mut state, then, place)) = kept.take() {
                    instance.bring_back(state);
                    (time, k) = (then, place);
                    assert_eq!(unsafe { fmi3::fmi3FreeFMUState(instance.pointer, &mut state) }, OK);
                    assert!(state.is_null());
                }
            }
            _ => {}
        }
        let end = ends[k];
        if time >= 0.25 {
            assert_eq!(instance.set("command", 0.0), OK);
        }
        while time < end {
            let step = instance.step(time, end - time);
            if step.event != 0 {
                // As an importer that handles events does.
                let mut flags = [0u8; 5];
                let [a, b, c, d, e] = &mut flags;
                let mut next = 0.0;
                unsafe {
                    assert_eq!(fmi3::fmi3EnterEventMode(instance.pointer), OK);
                    assert_eq!(fmi3::fmi3UpdateDiscreteStates(instance.pointer, a, b, c, d, e, &mut next), OK);
                    assert_eq!(fmi3::fmi3EnterStepMode(instance.pointer), OK);
                }
                assert!(step.last > time || step.early == 0, "{step:?}");
            }
            assert!(step.early != 0 || step.last == time + (end - time), "{step:?}");
            time = step.last;
        }
        time = end;
        if let Some([_, x]) = expected.iter().find(|[t, _]| *t == end) {
            worst = worst.max((instance.get("cart_position") - x).abs());
        }
        k += 1;
    }
    worst
}

#[test]
fn a_hundred_random_sequences_of_steps_end_where_the_solver_does() {
    let (unit, expected) = (Unit::new("sollmann-jouaneh/table4.toml", false), expected());
    let mut random = Random(17);
    let mut most: f64 = 0.0;
    for sequence in 0..100 {
        // Event mode, with and without early return, and neither.
        let (events, early) = [(false, false), (true, true), (true, false)][sequence % 3];
        let instance = unit.three(events, early);
        instance.start();
        if events {
            assert_eq!(unsafe { fmi3::fmi3EnterStepMode(instance.pointer) }, OK);
        }
        let ends = ends(&mut random);
        most = most.max(worst(&instance, &ends, &mut random, &expected));
    }
    println!("largest difference of the cart: {most:e} m");
    assert!(most <= SAME, "{most:e}");
}

#[test]
fn events_end_steps_only_where_the_importer_asked_for_both() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    for (events, early, stops) in
        [(false, false, false), (false, true, false), (true, false, false), (true, true, true)]
    {
        let instance = unit.three(events, early);
        instance.start();
        if events {
            assert_eq!(unsafe { fmi3::fmi3EnterStepMode(instance.pointer) }, OK);
        }
        assert_eq!(instance.set("command", 5.0), OK);
        // All three bodies break away at once, and stop at some later time.
        let first = instance.step(0.0, 0.25);
        assert_eq!(first.early != 0, stops && first.last < 0.25, "{first:?}");
        assert_eq!(first.event != 0, stops, "{first:?}");
        if !stops {
            assert_eq!(first.last, 0.25);
        }
    }
}

#[test]
fn ramps_of_inputs_are_exact_and_not_stairs() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let case = Case::from_text(
        "ramp.toml",
        &std::fs::read_to_string(machine("sollmann-jouaneh/table4.toml")).unwrap().replacen(
            "{ pulse = \"5 V\", for = \"0.25 s\" }",
            "{ ramp = \"12 V\", over = \"1 s\" }",
            1,
        ),
    )
    .unwrap();
    let solution = solve::simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap();
    let wanted = *solution.trajectory.get("cart_position").unwrap().last().unwrap();
    let (one, command, order, slope) = (unit.two(1, &unit.token()), unit.reference("command"), 1, 12.0);
    let (mut x, at) = (0.0, unit.reference("cart_position"));
    unsafe {
        assert_eq!(fmi2::fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0), OK);
        assert_eq!(fmi2::fmi2EnterInitializationMode(one), OK);
        assert_eq!(fmi2::fmi2ExitInitializationMode(one), OK);
        for k in 0..4 {
            let (time, value) = (0.25 * f64::from(k), 3.0 * f64::from(k));
            assert_eq!(fmi2::fmi2SetReal(one, &command, 1, &value), OK);
            assert_eq!(fmi2::fmi2SetRealInputDerivatives(one, &command, 1, &order, &slope), OK);
            assert_eq!(fmi2::fmi2DoStep(one, time, 0.25, 0), OK);
        }
        assert_eq!(fmi2::fmi2GetReal(one, &at, 1, &mut x), OK);
        fmi2::fmi2FreeInstance(one);
    }
    assert!((x - wanted).abs() <= SAME, "{x} {wanted}");
}

#[test]
fn a_state_as_bytes_goes_on_bit_for_bit_in_another_instance() {
    for (case, input) in [
        ("sollmann-jouaneh/table4.toml", "command"),
        ("core-xy/core-xy.toml", "left_command"),
        ("dual-belt/dual-belt.toml", "cart_command"),
        ("emps/emps.toml", "command"),
    ] {
        let unit = Unit::new(case, false);
        let (one, two) = (unit.three(false, false), unit.three(false, false));
        one.start();
        two.start();
        assert_eq!(one.set(input, 4.0), OK);
        one.step(0.0, 0.0731);
        let mut state = one.keep();
        let (mut size, mut bytes) = (0, Vec::new());
        unsafe {
            assert_eq!(fmi3::fmi3SerializedFMUStateSize(one.pointer, state, &mut size), OK);
            bytes.resize(size, 0);
            assert_eq!(fmi3::fmi3SerializeFMUState(one.pointer, state, bytes.as_mut_ptr(), size), OK);
            let mut other = std::ptr::null_mut();
            assert_eq!(fmi3::fmi3DeserializeFMUState(two.pointer, bytes.as_ptr(), size, &mut other), OK);
            two.bring_back(other);
            assert_eq!(fmi3::fmi3FreeFMUState(one.pointer, &mut state), OK);
        }
        for instance in [&one, &two] {
            assert_eq!(instance.set(input, -3.0), OK);
            instance.step(0.0731, 0.3);
        }
        for variable in &unit.model.variables {
            if variable.kind == taut::export::fmu::FmiType::Real && variable.name.ends_with("position") {
                assert_eq!(one.get(&variable.name), two.get(&variable.name), "{case}: {}", variable.name);
            }
        }
        // Bytes that are cut off, or of another machine, are refused.
        let mut other = std::ptr::null_mut();
        for wrong in [&bytes[..size - 8], &bytes[..size - 3], &bytes[8..], &[]] {
            let status = unsafe { fmi3::fmi3DeserializeFMUState(two.pointer, wrong.as_ptr(), wrong.len(), &mut other) };
            assert_eq!(status, crate::unit::ERROR);
        }
    }
}

/// A state was refused as bytes where a controller was inside: its memory was no plain numbers.
#[test]
fn a_state_as_bytes_takes_the_controller_along() {
    let axes = ["pid", "cascade-current", "lqi", "lqg", "fuzzy-pi", "sliding", "pid-observer", "pid-shaped"]
        .map(|case| (format!("sollmann-jouaneh/controllers/{case}.toml"), "", ["reference", "command", "error"]));
    // Commands of several motors under way.
    let late = "controller={ every = \"1 ms\", delay = \"2.4 ms\", limit = \"24 V\", pid = { proportional = 3000, integral = \
                20000, derivative = 40 }, feed_forward = { model = \"elastic\", compensate_stretch = true } }";
    let gantries = ["h-frame", "core-xy", "dual-belt"].map(|kind| (format!("{kind}/square.toml"), late));
    let gantries = gantries.map(|(case, late)| (case, late, ["cart_reference", "right_command", "cart_error"]));
    for (case, change, [reference, command, error]) in axes.into_iter().chain(gantries) {
        let changes = [change];
        let unit = Unit::with(&case, if change.is_empty() { &[] } else { &changes }, true);
        let (one, two) = (unit.three(false, false), unit.three(false, false));
        one.start();
        two.start();
        assert_eq!(one.set(reference, 0.01), OK);
        // Between two samples, and with commands under way.
        one.step(0.0, 0.00373);
        let state = one.keep();
        let (mut size, mut bytes, mut other) = (0, Vec::new(), std::ptr::null_mut());
        unsafe {
            assert_eq!(fmi3::fmi3SerializedFMUStateSize(one.pointer, state, &mut size), OK);
            bytes.resize(size, 0);
            assert_eq!(fmi3::fmi3SerializeFMUState(one.pointer, state, bytes.as_mut_ptr(), size), OK);
            assert_eq!(fmi3::fmi3DeserializeFMUState(two.pointer, bytes.as_ptr(), size, &mut other), OK);
        }
        two.bring_back(other);
        for instance in [&one, &two] {
            assert_eq!(instance.set(reference, 0.012), OK);
            instance.step(0.00373, 0.05);
        }
        let [a, b] = [&one, &two].map(|instance| ["cart_position", command, error].map(|name| instance.get(name)));
        assert_eq!(a, b, "{case}");
        assert!(a[0] > 1e-3, "{case}: the cart has moved, to {} m", a[0]);
        // With a number of the controller's missing it is none.
        let status = unsafe { fmi3::fmi3DeserializeFMUState(two.pointer, bytes.as_ptr(), size - 8, &mut other) };
        assert_eq!(status, crate::unit::ERROR);
    }
}

#[test]
fn four_threads_do_not_disturb_each_other() {
    let expected = expected();
    let cases = ["sollmann-jouaneh/table4.toml", "core-xy/core-xy.toml"];
    std::thread::scope(|scope| {
        for thread in 0..4u64 {
            let expected = &expected;
            scope.spawn(move || {
                // Two kinds of machines at once.
                let unit = Unit::new(cases[thread as usize % 2], false);
                let mut random = Random(thread);
                for _ in 0..5 {
                    let instance = unit.three(false, false);
                    instance.start();
                    if thread % 2 == 0 {
                        let ends = ends(&mut random);
                        assert!(worst(&instance, &ends, &mut random, expected) <= SAME);
                    } else {
                        assert_eq!(instance.set("right_command", 6.0), OK);
                        (0..20).for_each(|k| {
                            instance.step(0.01 * f64::from(k), 0.01);
                        });
                    }
                }
            });
        }
    });
}

#[test]
fn a_force_on_the_cart_does_what_a_load_does() {
    // Of an axis it is an input of the equations, of a gantry a number that is changed.
    for (case, force, load) in [
        ("sollmann-jouaneh/table4.toml", "cart_force", Some("cart.load=4 N")),
        ("core-xy/core-xy.toml", "cart_force", None),
    ] {
        let (pushed, loaded) = (Unit::new(case, false), Unit::with(case, load.as_slice(), false));
        let (one, two) = (pushed.three(false, false), loaded.three(false, false));
        one.start();
        two.start();
        assert_eq!(one.set(force, 4.0), OK);
        one.step(0.0, 0.2);
        two.step(0.0, 0.2);
        match load {
            Some(_) => {
                let (x, y) = (one.get("cart_position"), two.get("cart_position"));
                assert!(x > 1e-3 && (x - y).abs() < SAME, "{x} {y}");
            }
            None => {
                // M ẍ = F less friction: it moves, and stands still again without the force.
                assert!(one.get("cart_speed") > 1e-3 && two.get("cart_speed") == 0.0);
                assert_eq!(one.set(force, 0.0), OK);
                one.step(0.2, 5.0);
                assert!(one.get("cart_speed").abs() < 1e-6, "{}", one.get("cart_speed"));
            }
        }
    }
}

#[test]
fn a_load_picked_up_under_way_is_a_tunable_mass() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let heavy = Unit::with("sollmann-jouaneh/table4.toml", &["cart.mass=0.9 kg"], false);
    let (one, two, light) = (unit.three(false, false), heavy.three(false, false), unit.three(false, false));
    for instance in [&one, &two, &light] {
        instance.start();
        assert_eq!(instance.set("command", 8.0), OK);
    }
    // At rest yet: the same as if it had been so heavy from the beginning.
    assert_eq!(one.set("cart.mass", 0.9), OK);
    for instance in [&one, &two, &light] {
        instance.step(0.0, 0.2);
    }
    let [a, b, c] = [&one, &two, &light].map(|instance| instance.get("cart_position"));
    assert!((a - b).abs() < SAME && (a - c).abs() > 1e-3, "{a} {b} {c}");
    // A radius is geometry.
    assert_eq!(one.set("drive_pulley.radius", 0.02), crate::unit::ERROR);
}

#[test]
fn gantries_and_general_stages_end_where_their_solver_does() {
    // Exact but for rounding; and with the general solver, whose steps begin anew with ours, to its tolerance.
    for (name, tolerance) in [
        ("core-xy/core-xy.toml", SAME),
        ("h-frame/h-frame.toml", SAME),
        ("dual-belt/dual-belt.toml", SAME),
        ("core-xy/follows.toml", 1e-9),
    ] {
        let case = Case::read_with(machine(name), &[]).unwrap();
        let (mechanism, mut end) = (case.machine.mechanism(), Vec::new());
        let sides = case.machine.geometry().sides();
        let commands: Vec<(&str, f64)> = sides.zip([6.0, -2.0, 4.0]).collect();
        let inputs = commands.iter().map(|(_, value)| Signal::Step { value: *value, at: 0.0 }).collect();
        let course = Course { inputs, start: case.experiments[0].initial, until: 0.1, every: 0.01 };
        let mut keep = |block: &Trajectory| {
            end = block.columns.iter().map(|column| (column.name.clone(), *column.values.last().unwrap())).collect();
            Flow::Continue
        };
        let solver = Solver::of_mechanism(&mechanism);
        solve::stream_mechanism(&mechanism, &course, solver, (Detail::Full, None), &mut keep).unwrap();
        let unit = Unit::new(name, false);
        let instance = unit.three(false, false);
        instance.start();
        for (side, value) in commands {
            assert_eq!(instance.set(&format!("{side}_command"), value), OK);
        }
        let mut time = 0.0;
        for size in [0.0137, 0.0005, 0.0458] {
            time = instance.step(time, size).last;
        }
        instance.step(time, 0.1 - time);
        for (column, wanted) in end.iter().filter(|(name, _)| name.ends_with("_position")) {
            let is = instance.get(column);
            assert!(is.abs() > 1e-4 && (is - wanted).abs() <= tolerance, "{name}, {column}: {is} {wanted}");
        }
    }
}

/// Called within a step: keeps the times.
unsafe extern "C" fn keep_time(
    environment: *mut c_void,
    time: f64,
    set: bool,
    get: bool,
    done: bool,
    early: bool,
    request: *mut u8,
    when: *mut f64,
) {
    assert!(!set && get && done);
    let times = unsafe { &mut *environment.cast::<Vec<f64>>() };
    times.push(time);
    // The fifth time it wants back.
    if early && times.len() == 5 {
        unsafe {
            *request = 1;
            *when = time;
        }
    }
}

#[test]
fn the_callback_within_a_step_sees_events_and_may_end_it() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let mut times: Vec<f64> = Vec::new();
    let instance = unit.three_with(false, true, (&raw mut times).cast(), Some(keep_time));
    instance.start();
    assert_eq!(instance.set("command", 5.0), OK);
    let mut time = instance.step(0.0, 0.25).last;
    assert_eq!(instance.set("command", 0.0), OK);
    let mut returned = false;
    while time < 1.0 {
        let step = instance.step(time, 1.0 - time);
        returned |= step.early != 0;
        assert_eq!(step.event, 0, "event mode is not used");
        time = step.last;
    }
    assert!(returned && times.len() > 5 && times.is_sorted(), "{times:?}");
    assert_eq!(times.last(), Some(&1.0));
    let expected = expected_of_five();
    assert!((instance.get("cart_position") - expected).abs() < SAME);
}

fn expected_of_five() -> f64 {
    let case = Case::read(machine("sollmann-jouaneh/table4.toml")).unwrap();
    let solution = solve::simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap();
    *solution.trajectory.get("cart_position").unwrap().last().unwrap()
}
