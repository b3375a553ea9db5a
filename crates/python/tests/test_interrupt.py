"""Ctrl-C during work before the first step: scans and cases."""

import signal
import sys
import threading
import time

import numpy as np
import pytest

import grainwake as gw

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no signals of this kind")


def interrupted(work, after):
    """Sends SIGINT to the main thread during `work`; returns the time that it took to end [s]."""
    sender = threading.Timer(after, lambda: signal.raise_signal(signal.SIGINT))
    sender.start()
    started = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
        return time.monotonic() - started - after
    finally:
        sender.cancel()
        sender.join()


def test_an_interrupt_ends_a_scan():
    image = np.zeros((100, 100, 200), np.uint8)
    z, y, x = np.mgrid[:100, :100, :200]
    for label, (i, j, k) in enumerate(np.ndindex(4, 2, 5), 1):
        square = ((x - 25 - 50 * i) / 20) ** 2 + ((y - 25 - 50 * j) / 20) ** 2
        image[square + ((z - 10 - 20 * k) / 8) ** 2 < 1] = label
    # The 40 grains take longer than 10 s in all.
    assert interrupted(lambda: gw.scan(image, voxel="20 um"), 0.3) < 5


# Random places at this solid fraction take minutes.
PACKING = {
    "count": 600,
    "shapes": [{"kind": "capsule", "diameter": "0.4 mm", "height": "0.8 mm"}],
    "density": 2650,
    "arrangement": "random",
}
BOX = {"size": ["6 mm"] * 3, "cell_size": "0.1 mm"}
WATER = {"density": 1000, "viscosity": "1 mPa s"}


def test_an_interrupt_ends_a_packing():
    make = lambda: gw.Case.new(**BOX, end="1 ms", fluid=WATER, packing=[PACKING])
    assert interrupted(make, 0.5) < 5


def test_an_interrupt_ends_the_reading_of_a_study(tmp_path):
    (tmp_path / "case.toml").write_text("""
domain = { size = ["6 mm", "6 mm", "6 mm"], cell_size = "0.1 mm" }
fluid = { density = 1000, viscosity = "1 mPa s" }
time = { end = "1 ms" }
[[packing]]
count = 600
shapes = [{ kind = "capsule", diameter = "0.4 mm", height = "0.8 mm" }]
density = 2650
arrangement = "random"
""")
    study = tmp_path / "study.toml"
    study.write_text("""
title = "Two ends"
base = "case.toml"
[[axis]]
name = "end"
key = "time.end"
values = [{ name = "short", value = "1 ms" }, { name = "long", value = "2 ms" }]
""")
    assert interrupted(lambda: gw.Study.load(study), 0.5) < 5
