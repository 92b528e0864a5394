//! Complete linear analysis of a machine: matrices, poles, zeros, responses, modes, resonances along the travel or over
//! the working area.

use super::{
    Discrete, Hold, Natural, Operation, Range, ResonanceMap, ResonancesAt, Response, StateSpace, System, Transfer,
};
use super::{assumptions, place, places, sticks, travel};
use crate::case::Case;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::mechanism::BODIES;
use nalgebra::Complex;
use std::f64::consts::PI;

/// Number of positions along the travel of an axis.
const PLACES: usize = 61;

/// Options of an analysis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Question {
    /// Speed at the belt at which everything slides, m/s; by default that of [`Operation::default`].
    pub speed: Option<f64>,
    /// Position of the cart, m; zero by default.
    pub at: Option<f64>,
    /// Position of the bridge, m, if any; zero by default.
    pub bridge: Option<f64>,
    /// Keys of held bodies.
    pub held: Vec<String>,
    /// Sample time of the discrete-time models, s; none by default.
    pub sample_time: Option<f64>,
    /// Interpolation of the inputs between samples.
    pub hold: Hold,
    /// Delay of the inputs, s.
    pub delay: f64,
    /// Lowest frequency of the responses, Hz; by default below the slowest pole or zero.
    pub from: Option<f64>,
    /// Highest frequency of the responses, Hz; by default above the fastest resonance.
    pub to: Option<f64>,
}

/// Results of an analysis.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Analysis<'a> {
    /// The case of the machine.
    pub case: &'a Case,
    /// Operating point of the linearisation.
    pub operation: Operation,
    /// Its equations.
    pub system: System,
    /// Results for each input alone, in the order of the drives.
    pub inputs: Vec<ByInput>,
    /// Poles, 1/s, conjugates side by side, the slowest first.
    pub poles: Vec<Complex<f64>>,
    /// Shapes and energies of the modes; none if a body is held.
    pub modes: Option<Natural>,
    /// The assumptions.
    pub words: Vec<String>,
    /// True if the machine sticks at rest.
    pub sticks: bool,
    /// Resonances at the requested position.
    pub here: ResonancesAt,
    /// Resonances along the travel of an axis, if they depend on the position.
    pub travel: Option<Vec<ResonancesAt>>,
    /// Resonances over the working area of a gantry, if they depend on the position.
    pub map: Option<ResonanceMap>,
}

/// Results for one input.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ByInput {
    /// The system of this input, with zero for the others.
    pub system: StateSpace,
    /// Transfers by output.
    pub transfers: Vec<Transfer>,
    /// Responses by output, for all inputs at the same frequencies.
    pub responses: Vec<Response>,
    /// The discrete-time model, if requested.
    pub discrete: Option<Discrete>,
}

impl<'a> Analysis<'a> {
    /// Linearises the machine of `case`. Errors name the options of the command line.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::linear::{Analysis, Question};
    /// let case = Case::from_text("axis.toml", TEMPLATE)?;
    /// let analysis = Analysis::new(&case, &Question { sample_time: Some(1e-3), ..Question::default() })?;
    /// assert_eq!(analysis.inputs[0].discrete.as_ref().unwrap().sample_time, 1e-3);
    /// assert!(Analysis::new(&case, &Question { from: Some(10.0), to: Some(1.0), ..Question::default() }).is_err());
    ///
    /// let case = Case::read_with("../stages/h-frame/h-frame.toml", &[])?;
    /// let analysis = Analysis::new(&case, &Question::default())?;
    /// let modes = analysis.modes.unwrap();
    /// assert_eq!((analysis.inputs.len(), modes.rigid.len(), modes.elastic.len()), (2, 2, 2));
    /// assert!((modes.elastic[0].hertz() - 196.643946994).abs() < 1e-9);
    /// // Given stiffnesses are the same everywhere.
    /// assert!(analysis.map.is_none());
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(case: &'a Case, question: &Question) -> Result<Self> {
        let machine = &case.machine;
        numbers(question)?;
        within_travel(machine, question.at, question.bridge)?;
        let usual = Operation::default();
        let operation = Operation {
            speed: question.speed.unwrap_or(usual.speed),
            position: question.at.unwrap_or(usual.position),
            bridge: question.bridge.unwrap_or(usual.bridge),
            held: held(machine, &question.held)?,
        };
        let system = System::new(machine, operation).map_err(|error| error.in_file("--at"))?;
        let each: Vec<StateSpace> = (0..system.inputs.len()).map(|input| system.input(input)).collect();
        let transfers = each.iter().map(StateSpace::transfers).collect::<Result<Vec<_>>>()?;
        let frequencies = frequencies(&transfers.concat(), question)?;
        let by_input = |(system, transfers): (StateSpace, Vec<Transfer>)| {
            let discrete = question.sample_time.map(|time| system.discrete(time, question.hold, question.delay));
            let discrete = discrete.transpose().map_err(|error| error.in_file("--sample-time"))?;
            let responses = system.responses(&transfers, &frequencies);
            Ok(ByInput { system, transfers, responses, discrete })
        };
        // All transfers have the same poles.
        let poles = transfers.iter().flatten().next().map(|transfer| transfer.poles.clone()).unwrap_or_default();
        let inputs = each.into_iter().zip(transfers).map(by_input).collect::<Result<Vec<_>>>()?;
        let everything_slides = question.held.is_empty();
        let at = machine.without_strain(&operation.coordinates(machine), &[]).position;
        let modes = everything_slides.then(|| Natural::new(&machine.mechanism(), &at));
        Ok(Self {
            case,
            operation,
            system,
            inputs,
            poles,
            modes: modes.transpose()?,
            words: assumptions(machine, operation),
            sticks: sticks(machine, operation),
            here: place(machine, operation)?,
            travel: places(machine, PLACES).map(|places| travel(machine, operation, &places)).transpose()?,
            map: ResonanceMap::new(machine)?,
        })
    }
}

/// Rejects invalid numbers of a question.
fn numbers(question: &Question) -> Result<()> {
    let &Question { speed, at, bridge, delay, from, to, .. } = question;
    let finite = |value: f64| value.is_finite();
    let frequency = |value: f64| value > 0.0 && value.is_finite();
    let wrong = |option: &str, value: Option<f64>, good: fn(f64) -> bool, allowed: &str| {
        let value = value.filter(|value| !good(*value));
        value.map(|value| Error::new(format!("{value:?} is not allowed here")).in_file(option).allowed(allowed))
    };
    let found = wrong("--speed", speed, finite, "a finite number, in m/s")
        .or_else(|| wrong("--at", at, finite, "a finite number, in m"))
        .or_else(|| wrong("--bridge", bridge, finite, "a finite number, in m"))
        .or_else(|| wrong("--delay", Some(delay), finite, "a finite number, in s"))
        .or_else(|| wrong("--from", from, frequency, "above zero, in Hz"))
        .or_else(|| wrong("--to", to, frequency, "above zero, in Hz"));
    found.map_or(Ok(()), Err)
}

/// Rejects a position of cart or bridge, m, outside the travel, and one of a missing bridge.
pub fn within_travel(machine: &Machine, at: Option<f64>, bridge: Option<f64>) -> Result<()> {
    if bridge.is_some() && machine.bridge.is_none() {
        return Err(Error::new("this machine has no bridge").in_file("--bridge").next("leave it out, or give --at"));
    }
    let bridge_travel = machine.bridge.as_ref().and_then(|bridge| bridge.travel);
    for (option, at, travel) in [("--at", at, machine.cart.travel), ("--bridge", bridge, bridge_travel)] {
        let (Some(at), Some(travel)) = (at, travel) else { continue };
        if !(travel.min..=travel.max).contains(&at) {
            return Err(Error::new(format!("{at} m is outside the travel"))
                .in_file(option)
                .allowed(format!("{} m to {} m", travel.min, travel.max))
                .next("name a place on the travel, or change [travel]"));
        }
    }
    Ok(())
}

/// The bodies of these keys, by their numbers.
fn held(machine: &Machine, keys: &[String]) -> Result<[bool; BODIES]> {
    let mut held = [false; BODIES];
    let bodies = machine.geometry().bodies;
    for key in keys {
        let Some(body) = bodies.iter().position(|body| body.label.key == key) else {
            let known: Vec<&str> = bodies.iter().map(|body| body.label.key).collect();
            return Err(Error::new(format!("this machine has no body \"{key}\""))
                .in_file("--stuck")
                .allowed(known.join(", ")));
        };
        held[body] = true;
    }
    Ok(held)
}

/// The frequencies of the responses, rad/s.
fn frequencies(transfers: &[Transfer], question: &Question) -> Result<Vec<f64>> {
    let (usual, roots) = Range::of_transfers(transfers);
    let range = Range {
        from: question.from.map_or(usual.from, |hertz| 2.0 * PI * hertz),
        to: question.to.map_or(usual.to, |hertz| 2.0 * PI * hertz),
        ..usual
    };
    if range.from >= range.to {
        let [from, to] = [range.from, range.to].map(|omega| omega / (2.0 * PI));
        return Err(Error::new(format!("the response would end at {to} Hz, before it begins at {from} Hz"))
            .in_file("--from, --to")
            .next("give --from and --to, the lower one first"));
    }
    Ok(range.frequencies(&roots))
}
