//! The metrics of runs, against definitions written a second time on whole trajectories.

mod common;

use common::random::{self, Dry};
use common::{experiment, table1, table4};
use proptest::prelude::*;
use taut::friction::{Along, Friction, Law, Shape};
use taut::metrics::{Balance, Meter, Metrics, Peak, balanced_speed, largest};
use taut::signal::{Signal, Slot};
use taut::solve::{Method, Solution, Solver, simulate};
use taut::stage::{AmplifierMode, Stage};
use taut::trajectory::Trajectory;

/// The metrics of a whole run, fed in blocks of so many rows.
fn measure(stage: &Stage, solution: &Solution, rows: usize) -> Metrics {
    let mut meter = Meter::new(stage);
    for from in (0..solution.trajectory.len()).step_by(rows) {
        let mut block = solution.trajectory.clone();
        for column in &mut block.columns {
            column.values = column.values[from..column.values.len().min(from + rows)].to_vec();
        }
        meter.take(&block);
    }
    meter.finish(&solution.outcome.events)
}

fn run(stage: &Stage, input: Signal, until: f64) -> (Solution, Metrics) {
    let solution = simulate(stage, &experiment(input, until), Solver::Exact).unwrap();
    let metrics = measure(stage, &solution, 256);
    (solution, metrics)
}

/// Rows as structures: the second way to look at them.
struct Row {
    time: f64,
    input: f64,
    drive: f64,
    cart: f64,
    idler: f64,
    speed: f64,
    current: f64,
    stuck: bool,
}

fn rows(stage: &Stage, trajectory: &Trajectory) -> Vec<Row> {
    let get = |name: &str, row: usize| trajectory.get(name).unwrap()[row];
    let input = if trajectory.get("input").is_some() { "input" } else { "voltage" };
    (0..trajectory.len())
        .map(|k| Row {
            time: get("time", k),
            input: get(input, k),
            drive: stage.pulley_radius * get("drive_angle", k),
            cart: get("cart_position", k),
            idler: stage.pulley_radius * get("idler_angle", k),
            speed: get("cart_speed", k),
            current: get("motor_current", k),
            stuck: ["drive_state", "cart_state", "idler_state"].iter().all(|state| get(state, k) == 0.0),
        })
        .collect()
}

/// The first row of largest magnitude, by sorting.
fn peak(rows: &[Row], value: impl Fn(&Row) -> f64) -> Peak {
    let mut all: Vec<(usize, f64)> = rows.iter().map(&value).enumerate().collect();
    all.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
    match all[0] {
        (_, 0.0) => Peak::default(),
        (row, value) => Peak { value, time: rows[row].time },
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn metrics_are_what_their_definitions_say(stage in random::stage(Dry::Any), input in random::input(), block in 1usize..400) {
        let solution = simulate(&stage, &experiment(input, 0.4), Solver::Exact).unwrap();
        let metrics = measure(&stage, &solution, block);
        let rows = rows(&stage, &solution.trajectory);
        let last = rows.last().unwrap();
        prop_assert_eq!(metrics.rows, 401);
        prop_assert_eq!(metrics.end, 0.4);
        prop_assert_eq!((metrics.final_cart_position, metrics.final_drive_travel), (last.cart, last.drive));
        prop_assert_eq!(metrics.peak_cart_speed, peak(&rows, |r| r.speed));
        prop_assert_eq!(metrics.peak_current, peak(&rows, |r| r.current));
        prop_assert_eq!(metrics.peak_stretch[0], peak(&rows, |r| r.drive - r.cart));
        prop_assert_eq!(metrics.peak_stretch[1], peak(&rows, |r| r.cart - r.idler));
        prop_assert_eq!(metrics.peak_stretch[2], peak(&rows, |r| r.idler - r.drive));
        prop_assert_eq!(metrics.peak_encoder_error, peak(&rows, |r| r.drive - r.cart));
        prop_assert_eq!(metrics.settled, last.stuck);

        // Once all are stuck to the end, no event follows; the moment before, one moved.
        let events = &solution.outcome.events;
        let moving = rows.iter().rposition(|r| !r.stuck).map_or(0.0, |row| rows[row].time);
        match metrics.stop_time {
            Some(stop) => prop_assert!(last.stuck && stop >= moving && events.iter().all(|e| e.time <= stop)),
            None => prop_assert!(!last.stuck),
        }
        let counted: u64 = metrics.events.iter().map(|count| count.total()).sum();
        prop_assert_eq!(counted, events.len() as u64);

        // The last run of equal inputs, found by walking backwards.
        let mut end = rows.len();
        let steady = loop {
            if end == 0 {
                break None;
            }
            let value = rows[end - 1].input;
            let begin = rows[..end].iter().rposition(|r| r.input != value).map_or(0, |row| row + 1);
            if value != 0.0 && end - begin >= 20 {
                break Some(&rows[begin..end]);
            }
            end = begin;
        };
        prop_assert_eq!(metrics.steady_speed.is_some(), steady.is_some());
        if let (Some(found), Some(stretch)) = (metrics.steady_speed, steady) {
            let (first, last) = (&stretch[0], &stretch[stretch.len() - 1]);
            let from = last.time - 0.1 * (last.time - first.time);
            let late = || stretch.iter().filter(|r| r.time >= from).map(|r| r.speed);
            let change = late().fold(f64::MIN, f64::max) - late().fold(f64::MAX, f64::min);
            prop_assert_eq!((found.value, found.change, found.input), (last.speed, change, last.input));
            prop_assert_eq!(found.reached, change <= 0.01 * last.speed.abs());
            prop_assert_eq!(found.stretch, (first.time, last.time));
        }
    }

    /// Under a constant input every machine without a breakaway to hold it ends at the speed of the balance.
    #[test]
    fn a_long_step_ends_at_the_balance_of_forces(stage in random::stage(Dry::Any), input in prop_oneof![3.0..12.0f64, -12.0..-3.0f64]) {
        let long = simulate(&stage, &experiment(Signal::Step { value: input, at: 0.0 }, 5.0), Solver::Exact).unwrap();
        let metrics = measure(&stage, &long, 256);
        let steady = metrics.steady_speed.unwrap();
        if let Balance::At(analytic) = steady.analytic
            && steady.reached
            && steady.change < 1e-9 * steady.value.abs()
            && steady.value != 0.0
        {
            prop_assert!((steady.value - analytic).abs() <= 1e-6 * analytic.abs(), "{steady:?}");
        }
    }
}

#[test]
fn the_five_volt_pulse_of_the_paper() {
    let stage = table4();
    let (_, metrics) = run(&stage, Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    assert!((metrics.final_drive_travel - 0.053744890394).abs() < 1e-9);
    assert!((metrics.final_cart_position - 0.053746653033).abs() < 1e-9);
    let (stops, starts) = metrics.events.iter().fold((0, 0), |(a, b), e| (a + e.stops, b + e.starts));
    assert_eq!((stops, starts, metrics.settled), (6, 6, true));
    assert!(metrics.stop_time.is_some_and(|stop| stop > 0.25 && stop < 0.5));
    let steady = metrics.steady_speed.unwrap();
    // The rise takes 26 ms: after ten times that nothing changes any more.
    assert!(steady.reached && steady.stretch == (0.0, 0.249), "{steady:?}");
    assert!((steady.value / steady.analytic.speed().unwrap() - 1.0).abs() < 1e-3, "{steady:?}");
    assert_eq!(metrics.peak_encoder_error, metrics.peak_stretch[0]);
}

#[test]
fn the_balance_by_hand() {
    // Table 4 at 5 V: τ = K_t u / R − T = 0.161972 − 0.03388 N m over 2 B + b r² + K_t K_e / R = 0.011112 N m s.
    let stage = table4();
    let total = 2.0 * 0.0016 + 19.0424 * 0.0194 * 0.0194 + 0.023 * 0.023 / 0.71;
    let speed = 0.0194 * (0.023 * 5.0 / 0.71 - 2.0 * 0.015 - 0.0194 * 0.2) / total;
    assert!((balanced_speed(&stage, 5.0, 0.0).speed().unwrap() - speed).abs() < 1e-12);
    assert!((balanced_speed(&stage, -5.0, 0.0).speed().unwrap() + speed).abs() < 1e-12);
    assert_eq!(balanced_speed(&stage, 1.0, 0.0), Balance::At(0.0));
    assert_eq!(balanced_speed(&stage, 0.0, 0.0), Balance::At(0.0));

    let mut stage = table1();
    stage.amplifier.mode = AmplifierMode::Current;
    stage.drive_pulley.friction = Friction::default();
    stage.idler_pulley.friction = Friction::default();
    let speed = 0.0194 * 0.023 * 2.0 / (40.6518 * 0.0194 * 0.0194);
    assert!((balanced_speed(&stage, 2.0, 0.0).speed().unwrap() - speed).abs() < 1e-12);
    stage.cart.friction = Friction::default();
    assert_eq!(balanced_speed(&stage, 2.0, 0.0), Balance::Never);
}

/// Once the balance left out what a friction law adds to b v + F_c, and what changes along the travel.
#[test]
fn a_friction_curve_counts_in_the_balance() {
    let of = |law| {
        let mut stage = table4();
        let r = stage.pulley_radius;
        stage.cart.friction = Friction::with_breakaway(19.0424, 0.2, 1.2).following(law);
        let pulley = Friction::with_breakaway(0.0016, 0.015, 0.02);
        (stage.drive_pulley.friction, stage.idler_pulley.friction) = (pulley, pulley);
        stage.drive_pulley.friction.law = match law {
            Law::Smooth { breakaway_velocity: v } => Law::Smooth { breakaway_velocity: v / r },
            _ => Law::Coulomb,
        };
        stage
    };
    let laws = [
        Law::Stribeck { velocity: 0.1, shape: Shape::Gaussian },
        Law::Stribeck { velocity: 0.1, shape: Shape::Exponential },
        Law::Smooth { breakaway_velocity: 0.05 },
        Law::LuGre { stiffness: 1e4, damping: 60.0, velocity: 0.1 },
    ];
    for law in laws {
        for volts in [4.0, -4.0] {
            let stage = of(law);
            let step = experiment(Signal::Step { value: volts, at: 0.0 }, 2.0);
            let long = simulate(&stage, &step, Solver::GENERAL).unwrap();
            let steady = measure(&stage, &long, 256).steady_speed.unwrap();
            let balance = steady.analytic.speed().unwrap();
            assert!((steady.value - balance).abs() < 1e-9, "{law:?}: {steady:?}");
            // The curve is worth more than half a millimetre per second there.
            let without = balanced_speed(&of(Law::Coulomb), volts, 0.0).speed().unwrap();
            assert!((balance - without).abs() > 5e-4, "{law:?}: {balance} and {without}");
        }
    }
}

#[test]
fn where_a_curve_has_several_balances_the_one_nearby_counts() {
    let mut stage = table4();
    stage.cart.friction =
        Friction::with_breakaway(5.0, 0.2, 1.2).following(Law::Stribeck { velocity: 0.01, shape: Shape::Gaussian });
    // 1.5 V: too little to set out, enough to keep sliding.
    let (slow, fast) = (balanced_speed(&stage, 1.5, 0.0), balanced_speed(&stage, 1.5, 0.2));
    assert_eq!(slow, Balance::At(0.0));
    // All forces by hand at the speed found: the curve is over there.
    let v = fast.speed().unwrap();
    let (drive, load) =
        (0.023 * (1.5 - 0.023 * v / 0.0194) / 0.71, 0.03 + 0.0032 * v / 0.0194 + 0.0194 * (0.2 + 5.0 * v));
    assert!(v > 0.04 && (drive - load).abs() < 1e-9, "{v}: {drive} and {load}");

    stage.cart.along = Along::new(vec![[0.0, 1.0], [0.1, 2.0]]);
    assert_eq!(balanced_speed(&stage, 1.5, 0.0), Balance::Changing);
}

#[test]
fn a_short_pulse_does_not_become_steady_and_a_triangle_has_no_constant_stretch() {
    let (_, short) = run(&table4(), Signal::Pulse { value: 5.0, duration: 0.03, at: 0.0 }, 0.5);
    let steady = short.steady_speed.unwrap();
    assert!(!steady.reached && steady.value < 0.8 * steady.analytic.speed().unwrap(), "{steady:?}");
    let (_, triangle) = run(&table4(), Signal::Triangle { amplitude: 5.0, frequency: 2.0 }, 1.0);
    assert_eq!(triangle.steady_speed, None);
}

#[test]
fn the_last_stretch_counts_and_its_sign() {
    let turn = |value, lasts| Slot { signal: Signal::Step { value, at: 0.0 }, lasts };
    let input = Signal::sequence(vec![turn(5.0, 0.5), turn(0.0, 0.5), turn(-5.0, 0.5), turn(0.0, f64::INFINITY)]);
    let (_, metrics) = run(&table4(), input, 2.0);
    let steady = metrics.steady_speed.unwrap();
    assert!(steady.reached && steady.value < 0.0 && steady.input == -5.0);
    assert_eq!(steady.stretch, (1.0, 1.499));
}

#[test]
fn what_never_moves_has_stopped_at_once_and_what_has_no_dry_friction_never_stops() {
    // 0.4 V is 13 mN m, below the 15 mN m of the drive pulley.
    let (_, held) = run(&table4(), Signal::Step { value: 0.4, at: 0.0 }, 0.5);
    assert_eq!((held.stop_time, held.settled), (Some(0.0), true));
    let steady = held.steady_speed.unwrap();
    assert_eq!((steady.value, steady.reached, steady.analytic), (0.0, true, Balance::At(0.0)));
    let (_, free) = run(&table1(), Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    assert_eq!((free.stop_time, free.settled), (None, false));
}

/// Table 3 freezes speeds instead of stopping: its run must not claim a stop.
#[test]
fn table3_does_not_stop() {
    let stage = table4();
    let pulse = experiment(Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    let solver = Solver::Table3 { step: 1e-4, method: Method::RungeKutta4 };
    let metrics = measure(&stage, &simulate(&stage, &pulse, solver).unwrap(), 256);
    assert_eq!(metrics.stop_time, None);
}

/// Whatever the length of a run, the last tenth is found to a five-hundredth of the stretch.
#[test]
fn long_stretches_are_remembered_in_parts() {
    let stage = table4();
    let mut long = experiment(Signal::Step { value: 5.0, at: 0.0 }, 0.1);
    long.every = 1e-6;
    let fine = measure(&stage, &simulate(&stage, &long, Solver::Exact).unwrap(), 1000).steady_speed.unwrap();
    long.every = 1e-4;
    let coarse = measure(&stage, &simulate(&stage, &long, Solver::Exact).unwrap(), 1000).steady_speed.unwrap();
    assert!((fine.change / coarse.change - 1.0).abs() < 0.03, "{fine:?} {coarse:?}");
}

#[test]
fn the_largest_of_three_spans() {
    let peak = |value| Peak { value, time: 1.0 };
    assert_eq!(largest(&[peak(1.0), peak(-3.0), peak(2.0)]), (2, peak(-3.0)));
    assert_eq!(largest(&[peak(1.0), peak(-1.0), peak(1.0)]), (1, peak(1.0)));
}
