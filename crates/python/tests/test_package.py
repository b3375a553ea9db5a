"""The package: types, docstrings, size and import time."""

import doctest
import pathlib
import re
import subprocess
import sys
import warnings

import pytest

import grainwake as gw
import grainwake._grainwake as extension


def test_every_public_name_has_a_docstring():
    classes = [gw.Grain, gw.Case, gw.Simulation, gw.Scan, gw.Study, gw.RunFolder, gw.StudyFolder]
    for name in gw.__all__:
        if name not in ("__version__", "commit"):
            assert getattr(gw, name).__doc__, name
    for each in classes:
        for name, member in vars(each).items():
            if not name.startswith("_"):
                assert member.__doc__, f"{each.__name__}.{name}"


def test_docstrings_give_parameters():
    for each in (gw.Grain.from_mesh, gw.Case.load, gw.Simulation.set_load, gw.scan, gw.open):
        assert "Parameters\n" in each.__doc__


@pytest.mark.parametrize("name", ["Grain", "Case", "Simulation"])
def test_examples_of_docstrings_run(name):
    tests = doctest.DocTestFinder().find(getattr(extension, name), name)
    examples = [test for test in tests if test.examples]
    assert examples
    for test in examples:
        assert doctest.DocTestRunner().run(test).failed == 0


def test_types_of_a_script_are_checked(tmp_path):
    pytest.importorskip("mypy")
    script = tmp_path / "script.py"
    script.write_text("""
import pathlib
import numpy as np
import grainwake as gw

grain = gw.Grain.sphere("1 mm")
case = gw.Case.from_dict({"grain": [grain.at([0, 0, 0], density=2500)]})
run = case.run("out", start_from=pathlib.Path("runs/x"))
reveal_type(run.notes)
reveal_type(gw.open_run("out").grain(np.int64(0)))
reveal_type(gw.open_study("out").runs)
gw.Grain.superquadric(1, 1, 1, exponents=[1, 1], nodes=np.int64(9))
sim = gw.Simulation(case)
for index in np.arange(2):
    sim.set_load(index, force=sim.forces[index])
for state in sim.run(every="1 ms"):
    reveal_type(state.time)
gw.Grain.sphere()
case.rum("out")
""")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", str(script)],
        capture_output=True, text=True, cwd=tmp_path,
    )
    revealed = done.stdout.replace("builtins.", "")
    assert revealed.count('Revealed type is "list[str]"') == 2, done.stdout
    assert 'Revealed type is "pandas.core.frame.DataFrame"' in revealed, done.stdout
    assert 'Revealed type is "float"' in revealed
    assert 'Missing positional argument "diameter"' in done.stdout
    assert '"Case" has no attribute "rum"' in done.stdout
    assert "Found 2 errors" in done.stdout, done.stdout


def test_types_admit_what_a_script_may_pass(tmp_path):
    pytest.importorskip("mypy")
    script = tmp_path / "script.py"
    script.write_text("""
import numpy as np
import grainwake as gw

size = np.float32(2e-3)
grains = [gw.Grain.sphere(size), gw.Grain.family(np.float32(0.7), np.float32(0.5), size)]
case = gw.Case.new(
    size=(8e-3, np.float32(8e-3), "8 mm"),
    end=np.int64(1),
    boundaries="periodic",
    grains=(
        grain.at(np.array([x, 4e-3, 4e-3], dtype=np.float32), density=np.float32(2500))
        for x, grain in zip([2e-3, 6e-3], grains)
    ),
)
gw.Case.new(size=["8 mm"] * 3, end="1 s", cells=[16, 16, np.int64(16)])
gw.Case.new(size=["8 mm"] * 3, end="1 s", cells=np.array([16, 16, 16]), boundaries={"x": "slip"})
case = case.with_overrides({"grain.0.file": grains[1], "time.end": np.float32(2)})
sim = gw.Simulation(case)
sim.set_load(0, force=np.array([0, 0, 1]))
sim.step(np.float32(1e-6))
gw.Grain.superquadric(size, size, size, exponents=np.array([1, 1]))
gw.scan(np.zeros((9, 9, 9)), voxel=size, threshold=np.float32(3), separate=np.float32(0.9))
gw.open_run("out").slice(np.float32(1e-3))
gw.Study.load("study.toml").run("out", force=True)
""")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", str(script)],
        capture_output=True, text=True, cwd=tmp_path,
    )
    assert done.returncode == 0, done.stdout


def test_the_first_example_of_the_manual_has_no_warning(root, capsys):
    page = (root / "docs" / "python.md").read_text()
    example = re.search(r"```python\n(.*?)```", page, re.DOTALL).group(1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(example, {})
    assert "vertical velocity" in capsys.readouterr().out


def test_the_import_loads_no_optional_package():
    code = ("import sys, grainwake; "
            "print([m for m in ('pandas', 'xarray', 'pyvista', 'tqdm') if m in sys.modules])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_extension_is_small():
    assert pathlib.Path(extension.__file__).stat().st_size < 40e6
