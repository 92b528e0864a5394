//! Writes the seeds of a reader as files, for libFuzzer to begin with: `seeds TARGET FOLDER`.

use std::process::ExitCode;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [name, folder] = &words[..] else {
        eprintln!("usage: seeds TARGET FOLDER");
        return ExitCode::from(2);
    };
    let Some(target) = taut_fuzz::target(name) else {
        let names = taut_fuzz::TARGETS.map(|target| target.name).join(", ");
        eprintln!("there is no reader {name}; there are {names}");
        return ExitCode::from(2);
    };
    let written = std::fs::create_dir_all(folder).and_then(|()| {
        let seeds = (target.seeds)();
        seeds.iter().enumerate().try_for_each(|(k, seed)| {
            std::fs::write(std::path::Path::new(folder).join(format!("seed-{k:05}")), &seed.bytes)
        })
    });
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{folder}: {error}");
            ExitCode::FAILURE
        }
    }
}
