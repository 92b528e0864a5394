//! One parameter at a time, doubled and halved (section 3), and everything else that compares runs with each other.

use super::model::{
    Change, EVERY, PULSE, Response, Sets, UNTIL, VOLTS, frictions, pulse, respond, run, scale_everything,
};
use rayon::prelude::*;
use taut::error::Result;
use taut::friction::Friction;
use taut::machine::Machine;
use taut::solve::{Method, Solver, simulate};

/// The factors by which parameters are varied.
pub const FACTORS: [f64; 2] = [2.0, 0.5];

/// Which set a study starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum From {
    /// Linear, Table 1: the paper's own study.
    Table1,
    /// With Coulomb friction, Table 4.
    Table4,
}

/// The effect of one change on one response. Relative changes refer to the unchanged run.
pub struct Effect {
    /// Where it starts from.
    pub from: From,
    /// The change.
    pub change: Change,
    /// By which factor.
    pub factor: f64,
    /// Under which pulse, V.
    pub volts: f64,
    /// The changed run.
    pub response: Response,
    /// Change of the final position, relative.
    pub final_position: f64,
    /// Largest change of the position at any time, relative to the final position.
    pub path: f64,
    /// Change of the speed that is reached, relative.
    pub plateau: f64,
    /// Change of the peak speed, relative.
    pub peak: f64,
    /// Time constant, s.
    pub time_constant: f64,
    /// Its change, relative.
    pub time_constant_change: f64,
    /// Change of the oscillation between motor and cart, relative.
    pub oscillation: f64,
    /// Distance travelled after the pulse, over that of the unchanged run.
    pub coasting: f64,
}

/// All responses of the paper's sets and their variations.
pub struct Runs {
    /// Table 1 at 5 and 10 V.
    pub table1: [Response; 2],
    /// Table 2 at 5 and 10 V.
    pub table2: [Response; 2],
    /// Table 4 at 5 and 10 V.
    pub table4: [Response; 2],
    /// Every variation of Tables 1 and 4.
    pub effects: Vec<Effect>,
}

impl Runs {
    /// Runs them all.
    pub fn new(sets: &Sets) -> Result<Self> {
        let both = |machine: &Machine| -> Result<[Response; 2]> {
            Ok([respond(machine, VOLTS[0])?, respond(machine, VOLTS[1])?])
        };
        let (table1, table2, table4) =
            (both(&sets.table1.machine)?, both(&sets.table2.machine)?, both(&sets.table4.machine)?);
        let mut jobs = Vec::new();
        for (from, machine, base) in
            [(From::Table1, &sets.table1.machine, &table1), (From::Table4, &sets.table4.machine, &table4)]
        {
            for change in Change::ALL {
                for factor in FACTORS {
                    for (volts, base) in VOLTS.into_iter().zip(base) {
                        jobs.push((from, machine, base, change, factor, volts));
                    }
                }
            }
        }
        let effects = jobs
            .into_par_iter()
            .map(|(from, machine, base, change, factor, volts)| effect(from, machine, base, change, factor, volts))
            .collect::<Result<_>>()?;
        Ok(Self { table1, table2, table4, effects })
    }

    /// The effects of changes of one kind on one set.
    pub fn effects(&self, from: From, changes: &[Change]) -> impl Iterator<Item = &Effect> {
        self.effects.iter().filter(move |e| e.from == from && changes.contains(&e.change))
    }

    /// One effect.
    pub fn one(&self, from: From, change: Change, factor: f64, volts: f64) -> &Effect {
        self.effects(from, &[change])
            .find(|e| e.factor == factor && e.volts == volts)
            .expect("every combination is run")
    }
}

fn effect(from: From, machine: &Machine, base: &Response, change: Change, factor: f64, volts: f64) -> Result<Effect> {
    let response = respond(&change.apply(machine, factor), volts)?;
    let relative = |f: fn(&Response) -> f64| f(&response) / f(base) - 1.0;
    Ok(Effect {
        from,
        change,
        factor,
        volts,
        final_position: relative(Response::final_position),
        path: response.position_distance(base) / base.final_position(),
        plateau: relative(Response::plateau),
        peak: relative(Response::peak_speed),
        time_constant: response.time_constant(),
        time_constant_change: relative(Response::time_constant),
        oscillation: relative(Response::oscillation),
        coasting: response.coasting() / base.coasting(),
        response,
    })
}

/// The largest of these, without sign.
pub fn largest<'a>(effects: impl Iterator<Item = &'a Effect>, f: fn(&Effect) -> f64) -> f64 {
    effects.map(|e| f(e).abs()).fold(0.0, f64::max)
}

/// The smallest of these, without sign.
pub fn smallest<'a>(effects: impl Iterator<Item = &'a Effect>, f: fn(&Effect) -> f64) -> f64 {
    effects.map(|e| f(e).abs()).fold(f64::INFINITY, f64::min)
}

/// One run with the paper's Table 3.
pub struct Frozen {
    /// Formula.
    pub method: Method,
    /// Step, s.
    pub step: f64,
    /// Pulse, V.
    pub volts: f64,
    /// Final position r φ₁, m.
    pub final_position: f64,
    /// How far r φ₁ moves between 0.5 s and 1 s, m.
    pub creep: f64,
    /// How often the motor turns back after 0.35 s.
    pub turns: usize,
    /// r φ₁ at the output times, m.
    pub position: Vec<f64>,
}

/// Table 3 beside the exact solution.
pub struct Table3 {
    /// All formulas, steps and pulses.
    pub runs: Vec<Frozen>,
    /// Output times of those runs, s.
    pub time: Vec<f64>,
    /// The exact solution at those times, for 5 V and 10 V.
    pub exact: [Vec<f64>; 2],
    /// By how much the exact r φ₁, x or r φ₃ differs at most from its final value after the last body has stopped, m.
    pub exact_creep: f64,
    /// Distance that the cart goes in half a second at the edge of the band, 0.01 rad/s, m.
    pub band_edge: f64,
    /// Acceleration of the drive pulley at the very start of the 5 V pulse, rad/s²: with sign(0) = 0, and with
    /// friction.
    pub start: (f64, f64),
}

/// Steps of the fixed-step runs, s. The smallest takes 10⁶ steps and only the classical formula.
const STEPS: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];

impl Table3 {
    /// Runs it.
    pub fn new(sets: &Sets) -> Result<Self> {
        let machine = &sets.table4.machine;
        let mut jobs = Vec::new();
        for method in [Method::RungeKutta4, Method::DormandPrince5] {
            for step in STEPS {
                if method == Method::RungeKutta4 || step > 5e-6 {
                    jobs.extend(VOLTS.map(|volts| (method, step, volts)));
                }
            }
        }
        let mut runs: Vec<Frozen> = jobs
            .into_par_iter()
            .rev()
            .map(|(method, step, volts)| {
                let response = run(machine, &pulse(volts, 1e-3), Solver::Table3 { step, method })?;
                let half = response.position[response.row(0.5)];
                let late = &response.speed[response.row(0.35)..];
                Ok(Frozen {
                    method,
                    step,
                    volts,
                    final_position: response.final_position(),
                    creep: response.final_position() - half,
                    turns: late.windows(2).filter(|v| v[0] * v[1] < 0.0).count(),
                    position: response.position,
                })
            })
            .collect::<Result<_>>()?;
        runs.reverse();
        let exact = |volts: f64| run(machine, &pulse(volts, 1e-3), Solver::Exact);
        let (five, ten) = (exact(VOLTS[0])?, exact(VOLTS[1])?);
        let motor = &machine.drives[0].motor;
        let torque = motor.torque_constant / motor.resistance * VOLTS[0];
        let (j, coulomb) = (machine.drive_pulley.inertia, machine.drive_pulley.friction.forward.coulomb);
        Ok(Self {
            runs,
            exact_creep: rest_motion(machine, VOLTS[0])?.max(rest_motion(machine, VOLTS[1])?),
            time: five.time,
            exact: [five.position, ten.position],
            band_edge: 0.01 * machine.pulley_radius * 0.5 * UNTIL,
            start: (torque / j, (torque - coulomb) / j),
        })
    }
}

/// How far any position still moves after the last body has come to rest, m (exact solver).
fn rest_motion(machine: &Machine, volts: f64) -> Result<f64> {
    let solution = simulate(machine, &pulse(volts, EVERY), Solver::Exact)?;
    let stop = solution.outcome.events.last().map_or(f64::NAN, |e| e.time);
    let time = solution.trajectory.get("time").unwrap_or_default();
    let Some(first) = time.iter().position(|t| *t > stop) else { return Ok(f64::NAN) };
    let mut most: f64 = 0.0;
    for (name, factor) in
        [("drive_angle", machine.pulley_radius), ("cart_position", 1.0), ("idler_angle", machine.pulley_radius)]
    {
        let values = &solution.trajectory.get(name).unwrap_or_default()[first..];
        most = values.iter().map(|v| factor * (v - values[0]).abs()).fold(most, f64::max);
    }
    Ok(most)
}

/// Friction shared otherwise among the bodies, with the same totals.
pub struct Sharing {
    /// Who carries what.
    pub name: &'static str,
    /// Largest difference in r φ₁ to Table 4 at 5 and 10 V, m.
    pub difference: [f64; 2],
    /// Differences after both totals were adjusted so that the final positions agree, m.
    pub adjusted: [f64; 2],
    /// By how much the totals had to change, relative: viscous, Coulomb.
    pub adjustment: [f64; 2],
}

/// The limits of position data of the motor (P7), and the effect of the gear (P3).
pub struct Identifiability {
    /// The factor on everything.
    pub factor: f64,
    /// Largest difference that it makes in r φ₁, m.
    pub scaled: f64,
    /// Other shares of the friction.
    pub sharing: Vec<Sharing>,
    /// One count of the encoder, before the gear and in quadrature, as motion of the belt, m.
    pub count: f64,
    /// B₁ + B₂ + b r² + K_t K_e/R of Table 4, N m s.
    pub total_viscous: f64,
    /// τ_c1 + τ_c2 + r F_c of Table 4, N m.
    pub total_coulomb: f64,
    /// Final positions of Table 4 at 5 and 10 V with the gear of 5.9 : 1 in the equations, m.
    pub geared: [f64; 2],
    /// Voltage that the drive pulley alone needs to start, and the whole axis, V (Table 4).
    pub breakaway: (f64, f64),
    /// Motion of r φ₁ in 1 s under 98 % of the former, m.
    pub below_breakaway: f64,
}

impl Identifiability {
    /// Computes it.
    pub fn new(sets: &Sets, runs: &Runs) -> Result<Self> {
        const FACTOR: f64 = 3.7;
        let machine = &sets.table4.machine;
        let r = machine.pulley_radius;
        let mut scaled: f64 = 0.0;
        for (volts, base) in VOLTS.into_iter().zip(&runs.table4) {
            scaled = scaled.max(respond(&scale_everything(machine, FACTOR), volts)?.position_distance(base));
        }
        let law = |f: &Friction| (f.forward.viscous, f.forward.coulomb);
        let ((b1, t1), (b, fc), (b2, t2)) =
            (law(&machine.drive_pulley.friction), law(&machine.cart.friction), law(&machine.idler_pulley.friction));
        let (viscous, coulomb) = (b1 + b2 + b * r * r, t1 + t2 + r * fc);
        let motor = &machine.drives[0].motor;
        // Shares of drive pulley, cart and idler pulley in the two totals.
        let shares: [(&'static str, [f64; 3], [f64; 3]); 3] = [
            ("viscous friction at the cart alone", [0.0, 1.0, 0.0], [t1 / coulomb, r * fc / coulomb, t2 / coulomb]),
            ("viscous friction at the pulleys alone", [0.5, 0.0, 0.5], [t1 / coulomb, r * fc / coulomb, t2 / coulomb]),
            ("all friction at the cart", [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]),
        ];
        let sharing = shares
            .into_par_iter()
            .map(|(name, v, c)| sharing(name, machine, runs, (viscous, v), (coulomb, c)))
            .collect::<Result<_>>()?;
        let mut gear = machine.clone();
        gear.drives[0].motor.gear_ratio = 5.9;
        let start = t1 * motor.resistance / motor.torque_constant;
        let below = respond_to_step(machine, 0.98 * start)?;
        Ok(Self {
            factor: FACTOR,
            scaled,
            sharing,
            count: 2.0 * std::f64::consts::PI * r / (4.0 * 512.0 * 5.9),
            total_viscous: viscous + motor.torque_constant * motor.back_emf_constant / motor.resistance,
            total_coulomb: coulomb,
            geared: [respond(&gear, VOLTS[0])?.final_position(), respond(&gear, VOLTS[1])?.final_position()],
            breakaway: (start, coulomb * motor.resistance / motor.torque_constant),
            below_breakaway: below,
        })
    }
}

/// How far r φ₁ gets in 1 s under a constant voltage, m.
fn respond_to_step(machine: &Machine, volts: f64) -> Result<f64> {
    let mut experiment = pulse(volts, EVERY);
    experiment.inputs[0] = taut::signal::Signal::Step { value: volts, at: 0.0 };
    let response = run(machine, &experiment, Solver::Exact)?;
    Ok(response.position.iter().map(|x| x.abs()).fold(0.0, f64::max))
}

fn sharing(
    name: &'static str,
    machine: &Machine,
    runs: &Runs,
    (viscous, v): (f64, [f64; 3]),
    (coulomb, c): (f64, [f64; 3]),
) -> Result<Sharing> {
    let r = machine.pulley_radius;
    let shared = |p: f64, q: f64| {
        let mut machine = machine.clone();
        // At the cart a torque T is a force T/r, and B a coefficient B/r².
        let arm = [1.0, r, 1.0];
        for (i, law) in frictions(&mut machine).into_iter().enumerate() {
            *law = Friction::symmetric(p * viscous * v[i] / (arm[i] * arm[i]), q * coulomb * c[i] / arm[i]);
        }
        machine
    };
    let respond_both = |p: f64, q: f64| -> Result<[Response; 2]> {
        Ok([respond(&shared(p, q), VOLTS[0])?, respond(&shared(p, q), VOLTS[1])?])
    };
    let apart = |a: &[Response; 2]| [a[0].position_distance(&runs.table4[0]), a[1].position_distance(&runs.table4[1])];
    let miss = |a: &[Response; 2]| [0, 1].map(|i| a[i].final_position() - runs.table4[i].final_position());
    let plain = respond_both(1.0, 1.0)?;
    let difference = apart(&plain);
    // Newton's method on the two totals, with the two final positions as its goal.
    let (mut p, mut q, mut now) = (1.0, 1.0, plain);
    for _ in 0..4 {
        const H: f64 = 1e-4;
        let [e1, e2] = miss(&now);
        let ([a1, a2], [b1, b2]) = (miss(&respond_both(p + H, q)?), miss(&respond_both(p, q + H)?));
        let (a1, a2, b1, b2) = ((a1 - e1) / H, (a2 - e2) / H, (b1 - e1) / H, (b2 - e2) / H);
        let determinant = a1 * b2 - a2 * b1;
        p -= (e1 * b2 - e2 * b1) / determinant;
        q -= (a1 * e2 - a2 * e1) / determinant;
        now = respond_both(p, q)?;
    }
    Ok(Sharing { name, difference, adjusted: apart(&now), adjustment: [p - 1.0, q - 1.0] })
}

/// The linear set against both voltages (P9).
pub struct Matched {
    /// Table 2 over Table 4, final position, minus one: 5 V and 10 V.
    pub final_position: [f64; 2],
    /// Differences of the speed at 0.24 s.
    pub speed: [f64; 2],
    /// Final position at 10 V over that at 5 V: Table 2, Table 4.
    pub ratio: (f64, f64),
    /// A linear response scaled to Table 4 at 5 V, at 10 V against Table 4, minus one.
    pub scaled_to_5: f64,
    /// A linear response scaled to Table 4 at 10 V, at 5 V against Table 4, minus one.
    pub scaled_to_10: f64,
    /// Table 1 over Table 4, final position, minus one: 5 V and 10 V.
    pub table1: [f64; 2],
}

impl Matched {
    /// Computes it.
    pub fn new(runs: &Runs) -> Self {
        let ratio = |a: &[Response; 2]| a[1].final_position() / a[0].final_position();
        let at = |r: &Response| r.speed[r.row(PULSE - 0.01)];
        let (linear, dry) = (ratio(&runs.table2), ratio(&runs.table4));
        let over =
            |a: &[Response; 2], f: &dyn Fn(&Response) -> f64| [0, 1].map(|i| f(&a[i]) / f(&runs.table4[i]) - 1.0);
        Self {
            final_position: over(&runs.table2, &Response::final_position),
            speed: over(&runs.table2, &at),
            ratio: (linear, dry),
            scaled_to_5: linear / dry - 1.0,
            scaled_to_10: dry / linear - 1.0,
            table1: over(&runs.table1, &Response::final_position),
        }
    }
}
