use super::*;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A server on this machine that has these files, and how often it was asked.
fn server(files: Vec<(&'static str, Vec<u8>)>) -> (String, Arc<AtomicUsize>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let (address, asked) = (listener.local_addr().unwrap(), Arc::new(AtomicUsize::new(0)));
    let count = asked.clone();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut lines = BufReader::new(stream.try_clone().unwrap()).lines();
            let first = lines.next().unwrap().unwrap();
            while lines.next().is_some_and(|line| line.is_ok_and(|line| !line.is_empty())) {}
            count.fetch_add(1, Ordering::SeqCst);
            let path = first.split(' ').nth(1).unwrap_or_default();
            let answer = files.iter().find(|(name, _)| *name == path);
            let status = if answer.is_some() { "200 OK" } else { "404 Not Found" };
            let body = answer.map_or(&b"nothing here"[..], |(_, body)| body);
            // `/cut` ends in the middle.
            let sent = if path == "/cut" { &body[..body.len() / 2] } else { body };
            let head = format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
            stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(sent)).unwrap();
        }
    });
    (format!("http://{address}"), asked)
}

/// A new, empty folder.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("taut-xtask-{}-{name}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// An archive with one file in a folder, stored or deflated.
fn archive(name: &str, content: &[u8], deflated: bool) -> Vec<u8> {
    let mut packed = content.to_vec();
    if deflated {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(content).unwrap();
        packed = encoder.finish().unwrap();
    }
    let method = if deflated { 8u16 } else { 0 };
    let two = |number: usize| (number as u16).to_le_bytes();
    let four = |number: usize| (number as u32).to_le_bytes();
    let common =
        [&[20, 0, 0, 0][..], &method.to_le_bytes(), &[0; 8], &four(packed.len()), &four(content.len())].concat();
    let local = [b"PK\x03\x04", &common[..], &two(name.len()), &two(3), name.as_bytes(), b"abc", &packed].concat();
    let entry = [b"PK\x01\x02\x14\x00", &common[..], &two(name.len()), &[0; 12], &four(0), name.as_bytes()].concat();
    let end = [b"PK\x05\x06", &[0; 4][..], &two(1), &two(1), &four(entry.len()), &four(local.len()), &two(6)].concat();
    [&local[..], &entry, &end, b"remark"].concat()
}

/// All files below a folder.
fn listed(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        match entry.path().is_dir() {
            true => names.extend(listed(&entry.path())),
            false => names.push(entry.file_name().into_string().unwrap()),
        }
    }
    names
}

#[test]
fn the_files_of_a_server_are_downloaded_once() {
    let content = b"time,x\n0,1\n".to_vec();
    let zip = archive("Some Folder/inner.csv", &content.repeat(100), true);
    let (url, asked) = server(vec![("/a.csv", content.clone()), ("/b.zip", zip)]);
    let (a, b, sums) = (format!("{url}/a.csv"), format!("{url}/b.zip"), [sum(&content), sum(&content.repeat(100))]);
    let files = [
        File { path: "one/a.csv", sha256: &sums[0], url: &a, member: None },
        File { path: "two/b.csv", sha256: &sums[1], url: &b, member: Some("inner.csv") },
    ];
    let to = folder("download");
    fill(&to, &files, None).unwrap();
    assert_eq!(fs::read(to.join("one/a.csv")).unwrap(), content);
    assert_eq!(fs::read(to.join("two/b.csv")).unwrap(), content.repeat(100));
    assert_eq!(asked.load(Ordering::SeqCst), 2);
    fill(&to, &files, None).unwrap();
    assert_eq!(asked.load(Ordering::SeqCst), 2, "what is there is not fetched again");
    // A file that somebody changed is fetched again, that one alone.
    fs::write(to.join("one/a.csv"), "changed").unwrap();
    fill(&to, &files, None).unwrap();
    assert_eq!((fs::read(to.join("one/a.csv")).unwrap(), asked.load(Ordering::SeqCst)), (content, 3));
    assert_eq!(listed(&to).len(), 2);
}

/// A page that says that there is nothing, half a file and another file are no data; what was there stays.
#[test]
fn what_is_not_the_file_is_named_and_not_kept() {
    let (url, _) =
        server(vec![("/other.csv", b"other".to_vec()), ("/cut", b"0123456789".to_vec()), ("/no.zip", vec![1; 9])]);
    let want = sum(b"wanted");
    let [other, cut, gone, zip] = ["other.csv", "cut", "gone", "no.zip"].map(|name| format!("{url}/{name}"));
    let of = |path, url| File { path, sha256: &want, url, member: None };
    let files = [
        of("other.csv", &other),
        of("cut.csv", &cut),
        of("gone.csv", &gone),
        File { member: Some("x"), ..of("x", &zip) },
    ];
    let to = folder("wrong");
    let told = fill(&to, &files, None).unwrap_err();
    for part in [
        &*format!(
            "data/other.csv: {other} is another file: its SHA-256 is {}, not {want}; it was not kept",
            sum(b"other")
        ),
        &format!("data/cut.csv: {cut} cannot be had"),
        &format!("data/gone.csv: {gone} cannot be had"),
        "fetch it by other means into DIR/gone.csv and say `cargo xtask data --from DIR`",
        &format!("data/x: {zip}: this is no whole ZIP archive"),
    ] {
        assert!(told.contains(part), "{part}\nis not in\n{told}");
    }
    assert!(listed(&to).is_empty(), "{:?}", listed(&to));
}

#[test]
fn a_folder_is_copied_from_and_checked() {
    let (from, to, want) = (folder("from"), folder("to"), sum(b"wanted"));
    fs::create_dir_all(from.join("a")).unwrap();
    fs::write(from.join("a/right.csv"), "wanted").unwrap();
    fs::write(from.join("a/wrong.csv"), "something else").unwrap();
    let of = |path| File { path, sha256: &want, url: "no address", member: None };
    fill(&to, &[of("a/right.csv")], Some(&from)).unwrap();
    let told = fill(&to, &[of("a/right.csv"), of("a/wrong.csv"), of("a/none.csv")], Some(&from)).unwrap_err();
    let lines: Vec<&str> = told.lines().collect();
    assert!(lines.len() == 2 && lines[0].contains("wrong.csv is another file"), "{told}");
    assert!(lines[1].starts_with("data/a/none.csv: ") && lines[1].contains("cannot be read"), "{told}");
    assert_eq!(listed(&to), ["right.csv"]);
}

#[test]
fn archives_are_unpacked_whatever_their_method() {
    for deflated in [false, true] {
        let bytes = archive("deep/er/file.csv", b"1,2\n3,4\n", deflated);
        assert_eq!(zip::member(&bytes, "file.csv").unwrap(), b"1,2\n3,4\n");
        let told = zip::member(&bytes, "le.csv").unwrap_err();
        assert_eq!(told, "the archive holds no le.csv, but deep/er/file.csv");
        // No byte of it missing or changed makes a panic.
        for k in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[k] ^= 0xff;
            let _ = zip::member(&changed, "file.csv");
            let _ = zip::member(&bytes[..k], "file.csv");
        }
    }
}

#[test]
fn the_list_is_of_whole_sums_and_different_files() {
    for (k, file) in FILES.iter().enumerate() {
        assert!(file.sha256.len() == 64 && file.url.starts_with("https://"), "{}", file.path);
        assert!(FILES[..k].iter().all(|other| other.path != file.path && other.sha256 != file.sha256));
    }
    assert_eq!(sum(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
