//! The controller of a design as a program: the operations of [`crate::control`] in their order, so that it gives the
//! same bits.

mod forward;
mod structure;

use super::program::{Expr, Program, Relation, Test, number, variable};
use crate::control::filter::Biquad;
use crate::control::observer::DisturbanceState;
use crate::control::{Standard, reads_scale};
use crate::design::{Design, Filter};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::machine::rigid::Rigid;
use forward::Forward;
use structure::Core;

/// Position of the cart's reference and its derivatives, as variables of one name.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub position: Expr,
    pub speed: Expr,
    pub acceleration: Expr,
    pub jerk: Expr,
    pub snap: Expr,
}

/// The derivatives of a reference, as names end.
pub(super) const DERIVATIVES: [(&str, &str); 5] =
    [("position", "m"), ("speed", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3"), ("snap", "m/s^4")];

impl Target {
    fn input(program: &mut Program, name: &str, about: &str) -> Self {
        let [position, speed, acceleration, jerk, snap] = DERIVATIVES
            .map(|(derivative, unit)| program.input(&format!("{name}_{derivative}"), &format!("{about}, {unit}")));
        Self { position, speed, acceleration, jerk, snap }
    }
}

/// The program of a design for a model of the axis. Errors: what no controller can be.
pub(super) fn program(design: &Design, model: &Machine) -> Result<Program> {
    // Designs that `taut move` refuses are refused here.
    Standard::new(design, model)?;
    if reads_scale(design, model) {
        return Err(Error::new("this controller reads the scale beside the encoder, which programs have no input for")
            .next("export it without [scale], or take the FMU, which has both sensors"));
    }
    let mut p = Program::default();
    let now = Target::input(&mut p, "now", "where the cart should be at this sample");
    let ahead = Target::input(&mut p, "ahead", "where it should be when the command acts");
    let position = p.input("measured", "measured position along the belt, m");
    let current = p.input("current", "measured motor current, A");
    let forward = Forward::new(model, design);
    let mut core = Core::new(design, model)?;

    p.remark("where the encoder should be, and what the reference asks for by itself");
    let target = forward.target(&mut p, &now);
    let mut added = forward.command(&mut p, "forward", &ahead);
    p.remark(core.name());
    let own = core.step(&mut p, &forward, (&now, &target, &ahead), (&position, &current), &mut added);
    let own = filters(&mut p, design, own);
    let disturbance = observer(&mut p, design, model)?;
    // asked = own + forward − disturbance
    let asked = p.declare("asked");
    p.set("asked", own + added - disturbance.as_ref().map_or(number(0.0), |_| variable("disturbance")));
    p.remark("what is no number asks for nothing; then the limit");
    let given = p.declare("given");
    p.set("given", number(0.0));
    p.when(
        Test(Relation::AtLeast, asked.clone(), number(-f64::from(f32::MAX))),
        |p| {
            p.when(
                Test(Relation::More, asked.clone(), number(f64::from(f32::MAX))),
                |_| {},
                |p| p.set("given", asked.clone()),
            );
        },
        |_| {},
    );
    if let Some(limit) = design.limit {
        p.within("given", variable("given"), -limit, limit);
    }
    p.remark("what the limit has left");
    let excess = p.local("excess", given.clone() - asked);
    let dry = forward.dry(&mut p, &ahead);
    let effective = p.local("effective", given.clone() - dry);
    core.limited(&mut p, &excess, &effective);
    if let Some(state) = disturbance {
        state.step(&mut p, &position, &effective);
    }
    p.finish("given").map_err(|value| {
        Error::new(format!("a constant of this controller is {value}, which no program can hold"))
            .next("give the belt a stiffness that is finite, or take a simpler feed-forward")
    })
}

/// The filters on what the structure gives.
fn filters(p: &mut Program, design: &Design, own: Expr) -> Expr {
    let mut value = own;
    for (index, filter) in design.filters.iter().enumerate() {
        let (b, a) = Biquad::new(filter, design.every).coefficients();
        let what = match filter {
            Filter::Notch { .. } => "notch",
            Filter::LowPass { .. } => "low-pass",
        };
        let names = [0, 1].map(|k| format!("filter{index}_{k}"));
        let state = [0, 1].map(|k| p.state(&names[k], 0.0, &format!("of the {what}")));
        let input = p.local(&format!("unfiltered{index}"), value);
        // Transposed direct form II.
        let output = p.local(&format!("filtered{index}"), b[0] * &input + state[0].clone());
        p.set(&names[0], b[1] * &input - a[0] * &output + state[1].clone());
        p.set(&names[1], b[2] * &input - a[1] * &output);
        value = output;
    }
    value
}

/// The disturbance observer with its states.
struct Observer {
    a: [[f64; 3]; 3],
    b: [f64; 3],
    gain: [f64; 3],
}

const OBSERVED: [&str; 3] = ["observed_position", "observed_speed", "observed_disturbance"];

fn observer(p: &mut Program, design: &Design, model: &Machine) -> Result<Option<Observer>> {
    let Some(observer) = design.disturbance_observer else { return Ok(None) };
    let state = DisturbanceState::new(observer.bandwidth, &Rigid::of(model), design.every)
        .ok_or_else(|| Error::new("a disturbance observer cannot be made for this axis and sample time"))?;
    let (a, b, gain) = state.matrices();
    p.state("observing", 0.0, "1 once the observer has begun");
    for (name, about) in OBSERVED.iter().zip(["m", "m/s", "as a command"]) {
        p.state(name, 0.0, about);
    }
    // Before the first sample nothing is observed.
    p.declare("disturbance");
    p.set("disturbance", number(0.0));
    p.when(
        Test(Relation::More, variable("observing"), number(0.5)),
        |p| p.set("disturbance", variable(OBSERVED[2])),
        |_| {},
    );
    Ok(Some(Observer { a, b, gain }))
}

impl Observer {
    /// Takes a measured position and the command that acts from there on.
    fn step(&self, p: &mut Program, position: &Expr, command: &Expr) {
        p.when(
            Test(Relation::Less, variable("observing"), number(0.5)),
            |p| {
                p.set("observing", number(1.0));
                p.set(OBSERVED[0], position.clone());
                p.set(OBSERVED[1], number(0.0));
                p.set(OBSERVED[2], number(0.0));
            },
            |_| {},
        );
        let surprise = p.local("surprise", position.clone() - variable(OBSERVED[0]));
        // s⁺ = A s + b u + L (y − s₁)
        let next: Vec<Expr> = (0..3)
            .map(|i| {
                let product = (1..3)
                    .fold(self.a[i][0] * variable(OBSERVED[0]), |sum, j| self.a[i][j] * variable(OBSERVED[j]) + sum);
                product + command.clone() * self.b[i] + surprise.clone() * self.gain[i]
            })
            .collect();
        for (i, next) in next.into_iter().enumerate() {
            p.local(&format!("next{i}"), next);
        }
        for (i, name) in OBSERVED.iter().enumerate() {
            p.set(name, variable(&format!("next{i}")));
        }
    }
}
