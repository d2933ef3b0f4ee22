"""How much bone the open plan removes, counted in the background."""

from __future__ import annotations

from app.planning.removed_volumes import RemovedVolumes
from app.plans.service import Plan
from app.tabs.plan.latest import LatestQueue
from app.tabs.plan.region_sections import RemovedBoneSection
from app.workspace.workspace import Workspace

_FAILED = "The bone that is removed could not be counted"


class RemovedBoneCount:
    """The volumes of the newest regions that were asked for. Owned by the session's thread."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace, self._lanes = workspace, LatestQueue(workspace.executor)
        self._asked: object = None
        self._found: RemovedVolumes | str | None = None  # words: why there are none

    def section(self, plan: Plan | None) -> RemovedBoneSection | None:
        """The page's section; None without a plan, and while its bone is counted."""
        if plan is None:
            return None
        asked = (plan.case_id, plan.removed_bone)
        if asked != self._asked:
            self._asked, self._found = asked, None
            self._lanes.submit(
                "count",
                _FAILED,
                lambda: self._tell(asked, self._workspace.services.removed_volumes.of_plan(plan)),
                lambda words: self._tell(asked, words if words.startswith(_FAILED) else f"{_FAILED}: {words}"),
            )
        if self._found is None:
            return None
        if isinstance(self._found, str):
            return {"items": [], "words": self._found}
        items = self._found.regions
        return {"items": [{"id": one.id, "words": one.words} for one in items], "words": self._found.words}

    def _tell(self, asked: object, found: RemovedVolumes | str) -> None:
        """On the worker's thread."""
        self._workspace.post(lambda: self._accept(asked, found))

    def _accept(self, asked: object, found: RemovedVolumes | str) -> None:
        if asked == self._asked:
            self._found = found
