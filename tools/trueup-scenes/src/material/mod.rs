//! What surfaces look like: procedural patterns with detail from metres to millimetres, filtered to the pixel.

mod exterior;
mod interior;
mod ornament;
mod print;
mod surface;

use crate::color::Rgb;
pub(crate) use surface::{MaterialId, Pattern, Spot, SurfaceMaterial};

impl SurfaceMaterial {
    /// The share of light returned at a spot, per channel.
    pub(crate) fn albedo(&self, spot: &Spot) -> Rgb {
        let color = match self.pattern {
            Pattern::Plaster => interior::plaster(self, spot),
            Pattern::Wallpaper => ornament::wallpaper(self, spot),
            Pattern::Wood => interior::wood(self.colors[0], spot.point, spot.grain, spot),
            Pattern::Planks => interior::planks(self, spot),
            Pattern::Tiles => interior::tiles(self, spot),
            Pattern::Carpet => interior::carpet(self, spot),
            Pattern::CeilingPanels => interior::ceiling_panels(self, spot),
            Pattern::Writing => print::writing(self, spot),
            Pattern::Rug => ornament::rug(self, spot),
            Pattern::Fabric => interior::fabric(self, spot),
            Pattern::Curtain => ornament::curtain(self, spot),
            Pattern::Paint => interior::paint(self, spot),
            Pattern::Foliage => exterior::foliage(self, spot),
            Pattern::Picture => print::picture(spot),
            Pattern::Spine => print::spine(self, spot),
            Pattern::Sign => print::sign(self, spot),
            Pattern::Page => print::page(self, spot),
            Pattern::Brick => exterior::brick(self, spot),
            Pattern::Stucco => exterior::stucco(self, spot),
            Pattern::Ashlar => exterior::ashlar(self, spot),
            Pattern::Asphalt => exterior::asphalt(self, spot),
            Pattern::Paving => exterior::paving(self, spot),
            Pattern::Pane => exterior::pane(self, spot),
            Pattern::Louvres => exterior::louvres(self, spot),
            Pattern::Grass => exterior::grass(self, spot),
            Pattern::Rock => exterior::rock(self, spot),
        };
        // No real surface returns everything or nothing.
        color.map(|channel| channel.clamp(0.01, 0.92))
    }
}
