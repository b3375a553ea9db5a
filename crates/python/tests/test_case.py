"""Cases: construction, and the words of the command line for refused input."""

import copy
import pickle
import re
import subprocess
import sys

import numpy as np
import pytest

import grainwake as gw

BAD = {
    "a wrong unit": ("[fluid]\ndensity = 1000\nviscosity = \"1 mm\"\n", None),
    "an unknown key": ("[fluid]\ndensty = 1000\n", None),
    "an unknown table": ("[flud]\ndensity = 1000\n", None),
    "no TOML": ("[fluid\n", None),
    "a missing table": ("title = \"nothing\"\n", None),
    "a missing file": ("[domain]\nsize = [1, 1, 1]\ncell_size = 0.1\n[time]\nend = 1\n"
                       "[[grain]]\nfile = \"none.grain\"\ndensity = 2000\n"
                       "position = [0.5, 0.5, 0.5]\n", None),
    "a wrong override": ("[domain]\nsize = [1, 1, 1]\ncell_size = 0.1\n[time]\nend = 1\n",
                         "time.end=2 kg"),
}


# Options and commands in the messages of the command line, and their names in Python.
PYTHON = {
    "[--set:": "[overrides:",
    "`grainwake schema`": "Case.schema()",
    "`grainwake grain from-scan`, `from-mesh` or `make`": "Grain.save",
}


@pytest.mark.parametrize("name", BAD)
def test_refused_cases_have_the_words_of_the_command_line(name, tmp_path, cli, monkeypatch):
    text, override = BAD[name]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text(text)
    settings = ["--set", override] if override else []
    told = cli("check", "bad.toml", *settings, code=2, cwd=tmp_path).stderr
    with pytest.raises(gw.CaseError) as refused:
        gw.Case.load("bad.toml", [override] if override else None)
    for phrase, other in PYTHON.items():
        told = told.replace(phrase, other)
    assert str(refused.value).strip() == told.strip()
    assert refused.value.problems and refused.value.problems[0].message in told.replace("\n", " ")


def test_a_problem_has_its_place(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text("[fluid]\ndensity = 1000\nviscosity = \"1 mm\"\n"
                    "[domain]\nsize = [1, 1, 1]\ncell_size = 0.1\n[time]\nend = 1\n")
    with pytest.raises(gw.CaseError) as refused:
        gw.Case.load(file)
    problem = refused.value.problems[0]
    assert (problem.key, problem.line, problem.column) == ("fluid.viscosity", 3, 13)
    assert problem.file == str(file)
    assert isinstance(refused.value, ValueError)


def test_a_missing_case_file_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError, match="cannot read the case file"):
        gw.Case.load(tmp_path / "none.toml")


def test_overrides_are_a_dict_or_strings(case_file):
    by_dict = gw.Case.load(case_file, {"time.end": "5 ms", "grain.0.density": 2500})
    by_list = gw.Case.load(case_file, ["time.end=5 ms", "grain.0.density=2500"])
    assert by_dict.resolved == by_list.resolved
    assert by_dict.end == 0.005
    position = gw.Case.load(case_file, {"grain.0.position": np.array([2e-3, 2e-3, 5e-3])})
    assert "0.005" in position.resolved
    for removed in ({"fluid.viscosity": None, "fluid.kinematic_viscosity": 2e-6},
                    ["-fluid.viscosity", "fluid.kinematic_viscosity=2e-6"]):
        assert "kinematic_viscosity = 0.000002" in gw.Case.load(case_file, removed).resolved
    with pytest.raises(gw.CaseError, match="no such key"):
        gw.Case.load(case_file, {"time.speed": None})
    with pytest.raises(gw.CaseError, match="found a string"):
        gw.Case.load(case_file, "time.end=1")


def test_a_dict_gives_the_case_of_its_file(case_file):
    from_file = gw.Case.load(case_file)
    from_dict = gw.Case.from_dict({
        "title": "Small sphere",
        "fluid": {"density": np.float64(1000), "viscosity": "1 mPa s"},
        "domain": {"size": ("4 mm", "4 mm", "8 mm"), "cell_size": "0.25 mm", "cells": None},
        "grain": [{
            "shape": {"kind": "sphere", "diameter": "1.5 mm"},
            "density": "2000 kg/m3",
            "position": ["2 mm", "2 mm", "6 mm"],
        }],
        "time": {"end": "20 ms"},
        "output": {"tables": "2 ms", "slices": "10 ms", "fields": "10 ms", "surfaces": "10 ms"},
    })
    assert from_dict.digest == from_file.digest
    assert from_dict.resolved == from_file.resolved
    assert gw.Case.from_toml(from_file.resolved).digest == from_file.digest


def test_a_problem_of_a_dict_quotes_its_toml():
    tables = {"domain": {"size": [1, 1, 1], "cell_size": "0.1 kg"}, "time": {"end": 1}}
    with pytest.raises(gw.CaseError) as refused:
        gw.Case.from_dict(tables)
    assert refused.value.problems[0].key == "domain.cell_size"
    assert 'cell_size = "0.1 kg"' in str(refused.value)


def test_messages_name_arguments_of_python(case_file, run, tmp_path):
    case = gw.Case.load(case_file)
    keys = {"domain": {"size": [1, 1, 1], "cell_size": 0.1}, "time": {"end": 1}}
    longer = gw.Case.load(case_file, {"time.end": "1 s"})
    for call, words in [
        (lambda: case.run(run.path, progress=False), "another folder, or replace it with force=True"),
        (lambda: case.run(tmp_path / "new", resume=True, progress=False),
         "leave out resume=True, or give the run folder"),
        (lambda: longer.run(tmp_path / "new", start_from=tmp_path, progress=False),
         'for example start_from="runs/heap" or, with the time of the checkpoint, start_from="runs'),
        (lambda: longer.run(tmp_path / "new", start_from="x@1 kg", progress=False),
         "start_from=x@1 kg: "),
        (lambda: gw.Case.load(case_file, ["time.end"]),
         'override time.end: there is no `=`.*write "key=value", for example "time.end=0.5" or'),
        (lambda: gw.Case.load(case_file, {"time.speed": None}), "None for time.speed: the case has"),
        (lambda: gw.Case.load(case_file, {"time.ends": 1}), r"\[overrides:1:6\]"),
        (lambda: gw.Case.from_dict({**keys, "grain": {"density": 1}}),
         "give a list of dicts for `grain`"),
        (lambda: gw.Case.from_dict({**keys, "fluid": [{"density": 1}]}), "give one dict for `fluid`"),
        (lambda: gw.Case.from_dict(keys), "add `fluid` or `grain`"),
        (lambda: gw.Case.from_dict({**keys, "grain": [
            {"file": "none.grain", "density": 1, "position": [0.5, 0.5, 0.5]}]}),
         "paths are relative to `folder`; make a grain file with Grain.save"),
    ]:
        with pytest.raises(gw.CaseError, match=f"(?s){words}") as refused:
            call()
        # The text of a dict is quoted as TOML.
        for problem in refused.value.problems:
            words = f"{problem.message} {problem.help} {problem.file}"
            assert not re.search(r"--[a-z]|\[\[|`grainwake", words), words


def test_every_option_in_a_message_of_the_libraries_has_a_python_name(root):
    """Options in string literals of the libraries, except in comments and tests."""
    known = (root / "crates/python/src/words.rs").read_text()
    missing = {}
    for library in ("formats", "report", "run", "shape", "solver", "study", "validation"):
        for file in (root / "crates" / library / "src").rglob("*.rs"):
            code = file.read_text().split("#[cfg(test)]")[0]
            lines = [line for line in code.splitlines() if not line.lstrip().startswith("//")]
            for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", "\n".join(lines)):
                if file.name != "tests.rs" and option not in known:
                    missing[option] = str(file.relative_to(root))
    assert not missing


def pebbles(folder):
    """Case with grain files of two folders, whose order differs from that of their names."""
    for name, axis in (("b/one", "1.5 mm"), ("a/two", "1.4 mm")):
        file = folder / f"{name}.grain"
        file.parent.mkdir(parents=True)
        gw.Grain.ellipsoid(axis, "1.2 mm", "1 mm", cells=24).save(file)
    text = """
title = "Two pebbles"
[fluid]
density = 1000
viscosity = "1 mPa s"
[domain]
size = ["4 mm", "4 mm", "8 mm"]
cell_size = "0.25 mm"
[[grain]]
file = "b/one.grain"
density = 2000
position = ["2 mm", "2 mm", "6 mm"]
[[grain]]
file = "a/two.grain"
density = 2500
gap_above = { grain = 0, gap = "0.1 mm" }
[time]
end = "1 s"
stop = "landing"
"""
    (folder / "case.toml").write_text(text)
    return gw.Case.load(folder / "case.toml", {"time.end": "10 ms"})


def test_a_case_survives_pickling_without_its_files(tmp_path):
    case = pebbles(tmp_path)
    content = pickle.dumps(case)
    for name in ("case.toml", "b/one.grain", "a/two.grain"):
        (tmp_path / name).unlink()
    for again in (pickle.loads(content), copy.deepcopy(case)):
        assert again.digest == case.digest and again.resolved == case.resolved
        assert again.grains == case.grains and again.warnings == case.warnings
        assert (again.title, again.end, again.cells) == (case.title, 0.01, case.cells)
        assert again.estimate(1) == case.estimate(1)
    before, after = gw.Simulation(case), gw.Simulation(pickle.loads(content))
    for sim in (before, after):
        sim.advance_to("2 ms")
    assert (before.positions == after.positions).all() and before.steps == after.steps


def test_a_case_goes_to_a_process_of_its_own(case, tmp_path):
    script = tmp_path / "script.py"
    script.write_text("""
import multiprocessing
import pickle
import sys
import grainwake as gw

def speed(case):
    sim = gw.Simulation(case, threads=1)
    sim.advance_to("2 ms")
    return sim.velocities[0, 2]

if __name__ == "__main__":
    case = pickle.load(sys.stdin.buffer)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        print(pool.map(speed, [case])[0] == speed(case) < 0)
""")
    done = subprocess.run(
        [sys.executable, script], input=pickle.dumps(case), capture_output=True, check=True
    )
    assert done.stdout.split() == [b"True"]


def endless():
    tables = {}
    tables["time"] = tables
    return tables


class Twin:
    def tolist(self):
        return self


@pytest.mark.parametrize("tables, words", [
    (endless(), "more than 32 lists or dicts inside each other"),
    ({"time": {"end": Twin()}}, "time.end: found a value of type Twin"),
    ({"time": {"end": object()}}, "time.end: found a value of type object"),
    ({"time": {"end": [1, None]}}, "time.end.1: found None"),
    ({"time": {1: 2}}, "time: the key 1 is not a string"),
    ({1: 2}, "^the key 1 is not a string"),
    ({"time": {"end": 2**70}}, "is too large"),
    ({"grain": [{"shape": gw.Grain.sphere("1 mm")}]}, "stands for the key `file`"),
])
def test_a_value_without_toml_is_refused(tables, words):
    with pytest.raises(gw.CaseError, match=words):
        gw.Case.from_dict(tables)


def test_a_refinement_is_a_whole_number():
    with pytest.raises(gw.CaseError, match="refinement: found -1; expected a whole number from 1"):
        gw.Case.new(size=["4 mm"] * 3, cell_size="1 mm", end="1 s", refinement=-1)


def test_a_table_that_is_no_dict_is_refused():
    with pytest.raises(gw.CaseError, match="time: found a value of type int; expected a dict"):
        gw.Case.new(size=["4 mm"] * 3, cell_size="1 mm", end="1 s", time=3)


@pytest.mark.parametrize("more, words", [
    ({"domain": {"cells": [2, 2, 2]}}, "domain: its keys are arguments"),
    ({"time": {"end": 9}}, "time.end: found beside end"),
    ({"grain": [], "grains": []}, "grain: found beside grains"),
])
def test_a_table_does_not_replace_arguments(more, words):
    with pytest.raises(gw.CaseError, match=words):
        gw.Case.new(size=["4 mm"] * 3, cell_size="1 mm", end="1 s", **more)


def test_a_case_of_keywords():
    pebble = gw.Grain.ellipsoid("2 mm", "1.6 mm", "1.2 mm", cells=32)
    case = gw.Case.new(
        size=["8 mm", "8 mm", "12 mm"],
        cell_size="0.5 mm",
        fluid={"density": 1000, "viscosity": "1 mPa s"},
        grains=[
            pebble.at(["4 mm", "4 mm", "8 mm"], density="1500 kg/m3"),
            pebble.at(["4 mm", "4 mm", "4 mm"], density=2000, velocity=[0, 0, "1 mm/s"]),
        ],
        boundaries={"x": "periodic", "y": "periodic"},
        end="50 ms",
        time={"stop": "landing"},
        contact={"restitution": 0.2},
        title="Two pebbles",
    )
    assert case.cells == (16, 16, 24)
    assert case.grains == [pebble, pebble]
    assert case.title == "Two pebbles" and case.end == 0.05
    assert "restitution = 0.2" in case.resolved
    estimate = case.estimate(1)
    assert estimate["cells"] == 16 * 16 * 24
    assert isinstance(case.warnings, list)


def test_the_schema_lists_the_tables():
    assert {"fluid", "domain", "grain"} <= set(gw.Case.schema()["properties"])
