//! The parts beside the three inertias that work piece by piece: amplifier with limits, gear with play, spans that go slack,
//! end stops. Each is linear in each of its states; the conditions that lead from one to the other are linear forms.

use super::form::{ROTOR, TWIST};
use super::{Cause, Contact, Form, Guard, Limit, Mode, POSITION, Plant, STRETCHES, Switch};
use crate::stage::AmplifierMode;
use std::f64::consts::PI;

impl Plant {
    // --- motor and amplifier ----------------------------------------------------------------------------------------

    /// Back-EMF K_e n φ̇, of the drive pulley or of the rotor if it turns by itself.
    fn back_emf(&self) -> Form {
        let motor = &self.stage.motor;
        let shaft = if self.has_rotor() { ROTOR } else { 0 };
        Form::speed(shaft) * (motor.back_emf_constant * motor.gear_ratio)
    }

    /// What the input commands: gain·u, V or A, before any limit.
    fn command(&self) -> Form {
        Form::input() * self.stage.amplifier.gain
    }

    /// What the input commands after the limit on it.
    fn commanded(&self, mode: &Mode) -> Form {
        let amplifier = &self.stage.amplifier;
        let (limit, bound) = match amplifier.mode {
            AmplifierMode::Voltage => (mode.voltage, amplifier.voltage_limit),
            AmplifierMode::Current => (mode.current, amplifier.current_limit),
        };
        match (limit, bound) {
            (Limit::Inside, _) | (_, None) => self.command(),
            (side, Some(bound)) => Form::constant(side.sign() * bound),
        }
    }

    /// Armature current, A.
    pub fn current(&self, mode: &Mode) -> Form {
        if self.has_current_state() {
            return Form::current();
        }
        let amplifier = &self.stage.amplifier;
        // i = (v − K_e n φ̇) / R                                                    in (4)
        let at = |voltage: Form| (voltage - self.back_emf()) * (1.0 / self.stage.motor.resistance);
        match (amplifier.mode, mode.voltage, mode.current) {
            (AmplifierMode::Voltage, _, Limit::Inside) => at(self.commanded(mode)),
            (AmplifierMode::Voltage, _, side) => Form::constant(side.sign() * amplifier.current_limit.unwrap_or(0.0)),
            (AmplifierMode::Current, Limit::Inside, _) => self.commanded(mode),
            (AmplifierMode::Current, side, _) => {
                at(Form::constant(side.sign() * amplifier.voltage_limit.unwrap_or(0.0)))
            }
        }
    }

    /// What is left to drive the current through the inductance at the terminal voltage `voltage`: v − R i − K_e n φ̇.
    fn left_for_inductance(&self, voltage: Form) -> Form {
        voltage - Form::current() * self.stage.motor.resistance - self.back_emf()
    }

    /// di/dt of a current loop that is not limited by voltage: 2π f_b (i_ref − i).
    fn loop_rate(&self, mode: &Mode) -> Form {
        let bandwidth = self.stage.amplifier.bandwidth.unwrap_or(0.0);
        (self.commanded(mode) - Form::current()) * (2.0 * PI * bandwidth)
    }

    /// di/dt, A/s; zero where the current is no state.
    pub(super) fn current_rate(&self, mode: &Mode) -> Form {
        if !self.has_current_state() {
            return Form::ZERO;
        }
        let (motor, amplifier) = (&self.stage.motor, &self.stage.amplifier);
        match (amplifier.mode, mode.voltage, mode.current) {
            // L di/dt = v − R i − K_e n φ̇
            (AmplifierMode::Voltage, _, Limit::Inside) => {
                self.left_for_inductance(self.commanded(mode)) * (1.0 / motor.inductance)
            }
            // At its limit the current stands.
            (AmplifierMode::Voltage, ..) => Form::ZERO,
            (AmplifierMode::Current, Limit::Inside, _) => self.loop_rate(mode),
            (AmplifierMode::Current, side, _) => {
                let most = Form::constant(side.sign() * amplifier.voltage_limit.unwrap_or(0.0));
                self.left_for_inductance(most) * (1.0 / motor.inductance)
            }
        }
    }

    /// Voltage at the motor's terminals, V: R i + L di/dt + K_e n φ̇, or what the amplifier puts there.
    pub fn voltage(&self, mode: &Mode) -> Form {
        let (motor, amplifier) = (&self.stage.motor, &self.stage.amplifier);
        let follows =
            || self.current(mode) * motor.resistance + self.current_rate(mode) * motor.inductance + self.back_emf();
        match (amplifier.mode, mode.voltage, mode.current) {
            (AmplifierMode::Voltage, _, Limit::Inside) => self.commanded(mode),
            (AmplifierMode::Current, Limit::Low | Limit::High, _) => {
                Form::constant(mode.voltage.sign() * amplifier.voltage_limit.unwrap_or(0.0))
            }
            _ => follows(),
        }
    }

    // --- gear, belt, end stops --------------------------------------------------------------------------------------

    /// By how far the flank on each side has passed the play's end, rad, and the torque it then pushes with: [high, low].
    fn flanks(&self) -> Option<[(Form, Form); 2]> {
        let play = self.stage.motor.gear_play?;
        let twist = Form::stretch(TWIST);
        let rate = Form::speed(ROTOR) - Form::speed(0);
        Some(sides(twist, rate, [0.5 * play.backlash, -0.5 * play.backlash], play.stiffness, play.damping))
    }

    /// Torque T of the gear on the drive pulley where the rotor is an inertia of its own, N m.
    pub fn gear_torque(&self, mode: &Mode) -> Form {
        let play = self.stage.motor.gear_play;
        match self.flanks() {
            None => Form::ZERO,
            // Without play the flanks never part: T = k_g θ + c_g θ̇
            Some([(_, push), _]) if play.is_some_and(|play| play.backlash == 0.0) => push,
            // T = k_g (θ ∓ α) + c_g θ̇
            Some(flanks) => pushed(&flanks, mode.gear),
        }
    }

    /// Force of each span, N. A taut span that has pretension carries T₀ more than that, a slack one nothing: f = −T₀.
    pub fn span_forces(&self, mode: &Mode) -> [Form; 3] {
        let slack = Form::constant(-self.stage.belt.pretension.unwrap_or(0.0));
        std::array::from_fn(|j| if mode.slack[self.span_alike(j)] { slack } else { self.span[j] })
    }

    /// The span that span `j` does alike: itself, but span 3 of a two-mass model carries what span 2 does.
    fn span_alike(&self, j: usize) -> usize {
        if j == 2 && self.stage.belt.model == crate::stage::BeltModel::TwoMass { 1 } else { j }
    }

    /// By how far the cart has passed each end of its travel, m, and the force the stop then pushes back with: [high, low].
    fn ends(&self) -> Option<[(Form, Form); 2]> {
        let travel = self.stage.travel?;
        let (stiffness, damping) = travel.stop.map_or((0.0, 0.0), |stop| (stop.stiffness, stop.damping));
        Some(sides(Form::stretch(POSITION), Form::speed(1), [travel.max, travel.min], stiffness, damping))
    }

    /// Force of the end stops on the cart, N.
    pub fn stop_force(&self, mode: &Mode) -> Form {
        // F = −(k_s (x − x_max) + c_s ẋ), and the same at x_min
        self.ends().map_or(Form::ZERO, |ends| -pushed(&ends, mode.stop))
    }

    /// Stiffness that stores energy in `mode`: of the spans, the gear, and the end stop.
    pub(super) fn stiffness_in(&self, mode: &Mode) -> [f64; STRETCHES] {
        let [k, _] = self.belt;
        let carries = |contact: Contact, stiffness: f64| if contact.code() == 0 { 0.0 } else { stiffness };
        let mut stiffness = [0.0; STRETCHES];
        for (j, span) in stiffness.iter_mut().enumerate().take(3) {
            let part_of_model = self.span[j] != Form::ZERO && self.span_alike(j) == j;
            *span = if part_of_model && !mode.slack[j] { k[j] } else { 0.0 };
        }
        if let Some(play) = self.stage.motor.gear_play {
            stiffness[TWIST] = if play.backlash == 0.0 { play.stiffness } else { carries(mode.gear, play.stiffness) };
        }
        if let Some(stop) = self.stage.travel.and_then(|travel| travel.stop) {
            stiffness[POSITION] = carries(mode.stop, stop.stiffness);
        }
        stiffness
    }

    /// Stiffness and damping of the spans as the model has them.
    pub(super) fn belt(&self) -> &[[f64; 3]; 2] {
        &self.belt
    }

    // --- what ends a state ------------------------------------------------------------------------------------------

    /// The conditions under which amplifier, gear, spans and end stops stay as they are in `mode`.
    pub(super) fn watch_elements(&self, mode: &Mode, guards: &mut Vec<Guard>) {
        let mut watch = |form: Form, switch: Switch| guards.push(Guard { form, cause: Cause::Switch(switch) });
        let (motor, amplifier) = (&self.stage.motor, &self.stage.amplifier);
        match amplifier.mode {
            AmplifierMode::Voltage => {
                if let Some(bound) = amplifier.voltage_limit {
                    watch_limit(mode.voltage, self.command(), bound, Switch::Voltage, &mut watch);
                }
                match amplifier.current_limit {
                    Some(bound) if self.has_current_state() => match mode.current {
                        Limit::Inside => {
                            watch_limit(Limit::Inside, Form::current(), bound, Switch::Current, &mut watch);
                        }
                        // At the limit, the current stands as long as the voltage would drive it further.
                        side => watch(
                            self.left_for_inductance(self.commanded(mode)) * side.sign(),
                            Switch::Current(Limit::Inside),
                        ),
                    },
                    Some(bound) => {
                        let unlimited = self.current(&Mode { current: Limit::Inside, ..*mode });
                        watch_limit(mode.current, unlimited, bound, Switch::Current, &mut watch);
                    }
                    None => {}
                }
            }
            AmplifierMode::Current => {
                if let Some(bound) = amplifier.current_limit {
                    watch_limit(mode.current, self.command(), bound, Switch::Current, &mut watch);
                }
                if let Some(bound) = amplifier.voltage_limit {
                    // R i + L di/dt + K_e n φ̇, as it would be without the limit
                    let unlimited = self.voltage(&Mode { voltage: Limit::Inside, ..*mode });
                    watch_limit(mode.voltage, unlimited, bound, Switch::Voltage, &mut watch);
                }
            }
        }
        if let (Some(flanks), Some(play)) = (self.flanks(), motor.gear_play)
            && play.backlash > 0.0
        {
            watch_contact(mode.gear, &flanks, play.damping > 0.0, Switch::Gear, &mut watch);
        }
        if let Some(pretension) = self.stage.belt.pretension {
            for (j, &slack) in mode.slack.iter().enumerate() {
                if self.span[j] == Form::ZERO || self.span_alike(j) != j {
                    continue;
                }
                // Tension T₀ + k d + c ḋ: a span only pulls.
                let tension = self.span[j] + Form::constant(pretension);
                watch(if slack { -tension } else { tension }, Switch::Span(j, !slack));
            }
        }
        if let (Some(ends), Some(travel)) = (self.ends(), self.stage.travel) {
            match travel.stop {
                Some(stop) => watch_contact(mode.stop, &ends, stop.damping > 0.0, Switch::Stop, &mut watch),
                None => guards.extend(ends.map(|(beyond, _)| Guard { form: -beyond, cause: Cause::LeaveTravel })),
            }
        }
    }
}

/// How far `way` is beyond each of `[high, low]`, and what a flank of such stiffness and damping pushes with there.
fn sides(way: Form, rate: Form, [high, low]: [f64; 2], stiffness: f64, damping: f64) -> [(Form, Form); 2] {
    let side = |beyond: Form, rate: Form| (beyond, beyond * stiffness + rate * damping);
    [side(way - Form::constant(high), rate), side(Form::constant(low) - way, -rate)]
}

/// The push of the flank that carries, positive on the high side.
fn pushed(&[(_, high), (_, low)]: &[(Form, Form); 2], contact: Contact) -> Form {
    match contact {
        Contact::High => high,
        Contact::Low => -low,
        _ => Form::ZERO,
    }
}

fn watch_limit(
    now: Limit,
    unlimited: Form,
    bound: f64,
    switch: fn(Limit) -> Switch,
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

fn watch_contact(
    now: Contact,
    &[high, low]: &[(Form, Form); 2],
    damped: bool,
    switch: fn(Contact) -> Switch,
    watch: &mut impl FnMut(Form, Switch),
) {
    let ((beyond, push), carries, loose) = match now {
        Contact::Apart => {
            watch(-high.0, switch(Contact::High));
            watch(-low.0, switch(Contact::Low));
            return;
        }
        Contact::High | Contact::HighLoose => (high, Contact::High, Contact::HighLoose),
        Contact::Low | Contact::LowLoose => (low, Contact::Low, Contact::LowLoose),
    };
    watch(beyond, switch(Contact::Apart));
    if damped {
        // A flank only pushes: pulled away faster than it can follow, it carries nothing.
        if now == carries { watch(push, switch(loose)) } else { watch(-push, switch(carries)) }
    }
}
