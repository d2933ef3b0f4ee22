"""When a place of a lumen's wall is viewed by the camera at the robot's tip: Kwok 2013, section IV.C.1 b."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...anatomy.lumen.wall import outward_side
from ...arrays import Array, BoolArray, IntArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import Pathway
from ...validate import positive, within
from .picture.camera_view import FIELD_DEG

_NEIGHBOURS = 24  # points of the curve that are asked for a triangle's arc length
_SPACING_MM = 2.0  # between two of them
_BESIDE_MM = 10.0  # of the curve at an end
_CLOSED = 2.0  # wall beyond an end of the curve that is no farther than so many times the wall beside it closes it


@dataclass(frozen=True)
class ViewLimits:
    """Tolerances of a view of a place.

    distance_mm, distance_tolerance_mm: from the camera, 15 ± 7 mm in the paper. angle_deg: at most between the
    camera's optical axis and the line to the place, 20° in the paper, where 0° is when 'the principal axis of the
    camera exactly points at the centre'; the wall's own direction does not count. frame_deg: half the opening of the
    square aiming frame in the middle of the picture, in which the place has to be; its size is not printed. Assumed:
    20°, so that the frame touches the circle of the angle, and the angle decides.

    Raises:
        InputError: a tolerance that is not positive, a distance less than its tolerance, an angle or a frame that is
            wider than the camera's field of view.
    """

    distance_mm: float = 15.0
    distance_tolerance_mm: float = 7.0
    angle_deg: float = 20.0
    frame_deg: float = 20.0

    def __post_init__(self) -> None:
        positive("the tolerance of a view's distance in mm", self.distance_tolerance_mm)
        within("the distance of a view in mm", self.distance_mm, self.distance_tolerance_mm)
        for name, value in (("angle", self.angle_deg), ("aiming frame", self.frame_deg)):
            if not 0.0 < value <= 0.5 * FIELD_DEG:
                raise InputError(f"the {name} of a view is {value!r}; it is above 0 and at most {0.5 * FIELD_DEG:g}°")

    @property
    def farthest_mm(self) -> float:
        """The largest distance."""
        return self.distance_mm + self.distance_tolerance_mm

    def error(self, camera: Array, points: Array) -> Array:
        """How far points (n, 3) are from an ideal view (n,): at most 1 within the tolerances, 0 is ideal.

        The larger of the errors of distance and angle, each as a share of its tolerance; infinite outside of the frame.
        Lines of sight are not looked at.

        Args:
            camera: (4, 4) transform_camera_to_patient, z along the optical axis.
        """
        seen = (points - camera[:3, 3]) @ camera[:3, :3]
        away = np.linalg.norm(seen, axis=1)
        angle = np.degrees(np.arctan2(np.hypot(seen[:, 0], seen[:, 1]), seen[:, 2]))
        found = np.maximum(np.abs(away - self.distance_mm) / self.distance_tolerance_mm, angle / self.angle_deg)
        half = math.tan(math.radians(self.frame_deg)) * seen[:, 2]
        framed = np.maximum(np.abs(seen[:, 0]), np.abs(seen[:, 1])) <= half * (1.0 + 1e-9)
        return np.where(framed, found, np.inf)


class WallSight:
    """The triangles of a lumen's wall for lines of sight.

    centre: (F, 3) centroids, mm; inward: (F, 3) unit normals into the lumen; area: (F,) mm².

    Args:
        mesh: the wall, consistently oriented; it may have openings. line: a curve through the lumen.

    Raises:
        PathwayError: no wall is seen from the curve.
    """

    def __init__(self, mesh: TriangleMesh, line: Curve) -> None:
        import trimesh  # imported here: slow to load
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        self._rays = RayMeshIntersector(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, validate=False))
        a, b, c = np.moveaxis(mesh.triangles, 1, 0)
        self.centre, self.area = mesh.triangles.mean(axis=1), 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        self._tree = cKDTree(self.centre)
        across = np.cross(line.tangents, np.eye(3)[np.abs(line.tangents).argmin(axis=1)])
        met = np.asarray(self._rays.intersects_first(line.points, across))
        steep = np.einsum("ij,ij->i", across, mesh.face_normals[met])
        side = outward_side(np.where(met >= 0, np.sign(steep), 0.0).astype(np.int8))
        self.inward: Array = -side * mesh.face_normals

    def near(self, place: Array, radius_mm: float) -> IntArray:
        """Triangles whose centroids are at most so far from a place (3,), in order."""
        return np.sort(np.array(self._tree.query_ball_point(place, radius_mm), dtype=np.int64))

    def free(self, eyes: Array, triangles: IntArray) -> BoolArray:
        """Whether nothing is between an eye (n, 3), or one (3,) for all, and the inner side of a triangle (n,)."""
        eyes = np.broadcast_to(eyes, (len(triangles), 3))
        ahead = self.centre[triangles] - eyes
        found: BoolArray = np.einsum("ij,ij->i", ahead, self.inward[triangles]) < 0.0
        asked = np.flatnonzero(found)
        if len(asked):
            first = self._rays.intersects_first(np.ascontiguousarray(eyes[asked]), ahead[asked])
            found[asked] = first == triangles[asked]
        return found

    def viewed(self, camera: Array, limits: ViewLimits) -> tuple[IntArray, Array]:
        """Triangles whose centroids a camera (4, 4) views, and their errors (n,) as of ``ViewLimits.error``.

        A centroid counts where the first that a ray from the camera meets is its triangle, from inside.
        """
        near = self.near(camera[:3, 3], limits.farthest_mm)
        error = limits.error(camera, self.centre[near])
        near, error = near[error <= 1.0], error[error <= 1.0]
        free = self.free(camera[:3, 3], near)
        return near[free], error[free]

    def arc_lengths(self, line: Curve) -> Array:
        """(F,) mm, where along a curve each triangle is: of the nearest place of the curve that it faces.

        Where the lumen goes on beyond an end of the curve, its triangles there are at the place of the straight
        extension: below 0, or beyond the curve's length. A closed end belongs to the end of the curve.
        """
        every = max(round(_SPACING_MM / line.step_mm), 1)
        places = line.points[::every]
        _, found = cKDTree(places).query(self.centre, k=min(_NEIGHBOURS, len(places)))
        found = found.reshape(len(self.centre), -1)
        facing = np.einsum("fnk,fk->fn", places[found] - self.centre[:, None], self.inward) > 0.0
        first = np.where(facing.any(axis=1), facing.argmax(axis=1), 0)
        s: Array = found[np.arange(len(found)), first] * (every * line.step_mm)
        for point, outwards, end in (
            (line.points[0], -line.tangents[0], 0), (line.points[-1], line.tangents[-1], len(places) - 1),
        ):  # fmt: skip
            end_s = end * every * line.step_mm
            here = np.flatnonzero((found[:, 0] == end) & (np.abs(s - end_s) <= _NEIGHBOURS * _SPACING_MM))
            ahead = (self.centre[here] - point) @ outwards
            here, ahead = here[ahead > 0.0], ahead[ahead > 0.0]
            beside = np.abs(found[:, 0] - end) * _SPACING_MM <= _BESIDE_MM
            beside[here] = False
            if self._goes_on(point, here, np.flatnonzero(beside)):
                s[here] = ahead + line.length if end else -ahead
        return s

    def _goes_on(self, end: Array, here: IntArray, beside: IntArray) -> bool:
        """Whether more than a closed end is seen of the wall ``here``, which is ahead of the end of a curve."""
        away = np.linalg.norm(self.centre[here] - end, axis=1)
        wide = np.linalg.norm(self.centre[beside] - end, axis=1)
        return bool(self.free(end, here[away > _CLOSED * (np.median(wide) if len(wide) else 0.0)]).any())


def moved_wall(mesh: TriangleMesh, pathway: Pathway, t: float) -> TriangleMesh:
    """A wall that moves with its pathway (Kwok 2013, section III.A) at the time t in s; the same where nothing moves.

    Each vertex goes with the cross-section of the pathway that is nearest at rest, and to or from its centre with the
    section's radius.
    """
    if pathway.motion is None:
        return mesh
    rest = pathway.moved(None).curve()
    _, at = cKDTree(rest.points).query(mesh.vertices)
    shift, factor = pathway.motion(at * rest.step_mm, t)
    centre = rest.points[at]
    return TriangleMesh(centre + shift + factor[:, None] * (mesh.vertices - centre), mesh.faces)
