//! Grids on a projection's plane.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use trueup_core::geometry::wrap_angle;
use trueup_core::mesh::{GridLines, GridMesh};

use super::coverage::shows;
use super::parallax_shift::ParallaxShift;
use super::photograph::PosedPhotograph;
use super::view::ProjectionView;

/// What the grids are made for.
#[derive(Debug, Clone, Copy)]
pub struct Placement<'a> {
    /// Where the viewer looks.
    pub view: &'a ProjectionView,
    /// Canvas pixels per unit of the plane; grids are as fine as these pixels want.
    pub canvas_from_plane: f64,
    /// Whether the canvas closes on itself, so that what leaves it on the right enters it on the left.
    pub closed: bool,
}

/// A grid of one photograph on the plane. A photograph may have several: on both sides of a turn's cut, or in sectors
/// around a pole; none where it shows nothing in the view.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedGrid {
    /// Index of the photograph.
    pub photograph: usize,
    /// Targets on the plane; NaN where the photograph looks out of the view.
    pub mesh: GridMesh,
}

/// Largest distance of a bilinear cell from the true map, in canvas pixels or photograph pixels, whichever is kinder:
/// where the canvas is stretched, detail is the photograph's. Half of it for each axis.
const LARGEST_SAG_PX: f64 = 0.3;
/// Radians beyond the view's end that are drawn: whole cells lie across its border then.
const MARGIN: f64 = 0.09;
/// Photograph pixels that a cell across the cut of a view may be long: it is not drawn, so much of the view's end is
/// missing.
const ACROSS_CUT_PX: f64 = 4.0;
/// Radians of longitude. A cell with a wider side may go round a pole: of the four sides of one that does, the widest
/// is a quarter of the turn or more. Such a cell lies in no sector and leaves a hole of its size.
const WIDEST: f64 = 0.45 * PI;

/// Places every photograph's grid.
///
/// `shifts` holds for every photograph what [`crate::parallax::shifts`] found.
pub fn place(photographs: &[PosedPhotograph], shifts: &[ParallaxShift], placement: &Placement<'_>) -> Vec<PlacedGrid> {
    let drawings: Vec<Vec<GridMesh>> = photographs
        .par_iter()
        .zip(shifts)
        .map(|(photograph, shift)| Drawing::new(photograph, shift, placement).grids())
        .collect();
    drawings
        .into_iter()
        .enumerate()
        .flat_map(|(photograph, grids)| grids.into_iter().map(move |mesh| PlacedGrid { photograph, mesh }))
        .collect()
}

/// One photograph on the plane.
struct Drawing<'a> {
    photograph: &'a PosedPhotograph,
    shift: &'a ParallaxShift,
    placement: &'a Placement<'a>,
    view_from_camera: Matrix3<f64>,
    /// The smallest and largest coordinates of the plane that are drawn.
    window: [Vector2<f64>; 2],
}

/// A pixel of the photograph and its place on the plane, if the view comes near it.
#[derive(Clone, Copy)]
struct DrawnVertex {
    pixel: Vector2<f64>,
    place: Option<Vector2<f64>>,
}

impl<'a> Drawing<'a> {
    fn new(photograph: &'a PosedPhotograph, shift: &'a ParallaxShift, placement: &'a Placement<'a>) -> Self {
        let view = placement.view;
        let cell = photograph.mesh.cell_width().max(photograph.mesh.cell_height()) / photograph.camera.focal_px;
        let margin = MARGIN.max(3.0 * cell);
        let window = view.window(margin);
        Self {
            photograph,
            shift,
            placement,
            view_from_camera: view.view_from_level() * photograph.camera.rotation().transpose(),
            window,
        }
    }

    /// The viewer's direction of a pixel.
    fn direction(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        let looked_through = self.shift.looked_through(&self.photograph.mesh, pixel);
        self.view_from_camera * self.photograph.camera.bearing(looked_through)
    }

    /// The place of a pixel, if the view comes near it.
    fn place(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        let place = self.placement.view.flat.place(self.direction(pixel))?;
        let [low, high] = self.window;
        let is_within = |axis: usize| (low[axis]..=high[axis]).contains(&place[axis]);
        ((self.placement.view.flat.kind.turns() || is_within(0)) && is_within(1)).then_some(place)
    }

    fn pixel(&self, lines: &GridLines, row: usize, column: usize) -> Vector2<f64> {
        Vector2::new(lines.columns[column] * self.photograph.mesh.width, lines.rows[row] * self.photograph.mesh.height)
    }

    fn places(&self, lines: &GridLines) -> Vec<Option<Vector2<f64>>> {
        let columns = lines.columns.len();
        (0..columns * lines.rows.len())
            .map(|vertex| self.place(self.pixel(lines, vertex / columns, vertex % columns)))
            .collect()
    }

    /// How far the middle of two vertices' places is from the place of the pixel between, in pixels; `None` where there
    /// is nothing to see. Across the cut of a view that does not close, as far as the cell is to be divided.
    fn sag(&self, from: DrawnVertex, to: DrawnVertex) -> Option<f64> {
        let flat = &self.placement.view.flat;
        let pixel = (from.pixel + to.pixel) / 2.0;
        let (start, mut end, mut true_place) = (from.place?, to.place?, self.place(pixel)?);
        if flat.kind.turns() {
            end.x = start.x + wrap_angle(end.x - start.x);
            true_place.x = start.x + wrap_angle(true_place.x - start.x);
            if (end.x - start.x).abs() > WIDEST {
                return Some(f64::INFINITY);
            }
        } else if let [Some(start), Some(end)] = [from, to].map(|vertex| self.longitude_from_cut(vertex.pixel)) {
            let turn = wrap_angle(end - start);
            if turn.abs() > WIDEST {
                return Some(f64::INFINITY);
            }
            if (start + turn).abs() > PI {
                let length = (to.pixel - from.pixel).norm() / ACROSS_CUT_PX;
                return (length > 1.0).then(|| sag_of_pieces(length));
            }
        }
        let middle = (start + end) / 2.0;
        let on_canvas = (middle - true_place).norm() * self.placement.canvas_from_plane;
        let in_photograph = flat.direction(middle).map_or(f64::INFINITY, |direction| {
            direction.angle(&self.direction(pixel)) * self.photograph.camera.focal_px
        });
        Some(on_canvas.min(in_photograph))
    }

    /// The longitude of a pixel in a view that is cut behind the viewer; `None` in all others.
    fn longitude_from_cut(&self, pixel: Vector2<f64>) -> Option<f64> {
        let flat = &self.placement.view.flat;
        flat.is_cut_behind().then(|| flat.fit.longitude(&self.direction(pixel)))
    }

    /// Lines close enough that cells follow the projection's curves.
    fn lines(&self) -> GridLines {
        /// Rounds of division, each by up to [`PIECES`]: four of them take a cell of 100 pixels below one.
        const ROUNDS: usize = 10;
        let mut lines = self
            .photograph
            .mesh
            .lines
            .clone()
            .unwrap_or_else(|| GridLines::even(self.photograph.mesh.columns, self.photograph.mesh.rows));
        // What is smaller than this share of a pixel is not seen, not even at a pole, half a pixel from the first row's
        // centers.
        let smallest = 0.0625 * (self.photograph.camera.focal_px / self.placement.canvas_from_plane).max(1.0);
        for _ in 0..ROUNDS {
            let places = self.places(&lines);
            let (rows, columns) = (lines.rows.len(), lines.columns.len());
            let vertex = |row: usize, column: usize| DrawnVertex {
                pixel: self.pixel(&lines, row, column),
                place: places[row * columns + column],
            };
            let (mut across, mut down) = (vec![0.0_f64; columns - 1], vec![0.0_f64; rows - 1]);
            // The intervals on both sides of a line.
            let beside = |line: usize, lines: usize| line.saturating_sub(1)..(line + 1).min(lines - 1);
            for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
                // A cell that goes round a pole is to be small both ways.
                if column + 1 < columns
                    && let Some(sag) = self.sag(vertex(row, column), vertex(row, column + 1))
                {
                    across[column] = across[column].max(sag);
                    if sag.is_infinite() {
                        down[beside(row, rows)].fill(sag);
                    }
                }
                if row + 1 < rows
                    && let Some(sag) = self.sag(vertex(row, column), vertex(row + 1, column))
                {
                    down[row] = down[row].max(sag);
                    if sag.is_infinite() {
                        across[beside(column, columns)].fill(sag);
                    }
                }
            }
            let finer = GridLines {
                columns: divided(&lines.columns, &across, smallest / self.photograph.mesh.width),
                rows: divided(&lines.rows, &down, smallest / self.photograph.mesh.height),
            };
            if finer == lines {
                break;
            }
            lines = finer;
        }
        lines
    }

    fn grids(&self) -> Vec<GridMesh> {
        let lines = self.lines();
        let places = self.places(&lines);
        let grid = |target: Vec<[f64; 2]>| GridMesh {
            rows: lines.rows.len(),
            columns: lines.columns.len(),
            width: self.photograph.mesh.width,
            height: self.photograph.mesh.height,
            target,
            lines: Some(lines.clone()),
        };
        const NOWHERE: [f64; 2] = [f64::NAN; 2];
        let view = self.placement.view;
        if !view.flat.kind.turns() {
            let target: Vec<[f64; 2]> = places.iter().map(|place| place.map_or(NOWHERE, Into::into)).collect();
            let parts = match self.sides_of_cut(&lines) {
                None => vec![target],
                Some(sides) => {
                    let on_side = |is_on: Vec<bool>| {
                        target.iter().zip(is_on).map(|(&place, is_on)| if is_on { place } else { NOWHERE }).collect()
                    };
                    sides.map(on_side).into()
                }
            };
            return parts.into_iter().map(grid).filter(|mesh| mesh.whole_cells().next().is_some()).collect();
        }
        let mut grids = Vec::new();
        for (center, half) in self.sectors(&places) {
            let unrolled = |place: &Option<Vector2<f64>>| {
                let Some(place) = place else { return NOWHERE };
                let aside = wrap_angle(place.x - center);
                if aside.abs() <= half { [center + aside, place.y] } else { NOWHERE }
            };
            let mesh = grid(places.iter().map(unrolled).collect());
            if mesh.whole_cells().next().is_none() {
                continue;
            }
            let (low, high) = mesh.bounds();
            for turns in [0.0, -1.0, 1.0] {
                let shift = turns * TAU;
                let in_view = low.x + shift < view.half[0] && high.x + shift > -view.half[0];
                let wanted = if self.placement.closed { turns == 0.0 } else { in_view };
                if wanted {
                    let mut mesh = mesh.clone();
                    mesh.target.iter_mut().for_each(|vertex| vertex[0] += shift);
                    grids.push(mesh);
                }
            }
        }
        grids
    }

    /// Which vertices are drawn to the right, and which to the left of the middle, where a view does not close and the
    /// photograph reaches beyond both of its ends; `None` where it does not. Cells narrower than [`WIDEST`] are whole
    /// on a side, those across the cut on none.
    fn sides_of_cut(&self, lines: &GridLines) -> Option<[Vec<bool>; 2]> {
        let columns = lines.columns.len();
        let longitude = |vertex: usize| self.longitude_from_cut(self.pixel(lines, vertex / columns, vertex % columns));
        let longitudes: Vec<f64> = (0..columns * lines.rows.len()).map(longitude).collect::<Option<_>>()?;
        let is_behind = |side: f64| longitudes.iter().any(|longitude| longitude * side > FRAC_PI_2);
        let reach = WIDEST / 2.0;
        let on_side = |side: f64| longitudes.iter().map(|longitude| longitude * side >= -reach).collect();
        (is_behind(1.0) && is_behind(-1.0)).then(|| [1.0, -1.0].map(on_side))
    }

    /// The longitudes around which the photograph is unrolled, and how far to both sides: its own middle, or four
    /// directions around a pole that it shows or all but shows. Sectors overlap by a quarter turn, so that each cell
    /// narrower than that is whole in one of them.
    fn sectors(&self, places: &[Option<Vector2<f64>>]) -> Vec<(f64, f64)> {
        /// Radians to one side of its middle above which a photograph may as well go round.
        const HALF_ROUND: f64 = 0.8 * PI;
        let level_pole = |down: f64| {
            let pole = self.placement.view.view_from_level().transpose() * Vector3::new(0.0, down, 0.0);
            shows(self.photograph, pole)
        };
        let ahead = self.view_from_camera.column(2);
        let center = ahead.x.atan2(ahead.z);
        let farthest = places.iter().flatten().map(|place| wrap_angle(place.x - center).abs()).fold(0.0, f64::max);
        if farthest > HALF_ROUND || level_pole(-1.0) || level_pole(1.0) {
            return (0..4).map(|k| (wrap_angle((f64::from(k) + 0.5) * PI / 2.0), PI / 2.0)).collect();
        }
        vec![(center, PI)]
    }
}

/// The sag of an interval that is to be divided into so many pieces.
fn sag_of_pieces(pieces: f64) -> f64 {
    // The sag falls with the square of the length.
    0.5 * LARGEST_SAG_PX * pieces.powi(2)
}

/// Lines with every interval divided that sags too much and is longer than `shortest`.
fn divided(lines: &[f64], sags: &[f64], shortest: f64) -> Vec<f64> {
    /// Largest number of pieces in one round.
    const PIECES: f64 = 4.0;
    let mut finer = vec![lines[0]];
    for (pair, &sag) in lines.windows(2).zip(sags) {
        let length = pair[1] - pair[0];
        let pieces = (sag / sag_of_pieces(1.0)).sqrt().ceil().min(PIECES).min((length / shortest).floor()).max(1.0);
        for piece in 1..pieces as usize {
            finer.push(pair[0] + length * piece as f64 / pieces);
        }
        finer.push(pair[1]);
    }
    finer
}

#[cfg(test)]
mod tests {
    use trueup_core::camera::Camera;
    use trueup_core::geometry::{rotation_about_x, rotation_about_y};

    use super::super::coverage::tests::photograph;
    use super::super::fitted::Fit;
    use super::super::flat::{Flat, FlatKind};
    use super::*;

    fn view(kind: FlatKind) -> ProjectionView {
        let half = kind.comfortable();
        ProjectionView {
            flat: Flat::named(kind, 1.0),
            yaw: 0.0,
            pitch: 0.0,
            roll: 0.0,
            half,
            shown: None,
            closed: false,
        }
    }

    fn placed(photographs: &[PosedPhotograph], view: &ProjectionView, closed: bool) -> Vec<PlacedGrid> {
        let shifts: Vec<ParallaxShift> = photographs
            .iter()
            .map(|photograph| ParallaxShift { aside: vec![Vector2::zeros(); photograph.mesh.len()] })
            .collect();
        place(photographs, &shifts, &Placement { view, canvas_from_plane: 700.0, closed })
    }

    /// Anywhere in a cell, the bilinear place is within the limit of the true one; the error counts on the sphere where
    /// the plane is stretched.
    #[test]
    fn cells_follow_the_projection() {
        for kind in FlatKind::ALL {
            let (view, photograph) = (view(kind), photograph(35.0, 20.0));
            let mesh = placed(std::slice::from_ref(&photograph), &view, false).remove(0).mesh;
            let mut checked = 0;
            for k in 0..4000 {
                let share = [0.618_033_99, 0.754_877_67].map(|step| (step * f64::from(k)).fract());
                let pixel = Vector2::new(share[0] * 800.0, share[1] * 600.0);
                let place = mesh.warp(pixel);
                let true_direction = view.view_from_level() * photograph.camera.world_direction(pixel);
                let Some(true_place) = view.flat.place(true_direction).filter(|_| !place.x.is_nan()) else { continue };
                let direction = view.flat.direction(place).expect("on the plane");
                let error = ((place - true_place).norm() * 700.0).min(direction.angle(&true_direction) * 700.0);
                assert!(error < LARGEST_SAG_PX, "{kind:?}: {error} px at {pixel}");
                checked += 1;
            }
            assert!(checked > 2000, "{kind:?}: {checked}");
        }
    }

    /// A photograph of the zenith covers every direction above 50 degrees, up to the pole but for half a pixel.
    #[test]
    fn a_photograph_of_a_pole_leaves_no_hole() {
        let (view, sky) = (view(FlatKind::Equirectangular), photograph(10.0, 87.0));
        let grids = placed(&[sky], &view, false);
        assert!(grids.len() >= 4);
        assert_whole(&grids, 700.0, &[0.5, 1.5, 5.0, 30.0, 150.0]);
        assert!(grids.iter().all(|grid| grid.mesh.len() < 60_000), "{}", grids[0].mesh.len());
    }

    /// Wherever the pole lies in its cell, and in the photograph: toward a corner, cells are no squares on the sphere,
    /// and those beside the pole may take more than a quarter of the turn.
    #[test]
    fn cells_beside_a_pole_lie_in_one_sector() {
        let view = view(FlatKind::Equirectangular);
        for k in (0..12).map(f64::from) {
            let level_from_camera =
                rotation_about_x((90.0 - 1.57 * k).to_radians()) * rotation_about_y((2.3 * k).to_radians());
            let sky = PosedPhotograph {
                camera: Camera::new(700.0, 800.0, 600.0, &level_from_camera.transpose()),
                mesh: GridMesh::regular(800.0, 600.0, 20.0),
            };
            let shift = ParallaxShift { aside: vec![Vector2::zeros(); sky.mesh.len()] };
            for canvas_from_plane in [700.0, 2500.0] {
                let placement = Placement { view: &view, canvas_from_plane, closed: false };
                let grids = place(std::slice::from_ref(&sky), std::slice::from_ref(&shift), &placement);
                assert_whole(&grids, canvas_from_plane, &[0.5, 1.5, 2.5, 3.5, 8.5]);
            }
        }
    }

    /// A square of 0.6 px with the zenith in its middle, whose sides are a quarter of the turn each: smaller than what
    /// sags, but a hole as long as it is one cell.
    #[test]
    fn a_cell_around_a_pole_is_divided() {
        let (view, sky) = (view(FlatKind::Equirectangular), photograph(0.0, 90.0));
        let shift = ParallaxShift { aside: vec![Vector2::zeros(); sky.mesh.len()] };
        let placement = Placement { view: &view, canvas_from_plane: 700.0, closed: false };
        let drawing = Drawing::new(&sky, &shift, &placement);
        let corners = [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]].map(|[x, y]| {
            let pixel = Vector2::new(400.0 + x, 300.0 + y);
            DrawnVertex { pixel, place: drawing.place(pixel) }
        });
        for side in 0..4 {
            assert_eq!(drawing.sag(corners[side], corners[(side + 1) % 4]), Some(f64::INFINITY));
        }
    }

    /// Asserts that every place that far from the zenith, in canvas pixels, lies in a whole cell.
    fn assert_whole(grids: &[PlacedGrid], canvas_from_plane: f64, from_pole: &[f64]) {
        let latitude = |rows: f64| rows / canvas_from_plane - PI / 2.0;
        let lowest = from_pole.iter().copied().map(latitude).fold(f64::MIN, f64::max);
        let cells: Vec<[Vector2<f64>; 4]> = grids
            .iter()
            .flat_map(|grid| {
                grid.mesh.whole_cells().map(|corners| corners.map(|vertex| grid.mesh.target[vertex].into()))
            })
            .filter(|corners: &[Vector2<f64>; 4]| corners.iter().any(|corner| corner.y < lowest))
            .collect();
        for &rows in from_pole {
            for degrees in (0..360).map(|k| f64::from(k) - 179.5) {
                let place = Vector2::new(degrees.to_radians(), latitude(rows));
                let is_covered = cells
                    .iter()
                    .any(|cell| (0..4).all(|k| (cell[(k + 1) % 4] - cell[k]).perp(&(place - cell[k])) >= 0.0));
                assert!(is_covered, "{degrees} degrees, {rows} px from the pole: no cell");
            }
        }
    }

    /// Photographs of what is behind and of the zenith, on a view that ends at half a turn: cells across its end were
    /// divided to the sixteenth of a pixel, millions of them, and drawn all over the view. What lies near the end, up
    /// to four pixels of the photograph, is there, on both sides.
    #[test]
    fn a_view_that_does_not_close_is_cut_behind() {
        for (turned, yaw_deg, pitch_deg) in [(false, 180.0, 70.0), (false, 10.0, 87.0), (true, 180.0, 3.0)] {
            let flat = Flat::fitted(Fit { round: 1.6, upright: 0.2, turned });
            let view = ProjectionView { flat, shown: Some([[-20.0; 2], [20.0; 2]]), ..view(FlatKind::Fitted) };
            let grids = placed(&[photograph(yaw_deg, pitch_deg)], &view, false);
            assert_eq!(grids.len(), 2);
            assert!(grids.iter().all(|grid| grid.mesh.len() < 60_000), "{}", grids[0].mesh.len());
            let cells: Vec<[Vector2<f64>; 4]> = grids
                .iter()
                .flat_map(|PlacedGrid { mesh, .. }| {
                    mesh.whole_cells().map(|corners| corners.map(|vertex| mesh.target[vertex].into()))
                })
                .collect();
            let along = if turned { Vector2::y() } else { Vector2::x() };
            let end = Flat::fitted(Fit { turned: false, ..flat.fit }).reach([PI, 0.0]).x;
            for cell in &cells {
                let [low, high] = [f64::min, f64::max]
                    .map(|most| cell.iter().map(|corner| corner.dot(&along)).reduce(most).expect("four corners"));
                assert!(high - low < end, "{low} to {high} of {end}");
            }
            for from_middle in [-178.0, -170.0, 170.0, 178.0_f64] {
                let (sine, cosine) = from_middle.to_radians().sin_cos();
                // The zenith's photograph reaches down to 70 degrees behind.
                let up = if turned { 0.0 } else { -75_f64.to_radians().tan() };
                let direction = if turned { Vector3::new(up, sine, cosine) } else { Vector3::new(sine, up, cosine) };
                let place = flat.place(direction).expect("within the view");
                let is_in = |cell: &[Vector2<f64>; 4]| {
                    let turns = [0, 1, 2, 3].map(|k| (cell[(k + 1) % 4] - cell[k]).perp(&(place - cell[k])));
                    turns.iter().all(|turn| *turn >= 0.0) || turns.iter().all(|turn| *turn <= 0.0)
                };
                assert!(cells.iter().any(is_in), "{from_middle} degrees, {turned}");
            }
        }
    }

    #[test]
    fn a_photograph_across_the_cut_lies_on_both_sides() {
        let view = view(FlatKind::Cylindrical);
        let grids = placed(&[photograph(175.0, 0.0), photograph(0.0, 0.0)], &view, false);
        assert_eq!(grids.iter().map(|grid| grid.photograph).collect::<Vec<_>>(), [0, 0, 1]);
        let left = |k: usize| grids[k].mesh.bounds().0.x;
        assert!((left(0) - left(1) - TAU).abs() < 1e-9);
        assert_eq!(placed(&[photograph(175.0, 0.0)], &view, true).len(), 1);
    }

    #[test]
    fn what_lies_behind_a_plane_is_not_there() {
        let view = view(FlatKind::Perspective);
        assert!(placed(&[photograph(150.0, 0.0)], &view, false).is_empty());
        let half = placed(&[photograph(60.0, 0.0)], &view, false).remove(0).mesh;
        let whole = half.whole_cells().count();
        assert!(whole > 100 && whole < (half.rows - 1) * (half.columns - 1), "{whole}");
    }
}
