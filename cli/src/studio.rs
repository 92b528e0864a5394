//! `taut studio`: serves the page until it is ended.

use crate::args::Studio as Args;
use crate::failure::{Failure, Outcome, Status};
use crate::interrupt;
use taut_studio::{Options, serve};

/// Serves; being ended is its end, not an interruption.
pub fn run(args: &Args) -> Outcome {
    let given = args.case.as_deref();
    let (link, case) = match given {
        Some(given) if is_link(given) => (Some(given), None),
        given => (None, given),
    };
    let options = Options {
        case: case.map(Into::into),
        fragment: link.and_then(|link| Some(link[link.find('#')?..].to_string())),
        port: args.port,
        open: !args.no_open,
        ignored: interrupt::ignored(),
    };
    // A port that is taken, a case that is not there: both are the command line's.
    serve(options).map_err(Failure::from).map(|()| Status::Done)
}

/// True if it is a state of a page, and no file: an address with a fragment, or the fragment alone.
fn is_link(given: &str) -> bool {
    given.starts_with('#') || given.starts_with("http://") || given.starts_with("https://")
}
