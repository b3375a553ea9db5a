#!/usr/bin/env python3
"""Writes the package `grainwake` as plain Python for the API page: the sources, and the type stubs
of the extension module with its docstrings. Usage: api.py FOLDER"""

import ast
import pathlib
import shutil
import sys

import grainwake
from grainwake import _grainwake

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCE = ROOT / "crates/python/python/grainwake"


def described(nodes, owner):
    """Adds the docstrings of the members of `owner` to their definitions, and returns the number."""
    count = 0
    for node in nodes:
        if not isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            continue
        # `__new__` has the parameters that the docstring of its class describes.
        member = None if node.name == "__new__" else getattr(owner, node.name, None)
        text = getattr(member, "__doc__", None)
        if text and not ast.get_docstring(node):
            node.body.insert(0, ast.Expr(ast.Constant(text)))
            count += 1
        if node.name == "__new__":
            node.name, node.returns = "__init__", ast.Constant(None)
        if isinstance(node, ast.ClassDef) and member is not None:
            count += described(node.body, member)
    return count


def main():
    target = pathlib.Path(sys.argv[1]) / "grainwake"
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    for path in SOURCE.glob("*.py"):
        shutil.copy(path, target)
    tree = ast.parse((SOURCE / "_grainwake.pyi").read_text(encoding="utf-8"))
    count = described(tree.body, _grainwake)
    if count < 100:
        sys.exit(f"only {count} docstrings in {grainwake.__file__}")
    (target / "_grainwake.py").write_text(ast.unparse(ast.fix_missing_locations(tree)))
    print(f"site: {count} docstrings of the extension module")


if __name__ == "__main__":
    main()
