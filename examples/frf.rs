//! How far `taut frf` is off, and how often its circles and intervals hold the truth, on simulated logs with friction,
//! counts and delay.
//!
//! cargo run --release --package taut --example frf -- 500

use nalgebra::Complex;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::PI;
use taut::case::Case;
use taut::control::{Controller, Loop, Observation, close};
use taut::frf::{Cut, Frf, Known, estimate, fit};
use taut::linear::{Hold, Operation, StateSpace};
use taut::log::{Log, Output, Quantity};
use taut::machine::Machine;
use taut::signal::profile::{Leg, Limits, Profile};
use taut::solve::Solver;

/// Between samples, s; length of a log, s; counts in a turn of the drive pulley.
const EVERY: f64 = 1e-3;
const LENGTH: f64 = 16.0;
const COUNTS: f64 = 4.0 * 2048.0 * 5.9;

/// Bands in which errors are averaged, Hz.
const BANDS: [[f64; 2]; 5] = [[2.0, 20.0], [20.0, 80.0], [80.0, 160.0], [160.0, 300.0], [300.0, 450.0]];

/// Drives the axis with noise about a mean, open loop, or with noise on its reference, and writes down what it sees.
struct Exciter {
    random: Pcg64,
    closed: bool,
    held: (usize, f64),
    time: Vec<f64>,
    input: Vec<f64>,
    reference: Vec<f64>,
    angle: Vec<f64>,
    radius: f64,
    before: f64,
}

fn uniform(random: &mut Pcg64) -> f64 {
    (random.next_u64() >> 11) as f64 * 2f64.powi(-53)
}

impl Controller for Exciter {
    fn step(&mut self, seen: &Observation) -> f64 {
        let t = self.time.len() as f64 * EVERY;
        // Noise of two levels, new every sample.
        if self.held.0 == 0 {
            self.held = (1, if uniform(&mut self.random) < 0.5 { -1.0 } else { 1.0 });
        }
        self.held.0 -= 1;
        let angle = (seen.position / self.radius * COUNTS / (2.0 * PI)).floor() * 2.0 * PI / COUNTS;
        let (reference, input) = match self.closed {
            false => (0.0, 5.0 + 3.0 * self.held.1),
            true => {
                let reference = 0.25 * t + 1e-3 * self.held.1;
                let error = reference - angle * self.radius;
                let rate = (error - self.before) / EVERY;
                self.before = error;
                (reference, (2.0 + 1500.0 * error + 6.0 * rate.clamp(-0.5, 0.5)).clamp(-24.0, 24.0))
            }
        };
        self.time.push(t);
        self.input.push(input);
        self.reference.push(reference);
        self.angle.push(angle);
        input
    }

    fn reset(&mut self) {}
}

/// A log of this stage.
fn log(machine: &Machine, closed: bool, delay: f64, seed: u64) -> taut::Result<Log> {
    let mut exciter = Exciter {
        random: Pcg64::seed_from_u64(seed),
        closed,
        held: (0, 1.0),
        time: Vec::new(),
        input: Vec::new(),
        reference: Vec::new(),
        angle: Vec::new(),
        radius: machine.pulley_radius,
        before: 0.0,
    };
    let limits = Limits { speed: 1.0, acceleration: 10.0, jerk: None, snap: None };
    let profile = Profile::new(0.0, &[Leg::To(1e-3, limits)])?;
    let timing = Loop { every: EVERY, delay, limit: None, lead: 0.0 };
    close(machine, &mut [&mut exciter], &timing, &[profile], LENGTH, 1.0, Solver::for_machine(machine))?;
    // Once everything slides: the first second is left out.
    let from = (1.0 / EVERY) as usize;
    let cut = |values: &[f64]| values[from..].to_vec();
    let output = Output { quantity: Quantity::DriveAngle, absolute: false, values: cut(&exciter.angle) };
    Ok(Log {
        name: "simulated".into(),
        file: "simulated.csv".into(),
        time: cut(&exciter.time),
        inputs: vec![cut(&exciter.input)],
        added: None,
        hold: taut::signal::Hold::Zero,
        reference: closed.then(|| cut(&exciter.reference)),
        outputs: vec![output],
        ended: None,
    })
}

/// The true response.
fn truth(machine: &Machine, delay: f64, frf: &Frf) -> taut::Result<Vec<Complex<f64>>> {
    let system = StateSpace::new(machine, Operation::default())?;
    let output = system.output("drive_angle").unwrap_or_default();
    let model = system.discrete(EVERY, Hold::Zero, delay)?;
    Ok(frf.points.iter().map(|point| model.at(point.omega)[output]).collect())
}

#[derive(Default, Clone, Copy)]
struct Tally {
    points: f64,
    held: f64,
    off: Complex<f64>,
    square: f64,
}

fn main() -> taut::Result<()> {
    let count: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(40);
    let base = Machine { encoder: None, ..Case::read("stages/sollmann-jouaneh/table4.toml")?.machine };
    println!("| loop | band, Hz | points | mean error of G | rms error | held by the circle |");
    println!("|---|---|---|---|---|---|");
    let mut fitted = Vec::new();
    for closed in [false, true] {
        let mut tallies = [Tally::default(); BANDS.len()];
        let mut known = [0.0; 4];
        let mut off = 0.0;
        for seed in 0..count / 2 {
            let mut random = Pcg64::seed_from_u64(1000 + 2 * seed + u64::from(closed));
            let mut between = |low: f64, high: f64| low + (high - low) * uniform(&mut random);
            let mut machine = base.clone();
            machine.cart.mass *= between(0.8, 1.2);
            let (stiffer, ratio) = (between(0.7, 1.4), between(2e-5, 8e-5));
            let named = machine.belt.stiffness;
            machine.belt.make = None;
            machine.belt.stiffness = named.map(|k| k * stiffer);
            machine.belt.damping = machine.belt.stiffness.map(|k| k * ratio);
            let delay = between(0.1e-3, 1.4e-3);
            let log = log(&machine, closed, delay, seed)?;
            let frfs = estimate(&log, &Cut::default())?;
            let exact = truth(&machine, delay, &frfs[0])?;
            for (point, truth) in frfs[0].points.iter().zip(&exact) {
                let hertz = point.omega / (2.0 * PI);
                let band = BANDS.iter().position(|band| (band[0]..band[1]).contains(&hertz));
                if let (Some(band), true) = (band, point.coherence >= taut::frf::COHERENT) {
                    let error = (point.value - truth) / truth;
                    let tally = &mut tallies[band];
                    tally.points += 1.0;
                    tally.held += f64::from(u8::from((point.value - truth).norm() <= point.radius));
                    tally.off += error;
                    tally.square += error.norm_sqr();
                }
            }
            let mut model = machine.clone();
            model.belt.stiffness = named;
            let found = fit(&model, &Known { place: 0.0, bridge: 0.0, delay: 0.7e-3 }, &frfs)?;
            let holds =
                |(_, [low, high]): (f64, [f64; 2]), truth: f64| f64::from(u8::from((low..=high).contains(&truth)));
            known[0] += holds(found.stiffness, stiffer);
            known[1] += holds(found.damping, ratio);
            known[2] += holds(found.delay, delay);
            known[3] += 1.0;
            off += found.stiffness.0 / stiffer - 1.0;
        }
        let name = if closed { "closed" } else { "open" };
        for (band, tally) in BANDS.iter().zip(tallies) {
            println!(
                "| {name} | {:.0} to {:.0} | {:.0} | {:.2} % | {:.1} % | {:.1} % |",
                band[0],
                band[1],
                tally.points,
                100.0 * (tally.off / tally.points).norm(),
                100.0 * (tally.square / tally.points).sqrt(),
                100.0 * tally.held / tally.points
            );
        }
        let share = |held: f64| 100.0 * held / known[3];
        fitted.push(format!(
            "| {name} | {:.0} | {:.2} % | {:.1} % | {:.1} % | {:.1} % |",
            known[3],
            100.0 * off / known[3],
            share(known[0]),
            share(known[1]),
            share(known[2])
        ));
    }
    println!("\n| loop | logs | mean error of stiffness | stiffness held | damping held | delay held |");
    println!("|---|---|---|---|---|---|");
    println!("{}", fitted.join("\n"));
    Ok(())
}
