"""List the source files of which a time step of two touching grains runs code.

    cargo build --profile profiling
    python3 results/step-files/measure.py target/profiling/grainwake > results/step-files/files.csv

Valgrind counts the instructions of runs of 4 and of 7 steps; addr2line names the sources of those
that the three further steps have executed, inlined functions included. Run it in the root of the
project, for the program built there.
"""

import csv
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

CASE = Path(__file__).parent / "case.toml"
CONTROL = """sim/step.rs sim/stages.rs sim/fluid.rs flow/nested.rs immersed/schedule.rs
dem/motion/mod.rs dem/motion/substeps.rs flow/mod.rs poisson/mod.rs""".split()
LEFT_OUT = {
    "opt-in feature": "flow/open_boundary.rs immersed/open_sides.rs",
    "stopwatch": "math/pool_clock.rs math/time_spent.rs sim/timing.rs",
    "assertion of debug builds": "grid/borrowed.rs immersed/access_log.rs",
    "set-up": "sim/mod.rs immersed/mod.rs dem/search/patch_layout.rs dem/search/patch_tree.rs",
}
SOLVER = Path("crates/solver/src").resolve()


def executed(program, steps, folder):
    """Return how often each instruction of the program was executed."""
    out = Path(folder) / f"callgrind.{steps}"
    bench = [program, "bench", CASE, "--threads", "1", "--warm-up", "0", "--steps", str(steps)]
    tool = ["valgrind", "--tool=callgrind", "--dump-instr=yes", f"--callgrind-out-file={out}"]
    run = [*tool, *bench, "--instructions", "avx2"]
    subprocess.run(run, check=True, capture_output=True)
    counts, names, own, of_call, address = Counter(), {}, False, False, 0
    for line in out.read_text().splitlines():
        if found := re.match(r"(c?ob)=\((\d+)\)(?: (.*))?$", line):
            kind, number, name = found.groups()
            names.setdefault(number, name)
            if kind == "ob":
                own = names[number].endswith(Path(program).name)
        elif line.startswith("calls="):
            of_call = True
        elif found := re.match(r"(0x[0-9a-f]+|[+-]\d+|\*) \S+ (\d+)$", line):
            step = found[1]
            if step.startswith("0x"):
                address = int(step, 16)
            elif step != "*":
                address += int(step)
            if own and not of_call:
                counts[address] += int(found[2])
            of_call = False
    return counts


def product_lines(path):
    """Return the number of lines of a source file without its unit tests."""
    count, tests = 0, False
    lines = path.read_text().splitlines()
    for here, following in zip(lines, [*lines[1:], ""]):
        tests |= here == "#[cfg(test)]" and "mod " in following and following.endswith("{")
        count += not tests
        tests &= here != "}"
    return count


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        few, many = (executed(program, steps, folder) for steps in (4, 7))
    addresses = [address for address, count in many.items() if count > few[address]]
    query = "\n".join(map(hex, addresses))
    lines = subprocess.run(
        ["addr2line", "-i", "-e", program], input=query, check=True, capture_output=True, text=True
    ).stdout
    found = (re.match(r"(.+):([1-9]\d*)", line) for line in lines.splitlines())
    places = {place[1] for place in found if place}
    files = sorted(path for path in map(Path, places) if path.is_relative_to(SOLVER))
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["file", "lines", "part"])
    for path in files:
        name = str(path.relative_to(SOLVER))
        part = "control flow" if name in CONTROL else "below it"
        for reason, others in LEFT_OUT.items():
            part = reason if name in others.split() else part
        table.writerow([name, product_lines(path), part])


if __name__ == "__main__":
    main(sys.argv[1])
