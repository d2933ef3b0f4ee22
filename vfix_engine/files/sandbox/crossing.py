"""Serialisation of values between a worker process and its caller: JSON and .npy files, never pickle.

Only the types listed here are supported. Files of a worker are untrusted: they are read as plain files of bounded size.
"""

from __future__ import annotations

import importlib
import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

# Module of each type, imported only when needed, since a worker that reads a header needs no mesh library.
_MODULE_OF = {
    "TriangleMesh": "vfix_engine.geometry.mesh",
    "FrameReport": "vfix_engine.files.frame_report",
    "BoneSurfaces": "vfix_engine.anatomy.bone",
    "SurfaceReport": "vfix_engine.anatomy.bone",
    "Dropped": "vfix_engine.anatomy.surface",
    "LabelSurface": "vfix_engine.anatomy.labels.surfaces",
    "Place": "vfix_engine.anatomy.labels.reading",
    "Segmentation": "vfix_engine.anatomy.labels.reading",
    "Volume": "vfix_engine.files.volume",
}

MAX_JSON_BYTES = 16 << 20  # arrays are separate


def save(value: Any, folder: Path, name: str) -> None:
    """Write a value as `name`.json, its arrays as `name`-N.npy."""
    arrays: list[np.ndarray[Any, Any]] = []
    text = json.dumps(_encoded(value, arrays))
    for number, array in enumerate(arrays):
        np.save(folder / f"{name}-{number}.npy", array, allow_pickle=False)
    (folder / f"{name}.json").write_text(text, encoding="utf-8")


def load(folder: Path, name: str, max_bytes: int) -> Any:
    """Read a value that `save` wrote, with at most `max_bytes` of arrays in total.

    Can raise any exception for a file that `save` did not write; at a trust boundary the caller catches all.
    """
    return _decoded(read_json(folder / f"{name}.json", MAX_JSON_BYTES), _Arrays(folder, name, max_bytes))


def read_json(file: Path, max_bytes: int) -> Any:
    """Read JSON from a plain file of at most `max_bytes`. Raises OSError or ValueError."""
    with _opened(file, max_bytes) as opened:
        return json.loads(opened.read(max_bytes))


@contextmanager
def _opened(file: Path, max_bytes: int) -> Iterator[BinaryIO]:
    """Open a plain file; links are not followed and pipes are refused, since they could block the reader."""
    plain = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    with open(file, "rb", opener=lambda path, flags: os.open(path, flags | plain)) as opened:
        state = os.fstat(opened.fileno())
        if not stat.S_ISREG(state.st_mode) or state.st_size > max_bytes:
            raise ValueError("what the worker left is no plain file of a size that is taken.")
        yield opened


class _Arrays:
    """The arrays of one value; every read counts towards the size limit."""

    def __init__(self, folder: Path, name: str, max_bytes: int) -> None:
        self._folder, self._name, self._left = folder, name, max_bytes

    def read(self, number: int) -> np.ndarray[Any, Any]:
        with _opened(self._folder / f"{self._name}-{number}.npy", self._left) as file:
            self._left -= os.fstat(file.fileno()).st_size
            array: np.ndarray[Any, Any] = np.lib.format.read_array(file, allow_pickle=False)
            return array


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
    if is_dataclass(value) and _MODULE_OF.get(type(value).__name__) == type(value).__module__:
        content = {field.name: _encoded(getattr(value, field.name), arrays) for field in fields(value)}
        return {"kind": type(value).__name__, "value": content}
    raise TypeError(f"a {type(value).__name__} does not cross between processes.")


def _decoded(value: Any, arrays: _Arrays) -> Any:
    if not isinstance(value, dict):
        return value
    kind, content = value["kind"], value["value"]
    if kind == "path":
        return Path(content)
    if kind == "array":
        return arrays.read(int(content))
    if kind == "tuple":
        return tuple(_decoded(item, arrays) for item in content)
    if kind == "list":
        return [_decoded(item, arrays) for item in content]
    if kind == "dict":
        return {key: _decoded(item, arrays) for key, item in content}
    if kind not in _MODULE_OF:
        raise ValueError("the worker answered with a value of a kind that is not accepted.")
    return getattr(importlib.import_module(_MODULE_OF[kind]), kind)(
        **{key: _decoded(item, arrays) for key, item in content.items()}
    )
