//! What the measures mean, in plain words: good, fair, or something to look at, by stated limits.

use std::fmt;

use serde::Serialize;
use trueup_align::mesh::DRAWN_BY_CAMERAS;
use trueup_align::metrics::BENT_SHARE;
use trueup_align::projection::{FlatKind, Projection, ProjectionOptions};
use trueup_core::diagnostics::{Diagnostic, Subject};

use super::measures::{Measures, PhotographMeasures, lean_side};
use crate::options::Evidence;
use crate::pipeline::align::PARALLAX;
use crate::project::record::Project;

/// What a measured figure means for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Nobody sees that it is not perfect.
    Good,
    /// To be seen by who looks for it.
    Fair,
    /// It may be seen at once.
    LookAtIt,
}

impl Verdict {
    /// Of a figure: good up to the first limit, fair up to the second.
    fn of(figure: f64, [good, fair]: [f64; 2]) -> Self {
        if figure <= good {
            Self::Good
        } else if figure <= fair {
            Self::Fair
        } else {
            Self::LookAtIt
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Good => "good",
            Self::Fair => "fair",
            Self::LookAtIt => "look at it",
        })
    }
}

/// Limits of the lean, 95 % sure, in degrees: a degree is seen beside a straight edge, three without one.
const LEAN_DEG: [f64; 2] = [1.0, 3.0];
/// Limits of how far apart 95 of 100 matched points may land, as shares of the photographs' longer side: what is a
/// pixel on a screen that shows a whole photograph, and four.
const APART: [f64; 2] = [1.0 / 2000.0, 1.0 / 500.0];
/// The same in pixels, which no photograph is too small for: blending hides a pixel and a half.
const LEAST_APART_PX: [f64; 2] = [1.5, 4.0];
/// Limits of how far a long line may stray, as shares of its length: what counts as bent, and what testers of
/// wide-angle lenses call strong distortion, whether the mesh bends the line or a view that is too wide for a plane.
const BENT: [f64; 2] = [BENT_SHARE, 0.02];

/// A plain word for every figure that was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Judgement {
    /// How upright it is: by the widest lean that is probable, beyond that by which the viewer's head was asked to be
    /// turned. `None` where the viewer was asked to look up or down, from where upright things lean wherever cameras
    /// are right.
    pub upright: Option<Verdict>,
    /// How well photographs meet: by the distances of matched points.
    pub alignment: Option<Verdict>,
    /// How straight lines are: by the longest that is bent. `None` for a full turn, which bows level lines wherever
    /// cameras are right; a viewer that looks round in it shows them straight; and for a view asked to look up or down
    /// that is not flat, which bows them as well.
    pub lines: Option<Verdict>,
}

impl Project {
    /// What the measures that were recorded mean; `None` for figures that were not measured, or say nothing of this
    /// panorama.
    pub fn judgement(&self) -> Judgement {
        let Some(measures) = &self.measures else { return Judgement::default() };
        let upright = self.upright_deg(measures);
        let apart = measures.reprojection.as_ref().map(|found| found.percentile_95_px);
        Judgement {
            upright: upright.map(|degrees| Verdict::of(degrees, LEAN_DEG)),
            alignment: apart.map(|apart| Verdict::of(apart, self.limits_apart_px())),
            lines: measures.long_lines.as_ref().filter(|_| !self.bows_lines()).map(|lines| match &lines.longest_bent {
                None => Verdict::Good,
                Some(line) => Verdict::of(line.off_px / line.length_px, BENT),
            }),
        }
    }

    /// The widest lean that is probable, degrees, that nobody asked for; `None` where it was not measured or says
    /// nothing.
    fn upright_deg(&self, measures: &Measures) -> Option<f64> {
        let upright = measures.upright.as_ref()?;
        let asked = self.asked_view();
        if asked.is_some_and(|asked| asked.pitch != 0.0) {
            return None;
        }
        let asked_roll = asked.map_or(0.0, |asked| asked.roll);
        if asked_roll == 0.0 {
            return Some(upright.within_deg.unwrap_or(upright.max_deg));
        }
        let certain = measures.photographs.iter().filter(|one| one.certain);
        certain.filter_map(|one| widest_lean_deg(one, asked_roll)).max_by(f64::total_cmp)
    }

    /// Whether the view bows straight lines as it should.
    fn bows_lines(&self) -> bool {
        let is_flat = self.projection.is_some_and(|projection| projection.kind == FlatKind::Perspective);
        self.canvas.full_turn || self.asked_view().is_some_and(|asked| asked.pitch != 0.0 && !is_flat)
    }

    /// How the viewer was asked to be turned, if there is a view to turn.
    fn asked_view(&self) -> Option<&ProjectionOptions> {
        self.projection.map(|_| &self.options.arrange.projection)
    }

    /// How far apart 95 of 100 matched points may land for the alignment to be good, and to be fair, in the
    /// photographs' own pixels.
    pub fn limits_apart_px(&self) -> [f64; 2] {
        let side = self.used_images().map(|image| image.width.max(image.height)).max().unwrap_or(0) as f64;
        [0, 1].map(|limit| (APART[limit] * side).max(LEAST_APART_PX[limit]))
    }
}

/// The widest lean of a photograph that is probable beyond what the viewer's head turned clockwise by `asked_roll`
/// makes of upright things, degrees: all round, they lean the other way by up to as much. None at all is no fault
/// either, as where the turn was asked for to mend one.
fn widest_lean_deg(photograph: &PhotographMeasures, asked_roll: f64) -> Option<f64> {
    let lean = photograph.lean_deg?;
    let asked_for = lean.clamp((-asked_roll).min(0.0), (-asked_roll).max(0.0));
    Some((lean - asked_for).abs() + photograph.within_deg.unwrap_or(0.0))
}

/// Whether lines and pixels aligned the overlaps, as asked or, as was `told`, because of parallax, or the cameras draw
/// the photographs, of which these move little: nothing more can be asked for.
fn asked_all_evidence(project: &Project, told: &[Diagnostic]) -> bool {
    let settles = |found: &Diagnostic| [PARALLAX, DRAWN_BY_CAMERAS].contains(&found.code.as_str());
    project.options.align.stitch.align == Evidence::LinesPhotometric || told.iter().any(settles)
}

/// Names of the warnings below.
const LEANING: &str = "leaning";
const MISALIGNED: &str = "misaligned";
const BENT_LINE: &str = "line-bent";

/// Whether a finding is a warning about a figure that is to be looked at, which other measures make obsolete.
pub fn is_of_measures(finding: &Diagnostic) -> bool {
    [LEANING, MISALIGNED, BENT_LINE].contains(&finding.code.as_str())
}

/// A warning for every figure that is to be looked at, which names the place. `told` is what was found on the way.
pub(crate) fn warnings(project: &Project, told: &[Diagnostic]) -> Vec<Diagnostic> {
    let Some(measures) = &project.measures else { return Vec::new() };
    let is_bad = |verdict| verdict == Some(Verdict::LookAtIt);
    let judgement = project.judgement();
    let place = |path: &str| project.images.iter().position(|image| image.path == path);
    [
        leaning(project, measures, &place).filter(|_| is_bad(judgement.upright)),
        misaligned(project, told, measures, &place).filter(|_| is_bad(judgement.alignment)),
        bent(project, measures, &place).filter(|_| is_bad(judgement.lines)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn leaning(project: &Project, measures: &Measures, place: &impl Fn(&str) -> Option<usize>) -> Option<Diagnostic> {
    let asked_roll = project.asked_view().map_or(0.0, |asked| asked.roll);
    let certain = measures.photographs.iter().filter(|photograph| photograph.certain);
    let widest = certain.filter_map(|one| Some((one, one.lean_deg?, widest_lean_deg(one, asked_roll)?)));
    let (photograph, lean, _) = widest.max_by(|one, two| one.2.total_cmp(&two.2))?;
    let within = lean.abs() + photograph.within_deg.unwrap_or(0.0);
    /// Decimals of degrees that are told.
    const DECIMALS: usize = 1;
    let side = lean_side(lean, DECIMALS);
    let ways = match project.options.arrange.projection.kind {
        // It has chosen already.
        Projection::Auto => "turn it back with --roll",
        _ => "try --projection auto, or --roll with it",
    };
    /// Degrees up or down from which on a view shows plainly that what is upright in it converges.
    const CONVERGES: f64 = 10.0;
    let looks = project.projection.map_or(0.0, |view| view.pitch_deg);
    let reason = if looks.abs() > CONVERGES {
        let side = if looks > 0.0 { "up" } else { "down" };
        format!(
            "The view looks {side} by {:.0} degrees, where what is upright converges; --projection cylindrical keeps it parallel. If all leans to one side",
            looks.abs()
        )
    } else {
        "If it does lean".to_owned()
    };
    Some(Diagnostic::warning(
        LEANING,
        Subject::Photograph(place(&photograph.path)?),
        format!(
            "what is vertical there leans{side} by {:.DECIMALS$} degrees, up to {within:.DECIMALS$} at 95 %",
            lean.abs()
        ),
        format!("Look at it there. {reason}, {ways}."),
    ))
}

fn misaligned(
    project: &Project,
    told: &[Diagnostic],
    measures: &Measures,
    place: &impl Fn(&str) -> Option<usize>,
) -> Option<Diagnostic> {
    let found = measures.reprojection.as_ref()?;
    let worst = found.worst_pair.as_ref()?;
    let all = match project.used() {
        // The one pair is all there is.
        2 => String::new(),
        _ => format!("; over all photographs within {:.1}", found.percentile_95_px),
    };
    // Without one of two there is no panorama.
    let leave_out = (project.used() != 2).then_some("leave one out");
    let mend = match asked_all_evidence(project, told) {
        true => "hide with --mask what stands twice",
        false => "try --align lines+photometric",
    };
    let ways: Vec<&str> = leave_out.into_iter().chain([mend]).collect();
    Some(Diagnostic::warning(
        MISALIGNED,
        Subject::Pair(place(&worst.a)?, place(&worst.b)?),
        format!("95 of 100 points that both show lie within {:.1} px of each other{all}", worst.percentile_95_px),
        format!("Look at the seam between them. Parallax or a false match may be the reason: {}.", ways.join(", or ")),
    ))
}

fn bent(project: &Project, measures: &Measures, place: &impl Fn(&str) -> Option<usize>) -> Option<Diagnostic> {
    let mend = match project.projection.map(|projection| projection.kind) {
        None | Some(FlatKind::Perspective) => "--structure lines keeps long lines straight.",
        Some(_) => {
            "A view as wide as this bows lines; fewer photographs, or --projection perspective, keep them straight."
        }
    };
    let line = measures.long_lines.as_ref()?.longest_bent.as_ref()?;
    Some(Diagnostic::warning(
        BENT_LINE,
        Subject::Photograph(place(&line.path)?),
        format!("a straight line of {:.0} px strays by {:.1} px", line.length_px, line.off_px),
        format!("Look at it there. {mend}"),
    ))
}

#[cfg(test)]
mod tests {
    use super::super::measures::{BentLine, LongLines, ReprojectionMeasures, UprightMeasures, WorstPair};
    use super::*;

    fn project(lean: f64, apart: f64, off_px: f64) -> Project {
        let image = |path: &str| {
            serde_json::json!({"path": path, "width": 4000, "height": 3000, "status": "used", "reason": "", "hint": "",
                "component": 0, "focal_px": null, "rotation": null, "theta_deg": null, "scale": null, "gain": null,
                "vanishing_points": null, "mesh": null})
        };
        let json = serde_json::json!({"format": "trueup-project", "version": 1, "method": "vpg", "options": {},
            "reference": "a.jpg", "images": [image("a.jpg"), image("b.jpg")], "pairs": [],
            "manhattan": {"divergence": null, "threshold": 0.1, "accepted": false, "failed_clause": null,
                "dominant": null, "inliers": []},
            "canvas": {"width": 1, "height": 1}, "seconds": {}, "diagnostics": []});
        let mut project = Project::from_json(&json.to_string(), "test").expect("a project");
        let photograph = serde_json::json!({"path": "b.jpg", "vertical_lines": 9, "lean_deg": -lean,
            "standard_error_deg": 0.1, "within_deg": 0.2, "gamma_deg": 0.0, "certain": true});
        project.measures = Some(Measures {
            upright: Some(UprightMeasures { mean_deg: lean, max_deg: lean, within_deg: Some(lean + 0.2), measured: 2 }),
            estimated_gdic_deg: None,
            reprojection: Some(ReprojectionMeasures {
                matches: 9,
                mean_px: apart / 3.0,
                rms_px: apart / 2.0,
                percentile_95_px: apart,
                worst_pair: Some(WorstPair { a: "a.jpg".into(), b: "b.jpg".into(), percentile_95_px: 2.0 * apart }),
            }),
            long_lines: Some(LongLines {
                lines: 3,
                mean_bend: 0.0,
                bent: 1,
                longest_bent: Some(BentLine { path: "a.jpg".into(), length_px: 1000.0, off_px }),
            }),
            ld: 0.0,
            ld_mean: 0.0,
            folds: 0,
            pairs: Vec::new(),
            photographs: vec![serde_json::from_value(photograph).expect("a photograph")],
        });
        project
    }

    #[test]
    fn every_figure_has_a_plain_word() {
        let words = |project: Project| {
            let Judgement { upright, alignment, lines } = project.judgement();
            [upright, alignment, lines].map(|verdict| verdict.expect("measured").to_string())
        };
        // Of a side of 4000 px: 2 px are good, 8 fair.
        assert_eq!(words(project(0.5, 1.9, 2.9)), ["good", "good", "good"]);
        assert_eq!(words(project(2.5, 7.9, 19.0)), ["fair", "fair", "fair"]);
        assert_eq!(words(project(3.5, 8.1, 21.0)), ["look at it", "look at it", "look at it"]);
    }

    #[test]
    fn bad_figures_become_warnings_that_name_the_place() {
        assert!(warnings(&project(2.5, 7.9, 19.0), &[]).is_empty());
        let found = warnings(&project(3.5, 282.0, 21.0), &[]);
        let told: Vec<(&str, &Subject)> = found.iter().map(|one| (one.code.as_str(), &one.subject)).collect();
        assert_eq!(
            told,
            [
                ("leaning", &Subject::Photograph(1)),
                ("misaligned", &Subject::Pair(0, 1)),
                ("line-bent", &Subject::Photograph(0))
            ]
        );
        assert!(found[0].message.contains("to the left by 3.5 degrees, up to 3.7"), "{}", found[0].message);
        assert!(found[1].message.ends_with("lie within 564.0 px of each other"), "{}", found[1].message);
        assert!(found[1].hint.contains("--align lines+photometric"), "{}", found[1].hint);
        // The view is chosen already.
        assert!(!found[0].hint.contains("--projection auto"), "{}", found[0].hint);
        let note = |code: &str| Diagnostic::note(code, Subject::stage("mesh"), "", "");
        for code in [PARALLAX, DRAWN_BY_CAMERAS] {
            let found = warnings(&project(0.5, 282.0, 1.0), &[note(code)]);
            assert!(found[0].hint.contains("--mask"), "{code}: {}", found[0].hint);
        }
        // Of two photographs, none can be left out.
        assert!(!found[1].hint.contains("leave one out"), "{}", found[1].hint);
    }

    /// Up a tower.
    #[test]
    fn where_a_view_looks_up_what_is_upright_converges() {
        let mut project = project(3.5, 1.0, 1.0);
        let view = serde_json::json!({"kind": "fitted", "yaw_deg": 0.0, "pitch_deg": 29.7, "roll_deg": 0.0, "panini_distance": 0.0,
            "px_per_radian": 900.0, "origin": [0.0, 0.0], "sphere": null, "fit": {"round": 0.3, "upright": 1.0, "turned": true}});
        project.projection = Some(serde_json::from_value(view).expect("a view"));
        let hint = &warnings(&project, &[])[0].hint;
        assert!(hint.contains("looks up by 30 degrees") && hint.contains("--projection cylindrical"), "{hint}");
    }

    /// A line of 997 px that strays by 31.8, as on the cylinder of a library's hall.
    #[test]
    fn what_the_view_bows_no_structure_straightens() {
        let mut project = project(0.5, 1.0, 31.8);
        let hint = |project: &Project| warnings(project, &[]).pop().expect("a bent line").hint;
        assert!(hint(&project).contains("--structure lines"), "{}", hint(&project));
        let view = |kind: &str| {
            serde_json::json!({"kind": kind, "yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": 0.0, "panini_distance": 1.0,
                "px_per_radian": 900.0, "origin": [0.0, 0.0], "sphere": null})
        };
        for (kind, expected) in [("cylindrical", "--projection perspective"), ("perspective", "--structure lines")] {
            project.projection = Some(serde_json::from_value(view(kind)).expect("a view"));
            assert!(hint(&project).contains(expected), "{kind}: {}", hint(&project));
        }
        project.projection = Some(serde_json::from_value(view("equirectangular")).expect("a view"));
        project.canvas.full_turn = true;
        assert!(warnings(&project, &[]).is_empty());
        assert_eq!(project.judgement().lines, None);
    }

    /// Of a head turned clockwise, upright things lean to the left; from above, they lean to all sides and lines are
    /// bowed.
    #[test]
    fn a_view_that_was_asked_for_is_no_fault() {
        let mut project = project(3.5, 1.0, 31.8);
        let codes = |project: &Project| -> Vec<String> {
            warnings(project, &[]).into_iter().map(|warning| warning.code).collect()
        };
        let view = |kind: &str| {
            serde_json::json!({"kind": kind, "yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": 0.0, "panini_distance": 1.0,
                "px_per_radian": 900.0, "origin": [0.0, 0.0], "sphere": null})
        };
        let set = |project: &mut Project, kind: &str, pitch: f64, roll: f64| {
            project.projection = Some(serde_json::from_value(view(kind)).expect("a view"));
            project.options.arrange.projection.pitch = pitch;
            project.options.arrange.projection.roll = roll;
        };
        set(&mut project, "stereographic", 0.0, 0.0);
        assert_eq!(codes(&project), ["leaning", "line-bent"]);
        for roll in [3.0, 30.0] {
            set(&mut project, "stereographic", 0.0, roll);
            assert_eq!(codes(&project), ["line-bent"], "{roll}");
        }
        // Turned the other way, it leans all the same.
        set(&mut project, "stereographic", 0.0, -3.0);
        assert_eq!(codes(&project), ["leaning", "line-bent"]);
        set(&mut project, "stereographic", -90.0, 0.0);
        assert!(codes(&project).is_empty());
        set(&mut project, "perspective", 20.0, 0.0);
        assert_eq!(codes(&project), ["line-bent"]);
    }

    #[test]
    fn what_was_done_is_not_advised() {
        let mut project = project(0.5, 282.0, 2.9);
        let third = project.images[1].clone();
        project.images.push(third);
        let found = warnings(&project, &[Diagnostic::note(PARALLAX, Subject::stage("mesh"), "", "")]);
        assert!(found[0].message.ends_with("of each other; over all photographs within 282.0"), "{}", found[0].message);
        assert!(found[0].hint.ends_with("hide with --mask what stands twice."), "{}", found[0].hint);
    }
}
