//! Columns of one mode, prepared once: forms of forces, currents and voltages, and constant quantities.

use super::sum::{Places, Sum};
use crate::friction::Motion;
use crate::mechanism::{Drive, DriveMode, Mechanism, Mode, SpringLaw, What};

/// Forces of springs, currents and voltages of drives: equal in all modes with the same case of amplifiers, gears, belt
/// and stops.
pub(super) struct Elements {
    mode: Mode,
    pub(super) force: Vec<Sum>,
    pub(super) current: Vec<Sum>,
    pub(super) voltage: Vec<Sum>,
    /// State of one-sided springs: slack, or the side that pushes.
    pub(super) contact: Vec<f64>,
}

/// A mode of recorded rows.
pub(super) struct Sheet {
    pub(super) mode: Mode,
    /// Number of its [`Elements`].
    pub(super) elements: usize,
    /// Friction on each body from its speed, or from its load.
    pub(super) friction: Vec<Held>,
}

/// The source of the friction on a body.
pub(super) enum Held {
    /// One form.
    Form(Box<Sum>),
    /// The load at rest, of which a lossy gear holds a part: between its least and its largest value.
    Between,
}

/// All modes of recorded rows.
#[derive(Default)]
pub(super) struct Sheets {
    pub(super) sheets: Vec<Sheet>,
    pub(super) elements: Vec<Elements>,
}

impl Sheets {
    /// Index of the sheet of a mode, which is prepared if new.
    pub(super) fn index(&mut self, mechanism: &Mechanism, places: &Places, mode: &Mode) -> usize {
        if let Some(known) = self.sheets.iter().position(|sheet| sheet.mode == *mode) {
            return known;
        }
        let elements = self.elements.iter().position(|elements| same_elements(&elements.mode, mode));
        let elements = elements.unwrap_or_else(|| {
            self.elements.push(Elements::new(mechanism, places, mode));
            self.elements.len() - 1
        });
        let friction = (0..mechanism.bodies.len()).map(|body| Held::new(mechanism, places, body, mode)).collect();
        self.sheets.push(Sheet { mode: *mode, elements, friction });
        self.sheets.len() - 1
    }
}

fn same_elements(a: &Mode, b: &Mode) -> bool {
    let limits = |drive: &DriveMode| (drive.voltage, drive.current);
    a.slack == b.slack
        && a.contact == b.contact
        && a.piece == b.piece
        && a.drive.iter().map(limits).eq(b.drive.iter().map(limits))
}

impl Elements {
    fn new(mechanism: &Mechanism, places: &Places, mode: &Mode) -> Self {
        let springs = 0..mechanism.springs.len();
        let drives = 0..mechanism.drives.len();
        let contact = |spring: usize| {
            let what = match mechanism.springs[spring].law {
                SpringLaw::Tension { .. } => What::Span(spring),
                _ => What::Gap(spring),
            };
            f64::from(mode.status(what).code())
        };
        Self {
            mode: *mode,
            force: springs.clone().map(|spring| places.sum(&mechanism.spring_force(spring, mode))).collect(),
            current: drives.clone().map(|drive| places.sum(&mechanism.current(drive, mode))).collect(),
            voltage: drives.map(|drive| places.sum(&mechanism.voltage(drive, mode))).collect(),
            contact: springs.map(contact).collect(),
        }
    }
}

impl Held {
    fn new(mechanism: &Mechanism, places: &Places, body: usize, mode: &Mode) -> Self {
        let law = mechanism.friction(body);
        let sliding = |viscous: f64, dry: f64| {
            let mut sum = Sum::constant(dry);
            sum.add(places.speed(body), viscous);
            Held::Form(Box::new(sum))
        };
        match mode.motion[body] {
            // F_f = b v ± F_c                                                   (15)
            Motion::Free => sliding(law.forward.viscous, 0.0),
            Motion::Forward => sliding(law.forward.viscous, law.forward.coulomb),
            Motion::Backward => sliding(law.backward.viscous, -law.backward.coulomb),
            Motion::Stuck if mechanism.leader(body) != body => Held::Form(Box::new(Sum::constant(0.0))),
            Motion::Stuck => {
                let drives = |own: usize| mechanism.drives.iter().filter(move |drive| drive.shaft == own);
                let loses = |own: usize| drives(own).any(|drive| drive.loses() && !drive.has_rotor());
                match mechanism.followers(body).any(loses) {
                    true => Held::Between,
                    false => Held::Form(Box::new(load(mechanism, places, body))),
                }
            }
        }
    }
}

/// The load without friction on a body at rest: the inner brackets of (16)-(18).
fn load(mechanism: &Mechanism, places: &Places, leader: usize) -> Sum {
    let mut sum = Sum::constant(0.0);
    for body in mechanism.followers(leader) {
        let ratio = mechanism.ratio(body);
        // The torque of the phases of a stepper is added to each row.
        let own = |drive: &Drive| drive.shaft == body && drive.motor.stepper.is_none();
        for (index, drive) in mechanism.drives.iter().enumerate().filter(|(_, drive)| own(drive)) {
            let factor = ratio * (drive.motor.gear_ratio * drive.motor.torque_constant);
            sum.add(places.current(index), factor);
        }
        for (spring, part) in mechanism.springs.iter().enumerate().rev() {
            for &(_, arm) in part.arms.iter().filter(|(other, _)| *other == body) {
                sum.add(places.force(spring), -(ratio * arm));
            }
        }
        sum.constant += ratio * mechanism.bodies[body].force;
    }
    sum
}
