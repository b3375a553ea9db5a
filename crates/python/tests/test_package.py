"""The package: types, docstrings, size and import time."""

import doctest
import pathlib
import subprocess
import sys

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


def test_types_of_a_program_are_checked(tmp_path):
    pytest.importorskip("mypy")
    program = tmp_path / "program.py"
    program.write_text("""
import grainwake as gw

grain = gw.Grain.sphere("1 mm")
case = gw.Case.from_dict({"grain": [grain.at([0, 0, 0], density=2500)]})
run = case.run("out")
if isinstance(run, gw.RunFolder):
    reveal_type(run.notes)
for state in gw.Simulation(case).run(every="1 ms"):
    reveal_type(state.time)
gw.Grain.sphere()
case.rum("out")
""")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", str(program)],
        capture_output=True, text=True, cwd=tmp_path,
    )
    assert 'Revealed type is "list[str]"' in done.stdout.replace("builtins.", ""), done.stdout
    assert 'Revealed type is "float"' in done.stdout.replace("builtins.", "")
    assert 'Missing positional argument "diameter"' in done.stdout
    assert '"Case" has no attribute "rum"' in done.stdout
    assert "Found 2 errors" in done.stdout, done.stdout


def test_the_import_loads_no_optional_package():
    code = ("import sys, grainwake; "
            "print([m for m in ('pandas', 'xarray', 'pyvista', 'tqdm') if m in sys.modules])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_extension_is_small():
    assert pathlib.Path(extension.__file__).stat().st_size < 40e6
