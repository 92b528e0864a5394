//! The experiment as the case file has it.

use super::Designed;
use crate::case::{Case, Experiment};
use crate::error::{Error, Result};
use crate::machine::axis::{CART, DRIVE, IDLER};
use std::path::Path;

impl Designed {
    /// The experiment, without a log.
    pub fn experiment(&self) -> Experiment {
        Experiment {
            name: self.name.clone(),
            inputs: vec![self.shape.signal()],
            until: self.duration,
            every: self.every,
            initial: self.initial,
            log: None,
        }
    }

    /// The experiment as a table of the case file.
    pub fn toml(&self) -> String {
        let mut text = String::from("[[experiment]]\n");
        let mut put = |key: &str, value: String| text.push_str(&format!("{key} = {value}\n"));
        put("name", format!("\"{}\"", self.name));
        put("input", self.shape.toml(self.unit));
        put("until", format!("\"{} s\"", self.duration));
        put("every", format!("\"{} s\"", self.every));
        if self.initial.position[CART] != 0.0 {
            let at = self.initial.position;
            put(
                "initial",
                format!(
                    "{{ cart_position = \"{} m\", drive_angle = \"{} rad\", idler_angle = \"{} rad\" }}",
                    at[CART], at[DRIVE], at[IDLER]
                ),
            );
        }
        text
    }

    /// The text of the case with the experiment behind all else; `name` stands in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        let whole = format!("{}\n\n{}", case.text.trim_end(), self.toml());
        let read = Case::from_text(name, &whole).map_err(|error| {
            if case.text.lines().any(|line| line.trim_start().starts_with("experiment") && line.contains('=')) {
                Error::new("the experiments of this case are an inline list, to which a table cannot be added")
                    .in_file(name)
                    .next("write each as [[experiment]]")
            } else {
                error
            }
        })?;
        // What is written is what was judged.
        match read.experiments.last() {
            Some(last) if last.name == self.name && last.inputs[0] == self.shape.signal() => Ok(whole),
            _ => Err(Error::new("the designed experiment does not read back as it was written").in_file(name)),
        }
    }
}
