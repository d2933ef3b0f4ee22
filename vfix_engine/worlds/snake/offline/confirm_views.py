"""Whether places of a wall that were found viewable are viewed by a robot that is really driven there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....arrays import Array
from ....errors import InputError
from ....geometry.curve import Curve
from ....geometry.mesh import TriangleMesh
from ....pathway.pathway import Pathway
from ....robots.snake import SnakeModel
from ....snake.conform.conforming import driven_curve
from ....validate import whole
from ..settings import DriveSettings
from ..stepping.command import SnakeCommand
from ..viewable import PlannedView, Viewable
from ..viewing import ViewLimits, WallSight, moved_wall
from .drive_view import DriveView
from .look_round import Order, bend_to, straighten
from .operators import SnakeOperator, go_to, insert_to
from .snake_drive import SnakeDrive

_HOLD_S, _LOOKS = 4.0, 4  # a view in moving tissue is held for a breath and looked at so many times
_STEP_S = 0.02  # of a step while a view is held


@dataclass(frozen=True)
class Confirmed:
    """Places driven to: ``viewed`` of ``of``; ``beyond_bound``: steps in which a link was beyond its bound.

    missed: for each place that was not viewed its triangle, the planned and the reached arc length of the tip in mm,
    and what held the robot last, in words.
    """

    of: int
    viewed: int
    beyond_bound: int
    missed: tuple[tuple[int, float, float, str], ...]

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only."""
        names = ("triangle", "tip_mm", "reached_mm", "held_by")
        return {
            "of": self.of, "viewed": self.viewed, "beyond_bound": self.beyond_bound,
            "missed": [dict(zip(names, one, strict=True)) for one in self.missed],
        }  # fmt: skip


def confirm_views(
    mesh: TriangleMesh,
    pathway: Pathway,
    snake: SnakeModel,
    settings: DriveSettings,
    curve: Curve | None,
    slack: Array | None,
    found: Viewable,
    *,
    count: int = 20,
    seed: int = 0,
) -> Confirmed:
    """Drive a robot to views of places drawn by area among those that were found viewable.

    The certified drive, with its joint speeds, in still or moving tissue: inserted to the depth of the view and bent
    the way that was planned. Then the camera, where it really is, has to view the triangle; in moving tissue, where the
    triangle is then, at four times within a breath of 4 s.

    Args:
        mesh, pathway, snake, curve, slack: as for ``viewable_wall``, whose result is ``found``.
        settings: of the drive. count: of places. seed: of the choice.

    Raises:
        InputError: nothing was found viewable; a number of places that is not positive.
    """
    drawn = _drawn(found, whole("the number of places", count, 1), whole("the seed", seed, 0))
    drive = SnakeDrive(snake, pathway, settings, curve, slack, longer_allowed=True)
    look = _Look(mesh, pathway, driven_curve(pathway, curve), found.limits)
    seen: dict[int, bool] = {}
    ends: dict[int, tuple[float, str]] = {}

    def write(view: DriveView) -> Iterator[Order]:
        for triangle in drawn:
            planned = found.views[found.view[triangle]]
            yield from _to(view, planned)
            seen[triangle] = True
            for _ in range(_LOOKS if view.constants.moves else 1):
                seen[triangle] = seen[triangle] and look(view, triangle)
                for _ in range(round(_HOLD_S / _LOOKS / _STEP_S) if view.constants.moves else 0):
                    yield Order(SnakeCommand(), _STEP_S)
            ends[triangle] = view.tip_s, view.state.held_by or ""
            yield from _back(view, planned)

    operator, beyond = SnakeOperator(write), 0
    while (act := operator(drive.system, drive.state)) is not None:
        state = drive.act(act)
        beyond += bool((state.deviation.depth > state.bound + 1e-9).any())
    missed = [k for k in drawn if not seen[k]]
    told = tuple((k, found.views[found.view[k]].tip_s, *ends[k]) for k in missed)
    return Confirmed(len(drawn), len(drawn) - len(missed), beyond, told)


def _drawn(found: Viewable, count: int, seed: int) -> list[int]:
    """Viewable triangles drawn by area, by the depths of their views."""
    area = np.where(found.mask, found.area_mm2, 0.0)
    if not area.any():
        raise InputError("no place was found viewable: there is none to drive to")
    most, random = int((area > 0.0).sum()), np.random.default_rng(seed)
    drawn: list[int] = random.choice(len(area), min(count, most), replace=False, p=area / area.sum()).tolist()
    return sorted(drawn, key=lambda k: (found.views[found.view[k]].tip_s, k))


def _to(drive: DriveView, planned: PlannedView) -> Iterator[Order]:
    """Straight to a view's depth, and its way of bends."""
    yield from (insert_to if planned.tip_s > drive.tip_s else go_to)(drive, planned.tip_s)
    for bend in planned.bends:
        yield from bend_to(drive, bend)


def _back(drive: DriveView, planned: PlannedView) -> Iterator[Order]:
    """Straight again; where the straight motion there is held, by the way that led here."""
    yield from straighten(drive)
    if not drive.straight:
        for bend in planned.bends[::-1]:
            yield from bend_to(drive, bend)
        yield from straighten(drive)


class _Look:
    """Looks at triangles of a wall at the present time of a drive."""

    def __init__(self, mesh: TriangleMesh, pathway: Pathway, line: Curve, limits: ViewLimits) -> None:
        self._mesh, self._pathway, self._line, self._limits = mesh, pathway, line, limits
        self._still = WallSight(mesh, line)

    def __call__(self, drive: DriveView, triangle: int) -> bool:
        """Whether the camera views a triangle now."""
        sight = self._still
        if self._pathway.motion is not None:
            moved = moved_wall(self._mesh, self._pathway, drive.state.t)
            sight = WallSight(moved, self._pathway.curve(drive.state.t))
        camera = drive.snake.camera(drive.q, drive.state.base)
        return triangle in sight.viewed(camera, self._limits)[0]
