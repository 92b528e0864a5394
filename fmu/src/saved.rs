//! The state of an instance as bytes, and back.

use crate::instance::{Input, Instance, Phase, Plant, Refusable, Refusal};
use taut_control::control::Stepped;

/// The first eight of such bytes.
const MARK: u64 = u64::from_le_bytes(*b"tautfmu3");

const PHASES: [Phase; 7] = [
    Phase::Instantiated,
    Phase::Initialization,
    Phase::Event,
    Phase::Continuous,
    Phase::Step,
    Phase::Terminated,
    Phase::Broken,
];

impl Instance {
    /// All of its state. Errors: one whose machine has ended the run.
    pub fn bytes(&self) -> Refusable<Vec<u8>> {
        let mut list = vec![MARK, taut_core::chance::hash(self.model.token.bytes()), u64::from(self.exchanges())];
        list.push(PHASES.iter().position(|phase| *phase == self.phase).unwrap_or_default() as u64);
        list.extend([self.is_set, self.is_over, self.stop.is_some(), self.sees_ahead].map(u64::from));
        let numbers = [self.time, self.begin, self.stop.unwrap_or(0.0)];
        let inputs = self.inputs.iter().flat_map(|input| std::iter::once(&input.since).chain(&input.coefficients));
        let all = numbers
            .iter()
            .chain(&self.parameters)
            .chain(&self.quantities)
            .chain(&self.start)
            .chain(&self.forces)
            .chain(inputs);
        list.extend(all.map(|number| number.to_bits()));
        let plant = match &self.plant {
            Plant::None => Some(Vec::new()),
            Plant::Machine(machine) => machine.save(),
            Plant::Dynamics(dynamics) => dynamics.save(),
        };
        let Some(plant) = plant else {
            let message =
                "this state cannot be turned into bytes: the machine has ended the run; allowed: get and set it";
            return Err(Refusal::error(message));
        };
        list.push(u64::from(!matches!(self.plant, Plant::None)));
        let control = self.control.as_ref().map(Stepped::save).unwrap_or_default();
        list.push(control.len() as u64);
        list.extend(control.into_iter().chain(plant));
        Ok(list.into_iter().flat_map(u64::to_le_bytes).collect())
    }

    /// The state that these bytes are of, as an instance beside this one. Errors: bytes of something else.
    pub fn of_bytes(&self, bytes: &[u8]) -> Refusable<Self> {
        let wrong = || Refusal::error("these bytes are no state of this machine; allowed: what SerializeFMUState gave");
        let words = bytes.chunks_exact(8);
        if !words.remainder().is_empty() {
            return Err(wrong());
        }
        let mut list = words.map(|word| u64::from_le_bytes(std::array::from_fn(|k| word[k])));
        let mut next = || list.next().ok_or_else(wrong);
        let mut other = Self::new(self.model.clone(), self.purpose);
        let head = [MARK, taut_core::chance::hash(self.model.token.bytes()), u64::from(self.exchanges())];
        for wanted in head {
            if next()? != wanted {
                return Err(wrong());
            }
        }
        let phase = usize::try_from(next()?).ok().and_then(|phase| PHASES.get(phase));
        other.phase = *phase.ok_or_else(wrong)?;
        let mut flags = [false; 4];
        for flag in &mut flags {
            *flag = match next()? {
                0 => false,
                1 => true,
                _ => return Err(wrong()),
            };
        }
        let mut numbers = |into: &mut [f64]| -> Refusable<()> {
            for number in into {
                *number = f64::from_bits(next()?);
                if !number.is_finite() {
                    return Err(wrong());
                }
            }
            Ok(())
        };
        let mut times = [0.0; 3];
        numbers(&mut times)?;
        numbers(&mut other.parameters)?;
        numbers(&mut other.quantities)?;
        numbers(&mut other.start)?;
        numbers(&mut other.forces)?;
        for Input { since, coefficients } in &mut other.inputs {
            numbers(std::slice::from_mut(since))?;
            numbers(coefficients)?;
        }
        let is_there = next()?;
        let remembered = usize::try_from(next()?).map_err(|_| wrong())?;
        let rest: Vec<u64> = list.collect();
        let (control, plant) = rest.split_at_checked(remembered).ok_or_else(wrong)?;
        if is_there == 1 {
            // The machine in its start, from where its saved state goes on.
            other.make()?;
            let restored = match &mut other.plant {
                Plant::None => None,
                Plant::Machine(machine) => machine.restore(plant),
                Plant::Dynamics(dynamics) => dynamics.restore(plant),
            };
            restored.ok_or_else(wrong)?;
            match &mut other.control {
                Some(own) => own.restore(control).ok_or_else(wrong)?,
                None if control.is_empty() => {}
                None => return Err(wrong()),
            }
        } else if !rest.is_empty() {
            return Err(wrong());
        }
        [other.is_set, other.is_over] = [flags[0], flags[1]];
        [other.time, other.begin] = [times[0], times[1]];
        other.stop = flags[2].then_some(times[2]);
        other.sees_ahead = flags[3];
        Ok(other)
    }
}
