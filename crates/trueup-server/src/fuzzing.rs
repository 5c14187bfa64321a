//! The page's side of a connection, without a network: for `trueup-fuzz`.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};
use tokio::runtime::Runtime;
use trueup::{Error, Result};

use crate::guard::{self, Guard};
use crate::routes;
use crate::studio::Studio;

/// Bytes that a connection holds that nobody has read yet.
const CONNECTION_BYTES: usize = 1 << 16;

/// A server that nobody can reach, without photographs.
pub struct Unreachable {
    runtime: Runtime,
    router: Router,
    credentials: String,
    patience: Duration,
    /// Its folder is removed with it.
    _studio: Arc<Studio>,
}

impl std::fmt::Debug for Unreachable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Unreachable").finish_non_exhaustive()
    }
}

impl Unreachable {
    /// A server as [`crate::serve`] makes it. An answer is waited for as long as `patience` says: news are told as long
    /// as somebody listens.
    ///
    /// # Errors
    /// If there can be no temporary folder or no threads.
    pub fn new(patience: Duration) -> Result<Self> {
        let failed = |error| Error::io("making", "a server".as_ref(), error);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        let studio = Arc::new(Studio::new(None)?);
        let address = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 1);
        let guard = Arc::new(Guard::new(address, None).map_err(failed)?);
        let credentials = guard.credentials();
        let checked = axum::middleware::from_fn_with_state(guard, guard::check);
        let router = routes::router(studio.clone()).layer(checked);
        Ok(Self { runtime, router, credentials, patience, _studio: studio })
    }

    /// Sends bytes as they are, from somebody who was not let in and who hangs up as soon as something is answered, or
    /// after a tenth of the patience.
    pub fn send(&self, bytes: &[u8]) -> Vec<u8> {
        self.talk(bytes, true)
    }

    fn talk(&self, bytes: &[u8], hang_up: bool) -> Vec<u8> {
        self.runtime.block_on(async {
            let (near, mut far) = duplex(CONNECTION_BYTES);
            let mut answer = Vec::new();
            let talk = async {
                // What is not taken is not answered, either.
                let _ = far.write_all(bytes).await;
                if hang_up {
                    // Who hangs up before the answer gets none.
                    let mut first = [0; 1024];
                    if let Ok(Ok(length)) = tokio::time::timeout(self.patience / 10, far.read(&mut first)).await {
                        answer.extend_from_slice(&first[..length]);
                    }
                    let _ = far.shutdown().await;
                }
                let _ = far.read_to_end(&mut answer).await;
            };
            let served = crate::answer(near, self.router.clone());
            let _ = tokio::time::timeout(self.patience, async { tokio::join!(served, talk) }).await;
            answer
        })
    }

    /// Sends a request from the page itself. Its first line is followed by what browsers add: who they are, and how
    /// long the `body` is.
    pub fn ask(&self, line: &[u8], body: &[u8]) -> Vec<u8> {
        let head = format!("\r\n{}Connection: close\r\nContent-Length: {}\r\n\r\n", self.credentials, body.len());
        self.talk(&[line, head.as_bytes(), body].concat(), false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_let_in_and_others_are_not() {
        let server = Unreachable::new(Duration::from_secs(60)).expect("a server");
        let text = |answer: Vec<u8>| String::from_utf8_lossy(&answer).into_owned();
        let options = text(server.ask(b"GET /api/options HTTP/1.1", b""));
        assert!(options.starts_with("HTTP/1.1 200 "), "{options}");
        let stranger = text(server.send(b"GET /api/options HTTP/1.1\r\nHost: 127.0.0.1:1\r\n\r\n"));
        assert!(stranger.starts_with("HTTP/1.1 403 "), "{stranger}");
        assert!(text(server.send(b"\0\0")).starts_with("HTTP/1.1 400 ") || server.send(b"\0\0").is_empty());
    }
}
