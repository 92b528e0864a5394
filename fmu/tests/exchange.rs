//! Model exchange: an integrator of the tests' own finds the solver's motion by rates and conditions alone.

use crate::unit::{OK, Three, Unit, machine};
use taut::case::Case;
use taut::solve::{self, Solver};
use taut_fmu::fmi3;

/// The classical formula, with a step, s, in which the fastest swing of the paper's axis turns by 0.04 rad.
const STEP: f64 = 2e-5;

/// An importer: states, time, and the conditions where it stands.
struct Importer<'i, 'u> {
    one: &'i Three<'u>,
    time: f64,
    x: Vec<f64>,
    conditions: Vec<f64>,
    events: usize,
}

impl<'i, 'u> Importer<'i, 'u> {
    fn new(one: &'i Three<'u>) -> Self {
        let (mut n, mut m) = (0, 0);
        unsafe {
            assert_eq!(fmi3::fmi3GetNumberOfContinuousStates(one.pointer, &mut n), OK);
            assert_eq!(fmi3::fmi3GetNumberOfEventIndicators(one.pointer, &mut m), OK);
        }
        one.start();
        let mut importer = Self { one, time: 0.0, x: vec![0.0; n], conditions: vec![0.0; m], events: 0 };
        importer.read();
        importer
    }

    fn read(&mut self) {
        let (c, n) = (self.one.pointer, self.x.len());
        assert_eq!(unsafe { fmi3::fmi3GetContinuousStates(c, self.x.as_mut_ptr(), n) }, OK);
    }

    /// Event mode from beginning to end, from event mode.
    fn settle(&mut self) {
        let mut flags = [1u8; 5];
        let [needed, terminate, nominals, values, defined] = &mut flags;
        let mut next = 0.0;
        unsafe {
            let c = self.one.pointer;
            assert_eq!(fmi3::fmi3UpdateDiscreteStates(c, needed, terminate, nominals, values, defined, &mut next), OK);
            assert_eq!(fmi3::fmi3EnterContinuousTimeMode(c), OK);
        }
        assert_eq!([*needed, *terminate, *nominals, *defined], [0; 4]);
        if *values == 1 {
            self.read();
        }
        self.conditions = self.look();
        // The standard: no indicator is zero where integration begins again.
        assert!(self.conditions.iter().all(|value| *value > 0.0), "{:?}", self.conditions);
    }

    fn place(&self, time: f64, x: &[f64]) {
        unsafe {
            assert_eq!(fmi3::fmi3SetTime(self.one.pointer, time), OK);
            assert_eq!(fmi3::fmi3SetContinuousStates(self.one.pointer, x.as_ptr(), x.len()), OK);
        }
    }

    fn rates(&self, time: f64, x: &[f64]) -> Vec<f64> {
        self.place(time, x);
        let mut rates = vec![0.0; x.len()];
        let n = rates.len();
        let status = unsafe { fmi3::fmi3GetContinuousStateDerivatives(self.one.pointer, rates.as_mut_ptr(), n) };
        assert_eq!(status, OK);
        rates
    }

    fn look(&self) -> Vec<f64> {
        let mut conditions = vec![0.0; self.conditions.len()];
        let n = conditions.len();
        let status = unsafe { fmi3::fmi3GetEventIndicators(self.one.pointer, conditions.as_mut_ptr(), n) };
        assert_eq!(status, OK);
        conditions
    }

    /// Where a step of `h` leads.
    fn leap(&self, h: f64) -> Vec<f64> {
        let along = |k: &[f64], by: f64| -> Vec<f64> { self.x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
        let k1 = self.rates(self.time, &self.x);
        let k2 = self.rates(self.time + h / 2.0, &along(&k1, h / 2.0));
        let k3 = self.rates(self.time + h / 2.0, &along(&k2, h / 2.0));
        let k4 = self.rates(self.time + h, &along(&k3, h));
        (0..k1.len()).map(|i| self.x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])).collect()
    }

    /// True if a condition falls until then.
    fn falls(&self, h: f64, x: &[f64]) -> bool {
        self.place(self.time + h, x);
        self.look().iter().zip(&self.conditions).any(|(now, before)| (*now <= 0.0) != (*before <= 0.0))
    }

    fn go(&mut self, until: f64) {
        while self.time < until {
            let h = STEP.min(until - self.time);
            let end = self.leap(h);
            if !self.falls(h, &end) {
                self.place(self.time + h, &end);
                (self.time, self.x) = (if h < STEP { until } else { self.time + h }, end);
                self.conditions = self.look();
                continue;
            }
            // The instant where the first of them falls, on its far side.
            let (mut low, mut high) = (0.0, h);
            while high - low > 1e-13 {
                let middle = 0.5 * (low + high);
                let x = self.leap(middle);
                if self.falls(middle, &x) { high = middle } else { low = middle }
            }
            self.x = self.leap(high);
            self.time += high;
            self.place(self.time, &self.x);
            let (mut event, mut terminate) = (0, 0);
            unsafe {
                let c = self.one.pointer;
                assert_eq!(fmi3::fmi3CompletedIntegratorStep(c, 1, &mut event, &mut terminate), OK);
                assert_eq!((event, terminate), (1, 0));
                assert_eq!(fmi3::fmi3EnterEventMode(c), OK);
            }
            self.events += 1;
            self.settle();
        }
    }
}

#[test]
fn an_integrator_finds_every_event_of_the_pulse() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let case = Case::read(machine("sollmann-jouaneh/table4.toml")).unwrap();
    let solution = solve::simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap();
    let wanted = solution.trajectory.get("cart_position").unwrap();
    let one = unit.exchange();
    let mut importer = Importer::new(&one);
    assert_eq!(one.set("command", 5.0), OK);
    importer.settle();
    assert_eq!(one.whole("drive_state"), 1, "it breaks away at once");
    importer.go(0.25);
    let cart = unit.model.quantities.iter().position(|(q, _)| *q == solve::Quantity::Position(1)).unwrap();
    assert!((importer.x[cart] - wanted[250]).abs() < 1e-8, "{} {}", importer.x[cart], wanted[250]);
    unsafe { assert_eq!(fmi3::fmi3EnterEventMode(one.pointer), OK) };
    assert_eq!(one.set("command", 0.0), OK);
    importer.settle();
    importer.go(0.5);
    assert!((importer.x[cart] - wanted[500]).abs() < 1e-8, "{} {}", importer.x[cart], wanted[500]);
    let seen = solution.outcome.events.iter().filter(|event| event.time > 0.0 && event.time <= 0.5).count();
    assert!(importer.events > 0 && importer.events <= seen + 3, "{} {seen}", importer.events);
}

/// The rate of the bristles was zero: a cart that slides was held as by a spring, 27 mm from where it is after 0.15 s.
#[test]
fn an_integrator_bends_bristles() {
    let changes =
        ["cart.friction={ viscous = 19, coulomb = 0.2, static = 0.3, lugre = { stiffness = 1e4, damping = 50, \
                    velocity = 0.01 } }"];
    let unit = Unit::with("sollmann-jouaneh/table4.toml", &changes, false);
    let case = Case::read_with(machine("sollmann-jouaneh/table4.toml"), &changes).unwrap();
    let solution = solve::simulate(&case.machine, &case.experiments[0], Solver::General { tolerance: 1e-11 }).unwrap();
    let one = unit.exchange();
    let mut importer = Importer::new(&one);
    assert_eq!(one.set("command", 5.0), OK);
    importer.settle();
    for row in [50, 150] {
        importer.go(row as f64 * 1e-3);
        for (name, column, most) in [("cart_position", "cart_position", 1e-8), ("cart_bristle", "cart_bristle", 1e-9)] {
            let wanted = solution.trajectory.get(column).unwrap()[row];
            let is = one.get(name);
            assert!((is - wanted).abs() < most, "{name} in row {row}: {is} instead of {wanted}");
        }
    }
    assert!(one.get("cart_bristle").abs() > 1e-6, "they are bent");
}

/// An importer whose root is exact to the last bit got no event: zero counted as positive here, and as negative in the
/// standard.
#[test]
fn an_indicator_that_is_exactly_zero_is_an_event() {
    for (name, column) in [("drive_speed", "drive_state"), ("idler_speed", "idler_state"), ("cart_speed", "cart_state")]
    {
        let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
        let one = unit.exchange();
        let mut importer = Importer::new(&one);
        assert_eq!(one.set("command", 5.0), OK);
        importer.settle();
        importer.go(0.02);
        let place = unit.model.variables.iter().find(|variable| variable.name == name).unwrap().quantity.unwrap();
        assert_eq!(one.whole(column), 1);
        let near = |value: &f64| (value - importer.x[place]).abs() < 1e-8;
        let index = importer.look().iter().position(near).expect("the indicator of its stop");
        let mut x = importer.x.clone();
        for _ in 0..20 {
            importer.place(importer.time, &x);
            x[place] -= importer.look()[index];
        }
        importer.place(importer.time, &x);
        assert_eq!(importer.look()[index], 0.0);
        let (mut event, mut terminate) = (0, 0);
        unsafe {
            assert_eq!(fmi3::fmi3CompletedIntegratorStep(one.pointer, 1, &mut event, &mut terminate), OK);
            assert_eq!((event, terminate), (1, 0), "{name}");
            assert_eq!(fmi3::fmi3EnterEventMode(one.pointer), OK);
        }
        importer.x = x;
        importer.settle();
        assert_eq!(importer.x[place], 0.0, "{name}: it has stopped");
    }
}

#[test]
fn conditions_are_residuals_and_no_signs() {
    let unit = Unit::new("sollmann-jouaneh/table4.toml", false);
    let one = unit.exchange();
    let mut importer = Importer::new(&one);
    // Held: what is left of 0.015 N m on either side of the drive pulley, K_t u/R = 3.2e-3 N m being on it.
    assert_eq!(one.set("command", 0.1), OK);
    importer.settle();
    let torque = 0.1 * 23e-3 / 0.71;
    let mut conditions = importer.look();
    conditions.sort_by(f64::total_cmp);
    for wanted in [0.015 - torque, 0.015 + torque, 0.2] {
        assert!(conditions.iter().any(|value| (value - wanted).abs() < 1e-9), "{wanted}: {conditions:?}");
    }
    // It slides: the speeds themselves, and the billionth of 1 rad/s by which they may pass zero.
    unsafe { assert_eq!(fmi3::fmi3EnterEventMode(one.pointer), OK) };
    assert_eq!(one.set("command", 5.0), OK);
    importer.settle();
    importer.go(0.02);
    let speed = one.get("drive_speed");
    assert!(speed > 1.0 && importer.look().iter().any(|value| (value - speed).abs() < 2e-9), "{speed}");
}
