//! Which panoramas are ranked blindly, and under which names.

use rand::seq::SliceRandom;
use serde::Serialize;
use trueup_core::{Error, Result, StageContext};

use super::compared::Compared;
use super::entry::ComparisonEntry;
use super::format::PanoramaFormat;
use trueup_core::options::OptionValue;

/// Most panoramas in a ranking: as many as scores from 5 to 2.
pub const MAX_RANKED: usize = 4;
/// Fewest panoramas that can be ranked.
const MIN_RANKED: usize = 2;

/// The methods that the paper's user study ranked.
const OF_THE_STUDY: [&str; MAX_RANKED] = ["gsp-2d", "gsp-3d", "aanap", "vpg"];

/// The panoramas that are ranked, in shuffled order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Ranking {
    /// Each is a copy of an entry's panorama.
    pub panoramas: Vec<RankedPanorama>,
}

/// A panorama without its name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RankedPanorama {
    /// The copy's file, which does not tell the entry.
    pub file: String,
    /// The entry it is a copy of.
    pub entry: String,
}

/// Refuses rankings of entries that are not there, that are there twice, or of too few or too many.
///
/// # Errors
/// [`Error::Input`].
pub(crate) fn check_wanted(wanted: &[String], entries: &[ComparisonEntry]) -> Result<()> {
    let wrong = |subject: &str, reason: String, hint: &str| Err(Error::input(subject, reason, hint));
    for (index, name) in wanted.iter().enumerate() {
        if !entries.iter().any(|entry| entry.name == *name) {
            let known: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
            let reason = format!("it is not compared, so it cannot be ranked; compared are {}", known.join(", "));
            return wrong(name, reason, "Name entries that are compared after --rank.");
        }
        if wanted[..index].contains(name) {
            return wrong(name, "it is to be ranked twice".to_owned(), "Name each entry once after --rank.");
        }
    }
    match wanted.len() {
        MIN_RANKED..=MAX_RANKED => Ok(()),
        count => {
            let reason = format!("{MIN_RANKED} to {MAX_RANKED} entries can be ranked, not {count}");
            wrong(&wanted.join(","), reason, "Name two to four entries after --rank.")
        }
    }
}

/// Chooses and shuffles the panoramas of the ranking: those wanted, else those of the paper's study, else the first,
/// each as far as it succeeded. `None` for fewer than two. The order derives from the context's seed.
pub(crate) fn choose(
    wanted: Option<&[String]>,
    entries: &[Compared],
    format: PanoramaFormat,
    context: &StageContext,
) -> Option<Ranking> {
    let made: Vec<&str> =
        entries.iter().filter(|entry| entry.panorama.is_some()).map(|entry| entry.name.as_str()).collect();
    let mut chosen: Vec<&str> = match wanted {
        Some(wanted) => wanted.iter().map(String::as_str).filter(|name| made.contains(name)).collect(),
        None if OF_THE_STUDY.iter().all(|name| made.contains(name)) => OF_THE_STUDY.to_vec(),
        None => made.into_iter().take(MAX_RANKED).collect(),
    };
    if chosen.len() < MIN_RANKED {
        return None;
    }
    chosen.shuffle(&mut context.generator("ranking", 0));
    let extension = format.display();
    let panoramas = chosen.iter().enumerate().map(|(position, name)| RankedPanorama {
        file: format!("ranking-{}.{extension}", position + 1),
        entry: (*name).to_owned(),
    });
    Some(Ranking { panoramas: panoramas.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str) -> ComparisonEntry {
        ComparisonEntry { name: name.to_owned(), meaning: String::new(), overrides: Vec::new() }
    }

    #[test]
    fn rankings_that_cannot_be_are_refused() {
        let entries = ["a", "b", "c", "d", "e"].map(entry);
        let check = |names: &[&str]| {
            let wanted: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            check_wanted(&wanted, &entries).map_err(|error| error.to_string())
        };
        assert_eq!(check(&["a", "e"]), Ok(()));
        for (names, reason) in [
            (&["a", "q"][..], "it is not compared"),
            (&["a", "a"], "twice"),
            (&["a"], "entries can be ranked, not 1"),
            (&["a", "b", "c", "d", "e"], "entries can be ranked, not 5"),
        ] {
            let message = check(names).expect_err("must fail");
            assert!(message.contains(reason), "{message}");
        }
    }
}
