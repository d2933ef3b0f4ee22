"""The shaft's directions of the open plan, and the suggested path that is shown beside it."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.kit.kept import Same
from app.kit.values import Position
from app.messages.fields import ClientMessage
from app.messages.sections import Section
from app.plans.model import PlanPoint
from app.scene.dragging import DragEvent
from app.scene.shafts import HANDLE, ShaftHandle, ShaftNodes, SuggestedNodes
from app.services import Services
from app.tabs.plan.edited_plan import EditedPlan
from app.tabs.plan.shaft_section import ShaftSection
from app.tabs.plan.side_words import direction_words
from app.tabs.plan.suggest_commands import AimShaft, HideSuggestion, SuggestionCommand
from app.workspace.layers import Layer
from app.workspace.plan_items import curve_points
from vfix_engine.arrays import Array
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath

AIM_WORDS = "Click where the shaft passes behind the tip. Esc cancels."
_NEAREST_MM = 1.0  # to the point: a click nearer than that has no direction


class Shafts:
    """What one client shows and aims. Owned by the session's thread."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self.aiming: str | None = None
        self._shown: tuple[str, int] | None = None
        self._points: tuple[PlanPoint, ...] = ()

    def clear(self) -> None:
        """Nothing is shown or half done."""
        self.aiming, self._shown, self._points = None, None, ()

    def handle(self, edited: EditedPlan, command: ClientMessage) -> str:
        """Answer a command; returns words for the user. Raises VfixError with the reason where it cannot be done."""
        match command:
            case SuggestionCommand(type="suggestion.use"):
                edited.use_points(self._alternative(edited, command))
                self.clear()
                return ""  # the page says so, with a button that takes it back
            case SuggestionCommand():
                self._points = self._alternative(edited, command)
                self._shown = command.suggestion_id, command.alternative
            case HideSuggestion(type="suggestion.hide"):
                self._shown, self._points = None, ()
            case HideSuggestion():
                self.aiming = None
            case AimShaft():
                _point(edited, command.item_id)
                edited.cancel()
                self.aiming = command.item_id
                return ""  # the hint line says what to do, as long as it is to be done
        return ""

    def aimed(self, edited: EditedPlan, position: Array) -> str:
        """The click after 'Aim shaft': the shaft of that point passes there. Returns words for the user."""
        point_id, self.aiming = self.aiming, None
        point = _point(edited, point_id or "")
        towards = np.asarray(position, dtype=np.float64) - np.array(point.position)
        length = float(np.linalg.norm(towards))
        if length < _NEAREST_MM:
            raise PlanError("that is the point itself; click where the shaft is to pass behind it.")
        edited.set_shaft(point.id, tuple((towards / length).tolist()), point.roll_deg)
        return f"The shaft at {point.label} passes where you clicked."

    def dragged(self, edited: EditedPlan, drag: DragEvent) -> bool:
        """The shaft of a point follows the hand, and is stored where the hand lets go of it; False of another drag.

        The direction goes through the hand's place, which moves in the plane of the view.
        """
        if not drag.item_id.startswith(HANDLE):
            return False
        point_id = drag.item_id.removeprefix(HANDLE)
        point = _point(edited, point_id)
        if edited.locked:
            return True
        towards = np.array(drag.position) - np.array(point.position)
        length = float(np.linalg.norm(towards))
        if length >= _NEAREST_MM:
            x, y, z = (towards / length).tolist()
            edited.selected, edited.shaft_in_hand = point_id, (point_id, (x, y, z))
        if drag.phase == "end" and edited.shaft_in_hand is not None:
            direction, edited.shaft_in_hand = edited.shaft_in_hand[1], None
            if point.direction is None or not np.allclose(direction, point.direction, atol=1e-9):
                edited.set_shaft(point_id, direction, point.roll_deg)
        return True

    def balls(self, edited: EditedPlan) -> list[tuple[str, Array]]:
        """Places that a click in the scene may mean: the ball of the selected point's shaft, by its id."""
        handle = self._handle(edited)
        return [] if handle is None else [(HANDLE + handle.point_id, np.array(handle.end))]

    def _handle(self, edited: EditedPlan) -> ShaftHandle | None:
        """The direction at the selected point as it is shown: under a hand, also of a point that a hand moves."""
        point = next((p for p in edited.plan.content.points if p.id == edited.selected), None)
        direction = None if point is None else _direction(edited, point)
        if point is None or direction is None:
            return None
        return ShaftHandle(point.id, edited.place_of(point.id) or point.position, direction)

    def shows_another_way(self, edited: EditedPlan) -> bool:
        """Whether a suggested path is shown that the path of the plan does not follow."""
        places, shown = edited.points(), [point.position for point in self._points]
        return self._shown is not None and not (len(places) == len(shown) and np.allclose(places, shown, atol=1e-2))

    def layers(self, edited: EditedPlan | None, locked: bool) -> list[Layer[Any]]:
        """A line at the selected point, with a handle unless it is locked, and the suggested path."""
        handle = None if edited is None else self._handle(edited)
        return [
            Layer("plan.shaft", (handle, locked), ShaftNodes, lambda nodes: nodes.show(handle, locked)),
            Layer("plan.suggested", self._shown, SuggestedNodes, lambda nodes: nodes.show(*self._preview())),
        ]

    def section(self, edited: EditedPlan | None) -> Section[ShaftSection]:
        """The page's section."""
        point = None
        if edited is not None:
            point = next((p for p in edited.plan.content.points if p.id == edited.selected), None)
        of = None if edited is None else (Same(edited.tool), edited.shaft_in_hand)
        return Section((point, of, self.aiming, self._shown), lambda: self._view(edited, point))

    def _view(self, edited: EditedPlan | None, point: PlanPoint | None) -> ShaftSection:
        shown = None if self._shown is None else f"{self._shown[0]} {self._shown[1]}"
        if edited is None or point is None:
            return ShaftSection(point=None, aiming=False, words="", roll_deg=None, bent=False, shown=shown)
        return ShaftSection(
            point=point.id,
            aiming=self.aiming == point.id,
            words=_words_of(edited, point),
            roll_deg=None if point.roll_deg is None else round(point.roll_deg, 1),
            bent=bool(edited.tool["bend_deg"]),
            shown=shown,
        )

    def _alternative(self, edited: EditedPlan, command: SuggestionCommand) -> tuple[PlanPoint, ...]:
        kept = self._services.suggestions.paths(command.suggestion_id)
        if command.type == "suggestion.use":
            kept.check_tool(edited.plan)
        return kept.points_of(edited.plan_id, command.alternative)

    def _preview(self) -> tuple[Array, Array, Array]:
        places, directions = _arrays(self._points)
        curve = curve_points(SplinePath(places)) if len(places) > 1 else None
        return np.zeros((0, 3)) if curve is None else curve, places, directions


def _words_of(edited: EditedPlan, point: PlanPoint) -> str:
    """The direction at a point as it is shown, in words; '' where it is left open."""
    direction = _direction(edited, point)
    return "" if direction is None else direction_words(direction)


def _direction(edited: EditedPlan, point: PlanPoint) -> Position | None:
    """The direction at a point, which a hand may hold; None where it is left open."""
    hand = edited.shaft_in_hand
    return hand[1] if hand is not None and hand[0] == point.id else point.direction


def _point(edited: EditedPlan, item_id: str) -> PlanPoint:
    for point in edited.plan.content.points:
        if point.id == item_id:
            return point
    raise PlanError("that is no point of the path any more; select one.")


def _arrays(points: list[PlanPoint] | tuple[PlanPoint, ...]) -> tuple[Array, Array]:
    places = np.array([point.position for point in points], dtype=np.float64).reshape(-1, 3)
    return places, np.array([point.direction for point in points], dtype=np.float64).reshape(-1, 3)
