//! The direction that most planes contain.

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::light::tangents;

use super::lines::UprightLine;
use super::options::LevelOptions;

/// Iterations after which the refinement stops in any case.
const MAX_ITERATIONS: usize = 50;
/// Step in radians below which it has converged.
const CONVERGED: f64 = 1e-10;

/// A direction fitted to lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    /// The direction, y above 0.
    pub down: Vector3<f64>,
    /// Root of the summed variances of its two components, radians; infinite where the lines leave one free.
    pub standard_error: f64,
    /// Lines whose planes contain it, within the tolerance.
    pub support: usize,
}

/// The best-supported direction near y: searched on a grid, then refined by iteratively reweighted least squares with
/// Geman-McClure weights. `None` where nothing supports any direction.
pub(super) fn fit(lines: &[UprightLine], options: &LevelOptions) -> Option<Fit> {
    let (tolerance, scale) = (options.tolerance_deg.to_radians().sin(), options.refine_scale_deg.to_radians().sin());
    let mut down = search(lines, options)?;
    for _ in 0..MAX_ITERATIONS {
        let system = System::at(&down, lines, tolerance, scale);
        let step = -(system.weighted.try_inverse()? * system.gradient);
        let (first, second) = tangents(down);
        down = (down + first * step.x + second * step.y).normalize();
        if step.norm() < CONVERGED {
            break;
        }
    }
    let system = System::at(&down, lines, tolerance, scale);
    Some(Fit { down, standard_error: system.standard_error(), support: system.support })
}

/// The grid direction with the largest sum of w max(0, 1 - (n . d / tolerance)^2).
fn search(lines: &[UprightLine], options: &LevelOptions) -> Option<Vector3<f64>> {
    let tolerance = options.tolerance_deg.to_radians().sin();
    let steps = (options.search_deg / options.search_step_deg).floor() as i32;
    let reach = options.search_deg.to_radians().tan();
    let step = options.search_step_deg.to_radians().tan();
    let mut best = (0.0, None);
    for across in -steps..=steps {
        for along in -steps..=steps {
            let (x, z) = (step * f64::from(across), step * f64::from(along));
            if x.hypot(z) > reach {
                continue;
            }
            let direction = Vector3::new(x, 1.0, z).normalize();
            let support =
                |line: &UprightLine| line.weight * (1.0 - (line.normal.dot(&direction) / tolerance).powi(2)).max(0.0);
            let score: f64 = lines.iter().map(support).sum();
            if score > best.0 {
                best = (score, Some(direction));
            }
        }
    }
    best.1
}

/// The least-squares system in the plane that touches the sphere at a direction.
struct System {
    /// Sum of weights times J J^T.
    weighted: Matrix2<f64>,
    /// Sum of weights times r J.
    gradient: Vector2<f64>,
    /// Second derivative of the robust loss.
    curvature: Matrix2<f64>,
    /// The gradient's part of each column of views, and whether the column has lines here.
    by_column: Vec<(Vector2<f64>, bool)>,
    /// Lines within the tolerance.
    support: usize,
}

impl System {
    fn at(down: &Vector3<f64>, lines: &[UprightLine], tolerance: f64, scale: f64) -> Self {
        let (first, second) = tangents(*down);
        let columns = lines.iter().map(|line| line.column + 1).max().unwrap_or(0);
        let mut system = Self {
            weighted: Matrix2::zeros(),
            gradient: Vector2::zeros(),
            curvature: Matrix2::zeros(),
            by_column: vec![(Vector2::zeros(), false); columns],
            support: 0,
        };
        for line in lines {
            let residual = line.normal.dot(down);
            if residual.abs() >= tolerance {
                continue;
            }
            let jacobian = Vector2::new(line.normal.dot(&first), line.normal.dot(&second));
            let ratio = (residual / scale).powi(2);
            let weight = line.weight / (1.0 + ratio).powi(2);
            let pull = jacobian * (weight * residual);
            system.weighted += jacobian * jacobian.transpose() * weight;
            system.curvature += jacobian * jacobian.transpose() * (weight * (1.0 - 3.0 * ratio) / (1.0 + ratio));
            system.gradient += pull;
            let (part, populated) = &mut system.by_column[line.column];
            *part += pull;
            *populated = true;
            system.support += 1;
        }
        system
    }

    /// The sandwich estimator with one cluster a column of views: its lines share the errors of the panorama's
    /// stitching.
    ///
    /// # Source
    /// Liang and Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73, 1986; small-sample
    /// factor c / (c - 1).
    fn standard_error(&self) -> f64 {
        let clusters = self.by_column.iter().filter(|(_, populated)| *populated).count() as f64;
        let Some(inverse) = self.curvature.try_inverse() else { return f64::INFINITY };
        // A saddle is no minimum: the loss does not hold the direction.
        if clusters < 2.0 || self.curvature.determinant() <= 0.0 || self.curvature.trace() <= 0.0 {
            return f64::INFINITY;
        }
        let spread: Matrix2<f64> = self.by_column.iter().map(|(part, _)| part * part.transpose()).sum();
        ((inverse * spread * inverse).trace() * clusters / (clusters - 1.0)).sqrt()
    }
}
