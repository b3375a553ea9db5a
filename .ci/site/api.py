#!/usr/bin/env python3
"""Writes the package `grainwake` as plain Python for the API page: the sources, and the type stubs
of the extension module with its docstrings. Usage: api.py FOLDER"""

import ast
import copy
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


def readable(text):
    """Names a type of the docstrings that would be read as a difference."""
    return text.replace(" : path-like", " : str or os.PathLike")


class Aliases(ast.NodeTransformer):
    """Replaces the private names of types, such as _Path, by what they stand for."""

    def __init__(self, tree):
        pairs = [(node.targets[0], node.value) for node in tree.body if isinstance(node, ast.Assign)]
        self.meaning = {name.id: value for name, value in pairs if name.id.startswith("_")}

    def visit_Name(self, node):
        if isinstance(node.ctx, ast.Load) and node.id in self.meaning:
            return self.visit(copy.deepcopy(self.meaning[node.id]))
        return node


def main():
    target = pathlib.Path(sys.argv[1]) / "grainwake"
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    for path in SOURCE.glob("*.py"):
        (target / path.name).write_text(readable(path.read_text(encoding="utf-8")))
    tree = ast.parse((SOURCE / "_grainwake.pyi").read_text(encoding="utf-8"))
    count = described(tree.body, _grainwake)
    if count < 100:
        sys.exit(f"only {count} docstrings in {grainwake.__file__}")
    tree = ast.fix_missing_locations(Aliases(tree).visit(tree))
    (target / "_grainwake.py").write_text(readable(ast.unparse(tree)))
    print(f"site: {count} docstrings of the extension module")


if __name__ == "__main__":
    main()
