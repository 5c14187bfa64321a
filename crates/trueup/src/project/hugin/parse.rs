//! The lines of a Hugin project, as numbers and names.

use std::collections::BTreeMap;

use trueup_core::{Error, Result};

/// What may be done about a file that is none.
const AS_SAVED: &str = "Give a project that Hugin saved, or `trueup stitch --pto` wrote.";

/// The fields that are numbers, of those that are read.
const NUMBERS: [&str; 17] = ["w", "h", "f", "v", "r", "p", "y", "a", "b", "c", "d", "e", "g", "t", "TrX", "TrY", "TrZ"];

/// One line: what each of its fields says, by its name.
#[derive(Debug, Clone, PartialEq)]
struct Line<'a> {
    /// Counted from 1.
    number: usize,
    fields: BTreeMap<&'a str, &'a str>,
}

/// What a line says of one photograph or of the panorama, with links followed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fields {
    /// Number of the line, counted from 1.
    pub line: usize,
    numbers: BTreeMap<String, f64>,
    /// The file's name; empty where there is none.
    pub name: String,
    /// Left, right, top and bottom of what is used of a photograph (`S`).
    pub crop: Option<[f64; 4]>,
}

impl Fields {
    /// What the field says; 0 where it is not there, which is what the format means by that.
    pub(super) fn number(&self, name: &str) -> f64 {
        self.numbers.get(name).copied().unwrap_or(0.0)
    }
}

/// A Hugin project's lines that are heeded.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HuginLines {
    /// The panorama's, if there is one.
    pub panorama: Option<Fields>,
    /// The photographs', in their order.
    pub images: Vec<Fields>,
    /// Positions of the photographs of which parts are masked.
    pub masked: Vec<usize>,
}

impl HuginLines {
    /// Reads the text of `file`.
    ///
    /// # Errors
    /// [`Error::Input`] if it is no Hugin project, or damaged.
    pub(super) fn parse(text: &str, file: &str) -> Result<Self> {
        let wrong = |line: usize, reason: String| Error::input(file, format!("line {line}: {reason}"), AS_SAVED);
        let (mut panorama, mut images, mut masked) = (None, Vec::new(), Vec::new());
        for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let number = index + 1;
            let mut letters = line.chars();
            let (kind, follows) = (letters.next(), letters.next());
            if !follows.is_none_or(char::is_whitespace) {
                continue;
            }
            match kind {
                Some('p') => panorama = Some(Line::parse(number, &line[1..]).map_err(|reason| wrong(number, reason))?),
                Some('i') => images.push(Line::parse(number, &line[1..]).map_err(|reason| wrong(number, reason))?),
                Some('o') => {
                    let reason = "it is a script of PTOptimizer, whose `o` lines are not read".to_owned();
                    return Err(wrong(number, reason));
                }
                Some('k') => {
                    let fields = Line::parse(number, &line[1..]).map_err(|reason| wrong(number, reason))?.fields;
                    masked.extend(fields.get("i").and_then(|image| image.parse::<usize>().ok()));
                }
                _ => {}
            }
        }
        if images.is_empty() {
            return Err(Error::input(file, "it has no line of a photograph (`i w... h... n\"...\"`)", AS_SAVED));
        }
        let of_line = |line: &Line| Line::resolved(line, &images).map_err(|reason| wrong(line.number, reason));
        let panorama = panorama.as_ref().map(of_line).transpose()?;
        let images: Vec<Fields> = images.iter().map(of_line).collect::<Result<_>>()?;
        masked.retain(|&image| image < images.len());
        masked.sort_unstable();
        masked.dedup();
        Ok(Self { panorama, images, masked })
    }
}

impl<'a> Line<'a> {
    /// The fields of a line: each a name of letters, and what follows up to the next space, or between quotation marks.
    fn parse(number: usize, text: &'a str) -> std::result::Result<Self, String> {
        let mut fields = BTreeMap::new();
        let mut rest = text.trim_start();
        while !rest.is_empty() {
            let named = rest.find(|letter: char| !letter.is_ascii_alphabetic()).unwrap_or(rest.len());
            let (name, value) = rest.split_at(named);
            if name.is_empty() {
                return Err(format!("a field without a name at {:?}", rest.chars().take(12).collect::<String>()));
            }
            let end = match value.strip_prefix('"') {
                Some(quoted) => {
                    quoted.find('"').map(|end| end + 2).ok_or_else(|| format!("the text of {name} does not end"))?
                }
                None => value.find(char::is_whitespace).unwrap_or(value.len()),
            };
            let (value, after) = value.split_at(end);
            // What is said twice counts as it was said first, as the format's own reader has it.
            fields.entry(name).or_insert(value);
            rest = after.trim_start();
        }
        Ok(Self { number, fields })
    }

    /// The numbers of the line; those that are those of another photograph (`v=0`) are taken from there.
    fn resolved(&self, images: &[Self]) -> std::result::Result<Fields, String> {
        let mut numbers = BTreeMap::new();
        let (mut file_name, mut crop) = (String::new(), None);
        for (&name, &value) in &self.fields {
            if let Some(quoted) = value.strip_prefix('"') {
                if name == "n" {
                    file_name = quoted.trim_end_matches('"').to_owned();
                }
                continue;
            }
            let stated = match value.strip_prefix('=') {
                Some(image) => {
                    let linked = image.parse::<usize>().ok().and_then(|image| images.get(image));
                    let linked = linked.and_then(|line| line.fields.get(name).copied());
                    linked.ok_or_else(|| format!("{name}={image} is that of no other photograph"))?
                }
                None => value,
            };
            if name == "S" {
                crop = Some(numbers_of(stated).ok_or_else(|| format!("S{stated} is no crop"))?);
                continue;
            }
            if let Some(field) = field_of_no_number(name).filter(|_| stated.is_empty()) {
                return Err(format!("{field} is no finite number"));
            }
            // What else is no number (lists of steps) is not among what is read here.
            if let Ok(number) = stated.parse::<f64>() {
                if !number.is_finite() {
                    return Err(format!("{name} is no finite number"));
                }
                numbers.insert(name.to_owned(), number);
            } else if stated.starts_with('=') {
                return Err(format!("{name} is that of a photograph whose own is that of another"));
            } else if NUMBERS.contains(&name) {
                return Err(format!("{name}{stated} is no number"));
            }
        }
        Ok(Fields { line: self.number, numbers, name: file_name, crop })
    }
}

/// The field of what was read as a name of letters alone, where it ends as programs print what is no number or no
/// finite one: `rnan`.
fn field_of_no_number(letters: &str) -> Option<&str> {
    let ends = ["nan", "infinity", "inf"].into_iter();
    let field = |end: &str| {
        let (field, rest) = letters.split_at_checked(letters.len().checked_sub(end.len())?)?;
        (!field.is_empty() && rest.eq_ignore_ascii_case(end)).then_some(field)
    };
    ends.filter_map(field).next()
}

/// As many finite numbers, between commas.
fn numbers_of<const COUNT: usize>(text: &str) -> Option<[f64; COUNT]> {
    let numbers = text.split(',').map(|number| number.parse().ok().filter(|number: &f64| number.is_finite()));
    numbers.collect::<Option<Vec<f64>>>()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "# hugin project file\np f2 w3000 h1500 v360 E12.5 R0 n\"TIFF_m c:LZW\"\nm i0\n\
        i w800 h600 f0 v50.5 Ra0 r-1.5 p2 y-10 a0.01 b-0.02 c0 d1 e-2 Eev12 Vm5 n\"a 1.jpg\"\n\
        i w800 h600 f0 v=0 r0 p1e1 y10 a=0 b=0 c=0 d=0 e=0 S0,800,0,600 n\"b.jpg\"\nk i1 t0 p\"1 2 3 4 5 6\"\nv v0 y1\nc n0 N1\n";

    #[test]
    fn fields_and_links_are_read() {
        let HuginLines { panorama, images, masked } = HuginLines::parse(TWO, "a.pto").expect("a project");
        assert_eq!((images.len(), masked), (2, vec![1]));
        let panorama = panorama.expect("a panorama");
        assert_eq!((panorama.number("f"), panorama.number("w"), panorama.number("E")), (2.0, 3000.0, 12.5));
        assert_eq!((images[0].name.as_str(), images[1].name.as_str()), ("a 1.jpg", "b.jpg"));
        let of = |name| (images[0].number(name), images[1].number(name));
        assert_eq!((of("v"), of("b"), of("e")), ((50.5, 50.5), (-0.02, -0.02), (-2.0, -2.0)));
        assert_eq!((images[0].crop, images[1].crop), (None, Some([0.0, 800.0, 0.0, 600.0])));
        assert_eq!((of("p"), of("y"), of("TrX")), ((2.0, 10.0), (-10.0, 10.0), (0.0, 0.0)));
        assert_eq!((images[0].number("Vm"), images[1].number("Vm"), images[1].line), (5.0, 0.0, 5));
    }

    #[test]
    fn what_is_damaged_is_named_with_its_line() {
        let refused = |text: &str| HuginLines::parse(text, "a.pto").expect_err("damaged").to_string();
        assert!(refused("p f2 w10 h5 v360\n").contains("no line of a photograph"));
        assert!(refused("{\"format\": 1}").contains("no line of a photograph"));
        assert!(refused(&TWO.replace("v=0", "v=7")).contains("line 5: v=7 is that of no other photograph"));
        assert!(refused(&TWO.replace("v=0", "v=1")).contains("line 5: v is that of a photograph"));
        assert!(refused(&TWO.replace("v50.5", "v1e999")).contains("line 4: v is no finite number"));
        for (angle, told) in [
            ("rnan", "r is no finite number"),
            ("rNaN", "r is no finite number"),
            ("r-nan", "r is no finite number"),
            ("rinf", "r is no finite number"),
            ("r-nan(ind)", "r-nan(ind) is no number"),
            ("r1,5", "r1,5 is no number"),
        ] {
            assert!(refused(&TWO.replace("r-1.5", angle)).contains(&format!("line 4: {told}")), "{angle}");
        }
        assert!(refused(&TWO.replace("n\"b.jpg\"", "n\"b.jpg")).contains("line 5: the text of n does not end"));
        assert!(refused(&TWO.replace("S0,800,0,600", "S0,800,0")).contains("line 5: S0,800,0 is no crop"));
        assert!(refused(&TWO.replace("w800 h600 f0 v=0", "w800 600")).contains("line 5: a field without a name"));
        assert!(refused("i w1 h1 n\"a\"\no f0 y1\n").contains("PTOptimizer"));
    }
}
