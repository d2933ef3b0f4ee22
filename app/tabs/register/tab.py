"""Register: registrations of the open case, the beads and points of the open one, and the plan that uses it."""

from __future__ import annotations

from typing import Any

from app.kit.kept import Kept, Same
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.operations.messages import OperationMessage
from app.operations.operation import Creation, Operation
from app.operations.standard import Delete, Restore
from app.plans.operations.instruments import UseRegistration
from app.plans.service import Plan
from app.registration.document import StoredRegistration
from app.scene.error_balls import ErrorBalls
from app.scene.fiducials import FiducialNodes, FiducialShape
from app.scene.view import ClickRay, SceneView
from app.tabs.base import Tab
from app.tabs.register import SPEC
from app.tabs.register import commands as c
from app.tabs.register.edited_registration import EditedRegistration, newest
from app.tabs.register.hints import register_hint
from app.tabs.register.sections import (
    FiducialMark,
    PlanUseSection,
    RegistrationEntry,
    RegistrationsSection,
    TrackerView,
)
from app.workspace.layers import Layer
from app.workspace.plan_items import position_of
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError, VfixError


class RegisterTab(Tab):
    """Opens and edits registrations, and lets the open plan use one."""

    spec = SPEC

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        super().__init__(workspace, shared)
        self._services = workspace.services
        self._open: EditedRegistration | None = None
        self._pointer_shown: TrackerView | None = None
        self._error: Kept[tuple[str, bool]] = Kept()  # in the open plan
        self._uses: Kept[PlanUseSection | None] = Kept()
        workspace.on_case_opened(lambda plan_id: self._case_opened())
        workspace.plan.on_opened(self._plan_opened)

    # -- opening

    def _case_opened(self) -> None:
        """The registration of the plan that is open, else the newest of the case."""
        case_id = self.workspace.case.case_id
        self._open = None if case_id is None or not self.offered else newest(self._services, case_id, self._wanted())

    def _plan_opened(self) -> None:
        wanted, case_id = self._wanted(), self.workspace.case.case_id
        if case_id is not None and wanted is not None and (self._open is None or self._open.id != wanted):
            found = newest(self._services, case_id, wanted)
            if found is not None and found.id == wanted:
                self._open = found

    def _wanted(self) -> str | None:
        plan = self.workspace.plan.current
        return None if plan is None else plan.content.registration

    def _need(self) -> EditedRegistration:
        if self._open is None:
            raise InputError("no registration is open; begin one first.")
        return self._open

    # -- commands

    def handle(self, command: ClientMessage) -> None:
        """Answer a command; raises VfixError with the reason where that cannot be done."""
        match command:
            case c.OpenRegistration():
                self._check_own(command.registration_id)
                self._open = EditedRegistration(self._services, command.registration_id)
            case c.UseInPlan():
                self._use(command.used)
            case c.SelectPair():
                self._select(command.pair_id)
            case c.ShowBead():
                self._select(command.bead_id)
            case _:
                self._need().order(command)

    def operate(self, message: OperationMessage) -> None:
        """Do an operation, on the open registration where it names none."""
        (operation,) = message.operations
        if message.target or isinstance(operation, Creation):
            self._manage(message, operation)
            return
        opened = self._need()
        before = opened.selected
        self.workspace.note(opened.operate(message, self.workspace.case.cross))
        if opened.selected is not None and opened.selected != before:
            self._select(opened.selected)

    def _manage(self, message: OperationMessage, operation: Operation) -> None:
        """An operation on the list; what it makes or brings back is opened."""
        if message.target:
            self._check_own(message.target, deleted=isinstance(operation, Restore))
        case_id = self._case_id()
        done = message.perform(message.spec.context(self._services, message.revision), case_id)
        assert done is not None
        here = None if self._open is None else self._open.id
        if isinstance(operation, Delete) and here == done.id:
            self._open = newest(self._services, case_id, None)
        elif done.id != message.target or (isinstance(operation, Restore) and here is None):
            self._open = EditedRegistration(self._services, done.id)
        elif here == done.id:
            self._need().refresh()

    def _select(self, item_id: str) -> None:
        opened = self._need()
        place = opened.place_of(item_id)
        opened.selected = item_id
        self.workspace.case.go_to(place)

    def _case_id(self) -> str:
        if self.workspace.case.case_id is None:
            raise InputError("open a head first; a registration belongs to one.")
        return self.workspace.case.case_id

    def _check_own(self, registration_id: str, deleted: bool = False) -> None:
        """Refuse a registration of another head, and one that is deleted unless that is what is asked for."""
        case_id, title = self._case_id(), self._services.registrations.title(registration_id)
        if title.case_id != case_id:
            raise InputError("that registration belongs to another head; open that head first.")
        if title.deleted_at is not None and not deleted:
            raise InputError("that registration is deleted; restore it first.")

    def _use(self, used: bool) -> None:
        plan = self.workspace.plan.current
        if plan is None:
            raise InputError("open a plan first; it is a plan that uses a registration.")
        wanted = self._need().id if used else None
        self._services.plans.do(plan.id, UseRegistration(registration=wanted), expected_revision=plan.revision)

    # -- the scene

    def clicked(self, ray: ClickRay) -> None:
        """The slices go where the click meets the head, so that a point can be added there."""
        super().clicked(ray)
        hit = self.workspace.case.hit(ray)
        if hit is not None:
            self.workspace.case.go_to(position_of(hit.position))

    def layers(self) -> list[Layer[Any]]:
        marks, case_id = self._marks(), self.workspace.case.case_id
        shapes = tuple(
            FiducialShape(
                mark["id"],
                mark["label"],
                position_of(mark["position"]),
                mark["state"],
                mark["selected"],
                None if mark["measured"] is None else position_of(mark["measured"]),
            )
            for mark in marks
        )
        opened = self._open if self.active else None
        balls = () if opened is None else opened.error_balls(self.workspace.plan.current)
        fiducials = Layer("register.fiducials", shapes, FiducialNodes, lambda nodes: nodes.show(shapes), case_id)
        errors = Layer("register.error", balls, _error_balls, lambda nodes: nodes.show(balls), case_id)
        return ([fiducials] if shapes else []) + ([errors] if balls else [])

    def _marks(self) -> list[FiducialMark]:
        return self._open.marks() if self.active and self._open is not None else []

    # -- for the page

    def hint(self) -> str:
        opened, use = self._open, self._plan_use()
        if opened is None:
            return register_hint(None, None, False, blocked=_blocked(use))
        content = opened.document.content
        used = use is not None and use["here"] and use["state"] == "ready"
        deleted = opened.document.deleted_at is not None
        blocked = "" if use is None or use["here"] else _blocked(use)
        return register_hint(content, self._services.registering.report(content), used, deleted, blocked)

    def subject(self) -> object:
        """Beside no registration little is told of a plan that uses none."""
        plan = self.workspace.plan.current
        told: object = Same(plan)
        if self._open is None and plan is not None and plan.content.registration is None:
            told = plan.id, plan.locked
        return Same(self.workspace.case.case), told, self._stored()

    def refresh(self) -> None:
        """Raises VfixError when the open registration cannot be read any more; it is closed then."""
        if self.workspace.case.case_id is None:
            self._open = None
        if self._open is not None:
            try:
                self._open.refresh()
            except VfixError:
                self._open = None
                raise

    def sections(self) -> Sections:
        """The :class:`RegisterSections`."""
        opened, marks, case, case_id = self._open, self._marks(), self.workspace.case.case, self.workspace.case.case_id
        has_volume, use = case is not None and case.has_volume, self._plan_use()
        registration: Section[object] = Section.of(None)
        if opened is not None:
            registration = opened.section(self.workspace.plan.current, has_volume)
        return {
            "registrations": Section((case_id, self._stored()), lambda: self._list(case_id)),
            "registration": registration,
            "plan_use": Section(Same(use), lambda: use),
            "fiducials": Section(Same(marks) if marks else None, lambda: {"items": marks}),
            "pointer": Section.of(self._pointer()),
        }

    def _stored(self) -> tuple[int, ...]:
        """Changes with every registration that is stored."""
        return self._services.store.changes.of(self._services.registrations.kind.name)

    def _list(self, case_id: str | None) -> RegistrationsSection:
        titles = () if case_id is None else self._services.registrations.titles(case_id, include_deleted=True)
        items: list[RegistrationEntry] = [
            {"id": one.id, "name": one.name, "modified": str(one.modified), "deleted": bool(one.deleted_at)}
            for one in titles
        ]
        return {"items": items}

    def tick(self) -> bool:
        """The pointer comes into sight and goes out of it while nobody asks for anything."""
        before, self._pointer_shown = self._pointer_shown, self._pointer() if self.active else None
        return before != self._pointer_shown

    def _pointer(self) -> TrackerView | None:
        standing = self._services.registering.tracker_state
        return None if standing is None else {"state": standing.state, "words": standing.words}

    def _plan_use(self) -> PlanUseSection | None:
        plan = self.workspace.plan.current
        opened = None if self._open is None else self._open.id
        return self._uses.get((Same(plan), opened, self._stored()), lambda: self._use_of(plan))

    def _use_of(self, plan: Plan | None) -> PlanUseSection | None:
        if plan is None:
            return None
        used = self._services.registering.registration_of(plan)
        document = used.document
        ready = used.state == "ready" and document is not None
        error_words, balls = self._error_of(plan, document) if ready and document is not None else ("", False)
        return {
            "plan": plan.id,
            "registration": used.id,
            "name": None if document is None else document.name,
            "state": used.state,
            "to": None if document is None or document.unreadable else document.content.to,
            "words": used.words,
            "doubts": list(used.doubts),
            "error_words": error_words,
            "has_balls": balls,
            "here": self._open is not None and used.id == self._open.id,
            "locked": plan.locked,
        }

    def _error_of(self, plan: Plan, document: StoredRegistration) -> tuple[str, bool]:
        """What error is to be expected, in words, and whether the plan's targets have balls of it."""
        key = (plan.id, plan.revision, document.id, document.revision)

        def error() -> tuple[str, bool]:
            table = self._services.registering.errors(document.content, plan)
            return table.short, bool(table.targets)

        return self._error.get(key, error)


def _blocked(use: PlanUseSection | None) -> str:
    """Why the open plan cannot use what it refers to; '' where it can, or refers to none."""
    return "" if use is None or use["state"] in ("none", "ready") else use["words"]


def _error_balls(view: SceneView) -> ErrorBalls:
    return ErrorBalls(view, "register")
