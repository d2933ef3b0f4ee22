"""A cavity case: a body cavity with synthetic organs, and a snake on a fixed base in it (Kwok 2013, study II).

The paper's organs come from a CT and are not published. Here they are rounded bulges of one surface about the pathway
of ``body_cavity``: by ``GAP_MM`` outwards, and nowhere nearer to it than a bound, so a link within its bound touches
none of them. The surface is closed by a floor and a dome, farther away. It is not based on measurements of patients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...geometry.mesh import TriangleMesh
from ...pathway.cavity import body_cavity
from ...pathway.pathway import Pathway
from ...robots.snake import SnakeModel
from .offline.script import DriveSpec
from .settings import Arm, DriveSettings, SnakeSettings
from .spec import LumenContours, SnakeSystemSpec

GAP_MM, CLEFT_MM = 4.0, 14.0  # radial, from the pathway to the top of an organ, and on to the bottom of a cleft
BOUND_MM, TIP_BOUND_MM = 3.0, 1.0  # b_i: smaller for the last link as in the paper, which prints no number
LINKS = 5  # Kwok 2013, study II
# In the pelvis, pointing up as in fig. 8(b). Where it is lower, bends of the first link near the pathway's end are
# within the bounds but cannot be certified, as a motion must not come near the end's contour.
BASE_MM = (0.0, 0.0, 13.0)
_RINGS, _SECTORS = 120, 168
_FLOOR_MM, _DOME_MM = 30.0, 34.0  # height of the round ends
_CAP_RINGS = 14


class Organ(NamedTuple):
    """A bulge of the wall: its place as a share of the way up and an angle about it, and its half sizes.

    angle: degrees from +x, the patient's left, towards +y, the back. along, around: mm.
    """

    name: str
    share: float
    angle: float
    along: float
    around: float


ORGANS = (
    Organ("liver", 0.84, 205.0, 46.0, 70.0), Organ("stomach", 0.80, 335.0, 40.0, 48.0),
    Organ("spleen", 0.86, 25.0, 26.0, 26.0), Organ("pancreas", 0.68, 85.0, 16.0, 55.0),
    Organ("right kidney", 0.62, 140.0, 30.0, 24.0), Organ("left kidney", 0.64, 40.0, 30.0, 24.0),
    Organ("ascending colon", 0.42, 175.0, 62.0, 22.0), Organ("descending colon", 0.42, 5.0, 62.0, 22.0),
    Organ("transverse colon", 0.63, 270.0, 20.0, 70.0), Organ("small bowel, left", 0.45, 305.0, 30.0, 34.0),
    Organ("small bowel, right", 0.45, 240.0, 30.0, 34.0), Organ("small bowel, low", 0.27, 272.0, 24.0, 34.0),
    Organ("small bowel, back", 0.40, 90.0, 34.0, 36.0), Organ("bladder", 0.10, 270.0, 28.0, 40.0),
    Organ("rectum", 0.14, 90.0, 34.0, 24.0), Organ("left ovary", 0.17, 20.0, 18.0, 16.0),
    Organ("right ovary", 0.17, 160.0, 18.0, 16.0),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class CavityCase:
    """The cavity, in mm, LPS: mesh, its organs, and the pathway that links are measured against.

    organ: (F,) of each triangle, an index of ``ORGANS``, or −1 between them. base: (4, 4) transform_base_to_patient.
    """

    mesh: TriangleMesh
    organ: NDArray[np.int64]
    pathway: Pathway
    snake: SnakeModel
    base: Array

    def spec(self, arm: Arm = "certified", settings: SnakeSettings | None = None) -> SnakeSystemSpec:
        """The robot in this cavity, for a control process; ``settings``: at the start, None: the study's bounds."""
        found = settings or SnakeSettings(bound_mm=BOUND_MM, tip_bound_mm=TIP_BOUND_MM)
        return SnakeSystemSpec(self.contours, self.snake, found, _drive(arm), base=self.base)

    @property
    def drive(self) -> DriveSettings:
        """The settings of a drive in it, in the arm ``certified``."""
        return _drive("certified")

    def script(self, arm: Arm = "certified", step_s: float = 0.01) -> DriveSpec:
        """The same for a script, in steps of ``step_s`` s."""
        return DriveSpec(self.contours, self.snake, drive=_drive(arm, step_s), base=self.base)

    @property
    def contours(self) -> LumenContours:
        """The pathway as plain arrays."""
        path = self.pathway
        return LumenContours(path.centre, path.radius, path.count, path.knots, first=path.first)


def cavity_case() -> CavityCase:
    """The cavity of study II: 13 contours of 28 polar radii, synthetic organs about them, and five links on a base."""
    pathway = body_cavity()
    mesh, organ = _surface(pathway)
    base = np.eye(4)
    base[:3, 3] = BASE_MM
    base.setflags(write=False)
    return CavityCase(mesh, organ, pathway, SnakeModel(LINKS), base)


def _drive(arm: Arm, step_s: float = 0.001) -> DriveSettings:
    return DriveSettings(
        step_s=step_s, manipulated=LINKS, bends=8, bound_mm=BOUND_MM, tip_bound_mm=TIP_BOUND_MM, arm=arm,
        contours=13, interpolated=13, angles=28,
    )  # fmt: skip


def _surface(pathway: Pathway) -> tuple[TriangleMesh, NDArray[np.int64]]:
    """The closed surface, whose triangles face outwards, and the organ of each triangle."""
    rim, outwards, share, angle = _rims(pathway)
    height, organ = _heights(pathway.length, share, angle, rim)
    rings = rim + (GAP_MM + CLEFT_MM - height)[..., None] * outwards
    floor, dome = _cap(rings[0], -_FLOOR_MM), _cap(rings[-1], _DOME_MM)
    rows = np.concatenate([floor[::-1], rings, dome])
    kinds = np.concatenate([np.full(floor.shape[:2], -1), organ, np.full(dome.shape[:2], -1)])
    count, around = rows.shape[:2]
    i, j = (one.ravel() for one in np.meshgrid(np.arange(count - 1), np.arange(around), indexing="ij"))
    a, b = i * around + j, i * around + (j + 1) % around
    sides = np.concatenate([np.column_stack([a, b, b + around]), np.column_stack([a, b + around, a + around])])
    low, high, k = count * around, count * around + 1, np.arange(around)
    last = (count - 1) * around
    ends = [np.column_stack([np.full(around, low), (k + 1) % around, k])]
    ends.append(np.column_stack([np.full(around, high), last + k, last + (k + 1) % around]))
    poles = np.stack([rows[0].mean(axis=0), rows[-1].mean(axis=0)])
    faces = np.concatenate([sides, *ends]).astype(np.int32)
    mesh = TriangleMesh(np.concatenate([rows.reshape(-1, 3), poles]), faces)
    of_faces = np.append(kinds.ravel(), [-1, -1])[faces].max(axis=1)
    return mesh, of_faces.astype(np.int64)


def _rims(pathway: Pathway) -> tuple[Array, Array, Array, Array]:
    """Points (n, m, 3) of the pathway's surface, outward directions there, shares (n,) of the way, angles (m,) rad."""
    of = pathway.contours()
    angle = 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS
    known = 2.0 * np.pi * np.arange(of.radius.shape[1]) / of.radius.shape[1]
    across = np.cross(of.tangent, of.first)
    way = np.cos(angle)[None, :, None] * of.first[:, None] + np.sin(angle)[None, :, None] * across[:, None]
    radius = np.array([np.interp(angle, known, one, period=2.0 * np.pi) for one in of.radius])
    at = np.linspace(0.0, 1.0, _RINGS)
    where = at * (len(of.s) - 1)
    low = np.minimum(where.astype(int), len(of.s) - 2)
    part = (where - low)[:, None, None]
    edge = of.centre[:, None] + radius[..., None] * way
    rim = (1.0 - part) * edge[low] + part * edge[low + 1]
    outwards = (1.0 - part) * way[low] + part * way[low + 1]
    return rim, outwards / np.linalg.norm(outwards, axis=2, keepdims=True), at, angle


def _heights(length: float, share: Array, angle: Array, rim: Array) -> tuple[Array, NDArray[np.int64]]:
    """(n, m) mm by which organs stand out of the clefts' bottom, and the one that does, −1: none."""
    radius = np.linalg.norm(rim - rim.mean(axis=1, keepdims=True), axis=2).mean(axis=1)
    found, which = np.zeros(rim.shape[:2]), np.full(rim.shape[:2], -1)
    for number, organ in enumerate(ORGANS):
        turned = (angle - math.radians(organ.angle) + np.pi) % (2.0 * np.pi) - np.pi
        along = (share - organ.share)[:, None] * length / organ.along
        around = turned[None, :] * radius[:, None] / organ.around
        height = CLEFT_MM * np.sqrt(np.clip(1.0 - (along**2 + around**2) ** 2, 0.0, None))
        which[height > found] = number
        found = np.maximum(found, height)
    return found, which


def _cap(ring: Array, height: float) -> Array:
    """Rings (k, m, 3) from next to ``ring`` (m, 3) to near a pole ``height`` mm along z from its centre."""
    centre = ring.mean(axis=0)
    turn = 0.5 * np.pi * (np.arange(_CAP_RINGS) + 1) / (_CAP_RINGS + 1)
    rings: Array = centre + np.cos(turn)[:, None, None] * (ring - centre)
    rings[..., 2] += height * np.sin(turn)[:, None]
    return rings
