//! An FMU for co-simulation, by the functions behind those of the standard.

use crate::answer::{Answer, End, LEAST, is_piecewise_linear, rows};
use crate::double::Double;
use crate::subject::{Fed, Subject};
use std::sync::Arc;
use taut::export::fmu::{Model, Role};
use taut::signal::profile::Profile;
use taut_fmu::instance::{Instance, Refusal, Use};

/// How far positions of the general solver at the FMU's own tolerance may be off, m.
const GENERAL: f64 = 1e-8;

/// A model with the references that a run needs.
pub(crate) struct Case {
    pub(crate) model: Arc<Model>,
    pub(crate) inputs: Vec<u32>,
    pub(crate) positions: Vec<u32>,
}

impl Case {
    pub(crate) fn new(subject: &Subject) -> Result<Self, String> {
        let is_loop = matches!(subject, Subject::Loop(_));
        let model =
            Model::new(&subject.opened(), is_loop).map_err(|error| format!("the export is refused: {error}"))?;
        let of_role = |wanted: fn(Role) -> Option<usize>| -> Vec<u32> {
            let mut found: Vec<(usize, u32)> =
                model.variables.iter().filter_map(|v| Some((wanted(v.role)?, v.reference))).collect();
            found.sort_unstable();
            found.into_iter().map(|(_, reference)| reference).collect()
        };
        let inputs = match is_loop {
            true => of_role(|role| if let Role::Reference(k) = role { Some(k) } else { None }),
            false => of_role(|role| if let Role::Input(drive) = role { Some(drive) } else { None }),
        };
        let named = |name: &&str| {
            let found = model.variables.iter().find(|variable| variable.name == **name);
            found.map(|variable| variable.reference).ok_or(format!("the FMU has no {name}"))
        };
        let positions = subject.columns().iter().map(named).collect::<Result<_, _>>()?;
        Ok(Self { model: Arc::new(model), inputs, positions })
    }
}

pub(crate) fn told(refusal: Refusal) -> String {
    format!("the FMU refuses: {}", refusal.message)
}

/// References of a profile at a time, as the FMU takes them.
pub(crate) fn references(profile: &Profile, time: f64) -> [f64; 5] {
    let y = profile.at(time);
    [y.position, y.speed, y.acceleration, y.jerk, y.snap]
}

/// Inputs are held between communication points, which in a closed loop are the controller's samples.
pub fn run(subject: &Subject) -> Result<Answer, String> {
    let opened = Case::new(subject)?;
    let [until, mut every] = subject.times();
    let (fed, profile) = match subject {
        Subject::Loop(case) => {
            let design = case.controller.as_ref().ok_or("the case has no controller")?;
            every = design.every;
            (Fed::Sampled, Some(case.moves[0].profile()))
        }
        Subject::Axis(_) | Subject::Gantry(_) => (subject.held(every)?, None),
    };
    let mut instance = Instance::new(Arc::clone(&opened.model), Use::CoSimulation { events: false, early: false });
    instance.set_up(0.0, None).map_err(told)?;
    instance.enter_initialization().map_err(told)?;
    let set = |instance: &mut Instance, k: usize| -> Result<(), String> {
        let values = match (&fed, profile) {
            (Fed::Held(_, values), _) => values.iter().map(|values| values[k]).collect(),
            (Fed::AsGiven | Fed::ByModel(_) | Fed::Sampled, Some(profile)) => {
                references(profile, k as f64 * every).to_vec()
            }
            (Fed::AsGiven | Fed::ByModel(_) | Fed::Sampled, None) => Vec::new(),
        };
        instance.set_reals(&opened.inputs[..values.len()], &values).map_err(told)
    };
    set(&mut instance, 0)?;
    instance.exit_initialization().map_err(told)?;
    let read = |instance: &mut Instance| -> Result<Vec<f64>, String> {
        let mut values = vec![0.0; opened.positions.len()];
        instance.reals(&opened.positions, &mut values).map_err(told)?;
        Ok(values)
    };
    let (mut times, mut positions) = (vec![0.0], vec![read(&mut instance)?]);
    let mut end = End::Complete;
    let count = (until / every * (1.0 + 1e-12)).floor() as usize;
    for k in 0..count {
        let (from, to) = (k as f64 * every, (k + 1) as f64 * every);
        times.push(to);
        if end != End::Complete {
            continue;
        }
        set(&mut instance, k)?;
        instance.go(instance.step_end(from, to - from).map_err(told)?, false).map_err(told)?;
        if instance.is_over() {
            end = End::Left(instance.time());
            continue;
        }
        positions.push(read(&mut instance)?);
    }
    let machine = subject.machine(&mut Double::from);
    let rows = rows(subject, &machine, &positions);
    let farthest = machine.origin.iter().map(|origin| origin.high.abs()).fold(0.0, f64::max);
    let allowed = if is_piecewise_linear(subject) { LEAST * (1.0 + farthest) } else { GENERAL };
    Ok(Answer { subject: None, fed, times, rows, events: None, end, allowed, is_stated: false, ties: 0 })
}
