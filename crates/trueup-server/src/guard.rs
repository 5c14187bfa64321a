//! Who is let in: one person, by a secret that the terminal printed or a password, from a page that this program
//! served.
//!
//! Every request passes here before anything else looks at it. Whoever holds no session gets nothing but a denial.

use std::fmt::Write;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use rand::TryRng;
use rand::rngs::SysRng;
use tokio::sync::Mutex;

use crate::body;
use crate::limits::{MAX_WISHES_BYTES, PASSWORD_PAUSE};

/// Scripts, styles and pictures of this program alone, none of them in the page itself, and no frame around it. Viewers
/// make pictures of data they hold.
const CONTENT_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
    img-src 'self' blob: data:; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// What every answer says to the browser.
static PROTECTION: [(HeaderName, &str); 7] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "same-origin"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::CACHE_CONTROL, "no-store"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

const REFUSED: &str = "Open the address that `trueup serve` printed in the terminal: it has the key to this page.\n";
const LOGIN: &str = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" \
    content=\"width=device-width\"><title>trueup</title><h1>trueup</h1><form method=\"post\" action=\"/login\"><label>Password \
    <input type=\"password\" name=\"password\" autocomplete=\"current-password\" autofocus></label> <button>Open</button></form></html>";
/// How its form ends after a wrong one.
const WRONG: &str = "<p role=\"alert\">That is not the password.</p></form>";

/// Bytes of a secret: 256 bits.
const SECRET_BYTES: usize = 32;

/// What opens the page.
pub(crate) enum Key {
    /// A random word in the address.
    Word(String),
    /// A password, as its hash.
    Password(blake3::Hash),
}

/// Decides who is let in.
pub(crate) struct Guard {
    /// Where the server listens.
    address: SocketAddr,
    key: Key,
    cookie: String,
    session: blake3::Hash,
    session_text: String,
    /// Held while a password is looked at, so that guesses wait for each other.
    guesses: Mutex<()>,
}

impl Guard {
    /// A guard of a server that listens at `address`, opened by `password`, or by a random word without one.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub(crate) fn new(address: SocketAddr, password: Option<&str>) -> std::io::Result<Self> {
        let key = match password {
            Some(password) => Key::Password(blake3::hash(password.as_bytes())),
            None => Key::Word(secret()?),
        };
        let session_text = secret()?;
        let session = blake3::hash(session_text.as_bytes());
        // Cookies know no ports: two servers on one machine are not to take each other's.
        let cookie = format!("trueup-{}", address.port());
        Ok(Self { address, key, cookie, session, session_text, guesses: Mutex::default() })
    }

    /// The address to open in a browser.
    pub(crate) fn url(&self) -> String {
        match &self.key {
            Key::Word(word) => format!("http://{}/?token={word}", self.address),
            Key::Password(_) => format!("http://{}/", self.address),
        }
    }

    /// What a browser that was let in sends along, as lines of a request's head.
    pub(crate) fn credentials(&self) -> String {
        let Self { address, cookie, session_text, .. } = self;
        format!("Host: {address}\r\nOrigin: http://{address}\r\nCookie: {cookie}={session_text}\r\n")
    }

    /// Whether a request names this server: another name for its address is that of a page elsewhere which had its own
    /// name point here. Addresses in numbers cannot be made to point anywhere.
    fn is_host(&self, headers: &HeaderMap) -> Option<String> {
        let mut hosts = headers.get_all(header::HOST).iter();
        let host = hosts.next().filter(|_| hosts.next().is_none())?.to_str().ok()?;
        let (name, port) = host.rsplit_once(':').unwrap_or((host, "80"));
        if port.parse() != Ok(self.address.port()) {
            return None;
        }
        let number: Option<IpAddr> = name.trim_start_matches('[').trim_end_matches(']').parse().ok();
        let fits = match number {
            Some(number) => number == self.address.ip() || self.address.ip().is_unspecified(),
            None => name == "localhost" && self.address.ip().is_loopback(),
        };
        fits.then(|| host.to_owned())
    }

    fn holds_session(&self, headers: &HeaderMap) -> bool {
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut own = cookies.flat_map(|line| line.split(';')).filter_map(|cookie| cookie.trim().split_once('='));
        // Hashes are compared in constant time.
        own.any(|(name, value)| name == self.cookie && blake3::hash(value.as_bytes()) == self.session)
    }

    /// Sends a browser to the page with the session in a cookie that no script reads and no other page sends.
    fn welcome(&self) -> Response {
        let cookie = format!("{}={}; HttpOnly; SameSite=Strict; Path=/", self.cookie, self.session_text);
        (StatusCode::SEE_OTHER, [(header::LOCATION, "/".to_owned()), (header::SET_COOKIE, cookie)]).into_response()
    }

    /// Whether the word in the address is the right one; `None` if there is none.
    fn word_fits(&self, request: &Request) -> Option<bool> {
        let Key::Word(word) = &self.key else { return None };
        let query = request.uri().query().filter(|_| request.uri().path() == "/")?;
        let given = query.split('&').find_map(|pair| pair.strip_prefix("token="))?;
        Some(blake3::hash(given.as_bytes()) == blake3::hash(word.as_bytes()))
    }

    async fn login(&self, body: Body) -> Response {
        let Key::Password(password) = &self.key else { return refused(StatusCode::NOT_FOUND) };
        let given = match body::read(body, MAX_WISHES_BYTES).await {
            Ok(given) => given,
            Err(denial) => return denial.into_response(),
        };
        // Only now: who never ends a guess holds up nobody.
        let _one = self.guesses.lock().await;
        let text = given.strip_prefix(b"password=".as_slice()).map(form_value).unwrap_or_default();
        if blake3::hash(&text) == *password {
            return self.welcome();
        }
        tokio::time::sleep(PASSWORD_PAUSE).await;
        login_page(LOGIN.replace("</form>", WRONG))
    }

    fn shut(&self) -> Response {
        match self.key {
            Key::Word(_) => refused(StatusCode::FORBIDDEN),
            Key::Password(_) => login_page(LOGIN),
        }
    }
}

/// Lets a request through, or not.
pub(crate) async fn check(State(guard): State<Arc<Guard>>, request: Request, next: Next) -> Response {
    let mut response = decide(&guard, request, next).await;
    for (name, value) in &PROTECTION {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn decide(guard: &Guard, request: Request, next: Next) -> Response {
    let Some(host) = guard.is_host(request.headers()) else { return refused(StatusCode::MISDIRECTED_REQUEST) };
    if !is_own_origin(&request, &host) {
        return refused(StatusCode::FORBIDDEN);
    }
    match guard.word_fits(&request) {
        Some(true) if request.method() == Method::GET => return guard.welcome(),
        Some(_) => return refused(StatusCode::FORBIDDEN),
        None => {}
    }
    if request.uri().path() == "/login" && request.method() == Method::POST {
        return guard.login(request.into_body()).await;
    }
    if !guard.holds_session(request.headers()) {
        return guard.shut();
    }
    next.run(request).await
}

/// Whether a request comes from a page that this server served. What changes anything must say so; what only looks may
/// be silent about it, as when an address is opened.
fn is_own_origin(request: &Request, host: &str) -> bool {
    let headers = request.headers();
    let looks = matches!(*request.method(), Method::GET | Method::HEAD);
    let own = format!("http://{host}");
    let origin = match headers.get(header::ORIGIN) {
        Some(origin) => origin.as_bytes() == own.as_bytes(),
        None => looks,
    };
    // What a page elsewhere embeds or opens is told by the browser itself; addresses typed or clicked in other programs
    // come from nowhere.
    let site = headers.get("sec-fetch-site").is_none_or(|site| site == "same-origin" || (looks && site == "none"));
    let opened =
        request.uri().path() == "/" && looks && headers.get("sec-fetch-mode").is_some_and(|mode| mode == "navigate");
    origin && (site || opened)
}

fn login_page(text: impl IntoResponse) -> Response {
    (StatusCode::FORBIDDEN, [(header::CONTENT_TYPE, "text/html; charset=utf-8")], text).into_response()
}

fn refused(status: StatusCode) -> Response {
    (status, REFUSED).into_response()
}

/// A random word of [`SECRET_BYTES`], in hexadecimal.
fn secret() -> std::io::Result<String> {
    let mut bytes = [0; SECRET_BYTES];
    SysRng.try_fill_bytes(&mut bytes).map_err(|error| std::io::Error::other(error.to_string()))?;
    Ok(bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing into a text never fails.
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

/// A value as forms write it: `+` for a space, `%` before two hexadecimal digits.
fn form_value(written: &[u8]) -> Vec<u8> {
    let mut value = Vec::with_capacity(written.len());
    let mut rest = written;
    while let Some((&first, tail)) = rest.split_first() {
        let digits = tail.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        let coded = digits.filter(|_| first == b'%').and_then(|digits| u8::from_str_radix(digits, 16).ok());
        value.push(match (first, coded) {
            (_, Some(byte)) => byte,
            (b'+', None) => b' ',
            (byte, None) => byte,
        });
        rest = if coded.is_some() { &tail[2..] } else { tail };
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_read_as_browsers_write_them() {
        assert_eq!(form_value(b"a+b%2Bc%zz%4"), b"a b+c%zz%4");
    }

    #[test]
    fn every_secret_is_another_one_of_256_bits() {
        let (one, other) = (secret().expect("random"), secret().expect("random"));
        assert!(one.len() == 64 && one != other);
    }
}
