//! Presets of logs: the names of recorders' columns, and their units.
//!
//! Every row is from a public definition, named beside it. What a log's table says by itself counts before a preset.

/// A recorder whose files are known.
#[derive(Debug, PartialEq)]
#[non_exhaustive]
pub struct Preset {
    /// Its name in the case file.
    pub name: &'static str,
    /// For people.
    pub title: &'static str,
    /// When the samples were taken: a column, and its unit.
    pub time: (Pick, &'static str),
    /// Columns that there may be: key of the log's table, names of which the first that is there counts, and their
    /// unit.
    pub columns: &'static [(&'static str, &'static [&'static str], In)],
    /// Lines that end the numbers.
    pub ends: &'static [End],
    /// True if rows of what is known of the columns stand between their names and the numbers.
    pub has_metadata: bool,
    /// True if a packed file holds messages, as Klipper's does.
    pub is_messages: bool,
    /// Where all of it is defined.
    pub source: &'static str,
}

/// A line that ends the numbers of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct End {
    /// The line.
    pub line: &'static str,
    /// True if something was lost.
    pub is_loss: bool,
}

/// A column of a preset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pick {
    /// The first of these names that is there; `*` stands for anything.
    Name(&'static [&'static str]),
    /// By its place, from 1.
    Number(usize),
}

/// The unit of a column of a preset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum In {
    /// As the file says, or SI.
    Own,
    /// A unit.
    Unit(&'static str),
    /// Turns of the motor's shaft, before the gear; or turns a second.
    MotorTurns,
    /// Full steps of the motor, so many to a turn of its shaft.
    MotorSteps,
}

/// All presets.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "reprapfirmware",
        title: "RepRapFirmware, closed-loop data (M569.5)",
        time: (Pick::Name(&["Timestamp"]), "ms"),
        columns: &[
            ("input", &["PID Control Signal"], In::Own),
            ("drive_angle", &["Measured Motor Steps", "Current Motor Steps"], In::MotorSteps),
            ("motor_current", &["Current Q"], In::Unit("A")),
            ("reference", &["Target Motor Steps"], In::MotorSteps),
        ],
        ends: &[
            End { line: "Data lost", is_loss: true },
            End { line: "Bad data received", is_loss: true },
            End { line: "Buffer overflowed", is_loss: true },
            End { line: "Data contains bad sample(s)", is_loss: true },
        ],
        has_metadata: false,
        is_messages: false,
        source: "ClosedLoop.cpp of Duet3D/RepRapFirmware (heading, formats, last lines), Duet3Common.h (24 channels)",
    },
    Preset {
        name: "klipper",
        title: "Klipper, data_logger.py",
        time: (Pick::Name(&["time"]), "s"),
        columns: &[
            ("drive_angle", &["angle:*"], In::MotorTurns),
            ("cart_acceleration", &["adxl345:*:x", "lis2dw:*:x", "mpu9250:*:x", "icm20948:*:x"], In::Unit("mm/s^2")),
            ("reference", &["trapq:toolhead:x"], In::Unit("mm")),
        ],
        ends: &[],
        has_metadata: false,
        is_messages: true,
        source: "scripts/motan/data_logger.py and readlog.py of Klipper3d/klipper",
    },
    Preset {
        name: "odrive",
        title: "ODrive, columns called as its properties",
        time: (Pick::Name(&["time", "timestamp", "t"]), "s"),
        columns: &[
            ("input", &["*Iq_setpoint"], In::Unit("A")),
            ("drive_angle", &["*pos_estimate", "*pos_rel"], In::MotorTurns),
            ("drive_speed", &["*vel_estimate", "*pos_vel_mapper.vel"], In::MotorTurns),
            ("motor_current", &["*Iq_measured"], In::Unit("A")),
        ],
        ends: &[],
        has_metadata: false,
        is_messages: false,
        source: "properties encoder.pos_estimate and vel_estimate, pos_vel_mapper.pos_rel and vel (turns, turns/s), Iq_setpoint and \
                 Iq_measured (A) of the ODrive API",
    },
    Preset {
        name: "moteus",
        title: "moteus, columns called as its registers",
        time: (Pick::Name(&["time", "timestamp", "t"]), "s"),
        columns: &[
            ("input", &["command_q_current"], In::Unit("A")),
            ("drive_angle", &["position"], In::Unit("rev")),
            ("drive_speed", &["velocity"], In::Unit("rev/s")),
            ("motor_current", &["q_current"], In::Unit("A")),
        ],
        ends: &[],
        has_metadata: false,
        is_messages: false,
        source: "register.rs of the crate moteus-protocol: position (revolutions of the output) 0x001, velocity 0x002, q_current 0x004, \
                 command_q_current 0x01c",
    },
    Preset {
        name: "twincat-scope",
        title: "TwinCAT 3 Scope, export to CSV",
        time: (Pick::Number(1), "ms"),
        columns: &[],
        ends: &[End { line: "EOF", is_loss: false }],
        has_metadata: true,
        is_messages: false,
        source: "Beckhoff Information System, TE13xx Scope View, Export to csv; files in tests/data of CagtayFabry/pytcs",
    },
    Preset {
        name: "wpilib",
        title: "WPILib, a data log as CSV (table) of AdvantageScope",
        time: (Pick::Number(1), "s"),
        columns: &[],
        ends: &[],
        has_metadata: false,
        is_messages: false,
        source: "docs/EXPORT.md of Mechanical-Advantage/AdvantageScope",
    },
];

impl Preset {
    /// The end that a line means, if it is one of those that end the numbers.
    pub(super) fn end(&self, line: &str) -> Option<End> {
        self.ends.iter().find(|end| end.line == line.trim()).copied()
    }
}

/// The first of the names that a file has.
pub(super) fn found(names: &[&str], there: &[String]) -> Option<String> {
    names.iter().find_map(|name| there.iter().find(|there| matches(name, there))).cloned()
}

/// True if a name is as a pattern says, with at most one `*` in it.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((before, behind)) => {
            name.len() >= before.len() + behind.len() && name.starts_with(before) && name.ends_with(behind)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_anything() {
        assert!(matches("*pos_estimate", "axis0.encoder.pos_estimate") && matches("*pos_estimate", "pos_estimate"));
        assert!(matches("adxl345:*:x", "adxl345:toolboard:x") && !matches("adxl345:*:x", "adxl345:toolboard:y"));
        assert!(!matches("a*a", "a") && matches("time", "time") && !matches("time", "times"));
    }

    #[test]
    fn the_first_name_that_is_there_counts() {
        let there = ["Timestamp", "Current Motor Steps", "Measured Motor Steps"].map(String::from);
        let names = ["Measured Motor Steps", "Current Motor Steps"];
        assert_eq!(found(&names, &there).as_deref(), Some("Measured Motor Steps"));
        assert_eq!(found(&["Current Q"], &there), None);
    }
}
