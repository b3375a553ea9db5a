#!/usr/bin/env python3
"""Makes the small pictures of the gallery (docs/assets/gallery) from committed results.

Pictures whose source is a run folder are made only if the run exists; `docs/gallery.md` has the
commands. Needs Pillow. `--check` verifies that every picture exists and is at most 120 kB.
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
TARGET = ROOT / "docs/assets/gallery"
SIZE = 900
LIMIT = 120_000
PICTURES = {
    "pair-speed": "results/dkt-pair/figures/speed.png",
    "pair-vorticity": "results/dkt-pair/figures/vorticity.png",
    "pair-paths": "results/dkt-pair/figures/trajectories.png",
    "quick-speed": "results/dkt-pair/quick/figures/speed.png",
    "family": "studies/dkt-morphology/grains/sheet.png",
    "kissing-time": "results/dkt-morphology/figures/fig14a-kissing-time.png",
    "scan": "results/scans/nmc-sheet.png",
    "ten-cate": "results/validation/figures/ten-cate-velocity.png",
    "wake": "results/validation/figures/fixed-sphere-wake-re500.png",
    "sphere-pair": "results/validation/figures/sphere-pair-velocity.png",
    "cavity": "results/validation/figures/cavity-u.png",
    "rebound": "results/validation/figures/wet-bounce-height.png",
    "taylor-green": "results/validation/figures/fluid-dissipation-re1600.png",
    "suspension": "runs/periodic-suspension/figures/speed.png",
    "suspension-dense": "runs/suspension-150/figures/speed.png",
    "heap": "runs/sandpile/figures/positions.png",
    "permeability": "runs/permeability/figures/speed.png",
}


def check():
    wrong = []
    for name, source in PICTURES.items():
        path = TARGET / f"{name}.jpg"
        if not path.is_file():
            wrong.append(f"{path.relative_to(ROOT)} is missing")
        elif path.stat().st_size > LIMIT:
            wrong.append(f"{path.relative_to(ROOT)} has more than {LIMIT} bytes")
        if not source.startswith("runs/") and not (ROOT / source).is_file():
            wrong.append(f"{source} is missing")
    page = (ROOT / "docs/gallery.md").read_text(encoding="utf-8")
    wrong += [f"gallery.md does not show {name}" for name in PICTURES if f"{name}.jpg" not in page]
    if wrong:
        sys.exit("\n".join(wrong))


def main():
    from PIL import Image

    TARGET.mkdir(parents=True, exist_ok=True)
    for name, source in PICTURES.items():
        if not (ROOT / source).is_file():
            print(f"{name}: kept, there is no {source}")
            continue
        with Image.open(ROOT / source) as picture:
            picture = picture.convert("RGB")
            picture.thumbnail((SIZE, SIZE), Image.Resampling.LANCZOS)
            path = TARGET / f"{name}.jpg"
            for quality in (82, 75, 68):
                picture.save(path, quality=quality, optimize=True, progressive=True)
                if path.stat().st_size <= LIMIT:
                    break


if __name__ == "__main__":
    check() if "--check" in sys.argv else main()
