//! `trueup options`: the reference of the options.

use std::fmt::Write;

use trueup::{Error, OptionDescription, StitchOptions, Tier};

use crate::arguments::OptionsArgs;
use crate::failure::Failure;
use crate::output;
use crate::words::wrap;

/// Width of a line of the list, in characters.
const WIDTH: usize = 100;
const INDENT: &str = "      ";
/// Width of a choice's name with its colon; longer names push their first line to the right.
const CHOICE_WIDTH: usize = 20;
/// Where the meaning of a choice begins.
const CHOICE_INDENT: usize = INDENT.len() + 2 + CHOICE_WIDTH;

pub(crate) fn run(args: &OptionsArgs) -> Result<(), Failure> {
    let mut rows = StitchOptions::describe();
    if let Some(table) = &args.table {
        let tables: Vec<&str> = StitchOptions::tables().into_iter().map(|(table, _)| table).collect();
        if !tables.contains(&table.as_str()) {
            return Err(Failure::usage(
                format!("there is no table \"{table}\""),
                format!("The tables are {}.", tables.join(", ")),
            ));
        }
        rows.retain(|row| table_of(row) == table);
    }
    let all = rows.len();
    if !args.expert {
        rows.retain(|row| row.tier == Tier::Basic);
    }
    if args.json {
        let json = serde_json::to_string_pretty(&rows)
            .map_err(|error| Error::input("options", error, "Report this as a defect."))?;
        return output::print(&format!("{json}\n"));
    }
    output::print(&format!("{}{}", text(&rows), experts_line(rows.len(), all - rows.len())))
}

/// The last line: how many options the list leaves to experts. Empty if it leaves none.
fn experts_line(shown: usize, left: usize) -> String {
    let gap = if shown == 0 { "" } else { "\n" };
    match left {
        0 => String::new(),
        1 => format!("{gap}1 more option is for experts: add --expert.\n"),
        _ => format!("{gap}{left} more options are for experts: add --expert.\n"),
    }
}

/// One paragraph an option, a blank line between tables.
fn text(rows: &[OptionDescription]) -> String {
    let mut text = String::new();
    for (position, row) in rows.iter().enumerate() {
        if position > 0 && table_of(row) != table_of(&rows[position - 1]) {
            text.push('\n');
        }
        let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
        let _ = writeln!(text, "{} = {}{unit}   (allowed: {})", row.name, row.default, row.allowed);
        for line in wrap(&row.meaning, WIDTH - INDENT.len()) {
            let _ = writeln!(text, "{INDENT}{line}");
        }
        for choice in &row.choices {
            for (position, line) in wrap(&choice.meaning, WIDTH - CHOICE_INDENT).iter().enumerate() {
                let name = if position == 0 { format!("{}: ", choice.name) } else { String::new() };
                let _ = writeln!(text, "{INDENT}  {name:CHOICE_WIDTH$}{line}");
            }
        }
    }
    text
}

fn table_of(row: &OptionDescription) -> &str {
    row.name.split_once('.').map_or(row.name.as_str(), |(table, _)| table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_listed_with_default_range_and_meaning() {
        let rows = StitchOptions::describe();
        let listed = text(&rows);
        for row in &rows {
            assert!(listed.contains(&format!("{} = {}", row.name, row.default)), "{}", row.name);
            assert!(listed.contains(&row.allowed), "{}", row.name);
        }
        assert!(listed.lines().all(|line| line.chars().count() <= WIDTH || !line.starts_with(INDENT)));
    }

    #[test]
    fn the_last_line_counts_what_is_left_to_experts() {
        assert_eq!(experts_line(40, 0), "");
        assert_eq!(experts_line(40, 1), "\n1 more option is for experts: add --expert.\n");
        assert_eq!(experts_line(0, 12), "12 more options are for experts: add --expert.\n");
    }
}
