"""Closed components of a surface, and the memory limit of its voxels."""

from __future__ import annotations

import os

import numpy as np

from ...arrays import Array, BoolArray, IntArray
from ...errors import InputError
from ...geometry.mesh import TriangleMesh

VOXEL_BYTES = 120  # from surface to path; measured: 115
MEMORY_SHARE = 0.5  # largest fraction of the machine's memory
_UNKNOWN_BYTES = 8 << 30  # assumed if the system does not report its memory
_MOST_PIECES = 50  # if there are more, the smallest are merged
_NESTED = 0.95  # fraction of a piece's voxels within others above which it is a hole in them


def check_memory(voxels: float, voxel_mm: float, size_mm: Array) -> None:
    """Check that the memory of this machine suffices for that many voxels.

    Raises:
        InputError: it does not.
    """
    have = _memory_bytes()
    if voxels * VOXEL_BYTES > MEMORY_SHARE * have:
        raise InputError(
            f"voxels of {voxel_mm:g} mm would be {voxels:.3g} in the surface's box of "
            f"{' × '.join(f'{d:.0f}' for d in size_mm)} mm and take {voxels * VOXEL_BYTES / 1e9:.1f} GB, of the "
            f"{have / 1e9:.1f} GB of this machine at most {100 * MEMORY_SHARE:.0f} % are taken: take larger ones, "
            "or is the surface not in millimetres?"
        )


def closed_pieces(mesh: TriangleMesh) -> list[IntArray]:
    """Faces of each closed component, the largest first; all other faces together, if any, at the end."""
    from scipy.sparse import coo_array  # imported here: slow to load
    from scipy.sparse.csgraph import connected_components

    faces = np.asarray(mesh.faces, dtype=np.int64)
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    count = len(mesh.vertices)
    graph = coo_array((np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(count, count))
    pieces, of_vertex = connected_components(graph, directed=False)
    edge, used = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    is_open = np.zeros(pieces, dtype=np.bool_)
    is_open[of_vertex[edge[used % 2 == 1] // count]] = True
    of_face = of_vertex[faces[:, 0]]
    size = np.bincount(of_face, minlength=pieces)
    closed = np.flatnonzero(~is_open & (size > 0))
    closed = closed[np.argsort(-size[closed], kind="stable")][:_MOST_PIECES]
    found = [np.flatnonzero(of_face == piece) for piece in closed]
    rest = np.flatnonzero(~np.isin(of_face, closed))
    return [*found, rest] if len(rest) else found


def add_piece(inside: BoolArray, piece: BoolArray) -> None:
    """Add the voxels of one more closed piece: subtract it if it lies within the others, else form the union."""
    within = int(np.count_nonzero(piece & inside))
    if within and within >= _NESTED * np.count_nonzero(piece):
        inside ^= piece
    else:
        inside |= piece


def _memory_bytes() -> int:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not a POSIX system
        return _UNKNOWN_BYTES
