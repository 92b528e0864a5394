//! Inputs and starts of a random stage.

use super::machine::Scale;
use super::{Draw, Feature, Sizes};
use std::fmt::Write;

impl Draw {
    pub(super) fn experiment(&mut self, sizes: &Sizes, start: f64, scale: &Scale) {
        let most = 5000.0 / self.fastest;
        let until = self.digits(sizes.time.min(0.99 * most));
        let rows = 20.0 + self.random.below(30) as f64;
        let every = self.digits(until / rows).min(until);
        let input = match self.is_by_recipe() {
            true => self.input_by_recipe(until, scale.input, 0),
            false => self.input(until, scale.input, 0),
        };
        let initial = self.initial(sizes, start, until, scale);
        self.text.push_str("\n[[experiment]]\nname = \"run\"\n");
        let _ = writeln!(self.text, "input = {input}\nuntil = {until:e}\nevery = {every:e}\ninitial = {{ {initial} }}");
    }

    /// An input of the shapes of the recipe, the one of this number if there are several.
    pub(super) fn input_by_recipe(&mut self, until: f64, peak: f64, number: usize) -> String {
        let features = self.features.clone().unwrap_or_default();
        let shapes: Vec<Feature> = features.into_iter().filter(|one| one.is_input()).collect();
        let late = if self.wants(Feature::Late) { self.even(0.03, 0.3) * until } else { 0.0 };
        let mut part = |shape: Feature| {
            let size = peak * self.random.decades(0.2, 5.0);
            let size = self.digits(size);
            let size = if self.random.chance(0.4) { -size } else { size };
            let frequency = {
                let value = self.random.decades(0.7, 12.0) / until;
                self.digits(value)
            }
            .max(1e-8);
            match shape {
                Feature::Ramp => format!("ramp = {size:e}, over = {:e}", self.even(0.1, 0.9) * until),
                Feature::Sine => {
                    let phase = if self.random.chance(0.5) { 0.0 } else { self.even(-3.0, 3.0) };
                    format!("sine = {size:e}, frequency = {frequency:e}, phase = {phase:e}")
                }
                Feature::Table => {
                    let (mut time, mut points) = (0.0, Vec::new());
                    for _ in 0..3 + self.random.below(6) {
                        points.push(format!("[{:e}, {:e}]", self.digits(time), self.even(-1.0, 1.0) * size));
                        time += until * self.random.even(0.03, 0.25);
                    }
                    format!("table = [{}]", points.join(", "))
                }
                Feature::Triangle => format!("triangle = {size:e}, frequency = {frequency:e}"),
                _ if self.random.chance(0.5) => format!("step = {size:e}"),
                _ => format!("pulse = {size:e}, for = {:e}", self.even(0.1, 0.7) * until),
            }
        };
        let parts: Vec<String> = match (shapes.len(), number) {
            // Each drive of a gantry has its own, as long as there are several.
            (2.., 1..) => shapes[1..].iter().map(|&shape| part(shape)).collect(),
            _ => shapes.iter().map(|&shape| part(shape)).collect(),
        };
        let whole = match &parts[..] {
            [one] => one.clone(),
            several => {
                let several: Vec<String> = several.iter().map(|one| format!("{{ {one} }}")).collect();
                format!("sum = [{}]", several.join(", "))
            }
        };
        match late > 0.0 {
            true => format!("{{ sequence = [{{ step = 0, lasts = {late:e} }}, {{ {whole} }}] }}"),
            false => format!("{{ {whole} }}"),
        }
    }

    fn input(&mut self, until: f64, peak: f64, depth: u32) -> String {
        let mut size = peak * self.random.decades(0.1, 10.0) * if self.random.chance(0.4) { -1.0 } else { 1.0 };
        if self.random.chance(0.04) {
            size = 0.0;
        }
        let size = self.digits(size);
        let at = match self.random.chance(0.5) {
            true => String::new(),
            false => format!(", at = {:e}", self.even(0.0, 0.3 * until)),
        };
        let frequency = self.decades(0.7, 20.0) / until;
        let frequency = self.digits(frequency.max(1e-8));
        match self.random.below(if depth == 0 { 9 } else { 6 }) {
            0 => format!("{{ step = {size:e}{at} }}"),
            1 => format!("{{ pulse = {size:e}, for = {:e}{at} }}", self.even(0.05, 0.7) * until),
            2 => format!("{{ ramp = {size:e}, over = {:e}{at} }}", self.even(0.05, 1.2) * until),
            3 => format!("{{ triangle = {:e}, frequency = {frequency:e} }}", size),
            4 => format!("{{ square = {size:e}, frequency = {frequency:e}, duty = {:e} }}", self.even(0.2, 0.8)),
            5 => {
                let phase = if self.random.chance(0.4) { 0.0 } else { self.even(-3.0, 3.0) };
                let offset = if self.random.chance(0.6) { 0.0 } else { self.even(-0.5, 0.5) * size };
                format!("{{ sine = {size:e}, frequency = {frequency:e}, phase = {phase:e}, offset = {offset:e} }}")
            }
            6 => {
                let (mut time, mut points) = (0.0, Vec::new());
                for i in 0..3 + self.random.below(8) {
                    if i > 0 || self.random.chance(0.5) {
                        time += until * self.random.even(0.01, 0.2);
                    }
                    points.push(format!("[{:e}, {:e}]", self.digits(time), self.even(-1.0, 1.0) * size));
                }
                format!("{{ table = [{}] }}", points.join(", "))
            }
            7 => {
                let parts = [(); 2].map(|()| self.input(until, peak, depth + 1));
                format!("{{ sum = [{}] }}", parts.join(", "))
            }
            _ => {
                let parts = [(); 3].map(|()| {
                    let lasts = self.even(0.1, 0.4) * until;
                    let part = self.input(lasts, peak, depth + 1);
                    format!("{}, lasts = {lasts:e} }}", part.trim_end_matches('}').trim_end())
                });
                format!("{{ sequence = [{}] }}", parts.join(", "))
            }
        }
    }

    fn initial(&mut self, sizes: &Sizes, start: f64, until: f64, scale: &Scale) -> String {
        let r = self.digits(sizes.radius);
        let mut ways = [start; 3];
        let mut speeds = [0.0; 3];
        let strained = self.random.chance(0.35);
        if self.random.chance(0.3) {
            speeds = [sizes.way / until * self.random.even(-1.0, 1.0); 3];
        }
        if strained && sizes.model != "rigid" {
            let softest = sizes.stiffness.iter().copied().fold(f64::MAX, f64::min);
            let strain = (sizes.force / softest).min(0.01) * self.random.decades(0.01, 3.0);
            for body in [0, 2] {
                ways[body] += strain * self.random.even(-1.0, 1.0);
                speeds[body] += strain * self.fastest * 0.1 * self.random.even(-1.0, 1.0);
            }
            if sizes.model == "two-mass" {
                (ways[2], speeds[2]) = (ways[0], speeds[0]);
            } else if sizes.symmetric && self.random.chance(0.5) {
                // A mirror image: both pulleys do the same.
                (ways[2], speeds[2]) = (ways[0], speeds[0]);
            }
        }
        let mut keys = vec![("cart_position", ways[1]), ("cart_speed", speeds[1])];
        keys.extend([("drive_angle", ways[0] / r), ("drive_speed", speeds[0] / r)]);
        keys.extend([("idler_angle", ways[2] / r), ("idler_speed", speeds[2] / r)]);
        if let Some(current) = scale.current.filter(|_| self.random.chance(0.3)) {
            keys.push(("motor_current", current));
        }
        let given = keys.into_iter().filter(|(_, value)| *value != 0.0);
        let given: Vec<String> = given.map(|(key, value)| format!("{key} = {value:e}")).collect();
        given.join(", ")
    }
}
