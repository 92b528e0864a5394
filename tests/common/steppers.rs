//! Closed-loop steppers drawn at random: an axis, an H-frame or a CoreXY, an encoder, a PID and one move.

/// A case by uniform numbers from 0 to 1, its kind by `number`; without dry friction and microsteps if `is_smooth`. Its
/// loop is stable, and its move is within the torque of the motor.
pub fn in_loop(number: u64, mut uniform: impl FnMut() -> f64, is_smooth: bool) -> String {
    let kind = ["axis", "core-xy", "h-frame"][(number % 3) as usize];
    let is_axis = kind == "axis";
    let mut between = |low: f64, high: f64| low + (high - low) * uniform();
    let (holding, rated) = (between(0.3, 0.6), between(1.0, 2.5));
    let resistance = between(1.0, 2.5) / rated;
    let is_chopper = between(0.0, 1.0) < 0.7;
    let supply = if is_chopper { between(18.0, 36.0) } else { 2f64.sqrt() * rated * resistance * 0.999 };
    let drive = if is_chopper { "chopper" } else { "voltage" };
    let microsteps = [2, 4, 16][(3.0 * between(0.0, 0.999)) as usize];
    let is_even = is_smooth || between(0.0, 1.0) < 0.3;
    let mut text = if is_axis { String::new() } else { format!("kind = \"{kind}\"\n") };
    text += &format!(
        "[stepper]\nsteps_per_turn = 200\nholding_torque = {holding:e}\nrated_current = {rated:e}\n\
         resistance = {resistance:e}\ninductance = {:e}\nsupply = {supply:e}\ndrive = \"{drive}\"\n\
         microsteps = {microsteps}\ninterpolate = {is_even}\ndetent_torque = {:e}\nrotor_inertia = {:e}\n",
        resistance * between(1e-3, 2.5e-3),
        holding * between(0.0, 0.05),
        1.2e-5 * holding,
    );
    let coulomb = if is_smooth { 0.0 } else { between(0.0, 1.5) };
    let mut slide = |mass: f64| {
        let viscous = between(2.0, 8.0);
        format!("mass = {mass:e}\nfriction = {{ viscous = {viscous:e}, coulomb = {coulomb:e} }}\n")
    };
    let (cart, bridge) = (slide(0.3), slide(0.5));
    let (radius, inertia, stiffness) = (between(5e-3, 8e-3), between(5e-7, 2e-6), between(4e4, 1.2e5));
    text += &format!("[drive_pulley]\nradius = {radius:e}\ninertia = {inertia:e}\n[cart]\n{cart}");
    let shares: &[f64] = match kind {
        "axis" => &[1.0, 1.0, 0.5],
        "core-xy" => &[1.0, 0.7, 0.9, 0.6],
        _ => &[1.0, 0.8, 0.5],
    };
    let list = |factor: f64| shares.iter().map(|share| format!("{:e}", share * factor)).collect::<Vec<_>>().join(", ");
    let belt = format!("[belt]\nstiffness = [{}]\ndamping = [{}]\n", list(stiffness), list(2e-4 * stiffness));
    text += &match is_axis {
        true => format!("[idler_pulley]\ninertia = 5e-7\n{belt}"),
        false => format!("[bridge]\n{bridge}{belt}"),
    };
    // One in three machines has no encoder: its controllers read exact positions of the rotors.
    match (3.0 * between(0.0, 0.999)) as usize {
        0 => {}
        1 => text += &format!("[encoder]\nat = \"motor\"\nlines = {}\n", between(1000.0, 10_000.0).round()),
        _ => text += &format!("[encoder]\nat = \"drive_pulley\"\nlines = {}\n", between(1000.0, 10_000.0).round()),
    }
    let every = between(2e-4, 4e-4);
    text += &format!(
        "[controller]\nevery = {every:e}\ndelay = {:e}\nlimit = {:e}\n[controller.pid]\nproportional = {:e}\n\
         integral = {:e}\nderivative = {:e}\nfilter = {:e}\ntracking = {:e}\n",
        every * [0.0, 0.5, 1.0, 1.5][(4.0 * between(0.0, 0.999)) as usize],
        between(2e-5, 2e-4),
        between(0.0, 0.08),
        between(4.0, 15.0),
        between(0.2e-4, 1e-4),
        between(500.0, 1000.0),
        between(0.01, 0.05),
    );
    let to = match is_axis {
        true => format!("to = {:e}", between(2e-3, 6e-3)),
        false => format!("points = [[{:e}, {:e}]]", between(2e-3, 5e-3), between(-5e-3, 5e-3)),
    };
    let (speed, acceleration) = (between(0.05, 0.15), between(1.0, 3.0));
    let jerk = if between(0.0, 1.0) < 0.5 { format!("jerk = {:e}\n", between(100.0, 1000.0)) } else { String::new() };
    text + &format!(
        "[[move]]\nname = \"there\"\n{to}\nspeed = {speed:e}\nacceleration = {acceleration:e}\n{jerk}until = 0.15\n"
    )
}
