"""The versions of a plan as a client uses them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypedDict

from app.kit.kept import Kept, Same
from app.messages.sections import Section
from app.plans.diff import changes
from app.plans.model import PlanContent
from app.plans.service import Plan
from app.plans.versions import PlanVersion
from app.services import Services


class VersionView(TypedDict):
    """A version in the list."""

    id: str
    name: str
    created: str


class VersionsSection(TypedDict):
    """Versions of the open plan, newest first.

    compared: the one whose changes since then are told, None for none. differs: whether going back to it would change
    the plan; it leaves the settings of the rehearsal as they are.
    """

    items: list[VersionView]
    compared: str | None
    changes: list[str]
    differs: bool
    locked: bool


class VersionSections(TypedDict):
    """What the Plan tab shows of versions."""

    versions: VersionsSection | None


class Versions:
    """What one client does with the versions of one plan. Owned by the session's thread."""

    def __init__(self, services: Services, plan: Callable[[], Plan]) -> None:
        """plan: as it is shown."""
        self._services, self._plan = services, plan
        self._known: Kept[tuple[PlanVersion, ...]] = Kept()
        self._compared: str | None = None

    def section(self) -> Section[VersionsSection]:
        """The page's section."""
        stored, plan = self._services.store.changes.of(self._services.versions.documents.kind.name), self._plan()
        told = (plan.id, plan.locked) if self._compared is None else Same(plan)
        return Section((told, self._compared, stored), lambda: self._view(stored))

    def _view(self, stored: object) -> VersionsSection:
        plan = self._plan()
        known = self._known.get(stored, lambda: self._services.versions.list(plan.id))
        compared = next((one for one in known if one.id == self._compared), None)
        return {
            "items": [{"id": one.id, "name": one.name, "created": one.created} for one in reversed(known)],
            "compared": None if compared is None else compared.id,
            "changes": [] if compared is None else list(changes(compared.content, plan.content)),
            "differs": compared is not None and self._differs(compared.content, plan),
            "locked": plan.locked,
        }

    @staticmethod
    def _differs(content: PlanContent, plan: Plan) -> bool:
        return bool(changes(replace(content, settings=plan.content.settings), plan.content))

    def compare(self, version_id: str) -> None:
        """Tell what changed since a version; again, it is hidden."""
        self._compared = None if version_id == self._compared else version_id
