//! Frequency responses from logs, without a model: Welch's averages or whole periods, with coherence and intervals, in
//! open and closed loop.
//!
//! Segments of the log are transformed under a window. With U, Y and R the transforms of input, output and reference,
//! and sums over K segments,
//!
//! ```text
//! G = Σ Y R* / Σ U R*                                  the joint input-output method; in open loop R = U
//! γ² = |Σ Y R*|² / (Σ |Y|² Σ |R|²)                     coherence
//! E|ΔG|² = Σ |Y − G U|² Σ |R|² / ((K_e − 1) |Σ U R*|²)  what noise at the output does to G
//! |ΔG| ≤ √(E|ΔG|² F₂,ν(0.95)),  ν = 2 (K_e − 1)          the circle that holds it in 95 of 100
//! ```
//!
//! For a machine with n drives, U and R are vectors and G is a row with an element for each drive:
//!
//! ```text
//! G = S_yr S_ur⁻¹,  S_yr = Σ Y Rᴴ,  S_ur = Σ U Rᴴ,  S_rr = Σ R Rᴴ
//! E|ΔG_j|² = Σ |Y − G U|² [S_ur⁻ᴴ S_rr S_ur⁻¹]_jj / (K_e − n),  ν = 2 (K_e − n)
//! γ_j² = w_j/(w_j + S_yy − H S_ryᴴ),  H = S_yr S_rr⁻¹,  w_j = |H_j|²/[S_rr⁻¹]_jj      partial coherence
//! β_j² = 1 − 1/([S_rr]_jj [S_rr⁻¹]_jj)                 coherence of an input with the others
//! ```
//!
//! At each line, G is solved for the excited inputs; one whose β² is above [`ALIKE`] cannot be distinguished from the
//! others and has no point. Logs that do not distinguish all inputs by themselves, such as those of motors moved one
//! after the other, are combined.
//!
//! A window smears: a sum over segments averages the spectrum around a line, with weights (2/3, 1/6, 1/6) of the line
//! and its neighbours for Hann's window. If the input's spectrum changes within that, as Σ U R* in closed loop towards
//! low frequencies, G would have an error of 2 G′ Φ′/(6 Φ) of the line spacing; so a sixth of their second difference
//! is subtracted from both sums, which makes the window's second moment zero and E|ΔG|² 1.44 times as large.
//!
//! In closed loop Σ Y U*/Σ |U|² would tend to −1/C under strong noise, to which the controller responds; the reference
//! is independent of noise. Segments overlap by half under Hann's window, which gives K_e = 0.95 K effective ones. For
//! a periodic input, segments are whole periods without a window, the first one omitted, and only excited lines count.
//! All signals are differenced once, which does not change G and prevents leakage from the integrator of a position.
//!
//! J. S. Bendat, A. G. Piersol, *Random Data*, 4th ed., Wiley 2010, chapters 9 and 11; L. Ljung, *System
//! Identification*, 2nd ed., Prentice Hall 1999, section 13.5; R. Pintelon, J. Schoukens, *System Identification: A
//! Frequency Domain Approach*, 2nd ed., Wiley 2012, chapter 2.

mod fit;
mod margins;
mod spectra;

pub use fit::{FrfFit, Known, fit};
pub use margins::{Measured, measured};
pub use spectra::ALIKE;

use crate::case::Case;
use crate::chance::median;
use crate::control::measures_cart;
use crate::error::{Error, Result};
use crate::linear::within_travel;
use crate::log::{Log, Quantity};
use crate::machine::{EncoderPlace, Machine, MachineKind};
use crate::signal::Hold;
use nalgebra::Complex;
use spectra::{Row, Spectra};
use std::f64::consts::PI;

/// Fraction of lines with an indistinguishable input that causes a warning.
const SOME: f64 = 0.1;

/// Least coherence of a point for fits, margins and peaks.
pub const COHERENT: f64 = 0.5;

/// Segmentation of a record.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cut {
    /// Length of a segment, s.
    pub segment: Option<f64>,
    /// Period of the input, s: whole periods are averaged.
    pub period: Option<f64>,
}

/// A point of a frequency response.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Point {
    /// rad/s.
    pub omega: f64,
    /// G, units of the output per unit of the input.
    pub value: Complex<f64>,
    /// Radius of the circle that contains the true value in 95 of 100 logs.
    pub radius: f64,
    /// √E|ΔG|².
    pub deviation: f64,
    /// γ².
    pub coherence: f64,
}

/// A frequency response from one log, or from several combined.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Frf {
    /// Name of the log, or of several, separated by commas.
    pub name: String,
    /// Index of the drive of its input.
    pub drive: usize,
    /// The key of that input's column in a log.
    pub input: &'static str,
    /// β² of that input with the others: median over the lines at which it is excited. Zero for a single drive.
    pub alike: f64,
    /// The measured quantity.
    pub quantity: Quantity,
    /// Sample interval, s.
    pub every: f64,
    /// The input between samples.
    pub hold: Hold,
    /// Number of segments or periods.
    pub segments: usize,
    /// Number of samples in each.
    pub length: usize,
    /// True for periods.
    pub periodic: bool,
    /// True if a reference was used.
    pub closed: bool,
    /// Points by frequency.
    pub points: Vec<Point>,
}

impl Frf {
    /// Points that a fit can use.
    pub fn coherent(&self) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(|point| Self::is_coherent(point))
    }

    /// True if a fit can use it.
    fn is_coherent(point: &Point) -> bool {
        point.coherence >= COHERENT && point.radius < point.value.norm()
    }

    /// The log and the measured quantity, with the input if there are several drives.
    pub fn title(&self) -> String {
        let quantity = self.quantity.name();
        match self.input {
            "input" => format!("{}: {quantity}", self.name),
            input => format!("{}: {input} to {quantity}", self.name),
        }
    }

    /// Line number of a point.
    fn line(&self, point: &Point) -> f64 {
        (point.omega * self.length as f64 * self.every / (2.0 * PI)).round()
    }
}

/// Frequency responses from the log of an axis, one for each signed output.
pub fn estimate(log: &Log, cut: &Cut) -> Result<Vec<Frf>> {
    Ok(estimate_all(MachineKind::Axis, &[log], cut)?.0)
}

/// Frequency responses from logs of a machine of this kind, by log, input and output, and warnings. Logs that do not
/// distinguish all inputs by themselves are combined.
pub fn estimate_all(kind: MachineKind, logs: &[&Log], cut: &Cut) -> Result<(Vec<Frf>, Vec<String>)> {
    let (mut each, mut rest) = (Vec::new(), Vec::new());
    for log in logs {
        let spectra = Spectra::new(&[*log], cut)?;
        let is_whole = (0..spectra.drives()).all(|drive| spectra.tells(drive));
        match is_whole || logs.len() == 1 || spectra.drives() == 1 {
            true => each.push(spectra),
            false => rest.push(*log),
        }
    }
    if !rest.is_empty() {
        each.push(Spectra::new(&rest, cut)?);
    }
    let (mut frfs, mut warnings) = (Vec::new(), Vec::new());
    for spectra in each {
        let (rows, untold) = (spectra.rows(), untold(kind, &spectra));
        if let (true, Some(error)) = (rows.is_empty(), untold.first()) {
            return Err(error.clone().in_file(format!("log \"{}\"", spectra.name)));
        }
        warnings
            .extend(untold.into_iter().map(|error| format!("{}: {}; it has no response", spectra.name, error.what)));
        for Row { drive, quantity, points } in rows {
            let mut alike = spectra.alike(drive);
            let left = alike.iter().filter(|alike| **alike > ALIKE).count();
            if left as f64 > SOME * alike.len() as f64 && quantity == spectra.first_output() {
                let input = kind.geometry().drives[drive].input;
                warnings.push(format!(
                    "{}: at {left} of {} frequencies {input} cannot be told from the other inputs",
                    spectra.name,
                    alike.len()
                ));
            }
            frfs.push(Frf {
                name: spectra.name.clone(),
                drive,
                input: kind.geometry().drives[drive].input,
                alike: median(&mut alike),
                quantity,
                every: spectra.every,
                hold: spectra.hold,
                segments: spectra.segments(),
                length: spectra.length,
                periodic: spectra.periodic,
                closed: spectra.closed(),
                points,
            });
        }
    }
    Ok((frfs, warnings))
}

/// Reasons for missing responses to some inputs.
fn untold(kind: MachineKind, spectra: &Spectra) -> Vec<Error> {
    let name = |drive: &usize| kind.geometry().drives[*drive].input;
    let listed = |drives: &[usize]| drives.iter().map(name).collect::<Vec<_>>().join(" and ");
    let all = (0..spectra.drives()).filter(|drive| !spectra.tells(*drive));
    let (alike, resting): (Vec<usize>, Vec<usize>) = all.partition(|drive| !spectra.alike(*drive).is_empty());
    let mut errors = Vec::new();
    if !alike.is_empty() {
        let coherence = alike.iter().map(|drive| median(&mut spectra.alike(*drive))).fold(f64::INFINITY, f64::min);
        errors.push(
            Error::new(format!("{} cannot be told apart: their coherence is {coherence:.3}", listed(&alike)))
                .allowed(format!("at most {ALIKE}"))
                .next("move one motor after the other, or each by a signal of its own: prbs with different seeds"),
        );
    }
    match resting[..] {
        [] => {}
        [_] if spectra.drives() == 1 => errors.push(
            Error::new("the input does not change")
                .next("excite the axis with a sweep, noise or several sines at once"),
        ),
        _ => errors
            .push(Error::new(format!("no change of {}", listed(&resting))).next(
                "move each motor, one after the other or by a signal of its own, in the same or in further logs",
            )),
    }
    errors
}

/// A measured response with that of the model.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Response {
    /// The measured response.
    pub frf: Frf,
    /// Response of the model of the file at the same points; empty if the model lacks the quantity.
    pub model: Vec<Complex<f64>>,
    /// Response of the fitted model; empty without a fit.
    pub fitted: Vec<Complex<f64>>,
    /// Margins of the case's controllers, for the position measured by this drive's controller.
    pub margins: Option<Measured>,
}

/// All results from the logs of a case.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Operating point of the model.
    pub known: Known,
    /// Responses by log, input and output.
    pub responses: Vec<Response>,
    /// Warnings about inputs that the logs do not distinguish.
    pub warnings: Vec<String>,
    /// Stiffness, damping and delay, or the reason for a missing fit.
    pub fit: Result<FrfFit>,
    /// True if the model does not describe responses that suffice for a fit.
    pub is_astray: bool,
}

impl Known {
    /// Operating point of a case, for these positions of cart and bridge, m, zero by default, and this delay, s, by
    /// default that of the controller. Errors: NaN, a position outside the travel, or a position of a missing bridge.
    pub fn new(case: &Case, at: Option<f64>, bridge: Option<f64>, delay: Option<f64>) -> Result<Self> {
        for (option, value) in [("--at", at), ("--bridge", bridge), ("--delay", delay)] {
            if let Some(value) = value.filter(|value| !value.is_finite()) {
                let error = Error::new(format!("{value:?} is of no use here")).in_file(option);
                return Err(error.allowed("a finite number, in m or s"));
            }
        }
        within_travel(&case.machine, at, bridge)?;
        let delay = delay.or(case.controller.as_ref().map(|design| design.delay)).unwrap_or_default();
        Ok(Self { place: at.unwrap_or_default(), bridge: bridge.unwrap_or_default(), delay })
    }
}

/// Measures the responses of all logs of a case, with fit and margins.
///
/// ```no_run
/// use taut::case::Case;
/// use taut::frf::{Cut, Known, measure};
///
/// let case = Case::read("axis.toml")?; // with logs
/// let measured = measure(&case, &Cut::default(), Known::new(&case, None, None, None)?)?;
/// println!("{} responses", measured.responses.len());
/// # Ok::<(), taut::Error>(())
/// ```
pub fn measure(case: &Case, cut: &Cut, known: Known) -> Result<Measurement> {
    case.complete()?;
    let machine = &case.machine;
    let logs: Vec<&Log> = case.experiments.iter().filter_map(|experiment| experiment.log.as_deref()).collect();
    if logs.is_empty() {
        let such_as = match machine.drives.len() {
            1 => "input = \"u\", drive_angle = \"phi\"",
            _ => "left_input = \"u1\", right_input = \"u2\", left_angle = \"phi1\"",
        };
        return Err(Error::new("this case has no log to measure a response from")
            .next(format!("give an experiment log = {{ file = \"log.csv\", time = \"t\", {such_as} }}")));
    }
    let (frfs, mut warnings) = estimate_all(machine.kind, &logs, cut)?;
    let kinematic: Vec<Frf> = frfs.iter().filter(|frf| is_kinematic(frf.quantity)).cloned().collect();
    let fit = fit(machine, &known, &kinematic);
    let mut is_astray = false;
    if let Err(error) = &fit
        && fit::can_be_fitted(machine, &kinematic)
    {
        is_astray = true;
        let next = error.next.iter().map(|next| format!(": {next}")).collect::<String>();
        warnings.push(format!("{}{next}", error.what));
    }
    if let Ok(fit) = &fit
        && fit.is_far()
    {
        is_astray = true;
        warnings.push(format!(
            "the fitted responses miss the measured ones by {:.3} times what noise explains, so the intervals are not to be \
             relied on: check `hold` of the log, its delay, and what the model lacks",
            fit.chi.sqrt()
        ));
    }
    let mut fitted = fit.as_ref().map(|fit| fit.curves.clone()).unwrap_or_default().into_iter();
    let mut responses = Vec::new();
    for frf in &frfs {
        let model = fit::model(machine, &known, frf).unwrap_or_default();
        let fitted = if is_kinematic(frf.quantity) { fitted.next().unwrap_or_default() } else { Vec::new() };
        responses.push(Response {
            frf: frf.clone(),
            model,
            fitted,
            margins: margins_of(case, frf, &frfs, fit.as_ref().ok()),
        });
    }
    Ok(Measurement { known, responses, warnings, fit, is_astray })
}

/// True if a quantity is a position or a speed.
fn is_kinematic(quantity: Quantity) -> bool {
    quantity.is_position() || quantity.is_speed()
}

/// Names of the position measured by the controller of a drive, the measured quantity first.
fn measured_by(machine: &Machine, drive: usize) -> Vec<String> {
    let geometry = machine.geometry();
    let at = &geometry.drives[drive];
    let pulley = format!("{}_angle", geometry.label(at.pulley).key);
    match (machine.encoder, measures_cart(machine)) {
        (_, true) => vec![Quantity::CartPosition.name().into()],
        // With a stiff gear, the rotor's angle divided by the ratio is that of the pulley.
        (Some(encoder), _) if encoder.at != EncoderPlace::DrivePulley => {
            vec![format!("{}_angle", at.rotor.key), pulley]
        }
        _ => vec![pulley],
    }
}

/// Margins of the case's controllers, if this is the response of the position measured by its drive's controller, and
/// those of the other drives were measured with it. A delay of the controller that the fit does not find in the logs is
/// added.
fn margins_of(case: &Case, frf: &Frf, all: &[Frf], fit: Option<&FrfFit>) -> Option<Measured> {
    let (design, machine) = (case.controller.as_ref()?, &case.machine);
    if !measured_by(machine, frf.drive).iter().any(|name| name == frf.quantity.name()) {
        return None;
    }
    let response = |row: usize, drive: usize| {
        if row == frf.drive && drive == row {
            return Some(frf);
        }
        let names = measured_by(machine, row);
        let of = |name: &String| {
            all.iter().find(|one| one.name == frf.name && one.drive == drive && one.quantity.name() == name)
        };
        names.iter().find_map(of)
    };
    let drives = 0..machine.drives.len();
    let row = |row: usize| drives.clone().map(|drive| response(row, drive)).collect::<Option<Vec<_>>>();
    let matrix = drives.clone().map(row).collect::<Option<Vec<_>>>()?;
    let length = if measures_cart(machine) { 1.0 } else { machine.pulley_radius };
    let late = fit.map_or(0.0, |fit| {
        let (found, [low, high]) = fit.delay;
        if (low..=high).contains(&design.delay) { 0.0 } else { design.delay - found }
    });
    measured(&matrix, frf.drive, design, machine, (length, late)).ok()
}
