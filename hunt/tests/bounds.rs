//! The error that a run states, against the independent solver, on machines whose errors grow: force lines that
//! feed the motion, flanks and stops that touch.

use taut::case::Case;
use taut::solve::{Solver, simulate};
use taut_hunt::by::By;
use taut_hunt::compare::{Compared, Verdict, compare};
use taut_hunt::draw::Random;

/// Positions are not compared closer than this, m.
const LEAST: f64 = 1e-12;

/// A drawn machine on which a force line feeds the motion: near an unstable equilibrium, or pushed along by a force
/// that grows with the speed.
fn fed(random: &mut Random) -> String {
    let belt = match random.below(3) {
        0 => "model = \"rigid\"".to_string(),
        1 => format!("model = \"two-mass\"\nstiffness = [{k:e}, {k:e}, {k:e}]", k = random.decades(1e3, 1e6)),
        _ => format!("stiffness = [{k:e}, {k:e}, {:e}]", random.decades(1e3, 1e6), k = random.decades(1e3, 1e6)),
    };
    let (mass, radius) = (random.decades(0.1, 10.0), random.decades(0.005, 0.05));
    let pulley = |random: &mut Random| mass * random.decades(0.01, 0.5) * radius * radius;
    let (drive, idler) = (pulley(random), pulley(random));
    let total = mass + (drive + idler) / (radius * radius);
    // Errors grow by e^(rate · until).
    let until = random.even(0.3, 2.0);
    let rate = random.even(0.0, 30.0) / until;
    let along = random.chance(0.6);
    let dry = random.chance(0.5);
    let friction = |random: &mut Random, arm: f64| match dry {
        false => String::new(),
        true => {
            let coulomb = arm * random.decades(1e-3, 1e-1);
            let over = if random.chance(0.5) { 1.0 } else { random.even(1.0, 2.0) };
            let viscous = total * rate * random.even(0.0, 0.3) * arm * arm;
            format!("friction = {{ viscous = {viscous:e}, coulomb = {coulomb:e}, static = {:e} }}\n", coulomb * over)
        }
    };
    let (at_drive, at_cart, at_idler) = (friction(random, radius), friction(random, 1.0), friction(random, radius));
    // κ = m λ² on the way, or c = m λ with the speed
    let slope = if along { total * rate * rate } else { total * rate };
    let equilibrium = random.even(0.05, 0.5);
    // What friction does not hold grows from this.
    let off = equilibrium * if random.chance(0.5) { 0.0 } else { random.decades(1e-12, 1e-2) };
    let push = if dry { 1.0 } else { 0.0 };
    let reach = random.even(0.6, 2.0);
    let mut points = vec![[-reach, -slope * reach], [reach, slope * reach]];
    if random.chance(0.3) {
        points.insert(1, [0.3 * reach, 0.3 * slope * reach]);
    }
    let points = points.iter().map(|[x, y]| format!("[{x:e}, {y:e}]")).collect::<Vec<_>>().join(", ");
    let key = if along { "force_along" } else { "force_by_speed" };
    let load = -slope * equilibrium;
    let current = random.chance(0.5);
    let start = equilibrium + off;
    let angle = start / radius;
    let initial = match along {
        true => format!("cart_position = {start:e}, drive_angle = {angle:e}, idler_angle = {angle:e}"),
        false => format!("cart_speed = {start:e}, drive_speed = {angle:e}, idler_speed = {angle:e}"),
    };
    let input = match random.below(3) {
        0 => "{ step = 0 }".to_string(),
        1 => format!("{{ pulse = {:e}, for = {:e} }}", push * random.even(0.1, 2.0), 0.3 * until),
        _ => format!("{{ sine = {:e}, frequency = {:e} }}", push * random.even(0.1, 2.0), 2.0 / until),
    };
    format!(
        "[motor]\ntorque_constant = {kt:e}\nback_emf_constant = {kt:e}\nresistance = {}\n[amplifier]\nmode = \"{}\"\n\
         [drive_pulley]\nradius = {radius:e}\ninertia = {drive:e}\n{at_drive}[idler_pulley]\ninertia = {idler:e}\n\
         {at_idler}[cart]\nmass = {mass:e}\nload = {load:e}\n{key} = [{points}]\n{at_cart}[belt]\n{belt}\n\
         [[experiment]]\nname = \"run\"\ninput = {input}\nuntil = {until:e}\nevery = {:e}\ninitial = {{ {initial} }}\n",
        random.decades(0.5, 5.0),
        if current { "current" } else { "voltage" },
        until / random.even(7.0, 300.0),
        kt = 0.3 * radius * random.even(0.5, 2.0),
    )
}

/// The run of a machine, what it states, and how far it is off.
fn stated(text: &str) -> (Compared, f64, f64) {
    let compared = compare("drawn.toml", text, &[By::Exact], &[]).remove(0);
    let case = Case::from_text("drawn.toml", text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let outcome = simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap().outcome;
    let error = outcome.error.unwrap();
    (compared, error.value, error.way)
}

/// A force that rises along the travel or with the speed feeds an error as it feeds the motion: runs that were off by
/// 1 mm stated 3 pm.
#[test]
fn errors_that_a_force_line_feeds_were_not_in_the_bound() {
    let mut random = Random::new(28, 4);
    let (mut grown, mut sharp, mut undetermined, mut worst, mut loosest) = (0, 0, 0, 0.0_f64, 0.0_f64);
    for number in 0..400 {
        let text = fed(&mut random);
        let (compared, stated, way) = stated(&text);
        if let Verdict::Unknown(_) = compared.verdict {
            continue;
        }
        if stated >= way && stated > 1e-9 {
            undetermined += 1;
            continue;
        }
        let off = compared.difference;
        assert!(off <= stated.max(LEAST), "number {number} is off by {off:e} m and states {stated:e} m\n{text}");
        if off > LEAST {
            (worst, loosest) = (worst.max(off / stated), loosest.max(stated / off));
            grown += 1;
            sharp += usize::from(stated < 1e4 * off);
        }
    }
    println!(
        "{grown} grown, {sharp} of them sharp, {undetermined} undetermined, off by {worst} of the bound at most, by 1/{loosest:e} at least"
    );
    assert!(grown >= 50 && undetermined < 100, "{grown}, {undetermined}");
    assert!(sharp * 10 >= grown * 9, "{sharp} of {grown}");
}

/// Flanks, stops and spans that touch and leave turn a difference of their moments into one of the motion, and it was
/// not in the bound: one drawn stage in a hundred was off by more than it stated.
#[test]
fn errors_that_flanks_and_stops_make_grow_were_not_in_the_bound() {
    // Stages of a large hunt on which positions differed by 1e-12 m to 3 µm, and 1e-12 m was stated.
    for number in [224, 334, 380, 421, 457, 469, 878, 1047, 1120, 1373, 1410] {
        let text = taut_hunt::draw::stage(771, number).text;
        let (compared, stated, _) = stated(&text);
        let off = compared.difference;
        println!("stage {number} is off by {off:e} m and states {stated:e} m");
        assert!(off <= stated.max(LEAST), "stage {number} is off by {off:e} m and states {stated:e} m");
    }
}
