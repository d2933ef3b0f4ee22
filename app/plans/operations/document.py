"""Operations on plans as documents, and on what stands in them as a whole: notes and settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

from msgspec import Meta

from app.operations.fields import Identifier, Name, Text
from app.operations.operation import Change, Creation
from app.operations.standard import Delete, Redo, Rename, Restore, SetDeleted, SetLocked, Undo
from app.plans.model import PlanContent
from app.plans.operations.base import PlanEdit, Plans, StoredPlan
from vfix_engine.errors import InputError, PlanError

Setting = Annotated[float, Meta(ge=-1e6, le=1e6)]  # what may be, the controller says
SettingName = Annotated[str, Meta(max_length=64)]
Settings = Annotated[dict[SettingName, Setting], Meta(max_length=64)]


class CreatePlan(Creation, frozen=True):
    """Make a plan, empty or a copy of another one of the case (`copy_of`), to which If-Match refers then."""

    rest = "POST /cases/{case_id}/plans"
    message = "plan.new"
    aliases: ClassVar[Mapping[str, str]] = {"copy_of": ""}
    name: Name
    copy_of: Identifier | None = None

    def create(self, context: Plans, case_id: str) -> StoredPlan:
        context.service.refuse_lumen(case_id)
        if self.copy_of is not None:
            if context.documents.title(self.copy_of).case_id != case_id:
                raise PlanError("the plan to copy belongs to another case.")
            return context.documents.duplicate(self.copy_of, self.name, expected_revision=context.expected)
        if context.expected is not None:
            raise InputError("a new plan has no revision that If-Match could ask for; leave it out.")
        return context.documents.create(case_id, self.name)


class DuplicatePlan(Change, frozen=True):
    """Make a copy of it."""

    message = "plan.duplicate"

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        return context.documents.duplicate(document_id, expected_revision=context.expected)


class RenamePlan(Rename, frozen=True):
    """Give a plan another name."""

    verb = "plan rename"
    name: Annotated[Name, Meta(description="the new name")]


class LockPlan(SetLocked, frozen=True):
    __doc__ = SetLocked.__doc__
    message = "lock"
    of_open = True


class DeletePlan(Delete, frozen=True):
    """Take a plan off the lists. It can be restored."""

    verb = "plan delete"


class RestorePlan(Restore, frozen=True):
    """Bring a deleted plan back."""

    verb = "plan restore"


class UndoPlan(Undo, frozen=True):
    """Take the newest edit back; `told` of the answer says which."""

    title = "Undo"
    message = "undo"
    of_open = True


class RedoPlan(Redo, frozen=True):
    """Do again what was taken back; `told` of the answer says what."""

    title = "Redo"
    message = "redo"
    of_open = True


class SetNotes(PlanEdit, frozen=True):
    """Replace the notes of a plan: what the planner writes down, in lines."""

    rest = "PUT /plans/{id}/notes"
    message = "plan.notes"
    notes: Text

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return replace(content, notes=self.notes)


class SetPlanSettings(Change, frozen=True):
    """Set some of the controller's settings; the others stay. No step of the history: undo leaves them."""

    rest = "PATCH /plans/{id}"
    message = "plan.settings"
    of_open = True
    title = "Set margin"
    settings: Settings

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        editor = context.documents.editor(document_id)
        return editor.set_settings(self.settings, expected_revision=context.expected)


OPERATIONS = (
    CreatePlan, DuplicatePlan, RenamePlan, LockPlan, SetDeleted, SetPlanSettings, DeletePlan, RestorePlan, UndoPlan,
    RedoPlan, SetNotes,
)  # fmt: skip
