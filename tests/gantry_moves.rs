//! Moves of gantries in closed loop: against an integration that shares no code with the program, and laws.

use crate::common;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;
use taut::case::{Case, Move};
use taut::chance::uniform;
use taut::control::{Loop, MoveRun, Rows, Standard, each, stream};
use taut::solve::{Ending, Flow, Solver};
use taut::trajectory::Trajectory;

/// Numbers from a seed.
struct Draw(Pcg64);

impl Draw {
    fn new(seed: u64) -> Self {
        Self(Pcg64::new(32, u128::from(seed)))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * uniform(&mut self.0)
    }
}

/// Which leg is an arc.
const ARC: usize = 1;

/// A leg of a path.
struct Course {
    from: [f64; 2],
    to: [f64; 2],
    /// Radius, angle of the beginning and turn, above zero counterclockwise.
    arc: Option<(f64, f64, f64)>,
    length: f64,
    speed: f64,
}

/// A gantry without dry friction under proportional control of each motor, along two lines and an arc with trapezoidal
/// speed.
struct Plain {
    kind: &'static str,
    radius: f64,
    inertia: f64,
    pulley_drag: f64,
    /// K_t and K_e, R.
    motor: [f64; 2],
    /// Bridge without the cart, cart.
    masses: [f64; 2],
    drags: [f64; 2],
    stiffness: Vec<f64>,
    damping: f64,
    gain: f64,
    every: f64,
    limit: f64,
    points: Vec<[f64; 2]>,
    /// Of the arc.
    center: [f64; 2],
    clockwise: bool,
    speed: f64,
    acceleration: f64,
    until: f64,
}

impl Plain {
    fn drawn(draw: &mut Draw, kind: &'static str) -> Self {
        let spans = match kind {
            "h-frame" => 3,
            "core-xy" => 4,
            _ => 6,
        };
        let mut place = || [draw.between(-0.04, 0.04), draw.between(-0.04, 0.04)];
        let (mut points, center) = (vec![place(), place(), place()], place());
        let radius = (points[0][0] - center[0]).hypot(points[0][1] - center[1]);
        let (sin, cos) = draw.between(0.0, TAU).sin_cos();
        points[ARC] = [center[0] + radius * cos, center[1] + radius * sin];
        Self {
            kind,
            radius: draw.between(0.008, 0.02),
            inertia: draw.between(2e-5, 9e-5),
            pulley_drag: draw.between(0.0, 2e-3),
            motor: [draw.between(0.02, 0.06), draw.between(0.5, 2.0)],
            masses: [draw.between(0.3, 1.2), draw.between(0.2, 0.8)],
            drags: [draw.between(4.0, 20.0), draw.between(4.0, 20.0)],
            stiffness: (0..spans).map(|_| draw.between(3e4, 2e5)).collect(),
            damping: draw.between(5.0, 40.0),
            gain: draw.between(100.0, 400.0),
            every: 1e-3 * draw.between(0.5, 2.0).round().max(0.5),
            limit: draw.between(0.5, 20.0),
            points,
            center,
            clockwise: draw.between(0.0, 1.0) < 0.5,
            speed: draw.between(0.2, 0.5),
            acceleration: draw.between(2.0, 8.0),
            until: 4.0,
        }
    }

    fn text(&self) -> String {
        let list = |values: &[f64]| format!("[{}]", values.iter().map(f64::to_string).collect::<Vec<_>>().join(", "));
        let mut points: Vec<String> = self.points.iter().map(|point| list(point)).collect();
        points[ARC] =
            format!("{{ to = {}, center = {}, clockwise = {} }}", points[ARC], list(&self.center), self.clockwise);
        let ([k, r], [bridge, cart], [b, c]) = (self.motor, self.masses, self.drags);
        format!(
            "kind = \"{}\"\n[motor]\ntorque_constant = {k}\nback_emf_constant = {k}\nresistance = {r}\n\
             [drive_pulley]\nradius = {}\ninertia = {}\nfriction = {{ viscous = {} }}\n\
             [bridge]\nmass = {bridge}\nfriction = {{ viscous = {b} }}\n\
             [cart]\nmass = {cart}\nfriction = {{ viscous = {c} }}\n\
             [belt]\nstiffness = {}\ndamping = {}\n\
             [controller]\nevery = {}\nlimit = {}\npid = {{ proportional = {} }}\n\
             [[move]]\nname = \"path\"\npoints = [{}]\nspeed = {}\nacceleration = {}\nuntil = {}\n",
            self.kind,
            self.radius,
            self.inertia,
            self.pulley_drag,
            list(&self.stiffness),
            list(&vec![self.damping; self.stiffness.len()]),
            self.every,
            self.limit,
            self.gain,
            points.join(", "),
            self.speed,
            self.acceleration,
            self.until,
        )
    }

    /// Arms of the spans: left, right and third pulley, bridge, cart.
    fn arms(&self) -> Vec<[f64; 5]> {
        let r = self.radius;
        match self.kind {
            "h-frame" => vec![[r, 0.0, 0.0, 1.0, 1.0], [0.0, -r, 0.0, 1.0, -1.0], [-r, r, 0.0, -2.0, 0.0]],
            "core-xy" => vec![
                [r, 0.0, 0.0, -1.0, -1.0],
                [-r, 0.0, 0.0, 1.0, 1.0],
                [0.0, r, 0.0, -1.0, 1.0],
                [0.0, -r, 0.0, 1.0, -1.0],
            ],
            _ => vec![
                [r, 0.0, 0.0, -1.0, 0.0],
                [-r, 0.0, 0.0, 1.0, 0.0],
                [0.0, r, 0.0, -1.0, 0.0],
                [0.0, -r, 0.0, 1.0, 0.0],
                [0.0, 0.0, r, 0.0, -1.0],
                [0.0, 0.0, -r, 0.0, 1.0],
            ],
        }
    }

    /// r φ of the pulleys with the belt without strain; a third one stands still where there are two.
    fn drives(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        match self.kind {
            "h-frame" => [-x - y, x - y, 0.0],
            "core-xy" => [x + y, x - y, 0.0],
            _ => [x, x, y],
        }
    }

    /// The legs from point to point, one of them an arc.
    fn legs(&self) -> Vec<Course> {
        let starts = std::iter::once([0.0, 0.0]).chain(self.points.iter().copied());
        let of = |(number, (from, to)): (usize, ([f64; 2], &[f64; 2]))| {
            let away = [from, *to].map(|end| [end[0] - self.center[0], end[1] - self.center[1]]);
            let arc = (number == ARC).then(|| {
                let [begin, end] = away.map(|[x, y]| y.atan2(x));
                let turn = if self.clockwise { begin - end } else { end - begin }.rem_euclid(TAU);
                (away[0][0].hypot(away[0][1]), begin, if self.clockwise { -turn } else { turn })
            });
            let length = match arc {
                Some((radius, _, turn)) => radius * turn.abs(),
                None => (to[0] - from[0]).hypot(to[1] - from[1]),
            };
            // v²/R ≤ a
            let across = arc.map_or(f64::INFINITY, |(radius, ..)| (radius * self.acceleration).sqrt());
            let speed = self.speed.min((length * self.acceleration).sqrt()).min(across);
            Course { from, to: *to, arc, length, speed }
        };
        starts.zip(&self.points).enumerate().map(of).collect()
    }

    /// Where the reference is, and the length of its path up to there: trapezoids of speed from point to point.
    fn reference(&self, time: f64) -> ([f64; 2], f64) {
        let (mut left, mut before) = (time, 0.0);
        for Course { from, to, arc, length, speed } in self.legs() {
            let (v, a) = (speed, self.acceleration);
            let (ramp, whole) = (v / a, length / v + v / a);
            if left < whole {
                let way = match left {
                    t if t < ramp => 0.5 * a * t * t,
                    t if t > whole - ramp => length - 0.5 * a * (whole - t).powi(2),
                    t => v * (t - 0.5 * ramp),
                };
                return (self.place(&Course { from, to, arc, length, speed }, way / length), before + way);
            }
            left -= whole;
            before += length;
        }
        (*self.points.last().unwrap(), before)
    }

    /// The point at this share of a leg.
    fn place(&self, Course { from, to, arc, .. }: &Course, share: f64) -> [f64; 2] {
        match arc {
            None => [0, 1].map(|k| from[k] + (to[k] - from[k]) * share),
            Some((radius, begin, turn)) => {
                let (sin, cos) = (begin + turn * share).sin_cos();
                [self.center[0] + radius * cos, self.center[1] + radius * sin]
            }
        }
    }

    fn rates(&self, z: &[f64; 10], volts: [f64; 3]) -> [f64; 10] {
        let ([k, resistance], [bridge, cart]) = (self.motor, self.masses);
        let mut forces = [0.0; 5];
        for (arms, stiffness) in self.arms().iter().zip(&self.stiffness) {
            let sum = |of: &[f64]| arms.iter().zip(of).map(|(arm, way)| arm * way).sum::<f64>();
            let pull = stiffness * sum(&z[..5]) + self.damping * sum(&z[5..]);
            forces.iter_mut().zip(arms).for_each(|(force, arm)| *force -= arm * pull);
        }
        for motor in 0..3 {
            forces[motor] += k * (volts[motor] - k * z[5 + motor]) / resistance - self.pulley_drag * z[5 + motor];
        }
        for slide in 0..2 {
            forces[3 + slide] -= self.drags[slide] * z[8 + slide];
        }
        let inertias = [self.inertia, self.inertia, self.inertia, bridge + cart, cart];
        std::array::from_fn(|n| if n < 5 { z[5 + n] } else { forces[n - 5] / inertias[n - 5] })
    }

    /// When each leg begins.
    fn begins(&self) -> Vec<f64> {
        let ends = self.legs().into_iter().scan(0.0, |time, leg| {
            *time += leg.length / leg.speed + leg.speed / self.acceleration;
            Some(*time)
        });
        std::iter::once(0.0).chain(ends).collect()
    }

    /// Distance from the path between two lengths along it, by legs that have begun and the next.
    fn off(&self, legs: &[Course], point: [f64; 2], [low, high]: [f64; 2]) -> f64 {
        let mut before = 0.0;
        let mut least = f64::INFINITY;
        for leg in legs {
            let [first, last] = [low, high].map(|along| ((along - before) / leg.length).clamp(0.0, 1.0));
            let is_there = low <= before + leg.length && before <= high;
            before += leg.length;
            let far = |share: f64| {
                let end = self.place(leg, share);
                (point[0] - end[0]).hypot(point[1] - end[1])
            };
            let distance = match leg.arc {
                None => {
                    let along = [leg.to[0] - leg.from[0], leg.to[1] - leg.from[1]];
                    let square = along[0].powi(2) + along[1].powi(2);
                    let way = (point[0] - leg.from[0]) * along[0] + (point[1] - leg.from[1]) * along[1];
                    far((way / square).clamp(first, last))
                }
                Some((radius, begin, turn)) => {
                    let [x, y] = [point[0] - self.center[0], point[1] - self.center[1]];
                    let share = (turn.signum() * (y.atan2(x) - begin)).rem_euclid(TAU) / turn.abs();
                    let is_beside = (first..=last).contains(&share);
                    if is_beside { (radius - x.hypot(y)).abs() } else { far(first).min(far(last)) }
                }
            };
            if is_there {
                least = least.min(distance);
            }
        }
        least
    }

    /// Runge and Kutta's method with this many steps a sample: the end of bridge and cart, peak and root mean square of
    /// the distance from the path, and by how much that changed in the step before the peak.
    fn integrated(&self, steps: usize) -> ([f64; 2], [f64; 3]) {
        let (mut z, h) = ([0.0; 10], self.every / steps as f64);
        let samples = (self.until / self.every).round() as usize;
        let (mut peak, mut square, mut change, mut last, mut lag) = (0.0_f64, 0.0, 0.0, 0.0, 0.0_f64);
        let (begins, legs) = (self.begins(), self.legs());
        for sample in 0..samples {
            let wanted = self.drives(self.reference(sample as f64 * self.every).0);
            let volts = [0, 1, 2].map(|motor: usize| {
                (self.gain * (wanted[motor] - self.radius * z[motor])).clamp(-self.limit, self.limit)
            });
            for part in 0..steps {
                let time = self.every * (sample as f64 + (part + 1) as f64 / steps as f64);
                common::runge_kutta(&mut z, h, |z| self.rates(z, volts));
                let begun = begins.iter().take_while(|begin| **begin <= time).count();
                let (reference, at) = self.reference(time);
                lag = lag.max((z[3] - reference[0]).hypot(z[4] - reference[1]));
                let near = [at - 2.0 * lag, at + 2.0 * lag];
                let off = self.off(&legs[..(begun + 1).min(legs.len())], [z[3], z[4]], near);
                if off > peak {
                    (peak, change) = (off, off - last);
                }
                (square, last) = (square + h * off * off, off);
            }
        }
        ([z[3], z[4]], [peak, (square / self.until).sqrt(), change])
    }
}

/// A move of a case with a row every `every`, and these rows.
fn moved(case: &Case, motion: &Move, every: f64) -> (MoveRun, Trajectory) {
    let design = case.controller.as_ref().unwrap();
    let mut controllers = Standard::of_drives(design, &case.machine).unwrap();
    let rows = Rows { until: motion.until, every, window: motion.window };
    let (references, solver) = (motion.references(design), Solver::for_machine(&case.machine));
    let mut trajectory = Trajectory::default();
    let sink = &mut |block: &Trajectory| {
        trajectory.append(block);
        Flow::Continue
    };
    let controllers = &mut each(&mut controllers);
    let run = stream(&case.machine, controllers, &Loop::new(design), &references, &rows, solver, false, sink).unwrap();
    (run, trajectory)
}

#[test]
fn closed_loops_agree_with_an_integration_that_shares_no_code() {
    let mut draw = Draw::new(7);
    let mut limited = 0;
    for number in 0..15 {
        let plain = Plain::drawn(&mut draw, ["h-frame", "core-xy", "dual-belt"][number % 3]);
        let case = Case::from_text("plain.toml", &plain.text()).unwrap();
        let (run, _) = moved(&case, &case.moves[0], 1e-2);
        assert_eq!(run.outcome.ending, Ending::Complete);
        let (ends, [peak, rms, change]) = plain.integrated(400);
        for (load, end) in run.metrics.loads.iter().zip(ends) {
            let off = load.position - end;
            assert!(off.abs() < 1e-9, "{number} {}: {off:e} m", plain.kind);
        }
        let contour = run.figures.contour.unwrap();
        // About corners the root mean square is summed over places.
        let off = [contour.peak.value.abs() - peak, contour.rms - rms];
        // Where the nearest leg changes, the peak is an edge between two steps.
        let fits = off[0].abs() < 1e-8 + change && off[1].abs() < 1e-8 + 1e-4 * rms;
        assert!(fits, "{number} {}: {off:?} m of {peak} m and {rms} m", plain.kind);
        limited += usize::from(run.samples.1 > 0);
    }
    assert!((2..=13).contains(&limited), "{limited} of 15 meet their limit");
}

/// A CoreXY with dry friction, encoders and limits, with these lines more.
fn rig(changes: &[&str]) -> Case {
    stage("core-xy/square.toml", changes)
}

fn stage(name: &str, changes: &[&str]) -> Case {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stages").join(name);
    Case::read_with(path, changes).unwrap()
}

/// Those of a dual belt were of the mean of its motors, and the yaw of a bridge was left out.
#[test]
fn following_errors_are_those_of_each_motor() {
    const YAW: &str = "bridge.yaw={ inertia = 0.02, belt_spacing = 0.5, bearing_spacing = 0.06, \
                       bearing_stiffness = 2e7, bearing_damping = 500 }";
    for (name, changes) in [
        ("core-xy/square.toml", &[][..]),
        ("core-xy/square.toml", &[YAW]),
        ("h-frame/square.toml", &[YAW]),
        ("dual-belt/square.toml", &["right_drive.motor.resistance=1.4"]),
    ] {
        let case = stage(name, changes);
        let Some(motion) = case.moves.first() else { panic!("{name} has no move") };
        let h = 5e-5;
        let (run, rows) = moved(&case, motion, h);
        let references = motion.references(case.controller.as_ref().unwrap());
        let (geometry, shares) = (case.machine.geometry(), case.machine.belt_shares());
        for ((at, shares), drive) in geometry.drives.iter().zip(shares).zip(&run.figures.drives) {
            let angles = rows.get(&format!("{}_angle", geometry.label(at.pulley).key)).unwrap();
            // y − r φ
            let off = |(time, angle): (&f64, &f64)| {
                let y: f64 = shares.iter().zip(&references).map(|(share, one)| share * one.at(*time).position).sum();
                y - case.machine.pulley_radius * angle
            };
            let off: Vec<f64> = rows.get("time").unwrap().iter().zip(angles).map(off).collect();
            let most = off.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            let square: f64 = off.windows(2).map(|pair| 0.5 * h * (pair[0].powi(2) + pair[1].powi(2))).sum();
            let (rms, following) = ((square / motion.until).sqrt(), drive.following);
            let told = format!("{name} {changes:?} {}: {following:?}, {most} and {rms} by the rows", at.side());
            assert!((following.peak.value.abs() - most).abs() < 1e-7, "{told}");
            assert!((following.rms - rms).abs() < 1e-4 * rms + 1e-9, "{told}");
            assert!((following.last - off[off.len() - 1]).abs() < 1e-12, "{told}");
        }
    }
}

#[test]
fn figures_are_those_of_the_rows() {
    for changes in [&[][..], &["amplifier.voltage_limit=4 V"], &["controller.limit=3 V", "motor.inductance=0.5 mH"]] {
        let case = rig(changes);
        for motion in &case.moves {
            let h = 5e-5;
            let (run, rows) = moved(&case, motion, h);
            let column = |name: &str| rows.get(name).unwrap_or_else(|| panic!("no {name}"));
            let most = |name: &str| column(name).iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            let rms = |name: &str| {
                let square: f64 =
                    column(name).windows(2).map(|pair| 0.5 * h * (pair[0].powi(2) + pair[1].powi(2))).sum();
                (square / motion.until).sqrt()
            };
            let figures = &run.figures;
            let contour = figures.contour.unwrap();
            let mut compared = vec![("contour_error", contour.peak.value, contour.rms, 2e-7)];
            for (name, load) in ["bridge_error", "cart_error"].into_iter().zip(&figures.loads) {
                compared.push((name, load.error.peak.value, load.error.rms, 1e-8));
                assert!((column(name).last().unwrap() - load.error.last).abs() < 1e-12);
            }
            for (side, drive) in ["left", "right"].into_iter().zip(&figures.drives) {
                let [voltage, current] = ["voltage", "current"].map(|what| format!("{side}_{what}"));
                for (name, (peak, mean)) in [(voltage, drive.voltage), (current, drive.current)] {
                    // A voltage jumps at samples, between two rows at the most.
                    assert!((peak.value.abs() - most(&name)).abs() < 2e-3 * most(&name), "{name} {changes:?}");
                    assert!((mean - rms(&name)).abs() < 2e-2 * mean, "{name} {changes:?}: {mean} {}", rms(&name));
                }
            }
            for (name, peak, mean, slack) in compared {
                assert!((peak.abs() - most(name)).abs() < slack, "{name} {changes:?}: {peak} {}", most(name));
                assert!((mean - rms(name)).abs() < 1e-4 * mean + 1e-9, "{name} {changes:?}: {mean} {}", rms(name));
            }
            // They do not depend on the rows.
            let (other, _) = moved(&case, motion, 0.37e-3);
            let pairs = other.figures.loads.iter().zip(&figures.loads).map(|(a, b)| (a.error, b.error, 1e-9));
            for (a, b, slack) in pairs.chain([(other.figures.contour.unwrap(), contour, 1e-4)]) {
                assert!((a.peak.value - b.peak.value).abs() < 1e-9, "{changes:?}: {a:?} {b:?}");
                assert!((a.rms - b.rms).abs() < 1e-9 + slack * b.rms, "{changes:?}: {a:?} {b:?}");
                assert!((a.last - b.last).abs() < 1e-9, "{changes:?}: {a:?} {b:?}");
            }
        }
    }
}

/// With motors and belts alike, a move along the bridge leaves the cart where it is, and both drives do the same.
#[test]
fn alike_sides_do_alike() {
    let alike = [
        "belt.stiffness=[1e5, 1e5, 1e5, 1e5]",
        "move=[{ name = \"out\", to = [\"60 mm\", 0], speed = 0.3, \
                 acceleration = 5, until = 0.6 }, { name = \"across\", to = [0, \"60 mm\"], speed = 0.3, acceleration = 5, \
                 until = 0.6 }]",
    ];
    let case = rig(&alike);
    let [out, across] = [0, 1].map(|place| moved(&case, &case.moves[place], 1e-3).0);
    for (run, still, sign) in [(&out, 1, 1.0), (&across, 0, -1.0)] {
        assert!(run.figures.loads[still].error.peak.value.abs() < 1e-12);
        let [left, right] = [0, 1].map(|drive| run.figures.drives[drive]);
        assert!((left.following.peak.value - sign * right.following.peak.value).abs() < 1e-12);
        assert!((left.voltage.1 - right.voltage.1).abs() < 1e-9);
        // Along one coordinate the distance from the path is what the other is off, and what it is off its ends.
        assert!(run.figures.contour.unwrap().peak.value.abs() <= run.figures.loads[1 - still].overshoot + 1e-12);
    }
}

#[test]
fn a_path_shaped_is_the_path_of_its_coordinates() {
    let case = rig(&["controller.shaper=[[0, 0.5], [10e-3, 0.5]]"]);
    let design = case.controller.as_ref().unwrap();
    let motion = &case.moves[0];
    let references = motion.references(design);
    for t in (0..2000).map(|k| 1e-3 * f64::from(k)) {
        for (shaped, plain) in references.iter().zip(&motion.profiles) {
            let mean = 0.5 * (plain.at(t).position + plain.at(t - 10e-3).position);
            assert!((shaped.at(t).position - mean).abs() < 1e-15);
        }
    }
    // Corners are cut by what a shaper does to them.
    let plain = moved(&rig(&[]), motion, 1e-3).0.figures.contour.unwrap();
    assert!(moved(&case, motion, 1e-3).0.figures.contour.unwrap().rms != plain.rms);
}

/// Feed-forward alone, on belts that hardly stretch: what moves follows by the model's own inertia and friction.
#[test]
fn feed_forward_alone_keeps_bridge_and_cart_on_their_path() {
    for (kind, spans) in [
        ("h-frame", "[1e8, 1e8, 1e8]"),
        ("core-xy", "[1e8, 1e8, 1e8, 1e8]"),
        ("dual-belt", "[1e8, 1e8, 1e8, 1e8, 1e8, 1e8]"),
    ] {
        let damping = spans.replace("1e8", "2000");
        let changes = [
            format!("belt.stiffness={spans}"),
            format!("belt.damping={damping}"),
            "controller.every=20 us".into(),
            "controller.pid={ proportional = \"1e-6 V/mm\" }".into(),
            "controller.feed_forward={ model = \"rigid\" }".into(),
            "move=[{ name = \"there\", points = [[\"60 mm\", \"20 mm\"], [\"60 mm\", \"-30 mm\"]], speed = 0.3, \
             acceleration = 5, jerk = 200, until = 0.8 }]"
                .into(),
        ];
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stages").join(kind).join("square.toml");
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let mut case = Case::read_with(path, &changes).unwrap();
        case.machine.encoder = None;
        let (run, _) = moved(&case, &case.moves[0], 1e-3);
        for load in &run.figures.loads {
            // A model that lacked a part of what moves or rubs would be off by centimetres.
            assert!(load.error.peak.value.abs() < 5e-4, "{kind}: {:?}", run.figures.loads);
        }
    }
}

#[test]
fn feed_forward_makes_contour_errors_less() {
    for kind in ["h-frame", "core-xy", "dual-belt"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stages").join(kind).join("square.toml");
        let contour = |changes: &[&str]| {
            let case = Case::read_with(&path, changes).unwrap();
            moved(&case, &case.moves[0], 1e-3).0.figures.contour.unwrap().rms
        };
        let (without, with) = (contour(&[]), contour(&["controller.feed_forward={ model = \"rigid\" }"]));
        assert!(with < 0.5 * without, "{kind}: {with} m with it, {without} m without");
    }
}

/// Beyond the limits of either motor a move is told before it runs, with what it needs: what it really takes, on belts
/// that hardly stretch, and what it then saturates.
#[test]
fn a_path_that_a_motor_cannot_drive_is_told() {
    let stiff = ["belt.stiffness=[1e8, 1e8, 1e8, 1e8]", "belt.damping=[2000, 2000, 2000, 2000]"];
    let ideal = [
        "controller.feed_forward={ model = \"rigid\" }",
        "controller.every=50 us",
        // The loop itself, and the noise of its counts, hardly matter.
        "controller.pid={ proportional = \"0.1 V/mm\" }",
    ];
    let case = rig(&[&stiff[..], &ideal].concat());
    let motion = &case.moves[0];
    assert!(motion.shortfalls(&case.machine, case.controller.as_ref().unwrap()).is_empty());
    let figures = moved(&case, motion, 1e-2).0.figures;
    let most = figures.drives.iter().map(|drive| drive.voltage.0.value.abs()).fold(0.0, f64::max);
    // Less than the move takes is short of it, by about what it takes.
    let low = rig(&[&stiff[..], &ideal, &[&format!("amplifier.voltage_limit={}", 0.7 * most)]].concat());
    let found = low.moves[0].shortfalls(&low.machine, low.controller.as_ref().unwrap());
    assert!(!found.is_empty() && found.iter().all(|short| short.limit == "voltage"), "{found:?}");
    assert!(found.iter().any(|short| short.words.starts_with("left drive: ")), "{found:?}");
    let needed = found.iter().map(|short| short.needed).fold(0.0, f64::max);
    assert!((needed / most - 1.0).abs() < 0.15, "{needed} {most}");
    assert!(moved(&low, &low.moves[0], 1e-2).0.figures.drives.iter().any(|drive| drive.amplifier_limited > 0.0));
}

/// Breakaway friction beyond the force of all motors that move a slide is told with its name; the other slide, which
/// they do move, is not.
#[test]
fn a_slide_that_the_motors_cannot_move_is_told() {
    for (slide, other) in [("bridge", "cart"), ("cart", "bridge")] {
        let breakaway = format!("{slide}.friction={{ coulomb = \"1 N\", static = \"300 N\" }}");
        let case = rig(&[&breakaway, "amplifier.voltage_limit=24 V"]);
        let found = case.moves[0].shortfalls(&case.machine, case.controller.as_ref().unwrap());
        let found: Vec<_> = found.iter().filter(|short| short.limit == "breakaway").collect();
        assert!(matches!(&found[..], [one] if one.words.starts_with(slide)), "{other}: {found:?}");
        // Both motors pull, each with η n K_t/(R r) per volt of 24, less what their pulleys take.
        let unit = &case.machine.drives[0];
        let one = 24.0 * unit.motor.torque_constant / (unit.motor.resistance * case.machine.pulley_radius);
        assert!((found[0].allowed / (2.0 * one) - 1.0).abs() < 1e-9, "{} {one}", found[0].allowed);
        assert!(found[0].needed >= 300.0);
    }
}

/// An arc may touch the end of the travel, and not go 1 µm beyond.
#[test]
fn an_arc_may_touch_the_end_of_the_travel() {
    let read = |end: &str| {
        let arc = "move=[{ name = \"arc\", from = [\"140 mm\", \"0 mm\"], until = \"3 s\", window = \"0.1 mm\", \
                   points = [{ to = [\"140 mm\", \"20 mm\"], center = [\"140 mm\", \"10 mm\"] }], \
                   speed = \"0.05 m/s\", acceleration = \"1 m/s^2\", jerk = \"100 m/s^3\" }]";
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stages/core-xy/square.toml");
        Case::read_with(path, &[arc, &format!("bridge.travel={{ min = \"-150 mm\", max = \"{end}\" }}")])
    };
    assert!(read("150 mm").is_ok(), "{:?}", read("150 mm").err());
    let error = read("149.999 mm").unwrap_err().to_string();
    assert!(error.contains("it leads to 150 mm, off the travel of the bridge"), "{error}");
}
