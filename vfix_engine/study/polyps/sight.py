"""The line of sight from a camera to a polyp: free unless the lumen's wall is between them."""

from __future__ import annotations

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import TissueMotion
from .task import PolypTask, at_rest


class LumenSight:
    """Lines of sight within a lumen.

    The surface is that of the tissue at rest: in moving tissue the camera is taken back to where it would be about the
    polyp then, which is exact where the tissue around moves as it does at the polyp.

    Args:
        mesh: the lumen's surface, mm; motion: of its tissue, None: it is still.
    """

    def __init__(self, mesh: TriangleMesh, task: PolypTask, motion: TissueMotion | None = None) -> None:
        self._wall, self._task, self._motion = Wall(mesh), task, motion

    def __call__(self, eye: Array, index: int, t: float) -> bool:
        """Whether a camera at eye (3,) LPS mm sees the middle of a polyp at the time t in s."""
        polyp = self._task.polyps[index]
        return self._wall.free(at_rest(polyp, eye, self._motion, t), polyp.target)
