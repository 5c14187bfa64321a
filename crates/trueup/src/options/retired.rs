//! Options of earlier versions: what became of each, so that nobody's setting is passed over in silence.

/// What became of an option.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Retired {
    /// It has another name.
    Renamed(&'static str),
    /// Nobody had a reason to change it: value and unit that hold now.
    Fixed(&'static str),
}

impl Retired {
    /// What became of the option `name`, `table.option`; `None` if it never was one.
    pub fn of(name: &str) -> Option<Self> {
        RETIRED.binary_search_by(|(old, _)| (*old).cmp(name)).ok().map(|found| RETIRED[found].1)
    }

    /// What to tell who sets the option `name`.
    pub fn reason(self, name: &str) -> String {
        match self {
            Self::Renamed(new) => format!("\"{name}\" is now \"{new}\""),
            Self::Fixed("") => format!("\"{name}\" is no option any more"),
            Self::Fixed(value) => format!("\"{name}\" is now fixed at {value}"),
        }
    }

    /// Whether `value`, as a file of an earlier version has it, is what holds now.
    pub fn is_now(self, value: &toml::Value) -> bool {
        let Self::Fixed(now) = self else { return false };
        let now = now.split_whitespace().next().unwrap_or_default();
        match value {
            toml::Value::Float(value) => now.parse() == Ok(*value),
            toml::Value::Integer(value) => now.parse() == Ok(*value as f64),
            toml::Value::Boolean(value) => now.parse() == Ok(*value),
            toml::Value::String(value) => now == value,
            _ => false,
        }
    }
}

use Retired::{Fixed, Renamed};

/// Options of version 0.1, sorted by name.
const RETIRED: [(&str, Retired); 8] = [
    ("cache.max_bytes", Renamed("resources.cache_bytes")),
    ("similarity.prior", Fixed("vpg (the method has its prior: stitch.method)")),
    ("stitch.memory", Renamed("resources.memory")),
    ("stitch.scratch", Renamed("resources.scratch")),
    ("stitch.seed", Renamed("random.seed")),
    ("stitch.thumbnail_pixels", Fixed("30000 px")),
    ("stitch.working_pixels", Renamed("working.pixels")),
    ("vanishing.outlier_share", Fixed("0")),
];

#[cfg(test)]
mod tests {
    use super::super::StitchOptions;
    use super::*;

    #[test]
    fn the_table_is_sorted_and_leads_to_options_that_are() {
        assert!(RETIRED.is_sorted_by(|one, two| one.0 < two.0));
        let known: Vec<String> = StitchOptions::describe().into_iter().map(|row| row.name).collect();
        for (old, became) in RETIRED {
            assert!(!known.iter().any(|name| name == old), "{old} is an option");
            if let Renamed(new) = became {
                assert!(known.iter().any(|name| name == new), "{old} leads to {new}, which is none");
            }
        }
    }

    #[test]
    fn a_fixed_value_is_recognized() {
        let fixed = Fixed("30000 px");
        assert!(fixed.is_now(&toml::Value::Float(30000.0)) && fixed.is_now(&toml::Value::Integer(30000)));
        assert!(!fixed.is_now(&toml::Value::Float(20000.0)) && !Renamed("x.y").is_now(&toml::Value::Float(0.0)));
        assert!(Fixed("true").is_now(&toml::Value::Boolean(true)));
        assert!(Fixed("scharr").is_now(&toml::Value::String("scharr".to_owned())));
    }
}
