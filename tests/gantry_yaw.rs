//! Yaw of a bridge on its bearings, against an integration of Lagrange's equations that shares nothing with the
//! library.

use crate::common;
use taut::case::Case;
use taut::linear::{Natural, Operation, Root, System};
use taut::machine::MachineKind;
use taut::mechanism::State;
use taut::metrics::Meter;
use taut::solve::{ErrorEstimate, Flow, Solution, Solver, simulate};

const KINDS: [&str; 3] = ["h-frame", "core-xy", "dual-belt"];

/// Bearings that are soft, so that the bridge yaws by milliradians: k_b, N/m.
const SOFT: f64 = 2e5;

/// A gantry with the cart at 0.15 m on its bridge, moving; `more` goes to [amplifier], `dry` to [bridge].
fn text(kind: &str, (bearing, damping): (f64, f64), (more, dry): (&str, &str)) -> String {
    let (stiffness, input): (&[f64], _) = match kind {
        "h-frame" => (&[132e3, 120e3, 58e3], "left = { step = 5 }, right = { step = 2 }"),
        "core-xy" => (&[60e3, 130e3, 55e3, 120e3], "left = { step = 5 }, right = { step = 2 }"),
        _ => (
            &[60e3, 130e3, 55e3, 120e3, 95e3, 140e3],
            "left = { step = 5 }, right = { step = 2 }, cart = { step = -3 }",
        ),
    };
    let loss = vec![5.0 * damping; stiffness.len()];
    format!(
        r#"
        kind = "{kind}"
        motor = {{ torque_constant = "23 mN m/A", back_emf_constant = "23 mV s/rad", resistance = "0.71 ohm" }}
        amplifier = {{ {more} }}
        drive_pulley = {{ radius = "19.4 mm", inertia = "6.3e-5 kg m^2", friction = {{ viscous = {} }} }}
        belt = {{ stiffness = {stiffness:?}, damping = {loss:?} }}
        cart = {{ mass = "0.362 kg", friction = {{ viscous = {} }} }}
        [bridge]
        mass = "0.838 kg"
        friction = {{ viscous = {} {dry} }}
        [bridge.yaw]
        inertia           = "0.02 kg m^2"
        belt_spacing      = "0.5 m"
        bearing_spacing   = "60 mm"
        bearing_stiffness = {bearing:?}
        bearing_damping   = {}
        [[experiment]]
        name    = "run"
        input   = {{ {input} }}
        initial = {{ bridge_position = "0.03 m", cart_position = "0.15 m", cart_speed = "0.4 m/s" }}
        until   = "0.1 s"
        every   = "1 ms"
        "#,
        0.0016 * damping,
        8.0 * damping,
        12.0 * damping,
        200.0 * damping,
    )
}

fn case(kind: &str, bearings: (f64, f64), more: (&str, &str)) -> Case {
    Case::from_text_with("yaw.toml", &text(kind, bearings, more), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// The same machine as plain numbers: pulleys first, then x of the bridge, y of the cart, its yaw ψ.
struct Plain {
    case: Case,
    volts: Vec<f64>,
    pulleys: usize,
    /// A bridge at rest does not accelerate.
    is_held: bool,
}

impl Plain {
    fn new(case: Case) -> Self {
        let pulleys = case.machine.drives.len();
        let volts = [5.0, 2.0, -3.0][..pulleys].to_vec();
        Self { case, volts, pulleys, is_held: false }
    }

    /// How much longer each strand's way is than at the origin, by where the bridge's ends and the cart are, less what
    /// its pulley took in. A strand that pulls the cart to the left turns at the left end, and so on.
    fn stretch(&self, q: &[f64]) -> Vec<f64> {
        let machine = &self.case.machine;
        let (r, half) = (machine.pulley_radius, 0.25);
        let [x, y, yaw] = [q[self.pulleys], q[self.pulleys + 1], q[self.pulleys + 2]];
        let (left, right) = (x - half * yaw, x + half * yaw);
        match machine.kind {
            // From the motor up to the bridge's end and along it to the cart; on the far side both ends count.
            MachineKind::HFrame => vec![left + y + r * q[0], right - y - r * q[1], -left - right - r * q[0] + r * q[1]],
            // From motor A up on the left and to the cart, and round the far end down to the right end and to the cart.
            MachineKind::CoreXy => {
                vec![-right - y + r * q[0], left + y - r * q[0], -left + y + r * q[1], right - y - r * q[1]]
            }
            MachineKind::DualBelt => {
                let [a, b, c] = [r * q[0] - left, r * q[1] - right, r * q[2] - y];
                vec![a, -a, b, -b, c, -c]
            }
            MachineKind::Axis => unreachable!(),
        }
    }

    /// Generalised forces on each coordinate, without inertia.
    fn forces(&self, q: &[f64], v: &[f64]) -> Vec<f64> {
        let (machine, p) = (&self.case.machine, self.pulleys);
        let (stretch, rate) = (self.stretch(q), self.stretch(v));
        let pull = |span: usize| machine.belt.stiffness[span] * stretch[span] + machine.belt.damping[span] * rate[span];
        let mut forces = vec![0.0; p + 3];
        for (i, force) in forces.iter_mut().enumerate() {
            let mut unit = vec![0.0; p + 3];
            unit[i] = 1.0;
            // Lengths are linear: what a unit does is the lever arm.
            *force -= self.stretch(&unit).iter().enumerate().map(|(span, arm)| arm * pull(span)).sum::<f64>();
        }
        for i in 0..p {
            let motor = &machine.drives[i].motor;
            let current = (self.volts[i] - motor.back_emf_constant * v[i]) / motor.resistance;
            let driven =
                if machine.drives[i].amplifier.mode == taut::mechanism::AmplifierMode::Voltage { current } else { 0.0 };
            forces[i] += motor.torque_constant * driven - machine.drive_pulley.friction.forward.viscous * v[i];
        }
        let slides = [machine.bridge.as_ref().unwrap(), &machine.cart];
        for (i, slide) in slides.into_iter().enumerate() {
            forces[p + i] -= slide.friction.forward.viscous * v[p + i];
        }
        let yaw = machine.yaw.unwrap();
        // Two bearings 30 mm from the middle, each moved across by that times ψ.
        for side in [-0.03, 0.03] {
            let [way, speed] = [side * q[p + 2], side * v[p + 2]];
            forces[p + 2] -= side * (yaw.bearing_stiffness * way + yaw.bearing_damping * speed);
        }
        forces
    }

    /// Accelerations: M(q) q̈ = Q − m J · 2 ẏ ψ̇ with u̇ = J q̇, and the force along x on a bridge that is held.
    fn accelerations(&self, q: &[f64], v: &[f64]) -> (Vec<f64>, f64) {
        let (machine, p) = (&self.case.machine, self.pulleys);
        let forces = self.forces(q, v);
        let mut rates: Vec<f64> = forces[..p].iter().map(|force| force / machine.drive_pulley.inertia).collect();
        let (bridge, mass, inertia) =
            (machine.bridge.as_ref().unwrap().mass, machine.cart.mass, machine.yaw.unwrap().inertia);
        let lever = [1.0, q[p + 2], q[p + 1]];
        let mut m = [[bridge, 0.0, 0.0], [0.0, mass, 0.0], [0.0, 0.0, inertia]];
        let mut f = [forces[p], forces[p + 1], forces[p + 2]];
        for i in 0..3 {
            for j in 0..3 {
                m[i][j] += mass * lever[i] * lever[j];
            }
            f[i] -= mass * lever[i] * 2.0 * v[p + 1] * v[p + 2];
        }
        let (whole, load) = (m, f[0]);
        if self.is_held {
            (m[0], m[1][0], m[2][0], f[0]) = ([1.0, 0.0, 0.0], 0.0, 0.0, 0.0);
        }
        let det = |m: &[[f64; 3]; 3]| {
            m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        };
        // Cramer's rule
        let own: Vec<f64> = (0..3)
            .map(|k| {
                let mut with = m;
                (0..3).for_each(|i| with[i][k] = f[i]);
                det(&with) / det(&m)
            })
            .collect();
        let held = load - whole[0][1] * own[1] - whole[0][2] * own[2];
        rates.extend(own);
        (rates, held)
    }

    /// The positions of all coordinates at each millisecond, by steps of h of Runge and Kutta's formula.
    fn integrated(&self, steps: usize) -> Vec<Vec<f64>> {
        let n = self.pulleys + 3;
        let begin = &self.case.experiments[0].initial;
        let h = 1e-3 / steps as f64;
        let mut z: Vec<f64> = begin.position[..n].iter().chain(&begin.speed[..n]).copied().collect();
        let rate = |z: &Vec<f64>| -> Vec<f64> { [&z[n..], &self.accelerations(&z[..n], &z[n..]).0].concat() };
        let mut rows = vec![z.clone()];
        for _ in 0..100 {
            for _ in 0..steps {
                common::runge_kutta(&mut z, h, rate);
            }
            rows.push(z.clone());
        }
        rows
    }

    /// What each coordinate counts at the belt, m.
    fn levers(&self) -> Vec<f64> {
        let pulleys = vec![self.case.machine.pulley_radius; self.pulleys];
        [pulleys, vec![1.0, 1.0, 0.25]].concat()
    }
}

/// States of a run, row by row: positions, then speeds.
fn rows(case: &Case, run: &Solution) -> Vec<Vec<f64>> {
    let geometry = case.machine.geometry();
    let column = |name: String| run.trajectory.get(&name).unwrap_or_else(|| panic!("{name}")).to_vec();
    let mut columns = Vec::new();
    for of in 0..2 {
        for body in 0..geometry.bodies.len() {
            let slides = geometry.slides.iter().any(|slide| slide.body == body);
            let way = if slides { "position" } else { "angle" };
            columns.push(column(format!("{}_{}", geometry.label(body).key, [way, "speed"][of])));
        }
        columns.push(column(format!("yaw_{}", ["angle", "speed"][of])));
    }
    (0..columns[0].len()).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
}

#[test]
fn runs_are_those_of_lagranges_equations_within_the_stated_error() {
    for kind in KINDS {
        let mut case = case(kind, (SOFT, 1.0), ("", ""));
        // The ends of the bridge begin up to half a millimetre from where the belts are without strain.
        case.experiments[0].initial.position[case.machine.yaw_body().unwrap()] = 2e-3;
        let plain = Plain::new(case);
        let (machine, experiment) = (&plain.case.machine, &plain.case.experiments[0]);
        assert_eq!(Solver::for_machine(machine), Solver::GENERAL);
        let run = common::complete(&plain.case, Solver::GENERAL);
        let mut estimate = ErrorEstimate::new(machine, experiment);
        estimate.take(&run.trajectory);
        let flow = &mut || Flow::Continue;
        let stated = estimate.finish(machine, experiment, 1e-9, &run.outcome, flow).unwrap().unwrap().value;
        let (coarse, fine) = (plain.integrated(100), plain.integrated(200));
        let n = plain.pulleys + 3;
        let (mut off, mut own, mut yaw): (f64, f64, f64) = (0.0, 0.0, 0.0);
        for ((have, want), less) in rows(&plain.case, &run).iter().zip(&fine).zip(&coarse) {
            for (i, lever) in plain.levers().into_iter().enumerate() {
                off = off.max(lever * (have[i] - want[i]).abs());
                own = own.max(lever * (less[i] - want[i]).abs());
            }
            yaw = yaw.max(have[n - 1].abs());
        }
        println!("{kind}: {off:e} m off, {stated:e} m stated, {own:e} m of our own, yaw up to {yaw} rad");
        assert!(own < 1e-9 && off <= stated + own, "{kind}: {off:e} m off, {stated:e} m stated");
        assert!(stated < 1e-6 && yaw > 5e-4, "{kind}: {stated:e} m stated, yaw up to {yaw} rad");
    }
}

/// The state of a row.
fn state(row: &[f64]) -> State {
    let (positions, speeds) = row.split_at(row.len() / 2);
    let mut state = State::default();
    state.position[..positions.len()].copy_from_slice(positions);
    state.speed[..speeds.len()].copy_from_slice(speeds);
    state
}

/// A bridge that is given a yaw at the beginning, with motors that carry no current.
fn plucked(kind: &str, yaw: f64, dry: &str) -> Case {
    let mut case = case(kind, (SOFT, 0.0), ("mode = \"current\"", dry));
    let body = case.machine.yaw_body().unwrap();
    let experiment = &mut case.experiments[0];
    experiment.initial.position[body] = yaw;
    experiment.inputs = vec![taut::signal::Signal::Step { value: 0.0, at: 0.0 }; case.machine.drives.len()];
    case
}

#[test]
fn energy_is_kept_without_friction_and_currents() {
    for kind in KINDS {
        let case = plucked(kind, 2e-3, "");
        let run = common::complete(&case, Solver::General { tolerance: 1e-12 });
        let mechanism = case.machine.mechanism();
        let energy: Vec<f64> = rows(&case, &run).iter().map(|row| mechanism.energy(&state(row))).collect();
        // What the diagonal of the mass matrix alone would have, and moves by far more.
        let mut apart = mechanism.clone();
        apart.ride = None;
        let plain: Vec<f64> = rows(&case, &run).iter().map(|row| apart.energy(&state(row))).collect();
        let spread = |list: &[f64]| list.iter().map(|value| (value / list[0] - 1.0).abs()).fold(0.0, f64::max);
        println!("{kind}: {:e}, on the diagonal {:e}", spread(&energy), spread(&plain));
        assert!(spread(&energy) < 1e-8 && spread(&plain) > 1e-3, "{kind}: {:e} {:e}", spread(&energy), spread(&plain));
    }
}

#[test]
fn a_stiff_bridge_moves_as_one_that_does_not_yaw() {
    for kind in KINDS {
        let of = |case: &Case| {
            let run = common::complete(case, Solver::General { tolerance: 1e-12 });
            [
                run.trajectory.get("bridge_position").unwrap().to_vec(),
                run.trajectory.get("cart_position").unwrap().to_vec(),
            ]
        };
        let mut without = case(kind, (1e9, 1.0), ("", ""));
        without.machine.yaw = None;
        let exact = of(&without);
        let off = [1e9, 1e10].map(|stiffness| {
            let have = of(&case(kind, (stiffness, 1.0), ("", "")));
            have.iter().flatten().zip(exact.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        });
        let ratio = off[0] / off[1];
        println!("{kind}: {off:?}");
        assert!(off[1] > 1e-11 && (5.0..20.0).contains(&ratio), "{kind}: {off:?}");
    }
}

#[test]
fn friction_of_a_bridge_at_rest_holds_what_the_cart_does_to_it() {
    let (mut by_the_cart, mut stuck, mut loads) = (0.0_f64, 0, Vec::new());
    for (kind, yaw) in KINDS.into_iter().flat_map(|kind| [1e-5, 5e-5, 3e-4, 1e-3, 3e-3].map(|yaw| (kind, yaw))) {
        let dry = ", coulomb = \"1 N\", static = \"1.5 N\"";
        let mut plain = Plain::new(plucked(kind, yaw, dry));
        plain.is_held = true;
        let (p, run) = (plain.pulleys, common::complete(&plain.case, Solver::General { tolerance: 1e-11 }));
        let column = |name: &str| run.trajectory.get(name).unwrap();
        for ((row, have), state) in
            rows(&plain.case, &run).iter().zip(column("bridge_friction")).zip(column("bridge_state"))
        {
            if *state != 0.0 {
                continue;
            }
            let (q, v) = row.split_at(p + 3);
            let want = plain.accelerations(q, v).1;
            by_the_cart = by_the_cart.max((want - plain.forces(q, v)[p]).abs());
            stuck += 1;
            assert!((have - want).abs() < 1e-6 && have.abs() < 1.5 + 1e-6, "{kind}: {have} N instead of {want} N");
        }
        let from_rest = |event: &&taut::solve::Event| event.part.key() == "bridge" && event.from.word() == "stuck";
        // At time zero a load beyond the breakaway is one.
        loads.extend(run.outcome.events.iter().filter(from_rest).map(|event| (event.time, event.load.abs())));
    }
    let late: Vec<f64> = loads.iter().filter(|(time, _)| *time > 0.0).map(|(_, load)| *load).collect();
    println!("{stuck} rows at rest, up to {by_the_cart} N by the cart, broken away at {late:?}");
    assert!(stuck > 100 && late.len() > 3 && by_the_cart > 0.3, "{stuck} {late:?} {by_the_cart}");
    assert!(late.iter().all(|load| (load - 1.5).abs() < 1e-6), "{late:?}");
    assert!(loads.iter().all(|(_, load)| *load > 1.5 - 1e-6), "{loads:?}");
}

#[test]
fn modes_are_those_of_the_mass_matrix_at_the_cart() {
    for kind in KINDS {
        let plain = Plain::new(plucked(kind, 0.0, ""));
        let (machine, p, y) = (&plain.case.machine, plain.pulleys, 0.2);
        let mechanism = machine.mechanism();
        let n = p + 3;
        let at = machine.without_strain(&[0.0, y], &[]).position;
        let modes = Natural::new(&mechanism, &at).unwrap();
        assert_eq!((modes.rigid.len(), modes.elastic.len()), (2, n - 2), "{kind}");
        let (bridge, cart, inertia) =
            (machine.bridge.as_ref().unwrap().mass, machine.cart.mass, machine.yaw.unwrap().inertia);
        for mode in &modes.elastic {
            let v: Vec<f64> = mode.shape.iter().zip(plain.levers()).map(|(way, lever)| way / lever).collect();
            // −K v from our own lengths, and M v with ü = ẍ + y ψ̈
            let force = plain.forces(&v, &vec![0.0; n]);
            let around = cart * (v[p] + y * v[p + 2]);
            let mut moved: Vec<f64> = v.iter().map(|v| machine.drive_pulley.inertia * v).collect();
            moved[p..].copy_from_slice(&[bridge * v[p] + around, cart * v[p + 1], inertia * v[p + 2] + y * around]);
            let scale = force.iter().zip(plain.levers()).map(|(f, lever)| (f / lever).abs()).fold(0.0, f64::max);
            for (i, lever) in plain.levers().into_iter().enumerate() {
                let left = (force[i] + mode.frequency.powi(2) * moved[i]) / lever;
                assert!(left.abs() < 1e-9 * scale, "{kind}: {} Hz leaves {left} of {scale}", mode.hertz());
            }
            assert!((mode.energy.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{kind}: {:?}", mode.energy);
        }
        // The linear equations have the same frequencies as poles.
        let poles = System::new(machine, Operation::at(&[0.0, y])).unwrap().input(0).poles().unwrap();
        for mode in &modes.elastic {
            let near =
                poles.iter().map(|pole| (pole.norm() / mode.frequency - 1.0).abs()).fold(f64::INFINITY, f64::min);
            assert!(near < 1e-9, "{kind}: no pole at {} rad/s", mode.frequency);
        }
        // They are others with the cart in the middle.
        let middle = Natural::new(&mechanism, &[0.0; 6]).unwrap();
        let moved = modes.elastic.iter().zip(&middle.elastic).map(|(a, b)| (a.frequency / b.frequency - 1.0).abs());
        assert!(moved.fold(0.0, f64::max) > 0.05, "{kind}");
        assert!(modes.poles.iter().filter(|root| matches!(root, Root::Pair { .. })).count() == n - 2);
    }
}

#[test]
fn position_errors_and_stretches_contain_the_yaw() {
    for kind in KINDS {
        let mut case = case(kind, (SOFT, 1.0), ("", ""));
        case.experiments[0].every = 2e-5;
        let plain = Plain::new(case);
        let (machine, experiment) = (&plain.case.machine, &plain.case.experiments[0]);
        let mut meter = Meter::new(machine, experiment);
        let rows_of = &mut |_: &taut::trajectory::Trajectory| Flow::Continue;
        let run = taut::solve::stream_observed(machine, experiment, Solver::GENERAL, &mut meter, rows_of).unwrap();
        let metrics = meter.finish(&run.events);
        let solution = common::complete(&plain.case, Solver::GENERAL);
        let (rows, p) = (rows(&plain.case, &solution), plain.pulleys);
        let largest = |value: &dyn Fn(&[f64]) -> f64| rows.iter().map(|row| value(row).abs()).fold(0.0, f64::max);
        for (span, of) in metrics.spans.iter().enumerate() {
            let want = largest(&|row| plain.stretch(row)[span]);
            let have = of.peak_stretch.value.abs();
            assert!(have >= want - 1e-9 && have < 1.001 * want, "{kind}: span {span}: {have} m, {want} m at rows");
        }
        for (slide, load) in metrics.loads.iter().enumerate() {
            let want = largest(&|row| machine.by_drives(&state(row).position)[slide] - row[p + slide]);
            let have = load.peak_error.value.abs();
            assert!(have >= want - 1e-9 && have < 1.001 * want, "{kind}: slide {slide}: {have} m, {want} m at rows");
        }
    }
}

#[test]
fn what_cannot_have_yaw_says_so() {
    let case = case("core-xy", (SOFT, 1.0), ("", ""));
    let error = simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap_err().to_string();
    assert!(error.contains("the bridge yaws") && error.contains("--solver general"), "{error}");
    let error = taut::export::Tables::new(&case.machine.mechanism()).unwrap_err().to_string();
    assert!(error.contains("the bridge yaws") && error.contains("taut export fmu"), "{error}");
}
