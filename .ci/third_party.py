#!/usr/bin/env python3
"""Prints the licences of all crates in the program with their texts, and that of three.js.

Reads the sources that cargo has fetched. Fails if a crate comes without a licence text, unless its
licence is one whose text another crate provides word for word.
"""

import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TEXT = re.compile(r"^(licen[sc]e|copying|copyright|notice|unlicense|ofl)", re.IGNORECASE)


def cargo(*arguments):
    done = subprocess.run(["cargo", *arguments], check=True, capture_output=True, cwd=ROOT)
    return done.stdout.decode()


def texts(folder):
    """Licence files beside the manifest, or one folder below it."""
    found = [path for path in sorted(folder.glob("*")) + sorted(folder.glob("licen*/*"))
             if path.is_file() and TEXT.match(path.name)]
    found += [path for path in sorted(folder.glob("licen*/*")) if path.is_file()]
    return list(dict.fromkeys(found))


def main():
    tree = cargo("tree", "--locked", "--package", "grainwake", "--edges", "normal,build",
                 "--prefix", "none", "--format", "{p}", "--target", "all")
    wanted = {tuple(line.split()[:2]) for line in tree.splitlines() if line.strip()}
    wanted = {(name, version.removeprefix("v")) for name, version in wanted}
    packages = json.loads(cargo("metadata", "--locked", "--format-version", "1"))["packages"]
    packages = [p for p in packages if p["source"] and (p["name"], p["version"]) in wanted]
    packages.sort(key=lambda p: (p["name"], p["version"]))
    seen, without = {}, []
    print("Grainwake contains the following works.\n")
    for package in packages:
        print(f"{package['name']} {package['version']}: {package['license']}, {package['repository']}")
    print("three.js: MIT, https://github.com/mrdoob/three.js")
    for package in packages:
        name = f"{package['name']} {package['version']}"
        files = texts(pathlib.Path(package["manifest_path"]).parent)
        if not files:
            without.append((name, package["license"]))
        for path in files:
            text = path.read_text(encoding="utf-8", errors="replace").strip()
            seen.setdefault(text, []).append(name)
    three = ROOT / "crates/view/web/licences/three.txt"
    if three.is_file():
        seen.setdefault(three.read_text(encoding="utf-8").strip(), []).append("three.js")
    for text, names in seen.items():
        print(f"\n{'=' * 80}\n{', '.join(names)}\n{'=' * 80}\n{text}")
    common = ("MIT", "Apache-2.0", "Unicode-3.0", "Zlib", "BSD-3-Clause")
    strange = [(name, licence) for name, licence in without
               if not any(known in (licence or "") for known in common)]
    print(f"{len(packages)} crates, {len(without)} without a text: "
          f"{', '.join(name for name, _ in without)}", file=sys.stderr)
    if strange:
        sys.exit(f"no licence text: {strange}")


if __name__ == "__main__":
    main()
