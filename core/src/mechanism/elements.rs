//! Piecewise linear parts other than bodies: amplifiers with limits, springs that only pull or only push, piecewise
//! linear forces. Each is linear within a case; the conditions of a change are linear forms.

use super::{
    AmplifierMode, Cause, Contact, DRIVES, Drive, Form, Guard, Limit, Mechanism, Mode, Over, SPRINGS, Spring,
    SpringLaw, State, Switch,
};
use std::f64::consts::PI;

impl Mechanism {
    // --- motor and amplifier ----------------------------------------------------------------------------------------

    /// Back-EMF K_e n φ̇, of the drive pulley or of the rotor if it turns by itself.
    fn back_emf(&self, drive: usize) -> Form {
        let Drive { motor, shaft, .. } = &self.drives[drive];
        let mut emf = Form::ZERO;
        emf.speed[*shaft] = motor.back_emf_constant * motor.gear_ratio;
        emf
    }

    /// The command of the input: gain·u, V or A, before any limit.
    fn command(&self, drive: usize) -> Form {
        let mut command = Form::ZERO;
        command.input[drive] = self.drives[drive].amplifier.gain;
        command
    }

    /// The command of the input after the limit on it.
    fn commanded(&self, drive: usize, mode: &Mode) -> Form {
        let (amplifier, now) = (&self.drives[drive].amplifier, &mode.drive[drive]);
        let (limit, bound) = match amplifier.mode {
            AmplifierMode::Voltage => (now.voltage, amplifier.voltage_limit),
            AmplifierMode::Current => (now.current, amplifier.current_limit),
            AmplifierMode::Position => (Limit::Inside, None),
        };
        match (limit, bound) {
            (Limit::Inside, _) | (_, None) => self.command(drive),
            (side, Some(bound)) => Form::constant(side.sign() * bound),
        }
    }

    /// Armature current, A; for a stepper, the current of the first phase.
    pub fn current(&self, drive: usize, mode: &Mode) -> Form {
        let Drive { motor, amplifier, .. } = &self.drives[drive];
        if self.drives[drive].has_current_state() {
            return Form::current(self.first_current(drive));
        }
        // i = (v − K_e n φ̇) / R                                                    in (4)
        let at = |voltage: Form| (voltage - self.back_emf(drive)) * (1.0 / motor.resistance);
        match (amplifier.mode, mode.drive[drive].voltage, mode.drive[drive].current) {
            (AmplifierMode::Voltage, _, Limit::Inside) => at(self.commanded(drive, mode)),
            (AmplifierMode::Voltage, _, side) => Form::constant(side.sign() * amplifier.current_limit.unwrap_or(0.0)),
            (AmplifierMode::Current, Limit::Inside, _) => self.commanded(drive, mode),
            (AmplifierMode::Current, side, _) => {
                at(Form::constant(side.sign() * amplifier.voltage_limit.unwrap_or(0.0)))
            }
            // Its currents are states.
            (AmplifierMode::Position, ..) => Form::ZERO,
        }
    }

    /// The voltage over the inductance at the terminal voltage `voltage`: v − R i − K_e n φ̇.
    fn left_for_inductance(&self, drive: usize, voltage: Form) -> Form {
        voltage - Form::current(self.first_current(drive)) * self.drives[drive].motor.resistance - self.back_emf(drive)
    }

    /// di/dt of a current loop that is not limited by voltage: 2π f_b (i_ref − i).
    fn loop_rate(&self, drive: usize, mode: &Mode) -> Form {
        let bandwidth = self.drives[drive].amplifier.bandwidth.unwrap_or(0.0);
        (self.commanded(drive, mode) - Form::current(self.first_current(drive))) * (2.0 * PI * bandwidth)
    }

    /// di/dt of a current by its number, A/s; zero if it is not a state. For a stepper's phase, its linear part.
    pub(super) fn current_rate(&self, number: usize, mode: &Mode) -> Form {
        let Some(drive) = self.drive_of_current(number) else { return Form::ZERO };
        let Drive { motor, amplifier, .. } = &self.drives[drive];
        match (amplifier.mode, mode.drive[drive].voltage, mode.drive[drive].current) {
            // L di/dt = v − R i − K_e n φ̇
            (AmplifierMode::Voltage, _, Limit::Inside) => {
                self.left_for_inductance(drive, self.commanded(drive, mode)) * (1.0 / motor.inductance)
            }
            // At its limit the current is constant.
            (AmplifierMode::Voltage, ..) => Form::ZERO,
            (AmplifierMode::Current, Limit::Inside, _) => self.loop_rate(drive, mode),
            (AmplifierMode::Current, side, _) => {
                let most = Form::constant(side.sign() * amplifier.voltage_limit.unwrap_or(0.0));
                self.left_for_inductance(drive, most) * (1.0 / motor.inductance)
            }
            (AmplifierMode::Position, ..) => Form::current(number) * (-motor.resistance / motor.inductance),
        }
    }

    /// Voltage at the motor's terminals, V: R i + L di/dt + K_e n φ̇, or what the amplifier puts there. Zero for a
    /// stepper, whose phase voltages are not linear in the state.
    pub fn voltage(&self, drive: usize, mode: &Mode) -> Form {
        let Drive { motor, amplifier, .. } = &self.drives[drive];
        let now = &mode.drive[drive];
        let follows = || {
            self.current(drive, mode) * motor.resistance
                + self.current_rate(self.first_current(drive), mode) * motor.inductance
                + self.back_emf(drive)
        };
        match (amplifier.mode, now.voltage, now.current) {
            (AmplifierMode::Position, ..) => Form::ZERO,
            (AmplifierMode::Voltage, _, Limit::Inside) => self.commanded(drive, mode),
            (AmplifierMode::Current, Limit::Low | Limit::High, _) => {
                Form::constant(now.voltage.sign() * amplifier.voltage_limit.unwrap_or(0.0))
            }
            _ => follows(),
        }
    }

    // --- springs ----------------------------------------------------------------------------------------------------

    /// Force of a spring in `mode`, N or N m. Two-sided: f = k s + c ṡ. Pulling only: the same relative to T₀, and f =
    /// −T₀ if slack. Pushing only: f = k (s − s_side) + c ṡ at the side in contact.
    pub fn spring_force(&self, spring: usize, mode: &Mode) -> Form {
        let part = &self.springs[spring];
        let whole = || self.pull(spring);
        match &part.law {
            SpringLaw::TwoSided => whole(),
            SpringLaw::Tension { pretension } if mode.slack[spring] => Form::constant(-*pretension),
            SpringLaw::Tension { .. } => whole(),
            SpringLaw::Gap { low, high } => {
                let [(_, high), (_, low)] = self.sides(spring, [*high, *low]);
                match mode.contact[spring] {
                    Contact::High => high,
                    Contact::Low => -low,
                    _ => Form::ZERO,
                }
            }
            // f = f_i + k_i s, or over ṡ
            SpringLaw::Line { over, line } => {
                let [constant, slope] = line.piece(usize::from(mode.piece[spring]));
                let mut force = self.way_of_line(spring, *over) * slope;
                force.constant += constant;
                force
            }
            SpringLaw::Bounds { .. } | SpringLaw::Angle { .. } | SpringLaw::None => Form::ZERO,
        }
    }

    /// The argument of a spring's line.
    fn way_of_line(&self, spring: usize, over: Over) -> Form {
        match over {
            Over::Length => Form::stretch(spring),
            Over::Rate => self.stretch_rate(spring),
        }
    }

    /// The piece of each line at `state`.
    pub(super) fn pieces(&self, state: &State) -> [u8; SPRINGS] {
        let mut pieces = [0; SPRINGS];
        for (index, (piece, spring)) in pieces.iter_mut().zip(&self.springs).enumerate() {
            if let SpringLaw::Line { over, line } = &spring.law {
                let x = self.way_of_line(index, *over).value(self, state, &[0.0; DRIVES]);
                *piece = line.piece_at(x) as u8;
            }
        }
        pieces
    }

    /// Stiffness and damping of the active piece of a spring's line; negative if the force falls.
    pub(crate) fn slopes_of_line(&self, spring: usize, mode: &Mode) -> (f64, f64) {
        match &self.springs[spring].law {
            SpringLaw::Line { over, line } => {
                let [_, slope] = line.piece(usize::from(mode.piece[spring]));
                if *over == Over::Length { (slope, 0.0) } else { (0.0, slope) }
            }
            _ => (0.0, 0.0),
        }
    }

    /// k s + c ṡ of a spring.
    fn pull(&self, spring: usize) -> Form {
        let Spring { ref arms, stiffness, damping, .. } = self.springs[spring];
        let mut pull = Form::ZERO;
        pull.stretch[spring] = stiffness;
        if damping != 0.0 {
            arms.iter().for_each(|&(body, arm)| pull.speed[body] += arm);
            pull.speed.iter_mut().for_each(|rate| *rate *= damping);
        }
        pull
    }

    /// Length of a spring beyond each of `[high, low]`, and the force of the flank there.
    fn sides(&self, spring: usize, [high, low]: [f64; 2]) -> [(Form, Form); 2] {
        let (length, rate) = (Form::stretch(spring), self.stretch_rate(spring));
        let (k, c) = (self.springs[spring].stiffness, self.springs[spring].damping);
        let side = |beyond: Form, rate: Form| (beyond, beyond * k + rate * c);
        [side(length - Form::constant(high), rate), side(Form::constant(low) - length, -rate)]
    }

    /// Stiffness that stores energy in `mode`.
    pub(super) fn stiffness_in(&self, mode: &Mode) -> [f64; SPRINGS] {
        let mut stiffness = [0.0; SPRINGS];
        for (index, spring) in self.springs.iter().enumerate() {
            let carries = match spring.law {
                SpringLaw::TwoSided => true,
                SpringLaw::Tension { .. } => !mode.slack[index],
                SpringLaw::Gap { .. } => mode.contact[index].code() != 0,
                SpringLaw::Line { .. } | SpringLaw::Bounds { .. } | SpringLaw::Angle { .. } | SpringLaw::None => false,
            };
            stiffness[index] = if carries { spring.stiffness } else { 0.0 };
        }
        stiffness
    }

    // --- what ends a state ------------------------------------------------------------------------------------------

    /// Guards of limits and springs in `mode`.
    pub(super) fn watch_elements(&self, mode: &Mode, guards: &mut Vec<Guard>) {
        let mut watch =
            |form: Form, cause: Cause| guards.push(Guard { form, transition: self.transition(cause, mode) });
        for drive in 0..self.drives.len() {
            self.watch_steps(drive, mode, &mut watch);
            let mut switch = |form: Form, switch: Switch| watch(form, Cause::Switch(switch));
            self.watch_limits(drive, mode, &mut switch);
        }
        for (index, spring) in self.springs.iter().enumerate() {
            match &spring.law {
                &SpringLaw::Tension { pretension } => {
                    // Tension T₀ + k s + c ṡ: it only pulls.
                    let mut tension = self.pull(index);
                    tension.constant += pretension;
                    let slack = mode.slack[index];
                    watch(if slack { -tension } else { tension }, Cause::Switch(Switch::Span(index, !slack)));
                }
                &SpringLaw::Gap { low, high } => {
                    let sides = self.sides(index, [high, low]);
                    let mut switch = |form: Form, to| watch(form, Cause::Switch(Switch::Gap(index, to)));
                    watch_contact(mode.contact[index], &sides, spring.damping > 0.0, &mut switch);
                }
                SpringLaw::Line { over, line } => {
                    let (piece, way) = (mode.piece[index], self.way_of_line(index, *over));
                    let [begin, end] = line.ends(usize::from(piece));
                    let mut switch = |form: Form, to| watch(form, Cause::Switch(Switch::Line(index, to)));
                    end.iter().for_each(|end| switch(Form::constant(*end) - way, piece + 1));
                    begin.iter().for_each(|begin| switch(way - Form::constant(*begin), piece - 1));
                }
                &SpringLaw::Bounds { low, high } => {
                    for (beyond, _) in self.sides(index, [high, low]) {
                        watch(-beyond, Cause::Leave(index));
                    }
                }
                SpringLaw::TwoSided | SpringLaw::Angle { .. } | SpringLaw::None => {}
            }
        }
    }

    fn watch_limits(&self, drive: usize, mode: &Mode, watch: &mut impl FnMut(Form, Switch)) {
        let (amplifier, now) = (&self.drives[drive].amplifier, &mode.drive[drive]);
        let (voltage, current) = (|to| Switch::Voltage(drive, to), |to| Switch::Current(drive, to));
        match amplifier.mode {
            AmplifierMode::Voltage => {
                if let Some(bound) = amplifier.voltage_limit {
                    watch_limit(now.voltage, self.command(drive), bound, voltage, watch);
                }
                match amplifier.current_limit {
                    Some(bound) if self.drives[drive].has_current_state() => match now.current {
                        Limit::Inside => {
                            let own = Form::current(self.first_current(drive));
                            watch_limit(Limit::Inside, own, bound, current, watch);
                        }
                        // At the limit, the current is constant while the voltage would drive it further.
                        side => watch(
                            self.left_for_inductance(drive, self.commanded(drive, mode)) * side.sign(),
                            current(Limit::Inside),
                        ),
                    },
                    Some(bound) => {
                        let mut inside = *mode;
                        inside.drive[drive].current = Limit::Inside;
                        watch_limit(now.current, self.current(drive, &inside), bound, current, watch);
                    }
                    None => {}
                }
            }
            AmplifierMode::Current => {
                if let Some(bound) = amplifier.current_limit {
                    watch_limit(now.current, self.command(drive), bound, current, watch);
                }
                if let Some(bound) = amplifier.voltage_limit {
                    // R i + L di/dt + K_e n φ̇, as it would be without the limit
                    let mut inside = *mode;
                    inside.drive[drive].voltage = Limit::Inside;
                    watch_limit(now.voltage, self.voltage(drive, &inside), bound, voltage, watch);
                }
            }
            AmplifierMode::Position => {}
        }
    }
}

fn watch_limit(
    now: Limit,
    unlimited: Form,
    bound: f64,
    switch: impl Fn(Limit) -> Switch,
    watch: &mut impl FnMut(Form, Switch),
) {
    let bound = Form::constant(bound);
    match now {
        Limit::Inside => {
            watch(bound - unlimited, switch(Limit::High));
            watch(bound + unlimited, switch(Limit::Low));
        }
        Limit::High => watch(unlimited - bound, switch(Limit::Inside)),
        Limit::Low => watch(-unlimited - bound, switch(Limit::Inside)),
    }
}

fn watch_contact(now: Contact, &[high, low]: &[(Form, Form); 2], damped: bool, watch: &mut impl FnMut(Form, Contact)) {
    let ((beyond, push), carries, loose) = match now {
        Contact::Apart => {
            watch(-high.0, Contact::High);
            watch(-low.0, Contact::Low);
            return;
        }
        Contact::High | Contact::HighLoose => (high, Contact::High, Contact::HighLoose),
        Contact::Low | Contact::LowLoose => (low, Contact::Low, Contact::LowLoose),
    };
    watch(beyond, Contact::Apart);
    if damped {
        // A flank only pushes: if its damper delays it, it carries no force.
        if now == carries { watch(push, loose) } else { watch(-push, carries) }
    }
}
