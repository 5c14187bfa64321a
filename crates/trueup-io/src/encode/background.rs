//! What shows where the panorama is transparent.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use trueup_core::options::{ChoiceDescription, OptionValue};

/// What shows where no photograph is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Background {
    /// Transparent where the format can say so, else black.
    #[default]
    Auto,
    /// Transparent; formats without transparency are refused.
    Transparent,
    /// A color, in every format: levels of red, green and blue in the color space of the file.
    Color([u8; 3]),
}

/// Colors that have names.
const NAMED: [(&str, Background); 3] =
    [("black", Background::BLACK), ("gray", Background::GRAY), ("white", Background::WHITE)];

impl Background {
    /// Black.
    pub const BLACK: Self = Self::Color([0; 3]);
    /// Middle gray.
    pub const GRAY: Self = Self::Color([128; 3]);
    /// White.
    pub const WHITE: Self = Self::Color([255; 3]);

    /// The levels that transparent parts are laid over.
    pub(super) fn levels(self) -> [u8; 3] {
        match self {
            Self::Auto | Self::Transparent => [0; 3],
            Self::Color(levels) => levels,
        }
    }
}

impl FromStr for Background {
    type Err = String;

    /// `auto`, `transparent`, a name, or red, green and blue in hexadecimal digits, two or one each: `#ff8800`, `#f80`.
    fn from_str(text: &str) -> Result<Self, String> {
        let lower = text.trim().to_ascii_lowercase();
        let named = || NAMED.iter().find(|(name, _)| *name == lower).map(|(_, color)| *color);
        match lower.as_str() {
            "auto" => Some(Self::Auto),
            "transparent" => Some(Self::Transparent),
            _ => lower.strip_prefix('#').and_then(levels_of).map(Self::Color).or_else(named),
        }
        .ok_or_else(|| format!("\"{text}\" is no background; allowed are {}", Self::choices().join(", ")))
    }
}

/// Levels of six hexadecimal digits, or of three that each stand for two.
fn levels_of(digits: &str) -> Option<[u8; 3]> {
    /// A digit that stands for two: 0xf becomes 0xff.
    const TWICE: u8 = 0x11;
    let digits: Vec<u8> = digits.chars().map(|digit| Some(digit.to_digit(16)? as u8)).collect::<Option<Vec<u8>>>()?;
    match digits[..] {
        [r, g, b] => Some([r, g, b].map(|digit| TWICE * digit)),
        [r, r_low, g, g_low, b, b_low] => Some([[r, r_low], [g, g_low], [b, b_low]].map(|[high, low]| 16 * high + low)),
        _ => None,
    }
}

impl fmt::Display for Background {
    /// As it can be read again.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = NAMED.iter().find(|(_, color)| color == self).map(|(name, _)| *name);
        match (self, name) {
            (Self::Auto, _) => formatter.write_str("auto"),
            (Self::Transparent, _) => formatter.write_str("transparent"),
            (Self::Color(_), Some(name)) => formatter.write_str(name),
            (Self::Color([r, g, b]), None) => write!(formatter, "#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

impl Serialize for Background {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Background {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

impl OptionValue for Background {
    fn display(&self) -> String {
        self.to_string()
    }

    fn choices() -> &'static [&'static str] {
        &["auto", "transparent", "black", "gray", "white", "#rgb", "#rrggbb"]
    }

    fn described_choices() -> Vec<ChoiceDescription> {
        [
            ("auto", "Transparent where the format can say so, else black."),
            ("transparent", "Transparent; formats that cannot say so are refused."),
            ("black", "Black, in every format, as the next."),
            ("gray", "Middle gray, #808080."),
            ("white", "White."),
            ("#rgb", "Red, green and blue, a hexadecimal digit each: #f80 is #ff8800."),
            ("#rrggbb", "The same with two digits each, in the color space of the file."),
        ]
        .map(|(name, meaning)| ChoiceDescription::new(name, &[meaning]))
        .to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_read_as_people_write_them_and_written_back() {
        for (text, background, back) in [
            ("auto", Background::Auto, "auto"),
            ("Transparent", Background::Transparent, "transparent"),
            ("gray", Background::GRAY, "gray"),
            ("#ffffff", Background::WHITE, "white"),
            ("#F80", Background::Color([255, 136, 0]), "#ff8800"),
            (" #0a1B2c ", Background::Color([10, 27, 44]), "#0a1b2c"),
        ] {
            assert_eq!(text.parse(), Ok(background), "{text}");
            assert_eq!(background.to_string(), back);
        }
        for text in ["", "#", "red", "ffffff", "#ff", "#ffff", "#fffff", "#fffffff", "#ggg", "#+f+f+f", "#ÿÿÿ"] {
            let said = text.parse::<Background>().expect_err(text);
            assert!(said.ends_with("allowed are auto, transparent, black, gray, white, #rgb, #rrggbb"), "{said}");
        }
    }

    #[test]
    fn every_choice_is_described() {
        let described: Vec<&str> = Background::described_choices().iter().map(|choice| choice.name).collect();
        assert_eq!(described, Background::choices());
    }
}
