//! Random changes of inputs that are valid.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use trueup_fuzz::mend_checksums;

/// Changes of one input, at most.
const MOST_CHANGES: usize = 6;

/// Longest piece that is taken out, doubled or taken from elsewhere, in bytes.
const MOST_PIECE: usize = 64;

/// Longest input that is made, in bytes.
const MOST_BYTES: usize = 1 << 18;

/// Numbers at which arithmetic and limits change.
const NUMBERS: [u64; 12] =
    [0, 1, 2, 8, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 0x7fff_ffff_ffff_ffff, u64::MAX];

/// What texts and lists are made of.
const WORDS: [&str; 16] = [
    "-1",
    "0",
    "1e308",
    "-1e-308",
    "nan",
    "NaN",
    "null",
    "true",
    "\"\"",
    "[]",
    "{}",
    "99999999999999999999",
    "--",
    "=",
    "\n",
    "\u{feff}",
];

/// A change of one of the `seeds`, of which there is one at least.
pub(crate) fn mutated(seeds: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
    let pick = |random: &mut ChaCha8Rng| seeds[random.random_range(0..seeds.len())].clone();
    let mut input = pick(random);
    for _ in 0..random.random_range(1..=MOST_CHANGES) {
        match random.random_range(0..8) {
            0 => change_byte(&mut input, |byte, random| byte ^ 1 << random.random_range(0..8), random),
            1 => change_byte(&mut input, |_, random| random.random(), random),
            2 => overwrite_number(&mut input, random),
            3 => {
                let piece = random_piece(&input, random);
                input.drain(piece);
            }
            4 => {
                let piece = input[random_piece(&input, random)].to_vec();
                insert(&mut input, &piece, random);
            }
            5 => {
                let other = pick(random);
                let piece = other[random_piece(&other, random)].to_vec();
                insert(&mut input, &piece, random);
            }
            6 => insert(&mut input, WORDS[random.random_range(0..WORDS.len())].as_bytes(), random),
            _ => input.truncate(random.random_range(0..=input.len())),
        }
    }
    input.truncate(MOST_BYTES);
    // Behind checksums that are wrong nothing is read.
    if random.random() {
        mend_checksums(&mut input);
    }
    input
}

fn change_byte(input: &mut [u8], change: impl Fn(u8, &mut ChaCha8Rng) -> u8, random: &mut ChaCha8Rng) {
    if !input.is_empty() {
        let place = random.random_range(0..input.len());
        input[place] = change(input[place], random);
    }
}

/// Writes a number of 1, 2, 4 or 8 bytes, in either order of bytes, over what is there.
fn overwrite_number(input: &mut [u8], random: &mut ChaCha8Rng) {
    let number = NUMBERS[random.random_range(0..NUMBERS.len())];
    let length = 1 << random.random_range(0..4);
    let mut bytes = number.to_le_bytes()[..length].to_vec();
    if random.random() {
        bytes.reverse();
    }
    if let Some(last) = input.len().checked_sub(length) {
        let place = random.random_range(0..=last);
        input[place..place + length].copy_from_slice(&bytes);
    }
}

fn random_piece(input: &[u8], random: &mut ChaCha8Rng) -> std::ops::Range<usize> {
    let start = random.random_range(0..=input.len());
    let length = random.random_range(0..=MOST_PIECE.min(input.len() - start));
    start..start + length
}

fn insert(input: &mut Vec<u8>, piece: &[u8], random: &mut ChaCha8Rng) {
    let place = random.random_range(0..=input.len());
    input.splice(place..place, piece.iter().copied());
}
