//! The survey of a log before anything is fitted to it: its clock, its columns, its motion, and its faults.
//!
//! Nothing here changes a log. Speeds are estimated where only positions were measured, to tell rest, reversals and
//! steady motion apart, and are used for nothing else.

mod channel;
mod motion;
mod remedy;
mod timing;
mod units;

pub use channel::{Channel, Clipped, Held, Jump, Outlier};
pub use channel::{jumps_text, step_of};
pub use motion::{Motion, Steady};
pub use remedy::Remedy;
pub use timing::{Gap, Timing};

use super::Log;
use crate::machine::Machine;
use crate::number::engineering_typed;
use std::fmt;

/// The survey of a log.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Survey {
    /// The log's name.
    pub log: String,
    /// Its clock.
    pub timing: Timing,
    /// The input of each drive, then the outputs.
    pub channels: Vec<Channel>,
    /// The motion; none where nothing that was measured is a motion.
    pub motion: Option<Motion>,
    /// The notes on it, the most serious first.
    pub notes: Vec<Note>,
}

/// Something to be known about a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// Its subject, in a word for programs: `gaps`, `saturation`.
    pub code: &'static str,
    /// How much it matters.
    pub severity: Severity,
    /// The column it is about: the key of a drive's input or a quantity's name; none if it is about all.
    pub column: Option<&'static str>,
    /// The finding, in a sentence with numbers, and what to do.
    pub text: String,
    /// The remedy, if a model can decide whether it applies.
    pub remedy: Option<Remedy>,
}

/// How much something matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Severity {
    /// Good to know.
    Fact,
    /// May make a fit worse.
    Warning,
    /// Most likely a mistake: a fit to this would be wrong.
    Suspicion,
}

impl Severity {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Fact => "fact",
            Severity::Warning => "warning",
            Severity::Suspicion => "suspicion",
        }
    }
}

impl Survey {
    /// Looks at a log of `stage`, whose parameters may be rough.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::log::{Log, Output, Quantity, Survey};
    /// use taut::signal::Hold;
    /// let stage = Case::from_text("axis.toml", TEMPLATE)?.machine;
    /// // Half a second of 5 V, the cart's position in millimetres by mistake.
    /// let time: Vec<f64> = (0..500).map(|k| f64::from(k) * 1e-3).collect();
    /// let values = time.iter().map(|t| 224.0 * (t - 0.01 * (1.0 - (-t / 0.01).exp()))).collect();
    /// let position = Output { quantity: Quantity::CartPosition, absolute: false, values };
    /// let inputs = vec![vec![5.0; 500]];
    /// let log = Log { name: "5 V".into(), file: "log.csv".into(), time, inputs, added: None, hold: Hold::Zero,
    ///     reference: None, outputs: vec![position], ended: None };
    /// let survey = Survey::new(&log, &stage);
    /// assert!(survey.has("unit"));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(log: &Log, machine: &Machine) -> Self {
        let timing = Timing::new(&log.time);
        let drives = machine.geometry().drives.iter().zip(&machine.drives).zip(&log.inputs);
        let mut channels: Vec<Channel> = drives
            .map(|((at, unit), values)| Channel::new(at.input, unit.amplifier.mode.unit(), values, &log.time))
            .collect();
        for output in &log.outputs {
            channels.push(Channel::new(output.quantity.name(), output.quantity.unit(), &output.values, &log.time));
        }
        let motion = Motion::new(log, &channels, &timing);
        let mut notes = timing.notes();
        notes.extend(log.ended.as_ref().map(|words| {
            let text = format!("the recorder ended the file with `{words}`: what came after it is missing");
            Note::new("ended", Severity::Warning, text)
        }));
        for (k, channel) in channels.iter().enumerate() {
            let output = k.checked_sub(log.inputs.len()).map(|k| &log.outputs[k]);
            notes.extend(channel.notes(output, &timing));
        }
        match &motion {
            Some(motion) => notes.extend(motion.notes(log.inputs.len())),
            // An accelerometer measures the motion, but without its origin.
            None if log.outputs.iter().any(|output| output.quantity.unit() != "A") => {}
            None => notes.push(Note::new(
                "no-motion",
                Severity::Warning,
                "neither a position nor a speed nor an acceleration was measured: only the electrical side can be fitted",
            )),
        }
        notes.extend(motion.as_ref().and_then(|motion| motion.across_gaps(log, &timing)));
        notes.extend(units::notes(log, machine, &channels, motion.as_ref()));
        notes.sort_by_key(|note| std::cmp::Reverse(note.severity));
        Self { log: log.name.clone(), timing, channels, motion, notes }
    }

    /// True if there is a note of that code.
    pub fn has(&self, code: &str) -> bool {
        self.notes.iter().any(|note| note.code == code)
    }

    /// The channel called as a drive's input or as a quantity.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name == name)
    }
}

impl Note {
    fn new(code: &'static str, severity: Severity, text: impl Into<String>) -> Self {
        Self { code, severity, column: None, text: text.into(), remedy: None }
    }

    fn on(self, column: &'static str) -> Self {
        Self { column: Some(column), ..self }
    }

    fn mended_by(self, remedy: impl Into<Option<Remedy>>) -> Self {
        Self { remedy: remedy.into(), ..self }
    }
}

impl fmt::Display for Survey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Timing { samples, duration, interval, .. } = self.timing;
        let (duration, interval) = (shown(duration, "s"), shown(interval, "s"));
        write!(f, "{}: {samples} samples in {duration}, every {interval}", self.log)?;
        for channel in &self.channels {
            write!(f, "\n  {}", channel.line())?;
        }
        for note in &self.notes {
            let column = note.column.map(|column| format!("{column}: ")).unwrap_or_default();
            let mark = match note.severity {
                Severity::Fact => "",
                Severity::Warning => "warning: ",
                Severity::Suspicion => "suspicion: ",
            };
            write!(f, "\n  {mark}{column}{}", note.text)?;
        }
        Ok(())
    }
}

/// A value for messages.
fn shown(value: f64, unit: &str) -> String {
    engineering_typed(value, unit, 4)
}

fn percent(part: f64) -> String {
    match 100.0 * part {
        p if p >= 10.0 => format!("{p:.0} %"),
        p if p >= 0.1 => format!("{p:.1} %"),
        _ => "under 0.1 %".into(),
    }
}

/// The value below which this share of all lies.
fn quantile(values: &[f64], share: f64) -> f64 {
    let mut values: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let k = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}
