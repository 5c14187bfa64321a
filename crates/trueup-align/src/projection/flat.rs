//! Directions to a plane and back.

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::fitted::{Fit, NEAREST, panini_longitude};

/// A projection that is decided on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FlatKind {
    /// Longitude and latitude.
    Equirectangular,
    /// The cylinder seen from its axis.
    Cylindrical,
    /// Mercator's.
    Mercator,
    /// A plane seen from the center.
    Perspective,
    /// Panini's.
    Panini,
    /// The sphere seen from its own surface.
    Stereographic,
    /// One between the others, see [`Fit`].
    Fitted,
}

impl FlatKind {
    /// As the user writes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Equirectangular => "equirectangular",
            Self::Cylindrical => "cylindrical",
            Self::Mercator => "mercator",
            Self::Perspective => "perspective",
            Self::Panini => "panini",
            Self::Stereographic => "stereographic",
            Self::Fitted => "fitted",
        }
    }

    /// Whether longitude is the plane's x, so that a full turn closes.
    pub fn turns(self) -> bool {
        matches!(self, Self::Equirectangular | Self::Cylindrical | Self::Mercator)
    }

    /// Half of the horizontal and of the vertical angle (radians) up to which the projection is shown unless asked for
    /// more: what lies farther is stretched to more than about three times the middle's size.
    pub fn comfortable(self) -> [f64; 2] {
        let degrees = match self {
            Self::Equirectangular => [180.0, 90.0],
            Self::Cylindrical => [180.0, 60.0],
            Self::Mercator => [180.0, 70.0],
            Self::Perspective => [55.0, 55.0],
            Self::Panini => [105.0, 60.0],
            Self::Stereographic => [120.0, 120.0],
            // Shown as far as the limits that it was fitted to allow.
            Self::Fitted => [180.0, 90.0],
        };
        degrees.map(f64::to_radians)
    }

    /// Half of the largest horizontal angle in radians that can be asked for.
    pub fn largest_half_width(self) -> f64 {
        let degrees: f64 = match self {
            Self::Equirectangular | Self::Cylindrical | Self::Mercator | Self::Fitted => 180.0,
            Self::Perspective => 80.0,
            Self::Panini => 150.0,
            Self::Stereographic => 160.0,
        };
        degrees.to_radians()
    }
}

/// A map between the viewer's directions (x right, y down, z forward) and a plane (x right, y down) whose unit is one
/// radian at the middle.
///
/// # Source
/// J. P. Snyder, "Map projections: a working manual" (1987), chapters 7, 12, 21, 22; T. K. Sharpless, B. Postle and D.
/// M. German, "Pannini: a new projection for rendering wide angle perspective images" (2010), equations 1 to 3.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Flat {
    /// Which projection.
    pub kind: FlatKind,
    /// Distance of Panini's viewpoint behind the axis; the others do not ask.
    pub panini_distance: f64,
    /// Which of the family a fitted projection is; the others do not ask.
    #[serde(default)]
    pub fit: Fit,
}

impl Flat {
    /// A projection by its name, Panini's of this distance.
    pub fn named(kind: FlatKind, panini_distance: f64) -> Self {
        Self { kind, panini_distance, fit: Fit::default() }
    }

    /// One of the family, by its name if it has one.
    pub fn fitted(fit: Fit) -> Self {
        match fit {
            Fit { round, upright: 1.0, .. } if round <= 0.0 => Self::named(FlatKind::Perspective, 0.0),
            Fit { round, upright: 1.0, turned: false } if round <= 1.0 => Self::named(FlatKind::Panini, round),
            _ => Self { kind: FlatKind::Fitted, panini_distance: 0.0, fit },
        }
    }

    /// The place of a direction of any length; `None` where the projection has none or it is all but infinitely far.
    ///
    /// Longitudes lie within half a turn of the middle.
    pub fn place(&self, direction: Vector3<f64>) -> Option<Vector2<f64>> {
        let [[x, y, z]] = direction.try_normalize(f64::MIN_POSITIVE)?.data.0;
        let level = x.hypot(z);
        let longitude = x.atan2(z);
        match self.kind {
            FlatKind::Equirectangular => Some(Vector2::new(longitude, y.atan2(level))),
            FlatKind::Cylindrical => (level > NEAREST).then(|| Vector2::new(longitude, y / level)),
            FlatKind::Mercator => (level > NEAREST).then(|| Vector2::new(longitude, (y / level).asinh())),
            FlatKind::Perspective => (z > NEAREST).then(|| Vector2::new(x / z, y / z)),
            FlatKind::Panini => {
                let d = self.panini_distance;
                let depth = d * level + z;
                // Beyond its own cosine the plane folds back.
                let shown = level > NEAREST && depth > NEAREST && 1.0 + d * z / level > NEAREST;
                shown.then(|| {
                    let scale = (d + 1.0) * level / depth;
                    Vector2::new(scale * x / level, scale * y / level)
                })
            }
            FlatKind::Fitted => self.fit.place(&Vector3::new(x, y, z)),
            FlatKind::Stereographic => (1.0 + z > NEAREST).then(|| Vector2::new(x, y) * (2.0 / (1.0 + z))),
        }
    }

    /// Whether the projection ends at half a turn without closing there.
    pub(super) fn is_cut_behind(&self) -> bool {
        self.kind == FlatKind::Fitted && self.fit.is_cut_behind()
    }

    /// The unit direction of a place; `None` if none goes there.
    pub fn direction(&self, place: Vector2<f64>) -> Option<Vector3<f64>> {
        let [[x, y]] = place.data.0;
        let turned = |longitude: f64, slope: f64| Vector3::new(longitude.sin(), slope, longitude.cos()).normalize();
        match self.kind {
            FlatKind::Equirectangular => {
                (y.abs() <= PI / 2.0).then(|| Vector3::new(y.cos() * x.sin(), y.sin(), y.cos() * x.cos()))
            }
            FlatKind::Cylindrical => Some(turned(x, y)),
            FlatKind::Mercator => Some(turned(x, y.sinh())),
            FlatKind::Perspective => Some(Vector3::new(x, y, 1.0).normalize()),
            FlatKind::Panini => {
                let d = self.panini_distance;
                let longitude = panini_longitude(x, d)?;
                Some(turned(longitude, y * (d + longitude.cos()) / (d + 1.0)))
            }
            FlatKind::Fitted => self.fit.direction(place),
            FlatKind::Stereographic => {
                let square = place.norm_squared();
                Some(Vector3::new(4.0 * x, 4.0 * y, 4.0 - square) / (4.0 + square))
            }
        }
    }

    /// The turn after which the plane repeats.
    pub fn period(&self) -> Option<f64> {
        self.kind.turns().then_some(TAU)
    }

    /// The plane's x at `angle` radians to the right of the middle, and its y at `angle` below.
    pub fn reach(&self, angle: [f64; 2]) -> Vector2<f64> {
        let right = match self.kind.turns() {
            true => angle[0],
            false => {
                self.place(Vector3::new(angle[0].sin(), 0.0, angle[0].cos())).map_or(f64::INFINITY, |place| place.x)
            }
        };
        let below = Vector3::new(0.0, angle[1].sin(), angle[1].cos());
        // At a pole itself, the cylinders have no end, and the equirectangular projection has no longitude.
        let below = match self.kind {
            FlatKind::Equirectangular => angle[1],
            _ => self.place(below).map_or(f64::INFINITY, |place| place.y),
        };
        Vector2::new(right, below)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    impl FlatKind {
        pub(in crate::projection) const ALL: [Self; 6] = [
            Self::Equirectangular,
            Self::Cylindrical,
            Self::Mercator,
            Self::Perspective,
            Self::Panini,
            Self::Stereographic,
        ];
    }

    fn flat(kind: FlatKind) -> Flat {
        Flat::named(kind, 1.0)
    }

    /// Longitude and latitude (down) in degrees.
    fn toward(longitude: f64, latitude: f64) -> Vector3<f64> {
        let (longitude, latitude) = (longitude.to_radians(), latitude.to_radians());
        Vector3::new(latitude.cos() * longitude.sin(), latitude.sin(), latitude.cos() * longitude.cos())
    }

    /// Longitude 60, latitude 45 degrees: by the formulas of the sources with tan 45 = 1, sin 60 = sqrt(3)/2, and
    /// Snyder's table 9 for Mercator (y at 45 degrees: 0.88137).
    #[test]
    fn places_agree_with_the_sources() {
        let third = PI / 3.0;
        let root = 3_f64.sqrt();
        let expected = [
            (FlatKind::Equirectangular, [third, PI / 4.0]),
            (FlatKind::Cylindrical, [third, 1.0]),
            (FlatKind::Mercator, [third, 0.881_373_587]),
            (FlatKind::Perspective, [root, 2.0]),
            // S = 2 / (1 + 1/2) = 4/3.
            (FlatKind::Panini, [4.0 / 3.0 * root / 2.0, 4.0 / 3.0]),
            // k = 2 / (1 + cos 45 cos 60); x = k cos 45 sin 60, y = k sin 45.
            (FlatKind::Stereographic, [0.904_836_765, 1.044_815_5]),
        ];
        for (kind, [x, y]) in expected {
            let place = flat(kind).place(toward(60.0, 45.0)).expect("shown");
            assert!((place - Vector2::new(x, y)).norm() < 1e-7, "{kind:?}: {place}");
        }
    }

    /// Panini's family: d = 0 is perspective, and d without end the orthographic cylinder, x = sin longitude.
    #[test]
    fn paninis_distance_leads_from_the_plane_to_the_cylinder() {
        let direction = toward(50.0, -20.0);
        let at = |panini_distance: f64| Flat::named(FlatKind::Panini, panini_distance).place(direction).expect("shown");
        assert!((at(0.0) - flat(FlatKind::Perspective).place(direction).expect("shown")).norm() < 1e-12);
        assert!((at(1e9).x - 50_f64.to_radians().sin()).abs() < 1e-8);
    }

    /// The ends of the family are the named projections, and its two halves meet.
    #[test]
    fn the_named_projections_are_of_the_family() {
        let named = [
            (0.0, 1.0, FlatKind::Perspective, 0.0),
            (0.4, 1.0, FlatKind::Panini, 0.4),
            (1.0, 1.0, FlatKind::Panini, 1.0),
            (1.0 + 1e-9, 1.0, FlatKind::Panini, 1.0),
            (2.0, 1.0, FlatKind::Cylindrical, 0.0),
            (2.0, 0.0, FlatKind::Equirectangular, 0.0),
        ];
        let direction = toward(50.0, -30.0);
        for (round, upright, kind, distance) in named {
            let place = Fit { round, upright, turned: false }.place(&direction).expect("shown");
            let expected = Flat::named(kind, distance).place(direction).expect("shown");
            assert!((place - expected).norm() < 1e-7, "{kind:?}: {place} instead of {expected}");
        }
    }

    #[test]
    fn what_lies_behind_has_no_place() {
        assert!(flat(FlatKind::Perspective).place(toward(91.0, 0.0)).is_none());
        assert!(flat(FlatKind::Stereographic).place(toward(180.0, 0.0)).is_none());
        assert!(flat(FlatKind::Panini).place(toward(180.0, 0.0)).is_none());
        assert!(flat(FlatKind::Cylindrical).place(toward(0.0, 90.0)).is_none());
        assert!(flat(FlatKind::Equirectangular).direction(Vector2::new(0.0, 1.6)).is_none());
        assert!(FlatKind::ALL.iter().all(|&kind| flat(kind).place(Vector3::zeros()).is_none()));
    }

    #[test]
    fn reach_is_where_the_angle_ends() {
        let angle = [60_f64.to_radians(), 45_f64.to_radians()];
        assert!((flat(FlatKind::Perspective).reach(angle) - Vector2::new(3_f64.sqrt(), 1.0)).norm() < 1e-12);
        assert!((flat(FlatKind::Equirectangular).reach([PI, PI / 2.0]) - Vector2::new(PI, PI / 2.0)).norm() < 1e-12);
        assert!((flat(FlatKind::Stereographic).reach([PI / 2.0; 2]) - Vector2::new(2.0, 2.0)).norm() < 1e-12);
    }

    proptest! {
        /// Forth and back, and near the middle a radian is a unit along both axes.
        #[test]
        fn places_and_directions_are_inverse(longitude in -100.0..100.0_f64, latitude in -75.0..75.0_f64, d in 0.0..3.0_f64) {
            for kind in FlatKind::ALL {
                let flat = Flat::named(kind, d);
                let direction = toward(longitude, latitude);
                if let Some(place) = flat.place(direction) {
                    let back = flat.direction(place).expect("a place has a direction");
                    prop_assert!((back - direction).norm() < 1e-9, "{:?}: {} of {}", kind, back, direction);
                } else {
                    prop_assert!(longitude.abs() >= 89.0, "{:?}", kind);
                }
                let near = flat.place(toward(longitude * 1e-4, latitude * 1e-4)).expect("the middle");
                let angles = Vector2::new(longitude, latitude) * 1e-4_f64.to_radians();
                prop_assert!((near - angles).norm() < 1e-6);
            }
        }
    }
}
