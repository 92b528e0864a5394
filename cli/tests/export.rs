//! `taut export`: every target in its own tool.
#![cfg(unix)]

#[path = "export/bounds.rs"]
mod bounds;
#[path = "export/c.rs"]
mod c;
#[path = "export/how_to.rs"]
mod how_to;
#[path = "../../tests/common/steppers.rs"]
mod in_loop;
#[path = "export/interpreter.rs"]
mod interpreter;
#[path = "export/machines.rs"]
mod machines;
#[path = "export/requests.rs"]
mod requests;
#[path = "export/st.rs"]
mod st;
#[path = "export/steppers.rs"]
mod steppers;
#[path = "export/together.rs"]
mod together;
#[path = "export/tools.rs"]
mod tools;
