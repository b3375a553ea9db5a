"""Types of the extension module."""

import os
import pathlib
from typing import (
    Any,
    Callable,
    Iterable,
    Iterator,
    Literal,
    Mapping,
    Sequence,
    SupportsIndex,
    TypedDict,
    final,
    overload,
)

import numpy as np
import numpy.typing as npt
import pyvista
import trimesh
import xarray

from ._results import RunFolder
from ._simulation import State
from ._studies import StudyFolder

_Path = str | os.PathLike[str]
_Number = float | np.floating[Any] | np.integer[Any]
_Quantity = _Number | str
_Vector = Sequence[_Quantity] | npt.NDArray[np.floating[Any] | np.integer[Any]]
_Overrides = Mapping[str, Any] | Sequence[str] | None
_Progress = bool | Callable[[dict[str, Any]], object] | None
_Mesh = _Path | tuple[npt.ArrayLike, npt.ArrayLike] | pyvista.PolyData | trimesh.Trimesh
_Threshold = _Number | Literal["otsu", "otsu3"] | None
_Floats = npt.NDArray[np.float64]
_Integers = npt.NDArray[np.int64]
_Field = npt.NDArray[np.float64] | npt.NDArray[np.float32]
_Axis = Literal["x", "y", "z"]

__version__: str
commit: str | None

@final
class Grain:
    @staticmethod
    def sphere(diameter: _Quantity, *, nodes: SupportsIndex | None = None) -> Grain: ...
    @staticmethod
    def ellipsoid(
        a: _Quantity,
        b: _Quantity,
        c: _Quantity,
        *,
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def rounded_box(
        a: _Quantity,
        b: _Quantity,
        c: _Quantity,
        *,
        radius: _Quantity,
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def cylinder(
        diameter: _Quantity,
        height: _Quantity,
        *,
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def capsule(
        diameter: _Quantity,
        height: _Quantity,
        *,
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def superquadric(
        a: _Quantity,
        b: _Quantity,
        c: _Quantity,
        *,
        exponents: Sequence[_Number] | npt.NDArray[np.floating[Any] | np.integer[Any]],
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def from_mesh(
        mesh: _Mesh,
        *,
        unit: _Quantity | None = None,
        flip: bool = False,
        equivalent_diameter: _Quantity | None = None,
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def from_scan(
        image: _Path | npt.ArrayLike,
        *,
        voxel: _Quantity,
        label: SupportsIndex | None = None,
        threshold: _Threshold = None,
        median: bool = False,
        split: bool = False,
        separate: _Number | None = None,
        from_mask: bool = False,
        pad: bool = False,
        largest_piece: bool = False,
        smoothing: _Number | None = None,
        rescue: bool = False,
        labels: bool = False,
        roundness: bool = True,
        equivalent_diameter: _Quantity | None = None,
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def family(
        sphericity: _Number,
        roundness: _Number,
        equivalent_diameter: _Quantity | None = None,
        *,
        flatness: _Number | None = None,
        seed: SupportsIndex = 1,
        cells: SupportsIndex | None = None,
        nodes: SupportsIndex | None = None,
    ) -> Grain: ...
    @staticmethod
    def load(path: _Path) -> Grain: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    @staticmethod
    def _from_bytes(bytes: bytes) -> Grain: ...
    def scaled(self, equivalent_diameter: _Quantity) -> Grain: ...
    def at(self, position: _Vector, *, density: _Quantity, **keys: Any) -> dict[str, Any]: ...
    def distance(self, points: npt.ArrayLike) -> _Floats: ...
    def surface(self) -> tuple[_Floats, _Integers]: ...
    @overload
    def mesh(self, kind: Literal["pyvista"] = "pyvista") -> pyvista.PolyData: ...
    @overload
    def mesh(self, kind: Literal["trimesh"]) -> trimesh.Trimesh: ...
    def picture(self, pixels: SupportsIndex = 320) -> bytes: ...
    def _repr_png_(self) -> bytes: ...
    def record(self) -> dict[str, Any]: ...
    @property
    def volume(self) -> float: ...
    @property
    def equivalent_diameter(self) -> float: ...
    @property
    def a(self) -> float: ...
    @property
    def b(self) -> float: ...
    @property
    def c(self) -> float: ...
    @property
    def elongation(self) -> float: ...
    @property
    def flatness(self) -> float: ...
    @property
    def krumbein_sphericity(self) -> float: ...
    @property
    def wadell_sphericity(self) -> float: ...
    @property
    def roundness(self) -> float | None: ...
    @property
    def convexity(self) -> float | None: ...
    @property
    def inscribed_radius(self) -> float | None: ...
    @property
    def feret(self) -> tuple[float, float, float] | None: ...
    @property
    def surface_area(self) -> float: ...
    @property
    def bounding_radius(self) -> float: ...
    @property
    def inertia(self) -> _Floats: ...
    @property
    def nodes(self) -> _Floats: ...
    @property
    def node_areas(self) -> _Floats: ...
    @property
    def method(self) -> str: ...
    @property
    def digest(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Scan:
    @property
    def grains(self) -> dict[int, Grain]: ...
    @property
    def rejected(self) -> dict[int, str]: ...
    @property
    def voxels(self) -> dict[int, int]: ...
    @property
    def labels(self) -> npt.NDArray[np.uint32]: ...
    @property
    def threshold(self) -> float | None: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[int]: ...
    def __contains__(self, label: object, /) -> bool: ...
    def __getitem__(self, label: SupportsIndex, /) -> Grain: ...

def scan(
    image: _Path | npt.ArrayLike,
    *,
    voxel: _Quantity,
    label: SupportsIndex | None = None,
    threshold: _Threshold = None,
    median: bool = False,
    split: bool = False,
    separate: _Number | None = None,
    from_mask: bool = False,
    pad: bool = False,
    largest_piece: bool = False,
    smoothing: _Number | None = None,
    rescue: bool = False,
    labels: bool = False,
    roundness: bool = True,
    equivalent_diameter: _Quantity | None = None,
    cells: SupportsIndex | None = None,
    nodes: SupportsIndex | None = None,
) -> Scan: ...

@final
class Case:
    @staticmethod
    def load(path: _Path, overrides: _Overrides = None) -> Case: ...
    @staticmethod
    def from_toml(
        text: str, folder: _Path = ..., overrides: _Overrides = None, *, name: str = "case"
    ) -> Case: ...
    @staticmethod
    def from_dict(
        tables: dict[str, Any], folder: _Path = ..., overrides: _Overrides = None
    ) -> Case: ...
    @staticmethod
    def new(
        *,
        size: _Vector,
        end: _Quantity,
        cell_size: _Quantity | _Vector | None = None,
        cells: Sequence[SupportsIndex] | npt.NDArray[np.integer[Any]] | None = None,
        refinement: SupportsIndex | None = None,
        refinement_margin: _Quantity | _Vector | None = None,
        grains: Iterable[Mapping[str, Any]] | None = None,
        fluid: Mapping[str, Any] | None = None,
        gravity: _Vector | None = None,
        boundaries: str | Mapping[str, Any] | None = None,
        title: str | None = None,
        folder: _Path = ...,
        **tables: Any,
    ) -> Case: ...
    @staticmethod
    def _from_parts(resolved: str, grains: Sequence[tuple[str, bytes]], origin: str) -> Case: ...
    def with_overrides(self, overrides: Mapping[str, Any] | Sequence[str]) -> Case: ...
    @staticmethod
    def schema() -> dict[str, Any]: ...
    def run(
        self,
        folder: _Path,
        *,
        resume: bool = False,
        force: bool = False,
        start_from: _Path | None = None,
        threads: SupportsIndex | None = None,
        report: bool = True,
        progress: _Progress = None,
    ) -> RunFolder: ...
    def estimate(self, threads: SupportsIndex | None = None) -> dict[str, Any]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def title(self) -> str: ...
    @property
    def resolved(self) -> str: ...
    @property
    def digest(self) -> str: ...
    @property
    def end(self) -> float: ...
    @property
    def cells(self) -> tuple[int, int, int]: ...
    @property
    def spacing(self) -> tuple[float, float, float]: ...
    @property
    def size(self) -> tuple[float, float, float]: ...
    @property
    def grains(self) -> list[Grain]: ...

class _Contacts(TypedDict):
    grain: _Integers
    partner: _Integers
    overlap: _Floats
    force: _Floats
    point: _Floats
    normal: _Floats

@final
class Simulation:
    def __new__(
        cls,
        case: Case,
        *,
        threads: SupportsIndex | None = None,
        output: _Path | None = None,
        resume: bool = False,
        force: bool = False,
    ) -> Simulation: ...
    def __enter__(self) -> Simulation: ...
    def __exit__(self, kind: Any, value: Any, traceback: Any, /) -> Literal[False]: ...
    @property
    def output(self) -> pathlib.Path | None: ...
    def checkpoint(self) -> None: ...
    def finish(self, *, report: bool = True) -> RunFolder: ...
    def step(self, horizon: _Quantity | None = None) -> float: ...
    def advance_to(self, time: _Quantity) -> None: ...
    def _advance(self, time: float) -> None: ...
    @property
    def _stopped(self) -> bool: ...
    def run(
        self,
        until: _Quantity | None = None,
        every: _Quantity | None = None,
        *,
        progress: _Progress = None,
    ) -> Iterator[State]: ...
    def state(self) -> State: ...
    def diagnostics(self) -> dict[str, Any]: ...
    def contacts(self) -> _Contacts: ...
    def set_velocity(
        self,
        grain: SupportsIndex,
        velocity: _Vector | None = None,
        angular_velocity: _Vector | None = None,
    ) -> None: ...
    def prescribe_motion(
        self,
        grain: SupportsIndex,
        velocity: _Vector | None = None,
        angular_velocity: _Vector | None = None,
    ) -> None: ...
    def release(self, grain: SupportsIndex, *, translation: bool = True, rotation: bool = True) -> None: ...
    def set_load(
        self, grain: SupportsIndex, force: _Vector | None = None, torque: _Vector | None = None
    ) -> None: ...
    def save_checkpoint(self, path: _Path) -> None: ...
    def restore_checkpoint(self, path: _Path) -> None: ...
    def fluid_velocity(self, axis: _Axis) -> _Field: ...
    def kinematic_pressure(self) -> _Field: ...
    def cell_field(
        self, name: Literal["velocity", "vorticity", "pressure", "solid_fraction"]
    ) -> _Floats: ...
    def coordinates(self, axis: _Axis | None = None) -> list[_Floats]: ...
    def interpolate_velocity(self, at: npt.ArrayLike) -> _Floats: ...
    def to_xarray(self) -> xarray.Dataset: ...
    @property
    def case(self) -> Case: ...
    @property
    def time(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def time_step(self) -> float: ...
    @property
    def positions(self) -> _Floats: ...
    @property
    def orientations(self) -> _Floats: ...
    @property
    def velocities(self) -> _Floats: ...
    @property
    def angular_velocities(self) -> _Floats: ...
    @property
    def forces(self) -> _Floats: ...
    @property
    def torques(self) -> _Floats: ...
    @property
    def masses(self) -> _Floats: ...
    @property
    def ended(self) -> Literal["end", "landing", "rest", "separation"] | None: ...
    @property
    def threads(self) -> int: ...

@final
class Study:
    @staticmethod
    def load(path: _Path, overrides: _Overrides = None) -> Study: ...
    def run(
        self,
        folder: _Path,
        *,
        only: str | None = None,
        jobs: SupportsIndex = 1,
        threads: SupportsIndex = 0,
        retry: bool = False,
        keep_checkpoints: bool = False,
        accept: list[str] | None = None,
        force: bool = False,
        progress: _Progress = None,
    ) -> StudyFolder: ...
    @staticmethod
    def _from_json(plan: str) -> Study: ...
    def plan(self) -> list[dict[str, Any]]: ...
    @property
    def title(self) -> str: ...
    @property
    def runs(self) -> list[str]: ...
    def __len__(self) -> int: ...

class _Image(TypedDict):
    time: float
    cells: tuple[int, int, int]
    spacing: tuple[float, float, float]
    origin: tuple[float, float, float]
    arrays: dict[str, npt.NDArray[np.float32]]

class _Surface(TypedDict):
    time: float | None
    points: _Floats
    triangles: _Integers
    velocity: _Floats | None
    grain: _Integers | None

def _read_table(path: _Path) -> tuple[dict[str, _Floats], list[str]]: ...
def _read_grains(path: _Path) -> tuple[dict[str, _Floats], list[str]]: ...
def _read_events(path: _Path) -> tuple[list[dict[str, Any]], list[str]]: ...
def _read_collection(path: _Path) -> list[tuple[float, str, str]]: ...
def _read_image(path: _Path) -> _Image: ...
def _read_surface(path: _Path) -> _Surface: ...
def _read_plan(folder: _Path) -> dict[str, Any]: ...
def _read_records(folder: _Path) -> list[dict[str, Any]]: ...
def _render(folder: _Path) -> tuple[str, list[str]]: ...
def _run_notes(folder: _Path) -> list[str]: ...
def _seconds(time: _Quantity) -> float: ...
def _validate(
    names: list[str],
    suites: _Path | None,
    output: _Path,
    level: str,
    threads: SupportsIndex,
    progress: _Progress,
) -> list[dict[str, Any]]: ...
