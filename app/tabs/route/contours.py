"""Contours of the open route that a client edits by hand: chosen in the list, the plot or on the wall, and dragged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from app.kit.kept import Same
from app.lumen.contour_operations import AddContour, MoveContour
from app.lumen.document import StoredRoute
from app.lumen.paths import RoutePath, RoutePaths, rim_of
from app.messages.sections import Section
from app.scene.dragging import DragEvent
from app.scene.lumen import CONTOUR, ContourNodes
from app.tabs.route.sections import ContourList, ContourView
from app.workspace.layers import Layer
from app.workspace.plan_items import position_of
from vfix_engine.arrays import Array
from vfix_engine.errors import VfixError
from vfix_engine.pathway.hand_contours import EditedPathway

SAME_MM = 1.0  # between centres of one contour in two pathways
SEEN_MM = 1.0  # behind the wall: less is within what the wall is known to


class ContourHand:
    """The contours as one client sees them. Owned by the session's thread."""

    def __init__(self, paths: RoutePaths, perform: Callable[[Any], None]) -> None:
        self._paths, self._perform = paths, perform
        self._document: StoredRoute | None = None
        self._path: RoutePath | None = None
        self._edited: EditedPathway | None = None
        self._key: object = None
        self._chosen_mm: float | None = None
        self._dragged: Array | None = None
        self._held: tuple[Array, int, Array] | None = None  # knots, number and centre of what is chosen

    def read(self, document: StoredRoute | None, path: RoutePath | None) -> None:
        """Take the open route and its pathway, where that is computed."""
        self._path = path
        key = Same(document), Same(path)
        if key == self._key and self._edited is not None:
            return
        if document is None or self._document is None or self._document.id != document.id:
            self.choose(None)
        self._document, self._key = document, key
        try:
            self._edited = (
                path.edited if path is not None else None if document is None else self._paths.edited(document)
            )
        except VfixError:
            self._edited = None  # the pathway's state says why
        self._follow()

    def _follow(self) -> None:
        """Keep the chosen contour chosen where the pathway is another one; none is where that one is gone."""
        edited = self._edited
        if edited is not None and self._held is not None:
            knots, number, centre = self._held
            away = np.linalg.norm(edited.pathway.centre - centre, axis=1)
            near = int(away.argmin())
            if np.array_equal(knots, edited.fit_knots):  # the same contours: a move shifts what comes after it
                near, away[number] = number, 0.0
            self._chosen_mm = float(edited.at_mm[near]) if away[near] < SAME_MM else None
        self._hold()

    def _hold(self) -> None:
        number, edited = self.chosen, self._edited
        if number is not None and edited is not None:
            self._held = edited.fit_knots, number, edited.pathway.centre[number].copy()
        elif self._chosen_mm is None:
            self._held = None

    # -- what is chosen

    @property
    def chosen(self) -> int | None:
        """Number of the chosen control contour."""
        if self._edited is None or self._chosen_mm is None:
            return None
        return int(np.abs(self._edited.at_mm - self._chosen_mm).argmin())

    def choose(self, at_mm: float | None) -> None:
        """Choose the contour nearest to a place along the way; None: none of them."""
        self._chosen_mm, self._dragged, self._held = at_mm, None, None
        self._hold()

    def choose_near(self, place: Array) -> bool:
        """While one is chosen, choose the one whose centre is nearest to a place; False where none is."""
        if self._edited is None or self._chosen_mm is None:
            return False
        away = np.linalg.norm(self._edited.pathway.centre - place, axis=1)
        self.choose(float(self._edited.at_mm[away.argmin()]))
        return True

    def done(self, operation: object) -> None:
        """An operation was done: what was added is chosen."""
        if isinstance(operation, AddContour):
            self.choose(operation.at_mm)

    def dragged(self, drag: DragEvent) -> bool:
        """A drag of the chosen contour's ball; False where it is of something else."""
        if drag.item_id != CONTOUR or self.chosen is None or self._edited is None:
            return drag.item_id == CONTOUR
        at_mm = float(self._edited.at_mm[self.chosen])
        self._dragged = np.array(drag.position)
        if drag.phase == "end":
            self._dragged = None
            self._perform(MoveContour(at_mm=at_mm, to=drag.position))
        return True

    # -- what the page and the scene show

    def section(self) -> Section[object]:
        """The :class:`ContourList`."""
        return Section((self._key, self._edited is None, self._chosen_mm), self._built)

    def _built(self) -> ContourList:
        document, edited = self._document, self._edited
        by_hand = 0 if document is None else len(document.content.contours)
        if edited is None:
            return {"items": [], "chosen": None, "by_hand": by_hand, "left_out": 0, "words": ""}
        behind = None
        if self._path is not None and self._path.reach.behind_wall is not None:
            behind = self._path.behind_mm
        items = [_view(edited, number, behind) for number in range(len(edited.of_hand))]
        return {
            "items": items,
            "chosen": self.chosen,
            "by_hand": by_hand,
            "left_out": len(edited.left_out),
            "words": _words(items, len(edited.left_out)),
        }

    def layers(self) -> list[Layer[Any]]:
        """The chosen contour, with the ball that it is dragged by."""
        number, edited, document = self.chosen, self._edited, self._document
        if number is None or edited is None or document is None:
            return []
        contours = edited.pathway.contours()
        rim = rim_of(contours, int(np.abs(contours.s - edited.pathway.at_s[number]).argmin()))
        centre = edited.pathway.centre[number]
        if self._dragged is not None:
            rim, centre = rim + (self._dragged - centre), self._dragged
        ends = number in (0, len(edited.of_hand) - 1)
        place, locked = position_of(centre), document.locked or ends
        key = (self._key, number, place, locked)
        return [Layer("route.contour", key, ContourNodes, lambda nodes: nodes.show(rim, place, locked), document.id)]


def _view(edited: EditedPathway, number: int, behind: Array | None) -> ContourView:
    pathway = edited.pathway
    radii = pathway.radius[number]
    same = bool(np.ptp(radii) < 1e-9)
    return {
        "at_mm": round(float(edited.at_mm[number]), 2),
        "centre": [round(float(value), 2) for value in pathway.centre[number]],
        "radii_mm": [round(float(value), 2) for value in (radii[:1] if same else radii)],
        "by_hand": bool(edited.of_hand[number] >= 0),
        "cut_mm": round(float(edited.cut_mm[number]), 2),
        "behind_mm": None if behind is None else round(float(behind[number]), 1),
    }


def _words(items: list[ContourView], left_out: int) -> str:
    """What is to be known of the contours by hand; '' for nothing."""
    said = []
    deep = [item["behind_mm"] or 0.0 for item in items if item["by_hand"]]
    beyond = [depth for depth in deep if depth > SEEN_MM]
    if beyond:
        count = f"{len(beyond)} contours cross" if len(beyond) > 1 else "One contour crosses"
        said.append(f"{count} the wall, by up to {max(beyond):.1f} mm.")
    if any(item["by_hand"] and item["cut_mm"] for item in items):
        said.append("Some are reduced, so that neighbours do not cross.")
    if left_out:
        said.append(f"Off this way and left out: {left_out} by hand.")
    return " ".join(said)
