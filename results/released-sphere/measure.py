#!/usr/bin/env python3
"""Start of a sphere that is released, or thrown, at several resolutions.

added-mass.csv: added mass over the displaced mass at a vanishing viscosity, from the acceleration
between 0.5 and 1 ms. Potential flow in unbounded fluid gives 0.5; the box adds a few percent.

light-sphere.csv: speed of a light sphere in water over that of the Basset-Boussinesq-Oseen
equation (Stokes drag, added mass 0.5, history force).

thrown.csv: a sphere in water at rest that starts at 0.15 m/s, with both values of `coupling.start`:
speed at the start and after a quarter of a diameter. No gravity.

    cargo build --release
    python3 results/released-sphere/measure.py target/release/grainwake
"""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
GRAVITY, DIAMETER = 9.81, 2e-3


def speeds(program, cells, *settings):
    """Times [s], speeds [m/s] and heights [m] of the sphere."""
    settings = [f'domain.cell_size="{2 / cells} mm"', *settings]
    sets = [word for setting in settings for word in ("--set", setting)]
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "run"
        command = [program, "run", HERE / "sphere.toml", "-o", out, "--quiet", "--no-report", *sets]
        subprocess.run(command, check=True)
        with (out / "grains.csv").open() as file:
            return [[abs(float(row[key])) for key in ("time", "vz", "z")]
                    for row in csv.DictReader(file)]


def at(rows, time):
    return min(rows, key=lambda row: abs(row[0] - time))[1]


def added_mass(program, cells):
    step = "0.1 ms" if cells == 32 else "0.05 ms"
    rows = speeds(program, cells, f'time.step="{step}"')
    acceleration = (at(rows, 1e-3) - at(rows, 0.5e-3)) / 0.5e-3
    return 1.5 * GRAVITY / acceleration - 2.5


def thrown(program, cells, start):
    """Speeds [m/s] at the start and after a quarter of a diameter."""
    water = ['fluid.kinematic_viscosity="1e-6 m2/s"', "gravity=[0, 0, 0]", 'time.end="5 ms"']
    box = ['domain.size=["10 mm","10 mm","10 mm"]', 'output.tables="0.25 ms"']
    place = ['grain.0.position=["5.01 mm","5.02 mm","6 mm"]',
             'grain.0.velocity=[0, 0, "-0.15 m/s"]']
    rows = speeds(program, cells, *water, *box, *place, f'coupling.start="{start}"')
    way = 0.25 * DIAMETER
    for (_, before, high), (_, after, low) in zip(rows, rows[1:]):
        fallen = [rows[0][2] - z for z in (high, low)]
        if fallen[1] >= way:
            part = (way - fallen[0]) / (fallen[1] - fallen[0])
            return rows[0][1], before + part * (after - before)
    raise SystemExit("the sphere has not moved a quarter of a diameter")


def basset(ratio, nu, end, steps=4000):
    """Speeds [m/s] after each of `steps` equal steps to `end` [s]."""
    a, dt = DIAMETER / 2, end / steps
    displaced, mu = 4 / 3 * math.pi * a**3 * 1000, 1000 * nu
    drive = abs(1 - ratio) * GRAVITY * displaced
    history, drag = 6 * a * a * math.sqrt(math.pi * 1000 * mu), 6 * math.pi * mu * a
    weight = [2 * (math.sqrt((k + 1) * dt) - math.sqrt(k * dt)) for k in range(steps)]
    acceleration, speed = [], [0.0]
    for i in range(steps):
        past = sum(acceleration[k] * weight[i - k] for k in range(i))
        mass = (ratio + 0.5) * displaced + history * weight[0]
        acceleration.append((drive - drag * speed[i] - history * past) / mass)
        speed.append(speed[i] + acceleration[i] * dt)
    return speed


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    with (HERE / "added-mass.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["cells", "added_mass_over_displaced_mass"])
        for cells in (8, 16, 32):
            table.writerow([cells, f"{added_mass(program, cells):.3f}"])
    exact = basset(0.1, 1e-6, 8e-3, 2000)
    with (HERE / "light-sphere.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["density_ratio", "cells", "time_s", "speed_over_exact"])
        for cells in (8, 16):
            light = ["grain.0.density=100", 'fluid.kinematic_viscosity="1e-6 m2/s"']
            box = ['domain.size=["8 mm","8 mm","16 mm"]', 'time.end="8 ms"']
            place = 'grain.0.position=["4.01 mm","4.02 mm","8.1 mm"]'
            rows = speeds(program, cells, *light, *box, place)
            for time in (2e-3, 4e-3, 8e-3):
                ratio = at(rows, time) / exact[round(time / 8e-3 * 2000)]
                table.writerow([0.1, cells, time, f"{ratio:.3f}"])
    with (HERE / "thrown.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["start", "cells", "first_speed_m_s", "speed_after_quarter_diameter_m_s"])
        for start in ("impulsive", "released"):
            for cells in (8, 16, 24):
                first, later = thrown(program, cells, start)
                table.writerow([start, cells, f"{first:.4f}", f"{later:.4f}"])


main()
