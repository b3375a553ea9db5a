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
    with pytest.raises(KeyboardInterrupt):
        work()
    sender.join()
    return time.monotonic() - started - after


def test_an_interrupt_ends_a_scan():
    image = np.zeros((100, 100, 200), np.uint8)
    z, y, x = np.mgrid[:100, :100, :200]
    for label, (i, j, k) in enumerate(np.ndindex(4, 2, 5), 1):
        square = ((x - 25 - 50 * i) / 20) ** 2 + ((y - 25 - 50 * j) / 20) ** 2
        image[square + ((z - 10 - 20 * k) / 8) ** 2 < 1] = label
    # The 40 grains take longer than 10 s in all.
    assert interrupted(lambda: gw.scan(image, voxel="20 um"), 0.3) < 5


def test_an_interrupt_ends_a_packing():
    rod = {"kind": "capsule", "diameter": "0.4 mm", "height": "0.8 mm"}
    packing = {"count": 600, "shapes": [rod], "density": 2650, "arrangement": "random"}
    # Random places at this solid fraction take minutes.
    ended = interrupted(
        lambda: gw.Case.new(size=["6 mm"] * 3, cell_size="0.1 mm", end="1 ms",
                            fluid={"density": 1000, "viscosity": "1 mPa s"}, packing=[packing]),
        0.5,
    )
    assert ended < 5
