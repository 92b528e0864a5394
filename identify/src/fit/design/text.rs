//! The experiment in the notation of the case file.

use super::Designed;
use super::trial::{hold, samples};
use crate::case::{Case, Experiment};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::mechanism::BODIES;
use crate::signal::Hold;
use std::path::Path;

impl Designed {
    /// The experiment, without a log.
    pub fn experiment(&self) -> Experiment {
        Experiment {
            name: self.name.clone(),
            inputs: self.driven.inputs(&self.shape),
            until: self.duration,
            every: self.every,
            initial: self.initial,
            log: None,
        }
    }

    /// The experiment as a table of the case file of this machine.
    pub fn toml(&self, machine: &Machine) -> String {
        let mut text = String::from("[[experiment]]\n");
        let mut put = |key: &str, value: String| text.push_str(&format!("{key} = {value}\n"));
        put("name", format!("\"{}\"", self.name));
        put("input", self.driven.toml(machine, &self.shape, self.unit));
        put("until", format!("\"{} s\"", self.duration));
        put("every", format!("\"{} s\"", self.every));
        if self.initial.position != [0.0; BODIES] {
            put("initial", format!("{{ {} }}", self.start(machine)));
        }
        let time = samples(self.every, self.duration);
        if self.shape.ends_with_a_jump() {
            text.push_str("# Keep this input beside a `log` without an input column: samples do not show its end.\n");
        } else if hold(&self.driven.inputs(&self.shape), &time) == Hold::Linear {
            text.push_str("# In `log`: hold = \"linear\", since this input does not switch.\n");
        }
        text
    }

    /// Initial positions of the sliding parts; for an axis also of its pulleys. Pulleys of a gantry begin without belt
    /// strain.
    fn start(&self, machine: &Machine) -> String {
        let (geometry, at) = (machine.geometry(), self.initial.position);
        let slides = geometry.slides.iter().map(|slide| slide.body);
        let pulleys = (0..geometry.bodies.len()).filter(|body| !slides.clone().any(|slide| slide == *body));
        let place = |body: usize, what: &str, unit: &str| {
            format!("{}_{what} = \"{} {unit}\"", geometry.label(body).key, at[body])
        };
        let mut all: Vec<String> = slides.clone().map(|body| place(body, "position", "m")).collect();
        if machine.has_one_coordinate() {
            all.extend(pulleys.map(|body| place(body, "angle", "rad")));
        }
        all.join(", ")
    }

    /// The text of the case with the experiment at its end; `name` is used in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        let whole = format!("{}\n\n{}", case.text.trim_end(), self.toml(&case.machine));
        let read = Case::from_text(name, &whole).map_err(|error| {
            if case.text.lines().any(|line| line.trim_start().starts_with("experiment") && line.contains('=')) {
                Error::new("the experiments of this case are an inline list, to which a table cannot be added")
                    .in_file(name)
                    .next("write each as [[experiment]]")
            } else {
                error
            }
        })?;
        // The written experiment is the evaluated one.
        match read.experiments.last() {
            Some(last) if last.name == self.name && last.inputs == self.driven.inputs(&self.shape) => Ok(whole),
            _ => Err(Error::new("the designed experiment does not read back as it was written").in_file(name)),
        }
    }
}
