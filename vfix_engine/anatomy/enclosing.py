"""Surface that encloses selected voxels of a CT, however thin the structure is; LPS mm.

The position of an isosurface follows from the Hounsfield units: for a sheet one voxel thick it encloses less than half,
since its border is drawn towards the voxels' centres on both sides. Here the border crosses the line between a selected
voxel and a neighbour at the midpoint or beyond, as determined by the units.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.arrays import Array
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

_ON_LINE = 0.01  # [voxel] a vertex this close to a line of the grid lies on it


def enclosing_surface(part: Volume, mask: npt.NDArray[np.bool_], band_hu: tuple[float, float]) -> TriangleMesh:
    """Compute a closed surface around voxels of a CT, with outward normals.

    The centre of every voxel of the mask lies inside and that of every other one outside. Between two of them the
    surface is half-way, or nearer to the other one if the end of the band lies there, which only adds volume. Where the
    mask is bounded by anything but the band, it is half-way.

    Args:
        mask: (K, J, I) of the part, not empty. band_hu: its lower and upper end, both included.
    """
    chosen = np.pad(mask, 1)  # closes the surface where the part ends
    around = Volume(chosen.astype(np.int16), part.index_to_lps([-1.0, -1.0, -1.0]), part.spacing, part.direction)
    mesh = extract_surface(around, 1.0)
    index = around.lps_to_index(mesh.vertices)
    low, high = np.floor(index + 0.25).astype(np.intp), np.ceil(index - 0.25).astype(np.intp)
    # A vertex of an ambiguous cell lies inside it, on none of its edges, and is not moved.
    on_line = np.abs(index - 0.5 * (low + high)).max(axis=1) < _ON_LINE
    on_line &= (high - low).sum(axis=1) == 1
    low, high = low[on_line], high[on_line]
    i, j, k = low.T
    from_low = chosen[k, j, i][:, None]
    inner, outer = np.where(from_low, low, high), np.where(from_low, high, low)
    share = _share(_hu_at(part, inner), _hu_at(part, outer), band_hu)
    index[on_line] = inner + share[:, None] * (outer - inner)
    return TriangleMesh(around.index_to_lps(index), mesh.faces)


def _hu_at(part: Volume, padded: npt.NDArray[np.intp]) -> Array:
    """HU (n,) at indices (n, 3) of the padded part; the padding repeats the border."""
    last = np.array(part.hu.shape[::-1]) - 1
    i, j, k = np.clip(padded - 1, 0, last).T
    hu: Array = part.hu[k, j, i].astype(np.float64)
    return hu


def _share(inner: Array, outer: Array, band_hu: tuple[float, float]) -> Array:
    """Position (n,) of the surface as a fraction of the distance from a voxel in the band to a neighbour, 0.5 to 1."""
    # Half a unit beyond the ends of the band, which no voxel has as its value.
    end = np.where(outer < inner, np.ceil(band_hu[0]) - 0.5, np.floor(band_hu[1]) + 0.5)
    beyond = (outer < band_hu[0]) | (outer > band_hu[1])
    share: Array = np.divide(end - inner, outer - inner, out=np.full(len(inner), 0.5), where=beyond)
    return np.asarray(np.maximum(share, 0.5))
