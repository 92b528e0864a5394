//! Random stages over wide ranges, each from a seed and a number, as the text of a case file.

mod experiment;
mod feature;
mod friction;
mod gantry;
mod loops;
mod machine;
mod random;

pub use feature::{Feature, pairs, recipe};
pub use random::Random;

use std::fmt::Write;

/// Kinds of stages that are counted by themselves in the table of a hunt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum StageKind {
    /// Inertias and stiffnesses far apart.
    Wide,
    /// Equal pulleys between equal spans.
    Symmetric,
    /// Two-mass or rigid belt.
    Reduced,
    /// The friction of some body holds more at rest.
    Static,
    /// The friction of some body differs by direction.
    Asymmetric,
    /// The armature has an inductance.
    Inductance,
    /// Current mode.
    Current,
    /// A limit of voltage or current.
    Limits,
    /// A gear that loses power.
    Losses,
    /// A compliant gear.
    Play,
    /// Spans that go slack.
    Slack,
    /// Ends of the travel.
    Travel,
    /// Forces on the cart that are lines.
    Lines,
    /// A start beyond 1 m from the origin.
    Far,
}

impl StageKind {
    /// All of them.
    pub const ALL: [StageKind; 14] = [
        StageKind::Wide,
        StageKind::Symmetric,
        StageKind::Reduced,
        StageKind::Static,
        StageKind::Asymmetric,
        StageKind::Inductance,
        StageKind::Current,
        StageKind::Limits,
        StageKind::Losses,
        StageKind::Play,
        StageKind::Slack,
        StageKind::Travel,
        StageKind::Lines,
        StageKind::Far,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            StageKind::Wide => "inertias and stiffnesses over all decades",
            StageKind::Symmetric => "equal pulleys, equal spans 1 and 2",
            StageKind::Reduced => "two-mass and rigid belts",
            StageKind::Static => "static above Coulomb friction",
            StageKind::Asymmetric => "friction that differs by direction",
            StageKind::Inductance => "inductance",
            StageKind::Current => "current mode",
            StageKind::Limits => "limits of voltage and current",
            StageKind::Losses => "gear with losses",
            StageKind::Play => "gear that gives way, backlash",
            StageKind::Slack => "spans that go slack",
            StageKind::Travel => "end stops and ends of the travel",
            StageKind::Lines => "forces along the travel and by speed",
            StageKind::Far => "starts 1 m to 1 km from the origin",
        }
    }
}

/// A case.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The case file.
    pub text: String,
    /// The kinds that it belongs to.
    pub kinds: Vec<StageKind>,
}

/// Added to the seed for lines, which are drawn by themselves, and for cases with features.
const LINES: u64 = 0x6c69_6e65;
const PAIRS: u64 = 0x7477_6f73;
const DUAL_BELTS: u64 = 0x6475_616c;

/// The stage of this number.
pub fn stage(seed: u64, number: u64) -> Drawn {
    let mut draw = Draw::new(seed, number);
    let lines = Random::new(seed ^ LINES, number);
    let title = format!("seed {seed}, stage {number}");
    let sizes = draw.sizes();
    draw.machine(title, sizes, lines)
}

/// The case of this number, with the features of its recipe.
pub fn pair(seed: u64, number: u64) -> (Drawn, Vec<Feature>) {
    let features = recipe(seed, number);
    let mut draw = Draw::new(seed ^ PAIRS, number);
    draw.features = Some(features.clone());
    let lines = Random::new(seed ^ LINES, number);
    let title = format!("seed {seed}, pair {number}");
    let sizes = draw.sizes();
    draw.share_curves();
    let is_gantry = features.iter().any(|one| one.is_gantry());
    (if is_gantry { draw.gantry(title, sizes) } else { draw.machine(title, sizes, lines) }, features)
}

/// The case of this number with a dual belt in place of its machine, and the features that such a gantry can have.
pub fn dual_belt(seed: u64, number: u64) -> (Drawn, Vec<Feature>) {
    let mut features = recipe(seed, number);
    features.retain(|one| one.goes_with(Feature::DualBelt));
    features.push(Feature::DualBelt);
    // A move has become an open loop.
    if !features.contains(&Feature::Open) {
        features.push(Feature::Open);
    }
    if !features.iter().any(|one| one.is_input()) {
        features.push(Feature::Step);
    }
    features.sort();
    let mut draw = Draw::new(seed ^ DUAL_BELTS, number);
    draw.features = Some(features.clone());
    let title = format!("seed {seed}, dual belt {number}");
    let sizes = draw.sizes();
    draw.share_curves();
    (draw.gantry(title, sizes), features)
}

/// Inertias as masses at the belt, stiffnesses and what follows from them.
struct Sizes {
    radius: f64,
    mass: [f64; 3],
    stiffness: [f64; 3],
    damping: [f64; 3],
    model: &'static str,
    symmetric: bool,
    /// Length of the run, s, before the rest of the machine is known.
    time: f64,
    /// How far things go, m, and what moves them so far, N.
    way: f64,
    force: f64,
}

struct Draw {
    random: Random,
    /// True if numbers have four digits instead of all.
    short: bool,
    kinds: Vec<StageKind>,
    text: String,
    /// Fastest rate so far, 1/s.
    fastest: f64,
    /// The features that it is to have; none where chance says.
    features: Option<Vec<Feature>>,
    /// Laws of friction of drive pulley, cart and idler pulley; of a gantry pulleys, bridge and cart.
    curves: [Option<Feature>; 3],
}

impl Draw {
    fn new(seed: u64, number: u64) -> Self {
        let mut random = Random::new(seed, number);
        let short = random.chance(0.5);
        Self { random, short, kinds: Vec::new(), text: String::new(), fastest: 0.0, features: None, curves: [None; 3] }
    }

    /// True if it has a feature: by this chance, or by its recipe.
    fn has(&mut self, feature: Feature, share: f64) -> bool {
        let drawn = self.random.chance(share);
        self.features.as_ref().map_or(drawn, |features| features.contains(&feature))
    }

    /// True if its recipe has a feature.
    fn wants(&self, feature: Feature) -> bool {
        self.features.as_ref().is_some_and(|features| features.contains(&feature))
    }

    /// True if it has a recipe.
    fn is_by_recipe(&self) -> bool {
        self.features.is_some()
    }

    /// True if it is a move in a closed loop.
    fn is_loop(&self) -> bool {
        self.features.as_ref().is_some_and(|features| features.iter().any(|one| one.is_controller()))
    }

    /// As many digits as numbers of this stage have.
    fn digits(&self, value: f64) -> f64 {
        if self.short { format!("{value:.3e}").parse().unwrap_or(value) } else { value }
    }

    fn decades(&mut self, low: f64, high: f64) -> f64 {
        let value = self.random.decades(low, high);
        self.digits(value)
    }

    fn even(&mut self, low: f64, high: f64) -> f64 {
        let value = self.random.even(low, high);
        self.digits(value)
    }

    fn kind(&mut self, kind: StageKind) {
        if !self.kinds.contains(&kind) {
            self.kinds.push(kind);
        }
    }

    fn faster(&mut self, rate: f64) {
        self.fastest = self.fastest.max(rate);
    }

    fn table(&mut self, name: &str) {
        let _ = writeln!(self.text, "\n[{name}]");
    }

    fn line(&mut self, key: &str, value: f64) {
        let value = self.digits(value);
        let _ = writeln!(self.text, "{key} = {value:e}");
    }

    fn sizes(&mut self) -> Sizes {
        let wide = self.random.chance(0.5) && !self.is_by_recipe();
        let (mass, stiffness) = match wide {
            true => {
                self.kind(StageKind::Wide);
                ([0; 3].map(|_| self.decades(1e-3, 1e3)), [0; 3].map(|_| self.decades(1e2, 1e8)))
            }
            false => {
                let (m, k) = (self.random.decades(1e-2, 1e2), self.random.decades(1e3, 1e7));
                ([0; 3].map(|_| self.decades(0.1 * m, 10.0 * m)), [0; 3].map(|_| self.decades(0.1 * k, 10.0 * k)))
            }
        };
        let (mut mass, mut stiffness) = (mass, stiffness);
        let symmetric = self.random.chance(0.15);
        if symmetric {
            self.kind(StageKind::Symmetric);
            (mass[2], stiffness[1]) = (mass[0], stiffness[0]);
        }
        let damped = self.random.chance(0.5);
        let mut damping = [0.0; 3];
        for (damping, k) in damping.iter_mut().zip(stiffness) {
            let ratio = self.random.decades(1e-4, 1.0);
            let lightest = mass.iter().copied().fold(f64::MAX, f64::min);
            if damped && self.random.chance(0.9) {
                *damping = self.digits(2.0 * ratio * (k * lightest).sqrt());
            }
        }
        if symmetric {
            damping[1] = damping[0];
        }
        let model = match self.random.below(8) {
            0 => "two-mass",
            1 => "rigid",
            _ => "elastic",
        };
        // A rigid belt has no spans, and a gantry is elastic.
        let has_spans = [Feature::Slack, Feature::Follows, Feature::HFrame, Feature::CoreXy, Feature::DualBelt];
        let model = if has_spans.into_iter().any(|one| self.wants(one)) { "elastic" } else { model };
        if model != "elastic" {
            self.kind(StageKind::Reduced);
        }
        let [k1, k2, k3] = stiffness;
        let [c1, c2, c3] = damping;
        for (k, c, m) in [(k1 + k3, c1 + c3, mass[0]), (k1 + k2, c1 + c2, mass[1]), (k2 + k3, c2 + c3, mass[2])] {
            self.faster((2.0 * k / m).sqrt().max(2.0 * c / m));
        }
        if model == "rigid" {
            self.fastest *= self.random.decades(1e-3, 1.0);
        }
        let most = if self.is_by_recipe() { 600.0 } else { 5000.0 };
        let time = self.random.decades(100.0, most) / self.fastest;
        let all: f64 = mass.iter().sum();
        let softest = stiffness.iter().copied().fold(f64::MAX, f64::min);
        let way = self.random.decades(1e-6, 0.3);
        // What moves everything so far in that time, as long as it strains no span too far.
        let force = (all * way / (time * time)).min(softest * 0.05);
        Sizes { radius: self.decades(2e-3, 0.3), mass, stiffness, damping, model, symmetric, time, way, force }
    }

    fn machine(mut self, title: String, sizes: Sizes, lines: Random) -> Drawn {
        let _ = writeln!(self.text, "title = \"{title}\"");
        let scale = self.motor(&sizes);
        self.bodies(&sizes);
        self.belt(&sizes);
        let start = self.place();
        self.lines(&sizes, start, lines);
        self.travel(&sizes, start);
        match self.is_loop() {
            true => self.motion(&sizes, &scale),
            false => self.experiment(&sizes, start, &scale),
        }
        self.kinds.sort();
        Drawn { text: self.text, kinds: self.kinds }
    }
}
