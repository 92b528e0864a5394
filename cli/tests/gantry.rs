//! Gantries as a user meets them: what the commands print and write of them, and what they say of what is not there.

use crate::common::{stage, taut_in, text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

/// Runs a command that is refused; what it says, without the folder of the stages.
fn refused(args: &[&str], case: &Path) -> String {
    let folder = TempDir::new().unwrap();
    let run = taut_in(folder.path()).arg(args[0]).arg(case).args(&args[1..]).assert().code(2);
    let output = run.get_output();
    assert!(output.stdout.is_empty());
    text(&output.stderr).replace(&case.parent().unwrap().display().to_string(), "stages")
}

#[test]
fn simulate_writes_a_whole_folder() {
    let folder = TempDir::new().unwrap();
    let case = stage("h-frame/h-frame.toml");
    let run = taut_in(folder.path()).arg("simulate").arg(&case).args(["--out", "out"]).assert().success();
    let out = text(&run.get_output().stdout);
    for word in [
        "H-frame, one belt round both drives: bridge 0.838 kg, cart 0.362 kg",
        "solved exactly",
        "final position  bridge ",
        "by the drives",
        "peak force      left ",
        "drives' error",
        "events          9: left pulley 2, right pulley 3, bridge 2, cart 2",
        "by a bound of rounding",
        "one-motor.csv",
    ] {
        assert!(out.contains(word), "{word} is not in\n{out}");
    }
    let read = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let rows = read("one-motor.csv");
    let heading = "time_s,left_voltage_V,right_voltage_V,left_angle_rad,left_speed_rad_s,right_angle_rad,right_speed_rad_s,\
                   bridge_position_m,bridge_speed_m_s,cart_position_m,cart_speed_m_s,left_current_A,right_current_A,\
                   left_span_force_N,right_span_force_N,back_span_force_N,";
    assert!(rows.starts_with(heading), "{}", rows.lines().next().unwrap());
    assert_eq!(rows.lines().count(), 1002);
    let events = read("one-motor.events.csv");
    for part in ["left", "right", "bridge", "cart"] {
        assert!(events.contains(&format!(",{part},stuck,")), "{part}: {events}");
    }
    // What repeats the run does so bit for bit.
    let again =
        taut_in(folder.path()).args(["simulate", "out/case.toml", "--out", "again", "--quiet", "--no-report"]).assert();
    assert!(again.success().get_output().stdout.is_empty());
    for name in ["one-motor.csv", "along-x.csv", "along-y.events.csv", "case.toml"] {
        assert!(fs::read(folder.path().join("again").join(name)).unwrap() == read(name).as_bytes(), "{name}");
    }
    assert!(!folder.path().join("again/report.html").exists());
    let report = read("report.html");
    for word in ["The gantry in plan view", "one motor: path", "along y: forces", "left pulley", "φ", "kind  = "] {
        assert!(report.contains(word), "{word}");
    }
    for plot in ["drives", "positions", "path", "speeds", "forces", "friction"] {
        assert!(folder.path().join(format!("out/plots/along-x-{plot}.svg")).exists(), "{plot}");
    }
}

#[test]
fn the_summary_is_data() {
    let folder = TempDir::new().unwrap();
    let case = stage("core-xy/core-xy.toml");
    let more = ["--json", "--experiment", "along x", "--set", "bridge.mass=1 kg"];
    let run = taut_in(folder.path()).arg("simulate").arg(&case).args(more).assert().success();
    let told = json(&run.get_output().stdout);
    assert_eq!((told["kind"].as_str(), told["solver"]["name"].as_str()), (Some("core-xy"), Some("exact")));
    assert_eq!(told["machine"]["bridge_mass_kg"], 1.0);
    assert_eq!(told["machine"]["span_stiffness_newton_per_m"]["b_back_span"], 95e3);
    assert_eq!(told["experiments"].as_array().unwrap().len(), 1);
    let run = &told["experiments"][0];
    assert_eq!(run["position_error_basis"], "bound of rounding");
    assert!(run["position_error_m"].as_f64().unwrap() < 1e-9);
    let metrics = &run["metrics"];
    assert!(metrics["final_bridge_position_m"].as_f64().unwrap() > 0.1);
    assert!(metrics["peak_span_force_N"]["a_out_span"]["value"].as_f64().unwrap() > 1.0);
    assert!(metrics["stop_time_s"].as_f64().unwrap() < 0.5 && metrics["settled"] == true);
    let parts: Vec<&str> =
        metrics["event_counts"].as_array().unwrap().iter().map(|count| count["body"].as_str().unwrap()).collect();
    assert_eq!(parts, ["left", "right", "bridge", "cart"]);
    let units =
        |event: &Value| (event["part"].as_str().unwrap().to_string(), event["load_unit"].as_str().unwrap().to_string());
    for event in run["events"].as_array().unwrap() {
        let (part, unit) = units(event);
        assert_eq!(unit, if part == "left" || part == "right" { "N m" } else { "N" });
    }
}

#[test]
fn spans_that_follow_are_solved_in_general_with_an_error_that_is_estimated() {
    let folder = TempDir::new().unwrap();
    for name in ["h-frame/follows.toml", "core-xy/follows.toml"] {
        let told = |more: &[&str]| {
            let run =
                taut_in(folder.path()).arg("simulate").arg(stage(name)).arg("--json").args(more).assert().success();
            json(&run.get_output().stdout)
        };
        let (usual, fine) = (told(&[]), told(&["--solver", "general", "--tolerance", "1e-12"]));
        assert_eq!(usual["solver"]["name"], "general");
        assert_eq!((&usual["solver"]["tolerance"], &fine["solver"]["tolerance"]), (&1e-9.into(), &1e-12.into()));
        assert_eq!(usual["experiments"][0]["position_error_basis"], "a second run with a hundred times the tolerance");
        let at = |told: &Value, key: &str| told["experiments"][0]["metrics"][key].as_f64().unwrap();
        let error = usual["experiments"][0]["position_error_m"].as_f64().unwrap();
        for key in ["final_bridge_position_m", "final_cart_position_m"] {
            assert!((at(&usual, key) - at(&fine, key)).abs() <= error && error < 2e-9, "{name}: {key}");
        }
    }
    let told = refused(&["simulate", "--solver", "exact"], &stage("h-frame/follows.toml"));
    assert_eq!(
        told,
        "error: the belt's spans follow the cart: this solver does not support it\n  \
         next: leave --solver out, or write --solver general: it takes all of these\n"
    );
}

#[test]
fn who_leaves_the_travel_is_named() {
    let folder = TempDir::new().unwrap();
    let short = ["--set", "cart.travel.min=-20mm"];
    let run = taut_in(folder.path()).arg("simulate").arg(stage("h-frame/h-frame.toml")).args(short).assert().code(1);
    let output = run.get_output();
    assert!(text(&output.stdout).contains("the cart leaves its travel there, and nothing stops it"));
    assert!(text(&output.stderr).starts_with("error: the run \"one motor\" ended at "), "{}", text(&output.stderr));
}

#[test]
fn options_of_an_axis_are_refused() {
    let case = stage("h-frame/h-frame.toml");
    for (args, told) in [
        (
            &["simulate", "--as-measured", "--out", "out"][..],
            "error: --as-measured: this is available for a single axis, not yet for a gantry\n  \
             next: leave it out: the columns hold the encoder's counts, where the case has an [encoder]\n",
        ),
        (
            &["simulate", "--draws", "posterior.csv"],
            "error: --draws: this is available for a single axis, not yet for a gantry\n  \
             next: leave it out: the band is that of the drive and cart of an axis\n",
        ),
        (
            &["simulate", "--solver", "table3"],
            "error: --solver table3: the paper's Table 3, with its fixed step, is of a single axis\n  \
             next: leave it out: a gantry is solved exactly, or by --solver general\n",
        ),
        (
            &["simulate", "--step", "1ms"],
            "error: --step: the paper's Table 3, with its fixed step, is of a single axis\n  \
             next: leave it out: a gantry is solved exactly, or by --solver general\n",
        ),
        (
            &["simulate", "--tolerance", "1e-6"],
            "error: --tolerance: only the general solver has a tolerance\n  \
             next: leave --tolerance out, or add --solver general\n",
        ),
        (
            &["simulate", "--experiment", "along z"],
            "error: --experiment: there is no experiment \"along z\"\n  \
             allowed: \"one motor\", \"along x\", \"along y\"\n  \
             next: name one of these, or leave --experiment out to run them all\n",
        ),
    ] {
        assert_eq!(refused(args, &case), told);
    }
}

#[test]
fn modes_tells_rigid_and_elastic_ones_and_maps_the_area() {
    let folder = TempDir::new().unwrap();
    let case = stage("core-xy/follows.toml");
    let run = taut_in(folder.path()).arg("modes").arg(&case).args(["--out", "out"]).assert().success();
    let out = text(&run.get_output().stdout);
    for word in [
        "Rigid modes",
        "bridge      per m: left pulley 51.55 rad, right pulley 51.55 rad, cart 0",
        "cart        per m: left pulley 51.55 rad, right pulley -51.55 rad, bridge 0",
        "191.97 Hz   damping ",
        "mode shape at the belt: left pulley 1.000, right pulley 1.000, bridge -0.279",
        "energy: ",
        "elastic mode 2, Hz: from 220.1 to 354.9",
        "map.csv  modes.json  plots/  report.html  files.json",
    ] {
        assert!(out.contains(word), "{word} is not in\n{out}");
    }
    let read = |name: &str| fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let told: Value = serde_json::from_str(&read("modes.json")).unwrap();
    assert_eq!(told["rigid"][0]["body"], "bridge");
    assert!((told["rigid"][1]["shape"]["right_rad"].as_f64().unwrap() + 1.0 / 0.0194).abs() < 1e-9);
    assert_eq!(told["rigid"][1]["shape"]["cart_m"], 1.0);
    let elastic = told["elastic"].as_array().unwrap();
    assert!(elastic.len() == 2 && elastic[0]["damping_ratio"].as_f64().unwrap() > 0.0);
    let map = read("map.csv");
    let mut rows = map.lines();
    assert_eq!(rows.next(), Some("bridge_position_m,cart_position_m,elastic_1_Hz,elastic_2_Hz"));
    let grid = &told["map"]["elastic_Hz"];
    let places =
        [&told["map"]["bridge_position_m"], &told["map"]["cart_position_m"]].map(|v| v.as_array().unwrap().len());
    assert_eq!(rows.clone().count(), places[0] * places[1]);
    // The second row: the bridge at its least, the cart one place on.
    let row: Vec<f64> = rows.nth(1).unwrap().split(',').map(|v| v.parse().unwrap()).collect();
    assert_eq!([row[2], row[3]], [0, 1].map(|mode: usize| grid[mode][0][1].as_f64().unwrap()));
    assert!(read("report.html").contains("Elastic mode 2") && folder.path().join("out/plots/elastic-1.svg").exists());

    let same = taut_in(folder.path()).arg("modes").arg(stage("h-frame/h-frame.toml")).arg("--json").assert().success();
    let told = json(&same.get_output().stdout);
    assert_eq!((&told["stiffness_depends_on_position"], &told["map"]), (&Value::Bool(false), &Value::Null));
    assert!((told["elastic"][0]["frequency_Hz"].as_f64().unwrap() - 196.643946994).abs() < 1e-9);
}

/// A gantry is asked what an axis is: a place, a speed, bodies held, a sample time, a range of frequencies.
#[test]
fn modes_of_a_gantry_answer_every_question() {
    let case = stage("core-xy/follows.toml");
    let asked = |options: &[&str]| {
        let folder = TempDir::new().unwrap();
        let run =
            taut_in(folder.path()).arg("modes").arg(&case).args(options).args(["--out", "out", "--json"]).assert();
        let told = json(&run.success().get_output().stdout);
        (told, fs::read_to_string(folder.path().join("out/frequency-response.csv")).unwrap())
    };
    // At a corner of the map the modes are what the map says.
    let (usual, _) = asked(&[]);
    let map = &usual["map"];
    let (x, y) = (map["bridge_position_m"][3].as_f64().unwrap(), map["cart_position_m"][30].as_f64().unwrap());
    let (there, _) = asked(&["--bridge", &x.to_string(), "--at", &y.to_string()]);
    for mode in 0..2 {
        let (told, want) = (&there["elastic"][mode]["frequency_Hz"], &map["elastic_Hz"][mode][3][30]);
        assert!((told.as_f64().unwrap() / want.as_f64().unwrap() - 1.0).abs() < 1e-12, "{told} {want}");
    }
    assert_eq!(there["here"]["bridge_position_m"].as_f64(), Some(x));
    // With both pulleys held nothing is driven, and what is left swings as "drives held" says.
    let (held, _) = asked(&["--stuck", "left,right"]);
    assert_eq!((&held["rigid"], &held["operation"]["stuck"]), (&Value::Null, &serde_json::json!(["left", "right"])));
    assert_eq!(held["here"]["resonances"], usual["here"]["antiresonances"]);
    // Sampled, each drive by itself has the poles e^(s T).
    let (sampled, response) = asked(&["--sample-time", "1ms", "--delay", "1.5ms", "--from", "1Hz", "--to", "100Hz"]);
    for input in sampled["inputs"].as_array().unwrap() {
        let poles = input["discrete"]["poles"].as_array().unwrap();
        let integrators = poles.iter().filter(|pole| (pole["re"].as_f64().unwrap() - 1.0).abs() < 1e-9);
        assert_eq!((integrators.count(), poles.len()), (2, 8 + 2));
    }
    let mut rows = response.lines();
    let head = rows.next().unwrap();
    assert!(head.contains(",right_voltage_command_to_bridge_position_magnitude,"), "{head}");
    let hertz: Vec<f64> = rows.map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
    assert!((hertz[0] - 1.0).abs() < 1e-9 && (hertz.last().unwrap() - 100.0).abs() < 1e-9);

    for (options, told) in [
        (["--stuck", "idler"], "--stuck: this machine has no body \"idler\"\n  allowed: left, right, bridge, cart\n"),
        (["--bridge", "9m"], "--bridge: 9 m is outside the travel\n"),
    ] {
        let said = refused(&["modes", options[0], options[1]], &case);
        assert!(said.starts_with(&format!("error: {told}")), "{said}");
    }
}

/// Options that a gantry does not have are refused, at the line that makes it one.
#[test]
fn a_sweep_writes_a_whole_folder_that_repeats_it() {
    let folder = TempDir::new().unwrap();
    let plan =
        ["--runs", "24", "--design", "sobol", "--vary", "all=20%", "--trajectories", "--threads", "2", "--out", "out"];
    let mut sweep = taut_in(folder.path());
    let run = sweep.arg("sweep").arg(stage("h-frame/h-frame.toml")).args(plan).arg("--verbose").assert().success();
    let told = text(&run.get_output().stdout);
    for word in [
        "24 runs of 3 simulations each: 21 parameters, sobol",
        "bridge position at the end",
        "peak current of the left drive",
        "largest force in the belt",
        "figures that count events",
    ] {
        assert!(told.contains(word), "{word} is not in\n{told}");
    }
    let out = folder.path().join("out");
    let summary: Value = serde_json::from_str(&fs::read_to_string(out.join("sweep.json")).unwrap()).unwrap();
    let figures = summary["experiments"][1]["figures"].as_array().unwrap();
    let speed = figures.iter().find(|figure| figure["name"] == "peak_left_speed").unwrap();
    assert!(speed["unit"] == "rad/s" && speed["spread"]["count"] == 24);
    assert!(fs::read_to_string(out.join("report.html")).unwrap().contains("along y: bridge position at the end"));
    for plot in ["one-motor-final-bridge-position-histogram.svg", "along-x-peak-left-current-scatter.svg"] {
        assert!(out.join("plots").join(plot).exists(), "{plot}");
    }
    assert!(!folder.path().join("out/runs.parquet.parts").exists());
    let read = |file: &Path, names: &[&str]| taut::log::read_columns(file, names).unwrap();
    let rows = read(&out.join("runs.parquet"), &["run", "cart.mass_kg", "along-x.final_bridge_position_m"]);
    assert!(rows[0].len() == 24 && rows[1].iter().all(|mass| (0.8 * 0.362..1.2 * 0.362).contains(mass)));
    let names = ["run", "experiment", "time_s", "bridge_position_m", "left_span_force_N"];
    let trajectories = read(&out.join("runs-trajectories.parquet"), &names);
    assert_eq!(trajectories[0].len(), 24 * 3 * 1001);
    let last = (0..trajectories[0].len()).rfind(|row| trajectories[1][*row] == 1.0).unwrap();
    assert_eq!((trajectories[0][last], trajectories[2][last]), (23.0, 1.0));
    // Trajectories are of the exact solver, figures of machines side by side.
    assert!((trajectories[3][last] - rows[2][23]).abs() < 1e-12);
    // The case of the folder repeats it, on another number of threads.
    let again = ["sweep", "case.toml", "--threads", "1", "--out", "again.parquet", "--json"];
    let run = taut_in(&out).args(again).assert().success();
    assert_eq!(json(&run.get_output().stdout), summary);
    assert_eq!(fs::read(out.join("again.parquet")).unwrap(), fs::read(out.join("runs.parquet")).unwrap());
}

#[test]
fn a_sweep_of_a_case_file_has_its_designs() {
    let folder = TempDir::new().unwrap();
    let whole = fs::read_to_string(stage("core-xy/core-xy.toml")).unwrap();
    for (design, runs) in [
        ("design = \"one-at-a-time\"\n[sweep.vary]\nall = \"factors(2, 0.5)\"\n", "47 runs"),
        (
            "design = \"random\"\nruns = 3\nindices = true\n[sweep.vary]\n\"left_drive.motor.resistance\" = \"5 %\"\n",
            "9 runs",
        ),
        (
            "design = \"grid\"\n[sweep.vary]\n\"cart.travel.max\" = [\"0.2 m\", \"0.3 m\"]\n\"bridge.friction.coulomb = cart.friction.coulomb\" = \"factors(1, 2)\"\n",
            "4 runs",
        ),
    ] {
        fs::write(folder.path().join("case.toml"), format!("{whole}\n[sweep]\n{design}")).unwrap();
        let run = taut_in(folder.path()).args(["sweep", "case.toml"]).assert().success();
        let told = text(&run.get_output().stdout);
        assert!(told.contains(runs), "{runs}: {told}");
    }
}

#[test]
fn a_sweep_that_a_gantry_cannot_have_is_told() {
    let case = stage("h-frame/h-frame.toml");
    let told =
        |vary: &str, more: &[&str]| refused(&[&["sweep", "--runs", "4", "--vary", vary][..], more].concat(), &case);
    for (vary, message) in [
        (
            "idler_pulley.inertia=20%",
            "sweep.vary.idler_pulley.inertia: `idler_pulley.inertia` is of a single axis, and this is a gantry\n",
        ),
        ("cart.load=20%", "`cart.load` is 0, of which a share or a multiple is nothing\n"),
        ("sweep.runs=20%", "`sweep.runs` is not a number of the machine\n"),
        ("third_drive.motor.resistance=20%", "`third_drive.motor.resistance` is not a parameter of the machine\n"),
        ("left_drive.cart.mass=20%", "`left_drive.cart.mass` is not a parameter of the machine\n"),
        ("bridge.mas=20%", "next: did you mean `bridge.mass`?\n"),
        (
            "belt.stiffness.3=20%",
            "`belt.stiffness.3` does not exist: there are 3\n  1 | sweep.vary.\"belt.stiffness.3\"=20%\n    \
             |                               ^^^\n  allowed: belt.stiffness.0 to belt.stiffness.2\n",
        ),
        ("belt.modulus=20%", "`belt.modulus` has no value in this case\n"),
        ("total.viscous=20%", "`total.viscous` is a sum over the bodies of a single axis, and this is a gantry\n"),
        ("cart.friction.stribeck.force=20%", "`cart.friction.stribeck.force` has no value in this case\n"),
        ("bridge.mass=values(-1 kg)", "-1 kg has to be above zero\n"),
        ("cart.mass=values(1 s)", "\"1 s\" is a time (s); expected a mass (kg)\n"),
    ] {
        let told = told(vary, &[]);
        assert!(told.contains(message), "{vary}: {told}");
    }
    // A key that is nothing like any lists those of this gantry.
    let all = told("idler_pulley.inertia=20%", &[]);
    for key in [
        "motor.resistance, ",
        "drive_pulley.radius, ",
        "bridge.mass, cart.mass, ",
        "cart.friction.coulomb, ",
        "belt.stiffness, ",
    ] {
        assert!(all.contains(key), "{key}: {all}");
    }
    assert!(!all.contains("idler_pulley.friction") && !all.contains("gear_stiffness"), "{all}");
    assert!(all.ends_with("next: of one drive alone write for example left_drive.motor.resistance\n"), "{all}");

    let from = told("cart.mass=20%", &["--set", "sweep.from=uncertainty"]);
    assert!(
        from.contains("sweep.from: gantries are not fitted yet, so the uncertainty of their parameters is unknown\n"),
        "{from}"
    );
    let interval = told("cart.mass=20%", &["--interval", "2 s"]);
    assert!(interval.contains("an interval of 2 s does not suit \"one motor\"\n"), "{interval}");
    let apart = told("motor.resistance=20%", &["--set", "left_drive.motor.resistance=0.8 ohm"]);
    assert!(apart.contains("`motor.resistance` is not the same in all drives\n"), "{apart}");
    assert_eq!(
        refused(&["sweep"], &case),
        "error: stages/h-frame.toml: this case has no parameters to vary\n  \
         next: give for example --runs 1000 --vary cart.mass=20%, or add a table [sweep]\n"
    );
}

/// Ctrl-C in the middle: the same command goes on, and the file is that of a run in one go.
#[test]
#[cfg(unix)]
fn a_sweep_that_was_interrupted_goes_on() {
    use std::process::{Command as Program, Stdio};
    let folder = TempDir::new().unwrap();
    let run = |out: &str| {
        let mut run = Program::new(env!("CARGO_BIN_EXE_taut"));
        run.arg("sweep").arg(stage("core-xy/core-xy.toml")).args(["--runs", "1200", "--vary", "all=20%", "--out", out]);
        run.current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        crate::faults::by_default(&mut run);
        run
    };
    let parts = folder.path().join("cut.parquet.parts");
    let done = || {
        fs::read_dir(&parts).map_or(0, |entries| {
            entries.flatten().filter(|e| e.path().extension().is_some_and(|e| e == "part")).count()
        })
    };
    let mut child = run("cut.parquet").spawn().unwrap();
    while done() < 2 {
        assert!(child.try_wait().unwrap().is_none(), "it was done too soon");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(Program::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(done() >= 2 && !folder.path().join("cut.parquet").exists());
    for out in ["cut.parquet", "whole.parquet"] {
        assert!(run(out).output().unwrap().status.success());
    }
    let [cut, whole] = ["cut.parquet", "whole.parquet"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(cut == whole && !parts.exists());
}

#[test]
fn init_writes_gantries_that_run_as_they_stand() {
    let folder = TempDir::new().unwrap();
    for (kind, title) in [("h-frame", "H-frame, one belt"), ("core-xy", "CoreXY, a belt for each drive")] {
        let file = format!("{kind}.toml");
        taut_in(folder.path()).args(["init", "--kind", kind, &file]).assert().success();
        let run = taut_in(folder.path()).args(["simulate", &file]).assert().success();
        let out = text(&run.get_output().stdout);
        assert!(out.contains(title) && out.contains("along x\n  final position  bridge 1"), "{out}");
        // Every remark that names a key names one that there is.
        let whole = fs::read_to_string(folder.path().join(&file)).unwrap().replace("# [", "[");
        let given = whole.find("stiffness =").unwrap();
        let shown: String = whole[..given].to_string()
            + &whole[given..]
                .replacen("stiffness", "# stiffness", 1)
                .lines()
                .map(|line| {
                    match ["modulus", "section", "spans ", "follows_cart", "initial"]
                        .iter()
                        .any(|key| line.starts_with(&format!("# {key}")))
                    {
                        true => format!("{}\n", line.trim_start_matches("# ")),
                        false => format!("{line}\n"),
                    }
                })
                .collect::<String>();
        let shown =
            shown.replace("# resistance = \"0.8 ohm\"", "resistance = \"0.8 ohm\"").replace("# gain = -1", "gain = -1");
        fs::write(folder.path().join("all.toml"), &shown).unwrap();
        let all = taut_in(folder.path()).args(["simulate", "all.toml", "--experiment", "along x"]).assert();
        let output = all.get_output();
        assert!(text(&output.stdout).contains("following bridge and cart"), "{}\n{shown}", text(&output.stderr));
    }
}

/// Bearings given in N/m for N/mm let a bridge yaw by 54°, of which the accuracy of the run said nothing.
#[test]
fn a_bridge_that_yaws_beyond_its_model_is_warned_of() {
    let folder = TempDir::new().unwrap();
    let run = |more: &[&str]| {
        let mut run = taut_in(folder.path());
        run.arg("simulate").arg(stage("h-frame/racking.toml")).args(["--experiment", "along y"]).args(more);
        let output = run.output().unwrap();
        (output.status.code(), text(&output.stderr).to_string())
    };
    assert_eq!(run(&[]).0, Some(0));
    let soft = ["--set", "bridge.yaw.bearing_stiffness=10 N/m", "--set", "bridge.yaw.bearing_damping=0"];
    let (status, told) = run(&soft);
    assert_eq!(status, Some(1));
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("its equations are for less than 0.1 rad"), "{told}");
}
