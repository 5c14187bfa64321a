//! Blocks of metadata to start from.

/// An XMP packet in which a drone and a sphere tell how the camera was held, as attributes and as elements.
pub(super) const POSES: &str = "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\
<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description \
xmlns:drone-dji=\"http://www.dji.com/drone-dji/1.0/\" xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\" \
drone-dji:GimbalRollDegree=\"+1.25\" drone-dji:GimbalPitchDegree=\"-12.50\"><GPano:PosePitchDegrees>3</GPano:PosePitchDegrees>\
<GPano:PoseRollDegrees>-4.5</GPano:PoseRollDegrees></rdf:Description></rdf:RDF></x:xmpmeta><?xpacket end=\"w\"?>";

/// An EXIF block: orientation 6, a focal length of 24 mm, GPS directions; tag, type, number and value of every field
/// (EXIF 3.0 4.6, TIFF 6.0 section 2).
pub(super) fn exif() -> Vec<u8> {
    let field = |tag: u16, kind: u16, count: u32, value: u32| {
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), &value.to_le_bytes()].concat()
    };
    let (first, second, ratio) = (8_u32, 50_u32, 80_u32);
    let mut block = [b"II*\0", &first.to_le_bytes()[..], &[3, 0]].concat();
    block.extend([field(0x0112, 3, 1, 6), field(0x0131, 2, 4, 0x0061_6263), field(0x8769, 4, 1, second)].concat());
    block.extend([0; 4]);
    block.extend([&[2, 0][..], &field(0x920a, 5, 1, ratio), &field(0xa405, 3, 1, 24), &[0; 4]].concat());
    block.extend([24_u32.to_le_bytes(), 1_u32.to_le_bytes()].concat());
    block
}
