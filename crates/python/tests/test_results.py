"""Run folders: bits of the command line, tables, slices, surfaces, damage."""

import json
import pickle
import shutil
import signal
import sys
import threading
import warnings

import numpy as np
import pytest

import grainwake as gw

pytest.importorskip("pandas")


def test_python_and_the_command_line_write_the_same_bits(case_file, run, cli, tmp_path):
    folder = tmp_path / "cli"
    cli("run", case_file, "-o", folder, "--quiet")
    for name in ("grains.csv", "diagnostics.csv", "events.jsonl", "run.pvd", "case.resolved.toml"):
        assert (folder / name).read_bytes() == (run.path / name).read_bytes(), name
    for file in (folder / "slices").iterdir():
        assert file.read_bytes() == (run.path / "slices" / file.name).read_bytes()
    assert (run.path / "report.html").is_file()


def test_a_simulation_in_memory_has_the_bits_of_the_table(case_file, tmp_path):
    # Without slices and surfaces the times of the table alone decide the steps.
    off = {"output.slices": 0, "output.fields": 0, "output.surfaces": 0}
    case = gw.Case.load(case_file, off)
    table = case.run(tmp_path / "run", progress=False, report=False).grains
    in_memory = gw.frame(gw.Simulation(case).run(progress=False))
    assert len(table) == len(in_memory) == 11
    for column in in_memory:
        assert (table[column] == in_memory[column]).all(), column


def test_tables_are_frames(run):
    grains = run.grains
    assert list(grains.columns[:5]) == ["time", "grain", "x", "y", "z"]
    assert grains["grain"].dtype == "int64" and grains["contacts"].dtype == "int64"
    assert len(grains) == 11
    one = run.grain(0)
    assert one.index.name == "time" and one["vz"].iloc[-1] < -0.02
    assert run.by_grain()["z", 0].iloc[0] == pytest.approx(6e-3)
    assert run.diagnostics["step"].dtype == "int64"
    assert list(run.events.columns) == ["time", "event", "grains", "confirmed", "gap", "tilt", "wall"]
    assert run.grain(np.int64(0)).equals(one)
    with pytest.raises(IndexError, match="there is no grain 1"):
        run.grain(1)


def test_probes_are_frames(case_file, tmp_path):
    import pandas

    text = case_file.read_text() + """
[[probe]]
name = "middle"
every = "10 ms"
plane = { normal = "z", at = "4 mm" }
[[probe]]
line = { from = ["2 mm", "2 mm", 0], to = ["2 mm", "2 mm", "8 mm"], points = 3 }
"""
    (tmp_path / "case.toml").write_text(text)
    case = gw.Case.load(tmp_path / "case.toml")
    run = case.run(tmp_path / "run", progress=False, report=False)
    assert sorted(run.probes) == ["middle", "probe1"]
    middle, line = run.probes["middle"], run.probes["probe1"]
    assert middle["time"].tolist() == [0, 0.01, 0.02]
    assert abs(middle["volume_flux"]).max() < 1e-18
    assert line["point"].dtype == "int64" and len(line) == 11 * 3
    assert line["z"].tolist()[:3] == [0, 0.004, 0.008]
    for name, table in run.probes.items():
        pandas.testing.assert_frame_equal(table, pandas.read_csv(run.path / f"probes/{name}.csv"))


def test_contacts_are_a_frame(case_file, tmp_path):
    case = gw.Case.load(
        case_file,
        {
            "grain.0.position": [2e-3, 2e-3, 0.76e-3],
            "output.contacts": 1e-4,
            "output.wall_events": True,
        },
    )
    run = case.run(tmp_path / "run", progress=False, report=False)
    contacts = run.contacts
    assert list(contacts.columns[:4]) == ["time", "grain", "partner", "x"]
    assert contacts["partner"].dtype == "int64" and set(contacts["partner"]) == {-5}
    assert (contacts["fz"] >= 0).all() and contacts["fz"].max() > 0
    events = run.events
    assert "lower z" in events.loc[events["event"] == "wall-contact", "wall"].tolist()


def test_the_summary_of_a_finished_run(run):
    assert run.finished and run.notes == [] and run.failure is None
    assert run.summary["ended_by"] == "end"
    assert run.provenance["program"] == "grainwake"
    assert run.case().end == pytest.approx(0.02)


def test_coordinates_of_slices_match_the_files(run):
    pytest.importorskip("xarray")
    pyvista = pytest.importorskip("pyvista")
    assert run.planes == ["y-grain0"]
    data = run.slice("10 ms")
    assert set(data.data_vars) == {"velocity", "vorticity", "pressure", "solid_fraction"}
    assert data["velocity"].dims == ("z", "x", "component")
    assert data["velocity"].attrs["units"] == "m/s" and data["x"].attrs["units"] == "m"
    row = run.files[(run.files["group"] == "slice y-grain0") & (run.files["time"] == 0.01)]
    assert data.attrs["time"] == 0.01
    image = pyvista.read(run.path / row["file"].iloc[0])
    centres = image.cell_centers().points
    z, x = np.meshgrid(data["z"], data["x"], indexing="ij")
    assert centres[:, 0] == pytest.approx(x.ravel(), rel=1e-6)
    assert centres[:, 1] == pytest.approx(float(data["y"]), rel=1e-6)
    assert centres[:, 2] == pytest.approx(z.ravel(), rel=1e-6)
    flat = data["velocity"].values.reshape(-1, 3)
    assert (image.cell_data["velocity"] == flat).all()
    assert (image.cell_data["pressure"] == data["pressure"].values.ravel()).all()


def test_pyvista_takes_surfaces_and_fields(run):
    pyvista = pytest.importorskip("pyvista")
    surface = run.surfaces("20 ms")
    assert isinstance(surface, pyvista.PolyData) and surface.is_manifold
    last = run.grain(0).iloc[-1]
    assert surface.center == pytest.approx([last["x"], last["y"], last["z"]], abs=1e-5)
    assert surface.volume == pytest.approx(np.pi / 6 * 1.5e-3**3, rel=0.02)
    assert set(surface.cell_data["grain"]) == {0}
    assert surface.point_data["velocity"][:, 2] == pytest.approx(last["vz"], rel=1e-5)
    field = run.field(0.02)
    assert isinstance(field, pyvista.ImageData)
    assert field.dimensions == (17, 17, 33)
    assert field.bounds == pytest.approx((0, 4e-3, 0, 4e-3, 0, 8e-3))
    volume = run.volume(0.02)
    assert (field.cell_data["pressure"] == volume["pressure"].values.ravel()).all()


def test_the_nearest_time_is_taken(run):
    pytest.importorskip("xarray")
    assert run.slice(0.013).attrs["time"] == 0.01
    assert run.slice("1 s").attrs["time"] == 0.02
    with pytest.raises(gw.CaseError, match='expected one of y-grain0'):
        run.slice(0, plane="z-plane0")
    with pytest.raises(gw.CaseError, match="is a length"):
        run.slice("1 mm")


def test_the_report_is_drawn_again(run):
    (run.path / "report.html").unlink()
    assert run.report() == run.path / "report.html"
    assert run.report().is_file()


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(gw.CaseError, match="holds no run"):
        gw.open(tmp_path)
    with pytest.raises(gw.CaseError, match="holds no run"):
        gw.open_run(tmp_path)
    with pytest.raises(gw.CaseError, match="holds no study; a run is opened with open_run"):
        gw.open_study(tmp_path)
    for opened in (gw.open, gw.open_run, gw.open_study):
        with pytest.raises(FileNotFoundError, match="there is no folder"):
            opened(tmp_path / "none")


@pytest.fixture
def broken(run, tmp_path):
    folder = tmp_path / "broken"
    shutil.copytree(run.path, folder)
    return folder


def test_an_incomplete_folder_opens_as_far_as_it_can(broken):
    (broken / "summary.json").unlink()
    (broken / "diagnostics.csv").unlink()
    shutil.rmtree(broken / "slices")
    table = broken / "grains.csv"
    table.write_text(table.read_text()[:-30])
    with pytest.warns(gw.CaseWarning, match="has not finished"):
        run = gw.open(broken)
    assert not run.finished and run.summary is None
    notes = "\n".join(run.notes)
    assert "diagnostics.csv is missing" in notes and "unfinished and was left out" in notes
    assert len(run.grains) == 10
    with pytest.raises(FileNotFoundError, match="diagnostics.csv is missing"):
        run.diagnostics
    with pytest.raises(FileNotFoundError, match="no slice was left in the folder"):
        run.slice(0)
    assert run.surfaces(0).n_cells > 0


@pytest.mark.parametrize("index", ["", None])
def test_without_an_index_the_vtk_files_tell_their_times(run, broken, index):
    pytest.importorskip("xarray")
    (broken / "run.pvd").unlink() if index is None else (broken / "run.pvd").write_text(index)
    (broken / "slices" / "y-grain0_000001.vti").write_bytes(b"damaged")
    with pytest.warns(gw.CaseWarning, match="run.pvd") as warned:
        again = gw.open(broken)
    # The warning names the folder once.
    assert str(warned[0].message).count(str(broken)) == 1
    assert again.planes == run.planes == ["y-grain0"]
    assert again.slice("20 ms").equals(run.slice("20 ms"))
    assert again.slice("10 ms").attrs["time"] == 0.0
    assert again.surfaces("10 ms").points.tolist() == run.surfaces("10 ms").points.tolist()
    assert again.volume(0).equals(run.volume(0))
    whole = {tuple(row) for row in run.files.itertuples(index=False)}
    left = {tuple(row) for row in again.files.itertuples(index=False)}
    assert whole - left == {(0.01, "slice y-grain0", "slices/y-grain0_000001.vti")}
    assert left <= whole


def test_a_damaged_table_is_located(broken):
    lines = (broken / "grains.csv").read_text().splitlines()
    lines[3] = lines[3].replace(",", ",x", 1)
    (broken / "grains.csv").write_text("\n".join(lines) + "\n")
    with pytest.warns(gw.CaseWarning, match="grains.csv, line 4"):
        run = gw.open(broken)
    with pytest.raises(gw.CaseError, match="grains.csv, line 4"):
        run.grains
    assert len(run.diagnostics) == 11


def test_a_newer_version_is_noted(broken):
    file = broken / "provenance.json"
    content = json.loads(file.read_text())
    content["version"] = "99.0.0"
    file.write_text(json.dumps(content))
    with pytest.warns(gw.CaseWarning, match="made by version 99.0.0"):
        assert len(gw.open(broken).grains) == 11


def test_an_occupied_folder_is_refused(case, run, tmp_path):
    with pytest.raises(gw.CaseError, match="holds a finished run"):
        case.run(run.path, progress=False)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(gw.CaseError, match="holds no run of this program"):
        case.run(tmp_path, progress=False)
    with pytest.raises(gw.CaseError, match="no run to resume"):
        case.run(tmp_path / "new", resume=True, progress=False)


def test_a_folder_that_cannot_be_made_is_an_os_error(case, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises((OSError, gw.CaseError)):
        case.run(tmp_path / "file" / "run", progress=False)


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
def test_an_interrupted_run_resumes_with_the_same_bits(case_file, tmp_path):
    longer = gw.Case.load(case_file, {"time.end": "1 s", "output.fields": 0})
    whole = longer.run(tmp_path / "whole", progress=False, report=False)

    def interrupt(progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        longer.run(tmp_path / "part", progress=interrupt, report=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gw.CaseWarning)
        part = gw.open(tmp_path / "part")
    assert not part.finished and 0 < len(part.grains) < len(whole.grains)
    resumed = longer.run(tmp_path / "part", resume=True, progress=False, report=False)
    assert (resumed.path / "grains.csv").read_bytes() == (whole.path / "grains.csv").read_bytes()
    assert len(resumed.provenance["sessions"]) == 2


@pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")
def test_ctrl_c_writes_a_checkpoint(case_file, tmp_path):
    endless = gw.Case.load(case_file, {"time.end": "1000 s"})
    threading.Timer(1.0, lambda: signal.raise_signal(signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        endless.run(tmp_path / "run", progress=False)
    assert list((tmp_path / "run" / "checkpoint").iterdir())


def test_a_failed_run_raises_solver_error(case_file, tmp_path):
    unstable = gw.Case.load(case_file, {"time.step": "20 ms", "time.end": "1 s"})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gw.CaseWarning)
        with pytest.raises(gw.SolverError, match="last good checkpoint"):
            unstable.run(tmp_path / "run", progress=False)
        failed = gw.open(tmp_path / "run")
    assert "remedy" in failed.failure


def test_warnings_name_the_line_of_the_caller(case_file, tmp_path):
    coarse = gw.Case.load(case_file, {"domain.cell_size": "0.5 mm", "time.end": "1 ms"})
    with pytest.warns(gw.CaseWarning) as warned:
        coarse.run(tmp_path / "run", progress=False, report=False)
    assert warned[0].filename == __file__


def test_warnings_of_a_case_are_warnings(case_file, tmp_path):
    coarse = gw.Case.load(case_file, {"domain.cell_size": "0.5 mm", "time.end": "2 ms"})
    assert coarse.warnings
    with pytest.warns(gw.CaseWarning):
        coarse.run(tmp_path / "run", progress=False, report=False)


def test_a_study_runs_and_opens(case_file, tmp_path):
    study_file = tmp_path / "study.toml"
    study_file.write_text(f"""
title = "Two densities"
base = "{case_file}"
[[axis]]
name = "density"
key = "grain.0.density"
values = [{{ name = "light", value = 1500 }}, {{ name = "heavy", value = 2500 }}]
""")
    study = gw.Study.load(study_file)
    assert study.title == "Two densities" and len(study) == 2
    seen = []
    results = study.run(tmp_path / "study", progress=seen.append)
    assert seen[-1]["done"] == 2
    for wrong, words in [({"jobs": -1}, "jobs: found -1; expected a whole number from 1 on"),
                         ({"jobs": 0}, "jobs: found 0; expected a whole number from 1 on"),
                         ({"threads": -1}, "threads: found -1; expected a whole number from 0 on"),
                         ({"progress": 3}, "progress: found a value of type int"),
                         ({"only": "none*"}, 'only: no run is called "none')]:
        with pytest.raises(gw.CaseError, match=words):
            study.run(tmp_path / "other", **wrong)
    assert not (tmp_path / "other").exists()
    again = pickle.loads(pickle.dumps(study))
    assert again.plan() == study.plan() and again.title == study.title
    with pytest.raises(gw.CaseError, match="900fc4e"):
        study.run(tmp_path / "study", accept=["900fc4e"], progress=False)
    assert results.runs == study.runs
    table = results.table
    assert len(table) == 2 and set(table["state"]) == {"finished"}
    heavy = [name for name in results.runs if "heavy" in name][0]
    assert results.run(heavy).grain(0)["vz"].iloc[-1] < -0.03
    assert len(results.records) == 2
    assert results.report().is_file()
    for opened in (gw.open, gw.open_study):
        assert isinstance(opened(tmp_path / "study"), gw.StudyFolder)
    with pytest.raises(gw.CaseError, match="holds a study, not a run; open it with open_study"):
        gw.open_run(tmp_path / "study")
    with pytest.raises(KeyError, match="there is no run 'x'"):
        results.run("x")
    study_file.write_text("title = 1\n")
    with pytest.raises(gw.CaseError, match="study.toml"):
        gw.Study.load(study_file)


def test_a_failed_run_of_a_study_is_done(case_file, tmp_path):
    study_file = tmp_path / "study.toml"
    study_file.write_text(f"""
title = "A step that is too long"
base = "{case_file}"
[[axis]]
name = "step"
key = "time.step"
values = [{{ name = "long", value = "20 ms", set = {{ "time.end" = "1 s" }} }}]
""")
    seen = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gw.CaseWarning)
        with pytest.raises(gw.SolverError, match="1 of 1 runs failed"):
            gw.Study.load(study_file).run(tmp_path / "study", progress=seen.append)
    assert seen[-1]["done"] == 1


def test_a_validation_has_the_columns_of_the_command_line(root, tmp_path):
    table = gw.validate("rotation/spin-d8", suites=root / "validation", output=tmp_path, progress=False)
    assert {"name", "run", "quantity", "value", "reference", "pass"} <= set(table.columns)
    assert table["pass"].all() and len(table) > 0
    with pytest.raises(gw.CaseError, match='there is no validation "x"'):
        gw.validate("x", suites=root / "validation", output=tmp_path)
    with pytest.raises(gw.CaseError, match='"rotation/spin-d16" is of the level full'):
        gw.validate("rotation/spin-d16", suites=root / "validation", output=tmp_path)
    with pytest.raises(gw.CaseError, match='"rotation" has no run "x"'):
        gw.validate("rotation/x", suites=root / "validation", output=tmp_path)


def test_the_validations_in_the_package_need_no_source_tree(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = gw.validate("contact/bounce", progress=False)
    assert table["pass"].all() and len(table) > 0
    assert {path.name for path in tmp_path.iterdir()} == {"runs"}


def test_a_run_starts_from_a_checkpoint_of_another_run(case_file, run, tmp_path):
    longer = gw.Case.load(case_file, {"time.end": "0.2 s"})
    branch = longer.run(tmp_path / "branch", start_from=run.path, progress=False, report=False)
    parent = branch.provenance["parent"]
    assert parent["case_sha256"] == run.provenance["case_sha256"]
    assert branch.grains["time"].iloc[0] == parent["checkpoint_time"] == run.grains["time"].iloc[-1]
    at = f"{run.path}@10 s"
    timed = longer.run(tmp_path / "timed", start_from=at, progress=False, report=False)
    assert timed.provenance["parent"] == parent
    with pytest.raises(gw.CaseError, match="later end"):
        gw.Case.load(case_file).run(tmp_path / "same", start_from=str(run.path), progress=False)


def test_progress_is_a_bool_or_a_callable(case, tmp_path):
    for wrong in (3, "yes", 0):
        with pytest.raises(gw.CaseError, match="progress: found a value of type .*expected True"):
            case.run(tmp_path / "run", progress=wrong)
    assert not (tmp_path / "run").exists()
    case.run(tmp_path / "run", progress=np.bool_(False), report=False)


def test_listed_files_that_are_missing_are_noted(broken):
    shutil.rmtree(broken / "slices")
    with pytest.warns(gw.CaseWarning, match="slices: 3 of 3 files that run.pvd lists are missing"):
        gw.open(broken)


def test_finished_runs_of_other_overrides_are_not_replaced(case_file, tmp_path):
    study_file = tmp_path / "study.toml"
    study_file.write_text(f"""
title = "Two densities"
base = "{case_file}"
[[axis]]
name = "density"
key = "grain.0.density"
values = [{{ name = "light", value = 1500 }}, {{ name = "heavy", value = 2500 }}]
""")
    folder = tmp_path / "out"
    keys = {"time.end": "4 ms"}
    light, heavy = gw.Study.load(study_file, keys).runs
    results = gw.Study.load(study_file, keys).run(folder, only=light, progress=False)
    files = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    other = gw.Study.load(study_file, {**keys, "fluid.viscosity": "2 mPa s"})
    with pytest.raises(gw.CaseError, match=f"1 finished run .*: {light} .its case has changed.*force"):
        other.run(folder, progress=False)
    later = gw.Study.load(study_file, {"time.end": "6 ms"})
    with pytest.raises(gw.CaseError, match=f"1 finished run .*: {light} "):
        later.run(folder, progress=False)
    assert {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()} == files
    # A run that is not chosen is not replaced, and a finished run of the same overrides is kept.
    other.run(folder, only=heavy, progress=False)
    other.run(folder, progress=False, force=True)
    assert len(results.run(light).grains) and "kinematic_viscosity = 0.000002" in (
        results.run(light).case().resolved
    )
    other.run(folder, progress=False)
