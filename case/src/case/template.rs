//! The case that `taut init` writes.

use crate::machine::MachineKind;

/// A commented case file that runs as it stands.
pub const TEMPLATE: &str = include_str!("template.toml");

/// A case file that starts from data sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Template {
    /// A linear stage: a rated motor, an AT5 belt.
    Stage,
    /// An axis of a printer: a stepper, a GT2 belt.
    Printer,
    /// An axis of a printer: a servo motor by its K_v, a GT2 belt.
    PrinterServo,
    /// A CoreXY gantry.
    Gantry,
}

impl Template {
    /// The commented case file, which runs as it stands.
    ///
    /// ```
    /// use taut::case::{Case, Template};
    /// use taut::overview::Overview;
    /// for template in [Template::Stage, Template::PrinterServo, Template::Gantry] {
    ///     let case = Case::from_text("machine.toml", template.text())?;
    ///     assert!(Overview::new(&case)?.value("largest_force").unwrap() > 10.0);
    /// }
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn text(self) -> &'static str {
        match self {
            Template::Stage => include_str!("templates/stage.toml"),
            Template::Printer => include_str!("templates/printer.toml"),
            Template::PrinterServo => include_str!("templates/printer-servo.toml"),
            Template::Gantry => include_str!("templates/gantry.toml"),
        }
    }
}

/// A commented case file of a gantry that runs as it stands.
///
/// ```
/// use taut::case::{Case, gantry_template};
/// use taut::machine::MachineKind;
/// for kind in [MachineKind::HFrame, MachineKind::CoreXy, MachineKind::DualBelt] {
///     let case = Case::from_text("gantry.toml", &gantry_template(kind))?;
///     assert_eq!(case.machine.kind, kind);
/// }
/// # Ok::<(), taut::Error>(())
/// ```
pub fn gantry_template(kind: MachineKind) -> String {
    const H_FRAME: &str = "\
#    (O)───┐          ┌───(O)     idlers at the far end
#     │    │          │    │
#   ══╪════╧══[cart]══╧════╪══   bridge    x upward
#     │    ┌──[    ]──┐    │               y to the right
#     │    │          │    │
#    (left)┘          └(right)     drive pulleys";
    const CORE_XY: &str = "\
#     ┌─────── A ────────┐       idlers at the far end
#     │   ┌──── B ───────┼──┐
#   ══╪═══╧══[cart]══════╧══╪══  bridge    x upward
#     │   ┌──[    ]──────┐  │              y to the right
#     │   │              │  │
#    (left)              (right)   drive pulleys A and B";
    const DUAL_BELT: &str = "\
#    (O)                       (O)      idlers at the far end
#    │ │                       │ │
#   ═│═╪═(cart)──[cart]──(O)═══╪═│═     bridge with the cart's motor    x upward
#    │ │                       │ │                                      y to the right
#    (left)               (right)       drive pulleys";
    // An axis has a template of its own.
    let kind = if kind == MachineKind::Axis { MachineKind::CoreXy } else { kind };
    let others = MachineKind::ALL.into_iter().filter(|other| ![MachineKind::Axis, kind].contains(other));
    let others: Vec<String> = others.map(|other| format!("\"{}\"", other.word())).collect();
    // With three drives the bridge is no part of what one motor does, and both sides have to pull it.
    let moves_both = r#""one motor"                  # moves bridge and cart alike"#;
    let moves_cart = r#""cart alone"                 # on the bridge, which stays where it is"#;
    let (drawing, stiffness, lengths, left, first) = match kind {
        MachineKind::HFrame => (
            H_FRAME,
            ["132.76 kN/m", "132.76 kN/m", "58.885 kN/m"].as_slice(),
            ["0.7 m", "0.7 m", "1.6 m"].as_slice(),
            "-5 V",
            ("left", moves_both),
        ),
        MachineKind::DualBelt => (
            DUAL_BELT,
            ["60 kN/m", "130 kN/m", "60 kN/m", "130 kN/m", "90 kN/m", "130 kN/m"].as_slice(),
            ["1.6 m", "0.7 m", "1.6 m", "0.7 m", "1 m", "0.7 m"].as_slice(),
            "5 V",
            ("cart", moves_cart),
        ),
        MachineKind::Axis | MachineKind::CoreXy => (
            CORE_XY,
            ["60 kN/m", "130 kN/m", "60 kN/m", "130 kN/m"].as_slice(),
            ["1.6 m", "0.7 m", "1.6 m", "0.7 m"].as_slice(),
            "5 V",
            ("left", moves_both),
        ),
    };
    let [count, all, others_drives] = match kind.geometry().drives.len() {
        2 => ["two", "both", "the other"],
        _ => ["three", "all", "the others"],
    };
    let list = |values: &[&str]| values.iter().map(|value| format!("\"{value}\"")).collect::<Vec<_>>().join(", ");
    let spans: Vec<&str> = kind.geometry().span_labels().map(|span| span.name.trim_end_matches(" span")).collect();
    [
        ("{kind}", kind.word().to_string()),
        ("{other}", others.join(", ")),
        ("{count}", count.to_string()),
        ("{all}", all.to_string()),
        ("{other_drives}", others_drives.to_string()),
        ("{side}", first.0.to_string()),
        ("{one_motor}", first.1.to_string()),
        ("{drawing}", drawing.to_string()),
        ("{stiffness}", list(stiffness)),
        ("{spans}", spans.join(", ")),
        ("{damping}", list(&vec!["5 N s/m"; spans.len()])),
        ("{lengths}", list(lengths)),
        ("{left}", left.to_string()),
    ]
    .iter()
    .fold(include_str!("gantry.toml").to_string(), |text, (word, value)| text.replace(word, value))
}
