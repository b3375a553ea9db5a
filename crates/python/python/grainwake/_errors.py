"""Exceptions and warnings."""

from __future__ import annotations

from typing import NamedTuple, Sequence


class Problem(NamedTuple):
    """One problem of an input, with its place."""

    key: str | None
    """Dotted key, such as "fluid.density"."""
    message: str
    """Value found and the rule it breaks."""
    help: str | None
    """Remedy."""
    file: str | None
    """Name of the file or text."""
    line: int | None
    """Line, from 1."""
    column: int | None
    """Column, from 1."""


class CaseError(ValueError):
    """Input was refused: a case, a mesh, a scan, an array or a folder.

    The message is that of the command line, with file, line, key and remedy.

    Attributes
    ----------
    problems : list of Problem
        All problems found.
    """

    problems: list[Problem]

    def __init__(self, message: str, problems: Sequence[tuple[object, ...]] = ()) -> None:
        super().__init__(message, problems)
        self.problems = [Problem(*parts) for parts in problems]  # type: ignore[arg-type]

    def __str__(self) -> str:
        return str(self.args[0])


class SolverError(RuntimeError):
    """The numerics failed; the message says when, why and what to change."""


class CaseWarning(UserWarning):
    """Setting of a case that impairs the results, or missing part of a run folder."""
