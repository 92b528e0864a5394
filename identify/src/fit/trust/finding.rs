//! Findings of a fit, a sentence each.

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Grade {
    /// Information.
    Note,
    /// The result is unreliable.
    Warning,
}

impl Grade {
    /// The first word of the line.
    pub fn word(self) -> &'static str {
        match self {
            Grade::Note => "note",
            Grade::Warning => "warning",
        }
    }
}

/// A finding.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// Its severity.
    pub grade: Grade,
    /// Its subject, in a word for programs.
    pub code: &'static str,
    /// The log that it concerns; `None` if it concerns the fit.
    pub log: Option<String>,
    /// In a sentence.
    pub text: String,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let log = self.log.as_ref().map(|log| format!("{log}: ")).unwrap_or_default();
        write!(f, "{}: {log}{}", self.grade.word(), self.text)
    }
}
