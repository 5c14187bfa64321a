//! A server on a port of its own, asked as anybody could ask it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::Value;
use trueup::CancelToken;
use trueup_server::{Network, Serving, serve};

/// Nothing that is waited for takes longer on a machine that does much else.
const PATIENCE: Duration = Duration::from_secs(300);

pub(crate) struct Server {
    /// 127.0.0.1 and a port.
    pub(crate) host: String,
    /// What it printed.
    pub(crate) url: String,
    /// The session, as a browser sends it.
    pub(crate) cookie: String,
    cancel: Arc<CancelToken>,
    thread: Option<JoinHandle<trueup::Result<()>>>,
}

/// What came back.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

impl Server {
    /// A server of a folder, to whose page a browser has been let in.
    pub(crate) fn of(folder: &Path) -> Self {
        let mut server = Self::closed(Some(folder.to_owned()), None);
        let path = server.url.split_once(&server.host).expect("its host").1.to_owned();
        let answer = server.send(&format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", server.host));
        assert_eq!(answer.status, 303, "{answer:?}");
        let cookie = answer.head.lines().find_map(|line| line.strip_prefix("set-cookie: ")).expect("a session");
        for part in ["HttpOnly", "SameSite=Strict", "Path=/"] {
            assert!(cookie.contains(part), "{cookie}");
        }
        server.cookie = cookie.split(';').next().expect("a value").to_owned();
        server
    }

    /// A server that nobody was let in to.
    pub(crate) fn closed(folder: Option<PathBuf>, password: Option<&str>) -> Self {
        let cancel = Arc::new(CancelToken::default());
        let address = "127.0.0.1".parse().expect("an address");
        let network = password.map(|password| Network { address, password: password.to_owned() });
        let serving = Serving { folder, port: 0, network };
        let (sender, receiver) = mpsc::channel();
        let token = cancel.clone();
        let thread = std::thread::spawn(move || {
            serve(&serving, &token, |url| sender.send(url.to_owned()).expect("somebody waits"))
        });
        let url = receiver.recv_timeout(PATIENCE).expect("an address");
        let host = url.trim_start_matches("http://").split('/').next().expect("a host").to_owned();
        Self { host, url, cookie: String::new(), cancel, thread: Some(thread) }
    }

    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).expect("connected");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        stream
    }

    /// Sends a request as it is written, and reads until the server closes or all has come.
    pub(crate) fn send(&self, request: &str) -> Answer {
        let mut stream = self.connect();
        // A server that has no room does not read.
        drop(stream.write_all(request.as_bytes()));
        answer(&mut stream)
    }

    /// What the page itself would get.
    pub(crate) fn get(&self, path: &str) -> Answer {
        self.send(&self.head("GET", path, ""))
    }

    /// What the page itself would send.
    pub(crate) fn with_body(&self, method: &str, path: &str, body: &[u8]) -> Answer {
        let mut stream = self.connect();
        let length = format!("Origin: http://{}\r\nContent-Length: {}\r\n", self.host, body.len());
        stream.write_all(self.head(method, path, &length).as_bytes()).expect("sent");
        // A server that refuses does not read on.
        drop(stream.write_all(body));
        answer(&mut stream)
    }

    pub(crate) fn post(&self, path: &str, body: &str) -> Answer {
        self.with_body("POST", path, body.as_bytes())
    }

    /// The head of a request of the page itself, with more lines.
    pub(crate) fn head(&self, method: &str, path: &str, more: &str) -> String {
        format!("{method} {path} HTTP/1.1\r\nHost: {}\r\nCookie: {}\r\n{more}\r\n", self.host, self.cookie)
    }

    /// What there is when nothing is being done any more.
    pub(crate) fn settled(&self) -> Value {
        let mut after = 0;
        loop {
            let told = self.get(&format!("/api/news?after={after}")).json();
            if told["work"].is_null() {
                return told;
            }
            after = told["news"].as_u64().expect("a number");
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.cancel.cancel();
        let ended = self.thread.take().map(JoinHandle::join);
        if !std::thread::panicking() {
            ended.expect("a thread").expect("no panic").expect("no error");
        }
    }
}

/// Reads an answer: its head, and as much as that announces, or all until the end.
pub(crate) fn answer(stream: &mut TcpStream) -> Answer {
    let mut bytes = Vec::new();
    let mut piece = [0; 65536];
    loop {
        if let Some(end) = bytes.windows(4).position(|four| four == b"\r\n\r\n") {
            let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
            let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
            let length = head.lines().find_map(|line| line.strip_prefix("content-length: ")?.parse::<usize>().ok());
            let body = &bytes[end + 4..];
            let is_whole = match length {
                Some(length) => body.len() >= length,
                None => matches!(status, 204 | 303) || body.ends_with(b"0\r\n\r\n"),
            };
            if is_whole {
                return Answer { status, head, body: body.to_vec() };
            }
        }
        match stream.read(&mut piece) {
            Ok(0) | Err(_) => break,
            Ok(read) => bytes.extend_from_slice(&piece[..read]),
        }
    }
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let status = text.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    Answer { status, head: text, body: Vec::new() }
}
