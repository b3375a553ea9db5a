//! `grainwake bench`: time of a step, compared with the memory bandwidth where there is a fluid.

mod case;
mod measure;
mod table;
mod triad;

use grainwake_run::admit_memory;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::{InstructionSet, limit_instructions};

use crate::args::BenchArgs;
use crate::exit::Exit;
use crate::{kind, print, threads};
use measure::Measured;

/// Cells along each edge of the cubes of `--scaling`: powers of two, round numbers, and primes.
const CUBES: [usize; 14] = [32, 48, 64, 67, 80, 96, 97, 100, 128, 131, 160, 192, 200, 256];
/// Runs the benchmark and prints the measurements.
pub fn bench(args: &BenchArgs) -> Result<(), Exit> {
    let &[nx, ny, nz] = &args.size[..] else {
        return Err(Exit::input("--size takes three numbers"));
    };
    if let Some(n) = [nx, ny, nz].iter().find(|n| !(16..=4096).contains(*n)) {
        let message = format!("--size takes 16 to 4096 cells along each axis, found {n}");
        return Err(Exit::input(message));
    }
    if args.steps == 0 {
        return Err(Exit::input("--steps takes at least one step"));
    }
    let own = (args.case.as_ref()).map(|path| kind::case(path, &args.overrides)).transpose()?;
    if own.is_none() && !args.overrides.list().is_empty() {
        let message = "--set and --unset change a case file, and none is given";
        return Err(Exit::input(message));
    }
    if let Some(set) = args.instructions {
        let widest = InstructionSet::widest();
        if set > widest {
            let (set, widest) = (set.name(), widest.name());
            let message = format!("--instructions {set}: this processor has at most {widest}");
            return Err(Exit::input(message));
        }
        limit_instructions(set);
    }
    let threads = threads::resolve(args.threads, false);
    let scheme = if args.scheme == "paper" { Scheme::Paper } else { Scheme::Aperture };
    let sizes = if args.scaling { CUBES.map(|n| [n; 3]).to_vec() } else { vec![[nx, ny, nz]] };
    let measured: Vec<Measured> = threads::on(threads, || {
        if let Some(case) = own {
            admit_memory(&case.setup, None)?;
            return Ok(vec![measure::measure(case.setup, args, threads)?]);
        }
        let setup = |cells| {
            let setup = case::setup(cells, args.grains, scheme, args.precision)?;
            admit_memory(&setup, None)?;
            Ok(setup)
        };
        // No size is measured in vain.
        let setups = sizes.into_iter().map(setup).collect::<Result<Vec<_>, Exit>>()?;
        setups.into_iter().map(|setup| measure::measure(setup, args, threads)).collect()
    })??;
    match (args.json, &measured[..]) {
        (true, [one]) => print(&serde_json::to_string(one)?),
        (true, all) => print(&serde_json::to_string(all)?),
        (false, [one]) => print(&table::one(one)),
        (false, all) => print(&table::scaling(all)),
    }
}
