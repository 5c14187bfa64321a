//! How true panoramas are to their photographs with each way of blending: steps across seams and ghosts.
//!
//! `cargo run --release -p trueup --example composites -- SCALE [OPTION=VALUE...] FOLDER...` prints a line per folder
//! and way.

use trueup::{Inputs, StageContext, StitchOptions, Stitcher};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let scale = arguments.next().ok_or("give a scale, 1 for full size, and folders of photographs")?;
    println!(
        "folder\texposure\tblend\tlines_px\tstep\toverlap_step\twrap_px\twrap_step\tcolumn_step\tghost\tghost_share\tseconds"
    );
    let mut options = StitchOptions::default();
    options.set(&format!("canvas.scale={scale}"))?;
    let (assignments, folders): (Vec<String>, Vec<String>) = arguments.partition(|argument| argument.contains('='));
    assignments.iter().try_for_each(|assignment| options.set(assignment))?;
    for folder in folders {
        if let Err(error) = measure(&folder, options.clone()) {
            println!("{folder}\t{error}");
        }
    }
    Ok(())
}

/// Exposure model and anchor, and blending: as published panoramas are blended, then with color, then with seams.
const WAYS: [[&str; 3]; 4] = [
    ["gain", "mean", "feather"],
    ["full", "scene", "feather"],
    ["full", "scene", "none"],
    ["full", "scene", "multiband"],
];

fn measure(folder: &str, mut options: StitchOptions) -> Result<(), trueup::Error> {
    let context = StageContext::default();
    let inputs = Inputs::new([folder]);
    let matched = Stitcher::new(&options, &context).match_photographs(&inputs)?.remembering();
    for [model, anchor, blend] in WAYS {
        options.set(&format!("exposure.model={model}"))?;
        options.set(&format!("exposure.anchor={anchor}"))?;
        options.set(&format!("render.blend={blend}"))?;
        let stitcher = Stitcher::new(&options, &context);
        let mut aligned = stitcher.align_matched(&matched, &inputs)?;
        let Some(alignment) = aligned.alignments.first_mut() else { return Ok(()) };
        let start = std::time::Instant::now();
        let rendered = stitcher.compose(alignment)?;
        let seconds = start.elapsed().as_secs_f64();
        let found = stitcher.fidelity(alignment, &rendered)?;
        println!(
            "{folder}\t{model}\t{blend}\t{}\t{:.3}\t{:.3}\t{}\t{:.3}\t{:.3}\t{:.3}\t{:.4}\t{seconds:.2}",
            found.line_px,
            found.step,
            found.overlap_step,
            found.wrap_px,
            found.wrap_step,
            found.column_step,
            found.ghost,
            found.ghost_share
        );
    }
    Ok(())
}
