//! Steppers as tables. Sine and cosine of the rotor's electrical angle ε are states, so that torque and back-EMF are
//! sums of products:
//!
//! ```text
//! s = sin ε, c = cos ε      ṡ = N φ̇ c      ċ = −N φ̇ s
//! τ = K_m (−i_a s + i_b c) − 4 T_d s c (1 − 2 s²)
//! e_a = −K_m φ̇ s            e_b = K_m φ̇ c
//! z = (states, products, inputs, 1)
//! ```
//!
//! The inputs of a drive are what its driver commands of the two phases: currents √2 I cos ψ and √2 I sin ψ of a
//! chopper, or voltages. A chopper's regulator applies v = R i + e + L ω_c (i* − i), limited to the supply.

use super::{Does, Element, ElementKind, Row, StateName, TableGuard, Tables, Then};
use crate::error::Result;
use crate::mechanism::{Amplifier, AmplifierMode, Limit, Mechanism, Phases, SpringLaw};
use std::f64::consts::PI;

/// States of a drive: i_a, i_b, s, c.
const STATES: usize = 4;

/// Products of a drive: φ̇ c, φ̇ s, i_a s, i_b c, s c, s², s c s².
const PRODUCTS: usize = 7;

/// Phases of a drive.
const PHASES: usize = 2;

/// States of the limit of a phase's voltage, by their codes.
const LIMITS: [Limit; 3] = [Limit::Low, Limit::Inside, Limit::High];

/// A stepper of a machine in tables.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Stepped {
    /// The body that its rotor turns.
    pub shaft: usize,
    /// The place of sin ε in z; that of cos ε is the next one.
    pub sine: usize,
    /// Its phases.
    pub phases: Phases,
    /// Commanded angle of the rotor per unit of the input, rad/m.
    pub per_input: f64,
    /// The input of a microstep, m; none if the driver interpolates.
    pub microstep: Option<f64>,
    /// The farthest jump of the input, m: half a tooth pitch.
    pub farthest: f64,
}

/// Where the places of a drive are.
struct Places {
    states: usize,
    products: usize,
    inputs: usize,
    size: usize,
}

impl Tables {
    /// Tables of a mechanism whose drives may be steppers. Errors: one that is otherwise not piecewise linear.
    pub fn with_steppers(mechanism: &Mechanism) -> Result<Self> {
        let phases: Option<Vec<Phases>> = mechanism.drives.iter().map(Phases::new).collect();
        match phases {
            None => Self::new(mechanism),
            Some(phases) => Ok(Self::new(&by_torque(mechanism))?.with_phases(mechanism, &phases)),
        }
    }

    /// These tables, in which an input is the torque of a drive, with the phases that make it.
    fn with_phases(mut self, mechanism: &Mechanism, phases: &[Phases]) -> Self {
        let (drives, before) = (phases.len(), self.layout.states);
        let (states, products) = (before + STATES * drives, PRODUCTS * drives);
        let size = states + products + PHASES * drives + 1;
        let places = |drive: usize| Places {
            states: before + STATES * drive,
            products: states + PRODUCTS * drive,
            inputs: states + products + PHASES * drive,
            size,
        };
        let widen = |weights: &mut Vec<f64>| {
            let mut wide = vec![0.0; size];
            wide[..before].copy_from_slice(&weights[..before]);
            wide[size - 1] = weights[before + drives];
            for (drive, phases) in phases.iter().enumerate() {
                let torque = weights[before + drive];
                places(drive).torque(phases).for_each(|(place, weight)| wide[place] += torque * weight);
            }
            *weights = wide;
        };
        let guards = self.guards.iter_mut().map(|guard| &mut guard.row);
        let all = self.rates.iter_mut().chain(&mut self.forces).chain(guards);
        all.flat_map(|row| &mut row.weights).for_each(widen);
        self.fastest += self.turning(before, (phases, &places));
        (self.currents, self.voltages) = (Vec::new(), Vec::new());
        let mut second = Vec::new();
        for (drive, own) in phases.iter().enumerate() {
            let (at, speed) = (places(drive), self.layout.speed[mechanism.drives[drive].shaft]);
            let [a, b, s, c] = std::array::from_fn(|k| at.states + k);
            let product = |k: usize| at.products + k;
            self.products.extend([[speed, c], [speed, s], [a, s], [b, c], [s, c], [s, s], [product(4), product(5)]]);
            for phase in 0..PHASES {
                let element = own.regulator.map(|_| self.watch_phase(drive, phase, own, &at));
                let row = |of: &dyn Fn(Limit) -> Vec<f64>| match element {
                    Some(element) => {
                        Row { depends: vec![element], weights: LIMITS.map(of).to_vec(), forms: Vec::new() }
                    }
                    None => Row::constant(of(Limit::Inside)),
                };
                self.rates.push(row(&|limit| at.current_rate(phase, own, limit)));
                let current = Row::constant(at.row(&[(at.current(phase), 1.0)]));
                let voltage = row(&|limit| at.voltage(phase, own, limit));
                if phase == 0 {
                    self.currents.push(current);
                    self.voltages.push(voltage);
                } else {
                    second.push([current, voltage]);
                }
            }
            for rate in [(product(0), own.teeth), (product(1), -own.teeth)] {
                self.rates.push(Row::constant(at.row(&[rate])));
            }
            let key = mechanism.drives[drive].label.key;
            for (name, unit) in [("current", "A"), ("second_current", "A"), ("sine", ""), ("cosine", "")] {
                self.states.push(StateName { name: format!("{key}_{name}"), unit });
            }
            self.steppers.push(Stepped {
                shaft: mechanism.drives[drive].shaft,
                sine: s,
                phases: *own,
                per_input: mechanism.angle_per_input(drive),
                microstep: mechanism.microstep(drive),
                farthest: mechanism.farthest_jump(drive).unwrap_or(f64::INFINITY),
            });
        }
        // Second currents, then second voltages.
        let [currents, voltages]: [Vec<Row>; 2] = [0, 1].map(|k| second.iter().map(|both| both[k].clone()).collect());
        self.others.extend(currents.into_iter().chain(voltages));
        self.layout.states = states;
        self.layout.inputs = PHASES * drives;
        self
    }

    /// How fast phases and rotors on their fields change, beyond all else, 1/s.
    fn turning(&self, before: usize, (phases, places): (&[Phases], &dyn Fn(usize) -> Places)) -> f64 {
        let mut fastest = 0.0;
        for (drive, own) in phases.iter().enumerate() {
            let at = places(drive);
            // The largest acceleration by a product, of any body.
            let speeds = self.rates[..before].iter().flat_map(|row| &row.weights);
            let most = |k: usize| speeds.clone().map(|row| row[at.products + k].abs()).fold(0.0, f64::max);
            let current = own.amplitude.max(own.supply / own.resistance);
            // ω² = N (K_m i + 4 T_d)/J
            let swing = own.teeth * (most(2) * current + most(4));
            let regulated = own.regulator.unwrap_or(0.0).max(own.resistance / own.inductance);
            let coupled = (own.torque_constant / own.inductance * most(2)).sqrt();
            fastest += swing.sqrt() + regulated + coupled;
        }
        fastest
    }

    /// Adds the voltage limit of a phase: the number of its element.
    fn watch_phase(&mut self, drive: usize, phase: usize, own: &Phases, at: &Places) -> usize {
        let element = self.elements.len();
        let key = self.mechanism.drives[drive].voltage.key;
        self.elements.push(Element {
            kind: ElementKind::Phase(drive, phase),
            key,
            states: LIMITS.map(Does::Limits).to_vec(),
        });
        // Notes of what becomes low, free and high.
        let first = self.slots;
        self.slots += LIMITS.len();
        let wanted = at.voltage(phase, own, Limit::Inside);
        // sign (v − V) + offset V ≥ 0 holds a state; the next one by its code.
        for (state, then, sign, offset) in [(1, 2, -1.0, 1.0), (1, 0, 1.0, 1.0), (2, 1, 1.0, -1.0), (0, 1, -1.0, -1.0)]
        {
            let mut weights: Vec<f64> = wanted.iter().map(|weight| sign * weight).collect();
            weights[at.size - 1] += offset * own.supply;
            self.guards.push(TableGuard {
                of: Some((element, state)),
                then: Then::Become(then),
                rank: 1,
                slot: Some(first + then),
                fresh: first + then,
                resets: Vec::new(),
                breakaways: None,
                drop: 0.0,
                gently: None,
                row: Row::constant(weights),
            });
        }
        element
    }

    /// How far the fields of steppers may turn in a step, twice as an electrical angle, rad; zero without steppers.
    pub(crate) fn turns(&self) -> f64 {
        if self.steppers.is_empty() { 0.0 } else { 2.0 * PI }
    }
}

impl Places {
    fn current(&self, phase: usize) -> usize {
        self.states + phase
    }

    fn row(&self, terms: &[(usize, f64)]) -> Vec<f64> {
        let mut row = vec![0.0; self.size];
        terms.iter().for_each(|&(place, weight)| row[place] += weight);
        row
    }

    /// τ as products and their weights.
    fn torque(&self, phases: &Phases) -> impl Iterator<Item = (usize, f64)> {
        let (k, detent, first) = (phases.torque_constant, phases.detent_torque, self.products);
        [(first + 2, -k), (first + 3, k), (first + 4, -4.0 * detent), (first + 6, 8.0 * detent)].into_iter()
    }

    /// The back-EMF of a phase.
    fn emf(&self, phase: usize, phases: &Phases) -> (usize, f64) {
        let k = phases.torque_constant;
        if phase == 0 { (self.products + 1, -k) } else { (self.products, k) }
    }

    /// The voltage at a phase, V.
    fn voltage(&self, phase: usize, phases: &Phases, limit: Limit) -> Vec<f64> {
        let (current, input) = (self.current(phase), self.inputs + phase);
        match (phases.regulator, limit) {
            (None, _) => self.row(&[(input, 1.0)]),
            (Some(_), Limit::Low) => self.row(&[(self.size - 1, -phases.supply)]),
            (Some(_), Limit::High) => self.row(&[(self.size - 1, phases.supply)]),
            (Some(rate), Limit::Inside) => {
                let gain = phases.inductance * rate;
                self.row(&[(current, phases.resistance - gain), (input, gain), self.emf(phase, phases)])
            }
        }
    }

    /// di/dt, A/s.
    fn current_rate(&self, phase: usize, phases: &Phases, limit: Limit) -> Vec<f64> {
        let (current, input) = (self.current(phase), self.inputs + phase);
        if let (Some(rate), Limit::Inside) = (phases.regulator, limit) {
            return self.row(&[(current, -rate), (input, rate)]);
        }
        // (v − R i − e)/L
        let (emf, by_emf) = self.emf(phase, phases);
        let mut row = self.voltage(phase, phases, limit);
        row[current] -= phases.resistance;
        row[emf] -= by_emf;
        row.iter_mut().for_each(|weight| *weight /= phases.inductance);
        row
    }
}

/// The mechanism with drives whose inputs are their torques, N m.
fn by_torque(mechanism: &Mechanism) -> Mechanism {
    let mut by_torque = mechanism.clone();
    for drive in &mut by_torque.drives {
        let motor = &mut drive.motor;
        (motor.stepper, motor.torque_constant) = (None, 1.0);
        (motor.back_emf_constant, motor.inductance) = (0.0, 0.0);
        drive.amplifier = Amplifier::ideal(AmplifierMode::Current, 1.0);
    }
    by_torque.springs.retain(|spring| !matches!(spring.law, SpringLaw::Angle { .. }));
    by_torque
}
