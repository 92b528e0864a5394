//! Figures 4 to 17, 20 and 21, from the runs and the equations.

use super::findings::Findings;
use super::model::{Change, PULSE, Response, VOLTS};
use super::plots::{Curve, Plot};
use super::studies::{Effect, From};
use super::words::{mm, percent, si, um};
use taut::number::significant;
use taut_report::{Axis, Colour, Style};

/// A sentence of every caption where the paper shows a measurement.
const NO_MEASUREMENT: &str = "The paper shows a measured curve beside each: it is not available as data and nothing is drawn in its \
     place.";

/// How much of a run is drawn, s. Its data go on to the end, and nothing happens there any more.
const SHOWN: f64 = 0.5;

/// The quantity that is plotted over time.
#[derive(Clone, Copy, PartialEq)]
enum What {
    Position,
    Speed,
}

impl What {
    fn axis(self) -> Axis {
        match self {
            What::Position => Axis::new("Motor position r φ₁", "m"),
            What::Speed => Axis::new("Motor velocity r φ₁′", "m/s"),
        }
    }

    fn values(self, response: &Response) -> &[f64] {
        match self {
            What::Position => &response.position,
            What::Speed => &response.speed,
        }
    }

    fn word(self) -> &'static str {
        match self {
            What::Position => "Motor position",
            What::Speed => "Motor velocity",
        }
    }

    fn heading(self, of: &str, volts: f64) -> String {
        match self {
            What::Position => format!("position_{of}_{volts}V_m"),
            What::Speed => format!("speed_{of}_{volts}V_m_s"),
        }
    }
}

/// All plots of curves over time, and of the friction laws, in the paper's order.
pub fn figures(f: &Findings) -> Vec<Plot> {
    let mut all = vec![
        open_loop(f, 4, What::Position),
        open_loop(f, 5, What::Speed),
        stiffness(f, 6, What::Position, 2.0),
        stiffness(f, 7, What::Position, 0.5),
        stiffness(f, 8, What::Speed, 2.0),
        stiffness(f, 9, What::Speed, 0.5),
        inertia(f, 10, What::Position),
        inertia(f, 11, What::Speed),
        friction(f, 12, What::Position),
        friction(f, 13, What::Speed),
        matched(f, 14, What::Position),
        matched(f, 15, What::Speed),
    ];
    all.extend(super::laws::laws(f));
    all.extend([dry(f, 20, What::Position), dry(f, 21, What::Speed)]);
    all
}

fn over_time(number: u8, title: String, time: &[f64]) -> Plot {
    let title = format!("Figure {number}. {title}");
    Plot::new(format!("figure-{number:02}"), title, Axis::new("Time", "s"), "time_s", time)
        .up_to(SHOWN)
        .vertical(PULSE, "voltage off")
}

/// 10 V solid and 5 V dashed, in one colour.
fn base<'a>(responses: &'a [Response; 2], what: What, name: &str) -> Vec<Curve<'a>> {
    [(1, Style::Solid), (0, Style::Dashed)]
        .map(|(i, style)| one_curve(responses, i, what, name, Colour::Blue).style(style))
        .into()
}

/// Both solid, in two colours: for figures that show nothing else.
fn alone<'a>(responses: &'a [Response; 2], what: What, name: &str) -> Vec<Curve<'a>> {
    [(1, Colour::Blue), (0, Colour::Vermillion)].map(|(i, colour)| one_curve(responses, i, what, name, colour)).into()
}

fn one_curve<'a>(responses: &'a [Response; 2], i: usize, what: What, name: &str, colour: Colour) -> Curve<'a> {
    let volts = VOLTS[i];
    Curve::new(format!("{name}, {volts}\u{a0}V"), what.heading("nominal", volts), what.values(&responses[i]), colour)
}

fn open_loop(f: &Findings, number: u8, what: What) -> Plot {
    let runs = &f.runs.table1;
    let text = match what {
        What::Position => format!(
            "Pulses of 5 V and 10 V for 0.25 s. The motor comes to rest at {} and {}.",
            mm(runs[0].final_position()),
            mm(runs[1].final_position())
        ),
        What::Speed => format!(
            "The velocity settles at {} and {}, with a time constant of {}. The ripple is the belt's, at {} \
             and {}.",
            si(runs[0].plateau(), "m/s", 4),
            si(runs[1].plateau(), "m/s", 4),
            si(runs[0].time_constant(), "s", 3),
            si(f.linear.modes[0].first().map_or(f64::NAN, |m| m.frequency), "Hz", 4),
            si(f.linear.modes[0].get(1).map_or(f64::NAN, |m| m.frequency), "Hz", 4)
        ),
    };
    over_time(number, format!("{}, parameters of Table 1", what.word()), &runs[0].time)
        .panel(what.axis(), 1.0, alone(runs, what, "Table 1"))
        .caption(format!("{text} {NO_MEASUREMENT}"))
}

fn factor_word(factor: f64) -> String {
    format!("×\u{a0}{factor}")
}

fn varied<'a>(effects: &[&'a Effect], what: What, name: &str) -> Vec<Curve<'a>> {
    effects
        .iter()
        .map(|e| {
            let colour = if e.factor > 1.0 { Colour::Vermillion } else { Colour::Green };
            let word = factor_word(e.factor);
            let curve = Curve::new(
                format!("{name} {word}, {}\u{a0}V", e.volts),
                what.heading(&format!("{}_x{}", key(e.change), e.factor), e.volts),
                what.values(&e.response),
                colour,
            );
            if e.volts < 7.0 { curve.style(Style::Dashed) } else { curve }
        })
        .collect()
}

fn key(change: Change) -> &'static str {
    match change {
        Change::Stiffness => "stiffness",
        Change::PulleyInertia => "pulley_inertia",
        Change::AllInertia => "inertia",
        Change::Friction => "friction",
    }
}

fn stiffness(f: &Findings, number: u8, what: What, factor: f64) -> Plot {
    let effects = [10.0, 5.0].map(|volts| f.runs.one(From::Table1, Change::Stiffness, factor, volts));
    let runs = &f.runs.table1;
    let difference = |e: &Effect| -> Vec<f64> {
        let i = usize::from(e.volts > 7.0);
        what.values(&e.response).iter().zip(what.values(&runs[i])).map(|(a, b)| a - b).collect()
    };
    let differences = effects.map(difference);
    let change = match what {
        What::Position => Axis::new("Change", "m").shown_as("µm", 1e6),
        What::Speed => Axis::new("Change", "m/s").shown_as("mm/s", 1e3),
    };
    let mut plot = over_time(number, format!("{}, stiffness {}", what.word(), factor_word(factor)), &runs[0].time)
        .panel(what.axis(), 1.4, {
            let mut curves = base(runs, what, "Table 1");
            curves.extend(varied(&effects, what, "k"));
            curves
        });
    plot = plot.panel(
        change,
        0.7,
        effects
            .iter()
            .zip(&differences)
            .map(|(e, d)| {
                let colour = if e.volts > 7.0 { Colour::Blue } else { Colour::Vermillion };
                let heading = what.heading("change", e.volts);
                Curve::new(format!("change, {}\u{a0}V", e.volts), heading, d, colour)
            })
            .collect(),
    );
    let e = effects[1];
    let text = match what {
        What::Position => format!(
            "The curves lie on each other; below, their difference. At 5 V it is at most {}, {} of the \
             final position.",
            um(e.path * runs[0].final_position(), 3),
            super::words::share(e.path)
        ),
        What::Speed => format!(
            "The speed that is reached changes by {}, the oscillation between motor and cart by {}.",
            percent(e.plateau),
            percent(e.oscillation)
        ),
    };
    plot.caption(text)
}

fn inertia(f: &Findings, number: u8, what: What) -> Plot {
    let runs = &f.runs.table1;
    let panel = |change: Change, name: &str| {
        let effects: Vec<&Effect> =
            f.runs.effects.iter().filter(|e| e.from == From::Table1 && e.change == change).collect();
        let mut curves = base(runs, what, "Table 1");
        curves.extend(varied(&effects, what, name));
        curves
    };
    let one = |change, factor| f.runs.one(From::Table1, change, factor, VOLTS[0]);
    let text = match what {
        What::Position => format!(
            "Above the pulleys' inertia J alone, below J and the cart's mass M. All end at the same place: \
             the largest change is {}.",
            percent(super::studies::largest(
                f.runs.effects(From::Table1, &[Change::PulleyInertia, Change::AllInertia]),
                |e| e.final_position
            ))
        ),
        What::Speed => format!(
            "Above J alone, below J and M. Time constants at 5 V: {} as in Table 1; {} and {} for J × 2 and \
             × 0.5; {} and {} for J and M.",
            si(runs[0].time_constant(), "s", 3),
            si(one(Change::PulleyInertia, 2.0).time_constant, "s", 3),
            si(one(Change::PulleyInertia, 0.5).time_constant, "s", 3),
            si(one(Change::AllInertia, 2.0).time_constant, "s", 3),
            si(one(Change::AllInertia, 0.5).time_constant, "s", 3)
        ),
    };
    over_time(number, format!("{}, inertia × 2 and × 0.5", what.word()), &runs[0].time)
        .panel(what.axis(), 1.3, panel(Change::PulleyInertia, "J"))
        .panel(what.axis(), 1.3, panel(Change::AllInertia, "J, M"))
        .caption(text)
}

fn friction(f: &Findings, number: u8, what: What) -> Plot {
    let runs = &f.runs.table1;
    let effects: Vec<&Effect> = f.runs.effects(From::Table1, &[Change::Friction]).collect();
    let mut curves = base(runs, what, "Table 1");
    curves.extend(varied(&effects, what, "B, b"));
    let one = |factor| f.runs.one(From::Table1, Change::Friction, factor, VOLTS[0]);
    let text = match what {
        What::Position => format!(
            "Friction moves the final position by {} (× 2) and {} (× 0.5).",
            percent(one(2.0).final_position),
            percent(one(0.5).final_position)
        ),
        What::Speed => format!(
            "Friction moves the speed that is reached by {} (× 2) and {} (× 0.5), and the time constant \
             from {} to {} and {}.",
            percent(one(2.0).plateau),
            percent(one(0.5).plateau),
            si(runs[0].time_constant(), "s", 3),
            si(one(2.0).time_constant, "s", 3),
            si(one(0.5).time_constant, "s", 3)
        ),
    };
    over_time(number, format!("{}, friction × 2 and × 0.5", what.word()), &runs[0].time)
        .panel(what.axis(), 1.3, curves)
        .caption(text)
}

fn matched(f: &Findings, number: u8, what: What) -> Plot {
    let mut curves = base(&f.runs.table2, what, "Table 2");
    for (i, volts) in [(1, 10.0), (0, 5.0)] {
        let name = format!("Table 4, simulated, {volts}\u{a0}V");
        let heading = what.heading("table4", volts);
        let style = if i == 1 { Style::Solid } else { Style::Dashed };
        curves.push(Curve::new(name, heading, what.values(&f.runs.table4[i]), Colour::Vermillion).style(style));
    }
    let m = &f.matched;
    let (at_5, at_10, of) = match what {
        What::Position => (m.final_position[0], m.final_position[1], "final position"),
        What::Speed => (m.speed[0], m.speed[1], "velocity at 0.24 s"),
    };
    over_time(number, format!("{}, parameters of Table 2", what.word()), &f.runs.table2[0].time)
        .panel(what.axis(), 1.3, curves)
        .caption(format!(
            "In the second colour, for comparison, the non-linear model of Table 4, simulated. The linear set differs \
             from it in {of} by {} at 5 V and {} at 10 V. {NO_MEASUREMENT}",
            percent(at_5),
            percent(at_10)
        ))
}

fn dry(f: &Findings, number: u8, what: What) -> Plot {
    let runs = &f.runs.table4;
    let text = match what {
        What::Position => format!(
            "The motor comes to rest at {} and {}, the cart {} and {} beside it: friction holds the belt \
             strained.",
            mm(runs[0].final_position()),
            mm(runs[1].final_position()),
            um((runs[0].final_cart_position() - runs[0].final_position()).abs(), 2),
            um((runs[1].final_cart_position() - runs[1].final_position()).abs(), 2)
        ),
        What::Speed => format!(
            "All bodies are at rest after {} (5 V) and {} (10 V), after {} and {} stops of single bodies.",
            si(runs[0].stop_time().unwrap_or(f64::NAN), "s", 4),
            si(runs[1].stop_time().unwrap_or(f64::NAN), "s", 4),
            runs[0].stops_and_starts().0,
            runs[1].stops_and_starts().0
        ),
    };
    over_time(number, format!("{}, non-linear model of Table 4", what.word()), &runs[0].time)
        .panel(what.axis(), 1.0, alone(runs, what, "Table 4"))
        .caption(format!("{text} {NO_MEASUREMENT}"))
}

/// Table 3 after the pulse: how far each run is from where the exact solution comes to rest.
pub fn table3(f: &Findings) -> Plot {
    let t = &f.table3;
    let from = t.time.iter().position(|t| *t >= 0.28).unwrap_or(0);
    let rest = t.exact[0][t.exact[0].len() - 1];
    let time = &t.time[from..];
    let relative = |values: &[f64]| values[from..].iter().map(|v| v - rest).collect::<Vec<_>>();
    let exact = relative(&t.exact[0]);
    let runs: Vec<_> =
        t.runs.iter().filter(|r| r.volts == VOLTS[0] && r.method == taut::solve::Method::RungeKutta4).collect();
    let values: Vec<_> = runs.iter().map(|r| relative(&r.position)).collect();
    let mut curves: Vec<Curve> = runs
        .iter()
        .zip(&values)
        .zip(Colour::CYCLE)
        .map(|((r, v), colour)| {
            let step = si(r.step, "s", 1);
            Curve::new(format!("Table 3, step {step}"), format!("rk4_{:e}s_m", r.step), v, colour)
        })
        .collect();
    curves.push(Curve::new("exact", "exact_m", &exact, Colour::Ink));
    let axis = Axis::new("r φ₁ from its place of rest", "m").shown_as("µm", 1e6);
    Plot::new("table-3", "Table 3 after the 5 V pulse, classical Runge–Kutta", Axis::new("Time", "s"), "time_s", time)
        .panel(axis, 1.0, curves)
        .caption(format!(
            "The exact solution is at rest from {} on. With Table 3 the axis creeps, by an amount and in a \
             direction that depend on the step: {} in half a second.",
            si(f.runs.table4[0].stop_time().unwrap_or(f64::NAN), "s", 4),
            runs.iter().map(|r| format!("{} at {}", um(r.creep, 3), si(r.step, "s", 1))).collect::<Vec<_>>().join(", ")
        ))
}

/// The two elastic modes with the cart at other places.
pub fn travel(f: &Findings) -> Plot {
    let l1: Vec<f64> = f.linear.travel.iter().map(|(l, _)| *l).collect();
    let [first, second] = [0, 1].map(|i| f.linear.travel.iter().map(|(_, modes)| modes[i]).collect::<Vec<_>>());
    let low = first.iter().copied().fold(f64::INFINITY, f64::min);
    let high = first.iter().copied().fold(0.0, f64::max);
    Plot::new(
        "modes-along-the-travel",
        "Elastic modes of Table 2 along the travel",
        Axis::new("Length of span 1", "m"),
        "span1_m",
        &l1,
    )
    .panel(
        Axis::new("Frequency", "Hz"),
        1.0,
        vec![
            Curve::new("first", "first_mode_Hz", &first, Colour::Blue),
            Curve::new("second", "second_mode_Hz", &second, Colour::Vermillion),
        ],
    )
    .vertical(super::belt::INCHES.0, "l₁ = l₂")
    .caption(format!(
        "Spans 1 and 2 as long as the cart's place makes them, at least {}. The first mode moves \
             between {} and {} Hz. The paper's model keeps the cart's middle place.",
        si(super::linear::NEAREST, "m", 2),
        significant(low, 4),
        significant(high, 4)
    ))
}
