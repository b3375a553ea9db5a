#!/usr/bin/env python3
"""Force of the film that the grid resolves, on a sphere that approaches a floor or another sphere.

The spheres have the diameter 1 and approach each other at the prescribed speed 1 (Reynolds number
0.2 relative to it), 8 and 16 cells across. Writes approach.csv with one row per surface, grid and
gap; forces are relative to the exact one (validation/lubrication/reference/series.py):

    grid       force of the fluid on the grid
    whole      with the lubrication force before decision 0030, (1/h - 1/h_0) with h_0 of one cell
    shorter    with the same force for h_0 of 0.6 cells at the floor, 0.3 between spheres
    wall       with the force of decision 0030, but at a slip floor that of a no-slip floor
    present    with the force of decision 0030
    s          value of s for which the sum is exact

A slip floor is a plane of symmetry: the exact force is that between the sphere and its mirror
image, whose gap is twice as wide. `whole` and `shorter` there have the force of a no-slip floor.

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
    lower = {"floor": '"wall"', "slip floor": '"slip"', "sphere": '"slip"'}[onto]
    middle = size / 2
    place = {"x": middle + 0.008, "y": middle + 0.018}
    if onto != "sphere":
        grains = GRAIN.format(**place, z=0.5 + start, speed=-1)
    else:
        places = [(middle + s * (0.5 + start / 2), -0.5 * s) for s in (1, -1)]
        grains = "".join(GRAIN.format(**place, z=z, speed=speed) for z, speed in places)
    case = CASE.format(
        nu=NU, size=size, cell=1 / cells, end=start - 0.04 / cells, grains=grains,
        lower=lower, interval=0.005 / cells,
    )
    path = folder / f"{onto.replace(' ', '-')}-{cells}.toml"
    path.write_text(case)
    run = folder / path.stem
    command = [program, "run", path, "-o", run, "--threads", "1", "--no-report", "--quiet"]
    subprocess.run(command, check=True)
    rows = list(csv.DictReader((run / "grains.csv").open()))
    first = [row for row in rows if row["grain"] == "0"]
    if onto != "sphere":
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


# Thickness of the film over the gap, force of a film of one cell over 6 pi mu R v and the cells per
# diameter, s, and the shorter h_0 [cells].
SURFACES = {
    "floor": (1, 1 / 2, 0.35, 0.6),
    "slip floor": (2, 1 / 4, 0.35, 0.6),
    "sphere": (1, 1 / 4, 0.07, 0.3),
}


def compare(onto, cells, gap, points):
    """Returns the forces at a gap [cells] over the exact one, and s."""
    thickness, strength, share, shorter = SURFACES[onto]
    half = (2 if onto == "sphere" else 1) * (cells / 2)
    law = series.towards_wall if onto == "floor" else series.towards_sphere
    exact = series.series(law, acosh(1 + gap / half))
    grid = at(points, gap / cells)
    film, scale = thickness * gap, strength * cells
    lubrication = lambda h, seen, scale: scale * max(1 / h - 1 / max(seen, h), 0)
    # The former force had the resistance of a no-slip wall.
    former = scale if onto == "sphere" else cells / 2
    sums = [
        grid,
        grid + lubrication(gap, 1, former),
        grid + lubrication(gap, shorter, former),
        grid + lubrication(gap, gap + share * (1 - gap), former),
        grid + lubrication(film, film + share * (1 - film), scale),
    ]
    seen = 1 / (1 / film - (exact - grid) / scale)
    s = (seen - film) / (1 - film) if film < 1 else float("nan")
    return [*(f"{v / exact:.3f}" for v in sums), f"{s:.3f}"]


def main():
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for onto in SURFACES:
            for cells in (8, 16):
                points = approach(sys.argv[1], pathlib.Path(folder), onto, cells)
                for gap in GAPS:
                    rows.append([onto, cells, gap, *compare(onto, cells, gap, points)])
    with (HERE / "approach.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow("surface cells gap_cells grid whole shorter wall present s".split())
        writer.writerows(rows)


if __name__ == "__main__":
    main()
