"""Results of runs."""

from __future__ import annotations

import json
import operator
import os
import pathlib
import warnings
from typing import TYPE_CHECKING, Any, Callable, SupportsIndex, Union

import numpy as np

from . import _grainwake
from ._errors import CaseError, CaseWarning
from ._grainwake import Case
from ._mesh import poly_data
from ._optional import counted, need
from ._simulation import to_dataset

if TYPE_CHECKING:
    import pandas
    import pyvista
    import xarray

Path = Union[str, "os.PathLike[str]"]
Time = Union[float, np.floating[Any], np.integer[Any], str]

_UNITS = {"velocity": "m/s", "vorticity": "1/s", "pressure": "Pa", "solid_fraction": "1"}


def _json(file: pathlib.Path) -> dict[str, Any] | None:
    """Contents of a JSON file; None if it is absent or damaged."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


class RunFolder:
    """Results of one run, read when they are asked for.

    Attributes
    ----------
    path : pathlib.Path
        The folder.
    notes : list of str
        Missing, unfinished or damaged parts.
    """

    path: pathlib.Path
    notes: list[str]

    def __init__(self, path: Path) -> None:
        self.path = pathlib.Path(path)
        # The warning names the folder once.
        notes = _grainwake._run_notes(self.path)
        self.notes = [note.replace(f"{self.path}{os.sep}", "") for note in notes]
        if not (self.path / "run.pvd").is_file() and self._found():
            self.notes.append("run.pvd is missing: the times of the VTK files are read from them")
        if self.notes:
            listed = "; ".join(self.notes)
            warnings.warn(f"{self.path}: {listed}", CaseWarning, stacklevel=3)

    def __repr__(self) -> str:
        state = "finished" if self.finished else "not finished"
        notes = f", {counted(len(self.notes), 'note')}" if self.notes else ""
        return f"RunFolder({str(self.path)!r}, {state}{notes})"

    def _need(self, name: str) -> pathlib.Path:
        file = self.path / name
        if not file.is_file():
            raise FileNotFoundError(f"{file} is missing")
        return file

    @property
    def finished(self) -> bool:
        """Whether the run reached its end."""
        return (self.path / "summary.json").is_file()

    @property
    def summary(self) -> dict[str, Any] | None:
        """Contents of ``summary.json``; None before the end of the run."""
        return _json(self.path / "summary.json")

    @property
    def failure(self) -> dict[str, Any] | None:
        """Contents of ``failure.json`` of a failed run."""
        return _json(self.path / "failure.json")

    @property
    def provenance(self) -> dict[str, Any] | None:
        """Contents of ``provenance.json``: program, machine, commands."""
        return _json(self.path / "provenance.json")

    def case(self) -> Case:
        """Case of the run, with all defaults."""
        return Case.load(self._need("case.resolved.toml"))

    @property
    def grains(self) -> pandas.DataFrame:
        """Motion of the grains, one row for each time and grain; SI units, space frame.

        Columns: time, grain, x, y, z, vx, vy, vz, qw, qx, qy, qz, wx, wy, wz, fx, fy, fz, tx, ty,
        tz, contacts.
        """
        pandas = need("pandas")
        columns, _ = _grainwake._read_grains(self._need("grains.csv"))
        table = pandas.DataFrame(columns)
        table["grain"] = table["grain"].astype("int64")
        if "contacts" in table and table["contacts"].notna().all():
            table["contacts"] = table["contacts"].astype("int64")
        return table

    def grain(self, index: SupportsIndex) -> pandas.DataFrame:
        """Motion of one grain, indexed by time.

        Parameters
        ----------
        index : int
            Index of the grain.
        """
        index = operator.index(index)
        table = self.grains
        known = sorted(table["grain"].unique().tolist())
        if index not in known:
            raise IndexError(f"there is no grain {index}: the table has {counted(len(known), 'grain')}")
        return table[table["grain"] == index].drop(columns="grain").set_index("time")

    def by_grain(self) -> pandas.DataFrame:
        """Motion of the grains with one row for each time and columns (quantity, grain)."""
        return self.grains.pivot(index="time", columns="grain")

    @property
    def diagnostics(self) -> pandas.DataFrame:
        """Diagnostics against time; `docs/reference/run-folder.md` lists the columns."""
        pandas = need("pandas")
        columns, _ = _grainwake._read_table(self._need("diagnostics.csv"))
        table = pandas.DataFrame(columns)
        for name in ("step", "contacts"):
            if name in table and table[name].notna().all():
                table[name] = table[name].astype("int64")
        return table

    @property
    def events(self) -> pandas.DataFrame:
        """Events in order of time: time, event, grains, confirmed, gap, tilt, wall."""
        pandas = need("pandas")
        columns = ["time", "event", "grains", "confirmed", "gap", "tilt", "wall"]
        rows, _ = _grainwake._read_events(self._need("events.jsonl"))
        table = pandas.DataFrame(rows, columns=columns)
        table["grains"] = table["grains"].map(tuple)
        return table

    @property
    def contacts(self) -> pandas.DataFrame:
        """Contacts, one row for each time and contact, if the case writes them; SI units.

        Columns: time, grain, partner, x, y, z, nx, ny, nz, overlap, fx, fy, fz. A negative partner
        is a wall: -1 lower x, -2 upper x, -3 lower y, -4 upper y, -5 lower z, -6 upper z. The force
        acts on ``grain``.
        """
        columns, _ = _grainwake._read_table(self._need("contacts.csv"))
        return need("pandas").DataFrame(columns).astype({"grain": "int64", "partner": "int64"})

    @property
    def probes(self) -> dict[str, pandas.DataFrame]:
        """Table of each probe of the case, by name; SI units.

        Points and lines have the columns time, point, x, y, z, vx, vy, vz, pressure and
        solid_fraction; planes have time, volume_flux, grain_flux, solid_fraction and pressure.
        """
        pandas = need("pandas")
        tables = {}
        for file in sorted((self.path / "probes").glob("*.csv")):
            columns, _ = _grainwake._read_table(file)
            table = pandas.DataFrame(columns)
            if "point" in table:
                table["point"] = table["point"].astype("int64")
            tables[file.stem] = table
        return tables

    @property
    def files(self) -> pandas.DataFrame:
        """VTK files: time, group, file; those of ``run.pvd``, or without it those in the folder."""
        return need("pandas").DataFrame(self._entries(), columns=["time", "group", "file"])

    def _entries(self) -> list[tuple[float, str, str]]:
        try:
            return _grainwake._read_collection(self._need("run.pvd"))
        except (CaseError, FileNotFoundError):
            found = self._found()
            if not found:
                raise
        entries = []
        for group, file in found:
            try:
                time = _time_inside(self.path / file)
            except (CaseError, OSError):
                continue
            entries.append((time, group, file))
        return sorted(entries)

    def _found(self) -> list[tuple[str, str]]:
        """Group and name of the VTK files in the folder."""
        found = []
        for folder, kind in (("slices", "vti"), ("fields", "vti"), ("grains", "vtp")):
            for file in sorted((self.path / folder).glob(f"*.{kind}")):
                name = file.stem.rpartition("_")[0]
                group = f"slice {name}" if folder == "slices" else folder
                found.append((group, f"{folder}/{file.name}"))
        return found

    def _nearest(self, time: Time, wanted: Callable[[str], bool], what: str) -> pathlib.Path:
        """File of the wanted group whose time is nearest; missing files are left out."""
        seconds = _grainwake._seconds(time)
        entries = [entry for entry in self._entries() if wanted(entry[1])]
        there = [entry for entry in entries if (self.path / entry[2]).is_file()]
        if not there:
            state = "written" if not entries else "left in the folder"
            raise FileNotFoundError(f"{self.path}: no {what} was {state}")
        return self.path / min(there, key=lambda entry: abs(entry[0] - seconds))[2]

    @property
    def planes(self) -> list[str]:
        """Names of the slice planes, such as "y-grain0"."""
        groups = {group for _, group, _ in self._entries() if group.startswith("slice ")}
        return sorted(group.removeprefix("slice ") for group in groups)

    def slice(self, time: Time, plane: str | None = None) -> xarray.Dataset:
        """Slice of the fields at the time nearest to `time`.

        Parameters
        ----------
        time : float or str
            Simulated time [s].
        plane : str, optional
            One of `planes`; the first by default.

        Returns
        -------
        xarray.Dataset
            velocity, vorticity, pressure and solid_fraction with coordinates [m] and units. The
            axis normal to the plane is a scalar coordinate; the attribute ``time`` is the time [s].
        """
        known = self.planes
        if plane is None and known:
            plane = known[0]
        if known and plane not in known:
            raise CaseError(f'plane: found "{plane}"; expected one of {", ".join(known)}')
        return _dataset(self._nearest(time, lambda group: group == f"slice {plane}", "slice"))

    def volume(self, time: Time) -> xarray.Dataset:
        """Full fields at the time nearest to `time`, as in `slice`.

        Parameters
        ----------
        time : float or str
            Simulated time [s].
        """
        return _dataset(self._nearest(time, lambda group: group.startswith("field"), "field"))

    def field(self, time: Time) -> pyvista.ImageData:
        """Full fields at the time nearest to `time`, for PyVista.

        Parameters
        ----------
        time : float or str
            Simulated time [s].

        Returns
        -------
        pyvista.ImageData
            Cell data velocity, vorticity, pressure and solid_fraction.
        """
        pyvista = need("pyvista")
        file = self._nearest(time, lambda group: group.startswith("field"), "field")
        image = _grainwake._read_image(file)
        cells = np.asarray(image["cells"])
        grid = pyvista.ImageData(
            dimensions=cells + 1, spacing=image["spacing"], origin=image["origin"]
        )
        for name, values in image["arrays"].items():
            count = int(np.prod(cells))
            grid.cell_data[name] = values.reshape((count, 3) if values.ndim == 4 else count)
        grid.field_data["time"] = [image["time"]]
        return grid

    def surfaces(self, time: Time) -> pyvista.PolyData:
        """Surfaces of all grains at the time nearest to `time`.

        Parameters
        ----------
        time : float or str
            Simulated time [s].

        Returns
        -------
        pyvista.PolyData
            Triangles with the cell data ``grain`` and the point data ``velocity`` [m/s].
        """
        file = self._nearest(time, lambda group: group == "grains", "surface")
        surface = _grainwake._read_surface(file)
        mesh = poly_data(surface["points"], surface["triangles"])
        if surface["velocity"] is not None:
            mesh.point_data["velocity"] = surface["velocity"]
        if surface["grain"] is not None:
            mesh.cell_data["grain"] = surface["grain"]
        mesh.field_data["time"] = [surface["time"]]
        return mesh

    def report(self) -> pathlib.Path:
        """Draw the figures and ``report.html``, and return the path of the page."""
        page, notes = _grainwake._render(self.path)
        for note in notes:
            warnings.warn(note, CaseWarning, stacklevel=2)
        return pathlib.Path(page)


def _time_inside(file: pathlib.Path) -> float:
    """Time of a VTK file [s]."""
    read = _grainwake._read_image if file.suffix == ".vti" else _grainwake._read_surface
    time = read(file)["time"]
    if time is None:
        raise CaseError(f"{file} holds no time")
    return time


def _dataset(file: pathlib.Path) -> xarray.Dataset:
    image = _grainwake._read_image(file)
    centres = [
        origin + spacing * (np.arange(count) + 0.5)
        for origin, spacing, count in zip(image["origin"], image["spacing"], image["cells"])
    ]
    fields = {name: (_UNITS.get(name, ""), values) for name, values in image["arrays"].items()}
    return to_dataset(centres[::-1], fields, {"time": image["time"], "file": str(file)})
