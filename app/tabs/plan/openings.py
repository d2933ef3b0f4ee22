"""The openings of the head at which an empty plan begins: found in the background, marked, and chosen by a click."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.imaging.derived_of_ct import has_head_ct
from app.imaging.openings import Opening
from app.kit.values import Position
from app.messages.sections import Section
from app.plans.paths import EntrySide
from app.scene.openings import OpeningMark, OpeningNodes
from app.scene.picking import Hit, hit_items
from app.scene.view import ClickRay
from app.tabs.plan.edited_plan import EditedPlan
from app.tabs.plan.openings_section import OpeningsSection, OpeningView
from app.workspace.latest import BackgroundTask, Latest
from app.workspace.layers import Layer
from app.workspace.workspace import Workspace
from vfix_engine.errors import PlanError

CLICK_MM = 6.0  # around an opening; less than half of what is between two nostrils
BEHIND_MM = 25.0  # a mark is seen through so much of nose and skin, and can be clicked there
NONE_FOUND = "No nostrils found: click the entry."
FAILED = "Nostrils not found: click the entry."
CANCELLED = "Nostrils not searched: click the entry."


@dataclass(frozen=True)
class _Found:
    items: tuple[Opening, ...] = ()
    words: str = ""


class EntryOpenings:
    """Asks for the openings of one client's head: once a case, and anew with another plan where that found no answer.

    Owned by the session's thread.
    """

    def __init__(self, workspace: Workspace) -> None:
        self._workspace, self._latest = workspace, Latest(workspace.executor, workspace.post)
        self._asked: str | None = None  # id of the case
        self._found: _Found | None = None
        self._plan_id: str | None = None
        self._leads = False  # the slices have still to be brought there
        self._cross: Position | None = None  # where they were when that plan was shown, once the head is read

    def refresh(self, edited: EditedPlan | None) -> None:
        """Look for the openings where a plan without an entry is shown; the slices go there, unless they were moved."""
        if edited is None or not _is_empty(edited) or not has_head_ct(edited.case):
            return
        other = edited.plan_id != self._plan_id
        has_failed = self._found is not None and self._found.words in (FAILED, CANCELLED)
        if edited.case.id != self._asked or (other and has_failed):
            self._ask(edited.case.id)
        if other:
            self._plan_id, self._leads, self._cross = edited.plan_id, True, None
        if self._leads:
            self._lead(self._workspace.case.cross)

    def _lead(self, cross: Position | None) -> None:
        """Bring the slices there once, unless somebody has moved them; cross: where they are."""
        self._cross = self._cross or cross
        if self._found is None or cross is None:
            return
        self._leads = False
        if self._found.items and cross == self._cross:
            middle = np.mean([one.position for one in self._found.items], axis=0)
            self._workspace.case.go_to((float(middle[0]), float(middle[1]), float(middle[2])))

    def _ask(self, case_id: str) -> None:
        self._asked, self._found = case_id, None
        services = self._workspace.services

        def find(run: BackgroundTask) -> _Found:
            ended = services.jobs.wait(services.openings.start(case_id).id)
            if ended.state != "done":
                return _Found(words=CANCELLED if ended.state == "cancelled" else FAILED)
            items = services.openings.make(case_id).items
            return _Found(items, "" if items else NONE_FOUND)

        self._latest.ask(FAILED, find, self._show, lambda words: self._show(_Found(words=FAILED)), lane=case_id)

    def _show(self, found: _Found) -> None:
        self._found = found

    def opening(self, edited: EditedPlan, opening_id: str) -> Opening:
        """Raises PlanError where it is not shown."""
        for one in self._shown(edited):
            if one.id == opening_id:
                return one
        raise PlanError("that opening is not shown any more.")

    def hit(self, edited: EditedPlan, ray: ClickRay, before: Hit | None) -> Opening | None:
        """The marked opening that a click means; before: what else it meets."""
        marked = {one.id: one for one in self._marked(edited)}
        places = [(one.id, np.array(one.position)) for one in marked.values()]
        hit = hit_items(ray.origin, ray.direction, places, CLICK_MM)
        if (
            hit is None
            or hit.item_id is None
            or (before is not None and before.distance_mm < hit.distance_mm - BEHIND_MM)
        ):
            return None
        return marked[hit.item_id]

    def side_at(self, edited: EditedPlan, place: Position) -> EntrySide:
        """The side of the opening that an entry is at, of the nearest one; '' for another place."""
        shown = [(math.dist(one.position, place), one.side) for one in self._shown(edited)]
        away, side = min(shown, default=(math.inf, ""))
        return side if away <= CLICK_MM else ""

    def _shown(self, edited: EditedPlan | None) -> tuple[Opening, ...]:
        known = self._found is not None and edited is not None and edited.case.id == self._asked
        return self._found.items if known and self._found is not None and _is_empty(edited) else ()

    def _marked(self, edited: EditedPlan | None) -> tuple[Opening, ...]:
        return self._shown(edited) if edited is not None and _takes_entry(edited) else ()

    def places(self, edited: EditedPlan | None) -> list[Position]:
        """Where a path would begin."""
        return [one.position for one in self._shown(edited)]

    def layer(self, edited: EditedPlan | None) -> Layer[Any]:
        """The marks, while a click on one is its choice."""
        marked = tuple(
            OpeningMark(one.id, one.name, one.side, one.position, one.inward, one.radius_mm)
            for one in self._marked(edited)
        )
        return Layer("plan.openings", marked, OpeningNodes, lambda nodes: nodes.show(marked))

    def section(self, edited: EditedPlan | None) -> Section[OpeningsSection]:
        """The page's section."""
        if edited is None or not _is_empty(edited) or edited.case.id != self._asked:
            return Section.of({"state": "none", "items": [], "marked": False, "words": ""})
        found, marked = self._found, _takes_entry(edited)
        return Section((found, marked), lambda: _view(found, marked))


def _is_empty(edited: EditedPlan | None) -> bool:
    """Whether an entry is what is missing. A locked plan gets none."""
    return edited is not None and not edited.plan.content.points and not edited.locked


def _takes_entry(edited: EditedPlan) -> bool:
    """Whether a click means the entry."""
    return edited.add_mode == "point" and edited.regions.drawing is None


def _view(found: _Found | None, marked: bool) -> OpeningsSection:
    if found is None:
        return {"state": "waiting", "items": [], "marked": False, "words": ""}
    items: list[OpeningView] = [
        {"id": one.id, "name": one.name, "side": one.side, "position": list(one.position), "radius_mm": one.radius_mm}
        for one in found.items
    ]
    return {"state": "current", "items": items, "marked": marked and bool(items), "words": found.words}
