//! Puts the commit into the program where it is built from a repository; elsewhere does nothing.
//! A program whose physics is not that of its commit says so: `5195945abcde+modified`.

use std::path::Path;
use std::process::Command;

/// Looks without touching the index.
const STATUS: [&str; 5] =
    ["--no-optional-locks", "status", "--porcelain", "--untracked-files=all", "--"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src");
    let git = |arguments: &[&str]| {
        let output =
            Command::new("git").args(arguments).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_string())
    };
    // A copy of the sources inside another repository has no commit of its own.
    if git(&["ls-files", "--error-unmatch", "build.rs"]).is_none() {
        return;
    }
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        return;
    };
    let physics = ["src", "../solver/src", "../shape/src", "../simd/src"];
    let changes = git(&[&STATUS[..], &physics[..]].concat());
    let mark = match changes {
        Some(changes) if changes.is_empty() => "",
        _ => "+modified",
    };
    println!("cargo:rustc-env=GRAINWAKE_COMMIT={commit}{mark}");
    for folder in physics.into_iter().skip(1).filter(|f| Path::new(f).exists()) {
        println!("cargo:rerun-if-changed={folder}");
    }
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) =
            git(&["rev-parse", "--git-path", name]).filter(|p| Path::new(p).exists())
        {
            println!("cargo:rerun-if-changed={path}");
        }
    }
}
