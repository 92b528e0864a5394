//! Everything that the command computes, before it is put into words.

use super::belt::Belt;
use super::linear::Linear;
use super::model::Sets;
use super::studies::{Identifiability, Matched, Runs, Table3};
use taut::error::Result;

/// The numbers behind claims, figures and report.
pub struct Findings {
    /// The paper's parameters.
    pub sets: Sets,
    /// All responses.
    pub runs: Runs,
    /// Section 2.3.
    pub belt: Belt,
    /// Eq. (5)-(10).
    pub linear: Linear,
    /// Figures 14, 15, 20 and 21.
    pub matched: Matched,
    /// Table 3.
    pub table3: Table3,
    /// Findings P3 and P7.
    pub identifiability: Identifiability,
}

impl Findings {
    /// Computes it all.
    pub fn new() -> Result<Self> {
        let sets = Sets::read()?;
        let (rest, table3) = rayon::join(
            || -> Result<_> {
                let runs = Runs::new(&sets)?;
                let identifiability = Identifiability::new(&sets, &runs)?;
                Ok((runs, identifiability))
            },
            || Table3::new(&sets),
        );
        let (runs, identifiability) = rest?;
        Ok(Self {
            belt: Belt::new(&sets),
            linear: Linear::new(&sets),
            matched: Matched::new(&runs),
            table3: table3?,
            identifiability,
            runs,
            sets,
        })
    }
}
