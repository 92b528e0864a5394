//! Whether the machine can follow a reference: what that needs of motor, amplifier, belt and travel, and their limits.

use super::compensation::{Compensation, direction};
use crate::case::{Case, Move};
use crate::design::FeedForward;
use crate::machine::rigid::Rigid;
use crate::machine::{AmplifierMode, Machine};
use crate::number::engineering;
use crate::signal::profile::{Profile, Reference};

/// Instants of a reference that are looked at.
const INSTANTS: usize = 4000;

/// A limit that a reference needs more than.
#[derive(Debug, Clone, PartialEq)]
pub struct Shortfall {
    /// `voltage`, `current`, `breakaway`, `travel`, `slack`, `tension` or `teeth`.
    pub limit: &'static str,
    /// When most is needed, s.
    pub time: f64,
    /// Where the reference is then, m.
    pub position: f64,
    /// How much is needed, in `unit`.
    pub needed: f64,
    /// How much there is.
    pub allowed: f64,
    /// V, A, N or m.
    pub unit: &'static str,
    /// All of it in a sentence.
    pub words: String,
}

/// The need at one instant of a reference.
struct Need {
    time: f64,
    y: Reference,
    /// Force of the motor at the belt, N; motor current, A; voltage at its terminals, V.
    force: f64,
    current: f64,
    voltage: f64,
    /// Forces in the spans, counted from the pretension, N.
    spans: [f64; 3],
}

/// A limit of the machine and the need that it bounds, with the words before, behind and after what is needed.
struct Demand {
    limit: &'static str,
    unit: &'static str,
    allowed: f64,
    needed: Box<dyn Fn(&Need) -> f64>,
    words: [&'static str; 3],
}

/// Most that a reference needs of something limited, and the limit, both in `unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// `voltage`, `current`, `slack`, `tension` or `teeth`.
    pub limit: &'static str,
    /// V, A or N.
    pub unit: &'static str,
    /// How much is needed at most.
    pub needed: f64,
    /// How much there is.
    pub allowed: f64,
}

impl Load {
    /// Whether the motor's supply bounds it, of which a loop needs some for itself.
    pub fn is_electrical(&self) -> bool {
        ["V", "A"].contains(&self.unit)
    }
}

/// The limits of this machine under a controller with this limit of its command (V or A).
fn demands(machine: &Machine, limit: Option<f64>) -> Vec<Demand> {
    let (volts, amperes) = limits(machine, limit);
    let belt = &machine.belt;
    let pretension = belt.pretension.unwrap_or(0.0);
    let off = |need: &Need| -need.spans.iter().copied().fold(0.0, f64::min);
    let tension = move |need: &Need| pretension + need.spans.iter().copied().fold(0.0, f64::max);
    let carried = belt.sheet.mesh(machine.pulley_radius).and_then(|(_, carried)| carried);
    type Needed = Box<dyn Fn(&Need) -> f64>;
    let demand = |(limit, unit), allowed: Option<f64>, needed: Needed, words| {
        allowed.map(|allowed| Demand { limit, unit, allowed, needed, words })
    };
    let all = [
        demand(("voltage", "V"), volts, Box::new(|need| need.voltage.abs()), ["needs", "", "; the limit is"]),
        demand(("current", "A"), amperes, Box::new(|need| need.current.abs()), ["needs", "", "; the limit is"]),
        demand(
            ("slack", "N"),
            belt.pretension,
            Box::new(off),
            ["takes", " off a span", ", which goes slack; the pretension is"],
        ),
        demand(
            ("tension", "N"),
            belt.sheet.allowed_tension,
            Box::new(tension),
            ["brings a span to", "", "; the belt may have"],
        ),
        demand(
            ("teeth", "N"),
            carried,
            Box::new(|need| need.force.abs()),
            ["takes", " at the drive pulley", "; the teeth in mesh carry"],
        ),
    ];
    all.into_iter().flatten().collect()
}

/// How much of each limit `profile` needs at most, looked at `instants` times along its way.
pub fn loads(machine: &Machine, limit: Option<f64>, profile: &Profile, instants: usize) -> Vec<Load> {
    let needs = needs(machine, profile, instants);
    let load = |demand: Demand| {
        let needed = needs.iter().map(&demand.needed).fold(0.0, f64::max);
        Load { limit: demand.limit, unit: demand.unit, needed, allowed: demand.allowed }
    };
    demands(machine, limit).into_iter().map(load).collect()
}

/// The limits that `profile`, shaper included, exceeds on this machine under a controller with this limit of its command
/// (V or A); none if the reference can be followed. Friction counts as viscous and Coulomb friction, the idler's own
/// swing as quasi-static.
pub fn shortfalls(machine: &Machine, limit: Option<f64>, profile: &Profile) -> Vec<Shortfall> {
    let needs = needs(machine, profile, INSTANTS);
    let (volts, amperes) = limits(machine, limit);
    let mut found: Vec<Shortfall> = Vec::new();
    for demand in demands(machine, limit) {
        let by_speed = if demand.limit == "voltage" { of_speed(machine, volts, &needs) } else { None };
        found.extend(by_speed.or_else(|| exceeded(&needs, &demand)));
    }
    found.extend(of_breakaway(machine, (volts, amperes), &needs));
    found.extend(of_travel(machine, &needs));
    found
}

/// A value in a sentence.
fn told(value: f64, unit: &str) -> String {
    engineering(value, unit, 3)
}

impl Need {
    /// Time and place, in a sentence.
    fn when(&self) -> String {
        format!("at {}, {}", told(self.time, "s"), told(self.y.position, "m"))
    }

    /// The limit that it exceeds.
    fn beyond(&self, limit: &'static str, [needed, allowed]: [f64; 2], unit: &'static str, words: String) -> Shortfall {
        Shortfall { limit, time: self.time, position: self.y.position, needed, allowed, unit, words }
    }
}

/// The instant at which most is needed, where that is more than there is.
fn most(needs: &[Need], allowed: f64, needed: impl Fn(&Need) -> f64) -> Option<&Need> {
    let most = needs.iter().max_by(|a, b| needed(a).total_cmp(&needed(b)))?;
    (needed(most) - allowed > 1e-9 * allowed.abs().max(1.0)).then_some(most)
}

/// The limit where the motion exceeds it.
fn exceeded(needs: &[Need], demand: &Demand) -> Option<Shortfall> {
    let Demand { limit, unit, allowed, needed, words: [comes_by, behind, there] } = demand;
    let need = most(needs, *allowed, needed)?;
    let (speed, acceleration) = (told(need.y.speed.abs(), "m/s"), told(need.y.acceleration.abs(), "m/s^2"));
    let words = format!(
        "{acceleration} at {speed} {comes_by} {}{behind} ({}){there} {}",
        told(needed(need), unit),
        need.when(),
        told(*allowed, unit)
    );
    Some(need.beyond(limit, [needed(need), *allowed], unit, words))
}

/// The voltage, where the largest speed needs too much of it without any acceleration.
fn of_speed(machine: &Machine, volts: Option<f64>, needs: &[Need]) -> Option<Shortfall> {
    let (volts, rigid) = (volts?, Rigid::of(machine));
    most(needs, volts, |need| need.voltage.abs())?;
    let steady = |speed: f64| {
        let (viscous, dry) = rigid.friction(speed, speed.signum());
        rigid.electrical(viscous + dry - rigid.constant, 0.0, speed).1.abs()
    };
    let fastest = needs.iter().max_by(|a, b| a.y.speed.abs().total_cmp(&b.y.speed.abs()))?;
    let speed = fastest.y.speed;
    let (at_rest, needed) = (steady(1e-9 * speed), steady(speed));
    if needed <= volts {
        return None;
    }
    // Voltage is a straight line of the speed.
    let reached = speed.abs() * ((volts - at_rest) / (needed - at_rest)).max(0.0);
    let words = format!(
        "{} needs {} ({}); {} reach {}",
        told(speed.abs(), "m/s"),
        told(needed, "V"),
        fastest.when(),
        told(volts, "V"),
        told(reached, "m/s")
    );
    Some(fastest.beyond("voltage", [needed, volts], "V", words))
}

/// The force that moves everything from rest, where the motor gives less at standstill.
fn of_breakaway(machine: &Machine, (volts, amperes): (Option<f64>, Option<f64>), needs: &[Need]) -> Option<Shortfall> {
    let (current, voltage) = Rigid::of(machine).electrical(1.0, 0.0, 0.0);
    let force = [volts.map(|volts| volts / voltage), amperes.map(|amperes| amperes / current)];
    let force = force.into_iter().flatten().reduce(f64::min)?;
    needs.iter().find_map(|need| {
        let side = direction(&need.y);
        let needed = machine.breakaway(side, need.y.position);
        let words = || format!("to break away takes {}; the motor gives {}", told(needed, "N"), told(force, "N"));
        (side != 0.0 && needed > force).then(|| need.beyond("breakaway", [needed, force], "N", words()))
    })
}

/// The end of the travel, where the reference goes beyond it.
fn of_travel(machine: &Machine, needs: &[Need]) -> Option<Shortfall> {
    let travel = machine.cart.travel?;
    let need = most(needs, 0.0, |need| (need.y.position - travel.max).max(travel.min - need.y.position))?;
    let position = need.y.position;
    let end = if position > travel.max { travel.max } else { travel.min };
    let words = format!(
        "the reference goes to {} (at {}); the travel ends at {}",
        told(position, "m"),
        told(need.time, "s"),
        told(end, "m")
    );
    Some(need.beyond("travel", [position, end], "m", words))
}

/// The shortfalls of each move of a case under its controller, with the name of the move; moves without one are left out.
pub fn of_moves(case: &Case) -> Vec<(&str, Vec<Shortfall>)> {
    let Some(design) = &case.controller else { return Vec::new() };
    let short = |motion: &Move| shortfalls(&case.machine, design.limit, &motion.reference(design));
    let moves = case.moves.iter().map(|motion| (&*motion.name, short(motion)));
    moves.filter(|(_, short)| !short.is_empty()).collect()
}

/// In a sentence, all of a move's.
pub fn sentence(name: &str, short: &[Shortfall]) -> String {
    let words: Vec<&str> = short.iter().map(|short| &*short.words).collect();
    format!("the move \"{name}\" cannot be followed: {}", words.join("; "))
}

/// The tightest limits of voltage and current, V and A.
pub(crate) fn limits(machine: &Machine, limit: Option<f64>) -> (Option<f64>, Option<f64>) {
    let amplifier = &machine.drives[0].amplifier;
    let commanded = limit.map(|limit| limit * amplifier.gain.abs());
    let least = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::min);
    match amplifier.mode {
        AmplifierMode::Voltage => (least(amplifier.voltage_limit, commanded), amplifier.current_limit),
        AmplifierMode::Current => (amplifier.voltage_limit, least(amplifier.current_limit, commanded)),
    }
}

fn needs(machine: &Machine, profile: &Profile, instants: usize) -> Vec<Need> {
    let compensation = Compensation::new(machine, &FeedForward::NONE);
    let lines = &machine.cart.forces;
    let need = |time: f64| {
        let y = profile.at(time);
        let needed = compensation.needed(&y);
        let of_lines = lines.along.as_ref().map_or(0.0, |line| line.value(y.position))
            + lines.by_speed.as_ref().map_or(0.0, |line| line.value(y.speed));
        let force = needed.force[0] - of_lines;
        let (current, voltage) = compensation.rigid.electrical(force, needed.force[1], needed.drive.speed);
        Need { time, y, force, current, voltage, spans: needed.spans }
    };
    let end = profile.rest();
    (0..=instants).map(|k| need(end * k as f64 / instants as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Setup, closed_loop};
    use crate::machine::Travel;
    use crate::metrics::{Balance, balanced_speed};
    use crate::solve::Solver;
    use std::path::Path;

    fn case() -> Case {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages/sollmann-jouaneh/controllers");
        let mut case = Case::read(folder.join("pid-elastic.toml")).unwrap();
        (case.machine.drives[0].amplifier.voltage_limit, case.machine.drives[0].amplifier.current_limit) = (None, None);
        case
    }

    /// The motor gets what a reference needs where a loop follows it closely.
    #[test]
    fn needs_are_those_of_a_loop_that_follows_closely() {
        let case = case();
        let design = case.controller.as_ref().unwrap();
        for motion in &case.moves {
            let setup = Setup {
                machine: &case.machine,
                model: &case.machine,
                design,
                profile: &motion.profile,
                until: motion.until,
                window: motion.window,
                solver: Solver::Exact,
            };
            let figures = closed_loop(&setup).unwrap().figures;
            let needs = needs(&case.machine, &motion.profile, INSTANTS);
            let most = |value: fn(&Need) -> f64| needs.iter().map(value).fold(0.0, |most, x| x.abs().max(most));
            let (volts, amperes) = (most(|need| need.voltage), most(|need| need.current));
            let (given, taken) = (figures.voltage.0.value.abs(), figures.current.0.value.abs());
            assert!((volts / given - 1.0).abs() < 0.1, "{}: {volts} V, {given} V in the loop", motion.name);
            assert!((amperes / taken - 1.0).abs() < 0.25, "{}: {amperes} A, {taken} A in the loop", motion.name);
        }
    }

    /// Each limit is named a tenth below what is needed, and not a tenth above it.
    #[test]
    fn each_limit_is_named_where_it_is_exceeded() {
        let case = case();
        let motion = &case.moves[0];
        let needs = needs(&case.machine, &motion.profile, INSTANTS);
        let most = |value: &dyn Fn(&Need) -> f64| needs.iter().map(value).fold(0.0, f64::max);
        let volts = most(&|need| need.voltage.abs());
        let amperes = most(&|need| need.current.abs());
        let far = most(&|need| need.y.position);
        let off = most(&|need| -need.spans.iter().copied().fold(0.0, f64::min));
        let on = most(&|need| need.spans.iter().copied().fold(0.0, f64::max));
        let away = case.machine.breakaway(1.0, 0.0) / Rigid::of(&case.machine).force_per_command();
        type Set = fn(&mut Machine, f64) -> Option<f64>;
        let limits: [(&str, f64, Set); 6] = [
            ("voltage", volts, |machine, most| {
                machine.drives[0].amplifier.voltage_limit = Some(most);
                None
            }),
            ("voltage", volts, |_, most| Some(most)),
            ("current", amperes, |machine, most| {
                machine.drives[0].amplifier.current_limit = Some(most);
                None
            }),
            ("travel", far, |machine, most| {
                machine.cart.travel = Some(Travel { min: -1.0, max: most, stop: None });
                None
            }),
            ("slack", off, |machine, most| {
                machine.belt.pretension = Some(most);
                None
            }),
            ("tension", on, |machine, most| {
                machine.belt.sheet.allowed_tension = Some(most);
                None
            }),
        ];
        for (limit, needed, set) in limits {
            for share in [0.9, 1.1] {
                let mut machine = case.machine.clone();
                let own = set(&mut machine, share * needed);
                let found = shortfalls(&machine, own, &motion.profile);
                if share > 1.0 {
                    assert_eq!(found, [], "{limit} at {share}");
                    continue;
                }
                let [short] = &found[..] else { panic!("{limit} at {share}: {found:?}") };
                assert_eq!(short.limit, limit);
                assert!((short.allowed - share * needed).abs() <= 1e-12 * needed, "{short:?}");
                assert!(short.needed > short.allowed && short.time >= 0.0 && !short.words.is_empty(), "{short:?}");
            }
        }
        let names = |limit: f64| -> Vec<&str> {
            shortfalls(&case.machine, Some(limit), &motion.profile).iter().map(|short| short.limit).collect()
        };
        assert!(names(0.9 * away).contains(&"breakaway") && !names(1.1 * away).contains(&"breakaway"));
    }

    /// The speed that a voltage reaches is the steady speed of a run under it.
    #[test]
    fn the_speed_that_is_reached_is_the_steady_one() {
        let case = case();
        let motion = &case.moves[0];
        let volts =
            needs(&case.machine, &motion.profile, INSTANTS).iter().fold(0.0, |most, need| need.voltage.max(most)) * 0.5;
        let found = shortfalls(&case.machine, Some(volts), &motion.profile);
        let short = found.iter().find(|short| short.limit == "voltage").unwrap();
        let Balance::At(speed) = balanced_speed(&case.machine, volts, 0.1) else { panic!("no steady speed") };
        let told = engineering(speed, "m/s", 3);
        assert!(short.words.ends_with(&format!("reach {told}")), "{} and {told}", short.words);
    }
}
