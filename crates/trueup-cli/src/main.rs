//! The `trueup` command.
fn main() {
    let mut args = std::env::args().skip(2);
    let (mut photos, mut out, mut project, mut set, mut threads) = (vec![], None, None, vec![], 0);
    while let Some(a) = args.next() {
        match a.as_str() {
            "-o" => out = args.next(),
            "--project" => project = args.next(),
            "--set" => set.push(args.next().unwrap()),
            "--threads" => threads = args.next().unwrap().parse().unwrap(),
            "--quiet" => {}
            _ => photos.push(a),
        }
    }
    let mut options = trueup::StitchOptions::default();
    for s in set {
        options.set(&s).unwrap();
    }
    let job = trueup::StitchJob {
        inputs: trueup::Inputs::new(photos),
        output: out.unwrap().into(),
        project: project.map(Into::into),
        threads,
    };
    let context = trueup::StageContext::default();
    match job.run(&options, &context) {
        Ok(w) => {
            for w in w {
                let p = w.project;
                println!(
                    "{} {}/{} {:?} {:?} {:?}",
                    w.output.display(),
                    p.used(),
                    p.images.len(),
                    p.canvas,
                    p.manhattan.divergence,
                    p.manhattan.failed_clause
                );
                for (k, v) in p.seconds {
                    print!("{k} {v:.3}; ");
                }
                println!();
                for d in p.diagnostics {
                    println!("{:?} {} {} {} {}", d.severity, d.code, d.subject, d.message, d.hint);
                }
            }
        }
        Err(e) => {
            eprintln!("{e}");
            std::process::exit(1);
        }
    }
}
