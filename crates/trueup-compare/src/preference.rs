//! Whether participants prefer one method to another, and how sure that is.

use std::collections::BTreeMap;

use serde::Serialize;

/// Standard deviations on either side of the mean that hold 95 % of a normal distribution.
const STANDARD_DEVIATIONS_OF_95_PERCENT: f64 = 1.959_963_984_540_054;

/// An interval that holds the true share in 95 of 100 studies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShareInterval {
    /// Its lower end, 0 to 1.
    pub low: f64,
    /// Its upper end, 0 to 1.
    pub high: f64,
}

/// Which of two methods participants prefer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Preference {
    /// The method that more participants prefer; of equals, the first by name.
    pub preferred: String,
    /// The other one.
    pub other: String,
    /// Participants who more often ranked `preferred` above `other` than below.
    pub agree: usize,
    /// Participants who did the opposite.
    pub disagree: usize,
    /// Participants who did both equally often; they take no part in share and test.
    pub undecided: usize,
    /// `agree` as a share of those who decided; `None` if nobody did.
    pub share: Option<f64>,
    /// Interval of the share.
    pub interval: Option<ShareInterval>,
    /// Probability of a preference at least as clear, either way, if participants had none: exact sign test.
    pub p_value: f64,
    /// The same beside the tests of all other pairs: 0.05 here is wrong in 5 of 100 studies, whichever pair one picks.
    pub adjusted_p_value: f64,
}

/// The interval of a share of `successes` in `trials`; `None` without trials. Mean shares of several participants may
/// give a broken number of successes.
///
/// # Source
/// Wilson, "Probable inference, the law of succession, and statistical inference", 1927: unlike the mean with its
/// standard error, it stays within 0 to 1 and holds for few participants and for shares near the ends.
pub(crate) fn wilson_interval(successes: f64, trials: usize) -> Option<ShareInterval> {
    if trials == 0 {
        return None;
    }
    let count = trials as f64;
    let (share, squared) = (successes / count, STANDARD_DEVIATIONS_OF_95_PERCENT.powi(2));
    let scale = 1.0 + squared / count;
    let middle = (share + squared / (2.0 * count)) / scale;
    let variance = share * (1.0 - share) / count + squared / (4.0 * count * count);
    let half = STANDARD_DEVIATIONS_OF_95_PERCENT * variance.sqrt() / scale;
    Some(ShareInterval { low: (middle - half).max(0.0), high: (middle + half).min(1.0) })
}

/// Probability that of `agree + disagree` throws of a fair coin as many or more fall on one side as `agree` or
/// `disagree`, whichever is larger: the two-sided exact sign test.
///
/// # Source
/// Conover, *Practical Nonparametric Statistics*, section on the sign test.
pub(crate) fn sign_test(agree: usize, disagree: usize) -> f64 {
    let (count, most) = (agree + disagree, agree.max(disagree));
    let log_factorials: Vec<f64> = std::iter::once(0.0)
        .chain((1..=count).scan(0.0, |sum, factor| {
            *sum += (factor as f64).ln();
            Some(*sum)
        }))
        .collect();
    let chance = |heads: usize| {
        let ways = log_factorials[count] - log_factorials[heads] - log_factorials[count - heads];
        (ways - count as f64 * std::f64::consts::LN_2).exp()
    };
    (2.0 * (most..=count).map(chance).sum::<f64>()).min(1.0)
}

/// What one participant said of two methods.
#[derive(Debug, Clone, Copy, Default)]
struct Said {
    above: usize,
    below: usize,
}

/// Counts who prefers what: for every pair of methods and every participant, how often the one was ranked above the
/// other.
#[derive(Debug, Default)]
pub(crate) struct PairCounts<'a> {
    /// By the two methods, the first by name first, then by participant.
    said: BTreeMap<(&'a str, &'a str), BTreeMap<String, Said>>,
}

impl<'a> PairCounts<'a> {
    /// Takes in one ranking, the best first.
    pub(crate) fn add(&mut self, participant: &str, ranking: &'a [String]) {
        for (position, better) in ranking.iter().enumerate() {
            for worse in &ranking[position + 1..] {
                let in_order = better < worse;
                let pair = if in_order { (better.as_str(), worse.as_str()) } else { (worse.as_str(), better.as_str()) };
                let said = self.said.entry(pair).or_default().entry(participant.to_owned()).or_default();
                *if in_order { &mut said.above } else { &mut said.below } += 1;
            }
        }
    }

    /// The preferences, the surest first. A participant counts once in a pair, however many panoramas he ranked, since
    /// his answers are not independent of each other.
    pub(crate) fn preferences(self) -> Vec<Preference> {
        let mut found: Vec<Preference> = self.said.into_iter().map(|(pair, said)| preference(pair, &said)).collect();
        found.sort_by(|one, two| one.p_value.total_cmp(&two.p_value).then(one.preferred.cmp(&two.preferred)));
        adjust(&mut found);
        found
    }
}

fn preference(pair: (&str, &str), said: &BTreeMap<String, Said>) -> Preference {
    let count = |wanted: std::cmp::Ordering| said.values().filter(|one| one.above.cmp(&one.below) == wanted).count();
    let (first, second) = (count(std::cmp::Ordering::Greater), count(std::cmp::Ordering::Less));
    let ((preferred, agree), (other, disagree)) = match first >= second {
        true => ((pair.0, first), (pair.1, second)),
        false => ((pair.1, second), (pair.0, first)),
    };
    let decided = agree + disagree;
    let p_value = sign_test(agree, disagree);
    Preference {
        preferred: preferred.to_owned(),
        other: other.to_owned(),
        agree,
        disagree,
        undecided: said.len() - decided,
        share: (decided > 0).then(|| agree as f64 / decided as f64),
        interval: wilson_interval(agree as f64, decided),
        p_value,
        adjusted_p_value: p_value,
    }
}

/// Adjusts the probabilities of tests in ascending order for their number.
///
/// # Source
/// Holm, "A simple sequentially rejective multiple test procedure", 1979.
fn adjust(ascending: &mut [Preference]) {
    let (count, mut largest) = (ascending.len(), 0.0_f64);
    for (position, one) in ascending.iter_mut().enumerate() {
        largest = largest.max(one.p_value * (count - position) as f64).min(1.0);
        one.adjusted_p_value = largest;
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, RngExt};
    use trueup_core::StageContext;

    use super::*;

    #[test]
    fn intervals_by_hand() {
        let near = |found: Option<ShareInterval>, low: f64, high: f64| {
            let found = found.expect("trials");
            assert!((found.low - low).abs() < 1e-5 && (found.high - high).abs() < 1e-5, "{found:?}");
        };
        // z^2 = 3.841459: 0 of 10 reaches up to z^2 / (10 + z^2); 15 of 20 is (0.75 + 0.096036 +- 0.212690) / 1.192073.
        near(wilson_interval(0.0, 10), 0.0, 0.277_533);
        near(wilson_interval(10.0, 10), 0.722_467, 1.0);
        near(wilson_interval(15.0, 20), 0.531_299, 0.888_138);
        assert_eq!(wilson_interval(0.0, 0), None);
    }

    #[test]
    fn sign_tests_by_hand() {
        // Sums of a row of Pascal's triangle over 2^10, twice.
        for (agree, disagree, expected) in
            [(9, 1, 22.0 / 1024.0), (2, 8, 112.0 / 1024.0), (10, 0, 2.0 / 1024.0), (5, 5, 1.0), (0, 0, 1.0)]
        {
            assert!((sign_test(agree, disagree) - expected).abs() < 1e-12, "{agree} {disagree}");
        }
        assert!(sign_test(3000, 2000) < 1e-40);
    }

    #[test]
    fn many_tests_are_adjusted_for_their_number() {
        // Holm: 0.01 * 3, then the larger of that and 0.02 * 2, then the larger of that and 0.5.
        let with = |p_value| Preference { p_value, ..preference(("a", "b"), &BTreeMap::new()) };
        let mut found = [0.01, 0.02, 0.5].map(with);
        adjust(&mut found);
        let adjusted = found.map(|one| one.adjusted_p_value);
        assert!(adjusted.iter().zip([0.03, 0.04, 0.5]).all(|(found, expected)| (found - expected).abs() < 1e-12));
    }

    /// A ranking drawn one after the other in proportion to the weights of those left (Plackett and Luce).
    fn drawn(weights: &[(&str, f64)], generator: &mut impl Rng) -> Vec<String> {
        let mut left = weights.to_vec();
        let mut ranking = Vec::new();
        while !left.is_empty() {
            let mut rest = generator.random_range(0.0..left.iter().map(|(_, weight)| weight).sum::<f64>());
            let passed = |(_, weight): &(&str, f64)| {
                rest -= weight;
                rest < 0.0
            };
            let next = left.iter().position(passed).unwrap_or(left.len() - 1);
            ranking.push(left.remove(next).0.to_owned());
        }
        ranking
    }

    /// The paper's study: 20 participants rank 4 methods on 20 groups; the one is drawn 4 times as readily as any
    /// other.
    #[test]
    fn a_simulated_study_finds_the_preference_that_is_there_and_no_other() {
        let weights = [("aanap", 1.0), ("gsp-2d", 1.0), ("gsp-3d", 1.0), ("vpg", 4.0)];
        let mut generator = StageContext::default().generator("votes", 1);
        let rankings: Vec<(String, Vec<String>)> =
            (0..400).map(|index| (format!("{}", index % 20), drawn(&weights, &mut generator))).collect();
        let mut counts = PairCounts::default();
        rankings.iter().for_each(|(participant, ranking)| counts.add(participant, ranking));
        let found = counts.preferences();
        assert_eq!(found.len(), 6);
        for one in &found {
            assert_eq!(one.agree + one.disagree + one.undecided, 20);
            let expected = one.preferred == "vpg";
            assert_eq!(one.adjusted_p_value < 0.05, expected, "{one:?}");
            assert!(!expected || one.interval.is_some_and(|interval| interval.low > 0.5));
        }
        assert!(found[..3].iter().all(|one| one.preferred == "vpg"));
    }

    /// Without a preference, a test at 5 % finds one in no more than 5 of 100 studies, and the interval of the share
    /// holds the true one half in about 95 of 100. Of 1000 studies, three standard deviations are 2 %.
    #[test]
    fn intervals_and_tests_err_as_often_as_they_say() {
        let mut generator = StageContext::default().generator("votes", 2);
        let (mut found, mut covered) = (0, 0);
        for _ in 0..1000 {
            let mut counts = PairCounts::default();
            let rankings: Vec<Vec<String>> =
                (0..40).map(|_| drawn(&[("a", 1.0), ("b", 1.0)], &mut generator)).collect();
            rankings.iter().enumerate().for_each(|(index, ranking)| counts.add(&index.to_string(), ranking));
            let one = &counts.preferences()[0];
            found += usize::from(one.p_value < 0.05);
            covered += usize::from(one.interval.is_some_and(|interval| interval.low <= 0.5));
        }
        assert!(found <= 70, "{found}");
        assert!((930..=985).contains(&covered), "{covered}");
    }
}
