//! How much memory the machine has for this program, and what else limits it: containers within containers, and the
//! limits that a shell sets (`ulimit`).

use std::fs;
use std::path::{Path, PathBuf};

/// Where the machine does not say how much memory it has, it is taken to have so much.
const ASSUMED_MACHINE: u64 = 8_000_000_000;

/// Without a word of the machine, this share of [`ASSUMED_MACHINE`] is taken to be free: 1 / 4.
const ASSUMED_FREE: u64 = 4;

/// Address space that a thread takes beside what it works on: a heap of the C library's own, 64 MiB (glibc's
/// malloc/arena.c, HEAP_MAX_SIZE on 64-bit machines), and 2 MiB of stack (Rust's).
const THREAD_SPACE: u64 = 66 << 20;

/// Limits from here on are none: version 1 of control groups says "unlimited" by the largest number of whole pages.
const NO_LIMIT: u64 = 1 << 60;

/// What may be had of the machine's memory, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct MachineMemory {
    /// All that the machine has, or the narrowest limit if that is less.
    pub total: u64,
    /// What is free of it. Beyond, the machine may still get by.
    pub free: u64,
    /// What is ended by force when it takes more, and why; `None` if nothing is.
    pub hard: Option<HardLimit>,
}

/// A limit that is enforced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct HardLimit {
    /// Bytes that this program may take in all.
    pub bytes: u64,
    pub by: LimitedBy,
}

/// Who enforces a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LimitedBy {
    /// A container or another control group, or one around it.
    ControlGroup,
    /// A limit of the process: `ulimit -v` or `ulimit -d`.
    Process,
}

impl LimitedBy {
    /// What to do about it.
    pub(super) fn advice(self) -> &'static str {
        match self {
            Self::ControlGroup => "Give the container more memory, or give smaller photographs.",
            Self::Process => "Raise the limit of the shell (ulimit -v, ulimit -d), or give smaller photographs.",
        }
    }
}

/// What this machine has for this program, which runs on `threads` threads.
pub(super) fn memory(threads: usize) -> MachineMemory {
    let (mut total, mut free) = (0, 0);
    // An error where the operating system is not known.
    if let Ok(mut system) = sysinfo::System::new() {
        system.refresh_memory();
        (total, free) = (system.total_memory(), system.available_memory());
    }
    if total == 0 {
        (total, free) = (ASSUMED_MACHINE, ASSUMED_MACHINE / ASSUMED_FREE);
    }
    let hard = hard_limit(Path::new("/"), threads);
    let least = hard.map_or(u64::MAX, |hard| hard.bytes);
    MachineMemory { total: total.min(least), free: free.min(least), hard }
}

/// What this program takes of the machine's memory now, in bytes; `None` where the system does not say.
pub(super) fn taken() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmRSS:")
}

/// The narrowest of all limits that the files below `root` tell of; none where there are no such files.
fn hard_limit(root: &Path, threads: usize) -> Option<HardLimit> {
    let status = fs::read_to_string(root.join("proc/self/status")).unwrap_or_default();
    let own = kibibytes(&status, "VmRSS:").unwrap_or(0);
    let groups = control_groups(root).into_iter().filter_map(|group| group.left(own));
    let groups = groups.map(|bytes| HardLimit { bytes, by: LimitedBy::ControlGroup });
    let limits = fs::read_to_string(root.join("proc/self/limits")).unwrap_or_default();
    let process = process_limits(&limits, threads).into_iter().map(|bytes| HardLimit { bytes, by: LimitedBy::Process });
    groups.chain(process).min_by_key(|limit| limit.bytes)
}

/// A number of kibibytes in the text of /proc/PID/status, in bytes.
///
/// # Source
/// proc_pid_status(5).
fn kibibytes(status: &str, name: &str) -> Option<u64> {
    number_after(status, name)?.checked_mul(1024)
}

/// The number that follows `name` at the beginning of a line.
fn number_after(text: &str, name: &str) -> Option<u64> {
    let words = text.lines().find_map(|line| line.strip_prefix(name))?;
    words.split_whitespace().next()?.parse().ok()
}

/// What the text of /proc/PID/limits leaves to a program's data.
///
/// Threads reserve address space that they do not fill. Where that is short, the C library does without: no more than
/// half of it is counted as taken by them.
///
/// # Source
/// proc_pid_limits(5); getrlimit(2): RLIMIT_AS, RLIMIT_DATA.
fn process_limits(limits: &str, threads: usize) -> Vec<u64> {
    let reserved = THREAD_SPACE.saturating_mul(threads as u64);
    let space = number_after(limits, "Max address space").map(|limit| limit - reserved.min(limit / 2));
    space.into_iter().chain(number_after(limits, "Max data size")).collect()
}

/// How the two versions of control groups call the files of a group.
#[derive(Debug, Clone, Copy)]
struct GroupFiles {
    limit: &'static str,
    taken: &'static str,
    /// What of the memory taken is files that the kernel drops when it needs room, in the file `memory.stat`.
    dropped: &'static str,
}

/// # Source
/// Linux, Documentation/admin-guide/cgroup-v2.rst.
const VERSION_2: GroupFiles = GroupFiles { limit: "memory.max", taken: "memory.current", dropped: "inactive_file " };

/// # Source
/// Linux, Documentation/admin-guide/cgroup-v1/memory.rst.
const VERSION_1: GroupFiles =
    GroupFiles { limit: "memory.limit_in_bytes", taken: "memory.usage_in_bytes", dropped: "total_inactive_file " };

/// A control group that this program is in: its own, or one around it.
#[derive(Debug)]
struct ControlGroup {
    folder: PathBuf,
    files: GroupFiles,
}

impl ControlGroup {
    /// What its limit leaves to this program, which has taken `own` bytes; `None` without a limit.
    fn left(&self, own: u64) -> Option<u64> {
        let text = |name: &str| fs::read_to_string(self.folder.join(name)).ok();
        let number = |name: &str| text(name)?.trim().parse::<u64>().ok();
        // "max" is no number.
        let limit = number(self.files.limit).filter(|&limit| limit < NO_LIMIT)?;
        let taken = number(self.files.taken).unwrap_or(0);
        let stat = text("memory.stat").unwrap_or_default();
        let dropped = number_after(&stat, self.files.dropped).unwrap_or(0);
        let others = taken.saturating_sub(dropped).saturating_sub(own);
        Some(limit.saturating_sub(others))
    }
}

/// The groups of memory that this program is in, each with all those around it, as far as they are seen from here.
///
/// # Source
/// cgroups(7): /proc/PID/cgroup; proc_pid_mountinfo(5).
fn control_groups(root: &Path) -> Vec<ControlGroup> {
    let text = |name: &str| fs::read_to_string(root.join(name)).unwrap_or_default();
    let (memberships, mounts) = (text("proc/self/cgroup"), text("proc/self/mountinfo"));
    let mut groups = Vec::new();
    for line in memberships.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let files = match controllers {
            "" => VERSION_2,
            controllers if controllers.split(',').any(|one| one == "memory") => VERSION_1,
            _ => continue,
        };
        let Some(mount) = mounts.lines().find_map(|line| Mount::of(line, controllers.is_empty())) else { continue };
        // Seen from within a container, the group may lie above what is mounted: its own is the top one then.
        let inside = Path::new(path).strip_prefix(mount.group).unwrap_or(Path::new(""));
        let top = root.join(mount.place.trim_start_matches('/'));
        groups.extend(inside.ancestors().map(|group| ControlGroup { folder: top.join(group), files }));
    }
    groups
}

/// A mounted hierarchy of control groups.
#[derive(Debug)]
struct Mount<'a> {
    /// The group that is seen at its place.
    group: &'a str,
    place: &'a str,
}

impl<'a> Mount<'a> {
    /// What a line of /proc/PID/mountinfo says, if it is of the version asked for and of memory.
    fn of(line: &'a str, is_version_2: bool) -> Option<Self> {
        let (place, system) = line.split_once(" - ")?;
        let mut system = system.split(' ');
        let is_wanted = match system.next()? {
            "cgroup2" => is_version_2,
            "cgroup" => !is_version_2 && system.nth(1)?.split(',').any(|option| option == "memory"),
            _ => false,
        };
        let mut fields = place.split(' ').skip(3);
        let (group, place) = (fields.next()?, fields.next()?);
        is_wanted.then_some(Self { group, place })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEBIBYTE: u64 = 1 << 20;

    /// A folder that looks like the root of a system.
    struct System(tempfile::TempDir);

    impl System {
        fn new(files: &[(&str, &str)]) -> Self {
            let system = Self(tempfile::tempdir().expect("a folder"));
            for (name, text) in files {
                let path = system.0.path().join(name);
                fs::create_dir_all(path.parent().expect("a folder")).expect("made");
                fs::write(path, text).expect("written");
            }
            system
        }

        fn hard_limit(&self) -> Option<HardLimit> {
            hard_limit(self.0.path(), 2)
        }
    }

    const MOUNTED_2: (&str, &str) = (
        "proc/self/mountinfo",
        "24 1 0:22 / /proc rw - proc proc rw\n30 24 0:26 / /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw,nsdelegate\n",
    );

    #[test]
    fn the_narrowest_of_nested_groups_counts() {
        let system = System::new(&[
            MOUNTED_2,
            ("proc/self/cgroup", "0::/outer/inner\n"),
            ("proc/self/status", "Name:\ttrueup\nVmRSS:\t  10240 kB\n"),
            ("sys/fs/cgroup/outer/memory.max", "157286400\n"),
            ("sys/fs/cgroup/outer/memory.current", "52428800\n"),
            ("sys/fs/cgroup/outer/memory.stat", "anon 1\ninactive_file 20971520\n"),
            ("sys/fs/cgroup/outer/inner/memory.max", "max\n"),
            ("sys/fs/cgroup/outer/inner/memory.current", "41943040\n"),
        ]);
        // 150 MiB, of which others have taken 50 - 20 - 10.
        let expected = HardLimit { bytes: 130 * MEBIBYTE, by: LimitedBy::ControlGroup };
        assert_eq!(system.hard_limit(), Some(expected));
    }

    #[test]
    fn groups_of_version_1_are_read_beside_those_of_version_2() {
        let mounted = "30 24 0:26 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n\
                       31 24 0:27 /docker/7 /sys/fs/cgroup/memory ro,nosuid - cgroup cgroup rw,memory\n";
        let system = System::new(&[
            ("proc/self/mountinfo", mounted),
            ("proc/self/cgroup", "9:cpu,cpuacct:/docker/7/a\n5:memory:/docker/7/a/b\n0::/docker/7/a\n"),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n"),
            ("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "104857600\n"),
            ("sys/fs/cgroup/memory/a/memory.usage_in_bytes", "1048576\n"),
            ("sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", "209715200\n"),
        ]);
        let expected = HardLimit { bytes: 99 * MEBIBYTE, by: LimitedBy::ControlGroup };
        assert_eq!(system.hard_limit(), Some(expected));
    }

    #[test]
    fn the_limits_of_the_process_count() {
        let limits = |space: &str, data: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max data size             {data}            unlimited            bytes     \n\
                 Max address space         {space}            unlimited            bytes     \n"
            )
        };
        // Two threads reserve 132 MiB.
        assert_eq!(process_limits(&limits("1048576000", "unlimited"), 2), [868 * MEBIBYTE]);
        assert_eq!(process_limits(&limits("104857600", "73400320"), 2), [50 * MEBIBYTE, 70 * MEBIBYTE]);
        assert!(process_limits(&limits("unlimited", "unlimited"), 2).is_empty());
        let system = System::new(&[("proc/self/limits", &limits("104857600", "73400320"))]);
        let expected = HardLimit { bytes: 50 * MEBIBYTE, by: LimitedBy::Process };
        assert_eq!(system.hard_limit(), Some(expected));
    }

    #[test]
    fn without_a_word_there_is_no_limit() {
        assert_eq!(System::new(&[]).hard_limit(), None);
        let odd = System::new(&[MOUNTED_2, ("proc/self/cgroup", "0::/../..\n0:\n\nx\n"), ("proc/self/limits", "Max")]);
        assert_eq!(odd.hard_limit(), None);
        let MachineMemory { total, free, .. } = memory(1);
        assert!(total > 0 && free <= total);
    }
}
