"""Surfaces as a camera sees them: rays through Embree, and a light at the lens as the only source.

A view is a pin-hole camera in OpenCV's convention: x to the right, y down and z ahead in the picture. Pictures are
(H, W, 3) uint8, red, green and blue.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from trimesh.ray.ray_pyembree import RayMeshIntersector

from ....arrays import Array
from ....errors import InputError
from ....geometry.mesh import TriangleMesh

Picture = NDArray[np.uint8]

FIELD_DEG = 70.0  # Kwok 2013, section IV: field of view of the endoscope
_TISSUE = np.array([0.90, 0.40, 0.31])
_MOST_GAIN = 8.0
_LIGHT_MM = 20.0  # at this distance the light at the lens has fallen to a half
_NUDGE = 1e-2  # [mm] offset of the next ray behind a hit: Embree computes in single precision


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A pin-hole camera.

    transform_camera_to_patient: (4, 4), mm; width, height: of the picture in pixels; focal: in pixels.
    """

    transform_camera_to_patient: Array
    width: int
    height: int
    focal: float

    @classmethod
    def with_field(cls, pose: ArrayLike, width: int, height: int, field_deg: float = FIELD_DEG) -> PinholeCamera:
        """A camera at a pose (4, 4) whose picture is ``field_deg`` wide.

        Raises:
            InputError: a pose that is not finite or not (4, 4), a picture without pixels, a field of view not in 1 …
                150.
        """
        frame = np.array(pose, dtype=np.float64)
        if frame.shape != (4, 4) or not np.isfinite(frame).all():
            raise InputError("a camera's pose must be (4, 4) and finite")
        if width < 1 or height < 1 or not 1.0 <= field_deg <= 150.0:
            raise InputError(f"no picture of {width} × {height} pixels and {field_deg}° can be taken")
        frame.setflags(write=False)
        return cls(frame, width, height, 0.5 * width / math.tan(0.5 * math.radians(field_deg)))

    @property
    def eye(self) -> Array:
        """Position of the camera (3,), mm."""
        return self.transform_camera_to_patient[:3, 3]

    @cached_property
    def directions(self) -> Array:
        """Unit directions (H·W, 3) through the pixels' centres in the patient frame, row by row."""
        x = (np.arange(self.width) + 0.5 - 0.5 * self.width) / self.focal
        y = (np.arange(self.height) + 0.5 - 0.5 * self.height) / self.focal
        ahead = np.empty((self.height, self.width, 3))
        ahead[..., 0], ahead[..., 1], ahead[..., 2] = x, y[:, None], 1.0
        ahead /= np.linalg.norm(ahead, axis=2, keepdims=True)
        turned: Array = ahead.reshape(-1, 3) @ self.transform_camera_to_patient[:3, :3].T
        return turned

    def project(self, points: ArrayLike) -> tuple[Array, Array]:
        """Pixels (n, 2), x then y, of points (n, 3), and their distances (n,) from the eye; NaN behind the camera."""
        away = np.asarray(points, dtype=np.float64) - self.eye
        seen = away @ self.transform_camera_to_patient[:3, :3]
        ahead = np.where(seen[:, 2] > 1e-6, seen[:, 2], np.nan)
        pixels = self.focal * seen[:, :2] / ahead[:, None] + 0.5 * np.array([self.width, self.height])
        return pixels, np.linalg.norm(away, axis=1)


class RayHits(NamedTuple):
    """The hit in each pixel (H, W): its distance in mm, |cosine| of its angle to the ray, its triangle.

    inf, 0 and -1 without a hit.
    """

    distance: Array
    facing: Array
    triangle: NDArray[np.int64]


class RayMesh:
    """A mesh for ray casting."""

    def __init__(self, mesh: TriangleMesh) -> None:
        body = trimesh.Trimesh(vertices=mesh.vertices, faces=mesh.faces, process=False, validate=False)
        self._intersector = RayMeshIntersector(body)
        self._mesh = mesh
        self._normals = _vertex_normals(mesh)

    def first(self, view: PinholeCamera, beyond: Array | None = None) -> RayHits:
        """The first hits, or the first beyond (H, W) mm along the rays; none beyond inf."""
        directions = view.directions
        start = np.zeros(len(directions)) if beyond is None else beyond.ravel()
        asked = np.flatnonzero(np.isfinite(start))
        distance, facing = np.full(len(directions), np.inf), np.zeros(len(directions))
        met = np.full(len(directions), -1, dtype=np.int64)
        if len(asked):
            origins = view.eye + start[asked, None] * directions[asked]
            met[asked] = self._intersector.intersects_first(origins, directions[asked])
        pixel = np.flatnonzero(met >= 0)
        along, triangle = directions[pixel], met[pixel]
        # Embree determines the triangle; its plane gives the position in double precision.
        normal = self._mesh.face_normals[triangle]
        height = np.einsum("ij,ij->i", self._mesh.triangles[triangle, 0] - view.eye, normal)
        slope = np.einsum("ij,ij->i", along, normal)
        reached = height / np.where(np.abs(slope) > 1e-9, slope, 1e-9)
        distance[pixel] = np.maximum(reached, start[pixel])
        places = view.eye + distance[pixel, None] * along
        facing[pixel] = np.abs(np.einsum("ij,ij->i", self._normal_at(places, triangle), along))
        shape = view.height, view.width
        return RayHits(distance.reshape(shape), facing.reshape(shape), met.reshape(shape))

    def layers(self, view: PinholeCamera, count: int) -> list[RayHits]:
        """The first ``count`` hits behind each other in each pixel."""
        found: list[RayHits] = []
        for _ in range(count):
            found.append(self.first(view, found[-1].distance + _NUDGE if found else None))
        return found

    def _normal_at(self, places: Array, triangle: NDArray[np.int64]) -> Array:
        """Normals (n, 3) that change smoothly from corner to corner; of unit length."""
        a, b, c = np.moveaxis(self._mesh.triangles[triangle], 1, 0)
        u, v, w = b - a, c - a, places - a
        uu, uv, vv = (np.einsum("ij,ij->i", p, q) for p, q in ((u, u), (u, v), (v, v)))
        wu, wv = np.einsum("ij,ij->i", w, u), np.einsum("ij,ij->i", w, v)
        area = np.maximum(uu * vv - uv * uv, 1e-30)
        at_b, at_c = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
        corners = self._normals[self._mesh.faces[triangle]]
        normal = np.einsum("ni,nij->nj", np.column_stack([1.0 - at_b - at_c, at_b, at_c]), corners)
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        smooth: Array = np.where(size > 1e-6, normal / np.maximum(size, 1e-6), self._mesh.face_normals[triangle])
        return smooth


def endoscope_view(surfaces: list[tuple[RayMesh, ArrayLike | None]], view: PinholeCamera) -> Picture:
    """The picture of the camera at the robot's tip: the nearest of the surfaces, lit from the lens.

    surfaces: each with its colour (3,) in 0 … 1, None for tissue.
    """
    nearest = np.full((view.height, view.width), np.inf)
    colour = np.zeros((view.height, view.width, 3))
    for surface, tint in surfaces:
        distance, facing, _ = surface.first(view)
        front = distance < nearest
        # The light falls off with distance and with the angle it meets the wall at.
        light = facing / (1.0 + (np.where(front, distance, 0.0) / _LIGHT_MM) ** 2)
        gloss = 0.35 * facing**40 * light
        shade = light[..., None] * (_TISSUE if tint is None else np.asarray(tint)) + gloss[..., None]
        colour = np.where(front[..., None], shade, colour)
        nearest = np.minimum(nearest, distance)
    if np.isfinite(nearest).any():
        # Exposed so that the brightest parts are just below white, as an endoscope's camera does.
        brightest = float(np.percentile(colour[np.isfinite(nearest)], 98))
        colour *= min(0.85 / max(brightest, 1e-6), _MOST_GAIN)
    return to_picture(colour)


def to_picture(colour: Array) -> Picture:
    """Linear light (H, W, 3) converted for display."""
    return np.rint(255.0 * np.clip(colour, 0.0, 1.0) ** (1.0 / 1.6)).astype(np.uint8)


def _vertex_normals(mesh: TriangleMesh) -> Array:
    """Sums (V, 3) of the normals of the triangles about each vertex, by area."""
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    sums: Array = np.zeros((len(mesh.vertices), 3))
    for k in range(3):
        sums[:, k] = np.bincount(mesh.faces.ravel(), weights=np.repeat(normal[:, k], 3), minlength=len(sums))
    return sums
