#!/usr/bin/env python3
"""Kills runs and studies (SIGKILL) at random moments and resumes them.

After every kill a copy of the folder is resumed to its end and compared with an undisturbed run:
every file is bitwise identical, except for the wall times and the provenance. The killed folder itself
is resumed and killed up to five times in a row.

    .ci/kill_test.py [--kills 1000] [--seed N] [--work DIR] [--program FILE]
    .ci/kill_test.py --study STUDY.toml [--set KEY=VALUE ...]

Without --study, small cases are run: a wet one, a dry one and a study of five runs. With --work the
script keeps its progress in DIR, and the same command goes on after an interruption. A failure
prints the seed and keeps the folders.
"""

import argparse
import csv
import json
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent

WET = """
title = "wet"
[fluid]
density = 1000
viscosity = "5 mPa s"
[domain]
size = ["4 mm", "4 mm", "12 mm"]
cell_size = "0.5 mm"
boundaries = { x = "periodic", y = "periodic" }
[contact]
stiffness = 100
[time]
end = "20 ms"
[output]
tables = "1 ms"
slices = "4 ms"
fields = "10 ms"
contacts = "2 ms"
checkpoint_steps = 3
[[probe]]
name = "middle"
point = ["1 mm", "1 mm", "2 mm"]
every = "1 ms"
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 100
density = 2500
position = ["2 mm", "2 mm", "1.1 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 100
density = 2500
position = ["2.1 mm", "2 mm"]
gap_above = { grain = 0, gap = "0.2 mm" }
"""

DRY = """
title = "dry"
[domain]
size = ["10 mm", "10 mm", "30 mm"]
[contact]
stiffness = 200
[time]
end = "40 ms"
step = "0.1 ms"
[output]
tables = "1 ms"
surfaces = "10 ms"
wall_events = true
checkpoint_steps = 20
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 100
density = 2500
position = ["5 mm", "5 mm", "2 mm"]
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 100
density = 2500
position = ["5.2 mm", "5 mm", "5 mm"]
velocity = [0, 0, "-0.2 m/s"]
"""

STUDY = """
title = "small study"
base = "dry.toml"
[[axis]]
name = "weight"
key = ["grain.0.density", "grain.1.density"]
values = [
  { name = "light", value = 2000, factors = { density = 2000 } },
  { name = "heavy", value = 4000, factors = { density = 4000 } },
]
[[axis]]
name = "grip"
values = [
  { name = "smooth", set = { "contact.friction" = 0 } },
  { name = "rough", set = { "contact.friction" = 0.6 } },
]
[[model]]
name = "alone"
set = { "grain.1.velocity" = [0, 0, 0] }
"""


def settled(name, data):
    """Returns the content of a file without wall times; None if it may differ."""
    base = name.rsplit("/", 1)[-1]
    if base in ("provenance.json", "run.lock", "report.html") or base.endswith(".lock"):
        return None
    if base == "summary.json":
        return {**json.loads(data), "wall_s": 0, "cpu_s": 0, "passes": []}
    if base == "table.json":
        return [{**row, "wall_s": 0, "threads": 0} for row in json.loads(data)]
    if base == "table.csv":
        rows = csv.DictReader(data.decode().splitlines())
        return [{**row, "wall_s": 0, "threads": 0} for row in rows]
    return data


def contents(folder):
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    named = ((str(path.relative_to(folder)), path.read_bytes()) for path in files)
    found = {name: settled(name, data) for name, data in named}
    return {name: data for name, data in found.items() if data is not None}


def difference(whole, found):
    """Describes how two folders differ; empty if they do not."""
    missing, more = sorted(whole.keys() - found.keys()), sorted(found.keys() - whole.keys())
    changed = sorted(name for name in whole.keys() & found.keys() if whole[name] != found[name])
    parts = (("missing", missing), ("more", more), ("changed", changed))
    return "; ".join(f"{what}: {', '.join(names)}" for what, names in parts if names)


class Job:
    """Run or study that is killed."""

    def __init__(self, program, source, work, extra):
        self.name, self.work = source.stem, work
        self.study = "[[axis]]" in source.read_text() or "[[model]]" in source.read_text()
        self.command = [program, "study" if self.study else "run", str(source), "--quiet", *extra]
        if not self.study:
            self.command += ["--resume-or-start", "--no-report"]
        whole = work / f"{self.name}-whole"
        shutil.rmtree(whole, ignore_errors=True)
        begin = time.monotonic()
        self.to_end(whole)
        self.length = time.monotonic() - begin
        self.whole = contents(whole)

    def start(self, folder):
        return subprocess.Popen(
            [*self.command, "-o", str(folder)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def to_end(self, folder):
        child = self.start(folder)
        _, message = child.communicate()
        if child.returncode:
            sys.exit(f"{' '.join(child.args)}: exit code {child.returncode}\n{message}")

    def check(self, folder, what):
        self.to_end(folder)
        found = contents(folder)
        if self.study:
            # Other programs may share the folder of a study, so none removes what was left there.
            found = {k: v for k, v in found.items() if "/" in k or not k.endswith(".tmp")}
        differs = difference(self.whole, found)
        if differs:
            sys.exit(f"{self.name}, {what}: {folder} differs from {self.name}-whole: {differs}")


def killed(job, folder, after):
    """Starts the job and kills it after a time [s]; False if it had ended before."""
    child = job.start(folder)
    time.sleep(after)
    child.kill()
    _, message = child.communicate()
    if child.returncode > 0:
        sys.exit(f"{' '.join(child.args)}: exit code {child.returncode}\n{message}")
    return child.returncode < 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--work", type=pathlib.Path)
    parser.add_argument("--program", default=str(ROOT / "target/release/grainwake"))
    parser.add_argument("--study", type=pathlib.Path)
    parser.add_argument("--set", action="append", default=[])
    args = parser.parse_args()

    work = args.work or pathlib.Path(tempfile.mkdtemp(prefix="kill-test-"))
    work.mkdir(parents=True, exist_ok=True)
    state_file = work / "progress.json"
    seed = args.seed or random.SystemRandom().randrange(1 << 32)
    state = {"seed": seed, "chains": 0, "kills": 0}
    if state_file.exists():
        state = json.loads(state_file.read_text())
    print(f"seed {state['seed']}, {state['kills']} kills before, folder {work}", flush=True)

    extra = [word for value in args.set for word in ("--set", value)]
    if args.study:
        sources = [args.study]
    else:
        sources = [work / name for name in ("wet.toml", "dry.toml", "study.toml")]
        for source, text in zip(sources, (WET, DRY, STUDY)):
            source.write_text(text)
    jobs = [Job(args.program, source, work, extra) for source in sources]
    for job in jobs:
        print(f"{job.name}: {len(job.whole)} files in {job.length:.2f} s", flush=True)

    begin = time.monotonic()
    while state["kills"] < args.kills:
        # Each chain of kills has its own generator, so that the script can go on anywhere.
        chain = random.Random(f"{state['seed']}/{state['chains']}")
        state["chains"] += 1
        job = chain.choice(jobs)
        folder, copy = work / f"{job.name}-killed", work / f"{job.name}-copy"
        shutil.rmtree(folder, ignore_errors=True)
        for _ in range(min(chain.randint(1, 5), args.kills - state["kills"])):
            what = f"seed {state['seed']}, kill {state['kills']}"
            if killed(job, folder, chain.uniform(0, job.length)):
                state["kills"] += 1
                if state["kills"] % 50 == 0:
                    print(f"{state['kills']} kills, {time.monotonic() - begin:.0f} s", flush=True)
            else:
                # The machine is faster than at the start.
                job.length = max(0.9 * job.length, 0.02)
            shutil.rmtree(copy, ignore_errors=True)
            if folder.exists():
                shutil.copytree(folder, copy)
            job.check(copy, what)
        job.check(folder, f"seed {state['seed']}, chain before kill {state['kills']}")
        state_file.write_text(json.dumps(state))
    print(f"{state['kills']} kills, seed {state['seed']}: every folder resumed to bitwise identical results")
    if not args.work:
        shutil.rmtree(work)


main()
