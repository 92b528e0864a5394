//! Who may talk to the server: the page that it served itself, in the browser that was given the address.
//!
//! A page of any other site can have a browser send requests here; by giving its own name this computer's address (DNS
//! rebinding) it can even read the answers. So `Host` has to be ours, `Origin` too where there is one, and beyond the
//! address with the token nothing is answered without the cookie that it was exchanged for.

use crate::state::State;
use axum::body::Body;
use axum::extract::{Request, State as Shared};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{Method, StatusCode};
use axum::middleware::Next;
use axum::response::Response;
use std::sync::Arc;
use taut::error::{Error, Result};

/// The secrets of a running server.
#[derive(Debug)]
pub struct Keys {
    /// In the address, as long as the server runs.
    pub token: String,
    /// In the cookie.
    cookie: String,
    port: u16,
}

impl Keys {
    /// New ones for the server at this port.
    pub fn new(port: u16) -> Result<Self> {
        Ok(Self { token: secret()?, cookie: secret()?, port })
    }

    /// The cookie's name: browsers keep cookies by host alone, so that two servers would overwrite one another's.
    fn name(&self) -> String {
        format!("taut-studio-{}", self.port)
    }

    /// Whether it is one of our names, with our port.
    fn is_host(&self, host: &str) -> bool {
        ["127.0.0.1", "localhost"].iter().any(|name| host == format!("{name}:{}", self.port))
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let name = self.name();
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut values = cookies.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        values.any(|(key, value)| key == name && is_same(value, &self.cookie))
    }

    fn has_token(&self, query: Option<&str>) -> bool {
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

/// Lets a request through, exchanges a token, or refuses.
pub async fn check(Shared(state): Shared<Arc<State>>, request: Request, next: Next) -> Response {
    let mut response = judge(&state, request, next).await;
    protect(response.headers_mut(), &state.keys);
    response
}

async fn judge(state: &State, request: Request, next: Next) -> Response {
    let (keys, headers) = (&state.keys, request.headers());
    let text = |name: HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
    let Some(host) = text(header::HOST).filter(|host| keys.is_host(host)) else {
        return refused("it was asked for under a name that is not its own");
    };
    let origin = text(header::ORIGIN);
    if origin.is_some_and(|origin| origin.strip_prefix("http://") != Some(host)) {
        return refused("it was asked for by the page of another site");
    }
    if text(HeaderName::from_static("sec-fetch-site")).is_some_and(|site| site == "cross-site") && is_act(&request) {
        return refused("it was asked for by the page of another site");
    }
    if request.method() == Method::GET && request.uri().path() == "/" && keys.has_token(request.uri().query()) {
        return exchanged(keys);
    }
    if !keys.has_cookie(headers) {
        return refused("the address has no token, or one of a server that has ended");
    }
    // Only a browser's own page opens sockets and sends files, and browsers say which.
    if is_act(&request) && origin.is_none() {
        return refused("the request does not say which page it is from");
    }
    next.run(request).await
}

/// Whether it is more than a look: a socket, a file that is sent.
fn is_act(request: &Request) -> bool {
    request.method() != Method::GET || request.headers().contains_key(header::UPGRADE)
}

/// The token's exchange for a cookie; the address without it is what the browser remembers.
fn exchanged(keys: &Keys) -> Response {
    let cookie = format!("{}={}; Path=/; HttpOnly; SameSite=Strict", keys.name(), keys.cookie);
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::SEE_OTHER;
    response.headers_mut().insert(header::LOCATION, HeaderValue::from_static("/"));
    if let Ok(cookie) = HeaderValue::from_str(&cookie) {
        response.headers_mut().insert(header::SET_COOKIE, cookie);
    }
    response
}

/// A page that says what to do.
fn refused(why: &str) -> Response {
    let page = format!(
        "<!DOCTYPE html><html lang=\"en\"><meta charset=\"utf-8\"><title>taut studio</title><h1>Not this way</h1>\
         <p>This page is not shown: {why}.</p><p>The address that opens it is the first line that <code>taut studio</code> printed on \
         the terminal where it runs; it begins with <code>http://127.0.0.1</code> and holds a token. If that terminal is \
         gone, start it again: <code>taut studio CASE</code>.</p></html>\n"
    );
    let mut response = Response::new(Body::from(page));
    *response.status_mut() = StatusCode::FORBIDDEN;
    let html = HeaderValue::from_static("text/html; charset=utf-8");
    response.headers_mut().insert(header::CONTENT_TYPE, html);
    response
}

/// The headers of every answer.
fn protect(headers: &mut HeaderMap, keys: &Keys) {
    let policy = format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' \
         ws://127.0.0.1:{0} ws://localhost:{0}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        keys.port
    );
    let mut set = |name: HeaderName, value: &str| {
        if let Ok(value) = HeaderValue::from_str(value) {
            headers.insert(name, value);
        }
    };
    set(header::CONTENT_SECURITY_POLICY, &policy);
    set(header::X_CONTENT_TYPE_OPTIONS, "nosniff");
    set(header::REFERRER_POLICY, "no-referrer");
    set(header::X_FRAME_OPTIONS, "DENY");
    set(header::CACHE_CONTROL, "no-store");
    set(HeaderName::from_static("cross-origin-resource-policy"), "same-origin");
    set(HeaderName::from_static("cross-origin-opener-policy"), "same-origin");
}
