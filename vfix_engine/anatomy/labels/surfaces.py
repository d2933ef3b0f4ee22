"""Surface of a label: marching cubes of its mask, in the grid of the segmentation, LPS mm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.labels.label_map import CroppedLabel
from vfix_engine.errors import ImageError
from vfix_engine.geometry.mesh import TriangleMesh

MAX_TRIANGLES = 5_000_000  # of a label


@dataclass(frozen=True, eq=False)
class LabelSurface:
    """A label as a surface, with its origin.

    value, name, colour: as in `Label`. mesh: closed, outward normals, LPS mm; its vertices lie half-way between a voxel
    of the label and one outside. volume_ml: of the voxels. voxel_mm: (3,) spacing of the grid; the accuracy of a
    boundary of the label is half of it. notes: doubts about it, in sentences.
    """

    value: int
    name: str
    colour: str | None
    mesh: TriangleMesh
    volume_ml: float
    voxel_mm: npt.NDArray[np.float64]
    notes: tuple[str, ...] = ()


def surface_of(label: CroppedLabel) -> LabelSurface:
    """Extract the surface of a label; padding by empty voxels closes it at the border of the grid.

    Raises ImageError if it has too many triangles.
    """
    from skimage.measure import marching_cubes  # imported here: slow to load

    padded = np.pad(label.mask, 1).astype(np.float32)
    kji, faces, _, _ = marching_cubes(padded, 0.5, gradient_direction="descent", allow_degenerate=True)
    if len(faces) > MAX_TRIANGLES:
        raise ImageError(
            f"the surface of label {label.value} would have {len(faces):,} triangles; at most {MAX_TRIANGLES:,} are "
            "used. Remove its speckle, or crop the segmentation."
        )
    linear, origin = label.transform[:3, :3], label.transform[:3, 3]
    index = kji[:, ::-1].astype(np.float64) - 1.0 + label.first
    # 'descent' with corners in the order i, j, k orients the triangles outwards, except for a mirrored grid.
    if np.linalg.det(linear) < 0:
        faces = faces[:, ::-1]
    mesh = TriangleMesh(index @ linear.T + origin, np.ascontiguousarray(faces, dtype=np.int32))
    volume = abs(float(np.linalg.det(linear))) * int(np.count_nonzero(label.mask)) / 1000.0
    return LabelSurface(label.value, label.name, label.colour, mesh, volume, np.linalg.norm(linear, axis=0))


def for_display(mesh: TriangleMesh, triangles: int) -> TriangleMesh:
    """Decimate a surface to about `triangles` for display; it must not be used for measurement."""
    import fast_simplification

    if len(mesh.faces) <= triangles:
        return mesh
    vertices, faces = fast_simplification.simplify(
        np.array(mesh.vertices), np.array(mesh.faces), target_count=triangles
    )
    return TriangleMesh(vertices.astype(np.float64), faces.astype(np.int32))
