//! Sweeps: the same rows however they are split, distributions, designs, metrics, sensitivity indices.

#[path = "sweep/gantry.rs"]
mod gantry;
#[path = "sweep/lanes.rs"]
mod lanes;

use crate::common;
use taut::case::{Case, Sampling};
use taut::machine::Machine;
use taut::metrics::{Extras, Meter};
use taut::solve::{Bench, Flow, Solver, stream_observed};
use taut::sweep::{DIMENSIONS, Ranked, Sobol, Spread, Status, Sweep, indices};
use taut::trajectory::Trajectory;

const TABLE4: &str = include_str!("../stages/sollmann-jouaneh/table4.toml");

fn sweep(changes: &[&str]) -> Sweep {
    let case = Case::from_text_with("table4.toml", TABLE4, changes).unwrap_or_else(|error| panic!("{error}"));
    Sweep::new(&case).unwrap_or_else(|error| panic!("{error}"))
}

fn rows(sweep: &Sweep, first: u64, count: usize) -> Trajectory {
    sweep.rows(first, count, &|| false).expect("nobody stops it")
}

/// The axis of a run.
fn machine(sweep: &Sweep, run: u64) -> Machine {
    sweep.machine(run)
}

/// The bits of every number.
fn bits(table: &Trajectory) -> Vec<Vec<u64>> {
    table.columns.iter().map(|column| column.values.iter().map(|value| value.to_bits()).collect()).collect()
}

#[test]
fn rows_are_the_same_however_they_are_split() {
    for design in ["random", "latin-hypercube", "sobol"] {
        for indices in ["false", "true"] {
            let design = format!("sweep.design={design}");
            let indices = format!("sweep.indices={indices}");
            let sweep = sweep(&[&design, &indices, "sweep.runs=60", "sweep.vary.all=20 %"]);
            assert_eq!(sweep.parameters().len(), 16);
            let whole = rows(&sweep, 0, 24);
            assert_eq!(whole.len(), 24);
            let mut pieces = Trajectory::default();
            // Backwards, and by a copy: nothing is remembered from one piece to the next.
            let parts: Vec<Trajectory> =
                [(17, 7), (4, 13), (0, 4)].map(|(first, count)| rows(&sweep, first, count)).into();
            parts.iter().rev().for_each(|part| pieces.append(part));
            assert_eq!(bits(&whole), bits(&pieces), "{design} {indices}");
            let mut inputs = whole.clone();
            inputs.columns.truncate(sweep.inputs());
            assert_eq!(bits(&inputs), bits(&sweep.values(0, 24)));
        }
    }
}

#[test]
fn figures_that_are_asked_for_are_those_of_all() {
    let changes = ["sweep.design=sobol", "sweep.runs=24", "sweep.vary.all=20 %"];
    let all = rows(&sweep(&changes), 0, 24);
    for names in [&["final_cart_position"][..], &["stop_time"], &["steady_speed", "peak_span1_force"]] {
        let figures = format!("sweep.figures={names:?}");
        let some = rows(&sweep(&[&changes[..], &[&figures]].concat()), 0, 24);
        let of_experiments = some.columns.iter().skip(17).map(|column| column.name.split_once('.').unwrap().1);
        let wanted: Vec<&str> = std::iter::once("status").chain(names.iter().copied()).collect();
        assert_eq!(of_experiments.collect::<Vec<_>>(), [wanted.clone(), wanted].concat());
        for column in &some.columns {
            for (own, other) in column.values.iter().zip(all.get(&column.name).unwrap()) {
                // A peak may be found along another way, to rounding; what is known at the end is the same to the bit.
                let near = if column.name.contains("peak") { 2e-12 * other.abs() } else { 0.0 };
                assert!((own - other).abs() <= near, "{}: {own} {other}", column.name);
            }
        }
    }
}

#[test]
fn what_lies_beyond_the_last_run_is_left_out() {
    let sweep = sweep(&["sweep.runs=10", "sweep.vary.\"cart.mass\"=5 %"]);
    assert_eq!((sweep.values(8, 5).len(), sweep.values(10, 5).len(), sweep.values(u64::MAX, 5).len()), (2, 0, 0));
    assert!(sweep.rows(0, 10, &|| true).is_none());
}

#[test]
fn a_grid_is_every_value_with_every_other() {
    let plan = [
        "sweep.design=grid",
        "sweep.vary.\"cart.mass\"=values(0.3 kg, 0.4 kg)",
        "sweep.vary.\"motor.resistance\"=grid(0.5 ohm, 1 ohm, 3)",
    ];
    let sweep = sweep(&plan);
    assert_eq!((sweep.runs(), sweep.sampling()), (6, Sampling::Grid));
    let table = sweep.values(0, 10);
    assert_eq!(table.columns[1].values, [0.3, 0.3, 0.3, 0.4, 0.4, 0.4]);
    assert_eq!(table.columns[2].values, [0.5, 0.75, 1.0, 0.5, 0.75, 1.0]);
}

#[test]
fn one_at_a_time_leaves_all_others_as_they_are() {
    let sweep = sweep(&["sweep.design=one-at-a-time", "sweep.vary.all=factors(2, 0.5)"]);
    assert_eq!(sweep.runs(), 33);
    let nominal = common::table4();
    assert_eq!(machine(&sweep, 0), nominal);
    let mut doubled = nominal.clone();
    doubled.drives[0].motor.torque_constant *= 2.0;
    assert_eq!(machine(&sweep, 1), doubled);
    let mut halved = nominal;
    halved.drives[0].motor.torque_constant *= 0.5;
    assert_eq!(machine(&sweep, 2), halved);
}

#[test]
fn breakaway_goes_along_with_coulomb_friction() {
    let sweep = sweep(&["sweep.runs=50", "sweep.vary.all=50 %"]);
    for run in 0..50 {
        let stage = machine(&sweep, run);
        for law in [stage.drive_pulley.friction, stage.cart.friction, stage.idler_pulley.friction] {
            assert!(law.forward == law.backward && law.forward.breakaway == law.forward.coulomb);
        }
    }
}

/// Every part of a Latin hypercube's distribution is met once; and shares of a density lie where its quantiles are.
#[test]
fn distributions_have_their_quantiles() {
    let plan = [
        "sweep.runs=4000",
        "sweep.design=latin-hypercube",
        "sweep.vary.\"cart.mass\"=uniform(0.3 kg, 0.5 kg)",
        "sweep.vary.\"motor.resistance\"=normal(0.7 ohm, 0.05 ohm)",
        "sweep.vary.\"drive_pulley.inertia\"=log-normal(6e-5 kg m^2, 0.3)",
        "sweep.vary.\"cart.friction.viscous\"={ normal = [\"19 N s/m\", \"2 N s/m\"], within = [\"18 N s/m\", \"21 N s/m\"] }",
        "sweep.vary.\"cart.load\"=values(0 N, 1 N, 5 N, 2 N)",
    ];
    let sweep = sweep(&plan);
    let table = sweep.values(0, 4000);
    let sorted = |name: &str| {
        let mut values = table.get(name).unwrap().to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    // z of 5, 25, 50, 75 and 95 %.
    let shares =
        [(0.05, -1.644853626951), (0.25, -0.674489750196), (0.5, 0.0), (0.75, 0.674489750196), (0.95, 1.644853626951)];
    let (mass, resistance, inertia) = (sorted("cart.mass"), sorted("motor.resistance"), sorted("drive_pulley.inertia"));
    for (k, value) in mass.iter().enumerate() {
        let part = (value - 0.3) / 0.2 * 4000.0;
        assert!((k as f64 - 1e-6..=k as f64 + 1.0 + 1e-6).contains(&part), "{k}: {part}");
    }
    for (share, z) in shares {
        let place = (share * 4000.0) as usize;
        assert!((resistance[place] - (0.7 + 0.05 * z)).abs() < 2e-4, "{share}");
        assert!((inertia[place] / (6e-5 * f64::exp(0.3 * z)) - 1.0).abs() < 2e-3, "{share}");
    }
    // Φ((x − 19)/2) goes from Φ(−0.5) = 0.308538 to Φ(1) = 0.841345: half of it lies below Φ⁻¹(0.574941) = 0.188973.
    let viscous = sorted("cart.friction.viscous");
    assert!(viscous[0] >= 18.0 && viscous[3999] <= 21.0);
    assert!((viscous[2000] - (19.0 + 2.0 * 0.188973)).abs() < 2e-3, "{}", viscous[2000]);
    let load = table.get("cart.load").unwrap();
    for value in [0.0, 1.0, 5.0, 2.0] {
        assert_eq!(load.iter().filter(|load| **load == value).count(), 1000);
    }
}

#[test]
fn what_a_parameter_may_not_be_is_cut_off() {
    // The median of what is left of N(0.95, 0.05) below 1 is at Φ⁻¹(Φ(1)/2) = −0.199925.
    let plan =
        ["sweep.runs=2001", "sweep.design=latin-hypercube", "sweep.vary.\"motor.gear_efficiency\"=normal(0.95, 0.05)"];
    let case =
        Case::from_text_with("table4.toml", TABLE4, &[&plan[..], &["motor.gear_efficiency=0.95"]].concat()).unwrap();
    let mut values = Sweep::new(&case).unwrap().values(0, 2001).columns[1].values.clone();
    values.sort_by(f64::total_cmp);
    assert!(values[2000] <= 1.0 && values[2000] > 0.999);
    assert!((values[1000] - (0.95 - 0.05 * 0.199925)).abs() < 1e-4, "{}", values[1000]);
}

/// SciPy's own table of direction numbers: `authorities/sobol.py`.
#[test]
fn sobol_points_are_those_of_joe_and_kuo() {
    let text = include_str!("authorities/sobol.json");
    let authority: serde_json::Value = serde_json::from_str(text).unwrap();
    let points = authority["points"].as_array().unwrap();
    assert!(points.len() >= 38);
    let sobol = Sobol::new(DIMENSIONS, 1);
    for point in points {
        let index = point[0].as_u64().unwrap();
        for (dimension, expected) in point[1].as_array().unwrap().iter().enumerate() {
            assert_eq!(
                sobol.plain(index, dimension) * 2f64.powi(32),
                expected.as_f64().unwrap(),
                "{index} {dimension}"
            );
        }
    }
}

#[test]
fn scrambled_points_stay_a_net() {
    let sobol = Sobol::new(DIMENSIONS, 5);
    for dimension in 0..DIMENSIONS {
        // Each of 256 intervals is met once by each 256 points that follow each other.
        for block in [0, 3] {
            let mut seen = [false; 256];
            for index in 256 * block..256 * (block + 1) {
                let place = (256.0 * sobol.coordinate(index, dimension)) as usize;
                assert!(!std::mem::replace(&mut seen[place], true), "{dimension}: {place}");
            }
        }
    }
    // The first two dimensions are a (0, m, 2)-net: every box of 2⁻ᵃ by 2⁻ᵇ, a + b = 8, holds one of 256 points.
    for a in 0..=8 {
        let (rows, columns) = (f64::from(1 << a), f64::from(1 << (8 - a)));
        let boxes: std::collections::HashSet<(u64, u64)> = (0..256)
            .map(|index| ((rows * sobol.coordinate(index, 0)) as u64, (columns * sobol.coordinate(index, 1)) as u64))
            .collect();
        assert_eq!(boxes.len(), 256, "{a}");
    }
    // Another seed, other points; the mean is that of the square, much nearer than chance would bring it.
    assert_ne!(Sobol::new(2, 6).coordinate(7, 1), sobol.coordinate(7, 1));
    let mean = (0..4096).map(|index| sobol.coordinate(index, 20)).sum::<f64>() / 4096.0;
    assert!((mean - 0.5).abs() < 2e-5, "{mean}");
}

/// T. Ishigami, T. Homma (1990): f = sin x₁ + 7 sin² x₂ + 0.1 x₃⁴ sin x₁ on (−π, π)³, whose indices are known.
#[test]
fn indices_of_ishigamis_function() {
    use std::f64::consts::PI;
    let f = |x: [f64; 3]| x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin();
    let sobol = Sobol::new(6, 3);
    let mut values = Vec::new();
    for block in 0..8192 {
        let point = |from: usize| std::array::from_fn(|j| PI * (2.0 * sobol.coordinate(block, from + j) - 1.0));
        let (a, b): ([f64; 3], [f64; 3]) = (point(0), point(3));
        values.extend([f(a), f(b)]);
        for j in 0..3 {
            let mut mixed = a;
            mixed[j] = b[j];
            values.push(f(mixed));
        }
    }
    let found = indices(&values, 3, 200, 1).unwrap();
    // V = a²/8 + b π⁴/5 + b² π⁸/18 + ½, V₁ = ½ (1 + b π⁴/5)², V₂ = a²/8, V₁₃ = b² π⁸ (1/18 − 1/50)
    let (a, b) = (7.0, 0.1);
    let variance = a * a / 8.0 + b * PI.powi(4) / 5.0 + b * b * PI.powi(8) / 18.0 + 0.5;
    let (v1, v2) = (0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2), a * a / 8.0);
    let v13 = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
    let expected = [(v1, v1 + v13), (v2, v2), (0.0, v13)].map(|(first, total)| [first / variance, total / variance]);
    for (index, expected) in found.iter().zip(expected) {
        for (estimate, expected) in [index.first, index.total].into_iter().zip(expected) {
            let [low, high] = estimate.interval;
            assert!((estimate.value - expected).abs() < 0.01, "{} against {expected}", estimate.value);
            assert!(low <= expected && expected <= high && high - low < 0.12, "{low} to {high}: {expected}");
        }
    }
    // A block with a failed run is left out; a constant has no indices.
    values[7] = f64::NAN;
    assert!((indices(&values, 3, 10, 1).unwrap()[0].first.value - expected[0][0]).abs() < 0.01);
    assert_eq!(indices(&[1.0; 50], 3, 10, 1), None);
}

/// The blocks of a sweep for indices: A, B, and A with one parameter after the other from B.
#[test]
fn blocks_for_indices_mix_two_samples() {
    for design in ["random", "latin-hypercube", "sobol"] {
        let design = format!("sweep.design={design}");
        let plan = [
            "sweep.runs=8",
            "sweep.indices=true",
            "sweep.vary.\"cart.mass\"=20 %",
            "sweep.vary.\"motor.resistance\"=20 %",
        ];
        let sweep = sweep(&[&plan[..], &[&design]].concat());
        assert_eq!(sweep.runs(), 32);
        let table = sweep.values(0, 32);
        let (mass, resistance) = (&table.columns[1].values, &table.columns[2].values);
        for block in (0..32).step_by(4) {
            let (a, b, ab1, ab2) = (block, block + 1, block + 2, block + 3);
            assert_eq!((mass[ab1], resistance[ab1]), (mass[b], resistance[a]));
            assert_eq!((mass[ab2], resistance[ab2]), (mass[a], resistance[b]));
            assert!(mass[a] != mass[b] && resistance[a] != resistance[b]);
        }
    }
}

/// A bench leaves out columns and rows that its meter does not need, and shares what it can: the figures are the same
/// to the last bit.
#[test]
fn a_bench_shows_what_a_stream_shows() {
    let mut bench = Bench::default();
    let (mut compared, mut least) = (0, 12);
    for file in [
        "sollmann-jouaneh/table4.toml",
        "laser-gantry/laser-gantry.toml",
        "printer-axis/printer-axis.toml",
        "emps/asymmetric.toml",
        "two-mass/two-mass.toml",
    ] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("stages").join(file);
        if !common::data::of_case(&path) {
            least -= 2;
            continue;
        }
        let case = Case::read(path).unwrap();
        for share in [0.0, 0.15] {
            let mut stage = case.machine.clone();
            stage.cart.mass *= 1.0 + share;
            bench.mount(&stage).unwrap();
            for experiment in &case.experiments {
                let (mut whole, mut short) = (Meter::new(&stage, experiment), Meter::new(&stage, experiment));
                let outcome = stream_observed(&stage, experiment, Solver::for_machine(&stage), &mut whole, &mut |_| {
                    Flow::Continue
                })
                .unwrap();
                let other = bench.observe(experiment, &mut short).unwrap();
                assert_eq!((&outcome.events, outcome.ending), (&other.events, other.ending), "{file}");
                let (whole, short) = (whole.finish(&outcome.events), short.finish(&other.events));
                assert_eq!(whole, short, "{file}: {}", experiment.name);
                compared += 1;
            }
        }
    }
    assert!(compared >= least, "{compared}");
}

/// NumPy's figures, from whole trajectories: `authorities/metrics.py`.
#[test]
fn figures_are_those_of_the_authority() {
    let text = include_str!("authorities/metrics.json");
    let sweeps: serde_json::Value = serde_json::from_str(text).unwrap();
    let mut compared = 0;
    for authority in sweeps.as_array().unwrap() {
        let mut changes =
            vec![format!("sweep.runs={}", authority["runs"]), format!("sweep.design={}", authority["design"])];
        for vary in authority["vary"].as_array().unwrap() {
            let (key, how) = vary.as_str().unwrap().split_once('=').unwrap();
            changes.push(format!("sweep.vary.\"{key}\"={how}"));
        }
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let file = format!("{}/{}", env!("CARGO_MANIFEST_DIR"), authority["case"].as_str().unwrap());
        let sweep = Sweep::new(&Case::read_with(file, &changes).unwrap()).unwrap();
        let table = rows(&sweep, 0, sweep.runs() as usize);
        for run in authority["figures"].as_array().unwrap() {
            let (experiment, row) = (run["experiment"].as_str().unwrap(), run["run"].as_u64().unwrap() as usize);
            let figures = run["figures"].as_object().unwrap();
            for figure in taut::metrics::figures(taut::machine::MachineKind::Axis, Extras::default()) {
                assert_ne!(figures.contains_key(&figure.name), figure.row.again_on_an_axis, "{}", figure.name);
            }
            for (name, expected) in figures {
                let value = table.get(&format!("{experiment}.{name}")).unwrap()[row];
                match expected.as_f64() {
                    Some(expected) => {
                        // A sweep keeps magnitudes of peaks.
                        let is_peak = name.starts_with("peak") && !name.ends_with("_time");
                        let expected = if is_peak { expected.abs() } else { expected };
                        // Peaks of the motion; the authority has those of dense rows, which miss their tops.
                        let near = match name {
                            _ if name == "peak_cart_speed_time" => 2e-3,
                            _ if name.starts_with("peak") => 2e-4 * expected.abs(),
                            _ => 1e-9 * expected.abs().max(1e-3),
                        };
                        assert!((value - expected).abs() <= near, "{name}: {value}, {expected}");
                        if is_peak {
                            assert!(value >= expected * (1.0 - 1e-9), "{name}: {value}, {expected}");
                        }
                    }
                    None => assert!(value.is_nan(), "{name}: {value}"),
                }
                compared += 1;
            }
        }
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn a_run_that_fails_is_a_row() {
    let machine = TABLE4.split("[[experiment]]").next().unwrap();
    let text = format!(
        "{machine}\n[travel]\nmin = \"-1 mm\"\nmax = \"70 mm\"\n\n[[experiment]]\nname = \"x\"\n\
         input = {{ pulse = \"6 V\", for = \"0.25 s\" }}\nuntil = \"1 s\"\nevery = \"1 ms\"\n"
    );
    let changes = ["sweep.runs=40", "sweep.vary.\"cart.friction.viscous\"=40 %"];
    let case = Case::from_text_with("travel.toml", &text, &changes).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let table = rows(&Sweep::new(&case).unwrap(), 0, 40);
    let (status, position) = (table.get("x.status").unwrap(), table.get("x.final_cart_position").unwrap());
    let left = status.iter().filter(|code| **code == Status::LeftTravel.code()).count();
    assert!(left > 3 && left < 37, "{left}");
    for (status, position) in status.iter().zip(position) {
        assert_eq!(position.is_nan(), *status != Status::Complete.code());
    }
}

#[test]
fn moves_in_closed_loop_are_swept_too() {
    let file = format!("{}/stages/sollmann-jouaneh/controllers/pid.toml", env!("CARGO_MANIFEST_DIR"));
    let case = Case::read_with(file, &["sweep.runs=4", "sweep.vary.\"cart.mass\"=20 %"]).unwrap();
    let sweep = Sweep::new(&case).unwrap();
    assert!(sweep.groups()[0].is_move);
    let table = rows(&sweep, 0, 4);
    let name = sweep.groups()[0].file.clone();
    let errors = table.get(&format!("{name}.peak_cart_error")).unwrap();
    assert!(errors.iter().all(|error| error.is_finite() && *error != 0.0) && errors[0] != errors[1]);
    assert_eq!(bits(&table), bits(&rows(&sweep, 0, 4)));
}

/// Machines from a fit: from its standard errors, or from the draws of its posterior.
#[test]
fn machines_come_from_a_fit() {
    let folder = std::env::temp_dir().join(format!("taut-sweep-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let fitted = format!(
        "{TABLE4}\n[fit]\nfree = [\"cart.mass\", \"cart.friction.coulomb\"]\n\n[uncertainty]\n\
         \"cart.mass\" = {{ value = 0.362, error = 0.01, low = 0.34, high = 0.38 }}\n\
         \"cart.friction.coulomb\" = {{ value = 0.2, known = \"not determined\" }}\n"
    );
    let path = folder.join("fitted.toml");
    std::fs::write(&path, &fitted).unwrap();
    std::fs::write(
        folder.join("posterior.csv"),
        "cart.mass_kg,cart.friction.coulomb_N\n0.35,0.19\n0.36,0.2\n0.37,0.22\n",
    )
    .unwrap();

    let case = Case::read_with(
        &path,
        &["sweep.runs=7", "sweep.from=posterior.csv", "sweep.vary.\"cart.load\"=uniform(0 N, 1 N)"],
    )
    .unwrap();
    let drawn = Sweep::new(&case).unwrap();
    let table = drawn.values(0, 7);
    let pairs: Vec<(f64, f64)> =
        table.columns[1].values.iter().copied().zip(table.columns[2].values.iter().copied()).collect();
    for round in pairs[..6].chunks(3) {
        let mut round = round.to_vec();
        round.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert_eq!(round, [(0.35, 0.19), (0.36, 0.2), (0.37, 0.22)]);
    }
    let machine = machine(&drawn, 2);
    assert_eq!((machine.cart.mass, machine.cart.friction.forward.breakaway), pairs[2]);

    let error = Sweep::new(&Case::read_with(&path, &["sweep.runs=7", "sweep.from=uncertainty"]).unwrap()).unwrap_err();
    assert!(error.to_string().contains("does not determine `cart.friction.coulomb`"), "{error}");
    let changes = [
        "sweep.runs=1000",
        "sweep.design=sobol",
        "sweep.from=uncertainty",
        "sweep.vary.\"cart.friction.coulomb\"=10 %",
    ];
    let sweep = Sweep::new(&Case::read_with(&path, &changes).unwrap()).unwrap();
    let masses = sweep.values(0, 1000).get("cart.mass").unwrap().to_vec();
    let spread = Spread::new(&masses).unwrap();
    assert!((spread.mean - 0.362).abs() < 1e-4 && (spread.deviation - 0.01).abs() < 2e-4);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn plans_that_exclude_themselves_are_told() {
    let told = |changes: &[&str]| {
        let case = Case::from_text_with("table4.toml", TABLE4, changes);
        case.and_then(|case| Sweep::new(&case)).unwrap_err().to_string()
    };
    let both = ["sweep.runs=9", "sweep.vary.\"belt.stiffness\"=20 %", "sweep.vary.\"belt.stiffness.0\"=20 %"];
    assert!(told(&both).contains("set the same number"));
    assert!(told(&["sweep.runs=9", "sweep.vary.\"cart.load\"=20 %"]).contains("`cart.load` is 0"));
    assert!(told(&["sweep.runs=9", "sweep.vary.\"cart.mass\"=values(1 kg, 0 kg)"]).contains("above zero"));
    let narrow = "sweep.vary.\"cart.mass\"={ normal = [\"1 kg\", \"1 g\"], within = [\"2 kg\", \"3 kg\"] }";
    assert!(told(&["sweep.runs=9", narrow]).contains("outside the allowed range"));
    let none = Sweep::new(&Case::from_text("table4.toml", TABLE4).unwrap()).unwrap_err();
    assert!(none.to_string().contains("no parameters to vary"));
}

#[test]
fn statistics_of_a_column() {
    let values: Vec<f64> = (0..=100).map(f64::from).chain([f64::NAN]).collect();
    let spread = Spread::new(&values).unwrap();
    assert_eq!(
        (spread.count, spread.missing, spread.mean, spread.quantiles),
        (101, 1, 50.0, [0.0, 5.0, 50.0, 95.0, 100.0])
    );
    assert_eq!(spread.counts.iter().sum::<usize>(), 101);
    assert_eq!(Spread::new(&[f64::NAN]), None);
    let squares: Vec<f64> = values.iter().map(|value| value * value).collect();
    let rank_correlation = |x: &[f64], y: &[f64]| Ranked::new(x).correlation(&Ranked::new(y));
    assert!((rank_correlation(&values, &squares) - 1.0).abs() < 1e-12);
    let falling: Vec<f64> = values.iter().map(|value| (-value / 9.0).exp()).collect();
    assert!((rank_correlation(&values, &falling) + 1.0).abs() < 1e-12);
    assert_eq!(rank_correlation(&[1.0, 2.0], &[3.0, 3.0]), 0.0);
}

/// A column that is ranked once is ranked anew among the runs that another column has, too.
#[test]
fn rank_correlations_are_those_of_the_definition_where_values_are_equal_or_missing() {
    let sequence = Sobol::new(2, 7);
    let columns: Vec<[f64; 2]> = (0..200)
        .map(|run| {
            let [x, y] = [sequence.coordinate(run, 0), sequence.coordinate(run, 1)];
            // A dozen values, so that many are equal, and holes that differ.
            let missing = |is: bool, value: f64| if is { f64::NAN } else { (12.0 * value).floor() };
            [missing(run % 17 == 3, x), missing(run % 11 == 5, x + y * y)]
        })
        .collect();
    let [x, y] = [0, 1].map(|place| columns.iter().map(|pair| pair[place]).collect::<Vec<f64>>());
    let both: Vec<&[f64; 2]> = columns.iter().filter(|pair| pair.iter().all(|value| value.is_finite())).collect();
    // The rank: how many are less, and half of the others that are equal.
    let rank = |place: usize, of: f64| {
        let less = both.iter().filter(|pair| pair[place] < of).count() as f64;
        less + 0.5 * (both.iter().filter(|pair| pair[place] == of).count() as f64 - 1.0)
    };
    let mean = (both.len() as f64 - 1.0) / 2.0;
    let product =
        |a: usize, b: usize| both.iter().map(|pair| (rank(a, pair[a]) - mean) * (rank(b, pair[b]) - mean)).sum::<f64>();
    let expected = product(0, 1) / (product(0, 0) * product(1, 1)).sqrt();
    let (x, y) = (Ranked::new(&x), Ranked::new(&y));
    assert!(expected > 0.3 && both.len() < 175, "{expected} of {}", both.len());
    assert_eq!([x.correlation(&y), y.correlation(&x)].map(|is| (is - expected).abs() < 1e-14), [true; 2]);
    assert_eq!(x.correlation(&x), 1.0);
}
