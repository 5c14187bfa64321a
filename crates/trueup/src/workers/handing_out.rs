//! Tasks on their way to workers and back.

use serde::Serialize;
use serde::de::DeserializeOwned;
use trueup_core::Result;

use super::Workers;
use super::tasks::{Common, damaged, read, written};

/// Photographs that a task measures or makes small. One of 12 million pixels takes a thread about half a second: the
/// task lasts long enough that handing it over is nothing beside it, and little is lost with a worker that is killed.
pub(super) const PHOTOGRAPHS_PER_TASK: usize = 8;

/// Bytes of tasks that are held at once: enough for hundreds of workers, and a small part of the memory of who hands
/// them out.
const BYTES_HELD: usize = 256_000_000;

/// Has `count` tasks done, as many held at a time as [`BYTES_HELD`] allow, and hands what each gave to `take`.
pub(super) fn run<T: Serialize, R: DeserializeOwned>(
    workers: &dyn Workers,
    common: &Common,
    count: usize,
    task: impl Fn(usize) -> Result<T>,
    mut take: impl FnMut(usize, R) -> Result<()>,
) -> Result<()> {
    if count == 0 {
        return Ok(());
    }
    let common = written(common)?;
    let mut first = 0;
    while first < count {
        let (mut tasks, mut bytes) = (Vec::new(), 0);
        while first + tasks.len() < count && (tasks.is_empty() || bytes < BYTES_HELD) {
            tasks.push(written(&task(first + tasks.len())?)?);
            bytes += tasks.last().map_or(0, Vec::len);
        }
        let mut done = vec![false; tasks.len()];
        workers.run(&common, tasks, &mut |number, result| {
            match done.get_mut(number) {
                Some(done) if !*done => *done = true,
                _ => return Err(damaged("a task that was done already")),
            }
            take(first + number, read(&result)?)
        })?;
        if !done.iter().all(|&done| done) {
            return Err(damaged("tasks that were not done"));
        }
        first += done.len();
    }
    Ok(())
}
