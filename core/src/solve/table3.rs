//! The paper's own solver: the friction function of its Table 3 with a fixed step.
//!
//! Kept to reproduce the paper and its effect: any speed inside a band of ±0.01 is frozen rather than brought to rest,
//! so the stage creeps after a stop by an amount that depends on the step.

use super::coordinates::Coordinates;
use super::observe::{Gap, Output, QUANTITIES, Reading, Readout};
use super::record::{Recorder, STATE};
use super::{Cost, Ending, Flow, Grid, Method, Outcome};
use crate::error::{Error, Result};
use crate::friction::Motion;
use crate::machine::Machine;
use crate::machine::axis::BODIES;
use crate::mechanism::{DRIVES, Form, Layout, Mechanism, Mode, State};
use crate::plan::Experiment;
use crate::signal::Piece;
use std::sync::Arc;

/// Half-width of Table 3's band of "zero" speed, rad/s for the pulleys and m/s for the cart.
const BAND: f64 = 0.01;

/// Largest plausible value of a state, in SI units; a larger one means that the step is too long for the belt's
/// oscillation.
const BOUND: f64 = 1e9;

/// Runs the experiment with steps of `step` or a little less, so that they fill the output interval.
pub(crate) fn run(
    machine: &Machine,
    mechanism: &Arc<Mechanism>,
    experiment: &Experiment,
    step: f64,
    method: Method,
    output: Output,
) -> Result<Outcome> {
    let model = Model::new(machine, mechanism)?;
    let grid = Grid::new(experiment.every, experiment.until);
    let steps = |interval: f64| (interval / step - 1e-9).ceil().max(1.0);
    let substeps = steps(grid.interval());
    if !substeps.is_finite() || step.is_nan() || step <= 0.0 || substeps * grid.intervals() as f64 > 1e12 {
        return Err(Error::new(format!("a step of {step:e} s would take more than 1e12 steps"))
            .allowed("a step above zero, such as 1e-4 s")
            .next("choose a larger step"));
    }
    let mut state = mechanism.begun(&experiment.initial);
    let layout = Layout::new(mechanism);
    let coordinates = Coordinates::new(&layout, &State::default()).0;
    let mut recorder =
        Recorder::new(mechanism, &layout, (STATE, &|drive| layout.states + drive), grid, output.within());
    let readout = Readout::new(mechanism, &Mode::new([]));
    let mut cost = Cost { modes: 1, ..Cost::default() };
    let mut ending = Ending::Complete;
    for row in 0..=grid.intervals() {
        let time = grid.time(row);
        // NaN fails the comparison, too.
        if row > 0 && !values(&state).all(|value| value.abs() <= BOUND) {
            ending = Ending::Diverged { time };
            break;
        }
        let input = experiment.inputs[0].value(time);
        let motion = model.motion(&state, input);
        // A row shows the state itself, with its own angles.
        recorder.segment(row, &coordinates.at(&state), &Mode::new(motion));
        recorder.push_state(&inner_of(&layout, mechanism, &state), &[input, 0.0, 0.0], None);
        if recorder.flow == Flow::Stop {
            ending = Ending::Interrupted { time };
            break;
        }
        // Only its steps are known, and a jump of the input acts from the next one on.
        let mode = Mode::new(motion);
        let mut show = |begin: f64, length: f64, from: &Reading, to: &Reading| {
            if let Some(observer) = &mut recorder.observer {
                observer.pass(&Gap { begin, length, from, to, bow: &[0.0; QUANTITIES], mode: &mode, few: readout.few });
            }
        };
        let read = |state: &State, input: f64| {
            let inner = inner_of(&layout, mechanism, state);
            readout.read(&layout, &inner, &mechanism.origin, &[input, 0.0, 0.0])
        };
        let mut before = read(&state, input);
        show(time, 0.0, &before, &before);
        if row == grid.intervals() {
            break;
        }
        let interval = if row < grid.even() { grid.interval() } else { grid.rest() };
        let substeps = steps(interval);
        let h = interval / substeps;
        for k in 0..substeps as u64 {
            // A step uses the input at its beginning: an edge at its end belongs to the next one.
            let t = time + k as f64 * h;
            let step = Step { model: &model, input: experiment.inputs[0].piece(t), h };
            state = match method {
                Method::RungeKutta4 => step.runge_kutta_4(&state),
                Method::DormandPrince5 => step.dormand_prince_5(&state),
            };
            let after = read(&state, step.input.value(t + h));
            show(t, h, &before, &after);
            before = after;
        }
        cost.steps += substeps as u64;
        cost.evaluations += substeps as u64 * if method == Method::RungeKutta4 { 4 } else { 6 };
    }
    let time = match ending {
        Ending::Diverged { time } | Ending::Interrupted { time } => time,
        _ => grid.end(),
    };
    if let Some(observer) = &mut recorder.observer {
        observer.end(time, &state, &Mode::new(model.motion(&state, experiment.inputs[0].value(time))));
    }
    recorder.finish();
    cost.samples = recorder.rows;
    Ok(Outcome { events: Vec::new(), ties: Vec::new(), ending, cost, error: None, unmet: 0 })
}

/// A state with elongations that replace angles, as readings require.
fn inner_of(layout: &Layout, mechanism: &Mechanism, state: &State) -> State {
    let mut inner = *state;
    for replaced in &layout.replaced {
        let others: f64 = replaced.others.iter().map(|&(other, arm)| arm * state.position[other]).sum();
        inner.position[replaced.body] = replaced.own * state.position[replaced.body] + others;
    }
    debug_assert!(mechanism.bodies.len() == BODIES);
    inner
}

/// All elements of a state.
fn values(state: &State) -> impl Iterator<Item = f64> + '_ {
    state.position.iter().chain(&state.speed).chain(&state.current).copied()
}

/// The equations (16)-(18) with Table 3 for the friction.
struct Model<'a> {
    mechanism: &'a Mechanism,
    load: [Form; 3],
    current_rate: Form,
    inertia: [f64; 3],
    viscous: [f64; 3],
    coulomb: [f64; 3],
}

impl<'a> Model<'a> {
    fn new(machine: &Machine, mechanism: &'a Mechanism) -> Result<Self> {
        let unfit = |what: String| {
            Error::new(what)
                .allowed("one viscous and one Coulomb value for each body, and a gear without losses")
                .next("leave --solver out: the exact solver takes all of these")
        };
        let mut viscous = [0.0; 3];
        let mut coulomb = [0.0; 3];
        for body in 0..BODIES {
            let law = mechanism.friction(body);
            if law.forward != law.backward || law.forward.breakaway != law.forward.coulomb {
                return Err(unfit(format!(
                    "the paper's Table 3 does not support the friction of the {}: it has directions or a breakaway of \
                     its own",
                    mechanism.bodies[body].label.name
                )));
            }
            viscous[body] = law.forward.viscous;
            coulomb[body] = law.forward.coulomb;
        }
        if machine.drives[0].motor.gear_efficiency < 1.0 {
            return Err(unfit("the paper's Table 3 does not support a gear efficiency below 1".into()));
        }
        if let Some(part) = machine.beyond_the_paper() {
            return Err(unfit(format!("the paper's Table 3 does not support {part}")));
        }
        let free = Mode::new([]);
        let equations = mechanism.equations(free);
        Ok(Self {
            mechanism,
            load: std::array::from_fn(|body| mechanism.load(body, true, &free)),
            current_rate: equations.current_rate[0],
            inertia: std::array::from_fn(|body| equations.inertia[body]),
            viscous,
            coulomb,
        })
    }

    /// Table 3 as printed: `phidot` and `TauComputed` in, `Tauf` out.
    fn friction(&self, body: usize, speed: f64, computed: f64) -> f64 {
        if (-BAND..=BAND).contains(&speed) && computed.abs() <= self.coulomb[body] {
            computed
        } else {
            // sign(0) = 0, as in MATLAB
            let sign = if speed == 0.0 { 0.0 } else { speed.signum() };
            self.viscous[body] * speed + sign * self.coulomb[body]
        }
    }

    fn rate(&self, input: f64, state: &State) -> State {
        let input = [input; DRIVES];
        let mut rate = State { position: state.speed, ..State::default() };
        for body in 0..BODIES {
            let computed = self.load[body].value(self.mechanism, state, &input);
            // J φ̈ = TauComputed − Tauf                                          (16)-(18)
            rate.speed[body] = (computed - self.friction(body, state.speed[body], computed)) / self.inertia[body];
        }
        rate.current[0] = self.current_rate.value(self.mechanism, state, &input);
        rate
    }

    /// The state of each body by the function: frozen, or sliding with the sign of its speed.
    fn motion(&self, state: &State, input: f64) -> [Motion; 3] {
        std::array::from_fn(|body| {
            let speed = state.speed[body];
            let computed = self.load[body].value(self.mechanism, state, &[input; DRIVES]);
            if self.coulomb[body] == 0.0 {
                Motion::Free
            } else if (-BAND..=BAND).contains(&speed) && computed.abs() <= self.coulomb[body] || speed == 0.0 {
                Motion::Stuck
            } else if speed > 0.0 {
                Motion::Forward
            } else {
                Motion::Backward
            }
        })
    }
}

/// `state` + `h` Σ weight · rate.
fn moved(state: &State, h: f64, rates: &[(f64, &State)]) -> State {
    fn add<const N: usize>(
        values: &[f64; N],
        h: f64,
        rates: &[(f64, &State)],
        of: fn(&State) -> &[f64; N],
    ) -> [f64; N] {
        std::array::from_fn(|j| values[j] + h * rates.iter().map(|(weight, rate)| weight * of(rate)[j]).sum::<f64>())
    }
    State {
        position: add(&state.position, h, rates, |rate| &rate.position),
        speed: add(&state.speed, h, rates, |rate| &rate.speed),
        current: add(&state.current, h, rates, |rate| &rate.current),
    }
}

/// One step.
struct Step<'a> {
    model: &'a Model<'a>,
    input: Piece,
    h: f64,
}

impl Step<'_> {
    /// Rates at the fraction `c` of the step.
    fn rate(&self, c: f64, state: &State) -> State {
        self.model.rate(self.input.value(self.input.start + c * self.h), state)
    }

    fn runge_kutta_4(&self, x: &State) -> State {
        let h = self.h;
        let k1 = self.rate(0.0, x);
        let k2 = self.rate(0.5, &moved(x, h, &[(0.5, &k1)]));
        let k3 = self.rate(0.5, &moved(x, h, &[(0.5, &k2)]));
        let k4 = self.rate(1.0, &moved(x, h, &[(1.0, &k3)]));
        moved(x, h / 6.0, &[(1.0, &k1), (2.0, &k2), (2.0, &k3), (1.0, &k4)])
    }

    /// The fifth-order formula of Dormand & Prince (1980), without its step control: Simulink's ode5.
    fn dormand_prince_5(&self, x: &State) -> State {
        let h = self.h;
        let k1 = self.rate(0.0, x);
        let k2 = self.rate(1.0 / 5.0, &moved(x, h, &[(1.0 / 5.0, &k1)]));
        let k3 = self.rate(3.0 / 10.0, &moved(x, h, &[(3.0 / 40.0, &k1), (9.0 / 40.0, &k2)]));
        let k4 = self.rate(4.0 / 5.0, &moved(x, h, &[(44.0 / 45.0, &k1), (-56.0 / 15.0, &k2), (32.0 / 9.0, &k3)]));
        let k5 = self.rate(
            8.0 / 9.0,
            &moved(
                x,
                h,
                &[(19372.0 / 6561.0, &k1), (-25360.0 / 2187.0, &k2), (64448.0 / 6561.0, &k3), (-212.0 / 729.0, &k4)],
            ),
        );
        let k6 = self.rate(
            1.0,
            &moved(
                x,
                h,
                &[
                    (9017.0 / 3168.0, &k1),
                    (-355.0 / 33.0, &k2),
                    (46732.0 / 5247.0, &k3),
                    (49.0 / 176.0, &k4),
                    (-5103.0 / 18656.0, &k5),
                ],
            ),
        );
        moved(
            x,
            h,
            &[
                (35.0 / 384.0, &k1),
                (500.0 / 1113.0, &k3),
                (125.0 / 192.0, &k4),
                (-2187.0 / 6784.0, &k5),
                (11.0 / 84.0, &k6),
            ],
        )
    }
}
