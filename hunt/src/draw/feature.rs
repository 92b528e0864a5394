//! Features of a case, which of them go together, and recipes in which each pair that can occur does so.

use super::Random;
use crate::by::By;

/// A feature of a case, or a way of asking about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// One belt round two drives.
    HFrame,
    /// Two belts.
    CoreXy,
    /// Three belts, and three drives.
    DualBelt,
    /// Stribeck friction, gaussian.
    Stribeck,
    /// Stribeck friction, exponential.
    Exponential,
    /// Simscape's law.
    Smooth,
    /// Bristles.
    LuGre,
    /// Friction that changes along the travel.
    Along,
    /// Forces on the cart that are lines.
    Line,
    /// A compliant gear.
    Gear,
    /// A gear with losses.
    Losses,
    /// Limits of voltage or current.
    Limit,
    /// Spans that go slack.
    Slack,
    /// End stops.
    Stop,
    /// Spans that follow the cart.
    Follows,
    /// Inductance.
    Inductance,
    /// Current mode.
    Current,
    /// A step or a pulse.
    Step,
    /// A ramp.
    Ramp,
    /// A sine.
    Sine,
    /// A table.
    Table,
    /// A triangle.
    Triangle,
    /// An input that begins late, a controller with a delay.
    Late,
    /// An open loop.
    Open,
    /// PID.
    Pid,
    /// Cascade.
    Cascade,
    /// Cascade with a sampled current loop.
    CurrentLoop,
    /// State feedback.
    StateFeedback,
    /// Sliding mode.
    SlidingMode,
    /// Fuzzy rules.
    Fuzzy,
    /// A way of asking.
    Asked(By),
}

use Feature::{
    Along, Asked, Cascade, CoreXy, Current, CurrentLoop, DualBelt, Exponential, Follows, Fuzzy, Gear, HFrame,
    Inductance, Late, Limit, Line, Losses, LuGre, Open, Pid, Ramp, Sine, Slack, SlidingMode, Smooth, StateFeedback,
    Step, Stop, Stribeck, Table, Triangle,
};

impl Feature {
    /// All that pairs are drawn of. A dual belt is drawn in place of another machine: see [`super::dual_belt`].
    pub const ALL: [Feature; 35] = [
        HFrame,
        CoreXy,
        Stribeck,
        Exponential,
        Smooth,
        LuGre,
        Along,
        Line,
        Gear,
        Losses,
        Limit,
        Slack,
        Stop,
        Follows,
        Inductance,
        Current,
        Step,
        Ramp,
        Sine,
        Table,
        Triangle,
        Late,
        Open,
        Pid,
        Cascade,
        CurrentLoop,
        StateFeedback,
        SlidingMode,
        Fuzzy,
        Asked(By::Exact),
        Asked(By::General),
        Asked(By::CoSimulation),
        Asked(By::ModelExchange),
        Asked(By::C),
        Asked(By::Sweep),
    ];

    /// Its name, and a short one for a table.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            HFrame => ["H-frame", "H"],
            CoreXy => ["CoreXY", "XY"],
            DualBelt => ["dual belt", "DB"],
            Stribeck => ["Stribeck curve", "St"],
            Exponential => ["Stribeck curve, exponential", "Ex"],
            Smooth => ["smooth law", "Sm"],
            LuGre => ["LuGre bristles", "Lu"],
            Along => ["friction along the travel", "Al"],
            Line => ["force line", "Li"],
            Gear => ["compliant gear", "Ge"],
            Losses => ["gear with losses", "Lo"],
            Limit => ["limit of voltage or current", "Lm"],
            Slack => ["spans that go slack", "Sl"],
            Stop => ["end stops", "Es"],
            Follows => ["spans that follow", "Fo"],
            Inductance => ["inductance", "In"],
            Current => ["current mode", "Cu"],
            Step => ["step or pulse", "sp"],
            Ramp => ["ramp", "ra"],
            Sine => ["sine", "si"],
            Table => ["table", "ta"],
            Triangle => ["triangle", "tr"],
            Late => ["delay", "de"],
            Open => ["open loop", "ol"],
            Pid => ["PID", "PI"],
            Cascade => ["cascade", "Ca"],
            CurrentLoop => ["cascade with current loop", "CC"],
            StateFeedback => ["state feedback", "LQ"],
            SlidingMode => ["sliding mode", "SM"],
            Fuzzy => ["fuzzy rules", "Fz"],
            Asked(By::Exact) => ["exact solver", "EX"],
            Asked(By::General) => ["general solver", "GE"],
            Asked(By::CoSimulation) => ["FMU, co-simulation", "CS"],
            Asked(By::ModelExchange) => ["FMU, model exchange", "ME"],
            Asked(By::C) => ["C", "C"],
            Asked(By::Sweep) => ["row of a sweep", "SW"],
        }
    }

    /// True if it is a kind of gantry.
    pub fn is_gantry(self) -> bool {
        matches!(self, HFrame | CoreXy | DualBelt)
    }

    /// True if the general solver alone has it.
    pub fn is_curved(self) -> bool {
        matches!(self, Stribeck | Exponential | Smooth | LuGre | Along | Follows)
    }

    /// True if it is a law of friction.
    pub fn is_law(self) -> bool {
        matches!(self, Stribeck | Exponential | Smooth | LuGre)
    }

    /// True if it is a shape of an input.
    pub fn is_input(self) -> bool {
        matches!(self, Step | Ramp | Sine | Table | Triangle)
    }

    /// True if it is a controller.
    pub fn is_controller(self) -> bool {
        matches!(self, Pid | Cascade | CurrentLoop | StateFeedback | SlidingMode | Fuzzy)
    }

    /// True if both can be features of one case.
    pub fn goes_with(self, other: Feature) -> bool {
        let either = |a: fn(Feature) -> bool, b: fn(Feature) -> bool| (a(self) && b(other)) || (a(other) && b(self));
        let excluded =
            // One of a kind.
            (self.is_gantry() && other.is_gantry())
            || (self.is_controller() && other.is_controller())
            || matches!((self, other), (Asked(_), Asked(_)))
            // A gantry has no forces along its travel and no controllers.
            || either(Feature::is_gantry, |f| matches!(f, Line | Along) || f.is_controller())
            // A move has no input, and an open loop no controller.
            || either(Feature::is_controller, |f| f == Open || f.is_input())
            || either(|f| f == Gear, |f| f == Losses)
            // Its gears are stiff.
            || either(|f| f == Gear, |f| f == DualBelt)
            // A current loop commands volts.
            || either(|f| f == CurrentLoop, |f| f == Current)
            || either(Feature::is_curved, |f| matches!(f, Asked(By::Exact | By::C)));
        self != other && !excluded
    }
}

/// All pairs that can occur.
pub fn pairs() -> Vec<[Feature; 2]> {
    let all = Feature::ALL.iter().enumerate();
    all.flat_map(|(i, &a)| Feature::ALL[i + 1..].iter().map(move |&b| [a, b]))
        .filter(|[a, b]| a.goes_with(*b))
        .collect()
}

/// The features of the case of this number: two that are its turn, and what goes with them by chance.
pub fn recipe(seed: u64, number: u64) -> Vec<Feature> {
    let pairs = pairs();
    let mut random = Random::new(seed ^ 0x7061_6972, number);
    let [a, b] = pairs[(number % pairs.len() as u64) as usize];
    let mut chosen = vec![a, b];
    let fits = |chosen: &[Feature], feature: Feature| {
        let laws = chosen.iter().filter(|one| one.is_law()).count();
        chosen.iter().all(|one| one.goes_with(feature)) && !(feature.is_law() && laws >= 2)
    };
    let mut order = Feature::ALL;
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i + 1));
    }
    // The way of asking, and whether the loop is closed, come first: they exclude most.
    let turn = |feature: &Feature| match feature {
        Asked(_) => 0,
        Open => 1,
        one if one.is_controller() => 1,
        one if one.is_gantry() => 2,
        one if one.is_input() => 4,
        _ => 3,
    };
    order.sort_by_key(turn);
    for feature in order {
        let share = match feature {
            Asked(By::Sweep) => 0.25,
            Asked(_) => 0.22,
            one if one.is_gantry() => 0.15,
            Open => 0.5,
            one if one.is_controller() => 0.1,
            one if one.is_law() || one.is_curved() => 0.12,
            _ => 0.25,
        };
        if random.chance(share) && fits(&chosen, feature) {
            chosen.push(feature);
        }
    }
    if !chosen.iter().any(|one| matches!(one, Asked(_))) {
        let general = chosen.iter().any(|one| one.is_curved());
        chosen.push(Asked(if general { By::General } else { By::Exact }));
    }
    if !chosen.iter().any(|one| *one == Open || one.is_controller()) {
        chosen.push(Open);
    }
    if chosen.contains(&Open) && !chosen.iter().any(|one| one.is_input()) {
        chosen.push([Step, Ramp, Sine, Table, Triangle][random.below(5)]);
    }
    chosen.sort();
    chosen
}
