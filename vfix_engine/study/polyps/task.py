"""The task of study I: polyps, where they are in moving tissue, and where it ends."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import TissueMotion
from ...validate import within
from .printed import HOLD_S, PROUD_MM

RADIUS_MM = 3.0  # of the drawn ball; not printed
NEAR_END_MM = 2.0  # nearer than that the depth that a robot reaches is reached: tissue that moves changes the way
_SAME_MM = 1e-6
FIRST_MARK, LAST_MARK = "rectosigmoid", "ascending"  # landmarks where polyps begin, and where the task ends

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Polyp:
    """A polyp on the wall of a lumen at rest, LPS mm.

    s_mm: arc length along the curve that the robot follows. wall: the point of the wall under it; normal: unit, into
    the lumen; axis: the point of the curve at ``s_mm``.
    """

    s_mm: float
    wall: Place
    normal: Place
    axis: Place

    @property
    def target(self) -> Array:
        """(3,) its middle at rest, which is aimed at."""
        return np.array(self.wall) + PROUD_MM * np.array(self.normal)


@dataclass(frozen=True)
class PolypTask:
    """What is to be looked at, and where the task ends.

    polyps: in the order of their places along the lumen. from_mm, end_mm: the part of the way in which they are; at the
    tip's arc length ``done_mm`` the task is completed. end_name: of the landmark at ``end_mm``, None where it is the
    depth that the robot reaches. seed: of the polyps. viewable_share: of the wall in that part, by area, how much this
    robot can view, None if nobody asked; the polyps are drawn there. hold_s: for how long one has to be viewed.
    surface: ``surface_hash`` of the lumen that they are in, None in a run of before it was kept.
    """

    polyps: tuple[Polyp, ...]
    from_mm: float
    end_mm: float
    end_name: str | None = None
    seed: int = 0
    viewable_share: float | None = None
    hold_s: float = HOLD_S
    surface: str | None = None

    @property
    def done_mm(self) -> float:
        """The tip's arc length from which the task is completed: its end, or 2 mm before the depth that is reached."""
        return self.end_mm - (NEAR_END_MM if self.end_name is None else _SAME_MM)

    def targets(self, motion: TissueMotion | None = None, t: float = 0.0) -> Array:
        """(n, 3) LPS mm, the polyps' middles at the time t in s: they move with the wall.

        A polyp is displaced as the pathway is at its arc length, and drawn to the pathway's axis as its radii are.
        """
        rest = np.array([polyp.target for polyp in self.polyps]).reshape(-1, 3)
        if motion is None:
            return rest
        axis = np.array([polyp.axis for polyp in self.polyps]).reshape(-1, 3)
        shift, factor = motion(np.array([polyp.s_mm for polyp in self.polyps]), t)
        moved: Array = axis + shift + factor[:, None] * (rest - axis)
        return moved

    def to_dict(self) -> dict[str, Any]:
        """JSON's types."""
        values = asdict(self)
        values["polyps"] = [asdict(polyp) for polyp in self.polyps]
        return values

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse. Raises InputError for what is no such task."""
        try:
            polyps = tuple(
                Polyp(_length(one, "s_mm"), *(checked_place(one[key]) for key in ("wall", "normal", "axis")))
                for one in values["polyps"]
            )
            share, name, surface = values["viewable_share"], values["end_name"], values.get("surface")
            return cls(
                polyps, _length(values, "from_mm"), _length(values, "end_mm"), None if name is None else str(name),
                int(values["seed"]), None if share is None else float(share),
                _length({"hold_s": HOLD_S} | dict(values), "hold_s"), None if surface is None else str(surface),
            )  # fmt: skip
        except (KeyError, TypeError, ValueError, InputError) as error:
            raise InputError(f"this is no task of polyps: {error}") from error


def surface_hash(mesh: TriangleMesh) -> str:
    """'sha256:' and the hash of a surface's vertices and triangles, bit by bit."""
    return f"sha256:{hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).hexdigest()}"


def at_rest(polyp: Polyp, point: Array, motion: TissueMotion | None, t: float) -> Array:
    """(3,) where a point of the moving tissue near a polyp is when the tissue rests: the inverse of ``targets``."""
    if motion is None:
        return point
    shift, factor = motion(np.array([polyp.s_mm]), t)
    axis = np.array(polyp.axis)
    rest: Array = axis + (point - axis - shift[0]) / factor[0]
    return rest


def _length(values: Mapping[str, Any], name: str) -> float:
    """A finite number of at least 0. Raises KeyError, InputError."""
    return within(name, values[name], 0.0)


def checked_place(values: Any) -> Place:
    """Three numbers as a place. Raises ValueError, TypeError."""
    x, y, z = (float(value) for value in values)
    if not np.isfinite((x, y, z)).all():
        raise ValueError(f"{values!r:.60} is no place")
    return x, y, z
