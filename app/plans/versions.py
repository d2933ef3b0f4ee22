"""Named versions of a plan: kept as it was, compared in words, and gone back to by an edit that can be undone."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from app.documents import Document, DocumentErrors, DocumentKind, Ref
from app.documents.documents import Documents
from app.kit.errors import NotFound, PlanConflict, PlanLocked
from app.plans.diff import changes
from app.plans.document import PLAN
from app.plans.model import PlanContent
from app.store import Store
from vfix_engine.errors import PlanError

MAX_VERSIONS = 100  # of one plan, without those that came from outside
MAX_PROPOSED = 20  # of one plan that came from outside and that nobody has renamed
_TOLD = 10  # the newest of them, where one is not found


@dataclass(frozen=True)
class VersionContent:
    """What a version keeps: whose it is, that plan's revision then, and its content.

    proposed_as: the name that one from outside came with; '' of one that somebody saved.
    """

    plan_id: str = ""
    revision: int = 0
    content: PlanContent = field(default_factory=PlanContent)
    proposed_as: str = ""


@dataclass(frozen=True)
class PlanVersion:
    """A named version of a plan. revision: the plan's when it was saved; created: when that was.

    proposed: it came from outside, and nobody has given it a name of their own.
    """

    id: str
    name: str
    plan_id: str
    revision: int
    created: str
    content: PlanContent
    proposed: bool = False


def _version(document: Document[VersionContent]) -> PlanVersion:
    kept, name = document.content, document.name
    return PlanVersion(
        document.id, name, kept.plan_id, kept.revision, document.created, kept.content, kept.proposed_as == name
    )


def _write(kept: VersionContent) -> dict[str, Any]:
    written = {
        "plan_id": kept.plan_id,
        "revision": kept.revision,
        "plan_schema": PLAN.schema,
        "plan": PLAN.write(kept.content),
    }
    return written | ({"proposed_as": kept.proposed_as} if kept.proposed_as else {})


def _read(data: Mapping[str, Any]) -> VersionContent:
    plan, plan_id, revision = data.get("plan"), data.get("plan_id"), data.get("revision")
    if not isinstance(plan, dict) or not isinstance(plan_id, str) or not isinstance(revision, int):
        raise PlanError("a version needs its plan, its revision and its content.")
    proposed_as = data.get("proposed_as", "")
    if not isinstance(proposed_as, str):
        raise PlanError("the name that a version was proposed under is a text.")
    content = PLAN.content(str(data.get("plan_schema")), plan, plan.get("settings", {}))
    return VersionContent(plan_id, revision, content, proposed_as)


def _refs(kept: VersionContent) -> tuple[Ref, ...]:
    return (Ref("document", kept.plan_id), *PLAN.refs(kept.content))


VERSION = DocumentKind(
    name="plan-version",
    noun="version",
    schema="vfix-plan-version/1",
    empty=VersionContent,
    read=_read,
    write=_write,
    check=lambda kept: kept,
    refs=_refs,
    errors=DocumentErrors(refused=PlanError, conflict=PlanConflict, locked=PlanLocked),
)


class PlanVersions:
    """Versions of every plan; may be used from any thread."""

    def __init__(self, store: Store, plans: Documents[PlanContent]) -> None:
        self._plans = plans
        self._lock = threading.Lock()  # between what is looked at and what is done
        self.documents = Documents(store, VERSION)

    def list(self, plan_id: str) -> tuple[PlanVersion, ...]:
        """Versions of a plan, oldest first; one that cannot be read is left out."""
        return tuple(_version(one) for one in self._documents_of(plan_id))

    def _documents_of(self, plan_id: str, include_deleted: bool = False) -> Iterable[Document[VersionContent]]:
        found = self.documents.list(self._plans.title(plan_id).case_id, include_deleted)
        return [one for one in found if not one.unreadable and one.content.plan_id == plan_id]

    def get(self, plan_id: str, name: str) -> PlanVersion:
        """The version of that id, else the newest of that name. Raises NotFound."""
        versions = self.list(plan_id)
        found = [one for one in versions if one.id == name] or [one for one in versions if one.name == name]
        if not found:
            known = ", ".join(repr(one.name) for one in versions[-_TOLD:]) or "none"
            if len(versions) > _TOLD:
                known += f", and {len(versions) - _TOLD} earlier ones"
            raise NotFound(f"there is no version {name!r:.80} of this plan; there are: {known}.")
        return found[-1]

    def last_deleted(self, plan_id: str, name: str) -> PlanVersion:
        """The version of that id or name that was deleted last. Raises NotFound."""
        deleted = [one for one in self._documents_of(plan_id, include_deleted=True) if one.deleted_at is not None]
        found = [one for one in deleted if name in (one.id, one.name)]
        if not found:
            raise NotFound(f"there is no deleted version {name!r:.80} of this plan.")
        return _version(max(found, key=lambda one: one.deleted_at or ""))

    def plan(self, plan_id: str, expected: int | None = None) -> Document[PlanContent]:
        """The plan. Raises PlanConflict where it has another revision than the expected one."""
        plan = self._plans.get(plan_id)
        if expected is not None and plan.revision != expected:
            raise PlanConflict(f"the plan is at revision {plan.revision}, not {expected}; read it again.")
        return plan

    def save(self, plan_id: str, name: str, *, expected_revision: int | None = None) -> PlanVersion:
        """Keep the plan as it is now under a name.

        Raises PlanConflict where the plan has another revision, and PlanError for a name that another version has.
        """
        plan = self.plan(plan_id, expected_revision)
        with self._lock:
            self._check_room(plan_id, name)
            return _version(
                self.documents.create(plan.case_id, name, VersionContent(plan_id, plan.revision, plan.content))
            )

    def propose(self, plan_id: str, name: str, content: PlanContent) -> PlanVersion:
        """Keep another content under a name, for somebody to compare with the plan and to go over to.

        It takes no place of those that are saved. Beyond MAX_PROPOSED the oldest that nobody has renamed is removed for
        good, so that whoever sends without end fills neither the list nor the disk.
        Raises PlanError for a name that another version has.
        """
        plan = self._plans.get(plan_id)
        with self._lock:
            versions = self.list(plan_id)
            self._check_name(name, versions)
            proposed = [one for one in versions if one.proposed]
            made = self.documents.create(plan.case_id, name, VersionContent(plan_id, plan.revision, content, name))
            for oldest in proposed[: max(0, len(proposed) + 1 - MAX_PROPOSED)]:
                self.documents.discard(oldest.id)
        return _version(made)

    def rename(self, plan_id: str, version: str, name: str) -> PlanVersion:
        """Give a version another name; one from outside is then like one that was saved.

        Raises PlanError for a name that another version has, and where there is no place for one from outside.
        """
        with self._lock:
            found = self.get(plan_id, version)
            others = [one for one in self.list(plan_id) if one.id != found.id]
            self._check_name(name, others)
            if found.proposed and name != found.name:
                self._check_number(others)
            self.documents.rename(found.id, name)
        return self.get(plan_id, found.id)

    def delete(self, plan_id: str, version: str) -> PlanVersion:
        """Take a version off the list; `restore` brings it back."""
        found = self.get(plan_id, version)
        self.documents.delete(found.id)
        return found

    def restore(self, plan_id: str, version_id: str) -> PlanVersion:
        """Bring a deleted version back. Raises NotFound, and PlanError where its name or its place is taken."""
        kept = self.documents.get(version_id)
        if kept.content.plan_id != plan_id:
            raise NotFound(f"there is no version {version_id!r:.80} of this plan.")
        with self._lock:
            if version_id not in [one.id for one in self.list(plan_id)]:
                self._check_room(plan_id, kept.name)
                self.documents.restore(version_id)
        return self.get(plan_id, version_id)

    def _check_room(self, plan_id: str, name: str) -> None:
        versions = self.list(plan_id)
        self._check_name(name, versions)
        self._check_number(versions)

    @staticmethod
    def _check_number(others: Iterable[PlanVersion]) -> None:
        if sum(not one.proposed for one in others) >= MAX_VERSIONS:
            raise PlanError(f"the plan has {MAX_VERSIONS} versions; delete one of them first.")

    def _check_name(self, name: str, others: Iterable[PlanVersion]) -> None:
        """Versions are asked for by id or name: neither is another one's."""
        if name in [one.name for one in others]:
            raise PlanError(f"the plan has a version {name!r:.80} already; take another name.")
        if self.documents.has(name):
            raise PlanError(f"{name!r:.80} is the identifier of a version; take another name.")

    def differences(self, plan_id: str, version: str, other: str | None = None) -> tuple[str, ...]:
        """What changed from a version to another one, or to the plan as it is now, in sentences."""
        after = self._plans.get(plan_id).content if other is None else self.get(plan_id, other).content
        return changes(self.get(plan_id, version).content, after)
