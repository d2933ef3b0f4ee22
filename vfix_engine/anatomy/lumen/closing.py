"""Caps on the openings of a lumen's surface, such as where a scan or a segmentation ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, IntArray
from ...errors import MeshError
from ...geometry.mesh import TriangleMesh
from ...validate import point_text

WIDEST_MM = 120.0  # across an opening that is capped
FLAT_SHARE = 0.3  # of that width: how far its rim may leave a plane
MOST_OPENINGS = 100
TURNED_SHARE = 1e-3  # of the edges, beside which triangles may face opposite ways: decimation leaves a few
_REMEDY = "close it in the program that made it, or import the label map instead"


class Closed(NamedTuple):
    """mesh: without a border. openings: (n, 2) of each cap, its width in mm and its area in mm²."""

    mesh: TriangleMesh
    openings: Array


def with_caps(mesh: TriangleMesh) -> Closed:
    """Close a lumen's surface: each opening gets a cap about the middle of its rim.

    Edges that an even number of triangles share are no openings: surfaces of labels touch themselves.

    Raises:
        MeshError: triangles beside each other face opposite ways, rims touch, there are too many openings, or one is
            too wide or too far from flat for a cap to be meant.
    """
    rims = _rims(mesh)
    if len(rims) > MOST_OPENINGS:
        raise MeshError(f"the surface has {len(rims):,} openings, more than {MOST_OPENINGS}; {_REMEDY}.")
    vertices, faces, openings = [mesh.vertices], [np.asarray(mesh.faces, dtype=np.int64)], []
    for number, rim in enumerate(rims):
        places = mesh.vertices[rim]
        middle = places.mean(axis=0)
        width, hollow = _extent(places - middle)
        if width > WIDEST_MM or hollow > FLAT_SHARE * width:
            what = f"{width:.0f} mm wide" if width > WIDEST_MM else f"not flat: its rim is {hollow:.0f} mm off a plane"
            raise MeshError(f"the opening of the surface at {point_text(middle)} is {what}; {_REMEDY}.")
        vertices.append(middle[None])
        after = np.roll(rim, -1)
        # A cap runs along the rim's edges the other way, as a neighbour does.
        faces.append(np.column_stack([after, rim, np.full(len(rim), len(mesh.vertices) + number)]))
        area = 0.5 * np.linalg.norm(np.cross(places - middle, np.roll(places, -1, axis=0) - middle), axis=1).sum()
        openings.append((width, area))
    if not rims:
        return Closed(mesh, np.zeros((0, 2)))
    return Closed(TriangleMesh(np.concatenate(vertices), np.concatenate(faces)), np.array(openings))


def outwards(mesh: TriangleMesh) -> tuple[TriangleMesh, bool]:
    """A closed surface with normals out of what it encloses, and whether it had to be turned inside out for that."""
    if mesh.volume_mm3 >= 0.0:
        return mesh, False
    return TriangleMesh(mesh.vertices, np.ascontiguousarray(mesh.faces[:, ::-1])), True


def _rims(mesh: TriangleMesh) -> list[IntArray]:
    """Vertices of each opening's rim, in the direction in which its triangles run along it."""
    faces = np.asarray(mesh.faces, dtype=np.int64)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = len(mesh.vertices)
    low, high = edges.min(axis=1), edges.max(axis=1)
    key, of_edge, used = np.unique(low * count + high, return_inverse=True, return_counts=True)
    sense = np.bincount(of_edge.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0), minlength=len(key))
    twice = (used == 2) & (sense != 0.0)
    if twice.sum() > TURNED_SHARE * len(key):
        x = mesh.vertices[key[twice][0] // count]
        raise MeshError(
            f"{int(twice.sum()):,} pairs of triangles beside each other face opposite ways, such as at "
            f"{point_text(x)}: make the normals of the surface consistent in the program that made it."
        )
    border = edges[(used % 2 == 1)[of_edge.reshape(-1)]]
    border = border[np.argsort(border[:, 0], kind="stable")]
    starts, ends = border.T
    if len(np.unique(starts)) < len(starts) or not np.array_equal(starts, np.sort(ends)):
        touching = starts[:-1][np.diff(starts) == 0]
        at = point_text(mesh.vertices[touching[0] if len(touching) else starts[0]])
        raise MeshError(f"the openings of the surface touch each other, such as at {at}; {_REMEDY}.")
    following = dict(zip(starts.tolist(), ends.tolist(), strict=True))
    rims = []
    while following:
        rim = [next(iter(following))]
        while (after := following.pop(rim[-1])) != rim[0]:
            rim.append(after)
        rims.append(np.array(rim))
    return rims


def _extent(places: Array) -> tuple[float, float]:
    """Largest width of a rim about its middle, and how far it leaves the plane that fits it best; mm."""
    normal = np.linalg.svd(places, full_matrices=False)[2][-1]
    return 2.0 * float(np.linalg.norm(places, axis=1).max()), float(np.abs(places @ normal).max())
