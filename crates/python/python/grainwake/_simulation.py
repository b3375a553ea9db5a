"""States of a simulation, and its fields as xarray."""

from __future__ import annotations

import dataclasses
import math
import time as clock
from typing import TYPE_CHECKING, Any, Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from . import _progress
from ._optional import counted, need

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._grainwake import Simulation

# Relative difference below which two times count as equal, and fraction of a step below which an
# output and the end coincide; both as in a run folder.
_SAME = 1e-9
_SHORTEST = 0.1


# Arrays have no single truth value and no hash: states are compared by identity.
@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class State:
    """Motion of the grains at one time; the arrays are read-only copies.

    A state equals only itself, so that it can be a key or a member of a set; compare the arrays
    with ``numpy.array_equal``.

    Attributes
    ----------
    time : float
        Simulated time [s].
    steps : int
        Steps taken.
    positions, velocities : ndarray, shape (n, 3)
        Centroids [m] and their velocities [m/s].
    orientations : ndarray, shape (n, 4)
        Quaternions (w, x, y, z) from the body frame to the space frame.
    angular_velocities : ndarray, shape (n, 3)
        Angular velocities in the space frame [rad/s].
    forces, torques : ndarray, shape (n, 3)
        Mean hydrodynamic loads over the last step [N, N m], without buoyancy.
    """

    time: float
    steps: int
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    orientations: NDArray[np.float64]
    angular_velocities: NDArray[np.float64]
    forces: NDArray[np.float64]
    torques: NDArray[np.float64]

    def __repr__(self) -> str:
        return f"State({counted(len(self.positions), 'grain')}, t = {self.time:.6f} s, step {self.steps})"


def state(sim: Simulation) -> State:
    """Copy of the motion of the grains."""
    return State(
        time=sim.time,
        steps=sim.steps,
        positions=sim.positions,
        velocities=sim.velocities,
        orientations=sim.orientations,
        angular_velocities=sim.angular_velocities,
        forces=sim.forces,
        torques=sim.torques,
    )


def states(sim: Simulation, end: float, every: float, choice: _progress.Choice) -> Iterator[State]:
    """States at the multiples of an interval, and at the end or stop condition of the case."""
    display = _progress.of_run(choice)
    start, wall_s = sim.time, 0.0
    try:
        yield sim.state()
        index = math.floor(sim.time / every * (1 + _SAME)) + 1
        while sim.time < end * (1 - _SAME) and not sim._stopped:
            time = min(index * every, end)
            if end - time <= _SHORTEST * sim.time_step:
                time = end
            began = clock.monotonic()
            sim._advance(time)
            wall_s += clock.monotonic() - began
            index = max(index + 1, math.floor(sim.time / every * (1 + _SAME)) + 1)
            progress = {"time": sim.time, "end": end, "start": start, "steps": sim.steps}
            display.update({**progress, "wall_s": wall_s})
            yield sim.state()
    finally:
        display.close()


_COLUMNS = ("time", "grain", "x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx", "wy",
            "wz", "fx", "fy", "fz", "tx", "ty", "tz")


def frame(states: Iterable[State]) -> pandas.DataFrame:
    """Table of states, with the columns of `RunFolder.grains` up to the torque.

    Parameters
    ----------
    states : iterable of State
        States, such as those of `Simulation.run`.

    Returns
    -------
    pandas.DataFrame
        One row for each time and grain; SI units.
    """
    pandas = need("pandas")
    rows = []
    for each in states:
        count = len(each.positions)
        all_grains = np.column_stack([
            np.full(count, each.time), np.arange(count), each.positions, each.velocities,
            each.orientations, each.angular_velocities, each.forces, each.torques,
        ])
        # A grain that has left the box is at infinity; tables of runs leave it out as well.
        rows.append(all_grains[np.isfinite(each.positions).all(axis=1)])
    values = np.concatenate(rows) if rows else np.empty((0, len(_COLUMNS)))
    table = pandas.DataFrame(values, columns=list(_COLUMNS))
    table["grain"] = table["grain"].astype("int64")
    return table


def dataset(sim: Simulation, fields: dict[str, tuple[str, Any]]) -> xarray.Dataset:
    """Dataset of fields (unit, values) at the cell centres."""
    return to_dataset(sim.coordinates(), fields, {"time": sim.time})


def to_dataset(
    coordinates: Iterable[Any], fields: dict[str, tuple[str, Any]], attributes: dict[str, Any]
) -> xarray.Dataset:
    """Dataset of fields (unit, values of the shape (z, y, x) or (z, y, x, 3)).

    Axes of one cell become scalar coordinates.
    """
    xarray = need("xarray")
    axes = dict(zip(("z", "y", "x"), coordinates))
    flat = [name for name, values in axes.items() if len(values) == 1]
    variables = {}
    for name, (unit, values) in fields.items():
        dims = ("z", "y", "x") + (("component",) if values.ndim == 4 else ())
        variables[name] = (dims, values, {"units": unit, "long_name": name.replace("_", " ")})
    coords: dict[str, Any] = {
        name: (name, values, {"units": "m", "long_name": f"position along {name}"})
        for name, values in axes.items()
    }
    if any(values.ndim == 4 for _, values in fields.values()):
        coords["component"] = ["x", "y", "z"]
    full = xarray.Dataset(variables, coords=coords, attrs=attributes)
    return full.isel({name: 0 for name in flat})
