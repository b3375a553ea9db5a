"""Measures how dry grains of rough shape come to rest; writes one row per run to standard output.

    python3 results/dry-rocks/measure.py target/release/grainwake

Runs: "rest", a rock with damping and friction; "energy", the same rock without them; "heap"; "roll",
an ellipsoid on a slope.
Value: rms speed in the last sixth (rest) and tenth (heap) of the run [m/s], the largest relative
change of the energy between two bounces in 0.2 s (energy), or the relative error of the speed of
rolling after 0.3 s (roll; number: slope in degrees). The heap also has its processor time [s].
"""

import csv
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
GRAVITY, HEIGHT = 9.81, 0.6e-3


def run(program, case, folder, settings):
    """Runs `case` on one thread and returns its folder."""
    command = [program, "run", str(HERE / case), "-o", folder, "--force", "--quiet", "--no-report"]
    overrides = [word for setting in settings for word in ("--set", setting)]
    subprocess.run([*command, "--threads", "1", *overrides], check=True)
    return Path(folder)


def table(folder, name):
    """Columns of a table as lists of numbers; an empty cell is nan."""
    with open(folder / name, newline="") as file:
        rows = list(csv.DictReader(file))
    return {key: [float(row[key] or "nan") for row in rows] for key in rows[0]}


def orientation(n):
    axis = [math.sin(1.3 * n), math.cos(2.1 * n), math.sin(3.7 * n + 1.0)]
    axis = ", ".join(f"{x:.4f}" for x in axis)
    return f'grain.0.orientation = {{ axis = [{axis}], angle = "{40 * n + 15} deg" }}'


def rms(values):
    return math.sqrt(sum(x * x for x in values) / len(values))


def rest(program, folder, n):
    grains = table(run(program, "rock.toml", folder, [orientation(n)]), "grains.csv")
    speed = [math.hypot(*v) for v in zip(grains["vx"], grains["vy"], grains["vz"])]
    return rms(speed[5 * len(speed) // 6 :])


def energy(program, folder, n):
    undamped = ["contact.friction = 0", "contact.restitution = 1", "time.end = 0.2"]
    run_folder = run(program, "rock.toml", folder, [orientation(n), *undamped])
    grains, total = table(run_folder, "grains.csv"), table(run_folder, "diagnostics.csv")
    with open(run_folder / "summary.json") as file:
        grain = json.load(file)["grains"][0]
    mass = grain["density"] * math.pi / 6 * grain["equivalent_diameter_m"] ** 3
    height = {f"{t:.6f}": z for t, z in zip(grains["time"], grains["z"])}
    changes = [0.0]
    columns = zip(total["time"], total["grain_kinetic_energy"], total["contacts"])
    for time, kinetic, contacts in columns:
        z = height.get(f"{time:.6f}")
        if z is not None and contacts == 0:
            changes.append(abs((kinetic / (mass * GRAVITY) + z) / HEIGHT - 1.0))
    return max(changes)


def heap(program, folder, seed):
    run_folder = run(program, "heap.toml", folder, [f"packing.0.seed = {seed}"])
    with open(run_folder / "summary.json") as file:
        summary = json.load(file)
    grains = table(run_folder, "grains.csv")
    last = [t >= 0.135 for t in grains["time"]]
    speed = [math.hypot(*v) for v in zip(grains["vx"], grains["vy"], grains["vz"])]
    return rms([v for v, late in zip(speed, last) if late]), summary["cpu_s"]


def roll(program, folder, degrees):
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    slope = f"gravity = [{GRAVITY * sine}, 0, {-GRAVITY * cosine}]"
    grains = table(run(program, "rolling.toml", folder, [slope]), "grains.csv")
    # Moment of inertia about the long axis 2/5 m r^2, as of a sphere.
    return grains["vx"][-1] / (5 / 7 * GRAVITY * sine * 0.3) - 1


def main(program):
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True)
    print(f"# {version.stdout.strip()}")
    print("run,number,value,cpu_s")
    with tempfile.TemporaryDirectory() as folder:
        for n in range(12):
            print(f"rest,{n},{rest(program, folder, n):.2e},", flush=True)
        for n in range(6):
            print(f"energy,{n},{energy(program, folder, n):.3f},", flush=True)
        for seed in (1, 2):
            value, cpu = heap(program, folder, seed)
            print(f"heap,{seed},{value:.2e},{cpu:.1f}", flush=True)
        for degrees in (0.5, 1, 2, 3, 6, 10):
            print(f"roll,{degrees},{roll(program, folder, degrees):.3f},", flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
