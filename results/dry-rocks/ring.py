"""Measures the energy of an undamped sphere on a fixed ring; writes one row per run.

    python3 results/dry-rocks/ring.py target/release/grainwake

The ring is a torus with radii of 1 mm and 0.3 mm. Value: largest relative change of the energy
of the sphere in free flight, between its bounces in 0.1 s.
"""

import csv
import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
RADII, COUNTS, START = (1.0, 0.3), (48, 24), 1.3e-3


def write_torus(path):
    """Writes the torus as an STL file, lengths in mm."""

    def point(i, j):
        u, v = 2 * math.pi * i / COUNTS[0], 2 * math.pi * j / COUNTS[1]
        across = RADII[0] + RADII[1] * math.cos(v)
        return across * math.cos(u), across * math.sin(u), RADII[1] * math.sin(v)

    with open(path, "w") as file:
        file.write("solid torus\n")
        for i in range(COUNTS[0]):
            for j in range(COUNTS[1]):
                a, b, c, d = point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)
                for face in (a, b, c), (a, c, d):
                    file.write("facet normal 0 0 0\nouter loop\n")
                    file.writelines("vertex {} {} {}\n".format(*corner) for corner in face)
                    file.write("endloop\nendfacet\n")
        file.write("endsolid torus\n")


def changes(folder):
    """Relative changes of the energy of the sphere in free flight."""
    with open(folder / "grains.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["grain"] == "1"]
    for row in rows:
        number = {key: float(row[key]) for key in ("z", "vx", "vy", "vz", "contacts")}
        speed = sum(number[key] ** 2 for key in ("vx", "vy", "vz"))
        height = number["z"] - 6e-3
        if number["contacts"] == 0:
            yield (0.5 * speed + 9.81 * height) / (9.81 * START) - 1


def main(program):
    print("substeps_per_contact,largest_change")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_torus(folder / "torus.stl")
        shutil.copy(HERE / "ring.toml", folder)
        make = [program, "grain", "from-mesh", folder / "torus.stl", "--unit", "mm"]
        subprocess.run([*make, "-o", folder / "ring.grain"], check=True, capture_output=True)
        for substeps in (25, 50, 200):
            run = [program, "run", folder / "ring.toml", "-o", folder / "run", "--force", "--quiet"]
            more = ["--no-report", "--set", f"contact.substeps_per_contact={substeps}"]
            subprocess.run([*run, *more, "--threads", "1"], check=True)
            found = list(changes(folder / "run"))
            print(f"{substeps},{max(found):.4f}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
