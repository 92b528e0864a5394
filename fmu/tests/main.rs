//! The functions of the standard, called as an importer calls them.

#[path = "../../tests/common"]
mod common {
    pub mod steppers;
}
mod controller;
mod derivatives;
mod exchange;
mod sequences;
mod statuses;
mod steppers;
mod steps;
mod unit;
