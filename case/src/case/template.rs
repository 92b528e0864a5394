//! The case that `taut init` writes.

use crate::machine::Kind;

/// A commented case file that runs as it stands.
pub const TEMPLATE: &str = include_str!("template.toml");

/// A case file that starts from data sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Template {
    /// A linear stage: a rated motor, an AT5 belt.
    Stage,
    /// An axis of a printer: a motor by its K_v, a GT2 belt.
    Printer,
    /// A CoreXY gantry.
    Gantry,
}

impl Template {
    /// The commented case file, which runs as it stands.
    ///
    /// ```
    /// use taut::case::{Case, Template};
    /// use taut::overview::Overview;
    /// for template in [Template::Stage, Template::Printer, Template::Gantry] {
    ///     let case = Case::from_text("machine.toml", template.text())?;
    ///     assert!(Overview::of(&case)?.value("largest_force").unwrap() > 10.0);
    /// }
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn text(self) -> &'static str {
        match self {
            Template::Stage => include_str!("templates/stage.toml"),
            Template::Printer => include_str!("templates/printer.toml"),
            Template::Gantry => include_str!("templates/gantry.toml"),
        }
    }
}

/// A commented case file of a gantry that runs as it stands.
///
/// ```
/// use taut::case::{Case, gantry_template};
/// use taut::machine::Kind;
/// for kind in [Kind::HFrame, Kind::CoreXy] {
///     let case = Case::from_text("gantry.toml", &gantry_template(kind))?;
///     assert_eq!(case.machine.kind, kind);
/// }
/// # Ok::<(), taut::Error>(())
/// ```
pub fn gantry_template(kind: Kind) -> String {
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
    let [word, other] = match kind {
        Kind::HFrame => [Kind::HFrame, Kind::CoreXy],
        Kind::Axis | Kind::CoreXy => [Kind::CoreXy, Kind::HFrame],
    }
    .map(Kind::word);
    let (drawing, stiffness, lengths, left) = match kind {
        Kind::HFrame => (
            H_FRAME,
            ["132.76 kN/m", "132.76 kN/m", "58.885 kN/m"].as_slice(),
            ["0.7 m", "0.7 m", "1.6 m"].as_slice(),
            "-5 V",
        ),
        Kind::Axis | Kind::CoreXy => (
            CORE_XY,
            ["60 kN/m", "130 kN/m", "60 kN/m", "130 kN/m"].as_slice(),
            ["1.6 m", "0.7 m", "1.6 m", "0.7 m"].as_slice(),
            "5 V",
        ),
    };
    let list = |values: &[&str]| values.iter().map(|value| format!("\"{value}\"")).collect::<Vec<_>>().join(", ");
    let spans: Vec<&str> = kind.geometry().span_labels().map(|span| span.name.trim_end_matches(" span")).collect();
    [
        ("{kind}", word.to_string()),
        ("{other}", other.to_string()),
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
