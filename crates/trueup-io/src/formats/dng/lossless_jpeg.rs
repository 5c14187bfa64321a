//! Lossless JPEG: differences from a prediction, in Huffman's code.
//!
//! Cameras and converters mostly write two components, the even and the odd columns of a mosaic, which libraries for
//! photographs do not know.
//!
//! # Source
//! ITU-T T.81, annexes B (markers), C (tables), F.1.2.1 and F.2.2 (codes of differences), and H (lossless coding).

/// Markers (T.81, table B.1).
mod marker {
    pub(super) const FRAME: u8 = 0xc3;
    pub(super) const TABLES: u8 = 0xc4;
    pub(super) const RESTART: std::ops::RangeInclusive<u8> = 0xd0..=0xd7;
    pub(super) const START: [u8; 2] = [0xff, 0xd8];
    pub(super) const SCAN: u8 = 0xda;
    pub(super) const RESTARTS: u8 = 0xdd;
    /// Other frames, and arithmetic coding.
    pub(super) const FRAMES: std::ops::RangeInclusive<u8> = 0xc0..=0xcf;
}

/// Longest code, in bits, and those that are looked up at once.
const LONGEST: usize = 16;
const LOOKED_UP: usize = 9;

/// Tables that a file may have, and components of a scan.
const MOST_TABLES: usize = 4;
const MOST_COMPONENTS: usize = 4;

/// What is said of a block that ends before its numbers do.
const CUT_OFF: &str = "its lossless JPEG is cut off or damaged";

/// The `count` numbers of a lossless JPEG, row by row, components of a column beside each other.
///
/// # Errors
/// What is wrong; above all that it is of another kind, or not of so many numbers, which is found before they are
/// decoded.
pub(super) fn decode(bytes: &[u8], count: usize) -> Result<Vec<u16>, String> {
    let mut header = Header::default();
    let mut rest = bytes.strip_prefix(&marker::START).ok_or("it is no JPEG")?;
    loop {
        let (kind, segment, behind) = next_segment(rest).ok_or(CUT_OFF)?;
        rest = behind;
        match kind {
            marker::TABLES => header.read_tables(segment).ok_or(CUT_OFF)?,
            marker::FRAME => header.read_frame(segment).ok_or(CUT_OFF)?,
            marker::RESTARTS => header.restart = usize::from(number(segment, 0).ok_or(CUT_OFF)?),
            marker::SCAN => break header.read_scan(segment).ok_or(CUT_OFF)?,
            other if marker::FRAMES.contains(&other) => return Err("its JPEG is not lossless".to_owned()),
            _ => {}
        }
    }
    let found = header.width.saturating_mul(header.height).saturating_mul(header.components.len());
    if found != count || count == 0 {
        return Err(format!("a block of {count} numbers has {found}"));
    }
    header.numbers(rest)
}

/// The marker, the content and what follows of the segment at the start of `bytes`.
fn next_segment(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    // Any number of 0xff may stand before a marker.
    let filling = bytes.iter().take_while(|&&byte| byte == 0xff).count();
    let bytes = bytes.get(filling.checked_sub(1)?..)?;
    let length = usize::from(number(bytes, 2)?);
    let (content, behind) = bytes.get(2..)?.split_at_checked(length)?;
    Some((bytes[1], content.get(2..)?, behind))
}

fn number(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// What is told before the data.
#[derive(Debug, Default)]
struct Header {
    tables: [Option<Table>; MOST_TABLES],
    precision: u32,
    width: usize,
    height: usize,
    /// Their names.
    components: Vec<u8>,
    /// Columns between restarts; 0 if there are none.
    restart: usize,
    /// Of every component in the scan its table.
    chosen: Vec<usize>,
    predictor: u8,
    /// Bits that samples were shifted by.
    shift: u32,
}

impl Header {
    fn read_frame(&mut self, segment: &[u8]) -> Option<()> {
        let count = usize::from(*segment.get(5)?);
        let described = segment.get(6..6 + 3 * count)?;
        self.precision = u32::from(segment[0]);
        self.height = usize::from(number(segment, 1)?);
        self.width = usize::from(number(segment, 3)?);
        self.components = described.chunks_exact(3).map(|component| component[0]).collect();
        let are_whole = described.chunks_exact(3).all(|component| component[1] == 0x11);
        let is_known = (2..=16).contains(&self.precision) && (1..=MOST_COMPONENTS).contains(&count);
        (are_whole && is_known).then_some(())
    }

    fn read_tables(&mut self, mut segment: &[u8]) -> Option<()> {
        while let [name, rest @ ..] = segment {
            let (counts, rest) = rest.split_first_chunk::<LONGEST>()?;
            let count = counts.iter().map(|&count| usize::from(count)).sum();
            let (values, rest) = rest.split_at_checked(count)?;
            *self.tables.get_mut(usize::from(*name))? = Some(Table::of(counts, values)?);
            segment = rest;
        }
        Some(())
    }

    fn read_scan(&mut self, segment: &[u8]) -> Option<()> {
        let count = usize::from(*segment.first()?);
        let chosen = segment.get(1..1 + 2 * count)?.as_chunks::<2>().0;
        let [predictor, _, shift] = *segment.get(1 + 2 * count..)?.first_chunk()?;
        // One scan of all of them: what is written elsewhere is not.
        let are_all = chosen.iter().map(|[name, _]| name).eq(&self.components);
        self.chosen = chosen.iter().map(|[_, table]| usize::from(table >> 4)).collect();
        self.predictor = predictor;
        self.shift = u32::from(shift & 15);
        (are_all && count > 0 && (1..=7).contains(&predictor) && self.shift < self.precision).then_some(())
    }

    fn numbers(&self, data: &[u8]) -> Result<Vec<u16>, String> {
        let components = self.components.len();
        let tables: Option<Vec<&Table>> = self.chosen.iter().map(|&table| self.tables.get(table)?.as_ref()).collect();
        let tables = tables.ok_or(CUT_OFF)?;
        if !self.restart.is_multiple_of(self.width) {
            return Err("its lossless JPEG restarts within a row".to_owned());
        }
        let rows_between_restarts = self.restart / self.width;
        let start = 1_i32 << (self.precision - self.shift - 1);
        let row_numbers = self.width * components;
        let mut numbers = vec![0_u16; row_numbers * self.height];
        let mut bits = Bits::of(data);
        for y in 0..self.height {
            let begins = y == 0 || (rows_between_restarts > 0 && y % rows_between_restarts == 0);
            if begins && y > 0 {
                bits.restart().ok_or(CUT_OFF)?;
            }
            let (above, row) = numbers.split_at_mut(y * row_numbers);
            let above = &above[above.len().saturating_sub(row_numbers)..];
            for at in 0..row_numbers {
                let difference = bits.difference(tables[at % components]).ok_or(CUT_OFF)?;
                let before = at.checked_sub(components);
                let prediction = match (before, begins) {
                    (None, true) => start,
                    (Some(before), true) => i32::from(row[before]),
                    (None, false) => i32::from(above[at]),
                    (Some(before), false) => {
                        let [left, up, corner] = [row[before], above[at], above[before]].map(i32::from);
                        predicted(self.predictor, left, up, corner)
                    }
                };
                // Modulo 2^16.
                row[at] = (prediction + difference) as u16;
            }
        }
        numbers.iter_mut().for_each(|number| *number <<= self.shift);
        Ok(numbers)
    }
}

/// The prediction of a sample by those to its left, above it, and above that to its left (T.81, table H.1).
fn predicted(predictor: u8, left: i32, up: i32, corner: i32) -> i32 {
    match predictor {
        1 => left,
        2 => up,
        3 => corner,
        4 => left + up - corner,
        5 => left + ((up - corner) >> 1),
        6 => up + ((left - corner) >> 1),
        _ => (left + up) >> 1,
    }
}

/// A code of Huffman's.
#[derive(Debug)]
struct Table {
    /// For the first bits of a code its length and its value; length 0 of longer codes and of none.
    short: Vec<[u8; 2]>,
    /// Of every length the first code, how many there are, and where their values begin.
    lengths: [[usize; 3]; LONGEST + 1],
    values: Vec<u8>,
}

impl Table {
    /// `None` if there are more codes than fit.
    fn of(counts: &[u8; LONGEST], values: &[u8]) -> Option<Self> {
        let mut short = vec![[0; 2]; 1 << LOOKED_UP];
        let mut lengths = [[0; 3]; LONGEST + 1];
        let (mut code, mut first) = (0_usize, 0);
        for (length, &count) in (1..).zip(counts) {
            let count = usize::from(count);
            lengths[length] = [code, count, first];
            if code + count > 1 << length {
                return None;
            }
            if length <= LOOKED_UP {
                for (code, &value) in (code..).zip(&values[first..first + count]) {
                    let unused = LOOKED_UP - length;
                    short[code << unused..(code + 1) << unused].fill([length as u8, value]);
                }
            }
            code = (code + count) << 1;
            first += count;
        }
        Some(Self { short, lengths, values: values.to_vec() })
    }

    /// Length and value of the code that the 16 bits begin with.
    fn look_up(&self, bits: usize) -> Option<(usize, u8)> {
        let [length, value] = self.short[bits >> (LONGEST - LOOKED_UP)];
        if length > 0 {
            return Some((length.into(), value));
        }
        (LOOKED_UP + 1..=LONGEST).find_map(|length| {
            let [first, count, place] = self.lengths[length];
            let number = (bits >> (LONGEST - length)).checked_sub(first).filter(|&number| number < count)?;
            Some((length, self.values[place + number]))
        })
    }
}

/// Bits of entropy-coded data.
struct Bits<'a> {
    rest: &'a [u8],
    /// The next bits, the first of them the most significant of `held`.
    held: u64,
    count: usize,
}

impl<'a> Bits<'a> {
    fn of(rest: &'a [u8]) -> Self {
        Self { rest, held: 0, count: 0 }
    }

    /// Holds as many bits as there are and fit, up to the next marker.
    fn fill(&mut self) {
        while self.count <= 56 {
            let (byte, taken) = match *self.rest {
                [0xff, 0, ..] => (0xff, 2),
                [0xff, ..] | [] => return,
                [byte, ..] => (byte, 1),
            };
            self.rest = &self.rest[taken..];
            self.held |= u64::from(byte) << (56 - self.count);
            self.count += 8;
        }
    }

    fn take(&mut self, bits: usize) -> Option<u64> {
        self.count = self.count.checked_sub(bits)?;
        let taken = if bits == 0 { 0 } else { self.held >> (64 - bits) };
        self.held = if bits == 64 { 0 } else { self.held << bits };
        Some(taken)
    }

    /// The next difference (T.81, F.1.2.1 and H.1.2.2).
    fn difference(&mut self, table: &Table) -> Option<i32> {
        if self.count < 2 * LONGEST {
            self.fill();
        }
        let (length, size) = table.look_up((self.held >> 48) as usize)?;
        self.take(length)?;
        match size {
            0..=15 => {
                let value = self.take(size.into())? as i32;
                let is_positive = size == 0 || value >> (size - 1) == 1;
                Some(if is_positive { value } else { value - (1 << size) + 1 })
            }
            16 => Some(1 << 15),
            _ => None,
        }
    }

    /// Goes on behind the next marker of a restart.
    fn restart(&mut self) -> Option<()> {
        (self.held, self.count) = (0, 0);
        match *self.rest {
            [0xff, kind, ref rest @ ..] if marker::RESTART.contains(&kind) => self.rest = rest,
            _ => return None,
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::reading_tests::file;

    const WIDTH: usize = 12;
    const HEIGHT: usize = 10;

    /// What libjpeg-turbo 3 (by imagecodecs) wrote of [`sample`]: each length in two bytes, then a JPEG: two components
    /// of 14 bits by each of the seven predictors, one of 16 bits, three of 12.
    fn files() -> Vec<&'static [u8]> {
        let mut rest = file!("lossless.jpegs");
        std::iter::from_fn(|| {
            let length = usize::from(number(rest, 0)?);
            let (one, behind) = rest[2..].split_at(length);
            rest = behind;
            Some(one)
        })
        .collect()
    }

    fn samples(components: usize, bits: u32) -> Vec<u16> {
        let places = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
        let sample = move |(x, y): (usize, usize)| {
            (0..components).map(move |c| ((x * 977 + y * 463 + x * y * 37 + c * 5000) % (1 << bits)) as u16)
        };
        places.flat_map(sample).collect()
    }

    #[test]
    fn files_of_another_program_are_what_they_were_made_of() {
        let files = files();
        let kinds = [(2, 14); 7].into_iter().chain([(1, 16), (3, 12)]);
        assert_eq!(files.len(), 9);
        for (number, (file, (components, bits))) in files.into_iter().zip(kinds).enumerate() {
            let wanted = samples(components, bits);
            assert_eq!(decode(file, wanted.len()), Ok(wanted), "{number}");
        }
    }

    #[test]
    fn what_is_not_as_large_as_it_should_be_is_refused_before_it_is_decoded() {
        let file = files()[0];
        let words = decode(file, 241).expect_err("240 numbers");
        assert_eq!(words, "a block of 241 numbers has 240");
        let frame = file.windows(2).position(|pair| pair == [0xff, marker::FRAME]).expect("a frame");
        let mut giant = file.to_vec();
        giant[frame + 5..frame + 9].fill(0xff);
        assert!(decode(&giant, 240).is_err_and(|words| words.contains(&format!("has {}", 65_535_usize.pow(2) * 2))));
        let mut lossy = file.to_vec();
        lossy[frame + 1] = 0xc0;
        assert_eq!(decode(&lossy, 240), Err("its JPEG is not lossless".to_owned()));
    }

    #[test]
    fn what_is_cut_off_or_damaged_is_refused_or_read_in_full() {
        for (number, file) in files().into_iter().enumerate() {
            let count = WIDTH * HEIGHT * [2, 2, 2, 2, 2, 2, 2, 1, 3][number];
            for end in 0..file.len() - 2 {
                assert!(decode(&file[..end], count).is_err(), "{end}");
            }
            for at in 0..file.len() {
                let mut damaged = file.to_vec();
                damaged[at] ^= 0x41;
                // Nothing to be said, but no panic.
                let _ = decode(&damaged, count);
            }
        }
    }

    /// Two rows of two samples of 8 bits, a restart between them: a code of one bit for no difference (0), and one of
    /// two for a difference of one bit (10). Each row begins at 128: 128 and 129, 127 and 127.
    #[test]
    fn predictions_begin_anew_behind_a_restart() {
        let file = |restart: u8| {
            let tables = [&[0xff, 0xc4, 0, 21, 0, 1, 1][..], &[0; 14], &[0, 1]].concat();
            let frame = [0xff, 0xc3, 0, 11, 8, 0, 2, 0, 2, 1, 1, 0x11, 0];
            let restarts = [0xff, 0xdd, 0, 4, 0, restart];
            let scan = [0xff, 0xda, 0, 8, 1, 1, 0, 1, 0, 0];
            // 0, 10 1 and filled up by ones; 10 0, 0.
            let data = [0b0101_1111, 0xff, 0xd0, 0b1000_1111, 0xff, 0xd9];
            [&marker::START[..], &tables, &frame, &restarts, &scan, &data].concat()
        };
        assert_eq!(decode(&file(2), 4), Ok(vec![128, 129, 127, 127]));
        assert!(decode(&file(1), 4).is_err_and(|words| words.contains("within a row")));
        assert!(decode(&file(0), 4).is_err(), "a marker where there should be none");
    }

    #[test]
    fn codes_of_every_length_are_found() {
        // One code of each length, each of ones but its last bit.
        let mut counts = [1; LONGEST];
        let values: Vec<u8> = (0..16).collect();
        let table = Table::of(&counts, &values).expect("a code");
        for length in 1..=LONGEST {
            let code = ((1 << length) - 2) << (LONGEST - length);
            assert_eq!(table.look_up(code), Some((length, length as u8 - 1)));
        }
        assert_eq!(table.look_up(0xffff), None);
        counts[0] = 3;
        assert!(Table::of(&counts, &[0; 18]).is_none());
    }
}
