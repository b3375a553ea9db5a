//! `grain export`: the mesh of a grain read back gives the grain.

use crate::common::grainwake;
use predicates::str::contains;

/// Volume of a grain file [m^3].
fn volume(path: &std::path::Path) -> f64 {
    let done = grainwake().args(["grain", "info", "--json"]).arg(path).assert().success();
    let record: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    record["volume_m3"].as_f64().unwrap_or_else(|| panic!("{record}"))
}

#[test]
fn exported_meshes_read_back_as_the_same_grain() {
    let folder = tempfile::tempdir().unwrap();
    let grain = folder.path().join("x.grain");
    grainwake()
        .args(["grain", "make", "rounded-box", "3 mm", "2 mm", "1.5 mm", "--radius", "0.3 mm"])
        .args(["--cells", "48", "-o"])
        .arg(&grain)
        .assert()
        .success();
    let expected = volume(&grain);
    for ending in ["stl", "ply", "obj"] {
        let mesh = folder.path().join(format!("x.{ending}"));
        let mut export = grainwake();
        export.args(["grain", "export"]).arg(&grain).arg("-o").arg(&mesh).args(["--unit", "mm"]);
        export.assert().success().stdout(contains("triangles"));
        export.assert().code(2).stderr(contains("exists already"));
        let back = folder.path().join(format!("{ending}.grain"));
        let mut read = grainwake();
        read.args(["grain", "from-mesh"]).arg(&mesh).args(["--unit", "mm", "--cells", "48", "-o"]);
        read.arg(&back).assert().success();
        let error = volume(&back) / expected - 1.0;
        assert!(error.abs() < 0.01, "{ending}: {error}");
    }
    let surface = folder.path().join("x.vtp");
    let mut export = grainwake();
    export.args(["grain", "export"]).arg(&grain).arg("-o").arg(&surface).assert().success();
    let surface = grainwake_formats::vtp::read(&surface).unwrap();
    let largest = surface.points.iter().map(|p| p.x.abs()).fold(0.0, f64::max);
    assert!((largest - 1.5e-3).abs() < 2e-5, "{largest}");
    let mut export = grainwake();
    export.args(["grain", "export"]).arg(&grain).arg("-o").arg(folder.path().join("x.step"));
    export.assert().code(2).stderr(contains(".stl, .ply, .obj or .vtp"));
}
