//! The structures as programs: [`crate::control`]'s PID, cascade, state feedback, sliding mode and fuzzy controllers,
//! operation by operation.

use super::Target;
use super::forward::Forward;
use crate::control::model::{Linear, Quantity};
use crate::control::state_feedback::{Law, StateFeedbackState};
use crate::design::{Cascade, Design, Fuzzy, Pid, SlidingMode, Structure};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::machine::axis::{CART, IDLER};
use crate::program::{Expr, Program, Relation, Test, number, variable};
use std::f64::consts::PI;

/// Samples that a command of a state feedback may wait for.
const MOST_PENDING: usize = 64;

/// The structure of a controller.
pub(super) enum Core<'d> {
    Pid(&'d Pid, f64),
    Cascade(&'d Cascade, f64),
    StateFeedback(Box<Law>, Vec<Quantity>, f64),
    SlidingMode(&'d SlidingMode, f64, Mass),
    Fuzzy(&'d Fuzzy, f64),
}

/// The axis as one mass, as far as sliding mode knows it.
pub(super) struct Mass {
    mass: f64,
    force_per_command: f64,
}

impl<'d> Core<'d> {
    pub(super) fn new(design: &'d Design, model: &Machine) -> Result<Self> {
        let every = design.every;
        Ok(match &design.structure {
            Structure::Pid(gains) => Core::Pid(gains, every),
            Structure::Cascade(gains) => Core::Cascade(gains, every),
            Structure::StateFeedback(weights) => {
                let law = StateFeedbackState::new(weights, model, design)?.law().clone();
                if law.pending > MOST_PENDING {
                    return Err(Error::new(format!("this controller keeps {} commands under way", law.pending))
                        .allowed(format!("up to {MOST_PENDING}"))
                        .next("take a longer sample time, or a shorter delay"));
                }
                Core::StateFeedback(Box::new(law), Linear::of(model).states, model.pulley_radius)
            }
            Structure::SlidingMode(gains) => {
                let rigid = crate::machine::rigid::Rigid::of(model);
                let mass = Mass { mass: rigid.mass, force_per_command: rigid.force_per_command() };
                Core::SlidingMode(gains, every, mass)
            }
            Structure::Fuzzy(rules) => Core::Fuzzy(rules, every),
        })
    }

    pub(super) fn name(&self) -> &'static str {
        match self {
            Core::Pid(..) => "PID",
            Core::Cascade(..) => "position loop around speed loop",
            Core::StateFeedback(..) => "feedback of the states that a Kalman filter estimates",
            Core::SlidingMode(..) => "sliding mode with a boundary layer",
            Core::Fuzzy(..) => "table of rules",
        }
    }

    /// The next command beside feed-forward, of which it may take a part into itself.
    pub(super) fn step(
        &mut self,
        p: &mut Program,
        forward: &Forward,
        (now, target, ahead): (&Target, &Target, &Target),
        (position, current): (&Expr, &Expr),
        added: &mut Expr,
    ) -> Expr {
        match self {
            Core::Pid(gains, every) => pid(p, gains, *every, target, position),
            Core::Cascade(gains, every) => {
                let mut inner = number(0.0);
                if gains.current.is_some() {
                    (inner, *added) = split(p, forward, ahead, added.clone());
                }
                cascade(p, gains, *every, target, (position, current), inner)
            }
            Core::StateFeedback(law, states, radius) => {
                state_feedback(p, law, (states, *radius), forward, now, position)
            }
            Core::SlidingMode(gains, every, mass) => sliding(p, gains, *every, mass, target, position),
            Core::Fuzzy(rules, every) => fuzzy(p, rules, *every, target, position),
        }
    }

    /// The command that the limit left.
    pub(super) fn limited(&mut self, p: &mut Program, excess: &Expr, effective: &Expr) {
        match self {
            Core::Pid(gains, every) => {
                // Back-calculation: the integral follows what the limit leaves.
                if gains.integral != 0.0 {
                    let share = (*every / gains.tracking).min(1.0);
                    p.set("integral", variable("integral") + share * excess);
                }
            }
            Core::Cascade(gains, every) => {
                let share = p.local("share", (*every / gains.tracking).min(1.0) * excess);
                let push = |p: &mut Program, change: Expr| {
                    if gains.speed_integral != 0.0 {
                        p.set("speed_integral", variable("speed_integral") + change);
                    }
                };
                let Some(inner) = gains.current else { return push(p, share) };
                if inner.integral != 0.0 {
                    p.set("current_integral", variable("current_integral") + share.clone());
                }
                if inner.proportional != 0.0 {
                    push(p, share / inner.proportional);
                }
            }
            Core::StateFeedback(law, ..) => state_feedback_limited(p, law, excess, effective),
            Core::SlidingMode(gains, every, mass) => {
                if gains.integral > 0.0 {
                    let gain = gains.integral * gains.reaching / gains.boundary;
                    let force = excess.clone() * mass.force_per_command / mass.mass;
                    let change = (gains.bandwidth * *every).min(1.0) * force / gain;
                    // Without an excess it adds zero.
                    p.set("integral", variable("integral") + change);
                }
            }
            Core::Fuzzy(rules, _) => {
                if rules.incremental {
                    p.set("so_far", variable("so_far") + excess.clone());
                }
            }
        }
    }
}

fn pid(p: &mut Program, gains: &Pid, every: f64, target: &Target, position: &Expr) -> Expr {
    let &Pid { proportional, integral, derivative, filter, reference_speed: c, .. } = gains;
    p.state("integral", 0.0, "integral of the error, as a command");
    p.state("slope", 0.0, "filtered derivative, m/s");
    p.state("last", 0.0, "what was differentiated at the last sample, m");
    p.state("has_last", 0.0, "1 once there is one");
    let error = p.local("error", &target.position - position);
    // T_f ḋ + d = c ẏ* − ẏ by backward differences
    let time = 1.0 / (2.0 * PI * filter);
    let weighed = match c {
        0.0 => -position.clone(),
        c => c * &target.position - position.clone(),
    };
    let weighed = p.local("weighed", weighed);
    first(p, "has_last", "last", &weighed);
    let change = p.local("change", weighed.clone() - variable("last"));
    p.set("slope", (time * variable("slope") + change) / (time + every));
    p.set("last", weighed);
    p.set("integral", variable("integral") + integral * every * &error);
    proportional * &error + variable("integral") + derivative * variable("slope")
}

/// At the first sample what is kept is what is there.
fn first(p: &mut Program, has: &str, last: &str, now: &Expr) {
    p.when(
        Test(Relation::Less, variable(has), number(0.5)),
        |p| {
            p.set(has, number(1.0));
            p.set(last, now.clone());
        },
        |_| {},
    );
}

/// Speed from a measured position: differences through a filter of first order.
fn speed(p: &mut Program, every: f64, filter: f64, position: &Expr) -> Expr {
    p.state("speed", 0.0, "filtered speed, m/s");
    p.state("last", 0.0, "position at the last sample, m");
    p.state("has_last", 0.0, "1 once there is one");
    let keep = (-2.0 * PI * filter * every).exp();
    first(p, "has_last", "last", position);
    let difference = p.local("difference", (position - &variable("last")) / every);
    p.set("last", position.clone());
    p.set("speed", keep * variable("speed") + (1.0 - keep) * difference);
    variable("speed")
}

/// The part of a voltage fed forward that goes into the current loop, and the rest of it.
fn split(p: &mut Program, forward: &Forward, ahead: &Target, added: Expr) -> (Expr, Expr) {
    if added.known() == Some(0.0) {
        return (number(0.0), number(0.0));
    }
    let back = forward.command_of(p, "back", number(0.0), number(0.0), ahead.speed.clone());
    let back = p.local("back_emf", back);
    let zero = |p: &mut Program, set: &mut dyn FnMut(&mut Program)| {
        // Feed-forward of nothing has no part for the speed.
        let more = Test(Relation::More, added.clone(), number(0.0));
        let less = Test(Relation::Less, added.clone(), number(0.0));
        p.when(more, |_| {}, |p| p.when(less, |_| {}, |p| set(p)));
    };
    let kept = p.declare("back_kept");
    p.set("back_kept", back);
    zero(p, &mut |p| p.set("back_kept", number(0.0)));
    let rest = added - kept.clone();
    let rigid = &forward.rigid;
    let inner = p.local("inner", rest * rigid.force_per_command() / rigid.force_per_ampere);
    (inner, kept)
}

fn cascade(
    p: &mut Program,
    gains: &Cascade,
    every: f64,
    target: &Target,
    (position, current): (&Expr, &Expr),
    forward: Expr,
) -> Expr {
    p.state("speed_integral", 0.0, "integral of the speed loop");
    let speed = speed(p, every, gains.filter, position);
    // v* = K_v (y* − y) + c ẏ*
    let wanted = match gains.reference_speed {
        0.0 => gains.position * (&target.position - position),
        c => gains.position * (&target.position - position) + c * &target.speed,
    };
    let error = p.local("error", wanted - speed);
    p.set("speed_integral", variable("speed_integral") + gains.speed_integral * every * &error);
    let output = gains.speed * &error + variable("speed_integral");
    let Some(inner) = gains.current else { return output };
    p.state("current_integral", 0.0, "integral of the current loop, V");
    let asked = p.local("current_asked", output + forward);
    let held = match inner.limit {
        None => asked.clone(),
        Some(limit) => p.within("current_held", asked.clone(), -limit, limit),
    };
    if gains.speed_integral != 0.0 {
        let share = (every / gains.tracking).min(1.0);
        p.set("speed_integral", variable("speed_integral") + share * (held.clone() - asked));
    }
    let error = p.local("current_error", held - current.clone());
    p.set("current_integral", variable("current_integral") + inner.integral * every * &error);
    inner.proportional * &error + variable("current_integral")
}

/// Σ of products, none for weights of zero; the order is that of a dot product of nalgebra.
fn dot(weights: &[f64], of: impl Fn(usize) -> Expr) -> Expr {
    let product = |i: usize| (weights[i] != 0.0).then(|| weights[i] * of(i));
    let plus = |a: Option<Expr>, b: Option<Expr>| match (a, b) {
        (Some(a), Some(b)) => Some(a + b),
        (a, b) => a.or(b),
    };
    let whole = weights.len() / 8 * 8;
    // Eight sums side by side, then what is left.
    let mut lanes: [Option<Expr>; 8] = std::array::from_fn(|_| None);
    for i in 0..whole {
        lanes[i % 8] = plus(lanes[i % 8].take(), product(i));
    }
    let mut sum = None;
    for k in 0..4 {
        let pair = plus(lanes[k].take(), lanes[k + 4].take());
        sum = plus(sum, pair);
    }
    for i in whole..weights.len() {
        sum = plus(sum, product(i));
    }
    sum.unwrap_or_else(|| number(0.0))
}

fn state_feedback(
    p: &mut Program,
    law: &Law,
    (states, r): (&[Quantity], f64),
    forward: &Forward,
    reference: &Target,
    position: &Expr,
) -> Expr {
    let n = states.len();
    let needed = forward.needed(p, "needed", reference);
    let current = p.local("needed_current", &needed.force[0] / &number(forward.rigid.force_per_ampere));
    let wanted: Vec<Expr> = states
        .iter()
        .enumerate()
        .map(|(i, state)| {
            let value = match state {
                Quantity::Position(CART) => reference.position.clone(),
                Quantity::Speed(CART) => reference.speed.clone(),
                Quantity::Position(IDLER) => needed.idler[0].clone() / r,
                Quantity::Speed(IDLER) => needed.idler[1].clone() / r,
                Quantity::Position(_) => needed.drive.position.clone() / r,
                Quantity::Speed(_) => needed.drive.speed.clone() / r,
                Quantity::Current => current.clone(),
            };
            p.local(&format!("wanted{i}"), value)
        })
        .collect();
    let estimate: Vec<Expr> = (0..n).map(|i| p.state(&format!("estimate{i}"), 0.0, "estimated state")).collect();
    p.state("started", 0.0, "1 once the filter has begun");
    p.when(
        Test(Relation::Less, variable("started"), number(0.5)),
        |p| {
            p.set("started", number(1.0));
            for (i, state) in states.iter().enumerate() {
                let value = match state {
                    Quantity::Position(CART) => position.clone(),
                    Quantity::Position(_) => position.clone() / r,
                    Quantity::Speed(_) | Quantity::Current => number(0.0),
                };
                p.set(&format!("estimate{i}"), value);
            }
        },
        |_| {},
    );
    let measured: Vec<f64> = law.sensors[0].measured.iter().copied().collect();
    let surprise = p.local("innovation", position.clone() - dot(&measured, |i| estimate[i].clone()));
    for (i, estimate) in estimate.iter().enumerate().take(n) {
        p.set(&format!("estimate{i}"), surprise.clone() * law.sensors[0].kalman[i] + estimate.clone());
    }
    let mut command = number(0.0);
    for i in 0..n {
        let term = law.gain[i] * (estimate[i].clone() - wanted[i].clone());
        // A sum that begins with nothing is the negative of its first term.
        command = if i == 0 { -term } else { command - term };
    }
    for i in 0..law.pending {
        let own = p.state(&format!("own{i}"), 0.0, "a command under way");
        command = command - law.gain[n + i] * &own;
    }
    if law.has_integral {
        let integral = p.state("integral", 0.0, "integral of the measured error, m s");
        p.state("integrated", 0.0, "its last part");
        command = command - law.gain[n + law.pending] * &integral;
        let error = position.clone() - dot(&measured, |i| wanted[i].clone());
        let command = p.local("fed_back", command);
        p.set("integrated", law.every * error);
        p.set("integral", integral + variable("integrated"));
        return command;
    }
    p.local("fed_back", command)
}

fn state_feedback_limited(p: &mut Program, law: &Law, excess: &Expr, effective: &Expr) {
    let n = law.phi.nrows();
    if law.has_integral {
        // What has no effect is not gathered.
        let back = |p: &mut Program| p.set("integral", variable("integral") - variable("integrated"));
        p.when(Test(Relation::More, excess.clone(), number(0.0)), back, |p| {
            p.when(Test(Relation::Less, excess.clone(), number(0.0)), back, |_| {})
        });
    }
    for i in (1..law.pending).rev() {
        p.set(&format!("own{i}"), variable(&format!("own{}", i - 1)));
    }
    if law.pending > 0 {
        p.set("own0", variable("fed_back") + excess.clone());
    }
    let given: Vec<Expr> =
        (0..=law.pending).map(|i| p.state(&format!("given{i}"), 0.0, "a command as the axis got it")).collect();
    for i in (1..=law.pending).rev() {
        p.set(&format!("given{i}"), given[i - 1].clone());
    }
    p.set("given0", effective.clone());
    // x⁺ = Φ x + Γ₀ u_{k−d} + e^{A(T−ρ)} Γ(ρ) u_{k−d−1}
    for i in 0..n {
        let product = (1..n).fold(law.phi[(i, 0)] * &variable("estimate0"), |sum, j| {
            law.phi[(i, j)] * &variable(&format!("estimate{j}")) + sum
        });
        let mut next = given[law.lag()].clone() * law.now[i] + product;
        if law.lag() < law.pending {
            next = given[law.lag() + 1].clone() * law.before[i] + next;
        }
        p.local(&format!("estimated{i}"), next);
    }
    for i in 0..n {
        p.set(&format!("estimate{i}"), variable(&format!("estimated{i}")));
    }
}

fn sliding(p: &mut Program, gains: &SlidingMode, every: f64, mass: &Mass, target: &Target, position: &Expr) -> Expr {
    let &SlidingMode { bandwidth, reaching, boundary, integral, filter } = gains;
    p.state("integral", 0.0, "integral of the error, m s");
    let error = p.local("error", &target.position - position);
    let speed = speed(p, every, filter, position);
    let rate = p.local("rate", &target.speed - &speed);
    p.set("integral", variable("integral") + every * &error);
    let sigma = match integral {
        0.0 => rate.clone() + bandwidth * &error,
        integral => rate.clone() + bandwidth * &error + integral * variable("integral"),
    };
    // M (λ ė + κ e + K sat(σ/Φ))
    let layer = p.within("layer", sigma / boundary, -1.0, 1.0);
    let acceleration = match integral {
        0.0 => bandwidth * &rate + reaching * layer,
        integral => bandwidth * &rate + integral * &error + reaching * layer,
    };
    mass.mass * acceleration / mass.force_per_command
}

fn fuzzy(p: &mut Program, rules: &Fuzzy, every: f64, target: &Target, position: &Expr) -> Expr {
    let error = p.local("error", &target.position - position);
    let speed = speed(p, every, rules.filter, position);
    let rate = p.local("rate", &target.speed - &speed);
    let size = rules.rules.len();
    let place = |p: &mut Program, name: &str, value: Expr| {
        let within = p.within(&format!("{name}_within"), value, -1.0, 1.0);
        let place = p.local(&format!("{name}_place"), 0.5 * (within + 1.0) * (size.max(2) - 1) as f64);
        p.declare(&format!("{name}_set"));
        let set = place.clone().whole();
        let set = p.within(&format!("{name}_set"), set, 0.0, size.saturating_sub(2) as f64);
        let share = p.local(&format!("{name}_share"), place - set.clone());
        (set, share)
    };
    let (i, a) = place(p, "error", error / rules.error);
    let (j, b) = place(p, "rate", rate / rules.rate);
    // The four rules around: by comparison, for there are no tables.
    let corners = ["low_low", "low_high", "high_low", "high_high"];
    for name in corners {
        p.declare(name);
        p.set(name, number(0.0));
    }
    for row in 0..size - 1 {
        let is = |at: &Expr, k: usize| Test(Relation::AtLeast, at.clone(), number(k as f64 - 0.25));
        p.when(
            is(&i, row),
            |p| {
                for column in 0..size - 1 {
                    p.when(
                        is(&j, column),
                        |p| {
                            for (name, (di, dj)) in corners.iter().zip([(0, 0), (0, 1), (1, 0), (1, 1)]) {
                                p.set(name, number(rules.rules[row + di][column + dj]));
                            }
                        },
                        |_| {},
                    );
                }
            },
            |_| {},
        );
    }
    let [ll, lh, hl, hh] = corners.map(variable);
    let low = p.local("low", (1.0 - &a) * ((1.0 - &b) * ll + &b * &lh));
    let high = p.local("high", &a * &((1.0 - &b) * hl + &b * &hh));
    let value = p.local("value", rules.command * (low + high));
    if rules.incremental {
        p.state("so_far", 0.0, "the command so far");
        p.set("so_far", variable("so_far") + every * value);
        variable("so_far")
    } else {
        value
    }
}
