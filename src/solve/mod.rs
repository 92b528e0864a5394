//! Runs an experiment on a stage: the choice of solver, the events, how it ended and what it cost.

use crate::friction::Motion;
use crate::trajectory::Trajectory;

/// One of the three inertias.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Body {
    /// Drive pulley, φ₁.
    DrivePulley,
    /// Cart, x.
    Cart,
    /// Idler pulley, φ₃.
    IdlerPulley,
}

/// A body that starts to slide, stops, or turns back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// When, s.
    pub time: f64,
    /// Which body.
    pub body: Body,
    /// What it did before.
    pub from: Motion,
    /// What it does after.
    pub to: Motion,
    /// The force (N) or torque (N m) on it at that moment, friction apart.
    pub load: f64,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// At the end of the experiment.
    Complete,
    /// More events than the bound allows; the time reached, s, is given.
    TooManyEvents {
        /// Time reached, s.
        time: f64,
        /// Events so far.
        events: usize,
    },
    /// A state became infinite or not a number; the time reached, s, is given.
    Diverged {
        /// Time reached, s.
        time: f64,
    },
    /// The receiver of the results asked to stop.
    Interrupted {
        /// Time reached, s.
        time: f64,
    },
}

/// What a run cost, in pieces of work rather than seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cost {
    /// Rows put out.
    pub samples: u64,
    /// Events handled.
    pub events: u64,
    /// Pieces of the input.
    pub pieces: u64,
    /// Propagator matrices computed (exact solver).
    pub propagators: u64,
    /// Steps taken: products of a propagator and a state, or steps of a fixed-step method.
    pub steps: u64,
    /// Evaluations of the equations of motion (fixed-step methods).
    pub evaluations: u64,
}

/// A whole run in memory.
#[derive(Debug, Clone)]
pub struct Solution {
    /// What every quantity did.
    pub trajectory: Trajectory,
    /// Every stick, slip and reversal, in order.
    pub events: Vec<Event>,
    /// How it ended.
    pub ending: Ending,
    /// What it cost.
    pub cost: Cost,
}
