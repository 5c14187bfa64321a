//! Flags of their own for options that many people set: one row each. What a flag's help says comes from the option.

use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};
use trueup::{OptionDescription, Projection, StitchOptions};

/// The subcommands that make panoramas, by the names that they are typed with.
const STITCH: &[&str] = &["stitch", "batch"];
const STITCH_AND_COMPOSE: &[&str] = &["stitch", "batch", "compose"];
const STITCH_AND_COMPARE: &[&str] = &["stitch", "batch", "compare"];
const ALL: &[&str] = &["stitch", "batch", "compose", "compare"];
/// What turns and bounds a view suits one panorama, not a tree of folders.
const ONE_PANORAMA: &[&str] = &["stitch", "compose"];

const PHOTOGRAPHS: &str = "Photographs";
const OUTPUT: &str = "Output";
const VIEW: &str = "View";
const TUNING: &str = "Tuning";

/// Every flag that sets an option: the flag, the option, the heading in the help, the subcommands that take it.
pub const OPTION_FLAGS: &[OptionFlag] = &[
    OptionFlag::new("scene", "cameras.scene", PHOTOGRAPHS, STITCH_AND_COMPARE),
    OptionFlag::new("lens", "cameras.lens", PHOTOGRAPHS, STITCH_AND_COMPARE),
    OptionFlag::new("lens-fov", "cameras.fov", PHOTOGRAPHS, STITCH_AND_COMPARE),
    OptionFlag::new("stacks", "stacks.fuse", PHOTOGRAPHS, STITCH_AND_COMPARE),
    OptionFlag::new("scale", "canvas.scale", OUTPUT, STITCH_AND_COMPOSE),
    OptionFlag::new("quality", "output.jpeg_quality", OUTPUT, ALL),
    OptionFlag::new("depth", "output.depth", OUTPUT, STITCH_AND_COMPOSE),
    OptionFlag::new("look", "render.look", VIEW, STITCH_AND_COMPOSE),
    OptionFlag::new("projection", "projection.kind", VIEW, STITCH_AND_COMPOSE),
    OptionFlag::new("yaw", "projection.yaw", VIEW, ONE_PANORAMA).of_a_view(),
    OptionFlag::new("pitch", "projection.pitch", VIEW, ONE_PANORAMA).of_a_view(),
    OptionFlag::new("roll", "projection.roll", VIEW, ONE_PANORAMA).of_a_view(),
    OptionFlag::new("fov", "projection.fov", VIEW, ONE_PANORAMA).of_a_view(),
    OptionFlag::new("crop", "canvas.crop", VIEW, STITCH_AND_COMPOSE),
    OptionFlag::new("fill", "canvas.fill", VIEW, STITCH_AND_COMPOSE).value("SHARE"),
    OptionFlag::new("background", "output.background", VIEW, STITCH_AND_COMPOSE)
        .value("COLOR")
        .note("Quote a color that begins with #: shells take it for a comment."),
    OptionFlag::new("method", "stitch.method", TUNING, STITCH),
    OptionFlag::new("align", "stitch.align", TUNING, STITCH),
    OptionFlag::new("structure", "stitch.structure", TUNING, STITCH),
    OptionFlag::new("seed", "random.seed", TUNING, STITCH_AND_COMPARE),
    OptionFlag::new("memory", "resources.memory", TUNING, STITCH_AND_COMPOSE).value("AMOUNT"),
    OptionFlag::new("scratch", "resources.scratch", TUNING, STITCH_AND_COMPOSE).value("DIR"),
];

/// A flag that sets an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OptionFlag {
    /// The flag without its dashes.
    pub flag: &'static str,
    /// The option it sets, `table.option`.
    pub option: &'static str,
    heading: &'static str,
    /// The subcommands that take it.
    pub subcommands: &'static [&'static str],
    /// What stands for the value in the help, where the option's declaration says too little.
    value: Option<&'static str>,
    /// What people at a command line need to know beside the option's meaning; empty if that is nothing.
    note: &'static str,
    /// Whether it turns or bounds a view, which only a projection other than the mesh has.
    of_a_view: bool,
}

impl OptionFlag {
    const fn new(
        flag: &'static str,
        option: &'static str,
        heading: &'static str,
        subcommands: &'static [&'static str],
    ) -> Self {
        Self { flag, option, heading, subcommands, value: None, note: "", of_a_view: false }
    }

    const fn value(self, value: &'static str) -> Self {
        Self { value: Some(value), ..self }
    }

    const fn note(self, note: &'static str) -> Self {
        Self { note, ..self }
    }

    /// Whether it turns or bounds a view by `value` where `options` have none: a mesh is drawn as it lies. Zero turns
    /// and bounds nothing.
    pub fn lacks_a_view(&self, value: &str, options: &StitchOptions) -> bool {
        let on_the_mesh = || options.fixed_by_method().arrange.projection.kind == Projection::Mesh;
        self.of_a_view && value.trim().parse() != Ok(0.0) && on_the_mesh()
    }

    const fn of_a_view(self) -> Self {
        Self { note: "It takes a --projection other than the mesh.", of_a_view: true, ..self }
    }

    /// The flag as the parser knows it, with the help that its option declares.
    fn argument(&self, options: &[OptionDescription]) -> Arg {
        // By the option's name, of which there is one, while subcommands may give a flag to different options.
        let argument = Arg::new(self.option).long(self.flag).help_heading(self.heading).action(ArgAction::Set);
        let Some(option) = options.iter().find(|option| option.name == self.option) else {
            // A test has it that every row's option is declared.
            return argument;
        };
        let (summary, rest) = first_sentence(&option.meaning);
        let facts = self.facts(option);
        let whole =
            [summary, rest, self.note].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ");
        argument
            .value_name(self.value_name(option))
            .value_parser(AnyText::with_choices_of(option))
            .allow_hyphen_values(is_number(option))
            .help(format!("{} ({facts})", summary.trim_end_matches('.')))
            .long_help(format!("{whole} ({facts})"))
    }

    /// The option that is set, what it allows where no list of choices says so, and its default.
    fn facts(&self, option: &OptionDescription) -> String {
        let mut facts = self.option.to_owned();
        if option.choices.is_empty() && option.allowed != "any" {
            facts.push_str(&format!(": {}", option.allowed));
            if !option.unit.is_empty() {
                facts.push_str(&format!(" {}", option.unit));
            }
        }
        if !option.default.is_empty() {
            facts.push_str(&format!("; default {}", option.default));
        }
        facts
    }

    fn value_name(&self, option: &OptionDescription) -> String {
        match (self.value, is_number(option), option.unit) {
            (Some(value), ..) => value.to_owned(),
            (None, true, "degrees") => "DEG".to_owned(),
            (None, true, _) => "N".to_owned(),
            (None, false, _) => self.flag.to_uppercase(),
        }
    }
}

/// Whether an option's values are numbers, which may begin with a minus.
fn is_number(option: &OptionDescription) -> bool {
    option.choices.is_empty() && option.default.parse::<f64>().is_ok()
}

/// A text up to its first full stop, and what follows. A stop within a word, as in `table.option`, ends no sentence.
fn first_sentence(text: &str) -> (&str, &str) {
    match text.find(". ") {
        Some(stop) => (&text[..=stop], text[stop + 1..].trim_start()),
        None => (text, ""),
    }
}

/// Takes every text and names the choices in the help: what cannot be is told of with all other options that cannot be.
#[derive(Debug, Clone)]
struct AnyText {
    choices: Vec<PossibleValue>,
}

impl AnyText {
    fn with_choices_of(option: &OptionDescription) -> Self {
        let named = option.choices.iter().map(|choice| PossibleValue::new(choice.name).help(choice.meaning.clone()));
        Self { choices: named.collect() }
    }
}

impl TypedValueParser for AnyText {
    type Value = String;

    fn parse_ref(&self, command: &Command, _: Option<&Arg>, value: &std::ffi::OsStr) -> Result<String, Error> {
        let text = value.to_str().ok_or_else(|| Error::new(ErrorKind::InvalidUtf8).with_cmd(command))?;
        Ok(text.to_owned())
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        if self.choices.is_empty() { None } else { Some(Box::new(self.choices.iter().cloned())) }
    }
}

/// A flag that was typed, with its value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TypedOption {
    pub(crate) flag: &'static OptionFlag,
    pub(crate) value: String,
}

impl TypedOption {
    /// As it was typed.
    pub(crate) fn typed(&self) -> String {
        format!("--{} {}", self.flag.flag, self.value)
    }
}

/// The flags that set options and were typed after a subcommand, in the order of the table.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TypedOptions(Vec<TypedOption>);

impl TypedOptions {
    pub(crate) fn iter(&self) -> impl Iterator<Item = &TypedOption> {
        self.0.iter()
    }
}

impl FromArgMatches for TypedOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut typed = Self::default();
        typed.update_from_arg_matches(matches)?;
        Ok(typed)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        let given = |flag: &'static OptionFlag| {
            // An error says only that the subcommand does not take the flag.
            let value = matches.try_get_one::<String>(flag.option).ok().flatten()?.clone();
            Some(TypedOption { flag, value })
        };
        self.0 = OPTION_FLAGS.iter().filter_map(given).collect();
        Ok(())
    }
}

impl Args for TypedOptions {
    /// Adds the flags that the table gives to the subcommand `command`.
    fn augment_args(command: Command) -> Command {
        let name = command.get_name().to_owned();
        let options = StitchOptions::describe();
        let taken = OPTION_FLAGS.iter().filter(|flag| flag.subcommands.contains(&name.as_str()));
        taken.fold(command, |command, flag| command.arg(flag.argument(&options)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_sets_an_option_that_is_declared_and_no_subcommand_takes_a_flag_twice() {
        let options = StitchOptions::describe();
        for (position, row) in OPTION_FLAGS.iter().enumerate() {
            assert!(options.iter().any(|option| option.name == row.option), "{} is declared nowhere", row.option);
            for other in &OPTION_FLAGS[..position] {
                let shared = row.subcommands.iter().any(|subcommand| other.subcommands.contains(subcommand));
                assert!(row.option != other.option && !(shared && row.flag == other.flag), "--{} twice", row.flag);
            }
        }
    }

    #[test]
    fn help_says_what_the_option_declares() {
        let mut command = TypedOptions::augment_args(Command::new("stitch"));
        let help = command.render_long_help().to_string();
        let options = StitchOptions::describe();
        for row in OPTION_FLAGS.iter().filter(|row| row.subcommands.contains(&"stitch")) {
            let option = options.iter().find(|option| option.name == row.option).expect("a declared option");
            assert!(help.contains(&format!("--{} <{}>", row.flag, row.value_name(option))), "{help}");
            let parts = [row.option, option.default.as_str()].into_iter();
            for part in parts.chain(option.choices.iter().map(|choice| choice.name)) {
                assert!(help.contains(part), "{part} is not in\n{help}");
            }
        }
    }

    #[test]
    fn every_flag_stands_on_its_page() {
        let command_line = include_str!("../../../../docs/command-line.md");
        for row in OPTION_FLAGS {
            assert!(command_line.contains(&format!("`--{}", row.flag)), "--{} is not documented", row.flag);
        }
    }

    #[test]
    fn names_with_a_stop_in_them_end_no_sentence() {
        assert_eq!(first_sentence("Of table.option. More."), ("Of table.option.", "More."));
        assert_eq!(first_sentence("One sentence."), ("One sentence.", ""));
    }
}
