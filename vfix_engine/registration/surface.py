"""Refinement of a registration on a surface: points touched on bone are moved onto its triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import InputError
from ..frames import inverse
from ..geometry.mesh import TriangleMesh
from ..proximity.proximity import Proximity, ProximityTree
from ..validate import rigid_transform, within
from .points import Registration, checked_points
from .rigid_fit import rigid_fits

FEWEST = 10  # smallest number of points that are kept
WORST_START_RMS_MM = 30.0  # rms distance above which a start is rejected

_MOST_STEPS = 300
_MORE_STARTS, _SPREAD_MM = 6, 1.5  # and their differences, per axis and by rotation at the points
_DONE_MM = 1e-4  # largest displacement of a point by the last step
_FREE = 1e-3  # stability below which a motion is unconstrained


@dataclass(frozen=True, eq=False)
class SurfaceRefinement:
    """Registration of points to a surface.

    transform: (4, 4) from the mesh's frame to that of the points, mm; like the initial one.
    residual_mm: rms distance of the kept points from the surface. It is not the accuracy: a residual of 0.15 mm
        can occur with errors of up to 3 mm at a target, since points slide along the surface and the worst are
        excluded. Evaluate the result on points that were not used, such as beads.
    distances_mm: (n,) of every point from the surface. kept: (n,) bool, those used in the last step.
    moved_mm: largest displacement of a point from its position by the initial registration.
    stability: from 0 to 1, resistance of the surface to the motion it constrains least; near 0 on a plane or a ball.
    steps: of the iteration. converged: whether the last step moved no point by more than 0.1 µm.
    """

    transform: Array
    residual_mm: float
    distances_mm: Array
    kept: NDArray[np.bool_]
    moved_mm: float
    stability: float
    steps: int
    converged: bool


def refine_on_surface(
    mesh: TriangleMesh | Proximity, points: ArrayLike, initial: Registration | ArrayLike, *, keep: float = 0.75
) -> SurfaceRefinement:
    """Move points onto a surface, starting from a registration that is accurate to some millimetres.

    Trimmed iterative closest points (Besl & McKay 1992; Chetverikov et al. 2002): closest points on the triangles
    are computed and the nearest fraction of the pairs is fitted, until convergence; from the given start and from six
    around it, of which the one with the smallest final distance is used. The surface must constrain every motion,
    which is tested as in Gelfand et al. 2003.

    Args:
        mesh: the surface, such as bone in the image; or its ``ProximityTree``, which saves the time to build it.
        points: (n, 3) mm, touched on that surface, such as measured on the patient.
        initial: (4, 4) from the mesh's frame to that of the points; or a ``Registration`` whose moving frame is the
            mesh's and whose fixed frame is that of the points.
        keep: fraction of the points that are fitted, 0.5 to 1; the others are treated as slips of the pointer.

    Raises:
        InputError: fewer than 10 points are kept, they are far from the surface, or they lie on a part like a plane,
            a ball or a cylinder, along which they can slide.
    """
    keep = within("the share of points to keep", keep, 0.5, 1.0)
    touched = checked_points("the touched points", points)
    count = int(np.floor(keep * len(touched) + 1e-9))
    if count < FEWEST:
        raise InputError(
            f"{keep:.0%} of {len(touched)} points are too few to fit a surface; at least {FEWEST} have to be kept: "
            "touch more points, spread over the surface"
        )
    tree = ProximityTree(mesh) if isinstance(mesh, TriangleMesh) else mesh
    given = initial.transform if isinstance(initial, Registration) else initial
    start = inverse(rigid_transform(given, "the initial registration"))
    first = touched @ start[:3, :3].T + start[:3, 3]
    best = min((_settled(tree, begin, count) for begin in _starts(first)), key=lambda one: one.residual_mm)
    kept = np.zeros(len(touched), dtype=bool)
    kept[best.near] = True
    stability = _stability(best.placed[kept], tree.mesh.face_normals[best.triangle[kept]])
    if stability < _FREE:
        raise InputError(
            "the touched points lie where the surface slides along itself, like a plane, a ball or a cylinder; touch "
            "points on edges and on other sides too"
        )
    rotation, translation = rigid_fits(touched, best.placed, np.ones(len(touched)))
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, translation
    for array in (transform, best.distance, kept):
        array.setflags(write=False)
    moved = float(np.linalg.norm(best.placed - first, axis=1).max())
    return SurfaceRefinement(
        transform, best.residual_mm, best.distance, kept, moved, stability, best.steps, best.converged
    )


@dataclass(frozen=True, eq=False)
class _Settled:
    """Result of the iteration from one start: transformed points (n, 3), their distances and triangles, those kept."""

    placed: Array
    distance: Array
    triangle: NDArray[np.int32]
    near: NDArray[np.intp]
    residual_mm: float
    steps: int
    converged: bool


def _starts(placed: Array) -> list[Array]:
    """Return the given start and some around it, since the iteration can end in a local minimum."""
    centre = placed.mean(axis=0)
    random = np.random.default_rng(0)
    size = max(float(np.sqrt(((placed - centre) ** 2).sum(axis=1).mean())), 1.0)
    starts = [placed]
    for _ in range(_MORE_STARTS):
        x, y, z = random.normal(0.0, _SPREAD_MM / size, 3)
        turn = np.linalg.qr(np.eye(3) + np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]))[0]
        turn = turn * np.sign(np.diag(turn))  # the QR factor's columns are unique up to their sign
        starts.append((placed - centre) @ turn.T + centre + random.normal(0.0, _SPREAD_MM, 3))
    return starts


def _settled(tree: Proximity, placed: Array, count: int) -> _Settled:
    steps, converged = 0, False
    while True:
        distance, closest, triangle = tree.point_distance(placed)
        near = np.argsort(distance, kind="stable")[:count]
        residual = float(np.sqrt((distance[near] ** 2).mean()))
        if not residual < WORST_START_RMS_MM:
            raise InputError(
                f"the points are {residual:.0f} mm from the surface; register by points first, or check that points "
                "and surface belong together"
            )
        if converged or steps == _MOST_STEPS:
            return _Settled(placed, distance, triangle, near, residual, steps, converged)
        rotation, translation = rigid_fits(closest[near], placed[near], np.ones(count))
        moved = placed @ rotation.T + translation
        converged = float(np.linalg.norm(moved - placed, axis=1).max()) < _DONE_MM
        placed, steps = moved, steps + 1


def _stability(points: Array, normals: Array) -> float:
    """Resistance of normals (n, 3) to the rigid motion of points (n, 3) that they constrain least, from 0 to 1.

    Three times the smallest mean square of the motion along the normals, with rotations in units of the points' rms
    distance from their centre: 0 for an unconstrained motion, 1 if all directions are constrained equally.
    """
    about = points - points.mean(axis=0)
    about = about / max(float(np.sqrt((about**2).sum(axis=1).mean())), 1e-12)
    rows = np.hstack([normals, np.cross(about, normals)])
    smallest: Array = np.linalg.eigvalsh(rows.T @ rows / len(rows))
    return float(max(3.0 * smallest[0], 0.0))
