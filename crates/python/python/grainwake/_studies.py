"""Results of studies, opening of folders, and validations."""

from __future__ import annotations

import pathlib
import warnings
from typing import TYPE_CHECKING, Any, Sequence

from . import _grainwake
from ._errors import CaseError, CaseWarning
from ._optional import need
from ._progress import Choice
from ._results import Path, RunFolder

if TYPE_CHECKING:
    import pandas


def open(path: Path) -> RunFolder | StudyFolder:
    """Open a run folder or a study folder.

    Parameters
    ----------
    path : path-like
        Folder written by `Case.run`, `Study.run` or the command line.

    Returns
    -------
    RunFolder or StudyFolder

    Raises
    ------
    CaseError
        The folder holds neither a run nor a study.
    FileNotFoundError
        There is no such folder.

    Warns
    -----
    CaseWarning
        Parts of the folder are missing or damaged; `RunFolder.notes` lists them.

    See Also
    --------
    open_run, open_study : one kind of folder, with the type of the result.
    """
    folder = _folder(path)
    return StudyFolder(folder) if _holds_study(folder) else RunFolder(folder)


def open_run(path: Path) -> RunFolder:
    """Open a run folder, as `open` does.

    Parameters
    ----------
    path : path-like
        Folder written by `Case.run`, `Simulation` or the command line.

    Returns
    -------
    RunFolder

    Raises
    ------
    CaseError
        The folder holds no run.
    FileNotFoundError
        There is no such folder.
    """
    folder = _folder(path)
    if _holds_study(folder):
        raise CaseError(f"{folder} holds a study, not a run; open it with open_study")
    return RunFolder(folder)


def open_study(path: Path) -> StudyFolder:
    """Open a study folder, as `open` does.

    Parameters
    ----------
    path : path-like
        Folder written by `Study.run` or the command line.

    Returns
    -------
    StudyFolder

    Raises
    ------
    CaseError
        The folder holds no study.
    FileNotFoundError
        There is no such folder.
    """
    folder = _folder(path)
    if not _holds_study(folder):
        raise CaseError(f"{folder} holds no study; a run is opened with open_run")
    return StudyFolder(folder)


def _folder(path: Path) -> pathlib.Path:
    folder = pathlib.Path(path)
    if not folder.is_dir():
        raise FileNotFoundError(f"there is no folder {folder}")
    return folder


def _holds_study(folder: pathlib.Path) -> bool:
    return (folder / "study.json").is_file()


class StudyFolder:
    """Results of a study.

    Attributes
    ----------
    path : pathlib.Path
        The folder.
    """

    path: pathlib.Path

    def __init__(self, path: Path) -> None:
        self.path = pathlib.Path(path)
        self._plan = _grainwake._read_plan(self.path)

    def __repr__(self) -> str:
        return f"StudyFolder({str(self.path)!r}, {len(self)} runs)"

    def __len__(self) -> int:
        return len(self._plan["runs"])

    @property
    def title(self) -> str:
        """Title of the study, one line."""
        return str(self._plan["title"])

    @property
    def runs(self) -> list[str]:
        """Names of the runs."""
        return [run["name"] for run in self._plan["runs"]]

    def run(self, name: str) -> RunFolder:
        """Results of one run.

        Parameters
        ----------
        name : str
            One of `runs`.
        """
        if name not in self.runs:
            raise KeyError(f"there is no run {name!r}; there are: {', '.join(self.runs)}")
        folder = self.path / "runs" / name
        if not folder.is_dir():
            raise FileNotFoundError(f"the run {name!r} has not started: {folder} is missing")
        return RunFolder(folder)

    @property
    def table(self) -> pandas.DataFrame:
        """Measured values of all runs (``table.csv``)."""
        return self._csv("table.csv")

    @property
    def settling(self) -> pandas.DataFrame:
        """Results of single grains (``settling.csv``)."""
        return self._csv("settling.csv")

    def _csv(self, name: str) -> pandas.DataFrame:
        pandas = need("pandas")
        file = self.path / name
        if not file.is_file():
            raise FileNotFoundError(f"{file} is missing")
        return pandas.read_csv(file)

    @property
    def records(self) -> list[dict[str, Any]]:
        """Measured values of all runs as dicts, also of a study that is still going."""
        return _grainwake._read_records(self.path)

    def report(self) -> pathlib.Path:
        """Draw the figures and ``report.html``, and return the path of the page."""
        page, notes = _grainwake._render(self.path)
        for note in notes:
            warnings.warn(note, CaseWarning, stacklevel=2)
        return pathlib.Path(page)


def validate(
    names: str | Sequence[str] = (),
    *,
    suites: Path | None = None,
    output: Path = "runs/validation",
    level: str = "ci",
    threads: int = 0,
    progress: Choice = None,
) -> pandas.DataFrame:
    """Run validations and compare the results with their references.

    Parameters
    ----------
    names : str or sequence of str, optional
        Names of validations, or of single runs as "NAME/RUN"; all by default.
    suites : path-like, optional
        Folder of the validations; by default the folder "validation" if it holds any, otherwise
        those in the package.
    output : path-like, default "runs/validation"
        Folder of the runs; existing runs are replaced.
    level : {"ci", "full"}, default "ci"
        Small runs only, or all.
    threads : int, default 0
        Threads; 0 for all cores.
    progress : bool or callable, optional
        As in `Case.run`.

    Returns
    -------
    pandas.DataFrame
        One row for each check: name, run, quantity, value, reference, error, bound, pass, problem.
    """
    wanted = [names] if isinstance(names, str) else [*names]
    folder = None if suites is None else pathlib.Path(suites)
    rows = _grainwake._validate(
        wanted, folder, pathlib.Path(output), level, threads, progress
    )
    return need("pandas").DataFrame(rows)
