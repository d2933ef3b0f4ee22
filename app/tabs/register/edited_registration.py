"""The registration that a client has open in the Register tab: its edits and the page's view of it."""

from __future__ import annotations

import msgspec

from app.documents.editor import check_still_newest
from app.kit.errors import NotFound
from app.kit.kept import Kept, Same
from app.kit.values import Position
from app.messages.fields import ClientMessage
from app.messages.sections import Section
from app.operations.messages import OperationMessage
from app.operations.operation import Change, Operation
from app.operations.standard import Redo, Undo
from app.plans.service import Plan
from app.registration.document import StoredRegistration
from app.registration.edits import found_pair
from app.registration.operations import SPEC, AddPair, Reorder
from app.registration.point_order import OrderAnswer
from app.registration.target_errors import ErrorTable
from app.services import Services
from app.tabs.register import commands as c
from app.tabs.register.sections import FiducialMark, RegistrationSection
from app.tabs.register.views import marks_of, registration_view
from vfix_engine.errors import InputError, VfixError


class EditedRegistration:
    """What one client does with one registration. Owned by the session's thread."""

    def __init__(self, services: Services, registration_id: str) -> None:
        """Raises NotFound and InputError."""
        self._services = services
        self._editor = services.registrations.editor(registration_id)
        self._changes = services.store.changes
        self._seen = self._changes.of_document(registration_id)  # before it is read
        self.document = self._editor.document
        self._anatomy = services.cases.get(self.document.case_id).anatomy.name
        self.selected: str | None = None
        self._marks: Kept[list[FiducialMark]] = Kept()
        self._orders: tuple[int, OrderAnswer] | None = None  # with the revision that it is of
        self._errors: Kept[ErrorTable] = Kept()

    @property
    def id(self) -> str:
        return self.document.id

    def refresh(self) -> None:
        """Read the registration anew where it was changed since, but by an edit from here: others edit too.

        Raises InputError where it cannot be read any more.
        """
        seen = self._changes.of_document(self.id)
        if seen != self._seen:
            self._show(self._editor.document)
            self._seen = seen

    def _show(self, document: StoredRegistration) -> None:
        self.document = document
        known = {pair.id for pair in document.content.pairs} | {bead.id for bead in document.content.beads}
        if self.selected not in known:
            self.selected = None

    def _do(self, operation: Operation) -> None:
        """Do an operation on the revision that is shown."""
        assert isinstance(operation, Change)
        try:
            document = operation.run(SPEC.context(self._services, self.document.revision), self.id)
        except VfixError:
            self._show(self._editor.document)
            raise
        self._show(document)
        self._seen = self._seen[0], document.revision

    def operate(self, message: OperationMessage, cross: Position | None) -> str:
        """Do an operation; returns words for the user, often none. Raises VfixError where it cannot be done.

        cross: where the slices cross.
        """
        (operation,) = message.operations
        check_still_newest(message.revision, self.document.revision)
        if not self.document.locked:
            if isinstance(operation, Undo) and not self.document.can_undo:
                return "There is nothing to undo."
            if isinstance(operation, Redo) and not self.document.can_redo:
                return "There is nothing to redo."
        if isinstance(operation, AddPair) and operation.in_image is None:
            if cross is None:
                raise InputError("this head has no slices to take a place from.")
            operation = msgspec.structs.replace(operation, in_image=cross)
        self._do(operation)
        if isinstance(operation, AddPair):
            self.selected = operation.added(self.document)
        return self.document.told

    def order(self, command: ClientMessage) -> None:
        """Find an order of the points, forget it or take it. Raises VfixError where it cannot be done."""
        orders = self.orders()
        match command:
            case c.TakeOrder():
                if orders is None or command.candidate >= len(orders.candidates):
                    raise InputError("the points have changed since the order was looked for; look again.")
                self._do(Reorder(measured_of=dict(orders.candidates[command.candidate].measured_of)))
                self._orders = None
            case c.MatchOrder(type="order.find"):
                answer = self._services.registering.order(self.document.content)
                self._orders = (self.document.revision, answer)
            case _:
                self._orders = None

    def orders(self) -> OrderAnswer | None:
        """The orders that were found of the points as they are."""
        known = self._orders
        return known[1] if known is not None and known[0] == self.document.revision else None

    def place_of(self, item_id: str) -> Position | None:
        """Where a pair or a bead is in the image."""
        content = self.document.content
        for bead in content.beads:
            if bead.id == item_id:
                return bead.position
        return found_pair(content, item_id).in_image

    # -- for the page

    def section(self, plan: Plan | None, has_volume: bool) -> Section[RegistrationSection]:
        """The page's section."""
        key = Same(self.document), Same(plan), Same(self.orders()), self.selected, has_volume
        return Section(key, lambda: self._view(plan, has_volume))

    def _view(self, plan: Plan | None, has_volume: bool) -> RegistrationSection:
        report = self._services.registering.report(self.document.content)
        return registration_view(
            self.document, report, self._table(plan), self.orders(), self.selected, has_volume, self._anatomy
        )

    def marks(self) -> list[FiducialMark]:
        """What the slices and the scene show of it."""
        return self._marks.get((Same(self.document), self.selected), self._marks_now)

    def _marks_now(self) -> list[FiducialMark]:
        content = self.document.content
        return marks_of(content, self._services.registering.report(content), self.selected)

    def error_balls(self, plan: Plan | None) -> tuple[tuple[Position, float], ...]:
        """The plan’s targets, LPS mm, and the radius in mm that the registration error stays within (95 %)."""
        errors = [target.error for target in self._table(plan).targets]
        return tuple((error.position, error.within_95_mm) for error in errors)

    def _table(self, plan: Plan | None) -> ErrorTable:
        same = plan if plan is not None and plan.case_id == self.document.case_id else None
        key = Same(self.document), Same(same)
        return self._errors.get(key, lambda: self._services.registering.errors(self.document.content, same))


def newest(services: Services, case_id: str, wanted: str | None) -> EditedRegistration | None:
    """The wanted registration of a case, else the newest that can be read; None where there is none."""
    ids = [title.id for title in services.registrations.titles(case_id)]
    ids.sort(key=lambda known: known == wanted)  # stable: the wanted one is the last
    for known in reversed(ids):
        try:
            return EditedRegistration(services, known)
        except (NotFound, InputError):
            continue  # the list says which cannot be read
    return None
