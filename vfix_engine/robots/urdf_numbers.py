"""Numbers of a URDF, with checks of their count, finiteness and range."""

from __future__ import annotations

import math
import re

import numpy as np

from ..arrays import Array
from ..errors import RobotError
from .description import transform_of
from .xml_reader import Element

MM_PER_M = 1000.0
MAX_LENGTH_M = 100.0
MAX_ANGLE = 1e4  # [rad]
MAX_RATE = 1e12  # of a speed, effort or mass: files use huge values to express no limit
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


def read_origin(element: Element, where: str) -> Array:
    """Transform (4, 4) of an element's <origin>, in mm; the identity if there is none."""
    origin = element.first("origin")
    if origin is None:
        return np.eye(4)
    x, y, z = numbers(origin.attributes.get("xyz", "0 0 0"), 3, f"{where}: origin xyz", MAX_LENGTH_M)
    roll, pitch, yaw = numbers(origin.attributes.get("rpy", "0 0 0"), 3, f"{where}: origin rpy", MAX_ANGLE)
    return transform_of((MM_PER_M * x, MM_PER_M * y, MM_PER_M * z), (roll, pitch, yaw))


def numbers(text: str, count: int, what: str, most: float = MAX_RATE) -> tuple[float, ...]:
    """Parse exactly ``count`` finite numbers; RobotError otherwise."""
    words = text.split()
    if len(words) != count:
        raise RobotError(f"{what} has {len(words)} numbers instead of {count}")
    return tuple(number(word, what, most) for word in words)


def number(text: str, what: str, most: float = MAX_RATE) -> float:
    """Parse a finite number of magnitude at most ``most``; RobotError otherwise."""
    word = text.strip()
    value = float(word) if _NUMBER.fullmatch(word) else math.nan
    if not math.isfinite(value):
        raise RobotError(f"{what} is '{short(word)}', not a finite number")
    if abs(value) > most:
        raise RobotError(f"{what} is {value:g}; the largest that is accepted is {most:g}")
    return value


def short(text: str) -> str:
    """Prepare a name from a file for a message: at most 60 characters, unprintable ones replaced."""
    return "".join(letter if letter.isprintable() else "?" for letter in text[:60])
