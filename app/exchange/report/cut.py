"""A cut through the head as an SVG picture: outlines of surfaces, path and tool.

What of path and tool lies in the plane is solid; the rest is projected onto it, and faded, so that a path that passes
behind bone is not taken for one that goes through it.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from vfix_engine.arrays import Array, BoolArray
from vfix_engine.files.volume import Axis, Volume
from vfix_engine.geometry.mesh import TriangleMesh

HALF_MM = 38.0  # half of the side of a picture of what decides
STEP_MM = 0.5  # finer details of a coarse outline are not drawn
IN_CUT_MM = 1.0  # of the path, from the plane: what counts as in it
_NEAR_MM = 5.0  # targets farther from a plane are not drawn on it
_PIECES = 16  # of an oblique segment of the tool, each as wide as the plane cuts it there
_EXACT_MM = 0.05  # a line is thinned by so much at most


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
    volume: drawn in grey, or None. half: of the side of the picture, mm; beyond HALF_MM outlines are coarse.
    """

    centre: Array
    surfaces: tuple[Outlined, ...]
    path: Array
    start: Array
    end: Array
    radius: Array
    targets: tuple[Array, ...] = ()
    volume: Volume | None = None
    half: float = HALF_MM


def cut_picture(plane: Plane, shown: Shown) -> str:
    """One cut as SVG, one unit a millimetre."""
    half, centre, size = shown.half, shown.centre, shown.half / HALF_MM
    scale = 10 if size < 2.0 else 50  # mm
    near = [place for place in shown.targets if abs(place - centre)[plane.through] <= _NEAR_MM]
    parts = [
        "" if shown.volume is None else _grey(plane, shown.volume, centre),
        *(f'<path style="stroke:{one.css}" d="{_outline(plane, one.mesh, centre, half)}"/>' for one in shown.surfaces),
        *_tool(plane, shown),
        *_path(plane, shown),
        *(_dot(plane.project(place, centre), size) for place in near),
        *_letters(plane.letters, size),
        f'<path class="scale" d="M{half - 3.0 * size - scale:g} {half - 3.0 * size:g}h{scale}"/>'
        f'<text x="{half - 3.0 * size - 0.5 * scale:g}" y="{half - 4.0 * size:g}">{scale} mm</text>',
    ]
    words = f"{plane.name.title()} cut"
    return (
        f'<svg viewBox="{-half:g} {-half:g} {2 * half:g} {2 * half:g}" style="--size:{size:g}" role="img" '
        f'aria-label="{escape(words)}">'
        f"{''.join(parts)}</svg>"
    )


def _outline(plane: Plane, mesh: TriangleMesh, centre: Array, half: float) -> str:
    """Where a surface crosses the plane, as the data of an SVG path."""
    segments = outline(plane, mesh, centre, half)
    return coarse(segments) if half > HALF_MM else "".join(line(segment) for segment in segments)


def coarse(segments: Array) -> str:
    """Segments (n, 2, 2) to STEP_MM, each once, as the data of an SVG path."""
    kept = np.round(segments / STEP_MM) * STEP_MM
    kept = np.unique(kept[(kept[:, 0] != kept[:, 1]).any(axis=1)], axis=0)
    return "".join(f"M{a:g} {b:g}L{c:g} {d:g}" for a, b, c, d in kept.reshape(-1, 4))


def outline(plane: Plane, mesh: TriangleMesh, centre: Array, half_mm: float = HALF_MM) -> Array:
    """Where a surface crosses the plane: segments (n, 2, 2) in picture coordinates, of triangles within `half_mm`."""
    import trimesh  # imported here: slow to load

    corners = mesh.triangles
    away = np.stack([corners.min(axis=1) - centre, centre - corners.max(axis=1)]).max(axis=0)  # > 0: all beyond
    reach = np.full(3, half_mm)
    reach[plane.through] = 0.0
    near = np.flatnonzero((away <= reach).all(axis=1))
    if not len(near):
        return np.zeros((0, 2, 2))
    surface = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, validate=False)
    pairs = trimesh.intersections.mesh_plane(surface, np.eye(3)[plane.through], centre, local_faces=near)
    return plane.project(pairs, centre)


def _tool(plane: Plane, shown: Shown) -> Iterator[str]:
    """The tool as a whole, faded, and above it what the plane cuts of it: capsules, as the balls along their axes."""
    capsules = list(zip(shown.start, shown.end, shown.radius.tolist(), strict=True))
    whole = [_stroke(plane.project(np.stack([a, b]), shown.centre), 2.0 * radius) for a, b, radius in capsules]
    cut = list[str]()
    for a, b, radius in capsules:
        across, start = (b - a)[plane.through], (a - shown.centre)[plane.through]
        level = abs(across) < _EXACT_MM
        first, last = (
            (0.0, 1.0) if level else np.clip(np.sort((np.array([-radius, radius]) - start) / across), 0.0, 1.0)
        )
        ends = a + np.linspace(first, last, 2 if level else _PIECES + 1)[:, None] * (b - a)
        away = (0.5 * (ends[1:] + ends[:-1]) - shown.centre)[:, plane.through]
        widths = 2.0 * np.sqrt(np.maximum(radius**2 - away**2, 0.0))
        flat = plane.project(ends, shown.centre)
        cut += [
            _stroke(flat[n : n + 2], width) for n, width in enumerate(widths.tolist()) if width > 0.0 and last > first
        ]
    yield f'<g class="tool beyond">{"".join(whole)}</g>'
    if cut:
        yield f'<g class="tool">{"".join(cut)}</g>'


def _path(plane: Plane, shown: Shown) -> Iterator[str]:
    """The path as a whole, dashed, and above it what lies in the plane; as far as the picture shows it."""
    flat = plane.project(shown.path, shown.centre)
    seen = np.asarray(np.abs(flat).max(axis=1) <= shown.half + 1.0)
    near = seen & (np.abs(shown.path[:, plane.through] - shown.centre[plane.through]) <= IN_CUT_MM)
    for name, kept in (("path beyond", seen), ("path", near)):
        if data := "".join(line(_thinned(run)) for run in _runs(flat, kept)):
            yield f'<path class="{name}" d="{data}"/>'


def _runs(points: Array, kept: BoolArray) -> Iterator[Array]:
    """The parts (m, 2) of a line of points (n, 2) that are kept, of two points at least."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]])))
    return (points[first:last] for first, last in edges.reshape(-1, 2).tolist() if last - first > 1)


def _thinned(points: Array) -> Array:
    import cv2  # imported here: slow to load

    return cv2.approxPolyDP(points.astype(np.float32), _EXACT_MM, False).reshape(-1, 2).astype(np.float64)


def _grey(plane: Plane, volume: Volume, centre: Array) -> str:
    """The scan in grey; nothing where the plane lies outside of it."""
    import cv2  # imported here: slow to load

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


def _stroke(points: Array, width: float) -> str:
    return f'<path style="stroke-width:{width:.2f}" d="{line(points)}"/>'


def _dot(place: Array, size: float) -> str:
    x, y = place.tolist()
    return f'<circle class="target" cx="{x:.2f}" cy="{y:.2f}" r="{1.2 * size:.3g}"/>'


def _letters(letters: Sequence[str], size: float) -> Iterable[str]:
    """size: of the letters, 1 in a picture of HALF_MM."""
    edge = HALF_MM - 2.5
    places = ((-edge, 1.2), (edge, 1.2), (0.0, 2.4 - edge), (0.0, edge))
    return (
        f'<text class="letter" x="{size * x:g}" y="{size * y:g}">{letter}</text>'
        for letter, (x, y) in zip(letters, places, strict=True)
    )
