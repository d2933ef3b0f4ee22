"""From where the targets of the open plan can be inspected: computed after the dry run, greyed until then."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from typing import Any

from app.kit.kept import Kept, Same
from app.kit.values import Position
from app.messages.sections import Section
from app.planning.rehearsal_options import RehearsalOptions
from app.plans.model import Plan
from app.scene.cones import LENGTH_MM, ConeNodes, Surface
from app.services import Services
from app.tabs.plan.cone_section import ConeSection, ConeView
from app.tabs.plan.dry_runs import ShownEvaluation
from app.tabs.plan.edited_plan import EditedPlan
from app.tabs.plan.side_words import direction_words
from app.workspace.latest import Act, BackgroundTask, Latest
from app.workspace.layers import Layer
from vfix_engine.errors import VfixError
from vfix_engine.worlds.rigid.cone_surface import cone_surface, mean_direction
from vfix_engine.worlds.rigid.inspection_cone import InspectionCone

Found = Mapping[str, tuple[Position, InspectionCone]]  # by the id of a target: where it was, and its cone


class Cones:
    """Asks for the cones of one client's plan, the newest wins. Owned by the session's thread."""

    def __init__(
        self, services: Services, executor: Executor, post: Callable[[Act], Any], say: Callable[[str], object] = bool
    ) -> None:
        """post: queues an act onto the owner's thread. say: words for the user, where cones could not be computed."""
        self._say = say
        self._services, self._latest = services, Latest(executor, post)
        self._asked: Any = None
        self._plan_id = ""
        self._found: Found = {}
        self._entries: Kept[list[ConeView]] = Kept()
        self._current = False

    def refresh(self, edited: EditedPlan | None, stored: ShownEvaluation) -> None:
        """Ask for the cones of the stored plan once its dry run is there, where they are others than before."""
        plan = None if edited is None else edited.plan
        if plan is None or plan.id != self._plan_id or not plan.content.targets:
            self._latest.drop()
            self._plan_id, self._found, self._current = "" if plan is None else plan.id, {}, False
            self._asked = None
        if plan is None or not plan.content.targets:
            return
        if stored.evaluation is None and stored.status != "computing":  # no path, or one that cannot be driven
            self._found = {}
        targets = tuple((target.id, target.position) for target in plan.content.targets)
        asked = None if stored.evaluation is None else (stored.evaluation, targets)
        if asked == self._asked:
            return
        self._latest.drop()
        self._asked, self._current = asked, False
        if asked is not None:
            self._submit(plan, self._services.rehearsal_options.of(plan.id).in_force)

    def _submit(self, plan: Plan, options: RehearsalOptions) -> None:
        def find(run: BackgroundTask) -> Found:
            try:
                cones = self._services.planning.cones(plan, options)
            except VfixError:
                cones = {}  # the dry run's own words say why
            return {t.id: (t.position, cones[t.id]) for t in plan.content.targets if t.id in cones}

        def failed(words: str) -> None:
            self._say(words)
            self._show({})

        self._latest.ask("The views of the targets could not be computed", find, self._show, failed)

    def _show(self, found: Found) -> None:
        self._found, self._current = found, True

    def section(self, edited: EditedPlan | None) -> Section[ConeSection]:
        """The page's section."""
        found: Found = {} if edited is None else self._found
        old = edited is not None and self._is_old(edited)
        return Section((Same(found) if found else None, old), lambda: self._view(found, old))

    def _view(self, found: Found, old: bool) -> ConeSection:
        if not found:
            return {"state": "none", "items": []}
        return {
            "state": "waits" if old else "current",
            "items": self._entries.get(Same(found), lambda: _entries(found)),
        }

    def layer(self, edited: EditedPlan | None) -> Layer[Any]:
        """The cone of the selected target."""
        known = None if edited is None or edited.selected is None else self._found.get(edited.selected)
        old = edited is not None and self._is_old(edited)

        def surface() -> Surface | None:
            return None if known is None else cone_surface(known[1], known[0], LENGTH_MM)

        key = None if known is None else (known[0], Same(known[1]), old)
        return Layer("plan.cone", key, ConeNodes, lambda nodes: nodes.show(surface(), old))

    def _is_old(self, edited: EditedPlan) -> bool:
        """Of another path or other targets than those that are shown."""
        return not self._current or edited.dragging or edited.in_hand is not None


def _entries(found: Found) -> list[ConeView]:
    return [
        {"target": target, "cone_deg": round(cone.cone_deg, 1), "words": cone_words(cone)}
        for target, (_, cone) in found.items()
    ]


def cone_words(cone: InspectionCone) -> str:
    """From where a target can be seen, in words."""
    if not len(cone.directions):
        return "Cannot be seen: with its tip here, the tool is clear of bone in no direction."
    x, y, z = mean_direction(cone).tolist()
    middle = direction_words((x, y, z))
    return f"Can be seen within a cone of {cone.cone_deg:.0f}°. In its middle: {middle[0].lower()}{middle[1:]}"
