//! A part of a run, computed again at a finer interval.

use crate::Context;
use crate::case::{chosen, opened, runnable};
use crate::curves::{Kept, panels};
use crate::message::{Reply, Request};
use serde_json::json;
use taut::error::{Error, Result};
use taut::mechanism::{Mechanism, State};
use taut::signal::Signal;
use taut::solve::{Flow, Simulator, Solver};

/// Points of a section at most.
const POINTS: f64 = 10_001.0;

/// The shortest section, as a part of the time that it ends at: doubles tell apart a few of their last digits more.
const SHORTEST: f64 = 1e-12;

/// Rows from `from` to `to`, s, so many as `points` says.
pub fn section(request: &Request, context: &Context) -> Result<Reply> {
    let case = opened(request, context)?;
    runnable(&case)?;
    let number = |key: &str| request.number(key).ok_or_else(|| Error::new(format!("a section needs a number `{key}`")));
    let (from, to) = (number("from")?.max(0.0), number("to")?);
    let points = request.number("points").unwrap_or(1001.0).clamp(2.0, POINTS) as usize;
    let experiment = &case.experiments[chosen(request, case.experiments.len())?];
    let (mechanism, until) = (case.machine.mechanism(), experiment.until);
    let start = mechanism.begun(&experiment.initial);
    let to = to.min(until);
    if to - from <= SHORTEST * to {
        let error = Error::new(format!("a section from {from} s to {to} s holds nothing"));
        return Err(error.allowed(format!("within 0 s and {until} s, the end above the start")));
    }
    let mut kept = Kept::new(&panels(&case, &mechanism.columns));
    let window = Window { from, to, points };
    rows(&mechanism, (&experiment.inputs, &start), (&window, experiment.every), &mut kept, context)?;
    let mut reply = Reply::new(json!({ "from": from, "to": to, "columns": kept.told() }));
    reply.columns = kept.columns;
    Ok(reply)
}

/// Intervals between two looks whether anybody still waits.
const BETWEEN_LOOKS: f64 = 4096.0;

struct Window {
    from: f64,
    to: f64,
    points: usize,
}

impl Window {
    /// The interval that steps are computed fastest for, s: that of the rows, doubled until it is about that of the
    /// run, so that the way to the window takes no more steps than the run does.
    fn interval(&self, every: f64) -> f64 {
        let own = (self.to - self.from) / (self.points - 1) as f64;
        own * (every / own).log2().ceil().max(0.0).exp2()
    }

    fn time(&self, k: usize) -> f64 {
        let share = k as f64 / (self.points - 1) as f64;
        if k + 1 == self.points { self.to } else { self.from + share * (self.to - self.from) }
    }
}

/// Steps a machine along its inputs to the window, and through it.
fn rows(
    mechanism: &Mechanism,
    (inputs, start): (&[Signal], &State),
    (window, every): (&Window, f64),
    kept: &mut Kept,
    context: &Context,
) -> Result<()> {
    let interval = window.interval(every);
    let mut machine = Simulator::of_mechanism(mechanism, start, Solver::of_mechanism(mechanism), interval)?;
    let headings = mechanism.columns.clone();
    let (mut row, mut next) = (vec![0.0; headings.len()], 0);
    while context.flow() == Flow::Continue {
        let mut end = f64::INFINITY;
        for (drive, input) in inputs.iter().enumerate() {
            let piece = input.piece(machine.time());
            end = end.min(piece.end);
            machine.set_input(drive, &piece)?;
        }
        while window.time(next) < end || next + 1 == window.points && window.time(next) <= end {
            // An early end leaves what there is.
            if !advance(&mut machine, window.time(next), interval, context) {
                return Ok(());
            }
            machine.outputs(&mut row);
            kept.take_row(&headings, &row);
            next += 1;
            if next == window.points {
                return Ok(());
            }
        }
        if !advance(&mut machine, end, interval, context) {
            return Ok(());
        }
    }
    Ok(())
}

/// Goes on to `until`, and looks from time to time whether anybody still waits; false where it ended before.
fn advance(machine: &mut Simulator, until: f64, interval: f64, context: &Context) -> bool {
    let mut events = Vec::new();
    while context.flow() == Flow::Continue {
        let next = until.min(machine.time() + BETWEEN_LOOKS * interval);
        if machine.advance(next, &mut events).is_err() {
            return false;
        }
        // Far out, a step may be less than what doubles tell apart.
        if next >= until || machine.time() >= until {
            return true;
        }
        events.clear();
    }
    false
}
