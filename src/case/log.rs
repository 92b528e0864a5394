//! The log of an experiment: `log = { file = "pulse5.csv", time = "time_s", input = "voltage_V", drive_angle = "angle_rad" }`.

use super::reader::{Field, Table};
use super::{Folder, InputFile};
use crate::error::Result;
use crate::log::{Log, Mapping, Quantity, Source};
use crate::quantity;
use crate::signal::Hold;

/// Reads the runs of a log; `driven` says that the experiment has an input of its own.
pub(super) fn logs(field: &Field, folder: &Folder, driven: bool) -> Result<Vec<(Option<String>, Log)>> {
    let table = field.table()?;
    let mut keys = vec!["file", "time", "input", "units", "absolute", "hold"];
    keys.extend(Quantity::ALL.iter().map(|quantity| quantity.name()));
    table.check_keys(&keys, &[])?;
    let file = table.required("file", "file = \"...\" with the path of the log")?;
    let path = folder.path.join(file.text()?);
    let units = table.optional("units").map(|field| field.table()).transpose()?;
    let source = |key: &str, unit: &str| -> Result<Option<Source>> {
        let Some(field) = table.optional(key) else { return Ok(None) };
        let unit =
            units.as_ref().and_then(|units| units.optional(key)).map(|field| factor(&field, unit)).transpose()?;
        Ok(Some(Source { column: field.text()?.to_string(), unit, scale: 1.0, offset: 0.0 }))
    };
    let time = source("time", "s")?;
    let time = time.ok_or_else(|| table.missing("time", "time = \"...\" with the name of the time's column"))?;
    let input = source("input", field.input_unit)?;
    match (&input, driven) {
        (None, false) => {
            return Err(table.missing("input", "input = \"...\" with the name of the input's column"));
        }
        (Some(_), true) => {
            let field = table.optional("input").unwrap_or_else(|| field.clone());
            return Err(field
                .fail("the experiment has an input already")
                .next("leave out the one or the other: what was logged, or what was meant"));
        }
        _ => {}
    }
    let mut outputs = Vec::new();
    for quantity in Quantity::ALL {
        outputs.extend(source(quantity.name(), quantity.unit())?.map(|source| (quantity, source)));
    }
    if outputs.is_empty() {
        let names: Vec<&str> = Quantity::ALL.iter().map(|quantity| quantity.name()).collect();
        return Err(field
            .fail("nothing measured is named")
            .allowed(names.join(", "))
            .next("add for example drive_angle = \"...\" with the name of its column"));
    }
    let holds = [("zero", Hold::Zero), ("linear", Hold::Linear)];
    let hold = table.optional("hold").map_or(Ok(Hold::Zero), |field| field.choice(&holds))?;
    let absolute = absolute(&table, &outputs)?;
    let mapping = Mapping { file: path.clone(), time, input, outputs, absolute, hold };
    let runs = mapping.read()?;
    folder.read.borrow_mut().push(InputFile { path, place: file.node.span.clone() });
    Ok(runs)
}

/// The quantities whose sign was lost.
fn absolute(table: &Table, outputs: &[(Quantity, Source)]) -> Result<Vec<Quantity>> {
    let Some(field) = table.optional("absolute") else { return Ok(Vec::new()) };
    let known: Vec<(&str, Quantity)> = outputs.iter().map(|(quantity, _)| (quantity.name(), *quantity)).collect();
    field.filled_list()?.iter().map(|field| field.choice(&known)).collect()
}

/// What one of the unit in `field` is in `unit`.
fn factor(field: &Field, unit: &str) -> Result<f64> {
    let text = field.text()?;
    quantity::read(&format!("1 {text}"), unit).map_err(|e| {
        let error = field.fail(format!("\"{text}\" is no unit of this column: {unit} is wanted, or a multiple of it"));
        match e.next {
            Some(next) if next.contains("1 ") => error.next(next),
            _ => error.next(format!("write for example {} = \"m{unit}\"", field.key())),
        }
    })
}
