//! Every single result as one table of comma-separated values, compact enough to lie beside the report.

use std::path::Path;

use trueup::{Result, write_atomically};

use crate::report::csv;
use crate::trial::Row;

/// Decimal digits of a figure: more than any claim looks at.
const DIGITS: usize = 5;

/// Writes every result, a column per measure. The build is that of the report, which states it.
///
/// # Errors
/// Those of writing.
pub(crate) fn write(rows: &[Row], path: &Path) -> Result<()> {
    write_atomically(path, table(rows).as_bytes())
}

fn table(rows: &[Row]) -> String {
    let mut measures: Vec<&str> = rows.iter().flat_map(|row| row.measures.keys().map(String::as_str)).collect();
    measures.sort_unstable();
    measures.dedup();
    let heads = ["experiment", "set", "variant", "seed", "reference", "photographs", "note"];
    let mut text = csv::line(heads.into_iter().chain(measures.iter().copied()));
    let optional = |number: Option<usize>| number.map_or(String::new(), |number| number.to_string());
    for Row { key, measures: found, note } in rows {
        let (seed, reference, photographs) =
            (key.seed.to_string(), optional(key.reference), optional(key.photograph_count));
        let heads = [&key.experiment, &key.set, &key.variant, &seed, &reference, &photographs, note];
        let figures: Vec<String> =
            measures.iter().map(|name| found.get(*name).map_or(String::new(), |value| compact(*value))).collect();
        text.push_str(&csv::line(heads.into_iter().chain(&figures).map(String::as_str)));
    }
    text
}

/// A number with at most [`DIGITS`] digits that mean something.
fn compact(value: f64) -> String {
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    rounded.to_string()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::trial::Trial;

    #[test]
    fn figures_keep_five_digits_and_stand_under_their_names() {
        assert_eq!(
            [0.123_456_78, 1_234.567_8, 0.0, 1.0, 2e-7].map(compact),
            ["0.12346", "1234.6", "0", "1", "0.0000002"]
        );
        let row = |measure: &str, value| {
            let key = Trial::new("test", "a,b", "plain", &[]).key("content", "1");
            Row { key, measures: BTreeMap::from([(measure.to_owned(), value)]), note: String::new() }
        };
        let expected = "experiment,set,variant,seed,reference,photographs,note,gdic_deg,ld\n\
                        test,\"a,b\",plain,0,,,,0.5,\ntest,\"a,b\",plain,0,,,,,1.5\n";
        assert_eq!(table(&[row("gdic_deg", 0.5), row("ld", 1.5)]), expected);
    }
}
