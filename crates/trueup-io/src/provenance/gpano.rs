//! The XMP packet: what a panorama is made of, and for viewers where it lies on the sphere.
//!
//! # Source
//! Google, Photo Sphere XMP metadata (namespace <http://ns.google.com/photos/1.0/panorama/>); XMP specification part 1.

use std::fmt::Write;

use trueup_core::spherical::{SphericalFrame, SphericalProjection};

use super::description::PanoramaDescription;
use super::taken::Moment;

/// What the packet says beside the geometry.
#[derive(Debug, Clone, Default)]
pub(super) struct Facts {
    /// How many photographs; 0 says nothing.
    pub(super) photographs: usize,
    pub(super) software: Option<&'static str>,
    pub(super) earliest: Option<Moment>,
    pub(super) latest: Option<Moment>,
    /// Compass heading of the levelled world's z axis, degrees.
    pub(super) world_heading_deg: Option<f64>,
}

/// The packet; `None` where there is nothing to say. A frame that does not hold the panorama says nothing.
pub(super) fn packet(
    panorama: &PanoramaDescription<'_>,
    frame: Option<&SphericalFrame>,
    facts: &Facts,
) -> Option<String> {
    let frame = frame.filter(|frame| frame.holds(panorama.width, panorama.height));
    let mut properties: Vec<(&str, String)> = Vec::new();
    if let Some(frame) = frame {
        properties.extend(geometry(panorama, frame, facts.world_heading_deg));
    }
    if facts.photographs > 0 {
        properties.push(("SourcePhotosCount", facts.photographs.to_string()));
    }
    for (name, moment) in [("FirstPhotoDate", &facts.earliest), ("LastPhotoDate", &facts.latest)] {
        properties.extend(moment.as_ref().and_then(Moment::iso).map(|date| (name, date)));
    }
    properties.extend(facts.software.map(|software| ("StitchingSoftware", software.to_owned())));
    if properties.is_empty() {
        return None;
    }
    let mut packet = String::from(HEAD);
    for (name, value) in properties {
        // Writing to a string cannot fail.
        let _ = writeln!(packet, "   <GPano:{name}>{}</GPano:{name}>", escaped(&value));
    }
    packet.push_str(TAIL);
    Some(packet)
}

const HEAD: &str = "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>
<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">
 <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">
  <rdf:Description rdf:about=\"\" xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\">
";
const TAIL: &str = "  </rdf:Description>
 </rdf:RDF>
</x:xmpmeta>
<?xpacket end=\"r\"?>";

fn geometry(
    panorama: &PanoramaDescription<'_>,
    frame: &SphericalFrame,
    world_heading_deg: Option<f64>,
) -> Vec<(&'static str, String)> {
    let projection = match frame.projection {
        SphericalProjection::Equirectangular => "equirectangular",
        SphericalProjection::Cylindrical => "cylindrical",
    };
    let mut properties = vec![
        ("ProjectionType", projection.to_owned()),
        ("UsePanoramaViewer", "True".to_owned()),
        ("FullPanoWidthPixels", frame.full_width.to_string()),
        ("FullPanoHeightPixels", frame.full_height.to_string()),
        ("CroppedAreaImageWidthPixels", panorama.width.to_string()),
        ("CroppedAreaImageHeightPixels", panorama.height.to_string()),
        ("CroppedAreaLeftPixels", frame.left.to_string()),
        ("CroppedAreaTopPixels", frame.top.to_string()),
        ("PosePitchDegrees", format!("{:.1}", panorama.pose_deg[0] + 0.0)),
        ("PoseRollDegrees", format!("{:.1}", panorama.pose_deg[1] + 0.0)),
    ];
    if let Some(heading) = world_heading_deg {
        let middle = heading + frame.middle_yaw.to_degrees();
        properties.push(("PoseHeadingDegrees", format!("{:.1}", below_full_turn(middle, 10.0))));
        // The middle of what is there, not of the whole.
        let from_middle = frame.left as f64 + 0.5 * panorama.width as f64 - 0.5 * frame.full_width as f64;
        let shown = middle + from_middle / frame.full_width as f64 * 360.0;
        properties.push(("InitialViewHeadingDegrees", format!("{:.0}", below_full_turn(shown, 1.0))));
    }
    properties
}

/// An angle from 0 to below 360 degrees, rounded to `steps` per degree.
fn below_full_turn(degrees: f64, steps: f64) -> f64 {
    ((degrees.rem_euclid(360.0) * steps).round() / steps).rem_euclid(360.0)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
