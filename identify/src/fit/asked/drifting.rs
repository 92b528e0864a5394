//! A run of a machine that changes along it: part by part, each with a machine of its own, from where the one before
//! ended.

use super::run::FittedLog;
use crate::case::Experiment;
use crate::log::Quantity;
use crate::machine::Machine;
use crate::machine::axis::{CART, DRIVE, IDLER};
use crate::mechanism::State;
use crate::signal::{Hold, Signal};
use crate::solve::{Bench, Detail, Ending, Flow};
use crate::trajectory::Trajectory;

/// Columns of the state: position and speed of each body.
const STATE: [&str; 6] = ["drive_angle", "drive_speed", "cart_position", "cart_speed", "idler_angle", "idler_speed"];

/// Weighted residuals, model minus log, of machines that follow each other in equal parts of the log; false where the
/// log is not one of an open loop at even times, or a machine does not get through its part.
pub(crate) fn residuals(run: &FittedLog, stages: &[Machine], extras: &[f64], out: &mut [f64]) -> bool {
    let is_known = |seen: &Quantity| !seen.is_of_rotor() && !seen.is_acceleration();
    let quantities: Vec<Quantity> = run.seen.iter().map(|seen| seen.quantity).collect();
    if !run.is_even() || run.is_closed() || !quantities.iter().all(is_known) {
        return false;
    }
    let n = run.time.len();
    let mut columns = vec![Vec::with_capacity(n); quantities.len()];
    let mut initial = None;
    for (part, machine) in stages.iter().enumerate() {
        let at = |part: usize| (n - 1) * part / stages.len();
        let (begin, end) = (at(part), at(part + 1));
        if begin == end {
            continue;
        }
        let mut machine = machine.clone();
        let whole = run.experiment(&mut machine, extras);
        machine.encoder = None;
        let Some(input) = later(&whole.inputs[0], run.time[begin]) else { return false };
        let initial_here = initial.unwrap_or(whole.initial);
        let until = whole.every * (end - begin) as f64;
        let experiment = Experiment { inputs: vec![input], initial: initial_here, until, ..whole };
        let Some((rows, last)) = rows(&machine, &experiment, &quantities) else { return false };
        if rows[0].len() != end - begin + 1 {
            return false;
        }
        for (column, rows) in columns.iter_mut().zip(&rows) {
            column.extend_from_slice(&rows[usize::from(part > 0)..]);
        }
        initial = Some(State { current: initial_here.current, ..last });
    }
    run.compare(&columns, extras, out)
}

/// The outputs of an experiment, and the state at its end.
fn rows(machine: &Machine, experiment: &Experiment, quantities: &[Quantity]) -> Option<(Vec<Vec<f64>>, State)> {
    let mut columns = vec![Vec::new(); quantities.len()];
    let mut state = [0.0; 6];
    let mut bench = Bench::default();
    bench.mount(machine).ok()?;
    let mut take = |block: &Trajectory| {
        for (column, quantity) in columns.iter_mut().zip(quantities) {
            column.extend_from_slice(super::run::column(block, *quantity));
        }
        for (value, name) in state.iter_mut().zip(STATE) {
            *value = block.get(name).and_then(|own| own.last().copied()).unwrap_or(f64::NAN);
        }
        Flow::Continue
    };
    let outcome = bench.run(experiment, Detail::Full, &mut take).ok()?;
    let mut last = State::default();
    for body in [DRIVE, CART, IDLER] {
        (last.position[body], last.speed[body]) = (state[2 * body], state[2 * body + 1]);
    }
    (outcome.ending == Ending::Complete && state.iter().all(|v| v.is_finite())).then_some((columns, last))
}

/// A sampled input from time `from` on, s; `None` for another kind of input.
fn later(input: &Signal, from: f64) -> Option<Signal> {
    let Signal::Sampled { times, values, hold } = input else { return None };
    let first = times.partition_point(|&t| t <= from).saturating_sub(1);
    let mut own_times: Vec<f64> = times[first..].iter().map(|t| t - from).collect();
    let mut own_values = values[first..].to_vec();
    if own_times[0] < 0.0 {
        if let (Hold::Linear, [a, b, ..], [low, high, ..]) = (*hold, &own_times[..], &own_values[..]) {
            own_values[0] = low + (high - low) * (0.0 - a) / (b - a);
        }
        own_times[0] = 0.0;
    }
    Some(Signal::Sampled { times: own_times, values: own_values, hold: *hold })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sampled_input_goes_on_from_a_later_time() {
        let times = vec![0.0, 0.1, 0.25, 0.4, 0.7];
        let values = vec![1.0, -2.0, 3.0, 0.5, 4.0];
        for hold in [Hold::Zero, Hold::Linear] {
            let whole = Signal::Sampled { times: times.clone(), values: values.clone(), hold };
            for from in [0.0, 0.05, 0.1, 0.3, 0.4, 0.65] {
                let rest = later(&whole, from).unwrap();
                for after in [0.0, 0.01, 0.04, 0.11, 0.2, 0.3, 1.0] {
                    let (own, known) = (rest.value(after), whole.value(from + after));
                    assert!((own - known).abs() < 1e-9, "{hold:?} {from} {after}: {own} {known}");
                }
            }
        }
        assert!(later(&Signal::Step { value: 1.0, at: 0.0 }, 0.1).is_none());
    }
}
