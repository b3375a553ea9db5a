"""Measures the overhead of stepping from Python: a loop over `Simulation.step` that reads the
motion after each step, against one call of `advance_to`, on the same case and steps.

Run it by hand: python crates/python/tests/step_overhead.py [CASE.toml] [STEPS] [REPEATS]
"""

import sys
import time

import grainwake as gw

path = sys.argv[1] if len(sys.argv) > 1 else "cases/dkt-pair/quick.toml"
count = int(sys.argv[2]) if len(sys.argv) > 2 else 200
repeats = int(sys.argv[3]) if len(sys.argv) > 3 else 5
case = gw.Case.load(path)
probe = gw.Simulation(case)
for _ in range(count):
    probe.step()
end = probe.time


def in_one_call():
    sim = gw.Simulation(case)
    started = time.process_time(), time.perf_counter()
    sim.advance_to(end)
    return sim.steps, time.process_time() - started[0], time.perf_counter() - started[1]


def step_by_step():
    sim = gw.Simulation(case)
    started = time.process_time(), time.perf_counter()
    while sim.time < end * (1 - 1e-9):
        sim.step(end - sim.time)
        sim.positions, sim.velocities, sim.forces
    return sim.steps, time.process_time() - started[0], time.perf_counter() - started[1]


runs = [(in_one_call(), step_by_step()) for _ in range(repeats)]
steps = runs[0][0][0]
assert all(one[0] == each[0] == steps for one, each in runs)
for name, column in (("processor time", 1), ("wall time", 2)):
    one = min(run[0][column] for run in runs)
    each = min(run[1][column] for run in runs)
    print(f"{name}: {steps} steps in one call {one:.3f} s, step by step {each:.3f} s, "
          f"overhead {100 * (each / one - 1):+.2f} %")
