//! Trajectories and commands that exported machines and controllers are compared with.

use taut::case::Case;
use taut::control::{Controller, Loop, Observation, Standard, close};
use taut::export::mechanism;
use taut::mechanism::State;
use taut::signal::Signal;
use taut::signal::profile::Reference;
use taut::solve::{Simulator, Solver};

/// Steps of a run, and how long each is, s.
pub const STEPS: usize = 1000;
pub const STEP: f64 = 1e-3;

/// Commands of the drives, step by step.
pub type Commands = Vec<Vec<f64>>;

/// Ways of the bodies after each step, at the belt, m; and how long a unit of each body's own way is there.
pub struct Ways {
    pub ways: Vec<Vec<f64>>,
    pub levers: Vec<f64>,
}

/// A command that is another one every few steps, zero often enough for bodies to rest: drawn from a seed.
pub fn commands(drives: usize, size: f64, seed: u64) -> Commands {
    let mut number = seed;
    let mut next = || {
        number = number.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (number >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut now = vec![0.0; drives];
    let mut left = 0_usize;
    (0..STEPS)
        .map(|_| {
            if left == 0 {
                left = 5 + (60.0 * next()) as usize;
                now = (0..drives).map(|_| if next() < 0.3 { 0.0 } else { size * (2.0 * next() - 1.0) }).collect();
            }
            left -= 1;
            now.clone()
        })
        .collect()
}

/// A pulse: `value` for as many steps.
pub fn pulse(value: f64, steps: usize) -> Commands {
    (0..STEPS).map(|k| vec![if k < steps { value } else { 0.0 }]).collect()
}

/// The ways of the bodies by taut's own solver.
pub fn ways(case: &Case, commands: &Commands) -> Ways {
    let mechanism = mechanism(case);
    let mut machine = Simulator::of_mechanism(&mechanism, &State::default(), Solver::Exact, STEP).unwrap();
    let levers: Vec<f64> = mechanism.bodies.iter().map(|body| body.kind.lever()).collect();
    let mut events = Vec::new();
    let mut ways = Vec::new();
    let mut before: Option<&Vec<f64>> = None;
    for (k, command) in commands.iter().enumerate() {
        if before != Some(command) {
            for (drive, value) in command.iter().enumerate() {
                machine.set_input(drive, &Signal::Step { value: *value, at: 0.0 }.piece(machine.time())).unwrap();
            }
            before = Some(command);
        }
        machine.advance(STEP * (k + 1) as f64, &mut events).unwrap();
        let state = machine.state();
        ways.push(levers.iter().zip(state.position).map(|(lever, way)| lever * way).collect());
    }
    assert!(!events.is_empty(), "nothing sticks");
    Ways { ways, levers }
}

impl Ways {
    /// The largest difference from what another tool wrote: own ways of the bodies, step by step.
    pub fn differ(&self, other: &[f64]) -> f64 {
        let bodies = self.levers.len();
        assert_eq!(other.len(), bodies * self.ways.len());
        let each = self.ways.iter().flatten().zip(other).enumerate();
        each.map(|(k, (own, other))| (own - self.levers[k % bodies] * other).abs())
            .fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) })
    }
}

/// Largest errors of a reference that is made from rounded numbers: of its position and of its four derivatives.
const NOISE: [f64; 5] = [1e-9, 0.9e-6, 0.9e-3, 0.0, 0.0];

/// The same as [`observed`] with references that never stand quite still.
pub fn noisy(case: &Case, which: usize, seed: u64) -> Vec<([f64; 12], f64)> {
    let design = case.controller.as_ref().unwrap();
    let mut own = Standard::new(design, &case.machine).unwrap();
    let mut number = seed;
    let mut next = || {
        number = number.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (number >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut step = |(mut all, _): ([f64; 12], f64)| {
        all.iter_mut().take(10).zip(NOISE.iter().cycle()).for_each(|(value, noise)| *value += noise * next());
        let five = |k: usize| Reference {
            position: all[k],
            speed: all[k + 1],
            acceleration: all[k + 2],
            jerk: all[k + 3],
            snap: all[k + 4],
        };
        let (reference, ahead, position, current) = (five(0), five(5), all[10], all[11]);
        let asked = own.step(&Observation { time: 0.0, reference, ahead, position, scale: None, current });
        let given = design.limit.map_or(asked, |limit| asked.clamp(-limit, limit));
        own.limited(given);
        (all, given)
    };
    observed(case, which).into_iter().map(&mut step).collect()
}

/// A controller that is watched: what it saw, and what its limit left.
struct Watched {
    own: Standard,
    seen: Vec<(Observation, f64)>,
}

impl Controller for Watched {
    fn step(&mut self, seen: &Observation) -> f64 {
        self.seen.push((*seen, f64::NAN));
        self.own.step(seen)
    }

    fn limited(&mut self, given: f64) {
        self.seen.last_mut().unwrap().1 = given;
        self.own.limited(given);
    }

    fn reset(&mut self) {
        self.own.reset();
    }
}

/// Inputs of the controller of an axis in one of its moves, and the commands that follow: twelve numbers and one.
pub fn observed(case: &Case, which: usize) -> Vec<([f64; 12], f64)> {
    observed_drives(case, which).swap_remove(0)
}

/// The same of the controller of each drive.
pub fn observed_drives(case: &Case, which: usize) -> Vec<Vec<([f64; 12], f64)>> {
    let design = case.controller.as_ref().unwrap();
    let one = &case.moves[which];
    let own = Standard::of_drives(design, &case.machine).unwrap();
    let mut watched: Vec<Watched> = own.into_iter().map(|own| Watched { own, seen: Vec::new() }).collect();
    let profiles = one.references(design);
    let timing = Loop::of(design);
    let mut each: Vec<&mut dyn Controller> = watched.iter_mut().map(|one| one as &mut dyn Controller).collect();
    close(&case.machine, &mut each, &timing, &profiles, one.until, one.window, Solver::of(&case.machine)).unwrap();
    let flat = |seen: &Observation| {
        let five = |r: Reference| [r.position, r.speed, r.acceleration, r.jerk, r.snap];
        let mut all = [0.0; 12];
        all[..5].copy_from_slice(&five(seen.reference));
        all[5..10].copy_from_slice(&five(seen.ahead));
        (all[10], all[11]) = (seen.position, seen.current);
        all
    };
    watched.iter().map(|one| one.seen.iter().map(|(seen, given)| (flat(seen), *given)).collect()).collect()
}
