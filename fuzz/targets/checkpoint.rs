//! Checkpoints: the state of a simulation, and behind a first byte of 1 the whole file without its
//! checksum.

#![no_main]

mod folder;

use std::cell::RefCell;
use std::path::Path;

use grainwake_run::Parent;
use grainwake_run::case::Case;
use grainwake_run::provenance::Provenance;
use grainwake_solver::sim::Simulation;
use libfuzzer_sys::fuzz_target;
use sha2::{Digest, Sha256};

thread_local! {
    static SIMULATION: RefCell<Simulation> = RefCell::new({
        let text = include_str!("../seeds/case/wet.toml");
        let case = Case::parse(text, "case.toml", Path::new("."), &[]).expect("a sound case");
        Simulation::new(case.setup).expect("a sound set-up")
    });
}

fuzz_target!(|bytes: &[u8]| {
    match bytes.split_first() {
        Some((0, state)) => SIMULATION.with_borrow_mut(|simulation| {
            if simulation.restore(&mut &state[..]).is_ok() {
                // A state that is accepted can be advanced or fails with an error.
                drop(simulation.step(f64::INFINITY));
            }
        }),
        Some((1, body)) => {
            let run = folder::folder();
            std::fs::create_dir_all(run.join("checkpoint")).expect("a temporary folder");
            if Provenance::read(run).is_none() {
                folder::file("provenance.json", include_bytes!("../seeds/provenance.json"));
            }
            let mut file = body.to_vec();
            file.extend(Sha256::digest(body));
            folder::file("checkpoint/step-0000000001.ckpt", &file);
            drop(Parent::find(run, None, &mut |_| {}));
        }
        _ => {}
    }
});
