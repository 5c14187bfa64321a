//! What the command prints.

use std::fmt::Write;
use std::path::Path;

use trueup_compare::{Better, Compared, Comparison, ComparisonFigure, Preference, Refusal, ShareInterval, Tally};

/// Figures in the table: more do not fit beside each other.
const COLUMNS: usize = 6;

/// A line per entry with the first figures; the page has them all.
pub(crate) fn text(comparison: &Comparison, folder: &Path) -> String {
    let mut text = String::new();
    let used = comparison.photographs.iter().filter(|photograph| photograph.reason.is_empty()).count();
    let (given, seconds) = (comparison.photographs.len(), comparison.seconds);
    let _ = writeln!(text, "page        {}", folder.join("index.html").display());
    if comparison.ranking.is_some() {
        let _ = writeln!(text, "ranking     {}", folder.join("ranking.html").display());
    }
    let _ = writeln!(text, "photographs {used} of {given} used; {seconds:.1} s");
    for photograph in comparison.photographs.iter().filter(|photograph| !photograph.reason.is_empty()) {
        let _ = writeln!(text, "  left out  {}: {}", photograph.path, photograph.reason);
    }
    let shown = |figure: &&ComparisonFigure| figure.main && figure.better != Better::Neither;
    let figures: Vec<&ComparisonFigure> = comparison.figures.iter().filter(shown).take(COLUMNS).collect();
    let width = comparison.entries.iter().map(|entry| entry.name.chars().count()).max().unwrap_or(0);
    let headings: Vec<String> = figures.iter().map(|figure| heading(figure)).collect();
    let _ = writeln!(text, "\n{:width$}  {}", "", headings.join("  "));
    for entry in &comparison.entries {
        let told = match &entry.refusal {
            Some(refusal) => told(refusal),
            None => figures.iter().zip(&headings).map(|(figure, heading)| cell(entry, figure, heading)).collect(),
        };
        let _ = writeln!(text, "{:width$}  {}", entry.name, told.trim_end());
    }
    let _ = writeln!(text, "\n* the best of a column; index.html has every figure and what it means.");
    text
}

fn heading(figure: &ComparisonFigure) -> String {
    let unit = if figure.unit.is_empty() { String::new() } else { format!(" {}", figure.unit) };
    format!("{}{unit}", figure.name)
}

fn told(refusal: &Refusal) -> String {
    let what = if refusal.not_applicable { "not applicable" } else { "failed" };
    let subject = if refusal.subject.is_empty() { String::new() } else { format!("{}: ", refusal.subject) };
    format!("{what}: {subject}{}", refusal.reason)
}

/// A figure as wide as its heading, with the gap that follows.
fn cell(entry: &Compared, figure: &ComparisonFigure, heading: &str) -> String {
    let value = match entry.figures.get(figure.key) {
        Some(value) => format!("{value:.*}", figure.decimals),
        None => "-".to_owned(),
    };
    let mark = if entry.best.contains(&figure.key) { "*" } else { " " };
    format!("{value:>width$}{mark} ", width = heading.chars().count())
}

/// The methods' mean scores, the best first, and every preference.
pub(crate) fn scores(tally: &Tally) -> String {
    let mut text = String::new();
    let Tally { answers, participants, comparisons, repeated, methods, preferences } = tally;
    let (participants, comparisons) = (counted(*participants, "participant"), counted(*comparisons, "comparison"));
    let _ = writeln!(text, "{} of {participants} to {comparisons}", counted(*answers, "answer"));
    if *repeated > 0 {
        let _ = writeln!(text, "{} left out that came more than once", counted(*repeated, "answer"));
    }
    let width = methods.iter().map(|method| method.name.chars().count()).max().unwrap_or(0);
    let _ = writeln!(text, "\n{:width$}  score  std. error  answers  1st 2nd 3rd 4th  first, 95 % of studies", "");
    for method in methods {
        let error = method.standard_error.map_or("-".to_owned(), |error| format!("{error:.3}"));
        let ranks: Vec<String> = method.ranks.iter().map(|count| format!("{count:>3}")).collect();
        let (name, score, answers) = (&method.name, method.mean_score, method.answers);
        let first = shared(method.first_share, method.first_interval);
        let _ = writeln!(text, "{name:width$}  {score:>5.3}  {error:>10}  {answers:>7}  {}  {first}", ranks.join(" "));
    }
    if !preferences.is_empty() {
        let _ =
            writeln!(text, "\nparticipants who prefer the one to the other, 95 % of studies, p of a sign test (Holm)");
    }
    for Preference { preferred, other, agree, disagree, undecided, share, interval, adjusted_p_value, .. } in
        preferences
    {
        let shared = share.map_or("-".to_owned(), |share| shared(share, *interval));
        let undecided = if *undecided > 0 { format!(", {undecided} undecided") } else { String::new() };
        let p = if *adjusted_p_value < 0.001 { "p < 0.001".to_owned() } else { format!("p = {adjusted_p_value:.3}") };
        let _ = writeln!(text, "{preferred:width$}  to {other:width$}  {agree} : {disagree}{undecided}  {shared}  {p}");
    }
    text
}

/// "75 % (53 to 89)".
fn shared(share: f64, interval: Option<ShareInterval>) -> String {
    let percent = |share: f64| 100.0 * share;
    let within = interval.map(|found| format!(" ({:.0} to {:.0})", percent(found.low), percent(found.high)));
    format!("{:.0} %{}", percent(share), within.unwrap_or_default())
}

/// "1 answer", "3 answers".
fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}
