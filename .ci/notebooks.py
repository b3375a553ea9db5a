#!/usr/bin/env python3
"""Executes notebooks and saves them with their output in a folder, for the documentation site.

Fails on an error, on committed output, and if a notebook takes longer than the bound.
Usage: notebooks.py BOUND_IN_SECONDS FOLDER NOTEBOOK...
"""

import pathlib
import sys
import time

import nbformat
from nbclient import NotebookClient

bound = float(sys.argv[1])
folder = pathlib.Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
for name in sys.argv[3:]:
    path = pathlib.Path(name)
    book = nbformat.read(path, as_version=4)
    if any(cell.get("outputs") for cell in book.cells):
        sys.exit(f"{path.name}: clear the output of all cells before the commit")
    started = time.perf_counter()
    NotebookClient(book, timeout=600, kernel_name="python3",
                   resources={"metadata": {"path": str(path.parent)}}).execute()
    wall = time.perf_counter() - started
    print(f"python: {path.name} in {wall:.0f} s")
    nbformat.write(book, folder / path.name)
    if wall > bound:
        sys.exit(f"{path.name} takes longer than {bound:.0f} s")
