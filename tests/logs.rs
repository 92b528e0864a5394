//! Logs of a machine, read by way of the case file.

use std::fs;
use std::path::{Path, PathBuf};
use taut::case::{Case, TEMPLATE};
use taut::log::{Log, Mapping, Quantity, Source};

/// The machine of the template with this experiment.
fn case_text(experiment: &str) -> String {
    let machine = &TEMPLATE[..TEMPLATE.find("[[experiment]]").unwrap()];
    format!("{machine}\n[[experiment]]\nname = \"run\"\n{experiment}\n")
}

/// A folder of its own for the test called `name`.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("logs-{name}"));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Reads a case whose log is this text in `log.csv`.
fn read(name: &str, text: &str, experiment: &str) -> Case {
    let folder = folder(name);
    fs::write(folder.join("log.csv"), text).unwrap();
    Case::from_text(folder.join("case.toml"), &case_text(experiment)).unwrap_or_else(|error| panic!("{error}"))
}

fn output(log: &Log, quantity: Quantity) -> &[f64] {
    &log.output(quantity).unwrap().values
}

#[test]
fn a_log_drives_its_experiment() {
    let text = "t,u,x,i\n0,5,0,0.1\n0.1,5,2.5,0.2\n0.2,0,5,0.3\n";
    let log = r#"log = { file = "log.csv", time = "t", input = "u", cart_position = "x", motor_current = "i", units = { cart_position = "mm" } }"#;
    let case = read("drives", text, log);
    let experiment = &case.experiments[0];
    assert_eq!((experiment.until, experiment.every), (0.2, 0.1));
    let log = experiment.log.as_ref().unwrap();
    assert_eq!((log.name.as_str(), &log.time, &log.inputs[0]), ("run", &vec![0.0, 0.1, 0.2], &vec![5.0, 5.0, 0.0]));
    assert_eq!(output(log, Quantity::CartPosition), [0.0, 2.5e-3, 5e-3]);
    assert_eq!(output(log, Quantity::MotorCurrent), [0.1, 0.2, 0.3]);
    assert_eq!(experiment.inputs[0].value(0.15), 5.0);
    assert_eq!(experiment.inputs[0].value(0.2), 0.0);
    assert_eq!(case.files.len(), 1);
}

/// A case in `tests/logs` with this log.
fn stored(log: &str) -> Result<Case, String> {
    let name = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/logs/case.toml");
    Case::from_text(name, &case_text(&format!("log = {{ {log} }}"))).map_err(|error| error.to_string())
}

/// The numbers that `authorities/log_files.py` put into its files.
fn expected(k: usize) -> [f64; 3] {
    let n = k as f64;
    [n / 1024.0, if k < 10 { 5.0 } else { 0.0 }, n * n / 1_048_576.0]
}

#[track_caller]
fn holds_the_samples(log: &str) {
    let case = stored(log).unwrap_or_else(|error| panic!("{error}"));
    let log = case.experiments[0].log.as_ref().unwrap();
    let x = output(log, Quantity::CartPosition);
    assert_eq!(log.len(), 20);
    for (k, x) in x.iter().enumerate() {
        assert_eq!([log.time[k], log.inputs[0][k], *x], expected(k), "{k}");
    }
}

/// The files are SciPy's.
#[test]
fn matlab_files_plain_compressed_and_of_every_type() {
    for file in ["columns", "rows", "types", "big-endian"] {
        holds_the_samples(&format!(r#"file = "{file}.mat", time = "t", input = "u", cart_position = "x""#));
    }
    for file in ["columns", "rows"] {
        holds_the_samples(&format!(
            r#"file = "{file}.mat", time = "data(:,1)", input = "data(:, 2)", cart_position = "data(:,3)""#
        ));
    }
    for (name, expected) in [("k8", 7.0), ("k64", 7.0), ("k32", 7.0), ("high", 0.0)] {
        let log = format!(r#"file = "types.mat", time = "t", input = "u", drive_angle = "{name}""#);
        let case = stored(&log).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(output(case.experiments[0].log.as_ref().unwrap(), Quantity::DriveAngle)[7], expected, "{name}");
    }
    let case =
        stored(r#"file = "rows.mat", time = "t", input = "u", cart_position = "x_missing", split = "run""#).unwrap();
    let names: Vec<&str> = case.experiments.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["run/1", "run/2"]);
    assert!(output(case.experiments[0].log.as_ref().unwrap(), Quantity::CartPosition)[7].is_nan());
    assert_eq!(case.experiments[1].log.as_ref().unwrap().time[1], 1.0 / 1024.0);
}

/// The files are PyArrow's.
#[cfg(feature = "parquet")]
#[test]
fn parquet_files_of_every_compression() {
    for file in ["snappy", "zstd", "gzip", "lz4", "none"] {
        holds_the_samples(&format!(r#"file = "{file}.parquet", time = "t", input = "u", cart_position = "x32""#));
    }
    let log = r#"file = "snappy.parquet", time = "stamp", input = 2, cart_position = "x", where = { column = "run", is = 1 }"#;
    let case = stored(log).unwrap_or_else(|error| panic!("{error}"));
    let log = case.experiments[0].log.as_ref().unwrap();
    assert_eq!(log.len(), 10);
    assert_eq!(log.time[3], 0.003);
    assert!(output(log, Quantity::CartPosition)[7].is_nan());
    assert_eq!(output(log, Quantity::CartPosition)[8], expected(8)[2]);
}

/// A file that one run writes is read as a log by the next.
#[cfg(feature = "parquet")]
#[test]
fn parquet_of_our_own_states_its_units() {
    use taut::trajectory::{Column, ParquetWriter, Trajectory};
    let path = folder("own").join("own.parquet");
    let mut rows =
        Trajectory { columns: vec![Column::new("time", "ms"), Column::new("voltage", "V"), Column::new("x", "mm")] };
    for (column, values) in rows.columns.iter_mut().zip([[0.0, 1.0], [5.0, 5.0], [0.0, 2.0]]) {
        column.values = values.to_vec();
    }
    let mut writer = ParquetWriter::create(&path).unwrap();
    writer.write(&rows).unwrap();
    writer.finish().unwrap();
    let text =
        case_text(r#"log = { file = "own.parquet", time = "time_ms", input = "voltage_V", cart_position = "x_mm" }"#);
    let case = Case::from_text(path.with_file_name("case.toml"), &text).unwrap_or_else(|error| panic!("{error}"));
    let log = case.experiments[0].log.as_ref().unwrap();
    assert_eq!((log.time[1], output(log, Quantity::CartPosition)[1]), (0.001, 0.002));
}

/// Files of CSV in all the ways that programs write them.
#[test]
fn csv_in_many_dialects() {
    let names = r#"time = "t", input = "u", cart_position = "x""#;
    let numbers = "time = 1, input = 2, cart_position = 3";
    let cases = [
        ("t,u,x\n0,5,0\n0.5,0,1\n", names),
        ("0,5,0\n0.5,0,1\n", numbers),
        ("0 5  0\n 0.5\t0 1\n", numbers),
        ("t;u;x\r\n0;5;0\r\n0,5;0;1\r\n", r#"decimal = ",", time = "t", input = "u", cart_position = "x""#),
        (
            "t u x\n0 5 0\n0,5 0 1,0\n",
            r#"decimal = ",", separator = "space", time = "t", input = "u", cart_position = "x""#,
        ),
        ("t,u,x\ns,V,m\n0,5,0\n0.5,0,1\n", names),
        ("t,u,x\n(ms),[V],mm\n0,5,0\n500,0,1000\n", names),
        ("t,u,x\nms,V,mm\n0,5,0\n500,0,1000\n", numbers),
        ("\u{feff}\"t\",\"u\",\"x\"\n\"0\",\"5\",\"0\"\n\"0.5\",\"0\",\"1\"\n", names),
        ("Model,TBS1102\nSerial,C012345\nt,u,x\n0,5,0\n0.5,0,1\n", names),
        ("# t u x\n0 5 0\n0.5 0 1\n", names),
        ("t,u,x,note\n0,5,0,\"start, of it\"\n0.5,0,1,\n", names),
    ];
    for (k, (text, log)) in cases.into_iter().enumerate() {
        let case = read(&format!("dialect-{k}"), text, &format!("log = {{ file = \"log.csv\", {log} }}"));
        let log = case.experiments[0].log.as_ref().unwrap();
        assert_eq!((&log.time[..], &log.inputs[0][..]), (&[0.0, 0.5][..], &[5.0, 0.0][..]), "{text:?}");
        assert_eq!(output(log, Quantity::CartPosition), [0.0, 1.0], "{text:?}");
    }
    let text = "time (ms),u [mV],enc,speed_rpm\n10,5000,0,60\n20,5000,512,NaN\n30,0,,30\n";
    let case = read(
        "units",
        text,
        r#"log = { file = "log.csv", time = "time (ms)", input = "u [mV]", drive_angle = "enc", drive_speed = "speed_rpm", units = { drive_angle = "count", drive_speed = "rpm" }, scale = { drive_angle = -1 }, offset = { drive_angle = "90 deg" } }"#,
    );
    let log = case.experiments[0].log.as_ref().unwrap();
    let counts = case.machine.encoder.unwrap().counts_per_unit(case.machine.drives[0].motor.gear_ratio);
    let angle = output(log, Quantity::DriveAngle);
    assert!((log.time[1] - 0.01).abs() < 1e-15 && log.inputs[0] == [5.0, 5.0, 0.0]);
    assert_eq!(angle[0], std::f64::consts::FRAC_PI_2);
    assert!((angle[1] - angle[0] + 512.0 / counts).abs() < 1e-12 && angle[2].is_nan());
    assert!((output(log, Quantity::DriveSpeed)[0] - std::f64::consts::TAU).abs() < 1e-12);
}

#[test]
fn windows_runs_and_missing_inputs() {
    let rows: String = (0..100).map(|k| format!("{},{},{},{}\n", 10.0 + k as f64 * 0.125, k, k * 2, k / 25)).collect();
    let text = format!("t,u,x,run\n{rows}");
    let mapped =
        |more: &str| format!(r#"log = {{ file = "log.csv", time = "t", input = "u", cart_position = "x"{more} }}"#);
    let log = |name: &str, more: &str| read(name, &text, &mapped(more)).experiments[0].log.clone().unwrap();

    let whole = log("whole", "");
    assert_eq!((whole.time[0], whole.time[99], whole.len()), (0.0, 12.375, 100));
    let part = log("part", r#", from = "11 s", to = "12 s""#);
    assert_eq!((part.time.first(), part.time.last(), part.inputs[0][0]), (Some(&0.0), Some(&1.0), 8.0));
    // A window that begins between two rows begins with the input that held then.
    let between = log("between", r#", from = "11.0625 s", to = "12 s""#);
    assert_eq!((&between.time[..2], &between.inputs[0][..2]), (&[0.0, 0.0625][..], &[8.0, 9.0][..]));
    assert!(output(&between, Quantity::CartPosition)[0].is_nan());
    let joined = log("joined", r#", from = "11.0625 s", to = "12 s", hold = "linear""#);
    assert_eq!(joined.inputs[0][..2], [8.5, 9.0]);

    let split = read("split", &text, &mapped(r#", split = "run", to = "1 s""#));
    let names: Vec<&str> = split.experiments.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["run/0", "run/1", "run/2", "run/3"]);
    let third = split.experiments[2].log.as_ref().unwrap();
    assert_eq!((third.time[0], third.inputs[0][0], third.len()), (0.0, 50.0, 9));
    assert_eq!(split.experiments[2].file_name(), "run-2");
    let some = read("some", &text, &mapped(r#", split = "run", where = { column = "run", is_not = [0, 3.0] }"#));
    assert_eq!(some.experiments.len(), 2);

    // With an input of the experiment's own, the clock may begin before the first row.
    let own = r#"input = { step = "5 V" }
log = { file = "log.csv", time = "t", cart_position = "x", from = "9.5 s" }"#;
    let own = read("own-input", &text, own);
    let log = own.experiments[0].log.as_ref().unwrap();
    assert_eq!((log.time[0], log.inputs[0][3]), (0.5, 5.0));

    let gaps = "t,u,x\n0,,\n1,5,0\n2,,NaN\n3,0,2\n";
    let held = mapped(r#", missing_input = "hold", from = 1"#);
    let log = read("held", gaps, &held).experiments[0].log.clone().unwrap();
    assert_eq!(log.inputs[0], [5.0, 5.0, 0.0]);
}

use crate::common;

/// Logs of three machines, with what their readme and their publications say of them.
#[test]
fn measured_data_of_others() {
    let files = ["pendulepi/february.csv", "emps/estimation.mat", "ced/DATAUNIF.csv", "ced/DATAPRBS.csv"];
    if common::data::data(files).is_none() {
        return;
    }
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let read = |experiment: &str| {
        let case = Case::from_text(data.join("case.toml"), &case_text(experiment));
        case.unwrap_or_else(|error| panic!("{error}")).experiments
    };
    let runs = read(
        r#"log = { file = "pendulepi/february.csv", time = "time_us", input = "pwm", cart_position = "position", units = { time = "us" }, scale = { input = "12/255" }, split = "pwm" }"#,
    );
    assert_eq!(runs.len(), 42);
    assert_eq!(runs.iter().map(|run| run.log.as_ref().unwrap().len()).sum::<usize>(), 19257);
    let run = runs.iter().find(|run| run.name == "run/-100").expect("a run at -100");
    let log = run.log.as_ref().unwrap();
    assert!((log.inputs[0][0] + 100.0 * 12.0 / 255.0).abs() < 1e-12);
    assert!((log.interval() - 5e-3).abs() < 1e-4);
    let x = output(log, Quantity::CartPosition);
    assert!((x[0] - x[x.len() - 1]).abs() > 0.4);

    let emps = read(r#"log = { file = "emps/estimation.mat", time = "t", input = "vir", cart_position = "qm" }"#);
    let log = emps[0].log.as_ref().unwrap();
    assert_eq!(log.len(), 24841);
    assert!((log.interval() - 1e-3).abs() < 1e-7);
    let x = output(log, Quantity::CartPosition);
    assert!(x.iter().all(|x| (-0.1..0.3).contains(x)));

    for (file, input, speed) in [("DATAUNIF", "u11", "z11"), ("DATAUNIF", "u12", "z12"), ("DATAPRBS", "u3", "z3")] {
        let ced = read(&format!(
            r#"log = {{ file = "ced/{file}.csv", time = {{ every = "20 ms" }}, input = "{input}", drive_speed = "{speed}", absolute = ["drive_speed"] }}"#
        ));
        let log = ced[0].log.as_ref().unwrap();
        assert!((500..=501).contains(&log.len()), "{}", log.len());
        assert!(log.outputs[0].absolute && (ced[0].until - 9.98).abs() < 0.03);
    }
}

/// Many bytes of a file wrong in turn, and many lengths of it: an answer each time, and no panic.
#[test]
fn damaged_files_are_told_or_read() {
    let folder = folder("damaged");
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/logs");
    let kinds: &[(&str, [&str; 3])] = &[
        ("columns.mat", ["t", "u", "data(:,3)"]),
        ("rows.mat", ["t", "u", "x"]),
        ("big-endian.mat", ["t", "u", "x"]),
        #[cfg(feature = "parquet")]
        ("none.parquet", ["t", "u", "x"]),
        #[cfg(feature = "parquet")]
        ("snappy.parquet", ["stamp", "u", "x32"]),
    ];
    for (file, columns) in kinds {
        let bytes = fs::read(stored.join(file)).unwrap();
        let path = folder.join(file);
        let [time, input, x] = *columns;
        let mut mapping = Mapping::new(&path, Source::column(time));
        mapping.fed_by(Source::column(input));
        mapping.outputs = vec![(Quantity::CartPosition, Source::column(x))];
        let mut told = 0;
        let mut try_out = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            told += usize::from(mapping.read().is_err());
        };
        let stride = (bytes.len() / 400).max(1);
        for at in (0..bytes.len()).step_by(stride) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << (at % 8);
            try_out(&damaged);
        }
        for length in (0..bytes.len()).step_by(5 * stride) {
            try_out(&bytes[..length]);
        }
        assert!(told > 80, "{file}: {told}");
    }
}

/// Content that Parquet can hold and a log cannot.
#[cfg(feature = "parquet")]
#[test]
fn parquet_files_that_are_no_logs() {
    let message = |file: &str, x: &str| {
        let error = stored(&format!(r#"file = "{file}", time = "t", input = "u", cart_position = "{x}""#)).unwrap_err();
        error.split_once("tests/logs/").map(|(_, rest)| rest.to_string()).unwrap_or(error)
    };
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/logs/case.toml");
    assert_eq!(
        message("snappy.parquet", "note").replace(&*case.to_string_lossy(), "CASE"),
        "snappy.parquet: column `note` holds text or another kind of bytes (experiment \"run\", CASE:75)\n  \
         allowed: whole or floating-point numbers, truth values, time stamps\n  \
         next: convert it to numbers before writing the file"
    );
    assert!(message("snappy.parquet", "lists.list.element").contains("holds lists"));
    assert!(message("snappy.parquet", "X").contains("did you mean `x`?"), "{}", message("snappy.parquet", "X"));
    let brotli = message("brotli.parquet", "x");
    assert!(brotli.contains("cannot be read") && brotli.contains("next: write it again"), "{brotli}");
}

/// The examples of `docs/logs.md`, each with the file that stands above it.
#[test]
fn the_examples_of_the_documents_read() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/logs.md");
    let text = fs::read_to_string(page).unwrap();
    let folder = folder("documents");
    let (mut csv, mut read) = ("", 0);
    for block in text.split("\n```").skip(1) {
        if let Some(rows) = block.strip_prefix("csv\n") {
            csv = rows;
        }
        let Some(example) = block.strip_prefix("toml\n") else { continue };
        let (_, file) = example.split_once("file = \"").unwrap();
        let file = file.split('"').next().unwrap();
        let mut example = example.to_string();
        if let Some(path) = file.strip_prefix("../data/") {
            let Some([path]) = common::data::data([path]) else { continue };
            example = example.replace(file, path.to_str().unwrap());
        } else {
            fs::write(folder.join(file), csv).unwrap();
        }
        let machine = &TEMPLATE[..TEMPLATE.find("[[experiment]]").unwrap()];
        let case = Case::from_text(folder.join("case.toml"), &format!("{machine}\n{example}"));
        let case = case.unwrap_or_else(|error| panic!("{error}"));
        assert!(case.experiments.iter().all(|experiment| experiment.log.is_some()));
        read += 1;
    }
    assert!(read >= 2);
}

/// The logs of three machines under `stages` are not part of the project: whoever fits them without has to be told how
/// to get them.
#[test]
fn a_log_that_is_not_there_says_what_fetches_it() {
    let of = |more: &str| {
        let log = format!("log = {{ file = \"no/such.csv\", {more}time = \"t\", input = \"u\", drive_angle = \"a\" }}");
        Case::from_text("case.toml", &case_text(&log)).unwrap_err().to_string()
    };
    for (more, next) in [
        ("", "check the path, which begins at the folder of the case file"),
        ("fetch = \"cargo xtask data\", ", "`cargo xtask data` fetches it"),
    ] {
        let told = of(more);
        let what = "a file of the experiment \"run\" cannot be read: no/such.csv: there is no such file";
        assert!(told.starts_with("case.toml:") && told.contains(what), "{told}");
        assert!(told.ends_with(&format!("next: {next}")), "{told}");
    }
    // A file that is there is not fetched, whatever is wrong with it.
    let file = folder("fetch").join("broken.csv");
    fs::write(&file, "t,u\n").unwrap();
    let log =
        format!("log = {{ file = {file:?}, fetch = \"make it\", time = \"t\", input = \"u\", drive_angle = \"a\" }}");
    let told = Case::from_text("case.toml", &case_text(&log)).unwrap_err().to_string();
    assert!(!told.contains("make it"), "{told}");
}
