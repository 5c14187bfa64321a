//! Which of the paper's equations are taken as they are printed.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use trueup_core::options::{ChoiceDescription, OptionValue};

/// A set of equations of the paper that this program otherwise corrects.
///
/// Written as `none`, `all`, or the names of its members joined by `+`, as in `vertical+scale`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrintedEquations {
    /// Eq. 3 and 4: the dominant directions fit all photographs, with no limit to what one of them may cost.
    pub dominant: bool,
    /// Eq. 5: the vertical is the dominant direction nearest to the reference photograph's y axis.
    pub vertical: bool,
    /// Eq. 6: a photograph's roll is that of its directions in the common frame.
    pub alpha: bool,
    /// Eq. 11: a photograph in which matches span more is enlarged.
    pub scale: bool,
    /// Eq. 15: the divergence is a sum over vanishing points, divided by no number of photographs.
    pub divergence: bool,
}

/// The names of the members, in their order, with what they mean.
const MEMBERS: [(&str, &str); 5] = [
    ("dominant", "Eq. 3 and 4: all photographs count for the dominant directions, whatever one of them costs."),
    ("vertical", "Eq. 5: the vertical is the direction nearest to the reference photograph's y axis."),
    ("alpha", "Eq. 6: rolls are those of directions in the common frame, about the same for all photographs."),
    ("scale", "Eq. 11: a photograph in which matches span more is enlarged."),
    ("divergence", "Eq. 15: the divergence is a sum over vanishing points, and grows with the number of photographs."),
];

impl PrintedEquations {
    /// None: all are corrected.
    pub const NONE: Self = Self { dominant: false, vertical: false, alpha: false, scale: false, divergence: false };
    /// All of them.
    pub const ALL: Self = Self { dominant: true, vertical: true, alpha: true, scale: true, divergence: true };

    /// Whether each of [`MEMBERS`] is in the set.
    fn flags(self) -> [bool; MEMBERS.len()] {
        [self.dominant, self.vertical, self.alpha, self.scale, self.divergence]
    }
}

impl FromStr for PrintedEquations {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "none" => return Ok(Self::NONE),
            "all" => return Ok(Self::ALL),
            _ => {}
        }
        let mut set = Self::NONE;
        for name in text.split('+').map(str::trim) {
            let member = match name {
                "dominant" => &mut set.dominant,
                "vertical" => &mut set.vertical,
                "alpha" => &mut set.alpha,
                "scale" => &mut set.scale,
                "divergence" => &mut set.divergence,
                _ => return Err(format!("\"{name}\" is none of {}", MEMBERS.map(|(name, _)| name).join(", "))),
            };
            *member = true;
        }
        Ok(set)
    }
}

impl fmt::Display for PrintedEquations {
    /// As it can be read again.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NONE => formatter.write_str("none"),
            Self::ALL => formatter.write_str("all"),
            some => {
                let members = MEMBERS.iter().zip(some.flags()).filter(|(_, taken)| *taken);
                formatter.write_str(&members.map(|((name, _), _)| *name).collect::<Vec<_>>().join("+"))
            }
        }
    }
}

impl Serialize for PrintedEquations {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for PrintedEquations {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

impl OptionValue for PrintedEquations {
    fn display(&self) -> String {
        self.to_string()
    }

    fn choices() -> &'static [&'static str] {
        &["none", "all", "dominant", "vertical", "alpha", "scale", "divergence"]
    }

    fn described_choices() -> Vec<ChoiceDescription> {
        let all = [("none", "All are corrected."), ("all", "All are as printed.")];
        all.iter().chain(&MEMBERS).map(|(name, meaning)| ChoiceDescription::new(name, &[meaning])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_can_be_read_again() {
        for text in ["none", "all", "dominant", "vertical+scale", "alpha+scale+divergence"] {
            let set: PrintedEquations = text.parse().expect(text);
            assert_eq!(set.to_string(), text);
        }
        let every = MEMBERS.map(|(name, _)| name).join("+");
        assert_eq!(every.parse(), Ok(PrintedEquations::ALL));
        for (index, (name, _)) in MEMBERS.iter().enumerate() {
            let set: PrintedEquations = name.parse().expect(name);
            assert_eq!(set.flags().iter().position(|&taken| taken), Some(index), "{name}");
        }
    }

    #[test]
    fn an_unknown_name_is_refused_with_those_that_are_known() {
        let reason = "vertical+beta".parse::<PrintedEquations>().expect_err("beta is no member");
        assert_eq!(reason, "\"beta\" is none of dominant, vertical, alpha, scale, divergence");
        assert!("".parse::<PrintedEquations>().is_err());
    }
}
