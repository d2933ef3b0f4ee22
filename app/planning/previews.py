"""Previews: evaluations of a plan while a point is dragged, before it is stored, with the robot's base unchanged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from app.cases.service import CaseService
from app.kit.values import Position
from app.planning.evaluation import Planning
from app.planning.placement import StoredPlacement
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.plans.model import Plan
from app.plans.points import PlanPoint
from vfix_engine.progress import ProgressCallback


@dataclass(frozen=True)
class Dragged:
    """A path point that is being dragged.

    position: position of the pointer, LPS mm; on release the point is put at the nearest place clear of bone. None: the
    point stays. direction: unit vector of the shaft, from the tip towards the tail; None: as in the plan.
    """

    point_id: str
    position: Position | None = None
    direction: Position | None = None


@dataclass(frozen=True, eq=False)
class Preview:
    """The evaluation of the dragged path, and how far a release would move the point away from bone, in mm."""

    evaluation: PlanEvaluation
    moved_mm: float = 0.0


class Previews:
    """Evaluates plans while a point is dragged. Thread-safe."""

    def __init__(self, cases: CaseService, planning: Planning) -> None:
        self._cases, self._planning = cases, planning

    def of(
        self,
        plan: Plan,
        dragged: Dragged,
        placement: StoredPlacement,
        progress: ProgressCallback,
        options: RehearsalOptions = NO_OPTIONS,
    ) -> Preview:
        """Evaluate the path with the point where a release would put it.

        placement: of the robot for the stored path; its base stays. progress: as in `Planning.evaluate`.
        Raises PlanError if no place near the pointer is clear of bone, and as `Planning.preview`.
        """
        position, moved_mm = dragged.position, 0.0
        if position is not None:
            fitted = self._planning.snap(self._cases.get(plan.case_id), position, plan)
            position, moved_mm = fitted.position, fitted.moved_mm
        points = [
            replace(point, position=position or point.position, direction=dragged.direction or point.direction)
            if point.id == dragged.point_id
            else point
            for point in plan.content.points
        ]
        return Preview(self._planning.preview(with_points(plan, points), placement, progress, options), moved_mm)


def with_points(plan: Plan, points: Sequence[PlanPoint]) -> Plan:
    """Return the plan with other points for the chosen path, not stored, and without a placement of the robot."""
    return replace(plan, content=plan.content.with_points(points).without_placement())
