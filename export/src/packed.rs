//! The tables of a machine packed into lists of numbers: each row of weights once, and where each table finds its own.

use super::tables::{ElementKind, Row, Tables, Then};
use crate::mechanism::AmplifierMode;
use std::collections::HashMap;

/// The codes that follow a condition which ends a body's motion, or the run.
pub(super) const STOP: i64 = -1;
pub(super) const LEAVE: i64 = -2;

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
    /// For each condition: its table, the element (−1 for none) and the state in which it is one, what follows, rank.
    pub guards: Vec<[i64; 5]>,
    /// For each element: states, kind (0 body, 1 gear, 2 limit, 3 limit of a current that is a state, 4 spring), what
    /// it does at rest.
    pub elements: Vec<[i64; 3]>,
    /// Speeds that end with a body's: (element, place).
    pub moves: Vec<[i64; 2]>,
    /// Currents that a limit holds: (element, place), and the limit.
    pub held: Vec<[i64; 2]>,
    pub limits: Vec<f64>,
    /// Places of each body's coordinate and speed, and the element of its motion (−1 for none).
    pub bodies: Vec<[i64; 3]>,
    /// Lengths in the places of angles: (body, other body or −1 for its own, arm).
    pub lengths: Vec<[f64; 3]>,
    /// Numbers of the first table of the currents, the voltages and the forces.
    pub outputs: [i64; 3],
}

impl Packed {
    pub(super) fn new(tables: &Tables) -> Self {
        let mut packed = Self { depends_first: vec![0], ..Self::default() };
        let mut places = HashMap::new();
        tables.rates.iter().for_each(|row| {
            packed.add(row, &mut places);
        });
        for guard in &tables.guards {
            let table = packed.add(&guard.row, &mut places);
            let (element, state) = guard.of.map_or((-1, 0), |(element, state)| (element as i64, state as i64));
            let then = match guard.then {
                Then::Become(code) => code as i64,
                Then::Stop => STOP,
                Then::Leave => LEAVE,
            };
            packed.guards.push([table, element, state, then, i64::from(guard.rank)]);
        }
        for (k, rows) in [&tables.currents, &tables.voltages, &tables.forces].into_iter().enumerate() {
            packed.outputs[k] = packed.entry_first.len() as i64;
            rows.iter().for_each(|row| {
                packed.add(row, &mut places);
            });
        }
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

    /// Elements and bodies.
    fn parts(&mut self, tables: &Tables) {
        let (mechanism, layout) = (&tables.mechanism, &tables.layout);
        let at_rest = tables.at_rest();
        for (index, element) in tables.elements.iter().enumerate() {
            let kind = match element.kind {
                ElementKind::Body(body) => {
                    let speeds = mechanism.followers(body).map(|b| [index as i64, layout.speed[b] as i64]);
                    self.moves.extend(speeds);
                    0
                }
                ElementKind::GearTorque(_) => 1,
                ElementKind::Current(drive) => {
                    let amplifier = &mechanism.drives[drive].amplifier;
                    match layout.current[drive].filter(|_| amplifier.mode == AmplifierMode::Voltage) {
                        Some(place) => {
                            self.held.push([index as i64, place as i64]);
                            self.limits.push(amplifier.current_limit.unwrap_or(0.0));
                            3
                        }
                        None => 2,
                    }
                }
                ElementKind::Voltage(_) => 2,
                ElementKind::Span(_) | ElementKind::Gap(_) | ElementKind::Line(_) => 4,
            };
            self.elements.push([element.states.len() as i64, kind, at_rest[index] as i64]);
        }
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
