//! How far the photographs stand from upright, against the truth.

use trueup_core::geometry::{circular_mean, wrap_angle};
use trueup_core::mesh::GridMesh;

/// Signed angles of photographs to upright, in radians, and what they come to.
#[derive(Debug, Clone, PartialEq)]
pub struct Uprightness {
    /// By how much each photograph is turned too far clockwise, in [-pi, pi); NaN where its middle is not shown, and
    /// such count for nothing.
    pub photographs: Vec<f64>,
    /// Mean of the absolute values.
    pub mean: f64,
    /// Largest absolute value.
    pub largest: f64,
    /// Mean of the absolute differences from the photographs' common direction: 0 if all lean alike.
    pub spread: f64,
}

impl Uprightness {
    /// Sums up angles to upright; `None` without any that is known.
    pub fn of(photographs: Vec<f64>) -> Option<Self> {
        let known: Vec<f64> = photographs.iter().copied().filter(|angle| !angle.is_nan()).collect();
        let count = known.len() as f64;
        // Angles that cancel out have no common direction; the spread is then about 0.
        let common = circular_mean(known.iter().map(|&angle| (angle, 1.0))).unwrap_or(0.0);
        let mean_of = |angle: &dyn Fn(&f64) -> f64| known.iter().map(|one| angle(one).abs()).sum::<f64>() / count;
        let (mean, spread) = (mean_of(&|&one| one), mean_of(&|&one| wrap_angle(one - common)));
        let largest = known.iter().fold(0.0, |largest: f64, angle| largest.max(angle.abs()));
        (!known.is_empty()).then_some(Self { photographs, mean, largest, spread })
    }

    /// How far photographs whose verticals truly stand at `gammas` (radians, the clockwise turns that stand them
    /// upright) are from upright in the middle; `None` without
    /// photographs, or if the lists differ in length.
    pub fn against(meshes: &[GridMesh], gammas: &[f64]) -> Option<Self> {
        let off = |(mesh, gamma): (&GridMesh, &f64)| mesh.lean_in_the_middle(*gamma);
        if meshes.len() != gammas.len() {
            return None;
        }
        Self::of(meshes.iter().zip(gammas).map(off).collect())
    }
}

/// Expected absolute value of an angle that is known to be `mean`, with the standard error `deviation`, in the same
/// unit: the mean of the folded normal distribution.
///
/// # Source
/// Leone, Nelson and Nottingham, "The folded normal distribution", Technometrics 3, 1961.
pub fn expected_magnitude(mean: f64, deviation: f64) -> f64 {
    use std::f64::consts::{FRAC_2_PI, SQRT_2};
    if deviation <= 0.0 {
        return mean.abs();
    }
    let ratio = mean / deviation;
    deviation * FRAC_2_PI.sqrt() * (-0.5 * ratio * ratio).exp() + mean * error_function(ratio / SQRT_2)
}

/// erf(x), right to 1.5e-7.
///
/// # Source
/// Abramowitz and Stegun, Handbook of Mathematical Functions, 7.1.26.
fn error_function(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 5] = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let polynomial = COEFFICIENTS.iter().fold(0.0, |sum, coefficient| sum * t + coefficient) * t;
    x.signum() * (1.0 - polynomial * (-x * x).exp())
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation2;

    use super::*;

    fn turned(angle: f64) -> GridMesh {
        let mut mesh = GridMesh::regular(400.0, 300.0, 40.0);
        mesh.target = (0..mesh.len()).map(|vertex| (Rotation2::new(angle) * mesh.source(vertex)).into()).collect();
        mesh
    }

    /// Off by 1, 2 and 6 degrees clockwise: mean 3, largest 6, common direction 3 (2.999 on the circle), spread 2.
    #[test]
    fn a_common_lean_counts_as_off_upright_but_not_as_spread() {
        let gammas = [0.1, -0.2, 0.3];
        let off = [1.0_f64, 2.0, 6.0].map(f64::to_radians);
        let meshes: Vec<GridMesh> = gammas.iter().zip(off).map(|(gamma, off)| turned(gamma + off)).collect();
        let uprightness = Uprightness::against(&meshes, &gammas).expect("three photographs");
        assert!((uprightness.mean.to_degrees() - 3.0).abs() < 1e-9);
        assert!((uprightness.largest.to_degrees() - 6.0).abs() < 1e-9);
        assert!((uprightness.spread.to_degrees() - 2.0).abs() < 2e-3);
    }

    /// E|N(0, 1)| is the root of 2 / pi; E|N(1, 1)| is 1.16663 (Leone and others, table 1); far from zero it is the
    /// mean.
    #[test]
    fn an_uncertain_angle_is_expected_to_be_larger() {
        for (mean, deviation, expected) in [(0.0, 1.0, 0.797_884_6), (1.0, 1.0, 1.166_63), (-1.0, 1.0, 1.166_63)] {
            assert!((expected_magnitude(mean, deviation) - expected).abs() < 1e-5, "{mean}");
        }
        assert!((expected_magnitude(-3.0, 0.3) - 3.0).abs() < 1e-6);
        assert!((expected_magnitude(-3.0, 0.0) - 3.0).abs() < 1e-15);
    }

    #[test]
    fn no_photographs_have_no_figure() {
        assert!(Uprightness::of(Vec::new()).is_none());
        assert!(Uprightness::of(vec![f64::NAN]).is_none());
        let known = Uprightness::of(vec![0.2, f64::NAN, -0.4]).expect("two are known");
        assert!((known.mean - 0.3).abs() < 1e-12 && known.largest == 0.4);
        assert!(Uprightness::against(&[turned(0.0)], &[]).is_none());
    }
}
