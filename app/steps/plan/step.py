"""The planning side of a tab: which plan is open, its desk, and what the tool makes of its path."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

import numpy as np
import numpy.typing as npt

from app.messages.fields import Command
from app.messages.sections import PlanEntry, PlanningSections
from app.scene.picking import hit_items
from app.scene.plan import DragEvent, PlanItem
from app.scene.view import ClickRay
from app.services import Services
from app.session.view_model import ViewModel
from app.steps.plan import commands as c
from app.steps.plan.dry_runs import Corridor, DryRuns
from app.steps.plan.edited_plan import EditedPlan, Ghost, curve_points, curve_section
from app.steps.plan.hints import plan_hint
from app.views.case_view import CaseView
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError, PlanError

Floats = npt.NDArray[np.float64]
Position = tuple[float, float, float]
SELECT_RADIUS_MM = 2.0


class PlanStep:
    """Owned by its workspace's thread."""

    def __init__(
        self, services: Services, board: ViewModel, executor: Executor, ask: Callable[[Callable[[], None]], Any]
    ) -> None:
        self._services, self._board = services, board
        self._desk: EditedPlan | None = None
        self._case_id: str | None = None
        self._plans: list[Any] = []
        self._focus: Position | None = None
        self._corridor_key: Any = None
        self._corridor = DryRuns(
            services, executor, lambda ticket, answer: ask(lambda: self._corridor.accept(ticket, answer))
        )

    # -- opening

    def open(self, case_id: str, plan_id: str | None) -> str:
        """Open a plan of a case: the named one, else the newest that can be read, else a new one.

        Returns why others could not be opened, '' where none was passed over.
        """
        self.close()
        self._case_id = case_id
        ids = [plan.id for plan in self._services.plans.titles(case_id)]  # oldest first
        ids.sort(key=lambda known: known == plan_id)  # stable: the wanted one is the last
        unreadable: list[str] = []
        for known in reversed(ids or [self._services.plans.create(case_id, "Plan 1").id]):
            try:
                self._load(known)
                break
            except InputError as error:
                unreadable.append(str(error))
        return " ".join(unreadable)

    def close(self) -> None:
        self._case_id = self._desk = None
        self._plans = []
        self._corridor.clear()

    def _load(self, plan_id: str) -> None:
        self._check_own(plan_id)
        self._desk = EditedPlan(self._services, plan_id)
        points = self._desk.points()
        self._focus = points[len(points) // 2] if points else None
        self._corridor_key = None

    def _check_own(self, plan_id: str) -> None:
        """Raise PlanError for a plan of another head: its points lie in other anatomy; and for a deleted one."""
        plan = self._services.plans.get(plan_id)
        if plan.case_id != self._case_id:
            raise PlanError("that plan belongs to another head; open that head first.")
        if plan.deleted_at is not None:
            raise PlanError("that plan is deleted; restore it first.")

    # -- what there is

    @property
    def plan_id(self) -> str | None:
        return None if self._desk is None else self._desk.plan_id

    @property
    def plan(self) -> Any:
        return None if self._desk is None else self._desk.plan

    @property
    def selected(self) -> str | None:
        return None if self._desk is None else self._desk.selected

    @property
    def locked(self) -> bool:
        return self._desk is None or self._desk.locked

    @property
    def ghost(self) -> Ghost | None:
        return None if self._desk is None else self._desk.ghost

    def items(self) -> tuple[PlanItem, ...]:
        return () if self._desk is None else tuple(self._desk.items())

    def places(self) -> list[Position]:
        return [item.position for item in self.items()]

    def curve_key(self) -> Any:
        """Changes when the spline or its colours do."""
        return (tuple(self._desk.points()), self._desk.dragging, id(self._corridor.current)) if self._desk else None

    def _shown_corridor(self) -> Corridor:
        """The dry run that belongs to the points as they are shown; none while a hand drags one of them."""
        if self._desk is not None and self._desk.dragging:
            return Corridor("computing", "Let go of the point to see whether the tool fits among the bone.")
        return self._corridor.current

    def curve(self) -> tuple[Floats | None, Floats | None]:
        """Places along the spline, and the clearance of the whole tool there where it is known."""
        samples = self._shown_corridor().samples()
        if samples is not None:
            return samples
        return curve_points(None if self._desk is None else self._desk.path()), None

    def take_focus(self) -> Position | None:
        """Where the slices should go now, once."""
        focus, self._focus = self._focus, None
        return focus

    # -- commands

    def do(self, command: Command) -> str:
        """Answer an editing command; returns words for the user, often none."""
        desk = self._need()
        before = desk.selected
        words = self._edit(desk, command)
        chosen = isinstance(command, c.ItemCommand) and command.type == "item.select"  # again, perhaps
        if desk.selected is not None and (chosen or desk.selected != before):
            self._focus = next((item.position for item in desk.items() if item.id == desk.selected), None)
        return words

    def _edit(self, desk: EditedPlan, command: Command) -> str:
        match command:
            case c.AddMode():
                desk.add_mode = command.kind
                desk.cancel()
            case c.Lock():
                desk.set_locked(command.locked)
            case c.PickOnSlice():
                desk.pick(np.array(command.position), on_bone=False)
                self._focus = None if desk.ghost is None else desk.ghost.position
            case c.DragItem():
                desk.drag(command.item_id, command.position)
            case c.RenameItem():
                desk.rename(command.item_id, command.label)
            case c.ItemCommand():
                return self._item(desk, command)
            case c.EditCommand():
                return self._plain(desk, command.type)
            case _:
                raise InputError(f"the command {type(command).__name__} cannot be used here.")
        return ""

    def _item(self, desk: EditedPlan, command: c.ItemCommand) -> str:
        if command.type == "item.drop":
            return desk.drop(command.item_id)
        if command.type == "item.delete":
            desk.delete(command.item_id)
        elif command.type == "point.insert_after":
            desk.insert_between(command.item_id)
            self._focus = None if desk.ghost is None else desk.ghost.position
        else:
            desk.kind_of(command.item_id)
            desk.selected = command.item_id
        return ""

    def _plain(self, desk: EditedPlan, name: str) -> str:
        act = {"undo": desk.undo, "redo": desk.redo, "ghost.confirm": desk.confirm, "ghost.cancel": desk.cancel}[name]
        return act() or ""

    def do_plan(self, command: c.PlanCommand | c.NewPlan | c.RenamePlan) -> str:
        """Open, make, rename, duplicate, delete and restore plans; returns words for the user, often none."""
        plans = self._services.plans
        match command:
            case c.NewPlan():
                if self._case_id is None:
                    raise PlanError("open a head first; a plan belongs to one.")
                self._load(plans.create(self._case_id, command.name).id)
            case c.RenamePlan():
                plans.rename(command.plan_id, command.name)
                if command.plan_id == self.plan_id:
                    self._reload()
            case c.PlanCommand(type="plan.open"):
                self._load(command.plan_id)
            case c.PlanCommand(type="plan.duplicate"):
                self._check_own(command.plan_id)
                self._load(plans.duplicate(command.plan_id).id)
            case c.PlanCommand(type="plan.restore"):
                plans.restore(command.plan_id)
            case c.PlanCommand():
                plans.delete(command.plan_id)
                if command.plan_id == self.plan_id and self._case_id is not None:
                    return self.open(self._case_id, None)
        return ""

    def _reload(self) -> None:
        """Read the open plan again, keeping what is selected."""
        old = self._need()
        desk = EditedPlan(self._services, old.plan_id)
        desk.selected, desk.add_mode = old.selected, old.add_mode
        self._desk = desk

    def _need(self) -> EditedPlan:
        if self._desk is None:
            raise PlanError("no plan is open.")
        return self._desk

    # -- the scene

    def click(self, ray: ClickRay, head: CaseView) -> str:
        """A click in the scene: on the ghost it confirms, on an item it selects, else it picks a place."""
        desk = self._need()
        if desk.ghost is not None:
            ghost = hit_items(ray.origin, ray.direction, [("ghost", np.array(desk.ghost.position))], SELECT_RADIUS_MM)
            if ghost is not None:
                return self.do(c.EditCommand(type="ghost.confirm"))
        items = [(item.id, np.array(item.position)) for item in desk.items()]
        hits = [hit_items(ray.origin, ray.direction, items, SELECT_RADIUS_MM), head.hit(ray)]
        hit = min((hit for hit in hits if hit is not None), key=lambda hit: hit.distance_mm, default=None)
        if hit is None:
            return "Nothing is there in the head; air can be clicked in a slice."
        if hit.item_id is not None:
            return self.do(c.ItemCommand(type="item.select", item_id=hit.item_id))
        desk.pick(hit.position, on_bone=hit.kind == "bone")
        self._focus = None if desk.ghost is None else desk.ghost.position
        return ""

    def dragged(self, drag: DragEvent) -> str:
        desk = self._need()
        if drag.phase == "end":
            return desk.drop(drag.item_id)
        desk.drag(drag.item_id, drag.position)
        return ""

    def let_go(self) -> None:
        """The hand is gone: what it was dragging is where it was before."""
        if self._desk is not None:
            self._desk.let_go()

    def quiet(self) -> None:
        """Another step begins: what was only half done is taken back."""
        if self._desk is not None:
            self._desk.cancel()

    # -- for the page

    def hint(self) -> str:
        desk = self._desk
        if desk is None:
            return "Open a head first." if self._case_id is None else "Choose a plan below, or make a new one."
        plan = desk.plan
        if plan.deleted_at is not None:
            return "This plan was deleted elsewhere. Restore it from the list of plans, or open another one."
        return plan_hint(
            len(plan.points),
            len(plan.targets),
            desk.add_mode,
            desk.ghost is not None,
            desk.locked,
            self._shown_corridor().completed,
            self._shown_corridor().caution,
        )

    def publish(self, fresh: bool) -> None:
        """Publish the sections; ``fresh`` reads plan and list anew, which others may have changed.

        Raises InputError when the open plan cannot be read any more; it is closed then.
        """
        if self._case_id is not None and (fresh or not self._plans):
            self._plans = list(self._services.plans.titles(self._case_id, include_deleted=True))
        if fresh and self._desk is not None:
            try:
                self._desk.refresh()
            except InputError:
                self._desk = None
                self._corridor.clear()
                raise
        self._refresh_corridor()
        items: list[PlanEntry] = [
            {"id": plan.id, "name": plan.name, "modified": str(plan.modified), "deleted": bool(plan.deleted_at)}
            for plan in self._plans
        ]
        sections: PlanningSections = {
            "plans": {"items": items},
            "plan": None if self._desk is None else self._desk.view(),
            "curve": curve_section(self.curve()[0]),
            "corridor": self._shown_corridor().view(),
        }
        self._board.publish(sections)

    def _refresh_corridor(self) -> None:
        """Ask for a dry run when the stored path or what it depends on is another one."""
        if self._desk is None:
            return
        plan = self._desk.plan
        key = (
            plan.id,
            tuple(point.position for point in plan.points),
            plan.tool,
            repr(plan.settings),
            repr(plan.robot),
        )
        if key == self._corridor_key:
            return
        self._corridor_key = key
        if len(plan.points) < 2:
            self._corridor.clear()
        else:
            self._corridor.ask(plan, ControlSettings.from_dict(dict(plan.settings)).margin_mm)


__all__ = ["Corridor", "PlanStep"]
