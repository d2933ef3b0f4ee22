"""What is known of the open plan's path: the dry run of the stored one, and of the path as it is under a hand."""

from __future__ import annotations

from typing import Any

from app.cases.settings import settings_in_case
from app.kit.kept import Kept, Same
from app.kit.values import Position
from app.planning.placement import StoredPlacement
from app.planning.rehearsal_options import RehearsalOptions
from app.planning.verdict import plan_remarks
from app.plans.model import Plan, drive_parts
from app.plans.paths import Midplane
from app.tabs.plan.clearance import ShownTool
from app.tabs.plan.cones import Cones
from app.tabs.plan.dry_runs import DryRuns, ShownEvaluation
from app.tabs.plan.edited_plan import EditedPlan
from app.tabs.plan.live_previews import LivePreviews
from app.workspace.workspace import Workspace
from vfix_engine.errors import PlanError


class Evaluations:
    """Asks for the runs of one client's plan. Owned by the session's thread."""

    def __init__(self, workspace: Workspace) -> None:
        self._services = workspace.services
        self.stored = DryRuns(workspace.services, workspace.executor, workspace.post)
        self.live = LivePreviews(workspace.services, workspace.executor, workspace.post)
        self.cones = Cones(
            workspace.services, workspace.executor, workspace.post, lambda words: workspace.note(words, error=True)
        )
        self.tool = ShownTool()
        self._key: Any = None
        self._looked: Kept[None] = Kept()
        self._balls: Kept[tuple[tuple[Position, float], ...]] = Kept()
        self._way: Any = None  # plan and path that the runs are of
        self._placement: tuple[Any, StoredPlacement] | None = None  # of the last dry run, with what it belongs to

    def clear(self) -> None:
        """No plan is open."""
        self.stored.clear()
        self.live.clear()
        self._way = None
        self.again()

    def again(self) -> None:
        """The next refresh asks for a dry run of the stored path anew."""
        self._key, self._looked = None, Kept()

    def error_balls(self, plan: Plan) -> tuple[tuple[Position, float], ...]:
        """Each target, and what it may be off by behind the plan's registration, 95 of 100 times at most; LPS mm."""
        return self._balls.get((Same(plan), self._registrations()), lambda: self._error_balls(plan))

    def _registrations(self) -> tuple[int, ...]:
        return self._services.store.changes.of(self._services.registrations.kind.name)

    def _error_balls(self, plan: Plan) -> tuple[tuple[Position, float], ...]:
        try:
            registered = self._services.planning.registration(plan)
        except PlanError:  # the dry run's words say why
            return ()
        places = [target.position for target in plan.content.targets]
        off = None if registered is None else registered.off_mm(places)
        return () if off is None else tuple(zip(places, off.tolist(), strict=True))

    def shown(self, edited: EditedPlan | None) -> ShownEvaluation:
        """The dry run of the points as they are shown: live while a hand drags one of the path."""
        hand = None if edited is None else edited.in_hand
        return self.stored.current if hand is None else self.live.current

    def refresh(self, edited: EditedPlan | None) -> None:
        """Ask for the runs of the path as it is stored and as it is under a hand, where they are others than before."""
        if edited is None:
            self.live.clear()
        else:
            options = self._services.rehearsal_options.of(edited.plan_id).in_force
            midplane = self._services.planning.midplane(edited.plan)
            key = Same(edited), Same(edited.plan), options, self._registrations(), midplane
            self._looked.get(key, lambda: self._refresh_stored(edited, options, midplane))
            self._refresh_live(edited, options)
        self.cones.refresh(edited, self.stored.current)

    def _refresh_stored(self, edited: EditedPlan, options: RehearsalOptions, midplane: Midplane) -> None:
        plan = edited.plan
        driven = repr(drive_parts(plan.content)), self._services.planning.registration_key(plan)
        key = (plan.id, options, *driven, *plan_remarks(plan, midplane))
        if key == self._key:
            return
        before, self._key = self._before(plan), key
        self.tool.clear()
        if len(plan.content.points) < 2:
            self.stored.clear()
        else:
            kept_mm = settings_in_case(plan.content.settings, edited.case.uncertainty).kept_mm
            self.stored.ask(plan, kept_mm, options, before)

    def _before(self, plan: Plan) -> ShownEvaluation | None:
        """What was shown of the same path before this change: of the hand that has let go, else of the stored one."""
        way, self._way = self._way, (plan.id, plan.content.path_id)
        return (self.live.current.pictured or self.stored.current.pictured) if way == self._way else None

    def _refresh_live(self, edited: EditedPlan, options: RehearsalOptions) -> None:
        plan, current = edited.plan, self.stored.current
        robot = [
            plan.id,
            plan.content.path_id,
            plan.content.robot.get("name"),
            plan.content.robot.get("urdf"),
            plan.content.tool,
            plan.content.tool_shape,
        ]
        if current.evaluation is not None:
            self._placement = robot, StoredPlacement(current.evaluation.base, current.evaluation.q_start)
        hand = edited.in_hand
        if hand is None or len(plan.content.points) < 2:
            self.live.clear()
            return
        placement = self._placement[1] if self._placement is not None and self._placement[0] == robot else None
        self.live.ask(plan, hand, current, placement, options)
