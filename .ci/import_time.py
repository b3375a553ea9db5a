#!/usr/bin/env python3
"""Measures the import of grainwake in new interpreters; fails if the best of five exceeds the
bound [s]."""

import subprocess
import sys
import time

bound = float(sys.argv[1])


def measure(code):
    started = time.perf_counter()
    subprocess.run([sys.executable, "-I", "-c", code], check=True)
    return time.perf_counter() - started


measure("import grainwake")
best = min(measure("import grainwake") for _ in range(5))
start = min(measure("pass") for _ in range(5))
print(f"python: import in {best - start:.3f} s")
if best - start > bound:
    sys.exit(f"the import takes longer than {bound} s")
