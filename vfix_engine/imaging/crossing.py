"""How values cross from a worker process and back: JSON, with arrays beside it as .npy files. Never pickle.

The types that may cross are listed here; anything else is refused.
"""

from __future__ import annotations

import importlib
import json
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

# Where each type is defined: imported only when one crosses, since a worker that reads a header needs no mesh library.
_HOMES = {
    "TriangleMesh": "vfix_engine.geometry.mesh",
    "FrameReport": "vfix_engine.imaging.frame_report",
    "BoneSurfaces": "vfix_engine.imaging.bone",
    "SurfaceReport": "vfix_engine.imaging.bone",
    "Dropped": "vfix_engine.imaging.surface",
    "Volume": "vfix_engine.imaging.volume",
}


def save(value: Any, folder: Path, name: str) -> None:
    """Write a value as `name`.json, its arrays as `name`-N.npy."""
    arrays: list[np.ndarray[Any, Any]] = []
    text = json.dumps(_encoded(value, arrays))
    for number, array in enumerate(arrays):
        np.save(folder / f"{name}-{number}.npy", array, allow_pickle=False)
    (folder / f"{name}.json").write_text(text, encoding="utf-8")


def load(folder: Path, name: str) -> Any:
    """Read a value that `save` wrote. Raises ValueError when it was not."""
    return _decoded(json.loads((folder / f"{name}.json").read_text(encoding="utf-8")), folder, name)


def _encoded(value: Any, arrays: list[np.ndarray[Any, Any]]) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Path):
        return {"kind": "path", "value": str(value)}
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"kind": "array", "value": len(arrays) - 1}
    if isinstance(value, tuple):
        return {"kind": "tuple", "value": [_encoded(item, arrays) for item in value]}
    if isinstance(value, list):
        return {"kind": "list", "value": [_encoded(item, arrays) for item in value]}
    if isinstance(value, dict):
        return {"kind": "dict", "value": [[str(key), _encoded(item, arrays)] for key, item in value.items()]}
    if is_dataclass(value) and _HOMES.get(type(value).__name__) == type(value).__module__:
        content = {field.name: _encoded(getattr(value, field.name), arrays) for field in fields(value)}
        return {"kind": type(value).__name__, "value": content}
    raise TypeError(f"a {type(value).__name__} does not cross between processes.")


def _decoded(value: Any, folder: Path, name: str) -> Any:
    if not isinstance(value, dict):
        return value
    kind, content = value["kind"], value["value"]
    if kind == "path":
        return Path(content)
    if kind == "array":
        return np.load(folder / f"{name}-{int(content)}.npy", allow_pickle=False)
    if kind == "tuple":
        return tuple(_decoded(item, folder, name) for item in content)
    if kind == "list":
        return [_decoded(item, folder, name) for item in content]
    if kind == "dict":
        return {key: _decoded(item, folder, name) for key, item in content}
    if kind not in _HOMES:
        raise ValueError("the worker answered with a value of a kind that does not cross.")
    return getattr(importlib.import_module(_HOMES[kind]), kind)(
        **{key: _decoded(item, folder, name) for key, item in content.items()}
    )
