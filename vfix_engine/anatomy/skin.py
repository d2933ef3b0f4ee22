"""The skin of a head from its CT: where its tissue borders the air of the room. For display only.

The room's air is followed into nostrils, ears and mouth by `INTO_OPENINGS_MM` only, so that their rims are seen and
the inner airway is left out; the surface is open there, and where the scan cuts the head. What lies beside the head,
such as a table or headrest, is left out too.
"""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.airway import body
from vfix_engine.anatomy.beside_head import every_fine_enough, largest_part, without_surroundings
from vfix_engine.anatomy.bone import thinned_for_display
from vfix_engine.anatomy.room_air import padding
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.anatomy.surface import clean, compact, extract_surface
from vfix_engine.anatomy.thinning import ThinnedSurface
from vfix_engine.arrays import BoolArray
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback, no_progress

SKIN_TRIANGLES = 80_000
INTO_OPENINGS_MM = 8.0  # distance that the room's air is followed into openings of the head
_ROUGH, _AROUND_MM = 4, 20.0  # every so many voxels show where the head is; air around it that is kept
_LEAST_TRIANGLES = 200  # smaller components are noise
_NO_SKIN = "this CT shows no air around the head, so there is no skin to see."
# Fractions of the time until each stage, on the synthetic head.
_TOLD, _AIR, _FOUND = 0.35, 0.6, 0.8


def skin_of_volume(
    volume: Volume, *, triangles: int = SKIN_TRIANGLES, progress: ProgressCallback = no_progress
) -> ThinnedSurface:
    """Extract the skin with about so many triangles at most, normals out of the head; and what thinning moved.

    Raises:
        ImageError: the scan shows no head in the air of a room.
    """
    progress("Telling the head from what lies beside it", 0.0)
    coarse, _ = every_fine_enough(volume)
    box = _box(coarse)
    near = coarse.index_to_lps([part.start for part in box[::-1]])
    alone = without_surroundings(Volume(coarse.hu[box], near, coarse.spacing, coarse.direction))
    progress("Finding the skin", _TOLD)
    air = _air_shown(alone)
    if not air.any():
        raise ImageError(_NO_SKIN)
    progress("Finding the skin", _AIR)
    surface = _surface(alone, air, padding(coarse)[box])
    words = f"Thinning {len(surface.faces):,} triangles"
    return thinned_for_display(surface, triangles, lambda share: progress(words, _FOUND + (1.0 - _FOUND) * share))


def _box(volume: Volume) -> tuple[slice, ...]:
    """Slices [k, j, i] of what is around the largest body, with air on all sides: less to look through."""
    from scipy import ndimage  # imported here: slow to load

    rough = largest_part(volume.hu[::_ROUGH, ::_ROUGH, ::_ROUGH] >= TISSUE_HU)
    found = ndimage.find_objects(rough.astype(np.int8))
    margins = np.ceil(_AROUND_MM / volume.spacing[::-1]).astype(int) + _ROUGH
    return tuple(
        slice(max(0, part.start * _ROUGH - margin), part.stop * _ROUGH + margin)
        for part, margin in zip(found[0] if found else (slice(0, size) for size in rough.shape), margins, strict=True)
    )


def _air_shown(head: Volume) -> BoolArray:
    """Air (K, J, I) of the room around a head, and in its openings as deep as they are shown."""
    from scipy import ndimage  # as above

    air = head.hu < TISSUE_HU
    shown: BoolArray = air & ~body(head)
    finest = float(head.spacing.min())
    shares = finest / head.spacing[::-1] + 1e-9  # of a voxel's size, along k, j and i
    for step in range(int(np.ceil(INTO_OPENINGS_MM / finest))):
        reached = np.zeros((3, 3, 3), np.bool_)
        reached[1, 1, 1] = True
        for axis in np.flatnonzero(np.floor((step + 1) * shares) > np.floor(step * shares)):
            reached[tuple(slice(None) if n == axis else 1 for n in range(3))] = True
        shown = ndimage.binary_dilation(shown, reached, mask=air)
    return shown


def _surface(head: Volume, air: BoolArray, unmeasured: BoolArray) -> TriangleMesh:
    """The isosurface between the tissue of a head and that air, open at voxels without a measurement.

    Raises ImageError without any.
    """
    mesh = extract_surface(head, TISSUE_HU)
    cells = _cells_with(air) & ~_cells_with(unmeasured)
    at = np.floor(head.lps_to_index(mesh.triangles.mean(axis=1))).astype(np.intp)
    i, j, k = np.clip(at, 0, np.array(cells.shape[::-1]) - 1).T
    kept = cells[k, j, i]
    if not kept.any():
        raise ImageError(_NO_SKIN)
    found = TriangleMesh(*compact(mesh.vertices, mesh.faces[kept]))
    return clean(found, min(_LEAST_TRIANGLES, len(found.faces))).mesh


def _cells_with(mask: BoolArray) -> BoolArray:
    """Cells (K - 1, J - 1, I - 1) between voxels that have at least one corner in a mask (K, J, I)."""
    found = mask
    for axis in range(3):
        count = found.shape[axis]
        found = found.take(range(count - 1), axis) | found.take(range(1, count), axis)
    return found
