//! A studio, and a page that asks it over a socket, as the page in a browser does.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A server that runs, and ends with the test.
pub struct Studio {
    pub child: Child,
    pub port: u16,
    pub token: String,
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Studio {
    pub fn start(words: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
        command.current_dir(crate::common::root());
        #[cfg(unix)]
        crate::faults::by_default(&mut command);
        let mut child = command.arg("studio").args(words).arg("--no-open").stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let rest = line.strip_prefix("http://127.0.0.1:").unwrap_or_else(|| panic!("the first line is {line}"));
        let (port, token) = rest.trim().split_once("/?token=").unwrap();
        Self { child, port: port.parse().unwrap(), token: token.to_string() }
    }

    /// Kills it.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        // Each request goes at once: a head comes in pieces.
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(45))).unwrap();
        stream
    }

    pub fn host(&self) -> String {
        format!("Host: 127.0.0.1:{}", self.port)
    }

    pub fn origin(&self) -> String {
        format!("Origin: http://127.0.0.1:{}", self.port)
    }

    /// The answer to a request with these lines of head.
    pub fn ask(&self, first: &str, lines: &[&str]) -> String {
        let mut stream = self.connect();
        // A head that is too long is refused while it is still on its way.
        let _ = write!(stream, "{first} HTTP/1.1\r\n{}\r\nConnection: close\r\n\r\n", lines.join("\r\n"));
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// The cookie that the token is exchanged for.
    pub fn cookie(&self) -> String {
        let answer = self.ask(&format!("GET /?token={}", self.token), &[&self.host()]);
        let cookie = answer.lines().find_map(|line| line.strip_prefix("set-cookie: ")).unwrap();
        format!("Cookie: {}", cookie.split(';').next().unwrap())
    }

    pub fn page(&self) -> Page {
        let mut stream = self.connect();
        let status = handshake(&mut stream, &[&self.host(), &self.origin(), &self.cookie()]);
        assert_eq!(status, 101);
        Page { stream, last: 0 }
    }
}

/// Asks for a socket; the status of the answer.
pub fn handshake(stream: &mut TcpStream, lines: &[&str]) -> u16 {
    write!(
        stream,
        "GET /socket HTTP/1.1\r\n{}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        lines.join("\r\n")
    )
    .unwrap();
    let mut head = Vec::new();
    let mut byte = [0];
    while !head.ends_with(b"\r\n\r\n") && stream.read(&mut byte).is_ok_and(|n| n == 1) {
        head.push(byte[0]);
    }
    String::from_utf8_lossy(&head).split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0)
}

/// A page's socket.
pub struct Page {
    pub stream: TcpStream,
    pub last: u64,
}

impl Page {
    /// Sends a masked text frame.
    pub fn send_text(&mut self, text: &str) {
        let mut frame = vec![0x81];
        match text.len() {
            n @ 0..126 => frame.push(0x80 | n as u8),
            n if n < 65536 => frame.extend([0x80 | 126, (n >> 8) as u8, n as u8]),
            n => {
                frame.push(0x80 | 127);
                frame.extend((n as u64).to_be_bytes());
            }
        }
        // A mask of zeros leaves the text as it is.
        frame.extend([0; 4]);
        frame.extend(text.bytes());
        let _ = self.stream.write_all(&frame);
    }

    /// Asks for something; returns the number of the request.
    pub fn ask(&mut self, act: &str, mut body: Value) -> u64 {
        self.last += 1;
        body["id"] = json!(self.last);
        body["do"] = json!(act);
        self.send_text(&body.to_string());
        self.last
    }

    /// The next answer: its head, and its columns.
    pub fn answer(&mut self) -> Option<(Value, Vec<Vec<f64>>)> {
        let (kind, frame) = self.frame()?;
        if kind != 2 {
            return None;
        }
        let length = u32::from_le_bytes(frame[..4].try_into().unwrap()) as usize;
        assert_eq!((4 + length) % 8, 0, "columns begin at a multiple of eight bytes");
        let head: Value = serde_json::from_slice(&frame[4..4 + length]).unwrap();
        let mut at = 4 + length;
        let mut columns = Vec::new();
        for column in head["columns"].as_array().into_iter().flatten() {
            let rows = column["rows"].as_u64().unwrap() as usize;
            let bytes = &frame[at..at + 8 * rows];
            columns.push(bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect());
            at += 8 * rows;
        }
        assert_eq!(at, frame.len());
        Some((head, columns))
    }

    /// Kind and content of the next frame of the server.
    pub fn frame(&mut self) -> Option<(u8, Vec<u8>)> {
        let mut head = [0; 2];
        self.stream.read_exact(&mut head).ok()?;
        let length = match head[1] & 0x7f {
            126 => {
                let mut more = [0; 2];
                self.stream.read_exact(&mut more).ok()?;
                u64::from(u16::from_be_bytes(more))
            }
            127 => {
                let mut more = [0; 8];
                self.stream.read_exact(&mut more).ok()?;
                u64::from_be_bytes(more)
            }
            n => u64::from(n),
        };
        let mut content = vec![0; length as usize];
        self.stream.read_exact(&mut content).ok()?;
        Some((head[0] & 0x0f, content))
    }

    /// Asks for something, and waits for the head of its answer.
    pub fn result(&mut self, act: &str, body: Value) -> Value {
        let id = self.ask(act, body);
        let (head, _) = self.answer().unwrap();
        assert_eq!(head["id"], json!(id));
        head
    }
}
