"""No-fly zones: solid shapes and patches of surface that no part of the tool enters, each with its own margin.

A zone is an obstacle in addition to the anatomy. Its pairs give boundary rows (Li 2007, eq. 16) with the zone's
margin, and the certificate checks its distance like that of bone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError, StartRefused
from ..geometry.mesh import TriangleMesh
from ..geometry.shape_patch import patch_around, patch_of
from ..geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from ..proximity.proximity import Proximity, ProximityTree

ANATOMY = "bone"  # id of the structure that the tool is driven in
SHAPES = (Sphere, CapsuleShape, Box, HalfSpace)
LARGEST_MARGIN_MM = 20.0  # beyond it, use a larger shape
_LONGEST_NAME = 80


@dataclass(frozen=True, eq=False)
class Zone:
    """A solid or a surface from which the tool keeps a distance of at least ``margin_mm``.

    solid: a shape, or the tree of a surface (``ProximityTree``).
    A shape has an inside. A surface has none: the margin applies on both of its sides.

    Raises:
        InputError: the message names the zone and the invalid value.

    Example:
        >>> from vfix_engine.geometry.shapes import Sphere
        >>> zone = Zone("optic nerve", Sphere((0, 0, 0), radius=2.0), margin_mm=1.0)
        >>> zone.label
        "protected structure 'optic nerve'"
    """

    name: str
    solid: Shape | Proximity
    margin_mm: float

    def __post_init__(self) -> None:
        check_name(self.name, "protected structure")
        if not isinstance(self.solid, SHAPES) and not hasattr(self.solid, "pairs_within"):
            raise InputError(f"{self.label} is a {type(self.solid).__name__}; it needs a shape or a surface's tree")
        margin = check_number(self.margin_mm, f"{self.label}: the margin in mm")
        if not 0.0 <= margin <= LARGEST_MARGIN_MM:  # NaN fails as well
            raise InputError(f"{self.label}: the margin is {margin:g} mm; allowed is 0 … {LARGEST_MARGIN_MM:g} mm")
        object.__setattr__(self, "margin_mm", margin)

    @property
    def label(self) -> str:
        """\"protected structure 'optic nerve'\"."""
        return f"protected structure '{self.name}'"

    @classmethod
    def around(cls, name: str, mesh: TriangleMesh, centre: ArrayLike, radius_mm: float, margin_mm: float) -> Zone:
        """Create a zone from the anatomy within ``radius_mm`` of ``centre`` (3,), in mm, patient frame."""
        return cls(name, _tree(name, lambda: patch_around(mesh, centre, radius_mm)), margin_mm)

    @classmethod
    def of_faces(cls, name: str, mesh: TriangleMesh, chosen: ArrayLike, margin_mm: float) -> Zone:
        """Create a zone from the triangles of a mesh selected by a mask (F,) or by indices (k,)."""
        return cls(name, _tree(name, lambda: patch_of(mesh, chosen)), margin_mm)


def _tree(name: str, patch: Callable[[], TriangleMesh]) -> ProximityTree:
    """Build the tree of a patch; an InputError is raised again with the name of the zone."""
    try:
        return ProximityTree(patch())
    except InputError as error:
        raise InputError(f"protected structure '{name}': {error}") from error


def ordered(zones: Sequence[Zone]) -> tuple[Zone, ...]:
    """Return zones in the order of their obstacles, from 1: surfaces first, then shapes.

    Raises:
        InputError: two zones have the same name.
    """
    names = [zone.name for zone in zones]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"two protected structures are called '{twice[0]}'")
    return (*(z for z in zones if not isinstance(z.solid, SHAPES)), *(z for z in zones if isinstance(z.solid, SHAPES)))


def bodies(zones: Sequence[Zone]) -> tuple[tuple[Proximity, ...], tuple[Shape, ...]]:
    """Surfaces and shapes of ``ordered`` zones."""
    surfaces = tuple(z.solid for z in zones if not isinstance(z.solid, SHAPES))
    shapes = tuple(z.solid for z in zones if isinstance(z.solid, SHAPES))
    return surfaces, shapes


def refuse_start(zones: Sequence[Zone], distance: Array, parts: Sequence[str], further_mm: float = 0.0) -> None:
    """Refuse a start inside a zone or its margin (HAZ-04).

    Args:
        zones: in the order of their obstacles; distance: (z, S) from each zone to each segment in mm; parts: S names.
        further_mm: added to every margin.

    Raises:
        StartRefused: the message names the zone, the part of the tool and the distance.
    """
    for zone, row in zip(zones, distance, strict=True):
        worst = int(row.argmin())
        margin = zone.margin_mm + further_mm
        if row[worst] >= margin:
            continue
        if row[worst] < 0.0:
            where = f"inside {zone.label}, {-row[worst]:.2f} mm deep"
        else:
            where = f"{row[worst]:.2f} mm from {zone.label}, less than its margin of {margin:g} mm"
        raise StartRefused(f"the {parts[worst]} would start {where}; move the entry, or make the zone smaller")


def check_name(name: object, what: str) -> str:
    """Return the name of a zone: one line of printable text, at most 80 characters; InputError otherwise."""
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(f"a {what} needs a name of visible characters")
    if len(name) > _LONGEST_NAME:
        raise InputError(f"a {what}'s name has {len(name)} characters; {_LONGEST_NAME} are allowed")
    return name


def check_number(value: object, what: str) -> float:
    """Return the value as a float; InputError for text and booleans. NaN and infinity are accepted."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.floating, np.integer)):
        raise InputError(f"{what} must be a number")
    return float(value)


def check_positive(value: object, what: str, largest: float) -> float:
    """Return a positive number up to ``largest``; InputError otherwise."""
    number = check_number(value, what)
    if not 0.0 < number <= largest:  # NaN fails as well
        raise InputError(f"{what} is {number:g}; it must be positive, {largest:g} at most")
    return number
