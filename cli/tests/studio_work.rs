//! The long works of a studio, asked for as its page asks: logs, fits, loops, shapers and sweeps.

use crate::common::read;
use crate::studio_client::{Page, Studio};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{Read, Write};

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";
const PID: &str = "stages/sollmann-jouaneh/controllers/pid.toml";

/// Sends a file; its path on the server.
fn send(studio: &Studio, name: &str, content: &str) -> String {
    let mut stream = studio.connect();
    write!(
        stream,
        "POST /upload?name={name} HTTP/1.1\r\n{}\r\n{}\r\n{}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{content}",
        studio.host(),
        studio.origin(),
        studio.cookie(),
        content.len()
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let body: Value = serde_json::from_str(answer.rsplit("\r\n\r\n").next().unwrap().trim()).unwrap();
    body["path"].as_str().unwrap().to_string()
}

/// Asks for a long work; the steps of its progress, and its answer.
fn long(page: &mut Page, act: &str, body: Value) -> (Vec<Value>, Value, Vec<Vec<f64>>) {
    let id = page.ask(act, body);
    let mut steps = Vec::new();
    loop {
        let (head, columns) = page.answer().unwrap();
        assert_eq!(head["id"], json!(id));
        match head.get("progress") {
            Some(step) => steps.push(step.clone()),
            None => return (steps, head, columns),
        }
    }
}

/// A log of the paper's stage as the program simulates it: 5 V for a quarter of a second, friction as in Table 4.
fn simulated(page: &mut Page) -> String {
    let id = page.ask("run", json!({ "text": read(TABLE4), "experiment": 0 }));
    let (head, columns) = page.answer().unwrap();
    assert_eq!(head["id"], json!(id));
    let column = |name: &str| {
        let names = head["columns"].as_array().unwrap();
        &columns[names.iter().position(|column| column["name"] == name).unwrap()]
    };
    let mut log = String::from("time_ms,volts,cart_position\n");
    for ((time, volts), x) in column("time").iter().zip(column("voltage")).zip(column("cart_position")) {
        let _ = writeln!(log, "{},{volts},{x}", 1e3 * time);
    }
    log
}

#[test]
fn a_log_is_looked_at_checked_and_fitted_and_gives_back_what_made_it() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    let path = send(&studio, "pulse.csv", &simulated(&mut page));
    let looked = page.result("columns", json!({ "path": path }));
    assert_eq!(looked["guess"]["columns"][0], json!({ "key": "time", "column": 0, "unit": "ms" }));
    let place =
        |key: &str| looked["guess"]["columns"].as_array().unwrap().iter().find(|one| one["key"] == key).cloned();
    assert_eq!(place("cart_position").unwrap()["column"], 2);
    assert_eq!(looked["rows"], 1001);
    let log = json!({ "file": path, "time": "time_ms", "input": "volts", "cart_position": "cart_position", "units": { "time": "ms" } });
    let asked = json!({
        "text": read(TABLE4),
        // Another machine than the one that made the log.
        "set": [["cart.friction.viscous", 12.0]],
        "logs": [{ "name": "pulse", "log": log }],
        "plan": { "free": ["cart.friction.viscous"] },
    });
    let (_, checked, _) = long(&mut page, "check", asked.clone());
    assert!(checked["html"].as_str().unwrap().contains("determined"), "{checked}");
    let (steps, fitted, _) = long(&mut page, "fit", asked);
    assert!(steps.iter().any(|step| step["parameters"][0]["name"] == "cart.friction.viscous"), "{steps:?}");
    assert_eq!(
        steps[0]["logs"][0]["time"].as_array().unwrap().len(),
        steps[0]["logs"][0]["model"].as_array().unwrap().len()
    );
    let value = fitted["result"]["parameters"][0]["value"].as_f64().unwrap();
    assert!((value / 19.0424 - 1.0).abs() < 2e-3, "{value}");
    let kept = fitted["kept"].as_str().unwrap();
    assert!(kept.contains("[uncertainty]") && kept.contains("5 V pulse") && !kept.contains("pulse.csv"), "{kept}");
}

#[test]
fn files_that_were_not_sent_are_not_looked_at() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    for path in ["/etc/passwd", "../../etc/passwd", TABLE4, "", "/nothing/there"] {
        for body in [("columns", json!({ "path": path })), ("shape", json!({ "paths": [path] }))] {
            let head = page.result(body.0, body.1);
            assert_eq!(head["error"]["what"], "this file was not sent by this page", "{path}");
        }
    }
}

#[test]
fn a_loop_has_its_margins_and_its_move_and_a_case_without_one_says_what_to_add() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    let id =
        page.ask("loop", json!({ "text": read(PID), "set": [["controller.pid.proportional", 2000.0]], "move": 1 }));
    let (head, columns) = page.answer().unwrap();
    assert_eq!((&head["id"], &head["move"]), (&json!(id), &json!(1)));
    assert_eq!(head["moves"][1]["name"], "long");
    assert!(head["text"].as_str().unwrap().contains("proportional = \"2 V/mm\""), "{}", head["text"]);
    assert_eq!(head["margins"]["stable"], true);
    assert_eq!(head["columns"].as_array().unwrap().len(), columns.len());
    assert!(columns.iter().all(|column| column.len() > 50));
    let head = page.result("loop", json!({ "text": read(TABLE4) }));
    assert_eq!(head["error"]["what"], "this case has no move and no controller to run it");
    let listed = page.result("controllers", json!({}));
    let one = &listed["controllers"][0];
    let changes =
        ["controller", "moves"].map(|key| format!("{}={}", key.trim_end_matches('s'), one[key].as_str().unwrap()));
    let head = page.result("loop", json!({ "text": read(TABLE4), "changes": changes }));
    assert_eq!(head["moves"].as_array().unwrap().len(), 3, "{head}");
}

#[test]
fn a_sweep_sends_its_rows_and_the_trajectories_of_chosen_runs() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    let plan = json!({ "design": "sobol", "runs": 64, "vary": { "cart.mass": "20 %", "belt.stiffness": "10 %" } });
    let (steps, head, columns) = long(&mut page, "sweep", json!({ "text": read(TABLE4), "plan": plan }));
    assert_eq!(steps[0]["runs"], 64);
    assert_eq!((head["done"].as_u64(), columns[0].len()), (Some(64), 64));
    assert!(columns[0].iter().enumerate().all(|(k, run)| *run == k as f64), "rows are not in order");
    let asked = json!({ "text": read(TABLE4), "plan": plan, "runs": [3, 5, 64, -1, "x"], "experiment": 0 });
    let id = page.ask("traces", asked);
    // A step of the sweep may come behind its result.
    let (head, columns) = std::iter::from_fn(|| page.answer()).find(|(head, _)| head["id"] == json!(id)).unwrap();
    let names: Vec<&str> = head["columns"].as_array().unwrap().iter().filter_map(|one| one["name"].as_str()).collect();
    assert!(names.contains(&"3:cart_position") && names.contains(&"5:time"), "{names:?}");
    assert!(names.iter().all(|name| name.starts_with("3:") || name.starts_with("5:")), "{names:?}");
    assert!(columns.iter().all(|column| (300..=400).contains(&column.len())));
    let plan = json!({ "design": "random", "runs": 20_001, "vary": { "cart.mass": "20 %" } });
    let head = page.result("sweep", json!({ "text": read(TABLE4), "plan": plan }));
    assert_eq!(
        head["error"]["text"],
        "20001 runs are too many for a page\n  allowed: up to 20000\n  next: use `taut sweep` for more"
    );
}

#[test]
fn a_long_work_that_is_stopped_keeps_what_there_is() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    let plan = json!({ "design": "random", "runs": 20_000, "vary": { "all": "20 %" } });
    let id = page.ask("sweep", json!({ "text": read(TABLE4), "plan": plan }));
    // Its first step, then the word.
    assert!(page.answer().unwrap().0.get("progress").is_some());
    let stop = page.ask("cancel", json!({ "of": id }));
    let head = loop {
        let (head, _) = page.answer().unwrap();
        if head["id"] == json!(id) && head.get("progress").is_none() {
            break head;
        }
        assert!(head["id"] == json!(stop) || head.get("progress").is_some(), "{head}");
    };
    assert_eq!(head["stopped"], true);
    assert!(head["done"].as_u64().unwrap() < 20_000);
}

#[test]
fn a_case_of_moves_alone_is_run_as_its_first_move() {
    let studio = Studio::start(&[PID]);
    let mut page = studio.page();
    let head = page.result("run", json!({ "text": read(PID), "describe": true }));
    assert_eq!(head["experiments"][0]["name"], "short fast", "{head}");
    let keys = head["parameters"].as_array().unwrap();
    assert!(keys.iter().any(|one| one["key"] == "controller.pid.proportional"));
}

/// One log that was not there blocked the whole page: other experiments, modes, loops.
#[test]
fn a_missing_log_blocks_only_what_needs_it() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    let gone = "\n[[experiment]]\nname = \"gone\"\nlog = { file = \"gone.csv\", time = \"t\", input = \"u\", cart_position = \"x\" }\n";
    let mine = format!("{}{gone}\n[fit]\nfree = [\"cart.friction.viscous\"]\n", read(TABLE4));
    let line = 1 + mine.lines().position(|line| line.contains("gone.csv")).unwrap();
    let whole = page.result("run", json!({ "text": read(TABLE4), "set": [["cart.mass", 0.5]] }));
    let run = page.result("run", json!({ "text": mine, "set": [["cart.mass", 0.5]] }));
    assert_eq!(run["experiments"], whole["experiments"]);
    assert_eq!(run["result"]["experiments"], whole["result"]["experiments"]);
    let notes = run["overview"]["notes"].to_string();
    assert!(notes.contains("gone") && notes.contains(&format!("line {line}")), "{notes}");
    assert_eq!(
        page.result("modes", json!({ "text": mine }))["result"],
        page.result("modes", json!({ "text": read(TABLE4) }))["result"]
    );
    let moved = format!("{}{gone}", read(PID));
    assert_eq!(
        page.result("loop", json!({ "text": moved }))["result"],
        page.result("loop", json!({ "text": read(PID) }))["result"]
    );
    for act in ["check", "fit"] {
        let (_, answer, _) = long(&mut page, act, json!({ "text": mine }));
        let error = &answer["error"];
        assert_eq!(error["line"], json!(line), "{act}: {answer}");
        assert!(error["what"].as_str().unwrap().contains("experiment \"gone\""), "{act}: {answer}");
    }
    // Where nothing else is to be run, the line is told, too.
    let alone = mine.split("[[experiment]]").next().unwrap().to_string() + gone;
    let line = 1 + alone.lines().position(|line| line.contains("gone.csv")).unwrap();
    let id = page.ask("run", json!({ "text": alone }));
    let (answer, _) = page.answer().unwrap();
    assert_eq!((answer["id"].clone(), answer["error"]["line"].clone()), (json!(id), json!(line)), "{answer}");
}
