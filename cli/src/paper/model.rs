//! The paper's parameter sets, its pulses, and what it plots of a run: position and speed of the motor in metres.

use taut::case::{Case, Experiment};
use taut::error::{Error, Result};
use taut::friction::{Friction, Motion, Side};
use taut::machine::Machine;
use taut::mechanism::State;
use taut::signal::Signal;
use taut::solve::{Event, Solver, simulate};
use taut::stages;

/// Length of the pulses, s (section 3).
pub const PULSE: f64 = 0.25;

/// Their voltages, V.
pub const VOLTS: [f64; 2] = [5.0, 10.0];

/// End of every run, s.
pub const UNTIL: f64 = 1.0;

/// Output interval of what is drawn and measured, s: eighteen points to a period of the belt's fastest oscillation.
pub const EVERY: f64 = 2e-4;

/// The three sets of parameters.
pub struct Sets {
    /// Table 1: the first parameters.
    pub table1: Case,
    /// Table 2: those "matched for 5 V input".
    pub table2: Case,
    /// Friction of Table 4, the rest of Table 2.
    pub table4: Case,
}

impl Sets {
    /// Reads the files that are part of the program.
    pub fn read() -> Result<Self> {
        let case = |name: &str| {
            let text = stages::text(&format!("sollmann-jouaneh/{name}"));
            Case::from_text(name, text.ok_or_else(|| Error::new("this stage is not bundled").in_file(name))?)
        };
        Ok(Self { table1: case("table1.toml")?, table2: case("table2.toml")?, table4: case("table4.toml")? })
    }
}

/// A run, in the paper's terms.
#[derive(Debug, Clone)]
pub struct Response {
    /// Time, s.
    pub time: Vec<f64>,
    /// "Equivalent motor linear position" r φ₁, m.
    pub position: Vec<f64>,
    /// Its velocity r φ₁′, m/s.
    pub speed: Vec<f64>,
    /// Cart position x, m.
    pub cart_position: Vec<f64>,
    /// Cart velocity x′, m/s.
    pub cart_speed: Vec<f64>,
    /// Mean velocity of the three inertias, each weighted by its inertia, m/s: the belt's oscillation is not in it.
    pub mean_speed: Vec<f64>,
    /// Every body that stopped or started.
    pub events: Vec<Event>,
}

impl Response {
    /// Where the motor is at the end, m.
    pub fn final_position(&self) -> f64 {
        self.position[self.position.len() - 1]
    }

    /// Where the cart is at the end, m.
    pub fn final_cart_position(&self) -> f64 {
        self.cart_position[self.cart_position.len() - 1]
    }

    /// The row at time `t`, which must be one of the output times.
    pub fn row(&self, t: f64) -> usize {
        let row = (t / self.time[1]).round() as usize;
        debug_assert!((self.time[row] - t).abs() < 1e-9);
        row
    }

    /// The highest speed of the motor, m/s.
    pub fn peak_speed(&self) -> f64 {
        self.speed.iter().copied().fold(0.0, f64::max)
    }

    /// Mean speed over the last 50 ms of the pulse, m/s: the belt's oscillation averages out.
    pub fn plateau(&self) -> f64 {
        let (from, to) = (self.row(PULSE - 0.05), self.row(PULSE));
        (self.position[to] - self.position[from]) / (self.time[to] - self.time[from])
    }

    /// When the mean velocity has first reached 1 − 1/e of the plateau, s.
    pub fn time_constant(&self) -> f64 {
        let goal = (1.0 - (-1.0_f64).exp()) * self.plateau();
        let Some(row) = self.mean_speed.iter().position(|v| *v >= goal) else { return f64::NAN };
        if row == 0 {
            return f64::NAN;
        }
        let (before, after) = (self.mean_speed[row - 1], self.mean_speed[row]);
        let share = (goal - before) / (after - before);
        self.time[row - 1] + share * (self.time[row] - self.time[row - 1])
    }

    /// Largest difference between the motor's velocity and the cart's, m/s: how much the belt oscillates.
    pub fn oscillation(&self) -> f64 {
        self.speed.iter().zip(&self.cart_speed).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Distance travelled after the pulse has ended, m.
    pub fn coasting(&self) -> f64 {
        self.final_position() - self.position[self.row(PULSE)]
    }

    /// How often a body came to rest, and how often one started.
    pub fn stops_and_starts(&self) -> (usize, usize) {
        let count = |f: fn(&Event) -> bool| self.events.iter().filter(|e| f(e)).count();
        (count(|e| e.to == Motion::Stuck), count(|e| e.from == Motion::Stuck))
    }

    /// When the last body came to rest, s.
    pub fn stop_time(&self) -> Option<f64> {
        self.events.iter().rfind(|e| e.to == Motion::Stuck).map(|e| e.time)
    }

    /// Largest distance to another run in position, m.
    pub fn position_distance(&self, other: &Response) -> f64 {
        distance(&self.position, &other.position)
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The pulse of so many volts, from rest.
pub fn pulse(volts: f64, every: f64) -> Experiment {
    Experiment {
        name: format!("{volts} V pulse"),
        inputs: vec![Signal::Pulse { value: volts, duration: PULSE, at: 0.0 }],
        until: UNTIL,
        every,
        initial: State::default(),
        log: None,
    }
}

/// The stage's response to a pulse, by the exact solver.
pub fn respond(machine: &Machine, volts: f64) -> Result<Response> {
    run(machine, &pulse(volts, EVERY), Solver::Exact)
}

/// Any run, in the paper's terms.
pub fn run(machine: &Machine, experiment: &Experiment, solver: Solver) -> Result<Response> {
    let solution = simulate(machine, experiment, solver)?;
    let r = machine.pulley_radius;
    let column = |name: &str| solution.trajectory.get(name).unwrap_or_default().to_vec();
    let metres = |name: &str| column(name).into_iter().map(|angle| r * angle).collect();
    let (speed, cart_speed): (Vec<f64>, Vec<f64>) = (metres("drive_speed"), column("cart_speed"));
    let idler_speed: Vec<f64> = metres("idler_speed");
    // Inertias as masses on the belt: J₁/r², M, J₂/r².
    let [m1, m2, m3] =
        [machine.drive_pulley.inertia / (r * r), machine.cart.mass, machine.idler_pulley.inertia / (r * r)];
    let mean = |((a, b), c): ((&f64, &f64), &f64)| (m1 * a + m2 * b + m3 * c) / (m1 + m2 + m3);
    Ok(Response {
        time: column("time"),
        position: metres("drive_angle"),
        mean_speed: speed.iter().zip(&cart_speed).zip(&idler_speed).map(mean).collect(),
        speed,
        cart_position: column("cart_position"),
        cart_speed,
        events: solution.outcome.events,
    })
}

/// The parameter that is doubled and halved, one at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// k₁, k₂ and k₃ (figures 6 to 9).
    Stiffness,
    /// J₁ and J₂ (figures 10 and 11).
    PulleyInertia,
    /// J₁, J₂ and M.
    AllInertia,
    /// B₁, B₂, b, and τ_c1, τ_c2, F_c where there are any (figures 12 and 13).
    Friction,
}

impl Change {
    /// All of them.
    pub const ALL: [Change; 4] = [Change::Stiffness, Change::PulleyInertia, Change::AllInertia, Change::Friction];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Change::Stiffness => "stiffness",
            Change::PulleyInertia => "inertia\u{a0}J",
            Change::AllInertia => "inertia\u{a0}J,\u{a0}M",
            Change::Friction => "friction",
        }
    }

    /// The stage with that parameter times `factor`.
    pub fn apply(self, machine: &Machine, factor: f64) -> Machine {
        let mut machine = machine.clone();
        match self {
            Change::Stiffness => machine.belt.stiffness = machine.belt.stiffness.map(|k| k * factor),
            Change::PulleyInertia | Change::AllInertia => {
                machine.drive_pulley.inertia *= factor;
                machine.idler_pulley.inertia *= factor;
                if self == Change::AllInertia {
                    machine.cart.mass *= factor;
                }
            }
            Change::Friction => {
                for law in frictions(&mut machine) {
                    *law = scaled(law, factor);
                }
            }
        }
        machine
    }
}

/// Everything that resists or drives times `factor`: no voltage-to-position response can tell (P7).
pub fn scale_everything(machine: &Machine, factor: f64) -> Machine {
    let mut machine =
        Change::Friction.apply(&Change::AllInertia.apply(&Change::Stiffness.apply(machine, factor), factor), factor);
    machine.drives[0].motor.torque_constant *= factor;
    machine
}

/// The friction laws of the three bodies.
pub fn frictions(machine: &mut Machine) -> [&mut Friction; 3] {
    [&mut machine.drive_pulley.friction, &mut machine.cart.friction, &mut machine.idler_pulley.friction]
}

fn scaled(law: &Friction, factor: f64) -> Friction {
    let side =
        |s: Side| Side { viscous: s.viscous * factor, coulomb: s.coulomb * factor, breakaway: s.breakaway * factor };
    Friction { forward: side(law.forward), backward: side(law.backward), ..*law }
}
