//! Files of text, read whole: projects, graphs, configurations and the like.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// The most that is read of what is no regular file, a pipe or a device, which may never end, bytes: a gibibyte. The
/// project of 38 photographs has 13 MB. Regular files end by themselves.
const LONGEST_STREAM: u64 = 1 << 30;

/// The bytes of a file of text.
///
/// # Errors
/// Those of the operating system; [`ErrorKind::FileTooLarge`] if it is no regular file and goes on beyond a gibibyte,
/// with the bound in words.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let mut file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return read_at_most(file, LONGEST_STREAM);
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of a file in UTF-8.
///
/// # Errors
/// As [`read`]; [`ErrorKind::InvalidData`] if it is not in UTF-8.
pub fn read_to_string(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|error| Error::new(ErrorKind::InvalidData, error.utf8_error()))
}

/// The text of a file that people named, in UTF-8; `hint` says what is to be named in its place if it is none.
///
/// # Errors
/// [`trueup_core::Error::Io`] as [`read`]; [`trueup_core::Error::Input`] if it is not in UTF-8.
pub fn read_named(path: &Path, hint: &str) -> trueup_core::Result<String> {
    use trueup_core::Error;
    let bytes = read(path).map_err(|error| Error::io("reading", path, error))?;
    String::from_utf8(bytes).map_err(|error| {
        let reason = format!("it is no text in UTF-8 ({})", error.utf8_error());
        Error::input(path.display(), reason, hint)
    })
}

fn read_at_most(stream: impl Read, longest: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One more tells whether there are more.
    stream.take(longest.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > longest {
        let said = format!("it is no file, and goes on beyond {longest} bytes");
        return Err(Error::new(ErrorKind::FileTooLarge, said));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_end_is_refused() {
        assert_eq!(read_at_most(&b"12345"[..], 5).expect("all of it"), b"12345");
        for refused in [read_at_most(&b"12345"[..], 4), read_at_most(std::io::repeat(0), 4)] {
            let refused = refused.expect_err("it goes on");
            assert_eq!(refused.kind(), ErrorKind::FileTooLarge);
            assert!(refused.to_string().contains("beyond 4 bytes"), "{refused}");
        }
    }

    #[test]
    fn a_text_in_another_encoding_is_none() {
        let desk = tempfile::tempdir().expect("a folder");
        let path = desk.path().join("text");
        std::fs::write(&path, "12345").expect("written");
        assert_eq!(read_to_string(&path).expect("a text"), "12345");
        std::fs::write(&path, [0xff]).expect("written");
        assert_eq!(read(&path).expect("its bytes"), [0xff]);
        assert_eq!(read_to_string(&path).expect_err("no text").kind(), ErrorKind::InvalidData);
        let refused = read_named(&path, "Give another.").expect_err("no text").to_string();
        assert!(refused.contains("it is no text in UTF-8 (") && refused.ends_with("Give another."), "{refused}");
    }
}
