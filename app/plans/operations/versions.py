"""Operations on a plan's named versions. But for going back to one they leave the plan as it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app.operations.fields import Identifier, Name
from app.operations.operation import Change
from app.plans.model import PlanContent
from app.plans.operations.base import PlanEdit, Plans, StoredPlan
from app.plans.versions import PlanVersion, PlanVersions


@dataclass(frozen=True)
class VersionPublic:
    """A named version of a plan; revision: the plan's when it was saved."""

    id: str
    name: str
    plan_id: str
    revision: int
    created: str

    @classmethod
    def of(cls, version: PlanVersion) -> VersionPublic:
        return cls(version.id, version.name, version.plan_id, version.revision, version.created)


class VersionChange(Change, frozen=True):
    """Changes a version, with which REST answers. A revision that is said is the plan's."""

    of_open = True
    answers = VersionPublic

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        context.service.versions.plan(document_id, context.expected)
        self.change(context, document_id)
        return context.documents.get(document_id)

    def change(self, context: Plans, plan_id: str) -> None:
        """Do it. Raises VfixError."""
        raise NotImplementedError

    def version(self, versions: PlanVersions, plan_id: str) -> PlanVersion:
        """The version that was changed. Raises NotFound."""
        raise NotImplementedError

    def answer(self, context: Plans, document: StoredPlan) -> VersionPublic:
        return VersionPublic.of(self.version(context.service.versions, document.id))


class SaveVersion(VersionChange, frozen=True):
    """Save the plan as it is now under a name; at most 100, in addition to those received over the live link."""

    rest = "POST /plans/{id}/versions"
    status = 201
    message = "version.save"
    name: Name

    def change(self, context: Plans, plan_id: str) -> None:
        context.service.versions.save(plan_id, self.name, expected_revision=context.expected)

    def version(self, versions: PlanVersions, plan_id: str) -> PlanVersion:
        return versions.get(plan_id, self.name)


class ListedVersionChange(VersionChange, frozen=True):
    """Changes a version that is on the list afterwards."""

    version_id: Identifier

    def version(self, versions: PlanVersions, plan_id: str) -> PlanVersion:
        return versions.get(plan_id, self.version_id)


class RenameVersion(ListedVersionChange, frozen=True):
    """Give a version another name."""

    rest = "PATCH /plans/{id}/versions/{version_id}"
    message = "version.rename"
    name: Name

    def change(self, context: Plans, plan_id: str) -> None:
        context.service.versions.rename(plan_id, self.version_id, self.name)


class DeleteVersion(VersionChange, frozen=True):
    """Take a version off the list; it can be restored."""

    rest = "DELETE /plans/{id}/versions/{version_id}"
    message = "version.delete"
    version_id: Identifier

    def change(self, context: Plans, plan_id: str) -> None:
        context.service.versions.delete(plan_id, self.version_id)

    def version(self, versions: PlanVersions, plan_id: str) -> PlanVersion:
        return versions.last_deleted(plan_id, self.version_id)


class RestoreVersion(ListedVersionChange, frozen=True):
    """Bring a deleted version back to the list."""

    rest = "POST /plans/{id}/versions/{version_id}/restore"
    message = "version.restore"

    def change(self, context: Plans, plan_id: str) -> None:
        context.service.versions.restore(plan_id, self.version_id)


class GoBack(PlanEdit, frozen=True):
    """Restore the plan from a version, as one edit that undo takes back; settings stay."""

    rest = "POST /plans/{id}/versions/{version_id}/go-back"
    title = "Go back to version"
    message = "version.go_back"
    version_id: Identifier

    def run(self, context: Plans, document_id: str) -> StoredPlan:
        content = context.service.versions.get(document_id, self.version_id).content
        return TakeOver(content=content).run(context, document_id)


class TakeOver(PlanEdit, frozen=True):
    """Take over another content, but for its settings, which are no step of the history."""

    content: PlanContent

    def apply(self, content: PlanContent, context: Plans) -> PlanContent:
        return replace(self.content, settings=content.settings)


OPERATIONS = (SaveVersion, RenameVersion, DeleteVersion, RestoreVersion, GoBack)
