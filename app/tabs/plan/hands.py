"""What a hand does in the scene with the open plan: clicks and drags."""

from __future__ import annotations

import numpy as np

from app.scene.dragging import DragEvent
from app.scene.picking import hit_items
from app.scene.shafts import HANDLE
from app.scene.view import ClickRay
from app.tabs.plan.edited_plan import EditedPlan
from app.tabs.plan.openings import EntryOpenings
from app.tabs.plan.shafts import Shafts
from app.workspace.workspace import Workspace
from vfix_engine.arrays import Array

SELECT_RADIUS_MM = 2.0


class Hands:
    """Answers clicks and drags of one client. Owned by the session's thread."""

    def __init__(self, workspace: Workspace, shafts: Shafts, openings: EntryOpenings) -> None:
        self._workspace, self._shafts, self._openings = workspace, shafts, openings

    def clicked(self, edited: EditedPlan, ray: ClickRay) -> None:
        """On the ghost it confirms, on an item it selects or leads there, at an opening it enters, else picks.

        While a region is drawn it always picks.
        """
        case = self._workspace.case
        if edited.ghost is not None:
            ghost = hit_items(ray.origin, ray.direction, [("ghost", np.array(edited.ghost.position))], SELECT_RADIUS_MM)
            if ghost is not None:
                place = edited.ghost.position
                edited.confirm()
                case.go_to(place)
                return
        if self._shafts.aiming is not None and (aim := case.hit(ray)) is not None:
            self._workspace.note(self._shafts.aimed(edited, aim.position))
            return
        items = list[tuple[str, Array]]()
        if edited.regions.drawing is None:
            first = sorted(edited.items(), key=lambda item: item.kind != edited.add_mode)  # of two at one place
            items += [(item.id, np.array(item.position)) for item in first] + edited.regions.handles()
            items += self._shafts.balls(edited)
        hits = [hit_items(ray.origin, ray.direction, items, SELECT_RADIUS_MM), case.hit(ray)]
        if (opening := self._openings.hit(edited, ray, hits[1])) is not None:
            self._workspace.note(edited.enter(opening))
            case.go_to(edited.place_of(edited.selected))
            return
        hit = min((hit for hit in hits if hit is not None), key=lambda hit: hit.distance_mm, default=None)
        if hit is not None:
            self._workspace.camera.turn_about(hit.position)
        if hit is None:
            self._workspace.note("Nothing there. Click air in a slice.")
        elif hit.item_id is not None:
            if edited.regions.select(hit.item_id) or hit.item_id.startswith(HANDLE):
                return
            case.go_to(edited.click_item(hit.item_id))
        else:
            case.go_to(edited.pick(hit.position))

    def dragged(self, edited: EditedPlan, drag: DragEvent) -> None:
        """An item, a region or a shaft follows the hand, and is stored where the hand lets go of it."""
        if edited.regions.dragged(drag) or self._shafts.dragged(edited, drag):
            return
        if drag.phase == "end":
            self._workspace.note(edited.drop(drag.item_id))
        else:
            edited.drag(drag.item_id, drag.position)
