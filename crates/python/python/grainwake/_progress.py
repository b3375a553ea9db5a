"""Progress of runs: a bar in terminals and notebooks, or a callback."""

from __future__ import annotations

import logging
import sys
import time as clock
import warnings
from typing import Any, Callable, Sequence, Union

import numpy as np

from ._errors import CaseError, CaseWarning

Choice = Union[bool, Callable[[dict[str, Any]], object], None]

_log = logging.getLogger("grainwake")
_TICKS = 1000


def check(choice: object) -> None:
    """Refuse a choice of another kind."""
    if choice is None or isinstance(choice, (bool, np.bool_)) or callable(choice):
        return
    kind = type(choice).__name__
    raise CaseError(
        f"progress: found a value of type {kind}; expected True, False or a callable"
    )


def _interactive() -> bool:
    if sys.stderr is not None and sys.stderr.isatty():
        return True
    # A notebook has a kernel; its standard error is no terminal.
    return "ipykernel" in sys.modules


class _Line:
    """Bar of text on one line of standard error, where tqdm is not installed."""

    def __init__(self) -> None:
        self._shown = -1.0

    def show(self, fraction: float, text: str) -> None:
        now = clock.monotonic()
        if now - self._shown < 0.2 and fraction < 1:
            return
        self._shown = now
        full = round(20 * fraction)
        print(f"\r{'#' * full}{'.' * (20 - full)} {100 * fraction:3.0f} %  {text}",
              end="\x1b[K" if sys.stderr.isatty() else "", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self._shown >= 0:
            print(file=sys.stderr)


class _Tqdm:
    def __init__(self, tqdm: Any) -> None:
        form = "{percentage:3.0f} %|{bar}| {elapsed}<{remaining}{postfix}"
        self._bar = tqdm(total=_TICKS, bar_format=form)

    def show(self, fraction: float, text: str) -> None:
        self._bar.n = min(_TICKS, round(_TICKS * fraction))
        self._bar.set_postfix_str(text)

    def close(self) -> None:
        self._bar.close()


def _bar(choice: Choice) -> _Line | _Tqdm | None:
    if callable(choice) or not (_interactive() if choice is None else choice):
        return None
    try:
        from tqdm.auto import tqdm

        return _Tqdm(tqdm)
    except ImportError:
        return _Line()


class Display:
    """Receiver of the progress of a run."""

    def __init__(self, choice: Choice) -> None:
        self._call = choice if callable(choice) else None
        self._bar = _bar(choice)

    def warn(self, texts: Sequence[str]) -> None:
        for text in texts:
            warnings.warn(text, CaseWarning, stacklevel=2)

    def update(self, progress: dict[str, Any] | None, messages: Sequence[str] = ()) -> None:
        for text in messages:
            _log.info(text)
        if progress is None:
            return
        if self._call:
            self._call(progress)
        if self._bar:
            end, time = progress["end"], progress["time"]
            text = f"t {time:.4f} / {end:.4f} s, step {progress['steps']}"
            if progress.get("phase"):
                text += f", {progress['phase']}"
            self._bar.show(time / end if end > 0 else 1.0, text)

    def close(self) -> None:
        if self._bar:
            self._bar.close()


class StudyDisplay:
    """Receiver of the progress of a study."""

    def __init__(self, choice: Choice, runs: int) -> None:
        self._call = choice if callable(choice) else None
        self._bar = _bar(choice)
        self._runs = runs

    def update(self, messages: Sequence[str], done: int) -> None:
        for text in messages:
            _log.info(text)
        if self._call:
            self._call({"done": done, "runs": self._runs, "messages": list(messages)})
        if self._bar:
            self._bar.show(done / max(1, self._runs), messages[-1])

    def close(self) -> None:
        if self._bar:
            self._bar.close()


def of_run(choice: Choice) -> Display:
    """Display of one run."""
    return Display(choice)


def of_study(choice: Choice, runs: int) -> StudyDisplay:
    """Display of a study of this number of runs."""
    return StudyDisplay(choice, runs)
