//! Amounts of memory: how users write them, and the option that limits it.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::error::{Error, Result};
use crate::options::OptionValue;

/// Units, the largest first: name in lower case and bytes. The first three are those that amounts are shown in.
const UNITS: [(&str, f64); 9] = [
    ("gb", 1e9),
    ("mb", 1e6),
    ("kb", 1e3),
    ("gib", 1_073_741_824.0),
    ("mib", 1_048_576.0),
    ("kib", 1024.0),
    ("tb", 1e12),
    ("g", 1e9),
    ("m", 1e6),
];

/// A number of bytes for people: `750 MB`, `8.1 GB`.
fn bytes_in_words(bytes: u64) -> String {
    let bytes = bytes as f64;
    // What would round to a thousand of a unit is one of the next.
    const NEXT_UNIT: f64 = 999.5;
    if bytes >= NEXT_UNIT * 1e6 {
        format!("{:.1} GB", bytes / 1e9)
    } else if bytes >= NEXT_UNIT * 1e3 {
        format!("{:.0} MB", bytes / 1e6)
    } else {
        format!("{:.0} kB", (bytes / 1e3).ceil())
    }
}

/// A number of bytes that are needed, for people: rounded up, so that as many as are named are enough.
pub fn needed_in_words(bytes: u64) -> String {
    bytes_in_words(bytes.checked_next_multiple_of(digit_bytes(bytes)).unwrap_or(bytes))
}

/// A number of bytes that there are, for people: rounded down, so that no more are named, and fewer than
/// [`needed_in_words`] of more.
pub fn room_in_words(bytes: u64) -> String {
    bytes_in_words(bytes - bytes % digit_bytes(bytes))
}

/// What the last digit that is shown of so many bytes stands for.
fn digit_bytes(bytes: u64) -> u64 {
    match bytes {
        1_000_000_000.. => 100_000_000,
        1_000_000.. => 1_000_000,
        _ => 1_000,
    }
}

/// Asks for `bytes` of memory in one piece and gives them back, so that a large allocation which the system would
/// refuse is an error and not the program's end. `subject` is what they are for.
///
/// # Errors
/// [`Error::Limits`] if they are not to be had.
pub fn check_room(subject: impl fmt::Display, bytes: usize) -> Result<()> {
    let mut room: Vec<u8> = Vec::new();
    // Seen from outside: a piece that nothing is done with would never be asked for.
    let taken = std::hint::black_box(&mut room).try_reserve_exact(bytes);
    drop(std::hint::black_box(room));
    taken.map_err(|_| Error::Limits {
        subject: subject.to_string(),
        needed: format!("{} of memory", needed_in_words(bytes as u64)),
        allowed: "less than that".to_owned(),
        hint: "Raise the limit of the shell or the container (ulimit -v), or give smaller photographs.".to_owned(),
    })
}

/// How much memory the work may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MemoryBudget {
    /// A share of the machine's.
    #[default]
    Auto,
    /// So many bytes.
    Bytes(u64),
}

impl FromStr for MemoryBudget {
    type Err = String;

    /// `auto`, or a number with a unit: `2GB`, `512 MB`, `1.5GiB`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let text = text.trim().to_ascii_lowercase();
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let digits = text.find(|one: char| one.is_ascii_alphabetic()).unwrap_or(text.len());
        let (number, unit) = (text[..digits].trim(), &text[digits..]);
        let number: Option<f64> = number.parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
        let unit = UNITS.iter().find(|(name, _)| *name == unit);
        match (number, unit) {
            // The cast saturates.
            (Some(number), Some((_, bytes))) => Ok(Self::Bytes((number * bytes).round() as u64)),
            _ => Err(format!("\"{text}\" is no amount of memory; write auto, or one such as 2GB or 512MB")),
        }
    }
}

impl fmt::Display for MemoryBudget {
    /// As it can be read again.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => formatter.write_str("auto"),
            Self::Bytes(bytes) => write!(formatter, "{}MB", *bytes as f64 / 1e6),
        }
    }
}

impl Serialize for MemoryBudget {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for MemoryBudget {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

impl OptionValue for MemoryBudget {
    fn display(&self) -> String {
        self.to_string()
    }

    fn choices() -> &'static [&'static str] {
        &["auto", "2GB", "512MB", "..."]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_read_as_people_write_them() {
        for (text, bytes) in [
            ("2GB", 2_000_000_000),
            ("512 mb", 512_000_000),
            ("1.5GiB", 1_610_612_736),
            ("2g", 2_000_000_000),
            ("64KiB", 65_536),
            ("0.001TB", 1_000_000_000),
        ] {
            assert_eq!(text.parse(), Ok(MemoryBudget::Bytes(bytes)), "{text}");
        }
        assert_eq!("Auto".parse(), Ok(MemoryBudget::Auto));
        for text in ["", "2", "GB", "-1GB", "0MB", "2 bytes", "infGB", "nanMB", "1e400GB"] {
            assert!(text.parse::<MemoryBudget>().is_err(), "{text}");
        }
    }

    #[test]
    fn what_is_shown_can_be_read_again() {
        let bytes = [1_234_567_000, 1_181_116_006, 7].map(MemoryBudget::Bytes);
        for budget in bytes.into_iter().chain([MemoryBudget::Auto]) {
            assert_eq!(budget.to_string().parse(), Ok(budget));
        }
    }

    #[test]
    fn memory_that_is_not_to_be_had_is_an_error() {
        assert!(check_room("a little", 1 << 20).is_ok());
        // More than a program can address.
        for bytes in [usize::MAX, usize::MAX >> 2] {
            let refused = check_room("decoding a.jpg", bytes).expect_err("too much").to_string();
            assert!(refused.starts_with("decoding a.jpg: ") && refused.contains("less than that allowed"), "{refused}");
        }
    }

    /// What is asked for is enough, and never what was given already.
    #[test]
    fn needs_are_rounded_up_and_room_is_rounded_down() {
        let both = |bytes: u64| (needed_in_words(bytes), room_in_words(bytes));
        let words = |needed: &str, room: &str| (needed.to_owned(), room.to_owned());
        assert_eq!(both(212_600_000), words("213 MB", "212 MB"));
        assert_eq!(both(213_000_000), words("213 MB", "213 MB"));
        assert_eq!(both(1_940_000_001), words("2.0 GB", "1.9 GB"));
        assert_eq!(both(999_400_000), words("1.0 GB", "999 MB"));
        assert_eq!(both(1_001), words("2 kB", "1 kB"));
        for bytes in (0..40).map(|power| 3_u64.pow(power) / 2) {
            let parsed = |words: String| match words.parse() {
                Ok(MemoryBudget::Bytes(bytes)) => bytes,
                other => panic!("{words}: {other:?}"),
            };
            if bytes >= 1_000 {
                assert!(parsed(needed_in_words(bytes)) >= bytes && parsed(room_in_words(bytes)) <= bytes, "{bytes}");
            }
        }
    }

    #[test]
    fn amounts_are_shown_with_the_unit_that_fits() {
        let shown = [0, 1, 999_499, 999_500, 8_400_000, 999_600_000, 8_123_000_000].map(bytes_in_words);
        assert_eq!(shown, ["0 kB", "1 kB", "1000 kB", "1 MB", "8 MB", "1.0 GB", "8.1 GB"]);
    }
}
