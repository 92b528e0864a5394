//! All that is told of how a gantry swings: its modes, and a map of its resonances over the working area.

use super::{Natural, Operation, Range, Response, StateSpace, System, Transfer};
use crate::case::Case;
use crate::error::Result;
use crate::friction::Law;
use crate::machine::gantry::{BRIDGE, CART};
use crate::machine::{DriveUnit, Travel};
use crate::mechanism::{AmplifierMode, BODIES, Mechanism};

/// Places along either way of the map.
const PLACES: usize = 33;

/// The answers.
#[derive(Debug, Clone)]
pub struct GantryAnalysis<'a> {
    /// The case whose machine it is.
    pub case: &'a Case,
    /// With bridge and cart at zero.
    pub modes: Natural,
    /// Over the working area, where the place makes a difference.
    pub map: Option<ResonanceMap>,
    /// The linear equations with bridge and cart at zero.
    pub system: System,
    /// Transfer from each drive's input to every output, in the order of the drives.
    pub by_input: Vec<ByInput>,
    /// The assumptions.
    pub words: Vec<String>,
}

/// The effect of one input.
#[derive(Debug, Clone)]
pub struct ByInput {
    /// The system of this input.
    pub system: StateSpace,
    /// By output.
    pub transfers: Vec<Transfer>,
    /// By output.
    pub responses: Vec<Response>,
}

/// Undamped frequencies of the elastic modes over the working area.
#[derive(Debug, Clone, PartialEq)]
pub struct ResonanceMap {
    /// Positions of the bridge, m.
    pub bridge: Vec<f64>,
    /// Positions of the cart, m.
    pub cart: Vec<f64>,
    /// Hz, by mode, then by the bridge's position, then by the cart's.
    pub hertz: Vec<Vec<Vec<f64>>>,
}

impl<'a> GantryAnalysis<'a> {
    /// The modes of the machine of `case`, everything sliding.
    ///
    /// ```
    /// use taut::case::Case;
    /// use taut::linear::GantryAnalysis;
    /// let case = Case::read_with("../stages/h-frame/h-frame.toml", &[])?;
    /// let analysis = GantryAnalysis::of(&case)?;
    /// assert_eq!((analysis.modes.rigid.len(), analysis.modes.elastic.len()), (2, 2));
    /// assert!((analysis.modes.elastic[0].hertz() - 196.643946994).abs() < 1e-9);
    /// // Given stiffnesses are the same everywhere.
    /// assert!(analysis.map.is_none());
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn of(case: &'a Case) -> Result<Self> {
        let mechanism = case.machine.mechanism();
        let modes = Natural::of(&mechanism, &[0.0; BODIES])?;
        let system = System::of(&case.machine, Operation::default())?;
        let by_input = (0..system.inputs.len()).map(|input| ByInput::of(system.input(input))).collect::<Result<_>>()?;
        let map = match (case.machine.belt.following(), case.machine.first_slide().travel, case.machine.cart.travel) {
            (Some(_), Some(bridge), Some(cart)) => Some(ResonanceMap::of(&mechanism, bridge, cart)?),
            _ => None,
        };
        Ok(Self { case, modes, map, system, by_input, words: words(case, &mechanism) })
    }
}

impl ByInput {
    fn of(system: StateSpace) -> Result<Self> {
        let transfers = system.transfers()?;
        let (range, roots) = Range::of_transfers(&transfers);
        let responses = system.responses(&transfers, &range.frequencies(&roots));
        Ok(Self { system, transfers, responses })
    }
}

impl ResonanceMap {
    fn of(mechanism: &Mechanism, bridge: Travel, cart: Travel) -> Result<Self> {
        let places = |travel: Travel| -> Vec<f64> {
            let last = (PLACES - 1) as f64;
            (0..PLACES).map(|k| travel.min + (travel.max - travel.min) * k as f64 / last).collect()
        };
        let (bridge, cart) = (places(bridge), places(cart));
        let mut hertz: Vec<Vec<Vec<f64>>> = Vec::new();
        for (i, x) in bridge.iter().enumerate() {
            for y in &cart {
                let mut position = [0.0; BODIES];
                (position[BRIDGE], position[CART]) = (*x, *y);
                let found = Natural::frequencies(mechanism, &position)?;
                hertz.resize_with(found.len(), || vec![Vec::with_capacity(cart.len()); bridge.len()]);
                for (mode, frequency) in hertz.iter_mut().zip(found) {
                    mode[i].push(frequency);
                }
            }
        }
        Ok(Self { bridge, cart, hertz })
    }

    /// The least and the greatest frequency of a mode, Hz, each with its place (x, y), m.
    pub fn range(&self, mode: usize) -> [(f64, (f64, f64)); 2] {
        let mut range = [(f64::INFINITY, (0.0, 0.0)), (f64::NEG_INFINITY, (0.0, 0.0))];
        for (x, row) in self.bridge.iter().zip(&self.hertz[mode]) {
            for (y, hertz) in self.cart.iter().zip(row) {
                if *hertz < range[0].0 {
                    range[0] = (*hertz, (*x, *y));
                }
                if *hertz > range[1].0 {
                    range[1] = (*hertz, (*x, *y));
                }
            }
        }
        range
    }
}

/// The assumptions.
fn words(case: &Case, mechanism: &Mechanism) -> Vec<String> {
    let gantry = &case.machine;
    let mut words = vec!["everything slides: dry friction that does not change with speed drops out".to_string()];
    let bodies = || mechanism.bodies.iter().filter(|body| !body.is_rotor);
    if bodies().any(|body| body.friction.law != Law::Coulomb) {
        words.push("of friction that changes with speed the viscous part alone counts".into());
    }
    if bodies().any(|body| body.friction.forward.viscous != body.friction.backward.viscous) {
        words.push("viscous friction is that of forward motion".into());
    }
    let is_sluggish = |unit: &DriveUnit| unit.amplifier.mode == AmplifierMode::Voltage && unit.motor.inductance != 0.0;
    if gantry.drives.iter().any(is_sluggish) {
        words.push("a motor with an inductance counts as giving no torque: what its current damps is left out".into());
    }
    if gantry.drives.iter().any(|unit| unit.motor.gear_play.is_some_and(|play| play.backlash > 0.0)) {
        words.push("gears with play are taken with a flank in contact".into());
    }
    if mechanism.drives.iter().any(|drive| drive.loses()) {
        words.push("gears are taken as driven by their motors".into());
    }
    if gantry.belt.pretension.is_some() {
        words.push("the spans are taken taut".into());
    }
    if [gantry.first_slide(), &gantry.cart].iter().any(|slide| slide.travel.is_some_and(|travel| travel.stop.is_some()))
    {
        words.push("bridge and cart are taken between their end stops".into());
    }
    words
}
