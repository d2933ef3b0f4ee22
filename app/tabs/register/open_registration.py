"""The registration that a client has open in the Register tab: its edits and the page's view of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.documents import check_still_newest
from app.kit.errors import NotFound
from app.kit.kept import Kept, Same
from app.kit.values import Position
from app.messages.fields import Command
from app.messages.sections import Section
from app.plans.service import Plan
from app.registration.editor import StoredRegistration, found_pair
from app.registration.point_order import OrderAnswer
from app.registration.target_errors import ErrorTable
from app.services import Services
from app.tabs.register import commands as c
from app.tabs.register.sections import FiducialMark, RegistrationSection
from app.tabs.register.views import marks_of, registration_view
from vfix_engine.errors import InputError, VfixError


class OpenRegistration:
    """What one client does with one registration. Owned by the session's thread."""

    def __init__(self, services: Services, registration_id: str) -> None:
        """Raises NotFound and InputError."""
        self._services = services
        self._editor = services.registering.editor(registration_id)
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

    def _edit(self, change: Callable[..., Any], *arguments: Any, **options: Any) -> None:
        """Do an edit on the revision that is shown, and select what it adds."""
        try:
            made = change(*arguments, expected_revision=self.document.revision, **options)
        except VfixError:
            self._show(self._editor.document)
            raise
        added, document = made if isinstance(made, tuple) else (None, made)
        self._show(document)
        self._seen = self._seen[0], document.revision
        self.selected = added or self.selected

    def do(self, command: Command, cross: Position | None) -> str:
        """Answer a command of the open registration; returns words for the user, often none.

        cross: where the slices cross. Raises VfixError where it cannot be done.
        """
        editor = self._editor
        match command:
            case c.EditRegistration():
                return self._plain(command.type)
            case c.UndoRegistration():
                check_still_newest(command.revision, self.document.revision)
                return self._plain(command.type)
            case c.LockRegistration():
                self._edit(editor.set_locked, command.locked)
            case c.JudgeBead():
                self._edit(editor.judge_bead, command.bead_id, confirmed=command.confirmed)
            case c.AddPair():
                place = command.in_image or cross
                if place is None:
                    raise InputError("this head has no slices to take a place from.")
                self._edit(editor.added_pair, place)
            case c.ChangePair():
                self._edit(editor.change_pair, command.pair_id, command.fields())
            case c.PairCommand(type="pair.delete"):
                self._edit(editor.delete_pair, command.pair_id)
            case c.Touch():
                self._edit(editor.touch, self._touched(command.pair_id), command.noise_mm)
            case c.MatchOrder() | c.TakeOrder():
                self._order(command)
            case c.StateFle():
                self._edit(editor.set_fle, command.fle_mm)
            case _:
                raise InputError(f"the command {type(command).__name__} cannot be used here.")
        return ""

    def _plain(self, name: str) -> str:
        editor = self._editor
        if name == "registration.undo" and not self.document.can_undo and not self.document.locked:
            return "There is nothing to undo."
        if name == "registration.redo" and not self.document.can_redo and not self.document.locked:
            return "There is nothing to redo."
        acts: dict[str, Callable[..., StoredRegistration]] = {
            "registration.undo": editor.undo,
            "registration.redo": editor.redo,
            "bead.confirm_all": editor.confirm_all,
            "pair.clear_measured": editor.clear_measured,
            "registration.fit_pairs": editor.fit_pairs,
        }
        self._edit(acts[name])
        return self.document.told

    def _touched(self, pair_id: str | None) -> list[str]:
        """The pairs to touch: that one; else those that were not measured, else those that were simulated."""
        pairs = self.document.content.pairs
        if pair_id is not None:
            return [found_pair(self.document.content, pair_id).id]
        left = [pair.id for pair in pairs if pair.in_image is not None and pair.measured is None]
        if left or not pairs:
            return left
        again = [pair.id for pair in pairs if pair.in_image is not None and pair.measured_from == "simulated"]
        if not again:
            raise InputError("every point was really measured; no simulated touch replaces that.")
        return again

    def _order(self, command: c.MatchOrder | c.TakeOrder) -> None:
        orders = self.orders()
        if isinstance(command, c.TakeOrder):
            if orders is None or command.candidate >= len(orders.candidates):
                raise InputError("the points have changed since the order was looked for; look again.")
            self._edit(self._editor.reorder, orders.candidates[command.candidate].measured_of)
            self._orders = None
        elif command.type == "order.forget":
            self._orders = None
        else:
            answer = self._services.registering.order(self.document.content)
            self._orders = (self.document.revision, answer)

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


def newest(services: Services, case_id: str, wanted: str | None) -> OpenRegistration | None:
    """The wanted registration of a case, else the newest that can be read; None where there is none."""
    ids = [title.id for title in services.registrations.titles(case_id)]
    ids.sort(key=lambda known: known == wanted)  # stable: the wanted one is the last
    for known in reversed(ids):
        try:
            return OpenRegistration(services, known)
        except (NotFound, InputError):
            continue  # the list says which cannot be read
    return None
