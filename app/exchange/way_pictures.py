"""Small pictures of suggested ways as SVG: one cut through the bone for all of them, each with its path and tool."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.exchange.report.cut import PLANES, Plane, coarse, line, outline
from app.kit.cache import Cache
from app.kit.errors import NotFound
from app.kit.jobs import Job, Jobs, Progress
from app.planning.evaluation import Planning
from app.planning.suggestions import SuggestedPaths
from app.plans.instruments import shaped_tool
from app.plans.service import PlanService
from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.suggestion import Alternative

_KEPT = 16  # suggestions, as many as are remembered
_OUTSIDE_MM = 22.0  # length of the shaft that is shown before the entry
_MARGIN_MM = 5.0  # around path and shaft
_SPACING_MM = 1.0  # between the drawn places of a path
_ASPECT = 0.625  # height of a picture to its width
# The planes that a path in the nose lies in, its front at the left of both: the axial one is turned by a quarter.
_ALONG = (
    next(plane for plane in PLANES if plane.name == "sagittal"),
    Plane("axial", 2, 1, (0, -1.0), ("A", "P", "L", "R")),
)


@dataclass(frozen=True, eq=False)
class _Pose:
    """A way with its tool where the verdict has its least clearance; LPS mm.

    path (n, 3). start, end (S, 3) and radius (S,): the tool's axis. outside (3,): of the shaft, before the entry.
    """

    path: Array
    start: Array
    end: Array
    radius: Array
    outside: Array

    @classmethod
    def of(cls, way: Alternative, s_mm: float, radius: Array) -> _Pose:
        """Return the pose of a way with its tip at an arc length."""
        path, row = SplinePath(way.points), int(np.abs(way.run.s - s_mm).argmin())
        start, end = way.run.segments_start[row], way.run.segments_end[row]
        back = (start[-1] - end[-1]) / np.linalg.norm(start[-1] - end[-1])
        places = path.position(np.linspace(0.0, path.length, max(2, int(path.length / _SPACING_MM))))
        outside = end[-1] + back * (float((way.points[0] - end[-1]) @ back) + _OUTSIDE_MM)
        return cls(places, start, end, radius, outside)


@dataclass(frozen=True, eq=False)
class _Frame:
    """The cut that all pictures share. half (2,): of its width and height. bone: its outline as data of an SVG path."""

    plane: Plane
    centre: Array
    half: Array
    bone: str

    def flat(self, places: Array) -> Array:
        """Places (..., 3) as picture coordinates (..., 2)."""
        return self.plane.project(places, self.centre)


class WayPictures:
    """Draws the alternatives of suggestions, once each. Thread-safe."""

    def __init__(self, jobs: Jobs, planning: Planning, plans: PlanService) -> None:
        self._jobs, self._planning, self._plans = jobs, planning, plans
        self._pictures: Cache[str, tuple[str, ...]] = Cache(_KEPT)

    def start(self, looked: SuggestedPaths) -> Job:
        """Draw every alternative of a suggestion as a job; its result is the suggestion's id."""
        plan = self._plans.get(looked.plan_id)

        def work(progress: Progress) -> str:
            progress("Cutting the bone", 0.0)
            mesh = self._planning.bone(plan).mesh
            progress("Drawing the ways", 0.5)
            self._pictures.get(looked.id, lambda: pictures(looked, mesh))
            return looked.id

        lane, same = f"pictures {plan.case_id}", f"pictures {looked.id}"
        return self._jobs.submit(
            work, kind="pictures", lane=lane, case_id=plan.case_id, subject=plan.name, document_id=plan.id, same=same
        )

    def picture(self, suggestion_id: str, alternative: int) -> str:
        """Return the picture of an alternative (index from 0). Raises NotFound if it is not drawn or not cached."""

        def missing() -> tuple[str, ...]:
            raise NotFound(f"there are no pictures of the suggestion {suggestion_id!r:.80}; start their job first.")

        found = self._pictures.get(suggestion_id, missing)
        if alternative >= len(found):
            raise NotFound(f"this suggestion has {len(found)} alternatives.")
        return found[alternative]


def pictures(looked: SuggestedPaths, bone: TriangleMesh) -> tuple[str, ...]:
    """Return a picture of each alternative, one unit a millimetre, all of the same cut.

    Each shows its path and the tool where it has its least clearance, and dashed the shafts of the others there.
    """
    radius, target = shaped_tool(looked.tool, **looked.tool_shape).radius, np.asarray(looked.target)
    ways = zip(looked.found.alternatives, looked.verdicts, strict=True)
    poses = [_Pose.of(way, verdict.s_mm or 0.0, radius) for way, verdict in ways]
    if not poses:
        return ()
    frame = _frame(poses, bone)
    return tuple(_picture(frame, poses, number, target) for number in range(len(poses)))


def _frame(poses: Sequence[_Pose], bone: TriangleMesh) -> _Frame:
    """Return the cut in which the shafts differ most, around all paths and the shafts before the entry."""
    outside, paths = np.array([pose.outside for pose in poses]), np.concatenate([pose.path for pose in poses])
    plane = max(_ALONG, key=lambda one: float(np.ptp(one.project(outside, np.zeros(3)), axis=0).max()))
    shown = np.concatenate([paths, outside])
    centre = 0.5 * (shown.min(axis=0) + shown.max(axis=0))
    centre[plane.through] = np.median(paths[:, plane.through])
    width, height = np.abs(plane.project(shown, centre)).max(axis=0) + _MARGIN_MM
    width = max(float(width), float(height) / _ASPECT)
    drawn = coarse(outline(plane, bone, centre, width))
    return _Frame(plane, centre, np.array([width, _ASPECT * width]), drawn)


def _picture(frame: _Frame, poses: Sequence[_Pose], number: int, target: Array) -> str:
    """Return one way as SVG; its colours are attributes, over which the page's styles go."""
    pose, (width, height), (x, y) = poses[number], frame.half.tolist(), frame.flat(target).tolist()
    others = [frame.flat(np.stack([one.outside, one.end[-1]])) for one in poses if one is not pose]
    parts = [
        f"<title>{frame.plane.name.title()} cut: path, and tool where the clearance is least</title>",
        f'<path class="bone" fill="none" stroke="#8a8f98" stroke-width="0.8" d="{frame.bone}"/>',
        *(
            f'<path class="tool" fill="none" stroke="#6f7783" stroke-linecap="round" stroke-width="{2.0 * radius:.2f}" '
            f'd="{line(frame.flat(np.stack(ends)))}"/>'
            for *ends, radius in zip(pose.start, pose.end, pose.radius.tolist(), strict=True)
        ),
        *(
            f'<path class="other" fill="none" stroke="#6f7783" stroke-dasharray="3 2" d="{line(places)}"/>'
            for places in others
        ),
        f'<path class="path" fill="none" stroke="#0b63b0" stroke-width="1.6" d="{line(frame.flat(pose.path))}"/>',
        f'<circle class="target" fill="#a0278a" cx="{x:.2f}" cy="{y:.2f}" r="2.2"/>',
    ]
    box = f"{-width:.2f} {-height:.2f} {2 * width:.2f} {2 * height:.2f}"
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}">{"".join(parts)}</svg>'
