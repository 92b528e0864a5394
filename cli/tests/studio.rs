//! The studio as a server: who is let in, what is refused or bounded, and how it ends. The page itself is tried in a
//! browser by `cargo xtask browser`.

use crate::common::{read, root};
use crate::studio_client::{Page, Studio, handshake};
use serde_json::{Value, json};
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::time::{Duration, Instant};

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";

fn status(answer: &str) -> u16 {
    answer.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0)
}

fn assert_protected(answer: &str) {
    for head in [
        "content-security-policy: default-src 'none'",
        "x-content-type-options: nosniff",
        "referrer-policy: no-referrer",
    ] {
        assert!(answer.contains(head), "no {head} in {answer}");
    }
}

#[test]
fn without_the_token_every_path_is_refused_with_a_page_that_says_where_the_address_is() {
    let studio = Studio::start(&[TABLE4]);
    let wrong = format!("/?token={}", "0".repeat(studio.token.len()));
    for path in ["/", "/index.html", "/main.js", "/report.css", "/nothing", "/socket", "/?token=", "/?token=x", &wrong]
    {
        let answer = studio.ask(&format!("GET {path}"), &[&studio.host()]);
        assert_eq!(status(&answer), 403, "{path}: {answer}");
        assert!(answer.contains("first line that <code>taut studio</code> printed"), "{answer}");
        assert!(!answer.contains(&studio.token));
        assert_protected(&answer);
    }
    let answer = studio.ask("POST /upload?name=a", &[&studio.host(), &studio.origin(), "Content-Length: 0"]);
    assert_eq!(status(&answer), 403);
    // The cookie of another server, or of none.
    let other = Studio::start(&[]);
    for cookie in [other.cookie(), format!("Cookie: taut-studio-{}=", studio.port), "Cookie: ;;=;".into()] {
        assert_eq!(status(&studio.ask("GET /", &[&studio.host(), &cookie])), 403, "{cookie}");
    }
}

#[test]
fn the_token_is_exchanged_for_a_cookie_with_the_port_in_its_name() {
    let studio = Studio::start(&[TABLE4]);
    let answer = studio.ask(&format!("GET /?token={}", studio.token), &[&studio.host()]);
    assert_eq!(status(&answer), 303);
    assert!(answer.contains("location: /\r\n"), "{answer}");
    let cookie = answer.lines().find(|line| line.starts_with("set-cookie")).unwrap();
    assert!(cookie.contains(&format!("taut-studio-{}=", studio.port)), "{cookie}");
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict") && !cookie.contains(&studio.token));
    assert_protected(&answer);
    let cookie = studio.cookie();
    for (path, wanted) in [("/", 200), ("/main.js", 200), ("/plot.js", 200), ("/nothing", 404)] {
        let answer = studio.ask(&format!("GET {path}"), &[&studio.host(), &cookie]);
        assert_eq!(status(&answer), wanted, "{path}");
        assert_protected(&answer);
    }
}

#[test]
fn other_names_and_other_pages_are_refused() {
    let studio = Studio::start(&[]);
    let (cookie, port) = (studio.cookie(), studio.port);
    let wrong_port = port.wrapping_add(1);
    for host in
        ["evil.example".into(), format!("evil.example:{port}"), "127.0.0.1".into(), format!("127.0.0.1:{wrong_port}")]
    {
        let answer = studio.ask("GET /", &[&format!("Host: {host}"), &cookie]);
        assert_eq!(status(&answer), 403, "{host}");
        // With the token, too: that is DNS rebinding.
        let answer = studio.ask(&format!("GET /?token={}", studio.token), &[&format!("Host: {host}")]);
        assert_eq!(status(&answer), 403, "{host}");
    }
    assert_eq!(status(&studio.ask("GET /", &[&cookie])), 403);
    for origin in ["http://evil.example", "null", "https://127.0.0.1", &format!("http://127.0.0.1:{wrong_port}")] {
        let origin = format!("Origin: {origin}");
        assert_eq!(status(&studio.ask("GET /", &[&studio.host(), &cookie, &origin])), 403, "{origin}");
        assert_eq!(handshake(&mut studio.connect(), &[&studio.host(), &cookie, &origin]), 403, "{origin}");
    }
    // A socket and a file without the word of a browser.
    assert_eq!(handshake(&mut studio.connect(), &[&studio.host(), &cookie]), 403);
    let lines = [&*studio.host(), &cookie, "Content-Length: 0"];
    assert_eq!(status(&studio.ask("POST /upload?name=a", &lines)), 403);
    let cross = [&*studio.host(), &cookie, &studio.origin(), "Sec-Fetch-Site: cross-site", "Content-Length: 0"];
    assert_eq!(status(&studio.ask("POST /upload?name=a", &cross)), 403);
}

#[test]
fn paths_lead_to_the_page_alone() {
    let studio = Studio::start(&[]);
    let cookie = studio.cookie();
    let paths = [
        "/../Cargo.toml",
        "/%2e%2e/Cargo.toml",
        "//etc/passwd",
        "/..%2f..%2fetc/passwd",
        "/main.js/../../x",
        "/main.js%00",
    ];
    for path in paths {
        assert_eq!(status(&studio.ask(&format!("GET {path}"), &[&studio.host(), &cookie])), 404, "{path}");
    }
    for first in ["DELETE /", "PUT /main.js", "POST /"] {
        let answer = studio.ask(first, &[&studio.host(), &cookie, &studio.origin(), "Content-Length: 0"]);
        assert_eq!(status(&answer), 405, "{first}");
    }
}

#[test]
fn a_file_that_a_page_sends_stays_in_its_folder_and_goes_with_the_server() {
    let mut studio = Studio::start(&[]);
    let cookie = studio.cookie();
    let mut stream = studio.connect();
    let head = format!(
        "POST /upload?name=../../../log.csv HTTP/1.1\r\n{}\r\n{}\r\n{cookie}\r\nContent-Length: 5\r\nConnection: close\r\n\r\n",
        studio.host(),
        studio.origin()
    );
    stream.write_all(head.as_bytes()).unwrap();
    stream.write_all(b"a,b\n1").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let path = answer.split("\"path\":\"").nth(1).unwrap().split('"').next().unwrap().to_string();
    assert!(path.ends_with("log.csv") && !path.contains(".."), "{path}");
    assert_eq!(fs::read_to_string(&path).unwrap(), "a,b\n1");
    terminate(&mut studio, "-TERM");
    assert!(!std::path::Path::new(&path).exists());
}

#[test]
fn a_body_beyond_the_bound_is_refused_before_it_is_read() {
    let studio = Studio::start(&[]);
    let lines = [&*studio.host(), &studio.cookie(), &studio.origin(), "Content-Length: 99999999999"];
    assert_eq!(status(&studio.ask("POST /upload?name=a", &lines)), 413);
    let fields = "X: y\r\n".repeat(20_000);
    let answer = studio.ask("GET /", &[&studio.host(), fields.trim_end()]);
    // Closed while the rest was on its way, the connection may take the answer with it.
    assert!(answer.is_empty() || status(&answer) == 431, "{answer}");
    assert_eq!(status(&studio.ask("GET /", &[&studio.host()])), 403);
}

/// Files were counted when they had come: twelve that were on their way had 741 MB in memory, of 512 promised.
#[test]
fn uploads_on_their_way_count_too() {
    let studio = Studio::start(&[]);
    let lines = [&*studio.host(), &studio.cookie(), &studio.origin()].join("\r\n");
    let begin = |length: usize| {
        let mut stream = studio.connect();
        write!(stream, "POST /upload?name=a HTTP/1.1\r\n{lines}\r\nContent-Length: {length}\r\n\r\nx").unwrap();
        stream
    };
    // Eight times 64 MB are all there is room for.
    let waiting: Vec<TcpStream> = (0..8).map(|_| begin(64 << 20)).collect();
    let small = || {
        let mut first = [0; 12];
        begin(1).read_exact(&mut first).unwrap();
        status(&String::from_utf8_lossy(&first))
    };
    let comes = |wanted: u16| {
        let begun = Instant::now();
        while small() != wanted {
            assert!(begun.elapsed() < Duration::from_secs(20), "no {wanted} comes");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    comes(413);
    drop(waiting);
    comes(200);
}

#[test]
fn a_slow_client_is_given_up() {
    let studio = Studio::start(&[]);
    let cookie = studio.cookie();
    let mut body = studio.connect();
    write!(
        body,
        "POST /upload?name=a HTTP/1.1\r\n{}\r\n{}\r\n{cookie}\r\nContent-Length: 10\r\n\r\nx",
        studio.host(),
        studio.origin()
    )
    .unwrap();
    let mut head = studio.connect();
    head.write_all(b"GET / HTTP/1.1\r\nHost:").unwrap();
    let begun = Instant::now();
    let mut answer = Vec::new();
    let _ = head.read_to_end(&mut answer);
    assert!(begun.elapsed() < Duration::from_secs(20), "half a head was waited for {:?}", begun.elapsed());
    let mut first = [0; 12];
    body.read_exact(&mut first).unwrap();
    assert_eq!(&first, b"HTTP/1.1 408");
}

#[test]
fn malformed_frames_end_one_socket_and_nothing_else() {
    let studio = Studio::start(&[]);
    let frames: [&[u8]; 6] = [
        &[0x81, 0x05, b'h', b'e', b'l', b'l', b'o'], // without a mask
        &[0x8f, 0x80, 0, 0, 0, 0],                   // of no known kind
        &[0xf1, 0x80, 0, 0, 0, 0],                   // with reserved bits
        &[0x81, 0xff, 0x7f, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0], // of 2^63 bytes
        &[0x82, 0x81, 0, 0, 0, 0, 7],                // binary
        &[0x81, 0x82, 0, 0, 0, 0, 0xff, 0xfe],       // not UTF-8
    ];
    for frame in frames {
        let mut page = studio.page();
        page.stream.write_all(frame).unwrap();
        while let Some((kind, _)) = page.frame() {
            assert_eq!(kind, 8, "{frame:x?} is answered");
        }
    }
    let mut page = studio.page();
    for (text, told) in [
        ("{", "this message is not JSON"),
        ("[1]", "no JSON object"),
        ("{\"id\": -1, \"do\": \"run\"}", "no `id`"),
        ("{\"id\": 1, \"do\": \"fly\"}", "nothing called \"fly\""),
        ("{\"id\": 1, \"do\": \"run\"}", "has no text `text`"),
        ("{\"id\": 1, \"do\": \"run\", \"text\": \"\\u0000\"}", "zero byte"),
        ("{\"id\": 1, \"do\": \"section\", \"text\": \"\"}", "empty"),
    ] {
        page.send_text(text);
        let (head, _) = page.answer().unwrap();
        let what = head["error"]["what"].as_str().unwrap_or_default();
        assert!(what.contains(told), "{text}: {head}");
    }
    assert!(page.result("open", json!({}))["text"].is_string());
}

#[test]
fn a_run_has_the_json_of_the_command_and_its_columns() {
    let studio = Studio::start(&[TABLE4]);
    let mut page = studio.page();
    let opened = page.result("open", json!({}));
    assert_eq!(opened["text"].as_str().unwrap(), read(TABLE4));
    page.ask("run", json!({ "text": opened["text"], "set": [["cart.mass", 0.5]], "describe": true }));
    let (head, columns) = page.answer().unwrap();
    assert!(head["text"].as_str().unwrap().contains("mass     = \"0.5 kg\""));
    assert_eq!(columns[0].len(), 1001);
    let command = Command::new(env!("CARGO_BIN_EXE_taut"))
        .current_dir(root())
        .args(["simulate", TABLE4, "--set", "cart.mass=0.5 kg", "--experiment", "5 V pulse", "--json"])
        .output()
        .unwrap();
    let wanted: Value = serde_json::from_slice(&command.stdout).unwrap();
    assert_eq!(head["result"], wanted);
    let mass = head["parameters"].as_array().unwrap().iter().find(|one| one["key"] == "cart.mass").unwrap();
    assert_eq!((&mass["value"], &mass["unit"], &mass["written"]), (&json!(0.5), &json!("kg"), &json!("0.5 kg")));
    // What is wrong has its line.
    let wrong = read(TABLE4).replace("mass     =", "masss    =");
    let error = page.result("run", json!({ "text": wrong }))["error"].clone();
    assert_eq!((&error["line"], &error["column"]), (&json!(24), &json!(1)), "{error}");
    assert_eq!(error["next"], "did you mean `mass`?");
}

/// A refused value was blamed on a line of the text: the position was that within the change.
#[test]
fn a_refused_change_names_its_key_and_no_line() {
    let studio = Studio::start(&[TABLE4]);
    let mut page = studio.page();
    for (value, what) in [
        (json!(-1), "cart.mass: -1 kg has to be above zero"),
        (json!("3 mm"), "cart.mass: \"3 mm\" is a length (m); expected a mass (kg)"),
        (json!("heavy"), "cart.mass: \"heavy\" does not begin with a number"),
    ] {
        let error = page.result("run", json!({ "text": read(TABLE4), "set": [["cart.mass", value]] }))["error"].clone();
        assert_eq!(
            (&error["key"], &error["line"], &error["column"]),
            (&json!("cart.mass"), &Value::Null, &Value::Null)
        );
        assert_eq!(error["what"], what);
    }
    let body = json!({ "text": read(TABLE4), "set": [["cart.mass", "400 g"]], "describe": true });
    let head = page.result("run", body);
    let number = |key: &str| head["parameters"].as_array().unwrap().iter().find(|one| one["key"] == key).unwrap();
    assert_eq!((&number("cart.mass")["value"], &number("cart.mass")["written"]), (&json!(0.4), &json!("400 g")));
    let spans = ["belt.stiffness.1", "cart.mass"].map(|key| &number(key)["span"]);
    assert_eq!(spans, [&json!("span 2, cart to idler"), &Value::Null]);
}

#[test]
fn a_section_goes_through_the_rows_of_the_run() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    let cases = [
        "stages/sollmann-jouaneh/table4.toml",
        "stages/h-frame/h-frame.toml",
        "stages/dual-belt/dual-belt.toml",
        "stages/printer-axis/printer-axis.toml",
        "stages/laser-gantry/laser-gantry.toml",
        "stages/stepper-axis/stepper-axis.toml",
        "stages/printer-core-xy/printer.toml",
    ];
    for case in cases {
        page.ask("run", json!({ "text": read(case) }));
        let (run, rows) = page.answer().unwrap();
        let last = rows[0].len() / 2;
        let first = last / 2;
        let points = 2 * (last - first) + 1;
        let body = json!({ "text": read(case), "from": rows[0][first], "to": rows[0][last], "points": points });
        page.ask("section", body);
        let (section, fine) = page.answer().unwrap();
        assert_eq!(fine.first().map(Vec::len), Some(points), "{case}: {section}");
        for (k, column) in run["columns"].as_array().unwrap().iter().enumerate() {
            let name = column["name"].as_str().unwrap();
            let size = rows[k].iter().fold(0.0_f64, |size, value| size.max(value.abs()));
            for row in first..=last {
                let (a, b) = (rows[k][row], fine[k][2 * (row - first)]);
                assert!((a - b).abs() <= 1e-7 * size, "{case}: {name} at {}: {a} and {b}", rows[0][row]);
            }
        }
    }
}

#[test]
fn the_newest_of_what_waits_is_done_and_each_request_is_answered() {
    let studio = Studio::start(&[]);
    let mut page = studio.page();
    let case = read(TABLE4);
    for k in 1..=100 {
        page.ask("run", json!({ "text": case, "set": [["cart.mass", 0.01 * f64::from(k)]] }));
    }
    let (mut open, mut last) = (100, Value::Null);
    while open > 0 {
        let (head, _) = page.answer().unwrap();
        open -= 1;
        if head["id"] == 100 {
            last = head;
        }
    }
    assert!(last["text"].as_str().unwrap().contains("mass     = \"1 kg\""), "{last}");
}

/// Work of a page that was closed went on, and kept the threads from the others.
#[test]
fn the_work_of_a_closed_page_stops() {
    let studio = Studio::start(&[]);
    let long =
        read(TABLE4).replace("{ pulse = \"5 V\", for = \"0.25 s\" }", "{ sine = \"5 V\", frequency = \"50 Hz\" }");
    let long = long.replace("until = \"1 s\"", "until = \"1e7 s\"").replace("every = \"1 ms\"", "every = \"0.1 s\"");
    for _ in 0..10 {
        let mut page = studio.page();
        page.ask("run", json!({ "text": long }));
        std::thread::sleep(Duration::from_millis(20));
    }
    let begun = Instant::now();
    let mut page = studio.page();
    assert!(page.result("run", json!({ "text": read(TABLE4) }))["error"].is_null());
    assert!(begun.elapsed() < Duration::from_secs(8), "the threads were free after {:?}", begun.elapsed());
}

#[test]
fn a_thousand_connections_are_bounded_and_the_server_answers_after_them() {
    let studio = Studio::start(&[]);
    let mut open = Vec::new();
    let mut pages = 0;
    let lines = [studio.host(), studio.origin(), studio.cookie()];
    for _ in 0..140 {
        let mut stream = studio.connect();
        if handshake(&mut stream, &lines.each_ref().map(String::as_str)) == 101 {
            pages += 1;
        }
        open.push(stream);
    }
    assert_eq!(pages, 128);
    // As many as this process may have, up to a thousand.
    while open.len() < 1000 {
        let Ok(stream) = TcpStream::connect(("127.0.0.1", studio.port)) else { break };
        open.push(stream);
    }
    assert!(open.len() > 700, "{} connections", open.len());
    drop(open);
    let begun = Instant::now();
    while status(&studio.ask("GET /", &[&studio.host(), &lines[2]])) != 200 {
        assert!(begun.elapsed() < Duration::from_secs(10), "no answer after the flood");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Asks the server to end by a signal; how long it took, and its exit status.
fn terminate(studio: &mut Studio, signal: &str) -> (Duration, Option<i32>) {
    let begun = Instant::now();
    let asked = Command::new("kill").args([signal, &studio.child.id().to_string()]).status().unwrap();
    assert!(asked.success());
    let status = studio.child.wait().unwrap();
    (begun.elapsed(), status.code())
}

#[test]
fn it_ends_within_two_seconds_with_sockets_open_and_work_under_way() {
    // Ctrl-C, and what service managers send.
    for signal in ["-INT", "-TERM"] {
        let mut studio = Studio::start(&[TABLE4]);
        let mut pages: Vec<Page> = (0..5).map(|_| studio.page()).collect();
        let long = read(TABLE4).replace("until = \"1 s\"", "until = \"1e7 s\"");
        for page in &mut pages {
            page.ask("run", json!({ "text": long }));
        }
        let half = studio.connect();
        std::thread::sleep(Duration::from_millis(100));
        let (took, status) = terminate(&mut studio, signal);
        assert!(took < Duration::from_secs(2), "{signal}: it took {took:?}");
        assert_eq!(status, Some(0), "{signal}");
        drop(half);
    }
}

#[test]
fn the_case_is_saved_whole_and_never_over_what_somebody_else_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("axis.toml");
    fs::write(&path, read(TABLE4)).unwrap();
    let studio = Studio::start(&[path.to_str().unwrap()]);
    let mut page = studio.page();
    let heavier = read(TABLE4).replace("0.362 kg", "0.5 kg");
    assert!(page.result("save", json!({ "text": heavier }))["saved"].is_string());
    assert_eq!(fs::read_to_string(&path).unwrap(), heavier);
    fs::write(&path, "# mine\n").unwrap();
    let error = page.result("save", json!({ "text": heavier }))["error"].clone();
    let told = "this file was changed by something else since it was opened, and nothing was written";
    assert_eq!(error["what"], told);
    assert_eq!(fs::read_to_string(&path).unwrap(), "# mine\n");
    fs::remove_file(&path).unwrap();
    let error = page.result("save", json!({ "text": heavier }))["error"].clone();
    assert_eq!(error["what"], "this file is not there any more, and nothing was written");
    // Without a case there is no file to write.
    let error = Studio::start(&[]).page().result("save", json!({ "text": heavier }))["error"].clone();
    assert_eq!(error["what"], "no case was named on the command line, and the page writes no other file");
}

/// With `--no-open` a link's state was lost: the address that was printed did not hold it.
#[test]
fn a_link_is_opened_under_the_address_that_is_printed() {
    for link in ["#state=ab_c-d", "http://127.0.0.1:4711/#state=ab_c-d"] {
        let studio = Studio::start(&[link]);
        let (token, fragment) = studio.token.split_once('#').unwrap();
        assert_eq!((token.len(), fragment), (64, "state=ab_c-d"));
    }
    // An address without a state is none, and no file either.
    assert_eq!(Studio::start(&["http://127.0.0.1:4711/"]).token.len(), 64);
}

#[test]
fn what_cannot_be_served_is_told() {
    let run = |words: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_taut")).arg("studio").args(words).arg("--no-open").output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (status, told) = run(&["nowhere.toml"]);
    assert_eq!(status, Some(2));
    assert_eq!(
        told,
        "error: nowhere.toml: this case file cannot be read: there is no such file\n  next: check the path, or write a new case \
         with `taut init`\n"
    );
    let other = Studio::start(&[]);
    let (status, told) = run(&["--port", &other.port.to_string()]);
    assert_eq!(status, Some(2));
    assert!(told.starts_with(&format!("error: --port: port {} cannot be taken: ", other.port)), "{told}");
    assert!(told.ends_with("next: leave --port away for a free one, or name another\n"), "{told}");
}

/// Bytes of memory that a process has, where the system tells.
fn memory(id: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let kilobytes = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().strip_suffix(" kB")?;
    Some(1024 * kilobytes.parse::<u64>().ok()?)
}

/// Fifty pages drag at once while ten thousand requests come in; `TAUT_STUDIO_MINUTES=60` goes on for an hour, and
/// prints what memory it needs.
#[test]
fn fifty_pages_drag_at_once_and_memory_stays() {
    let studio = Studio::start(&[TABLE4]);
    let minutes = std::env::var("TAUT_STUDIO_MINUTES").ok().and_then(|minutes| minutes.parse::<f64>().ok());
    let until = minutes.map(|minutes| Instant::now() + Duration::from_secs_f64(60.0 * minutes));
    let case = read(TABLE4);
    let drag = |page: &mut Page, k: u32| {
        let mass = 0.1 + 0.001 * f64::from(k % 1000);
        let head = page.result("run", json!({ "text": case, "set": [["cart.mass", mass]] }));
        let rows = head["columns"][0]["rows"].as_u64();
        assert_eq!((rows, &head["error"]), (Some(1001), &Value::Null), "drag {k}");
    };
    let requests = |count: u32| {
        let (host, cookie) = (studio.host(), studio.cookie());
        let mut stream = studio.connect();
        for k in 0..count {
            stream.write_all(format!("GET /icon.svg HTTP/1.1\r\n{host}\r\n{cookie}\r\n\r\n").as_bytes()).unwrap();
            let mut answer = [0; 4096];
            let mut length = 0;
            while !answer[..length].ends_with(b"</svg>\n") {
                let more = stream.read(&mut answer[length..]).unwrap();
                assert!(more > 0, "request {k} has half an answer");
                length += more;
            }
            assert!(answer.starts_with(b"HTTP/1.1 200"));
        }
    };
    // Once, so that what stays for good is there.
    drag(&mut studio.page(), 0);
    let mut first = None;
    let mut rounds = 0;
    loop {
        std::thread::scope(|scope| {
            for _ in 0..50 {
                scope.spawn(|| {
                    let mut page = studio.page();
                    (0..if minutes.is_some() { 400 } else { 6 }).for_each(|k| drag(&mut page, k));
                });
            }
            (0..4).for_each(|_| drop(scope.spawn(|| requests(1250))));
        });
        rounds += 1;
        let now = memory(studio.child.id());
        if let (Some(now), Some(_)) = (now, until) {
            println!("round {rounds}: {:.1} MB", now as f64 / 1e6);
        }
        let first = *first.get_or_insert(now);
        // What allocators keep is no leak: a tenth of it in a round would be.
        if let (Some(first), Some(now)) = (first, now) {
            assert!(now < first + (50 << 20), "memory grew from {first} to {now} bytes");
        }
        if until.is_none_or(|until| Instant::now() >= until) && rounds >= 2 {
            break;
        }
    }
}
