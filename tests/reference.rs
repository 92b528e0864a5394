//! Against the high-precision reference trajectories: positions within 1e-9 m and 1e-9 rad, speeds within
//! 1e-7 m/s and 1e-5 rad/s, event times within 1e-9 s, the same modes in the same order.

use crate::common;
use taut::machine::Machine;
use taut::signal::Signal;
use taut::solve::{Ending, Solver, simulate};

fn rows(text: &str) -> Vec<Vec<f64>> {
    text.lines().skip(1).map(|line| line.split(',').map(|f| f.parse().unwrap()).collect()).collect()
}

fn compare(case: &str, machine: Machine, input: Signal) {
    let Some(folder) = common::data::reference() else { return };
    let read = |name: String| rows(&std::fs::read_to_string(folder.join(name)).unwrap());
    let want = read(format!("{case}.csv"));
    let events = read(format!("{case}.events.csv"));
    let experiment = common::experiment(input, want.last().unwrap()[0]);
    let got = simulate(&machine, &experiment, Solver::Exact).unwrap();
    assert_eq!(got.outcome.ending, Ending::Complete);
    assert_eq!(got.trajectory.len(), want.len());

    let columns = [
        ("time", 0, 1e-15),
        ("voltage", 1, 1e-12),
        ("drive_angle", 2, 1e-9),
        ("drive_speed", 3, 1e-5),
        ("cart_position", 4, 1e-9),
        ("cart_speed", 5, 1e-7),
        ("idler_angle", 6, 1e-9),
        ("idler_speed", 7, 1e-5),
        ("drive_state", 8, 0.0),
        ("cart_state", 9, 0.0),
        ("idler_state", 10, 0.0),
    ];
    for (name, column, tolerance) in columns {
        let values = got.trajectory.get(name).unwrap();
        let worst = values.iter().zip(&want).map(|(a, row)| (a - row[column]).abs()).fold(0.0, f64::max);
        println!("{case}: {name} differs by at most {worst:.2e}");
        assert!(worst <= tolerance, "{case}: {name} differs by {worst:e}");
    }
    let modes = |e: &taut::solve::Event| (e.body().unwrap() + 1, e.from.code(), e.to.code());
    let got_modes: Vec<_> = got.outcome.events.iter().map(modes).collect();
    let want_modes: Vec<_> = events.iter().map(|e| (e[1] as usize, e[2] as i8, e[3] as i8)).collect();
    assert_eq!(got_modes, want_modes, "{case}");
    for (got, want) in got.outcome.events.iter().zip(&events) {
        assert!((got.time - want[0]).abs() < 1e-9, "{case}: {got:?} against {want:?}");
        assert!((got.load - want[4]).abs() < 1e-6, "{case}: {got:?} against {want:?}");
    }
    println!("{case}: {:?}", got.outcome.cost);
}

fn pulse(value: f64) -> Signal {
    Signal::Pulse { value, duration: 0.25, at: 0.0 }
}

#[test]
fn linear_table_1_at_5_volts() {
    compare("lin_t1_5V", common::table1(), pulse(5.0));
}

#[test]
fn linear_table_1_at_10_volts() {
    compare("lin_t1_10V", common::table1(), pulse(10.0));
}

#[test]
fn linear_table_2_at_5_volts() {
    compare("lin_t2_5V", common::table2(), pulse(5.0));
}

#[test]
fn stick_slip_at_5_volts() {
    compare("nl_t2_5V", common::table4(), pulse(5.0));
}

#[test]
fn stick_slip_at_10_volts() {
    compare("nl_t2_10V", common::table4(), pulse(10.0));
}

#[test]
fn three_break_aways_on_a_ramp() {
    compare("ramp_t2", common::table4(), Signal::Ramp { value: 1.2, over: 1.0, at: 0.0 });
}

#[test]
fn nothing_moves_below_breakaway() {
    let below = 0.98 * 0.015 * 0.71 / 0.023;
    compare("brk_motor_below_t2", common::table4(), pulse(below));
}

/// An output interval, and an edge, anywhere: the events of the paper's machine stay where they are, to 1e-12 s.
#[test]
fn events_do_not_depend_on_the_output_interval() {
    for (volts, duration) in [(5.0, 0.25), (10.0, 0.25), (7.3, 0.123_456_789)] {
        let input = Signal::Pulse { value: volts, duration, at: 0.0 };
        let events = |every: f64| {
            let experiment = taut::case::Experiment { every, ..common::experiment(input.clone(), 0.5) };
            simulate(&common::table4(), &experiment, Solver::Exact).unwrap().outcome.events
        };
        let fine = events(1e-4);
        for every in [1e-3, 0.0123, 0.1, 0.5] {
            let coarse = events(every);
            let same: Vec<_> = fine.iter().filter(|e| e.time < (0.5 / every + 1e-9).floor() * every).collect();
            assert_eq!(coarse.len(), same.len(), "{volts} V, every {every} s");
            for (a, b) in coarse.iter().zip(same) {
                assert!(a.part == b.part && a.to == b.to, "{a:?} and {b:?}");
                assert!((a.time - b.time).abs() < 1e-12, "{a:?} and {b:?}");
            }
        }
    }
}
