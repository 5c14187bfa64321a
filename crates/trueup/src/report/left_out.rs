//! Why a readable photograph is not in the panorama, in words a photographer can use.

use trueup_core::Error;
use trueup_core::matches::{PairMatches, PairVerdict};
use trueup_io::source::{PANORAMA_OF_OTHERS, RejectedSource};
use trueup_vision::matching::{Stranger, StrangerKind};

use super::several::several;

/// Reason and hint for one photograph.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LeftOut {
    pub code: &'static str,
    pub reason: String,
    pub hint: String,
}

/// Why the photographs `members`, which overlap one another, are in no panorama: another one is stitched. The same for
/// each of them, so that they are told together.
pub(crate) fn of_another_panorama(members: &[usize], names: &[String]) -> LeftOut {
    let of = match members {
        [one, other] => format!("that of {} and {}", names[*one], names[*other]),
        [first, others @ ..] => format!("that of {} and {} more", names[*first], others.len()),
        [] => String::new(),
    };
    LeftOut {
        code: "other-panorama",
        reason: format!("part of another panorama, {of}"),
        hint: "Use --all to stitch every group of overlapping photographs.".to_owned(),
    }
}

/// Why photograph `photograph`, which overlaps no other one, is not joined to the stitched component `component`.
///
/// `names` are the photographs' names, `pairs` every pair tried.
pub(crate) fn explain(photograph: usize, component: &[usize], pairs: &[PairMatches], names: &[String]) -> LeftOut {
    let touching = |pair: &&PairMatches| pair.a == photograph || pair.b == photograph;
    let best = pairs
        .iter()
        .filter(touching)
        .filter(|pair| component.is_empty() || component.contains(&other(pair, photograph)))
        .max_by(|one, two| strength(one).total_cmp(&strength(two)));
    match best {
        Some(pair) if pair.putative > 0 => LeftOut {
            code: "no-overlap",
            reason: format!("no overlap found: best neighbor {}, {}", names[other(pair, photograph)], counts(pair)),
            hint: hint(pair).to_owned(),
        },
        _ => LeftOut {
            code: "no-overlap",
            reason: "no overlap found: nothing in it was recognized elsewhere".to_owned(),
            hint: "Leave it out if it belongs elsewhere; otherwise shoot again with more overlap and detail."
                .to_owned(),
        },
    }
}

/// Why a photograph that no pair of the graph names is left out: nobody looked whether it overlaps another one.
pub(crate) fn not_in_graph() -> LeftOut {
    LeftOut {
        code: "not-in-graph",
        reason: "the graph has no pair with it".to_owned(),
        hint: "Add a line that joins it to another photograph, or stitch without --graph.".to_owned(),
    }
}

/// Why a picture that is no photograph of the scene is left out.
pub(crate) fn no_photograph(stranger: &Stranger, names: &[String]) -> LeftOut {
    const HINT: &str = "If it is to be used all the same, name the overlaps in a --graph file.";
    let (code, reason) = match &stranger.kind {
        StrangerKind::ReducedCopy { of } => ("reduced-copy", format!("it is a smaller copy of {}", names[*of])),
        StrangerKind::EditedCopy { of } => {
            ("edited-copy", format!("it is {} again, with other tones, compression or size", names[*of]))
        }
        StrangerKind::Panorama { of } => {
            let of: Vec<&str> = of.iter().map(|&photograph| names[photograph].as_str()).collect();
            let shown = match of.as_slice() {
                [one, other] => format!("{one} and {other}"),
                [first, .., last] => format!("{first}, {last} and {} more", of.len() - 2),
                _ => String::new(),
            };
            (PANORAMA_OF_OTHERS, format!("it is a panorama of {shown}"))
        }
    };
    LeftOut { code, reason, hint: HINT.to_owned() }
}

/// "9 of 24 matches agree (15 needed)".
pub(crate) fn counts(pair: &PairMatches) -> String {
    match pair.verdict {
        PairVerdict::TooFewMatches => format!("only {} matching points", pair.putative),
        PairVerdict::ImplausibleHomography => {
            format!("{} of {} matches agree, but on an impossible view", pair.agreeing, pair.putative)
        }
        PairVerdict::LooksDifferent => {
            format!("{} of {} matches agree, but what lies between them looks different", pair.agreeing, pair.putative)
        }
        _ => format!("{} of {} matches agree ({} needed)", pair.agreeing, pair.putative, pair.needed),
    }
}

/// How close a pair came to being joined.
pub(crate) fn strength(pair: &PairMatches) -> f64 {
    pair.confidence() + 1e-6 * pair.putative as f64
}

fn hint(pair: &PairMatches) -> &'static str {
    match pair.verdict {
        PairVerdict::ImplausibleHomography => {
            "Repeated patterns mislead matching; shoot with more overlap, or join the pair in a --graph file."
        }
        PairVerdict::LooksDifferent => {
            "Equal things in different places mislead matching; shoot one frame between them, or join the pair in a --graph file if they do overlap."
        }
        _ => "Shoot one frame between them, or join the pair in a --graph file if they do overlap.",
    }
}

fn other(pair: &PairMatches, photograph: usize) -> usize {
    if pair.a == photograph { pair.b } else { pair.a }
}

/// Name, reason and hint of an input that cannot be used.
pub(crate) fn reason_of_rejected(rejected: RejectedSource) -> (String, String, String) {
    (rejected.name, rejected.reason, rejected.hint)
}

/// The error when none of the inputs, each with name, reason and hint, can be used.
pub(crate) fn none_usable(inputs: Vec<(String, String, String)>) -> Error {
    match inputs.as_slice() {
        [(name, reason, hint)] => Error::input(name, reason, hint),
        _ => {
            let reasons: Vec<String> = inputs.iter().map(|(name, reason, _)| format!("{name}: {reason}")).collect();
            Error::input(
                format!("{} files", inputs.len()),
                format!("none of them can be used: {}", several(&reasons)),
                hint_of_all(inputs.iter().map(|(_, _, hint)| hint.as_str())),
            )
        }
    }
}

/// What to do where nothing can be used: what is said of each file, if that is one thing but for the command that does
/// it, of which each is named.
fn hint_of_all<'a>(hints: impl Iterator<Item = &'a str>) -> String {
    /// What stands before a command.
    const COMMAND: &str = "for example with ";
    let mut different: Vec<&str> = Vec::new();
    for hint in hints.filter(|hint| !hint.is_empty()) {
        if !different.contains(&hint) {
            different.push(hint);
        }
    }
    let parts: Option<Vec<(&str, &str)>> = different.iter().map(|hint| hint.split_once(COMMAND)).collect();
    match (different.as_slice(), parts.as_deref()) {
        ([one], _) => (*one).to_owned(),
        (_, Some([(before, first), others @ ..])) if others.iter().all(|(other, _)| other == before) => {
            let commands = std::iter::once(first).chain(others.iter().map(|(_, command)| command));
            let commands: Vec<&str> = commands.map(|command| command.trim_end_matches('.')).collect();
            format!("{before}{COMMAND}{}.", commands.join(" and "))
        }
        _ => "Name at least two overlapping photographs, or a folder that holds them.".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use trueup_core::matches::PointMatches;

    use super::*;

    fn pair(a: usize, b: usize, agreeing: usize, verdict: PairVerdict) -> PairMatches {
        PairMatches {
            a,
            b,
            putative: 24,
            in_overlap: 20,
            agreeing,
            needed: 15,
            verdict,
            b_from_a: None,
            inliers: PointMatches::default(),
            elsewhere: PointMatches::default(),
        }
    }

    fn names() -> Vec<String> {
        (0..4).map(|k| format!("{k}.jpg")).collect()
    }

    #[test]
    fn the_best_neighbor_and_its_counts_are_named() {
        let pairs = [pair(0, 2, 5, PairVerdict::TooFewInliers), pair(1, 2, 9, PairVerdict::TooFewInliers)];
        let left_out = explain(2, &[0, 1], &pairs, &names());
        assert_eq!(left_out.code, "no-overlap");
        assert_eq!(left_out.reason, "no overlap found: best neighbor 1.jpg, 9 of 24 matches agree (15 needed)");
    }

    #[test]
    fn what_is_no_photograph_is_told_so() {
        let reason = |kind| no_photograph(&Stranger { photograph: 3, kind }, &names()).reason;
        assert_eq!(reason(StrangerKind::ReducedCopy { of: 1 }), "it is a smaller copy of 1.jpg");
        let edited = reason(StrangerKind::EditedCopy { of: 1 });
        assert_eq!(edited, "it is 1.jpg again, with other tones, compression or size");
        let panorama = |of: &[usize]| reason(StrangerKind::Panorama { of: of.to_vec() });
        assert_eq!(panorama(&[0, 2]), "it is a panorama of 0.jpg and 2.jpg");
        assert_eq!(panorama(&[0, 1, 2]), "it is a panorama of 0.jpg, 2.jpg and 1 more");
    }

    #[test]
    fn what_helps_with_all_files_is_told_once() {
        let hint = |hints: &[&str]| hint_of_all(hints.iter().copied());
        let general = "Name at least two overlapping photographs, or a folder that holds them.";
        assert_eq!(hint(&["Look.", "Look."]), "Look.");
        assert_eq!(hint(&["Look.", "Listen."]), general);
        let convert = |format: &str| format!("Convert it to PNG, for example with `magick a.{format} a.png`.");
        let both = "Convert it to PNG, for example with `magick a.bmp a.png` and `magick a.gif a.png`.";
        assert_eq!(hint(&[&convert("bmp"), &convert("gif"), &convert("bmp")]), both);
        assert_eq!(hint(&[&convert("bmp"), "Look."]), general);
    }

    #[test]
    fn members_of_another_panorama_are_told_so() {
        let reason = |members: &[usize]| of_another_panorama(members, &names()).reason;
        assert_eq!(reason(&[2, 3]), "part of another panorama, that of 2.jpg and 3.jpg");
        assert_eq!(reason(&[0, 1, 3]), "part of another panorama, that of 0.jpg and 2 more");
        assert_eq!(of_another_panorama(&[2, 3], &names()).code, "other-panorama");
    }
}
