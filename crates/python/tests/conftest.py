"""Fixtures: the repository, the command line, and a small run."""

import os
import pathlib
import signal
import subprocess

import pytest

import grainwake as gw

ROOT = pathlib.Path(__file__).resolve().parents[3]

SMALL = """
title = "Small sphere"

[fluid]
density = "1000 kg/m3"
viscosity = "1 mPa s"

[domain]
size = ["4 mm", "4 mm", "8 mm"]
cell_size = "0.25 mm"

[[grain]]
shape = { kind = "sphere", diameter = "1.5 mm" }
density = "2000 kg/m3"
position = ["2 mm", "2 mm", "6 mm"]

[time]
end = "20 ms"

[output]
tables = "2 ms"
slices = "10 ms"
fields = "10 ms"
surfaces = "10 ms"
"""


@pytest.fixture(scope="session", autouse=True)
def interruptible():
    """Ctrl-C raises KeyboardInterrupt, also in a background job whose shell ignores it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def cli():
    """Runs the command line; GRAINWAKE_CLI names the program."""
    default = ROOT / "target" / "release" / "grainwake"
    program = pathlib.Path(os.environ.get("GRAINWAKE_CLI", default))
    if not program.is_file():
        pytest.fail(f"{program} is missing: cargo build --release, or set GRAINWAKE_CLI")

    def run(*arguments, code=0, cwd=None):
        done = subprocess.run(
            [program, *map(str, arguments)], capture_output=True, text=True, cwd=cwd
        )
        assert done.returncode == code, done.stderr
        return done

    return run


@pytest.fixture(scope="session")
def case_file(tmp_path_factory):
    file = tmp_path_factory.mktemp("case") / "small.toml"
    file.write_text(SMALL)
    return file


@pytest.fixture
def case(case_file):
    return gw.Case.load(case_file)


@pytest.fixture
def sim(case):
    return gw.Simulation(case)


@pytest.fixture(scope="session")
def run(case_file, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "small"
    return gw.Case.load(case_file).run(folder, progress=False)
