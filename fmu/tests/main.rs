//! The functions of the standard, called as an importer calls them.

mod controller;
mod derivatives;
mod exchange;
mod sequences;
mod statuses;
mod steps;
mod unit;
