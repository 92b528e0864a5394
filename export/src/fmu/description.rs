//! `modelDescription.xml`, of FMI 2.0 and 3.0.

use super::{BINARY, sources};
use super::{Causality, FmiType, Model, Role, Variability, Variable};
use crate::error::Result;
use crate::quantity::{self, Dimension};
use crate::signal::DEGREE;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The version of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Version {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    #[default]
    Three,
}

impl Version {
    /// As people write it.
    pub fn word(self) -> &'static str {
        match self {
            Version::Two => "2.0",
            Version::Three => "3.0",
        }
    }
}

/// The tolerance that importers give their integrators, if nobody says another.
const TOLERANCE: f64 = 1e-8;

/// The description of a machine, with [sources](super::sources) or without.
pub fn description(model: &Model, version: Version, has_sources: bool) -> Result<String> {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let token = match version {
        Version::Two => "guid",
        Version::Three => "instantiationToken",
    };
    let _ = writeln!(
        xml,
        "<fmiModelDescription fmiVersion=\"{}\" modelName={} {token}=\"{}\" description={} license={} \
         generationTool=\"taut {}\" variableNamingConvention=\"flat\"{}>",
        version.word(),
        quoted(&model.title),
        model.token,
        quoted("A belt-driven machine: motion with stick and slip, exact between its events."),
        quoted("MIT OR Apache-2.0"),
        env!("CARGO_PKG_VERSION"),
        match version {
            Version::Two => format!(" numberOfEventIndicators=\"{}\"", model.conditions),
            Version::Three => String::new(),
        }
    );
    kinds(&mut xml, model, version, has_sources);
    units(&mut xml, model)?;
    let _ = writeln!(
        xml,
        "  <LogCategories>\n    <Category name=\"logStatusError\" description=\"What went wrong, and what is allowed.\"/>\n    \
         <Category name=\"logEvents\" description=\"Parts that begin to do something else.\"/>\n  </LogCategories>\n  \
         <DefaultExperiment startTime=\"0\" stopTime=\"{}\" tolerance=\"{TOLERANCE:e}\" stepSize=\"{}\"/>",
        model.until, model.every
    );
    let shown: Vec<&Variable> = model.variables.iter().filter(|variable| is_shown(variable, version)).collect();
    xml.push_str("  <ModelVariables>\n");
    shown.iter().for_each(|variable| self::variable(&mut xml, model, &shown, variable, version));
    xml.push_str("  </ModelVariables>\n");
    structure(&mut xml, &shown, version);
    xml.push_str("</fmiModelDescription>\n");
    Ok(xml)
}

/// In 2.0 conditions are no variables.
fn is_shown(variable: &Variable, version: Version) -> bool {
    version == Version::Three || !matches!(variable.role, Role::Condition(_))
}

/// Model exchange and co-simulation: what they can do.
fn kinds(xml: &mut String, model: &Model, version: Version, has_sources: bool) {
    let both = |state: &str, derivative: &str| {
        format!(
            "modelIdentifier=\"{BINARY}\" canGetAndSet{state}=\"true\" canSerialize{state}=\"true\" \
             {derivative}=\"true\""
        )
    };
    // In 3.0 they have a description of their own.
    let end = match has_sources {
        true => format!(
            ">\n    <SourceFiles><File name=\"{}\"/></SourceFiles>\n  </CoSimulation>",
            sources::compiled(version)
        ),
        false => "/>".to_string(),
    };
    let orders = if model.is_piecewise_linear() { DEGREE } else { 0 };
    let _ = match version {
        Version::Two => writeln!(
            xml,
            "  <ModelExchange {both}/>\n  <CoSimulation {both} canHandleVariableCommunicationStepSize=\"true\" \
             canInterpolateInputs=\"true\" maxOutputDerivativeOrder=\"{orders}\"{end}",
            both = both("FMUstate", "providesDirectionalDerivative")
        ),
        Version::Three => writeln!(
            xml,
            "  <ModelExchange {both} needsCompletedIntegratorStep=\"true\"/>\n  <CoSimulation {both} \
             canHandleVariableCommunicationStepSize=\"true\" hasEventMode=\"true\" mightReturnEarlyFromDoStep=\"true\" \
             providesIntermediateUpdate=\"true\" canReturnEarlyAfterIntermediateUpdate=\"true\" \
             maxOutputDerivativeOrder=\"{orders}\"/>",
            both = both("FMUState", "providesDirectionalDerivatives")
        ),
    };
}

fn units(xml: &mut String, model: &Model) -> Result<()> {
    let mut units: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for variable in model.variables.iter().filter(|variable| !variable.unit.is_empty()) {
        let shown = units.entry(variable.unit).or_default();
        if display(variable).is_some() && !shown.contains(&variable.shown.as_str()) {
            shown.push(&variable.shown);
        }
    }
    xml.push_str("  <UnitDefinitions>\n");
    for (unit, mut shown) in units {
        shown.sort_unstable();
        let (Dimension { mass, length, time, current, angle }, _) = quantity::conversion(unit)?;
        let exponents = [("kg", mass), ("m", length), ("s", time), ("A", current), ("rad", angle)];
        let exponents: String =
            exponents.iter().filter(|(_, n)| *n != 0).map(|(name, n)| format!(" {name}=\"{n}\"")).collect();
        let _ = write!(xml, "    <Unit name={}><BaseUnit{exponents}/>", quoted(unit));
        for shown in shown {
            let (_, factor) = quantity::conversion(shown)?;
            let _ = write!(xml, "<DisplayUnit name={} factor=\"{}\"/>", quoted(shown), 1.0 / factor);
        }
        xml.push_str("</Unit>\n");
    }
    xml.push_str("  </UnitDefinitions>\n");
    Ok(())
}

/// The unit that a variable is shown in, where that is another of the same dimension.
fn display(variable: &Variable) -> Option<&str> {
    if variable.unit.is_empty() || variable.shown.is_empty() || variable.shown == variable.unit {
        return None;
    }
    let (own, _) = quantity::conversion(variable.unit).ok()?;
    let (shown, _) = quantity::conversion(&variable.shown).ok()?;
    (own.without_angle() == shown.without_angle()).then_some(variable.shown.as_str())
}

fn variable(xml: &mut String, model: &Model, all: &[&Variable], variable: &Variable, version: Version) {
    let mut attributes = format!(
        "name={} valueReference=\"{}\" description={}",
        quoted(&variable.name),
        variable.reference,
        quoted(&variable.description)
    );
    let causality = match variable.causality() {
        Causality::Independent => "independent",
        Causality::Input => "input",
        Causality::Parameter => "parameter",
        Causality::Output => "output",
        Causality::Local => "local",
    };
    let variability = match variable.variability() {
        Variability::Fixed => "fixed",
        Variability::Tunable => "tunable",
        Variability::Discrete => "discrete",
        Variability::Continuous => "continuous",
    };
    let _ = write!(attributes, " causality=\"{causality}\" variability=\"{variability}\"");
    match variable.causality() {
        Causality::Independent | Causality::Input => {}
        Causality::Parameter => attributes.push_str(" initial=\"exact\""),
        Causality::Output | Causality::Local if variable.start.is_some() => attributes.push_str(" initial=\"exact\""),
        Causality::Output | Causality::Local => attributes.push_str(" initial=\"calculated\""),
    }
    let mut own = String::new();
    if !variable.unit.is_empty() {
        let _ = write!(own, " unit={}", quoted(variable.unit));
    }
    if let Some(shown) = display(variable) {
        let _ = write!(own, " displayUnit={}", quoted(shown));
    }
    if let Some([low, high]) = variable.range {
        let _ = write!(own, " min=\"{low:e}\" max=\"{high:e}\"");
    }
    if let (Some(quantity), Some(nominals)) = (variable.quantity, nominals(model)) {
        let _ = write!(own, " nominal=\"{:e}\"", nominals[quantity]);
    }
    if let Some(start) = variable.start {
        let _ = write!(own, " start=\"{start:?}\"");
    }
    if let Role::Rate(index) = variable.role {
        let state = all.iter().position(|other| other.quantity == Some(index));
        let state = state.map(|place| match version {
            Version::Two => place as u32 + 1,
            Version::Three => all[place].reference,
        });
        let _ = write!(own, " derivative=\"{}\"", state.unwrap_or_default());
    }
    let _ = match (version, variable.kind) {
        (Version::Two, FmiType::Real) => {
            writeln!(xml, "    <ScalarVariable {attributes}><Real{own}/></ScalarVariable>")
        }
        (Version::Two, FmiType::Whole) => writeln!(xml, "    <ScalarVariable {attributes}><Integer/></ScalarVariable>"),
        (Version::Three, FmiType::Real) => writeln!(xml, "    <Float64 {attributes}{own}/>"),
        (Version::Three, FmiType::Whole) => writeln!(xml, "    <Int32 {attributes}/>"),
    };
}

fn nominals(model: &Model) -> Option<Vec<f64>> {
    let mechanism = model.mechanism(&model.defaults()).ok()?;
    Some(model.nominals(&mechanism))
}

/// Dependencies are not told one by one: all depends on all, as it may be in some mode.
fn structure(xml: &mut String, shown: &[&Variable], version: Version) {
    let is_unknown = |variable: &Variable| {
        let calculated = variable.start.is_none();
        calculated && matches!(variable.role, Role::Output(_) | Role::Error(_) | Role::Command(_) | Role::Rate(_))
    };
    let is_output = |variable: &Variable| variable.causality() == Causality::Output;
    let list = |wanted: &dyn Fn(&Variable) -> bool, element: &str| -> String {
        let chosen = shown.iter().enumerate().filter(|(_, variable)| wanted(variable));
        chosen
            .map(|(place, variable)| match version {
                Version::Two => format!("      <Unknown index=\"{}\"/>\n", place + 1),
                Version::Three => format!("    <{element} valueReference=\"{}\"/>\n", variable.reference),
            })
            .collect()
    };
    let is_rate = |variable: &Variable| matches!(variable.role, Role::Rate(_));
    let is_condition = |variable: &Variable| matches!(variable.role, Role::Condition(_));
    xml.push_str("  <ModelStructure>\n");
    match version {
        Version::Two => {
            for (name, wanted) in [
                ("Outputs", &is_output as &dyn Fn(&Variable) -> bool),
                ("Derivatives", &is_rate),
                ("InitialUnknowns", &is_unknown),
            ] {
                let _ = writeln!(xml, "    <{name}>\n{}    </{name}>", list(wanted, ""));
            }
        }
        Version::Three => {
            xml.push_str(&list(&is_output, "Output"));
            xml.push_str(&list(&is_rate, "ContinuousStateDerivative"));
            xml.push_str(&list(&is_unknown, "InitialUnknown"));
            xml.push_str(&list(&is_condition, "EventIndicator"));
        }
    }
    xml.push_str("  </ModelStructure>\n");
}

/// A text as an attribute's value.
fn quoted(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for c in text.chars() {
        match c {
            '&' => quoted.push_str("&amp;"),
            '<' => quoted.push_str("&lt;"),
            '>' => quoted.push_str("&gt;"),
            '"' => quoted.push_str("&quot;"),
            c if c.is_control() => quoted.push(' '),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
