//! All that is told of a stage's linear equations at once: matrices, poles, zeros, responses, resonance along the
//! travel.

use super::{Discrete, Hold, Operation, Place, Range, Response, StateSpace, Transfer};
use super::{assumptions, places, sticks, travel};
use crate::case::Case;
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Places along the travel.
const PLACES: usize = 61;

/// The question of an analysis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Question {
    /// Speed of the cart at which everything slides, m/s; [`Operation::default`]'s if not said.
    pub speed: Option<f64>,
    /// Where the cart is, m; at x = 0 if not said.
    pub at: Option<f64>,
    /// Which bodies are held where they are.
    pub held: [bool; 6],
    /// Of the discrete-time model, s; none is made if not said.
    pub sample_time: Option<f64>,
    /// The input between samples.
    pub hold: Hold,
    /// By how much the input is late, s.
    pub delay: f64,
    /// Lowest frequency of the response, Hz; below the slowest pole or zero if not said.
    pub from: Option<f64>,
    /// Highest frequency of the response, Hz; above the fastest resonance if not said.
    pub to: Option<f64>,
}

/// The answers.
#[derive(Debug, Clone)]
pub struct Analysis<'a> {
    /// The case whose stage it is.
    pub case: &'a Case,
    /// About what it was linearised.
    pub operation: Operation,
    /// Its equations.
    pub system: StateSpace,
    /// By output.
    pub transfers: Vec<Transfer>,
    /// The assumptions.
    pub words: Vec<String>,
    /// Whether the stage sticks at rest.
    pub sticks: bool,
    /// At the place that was asked for.
    pub here: Place,
    /// Along the travel, where the place makes a difference.
    pub travel: Option<Vec<Place>>,
    /// By output.
    pub responses: Vec<Response>,
    /// The discrete-time model, if asked for.
    pub discrete: Option<Discrete>,
}

impl<'a> Analysis<'a> {
    /// Linearises the stage of `case`. Mistakes in the question are told by the names of the command line's options.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::linear::{Analysis, Question};
    /// let case = Case::from_text("axis.toml", TEMPLATE)?;
    /// let analysis = Analysis::of(&case, &Question { sample_time: Some(1e-3), ..Question::default() })?;
    /// assert_eq!(analysis.discrete.unwrap().sample_time, 1e-3);
    /// assert!(Analysis::of(&case, &Question { from: Some(10.0), to: Some(1.0), ..Question::default() }).is_err());
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn of(case: &'a Case, question: &Question) -> Result<Self> {
        let usual = Operation::default();
        let operation = Operation {
            speed: question.speed.unwrap_or(usual.speed),
            position: question.at.unwrap_or(usual.position),
            held: question.held,
            ..usual
        };
        let machine = &case.machine;
        numbers(question)?;
        within(case, question)?;
        let system = StateSpace::of(machine, operation).map_err(|error| error.in_file("--at"))?;
        let transfers = system.transfers()?;
        let frequencies = frequencies(&transfers, question)?;
        let responses = system.responses(&transfers, &frequencies);
        let along = places(machine, PLACES).map(|places| travel(machine, operation, &places)).transpose()?;
        let here = travel(machine, operation, &[operation.position])?.swap_remove(0);
        let discrete = question.sample_time.map(|time| system.discrete(time, question.hold, question.delay));
        let discrete = discrete.transpose().map_err(|error| error.in_file("--sample-time"))?;
        let (words, sticks) = (assumptions(machine, operation), sticks(machine, operation));
        Ok(Self { case, operation, system, transfers, words, sticks, here, travel: along, responses, discrete })
    }
}

/// Refuses a question whose numbers are none.
fn numbers(question: &Question) -> Result<()> {
    let &Question { speed, at, delay, from, to, .. } = question;
    let finite = |value: f64| value.is_finite();
    let frequency = |value: f64| value > 0.0 && value.is_finite();
    let wrong = |option: &str, value: Option<f64>, good: fn(f64) -> bool, allowed: &str| {
        let value = value.filter(|value| !good(*value));
        value.map(|value| Error::new(format!("{value:?} is of no use here")).in_file(option).allowed(allowed))
    };
    let found = wrong("--speed", speed, finite, "a finite number, in m/s")
        .or_else(|| wrong("--at", at, finite, "a finite number, in m"))
        .or_else(|| wrong("--delay", Some(delay), finite, "a finite number, in s"))
        .or_else(|| wrong("--from", from, frequency, "above zero, in Hz"))
        .or_else(|| wrong("--to", to, frequency, "above zero, in Hz"));
    found.map_or(Ok(()), Err)
}

/// Refuses a place outside the travel.
fn within(case: &Case, question: &Question) -> Result<()> {
    match (question.at, case.machine.cart.travel) {
        (Some(at), Some(travel)) if !(travel.min..=travel.max).contains(&at) => {
            Err(Error::new(format!("{at} m is outside the travel"))
                .in_file("--at")
                .allowed(format!("{} m to {} m", travel.min, travel.max))
                .next("name a place on the travel, or change [travel]"))
        }
        _ => Ok(()),
    }
}

/// The frequencies of the response, rad/s.
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
