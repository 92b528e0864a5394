//! Which curves are shown of a machine, in which panels: sums of the columns of a run.

use serde_json::{Value, json};
use taut::case::Case;
use taut::machine::{BeltModel, DriveAt, Machine};
use taut::mechanism::Heading;
use taut::trajectory::Trajectory;

/// A curve: the columns that it is a sum of, each with its weight.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Its key.
    pub key: String,
    /// Its name in the legend.
    pub name: String,
    /// The columns and their weights.
    pub terms: Vec<(String, f64)>,
}

/// Curves over one axis.
#[derive(Debug, Clone)]
pub struct Panel {
    key: &'static str,
    title: &'static str,
    /// A description, for those who do not see it.
    words: &'static str,
    /// The unit that is shown, and how many of it make one SI unit.
    unit: &'static str,
    scale: f64,
    /// The curves.
    pub curves: Vec<Curve>,
}

const MM: (&str, f64) = ("mm", 1e3);
const UM: (&str, f64) = ("µm", 1e6);
const MM_S: (&str, f64) = ("mm/s", 1e3);

const AXIS_SPANS: [&str; 3] = ["span 1, drive to cart", "span 2, cart to idler", "span 3, idler to drive"];

fn panel(key: &'static str, title: &'static str, words: &'static str, (unit, scale): (&'static str, f64)) -> Panel {
    Panel { key, title, words, unit, scale, curves: Vec::new() }
}

impl Panel {
    fn curve(mut self, key: &str, name: &str, terms: &[(&str, f64)]) -> Self {
        let terms = terms.iter().map(|(column, weight)| ((*column).to_string(), *weight)).collect();
        self.curves.push(Curve { key: key.into(), name: name.into(), terms });
        self
    }

    /// True if it is more than what the drawing needs.
    pub fn is_plotted(&self) -> bool {
        !self.title.is_empty()
    }

    /// A column as it is.
    fn column(self, column: &str, name: &str) -> Self {
        self.curve(column, name, &[(column, 1.0)])
    }
}

/// The panels of a machine with these columns.
pub fn panels(case: &Case, columns: &[Heading]) -> Vec<Panel> {
    let mut panels = match case {
        case if case.is_axis() => of_axis(&case.machine),
        case => of_gantry(&case.machine),
    };
    for panel in &mut panels {
        let there = |name: &str| columns.iter().any(|heading| heading.name == name);
        panel.curves.retain(|curve| curve.terms.iter().all(|(column, _)| there(column)));
    }
    panels.retain(|panel| !panel.curves.is_empty());
    panels
}

fn of_axis(machine: &Machine) -> Vec<Panel> {
    let r = machine.pulley_radius;
    let mut panels = vec![
        panel("position", "Position", "Where the belt is at the drive pulley and where the cart is", MM)
            .curve("drive_travel", "drive r φ₁", &[("drive_angle", r)])
            .column("cart_position", "cart x"),
        panel("speed", "Speed", "Speed of the belt at the drive pulley and of the cart", MM_S)
            .curve("drive_travel_speed", "drive r φ₁′", &[("drive_speed", r)])
            .column("cart_speed", "cart x′"),
        panel("error", "Cart minus motor", "How far the cart is from where the drive pulley says", UM).curve(
            "error",
            "x − r φ₁",
            &[("cart_position", 1.0), ("drive_angle", -r)],
        ),
        panel("force", "Span forces", "Force of each span beyond its pretension; positive pulls", ("N", 1.0))
            .column("span1_force", AXIS_SPANS[0])
            .column("span2_force", AXIS_SPANS[1])
            .column("span3_force", AXIS_SPANS[2]),
        panel("voltage", "Voltage", "Voltage at the motor, and the input of the amplifier", ("V", 1.0))
            .column("voltage", "motor voltage"),
        panel("current", "Current", "Current of the motor", ("A", 1.0)).column("motor_current", "motor current"),
        panel("torque", "Friction torque", "What friction takes or holds at the pulleys", ("mN m", 1e3))
            .column("drive_friction", "drive pulley")
            .column("idler_friction", "idler pulley"),
        panel("friction", "Friction force", "What friction takes or holds at the cart", ("N", 1.0))
            .column("cart_friction", "cart"),
        panel("state", "Stick and slip", "What each body is doing: forward, stuck, backward", ("", 1.0))
            .column("drive_state", "drive pulley")
            .column("cart_state", "cart")
            .column("idler_state", "idler pulley"),
        // Not plotted by themselves: what the drawing needs.
        panel("drawing", "", "", ("", 1.0))
            .column("drive_angle", "")
            .column("idler_angle", "")
            .curve("stretch1", "", &[("drive_angle", r), ("cart_position", -1.0)])
            .curve("stretch2", "", &[("cart_position", 1.0), ("idler_angle", -r)])
            .curve("stretch3", "", &[("idler_angle", r), ("drive_angle", -r)])
            .column("span1_slack", "")
            .column("span2_slack", "")
            .column("span3_slack", ""),
    ];
    if machine.belt.model == BeltModel::Rigid {
        panels.retain(|panel| panel.key != "error");
    }
    panels
}

fn of_gantry(gantry: &Machine) -> Vec<Panel> {
    let geometry = gantry.geometry();
    let angles: Vec<String> =
        geometry.drives.iter().map(|drive| format!("{}_angle", geometry.label(drive.pulley).key)).collect();
    // As Machine::by_drives has it, term by term.
    let by_drives = |slide: usize| -> Vec<(&str, f64)> {
        let weights = geometry.slides[slide].by_drives.iter().map(|weight| weight * gantry.pulley_radius);
        angles.iter().map(String::as_str).zip(weights).filter(|(_, weight)| *weight != 0.0).collect()
    };
    let error = |number: usize, slide: &'static str| -> Vec<(&str, f64)> {
        let drives = by_drives(number).into_iter().map(|(angle, weight)| (angle, -weight));
        std::iter::once((slide, 1.0)).chain(drives).collect()
    };
    let of_drives = |mut panel: Panel, column: &dyn Fn(&DriveAt) -> &'static str| {
        for drive in geometry.drives {
            panel = panel.column(column(drive), drive.side());
        }
        panel
    };
    let drawing = angles.iter().fold(panel("drawing", "", "", ("", 1.0)), |panel, angle| panel.column(angle, ""));
    let mut force =
        panel("force", "Span forces", "Force of each span beyond its pretension; positive pulls", ("N", 1.0));
    for label in gantry.kind.geometry().span_labels() {
        force = force.column(&format!("{}_force", label.key), label.name);
    }
    let mut state = panel("state", "Stick and slip", "What each body is doing: forward, stuck, backward", ("", 1.0));
    for label in gantry.geometry().bodies.iter().map(|body| body.label) {
        state = state.column(&format!("{}_state", label.key), label.name);
    }
    let yaw = panel("yaw", "Yaw", "Yaw of the bridge; positive if its right end leads", ("µrad", 1e6));
    let mut panels = vec![
        panel("position", "Position", "Where bridge and cart are", MM)
            .column("bridge_position", "bridge x")
            .column("cart_position", "cart y"),
        panel("speed", "Speed", "Speed of bridge and cart", MM_S)
            .column("bridge_speed", "bridge x′")
            .column("cart_speed", "cart y′"),
        panel("error", "Position error of the drives", "How far bridge and cart are from where the drives say", UM)
            .curve("x_error", "bridge", &error(0, "bridge_position"))
            .curve("y_error", "cart", &error(1, "cart_position")),
        yaw.column("yaw_angle", "yaw ψ"),
        force,
        of_drives(panel("voltage", "Voltage", "Voltage at each motor", ("V", 1.0)), &|drive| drive.voltage.key),
        of_drives(panel("current", "Current", "Current of each motor", ("A", 1.0)), &|drive| drive.current_column),
        state,
        drawing.curve("bridge_by_drives", "", &by_drives(0)).curve("cart_by_drives", "", &by_drives(1)),
    ];
    panels.retain(|panel| panel.key != "yaw" || gantry.yaw.is_some());
    panels
}

/// The panels as the page gets them.
pub fn told(panels: &[Panel]) -> Value {
    let curve = |curve: &Curve| json!({ "key": curve.key, "name": curve.name });
    let panel = |panel: &Panel| {
        let Panel { key, title, words, unit, scale, curves } = panel;
        let curves: Vec<Value> = curves.iter().map(curve).collect();
        json!({ "key": key, "title": title, "words": words, "unit": unit, "scale": scale, "curves": curves })
    };
    Value::Array(panels.iter().map(panel).collect())
}

/// The curves of rows as they come.
pub struct Kept {
    curves: Vec<Curve>,
    /// Time first.
    pub columns: Vec<Vec<f64>>,
}

impl Kept {
    /// None yet.
    pub fn new(panels: &[Panel]) -> Self {
        let curves: Vec<Curve> = panels.iter().flat_map(|panel| panel.curves.iter().cloned()).collect();
        let columns = vec![Vec::new(); curves.len() + 1];
        Self { curves, columns }
    }

    /// Adds rows.
    pub fn take(&mut self, block: &Trajectory) {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        self.columns[0].extend_from_slice(column("time"));
        for (curve, kept) in self.curves.iter().zip(&mut self.columns[1..]) {
            match &curve.terms[..] {
                [(name, 1.0)] => kept.extend_from_slice(column(name)),
                terms => {
                    let from = kept.len();
                    kept.resize(from + block.len(), 0.0);
                    for (name, weight) in terms {
                        kept[from..].iter_mut().zip(column(name)).for_each(|(sum, value)| *sum += weight * value);
                    }
                }
            }
        }
    }

    /// Adds one row, whose values are those of `headings`.
    pub fn take_row(&mut self, headings: &[Heading], row: &[f64]) {
        let value = |name: &str| headings.iter().position(|heading| heading.name == name).map_or(0.0, |k| row[k]);
        self.columns[0].push(value("time"));
        for (curve, kept) in self.curves.iter().zip(&mut self.columns[1..]) {
            kept.push(curve.terms.iter().map(|(name, weight)| weight * value(name)).sum());
        }
    }

    /// Names and lengths of the columns, for the head of a frame.
    pub fn told(&self) -> Value {
        let names = std::iter::once("time").chain(self.curves.iter().map(|curve| curve.key.as_str()));
        names.zip(&self.columns).map(|(name, values)| json!({ "name": name, "rows": values.len() })).collect()
    }
}

/// The names of the spans of a machine, in the order of its case.
pub fn spans(case: &Case) -> Vec<&'static str> {
    match case {
        case if case.is_axis() => AXIS_SPANS.to_vec(),
        case => case.machine.kind.geometry().span_labels().map(|label| label.name).collect(),
    }
}

/// The names of the bodies of a machine.
pub fn bodies(case: &Case) -> Vec<&'static str> {
    case.machine.geometry().bodies.iter().map(|body| body.label.key).collect()
}
