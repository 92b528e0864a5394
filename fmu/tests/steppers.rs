//! Closed-loop steppers inside an FMU, drawn at random, beside their moves.

use crate::common::steppers::in_loop;
use crate::unit::Random;
use std::sync::Arc;
use taut::case::Case;
use taut::control::{Setup, closed_loop};
use taut::export::fmu::{Model, Role};
use taut::machine::Machine;
use taut::signal::profile::{Profile, Reference};
use taut::solve::Solver;
use taut_fmu::instance::{Instance, Use};

fn drawn(number: u64, is_smooth: bool) -> String {
    let mut random = Random(91_000 + number);
    in_loop(number, || random.share(), is_smooth)
}

/// A case with its controller inside an instance, begun.
struct Inside {
    case: Case,
    profiles: Vec<Profile>,
    instance: Instance,
    references: Vec<u32>,
    slides: Vec<u32>,
}

impl Inside {
    fn new(text: &str, purpose: Use) -> Self {
        let case = Case::from_text("looped.toml", text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let model = Model::new(&case, true).unwrap();
        let of = |wanted: fn(Role) -> Option<usize>| -> Vec<u32> {
            let mut found: Vec<(usize, u32)> =
                model.variables.iter().filter_map(|own| Some((wanted(own.role)?, own.reference))).collect();
            found.sort_unstable();
            found.into_iter().map(|(_, reference)| reference).collect()
        };
        let references = of(|role| if let Role::Reference(k) = role { Some(k) } else { None });
        let names: &[&str] =
            if case.machine.drives.len() == 1 { &["cart_position"] } else { &["bridge_position", "cart_position"] };
        let slides = names
            .iter()
            .map(|name| model.variables.iter().find(|variable| variable.name == *name).expect("a slide").reference);
        let slides = slides.collect();
        let mut instance = Instance::new(Arc::new(model), purpose);
        instance.set_up(0.0, None).unwrap();
        instance.enter_initialization().unwrap();
        let profiles = case.moves[0].references(case.controller.as_ref().unwrap());
        let mut inside = Self { case, profiles, instance, references, slides };
        inside.refer(0.0);
        inside.instance.exit_initialization().unwrap();
        inside
    }

    /// Sets the references of a time, those behind a seam of the profile.
    fn refer(&mut self, time: f64) {
        let values: Vec<f64> = self
            .profiles
            .iter()
            .flat_map(|profile| {
                let Reference { position, speed, acceleration, jerk, snap } = profile.at(time + 1e-13);
                [position, speed, acceleration, jerk, snap]
            })
            .collect();
        self.instance.set_reals(&self.references, &values).unwrap();
    }

    fn positions(&mut self) -> Vec<f64> {
        let mut values = vec![0.0; self.slides.len()];
        self.instance.reals(&self.slides, &mut values).unwrap();
        values
    }

    /// Seams of the profiles, and samples of the controller, every `parts`-th one, up to `until`.
    fn points(&self, parts: usize, until: f64) -> Vec<f64> {
        let every = parts as f64 * self.case.controller.as_ref().unwrap().every;
        let mut points = Profile::seams(&self.profiles);
        points.extend((1..).map(|k| f64::from(k) * every).take_while(|time| *time < until));
        points.retain(|time| *time > 0.0 && *time < until);
        points.push(until);
        points.sort_by(f64::total_cmp);
        points.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        points
    }

    /// Errors of the slides at a time of the move that `taut move` runs.
    fn wanted(&self, until: f64) -> Vec<f64> {
        let (design, shown) = (self.case.controller.as_ref().unwrap(), &self.case.moves[0]);
        let machine: &Machine = &self.case.machine;
        let setup = Setup {
            window: shown.window,
            solver: Solver::for_machine(machine),
            ..Setup::new(machine, design, &shown.profiles, until)
        };
        let run = closed_loop(&setup).unwrap();
        assert!(run.metrics.in_step());
        run.figures.loads.iter().map(|load| load.error.last).collect()
    }
}

/// Between two settings of its reference, the field of a stepper inside stood still: the cart was up to a step of the
/// importer behind. The reference goes on by its derivatives, also with steps of three samples.
#[test]
fn the_loop_of_a_stepper_inside_is_that_of_its_move() {
    for seed in 0..12 {
        for parts in [1, 3] {
            let text = drawn(seed, false);
            let mut one = Inside::new(&text, Use::CoSimulation { events: false, early: false });
            for until in [0.03, 0.15] {
                let wanted = one.wanted(until);
                let from = one.instance.time();
                for point in one.points(parts, until).into_iter().filter(|point| *point > from) {
                    let time = one.instance.time();
                    one.refer(time);
                    let end = one.instance.step_end(time, point - time).unwrap();
                    one.instance.go(end, false).unwrap();
                }
                let positions = one.positions();
                for ((position, profile), wanted) in positions.iter().zip(&one.profiles).zip(&wanted) {
                    let off = profile.at(until).position - position - wanted;
                    println!("{seed} {parts} {until}: {off:.1e} m");
                    assert!(off.abs() < 1e-8, "{seed} {parts} {until}: {off:e} m\n{text}");
                }
            }
        }
    }
}

/// Model exchange by the classical formula, with a step far below the delay of the chopper's regulator.
#[test]
fn the_loop_of_a_stepper_in_model_exchange_is_that_of_its_move() {
    const STEP: f64 = 2e-6;
    for seed in 0..3 {
        let text = drawn(seed, true);
        let mut one = Inside::new(&text, Use::ModelExchange);
        let until = 0.02;
        let wanted = one.wanted(until);
        let mut next = one.instance.settle().unwrap().next;
        let mut x = vec![0.0; one.instance.model().quantities.len()];
        one.instance.states(&mut x).unwrap();
        for point in one.points(1, until) {
            while one.instance.time() < point {
                let time = one.instance.time();
                let end = (time + STEP).min(point).min(next.unwrap_or(f64::INFINITY));
                let h = end - time;
                let mut rate = |time: f64, x: &[f64]| -> Vec<f64> {
                    one.instance.set_time(time).unwrap();
                    one.instance.set_states(x).unwrap();
                    let mut rates = vec![0.0; x.len()];
                    one.instance.rates(&mut rates).unwrap();
                    rates
                };
                let along = |k: &[f64], by: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
                let k1 = rate(time, &x);
                let k2 = rate(time + h / 2.0, &along(&k1, h / 2.0));
                let k3 = rate(time + h / 2.0, &along(&k2, h / 2.0));
                let k4 = rate(end, &along(&k3, h));
                x = (0..x.len()).map(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])).collect();
                one.instance.set_time(end).unwrap();
                one.instance.set_states(&x).unwrap();
                if next.is_some_and(|next| next <= end) || end >= point {
                    one.refer(end);
                    next = one.instance.settle().unwrap().next;
                }
            }
        }
        let positions = one.positions();
        for ((position, profile), wanted) in positions.iter().zip(&one.profiles).zip(&wanted) {
            let off = profile.at(until).position - position - wanted;
            println!("{seed}: {off:.1e} m");
            assert!(off.abs() < 1e-8, "{seed}: {off:e} m\n{text}");
        }
    }
}
