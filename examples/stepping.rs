//! Times a simulated second of 1 ms steps: a proportional controller in the library's closed loop, and the same stepped
//! from outside through a [`Simulator`]; prints JSON.
//!
//! `cargo run --release --package taut --example stepping [-- CALLS]`

use std::time::Instant;
use taut::Result;
use taut::case::{Case, TEMPLATE};
use taut::control::{Controller, Loop, Observation, close};
use taut::signal::Signal;
use taut::signal::profile::{Leg, Limits, Profile};
use taut::solve::{Simulator, Solver};

const GAIN: f64 = 3000.0;
const LIMIT: f64 = 12.0;

struct Proportional;

impl Controller for Proportional {
    fn step(&mut self, seen: &Observation) -> f64 {
        GAIN * (seen.reference.position - seen.position)
    }

    fn reset(&mut self) {}
}

/// The best time of so many calls, s.
fn best(calls: u32, mut work: impl FnMut() -> Result<f64>) -> Result<(f64, f64)> {
    let (mut best, mut end) = (f64::INFINITY, 0.0);
    for _ in 0..calls {
        let begin = Instant::now();
        end = work()?;
        best = best.min(begin.elapsed().as_secs_f64());
    }
    Ok((best, end))
}

fn main() -> Result<()> {
    let calls = std::env::args().nth(1).and_then(|number| number.parse().ok()).unwrap_or(200);
    let case = Case::from_text("axis.toml", TEMPLATE)?;
    let limits = Limits { speed: 0.2, acceleration: 2.0, jerk: None, snap: None };
    let path = [Profile::new(0.0, &[Leg::To(0.05, limits)])?];
    let timing = Loop { every: 1e-3, delay: 0.0, limit: Some(LIMIT), lead: 0.0 };
    let (closed, at) = best(calls, || {
        let run = close(&case.machine, &mut [&mut Proportional], &timing, &path, 1.0, 50e-6, Solver::Exact)?;
        Ok(path[0].target() - run.figures.cart().error.last)
    })?;
    let start = Simulator::new(&case.machine, Solver::Exact)?;
    let (radius, shaft) = (case.machine.pulley_radius, start.mechanism().drives[0].shaft);
    let (stepped, there) = best(calls, || {
        let (mut machine, mut events) = (start.clone(), Vec::new());
        for k in 0..1000 {
            let time = f64::from(k) * 1e-3;
            let error = path[0].at(time).position - radius * machine.state().position[shaft];
            let held = Signal::Step { value: (GAIN * error).clamp(-LIMIT, LIMIT), at: 0.0 };
            machine.set_input(0, &held.piece(machine.time()))?;
            if machine.advance(f64::from(k + 1) * 1e-3, &mut events).is_err() {
                break;
            }
        }
        Ok(machine.state().position[taut::machine::axis::CART])
    })?;
    println!(
        "{{\"closed_loop_s\": {closed:.3e}, \"stepped_s\": {stepped:.3e}, \"ratio\": {:.2}, \"apart_m\": {:.1e}}}",
        stepped / closed,
        (at - there).abs()
    );
    Ok(())
}
