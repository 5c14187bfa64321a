//! What browsers, and others, ask of the page.

use std::cell::RefCell;
use std::time::Duration;

use trueup_server::fuzzing::Unreachable;

use super::work::Work;

/// How long an answer is waited for: news are told as long as somebody listens, and most answers come within a
/// millisecond.
const PATIENCE: Duration = Duration::from_millis(20);
/// Requests after which a server is made anew, with an empty folder.
const REQUESTS: u32 = 2000;

/// A request as it stands on the wire begins so; another has what browsers add put behind its first line.
const AS_IT_IS: u8 = b'!';

/// Every address there is, with what belongs to it.
pub(super) fn requests() -> Vec<Vec<u8>> {
    let mut all: Vec<Vec<u8>> = [
        "GET / HTTP/1.1",
        "GET /page/page.js HTTP/1.1",
        "GET /api/news?after=0 HTTP/1.1",
        "GET /api/options HTTP/1.1",
        "POST /api/wishes HTTP/1.1\n{\"options\": {\"canvas.crop\": \"none\"}, \"left_out\": {\"0\": true}}",
        "POST /api/undo HTTP/1.1",
        "POST /api/redo HTTP/1.1",
        "POST /api/stop HTTP/1.1",
        "POST /api/stitch HTTP/1.1",
        "POST /api/folder HTTP/1.1\n{\"folder\": \"inside\"}",
        "PUT /api/photographs?name=a.jpg HTTP/1.1\n\u{ff}\u{d8}\u{ff}",
        "GET /api/photographs/0/thumbnail HTTP/1.1",
        "GET /api/photographs/0/picture HTTP/1.1",
        "PUT /api/photographs/0/mask/ignore HTTP/1.1\npng",
        "POST /api/preview HTTP/1.1\n{\"options\": {\"canvas.projection\": \"cylindrical\"}}",
        "GET /api/preview/1/layers/outlines HTTP/1.1",
        "POST /api/tiles HTTP/1.1",
        "GET /api/tiles/1/panorama_files/3/0_0.jpg HTTP/1.1",
        "POST /api/exports HTTP/1.1\n{\"name\": \"panorama.jpg\"}",
        "GET /api/exports/1/panorama.jpg HTTP/1.1",
        "GET /api/project HTTP/1.1",
        "PUT /api/project HTTP/1.1\n{\"format\": \"trueup-project\", \"version\": 2}",
        "POST /api/project HTTP/1.1\n{\"name\": \"project.json\"}",
    ]
    .map(|text| text.as_bytes().to_vec())
    .into();
    all.push(
        b"!POST /login HTTP/1.1\r\nHost: localhost:1\r\nTransfer-Encoding: chunked\r\n\r\n3\r\npas\r\n0\r\n\r\n"
            .to_vec(),
    );
    all
}

thread_local! {
    /// The server that is asked, and how often it was.
    static SERVER: RefCell<Option<(Unreachable, u32)>> = const { RefCell::new(None) };
}

pub(super) fn answer(_: &Work, input: &[u8]) {
    SERVER.with_borrow_mut(|kept| {
        let (server, asked) = kept.get_or_insert_with(|| match Unreachable::new(PATIENCE) {
            Ok(server) => (server, 0),
            Err(error) => panic!("{error}"),
        });
        let said = match input.split_first() {
            Some((&AS_IT_IS, raw)) => server.send(raw),
            _ => {
                let end = input.iter().position(|&byte| byte == b'\n').unwrap_or(input.len());
                server.ask(&input[..end], input.get(end + 1..).unwrap_or_default())
            }
        };
        assert!(said.is_empty() || said.starts_with(b"HTTP/1."), "an answer in HTTP or none");
        assert!(!said.starts_with(b"HTTP/1.1 500"), "{}", String::from_utf8_lossy(&said));
        *asked += 1;
        if *asked == REQUESTS {
            *kept = None;
        }
    });
}
