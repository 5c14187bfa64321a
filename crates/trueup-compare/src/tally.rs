//! What participants said: results of blind rankings, and the mean score of every method.
//!
//! # Source
//! The paper's user study: each participant ranks four unnamed panoramas; ranks 1 to 4 score 5 to 2.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};
use trueup_core::{Error, Result};

use super::preference::{PairCounts, Preference, ShareInterval, wilson_interval};
use super::ranking::MAX_RANKED;

/// The `format` field of every file of results.
pub const RANKING_FORMAT: &str = "trueup-ranking";
/// The `version` field: raised when a field changes its meaning.
pub const RANKING_VERSION: u32 = 1;

/// Score of the panorama ranked first; every rank below scores one less.
const BEST_SCORE: usize = 5;

/// A file of results, as the ranking page writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RankingResults {
    /// [`RANKING_FORMAT`].
    pub format: String,
    /// [`RANKING_VERSION`].
    pub version: u32,
    /// [`super::Comparison::id`].
    pub comparison: String,
    /// What participants answered.
    pub answers: Vec<RankingAnswer>,
}

/// One participant's ranking of one comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RankingAnswer {
    /// Unlike every other answer's: an answer that is in several files counts once.
    pub id: String,
    /// Who answered, as the participant wrote it; may be empty.
    #[serde(default)]
    pub participant: String,
    /// When, as ISO 8601 text; may be empty.
    #[serde(default)]
    pub finished: String,
    /// The entries in the order in which they were shown.
    #[serde(default)]
    pub shown: Vec<String>,
    /// The entries, the best first.
    pub ranking: Vec<String>,
}

/// Mean scores over all answers, and which of two methods is preferred.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tally {
    /// Different comparisons that were ranked.
    pub comparisons: usize,
    /// Different participants.
    pub participants: usize,
    /// Answers counted.
    pub answers: usize,
    /// Answers that were in several files, beyond the first time.
    pub repeated: usize,
    /// The methods, the best first.
    pub methods: Vec<MethodScore>,
    /// Every two methods that somebody ranked together, the surest preference first.
    pub preferences: Vec<Preference>,
}

/// What participants think of one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MethodScore {
    /// Name of the entry.
    pub name: String,
    /// Mean over the participants of each one's mean score.
    pub mean_score: f64,
    /// Standard error of the mean: the participants' sample standard deviation over the root of their number. A
    /// participant's answers are not independent of each other and count as one. `None` for one participant.
    pub standard_error: Option<f64>,
    /// Participants who ranked it.
    pub participants: usize,
    /// Answers that rank it.
    pub answers: usize,
    /// How often it was ranked first, second, third, fourth.
    pub ranks: [usize; MAX_RANKED],
    /// Mean over the participants of the share of their answers that rank it first.
    pub first_share: f64,
    /// Interval of that share, as wide as if each participant had answered once.
    pub first_interval: Option<ShareInterval>,
}

/// Reads a file of results.
///
/// # Errors
/// [`Error::Io`] if it cannot be read; [`Error::Input`] if it is none, damaged, of a later version, or a ranking in it
/// names an entry twice or too few or too many.
pub fn read_rankings(path: &Path) -> Result<RankingResults> {
    let bytes = trueup_io::text::read(path).map_err(|error| Error::io("reading", path, error))?;
    parse(&bytes, &path.display().to_string())
}

fn parse(bytes: &[u8], file: &str) -> Result<RankingResults> {
    let wrong = |reason: String| Error::input(file, reason, "Give a file that ranking.html saved.");
    let value: serde_json::Value =
        serde_json::from_slice(bytes).map_err(|error| wrong(format!("not a file of rankings ({error})")))?;
    if value["format"] != RANKING_FORMAT {
        return Err(wrong(format!("its format is not \"{RANKING_FORMAT}\"")));
    }
    if value["version"] != RANKING_VERSION {
        return Err(wrong(format!(
            "its version is {}, this program reads version {RANKING_VERSION}",
            value["version"]
        )));
    }
    let results: RankingResults =
        serde_json::from_value(value).map_err(|error| wrong(format!("the file is damaged ({error})")))?;
    for answer in &results.answers {
        let different: BTreeSet<&String> = answer.ranking.iter().collect();
        if different.len() != answer.ranking.len() {
            return Err(wrong(format!("answer {} ranks one entry twice", answer.id)));
        }
        if !(2..=MAX_RANKED).contains(&answer.ranking.len()) {
            return Err(wrong(format!(
                "answer {} ranks {} entries, 2 to {MAX_RANKED} can be",
                answer.id,
                answer.ranking.len()
            )));
        }
    }
    Ok(results)
}

/// Scores of one method.
#[derive(Debug, Default)]
struct Scores {
    by_participant: BTreeMap<String, Vec<f64>>,
    ranks: [usize; MAX_RANKED],
}

/// Sums up results. Participants are told apart by their names, without regard to case and outer spaces; an answer
/// without a name is a participant of its own.
///
/// # Errors
/// [`Error::Input`] if there are no answers.
pub fn tally(results: &[RankingResults]) -> Result<Tally> {
    let mut known: BTreeSet<(&str, &str)> = BTreeSet::new();
    let mut participants: BTreeSet<String> = BTreeSet::new();
    let mut comparisons: BTreeSet<&str> = BTreeSet::new();
    let mut scores: BTreeMap<&str, Scores> = BTreeMap::new();
    let mut pairs = PairCounts::default();
    let mut repeated = 0;
    for (result, answer) in results.iter().flat_map(|result| result.answers.iter().map(move |answer| (result, answer)))
    {
        if !known.insert((&result.comparison, &answer.id)) {
            repeated += 1;
            continue;
        }
        comparisons.insert(&result.comparison);
        let participant = participant(result, answer);
        pairs.add(&participant, &answer.ranking);
        for (position, name) in answer.ranking.iter().enumerate() {
            let of_method = scores.entry(name).or_default();
            // Rankings of more entries than there are ranks are refused when they are read.
            let Some(rank) = of_method.ranks.get_mut(position) else { break };
            *rank += 1;
            let score = (BEST_SCORE - position) as f64;
            of_method.by_participant.entry(participant.clone()).or_default().push(score);
        }
        participants.insert(participant);
    }
    if known.is_empty() {
        return Err(Error::input("the results", "nobody has ranked anything", "Give files that ranking.html saved."));
    }
    let mut methods: Vec<MethodScore> = scores.into_iter().map(|(name, scores)| method_score(name, &scores)).collect();
    methods.sort_by(|one, two| two.mean_score.total_cmp(&one.mean_score).then(one.name.cmp(&two.name)));
    let (comparisons, participants) = (comparisons.len(), participants.len());
    Ok(Tally { comparisons, participants, answers: known.len(), repeated, methods, preferences: pairs.preferences() })
}

fn participant(result: &RankingResults, answer: &RankingAnswer) -> String {
    match answer.participant.trim() {
        "" => format!("\n{} {}", result.comparison, answer.id),
        name => name.to_lowercase(),
    }
}

fn method_score(name: &str, scores: &Scores) -> MethodScore {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let means: Vec<f64> = scores.by_participant.values().map(|values| mean(values)).collect();
    let mean_score = mean(&means);
    let count = means.len() as f64;
    let best = BEST_SCORE as f64;
    let first = |values: &Vec<f64>| values.iter().filter(|score| **score == best).count() as f64 / values.len() as f64;
    let first: f64 = scores.by_participant.values().map(first).sum();
    let squares: f64 = means.iter().map(|value| (value - mean_score).powi(2)).sum();
    MethodScore {
        name: name.to_owned(),
        mean_score,
        standard_error: (means.len() > 1).then(|| (squares / (count - 1.0) / count).sqrt()),
        participants: means.len(),
        answers: scores.by_participant.values().map(Vec::len).sum(),
        ranks: scores.ranks,
        first_share: first / count,
        first_interval: wilson_interval(first, means.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(comparison: &str, answers: &[(&str, &str, &str)]) -> RankingResults {
        let answers = answers.iter().map(|(id, participant, ranking)| RankingAnswer {
            id: (*id).to_owned(),
            participant: (*participant).to_owned(),
            finished: String::new(),
            shown: Vec::new(),
            ranking: ranking.split(' ').map(str::to_owned).collect(),
        });
        RankingResults {
            format: RANKING_FORMAT.to_owned(),
            version: RANKING_VERSION,
            comparison: comparison.to_owned(),
            answers: answers.collect(),
        }
    }

    #[test]
    fn mean_scores_by_hand() {
        // a: Ann 5 and 5, mean 5; Bob 4; Cyd 2. Mean 11/3; deviations 4/3, 1/3, -5/3, squares 42/9, /2 /3 = 7/9.
        // b: Ann 4 and 3, mean 3.5; Bob 5; Cyd 5. Mean 4.5; deviations -1, 0.5, 0.5, squares 1.5, /2 /3 = 0.25.
        let street = results("street", &[("1", "Ann", "a b c d"), ("2", "Bob", "b a d c"), ("3", "Cyd", "b c d a")]);
        let room = results("room", &[("1", " ann ", "a c b d")]);
        let found = tally(&[street.clone(), room, street]).expect("answers");
        assert_eq!((found.comparisons, found.participants, found.answers, found.repeated), (2, 3, 4, 3));
        let names: Vec<&str> = found.methods.iter().map(|method| method.name.as_str()).collect();
        assert_eq!(names, ["b", "a", "c", "d"]);
        let (b, a) = (&found.methods[0], &found.methods[1]);
        assert!((b.mean_score - 4.5).abs() < 1e-12 && (a.mean_score - 11.0 / 3.0).abs() < 1e-12);
        let error = |method: &MethodScore| method.standard_error.expect("three participants");
        assert!((error(b) - 0.5).abs() < 1e-12 && (error(a) - 0.881_917_103_688_197).abs() < 1e-12);
        assert_eq!((a.ranks, a.answers, a.participants), ([2, 1, 0, 1], 4, 3));
        // Of three participants, Ann put a first both times; Bob and Cyd put b first.
        assert!((a.first_share - 1.0 / 3.0).abs() < 1e-12 && (b.first_share - 2.0 / 3.0).abs() < 1e-12);
        assert!(b.first_interval.is_some_and(|interval| interval.low < 0.5 && interval.high > 0.9));
        // a above b: Ann twice; below: Bob and Cyd.
        let pair =
            found.preferences.iter().find(|one| one.preferred == "b" && one.other == "a").expect("ranked together");
        assert_eq!((pair.agree, pair.disagree, pair.undecided, pair.p_value), (2, 1, 0, 1.0));
        assert_eq!(found.preferences.len(), 6);
    }

    #[test]
    fn answers_without_a_name_are_participants_of_their_own() {
        let found = tally(&[results("x", &[("1", "", "a b"), ("2", "", "a b")])]).expect("answers");
        assert_eq!((found.participants, found.methods[0].standard_error), (2, Some(0.0)));
        let one = tally(&[results("x", &[("1", "", "a b")])]).expect("an answer");
        assert_eq!((one.methods[0].mean_score, one.methods[0].standard_error), (5.0, None));
        assert!(tally(&[results("x", &[])]).is_err());
    }

    #[test]
    fn damaged_files_are_refused() {
        let good = serde_json::to_string(&results("x", &[("1", "Ann", "a b")])).expect("serializable");
        assert!(parse(good.as_bytes(), "r.json").is_ok());
        for (text, reason) in [
            ("Dear diary".to_owned(), "not a file of rankings"),
            ("{}".to_owned(), "its format is not"),
            (good.replace("\"version\":1", "\"version\":9"), "its version is 9"),
            (good.replace("\"id\"", "\"di\""), "damaged"),
            (good.replace("[\"a\",\"b\"]", "[\"a\",\"a\"]"), "ranks one entry twice"),
            (good.replace("[\"a\",\"b\"]", "[\"a\"]"), "ranks 1 entries"),
        ] {
            let message = parse(text.as_bytes(), "r.json").expect_err("must fail").to_string();
            assert!(message.contains(reason) && message.contains("r.json"), "{message}");
        }
    }
}
