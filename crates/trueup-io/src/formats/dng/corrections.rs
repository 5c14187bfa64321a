//! From what a sensor's converter told to shares of white.
//!
//! # Source
//! DNG, chapter 5, "Mapping Raw Values to Linear Reference Values", and chapter 7, "Opcode List Processing".

/// Numbers of corrections (DNG, chapter 7).
mod opcode {
    /// Those that bend, mend single pixels or even out brightness about the middle: the picture can be used without
    /// them.
    pub(super) const DISPENSABLE: [u32; 6] = [1, 2, 3, 4, 5, 6];
    pub(super) const GAIN_MAP: u32 = 9;
}

/// The flag of a correction that may be left out.
const OPTIONAL: u32 = 1;

/// Largest gain that is believed: lenses darken corners by three stops.
const MOST_GAIN: f32 = 64.0;

/// What numbers mean.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Levels {
    /// What a number stands for; empty if for itself.
    pub(super) table: Vec<u16>,
    /// Columns and rows after which black repeats.
    pub(super) repeat: [usize; 2],
    /// Of every such row, column and sample.
    pub(super) black: Vec<f64>,
    /// What is added to it in a column, and in a row; empty if nothing.
    pub(super) of_columns: Vec<f64>,
    pub(super) of_rows: Vec<f64>,
    /// Of every sample of a pixel.
    pub(super) white: Vec<f64>,
}

impl Levels {
    /// The same if white is above black everywhere.
    pub(super) fn sane(self) -> Option<Self> {
        let all = || self.black.iter().chain(&self.of_columns).chain(&self.of_rows).chain(&self.white);
        let is_above = self.white.iter().enumerate().all(|(sample, white)| *white > self.highest_black(sample));
        (all().all(|value| value.is_finite()) && is_above).then_some(self)
    }

    fn highest_black(&self, sample: usize) -> f64 {
        let most = |values: &mut dyn Iterator<Item = f64>| values.reduce(f64::max);
        let samples = self.white.len();
        let pattern = most(&mut self.black.iter().skip(sample).step_by(samples).copied()).unwrap_or(0.0);
        let [column, row] =
            [&self.of_columns, &self.of_rows].map(|deltas| most(&mut deltas.iter().copied()).unwrap_or(0.0));
        pattern + column + row
    }

    /// Turns the numbers of a row of the active area into shares of white, from below 0 up to any.
    pub(super) fn row(&self, y: usize, numbers: &[u16], shares: &mut [f32]) {
        let samples = self.white.len();
        let [columns, rows] = self.repeat;
        let scales: Vec<f64> =
            self.white.iter().enumerate().map(|(sample, white)| 1.0 / (white - self.highest_black(sample))).collect();
        let of_row = self.of_rows.get(y).copied().unwrap_or(0.0);
        let last = self.table.len().saturating_sub(1);
        for (at, (number, share)) in numbers.iter().zip(shares).enumerate() {
            let (x, sample) = (at / samples, at % samples);
            let level = match self.table.is_empty() {
                true => *number,
                false => self.table[usize::from(*number).min(last)],
            };
            let black = self.black[(y % rows * columns + x % columns) * samples + sample];
            let black = black + of_row + self.of_columns.get(x).copied().unwrap_or(0.0);
            *share = ((f64::from(level) - black) * scales[sample]) as f32;
        }
    }
}

/// Gains over a part of a picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GainMap {
    top: usize,
    left: usize,
    bottom: usize,
    right: usize,
    plane: usize,
    planes: usize,
    row_pitch: usize,
    column_pitch: usize,
    rows: usize,
    columns: usize,
    /// How far apart nodes are, and where the first is, down and across, as shares of the picture.
    spacing: [f64; 2],
    origin: [f64; 2],
    map_planes: usize,
    gains: Vec<f32>,
}

/// The gain maps of a list of corrections; `None` if it cannot be read, or has another correction that must not be left
/// out.
pub(super) fn gain_maps(list: &[u8]) -> Option<Vec<GainMap>> {
    let mut rest = list;
    let mut maps = Vec::new();
    if list.is_empty() {
        return Some(maps);
    }
    for _ in 0..number(&mut rest)? {
        let [code, _version, flags, length] =
            [number(&mut rest)?, number(&mut rest)?, number(&mut rest)?, number(&mut rest)?];
        let (parameters, behind) = rest.split_at_checked(length as usize)?;
        rest = behind;
        match code {
            opcode::GAIN_MAP => maps.push(GainMap::of(parameters)?),
            _ if opcode::DISPENSABLE.contains(&code) || flags & OPTIONAL != 0 => {}
            _ => return None,
        }
    }
    Some(maps)
}

fn number(bytes: &mut &[u8]) -> Option<u32> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(u32::from_be_bytes(*first))
}

fn real(bytes: &mut &[u8]) -> Option<f64> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(f64::from_be_bytes(*first))
}

impl GainMap {
    fn of(mut bytes: &[u8]) -> Option<Self> {
        let mut count = || Some(number(&mut bytes)? as usize);
        let [top, left, bottom, right] = [count()?, count()?, count()?, count()?];
        let [plane, planes, row_pitch, column_pitch] = [count()?, count()?, count()?, count()?];
        let [rows, columns] = [count()?, count()?];
        let spacing = [real(&mut bytes)?, real(&mut bytes)?];
        let origin = [real(&mut bytes)?, real(&mut bytes)?];
        let map_planes = number(&mut bytes)? as usize;
        let gains: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|&gain| f32::from_be_bytes(gain)).collect();
        let is_whole = rows.checked_mul(columns)?.checked_mul(map_planes)? == gains.len() && !gains.is_empty();
        let has_step = |points: usize, spacing: f64| points == 1 || (spacing.is_finite() && spacing > 0.0);
        let is_sane = row_pitch > 0
            && column_pitch > 0
            && has_step(rows, spacing[0])
            && has_step(columns, spacing[1])
            && origin.iter().all(|origin| origin.is_finite())
            && gains.iter().all(|gain| (0.0..=MOST_GAIN).contains(gain));
        let map = Self {
            top,
            left,
            bottom,
            right,
            plane,
            planes,
            row_pitch,
            column_pitch,
            rows,
            columns,
            spacing,
            origin,
            map_planes,
            gains,
        };
        (is_whole && is_sane).then_some(map)
    }

    /// Multiplies what lies in this row of a picture of this size, of so many samples a pixel.
    pub(super) fn apply(&self, y: usize, [width, height]: [usize; 2], samples: usize, row: &mut [f32]) {
        if !(self.top..self.bottom).contains(&y) || !(y - self.top).is_multiple_of(self.row_pitch) {
            return;
        }
        let (upper, lower, down) = between(y, height, self.origin[0], self.spacing[0], self.rows);
        for x in (self.left..self.right.min(width)).step_by(self.column_pitch) {
            let (left, right, across) = between(x, width, self.origin[1], self.spacing[1], self.columns);
            for plane in self.plane..self.plane.saturating_add(self.planes).min(samples) {
                let map_plane = (plane - self.plane).min(self.map_planes - 1);
                let gain =
                    |row: usize, column: usize| self.gains[(row * self.columns + column) * self.map_planes + map_plane];
                let along = |row| gain(row, left) + (gain(row, right) - gain(row, left)) * across;
                row[x * samples + plane] *= along(upper) + (along(lower) - along(upper)) * down;
            }
        }
    }
}

/// The two nodes beside a pixel, and how far it is from the first to the second.
fn between(pixel: usize, whole: usize, origin: f64, spacing: f64, count: usize) -> (usize, usize, f32) {
    if count == 1 {
        return (0, 0, 0.0);
    }
    let place = (((pixel as f64 + 0.5) / whole as f64 - origin) / spacing).clamp(0.0, (count - 1) as f64);
    let first = (place as usize).min(count - 2);
    (first, first + 1, (place - first as f64) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain() -> Levels {
        Levels {
            table: Vec::new(),
            repeat: [1, 1],
            black: vec![100.0],
            of_columns: Vec::new(),
            of_rows: Vec::new(),
            white: vec![1100.0],
        }
    }

    fn shares(levels: &Levels, y: usize, numbers: &[u16]) -> Vec<f32> {
        let mut shares = vec![0.0; numbers.len()];
        levels.row(y, numbers, &mut shares);
        shares
    }

    #[test]
    fn numbers_become_shares_of_white() {
        assert_eq!(shares(&plain(), 0, &[100, 600, 1100, 0]), [0.0, 0.5, 1.0, -0.1]);
        let table = Levels { table: vec![100, 200, 1100], ..plain() };
        assert_eq!(shares(&table, 0, &[0, 1, 2, 900]), [0.0, 0.1, 1.0, 1.0]);
        // The highest black is 200: what is told of others is as far from their own black.
        let pattern = Levels { repeat: [2, 2], black: vec![100.0, 200.0, 100.0, 150.0], ..plain() };
        assert_eq!(shares(&pattern, 1, &[1000, 1050, 1000, 1050]), [1.0, 1.0, 1.0, 1.0]);
        let deltas = Levels { of_columns: vec![0.0, 10.0], of_rows: vec![0.0, 90.0], ..plain() };
        assert_eq!(shares(&deltas, 1, &[190, 200]), [0.0, 0.0]);
        let colors = Levels { black: vec![0.0, 10.0, 20.0], white: vec![10.0, 20.0, 30.0], ..plain() };
        assert_eq!(shares(&colors, 0, &[5, 15, 25, 10, 20, 30]), [0.5, 0.5, 0.5, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn white_is_above_black() {
        assert!(plain().sane().is_some());
        for (black, white) in [(100.0, 100.0), (f64::NAN, 1.0), (0.0, f64::INFINITY), (0.0, -1.0)] {
            assert!(Levels { black: vec![black], white: vec![white], ..plain() }.sane().is_none(), "{black} {white}");
        }
    }

    /// A correction of this number and these flags, and its parameters.
    fn listed(corrections: &[(u32, u32, Vec<u8>)]) -> Vec<u8> {
        let mut list = (corrections.len() as u32).to_be_bytes().to_vec();
        for (code, flags, parameters) in corrections {
            let head = [*code, 0x0103_0000, *flags, parameters.len() as u32];
            list.extend(head.iter().flat_map(|number| number.to_be_bytes()).chain(parameters.iter().copied()));
        }
        list
    }

    /// Of every second pixel of every second row of 8 x 8, from the first on: 1 at the left, 3 at the right.
    fn map() -> Vec<u8> {
        let counts = [0_u32, 0, 8, 8, 0, 1, 2, 2, 1, 2];
        let reals = [1.0_f64, 1.0, 0.0, 0.0];
        let gains = [1.0_f32, 3.0];
        let counts = counts.iter().flat_map(|count| count.to_be_bytes());
        let reals = reals.iter().flat_map(|real| real.to_be_bytes());
        counts.chain(reals).chain(1_u32.to_be_bytes()).chain(gains.iter().flat_map(|gain| gain.to_be_bytes())).collect()
    }

    #[test]
    fn gains_are_interpolated() {
        let maps = gain_maps(&listed(&[(1, 0, vec![7; 3]), (9, 0, map()), (99, 1, Vec::new())])).expect("a list");
        let [map] = &maps[..] else { panic!("{maps:?}") };
        let mut row = [1.0; 8];
        map.apply(1, [8, 8], 1, &mut row);
        assert_eq!(row, [1.0; 8], "every second row");
        map.apply(2, [8, 8], 1, &mut row);
        // Column 2 is 2.5 / 8 on the way from 1 to 3.
        assert_eq!(row[..4], [1.125, 1.0, 1.625, 1.0]);
    }

    #[test]
    fn corrections_that_must_be_made_are_known() {
        assert!(gain_maps(&[]).is_some_and(|maps| maps.is_empty()));
        assert!(gain_maps(&listed(&[(7, 0, Vec::new())])).is_none());
        assert!(gain_maps(&listed(&[(7, 1, Vec::new())])).is_some());
        let whole = listed(&[(9, 0, map())]);
        for end in 1..whole.len() {
            assert!(gain_maps(&whole[..end]).is_none(), "{end}");
        }
        let mut absurd = map();
        absurd.truncate(absurd.len() - 4);
        absurd.extend(f32::NAN.to_be_bytes());
        assert!(gain_maps(&listed(&[(9, 0, absurd)])).is_none());
    }
}
