"""Standard views of the head, and the transforms between canvas and patient frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array

FIELD_OF_VIEW = np.deg2rad(28.0)  # narrow, so that sizes hardly change with depth
FILL = 1.12  # size of the view relative to the head
TOOLS_PX = 44.0  # height of the page's tools over the top of the canvas

# Direction from the head to the camera in LPS. The superior view is slightly tilted, so that up is anterior.
DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "anterior": (0.0, -1.0, 0.0),
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
    "superior": (0.0, 0.004, 1.0),
    "oblique": (0.62, -0.74, 0.26),
    "nose": (0.72, -0.66, -0.05),
}


@dataclass(frozen=True)
class CameraPose:
    """Camera position and the point it looks at, LPS mm."""

    position: Array
    look_at: Array


def fill(width: float, height: float, across: float = 1.0) -> float:
    """Return the size of the view relative to the head: by the smaller side of a canvas [pixels], below its tools.

    across: width of the head in this view, as a share of its largest size.
    """
    if width <= 0.0 or height <= 0.0:
        return FILL
    free = max(height - 2.0 * TOOLS_PX, 0.5 * height)
    return max(FILL, height / free, FILL * across * height / width)


def standard_view(
    name: str, centre: Array, half_mm: Array | float, size_px: tuple[float, float] = (0.0, 0.0)
) -> CameraPose:
    """Return the camera pose of a view of a box around ``centre``, at a distance for a ball of its largest half size.

    half_mm: (3,) half sizes of the box, or one for all; in a narrow canvas the width of the box in this view counts.
    size_px: width and height of the canvas; 0 where they are not known.
    """
    half = np.broadcast_to(half_mm, 3)
    direction = np.array(DIRECTIONS[name])
    direction /= np.linalg.norm(direction)
    right = np.array([direction[1], -direction[0], 0.0]) / np.hypot(direction[0], direction[1])
    across = min(1.0, float(np.abs(right) @ half / half.max()))
    distance = fill(*size_px, across) * float(half.max()) / np.sin(FIELD_OF_VIEW / 2.0)
    return CameraPose(centre + direction * distance, centre)


@dataclass(frozen=True)
class Lens:
    """The browser's camera: pose (OpenCV axes), vertical field of view in rad, canvas size in pixels."""

    rotation_camera_to_lps: Array
    position: Array
    look_at: Array
    field_of_view: float
    width: int
    height: int

    @property
    def focal_px(self) -> float:
        return 0.5 * self.height / float(np.tan(self.field_of_view / 2.0))

    @property
    def view_height_mm(self) -> float:
        """Height of what is seen at the distance of the point that the camera looks at."""
        return 2.0 * float(np.linalg.norm(self.look_at - self.position) * np.tan(self.field_of_view / 2.0))

    def ray(self, screen_x: float, screen_y: float) -> tuple[Array, Array]:
        """Return origin and unit direction of the ray through a canvas position.

        screen_x, screen_y: fractions of the canvas size, from the upper left.
        """
        up = 2.0 * np.tan(0.5 * self.field_of_view)  # height of the image at unit distance
        across = up * self.width / self.height
        direction = self.rotation_camera_to_lps @ np.array([(screen_x - 0.5) * across, (screen_y - 0.5) * up, 1.0])
        return self.position.copy(), direction / np.linalg.norm(direction)

    def project(self, points: npt.ArrayLike) -> Array:
        """Return canvas positions (n, 2) of points (n, 3) as fractions of its size; NaN behind the camera."""
        seen = (np.atleast_2d(np.asarray(points, dtype=np.float64)) - self.position) @ self.rotation_camera_to_lps
        depth = np.where(seen[:, 2] > 0.0, seen[:, 2], np.nan)
        return np.stack(
            [
                0.5 + self.focal_px * seen[:, 0] / depth / self.width,
                0.5 + self.focal_px * seen[:, 1] / depth / self.height,
            ],
            axis=-1,
        )
