"""What can be done to registrations. Files, searches for beads and refinements have routes of their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

import msgspec
from msgspec import UNSET, Meta, UnsetType

from app.kit.names import MAX_NAME
from app.operations.fields import STRIPPED, Identifier, Name, Place
from app.operations.operation import Change, Creation, Option, Verb
from app.operations.spec import DocumentSpec
from app.operations.standard import Delete, Redo, Rename, Restore, SetDeleted, SetLocked, Undo
from app.registration.calibration import registered_to
from app.registration.calibration_operations import CALIBRATIONS
from app.registration.document import MAX_PAIRS, Fle, RegistrationContent, StoredRegistration, Weight
from app.registration.edits import (
    judged,
    reordered,
    with_changed_pair,
    with_every_bead,
    with_new_pair,
    with_touched,
    without_measured,
    without_pair,
)
from app.registration.kind import REGISTRATION
from app.registration.operation_base import Noise, RegistrationEdit, Registrations, Seed
from app.registration.public import RegistrationPublic
from app.registration.service import LONGEST_S, MEASURE_S, Measured
from app.registration.simulated_touch import DEFAULT_NOISE_MM
from app.registration.surface_operations import SURFACES
from app.registration.touched_surface import unrefined
from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo

Label = Annotated[str, Meta(max_length=MAX_NAME, extra={STRIPPED: True})]


@dataclass(frozen=True)
class EditedPair:
    """A pair that was added, and the registration after it."""

    pair: str
    registration: RegistrationPublic


@dataclass(frozen=True)
class MeasuredPair:
    """The registration after a point was measured; spread_mm: rms distance of the poses from their mean."""

    spread_mm: float
    registration: RegistrationPublic


class CreateRegistration(Creation, frozen=True):
    """Make a registration, empty or a copy of another one of the case (`copy_of`), to which If-Match refers then.

    `to`: of an empty one, else that of the copied. Without a `name` it gets the next number, or that of the copied.
    """

    rest = "POST /cases/{case_id}/registrations"
    message = "registration.new"
    verb = (
        Verb(
            "register new",
            "make an empty registration, to the patient or to the robot's base",
            options=(
                Option("--name", "name", "", "of the registration", "Registration"),
                Option("--to", "to", "", "what it is to", "patient"),
            ),
        ),
    )
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
    verb = (Verb("register undo", "take the newest edit of a registration back", of_case=True),)


class RedoRegistration(Redo, frozen=True):
    """Do again what was taken back; `told` of the answer says what."""

    of_open = True
    verb = (Verb("register redo", "do an edit again that was taken back", of_case=True),)


class FleRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rms length of one fiducial's localisation error, mm; null estimates it from the fit."""

    mm: Fle | None


class SetFle(RegistrationEdit, frozen=True):
    """State the localisation error of one fiducial; null estimates it from the fit."""

    rest = "PATCH /registrations/{id}"
    title = "Set localisation error"
    message = "registration.fle"
    aliases: ClassVar[Mapping[str, str]] = {"fle.mm": "fle_mm"}
    fle: FleRequest

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return replace(content, fle_mm=self.fle.mm)


class FitPairs(RegistrationEdit, frozen=True):
    """Fit the pairs, instead of a given or refined transform."""

    rest = "PATCH /registrations/{id}"
    title = "Fit the points"
    message = "registration.fit_pairs"
    made_from: Literal["pairs"] = "pairs"

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return replace(content, made_from="none", surface=unrefined(content.surface))


class RegisterTo(RegistrationEdit, frozen=True):
    """Choose what it is to, while nothing was measured."""

    rest = "PATCH /registrations/{id}"
    to: RegisteredTo

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return registered_to(content, self.to)


class JudgeBead(RegistrationEdit, frozen=True):
    """Confirm a found bead, which makes a pair of it; reject it, which takes the pair away; null: neither."""

    rest = "PATCH /registrations/{id}/beads/{bead_id}"
    message = "bead.judge"
    bead_id: Identifier
    confirmed: bool | None

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return judged(content, self.bead_id, self.confirmed)


class ConfirmBeads(RegistrationEdit, frozen=True):
    """Confirm every found bead that is not rejected."""

    message = "bead.confirm_all"

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return with_every_bead(content)


class AddPair(RegistrationEdit, frozen=True):
    """Add a pair: a place in the image (LPS mm), a measured point, or both."""

    rest = "POST /registrations/{id}/pairs"
    status = 201
    message = "pair.add"
    answers = EditedPair
    label: Label | None = None
    in_image: Place | None = None
    measured: Place | None = None

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return with_new_pair(content, self.in_image, self.measured, self.label)

    @staticmethod
    def added(document: StoredRegistration) -> str:
        """The id of the pair, in the registration after it."""
        return document.content.pairs[-1].id

    def answer(self, context: Registrations, document: StoredRegistration) -> EditedPair:
        return EditedPair(self.added(document), RegistrationPublic.of(document))


class ChangePair(RegistrationEdit, frozen=True):
    """Change fields of a pair in one edit; those that are left out stay, a place that is null is taken away."""

    rest = "PATCH /registrations/{id}/pairs/{pair_id}"
    message = "pair.change"
    pair_id: Identifier
    label: Label | None = None
    in_image: Place | UnsetType | None = UNSET
    measured: Place | UnsetType | None = UNSET
    enabled: bool | None = None
    weight: Weight | None = None

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        said = {"label": self.label, "enabled": self.enabled, "weight": self.weight}
        changes: dict[str, Any] = {name: value for name, value in said.items() if value is not None}
        places = {"in_image": self.in_image, "measured": self.measured}
        changes |= {name: place for name, place in places.items() if place is not UNSET}
        return with_changed_pair(content, self.pair_id, changes)


class DeletePair(RegistrationEdit, frozen=True):
    """Delete a pair."""

    rest = "DELETE /registrations/{id}/pairs/{pair_id}"
    message = "pair.delete"
    pair_id: Identifier

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return without_pair(content, self.pair_id)


class ClearMeasured(RegistrationEdit, frozen=True):
    """Forget every measured point; pairs that have nothing else go with it."""

    title = "Clear measured points"
    message = "pair.clear_measured"

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return without_measured(content)


class TouchPair(RegistrationEdit, frozen=True):
    """Measure a pair with a simulated pointer, for practice: no patient is measured.

    `noise_mm`: rms length of its error; `seed`: of the error, null for a new one.
    """

    rest = "POST /registrations/{id}/pairs/{pair_id}/touch"
    title = "Simulate touch"
    message = "pair.touch"
    pair_id: Identifier | None = None  # of a message: each one that was not measured, else that was simulated
    noise_mm: Noise = DEFAULT_NOISE_MM
    seed: Seed | None = None

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return with_touched(content, context.case_id, self._touched(content), self.noise_mm, self.seed)

    def _touched(self, content: RegistrationContent) -> list[str]:
        if self.pair_id is not None:
            return [self.pair_id]
        if not content.pairs:
            raise InputError("there is no point to touch yet: confirm beads, or add points at the crosshair.")
        left = [pair.id for pair in content.pairs if pair.in_image is not None and pair.measured is None]
        again = [pair.id for pair in content.pairs if pair.in_image and pair.measured_from == "simulated"]
        if not left and not again:
            raise InputError("every point was really measured; no simulated touch replaces that.")
        return left or again


class MeasurePair(Change, frozen=True):
    """Measure a pair with the tracked pointer, whose tip rests on the point for some `seconds`."""

    rest = "POST /registrations/{id}/pairs/{pair_id}/measure"
    answers = MeasuredPair
    pair_id: Identifier
    seconds: Annotated[float, Meta(ge=0.1, le=LONGEST_S)] = MEASURE_S

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        measure = context.service.measure
        return measure(document_id, self.pair_id, self.seconds, expected_revision=context.expected)

    def answer(self, context: Registrations, document: StoredRegistration) -> MeasuredPair:
        assert isinstance(document, Measured)
        return MeasuredPair(document.spread_mm, RegistrationPublic.of(document))


class Reorder(RegistrationEdit, frozen=True):
    """Take an order. `measured_of`: by a pair's id, the id of the pair whose measured point it gets."""

    rest = "POST /registrations/{id}/order"
    measured_of: Annotated[dict[str, str], Meta(min_length=1, max_length=MAX_PAIRS)]

    def changed(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        return reordered(content, self.measured_of)


SPEC = DocumentSpec(
    kind=REGISTRATION,
    path="registrations",
    id="registration_id",
    public=RegistrationPublic,
    public_of=lambda service, document: RegistrationPublic.of(document),
    operations=(
        CreateRegistration, DuplicateRegistration, Rename, LockRegistration, SetDeleted, SetFle, FitPairs,
        RegisterTo, Delete, Restore, UndoRegistration, RedoRegistration, JudgeBead, ConfirmBeads, AddPair, ChangePair,
        DeletePair, ClearMeasured, TouchPair, MeasurePair, Reorder, *SURFACES, *CALIBRATIONS,
    ),
    service="registering",
)  # fmt: skip
