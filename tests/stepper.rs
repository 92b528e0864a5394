//! Steppers against an integration of their own: the two phases, rotor and belt by the classical formula with steps of
//! a microsecond, which shares nothing with the solvers. Also limit laws that hold by hand.

use crate::common::chance::Chance;
use crate::common::logged::fitted_in_steps;
use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use taut::case::{Case, Move};
use taut::control::feedback::Feedback;
use taut::control::recommendation::{self, recommend};
use taut::control::{Loop, MoveRun, Rows, Setup, Standard, closed_loop, each, stream};
use taut::fit::{Finding, Fit, Grade, fit};
use taut::linear::{Analysis, Hold, Operation, Question, Root, StateSpace, System};
use taut::machine::Travel;
use taut::measure::measure;
use taut::mechanism::{Status, What};
use taut::overview::Overview;
use taut::reach::pull_out::{PullOut, short_supply};
use taut::reach::quickest::within_pull_out;
use taut::solve::{Ending, Flow, Solver, simulate};
use taut::trajectory::{CsvWriter, Trajectory};
use taut::tune::trouble::trouble;
use taut::tune::{Margins, Plant, tune};

/// Step of the integration, s.
const STEP: f64 = 1e-6;

/// A stepper with its driver.
#[derive(Debug, Clone)]
struct Motor {
    steps: f64,
    holding: f64,
    rated: f64,
    resistance: f64,
    inductance: f64,
    supply: f64,
    chopper: bool,
    microsteps: f64,
    interpolate: bool,
    detent: f64,
    rotor: f64,
}

impl Motor {
    /// Its table of a case file.
    fn table(&self) -> String {
        let drive = if self.chopper { "chopper" } else { "voltage" };
        format!(
            "[stepper]\nsteps_per_turn = {}\nholding_torque = {:e}\nrated_current = {:e}\nresistance = {:e}\n\
             inductance = {:e}\nsupply = {:e}\ndrive = \"{drive}\"\nmicrosteps = {}\ninterpolate = {}\ndetent_torque = {:e}\n\
             rotor_inertia = {:e}\n",
            self.steps,
            self.holding,
            self.rated,
            self.resistance,
            self.inductance,
            self.supply,
            self.microsteps,
            self.interpolate,
            self.detent,
            self.rotor,
        )
    }

    fn teeth(&self) -> f64 {
        self.steps / 4.0
    }

    /// Where the field goes for a commanded angle: to the nearest microstep, if the driver does not interpolate.
    fn field(&self, told: f64) -> f64 {
        let step = 2.0 * PI / (self.steps * self.microsteps);
        if self.interpolate { told } else { (told / step).round() * step }
    }

    /// The time at which the command of a step of this length from `time` on is taken: one that moves, in its middle.
    fn heard(&self, time: f64, h: f64) -> f64 {
        time + if self.interpolate { 0.5 * h } else { 1e-12 }
    }

    /// Torque, and the rates of both currents, at an angle and a speed of the rotor and a commanded angle.
    fn phases(&self, (angle, speed): (f64, f64), currents: [f64; 2], told: f64) -> (f64, [f64; 2]) {
        let k = self.holding * FRAC_1_SQRT_2 / self.rated;
        let rotor = self.teeth() * angle + PI / 4.0;
        let field = self.teeth() * told + PI / 4.0;
        let [a, b] = currents;
        let torque = k * (b * rotor.cos() - a * rotor.sin()) - self.detent * (4.0 * rotor).sin();
        let emf = [-k * speed * rotor.sin(), k * speed * rotor.cos()];
        let wanted = [field.cos(), field.sin()];
        let rates = [0, 1].map(|phase| {
            let i = currents[phase];
            let volts = match self.chopper {
                false => self.supply * wanted[phase],
                true => {
                    let regulated = 2.0 * PI * 1e4 * (2.0_f64.sqrt() * self.rated * wanted[phase] - i);
                    let volts = self.resistance * i + emf[phase] + self.inductance * regulated;
                    volts.max(-self.supply).min(self.supply)
                }
            };
            (volts - self.resistance * i - emf[phase]) / self.inductance
        });
        (torque, rates)
    }
}

/// A step of the classical formula.
fn classical<const N: usize>(y: &[f64; N], h: f64, rate: impl Fn(&[f64; N]) -> [f64; N]) -> [f64; N] {
    let add = |h: f64, k: &[f64; N]| -> [f64; N] { std::array::from_fn(|i| y[i] + h * k[i]) };
    let k1 = rate(y);
    let k2 = rate(&add(0.5 * h, &k1));
    let k3 = rate(&add(0.5 * h, &k2));
    let k4 = rate(&add(h, &k3));
    std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// A stepper axis on its way: u(t) = A (1 − cos 2πft), one period, and a rest.
#[derive(Debug, Clone)]
struct Axis {
    motor: Motor,
    radius: f64,
    /// Inertias of pulleys and mass of the cart, with viscous and Coulomb friction of each.
    inertia: [f64; 3],
    viscous: [f64; 3],
    coulomb: [f64; 3],
    stiffness: [f64; 3],
    damping: [f64; 3],
    amplitude: f64,
    frequency: f64,
    until: f64,
}

/// Angles, speeds, currents.
type State = [f64; 8];

impl Axis {
    fn drawn(chance: &mut Chance) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * chance.uniform();
        let ratio = |x: f64, y: f64, share: f64| x * (y / x).powf(share);
        let (holding, rated) = (ratio(0.1, 1.5, between(0.0, 1.0)), between(0.6, 4.0));
        let resistance = between(0.8, 2.5) / rated;
        let radius = between(5e-3, 1e-2);
        let rotor = 1.2e-5 * holding * between(0.7, 1.5);
        let (drive, idler, mass) = (between(5e-7, 2e-6), between(3e-7, 1e-6), between(0.1, 0.6));
        let total = mass + (rotor + drive + idler) / (radius * radius);
        let chopper = between(0.0, 1.0) < 0.8;
        let supply = if chopper { between(12.0, 48.0) } else { 2.0_f64.sqrt() * rated * resistance * 0.999 };
        let amplitude = between(1e-3, 6e-3);
        // The largest acceleration takes this share of the holding torque.
        let share = between(0.1, if chopper { 1.5 } else { 0.5 });
        let frequency = (share * holding / radius / total / amplitude).sqrt() / (2.0 * PI);
        let frequency = frequency.min(0.6 / amplitude / (2.0 * PI));
        let k = between(4e4, 2e5);
        let motor = Motor {
            steps: if between(0.0, 1.0) < 0.7 { 200.0 } else { 400.0 },
            holding,
            rated,
            resistance,
            inductance: resistance * between(1e-3, 3e-3),
            supply,
            chopper,
            microsteps: [1.0, 1.0, 2.0, 4.0, 8.0][(5.0 * between(0.0, 0.999)) as usize],
            interpolate: between(0.0, 1.0) < 0.3,
            detent: holding * between(0.0, 0.06),
            rotor,
        };
        Self {
            motor,
            radius,
            inertia: [drive, mass, idler],
            viscous: [between(1e-5, 3e-4), between(0.5, 8.0), between(1e-6, 2e-5)],
            coulomb: [holding * between(0.0, 0.05), holding / radius * between(0.0, 0.1), 0.0],
            stiffness: [k, k, 0.5 * k],
            damping: [2e-4 * k, 2e-4 * k, 1e-4 * k],
            amplitude,
            frequency,
            until: 1.0 / frequency + 0.01,
        }
    }

    fn case(&self) -> String {
        let [drive, cart, idler] = [0, 1, 2].map(|k| {
            let name = if k == 1 { "mass" } else { "inertia" };
            let (inertia, b, c) = (self.inertia[k], self.viscous[k], self.coulomb[k]);
            format!("{name} = {inertia:e}\nfriction = {{ viscous = {b:e}, coulomb = {c:e} }}\n")
        });
        format!(
            "{}[drive_pulley]\nradius = {:e}\n{drive}[cart]\n{cart}[idler_pulley]\n{idler}[belt]\n\
             stiffness = {:?}\ndamping = {:?}\n[[experiment]]\nname = \"there and back\"\nuntil = {:e}\nevery = 1e-3\n\
             input = {{ sequence = [{{ sine = {:e}, frequency = {:e}, phase = {:e}, offset = {:e}, lasts = {:e} }}, \
             {{ step = 0.0 }}] }}\n",
            self.motor.table(),
            self.radius,
            self.stiffness,
            self.damping,
            self.until,
            self.amplitude,
            self.frequency,
            -0.5 * PI,
            self.amplitude,
            1.0 / self.frequency,
        )
    }

    /// Position that the field is at, m.
    fn told(&self, time: f64) -> f64 {
        let told = match time * self.frequency < 1.0 {
            true => self.amplitude * (1.0 - (2.0 * PI * self.frequency * time).cos()),
            false => 0.0,
        };
        self.motor.field(told / self.radius) * self.radius
    }

    /// All that acts on the bodies but friction, and the rates of the currents.
    fn forces(&self, y: &State, told: f64) -> ([f64; 3], [f64; 2]) {
        let &[p1, x, p3, w1, v, w3, ia, ib] = y;
        let r = self.radius;
        let (torque, rates) = self.motor.phases((p1, w1), [ia, ib], told / r);
        let [k1, k2, k3] = self.stiffness;
        let [c1, c2, c3] = self.damping;
        let f1 = k1 * (r * p1 - x) + c1 * (r * w1 - v);
        let f2 = k2 * (x - r * p3) + c2 * (v - r * w3);
        let f3 = k3 * r * (p3 - p1) + c3 * r * (w3 - w1);
        ([torque - r * f1 + r * f3, f1 - f2, r * f2 - r * f3], rates)
    }

    fn inertias(&self) -> [f64; 3] {
        [self.inertia[0] + self.motor.rotor, self.inertia[1], self.inertia[2]]
    }

    fn rate(&self, y: &State, told: f64, motion: &[i8; 3]) -> State {
        let (load, currents) = self.forces(y, told);
        let mut rate = [y[3], y[4], y[5], 0.0, 0.0, 0.0, currents[0], currents[1]];
        for (k, &way) in motion.iter().enumerate() {
            if way == 0 && self.coulomb[k] > 0.0 {
                rate[k] = 0.0;
                continue;
            }
            let dry = f64::from(way) * self.coulomb[k];
            rate[3 + k] = (load[k] - dry - self.viscous[k] * y[3 + k]) / self.inertias()[k];
        }
        rate
    }

    fn step(&self, y: &State, h: f64, told: f64, motion: &[i8; 3]) -> State {
        classical(y, h, |y| self.rate(y, told, motion))
    }

    /// True if a step ends as it began: no body has reversed or broken away, and the command is the same.
    fn holds(&self, y: &State, time: f64, told: f64, motion: &[i8; 3]) -> bool {
        let (load, _) = self.forces(y, told);
        let body = |k: usize| match motion[k] {
            0 => load[k].abs() <= self.coulomb[k],
            way => f64::from(way) * y[3 + k] >= 0.0,
        };
        (0..3).all(|k| self.coulomb[k] == 0.0 || body(k)) && (self.motor.interpolate || self.told(time) == told)
    }

    /// Positions every millisecond, and when the rotor is half a tooth pitch off the field: times and pitches behind.
    fn integrate(&self) -> (Vec<[f64; 3]>, Vec<(f64, i32)>) {
        let mut y: State = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, self.motor.rated, self.motor.rated];
        if !self.motor.chopper {
            let at_rest = self.motor.supply / self.motor.resistance * FRAC_1_SQRT_2;
            (y[6], y[7]) = (at_rest, at_rest);
        }
        let (mut motion, mut time, mut behind) = ([0_i8; 3], 0.0, 0);
        let (mut rows, mut slips) = (vec![[0.0; 3]], Vec::new());
        while time < self.until - 1e-9 {
            let end = (rows.len() as f64 * 1e-3).min(self.until);
            let mut h = STEP.min(end - time);
            let told = self.told(self.motor.heard(time, h));
            for (k, motion) in motion.iter_mut().enumerate() {
                let load = self.forces(&y, told).0[k];
                if self.coulomb[k] > 0.0 && y[3 + k] == 0.0 {
                    *motion = if load.abs() <= self.coulomb[k] { 0 } else { load.signum() as i8 };
                }
            }
            let mut next = self.step(&y, h, told, &motion);
            if !self.holds(&next, time + h, told, &motion) {
                // Up to where it ceases to hold.
                let (mut low, mut high) = (0.0, h);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    let there = self.step(&y, middle, told, &motion);
                    if self.holds(&there, time + middle, told, &motion) { low = middle } else { high = middle }
                }
                (h, next) = (high, self.step(&y, high, told, &motion));
                for (speed, way) in next[3..6].iter_mut().zip(motion) {
                    if f64::from(way) * *speed < 0.0 {
                        *speed = 0.0;
                    }
                }
            }
            (y, time) = (next, time + h);
            let told = self.told(time + 1e-12);
            let pitches = ((told / self.radius - y[0]) * self.motor.teeth() / (2.0 * PI)).round() as i32;
            if pitches != behind {
                behind = pitches;
                slips.push((time, behind));
            }
            if (time - end).abs() < 1e-10 {
                rows.push([y[0], y[1], y[2]]);
            }
        }
        (rows, slips)
    }
}

/// How many machines are drawn: more with `TAUT_CASES`.
fn machines() -> u64 {
    std::env::var("TAUT_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(6)
}

#[test]
fn drawn_steppers_go_where_the_two_phases_take_them_and_lose_the_same_steps() {
    let (mut lost, mut kept) = (0, 0);
    for seed in 0..machines() {
        let axis = Axis::drawn(&mut Chance::new(3300 + seed));
        let text = axis.case();
        let case = Case::from_text("drawn.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let run = simulate(&case.machine, &case.experiments[0], Solver::GENERAL).unwrap();
        assert_eq!(run.outcome.ending, Ending::Complete, "{seed}\n{text}");
        assert_eq!(run.outcome.unmet, 0, "{seed}\n{text}");
        let (rows, slips) = axis.integrate();
        let own: Vec<(f64, i32)> = (run.outcome.events.iter())
            .filter_map(|event| match (event.part.what, event.to) {
                (What::Field(_), Status::Slipped(behind)) => Some((event.time, behind)),
                _ => None,
            })
            .collect();
        let first = slips.first().map_or(f64::INFINITY, |(time, _)| *time);
        let columns = ["drive_angle", "cart_position", "idler_angle"].map(|name| run.trajectory.get(name).unwrap());
        let mut most: f64 = 0.0;
        for (row, others) in rows.iter().enumerate().filter(|(row, _)| 1e-3 * (*row as f64) < first) {
            for (k, (own, other)) in columns.iter().map(|column| column[row]).zip(others).enumerate() {
                most = most.max((own - other).abs() * if k == 1 { 1.0 } else { axis.radius });
            }
        }
        // Where no tooth is lost, the general solver is as good as it promises.
        assert!(most < 2e-9, "{seed}: {most:.1e} m apart\n{text}");
        assert_eq!(own.is_empty(), slips.is_empty(), "{seed}: {own:?}, {slips:?}\n{text}");
        if let (Some(own), Some(other)) = (own.first(), slips.first()) {
            assert!((own.0 - other.0).abs() < 1e-3 && own.1 == other.1, "{seed}: {own:?}, {other:?}\n{text}");
        }
        assert_eq!(own.last().map(|slip| slip.1), slips.last().map(|slip| slip.1), "{seed}\n{text}");
        if slips.is_empty() { kept += 1 } else { lost += 1 }
    }
    assert!(lost > 0 && kept > 0, "{lost} lose steps, {kept} do not");
}

impl Motor {
    /// This motor on a driver that interpolates: a chopper with voltage for steps of a micrometre, or a voltage.
    fn smooth(&self, chopper: bool) -> Self {
        let supply = if chopper { 48.0 } else { 2.0_f64.sqrt() * self.rated * self.resistance * 0.999 };
        Self { interpolate: true, chopper, supply, ..self.clone() }
    }
}

/// Largest distance between a run after small steps of the commands, m, and the linear model of rest, sampled with a
/// zero-order hold: of these outputs at the belt relative to the largest step, and of the current across each rotor, by
/// prefix, angle and phases, relative to that of a rotor that does not move.
fn apart_from_linear(case: &Case, steps: &[f64], outputs: &[(&str, f64)], motors: &[(&str, [&str; 3])]) -> f64 {
    let run = simulate(&case.machine, &case.experiments[0], Solver::General { tolerance: 1e-13 }).unwrap();
    assert_eq!(run.outcome.ending, Ending::Complete);
    let system = System::new(&case.machine, Operation { speed: 0.0, ..Operation::default() }).unwrap();
    let every = case.experiments[0].every;
    let models: Vec<_> = (0..steps.len()).map(|k| system.input(k).discrete(every, Hold::Zero, 0.0).unwrap()).collect();
    let mut states: Vec<_> = models.iter().map(|model| &model.b * 0.0).collect();
    let place = |name: &str| system.outputs.iter().position(|output| output.name == name).unwrap();
    let column = |name: &str| run.trajectory.get(name).unwrap();
    let largest = steps.iter().fold(0.0_f64, |most, step| most.max(step.abs()));
    let teeth = case.machine.stepper().unwrap().teeth();
    let mut most: f64 = 0.0;
    for row in 0..run.trajectory.len() {
        let answers = models.iter().zip(&states).zip(steps).map(|((model, x), u)| &model.c * x + &model.d * *u);
        let answer = answers.reduce(|sum, own| sum + own).unwrap();
        for (name, lever) in outputs {
            most = most.max((column(name)[row] - answer[place(name)]).abs() * lever / largest);
        }
        for (prefix, [angle, a, b]) in motors {
            let (sin, cos) = (teeth * column(angle)[row] + PI / 4.0).sin_cos();
            let (i_a, i_b) = (column(a)[row], column(b)[row]);
            // That along the rotor changes by the square of what is small.
            let off = i_b * cos - i_a * sin - answer[place(&format!("{prefix}quadrature_axis_current"))];
            let along = column(a)[0].hypot(column(b)[0]);
            most = most.max(off.abs() / (along * teeth * largest / case.machine.pulley_radius));
        }
        for ((model, x), u) in models.iter().zip(&mut states).zip(steps) {
            *x = &model.a * &*x + &model.b * *u;
        }
    }
    most
}

#[test]
fn small_commands_move_drawn_steppers_as_the_linear_model_says() {
    for seed in 0..machines() {
        let mut axis = Axis::drawn(&mut Chance::new(7700 + seed));
        (axis.coulomb, axis.motor) = ([0.0; 3], axis.motor.smooth(seed % 2 == 0));
        let text = axis.case();
        let begin = text.find("[[experiment]]").unwrap();
        for step in [1e-6, -2.5e-7] {
            let text = format!(
                "{}[[experiment]]\nname = \"step\"\ninput = {{ step = {step:e} }}\nuntil = 0.01\nevery = 1e-4\n",
                &text[..begin]
            );
            let case = Case::from_text("drawn.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
            let outputs = [("drive_angle", axis.radius), ("cart_position", 1.0), ("idler_angle", axis.radius)];
            let motor = ("", ["drive_angle", "motor_current", "second_phase_current"]);
            let off = apart_from_linear(&case, &[step], &outputs, &[motor]);
            // N δ of the step: what is left out is of second order in it.
            let small = axis.motor.teeth() * step / axis.radius;
            assert!(off < 60.0 * small * small, "{seed}: {off:.1e} of the step {step:e} m, ({small:.1e})²\n{text}");
        }
    }
}

#[test]
fn small_commands_move_drawn_plotters_as_the_linear_model_says() {
    for seed in 0..machines() {
        let mut plotter = Plotter::drawn(&mut Chance::new(7800 + seed));
        plotter.motor = plotter.motor.smooth(seed % 2 == 0);
        let text = plotter.case();
        let begin = text.find("[[move]]").unwrap();
        for steps in [[1e-6, 0.0], [-1e-7, 3e-7]] {
            let text = format!(
                "{}[[experiment]]\nname = \"step\"\ninput = {{ left = {{ step = {:e} }}, right = {{ step = {:e} }} }}\n\
                 until = 0.01\nevery = 1e-4\n",
                &text[..begin],
                steps[0],
                steps[1]
            );
            let case = Case::from_text("plotter.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
            let r = plotter.radius;
            let outputs = [("left_angle", r), ("right_angle", r), ("bridge_position", 1.0), ("cart_position", 1.0)];
            let motors = [
                ("left_", ["left_angle", "left_current", "left_second_phase_current"]),
                ("right_", ["right_angle", "right_current", "right_second_phase_current"]),
            ];
            let off = apart_from_linear(&case, &steps, &outputs, &motors);
            let small = plotter.motor.teeth() * steps[0].abs().max(steps[1].abs()) / r;
            assert!(off < 60.0 * small * small, "{seed}: {off:.1e} of the steps {steps:?} m, ({small:.1e})²\n{text}");
        }
    }
}

/// Largest distance between what a step on top of a ramp changes in a run, and what it does in the linear model of that
/// speed, relative to the step; the ramp begins half a second before, so that its own transients are over.
fn apart_at_speed(text: &str, speed: f64, step: f64) -> f64 {
    let run = |step: f64| {
        let text = format!(
            "{text}[[experiment]]\nname = \"ramp\"\ninput = {{ sum = [{{ ramp = {:e}, over = 0.6 }}, \
             {{ step = {step:e}, at = 0.5 }}] }}\ninitial = {{ drive_speed = {1:e}, cart_speed = {speed:e}, \
             idler_speed = {1:e} }}\nuntil = 0.52\nevery = 1e-3\n",
            0.6 * speed,
            speed / 6.4e-3,
        );
        let case = Case::from_text("ramp.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let run = simulate(&case.machine, &case.experiments[0], Solver::General { tolerance: 1e-12 }).unwrap();
        (run.trajectory.get("cart_position").unwrap().to_vec(), case)
    };
    let ((without, case), (with, _)) = (run(0.0), run(step));
    let system = StateSpace::new(&case.machine, Operation { speed, ..Operation::default() }).unwrap();
    let model = system.discrete(1e-3, Hold::Zero, 0.0).unwrap();
    let (row, mut x, mut most) = (system.output("cart_position").unwrap(), &model.b * 0.0, 0.0_f64);
    for k in 500..=520 {
        let answer = (model.c.row(row) * &x)[0] * step;
        most = most.max((with[k] - without[k] - answer).abs() / step);
        x = &model.a * &x + &model.b;
    }
    most
}

#[test]
fn a_small_command_at_a_speed_moves_the_cart_as_the_linear_model_of_that_speed_says() {
    // Without friction, load and detents, so that the rotor is where it would be without load.
    let chopper = plain(0.45, 6.4e-3, 16, "[cart]\nmass = 0.2\n").replace("supply", "interpolate = true\nsupply");
    let voltage = chopper.replace("supply = 24", "supply = 3.9597979\ndrive = \"voltage\"");
    for (text, speed) in [(&chopper, 0.1), (&voltage, 5e-3), (&voltage, 0.03), (&voltage, 0.1)] {
        let off = apart_at_speed(text, speed, 1e-5);
        assert!(off < 0.03, "{speed} m/s: {off:.1e}\n{text}");
    }
}

#[test]
fn all_that_a_stepper_moves_swings_on_the_stiffness_of_its_field() {
    // As one mass on N T_h, and on a full step at rest N (T_h − 4 T_d); with a voltage on the phases, back-EMF damps
    // it.
    let (holding, detent, radius, n) = (0.45, 15e-3, 6.4e-3, 50.0);
    let text = plain(holding, radius, 16, "[cart]\nmass = 0.4\n")
        .replace("rotor_inertia", "detent_torque = 15e-3\nrotor_inertia")
        .replace("stiffness = [6e4, 6e4, 3e4]", "stiffness = [6e9, 6e9, 3e9]");
    let inertia = 5.4e-6 + 2e-6 + 0.4 * radius * radius;
    let hertz = |torque: f64| (n * torque / inertia).sqrt() / (2.0 * PI);
    for voltage in [false, true] {
        let text = match voltage {
            true => text.replace("supply = 24", "supply = 3.9597979\ndrive = \"voltage\""),
            false => text.clone(),
        };
        let case = Case::from_text("alone.toml", &text).unwrap();
        for (speed, torque) in [(1e-4, holding), (0.0, holding - 4.0 * detent)] {
            let analysis = Analysis::new(&case, &Question { speed: Some(speed), ..Question::default() }).unwrap();
            let modes = analysis.modes.as_ref().unwrap();
            assert!(modes.rigid.is_empty());
            assert!((modes.elastic[0].hertz() / hertz(holding) - 1.0).abs() < 1e-4);
            let undamped = analysis.here.undamped_resonances[0];
            assert!((undamped / hertz(torque) - 1.0).abs() < 1e-4, "{undamped} Hz, {} Hz", hertz(torque));
            let Root::Pair { damping, .. } = analysis.here.resonances[0] else { panic!() };
            assert!(if voltage { damping > 0.01 } else { damping.abs() < 1e-3 }, "{damping}");
            // On a full step detents push the rotor farther than it is told to go.
            let [one] = &analysis.inputs[..] else { panic!() };
            let cart = one.system.output("cart_position").unwrap();
            let (integrators, gain) = one.transfers[cart].low_frequency();
            assert!(integrators == 0 && (gain / (holding / torque) - 1.0).abs() < 1e-3, "{gain}");
        }
    }
}

#[test]
fn a_supply_that_limits_the_currents_has_no_linear_model() {
    let low = plain(0.45, 6.4e-3, 16, "[cart]\nmass = 0.4\n").replace("supply = 24", "supply = 2.7");
    let fast = plain(0.45, 6.4e-3, 16, "[cart]\nmass = 0.4\n");
    for (text, speed) in [(&low, 0.0), (&fast, 3.0)] {
        let case = Case::from_text("low.toml", text).unwrap();
        let question = Question { speed: Some(speed), ..Question::default() };
        let error = Analysis::new(&case, &question).unwrap_err().to_string();
        assert!(error.starts_with("--speed: ") && error.contains("the supply of"), "{error}");
        assert!(error.contains("allowed: ") && error.contains("next: "), "{error}");
    }
}

/// A stepper axis for limit laws: no dry friction, and these keys of its own.
fn plain(holding: f64, radius: f64, microsteps: u32, rest: &str) -> String {
    format!(
        "[stepper]\nsteps_per_turn = 200\nholding_torque = {holding}\nrated_current = 2\nresistance = 1.4\n\
         inductance = 3e-3\nsupply = 24\nmicrosteps = {microsteps}\nrotor_inertia = 5.4e-6\n[idler_pulley]\n\
         inertia = 1e-6\n[belt]\nstiffness = [6e4, 6e4, 3e4]\ndamping = [8, 8, 4]\n{rest}\n[drive_pulley]\n\
         radius = {radius}\ninertia = 1e-6\n"
    )
}

#[test]
fn a_load_at_rest_deflects_the_rotor_by_the_sine_law() {
    let (holding, radius, n) = (0.45, 6.4e-3, 50.0);
    // A load of 0.8 that comes at once makes the rotor overshoot to the next tooth, 2π/N on, and be held there.
    for (share, teeth) in [(0.5, 0.0), (-0.6, 0.0), (-0.8_f64, 1.0)] {
        let force = -holding * share / radius;
        let text = plain(holding, radius, 16, &format!("[cart]\nmass = 0.2\nload = {force}\n"))
            + "friction = { viscous = 1e-2 }\n[[experiment]]\nname = \"held\"\ninput = { step = 0 }\nuntil = 0.5\n\
               every = 1e-2\n";
        let case = Case::from_text("held.toml", &text).unwrap();
        let run = simulate(&case.machine, &case.experiments[0], Solver::GENERAL).unwrap();
        let angle = *run.trajectory.get("drive_angle").unwrap().last().unwrap();
        // T_h sin N δ = F r
        let deflection = -share.asin() / n + teeth * 2.0 * std::f64::consts::PI / n;
        assert!((angle - deflection).abs() < 1e-8, "{share}: {angle} rad instead of {deflection} rad");
    }
}

#[test]
fn the_pull_out_torque_that_is_shown_is_that_at_which_a_slow_ramp_loses_its_steps() {
    let (holding, radius, damping, acceleration) = (0.45, 6.4e-3, 1.2e-3, 10.0);
    let points: Vec<String> = (0..=280)
        .map(|k| f64::from(k) * 5e-4)
        .map(|time| format!("[{time}, {}]", 0.5 * acceleration * time * time))
        .collect();
    let text = plain(holding, radius, 2, "[cart]\nmass = 0.05\n")
        + &format!(
            "friction = {{ viscous = {damping} }}\n[[experiment]]\nname = \"ramp\"\n\
             input = {{ table = [{}] }}\nuntil = 0.13\nevery = 1e-2\n",
            points.join(", ")
        );
    let case = Case::from_text("ramp.toml", &text).unwrap();
    let run = simulate(&case.machine, &case.experiments[0], Solver::GENERAL).unwrap();
    let first = run.outcome.events.iter().find(|event| matches!(event.part.what, What::Field(_)));
    let speed = acceleration * first.expect("it loses steps").time / radius;
    let inertia = 5.4e-6 + 2e-6 + 0.05 * radius * radius;
    let needed = damping * speed + inertia * acceleration / radius;
    let shown = PullOut::new(&case.machine).unwrap().torque(speed);
    assert!((needed / shown - 1.0).abs() < 0.04, "{needed} N m at {speed} rad/s, shown {shown} N m");
}

/// A CoreXY with two steppers and no dry friction, on the way to one point of its plane after another.
#[derive(Debug, Clone)]
struct Plotter {
    motor: Motor,
    radius: f64,
    pulley: f64,
    /// Of bridge and cart.
    mass: [f64; 2],
    viscous: [f64; 2],
    /// Of both spans of a belt together: N/m and N s/m.
    stiffness: [f64; 2],
    damping: [f64; 2],
    speed: f64,
    acceleration: f64,
    points: [[f64; 2]; 2],
    until: f64,
    /// The loop of each motor, if it has one.
    corrected: Option<Correction>,
}

/// A PID that corrects the position of a motor's field by an exact encoder.
#[derive(Debug, Clone, Copy)]
struct Correction {
    every: f64,
    delay: f64,
    limit: f64,
    proportional: f64,
    integral: f64,
    derivative: f64,
    filter: f64,
    tracking: f64,
}

/// One of these under way: its integral, filtered slope, and last position; the correction that acts and the next one.
#[derive(Debug, Clone, Copy, Default)]
struct Corrected {
    sum: f64,
    slope: f64,
    last: Option<f64>,
    acts: f64,
    next: f64,
}

impl Correction {
    fn drawn(chance: &mut Chance) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * chance.uniform();
        let every = between(2e-4, 4e-4);
        Self {
            every,
            delay: every * between(0.1, 0.9),
            limit: between(2e-5, 2e-4),
            proportional: between(0.0, 0.08),
            integral: between(4.0, 15.0),
            derivative: between(1e-4, 2e-4),
            filter: between(500.0, 1000.0),
            tracking: between(0.01, 0.05),
        }
    }

    fn table(&self) -> String {
        let Self { every, delay, limit, proportional, integral, derivative, filter, tracking } = self;
        format!(
            "[controller]\nevery = {every:e}\ndelay = {delay:e}\nlimit = {limit:e}\n[controller.pid]\n\
             proportional = {proportional:e}\nintegral = {integral:e}\nderivative = {derivative:e}\nfilter = {filter:e}\n\
             tracking = {tracking:e}\n"
        )
    }

    /// A sample: reference and measured position, m.
    fn sample(&self, own: &mut Corrected, reference: f64, measured: f64) {
        let error = reference - measured;
        let time = 1.0 / (2.0 * PI * self.filter);
        let change = error - own.last.unwrap_or(error);
        own.slope = (own.slope * time + change) / (time + self.every);
        own.last = Some(error);
        own.sum += error * self.integral * self.every;
        let asked = error * self.proportional + own.sum + own.slope * self.derivative;
        own.next = asked.clamp(-self.limit, self.limit);
        own.sum += (own.next - asked) * (self.every / self.tracking).min(1.0);
    }
}

/// Angles, positions of bridge and cart, the speeds of all, two currents of each motor.
type Plane = [f64; 12];

impl Plotter {
    fn drawn(chance: &mut Chance) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * chance.uniform();
        let (holding, rated, resistance) = (between(0.3, 0.6), between(1.0, 2.5), between(0.8, 2.0));
        let k = [between(4e4, 1.2e5), between(4e4, 1.2e5)];
        let motor = Motor {
            steps: 200.0,
            holding,
            rated,
            resistance,
            inductance: resistance * between(1e-3, 2.5e-3),
            supply: between(18.0, 36.0),
            chopper: true,
            microsteps: [2.0, 4.0, 8.0][(3.0 * between(0.0, 0.999)) as usize],
            interpolate: between(0.0, 1.0) < 0.4,
            detent: holding * between(0.0, 0.05),
            rotor: holding * 1.2e-5,
        };
        Self {
            motor,
            radius: between(5e-3, 8e-3),
            pulley: between(5e-7, 2e-6),
            mass: [between(0.2, 0.4), between(0.15, 0.3)],
            viscous: [between(2.0, 8.0), between(2.0, 8.0)],
            stiffness: k,
            damping: k.map(|k| 2e-4 * k),
            speed: between(0.05, 0.15),
            acceleration: between(1.0, 3.0),
            points: [[between(2e-3, 6e-3), 0.0], [between(2e-3, 6e-3), between(-6e-3, 6e-3)]],
            until: 0.25,
            corrected: None,
        }
    }

    fn case(&self) -> String {
        let halves = |[a, b]: [f64; 2]| [0.4 * a, 0.6 * a, 0.7 * b, 0.3 * b];
        format!(
            "kind = \"core-xy\"\n{}[drive_pulley]\nradius = {:e}\ninertia = {:e}\n[bridge]\nmass = {:e}\n\
             friction = {{ viscous = {:e} }}\n[cart]\nmass = {:e}\nfriction = {{ viscous = {:e} }}\n[belt]\n\
             stiffness = {:?}\ndamping = {:?}\n[[move]]\nname = \"path\"\npoints = {:?}\nspeed = {:e}\n\
             acceleration = {:e}\nuntil = {:e}\nevery = 1e-3\n",
            self.motor.table(),
            self.radius,
            self.pulley,
            self.mass[0],
            self.viscous[0],
            self.mass[1],
            self.viscous[1],
            halves(self.stiffness),
            halves(self.damping),
            self.points,
            self.speed,
            self.acceleration,
            self.until,
        ) + &self.corrected.map_or(String::new(), |own| own.table())
    }

    /// Where bridge and cart should be: from rest to rest along each leg, with a trapezoid of speed.
    fn reference(&self, mut time: f64) -> [f64; 2] {
        let mut from = [0.0; 2];
        for to in self.points {
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            let top = self.speed.min((length * self.acceleration).sqrt());
            let (ramp, whole) = (top / self.acceleration, length / top + top / self.acceleration);
            if time < whole {
                let after = |time: f64| 0.5 * self.acceleration * time * time;
                let gone = match time {
                    _ if time < ramp => after(time),
                    _ if time < whole - ramp => after(ramp) + top * (time - ramp),
                    _ => length - after(whole - time),
                };
                return [0, 1].map(|k| from[k] + (to[k] - from[k]) * gone / length);
            }
            (time, from) = (time - whole, to);
        }
        from
    }

    /// References of both belts: motor A moves bridge and cart alike, motor B against each other.
    fn belts(&self, time: f64) -> [f64; 2] {
        let [x, y] = self.reference(time);
        [x + y, x - y]
    }

    /// The angles of the fields, with these corrections of the references.
    fn told(&self, time: f64, added: [f64; 2]) -> [f64; 2] {
        let belts = self.belts(time);
        [0, 1].map(|k| self.motor.field((belts[k] + added[k]) / self.radius))
    }

    fn rate(&self, s: &Plane, told: [f64; 2]) -> Plane {
        let (r, mut rate) = (self.radius, [0.0; 12]);
        rate[..4].copy_from_slice(&s[4..8]);
        let (x, y) = ([s[2] + s[3], s[2] - s[3]], [s[6] + s[7], s[6] - s[7]]);
        let mut pull = [0.0; 2];
        for m in 0..2 {
            let (angle, speed, currents) = (s[m], s[4 + m], 8 + 2 * m);
            pull[m] = self.stiffness[m] * (r * angle - x[m]) + self.damping[m] * (r * speed - y[m]);
            let (torque, rates) = self.motor.phases((angle, speed), [s[currents], s[currents + 1]], told[m]);
            rate[4 + m] = (torque - r * pull[m]) / (self.motor.rotor + self.pulley);
            rate[currents..currents + 2].copy_from_slice(&rates);
        }
        rate[6] = (pull[0] + pull[1] - self.viscous[0] * s[6]) / (self.mass[0] + self.mass[1]);
        rate[7] = (pull[0] - pull[1] - self.viscous[1] * s[7]) / self.mass[1];
        rate
    }

    /// Positions of bridge and cart every millisecond, and the corrections at the end: classical formula from edge to
    /// edge of the microsteps and the corrections.
    fn integrate(&self) -> (Vec<[f64; 2]>, [f64; 2]) {
        let mut s = [0.0; 12];
        s[8..].fill(self.motor.rated);
        let (mut time, mut rows) = (0.0, vec![[0.0; 2]]);
        let mut loops = [Corrected::default(); 2];
        // The next sample, and whether its correction is on its way.
        let (mut sample, mut is_late) = (0, false);
        while time < self.until - 1e-9 {
            let mut end = (rows.len() as f64 * 1e-3).min(self.until);
            let row = end;
            if let Some(own) = self.corrected {
                let next =
                    |sample: i32, is_late: bool| f64::from(sample) * own.every + if is_late { own.delay } else { 0.0 };
                while next(sample, is_late) <= time + 1e-12 {
                    for (k, belt) in loops.iter_mut().enumerate() {
                        match is_late {
                            true => belt.acts = belt.next,
                            false => own.sample(belt, self.belts(time)[k], self.radius * s[k]),
                        }
                    }
                    (sample, is_late) = if is_late { (sample + 1, false) } else { (sample, true) };
                }
                end = end.min(next(sample, is_late));
            }
            let added = loops.map(|own| own.acts);
            let mut h = STEP.min(end - time);
            let told = self.told(self.motor.heard(time, h), added);
            if !self.motor.interpolate && self.told(time + h, added) != told {
                let (mut low, mut high) = (0.0, h);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if self.told(time + middle, added) == told { low = middle } else { high = middle }
                }
                h = high;
            }
            s = classical(&s, h, |s| self.rate(s, told));
            time += h;
            if (time - row).abs() < 1e-10 {
                rows.push([s[2], s[3]]);
            }
        }
        (rows, loops.map(|own| own.acts))
    }
}

/// Both with and without loops of the motors: the loops correct what the references leave.
#[test]
fn drawn_plotters_with_steppers_follow_their_paths_as_their_phases_take_them() {
    for seed in 0..machines().div_ceil(2) {
        for is_corrected in [false, true] {
            let chance = &mut Chance::new(5100 + seed);
            let mut plotter = Plotter::drawn(chance);
            plotter.corrected = is_corrected.then(|| Correction::drawn(chance));
            let text = plotter.case();
            let case = Case::from_text("plotter.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
            let (design, motion) = (case.controller.as_ref().unwrap(), &case.moves[0]);
            let mut controllers = Standard::of_drives(design, &case.machine).unwrap();
            assert_eq!(controllers.len(), if is_corrected { 2 } else { 0 });
            let rows = Rows { until: motion.until, every: motion.every, window: motion.window };
            let mut kept = Trajectory::default();
            let mut sink = |block: &Trajectory| {
                if kept.is_empty() {
                    kept = Trajectory::with_capacity(&block.columns, 1024);
                }
                kept.append(block);
                Flow::Continue
            };
            let (profiles, timing) = (motion.references(design), Loop::new(design));
            let solver = Solver::for_machine(&case.machine);
            let run =
                stream(&case.machine, &mut each(&mut controllers), &timing, &profiles, &rows, solver, false, &mut sink)
                    .unwrap();
            assert_eq!(run.outcome.ending, Ending::Complete, "{seed}\n{text}");
            assert!(run.metrics.in_step(), "{seed}\n{text}");
            assert_eq!(run.samples.0 > 0, is_corrected);
            let columns = ["bridge_position", "cart_position"].map(|name| kept.get(name).unwrap());
            let (others, added) = plotter.integrate();
            assert_eq!(columns[0].len(), others.len());
            for (row, other) in others.iter().enumerate() {
                let off = (0..2).map(|k| (columns[k][row] - other[k]).abs()).fold(0.0, f64::max);
                // A loop around microsteps amplifies what is off before.
                let most = if is_corrected { 2e-8 } else { 5e-9 };
                assert!(off < most, "{seed}: {off:.1e} m apart at {row} ms\n{text}");
            }
            // Commanded minus reached; what is commanded has the corrections in it.
            let (told, end) = (plotter.told(plotter.until, added), others.last().unwrap());
            let asked = [told[0] + told[1], told[0] - told[1]].map(|sum| 0.5 * plotter.radius * sum);
            for (k, load) in run.metrics.loads.iter().enumerate() {
                let left = load.command_error.unwrap() - (asked[k] - end[k]);
                assert!(is_corrected || left.abs() < 5e-9, "{seed}: {left:e} m\n{text}");
            }
        }
    }
}

#[test]
fn a_move_beyond_the_pull_out_torque_is_told_and_a_planned_one_loses_no_step() {
    let text = plain(0.45, 6.4e-3, 4, "[cart]\nmass = 0.4\n")
        + "friction = { viscous = 1e-4 }\n[[move]]\nname = \"far\"\nto = 0.1\nspeed = 1.5\nacceleration = 80\n\
           until = 0.4\n[[move]]\nname = \"planned\"\nto = 0.1\nplan = { reserve = 0.4 }\nuntil = 0.6\n";
    let case = Case::from_text("moves.toml", &text).unwrap();
    let design = case.controller.as_ref().unwrap();
    let short = case.moves[0].shortfalls(&case.machine, design);
    // 80 m/s² of 0.4 kg, rotor and pulleys at 6.4 mm
    let mass = 0.4 + (5.4e-6 + 2e-6) / (6.4e-3_f64 * 6.4e-3);
    let [torque] = &short[..] else { panic!("{short:?}") };
    assert_eq!(torque.limit, "pull_out");
    assert!(torque.needed >= 80.0 * mass * 6.4e-3 && torque.allowed < torque.needed, "{torque:?}");
    assert!(case.moves[1].shortfalls(&case.machine, design).is_empty());
    let run = |motion: &Move| {
        let until = motion.until;
        let setup = Setup { window: motion.window, ..Setup::new(&case.machine, design, &motion.profiles, until) };
        closed_loop(&setup).unwrap()
    };
    let [far, planned] = [0, 1].map(|k| run(&case.moves[k]));
    assert!(!far.metrics.in_step());
    // Both errors are what is commanded minus the true position: they had opposite signs.
    let [tracked, left] = [far.figures.cart().error.last, far.metrics.cart().command_error.unwrap()];
    assert!(left.abs() > 1e-3 && (tracked - left).abs() < 1e-4, "{tracked} m, {left} m");
    assert!(planned.metrics.in_step() && planned.metrics.cart().command_error.unwrap().abs() < 5e-5);
    // The quickest one that takes six tenths of the torque everywhere is not slow.
    let mut limited = case.machine.clone();
    limited.cart.travel = Some(Travel { min: 0.0, max: 0.1, stop: None });
    let most = within_pull_out(&limited, 0, 0.0).unwrap();
    let bound = 2.0 * (0.1 / most).sqrt();
    let end = case.moves[1].end();
    assert!(bound < end && end < 2.2 * bound, "{end} s, {bound} s at the pull-out torque");
}

/// An axis whose field a PID corrects every half millisecond, with dry friction of the cart, and one move of 20 mm.
fn corrected(gains: &str, coulomb: f64, (speed, acceleration): (f64, f64), changes: &[&str]) -> Case {
    let text =
        plain(0.45, 6.4e-3, 16, &format!("[cart]\nmass = 0.4\nfriction = {{ viscous = 3, coulomb = {coulomb} }}\n"))
            + &format!(
                "[controller]\nevery = 5e-4\n{gains}\n[[move]]\nname = \"there\"\nto = 20e-3\nspeed = {speed}\n\
             acceleration = {acceleration}\nwindow = 20e-6\nuntil = 1.5\n"
            );
    Case::from_text_with("corrected.toml", &text, changes).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn moved(case: &Case) -> MoveRun {
    let (design, motion) = (case.controller.as_ref().unwrap(), &case.moves[0]);
    closed_loop(&Setup { window: motion.window, ..Setup::new(&case.machine, design, &motion.profiles, motion.until) })
        .unwrap()
}

/// The loop of an encoder around a field: its integral removes what friction leaves of the way, and without gains it is
/// none.
#[test]
fn an_encoder_removes_the_lag_that_friction_leaves() {
    let of = |gains: &str| moved(&corrected(gains, 4.0, (0.1, 1.0), &["stepper.interpolate=true"]));
    let open = of("");
    let [none, closed] = ["pid = { proportional = 0 }", "pid = { proportional = 0.1, integral = 40 }"].map(of);
    let (without, with) = (open.figures.cart(), none.figures.cart());
    assert_eq!((open.samples.0, none.samples.0), (0, 3001));
    assert!((without.error.rms - with.error.rms).abs() < 2e-9, "{without:?}, {with:?}");
    // The motor's own encoder does not see the stretch: it is the rotor that arrives.
    let [left, corrected] = [&open, &closed].map(|run| run.figures.drives[0].following.last.abs());
    assert!(left > 1e-6 && corrected < 0.1 * left, "{left} m, {corrected} m");
}

/// With integral action alone: the gain at which the margins of the loop end is that at which its moves grow.
#[test]
fn the_loop_of_a_stepper_is_stable_where_its_margins_say_so() {
    let of = |integral: f64| {
        let gains = format!("pid = {{ proportional = 0, integral = {integral:e} }}");
        corrected(&gains, 0.0, (0.1, 0.5), &["stepper.interpolate=true", "cart.friction.viscous=1"])
    };
    let margins = |integral: f64| {
        let case = of(integral);
        let design = case.controller.as_ref().unwrap();
        let feedback = Feedback::new(design, &case.machine).unwrap();
        let plant = Plant::new(&case.machine, Operation::default(), design, &feedback.corners()).unwrap();
        Margins::new(&plant, &feedback)
    };
    let [mut low, mut high] = [1.0, 1e4];
    assert!(margins(low).stable && !margins(high).stable);
    while high / low > 1.001 {
        let middle = (low * high).sqrt();
        *if margins(middle).stable { &mut low } else { &mut high } = middle;
    }
    for (factor, grows) in [(0.9, false), (1.1, true)] {
        let run = moved(&of(factor * low));
        let swing = run.swings[0];
        assert!(run.metrics.in_step() && (swing.late > swing.early) == grows, "{factor}: {swing:?}");
        let hertz = margins(low).at / (2.0 * PI);
        assert!(!grows || (swing.frequency / hertz - 1.0).abs() < 0.05, "{hertz} Hz: {swing:?}");
    }
}

/// A move that is too quick loses steps; the field then goes on until the encoder is where it should be.
#[test]
fn an_encoder_brings_a_rotor_back_that_lost_steps() {
    let of = |gains: &str| {
        let case = corrected(gains, 1.0, (1.2, 70.0), &["stepper.interpolate=true"]);
        let run = moved(&case);
        let told = trouble(&case.machine, case.controller.as_ref().unwrap(), &run, &case.moves[0]);
        (run, told)
    };
    let [(open, lost), (closed, none)] = ["", "pid = { proportional = 0, integral = 8 }"].map(of);
    assert!(!open.metrics.in_step() && open.figures.cart().error.last.abs() > 5e-4 && lost.is_some());
    assert!(!closed.metrics.in_step() && closed.figures.settling.is_some() && none.is_none(), "{none:?}");
}

/// `taut tune` refused steppers.
#[test]
fn the_gains_of_a_stepper_with_an_encoder_are_tuned() {
    let gains = "pid = { proportional = 0.05, integral = 5, derivative = 1e-4, filter = 800 }";
    let case = corrected(gains, 2.0, (0.2, 2.0), &[]);
    let tuning = taut::case::Tuning { spread: Some(0.1), effort: 0.1, ..Default::default() };
    let tuned = tune(&case, &tuning, &|| false).unwrap();
    // The gains of the file let the cart swing on its belt.
    assert!(tuned.before.nominal.stable && tuned.before.worst.sensitivity > 1.8 && tuned.holds);
    assert!(tuned.after.worst.sensitivity <= 1.8 && tuned.after.worst.complementary <= 1.8);
    let text = tuned.case_text(&case, std::path::Path::new("tuned.toml")).unwrap();
    assert!(text.contains(" 1/s\""), "{text}");
    let open = corrected("", 2.0, (0.2, 2.0), &[]);
    let error = tune(&open, &tuning, &|| false).unwrap_err().to_string();
    assert!(error.contains("open loop") && error.contains("taut plan") && error.contains("pid = {"), "{error}");
}

/// An axis with full steps, and its log: the cart on a scale, in micrometres.
fn logged(folder: &std::path::Path) -> String {
    let text = plain(0.45, 6.4e-3, 1, "[cart]\nmass = 0.4\nfriction = { viscous = 3, coulomb = 1 }\n")
        + "[measurement]\nevery = 5e-4\ncart_position = { step = 1e-6, noise = 1e-6 }\n\
           [[experiment]]\nname = \"ramps\"\ninput = { sequence = [{ ramp = 8e-3, over = 0.05, lasts = 0.07 }, \
           { step = 8e-3 }] }\nuntil = 0.12\nevery = 5e-4\n";
    let case = Case::from_text("truth.toml", &text).unwrap();
    let log =
        measure(&case.machine, case.measurement.as_ref().unwrap(), &case.experiments[0], Solver::GENERAL).unwrap();
    let mut writer = CsvWriter::create(folder.join("ramps.csv")).unwrap();
    writer.write(&log.trajectory).unwrap();
    writer.finish().unwrap();
    text
}

/// A text with plain spaces.
fn plainly(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Fits the log of [`logged`] read with this `scale` from values near the truth; the number of simulations, those of
/// the trials after the search included.
fn fitted_with(name: &str, scale: &str) -> (taut::Result<Fit>, usize) {
    let folder = std::env::temp_dir().join(format!("taut-stepper-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let text = logged(&folder);
    let [begin, end] = ["[measurement]", "[[experiment]]"].map(|section| text.find(section).unwrap());
    let log = format!(
        "log = {{ file = \"ramps.csv\", time = \"time_s\", input = \"position_m\", hold = \"linear\", cart_position = \
         \"cart_position_m\", scale = {{ {scale} }} }}\n"
    );
    let text = format!("{}[[experiment]]\nname = \"ramps\"\n{log}", &text[..begin.min(end)])
        .replace("holding_torque = 0.45", "holding_torque = 0.43")
        .replace("mass = 0.4", "mass = 0.41")
        + "[fit]\nfree = [\"stepper.holding_torque\", \"cart.mass\", \"cart.friction.coulomb\"]\n";
    let path = folder.join("off.toml");
    std::fs::write(&path, &text).unwrap();
    let case = Case::read(&path).unwrap();
    let plan = case.fit_plan(&path).unwrap();
    let simulations = AtomicUsize::new(0);
    let stop = || {
        simulations.fetch_add(1, Relaxed);
        false
    };
    let found = fitted_in_steps(&case, &plan, Some(&stop));
    std::fs::remove_dir_all(&folder).unwrap();
    (found, simulations.into_inner())
}

/// The reversed encoder of a stepper took seven minutes: undetermined values were moved towards those of the case in
/// thousands of simulations, though the model explained nothing.
#[test]
fn a_reversed_encoder_of_a_stepper_is_named_within_its_budget() {
    let (found, simulations) = fitted_with("reversed", "cart_position = -1");
    let found = found.unwrap();
    println!("{simulations} simulations");
    assert!(found.findings.iter().any(|one| one.code == "sign" && one.grade == Grade::Warning), "{:?}", found.findings);
    assert!(simulations < 600, "{simulations}");
}

/// Each of 28 factors took steps from two starts, those on the command at speeds that no motor reaches.
#[test]
fn a_factor_on_the_output_of_a_stepper_is_named_within_its_budget() {
    let (found, simulations) = fitted_with("factor", "cart_position = 10");
    let found = found.unwrap();
    println!("{simulations} simulations");
    let named = |one: &Finding| one.code == "unexplained" && one.text.contains("with cart_position times 0.1 ");
    assert!(found.findings.iter().any(named), "{:?}", found.findings);
    assert!(simulations < 1200, "{simulations}");
}

/// A command in millimetres was simulated for minutes, turn after turn of the field.
#[test]
fn a_command_at_speeds_without_torque_is_refused() {
    let (found, simulations) = fitted_with("outrun", "input = 1000");
    let told = plainly(&found.unwrap_err().to_string());
    assert!(told.starts_with("the command of the log \"ramps\" reaches 160 m/s"), "{told}");
    assert!(told.contains("allowed: up to ") && told.contains("next: check the unit and the scale"), "{told}");
    assert!(simulations < 100, "{simulations}");
}

#[test]
fn a_stepper_is_fitted_from_a_holding_torque_and_a_mass_that_are_far_off() {
    let folder = std::env::temp_dir().join(format!("taut-stepper-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let text = logged(&folder);
    let begin = text.find("[measurement]").unwrap();
    let end = text.find("[[experiment]]").unwrap();
    let log = "log = { file = \"ramps.csv\", time = \"time_s\", cart_position = \"cart_position_m\" }\n";
    let text = format!("{}{}{log}", &text[..begin], &text[end..]).replace("until = 0.12\nevery = 5e-4\n", "")
        + "[fit]\nfree = [\"stepper.holding_torque\", \"cart.mass\", \"cart.friction.coulomb\"]\n";
    let off = text
        .replace("holding_torque = 0.45", "holding_torque = 0.3")
        .replace("mass = 0.4", "mass = 0.55")
        .replace("coulomb = 1 ", "coulomb = 0.5 ");
    let path = folder.join("off.toml");
    std::fs::write(&path, &off).unwrap();
    let case = Case::read(&path).unwrap();
    let plan = case.fit_plan(&path).unwrap();
    let fit = fit(&case, &plan, None, &mut |_| Flow::Continue).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    for (name, truth) in [("stepper.holding_torque", 0.45), ("cart.mass", 0.4), ("cart.friction.coulomb", 1.0)] {
        let own = fit.estimates.iter().find(|own| own.name == name).unwrap();
        let interval = own.interval.unwrap();
        assert!(interval[0] <= truth && truth <= interval[1], "{name}: {interval:?}");
        assert!(interval[1] - interval[0] < 0.1 * truth, "{name}: {interval:?}");
    }
}

/// The suggested accelerations of `taut shape` ignored the motor.
#[test]
fn suggested_accelerations_keep_the_reserve_of_a_plan_to_the_pull_out_torque() {
    let (radius, coulomb, viscous, way) = (6.4e-3, 2.0, 3.0, 0.22);
    let rest = format!(
        "[travel]\nmin = 0\nmax = {way}\n[cart]\nmass = 0.4\nfriction = {{ viscous = {viscous}, coulomb = {coulomb} }}\n"
    );
    let text = plain(0.45, radius, 16, &rest);
    let case = Case::from_text("shaped.toml", &text).unwrap();
    let most = within_pull_out(&case.machine, 0, 0.1).unwrap();
    // Acceleration over half of the travel: T(v/r) (1 − 10 %) ≥ r (M a + b v + F_c), and somewhere nearly as much.
    let mass = 0.4 + (5.4e-6 + 2e-6) / (radius * radius);
    let motor = PullOut::new(&case.machine).unwrap();
    let used = (0..=100)
        .map(|k| (most * way).sqrt() * f64::from(k) / 100.0)
        .map(|speed| radius * (mass * most + viscous * speed + coulomb) / (0.9 * motor.torque(speed / radius)));
    let used = used.fold(0.0, f64::max);
    assert!((used - 1.0).abs() < 0.02, "{most} m/s² uses {used} of the allowed torque");
    let folder = std::env::temp_dir().join(format!("taut-stepper-shape-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("shaped.toml");
    let suggested = |changes: &[&str]| {
        std::fs::write(&path, &text).unwrap();
        let question = recommendation::Question {
            pairs: true,
            changes: changes.iter().map(|own| own.to_string()).collect(),
            ..Default::default()
        };
        let found = recommend(&question, std::slice::from_ref(&path)).unwrap();
        let choice = &found.each[0].choice;
        let single = choice.fitted.iter().map(|one| one.max_acceleration);
        single.chain(choice.pairs.iter().map(|one| one.max_acceleration)).fold(0.0, f64::max)
    };
    let [own, strong] = [&[][..], &["stepper.holding_torque=20", "stepper.supply=2000"]].map(suggested);
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(own <= most && own > most - 0.11, "{own} m/s², {most} m/s²");
    assert!(strong > 1.2 * most, "{strong} m/s²");
}

/// The supply that rated current needs at rest was not compared with that of the driver.
#[test]
fn a_supply_below_what_rated_current_needs_is_told_with_both_voltages() {
    // √2 · 1.4 Ω · 2 A = 3.96 V, of full steps 2.8 V.
    for (supply, microsteps, drive, told) in [
        (3.9, 16, "chopper", Some(["3.9 V", "3.96 V"])),
        (4.0, 16, "chopper", None),
        (2.9, 1, "chopper", None),
        (2.7, 1, "chopper", Some(["2.7 V", "2.8 V"])),
        (2.0, 16, "voltage", None),
    ] {
        let text = plain(0.45, 6.4e-3, microsteps, "[cart]\nmass = 0.4\n")
            .replace("supply = 24", &format!("supply = {supply}\ndrive = \"{drive}\""));
        let case = Case::from_text("supply.toml", &text).unwrap();
        let found = short_supply(&case.machine).map(|found| plainly(&found));
        match (&found, told) {
            (Some(found), Some([given, needed])) => {
                assert!(found.starts_with(&format!("the supply of {given} is below the {needed} ")), "{found}");
            }
            (found, told) => assert_eq!(found.is_some(), told.is_some(), "{supply} V: {found:?}"),
        }
        let notes = Overview::new(&case).unwrap().notes;
        assert_eq!(notes.iter().any(|note| note.is_warning()), told.is_some(), "{supply} V: {notes:?}");
    }
}

/// `--vary all` left out the supply and the rated current.
#[test]
fn all_that_varies_of_a_stepper_contains_supply_and_rated_current() {
    let case = Case::from_text("all.toml", &plain(0.45, 6.4e-3, 16, "[cart]\nmass = 0.4\n")).unwrap();
    let all = taut::parameter::every(&case.machine);
    for key in ["stepper.supply", "stepper.rated_current", "stepper.holding_torque"] {
        assert!(all.iter().any(|own| own == key), "{key}: {all:?}");
    }
    let linked: Vec<String> = taut::parameter::kinds(&case.machine).into_iter().map(|kind| kind.name).collect();
    assert!(!linked.iter().any(|name| name.contains("supply") || name.contains("current")), "{linked:?}");
}
