//! The secrets of a running server: the token of its address, and the cookie it is exchanged for.

use axum::http::header::{self, HeaderMap};
use taut::error::{Error, Result};

/// The secrets of a running server.
#[derive(Debug)]
pub struct Keys {
    /// In the address, as long as the server runs.
    pub token: String,
    /// In the cookie.
    pub cookie: String,
    pub port: u16,
}

impl Keys {
    /// New ones for the server at this port.
    pub fn new(port: u16) -> Result<Self> {
        Ok(Self { token: secret()?, cookie: secret()?, port })
    }

    /// The cookie's name: browsers keep cookies by host alone, so that two servers would overwrite one another's.
    pub fn name(&self) -> String {
        format!("taut-studio-{}", self.port)
    }

    /// True if it is one of our names, with our port.
    pub fn is_host(&self, host: &str) -> bool {
        ["127.0.0.1", "localhost"].iter().any(|name| host == format!("{name}:{}", self.port))
    }

    pub fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let name = self.name();
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut values = cookies.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        values.any(|(key, value)| key == name && is_same(value, &self.cookie))
    }

    pub fn has_token(&self, query: Option<&str>) -> bool {
        let mut pairs = query.unwrap_or_default().split('&').filter_map(|pair| pair.split_once('='));
        pairs.any(|(key, value)| key == "token" && is_same(value, &self.token))
    }
}

/// 256 random bits in hexadecimal digits.
fn secret() -> Result<String> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(|e| Error::new(format!("the system gives no random numbers: {e}")))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Compares all of it, so that the time tells nothing of where it differs.
fn is_same(given: &str, secret: &str) -> bool {
    let differs = |(a, b): (u8, u8)| u8::from(a != b);
    given.len() == secret.len() && given.bytes().zip(secret.bytes()).map(differs).sum::<u8>() == 0
}
