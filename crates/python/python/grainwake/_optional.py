"""Optional packages, and words."""

from __future__ import annotations

import importlib
from typing import Any

_EXTRAS = {"pandas": "tables", "xarray": "fields", "pyvista": "meshes", "trimesh": None}


def counted(number: int, noun: str) -> str:
    """Number and noun, such as "1 grain" and "2 grains"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def need(name: str) -> Any:
    """Import a package, or say how to install it."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        extra = _EXTRAS.get(name)
        how = f"pip install 'grainwake[{extra}]'" if extra else f"pip install {name}"
        raise ImportError(f"this needs the package {name}: {how}", name=name) from error
