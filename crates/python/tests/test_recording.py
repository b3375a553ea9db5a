"""Simulations that Python steps and that write a run folder."""

import json
import shutil

import numpy as np
import pytest

import grainwake as gw

pytest.importorskip("pandas")

BITS = ("grains.csv", "diagnostics.csv", "events.jsonl", "run.pvd", "case.resolved.toml")


def lift(sim, weights):
    """Pushes the grain upwards with a multiple of its mass times gravity."""
    sim.set_load(0, force=[0, 0, weights * 9.81 * sim.masses[0]])


def test_without_control_the_folder_has_the_bits_of_the_command_line(
    case_file, case, cli, tmp_path
):
    folder = tmp_path / "cli"
    cli("run", case_file, "-o", folder, "--quiet")
    for name, advance in {
        "steps": lambda sim: [sim.step() for _ in iter(lambda: sim.time < 0.02 * (1 - 1e-9), False)],
        "states": lambda sim: list(sim.run(progress=False)),
        "advance": lambda sim: sim.advance_to("20 ms"),
    }.items():
        sim = gw.Simulation(case, output=tmp_path / name)
        assert sim.output == tmp_path / name
        advance(sim)
        run = sim.finish()
        files = [*BITS, *(f"slices/{f.name}" for f in (folder / "slices").iterdir()),
                 *(f"fields/{f.name}" for f in (folder / "fields").iterdir())]
        assert len(files) >= 8
        for file in files:
            assert (run.path / file).read_bytes() == (folder / file).read_bytes(), (name, file)
        assert run.finished and (run.path / "report.html").is_file()
        assert run.provenance["controlled_from"] == "Python"
        assert run.provenance["case_sha256"] == gw.open(folder).provenance["case_sha256"]
    assert "controlled_from" not in gw.open(folder).provenance


def test_a_time_beside_an_output_takes_no_short_step(tmp_path):
    grain = gw.Grain.sphere("2 mm").at(["3 mm", "3 mm", "4 mm"], density=1500)
    case = gw.Case.new(
        size=["6 mm"] * 3, cell_size="0.25 mm", end="20 ms", grains=[grain],
        fluid={"density": 1000, "viscosity": "10 mPa s"}, output={"tables": "3.3333 ms"},
    )
    with gw.Simulation(case, output=tmp_path / "run") as sim:
        states = list(sim.run(every=1 / 300, progress=False))
    assert [state.time for state in states] == pytest.approx([n / 300 for n in range(7)])
    times = gw.open(tmp_path / "run").grain(0).index
    assert list(times) == pytest.approx([n / 300 for n in range(7)], abs=1e-6)


def test_control_shows_in_the_tables(case, run, tmp_path):
    with gw.Simulation(case, output=tmp_path / "run") as sim:
        sim.advance_to("10 ms")
        lift(sim, 2)
        seen = list(sim.run(progress=False))
    controlled = gw.open(tmp_path / "run")
    free, table = run.grain(0), controlled.grain(0)
    assert controlled.finished and len(table) == len(free) == 11
    # Up to the change the rows are those of the free grain; afterwards it goes up.
    assert (table.iloc[:6] == free.iloc[:6]).all(axis=None)
    assert free["vz"].iloc[-1] < -0.02 < 0.01 < table["vz"].iloc[-1]
    in_memory = gw.frame(seen)
    assert np.array_equal(in_memory["vz"], table["vz"].iloc[5:])
    # The simulation is closed, but can still be read.
    assert sim.time == pytest.approx(0.02) and sim.output == tmp_path / "run"
    for call in (sim.step, sim.checkpoint, sim.finish, lambda: sim.set_load(0),
                 lambda: sim.set_velocity(0, [0, 0, 0]),
                 lambda: sim.prescribe_motion(0, [0, 0, 0]), lambda: sim.release(0)):
        with pytest.raises(gw.CaseError, match="the run folder is closed: continue it with"):
            call()


def test_a_controlled_run_resumes_in_python_to_the_same_bits(case, tmp_path):
    def to_the_end(sim):
        lift(sim, 1.5)
        sim.advance_to("20 ms")
        return sim.finish(report=False)

    whole = to_the_end(gw.Simulation(case, output=tmp_path / "whole"))
    folder = tmp_path / "parts"
    with pytest.raises(ZeroDivisionError), gw.Simulation(case, output=folder) as sim:
        lift(sim, 1.5)
        # An output time: the steps up to it are those of the whole run.
        sim.advance_to("8 ms")
        1 / 0
    at = sim.time
    assert not gw.open(folder).finished and at == pytest.approx(8e-3)
    again = gw.Simulation(case, output=folder, resume=True)
    assert again.time == at and again.steps == sim.steps
    parts = to_the_end(again)
    for name in BITS:
        assert (parts.path / name).read_bytes() == (whole.path / name).read_bytes(), name
    assert [each["from_step"] for each in parts.provenance["sessions"]] == [0, sim.steps]
    # A run that is finished before the end of its case goes on as well.
    early = gw.Simulation(case, output=tmp_path / "early")
    lift(early, 1.5)
    early.advance_to("8 ms")
    assert early.finish(report=False).summary["end_time_s"] == pytest.approx(8e-3)
    goes_on = to_the_end(gw.Simulation(case, output=tmp_path / "early", resume=True))
    assert (goes_on.path / "grains.csv").read_bytes() == (whole.path / "grains.csv").read_bytes()


def test_only_python_resumes_a_controlled_run(case_file, case, cli, tmp_path):
    folder = tmp_path / "run"
    with gw.Simulation(case, output=folder) as sim:
        lift(sim, 2)
        sim.advance_to("4 ms")
    before = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    refused = cli("run", case_file, "-o", folder, "--resume", "--quiet", code=2).stderr
    assert "was controlled from Python: continue it there" in " ".join(refused.split())
    with pytest.raises(gw.CaseError, match="was controlled from Python"):
        case.run(folder, resume=True, progress=False)
    assert before == {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    # A run of the command line that Python goes on with becomes a controlled one.
    free = tmp_path / "free"
    cli("run", case_file, "-o", free, "--quiet", "--set", "time.end=4 ms")
    longer = gw.Case.load(free / "case.resolved.toml", {"time.end": "20 ms"})
    sim = gw.Simulation(longer, output=free, resume=True)
    assert sim.time == pytest.approx(4e-3)
    sim.checkpoint()
    assert json.loads((free / "provenance.json").read_text())["controlled_from"] == "Python"


def test_wrong_folders_and_calls_are_refused(case_file, case, run, tmp_path):
    for call, words in [
        (lambda: gw.Simulation(case, output=run.path), "holds a finished run"),
        (lambda: gw.Simulation(case, output=run.path, resume=True), "later end, or replace it"),
        (lambda: gw.Simulation(case, output=tmp_path / "none", resume=True), "none"),
        (lambda: gw.Simulation(case, resume=True), "give output="),
        (lambda: gw.Simulation(case, force=True), "give output="),
        (gw.Simulation(case).finish, "there is no run folder: give"),
        (gw.Simulation(case).checkpoint, "there is no run folder: give"),
    ]:
        with pytest.raises(gw.CaseError, match=words):
            call()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("notes")
    with pytest.raises(gw.CaseError, match="give one of them"):
        gw.Simulation(case, output=tmp_path / "new", force=True, resume=True)
    for more in ({}, {"force": True}):
        with pytest.raises(gw.CaseError, match="mine.*holds no run of this program"):
            gw.Simulation(case, output=tmp_path / "mine", **more)
    folder = tmp_path / "run"
    sim = gw.Simulation(case, output=folder)
    sim.step()
    with pytest.raises(gw.CaseError, match="another run .* is writing into"):
        gw.Simulation(case, output=folder, force=True)
    sim.save_checkpoint(tmp_path / "state.ckpt")
    with pytest.raises(gw.CaseError, match="resume=True"):
        sim.restore_checkpoint(tmp_path / "state.ckpt")
    sim.finish(report=False)
    denser = gw.Case.load(case_file, {"grain.0.density": 2500})
    with pytest.raises(gw.CaseError, match="made from another case .*density: 2000"):
        gw.Simulation(denser, output=folder, resume=True)
    gw.Simulation(denser, output=folder, force=True).advance_to("2 ms")
    assert "2500" in (folder / "case.resolved.toml").read_text()


def test_nothing_is_stepped_beyond_the_end_of_the_case(case, tmp_path):
    with gw.Simulation(case, output=tmp_path / "run") as sim:
        with pytest.raises(gw.CaseError, match="the case ends at t = 20 ms.*give it a later end"):
            sim.advance_to("30 ms")
        assert sim.time == pytest.approx(0.02)
    assert len(gw.open(tmp_path / "run").grains) == 11


def test_walls_have_the_numbers_of_the_table(tmp_path):
    case = gw.Case.new(
        size=["4 mm", "4 mm", "4 mm"],
        cell_size="0.25 mm",
        grains=[gw.Grain.sphere("1 mm").at(["3.499 mm", "0.501 mm", "2 mm"], density=2500,
                                           velocity=[0.1, -0.1, 0])],
        gravity=[0, 0, 0],
        end="1 ms",
        time={"step": "1 us"},
        output={"contacts": "10 us"},
    )
    seen = {}
    with gw.Simulation(case, output=tmp_path / "run") as sim:
        while not sim.ended:
            sim.step()
            contacts = sim.contacts()
            acting = contacts["partner"][contacts["overlap"] > 0]
            if len(acting):
                seen[round(sim.time, 7)] = acting.tolist()
    # Upper x and lower y.
    table = gw.open_run(tmp_path / "run").contacts
    assert set(table["partner"]) == {-2, -3}
    for time, rows in table.groupby("time"):
        assert rows["partner"].tolist() == seen[round(time, 7)]


def test_arrays_of_fields_do_not_hold_up_the_end(case, tmp_path):
    with gw.Simulation(case, output=tmp_path / "run") as sim:
        sim.step()
        shown = sim.fluid_velocity("z")
        with pytest.raises(BufferError):
            sim.step()
    assert gw.open(tmp_path / "run").finished and shown.min() < 0


def test_a_failed_step_keeps_the_last_checkpoint_and_unlocks_the_folder(case_file, tmp_path):
    keys = {"time.step": "20 ms", "time.end": "1 s", "output.checkpoint_steps": 1}
    unstable = gw.Case.load(case_file, keys)
    folder = tmp_path / "run"
    with pytest.raises(gw.SolverError, match="became unstable.*\n.*last good checkpoint"):
        with gw.Simulation(unstable, output=folder) as sim:
            sim.advance_to("1 s")
    assert gw.open(folder).failure["step"] == sim.steps and not gw.open(folder).finished
    with pytest.raises(gw.SolverError, match="cannot be continued"):
        sim.finish()
    assert gw.Simulation(unstable, output=folder, resume=True).steps < sim.steps


def test_a_stop_condition_ends_a_run_as_it_does_in_case_run(case_file, tmp_path):
    keys = {"time.end": "1 s", "time.step": "0.5 ms", "grain.0.position": ["2 mm", "2 mm", "1 mm"],
            "time.stop": {"when": "landing", "hold": "1 ms"}}
    case = gw.Case.load(case_file, keys)
    free = case.run(tmp_path / "free", progress=False, report=False)
    landing = free.summary["grains"][0]["landing_time_s"]
    assert free.summary["ended_by"] == "landing" and 0 < landing < 0.02

    def own_loop(sim):
        while not sim.ended:
            sim.step()

    loops = {"states": lambda sim: list(sim.run(progress=False)), "own": own_loop}
    for name, advance in loops.items():
        sim = gw.Simulation(case, output=tmp_path / name)
        assert sim.ended is None
        advance(sim)
        assert sim.ended == "landing" and 0.001 <= sim.time - landing < 0.002
        run = sim.finish(report=False)
        assert sim.ended == "landing" and run.summary["ended_by"] == "landing"
        for file in BITS:
            assert (run.path / file).read_bytes() == (free.path / file).read_bytes(), (name, file)
        with pytest.raises(gw.CaseError, match="holds a finished run"):
            gw.Simulation(case, output=tmp_path / name, resume=True)

    # In memory as well, also after a checkpoint between the landing and the end.
    sim = gw.Simulation(case)
    sim.advance_to(landing + 5e-4)
    sim.save_checkpoint(tmp_path / "state.ckpt")
    again = gw.Simulation(case)
    again.restore_checkpoint(tmp_path / "state.ckpt")
    for each in (sim, again):
        assert each.ended is None
        last = list(each.run(progress=False))[-1]
        assert each.ended == "landing" and 0.001 <= last.time - landing < 0.002
        # `run` has nothing left to do, a step of the script is still possible.
        assert [state.time for state in each.run(progress=False)] == [last.time]
        each.step()
        assert each.time > last.time
    assert sim.time == again.time and np.array_equal(sim.positions, again.positions)


def test_a_run_ends_at_the_end_of_its_case(case, tmp_path):
    sim = gw.Simulation(case)
    sim.advance_to("10 ms")
    assert sim.ended is None
    sim.advance_to("20 ms")
    assert sim.ended == "end"
    # In memory the end of the case is no bound.
    assert [state.time for state in sim.run(until="22 ms", every="2 ms", progress=False)][1:] == [
        pytest.approx(0.022)]


def test_a_folder_that_cannot_be_written_leaves_the_state_sound(case, tmp_path):
    sim = gw.Simulation(case, output=tmp_path / "run")
    sim.advance_to("5 ms")
    shutil.rmtree(tmp_path / "run")
    with pytest.raises(OSError, match="cannot write") as first:
        sim.advance_to("12 ms")
    for again in (sim.step, sim.checkpoint, sim.finish, lambda: sim.set_load(0)):
        with pytest.raises(OSError) as repeated:
            again()
        assert type(repeated.value) is type(first.value)
        assert str(first.value) in str(repeated.value)
        assert "save_checkpoint keeps the present state" in str(repeated.value)
    assert not sim.ended and 0.005 < sim.time <= 0.012
    # The state goes on in another place, with the bits of a run without the failure.
    sim.save_checkpoint(tmp_path / "kept")
    other = gw.Simulation(case)
    other.restore_checkpoint(tmp_path / "kept")
    assert (other.time, other.steps) == (sim.time, sim.steps)
    whole = gw.Simulation(case, output=tmp_path / "whole")
    whole.advance_to("5 ms")
    whole.advance_to("12 ms")
    other.advance_to("12 ms")
    assert np.array_equal(other.positions, whole.positions)


def test_a_failed_finish_is_repeated(case, tmp_path):
    sim = gw.Simulation(case, output=tmp_path / "run")
    sim.step()
    shutil.rmtree(tmp_path / "run")
    for _ in range(2):
        with pytest.raises(OSError, match="cannot"):
            sim.finish()
    sim.save_checkpoint(tmp_path / "kept")
