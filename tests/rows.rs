//! The rows of a run: when they are, that the last is at the end, and that no zero has a sign.

use crate::common;
use common::{experiment, table4};
use taut::case::{Case, Experiment, TEMPLATE};
use taut::measure::measure;
use taut::signal::Signal;
use taut::solve::{Course, Detail, Ending, Flow, Method, Run, Solver, simulate, stream, stream_mechanism};
use taut::trajectory::Trajectory;

fn every(every: f64, until: f64) -> Experiment {
    Experiment { every, ..experiment(Signal::Pulse { value: 5.0, duration: 0.95, at: 0.0 }, until) }
}

fn column<'a>(trajectory: &'a Trajectory, name: &str) -> &'a [f64] {
    trajectory.get(name).unwrap()
}

/// A run of 1 s with a row every 0.3 s ended at 0.9 s without a word, here before the pulse was over.
#[test]
fn the_last_row_is_at_the_end_whatever_the_interval() {
    let machine = table4();
    let table3 = Solver::Table3 { step: 1e-4, method: Method::RungeKutta4 };
    for (solver, near) in [(Solver::Exact, 1e-11), (Solver::GENERAL, 1e-8), (table3, 1e-9)] {
        let (odd, even) = (every(0.3, 1.0), every(1e-2, 1.0));
        let (rows, fine) = (simulate(&machine, &odd, solver).unwrap(), simulate(&machine, &even, solver).unwrap());
        assert_eq!(rows.outcome.ending, Ending::Complete);
        assert_eq!(column(&rows.trajectory, "time"), [0.0, 0.3, 0.6, 0.9, 1.0], "{solver:?}");
        assert_eq!((odd.samples(), rows.outcome.cost.samples), (5, 5));
        for name in ["cart_position", "cart_speed", "drive_angle", "motor_current", "voltage"] {
            for (row, place) in [(1, 30), (3, 90), (4, 100)] {
                let (a, b) = (column(&rows.trajectory, name)[row], column(&fine.trajectory, name)[place]);
                assert!((a - b).abs() <= near * b.abs().max(1e-3), "{solver:?} {name} in row {row}: {a} and {b}");
            }
        }
        assert_eq!(rows.outcome.events.len(), fine.outcome.events.len());
    }
}

/// A run whose rows nobody wants passes as many.
#[test]
fn rows_that_are_not_kept_are_counted() {
    let mechanism = table4().mechanism();
    for solver in [Solver::Exact, Solver::GENERAL] {
        for (interval, until) in [(1e-3, 1.2), (0.3, 1.0)] {
            let Experiment { inputs, initial, every, until, .. } = every(interval, until);
            let course = Course { inputs, start: initial, until, every };
            let samples = [Detail::None, Detail::Full].map(|detail| {
                let sink = &mut |_: &taut::trajectory::Trajectory| Flow::Continue;
                stream_mechanism(&mechanism, &course, solver, (detail, None), sink).unwrap().cost.samples
            });
            assert_eq!(samples[0], samples[1], "{solver:?}, {interval} s");
        }
    }
}

/// A recorder's clock makes no shorter beat: the log ends with the last whole one.
#[test]
fn a_log_keeps_to_whole_beats() {
    let changes = ["experiment.0.every=0.3 s", "experiment.0.until=1 s"];
    let case = Case::from_text_with("axis.toml", TEMPLATE, &changes).unwrap();
    for jitter in [0.0, 1e-3] {
        let measurement = taut::machine::Measurement { jitter, ..case.measurement.clone().unwrap_or_default() };
        let log = measure(&case.machine, &measurement, &case.experiments[0], Solver::Exact).unwrap().trajectory;
        assert_eq!(column(&log, "time"), [0.0, 0.3, 0.6, 0.9]);
        assert!(column(&log, "drive_angle").iter().all(|angle| angle.is_finite()));
    }
}

/// Times were k·until/n: 0.0029999999999999996 s in a log of 0.3 s at 1 ms, and 95 of 301 like it.
#[test]
fn times_read_as_they_were_written() {
    for (interval, until, digits) in [(1e-3, 0.301, 3), (2e-3, 0.3, 3), (0.3, 3.0, 1), (3.7e-4, 0.37, 5)] {
        let run = simulate(&table4(), &every(interval, until), Solver::Exact).unwrap();
        for time in column(&run.trajectory, "time") {
            let shown = time.to_string();
            let decimals = shown.split_once('.').map_or(0, |(_, decimals)| decimals.len());
            assert!(decimals <= digits, "{shown}");
        }
    }
    let thirds = simulate(&table4(), &every(1.0 / 3.0, 2.0), Solver::Exact).unwrap();
    let time = column(&thirds.trajectory, "time");
    assert_eq!((time.len(), time[3], time[6]), (7, 1.0, 2.0));
}

/// The first row of a sine had -1.03e-14 V, and files had -0.
#[test]
fn what_is_zero_is_written_as_zero() {
    let mut machine = table4();
    machine.encoder = Some(taut::machine::Encoder { at: taut::machine::EncoderPlace::DrivePulley, lines: 512.0 });
    for amplitude in [5.0, -5.0] {
        let sine = Signal::Sine { amplitude, frequency: 5.0, phase: 0.0, offset: 0.0 };
        for solver in [Solver::Exact, Solver::GENERAL] {
            let run = simulate(&machine, &experiment(sine.clone(), 0.5), solver).unwrap();
            let voltage = column(&run.trajectory, "voltage");
            for row in [0, 100, 200, 300, 400, 500] {
                assert_eq!(voltage[row], 0.0, "{solver:?} {row}");
            }
            for column in &run.trajectory.columns {
                let negative = column.values.iter().position(|v| *v == 0.0 && v.is_sign_negative());
                assert_eq!(negative, None, "{solver:?} {}", column.name);
            }
        }
    }
}

/// At rest a row is computed once and repeated: through the ends of blocks, and up to a row in the middle of one where
/// it goes on.
#[test]
fn rows_at_rest_are_those_that_are_asked_for_one_by_one() {
    let machine = table4();
    let pulse = |at: f64| Signal::Pulse { value: 5.0, duration: 0.0505, at };
    for at in [0.0, 0.1, 0.7003, 0.512] {
        let experiment = experiment(pulse(at), 1.9);
        let whole = simulate(&machine, &experiment, Solver::Exact).unwrap().trajectory;
        let mut single: Vec<Vec<f64>> = vec![Vec::new(); whole.columns.len()];
        let mut sink = |rows: &Trajectory| {
            single.iter_mut().zip(&rows.columns).for_each(|(all, rows)| all.extend(&rows.values));
            Flow::Continue
        };
        let mut run = Run::new(&machine, &experiment, Solver::Exact, Detail::Full, None, &mut sink).unwrap();
        for k in 0..1900 {
            // Row by row, and up to the edges of the pulse.
            let (begin, end) = (1e-3 * f64::from(k), 1e-3 * f64::from(k + 1));
            let edges = [at, at + 0.0505].into_iter().filter(|edge| (begin + 1e-9..end - 1e-9).contains(edge));
            for until in edges.chain([end]) {
                let middle = 0.5 * (run.time() + until);
                let volts = if (at..at + 0.0505).contains(&middle) { 5.0 } else { 0.0 };
                assert!(run.hold(&[volts], until));
            }
        }
        assert_eq!(run.finish().ending, Ending::Complete);
        for (whole, single) in whole.columns.iter().zip(&single) {
            assert_eq!(whole.values.len(), single.len(), "{}", whole.name);
            for (row, (a, b)) in whole.values.iter().zip(single).enumerate() {
                assert!(
                    (a - b).abs() <= 1e-9 * (1.0 + b.abs()),
                    "{} in row {row}, pulse at {at}: {a} and {b}",
                    whole.name
                );
            }
        }
    }
}

/// A receiver that wants no more is heard at the end of the block that it was handed, with nothing but rest behind and
/// before.
#[test]
fn a_receiver_that_wants_no_more_is_heard_at_rest() {
    let (machine, mut rows) = (table4(), 0);
    let mut sink = |block: &Trajectory| {
        rows += block.columns[0].values.len();
        if rows >= 512 { Flow::Stop } else { Flow::Continue }
    };
    let still = experiment(Signal::Pulse { value: 5.0, duration: 0.1, at: 5.0 }, 6.0);
    let outcome = stream(&machine, &still, Solver::Exact, &mut sink).unwrap();
    assert_eq!(rows, 512);
    assert!(
        matches!(outcome.ending, Ending::Interrupted { time } if (time - 0.511).abs() < 1e-12),
        "{:?}",
        outcome.ending
    );
    assert_eq!(outcome.cost.samples, 512);
}

/// A run of which no row is due is ended by whoever takes its rows all the same: it is shown that there is none yet.
#[test]
fn a_run_between_two_rows_is_ended_by_its_receiver() {
    let machine = table4();
    let signal = Signal::Square { amplitude: 5.0, frequency: 10.0, duty: 0.5 };
    let long = Experiment { every: 1e4, ..experiment(signal, 1e4) };
    for solver in [Solver::Exact, Solver::GENERAL] {
        let mut shown = 0;
        let outcome = stream(&machine, &long, solver, &mut |rows| {
            assert!(rows.get("time").is_none_or(|times| times.len() <= 1));
            shown += 1;
            if shown == 3 { Flow::Stop } else { Flow::Continue }
        })
        .unwrap();
        let Ending::Interrupted { time } = outcome.ending else { panic!("{solver:?}: {:?}", outcome.ending) };
        assert!(time < 5e3, "{solver:?}: {time}");
    }
}
