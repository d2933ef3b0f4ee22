"""How much bone the open plan removes, counted in the background."""

from __future__ import annotations

from app.services.plans import Plan
from app.services.removed_bone import RemovedVolumes
from app.steps.plan.lanes import Lanes
from app.steps.plan.region_sections import RemovedBoneSection
from app.views.views import Views


class RemovedBoneCount:
    """The volumes of the newest regions that were asked for. Owned by the session's thread."""

    def __init__(self, views: Views) -> None:
        self._views, self._lanes = views, Lanes(views.executor)
        self._asked: object = None
        self._found: RemovedVolumes | None = None

    def section(self, plan: Plan | None) -> RemovedBoneSection | None:
        """The page's section; None without a plan, and while its bone is counted."""
        if plan is None:
            return None
        asked = (plan.case_id, plan.removed_bone)
        if asked != self._asked:
            self._asked, self._found = asked, None
            self._lanes.submit("count", lambda: self._count(asked, plan))
        if self._found is None:
            return None
        items = self._found.regions
        return {"items": [{"id": one.id, "words": one.words} for one in items], "words": self._found.words}

    def _count(self, asked: object, plan: Plan) -> None:
        found = self._views.services.removed_volumes.of_plan(plan)
        self._views.post(lambda: self._accept(asked, found))

    def _accept(self, asked: object, found: RemovedVolumes) -> None:
        if asked == self._asked:
            self._found = found
