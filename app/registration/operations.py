"""What can be done to registrations. Files, searches, refinements and measurements have routes of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import msgspec
from msgspec import UNSET, Meta, UnsetType

from app.documents import Document
from app.kit.names import MAX_NAME
from app.operations.fields import STRIPPED, Identifier, Name, Position
from app.operations.operation import Change, Context, Creation
from app.operations.spec import DocumentSpec
from app.operations.standard import Delete, Redo, Rename, Restore, SetDeleted, SetLocked, Undo
from app.registration.document import RegistrationContent
from app.registration.editor import RegistrationEditor, StoredRegistration, found_pair
from app.registration.kind import REGISTRATION
from app.registration.public import RegistrationPublic
from app.registration.service import Registering
from app.registration.simulated_touch import DEFAULT_NOISE_MM
from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo

Registrations = Context[RegistrationContent, Registering]
Label = Annotated[str, Meta(max_length=MAX_NAME, extra={STRIPPED: True})]
Number = Annotated[float, Meta(ge=-1e6, le=1e6)]  # what may be, the editor says


@dataclass(frozen=True)
class EditedPair:
    """A pair that was added, and the registration after it."""

    pair: str
    registration: RegistrationPublic


class CreateRegistration(Creation, frozen=True):
    """Make a registration, empty or a copy of another one of the case (`copy_of`), to which If-Match refers then.

    `to`: of an empty one, else that of the copied. Without a `name` it gets the next number, or that of the copied.
    """

    rest = "POST /cases/{case_id}/registrations"
    message = "registration.new"
    name: Name | None = None
    to: RegisteredTo | None = None
    copy_of: Identifier | None = None

    def create(self, context: Registrations, case_id: str) -> StoredRegistration:
        stored = context.documents
        if self.copy_of is None:
            if context.expected is not None:
                raise InputError("a new registration has no revision that If-Match could ask for; leave it out.")
            name = self.name or self._next_name(context, case_id)
            return stored.create(case_id, name, RegistrationContent(to=self.to or "patient"))
        if self.to is not None:
            raise InputError("a copy is registered to what the copied one is; leave 'to' out.")
        if stored.title(self.copy_of).case_id != case_id:
            raise InputError("the registration to copy belongs to another case.")
        return stored.duplicate(self.copy_of, self.name, expected_revision=context.expected)

    @staticmethod
    def _next_name(context: Registrations, case_id: str) -> str:
        taken = {title.name for title in context.documents.titles(case_id, include_deleted=True)}
        return next(name for n in range(1, len(taken) + 2) if (name := f"Registration {n}") not in taken)


class DuplicateRegistration(Change, frozen=True):
    """Make a copy of it."""

    message = "registration.duplicate"

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        return context.documents.duplicate(document_id, expected_revision=context.expected)


class LockRegistration(SetLocked, frozen=True):
    __doc__ = SetLocked.__doc__
    of_open = True


class UndoRegistration(Undo, frozen=True):
    """Take the newest edit back; `told` of the answer says which."""

    of_open = True


class RedoRegistration(Redo, frozen=True):
    """Do again what was taken back; `told` of the answer says what."""

    of_open = True


class RegistrationEdit(Change, frozen=True):
    """An edit, after which the pairs are fitted anew."""

    of_open = True

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        return self.edit(context.service.editor(document_id), expected_revision=context.expected)

    def edit(self, editor: RegistrationEditor, *, expected_revision: int | None) -> StoredRegistration:
        """The registration after it. Raises VfixError where that cannot be."""
        raise NotImplementedError


class FleWish(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rms length of one fiducial's localisation error, mm; null estimates it from the fit."""

    mm: Number | None


class SetFle(RegistrationEdit, frozen=True):
    """State the localisation error of one fiducial."""

    rest = "PATCH /registrations/{id}"
    fle: FleWish

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.set_fle(self.fle.mm, **expected)


class StateFle(RegistrationEdit, frozen=True):
    """State the localisation error of one fiducial; null estimates it from the fit."""

    message = "registration.fle"
    fle_mm: Number | None

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.set_fle(self.fle_mm, **expected)


class FitPairs(RegistrationEdit, frozen=True):
    """Fit the pairs, instead of a given or refined transform."""

    rest = "PATCH /registrations/{id}"
    message = "registration.fit_pairs"
    made_from: Literal["pairs"] = "pairs"

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.fit_pairs(**expected)


class RegisterTo(Change, frozen=True):
    """Choose what it is to, while nothing was measured."""

    rest = "PATCH /registrations/{id}"
    to: RegisteredTo

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        return context.service.calibrating.register_to(document_id, self.to, expected_revision=context.expected)


class JudgeBead(RegistrationEdit, frozen=True):
    """Confirm a found bead, which makes a pair of it; reject it, which takes the pair away; null: neither."""

    rest = "PATCH /registrations/{id}/beads/{bead_id}"
    message = "bead.judge"
    bead_id: Identifier
    confirmed: bool | None

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.judge_bead(self.bead_id, confirmed=self.confirmed, **expected)


class ConfirmBeads(RegistrationEdit, frozen=True):
    """Confirm every found bead that is not rejected."""

    message = "bead.confirm_all"

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.confirm_all(**expected)


class AddPair(RegistrationEdit, frozen=True):
    """Add a pair: a place in the image (LPS mm), a measured point, or both."""

    rest = "POST /registrations/{id}/pairs"
    status = 201
    message = "pair.add"
    answers = EditedPair
    label: Label | None = None
    in_image: Position | None = None
    measured: Position | None = None

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.added_pair(self.in_image, self.measured, self.label, **expected)[1]

    @staticmethod
    def added(document: StoredRegistration) -> str:
        """The id of the pair, in the registration after it."""
        return document.content.pairs[-1].id

    def answer(self, context: Registrations, document: Document[Any]) -> EditedPair:
        return EditedPair(self.added(document), RegistrationPublic.of(document))


class ChangePair(RegistrationEdit, frozen=True):
    """Change fields of a pair in one edit; those that are left out stay, a place that is null is taken away."""

    rest = "PATCH /registrations/{id}/pairs/{pair_id}"
    message = "pair.change"
    pair_id: Identifier
    label: Label | None = None
    in_image: Position | UnsetType | None = UNSET
    measured: Position | UnsetType | None = UNSET
    enabled: bool | None = None
    weight: Number | None = None

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        said = {"label": self.label, "enabled": self.enabled, "weight": self.weight}
        changes: dict[str, Any] = {name: value for name, value in said.items() if value is not None}
        places = {"in_image": self.in_image, "measured": self.measured}
        changes |= {name: place for name, place in places.items() if place is not UNSET}
        return editor.change_pair(self.pair_id, changes, **expected)


class DeletePair(RegistrationEdit, frozen=True):
    """Delete a pair."""

    rest = "DELETE /registrations/{id}/pairs/{pair_id}"
    message = "pair.delete"
    pair_id: Identifier

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.delete_pair(self.pair_id, **expected)


class ClearMeasured(RegistrationEdit, frozen=True):
    """Forget every measured point; pairs that have nothing else go with it."""

    message = "pair.clear_measured"

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.clear_measured(**expected)


class TouchPair(RegistrationEdit, frozen=True):
    """Measure a pair with a simulated pointer, for practice: no patient is measured.

    `noise_mm`: rms length of its error; `seed`: of the error, null for a new one.
    """

    rest = "POST /registrations/{id}/pairs/{pair_id}/touch"
    message = "pair.touch"
    pair_id: Identifier | None = None  # of a message: each one that was not measured, else that was simulated
    noise_mm: Number = DEFAULT_NOISE_MM
    seed: Annotated[int, Meta(ge=0, le=2**63 - 1)] | None = None

    def edit(self, editor: RegistrationEditor, **expected: Any) -> StoredRegistration:
        return editor.touch(self._touched(editor.document.content), self.noise_mm, self.seed, **expected)

    def _touched(self, content: RegistrationContent) -> list[str]:
        if self.pair_id is not None:
            return [found_pair(content, self.pair_id).id]
        left = [pair.id for pair in content.pairs if pair.in_image is not None and pair.measured is None]
        if left or not content.pairs:
            return left
        again = [pair.id for pair in content.pairs if pair.in_image and pair.measured_from == "simulated"]
        if not again:
            raise InputError("every point was really measured; no simulated touch replaces that.")
        return again


SPEC = DocumentSpec(
    kind=REGISTRATION,
    path="registrations",
    id="registration_id",
    public=RegistrationPublic,
    public_of=lambda service, document: RegistrationPublic.of(document),
    operations=(
        CreateRegistration, DuplicateRegistration, Rename, LockRegistration, SetDeleted, SetFle, StateFle, FitPairs,
        RegisterTo, Delete, Restore, UndoRegistration, RedoRegistration, JudgeBead, ConfirmBeads, AddPair, ChangePair,
        DeletePair, ClearMeasured, TouchPair,
    ),
    service="registering",
)  # fmt: skip
