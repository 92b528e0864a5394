//! The tables of a machine packed into lists of numbers: each row of weights once, and where each table finds its own.

use super::tables::{ElementKind, Row, Stepped, Tables, Then};
use std::collections::HashMap;

/// The code that follows a condition which ends the run.
pub(super) const LEAVE: i64 = -1;

/// Tables as lists of numbers, counted from 0.
#[derive(Debug, Clone, Default)]
pub(super) struct Packed {
    /// Rows of weights on z, each once.
    pub weights: Vec<Vec<f64>>,
    /// Entries of all tables: which row; where each table's begin; and what each depends on.
    pub entry: Vec<i64>,
    pub entry_first: Vec<i64>,
    pub depends: Vec<i64>,
    pub depends_first: Vec<i64>,
    /// For each condition: its table; the element (−1 for none) and the state in which it is one; what follows; its
    /// rank; and, where the load decides what follows, the conditions on the breakaway forward and backward (else −1).
    pub guards: Vec<[i64; 7]>,
    /// Resets by the changes: (condition, place), and the values.
    pub resets: Vec<[i64; 2]>,
    pub reset_values: Vec<f64>,
    /// Gears that lose power: (element, table of the torque at rest). Loads on bodies at rest are those where such an
    /// element does 0 if that torque is not negative, and 1 otherwise.
    pub resting: Vec<[i64; 2]>,
    /// For each element: states, and what it does at rest.
    pub elements: Vec<[i64; 2]>,
    /// Places of each body's coordinate and speed, and the element of its motion (−1 for none).
    pub bodies: Vec<[i64; 3]>,
    /// Lengths in the places of angles: (body, other body or −1 for its own, arm).
    pub lengths: Vec<[f64; 3]>,
    /// Places of the factors of each product.
    pub products: Vec<[i64; 2]>,
    /// Steppers by drives: the body that the rotor turns, the place of its sine, electrical angle and angle per input
    /// (rad/m), input of a microstep (m, 0 for none), farthest jump of the input (m), amplitude of what the driver
    /// commands of a phase (A or V), amplitude and limit of the current at rest (A).
    pub steppers: Vec<[f64; 9]>,
    /// Numbers of the first table of the currents, the voltages and the forces.
    pub outputs: [i64; 3],
    /// Number of the first table that was asked for.
    pub others: i64,
}

impl Packed {
    pub(super) fn new(tables: &Tables) -> Self {
        let mut packed = Self { depends_first: vec![0], ..Self::default() };
        let mut places = HashMap::new();
        tables.rates.iter().for_each(|row| {
            packed.add(row, &mut places);
        });
        for (number, guard) in tables.guards.iter().enumerate() {
            let table = packed.add(&guard.row, &mut places);
            let (element, state) = guard.of.map_or((-1, 0), |(element, state)| (element as i64, state as i64));
            let ([forward, backward], then) = match (guard.then, guard.breakaways) {
                (Then::Decide(rests), Some(both)) => (both.map(|number| number as i64), rests as i64),
                (Then::Decide(code) | Then::Become(code), _) => ([-1, -1], code as i64),
                (Then::Leave, _) => ([-1, -1], LEAVE),
            };
            packed.guards.push([table, element, state, then, i64::from(guard.rank), forward, backward]);
            for (place, value) in &guard.resets {
                packed.resets.push([number as i64, *place as i64]);
                packed.reset_values.push(*value);
            }
        }
        let none = [Row::constant(vec![0.0; tables.size()])];
        let forces = if tables.forces.is_empty() { &none[..] } else { &tables.forces };
        for (k, rows) in [&*tables.currents, &tables.voltages, forces].into_iter().enumerate() {
            packed.outputs[k] = packed.entry_first.len() as i64;
            rows.iter().for_each(|row| {
                packed.add(row, &mut places);
            });
        }
        for (drive, row) in tables.resting_torque.iter().enumerate() {
            let element = tables.elements.iter().position(|element| element.kind == ElementKind::GearTorque(drive));
            if let (Some(row), Some(element)) = (row, element) {
                let table = packed.add(row, &mut places);
                packed.resting.push([element as i64, table]);
            }
        }
        packed.others = packed.entry_first.len() as i64;
        tables.others.iter().for_each(|row| {
            packed.add(row, &mut places);
        });
        packed.parts(tables);
        packed
    }

    /// Adds a table, and returns its number.
    fn add(&mut self, row: &Row, places: &mut HashMap<Vec<u64>, i64>) -> i64 {
        self.entry_first.push(self.entry.len() as i64);
        self.depends.extend(row.depends.iter().map(|&element| element as i64));
        self.depends_first.push(self.depends.len() as i64);
        for weights in &row.weights {
            let bits = weights.iter().map(|w| (w + 0.0).to_bits()).collect();
            let place = *places.entry(bits).or_insert_with(|| {
                self.weights.push(weights.iter().map(|w| w + 0.0).collect());
                self.weights.len() as i64 - 1
            });
            self.entry.push(place);
        }
        self.entry_first.len() as i64 - 1
    }

    /// Elements, bodies, products and steppers.
    fn parts(&mut self, tables: &Tables) {
        self.products = tables.products.iter().map(|factors| factors.map(|place| place as i64)).collect();
        let stepper = |own: &Stepped| {
            let [per_input, most] = [own.per_input, own.phases.supply / own.phases.resistance];
            let electrical = own.phases.teeth * per_input;
            let [field, holding] = [own.phases.commanded(), own.phases.holding_current()];
            let (shaft, sine) = (own.shaft as f64, own.sine as f64);
            let microstep = own.microstep.unwrap_or(0.0);
            // With what rounding may add.
            let farthest = own.farthest * (1.0 + 1e-6);
            [shaft, sine, electrical, per_input, microstep, farthest, field, holding, most]
        };
        self.steppers = tables.steppers.iter().map(stepper).collect();
        let (mechanism, layout) = (&tables.mechanism, &tables.layout);
        let states = tables.elements.iter().map(|element| element.states.len() as i64);
        self.elements = states.zip(tables.at_rest()).map(|(states, at_rest)| [states, at_rest as i64]).collect();
        for body in 0..mechanism.bodies.len() {
            let leader = mechanism.leader(body);
            let motion = tables.elements.iter().position(|e| e.kind == ElementKind::Body(leader));
            let motion = motion.map_or(-1, |element| element as i64);
            self.bodies.push([layout.coordinate[body] as i64, layout.speed[body] as i64, motion]);
        }
        for one in &layout.replaced {
            self.lengths.push([one.body as f64, -1.0, one.own]);
            self.lengths.extend(one.others.iter().map(|&(other, arm)| [one.body as f64, other as f64, arm]));
        }
    }
}
