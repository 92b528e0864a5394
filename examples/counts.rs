//! Nine standard works, each done once to warm up and once to be measured: `cargo xtask counts` has valgrind count the
//! instructions of the second time, which no load of the machine changes.
//!
//! `cargo run --release --package taut --example counts [-- CALLS [WORK]]` times them instead, the best of so many
//! calls in µs, or of one of them alone; `-- 1` is what is counted.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;
use std::time::Instant;
use taut::case::{Case, Experiment, TEMPLATE};
use taut::control::{Controller, Loop, Observation, close};
use taut::machine::axis::{CART, DRIVE};
use taut::machine::{GearPlay, Machine};
use taut::mechanism::{Mechanism, Shown};
use taut::signal::profile::{Leg, Limits, Profile};
use taut::signal::{Hold, Signal};
use taut::solve::{Bench, Course, Detail, Differentiated, Flow, Simulator, Solver, stream, stream_mechanism};
use taut::sweep::Sweep;

/// A work: its name, and what does it; the number depends on what came out.
type Work = (&'static str, Box<dyn Fn() -> f64>);

fn main() -> taut::Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let calls: u32 = words.first().and_then(|calls| calls.parse().ok()).unwrap_or(200);
    for (name, work) in works()?.iter().filter(|(name, _)| words.get(1).is_none_or(|word| word == name)) {
        black_box(work());
        let timed = (0..calls).map(|_| {
            let begin = Instant::now();
            measured_work(work.as_ref());
            begin.elapsed().as_secs_f64()
        });
        println!("{name} {:.1}", 1e6 * timed.fold(f64::INFINITY, f64::min));
    }
    Ok(())
}

/// The work that valgrind counts: it finds the function by its name.
#[unsafe(no_mangle)]
#[inline(never)]
fn measured_work(work: &dyn Fn() -> f64) {
    black_box(work());
}

fn works() -> taut::Result<Vec<Work>> {
    let pulse = common::experiment(Signal::Pulse { value: 5.0, duration: 0.25, at: 0.0 }, 1.0);
    let held = common::experiment(sampled(), 1.0);
    Ok(vec![
        ("run", run(common::table4(), pulse.clone(), Solver::Exact)),
        ("sweep", sweep()?),
        ("closed-loop", closed()?),
        ("stribeck", run(common::with_stribeck(common::table4()), pulse.clone(), Solver::GENERAL)),
        ("geared", run(geared(), pulse.clone(), Solver::Exact)),
        ("h-frame", h_frame()?),
        ("stepping", stepping()?),
        ("edges", run(common::table4(), held, Solver::Exact)),
        ("derivatives", derivatives(pulse)),
    ])
}

/// The derivatives of two columns of the first work's run by ten numbers of the machine: what a step of a fit computes.
fn derivatives(experiment: Experiment) -> Box<dyn Fn() -> f64> {
    let machine = common::table4();
    let variables = common::ten_variables(&machine, &experiment);
    let outputs = [Shown::Position(DRIVE, 1.0), Shown::Position(CART, 1.0)].map(Differentiated::Shown);
    Box::new(move || {
        let mut bench = Bench::default();
        bench.mount(&machine).expect("the machine is sound");
        let slopes = bench.sensitivities(&experiment, &variables, &outputs).expect("the machine is sound");
        slopes.expect("the machine is linear between events").columns[0][0][1000]
    })
}

/// One second, 1001 rows, every column.
fn run(stage: Machine, experiment: Experiment, solver: Solver) -> Box<dyn Fn() -> f64> {
    Box::new(move || {
        let outcome = stream(&stage, &experiment, solver, &mut |block| {
            black_box(block);
            Flow::Continue
        });
        outcome.expect("the machine is sound").events.len() as f64
    })
}

/// The Table 4 machine with an inductance, limits of voltage and current, and a gear that loses, gives way and has
/// play.
fn geared() -> Machine {
    let mut stage = common::table4();
    stage.drives[0].motor.inductance = 0.3e-3;
    stage.drives[0].motor.rotor_inertia = 1e-6;
    stage.drives[0].motor.gear_ratio = 2.0;
    stage.drives[0].motor.gear_efficiency = 0.9;
    stage.drives[0].motor.gear_play = Some(GearPlay { backlash: 2e-3, stiffness: 200.0, damping: 0.01 });
    stage.drives[0].amplifier.voltage_limit = Some(4.0);
    stage.drives[0].amplifier.current_limit = Some(3.0);
    stage
}

/// Sixteen machines of a sweep, no rows: the kernel of `taut sweep`.
fn sweep() -> taut::Result<Box<dyn Fn() -> f64>> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/stages/sollmann-jouaneh/table4.toml");
    let case = Case::read_with(file, &["sweep.runs=16", "sweep.design=sobol", "sweep.vary.all=20 %"])?;
    let sweep = Sweep::new(&case)?;
    Ok(Box::new(move || sweep.rows(0, 16, &|| false).expect("nobody stops it").len() as f64))
}

/// A proportional controller along a move, one second at 1 kHz, with all figures of the move: what a search for gains
/// calls.
fn closed() -> taut::Result<Box<dyn Fn() -> f64>> {
    let stage = Case::from_text("axis.toml", TEMPLATE)?.machine;
    let profile = profile()?;
    let timing = Loop { every: 1e-3, delay: 0.0, limit: Some(LIMIT), lead: 0.0 };
    Ok(Box::new(move || {
        let run =
            close(&stage, &mut [&mut Proportional], &timing, std::slice::from_ref(&profile), 1.0, 50e-6, Solver::Exact);
        run.expect("the loop is sound").figures.cart().error.last
    }))
}

/// Of both loops: gain, V/m, and limit, V.
const GAIN: f64 = 3000.0;
const LIMIT: f64 = 12.0;

struct Proportional;

impl Controller for Proportional {
    fn step(&mut self, seen: &Observation) -> f64 {
        GAIN * (seen.reference.position - seen.position)
    }

    fn reset(&mut self) {}
}

fn profile() -> taut::Result<Profile> {
    let limits = Limits { speed: 0.2, acceleration: 2.0, jerk: None, snap: None };
    Profile::new(0.0, &[Leg::To(0.05, limits)])
}

/// The cart along y, one second, 1001 rows.
fn h_frame() -> taut::Result<Box<dyn Fn() -> f64>> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/stages/h-frame/h-frame.toml");
    let case = Case::read_with(file, &[])?;
    let mechanism: Mechanism = case.machine.mechanism();
    let course = Course::new(&mechanism, &case.experiments[2]);
    Ok(Box::new(move || {
        let outcome = stream_mechanism(&mechanism, &course, Solver::Exact, (Detail::Full, None), &mut |block| {
            black_box(block);
            Flow::Continue
        });
        outcome.expect("the machine is sound").events.len() as f64
    }))
}

/// The same loop without figures, stepped from outside every millisecond.
fn stepping() -> taut::Result<Box<dyn Fn() -> f64>> {
    let stage = Case::from_text("axis.toml", TEMPLATE)?.machine;
    let start = Simulator::new(&stage, Solver::Exact)?;
    let profile = profile()?;
    Ok(Box::new(move || {
        let (mut machine, mut events) = (start.clone(), Vec::new());
        for k in 0..1000 {
            let error =
                profile.at(f64::from(k) * 1e-3).position - stage.pulley_radius * machine.state().position[DRIVE];
            let held = Signal::Step { value: (GAIN * error).clamp(-LIMIT, LIMIT), at: 0.0 };
            machine.set_input(0, &held.piece(machine.time())).expect("an input");
            machine.advance(f64::from(k + 1) * 1e-3, &mut events).expect("nothing ends it early");
        }
        machine.state().position[DRIVE]
    }))
}

/// A recorded input of 10 kHz, held.
fn sampled() -> Signal {
    let times: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 1e-4 + 3e-5).collect();
    let values = times.iter().map(|t| 4.0 * (20.0 * t).sin() + 2.0 * (313.0 * t).sin()).collect();
    Signal::Sampled { times, values, hold: Hold::Zero }
}
