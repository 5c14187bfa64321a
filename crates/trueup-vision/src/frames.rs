//! Which frames of a video a panorama needs: so far apart that all overlap well, and of those that could be taken the
//! sharpest.

/// Side in pixels of the squares of a frame that are averaged for following its motion.
const BLOCK_PX: usize = 6;

/// Radius in blocks of the surroundings whose mean is taken away, so that neither exposure nor light counts.
const SURROUNDINGS: usize = 3;

/// Blocks by which a frame may lie elsewhere than the motion so far foretells: of a frame 80 blocks wide a twelfth, a
/// camera that turns by two of its views a second.
const REACH: isize = 6;

/// Difference of two frames, as a share of what they show themselves, from which on they do not show the same: what is
/// drawn at random differs by three quarters, what moved by a tenth to a third.
const LOST: f64 = 0.5;

/// Least share of a frame that two must have in common to be compared.
const LEAST_COMMON: f64 = 0.25;

/// Overlap with the frame before at which one may be taken, and below which one must be: as much as photographs by hand
/// have, so that every feature is seen in two or three.
const OVERLAPS: [f64; 2] = [0.5, 0.75];

/// Overlap with the last frame taken up to which the end of a video shows something new.
const NEW_AT_END: f64 = 0.95;

/// A frame as its motion is followed.
#[derive(Debug)]
struct FollowedFrame {
    /// Means of blocks without those of their surroundings, gray levels.
    blocks: Vec<i16>,
    /// Mean size of the Laplacian, gray levels.
    sharpness: f64,
}

/// Follows the frames of a video, one after the other.
///
/// Frames are moved, never turned or scaled: what is wanted is how much of one is still in the other. Memory grows by 7
/// KB a frame of 480 x 270 pixels.
#[derive(Debug)]
pub struct FrameChooser {
    columns: usize,
    rows: usize,
    width: usize,
    frames: Vec<FollowedFrame>,
}

impl FrameChooser {
    /// For gray frames of `width` x `height` pixels, made small: 480 pixels across show blur, and are soon read.
    pub fn new(width: usize, height: usize) -> Self {
        Self { columns: width / BLOCK_PX, rows: height / BLOCK_PX, width, frames: Vec::new() }
    }

    /// Number of frames so far.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there was none.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// The next frame: gray levels, row by row. What is missing of the last rows counts as black.
    pub fn push(&mut self, gray: &[u8]) {
        let level = |x: usize, y: usize| gray.get(y * self.width + x).copied().unwrap_or(0);
        let mean = |block: usize| {
            let (left, top) = (block % self.columns * BLOCK_PX, block / self.columns * BLOCK_PX);
            let rows =
                (top..top + BLOCK_PX).map(|y| (left..left + BLOCK_PX).map(|x| u32::from(level(x, y))).sum::<u32>());
            // Sixteenths of a level, so that weak texture is followed, too.
            (16 * rows.sum::<u32>() / (BLOCK_PX * BLOCK_PX) as u32) as i16
        };
        let means: Vec<i16> = (0..self.columns * self.rows).map(mean).collect();
        let blocks = (0..means.len()).map(|at| means[at] - self.mean_around(&means, at)).collect();
        self.frames.push(FollowedFrame { blocks, sharpness: sharpness(gray, self.width) });
    }

    fn mean_around(&self, means: &[i16], at: usize) -> i16 {
        let near = |at: usize, length: usize| at.saturating_sub(SURROUNDINGS)..(at + SURROUNDINGS + 1).min(length);
        let (columns, rows) = (near(at % self.columns, self.columns), near(at / self.columns, self.rows));
        let count = (columns.len() * rows.len()) as i32;
        let sum: i32 =
            rows.flat_map(|y| &means[y * self.columns..][columns.clone()]).map(|&mean| i32::from(mean)).sum();
        (sum / count) as i16
    }

    /// Which share of each frame but the first shows what the one before it does; 0 for those that are not found there.
    pub fn steps(&self) -> Vec<f64> {
        let step = |frame: usize| self.those_that_overlap(frame).nth(1).map_or(0.0, |(_, overlap)| overlap);
        (0..self.frames.len().saturating_sub(1)).map(step).collect()
    }

    /// The numbers of the frames that are needed, in their order.
    pub fn needed(&self) -> Vec<usize> {
        let mut needed = Vec::new();
        // The first frames show the same; the sharpest of them begins.
        let Some(mut last) = self.sharpest(self.those_that_overlap(0).filter(|&(_, overlap)| overlap > NEW_AT_END))
        else {
            return needed;
        };
        loop {
            needed.push(last);
            let mut farthest = (last, 1.0);
            let mut candidates = Vec::new();
            let mut is_end = true;
            for (frame, overlap) in self.those_that_overlap(last).skip(1) {
                if overlap < OVERLAPS[0] {
                    is_end = false;
                    break;
                }
                farthest = (frame, overlap);
                if overlap <= OVERLAPS[1] {
                    candidates.push((frame, overlap));
                }
            }
            let next = match (self.sharpest(candidates.into_iter()), is_end) {
                (Some(sharpest), _) => sharpest,
                // A jump: what came before it is no farther away than that.
                (None, false) => (farthest.0 + 1).min(self.frames.len() - 1),
                (None, true) if farthest.1 < NEW_AT_END => farthest.0,
                (None, true) => return needed,
            };
            last = next;
        }
    }

    /// The sharpest of some frames, the first of equally sharp ones.
    fn sharpest(&self, frames: impl Iterator<Item = (usize, f64)>) -> Option<usize> {
        let sharper = |best: usize, frame: usize| match self.frames[frame].sharpness > self.frames[best].sharpness {
            true => frame,
            false => best,
        };
        frames.map(|(frame, _)| frame).reduce(sharper)
    }

    /// The frames from `first` on, and which share of each shows what `first` does; 0 for those that cannot be found in
    /// it.
    fn those_that_overlap(&self, first: usize) -> impl Iterator<Item = (usize, f64)> {
        let mut shift = [0_isize; 2];
        let mut speed = [0_isize; 2];
        (first..self.frames.len()).map(move |frame| {
            let expected = [shift[0] + speed[0], shift[1] + speed[1]];
            let found = if frame == first { Some([0; 2]) } else { self.shift(first, frame, expected) };
            let Some(found) = found else { return (frame, 0.0) };
            speed = [found[0] - shift[0], found[1] - shift[1]];
            shift = found;
            let share = |shift: isize, length: usize| 1.0 - shift.unsigned_abs() as f64 / length.max(1) as f64;
            (frame, share(shift[0], self.columns).max(0.0) * share(shift[1], self.rows).max(0.0))
        })
    }

    /// By how many blocks `second` lies right of and below `first`: near `expected` where they differ least, or else
    /// anywhere; `None` if they do not show the same.
    fn shift(&self, first: usize, second: usize, expected: [isize; 2]) -> Option<[isize; 2]> {
        let (first, second) = (&self.frames[first].blocks, &self.frames[second].blocks);
        let shown = |blocks: &[i16]| blocks.iter().map(|block| f64::from(block.unsigned_abs())).sum::<f64>();
        let most = LOST * (shown(first) + shown(second)) / first.len().max(1) as f64;
        let least = |shifts: &mut dyn Iterator<Item = [isize; 2]>| {
            let differing = shifts.filter_map(|shift| Some((self.difference(first, second, shift)?, shift)));
            let from_expected = |[x, y]: [isize; 2]| (x - expected[0]).pow(2) + (y - expected[1]).pow(2);
            let nearer = |a: &(f64, [isize; 2]), b: &(f64, [isize; 2])| {
                a.0.total_cmp(&b.0).then(from_expected(a.1).cmp(&from_expected(b.1)))
            };
            differing.min_by(nearer).filter(|&(difference, _)| difference <= most).map(|(_, shift)| shift)
        };
        let square =
            |[across, down]: [isize; 2]| (-down..=down).flat_map(move |y| (-across..=across).map(move |x| [x, y]));
        let near = |[x, y]: [isize; 2]| [expected[0] + x, expected[1] + y];
        least(&mut square([REACH; 2]).map(near))
            .or_else(|| least(&mut square([self.columns as isize, self.rows as isize])))
    }

    /// Mean difference of what two frames show in common; `None` if that is less than [`LEAST_COMMON`].
    fn difference(&self, first: &[i16], second: &[i16], [x, y]: [isize; 2]) -> Option<f64> {
        let common = |shift: isize, length: usize| (shift.max(0), length as isize + shift.min(0));
        let ((left, right), (top, bottom)) = (common(x, self.columns), common(y, self.rows));
        let count = (right - left).max(0) * (bottom - top).max(0);
        if count == 0 || (count as f64) < LEAST_COMMON * (self.columns * self.rows) as f64 {
            return None;
        }
        let mut sum = 0_u64;
        for row in top..bottom {
            let start = |row: isize, column: isize| (row * self.columns as isize + column) as usize;
            let across = (right - left) as usize;
            let (one, other) = (&first[start(row, left)..][..across], &second[start(row - y, left - x)..][..across]);
            sum += one.iter().zip(other).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>();
        }
        Some(sum as f64 / count as f64)
    }
}

/// Mean size of the Laplacian: the measure of focus of Nayar and Nakagawa, "Shape from focus", PAMI 1994.
fn sharpness(gray: &[u8], width: usize) -> f64 {
    let rows: Vec<&[u8]> = gray.chunks_exact(width.max(1)).collect();
    let (mut sum, mut count) = (0_u64, 0_u64);
    for three in rows.windows(3) {
        for x in 1..width.saturating_sub(1) {
            let around = [three[0][x], three[2][x], three[1][x - 1], three[1][x + 1]];
            sum += u64::from((4 * u32::from(three[1][x])).abs_diff(around.into_iter().map(u32::from).sum()));
            count += 1;
        }
    }
    sum as f64 / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 240;
    const HEIGHT: usize = 132;

    /// A wall of patches of 20 pixels, with smaller ones on them, whose levels look drawn.
    fn wall(x: usize, y: usize) -> u8 {
        let patch = |side: usize, levels: u64| {
            let number = (x / side) as u64 * 7919 + (y / side) as u64 * 104_729;
            (number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) % levels
        };
        (patch(20, 180) + patch(4, 60)) as u8
    }

    /// A frame whose corner lies at (x, y) of the wall, its pixels averaged over `blur` columns.
    fn frame(x: usize, y: usize, blur: usize) -> Vec<u8> {
        let level = |at: usize| {
            let (column, row) = (at % WIDTH + x, at / WIDTH + y);
            let sum: usize = (0..blur).map(|step| usize::from(wall(column + step, row))).sum();
            (sum / blur) as u8
        };
        (0..WIDTH * HEIGHT).map(level).collect()
    }

    fn needed(frames: impl Iterator<Item = Vec<u8>>) -> Vec<usize> {
        let mut chooser = FrameChooser::new(WIDTH, HEIGHT);
        frames.for_each(|frame| chooser.push(&frame));
        chooser.needed()
    }

    #[test]
    fn frames_are_taken_as_far_apart_as_photographs() {
        // 12 pixels a frame to the right: half of the width after 10 frames, a quarter after 5.
        let taken = needed((0..41).map(|number| frame(12 * number, 0, 1)));
        assert_eq!((taken[0], *taken.last().expect("some")), (0, 40));
        assert!(taken.windows(2).all(|two| two[1] > two[0] && two[1] - two[0] <= 10), "{taken:?}");
        assert!((5..=9).contains(&taken.len()), "{taken:?}");
    }

    #[test]
    fn steps_are_what_a_frame_has_in_common_with_the_one_before() {
        let mut chooser = FrameChooser::new(WIDTH, HEIGHT);
        assert!(chooser.steps().is_empty());
        // A tenth of the width to the right, then nothing, then a negative, which shows nothing of the same.
        [0, 24, 24].into_iter().for_each(|x| chooser.push(&frame(x, 0, 1)));
        chooser.push(&frame(24, 0, 1).iter().map(|level| 255 - level).collect::<Vec<u8>>());
        assert_eq!(chooser.steps(), [0.9, 1.0, 0.0]);
    }

    #[test]
    fn of_those_that_could_be_taken_the_sharpest_is() {
        let blur = |number: usize| if number % 7 == 3 { 1 } else { 5 };
        let taken = needed((0..41).map(|number| frame(12 * number, 0, blur(number))));
        assert!(taken[1..taken.len() - 1].iter().all(|number| number % 7 == 3), "{taken:?}");
    }

    #[test]
    fn a_camera_that_stands_still_or_jumps_is_followed() {
        assert_eq!(needed((0..20).map(|_| frame(30, 10, 1))), [0]);
        assert_eq!(needed(std::iter::empty()), [0; 0]);
        // Still, then a step of a third of a frame, then another place.
        let places = [0, 80, 4000];
        let taken = needed((0..30).map(|number| frame(places[number / 10], 0, 1)));
        assert_eq!(taken.iter().map(|number| number / 10).collect::<Vec<_>>(), [0, 1, 2]);
        // Downwards and back.
        let taken = needed((0..41_usize).map(|number| frame(0, 6 * number.min(40 - number), 1)));
        assert!(taken.len() >= 4, "{taken:?}");
    }
}
