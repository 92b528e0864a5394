//! The case that `taut init` writes.

use crate::machine::gantry::Routing;

/// A commented case file that runs as it stands.
pub const TEMPLATE: &str = include_str!("template.toml");

/// A case file that starts from data sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Template {
    /// A linear stage: a rated motor, an AT5 belt.
    Machine,
    /// An axis of a printer: a motor by its K_v, a GT2 belt.
    Printer,
    /// A CoreXY gantry.
    Gantry,
}

impl Template {
    /// The commented case file, which runs as it stands.
    ///
    /// ```
    /// use taut::case::{Opened, Template};
    /// use taut::overview::Overview;
    /// for template in [Template::Machine, Template::Printer, Template::Gantry] {
    ///     let case = Opened::from_text_with("machine.toml", template.text(), &[])?;
    ///     assert!(Overview::of(&case)?.value("largest_force").unwrap() > 10.0);
    /// }
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn text(self) -> &'static str {
        match self {
            Template::Machine => include_str!("templates/stage.toml"),
            Template::Printer => include_str!("templates/printer.toml"),
            Template::Gantry => include_str!("templates/gantry.toml"),
        }
    }
}

/// A commented case file of a gantry that runs as it stands.
///
/// ```
/// use taut::case::{GantryCase, gantry_template};
/// use taut::machine::gantry::Routing;
/// for routing in [Routing::HFrame, Routing::CoreXy] {
///     let case = GantryCase::from_text_with("gantry.toml", &gantry_template(routing), &[])?;
///     assert_eq!(case.gantry.routing, routing);
/// }
/// # Ok::<(), taut::Error>(())
/// ```
pub fn gantry_template(routing: Routing) -> String {
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
    let [kind, other] = match routing {
        Routing::HFrame => [Routing::HFrame, Routing::CoreXy],
        Routing::CoreXy => [Routing::CoreXy, Routing::HFrame],
    }
    .map(Routing::word);
    let (drawing, stiffness, lengths, left) = match routing {
        Routing::HFrame => (
            H_FRAME,
            ["132.76 kN/m", "132.76 kN/m", "58.885 kN/m"].as_slice(),
            ["0.7 m", "0.7 m", "1.6 m"].as_slice(),
            "-5 V",
        ),
        Routing::CoreXy => (
            CORE_XY,
            ["60 kN/m", "130 kN/m", "60 kN/m", "130 kN/m"].as_slice(),
            ["1.6 m", "0.7 m", "1.6 m", "0.7 m"].as_slice(),
            "5 V",
        ),
    };
    let list = |values: &[&str]| values.iter().map(|value| format!("\"{value}\"")).collect::<Vec<_>>().join(", ");
    let spans: Vec<&str> = routing.spans().iter().map(|span| span.name.trim_end_matches(" span")).collect();
    [
        ("{kind}", kind.to_string()),
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
