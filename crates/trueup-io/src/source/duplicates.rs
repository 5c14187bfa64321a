//! Recognizes a file that was given twice and files with the same bytes.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use trueup_core::raster::Photograph;

use super::rejection::Rejection;

/// What was accepted so far.
#[derive(Debug, Default)]
pub(crate) struct Accepted {
    files: Vec<AcceptedFile>,
    /// By name, those in memory.
    in_memory: Vec<(String, Arc<Photograph>)>,
}

#[derive(Debug)]
struct AcceptedFile {
    /// Resolved path, free of links and of "..".
    resolved: PathBuf,
    name: String,
    length: u64,
}

impl Accepted {
    /// Notes a file, unless one like it is known.
    pub(crate) fn admit(&mut self, path: &Path, name: &str, length: u64) -> Result<(), Rejection> {
        let resolved = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        // Files of one length are rare but for uncompressed formats, and those differ within the first pixels.
        for known in self.files.iter().filter(|known| known.length == length) {
            let reason = if known.resolved == resolved {
                format!("it is the same file as {}, which is used", known.name)
            } else if same_bytes(&known.resolved, path).unwrap_or(false) {
                format!("it has the same bytes as {}, which is used", known.name)
            } else {
                continue;
            };
            return Err(duplicate(reason));
        }
        self.files.push(AcceptedFile { resolved, name: name.to_owned(), length });
        Ok(())
    }

    /// Notes a photograph in memory, unless one like it is known.
    pub(crate) fn admit_in_memory(&mut self, name: &str, photograph: &Arc<Photograph>) -> Result<(), Rejection> {
        if let Some((known, _)) = self.in_memory.iter().find(|(_, known)| known == photograph) {
            return Err(duplicate(format!("it has the same pixels as {known}, which is used")));
        }
        self.in_memory.push((name.to_owned(), photograph.clone()));
        Ok(())
    }
}

fn duplicate(reason: String) -> Rejection {
    Rejection::new("duplicate", reason, "Leave one of them out; a photograph is used once.")
}

/// Compares two files up to their first difference.
fn same_bytes(a: &Path, b: &Path) -> std::io::Result<bool> {
    let (mut a, mut b) = (BufReader::new(File::open(a)?), BufReader::new(File::open(b)?));
    loop {
        let (chunk_a, chunk_b) = (a.fill_buf()?, b.fill_buf()?);
        let common = chunk_a.len().min(chunk_b.len());
        if common == 0 {
            return Ok(chunk_a.len() == chunk_b.len());
        }
        if chunk_a[..common] != chunk_b[..common] {
            return Ok(false);
        }
        a.consume(common);
        b.consume(common);
    }
}
