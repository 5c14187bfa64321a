//! The requests to stop that come from elsewhere than the keyboard, on Unix.

use std::io;

use signal_hook::consts::{SIGHUP, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;

use crate::request::StopRequest;

/// What shells add to a signal's number for the exit status of the program that it ended.
const STATUS_OF_SIGNALS: i32 = 128;

/// Has `request` made by SIGTERM, and by SIGHUP unless it is ignored. SIGXFSZ is caught as well and does nothing, so
/// that a file that grows beyond the limit of its size (`ulimit -f`) fails the write with an error, which removes what
/// was written of it, in place of ending the program.
///
/// # Errors
/// Those of the operating system.
pub(crate) fn catch(request: StopRequest) -> io::Result<()> {
    let mut signals = Signals::new([SIGTERM, SIGXFSZ])?;
    if heeds_hangup() {
        signals.add_signal(SIGHUP)?;
    }
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        for signal in signals.forever().filter(|&signal| signal != SIGXFSZ) {
            // Signals are few: the sum fits.
            request.made((STATUS_OF_SIGNALS + signal) as u8, false);
        }
    })?;
    Ok(())
}

/// Whether SIGHUP is known not to be ignored: `nohup` starts programs with it ignored, and catching it would undo that.
/// Where the kernel does not tell, it is left as it is: it ends the program or does nothing, as whoever started it
/// decided.
fn heeds_hangup() -> bool {
    std::fs::read_to_string("/proc/self/status").ok().and_then(|status| ignored(&status)).is_some_and(|ignored| {
        let hangup = 1 << (SIGHUP - 1);
        ignored & hangup == 0
    })
}

/// The ignored signals in the text of /proc/PID/status, a bit each from SIGHUP on.
///
/// # Source
/// proc_pid_status(5): SigIgn, in hexadecimal digits.
fn ignored(status: &str) -> Option<u64> {
    let digits = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(digits.trim(), 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_as_the_kernel_writes_them() {
        let status = |digits: &str| format!("Name:\tsh\nSigBlk:\t0000000000000001\nSigIgn:\t{digits}\nSigCgt:\t0\n");
        assert_eq!(ignored(&status("0000000000001001")), Some(0x1001));
        assert_eq!(ignored(&status("many")), None);
        assert_eq!(ignored("Name:\tsh\n"), None);
    }
}
