//! From a camera's own colors to sRGB's.
//!
//! # Source
//! DNG, chapter 6, "Mapping Camera Color Space to CIE XYZ Space"; chromatic adaptation after Bradford (ICC.1:2022,
//! annex E).

/// Rows of a matrix.
pub(super) type Matrix = [[f64; 3]; 3];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// White of the profile connection space, D50 (ICC.1:2022, section 7.2.16), as XYZ and as its chromaticity x, y.
const D50: [f64; 3] = [0.9642, 1.0, 0.8249];
const D50_XY: [f64; 2] = [0.345_704, 0.358_540];

/// From XYZ of D50 to linear sRGB: the inverse of the columns that ICC profiles of sRGB have (IEC 61966-2-1, adapted
/// after Bradford).
const SRGB_FROM_XYZ: Matrix = [
    [3.133_856_1, -1.616_866_7, -0.490_614_6],
    [-0.978_768_4, 1.916_141_5, 0.033_454_0],
    [0.071_945_3, -0.228_991_4, 1.405_242_7],
];

/// The responses of the eye's cones that Bradford adapts (ICC.1:2022, annex E.3).
const BRADFORD: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// Rounds in which a white is found whose matrix gives this white again, and when it is.
const MOST_ROUNDS: usize = 30;
const SAME_PLACE: f64 = 1e-7;

/// How far the three sums of a matrix that maps white to white may be apart: its numbers are rounded.
const SAME_WHITE: f64 = 0.05;

/// What a camera's maker measured under one light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UnderLight {
    /// The light's code, of EXIF's LightSource; 0 if it is not told.
    pub(super) light: u16,
    /// ColorMatrix: camera colors from XYZ.
    pub(super) camera_from_xyz: Matrix,
    /// CameraCalibration: this camera's colors from those of its model.
    pub(super) calibration: Option<Matrix>,
    /// ForwardMatrix: XYZ of D50 from balanced camera colors.
    pub(super) xyz_from_balanced: Option<Matrix>,
}

/// What a file says of white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum White {
    /// AsShotNeutral: the camera colors of a gray thing.
    Neutral([f64; 3]),
    /// AsShotWhiteXY: the chromaticity of the light.
    Place([f64; 2]),
}

/// How colors are developed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Development {
    /// By what the camera's colors are multiplied, at least 1, so that gray is gray; what is clipped is white then.
    pub(super) balance: [f64; 3],
    /// Linear sRGB from balanced colors; gray stays gray.
    pub(super) srgb_from_balanced: Matrix,
}

/// How to develop; `None` if the numbers contradict each other.
pub(super) fn development(
    lights: &[UnderLight],
    analog: Option<[f64; 3]>,
    white: Option<White>,
) -> Option<Development> {
    let analog = diagonal(analog.unwrap_or([1.0; 3]));
    // Camera colors from XYZ, and from those of its model, in a light of this chromaticity.
    let at = |xy: [f64; 2]| -> Option<(Matrix, Matrix, Option<Matrix>)> {
        let mixed = |of: fn(&UnderLight) -> Option<Matrix>| mixed(lights, temperature(xy), of);
        let own = product(&analog, &mixed(|one| Some(one.calibration.unwrap_or(IDENTITY)))?);
        let camera_from_xyz = product(&own, &mixed(|one| Some(one.camera_from_xyz))?);
        Some((camera_from_xyz, own, mixed(|one| one.xyz_from_balanced)))
    };
    let (neutral, xy) = match white {
        Some(White::Neutral(neutral)) => (neutral, place_of(neutral, |xy| Some(at(xy)?.0))?),
        Some(White::Place(xy)) => (of_vector(&at(xy)?.0, xyz_of(xy)), xy),
        None => (of_vector(&at(D50_XY)?.0, xyz_of(D50_XY)), D50_XY),
    };
    let most = neutral.into_iter().fold(0.0, f64::max);
    if !neutral.iter().all(|&level| level.is_finite() && level > 0.0) {
        return None;
    }
    let neutral = neutral.map(|level| level / most);
    let (camera_from_xyz, own, forward) = at(xy)?;
    let xyz_from_camera = match forward {
        Some(forward) => {
            let model_from_camera = inverse(&own)?;
            let balance = of_vector(&model_from_camera, neutral).map(|level| 1.0 / level);
            product(&product(&forward, &diagonal(balance)), &model_from_camera)
        }
        None => product(&adaptation(xyz_of(xy))?, &inverse(&camera_from_xyz)?),
    };
    let matrix = product(&product(&SRGB_FROM_XYZ, &xyz_from_camera), &diagonal(neutral));
    let sums = matrix.map(|row| row.iter().sum::<f64>());
    let mean = sums.iter().sum::<f64>() / 3.0;
    let is_white = |sum: &f64| (sum / mean - 1.0).abs() < SAME_WHITE;
    if mean <= 0.0 || !sums.iter().all(is_white) {
        return None;
    }
    let mut srgb_from_balanced = matrix;
    for (row, sum) in srgb_from_balanced.iter_mut().zip(sums) {
        row.iter_mut().for_each(|value| *value /= sum);
    }
    Some(Development { balance: neutral.map(|level| 1.0 / level), srgb_from_balanced })
}

/// The chromaticity of a light in which gray things have these camera colors.
fn place_of(neutral: [f64; 3], camera_from_xyz: impl Fn([f64; 2]) -> Option<Matrix>) -> Option<[f64; 2]> {
    let mut xy = D50_XY;
    for _ in 0..MOST_ROUNDS {
        let [x, y, z] = of_vector(&inverse(&camera_from_xyz(xy)?)?, neutral);
        let sum = x + y + z;
        let next = [x / sum, y / sum];
        if !next.iter().all(|place| (0.0..1.0).contains(place)) {
            return None;
        }
        let step = (next[0] - xy[0]).abs() + (next[1] - xy[1]).abs();
        xy = next;
        if step < SAME_PLACE {
            break;
        }
    }
    Some(xy)
}

/// What was measured under two lights, for a light between them: linear in the inverse of the temperature.
fn mixed(lights: &[UnderLight], temperature: f64, of: fn(&UnderLight) -> Option<Matrix>) -> Option<Matrix> {
    let [first, second] = match lights {
        [one] => [one, one],
        [first, second, ..] => [first, second],
        [] => return None,
    };
    let (a, b) = match (of(first), of(second)) {
        (Some(a), Some(b)) => (a, b),
        (one, other) => return one.or(other),
    };
    let share = match (kelvin(first.light), kelvin(second.light)) {
        (Some(one), Some(other)) if one != other => {
            ((1.0 / temperature - 1.0 / other) / (1.0 / one - 1.0 / other)).clamp(0.0, 1.0)
        }
        _ => 1.0,
    };
    Some(std::array::from_fn(|row| {
        std::array::from_fn(|column| share * a[row][column] + (1.0 - share) * b[row][column])
    }))
}

/// The temperature of a light, in kelvin, by its code (EXIF 3.0, section 4.6.6.7, "LightSource").
fn kelvin(light: u16) -> Option<f64> {
    Some(match light {
        3 | 17 => 2850.0,
        24 => 3200.0,
        15 => 3450.0,
        2 | 14 => 4150.0,
        13 | 23 => 5000.0,
        1 | 4 | 9 | 18 | 20 => 5500.0,
        12 => 6430.0,
        10 | 19 | 21 => 6500.0,
        11 | 22 => 7500.0,
        _ => return None,
    })
}

/// The correlated color temperature of a chromaticity, in kelvin.
///
/// # Source
/// McCamy 1992, "Correlated color temperature as an explicit function of chromaticity coordinates".
fn temperature([x, y]: [f64; 2]) -> f64 {
    let n = (x - 0.3320) / (0.1858 - y);
    let kelvin = ((449.0 * n + 3525.0) * n + 6823.3) * n + 5520.33;
    if kelvin.is_finite() { kelvin.clamp(1000.0, 50_000.0) } else { 5000.0 }
}

fn xyz_of([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// XYZ as they look in D50, from XYZ in light of this white.
fn adaptation(white: [f64; 3]) -> Option<Matrix> {
    let [from, to] = [white, D50].map(|white| of_vector(&BRADFORD, white));
    let gains = diagonal(std::array::from_fn(|cone| to[cone] / from[cone]));
    Some(product(&product(&inverse(&BRADFORD)?, &gains), &BRADFORD))
}

fn diagonal([a, b, c]: [f64; 3]) -> Matrix {
    [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|row| std::array::from_fn(|column| (0..3).map(|k| a[row][k] * b[k][column]).sum()))
}

pub(super) fn of_vector(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

/// By Cramer's rule; `None` of a matrix that has none.
fn inverse(m: &Matrix) -> Option<Matrix> {
    // The minor of rows and columns that are not these, in their cyclic order, which has the sign in it.
    let minor = |row: usize, column: usize| {
        let [r, s] = [(row + 1) % 3, (row + 2) % 3];
        let [c, d] = [(column + 1) % 3, (column + 2) % 3];
        m[r][c] * m[s][d] - m[r][d] * m[s][c]
    };
    let determinant: f64 = (0..3).map(|column| m[0][column] * minor(0, column)).sum();
    let inverse: Matrix = std::array::from_fn(|row| std::array::from_fn(|column| minor(column, row) / determinant));
    inverse.as_flattened().iter().all(|value| value.is_finite()).then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// sRGB as a camera: its own matrix from XYZ of D65 (IEC 61966-2-1, section 5.2).
    const SRGB_CAMERA: UnderLight = UnderLight {
        light: 21,
        camera_from_xyz: [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]],
        calibration: None,
        xyz_from_balanced: None,
    };

    #[track_caller]
    fn check_near(found: Matrix, wanted: Matrix, most: f64) {
        let off =
            found.as_flattened().iter().zip(wanted.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off <= most, "{found:?}");
    }

    #[test]
    fn a_camera_that_is_srgb_is_left_as_it_is() {
        for white in [White::Neutral([1.0; 3]), White::Place([0.3127, 0.3290])] {
            let Development { balance, srgb_from_balanced } =
                development(&[SRGB_CAMERA], None, Some(white)).expect("colors");
            assert!(balance.iter().all(|gain| (gain - 1.0).abs() < 2e-3), "{balance:?}");
            check_near(srgb_from_balanced, IDENTITY, 2e-3);
        }
        // With a gain before its converter, and with a forward matrix: the columns of sRGB's profile (IEC 61966-2-1 to
        // D50).
        let forward = Some([[0.4361, 0.3851, 0.1431], [0.2225, 0.7169, 0.0606], [0.0139, 0.0971, 0.7141]]);
        let camera = UnderLight { xyz_from_balanced: forward, ..SRGB_CAMERA };
        for camera in [SRGB_CAMERA, camera] {
            let white = Some(White::Neutral([0.5, 1.0, 0.8]));
            let found = development(&[camera], Some([0.5, 1.0, 0.8]), white).expect("colors");
            assert!(found.balance.iter().zip([2.0, 1.0, 1.25]).all(|(a, b)| (a - b).abs() < 1e-9));
            check_near(found.srgb_from_balanced, IDENTITY, 2e-3);
        }
    }

    #[test]
    fn gray_is_gray_in_every_light() {
        let other = UnderLight {
            light: 17,
            camera_from_xyz: [[0.9, -0.3, -0.1], [-0.4, 1.2, 0.2], [-0.1, 0.2, 0.6]],
            ..SRGB_CAMERA
        };
        for neutral in [[0.6, 1.0, 0.4], [0.45, 1.0, 0.7], [0.9, 1.0, 0.9]] {
            let found = development(&[other, SRGB_CAMERA], None, Some(White::Neutral(neutral))).expect("colors");
            let gray = of_vector(&found.srgb_from_balanced, [0.4; 3]);
            assert!(gray.iter().all(|level| (level - 0.4).abs() < 1e-12), "{gray:?}");
            let balanced: [f64; 3] = std::array::from_fn(|color| neutral[color] * found.balance[color]);
            assert!(balanced.iter().all(|level| (level - balanced[0]).abs() < 1e-12));
            assert!(found.balance.iter().all(|&gain| gain >= 1.0));
        }
    }

    /// Temperatures of D50, D65 and of standard illuminant A (CIE 15:2018, tables 1 and T.3).
    #[test]
    fn lights_have_their_temperature() {
        for (xy, kelvin) in [([0.3457, 0.3585], 5003.0), ([0.3127, 0.3290], 6504.0), ([0.4476, 0.4074], 2856.0)] {
            assert!((temperature(xy) - kelvin).abs() < 10.0, "{}", temperature(xy));
        }
        let light = |light, value| UnderLight { light, camera_from_xyz: diagonal([value; 3]), ..SRGB_CAMERA };
        let between =
            mixed(&[light(17, 0.0), light(21, 1.0)], 4000.0, |one| Some(one.camera_from_xyz)).expect("a matrix");
        // (1/4000 - 1/6500) / (1/2850 - 1/6500) = 0.48801.
        assert!((between[0][0] - (1.0 - 0.488_014)).abs() < 1e-5, "{between:?}");
    }

    #[test]
    fn absurd_numbers_are_not_believed() {
        for neutral in [[0.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [f64::NAN; 3], [f64::INFINITY; 3]] {
            assert!(development(&[SRGB_CAMERA], None, Some(White::Neutral(neutral))).is_none(), "{neutral:?}");
        }
        let flat = UnderLight { camera_from_xyz: [[1.0; 3]; 3], ..SRGB_CAMERA };
        assert!(development(&[flat], None, Some(White::Neutral([1.0; 3]))).is_none());
        assert!(development(&[], None, None).is_none());
    }

    #[test]
    fn matrices_are_inverted() {
        let matrix = [[2.0, 1.0, 0.0], [0.0, 3.0, 1.0], [1.0, 0.0, 1.0]];
        check_near(product(&matrix, &inverse(&matrix).expect("an inverse")), IDENTITY, 1e-12);
    }
}
