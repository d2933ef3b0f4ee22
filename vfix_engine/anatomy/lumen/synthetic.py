"""Synthetic colons for tests and first steps: haustra between folds, and optionally two walls that have fused.

The lumen is the union of balls along a curve; its surface is extracted by marching cubes (Lewiner et al. 2003, as in
scikit-image). It is not based on measurements of patients. A whole colon for a drive is in ``colon_case.py``.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh

_VOXEL = 1.5  # [mm] of the grid from which the surface is extracted
_SIZE = 1.2  # scale that makes the course about 600 mm long
_HAUSTRA = 32.0  # [mm] approximate distance between folds
_FOLD = 0.22  # reduction of the radius by a fold, as a fraction
_APART = 33.0  # [mm] distance of the axes of the limbs that touch: 3 mm of wall between them
_OPENING = 2.0  # [mm] radius of the hole through fused walls


@dataclass(frozen=True, eq=False)
class SyntheticCourse:
    """Geometry of a synthetic colon.

    curve: from anus to caecum; radius: (N,) mm at its points; landmarks: name → (3,) mm in the patient frame.
    """

    curve: Curve
    radius: Array
    landmarks: dict[str, Array]


def synthetic_course(seed: int = 0, fused: bool = False) -> SyntheticCourse:
    """Generate the course of a colon of about 600 mm, in LPS mm; every seed gives different flexures and folds.

    fused: two straight adjacent limbs instead, whose walls touch.
    """
    rng = np.random.default_rng(seed)
    corners = _limbs() if fused else _colon_corners(rng)
    curve = Curve.through(corners, step_mm=1.0)
    s = np.arange(len(curve.points)) * curve.step_mm
    phase = 2.0 * math.pi * s / (_HAUSTRA * rng.uniform(0.9, 1.1)) + rng.uniform(0.0, 2.0 * math.pi)
    # A fold is narrow and a haustrum wide: the trough of the wave is sharpened.
    fold = np.maximum(np.cos(phase), 0.0) ** 2
    wide = 15.5 + 1.5 * np.sin(2.0 * math.pi * s / rng.uniform(180.0, 260.0) + rng.uniform(0.0, 2.0 * math.pi))
    radius = np.full(len(s), 15.0) if fused else wide * (1.0 - _FOLD * fold)
    radius.setflags(write=False)
    share = {"anus": 0.0, "first_flexure": 0.36, "second_flexure": 0.72, "caecum": 1.0}
    landmarks = {name: curve.position(part * curve.length) for name, part in share.items()}
    return SyntheticCourse(curve, radius, landmarks)


def synthetic_colon(seed: int = 0, fused: bool = False) -> TriangleMesh:
    """Generate the closed surface of a colon along ``synthetic_course(seed, fused)``, with outward normals.

    fused: with a hole of 2 mm radius through the walls that touch, a false shortcut that skips the far half of the
        lumen.
    """
    course = synthetic_course(seed, fused)
    centres, radii = course.curve.points[::2], course.radius[::2]
    if fused:
        bridge = np.linspace(*_bridge(), 60)
        centres, radii = np.concatenate([centres, bridge]), np.concatenate([radii, np.full(len(bridge), _OPENING)])
    margin = float(radii.max()) + 3.0 * _VOXEL
    low = centres.min(axis=0) - margin
    shape = np.ceil((centres.max(axis=0) + margin - low) / _VOXEL).astype(np.int64) + 1
    field = np.full(shape, margin, dtype=np.float32)
    for centre, radius in zip(centres, radii, strict=True):
        _add_ball(field, (centre - low) / _VOXEL, radius / _VOXEL)
    from skimage.measure import marching_cubes  # imported here: slow to load

    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="descent")
    return TriangleMesh(low + _VOXEL * vertices.astype(np.float64), faces)


def write_stl(path: Path, mesh: TriangleMesh) -> None:
    """Write a binary STL in the mesh's own frame, which an STL cannot state."""
    records = np.zeros(len(mesh.faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    records["normal"], records["corners"] = mesh.face_normals, mesh.triangles
    head = b"made up, not for clinical use".ljust(80)
    path.write_bytes(head + struct.pack("<I", len(records)) + records.tobytes())


def _colon_corners(rng: np.random.Generator) -> Array:
    """Corners of a course: up the left side, across, and down the right side, like the large bowel."""
    corners = np.array(
        [
            [0.0, 40.0, 0.0], [8.0, 24.0, 40.0], [42.0, 8.0, 72.0], [66.0, 4.0, 116.0], [68.0, 10.0, 166.0],
            [40.0, 6.0, 206.0], [-10.0, -8.0, 208.0], [-58.0, -6.0, 200.0], [-92.0, 4.0, 164.0], [-94.0, 10.0, 112.0],
            [-88.0, 12.0, 70.0],
        ]
    )  # fmt: skip
    corners[1:-1] += rng.uniform(-4.0, 4.0, (len(corners) - 2, 3))
    return _SIZE * corners


def _limbs() -> Array:
    """Two adjacent limbs of 170 mm and the wide bend that connects them."""
    up = np.column_stack([np.zeros(10), np.zeros(10), np.linspace(0.0, 170.0, 10)])
    down = up[::-1] + np.array([_APART, 0.0, 0.0])
    turn = np.radians(np.linspace(205.0, -25.0, 12))
    loop = np.column_stack([0.5 * _APART + 44.0 * np.cos(turn), np.zeros(12), 262.0 + 44.0 * np.sin(turn)])
    bow = np.array([[-7.0, 0.0, 207.0], [_APART + 7.0, 0.0, 207.0]])
    return np.concatenate([up, bow[:1], loop, bow[1:], down])


def _bridge() -> tuple[Array, Array]:
    """The hole's ends, on the axes of both limbs."""
    return np.array([0.0, 0.0, 60.0]), np.array([_APART, 0.0, 60.0])


def _add_ball(field: NDArray[np.float32], centre: Array, radius: float) -> None:
    """Reduce a field of distances, in voxels, to those from a ball around ``centre``."""
    reach = radius + 3.0
    first = np.maximum(np.floor(centre - reach), 0).astype(np.int64)
    last = np.minimum(np.ceil(centre + reach) + 1, field.shape).astype(np.int64)
    x, y, z = (np.arange(a, b) - c for a, b, c in zip(first, last, centre, strict=True))
    away = np.sqrt((x**2)[:, None, None] + (y**2)[None, :, None] + (z**2)[None, None, :]) - radius
    part = field[first[0] : last[0], first[1] : last[1], first[2] : last[2]]
    np.minimum(part, away, out=part, casting="same_kind")
