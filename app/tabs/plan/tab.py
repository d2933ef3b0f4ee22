"""Plan: which plan is open, its points and targets, and what the tool makes of its path."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from app.kit.kept import Same
from app.kit.values import Position
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.operations.messages import OperationMessage
from app.operations.operation import Change, Creation, Operation
from app.operations.standard import Delete, Rename
from app.planning.placement import placed_robot
from app.plans.document import PLAN
from app.plans.operations.document import DuplicatePlan
from app.plans.operations.instruments import KeepPlacement, PlaceRobot
from app.plans.operations.points import TakeTargets
from app.plans.service import Plan
from app.scene.dragging import DragEvent
from app.scene.error_balls import ErrorBalls
from app.scene.plan import GhostNodes, PlanItem
from app.scene.regions import DrawingNodes, RegionNodes
from app.scene.view import ClickRay
from app.tabs.base import Tab
from app.tabs.plan import SPEC
from app.tabs.plan import commands as c
from app.tabs.plan.clearance import pierced_layer, stop_layer
from app.tabs.plan.clearance_commands import HideTool, ShowTool
from app.tabs.plan.edited_plan import EditedPlan, Ghost
from app.tabs.plan.edits import Edits
from app.tabs.plan.evaluations import Evaluations
from app.tabs.plan.hands import Hands
from app.tabs.plan.hints import plan_hint
from app.tabs.plan.instruments import instruments_section
from app.tabs.plan.openings import EntryOpenings
from app.tabs.plan.paths import paths_section
from app.tabs.plan.region_words import DRAW_WORDS
from app.tabs.plan.removed_bone import RemovedBoneCount
from app.tabs.plan.search_fields import SearchFields
from app.tabs.plan.search_watch import SearchWatch
from app.tabs.plan.sections import PlanEntry, PlansSection
from app.tabs.plan.shafts import AIM_WORDS, Shafts
from app.workspace.layers import Layer
from app.workspace.plan_items import curve_layer, curve_points, curve_section, items_layer
from app.workspace.workspace import Workspace
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError, PlanError


class PlanTab(Tab):
    """Opens plans for all tabs, and edits the open one."""

    spec = SPEC

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        super().__init__(workspace, shared)
        self._services = workspace.services
        self._edited: EditedPlan | None = None
        self._case_id: str | None = None
        self._shafts = Shafts(workspace.services)
        self._openings = EntryOpenings(workspace)
        self._hands = Hands(workspace, self._shafts, self._openings)
        self._evaluations = Evaluations(workspace)
        self._edits = Edits(workspace.case, self._shafts, self._evaluations.again)
        self._removed = RemovedBoneCount(workspace)
        self._search = SearchWatch(workspace.services)
        self._search_fields = SearchFields(workspace)
        workspace.plan.provide(lambda: self.plan)
        workspace.on_case_opened(self._case_opened)

    # -- opening

    def _case_opened(self, plan_id: str | None) -> None:
        case_id = self.workspace.case.case_id
        try:
            if case_id is None or not self.offered:
                self.close_plan()
            else:
                self.workspace.note(self.open(case_id, plan_id), error=True)
        finally:
            if self._edited is None:
                self._services.live.opened(self.workspace.client.id, None)
            self.workspace.plan.opened(again=True)

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

    def close(self) -> None:
        self._services.live.opened(self.workspace.client.id, None)

    def close_plan(self) -> None:
        self._case_id = self._edited = None
        self._evaluations.clear()
        self._shafts.clear()

    def _load(self, plan_id: str) -> None:
        self._check_own(plan_id)
        self._shafts.clear()
        self._edited = EditedPlan(self._services, plan_id, self._openings.side_at)
        self._services.live.opened(self.workspace.client.id, plan_id)
        points = self._edited.points()
        self._evaluations.again()
        if points:
            self.workspace.case.go_to(points[0])  # where the work begins

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
        return [item.position for item in self.items()] or self._openings.places(self._edited)

    def curve_key(self) -> Any:
        """Changes when the spline or its colours do."""
        return (tuple(self._edited.points()), Same(self._evaluations.shown(self._edited))) if self._edited else None

    def curve(self) -> tuple[Array | None, Array | None]:
        """Places along the spline, and the clearance of the whole tool there where it is known."""
        samples = self._evaluations.shown(self._edited).samples()
        if samples is not None:
            return samples
        return curve_points(None if self._edited is None else self._edited.path()), None

    # -- commands

    def handle(self, command: ClientMessage) -> None:
        """Answer a command; raises VfixError with the reason where that cannot be done."""
        if isinstance(command, c.OpenPlan):
            self._load(command.plan_id)
            self.workspace.plan.opened()
        elif isinstance(command, ShowTool | HideTool):
            self._show_tool(command)
        elif isinstance(command, c.UseOpening):
            self._edit(lambda edited: edited.enter(self._openings.opening(edited, command.opening_id)))
        else:
            chosen = isinstance(command, c.ItemCommand) and command.type == "item.select"  # again, perhaps
            self._edit(lambda edited: self._edits.do(edited, command), chosen)

    def operate(self, message: OperationMessage) -> None:
        """Do an operation, on the open plan where it names none."""
        (operation,) = message.operations
        if message.target or isinstance(operation, Creation):
            self.workspace.note(self._manage(message, operation), error=True)
            self.workspace.plan.opened()
            return
        assert isinstance(operation, Change)
        if isinstance(operation, TakeTargets):
            self._check_own(operation.plan)
        elif isinstance(operation, PlaceRobot):
            operation = self._placement()
        self._edit(lambda edited: edited.perform(operation, message.revision))

    def _placement(self) -> KeepPlacement:
        """What keeps the placing of the dry run that is shown: another one would take this thread for seconds."""
        shown, plan = self._evaluations.shown(self._edited), self._need().plan
        found = shown.evaluation
        if found is None or shown.provisional:
            raise PlanError("the base is kept once the simulation has ended.")
        registered = None if found.registered is None else found.registered.image
        return KeepPlacement(robot=placed_robot(plan.content.robot, found.base, found.q_start, registered))

    def _show_tool(self, command: ShowTool | HideTool) -> None:
        evaluation = self._evaluations.shown(self._edited).evaluation
        if isinstance(command, HideTool):
            self._evaluations.tool.clear()
        elif evaluation is None:
            raise PlanError("the tool is shown once the simulation has ended.")
        else:
            bone = self._services.planning.bone(self._need().plan).tree
            self.workspace.case.go_to(self._evaluations.tool.at(evaluation, command.s_mm, bone))

    def _edit(self, act: Callable[[EditedPlan], str], chosen: bool = False) -> None:
        """Do something with the open plan, say its words, and go to what it selects; chosen: also where it was that."""
        edited = self._need()
        before = edited.selected
        words = act(edited)
        if edited.selected is not None and (chosen or edited.selected != before):
            self.workspace.case.go_to(edited.place_of(edited.selected))
        self.workspace.note(words)

    def _manage(self, message: OperationMessage, operation: Operation) -> str:
        """Make, rename, duplicate, delete and restore plans; returns words for the user, often none."""
        if isinstance(operation, Creation) and self._case_id is None:
            raise PlanError("open a head first; a plan belongs to one.")
        if isinstance(operation, DuplicatePlan):
            self._check_own(message.target)
        done = message.perform(message.spec.context(self._services, message.revision), self._case_id or "")
        assert done is not None
        if done.id != message.target:  # it was made
            self._load(done.id)
        elif done.id == self.plan_id and isinstance(operation, Delete) and self._case_id is not None:
            return self.open(self._case_id, None)
        elif done.id == self.plan_id and isinstance(operation, Rename):
            self._reload()
        return ""

    def _reload(self) -> None:
        """Read the open plan again, keeping what is selected."""
        old = self._need()
        edited = EditedPlan(self._services, old.plan_id, self._openings.side_at)
        edited.selected, edited.add_mode = old.selected, old.add_mode
        self._edited = edited

    def _need(self) -> EditedPlan:
        if self._edited is None:
            raise PlanError("no plan is open.")
        return self._edited

    # -- the scene

    def clicked(self, ray: ClickRay) -> None:
        self._hands.clicked(self._need(), ray)

    def dragged(self, drag: DragEvent) -> None:
        self._hands.dragged(self._need(), drag)

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
        self._shafts.aiming = None
        if self._edited is not None:
            self._edited.cancel()

    # -- what the scene shows

    def layers(self) -> list[Layer[Any]]:
        edited = self._edited
        ghost: Ghost | None = None if edited is None else edited.ghost
        selected = edited.selected if edited is not None and self.active else None
        evaluation = self._evaluations.shown(edited).evaluation if self.active else None
        return [
            items_layer(self.items(), selected, locked=self._is_still),
            curve_layer(self.curve_key(), self.curve),
            *self._evaluations.tool.layers(evaluation),
            pierced_layer(evaluation),
            stop_layer(evaluation),
            *self._region_layers(),
            self._evaluations.cones.layer(self._edited if self.active else None),
            self._error_layer(),
            self._openings.layer(edited if self.active else None),
            *self._shafts.layers(edited if self.active else None, self._is_still),
            Layer("plan.ghost", ghost, GhostNodes, lambda nodes: self._show_ghost(nodes, ghost)),
        ]

    @property
    def _is_still(self) -> bool:
        """Nothing of the plan can be dragged: it is locked, or the next press belongs to what is drawn or aimed at."""
        edited = self._edited
        if edited is None or edited.locked or not self.active:
            return True
        return edited.regions.drawing is not None or self._shafts.aiming is not None

    def _error_layer(self) -> Layer[Any]:
        """What the targets may be off by behind the plan's registration (95 %)."""
        balls: tuple[tuple[Position, float], ...] = ()
        if self._edited is not None and self.active and self._edited.plan.content.targets:
            balls = self._evaluations.error_balls(self._edited.plan)
        return Layer("plan.error", balls, ErrorBalls, lambda nodes: nodes.show(balls))

    def _region_layers(self) -> list[Layer[Any]]:
        edited = self._edited
        drawn = () if edited is None else edited.regions.drawn()
        drawing = None if edited is None else edited.regions.drawing
        places, locked = () if drawing is None else drawing.places, self._is_still
        return [
            Layer("plan.regions", (drawn, locked), RegionNodes, lambda nodes: nodes.show(drawn, locked)),
            Layer("plan.drawing", places, DrawingNodes, lambda nodes: nodes.show(places)),
        ]

    def _show_ghost(self, nodes: GhostNodes, ghost: Ghost | None) -> None:
        if ghost is None or self._edited is None:
            nodes.show(None)
        else:
            nodes.show(np.array(ghost.position), curve_points(self._edited.preview()))

    # -- for the page

    def hint(self) -> str:
        edited = self._edited
        if edited is None:
            return "Open a head first." if self._case_id is None else "Open a plan under Plans, or make one."
        plan, drawing = edited.plan, edited.regions.drawing
        if drawing is not None:
            return DRAW_WORDS[drawing.request.kind]
        if self._shafts.aiming is not None:
            return AIM_WORDS
        if plan.deleted_at is not None:
            return "This plan was deleted elsewhere. Restore it from the list of plans, or open another one."
        shown = self._evaluations.shown(edited)
        return plan_hint(
            len(plan.content.points),
            len(plan.content.targets),
            edited.add_mode,
            edited.ghost is not None,
            edited.locked,
            None if shown.verdict is None else (shown.verdict.level, shown.verdict.reason),
            "ways" if self._shafts.shows_another_way(edited) else self._search.state(plan),
            plan.content.path.entry_side in ("left", "right"),
            None if shown.verdict is None else shown.verdict.pierced.s_mm,
        )

    def tick(self) -> bool:
        """Whether a search for a path has begun or ended."""
        return self._search.changed(self.plan)

    def subject(self) -> object:
        options = None if self._edited is None else self._services.rehearsal_options.of(self._edited.plan_id)
        return Same(self.workspace.case.case), self._services.store.changes.count, options

    def refresh(self) -> None:
        """Raises InputError when the open plan cannot be read any more; it is closed then."""
        if self._edited is not None:
            try:
                self._edited.refresh()
            except InputError:
                self._edited = None
                self._evaluations.clear()
                raise
        self._evaluations.refresh(self._edited)
        self._removed.refresh(self.plan)
        self._openings.refresh(self._edited)
        if self.active:
            self._search_fields.refresh(self._edited)

    def sections(self) -> Sections:
        """The :class:`PlanSections`."""
        edited, shown_mm = self._edited, self._evaluations.tool.s_mm
        shown = self._evaluations.shown(edited)
        none = Section.of(None)
        return {
            "plans": Section((self._case_id, self._services.store.changes.of(PLAN.name)), self._list),
            "instruments": Section(None, instruments_section),
            "plan": none if edited is None else edited.section(),
            "openings": self._openings.section(edited),
            "paths": none
            if edited is None
            else paths_section(edited.plan, self._services.planning.midplane(edited.plan)),
            "versions": none if edited is None else edited.versions.section(),
            "regions": none if edited is None else edited.regions.section(),
            "second_volume": none if edited is None else edited.second_volume.section(),
            "removed_bone": self._removed.section(),
            "curve": Section(self.curve_key(), lambda: curve_section(self.curve()[0])),
            "corridor": Section((Same(shown), shown_mm), lambda: {**shown.view(), "shown_mm": shown_mm}),
            "shaft": self._shafts.section(edited),
            "cones": self._evaluations.cones.section(edited),
        }

    def _list(self) -> PlansSection:
        plans = () if self._case_id is None else self._services.plans.titles(self._case_id, include_deleted=True)
        items: list[PlanEntry] = [
            {"id": plan.id, "name": plan.name, "modified": str(plan.modified), "deleted": bool(plan.deleted_at)}
            for plan in plans
        ]
        return {"items": items}
