#!/usr/bin/env python3
"""Lists the packages that `import grainwake` loads; fails if one is not expected. Figures and tables
need further packages, which would make the import slow and are loaded when they are used."""

import subprocess
import sys

EXPECTED = {"grainwake", "numpy"}


def loaded(code):
    """Top-level modules of a new interpreter after `code`, without the standard library."""
    show = f"{code}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    printed = subprocess.run(
        [sys.executable, "-I", "-c", show], check=True, capture_output=True, text=True
    ).stdout
    return {name for name in printed.split() if name not in sys.stdlib_module_names}


packages = loaded("import grainwake") - loaded("pass")
print(f"python: the import loads {', '.join(sorted(packages))}")
if packages != EXPECTED:
    sys.exit(f"expected {', '.join(sorted(EXPECTED))}")
