//! The end of a program that is refused memory it cannot do without: by an error, and with nothing half done.
//!
//! Rust ends such a program by SIGABRT, wherever in whichever library it was, and lets nobody else have a say. What
//! depends on the input is asked for ahead of the work, or in a way that may fail; the thousand other places, most of
//! them in libraries, have this one answer: the allocator notes what was refused, and SIGABRT is caught. It is raised
//! by the thread that asked for the memory, in the middle of nothing: no lock of the allocator is held, and files can
//! be removed.
//!
//! This belongs to a program, not to a library: only a binary has an allocator and signals to itself.
#![allow(unsafe_code)] // An allocator and a handler of a signal; every other module is safe code.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fmt;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::request::LastResort;

/// The system's allocator, which also notes what it refused.
#[derive(Debug, Clone, Copy)]
pub struct NotingAllocator;

thread_local! {
    /// Bytes of this thread's last allocation that was refused; 0 for none. Without a destructor, so that it can be
    /// reached from an allocator.
    static REFUSED: Cell<usize> = const { Cell::new(0) };
    /// Whether this thread is about to end the program.
    static ENDS: Cell<bool> = const { Cell::new(false) };
}

/// Notes a refusal. It may be borne: then nobody asks.
fn noted(place: *mut u8, bytes: usize) -> *mut u8 {
    if place.is_null() {
        // A thread that is ending knows no such numbers any more, and asks for little.
        let _ = REFUSED.try_with(|refused| refused.set(bytes));
    }
    place
}

// SAFETY: all is done by the system's allocator, by the same contract.
unsafe impl GlobalAlloc for NotingAllocator {
    #[inline]
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        noted(unsafe { System.alloc(layout) }, layout.size())
    }

    #[inline]
    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(place, layout) }
    }

    #[inline]
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        noted(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    #[inline]
    unsafe fn realloc(&self, place: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: as the caller promises.
        noted(unsafe { System.realloc(place, layout, bytes) }, bytes)
    }
}

/// Gives back to the system what was freed, where that is much. The C library keeps what lies between pieces that are
/// still held, in case it is wanted again; of stages that are over, most is not. To be called between stages: it takes
/// some milliseconds, and what is wanted again is cleared again. Elsewhere than with glibc nothing is done.
pub fn give_back() {
    /// Bytes that are worth it: what the working copies of a photograph or two take.
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    const MUCH: usize = 64 << 20;
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: both take the allocator's locks as every allocation does, and touch nothing that is held.
    unsafe {
        if libc::mallinfo2().fordblks > MUCH {
            libc::malloc_trim(0);
        }
    }
}

/// How a program ends that is refused memory.
#[derive(Debug, Clone, Copy)]
pub struct WithoutMemory {
    /// Writes what is to be said, for so many bytes that were refused. No memory may be asked for.
    pub say: fn(&mut dyn fmt::Write, usize) -> fmt::Result,
    /// What is to be done before the end.
    pub last_resort: LastResort,
    /// The status.
    pub status: i32,
}

static ANSWER: OnceLock<WithoutMemory> = OnceLock::new();

/// Whether a thread is ending the program.
static IS_ENDING: AtomicBool = AtomicBool::new(false);

/// How long a second thread that is refused memory waits for the first one to end the program.
const OTHERS_WAIT: Duration = Duration::from_secs(10);

/// Has a program whose allocator is [`NotingAllocator`] end so where it would be aborted for want of memory. Other
/// reasons to abort are left as they are. The first call counts. Where signals are unknown, or this one cannot be
/// caught, nothing changes.
pub fn end_without_memory(answer: WithoutMemory) {
    if ANSWER.set(answer).is_err() {
        return;
    }
    #[cfg(unix)]
    // SAFETY: for this reason the signal is raised by the thread itself, which holds no lock that the handler takes for
    // longer than it can wait; for any other reason the handler returns at once.
    drop(unsafe { signal_hook::low_level::register(signal_hook::consts::SIGABRT, end) });
}

/// Ends the program if this thread was refused memory.
#[cfg(unix)]
fn end() {
    let bytes = REFUSED.get();
    let Some(answer) = ANSWER.get().filter(|_| bytes > 0) else { return };
    if ENDS.replace(true) {
        // Refused again on the way out.
        signal_hook::low_level::exit(answer.status);
    }
    if IS_ENDING.swap(true, Ordering::SeqCst) {
        std::thread::sleep(OTHERS_WAIT);
        signal_hook::low_level::exit(answer.status);
    }
    let mut line = Line { bytes: [0; Line::LENGTH], length: 0 };
    // What does not fit is cut.
    let _ = (answer.say)(&mut line, bytes);
    line.print();
    (answer.last_resort)();
    signal_hook::low_level::exit(answer.status);
}

/// A text that takes no memory but its own.
#[cfg(unix)]
struct Line {
    bytes: [u8; Self::LENGTH],
    length: usize,
}

#[cfg(unix)]
impl Line {
    const LENGTH: usize = 512;

    /// Prints on standard error, without its lock.
    fn print(&self) {
        // SAFETY: so many bytes are there. If nobody hears them, nothing can be done about it.
        unsafe { libc::write(libc::STDERR_FILENO, self.bytes.as_ptr().cast(), self.length) };
    }
}

#[cfg(unix)]
impl fmt::Write for Line {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = &mut self.bytes[self.length..];
        let fits = text.len().min(room.len());
        room[..fits].copy_from_slice(&text.as_bytes()[..fits]);
        self.length += fits;
        if fits == text.len() { Ok(()) } else { Err(fmt::Error) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_refused_is_noted_for_the_thread_that_asked() {
        /// More than any machine has, and still a size.
        const TOO_MUCH: usize = 1 << 60;
        let layout = Layout::from_size_align(TOO_MUCH, 8).expect("a size");
        // SAFETY: the size is not 0, and nothing is done with the place.
        let places = unsafe { [NotingAllocator.alloc(layout), NotingAllocator.alloc_zeroed(layout)] };
        // Unseen, the compiler takes places that nobody uses for granted, and asks for none.
        assert!(std::hint::black_box(places).iter().all(|place| place.is_null()));
        assert_eq!(REFUSED.get(), TOO_MUCH);
        assert_eq!(std::thread::spawn(|| REFUSED.get()).join().expect("it ends"), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_text_that_is_too_long_is_cut() {
        use std::fmt::Write;
        let mut line = Line { bytes: [0; Line::LENGTH], length: 0 };
        write!(line, "{} bytes", 7).expect("it fits");
        assert_eq!(&line.bytes[..line.length], b"7 bytes");
        assert!(line.write_str(&"x".repeat(Line::LENGTH)).is_err());
        assert_eq!(line.length, Line::LENGTH);
    }
}
