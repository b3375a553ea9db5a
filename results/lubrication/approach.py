#!/usr/bin/env python3
"""Force of the film that the grid resolves, on a sphere that approaches the floor or another sphere.

The spheres have the diameter 1 and approach each other at the prescribed speed 1 (Reynolds number
0.2 relative to it), 8 and 16 cells across. Writes approach.csv with one row per surface, grid and
gap; forces are relative to the exact one (validation/lubrication/reference/series.py):

    grid       force of the fluid on the grid
    whole      with the lubrication force before decision 0030, (1/h - 1/h_0) with h_0 of one cell
    shorter    with the same force for h_0 of 0.6 cells at the floor, 0.3 between spheres
    present    with the force of decision 0030
    s          value of s for which the sum is exact

    python3 results/lubrication/approach.py target/release/grainwake
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
from math import acosh, pi

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "validation/lubrication/reference"))
import series  # noqa: E402

GAPS = [1, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05]
NU = 5.0
GRAIN = """
[[grain]]
shape = {{ kind = "sphere", diameter = 1 }}
density = 1
position = [{x}, {y}, {z}]
motion = {{ velocity = [0, 0, {speed}], angular_velocity = "fixed" }}
"""
CASE = """
title = "Approach"
gravity = [0, 0, 0]
[fluid]
density = 1
kinematic_viscosity = {nu}
[domain]
size = [{size}, {size}, {size}]
cell_size = {cell}
boundaries = {{ x = "slip", y = "slip", z = [{lower}, "slip"] }}
[time]
end = {end}
[output]
tables = {interval}
slices = 0
{grains}
"""


def approach(program, folder, onto, cells):
    """Returns gap and force over 6 pi mu R v, with the speed v of one sphere relative to the middle
    plane or the floor."""
    size, start = (6 if cells == 8 else 4), 2 / cells
    middle = size / 2
    place = {"x": middle + 0.008, "y": middle + 0.018}
    if onto == "floor":
        grains = GRAIN.format(**place, z=0.5 + start, speed=-1)
    else:
        places = [(middle + s * (0.5 + start / 2), -0.5 * s) for s in (1, -1)]
        grains = "".join(GRAIN.format(**place, z=z, speed=speed) for z, speed in places)
    case = CASE.format(
        nu=NU, size=size, cell=1 / cells, end=start - 0.04 / cells, grains=grains,
        lower='"wall"' if onto == "floor" else '"slip"', interval=0.005 / cells,
    )
    path = folder / f"{onto}-{cells}.toml"
    path.write_text(case)
    run = folder / path.stem
    command = [program, "run", path, "-o", run, "--threads", "1", "--no-report", "--quiet"]
    subprocess.run(command, check=True)
    rows = list(csv.DictReader((run / "grains.csv").open()))
    first = [row for row in rows if row["grain"] == "0"]
    if onto == "floor":
        return [(float(r["z"]) - 0.5, float(r["fz"]) / (3 * pi * NU)) for r in first]
    pairs = zip(first, (row for row in rows if row["grain"] == "1"))
    unit = 3 * pi * NU * 0.5
    force = lambda a, b: (float(a["fz"]) - float(b["fz"])) / 2 / unit
    return [(float(a["z"]) - float(b["z"]) - 1, force(a, b)) for a, b in pairs]


def at(points, gap):
    for (a, f), (b, g) in zip(points, points[1:]):
        if b <= gap <= a:
            return g + (f - g) * (gap - b) / (a - b)
    raise ValueError(gap)


def main():
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for onto in ("floor", "sphere"):
            for cells in (8, 16):
                points = approach(sys.argv[1], pathlib.Path(folder), onto, cells)
                for x in GAPS:
                    gap = 2 * x / cells
                    if onto == "floor":
                        exact, share, short = series.series(series.towards_wall, acosh(1 + gap)), 0.35, 0.6
                        scale = cells / 2
                    else:
                        exact = series.series(series.towards_sphere, acosh(1 + gap / 2))
                        share, short, scale = 0.07, 0.3, cells / 4
                    grid = at(points, x / cells)
                    film = lambda seen: scale * max(1 / x - 1 / seen, 0)
                    sums = [grid, grid + film(1), grid + film(max(short, x)), grid + film(x + share * (1 - x))]
                    missing = (exact - grid) / scale
                    seen = 1 / (1 / x - missing)
                    s = (seen - x) / (1 - x) if x < 1 else float("nan")
                    rows.append([onto, cells, x, *(f"{v / exact:.3f}" for v in sums), f"{s:.3f}"])
    with (HERE / "approach.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow("surface cells gap_cells grid whole shorter present s".split())
        writer.writerows(rows)


if __name__ == "__main__":
    main()
