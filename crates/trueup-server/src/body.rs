//! Bodies of requests: never longer than allowed, never slower than a person's own machine sends them. And files as
//! bodies of answers, piece by piece.

use std::io::ErrorKind;
use std::path::Path;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::StatusCode;
use http_body_util::BodyExt;
use hyper::body::Frame;
use tokio::fs::File;
use tokio::io::{AsyncRead, AsyncWriteExt, ReadBuf};
use tokio::time::Instant;

use crate::denial::Denial;
use crate::limits::{BODY_GRACE, MIN_BODY_RATE};

/// A body that is read piece by piece.
struct Pieces {
    body: Body,
    read: u64,
    limit: u64,
    begun: Instant,
}

impl Pieces {
    fn new(body: Body, limit: u64) -> Self {
        Self { body, read: 0, limit, begun: Instant::now() }
    }

    async fn next(&mut self) -> Result<Option<Bytes>, Denial> {
        let allowed = BODY_GRACE + Duration::from_secs(self.read / MIN_BODY_RATE);
        let slow = |_| Denial::new(StatusCode::REQUEST_TIMEOUT, "it came too slowly", "Try again.");
        let cut = |_| Denial::new(StatusCode::BAD_REQUEST, "it was cut off on the way", "Try again.");
        let frame = tokio::time::timeout_at(self.begun + allowed, self.body.frame()).await.map_err(slow)?;
        let Some(frame) = frame.transpose().map_err(cut)? else { return Ok(None) };
        let data = frame.into_data().unwrap_or_default();
        self.read += data.len() as u64;
        if self.read > self.limit {
            return Err(too_large(self.limit));
        }
        Ok(Some(data))
    }
}

/// The whole of a body of at most `limit` bytes.
///
/// # Errors
/// If it is larger, slower than [`MIN_BODY_RATE`], or cut off.
pub(crate) async fn read(body: Body, limit: u64) -> Result<Vec<u8>, Denial> {
    let mut pieces = Pieces::new(body, limit);
    let mut whole = Vec::new();
    while let Some(piece) = pieces.next().await? {
        whole.extend_from_slice(&piece);
    }
    Ok(whole)
}

/// Writes a body of at most `limit` bytes to a new file; returns its length. Of a body that is refused nothing is left,
/// nor of one whose sender goes away.
///
/// # Errors
/// As [`read`], if the file cannot be written, and if there is one of that name: another request's, which stays as it
/// is.
pub(crate) async fn save(body: Body, limit: u64, place: &Path) -> Result<u64, Denial> {
    let file = File::create_new(place).await.map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => {
            Denial::not_now("a file of this name is on its way already", "Give it another name.")
        }
        _ => Denial::failure(error),
    })?;
    let mut begun = Begun { place: Some(place) };
    let length = write(body, limit, file).await?;
    begun.place = None;
    Ok(length)
}

/// A file that is not whole: it goes however the work on it ends, also when nobody waits for the answer any more.
struct Begun<'a> {
    place: Option<&'a Path>,
}

impl Drop for Begun<'_> {
    fn drop(&mut self) {
        // If it cannot be removed, it goes with its folder.
        let _ = self.place.map(std::fs::remove_file);
    }
}

async fn write(body: Body, limit: u64, mut file: File) -> Result<u64, Denial> {
    let mut pieces = Pieces::new(body, limit);
    while let Some(piece) = pieces.next().await? {
        file.write_all(&piece).await.map_err(Denial::failure)?;
    }
    file.flush().await.map_err(Denial::failure)?;
    Ok(pieces.read)
}

fn too_large(limit: u64) -> Denial {
    let megabytes = (limit / 1_000_000).max(1);
    let message = format!("it is larger than the {megabytes} MB that are allowed");
    Denial::new(StatusCode::PAYLOAD_TOO_LARGE, message, "Put it into the folder that was opened instead.")
}

/// Bytes of a file that are in memory at once.
const PIECE_BYTES: usize = 1 << 18;

/// A file that is sent.
pub(crate) struct FileBody(File);

impl FileBody {
    /// All that is left of a file.
    pub(crate) fn new(file: File) -> Self {
        Self(file)
    }
}

impl axum::body::HttpBody for FileBody {
    type Data = Bytes;
    type Error = std::io::Error;

    fn poll_frame(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<std::io::Result<Frame<Bytes>>>> {
        let mut piece = vec![0; PIECE_BYTES];
        let mut buffer = ReadBuf::new(&mut piece);
        let read = ready!(Pin::new(&mut self.get_mut().0).poll_read(context, &mut buffer));
        let length = buffer.filled().len();
        Poll::Ready(match read {
            Err(error) => Some(Err(error)),
            Ok(()) if length == 0 => None,
            Ok(()) => {
                piece.truncate(length);
                Some(Ok(Frame::data(piece.into())))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body whose sender has sent one piece and sends no more.
    struct Halted(bool);

    impl axum::body::HttpBody for Halted {
        type Data = Bytes;
        type Error = std::io::Error;

        fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<std::io::Result<Frame<Bytes>>>> {
            match std::mem::replace(&mut self.0, true) {
                false => Poll::Ready(Some(Ok(Frame::data(Bytes::from_static(b"half"))))),
                true => Poll::Pending,
            }
        }
    }

    /// The second of two of one name neither waits for the first nor takes its file away, and that of a sender who went
    /// away is gone.
    #[test]
    fn a_file_is_one_requests_own_and_goes_with_it() {
        const SOON: Duration = Duration::from_millis(200);
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path().join("a.jpg");
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            let mut first = Box::pin(save(Body::new(Halted(false)), 100, &place));
            assert!(tokio::time::timeout(SOON, &mut first).await.is_err(), "it waits for more");
            assert!(place.exists());
            assert!(save(Body::from("whole"), 100, &place).await.is_err());
            assert!(place.exists(), "the first one's own");
            drop(first);
            assert!(!place.exists(), "nobody's");
            assert_eq!(save(Body::from("whole"), 100, &place).await.ok(), Some(5));
            assert!(save(Body::from("too large"), 3, &folder.path().join("b.jpg")).await.is_err());
        });
        let left: Vec<_> = std::fs::read_dir(folder.path()).expect("readable").collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }
}
