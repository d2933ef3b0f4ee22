"""Plans as they would be: what a hand drags is judged before it is stored, with the robot's base kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from app.cases.service import CaseService
from app.kit.values import Position
from app.planning.evaluation import Planning
from app.planning.placement import StoredPlacement
from app.planning.plan_evaluation import PlanEvaluation
from app.planning.rehearsal_options import NO_OPTIONS, RehearsalOptions
from app.plans.model import Plan, without_placement
from app.plans.points import PlanPoint
from vfix_engine.progress import ProgressCallback


@dataclass(frozen=True)
class Dragged:
    """A path point under a hand.

    position: where the hand is, LPS mm; a release puts the point at the nearest place clear of bone. None: it stays.
    direction: of the shaft, from the tip towards the tail; None: as the plan has it.
    """

    point_id: str
    position: Position | None = None
    direction: Position | None = None


@dataclass(frozen=True, eq=False)
class Preview:
    """The evaluation of the path as it would be, and how far a release would move the point off bone in mm."""

    evaluation: PlanEvaluation
    moved_mm: float = 0.0


class Previews:
    """Judges plans under a hand; may be used from any thread."""

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
        """The path with the point where a release would put it, simulated as the stored one is.

        placement: of the robot along the stored path, whose base is kept. progress: as of `Planning.evaluate`.
        Raises PlanError where no place near the hand is clear of bone, and as `Planning.preview`.
        """
        position, moved_mm = dragged.position, 0.0
        if position is not None:
            fitted = self._planning.snap(self._cases.get(plan.case_id), position, plan)
            position, moved_mm = fitted.position, fitted.moved_mm
        points = [
            replace(point, position=position or point.position, direction=dragged.direction or point.direction)
            if point.id == dragged.point_id
            else point
            for point in plan.points
        ]
        return Preview(self._planning.preview(with_points(plan, points), placement, progress, options), moved_mm)


def with_points(plan: Plan, points: Sequence[PlanPoint]) -> Plan:
    """The plan with another way for the chosen path, not stored; its robot has no placement for that."""
    return replace(plan, points=tuple(points), robot=without_placement(plan.robot))
