//! Who may talk to the server: the page that it served itself, in the browser that was given the address.
//!
//! A page of any other site can have a browser send requests here; by giving its own name this computer's address (DNS
//! rebinding) it can even read the answers. So `Host` has to be ours, `Origin` too where there is one, and beyond the
//! address with the token nothing is answered without the cookie that it was exchanged for.

use crate::keys::Keys;
use crate::state::State;
use axum::body::Body;
use axum::extract::{Request, State as Shared};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{Method, StatusCode};
use axum::middleware::Next;
use axum::response::Response;
use std::sync::Arc;

/// The Content-Security-Policy of the page with and without the server.
pub const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
                          base-uri 'none'; form-action 'none'";

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

/// True if it is more than a look: a socket, a file that is sent.
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
    let sockets = format!("connect-src 'self' ws://127.0.0.1:{0} ws://localhost:{0}", keys.port);
    let policy = format!("{POLICY}; {sockets}; frame-ancestors 'none'");
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
