"""A cut through the head as an SVG picture: outlines of surfaces, and path and tool projected onto the plane."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import cv2
import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.files.volume import Axis, Volume
from vfix_engine.geometry.mesh import TriangleMesh

HALF_MM = 38.0  # half of the side of a picture
_NEAR_MM = 5.0  # targets farther from a plane are not drawn on it


@dataclass(frozen=True)
class Plane:
    """A plane of the scan. through: the LPS axis across it. right, down: LPS axes of the picture, and their signs.

    letters: at the left and right, top and bottom of the picture.
    """

    name: Axis
    through: int
    right: int
    down: tuple[int, float]
    letters: tuple[str, str, str, str]

    def project(self, places: Array, centre: Array) -> Array:
        """Places (..., 3) in LPS as picture coordinates (..., 2), mm right and down of the centre (3,)."""
        away = np.asarray(places) - centre
        return np.stack([away[..., self.right], self.down[1] * away[..., self.down[0]]], axis=-1)


PLANES = (
    Plane("axial", 2, 0, (1, 1.0), ("R", "L", "A", "P")),
    Plane("coronal", 1, 0, (2, -1.0), ("R", "L", "S", "I")),
    Plane("sagittal", 0, 1, (2, -1.0), ("A", "P", "S", "I")),
)


@dataclass(frozen=True)
class Outlined:
    """A surface whose outline is drawn. css: of its colour."""

    mesh: TriangleMesh
    css: str


@dataclass(frozen=True)
class Shown:
    """What the pictures show around `centre` (3,): LPS mm.

    path (n, 3). start, end (S, 3) and radius (S,): the tool's axis. targets: places, drawn on planes within 5 mm.
    volume: drawn in grey, or None.
    """

    centre: Array
    surfaces: tuple[Outlined, ...]
    path: Array
    start: Array
    end: Array
    radius: Array
    targets: tuple[Array, ...] = ()
    volume: Volume | None = None


def cut_picture(plane: Plane, shown: Shown) -> str:
    """One cut as SVG, one unit a millimetre."""
    half, centre = HALF_MM, shown.centre
    tool = zip(shown.start, shown.end, (2.0 * shown.radius).tolist(), strict=True)
    near = [place for place in shown.targets if abs(place - centre)[plane.through] <= _NEAR_MM]
    parts = [
        "" if shown.volume is None else _grey(plane, shown.volume, centre),
        *(f'<path style="stroke:{one.css}" d="{_outline(plane, one.mesh, centre)}"/>' for one in shown.surfaces),
        *(
            f'<path class="tool" style="stroke-width:{width:.2f}" d="{line(plane.project(np.stack(ends), centre))}"/>'
            for *ends, width in tool
        ),
        f'<path class="path" d="{line(plane.project(shown.path, centre))}"/>',
        *(_dot(plane.project(place, centre)) for place in near),
        *_letters(plane.letters),
        f'<path class="scale" d="M{half - 13:g} {half - 3:g}h10"/><text x="{half - 8:g}" y="{half - 4:g}">10 mm</text>',
    ]
    words = f"{plane.name.title()} cut"
    return (
        f'<svg viewBox="{-half:g} {-half:g} {2 * half:g} {2 * half:g}" role="img" aria-label="{escape(words)}">'
        f"{''.join(parts)}</svg>"
    )


def _outline(plane: Plane, mesh: TriangleMesh, centre: Array) -> str:
    """Where a surface crosses the plane, as the data of an SVG path."""
    return "".join(line(segment) for segment in outline(plane, mesh, centre))


def outline(plane: Plane, mesh: TriangleMesh, centre: Array, half_mm: float = HALF_MM) -> Array:
    """Where a surface crosses the plane: segments (n, 2, 2) in picture coordinates, `half_mm` around the centre."""
    corners = mesh.triangles
    side = corners[:, :, plane.through] - centre[plane.through]
    near = (np.abs(corners - centre) <= 2.0 * half_mm).all(axis=(1, 2))
    crossing = near & (side.min(axis=1) < 0.0) & (side.max(axis=1) >= 0.0)
    corners, side = corners[crossing], side[crossing]
    ends = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        share = side[:, a] / np.where(side[:, a] == side[:, b], 1.0, side[:, a] - side[:, b])
        ends.append(corners[:, a] + share[:, None] * (corners[:, b] - corners[:, a]))
    crossed = np.stack([(side[:, a] < 0.0) != (side[:, b] < 0.0) for a, b in ((0, 1), (1, 2), (2, 0))], axis=1)
    pairs = np.stack(ends, axis=1)[crossed].reshape(-1, 2, 3)  # a triangle that is crossed is so at two of its sides
    flat = plane.project(pairs, centre)
    inside: Array = flat[(np.abs(flat).max(axis=2) <= half_mm).any(axis=1)]
    return inside


def _grey(plane: Plane, volume: Volume, centre: Array) -> str:
    """The scan in grey; nothing where the plane lies outside of it."""
    low, high = volume.bounds
    if not low[plane.through] <= centre[plane.through] <= high[plane.through]:
        return ""
    image, transform = volume.slice_image(plane.name, float(centre[plane.through]))
    steps = plane.project(centre + transform[:3, :2].T, centre)  # of a column and of a row, along the axes
    start, pixel = plane.project(transform[:3, 3], centre), float(steps[0, 0])
    left, top = (max(int((-HALF_MM - start[axis]) / pixel), 0) for axis in (0, 1))
    count = int(2.0 * HALF_MM / pixel) + 2
    shown = image[top : top + count, left : left + count]
    if not shown.size:
        return ""
    encoded = base64.b64encode(cv2.imencode(".png", shown)[1].tobytes()).decode()
    x, y = (start[axis] + (first - 0.5) * pixel for axis, first in ((0, left), (1, top)))
    height, width = (size * pixel for size in shown.shape)
    return (
        f'<image x="{x:.2f}" y="{y:.2f}" width="{width:.2f}" height="{height:.2f}" preserveAspectRatio="none" '
        f'href="data:image/png;base64,{encoded}"/>'
    )


def line(points: Array) -> str:
    """(n, 2) as the data of an SVG path."""
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points.tolist())


def _dot(place: Array) -> str:
    x, y = place.tolist()
    return f'<circle class="target" cx="{x:.2f}" cy="{y:.2f}" r="1.2"/>'


def _letters(letters: Sequence[str]) -> Iterable[str]:
    edge = HALF_MM - 2.5
    places = ((-edge, 1.2), (edge, 1.2), (0.0, 2.4 - edge), (0.0, edge))
    return (
        f'<text class="letter" x="{x:g}" y="{y:g}">{letter}</text>'
        for letter, (x, y) in zip(letters, places, strict=True)
    )
