//! Colors that the color-blind can tell apart (Okabe and Ito, Color Universal Design, 2008), over pictures of any
//! color.

/// Colors of photographs, one after the other.
const PHOTOGRAPHS: [&str; 7] = ["#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"];

/// The color of the photograph at this position of [`trueup::Project::images`].
pub fn photograph_color(position: usize) -> &'static str {
    PHOTOGRAPHS[position % PHOTOGRAPHS.len()]
}

/// What lies below colored strokes, so that they show on bright and on dark pictures.
pub(super) const HALO: &str = "#000000";

/// Red, green and blue of the ramp of alignment errors: none, the limit of good, and that of fair.
const RAMP: [[f64; 3]; 3] = [[0.0, 114.0, 178.0], [240.0, 228.0, 66.0], [213.0, 94.0, 0.0]];

/// The color of an error, where `good` and `fair` are the limits of what is called so.
pub(super) fn error_color(error: f64, [good, fair]: [f64; 2]) -> String {
    let (low, share) = match error < good {
        true => (0, error / good),
        false => (1, (error - good) / (fair - good)),
    };
    let share = share.clamp(0.0, 1.0);
    let level = |channel: usize| (RAMP[low][channel] * (1.0 - share) + RAMP[low + 1][channel] * share).round() as u8;
    format!("#{:02x}{:02x}{:02x}", level(0), level(1), level(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_go_from_blue_over_yellow_to_vermilion() {
        let limits = [2.0, 8.0];
        assert_eq!(
            [0.0, 2.0, 8.0, 99.0].map(|error| error_color(error, limits)),
            ["#0072b2", "#f0e442", "#d55e00", "#d55e00"]
        );
        // Halfway: (0 + 240) / 2, (114 + 228) / 2, (178 + 66) / 2.
        assert_eq!(error_color(1.0, limits), "#78ab7a");
    }
}
