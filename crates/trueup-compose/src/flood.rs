//! How far one place lies from others, step by step.

/// Rounds of going on from a front to what lies `beside` it, until nothing more is reached; 0 if the front is empty.
/// What `is_reached` already is not entered.
pub(crate) fn rounds<Beside: Iterator<Item = usize>>(
    mut front: Vec<usize>,
    is_reached: &mut [bool],
    beside: impl Fn(usize) -> Beside,
) -> usize {
    front.iter().for_each(|&at| is_reached[at] = true);
    let mut rounds = 0;
    while !front.is_empty() {
        rounds += 1;
        let further = front.iter().flat_map(|&at| beside(at));
        front = further.filter(|&at| !std::mem::replace(&mut is_reached[at], true)).collect();
    }
    rounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_front_goes_on_until_nothing_more_is_reached() {
        let along = |at: usize| [at.wrapping_sub(1), at + 1].into_iter().filter(|&at| at < 9);
        let rounds = |front: &[usize], wall: usize| {
            let mut is_reached: Vec<bool> = (0..9).map(|at| at == wall).collect();
            let rounds = rounds(front.to_vec(), &mut is_reached, along);
            (rounds, is_reached.iter().filter(|&&reached| reached).count())
        };
        // The front itself is a round.
        assert_eq!([rounds(&[0], 9), rounds(&[0, 8], 9), rounds(&[], 9)], [(9, 9), (5, 9), (0, 0)]);
        assert_eq!(rounds(&[0], 3), (3, 4));
    }
}
