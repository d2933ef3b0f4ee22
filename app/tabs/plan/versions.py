"""The versions of a plan as a client uses them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypedDict

from app.kit.kept import Kept, Same
from app.messages.fields import Command
from app.messages.sections import Section
from app.plans.diff import changes
from app.plans.model import PlanContent
from app.plans.service import Plan
from app.plans.versions import PlanVersion
from app.services import Services
from app.tabs.plan import version_commands as c


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

    def __init__(
        self, services: Services, plan: Callable[[], Plan], edit: Callable[[Callable[..., Plan]], object]
    ) -> None:
        """plan: as it is shown; edit: does an edit on the revision that is shown."""
        self._services, self._plan, self._do = services, plan, edit
        self._known: Kept[tuple[PlanVersion, ...]] = Kept()
        self._compared: str | None = None

    def section(self) -> Section[VersionsSection]:
        """The page's section."""
        stored = self._services.store.changes.of(self._services.versions.documents.kind.name)
        return Section((Same(self._plan()), self._compared, stored), lambda: self._view(stored))

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
        return bool(changes(replace(content, settings=plan.settings), plan.content))

    def handle(self, command: Command) -> None:
        """Answer a command of a version. Raises InputError with the reason where that cannot be done."""
        service, plan_id = self._services.versions, self._plan().id
        match command:
            case c.SaveVersion():
                service.save(plan_id, command.name, expected_revision=self._plan().revision)
            case c.RenameVersion():
                service.rename(plan_id, command.version_id, command.name)
            case c.VersionCommand(type="version.compare", version_id=wanted):
                self._compared = None if wanted == self._compared else wanted
            case c.VersionCommand(type="version.delete"):
                service.delete(plan_id, command.version_id)
            case c.VersionCommand(type="version.restore"):
                service.restore(plan_id, command.version_id)
            case c.VersionCommand():
                version_id = command.version_id
                self._do(lambda **options: service.go_back(plan_id, version_id, **options))
