"""Description files of robots and tools: lookup, JSON and schema checks, transforms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import RobotError
from ..json_text import parse_json
from ..resources import assets_dir
from ..validate import rigid_transform

MAX_FILE_BYTES = 1 << 20  # a description is a few kilobytes


def description_path(name_or_path: str | Path, folder: str) -> Path:
    """Return the file for a path, or for the name of a shipped description: letters, digits, '_' and '-' only."""
    text = str(name_or_path)
    shipped = text.replace("_", "").replace("-", "").isalnum()
    return assets_dir() / folder / f"{text}.json" if shipped else Path(text)


def read_bytes(path: Path, folder: str) -> bytes:
    """Return the content of a description; RobotError for a missing, unreadable or too large file."""
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_FILE_BYTES + 1)
    except (FileNotFoundError, NotADirectoryError) as error:
        if path.parent != assets_dir() / folder:
            raise RobotError(f"there is no file {str(path)!r:.200}") from error
        known = ", ".join(sorted(p.stem for p in (assets_dir() / folder).glob("*.json")))
        raise RobotError(f"no {folder[:-1]} '{path.stem}'; shipped are: {known}") from error
    except (OSError, ValueError) as error:
        raise RobotError(f"{path.name} cannot be read: {type(error).__name__}") from error
    if len(data) > MAX_FILE_BYTES:
        raise RobotError(f"{path.name} is larger than {MAX_FILE_BYTES >> 20} MiB")
    return data


def read_description(name_or_path: str | Path, folder: str, schema: str) -> dict[str, Any]:
    """Read a JSON description from a path or a shipped name. Raises RobotError for another schema."""
    path = description_path(name_or_path, folder)
    content = read_bytes(path, folder)
    try:
        data = parse_json(content.decode("utf-8"))
    except ValueError as error:
        raise RobotError(f"{path.name} cannot be read as JSON: {error}") from error
    if not isinstance(data, dict) or data.get("schema") != schema:
        raise RobotError(f"{path.name} is not a {schema} file")
    return data


def check_keys(entry: Any, keys: set[str], what: str) -> None:
    """Raise RobotError if the entry is not a mapping or has an unknown key, such as a misspelt one."""
    if not isinstance(entry, Mapping):
        raise RobotError(f"{what} is not a mapping of names to values")
    unknown = sorted(str(key) for key in set(entry) - keys)
    if unknown:
        raise RobotError(f"{what} has the unknown key '{unknown[0][:60]}'; known are {', '.join(sorted(keys))}")


def check_transform(transform: Array, what: str = "the robot's base") -> Array:
    """Return a read-only copy of a rigid transform (4, 4) in mm; RobotError for any other matrix."""
    matrix = rigid_transform(transform, what, RobotError)
    matrix.setflags(write=False)
    return matrix


def transform_of(xyz: tuple[float, float, float], rpy: tuple[float, float, float]) -> Array:
    """Transform (4, 4) from a translation and URDF angles in rad: rotation Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    transform = np.eye(4)
    transform[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    transform[:3, 3] = xyz
    return transform
