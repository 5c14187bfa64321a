//! Options are structs with defaults that know their own ranges, units and meaning.
//!
//! [`options!`](crate::options!) declares one: from a single declaration come the struct, its `Default`, its serde form
//! (unknown fields denied), its validation and the rows of the option reference. Fronts (command line, bindings, pages)
//! read those; none holds a default of its own.

use serde::Serialize;

use crate::error::{Error, Result};
pub use crate::invalid_option::InvalidOption;

/// The values an option may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Allowed {
    /// Every value of the type.
    Any,
    /// Finite numbers from `min` to `max`, both included.
    Between {
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
}

/// Finite numbers from `min` to `max`, both included.
pub const fn between(min: f64, max: f64) -> Allowed {
    Allowed::Between { min, max }
}

/// A type an option can have.
pub trait OptionValue {
    /// The value as a number, if it is one; ranges apply to it.
    fn number(&self) -> Option<f64> {
        None
    }
    /// The value as the user writes it.
    fn display(&self) -> String;
    /// The names a choice may take; empty for other types.
    fn choices() -> &'static [&'static str]
    where
        Self: Sized,
    {
        &[]
    }
    /// The alternatives of a choice with their meanings; empty for other types.
    fn described_choices() -> Vec<ChoiceDescription>
    where
        Self: Sized,
    {
        Vec::new()
    }
}

/// One alternative of a choice.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ChoiceDescription {
    /// The alternative as the user writes it.
    pub name: &'static str,
    /// What it means.
    pub meaning: String,
}

impl ChoiceDescription {
    /// An alternative whose meaning is given in the lines of its documentation.
    pub fn new(name: &'static str, documentation: &[&str]) -> Self {
        Self { name, meaning: joined(documentation) }
    }
}

/// The lines of a documentation comment as one text.
pub fn joined(documentation: &[&str]) -> String {
    documentation.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ").trim().to_owned()
}

macro_rules! number_option_values {
    ($($type:ty),*) => {$(
        impl OptionValue for $type {
            #[allow(clippy::cast_lossless, clippy::cast_precision_loss)]
            fn number(&self) -> Option<f64> {
                Some(*self as f64)
            }
            fn display(&self) -> String {
                self.to_string()
            }
        }
    )*};
}
number_option_values!(u8, u32, u64, usize, f32, f64);

impl OptionValue for bool {
    fn display(&self) -> String {
        self.to_string()
    }
    fn choices() -> &'static [&'static str] {
        &["true", "false"]
    }
}

impl OptionValue for String {
    fn display(&self) -> String {
        self.clone()
    }
}

/// Who has a reason to change an option.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tier {
    /// Everyone who makes panoramas.
    Basic,
    /// Those who know the method, for photographs that are out of the ordinary, or for experiments.
    Expert,
}

/// The tier of an option: basic where its declaration says so. Used by the code that [`options!`](crate::options!)
/// generates.
pub const fn tier_of(basic: &[&str]) -> Tier {
    if basic.is_empty() { Tier::Expert } else { Tier::Basic }
}

/// One row of the option reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OptionDescription {
    /// Stage and option, `table.option`.
    pub name: String,
    /// The default as the user would write it.
    pub default: String,
    /// The allowed values in words.
    pub allowed: String,
    /// The unit; empty for pure numbers and choices.
    pub unit: &'static str,
    /// What it means and when to change it.
    pub meaning: String,
    /// Who has a reason to change it.
    pub tier: Tier,
    /// The alternatives of a choice with their meanings; empty for other options.
    pub choices: Vec<ChoiceDescription>,
}

/// A stage's options, declared by [`options!`](crate::options!).
pub trait StageOptions: Default {
    /// The stage's name, the first half of `table.option`.
    const STAGE: &'static str;

    /// The options outside their ranges; empty when all is well.
    fn invalid(&self) -> Vec<InvalidOption>;

    /// Refuses options outside their ranges.
    ///
    /// # Errors
    /// [`Error::Options`] with all of them.
    fn check(&self) -> Result<()> {
        let invalid = self.invalid();
        if invalid.is_empty() { Ok(()) } else { Err(Error::Options(invalid)) }
    }

    /// A row per option, in the order of declaration, with the defaults.
    fn describe() -> Vec<OptionDescription>;
}

/// The allowed values of an option of type `T`, in words.
pub fn allowed_in_words<T: OptionValue>(allowed: Allowed) -> String {
    match allowed {
        Allowed::Between { min, max } => format!("{min} to {max}"),
        Allowed::Any if T::choices().is_empty() => "any".to_owned(),
        Allowed::Any => T::choices().join(" | "),
    }
}

/// Checks one option; used by the code that [`options!`](crate::options!) generates.
pub fn check_option<T: OptionValue>(stage: &str, name: &str, value: &T, allowed: Allowed) -> Option<InvalidOption> {
    let Allowed::Between { min, max } = allowed else { return None };
    let inside = value.number().is_some_and(|number| number >= min && number <= max);
    (!inside).then(|| InvalidOption {
        name: format!("{stage}.{name}"),
        value: value.display(),
        allowed: allowed_in_words::<T>(allowed),
    })
}

/// Declares a stage's options: struct, defaults, ranges, units, reference. An option that everyone has a reason to
/// change is marked `basic` after its unit; the others are for experts.
///
/// ```
/// trueup_core::options! {
///     /// How features are found.
///     pub struct FeatureOptions("features") {
///         /// Scale levels per octave.
///         levels_per_octave: u32 = 3, between(1.0, 8.0), "levels", basic;
///         /// Whether descriptors are compared by the Hellinger kernel.
///         root_sift: bool = false, Allowed::Any, "";
///     }
/// }
/// use trueup_core::options::StageOptions;
/// let options = FeatureOptions { levels_per_octave: 9, ..FeatureOptions::default() };
/// assert_eq!(options.invalid()[0].to_string(), "invalid features.levels_per_octave = 9 (allowed: 1 to 8)");
/// ```
#[macro_export]
macro_rules! options {
    (
        $(#[doc = $struct_doc:literal])*
        pub struct $name:ident($stage:literal) {
            $(
                $(#[doc = $doc:literal])*
                $field:ident : $type:ty = $default:expr, $allowed:expr, $unit:literal $(, $tier:ident)?;
            )*
        }
    ) => {
        $(#[doc = $struct_doc])*
        #[allow(unreachable_pub)]
        #[derive(Debug, Clone, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name {
            $(
                $(#[doc = $doc])*
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $crate::options::StageOptions for $name {
            const STAGE: &'static str = $stage;

            fn invalid(&self) -> Vec<$crate::options::InvalidOption> {
                #[allow(unused_imports)]
                use $crate::options::{Allowed, between};
                let checks = [
                    $($crate::options::check_option($stage, stringify!($field), &self.$field, $allowed),)*
                ];
                checks.into_iter().flatten().collect()
            }

            fn describe() -> Vec<$crate::options::OptionDescription> {
                #[allow(unused_imports)]
                use $crate::options::{Allowed, OptionValue, between};
                let defaults = Self::default();
                vec![$(
                    $crate::options::OptionDescription {
                        name: concat!($stage, ".", stringify!($field)).to_owned(),
                        default: defaults.$field.display(),
                        allowed: $crate::options::allowed_in_words::<$type>($allowed),
                        unit: $unit,
                        meaning: $crate::options::joined(&[$($doc),*]),
                        tier: $crate::options::tier_of(&[$(stringify!($tier))?]),
                        choices: <$type>::described_choices(),
                    },
                )*]
            }
        }
    };
}

/// Declares an option that is a choice between named alternatives, written in kebab case.
///
/// ```
/// trueup_core::choice! {
///     /// Which kernel weighs the matches.
///     pub enum Kernel {
///         /// As published.
///         Paper = "paper",
///         /// As coded.
///         Code = "code",
///     }
/// }
/// use trueup_core::options::OptionValue;
/// assert_eq!(Kernel::choices(), ["paper", "code"]);
/// ```
#[macro_export]
macro_rules! choice {
    (
        $(#[doc = $enum_doc:literal])*
        pub enum $name:ident {
            $( $(#[doc = $doc:literal])* $variant:ident = $text:literal, )*
        }
    ) => {
        $(#[doc = $enum_doc])*
        #[allow(unreachable_pub)]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ::serde::Serialize, ::serde::Deserialize)]
        pub enum $name {
            $( $(#[doc = $doc])* #[serde(rename = $text)] $variant, )*
        }

        #[allow(unreachable_pub)]
        impl $name {
            /// The names of the alternatives, in their order.
            #[allow(dead_code)]
            pub const NAMES: &'static [&'static str] = &[$($text),*];

            /// The alternative of this name, as [`$crate::options::OptionValue::display`] writes it.
            #[allow(dead_code)]
            pub fn named(name: &str) -> Option<Self> {
                match name { $($text => Some(Self::$variant),)* _ => None }
            }
        }

        impl $crate::options::OptionValue for $name {
            fn display(&self) -> String {
                match self { $(Self::$variant => $text.to_owned(),)* }
            }
            fn choices() -> &'static [&'static str] {
                &[$($text),*]
            }
            fn described_choices() -> Vec<$crate::options::ChoiceDescription> {
                vec![$($crate::options::ChoiceDescription::new($text, &[$($doc),*]),)*]
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    choice! {
        /// A test choice.
        pub enum Mode {
            /// First.
            Fast = "fast",
            /// Second,
            /// over two lines.
            Exact = "exact",
        }
    }

    options! {
        /// Test options.
        pub struct TestOptions("test") {
            /// A length
            /// over two lines.
            length_px: f64 = 2.5, between(0.0, 10.0), "px", basic;
            /// A count.
            count: usize = 4, between(1.0, 8.0), "";
            /// A choice.
            mode: Mode = Mode::Exact, Allowed::Any, "";
        }
    }

    #[test]
    fn every_bad_value_is_listed_with_its_range() {
        let bad = TestOptions { length_px: f64::NAN, count: 0, mode: Mode::Fast };
        let messages: Vec<String> = bad.invalid().iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            ["invalid test.length_px = NaN (allowed: 0 to 10)", "invalid test.count = 0 (allowed: 1 to 8)"]
        );
        assert!(TestOptions::default().invalid().is_empty());
    }

    #[test]
    fn description_carries_default_range_unit_and_meaning() {
        let rows = TestOptions::describe();
        assert_eq!(rows[0].name, "test.length_px");
        assert_eq!(rows[0].default, "2.5");
        assert_eq!(rows[0].allowed, "0 to 10");
        assert_eq!(rows[0].unit, "px");
        assert_eq!(rows[0].meaning, "A length over two lines.");
        assert_eq!((rows[0].tier, rows[1].tier), (Tier::Basic, Tier::Expert));
        assert_eq!(rows[2].default, "exact");
        assert_eq!(rows[2].allowed, "fast | exact");
        let choices: Vec<(&str, &str)> =
            rows[2].choices.iter().map(|choice| (choice.name, choice.meaning.as_str())).collect();
        assert_eq!(choices, [("fast", "First."), ("exact", "Second, over two lines.")]);
        assert!(rows[0].choices.is_empty());
    }

    #[test]
    fn unknown_fields_are_denied_and_missing_ones_default() {
        let parsed: TestOptions = serde_json::from_str(r#"{"count": 2, "mode": "fast"}"#).expect("valid options");
        assert_eq!(parsed, TestOptions { count: 2, mode: Mode::Fast, ..TestOptions::default() });
        assert!(serde_json::from_str::<TestOptions>(r#"{"cuont": 2}"#).is_err());
    }
}
