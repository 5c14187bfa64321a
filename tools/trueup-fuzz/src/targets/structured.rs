//! Inputs that are made to be well formed, from bytes that decide what is in them: what comes after the first look at a
//! text.

use arbitrary::{Arbitrary, Result, Unstructured};
use serde_json::{Value, json};
use trueup::{Project, RecordedPanorama, StageContext, StitchOptions, Stitcher};

use super::pictures;
use super::texts;
use super::work::Work;

/// Sides of the photographs that the projects speak of, in pixels: those that [`pictures::photograph`] writes.
const SIDE: usize = pictures::SIDE;

/// Bytes of the seeds, which decide nothing sensible: libFuzzer finds better ones.
const SEED_BYTES: usize = 2000;

/// Options that are set of one input: each takes milliseconds, as all are written and read again.
const MOST_ASSIGNMENTS: usize = 8;

/// Numbers at which something may go wrong.
const SPECIAL: [f64; 14] =
    [0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-300, 1e300, -1e300, 1e9, -1e9, 4_294_967_296.0, f64::EPSILON, 1e17];

/// Bytes without an order.
fn noise(first: u64) -> Vec<u8> {
    let mut state = first;
    let mut next = || {
        // G. Steele, D. Lea, C. Flood: "Fast Splittable Pseudorandom Number Generators", 2014.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb) >> 56) as u8
    };
    (0..SEED_BYTES).map(|_| next()).collect()
}

pub(super) fn options() -> Vec<Vec<u8>> {
    (1..=4).map(noise).chain([vec![0; SEED_BYTES]]).collect()
}

/// Sets options of any table to values of any kind, and asks of all that is accepted whether it is written as it was
/// read.
pub(super) fn read_options(_: &Work, input: &[u8]) {
    let mut drawn = Unstructured::new(input);
    let mut options = StitchOptions::default();
    let described = StitchOptions::describe();
    for _ in 0..MOST_ASSIGNMENTS {
        let Ok(assignment) = assignment(&mut drawn, &described) else { break };
        // Numbers that are none are unlike themselves: compared as text.
        let before = format!("{options:?}");
        if options.set(&assignment).is_err() {
            assert_eq!(format!("{options:?}"), before, "what is refused changes nothing");
        }
    }
    if options.validate().is_ok() {
        let _ = options.fixed_by_method();
        let changed = options.changed().unwrap_or_else(|error| panic!("{error}"));
        let mut again = StitchOptions::default();
        for option in &changed {
            let assignment = format!("{}={}", option.description.name, option.value);
            again.set(&assignment).unwrap_or_else(|error| panic!("{assignment}: {error}"));
        }
        assert_eq!(again.changed().ok().as_ref(), Some(&changed), "what was changed says how to change it so");
    }
}

/// An option, and a value of its kind or of another one.
fn assignment(drawn: &mut Unstructured, described: &[trueup::OptionDescription]) -> Result<String> {
    let option = drawn.choose(described)?;
    let value = match drawn.int_in_range(0..=5)? {
        0 => drawn.choose(&option.choices).map(|choice| choice.name.to_owned()).unwrap_or_default(),
        1 => f64::arbitrary(drawn)?.to_string(),
        2 => i64::arbitrary(drawn)?.to_string(),
        3 => drawn.choose(&SPECIAL)?.to_string(),
        4 => bool::arbitrary(drawn)?.to_string(),
        _ => drawn.choose(&["auto", "none", "2GB", "nan", "inf", "", "256MB", "#ff8000", "1,2", "[1, 2]"])?.to_string(),
    };
    Ok(format!("{}={value}", option.name))
}

pub(super) fn projects() -> Vec<Vec<u8>> {
    (5..=8).map(noise).chain([vec![0; SEED_BYTES]]).collect()
}

/// Opens a project over two photographs that are there, and lays it out.
pub(super) fn read_project(work: &Work, input: &[u8]) {
    let Ok(value) = project(&mut Unstructured::new(input)) else { return };
    texts::read_project(work, value.to_string().as_bytes());
    let Ok(project) = Project::from_json(&value.to_string(), "project.json") else { return };
    for name in ["a.png", "b.png"] {
        pictures::photograph(work, name);
    }
    let (options, context) = (project.options.clone(), StageContext::default());
    let recorded = RecordedPanorama { project: &project, project_folder: work.path(), photographs: None, masks: &[] };
    let _ = Stitcher::new(&options, &context).reopen(&recorded);
}

/// A number that is mostly sensible: `usual` and a little more or less.
fn number(drawn: &mut Unstructured, usual: f64) -> Result<f64> {
    Ok(match drawn.int_in_range(0..=15)? {
        0 => *drawn.choose(&SPECIAL)?,
        1 => usual * f64::from(i8::arbitrary(drawn)?),
        2 => Some(f64::arbitrary(drawn)?).filter(|number| number.is_finite()).unwrap_or(usual),
        3 => usual + f64::from(i8::arbitrary(drawn)?) / 16.0,
        _ => usual,
    })
}

/// A grid over a photograph whose left border lies at `left`.
fn mesh(drawn: &mut Unstructured, left: f64) -> Result<Value> {
    let (rows, columns) = (drawn.int_in_range(2..=4)?, drawn.int_in_range(2..=4)?);
    let (mut source, mut target) = (Vec::new(), Vec::new());
    for row in 0..rows {
        for column in 0..columns {
            let place = [column, row].map(|at: usize| at as f64);
            let x = place[0] * SIDE as f64 / (columns - 1) as f64;
            let y = place[1] * SIDE as f64 / (rows - 1) as f64;
            source.push([number(drawn, x)?, number(drawn, y)?]);
            target.push([number(drawn, left + x)?, number(drawn, y)?]);
        }
    }
    Ok(json!({"rows": rows, "cols": columns, "source": source, "target": target}))
}

fn image(drawn: &mut Unstructured, path: &str, left: f64) -> Result<Value> {
    let status = if drawn.ratio(15, 16)? { "used" } else { "left_out" };
    let mut image = json!({
        "path": path, "width": SIDE, "height": SIDE, "orientation": drawn.int_in_range(0..=9)?.max(1), "status": status,
        "reason": "", "hint": "", "component": 0, "focal_px": number(drawn, 20.0)?,
        "rotation": [[number(drawn, 1.0)?, 0.0, 0.0], [0.0, number(drawn, 1.0)?, 0.0], [0.0, 0.0, number(drawn, 1.0)?]],
        "theta_deg": number(drawn, 0.0)?, "scale": number(drawn, 1.0)?, "gain": number(drawn, 1.0)?,
        "vanishing_points": null, "mesh": mesh(drawn, left)?
    });
    if bool::arbitrary(drawn)? {
        image["solved_mesh"] = mesh(drawn, left)?;
    }
    if drawn.ratio(1, 4)? {
        image["lens"] = json!({
            "projection": if bool::arbitrary(drawn)? { "rectilinear" } else { "equidistant" },
            "radial": [number(drawn, -0.1)?, number(drawn, 0.0)?, number(drawn, 0.0)?, 0.0],
            "tangential": [number(drawn, 0.0)?, 0.0], "center_px": [number(drawn, 0.0)?, number(drawn, 0.0)?]
        });
    }
    Ok(image)
}

fn project(drawn: &mut Unstructured) -> Result<Value> {
    let version = drawn.int_in_range(1..=2)?;
    let images = [image(drawn, "a.png", 0.0)?, image(drawn, "b.png", SIDE as f64 / 2.0)?];
    let mut project = json!({
        "format": "trueup-project", "version": version, "method": "vpg", "options": {}, "reference": "b.png",
        "images": images,
        "pairs": [{"a": drawn.int_in_range(0..=2)?, "b": drawn.int_in_range(0..=2)?, "matches": u32::arbitrary(drawn)?,
            "inliers": u32::arbitrary(drawn)?, "needed": 15, "verdict": "joined"}],
        "manhattan": {"divergence": number(drawn, 0.003)?, "threshold": 0.1, "accepted": true, "failed_clause": null,
            "dominant": null, "inliers": ["a.png"]},
        "measures": null,
        "canvas": {"width": number(drawn, 30.0)?.abs().min(1e6) as u64, "height": number(drawn, 20.0)?.abs().min(1e6) as u64,
            "full_turn": drawn.ratio(1, 8)?},
        "seconds": {}, "diagnostics": []
    });
    if drawn.ratio(1, 4)? {
        project["mesh_canvas"] = json!({"width": 30, "height": number(drawn, 20.0)?.abs().min(1e6) as u64});
    }
    if drawn.ratio(1, 4)? {
        let described = StitchOptions::describe();
        let option = drawn.choose(&described)?;
        if let Some((table, name)) = option.name.split_once('.') {
            project["options"][table][name] = json!(number(drawn, 1.0)?);
        }
    }
    Ok(project)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without any choice, everything is as usual: a project that is opened.
    #[test]
    fn the_usual_project_is_opened() {
        let work = Work::new().expect("a folder");
        let usual: Vec<u8> = vec![0xff; SEED_BYTES];
        let value = project(&mut Unstructured::new(&usual)).expect("drawn");
        assert!(Project::from_json(&value.to_string(), "project.json").is_ok(), "{value}");
        read_project(&work, &usual);
    }
}
