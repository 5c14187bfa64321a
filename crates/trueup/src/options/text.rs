//! Options from what people write: a TOML file, or one assignment.

use trueup_core::options::OptionDescription;
use trueup_core::{Error, Result};

use super::retired::Retired;
use super::{StitchOptions, as_written};

/// An option that has another value than its default.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangedOption {
    /// Its declaration.
    pub description: OptionDescription,
    /// Its value, as one writes it after `table.option=`.
    pub value: String,
    /// The default, written alike.
    pub default: String,
}

impl StitchOptions {
    /// Reads a TOML text with tables over the present values; what it does not name stays as it is.
    ///
    /// # Errors
    /// [`Error::Input`] for text that is not TOML, unknown stages or options, or values of the wrong type.
    pub fn merge_toml(&mut self, text: &str, file: &str) -> Result<()> {
        let wrong = |line: Option<usize>, reason: String| {
            let place = line.map_or(String::new(), |line| format!("line {line}: "));
            Error::input(
                file,
                format!("{place}{reason}"),
                "List stages, options and their ranges with `trueup options`.",
            )
        };
        let not_toml = |error: toml::de::Error| {
            let line = error.span().map(|place| line_at(text, place.start));
            wrong(line, format!("it is no TOML ({})", first_line(&error)))
        };
        let given: toml::Table = text.parse().map_err(not_toml)?;
        let mut merged = self.to_table()?;
        for (stage, values) in given {
            let toml::Value::Table(values) = values else {
                return Err(wrong(line_of(text, &[&stage]), format!("\"{stage}\" must be a table, [{stage}]")));
            };
            let mut known = merged.get_mut(&stage).and_then(toml::Value::as_table_mut);
            if known.is_none() && !values.keys().any(|option| Retired::of(&format!("{stage}.{option}")).is_some()) {
                return Err(wrong(line_of(text, &[&stage]), format!("there is no table \"{stage}\"")));
            }
            for (option, value) in values {
                match known.as_mut().and_then(|known| known.get_mut(&option)) {
                    Some(present) => *present = value,
                    None => {
                        let line = line_of(text, &[&stage, &option]);
                        return Err(wrong(line, no_option(&format!("{stage}.{option}"))));
                    }
                }
            }
        }
        *self = merged.try_into().map_err(|error: toml::de::Error| {
            // The last line of a wrong type's error names the option.
            let reason = error.to_string().trim_end().replace('\n', " ");
            wrong(self.line_of_wrong_type(text), reason)
        })?;
        Ok(())
    }

    /// The line of the first option in a TOML text that cannot have its value there, where it is the only one that
    /// changes.
    fn line_of_wrong_type(&self, text: &str) -> Option<usize> {
        let (given, own): (toml::Table, _) = (text.parse().ok()?, self.to_table().ok()?);
        let options = given.iter().filter_map(|(stage, values)| Some((stage, values.as_table()?)));
        let options = options.flat_map(|(stage, values)| values.iter().map(move |option| (stage, option)));
        let cannot_be = |stage: &str, option: &str, value: &toml::Value| {
            let mut changed = own.clone();
            if let Some(present) = changed.get_mut(stage).and_then(|stage| stage.get_mut(option)) {
                *present = value.clone();
            }
            changed.try_into::<Self>().is_err()
        };
        let lines = options
            .filter(|(stage, (option, value))| cannot_be(stage, option, value))
            .filter_map(|(stage, (option, _))| line_of(text, &[stage, option]));
        lines.min()
    }

    /// Sets one option from text, as in `table.option=value`.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no such option or the value is of the wrong type.
    pub fn set(&mut self, assignment: &str) -> Result<()> {
        let wrong = |reason: String| {
            Error::input(assignment, reason, "Write table.option=value; list the options with `trueup options`.")
        };
        let (name, value) = assignment.split_once('=').ok_or_else(|| wrong("there is no \"=\" in it".to_owned()))?;
        let (stage, option) =
            name.trim().split_once('.').ok_or_else(|| wrong("there is no \".\" in the name".to_owned()))?;
        let value = value.trim();
        let mut table = self.to_table()?;
        let known = table
            .get(stage)
            .and_then(|stage| stage.get(option))
            .cloned()
            .ok_or_else(|| wrong(no_option(&format!("{stage}.{option}"))))?;
        let parsed = match known {
            toml::Value::Float(_) => value.parse().ok().map(toml::Value::Float),
            toml::Value::Integer(_) => value.parse().ok().map(toml::Value::Integer),
            toml::Value::Boolean(_) => value.parse().ok().map(toml::Value::Boolean),
            _ => Some(toml::Value::String(value.to_owned())),
        };
        let allowed = || allowed_values(stage, option);
        let parsed =
            parsed.ok_or_else(|| wrong(format!("\"{value}\" is not {} (allowed: {})", in_words(&known), allowed())))?;
        if let Some(values) = table.get_mut(stage).and_then(toml::Value::as_table_mut) {
            values.insert(option.to_owned(), parsed);
        }
        // A number beyond its type (jpeg_quality=300) or an unknown choice fails here, before any range is looked at.
        let merged = table.try_into();
        *self =
            merged.map_err(|_: toml::de::Error| wrong(format!("\"{value}\" cannot be (allowed: {})", allowed())))?;
        Ok(())
    }

    /// The options that have other values than their defaults, in the order that options are listed in.
    ///
    /// # Errors
    /// [`Error::Input`] if options cannot be written (never).
    pub fn changed(&self) -> Result<Vec<ChangedOption>> {
        let (own, default) = (self.to_table()?, Self::default().to_table()?);
        let value = |table: &toml::Table, name: &str| {
            let (stage, option) = name.split_once('.')?;
            Some(as_written(table.get(stage)?.get(option)?))
        };
        let changed = Self::describe().into_iter().filter_map(|description| {
            let (value, default) = (value(&own, &description.name)?, value(&default, &description.name)?);
            (value != default).then_some(ChangedOption { description, value, default })
        });
        Ok(changed.collect())
    }

    /// Brings options as a project of an earlier version recorded them up to date: those that have another name by now
    /// get it, those that are fixed at the recorded value by now are dropped.
    ///
    /// # Errors
    /// [`Error::Input`] if one is fixed at another value by now.
    pub(crate) fn update_recorded(recorded: &mut serde_json::Value, file: &str) -> Result<()> {
        let Some(tables) = recorded.as_object_mut() else { return Ok(()) };
        let mut renamed = Vec::new();
        for (table, values) in tables.iter_mut() {
            let Some(values) = values.as_object_mut() else { continue };
            let names: Vec<String> = values.keys().cloned().collect();
            for option in names {
                let name = format!("{table}.{option}");
                let Some(retired) = Retired::of(&name) else { continue };
                let value = values.remove(&option).unwrap_or_default();
                match retired {
                    Retired::Renamed(new) => renamed.push((new, value)),
                    Retired::Flag(_) => {}
                    Retired::Fixed(_) | Retired::Gone(_)
                        if toml::Value::try_from(&value).is_ok_and(|value| retired.is_now(&value)) => {}
                    Retired::Fixed(_) | Retired::Gone(_) => {
                        let reason = format!("it is of an earlier version: {}", retired.reason(&name));
                        return Err(Error::input(file, reason, "Stitch the photographs again."));
                    }
                }
            }
        }
        for (new, value) in renamed {
            let Some((table, option)) = new.split_once('.') else { continue };
            let table = tables.entry(table).or_insert_with(|| serde_json::json!({}));
            if let Some(values) = table.as_object_mut() {
                values.insert(option.to_owned(), value);
            }
        }
        let known = Self::tables();
        tables.retain(|name, values| {
            known.iter().any(|(table, _)| table == name) || values.as_object().is_none_or(|values| !values.is_empty())
        });
        Ok(())
    }

    pub(super) fn to_table(&self) -> Result<toml::Table> {
        toml::Table::try_from(self).map_err(|error| Error::input("options", error, "Report this as a defect."))
    }
}

/// Why an option cannot be set that is none.
fn no_option(name: &str) -> String {
    Retired::of(name).map_or_else(|| format!("there is no option \"{name}\""), |retired| retired.reason(name))
}

/// The allowed values of an option, in words.
fn allowed_values(stage: &str, option: &str) -> String {
    let name = format!("{stage}.{option}");
    StitchOptions::describe().into_iter().find(|row| row.name == name).map_or(String::new(), |row| row.allowed)
}

fn in_words(value: &toml::Value) -> &'static str {
    match value {
        toml::Value::Float(_) => "a number",
        toml::Value::Integer(_) => "a whole number",
        toml::Value::Boolean(_) => "true or false",
        _ => "a text",
    }
}

/// The line of a TOML text that the key at the end of a path of keys stands on, counted from 1.
fn line_of(text: &str, path: &[&str]) -> Option<usize> {
    let parsed = toml::de::DeTable::parse(text).ok()?;
    let (last, tables) = path.split_last()?;
    let mut table = parsed.get_ref();
    for key in tables {
        table = table.get(*key)?.get_ref().as_table()?;
    }
    let (key, _) = table.get_key_value(*last)?;
    Some(line_at(text, key.span().start))
}

/// The line that the byte at `offset` stands on, counted from 1.
fn line_at(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

/// TOML's errors span lines with a photograph of the text; the reason is what users need.
fn first_line(error: &toml::de::Error) -> String {
    error.message().lines().next().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_valid_and_every_option_can_be_set_to_its_default() {
        let mut options = StitchOptions::default();
        options.validate().expect("defaults are valid");
        for row in StitchOptions::describe() {
            options.set(&format!("{}={}", row.name, row.default)).expect("a default can be written back");
            assert!(!row.meaning.is_empty(), "{} has no meaning", row.name);
        }
        assert_eq!(options, StitchOptions::default());
    }

    #[test]
    fn stage_tables_are_called_like_their_stages() {
        let table = StitchOptions::default().to_table().expect("serializable");
        for (stage, _) in StitchOptions::tables() {
            assert!(table.contains_key(stage), "{stage}");
        }
    }

    #[test]
    fn mistakes_say_what_is_wrong() {
        let mut options = StitchOptions::default();
        for (assignment, reason) in [
            ("mesh.cell_px", "there is no \"=\""),
            ("cell_px=3", "there is no \".\""),
            ("mesh.cell=3", "there is no option \"mesh.cell\""),
            ("mesh.cell_px=wide", "\"wide\" is not a number"),
            ("stitch.method=magic", "\"magic\" cannot be (allowed: vpg"),
            ("output.jpeg_quality=300", "\"300\" cannot be (allowed: 1 to 100)"),
            ("stitch.seed=3", "\"stitch.seed\" is now \"random.seed\""),
            ("stitch.thumbnail_pixels=3", "\"stitch.thumbnail_pixels\" is now fixed at 30000 px"),
        ] {
            let message = options.set(assignment).expect_err("must fail").to_string();
            assert!(message.contains(reason), "{message}");
        }
        for (text, told) in [
            ("[mesh]\ncell = 3", "c.toml: line 2: there is no option \"mesh.cell\""),
            ("# mine\n\n[mash]\ncell_px = 3", "c.toml: line 3: there is no table \"mash\""),
            ("mesh.cell_px = 30\nmesh.cell = 3", "c.toml: line 2: there is no option \"mesh.cell\""),
            ("\nmesh", "c.toml: line 2: it is no TOML ("),
            ("\r\nmesh = 3", "c.toml: line 2: \"mesh\" must be a table, [mesh]"),
            ("[random]\nseed = 9\n[mesh]\ncell_px = \"wide\"", "c.toml: line 4: "),
        ] {
            let message = options.merge_toml(text, "c.toml").expect_err("must fail").to_string();
            assert!(message.starts_with(told), "{message}");
        }
        let renamed = options.merge_toml("[cache]\nmax_bytes = 3", "c.toml").expect_err("renamed").to_string();
        assert!(renamed.contains("\"cache.max_bytes\" is now \"resources.cache_bytes\""), "{renamed}");
        assert_eq!(options, StitchOptions::default());
    }

    #[test]
    fn a_file_changes_only_what_it_names() {
        let mut options = StitchOptions::default();
        options.set("mesh.prior_weight=7.5").expect("valid");
        options.merge_toml("[mesh]\ncell_px = 30.0\n[random]\nseed = 9", "c.toml").expect("valid");
        let mesh = &options.align.mesh;
        assert_eq!((mesh.cell_px, mesh.prior_weight, options.matching.random.seed), (30.0, 7.5, 9));
    }
}
