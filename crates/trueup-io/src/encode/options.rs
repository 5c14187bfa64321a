//! The options of written panoramas.

use super::background::Background;

trueup_core::choice! {
    /// How finely JPEG stores color, relative to brightness.
    pub enum ChromaSubsampling {
        /// As finely as brightness.
        Full = "4:4:4",
        /// Half as finely across.
        HalfWidth = "4:2:2",
        /// Half as finely across and down, as cameras do.
        Quarter = "4:2:0",
    }
}

trueup_core::choice! {
    /// How hard PNG compression tries. The pixels are the same.
    pub enum PngCompression {
        /// In a fraction of the time, for a file about a fifth larger.
        Fast = "fast",
        /// The usual balance.
        Balanced = "balanced",
        /// Much slower for a slightly smaller file.
        High = "high",
    }
}

trueup_core::choice! {
    /// Bits of a sample.
    pub enum Depth {
        /// 16 where a photograph has more than 8 and the format can hold them, else 8; float where the format has
        /// nothing else.
        Auto = "auto",
        /// 8 bits.
        Eight = "8",
        /// 16 bits: PNG and TIFF.
        Sixteen = "16",
        /// Linear light as 32-bit floating point numbers, 1 for white: TIFF, OpenEXR; rounded, Radiance.
        Float = "float",
    }
}

trueup_core::choice! {
    /// Whether pictures are written with transparency.
    pub enum Alpha {
        /// Where it is not certain that every pixel is opaque, and no color is chosen for the background.
        Auto = "auto",
        /// Always, where the format can.
        Keep = "keep",
        /// Never: what is transparent shows the background.
        Drop = "drop",
    }
}

trueup_core::choice! {
    /// How the pixels of a TIFF are cut up.
    pub enum TiffLayout {
        /// Strips, and tiles of 256 pixels from 67 megapixels on.
        Auto = "auto",
        /// Strips of rows, which every program reads.
        Strips = "strips",
        /// Tiles of 256 pixels.
        Tiles256 = "256",
        /// Tiles of 512 pixels.
        Tiles512 = "512",
    }
}

trueup_core::choice! {
    /// Whether a TIFF has 64-bit offsets, which files beyond 4 GiB need and some programs do not read.
    pub enum BigTiff {
        /// Where its pixels could take more than 4 GB.
        Auto = "auto",
        /// Always.
        Always = "always",
    }
}

trueup_core::choice! {
    /// Format of the tiles of Deep Zoom pictures.
    pub enum DeepZoomFormat {
        /// Small; no transparency.
        Jpeg = "jpg",
        /// Lossless.
        Png = "png",
    }
}

trueup_core::choice! {
    /// How large the pages of a file of layers are.
    pub enum LayerExtent {
        /// As large as the panorama: they lie on each other in every program that opens pages.
        Canvas = "canvas",
        /// Only the photograph's bounding box, with its place: for programs that heed it (GIMP, Hugin, enblend).
        Cropped = "cropped",
    }
}

trueup_core::choice! {
    /// How TIFF strips and tiles are compressed. The pixels are the same.
    pub enum TiffCompression {
        /// Not at all: largest and fastest.
        None = "none",
        /// Deflate, after differencing.
        Deflate = "deflate",
    }
}

trueup_core::choice! {
    /// Which color space panoramas are written in.
    pub enum OutputProfile {
        /// That of the photographs, whose profile is embedded.
        Keep = "keep",
        /// sRGB, for places that ignore profiles; colors it does not have are clipped.
        Srgb = "srgb",
    }
}

trueup_core::choice! {
    /// What panoramas tell of the photographs they are made of.
    pub enum MetadataKept {
        /// Camera, lens, exposure, time and place.
        Keep = "keep",
        /// All but the place.
        NoLocation = "no-location",
        /// Nothing. The color profile and the crop of a spherical panorama, which viewers need, are written all the
        /// same.
        None = "none",
    }
}

trueup_core::options! {
    /// How panoramas are written. The format follows from the file's extension; WebP is always lossless.
    pub struct OutputOptions("output") {
        /// Bits of a sample; JPEG, WebP and Deep Zoom have 8, OpenEXR and Radiance are float. Choose 16 or float when
        /// the panorama is to be edited further, 8 when 16-bit photographs are to make a small file.
        depth: Depth = Depth::Auto, Allowed::Any, "", basic;
        /// Whether PNG, TIFF, WebP, OpenEXR and Deep Zoom in PNG have transparency. Drop it for programs that show it
        /// wrongly, keep it when what a chosen background covers must still be told apart.
        alpha: Alpha = Alpha::Auto, Allowed::Any, "", basic;
        /// JPEG quality on the usual scale of the Independent JPEG Group. Raise it for prints, lower it where the file
        /// is too large to send.
        jpeg_quality: u8 = 92, between(1.0, 100.0), "", basic;
        /// How finely JPEG stores color. Choose 4:4:4 when red or blue lettering and edges look frayed.
        jpeg_subsampling: ChromaSubsampling = ChromaSubsampling::Quarter, Allowed::Any, "";
        /// How hard PNG compression tries. Raise it for files that are kept or sent often; writing takes longer.
        png_compression: PngCompression = PngCompression::Fast, Allowed::Any, "";
        /// How TIFF strips and tiles are compressed. Choose none for programs that do not read deflate, or for speed.
        tiff_compression: TiffCompression = TiffCompression::Deflate, Allowed::Any, "", basic;
        /// How the pixels of a TIFF are cut up. Choose strips for programs that read no tiles, tiles for viewers of
        /// smaller panoramas that read only what they show.
        tiff_layout: TiffLayout = TiffLayout::Auto, Allowed::Any, "";
        /// Whether tiled TIFFs have smaller copies (overviews, pyramid) for viewers, as pages of their own. Switch it
        /// off for programs that take every page for a picture.
        tiff_overviews: bool = true, Allowed::Any, "";
        /// Whether a TIFF is a BigTIFF. Choose always for programs that expect it of every file.
        tiff_big: BigTiff = BigTiff::Auto, Allowed::Any, "";
        /// Side of Deep Zoom tiles, without what overlaps. Raise it for fewer files, where a server is slow to answer.
        dzi_tile_px: usize = 254, between(16.0, 8192.0), "px";
        /// By how much Deep Zoom tiles reach into their neighbors. Set it to what the viewer expects; 0 if it shows
        /// tiles side by side, more if seams show between tiles.
        dzi_overlap_px: usize = 1, between(0.0, 8.0), "px";
        /// Format of Deep Zoom tiles. Choose png where they must be lossless or transparent.
        dzi_format: DeepZoomFormat = DeepZoomFormat::Jpeg, Allowed::Any, "";
        /// How large the pages of a file of layers are. Choose cropped for programs that heed the place of a page
        /// (GIMP, Hugin, enblend): they then need less memory.
        layer_extent: LayerExtent = LayerExtent::Canvas, Allowed::Any, "";
        /// What shows where no photograph is. A color is laid under the panorama in every format, unless alpha is kept:
        /// choose one to match the page or print that the panorama is put on.
        background: Background = Background::Auto, Allowed::Any, "", basic;
        /// Which color space panoramas are written in; Deep Zoom tiles and floating point samples are in sRGB's. Choose
        /// srgb for places that ignore profiles.
        profile: OutputProfile = OutputProfile::Keep, Allowed::Any, "";
        /// What panoramas tell of their photographs, in EXIF and XMP. Choose no-location or none before publishing what
        /// should not tell where or with what it was taken.
        metadata: MetadataKept = MetadataKept::Keep, Allowed::Any, "", basic;
    }
}

impl Alpha {
    /// Whether a picture that may be transparent is written with transparency, in a format that can.
    pub(super) fn keeps(self, background: Background) -> bool {
        match self {
            Self::Keep => true,
            Self::Drop => false,
            Self::Auto => !matches!(background, Background::Color(_)),
        }
    }
}

impl Depth {
    /// Bytes of a sample; [`Depth::Auto`] is taken for 8 bits.
    pub(crate) fn sample_bytes(self) -> u8 {
        match self {
            Self::Auto | Self::Eight => 1,
            Self::Sixteen => 2,
            Self::Float => 4,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_color_leaves_nothing_transparent_unless_alpha_is_wanted() {
        assert!(Alpha::Auto.keeps(Background::Auto) && Alpha::Auto.keeps(Background::Transparent));
        assert!(!Alpha::Auto.keeps(Background::WHITE) && Alpha::Keep.keeps(Background::WHITE));
        assert!(!Alpha::Drop.keeps(Background::Auto));
    }
}
