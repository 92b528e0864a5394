//! Controllers as `docs/control.md` defines them sample by sample, made again from its words, beside those of the
//! library.

use crate::common::document;
use document::Pcg;
use std::f64::consts::PI;
use taut::case::{Case, TEMPLATE};
use taut::control::{Controller, Observation, Standard};
use taut::machine::BeltModel;
use taut::signal::profile::Reference;

const AXIS: [&str; 8] = [
    "motor.gear_ratio=1.7",
    "motor.gear_efficiency=0.8",
    "motor.rotor_inertia=4e-6",
    "motor.inductance=0.3 mH",
    "amplifier.gain=1.5",
    "cart.load=-0.4",
    "cart.friction={ viscous = 19, coulomb = 0.2, static = 0.3, viscous_backward = 15, coulomb_backward = 0.25 }",
    "encoder={ at = 'drive_pulley', lines = 512 }",
];

/// T, and the limit of the command.
const T: f64 = 1e-3;
const LIMIT: f64 = 6.0;

/// From reference, measured position, current and what is fed forward as a current to a command.
type Step = dyn FnMut(&Reference, f64, f64, f64) -> f64;

/// A structure as the document has it, and what it does when the limit took something.
struct Made {
    step: Box<Step>,
    limited: Box<dyn FnMut(f64)>,
}

/// The controller of the library beside that of the document, on samples drawn by chance.
fn compare(controller: &str, made: Made, around: impl Fn(&Case, &Reference) -> [f64; 2], target: bool) {
    compare_on(&AXIS, controller, made, around, target);
}

/// The same on another axis.
fn compare_on(
    axis: &[&str],
    controller: &str,
    mut made: Made,
    around: impl Fn(&Case, &Reference) -> [f64; 2],
    target: bool,
) {
    let text = format!(
        "{TEMPLATE}\n[controller]\nevery = {T}\nlimit = {LIMIT}\n{controller}\n\
         [[move]]\nname = \"m\"\nto = 0.01\nspeed = 0.3\nacceleration = 5\nuntil = 1\n"
    );
    let case = Case::from_text_with("axis.toml", &text, axis).unwrap_or_else(|error| panic!("{error}"));
    let mut ours = Standard::new(case.controller.as_ref().unwrap(), &case.machine).unwrap();
    ours.reset();
    let mut random = Pcg::new(5);
    let mut draw = |size: f64| size * random.normal();
    let mut most: f64 = 0.0;
    for k in 0..400 {
        let mut reference = || Reference {
            position: draw(0.01),
            speed: draw(0.3),
            acceleration: draw(5.0),
            jerk: draw(300.0),
            snap: draw(1e4),
        };
        let (now, ahead) = (reference(), reference());
        let (position, current) = (draw(0.01), draw(5.0));
        let seen = Observation { time: f64::from(k) * T, reference: now, ahead, position, scale: None, current };
        let [forward, inner] = around(&case, &ahead);
        let wanted = if target { elastic(&case, &now).0 } else { now };
        let asked = (made.step)(&wanted, position, current, inner) + forward;
        let found = ours.step(&seen);
        assert!((found - asked).abs() <= 1e-9 * asked.abs().max(1.0), "{controller}, sample {k}: {found}, {asked}");
        let given = asked.clamp(-LIMIT, LIMIT);
        ours.limited(given);
        (made.limited)(given - asked);
        most = most.max((given - asked).abs());
    }
    assert!(most > 1.0, "{controller}: the limit has to hold now and then, or nothing is shown");
}

fn none(_: &Case, _: &Reference) -> [f64; 2] {
    [0.0; 2]
}

fn shared<S: 'static>(
    state: S,
    step: impl Fn(&mut S, &Reference, f64, f64, f64) -> f64 + 'static,
    limited: impl Fn(&mut S, f64) + 'static,
) -> Made {
    let state = std::rc::Rc::new(std::cell::RefCell::new(state));
    let other = state.clone();
    Made {
        step: Box::new(move |y, p, i, w| step(&mut state.borrow_mut(), y, p, i, w)),
        limited: Box::new(move |excess| limited(&mut other.borrow_mut(), excess)),
    }
}

/// Speed: v_k = a v_{k−1} + (1 − a) (p_k − p_{k−1})/T
#[derive(Default)]
struct Speed(Option<f64>, f64);

impl Speed {
    fn step(&mut self, p: f64, filter: f64) -> f64 {
        let a = (-2.0 * PI * filter * T).exp();
        self.1 = a * self.1 + (1.0 - a) * (p - self.0.unwrap_or(p)) / T;
        self.0 = Some(p);
        self.1
    }
}

#[test]
fn pid_is_that_of_the_document() {
    #[derive(Default)]
    struct State {
        integral: f64,
        slope: f64,
        last: Option<f64>,
    }
    let made = || {
        shared(
            State::default(),
            |s, y, p, _, _| {
                let (e, tau) = (y.position - p, 1.0 / (2.0 * PI * 150.0));
                s.slope = (tau * s.slope + e - s.last.unwrap_or(e)) / (tau + T);
                s.last = Some(e);
                s.integral += 30e3 * T * e;
                300.0 * e + s.integral + 10.0 * s.slope
            },
            |s, excess| s.integral += (T / 0.02f64).min(1.0) * excess,
        )
    };
    let pid = "pid = { proportional = 300, integral = 30e3, derivative = 10, filter = 150, tracking = 0.02 }";
    compare(pid, made(), none, false);
    let rigid = |case: &Case, y: &Reference| [rigid_command(case, y), 0.0];
    compare(
        &format!("{pid}\nfeed_forward = {{ model = \"rigid\", inertia = 0.9, friction = 0.7 }}"),
        made(),
        rigid,
        false,
    );
    let stretched = |case: &Case, y: &Reference| [elastic_command(case, y), 0.0];
    let elastic = "feed_forward = { model = \"elastic\", inertia = 0.9, friction = 0.7, compensate_stretch = true }";
    compare(&format!("{pid}\n{elastic}"), made(), stretched, true);
    let two_mass = [&AXIS[..], &["belt.model=two-mass"]].concat();
    compare_on(&two_mass, &format!("{pid}\n{elastic}"), made(), stretched, true);
}

#[test]
fn filters_are_those_of_the_document() {
    // Of each filter b₀ b₁ b₂ a₁ a₂, from N(s)/(s² + 2 ζ s + 1) with s = c (z − 1)/(z + 1)
    let of = |f: f64, n: [f64; 3], zeta: f64| {
        let c = 1.0 / (PI * f * T).min(0.49 * PI).tan();
        let over =
            |[n2, n1, n0]: [f64; 3]| [n2 * c * c + n1 * c + n0, 2.0 * n0 - 2.0 * n2 * c * c, n2 * c * c - n1 * c + n0];
        (over(n), over([1.0, 2.0 * zeta, 1.0]))
    };
    let filters = [of(190.0, [1.0, 2.0 * 0.1, 1.0], 0.7), of(300.0, [0.0, 0.0, 1.0], 0.6)];
    // The last two inputs and outputs of each.
    let made = shared(
        [[0.0f64; 4]; 2],
        move |s, y, p, _, _| {
            let mut u = 1500.0 * (y.position - p);
            for (past, (b, a)) in s.iter_mut().zip(&filters) {
                let out = (b[0] * u + b[1] * past[0] + b[2] * past[1] - a[1] * past[2] - a[2] * past[3]) / a[0];
                *past = [u, past[0], out, past[2]];
                u = out;
            }
            u
        },
        |_, _| {},
    );
    let filters = "filters = [{ notch = 190, depth = 0.1, damping = 0.7 }, { low_pass = 300, damping = 0.6 }]";
    compare(&format!("pid = {{ proportional = 1500 }}\n{filters}"), made, none, false);
}

#[derive(Default)]
struct Loops {
    speed: Speed,
    outer: f64,
    inner: f64,
}

#[test]
fn cascades_are_those_of_the_document() {
    let share = |tracking: f64| (T / tracking).min(1.0);
    let made = shared(
        Loops::default(),
        |s, y, p, _, _| {
            let error = 60.0 * (y.position - p) + y.speed - s.speed.step(p, 120.0);
            s.outer += 800.0 * T * error;
            13.0 * error + s.outer
        },
        move |s, excess| s.outer += share(0.03) * excess,
    );
    let cascade = "cascade = { position = 60, speed = 13, speed_integral = 800, filter = 120, tracking = 0.03 }";
    compare(cascade, made, none, false);
    let made = shared(
        Loops::default(),
        move |s, y, p, i, w| {
            let error = 60.0 * (y.position - p) + y.speed - s.speed.step(p, 120.0);
            s.outer += 800.0 * T * error;
            let asked = 13.0 * error + s.outer + w;
            let held = asked.clamp(-8.0, 8.0);
            s.outer += share(0.03) * (held - asked);
            s.inner += 200.0 * T * (held - i);
            0.3 * (held - i) + s.inner
        },
        move |s, excess| {
            s.inner += share(0.03) * excess;
            s.outer += share(0.03) * excess / 0.3;
        },
    );
    let split = |case: &Case, y: &Reference| {
        let machine = &case.machine;
        let motor = &machine.drives[0].motor;
        let r = machine.pulley_radius;
        let voltage = motor.gear_ratio * motor.back_emf_constant * y.speed / (r * machine.drives[0].amplifier.gain);
        let rest = rigid_command(case, y) - voltage;
        [voltage, rest * machine.drives[0].amplifier.gain / motor.resistance]
    };
    let inner = "current = { proportional = 0.3, integral = 200, limit = 8 }";
    let cascade = cascade.replace(" }", &format!(", {inner} }}"));
    let feed = "feed_forward = { model = \"rigid\", inertia = 0.9, friction = 0.7 }";
    compare(&format!("{cascade}\n{feed}"), made, split, false);
}

#[test]
fn sliding_mode_and_fuzzy_rules_are_those_of_the_document() {
    let case = Case::from_text_with("axis.toml", TEMPLATE, &AXIS).unwrap_or_else(|error| panic!("{error}"));
    let one = Mass::new(&case);
    #[derive(Default)]
    struct State {
        speed: Speed,
        sum: f64,
    }
    let (lambda, kappa, reaching, layer) = (40.0, 300.0, 7.0, 0.3);
    let made = shared(
        State::default(),
        move |s, y, p, _, _| {
            let (e, rho) = (y.position - p, y.speed - s.speed.step(p, 120.0));
            s.sum += T * e;
            let sigma: f64 = rho + lambda * e + kappa * s.sum;
            one.mass * (lambda * rho + kappa * e + reaching * (sigma / layer).clamp(-1.0, 1.0)) / one.push
        },
        move |s, excess| {
            s.sum += f64::min(lambda * T, 1.0) * excess * one.push * layer / (one.mass * kappa * reaching);
        },
    );
    let sliding = "sliding_mode = { bandwidth = 40, reaching = 7, boundary = 0.3, integral = 300, filter = 120 }";
    compare(&format!("{sliding}\nfeed_forward = {{ model = \"none\" }}"), made, none, false);

    let rules = [[-1.0, -0.4, 0.1], [-0.5, 0.05, 0.6], [0.0, 0.5, 0.9]];
    let surface = move |e: f64, rate: f64| {
        let place = |x: f64| (x.clamp(-1.0, 1.0) + 1.0).min(2.0 - 1e-15);
        let (x, y) = (place(e), place(rate));
        let (i, j, a, b) = (x as usize, y as usize, x.fract(), y.fract());
        (1.0 - a) * ((1.0 - b) * rules[i][j] + b * rules[i][j + 1])
            + a * ((1.0 - b) * rules[i + 1][j] + b * rules[i + 1][j + 1])
    };
    for slope in [false, true] {
        let made = shared(
            (Speed::default(), 0.0),
            move |s, y, p, _, _| {
                let rate = y.speed - s.0.step(p, 120.0);
                let value = surface((y.position - p) / 0.01, rate / 0.6);
                s.1 = if slope { s.1 + T * 1500.0 * value } else { 9.0 * value };
                s.1
            },
            move |s, excess| s.1 += if slope { excess } else { 0.0 },
        );
        let kind = if slope { "slope = 1500" } else { "command = 9" };
        let table = "[[-1, -0.4, 0.1], [-0.5, 0.05, 0.6], [0, 0.5, 0.9]]";
        let fuzzy = format!("fuzzy = {{ error = 0.01, rate = 0.6, {kind}, rules = {table}, filter = 120 }}");
        compare(&fuzzy, made, none, false);
    }
}

/// All bodies as one mass at the belt.
#[derive(Clone, Copy)]
struct Mass {
    mass: f64,
    viscous: [f64; 2],
    coulomb: [f64; 2],
    /// g: force per unit of the command at rest.
    push: f64,
}

impl Mass {
    fn new(case: &Case) -> Self {
        let s = &case.machine;
        let (r, n) = (s.pulley_radius, s.drives[0].motor.gear_ratio);
        let pulleys = s.drive_pulley.inertia + n * n * s.drives[0].motor.rotor_inertia + s.idler_pulley.inertia;
        let (drive, idler, cart) = (s.drive_pulley.friction, s.idler_pulley.friction, s.cart.friction);
        let side = |forward: bool| (drive.side(forward), idler.side(forward), cart.side(forward));
        Self {
            mass: s.cart.mass + pulleys / (r * r),
            viscous: [true, false].map(|f| side(f).2.viscous + (side(f).0.viscous + side(f).1.viscous) / (r * r)),
            coulomb: [true, false].map(|f| side(f).2.coulomb + (side(f).0.coulomb + side(f).1.coulomb) / r),
            push: s.drives[0].amplifier.gain
                * s.drives[0].motor.gear_efficiency
                * n
                * s.drives[0].motor.torque_constant
                / (r * s.drives[0].motor.resistance),
        }
    }
}

fn sign(y: &Reference) -> f64 {
    match (y.speed, y.acceleration) {
        (v, _) if v != 0.0 => v.signum(),
        (_, a) if a != 0.0 => a.signum(),
        _ => 0.0,
    }
}

/// The command for a force and its rate while the drive moves like this, in voltage mode; p = 0.9. What the rotor takes
/// does not pass through the gear.
fn command(case: &Case, force: f64, rate: f64, drive: &Reference) -> f64 {
    let (s, motor) = (&case.machine, &case.machine.drives[0].motor);
    let (r, n) = (s.pulley_radius, motor.gear_ratio);
    let rotor = |change: f64| 0.9 * n * n * motor.rotor_inertia * change / (r * r);
    let driven = (force - rotor(drive.acceleration)) * drive.speed < 0.0;
    let e = if driven { 1.0 / motor.gear_efficiency } else { motor.gear_efficiency };
    let current = |f: f64, change: f64| (rotor(change) + (f - rotor(change)) / e) * r / (n * motor.torque_constant);
    let back = n * motor.back_emf_constant * drive.speed / r;
    let (i, rate) = (current(force, drive.acceleration), current(rate, drive.jerk));
    (motor.resistance * i + motor.inductance * rate + back) / s.drives[0].amplifier.gain
}

/// p = 0.9, q = 0.7.
fn rigid_command(case: &Case, y: &Reference) -> f64 {
    let (one, s) = (Mass::new(case), sign(y));
    let side = usize::from(s < 0.0);
    let friction = one.viscous[side] * y.speed + s * one.coulomb[side];
    let force = 0.9 * one.mass * y.acceleration + 0.7 * friction - case.machine.cart.load;
    command(case, force, 0.9 * one.mass * y.jerk, y)
}

/// y₁ with its derivatives, and F and Ḟ with all of inertia and friction.
fn elastic(case: &Case, y: &Reference) -> (Reference, f64, f64) {
    let machine = &case.machine;
    let (r, n, s) = (machine.pulley_radius, machine.drives[0].motor.gear_ratio, sign(y));
    let forward = s >= 0.0;
    let (cart, idler) = (machine.cart.friction.side(forward), machine.idler_pulley.friction.side(forward));
    let drive = machine.drive_pulley.friction.side(forward);
    let [k1, k2, k3] = machine.belt.stiffness.three();
    let (m, j2) = (machine.cart.mass, machine.idler_pulley.inertia);
    let j1 = machine.drive_pulley.inertia + n * n * machine.drives[0].motor.rotor_inertia;
    let load = [
        m * y.acceleration + cart.viscous * y.speed + s * cart.coulomb - machine.cart.load,
        m * y.jerk + cart.viscous * y.acceleration,
        m * y.snap + cart.viscous * y.jerk,
    ];
    let pull = |y: &Reference| {
        [
            (j2 * y.acceleration / r + idler.viscous * y.speed / r + s * idler.coulomb) / r,
            (j2 * y.jerk + idler.viscous * y.acceleration) / (r * r),
            (j2 * y.snap + idler.viscous * y.jerk) / (r * r),
        ]
    };
    let k = k1 + k2 * k3 / (k2 + k3);
    let is_two_mass = machine.belt.model == BeltModel::TwoMass;
    let share = if is_two_mass { 0.0 } else { k2 / (k2 + k3) };
    let stretch = |d: usize| (load[d] + pull(y)[d] * share) / k;
    let first = Reference {
        position: y.position + stretch(0),
        speed: y.speed + stretch(1),
        acceleration: y.acceleration + stretch(2),
        jerk: y.jerk + if is_two_mass { cart.viscous * y.snap / k } else { 0.0 },
        ..*y
    };
    let pull = pull(if is_two_mass { &first } else { y });
    let own = j1 * first.acceleration / (r * r) + drive.viscous * first.speed / (r * r) + s * drive.coulomb / r;
    let rate = j1 * first.jerk / (r * r) + drive.viscous * first.acceleration / (r * r) + load[1] + pull[1];
    (first, own + load[0] + pull[0], rate)
}

/// p = 0.9, q = 0.7.
fn elastic_command(case: &Case, y: &Reference) -> f64 {
    let (first, force, rate) = elastic(case, y);
    let (one, s) = (Mass::new(case), sign(y));
    let side = usize::from(s < 0.0);
    let friction = one.viscous[side] * y.speed + s * one.coulomb[side];
    let less = (1.0 - 0.7) * friction + (1.0 - 0.9) * one.mass * first.acceleration;
    command(case, force - less, rate, &first)
}

#[test]
fn the_disturbance_observer_is_that_of_the_document() {
    use nalgebra::{Matrix3, Matrix4, RowVector3, Vector3};
    let case = Case::from_text_with("axis.toml", TEMPLATE, &AXIS).unwrap_or_else(|error| panic!("{error}"));
    let (one, motor, r) = (Mass::new(&case), case.machine.drives[0].motor, case.machine.pulley_radius);
    let n = motor.gear_ratio;
    let d = one.viscous[0] + n * n * motor.torque_constant * motor.back_emf_constant / (motor.resistance * r * r);
    // ẏ = v, v̇ = −(d/M) v + (g/M)(u + w), ẇ = 0, held over T: e^{[A B; 0 0] T} by its series
    let push = one.push / one.mass;
    let rates = Matrix4::new(0., 1., 0., 0., 0., -d / one.mass, push, push, 0., 0., 0., 0., 0., 0., 0., 0.) * T;
    let (mut term, mut whole) = (Matrix4::identity(), Matrix4::identity());
    for k in 1..30 {
        term = term * rates / f64::from(k);
        whole += term;
    }
    let (a, b): (Matrix3<f64>, Vector3<f64>) =
        (whole.fixed_view::<3, 3>(0, 0).into(), whole.fixed_view::<3, 1>(0, 3).into());
    let c = RowVector3::new(1.0, 0.0, 0.0);
    let pole = Matrix3::identity() * (-2.0 * PI * 8.0 * T).exp();
    let seen = Matrix3::from_rows(&[c, c * a, c * a * a]);
    let gain = (a - pole).pow(3) * seen.try_inverse().unwrap() * Vector3::new(0.0, 0.0, 1.0);
    // All three poles of what the error does are there.
    assert!((a - gain * c - pole).pow(3).amax() < 1e-12);
    #[derive(Default)]
    struct State {
        estimate: Option<Vector3<f64>>,
        position: f64,
        asked: f64,
        dry: f64,
    }
    let made = shared(
        State::default(),
        |s, y, p, _, dry| {
            (s.position, s.dry) = (p, dry);
            s.asked = 1500.0 * (y.position - p) - s.estimate.map_or(0.0, |x| x[2]);
            s.asked
        },
        move |s, excess| {
            let x = s.estimate.unwrap_or(Vector3::new(s.position, 0.0, 0.0));
            let command = s.asked + excess - s.dry;
            s.estimate = Some(a * x + b * command + gain * (s.position - x[0]));
        },
    );
    let dry = |case: &Case, y: &Reference| {
        let (one, s) = (Mass::new(case), sign(y));
        [0.0, (s * one.coulomb[usize::from(s < 0.0)] - case.machine.cart.load) / one.push]
    };
    compare("pid = { proportional = 1500 }\ndisturbance_observer = { bandwidth = 8 }", made, dry, false);
}
