"""How much bone the open plan removes, counted in the background."""

from __future__ import annotations

from app.messages.sections import Section
from app.planning.removed_volumes import RemovedVolumes
from app.plans.service import Plan
from app.tabs.plan.region_sections import RemovedBoneSection
from app.workspace.latest import Latest
from app.workspace.workspace import Workspace

_FAILED = "The bone that is removed could not be counted"


class RemovedBoneCount:
    """The volumes of the newest regions that were asked for. Owned by the session's thread."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace, self._latest = workspace, Latest(workspace.executor, workspace.post)
        self._asked: object = None
        self._found: RemovedVolumes | str | None = None  # words: why there are none

    def refresh(self, plan: Plan | None) -> None:
        """Count the bone of a plan, where it is other bone than before."""
        asked = None if plan is None else (plan.case_id, plan.content.removed_bone)
        if asked == self._asked:
            return
        self._asked, self._found = asked, None
        if plan is None:
            self._latest.drop()
            return
        self._latest.ask(
            _FAILED,
            lambda run: self._workspace.services.removed_volumes.of_plan(plan),
            self._show,
            lambda words: self._show(words if words.startswith(_FAILED) else f"{_FAILED}: {words}"),
        )

    def section(self) -> Section[RemovedBoneSection | None]:
        """The page's section; None without a plan, and while its bone is counted."""
        found = self._found
        return Section(found, lambda: _view(found))

    def _show(self, found: RemovedVolumes | str) -> None:
        self._found = found


def _view(found: RemovedVolumes | str | None) -> RemovedBoneSection | None:
    if found is None:
        return None
    if isinstance(found, str):
        return {"items": [], "words": found}
    return {"items": [{"id": one.id, "words": one.words} for one in found.regions], "words": found.words}
