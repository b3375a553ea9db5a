"""Surfaces of grains for PyVista and trimesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import CaseError
from ._optional import need

if TYPE_CHECKING:
    from ._grainwake import Grain


def poly_data(points: Any, faces: Any) -> Any:
    """PyVista surface of triangles."""
    pyvista = need("pyvista")
    cells = np.column_stack([np.full(len(faces), 3, dtype=np.int64), faces])
    return pyvista.PolyData(np.asarray(points), cells.ravel())


def grain_mesh(grain: Grain, kind: str) -> Any:
    """Surface of a grain as an object of PyVista or trimesh."""
    vertices, faces = grain.surface()
    if kind == "pyvista":
        return poly_data(vertices, faces)
    if kind == "trimesh":
        return need("trimesh").Trimesh(vertices, faces, process=False)
    raise CaseError(f'kind: found "{kind}"; expected "pyvista" or "trimesh"')
