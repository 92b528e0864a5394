//! How a command ends.

use serde_json::json;
use taut::Error;
use taut::files::Refusal;

/// The end of a command that has a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All was done: exit status 0.
    Done,
    /// The result says how far it came: exit status 1.
    Incomplete,
    /// A signal ended it early, what there was is written: exit status 128 and the signal's number.
    Interrupted(u8),
}

/// The end of a command that has none.
#[derive(Debug)]
pub struct Failure {
    /// The error itself.
    pub error: Error,
    /// 1 if the work could not be done, 2 if the input was wrong, 128 and the signal's number if one ended it.
    pub status: u8,
}

/// The end of a command.
pub type Outcome = Result<Status, Failure>;

impl Failure {
    /// The input was right, and still the work could not be done: a full disk, say.
    pub fn work(mut error: Error) -> Self {
        // A file of results is called what it will be called.
        if let Some(place) = &mut error.place {
            place.file = taut::files::shown(&place.file);
        }
        Self { error, status: 1 }
    }

    /// As data, for `--json`.
    pub fn json(&self) -> String {
        let place = self.error.place.as_ref();
        let error = json!({
            "what": self.error.what,
            "file": place.map(|place| place.file.display().to_string()),
            "line": place.and_then(|place| place.span.as_ref()).map(|span| span.line),
            "column": place.and_then(|place| place.span.as_ref()).map(|span| span.column),
            "allowed": self.error.allowed,
            "next": self.error.next,
            "text": self.error.to_string(),
        });
        taut::json::text(&json!({ "schema": taut::json::identity("error"), "status": self.status, "error": error }))
    }
}

impl From<Refusal> for Failure {
    /// A name that cannot be had is wrong input; one that somebody else has at the moment is not.
    fn from(refusal: Refusal) -> Self {
        match refusal.is_name_wrong {
            true => Self::from(refusal.error),
            false => Self::work(refusal.error),
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self { error, status: 2 }
    }
}
