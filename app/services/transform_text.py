"""Transforms as ITK writes them (.tfm), which 3D Slicer reads."""

from __future__ import annotations

from numpy.typing import ArrayLike

from vfix_engine.frames import inverse


def tfm_text(transform: ArrayLike) -> str:
    """The text of a rigid transform (4, 4), LPS mm, that moves the image to the patient.

    ITK maps from the place where a moved image is looked at to where its voxels are, so the file holds the inverse;
    3D Slicer takes it as the transform from a node's parent, and shows what lies under the node moved by `transform`.
    """
    back = inverse(transform)
    numbers = [*back[:3, :3].ravel().tolist(), *back[:3, 3].tolist()]
    return (
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        f"Parameters: {' '.join(map(repr, numbers))}\nFixedParameters: 0 0 0\n"
    )
