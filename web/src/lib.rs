//! The commands of the studio as a WebAssembly module, which a worker of the browser runs instead of a server. The
//! protocol is that of the server's socket.
//!
//! For each call, the worker (`studio/page/worker.js`) writes the input at the address returned by [`room`]. The call
//! returns the length of its answer, which starts at the address returned by [`output`]. A call that traps leaves the
//! instance unusable, and the worker creates a new one.

use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use taut::error::{Error, Result};
use taut::files::memory;
use taut_acts::{Context, Host, Pace, Reply, Request, sent};

/// Input of the next call, and the last answer.
static INPUT: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static OUTPUT: Mutex<Vec<u8>> = Mutex::new(Vec::new());

/// Allocates the input of the next call, `length` bytes, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    let mut input = lock(&INPUT);
    input.clear();
    input.resize(length, 0);
    input.as_mut_ptr()
}

/// Address of the last answer.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    lock(&OUTPUT).as_ptr()
}

/// Lists the acts of pace [`Pace::Long`] as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn long_acts() -> usize {
    answer(json!(taut_acts::names(Pace::Long).collect::<Vec<_>>()).to_string().into_bytes())
}

/// Executes the request in the input; the answer is a frame.
#[unsafe(no_mangle)]
pub extern "C" fn ask() -> usize {
    answer(asked(&String::from_utf8_lossy(&taken())))
}

/// Answers the request in the input, which trapped, with an error frame.
#[unsafe(no_mangle)]
pub extern "C" fn defect() -> usize {
    let request = Request::read(&String::from_utf8_lossy(&taken()));
    answer(taut_acts::defect().frame(request.ok().map(|request| request.id)))
}

/// Keeps a file that was dropped on the page, number `place`. The input is its name, of `name` bytes, followed by its
/// content. The answer is JSON with its `path` or an `error`.
#[unsafe(no_mangle)]
pub extern "C" fn keep(place: u32, name: usize) -> usize {
    let mut bytes = taken();
    let file = bytes.split_off(name.min(bytes.len()));
    answer(match kept(place, &String::from_utf8_lossy(&bytes), file) {
        Ok(path) => json!({ "path": path }).to_string().into_bytes(),
        Err(told) => json!({ "error": told }).to_string().into_bytes(),
    })
}

fn asked(text: &str) -> Vec<u8> {
    let request = match Request::read(text) {
        Ok(request) => request,
        Err(error) => return Reply::error(&error).frame(None),
    };
    let (id, is_stopped) = (Some(request.id), worker::is_stopped);
    let tell = |step| worker::tell(&Reply::new(json!({ "progress": step })).frame(id));
    taut_acts::answer(&request, &Context::new(&Browser, &is_stopped, &tell)).frame(id)
}

fn kept(place: u32, name: &str, file: Vec<u8>) -> std::result::Result<String, String> {
    if file.len() > sent::FILE || memory::held() + file.len() > sent::ALL {
        return Err(sent::too_large());
    }
    let path = format!("/dropped/{place}/{}", sent::name(name));
    memory::hold(&path, file);
    Ok(path)
}

/// A browser without a server.
struct Browser;

impl Host for Browser {
    fn seconds(&self) -> f64 {
        worker::seconds()
    }

    fn threads(&self) -> usize {
        1
    }

    fn name(&self) -> &Path {
        Path::new(taut_acts::NAME)
    }

    fn opened(&self) -> Option<(&Path, String)> {
        None
    }

    fn save(&self, _: &str) -> Result<PathBuf> {
        let error = Error::new("a page without a server cannot write files");
        Err(error.next("download the text instead, or open it with `taut studio CASE`"))
    }

    fn sent(&self, path: &str) -> Result<PathBuf> {
        if memory::is_held(path) { Ok(path.into()) } else { Err(sent::unknown()) }
    }
}

fn answer(bytes: Vec<u8>) -> usize {
    let mut output = lock(&OUTPUT);
    *output = bytes;
    output.len()
}

fn taken() -> Vec<u8> {
    std::mem::take(&mut lock(&INPUT))
}

fn lock(bytes: &Mutex<Vec<u8>>) -> MutexGuard<'_, Vec<u8>> {
    bytes.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Functions that the worker provides.
#[cfg(target_family = "wasm")]
mod worker {
    mod imports {
        #[link(wasm_import_module = "worker")]
        unsafe extern "C" {
            pub safe fn seconds() -> f64;
            pub safe fn is_stopped() -> i32;
            /// Sends a frame of `length` bytes to the page.
            pub fn tell(bytes: *const u8, length: usize);
        }
    }

    pub fn seconds() -> f64 {
        imports::seconds()
    }

    pub fn is_stopped() -> bool {
        imports::is_stopped() != 0
    }

    pub fn tell(frame: &[u8]) -> bool {
        // SAFETY: the bytes are there as long as the call.
        unsafe { imports::tell(frame.as_ptr(), frame.len()) };
        true
    }
}

/// Stand-ins for tests, which run outside a browser.
#[cfg(not(target_family = "wasm"))]
mod worker {
    use std::sync::LazyLock;
    use std::time::Instant;

    static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);

    pub fn seconds() -> f64 {
        BEGUN.elapsed().as_secs_f64()
    }

    pub fn is_stopped() -> bool {
        false
    }

    pub fn tell(_: &[u8]) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn head(frame: &[u8]) -> Value {
        let length = u32::from_le_bytes(frame[..4].try_into().unwrap()) as usize;
        serde_json::from_slice(&frame[4..4 + length]).unwrap()
    }

    fn told(request: &Value) -> Value {
        head(&asked(&request.to_string()))
    }

    #[test]
    fn a_page_without_a_server_computes_and_saves_nothing() {
        let opened = told(&json!({ "id": 1, "do": "open" }));
        assert_eq!((&opened["id"], &opened["path"], &opened["name"]), (&json!(1), &Value::Null, &json!("studio.toml")));
        let run = told(&json!({ "id": 2, "do": "run", "text": opened["text"] }));
        assert!(run["result"].is_object() && run["columns"][0]["rows"].as_u64() > Some(10), "{}", run["error"]);
        let saved = told(&json!({ "id": 3, "do": "save", "text": opened["text"] }));
        assert_eq!(saved["error"]["what"], "a page without a server cannot write files");
    }

    #[test]
    fn what_is_no_request_is_told() {
        for text in ["", "{", "[]", "{\"id\": -1, \"do\": \"open\"}", "{\"id\": 1}"] {
            let head = head(&asked(text));
            assert!(head["id"].is_null() && head["error"]["what"].is_string(), "{text}: {head}");
        }
        let head = told(&json!({ "id": 7, "do": "fly" }));
        let allowed = head["error"]["allowed"].as_str().unwrap();
        assert!(head["id"] == 7 && allowed.starts_with("open, run"), "{head}");
    }

    #[test]
    fn files_are_read_by_the_paths_that_they_were_given() {
        let path = kept(3, "../my log.csv", b"time,x\n0,1\n".to_vec()).unwrap();
        assert_eq!(path, "/dropped/3/mylog.csv");
        assert_eq!(Browser.sent(&path).unwrap(), Path::new(&path));
        assert!(Browser.sent("/dropped/3/other.csv").is_err() && Browser.sent("/etc/passwd").is_err());
        assert!(kept(4, "large", vec![0; sent::FILE + 1]).unwrap_err().contains("64 MB"));
    }
}
