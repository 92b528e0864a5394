//! The equations of a mechanism as tables: what its parts can do, and for each quantity a row of weights on the state,
//! the inputs and one, chosen by what those parts do that the quantity depends on.
//!
//! ```text
//! z = (states, inputs, 1)      ż_i = row_i(mode)·z      a mode holds while guard(mode)·z ≥ 0
//! ```
//!
//! A mode is what all parts do together; there may be thousands. But the acceleration of a body depends on its own
//! motion and on the springs and the drive at it alone, so that the rows of a machine are a hundred, not thousands.

mod maker;
mod phases;

use crate::error::{Error, Result};
use crate::friction::Motion;
use crate::mechanism::{self, Cause, Contact, Form, Layout, Limit, Mechanism, Mode, Next, SpringLaw, State, Status};
use crate::mechanism::{Switch, What};
use maker::Maker;
pub use phases::Stepped;

/// A part that can do several things.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Which.
    pub kind: ElementKind,
    /// Its name, as columns have it.
    pub key: &'static str,
    /// The things it can do, by their codes in the tables.
    pub states: Vec<Does>,
}

/// Which part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementKind {
    /// A body with friction, or whose gear loses power.
    Body(usize),
    /// The torque through the gear of a drive, where it loses power.
    GearTorque(usize),
    /// The voltage limit of a drive.
    Voltage(usize),
    /// Its current limit.
    Current(usize),
    /// The voltage limit of a stepper's phase: drive and phase.
    Phase(usize, usize),
    /// A spring that only pulls.
    Span(usize),
    /// A spring that only pushes.
    Gap(usize),
    /// A spring whose force is a line.
    Line(usize),
}

/// A thing that a part does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Does {
    /// Of a body.
    Moves(Motion),
    /// Of a gear: whether its torque is positive.
    Torque(bool),
    /// Of a limit.
    Limits(Limit),
    /// Of a span: whether it is slack.
    Slack(bool),
    /// Of flanks and end stops.
    Touches(Contact),
    /// Of a line: which piece of it holds.
    Follows(u8),
    /// Of a stepper: by how many tooth pitches its rotor is behind.
    Slips(i32),
}

impl Does {
    /// The next state of a part.
    fn next(next: Next) -> Self {
        match next {
            Next::Moves(_, motion) => Does::Moves(motion),
            Next::Torque(_, positive) => Does::Torque(positive),
            Next::Switch(Switch::Span(_, slack)) => Does::Slack(slack),
            Next::Switch(Switch::Gap(_, contact)) => Does::Touches(contact),
            Next::Switch(Switch::Line(_, piece)) => Does::Follows(piece),
            Next::Switch(Switch::Field(_, pitches)) => Does::Slips(pitches),
            Next::Switch(Switch::Voltage(_, limit) | Switch::Current(_, limit)) => Does::Limits(limit),
        }
    }

    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Does::Moves(motion) => Status::Motion(motion).word(),
            Does::Torque(true) => "positive",
            Does::Torque(false) => "negative",
            Does::Limits(limit) => Status::Limit(limit).word(),
            Does::Slack(slack) => Status::Slack(slack).word(),
            Does::Touches(Contact::LowLoose) => "negative side, loose",
            Does::Touches(Contact::HighLoose) => "positive side, loose",
            Does::Touches(contact) => Status::Contact(contact).word(),
            Does::Follows(piece) => Status::Piece(piece).word(),
            Does::Slips(pitches) => Status::Slipped(pitches).word(),
        }
    }
}

/// Rows of weights on z, one for each combination of what some elements do.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The elements that choose, by their numbers; the last one changes fastest.
    pub depends: Vec<usize>,
    /// The rows.
    pub weights: Vec<Vec<f64>>,
    /// The rows as linear forms.
    pub(super) forms: Vec<Form>,
}

impl Row {
    /// One row, which no element changes.
    pub(super) fn constant(weights: Vec<f64>) -> Self {
        Self { depends: Vec::new(), weights: vec![weights], forms: Vec::new() }
    }
}

/// A condition of a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct TableGuard {
    /// The element that it is a condition on, and what that does where it is one; none for one that always is.
    pub of: Option<(usize, usize)>,
    /// The change that follows where it falls.
    pub then: Then,
    /// Which of several that have fallen at one instant is settled first: the one of least rank.
    pub rank: u8,
    /// Which tolerance is its own; none for one that has none.
    pub slot: Option<usize>,
    /// Which note that it starts from zero is its own.
    pub fresh: usize,
    /// Places of z that the change sets, and their values.
    pub resets: Vec<(usize, f64)>,
    /// Of a body: the numbers of the conditions on its breakaway, forward and backward.
    pub breakaways: Option<[usize; 2]>,
    /// Of a breakaway: by how much it exceeds the Coulomb friction on that side.
    pub drop: f64,
    /// The note of the condition that starts with a slope of zero where the motion has let the part go.
    pub gently: Option<usize>,
    /// Its value.
    pub row: Row,
}

/// The change that follows where a condition falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Then {
    /// A body stops: it goes on as the breakaway has it that its load passes, or does this, by its code: it rests.
    Decide(usize),
    /// The element does this, by its code.
    Become(usize),
    /// The run ends: something left its travel.
    Leave,
}

/// A machine as tables.
#[derive(Debug, Clone)]
pub struct Tables {
    /// The machine, ways counted from zero.
    pub mechanism: Mechanism,
    pub(super) layout: Layout,
    /// Parts that can do several things.
    pub elements: Vec<Element>,
    /// The rate of each state.
    pub rates: Vec<Row>,
    /// Names of the states.
    pub states: Vec<StateName>,
    /// The conditions.
    pub guards: Vec<TableGuard>,
    /// Number of their tolerances.
    pub slots: usize,
    /// The places in z of the factors of each product behind the states; a factor is a state or an earlier product.
    pub products: Vec<[usize; 2]>,
    /// Steppers, by drives; none of other machines.
    pub steppers: Vec<Stepped>,
    /// Currents of the drives, A.
    pub currents: Vec<Row>,
    /// Voltages at the motors, V.
    pub voltages: Vec<Row>,
    /// Forces of the springs, N or N m.
    pub forces: Vec<Row>,
    /// Torque of each gear with losses while bodies rest: its sign tells how it carries.
    pub resting_torque: Vec<Option<Row>>,
    /// Rows that [`Tables::ask`] added.
    pub(super) others: Vec<Row>,
    /// A bound of how fast anything can change in any mode, 1/s.
    pub fastest: f64,
}

/// A state.
#[derive(Debug, Clone, PartialEq)]
pub struct StateName {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
}

/// Rows that a model may have.
const MOST_ROWS: usize = 20_000;

impl Tables {
    /// Tables of a mechanism. Errors: a mechanism that is not piecewise linear.
    pub fn new(mechanism: &Mechanism) -> Result<Self> {
        if !mechanism.is_piecewise_linear() {
            return Err(curved(mechanism));
        }
        let layout = Layout::new(mechanism);
        let elements = elements(mechanism);
        let maker = Maker { mechanism, layout: &layout, elements: &elements };
        let mut rates = Vec::new();
        for place in 0..layout.states {
            rates.push(maker.row(&|mode| maker.rate(place, mode))?);
        }
        let drives = 0..mechanism.drives.len();
        let each = |form: &dyn Fn(usize, &Mode) -> Form, count: usize| -> Result<Vec<Row>> {
            (0..count).map(|index| maker.row(&|mode| form(index, mode))).collect()
        };
        let currents = each(&|drive, mode| mechanism.current(drive, mode), drives.len())?;
        let voltages = each(&|drive, mode| mechanism.voltage(drive, mode), drives.len())?;
        let forces = each(&|spring, mode| mechanism.spring_force(spring, mode), mechanism.springs.len())?;
        let resting_torque = drives
            .map(|drive| {
                let loses = mechanism.drives[drive].loses();
                loses.then(|| maker.row(&|mode| mechanism.torque_at_rest(drive, mode))).transpose()
            })
            .collect::<Result<_>>()?;
        let (guards, slots) = maker.guards()?;
        let fastest = maker.fastest(&rates);
        let states = states(mechanism, &layout);
        let mechanism = mechanism.clone();
        let all = [&rates, &currents, &voltages, &forces].into_iter().flatten().chain(guards.iter().map(|g| &g.row));
        let rows: usize = all.map(|row| row.weights.len()).sum();
        if rows > MOST_ROWS {
            return Err(Error::new(format!("this machine has {rows} rows of equations"))
                .allowed(format!("up to {MOST_ROWS}"))
                .next("leave out optional parts: limits, slack spans, end stops, or a compliant gear"));
        }
        Ok(Self {
            mechanism,
            layout,
            elements,
            rates,
            states,
            guards,
            slots,
            products: Vec::new(),
            steppers: Vec::new(),
            currents,
            voltages,
            forces,
            resting_torque,
            others: Vec::new(),
            fastest,
        })
    }

    /// Number of places of z: states, products, inputs and a one.
    pub fn size(&self) -> usize {
        self.layout.states + self.products.len() + self.layout.inputs + 1
    }

    /// Adds the rows of one more quantity, and says where among the [others](Self::others) they stand.
    pub(super) fn ask(&mut self, form: &dyn Fn(&Mechanism, &Mode) -> Form) -> Result<usize> {
        let maker = Maker { mechanism: &self.mechanism, layout: &self.layout, elements: &self.elements };
        let row = maker.row(&|mode| form(&self.mechanism, mode))?;
        self.others.push(row);
        Ok(self.others.len() - 1)
    }

    /// The machine with each input, and its rate, as states, so that ramps are exact
    /// then. Behind the states stand as many inputs as before, which nothing depends on.
    ///
    /// ```text
    /// z = (states, u, u̇, 0, 1)      rate of u: u̇      rate of u̇: 0
    /// ```
    pub(super) fn with_ramps(mut self) -> Self {
        let (first, inputs) = (self.layout.states, self.layout.inputs);
        let widen = |row: &mut Row| {
            for weights in &mut row.weights {
                let place = weights.len() - 1;
                weights.splice(place..place, std::iter::repeat_n(0.0, 2 * inputs));
            }
        };
        let guards = self.guards.iter_mut().map(|guard| &mut guard.row);
        let all = [&mut self.rates, &mut self.currents, &mut self.voltages, &mut self.forces, &mut self.others];
        all.into_iter().flatten().chain(guards).chain(self.resting_torque.iter_mut().flatten()).for_each(widen);
        let size = self.size() + 2 * inputs;
        for drive in 0..2 * inputs {
            let mut weights = vec![0.0; size];
            if drive < inputs {
                weights[first + inputs + drive] = 1.0;
            }
            self.rates.push(Row::constant(weights));
            self.states.push(StateName { name: format!("input_{drive}"), unit: "" });
        }
        self.layout.states += 2 * inputs;
        self
    }

    /// The code that a column shows of what an element does.
    pub fn shown_code(does: Does) -> i8 {
        match does {
            Does::Moves(motion) => Status::Motion(motion).code(),
            Does::Torque(positive) => i8::from(positive),
            Does::Limits(limit) => Status::Limit(limit).code(),
            Does::Slack(slack) => Status::Slack(slack).code(),
            Does::Touches(contact) => Status::Contact(contact).code(),
            Does::Follows(piece) => Status::Piece(piece).code(),
            Does::Slips(pitches) => Status::Slipped(pitches).code(),
        }
    }

    /// The row of a table in a mode that is given by what each element does.
    pub fn look<'t>(&self, row: &'t Row, does: &[usize]) -> &'t [f64] {
        let index = row.depends.iter().fold(0, |index, &e| index * self.elements[e].states.len() + does[e]);
        &row.weights[index]
    }

    /// Codes of the elements at rest at the origin without an input.
    pub fn at_rest(&self) -> Vec<usize> {
        let mode = self.mechanism.first_mode(&State::default());
        self.elements.iter().map(|element| element.code(element.kind.action(&mode))).collect()
    }

    /// Number of rows in all tables.
    pub fn rows(&self) -> usize {
        let all = [&self.rates, &self.currents, &self.voltages, &self.forces].into_iter().flatten();
        all.chain(self.guards.iter().map(|guard| &guard.row)).map(|row| row.weights.len()).sum()
    }

    /// Number of modes: combinations of what all elements can do.
    pub fn modes(&self) -> f64 {
        self.elements.iter().map(|element| element.states.len() as f64).product()
    }
}

/// Says which part is curved, and what to do instead.
fn curved(mechanism: &Mechanism) -> Error {
    let body = mechanism.bodies.iter().find(|body| !body.friction.is_piecewise_linear() || body.along.is_some());
    let what = match (body, mechanism.springs.iter().find(|spring| spring.follows.is_some())) {
        (Some(body), _) if body.along.is_some() => {
            format!("the friction of the {} changes along its travel", body.label.name)
        }
        (Some(body), _) => format!("the friction of the {} is a curve", body.label.name),
        (None, Some(spring)) => format!("the stiffness of {} follows the cart", spring.label.name),
        (None, None) if mechanism.ride.is_some() => {
            "the bridge yaws, and its inertia depends on where the cart is".to_string()
        }
        (None, None) => "this machine is not linear between its events".to_string(),
    };
    Error::new(format!("{what}; this export requires a machine that is linear between its events"))
        .allowed("Coulomb friction with or without a breakaway (`coulomb`, `static`), spans of constant stiffness, and no [bridge.yaw]")
        .next("`taut export fmu` takes it as it is")
}

impl ElementKind {
    /// The thing it does in a mode.
    fn action(self, mode: &Mode) -> Does {
        match self {
            ElementKind::Body(body) => Does::Moves(mode.motion[body]),
            ElementKind::GearTorque(drive) => Does::Torque(mode.drive[drive].torque_positive),
            ElementKind::Voltage(drive) => Does::Limits(mode.drive[drive].voltage),
            ElementKind::Current(drive) => Does::Limits(mode.drive[drive].current),
            // Modes do not have it: at rest the phases are within their supply.
            ElementKind::Phase(..) => Does::Limits(Limit::Inside),
            ElementKind::Span(spring) => Does::Slack(mode.slack[spring]),
            ElementKind::Gap(spring) => Does::Touches(mode.contact[spring]),
            ElementKind::Line(spring) => Does::Follows(mode.piece[spring]),
        }
    }

    /// True if a condition with this cause is one on it.
    fn owns(self, cause: Cause) -> bool {
        match (self, cause) {
            (ElementKind::Body(own), Cause::Stop(body) | Cause::BreakForward(body) | Cause::BreakBackward(body)) => {
                own == body
            }
            (ElementKind::GearTorque(own), Cause::GearTorque(drive)) => own == drive,
            (kind, Cause::Switch(switch)) => kind.what() == Some(switch.what()),
            _ => false,
        }
    }

    /// The part that events name; none for the torque of a gear.
    pub fn what(self) -> Option<What> {
        match self {
            ElementKind::Body(body) => Some(What::Body(body)),
            ElementKind::GearTorque(_) | ElementKind::Phase(..) => None,
            ElementKind::Voltage(drive) => Some(What::Voltage(drive)),
            ElementKind::Current(drive) => Some(What::Current(drive)),
            ElementKind::Span(spring) => Some(What::Span(spring)),
            ElementKind::Gap(spring) => Some(What::Gap(spring)),
            ElementKind::Line(spring) => Some(What::Line(spring)),
        }
    }
}

impl Element {
    /// The code of something that it can do.
    fn code(&self, does: Does) -> usize {
        self.states.iter().position(|own| *own == does).unwrap_or(0)
    }

    /// The next state of it, by its code.
    fn then(&self, then: mechanism::Then) -> Then {
        match then {
            mechanism::Then::Become(next) => Then::Become(self.code(Does::next(next))),
            mechanism::Then::Decide(_) => Then::Decide(self.code(Does::Moves(Motion::Stuck))),
            mechanism::Then::Leave => Then::Leave,
        }
    }
}

/// All parts of a mechanism that can do several things.
fn elements(mechanism: &Mechanism) -> Vec<Element> {
    let mut all = Vec::new();
    let mut add = |kind: ElementKind, key: &'static str, states: &[Does]| {
        all.push(Element { kind, key, states: states.to_vec() });
    };
    for body in mechanism.leaders().filter(|&body| mechanism.has_modes(body)) {
        let motions = [Motion::Backward, Motion::Stuck, Motion::Forward].map(Does::Moves);
        add(ElementKind::Body(body), mechanism.bodies[body].label.key, &motions);
    }
    let limits = [Limit::Low, Limit::Inside, Limit::High].map(Does::Limits);
    for (index, drive) in mechanism.drives.iter().enumerate() {
        if drive.loses() {
            add(ElementKind::GearTorque(index), drive.label.key, &[true, false].map(Does::Torque));
        }
        if drive.amplifier.voltage_limit.is_some() {
            add(ElementKind::Voltage(index), drive.voltage.key, &limits);
        }
        if drive.amplifier.current_limit.is_some() {
            add(ElementKind::Current(index), drive.current.key, &limits);
        }
    }
    for (index, spring) in mechanism.springs.iter().enumerate() {
        match &spring.law {
            SpringLaw::Tension { .. } => {
                add(ElementKind::Span(index), spring.label.key, &[false, true].map(Does::Slack));
            }
            SpringLaw::Gap { .. } if spring.damping > 0.0 => {
                let sides = [Contact::Low, Contact::LowLoose, Contact::Apart, Contact::HighLoose, Contact::High];
                add(ElementKind::Gap(index), spring.label.key, &sides.map(Does::Touches));
            }
            SpringLaw::Gap { .. } => {
                let sides = [Contact::Low, Contact::Apart, Contact::High];
                add(ElementKind::Gap(index), spring.label.key, &sides.map(Does::Touches));
            }
            SpringLaw::Line { line, .. } => {
                let pieces: Vec<Does> = (0..=line.points().len()).map(|piece| Does::Follows(piece as u8)).collect();
                add(ElementKind::Line(index), spring.label.key, &pieces);
            }
            SpringLaw::TwoSided | SpringLaw::Bounds { .. } | SpringLaw::Angle { .. } | SpringLaw::None => {}
        }
    }
    all
}

/// Names of the states.
fn states(mechanism: &Mechanism, layout: &Layout) -> Vec<StateName> {
    let mut all = vec![StateName { name: String::new(), unit: "" }; layout.states];
    for (index, body) in mechanism.bodies.iter().enumerate() {
        let [way, speed, _] = body.kind.units();
        let key = body.label.key;
        all[layout.coordinate[index]] = match layout.is_replaced(index) {
            true => {
                let turns = body.is_rotor;
                StateName { name: format!("{key}_stretch"), unit: if turns { "rad" } else { "m" } }
            }
            false => StateName { name: format!("{key}_position"), unit: way },
        };
        all[layout.speed[index]] = StateName { name: format!("{key}_speed"), unit: speed };
    }
    for (drive, place) in mechanism.drives.iter().zip(layout.current) {
        if let Some(place) = place {
            all[place] = StateName { name: format!("{}_current", drive.label.key), unit: "A" };
        }
    }
    all
}
