//! Messages of a page: requests as JSON, answers as frames of a JSON head and columns of numbers.

use serde_json::{Map, Value, json};
use std::path::Path;
use taut::error::{Error, Result};

/// A request of a page.
#[derive(Debug, Clone)]
pub struct Request {
    /// The page's number for it, given back with the answer.
    pub id: u64,
    /// The act: a row of `ACTS`.
    pub act: String,
    /// All of it.
    pub body: Map<String, Value>,
}

impl Request {
    /// Reads one; `id` and `do` have to be there.
    pub fn read(text: &str) -> Result<Self> {
        let wrong = |what: String| Error::new(what).next("write for example {\"id\": 1, \"do\": \"open\"}");
        let value: Value = serde_json::from_str(text).map_err(|e| wrong(format!("this message is not JSON: {e}")))?;
        let Value::Object(body) = value else { return Err(wrong("this message is no JSON object".into())) };
        let id = body.get("id").and_then(Value::as_u64);
        let act = body.get("do").and_then(Value::as_str).map(str::to_string);
        match (id, act) {
            (Some(id), Some(act)) => Ok(Self { id, act, body }),
            _ => Err(wrong("this message has no `id`, a whole number, or no `do`, a word".into())),
        }
    }

    /// A text that has to be there.
    pub fn text(&self, key: &str) -> Result<&str> {
        let text = self.body.get(key).and_then(Value::as_str);
        text.ok_or_else(|| Error::new(format!("the message \"{}\" has no text `{key}`", self.act)))
    }

    /// A number, where there is one.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.body.get(key).and_then(Value::as_f64).filter(|number| number.is_finite())
    }

    /// True if something is asked for.
    pub fn flag(&self, key: &str) -> bool {
        self.body.get(key).and_then(Value::as_bool).unwrap_or(false)
    }

    /// The elements of a list; none where there is no list.
    pub fn list(&self, key: &str) -> &[Value] {
        self.body.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
    }
}

/// An answer.
#[derive(Debug, Default)]
pub struct Reply {
    /// As JSON.
    pub head: Map<String, Value>,
    /// Columns, of which the head has names, units and lengths under `columns`.
    pub columns: Vec<Vec<f64>>,
}

impl Reply {
    /// A head alone.
    pub fn new(head: Value) -> Self {
        match head {
            Value::Object(head) => Self { head, columns: Vec::new() },
            other => Self { head: Map::from_iter([("value".to_string(), other)]), columns: Vec::new() },
        }
    }

    /// A mistake, with its place: a line of the text, or the key of a change to it.
    pub fn error(error: &Error) -> Self {
        let place = error.place.as_ref();
        let span = place.and_then(|place| place.span.as_ref());
        // Columns of a change are those of `KEY=VALUE`, which stands nowhere in the text.
        let is_change = place.is_some_and(|place| place.file == Path::new("--set"));
        let (span, change) = if is_change { (None, span) } else { (span, None) };
        Self::new(json!({ "error": {
            "what": error.what,
            "file": place.map(|place| place.file.display().to_string()),
            "line": span.map(|span| span.line),
            "column": span.map(|span| span.column),
            "width": span.map(|span| span.width),
            "key": change.and_then(|span| span.text.split_once('=')).map(|(key, _)| key),
            "allowed": error.allowed,
            "next": error.next,
            "text": error.to_string(),
        } }))
    }

    /// As bytes: the length of the head, the head, filled up with spaces to a multiple of eight bytes, and the columns
    /// one after another, all little-endian.
    pub fn frame(mut self, id: Option<u64>) -> Vec<u8> {
        self.head.insert("id".into(), id.map_or(Value::Null, Value::from));
        let mut head = serde_json::to_vec(&self.head).unwrap_or_else(|_| b"{}".to_vec());
        let length = (head.len() + 4).next_multiple_of(8) - 4;
        head.resize(length, b' ');
        let numbers: usize = self.columns.iter().map(Vec::len).sum();
        let mut frame = Vec::with_capacity(4 + length + 8 * numbers);
        frame.extend_from_slice(&u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
        frame.extend_from_slice(&head);
        for value in self.columns.iter().flatten() {
            frame.extend_from_slice(&value.to_le_bytes());
        }
        frame
    }
}
