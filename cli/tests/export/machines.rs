//! Trajectories and commands that exported machines and controllers are compared with.

use taut::case::Case;
use taut::control::{Controller, Loop, Observation, Rows, Sample, Standard, stream};
use taut::export::mechanism;
use taut::mechanism::State;
use taut::signal::Signal;
use taut::signal::profile::Reference;
use taut::solve::{Flow, Simulator, Solver};

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

/// Numbers from 0 to 1 that look random.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut number = seed;
    move || {
        number = number.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (number >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A command that is another one every few steps, zero often enough for bodies to rest: drawn from a seed.
pub fn commands(drives: usize, size: f64, seed: u64) -> Commands {
    let mut next = random(seed);
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
    let mut uniform = random(seed);
    let mut next = || 2.0 * uniform() - 1.0;
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

/// A controller that is watched: what it was told of all slides, and its measurements.
struct Watched {
    own: Standard,
    /// References of all slides when the command acts, and their number.
    ahead: Vec<Reference>,
    slides: usize,
    seen: Vec<LoopRecord>,
}

/// Inputs of a controller: the references of all slides at the sample, then ahead of it, position and current.
pub type LoopRecord = Vec<f64>;

/// The five numbers of a reference.
fn five(r: &Reference) -> [f64; 5] {
    [r.position, r.speed, r.acceleration, r.jerk, r.snap]
}

impl Controller for Watched {
    fn step(&mut self, seen: &Observation) -> f64 {
        let ahead = self.ahead.iter().flat_map(five);
        self.seen.push(ahead.chain([seen.position, seen.current]).collect());
        self.own.step(seen)
    }

    fn forward(&mut self, slides: &[Reference]) -> f64 {
        self.ahead = slides[..self.slides].to_vec();
        self.own.forward(slides)
    }

    fn target(&self, along: Reference, slides: &[Reference]) -> Reference {
        self.own.target(along, slides)
    }

    fn limited(&mut self, given: f64) {
        self.own.limited(given);
    }

    fn reset(&mut self) {
        self.own.reset();
    }
}

/// Inputs of the controller of an axis in one of its moves, and the commands that follow: twelve numbers and one.
pub fn observed(case: &Case, which: usize) -> Vec<([f64; 12], f64)> {
    let of_axis = observed_drives(case, which).swap_remove(0);
    of_axis.into_iter().map(|(seen, given)| (seen.try_into().unwrap(), given)).collect()
}

/// The same of the controller of each drive.
pub fn observed_drives(case: &Case, which: usize) -> Vec<Vec<(LoopRecord, f64)>> {
    let design = case.controller.as_ref().unwrap();
    let one = &case.moves[which];
    let profiles = one.references(design);
    let own = Standard::of_drives(design, &case.machine).unwrap();
    let watched = |own| Watched { own, ahead: Vec::new(), slides: profiles.len(), seen: Vec::new() };
    let mut watched: Vec<Watched> = own.into_iter().map(watched).collect();
    let timing = Loop::new(design);
    let mut each: Vec<&mut dyn Controller> = watched.iter_mut().map(|one| one as &mut dyn Controller).collect();
    let rows = Rows { until: one.until, every: design.every, window: one.window };
    let (solver, sink) = (Solver::for_machine(&case.machine), &mut |_: &_| Flow::Continue);
    let run = stream(&case.machine, &mut each, &timing, &profiles, &rows, solver, true, sink).unwrap();
    let of_drive = |(drive, watched): (usize, Watched)| {
        let samples = run.kept.iter().filter(|sample| sample.drive == drive);
        let with_given = |(mut seen, sample): (LoopRecord, &Sample)| {
            let now = profiles.iter().flat_map(|profile| five(&profile.at(sample.time)));
            seen.splice(0..0, now);
            (seen, sample.given)
        };
        watched.seen.into_iter().zip(samples).map(with_given).collect()
    };
    watched.into_iter().enumerate().map(of_drive).collect()
}

/// A gantry of any kind with a controller with feed-forward, drawn: its case in `stages` and changes of it.
pub fn drawn_gantry(number: u64) -> (String, Vec<String>) {
    let mut next = random(1000 + number);
    next();
    let mut between = |low: f64, high: f64| low + (high - low) * next();
    let (kind, spans) = [("h-frame", 3), ("core-xy", 4), ("dual-belt", 6)][number as usize % 3];
    let stiffness: Vec<String> = (0..spans).map(|_| between(4e4, 2e5).to_string()).collect();
    let mut friction = |b: f64, dry: f64| {
        let mut side = |end: &str| {
            let (viscous, coulomb) = (b * between(0.01, 1.0), dry * between(0.1, 1.0));
            format!("viscous{end} = {viscous}, coulomb{end} = {coulomb}")
        };
        format!("{{ {}, {} }}", side(""), side("_backward"))
    };
    let rubbing = [friction(15.0, 1.0), friction(10.0, 0.6), friction(3e-3, 0.02)];
    let structure = match between(0.0, 3.0) as usize {
        0 => "pid = { proportional = 2000, integral = 10000, derivative = 20 }",
        1 => "cascade = { position = 20, speed = 40, speed_integral = 0.05 }",
        _ => {
            "cascade = { position = 20, speed = 1.5, speed_integral = 0.05, \
             current = { proportional = 2, integral = 500, limit = 15 } }"
        }
    };
    let (model, inertia, friction) =
        ([FORWARD[0], FORWARD[1], FORWARD[1]][between(0.0, 3.0) as usize], between(0.6, 1.2), between(0.6, 1.2));
    let shares =
        if between(0.0, 1.0) < 0.5 { String::new() } else { format!(", inertia = {inertia}, friction = {friction}") };
    let compensated = between(0.0, 1.0) < 0.5;
    let mut changes = vec![
        format!("bridge.mass={}", between(0.2, 2.0)),
        format!("cart.mass={}", between(0.1, 1.0)),
        format!("bridge.friction={}", rubbing[0]),
        format!("cart.friction={}", rubbing[1]),
        format!("drive_pulley.friction={}", rubbing[2]),
        format!("right_drive.motor.resistance={}", between(0.4, 1.0)),
        format!("motor.rotor_inertia={}", between(1e-6, 1e-5)),
        format!(
            "controller={{ every = 1e-3, delay = {}, limit = 20, {structure}, \
             feed_forward = {{ model = \"{model}\"{shares}, compensate_stretch = {compensated} }} }}",
            between(0.0, 2e-3),
        ),
        "move=[{ name = \"smooth\", points = [[0.04, 0.02], [0.01, 0.035]], speed = 0.3, acceleration = 5, jerk = 200, \
         snap = 20000, until = 0.8 }]"
            .into(),
    ];
    match number % 4 {
        // Spans that follow the slides.
        0 => changes.push(format!(
            "belt={{ modulus = 8e9, section = 1e-5, spans = {:?}, follows_cart = true }}",
            vec![between(0.8, 1.6); spans]
        )),
        _ => changes.push(format!("belt.stiffness=[{}]", stiffness.join(", "))),
    }
    // Gears with a loss, or compliant ones, which a dual belt does not have.
    match number % 5 {
        1 => changes.extend(["motor.gear_ratio=2".into(), "motor.gear_efficiency=0.8".into()]),
        2 if kind != "dual-belt" => {
            changes.extend(["motor.gear_stiffness=400".into(), "motor.gear_damping=0.05".into()])
        }
        3 => changes.push("motor.inductance=2e-4".into()),
        _ => {}
    }
    (format!("stages/{kind}/square.toml"), changes)
}

/// Models of feed-forward.
const FORWARD: [&str; 2] = ["rigid", "elastic"];
