"""Plan: which plan is open, its points and targets, and what the tool makes of its path."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from app.messages.fields import Command
from app.scene.picking import hit_items
from app.scene.plan import DragEvent, GhostNodes, PlanItem
from app.scene.view import ClickRay
from app.services.plans import Plan
from app.steps.base import Step
from app.steps.plan import SPEC
from app.steps.plan import commands as c
from app.steps.plan.dry_runs import Corridor, DryRuns
from app.steps.plan.edited_plan import EditedPlan, Ghost
from app.steps.plan.hints import plan_hint
from app.steps.plan.instruments import instruments_section
from app.steps.plan.sections import PlanEntry, PlanSections
from app.views.layers import Layer
from app.views.plan_items import Position, curve_layer, curve_points, curve_section, items_layer
from app.views.views import Views
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError, PlanError

Floats = npt.NDArray[np.float64]
SELECT_RADIUS_MM = 2.0


class PlanStep(Step):
    """Opens plans for all steps, and edits the open one."""

    spec = SPEC

    def __init__(self, views: Views, shared: Any = None) -> None:
        super().__init__(views, shared)
        self._services = views.services
        self._edited: EditedPlan | None = None
        self._case_id: str | None = None
        self._plans: list[Any] = []
        self._corridor_key: Any = None
        self._corridor = DryRuns(
            views.services,
            views.executor,
            lambda ticket, answer: views.post(lambda: self._corridor.accept(ticket, answer)),
        )
        views.plan.provide(lambda: self.plan)
        views.on_case_opened(self._case_opened)

    # -- opening

    def available(self) -> bool:
        return self.views.case.case_id is not None

    def _case_opened(self, plan_id: str | None) -> None:
        case_id = self.views.case.case_id
        try:
            if case_id is None:
                self.close_plan()
            else:
                self.views.note(self.open(case_id, plan_id), error=True)
        finally:
            self.views.plan.opened(again=True)

    def open(self, case_id: str, plan_id: str | None) -> str:
        """Open a plan of a case: the named one, else the newest that can be read, else a new one.

        Returns why others could not be opened, '' where none was passed over.
        """
        self.close_plan()
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

    def close_plan(self) -> None:
        self._case_id = self._edited = None
        self._plans = []
        self._corridor.clear()

    def _load(self, plan_id: str) -> None:
        self._check_own(plan_id)
        self._edited = EditedPlan(self._services, plan_id)
        points = self._edited.points()
        self._corridor_key = None
        if points:
            self.views.case.go_to(points[len(points) // 2])

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
        return None if self._edited is None else self._edited.plan_id

    @property
    def plan(self) -> Plan | None:
        return None if self._edited is None else self._edited.plan

    def items(self) -> tuple[PlanItem, ...]:
        return () if self._edited is None else tuple(self._edited.items())

    def places(self) -> list[Position]:
        return [item.position for item in self.items()]

    def curve_key(self) -> Any:
        """Changes when the spline or its colours do."""
        return (
            (tuple(self._edited.points()), self._edited.dragging, id(self._corridor.current)) if self._edited else None
        )

    def _shown_corridor(self) -> Corridor:
        """The dry run that belongs to the points as they are shown; none while a hand drags one of them."""
        if self._edited is not None and self._edited.dragging:
            return Corridor("computing", "Let go of the point to see whether the tool fits among the bone.")
        return self._corridor.current

    def curve(self) -> tuple[Floats | None, Floats | None]:
        """Places along the spline, and the clearance of the whole tool there where it is known."""
        samples = self._shown_corridor().samples()
        if samples is not None:
            return samples
        return curve_points(None if self._edited is None else self._edited.path()), None

    # -- commands

    def handle(self, command: Command) -> None:
        """Answer a command; raises VfixError with the reason where that cannot be done."""
        if isinstance(command, c.PlanCommand | c.NewPlan | c.RenamePlan):
            self.views.stale = True
            self.views.note(self._handle_plan(command), error=True)
            self.views.plan.opened()
        else:
            self._handle_edit(command)

    def _handle_edit(self, command: Command) -> None:
        edited = self._need()
        before = edited.selected
        words = self._edit(edited, command)
        chosen = isinstance(command, c.ItemCommand) and command.type == "item.select"  # again, perhaps
        if edited.selected is not None and (chosen or edited.selected != before):
            self._go_to(edited.place_of(edited.selected))
        self.views.note(words)

    def _go_to(self, position: Position | None) -> None:
        """Slices go through the point that was just chosen or added."""
        if position is not None:
            self.views.case.go_to(position)

    def _go_to_ghost(self, edited: EditedPlan) -> None:
        self._go_to(None if edited.ghost is None else edited.ghost.position)

    def _edit(self, edited: EditedPlan, command: Command) -> str:
        match command:
            case c.AddMode():
                edited.add_mode = command.kind
                edited.cancel()
            case c.Lock():
                edited.set_locked(command.locked)
            case c.PickOnSlice():
                edited.pick(np.array(command.position), on_bone=False)
                self._go_to_ghost(edited)
            case c.DragItem():
                edited.drag(command.item_id, command.position)
            case c.RenameItem():
                edited.rename(command.item_id, command.label)
            case c.ChooseRobot():
                edited.choose_robot(command.model_dump(include={"name", "urdf", "tool_frame"}, exclude_none=True))
            case c.ChooseTool():
                shape = command.model_dump(include={"bend_deg", "shaft_radius_mm"}, exclude_none=True)
                edited.choose_tool(command.name, shape)
            case c.ItemCommand():
                return self._item(edited, command)
            case c.EditCommand():
                return self._plain(edited, command.type)
            case _:
                raise InputError(f"the command {type(command).__name__} cannot be used here.")
        return ""

    def _item(self, edited: EditedPlan, command: c.ItemCommand) -> str:
        if command.type == "item.drop":
            return edited.drop(command.item_id)
        if command.type == "item.delete":
            edited.delete(command.item_id)
        elif command.type == "point.insert_after":
            edited.insert_between(command.item_id)
            self._go_to_ghost(edited)
        else:
            edited.kind_of(command.item_id)
            edited.selected = command.item_id
        return ""

    def _plain(self, edited: EditedPlan, name: str) -> str:
        act = {
            "undo": edited.undo,
            "redo": edited.redo,
            "ghost.confirm": edited.confirm,
            "ghost.cancel": edited.cancel,
        }[name]
        return act() or ""

    def _handle_plan(self, command: c.PlanCommand | c.NewPlan | c.RenamePlan) -> str:
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
        edited = EditedPlan(self._services, old.plan_id)
        edited.selected, edited.add_mode = old.selected, old.add_mode
        self._edited = edited

    def _need(self) -> EditedPlan:
        if self._edited is None:
            raise PlanError("no plan is open.")
        return self._edited

    # -- the scene

    def clicked(self, ray: ClickRay) -> None:
        """On the ghost it confirms, on an item it selects, else it picks a place."""
        edited = self._need()
        if edited.ghost is not None:
            ghost = hit_items(ray.origin, ray.direction, [("ghost", np.array(edited.ghost.position))], SELECT_RADIUS_MM)
            if ghost is not None:
                edited.confirm()
                self._go_to(edited.place_of(edited.selected))
                return
        items = [(item.id, np.array(item.position)) for item in edited.items()]
        hits = [hit_items(ray.origin, ray.direction, items, SELECT_RADIUS_MM), self.views.case.hit(ray)]
        hit = min((hit for hit in hits if hit is not None), key=lambda hit: hit.distance_mm, default=None)
        if hit is None:
            self.views.note("Nothing is there in the head; air can be clicked in a slice.")
        elif hit.item_id is not None:
            edited.selected = hit.item_id
            self._go_to(edited.place_of(hit.item_id))
        else:
            edited.pick(hit.position, on_bone=hit.kind == "bone")
            self._go_to_ghost(edited)

    def dragged(self, drag: DragEvent) -> None:
        edited = self._need()
        if drag.phase == "end":
            self.views.note(edited.drop(drag.item_id))
        else:
            edited.drag(drag.item_id, drag.position)

    def release(self) -> None:
        """What a hand was dragging is where it was before."""
        if self._edited is not None:
            self._edited.let_go()

    def enter(self) -> None:
        self._cancel()

    def leave(self) -> None:
        self._cancel()

    def _cancel(self) -> None:
        """What was only half done is taken back."""
        if self._edited is not None:
            self._edited.cancel()

    # -- what the scene shows

    def layers(self) -> list[Layer[Any]]:
        edited = self._edited
        ghost: Ghost | None = None if edited is None else edited.ghost
        selected = edited.selected if edited is not None and self.active else None
        return [
            items_layer(self.items(), selected, locked=edited is None or edited.locked or not self.active),
            curve_layer(self.curve_key(), self.curve),
            Layer(
                "plan.ghost",
                ghost,
                GhostNodes,
                lambda nodes: (
                    nodes.show(None, "") if ghost is None else nodes.show(np.array(ghost.position), ghost.words)
                ),
            ),
        ]

    # -- for the page

    def hint(self) -> str:
        edited = self._edited
        if edited is None:
            return "Open a head first." if self._case_id is None else "Choose a plan below, or make a new one."
        plan = edited.plan
        if plan.deleted_at is not None:
            return "This plan was deleted elsewhere. Restore it from the list of plans, or open another one."
        return plan_hint(
            len(plan.points),
            len(plan.targets),
            edited.add_mode,
            edited.ghost is not None,
            edited.locked,
            self._shown_corridor().completed,
            self._shown_corridor().caution,
        )

    def sections(self, fresh: bool) -> PlanSections:
        """fresh: read plan and list anew, which others may have changed.

        Raises InputError when the open plan cannot be read any more; it is closed then.
        """
        if self._case_id is not None and (fresh or not self._plans):
            self._plans = list(self._services.plans.titles(self._case_id, include_deleted=True))
        if fresh and self._edited is not None:
            try:
                self._edited.refresh()
            except InputError:
                self._edited = None
                self._corridor.clear()
                raise
        self._refresh_corridor()
        items: list[PlanEntry] = [
            {"id": plan.id, "name": plan.name, "modified": str(plan.modified), "deleted": bool(plan.deleted_at)}
            for plan in self._plans
        ]
        return {
            "plans": {"items": items},
            "instruments": instruments_section(),
            "plan": None if self._edited is None else self._edited.view(),
            "curve": curve_section(self.curve()[0]),
            "corridor": self._shown_corridor().view(),
        }

    def _refresh_corridor(self) -> None:
        """Ask for a dry run when the stored path or what it depends on is another one."""
        if self._edited is None:
            return
        plan = self._edited.plan
        key = (
            plan.id,
            tuple(point.position for point in plan.points),
            plan.tool,
            repr(plan.tool_shape),
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
