//! The inner loops, compiled for the processor's vector instructions where it has them.
//!
//! Every function chooses at run time and has a portable form with the same order of operations and no fused
//! multiply-add, so that both give the same bits.

mod interpolation;
mod light;
mod positions;

pub(crate) use interpolation::{Rgb8, cubic_rgb8, cubic_window, linear_rgb8};
pub(crate) use light::{Contribution, Development, accumulate, develop};
pub(crate) use positions::{InverseBilinear, Positions, invert_row};

/// A loop to be compiled for the processor's vector instructions. `run` must be `#[inline(always)]` (a closure is not).
pub(crate) trait VectorLoop {
    /// Runs the loop.
    fn run(self);
}

/// Runs a loop, compiled for AVX2 where the processor has it.
pub(crate) fn with_vector_instructions(work: impl VectorLoop) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { x86::run(work) };
    }
    work.run();
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::VectorLoop;

    #[target_feature(enable = "avx2")]
    pub(super) fn run(work: impl VectorLoop) {
        work.run();
    }
}
