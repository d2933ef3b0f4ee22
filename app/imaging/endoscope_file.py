"""The file of what an endoscope sees: a mesh as the page's renderer takes it, little-endian, in clusters.

The header has 48 bytes: `VFXS`; as uint32 the version, the numbers of vertices V, triangles F and clusters C, and a 0;
the box's corners as six float32 (LPS mm). Then, without gaps: positions, V × 3 float32 (LPS mm); normals out of tissue,
V × 4 int8 (127 is 1, the fourth is 0); colours, V × 4 uint8 (sRGB, and how open to light); corners, F × 3 uint32;
clusters, C × 6 float32 (first index into the corners, their number, centre and radius of a ball that holds them).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.endoscopy.air_surface import AirSurface
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError

MAGIC, VERSION = b"VFXS", 1
HEADER = np.dtype([("magic", "S4"), ("counts", "<u4", 4), ("none", "<u4"), ("box", "<f4", 6)])
CLUSTER_TRIANGLES = 512  # that are drawn, or left out, together
_GRID = 1023  # cells along the longest side, in whose Morton order triangles are stored


@dataclass(frozen=True, eq=False)
class EndoscopeFile:
    """data: the bytes. Raises InputError where their number is not what their header says."""

    data: bytes

    def __post_init__(self) -> None:
        if len(self.data) < HEADER.itemsize:
            raise InputError("a file of what an endoscope sees is cut off.")
        header = np.frombuffer(self.data, HEADER, 1)[0]
        version, vertices, triangles, clusters = (int(count) for count in header["counts"])
        size = HEADER.itemsize + 20 * vertices + 12 * triangles + 24 * clusters
        if (header["magic"], version, len(self.data)) != (MAGIC, VERSION, size):
            raise InputError("a file of what an endoscope sees is damaged.")

    @cached_property
    def revision(self) -> str:
        """SHA-256 of the bytes."""
        return hashlib.sha256(self.data).hexdigest()


def packed(surface: AirSurface, colours: Array, openness: Array, box: Array) -> EndoscopeFile:
    """The file of a surface with colours (V, 3) and openness (V,), both from 0 to 1, made in a box (2, 3) in LPS mm."""
    order, faces, clusters = _in_clusters(surface.mesh.vertices, surface.mesh.faces)
    normals = np.zeros((len(order), 4), np.int8)
    normals[:, :3] = np.clip(np.rint(127.0 * surface.normals[order]), -127, 127)
    rgba = np.rint(255.0 * np.clip(np.column_stack([colours, openness])[order], 0.0, 1.0)).astype(np.uint8)
    header = np.zeros(1, HEADER)
    header["magic"], header["counts"] = MAGIC, (VERSION, len(order), len(faces), len(clusters))
    header["box"] = np.asarray(box).ravel()
    parts = (
        header,
        surface.mesh.vertices[order].astype("<f4"),
        normals,
        rgba,
        faces.astype("<u4"),
        clusters.astype("<f4"),
    )
    return EndoscopeFile(b"".join(part.tobytes() for part in parts))


def _in_clusters(
    vertices: Array, faces: npt.NDArray[np.int32]
) -> tuple[npt.NDArray[np.integer], npt.NDArray[np.integer], npt.NDArray[np.float32]]:
    """Triangles near to each other in runs: the old numbers of the vertices (V,), new faces (F, 3), clusters (C, 6)."""
    by_place = faces[np.argsort(_morton(vertices[faces].mean(axis=1)), kind="stable")]
    used, first, number = np.unique(by_place, return_index=True, return_inverse=True)
    by_use = np.argsort(first)  # vertices in the order of their first use, which a graphics card's cache likes
    rank = np.empty_like(by_use)
    rank[by_use] = np.arange(len(by_use))
    clusters = []
    for start in range(0, len(by_place), CLUSTER_TRIANGLES):
        corners = vertices[by_place[start : start + CLUSTER_TRIANGLES]].reshape(-1, 3)
        centre = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
        clusters.append([3 * start, len(corners), *centre, np.linalg.norm(corners - centre, axis=1).max()])
    return used[by_use], rank[number.reshape(-1, 3)], np.array(clusters, np.float32)


def _morton(places: Array) -> npt.NDArray[np.uint64]:
    """Numbers (n,) of the cells of places (n, 3) along a curve that keeps near ones together."""
    low = places.min(axis=0)
    cells = ((places - low) / max(float((places.max(axis=0) - low).max()), 1e-9) * _GRID).astype(np.uint64)
    code = np.zeros(len(cells), np.uint64)
    for bit in range(_GRID.bit_length()):
        for axis in range(3):
            code |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return code
