//! A controller of one's own in closed loop, beside a PID: `cargo run --release --package taut --example controller`.

use std::time::Instant;
use taut::case::{Case, TEMPLATE};
use taut::control::{Controller, Loop, Observation, Setup, close, closed_loop};
use taut::design::{Design, Pid, Structure};
use taut::signal::profile::{Leg, Limits, Profile};
use taut::solve::Solver;

/// As much voltage as there is, towards the target; less within a millimetre.
struct Relay {
    volts: f64,
}

impl Controller for Relay {
    fn step(&mut self, seen: &Observation) -> f64 {
        self.volts * ((seen.reference.position - seen.position) / 1e-3).clamp(-1.0, 1.0)
    }

    fn reset(&mut self) {}
}

fn main() -> taut::Result<()> {
    let case = Case::from_text_with("axis.toml", TEMPLATE, &["encoder.lines=3000"])?;
    let machine = &case.machine;
    let limits = Limits { jerk: Some(200.0), ..Limits::new(0.3, 4.0) };
    let path = [Profile::new(0.0, &[Leg::To(0.1, limits)])?];
    let timing = Loop { limit: Some(24.0), ..Loop::sampled(1e-3) };
    let run = close(machine, &mut [&mut Relay { volts: 10.0 }], &timing, &path, 1.0, 50e-6, Solver::Exact)?;
    println!("relay: cart error at most {:.1} µm", 1e6 * run.figures.cart().error.peak.value.abs());

    let pid = Pid { integral: 60e3, derivative: 10.0, ..Pid::new(3000.0) };
    let design = Design { limit: Some(24.0), ..Design::new(1e-3, Structure::Pid(pid)) };
    let setup = Setup { window: 50e-6, ..Setup::new(machine, &design, &path, 1.0) };
    let mut best = f64::INFINITY;
    for _ in 0..200 {
        let begin = Instant::now();
        closed_loop(&setup)?;
        best = best.min(begin.elapsed().as_secs_f64());
    }
    let run = closed_loop(&setup)?;
    println!(
        "PID: cart error at most {:.1} µm; one second at 1 kHz in {:.0} µs",
        1e6 * run.figures.cart().error.peak.value.abs(),
        1e6 * best
    );
    println!("{:?} {:?} events {}", run.figures, run.outcome.cost, run.outcome.events.len());
    Ok(())
}
