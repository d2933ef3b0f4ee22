"""Plausibility of a lumen's surface: what cannot be one is refused with its figure, doubts are told in sentences."""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.head_files import FEW_TRIANGLES, Notes, size_fault, size_notes, unsound_triangles
from vfix_engine.arrays import Array
from vfix_engine.errors import MeshError
from vfix_engine.files.frame_report import FrameReport
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots.snake import SnakeModel

LUMEN_MM = (20.0, 900.0)  # longest side: from a part of a trachea to a whole colon; more or less is told
LEAST_TRIANGLES = 100  # a prism of twelve sides in eight rings; fewer are a box, or what a decimation left over
LEAST_ML = 1.0  # less is no lumen
THINNEST_MM = 1.0  # across the thinnest link of a robot
_HOLLOW_SHARE = 0.05  # of the volume: what is turned round within the surface and larger is told
_SHELL_SHARE = 0.3  # the same, of a wall with a thickness


def check_lumen_surface(mesh: TriangleMesh, report: FrameReport) -> Notes:
    """List doubts about a file's surface before it is closed. Raises MeshError if it cannot be a lumen's."""
    size = mesh.bounds[1] - mesh.bounds[0]
    if fault := size_fault(size, "surface", report, "lumen"):
        raise MeshError(fault)
    count = len(mesh.faces)
    if count < LEAST_TRIANGLES:
        raise MeshError(
            f"the surface has {count} triangles only, which is no wall of a lumen: at least {LEAST_TRIANGLES} are "
            "needed, and some thousands follow its folds. Export it finer."
        )
    doubts = [*size_notes(size, "surface", "lumen", LUMEN_MM)]
    if count < FEW_TRIANGLES:
        sides = np.linalg.norm(mesh.triangles - np.roll(mesh.triangles, 1, axis=1), axis=2)
        edge = float(np.median(sides.max(axis=1)))
        doubts.append(
            f"The surface has {count:,} triangles only, with edges of {edge:.0f} mm: it is too coarse for the folds of "
            "a wall."
        )
    return (*doubts, *unsound_triangles(mesh, "no ray meets them"))


def check_enclosed(wall: TriangleMesh) -> None:
    """Raises MeshError for a closed surface that encloses too little, or is too narrow for every robot."""
    ml = wall.volume_mm3 / 1000.0
    if ml < LEAST_ML:
        raise MeshError(f"the surface encloses {ml:.2f} ml, which is no lumen; is its unit right?")
    if (width := mean_width_mm(wall)) < THINNEST_MM:
        raise MeshError(
            f"the lumen is about {width:.1f} mm across, and the thinnest robot {THINNEST_MM:g} mm; is its unit right?"
        )


def wall_notes(wall: TriangleMesh) -> Notes:
    """How large a lumen is, and what is doubtful about its closed wall, normals outwards."""
    width, usual = mean_width_mm(wall), 2.0 * SnakeModel(1).radius_mm
    held = f"The lumen holds {wall.volume_mm3 / 1000.0:,.0f} ml and is about {width:.0f} mm across."
    narrow = (
        f"That is narrower than the usual robot, {usual:g} mm: choose thinner links in Route." if width < usual else ""
    )
    pieces = _pieces_ml(wall)
    whole, hollow = pieces[pieces >= LEAST_ML], -pieces[pieces <= -LEAST_ML]
    doubts = []
    if len(whole) > 1:
        listed = ", ".join(f"{one:,.0f}" for one in np.sort(whole)[::-1][:4]) + (", …" if len(whole) > 4 else "")
        doubts.append(
            f"It is in {len(whole)} separate pieces, of {listed} ml: entry and end of a route lie in one of them."
        )
    if hollow.sum() > _HOLLOW_SHARE * whole.sum():
        doubts.append(
            f"{hollow.sum():,.0f} ml within it belong to surfaces that face the other way and are no part of the lumen."
        )
    return (f"{held} {narrow}".rstrip(), *doubts)


def check_no_shell(wall: TriangleMesh) -> None:
    """Raises MeshError for a wall with a thickness: what its closed surface encloses is tissue, not the lumen."""
    pieces = _pieces_ml(wall)
    inner, outer = -pieces[pieces < 0.0].sum(), pieces[pieces > 0.0].sum()
    if inner > _SHELL_SHARE * outer:
        raise MeshError(
            f"the surface is a wall with a thickness: {inner:,.0f} of the {outer:,.0f} ml within it are enclosed by a "
            "surface that faces the other way. Export the inner surface alone."
        )


def mean_width_mm(wall: TriangleMesh) -> float:
    """Four times the volume over the area: the diameter of a long tube with both."""
    a, b, c = np.moveaxis(wall.triangles, 1, 0)
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    return 4.0 * wall.volume_mm3 / area if area > 0.0 else 0.0


def _pieces_ml(wall: TriangleMesh) -> Array:
    """Signed volume of every part of a closed surface that hangs together, in ml."""
    from scipy.sparse import coo_matrix  # imported here: slow to load
    from scipy.sparse.csgraph import connected_components

    faces, count = np.asarray(wall.faces, dtype=np.int64), len(wall.vertices)
    start, end = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    links = coo_matrix((np.ones(len(start), dtype=np.int8), (start, end)), shape=(count, count))
    _, part = connected_components(links, directed=False)
    a, b, c = np.moveaxis(wall.triangles - wall.bounds.mean(axis=0), 1, 0)
    signed = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6000.0
    found: Array = np.bincount(part[faces[:, 0]], weights=signed).astype(np.float64)
    return np.asarray(found[found != 0.0])
