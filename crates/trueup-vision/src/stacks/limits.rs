//! How far exposures of one stack are apart.

/// Two photographs this far apart by the pixels, in stops, are two exposures of a bracket, whatever else is known of
/// them: what an automatic exposure changes between two photographs of one view is less as a rule, and so is most of
/// what is edited.
pub const LEAST_STOPS: f64 = 0.5;

/// Exposures of one stack differ by at least this much by the pixels, in stops, unless their cameras recorded that they
/// do. Cameras bracket by a third of a stop and more, programs by less; two photographs at one exposure are seen up to
/// some 0.05 stops apart, for compression, a shift and flicker.
pub(super) const LEAST_STEP: f64 = 0.1;

/// A run of exposures that lie nearer than [`LEAST_STOPS`] to each other, one by one, is a stack if they range over so
/// many stops: neither an automatic exposure nor copies that were edited one after the other do.
pub(super) const LEAST_RANGE: f64 = 1.0;

/// Recorded exposures that differ by less, in stops, do not say of two pictures that they are two exposures. A third of
/// a stop, the least that dials have, is 0.26 to 0.42 by the rounded times that are recorded (1/6 and 1/5 s, 1/80 and
/// 1/60 s).
pub(super) const ONE_EXPOSURE: f64 = 0.2;

/// Recorded exposures that differ by no more, in stops, are the same one: times are recorded to some 2 %.
pub(super) const SAME_RECORD: f64 = 0.05;

/// Farthest that two exposures of one stack lie apart, as a part of the longer side: 3 degrees of 60. Neighbors of a
/// row are farther apart.
pub(super) const MOST_SHIFT: f64 = 0.05;
