//! How a camera was held, as XMP states it.

use roxmltree::{Document, Node, ParsingOptions};
use trueup_core::source::GravitySource;

/// Two angles of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StatedPose {
    /// How far it looks up, degrees.
    pub(crate) pitch_deg: f64,
    /// How far it is turned clockwise about its line of sight, so that the horizon turns counterclockwise in the
    /// picture, degrees.
    pub(crate) roll_deg: f64,
    /// Who states it.
    pub(crate) source: GravitySource,
}

/// Namespaces, and the names of pitch and roll there.
///
/// # Source
/// DJI, image metadata of its cameras (gimbal angles in the north-east-down frame, turned in the order yaw, pitch,
/// roll); Google, Photo Sphere XMP metadata.
const STATEMENTS: [(&str, &str, &str, GravitySource); 2] = [
    ("http://www.dji.com/drone-dji/1.0/", "GimbalPitchDegree", "GimbalRollDegree", GravitySource::DjiGimbal),
    (
        "http://ns.google.com/photos/1.0/panorama/",
        "PosePitchDegrees",
        "PoseRollDegrees",
        GravitySource::PhotoSpherePose,
    ),
];

/// More nodes than any packet of a camera has.
const MOST_NODES: u32 = 100_000;

/// The pose that an XMP packet states, if it does; damaged packets state none.
pub(crate) fn stated_pose(packet: &[u8]) -> Option<StatedPose> {
    let text = std::str::from_utf8(packet).ok()?.trim_matches(['\0', '\u{feff}']);
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).ok()?;
    STATEMENTS.iter().find_map(|&(namespace, pitch, roll, source)| {
        let number = |name| number(&document, namespace, name);
        Some(StatedPose { pitch_deg: number(pitch)?, roll_deg: number(roll)?, source })
    })
}

/// A property's number, which XMP has as an attribute or as an element.
fn number(document: &Document<'_>, namespace: &str, name: &str) -> Option<f64> {
    let text = |node: Node<'_, '_>| match node.attribute((namespace, name)) {
        Some(value) => Some(value.to_owned()),
        None if node.has_tag_name((namespace, name)) => node.text().map(str::to_owned),
        None => None,
    };
    let text = document.descendants().find_map(text)?;
    let number: f64 = text.trim().parse().ok()?;
    (-360.0..=360.0).contains(&number).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(description: &str) -> String {
        format!(
            "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\
             <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">{description}</rdf:RDF></x:xmpmeta>\
             <?xpacket end=\"w\"?>"
        )
    }

    #[test]
    fn gimbal_angles_are_read_as_attributes_and_as_elements() {
        let expected = StatedPose { pitch_deg: -12.5, roll_deg: 1.25, source: GravitySource::DjiGimbal };
        let namespace = "xmlns:drone-dji=\"http://www.dji.com/drone-dji/1.0/\"";
        let attributes = packet(&format!(
            "<rdf:Description {namespace} drone-dji:GimbalRollDegree=\"+1.25\" drone-dji:GimbalPitchDegree=\"-12.50\"/>"
        ));
        assert_eq!(stated_pose(attributes.as_bytes()), Some(expected));
        let elements = packet(&format!(
            "<rdf:Description {namespace}><drone-dji:GimbalRollDegree>1.25</drone-dji:GimbalRollDegree>\
             <drone-dji:GimbalPitchDegree>-12.5</drone-dji:GimbalPitchDegree></rdf:Description>"
        ));
        assert_eq!(stated_pose(elements.as_bytes()), Some(expected));
    }

    #[test]
    fn the_pose_of_a_photo_sphere_is_read() {
        let found = packet(
            "<rdf:Description xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\" GPano:PosePitchDegrees=\"3\" \
             GPano:PoseRollDegrees=\"-4.5\"/>",
        );
        let expected = StatedPose { pitch_deg: 3.0, roll_deg: -4.5, source: GravitySource::PhotoSpherePose };
        assert_eq!(stated_pose(found.as_bytes()), Some(expected));
    }

    #[test]
    fn half_a_statement_and_absurd_ones_are_none() {
        let of = |attributes: &str| {
            let description =
                format!("<rdf:Description xmlns:drone-dji=\"http://www.dji.com/drone-dji/1.0/\" {attributes}/>");
            stated_pose(packet(&description).as_bytes())
        };
        assert_eq!(of("drone-dji:GimbalRollDegree=\"1\""), None);
        assert_eq!(of("drone-dji:GimbalRollDegree=\"1\" drone-dji:GimbalPitchDegree=\"NaN\""), None);
        assert_eq!(of("drone-dji:GimbalRollDegree=\"1\" drone-dji:GimbalPitchDegree=\"1e9\""), None);
        assert_eq!(of("drone-dji:GimbalRollDegree=\"1\" drone-dji:GimbalPitchDegree=\"level\""), None);
        assert_eq!(stated_pose(b"<x:xmpmeta"), None);
        assert_eq!(stated_pose(&[0xff, 0xfe, 0]), None);
    }
}
